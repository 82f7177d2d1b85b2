//! Views of a solution: from where, how large, and of what — the luminance that an eye sees, the illuminance that a
//! meter on the surface would show.

use crate::illuminance::Illuminance;
use crate::input::{PictureArguments, SceneArguments};
use crate::progress::Progress;
use crate::{Failure, numbers};
use glam::DVec3;
use radiosity::io::image_out::{encode_exr, encode_png};
use radiosity::{Camera, Picture, Projection, Scene, Shown, Sky, Tracer, View};
use std::path::Path;

/// Pictures in a report are made smaller than this, pixels: a page should open at once, and screens show no more.
const PAGE_SIDE: u32 = 2048;

/// Pixels without a surface in a false-colour picture: a grey that is none of the scale's colours.
const VOID: [u8; 3] = [118, 122, 128];

/// The view for a page: as it is, or every n-th pixel's block as one.
pub fn for_page(view: &View) -> View {
    let picture = &view.picture;
    let n = picture.width.max(picture.height).div_ceil(PAGE_SIDE).max(1);
    let (width, height) = (picture.width / n, picture.height / n);
    if n == 1 || width == 0 || height == 0 {
        return view.clone();
    }
    let mut small = Picture { width, height, pixels: Vec::new(), surfaces: Vec::new(), parts: Vec::new() };
    let mut illuminance = Vec::new();
    for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y, x))) {
        let block = (0..n * n).map(|i| ((y * n + i / n) * picture.width + x * n + i % n) as usize);
        let mut mean = [0f32; 3];
        block.clone().for_each(|i| (0..3).for_each(|band| mean[band] += picture.pixels[i][band] / (n * n) as f32));
        small.pixels.push(mean);
        small.surfaces.push(block.clone().any(|i| picture.surfaces[i]));
        illuminance.extend(block.clone().map(|i| view.illuminance[i]).nth((n * n / 2) as usize));
    }
    View { picture: small, illuminance, watched: Vec::new(), is_hurried: view.is_hurried }
}

/// Illuminance in the colours of its classes, PNG.
pub fn false_colors(view: &View, scale: &Illuminance) -> Result<Vec<u8>, Failure> {
    let color = |lux: &f32| scale.class(f64::from(*lux)).map_or(VOID, |class| scale.classes[class].color);
    let pixels: Vec<[u8; 3]> = view.illuminance.iter().map(color).collect();
    encode_png(view.picture.width, view.picture.height, &pixels).map_err(Failure::work)
}

/// Tone-mapped PNG bytes.
pub fn png(picture: &Picture, exposure: f64) -> Result<Vec<u8>, Failure> {
    encode_png(picture.width, picture.height, &picture.tone_mapped(exposure)).map_err(Failure::work)
}

/// Tells why a picture is black where nothing stands, if a part of it is.
pub fn explain_black(picture: &Picture, scene: &Scene, progress: &Progress) {
    let pixels = picture.pixels.iter().zip(&picture.surfaces);
    let black = pixels.filter(|(pixel, is_surface)| !**is_surface && **pixel == [0.0; 3]).count();
    if matches!(scene.sky, Sky::Overcast { .. }) && black > picture.pixels.len() / 20 {
        progress
            .say("note: the overcast sky ends at the horizon, and the picture is black below; a ground would be lit");
    }
}

/// ΔE of white from black: a bound above it says nothing.
const WHITE: f64 = 100.0;

/// What is asked for at one exposure is a little more or less at another that is as good.
const ROUNDED: f64 = 1.05;

/// How near to the solution of its equation what is displayed is known to be, and whether that is as asked: the exposure of
/// a picture is known after the solve.
pub fn nearness(shown: &Shown, asked: f64) -> String {
    let (delta_e, exposure) = (numbers::rough(shown.delta_e), numbers::fixed(shown.exposure, 2));
    if shown.delta_e <= ROUNDED * asked {
        return format!("what is displayed is within ΔE {delta_e} of the solution of its equation");
    }
    match shown.delta_e > WHITE {
        true => "warning: the solver ended too early to know how near what is displayed is to the solution".to_owned(),
        false => format!(
            "warning: at the exposure of this picture, {exposure} EV, what is displayed is known to be within ΔE {delta_e} \
             of the solution, not {asked}; --exposure {exposure} has it solved for this picture"
        ),
    }
}

/// Whether a picture is to hold luminances as they are.
pub fn is_exr(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr"))
}

/// The bytes of a picture as its name's ending says.
pub fn encode(path: &Path, picture: &Picture, exposure: f64) -> Result<Vec<u8>, Failure> {
    if is_exr(path) {
        encode_exr(picture.width, picture.height, &picture.pixels).map_err(Failure::work)
    } else {
        png(picture, exposure)
    }
}

