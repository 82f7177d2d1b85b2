//! A scene, flattened: every placed triangle in world space, with what the author said about it.

use crate::material::MAX_REFLECTANCE;
use crate::{
    AlphaMode, Bands, Camera, Faults, Material, PointLight, PointLightKind, Sky, Texture, TextureRef, counted,
};
use glam::{DVec2, DVec3, Vec2, Vec3};
use std::ops::Range;

/// Fewest and most places that pictures on an element are averaged over. The mean of 64 of black and white squares is off by 2 to 7 % in
/// the root mean square, the more squares there are, that of 16 by 6 to 15 %; elements beside each other by other amounts, so that
/// it averages out over what a receiver sees. Twice as many halve that and double the time of pictures.
const PLACES_FOR_MEAN: [u32; 2] = [16, 64];

/// One primitive of one mesh, placed once in the world.
#[derive(Clone, Debug, PartialEq)]
pub struct Object {
    /// Name for people: of the node, else of the mesh.
    pub name: String,
    /// Index into [`Scene::materials`].
    pub material: usize,
    /// Its triangles, contiguous in [`Scene::triangles`].
    pub triangles: Range<usize>,
    /// Its vertices, contiguous in [`Scene::positions`], in the order of the source's accessors.
    pub vertices: Range<usize>,
    /// Where it came from in the source file: node, mesh, primitive, and instance on that node
    /// (EXT_mesh_gpu_instancing; 0 otherwise). Unused numbers are 0.
    pub source: Source,
}

/// Where an object stands in its source file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Source {
    /// Index of the node.
    pub node: usize,
    /// Index of the mesh.
    pub mesh: usize,
    /// Index of the primitive in its mesh.
    pub primitive: usize,
    /// Index of the instance on the node.
    pub instance: usize,
}

/// Everything the user handed in. Lengths in metres, luminance in cd/m², intensity in cd, illuminance in lx.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scene {
    /// Name for people, e.g. the file's stem.
    pub name: String,
    /// Zenith direction (unit): +Y for glTF, by option for others.
    pub up: Up,
    /// World positions, all finite.
    pub positions: Vec<DVec3>,
    /// Unit shading normals by vertex; zero where the author gave none. Same length as `positions`.
    pub normals: Vec<Vec3>,
    /// Two sets of texture coordinates by vertex; each empty or as long as `positions`.
    pub uvs: [Vec<Vec2>; 2],
    /// Linear vertex colours; empty or as long as `positions`.
    pub colors: Vec<[f32; 4]>,
    /// Vertex indices, counter-clockwise seen from the front. No triangle has zero area.
    pub triangles: Vec<[u32; 3]>,
    /// Index of each triangle's object.
    pub triangle_object: Vec<u32>,
    /// Index of each triangle within its source primitive, before degenerate ones were dropped.
    pub triangle_source: Vec<u32>,
    /// Placed primitives.
    pub objects: Vec<Object>,
    /// Materials.
    pub materials: Vec<Material>,
    /// Pictures.
    pub textures: Vec<Texture>,
    /// Lights without area.
    pub lights: Vec<PointLight>,
    /// Cameras.
    pub cameras: Vec<Camera>,
    /// What escaping rays see. [`Scene::set_sky`] sets a map that may have a sun.
    pub sky: Sky,
}

/// Which axis points to the zenith.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Up {
    /// +Y, as in glTF.
    #[default]
    Y,
    /// +Z, as in CAD and lighting design.
    Z,
}

impl Up {
    /// The unit zenith direction.
    pub fn direction(self) -> DVec3 {
        match self {
            Up::Y => DVec3::Y,
            Up::Z => DVec3::Z,
        }
    }
}

/// A point of a triangle by its source index and barycentric coordinates: weight `u` of corner 1, `v` of corner 2.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// Index into [`Scene::triangles`].
    pub triangle: usize,
    /// Barycentric coordinates of corners 1 and 2.
    pub uv: DVec2,
}

impl Surface {
    fn weights(&self) -> [f64; 3] {
        [1.0 - self.uv.x - self.uv.y, self.uv.x, self.uv.y]
    }
}

