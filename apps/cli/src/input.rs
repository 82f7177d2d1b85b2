//! The scene and how to solve it, as the command line says.

use crate::progress::Progress;
use crate::{Failure, Global, faults, numbers};
use clap::Args;
use radiosity::io::{Document, LoadOptions};
use radiosity::solve::Solver;
use radiosity::transport::FormFactorMethod;
use radiosity::{
    Displayed, ELEMENT_BYTES, Faults, Mesh, Scene, Severity, Sky, TEXEL_BYTES, Up, counted, least_memory, size,
};
use std::f64::consts::SQRT_2;
use std::path::{Path, PathBuf};

/// The scene and how to read it.
#[derive(Args, Clone, Debug)]
pub struct SceneArguments {
    /// .glb, .gltf or .obj; the built-in Cornell box if left out.
    pub scene: Option<PathBuf>,
    /// Length of one unit of an OBJ: m (the default), cm, mm, in, ft, or a number of metres.
    #[arg(long, value_name = "UNIT", allow_negative_numbers = true, value_parser = numbers::unit)]
    pub unit: Option<f64>,
    /// Zenith direction: y (glTF's, the default) or z.
    #[arg(long, value_name = "AXIS", value_parser = numbers::up)]
    pub up: Option<Up>,
    /// Faces of an OBJ reflect on both sides.
    #[arg(long)]
    pub obj_double_sided: bool,
    /// What escaping rays see: uniform:L (cd/m²), overcast:E (CIE overcast sky of horizontal illuminance E lx;
    /// as the CIE has it, it ends at the horizon, and pictures are black below), or hdr:FILE (equirectangular .hdr or .exr
    /// in cd/m²).
    #[arg(long, value_name = "SKY")]
    pub sky: Option<String>,
}

impl SceneArguments {
    /// The files that are named here.
    pub fn files(&self) -> Vec<&Path> {
        let sky = self.sky.as_deref().and_then(|sky| sky.strip_prefix("hdr:")).map(Path::new);
        self.scene.as_deref().into_iter().chain(sky).collect()
    }

    fn is_obj(&self) -> bool {
        self.scene.as_ref().and_then(|path| path.extension()).is_some_and(|e| e.eq_ignore_ascii_case("obj"))
    }

    /// Whether neither the format nor the call says which way is up.
    pub fn is_up_unknown(&self) -> bool {
        self.is_obj() && self.up.is_none()
    }

    /// A call that means something else than it does is not carried out.
    fn refuse_what_has_no_effect(&self) -> Result<(), Failure> {
        let named = [("--unit", self.unit.is_some()), ("--obj-double-sided", self.obj_double_sided)];
        if let Some((option, _)) = named.iter().find(|(_, given)| *given && !self.is_obj()) {
            let why = match *option {
                "--unit" => "lengths of a glTF and of the built-in scene are metres",
                _ => "a glTF says by its materials what is two-sided",
            };
            return Err(Failure::input(format!("{option} is for .obj files: {why}")));
        }
        if self.scene.is_none() && self.up.is_some() {
            return Err(Failure::input("--up is for scenes from files: the built-in one stands as it is"));
        }
        Ok(())
    }
}

/// A method for form factors; none for rays.
#[derive(Clone, Copy, Debug)]
pub struct FormFactors(pub Option<FormFactorMethod>);

