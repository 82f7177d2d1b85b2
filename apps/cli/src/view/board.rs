//! What there is to see, for any number of pages: the solver posts, each page takes at its own pace.
//!
//! A notice has a key, and only the latest of a key is kept, under a revision that grows with each post. A page that
//! remembers the last revision it was sent is owed exactly what is newer: a new page everything, one that was slow what it
//! missed without what was outdated meanwhile. So nobody waits for a page and no page fills the memory. How far the solution is comes
//! after the light that it tells of, or what has replaced that, once a page has caught up.

use axum::body::Bytes;
use radiosity::session::Layer;
use std::collections::{BTreeMap, HashMap};
use std::sync::{Mutex, MutexGuard, PoisonError};
use tokio::sync::watch;

/// Vertices whose light is one notice: 6 kB. Fewer, and headers weigh; more, and a change sends what did not change.
pub const CHUNK: usize = 1024;

/// Layers whose light is looked after: of more, those that were asked for first rest until others are left. Each takes the
/// time of some sweeps over all rays whenever light changes, and 6 bytes a vertex.
pub const MOST_LAYERS: usize = 8;

/// What a notice is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Subject {
    /// The scene as a whole: name, axes, cameras.
    Scene,
    /// Triangles of an object.
    Mesh(u32),
    /// Elements of an object that are cut.
    Cuts(u32),
    /// An object: where it is, what it is made of.
    Object(u32),
    /// A light.
    Light(u32),
    /// Cameras that people have kept.
    Bookmarks,
    /// What can be undone.
    History,
    /// How far the solution is.
    Status,
}

/// A notice as it goes over the wire.
#[derive(Clone, Debug, PartialEq)]
pub enum Notice {
    /// JSON.
    Text(String),
    /// Triangles.
    Binary(Bytes),
}

/// Light of some vertices of one object.
#[derive(Clone, Debug, PartialEq)]
pub struct LightChunk {
    /// The object.
    pub object: u32,
    /// Its first vertex here.
    pub first: u32,
    /// Three half floats for each.
    pub values: Vec<u16>,
}

/// The latest of each key, by the order of posting.
struct Latest<K, V> {
    posts: HashMap<K, (u64, V)>,
    order: BTreeMap<u64, K>,
}

impl<K, V> Default for Latest<K, V> {
    fn default() -> Self {
        Latest { posts: HashMap::new(), order: BTreeMap::new() }
    }
}

impl<K: Copy + Eq + std::hash::Hash, V: PartialEq> Latest<K, V> {
    /// Whether it is news.
    fn post(&mut self, key: K, value: V, revision: u64) -> bool {
        if let Some((old, held)) = self.posts.get(&key) {
            if *held == value {
                return false;
            }
            self.order.remove(old);
        }
        self.order.insert(revision, key);
        self.posts.insert(key, (revision, value));
        true
    }

    fn remove(&mut self, key: &K) -> bool {
        let Some((revision, _)) = self.posts.remove(key) else { return false };
        self.order.remove(&revision);
        true
    }

    /// The latest of a key, and its revision.
    fn of(&self, key: &K) -> Option<(u64, &V)> {
        self.posts.get(key).map(|(revision, value)| (*revision, value))
    }

    fn after(&self, seen: u64) -> impl Iterator<Item = (u64, K, &V)> {
        self.order.range(seen + 1..).map(|(revision, key)| (*revision, *key, &self.posts[key].1))
    }
}

/// Light of one layer and how many pages look at it.
#[derive(Default)]
struct Watched {
    pages: usize,
    /// The solver has taken notice of it.
    is_known: bool,
    light: Latest<(u32, u32), LightChunk>,
}

#[derive(Default)]
struct Posts {
    revision: u64,
    notices: Latest<Subject, Notice>,
    /// The one that was asked for last is last.
    layers: Vec<(Layer, Watched)>,
}

impl Posts {
    /// The first notice that a page has not seen, but for how far the solution is.
    fn owed(&self, seen: &Seen) -> Option<(u64, &Notice)> {
        let mut others = self.notices.after(seen.notices).filter(|(_, subject, _)| *subject != Subject::Status);
        others.next().map(|(revision, _, notice)| (revision, notice))
    }

    /// Layers that are looked after; those that rest keep no light.
    fn awake(&mut self) -> &mut [(Layer, Watched)] {
        let resting = self.layers.len().saturating_sub(MOST_LAYERS);
        let (resting, awake) = self.layers.split_at_mut(resting);
        for (_, watched) in resting.iter_mut().filter(|(_, watched)| watched.is_known) {
            *watched = Watched { pages: watched.pages, ..Watched::default() };
        }
        awake
    }
}

