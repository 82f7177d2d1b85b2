//! One light at one place: what it gives unshadowed, and what some shadow rays find of that.
//!
//! Estimators answer the irradiance in lux per band, and what became of their rays as bits.

use crate::luminaires::{Piece, PieceTree};
use crate::polygon::CosineTriangle;
use glam::{DVec2, DVec3};
use radiosity_scene::elements::triangle_from_square;
use radiosity_scene::{Bands, PointLight, luminance};
use radiosity_trace::sampling::{Sequence, hash};
use radiosity_trace::{Place, Tracer};
use smallvec::SmallVec;
use std::f64::consts::PI;

/// A shadow ray came through.
pub const LIT: u8 = 1;
/// A shadow ray was stopped.
pub const DARK: u8 = 2;
/// What was found would be noisy even if all shadow rays had come through.
pub const CHANCE: u8 = 4;
/// It was asked by shadow rays, and others might find something else: there is not one line of sight alone.
pub const SAMPLED: u8 = 8;

/// Luminance of a sum that is kept in double precision.
pub fn luminance_of(e: [f64; 3]) -> f64 {
    f64::from(luminance(e.map(|e| e as f32)))
}

/// Irradiance of a place from a source without area, and what became of the rays. There is one line of sight: `n` rays
/// go along it only where surfaces may be partly transparent, which each decides anew.
pub fn from_point(light: &PointLight, tracer: &Tracer, place: &Place, n: u32, salt: u32) -> ([f64; 3], u8) {
    let (direction, distance, arriving) = light.arrival(place.point);
    let cosine = direction.dot(place.normal);
    if cosine <= 0.0 || luminance(arriving) <= 0.0 {
        return ([0.0; 3], 0);
    }
    let (n, chance) = if tracer.is_opaque() { (1, 0) } else { (n, SAMPLED) };
    let clear = (0..n).filter(|&i| tracer.sees_lamp(place, (direction, distance), salt ^ hash(i))).count();
    let outcome = chance | if clear > 0 { LIT } else { 0 } | if clear < n as usize { DARK } else { 0 };
    (arriving.map(|e| f64::from(e) * cosine * clear as f64 / f64::from(n)), outcome)
}

/// Unshadowed irradiance of a place from triangles by their form factors; these come back as the luminance of
/// each one's part.
pub fn unshadowed(pieces: &[Piece], place: &Place, factors: &mut [f64]) -> [f64; 3] {
    let mut sum = [0f64; 3];
    for (piece, factor) in pieces.iter().zip(factors) {
        if *factor > 0.0 && piece.triangle != place.triangle {
            (0..3).for_each(|band| sum[band] += *factor * f64::from(piece.exitance[band]));
            *factor *= f64::from(luminance(piece.exitance));
        } else {
            *factor = 0.0;
        }
    }
    sum
}

/// `n` samples from number `first` of a sequence on.
pub type Samples<'s> = (&'s Sequence, u32, u32);

/// Irradiance of a place from a light whose factors are known: analytic value `here` times visible share; what became of
/// the rays.
pub fn from_known(
    (pieces, factors): (&[Piece], &[f64]),
    here: [f64; 3],
    tracer: &Tracer,
    place: &Place,
    (sequence, first, n): Samples,
    (ratio, salt): (u32, u32),
) -> ([f64; 3], u8) {
    let total: f64 = factors.iter().sum();
    if total <= 0.0 {
        return ([0.0; 3], 0);
    }
    let (mut visible, mut sampled) = ([0f64; 3], [0f64; 3]);
    let mut outcome = SAMPLED;
    // What samples of a piece have in common is worked out for the first of them, where there are some of each.
    let kept = if n as usize > pieces.len() { pieces.len() } else { 0 };
    let mut aims: SmallVec<[Option<Aim>; 4]> = (0..kept).map(|_| None).collect();
    let mut picks = Picks::new(factors);
    if pieces.len() > SCANNED && n > 1 {
        picks.add_up();
    }
    for index in first..first + n {
        let uv = sequence.pair(index).map(f64::from);
        let Some((piece, target, weight)) = sample_one((pieces, &picks), place, uv, &mut aims) else {
            continue;
        };
        let hidden = !tracer.mutually_visible(place, &target, salt ^ hash(index));
        outcome |= if hidden { DARK } else { LIT };
        let tint = tint(tracer, piece, target.point);
        for band in 0..3 {
            sampled[band] += weight * f64::from(piece.exitance[band]);
            if !hidden {
                visible[band] += weight * f64::from(tint[band]);
            }
        }
    }
    if n < ratio {
        outcome |= CHANCE;
    }
    let irradiance = std::array::from_fn(|band| {
        if n < ratio {
            visible[band] / f64::from(n)
        } else if sampled[band] > 0.0 {
            here[band] * visible[band] / sampled[band]
        } else {
            0.0
        }
    });
    (irradiance, outcome)
}

