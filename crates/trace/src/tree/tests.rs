use super::*;
use crate::{blocked_brute, closest_brute, closest_where_brute};

/// SplitMix64: small, and the same numbers everywhere.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 40) as f32 / (1u64 << 24) as f32
    }

    fn point(&mut self) -> Vec3 {
        Vec3::new(self.next(), self.next(), self.next()) * 2.0 - 1.0
    }

    fn direction(&mut self) -> Vec3 {
        loop {
            let p = self.point();
            if p.length() > 0.1 && p.length() <= 1.0 {
                return p.normalize();
            }
        }
    }

    /// A whole number below `n`.
    fn below(&mut self, n: usize) -> usize {
        ((self.next() * n as f32) as usize).min(n - 1)
    }
}

fn ray(origin: Vec3, direction: Vec3) -> Ray {
    Ray { origin, direction, t_max: f32::INFINITY, skip: u32::MAX }
}

/// The same tree with and without SIMD.
fn both(triangles: &[[Vec3; 3]]) -> [Tree; 2] {
    let tree = Tree::new(triangles);
    assert_eq!(tree.validate(triangles), Ok(()));
    [Tree { simd: false, ..tree.clone() }, tree]
}

/// Every tracer's answers to a ray, and to the same ray cut off at the hit, must be those of trying every triangle.
fn agree(trees: &[Tree; 2], triangles: &[[Vec3; 3]], ray: &Ray) {
    let bits = |hit: Option<Hit>| hit.map(|h| (h.t.to_bits(), h.triangle, h.u.to_bits(), h.v.to_bits(), h.back));
    let expected = closest_brute(triangles, ray);
    let odd = |triangle: u32, u: f32, _: f32, back: bool| (triangle + u32::from(back)) % 3 == 1 || u > 0.5;
    let expected_odd = closest_where_brute(triangles, ray, odd);
    for tree in trees {
        assert_eq!(bits(tree.closest(ray)), bits(expected), "{ray:?}, simd {}", tree.simd);
        assert_eq!(bits(tree.closest_where(ray, odd)), bits(expected_odd), "{ray:?}, simd {}", tree.simd);
        assert_eq!(tree.blocked(ray), expected.is_some(), "{ray:?}, simd {}", tree.simd);
        assert_eq!(tree.blocked_where(ray, odd), expected_odd.is_some(), "{ray:?}, simd {}", tree.simd);
        if let Some(hit) = expected {
            for t_max in [hit.t, hit.t.next_up()] {
                let short = Ray { t_max, ..*ray };
                assert_eq!(tree.blocked(&short), blocked_brute(triangles, &short), "{short:?}, simd {}", tree.simd);
                assert_eq!(bits(tree.closest(&short)), bits(closest_brute(triangles, &short)), "{short:?}");
            }
            let passing = Ray { skip: hit.triangle, ..*ray };
            assert_eq!(bits(tree.closest(&passing)), bits(closest_brute(triangles, &passing)), "{passing:?}");
        }
    }
}

#[test]
fn every_triangle_is_in_the_leaves_and_every_box_contains_what_is_below() {
    let mut random = Random(1);
    let one = [Vec3::ZERO, Vec3::X, Vec3::Y];
    let mut inputs: Vec<Vec<[Vec3; 3]>> = vec![
        vec![],
        vec![one],
        vec![one; 2],
        vec![one; 1000],
        // centres on a line, and at one point
        (0..777).map(|i| one.map(|c| c + Vec3::X * i as f32)).collect(),
        (1..500).map(|i| [Vec3::X, Vec3::Y, -Vec3::X - Vec3::Y].map(|c| c * i as f32)).collect(),
        // each ten times as far as the one before, then as many at one end as splits by area would peel off one by one
        (0..60).map(|i| one.map(|c| c * 10f32.powi(i - 30))).collect(),
        (0..4000).map(|i| one.map(|c| c * 1.01f32.powi(i - 2000))).collect(),
        // points and needles
        (0..100).map(|i| [Vec3::splat(i as f32); 3]).collect(),
        vec![[Vec3::ZERO, Vec3::X * f32::MAX, Vec3::NEG_X * f32::MAX], one, [Vec3::NAN; 3], one],
        vec![[Vec3::INFINITY, Vec3::ZERO, Vec3::X]],
        (0..100).map(|_| [random.point() * 1e30, random.point() * 1e38, random.point()]).collect(),
    ];
    for n in [3, 4, 5, 8, 9, 31, 33, 100, 1000, 20_000] {
        inputs.push((0..n).map(|_| random.point()).map(|p| one.map(|c| p + c * 0.1)).collect());
    }
    inputs.push(needles(2000, 21));
    // all in one place, so that each plane cuts all
    inputs.push((0..1000).map(|i| [Vec3::ZERO, Vec3::ONE, Vec3::ONE + 1e-3 * Vec3::X * i as f32]).collect());
    for triangles in &inputs {
        let tree = Tree::new(triangles);
        assert_eq!(tree.validate(triangles), Ok(()), "{} triangles", triangles.len());
        assert_eq!((tree.len(), tree.is_empty()), (triangles.len(), triangles.is_empty()));
        for _ in 0..20 {
            // Only that nothing panics: many of these coordinates are beyond what rays reach.
            tree.closest(&ray(random.point(), random.direction()));
        }
    }
}

