//! Where a person would put the camera of a scene that has none.
//!
//! A scene with a room in it is looked at from inside ([`inside`]), or straight through the wall that it lacks;
//! everything else from the front and above, as near as the frame of the picture allows ([`outside`]). Front is what
//! glTF says, +Z; where the zenith is +Z it is −Y, as modellers have it. Candidates are judged by rays, the same ones
//! in every run. What it cannot know: a hollow house that is finished outside and in counts as a room.

mod inside;
mod outside;

use glam::DVec3;
use radiosity_scene::{Camera, Mesh, Side, Up};
use radiosity_trace::sampling::Sequence;
use radiosity_trace::{Found, Tracer};
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Width over height of the widest picture that is chosen, and of the narrowest.
const ASPECTS: [f64; 2] = [16.0 / 9.0, 0.75];

/// A camera for a scene that has none, for pictures of `aspect` (width over height). Where that is left open, the camera
/// says in which one the scene fills its picture best, from 3 : 4 to 16 : 9.
pub fn place_camera(tracer: &Tracer, aspect: Option<f64>) -> Camera {
    let up = tracer.scene.up.direction();
    let front = match tracer.scene.up {
        Up::Y => DVec3::Z,
        Up::Z => DVec3::NEG_Y,
    };
    let subject = subject(tracer.mesh, up);
    let Some(bounds) = bounds(&subject) else {
        return Camera::look_at("outside", front, DVec3::ZERO, up, 1.0);
    };
    let site = Site { tracer, subject, bounds, axes: [up.cross(front), up, front], aspect };
    let from_room = |room: Room| site.through_open_side().or_else(|| site.inside(&room));
    site.room().and_then(from_room).unwrap_or_else(|| site.outside())
}

/// Ground that is more than twice as wide as what stands on it, in both directions, is no part of what is looked at.
fn subject(mesh: &Mesh, up: DVec3) -> Vec<DVec3> {
    let Some([low, high]) = bounds(&mesh.vertices) else { return Vec::new() };
    let ground = low.dot(up) + 0.05 * (high - low).dot(up);
    let stands =
        |t: &usize| mesh.normal(*t).dot(up).abs() < 0.95 || mesh.corners(*t).iter().any(|p| p.dot(up) > ground);
    let standing: Vec<DVec3> = (0..mesh.triangles.len()).filter(stands).flat_map(|t| mesh.corners(t)).collect();
    let plan = |size: DVec3| size - size.dot(up) * up;
    match bounds(&standing) {
        Some([a, b]) if (2.0 * plan(b - a)).cmple(plan(high - low)).all() => standing,
        _ => mesh.vertices.clone(),
    }
}

fn bounds(points: &[DVec3]) -> Option<[DVec3; 2]> {
    let first = *points.first()?;
    Some(points.iter().fold([first, first], |[low, high], &p| [low.min(p), high.max(p)]))
}

/// A scene, what is to be seen of it, and which way it lies.
struct Site<'a> {
    tracer: &'a Tracer<'a>,
    subject: Vec<DVec3>,
    bounds: [DVec3; 2],
    /// To the right, up and to the front, unit.
    axes: [DVec3; 3],
    /// Width over height of the picture, where it is given.
    aspect: Option<f64>,
}

/// Where people can be in a scene.
struct Room {
    bounds: [DVec3; 2],
    height: f64,
}

/// Places that are asked whether they are in a room; some ten of them lie in a room that takes a hundredth of the box.
const PLACES: u32 = 1024;

/// Rays from each.
const AROUND: u32 = 64;

/// Part of the rays from a place in a room that end on fronts. Windows take less than the rest; at 0.8 the compartments
/// of a shelf are rooms, too.
const ENCLOSED: f64 = 0.9;

/// Part of the places that must be in rooms.
const ROOMY: f64 = 0.01;

/// Heights, metres, of a hollow for people and not for things. They are asked only where the scene is finished on its
/// outside as well; what is higher may be a model in other units and must be half as high as the whole.
const HEADROOM: [f64; 2] = [1.9, 8.0];

