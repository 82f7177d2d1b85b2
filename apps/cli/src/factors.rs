//! `radiosity factors`: view factors between surfaces.

use crate::blind::{Why, blind};
use crate::output::{Outputs, print};
use crate::progress::Progress;
use crate::{Failure, Global, numbers};
use clap::{Args, ValueEnum};
use radiosity::io::vs3::NoRow;
use radiosity::io::{FactorFormat, FactorRows, FactorTable, Grouping, LoadOptions, Vs3, enclosure_of, load_enclosure};
use radiosity::transport::row::{MOST_CELLS, RowMethod};
use radiosity::transport::{FormFactorMethod, FormFactors};
use radiosity::{Doubt, Elements, Enclosure, Factors, FactorsOptions, Faults, Mesh, Severity, counted, listed};
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
    /// hemicube-midpoint, single-plane, single-plane-adaptive, cubic-tetrahedron, global-cube, hemisphere, point, disc,
    /// lambert, nusselt, contour, exact, cubature, malley, area-samples, global-lines; hemicube-gpu in
    /// builds with the feature `gpu`. Of these `contour` and `exact` do not see what stands between surfaces: they are for
    /// scenes in which nothing does.
    #[arg(long, value_name = "NAME", default_value_t = FormFactorMethod::Adaptive, hide_default_value = true)]
    method: FormFactorMethod,
    /// Which triangles of a .glb, .gltf or .obj are one surface; those of an object by default. A .vs3 has its own.
    #[arg(long, value_enum)]
    by: Option<By>,
    /// Width of elements in metres, for `--by element`.
    #[arg(long, value_name = "M", allow_negative_numbers = true, value_parser = numbers::positive)]
    element_size: Option<f64>,
    /// Largest error of a factor between surfaces that see each other partly, 1e-5 by default; for the adaptive method. What is
    /// not hidden at all is found to 1e-9 or better. Meshes that would take minutes so are asked for 1e-3 by default, for which they
    /// send rays: seconds for furniture, where 1e-5 takes hours.
    #[arg(long, value_name = "E", allow_negative_numbers = true, value_parser = numbers::positive)]
    accuracy: Option<f64>,
    /// Cells along a side of the surface that hemicube and its like project on, an even number from 4 to 2048, 256 by
    /// default; `hemisphere` casts the square of it rays, or the next power of two, up to 4096².
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(4..=4096))]
    resolution: Option<u16>,
    /// Make rows sum to one by moving uncertain factors, and no others.
    #[arg(long)]
    close: bool,
    /// Script-F instead: with all reflections by the emittances, which the .vs3 gives. A .vs3 with emit=1 asks for it itself.
    #[arg(long)]
    script_f: bool,
    /// Length of one unit of a .vs3 or .obj: m (the default), cm, mm, in, ft, or a number of metres.
    #[arg(long, value_name = "UNIT", allow_negative_numbers = true, value_parser = numbers::unit)]
    unit: Option<f64>,
    /// Memory for the factors, e.g. 4G or 500M; powers of 1024. What finds them takes more beside it: a gigabyte where
    /// tens of thousands of surfaces stand between others.
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

/// Bytes of an element as a facet with its name, before there are any factors; about twice what it takes.
const ELEMENT: usize = 512;

struct Input {
    enclosure: Enclosure,
    vs3: Option<Vs3>,
    faults: Faults,
    title: String,
}

impl Arguments {
    /// Whether the scene's file has this ending.
    fn is(&self, ending: &str) -> bool {
        self.scene.as_ref().and_then(|s| s.extension()).is_some_and(|e| e.eq_ignore_ascii_case(ending))
    }

    fn by(&self) -> By {
        self.by.unwrap_or(By::Object)
    }

