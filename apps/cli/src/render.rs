//! `radiosity render`: a picture from the solution.

use crate::frames::{self, Frames};
use crate::input::{self, PictureArguments, SceneArguments, SolveArguments};
use crate::output::{Outputs, print};
use crate::progress::Progress;
use crate::report::ErrorReport;
use crate::{Failure, Global, numbers, views};
use clap::Args;
use radiosity::{After, Monitor, RenderOptions, Tracer};
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
    let mut outputs = Outputs::new(&arguments.scene.files());
    outputs.promise(&arguments.output, &["png", "exr"])?;
    if let Some(folder) = &arguments.picture.frames {
        frames::prepare(folder)?;
    }
    progress.part("reading");
    let input = input::load(&arguments.scene, arguments.solve.memory, global, progress)?;
    outputs.spare(&input.files)?;
    arguments.solve.refuse_tiny_elements(&input.mesh)?;
    let tracer = Tracer::new(&input.scene, &input.mesh);
    arguments.picture.warn_of_what_has_no_effect(true, !views::is_exr(&arguments.output), progress);
    let camera = views::camera(&input.scene, &tracer, &arguments.picture, &arguments.scene, progress)?;
    let tracer = tracer.seen_from(&[camera.position()]);
    progress.parts();
    arguments.solve.warn_of_methods(progress);
    progress.limit(arguments.solve.time);
    let frames = Frames::begin(&arguments.picture, (&tracer, Some(&camera)), &arguments.solve.options(), progress)?;
    let monitor: &dyn Monitor = frames.as_ref().map_or(progress, |frames| frames);
    let (width, height) = views::picture_size(&camera, arguments.picture.size);
    let after = After { pixels: width as usize * height as usize, points: 0 };
    let baked = radiosity::bake(&tracer, &arguments.solve.bake(&arguments.picture, after), monitor)?;
    frames.map_or(Ok(()), Frames::end)?;
    progress.part("picture");
    let render = RenderOptions { width, height, ..RenderOptions::default() };
    let view = radiosity::render(&baked, &camera, &render, progress)?;
    let audit = view.audit(&baked, progress)?;
    let picture = view.picture;
    views::explain_black(&picture, &input.scene, progress);
    let exposure = arguments.picture.exposure.unwrap_or_else(|| picture.exposure());
    outputs.stage(&arguments.output, &views::encode(&arguments.output, &picture, exposure)?)?;
    outputs.commit()?;

    let is_over = baked.out_of_time || view.is_hurried || progress.is_over();
    let mut error = ErrorReport::new((&audit, &baked.audit), &baked.rounds, &arguments.solve, is_over);
    if error.is_lost_in_writing() && error.upper_95_one_sided.is_finite() {
        error.finer = match () {
            () if is_over => "allow more --time for the picture",
            () if error.left_open => "light comes by few bright paths, and those of the audit leave it open for the picture",
            () => "the camera looks at harder places than there are on the whole, where light changes from pixel to pixel; a smaller --error may help little",
        }
        .to_owned();
    }
    error.unlit(&input.scene, &baked.audit).iter().for_each(|warning| progress.say(warning));
    let shown = baked.solution.displayed(Some(exposure));
    progress.overtime().iter().for_each(|note| progress.say(note));
    if global.json {
        let result = serde_json::json!({
            "event": "result", "error": error, "output": arguments.output, "width": width, "height": height,
            "exposure": exposure, "displayed": shown, "stages": progress.spent(), "seconds": progress.seconds(),
        });
        return print(&result.to_string());
    }
    error.tell(progress);
    if let Some(asked) = arguments.solve.delta_e {
        progress.say(&views::nearness(&shown, asked));
    }
    let output = arguments.output.display();
    let seconds = progress.seconds();
    progress
        .say(&format!("wrote {output} ({width} x {height}), exposure {}, {seconds:.1} s", numbers::fixed(exposure, 2)));
    Ok(())
}