/// What a page was sent.
#[derive(Clone, Debug, Default)]
pub struct Seen {
    notices: u64,
    status: u64,
    light: u64,
    held: Option<Held>,
}

/// How far the solution was, which waits for light.
#[derive(Clone, Debug)]
struct Held {
    revision: u64,
    status: Notice,
    /// The revision up to which light goes before it.
    light: u64,
}

impl Seen {
    /// Another layer is looked at: none of its light was sent, and how far that is is told after it.
    pub fn forget_light(&mut self) {
        self.light = 0;
        self.forget_status();
    }

    /// How far the solution is is told again, after the light.
    pub fn forget_status(&mut self) {
        (self.status, self.held) = (0, None);
    }
}

/// Most bytes of light in one frame.
const FRAME: usize = 1 << 18;

/// The board.
pub struct Board {
    posts: Mutex<Posts>,
    news: watch::Sender<u64>,
}

impl Board {
    /// With nothing on it.
    pub fn new() -> Board {
        Board { posts: Mutex::default(), news: watch::Sender::new(0) }
    }

    /// Wakes whoever waits for news.
    pub fn subscribe(&self) -> watch::Receiver<u64> {
        self.news.subscribe()
    }

    fn lock(&self) -> MutexGuard<'_, Posts> {
        self.posts.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Puts a notice up in place of the last one on its subject.
    pub fn post(&self, subject: Subject, notice: Notice) {
        let mut posts = self.lock();
        let revision = posts.revision + 1;
        if posts.notices.post(subject, notice, revision) {
            posts.revision = revision;
            drop(posts);
            self.news.send_replace(revision);
        }
    }

    /// Puts up the light of all vertices of an object; only chunks that differ from what hangs there are news.
    pub fn post_light(&self, layer: Layer, object: u32, values: &[u16]) {
        let mut posts = self.lock();
        let mut revision = posts.revision;
        // A layer that nobody looks at any more is not kept.
        let Some((_, watched)) = posts.awake().iter_mut().find(|(of, _)| *of == layer) else { return };
        for (chunk, values) in values.chunks(3 * CHUNK).enumerate() {
            let chunk = chunk as u32;
            let light = LightChunk { object, first: chunk * CHUNK as u32, values: values.to_vec() };
            if watched.light.post((object, chunk), light, revision + 1) {
                revision += 1;
            }
        }
        // There were more when more of it was cut.
        let mut past = values.len().div_ceil(3 * CHUNK) as u32;
        while watched.light.remove(&(object, past)) {
            past += 1;
        }
        if revision > posts.revision {
            posts.revision = revision;
            drop(posts);
            self.news.send_replace(revision);
        }
    }

    /// A page looks at a layer from now on.
    pub fn watch(&self, layer: Layer) {
        let layers = &mut self.lock().layers;
        let known = layers.iter().position(|(of, _)| *of == layer).map(|place| layers.remove(place).1);
        let known = known.unwrap_or_default();
        layers.push((layer, Watched { pages: known.pages + 1, ..known }));
    }

    /// Whether a layer is not looked after, because there are too many others.
    pub fn is_resting(&self, layer: Layer) -> bool {
        !self.lock().awake().iter().any(|(of, _)| *of == layer)
    }

    /// A page does so no longer.
    pub fn unwatch(&self, layer: Layer) {
        let mut posts = self.lock();
        if let Some((_, watched)) = posts.layers.iter_mut().find(|(of, _)| *of == layer) {
            watched.pages -= 1;
        }
        posts.layers.retain(|(_, watched)| watched.pages > 0);
    }

    /// Layers that pages look at, and of each whether it is new since this was asked last: all its light is to be posted
    /// then. One that nobody looked at for a moment is new again, as its light was not kept.
    pub fn layers(&self) -> Vec<(Layer, bool)> {
        let known = |watched: &mut Watched| !std::mem::replace(&mut watched.is_known, true);
        self.lock().awake().iter_mut().map(|(layer, watched)| (*layer, known(watched))).collect()
    }

    /// Whether there is a layer that is new.
    pub fn has_new_layer(&self) -> bool {
        self.lock().awake().iter().any(|(_, watched)| !watched.is_known)
    }

