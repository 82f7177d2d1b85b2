//! The thread that owns the session: takes what pages ask, works a little, and posts what has changed.

mod telling;

use super::board::Board;
use super::history::{self, Gesture, History, targets};
use super::wire::{CameraPlace, Refused, Request, Say};
use radiosity::session::{CutElement, Edit, EditError, Layer, Model, ObjectId, Plane, Session, SurfacePlace, Survey};
use radiosity::{Bands, Scene};
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::time::{Duration, Instant};
use tokio::sync::mpsc::error::TrySendError;
use tokio::sync::{mpsc, oneshot};

/// Work between looks at what pages ask, of light and planes together: an edit waits as long, and until the piece at hand is
/// done and what is new is posted.
const SLICE: Duration = Duration::from_millis(10);

/// Light is posted this often at most; screens show no more.
const EVERY: Duration = Duration::from_millis(33);

/// While there is work, a layer besides the whole light waits this many times as long as it took last: late bounces would
/// leave no time for anything else.
const REST: u32 = 4;

/// Cameras that are kept at most, and letters of their names.
const MOST_CAMERAS: usize = 100;
const LONGEST_NAME: usize = 80;

/// What pages ask of the solver.
pub enum Command {
    /// A message of a page, and where the answer goes.
    Ask { page: u64, request: Request, answer: mpsc::Sender<String> },
    /// A page looks at another layer.
    Watch,
    /// Somebody wants all there is, to write it into a file.
    Export(oneshot::Sender<Export>),
    /// The end.
    Stop,
}

/// The scene as it is now with its light.
pub struct Export {
    /// The scene as edited, with the cameras that were kept.
    pub scene: Scene,
    /// What is drawn.
    pub model: Model,
    /// Irradiance at the vertices of each object of the model.
    pub light: Vec<Vec<Bands>>,
}

/// The state of the thread.
pub struct Solver {
    session: Session,
    model: Model,
    board: Arc<Board>,
    history: History,
    cameras: Vec<CameraPlace>,
    /// Objects whose light has changed.
    changed: BTreeSet<ObjectId>,
    /// Objects that came or came back, whose light is told when it is known: it may be what it was when they went, but not what
    /// was told last.
    back: BTreeSet<ObjectId>,
    /// How objects were cut last that were so once, and how often that has changed.
    cut: BTreeMap<ObjectId, (u32, Vec<CutElement>)>,
    /// Who wants all there is, when the last edit is seen.
    exports: Vec<oneshot::Sender<Export>>,
    /// Layers that pages look at.
    shown: Vec<Shown>,
    last_post: Option<Instant>,
    is_done: bool,
    edits: u64,
    /// When the first edit came whose light is not yet posted.
    edited: Option<Instant>,
    /// The last edit of each page's gesture that goes on: these wait until what was made before is seen, or nothing would
    /// be seen before the gestures end.
    held: Vec<Held>,
    latency: Option<f64>,
    /// What pages wait for that takes its time: of each page one of a kind at most.
    measured: Vec<Asked>,
    /// How rays come, and how edges are found, since the last change.
    tracing: Growth,
    sharpening: Growth,
    /// Since when all rays have been there but for what edits have changed; none before.
    settling: Option<Instant>,
    /// Seconds that it took last from there to the end.
    settled: Option<f64>,
}

/// Least growth of a share by which it is told when all of it is there: the first moments are not like the others.
const LEAST_GROWTH: f64 = 0.02;

/// How quickly a share grows.
#[derive(Clone, Copy, Debug, Default)]
struct Growth {
    /// Since when it is looked at, and how much it was then.
    since: Option<(Instant, f64)>,
}

impl Growth {
    /// Takes note of the share as it is.
    fn note(&mut self, share: f64) {
        self.since.get_or_insert_with(|| (Instant::now(), share));
    }

    /// Seconds until all of it is there, if it goes on as it went; none before it has grown.
    fn left(&self, share: f64) -> Option<f64> {
        let (since, first) = self.since.filter(|(_, first)| share >= *first + LEAST_GROWTH)?;
        Some(since.elapsed().as_secs_f64() * (1.0 - share) / (share - first))
    }
}

/// What a page waits for.
struct Asked {
    page: u64,
    question: u64,
    what: Measured,
    answer: mpsc::Sender<String>,
}