/// Small triangles and, one in ten, long thin ones in all directions.
fn needles(n: usize, seed: u64) -> Vec<[Vec3; 3]> {
    let mut random = Random(seed);
    let triangle = |i: usize| {
        let (from, to) = (random.point(), random.point());
        if i.is_multiple_of(10) {
            [from, to, to + 0.003 * random.point()]
        } else {
            [from, from + 0.03 * to, from + 0.03 * random.point()]
        }
    };
    (0..n).map(triangle).collect()
}

/// The boxes of leaves get smaller by cutting, and what is hit stays the same.
#[test]
fn long_triangles_are_in_several_leaves_and_give_what_every_triangle_gives() {
    let triangles = needles(2000, 18);
    let trees = both(&triangles);
    let places = |tree: &Tree| tree.blocks.iter().flat_map(|block| block.triangle).filter(|t| *t != u32::MAX).count();
    let count = places(&trees[0]);
    assert!((2100..=2400).contains(&count), "{count} places for 2000 triangles");
    let mut random = Random(19);
    for i in 0..3000 {
        let [a, b, c] = triangles[random.below(200) * 10];
        // Anywhere along a long one, on an edge every other time.
        let s = random.next();
        let target = a + s * if i % 2 == 0 { b - a } else { 0.5 * (b + c) - a };
        let origin = 1.5 * random.point();
        agree(&trees, &triangles, &ray(origin, (target - origin).normalize()));
    }

    // Along the axes through a grid, whose planes are those of the boxes; and without a part nothing is right.
    let mut triangles = grid(5);
    triangles.extend(needles(1000, 20).iter().map(|needle| needle.map(|p| ((p + 1.0) * 10.0).round() * 0.25)));
    let trees = both(&triangles);
    assert!(places(&trees[0]) > triangles.len());
    for i in 0..3000 {
        let origin = (random.point() * 20.0).round() * 0.125 + 2.5;
        let direction = if i % 2 == 0 { Vec3::AXES[i / 2 % 3] } else { random.direction() };
        agree(&trees, &triangles, &ray(origin, direction));
    }
}

