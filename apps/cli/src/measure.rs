//! `radiosity measure`: illuminance at points.

use crate::input::{self, SceneArguments, SolveArguments};
use crate::progress::Progress;
use crate::{Failure, Global, output};
use clap::Args;
use radiosity::{MeasureOptions, Mesh, Tracer, luminance};
use std::fmt::Write;
use std::path::PathBuf;

/// Arguments of `measure`.
#[derive(Args, Clone, Debug)]
pub struct Arguments {
    #[command(flatten)]
    scene: SceneArguments,
    #[command(flatten)]
    solve: SolveArguments,
    /// Points: a CSV with the columns x,y,z,nx,ny,nz (metres; unit of the scene's world).
    #[arg(long, value_name = "P.csv")]
    points: PathBuf,
    /// The answer: the points with irradiance_r,irradiance_g,irradiance_b,illuminance_lux; standard output if left out.
    #[arg(short, long, value_name = "OUT.csv")]
    output: Option<PathBuf>,
}

/// Runs the verb.
pub fn run(arguments: &Arguments, global: &Global, progress: &Progress) -> Result<(), Failure> {
    if let Some(path) = &arguments.output {
        output::check(path, &["csv"])?;
    }
    let points = radiosity::io::read_points_csv(&arguments.points).map_err(input::load_failure)?;
    let input = input::load(&arguments.scene, global, progress)?;
    let mesh = Mesh::new(&input.scene);
    let tracer = Tracer::new(&input.scene, &mesh);
    let places: Vec<_> = points.iter().map(|p| (p.position, p.normal)).collect();
    let options = MeasureOptions {
        error: arguments.solve.error,
        solve: arguments.solve.options(),
        rounds: arguments.solve.rounds,
        seed: arguments.solve.seed,
        ..MeasureOptions::default()
    };
    let measured = radiosity::measure(&tracer, &places, &options, progress)?;

    let mut text = String::from("x,y,z,nx,ny,nz,irradiance_r,irradiance_g,irradiance_b,illuminance_lux\n");
    for (point, e) in points.iter().zip(&measured.irradiance) {
        let (p, n) = (point.position, point.normal);
        let [r, g, b] = e;
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{},{},{},{},{},{},{r},{g},{b},{}", p.x, p.y, p.z, n.x, n.y, n.z, luminance(*e));
    }
    let verdict = if measured.achieved { "reached" } else { "NOT reached" };
    let summary = format!(
        "error asked {:.3} %: {verdict}; audit says {:.3} %, at most {:.3} % (95 %), bias {:+.3} ± {:.3} %",
        100.0 * options.error,
        100.0 * measured.audit.error,
        100.0 * measured.audit.upper,
        100.0 * measured.audit.bias,
        196.0 * measured.audit.bias_error,
    );
    match &arguments.output {
        Some(path) => {
            output::write(path, text.as_bytes())?;
            if !global.json {
                progress.say(&summary);
                progress.say(&format!("wrote {} points to {}", points.len(), path.display()));
            }
        }
        None if !global.json => {
            progress.finish();
            print!("{text}");
            progress.say(&summary);
        }
        None => {}
    }
    if global.json {
        let values: Option<Vec<[f32; 3]>> = arguments.output.is_none().then(|| measured.irradiance.clone());
        let result = serde_json::json!({
            "event": "result", "achieved": measured.achieved, "audit": measured.audit, "rounds": measured.rounds,
            "stages": measured.stages.all(), "residual": measured.residual, "bound": measured.bound,
            "seconds": progress.seconds(), "irradiance": values,
        });
        println!("{result}");
    }
    Ok(())
}
