//! Automatic regions (catalogue 93): office buildings against the partition by hand, the laws that localization needs,
//! and input that makes no rooms.

use crate::building::{Building, Plan};
use crate::rooms::{add_cut, box_of, room_with_block};
use glam::{DQuat, DVec3};
use radiosity_scene::{Enclosure, Facet};
use radiosity_trace::sampling::Random;
use radiosity_trace::{Ray, Tree};
use radiosity_transport::{RegionOptions, Regions, regions};

/// Thickness of walls, m: solid ones and sheets.
const WALLS: [f64; 2] = [0.2, 0.0];

fn find(enclosure: &Enclosure) -> Regions {
    regions(enclosure, &RegionOptions::default())
}

/// The whole of an enclosure, turned about an axis that is none of its own.
fn turned(enclosure: &Enclosure) -> Enclosure {
    let turn = DQuat::from_axis_angle(DVec3::new(0.3, -0.5, 0.8).normalize(), 0.7);
    let place = |facet: &Facet| Facet::new(facet.corners().iter().map(|c| turn * *c).collect()).unwrap();
    let mut turned = enclosure.clone();
    turned.facets.iter_mut().for_each(|facet| *facet = place(facet));
    turned
}

/// Two rooms of 3 × 3 × 3 m with a sheet between them that leaves a door open; floor, ceiling and long walls go
/// through, in strips that the sheet does not follow.
fn two_rooms() -> Enclosure {
    let mut two = box_of(DVec3::new(6.0, 3.0, 3.0), 5);
    let [y, z] = [DVec3::Y, DVec3::Z];
    for [from, along, up] in
        [[DVec3::X * 3.0, y, z * 3.0], [DVec3::X * 3.0 + y * 2.0, y, z * 3.0], [DVec3::X * 3.0 + y + z * 2.0, y, z]]
    {
        add_cut(&mut two, 2, [from, along, up]);
        add_cut(&mut two, 2, [from, up, along]);
    }
    two
}

/// Catalogue 93: without help Σ(p + q)² is within 20 % of the partition by hand: room by room, with boundaries in the
/// doors.
#[test]
fn catalogue_93_twenty_rooms_as_by_hand() {
    for thickness in WALLS {
        for (rooms, places) in [(1, 1), (4, 5), (20, 22), (100, 105)] {
            let building = Building::new(Plan::of_rooms(rooms, thickness, 0.7));
            let found = find(&building.enclosure);
            let ratio = found.cost() / building.cost_by_hand();
            assert!((0.8..=1.2).contains(&ratio), "{rooms} rooms, walls of {thickness} m: {ratio}");
            assert_eq!(found.len(), places, "{rooms} rooms, walls of {thickness} m");
            if rooms == 20 {
                let q: usize = found.sizes.iter().map(|size| size.patches).sum();
                assert_eq!(q, 2 * found.patches.len());
                let room = |i: usize| building.room_of[found.facet_of[i] as usize];
                let mut of_room = vec![None; places];
                for (i, region) in found.region_of.iter().enumerate() {
                    // What is in the thickness of a wall may be either side's; all else is its room's.
                    let [low, high] = building.rooms[room(i) as usize];
                    let at = found.pieces[i].centroid();
                    if at.clamp(low, high).distance(at) < 1e-9 {
                        assert_eq!(*of_room[room(i) as usize].get_or_insert(*region), *region, "{at}");
                    }
                }
            }
        }
    }
}

/// Catalogue 93: a building that stands askew is parted alike, with planes of any direction.
#[test]
fn catalogue_93_no_axis_is_preferred() {
    for thickness in WALLS {
        let building = Building::new(Plan::of_rooms(20, thickness, 0.7));
        let found = find(&turned(&building.enclosure));
        assert_eq!(found.len(), 22, "walls of {thickness} m");
        let ratio = found.cost() / building.cost_by_hand();
        assert!((0.8..=1.2).contains(&ratio), "walls of {thickness} m: {ratio}");
    }
}

