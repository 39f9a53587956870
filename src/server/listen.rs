//! Accepts connections, each on a thread of its own.

use std::io::ErrorKind;
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::sleep;
use std::time::{Duration, Instant};

use super::connection::{Connection, Patience};
use super::error::{ConnectionEnd, ServerError};
use super::log::Log;
use super::picture::PictureStyle;
use super::scenes::Scenes;
use super::sessions::{MOST_SESSIONS, Session, Sessions};
use crate::simulation::target::Target;
use crate::simulation::thermal_state::ThermalState;

/// How often the server looks for a connection.
const LOOK: Duration = Duration::from_millis(10);
/// How often the server looks whether calls under way are still wanted.
const LOOK_AT_CALLS: Duration = Duration::from_millis(100);

/// Data that all sessions of a server share.
pub struct Server {
    /// Where to compute.
    pub target: Target,
    /// The scenes that clients may name.
    pub scenes: Scenes,
    /// How pictures are drawn.
    pub picture: PictureStyle,
    /// Time of the scene's own orbit at which a session without a clock begins [s].
    pub time: f64,
    /// A saved state with which each craft begins, at the first time that the client states.
    pub state: Option<Arc<ThermalState>>,
    /// Whether the scene's warm-up on its own orbit precedes the first place that a client states.
    pub warm_up: bool,
    /// How long a client may take.
    pub patience: Patience,
    /// Messages and requests.
    pub log: Log,
}

/// Serves one connection up to its end.
pub type Talk = fn(&Server, &mut Connection, &str) -> ConnectionEnd;

/// Listens at an address. One that other machines reach must be allowed.
///
/// # Errors
/// The address is not allowed, or the system does not listen there.
pub fn bind(address: SocketAddr, allow_remote: bool) -> Result<TcpListener, ServerError> {
    if !address.ip().is_loopback() && !allow_remote {
        return Err(ServerError::Remote(address));
    }
    let listener = TcpListener::bind(address);
    let ready = listener.and_then(|listener| listener.set_nonblocking(true).map(|()| listener));
    ready.map_err(|error| ServerError::Listen(address, error))
}

/// Serves connections until `stop` is set. No client ends the server or the session of another.
pub fn serve(server: &Server, listener: &TcpListener, talk: Talk, stop: &AtomicBool) {
    let sessions = Arc::new(Sessions::default());
    let mut looked = Instant::now();
    std::thread::scope(|threads| {
        while !stop.load(Ordering::Relaxed) {
            if looked.elapsed() >= LOOK_AT_CALLS {
                looked = Instant::now();
                sessions.look(false);
            }
            let (stream, client) = match listener.accept() {
                Ok(accepted) => accepted,
                Err(error) => {
                    if !matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted) {
                        server.log.tell("server", &format!("a connection is lost: {error}"));
                    }
                    sleep(LOOK);
                    continue;
                }
            };
            let session = match sessions.admit(&stream, client.ip(), server.patience.spare) {
                Ok(Some(session)) => session,
                Ok(None) => {
                    let text = format!("refused: there are {MOST_SESSIONS} connections already, and none is idle");
                    server.log.tell(&client.to_string(), &text);
                    continue;
                }
                Err(error) => {
                    server.log.tell("server", &format!("a connection is lost: {error}"));
                    continue;
                }
            };
            let (sessions, same) = (&sessions, Arc::clone(&session));
            let whole = move || {
                one(server, stream, talk, &session, &client.to_string());
                sessions.leave(&session);
            };
            if let Err(error) = std::thread::Builder::new().spawn_scoped(threads, whole) {
                sessions.leave(&same);
                server.log.tell("server", &format!("a connection is lost: {error}"));
            }
        }
        sessions.look(true);
    });
}

/// Serves a connection up to its end, and tells how it ends.
fn one(server: &Server, stream: TcpStream, talk: Talk, session: &Session, client: &str) {
    server.log.request(client, "begin");
    let end = catch_unwind(AssertUnwindSafe(|| match Connection::new(stream, session, server.patience) {
        Ok(mut connection) => talk(server, &mut connection, client),
        Err(end) => end,
    }));
    match end {
        Ok(ConnectionEnd::Closed | ConnectionEnd::Stopped) => server.log.request(client, "end"),
        Ok(end) => server.log.tell(client, &format!("the connection ends: {end}")),
        Err(_) => server.log.tell(client, "the connection ends with an internal error, which is a bug"),
    }
}
