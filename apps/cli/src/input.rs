//! The scene on the command line, and the numbers people write.

use crate::progress::Progress;
use crate::{Failure, Global};
use clap::Args;
use radiosity::io::{Document, LoadError, LoadOptions};
use radiosity::{Faults, Scene, Severity, Sky, Up};
use std::path::{Path, PathBuf};

/// The scene and how to read it.
#[derive(Args, Clone, Debug)]
pub struct SceneArguments {
    /// .glb, .gltf or .obj; the built-in Cornell box if left out.
    pub scene: Option<PathBuf>,
    /// Length of one unit of an OBJ: m, cm, mm, in, ft, or a number of metres.
    #[arg(long, default_value = "m", value_parser = unit)]
    pub unit: f64,
    /// Zenith direction: y (glTF's, the default) or z.
    #[arg(long, value_parser = up)]
    pub up: Option<Up>,
    /// Faces of an OBJ reflect on both sides.
    #[arg(long)]
    pub obj_double_sided: bool,
    /// What escaping rays see: uniform:L (cd/m²), overcast:E (CIE overcast sky of horizontal illuminance E lx), or
    /// hdr:FILE (equirectangular .hdr or .exr in cd/m²).
    #[arg(long, value_name = "SKY")]
    pub sky: Option<String>,
}

/// How to solve.
#[derive(Args, Clone, Debug)]
pub struct SolveArguments {
    /// Relative error of irradiance to reach, e.g. 1% or 0.01.
    #[arg(long, default_value = "1%", value_parser = percent)]
    pub error: f64,
    /// Width of an element in metres, instead of letting the program choose.
    #[arg(long, value_name = "M", value_parser = positive)]
    pub element_size: Option<f64>,
    /// Memory for the table of hit ids, e.g. 4G or 500M.
    #[arg(long, default_value = "4G", value_parser = bytes)]
    pub memory: usize,
    /// Most rounds of refinement.
    #[arg(long, default_value_t = 5)]
    pub rounds: usize,
    /// Seed of the audit; other seeds examine other points.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
}

impl SolveArguments {
    /// As the library takes them.
    pub fn options(&self) -> radiosity::SolveOptions {
        let default = radiosity::SolveOptions::default();
        radiosity::SolveOptions { element_size: self.element_size, memory: self.memory, ..default }
    }

    /// As the library takes them to light surfaces.
    pub fn bake(&self) -> radiosity::BakeOptions {
        let default = radiosity::BakeOptions::default();
        radiosity::BakeOptions {
            error: self.error,
            solve: self.options(),
            rounds: self.rounds,
            seed: self.seed,
            ..default
        }
    }
}

/// How to take a picture.
#[derive(Args, Clone, Debug)]
pub struct PictureArguments {
    /// Camera, by name or number; the first, or one placed by the program, by default.
    #[arg(long)]
    pub camera: Option<String>,
    /// Size; by the camera's aspect if left out.
    #[arg(long, value_parser = size, value_name = "WxH")]
    pub size: Option<(u32, u32)>,
    /// Exposure: log2 of the factor from cd/m² to display; chosen by itself if left out.
    #[arg(long, value_name = "EV", allow_hyphen_values = true)]
    pub exposure: Option<f64>,
}

/// A scene that has been read.
pub struct Input {
    /// The scene.
    pub scene: Scene,
    /// Warnings and notes.
    pub faults: Faults,
    /// The glTF it came from.
    pub document: Option<Document>,
    /// What to call it.
    pub title: String,
}

/// Reads the scene and its sky; all faults at once.
pub fn load(arguments: &SceneArguments, global: &Global, progress: &Progress) -> Result<Input, Failure> {
    let input = read(arguments)?;
    for fault in &input.faults.0 {
        if fault.severity > Severity::Note || global.verbose {
            progress.say(&fault.to_string());
        }
    }
    Ok(input)
}

/// The same without telling anybody.
pub fn read(arguments: &SceneArguments) -> Result<Input, Failure> {
    let sky = arguments.sky.as_deref().map(parse_sky).transpose()?;
    let mut input = match &arguments.scene {
        None => Input {
            scene: radiosity::cornell_box(),
            faults: Faults::default(),
            document: None,
            title: "built-in Cornell box".to_owned(),
        },
        Some(path) => {
            let options = LoadOptions {
                metres_per_unit: arguments.unit,
                up: arguments.up,
                obj_double_sided: arguments.obj_double_sided,
                ..LoadOptions::default()
            };
            let loaded = radiosity::io::load(path, &options).map_err(load_failure)?;
            Input {
                scene: loaded.scene,
                faults: loaded.faults,
                document: loaded.document,
                title: path.display().to_string(),
            }
        }
    };
    if let Some(sky) = sky {
        input.scene.sky = sky;
    }
    Ok(input)
}

