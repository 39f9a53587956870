//! Runs a scene into a folder: steps the engine, writes frames, tables, pictures and plots, and saves the state of the run.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{SyncSender, sync_channel};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use rayon::prelude::*;

use super::OutputError;
use super::apparent::Apparent;
use super::between::Between;
use super::eclipses::Eclipses;
use super::exr::encode;
use super::folder::Folder;
use super::frame::{Frame, FrameHeader};
use super::frame_maker::FrameMaker;
use super::image_index::{IMAGES, write_index};
use super::report::{FrameEntry, Picture, PlotEntry, write_plots};
use super::run_pictures::{CONTACT_SHEET, WrittenFrame, draw_pictures, frame_file, frame_stem};
use super::sensor_files::SensorFiles;
use super::state_file;
use super::tables::{JOINTS, SERIES, Tables};
use super::video::{self, APNG, MP4};
use crate::gpu::nodes::GROUP;
use crate::saved::{Saved, SavedError};
use crate::scene::ImageFile;
use crate::simulation::check::{Accuracy, Check};
use crate::simulation::energy::{Account, EnergyBalance};
use crate::simulation::engine::{Engine, EngineError};
use crate::simulation::keep::Keep;
use crate::simulation::network::StepCost;
use crate::simulation::periodic::Periodic;
use crate::simulation::prepare::Prepared;
use crate::simulation::state::{MOST_TIMES, capture, periodic as periodic_of, put_periodic, restore};
use crate::simulation::thermal_state::{begin_from, take};
use crate::simulation::{Consumer, StepResult, run_from, start_from};
use crate::trace::{Trace, Track};

/// The report as JSON.
pub const REPORT_JSON: &str = "report.json";
/// The report as a page.
pub const REPORT_HTML: &str = "report.html";
/// All files of a run.
pub const FILES: [&str; 21] = [
    "frames/step_#.exr",
    "frames/step_#.png",
    "frames/step_#.json",
    "frames/step_#_*",
    "frames/image_#.exr",
    "frames/image_#.png",
    "frames/image_#.json",
    "frames/image_#_*",
    APNG,
    MP4,
    IMAGES,
    "plots/materials.svg",
    "plots/parts.svg",
    "plots/probes.svg",
    "plots/joint_angles.svg",
    "plots/joint_distances.svg",
    SERIES,
    JOINTS,
    CONTACT_SHEET,
    REPORT_JSON,
    REPORT_HTML,
];

/// Most frames that wait for the writer.
const WAITING_FRAMES: usize = 2;

/// An error that ends a run early.
#[derive(Debug, thiserror::Error)]
pub enum JobError {
    /// The engine.
    #[error(transparent)]
    Engine(#[from] EngineError),
    /// The output folder.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// The thread that writes files has ended. Its own error says why.
    #[error("the files could not be written")]
    Writer,
    /// A temperature is not finite.
    #[error(
        "step {step}: the temperature of node {node} (part {part}, material {material}) is not finite; please report the scene"
    )]
    NotFinite {
        /// The first step where this happens.
        step: u32,
        /// The first such node.
        node: u32,
        /// Part of the first such node.
        part: String,
        /// Material of that node.
        material: String,
    },
}

/// A unit of progress.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Done {
    /// A warm-up step.
    WarmUp,
    /// A step.
    Step,
    /// A finished picture.
    Picture,
}

/// The results of a run.
pub struct Outcome {
    /// Whether all steps were done.
    pub complete: bool,
    /// Drawn frames.
    pub frames: Vec<FrameEntry>,
    /// Pictures for the report.
    pub pictures: Vec<Picture>,
    /// Plots for the report.
    pub plots: Vec<PlotEntry>,
    /// Error of the device against the f64 reference, if requested.
    pub accuracy: Option<Accuracy>,
    /// The energy balance, if the scene keeps it.
    pub energy: Option<EnergyBalance>,
    /// Estimated error of the temperatures between steps [K], where images lie there.
    pub between: Option<f64>,
    /// The thermal state that was asked for, where its step was reached.
    pub state: Option<Saved>,
    /// Convergence of a periodic warm-up, if requested.
    pub periodic: Option<Periodic>,
    /// Cost of the network in every step after the warm-up.
    pub network_costs: Vec<StepCost>,
    /// Wall time of the steps without start-up and pictures [s].
    pub stepping_s: f64,
    /// Wall time of the earlier parts of the run [s].
    pub wall_before_s: f64,
}

