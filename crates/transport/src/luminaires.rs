//! Luminaires: the small and bright sources, whose light goes to every receiver directly ([`crate::direct`]) and never
//! through rows of rays, which would find them too seldom.

use crate::polygon::Four;
use glam::DVec3;
use radiosity_scene::{AlphaMode, Bands, Elements, PointLight, Scene, Side, luminance};
use radiosity_trace::{Emitter, EmitterTree, Tracer, quadrilateral};
use rayon::prelude::*;
use smallvec::SmallVec;
use std::ops::Range;

mod beams;

/// A source whose exitance is at most this multiple of the scene's mean goes through the rows, where it costs
/// nothing extra: its noise there is no more than that of ordinary reflected light. The mean is over all surfaces, or over
/// half of the box around these and all eyes where that is more: rays from afar would meet a lone lamp too seldom.
pub const BRIGHT: f64 = 2.0;

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
    /// Mean exitance, lm/m² per band: π L times the opacity.
    pub exitance: Bands,
    /// Area, m².
    pub area: f64,
    /// Whether the emission or the opacity varies over the triangle.
    pub varied: bool,
}

/// A convex part of a lamp that is evenly bright: a triangle, or two that make a quadrilateral.
#[derive(Clone, Debug)]
pub(crate) struct Panel {
    /// Corners, counter-clockwise seen from the emitting side.
    pub corners: SmallVec<[DVec3; 4]>,
    /// Two axes along it and the third against its normal, right-handed.
    pub axes: [DVec3; 3],
    /// Its triangles, by their number among those of the light.
    pub pieces: Range<usize>,
}

impl Panel {
    /// How far a point is from it.
    pub fn distance(&self, point: DVec3) -> f64 {
        let edges = self.corners.iter().zip(self.corners.iter().cycle().skip(1));
        let is_above = edges.clone().all(|(a, b)| (b - a).cross(point - a).dot(self.axes[2]) <= 0.0);
        if is_above {
            return (point - self.corners[0]).dot(self.axes[2]).abs();
        }
        let from_edge = |(a, b): (&DVec3, &DVec3)| {
            let along = b - a;
            let share = ((point - a).dot(along) / along.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
            point.distance(a + share * along)
        };
        edges.map(from_edge).fold(f64::INFINITY, f64::min)
    }

    /// Those of a light, one for each piece or two that follow each other.
    fn of(pieces: &[Piece]) -> Vec<Panel> {
        let mut panels: Vec<Panel> = Vec::new();
        for (k, piece) in pieces.iter().enumerate() {
            let joined = panels.last().and_then(|last| {
                let first = &pieces[last.pieces.start];
                let is_like = last.pieces.len() == 1 && first.exitance == piece.exitance;
                (is_like && first.normal.dot(piece.normal) > FLAT)
                    .then(|| quadrilateral(first.corners, piece.corners))
                    .flatten()
            });
            match (joined, panels.last_mut()) {
                (Some(corners), Some(last)) => {
                    (last.corners, last.pieces.end) = (SmallVec::from_slice(&corners), k + 1)
                }
                _ => {
                    let x = (piece.corners[1] - piece.corners[0]).normalize_or_zero();
                    let axes = [x, x.cross(piece.normal), -piece.normal];
                    panels.push(Panel { corners: SmallVec::from_slice(&piece.corners), axes, pieces: k..k + 1 });
                }
            }
        }
        panels
    }
}

/// Cosine of what lies in one plane, at least.
const FLAT: f64 = 1.0 - 1e-12;

/// Lights with more triangles than this have them in a tree, too: to evaluate the polygon factor of each takes longer than a few rays.
pub(crate) const MOST_EXACT_PIECES: usize = 64;

/// Lights of more panels than this are looked at by rays alone: a place would look for blockers as often.
const MOST_PANELS: usize = 8;

/// More objects that emit than this are one light: what each gives to each element would fill the memory, and to
/// look at all of them from every place would take longer than the rays.
const MOST_LAMPS: usize = 32;

/// The triangles of a light in a tree.
#[derive(Clone, Debug)]
pub struct PieceTree {
    /// Its leaves are in the order of the triangles.
    pub(crate) tree: EmitterTree,
    /// The triangles of each leaf.
    pub(crate) leaves: Vec<Four>,
}

/// A source of direct light.
#[derive(Clone, Debug)]
pub enum Light {
    /// Emitting triangles of one object, or of all where there are more than 32.
    Area {
        /// Name of the object; empty for all of them.
        name: String,
        /// Its triangles.
        pieces: Vec<Piece>,
        /// The same by fours.
        fours: Vec<Four>,
        /// A tree, where there are many.
        tree: Option<PieceTree>,
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

    /// Its triangles, if it has no tree of them.
    pub(crate) fn few(&self) -> &[Piece] {
        match self {
            Light::Area { pieces, tree: None, .. } => pieces,
            _ => &[],
        }
    }
}

/// All lights that are evaluated directly.
#[derive(Clone, Debug, Default)]
pub struct Luminaires {
    /// The lights.
    pub lights: Vec<Light>,
    /// The triangles of all lights without a tree, one after the other: lamps of two triangles would leave half of the lanes empty.
    pub(crate) few: Vec<Four>,
    /// How many triangles lights with a tree have.
    pub(crate) many: usize,
    /// By light, its panels, if all of them are evenly bright and there are few.
    pub(crate) panels: Vec<Vec<Panel>>,
    /// Exitance of each element (bands) that is counted through `lights` and must not be counted by rows as well.
    pub promoted: Vec<[f32; 4]>,
    /// Triangles by side whose whole emission is carried by `lights`.
    carried: Vec<[bool; 2]>,
    /// By beam, whether its end belongs to the last light; empty if there is no such light.
    beams: Vec<bool>,
}

impl Luminaires {
    /// Collects the scene's lights. `exitance` has the exitance of each element per band where it is opaque, as
    /// [`Elements::optics`] gives it.
    pub fn new(tracer: &Tracer, elements: &Elements, area: &[f64], exitance: &[Bands]) -> Luminaires {
        let (scene, mesh) = (tracer.scene, tracer.mesh);
        let total_area = area.iter().sum::<f64>().max(0.5 * around(mesh.vertices.iter().chain(tracer.eyes())));
        let opacity: Vec<f32> =
            (0..elements.len() as u32).into_par_iter().map(|e| elements.opacity(scene, mesh, e)).collect();
        // What an element emits is seen by rays that it stops and by samples of it alike: its exitance times opacity.
        let given = |e: usize, band: usize| f64::from(opacity[e]) * area[e] * f64::from(exitance[e][band]);
        let power: f64 =
            (0..elements.len()).map(|e| f64::from(opacity[e]) * area[e] * f64::from(luminance(exitance[e]))).sum();
        let bright = BRIGHT * power / total_area.max(f64::MIN_POSITIVE);

        // Mean exitance of each triangle's sides from those of its elements.
        let mut pieces: Vec<(u32, Piece)> = Vec::new();
        let mut promoted = vec![[0f32; 4]; elements.len()];
        let mut carried = vec![[false; 2]; mesh.triangles.len()];
        for (triangle, carried) in carried.iter_mut().enumerate() {
            for side in [Side::Front, Side::Back] {
                let own: Vec<usize> = elements
                    .cells_of(triangle, side)
                    .flat_map(|cell| elements.of_cell(cell))
                    .map(|e| e as usize)
                    .collect();
                let peak = own.iter().map(|&e| luminance(exitance[e])).fold(0f32, f32::max);
                if f64::from(peak) <= bright {
                    continue;
                }
                let whole: f64 = own.iter().map(|&e| area[e]).sum();
                let mean: Bands =
                    std::array::from_fn(|band| (own.iter().map(|&e| given(e, band)).sum::<f64>() / whole) as f32);
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
                        varied: varied(scene, source),
                    },
                ));
                carried[side as usize] = true;
                for e in own {
                    promoted[e][..3].copy_from_slice(&exitance[e]);
                }
            }
        }
        // One side after the other, as what makes a quadrilateral follows each other.
        pieces.sort_by_key(|(object, piece)| (*object, piece.side as usize));

