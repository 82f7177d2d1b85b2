//! `radiosity measure`: illuminance at points.

use crate::input::{self, SceneArguments, SolveArguments};
use crate::output::{Outputs, print};
use crate::progress::Progress;
use crate::report::ErrorReport;
use crate::{Failure, Global, faults, numbers};
use clap::Args;
use glam::DVec3;
use radiosity::{Bands, Levels, Scene, Tracer, counted, luminance};
use std::fmt::Write;
use std::path::PathBuf;

/// Arguments of `measure`.
#[derive(Args, Clone, Debug)]
pub struct Arguments {
    #[command(flatten)]
    scene: SceneArguments,
    #[command(flatten)]
    solve: SolveArguments,
    /// Points: a CSV whose first line names the columns x,y,z,nx,ny,nz and each further one a point, such as `1.5,0.75,2,0,1,0`:
    /// where, in metres of the scene's world, and which way the sensor looks; - reads standard input. `radiosity view` saves its
    /// grids and working planes like this.
    #[arg(long, value_name = "P.csv")]
    points: PathBuf,
    /// The answer: the points with irradiance_r,irradiance_g,irradiance_b,illuminance_lux and the further columns of
    /// P.csv as they are, but for those of an answer before; standard output if left out.
    #[arg(short, long, value_name = "OUT.csv")]
    output: Option<PathBuf>,
}

/// Columns of the answer.
const ANSWER: [&str; 4] = ["irradiance_r", "irradiance_g", "irradiance_b", "illuminance_lux"];

/// A cell as CSV wants it.
fn cell(text: &str) -> String {
    if text.contains([',', '"']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_owned() }
}

/// Points beyond the scene by more than this part of its extent are outside of it: sensors on a façade are not.
const BESIDE: f64 = 0.1;

/// What is said of points that lie outside the scene.
fn strays(scene: &Scene, places: &[(DVec3, DVec3)]) -> Option<String> {
    let [low, high] = scene.bounding_box()?;
    let beside = BESIDE * (high - low).max_element();
    let is_outside = |p: &DVec3| p.cmplt(low - beside).any() || p.cmpgt(high + beside).any();
    let outside = places.iter().filter(|(p, _)| is_outside(p)).count();
    let [low, high] = [low, high].map(|p| numbers::place(p.to_array()));
    let lie = if outside == 1 { "lies" } else { "lie" };
    (outside > 0).then(|| {
        format!(
            "warning: {outside} of {} {lie} outside the scene, which reaches from {low} to {high} m (are they in its axes and \
             unit? Of an .obj --up and --unit say which those are; a .glb is in metres, with y up)",
            counted(places.len(), "point", "points")
        )
    })
}

/// What is said of points without any light in a scene that has some.
fn dark(scene: &Scene, places: &[(DVec3, DVec3)], irradiance: &[Bands]) -> Option<String> {
    let is_dark = |e: &Bands| luminance(*e) <= 0.0;
    let first = irradiance.iter().position(is_dark).filter(|_| !faults::is_dark(scene))?;
    let count = irradiance.iter().filter(|e| is_dark(e)).count();
    let of = counted(places.len(), "point", "points");
    let receive = if count == 1 { "receives" } else { "receive" };
    let first_at = numbers::place(places[first].0.to_array());
    Some(format!(
        "warning: {count} of {of} {receive} no light at all, the first at {first_at} m: inside a solid, behind a surface, turned \
         away from all that is lit, or where no ray found any (nx,ny,nz is the way that the sensor looks); counted as 0 lx below"
    ))
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
    let read = match arguments.points.as_os_str() == "-" {
        true => radiosity::io::read_points("standard input", std::io::stdin())?,
        false => radiosity::io::read_points_csv(&arguments.points)?,
    };
    let points = &read.points;
    let input = input::load(&arguments.scene, arguments.solve.memory, global, progress)?;
    outputs.spare(&input.files)?;
    arguments.solve.refuse_tiny_elements(&input.mesh)?;
    let tracer = Tracer::new(&input.scene, &input.mesh);
    let eyes: Vec<_> = points.iter().map(|p| p.position + tracer.reach() * p.normal).collect();
    let tracer = tracer.seen_from(&eyes);
    let places: Vec<_> = points.iter().map(|p| (p.position, p.normal)).collect();
    progress.parts();
    if let Some(warning) = strays(&input.scene, &places) {
        progress.say(&warning);
    }
    arguments.solve.warn_of_methods(progress);
    progress.limit(arguments.solve.time);
    let measured = radiosity::measure(&tracer, &places, &arguments.solve.measure(), progress)?;

    // A file that was measured before gets its answer anew, not twice.
    let kept: Vec<usize> =
        (0..read.names.len()).filter(|&i| !ANSWER.contains(&read.names[i].to_ascii_lowercase().as_str())).collect();
    let further = |cells: &[String]| kept.iter().map(|&i| format!(",{}", cell(&cells[i]))).collect::<String>();
    let mut text = format!("x,y,z,nx,ny,nz,{}{}", ANSWER.join(","), further(&read.names));
    for ((point, cells), e) in points.iter().zip(&read.cells).zip(&measured.irradiance) {
        let (p, n) = (point.position, point.normal);
        let [r, g, b] = e;
        // Writing to a string cannot fail.
        let _ = write!(text, "\n{},{},{},{},{},{},{r},{g},{b},{}", p.x, p.y, p.z, n.x, n.y, n.z, luminance(*e));
        text += &further(cells);
    }
    let wrote = match &arguments.output {
        Some(path) => {
            outputs.stage(path, (text + "\n").as_bytes())?;
            outputs.commit()?;
            Some(format!("wrote {} to {}", counted(points.len(), "point", "points"), path.display()))
        }
        None => {
            progress.finish();
            if !global.json {
                print(&text)?;
            }
            None
        }
    };
    if let Some(warning) = dark(&input.scene, &places, &measured.irradiance) {
        progress.say(&warning);
    }
    let lux = || measured.irradiance.iter().map(|e| luminance(*e));
    let (levels, lit) = (Levels::of(lux()), Levels::of(lux().filter(|e| *e > 0.0)));
    let audit = &measured.audit;
    let error = ErrorReport::new((audit, audit), &measured.rounds, &arguments.solve, measured.out_of_time);
    progress.overtime().iter().for_each(|note| progress.say(note));
    if global.json {
        let values: Option<&[radiosity::Bands]> = arguments.output.is_none().then_some(&measured.irradiance);
        let result = serde_json::json!({
            "event": "result", "error": error, "rounds": measured.rounds, "relative_residual": measured.residual,
            "guaranteed_bound": measured.bound, "stages": progress.spent(), "seconds": progress.seconds(),
            "output": arguments.output, "illuminance": levels, "illuminance_where_lit": lit, "irradiance": values,
        });
        return print(&result.to_string());
    }
    error.tell(progress);
    progress.say(&levels.to_string());
    if levels.least <= 0.0 && lit.least > 0.0 {
        progress.say(&format!("without the points that receive none: {lit}"));
    }
    if let Some(wrote) = wrote {
        progress.say(&wrote);
    }
    Ok(())
}
