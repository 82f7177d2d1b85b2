//! Live editing: a scene that is lit while it is looked at, and changed while it is lit.
//!
//! A [`Session`] holds a scene and its light. It is dark at first; [`Session::step`] traces a few rays, solves, and
//! traces more, so that light comes at once and gets finer. [`Session::apply`] changes lights, paint and places. What no
//! change reaches is kept: every ray has a fixed origin and direction, which depend on its own object only, so that an
//! edit traces only rays that met the object where it was, that it stands in the way of now, and its own.
//!
//! When [`Step::is_done`] says so, the light is, to the last bit, that of a fresh session to which the same edits were
//! applied before its first step, for any number of threads.
//!
//! ```
//! use radiosity::session::{Edit, Layer, Session, SessionOptions};
//! use std::time::Duration;
//!
//! let options = SessionOptions { elements: 500, rays: 16, ..SessionOptions::default() };
//! let mut session = Session::new(radiosity::cornell_box(), &options).unwrap();
//! while !session.step(Duration::from_millis(10)).is_done {}
//! let floor = session.model().objects[0].id;
//! let before = session.light(floor, Layer::Total);
//!
//! let lamp = session.model().lights[0].id;
//! let applied = session.apply(&Edit::Light { light: lamp, dimming: 0.5, colour: [1.0; 3] }).unwrap();
//! while !session.step(Duration::from_millis(10)).is_done {}
//! let dimmed = session.light(floor, Layer::Total);
//! assert!((dimmed[0][1] - 0.5 * before[0][1]).abs() < 1e-3 * before[0][1]);
//!
//! session.apply(&applied.inverse).unwrap();
//! while !session.step(Duration::from_millis(10)).is_done {}
//! assert_eq!(session.light(floor, Layer::Total), before);
//! ```
//!
//! Objects are not sewn together as [`Mesh`](radiosity_scene::Mesh) does it for batch work, since they move: light is
//! smooth within an object and may jump between two that touch.

mod added;
mod carry;
mod check;
mod display;
mod edges;
mod edit;
mod lattice;
mod light;
mod model;
mod movable;
mod paint;
mod place;
mod plane;
mod probe;
mod rectangle;
mod saved;
mod seams;
mod solve;
mod split;
mod state;
mod surroundings;
mod survey;

pub use added::{Form, NewObject};
pub use edit::{Applied, Edit, EditError, MOST_CONE, MOST_DIMMING, MOST_EDITS, MOST_INTENSITY, MOST_LIGHTS, NewLight};
pub use model::{Layer, LightId, LightKind, Model, ModelCamera, ModelLight, ModelObject, ObjectId, Probe};
pub use plane::{Plane, PlaneError, PlaneFigures, PlanePoint, PlaneQuestion, PlaneReading};
pub use probe::MOST_BOUNCES;
pub use split::{CutElement, Edge};
pub use survey::{Reading, SurfacePlace, Survey, Surveyed};

use crate::Error;
use carry::Done;
use display::{Display, Weights};
use edges::Edges;
use light::{Light, MOST_COLUMNS, Strand};
use paint::Paint;
use radiosity_scene::{Bands, Scene};
use radiosity_transport::live::{Lanes, Live, Target};
use serde::Serialize;
use solve::Answer;
use state::State;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Mutex, OnceLock};
use std::time::{Duration, Instant};

/// How a session works.
#[derive(Clone, Copy, Debug)]
pub struct SessionOptions {
    /// Width of an element, metres. `None` chooses it by `elements`.
    pub element_size: Option<f64>,
    /// About how many elements to make; each triangle is one at least.
    pub elements: usize,
    /// Most rays of an element, a power of two from 4 to 1024.
    pub rays: u32,
    /// Most shadow rays from an element to a light, a power of two up to 64. `None` shares 64 out among the lights, 8 each
    /// at least.
    pub shadow_rays: Option<u32>,
    /// Most places at which light is found where it has an edge within elements, for display ([`Session::cuts`]).
    pub places: usize,
    /// Most memory for rays and columns of light, bytes.
    pub memory: usize,
}

impl Default for SessionOptions {
    fn default() -> Self {
        SessionOptions {
            element_size: None,
            elements: 60_000,
            rays: 256,
            shadow_rays: None,
            places: 0,
            memory: 4 << 30,
        }
    }
}

/// What one [`Session::step`] did.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Step {
    /// Objects whose light is another than before.
    pub changed: Vec<ObjectId>,
    /// Whether what is shown is complete since the last edit: every ray that it dirtied so far as it is shown.
    pub is_complete: bool,
    /// Whether nothing is left to do: the light is that of a fresh session.
    pub is_done: bool,
}

