//! The referee: an unbiased path tracer of irradiance, sharing nothing with the engine but rays, where narrow beams end, and where openings are (catalogue 3, 70).
//!
//! E(x) = Σ over light samples + Σ over one cosine-distributed ray that carries on from what it meets; emitters are
//! found both ways and weighted by the balance heuristic (Veach 1997, §9.2); paths end by roulette, and where they meet a
//! sheet that transmits light they go on from one of its sides, by what each sends. Reflectance, transmittance and
//! emission are looked up at the very point, not on elements. First bounces are stratified by scrambled Sobol' points:
//! a plain path tracer is 1.7 to 4.5 times worse, and comparing with the worse would flatter us.
//!
//! Light that has met one surface is found a third way: what a light path met first is looked at from each place of a path, and the three are
//! weighted by the balance heuristic as well (Veach 1997, §10.2, with light paths of one edge). What it adds is bounded, however near
//! the two places are. Where lamps shine mostly on what is beside them — coves, shades, strips under a ceiling — a band of a thousandth of
//! the room gives half of its light, and paths that find it by chance alone have hundreds of times the variance; in the Cornell box and
//! an office they have 1.75 and 1.5 times as much after two thirds of the time.
//!
//! Where lamps without area light something through a small opening, the end of the beam is itself a lamp to all that sees it: it is sampled by
//! area and weighted against the paths that meet it by chance (`beams.rs`). Of beams that were not found neither the engine nor this knows but by chance.
//!
//! Where the sky shines in through small openings, one more ray from each place of a path goes through one of them, weighted against those that get out by chance.

use beams::BeamEnds;
use glam::{DVec2, DVec3};
use radiosity_scene::{Bands, Side, Surface, luminance};
use radiosity_trace::sampling::{Random, Sequence, cosine_direction, frame, shuffled};
use radiosity_trace::{Emitter, EmitterTree, Found, Openings, Place, Tracer};
use std::f64::consts::PI;

mod beams;

/// Bounces before the roulette starts.
const SURE_BOUNCES: usize = 3;

/// Lights without area are all sampled at every vertex up to this number, and one at random beyond.
const ALL_POINT_LIGHTS: usize = 8;

/// An unbiased estimator of irradiance.
#[derive(Clone)]
pub struct Referee<'a> {
    tracer: &'a Tracer<'a>,
    emitters: Vec<Source>,
    /// Which of them to sample.
    tree: EmitterTree,
    /// Their shares of the power, each added to those before it.
    ends: Vec<f64>,
    /// Whether light paths are traced.
    from_lamps: bool,
    /// Number of each triangle side's emitter plus one; zero for none.
    emitter_of: Vec<[u32; 2]>,
    beams: BeamEnds,
    openings: &'a Openings,
}

/// One side of a triangle that emits.
#[derive(Clone)]
struct Source {
    triangle: u32,
    normal: DVec3,
    area: f64,
    /// Density, by area, with which light paths begin here: by power.
    density: f64,
}

impl Source {
    /// How likely a light path from here finds what a path finds that came along an edge of such a density and meets this at last, relative to that.
    fn likelier(&self, edge: Option<f64>) -> f64 {
        edge.map_or(0.0, |edge| self.density / edge)
    }
}

/// Where light paths start that go with others.
struct Starts {
    points: Sequence,
    order: u32,
}

impl Starts {
    fn point(&self, index: u32) -> [f64; 4] {
        self.points.point(shuffled(index, self.order)).map(f64::from)
    }
}

/// What a light path met first.
struct Lit {
    /// Where, and the side that the light falls on.
    place: Place,
    reflectance: [f64; 3],
    transmittance: [f64; 3],
    /// Of the lamp where the path began.
    luminance: [f64; 3],
    /// Density, by area, of having begun there.
    density: f64,
    /// Density, by solid angle, with which the lamp is sampled from here, and that with which a ray from here meets it.
    sampled: f64,
    met: f64,
}

