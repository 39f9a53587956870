//! The part of a saved state that belongs to a run into a folder: its written frames and its times. Saves the state of a warm-up.

use std::time::Instant;

use super::between::Between;
use super::job_terms::{JobError, RunContext, SaveEvery};
use super::run_pictures::{WrittenFrame, frame_file};
use super::state_file;
use crate::saved::{Saved, SavedError};
use crate::simulation::check::Check;
use crate::simulation::engine::{Engine, EngineError};
use crate::simulation::keep::Keep;
use crate::simulation::state::capture;

/// The results of an earlier part of a run.
#[derive(Default)]
pub(super) struct EarlierResults {
    pub(crate) frames: Vec<WrittenFrame>,
    /// Wall time of the whole run and of its steps [s].
    pub(crate) seconds: [f64; 2],
    pub(crate) between: Between,
}

/// Number that stands for no image in a saved list.
const NO_IMAGE: u32 = u32::MAX;

fn image_of(saved: u32) -> Option<u32> {
    (saved != NO_IMAGE).then_some(saved)
}

impl EarlierResults {
    pub(crate) fn of(saved: &Saved) -> Result<Self, SavedError> {
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

pub(super) fn put_frames(saved: &mut Saved, written: &[WrittenFrame]) {
    let or_nan = |range: Option<[f32; 2]>| range.unwrap_or([f32::NAN; 2]);
    saved.put("frames", &written.iter().map(|frame| frame.step).collect::<Vec<_>>());
    saved.put("frame_images", &written.iter().map(|frame| frame.image.unwrap_or(NO_IMAGE)).collect::<Vec<_>>());
    saved.put("frame_ranges", &written.iter().map(|frame| or_nan(frame.range)).collect::<Vec<_>>());
    saved.put("frame_apparent", &written.iter().map(|frame| or_nan(frame.apparent)).collect::<Vec<_>>());
}

/// Frames that a saved state names.
///
/// # Errors
/// A list is absent.
pub(crate) fn frames_of(saved: &Saved) -> Result<Vec<String>, SavedError> {
    if !saved.has("frames") {
        return Ok(Vec::new());
    }
    let steps: Vec<u32> = saved.list("frames")?;
    let images: Vec<u32> = saved.list_of("frame_images", steps.len())?;
    Ok(steps.into_iter().zip(images).map(|(step, image)| frame_file(step, image_of(image), "exr")).collect())
}

/// Saves the state of the warm-up.
pub(super) struct Keeper<'a> {
    pub(crate) run: RunContext<'a>,
    /// The state that was taken last.
    pub(crate) state: Saved,
    /// Steps before the last state that was saved, and when it was saved.
    pub(crate) saved: (u32, Instant),
    pub(crate) before: [f64; 2],
}

impl Keep<JobError> for Keeper<'_> {
    fn take(
        &mut self,
        done: u32,
        warm_up: Saved,
        engine: &mut dyn Engine,
        check: Option<&mut Check>,
    ) -> Result<(), JobError> {
        self.state = capture(done, engine, check)?;
        self.state.put_all("own", warm_up);
        Ok(())
    }

    fn wants(&self, done: u32) -> bool {
        let (steps, time) = self.saved;
        match self.run.job.save_every {
            SaveEvery::Time(every) => !every.is_zero() && time.elapsed() >= every,
            SaveEvery::Steps(every) => done - steps >= every,
        }
    }

    fn save(&mut self) -> Result<(), JobError> {
        let mut saved = self.run.job.identity.clone();
        let [done] = self.state.array("next").map_err(EngineError::from)?;
        saved.put_all("warm_up", self.state.clone());
        let [wall, stepping] = self.before;
        saved.put("seconds", &[wall + self.run.began.elapsed().as_secs_f64(), stepping]);
        state_file::write(&self.run.folder.state(), &saved)?;
        self.saved = (done, Instant::now());
        Ok(())
    }
}
