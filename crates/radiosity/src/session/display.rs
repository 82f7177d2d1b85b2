//! The mesh of an object that is drawn: its elements as triangles, with light at their corners.
//!
//! Elements around a vertex on the same smooth surface of the object share one value, their mean by area: light is
//! continuous across them and most of the noise of their rays averages out. Where elements of different sizes meet along a line, corners
//! follow the longer edges (`seams`).
//!
//! What is left of that noise made walls mottled. So the part of the light that rays found is averaged over neighbouring vertices
//! besides, as far as these differ by no more than noise explains (a bilateral filter: Tomasi and Manduchi 1998). What lamps
//! bring directly has edges of shadows and stays as it is. The weights follow from all light together and are the same for every
//! layer of it, so that layers still add up.

use super::seams::{Hanging, hanging};
use glam::{DVec2, DVec3, Vec3};
use radiosity_scene::{Bands, Scene, Side, Surface};
use radiosity_transport::live::Shape;
use rustc_hash::FxHashMap;
use std::collections::HashMap;

/// Vertices nearer than this part of the scene's half extent are one, as far as light goes: exporters' single precision.
const SAME_PLACE: f64 = 4e-6;

/// Cosine between normals up to which a surface is smooth: 30°, the usual auto-smooth angle of modelling programs.
const SMOOTH: f32 = 0.866;

/// Rounds of averages over neighbours: noise on walls falls to a half with one and a third with two; three blur contacts more than
/// they help.
const ROUNDS: usize = 2;

/// Differences between vertices that count no more, in relative standard errors of an element. The mean of six elements differs
/// from its neighbour's by half of one; half as much here leaves noise, twice as much takes shadows away.
const REACH: f32 = 2.5;

/// Fewest neighbours of a vertex that are around it: at the border of a surface their mean is one-sided.
const AROUND: usize = 5;

/// The standard error of an element over the median difference of a vertex from the mean of its neighbours: with six elements around
/// each, of which neighbours share two, that difference has 0.32 standard errors of an element as its own, and 0.67 of those as
/// its median.
const PER_MEDIAN: f32 = 4.65;

/// Vertices with neighbours all around that tell noise from light; on smaller objects nothing is averaged.
const TELLING: usize = 16;

/// The light of an element: what lamps bring directly, and the rest, which rays found.
#[derive(Clone, Copy, Debug, Default)]
pub struct Light {
    pub lamps: Bands,
    pub rest: Bands,
}

/// How much the vertices of an object have of each other in averages over neighbours: the same for all layers of one state.
#[derive(Clone, Debug, Default)]
pub struct Weights {
    /// Of each spot itself: its area that is not buried.
    own: Vec<f32>,
    /// Of those beside it, as they are listed.
    beside: Vec<f32>,
}

/// The drawn mesh of a shape. In the coordinates of the file's world.
#[derive(Clone, Debug, Default)]
pub struct Display {
    pub positions: Vec<[f32; 3]>,
    pub normals: Vec<[f32; 3]>,
    pub uvs: Vec<[f32; 2]>,
    /// Three for each element.
    pub indices: Vec<u32>,
    /// Vertices that share light have the same spot.
    spot: Vec<u32>,
    /// Elements around each spot: those of spot s are `starts[s]..starts[s + 1]`, with their weights.
    starts: Vec<u32>,
    around: Vec<(u32, f32)>,
    /// Area of the elements around each spot.
    areas: Vec<f32>,
    /// Spots beside each, as `starts`.
    beside_starts: Vec<u32>,
    beside: Vec<u32>,
    /// Spots whose light is that of the longer edges in which they lie, those that follow others after these.
    following: Vec<Following>,
    /// Where each of them stands in the list.
    following_of: FxHashMap<u32, u32>,
}

/// A spot within an edge, and how much its second end counts.
#[derive(Clone, Copy, Debug)]
struct Following {
    spot: u32,
    ends: [u32; 2],
    share: f32,
}

impl Following {
    fn between(&self, [a, b]: [Bands; 2]) -> Bands {
        std::array::from_fn(|band| (1.0 - self.share) * a[band] + self.share * b[band])
    }
}