/// Irradiance of a place from a light of many triangles, or those below a node of its tree: one of them for each ray, by
/// about what each gives.
pub fn from_many(
    (pieces, PieceTree { tree, leaves }, node): (&[Piece], &PieceTree, u32),
    tracer: &Tracer,
    place: &Place,
    (sequence, first, n): Samples,
    salt: u32,
) -> ([f64; 3], u8) {
    let mut sum = [0f64; 3];
    let mut outcome = CHANCE | SAMPLED;
    for index in first..first + n {
        let [u, v] = sequence.pair(index);
        let mut u = f64::from(u);
        let Some((leaf, probability)) = tree.pick(node, place.point, place.normal, &mut u) else { continue };
        let range = tree.leaves()[leaf].start as usize..tree.leaves()[leaf].end as usize;
        let own = &pieces[range];
        let mut factors = leaves[leaf].seen_from(place.point, place.normal);
        if luminance_of(unshadowed(own, place, &mut factors[..own.len()])) <= 0.0 {
            continue;
        }
        let (picks, uv) = (Picks::new(&factors[..own.len()]), [u, f64::from(v)]);
        let Some((piece, target, weight)) = sample_one((own, &picks), place, uv, &mut []) else {
            continue;
        };
        if tracer.mutually_visible(place, &target, salt ^ hash(index)) {
            let tint = tint(tracer, piece, target.point);
            (0..3).for_each(|band| sum[band] += weight / probability * f64::from(tint[band]));
            outcome |= LIT;
        } else {
            outcome |= DARK;
        }
    }
    (sum.map(|s| s / f64::from(n)), outcome)
}

/// Of so few pieces one is picked by looking at one after the other.
const SCANNED: usize = 16;

/// Pieces to be picked by their unshadowed contributions, some of which are more than nothing.
struct Picks<'f> {
    factors: &'f [f64],
    total: f64,
    /// Sums up to and with each, where they are worth it.
    up_to: Vec<f64>,
}

impl Picks<'_> {
    fn new(factors: &[f64]) -> Picks<'_> {
        Picks { factors, total: factors.iter().sum(), up_to: Vec::new() }
    }

    fn add_up(&mut self) {
        let sum = |sum: &mut f64, factor: &f64| {
            *sum += *factor;
            Some(*sum)
        };
        self.up_to = self.factors.iter().scan(0.0, sum).collect();
    }

    /// One of them by a number in [0, 1), and that number stretched.
    fn pick(&self, u: f64) -> (usize, f64) {
        let factors = self.factors;
        let mut rest = u * self.total;
        let mut k = 0;
        if self.up_to.is_empty() {
            while k + 1 < factors.len() && (rest >= factors[k] || factors[k] <= 0.0) {
                rest -= factors[k];
                k += 1;
            }
        } else {
            k = self.up_to.partition_point(|sum| *sum <= rest).min(factors.len() - 1);
            rest -= if k > 0 { self.up_to[k - 1] } else { 0.0 };
        }
        while factors[k] <= 0.0 && k > 0 {
            k -= 1;
            rest = factors[k];
        }
        (k, (rest / factors[k]).clamp(0.0, 1.0 - 1e-9))
    }
}