impl Scene {
    /// Corner positions of a triangle.
    pub fn corners(&self, triangle: usize) -> [DVec3; 3] {
        self.triangles[triangle].map(|v| self.positions[v as usize])
    }

    /// Area of a triangle, m².
    pub fn area(&self, triangle: usize) -> f64 {
        let [a, b, c] = self.corners(triangle);
        0.5 * (b - a).cross(c - a).length()
    }

    /// Material of a triangle.
    pub fn material(&self, triangle: usize) -> &Material {
        &self.materials[self.objects[self.triangle_object[triangle] as usize].material]
    }

    /// Memory that its surfaces and pictures take, bytes.
    pub fn bytes(&self) -> usize {
        let of_vertices = size_of_val(&*self.positions)
            + size_of_val(&*self.normals)
            + self.uvs.iter().map(|set| size_of_val(&**set)).sum::<usize>()
            + size_of_val(&*self.colors);
        let of_triangles =
            size_of_val(&*self.triangles) + size_of_val(&*self.triangle_object) + size_of_val(&*self.triangle_source);
        of_vertices
            + of_triangles
            + size_of_val(&*self.objects)
            + self.textures.iter().map(|texture| size_of_val(&*texture.texels)).sum::<usize>()
    }

    /// Smallest box around all positions; `None` without any.
    pub fn bounding_box(&self) -> Option<[DVec3; 2]> {
        let first = *self.positions.first()?;
        Some(self.positions.iter().fold([first, first], |[lo, hi], &p| [lo.min(p), hi.max(p)]))
    }

    /// Adds one object from a list of triangles (corner positions, counter-clockwise from the front) without
    /// pictures: the simplest way to build a scene in code. Returns the object's index.
    pub fn add_triangles(&mut self, name: &str, material: usize, triangles: &[[DVec3; 3]]) -> usize {
        let (first_vertex, first_triangle) = (self.positions.len(), self.triangles.len());
        let object = self.objects.len();
        for (i, corners) in triangles.iter().enumerate() {
            let base = self.positions.len() as u32;
            self.positions.extend(corners);
            self.normals.extend([Vec3::ZERO; 3]);
            for uvs in self.uvs.iter_mut().filter(|uvs| !uvs.is_empty()) {
                uvs.extend([Vec2::ZERO; 3]);
            }
            if !self.colors.is_empty() {
                self.colors.extend([[1.0; 4]; 3]);
            }
            self.triangles.push([base, base + 1, base + 2]);
            self.triangle_object.push(object as u32);
            self.triangle_source.push(i as u32);
        }
        self.objects.push(Object {
            name: name.to_owned(),
            material,
            triangles: first_triangle..self.triangles.len(),
            vertices: first_vertex..self.positions.len(),
            source: Source { node: object, mesh: object, ..Source::default() },
        });
        object
    }

    /// Adds a planar convex quadrilateral (corners counter-clockwise from the front), split along corners 0 and 2.
    pub fn add_quad(&mut self, name: &str, material: usize, [a, b, c, d]: [DVec3; 4]) -> usize {
        self.add_triangles(name, material, &[[a, b, c], [a, c, d]])
    }

    /// Makes a sky what escaping rays see. The suns of a map become directional lights called "sun of `name`", on top of
    /// the scene's own ([`Sky::take_suns`] says which and what is lost), but for those of that name: a file that was written of the
    /// scene under this sky has its suns as lamps, and they would shine twice. Set [`Scene::up`] before.
    pub fn set_sky(&mut self, mut sky: Sky, name: &str) {
        let name = format!("sun of {name}");
        self.lights.retain(|light| light.kind != PointLightKind::Directional || light.name != name);
        self.lights.extend(sky.take_suns(&name, self.up.direction()));
        self.sky = sky;
    }

    /// Diffuse reflectance ρ per band at a point, at most [`MAX_REFLECTANCE`].
    pub fn reflectance(&self, at: Surface) -> Bands {
        match self.material(at.triangle).transmission {
            None => self.plain_reflectance(at),
            Some(_) => self.returned(at)[0],
        }
    }