        let mut lights = Vec::new();
        if pieces.chunk_by(|a, b| a.0 == b.0).count() > MOST_LAMPS {
            lights.push(area_light(String::new(), pieces.into_iter().map(|(_, piece)| piece).collect()));
        } else {
            for group in pieces.chunk_by(|a, b| a.0 == b.0) {
                let name = scene.objects[group[0].0 as usize].name.clone();
                lights.push(area_light(name, group.iter().map(|(_, piece)| piece.clone()).collect()));
            }
        }
        lights.extend(scene.lights.iter().cloned().map(Light::Point));
        Luminaires { promoted, carried, ..Luminaires::default() }.with(lights)
    }

    /// With these lights.
    fn with(self, lights: Vec<Light>) -> Luminaires {
        let few: Vec<[DVec3; 3]> = lights.iter().flat_map(Light::few).map(|piece| piece.corners).collect();
        let panels = lights.iter().map(|light| {
            let pieces = light.few();
            let panels = if pieces.iter().any(|piece| piece.varied) { Vec::new() } else { Panel::of(pieces) };
            if panels.len() > MOST_PANELS { Vec::new() } else { panels }
        });
        let panels = panels.collect();
        let in_trees = |light: &Light| match light {
            Light::Area { pieces, tree: Some(_), .. } => pieces.len(),
            _ => 0,
        };
        let many = lights.iter().map(in_trees).sum();
        Luminaires { lights, few: few.chunks(4).map(Four::new).collect(), many, panels, ..self }
    }

    /// Lights that a scene has at most, told by its objects alone.
    pub fn most(scene: &Scene) -> usize {
        let shining = scene.objects.iter().filter(|object| scene.materials[object.material].emits()).count();
        let beams = usize::from(!scene.lights.is_empty());
        scene.lights.len() + shining.min(MOST_LAMPS) + beams
    }

    /// Whether all emission of a triangle's side reaches receivers through the lights. Its elements may still be dark
    /// in [`Luminaires::promoted`], where their few samples miss what is bright in a picture.
    pub fn carries(&self, triangle: usize, side: Side) -> bool {
        self.carried[triangle][side as usize]
    }
}

