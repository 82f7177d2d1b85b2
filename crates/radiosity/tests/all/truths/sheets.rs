//! Sheets that transmit light diffusely: what falls on one side leaves the other (catalogue 12, 13).

use super::*;
use radiosity::solve::Solver;
use radiosity::transport::FormFactorMethod;

use radiosity::{Camera, Place, Referee, RenderOptions, Transmission, render};

/// A pane that reflects ρ and passes τ.
fn opal(rho: [f32; 3], tau: [f32; 3]) -> Material {
    Material {
        name: "pane".to_owned(),
        base_color: [rho[0], rho[1], rho[2], 1.0],
        transmission: Some(Transmission { transmittance: tau, ..Transmission::default() }),
        ..Material::default()
    }
}

/// A room of two cubic metres, x < 1, and one of one, x > 1, the wall between them one pane.
fn rooms([first, second, pane]: [Material; 3]) -> Scene {
    let walls = room(DVec3::ONE, Material::default());
    let mut scene = Scene { materials: vec![first, second, pane], up: Up::Z, ..Scene::default() };
    for (material, shift, shared) in [(0, 0.0, "east"), (1, 1.0, "west")] {
        for object in walls.objects.iter().filter(|object| object.name != shared) {
            // The first one reaches from −1 to 1: light that most surfaces give off goes through F.
            let stretch =
                |p: DVec3| if material == 0 { DVec3::new(2.0 * p.x - 1.0, p.y, p.z) } else { p + shift * DVec3::X };
            let corners = |t| walls.corners(t).map(stretch);
            let triangles: Vec<[DVec3; 3]> = object.triangles.clone().map(corners).collect();
            scene.add_triangles(&format!("{} {material}", object.name), material, &triangles);
        }
    }
    let pane = [[1., 0., 0.], [1., 0., 1.], [1., 1., 1.], [1., 1., 0.]];
    scene.add_quad("pane", 2, pane.map(DVec3::from));
    scene
}

const RHO: [f32; 3] = [0.3, 0.1, 0.0];
const TAU: [f32; 3] = [0.4, 0.8, 0.05];

/// Black walls of the first room give off 100 lm/m², those of the second are dark: nothing comes back through the pane.
fn lit_and_dark() -> Scene {
    rooms([matte("glowing", [0.0; 3], [100.0; 3]), matte("black", [0.0; 3], [0.0; 3]), opal(RHO, TAU)])
}

/// Radiosity by element and mean irradiances: of the sides of the pane, of the wall opposite to it and of all black walls.
fn exchanged(scene: &Scene, options: &SolveOptions) -> [[f64; 3]; 4] {
    let mesh = Mesh::new(scene);
    let tracer = Tracer::new(scene, &mesh);
    let solution = Solution::new(&tracer, options, &()).unwrap_or_else(|e| panic!("{options:?}: {e}"));
    let mut sums = [[0.0; 3]; 4];
    let radiosity = solution.radiosity();
    for (e, h) in solution.irradiance().iter().enumerate() {
        let (triangle, side) = solution.elements.place(e as u32);
        let object = &scene.objects[scene.triangle_object[mesh.source[triangle] as usize] as usize];
        let mut add = |k: usize| (0..3).for_each(|band| sums[k][band] += solution.area[e] * f64::from(h[band]));
        match (object.name.as_str(), object.material) {
            // The front looks into the first room.
            ("pane", _) => {
                add(usize::from(side == Side::Back));
                // What leaves a side is exactly what R makes of both irradiances.
                let other = solution.elements.opposite(e as u32).unwrap() as usize;
                for band in 0..3 {
                    let from = [h[band], solution.irradiance()[other][band]].map(f64::from);
                    let expected = f64::from(RHO[band]) * from[0] + f64::from(TAU[band]) * from[1];
                    let own = f64::from(radiosity[e][band]);
                    assert!((own - expected).abs() <= 1e-6 * expected, "{own} for {expected}");
                }
            }
            (name, 1) => {
                add(3);
                if name == "east 1" {
                    add(2);
                }
            }
            _ => {}
        }
    }
    sums
}

