//! `radiosity bake`: solve, write the lit model, a picture, a report.

use crate::frames::{self, Frames};
use crate::html::{self, Plate};
use crate::input::{self, PictureArguments, SceneArguments, SolveArguments};
use crate::output::{Outputs, print};
use crate::progress::Progress;
use crate::report::{LightmapReport, Report};
use crate::views;
use crate::{Failure, Global, faults, numbers};
use clap::{Args, ValueEnum};
use radiosity::io::gltf_out::{Encoding, Style, lit_glb};
use radiosity::io::image_out::encode_exr;
use radiosity::{After, Camera, Monitor, RenderOptions, Timed, Tracer, View, counted};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Arguments of `bake`.
#[derive(Args, Clone, Debug)]
pub struct Arguments {
    #[command(flatten)]
    scene: SceneArguments,
    #[command(flatten)]
    solve: SolveArguments,
    /// The lit model; SCENE-lit.glb in the current folder by default. Pages of a lightmap are written beside it as
    /// OpenEXR as well, OUT.lightmap0.exr and so on (lx).
    #[arg(short, long, value_name = "OUT.glb")]
    output: Option<PathBuf>,
    /// Texels per metre of the lightmap; by default about 200 000 texels in all, or four for each chart, and up to
    /// twenty times as many where --error needs them.
    #[arg(long, value_name = "N", allow_negative_numbers = true, conflicts_with_all = ["vertices", "unlit"],
        value_parser = numbers::positive)]
    texels_per_metre: Option<f64>,
    /// Largest width and height of a lightmap page.
    #[arg(long, value_name = "N", default_value_t = 4096, conflicts_with_all = ["vertices", "unlit"],
        value_parser = clap::value_parser!(u32).range(16..=16384))]
    max_atlas: u32,
    /// How texels are stored: sRGB, or linear for older readers.
    #[arg(long, value_enum, default_value_t = TexelEncoding::Srgb, conflicts_with_all = ["vertices", "unlit"])]
    lightmap_encoding: TexelEncoding,
    /// Write light at the vertices of a refined mesh (attribute _IRRADIANCE, lx) instead of a lightmap.
    #[arg(long)]
    vertices: bool,
    /// Write a model that looks lit in any viewer: unlit materials, exposed vertex colours.
    #[arg(long, conflicts_with = "vertices")]
    unlit: bool,
    /// A picture, .png (tone-mapped) or .exr (cd/m²).
    #[arg(long, value_name = "OUT.png")]
    image: Option<PathBuf>,
    /// A report, .json or .html; may be given twice.
    #[arg(long, value_name = "OUT.html")]
    report: Vec<PathBuf>,
    #[command(flatten)]
    picture: PictureArguments,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum TexelEncoding {
    Srgb,
    Linear,
}

/// By how much smaller a picture is that nobody sees.
const METERED: u32 = 4;

/// Part of the time that is left for a picture where light is written after it.
const PICTURED: f64 = 0.4;

/// Pages that a lightmap hardly gets to: of 4096 × 4096 texels each.
const PAGES: usize = 1000;

/// Part of a lightmap's values from which on it is said that 8 bits do not hold them.
const MOST_COARSE: f64 = 0.05;