/// What is measured.
enum Measured {
    /// A picked place, where light comes from, too.
    Place(SurfacePlace),
    Plane(Box<Plane>),
    /// A grid over a surface.
    Places(Survey),
    /// Places all over what a camera sees.
    Sight(Survey),
}

impl Measured {
    /// A page picks one place, has one grid or plane, and looks from one place. What is least work comes first.
    fn kind(&self) -> u8 {
        match self {
            Measured::Place(_) => 0,
            Measured::Plane(_) | Measured::Places(_) => 1,
            Measured::Sight(_) => 2,
        }
    }
}

impl Asked {
    /// Whether its page has to read other answers first.
    fn is_full(&self) -> bool {
        self.answer.capacity() == 0
    }
}

/// A layer that pages look at.
struct Shown {
    layer: Layer,
    /// Objects whose light is not yet posted.
    owed: BTreeSet<ObjectId>,
    /// When it was posted last, and how long that took.
    last: Option<(Instant, Duration)>,
}

/// An edit that waits.
struct Held {
    command: Command,
    since: Instant,
    of: Part,
}

/// What an edit of a gesture changes; one that changes the same makes it outdated.
#[derive(PartialEq)]
struct Part {
    page: u64,
    gesture: u64,
    targets: Vec<history::Target>,
}

impl Part {
    fn of(command: &Command) -> Option<Part> {
        match command {
            Command::Ask { page, request: Request::Edit { edit, gesture: Some(gesture) }, .. } => {
                (history::is_absolute(edit)).then(|| Part { page: *page, gesture: *gesture, targets: targets(edit) })
            }
            _ => None,
        }
    }
}

/// Whether the scene has to be as was asked for before: not for who only looks.
fn needs_all(command: &Command) -> bool {
    match command {
        Command::Ask { request, .. } => matches!(request, Request::Edit { .. } | Request::Undo {} | Request::Redo {}),
        Command::Export(_) | Command::Stop => true,
        Command::Watch => false,
    }
}

impl Solver {
    /// With the whole scene on the board, dark: a page that comes then finds it.
    pub fn new(session: Session, placed: Option<CameraPlace>, board: Arc<Board>) -> Solver {
        let model = session.model();
        let mut solver = Solver {
            session,
            model,
            board,
            history: History::default(),
            cameras: Vec::new(),
            changed: BTreeSet::new(),
            back: BTreeSet::new(),
            cut: BTreeMap::new(),
            exports: Vec::new(),
            shown: Vec::new(),
            last_post: None,
            is_done: false,
            edits: 0,
            edited: None,
            held: Vec::new(),
            latency: None,
            measured: Vec::new(),
            tracing: Growth::default(),
            sharpening: Growth::default(),
            settling: None,
            settled: None,
        };
        solver.post_scene(placed);
        solver.post_status();
        solver
    }

    /// Works until it is told to stop.
    pub fn run(mut self, mut commands: mpsc::Receiver<Command>) {
        loop {
            let mut waiting: Vec<Command> = Vec::new();
            if self.is_done && self.held.is_empty() && self.measured.is_empty() {
                match commands.blocking_recv() {
                    Some(command) => waiting.push(command),
                    None => return,
                }
            }
            while let Ok(command) = commands.try_recv() {
                waiting.push(command);
            }
            for command in waiting {
                if !self.take(command) {
                    return;
                }
            }
            if self.edited.is_none() && !self.release() {
                return;
            }
            self.turn();
            self.hand_out();
            // Nothing wakes this thread when a page reads its answers.
            let is_stuck = !self.measured.is_empty() && self.measured.iter().all(Asked::is_full);
            if is_stuck && self.is_done && self.held.is_empty() {
                std::thread::sleep(SLICE);
            }
        }
    }

    /// Does what is asked, at once or, of a gesture that goes on, when the last picture is there; whether to go on.
    fn take(&mut self, command: Command) -> bool {
        let Some(of) = Part::of(&command) else {
            return (!needs_all(&command) || self.release()) && self.obey(command, Instant::now());
        };
        if let Some(held) = self.held.iter_mut().find(|held| held.of == of) {
            held.command = command;
            return true;
        }
        // A page's own edits are made in its order; what others drag waits for the picture as before.
        let of_page = self.held.iter().position(|held| held.of.page == of.page).map(|place| self.held.remove(place));
        self.held.push(Held { command, since: Instant::now(), of });
        of_page.is_none_or(|held| self.obey(held.command, held.since))
    }