/// How a run is done.
pub struct Job<'a> {
    /// Number of nodes that the f64 reference also steps.
    pub check: Option<usize>,
    /// How often the state is saved.
    pub save_every: SaveEvery,
    /// What a saved state says of the run, for the command that resumes it.
    pub identity: &'a Saved,
    /// The state of an earlier part of the run.
    pub earlier: Option<&'a Saved>,
    /// The thermal state at time 0, instead of a warm-up.
    pub begin: Option<&'a Saved>,
    /// The step after which the thermal state is taken.
    pub take_after: Option<u32>,
}

/// How often the state of a run is saved. It is saved after the warm-up, after the last step and when the run is stopped in any case.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SaveEvery {
    /// After so much wall-clock time. Never where it is 0.
    Time(Duration),
    /// After so many steps.
    Steps(u32),
}

/// Digital number and count of temperature of each pixel.
type Readings = Vec<[u16; 2]>;

/// Work for the thread that writes files.
enum Work {
    Frame(Box<(Frame, FrameHeader, Option<Readings>)>),
    /// Tell when all frames before are written.
    Tell(SyncSender<()>),
}

/// Runs the scene and writes its files.
///
/// # Errors
/// A call that fails, a full disk, or a saved state of another scene.
pub fn run_into(
    prepared: &Prepared,
    engine: &mut dyn Engine,
    folder: &Folder,
    job: &Job<'_>,
    stop: &AtomicBool,
    progress: &(dyn Fn(Done) + Sync),
) -> Result<Outcome, JobError> {
    let began = Instant::now();
    let trace = engine.trace();
    let mut check = job.check.map(|sample| Check::new(prepared, sample));
    let earlier = job.earlier.filter(|saved| saved.has("loop.next"));
    let lost = |error: SavedError| JobError::Engine(error.into());
    engine.keep_few_times(MOST_TIMES);
    let (first, periodic, mut tables, done) = match earlier {
        Some(saved) => {
            let of_loop = saved.part("loop");
            let lengths = saved.array("tables").map_err(lost)?;
            let first = restore(&of_loop, engine, check.as_mut())?;
            (
                first,
                periodic_of(&of_loop).map_err(lost)?,
                Tables::again(prepared, folder, lengths)?,
                Earlier::of(saved).map_err(lost)?,
            )
        }
        None if job.begin.is_some() => {
            let took = job.begin.map(|state| begin_from(state, engine, check.as_mut())).transpose()?;
            check = check.filter(|_| took == Some(true));
            (0, None, Tables::begin(prepared, folder)?, Earlier::default())
        }
        None => {
            let in_warm_up = job.earlier.filter(|saved| saved.has("warm_up.next"));
            let mut done = Earlier::default();
            match in_warm_up {
                Some(saved) => done.seconds = saved.array("seconds").map_err(lost)?,
                None => state_file::write(&folder.state(), job.identity)?,
            }
            let warms_up = trace.span(Track::Host, "settle and warm up");
            let of_warm_up = in_warm_up.map(|saved| saved.part("warm_up"));
            let mut keeper = Keeper {
                job,
                folder,
                state: Saved::default(),
                saved: (0, Instant::now()),
                began,
                before: done.seconds,
            };
            let mut told = || progress(Done::WarmUp);
            let check = check.as_mut();
            let periodic = start_from(prepared, engine, check, of_warm_up.as_ref(), stop, &mut told, &mut keeper)?;
            drop(warms_up);
            engine.keep_few_times(MOST_TIMES);
            (0, periodic, Tables::begin(prepared, folder)?, done)
        }
    };
    (0..first).for_each(|_| progress(Done::Step));
    let mut open = || match earlier {
        Some(saved) => Account::again(prepared, engine, &saved.part("energy")),
        None => Account::open(prepared, engine),
    };
    let mut account = prepared.scene.energy_balance.then(&mut open).transpose()?;

    let maker = prepared.scene.camera.as_ref().map(|camera| FrameMaker::new(prepared, camera, &engine.device_name()));
    let stepping_began = Instant::now();
    let written = Mutex::new(done.frames);
    let (complete, wrote, (steps, between, state)) = std::thread::scope(|scope| {
        // A thread writes files while the next steps are computed.
        let (frames, waiting) = sync_channel::<Work>(WAITING_FRAMES);
        let (files, written) = (trace.clone(), &written);
        let of_sensor = SensorFiles::new(&prepared.scene);
        let apparent =
            prepared.scene.images.files.contains(&ImageFile::ApparentPng).then(|| Apparent::new(prepared.scene.band));
        let writer = scope.spawn(move || {
            for work in waiting {
                let (frame, header, readings) = match work {
                    Work::Frame(frame) => *frame,
                    Work::Tell(done) => {
                        // Nobody listens where the run has failed.
                        let _ = done.send(());
                        continue;
                    }
                };
                let _writes = files.span(Track::Writer, "write EXR");
                let (file, range) = (frame_file(frame.step, frame.image, "exr"), frame.range());
                folder.write_bytes(&file, &encode(&frame, &header)?)?;
                if let Some((of_sensor, readings)) = of_sensor.as_ref().zip(readings) {
                    let stem = frame_stem(frame.step, frame.image);
                    for (ending, bytes) in of_sensor.of(&stem, &frame, &readings)? {
                        folder.write_bytes(&format!("frames/{stem}{ending}"), &bytes)?;
                    }
                }
                let apparent = apparent.as_ref().and_then(|apparent| apparent.range(&frame));
                lock(written).push(WrittenFrame { step: frame.step, image: frame.image, range, apparent });
            }
            Ok::<_, OutputError>(())
        });
        let mut recorder = Recorder {
            prepared,
            job,
            folder,
            trace: &trace,
            maker: maker.as_ref(),
            tables: &mut tables,
            account: account.as_mut(),
            steps: first,
            frames,
            written,
            periodic,
            between: done.between,
            state: None,
            // A warm-up that was stopped has saved its own state.
            saves: earlier.is_some() || !stop.load(Ordering::Relaxed),
            saved: Instant::now(),
            began,
            stepping_began,
            before: done.seconds,
            progress,
        };
        if first == 0 && recorder.saves {
            recorder.save(0, engine, check.as_mut())?;
        }
        let complete = run_from(prepared, engine, check.as_mut(), first, stop, &mut recorder);
        let left = (recorder.steps, recorder.between.error, recorder.state.take());
        drop(recorder);
        let wrote = writer.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        Ok::<_, JobError>((complete, wrote, left))
    })?;
    wrote?;
    let complete = complete?;
    let end = f64::from(steps) * prepared.scene.time.step;
    let energy = account.map(|account| account.close(prepared, engine, end)).transpose()?;
    let written = written.into_inner().unwrap_or_else(PoisonError::into_inner);
    let stepping_s = done.seconds[1] + stepping_began.elapsed().as_secs_f64();

    let draws = trace.span(Track::Host, "pictures and plots");
    let eclipses = Eclipses::of(prepared);
    let (frames, pictures) = draw_pictures(&prepared.scene, &eclipses, folder, &written, &|| progress(Done::Picture))?;
    if let Some(camera) = prepared.scene.camera.as_ref().filter(|_| prepared.scene.time.draw.is_between_steps()) {
        write_index(folder, &prepared.scene.time, camera, &written)?;
    }
    if prepared.scene.images.video.is_some() {
        let displays: Vec<String> =
            written.iter().map(|frame| format!("frames/{}_display.png", frame_stem(frame.step, frame.image))).collect();
        video::write(folder, &prepared.scene.images, &displays)?;
    }
    let plots = tables.plots(&eclipses)?;
    write_plots(folder, &plots)?;
    drop(draws);
    let accuracy = check.map(|check| check.accuracy(prepared));
    let network_costs = engine.network_costs().to_vec();
    let wall_before_s = done.seconds[0];
    Ok(Outcome {
        complete,
        frames,
        pictures,
        plots,
        accuracy,
        energy,
        between,
        state,
        periodic,
        network_costs,
        stepping_s,
        wall_before_s,
    })
}