struct Spot {
    place: DVec3,
    normal: Vec3,
    around: Vec<(u32, f32)>,
    /// Vertices at the spot, by the bits of their texture coordinates.
    vertices: Vec<([u32; 2], u32)>,
}

impl Display {
    /// The mesh of a shape of a scene whose half extent is `half`.
    pub fn new(scene: &Scene, object: usize, shape: &Shape, half: f64) -> Display {
        let material = &scene.materials[scene.objects[object].material];
        let texture = material.base_color_texture;
        let mut display = Display::default();
        let mut spots: Vec<Spot> = Vec::new();
        let mut at_place: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
        let grain = SAME_PLACE * half.max(f64::MIN_POSITIVE);
        for element in 0..shape.elements() {
            let (t, side, corners) = shape.place(element);
            let [a, b, c] = shape.corners[t];
            let triangle = shape.triangles.start + t;
            let flat = (b - a).cross(c - a);
            let area = 0.5 * flat.length() / f64::from(shape.division[t].pow(2));
            let sign = if side == Side::Front { 1.0 } else { -1.0 };
            let mut own = corners.map(|uv| {
                let point = a + uv.x * (b - a) + uv.y * (c - a);
                let surface = Surface { triangle, uv };
                let normal = sign * scene.shading_normal(surface).unwrap_or_else(|| flat.normalize_or_zero());
                let coordinates = texture.map(|texture| texture.coordinates(mesh_uv(scene, texture.uv_set, surface)));
                let uv = coordinates.map(|uv| uv.as_vec2().to_array());
                vertex(&mut display, &mut spots, &mut at_place, (point, grain), normal.as_vec3(), uv, (element, area))
            });
            if side == Side::Back {
                own.swap(1, 2);
            }
            display.indices.extend(own);
        }
        display.find_seams(&mut spots, half, grain);
        display.starts.push(0);
        for spot in &spots {
            let whole: f32 = spot.around.iter().map(|(_, weight)| weight).sum();
            display.around.extend(spot.around.iter().map(|(element, weight)| (*element, weight / whole)));
            display.starts.push(display.around.len() as u32);
            display.areas.push(whole);
        }
        display.find_beside();
        display
    }

    /// What is around spots that lie within edges, and which of them follow these.
    fn find_seams(&mut self, spots: &mut [Spot], half: f64, grain: f64) {
        let places: Vec<(DVec3, Vec3)> = spots.iter().map(|spot| (spot.place, spot.normal)).collect();
        let corners: Vec<u32> = self.indices.iter().map(|vertex| self.spot[*vertex as usize]).collect();
        for Hanging { spot, element, between } in hanging(&places, &corners, half, grain, SMOOTH) {
            // Both sides of the line count as much.
            let around = &mut spots[spot as usize].around;
            let weight = around.iter().map(|(_, weight)| weight).sum();
            around.push((element, weight));
            if let Some((ends, share)) = between {
                self.following_of.insert(spot, self.following.len() as u32);
                self.following.push(Following { spot, ends, share });
            }
        }
    }

    /// Which spots share an edge of an element.
    fn find_beside(&mut self) {
        let mut pairs: Vec<[u32; 2]> = Vec::with_capacity(2 * self.indices.len());
        for corners in self.indices.chunks_exact(3) {
            let [a, b, c] = [0, 1, 2].map(|k| self.spot[corners[k] as usize]);
            pairs.extend([[a, b], [b, a], [b, c], [c, b], [c, a], [a, c]]);
        }
        pairs.sort_unstable();
        pairs.dedup();
        let before = |spot: usize| pairs.partition_point(|pair| (pair[0] as usize) < spot) as u32;
        self.beside_starts = (0..=self.areas.len()).map(before).collect();
        self.beside = pairs.into_iter().map(|pair| pair[1]).collect();
    }