    /// Diffuse transmittance τ per band at a point: of the light that falls on one side, the share that leaves the other
    /// diffusely. ρ + τ is at most [`MAX_REFLECTANCE`].
    pub fn transmittance(&self, at: Surface) -> Bands {
        match self.material(at.triangle).transmission {
            None => [0.0; 3],
            Some(_) => self.returned(at)[1],
        }
    }

    /// Whether any surface transmits light.
    pub fn transmits(&self) -> bool {
        self.objects.iter().any(|object| self.materials[object.material].transmits())
    }

    /// ρ and τ of a point of a sheet, together at most [`MAX_REFLECTANCE`]: what is too much is taken from both alike.
    fn returned(&self, at: Surface) -> [Bands; 2] {
        let material = self.material(at.triangle);
        let Some(transmission) = &material.transmission else { return [self.plain_reflectance(at), [0.0; 3]] };
        let share = transmission.share_texture.as_ref().map_or(1.0, |texture| self.look_up(texture, at, false)[3]);
        let tint = transmission.texture.as_ref().map_or([1.0; 4], |texture| self.look_up(texture, at, true));
        let (base, diffuse) = (self.base_color(material, at), self.diffuse_share(material, at));
        let mut both = [[0.0; 3]; 2];
        for band in 0..3 {
            let rho = (base[band] * diffuse * (1.0 - transmission.replaced * share)).max(0.0);
            let tau = (transmission.transmittance[band] * tint[band] * diffuse * share).max(0.0);
            let scale = MAX_REFLECTANCE / (rho + tau);
            (both[0][band], both[1][band]) = match tau {
                0.0 => (rho.min(MAX_REFLECTANCE), 0.0),
                _ if scale < 1.0 => (rho * scale, tau * scale),
                _ => (rho, tau),
            };
        }
        both
    }

    fn plain_reflectance(&self, at: Surface) -> Bands {
        let material = self.material(at.triangle);
        let base = self.base_color(material, at);
        let diffuse = self.diffuse_share(material, at);
        std::array::from_fn(|band| (base[band] * diffuse).clamp(0.0, MAX_REFLECTANCE))
    }

    /// What is no metal.
    fn diffuse_share(&self, material: &Material, at: Surface) -> f32 {
        let metallic = match &material.metallic_texture {
            Some(texture) => material.metallic * self.look_up(texture, at, false)[2],
            None => material.metallic,
        };
        1.0 - metallic.clamp(0.0, 1.0)
    }

    /// Luminance per band that a ray finds which the surface stops at a point, cd/m². Light that is asked of the
    /// surface without such a ray is [`Scene::opacity`] times this.
    pub fn emitted_luminance(&self, at: Surface) -> Bands {
        let material = self.material(at.triangle);
        match &material.emissive_texture {
            Some(texture) if material.emits() => {
                let tint = self.look_up(texture, at, true);
                std::array::from_fn(|band| material.emissive[band] * tint[band])
            }
            _ => material.emissive,
        }
    }

    /// The share of the light that the surface stops at a point: 1 opaque, 0 cut out.
    pub fn opacity(&self, at: Surface) -> f32 {
        let material = self.material(at.triangle);
        match material.alpha_mode {
            AlphaMode::Opaque => 1.0,
            AlphaMode::Mask { cutoff } => {
                if self.base_color(material, at)[3] < cutoff {
                    0.0
                } else {
                    1.0
                }
            }
            AlphaMode::Blend => self.base_color(material, at)[3].clamp(0.0, 1.0),
        }
    }

    /// Interpolated shading normal (unit, on the front side), or `None` where the author gave none.
    pub fn shading_normal(&self, at: Surface) -> Option<DVec3> {
        let corners = self.triangles[at.triangle];
        let mut sum = DVec3::ZERO;
        for (vertex, weight) in corners.into_iter().zip(at.weights()) {
            let normal = self.normals[vertex as usize];
            if normal == Vec3::ZERO {
                return None;
            }
            sum += weight * normal.as_dvec3();
        }
        sum.try_normalize()
    }

    /// Whether pictures or vertex colours vary what a surface of a material gives back or lets through.
    pub fn varies_reflectance(&self, material: &Material) -> bool {
        material.reflectance_pictures().next().is_some() || !self.colors.is_empty()
    }

