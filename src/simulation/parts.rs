//! The parts of a step. A step in which the eclipse begins or ends is halved, again and again around the penumbra, where a surface stores so little
//! heat that the mean load of the whole step would not do, and so is a step in which the Sun or a joint turns far against the craft (docs/numerics.md 3). All steps are halved where surfaces that see each other cool so fast that infrared
//! must not be held for a step (docs/numerics.md 4a).
//!
//! Halves keep the lengths of parts few. A network in one pass has a plan for each length.

use crate::environment::step::StepLoads;

/// Interval of a step, or of a part of one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Passing {
    /// Start [s].
    pub(crate) start: f64,
    /// End [s].
    pub(crate) end: f64,
    /// Length in steps.
    pub(crate) steps: f64,
}

impl Passing {
    /// The parts in which the step is taken, in order. Nearly always the step itself.
    pub(crate) fn parts(self, loads: &StepLoads) -> Vec<Self> {
        let mut parts = Vec::new();
        self.divide(loads, &mut parts);
        parts
    }

    /// Number of equal parts in which the step is taken wherever it lies.
    pub(crate) fn equal_parts(self, loads: &StepLoads) -> u32 {
        let is_halved = |parts: &u32| {
            let share = f64::from(*parts).recip();
            loads.is_always_halved(share * (self.end - self.start), share * self.steps)
        };
        std::iter::successors(Some(1), |parts| Some(2 * parts)).find(|parts| !is_halved(parts)).unwrap_or(1)
    }

    fn divide(self, loads: &StepLoads, parts: &mut Vec<Self>) {
        let Self { start, end, steps } = self;
        if !loads.needs_halves(start, end, steps) {
            parts.push(self);
            return;
        }
        // A step of several steps of the scene is cut between them.
        let first = if steps > 1.0 { (0.5 * steps).ceil() } else { 0.5 * steps };
        let middle = start + first / steps * (end - start);
        Self { start, end: middle, steps: first }.divide(loads, parts);
        Self { start: middle, end, steps: steps - first }.divide(loads, parts);
    }
}

#[cfg(test)]
mod tests {
    use glam::DQuat;

    use super::*;
    use crate::environment::{Attitude, CircularOrbit, Environment};

    fn loads(eclipse: bool) -> StepLoads {
        under(eclipse, &Attitude::Inertial { inertial_from_body: DQuat::IDENTITY })
    }

    fn under(eclipse: bool, attitude: &Attitude) -> StepLoads {
        let orbit = CircularOrbit { altitude: 408e3, period: 5554.0, beta: 0.0, phase: 0.0 };
        let environment = Environment {
            solar_constant: Some(1361.0),
            albedo: None,
            planet_ir: None,
            planet_radius: 6.371e6,
            eclipse,
            background_temperature: None,
        };
        StepLoads::new(&orbit, attitude, &environment).expect("a sky")
    }

    fn orbit(loads: &StepLoads, step: f64, steps: f64) -> Vec<Passing> {
        let count = (5554.0 / step).ceil() as u32;
        let whole = |number| Passing { start: step * f64::from(number), end: step * f64::from(number + 1), steps };
        (0..count).flat_map(|number| whole(number).parts(loads)).collect()
    }

    #[test]
    fn steps_are_halved_around_the_penumbra_and_nowhere_else() {
        let loads = loads(true).with_parts_of(1.875);
        let parts = orbit(&loads, 15.0, 1.0);
        let contacts = loads.sky_model().contacts(0.0, 5554.0);
        assert_eq!(contacts.len(), 4);
        for part in &parts {
            let length = part.end - part.start;
            assert!([15.0, 7.5, 3.75, 1.875].iter().any(|one| (length - one).abs() < 1e-9), "{part:?}");
            assert!((part.steps - length / 15.0).abs() < 1e-12, "{part:?}");
            let dark = |[from, to]: &[f64; 2]| part.end > *from && part.start < *to;
            let penumbra = [[contacts[0], contacts[1]], [contacts[2], contacts[3]]].iter().any(dark);
            assert!(!penumbra || length < 1.9, "{part:?}");
        }
        assert!(parts.windows(2).all(|pair| (pair[0].end - pair[1].start).abs() < 1e-9));
        let more = parts.len() - 371;
        assert!((10..40).contains(&more), "{more} parts more than steps in an orbit");
        let halved = parts.iter().filter(|part| part.steps < 1.0);
        let far = |part: &&Passing| contacts.iter().all(|contact| (part.start - contact).abs() > 23.0);
        assert_eq!(halved.filter(far).count(), 0);
    }

    #[test]
    fn a_coarse_step_is_cut_between_steps_of_the_scene() {
        let loads = loads(true).with_parts_of(7.5);
        for part in orbit(&loads, 90.0, 6.0) {
            let whole = (part.steps.fract() == 0.0) && part.steps >= 1.0;
            assert!(whole || part.steps == 0.5, "{part:?}");
        }
    }

    #[test]
    fn all_steps_of_the_scene_are_halved_and_coarse_ones_are_not() {
        let loads = loads(false).with_parts_up_to(3.75);
        assert!(orbit(&loads, 15.0, 1.0).iter().all(|part| part.steps == 0.25));
        assert!(orbit(&loads, 90.0, 6.0).iter().all(|part| part.steps == 6.0));
        for (length, steps, parts) in [(15.0, 1.0, 4), (7.0, 7.0 / 15.0, 2), (3.0, 0.2, 1), (90.0, 6.0, 1)] {
            assert_eq!(Passing { start: 0.0, end: length, steps }.equal_parts(&loads), parts, "{length}");
        }
    }

    #[test]
    fn a_step_in_which_the_sun_turns_far_is_halved() {
        let attitude =
            Attitude::Spin { inertial_from_body: DQuat::IDENTITY, axis: glam::DVec3::Z, rate: 0.5f64.to_radians() };
        let far = 4f64.to_radians();
        // The step [s], the shortest part [s], and the length of the parts. 0.5 deg/s.
        for (step, shortest, part) in
            [(8.0, 0.1, 8.0), (15.0, 0.1, 7.5), (60.0, 0.1, 7.5), (60.0, 20.0, 15.0), (60.0, 60.0, 60.0)]
        {
            let loads = under(false, &attitude).with_parts_by_turn([far, shortest]);
            let whole = Passing { start: step, end: 2.0 * step, steps: 1.0 };
            let parts = whole.parts(&loads);
            assert!(parts.iter().all(|one| (one.end - one.start - part).abs() < 1e-9), "{step} {shortest}: {parts:?}");
            // Coarse steps of a warm-up stay whole.
            assert_eq!(Passing { steps: 4.0, ..whole }.parts(&loads).len(), 1);
        }
    }

    /// Without an eclipse, or without a light surface, nothing is divided.
    #[test]
    fn other_scenes_have_whole_steps() {
        for loads in [loads(false).with_parts_of(1.875), loads(true)] {
            assert!(orbit(&loads, 15.0, 1.0).iter().all(|part| part.steps == 1.0));
        }
    }
}