impl<'a> Referee<'a> {
    /// Prepares the list of emitters.
    pub fn new(tracer: &'a Tracer<'a>) -> Referee<'a> {
        let (scene, mesh) = (tracer.scene, tracer.mesh);
        let mut emitters = Vec::new();
        let (mut boxes, mut ends, mut sum) = (Vec::new(), Vec::new(), 0.0);
        let mut emitter_of = vec![[0u32; 2]; mesh.triangles.len()];
        for (t, numbers) in emitter_of.iter_mut().enumerate() {
            let material = scene.material(mesh.source[t] as usize);
            if !material.emits() {
                continue;
            }
            // A picture's mean would need an integral; sampling by the untextured power is still unbiased.
            let (area, density) = (mesh.area(t), f64::from(luminance(material.emissive)).max(1e-30));
            for side in [Side::Front, Side::Back] {
                if side == Side::Back && !material.has_two_sides() {
                    continue;
                }
                let normal = outward(mesh.normal(t), side);
                boxes.push(Emitter::triangle(mesh.corners(t), normal, area * density));
                emitters.push(Source { triangle: t as u32, normal, area, density });
                sum += area * density;
                ends.push(sum);
                numbers[side as usize] = emitters.len() as u32;
            }
        }
        emitters.iter_mut().for_each(|emitter| emitter.density /= sum);
        ends.iter_mut().for_each(|end| *end /= sum);
        let from_lamps = !emitters.is_empty();
        Referee {
            tracer,
            emitters,
            tree: EmitterTree::new(&boxes, 1),
            ends,
            from_lamps,
            emitter_of,
            beams: BeamEnds::new(tracer),
            openings: tracer.openings(),
        }
    }

    /// Irradiance (lux per band) at a place: the mean of `samples` paths. Different `seed`s are independent.
    pub fn irradiance(&self, place: &Place, samples: u32, seed: u64) -> Bands {
        let mut random = Random::new(seed);
        let sequence = Sequence::new(random.next_bits(), random.next_bits());
        let starts = self.starts(&mut random);
        let frame = frame(place.normal);
        let mut sum = [0f64; 3];
        for i in 0..samples {
            let lit = starts.as_ref().and_then(|starts| self.lit(starts.point(i), &mut random));
            let path = self.path(place, &frame, sequence.point(i).map(f64::from), lit.as_ref(), &mut random);
            for (sum, e) in sum.iter_mut().zip(path) {
                *sum += e;
            }
        }
        sum.map(|s| (s / f64::from(samples.max(1))) as f32)
    }

    /// Mean irradiance (lux per band) over an area: that of `samples` paths, each from the place that a point of the unit square
    /// stands for. Of those that bring no light the ones that `counts` refuses are left out. Different `seed`s are independent.
    pub fn mean_irradiance(
        &self,
        place: impl Fn([f32; 2]) -> Place,
        counts: impl Fn(&Place) -> bool,
        samples: u32,
        seed: u64,
    ) -> Bands {
        let mut random = Random::new(seed);
        let [directions, places] = [0, 1].map(|_| Sequence::new(random.next_bits(), random.next_bits()));
        let order = random.next_bits();
        let starts = self.starts(&mut random);
        let (mut sum, mut counted) = ([0f64; 3], 0u32);
        for i in 0..samples {
            let [x, y, ..] = places.point(shuffled(i, order));
            let place = place([x, y]);
            let lit = starts.as_ref().and_then(|starts| self.lit(starts.point(i), &mut random));
            let first = directions.point(i).map(f64::from);
            let path = self.path(&place, &frame(place.normal), first, lit.as_ref(), &mut random);
            if path == [0.0; 3] && !counts(&place) {
                continue;
            }
            counted += 1;
            for (sum, e) in sum.iter_mut().zip(path) {
                *sum += e;
            }
        }
        sum.map(|s| (s / f64::from(counted.max(1))) as f32)
    }

    /// Where light paths start, if there are any.
    fn starts(&self, random: &mut Random) -> Option<Starts> {
        let mut bits = || random.next_bits();
        self.from_lamps.then(|| Starts { points: Sequence::new(bits(), bits()), order: bits() })
    }

    /// What a light path meets, of a lamp by its power; the four numbers choose lamp, place on it and direction.
    fn lit(&self, [p, q, u, v]: [f64; 4], random: &mut Random) -> Option<Lit> {
        let number = self.ends.partition_point(|end| *end <= p).min(self.ends.len().checked_sub(1)?);
        let before = if number == 0 { 0.0 } else { self.ends[number - 1] };
        let stretched = ((p - before) / (self.ends[number] - before)).clamp(0.0, 1.0);
        let (scene, mesh, emitter) = (self.tracer.scene, self.tracer.mesh, &self.emitters[number]);
        let (x, y) = radiosity_scene::elements::triangle_from_square(stretched, q);
        let (triangle, uv) = (emitter.triangle, DVec2::new(x, y));
        let at = mesh.surface(triangle as usize, uv);
        let opacity = f64::from(scene.opacity(at));
        let luminance = scene.emitted_luminance(at).map(|l| opacity * f64::from(l));
        let lamp = Place { point: mesh.point(triangle as usize, uv), normal: emitter.normal, triangle };
        let direction = cosine_direction(&frame(emitter.normal), u, v);
        let ray = self.tracer.ray(&lamp, direction, f64::INFINITY);
        let Found::Surface { triangle, uv, side, distance } = self.tracer.first(&ray, random.next_bits()) else {
            return None;
        };
        let uv = DVec2::new(f64::from(uv[0]), f64::from(uv[1]));
        let at = mesh.surface(triangle as usize, uv);
        let normal = outward(mesh.normal(triangle as usize), side);
        let place = Place { point: mesh.point(triangle as usize, uv), normal, triangle };
        let picked = self.tree.probability(number as u32, place.point, normal);
        Some(Lit {
            place,
            reflectance: scene.reflectance(at).map(f64::from),
            transmittance: scene.transmittance(at).map(f64::from),
            luminance,
            density: emitter.density,
            sampled: light_density(emitter, picked, f64::from(distance), -direction),
            met: (-direction.dot(normal)).max(0.0) / PI,
        })
    }

    /// Irradiance by way of the place that a light path met.
    fn by_way_of(&self, lit: &Lit, place: &Place, random: &mut Random) -> [f64; 3] {
        let along = lit.place.point - place.point;
        let distance = along.length();
        let direction = along / distance;
        let (cosine, sent) = (direction.dot(place.normal), -direction.dot(lit.place.normal));
        let passes = sent < 0.0;
        let (kept, normal) =
            if passes { (lit.transmittance, -lit.place.normal) } else { (lit.reflectance, lit.place.normal) };
        let edge = cosine * sent.abs() / (PI * distance * distance);
        if !(cosine > 0.0 && edge > 0.0 && edge.is_finite() && kept.iter().any(|k| *k > 0.0)) {
            return [0.0; 3];
        }
        if !self.tracer.mutually_visible(place, &Place { normal, ..lit.place }, random.next_bits()) {
            return [0.0; 3];
        }
        let others = lit.sampled + (1.0 + lit.density / edge) * lit.met;
        std::array::from_fn(|band| PI * lit.luminance[band] * kept[band] * lit.met / others)
    }

    /// One estimate of the irradiance at a place; the four numbers choose its first ray and first light sample.
    fn path(
        &self,
        place: &Place,
        first_frame: &[DVec3; 3],
        first: [f64; 4],
        lit: Option<&Lit>,
        random: &mut Random,
    ) -> [f64; 3] {
        let mut place = *place;
        let mut axes = *first_frame;
        let mut throughput = [1f64; 3];
        let mut sum = [0f64; 3];
        let mut choice = first;
        // What the path came along; light paths find nothing that is seen at once.
        let mut edge = None;
        // Where it came from, if what it met gave back what fell on that very side.
        let mut from: Option<Place> = None;
        for bounce in 0.. {
            let [u, v, p, q] = choice;
            let direct = [
                self.sample_lamps(&place, [p, q], edge, random),
                self.sample_lights(&place, from.as_ref(), random),
                self.beams.sample(self.tracer, &place, random),
                self.sample_sky(&place, [p, q], random),
                lit.map_or([0.0; 3], |lit| self.by_way_of(lit, &place, random)),
            ];
            for band in 0..3 {
                sum[band] += throughput[band] * direct.iter().map(|e| e[band]).sum::<f64>();
            }

            let direction = cosine_direction(&axes, u, v);
            let cosine = direction.dot(place.normal);
            let ray = self.tracer.ray(&place, direction, f64::INFINITY);
            let (triangle, uv, side, distance) = match self.tracer.first(&ray, random.next_bits()) {
                Found::Back => break,
                Found::Escaped => {
                    let sky = self.sky(direction);
                    let weight = balance(cosine / PI, self.openings.density(&place, direction));
                    for band in 0..3 {
                        sum[band] += throughput[band] * weight * PI * f64::from(sky[band]);
                    }
                    break;
                }
                Found::Surface { triangle, uv, side, distance } => (triangle, uv, side, f64::from(distance)),
            };
            let uv = DVec2::new(f64::from(uv[0]), f64::from(uv[1]));
            let mesh = self.tracer.mesh;
            let at = mesh.surface(triangle as usize, uv);
            let normal = outward(mesh.normal(triangle as usize), side);
            let number = self.emitter_of[triangle as usize][side as usize];
            if number > 0 {
                let emitter = &self.emitters[number as usize - 1];
                let probability = self.tree.probability(number - 1, place.point, place.normal);
                let met = cosine / PI;
                let density = light_density(emitter, probability, distance, direction);
                let weight = balance(met, density + emitter.likelier(edge) * met);
                let luminance = self.tracer.scene.emitted_luminance(at);
                for band in 0..3 {
                    sum[band] += throughput[band] * weight * PI * f64::from(luminance[band]);
                }
            }
            if self.from_lamps {
                edge = Some(cosine * direction.dot(normal).abs() / (PI * distance * distance));
            }
            let met = normal;
            let normal = self.returned(at, normal, &mut throughput, random);
            from = (normal == met).then_some(place);
            let strongest = throughput.iter().fold(0f64, |m, t| m.max(*t));
            if strongest <= 0.0 {
                break;
            }
            if bounce + 1 >= SURE_BOUNCES {
                let survival = strongest.min(0.95);
                if random.next_unit() >= survival {
                    break;
                }
                throughput.iter_mut().for_each(|t| *t /= survival);
            }
            place = Place { point: mesh.point(triangle as usize, uv), normal, triangle };
            axes = frame(normal);
            choice = std::array::from_fn(|_| random.next_unit());
        }
        sum
    }

    /// Weighs a path by what a surface gives back. The light of a sheet came from the side that is seen, or through it from
    /// the other; one of the two is followed. The normal of the side on which the path goes on.
    fn returned(&self, at: Surface, normal: DVec3, throughput: &mut [f64; 3], random: &mut Random) -> DVec3 {
        let (reflectance, transmittance) = (self.tracer.scene.reflectance(at), self.tracer.scene.transmittance(at));
        let (rho, tau) = (luminance(reflectance), luminance(transmittance));
        if tau <= 0.0 {
            throughput.iter_mut().zip(reflectance).for_each(|(t, rho)| *t *= f64::from(rho));
            return normal;
        }
        let passing = f64::from(tau / (rho + tau));
        let passes = random.next_unit() < passing;
        let (kept, share) = if passes { (transmittance, passing) } else { (reflectance, 1.0 - passing) };
        throughput.iter_mut().zip(kept).for_each(|(t, kept)| *t *= f64::from(kept) / share);
        if passes { -normal } else { normal }
    }

    /// Irradiance from one sampled point of the emitters, where the path came along an edge of such a density.
    fn sample_lamps(&self, place: &Place, [p, q]: [f64; 2], edge: Option<f64>, random: &mut Random) -> [f64; 3] {
        let mut sum = [0f64; 3];
        let mut stretched = p;
        if let Some((leaf, probability)) = self.tree.pick(0, place.point, place.normal, &mut stretched) {
            let emitter = &self.emitters[self.tree.order()[leaf] as usize];
            let (x, y) = radiosity_scene::elements::triangle_from_square(stretched, q);
            let uv = DVec2::new(x, y);
            let mesh = self.tracer.mesh;
            let point = mesh.point(emitter.triangle as usize, uv);
            let along = point - place.point;
            let distance = along.length();
            let direction = along / distance;
            let cosine = direction.dot(place.normal);
            let density = light_density(emitter, probability, distance, direction);
            if distance > 0.0 && cosine > 0.0 && density > 0.0 && emitter.triangle != place.triangle {
                let target = Place { point, normal: emitter.normal, triangle: emitter.triangle };
                if self.tracer.mutually_visible(place, &target, random.next_bits()) {
                    let weight = balance(density, (1.0 + emitter.likelier(edge)) * cosine / PI);
                    let (scene, at) = (self.tracer.scene, mesh.surface(emitter.triangle as usize, uv));
                    // Rays stop at a place in proportion to its opacity; a sample of it must be told.
                    let opacity = f64::from(scene.opacity(at));
                    for (sum, l) in sum.iter_mut().zip(scene.emitted_luminance(at)) {
                        *sum += weight * opacity * f64::from(l) * cosine / density;
                    }
                }
            }
        }
        sum
    }

    /// Irradiance from a direction through some small opening.
    fn sample_sky(&self, place: &Place, choice: [f64; 2], random: &mut Random) -> [f64; 3] {
        let Some((direction, density)) = self.openings.sought(place, choice) else { return [0.0; 3] };
        if self.tracer.first(&self.tracer.ray(place, direction, f64::INFINITY), random.next_bits()) != Found::Escaped {
            return [0.0; 3];
        }
        let cosine = direction.dot(place.normal);
        let weight = balance(density, cosine / PI);
        self.sky(direction).map(|l| weight * f64::from(l) * cosine / density)
    }

    /// Luminance of the sky, cd/m² per band.
    fn sky(&self, direction: DVec3) -> Bands {
        self.tracer.scene.sky.luminance(direction, self.tracer.scene.up.direction())
    }

    /// Irradiance from the lights without area.
    fn sample_lights(&self, place: &Place, from: Option<&Place>, random: &mut Random) -> [f64; 3] {
        let mut sum = [0f64; 3];
        let lights = &self.tracer.scene.lights;
        let all = lights.len() <= ALL_POINT_LIGHTS;
        let count = if all { lights.len() } else { 1 };
        for i in 0..count {
            let (number, scale) = if all {
                (i, 1.0)
            } else {
                let pick = (random.next_unit() * lights.len() as f64) as usize;
                (pick.min(lights.len() - 1), lights.len() as f64)
            };
            let light = &lights[number];
            let (direction, distance, arriving) = light.arrival(place.point);
            let cosine = direction.dot(place.normal);
            if cosine <= 0.0 || luminance(arriving) <= 0.0 {
                continue;
            }
            if self.tracer.sees_lamp(place, (direction, distance), random.next_bits()) {
                // Where a beam ends, it may have been sampled from where the path came from.
                let weight = from.map_or(1.0, |from| self.beams.weight(self.tracer, from, place, number as u32));
                for (sum, e) in sum.iter_mut().zip(arriving) {
                    *sum += weight * scale * cosine * f64::from(e);
                }
            }
        }
        sum
    }
}