#[test]
fn validation_sees_what_is_wrong() {
    let triangles: Vec<_> = (0..100).map(|i| [Vec3::ZERO, Vec3::X, Vec3::Y].map(|c| c + i as f32)).collect();
    let good = Tree::new(&triangles);
    assert_eq!(good.validate(&triangles), Ok(()));
    let mut tree = good.clone();
    tree.nodes[0].bounds[3] = [50.0; WIDTH];
    assert!(matches!(tree.validate(&triangles), Err(Flaw::Box(_))));
    let mut tree = good.clone();
    tree.blocks[3].triangle[0] = tree.blocks[4].triangle[0];
    assert!(matches!(tree.validate(&triangles), Err(Flaw::Triangle(_))));
    let mut tree = good.clone();
    tree.blocks.pop();
    assert!(matches!(tree.validate(&triangles), Err(Flaw::Block(_))));
    let mut tree = good.clone();
    tree.nodes.push(Node::EMPTY);
    assert!(matches!(tree.validate(&triangles), Err(Flaw::Node(_))));
    let mut moved = triangles.clone();
    moved[7][0] += 0.01;
    assert_eq!(good.validate(&moved), Err(Flaw::Triangle(7)));

    // One part of a triangle missing.
    let triangles = needles(1000, 23);
    let mut tree = Tree::new(&triangles);
    assert_eq!(tree.validate(&triangles), Ok(()));
    let mut seen = vec![false; triangles.len()];
    let mut places = (0..tree.blocks.len()).flat_map(|block| (0..LANES).map(move |lane| (block, lane)));
    let again = |&(block, lane): &(usize, usize)| {
        let triangle = tree.blocks[block].triangle[lane];
        triangle != u32::MAX && std::mem::replace(&mut seen[triangle as usize], true)
    };
    let (block, lane) = places.find(again).expect("a triangle in two leaves");
    tree.blocks[block].set(lane, u32::MAX, &[Vec3::NAN; 3]);
    assert!(matches!(tree.validate(&triangles), Err(Flaw::Box(_))));
}

#[test]
fn the_tree_is_the_same_for_any_number_of_threads() {
    let mut random = Random(2);
    let mut small = || {
        let p = random.point();
        [p, p + random.point() * 0.02, p + random.point() * 0.02]
    };
    let mut triangles: Vec<_> = (0..30_000).map(|_| small()).collect();
    triangles.extend(needles(10_000, 22));
    let [one, four] = [1, 4].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| Tree::new(&triangles))
    });
    assert_eq!(format!("{:?}{:?}", one.nodes, one.blocks), format!("{:?}{:?}", four.nodes, four.blocks));
}

#[test]
fn soups_of_all_sizes_give_what_every_triangle_gives() {
    let mut random = Random(3);
    // number, size of a triangle, scale of all, offset of all
    for (n, size, scale, offset) in [
        (1, 1.0, 1.0, 0.0),
        (5, 1.0, 1.0, 0.0),
        (300, 0.3, 1.0, 0.0),
        (300, 2.0, 1e-6, 0.0),
        (300, 0.1, 1e6, 0.0),
        (300, 0.3, 1.0, 1e3),
        (300, 0.5, 10.0, -1e6),
        (3000, 0.02, 1.0, 0.0),
    ] {
        let place = |p: Vec3, r: Vec3| (p + r * size) * scale + offset;
        let triangles: Vec<_> = (0..n)
            .map(|_| {
                let p = random.point();
                [place(p, random.point()), place(p, random.point()), place(p, random.point())]
            })
            .collect();
        let trees = both(&triangles);
        for i in 0..if n > 1000 { 200 } else { 1000 } {
            let origin = place(random.point() * if i % 2 == 0 { 1.0 } else { 3.0 }, Vec3::ZERO);
            let [a, b, c] = triangles[random.below(n)];
            let target = match i % 3 {
                0 => a,
                1 => a + (b - a) * random.next(),
                _ => (a + b + c) / 3.0,
            };
            agree(&trees, &triangles, &ray(origin, (target - origin).normalize()));
            agree(&trees, &triangles, &ray(origin, random.direction()));
        }
    }
}

/// Unit squares on the planes of a whole-number grid, each twice, with opposite fronts and other diagonals.
fn grid(n: usize) -> Vec<[Vec3; 3]> {
    let mut triangles = Vec::new();
    for axis in 0..3 {
        let (u, v) = (Vec3::AXES[(axis + 1) % 3], Vec3::AXES[(axis + 2) % 3]);
        for i in 0..n * n * n {
            let (x, y, z) = (i % n, i / n % n, i / n / n);
            if (x + 2 * y + z) % 3 == 0 {
                let p = Vec3::new(x as f32, y as f32, z as f32);
                triangles.extend([[p, p + u, p + u + v], [p, p + u + v, p + v]]);
                triangles.extend([[p, p + v, p + u], [p + u, p + v, p + u + v]]);
            }
        }
    }
    triangles
}

