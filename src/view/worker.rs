//! The thread that owns the simulation. The worker takes the requests of pages, lets time go on, and draws for each page that waits for an image.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use glam::DVec3;
use serde_json::json;
use tokio::runtime::Handle;
use tokio::sync::mpsc::{Receiver, Sender, error::TryRecvError};

use super::camera::PageCamera;
use super::compare::Comparison;
use super::drawing::{Common, PlaybackClock, draw};
use super::player::{Player, ShownImage};
use super::request::{PageQuantity, PageRequest};
use super::sigma::{find_page_sigma, sigma_message};
use crate::sensitivity::node_sigma::NodeSigma;
use crate::simulation::facade_error::SimulationError;

/// Images that may be under way to a page.
const UNDER_WAY: u32 = 2;

/// Time for steps before pages are served again.
const TURN: Duration = Duration::from_millis(40);

/// Time between two looks at the requests.
const REST: Duration = Duration::from_millis(500);

#[derive(Debug, Clone)]
pub(crate) enum ToPage {
    Text(String),
    Image(Vec<u8>),
}

pub(crate) enum WorkerMessage {
    /// A page was opened.
    Join {
        id: u64,
        /// The way to it.
        page: Sender<ToPage>,
    },
    /// A page was closed.
    Leave(u64),
    Ask(u64, PageRequest),
    /// A message for all pages.
    Tell(String),
    /// The uncertainty that a page has asked for.
    Sigma(Box<NodeSigma>),
}

struct OpenPage {
    to: Sender<ToPage>,
    look: PageCamera,
    quantity: PageQuantity,
    /// Images that it may still get.
    credit: u32,
    /// Whether something has changed since its last image.
    dirty: bool,
    shown_image: Option<ShownImage>,
}

pub(crate) struct Worker {
    pub(crate) player: Player,
    pub(crate) common: Common,
    /// Where the camera of a new page is.
    pub(crate) first_look: PageCamera,
    /// The first message to each page.
    pub(crate) hello: String,
    /// For the comparison with f64.
    pub(crate) comparison: Comparison,
    /// The way to the worker itself, for the comparison.
    pub(crate) sender: Sender<WorkerMessage>,
    /// Ends it.
    pub(crate) stop: Arc<AtomicBool>,
}

struct PlayTime {
    goal: u32,
    /// Steps in a second while it plays.
    rate: Option<f64>,
    /// When the next step is due.
    due: Instant,
}

impl Worker {
    /// Works for the pages that are open and for new ones until it is stopped. Waits use a runtime that another thread drives.
    ///
    /// # Errors
    /// A call of the device that fails.
    pub(crate) fn run(
        mut self,
        runtime: &Handle,
        joined: BTreeMap<u64, Sender<ToPage>>,
        mut commands: Receiver<WorkerMessage>,
    ) -> Result<(), SimulationError> {
        let mut pages: BTreeMap<u64, OpenPage> =
            joined.into_iter().map(|(id, page)| (id, self.welcome(page))).collect();
        let mut time = PlayTime { goal: 0, rate: None, due: Instant::now() };
        while !self.stop.load(Ordering::Relaxed) {
            let wait = self.wait(&pages, &time);
            let first = if wait.is_zero() {
                match commands.try_recv() {
                    Err(TryRecvError::Disconnected) => break,
                    received => received.ok(),
                }
            } else {
                match runtime.block_on(async { tokio::time::timeout(wait, commands.recv()).await }) {
                    Ok(None) => break,
                    received => received.ok().flatten(),
                }
            };
            if let Some(command) = first {
                self.take(command, &mut pages, &mut time)?;
                while let Ok(command) = commands.try_recv() {
                    self.take(command, &mut pages, &mut time)?;
                }
            }
            let before = self.player.step();
            if self.go_on(&mut time, !pages.is_empty())? {
                mark(&mut pages);
                if self.player.step() > before + 1 {
                    // Images tell of single steps only.
                    self.tell_curves(&mut pages);
                }
            }
            let clock = PlaybackClock { goal: time.goal, rate: time.rate };
            for page in pages.values_mut().filter(|page| page.is_due()) {
                self.draw(page, clock)?;
            }
            pages.retain(|_, page| !page.to.is_closed());
        }
        Ok(())
    }