/// The pieces of each facet cover it, and each has a region.
fn assert_each_point_in_one_region(enclosure: &Enclosure, found: &Regions) {
    let mut areas = vec![0.0; enclosure.facets.len()];
    for (i, piece) in found.pieces.iter().enumerate() {
        let facet = &enclosure.facets[found.facet_of[i] as usize];
        areas[found.facet_of[i] as usize] += piece.area();
        assert!(piece.normal().distance(facet.normal()) < 1e-6);
        assert!((found.region_of[i] as usize) < found.len());
    }
    for (facet, area) in enclosure.facets.iter().zip(areas) {
        assert!((area - facet.area()).abs() <= 1e-9 * facet.area(), "{area} of {}", facet.area());
    }
    let elements: usize = found.sizes.iter().map(|size| size.elements).sum();
    assert_eq!(elements, found.pieces.len());
}

/// Catalogue 93: pieces of facets cover these once, and only those are cut that a boundary goes through.
#[test]
fn catalogue_93_each_point_is_in_one_region() {
    let building = Building::new(Plan::of_rooms(20, 0.2, 0.7)).enclosure;
    let found = find(&building);
    assert_each_point_in_one_region(&building, &found);
    assert_eq!(found.pieces.len(), building.facets.len(), "walls are where facets end");
    let two = two_rooms();
    let found = find(&two);
    assert_each_point_in_one_region(&two, &found);
    assert_eq!((found.len(), found.pieces.len()), (2, two.facets.len() + 4 * 5), "the middle strips are cut");
}

/// The regions that a line of sight goes through by the patches it crosses, from the region `from`; `None` if the
/// patches make no way.
fn way(found: &Regions, from: u32, [a, b]: [DVec3; 2]) -> Option<u32> {
    let mut crossed: Vec<(f64, usize)> = Vec::new();
    for (k, patch) in found.patches.iter().enumerate() {
        let [at, to] = [a, b].map(|p| patch.height(p));
        if at * to < 0.0 {
            let t = at / (at - to);
            let point = a + t * (b - a);
            if patch.edges().all(|[c, d]| (d - c).cross(point - c).dot(patch.normal()) >= 0.0) {
                crossed.push((t, k));
            }
        }
    }
    crossed.sort_by(|x, y| x.0.total_cmp(&y.0));
    crossed.into_iter().try_fold(from, |region, (_, k)| {
        let [one, other] = found.sides[k];
        let forward = found.patches[k].normal().dot(b - a) > 0.0;
        let (leaves, enters) = if forward { (one, other) } else { (other, one) };
        (leaves == region).then_some(enters)
    })
}

/// Catalogue 93: points that see each other do so through patches that lead from the region of one to that of the
/// other, in every enclosure here. A line may miss within 1e-6 m of a patch's rim: one in a million.
#[test]
fn catalogue_93_sight_lines_cross_boundary_patches() {
    let building = |thickness| Building::new(Plan::of_rooms(20, thickness, 0.7)).enclosure;
    for (name, enclosure) in [
        ("solid walls", building(0.2)),
        ("sheets", building(0.0)),
        ("askew", turned(&building(0.2))),
        ("two rooms", two_rooms()),
    ] {
        let found = find(&enclosure);
        let triangles: Vec<_> = enclosure.facets.iter().flat_map(Facet::triangles).collect();
        let tree = Tree::new(&triangles.iter().map(|t| t.map(|c| c.as_vec3())).collect::<Vec<_>>());
        let mut random = Random::new(93);
        let mut pick = || {
            let i = (random.next_unit() * found.pieces.len() as f64) as usize;
            let piece = &found.pieces[i];
            let corners = piece.corners();
            let (u, v) = (random.next_unit(), random.next_unit());
            let near = corners[0].lerp(corners[1], 0.02 + 0.96 * u);
            let far = corners[corners.len() - 1].lerp(corners[2], 0.02 + 0.96 * u);
            (found.region_of[i], near.lerp(far, 0.02 + 0.96 * v) + 1e-4 * piece.normal(), piece.normal())
        };
        let mut through = 0;
        for _ in 0..300_000 {
            let ((from, a, na), (to, b, nb)) = (pick(), pick());
            let direction = (b - a).normalize();
            if na.dot(direction) < 0.01 || nb.dot(direction) > -0.01 {
                continue;
            }
            let (t_max, skip) = (a.distance(b) as f32, u32::MAX);
            if !tree.blocked(&Ray { origin: a.as_vec3(), direction: direction.as_vec3(), t_max, skip }) {
                assert_eq!(way(&found, from, [a, b]), Some(to), "{name}: from {a} in {from} to {b} in {to}");
                through += usize::from(from != to);
            }
        }
        assert!(through > 200, "{name}: {through} lines between regions are a test of nothing");
    }
}

