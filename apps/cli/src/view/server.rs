//! The server: the page, its pictures and files over HTTP, everything else over one WebSocket a page.

use super::board::{Board, MOST_LAYERS, Notice, Seen};
use super::files;
use super::guard::{Guard, Refusal};
use super::solver::{Command, Export};
use super::wire::{self, LONGEST, MOST_PLACES, Refused, Request, Say};
use axum::Router;
use axum::body::{Body, Bytes};
use axum::extract::ws::{Message, WebSocket, WebSocketUpgrade};
use axum::extract::{Path, Request as HttpRequest, State};
use axum::http::{HeaderValue, Method, StatusCode, header};
use axum::middleware::{self, Next};
use axum::response::{IntoResponse, Redirect, Response};
use axum::routing::get;
use radiosity::session::{Layer, MOST_BOUNCES};
use radiosity::{Scene, Texture};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::time::{Duration, Instant};
use tokio::sync::{Semaphore, mpsc, oneshot};
use tokio::time::MissedTickBehavior;

/// The page, as `cargo xtask viewer` makes it.
const PAGE: &str = include_str!("../../../viewer/dist/index.html");

/// What the page has in the places where the nonce goes.
const NONCE: &str = "nonce=\"NONCE\"";

/// Pages at a time.
const MOST_PAGES: usize = 32;

/// Answers that wait for a page.
const ANSWERS: usize = 64;

/// A page that takes nothing for so long is gone.
const PATIENCE: Duration = Duration::from_secs(30);

/// How pages are asked whether they are still there: a machine that went to sleep or lost its network closes nothing.
#[derive(Clone, Copy)]
struct Pace {
    /// So often.
    ping: Duration,
    /// One that says nothing for so long is gone; it misses two pings then.
    silence: Duration,
}

const PACE: Pace = Pace { ping: Duration::from_secs(20), silence: Duration::from_secs(60) };

/// What all requests share.
pub struct Server {
    guard: Guard,
    board: Arc<Board>,
    commands: mpsc::Sender<Command>,
    textures: Vec<Texture>,
    pages: AtomicUsize,
    next_page: AtomicU64,
    /// Models that are being written for people.
    downloads: Semaphore,
    pace: Pace,
}

impl Server {
    /// For a scene whose solver listens to `commands` and posts on the board.
    pub fn new(guard: Guard, board: Arc<Board>, commands: mpsc::Sender<Command>, scene: &Scene) -> Arc<Server> {
        let textures = scene.textures.clone();
        let (pages, next_page) = (AtomicUsize::new(0), AtomicU64::new(0));
        Arc::new(Server {
            guard,
            board,
            commands,
            textures,
            pages,
            next_page,
            downloads: Semaphore::new(1),
            pace: PACE,
        })
    }

    /// All that is answered.
    pub fn router(self: &Arc<Server>) -> Router {
        Router::new()
            .route("/{token}", get(home))
            .route("/{token}/", get(page))
            .route("/{token}/socket", get(socket))
            .route("/{token}/texture/{file}", get(texture))
            .route("/{token}/scene.glb", get(edited_scene))
            .route("/{token}/lit.glb", get(lit_model))
            .layer(middleware::from_fn_with_state(self.clone(), guarded))
            .with_state(self.clone())
    }
}

