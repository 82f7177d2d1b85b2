//! Rays per second and the time to build the tree, in the Cornell box and in the scenes named.
//!
//!     cargo bench -p radiosity --bench rays -- [--dump FOLDER] [FILE]...
//!
//! The rays are those of a radiosity solver: cosine-distributed ones from points uniform by area, one or 64 per point; and
//! segments between points that face each other, alone or as bundles of 16 between two squares of 5 cm. A rate is the best of
//! [`PASSES`] passes.
//!
//! For other tracers `--dump` writes `triangles` (nine f32 each) and, for each kind of rays, `KIND.rays` (origin, direction, length
//! as f32 and a u32 that is not used) and `KIND.hits` (a u32 per ray: the triangle met, u32::MAX for none; of segments 1 where they
//! are blocked), all little-endian.

#![expect(clippy::print_stdout, reason = "the result of a bench is what it prints")]

use glam::{DVec3, Vec3};
use radiosity::io::{LoadOptions, load};
use radiosity::{Mesh, Scene, cornell_box};
use radiosity_trace::sampling::{hash, unit};
use radiosity_trace::{Ray, Tree};
use rayon::prelude::*;
use std::f32::consts::TAU;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Rays of a kind: enough that they do not stay in the caches.
const RAYS: usize = 1 << 18;

/// Rays that a thread takes at a time.
const PORTION: usize = 1 << 12;

const PASSES: usize = 7;

/// Rays start so far from their surfaces, as a part of half the scene's largest extent: as far as those of [`Tracer`](radiosity_trace::Tracer).
const CLEARANCE: f32 = 1.0 / (1 << 21) as f32;

/// Segments end this part of their length, and so many clearances, before where they go to: `SHORT` and `CLEAR` of the tracer.
const SHORT: f32 = 1.0 / (1 << 18) as f32;
const CLEAR: f32 = 3.0;

/// Half the side of the squares that bundles go between, metres.
const HALF: f32 = 0.025;

/// Random points on the triangles, uniform by area.
struct Points<'a> {
    triangles: &'a [[Vec3; 3]],
    clearance: f32,
    up_to: Vec<f64>,
    drawn: u32,
}

impl Points<'_> {
    fn new(triangles: &[[Vec3; 3]], clearance: f32) -> Points<'_> {
        let mut sum = 0.0;
        let up_to = triangles.iter().map(|[a, b, c]| {
            sum += (b.as_dvec3() - a.as_dvec3()).cross(c.as_dvec3() - a.as_dvec3()).length();
            sum
        });
        Points { triangles, clearance, up_to: up_to.collect(), drawn: 0 }
    }

    fn number(&mut self) -> f32 {
        self.drawn += 1;
        unit(hash(self.drawn))
    }

    /// A number around zero, up to `half` away.
    fn around(&mut self, half: f32) -> f32 {
        half * (2.0 * self.number() - 1.0)
    }

    /// A point just off the surface, and its unit normal.
    fn point(&mut self) -> (Vec3, Vec3) {
        let last = self.triangles.len() - 1;
        let fine = f64::from(self.number()) + f64::from(self.number()) / f64::from(1 << 24);
        let x = fine * self.up_to[last];
        let [a, b, c] = self.triangles[self.up_to.partition_point(|&sum| sum <= x).min(last)];
        let (mut u, mut v) = (self.number(), self.number());
        if u + v > 1.0 {
            (u, v) = (1.0 - u, 1.0 - v);
        }
        let normal = (b - a).cross(c - a).normalize();
        (a + (b - a) * u + (c - a) * v + normal * self.clearance, normal)
    }

    /// Cosine-distributed rays, `each` per point.
    fn cosine(&mut self, each: usize) -> Vec<Ray> {
        let mut rays = Vec::with_capacity(RAYS);
        while rays.len() < RAYS {
            let (origin, normal) = self.point();
            let (x, y) = normal.any_orthonormal_pair();
            for _ in 0..each {
                let (angle, sine2) = (TAU * self.number(), self.number());
                let direction = sine2.sqrt() * (angle.cos() * x + angle.sin() * y) + (1.0 - sine2).sqrt() * normal;
                rays.push(Ray { origin, direction: direction.normalize(), t_max: f32::INFINITY, skip: u32::MAX });
            }
        }
        rays
    }

    /// Segments between squares (points where `each` is 1) that face each other, `each` per pair.
    fn segments(&mut self, each: usize) -> Vec<Ray> {
        let half = if each == 1 { 0.0 } else { HALF };
        let mut rays = Vec::with_capacity(RAYS);
        while rays.len() < RAYS {
            let [(from, n), (to, m)] = [self.point(), self.point()];
            let d = to - from;
            if d.dot(n) > 0.0 && d.dot(m) < 0.0 && d.length() > 4.0 * HALF {
                let ([a, b], [e, f]) = (<[Vec3; 2]>::from(n.any_orthonormal_pair()), m.any_orthonormal_pair().into());
                for _ in 0..each {
                    let origin = from + self.around(half) * a + self.around(half) * b;
                    let d = to + self.around(half) * e + self.around(half) * f - origin;
                    let length = d.length();
                    let t_max = length - SHORT * length - CLEAR * self.clearance;
                    rays.push(Ray { origin, direction: d / length, t_max, skip: u32::MAX });
                }
            }
        }
        rays
    }
}

