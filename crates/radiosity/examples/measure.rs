//! Illuminance over the floor of the Cornell box, to 2 %: `cargo run --release -p radiosity --example measure`.

#![expect(clippy::print_stdout, reason = "an example shows its answer")]

use radiosity::{MeasureOptions, Mesh, Tracer, cornell_box, luminance, measure};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let scene = cornell_box();
    let mesh = Mesh::new(&scene);
    let tracer = Tracer::new(&scene, &mesh);

    // A grid of 20 × 20 points, looking up. Some lie under the blocks, where it is dark.
    let at = |i: u32| {
        let (column, row) = (f64::from(i % 20), f64::from(i / 20));
        ([0.025 * column + 0.04, 0.0, 0.025 * row + 0.04].into(), [0.0, 1.0, 0.0].into())
    };
    let points: Vec<_> = (0..400).map(at).collect();
    let options = MeasureOptions { error: 0.02, ..MeasureOptions::default() };
    let measured = measure(&tracer, &points, &options, &())?;

    for row in measured.irradiance.chunks(20).rev() {
        println!("{}", row.iter().map(|e| format!("{:5.0}", luminance(*e))).collect::<String>());
    }
    let verdict = if measured.achieved { "reached" } else { "not reached" };
    println!("2 % {verdict}: the error is at most {:.2} %", 100.0 * measured.audit.upper);
    Ok(())
}
