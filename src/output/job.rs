//! Runs a scene into a folder: steps the engine, writes frames, tables, pictures and plots, and saves the state of the run.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::sync_channel;
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use super::casts_file::CastsOfRun;
use super::eclipses::Eclipses;
use super::folder::{Folder, STATE};
use super::frame_maker::FrameMaker;
use super::frame_writer::{WriterWork, write_frames};
use super::image_index::{IMAGES, write_index};
use super::job_terms::RunContext;
use super::keeper::Keeper;
use super::recorder::StepRecorder;
use super::report::{FrameEntry, PlotEntry, ReportPicture, write_plots};
use super::run_pictures::{CONTACT_SHEET, WrittenFrame, draw_pictures, frame_stem};
use super::run_state::{EarlierResults, RunProgress, RunState, StepsState};
use super::sensor_files::first_sensed;
use super::sigma::RunSigma;
use super::state_file;
use super::tables::{BUDGET, JOINTS, SERIES, Tables};
use super::video::{self, APNG, MP4};
use crate::simulation::check::Check;
use crate::simulation::energy::Account;
use crate::simulation::engine::{Engine, EngineError};
use crate::simulation::orbits::Periodic;
use crate::simulation::prepare::Prepared;
use crate::simulation::state::MOST_TIMES;
use crate::simulation::thermal_state::ThermalState;
use crate::simulation::uncertainty::{PixelError, Uncertainty};
use crate::simulation::warm_up::WarmUp;
use crate::simulation::{Consumer, run_from};
use crate::stop::whole;
use crate::thermal::misfit::part;
use crate::trace::{Trace, Track, span, timed};

pub(crate) use super::job_terms::{Done, Job, JobError, RunOutcome, SaveEvery};
pub(crate) use super::recorder::check_finite;

pub(crate) const REPORT_JSON: &str = "report.json";
pub(crate) const REPORT_HTML: &str = "report.html";
pub(crate) const FILES: [&str; 22] = [
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
    BUDGET,
    CONTACT_SHEET,
    REPORT_JSON,
    REPORT_HTML,
];

/// Most frames that wait for the writer.
const WAITING_FRAMES: usize = 2;

/// Runs the scene and writes its files.
///
/// # Errors
/// A call that fails, a full disk, or a saved state of another scene.
pub(crate) fn run_into(
    prepared: &Prepared,
    engine: &mut dyn Engine,
    folder: &Folder,
    job: &Job<'_>,
    stop: &AtomicBool,
    progress: &(dyn Fn(Done) + Sync),
) -> Result<RunOutcome, JobError> {
    let casts = CastsOfRun::default();
    let run = RunContext { prepared, folder, job, stop, progress, began: Instant::now(), casts: &casts };
    let makes = span("making the check");
    let mut check = job.check.map(|sample| Check::new(prepared, sample));
    drop(makes);
    engine.keep_few_times(MOST_TIMES);
    let mut start = begin(run, engine, &mut check)?;
    (0..start.first).for_each(|_| progress(Done::Step));
    let mut open = || match earlier_loop(job) {
        Some(saved) => {
            let sums = part("the energy balance", &saved.energy).map_err(EngineError::from)?;
            Account::again(prepared, engine, sums)
        }
        None => Account::open(prepared, engine),
    };
    let mut account = prepared.scene.energy_balance.then(&mut open).transpose()?;

    let seconds = start.done.seconds;
    let written = Mutex::new(std::mem::take(&mut start.done.frames));
    let stepped = step_and_write(run, engine, check.as_mut(), &mut start, account.as_mut(), &written)?;
    let end = f64::from(stepped.steps) * prepared.scene.time.step;
    let energy = account.map(|account| account.close(prepared, engine, end)).transpose()?;
    let written = written.into_inner().unwrap_or_else(PoisonError::into_inner);
    let stepping_s = seconds[1] + stepped.seconds;

    let RunFiles { frames, pictures, plots } = draw_files(run, &mut start.tables, &written)?;
    Ok(RunOutcome {
        complete: stepped.complete,
        frames,
        pictures,
        plots,
        accuracy: check.map(|mut check| check.accuracy(prepared)),
        energy,
        budgets: start.tables.mean_budgets()?,
        sigma: job.sigma.map(RunSigma::report),
        between: stepped.between,
        pixel_error: stepped.pixel_error,
        state: stepped.state,
        periodic: start.periodic,
        network_costs: engine.network_costs().to_vec(),
        stepping_s,
        wall_before_s: seconds[0],
    })
}

/// Where the steps of a run begin.
struct RunStart<'a> {
    first: u32,
    periodic: Option<Periodic>,
    tables: Tables<'a>,
    done: EarlierResults,
}

/// The state of an earlier part of the run, where that part was past the warm-up.
fn earlier_loop<'a>(job: &Job<'a>) -> Option<&'a StepsState> {
    match job.earlier {
        Some(RunProgress::Steps(saved)) => Some(saved),
        _ => None,
    }
}

