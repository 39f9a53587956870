//! When an image is taken: a time along the orbit.

use super::distribution::Distribution;
use super::random::{RandomPlan, RandomStream};
use super::reader::SpecTable;
use crate::environment::sky::{Boundary, SkyModel};
use crate::scene::SceneError;

/// Keys of `[time]`.
pub(crate) const TIME: &[&str] = &["orbits", "after_entry", "after_exit", "light"];

/// The event from which a time is counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum TimeOrigin {
    /// The start, in orbits.
    Start,
    /// The beginning of the penumbra, in s.
    Entry,
    /// The end of the penumbra, in s.
    Exit,
}

/// Light of the Sun on the craft.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum LightRule {
    Any,
    Lit,
    Penumbra,
    Shadow,
}

/// How times are drawn.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct TimeRule {
    origin: TimeOrigin,
    drawn: Distribution,
    light: LightRule,
}

/// Why an orbit has no time for an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum NoTime {
    /// The orbit has no eclipse, and times are counted from one.
    NoEclipse,
    /// No attempt met the light that is asked for, or a time after the start.
    NoLight,
}

impl TimeRule {
    pub(super) fn read(root: &SpecTable) -> Result<Self, SceneError> {
        let all = || Distribution::Uniform([0.0, 1.0]);
        let Some(table) = root.table("time", TIME)? else {
            return Ok(Self { origin: TimeOrigin::Start, drawn: all(), light: LightRule::Any });
        };
        let words = [
            ("any", LightRule::Any),
            ("lit", LightRule::Lit),
            ("penumbra", LightRule::Penumbra),
            ("shadow", LightRule::Shadow),
        ];
        let light = table.choice("light", &words)?.unwrap_or(LightRule::Any);
        let mut spans = None;
        for (key, origin, range) in [
            ("orbits", TimeOrigin::Start, 0.0..=1e4),
            ("after_entry", TimeOrigin::Entry, -1e6..=1e6),
            ("after_exit", TimeOrigin::Exit, -1e6..=1e6),
        ] {
            let unit = if origin == TimeOrigin::Start { "orbits" } else { "s" };
            let Some(drawn) = table.drawn_number(key, range, unit)? else { continue };
            if spans.replace((origin, drawn)).is_some() {
                return Err(table.error(key, "is one time too many: state one of orbits, after_entry and after_exit"));
            }
        }
        let (origin, drawn) = spans.unwrap_or((TimeOrigin::Start, all()));
        Ok(Self { origin, drawn, light })
    }

    /// Names of the numbers of an image.
    pub(crate) fn names(&self) -> Vec<String> {
        self.drawn.names("time")
    }

    /// The time of an image [s], and how many attempts were rejected.
    ///
    /// # Errors
    /// No attempt gives a time.
    pub(crate) fn draw(
        &self,
        plan: &RandomPlan,
        image: u64,
        sky: &SkyModel,
        attempts: u32,
    ) -> Result<(f64, u32), NoTime> {
        let period = sky.period();
        let origin = match self.origin {
            TimeOrigin::Start => 0.0,
            border => {
                let events = sky.events(0.0, 2.0 * period);
                let is_it = |entry: bool| entry == (border == TimeOrigin::Entry);
                let mut met = events.iter().filter(|event| event.boundary == Boundary::Penumbra && is_it(event.entry));
                met.next().ok_or(NoTime::NoEclipse)?.time
            }
        };
        for attempt in 0..attempts {
            let drawn = self.drawn.number("time", &plan.source(RandomStream::Image, image, attempt));
            let time = if self.origin == TimeOrigin::Start { drawn * period } else { origin + drawn };
            // A time before the start is replaced by the time one orbit later, where the light of a circular orbit is the same.
            let time = if time < 0.0 && sky.repeats_after().is_some() { time + period } else { time };
            let lit = sky.lit_fraction(time);
            let fits = match self.light {
                LightRule::Any => true,
                LightRule::Lit => lit >= 1.0,
                LightRule::Penumbra => lit > 0.0 && lit < 1.0,
                LightRule::Shadow => lit <= 0.0,
            };
            if time >= 0.0 && fits {
                return Ok((time, attempt));
            }
        }
        Err(NoTime::NoLight)
    }
}
