//! `radiosity view`: a scene in the browser, lit while one walks through it and changed while it is lit.
//!
//! ```text
//! page ─WebSocket→ server ─commands→ solver (owns the session)
//! page ←WebSocket─ server ←─ board ←─posts─┘
//! ```
//! The solver never waits for a page: it posts on the [`board`], and each page takes what it has not seen.

mod board;
mod files;
mod guard;
mod history;
mod opening;
mod server;
mod solver;
mod wire;

use crate::input::{self, SceneArguments};
use crate::progress::Progress;
use crate::{Failure, Global, numbers, output};
use axum::serve::ListenerExt;
use board::Board;
use clap::Args;
use guard::Guard;
use opening::Opening;
use radiosity::session::{Session, SessionOptions};
use radiosity::{Camera, Projection, Tracer};
use serde_json::json;
use server::Server;
use solver::{Command, Solver};
use std::net::{IpAddr, SocketAddr};
use std::sync::Arc;
use std::time::Duration;
use tokio::net::TcpListener;
use tokio::sync::{mpsc, oneshot};
use wire::CameraPlace;

/// Arguments of `view`.
#[derive(Args, Clone, Debug)]
pub struct Arguments {
    #[command(flatten)]
    scene: SceneArguments,
    /// Where to listen: an address or a name of this machine. Whoever reaches it and has the address with its token may
    /// look and change; the connection is not encrypted.
    #[arg(long, value_name = "HOST", default_value = "127.0.0.1")]
    host: String,
    /// Port; 0 takes a free one.
    #[arg(long, value_name = "N", default_value_t = 0, allow_negative_numbers = true)]
    port: u16,
    /// Only print the address, do not open a browser.
    #[arg(long)]
    no_open: bool,
    /// About how many elements to make; each triangle is one at least.
    #[arg(long, value_name = "N", default_value_t = SessionOptions::default().elements as u32,
        conflicts_with = "element_size", allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(1..))]
    elements: u32,
    /// Width of an element in metres, instead of letting the program choose.
    #[arg(long, value_name = "M", allow_negative_numbers = true, value_parser = numbers::positive)]
    element_size: Option<f64>,
    /// Most rays of an element; a power of two from 4 to 1024.
    #[arg(long, value_name = "N", default_value_t = SessionOptions::default().rays, allow_negative_numbers = true,
        value_parser = rays)]
    rays: u32,
    /// Memory for rays and light by element, e.g. 4G or 500M.
    #[arg(long, default_value = "4G", value_name = "BYTES", allow_hyphen_values = true, value_parser = numbers::bytes)]
    memory: usize,
}

/// Commands that wait for the solver.
const WAITING: usize = 256;

/// Most places at which light is found where it has an edge within elements: pages draw up to two triangles for each, and six bytes
/// come with every change of it. A furnished room in the sun with a garden takes 215,000, an office 195,000.
const PLACES: usize = 300_000;

/// How many there may be for each element where many of these are asked for: finer ones have finer parts.
const PLACES_OF_ONE: usize = 4;

/// How long open connections have to end.
const FAREWELL: Duration = Duration::from_millis(500);

fn rays(text: &str) -> Result<u32, String> {
    let rays = text.parse::<u32>().ok().filter(|n| n.is_power_of_two() && (4..=1024).contains(n));
    rays.ok_or_else(|| "use a power of two from 4 to 1024".to_owned())
}

