//! When to stop (catalogue 42): what was asked is kept by the true error, in every scene, by every solver.

use glam::DVec3;
use radiosity::display::{delta_e, tone_map};
use radiosity::solve::{Params, Solver};
use radiosity::{
    BakeOptions, Bands, Displayed, Elements, Error, Material, MeasureOptions, Mesh, Monitor, RenderOptions, Scene, Sky,
    Solution, SolveOptions, Timed, Tracer, View, bake, cornell_box, measure, render,
};
use std::time::Duration;

/// A box with a lamp in its ceiling, bright walls, one of them red, and a roof light where it is open.
fn room(reflectance: f32, is_open: bool) -> Scene {
    let matte = |color: [f32; 3]| Material { base_color: [color[0], color[1], color[2], 1.0], ..Material::default() };
    let mut scene = Scene { materials: vec![matte([reflectance; 3]), matte([0.8, 0.1, 0.1])], ..Scene::default() };
    scene.materials.push(Material { emissive: [900.0, 800.0, 500.0], ..matte([0.1; 3]) });
    let mut quad = |name: &str, material: usize, corners: [[f64; 3]; 4]| {
        scene.add_quad(name, material, corners.map(DVec3::from));
    };
    quad("floor", 0, [[0., 0., 0.], [0., 0., 3.], [4., 0., 3.], [4., 0., 0.]]);
    quad("left", 1, [[0., 0., 0.], [0., 2., 0.], [0., 2., 3.], [0., 0., 3.]]);
    quad("right", 0, [[4., 0., 0.], [4., 0., 3.], [4., 2., 3.], [4., 2., 0.]]);
    quad("back", 0, [[0., 0., 0.], [4., 0., 0.], [4., 2., 0.], [0., 2., 0.]]);
    quad("front", 0, [[0., 0., 3.], [0., 2., 3.], [4., 2., 3.], [4., 0., 3.]]);
    quad("ceiling", 0, [[0., 2., 0.], [3., 2., 0.], [3., 2., 3.], [0., 2., 3.]]);
    quad("lamp", 2, [[1., 1.9, 1.], [2., 1.9, 1.], [2., 1.9, 2.], [1., 1.9, 2.]]);
    match is_open {
        true => scene.sky = Sky::Overcast { horizontal: [10_000.0; 3] },
        false => quad("rest", 0, [[3., 2., 0.], [4., 2., 0.], [4., 2., 3.], [3., 2., 3.]]),
    }
    scene
}

fn shown(b: Bands, exposure: f64) -> Bands {
    tone_map(b.map(|x| x * exposure.exp2() as f32 / std::f32::consts::PI))
}

/// Largest ΔE of an element that shows anything.
fn apart(found: &Solution, exact: &Solution, exposure: f64) -> f64 {
    let area = exact.exposed_area();
    let pairs = found.radiosity().into_iter().zip(exact.radiosity()).zip(area);
    let seen = pairs.filter(|(_, area)| *area > 0.0);
    seen.fold(0.0, |worst, ((a, b), _)| worst.max(delta_e(shown(a, exposure), shown(b, exposure))))
}

const SOLVERS: [Solver; 7] = [
    Solver::DeflatedJacobi,
    Solver::Jacobi,
    Solver::Gmres,
    Solver::Bicgstab,
    Solver::GaussSeidel,
    Solver::Progressive,
    Solver::ShootingAmbient,
];

/// In all scenes, by all solvers, at all bounds asked: the bound told is at most what was asked, and the true difference of
/// what is displayed, from a solution to six digits more, at most the bound told. A coarser bound costs no more work.
#[test]
fn catalogue_42_the_display_is_as_near_as_asked() {
    let (mut cases, mut largest) = (0, 0f64);
    for scene in [cornell_box(), room(0.5, false), room(0.9, false), room(0.8, true)] {
        let mesh = Mesh::new(&scene);
        let tracer = Tracer::new(&scene, &mesh);
        let size = if mesh.triangles.len() > 30 { 0.5 } else { 3.0 };
        let plain = SolveOptions { element_size: Some(size), rays: 8, ..SolveOptions::default() };
        let tight = Params { tolerance: 2e-6, ..plain.params };
        let exact = Solution::new(&tracer, &SolveOptions { params: tight, ..plain }, &()).unwrap();
        for solver in SOLVERS {
            let coarse = SolveOptions { element_size: Some(size), rays: 8, ..SolveOptions::of(solver) };
            let mut work = 0.0;
            for (asked, exposure) in [(20.0, None), (3.0, None), (3.0, Some(-5.0)), (0.3, None)] {
                let options = SolveOptions { displayed: Some(Displayed { delta_e: asked, exposure }), ..coarse };
                let found = Solution::new(&tracer, &options, &()).unwrap();
                let told = found.displayed(exposure);
                assert!(told.delta_e <= asked, "{solver}, {asked}: {told:?}");
                assert!(exposure.is_none_or(|exposure| exposure == told.exposure));
                let off = apart(&found, &exact, told.exposure);
                assert!(off <= told.delta_e + 1e-3, "{solver}, {asked}: {off} with a bound of {told:?}");
                if exposure.is_none() {
                    assert!(found.info.work >= work, "{solver}, {asked}: {} after {work}", found.info.work);
                    work = found.info.work;
                }
                (cases, largest) = (cases + 1, largest.max(off / asked));
            }
        }
    }
    assert_eq!(cases, 4 * SOLVERS.len() * 4);
    // A bound that is never come near would be kept by anything.
    assert!(largest > 0.005, "{largest}");
}

