//! `radiosity factors`: view factors between surfaces.

use crate::output::{Outputs, print};
use crate::progress::Progress;
use crate::{Failure, Global, numbers};
use clap::{Args, ValueEnum};
use radiosity::io::{FactorFormat, FactorRows, FactorTable, Grouping, LoadOptions, Vs3, enclosure_of, load_enclosure};
use radiosity::transport::{FormFactorMethod, FormFactors};
use radiosity::{Elements, Enclosure, Factors, FactorsOptions, Faults, Mesh, Severity, counted};
use serde_json::json;
use std::path::PathBuf;

/// Arguments of `factors`.
#[derive(Args, Clone, Debug)]
pub struct Arguments {
    /// .vs3 (View3D), .glb, .gltf or .obj; the built-in Cornell box if left out.
    scene: Option<PathBuf>,
    /// The matrix: .npz (NumPy; SciPy's CSR where most of it is zero), .mtx (MatrixMarket), .csv (N rows of N numbers, all
    /// digits, no header), .txt or .out (View3D's text). Standard output if left out and there are few surfaces.
    #[arg(short, long, value_name = "F.npz|.mtx|.csv|.txt")]
    output: Option<PathBuf>,
    /// How factors are found; `radiosity compare` shows them side by side. One of: adaptive (the default), hemicube,
    /// hemicube-midpoint, single-plane, cubic-tetrahedron, global-cube, hemisphere, point, disc, lambert, nusselt,
    /// contour, exact, cubature, malley, area-samples, global-lines.
    #[arg(long, value_name = "NAME", default_value_t = FormFactorMethod::Adaptive, hide_default_value = true)]
    method: FormFactorMethod,
    /// Which triangles of a .glb, .gltf or .obj are one surface. A .vs3 has its own.
    #[arg(long, value_enum, default_value_t = By::Object)]
    by: By,
    /// Width of elements in metres, for `--by element`.
    #[arg(long, value_name = "M", allow_negative_numbers = true, value_parser = numbers::positive)]
    element_size: Option<f64>,
    /// Largest error of a factor between facets that see each other partly (adaptive). What is not hidden at all is found to
    /// 1e-9.
    #[arg(long, value_name = "E", default_value_t = 1e-5, allow_negative_numbers = true, value_parser = numbers::positive)]
    accuracy: f64,
    /// Cells along a side of the surface that hemicube and its like project on.
    #[arg(long, value_name = "N", default_value_t = 256, value_parser = clap::value_parser!(u16).range(2..=4096))]
    resolution: u16,
    /// Make rows sum to one by moving uncertain factors, and no others.
    #[arg(long)]
    close: bool,
    /// Script-F instead: with all reflections by the emittances, which the .vs3 gives. A .vs3 with emit=1 asks for it itself.
    #[arg(long)]
    script_f: bool,
    /// Length of one unit of a .vs3 or .obj: m (the default), cm, mm, in, ft, or a number of metres.
    #[arg(long, value_name = "UNIT", allow_negative_numbers = true, value_parser = numbers::unit)]
    unit: Option<f64>,
    /// Memory for the factors, e.g. 4G or 500M; powers of 1024.
    #[arg(long, default_value = "4G", value_name = "BYTES", allow_hyphen_values = true, value_parser = numbers::bytes)]
    memory: usize,
}

/// What is one surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum By {
    /// All triangles of a material.
    Material,
    /// All triangles of an object.
    Object,
    /// Each triangle.
    Triangle,
    /// Each element of the mesh that light is solved on.
    Element,
}

/// Surfaces up to which the matrix is shown on standard output.
const SHOWN: usize = 20;

/// Share of entries that are not zero up to which a matrix is written as a sparse one, and surfaces from which on.
const SPARSE: (f64, usize) = (0.3, 1000);

struct Input {
    enclosure: Enclosure,
    vs3: Option<Vs3>,
    faults: Faults,
    title: String,
}

fn read(arguments: &Arguments) -> Result<Input, Failure> {
    let options = LoadOptions { metres_per_unit: arguments.unit.unwrap_or(1.0), ..LoadOptions::default() };
    let grouping = match arguments.by {
        By::Material => Grouping::Material,
        By::Object => Grouping::Object,
        By::Triangle | By::Element => Grouping::Triangle,
    };
    let ending = |ending: &str| {
        arguments.scene.as_ref().and_then(|s| s.extension()).is_some_and(|e| e.eq_ignore_ascii_case(ending))
    };
    if arguments.unit.is_some() && !ending("obj") && !ending("vs3") {
        return Err(Failure::input("--unit is for .obj and .vs3 files: lengths of others are metres"));
    }
    if arguments.element_size.is_some() && arguments.by != By::Element {
        return Err(Failure::input("--element-size is for --by element"));
    }
    let title = arguments.scene.as_ref().map_or("built-in Cornell box".to_owned(), |s| s.display().to_string());
    if arguments.by == By::Element || arguments.scene.is_none() {
        if ending("vs3") {
            return Err(Failure::input("--by element is for scenes: a .vs3 has its own surfaces"));
        }
        let (scene, mut faults) = match &arguments.scene {
            None => (radiosity::cornell_box(), Faults::default()),
            Some(path) => {
                let loaded = radiosity::io::load(path, &options)?;
                (loaded.scene, loaded.faults)
            }
        };
        let enclosure = if arguments.by == By::Element {
            let Some(size) = arguments.element_size else {
                return Err(Failure::input("--by element needs --element-size: width of elements in metres"));
            };
            let mesh = Mesh::new(&scene);
            let elements = Elements::new(&scene, &mesh, size);
            Enclosure::of_elements(&mesh, &elements).map_err(Failure::input)?
        } else {
            enclosure_of(&scene, grouping, &title, &mut faults)
        };
        return Ok(Input { enclosure, vs3: None, faults, title });
    }
    let loaded = load_enclosure(arguments.scene.as_deref().unwrap_or("".as_ref()), &options, grouping)?;
    Ok(Input { enclosure: loaded.enclosure, vs3: loaded.vs3, faults: loaded.faults, title })
}

