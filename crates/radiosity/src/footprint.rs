//! Memory, told before it is taken: what a scene holds, what making its mesh and its tree takes on the way, and what a solution takes.
//! The table of hits is no part of it: what memory does not hold of that lies in a file.
//!
//! Bytes are counted or, where they depend on more than counts, the most that was measured: a building and a soup of a million and
//! of ten million triangles took 110 to 270 bytes a triangle to weld and 200 for the tree (peak of the process less what it held).

use radiosity_scene::{Bands, Scene};
use radiosity_trace::Tracer;
use radiosity_transport::Luminaires;

/// Most bytes a triangle while it is welded: four fifths of them contacts, in a scene in which all goes through all.
const WELDING: usize = 300;

/// Most bytes a triangle while the tree is built.
const BUILDING: usize = 230;

/// Bytes that a welded triangle holds, its vertices apart but for those of cuts (5 bytes in a building, in which 12 are allowed), and one in
/// the tree.
const WELDED: usize = 40;
const IN_TREE: usize = 84;

/// Bytes of an element: of a million, a solution kept 300 each and took 215 more while it was solved.
pub const ELEMENT_BYTES: usize = 525;

fn of_element(lights: usize) -> usize {
    ELEMENT_BYTES + lights * size_of::<Bands>()
}

/// Bytes of a scene with its mesh and its tree.
fn held(tracer: &Tracer) -> usize {
    tracer.scene.bytes() + tracer.mesh.bytes() + tracer.bytes()
}

/// Bytes of a solution of so many elements with direct light of so many lights, with all that it is made of but the table of hits.
pub(crate) fn solution(tracer: &Tracer, elements: usize, lights: usize) -> usize {
    held(tracer).saturating_add(elements.saturating_mul(of_element(lights)))
}