/// Restores the earlier part of the run, or begins from a thermal state, or warms up.
fn begin<'a>(
    run: RunContext<'a>,
    engine: &mut dyn Engine,
    check: &mut Option<Check>,
) -> Result<RunStart<'a>, JobError> {
    let RunContext { prepared, folder, job, .. } = run;
    if let Some(saved) = earlier_loop(job) {
        saved.state.restore(engine, check.as_mut())?;
        return Ok(RunStart {
            first: saved.state.next,
            periodic: saved.periodic,
            tables: Tables::again(prepared, folder, saved.tables, job.sigma)?,
            done: saved.done.clone(),
        });
    }
    if let Some(state) = job.begin {
        let took = state.begin(engine, check.as_mut())?;
        *check = check.take().filter(|_| took);
        let tables = Tables::begin(prepared, folder, job.sigma)?;
        return Ok(RunStart { first: 0, periodic: None, tables, done: EarlierResults::default() });
    }
    let mut done = EarlierResults::default();
    let saved = match job.earlier {
        Some(RunProgress::WarmUp(saved, seconds)) => {
            done.seconds = *seconds;
            Some(&**saved)
        }
        _ => {
            let state = RunState { identity: job.identity.clone(), progress: RunProgress::Begun };
            timed("saving the state", || state_file::write(folder.guarded()?, STATE, &state))?;
            None
        }
    };
    let mut keep = Keeper { run, state: None, saved: (0, Instant::now()), before: done.seconds };
    let mut told = || (run.progress)(Done::WarmUp);
    let check = check.as_mut();
    let mut warm_up = WarmUp { prepared, engine, check, stop: run.stop, progress: &mut told, keep: &mut keep };
    let periodic = warm_up.run(saved)?;
    engine.keep_few_times(MOST_TIMES);
    Ok(RunStart { first: 0, periodic, tables: Tables::begin(prepared, folder, run.job.sigma)?, done })
}

/// The results of the steps.
struct Stepped {
    complete: bool,
    steps: u32,
    /// Wall time [s].
    seconds: f64,
    between: Option<f64>,
    pixel_error: Option<PixelError>,
    state: Option<ThermalState>,
}

/// Makes the steps, while a thread writes the files of earlier steps.
fn step_and_write(
    run: RunContext<'_>,
    engine: &mut dyn Engine,
    mut check: Option<&mut Check>,
    start: &mut RunStart<'_>,
    account: Option<&mut Account>,
    written: &Mutex<Vec<WrittenFrame>>,
) -> Result<Stepped, JobError> {
    let RunContext { prepared, folder, stop, .. } = run;
    let first = start.first;
    let errors = match earlier_loop(run.job) {
        Some(saved) if prepared.scene.images.error => {
            Some(part("the errors of pixels", &saved.uncertainty).map_err(EngineError::from)?)
        }
        _ => run.job.begin.and_then(|state| state.errors.as_ref()),
    };
    let uncertainty = Uncertainty::asked(prepared, errors).map_err(EngineError::from)?;
    let maker = prepared.scene.camera.as_ref().map(|_| FrameMaker::new(prepared, &engine.device_name()));
    let stepping_began = Instant::now();
    std::thread::scope(|scope| {
        let (frames, waiting) = sync_channel::<WriterWork>(WAITING_FRAMES);
        let (trace, scene) = (Trace::here(), &prepared.scene);
        let writer = scope.spawn(move || {
            let _writes = trace.enter(Track::Writer);
            write_frames(scene, folder, waiting, written)
        });
        let mut recorder = StepRecorder {
            run,
            maker: maker.as_ref(),
            tables: &mut start.tables,
            account,
            uncertainty,
            steps: first,
            frames,
            written,
            periodic: start.periodic,
            between: std::mem::take(&mut start.done.between),
            state: None,
            // A warm-up that was stopped has saved its own state.
            saves: earlier_loop(run.job).is_some() || !stop.load(Ordering::Relaxed),
            saved: Instant::now(),
            stepping_began,
            before: start.done.seconds,
        };
        let steps_go = span("steps");
        if first == 0 && recorder.saves {
            recorder.save(0, engine, check.as_deref_mut())?;
        }
        let complete = whole(|| run_from(prepared, engine, check, first, stop, &mut recorder));
        let (steps, between, state) = (recorder.steps, recorder.between.error, recorder.state.take());
        let pixel_error = recorder.uncertainty.as_ref().and_then(|errors| errors.pixels().error());
        drop((recorder, steps_go));
        let _waits = span("waiting for the files");
        writer.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))?;
        let seconds = stepping_began.elapsed().as_secs_f64();
        Ok(Stepped { complete: complete?, steps, seconds, between, pixel_error, state })
    })
}

/// The files that are drawn after the last step.
struct RunFiles {
    frames: Vec<FrameEntry>,
    pictures: Vec<ReportPicture>,
    plots: Vec<PlotEntry>,
}

/// Draws the pictures, the index of images, the videos and the plots.
fn draw_files(run: RunContext<'_>, tables: &mut Tables<'_>, written: &[WrittenFrame]) -> Result<RunFiles, JobError> {
    let RunContext { prepared, folder, progress, .. } = run;
    let scene = &prepared.scene;
    let eclipses = Eclipses::of(prepared);
    let draws = span("drawing pictures");
    let (frames, pictures) = draw_pictures(prepared, &eclipses, folder, written, &|| progress(Done::Picture))?;
    if let Some(camera) = scene.camera.as_ref().filter(|_| scene.time.draw.is_between_steps()) {
        write_index(folder, &scene.time, camera, written)?;
    }
    if scene.images.video.is_some() {
        let stem = |frame: &WrittenFrame| first_sensed(scene, &frame_stem(frame.step, frame.image));
        let displays: Vec<String> =
            written.iter().filter_map(stem).map(|stem| format!("frames/{stem}_display.png")).collect();
        video::write(folder, &scene.images, &displays)?;
    }
    drop(draws);
    let _draws = span("drawing plots");
    let plots = tables.plots(&eclipses)?;
    write_plots(folder, &plots)?;
    Ok(RunFiles { frames, pictures, plots })
}
