//! `[time]`: the steps of a run, and which of them are drawn.

use hifitime::TimeScale;

use super::epoch::parse_epoch;
use super::error::SceneError;
use super::keys;
use super::quantity::Quantity;
use super::section::Section;
use super::{Draw, Scene, Time};

/// Default change over an orbit below which a state counts as periodic [K].
const PERIODIC_TOLERANCE: f64 = 0.01;

const MOST_IMAGES: f64 = 1e7;

/// Seconds by which the last image may lie after the last step, because of rounding.
const END_SLACK: f64 = 1e-6;

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
    let warm_up_step = section.number("warm_up_step", Quantity::within(1e-6, 1e7, "s"))?;
    let warm_up_step = warm_up_step.unwrap_or(step);
    let draw = draw(section, steps, f64::from(steps) * step)?;
    Ok(Time { start, step, steps, warm_up_step, warm_up_orbits, warm_up_assumed, periodic, draw })
}

impl Scene {
    /// The scene with a periodic warm-up, where it states no warm-up and its orbit repeats. Otherwise it is as stated.
    pub(crate) fn periodic_unless_stated(&self, assumption: &str) -> Self {
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
        _ if tolerance.is_some() => Err(section.clash(
            "warm_up_tolerance",
            &["warm_up"],
            "is used with warm_up = 'periodic' only: state that, or leave it out",
        )),
        _ => Ok(None),
    }
}

/// The images of a run that ends at `end` [s].
fn draw(section: &Section, steps: u32, end: f64) -> Result<Draw, SceneError> {
    section.exclusive("draw_every", "draw_steps")?;
    section.exclusive("draw_every", "images")?;
    section.exclusive("draw_steps", "images")?;
    if section.has("images") {
        let times = images(section, end)?;
        return Ok(if times.is_empty() { Draw::None } else { Draw::Times(times) });
    }
    if let Some(drawn) = section.wholes("draw_steps", 0..=u32::MAX)? {
        if let Some(beyond) = drawn.iter().find(|&&step| step > steps) {
            return Err(section.clash(
                "draw_steps",
                &["steps"],
                format!("step {beyond} lies beyond the last step, {steps}"),
            ));
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

/// Times of `images`, a list or a rate over an interval, in a run that ends at `end` [s].
fn images(section: &Section, end: f64) -> Result<Vec<f64>, SceneError> {
    let within = |time: f64| {
        let late = time > end + END_SLACK;
        let message = || format!("an image at {time} s lies after the last step, at {end} s: state more time.steps");
        if late { Err(section.clash("images", &["step", "steps"], message())) } else { Ok(time.min(end)) }
    };
    if !section.is_table("images") {
        let times = section.list("images", Quantity::non_negative("s"))?.unwrap_or_default();
        if let Some(pair) = times.windows(2).find(|pair| pair[0] >= pair[1]) {
            return Err(section.error("images", format!("must increase, but {} follows {}", pair[1], pair[0])));
        }
        return times.into_iter().map(within).collect();
    }
    let Some(rule) = section.table("images", keys::IMAGES)? else { return Ok(Vec::new()) };
    let start = rule.number("start", Quantity::non_negative("s"))?;
    let start = rule.required("start", start, "the time of the first image [s]")?;
    let stop = rule.number("stop", Quantity::non_negative("s"))?;
    let stop = rule.required("stop", stop, "the time after which there are no images [s]")?;
    let rate = rule.number("rate_hz", Quantity::positive("1/s"))?;
    let rate = rule.required("rate_hz", rate, "the number of images in a second")?;
    if stop < start {
        return Err(rule.clash("stop", &["start"], format!("{stop} s lies before the start, {start} s")));
    }
    // The rounding of a decimal rate must not drop the last image.
    let last = ((stop - start) * rate * (1.0 + 1e-12) + 1e-9).floor();
    if last + 1.0 > MOST_IMAGES {
        let message = format!("asks for too much work: {:.3e} images; the limit is {MOST_IMAGES:e}", last + 1.0);
        return Err(rule.clash("rate_hz", &["start", "stop"], message));
    }
    (0..=last as u32).map(|number| within(start + f64::from(number) / rate)).collect()
}