    /// Makes the edits that wait; whether to go on.
    fn release(&mut self) -> bool {
        std::mem::take(&mut self.held).into_iter().all(|held| self.obey(held.command, held.since))
    }

    /// Does what was asked at a time; whether to go on.
    fn obey(&mut self, command: Command, since: Instant) -> bool {
        match command {
            Command::Ask { page, request: Request::Plane { question, about }, answer } => {
                self.ask(Asked { page, question, what: Measured::Plane(Box::new(Plane::new(about))), answer });
            }
            Command::Ask { page, request: Request::Probe { question, object, triangle, uv }, answer } => {
                let place = SurfacePlace { object, triangle, uv };
                let what = Measured::Place(place);
                self.ask(Asked { page, question, what, answer });
            }
            Command::Ask { page, request: Request::Survey { question, object, places }, answer } => {
                let place = |(triangle, v, w)| SurfacePlace { object, triangle, uv: [v, w] };
                let survey = Survey::new(places.into_iter().map(place).collect());
                self.ask(Asked { page, question, what: Measured::Places(survey), answer });
            }
            Command::Ask { page, request: Request::InSight { question, matrix, fov, aspect }, answer } => {
                let survey = Survey::new(self.session.places_in_sight(&matrix, fov, aspect));
                self.ask(Asked { page, question, what: Measured::Sight(survey), answer });
            }
            Command::Ask { page, request, answer } => {
                if let Some(text) = self.answer(page, &request, since) {
                    // A page that does not read its answers misses them.
                    let _ = answer.try_send(text);
                }
            }
            Command::Watch => {}
            Command::Export(wanted) => self.exports.push(wanted),
            Command::Stop => return false,
        }
        true
    }

    /// In place of what the page asked of that kind before.
    fn ask(&mut self, asked: Asked) {
        self.measured.retain(|other| other.page != asked.page || other.what.kind() != asked.what.kind());
        let before = self.measured.iter().filter(|other| asked.what.kind() > 0 || other.what.kind() == 0).count();
        self.measured.insert(before, asked);
    }

    fn answer(&mut self, page: u64, request: &Request, since: Instant) -> Option<String> {
        match request {
            Request::Edit { edit, gesture } => {
                let label = history::label(edit, &self.model);
                match self.apply(edit, since) {
                    Ok(inverse) => {
                        let gesture: Option<Gesture> = gesture.map(|gesture| (page, gesture));
                        self.history.did(label, inverse, gesture);
                        self.post_history();
                        None
                    }
                    Err(error) => Some(unchanged(&error, &self.model)),
                }
            }
            Request::Undo {} | Request::Redo {} => {
                let is_undo = *request == Request::Undo {};
                let next = if is_undo { self.history.next_undo() } else { self.history.next_redo() };
                let edit = next?.clone();
                match self.apply(&edit, since) {
                    Ok(inverse) if is_undo => self.history.undid(inverse),
                    Ok(inverse) => self.history.redid(inverse),
                    Err(error) => return Some(unchanged(&error, &self.model)),
                }
                self.post_history();
                None
            }
            // The board keeps who looks at what, and what is measured waits until there is time.
            Request::Layer { .. }
            | Request::Probe { .. }
            | Request::Plane { .. }
            | Request::Survey { .. }
            | Request::InSight { .. } => None,
            Request::Rays { question, object, triangle } => {
                Some(Say::Rays { question: *question, rays: self.session.rays(*object, *triangle) }.text())
            }
            Request::Bookmark { camera } => self.keep(camera),
            Request::Forget { name } => {
                self.cameras.retain(|camera| camera.name != *name);
                self.post_cameras();
                None
            }
        }
    }

    fn apply(&mut self, edit: &Edit, since: Instant) -> Result<Edit, EditError> {
        let applied = self.session.apply(edit)?;
        (self.edited, self.is_done) = (self.edited.or(Some(since)), false);
        self.edits += 1;
        let status = self.session.status();
        (self.tracing, self.sharpening) = Default::default();
        self.settling = (status.rays == status.most_rays).then(Instant::now);
        self.post_model();
        Ok(applied.inverse)
    }

