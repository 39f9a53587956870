//! Starts the worker and the server of a page, and ends both.

use std::net::TcpListener;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use glam::DVec3;
use tokio::runtime::{Builder, Handle, Runtime};
use tokio::sync::mpsc::{Receiver, Sender, channel};

use super::camera::{PageCamera, extent};
use super::compare::Comparison;
use super::drawing::Common;
use super::hello::hello;
use super::http::serve;
use super::player::Player;
use super::warm_up::warm_up;
use super::worker::{Worker, WorkerMessage};
use crate::output::apparent::Apparent;
use crate::scene::{Camera, Scene};
use crate::simulation::facade::Simulation;
use crate::simulation::facade_error::SimulationError;
use crate::simulation::target::Target;

/// Commands that wait for the worker.
const WAITING: usize = 256;

/// Time between two looks at a thread that ends.
const POLL: Duration = Duration::from_millis(10);

/// Direction from which a scene without a camera is seen, and the distance as a multiple of the craft's radius.
const FROM: DVec3 = DVec3::new(0.7, 0.5, -0.5);
const DISTANCE: f64 = 4.0;

/// Why a page is not served, or no longer.
#[derive(Debug, thiserror::Error)]
pub enum ViewError {
    /// The server can not run.
    #[error("the page can not be served: {0}")]
    Server(#[from] std::io::Error),
    /// The simulation has failed.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
    /// The worker has failed.
    #[error("the simulation has ended unexpectedly")]
    Worker,
}

/// A simulation with a camera, to be shown by pages.
pub struct ViewSession {
    /// The scene, for the comparison with f64.
    pub scene: Scene,
    /// The place of computation.
    pub target: Target,
    /// The scene, with a camera of the page's size. Pages are told of its warm-up, unless it has begun.
    pub simulation: Simulation,
    /// The camera of `simulation`.
    pub camera: Camera,
    /// Whether the scene has a camera of its own.
    pub has_camera: bool,
}

impl ViewSession {
    /// Brings the scene to time 0 and serves pages until `stop` is set. `stepped` is called for each step of the warm-up, or each orbit of a periodic one, and is
    /// dropped after it.
    ///
    /// # Errors
    /// A listener that can not be used, or a device that fails.
    pub fn serve(
        self,
        listener: TcpListener,
        stop: &Arc<AtomicBool>,
        stepped: Box<dyn FnMut() + Send>,
    ) -> Result<(), ViewError> {
        let runtime = Builder::new_current_thread().enable_all().build()?;
        let (commands, received) = channel(WAITING);
        let ended = Arc::new(AtomicBool::new(false));
        let comparing: Arc<AtomicBool> = Arc::default();
        let (handle, sender) = (runtime.handle().clone(), commands.clone());
        let flags = [Arc::clone(&ended), Arc::clone(&comparing)];
        let thread = std::thread::Builder::new().name("view".to_owned());
        let thread = thread.spawn(move || self.work(&handle, (sender, received), flags, stepped))?;
        let served = runtime.block_on(serve(listener, commands, Arc::clone(stop)));
        ended.store(true, Ordering::Relaxed);
        let worked = wait(&runtime, thread);
        while comparing.load(Ordering::Relaxed) {
            std::thread::sleep(POLL);
        }
        runtime.shutdown_background();
        served?;
        worked
    }

    /// The warm-up and the work for pages, until the first flag is set. The second flag tells whether a comparison is under way.
    fn work(
        mut self,
        runtime: &Handle,
        (sender, mut received): (Sender<WorkerMessage>, Receiver<WorkerMessage>),
        [stop, is_under_way]: [Arc<AtomicBool>; 2],
        stepped: Box<dyn FnMut() + Send>,
    ) -> Result<(), ViewError> {
        let Some(joined) = warm_up(&mut self.simulation, &mut received, runtime, &stop, stepped)? else {
            return Ok(());
        };
        let prepared = self.simulation.prepared();
        let (middle, radius) = extent(prepared);
        let band = prepared.scene.band;
        let hello = hello(&self.simulation, &self.camera, self.has_camera);
        let worker = Worker {
            player: Player::new(self.simulation)?,
            common: Common { camera: self.camera, apparent: Apparent::new(band), sigma: None },
            first_look: match self.has_camera {
                true => PageCamera::Scene,
                false => PageCamera::At {
                    position: middle + DISTANCE * radius * FROM.normalize(),
                    target: middle,
                    up: DVec3::NEG_Z,
                },
            },
            hello,
            comparison: Comparison { scene: self.scene, target: self.target, stop: Arc::clone(&stop), is_under_way },
            sender,
            stop,
        };
        Ok(worker.run(runtime, joined, received)?)
    }
}

/// Waits for the worker, whose waits the runtime drives.
fn wait(runtime: &Runtime, thread: std::thread::JoinHandle<Result<(), ViewError>>) -> Result<(), ViewError> {
    runtime.block_on(async {
        while !thread.is_finished() {
            tokio::time::sleep(POLL).await;
        }
    });
    thread.join().map_err(|_| ViewError::Worker)?
}