/// Where a session stands.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Status {
    /// Elements.
    pub elements: usize,
    /// Rays per element so far.
    pub rays: u32,
    /// Rays per element at the end.
    pub most_rays: u32,
    /// Share of all rays of elements that are traced, those that are not shown yet and those that an edit has dirtied among them.
    pub share: f64,
    /// Share of the places at which edges within elements are looked for that has been looked at, about; none before all else is done.
    pub sharpened: f64,
    /// One standard error of the irradiance by the rays of rows, relative, in the area-weighted mean square; that of shadow
    /// rays and of the elements' size are not in it. Infinite while dark, and after an edit until it is known of its light.
    pub error: f64,
    /// Relative residual of what is shown.
    pub residual: f64,
    /// Rays traced so far, but for those that look for edges within elements, and for what is measured.
    pub rays_traced: u64,
    /// Seconds of work so far.
    pub seconds: f64,
    /// Bytes that rays and columns take.
    pub memory: usize,
    /// Whether only edges within elements are left to look for.
    pub is_solved: bool,
    /// Whether nothing is left to do.
    pub is_done: bool,
}

/// A scene that is lit while it is looked at and changed while it is lit.
pub struct Session {
    live: Live,
    /// Objects of the scene as it was handed in, and their mean exitance, lm/m²: beside it is judged what is added, so that
    /// a lamp near the limit may be judged otherwise in the edited scene, where others count in.
    handed_in: usize,
    mean_exitance: f64,
    objects: Vec<Placed>,
    lights: Vec<Light>,
    strands: Vec<Strand>,
    answer: Answer,
    state: State,
    edges: Edges,
    most_places: usize,
    /// Width of an element, metres.
    element_size: f64,
    memory: usize,
    /// Weights of averages by object, and of which revision they are.
    weights: Mutex<BTreeMap<usize, (u64, Arc<Weights>)>>,
    /// Layers that were asked for last, by id; the last of them last.
    cache: Mutex<Vec<Kept>>,
}

/// A layer by id, and of which revision it is.
#[derive(Clone)]
struct Kept {
    layer: Layer,
    revision: u64,
    values: Arc<Vec<Lanes<4>>>,
    /// The part of it that lamps bring directly; empty where there is none.
    lamps: Arc<Vec<Lanes<4>>>,
}

/// An object as it is now.
#[derive(Clone)]
struct Placed {
    /// Of the scene.
    source: usize,
    /// None of what was handed in.
    form: Option<Form>,
    /// What it became when it got another form.
    successor: Option<usize>,
    paint: Arc<Paint>,
    display: Arc<OnceLock<Display>>,
    coat: Option<Bands>,
    matrix: [f64; 16],
    light: Option<usize>,
    group: u32,
    /// Whether people would move it.
    is_movable: bool,
}

impl Placed {
    /// An object of the scene, where its own coordinates have it.
    fn new(live: &Live, source: usize, body: usize, group: u32) -> Placed {
        let world = live.world();
        Placed {
            source,
            form: None,
            successor: None,
            paint: Arc::new(Paint::new(&world.scene, source, &world.bodies[body].shape)),
            display: Arc::default(),
            coat: None,
            matrix: glam::DMat4::IDENTITY.to_cols_array(),
            light: None,
            group,
            is_movable: true,
        }
    }
}

/// Least shadow rays from an element to a light that are shared out.
const LEAST_SHADOWS: u32 = 8;

/// Most shadow rays: as many as there are bits to keep them.
const MOST_SHADOWS: u32 = 64;