/// The criterion of the display gives the same bytes on any number of threads.
#[test]
fn catalogue_42_the_display_stops_at_the_same_step_on_any_number_of_threads() {
    let scene = room(0.8, true);
    let mesh = Mesh::new(&scene);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let tracer = Tracer::new(&scene, &mesh);
            let displayed = Some(Displayed { delta_e: 1.0, exposure: None });
            let options = SolveOptions { element_size: Some(0.3), rays: 32, displayed, ..SolveOptions::default() };
            let found = Solution::new(&tracer, &options, &()).unwrap();
            let bits = |bands: &Bands| bands.map(f32::to_bits);
            (
                found.info.steps,
                found.displayed(None).delta_e.to_bits(),
                found.irradiance().iter().map(bits).collect::<Vec<_>>(),
            )
        })
    };
    let one = on(1);
    assert!(one == on(2) && one == on(5));
}

/// What is beyond the solver is said with what it reached, and not handed out.
#[test]
fn a_display_that_is_not_reached_is_an_error() {
    let scene = room(0.9, false);
    let mesh = Mesh::new(&scene);
    let tracer = Tracer::new(&scene, &mesh);
    let params = Params { max_steps: 40, ..Params::default() };
    let coarse = SolveOptions { element_size: Some(1.0), rays: 32, params, ..SolveOptions::default() };
    let asked = SolveOptions { displayed: Some(Displayed { delta_e: 1e-6, exposure: None }), ..coarse };
    let Err(error) = Solution::new(&tracer, &asked, &()) else { panic!("promised") };
    assert!(matches!(error, Error::Displayed { reached, .. } if reached > 1e-6 && reached < 1.0), "{error}");
    // A residual that single precision does not tell is refused before the work.
    let params = Params { tolerance: 1e-9, ..coarse.params };
    let Err(error) = Solution::begin(&tracer, &SolveOptions { params, ..coarse }, &()) else { panic!("promised") };
    assert!(matches!(error, Error::Tolerance { .. }), "{error}");
}

