//! Direct light: what small and bright sources give, one column per light, so that each can be dimmed after the solve.
//!
//! A pilot of 16 shadow rays decides: all clear, and the answer is the analytic polygon factor without noise; mixed,
//! and more rays follow. The visible share is estimated as Σ c V/Σ c over directions sampled uniformly in the solid
//! angle of the source, with c the unshadowed contribution; it multiplies the analytic value, so that points close to
//! a large source, where area sampling goes wrong by factors, are as good as far ones. The ratio's bias falls as 1/S.

use crate::polygon::{SphericalTriangle, point_to_triangle};
use crate::{Progress, Receivers, Stopped};
use glam::{DVec2, DVec3};
use radiosity_scene::{Bands, Elements, Mesh, PointLight, Scene, Side, luminance};
use radiosity_trace::sampling::{Sequence, hash};
use radiosity_trace::{Place, Tracer};
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Lights with more triangles than this are sampled by power and area; evaluating the polygon factor of each would
/// cost more than the shadow rays.
const MOST_EXACT_PIECES: usize = 64;

/// A source whose exitance is at most this multiple of the scene's mean goes through the rows, where it costs
/// nothing extra: its noise there is no more than that of ordinary reflected light.
const BRIGHT: f64 = 2.0;

/// One emitting triangle.
#[derive(Clone, Debug)]
pub struct Piece {
    /// Mesh triangle.
    pub triangle: u32,
    /// Emitting side.
    pub side: Side,
    /// Corners, counter-clockwise seen from the emitting side.
    pub corners: [DVec3; 3],
    /// Unit normal of the emitting side.
    pub normal: DVec3,
    /// Mean exitance π L, lm/m² per band.
    pub exitance: Bands,
    /// Area, m².
    pub area: f64,
    /// Whether the emission varies over the triangle.
    pub varied: bool,
}

/// A source of direct light.
#[derive(Clone, Debug)]
pub enum Light {
    /// Emitting triangles of one object.
    Area {
        /// Name of the object.
        name: String,
        /// Its triangles.
        pieces: Vec<Piece>,
        /// Running sum of the pieces' shares of the power, ending at 1.
        cumulative: Vec<f64>,
    },
    /// A source without area.
    Point(PointLight),
}

impl Light {
    /// Name of the object or light; may be empty.
    pub fn name(&self) -> &str {
        match self {
            Light::Area { name, .. } => name,
            Light::Point(light) => &light.name,
        }
    }
}

/// How many shadow rays to spend on each light and receiver.
#[derive(Clone, Copy, Debug)]
pub struct Shadowing {
    /// Rays that look first. Four miss penumbrae; sixteen do not, on every scene tried.
    pub pilot: u32,
    /// Rays in all where the pilot found both light and shadow.
    pub mixed: u32,
}

impl Default for Shadowing {
    fn default() -> Self {
        Shadowing { pilot: 16, mixed: 64 }
    }
}

/// All lights that are evaluated directly.
#[derive(Clone, Debug, Default)]
pub struct Luminaires {
    /// The lights.
    pub lights: Vec<Light>,
    /// Exitance of each element (bands) that is counted through `lights` and must not be counted by rows as well.
    pub promoted: Vec<[f32; 4]>,
}