/// Runs the verb.
pub fn run(arguments: &Arguments, global: &Global, progress: &Progress) -> Result<(), Failure> {
    let target = output_path(arguments);
    let mut outputs = Outputs::new(&arguments.scene.files());
    outputs.promise(&target, &["glb"])?;
    if !(arguments.vertices || arguments.unlit) {
        outputs.promise(&page_path(&target, 0), &["exr"])?;
    }
    for path in &arguments.report {
        outputs.promise(path, &["json", "html"])?;
    }
    if let Some(path) = &arguments.image {
        // How many pages there will be is known after hours.
        let has_pages = !(arguments.vertices || arguments.unlit);
        if has_pages && (1..PAGES).any(|page| page_path(&target, page) == *path) {
            return Err(Failure::input(format!("{}: a page of the lightmap may get this name", path.display())));
        }
        outputs.promise(path, &["png", "exr"])?;
    }
    if let Some(folder) = &arguments.picture.frames {
        frames::prepare(folder)?;
    }
    progress.part("reading");
    let mut input = input::load(&arguments.scene, arguments.solve.memory, global, progress)?;
    if let Some(fault) = faults::sheets::warning(&input.scene, &input.title) {
        progress.say(&fault.to_string());
        input.faults.0.push(fault);
    }
    outputs.spare(&input.files)?;
    arguments.solve.refuse_tiny_elements(&input.mesh)?;
    if let Some(density) = arguments.texels_per_metre {
        arguments.solve.refuse_tiny_texels(&input.mesh, density)?;
    }
    let tracer = Tracer::new(&input.scene, &input.mesh);
    let is_json = |path: &PathBuf| path.extension().is_some_and(|e| e.eq_ignore_ascii_case("json"));
    let has_page = !arguments.report.iter().all(is_json);
    let is_shown = has_page || arguments.image.is_some();
    let wants_view = is_shown || (arguments.unlit && arguments.picture.exposure.is_none());
    let is_exposed = arguments.unlit || has_page;
    let is_exposed = is_exposed || arguments.image.as_deref().is_some_and(|path| !views::is_exr(path));
    arguments.picture.warn_of_what_has_no_effect(wants_view, is_exposed, progress);
    // A camera that is not there is a fault even where none is needed.
    let needs_camera = wants_view
        || arguments.picture.frames.is_some()
        || arguments.picture.camera.is_some()
        || arguments.picture.eye.is_some();
    let camera = needs_camera
        .then(|| views::camera(&input.scene, &tracer, &arguments.picture, &arguments.scene, progress))
        .transpose()?;

    let eyes = views::eyes(&input.scene, &tracer, &arguments.picture);
    let tracer = tracer.seen_from(&eyes);
    progress.parts();
    arguments.solve.warn_of_methods(progress);
    progress.limit(arguments.solve.time);
    let frames = Frames::begin(&arguments.picture, (&tracer, camera.as_ref()), &arguments.solve.options(), progress)?;
    let monitor: &dyn Monitor = frames.as_ref().map_or(progress, |frames| frames);
    let size = |camera: &Camera| {
        let size = views::picture_size(camera, arguments.picture.size);
        // To meter the light a small picture is enough.
        if is_shown { size } else { (size.0.div_ceil(METERED), size.1.div_ceil(METERED)) }
    };
    let seen = camera.as_ref().filter(|_| wants_view);
    let pixels = seen.map(&size).map_or(0, |(width, height)| width as usize * height as usize);
    let after = After { pixels, points: radiosity::points_about(&input.mesh) };
    let baked = radiosity::bake(&tracer, &arguments.solve.bake(&arguments.picture, after), monitor)?;
    frames.map_or(Ok(()), Frames::end)?;

    // Pictures first: their exposure serves the unlit model as well.
    progress.part("pictures");
    let look = |camera: &Camera| {
        let (width, height) = size(camera);
        let options = RenderOptions { width, height, ..RenderOptions::default() };
        // Light that is written comes after it.
        match progress.deadline() {
            None => radiosity::render(&baked, camera, &options, progress),
            Some(deadline) => {
                let left = deadline.saturating_duration_since(Instant::now());
                radiosity::render(&baked, camera, &options, &Timed::new(progress, left.mul_f64(PICTURED)))
            }
        }
    };
    let view = seen.map(look).transpose()?;
    let exposure = arguments.picture.exposure.or(view.as_ref().map(|v| v.picture.exposure())).unwrap_or(0.0);
    let mut written: Vec<&Path> = Vec::new();
    if let (Some(path), Some(view)) = (&arguments.image, &view) {
        views::explain_black(&view.picture, &input.scene, progress);
        outputs.stage(path, &views::encode(path, &view.picture, exposure)?)?;
        written.push(path);
    }

    let (mut pages, mut lightmap) = (Vec::new(), None);
    let (model, audit, rounds, is_hurried) = if arguments.vertices || arguments.unlit {
        progress.part("vertex light");
        let light = radiosity::vertex_light(&baked, progress)?;
        let style = match arguments.vertices {
            true => Style::Vertices,
            false => Style::Unlit { exposure: exposure.exp2() as f32 },
        };
        (
            lit_glb(&input.scene, input.document.as_ref(), &light.primitives, &style),
            light.audit,
            light.rounds,
            light.hurried,
        )
    } else {
        progress.part("lightmap");
        let map = radiosity::lightmap(&baked, arguments.texels_per_metre, arguments.max_atlas, progress)?;
        lightmap = Some(LightmapReport::new(&map));
        let encoding = match arguments.lightmap_encoding {
            TexelEncoding::Srgb => Encoding::Srgb,
            TexelEncoding::Linear => Encoding::Linear,
        };
        for (page, (size, texels)) in map.pages.iter().zip(&map.irradiance).enumerate() {
            let beside = page_path(&target, page);
            // How many there are was not known before.
            if page > 0 {
                outputs.promise(&beside, &["exr"])?;
            }
            outputs.stage(&beside, &encode_exr(size[0], size[1], texels).map_err(Failure::work)?)?;
            pages.push(beside);
        }
        let coarse = map.coarse(encoding);
        if coarse > MOST_COARSE {
            progress.say(&format!(
                "note: in the model's 8 bits {:.0} % of the lightmap's values are off by more than a tenth; {} has all of the light",
                100.0 * coarse,
                page_path(&target, 0).display()
            ));
        }
        let style = Style::Lightmap { pages: map.images(encoding)?, encoding, exposure: 1.0 };
        (lit_glb(&input.scene, input.document.as_ref(), &map.primitives, &style), map.audit, map.rounds, map.hurried)
    };
    progress.part("writing");
    outputs.stage(&target, &model.map_err(|error| Failure::work(format!("{}: {error}", target.display())))?)?;
    let files = std::iter::once(target.as_path()).chain(pages.iter().map(PathBuf::as_path)).chain(written);
    let files: Vec<&Path> = files.chain(arguments.report.iter().map(PathBuf::as_path)).collect();

    let has_rays = baked.solution.rays() > 0;
    if has_rays && !input.scene.sky.is_black() && baked.solution.balance()?.from_sky.iter().all(|flux| *flux == 0.0) {
        progress.say(
            "warning: no light of the sky reaches any surface; the model has no opening, or faces look the wrong way",
        );
    }
    if !has_rays && arguments.solve.form_factors.0.is_none() {
        progress.say(
            "warning: there was no time for rays between elements: figures of elements lack the sky, and guess what is reflected \
             (allow more --time)",
        );
    }
    let written = (&audit, rounds, lightmap, is_hurried);
    let report = Report::new(&input, &arguments.solve, (&baked, view.as_ref(), exposure), written, &files, progress)?;
    report.error.unlit(&input.scene, &baked.audit).iter().for_each(|warning| progress.say(warning));
    for path in &arguments.report {
        let text = match is_json(path) {
            true => serde_json::to_string_pretty(&report).map_err(Failure::work)?,
            false => {
                html::page(&report, &plates(view.as_ref(), camera.as_ref().map_or("", |c| &c.name), &report, exposure)?)
            }
        };
        outputs.stage(path, text.as_bytes())?;
    }
    outputs.commit()?;
    tell(&report, arguments.solve.delta_e, global, progress)
}

