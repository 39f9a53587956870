//! Hard cases of additions below f32 resolution: slow heating at 10 to 1000 Hz, and a day of the paper's cube.

use super::{Built, rows_apart};
use crate::bench::hard::case::{CaseScale, HardCase};
use crate::bench::hard::plain;
use crate::bench::hard::way::fixed_euler;
use crate::paper::cube::{self, ALTITUDES, ALUMINIUM, Loads, SOLAR_CONSTANTS};
use crate::thermal::network::reference::ReferenceStepper;
use crate::thermal::network::stepper::{StepMethod, Stepper};

/// Error limit for small steps of the paper's cube [K], and its source.
const SMALL_STEPS: (f64, &str) = (2e-3, "docs/numerics.md 6, the cube at 10 and 100 Hz");

/// The paper's aluminium cube without radiation. The panels gain 2e-5 to 1.2e-4 K/s.
fn slow_heating(rate: u32) -> HardCase {
    let panels = || {
        let mut built = Built::default();
        (0..6).for_each(|_| {
            built.store(24_300.0, 290.0);
        });
        built.0
    };
    let heat = || (1..=6).map(|panel| 2e-5 * f64::from(panel) * 24_300.0).collect::<Vec<f64>>();
    // A frame lasts 10 s. Steps last a tenth, a hundredth or a thousandth of a second.
    let frame = 10.0;
    let frames = move |scale: CaseScale| match rate {
        10 => scale.of(60, 600, 6_000),
        100 => scale.of(20, 60, 600),
        _ => scale.of(10, 10, 60),
    };
    let expected = |frames: usize| {
        let row = |frame: usize| (1..=6).map(|panel| 290.0 + 2e-5 * f64::from(panel) * 10.0 * frame as f64).collect();
        (1..=frames).map(row).collect::<Vec<Vec<f64>>>()
    };
    let steps = 10 * rate;
    let what = format!(
        "six panels of 24,300 J/K at 290 K gain 2e-5 to 1.2e-4 K/s, {:.0e} K a step and less; a straight line",
        1.2e-4 / f64::from(rate)
    );
    small_steps(&format!("heating too small for f32 at {rate} Hz"), &what).measured(
        move |target, scale| {
            let count = frames(scale);
            let rows = fixed_euler(target, &panels(), &mut std::iter::repeat_n(heat(), count), frame, steps)?;
            Ok(rows_apart(&rows, &expected(count)))
        },
        move |scale| {
            let count = frames(scale);
            let rows = plain::euler_f32(&panels(), &mut std::iter::repeat_n(heat(), count), frame, steps);
            rows_apart(&rows, &expected(count))
        },
    )
}

fn small_steps(name: &str, what: &str) -> HardCase {
    HardCase::new(name, what, "K", SMALL_STEPS).remedy(
        "a temperature is a multiple of 1/256 K and a small rest, which the step is added to",
        "Euler in plain f32",
    )
}

/// The paper's conducting cube at 10 Hz for a day. Heat is constant in each step of 16.7 s.
struct Day;

impl Day {
    /// Steps of about 0.1 s in a frame, 864,540 a day.
    const STEPS: u32 = 167;

    fn problem() -> Result<cube::CubeProblem, String> {
        let [solar_constant, _] = SOLAR_CONSTANTS;
        let [_, altitude] = ALTITUDES;
        let case = cube::Cube { panel: ALUMINIUM, conducting: true, loads: Loads::All, solar_constant, altitude };
        case.problem().map_err(|error| error.to_string())
    }

    fn frames(scale: CaseScale) -> usize {
        scale.of(40, cube::STEPS, (86_400.0 / cube::STEP).ceil() as usize)
    }

    fn heat(problem: &cube::CubeProblem, frames: usize) -> impl Iterator<Item = Vec<f64>> {
        (0..frames).map(|frame| problem.heat[frame % cube::STEPS].to_vec())
    }

    /// Reference: RKL2 in f64 with steps of a quarter of a second.
    fn expected(problem: &cube::CubeProblem, frames: usize) -> Vec<Vec<f64>> {
        let mut stepper = ReferenceStepper::new(problem.network.clone(), &[]);
        let mut row = |heat: Vec<f64>| {
            let Ok(()) = stepper.set_heat(&heat, &[0.0; 6]);
            let Ok(_) = stepper.attempt(StepMethod::Rkl2 { stages: 3 }, 0.0, cube::STEP / 64.0, 64);
            let Ok(()) = stepper.keep();
            let Ok(now) = stepper.temperatures();
            now
        };
        Self::heat(problem, frames).map(&mut row).collect()
    }
}

fn day() -> HardCase {
    let what = "864,000 steps of Euler (an orbit in --quick), aluminium, conducting; RKL2 in f64 with steps of 0.26 s";
    small_steps("a day of the paper's cube at 10 Hz", what).measured(
        |target, scale| {
            let (problem, frames) = (Day::problem()?, Day::frames(scale));
            let heat = &mut Day::heat(&problem, frames);
            let rows = fixed_euler(target, &problem.network, heat, cube::STEP, Day::STEPS)?;
            Ok(rows_apart(&rows, &Day::expected(&problem, frames)))
        },
        |scale| {
            let (Ok(problem), frames) = (Day::problem(), Day::frames(scale)) else { return f64::INFINITY };
            let heat = &mut Day::heat(&problem, frames);
            let rows = plain::euler_f32(&problem.network, heat, cube::STEP, Day::STEPS);
            rows_apart(&rows, &Day::expected(&problem, frames))
        },
    )
}

pub(crate) fn cases() -> Vec<HardCase> {
    [10, 100, 1000].map(slow_heating).into_iter().chain([day()]).collect()
}
