use super::*;
use radiosity_trace::sampling::{hash, unit};
use std::collections::HashMap;

/// Owned input.
#[derive(Default)]
struct Mesh {
    positions: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    group: Vec<u32>,
}

impl Mesh {
    fn input(&self) -> UnwrapInput<'_> {
        UnwrapInput { positions: &self.positions, triangles: &self.triangles, group: &self.group, smooth: &[] }
    }

    fn add(&mut self, group: u32, corners: &[DVec3], triangles: &[[u32; 3]]) {
        let base = self.positions.len() as u32;
        self.positions.extend(corners);
        self.triangles.extend(triangles.iter().map(|t| t.map(|v| v + base)));
        self.group.resize(self.triangles.len(), group);
    }

    /// A box, eight shared corners, seen from outside.
    fn add_box(&mut self, group: u32, low: DVec3, high: DVec3, turn: f64) {
        let corners: Vec<DVec3> = (0..8)
            .map(|i| {
                let pick = |bit: u32| if i >> bit & 1 == 1 { 1.0 } else { 0.0 };
                low + (high - low) * DVec3::new(pick(0), pick(1), pick(2))
            })
            .map(|p| glam::DMat3::from_rotation_y(turn) * p)
            .collect();
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles: Vec<[u32; 3]> = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        self.add(group, &corners, &triangles);
    }

    /// Part of a tube of unit radius that winds up: `steps` sides for each of `turns` turns.
    fn add_tube(&mut self, group: u32, steps: u32, turns: f64, pitch: f64, ramp: bool) {
        let count = (f64::from(steps) * turns) as u32;
        let mut corners = Vec::new();
        let mut triangles = Vec::new();
        for i in 0..=count {
            let angle = std::f64::consts::TAU * f64::from(i) / f64::from(steps);
            let (s, c) = angle.sin_cos();
            let y = pitch * angle;
            let other = if ramp { DVec3::new(0.5 * c, y, 0.5 * s) } else { DVec3::new(c, y + 1.0, s) };
            corners.extend([DVec3::new(c, y, s), other]);
            if i < count {
                let b = 2 * i;
                triangles.extend([[b, b + 1, b + 3], [b, b + 3, b + 2]]);
            }
        }
        self.add(group, &corners, &triangles);
    }

    fn add_sphere(&mut self, group: u32, rings: u32) {
        let (mut corners, mut triangles) = (Vec::new(), Vec::new());
        let sides = 2 * rings;
        for i in 0..=rings {
            for j in 0..sides {
                let (theta, phi) = (
                    std::f64::consts::PI * f64::from(i) / f64::from(rings),
                    std::f64::consts::TAU * f64::from(j) / f64::from(sides),
                );
                corners.push(DVec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin()) * 0.7);
                let (k, a, b) = ((j + 1) % sides, i * sides, (i + 1) * sides);
                if i > 0 && i < rings {
                    triangles.push([a + j, a + k, b + j]);
                }
                if i + 1 < rings {
                    triangles.push([a + k, b + k, b + j]);
                }
            }
        }
        // The poles are one vertex each.
        for t in triangles.iter_mut().flatten() {
            if *t < sides {
                *t = 0;
            } else if *t >= rings * sides {
                *t = rings * sides;
            }
        }
        self.add(group, &corners, &triangles);
    }
}

/// Walls, turned boxes, tiny boxes, a column, a winding ramp, a sphere, a triangle twice, a needle.
fn everything() -> Mesh {
    let mut mesh = Mesh::default();
    mesh.add_box(0, DVec3::ZERO, DVec3::new(5.03, 2.51, 3.77), 0.0);
    mesh.add_box(1, DVec3::ZERO, DVec3::new(0.61, 1.2, 0.9), 0.3);
    for i in 0..40 {
        let low = DVec3::new(f64::from(i) * 0.05, 1.0, 0.3);
        mesh.add_box(2 + i, low, low + DVec3::new(0.013, 0.008, 0.3), 0.1 * f64::from(i));
    }
    mesh.add_tube(50, 24, 1.0, 0.0, false);
    mesh.add_tube(51, 24, 3.0, 0.1, true);
    mesh.add_sphere(52, 12);
    mesh.add(53, &[DVec3::ZERO, DVec3::X, DVec3::Z], &[[0, 1, 2], [0, 1, 2]]);
    mesh.add(54, &[DVec3::ZERO, DVec3::X * 3.0, DVec3::new(1.0, 1e-5, 0.0)], &[[0, 1, 2]]);
    mesh.add(55, &[DVec3::ZERO, DVec3::X, DVec3::X * 2.0], &[[0, 1, 2]]);
    mesh
}