/// Lets in only who may ask, and tells browsers to load and send nothing elsewhere.
async fn guarded(State(server): State<Arc<Server>>, request: HttpRequest, next: Next) -> Response {
    let opens_socket = request.headers().contains_key(header::UPGRADE);
    let is_reading = request.method() == Method::GET || request.method() == Method::HEAD;
    let mut response = match server.guard.check(request.uri().path(), request.headers(), opens_socket) {
        Err(refusal) => {
            let status = if refusal == Refusal::Host { StatusCode::MISDIRECTED_REQUEST } else { StatusCode::FORBIDDEN };
            (status, format!("{refusal}\n")).into_response()
        }
        Ok(()) if !is_reading => StatusCode::METHOD_NOT_ALLOWED.into_response(),
        Ok(()) => next.run(request).await,
    };
    for (name, value) in [
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (header::REFERRER_POLICY, "no-referrer"),
        (header::CACHE_CONTROL, "no-store"),
        (header::HeaderName::from_static("cross-origin-opener-policy"), "same-origin"),
        (header::HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
    ] {
        response.headers_mut().insert(name, HeaderValue::from_static(value));
    }
    response
}

/// The page, for who left out the last slash.
async fn home(Path(token): Path<String>) -> Redirect {
    Redirect::permanent(&format!("/{token}/"))
}

async fn page() -> Response {
    let mut bytes = [0; 16];
    if getrandom::fill(&mut bytes).is_err() {
        return StatusCode::INTERNAL_SERVER_ERROR.into_response();
    }
    let nonce: String = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
    let policy = format!(
        "default-src 'none'; script-src 'nonce-{nonce}'; style-src 'nonce-{nonce}'; style-src-attr 'unsafe-inline'; img-src 'self' data: blob:; \
         connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    );
    let html = PAGE.replace(NONCE, &format!("nonce=\"{nonce}\""));
    let headers =
        [(header::CONTENT_TYPE, "text/html; charset=utf-8".to_owned()), (header::CONTENT_SECURITY_POLICY, policy)];
    (headers, html).into_response()
}

async fn texture(State(server): State<Arc<Server>>, Path((_, file)): Path<(String, String)>) -> Response {
    let index = file.strip_suffix(".png").and_then(|index| index.parse::<usize>().ok());
    let Some(index) = index.filter(|index| *index < server.textures.len()) else {
        return StatusCode::NOT_FOUND.into_response();
    };
    let made = tokio::task::spawn_blocking(move || wire::texture(&server.textures[index])).await;
    match made {
        Ok(Ok(png)) => ([(header::CONTENT_TYPE, "image/png")], png).into_response(),
        Ok(Err(error)) => (StatusCode::INTERNAL_SERVER_ERROR, error).into_response(),
        Err(_) => StatusCode::INTERNAL_SERVER_ERROR.into_response(),
    }
}

async fn edited_scene(State(server): State<Arc<Server>>) -> Response {
    download(&server, "edited", files::edited).await
}

async fn lit_model(State(server): State<Arc<Server>>) -> Response {
    download(&server, "lit", files::lit).await
}

async fn download(
    server: &Server,
    suffix: &str,
    write: fn(Export) -> Result<Vec<u8>, radiosity::io::gltf_out::WriteError>,
) -> Response {
    // One at a time: each has the scene once more.
    let Ok(_turn) = server.downloads.acquire().await else { return StatusCode::SERVICE_UNAVAILABLE.into_response() };
    let (sender, wanted) = oneshot::channel();
    if server.commands.send(Command::Export(sender)).await.is_err() {
        return StatusCode::SERVICE_UNAVAILABLE.into_response();
    }
    let Ok(export) = wanted.await else { return StatusCode::SERVICE_UNAVAILABLE.into_response() };
    let stem: String = export.model.name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' }).collect();
    let stem = if stem.is_empty() { "scene".to_owned() } else { stem };
    match tokio::task::spawn_blocking(move || write(export)).await {
        Ok(Ok(bytes)) => {
            let name = format!("attachment; filename=\"{stem}-{suffix}.glb\"");
            let headers = [(header::CONTENT_TYPE, "model/gltf-binary".to_owned()), (header::CONTENT_DISPOSITION, name)];
            (headers, Body::from(bytes)).into_response()
        }
        Ok(Err(error)) => (StatusCode::INTERNAL_SERVER_ERROR, format!("{error}\n")).into_response(),
        Err(_) => StatusCode::INTERNAL_SERVER_ERROR.into_response(),
    }
}

async fn socket(State(server): State<Arc<Server>>, upgrade: WebSocketUpgrade) -> Response {
    let there = server.pages.fetch_add(1, Ordering::Relaxed);
    let place = Place { server };
    if there >= MOST_PAGES {
        let text = format!("{MOST_PAGES} pages look at this scene already; close one\n");
        return (StatusCode::SERVICE_UNAVAILABLE, text).into_response();
    }
    upgrade.max_message_size(2 * LONGEST).max_frame_size(2 * LONGEST).on_upgrade(move |socket| serve(place, socket))
}

/// The place of a page among those that there may be.
struct Place {
    server: Arc<Server>,
}

impl Drop for Place {
    fn drop(&mut self) {
        self.server.pages.fetch_sub(1, Ordering::Relaxed);
        // Its layer is left by now, and one that rested for it is to be looked after. Who is busy looks anyway.
        let _ = self.server.commands.try_send(Command::Watch);
    }
}

/// The layer that a page looks at, for as long as it does.
struct Watch {
    board: Arc<Board>,
    layer: Layer,
    epoch: u32,
    /// Whether the page knows that its layer rests.
    is_told: bool,
}

impl Watch {
    fn new(board: &Arc<Board>, layer: Layer, epoch: u32) -> Watch {
        board.watch(layer);
        Watch { board: board.clone(), layer, epoch, is_told: false }
    }

    /// What the page is to be told if its layer is not looked after.
    fn complaint(&mut self) -> Option<String> {
        let is_resting = self.board.is_resting(self.layer);
        let is_news = !std::mem::replace(&mut self.is_told, is_resting) && is_resting;
        let message = format!(
            "Pages look at more than {MOST_LAYERS} different layers of light; this one stays as it is until one of them is left."
        );
        is_news.then(|| Say::Refused { code: Refused::Layer, message }.text())
    }
}

impl Drop for Watch {
    fn drop(&mut self) {
        self.board.unwatch(self.layer);
    }
}

/// Sends a page what it has not seen and passes on what it asks, until it goes.
async fn serve(place: Place, mut socket: WebSocket) {
    let server = &place.server;
    let page = server.next_page.fetch_add(1, Ordering::Relaxed);
    let (answer, mut answers) = mpsc::channel::<String>(ANSWERS);
    let mut news = server.board.subscribe();
    let mut seen = Seen::default();
    let mut watch: Option<Watch> = None;
    let mut is_caught_up = false;
    let mut heard = Instant::now();
    let mut ping = tokio::time::interval(server.pace.ping);
    ping.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        news.mark_unchanged();
        // What a page has to know first is all that is not light.
        let layer = watch.as_ref().filter(|_| is_caught_up).map(|watch| watch.layer);
        let mut next = server.board.next_notice(layer, &mut seen).map(|notice| match notice {
            Notice::Text(text) => Message::Text(text.into()),
            Notice::Binary(bytes) => Message::Binary(bytes),
        });
        if next.is_none() && !is_caught_up {
            is_caught_up = true;
            seen.forget_status();
            next = Some(Message::Text(Say::CaughtUp.text().into()));
        }
        if let (None, Some(watch)) = (&next, &mut watch) {
            next = watch.complaint().map(|text| Message::Text(text.into()));
        }
        if let (None, Some(watch)) = (&next, &watch) {
            let chunks = server.board.next_light(watch.layer, &mut seen);
            if !chunks.is_empty() {
                next = Some(Message::Binary(wire::light_frame(watch.epoch, &chunks)));
            }
        }
        let is_owed_more = next.is_some();
        if let Some(message) = next
            && !send(&mut socket, message).await
        {
            return;
        }
        tokio::select! {
            biased;
            incoming = socket.recv() => match incoming {
                Some(Ok(message)) => {
                    heard = Instant::now();
                    if !receive(server, page, &message, &answer, &mut watch, &mut seen).await {
                        return;
                    }
                }
                _ => return,
            },
            Some(text) = answers.recv() => {
                if !send(&mut socket, Message::Text(text.into())).await {
                    return;
                }
            }
            _ = ping.tick() => {
                if heard.elapsed() > server.pace.silence || !send(&mut socket, Message::Ping(Bytes::new())).await {
                    return;
                }
            }
            () = std::future::ready(()), if is_owed_more => {}
            changed = news.changed() => {
                if changed.is_err() {
                    return;
                }
            }
        }
    }
}

/// Whether a page took a message.
async fn send(socket: &mut WebSocket, message: Message) -> bool {
    matches!(tokio::time::timeout(PATIENCE, socket.send(message)).await, Ok(Ok(())))
}

/// Passes on what a page says; whether to go on with it.
async fn receive(
    server: &Server,
    page: u64,
    message: &Message,
    answer: &mpsc::Sender<String>,
    watch: &mut Option<Watch>,
    seen: &mut Seen,
) -> bool {
    let text = match message {
        Message::Text(text) => text.as_str(),
        Message::Binary(_) => return refuse(answer, "messages are text"),
        Message::Close(_) => return false,
        Message::Ping(_) | Message::Pong(_) => return true,
    };
    if text.len() > LONGEST {
        return refuse(answer, &format!("it has {} bytes, and {LONGEST} is the most", text.len()));
    }
    let request: Request = match serde_json::from_str(text) {
        Ok(request) => request,
        Err(error) => return refuse(answer, &error.to_string()),
    };
    let command = match request {
        Request::Survey { places, .. } if places.len() > MOST_PLACES => {
            return refuse(
                answer,
                &format!("{} places are to be measured, and {MOST_PLACES} are the most", places.len()),
            );
        }
        Request::Layer { layer, epoch } => {
            // Later bounces show the last.
            let layer = if let Layer::Bounce(n) = layer { Layer::Bounce(n.min(MOST_BOUNCES)) } else { layer };
            // The new one first, so that light of a layer that stays is kept.
            *watch = Some(Watch::new(&server.board, layer, epoch));
            seen.forget_light();
            Command::Watch
        }
        request => Command::Ask { page, request, answer: answer.clone() },
    };
    server.commands.send(command).await.is_ok()
}

/// Tells a page that a message was none; it stays.
fn refuse(answer: &mpsc::Sender<String>, what: &str) -> bool {
    let message = format!("The server could not read a message: {what}.");
    // A page that does not read its answers misses them.
    let _ = answer.try_send(Say::Refused { code: Refused::Message, message }.text());
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::{Read, Write};
    use std::net::TcpStream;

    /// A page that is there but says nothing, as if its machine slept: it is asked some times and then given up, and its place
    /// is free.
    #[test]
    fn a_page_that_falls_silent_is_given_up() {
        let pace = Pace { ping: Duration::from_millis(50), silence: Duration::from_millis(400) };
        let guard = Guard::new("127.0.0.1").unwrap();
        let token = guard.token().to_owned();
        let (commands, _asked) = mpsc::channel(1);
        let server = Server::new(guard, Arc::new(Board::new()), commands, &Scene::default());
        let server = Arc::new(Server { pace, ..Arc::into_inner(server).unwrap() });
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
        let listener = runtime.block_on(tokio::net::TcpListener::bind(("127.0.0.1", 0))).unwrap();
        let host = listener.local_addr().unwrap().to_string();
        let router = server.router();
        let (end, ended) = oneshot::channel::<()>();
        let serving = std::thread::spawn(move || {
            runtime.block_on(async {
                tokio::select! {
                    served = axum::serve(listener, router) => served.unwrap(),
                    _ = ended => {}
                }
            });
        });
        let mut stream = TcpStream::connect(&host).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
        write!(
            stream,
            "GET /{token}/socket HTTP/1.1\r\nHost: {host}\r\nOrigin: http://{host}\r\nConnection: Upgrade\r\n\
             Upgrade: websocket\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
        )
        .unwrap();
        let mut heard = Vec::new();
        // To the end of the connection, which is the server's to make.
        stream.read_to_end(&mut heard).unwrap();
        let pings = heard.windows(2).filter(|bytes| *bytes == [0x89, 0]).count();
        assert!(heard.starts_with(b"HTTP/1.1 101") && pings >= 3, "{pings} in {}", String::from_utf8_lossy(&heard));
        let freed = (0..100).any(|_| {
            std::thread::sleep(Duration::from_millis(20));
            server.pages.load(Ordering::Relaxed) == 0
        });
        assert!(freed);
        end.send(()).unwrap();
        serving.join().unwrap();
    }
}
