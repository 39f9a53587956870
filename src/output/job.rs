//! Runs a scene into a folder: steps the engine, writes frames, tables, pictures and plots, and saves the state of the run.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::sync_channel;
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use super::eclipses::Eclipses;
use super::folder::Folder;
use super::frame_maker::FrameMaker;
use super::frame_writer::{WriterWork, write_frames};
use super::image_index::{IMAGES, write_index};
use super::job_state::{EarlierResults, Keeper};
use super::recorder::StepRecorder;
use super::report::write_plots;
use super::run_pictures::{CONTACT_SHEET, draw_pictures, frame_stem};
use super::state_file;
use super::tables::{JOINTS, SERIES, Tables};
use super::video::{self, APNG, MP4};
use crate::saved::{Saved, SavedError};
use crate::simulation::check::Check;
use crate::simulation::energy::Account;
use crate::simulation::engine::Engine;
use crate::simulation::prepare::Prepared;
use crate::simulation::state::{MOST_TIMES, periodic as periodic_of, restore};
use crate::simulation::thermal_state::begin_from;
use crate::simulation::{Consumer, run_from, start_from};
use crate::trace::Track;

pub(crate) use super::job_state::frames_of;
pub(crate) use super::job_terms::{Done, Job, JobError, RunOutcome, SaveEvery};
pub(crate) use super::recorder::check_finite;

pub(crate) const REPORT_JSON: &str = "report.json";
pub(crate) const REPORT_HTML: &str = "report.html";
pub(crate) const FILES: [&str; 21] = [
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
    let began = Instant::now();
    let trace = engine.trace();
    let mut check = job.check.filter(|_| Check::is_possible(prepared)).map(|sample| Check::new(prepared, sample));
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
                EarlierResults::of(saved).map_err(lost)?,
            )
        }
        None if job.begin.is_some() => {
            let took = job.begin.map(|state| begin_from(state, engine, check.as_mut())).transpose()?;
            check = check.filter(|_| took == Some(true));
            (0, None, Tables::begin(prepared, folder)?, EarlierResults::default())
        }
        None => {
            let in_warm_up = job.earlier.filter(|saved| saved.has("warm_up.next"));
            let mut done = EarlierResults::default();
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
        let (frames, waiting) = sync_channel::<WriterWork>(WAITING_FRAMES);
        let (files, written) = (trace.clone(), &written);
        let scene = &prepared.scene;
        let writer = scope.spawn(move || write_frames(scene, folder, &files, waiting, written));
        let mut recorder = StepRecorder {
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
    Ok(RunOutcome {
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
