//! The image server, asked by clients that are written here from what the real ones were seen to send.

mod bounds;
mod flood;
mod log;
mod protobuf;
mod soak;
mod surrender;
mod telemetry;
mod vizard;
mod zmtp;

use std::net::SocketAddr;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use isotherm::internals::{Log, Patience, PictureKind, PictureStyle, Scenes, Server, Talk, bind, serve};
use isotherm::{Scene, Target};

/// A server with one scene of the name `craft`, or with none.
fn server(scene: Option<&Path>, target: Target, kind: PictureKind) -> Server {
    let mut scenes = Scenes::default();
    if let Some(path) = scene {
        let scene = Scene::load(path).expect("a scene");
        scenes.add(Some("craft"), path, scene).expect("a scene that can run");
    }
    let [greeting, idle, spare, call] = [10, 60, 60, 600].map(Duration::from_secs);
    let patience = Patience { greeting, idle, spare, call, message: Duration::from_millis(500) };
    let picture = PictureStyle { kind, range: None };
    let log = Log::open(None).expect("no log");
    Server { target, scenes, picture, time: 0.0, state: None, warm_up: false, patience, log }
}

/// Runs a server as long as `with` works.
fn serving<T>(server: &Server, talk: Talk, with: impl FnOnce(SocketAddr) -> T) -> T {
    /// Stops the server also where a test fails.
    struct Stop<'s>(&'s AtomicBool);
    impl Drop for Stop<'_> {
        fn drop(&mut self) {
            self.0.store(true, Ordering::Relaxed);
        }
    }
    let listener = bind("127.0.0.1:0".parse().expect("an address"), false).expect("a free port");
    let address = listener.local_addr().expect("its address");
    let stop = AtomicBool::new(false);
    std::thread::scope(|threads| {
        threads.spawn(|| serve(server, &listener, talk, &stop));
        let _stop = Stop(&stop);
        with(address)
    })
}