    /// Light at the vertices, from that of the elements; what is buried does not count. What rays found is averaged by the weights,
    /// if there are any.
    pub fn light(
        &self,
        light: impl Fn(u32) -> Light,
        weights: Option<&Weights>,
        is_buried: impl Fn(u32) -> bool,
    ) -> Vec<Bands> {
        let of = |element| {
            let Light { lamps: [a, b, c], rest: [d, e, f] } = light(element);
            [a, b, c, d, e, f]
        };
        let spots = self.at_spots(of, is_buried);
        let mut rest: Vec<Bands> = spots.iter().map(|([_, _, _, a, b, c], _)| [*a, *b, *c]).collect();
        if let Some(weights) = weights {
            self.average(&mut rest, weights);
        }
        let whole = |(([a, b, c, ..], _), rest): (&([f32; 6], f32), &Bands)| -> Bands {
            let lamps = [a, b, c];
            std::array::from_fn(|band| (lamps[band] + rest[band]).max(0.0))
        };
        let mut whole: Vec<Bands> = spots.iter().zip(&rest).map(whole).collect();
        for following in &self.following {
            whole[following.spot as usize] = following.between(following.ends.map(|end| whole[end as usize]));
        }
        self.spot.iter().map(|spot| whole[*spot as usize]).collect()
    }

    /// Light at a place of a triangle, given what [`Display::light`] answers.
    pub fn at(&self, light: &[Bands], triangle: u32, [v, w]: [f32; 2]) -> Bands {
        let corners = &self.indices[3 * triangle as usize..][..3];
        let of = |k: usize| light.get(corners[k] as usize).copied().unwrap_or_default();
        let [a, b, c] = [of(0), of(1), of(2)];
        std::array::from_fn(|band| (1.0 - v - w) * a[band] + v * b[band] + w * c[band])
    }

    /// The spot of a vertex.
    pub fn spot_of(&self, vertex: u32) -> usize {
        self.spot[vertex as usize] as usize
    }

    /// The spots of the corners of an element.
    pub fn spots(&self, element: u32) -> [usize; 3] {
        [0, 1, 2].map(|k| self.spot_of(self.indices[3 * element as usize + k]))
    }

    /// What follows from the elements around each spot, which come with their weights.
    pub fn around_spots<T>(&self, of: impl Fn(&[(u32, f32)]) -> T) -> Vec<T> {
        (0..self.areas.len()).map(|spot| of(self.around(spot))).collect()
    }

    /// The elements around a spot, with their weights.
    pub fn around(&self, spot: usize) -> &[(u32, f32)] {
        &self.around[self.starts[spot] as usize..self.starts[spot + 1] as usize]
    }

    /// 1 at a spot all elements around which are such, 0 at another; one within a longer edge follows its ends.
    pub fn share(&self, spot: usize, are: &impl Fn(u32) -> bool) -> f32 {
        match self.following_of.get(&(spot as u32)) {
            Some(place) => {
                let Following { ends, share, .. } = self.following[*place as usize];
                let [a, b] = ends.map(|end| self.share(end as usize, are));
                (1.0 - share) * a + share * b
            }
            None => f32::from(u8::from(self.around(spot).iter().all(|(element, _)| are(*element)))),
        }
    }

    /// Means of the elements around each spot, as far as they are not buried, and their area there.
    fn at_spots<const N: usize>(
        &self,
        of: impl Fn(u32) -> [f32; N],
        is_buried: impl Fn(u32) -> bool,
    ) -> Vec<([f32; N], f32)> {
        let element = |element: u32| (!is_buried(element)).then(|| of(element));
        let elements: Vec<Option<[f32; N]>> = (0..self.indices.len() as u32 / 3).map(element).collect();
        (0..self.areas.len()).map(|spot| self.at_spot(spot, |element| elements[element as usize])).collect()
    }

    /// The mean of the elements around a spot, as far as they are not buried, and their area there.
    fn at_spot<const N: usize>(&self, spot: usize, of: impl Fn(u32) -> Option<[f32; N]>) -> ([f32; N], f32) {
        let (mut sum, mut whole) = ([0f32; N], 0f32);
        for (element, weight) in self.around(spot) {
            if let Some(own) = of(*element) {
                whole += weight;
                (0..N).for_each(|k| sum[k] += weight * own[k]);
            }
        }
        (sum.map(|s| if whole > 0.0 { s / whole } else { 0.0 }), whole * self.areas[spot])
    }

