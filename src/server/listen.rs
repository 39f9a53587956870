//! Accepts connections, each on a thread of its own.

use std::io::ErrorKind;
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread::sleep;
use std::time::Duration;

use super::connection::{Connection, Patience};
use super::error::{ConnectionEnd, ServerError};
use super::log::Log;
use super::picture::PictureStyle;
use super::scenes::Scenes;
use crate::simulation::target::Target;

/// Most connections at a time. Each may hold the scenes that it uses on the device.
const MOST_CONNECTIONS: usize = 16;
/// How often the server looks for a connection.
const LOOK: Duration = Duration::from_millis(10);

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
    let open = AtomicUsize::new(0);
    std::thread::scope(|threads| {
        while !stop.load(Ordering::Relaxed) {
            let (stream, client) = match listener.accept() {
                Ok((stream, client)) => (stream, client.to_string()),
                Err(error) => {
                    if !matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted) {
                        server.log.tell("server", &format!("a connection is lost: {error}"));
                    }
                    sleep(LOOK);
                    continue;
                }
            };
            if open.load(Ordering::Relaxed) >= MOST_CONNECTIONS {
                server.log.tell(&client, &format!("refused: there are {MOST_CONNECTIONS} connections already"));
                continue;
            }
            open.fetch_add(1, Ordering::Relaxed);
            let open = &open;
            let session = move || {
                let end = catch_unwind(AssertUnwindSafe(|| one(server, stream, talk, stop, &client)));
                match end {
                    Ok(ConnectionEnd::Closed | ConnectionEnd::Stopped) => server.log.request(&client, "end"),
                    Ok(end) => server.log.tell(&client, &format!("the connection ends: {end}")),
                    Err(_) => server.log.tell(&client, "the connection ends with an internal error, which is a bug"),
                }
                open.fetch_sub(1, Ordering::Relaxed);
            };
            if let Err(error) = std::thread::Builder::new().spawn_scoped(threads, session) {
                open.fetch_sub(1, Ordering::Relaxed);
                server.log.tell("server", &format!("a connection is lost: {error}"));
            }
        }
    });
}

fn one(server: &Server, stream: TcpStream, talk: Talk, stop: &AtomicBool, client: &str) -> ConnectionEnd {
    server.log.request(client, "begin");
    match Connection::new(stream, stop, server.patience) {
        Ok(mut connection) => talk(server, &mut connection, client),
        Err(end) => end,
    }
}