fn unwrap(input: &UnwrapInput, params: &UnwrapParams) -> Result<Atlas, LightmapError> {
    Charts::new(input, params)?.pack(params)
}

fn unwrapped(mesh: &Mesh, params: &UnwrapParams) -> Atlas {
    unwrap(&mesh.input(), params).unwrap()
}

/// Multiplicative congruential numbers in 0..1 (Park & Miller 1988).
fn numbers() -> impl FnMut() -> f64 {
    let mut state = 4711_u64;
    move || {
        state = state * 48271 % 2_147_483_647;
        state as f64 / 2_147_483_647.0
    }
}

/// The texels that a bilinear look-up reads, with their weights.
fn look_up(atlas: &Atlas, triangle: usize, u: f64, v: f64) -> [([u32; 3], f64); 4] {
    let page = atlas.triangle_page[triangle];
    let [w, h] = atlas.pages[page as usize].map(f64::from);
    let [a, b, c] = atlas.uv[triangle].map(|p| p.as_dvec2());
    let p = (a * (1.0 - u - v) + b * u + c * v) * DVec2::new(w, h) - 0.5;
    let (low, f) = (p.floor(), p - p.floor());
    let at = |dx: f64, dy: f64| [page, (low.x + dx) as u32, (low.y + dy) as u32];
    [
        (at(0.0, 0.0), (1.0 - f.x) * (1.0 - f.y)),
        (at(1.0, 0.0), f.x * (1.0 - f.y)),
        (at(0.0, 1.0), (1.0 - f.x) * f.y),
        (at(1.0, 1.0), f.x * f.y),
    ]
}

fn table(atlas: &Atlas) -> HashMap<[u32; 3], Texel> {
    let mut table = HashMap::new();
    for page in 0..atlas.pages.len() {
        for texel in atlas.texels(page) {
            let old = table.insert([page as u32, texel.x.into(), texel.y.into()], texel);
            assert!(old.is_none(), "texel listed twice: {texel:?}");
        }
    }
    table
}

fn settings() -> [UnwrapParams; 3] {
    let params = UnwrapParams::default();
    [
        params,
        UnwrapParams { texels_per_metre: 7.3, max_page: 64, padding: 0, ..params },
        UnwrapParams { texels_per_metre: 61.0, max_page: 512, padding: 4, ..params },
    ]
}

#[test]
fn every_bilinear_look_up_is_in_the_table_and_stays_in_its_chart() {
    let mesh = everything();
    for params in settings() {
        let atlas = unwrapped(&mesh, &params);
        let table = table(&atlas);
        let mut next = numbers();
        for triangle in 0..mesh.triangles.len() {
            for uv in atlas.uv[triangle] {
                assert!(uv.min_element() >= 0.0 && uv.max_element() <= 1.0, "{uv}");
            }
            for _ in 0..200 {
                let (mut u, mut v) = (next(), next());
                if u + v > 1.0 {
                    (u, v) = (1.0 - u, 1.0 - v);
                }
                for (at, weight) in look_up(&atlas, triangle, u, v) {
                    // Below 2e-3 the texture coordinate's own rounding decides what is read.
                    if weight > 2e-3 {
                        let texel = table.get(&at).unwrap_or_else(|| panic!("{triangle} reads {at:?}, {weight}"));
                        let chart = atlas.triangle_chart[texel.triangle as usize];
                        assert_eq!(chart, atlas.triangle_chart[triangle]);
                    }
                }
            }
        }
    }
}