impl Session {
    /// Makes a scene ready. It is dark; no ray has been traced.
    ///
    /// # Errors
    /// [`Error::Empty`]; [`Error::Memory`] before anything large is allocated.
    pub fn new(scene: Scene, options: &SessionOptions) -> Result<Session, Error> {
        if scene.triangles.is_empty() {
            return Err(Error::Empty("the scene has no surface"));
        }
        let size = element_size(&scene, options);
        let rays = options.rays.clamp(4, 1024).next_power_of_two();
        let elements = Live::count(&scene, size);
        let shining = scene.objects.iter().filter(|object| scene.materials[object.material].emits()).count();
        let lights = shining + scene.lights.len() + usize::from(!scene.sky.is_black());
        let shared = (MOST_SHADOWS as usize / lights.max(1)).max(1).next_power_of_two() as u32;
        let shadows = options.shadow_rays.unwrap_or(shared.max(LEAST_SHADOWS));
        let most = Target { rays, shadows: shadows.max(1).next_power_of_two().min(MOST_SHADOWS) };
        let of_edges = edges::bytes(options.places);
        let (needed, allowed) = (bytes(elements, rays, lights.min(MOST_COLUMNS)) + of_edges, options.memory);
        if needed > allowed {
            let least = bytes(Live::count(&scene, f64::INFINITY), 4, lights.min(MOST_COLUMNS)) + of_edges;
            return Err(Error::Memory { elements, rays: Some(rays as usize), needed, allowed, least });
        }

        let live = Live::new(Arc::new(scene), size, most);
        let mean_exitance = light::mean_exitance(&live);
        let lights = light::lights_of(&live, mean_exitance);
        let objects = placed(&live);
        let mut session = Session {
            handed_in: objects.len(),
            mean_exitance,
            objects,
            live,
            lights: Vec::new(),
            strands: Vec::new(),
            answer: Answer::default(),
            state: State::dark(),
            edges: Edges::default(),
            most_places: options.places,
            element_size: size,
            memory: options.memory,
            weights: Mutex::default(),
            cache: Mutex::default(),
        };
        lights.into_iter().for_each(|light| session.add_light(light));
        session.refresh_answer(0..session.objects.len());
        Ok(session)
    }

    fn add_light(&mut self, mut light: Light) {
        let index = self.lights.len();
        if let Some(body) = light.body {
            self.objects[body].light = Some(index);
        }
        light.strand = light::strand_of(&mut self.strands, index);
        self.lights.push(light);
        self.make_column(index);
    }

    /// A light to which shadow rays go needs a column.
    fn make_column(&mut self, light: usize) {
        let Light { strand, is_direct, .. } = self.lights[light];
        if is_direct {
            if self.strands[strand].column.is_none() {
                self.strands[strand].column = Some(self.live.add_column(strand as u32, &[]));
            }
            self.place_lamps(strand);
        }
    }

    /// Reflectances and areas of some objects.
    fn refresh_answer(&mut self, objects: impl Iterator<Item = usize>) {
        let ids = self.live.ids();
        self.answer.rho.resize(ids, [0.0; 3]);
        self.answer.area.resize(ids, 0.0);
        for index in objects {
            let (body, placed) = (&self.live.world().bodies[index], &self.objects[index]);
            let (first, last) = (body.first as usize, body.dark() as usize);
            self.answer.rho[first..=last].fill([0.0; 3]);
            self.answer.area[first..=last].fill(0.0);
            // By id, so that the same scene has the same list.
            let passed = &mut self.answer.passed;
            let [from, to] = [first, last].map(|id| passed.partition_point(|side| (side.0 as usize) < id));
            passed.drain(from..to);
            if !body.is_present {
                continue;
            }
            let mut added = Vec::new();
            for element in 0..body.elements() {
                let id = body.first + element;
                let (rho, tau) = placed.paint.of(element, body.shape.fronts, placed.coat);
                self.answer.rho[id as usize] = rho;
                self.answer.area[id as usize] = body.area(element) as f32;
                if let Some(other) = body.shape.opposite(element).filter(|_| placed.paint.transmits) {
                    added.push((id, body.first + other, tau));
                }
            }
            passed.splice(from..from, added);
        }
        self.answer.measure();
    }

    /// The scene as it was handed in, and after it what was added, in its own axes: pictures, materials, the triangles
    /// that numbers refer to.
    pub fn scene(&self) -> &Scene {
        &self.live.world().scene
    }

    /// Changes the scene. The light follows in the next steps.
    ///
    /// # Errors
    /// [`EditError`]; nothing has changed then.
    pub fn apply(&mut self, edit: &Edit) -> Result<Applied, EditError> {
        self.check(edit)?;
        let mut done = Done::default();
        let inverse = self.carry_out(edit, &mut done);
        if done.repaints || done.traces {
            self.refresh_answer(done.objects.iter().copied());
        }
        for strand in &done.strands {
            self.place_lamps(*strand);
        }
        for strand in &done.dimmed {
            if let Some(column) = self.strands[*strand].column {
                let (_, strength) = light::lamps(&self.strands[*strand], &self.lights);
                self.live.set_strength(column, &strength);
            }
        }
        if done.traces || !done.strands.is_empty() || !done.dimmed.is_empty() {
            self.doubt();
        }
        let keeps_columns = !(done.repaints || done.traces || !done.dimmed.is_empty());
        self.state.edited(keeps_columns);
        let ids = |of: &BTreeSet<usize>| of.iter().map(|index| *index as u32).collect::<Vec<_>>();
        Ok(Applied {
            inverse,
            added: done.added.into_iter().map(|index| ObjectId(index as u32)).collect(),
            added_lights: done.added_lights.into_iter().map(|index| LightId(index as u32)).collect(),
            objects: ids(&done.objects).into_iter().map(ObjectId).collect(),
            traces: done.traces,
        })
    }

