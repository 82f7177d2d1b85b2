//! Mean illuminance of every object of a scene, the Cornell box if none is named:
//! `cargo run --release -p radiosity --example solve -- room.glb`.

#![expect(clippy::print_stdout, reason = "an example shows its answer")]

use radiosity::{Mesh, Solution, SolveOptions, Tracer, cornell_box, io, luminance};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let scene = match std::env::args_os().nth(1) {
        Some(path) => io::load(path.as_ref(), &io::LoadOptions::default())?.scene,
        None => cornell_box(),
    };
    let mesh = Mesh::new(&scene);
    let tracer = Tracer::new(&scene, &mesh);
    let solution = Solution::new(&tracer, &SolveOptions::default(), &())?;

    // Lumens and square metres of each object; what is buried in other solids receives nothing and does not count.
    let mut sums = vec![[0.0; 2]; scene.objects.len()];
    for (element, area) in solution.exposed_area().iter().enumerate() {
        let (triangle, _) = solution.elements.place(element as u32);
        let [lumens, square_metres] = &mut sums[scene.triangle_object[mesh.source[triangle] as usize] as usize];
        *lumens += area * f64::from(luminance(solution.irradiance()[element]));
        *square_metres += area;
    }
    for (object, [lumens, square_metres]) in scene.objects.iter().zip(sums) {
        println!("{:20} {:9.1} lx", object.name, lumens / square_metres.max(f64::MIN_POSITIVE));
    }
    println!("standard error of the rows' sampling: {:.2} %", 100.0 * solution.row_noise());
    Ok(())
}