    /// Keeps a camera; what is said against it.
    fn keep(&mut self, camera: &CameraPlace) -> Option<String> {
        let is_sound = camera.matrix.iter().all(|x| x.is_finite() && x.abs() < 1e9)
            && (0.01..3.1).contains(&camera.fov)
            && (1..=LONGEST_NAME).contains(&camera.name.chars().count());
        if !is_sound {
            return Some(not_kept("the camera or its name is none"));
        }
        match self.cameras.iter().position(|kept| kept.name == camera.name) {
            Some(kept) => self.cameras[kept] = camera.clone(),
            None if self.cameras.len() == MOST_CAMERAS => {
                return Some(not_kept(&format!("there are {MOST_CAMERAS} cameras; forget one first")));
            }
            None => self.cameras.push(camera.clone()),
        }
        self.post_cameras();
        None
    }

    /// Works for a slice. What is measured waits while an edit is not seen; else it has half of it, or all that light leaves.
    fn turn(&mut self) {
        let started = Instant::now();
        let has_questions = self.edited.is_none() && !self.measured.iter().all(Asked::is_full);
        self.work(if has_questions { SLICE / 2 } else { SLICE });
        if self.edited.is_none() {
            self.measure(started + SLICE);
        }
    }

    /// A piece of work, and what is new of it on the board.
    fn work(&mut self, budget: Duration) {
        let mut is_complete = false;
        if !self.is_done {
            let step = self.session.step(budget);
            self.changed.extend(step.changed);
            (self.is_done, is_complete) = (step.is_done, step.is_complete || step.is_done);
            if is_complete {
                self.changed.append(&mut self.back);
            }
            let status = self.session.status();
            // The first picture of an edit takes no rays of those that are missing.
            if self.edited.is_none() {
                self.tracing.note(status.share);
            }
            if status.is_solved {
                self.sharpening.note(status.sharpened);
            }
            if self.is_done {
                self.settled = self.settling.take().map(|since| since.elapsed().as_secs_f64()).or(self.settled);
            } else if status.rays == status.most_rays {
                self.settling.get_or_insert_with(Instant::now);
            }
        }
        let due = self.last_post.is_none_or(|last| last.elapsed() >= EVERY);
        if !(due || self.is_done || self.board.has_new_layer() || (is_complete && self.edited.is_some())) {
            return;
        }
        self.post_light();
        self.last_post = Some(Instant::now());
        if let Some(edited) = self.edited.filter(|_| is_complete) {
            self.latency = Some(1e3 * edited.elapsed().as_secs_f64());
            self.edited = None;
        }
        self.post_status();
    }

    /// Light of the layers that are due.
    fn post_light(&mut self) {
        let mut layers = self.board.layers();
        // What most pages look at first.
        layers.sort_by_key(|(layer, _)| *layer != Layer::Total);
        self.shown.retain(|shown| layers.iter().any(|(layer, _)| *layer == shown.layer));
        for (layer, is_new) in layers {
            let place = self.shown.iter().position(|shown| shown.layer == layer).unwrap_or_else(|| {
                self.shown.push(Shown { layer, owed: BTreeSet::new(), last: None });
                self.shown.len() - 1
            });
            let shown = &mut self.shown[place];
            shown.owed.extend(&self.changed);
            if is_new {
                shown.owed.extend(self.model.objects.iter().map(|object| object.id));
            }
            let is_resting = shown.last.is_some_and(|(since, took)| since.elapsed() < REST * took);
            if is_resting && !is_new && !self.is_done && layer != Layer::Total {
                continue;
            }
            if !self.session.has_layer(layer) {
                continue;
            }
            let started = Instant::now();
            let owed = std::mem::take(&mut shown.owed);
            let is_there = |id: &&ObjectId| self.model.objects.get(id.0 as usize).is_some_and(|object| !object.deleted);
            let owed: Vec<ObjectId> = owed.iter().filter(is_there).copied().collect();
            // The layer itself is found once, by all threads.
            let first = owed.first().map(|id| self.light_of(*id, layer));
            let rest = owed.par_iter().skip(1).map(|id| self.light_of(*id, layer));
            let light: Vec<_> = first.into_par_iter().chain(rest).collect();
            for (id, (cuts, light)) in owed.into_iter().zip(light) {
                let light = self.post_cuts(id, cuts, light);
                self.board.post_light(layer, id.0, &light);
            }
            self.shown[place].last = Some((Instant::now(), started.elapsed()));
        }
        self.changed.clear();
    }