fn lock(written: &Mutex<Vec<WrittenFrame>>) -> MutexGuard<'_, Vec<WrittenFrame>> {
    written.lock().unwrap_or_else(PoisonError::into_inner)
}

/// What an earlier part of a run did.
#[derive(Default)]
struct Earlier {
    frames: Vec<WrittenFrame>,
    /// Wall time of the whole run and of its steps [s].
    seconds: [f64; 2],
    between: Between,
}

/// Number that stands for no image in a saved list.
const NO_IMAGE: u32 = u32::MAX;

fn image_of(saved: u32) -> Option<u32> {
    (saved != NO_IMAGE).then_some(saved)
}

impl Earlier {
    fn of(saved: &Saved) -> Result<Self, SavedError> {
        let steps: Vec<u32> = saved.list("frames")?;
        let ranges: Vec<[f32; 2]> = saved.list_of("frame_ranges", steps.len())?;
        let images: Vec<u32> = saved.list_of("frame_images", steps.len())?;
        let apparent: Vec<[f32; 2]> = saved.list_of("frame_apparent", steps.len())?;
        let known = |range: [f32; 2]| Some(range).filter(|range| !range[0].is_nan());
        let frame = |number: usize| WrittenFrame {
            step: steps[number],
            image: image_of(images[number]),
            range: known(ranges[number]),
            apparent: known(apparent[number]),
        };
        let frames = (0..steps.len()).map(frame).collect();
        Ok(Self { frames, seconds: saved.array("seconds")?, between: Between::of(saved)? })
    }
}