/// Time that is over leaves a whole answer: fewer rays, an error that is known and larger, and it says so.
#[test]
fn catalogue_42_a_limit_of_time_leaves_a_whole_answer() {
    let scene = cornell_box();
    let mesh = Mesh::new(&scene);
    let tracer = Tracer::new(&scene, &mesh);
    let none = Timed::new(&(), Duration::ZERO);
    let solve = SolveOptions { element_size: Some(0.06), ..SolveOptions::default() };
    let options = BakeOptions { error: 1e-3, solve, ..BakeOptions::default() };
    let baked = bake(&tracer, &options, &none).unwrap();
    assert!(baked.out_of_time && !baked.achieved && baked.rounds.len() == 1);
    assert_eq!(baked.solution.rays(), 16);
    assert!(baked.audit.error > 1e-3 && baked.audit.upper < 0.5, "{:?}", baked.audit);
    assert!(baked.solution.irradiance().iter().flatten().all(|e| e.is_finite()));
    let light = radiosity::vertex_light(&baked, &none).unwrap();
    assert!(light.rounds.len() == 1 && light.audit.upper < 0.5, "{:?}", light.audit);
    assert!(light.hurried);
    // What is seen and written has the fewest rays then, and all of them without a limit.
    let size = RenderOptions { width: 48, height: 48, ..RenderOptions::default() };
    let look = |monitor: &dyn Monitor| render(&baked, &scene.cameras[0], &size, monitor).unwrap();
    let (hurried, usual) = (look(&none), look(&()));
    assert!(hurried.is_hurried && !usual.is_hurried);
    // Of surfaces: few samples in a pixel may miss an edge of the lamp, which outshines all.
    let mean = |view: &View| {
        let lit: Vec<f32> = view.illuminance.iter().copied().filter(|e| e.is_finite()).collect();
        lit.iter().sum::<f32>() / lit.len() as f32
    };
    assert!((mean(&hurried) / mean(&usual) - 1.0).abs() < 0.05, "{} and {}", mean(&hurried), mean(&usual));
    let map = radiosity::lightmap(&baked, None, 4096, &none).unwrap();
    assert!(map.hurried && map.rounds.len() == 1 && map.texels < 100_000, "{} texels", map.texels);
    assert!(map.audit.upper < 0.5, "{:?}", map.audit);
    // Where there is time, nothing is spared.
    let hour = Timed::new(&(), Duration::from_secs(3600));
    assert!(!look(&hour).is_hurried);
    let all = radiosity::lightmap(&baked, Some(20.0), 4096, &hour).unwrap();
    assert!(!all.hurried, "{} texels", all.texels);

    let points = [(DVec3::new(0.3, 0.0, 0.3), DVec3::Y), (DVec3::new(0.1, 0.0, 0.1), DVec3::Y)];
    let asked = MeasureOptions { error: 1e-3, solve, ..MeasureOptions::default() };
    let measured = measure(&tracer, &points, &asked, &none).unwrap();
    assert!(measured.out_of_time && !measured.achieved && measured.irradiance.len() == 2);
    assert!(measured.audit.error < 0.5, "{:?}", measured.audit);

    // Factors of another method are no answer before all are there, and rays are not put in their place in silence.
    let matrix = SolveOptions { form_factors: Some("hemicube".parse().unwrap()), ..options.solve };
    let Err(error) = bake(&tracer, &BakeOptions { solve: matrix, ..options }, &none) else { panic!("found") };
    assert!(matches!(error, Error::Time(_)), "{error}");
}

/// Rays end in time, however many are asked for, and time that is over leaves few elements the sweeps that solve them: of a sun-lit
/// room within a landscape all had the light of the landscape's ambient term after four sweeps.
#[test]
fn a_limit_of_time_leaves_some_for_the_solver() {
    let scene = room(0.9, false);
    let mesh = Mesh::new(&scene);
    let tracer = Tracer::new(&scene, &mesh);
    let solve = SolveOptions { element_size: Some(0.5), rays: 1 << 20, ..SolveOptions::default() };
    for limit in [Duration::ZERO, Duration::from_millis(300)] {
        let solution = Solution::new(&tracer, &solve, &Timed::new(&(), limit)).unwrap();
        assert!((16..1 << 20).contains(&solution.rays()), "{}", solution.rays());
        // Thirteen sweeps; four leave hundreds of times the tolerance.
        let residual = &solution.info.residual;
        let enough = solve.params.tolerance;
        assert!(residual.iter().all(|r| *r <= enough), "{residual:?} after {} steps", solution.info.steps);
    }
    // The last round knows that it was time that cut it.
    let bake_options = BakeOptions { error: 1e-4, rounds: 0, solve, ..BakeOptions::default() };
    let baked = bake(&tracer, &bake_options, &Timed::new(&(), Duration::from_millis(300))).unwrap();
    assert!(baked.out_of_time && !baked.achieved);
}