#[test]
fn texels_lie_inside_near_their_centre_and_charts_keep_their_distance() {
    let mesh = everything();
    for params in settings() {
        let atlas = unwrapped(&mesh, &params);
        let table = table(&atlas);
        for (at, texel) in &table {
            let triangle = texel.triangle as usize;
            let [u, v] = texel.uv.as_dvec2().to_array();
            assert!(u >= 0.0 && v >= 0.0 && u + v <= 1.0 + 1e-6, "{texel:?}");
            let page = atlas.pages[at[0] as usize].map(f64::from);
            let [a, b, c] = atlas.uv[triangle].map(|p| p.as_dvec2());
            let p = (a * (1.0 - u - v) + b * u + c * v) * DVec2::from_array(page) - 0.5;
            let off = (p - DVec2::new(at[1].into(), at[2].into())).abs().max_element();
            assert!(off <= 2.0_f64.sqrt() + INSET_ALLOWANCE, "{texel:?} stands for a point {off} texels away");
            // Nobody else within the padding.
            for dy in 0..=params.padding {
                for dx in 0..=params.padding {
                    if let Some(other) = table.get(&[at[0], at[1] + dx, at[2] + dy]) {
                        let charts = [texel, other].map(|t| atlas.triangle_chart[t.triangle as usize]);
                        assert_eq!(charts[0], charts[1], "{texel:?} and {other:?}");
                    }
                }
            }
        }
    }
}

/// A point drawn in from a corner moves a little farther off the centre.
const INSET_ALLOWANCE: f64 = 0.05;

/// No point of a chart is shared by two triangles, except along their edges: texels found from the uv alone.
#[test]
fn no_two_triangles_overlap() {
    let mesh = everything();
    for params in settings() {
        let atlas = unwrapped(&mesh, &params);
        let mut owner: HashMap<[u32; 3], usize> = HashMap::new();
        // Sampling at 4 × 4 places in a texel, off the lattice that rectangles are aligned to.
        for (triangle, uv) in atlas.uv.iter().enumerate() {
            let page = atlas.pages[atlas.triangle_page[triangle] as usize].map(f64::from);
            let [a, b, c] = uv.map(|p| p.as_dvec2() * DVec2::from_array(page) * 4.0 + 0.377);
            let area = (b - a).perp_dot(c - a);
            let (low, high) = (a.min(b).min(c), a.max(b).max(c));
            for y in low.y as u32..=high.y as u32 {
                for x in low.x as u32..=high.x as u32 {
                    let p = DVec2::new(f64::from(x) + 0.123, f64::from(y) + 0.321);
                    let weights = [(b - p).perp_dot(c - p), (c - p).perp_dot(a - p), (a - p).perp_dot(b - p)];
                    if weights.iter().all(|w| w / area > 1e-2) {
                        let old = owner.insert([atlas.triangle_page[triangle], x, y], triangle);
                        assert_eq!(old, None, "{triangle} lies on another");
                    }
                }
            }
        }
        assert!(owner.len() > 1000);
    }
}

#[test]
fn planes_keep_their_lengths_and_rectangles_end_on_texel_centres() {
    // An L in one plane, cut into five triangles, somewhere askew.
    let turn = glam::DMat3::from_rotation_y(0.4) * glam::DMat3::from_rotation_x(1.1);
    let outline = [[0.0, 0.0], [3.0, 0.0], [3.0, 1.0], [1.0, 1.0], [1.0, 2.7], [0.0, 2.7], [0.0, 1.0]];
    let corners: Vec<DVec3> = outline.map(|[x, y]| turn * DVec3::new(x, y, 0.0) + DVec3::splat(7.0)).into();
    let mut mesh = Mesh::default();
    mesh.add(0, &corners, &[[0, 1, 2], [0, 2, 3], [0, 3, 6], [6, 3, 4], [6, 4, 5]]);
    mesh.add_box(1, DVec3::ZERO, DVec3::new(3.07, 2.02, 1.51), 0.7);
    let params = UnwrapParams::default();
    let atlas = unwrapped(&mesh, &params);
    assert_eq!(atlas.chart_count(), 7);
    let length = |triangle: usize, side: usize| {
        let page = DVec2::from_array(atlas.pages[0].map(f64::from));
        let [a, b] = [side, (side + 1) % 3].map(|k| atlas.uv[triangle][k].as_dvec2() * page);
        let ends = [side, (side + 1) % 3].map(|k| mesh.positions[mesh.triangles[triangle][k] as usize]);
        (a.distance(b), ends[0].distance(ends[1]) * params.texels_per_metre)
    };
    for triangle in 0..5 {
        for side in 0..3 {
            let (texels, truth) = length(triangle, side);
            assert!((texels / truth - 1.0).abs() < 1e-4, "{texels} {truth}");
        }
    }
    for triangle in 5..mesh.triangles.len() {
        for side in 0..3 {
            let (texels, truth) = length(triangle, side);
            assert!((texels - truth).abs() <= 0.75, "{texels} {truth}");
        }
        for uv in atlas.uv[triangle] {
            let p = uv.as_dvec2() * DVec2::from_array(atlas.pages[0].map(f64::from)) - 0.5;
            assert!((p - p.round()).abs().max_element() < 1e-3, "corner at {p}");
        }
    }
}