/// Saves the state of the warm-up.
struct Keeper<'a> {
    job: &'a Job<'a>,
    folder: &'a Folder,
    /// The state that was taken last.
    state: Saved,
    /// Steps before the last state that was saved, and when it was saved.
    saved: (u32, Instant),
    began: Instant,
    before: [f64; 2],
}

impl Keep<JobError> for Keeper<'_> {
    fn take(
        &mut self,
        done: u32,
        own: Saved,
        engine: &mut dyn Engine,
        check: Option<&mut Check>,
    ) -> Result<(), JobError> {
        self.state = capture(done, engine, check)?;
        self.state.put_all("own", own);
        Ok(())
    }

    fn wants(&self, done: u32) -> bool {
        let (steps, time) = self.saved;
        match self.job.save_every {
            SaveEvery::Time(every) => !every.is_zero() && time.elapsed() >= every,
            SaveEvery::Steps(every) => done - steps >= every,
        }
    }

    fn save(&mut self) -> Result<(), JobError> {
        let mut saved = self.job.identity.clone();
        let [done] = self.state.array("next").map_err(EngineError::from)?;
        saved.put_all("warm_up", self.state.clone());
        let [wall, stepping] = self.before;
        saved.put("seconds", &[wall + self.began.elapsed().as_secs_f64(), stepping]);
        state_file::write(&self.folder.state(), &saved)?;
        self.saved = (done, Instant::now());
        Ok(())
    }
}

/// Takes the results of the steps to the files, and saves the state.
struct Recorder<'a, 'b> {
    prepared: &'a Prepared,
    job: &'a Job<'a>,
    folder: &'a Folder,
    trace: &'a Trace,
    maker: Option<&'a FrameMaker<'a>>,
    tables: &'a mut Tables<'b>,
    account: Option<&'a mut Account>,
    /// The last step that was taken.
    steps: u32,
    frames: SyncSender<Work>,
    written: &'a Mutex<Vec<WrittenFrame>>,
    periodic: Option<Periodic>,
    between: Between,
    state: Option<Saved>,
    saves: bool,
    saved: Instant,
    began: Instant,
    stepping_began: Instant,
    before: [f64; 2],
    progress: &'a (dyn Fn(Done) + Sync),
}

impl Consumer<JobError> for Recorder<'_, '_> {
    fn take(&mut self, mut result: StepResult) -> Result<(), JobError> {
        let _consumes = self.trace.span(Track::Host, "series and frame");
        if let Some(temperatures) = result.delivered.temperatures.take() {
            check_finite(self.prepared, result.step, &temperatures)?;
            self.tables.add(self.prepared, result.time, &temperatures)?;
            if let Some(account) = &mut self.account {
                account.take(&temperatures, result.delivered.absorbed.as_deref());
            }
            if self.prepared.scene.time.draw.is_between_steps() {
                self.between.take(self.prepared, result.step, temperatures);
            }
        }
        self.steps = result.step;
        let is_step = result.image.is_none();
        let readings = result.delivered.pixels.as_mut().and_then(|pixels| pixels.readings.take());
        let frame = self.maker.map(|maker| maker.frame(result)).transpose()?.flatten();
        if let Some((frame, header)) = frame {
            self.frames.send(Work::Frame(Box::new((frame, header, readings)))).map_err(|_| JobError::Writer)?;
        }
        if is_step {
            (self.progress)(Done::Step);
        }
        Ok(())
    }

