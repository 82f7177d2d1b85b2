//! Rays per second on one core, and the time to build, in a furnished room made here: 12 × 8 × 3 m, desks with
//! keyboards and lamps, shelves full of books, 54,000 triangles of very different sizes.
//!
//! The rays are those of a radiosity solver: cosine-distributed from points uniform by area (64 per point, and one per
//! point), and segments between points that face each other.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::Vec3;
use radiosity_trace::{Ray, Tree};
use std::f32::consts::TAU;

/// SplitMix64: small, and the same numbers everywhere.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 40) as f32 / (1u64 << 24) as f32
    }

    fn between(&mut self, lo: f32, hi: f32) -> f32 {
        lo + (hi - lo) * self.next()
    }
}

/// A box from `lo` to `hi`, seen from outside; `inside` turns it inside out.
fn cuboid(triangles: &mut Vec<[Vec3; 3]>, lo: Vec3, hi: Vec3, inside: bool) {
    for axis in 0..3 {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        for side in [lo, hi] {
            let corner = |at_u: Vec3, at_v: Vec3| {
                let mut p = side;
                p[u] = at_u[u];
                p[v] = at_v[v];
                p
            };
            let [a, b, c, d] = [corner(lo, lo), corner(hi, lo), corner(hi, hi), corner(lo, hi)];
            let flip = (side == lo) != inside;
            triangles.extend(if flip { [[a, c, b], [a, d, c]] } else { [[a, b, c], [a, c, d]] });
        }
    }
}

fn sphere(triangles: &mut Vec<[Vec3; 3]>, centre: Vec3, radius: f32, rings: usize) {
    let point = |i: usize, j: usize| {
        let (theta, phi) = (i as f32 / rings as f32 * 0.5 * TAU, j as f32 / (2 * rings) as f32 * TAU);
        centre + radius * Vec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos())
    };
    for i in 0..rings {
        for j in 0..2 * rings {
            let [a, b, c, d] = [point(i, j), point(i + 1, j), point(i + 1, j + 1), point(i, j + 1)];
            if i + 1 < rings {
                triangles.push([a, b, c]);
            }
            if i > 0 {
                triangles.push([a, c, d]);
            }
        }
    }
}

fn room() -> Vec<[Vec3; 3]> {
    let mut random = Random(1);
    let mut triangles = Vec::new();
    let out = |triangles: &mut Vec<[Vec3; 3]>, lo: [f32; 3], hi: [f32; 3]| {
        cuboid(triangles, Vec3::from_array(lo), Vec3::from_array(hi), false);
    };
    cuboid(&mut triangles, Vec3::ZERO, Vec3::new(12.0, 8.0, 3.0), true);
    for desk in 0..15 {
        let (x, y) = (1.0 + (desk % 5) as f32 * 2.1, 1.4 + (desk / 5) as f32 * 2.1);
        out(&mut triangles, [x, y, 0.72], [x + 1.6, y + 0.8, 0.75]);
        for (dx, dy) in [(0.0, 0.0), (1.55, 0.0), (0.0, 0.75), (1.55, 0.75)] {
            out(&mut triangles, [x + dx, y + dy, 0.0], [x + dx + 0.05, y + dy + 0.05, 0.72]);
        }
        for key in 0..90 {
            let (kx, ky) = (x + 0.5 + (key % 15) as f32 * 0.02, y + 0.1 + (key / 15) as f32 * 0.02);
            out(&mut triangles, [kx, ky, 0.75], [kx + 0.017, ky + 0.017, 0.762]);
        }
        out(&mut triangles, [x + 0.5, y + 0.5, 0.8], [x + 1.1, y + 0.53, 1.15]);
        sphere(&mut triangles, Vec3::new(x + 0.2, y + 0.4, 1.2), 0.1, 12);
    }
    for shelf in 0..16 {
        let x = 0.1 + shelf as f32 * 0.73;
        for board in 0..6 {
            let z = 0.1 + board as f32 * 0.35;
            out(&mut triangles, [x, 7.7, z], [x + 0.7, 8.0, z + 0.02]);
            let mut at = x + 0.01;
            while at < x + 0.66 {
                let book = random.between(0.015, 0.04);
                let (depth, height) = (random.between(7.72, 7.8), random.between(0.18, 0.3));
                out(&mut triangles, [at, depth, z + 0.02], [at + book - 0.001, 7.98, z + 0.02 + height]);
                at += book;
            }
        }
    }
    triangles
}