#[test]
fn round_things_get_few_charts_and_are_not_squeezed() {
    let mut mesh = Mesh::default();
    mesh.add_sphere(0, 16);
    let params = UnwrapParams { texels_per_metre: 100.0, ..UnwrapParams::default() };
    let atlas = unwrapped(&mesh, &params);
    assert!(atlas.chart_count() <= 24, "{} charts", atlas.chart_count());
    let mut column = Mesh::default();
    column.add_tube(0, 24, 1.0, 0.0, false);
    assert!(unwrapped(&column, &params).chart_count() <= 6);
    for (triangle, uv) in atlas.uv.iter().enumerate() {
        let page = DVec2::from_array(atlas.pages[0].map(f64::from));
        let [a, b, c] = uv.map(|p| p.as_dvec2() * page);
        let [x, y, z] = mesh.triangles[triangle].map(|v| mesh.positions[v as usize] * params.texels_per_metre);
        let ratio = (b - a).perp_dot(c - a).abs() / (y - x).cross(z - x).length();
        assert!((0.70..1.001).contains(&ratio), "{ratio}");
    }
}

#[test]
fn the_estimate_tells_the_count_and_the_density_for_a_budget() {
    let mesh = everything();
    let charts = Charts::new(&mesh.input(), &UnwrapParams::default()).unwrap();
    for density in [3.0, 20.0, 90.0] {
        let atlas = charts.pack(&UnwrapParams { texels_per_metre: density, ..UnwrapParams::default() }).unwrap();
        let count = (0..atlas.pages.len()).map(|page| atlas.texels(page).len()).sum::<usize>() as f64;
        let estimate = charts.texel_count(density);
        assert!(estimate >= 0.98 * count && estimate <= 1.3 * count, "{estimate} for {count}");
    }
    let density = charts.density_for(1e5).unwrap();
    assert!((charts.texel_count(density) / 1e5 - 1.0).abs() < 0.02);
    assert_eq!(charts.density_for(10.0), None);
}

#[test]
fn too_large_a_wall_gets_what_a_page_holds() {
    let mut mesh = Mesh::default();
    mesh.add_box(0, DVec3::ZERO, DVec3::new(100.0, 1.0, 2.0), 0.0);
    let atlas = unwrapped(&mesh, &UnwrapParams { max_page: 128, ..UnwrapParams::default() });
    assert_eq!(atlas.reduced, 4);
    assert!(atlas.pages.iter().flatten().all(|&side| side <= 128));
}

#[test]
fn the_same_for_any_number_of_threads() {
    let mesh = everything();
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let atlas = unwrapped(&mesh, &UnwrapParams::default());
            let texels: Vec<Texel> = (0..atlas.pages.len()).flat_map(|page| atlas.texels(page)).collect();
            (atlas, texels)
        })
    };
    assert_eq!(with(1), with(3));
}