/// The surface of the box around places, m².
fn around<'p>(places: impl Iterator<Item = &'p DVec3>) -> f64 {
    let nothing = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let (low, high) = places.fold(nothing, |(low, high), p| (low.min(*p), high.max(*p)));
    let DVec3 { x, y, z } = (high - low).max(DVec3::ZERO);
    2.0 * (x * y + y * z + z * x)
}

fn area_light(name: String, mut pieces: Vec<Piece>) -> Light {
    let tree = (pieces.len() > MOST_EXACT_PIECES).then(|| {
        let power = |piece: &Piece| piece.area * f64::from(luminance(piece.exitance)).max(f64::MIN_POSITIVE);
        let emitter = |piece: &Piece| Emitter::triangle(piece.corners, piece.normal, power(piece));
        let tree = EmitterTree::new(&pieces.iter().map(emitter).collect::<Vec<_>>(), 4);
        pieces = tree.order().iter().map(|&k| pieces[k as usize].clone()).collect();
        tree
    });
    let corners: Vec<[DVec3; 3]> = pieces.iter().map(|piece| piece.corners).collect();
    let tree = tree.map(|tree| {
        let of_leaf = |leaf: &Range<u32>| Four::new(&corners[leaf.start as usize..leaf.end as usize]);
        PieceTree { leaves: tree.leaves().iter().map(of_leaf).collect(), tree }
    });
    Light::Area { name, pieces, fours: corners.chunks(4).map(Four::new).collect(), tree }
}

/// Whether what a triangle gives varies over it.
fn varied(scene: &Scene, triangle: usize) -> bool {
    let material = scene.material(triangle);
    let see_through = material.alpha_mode != AlphaMode::Opaque;
    material.emissive_texture.is_some()
        || see_through && (material.base_color_texture.is_some() || !scene.colors.is_empty())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::direct::tests::prepared;
    use glam::DQuat;
    use radiosity_scene::Material;

    /// Triangles of one object come front and back in turn: two that make a quadrilateral are one panel all the same.
    #[test]
    fn a_square_that_shines_on_both_sides_is_two_panels() {
        let lamp = Material { emissive: [1000.0; 3], double_sided: true, ..Material::default() };
        let mut scene = Scene { materials: vec![Material::default(), lamp], ..Scene::default() };
        let quad = |low: DVec3, size: f64| {
            [low, low + size * DVec3::X, low + size * (DVec3::X + DVec3::Y), low + size * DVec3::Y]
        };
        scene.add_quad("floor", 0, quad(DVec3::ZERO, 10.0));
        scene.add_quad("lamp", 1, quad(DVec3::new(4.0, 4.0, 2.0), 0.5));
        let (_, _, _, luminaires) = prepared(&scene, 10.0);
        let panels: Vec<usize> = luminaires.panels[0].iter().map(|panel| panel.corners.len()).collect();
        assert_eq!(panels, [4, 4]);
    }

    /// What rays meet everywhere goes through rows; what shines alone, seldom met from afar, does not: two plates far apart, and a lone lamp that is looked at from far away.
    #[test]
    fn a_lone_lamp_is_a_light_and_the_walls_of_a_furnace_are_none() {
        let lamp = Material { emissive: [1000.0; 3], ..Material::default() };
        let scene = |quads: &[[DVec3; 4]]| {
            let mut scene = Scene { materials: vec![lamp.clone()], ..Scene::default() };
            for corners in quads {
                scene.add_quad("lamp", 0, *corners);
            }
            scene
        };
        let square = |origin: DVec3, u: DVec3, v: DVec3| [origin, origin + u, origin + u + v, origin + v];
        let [x, y, z] = DVec3::AXES;
        let plates = |gap: f64| scene(&[square(DVec3::ZERO, x, y), square(gap * z, y, x)]);
        let furnace = scene(&[
            square(DVec3::ZERO, x, y),
            square(z, y, x),
            square(DVec3::ZERO, y, z),
            square(x, z, y),
            square(DVec3::ZERO, z, x),
            square(y, x, z),
        ]);
        let turned = |scene: &Scene| {
            let turn = DQuat::from_rotation_arc(DVec3::ONE.normalize(), z);
            Scene { positions: scene.positions.iter().map(|p| turn * *p).collect(), ..scene.clone() }
        };
        let lights = |scene: &Scene| prepared(scene, 10.0).3.lights.len();
        assert_eq!(lights(&turned(&furnace)), 0);
        assert_eq!([lights(&furnace), lights(&plates(0.1)), lights(&plates(10.0))], [0, 0, 2]);
        let alone = scene(&[square(DVec3::ZERO, x, y)]);
        let (mesh, elements, area, near) = prepared(&alone, 10.0);
        let tracer = Tracer::new(&alone, &mesh).seen_from(&[20.0 * z]);
        let exitance = vec![[1000.0; 3]; elements.len()];
        let far = Luminaires::new(&tracer, &elements, &area, &exitance);
        assert_eq!([near.lights.len(), far.lights.len()], [0, 1]);
    }
}