/// All that falls on the pane is E, the share τ of it falls on the dark walls, and F of opposite faces of a cube of that
/// on the one opposite.
fn assert_passes(found: [[f64; 3]; 4], within: f64, who: &str) {
    for band in 0..3 {
        let tau = f64::from(TAU[band]);
        let exact = [100.0, 0.0, tau * 100.0 * 0.199_824_895_698, tau * 100.0];
        for (k, exact) in exact.into_iter().enumerate() {
            let off = (found[k][band] - exact).abs();
            assert!(off <= within * exact, "{who}, band {band}, {k}: {} for {exact}", found[k][band]);
        }
    }
}

/// The flux of one room through a pane into the other, by methods for form factors of every kind.
#[test]
fn catalogue_12_a_pane_passes_its_transmittance_by_form_factors() {
    let scene = lit_and_dark();
    for (method, size, within) in [("adaptive", 0.5, 1e-6), ("hemicube", 0.75, 3e-2), ("hemisphere", 1.0, 5e-3)] {
        let form_factors: Option<FormFactorMethod> = Some(method.parse().unwrap());
        let options = SolveOptions { element_size: Some(size), rays: 32, form_factors, ..SolveOptions::default() };
        assert_passes(exchanged(&scene, &options), within, method);
    }
}

/// The same by every solver on the matrix, and by some on the table of hits; those that need symmetry are refused.
#[test]
fn catalogue_12_a_pane_passes_its_transmittance_by_every_solver() {
    let scene = lit_and_dark();
    for solver in Solver::ALL {
        let is_sampled = matches!(solver, Solver::DeflatedJacobi | Solver::Gmres | Solver::GaussSeidel | Solver::Lu);
        for name in ["adaptive", "rays"].into_iter().take(1 + usize::from(is_sampled)) {
            let form_factors = (name != "rays").then(|| name.parse().unwrap());
            let options = SolveOptions {
                element_size: Some(0.5),
                rays: 256,
                form_factors,
                solver: *solver,
                ..SolveOptions::default()
            };
            let mesh = Mesh::new(&scene);
            let tracer = Tracer::new(&scene, &mesh);
            match Solution::begin(&tracer, &options, &()).map(drop) {
                Ok(()) => {
                    let within = if name == "rays" || solver.is_random() { 2e-2 } else { 1e-3 };
                    assert_passes(exchanged(&scene, &options), within, &format!("{solver} by {name}"));
                }
                Err(error) => assert!(solver.needs_reciprocity(), "{solver} by {name}: {error}"),
            }
            assert_eq!(options.solver.takes_sheets(), !matches!(solver, Solver::Cg | Solver::Cholesky));
        }
    }
}

/// The engine as it is by default, at points and with its audit by the path tracer; and the path tracer alone.
#[test]
fn catalogue_12_a_pane_passes_its_transmittance_at_points() {
    let scene = lit_and_dark();
    // F from the middle of the wall opposite to the pane, four times that from below a corner.
    let (a, root) = (0.5f64, 1.25f64.sqrt());
    let exact: Vec<f64> = TAU.map(|tau| 100.0 * f64::from(tau) * 4.0 / PI * (a / root) * (a / root).atan()).to_vec();
    let points = [(DVec3::new(2.0, 0.5, 0.5), -DVec3::X)];
    let mesh = Mesh::new(&scene);
    let tracer = Tracer::new(&scene, &mesh);
    let measured = measure(&tracer, &points, &MeasureOptions::default(), &()).unwrap();
    assert!(measured.achieved, "{:?}", measured.audit);
    let referee = Referee::new(&tracer);
    let place = Place { point: points[0].0, normal: points[0].1, triangle: u32::MAX };
    let runs: Vec<[f32; 3]> = (1..=32).map(|seed| referee.irradiance(&place, 1024, seed)).collect();
    for band in 0..3 {
        let engine = f64::from(measured.irradiance[0][band]);
        assert!((engine / exact[band] - 1.0).abs() < 0.01, "{engine} for {}", exact[band]);
        let mean = runs.iter().map(|r| f64::from(r[band])).sum::<f64>() / 32.0;
        let variance = runs.iter().map(|r| (f64::from(r[band]) - mean).powi(2)).sum::<f64>() / (31.0 * 32.0);
        // Four standard errors: a false alarm in some ten thousand seeds.
        let error = variance.sqrt();
        assert!((mean - exact[band]).abs() < 4.0 * error, "{mean} ± {error} for {}", exact[band]);
        assert!(error < 0.01 * exact[band], "{error}");
    }
}