/// How to solve.
#[derive(Args, Clone, Debug)]
pub struct SolveArguments {
    /// Relative error of irradiance to reach, e.g. 1% or 0.01.
    #[arg(long, default_value = "1%", value_name = "PERCENT", allow_hyphen_values = true, value_parser = numbers::error)]
    pub error: f64,
    /// Width of all elements in metres, instead of letting the program choose.
    #[arg(long, value_name = "M", allow_negative_numbers = true, value_parser = numbers::positive)]
    pub element_size: Option<f64>,
    /// Memory for the scene and all that is worked out, e.g. 4G or 500M, also written 4GiB or 500MB; powers of 1024. What does not
    /// fit is told before it is taken; rays that it does not hold lie in a temporary file, in the folder that TMPDIR (TMP on Windows) names.
    #[arg(long, default_value = "4G", value_name = "BYTES", allow_hyphen_values = true, value_parser = numbers::bytes)]
    pub memory: usize,
    /// How light between elements is found: rays, the default, or one of adaptive, hemicube, hemicube-midpoint, single-plane,
    /// single-plane-adaptive, cubic-tetrahedron, global-cube, hemisphere, point, disc, lambert, nusselt, contour, exact,
    /// cubature, malley, area-samples, global-lines; hemicube-gpu in builds with the feature `gpu`. These fill a matrix that
    /// grows with the square of the elements, two thousand if no --element-size is given. Of them `contour` and `exact` do not see what stands between elements: light goes through
    /// furniture. Light of lamps and sky is found the same way in either case.
    #[arg(long = "ff", value_name = "NAME", default_value = "rays", hide_default_value = true, value_parser = numbers::form_factors)]
    pub form_factors: FormFactors,
    /// Solver: deflated-jacobi, the default, or one of jacobi, neumann, cg, bicgstab, gmres, gauss-seidel, sor, southwell,
    /// progressive, shooting-cyclic, shooting-ambient, overshooting, lu, cholesky, random-walk, stochastic-jacobi. cg,
    /// cholesky, random-walk and stochastic-jacobi need `--ff adaptive`; lu and cholesky fill matrices, as --ff does.
    #[arg(long, value_name = "NAME", default_value_t = Solver::DeflatedJacobi, hide_default_value = true)]
    pub solver: Solver,
    /// Solve until what is displayed is known to be within this ΔE*ab of the solution, on every surface (2.3 is just
    /// noticed), instead of to a residual of 1e-4. It tells of the solver alone; --error of all the rest too.
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = numbers::delta_e)]
    pub delta_e: Option<f64>,
    /// When the answer is to be there, such as 30s or 5min since the start: refinement leaves time for pictures, texels and audits, which
    /// have as many rays as there is time for, and the error tells what came of it. Only the least takes longer: a first solution, and
    /// one pass of few rays. The answer depends on the machine then. [also: --budget]
    #[arg(long, alias = "budget", value_name = "TIME", allow_hyphen_values = true, value_parser = numbers::seconds)]
    pub time: Option<f64>,
    /// Most rounds of refinement.
    #[arg(long, default_value_t = 5, value_name = "N", allow_negative_numbers = true)]
    pub rounds: usize,
    /// Seed of the audit; other seeds examine other points.
    #[arg(long, default_value_t = 1, value_name = "N", allow_negative_numbers = true)]
    pub seed: u64,
}

impl SolveArguments {
    /// As the library takes them.
    pub fn options(&self) -> radiosity::SolveOptions {
        radiosity::SolveOptions {
            element_size: self.element_size,
            memory: self.memory,
            form_factors: self.form_factors.0,
            displayed: self.delta_e.map(|delta_e| Displayed { delta_e, exposure: None }),
            ..radiosity::SolveOptions::of(self.solver)
        }
    }

    /// Tells of methods that do less than the usual ones.
    pub fn warn_of_methods(&self, progress: &Progress) {
        if let Some(method) = self.form_factors.0.filter(|method| !method.sees_occlusion()) {
            progress.say(&format!(
                "warning: {method} does not see what stands between surfaces; where anything does, light that is reflected \
                 passes through it, and no rays or elements mend that (--ff adaptive sees it)"
            ));
        }
        let (own, usual) = (self.options().params.tolerance, radiosity::SolveOptions::default().params.tolerance);
        if own > usual && self.delta_e.is_none() {
            progress.say(&format!(
                "note: {} is asked for a relative residual of {own}, not {usual} as others are: its noise falls with the \
                 root of the work",
                self.solver
            ));
        }
    }

    /// Refuses elements that the memory would not hold if they were as small as asked. Triangles are cut into some thousand
    /// at most, which may take long and is not what was asked for either.
    pub fn refuse_tiny_elements(&self, mesh: &Mesh) -> Result<(), Failure> {
        let Some(size) = self.element_size else { return Ok(()) };
        self.refuse_beyond_memory(mesh, "--element-size", "elements", ELEMENT_BYTES, 0.5 * size * size, |width| {
            format!("{} or more", numbers::rough(width * SQRT_2))
        })
    }

    /// Refuses texels that the memory would not hold, before there is light to put into them.
    pub fn refuse_tiny_texels(&self, mesh: &Mesh, density: f64) -> Result<(), Failure> {
        self.refuse_beyond_memory(
            mesh,
            "--texels-per-metre",
            "texels",
            TEXEL_BYTES,
            (density * density).recip(),
            |width| format!("{} or less", numbers::rough(width.recip())),
        )
    }

