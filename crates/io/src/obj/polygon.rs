//! Plane polygons to triangles, concave ones by ear clipping (crate `earcut`).

use earcut::Earcut;
use glam::{DVec2, DVec3};

/// Most corners of one polygon. Ear clipping may take time with their square: at this size half a second.
pub(crate) const MAX_CORNERS: usize = 16_384;

/// Triangles of a polygon as numbers of its corners, in the polygon's own sense of rotation.
///
/// A polygon without a plane (no area, or corners that are not finite) comes out as a fan, which whoever checks
/// triangles will drop.
pub(crate) fn triangulate(corners: &[DVec3]) -> Vec<[u32; 3]> {
    let count = corners.len() as u32;
    let fan = || (1..count.saturating_sub(1)).map(|i| [0, i, i + 1]).collect();
    if count <= 3 {
        return fan();
    }
    // Newell's normal: twice the vector area, taken from the first corner so that distance costs no digits.
    let Some(&origin) = corners.first() else { return fan() };
    let relative: Vec<DVec3> = corners.iter().map(|&p| p - origin).collect();
    let normal: DVec3 = relative.windows(2).map(|pair| pair[0].cross(pair[1])).sum();
    let Some(normal) = normal.try_normalize() else { return fan() };

    // Seen against the normal the polygon runs counter-clockwise.
    let x = normal.any_orthonormal_vector();
    let y = normal.cross(x);
    let flat: Vec<DVec2> = relative.iter().map(|p| DVec2::new(p.dot(x), p.dot(y))).collect();
    if !flat.iter().all(|p| p.is_finite()) {
        return fan();
    }
    if is_convex(&flat) {
        return fan();
    }
    let mut triangles: Vec<u32> = Vec::new();
    Earcut::new().earcut(flat.iter().map(|p| p.to_array()), &[], &mut triangles);
    let oriented = triangles.chunks_exact(3).map(|t| {
        let [a, b, c] = [t[0], t[1], t[2]];
        let at = |i: u32| flat.get(i as usize).copied().unwrap_or_default();
        if (at(b) - at(a)).perp_dot(at(c) - at(a)) < 0.0 { [a, c, b] } else { [a, b, c] }
    });
    let out: Vec<[u32; 3]> = oriented.collect();
    if out.is_empty() { fan() } else { out }
}

/// Whether a counter-clockwise polygon turns left at every corner, once around.
fn is_convex(flat: &[DVec2]) -> bool {
    let count = flat.len();
    let at = |i: usize| flat.get(i % count).copied().unwrap_or_default();
    let mut turned = 0.0;
    for i in 0..count {
        let (before, after) = (at(i + 1) - at(i), at(i + 2) - at(i + 1));
        let turn = before.perp_dot(after);
        if turn <= 0.0 {
            return false;
        }
        turned += turn.atan2(before.dot(after));
    }
    // A star turns left everywhere too, but twice around.
    turned < 3.0 * std::f64::consts::PI
}

#[cfg(test)]
mod tests {
    use super::*;

    fn vector_area(corners: &[DVec3], triangles: &[[u32; 3]]) -> (DVec3, f64) {
        let areas = triangles.iter().map(|t| {
            let [a, b, c] = t.map(|i| corners[i as usize]);
            0.5 * (b - a).cross(c - a)
        });
        areas.fold((DVec3::ZERO, 0.0), |(sum, total), a| (sum + a, total + a.length()))
    }

    #[test]
    fn concave_polygons_keep_area_and_sense_in_any_plane() {
        let l = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]];
        for turn in 0..12 {
            let turn = glam::DQuat::from_euler(glam::EulerRot::XYZ, 0.5 * turn as f64, 0.9 * turn as f64, 0.3);
            for start in 0..6 {
                let corners: Vec<DVec3> =
                    (0..6).map(|i| turn * (DVec3::new(l[(i + start) % 6][0], l[(i + start) % 6][1], 7.0))).collect();
                for mirrored in [false, true] {
                    let mut corners = corners.clone();
                    if mirrored {
                        corners.reverse();
                    }
                    let triangles = triangulate(&corners);
                    let (vector, total) = vector_area(&corners, &triangles);
                    let front = if mirrored { -1.0 } else { 1.0 } * (turn * DVec3::Z);
                    assert!((total - 3.0).abs() < 1e-12 && (vector - 3.0 * front).length() < 1e-12, "{triangles:?}");
                    assert_eq!(triangles.len(), 4);
                }
            }
        }
    }

    #[test]
    fn hopeless_polygons_come_out_as_fans() {
        assert!(triangulate(&[]).is_empty());
        assert!(triangulate(&[DVec3::ZERO; 2]).is_empty());
        assert_eq!(triangulate(&[DVec3::ZERO; 5]).len(), 3);
        assert_eq!(triangulate(&[DVec3::NAN; 4]).len(), 2);
        assert_eq!(triangulate(&[DVec3::X * 1e300, DVec3::ZERO, DVec3::Y * 1e300, DVec3::ONE]).len(), 2);
    }

    #[test]
    fn a_star_is_not_taken_for_convex() {
        let star: Vec<DVec3> =
            (0..5).map(|i| glam::DQuat::from_rotation_z(f64::from(i) * 2.0 * 1.2566) * DVec3::X).collect();
        let flat: Vec<DVec2> = star.iter().map(|p| p.truncate()).collect();
        assert!(!is_convex(&flat));
    }
}