/// Two rooms in balance: with E = (1 − ρ) B on the walls and (1 − ρ − τ) B on the pane all is B.
#[test]
fn catalogue_13_a_furnace_of_two_rooms() {
    let (wall, rho, tau) = (0.8f32, 0.2f32, 0.7f32);
    let e = |kept: f32| [100.0 * f64::from(kept); 3].map(|e| e);
    let mut pane = opal([rho; 3], [tau; 3]);
    pane.emissive = matte("", [0.0; 3], e(1.0 - rho - tau)).emissive;
    let walls = matte("wall", [wall; 3], e(1.0 - wall));
    let scene = rooms([walls.clone(), walls, pane]);
    let mesh = Mesh::new(&scene);
    let tracer = Tracer::new(&scene, &mesh);
    for (name, within) in [("rays", 1e-3), ("adaptive", 1e-3)] {
        let form_factors = (name != "rays").then(|| name.parse().unwrap());
        let options = SolveOptions { element_size: Some(0.25), rays: 64, form_factors, ..SolveOptions::default() };
        let solution = Solution::new(&tracer, &options, &()).unwrap();
        for b in solution.radiosity().iter().flatten() {
            assert!((f64::from(*b) / 100.0 - 1.0).abs() < within, "{name}: {b}");
        }
        let balance = solution.balance().unwrap();
        assert!(balance.defect.iter().all(|d| d.abs() < 2e-3), "{name}: {balance:?}");
    }
}

/// A closed box of opal sheets around a lamp, in a black room. Inside it, ρ is the same everywhere, so that its walls
/// receive Φ/(1 − ρ) in all, wherever the lamp is: the room absorbs Φ τ/(1 − ρ).
#[test]
fn catalogue_13_a_lamp_in_a_box_of_opal() {
    let (rho, tau) = (0.5f32, 0.3f32);
    let mut scene = room(DVec3::splat(3.0), matte("black", [0.0; 3], [0.0; 3]));
    scene.materials.push(opal([rho; 3], [tau; 3]));
    let box_ = room(DVec3::ONE, Material::default());
    for object in &box_.objects {
        let triangles: Vec<[DVec3; 3]> =
            object.triangles.clone().map(|t| box_.corners(t).map(|p| p + DVec3::new(0.6, 1.1, 1.3))).collect();
        scene.add_triangles("opal", 1, &triangles);
    }
    scene.lights.push(PointLight {
        name: "lamp".to_owned(),
        position: DVec3::new(1.3, 1.5, 1.8),
        direction: -DVec3::Z,
        intensity: [100.0; 3],
        range: None,
        kind: PointLightKind::Point,
    });
    let exact = 4.0 * PI * 100.0 * f64::from(tau / (1.0 - rho));
    let mesh = Mesh::new(&scene);
    let tracer = Tracer::new(&scene, &mesh);
    let solve = SolveOptions { element_size: Some(0.2), ..SolveOptions::default() };
    let options = BakeOptions { error: 0.05, audit_points: 300, solve, ..BakeOptions::default() };
    let baked = bake(&tracer, &options, &()).unwrap();
    assert!(baked.achieved, "{:?}", baked.audit);
    let solution = &baked.solution;
    let mut flux = 0.0;
    for (e, h) in solution.irradiance().iter().enumerate() {
        let (triangle, _) = solution.elements.place(e as u32);
        if scene.material(mesh.source[triangle] as usize).name == "black" {
            flux += solution.area[e] * f64::from(h[1]);
        }
    }
    assert!((flux / exact - 1.0).abs() < 0.01, "{flux} for {exact}");
    // By the path tracer, over the places of a stratified grid on the walls.
    let referee = Referee::new(&tracer);
    let (mut sum, n) = (0.0, 16);
    for (k, wall) in scene.objects[..6].iter().enumerate() {
        for i in 0..n * n {
            let t = wall.triangles.start;
            let [a, b, c] = scene.corners(t);
            let (u, v) = ((f64::from(i % n) + 0.5) / f64::from(n), (f64::from(i / n) + 0.5) / f64::from(n));
            // Corners 1, 2, 3 of the wall: its first triangle spans it.
            let place = Place {
                point: a + u * (b - a) + v * (c - b),
                normal: (b - a).cross(c - a).normalize(),
                triangle: u32::MAX,
            };
            sum += f64::from(referee.irradiance(&place, 64, u64::from(i + n * n * k as u32))[1]);
        }
    }
    let traced = sum / f64::from(n * n) * 9.0;
    assert!((traced / exact - 1.0).abs() < 0.015, "{traced} for {exact}");
}