    /// The time until there is work again.
    fn wait(&self, pages: &BTreeMap<u64, OpenPage>, time: &PlayTime) -> Duration {
        let drawing = pages.values().any(OpenPage::is_due);
        if drawing || self.player.step() != time.goal {
            return Duration::ZERO;
        }
        match time.rate {
            Some(_) if !pages.is_empty() => time.due.saturating_duration_since(Instant::now()).min(REST),
            _ => REST,
        }
    }

    /// Lets time go on. Returns whether it did.
    fn go_on(&mut self, time: &mut PlayTime, looked_at: bool) -> Result<bool, SimulationError> {
        let before = self.player.step();
        if let Some(rate) = time.rate.filter(|_| looked_at && before == time.goal) {
            let now = Instant::now();
            if now >= time.due {
                if time.goal >= self.player.steps() {
                    time.rate = None;
                    return Ok(true);
                }
                time.goal += 1;
                let next = time.due + Duration::from_secs_f64(1.0 / rate);
                time.due = next.max(now);
            }
        }
        let began = Instant::now();
        while self.player.step() != time.goal && began.elapsed() < TURN && !self.stop.load(Ordering::Relaxed) {
            self.player.towards(time.goal, &self.stop)?;
        }
        Ok(self.player.step() != before)
    }

    /// A new page, which is told of the scene.
    fn welcome(&self, to: Sender<ToPage>) -> OpenPage {
        let page = OpenPage {
            to,
            look: self.first_look,
            quantity: PageQuantity::Temperature,
            credit: UNDER_WAY,
            dirty: true,
            shown_image: None,
        };
        page.tell(self.hello.clone());
        page.tell(self.curves());
        self.common.sigma.iter().for_each(|sigma| page.tell(sigma_message(sigma)));
        page
    }

    fn take(
        &mut self,
        command: WorkerMessage,
        pages: &mut BTreeMap<u64, OpenPage>,
        time: &mut PlayTime,
    ) -> Result<(), SimulationError> {
        match command {
            WorkerMessage::Join { id, page } => {
                pages.insert(id, self.welcome(page));
            }
            WorkerMessage::Leave(id) => {
                pages.remove(&id);
            }
            WorkerMessage::Tell(message) => pages.values().for_each(|page| page.tell(message.clone())),
            WorkerMessage::Sigma(sigma) => {
                let message = sigma_message(&sigma);
                self.common.sigma = Some(*sigma);
                pages.values().for_each(|page| page.tell(message.clone()));
                mark(pages);
            }
            WorkerMessage::Ask(id, request) => {
                if let Some(problem) = self.answer(id, request, pages, time)
                    && let Some(page) = pages.get(&id)
                {
                    page.tell(problem_message(&problem));
                }
            }
        }
        Ok(())
    }

    /// Follows a request of a page, or says why not.
    fn answer(
        &mut self,
        id: u64,
        request: PageRequest,
        pages: &mut BTreeMap<u64, OpenPage>,
        time: &mut PlayTime,
    ) -> Option<String> {
        let page = pages.get_mut(&id)?;
        match request {
            PageRequest::Shown {} => page.credit = (page.credit + 1).min(UNDER_WAY),
            PageRequest::Look { position, target, up } => {
                let [position, target, up] = [position, target, up].map(DVec3::from_array);
                let look = PageCamera::At { position, target, up };
                if let Err(error) = look.of(&self.common.camera) {
                    return Some(error.to_string());
                }
                (page.look, page.dirty) = (look, true);
            }
            PageRequest::SceneCamera {} => match self.first_look {
                PageCamera::Scene => (page.look, page.dirty) = (PageCamera::Scene, true),
                PageCamera::At { .. } => return Some("the scene has no camera".to_owned()),
            },
            PageRequest::Show { quantity } => (page.quantity, page.dirty) = (quantity, true),
            PageRequest::Play { rate } => {
                if self.player.step() >= self.player.steps() {
                    time.goal = 0;
                }
                (time.rate, time.due) = (Some(rate), Instant::now());
                mark(pages);
            }
            PageRequest::Pause {} => {
                (time.rate, time.goal) = (None, self.player.step());
                mark(pages);
            }
            PageRequest::Seek { time: at } => match self.player.step_at(at) {
                Some(step) => {
                    (time.goal, time.due) = (step, Instant::now());
                    mark(pages);
                }
                None => return Some(format!("the scene has no time {at} s")),
            },
            PageRequest::Step { by } => {
                let goal = i64::from(time.goal) + i64::from(by);
                match u32::try_from(goal).ok().filter(|goal| *goal <= self.player.steps()) {
                    Some(goal) => {
                        (time.goal, time.rate) = (goal, None);
                        mark(pages);
                    }
                    None => return Some(format!("the scene has no step {goal}")),
                }
            }
            PageRequest::Probe { x, y } => {
                let is_new = page.shown_image.as_ref().is_some_and(|image| self.player.add_at(image, x, y));
                if !is_new {
                    return Some(format!("the pixel ({x}, {y}) shows no surface"));
                }
                self.tell_curves(pages);
            }
            PageRequest::Remove { probe } => {
                if !self.player.remove(probe) {
                    return Some(format!("there is no probe {probe}"));
                }
                self.tell_curves(pages);
            }
            PageRequest::Compare {} => return self.compare(),
            PageRequest::Sigma {} => return self.find_uncertainty(),
        }
        None
    }