impl Luminaires {
    /// Collects the scene's lights. `exitance` has the exitance of each element per band.
    pub fn new(scene: &Scene, mesh: &Mesh, elements: &Elements, area: &[f64], exitance: &[Bands]) -> Luminaires {
        let total_area: f64 = area.iter().sum();
        let power: f64 = area.iter().zip(exitance).map(|(a, e)| a * f64::from(luminance(*e))).sum();
        let bright = BRIGHT * power / total_area.max(f64::MIN_POSITIVE);

        // Mean exitance of each triangle's sides from those of its elements.
        let mut pieces: Vec<(u32, Piece)> = Vec::new();
        let mut promoted = vec![[0f32; 4]; elements.len()];
        let mut first = 0;
        while first < elements.len() {
            let (triangle, side) = elements.place(first as u32);
            let count = (elements.division(triangle) as usize).pow(2);
            let own = &exitance[first..first + count];
            let mean: Bands = std::array::from_fn(|b| own.iter().map(|e| e[b]).sum::<f32>() / count as f32);
            let peak = own.iter().map(|e| luminance(*e)).fold(0f32, f32::max);
            if f64::from(peak) > bright {
                let [a, b, c] = mesh.corners(triangle);
                let front = side == Side::Front;
                let source = mesh.source[triangle] as usize;
                pieces.push((
                    scene.triangle_object[source],
                    Piece {
                        triangle: triangle as u32,
                        side,
                        corners: if front { [a, b, c] } else { [a, c, b] },
                        normal: if front { mesh.normal(triangle) } else { -mesh.normal(triangle) },
                        exitance: mean,
                        area: mesh.area(triangle),
                        varied: scene.material(source).emissive_texture.is_some(),
                    },
                ));
                for (promoted, e) in promoted[first..first + count].iter_mut().zip(own) {
                    promoted[..3].copy_from_slice(e);
                }
            }
            first += count;
        }
        pieces.sort_by_key(|(object, _)| *object);

        let mut lights = Vec::new();
        for group in pieces.chunk_by(|a, b| a.0 == b.0) {
            let name = scene.objects[group[0].0 as usize].name.clone();
            let pieces: Vec<Piece> = group.iter().map(|(_, piece)| piece.clone()).collect();
            let mut running = 0.0;
            let mut cumulative: Vec<f64> = pieces
                .iter()
                .map(|piece| {
                    running += piece.area * f64::from(luminance(piece.exitance)).max(f64::MIN_POSITIVE);
                    running
                })
                .collect();
            cumulative.iter_mut().for_each(|c| *c /= running);
            lights.push(Light::Area { name, pieces, cumulative });
        }
        lights.extend(scene.lights.iter().cloned().map(Light::Point));
        Luminaires { lights, promoted }
    }

    /// Irradiance (lux per band) of every receiver from one light, and whether it lies in the light's penumbra.
    ///
    /// # Errors
    /// [`Stopped`] if `progress` says so.
    pub fn column(
        &self,
        light: usize,
        tracer: &Tracer,
        receivers: &impl Receivers,
        shadowing: &Shadowing,
        progress: &impl Progress,
    ) -> Result<Vec<(Bands, bool)>, Stopped> {
        const CHUNK: usize = 256;
        let n = receivers.len();
        let done = AtomicUsize::new(0);
        let mut column = vec![([0f32; 3], false); n];
        column.par_chunks_mut(CHUNK).enumerate().try_for_each(|(chunk, out)| {
            for (k, out) in out.iter_mut().enumerate() {
                *out = self.irradiance(light, tracer, receivers, chunk * CHUNK + k, shadowing);
            }
            let so_far = done.fetch_add(out.len(), Ordering::Relaxed) + out.len();
            progress.step(so_far, n).then_some(()).ok_or(Stopped)
        })?;
        Ok(column)
    }

    /// Irradiance of one receiver from one light, and whether the light is partly hidden from it.
    pub fn irradiance(
        &self,
        light: usize,
        tracer: &Tracer,
        receivers: &impl Receivers,
        i: usize,
        shadowing: &Shadowing,
    ) -> (Bands, bool) {
        self.irradiance_seeded(light, tracer, receivers, i, shadowing, receivers.seed(i))
    }

    /// The same with random choices of the caller's.
    pub(crate) fn irradiance_seeded(
        &self,
        light: usize,
        tracer: &Tracer,
        receivers: &impl Receivers,
        i: usize,
        shadowing: &Shadowing,
        seed: u32,
    ) -> (Bands, bool) {
        let sequence = Sequence::new(seed, 0x0300 + light as u32);
        let salt = hash(seed ^ hash(light as u32));
        match &self.lights[light] {
            Light::Point(light) => from_point(light, tracer, receivers, i, shadowing, (&sequence, salt)),
            Light::Area { pieces, .. } if pieces.len() <= MOST_EXACT_PIECES => {
                from_few(pieces, tracer, receivers, i, shadowing, (&sequence, salt))
            }
            Light::Area { pieces, cumulative, .. } => {
                from_many((pieces, cumulative), tracer, receivers, i, shadowing, (&sequence, salt))
            }
        }
    }
}