/// A lamp in a bright room beside another one.
fn furnished(pane: Material) -> Scene {
    let mut scene = rooms([matte("warm", [0.8, 0.6, 0.4], [0.0; 3]), matte("cool", [0.5, 0.7, 0.8], [0.0; 3]), pane]);
    scene.materials.push(matte("lamp", [0.0; 3], [1000.0; 3]));
    let lamp = [[0.3, 0.4, 0.98], [0.3, 0.6, 0.98], [0.5, 0.6, 0.98], [0.5, 0.4, 0.98]];
    scene.add_quad("lamp", 3, lamp.map(DVec3::from));
    scene
}

/// Luminance of the square around the middle of the pane that a picture shows from the second room, by the path tracer.
fn leaving(referee: &Referee, half: f64) -> f64 {
    let (mut sum, n) = (0.0, 32);
    for i in 0..n * n {
        let at = |k: i32| 0.5 + half * (2.0 * (f64::from(k) + 0.5) / f64::from(n) - 1.0);
        let point = DVec3::new(1.0, at(i % n), at(i / n));
        let on = |normal: DVec3| {
            referee.irradiance(&Place { point: point + 1e-5 * normal, normal, triangle: u32::MAX }, 64, i as u64)
        };
        let (behind, here) = (on(-DVec3::X), on(DVec3::X));
        sum += f64::from(luminance(std::array::from_fn(|k| RHO[k] * here[k] + TAU[k] * behind[k]))) / PI;
    }
    sum / f64::from(n * n)
}

/// Between rooms that reflect: points, texels and a picture, each audited by the path tracer, and the matrix.
#[test]
fn catalogue_13_rooms_joined_by_a_pane_agree_with_the_path_tracer() {
    let scene = furnished(opal(RHO, TAU));
    let mesh = Mesh::new(&scene);
    let tracer = Tracer::new(&scene, &mesh);
    let solve = SolveOptions { element_size: Some(0.1), ..SolveOptions::default() };
    let options = BakeOptions { error: 0.02, audit_points: 300, solve, ..BakeOptions::default() };
    let baked = bake(&tracer, &options, &()).unwrap();
    assert!(baked.achieved && baked.audit.bias.abs() < 0.01, "{:?}", baked.audit);
    let balance = baked.solution.balance().unwrap();
    assert!(balance.defect.iter().all(|d| d.abs() < 0.01), "{balance:?}");

    // The dark room alone is right as well: it holds a small part of the light.
    let dark: Vec<(DVec3, DVec3)> = (0..40)
        .map(|i| {
            let at = |k: i32| (f64::from(i * k % 40) + 0.5) / 40.0;
            (DVec3::new(1.0 + at(7), at(11), 0.0), DVec3::Z)
        })
        .collect();
    let options = MeasureOptions { error: 0.03, solve, ..MeasureOptions::default() };
    let measured = measure(&tracer, &dark, &options, &()).unwrap();
    assert!(measured.achieved && measured.audit.bias.abs() < 0.01, "{:?}", measured.audit);

    // Factors of a matrix tell the same of the dark room.
    let mean = |options: &SolveOptions| {
        let means = object_means(&scene, options);
        (5..10).map(|wall| means[wall][1]).sum::<f64>() / 5.0
    };
    let options = SolveOptions { element_size: Some(0.34), rays: 256, ..SolveOptions::default() };
    let by_rays = mean(&options);
    let by_matrix = mean(&SolveOptions { form_factors: Some("adaptive".parse().unwrap()), ..options });
    assert!((by_rays / by_matrix - 1.0).abs() < 0.01, "{by_rays} and {by_matrix}");

    // A picture of the pane from the dark room: what is behind it is evaluated and audited with it.
    let camera = Camera::look_at("eye", DVec3::new(1.9, 0.5, 0.5), DVec3::new(1.0, 0.5, 0.5), DVec3::Z, 0.5);
    let view =
        render(&baked, &camera, &RenderOptions { width: 32, height: 32, ..RenderOptions::default() }, &()).unwrap();
    let audit = view.audit(&baked, &()).unwrap();
    assert!(audit.error < 0.03, "{audit:?}");
    let shown: f64 = view.picture.pixels.iter().map(|p| f64::from(luminance(*p))).sum::<f64>() / 1024.0;
    let left = leaving(&Referee::new(&tracer), 0.9 * 0.25f64.tan());
    assert!((shown / left - 1.0).abs() < 0.01, "{shown} for {left}");

    let map = lightmap(&baked, Some(20.0), 4096, &()).unwrap();
    assert!(map.audit.error < 0.04, "{:?}", map.audit);
}