/// A piece picked with u, which is stretched, and a point of it by its direction; and the
/// weight of this sample for a source of unit exitance, over the density of having taken it. None where it has none. `aims` keeps how each
/// piece is sampled from the place; where it has no room for one, that is worked out anew.
fn sample_one<'p>(
    (pieces, picks): (&'p [Piece], &Picks),
    place: &Place,
    [u, v]: [f64; 2],
    aims: &mut [Option<Aim>],
) -> Option<(&'p Piece, Place, f64)> {
    let (k, u) = picks.pick(u);
    let piece = &pieces[k];
    let aim = || Aim::new(piece, place, tiny(piece));
    let (target, weight) = match aims.get_mut(k) {
        Some(kept) => kept.get_or_insert_with(aim).sample(piece, place, [u, v]),
        None => aim().sample(piece, place, [u, v]),
    };
    (weight > 0.0).then(|| (piece, target, weight * picks.total / picks.factors[k]))
}

/// Exitance of a piece at a point of it.
pub fn tint(tracer: &Tracer, piece: &Piece, point: DVec3) -> Bands {
    if piece.varied { emission_at(tracer, piece, point) } else { piece.exitance }
}

/// cos θ cos θ'/(π r²) of two places, 1/m².
pub fn geometry(from: &Place, to: &Place) -> f64 {
    let along = to.point - from.point;
    let square = along.length_squared();
    let cosines = along.dot(from.normal).max(0.0) * (-along.dot(to.normal)).max(0.0);
    if square > 0.0 { cosines / (PI * square * square) } else { 0.0 }
}

/// The square of the distance beyond which the solid angle of a piece is too small for its own arithmetic; area sampling is as good there.
pub fn tiny(piece: &Piece) -> f64 {
    1e3 * piece.area
}

/// A point of a piece and its weight: the form-factor density over the sampling density. By area where the square of the distance is beyond
/// `far`, m², and by direction elsewhere.
pub fn sample_piece(piece: &Piece, place: &Place, far: f64, square: [f64; 2]) -> (Place, f64) {
    Aim::new(piece, place, far).sample(piece, place, square)
}

/// How points of a piece are sampled from a place.
enum Aim {
    /// Not at all: neither sees the other.
    Nowhere,
    ByArea,
    ByDirection(CosineTriangle),
}

impl Aim {
    /// As [`sample_piece`] does.
    fn new(piece: &Piece, place: &Place, far: f64) -> Aim {
        let [a, b, c] = piece.corners;
        // Half of all places look away or lie behind; their solid angles need not be found first.
        let is_above = |p: &DVec3| (*p - place.point).dot(place.normal) > 0.0;
        if (place.point - a).dot(piece.normal) <= 0.0 || !piece.corners.iter().any(is_above) {
            return Aim::Nowhere;
        }
        if place.point.distance_squared((a + b + c) / 3.0) > far {
            return Aim::ByArea;
        }
        CosineTriangle::new(place.point, place.normal, piece.corners).map_or(Aim::Nowhere, Aim::ByDirection)
    }

    /// A point of the same piece, seen from the same place, and its weight.
    fn sample(&self, piece: &Piece, place: &Place, [x, y]: [f64; 2]) -> (Place, f64) {
        let [a, b, c] = piece.corners;
        let seen = |point| Place { point, normal: piece.normal, triangle: piece.triangle };
        match self {
            Aim::Nowhere => (seen(a), 0.0),
            Aim::ByArea => {
                let (p, q) = triangle_from_square(x, y);
                let target = seen(a + p * (b - a) + q * (c - a));
                (target, geometry(place, &target) * piece.area)
            }
            Aim::ByDirection(triangle) => {
                let (direction, weight) = triangle.direction(x, y);
                let towards = -direction.dot(piece.normal);
                if weight <= 0.0 || towards <= 0.0 {
                    return (seen(a), 0.0);
                }
                let reach = (place.point - a).dot(piece.normal) / towards;
                (seen(place.point + reach * direction), weight)
            }
        }
    }
}