#[test]
fn coincident_faces_on_the_axes_give_what_every_triangle_gives() {
    let triangles = grid(4);
    let trees = both(&triangles);
    let mut random = Random(4);
    for i in 0..3000 {
        // Origins on quarters of the grid, so that many start in a plane, an edge or a vertex.
        let origin = (random.point() * 16.0).round() * 0.25 + 2.0;
        let direction = match i % 4 {
            0 => Vec3::AXES[i / 4 % 3],
            1 => -Vec3::AXES[i / 4 % 3],
            // one component exactly zero, of either sign
            2 => (random.direction() * Vec3::new(1.0, 1.0, if i % 8 < 4 { 0.0 } else { -0.0 })).normalize(),
            _ => ((random.point() * 4.0).round() + Vec3::new(0.0, 0.0, 0.5)).normalize(),
        };
        agree(&trees, &triangles, &ray(origin, direction));
    }
}

/// A triangle's box ends where the triangle does: what rounding makes of a ray that meets it there is met in the tree, too, from near and from far, along
/// the triangle and across it.
#[test]
fn edges_of_boxes_give_what_every_triangle_gives() {
    let mut random = Random(24);
    let mut met = 0;
    for i in 0..100_000 {
        let place = [0.0, 0.0, 1.0, 300.0][i % 4] * random.point();
        let size = 0.1 + random.next();
        let mut corners = [(); 3].map(|()| place + size * random.point());
        // Two thirds are flat along an axis, which the ray is nearly level with every other time.
        let axis = random.below(3);
        if i % 3 > 0 {
            corners.iter_mut().for_each(|corner| corner[axis] = place[axis]);
        }
        if i % 7 > 3 {
            // Near zero a unit in the last place is nothing.
            corners = corners.map(|corner| corner - corners[0]);
        }
        let [a, b, c] = corners;
        let target = match i % 5 {
            0 => a,
            1 | 2 => a + (b - a) * random.next(),
            _ => a + (b - a) * random.next() + (c - a) * random.next() * 1e-6,
        };
        let mut direction = random.direction();
        if i % 2 == 0 {
            direction[axis] *= 10f32.powf(-3.0 * random.next());
        }
        let origin = target - direction * 10f32.powf(12.0 * random.next() - 8.0);
        let direction = (target - origin).normalize();
        if direction.is_finite() {
            let ray = ray(origin, direction);
            met += usize::from(closest_brute(&[corners], &ray).is_some());
            agree(&both(&[corners]), &[corners], &ray);
        }
    }
    assert!(met > 30_000, "only {met} hits");
}

#[test]
fn of_two_equal_hits_the_lower_index_counts() {
    let corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
    let far = corners.map(|c| c - Vec3::Z);
    let mut triangles = vec![far; 50];
    triangles.extend([corners; 50]);
    for tree in both(&triangles) {
        let down = ray(Vec3::new(0.2, 0.3, 1.0), -Vec3::Z);
        assert_eq!(tree.closest(&down).map(|h| h.triangle), Some(50));
        assert_eq!(tree.closest(&Ray { skip: 50, ..down }).map(|h| h.triangle), Some(51));
        assert_eq!(tree.closest_where(&down, |t, _, _, _| t > 60).map(|h| h.triangle), Some(61));
    }
}

#[test]
fn a_wall_without_thickness_shows_its_front() {
    let mut random = Random(5);
    let mut nearer_backs = 0;
    for _ in 0..300 {
        // A tilted square with a triangle fan towards each side, made around different points.
        let (p, u, v) = (random.point() * 3.0, random.direction(), random.direction());
        let corner = |i: usize| p + [-u - v, u - v, u + v, v - u][i % 4];
        let fan = |middle: Vec3, turned: bool| {
            let side =
                move |i| if turned { [middle, corner(i + 1), corner(i)] } else { [middle, corner(i), corner(i + 1)] };
            (0..4).map(side)
        };
        let triangles: Vec<_> = fan(p + 0.1 * u, false).chain(fan(p - 0.2 * v, true)).collect();
        let trees = both(&triangles);
        for _ in 0..100 {
            let target = p + u * (random.next() * 1.8 - 0.9) + v * (random.next() * 1.8 - 0.9);
            let origin = target + random.direction() * 0.5;
            let ray = ray(origin, (target - origin).normalize());
            let slope = u.cross(v).dot(ray.direction).abs();
            // Seen edge on the two faces are further apart along the ray than any tie may be.
            if slope > 0.3 {
                let [a, b] = [&trees[0], &trees[1]].map(|tree| tree.closest(&ray).expect("aimed at the wall"));
                assert!(!a.back, "{ray:?} {a:?}");
                assert_eq!(a, b);
                let other = Ray { skip: a.triangle, ..ray };
                nearer_backs += usize::from(trees[0].closest(&other).is_some_and(|hit| hit.back && hit.t < a.t));
            }
        }
    }
    assert!(nearer_backs > 1000, "only {nearer_backs} backs were nearer: the rule was not put to the test");
}