/// The smallest limit of memory within which light can be found in a scene: what it takes to weld it, to build its tree, or to solve
/// for one element on each side that has any. Told from counts, before any of that is taken.
pub fn least_memory(scene: &Scene) -> usize {
    let triangles = scene.triangles.len();
    let two_sided = scene.objects.iter().filter(|object| scene.materials[object.material].has_two_sides());
    let sides = triangles + two_sided.map(|object| object.triangles.len()).sum::<usize>();
    let welded = scene.bytes() + triangles * WELDED + size_of_val(&*scene.positions);
    let solved = welded + triangles * IN_TREE + sides * of_element(Luminaires::most(scene));
    (scene.bytes() + triangles * WELDING).max(welded + triangles * BUILDING).max(solved)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Error, MeasureOptions, Monitor, Solution, SolveOptions, cornell_box, measure};
    use glam::DVec3;
    use radiosity_scene::{Material, Mesh};
    use radiosity_solve::Solver;
    use radiosity_transport::HitTable;
    use std::sync::Mutex;

    /// Within the limit that is told beforehand a scene is solved; within less it is refused, with the limit that would do.
    #[test]
    fn the_least_memory_is_enough() {
        let matte = Material::default();
        let lamp = Material { emissive: [100.0; 3], ..matte.clone() };
        let mut scene = Scene { materials: vec![matte, lamp], ..Scene::default() };
        // A floor of forty thousand tiles, and a lamp above it.
        for k in 0..20_000u32 {
            let low = DVec3::new(f64::from(k % 200), f64::from(k / 200), 0.01 * f64::from(k % 3)) * 0.1;
            scene.add_quad(
                "tile",
                0,
                [low, low + DVec3::X * 0.1, low + DVec3::new(0.1, 0.1, 0.0), low + DVec3::Y * 0.1],
            );
        }
        let corner = |x: f64, y: f64| DVec3::new(x, y, 3.0);
        scene.add_quad("lamp", 1, [corner(9., 4.), corner(9., 6.), corner(11., 6.), corner(11., 4.)]);
        let mesh = Mesh::new(&scene);
        let tracer = Tracer::new(&scene, &mesh);
        let points = [(DVec3::new(1.05, 1.05, 0.1), DVec3::Z)];
        let within = |memory: usize| {
            let solve = SolveOptions { memory, ..MeasureOptions::default().solve };
            measure(
                &tracer,
                &points,
                &MeasureOptions { error: 0.2, rounds: 0, solve, ..MeasureOptions::default() },
                &(),
            )
        };
        let least = least_memory(&scene);
        assert!(within(least).is_ok_and(|measured| measured.irradiance[0][0] > 0.0));
        assert!(
            matches!(within(least / 2), Err(Error::Memory { least: told, needed, .. }) if told == least && needed > least / 2)
        );
        // What is held is what was told, within what only some scenes need.
        assert!(held(&tracer) < least && least < 4 * held(&tracer) + scene.triangles.len() * ELEMENT_BYTES, "{least}");
    }

    struct Notes(Mutex<Vec<String>>);

    impl Monitor for Notes {
        fn note(&self, text: &str) {
            self.0.lock().unwrap().push(text.to_owned());
        }
    }

    /// Where no size is asked for, elements are as large as the memory wants, and it is said; where one is, it is kept, and refused.
    #[test]
    fn elements_are_larger_where_the_memory_holds_no_more() {
        let scene = cornell_box();
        let mesh = Mesh::new(&scene);
        let tracer = Tracer::new(&scene, &mesh);
        let options = SolveOptions { cells: 20_000, rays: 64, ..SolveOptions::default() };
        let (least, usual) = (least_memory(&scene), Solution::memory(&tracer, &options));
        for part in [0.9, 0.5, 0.1] {
            let memory = least + (part * (usual - least) as f64) as usize;
            let (mut fitted, monitor) = (SolveOptions { memory, ..options }, Notes(Mutex::default()));
            assert!(matches!(Solution::new(&tracer, &fitted, &()), Err(Error::Memory { .. })));
            fitted.fit(&tracer, &monitor);
            let said = monitor.0.into_inner().unwrap();
            assert!(said.len() == 1 && said[0].starts_with("elements are"), "{said:?}");
            assert!(Solution::memory(&tracer, &fitted) > memory / 2, "no larger than that");
            assert_eq!(fitted.rays, options.rays, "they may lie in a file");
            assert!(Solution::new(&tracer, &fitted, &()).is_ok());
        }
        let mut asked = SolveOptions { memory: least, element_size: Some(0.005), ..options };
        asked.fit(&tracer, &());
        assert!(matches!(Solution::new(&tracer, &asked, &()), Err(Error::Memory { .. })));
    }

    /// Rays that the memory does not hold are in a file: nothing is coarser for it, no number is another, and it is said.
    #[test]
    fn rays_beyond_the_memory_change_no_number() {
        let scene = cornell_box();
        let mesh = Mesh::new(&scene);
        let tracer = Tracer::new(&scene, &mesh);
        let options = SolveOptions { element_size: Some(0.1), ..SolveOptions::default() };
        let mut whole = Solution::begin(&tracer, &options, &()).unwrap();
        let needed = options.memory - whole.memory_allowed();
        whole.refine(options.rays, &()).unwrap();
        let table = HitTable::bytes(whole.elements.cells(), options.rays);
        assert_eq!(options.memory - whole.memory_allowed(), needed + table);

        // Half of the rays are in memory and half in a file; all are in a file, as they come together; there is no room at all.
        let (half, all) = ([options.rays / 2, options.rays], [options.rays]);
        for (memory, steps) in [(needed + table / 2, &half[..]), (needed + table / 2, &all), (needed, &all)] {
            let mut one_by_one = Solution::begin(&tracer, &options, &()).unwrap();
            steps.iter().for_each(|rays| one_by_one.refine(*rays, &()).unwrap());
            let monitor = Notes(Mutex::default());
            let mut solution = Solution::begin(&tracer, &SolveOptions { memory, ..options }, &monitor).unwrap();
            steps.iter().for_each(|rays| solution.refine(*rays, &monitor).unwrap());
            let bits = |of: &Solution| of.irradiance().iter().flatten().map(|x| x.to_bits()).collect::<Vec<_>>();
            assert_eq!(bits(&solution), bits(&one_by_one));
            assert_eq!(solution.memory_allowed(), if steps.len() > 1 { 0 } else { memory - needed });
            let said = monitor.0.into_inner().unwrap();
            assert!(said.len() == 1 && said[0].contains("temporary file"), "{said:?}");
        }
        // Who wants the table as a matrix needs it in memory.
        let stored = SolveOptions { memory: needed, solver: Solver::GaussSeidel, ..options };
        assert!(matches!(Solution::new(&tracer, &stored, &()), Err(Error::Memory { rays: Some(64), .. })));
        let less = SolveOptions { memory: Solution::memory(&tracer, &options) - 1, ..options };
        let Err(error) = Solution::new(&tracer, &less, &()) else { panic!("solved") };
        assert!(matches!(error, Error::Memory { rays: None, .. }), "{error}");
    }
}