    /// Refuses to cut surfaces into more pieces, of an area and of bytes each, than the memory holds. `instead` is told the
    /// width of the smallest that fit.
    fn refuse_beyond_memory(
        &self,
        mesh: &Mesh,
        option: &str,
        pieces: &str,
        bytes: usize,
        piece: f64,
        instead: impl FnOnce(f64) -> String,
    ) -> Result<(), Failure> {
        let area = mesh.whole_area();
        let (bytes, allowed) = (bytes as f64, self.memory as f64);
        let (count, needed) = (area / piece, area / piece * bytes);
        if needed <= allowed {
            return Ok(());
        }
        // A tenth to spare, since the advice is rounded.
        let instead = instead(1.1 * (area * bytes / allowed).sqrt());
        Err(Failure::input(format!(
            "{option}: {count:.1e} {pieces} need {:.1e} MB at least; {} are allowed (use {instead}, or allow more by \
             --memory)",
            needed / f64::from(1 << 20),
            size(self.memory)
        )))
    }

    /// As the library takes them to light surfaces; what is displayed is judged at the exposure of the picture, if it is given.
    pub fn bake(&self, picture: &PictureArguments, after: radiosity::After) -> radiosity::BakeOptions {
        let default = radiosity::BakeOptions::default();
        let mut solve = self.options();
        if let Some(displayed) = &mut solve.displayed {
            displayed.exposure = picture.exposure;
        }
        radiosity::BakeOptions { error: self.error, solve, rounds: self.rounds, seed: self.seed, after, ..default }
    }

    /// As the library takes them to measure at points.
    pub fn measure(&self) -> radiosity::MeasureOptions {
        let default = radiosity::MeasureOptions::default();
        radiosity::MeasureOptions {
            error: self.error,
            solve: radiosity::SolveOptions {
                looked_up: default.solve.looked_up,
                cells: default.solve.cells,
                rays: default.solve.rays,
                ..self.options()
            },
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
    #[arg(long, value_name = "NAME|N")]
    pub camera: Option<String>,
    /// Place of the eye, metres in the scene's axes, instead of a camera of the scene.
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, requires = "target", conflicts_with = "camera",
        value_parser = numbers::point)]
    pub eye: Option<[f64; 3]>,
    /// Place that the eye looks at.
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, requires = "eye", value_parser = numbers::point)]
    pub target: Option<[f64; 3]>,
    /// Vertical angle of view; the camera's own by default, 50 from --eye.
    #[arg(long, value_name = "DEGREES", value_parser = numbers::angle)]
    pub fov: Option<f64>,
    /// Size; by the camera's aspect if left out.
    #[arg(long, value_parser = numbers::size, allow_hyphen_values = true, value_name = "WxH")]
    pub size: Option<(u32, u32)>,
    /// A folder for pictures on the way, frame-000.png and so on, a quarter as wide: the first within moments, of coarse elements
    /// before any ray goes between them, then one after each solve. They stay whatever becomes of the run.
    #[arg(long, value_name = "DIR")]
    pub frames: Option<PathBuf>,
    /// Exposure: log2 of the factor from cd/m² to display; chosen by itself if left out.
    #[arg(long, value_name = "EV", allow_hyphen_values = true, value_parser = numbers::exposure)]
    pub exposure: Option<f64>,
}

impl PictureArguments {
    /// Tells of options that nothing depends on: all of them where no picture is made, the exposure where none is exposed.
    pub fn warn_of_what_has_no_effect(&self, is_made: bool, is_exposed: bool, progress: &Progress) {
        let has_frames = self.frames.is_some();
        let given = [
            ("--camera", self.camera.is_some(), is_made || has_frames),
            ("--eye", self.eye.is_some(), is_made || has_frames),
            ("--fov", self.fov.is_some(), is_made || has_frames),
            ("--size", self.size.is_some(), is_made || has_frames),
            ("--exposure", self.exposure.is_some(), is_exposed || has_frames),
        ];
        for (option, ..) in given.iter().filter(|(_, given, acts)| *given && !acts) {
            let why = if is_made { "EXR holds cd/m² as they are" } else { "no picture is asked for" };
            progress.say(&format!("warning: {option} has no effect: {why}"));
        }
    }
}