fn output_path(arguments: &Arguments) -> PathBuf {
    arguments.output.clone().unwrap_or_else(|| {
        let stem = arguments.scene.scene.as_ref().and_then(|p| p.file_stem());
        let stem = stem.map_or("cornell-box".to_owned(), |s| s.to_string_lossy().into_owned());
        PathBuf::from(format!("{stem}-lit.glb"))
    })
}

fn page_path(target: &Path, page: usize) -> PathBuf {
    target.with_extension(format!("lightmap{page}.exr"))
}

/// The pictures of a page.
fn plates(view: Option<&View>, camera: &str, report: &Report, exposure: f64) -> Result<Vec<Plate>, Failure> {
    let Some(view) = view.map(views::for_page) else { return Ok(Vec::new()) };
    let sign = if exposure > 0.0 { "+" } else { "" };
    let ev = format!("{sign}{}", numbers::fixed(exposure, 1)).replace('-', "−");
    let from = if camera.is_empty() { String::new() } else { format!(" Camera “{camera}”.") };
    let mut plates = vec![Plate {
        title: "As the eye sees it".to_owned(),
        note: format!("Luminance, tone-mapped at an exposure of {ev}\u{a0}EV.{from}"),
        png: views::png(&view.picture, exposure)?,
        has_scale: false,
    }];
    if !report.illuminance.classes.is_empty() {
        plates.push(Plate {
            title: "Illuminance".to_owned(),
            note: "Light that arrives on each surface, lx; so a lamp itself may look dark.".to_owned(),
            png: views::false_colors(&view, &report.illuminance)?,
            has_scale: true,
        });
    }
    Ok(plates)
}

/// The result as an event, with the numbers as the report's file has them.
#[derive(serde::Serialize)]
struct ResultEvent<'a> {
    event: &'static str,
    report: &'a Report,
}

/// The last word: what was reached and where it is.
fn tell(report: &Report, delta_e: Option<f64>, global: &Global, progress: &Progress) -> Result<(), Failure> {
    progress.overtime().iter().for_each(|note| progress.say(note));
    if global.json {
        let event = ResultEvent { event: "result", report };
        return print(&serde_json::to_string(&event).map_err(Failure::work)?);
    }
    report.error.tell(progress);
    if let Some(asked) = delta_e {
        progress.say(&views::nearness(&report.solution.displayed, asked));
    }
    if let Some(map) = report.lightmap.as_ref().filter(|map| map.reduced_charts > 0) {
        progress.say(&format!(
            "warning: {} not fit on a page at {:.1} texels per metre; --max-atlas allows larger pages",
            counted(map.reduced_charts, "chart does", "charts do"),
            map.density
        ));
    }
    let (solution, light) = (&report.solution, &report.illuminance);
    let memory = report.peak_memory_mb.map_or(String::new(), |mb| format!(", {mb:.0} MB"));
    progress.say(&format!(
        "{} elements in {} cells x {} rays, {:.1} s{memory}; illuminance of the lit area: mean {} lx, 95 % of it above {}, brightest {}",
        solution.elements,
        solution.cells,
        solution.rays_per_cell,
        report.time.seconds,
        numbers::level(light.mean),
        numbers::level(light.low),
        numbers::level(light.largest),
    ));
    for output in &report.outputs {
        progress.say(&format!("wrote {output}"));
    }
    Ok(())
}
