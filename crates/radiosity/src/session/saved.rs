//! The scene as edits leave it.

use super::Session;
use super::paint::brighter;
use glam::{DAffine3, DMat4};
use radiosity_scene::{Scene, Sky, Source};

impl Session {
    /// The scene as it is edited now, to be written to a file: what was moved is where it is, what was painted has materials of
    /// its own, and what was taken away is gone. Lights that were dimmed give as much as they do.
    pub fn edited_scene(&self) -> Scene {
        let from = self.scene();
        let mut scene = Scene {
            positions: Vec::new(),
            normals: Vec::new(),
            uvs: Default::default(),
            colors: Vec::new(),
            triangles: Vec::new(),
            triangle_object: Vec::new(),
            triangle_source: Vec::new(),
            objects: Vec::new(),
            lights: Vec::new(),
            ..from.clone()
        };
        // Pictures that were painted brighter: which, by how much, and where the new one is.
        let mut painted: Vec<(usize, [f32; 3], usize)> = Vec::new();
        for (index, (placed, body)) in self.objects.iter().zip(&self.live.world().bodies).enumerate() {
            if !body.is_present {
                continue;
            }
            let object = &from.objects[placed.source];
            let (vertices, triangles) = (object.vertices.clone(), object.triangles.clone());
            let (first_vertex, first_triangle) = (scene.positions.len(), scene.triangles.len());
            let turned = DMat4::from(body.matrix).inverse().transpose();
            scene.positions.extend(from.positions[vertices.clone()].iter().map(|p| body.matrix.transform_point3(*p)));
            scene.normals.extend(from.normals[vertices.clone()].iter().map(|n| {
                if body.matrix == DAffine3::IDENTITY {
                    *n
                } else {
                    turned.transform_vector3(n.as_dvec3()).normalize_or_zero().as_vec3()
                }
            }));
            for (to, from) in scene.uvs.iter_mut().zip(&from.uvs) {
                to.extend(from.get(vertices.clone()).into_iter().flatten());
            }
            scene.colors.extend(from.colors.get(vertices.clone()).into_iter().flatten());
            let shifted = |v: u32| (v as usize - vertices.start + first_vertex) as u32;
            scene.triangles.extend(from.triangles[triangles.clone()].iter().map(|t| t.map(shifted)));
            scene.triangle_object.extend(triangles.clone().map(|_| scene.objects.len() as u32));
            scene.triangle_source.extend(&from.triangle_source[triangles.clone()]);

            let mut material = from.materials[object.material].clone();
            let is_as_it_was = material.clone();
            if let Some(coat) = placed.coat {
                // What is above the most that a colour may be goes into the picture, or into the colours of vertices.
                let mut excess = [1.0f32; 3];
                for (band, excess) in excess.iter_mut().enumerate() {
                    let (coat, mean) = (coat[band], placed.paint.mean[band]);
                    let keeps_pattern = placed.paint.is_varied && mean > 0.0;
                    let wanted = if keeps_pattern { material.base_color[band] * (coat / mean) } else { coat };
                    material.base_color[band] = wanted.min(1.0);
                    *excess = wanted.max(1.0);
                }
                if let Some(texture) = material.base_color_texture.as_mut().filter(|_| excess != [1.0; 3]) {
                    let known = painted.iter().find(|known| (known.0, known.1) == (texture.texture, excess));
                    texture.texture = match known {
                        Some((.., made)) => *made,
                        None => {
                            let made = scene.textures.len();
                            scene.textures.push(brighter(&from.textures[texture.texture], excess));
                            painted.push((texture.texture, excess, made));
                            made
                        }
                    };
                } else if !scene.colors.is_empty() {
                    for colour in &mut scene.colors[first_vertex..] {
                        (0..3).for_each(|band| colour[band] = (colour[band] * excess[band]).min(1.0));
                    }
                }
                if !placed.paint.is_varied {
                    material.metallic = 0.0;
                }
            }
            if let Some(light) = placed.light {
                let factor = self.lights[light].factor();
                (0..3).for_each(|band| material.emissive[band] *= factor[band]);
            }
            let material = if material == is_as_it_was {
                object.material
            } else {
                scene.materials.push(material);
                scene.materials.len() - 1
            };
            let is_new = index >= self.handed_in;
            let source = if is_new { Source { node: index, mesh: index, ..Source::default() } } else { object.source };
            scene.objects.push(radiosity_scene::Object {
                name: object.name.clone(),
                material,
                triangles: first_triangle..scene.triangles.len(),
                vertices: first_vertex..scene.positions.len(),
                source,
            });
        }
        for light in self.lights.iter().filter(|light| !light.is_gone) {
            let factor = light.factor();
            if let Some(mut point) = light.placed() {
                (0..3).for_each(|band| point.intensity[band] *= factor[band]);
                scene.lights.push(point);
            } else if light.kind == super::LightKind::Sky {
                let dim = |l: radiosity_scene::Bands| std::array::from_fn(|band| l[band] * factor[band]);
                scene.sky = match &from.sky {
                    Sky::Black => Sky::Black,
                    Sky::Uniform(l) => Sky::Uniform(dim(*l)),
                    Sky::Overcast { horizontal } => Sky::Overcast { horizontal: dim(*horizontal) },
                    Sky::Map { width, height, pixels } => {
                        let pixels = pixels.iter().map(|l| dim(*l)).collect();
                        Sky::Map { width: *width, height: *height, pixels }
                    }
                };
            }
        }
        scene
    }
}