/// Random points on the triangles, uniform by area: triangle, point, unit normal.
struct Points<'a> {
    triangles: &'a [[Vec3; 3]],
    up_to: Vec<f32>,
    random: Random,
}

impl Points<'_> {
    fn new(triangles: &[[Vec3; 3]]) -> Points<'_> {
        let mut sum = 0.0f64;
        let area = |[a, b, c]: &[Vec3; 3]| f64::from((*b - *a).cross(*c - *a).length());
        let up_to = triangles.iter().map(|t| {
            sum += area(t);
            sum as f32
        });
        Points { triangles, up_to: up_to.collect(), random: Random(2) }
    }

    fn next(&mut self) -> (u32, Vec3, Vec3) {
        let last = self.triangles.len() - 1;
        let x = self.random.next() * self.up_to[last];
        let i = self.up_to.partition_point(|&sum| sum <= x).min(last);
        let [a, b, c] = self.triangles[i];
        let (mut u, mut v) = (self.random.next(), self.random.next());
        if u + v > 1.0 {
            (u, v) = (1.0 - u, 1.0 - v);
        }
        let normal = (b - a).cross(c - a).normalize();
        (i as u32, a + (b - a) * u + (c - a) * v + normal * 1e-4, normal)
    }

    /// Cosine-distributed rays, `each` per point.
    fn rays(&mut self, points: usize, each: usize) -> Vec<Ray> {
        let mut rays = Vec::with_capacity(points * each);
        for _ in 0..points {
            let (skip, origin, normal) = self.next();
            let (x, y) = normal.any_orthonormal_pair();
            for _ in 0..each {
                let (angle, sine2) = (self.random.between(0.0, TAU), self.random.next());
                let direction = sine2.sqrt() * (angle.cos() * x + angle.sin() * y) + (1.0 - sine2).sqrt() * normal;
                rays.push(Ray { origin, direction: direction.normalize(), t_max: f32::INFINITY, skip });
            }
        }
        rays
    }

    /// Segments between points that face each other.
    fn segments(&mut self, count: usize) -> Vec<Ray> {
        let mut rays = Vec::with_capacity(count);
        while rays.len() < count {
            let (skip, origin, from) = self.next();
            let (_, end, to) = self.next();
            let d = end - origin;
            if d.dot(from) > 0.0 && d.dot(to) < 0.0 {
                rays.push(Ray { origin, direction: d.normalize(), t_max: d.length(), skip });
            }
        }
        rays
    }
}

fn rays(c: &mut Criterion) {
    let triangles = room();
    let tree = Tree::new(&triangles);
    let mut points = Points::new(&triangles);
    let mut group = c.benchmark_group(format!("room of {} triangles", triangles.len()));
    group.bench_function("build", |b| b.iter(|| Tree::new(&triangles)));
    group.throughput(Throughput::Elements(1 << 16));
    for (name, rays) in [
        ("closest, one ray per point", points.rays(1 << 16, 1)),
        ("closest, 64 rays per point", points.rays(1 << 10, 64)),
    ] {
        let mut hits = vec![None; rays.len()];
        group.bench_function(name, |b| b.iter(|| tree.closest_batch(&rays, &mut hits)));
    }
    let rays = points.segments(1 << 16);
    let mut blocked = vec![false; rays.len()];
    group.bench_function("blocked, facing points", |b| b.iter(|| tree.blocked_batch(&rays, &mut blocked)));
    group.finish();
}

criterion_group!(benches, rays);
criterion_main!(benches);
