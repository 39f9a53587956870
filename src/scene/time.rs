//! `[time]`: the steps of a run, and which of them are drawn.

use hifitime::TimeScale;

use super::epoch::parse_epoch;
use super::error::SceneError;
use super::quantity::Quantity;
use super::section::Section;
use super::{Draw, Scene, Time};

/// Default change over an orbit below which a state counts as periodic [K].
const PERIODIC_TOLERANCE: f64 = 0.01;

/// Default limit on the orbits of a periodic warm-up.
const MOST_ORBITS: f64 = 100.0;

/// Remark for readers of a scene that states no warm-up.
const COLD: &str = "No orbit is stepped before time 0 (time.warm_up_orbits is absent).";

pub(super) fn read(section: &Section, assumptions: &mut Vec<String>) -> Result<Time, SceneError> {
    let step = section.number("step", Quantity::within(1e-6, 1e7, "s"))?;
    let step = section.required("step", step, "the length of a step [s]")?;
    let steps = section.whole("steps", 1..=u32::MAX)?;
    let steps = section.required("steps", steps, "the number of steps")?;
    let warm_up_orbits = section.number("warm_up_orbits", Quantity::within(0.0, 1e6, "orbits"))?.unwrap_or_else(|| {
        if section.has("warm_up") {
            return MOST_ORBITS;
        }
        assumptions.push(COLD.to_string());
        0.0
    });
    let warm_up_assumed = !section.has("warm_up_orbits") && !section.has("warm_up");
    let periodic = periodic(section)?;
    let start = match section.string("start")? {
        Some(text) => Some(parse_epoch(text, TimeScale::UTC).map_err(|message| section.error("start", message))?),
        None => None,
    };
    Ok(Time { start, step, steps, warm_up_orbits, warm_up_assumed, periodic, draw: draw(section, steps)? })
}

impl Scene {
    /// The scene with a periodic warm-up, where it states no warm-up and its orbit repeats. Otherwise it is as stated.
    pub fn periodic_unless_stated(&self, assumption: &str) -> Self {
        let mut scene = self.clone();
        if self.time.warm_up_assumed && self.orbit.period().is_finite() {
            (scene.time.periodic, scene.time.warm_up_orbits) = (Some(PERIODIC_TOLERANCE), MOST_ORBITS);
            scene.assumptions.retain(|one| one != COLD);
            scene.assumptions.push(assumption.to_owned());
        }
        scene
    }
}

/// Tolerance of `warm_up = "periodic"` [K].
fn periodic(section: &Section) -> Result<Option<f64>, SceneError> {
    let tolerance = section.number("warm_up_tolerance", Quantity::positive("K"))?;
    match section.choice("warm_up", &[("orbits", false), ("periodic", true)])? {
        Some(true) => Ok(Some(tolerance.unwrap_or(PERIODIC_TOLERANCE))),
        _ if tolerance.is_some() => {
            Err(section
                .error("warm_up_tolerance", "is used with warm_up = 'periodic' only: state that, or leave it out"))
        }
        _ => Ok(None),
    }
}

fn draw(section: &Section, steps: u32) -> Result<Draw, SceneError> {
    section.exclusive("draw_every", "draw_steps")?;
    if let Some(drawn) = section.wholes("draw_steps", 0..=u32::MAX)? {
        if let Some(beyond) = drawn.iter().find(|&&step| step > steps) {
            return Err(section.error("draw_steps", format!("step {beyond} lies beyond the last step, {steps}")));
        }
        if let Some(pair) = drawn.windows(2).find(|pair| pair[0] >= pair[1]) {
            return Err(section.error("draw_steps", format!("must increase, but {} follows {}", pair[1], pair[0])));
        }
        return Ok(if drawn.is_empty() { Draw::None } else { Draw::Steps(drawn) });
    }
    Ok(match section.whole("draw_every", 0..=u32::MAX)? {
        Some(0) => Draw::None,
        Some(stride) => Draw::Every(stride),
        None => Draw::Every(1),
    })
}