impl Site<'_> {
    /// The rooms of the scene, if it has an inside that a camera belongs into.
    fn room(&self) -> Option<Room> {
        let [low, high] = self.bounds;
        let up = self.axes[1];

        // Seen from around and above, a room that was modelled to be seen from inside shows backs.
        let (centre, radius) = (0.5 * (low + high), (high - low).length());
        let (mut fronts, mut backs) = (0, 0);
        for i in 0..PLACES {
            let [[u, v, ..], [x, y, z, _]] = [7, 8].map(|stream| Sequence::new(7, stream).point(i).map(f64::from));
            let eye = centre + radius * self.direction(TAU * u, (0.2 + 0.6 * v).asin());
            match self.first(eye, low + (high - low) * DVec3::new(x, y, z) - eye, i) {
                Found::Surface { .. } => fronts += 1,
                Found::Back => backs += 1,
                Found::Escaped => {}
            }
        }

        // Places with fronts all around, and how high it is there.
        let places = Sequence::new(7, 9);
        let mut enclosed: Vec<(f64, DVec3)> = (0..PLACES)
            .into_par_iter()
            .filter_map(|i| {
                let [u, v, w, _] = places.point(i).map(f64::from);
                let place = low + (high - low) * DVec3::new(u, v, w);
                let rays = Sequence::new(7, 10 + i);
                let is_front = |j: &u32| {
                    let [u, v, ..] = rays.point(*j).map(f64::from);
                    self.front(place, self.direction(TAU * u, (2.0 * v - 1.0).asin()), *j).is_some()
                };
                let is_enclosed = (0..AROUND).filter(is_front).count() as f64 >= ENCLOSED * f64::from(AROUND);
                is_enclosed.then(|| Some((self.front(place, up, i)? + self.front(place, -up, i)?, place)))?
            })
            .collect();
        enclosed.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (height, middle) = *enclosed.get(enclosed.len() / 2)?;

        let for_people = height > HEADROOM[0] && (height < HEADROOM[1] || height > 0.5 * (high - low).dot(up));
        let is_room = enclosed.len() as f64 > ROOMY * f64::from(PLACES) && (backs > fronts || for_people);
        let around = |[low, high]: [DVec3; 2], (_, p): &(f64, DVec3)| [low.min(*p), high.max(*p)];
        is_room.then(|| Room { bounds: enclosed.iter().fold([middle; 2], around), height })
    }

    /// A unit direction by azimuth, from the front to the right, and elevation, radians.
    fn direction(&self, azimuth: f64, elevation: f64) -> DVec3 {
        let [right, up, front] = self.axes;
        elevation.cos() * (azimuth.sin() * right + azimuth.cos() * front) + elevation.sin() * up
    }

    fn first(&self, eye: DVec3, direction: DVec3, seed: u32) -> Found {
        self.tracer.first(&self.tracer.free_ray(eye, direction.normalize_or(DVec3::X)), seed)
    }

    /// The distance to the first surface, if it shows its front. The far side of a two-sided surface may be the inside of
    /// a solid.
    fn front(&self, eye: DVec3, direction: DVec3, seed: u32) -> Option<f64> {
        match self.first(eye, direction, seed) {
            Found::Surface { distance, side: Side::Front, .. } => Some(f64::from(distance)),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use radiosity_scene::{Material, Projection, Scene};

    /// The outside of a box, or its inside.
    fn add_box(scene: &mut Scene, low: [f64; 3], high: [f64; 3], is_room: bool) {
        let corner =
            |i: usize| DVec3::from_array([0, 1, 2].map(|axis| if i >> axis & 1 == 0 { low[axis] } else { high[axis] }));
        for mut side in [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]] {
            if is_room {
                side.reverse();
            }
            scene.add_quad("side", 0, side.map(corner));
        }
    }

    fn placed(scene: &Scene) -> (Camera, DVec3, DVec3) {
        let mesh = Mesh::new(scene);
        let camera = place_camera(&Tracer::new(scene, &mesh), None);
        let eye = camera.position();
        let back = camera.world_from_camera.z_axis.truncate();
        (camera, eye, back)
    }

    /// Picture coordinates of a point.
    fn on_picture(camera: &Camera, point: DVec3) -> [f64; 2] {
        let p = camera.world_from_camera.inverse().transform_point3(point);
        let Projection::Perspective { vertical_fov } = camera.projection else { panic!("{camera:?}") };
        let tangent = (0.5 * vertical_fov).tan();
        [-p.x / p.z / tangent / camera.aspect.unwrap_or(1.0), -p.y / p.z / tangent]
    }

    fn empty(up: Up) -> Scene {
        Scene { up, materials: vec![Material::default()], ..Scene::default() }
    }

    #[test]
    fn things_are_seen_whole_from_their_front_and_above_and_fill_the_picture() {
        for (up, front) in [(Up::Y, DVec3::Z), (Up::Z, DVec3::NEG_Y)] {
            for size in [[1.0, 1.0, 1.0], [0.3, 4.0, 0.3], [5.0, 0.1, 4.0], [60.0, 40.0, 30.0]] {
                let mut scene = empty(up);
                add_box(&mut scene, [7.0, -3.0, 2.0], [7.0 + size[0], -3.0 + size[1], 2.0 + size[2]], false);
                let (camera, _, back) = placed(&scene);
                assert!(back.dot(front) > 0.5 && back.dot(up.direction()) > 0.1, "{size:?} {back}");
                let seen: Vec<[f64; 2]> = scene.positions.iter().map(|p| on_picture(&camera, *p)).collect();
                let most = seen.iter().flatten().fold(0.0, |m: f64, x| m.max(x.abs()));
                assert!((0.8..0.95).contains(&most), "{size:?} {most}");
            }
        }
    }

    #[test]
    fn a_panel_is_seen_straight_from_the_side_that_shows() {
        for turned in [false, true] {
            let mut scene = empty(Up::Y);
            let mut corners = [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 2.0, 0.0), DVec3::new(0.0, 2.0, 0.0)];
            if turned {
                corners.reverse();
            }
            scene.add_quad("panel", 0, corners);
            let (.., back) = placed(&scene);
            assert!(back.dot(if turned { DVec3::NEG_Z } else { DVec3::Z }) > 0.999, "{turned} {back}");
        }
    }

    #[test]
    fn a_closed_room_is_seen_from_inside_at_eye_height_and_with_its_furniture() {
        for units in [1.0, 0.01] {
            let mut scene = empty(Up::Y);
            add_box(&mut scene, [0.0; 3], [5.0 * units, 2.6 * units, 7.0 * units], true);
            let low = [3.8 * units, 0.0, 0.5 * units];
            add_box(&mut scene, low, [4.6 * units, 0.8 * units, 2.0 * units], false);
            let (camera, eye, _) = placed(&scene);
            let eye = eye / units;
            assert!(eye.cmpgt(DVec3::splat(0.1)).all() && eye.cmplt(DVec3::new(4.9, 1.7, 6.9)).all(), "{eye}");
            assert!(eye.y > 1.2 || units < 1.0, "{eye}");
            let middle = on_picture(&camera, DVec3::new(4.2, 0.4, 1.2) * units);
            assert!(middle.iter().all(|x| x.abs() < 1.0), "{middle:?}");
        }
    }

    #[test]
    fn a_room_without_a_wall_is_seen_through_it() {
        let scene = crate::cornell_box();
        let (camera, eye, back) = placed(&scene);
        assert!(back.dot(DVec3::NEG_Z) > 0.999 && eye.z < 0.0, "{eye}");
        assert!(camera.aspect.is_some_and(|aspect| (0.9..1.2).contains(&aspect)), "{camera:?}");
    }

    #[test]
    fn a_cupboard_is_no_room_and_wide_ground_is_not_what_is_looked_at() {
        let mut scene = empty(Up::Y);
        add_box(&mut scene, [0.0; 3], [1.0, 1.8, 0.6], false);
        add_box(&mut scene, [0.02, 0.02, 0.02], [0.98, 1.78, 0.58], true);
        let (camera, _, back) = placed(&scene);
        assert!(camera.name == "outside" && back.z > 0.5, "{camera:?}");

        let far = 200.0;
        let ground = [[-far, far], [far, far], [far, -far], [-far, -far]].map(|[x, z]| DVec3::new(x, 0.0, z));
        scene.add_quad("ground", 0, ground);
        let (_, eye, _) = placed(&scene);
        assert!(eye.length() < 10.0, "{eye}");
    }
}
