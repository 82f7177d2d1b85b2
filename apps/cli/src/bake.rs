//! `radiosity bake`: solve, write the lit model, a picture, a report.

use crate::input::{self, Input, PictureArguments, SceneArguments, SolveArguments};
use crate::progress::Progress;
use crate::report::{LightmapReport, Report, peak_memory_mb};
use crate::{Failure, Global, html, output};
use clap::{Args, ValueEnum};
use radiosity::io::gltf_out::{Encoding, PageImage, Style, write_lit};
use radiosity::io::image_out::{encode_exr, encode_png};
use radiosity::view::picture::srgb;
use radiosity::{Baked, Lightmap, Mesh, Picture, RenderOptions, Tracer, luminance};
use std::path::{Path, PathBuf};

/// Arguments of `bake`.
#[derive(Args, Clone, Debug)]
pub struct Arguments {
    #[command(flatten)]
    scene: SceneArguments,
    #[command(flatten)]
    solve: SolveArguments,
    /// The lit model; SCENE-lit.glb in the current folder by default.
    #[arg(short, long, value_name = "OUT.glb")]
    output: Option<PathBuf>,
    /// Texels per metre of the lightmap; about 200 000 texels in all by default.
    #[arg(long, value_name = "N", conflicts_with_all = ["vertices", "unlit"])]
    texels_per_metre: Option<f64>,
    /// Largest width and height of a lightmap page.
    #[arg(long, default_value_t = 4096, value_parser = clap::value_parser!(u32).range(16..=16384))]
    max_atlas: u32,
    /// How texels are stored: sRGB, or linear for older readers.
    #[arg(long, value_enum, default_value_t = TexelEncoding::Srgb)]
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

/// Runs the verb.
pub fn run(arguments: &Arguments, global: &Global, progress: &Progress) -> Result<(), Failure> {
    let target = output_path(arguments);
    output::check(&target, &["glb"])?;
    for path in &arguments.report {
        output::check(path, &["json", "html"])?;
    }
    if let Some(path) = &arguments.image {
        output::check(path, &["png", "exr"])?;
    }
    if let Some(density) = arguments.texels_per_metre
        && !(density.is_finite() && density > 0.0)
    {
        return Err(Failure::input("--texels-per-metre: use a number above 0"));
    }
    let input = input::load(&arguments.scene, global, progress)?;
    let mesh = Mesh::new(&input.scene);
    let tracer = Tracer::new(&input.scene, &mesh);
    let camera = output::camera(&input.scene, &tracer, arguments.picture.camera.as_deref())?;

    let baked = radiosity::bake(&tracer, &arguments.solve.bake(), progress)?;
    let mut outputs = Vec::new();

    // Pictures first: their exposure serves the unlit model as well.
    let wants_picture = arguments.image.is_some() || !arguments.report.is_empty() || arguments.unlit;
    let picture = if wants_picture {
        let (width, height) = output::picture_size(&camera, arguments.picture.size);
        let render = RenderOptions { width, height, ..RenderOptions::default() };
        Some(radiosity::render(&baked.solution, &baked.field, &camera, &render, progress)?)
    } else {
        None
    };

    let mut lightmap_report = None;
    if arguments.vertices || arguments.unlit {
        let primitives = radiosity::vertex_light(&baked, progress)?;
        let style = if arguments.vertices {
            Style::Vertices
        } else {
            let exposure = arguments.picture.exposure.or(picture.as_ref().map(Picture::exposure)).unwrap_or(0.0);
            Style::Unlit { exposure: exposure.exp2() as f32 }
        };
        write_lit(&input.scene, input.document.as_ref(), &primitives, &style, &target).map_err(Failure::work)?;
    } else {
        let map = radiosity::lightmap(&baked, arguments.texels_per_metre, arguments.max_atlas, progress)?;
        let encoding = match arguments.lightmap_encoding {
            TexelEncoding::Srgb => Encoding::Srgb,
            TexelEncoding::Linear => Encoding::Linear,
        };
        let mut pages = Vec::new();
        for (page, (size, texels)) in map.pages.iter().zip(&map.irradiance).enumerate() {
            pages.push(page_image(*size, texels, encoding)?);
            let beside = target.with_extension(format!("lightmap{page}.exr"));
            output::write(&beside, &encode_exr(size[0], size[1], texels).map_err(Failure::work)?)?;
            outputs.push(beside.display().to_string());
        }
        let style = Style::Lightmap { pages, encoding, exposure: 1.0 };
        write_lit(&input.scene, input.document.as_ref(), &map.primitives, &style, &target).map_err(Failure::work)?;
        lightmap_report = Some(account(&map));
    }
    outputs.insert(0, target.display().to_string());

    if let (Some(path), Some(picture)) = (&arguments.image, &picture) {
        output::write_picture(path, picture, arguments.picture.exposure)?;
        outputs.push(path.display().to_string());
    }
    outputs.extend(arguments.report.iter().map(|p| p.display().to_string()));
    let report = report(&input, &mesh, arguments, &baked, lightmap_report, outputs, progress);
    for path in &arguments.report {
        write_report(path, &report, picture.as_ref(), arguments.picture.exposure)?;
    }
    tell(&report, global, progress);
    Ok(())
}

fn output_path(arguments: &Arguments) -> PathBuf {
    arguments.output.clone().unwrap_or_else(|| {
        let stem = arguments.scene.scene.as_ref().and_then(|p| p.file_stem());
        let stem = stem.map_or("cornell-box".to_owned(), |s| s.to_string_lossy().into_owned());
        PathBuf::from(format!("{stem}-lit.glb"))
    })
}

/// A page as 8-bit PNG, scaled by its maximum.
fn page_image(size: [u32; 2], texels: &[radiosity::Bands], encoding: Encoding) -> Result<PageImage, Failure> {
    let peak = texels.iter().flatten().fold(0f32, |m, x| m.max(*x));
    let intensity = if peak > 0.0 { peak } else { 1.0 };
    let encode = |x: f32| {
        let share = (x / intensity).clamp(0.0, 1.0);
        let coded = if encoding == Encoding::Srgb { srgb(share) } else { share };
        (coded * 255.0).round() as u8
    };
    let pixels: Vec<[u8; 3]> = texels.iter().map(|t| t.map(encode)).collect();
    Ok(PageImage { png: encode_png(size[0], size[1], &pixels).map_err(Failure::work)?, intensity })
}

fn account(map: &Lightmap) -> LightmapReport {
    LightmapReport {
        density: map.density,
        texels: map.texels,
        pages: map.pages.clone(),
        seams_before: map.seams[0],
        seams_after: map.seams[1],
    }
}

fn report(
    input: &Input,
    mesh: &Mesh,
    arguments: &Arguments,
    baked: &Baked,
    lightmap: Option<LightmapReport>,
    outputs: Vec<String>,
    progress: &Progress,
) -> Report {
    let solution = &baked.solution;
    let exposed = solution.exposed_area();
    let lux: Vec<f32> = solution.irradiance().iter().map(|e| luminance(*e)).collect();
    let visible = || lux.iter().zip(&exposed).filter(|(_, a)| **a > 0.0);
    let area: f64 = exposed.iter().sum();
    let mean = visible().map(|(e, a)| f64::from(*e) * a).sum::<f64>() / area.max(f64::MIN_POSITIVE);
    let least = visible().map(|(e, _)| *e).fold(f32::INFINITY, f32::min);
    let most = visible().map(|(e, _)| *e).fold(0f32, f32::max);
    Report {
        program: format!("radiosity {}", env!("CARGO_PKG_VERSION")),
        scene: input.title.clone(),
        triangles: input.scene.triangles.len(),
        materials: input.scene.materials.len(),
        lights: solution.luminaires.lights.iter().map(|l| l.name().to_owned()).collect(),
        area: (0..mesh.triangles.len()).map(|t| mesh.area(t)).sum(),
        asked_error: arguments.solve.error,
        achieved: baked.achieved,
        audit: baked.audit.clone(),
        rounds: baked.rounds.clone(),
        elements: solution.elements.len(),
        element_size: solution.element_size,
        buried: [solution.exposure.buried, solution.exposure.partial],
        rays_per_element: solution.rays(),
        raw_closure: solution.raw_closure(),
        solver: solution.info.clone(),
        balance: solution.balance(),
        illuminance: [least, mean as f32, most],
        stages: baked.stages.all(),
        seconds: progress.seconds(),
        threads: rayon::current_num_threads(),
        peak_memory_mb: peak_memory_mb(),
        outputs,
        lightmap,
        faults: input.faults.clone(),
    }
}

fn write_report(path: &Path, report: &Report, picture: Option<&Picture>, exposure: Option<f64>) -> Result<(), Failure> {
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("json")) {
        let text = serde_json::to_string_pretty(report).map_err(Failure::work)?;
        return output::write(path, text.as_bytes());
    }
    let mut pictures = Vec::new();
    if let Some(picture) = picture {
        pictures.push((report.scene.clone(), output::png(picture, exposure)?));
    }
    output::write(path, html::page(report, &pictures).as_bytes())
}

/// The last word: what was reached and where it is.
fn tell(report: &Report, global: &Global, progress: &Progress) {
    if global.json {
        println!("{}", serde_json::json!({ "event": "result", "report": report }));
        return;
    }
    let verdict = if report.achieved { "reached" } else { "NOT reached" };
    progress.say(&format!(
        "error asked {:.3} %: {verdict}; audit says {:.3} %, at most {:.3} % (95 %)",
        100.0 * report.asked_error,
        100.0 * report.audit.error,
        100.0 * report.audit.upper,
    ));
    progress.say(&format!(
        "{} elements x {} rays, {:.1} s, {:.0} MB; illuminance {:.4} / {:.4} / {:.4} lx (min / mean / max)",
        report.elements,
        report.rays_per_element,
        report.seconds,
        report.peak_memory_mb,
        report.illuminance[0],
        report.illuminance[1],
        report.illuminance[2],
    ));
    for output in &report.outputs {
        progress.say(&format!("wrote {output}"));
    }
}