/// Rays per second in millions, by one thread and by all, and what `trace` said of each.
fn rate<T: Clone + Send + Sync>(
    rays: &[Ray],
    nothing: T,
    trace: impl Fn(&[Ray], &mut [T]) + Sync,
) -> ([f64; 2], Vec<T>) {
    let mut found = vec![nothing; rays.len()];
    let mut best = [f64::INFINITY; 2];
    for _ in 0..PASSES {
        let start = Instant::now();
        trace(rays, &mut found);
        best[0] = best[0].min(start.elapsed().as_secs_f64());
        let start = Instant::now();
        let portions = found.par_chunks_mut(PORTION).zip(rays.par_chunks(PORTION));
        portions.for_each(|(found, rays)| trace(rays, found));
        best[1] = best[1].min(start.elapsed().as_secs_f64());
    }
    (best.map(|seconds| rays.len() as f64 / seconds / 1e6), found)
}

fn write(folder: &Path, name: &str, words: impl Iterator<Item = u32>) {
    let bytes: Vec<u8> = words.flat_map(u32::to_le_bytes).collect();
    std::fs::write(folder.join(name), bytes).unwrap_or_else(|error| panic!("{name}: {error}"));
}

fn measure(name: &str, scene: &Scene, dump: Option<&Path>) {
    let mesh = Mesh::new(scene);
    let (low, high) =
        mesh.vertices.iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), v| (low.min(*v), high.max(*v)));
    let centre = 0.5 * (low + high);
    let corners = (0..mesh.triangles.len()).map(|t| mesh.corners(t).map(|p| (p - centre).as_vec3()));
    let triangles: Vec<[Vec3; 3]> = corners.collect();
    let start = Instant::now();
    let tree = Tree::new(&triangles);
    let seconds = start.elapsed().as_secs_f64();
    println!("{name}: {} triangles, tree {seconds:.3} s, {:.1} MB", triangles.len(), tree.memory() as f64 / 1e6);
    if let Some(folder) = dump {
        let numbers = triangles.iter().flatten().flat_map(|p| p.to_array());
        write(folder, "triangles", numbers.map(f32::to_bits));
    }

    let mut points = Points::new(&triangles, CLEARANCE * 0.5 * (high - low).max_element() as f32);
    for (kind, ends, rays) in [
        ("single", false, points.cosine(1)),
        ("ordered", false, points.cosine(64)),
        ("segments", true, points.segments(1)),
        ("bundles", true, points.segments(16)),
    ] {
        let ([one, all], hits) = if ends {
            let (rates, blocked) = rate(&rays, false, |rays, blocked| tree.blocked_batch(rays, blocked));
            (rates, blocked.iter().map(|&blocked| u32::from(blocked)).collect::<Vec<_>>())
        } else {
            let (rates, hits) = rate(&rays, None, |rays, hits| tree.closest_batch(rays, hits));
            (rates, hits.iter().map(|hit| hit.map_or(u32::MAX, |hit| hit.triangle)).collect())
        };
        let met = hits.iter().filter(|&&hit| hit != if ends { 0 } else { u32::MAX }).count();
        println!(
            "{kind:>10}: {one:6.2} M/s, {} threads {all:6.2} M/s; {met} of {} met something",
            rayon::current_num_threads(),
            rays.len()
        );
        if let Some(folder) = dump {
            let words = rays.iter().flat_map(|ray| {
                let numbers = ray.origin.to_array().into_iter().chain(ray.direction.to_array()).chain([ray.t_max]);
                numbers.map(f32::to_bits).chain([ray.skip])
            });
            write(folder, &format!("{kind}.rays"), words);
            write(folder, &format!("{kind}.hits"), hits.into_iter());
        }
    }
}

fn main() {
    // Cargo passes --bench, which is not for us.
    let mut words = std::env::args().skip(1).filter(|word| word != "--bench");
    let (mut dump, mut files) = (None, Vec::new());
    while let Some(word) = words.next() {
        if word == "--dump" {
            dump = Some(PathBuf::from(words.next().expect("--dump needs a folder")));
        } else {
            files.push(word);
        }
    }
    assert!(dump.is_none() || files.len() < 2, "--dump writes one scene: name one file");
    if files.is_empty() {
        measure("Cornell box", &cornell_box(), dump.as_deref());
    }
    for file in files {
        let loaded = load(Path::new(&file), &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
        measure(&file, &loaded.scene, dump.as_deref());
    }
}