/// Of more elements than are begun whether or not there is time, none need be reached: the answer is whole all the same, and
/// says how far it is off. A building of a million triangles took 102 s where 60 were allowed.
#[test]
fn a_limit_of_time_ends_the_first_round_of_many_elements() {
    /// The stage, and the share of it that was done.
    struct Done(std::sync::Mutex<Vec<(String, f64)>>);
    impl Monitor for Done {
        fn stage(&self, name: &str) {
            self.0.lock().unwrap().push((name.to_owned(), 0.0));
        }
        fn step(&self, done: usize, total: usize) -> bool {
            if let Some(last) = self.0.lock().unwrap().last_mut() {
                last.1 = last.1.max(done as f64 / total as f64);
            }
            true
        }
    }
    let scene = cornell_box();
    let mesh = Mesh::new(&scene);
    let tracer = Tracer::new(&scene, &mesh);
    let solve = SolveOptions { element_size: Some(0.004), ..SolveOptions::default() };
    assert!(Elements::count(&scene, &mesh, 0.004) > 100_000);

    let done = Done(Default::default());
    let points = [(DVec3::new(0.3, 0.0, 0.3), DVec3::Y), (DVec3::new(0.1, 0.0, 0.1), DVec3::Y)];
    let asked = MeasureOptions { error: 1e-3, solve, ..MeasureOptions::default() };
    let measured = measure(&tracer, &points, &asked, &Timed::new(&done, Duration::ZERO)).unwrap();
    assert!(measured.out_of_time && !measured.achieved && measured.rounds[0].rays == 0);
    assert!(measured.irradiance.iter().flatten().all(|e| e.is_finite()));
    assert!(measured.audit.error.is_finite() && measured.audit.upper > 1e-3, "{:?}", measured.audit);
    let done = done.0.into_inner().unwrap();
    for stage in ["elements", "exposure", "rays"] {
        let share = done.iter().find(|(name, _)| name == stage).map(|(_, share)| *share);
        assert!(share.is_some_and(|share| share < 0.5), "{stage}: {share:?}");
    }

    let options = BakeOptions { error: 1e-3, solve, ..BakeOptions::default() };
    let baked = bake(&tracer, &options, &Timed::new(&(), Duration::ZERO)).unwrap();
    assert!(baked.out_of_time && !baked.achieved && baked.solution.rays() == 0);
    assert!(baked.audit.error.is_finite() && baked.audit.upper > 1e-3, "{:?}", baked.audit);
    assert!(baked.solution.irradiance().iter().flatten().all(|e| e.is_finite()));
}

/// Of more triangles than cells a limit of time begins with fewer cells, and comes to as many as usual if it can; as few as those triangles
/// are anyway, and what meets the error asked is final. No limit begins with all.
#[test]
fn a_limit_of_time_begins_with_fewer_cells() {
    let mut scene = Scene { sky: Sky::Uniform([1000.0; 3]), ..Scene::default() };
    scene.materials.push(Material::default());
    let quad = |x: f64, y: f64, side: f64| {
        [[0.0, 0.0], [side, 0.0], [side, side], [0.0, side]].map(|[u, v]| DVec3::new(x + u, 0.0, -y - v))
    };
    for i in 0..16 {
        scene.add_quad("floor", 0, quad(f64::from(i % 4), f64::from(i / 4), 1.0));
    }
    scene.add_quad("wall", 0, [[0.0, 0.0], [4.0, 0.0], [4.0, 2.0], [0.0, 2.0]].map(|[x, y]| DVec3::new(x, y, -4.0)));
    for i in 0..16_000 {
        scene.add_quad("tiles", 0, quad(20.0 + 0.01 * f64::from(i % 160), 0.01 * f64::from(i / 160), 0.009));
    }
    let mesh = Mesh::new(&scene);
    let tracer = Tracer::new(&scene, &mesh);
    let solve = SolveOptions { rays: 2, ..SolveOptions::default() };
    let options = BakeOptions { error: 0.5, audit_points: 50, solve, ..BakeOptions::default() };
    let limit = Duration::from_secs(3600);
    let hurried = bake(&tracer, &options, &Timed::new(&(), limit)).unwrap();
    let usual = bake(&tracer, &options, &()).unwrap();
    let cells = [&hurried, &usual].map(|baked| baked.solution.elements.cells());
    assert!(hurried.achieved && usual.achieved && 2 * (cells[0] - 32_000) < cells[1] - 32_000, "{cells:?}");
    // An error that the first round does not meet.
    let strict = BakeOptions { error: 1e-6, rounds: 0, ..options };
    let both = bake(&tracer, &strict, &Timed::new(&(), limit)).unwrap();
    assert_eq!((both.rounds.len(), both.solution.elements.cells()), (2, cells[1]));
}

/// Of few triangles a limit that is not reached changes nothing but the order of the rays: the error asked is met all the same.
#[test]
fn time_that_suffices_gives_the_error_asked() {
    struct Stages(std::sync::Mutex<Vec<String>>);
    impl Monitor for Stages {
        fn stage(&self, name: &str) {
            self.0.lock().unwrap().push(name.to_owned());
        }
    }
    let scene = cornell_box();
    let mesh = Mesh::new(&scene);
    let tracer = Tracer::new(&scene, &mesh);
    let options = BakeOptions { error: 0.1, ..BakeOptions::default() };
    let stages = Stages(Default::default());
    let baked = bake(&tracer, &options, &Timed::new(&stages, Duration::from_secs(3600))).unwrap();
    assert!(baked.achieved && !baked.out_of_time);
    let usual = bake(&tracer, &options, &()).unwrap();
    assert_eq!(baked.solution.rays(), usual.solution.rays());
    assert!(stages.0.lock().unwrap().iter().any(|stage| stage == "audit"), "a limit hides no stage");
}