/// A pane with τ = 0 is any two-sided wall, bit by bit.
#[test]
fn catalogue_13_a_pane_that_passes_nothing_is_a_wall() {
    let answers: Vec<_> = [Some(Transmission::default()), None]
        .into_iter()
        .map(|transmission| {
            let scene = furnished(Material { double_sided: true, transmission, ..opal(RHO, TAU) });
            let mesh = Mesh::new(&scene);
            let tracer = Tracer::new(&scene, &mesh);
            let points: Vec<(DVec3, DVec3)> =
                [0.2, 0.7].into_iter().map(|x| (DVec3::new(x, 0.4, 0.0), DVec3::Z)).collect();
            let solve = SolveOptions { element_size: Some(0.2), rays: 64, ..SolveOptions::default() };
            let options = MeasureOptions { error: 0.1, solve, ..MeasureOptions::default() };
            let measured = measure(&tracer, &points, &options, &()).unwrap();
            let solution = Solution::new(&tracer, &solve, &()).unwrap();
            let bits = |bands: &[[f32; 3]]| bands.iter().flatten().map(|h| h.to_bits()).collect::<Vec<_>>();
            let dark = solution.irradiance().iter().filter(|h| **h == [0.0; 3]).count();
            (bits(solution.irradiance()), bits(&measured.irradiance), measured.audit.upper.to_bits(), dark)
        })
        .collect();
    assert!(answers[0] == answers[1]);
    assert!(answers[0].3 > 0, "the second room is dark");
}

/// Of a globe or a blind, the side in the dark was left out as the inside of a solid is, and seen from there it was gone.
#[test]
fn a_sheet_is_written_on_both_sides_though_one_is_dark() {
    for (pane, layers) in [(opal(RHO, TAU), 2), (Material { double_sided: true, ..Material::default() }, 1)] {
        let mut scene = lit_and_dark();
        scene.materials[2] = pane;
        let mesh = Mesh::new(&scene);
        let tracer = Tracer::new(&scene, &mesh);
        let solve = SolveOptions { element_size: Some(0.5), rays: 32, ..SolveOptions::default() };
        let options = BakeOptions { error: 0.5, rounds: 0, audit_points: 100, solve, ..BakeOptions::default() };
        let baked = bake(&tracer, &options, &()).unwrap();
        let light = vertex_light(&baked, &()).unwrap();
        let name = |object: usize| scene.objects[object].name.as_str();
        let written: Vec<bool> =
            light.primitives.iter().filter(|p| name(p.object) == "pane").map(|p| p.flipped).collect();
        assert_eq!(written, [false, true][..layers]);
    }
}