    /// Works for about `budget`, at least on one small piece.
    pub fn step(&mut self, budget: Duration) -> Step {
        let started = Instant::now();
        let deadline = started + budget;
        while !self.is_done() {
            let was_edited = self.state.is_edited;
            self.piece(deadline);
            if was_edited && !self.state.is_edited {
                self.keep_cuts();
            }
            // The light of an edit is wanted at once.
            if was_edited && !self.state.is_edited || Instant::now() >= deadline {
                break;
            }
        }
        self.state.seconds += started.elapsed().as_secs_f64();
        let changed = std::mem::take(&mut self.state.changed);
        Step {
            changed: changed.into_iter().map(|index| ObjectId(index as u32)).collect(),
            is_complete: self.state.solved_rays > 0 && !self.state.is_edited,
            is_done: self.is_done(),
        }
    }

    /// Where the session stands.
    pub fn status(&self) -> Status {
        let elements =
            self.live.world().bodies.iter().filter(|body| body.is_present).map(|body| body.elements()).sum::<u32>();
        let most = self.live.most().rays;
        Status {
            elements: elements as usize,
            rays: self.state.solved_rays,
            most_rays: most,
            share: self.live.share(),
            sharpened: self.sharpened(),
            error: self.state.error,
            residual: self.state.residual,
            rays_traced: self.live.rays_traced(),
            seconds: self.state.seconds,
            memory: bytes(self.live.ids(), most, self.strands.len()) + edges::bytes(self.most_places),
            is_solved: self.is_solved(),
            is_done: self.is_done(),
        }
    }
}

/// Bytes that so many elements take, with so many columns.
fn bytes(elements: usize, rays: u32, columns: usize) -> usize {
    // Columns of direct light, solved ones, and about twenty arrays of four numbers.
    Live::bytes(elements, rays, columns) + elements * (columns * size_of::<Bands>() + 20 * size_of::<Lanes<4>>())
}

/// Width of an element: as asked, or such that there are about as many as asked; triangles may make more.
fn element_size(scene: &Scene, options: &SessionOptions) -> f64 {
    if let Some(size) = options.element_size.filter(|size| *size > 0.0) {
        return size;
    }
    let area: f64 = (0..scene.triangles.len()).map(|triangle| scene.area(triangle)).sum();
    let wanted = options.elements.max(1);
    let mut size = (2.0 * area / wanted as f64).sqrt().max(f64::MIN_POSITIVE);
    // Elements along an edge are powers of two, so that their number moves in leaps; at the size that is twelve times as
    // wide next to all triangles are one.
    const STEPS: usize = 14;
    let least = Live::count(scene, f64::INFINITY);
    for _ in 0..STEPS {
        if least <= wanted && Live::count(scene, size) <= wanted {
            break;
        }
        size *= STEP;
    }
    // A triangle has only so many elements: those that a wide ground cannot have are for what stands on it.
    if 2 * Live::count(scene, size) < wanted {
        let steps: Vec<i32> = (1..MOST_NARROWER).collect();
        let fitting = steps.partition_point(|steps| Live::count(scene, size / STEP.powi(*steps)) <= wanted);
        size /= STEP.powi(fitting as i32);
    }
    size
}

/// By what widths of elements are tried, and how often that is: a millionth of them at least.
const STEP: f64 = 1.19;
const MOST_NARROWER: i32 = 80;

/// The objects of a scene as the file has them.
fn placed(live: &Live) -> Vec<Placed> {
    let scene = &live.world().scene;
    let mut group = 0;
    let mut last: Option<&radiosity_scene::Object> = None;
    let mut all = Vec::with_capacity(scene.objects.len());
    for (source, object) in scene.objects.iter().enumerate() {
        // Objects that were made in code have a node each; their names say what belongs together.
        let made = |object: &radiosity_scene::Object| object.source.node == object.source.mesh;
        let is_next = last.is_some_and(|last| {
            let same_node = (last.source.node, last.source.instance) == (object.source.node, object.source.instance);
            same_node || made(last) && made(object) && !object.name.is_empty() && last.name == object.name
        });
        group += u32::from(!is_next);
        last = Some(object);
        all.push(Placed::new(live, source, source, group));
    }
    let guessed = movable::movable(live.world(), &all);
    all.iter_mut().zip(guessed).for_each(|(placed, is_movable)| placed.is_movable = is_movable);
    all
}