/// Runs the verb.
pub fn run(arguments: &Arguments, global: &Global, progress: &Progress) -> Result<(), Failure> {
    let inputs: Vec<_> = arguments.scene.as_deref().into_iter().collect();
    let mut outputs = Outputs::new(&inputs);
    if let Some(path) = &arguments.output {
        outputs.promise(path, &["npz", "mtx", "csv", "txt", "out"])?;
    }
    progress.part("reading");
    let input = read(arguments)?;
    for fault in input.faults.0.iter().filter(|f| f.severity > Severity::Note || global.verbose) {
        progress.say(&fault.to_string());
    }
    let wants_script_f = arguments.script_f || input.vs3.as_ref().is_some_and(|v| v.settings.emit);
    let masked = input.vs3.as_ref().is_some_and(|v| !v.masks.is_empty());
    let emittances: Option<Vec<f64>> = input.enclosure.surfaces.iter().map(|s| s.emittance).collect();
    if wants_script_f && emittances.is_none() {
        return Err(Failure::input("script-F needs an emittance for every surface: only .vs3 files give them"));
    }
    if arguments.close && arguments.method != FormFactorMethod::Adaptive {
        return Err(Failure::input("--close needs the adaptive method: the factors of others are not reciprocal"));
    }

    let mut options = FactorsOptions { method: arguments.method, close: arguments.close, ..FactorsOptions::default() };
    options.form.adaptive.accuracy = arguments.accuracy;
    options.form.adaptive.memory = arguments.memory;
    options.form.look.resolution = arguments.resolution.into();
    progress.parts();
    let found = radiosity::factors(&input.enclosure, &options, progress)?;
    let table = Table::new(&input, &found, emittances, wants_script_f, masked)?;

    if let Some(path) = &arguments.output {
        // The ending was looked at when the file was promised.
        let format = FactorFormat::of(path).unwrap_or(FactorFormat::Csv);
        outputs.stage_with(path, |out| format.write(out, &table.borrowed()))?;
        outputs.commit()?;
    }
    progress.finish();
    if global.json {
        return print(&event(arguments, &input, &found, &table, progress).to_string());
    }
    if !global.quiet {
        for line in summary(&input, &found, arguments) {
            progress.say(&line);
        }
    }
    match &arguments.output {
        Some(path) => progress.say(&format!("wrote {}", path.display())),
        None if table.names.len() <= SHOWN => {
            let mut text = std::io::Cursor::new(Vec::new());
            let written = FactorFormat::View3dText.write(&mut text, &table.borrowed());
            written.map_err(Failure::work)?;
            print(String::from_utf8_lossy(&text.into_inner()).trim_end())?;
        }
        None => progress.say(&format!("{} surfaces: name a file with -o to have their factors", table.names.len())),
    }
    Ok(())
}

/// The matrix that goes out.
struct Table {
    names: Vec<String>,
    areas: Vec<f64>,
    emittances: Option<Vec<f64>>,
    matrix: Matrix,
    is_closed: bool,
    is_script_f: bool,
}

enum Matrix {
    Dense(Vec<f64>, Option<Vec<f32>>),
    Sparse(FormFactors),
}

impl Table {
    fn new(
        input: &Input,
        found: &Factors,
        emittances: Option<Vec<f64>>,
        is_script_f: bool,
        masked: bool,
    ) -> Result<Table, Failure> {
        let enclosure = &input.enclosure;
        let factors = &found.factors;
        let n = factors.len();
        let names: Vec<String> = enclosure.surfaces.iter().map(|s| s.name.clone()).collect();
        let is_closed = enclosure.is_closed;
        let table = |matrix, emittances| Table {
            names: names.clone(),
            areas: factors.areas.clone(),
            emittances,
            matrix,
            is_closed,
            is_script_f,
        };
        if is_script_f {
            let emittances = emittances.unwrap_or_default();
            let script = found.script_f(&emittances).map_err(Failure::input)?;
            return Ok(table(Matrix::Dense(script, None), Some(emittances)));
        }
        if let Some(vs3) = input.vs3.as_ref().filter(|_| masked) {
            // Masks are put back into the matrix, as View3D reports them.
            let vs3 = Vs3 { enclosure: enclosure.clone(), ..vs3.clone() };
            let all = vs3.with_masks(&factors.areas, &factors.dense());
            return Ok(Table {
                names: all.surfaces.iter().map(|s| s.name.clone()).collect(),
                emittances: all.surfaces.iter().map(|s| s.emittance).collect(),
                areas: all.areas,
                matrix: Matrix::Dense(all.factors, None),
                is_closed,
                is_script_f,
            });
        }
        let (share, from) = SPARSE;
        if n >= from && (factors.values.len() as f64) < share * (n as f64).powi(2) {
            return Ok(table(Matrix::Sparse(factors.clone()), emittances));
        }
        let mut errors = vec![0f32; n * n];
        for i in 0..n {
            for (j, _, error) in factors.row(i) {
                errors[i * n + j] = error as f32;
            }
        }
        Ok(table(Matrix::Dense(factors.dense(), Some(errors)), emittances))
    }