    /// Direct light at the corners of an element, from that of the elements, none of what is buried: as [`Display::light`] has it.
    pub fn corners(&self, element: u32, of: impl Fn(u32) -> Option<Bands>) -> [Bands; 3] {
        self.spots(element).map(|spot| self.direct(spot as u32, &of))
    }

    fn direct(&self, spot: u32, of: &impl Fn(u32) -> Option<Bands>) -> Bands {
        match self.following_of.get(&spot) {
            Some(place) => {
                let following = &self.following[*place as usize];
                following.between(following.ends.map(|end| self.direct(end, of)))
            }
            None => self.at_spot(spot as usize, of).0,
        }
    }

    /// The weights of averages, by `guide`, the luminance of what rays found of all light, and the most that is taken for its
    /// relative standard error by element.
    pub fn weights(&self, guide: impl Fn(u32) -> f32, noise: f32, is_buried: impl Fn(u32) -> bool) -> Weights {
        let spots = self.at_spots(|element| [guide(element)], is_buried);
        let noise = noise.min(self.noise(&spots));
        // Tukey's biweight of the difference, relative to the mean of both.
        let weight = |a: usize, b: u32| {
            let ([a], ([b], area)) = (spots[a].0, spots[b as usize]);
            let largest = REACH * noise * 0.5 * (a + b);
            let near = if largest > 0.0 { (1.0 - ((a - b) / largest).powi(2)).max(0.0) } else { 0.0 };
            area * near * near
        };
        let mut beside = Vec::with_capacity(self.beside.len());
        for spot in 0..spots.len() {
            beside.extend(self.beside[self.beside(spot)].iter().map(|n| weight(spot, *n)));
        }
        Weights { own: spots.into_iter().map(|(_, area)| area).collect(), beside }
    }

    /// Where the spots beside one are listed.
    fn beside(&self, spot: usize) -> std::ops::Range<usize> {
        self.beside_starts[spot] as usize..self.beside_starts[spot + 1] as usize
    }

    /// The relative standard error of elements, as vertices tell by how far they are from the mean of their neighbours: light that
    /// rises or falls evenly does not count, and the median is that of the many places where it does.
    fn noise(&self, spots: &[([f32; 1], f32)]) -> f32 {
        let guide = |spot: u32| spots[spot as usize].0[0];
        let mut apart: Vec<f32> = Vec::new();
        for spot in 0..spots.len() as u32 {
            let beside = &self.beside[self.beside(spot as usize)];
            if beside.len() < AROUND || guide(spot) <= 0.0 {
                continue;
            }
            let mean = beside.iter().map(|n| guide(*n)).sum::<f32>() / beside.len() as f32;
            apart.push((guide(spot) - mean).abs() / guide(spot));
        }
        if apart.len() < TELLING {
            return 0.0;
        }
        let middle = apart.len() / 2;
        PER_MEDIAN * *apart.select_nth_unstable_by(middle, f32::total_cmp).1
    }

    /// Averages over neighbours that differ by no more than noise.
    fn average(&self, rest: &mut Vec<Bands>, weights: &Weights) {
        for _ in 0..ROUNDS {
            let averaged = |(spot, own): (usize, &Bands)| {
                let mut whole = weights.own[spot];
                let mut sum = own.map(|x| whole * x);
                for (n, weight) in self.beside[self.beside(spot)].iter().zip(&weights.beside[self.beside(spot)]) {
                    whole += weight;
                    let other = rest[*n as usize];
                    (0..3).for_each(|band| sum[band] += weight * other[band]);
                }
                sum.map(|x| if whole > 0.0 { x / whole } else { 0.0 })
            };
            *rest = rest.iter().enumerate().map(averaged).collect();
        }
    }
}