    /// A call that means something else than it does is not carried out.
    fn refuse_what_has_no_effect(&self) -> Result<(), Failure> {
        let method = self.method;
        let [adaptive, projects] = [
            method == FormFactorMethod::Adaptive,
            matches!(method, FormFactorMethod::Row(_) | FormFactorMethod::HemicubeGpu),
        ];
        let casts_rays = method == FormFactorMethod::Row(RowMethod::Hemisphere);
        let by_element = self.by == Some(By::Element);
        let rules = [
            (self.by.is_some() && self.is("vs3"), "--by is for scenes: a .vs3 has its own surfaces".to_owned()),
            (
                self.unit.is_some() && !self.is("obj") && !self.is("vs3"),
                "--unit is for .obj and .vs3 files: lengths of others are metres".to_owned(),
            ),
            (self.element_size.is_some() && !by_element, "--element-size is for --by element".to_owned()),
            (
                self.close && !adaptive,
                "--close needs the adaptive method: the factors of others are not reciprocal".to_owned(),
            ),
            (
                self.accuracy.is_some() && !adaptive,
                format!("--accuracy is for the adaptive method: {method} is as exact as it is and states its errors"),
            ),
            (
                self.resolution.is_some() && !projects,
                format!("--resolution is for methods that project, such as hemicube: {method} does not"),
            ),
            (
                self.resolution.is_some_and(|n| n > MOST_CELLS || n % 2 > 0) && !casts_rays,
                format!("--resolution of {method} must be even and at most {MOST_CELLS}"),
            ),
        ];
        match rules.into_iter().find(|(has_no_effect, _)| *has_no_effect) {
            Some((_, why)) => Err(Failure::input(why)),
            None => Ok(()),
        }
    }

    fn options(&self, enclosure: &Enclosure) -> FactorsOptions {
        let mut options = FactorsOptions { method: self.method, close: self.close, ..FactorsOptions::default() };
        let form = &mut options.form;
        form.adaptive.memory = self.memory;
        match self.accuracy {
            Some(accuracy) => form.adaptive.accuracy = accuracy,
            None => form.adaptive = form.adaptive.usual(enclosure),
        }
        form.adaptive.clear_accuracy = form.adaptive.clear_accuracy.min(form.adaptive.accuracy);
        form.look.resolution = self.resolution.map_or(form.look.resolution, usize::from);
        options
    }
}

fn read(arguments: &Arguments) -> Result<Input, Failure> {
    let options = LoadOptions { metres_per_unit: arguments.unit.unwrap_or(1.0), ..LoadOptions::default() };
    let is_element = arguments.by() == By::Element;
    let grouping = match arguments.by() {
        By::Material => Grouping::Material,
        By::Object => Grouping::Object,
        By::Triangle | By::Element => Grouping::Triangle,
    };
    let title = arguments.scene.as_ref().map_or("built-in Cornell box".to_owned(), |s| s.display().to_string());
    if let (Some(path), false) = (&arguments.scene, is_element) {
        let mut loaded = load_enclosure(path, &options, grouping)?;
        let settings = loaded.vs3.as_ref().map_or((0, 0), |vs3| (vs3.settings.row, vs3.settings.col));
        if settings != (0, 0) {
            let (row, col) = settings;
            let what = format!("row={row} col={col} ask for a row or a column alone");
            loaded.faults.warning(title.clone(), what, "all rows and columns are found and written");
        }
        return Ok(Input { enclosure: loaded.enclosure, vs3: loaded.vs3, faults: loaded.faults, title });
    }
    let (scene, mut faults) = match &arguments.scene {
        None => (radiosity::cornell_box(), Faults::default()),
        Some(path) => {
            let loaded = radiosity::io::load(path, &options)?;
            (loaded.scene, loaded.faults)
        }
    };
    let enclosure = if is_element {
        let Some(size) = arguments.element_size else {
            return Err(Failure::input("--by element needs --element-size: width of elements in metres"));
        };
        let mesh = Mesh::new(&scene);
        let count = Elements::count(&scene, &mesh, size);
        if count.saturating_mul(ELEMENT) > arguments.memory {
            return Err(Failure::input(format!(
                "{count} elements take more than the {} allowed (allow more, or use a larger --element-size)",
                radiosity::size(arguments.memory)
            )));
        }
        let elements = Elements::new(&scene, &mesh, size);
        Enclosure::of_elements(&mesh, &elements).map_err(Failure::input)?
    } else {
        enclosure_of(&scene, grouping, &title, &mut faults)
    };
    Ok(Input { enclosure, vs3: None, faults, title })
}