    fn borrowed(&self) -> FactorTable<'_> {
        let (rows, errors) = match &self.matrix {
            Matrix::Dense(values, errors) => (FactorRows::Dense(values), errors.as_deref()),
            Matrix::Sparse(f) => (
                FactorRows::Sparse { starts: &f.starts, columns: &f.columns, values: &f.values },
                Some(f.errors.as_slice()),
            ),
        };
        FactorTable {
            names: &self.names,
            areas: &self.areas,
            emittances: self.emittances.as_deref(),
            rows,
            errors,
            is_closed: self.is_closed,
            is_script_f: self.is_script_f,
        }
    }
}

fn name(enclosure: &Enclosure, surface: usize) -> &str {
    enclosure.surfaces.get(surface).map_or("", |s| s.name.as_str())
}

fn summary(input: &Input, found: &Factors, arguments: &Arguments) -> Vec<String> {
    let enclosure = &input.enclosure;
    let mut head = format!(
        "{}: {}, {}",
        input.title,
        counted(enclosure.surfaces.len(), "surface", "surfaces"),
        counted(enclosure.facets.len(), "facet", "facets"),
    );
    if !enclosure.obstructions.is_empty() {
        head += &format!(", {} in the way", counted(enclosure.obstructions.len(), "more stands", "more stand"));
    }
    let mut lines = vec![head];
    if let Some(c) = found.factors.choices {
        let cubature: usize = c.clear_cubature.iter().sum();
        lines.push(format!(
            "of {} pairs {} face away, {} are proven blocked, {} proven clear ({} in closed form), {} partly hidden",
            c.total(),
            c.facing_away,
            c.blocked,
            cubature + c.clear_closed_form,
            c.clear_closed_form,
            c.clipped,
        ));
    }
    let closure = &found.closure;
    let [low, high] = found.row_sums;
    lines.push(format!("rows sum to {low:.7} … {high:.7}, as found"));
    if enclosure.is_closed || high > 1.0 + 1e-3 || low > 1.0 - 1e-2 {
        lines.push(format!(
            "closure: off by {:.1e} (RMS), at most {:.1e} at '{}'",
            closure.rms,
            closure.largest,
            name(enclosure, closure.row)
        ));
    }
    if arguments.method == FormFactorMethod::Adaptive {
        let largest = found.factors.errors.iter().fold(0f32, |m, e| m.max(*e));
        lines.push(format!("reciprocal by storage; errors of factors at most {largest:.1e}"));
    } else {
        lines.push(format!("reciprocity: off by {:.1e} at most", found.reciprocity));
        if !arguments.method.sees_occlusion() {
            lines.push(format!("{} does not see what stands between surfaces", arguments.method));
        }
    }
    if let Some(repair) = &found.repair {
        let moved = format!(
            "factors moved by at most {:.1e}, {:.1} times their stated error",
            repair.largest_change, repair.largest_relative
        );
        lines.push(match repair.open_rows {
            0 => format!("closed: rows are off by at most {:.1e} now; {moved}", repair.after.largest),
            open => format!(
                "closed where it can be: {} more than the errors of factors explain, so the enclosure is open there; {moved}",
                counted(open, "row lacks", "rows lack")
            ),
        });
    }
    lines
}

fn event(
    arguments: &Arguments,
    input: &Input,
    found: &Factors,
    table: &Table,
    progress: &Progress,
) -> serde_json::Value {
    let shown = arguments.output.is_none() && table.names.len() <= SHOWN;
    let rows: Option<Vec<&[f64]>> = match &table.matrix {
        Matrix::Dense(values, _) if shown => Some(values.chunks(table.names.len()).collect()),
        _ => None,
    };
    json!({
        "event": "result", "method": arguments.method.name(), "surfaces": table.names, "areas": table.areas,
        "emittances": table.emittances, "facets": input.enclosure.facets.len(), "script_f": table.is_script_f,
        "closure": found.closure, "row_sums": found.row_sums, "reciprocity": found.reciprocity,
        "repair": found.repair, "choices": found.factors.choices, "stages": progress.spent(),
        "seconds": progress.seconds(), "output": arguments.output, "factors": rows,
    })
}