#[test]
fn wrong_input_is_refused_and_work_can_be_stopped() {
    let mut mesh = everything();
    let dense = UnwrapParams { texels_per_metre: f64::NAN, ..UnwrapParams::default() };
    assert!(matches!(unwrap(&mesh.input(), &dense), Err(LightmapError::Parameter { .. })));
    mesh.triangles[3][1] = 1_000_000;
    assert!(matches!(unwrap(&mesh.input(), &UnwrapParams::default()), Err(LightmapError::Vertex { triangle: 3, .. })));
    mesh.positions[5].y = f64::NAN;
    mesh.triangles[3][1] = 0;
    assert!(matches!(unwrap(&mesh.input(), &UnwrapParams::default()), Err(LightmapError::Position { vertex: 5, .. })));
    mesh.group.pop();
    assert!(matches!(unwrap(&mesh.input(), &UnwrapParams::default()), Err(LightmapError::Groups { .. })));
}

/// A smooth field on a sphere and a column reads the same from both sides of every seam after the fit, and the fit
/// moves nothing far.
#[test]
fn both_sides_of_a_seam_agree() {
    let mut mesh = Mesh::default();
    mesh.add_sphere(0, 16);
    mesh.add_tube(1, 24, 1.0, 0.0, false);
    let params = UnwrapParams { texels_per_metre: 30.0, ..UnwrapParams::default() };
    let atlas = unwrapped(&mesh, &params);
    let field = |p: DVec3| 3.0 + p.x + 0.5 * p.y * p.z;
    let mut pictures = Vec::new();
    for (page, &size) in atlas.pages.iter().enumerate() {
        let texels = atlas.texels(page);
        let values: Vec<[f32; 3]> = texels
            .iter()
            .map(|texel| {
                let [a, b, c] = mesh.triangles[texel.triangle as usize].map(|v| mesh.positions[v as usize]);
                let [u, v] = texel.uv.as_dvec2().to_array();
                [field(a * (1.0 - u - v) + b * u + c * v) as f32, 1.0, 0.0]
            })
            .collect();
        pictures.push(fill(size, &texels, &values));
    }
    let before = pictures.clone();
    let seams = shared_edges(&mesh.triangles, None);
    let info = fit_seams(&atlas, &seams, &mut pictures, &SeamParams::default());

    let read = |pictures: &[Vec<[f32; 3]>], triangle: u32, side: u8, t: f64| -> f64 {
        let mut weights = [0.0; 3];
        weights[usize::from(side)] = 1.0 - t;
        weights[(usize::from(side) + 1) % 3] = t;
        look_up(&atlas, triangle as usize, weights[1], weights[2])
            .iter()
            .map(|&([page, x, y], weight)| {
                let [width, height] = atlas.pages[page as usize];
                let (x, y) = (x.min(width - 1), y.min(height - 1));
                weight * f64::from(pictures[page as usize][(y * width + x) as usize][0])
            })
            .sum()
    };
    let worst = |pictures: &[Vec<[f32; 3]>]| {
        let mut worst: f64 = 0.0;
        for seam in &seams {
            for i in 0..=10 {
                let t = f64::from(i) / 10.0;
                let a = read(pictures, seam.triangles[0], seam.sides[0], t);
                let b = read(pictures, seam.triangles[1], seam.sides[1], 1.0 - t);
                worst = worst.max((a / b - 1.0).abs());
            }
        }
        worst
    };
    let (first, last) = (worst(&before), worst(&pictures));
    assert!(first > 2e-3 && last < 1e-3, "{first} became {last}; {info:?}");
    assert!(info.after < 0.1 * info.before, "{info:?}");
    for (old, new) in before.iter().flatten().zip(pictures.iter().flatten()) {
        assert!((old[0] - new[0]).abs() < 0.15, "{old:?} {new:?}");
    }
}

/// Points of a texel may find less than nothing, their mean is never less.
#[test]
fn a_picture_is_never_below_nothing() {
    let texel = |x: u16| Texel { triangle: 0, uv: glam::Vec2::ZERO, x, y: 0 };
    let picture = fill([3, 1], &[texel(0), texel(0), texel(2)], &[[-1.0; 3], [3.0; 3], [-2.0; 3]]);
    assert_eq!(picture, [[1.0; 3], [0.5; 3], [0.0; 3]]);
}