    /// Works on what pages wait for until a time, at least on a few points.
    fn measure(&mut self, until: Instant) {
        self.measured.retain(|asked| !asked.answer.is_closed());
        while let Some(next) = self.measured.iter().position(|asked| !asked.is_full()) {
            let left = until.saturating_duration_since(Instant::now());
            let question = self.measured[next].question;
            let text = match &mut self.measured[next].what {
                Measured::Place(place) => {
                    let probe = self.session.measures().then(|| self.session.probe(place));
                    probe.map(|probe| {
                        let answer = probe.map(|probe| self.read(&probe));
                        Say::Probe { question, answer }.text()
                    })
                }
                Measured::Plane(plane) => {
                    let measured = self.session.measure_plane(plane, left).transpose();
                    measured.map(|measured| self.tell_plane(question, measured))
                }
                Measured::Places(survey) => {
                    let surveyed = self.session.survey(survey, left);
                    surveyed.map(|surveyed| self.tell_survey(question, &surveyed))
                }
                Measured::Sight(survey) => {
                    let surveyed = self.session.survey(survey, left);
                    surveyed.map(|surveyed| Say::InSight { question, error: surveyed.off }.text())
                }
            };
            let asked = self.measured.remove(next);
            let Some(text) = text else {
                // Others have the next turn.
                self.measured.push(asked);
                return;
            };
            // A page asks nothing else of the kind before it has this.
            if let Err(TrySendError::Full(_)) = asked.answer.try_send(text) {
                self.measured.push(asked);
            }
            if left.is_zero() {
                return;
            }
        }
    }

    /// Gives everyone who wants it all there is, with the light of the last edit.
    fn hand_out(&mut self) {
        if self.edited.is_none() {
            for wanted in std::mem::take(&mut self.exports).into_iter().filter(|wanted| !wanted.is_closed()) {
                // Whoever has gone away meanwhile needs nothing.
                let _ = wanted.send(self.export());
            }
        }
    }

    fn export(&self) -> Export {
        let mut scene = self.session.edited_scene();
        for camera in &self.cameras {
            scene.cameras.push(radiosity::Camera {
                name: camera.name.clone(),
                world_from_camera: glam::DMat4::from_cols_array(&camera.matrix),
                projection: radiosity::Projection::Perspective { vertical_fov: camera.fov },
                aspect: None,
            });
        }
        let light = self.model.objects.iter().map(|object| self.session.light(object.id, Layer::Total)).collect();
        Export { scene, model: self.model.clone(), light }
    }
}

/// An edit that was refused.
fn unchanged(error: &EditError, model: &Model) -> String {
    Say::Refused { code: Refused::Edit, message: format!("Not changed: {}.", history::refusal(error, model)) }.text()
}

/// A camera that was refused.
fn not_kept(why: &str) -> String {
    Say::Refused { code: Refused::Camera, message: format!("Not kept: {why}.") }.text()
}

#[cfg(test)]
mod tests {
    use super::super::board::{Notice, Seen};
    use super::super::wire::{CUTS, cuts as cuts_frame};
    use super::*;
    use radiosity::session::{PlaneQuestion, SessionOptions};

    #[test]
    fn what_is_left_is_told_by_what_has_grown() {
        let mut growth = Growth::default();
        assert_eq!(growth.left(0.5), None);
        growth.since = Instant::now().checked_sub(Duration::from_secs(10)).map(|since| (since, 0.25));
        growth.note(0.26);
        assert_eq!((growth.left(0.25), growth.left(0.26), growth.left(0.1)), (None, None, None));
        for (share, seconds) in [(0.5, 20.0), (0.75, 5.0), (1.0, 0.0)] {
            let left = growth.left(share).unwrap();
            assert!((left - seconds).abs() < 0.1 + 0.01 * seconds, "{left} {seconds}");
        }
    }