    /// The next notice that a page has not seen. How far the solution is comes last, and waits for the light of a layer: for what there
    /// was of it then, and is not replaced by newer light, so that a slow page is told, too. What has to wait is not replaced by what is newer.
    pub fn next_notice(&self, layer: Option<Layer>, seen: &mut Seen) -> Option<Notice> {
        let mut posts = self.lock();
        let is_coming = posts.awake().iter().any(|(of, watched)| Some(*of) == layer && !watched.is_known);
        if let Some((revision, notice)) = posts.owed(seen) {
            seen.notices = revision;
            return Some(notice.clone());
        }
        let held = match seen.held.take() {
            Some(held) => held,
            None => {
                let (revision, status) =
                    posts.notices.of(&Subject::Status).filter(|(revision, _)| *revision > seen.status)?;
                if is_coming {
                    return None;
                }
                Held { revision, status: status.clone(), light: posts.revision }
            }
        };
        let watched = posts.layers.iter().find(|(of, _)| Some(*of) == layer);
        let owed = watched.and_then(|(_, watched)| watched.light.after(seen.light).next());
        if owed.is_some_and(|(owed, ..)| owed <= held.light) {
            seen.held = Some(held);
            return None;
        }
        seen.status = held.revision;
        Some(held.status)
    }

    /// The next light of a layer that a page has not seen, about a frame of it. What was posted before it comes before it: a page makes
    /// nothing of the light of triangles and of cuts that it has not heard of, and it is not sent again.
    pub fn next_light(&self, layer: Layer, seen: &mut Seen) -> Vec<LightChunk> {
        let posts = self.lock();
        let Some((_, watched)) = posts.layers.iter().find(|(of, _)| *of == layer) else { return Vec::new() };
        let told = posts.owed(seen).map_or(u64::MAX, |(revision, _)| revision);
        let (mut chunks, mut bytes) = (Vec::new(), 0);
        for (revision, _, chunk) in watched.light.after(seen.light).take_while(|(revision, ..)| *revision < told) {
            seen.light = revision;
            bytes += 2 * chunk.values.len();
            chunks.push(chunk.clone());
            if bytes >= FRAME {
                break;
            }
        }
        chunks
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(board: &Board, seen: &mut Seen) -> Option<String> {
        board.next_notice(None, seen).map(|notice| match notice {
            Notice::Text(text) => text,
            Notice::Binary(_) => panic!("text was posted"),
        })
    }

    #[test]
    fn a_slow_page_gets_the_latest_and_a_new_one_everything() {
        let board = Board::new();
        let (mut quick, mut slow) = (Seen::default(), Seen::default());
        board.post(Subject::Scene, Notice::Text("scene".into()));
        assert_eq!(text(&board, &mut quick).as_deref(), Some("scene"));
        for step in 0..1000 {
            board.post(Subject::Status, Notice::Text(step.to_string()));
        }
        board.post(Subject::Status, Notice::Text("999".into()));
        assert_eq!(text(&board, &mut quick).as_deref(), Some("999"));
        assert_eq!(text(&board, &mut quick), None);
        assert_eq!(text(&board, &mut slow).as_deref(), Some("scene"));
        assert_eq!(text(&board, &mut slow).as_deref(), Some("999"));
        assert_eq!(text(&board, &mut slow), None);
    }

    /// What is said of light comes after it, even to a page that is never sent all of it.
    #[test]
    fn how_far_the_solution_is_comes_after_its_light() {
        let board = Board::new();
        let mut seen = Seen::default();
        let layer = Layer::Total;
        board.watch(layer);
        board.layers();
        let say = |text: &str| board.post(Subject::Status, Notice::Text(text.into()));
        // Each a frame of its own.
        let post = |object: u32, value: u16| board.post_light(layer, object, &vec![value; FRAME / 2]);
        let next = |seen: &mut Seen| match board.next_notice(Some(layer), seen) {
            Some(Notice::Text(text)) => Some(text),
            _ => None,
        };
        let sent = |seen: &mut Seen| board.next_light(layer, seen).first().map(|chunk| chunk.object);
        post(0, 1);
        post(1, 1);
        say("lit");
        board.post(Subject::History, Notice::Text("history".into()));
        assert_eq!(next(&mut seen).as_deref(), Some("history"));
        assert_eq!((next(&mut seen), sent(&mut seen)), (None, Some(0)));
        assert_eq!(next(&mut seen), None);
        // What is newer does not hold it up, and waits for its own light.
        post(0, 2);
        say("brighter");
        assert_eq!(sent(&mut seen), Some(1));
        assert_eq!(next(&mut seen).as_deref(), Some("lit"));
        assert_eq!((next(&mut seen), sent(&mut seen)), (None, Some(0)));
        assert_eq!(next(&mut seen).as_deref(), Some("brighter"));
        assert_eq!((next(&mut seen), sent(&mut seen)), (None, None));
        // To a page that looks at it anew it is told anew, after all of the light.
        seen.forget_light();
        assert_eq!((next(&mut seen), sent(&mut seen)), (None, Some(1)));
        assert_eq!((next(&mut seen), sent(&mut seen)), (None, Some(0)));
        assert_eq!(next(&mut seen).as_deref(), Some("brighter"));
        // Of a layer that nobody has posted yet nothing is told before that; of one that rests at once.
        let other = Layer::Direct;
        board.watch(other);
        seen.forget_light();
        assert!(board.next_notice(Some(other), &mut seen).is_none());
        board.layers();
        board.post_light(other, 0, &[1; 3]);
        assert!(board.next_notice(Some(other), &mut seen).is_none());
        assert_eq!(board.next_light(other, &mut seen).len(), 1);
        assert!(board.next_notice(Some(other), &mut seen).is_some());
        (1..=MOST_LAYERS as u32).for_each(|bounce| board.watch(Layer::Bounce(bounce)));
        assert!(board.is_resting(layer));
        seen.forget_light();
        while board.next_notice(Some(layer), &mut seen).is_none() {
            assert!(!board.next_light(layer, &mut seen).is_empty());
        }
    }

    /// However the two questions of a page and what is posted come after each other.
    #[test]
    fn light_never_comes_before_the_cuts_that_it_is_of() {
        let board = Board::new();
        let mut seen = Seen::default();
        let layer = Layer::Total;
        board.watch(layer);
        board.layers();
        board.post_light(layer, 7, &[1; 3]);
        assert!(board.next_notice(Some(layer), &mut seen).is_none());
        // The solver is quicker than the page is to ask for light.
        board.post(Subject::Cuts(7), Notice::Text("cuts".into()));
        board.post_light(layer, 7, &[2; 6]);
        board.post_light(layer, 8, &[3; 3]);
        assert!(board.next_light(layer, &mut seen).is_empty());
        assert_eq!(text(&board, &mut seen).as_deref(), Some("cuts"));
        assert_eq!(board.next_light(layer, &mut seen).len(), 2);
        // Older light need not wait.
        board.post_light(layer, 8, &[4; 3]);
        board.post(Subject::Cuts(7), Notice::Text("other cuts".into()));
        assert_eq!(board.next_light(layer, &mut seen).len(), 1);
    }

    #[test]
    fn of_many_layers_those_asked_for_first_rest() {
        let board = Board::new();
        let most = MOST_LAYERS as u32;
        (0..most + 2).for_each(|bounce| board.watch(Layer::Bounce(bounce)));
        let awake = || board.layers().into_iter().map(|(layer, _)| layer).collect::<Vec<_>>();
        assert_eq!(awake(), (2..most + 2).map(Layer::Bounce).collect::<Vec<_>>());
        board.watch(Layer::Bounce(0));
        board.watch(Layer::Total);
        assert!(board.is_resting(Layer::Bounce(3)) && !board.is_resting(Layer::Bounce(0)));
        let mut seen = Seen::default();
        board.post_light(Layer::Bounce(4), 1, &[1; 30]);
        assert_eq!(board.next_light(Layer::Bounce(4), &mut seen).len(), 1);
        board.unwatch(Layer::Bounce(5));
        assert!(!board.is_resting(Layer::Bounce(3)));
        assert!(board.layers().contains(&(Layer::Bounce(3), true)), "its light is to be posted anew");
        board.unwatch(Layer::Bounce(0));
        assert!(board.is_resting(Layer::Bounce(2)), "one page still looks at bounce 0");
    }

    #[test]
    fn only_chunks_that_changed_are_news() {
        let board = Board::new();
        let layer = Layer::Total;
        board.post_light(layer, 1, &[1; 30]);
        assert_eq!(board.next_light(layer, &mut Seen::default()), [], "nobody looked");
        board.watch(layer);
        let mut values = vec![1u16; 3 * (2 * CHUNK + 10)];
        board.post_light(layer, 7, &values);
        let mut seen = Seen::default();
        assert_eq!(board.next_light(layer, &mut seen).len(), 3);
        values[3 * CHUNK + 5] = 2;
        board.post_light(layer, 7, &values);
        let news = board.next_light(layer, &mut seen);
        assert_eq!(news.len(), 1);
        assert_eq!((news[0].object, news[0].first), (7, CHUNK as u32));
        assert_eq!(board.layers(), [(layer, true)]);
        assert_eq!(board.layers(), [(layer, false)]);
        board.unwatch(layer);
        board.watch(layer);
        assert_eq!(board.layers(), [(layer, true)], "its light was not kept meanwhile");
        board.unwatch(layer);
        assert!(board.layers().is_empty());
    }
}