/// Exitance of a piece at a point of it, where the emission is a picture.
fn emission_at(tracer: &Tracer, piece: &Piece, point: DVec3) -> Bands {
    let uv = tracer.mesh.barycentric(piece.triangle as usize, point).clamp(DVec2::ZERO, DVec2::ONE);
    let at = tracer.mesh.surface(piece.triangle as usize, uv);
    let opacity = tracer.scene.opacity(at);
    tracer.scene.emitted_luminance(at).map(|l| opacity * l * std::f32::consts::PI)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By sums as one after the other: each piece as often as it gives light, those that give none never, wherever these stand.
    #[test]
    fn pieces_are_picked_by_sums_as_by_looking_at_each() {
        let mut factors = vec![0.0; 40];
        for (k, factor) in factors.iter_mut().enumerate().skip(3).step_by(3) {
            *factor = 1.0 + k as f64;
        }
        assert!(factors[0] == 0.0 && factors[20] == 0.0 && factors[39] > 0.0);
        for last in [39, 36] {
            factors[last + 1..].fill(0.0);
            let plain = Picks::new(&factors);
            let mut summed = Picks::new(&factors);
            summed.add_up();
            for i in 0..=1000 {
                let u = (f64::from(i) / 1000.0).min(1.0 - f64::EPSILON);
                let ((k, x), (l, y)) = (plain.pick(u), summed.pick(u));
                // Rounding may decide otherwise at the border of two pieces.
                let is_same = k == l && (x - y).abs() < 1e-9;
                assert!(is_same || x.min(y) < 1e-9 && x.max(y) > 1.0 - 1e-8, "{u}: {k}, {x} and {l}, {y}");
                assert!(factors[k] > 0.0 && factors[l] > 0.0);
            }
        }
    }
    use radiosity_scene::{Material, Mesh, Scene, Side};

    /// What samples have in common changes none of them: many at once are those that are taken one by one.
    #[test]
    fn samples_of_a_light_are_those_taken_alone() {
        let p = |x: f64, z: f64| DVec3::new(x, 0.0, z);
        let mut scene = Scene { materials: vec![Material::default()], ..Scene::default() };
        scene.add_quad("floor", 0, [p(-1.0, -1.0), p(-1.0, 1.0), p(1.0, 1.0), p(1.0, -1.0)]);
        let mesh = Mesh::new(&scene);
        let tracer = Tracer::new(&scene, &mesh);
        let lamp = [(-0.3, 0.2), (0.4, -0.1), (0.4, 0.5)].map(|(x, z)| DVec3::new(x, 0.4, z));
        let piece = |corners: [DVec3; 3]| {
            let [a, b, c] = corners;
            let cross = (b - a).cross(c - a);
            let (normal, area) = (cross.normalize(), 0.5 * cross.length());
            Piece { triangle: 7, side: Side::Front, corners, normal, exitance: [3.0, 2.0, 1.0], area, varied: false }
        };
        let [a, b, c] = lamp;
        let pieces = [piece(lamp), piece([a, c, b]), piece([a + 0.5, b + 0.5, c + 0.5])];
        let (factors, here) = ([0.2, 0.05, 0.3], [1.0; 3]);
        let place = Place { point: p(0.1, 0.2), normal: DVec3::Y, triangle: 0 };
        let sequence = Sequence::new(5, 0);
        let some = |first: u32, n: u32| {
            from_known((&pieces, &factors), here, &tracer, &place, (&sequence, first, n), (u32::MAX, 3)).0
        };
        let n = 16;
        let mut alone = [0.0; 3];
        for e in (0..n).map(|index| some(index, 1)) {
            (0..3).for_each(|band| alone[band] += e[band]);
        }
        assert_eq!(some(0, n), alone.map(|e| e / f64::from(n)));
        assert!(alone[0] > 0.0);
    }
}
