//! Places all over an element: rows of equal distance along its sides.

use radiosity_scene::{Bands, luminance};

/// How many places an element of so many parts has.
pub fn places_of(parts: u32) -> usize {
    ((parts + 1) * (parts + 2) / 2) as usize
}

/// Weights of the corners 1 and 2 of an element at its places, row by row.
pub fn places(parts: u32) -> impl Iterator<Item = [f32; 2]> {
    (0..=parts).flat_map(move |j| (0..=parts - j).map(move |i| [i, j].map(|k| k as f32 / parts as f32)))
}

/// The place (i, j) among all, row by row.
pub fn place(parts: u32, i: usize, j: usize) -> usize {
    j * (parts as usize + 1) - j * j.saturating_sub(1) / 2 + i
}

/// What is at a place of an element between those that are known.
pub fn between(parts: u32, known: &[Bands], [v, w]: [f32; 2]) -> Bands {
    let n = parts as usize;
    let at = |i: usize, j: usize| known[place(parts, i, j)];
    let [x, y] = [v, w].map(|x| x.clamp(0.0, 1.0) * n as f32);
    let j = (y as usize).min(n - 1);
    let i = (x as usize).min(n - 1 - j);
    let (x, y) = (x - i as f32, y - j as f32);
    // Of the two halves of a cell, the upper is not there at the slanting side.
    let (first, weights) = if x + y <= 1.0 || i + j + 2 > n {
        (at(i, j), [1.0 - x - y, x, y])
    } else {
        (at(i + 1, j + 1), [x + y - 1.0, 1.0 - y, 1.0 - x])
    };
    let others = [at(i + 1, j), at(i, j + 1)];
    std::array::from_fn(|band| weights[0] * first[band] + weights[1] * others[0][band] + weights[2] * others[1][band])
}

/// What the corners of an element have.
pub fn corners(parts: u32, known: &[Bands]) -> [Bands; 3] {
    [known[0], known[parts as usize], known[places_of(parts) - 1]]
}

/// Whether places have about what would run evenly between the corners.
pub fn is_even(parts: u32, known: &[Bands], tolerance: f32) -> bool {
    let corners = corners(parts, known);
    let apart = |(uv, known): ([f32; 2], &Bands)| luminance(*known) - luminance(between(1, &corners, uv));
    places(parts).zip(known).all(|place| apart(place).abs() <= tolerance)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Places are told as they are, and what runs evenly between them is met everywhere.
    #[test]
    fn between_places_light_runs_evenly() {
        let plane = |[v, w]: [f32; 2]| 1.0 + 2.0 * v - 3.0 * w;
        for parts in [1, 2, 6, 7] {
            let known: Vec<Bands> = places(parts).map(|uv| [plane(uv); 3]).collect();
            assert_eq!(known.len(), places_of(parts));
            assert!(is_even(parts, &known, 1e-5));
            let others = (0..40).flat_map(|i| (0..=40 - i).map(move |j| [i as f32 / 41.0, j as f32 / 41.0]));
            for uv in places(parts).chain(others) {
                assert!((between(parts, &known, uv)[1] - plane(uv)).abs() < 1e-5, "{uv:?}");
            }
        }
        let peak = places(6).position(|uv| uv == [0.5, 0.5]).unwrap();
        let mut one = vec![[0.0; 3]; places_of(6)];
        one[peak] = [1.0; 3];
        assert!(!is_even(6, &one, 0.9));
        for (place, uv) in places(6).enumerate() {
            let wanted = if place == peak { 1.0 } else { 0.0 };
            assert!((between(6, &one, uv)[0] - wanted).abs() < 1e-5, "{uv:?}");
        }
    }
}