/// All faults of an input that cannot be used, one to a line.
pub fn load_failure(error: LoadError) -> Failure {
    match error.faults() {
        Some(faults) => Failure::Input(faults.to_string()),
        None => Failure::input(error),
    }
}

fn parse_sky(text: &str) -> Result<Sky, Failure> {
    let wrong = || Failure::input(format!("--sky {text}: use uniform:L, overcast:E or hdr:FILE"));
    let (kind, value) = text.split_once(':').ok_or_else(wrong)?;
    let number = || value.parse::<f32>().ok().filter(|x| x.is_finite() && *x >= 0.0).ok_or_else(wrong);
    match kind {
        "uniform" => Ok(Sky::Uniform([number()?; 3])),
        "overcast" => Ok(Sky::Overcast { horizontal: [number()?; 3] }),
        "hdr" => radiosity::io::load_sky_hdr(Path::new(value)).map_err(load_failure),
        _ => Err(wrong()),
    }
}

fn unit(text: &str) -> Result<f64, String> {
    match text {
        "m" => Ok(1.0),
        "cm" => Ok(0.01),
        "mm" => Ok(0.001),
        "in" => Ok(0.0254),
        "ft" => Ok(0.3048),
        number => positive(number).map_err(|_| "use m, cm, mm, in, ft or a number of metres".to_owned()),
    }
}

fn up(text: &str) -> Result<Up, String> {
    match text.to_ascii_lowercase().as_str() {
        "y" => Ok(Up::Y),
        "z" => Ok(Up::Z),
        _ => Err("use y or z".to_owned()),
    }
}

fn positive(text: &str) -> Result<f64, String> {
    text.parse::<f64>().ok().filter(|x| x.is_finite() && *x > 0.0).ok_or_else(|| "use a number above 0".to_owned())
}

fn percent(text: &str) -> Result<f64, String> {
    let (number, scale) = match text.strip_suffix('%') {
        Some(number) => (number, 0.01),
        None => (text, 1.0),
    };
    positive(number.trim())
        .map(|x| x * scale)
        .ok()
        .filter(|x| (1e-4..=1.0).contains(x))
        .ok_or_else(|| "use a percentage from 0.01% to 100%".to_owned())
}

fn bytes(text: &str) -> Result<usize, String> {
    let wrong = || "use a size such as 500M or 4G".to_owned();
    let (number, scale) = match text.to_ascii_uppercase().trim_end_matches('B') {
        t if t.ends_with('G') => (t.trim_end_matches('G').to_owned(), 1u64 << 30),
        t if t.ends_with('M') => (t.trim_end_matches('M').to_owned(), 1 << 20),
        t if t.ends_with('K') => (t.trim_end_matches('K').to_owned(), 1 << 10),
        t => (t.to_owned(), 1),
    };
    let value = positive(&number).map_err(|_| wrong())? * scale as f64;
    if (1.0..=1e15).contains(&value) { Ok(value as usize) } else { Err(wrong()) }
}

/// Size of a picture, WIDTHxHEIGHT.
pub fn size(text: &str) -> Result<(u32, u32), String> {
    let wrong = || "use WIDTHxHEIGHT, e.g. 1280x720, each from 1 to 16384".to_owned();
    let (w, h) = text.split_once('x').ok_or_else(wrong)?;
    let side = |t: &str| t.parse::<u32>().ok().filter(|n| (1..=16384).contains(n)).ok_or_else(wrong);
    Ok((side(w)?, side(h)?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_as_people_write_them() {
        assert_eq!(percent("1%"), Ok(0.01));
        assert_eq!(percent("0.02"), Ok(0.02));
        assert!(percent("0").is_err() && percent("nan").is_err() && percent("-1%").is_err());
        assert_eq!(bytes("500M"), Ok(500 << 20));
        assert_eq!(bytes("4G"), Ok(4 << 30));
        assert!(bytes("lots").is_err());
        assert_eq!(size("1280x720"), Ok((1280, 720)));
        assert!(size("0x5").is_err() && size("5").is_err());
        assert_eq!(unit("mm"), Ok(0.001));
        assert!(unit("0").is_err());
        assert!(parse_sky("uniform:nan").is_err() && parse_sky("green").is_err());
        assert_eq!(parse_sky("overcast:5000").unwrap(), Sky::Overcast { horizontal: [5000.0; 3] });
    }
}