    /// Of what two pages drag only the latest waits, each page's own, whatever else they look at meanwhile; an undo comes after.
    #[test]
    fn drags_of_two_pages_wait_side_by_side() {
        let options = SessionOptions { elements: 200, rays: 16, ..SessionOptions::default() };
        let session = Session::new(radiosity::cornell_box(), &options).unwrap();
        let mut solver = Solver::new(session, None, Arc::new(Board::new()));
        let blocks = solver.model.objects.iter().filter(|object| object.name.contains("block"));
        let blocks: Vec<ObjectId> = blocks.map(|object| object.id).take(2).collect();
        let (answer, _answers) = mpsc::channel(1);
        let ask = |page: u64, request: Request| Command::Ask { page, request, answer: answer.clone() };
        let moved = |page: u64, step: u32| {
            let matrix = glam::DMat4::from_translation(glam::DVec3::X * f64::from(step) * 1e-3).to_cols_array();
            let edit = Edit::Move { object: blocks[page as usize], matrix };
            ask(page, Request::Edit { edit, gesture: Some(1) })
        };
        for step in 1..=20 {
            for page in 0..2 {
                assert!(solver.take(moved(page, step)));
                let rays = Request::Rays { question: 1, object: blocks[0], triangle: 0 };
                assert!(solver.take(ask(page, rays)));
            }
        }
        assert_eq!((solver.held.len(), solver.edits), (2, 0));
        assert!(solver.take(ask(1, Request::Undo {})));
        assert_eq!((solver.held.len(), solver.edits), (0, 3));
        let x = |object: ObjectId| solver.model.objects[object.0 as usize].matrix[12];
        assert_eq!(blocks.iter().map(|block| x(*block)).collect::<Vec<_>>(), [0.02, 0.0]);
    }

    /// What was deleted in the light and comes back in the dark is dark.
    #[test]
    fn what_comes_back_has_the_light_of_now() {
        let options = SessionOptions { elements: 200, rays: 16, ..SessionOptions::default() };
        let session = Session::new(radiosity::cornell_box(), &options).unwrap();
        let board = Arc::new(Board::new());
        board.watch(Layer::Total);
        let mut solver = Solver::new(session, None, board.clone());
        // Whether the board has light of an object, as a page that comes then is sent it.
        let is_lit = |solver: &mut Solver, object: ObjectId| {
            while !solver.is_done {
                solver.turn();
            }
            let mut seen = Seen::default();
            while board.next_notice(None, &mut seen).is_some() {}
            let frames = std::iter::from_fn(|| Some(board.next_light(Layer::Total, &mut seen)));
            let chunks = frames.take_while(|chunks| !chunks.is_empty()).flatten();
            chunks.filter(|chunk| chunk.object == object.0).any(|chunk| chunk.values.iter().any(|value| *value != 0))
        };
        let block = solver.model.objects.iter().find(|object| object.name.contains("block")).unwrap().id;
        assert!(is_lit(&mut solver, block));
        let (answer, _answers) = mpsc::channel(1);
        let ask = |request: Request| Command::Ask { page: 0, request, answer: answer.clone() };
        let off = Edit::Light { light: solver.model.lights[0].id, dimming: 0.0, colour: [1.0; 3] };
        for edit in [off, Edit::Delete { object: block }] {
            assert!(solver.take(ask(Request::Edit { edit, gesture: None })));
        }
        is_lit(&mut solver, block);
        assert!(solver.take(ask(Request::Undo {})));
        assert!(!is_lit(&mut solver, block), "it is dark");
    }