fn from_point(
    light: &PointLight,
    tracer: &Tracer,
    receivers: &impl Receivers,
    i: usize,
    shadowing: &Shadowing,
    (sequence, salt): (&Sequence, u32),
) -> (Bands, bool) {
    // A point has one line of sight; an element is sampled over its area.
    let pilot = if receivers.has_area() { shadowing.pilot } else { 1 };
    let mut sum = [0f64; 3];
    let (mut lit, mut dark, mut skipped, mut n) = (0, 0, 0, 0);
    let mut end = pilot;
    while n < end {
        let [_, _, x, y] = sequence.point(n);
        n += 1;
        let Some(place) = receivers.place(i, x, y) else { return ([0.0; 3], false) };
        let (direction, distance, arriving) = light.arrival(place.point);
        let cosine = direction.dot(place.normal);
        if cosine <= 0.0 || luminance(arriving) <= 0.0 {
            continue;
        }
        let length = if distance.is_finite() { distance - tracer.offset() } else { f64::INFINITY };
        if length > 0.0 && tracer.blocked(&tracer.ray(&place, direction, length), salt ^ n) {
            if receivers.buried(tracer, &place, salt ^ n) {
                skipped += 1;
            } else {
                dark += 1;
            }
        } else {
            lit += 1;
            for (sum, e) in sum.iter_mut().zip(arriving) {
                *sum += f64::from(e) * cosine;
            }
        }
        if n == pilot && lit > 0 && dark > 0 {
            end = shadowing.mixed.max(pilot);
        }
    }
    (sum.map(|s| (s / f64::from((n - skipped).max(1))) as f32), lit > 0 && dark > 0)
}

/// A light of few triangles: analytic value times visible share.
fn from_few(
    pieces: &[Piece],
    tracer: &Tracer,
    receivers: &impl Receivers,
    i: usize,
    shadowing: &Shadowing,
    (sequence, salt): (&Sequence, u32),
) -> (Bands, bool) {
    let mut factors = [0f64; MOST_EXACT_PIECES];
    let mut here = [0f64; 3];
    let mut unshadowed = [0f64; 3];
    let mut visible = [0f64; 3];
    let mut sampled = [0f64; 3];
    let (mut lit, mut dark, mut n, mut evaluated) = (0, 0, 0, 0);
    let mut end = shadowing.pilot;
    let mut last: Option<(Place, f64)> = None;
    let varied = pieces.iter().any(|piece| piece.varied);
    while n < end {
        let [u, v, x, y] = sequence.point(n);
        n += 1;
        let Some(place) = receivers.place(i, x, y) else { return ([0.0; 3], false) };
        // The factors of all pieces from here; a point has only one place.
        let fresh = last.is_none_or(|(old, _)| old != place);
        let total = match last {
            Some((_, total)) if !fresh => total,
            _ => {
                let mut total = 0.0;
                here = [0.0; 3];
                for (piece, factor) in pieces.iter().zip(&mut factors) {
                    *factor = 0.0;
                    if piece.triangle != place.triangle {
                        *factor = point_to_triangle(place.point, place.normal, piece.corners);
                    }
                    for (sum, e) in here.iter_mut().zip(piece.exitance) {
                        *sum += *factor * f64::from(e);
                    }
                    *factor *= f64::from(luminance(piece.exitance));
                    total += *factor;
                }
                total
            }
        };
        last = Some((place, total));
        if total <= 0.0 {
            if !receivers.has_area() {
                return ([0.0; 3], false);
            }
            evaluated += 1;
            continue;
        }
        // Pick a piece by its unshadowed contribution, stretching u, and a direction in its solid angle.
        let mut rest = f64::from(u) * total;
        let mut k = 0;
        while k + 1 < pieces.len() && (rest >= factors[k] || factors[k] <= 0.0) {
            rest -= factors[k];
            k += 1;
        }
        while factors[k] <= 0.0 && k > 0 {
            k -= 1;
            rest = factors[k];
        }
        let piece = &pieces[k];
        let u = (rest / factors[k]).clamp(0.0, 1.0 - 1e-9);
        let (target, weight) = sample_piece(piece, &place, u, f64::from(v));
        // The weight of this sample for a source of unit exitance, over the density of having taken it.
        let weight = weight * total / factors[k];
        let hidden = weight > 0.0 && !tracer.mutually_visible(&place, &target, salt ^ n);
        if hidden && receivers.buried(tracer, &place, salt ^ n) {
            continue;
        }
        if fresh {
            (0..3).for_each(|band| unshadowed[band] += here[band]);
            evaluated += 1;
        }
        if weight <= 0.0 {
            continue;
        }
        if hidden {
            dark += 1;
        } else {
            lit += 1;
        }
        let tint = if piece.varied { emission_at(tracer, piece, target.point) } else { piece.exitance };
        for band in 0..3 {
            sampled[band] += weight * f64::from(piece.exitance[band]);
            if !hidden {
                visible[band] += weight * f64::from(tint[band]);
            }
        }
        if n == shadowing.pilot && (lit > 0 && (dark > 0 || varied)) {
            end = shadowing.mixed.max(shadowing.pilot);
        }
    }
    let irradiance = std::array::from_fn(|band| {
        let mean = unshadowed[band] / f64::from(evaluated.max(1));
        if lit == 0 || sampled[band] <= 0.0 {
            0.0
        } else if dark == 0 && !varied {
            mean as f32
        } else {
            (mean * visible[band] / sampled[band]) as f32
        }
    });
    (irradiance, lit > 0 && dark > 0)
}

