//! `radiosity measure`: illuminance at points.

use crate::input::{self, SceneArguments, SolveArguments};
use crate::output::{Outputs, print};
use crate::progress::Progress;
use crate::report::ErrorReport;
use crate::{Failure, Global};
use clap::Args;
use radiosity::{Mesh, Tracer, luminance};
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
    let mut inputs = arguments.scene.files();
    inputs.push(&arguments.points);
    let mut outputs = Outputs::new(&inputs);
    if let Some(path) = &arguments.output {
        outputs.promise(path, &["csv"])?;
    }
    progress.part("reading");
    let points = radiosity::io::read_points_csv(&arguments.points)?;
    let input = input::load(&arguments.scene, global, progress)?;
    let mesh = Mesh::new(&input.scene);
    let tracer = Tracer::new(&input.scene, &mesh);
    let places: Vec<_> = points.iter().map(|p| (p.position, p.normal)).collect();
    progress.parts();
    let measured = radiosity::measure(&tracer, &places, &arguments.solve.measure(), progress)?;

    let mut text = String::from("x,y,z,nx,ny,nz,irradiance_r,irradiance_g,irradiance_b,illuminance_lux");
    for (point, e) in points.iter().zip(&measured.irradiance) {
        let (p, n) = (point.position, point.normal);
        let [r, g, b] = e;
        // Writing to a string cannot fail.
        let _ = write!(text, "\n{},{},{},{},{},{},{r},{g},{b},{}", p.x, p.y, p.z, n.x, n.y, n.z, luminance(*e));
    }
    let wrote = match &arguments.output {
        Some(path) => {
            outputs.stage(path, (text + "\n").as_bytes())?;
            outputs.commit()?;
            Some(format!("wrote {} points to {}", points.len(), path.display()))
        }
        None => {
            progress.finish();
            if !global.json {
                print(&text)?;
            }
            None
        }
    };
    let error = ErrorReport::new(&measured.audit, &measured.audit, &arguments.solve);
    if global.json {
        let values: Option<&[radiosity::Bands]> = arguments.output.is_none().then_some(&measured.irradiance);
        let result = serde_json::json!({
            "event": "result", "error": error, "rounds": measured.rounds, "relative_residual": measured.residual,
            "guaranteed_bound": measured.bound, "stages": progress.spent(), "seconds": progress.seconds(),
            "output": arguments.output, "irradiance": values,
        });
        return print(&result.to_string());
    }
    progress.say(&error.line());
    if let Some(wrote) = wrote {
        progress.say(&wrote);
    }
    Ok(())
}