/// A scene that has been read.
pub struct Input {
    /// The scene.
    pub scene: Scene,
    /// Its welded triangles.
    pub mesh: Mesh,
    /// Warnings and notes.
    pub faults: Faults,
    /// The glTF it came from.
    pub document: Option<Document>,
    /// The files beside it that belong to it.
    pub files: Vec<PathBuf>,
    /// What to call it.
    pub title: String,
}

/// Reads the scene and its sky; all faults at once. What cannot be solved within some bytes is not welded.
pub fn load(arguments: &SceneArguments, memory: usize, global: &Global, progress: &Progress) -> Result<Input, Failure> {
    let parsed = parse(arguments)?;
    let (triangles, least) = (parsed.scene.triangles.len(), least_memory(&parsed.scene));
    if least > memory {
        return Err(Failure::input(format!(
            "{}: {} need {} MB at least, to be welded, seen by rays and solved; {} are allowed (allow more by --memory)",
            parsed.title,
            counted(triangles, "triangle", "triangles"),
            least.div_ceil(1 << 20),
            size(memory)
        )));
    }
    let input = parsed.examined();
    input.tell_faults(global, progress);
    Ok(input)
}

/// The same without telling anybody.
pub fn read(arguments: &SceneArguments) -> Result<Input, Failure> {
    Ok(parse(arguments)?.examined())
}

/// A scene as it was read: not yet welded, its faults not yet looked for but by the reader.
pub struct Parsed {
    /// The scene.
    pub scene: Scene,
    faults: Faults,
    document: Option<Document>,
    files: Vec<PathBuf>,
    title: String,
}

impl Parsed {
    /// Welds it and finds its faults.
    pub fn examined(self) -> Input {
        let Parsed { scene, mut faults, document, files, title } = self;
        let mesh = Mesh::new(&scene);
        faults::find(&scene, &mesh, &title, &mut faults);
        Input { scene, mesh, faults, document, files, title }
    }
}

impl Input {
    /// Tells the user what is wrong.
    pub fn tell_faults(&self, global: &Global, progress: &Progress) {
        for fault in &self.faults.0 {
            if fault.severity > Severity::Note || global.verbose {
                progress.say(&fault.to_string());
            }
        }
    }
}

/// Reads a scene.
pub fn parse(arguments: &SceneArguments) -> Result<Parsed, Failure> {
    arguments.refuse_what_has_no_effect()?;
    let (mut scene, faults, document, files, title) = match &arguments.scene {
        None => (radiosity::cornell_box(), Faults::default(), None, Vec::new(), "built-in Cornell box".to_owned()),
        Some(path) => {
            let options = LoadOptions {
                metres_per_unit: arguments.unit.unwrap_or(1.0),
                up: arguments.up,
                obj_double_sided: arguments.obj_double_sided,
                ..LoadOptions::default()
            };
            let loaded = radiosity::io::load(path, &options)?;
            (loaded.scene, loaded.faults, loaded.document, loaded.files, path.display().to_string())
        }
    };
    if let Some(sky) = &arguments.sky {
        set_sky(&mut scene, sky)?;
    }
    Ok(Parsed { scene, faults, document, files, title })
}

fn set_sky(scene: &mut Scene, text: &str) -> Result<(), Failure> {
    let wrong =
        || Failure::input(format!("--sky {text}: use uniform:L or overcast:E, with a number from 0 on, or hdr:FILE"));
    let (kind, value) = text.split_once(':').ok_or_else(wrong)?;
    let number = || value.parse::<f32>().ok().filter(|x| x.is_finite() && *x >= 0.0).ok_or_else(wrong);
    match kind {
        "uniform" => scene.sky = Sky::Uniform([number()?; 3]),
        "overcast" => scene.sky = Sky::Overcast { horizontal: [number()?; 3] },
        "hdr" => radiosity::io::load_sky_hdr(Path::new(value), scene)?,
        _ => return Err(wrong()),
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn skies_as_people_write_them() {
        let mut scene = Scene::default();
        for wrong in ["uniform:nan", "green", "hdr:"] {
            assert!(set_sky(&mut scene, wrong).is_err());
        }
        set_sky(&mut scene, "overcast:5000").unwrap();
        assert_eq!(scene.sky, Sky::Overcast { horizontal: [5000.0; 3] });
    }
}