fn outward(normal: DVec3, side: Side) -> DVec3 {
    if side == Side::Front { normal } else { -normal }
}

/// Solid-angle density of a point of an emitter that is picked with a probability, and sampled by area.
fn light_density(emitter: &Source, probability: f64, distance: f64, direction: DVec3) -> f64 {
    let cosine = -direction.dot(emitter.normal);
    if cosine <= 0.0 { 0.0 } else { probability / emitter.area * distance * distance / cosine }
}

/// Weight of a sample taken with density `own` where the other way would have had density `other`.
fn balance(own: f64, other: f64) -> f64 {
    if other > 0.0 { own / (own + other) } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use radiosity_scene::{Material, Mesh, Scene, Sky, Transmission};

    /// A room of 4 × 3 × 2.5 m with a strip of 1.2 m × 4 mm, `gap` below the ceiling, that shines up and down, and maybe a sheet across.
    fn room(gap: f64, sheet: Option<Material>) -> Scene {
        let grey = |rho: f32| Material { base_color: [rho, rho, rho, 1.0], ..Material::default() };
        let lamp = Material { emissive: [5000.0; 3], double_sided: true, ..grey(0.0) };
        let mut scene = Scene { materials: vec![grey(0.7), lamp], ..Scene::default() };
        let corner = |k: usize| DVec3::new([0.0, 4.0][k & 1], [0.0, 3.0][k >> 1 & 1], [0.0, 2.5][k >> 2]);
        for face in [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]] {
            scene.add_quad("room", 0, face.map(corner));
        }
        let across = |x: [f64; 2], y: [f64; 2], z: f64| {
            [[x[0], y[0]], [x[1], y[0]], [x[1], y[1]], [x[0], y[1]]].map(|[x, y]| DVec3::new(x, y, z))
        };
        scene.add_quad("strip", 1, across([1.4, 2.6], [1.498, 1.502], 2.5 - gap));
        if let Some(sheet) = sheet {
            scene.materials.push(sheet);
            scene.add_quad("sheet", 2, across([0.5, 3.5], [0.5, 2.5], 1.5));
        }
        scene
    }

    pub fn opal() -> Material {
        let transmission = Transmission { transmittance: [0.5; 3], texture: None, replaced: 0.0, share_texture: None };
        Material { base_color: [0.4, 0.4, 0.4, 1.0], transmission: Some(transmission), ..Material::default() }
    }

    /// Mean, its standard error, and the variance of one path relative to its square, of the light at a place by `runs` runs of 1,024 paths each.
    pub fn seen(referee: &Referee, place: &Place, runs: u64) -> [f64; 3] {
        let of_run = |run| f64::from(luminance(referee.irradiance(place, 1024, run)));
        let light: Vec<f64> = (0..runs).map(of_run).collect();
        let n = runs as f64;
        let mean = light.iter().sum::<f64>() / n;
        let variance = light.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / (n - 1.0);
        [mean, (variance / n).sqrt(), 1024.0 * variance / mean.powi(2)]
    }

    /// Light paths change what is found by chance, and nothing else, through a sheet and off it, too.
    #[test]
    fn light_paths_find_the_same_light() {
        let (table, close) = (DVec3::new(1.0, 1.0, 0.8), DVec3::new(2.0, 1.46, 2.46));
        // With how much more variance at least light is found by chance.
        let cases = [
            (0.2, None, table, 20.0),
            (0.05, None, table, 200.0),
            (0.2, Some(opal()), table, 4.0),
            (0.04, None, close, 1.0),
        ];
        for (gap, sheet, point, times) in cases {
            let scene = room(gap, sheet);
            let mesh = Mesh::new(&scene);
            let tracer = Tracer::new(&scene, &mesh);
            let place = Place { point, normal: DVec3::Z, triangle: u32::MAX };
            let of = |from_lamps, runs| seen(&Referee { from_lamps, ..Referee::new(&tracer) }, &place, runs);
            let [[plain, plain_error, variance], [mean, error, less]] = [of(false, 256), of(true, 32)];
            let off = (mean - plain).abs() / plain_error.hypot(error);
            assert!(off < 3.0, "{plain} ± {plain_error}, {mean} ± {error}");
            assert!(variance > times * less, "{variance}, {less}");
        }
    }

    /// Rays through a small opening change what is found of the sky by chance, and nothing else: on the floor, beside the opening, and outside.
    #[test]
    fn rays_through_openings_find_the_same_sky() {
        let grey = Material { base_color: [0.7, 0.7, 0.7, 1.0], double_sided: true, ..Material::default() };
        let mut scene = Scene { materials: vec![grey], sky: Sky::Uniform([1000.0; 3]), ..Scene::default() };
        let corner = |k: usize| DVec3::new([0.0, 4.0][k & 1], [0.0, 3.0][k >> 1 & 1], [0.0, 2.5][k >> 2]);
        for face in [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [0, 2, 6, 4], [1, 5, 7, 3]] {
            scene.add_quad("room", 0, face.map(corner));
        }
        for [low, high] in [[0.0, 1.5], [1.54, 2.5]] {
            let corners = [[0.0, low], [4.0, low], [4.0, high], [0.0, high]];
            scene.add_quad("wall", 0, corners.map(|[x, z]| DVec3::new(x, 3.0, z)));
        }
        let mesh = Mesh::new(&scene);
        let tracer = Tracer::new(&scene, &mesh);
        assert!(!tracer.openings().is_empty());
        let none = Openings::default();
        // With how much more variance at least light is found by chance.
        let cases = [
            (DVec3::new(2.0, 1.0, 0.01), DVec3::Z, 20.0),
            (DVec3::new(2.0, 2.9, 1.4), DVec3::Z, 4.0),
            (DVec3::new(2.0, 2.0, 1.5), -DVec3::Y, 20.0),
            (DVec3::new(2.0, 3.2, 1.5), -DVec3::Y, 0.5),
        ];
        for (point, normal, times) in cases {
            let place = Place { point, normal, triangle: u32::MAX };
            let referee = Referee::new(&tracer);
            let plain = Referee { openings: &none, ..referee.clone() };
            let [[by_chance, plain_error, variance], [mean, error, less]] =
                [seen(&plain, &place, 256), seen(&referee, &place, 64)];
            let off = (mean - by_chance).abs() / plain_error.hypot(error);
            assert!(off < 3.0, "{by_chance} ± {plain_error}, {mean} ± {error}");
            assert!(variance > times * less, "{point}: {variance}, {less}");
        }
    }
}