/// Runs the verb.
pub fn run(arguments: &Arguments, global: &Global, progress: &Progress) -> Result<(), Failure> {
    arguments.refuse_what_has_no_effect()?;
    let inputs: Vec<_> = arguments.scene.as_deref().into_iter().collect();
    let mut outputs = Outputs::new(&inputs);
    if let Some(path) = &arguments.output {
        outputs.promise(path, &["npz", "mtx", "csv", "txt", "out"])?;
    }
    let format = arguments.output.as_deref().and_then(FactorFormat::of);
    progress.part("reading");
    let input = read(arguments)?;
    for fault in input.faults.0.iter().filter(|f| f.severity > Severity::Note || global.verbose) {
        progress.say(&fault.to_string());
    }
    let is_script_f = arguments.script_f || input.vs3.as_ref().is_some_and(|v| v.settings.emit);
    let emittances: Option<Vec<f64>> = input.enclosure.surfaces.iter().map(|s| s.emittance).collect();
    if is_script_f && emittances.is_none() {
        return Err(Failure::input("script-F needs an emittance for every surface: only .vs3 files give them"));
    }
    if is_script_f {
        refuse_beyond(input.enclosure.surfaces.len(), SCRIPT_BYTES, "script-F", arguments.memory)?;
    }
    if let Some(FactorFormat::Npz) = format {
        refuse_long_names(&input.enclosure)?;
    }
    progress.parts();
    let options = arguments.options(&input.enclosure);
    let found = radiosity::factors(&input.enclosure, &options, progress)?;
    let table = Table::new(&input, &found, (emittances, is_script_f), arguments.memory)?;

    if let (Some(path), Some(format)) = (&arguments.output, format) {
        outputs.stage_with(path, |out| format.write(out, &table.borrowed()))?;
        outputs.commit()?;
    }
    progress.finish();
    warnings(&input, &found).iter().for_each(|line| progress.say(line));
    if global.json {
        return print(&event(arguments, &input, &found, &table, progress).to_string());
    }
    if !global.quiet {
        for line in summary(&input, &found, &table, (arguments, &options)) {
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

/// Bytes of an entry of the full matrices that are made of factors to write them: a value and its error; twice that where
/// masks are put in; for script-F the factors, what is eliminated, which then is their copy, the solution and the result.
const ENTRY_BYTES: usize = size_of::<f64>() + size_of::<f32>();
const SCRIPT_BYTES: usize = 4 * size_of::<f64>();

/// Refuses full matrices that are beyond the memory.
fn refuse_beyond(surfaces: usize, entry: usize, what: &str, allowed: usize) -> Result<(), Failure> {
    let needed = surfaces.saturating_mul(surfaces).saturating_mul(entry);
    if needed <= allowed {
        return Ok(());
    }
    let (needed, allowed) = (radiosity::size(needed), radiosity::size(allowed));
    Err(Failure::input(format!(
        "{what} of {surfaces} surfaces needs full matrices of {needed}, more than the {allowed} allowed (allow more by --memory)"
    )))
}

/// Longest name that a .npz is written with: there all take as much as the longest, four bytes a character.
const LONGEST_NAME: usize = 4096;

/// Refuses names that would fill a .npz with nothing.
fn refuse_long_names(enclosure: &Enclosure) -> Result<(), Failure> {
    let lengths = enclosure.surfaces.iter().map(|surface| surface.name.chars().count());
    match lengths.enumerate().find(|(_, length)| *length > LONGEST_NAME) {
        Some((surface, length)) => Err(Failure::input(format!(
            "the name of surface {} has {length} characters; a .npz pads all names to the longest, of {LONGEST_NAME} at most \
             (write .csv or .mtx, or shorten it)",
            surface + 1
        ))),
        None => Ok(()),
    }
}

/// The matrix that goes out.
struct Table<'a> {
    names: Vec<String>,
    areas: Vec<f64>,
    emittances: Option<Vec<f64>>,
    matrix: Matrix<'a>,
    is_closed: bool,
    is_script_f: bool,
}

enum Matrix<'a> {
    Dense(Vec<f64>, Option<Vec<f32>>),
    Sparse(&'a FormFactors),
}

impl<'a> Table<'a> {
    fn new(
        input: &Input,
        found: &'a Factors,
        (emittances, is_script_f): (Option<Vec<f64>>, bool),
        memory: usize,
    ) -> Result<Table<'a>, Failure> {
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
        if let (true, Some(emittances)) = (is_script_f, &emittances) {
            let script = found.script_f(emittances).map_err(Failure::input)?;
            return Ok(table(Matrix::Dense(script, None), Some(emittances.clone())));
        }
        let (share, from) = SPARSE;
        let has_masks = input.vs3.as_ref().is_some_and(|vs3| !vs3.masks.is_empty());
        if !has_masks && n >= from && (factors.values.len() as f64) < share * (n as f64).powi(2) {
            return Ok(table(Matrix::Sparse(factors), emittances));
        }
        let entry = if has_masks { 2 * ENTRY_BYTES } else { ENTRY_BYTES };
        refuse_beyond(n, entry, "the table", memory)?;
        let mut errors = vec![0f32; n * n];
        for i in 0..n {
            for (j, _, error) in factors.row(i) {
                errors[i * n + j] = error as f32;
            }
        }
        if let Some(vs3) = input.vs3.as_ref().filter(|_| has_masks) {
            // Masks are put back into the matrix, as View3D reports them.
            let vs3 = Vs3 { enclosure: enclosure.clone(), ..vs3.clone() };
            let all = vs3.with_masks(&factors.areas, &factors.dense(), &errors);
            return Ok(Table {
                names: all.surfaces.iter().map(|s| s.name.clone()).collect(),
                emittances: all.surfaces.iter().map(|s| s.emittance).collect(),
                areas: all.areas,
                matrix: Matrix::Dense(all.factors, Some(all.errors)),
                is_closed,
                is_script_f,
            });
        }
        Ok(table(Matrix::Dense(factors.dense(), Some(errors)), emittances))
    }

    /// Least and largest sum of a row as it goes out.
    fn row_sums(&self) -> [f64; 2] {
        let sums: Vec<f64> = match &self.matrix {
            Matrix::Dense(values, _) => values.chunks(self.names.len().max(1)).map(|row| row.iter().sum()).collect(),
            Matrix::Sparse(factors) => factors.row_sums(),
        };
        sums.into_iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], s| [low.min(s), high.max(s)])
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

/// A surface as messages call it: by its name, or by its number from 1.
fn name(enclosure: &Enclosure, surface: usize) -> String {
    match enclosure.surfaces.get(surface).map_or("", |s| s.name.as_str()) {
        "" => format!("surface {}", surface + 1),
        name => format!("'{name}'"),
    }
}

/// Which surfaces of a .vs3 have which rows, where that is not plain: masks have rows without being surfaces of the
/// exchange, others are surfaces of the file and have none.
fn rows_of_vs3(vs3: &Vs3, enclosure: &Enclosure, is_script_f: bool) -> Vec<String> {
    let title =
        |number: u32, name: &str| if name.is_empty() { number.to_string() } else { format!("{number} '{name}'") };
    let mut lines = Vec::new();
    if !vs3.masks.is_empty() {
        let masks = vs3.masks.iter().map(|m| format!("{} upon {}", title(m.number, &m.name), name(enclosure, m.base)));
        let rows = counted(vs3.masks.len(), "mask", "masks");
        lines.push(format!("{rows}: {}", listed(masks)));
        let (surfaces, all) = (enclosure.surfaces.len(), enclosure.surfaces.len() + vs3.masks.len());
        lines.push(if is_script_f {
            format!(
                "script-F has {}, of surfaces: a mask sees its base alone, and what it covers takes no part",
                counted(surfaces, "row", "rows")
            )
        } else {
            format!(
                "the matrix has {all} rows, {surfaces} of surfaces and {} of masks, in the order of the file: a mask sees its \
                 base and nothing else",
                vs3.masks.len()
            )
        });
    }
    let of = |wanted: fn(&NoRow) -> bool| vs3.rowless.iter().filter(move |r| wanted(&r.why));
    let nulls = of(|why| matches!(why, NoRow::Null(_)));
    let nulls: Vec<String> = nulls.map(|r| title(r.number, &r.name)).collect();
    if !nulls.is_empty() {
        let count = counted(
            nulls.len(),
            "null surface has no row: what it covers",
            "null surfaces have no rows: what they cover",
        );
        lines.push(format!("{count} is no part of the base and lets nothing through ({})", listed(nulls.into_iter())));
    }
    let parts = vs3.rowless.iter().filter_map(|r| match r.why {
        NoRow::Part(whole) => Some(format!("{} with {}", title(r.number, &r.name), name(enclosure, whole))),
        _ => None,
    });
    let parts: Vec<String> = parts.collect();
    if !parts.is_empty() {
        let count = counted(parts.len(), "surface is", "surfaces are");
        lines.push(format!("{count} combined with another and counted there ({})", listed(parts.into_iter())));
    }
    let obstructions = of(|why| *why == NoRow::Obstruction).count();
    if obstructions > 0 {
        let count = counted(
            obstructions,
            "obstruction has no row: it only stands",
            "obstructions have no rows: they only stand",
        );
        lines.push(format!("{count} in the way"));
    }
    lines
}

/// What is doubtful about factors: worth a warning, whatever goes out.
fn warnings(input: &Input, found: &Factors) -> Vec<String> {
    let name = |surface| name(&input.enclosure, surface);
    let mut lines = Vec::new();
    // Of surfaces that go out as exact as was asked, no more is told; else this is the one place where their error is.
    if let Some(missed) = &found.missed {
        lines.push(format!(
            "warning: the accuracy of {:e} was not reached between {} (cut large surfaces into pieces, or allow more): {}",
            missed.asked,
            counted(missed.pairs, "pair of surfaces", "pairs of surfaces"),
            largest_error(&input.enclosure, found),
        ));
    }
    if let Some(excess) = &found.excess {
        lines.push(format!(
            "warning: {} to more than one, by more than stated errors allow: {:.6} at {} (surfaces that overlap or intersect \
             are counted twice)",
            counted(excess.rows, "row sums", "rows sum"),
            excess.sum,
            name(excess.row),
        ));
    }
    lines
}

fn summary(
    input: &Input,
    found: &Factors,
    table: &Table,
    (arguments, options): (&Arguments, &FactorsOptions),
) -> Vec<String> {
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
    lines.extend(input.vs3.iter().flat_map(|vs3| rows_of_vs3(vs3, enclosure, table.is_script_f)));
    let choices = found.factors.choices;
    if choices.is_some() {
        lines.push(format!("factors asked for to {:e} (--accuracy)", options.form.adaptive.accuracy));
    }
    if let Some(rays) = choices.map(|c| c.rays).filter(|rays| *rays > 0) {
        lines.push(format!("{rays} rays from all over surfaces, as pairs of facets take longer"));
    } else if let Some(c) = choices {
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
    let [low, high] = found.row_sums.map(unsigned_zero);
    let of = if table.is_script_f { "rows of F" } else { "rows" };
    let mut sums = format!("{of} sum to {low:.7} … {high:.7}, as found");
    if enclosure.is_closed || high > 1.0 + 1e-3 || low > 1.0 - 1e-2 {
        let worst = name(enclosure, closure.row);
        sums += &format!("; off from one by {:.1e} (RMS), the most at {worst}", closure.rms);
    }
    lines.push(sums);
    lines.extend(blind_rows(enclosure, found));
    if arguments.method == FormFactorMethod::Adaptive {
        lines.push("reciprocal by storage".to_owned());
    } else {
        lines.push(format!("reciprocity: off by {:.1e} at most", found.reciprocity));
        if !arguments.method.sees_occlusion() {
            lines.push(format!("{} does not see what stands between surfaces", arguments.method));
        }
    }
    if found.missed.is_none() {
        lines.push(largest_error(enclosure, found));
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
    if table.is_script_f {
        let [low, high] = table.row_sums().map(unsigned_zero);
        lines.push(format!(
            "script-F, with all reflections in it, is what goes out: its rows sum to {low:.7} … {high:.7} (in a closed \
             enclosure to emittances), and no error is known of it"
        ));
    }
    lines
}

/// Which rows are all zero, and why.
fn blind_rows(enclosure: &Enclosure, found: &Factors) -> Option<String> {
    let blind = blind(&found.factors);
    if blind.is_empty() {
        return None;
    }
    let told = |surface: &usize| {
        format!("{} ({})", name(enclosure, *surface), Why::of(enclosure, &found.factors, *surface).told())
    };
    let rows = counted(blind.len(), "row is all zero: its surface sees", "rows are all zero: their surfaces see");
    Some(format!("{rows} no other: {}", listed(blind.iter().map(told))))
}

/// A sum as it is written with seven decimals: that of nothing is 0, and not −0 as IEEE 754 has it.
fn unsigned_zero(sum: f64) -> f64 {
    if sum.abs() < 0.5e-7 { 0.0 } else { sum }
}

fn largest_error(enclosure: &Enclosure, found: &Factors) -> String {
    let Doubt { error, pair: [from, to] } = found.largest_error;
    if error == 0.0 {
        return "errors of factors: none stated".to_owned();
    }
    format!("errors of factors at most {error:.1e}, from {} to {}", name(enclosure, from), name(enclosure, to))
}

fn event(
    arguments: &Arguments,
    input: &Input,
    found: &Factors,
    table: &Table,
    progress: &Progress,
) -> serde_json::Value {
    let named = |surface: usize| input.enclosure.surfaces.get(surface).map(|s| s.name.as_str());
    let shown = arguments.output.is_none() && table.names.len() <= SHOWN;
    let rows: Option<Vec<&[f64]>> = match &table.matrix {
        Matrix::Dense(values, _) if shown => Some(values.chunks(table.names.len()).collect()),
        _ => None,
    };
    json!({
        "event": "result", "method": arguments.method.name(), "surfaces": table.names, "areas": table.areas,
        "emittances": table.emittances, "facets": input.enclosure.facets.len(), "script_f": table.is_script_f,
        "closure": found.closure, "row_sums": found.row_sums, "reciprocity": found.reciprocity,
        "zero_rows": blind(&found.factors).into_iter().map(named).collect::<Vec<_>>(),
        "largest_error": { "error": found.largest_error.error, "pair": found.largest_error.pair.map(named) },
        "accuracy_missed": found.missed.map(|m| json!({ "asked": m.asked, "pairs": m.pairs })),
        "excess": found.excess.map(|e| json!({ "rows": e.rows, "row": named(e.row), "sum": e.sum, "errors": e.errors })),
        "repair": found.repair, "choices": found.factors.choices, "stages": progress.spent(),
        "seconds": progress.seconds(), "output": arguments.output, "factors": rows,
    })
}