    fn wants_state(&self, next: u32) -> bool {
        if self.job.take_after.is_some_and(|step| step + 1 == next) {
            return true;
        }
        match self.job.save_every {
            SaveEvery::Time(time) => !time.is_zero() && self.saved.elapsed() >= time,
            SaveEvery::Steps(steps) => next.is_multiple_of(steps.max(1)),
        }
    }

    fn save(&mut self, next: u32, engine: &mut dyn Engine, check: Option<&mut Check>) -> Result<(), JobError> {
        if !self.saves {
            return Ok(());
        }
        let _saves = self.trace.span(Track::Host, "save the state");
        let mut check = check;
        if let Some(step) = self.job.take_after.filter(|step| step + 1 == next) {
            let time = f64::from(step) * self.prepared.scene.time.step;
            self.state = Some(take(self.prepared, engine, check.as_deref_mut(), time)?);
        }
        let mut of_loop = capture(next, engine, check)?;
        put_periodic(&mut of_loop, self.periodic);
        let mut saved = self.job.identity.clone();
        saved.put_all("loop", of_loop);
        if let Some(account) = &self.account {
            saved.put_all("energy", account.save());
        }
        saved.put("tables", &self.tables.sync()?);
        // The state names the frames before it, so they are written first.
        let (tell, told) = sync_channel(1);
        self.frames.send(Work::Tell(tell)).map_err(|_| JobError::Writer)?;
        told.recv().map_err(|_| JobError::Writer)?;
        let written = lock(self.written);
        saved.put("frames", &written.iter().map(|frame| frame.step).collect::<Vec<_>>());
        let images: Vec<u32> = written.iter().map(|frame| frame.image.unwrap_or(NO_IMAGE)).collect();
        saved.put("frame_images", &images);
        self.between.save(&mut saved);
        saved
            .put("frame_ranges", &written.iter().map(|frame| frame.range.unwrap_or([f32::NAN; 2])).collect::<Vec<_>>());
        let apparent = |frame: &WrittenFrame| frame.apparent.unwrap_or([f32::NAN; 2]);
        saved.put("frame_apparent", &written.iter().map(apparent).collect::<Vec<_>>());
        drop(written);
        let [wall, stepping] = self.before;
        let wall = wall + self.began.elapsed().as_secs_f64();
        saved.put("seconds", &[wall, stepping + self.stepping_began.elapsed().as_secs_f64()]);
        state_file::write(&self.folder.state(), &saved)?;
        self.saved = Instant::now();
        Ok(())
    }
}

/// Frames that a saved state names.
///
/// # Errors
/// A list is absent.
pub fn frames_of(saved: &Saved) -> Result<Vec<String>, SavedError> {
    if !saved.has("frames") {
        return Ok(Vec::new());
    }
    let steps: Vec<u32> = saved.list("frames")?;
    let images: Vec<u32> = saved.list_of("frame_images", steps.len())?;
    Ok(steps.into_iter().zip(images).map(|(step, image)| frame_file(step, image_of(image), "exr")).collect())
}

/// Refuses temperatures that are not finite. The error names the first such node.
pub(crate) fn check_finite(prepared: &Prepared, step: u32, temperatures: &[f32]) -> Result<(), JobError> {
    let nodes = &prepared.nodes;
    let broken = nodes.node_of_vertex.par_iter().find_first(|node| !temperatures[**node as usize].is_finite());
    match broken {
        None => Ok(()),
        Some(node) => {
            let group = *node as usize / GROUP;
            Err(JobError::NotFinite {
                step,
                node: *node,
                part: prepared.parts[nodes.group_part[group] as usize].clone(),
                material: prepared.materials[nodes.group_material[group] as usize].name.clone(),
            })
        }
    }
}