/// Catalogue 93: a region with its boundary patches is closed where the whole is: Σ A n = 0, within what rims lack.
#[test]
fn catalogue_93_regions_are_closed() {
    for enclosure in [Building::new(Plan::of_rooms(20, 0.2, 0.7)).enclosure, two_rooms()] {
        let found = find(&enclosure);
        for region in 0..found.len() as u32 {
            let local = found.local(&enclosure, region);
            let size = found.sizes[region as usize];
            assert_eq!(local.facets.len(), size.elements + size.patches);
            let sum: DVec3 = local.facets.iter().map(|facet| facet.area() * facet.normal()).sum();
            let whole: f64 = local.facets.iter().map(Facet::area).sum();
            assert!(sum.length() < 1e-6 * whole, "region {region}: {sum} of {whole}");
        }
    }
}

/// Catalogue 93: a convex room is one region, and so is one with a block in it, which is no wall.
#[test]
fn catalogue_93_one_room_is_one_region() {
    for k in [1, 4, 12] {
        for room in [box_of(DVec3::new(5.0, 4.0, 3.0), k), room_with_block(k)] {
            let found = find(&room);
            assert_eq!((found.len(), found.patches.len()), (1, 0));
            assert_eq!(found.pieces, room.facets);
        }
    }
}

/// Catalogue 93: what makes no rooms makes regions all the same: nothing, a sheet, one sheet many times, and triangles
/// that go through each other.
#[test]
fn catalogue_93_any_facets_have_regions() {
    assert!(find(&Enclosure::default()).is_empty());
    let mut sheet = Enclosure::default();
    add_cut(&mut sheet, 1, [DVec3::ZERO, DVec3::X, DVec3::Y]);
    assert_eq!(find(&sheet).len(), 1);
    for _ in 0..20 {
        add_cut(&mut sheet, 3, [DVec3::ZERO, DVec3::X, DVec3::Y]);
        add_cut(&mut sheet, 2, [DVec3::ZERO, DVec3::Y, DVec3::X]);
    }
    assert_each_point_in_one_region(&sheet, &find(&sheet));
    let mut random = Random::new(1);
    // Small triangles apart in the open see each other: none is parted from the others without patches.
    let mut sparse = Enclosure::default();
    for _ in 0..500 {
        let mut point = || DVec3::new(random.next_unit(), random.next_unit(), random.next_unit());
        let (at, u, v) = (point(), 0.05 * point(), 0.05 * point());
        sparse.add("", Facet::new(vec![at, at + u, at + v]).unwrap());
    }
    let found = find(&sparse);
    assert_each_point_in_one_region(&sparse, &found);
    assert!(found.len() == 1 || found.sizes.iter().all(|size| size.patches > 0), "{:?}", found.sizes);
    for size in [1e-6, 1.0, 1e6] {
        let mut soup = Enclosure::default();
        for i in 0..300 {
            let mut point = || size * DVec3::new(random.next_unit(), random.next_unit(), random.next_unit());
            let facet = Facet::new(vec![point(), point(), point()]).unwrap();
            match i % 10 {
                0 => soup.obstructions.push(facet),
                _ => soup.add("", facet),
            }
        }
        assert_each_point_in_one_region(&soup, &find(&soup));
    }
}

/// Catalogue 93: the same on any number of threads.
#[test]
fn catalogue_93_the_same_on_any_number_of_threads() {
    let building = Building::new(Plan::of_rooms(20, 0.2, 0.7)).enclosure;
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| find(&building))
    };
    assert_eq!(on(1), on(3));
}
