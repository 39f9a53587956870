//! The run with all settings finer, as a reference for others.

use std::sync::atomic::AtomicBool;
use std::time::Instant;

use super::ConvergeError;
use super::knobs::{KnobScene, knobs_of};
use super::pixels::SurfaceImage;
use super::walk::{VariantCost, VariantWalk, kept_images};
use crate::scene::Scene;
use crate::simulation::prepare::Prepared;
use crate::simulation::target::Target;

/// A scene with all settings finer, or all but some.
pub(crate) struct FinestScene {
    pub(crate) scene: Scene,
    /// Its finer settings as `key = value`.
    pub(crate) settings: String,
    /// Keys of the settings that stay as they are.
    pub(crate) left: Vec<&'static str>,
}

impl FinestScene {
    /// Refines every setting of a prepared scene that trades time for error, but the keys of `left`.
    pub(crate) fn of(prepared: &Prepared, left: &[&str]) -> Self {
        let knobs = KnobScene::new(prepared, prepared.scene.clone());
        let stays = knobs_of(knobs.all).filter(|(_, knob)| left.contains(&knob.key));
        let (bits, left): (Vec<_>, Vec<_>) = stays.map(|(bit, knob)| (bit, knob.key)).unzip();
        let refined = knobs.all & !bits.iter().fold(0, |all, bit| all | bit);
        Self { scene: knobs.refined(refined), settings: knobs.sentence(refined), left }
    }
}

/// Expected wall time of [`images_after_start`] [s], from a few measured steps. Of a warm-up to the periodic state it counts `orbits`.
///
/// # Errors
/// A call that fails.
pub(crate) fn expected_s(prepared: &Prepared, target: &Target, orbits: f64) -> Result<f64, ConvergeError> {
    let never = AtomicBool::new(false);
    let kept = images(prepared);
    let expected = VariantWalk { prepared, target, kept: &kept, stop: &never }.pilot(Instant::now())?;
    let warm_ups = prepared.scene.time.periodic.map_or(1.0, |_| orbits);
    Ok(expected.run_s + warm_ups * expected.warm_up_s)
}

/// Runs a scene. Returns its images after time 0 and its cost.
///
/// # Errors
/// A call that fails.
pub(crate) fn images_after_start(
    prepared: &Prepared,
    target: &Target,
) -> Result<(Vec<SurfaceImage>, VariantCost), ConvergeError> {
    let never = AtomicBool::new(false);
    let kept = images(prepared);
    let run = VariantWalk { prepared, target, kept: &kept, stop: &never }.run(Instant::now(), &|| ())?;
    Ok((run.images, run.cost))
}

/// Numbers of the images after time 0.
fn images(prepared: &Prepared) -> Vec<usize> {
    kept_images(&prepared.scene, 1).into_iter().filter(|number| *number > 0).collect()
}