/// An icosahedron, its faces split `levels` times, on the unit sphere.
fn icosphere(levels: usize) -> Vec<[Vec3; 3]> {
    let g = (1.0 + 5f32.sqrt()) / 2.0;
    let mut triangles = Vec::new();
    // All faces join three of the twelve vertices (0, ±1, ±g) and their rotations that lie 2 apart.
    let vertices: Vec<Vec3> = (0..12)
        .map(|i| {
            let (a, b) = (if i % 2 == 0 { 1.0 } else { -1.0 }, if i / 2 % 2 == 0 { g } else { -g });
            [Vec3::new(0.0, a, b), Vec3::new(a, b, 0.0), Vec3::new(b, 0.0, a)][i / 4]
        })
        .collect();
    let near = |a: Vec3, b: Vec3| (a.distance(b) - 2.0).abs() < 0.1;
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                let [a, b, c] = [vertices[a], vertices[b], vertices[c]];
                if near(a, b) && near(b, c) && near(c, a) {
                    triangles.push([a, b, c].map(Vec3::normalize));
                }
            }
        }
    }
    assert_eq!(triangles.len(), 20);
    for _ in 0..levels {
        triangles = triangles
            .iter()
            .flat_map(|&[a, b, c]| {
                // In a fixed order, so that both faces of an edge find the same middle.
                let [ab, bc, ca] = [(a + b).normalize(), (b + c).normalize(), (c + a).normalize()];
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            })
            .collect();
    }
    triangles
}

/// Two points joined to a ring of `n`: slivers as thin as you like.
fn spindle(n: usize) -> Vec<[Vec3; 3]> {
    let ring = |i: usize| {
        let angle = (i % n) as f32 / n as f32 * std::f32::consts::TAU;
        Vec3::new(angle.cos(), angle.sin(), 0.0)
    };
    let tip = Vec3::new(0.1, 0.05, 1.0);
    (0..n).flat_map(|i| [[tip, ring(i), ring(i + 1)], [-tip, ring(i + 1), ring(i)]]).collect()
}

