//! The plate by itself against exact answers and fine steps.

use super::*;
use crate::thermal::material::Below;

const SPACE: f64 = 2.7;

fn plate(capacity: f64, over: Option<Below>, step: f64) -> Radiative {
    Radiative { capacity, over, step, hottest: 400.0 }
}

fn load(absorbed: f64) -> PlateLoad {
    PlateLoad { absorbed, emissivity: 0.8, background: SPACE }
}

/// Temperatures after `steps` steps.
fn run(start: f64, plate: &Radiative, steps: u32, flux: impl Fn(f64) -> f64) -> PlateState {
    let mut state = PlateState::settled(start);
    for step in 0..steps {
        let middle = (f64::from(step) + 0.5) * plate.step;
        state = radiative_step(state, load(flux(middle)), 1.0, plate);
    }
    state
}

/// T = (T0^-3 + 3 k t)^(-1/3), for a step of a hundredth and of eleven time constants.
#[test]
fn free_cooling_is_exact() {
    let emission = 0.8 * STEFAN_BOLTZMANN;
    for (capacity, step, fast) in [(5000.0, 10.0, false), (5000.0, 4000.0, true), (100.0, 15.0, true)] {
        let plate = plate(capacity, None, step);
        assert_eq!(plate.is_fast(0.8), fast);
        let dark = PlateLoad { background: 0.0, ..load(0.0) };
        let mut state = PlateState::settled(390.0);
        for number in 1..=20 {
            state = radiative_step(state, dark, 1.0, &plate);
            let exact = (390f64.powi(-3) + 3.0 * emission / capacity * step * f64::from(number)).powf(-1.0 / 3.0);
            assert!(
                (state.outside - exact).abs() < 1e-4,
                "{capacity}, {step} s, step {number}: {} {exact}",
                state.outside
            );
        }
        // Plain Euler is far away.
        let euler = 390.0 - step / capacity * emission * 390f64.powi(4);
        let exact = (390f64.powi(-3) + 3.0 * emission / capacity * step).powf(-1.0 / 3.0);
        assert!((euler - exact).abs() > 1e-3);
    }
}

/// Under a constant load every plate comes to its balance and stays there, whatever the step. With a structure both do, because nothing else heats it.
#[test]
fn constant_load_ends_in_balance() {
    let balance = (400.0 / (0.8 * STEFAN_BOLTZMANN) + SPACE.powi(4)).powf(0.25);
    let below = Below { capacity: 3000.0, effective_emittance: 0.05 };
    for (capacity, over) in [(5000.0, None), (50.0, None), (50.0, Some(below)), (0.0, Some(below))] {
        for start in [100.0, 390.0] {
            let state = run(start, &plate(capacity, over, 60.0), 30_000, |_| 400.0);
            assert!((state.outside - balance).abs() < 1e-4, "{capacity} from {start}: {state:?}");
            assert!(over.is_none() || (state.structure - balance).abs() < 1e-4, "{capacity} from {start}: {state:?}");
        }
    }
}

/// What is absorbed is emitted or stored, in one step of any plate without a structure. With one, what the outside gives the structure takes.
#[test]
fn heat_is_conserved() {
    let below = Below { capacity: 3000.0, effective_emittance: 0.05 };
    for capacity in [20.0, 500.0, 20_000.0] {
        let plate = plate(capacity, Some(below), 30.0);
        let own = STEFAN_BOLTZMANN * 0.8;
        let mut state = PlateState { outside: 200.0, structure: 300.0, trend: 0.0 };
        // The mean of T^4 that the outside emits, from a thousand parts of the step with the structure held.
        let held = state.structure.powi(4);
        let mut fine = state.outside;
        let mut mean = 0.0;
        for _ in 0..1000 {
            let before = fine;
            let into = 700.0 + own * SPACE.powi(4) + plate.exchange() * held;
            let (share, emission) = (plate.share() / 1000.0, own + plate.exchange());
            fine += local_change(fine, share * (into - emission * fine.powi(4)), share * emission, 4);
            mean += (before.powi(4) + 4.0 * (0.5 * (before + fine)).powi(4) + fine.powi(4)) / 6000.0;
        }
        state = radiative_step(state, load(700.0), 1.0, &plate);
        let emitted = own * (mean - SPACE.powi(4));
        let stored = capacity * (state.outside - 200.0) / 30.0;
        let given = below.capacity * (state.structure - 300.0) / 30.0;
        let left = 700.0 - emitted - stored - given;
        assert!(left.abs() < 1e-3, "{capacity}: {left}");
        // The end of the step for its mean would lose heat.
        let wrong = plate.exchange() * (state.outside.powi(4) - held);
        assert!((700.0 - emitted - stored - wrong).abs() > 0.02, "{capacity}: {wrong} for {given}");
    }
}

/// Half an orbit of Sun and half of shadow, against steps of a 64th. The parts of a step for a light structure are needed.
#[test]
fn a_structure_follows_its_outside() {
    let flux = |time: f64| if time % 6000.0 < 3600.0 { 300.0 } else { 20.0 };
    for (capacity, emittance, below, step, error) in [
        (300.0, 0.03, 8000.0, 15.0, 1e-3),
        (300.0, 0.03, 8000.0, 60.0, 4e-3),
        (0.0, 0.03, 8000.0, 60.0, 2e-2),
        (300.0, 0.5, 464.0, 15.0, 5e-2),
        (300.0, 0.5, 464.0, 60.0, 5e-2),
    ] {
        let over = Some(Below { capacity: below, effective_emittance: emittance });
        let fine = plate(capacity, over, step / 64.0);
        let coarse = plate(capacity, over, step);
        let (mut a, mut b) = (PlateState::settled(280.0), PlateState::settled(280.0));
        let (mut outside, mut structure) = (0.0f64, 0.0f64);
        for number in 0..(12_000.0 / step) as u32 {
            let middle = (f64::from(number) + 0.5) * step;
            a = radiative_step(a, load(flux(middle)), 1.0, &coarse);
            (0..64).for_each(|_| b = radiative_step(b, load(flux(middle)), 1.0, &fine));
            outside = outside.max((a.outside - b.outside).abs());
            structure = structure.max((a.structure - b.structure).abs());
        }
        println!(
            "{capacity} over {below}, {emittance}, {step} s in {} parts: {outside:.1e} {structure:.1e} K",
            coarse.parts()
        );
        assert!(outside < error && structure < error, "{capacity} over {below}: {outside} {structure}");
    }
}
