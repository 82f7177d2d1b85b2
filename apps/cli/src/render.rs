//! `radiosity render`: a picture from the solution.

use crate::input::{self, PictureArguments, SceneArguments, SolveArguments};
use crate::progress::Progress;
use crate::{Failure, Global, output};
use clap::Args;
use radiosity::{Mesh, RenderOptions, Tracer};
use std::path::PathBuf;

/// Arguments of `render`.
#[derive(Args, Clone, Debug)]
pub struct Arguments {
    #[command(flatten)]
    scene: SceneArguments,
    #[command(flatten)]
    solve: SolveArguments,
    /// The picture: .png (tone-mapped) or .exr (cd/m²).
    #[arg(short, long, value_name = "IMG.png")]
    output: PathBuf,
    #[command(flatten)]
    picture: PictureArguments,
}

/// Runs the verb.
pub fn run(arguments: &Arguments, global: &Global, progress: &Progress) -> Result<(), Failure> {
    output::check(&arguments.output, &["png", "exr"])?;
    let input = input::load(&arguments.scene, global, progress)?;
    let mesh = Mesh::new(&input.scene);
    let tracer = Tracer::new(&input.scene, &mesh);
    let camera = output::camera(&input.scene, &tracer, arguments.picture.camera.as_deref())?;
    let baked = radiosity::bake(&tracer, &arguments.solve.bake(), progress)?;
    let (width, height) = output::picture_size(&camera, arguments.picture.size);
    let render = RenderOptions { width, height, ..RenderOptions::default() };
    let picture = radiosity::render(&baked.solution, &baked.field, &camera, &render, progress)?;
    output::write_picture(&arguments.output, &picture, arguments.picture.exposure)?;
    if global.json {
        let result = serde_json::json!({
            "event": "result", "achieved": baked.achieved, "audit": baked.audit, "width": width, "height": height,
            "exposure": arguments.picture.exposure.unwrap_or_else(|| picture.exposure()), "seconds": progress.seconds(),
        });
        println!("{result}");
    } else {
        progress.say(&format!(
            "wrote {} ({width} x {height}); error of the light {:.3} %, at most {:.3} % (95 %); {:.1} s",
            arguments.output.display(),
            100.0 * baked.audit.error,
            100.0 * baked.audit.upper,
            progress.seconds(),
        ));
    }
    Ok(())
}