    /// Over how many places the optics of a piece of a triangle are averaged, by its corners: one where nothing varies, else one
    /// for each texel of the finest picture, within bounds.
    pub fn places_for_mean(&self, corners: [Surface; 3]) -> u32 {
        let material = self.material(corners[0].triangle);
        if material.emissive_texture.is_none() && !self.varies_reflectance(material) {
            return 1;
        }
        let texels = |picture: &TextureRef| {
            let size = &self.textures[picture.texture];
            let [a, b, c] = corners.map(|at| picture.coordinates(self.texture_coordinates(picture.uv_set, at)));
            0.5 * (b - a).perp_dot(c - a).abs() * f64::from(size.width) * f64::from(size.height)
        };
        let finest = material.pictures().map(texels).fold(0.0, f64::max);
        (finest as u32).clamp(PLACES_FOR_MEAN[0], PLACES_FOR_MEAN[1])
    }

    fn texture_coordinates(&self, uv_set: usize, at: Surface) -> DVec2 {
        let set = &self.uvs[uv_set.min(1)];
        if set.is_empty() {
            return DVec2::ZERO;
        }
        let corners = self.triangles[at.triangle];
        corners.into_iter().zip(at.weights()).fold(DVec2::ZERO, |sum, (v, w)| sum + w * set[v as usize].as_dvec2())
    }

    fn base_color(&self, material: &Material, at: Surface) -> [f32; 4] {
        let mut color = material.base_color;
        if let Some(texture) = &material.base_color_texture {
            let tint = self.look_up(texture, at, true);
            color = std::array::from_fn(|i| color[i] * tint[i]);
        }
        if !self.colors.is_empty() {
            let corners = self.triangles[at.triangle];
            let mut tint = [0.0; 4];
            for (vertex, weight) in corners.into_iter().zip(at.weights()) {
                for (sum, c) in tint.iter_mut().zip(self.colors[vertex as usize]) {
                    *sum += weight as f32 * c;
                }
            }
            color = std::array::from_fn(|i| color[i] * tint[i]);
        }
        color
    }

    fn look_up(&self, texture: &TextureRef, at: Surface, srgb: bool) -> [f32; 4] {
        let uv = self.texture_coordinates(texture.uv_set, at);
        self.textures[texture.texture].sample(texture.coordinates(uv), texture.wrap, texture.nearest, srgb)
    }

    /// Checks what every later stage takes for granted, naming each fault: finite positions, indices in range,
    /// areas above zero, reflectances in 0..1, with transmittances at most 1, finite emission of at least 0, some area at
    /// all. Drops nothing.
    pub fn validate(&self, place: &str) -> Faults {
        let mut faults = Faults::default();
        let of = |object: &Object| format!("{place}: object '{}'", object.name);
        for object in &self.objects {
            let bad = self.positions[object.vertices.clone()].iter().filter(|p| !p.is_finite()).count();
            if bad > 0 {
                faults.error(
                    of(object),
                    format!("{} not finite", counted(bad, "vertex is", "vertices are")),
                    "export the model again",
                );
            }
            let flat = object
                .triangles
                .clone()
                .filter(|&t| self.area(t).partial_cmp(&0.0) != Some(std::cmp::Ordering::Greater))
                .count();
            if flat > 0 {
                faults.error(
                    of(object),
                    format!("{} no area", counted(flat, "triangle has", "triangles have")),
                    "remove them",
                );
            }
        }
        for material in &self.materials {
            let place = format!("{place}: material '{}'", material.name);
            if material.base_color.iter().any(|c| !(0.0..=1.0).contains(c)) {
                faults.error(&place, format!("base colour {:?}", material.base_color), "use values in 0..1");
            }
            if material.emissive.iter().any(|e| !e.is_finite() || *e < 0.0) {
                faults.error(&place, format!("emission {:?}", material.emissive), "use finite values, 0 or more");
            }
            material.check_transmission(&place, &mut faults);
        }
        if self.triangles.is_empty() {
            faults.error(place, "no triangle with an area", "a scene needs at least one surface");
        }
        faults
    }
}