/// A light of many triangles: picked by power, sampled by area.
fn from_many(
    (pieces, cumulative): (&[Piece], &[f64]),
    tracer: &Tracer,
    receivers: &impl Receivers,
    i: usize,
    shadowing: &Shadowing,
    (sequence, salt): (&Sequence, u32),
) -> (Bands, bool) {
    let mut sum = [0f64; 3];
    let (mut lit, mut dark, mut skipped, mut n) = (0, 0, 0, 0);
    let mut end = shadowing.pilot;
    while n < end {
        let [u, v, x, y] = sequence.point(n);
        n += 1;
        let Some(place) = receivers.place(i, x, y) else { return ([0.0; 3], false) };
        let u = f64::from(u);
        let k = cumulative.partition_point(|c| *c <= u).min(pieces.len() - 1);
        let below = if k == 0 { 0.0 } else { cumulative[k - 1] };
        let share = cumulative[k] - below;
        let piece = &pieces[k];
        let (p, q) =
            radiosity_scene::elements::triangle_from_square(((u - below) / share).clamp(0.0, 1.0 - 1e-9), f64::from(v));
        let [a, b, c] = piece.corners;
        let target = Place { point: a + p * (b - a) + q * (c - a), normal: piece.normal, triangle: piece.triangle };
        let along = target.point - place.point;
        let square = along.length_squared();
        let cosines = along.dot(place.normal).max(0.0) * (-along.dot(target.normal)).max(0.0);
        if cosines <= 0.0 || square <= 0.0 {
            continue;
        }
        let weight = cosines / (square * square) * piece.area / (std::f64::consts::PI * share);
        if tracer.mutually_visible(&place, &target, salt ^ n) {
            lit += 1;
            let tint = if piece.varied { emission_at(tracer, piece, target.point) } else { piece.exitance };
            for (sum, e) in sum.iter_mut().zip(tint) {
                *sum += weight * f64::from(e);
            }
        } else if receivers.buried(tracer, &place, salt ^ n) {
            skipped += 1;
        } else {
            dark += 1;
        }
        if n == shadowing.pilot && lit > 0 {
            end = shadowing.mixed.max(shadowing.pilot);
        }
    }
    (sum.map(|s| (s / f64::from((n - skipped).max(1))) as f32), lit > 0 && dark > 0)
}

/// A point of a piece and its weight: the form-factor density over the sampling density.
fn sample_piece(piece: &Piece, place: &Place, x: f64, y: f64) -> (Place, f64) {
    let [a, b, c] = piece.corners;
    let seen = |point| Place { point, normal: piece.normal, triangle: piece.triangle };
    // Far away the solid angle is too small for its own arithmetic, and area sampling is as good.
    let distance = (a + b + c) / 3.0 - place.point;
    if piece.area < 1e-3 * distance.length_squared() {
        let (p, q) = radiosity_scene::elements::triangle_from_square(x, y);
        let target = seen(a + p * (b - a) + q * (c - a));
        let along = target.point - place.point;
        let square = along.length_squared();
        let cosines = along.dot(place.normal).max(0.0) * (-along.dot(piece.normal)).max(0.0);
        return (target, cosines / (square * square) * piece.area / std::f64::consts::PI);
    }
    let Some(triangle) = SphericalTriangle::new(place.point, piece.corners) else {
        return (seen(a), 0.0);
    };
    let direction = triangle.direction(x, y);
    let cosine = direction.dot(place.normal);
    let towards = -direction.dot(piece.normal);
    if cosine <= 0.0 || towards <= 0.0 {
        return (seen(a), 0.0);
    }
    let reach = (place.point - a).dot(piece.normal) / towards;
    (seen(place.point + reach * direction), cosine * triangle.solid_angle / std::f64::consts::PI)
}

/// Exitance of a piece at a point of it, where the emission is a picture.
fn emission_at(tracer: &Tracer, piece: &Piece, point: DVec3) -> Bands {
    let [a, b, c] = tracer.mesh.corners(piece.triangle as usize);
    let normal = (b - a).cross(c - a);
    let square = normal.length_squared();
    let uv = DVec2::new((point - a).cross(c - a).dot(normal) / square, (b - a).cross(point - a).dot(normal) / square);
    let at = tracer.mesh.surface(piece.triangle as usize, uv.clamp(DVec2::ZERO, DVec2::ONE));
    tracer.scene.emitted_luminance(at).map(|l| l * std::f32::consts::PI)
}