/// A cube from -1 to 1 whose sides are divided into n × n squares.
fn cube(n: usize) -> Vec<[Vec3; 3]> {
    let mut triangles = Vec::new();
    let at = |i: usize| i as f32 / n as f32 * 2.0 - 1.0;
    for side in 0..6 {
        let place = |u: usize, v: usize| {
            let mut p = Vec3::ZERO;
            p[side % 3] = if side < 3 { -1.0 } else { 1.0 };
            p[(side + 1) % 3] = at(u);
            p[(side + 2) % 3] = at(v);
            p
        };
        for i in 0..n * n {
            let (u, v) = (i % n, i / n);
            let [a, b, c, d] = [place(u, v), place(u + 1, v), place(u + 1, v + 1), place(u, v + 1)];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    triangles
}

#[test]
fn nothing_escapes_from_closed_meshes_through_edges_or_vertices() {
    let needle = |scale: Vec3| cube(3).into_iter().map(move |t| t.map(|c| c * scale)).collect::<Vec<_>>();
    let meshes = [
        ("icosphere", icosphere(4)),
        ("cube", cube(8)),
        ("spindle", spindle(1000)),
        ("needle", needle(Vec3::new(1e-4, 1.0, 1e-3))),
    ];
    let moved = [
        (1.0, Vec3::ZERO),
        (1e-12, Vec3::ZERO),
        (1e6, Vec3::ZERO),
        (1.0, Vec3::new(100.0, -30.0, 7.0)),
        (1e4, Vec3::new(1e6, 1e6, -1e6)),
    ];
    let cases: Vec<_> = meshes.iter().flat_map(|mesh| moved.map(|moved| (mesh, moved))).collect();
    let escapes = cases.par_iter().enumerate().flat_map_iter(|(case, &((name, mesh), (scale, offset)))| {
        let mut random = Random(6 + case as u64);
        let triangles: Vec<_> = mesh.iter().map(|t| t.map(|c| c * scale + offset)).collect();
        let trees = both(&triangles);
        let mut escapes = Vec::new();
        for i in 0..20_000 {
            // From the middle, and from where no axis is special.
            let origin = offset + if i % 2 == 0 { Vec3::ZERO } else { random.point() * 0.00003 * scale };
            let mut corners = triangles[random.below(triangles.len())];
            corners.rotate_left(i / 5 % 3);
            let [a, b, c] = corners;
            let target = match i % 5 {
                0 | 1 => a,
                2 | 3 => a + (b - a) * random.next(),
                _ => (a + b + c) / 3.0,
            };
            let direction = (target - origin).as_dvec3().normalize().as_vec3();
            let ray = ray(origin, direction);
            for tree in &trees {
                if tree.closest(&ray).is_none() || !tree.blocked(&ray) {
                    escapes.push((*name, scale, offset, tree.simd));
                }
            }
        }
        escapes
    });
    let escapes: Vec<_> = escapes.collect();
    assert!(escapes.is_empty(), "{} escaped, first {:?}", escapes.len(), escapes[0]);
}

#[test]
fn wild_rays_hit_nothing_and_do_not_panic() {
    let trees = both(&cube(4));
    let wild = [0.0, -0.0, 1.0, f32::MIN_POSITIVE, 1e-45, f32::MAX, f32::INFINITY, f32::NEG_INFINITY, f32::NAN];
    let mut random = Random(7);
    for _ in 0..20_000 {
        let mut pick = || Vec3::from_array(std::array::from_fn(|_| wild[random.below(wild.len())]));
        let (origin, direction) = (pick(), pick());
        let ray = Ray { origin, direction, t_max: pick().x, skip: 3 };
        let [a, b] = [&trees[0], &trees[1]].map(|tree| (tree.closest(&ray), tree.blocked(&ray)));
        assert_eq!(a, b, "{ray:?}");
        if !(origin.is_finite() && direction.is_finite() && ray.t_max > 0.0) {
            assert_eq!(a, (None, false), "{ray:?}");
        }
    }
}

#[test]
fn batches_give_what_single_rays_give() {
    let triangles = icosphere(2);
    let tree = Tree::new(&triangles);
    let mut random = Random(8);
    let rays: Vec<Ray> = (0..1000).map(|_| ray(random.point(), random.direction())).collect();
    let (mut hits, mut blocked) = (vec![None; rays.len()], vec![false; rays.len()]);
    tree.closest_batch(&rays, &mut hits);
    tree.blocked_batch(&rays, &mut blocked);
    for (i, ray) in rays.iter().enumerate() {
        assert_eq!((hits[i], blocked[i]), (tree.closest(ray), hits[i].is_some()));
    }
    assert!(hits.iter().flatten().count() > 300, "too few hits to mean anything");
}

/// What is taken out is met no more, whatever is beside it; all else is met as before.
#[test]
fn what_is_taken_out_is_not_met() {
    let mut random = Random(17);
    let triangles: Vec<[Vec3; 3]> = (0..600)
        .map(|_| {
            let middle = random.point();
            [(); 3].map(|()| middle + 0.2 * random.point())
        })
        .collect();
    let mut trees = both(&triangles);
    let mut left = triangles.clone();
    for out in [100..180, 0..1, 590..600, 120..130] {
        let corners = triangles[out.clone()].iter().flatten();
        let around = corners.fold([Vec3::INFINITY, Vec3::NEG_INFINITY], |[lo, hi], p| [lo.min(*p), hi.max(*p)]);
        for tree in &mut trees {
            tree.take_out(out.start as u32..out.end as u32, around);
        }
        left[out].fill([Vec3::NAN; 3]);
        assert_eq!(trees[0].validate(&left), Ok(()));
        for _ in 0..500 {
            agree(&trees, &left, &ray(random.point(), random.direction()));
        }
    }
}