/// The vertex at a place, which is made if there is none; it gets the element around it.
fn vertex(
    display: &mut Display,
    spots: &mut Vec<Spot>,
    at_place: &mut HashMap<[i64; 3], Vec<u32>>,
    (point, grain): (DVec3, f64),
    normal: Vec3,
    uv: Option<[f32; 2]>,
    (element, area): (u32, f64),
) -> u32 {
    let here = at_place.entry((point / grain).round().to_array().map(|x| x as i64)).or_default();
    let known = here.iter().find(|spot| spots[**spot as usize].normal.dot(normal) >= SMOOTH).copied();
    let spot = known.unwrap_or_else(|| {
        spots.push(Spot { place: point, normal, around: Vec::new(), vertices: Vec::new() });
        here.push(spots.len() as u32 - 1);
        spots.len() as u32 - 1
    });
    let own = &mut spots[spot as usize];
    own.around.push((element, area as f32));
    let bits = uv.unwrap_or_default().map(f32::to_bits);
    if let Some((_, vertex)) = own.vertices.iter().find(|(other, _)| *other == bits) {
        return *vertex;
    }
    let vertex = display.positions.len() as u32;
    own.vertices.push((bits, vertex));
    display.positions.push(point.as_vec3().to_array());
    display.normals.push(normal.to_array());
    display.uvs.extend(uv);
    display.spot.push(spot);
    vertex
}