/// Runs the verb, until Ctrl-C.
pub fn run(arguments: &Arguments, global: &Global, progress: &Progress) -> Result<(), Failure> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().map_err(Failure::work)?;
    let (stop, stopped) = mpsc::channel(1);
    ctrlc::set_handler(move || {
        // One that has been heard needs no second.
        let _ = stop.try_send(());
    })
    .map_err(Failure::work)?;
    // Before the scene is read: a port that is taken should be known at once.
    let listener = runtime.block_on(listen(arguments))?;

    progress.part("reading");
    let parsed = input::parse(&arguments.scene)?;
    let options = SessionOptions {
        element_size: arguments.element_size,
        elements: arguments.elements as usize,
        rays: arguments.rays,
        places: PLACES.max(PLACES_OF_ONE * arguments.elements as usize),
        memory: arguments.memory,
        ..SessionOptions::default()
    };
    // Live light needs no welded mesh: that is for the faults and for a camera, and is made meanwhile.
    let scene = parsed.scene.clone();
    let examine = || {
        let input = parsed.examined();
        let has_view = |camera: &Camera| matches!(camera.projection, Projection::Perspective { .. });
        let placed = (!input.scene.cameras.iter().any(has_view)).then(|| placed_camera(&input));
        (input, placed)
    };
    let (session, (input, placed)) = rayon::join(|| Session::new(scene, &options), examine);
    input.tell_faults(global, progress);
    let session = session?;

    let board = Arc::new(Board::new());
    let (commands, asked) = mpsc::channel(WAITING);
    let guard = Guard::new(&arguments.host).map_err(Failure::work)?;
    let token = guard.token().to_owned();
    let server = Server::new(guard, board.clone(), commands.clone(), session.scene());
    let solver = Solver::new(session, placed, board);
    // Dropped when the solver ends, however it does.
    let (running, ended) = oneshot::channel::<()>();
    let solver = std::thread::spawn(move || {
        let _running = running;
        solver.run(asked);
    });
    progress.finish();

    let url = address(&listener, &token)?;
    // The file that leads the browser here is there until then.
    let _opening = announce(&url, arguments, global, progress)?;
    runtime.block_on(serve(listener, &server, stopped, ended))?;
    // The solver may have ended by itself.
    let _ = commands.blocking_send(Command::Stop);
    runtime.shutdown_timeout(FAREWELL);
    solver.join().map_err(|_| Failure::work("the solver ended unexpectedly"))
}

async fn listen(arguments: &Arguments) -> Result<TcpListener, Failure> {
    let (host, port) = (arguments.host.as_str(), arguments.port);
    TcpListener::bind((host, port))
        .await
        .map_err(|error| Failure::input(format!("--host {host} --port {port}: cannot listen there: {error}")))
}

/// Answers requests until the program is told to stop, or the solver has ended.
async fn serve(
    listener: TcpListener,
    server: &Arc<Server>,
    mut stopped: mpsc::Receiver<()>,
    ended: oneshot::Receiver<()>,
) -> Result<(), Failure> {
    // Light goes out as it comes: held back until the last of it is confirmed, as TCP does by itself (Nagle), it waits for 40 ms where
    // the other end confirms late. A socket that cannot do otherwise is slower, no more.
    let prompt = listener.tap_io(|stream| drop(stream.set_nodelay(true)));
    let serving = axum::serve(prompt, server.router());
    tokio::select! {
        ended = serving => ended.map_err(Failure::work),
        _ = stopped.recv() => Ok(()),
        _ = ended => Ok(()),
    }
}

/// The address to open, with the token.
fn address(listener: &TcpListener, token: &str) -> Result<String, Failure> {
    let bound = listener.local_addr().map_err(Failure::work)?;
    // Who listens everywhere is found at home.
    let host = match bound.ip() {
        ip if !ip.is_unspecified() => ip,
        IpAddr::V4(_) => IpAddr::from([127, 0, 0, 1]),
        IpAddr::V6(_) => IpAddr::from([0, 0, 0, 0, 0, 0, 0, 1]),
    };
    Ok(format!("http://{}/{token}/", SocketAddr::new(host, bound.port())))
}

/// Tells the address, and opens it where there is a browser.
fn announce(
    url: &str,
    arguments: &Arguments,
    global: &Global,
    progress: &Progress,
) -> Result<Option<Opening>, Failure> {
    if global.json {
        output::print(&json!({ "event": "listening", "url": url, "seconds": progress.seconds() }).to_string())?;
    } else {
        output::print(url)?;
        progress.say("open this address in a browser; Ctrl-C ends");
    }
    let is_local = arguments.host.parse::<IpAddr>().map_or(arguments.host == "localhost", |ip| ip.is_loopback());
    if !is_local {
        progress.say("warning: the scene can be reached from other machines, by whoever has this address");
    }
    if arguments.no_open {
        return Ok(None);
    }
    match Opening::new(url) {
        Ok(opening) if open::that_detached(opening.path()).is_ok() => Ok(Some(opening)),
        Ok(_) => {
            progress.say("note: no browser was found to open it");
            Ok(None)
        }
        Err(error) => {
            progress.say(&format!(
                "note: no browser was opened, as the file that leads it here cannot be written: {error}"
            ));
            Ok(None)
        }
    }
}

/// A view for who brings no camera.
fn placed_camera(input: &input::Input) -> CameraPlace {
    let camera = radiosity::place_camera(&Tracer::new(&input.scene, &input.mesh), None);
    let fov = match camera.projection {
        Projection::Perspective { vertical_fov } => vertical_fov,
        Projection::Orthographic { .. } => 1.0,
    };
    CameraPlace { name: "Overview".to_owned(), matrix: camera.world_from_camera.to_cols_array(), fov }
}
