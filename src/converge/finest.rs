//! The run with all settings finer, as a reference for others.

use std::sync::atomic::AtomicBool;
use std::time::Instant;

use super::ConvergeError;
use super::knobs::KnobScene;
use super::pixels::SurfaceImage;
use super::search::seconds;
use super::walk::{VariantCost, VariantWalk, kept_images};
use crate::scene::Scene;
use crate::simulation::prepare::Prepared;
use crate::simulation::target::Target;

/// A scene with all settings finer.
pub(crate) struct FinestScene {
    pub(crate) scene: Scene,
    /// Its settings as `key = value`.
    pub(crate) settings: String,
}

impl FinestScene {
    /// Refines every setting of a prepared scene that trades time for error.
    pub(crate) fn of(prepared: &Prepared) -> Self {
        let knobs = KnobScene::new(prepared, prepared.scene.clone());
        Self { scene: knobs.refined(knobs.all), settings: knobs.sentence(knobs.all) }
    }
}

/// Runs a scene. Returns its images after time 0 and its cost. `says` first gets a forecast from a few measured steps.
///
/// # Errors
/// A call that fails.
pub(crate) fn images_after_start(
    prepared: &Prepared,
    target: &Target,
    says: &dyn Fn(&str),
) -> Result<(Vec<SurfaceImage>, VariantCost), ConvergeError> {
    let kept = kept_images(&prepared.scene);
    let kept: Vec<usize> = kept.into_iter().filter(|number| *number > 0).collect();
    let walk = VariantWalk { prepared, target, kept: &kept, stop: &AtomicBool::new(false) };
    let expected = walk.pilot(Instant::now())?;
    let warm_up = seconds(expected.warm_up_s);
    says(&match prepared.scene.time.periodic {
        None => format!("about {} and {warm_up} of warm-up", seconds(expected.run_s)),
        Some(_) => format!("about {} and {warm_up} for each orbit of warm-up", seconds(expected.run_s)),
    });
    let run = walk.run(Instant::now(), &|| ())?;
    Ok((run.images, run.cost))
}