/// Vertical angle of view of `--eye`, degrees, where none is given: wide enough for rooms, without stretched corners.
const FOV: f64 = 50.0;

/// The camera that was asked for by its places, name or number, else the first, else one that is placed well, of which is said where it
/// stands; with the angle of view that was asked for.
pub fn camera(
    scene: &Scene,
    tracer: &Tracer,
    asked: &PictureArguments,
    source: &SceneArguments,
    progress: &Progress,
) -> Result<Camera, Failure> {
    let (mut camera, is_placed) = match (asked.eye.zip(asked.target), &asked.camera, scene.cameras.first()) {
        (Some((eye, target)), ..) if eye == target => {
            return Err(Failure::input("--eye and --target are the same place; the eye must look somewhere"));
        }
        (Some((eye, target)), ..) => {
            (Camera::look_at("eye", eye.into(), target.into(), scene.up.direction(), FOV.to_radians()), false)
        }
        (None, Some(wanted), _) => (named(scene, wanted)?, false),
        (None, None, Some(first)) => (first.clone(), false),
        (None, None, None) => {
            let aspect = asked.size.map(|(width, height)| f64::from(width) / f64::from(height));
            (radiosity::place_camera(tracer, aspect), true)
        }
    };
    if let Some(fov) = asked.fov {
        let Projection::Perspective { vertical_fov } = &mut camera.projection else {
            let name = &camera.name;
            return Err(Failure::input(format!(
                "--fov {fov}: the camera '{name}' projects in parallel and has no angle"
            )));
        };
        *vertical_fov = fov.to_radians();
    }
    if is_placed {
        progress.say(&format!("note: the camera placed for this scene is {}", in_words(&camera, scene, asked.size)));
        if source.is_up_unknown() {
            progress.say("note: y is taken to point up, as an OBJ does not say; where it is z: --up z");
        }
    }
    Ok(camera)
}

/// Where light that is written will be looked at from, as far as that is known: from the scene's cameras and the eye that is asked for,
/// else from where a camera would be placed, whether or not a picture is wanted.
pub fn eyes(scene: &Scene, tracer: &Tracer, asked: &PictureArguments) -> Vec<DVec3> {
    let asked = asked.eye.map(DVec3::from);
    let mut eyes: Vec<DVec3> = scene.cameras.iter().map(Camera::position).chain(asked).collect();
    if eyes.is_empty() {
        eyes.push(radiosity::place_camera(tracer, None).position());
    }
    eyes
}

/// The options that put a camera where one is, to a tenth of a per mille of the scene's size.
fn in_words(camera: &Camera, scene: &Scene, size: Option<(u32, u32)>) -> String {
    let extent = scene.bounding_box().map_or(0.0, |[low, high]| (high - low).max_element());
    let extent = if extent > 0.0 { extent } else { 1.0 };
    let decimals = (4.0 - extent.log10()).ceil().clamp(0.0, 20.0) as usize;
    let words = |p: DVec3| p.to_array().map(|x| numbers::fixed(x, decimals)).join(",");
    let eye = camera.position();
    let target = eye - extent * camera.world_from_camera.z_axis.truncate();
    let (width, height) = picture_size(camera, size);
    let fov = match camera.projection {
        Projection::Perspective { vertical_fov } => format!(" --fov {}", numbers::fixed(vertical_fov.to_degrees(), 2)),
        Projection::Orthographic { .. } => String::new(),
    };
    format!("--eye {} --target {}{fov} --size {width}x{height}", words(eye), words(target))
}

/// The camera of a name or number.
fn named(scene: &Scene, wanted: &str) -> Result<Camera, Failure> {
    let by_name = scene.cameras.iter().find(|c| c.name == wanted);
    let by_number = wanted.parse::<usize>().ok().and_then(|n| scene.cameras.get(n));
    by_name.or(by_number).cloned().ok_or_else(|| {
        let names: Vec<String> = scene.cameras.iter().enumerate().map(|(i, c)| format!("{i} = '{}'", c.name)).collect();
        let there = match names.is_empty() {
            true => "it has none; --eye and --target place one".to_owned(),
            false => format!("its cameras: {}", names.join(", ")),
        };
        Failure::input(format!("--camera {wanted}: the scene has no such camera; {there}"))
    })
}

/// Width and height for a camera: as asked, else as many pixels as 1280 × 720 by its aspect.
pub fn picture_size(camera: &Camera, asked: Option<(u32, u32)>) -> (u32, u32) {
    asked.unwrap_or_else(|| match camera.aspect {
        Some(aspect) if aspect.is_finite() && aspect > 0.0 => {
            let height = (1280.0 * 720.0 / aspect).sqrt().clamp(16.0, 4096.0);
            ((height * aspect).round().clamp(16.0, 8192.0) as u32, height.round() as u32)
        }
        _ => (1280, 720),
    })
}