    fn draw(&mut self, page: &mut OpenPage, clock: PlaybackClock) -> Result<(), SimulationError> {
        page.dirty = false;
        match draw(&mut self.player, &self.common, &page.look, page.quantity, clock) {
            Ok((packet, shown_image)) => {
                page.credit -= 1;
                page.shown_image = Some(shown_image);
                // A page that is closed leaves soon.
                let _ = page.to.try_send(ToPage::Image(packet));
                Ok(())
            }
            Err(error @ (SimulationError::Gpu(_) | SimulationError::Engine(_))) => Err(error),
            Err(error) => {
                page.tell(problem_message(&error.to_string()));
                Ok(())
            }
        }
    }

    /// Curves of all probes.
    fn curves(&self) -> String {
        let probes = self.player.probes().iter();
        let curve = |probe| json!({ "probe": probe, "points": self.player.curve(probe) });
        json!({ "type": "curves", "curves": probes.map(curve).collect::<Vec<_>>() }).to_string()
    }

    fn tell_curves(&self, pages: &mut BTreeMap<u64, OpenPage>) {
        let curves = self.curves();
        pages.values().for_each(|page| page.tell(curves.clone()));
        mark(pages);
    }

    /// Begins the comparison with f64.
    fn compare(&self) -> Option<String> {
        self.begin_beside("comparison", |beside, sender| {
            // Without a worker nobody waits for the result.
            beside.run(&mut |message| drop(sender.blocking_send(WorkerMessage::Tell(message))));
        })
    }

    /// Begins the runs of the uncertainty, unless it is known.
    fn find_uncertainty(&self) -> Option<String> {
        if self.comparison.scene.uncertainty.is_none() {
            return Some("the scene has no [uncertainty]".to_owned());
        }
        if self.common.sigma.is_some() {
            return None;
        }
        self.begin_beside("uncertainty", |beside, sender| {
            let tell = |message| drop(sender.blocking_send(WorkerMessage::Tell(message)));
            if let Some(sigma) = find_page_sigma(&beside, &tell) {
                let _ = sender.blocking_send(WorkerMessage::Sigma(Box::new(sigma)));
            }
        })
    }

    /// Begins work on runs of the scene beside the page, unless such work is under way. Returns the reason where it does not begin.
    fn begin_beside(
        &self,
        name: &str,
        work: impl FnOnce(Comparison, Sender<WorkerMessage>) + Send + 'static,
    ) -> Option<String> {
        if self.comparison.is_under_way.swap(true, Ordering::Relaxed) {
            return Some(format!("the {name} can not begin while another run is under way"));
        }
        let (comparison, sender) = (self.comparison.clone(), self.sender.clone());
        let begun = std::thread::Builder::new().name(name.to_owned()).spawn(move || work(comparison, sender));
        begun.err().map(|error| format!("the {name} can not begin: {error}"))
    }
}

impl OpenPage {
    /// Whether it waits for an image, and has a place for it.
    fn is_due(&self) -> bool {
        self.dirty && self.credit > 0 && self.to.capacity() > 0
    }

    /// Sends a message. One that a slow page has no place for is lost.
    fn tell(&self, message: String) {
        let _ = self.to.try_send(ToPage::Text(message));
    }
}

fn mark(pages: &mut BTreeMap<u64, OpenPage>) {
    pages.values_mut().for_each(|page| page.dirty = true);
}

/// A message that says why something was not done.
pub(crate) fn problem_message(problem: &str) -> String {
    json!({ "type": "problem", "message": problem }).to_string()
}