fn mesh_uv(scene: &Scene, set: usize, at: Surface) -> DVec2 {
    let set = &scene.uvs[set.min(1)];
    if set.is_empty() {
        return DVec2::ZERO;
    }
    let [a, b, c] = scene.triangles[at.triangle].map(|v| set[v as usize].as_dvec2());
    a + at.uv.x * (b - a) + at.uv.y * (c - a)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Elements of a wall, and where each of them is across it, from 0 to 1.
    fn wall() -> (Display, Vec<f64>) {
        let scene = crate::cornell_box();
        let floor = scene.objects.iter().position(|object| object.name == "floor").unwrap();
        let shape = Shape::new(&scene, floor, 0.01);
        let across = |element| {
            let (t, _, corners) = shape.place(element);
            let [a, b, c] = shape.corners[t];
            let uv = (corners[0] + corners[1] + corners[2]) / 3.0;
            (a + uv.x * (b - a) + uv.y * (c - a)).x
        };
        let places: Vec<f64> = (0..shape.elements()).map(across).collect();
        let (low, high) = places.iter().fold((f64::MAX, f64::MIN), |(l, h), x| (l.min(*x), h.max(*x)));
        let places = places.into_iter().map(|x| (x - low) / (high - low)).collect();
        (Display::new(&scene, floor, &shape, 0.3), places)
    }

    /// Numbers of mean 0 and variance 1, the same each time.
    fn noise(element: u32) -> f32 {
        use radiosity_trace::sampling::{hash, unit};
        // Of four uniform numbers, each of variance 1/12.
        (0..4).map(|k| unit(hash(4 * element + k)) - 0.5).sum::<f32>() * 3f32.sqrt()
    }

    fn spread(light: &[Bands], truth: f32) -> f32 {
        (light.iter().map(|e| (e[1] - truth).powi(2)).sum::<f32>() / light.len() as f32).sqrt() / truth
    }

    #[test]
    fn noise_of_rays_falls_and_light_of_lamps_stays() {
        let (display, places) = wall();
        assert!(places.len() > 1000);
        let found = |element: u32| 100.0 * (1.0 + 0.0625 * noise(element));
        let light = |element| Light { lamps: [0.0; 3], rest: [found(element); 3] };
        let weights = display.weights(found, 0.0625, |_| false);
        let plain = display.light(light, None, |_| false);
        let filtered = display.light(light, Some(&weights), |_| false);
        let (before, after) = (spread(&plain, 100.0), spread(&filtered, 100.0));
        assert!(before > 0.02 && after < 0.5 * before, "{before} {after}");
        // What lamps bring is the mean of what is around, whatever the noise of the rest.
        let lamp = |element: u32| Light { lamps: [found(element); 3], rest: [0.0; 3] };
        assert_eq!(display.light(lamp, Some(&weights), |_| false), plain);
    }

    /// On both sides of a line along which elements of 25 cm meet such of 33 cm, without a corner in common but for its ends.
    #[test]
    fn light_is_one_on_both_sides_of_a_seam() {
        let v = |x: f64, y: f64| DVec3::new(x, y, 0.0);
        let quad = |low: DVec3, high: DVec3| [[low, v(high.x, low.y), high], [low, high, v(low.x, high.y)]];
        let third = |k: f64| [v(0.0, k / 3.0), v(1.0 / 3.0, (k + 1.0) / 3.0)];
        let sides = [[v(-1.0, 0.0), v(0.0, 1.0)], third(0.0), third(1.0), third(2.0)];
        let mut scene = Scene::default();
        scene.materials.push(Default::default());
        scene.add_triangles("floor", 0, &sides.into_iter().flat_map(|[low, high]| quad(low, high)).collect::<Vec<_>>());
        let shape = Shape::new(&scene, 0, 0.3);
        let display = Display::new(&scene, 0, &shape, 1.0);
        let of = |element: u32| Some([100.0 * (1.0 + 0.05 * noise(element)); 3]);
        let light = display.light(|element| Light { lamps: of(element).unwrap(), rest: [0.0; 3] }, None, |_| false);
        let corner = |vertex: u32| display.positions[vertex as usize];
        // Light along the line, from the elements of a side whose edges are in it.
        let along = |side: f32, y: f32| {
            let edges = display.indices.chunks_exact(3).filter(|own| own.iter().any(|k| side * corner(*k)[0] > 0.0));
            let edges = edges.flat_map(|own| [[own[0], own[1]], [own[1], own[2]], [own[2], own[0]]]);
            let [a, b] = edges
                .filter(|ends| ends.iter().all(|k| corner(*k)[0] == 0.0 && display.normals[*k as usize][2] > 0.5))
                .find(|ends| (corner(ends[0])[1] - y) * (corner(ends[1])[1] - y) <= 0.0)
                .unwrap();
            let share = (y - corner(a)[1]) / (corner(b)[1] - corner(a)[1]);
            (1.0 - share) * light[a as usize][1] + share * light[b as usize][1]
        };
        let apart = (0..1000).map(|k| (k as f32 + 0.5) / 1000.0).map(|y| (along(-1.0, y) - along(1.0, y)).powi(2));
        let apart = (apart.sum::<f32>() / 1000.0).sqrt();
        assert!(display.following.len() == 3 && apart < 1.0, "{} {apart}", display.following.len());
        for element in 0..display.indices.len() as u32 / 3 {
            let shown = [0, 1, 2].map(|k| light[display.indices[3 * element as usize + k] as usize]);
            assert_eq!(display.corners(element, of), shown);
        }
    }

    #[test]
    fn an_edge_of_light_stays_sharp_and_layers_add_up() {
        let (display, places) = wall();
        let step = |element: u32| if places[element as usize] < 0.5 { 100.0 } else { 150.0 };
        let total = |element: u32| step(element) * (1.0 + 0.01 * noise(element));
        let rest = |share: f32| move |element| Light { lamps: [0.0; 3], rest: [share * total(element); 3] };
        let weights = display.weights(total, 0.0625, |_| false);
        let filtered = display.light(rest(1.0), Some(&weights), |_| false);
        // An element, on a floor that is 0.5528 m wide. Averages that did not look for edges would reach three.
        let width = 0.02;
        let mut near = 0;
        for (light, p) in filtered.iter().zip(&display.positions) {
            let across = f64::from(p[0]) / 0.5528 - 0.5;
            let right = if across < 0.0 { 100.0 } else { 150.0 };
            near += usize::from((width..3.0 * width).contains(&across.abs()));
            assert!(across.abs() < width || (light[1] - right).abs() < 3.0, "{p:?}: {light:?}");
        }
        assert!(near > 50, "{near}");
        let parts = [0.25, 0.75].map(|share| display.light(rest(share), Some(&weights), |_| false));
        for ((a, b), all) in parts[0].iter().zip(&parts[1]).zip(&filtered) {
            assert!((a[1] + b[1] - all[1]).abs() < 1e-3);
        }
    }
}