/// A bar of shadow, a third of a texel wide and askew: with one point for each texel it falls into dashes, with the
/// means it keeps its darkness everywhere; and where light is even no point is added.
#[test]
fn thin_shadows_do_not_fall_into_dashes() {
    let mut mesh = Mesh::default();
    mesh.add(0, &[DVec3::ZERO, DVec3::X * 9.0, DVec3::new(9.0, 9.0, 0.0), DVec3::Y * 9.0], &[[0, 1, 2], [0, 2, 3]]);
    let atlas = unwrapped(&mesh, &UnwrapParams { texels_per_metre: 4.0, ..UnwrapParams::default() });
    let point = |texel: &Texel| {
        let [a, b, c] = mesh.triangles[texel.triangle as usize].map(|v| mesh.positions[v as usize]);
        let [u, v] = texel.uv.as_dvec2().to_array();
        a * (1.0 - u - v) + b * u + c * v
    };
    let bar = |p: DVec3| (p.x - 4.0 - 0.2 * (p.y - 4.5)).abs() < 1.0 / 24.0;
    let light = |texels: &[Texel]| -> Vec<[f32; 3]> {
        texels.iter().map(|texel| [if bar(point(texel)) { 0.0 } else { 1.0 }; 3]).collect()
    };
    let mut texels = atlas.texels(0);
    let mut values = light(&texels);
    let even = vec![[1.0; 3]; texels.len()];
    assert!(atlas.finer(0, (&texels, &even, &vec![false; texels.len()]), 0.1, 16).is_empty());
    // One of which something may be seen elsewhere has points all the same.
    let mut doubtful = vec![false; texels.len()];
    doubtful[7] = true;
    let more = atlas.finer(0, (&texels, &even, &doubtful), 0.1, 16);
    let is_of_it = |texel: &Texel| (texel.x, texel.y) == (texels[7].x, texels[7].y);
    assert!(more.len() > 4 && more.iter().all(is_of_it), "{more:?}");
    // Darkness in every row of texels; the bar is 4/12 of a texel wide.
    let missing = |picture: &[[f32; 3]]| -> Vec<f64> {
        let [width, height] = atlas.pages[0].map(|side| side as usize);
        let rows = (2..height - 2).map(|y| (0..width).map(|x| 1.0 - f64::from(picture[y * width + x][0])).sum());
        rows.filter(|sum: &f64| sum.is_finite()).collect()
    };
    let worst = |rows: &[f64]| rows.iter().fold(0.0_f64, |worst, sum| worst.max((sum - 0.34).abs()));
    let before = missing(&fill(atlas.pages[0], &texels, &values));
    let first = texels.len();
    for round in 0.. {
        let more = atlas.finer(0, (&texels, &values, &vec![false; texels.len()]), 0.1, 16);
        assert!(round < 5, "the bar runs through five texels of a row at most");
        if more.is_empty() {
            break;
        }
        values.extend(light(&more));
        texels.extend(more);
    }
    assert!(texels[first..].iter().all(|texel| texel.uv.min_element() >= 0.0 && texel.uv.element_sum() <= 1.0));
    let after = missing(&fill(atlas.pages[0], &texels, &values));
    assert!(worst(&before) > 0.6 && worst(&after) < 0.12, "{} became {}", worst(&before), worst(&after));
    assert!(texels.len() < 5 * first, "{} from {first}", texels.len());
}

/// Two rooms on one floor: a look-up beside the wall would read the texels behind it.
#[test]
fn charts_end_below_walls() {
    let corner = |i: u32| DVec3::new(f64::from(i / 2), f64::from(i % 2), 0.0);
    let mut mesh = Mesh::default();
    mesh.add(0, &(0..6).map(corner).collect::<Vec<_>>(), &[[0, 2, 3], [0, 3, 1], [2, 4, 5], [2, 5, 3]]);
    let names = |shift: u32| {
        mesh.triangles.iter().enumerate().map(|(t, c)| c.map(|v| v + if t < 2 { 0 } else { shift })).collect()
    };
    for (shift, expected) in [(0, 1), (6, 2)] {
        let smooth: Vec<[u32; 3]> = names(shift);
        let charts = Charts::new(&UnwrapInput { smooth: &smooth, ..mesh.input() }, &UnwrapParams::default()).unwrap();
        assert_eq!(charts.len(), expected);
    }
}