    /// How objects are cut and the light of their cuts bear the same number in all layers, before and after an edit, and a page that
    /// comes later is sent no more of it than there is.
    #[test]
    fn cuts_and_their_light_bear_a_number() {
        let mut scene = radiosity::cornell_box();
        scene.lights.push(radiosity::PointLight {
            name: "lamp".to_owned(),
            kind: radiosity::PointLightKind::Point,
            position: glam::DVec3::new(0.3, 0.5, 0.1),
            direction: glam::DVec3::NEG_Y,
            intensity: [100.0; 3],
            range: None,
        });
        let options = SessionOptions { elements: 600, rays: 16, places: 5000, ..SessionOptions::default() };
        let board = Arc::new(Board::new());
        let layers = [Layer::Total, Layer::Indirect];
        layers.iter().for_each(|layer| board.watch(*layer));
        let mut solver = Solver::new(Session::new(scene, &options).unwrap(), None, board.clone());
        let words = |bytes: &[u8]| -> Vec<u32> {
            bytes.chunks_exact(4).map(|word| u32::from_le_bytes([word[0], word[1], word[2], word[3]])).collect()
        };
        let (mut most, mut edges) = (0, 0);
        for shift in [0.0, 0.05] {
            let block = solver.model.objects.iter().find(|object| object.name.contains("block")).unwrap().id;
            let matrix = glam::DMat4::from_translation(glam::DVec3::X * shift).to_cols_array();
            let (answer, _answers) = mpsc::channel(1);
            let edit = Edit::Move { object: block, matrix };
            assert!(solver.take(Command::Ask { page: 0, request: Request::Edit { edit, gesture: None }, answer }));
            solver.turn();
            while !solver.is_done {
                solver.turn();
            }
            let mut seen = Seen::default();
            let notices: Vec<_> = std::iter::from_fn(|| board.next_notice(None, &mut seen)).collect();
            let cuts: Vec<Vec<u32>> = notices
                .iter()
                .filter_map(|notice| match notice {
                    Notice::Binary(bytes) => Some(words(bytes)).filter(|words| words[0] == CUTS),
                    Notice::Text(_) => None,
                })
                .collect();
            assert!(cuts.iter().any(|cuts| cuts.len() > 3), "{cuts:?}");
            for layer in layers {
                seen.forget_light();
                let frames = std::iter::from_fn(|| Some(board.next_light(layer, &mut seen)));
                let chunks: Vec<_> = frames.take_while(|chunks| !chunks.is_empty()).flatten().collect();
                for cuts in &cuts {
                    let (object, number) = (cuts[1], cuts[2]);
                    most = most.max(number);
                    let own = chunks.iter().filter(|chunk| chunk.object == object);
                    let values: BTreeMap<u32, u16> = own
                        .flat_map(|chunk| {
                            chunk.values.iter().enumerate().map(|(k, x)| (3 * chunk.first + k as u32, *x))
                        })
                        .collect();
                    let vertices = solver.model.objects[object as usize].positions.len() as u32;
                    let own = solver.session.cuts(ObjectId(object));
                    let places: u32 = own.iter().map(|cut| cut.places().len() as u32).sum();
                    edges += own.iter().filter(|cut| cut.edge.is_some()).count();
                    assert_eq!(words(&cuts_frame(ObjectId(object), number, &own)), *cuts);
                    let whole = if places > 0 { vertices + 1 + places } else { vertices };
                    assert_eq!(values.len() as u32, 3 * whole, "{layer:?} of object {object}");
                    if places > 0 {
                        assert_eq!(u32::from(values[&(3 * vertices)]), number, "{layer:?} of object {object}");
                    }
                }
            }
        }
        assert!(most > 1 && edges > 0, "what was cut has changed, and there are edges: {most} {edges}");
    }

    /// A page that has not read other answers gets its plane when it has; meanwhile other pages get theirs.
    #[test]
    fn a_plane_waits_until_its_page_reads() {
        let options = SessionOptions { elements: 200, rays: 16, ..SessionOptions::default() };
        let session = Session::new(radiosity::cornell_box(), &options).unwrap();
        let mut solver = Solver::new(session, None, Arc::new(Board::new()));
        let object = solver.model.objects.iter().find(|object| object.name == "floor").unwrap().id;
        let about = PlaneQuestion { object, triangle: 0, uv: [0.3, 0.3], height: 0.05, border: 0.1 };
        let (slow, mut unread) = mpsc::channel(1);
        let (quick, mut answers) = mpsc::channel(1);
        slow.try_send("unread".to_owned()).unwrap();
        for (page, question, answer) in [(0, 7, &slow), (1, 8, &quick)] {
            let request = Request::Plane { question, about };
            assert!(solver.take(Command::Ask { page, request, answer: answer.clone() }));
        }
        let is_answer =
            |text: &str, question: u64| text.contains(&format!("\"question\":{question}")) && text.contains("points");
        let told = (0..100_000).find_map(|_| {
            solver.turn();
            answers.try_recv().ok()
        });
        assert!(told.is_some_and(|text| is_answer(&text, 8)));
        (0..10).for_each(|_| solver.turn());
        assert_eq!(unread.try_recv().as_deref(), Ok("unread"));
        let told = (0..100_000).find_map(|_| {
            solver.turn();
            unread.try_recv().ok()
        });
        assert!(told.is_some_and(|text| is_answer(&text, 7)));
        assert!(solver.measured.is_empty());
    }
}
