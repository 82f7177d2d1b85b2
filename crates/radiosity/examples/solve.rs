//! How bright is a room? Four metres by five, white ceiling, grey floor, one square lamp:
//! `cargo run --release -p radiosity --example solve`.

#![expect(clippy::print_stdout, reason = "an example shows its answer")]

use glam::dvec3;
use radiosity::{Material, Mesh, Scene, Solution, SolveOptions, Tracer, luminance};

fn main() -> Result<(), radiosity::Error> {
    // Reflectances, and a lamp of 5000 cd/m². Quads run counter-clockwise as seen from where they are looked at.
    let paint = |c: f32| Material { base_color: [c, c, c, 1.0], ..Material::default() };
    let lamp = Material { emissive: [5000.0; 3], ..paint(0.0) };
    let mut scene = Scene { materials: vec![paint(0.8), paint(0.5), paint(0.25), lamp], ..Scene::default() };
    let [a, b, c, d] = [(0.0, 0.0), (4.0, 0.0), (4.0, 5.0), (0.0, 5.0)].map(|(x, z)| dvec3(x, 0.0, z));
    let up = dvec3(0.0, 2.5, 0.0);
    scene.add_quad("ceiling", 0, [a + up, b + up, c + up, d + up]);
    for (wall, [from, to]) in [("back", [a, b]), ("right", [b, c]), ("front", [c, d]), ("left", [d, a])] {
        scene.add_quad(&format!("{wall} wall"), 1, [from, to, to + up, from + up]);
    }
    scene.add_quad("floor", 2, [d, c, b, a]);
    scene.add_quad("lamp", 3, [a, b, c, d].map(|p| dvec3(1.7, 2.48, 2.2) + 0.15 * dvec3(p.x, 0.0, 0.8 * p.z)));

    let mesh = Mesh::new(&scene);
    let tracer = Tracer::new(&scene, &mesh);
    let solution = Solution::new(&tracer, &SolveOptions::default(), &())?;

    // Lumens and square metres of each object, element by element.
    let mut sums = vec![[0.0; 2]; scene.objects.len()];
    for (element, area) in solution.exposed_area().iter().enumerate() {
        let (triangle, _) = solution.elements.place(element as u32);
        let [lumens, square_metres] = &mut sums[scene.triangle_object[mesh.source[triangle] as usize] as usize];
        *lumens += area * f64::from(luminance(solution.irradiance()[element]));
        *square_metres += area;
    }
    for (object, [lumens, square_metres]) in scene.objects.iter().zip(sums) {
        println!("{:12}{:5.0} lx on {square_metres:5.2} m²", object.name, lumens / square_metres);
    }
    let balance = solution.balance()?;
    println!("{:.0} lm from the lamp, {:.0} lm absorbed", luminance(balance.emitted), luminance(balance.absorbed));
    Ok(())
}