/// Around a texel are those of its chart at most two columns and two rows away that are asked about, in a square of which corners are as near as sides; of small charts there are none.
#[test]
fn around_a_texel_are_those_of_its_chart() {
    let mut mesh = Mesh::default();
    mesh.add_box(0, DVec3::ZERO, DVec3::splat(2.0), 0.0);
    mesh.add_box(1, DVec3::splat(4.0), DVec3::splat(4.02), 0.0);
    let charts = Charts::new(&mesh.input(), &UnwrapParams::default()).unwrap();
    let atlas = charts.pack(&UnwrapParams::default()).unwrap();
    let texels: Vec<Texel> = atlas.texels(0).into_iter().filter(|texel| (texel.x + texel.y) % 5 > 0).collect();
    let of_chart = |texel: &Texel| texel.triangle / 2;
    let is_near = |a: &Texel, b: &Texel| {
        a.x.abs_diff(b.x) <= 2 && a.y.abs_diff(b.y) <= 2 && of_chart(a) == of_chart(b) && a.triangle < 12
    };
    let beside = atlas.beside(0, &texels);
    for own in (0..texels.len()).step_by(7) {
        let expected: Vec<u32> = (0..texels.len())
            .filter(|other| *other != own && is_near(&texels[own], &texels[*other]))
            .map(|other| other as u32)
            .collect();
        let mut told = beside[own].to_vec();
        told.sort_unstable();
        assert_eq!(told, expected, "{own}");
    }
}

/// Halves of rays that differ by chance: what is told is their root mean square around, for large charts and for
/// many small ones, whatever lies inside solids.
#[test]
fn noise_is_told_by_texels_around() {
    let mut mesh = Mesh::default();
    mesh.add_box(0, DVec3::ZERO, DVec3::splat(2.0), 0.0);
    for i in 0..40 {
        let low = DVec3::new(4.0 + 0.1 * f64::from(i), 0.0, 0.0);
        mesh.add_box(1 + i, low, low + DVec3::splat(0.02), 0.0);
    }
    let atlas_of = |mesh: &Mesh| {
        let charts = Charts::new(&mesh.input(), &UnwrapParams::default()).unwrap();
        charts.pack(&UnwrapParams::default()).unwrap()
    };
    let atlas = atlas_of(&mesh);
    let texels = atlas.texels(0);
    let area: f64 = atlas.areas(&texels).iter().sum();
    let whole = 6.0 * (4.0 + 40.0 * 0.0004);
    assert!((area / whole - 1.0).abs() < 1e-9, "{area} of {whole}");
    // And of what is no rectangle.
    let mut corner = Mesh::default();
    corner.add(0, &[DVec3::ZERO, 3.0 * DVec3::X, 3.0 * DVec3::Y], &[[0, 1, 2]]);
    let triangle = atlas_of(&corner);
    let area: f64 = triangle.areas(&triangle.texels(0)).iter().sum();
    assert!((area / 4.5 - 1.0).abs() < 0.05, "{area}");
    let draw = |i: u32, k: u32| f64::from(unit(hash(hash(i) ^ k)));
    let normal = |i| (0..12).map(|k| draw(i, k)).sum::<f64>() - 6.0;
    let size = |texel: &Texel| if texel.triangle < 12 { 1.0 } else { 8.0 };
    let halves: Vec<f32> = (0..)
        .zip(&texels)
        .map(|(i, texel)| if i % 10 == 3 { f32::NAN } else { (size(texel) * normal(i)) as f32 })
        .collect();
    let told = atlas.evened(0, &texels, &halves);
    let (mut worst, mut count) = ([0f64; 2], [0; 2]);
    for ((texel, half), told) in texels.iter().zip(&halves).zip(&told) {
        assert_eq!(half.is_finite(), told.is_finite());
        if half.is_finite() {
            let kind = usize::from(texel.triangle >= 12);
            worst[kind] = worst[kind].max((f64::from(*told) / size(texel)).ln().abs());
            count[kind] += 1;
        }
    }
    // Eight deviates in a corner tell it to a quarter, and a factor of two and a half is beyond what chance makes of them.
    assert!(count[0] > 8000 && count[1] > 200, "{count:?}");
    assert!(worst.iter().all(|worst| *worst < 2.5f64.ln()), "{worst:?}");
}
