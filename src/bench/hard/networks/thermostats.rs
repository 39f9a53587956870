//! Hard cases of thermostats: forty switches with exact times, and a heater that would switch without end.

use super::{Built, DEFAULT, FRAME};
use crate::bench::hard::case::{HardCase, apart};
use crate::bench::hard::way::integrated;
use crate::simulation::network::unfinished;
use crate::thermal::network::control::{ControlError, Integrator, Series};
use crate::thermal::network::schedule::{Schedule, Thermostat};
use crate::thermal::network::{Network, NodeKind};

/// A tank of 400 J/K with 0.5 W/K to 250 K. A heater of 30 W goes on at 280 K and off at 285 K.
struct Tank;

impl Tank {
    const BASE: f64 = 250.0;
    const TAU: f64 = 400.0 / 0.5;
    /// Temperature limit while heated [K].
    const HOT: f64 = 250.0 + 30.0 / 0.5;
    const BAND: [f64; 2] = [280.0, 285.0];
    const START: f64 = 290.0;
    const SWITCHES: usize = 40;

    fn network() -> Network {
        let mut built = Built::default();
        let tank = built.store(400.0, Self::START);
        let base = built.node(NodeKind::Boundary, 0.0, 0.0, Self::BASE);
        built.join(tank, base, 0.5);
        built.0
    }

    /// Time [s] between two temperatures while the tank tends to `end` [K].
    fn way(from: f64, to: f64, end: f64) -> f64 {
        Self::TAU * ((from - end) / (to - end)).ln()
    }

    /// Switching times [s]. The first switches the heater on.
    fn switches() -> Vec<f64> {
        let [low, high] = Self::BAND;
        let mut time = Self::way(Self::START, low, Self::BASE);
        let mut times = Vec::new();
        while times.len() < Self::SWITCHES {
            times.push(time);
            time +=
                if times.len() % 2 == 1 { Self::way(low, high, Self::HOT) } else { Self::way(high, low, Self::BASE) };
        }
        times
    }

    /// Ends of all frames until three frames after the last switch [s].
    fn times() -> Vec<f64> {
        let last = Self::switches().last().copied().unwrap_or(0.0) + 3.0 * FRAME;
        (1..=(last / FRAME) as u32).map(|frame| FRAME * f64::from(frame)).collect()
    }

    fn at(time: f64, switches: &[f64]) -> f64 {
        let passed = switches.partition_point(|switch| *switch <= time);
        let (since, from, end) = match passed {
            0 => (0.0, Self::START, Self::BASE),
            n if n % 2 == 1 => (switches[n - 1], Self::BAND[0], Self::HOT),
            n => (switches[n - 1], Self::BAND[1], Self::BASE),
        };
        end + (from - end) * (-(time - since) / Self::TAU).exp()
    }

    fn expected() -> Vec<f64> {
        let switches = Self::switches();
        Self::times().into_iter().map(|time| Self::at(time, &switches)).collect()
    }

    fn run() -> Result<Series, String> {
        let [on_below, off_above] = Self::BAND;
        let thermostat = Thermostat { node: 0, sensor: 0, power: 30.0, on_below, off_above, initially_on: false };
        let schedule = Schedule { thermostats: vec![thermostat], times: Self::times(), ..Schedule::default() };
        integrated(&Self::network(), &schedule, Integrator::Default).map_err(|error| unfinished(&error))
    }

    /// Temperatures and switching times if the thermostat is asked once a frame. Each frame is exact.
    fn asked_once_a_frame() -> (Vec<f64>, Vec<f64>) {
        let [low, high] = Self::BAND;
        let (mut now, mut on) = (Self::START, false);
        let (mut rows, mut switches) = (Vec::new(), Vec::new());
        for time in Self::times() {
            let end = if on { Self::HOT } else { Self::BASE };
            now = end + (now - end) * (-FRAME / Self::TAU).exp();
            if if on { now > high } else { now < low } {
                on = !on;
                switches.push(time);
            }
            rows.push(now);
        }
        (rows, switches)
    }

    /// Largest error of switching times [s], infinite if a switch is missing.
    fn late(temperatures: &[f64]) -> f64 {
        let last = Self::times().last().copied().unwrap_or(0.0);
        let expected: Vec<f64> = Self::switches().into_iter().filter(|time| *time <= last).collect();
        apart(temperatures, &expected)
    }
}

/// A foil without capacitance. The heater moves the foil across the band of the heater's own sensor.
fn chattering() -> Result<f64, String> {
    let mut built = Built(Network { space_temperature: 3.0, ..Network::default() });
    let body = built.node(NodeKind::Diffusive, 100.0, 0.05, 290.0);
    let foil = built.node(NodeKind::Arithmetic, 0.0, 0.01, 290.0);
    built.join(body, foil, 0.1);
    let thermostat =
        Thermostat { node: foil, sensor: foil, power: 20.0, on_below: 250.0, off_above: 252.0, initially_on: false };
    let schedule = Schedule { thermostats: vec![thermostat], times: vec![1e4], ..Schedule::default() };
    match integrated(&built.0, &schedule, Integrator::Default) {
        Err(ControlError::Chatter { thermostat: 0, .. }) => Ok(0.0),
        Err(error) => Err(format!("refused otherwise: {}", unfinished(&error))),
        Ok(series) => Ok(series.switches.len() as f64),
    }
}

/// Number of switches in 10 s if the sensor is asked every millisecond. The foil stores nothing, so the heater moves it
/// far across the band at once.
fn asked_every_millisecond() -> f64 {
    // The body stays near 240 K for 10 s (0.2 W on 100 J/K). The foil follows it through 0.1 W/K.
    let (body, mut on, mut switches) = (240.0, false, 0u32);
    for _ in 0..10_000 {
        let foil: f64 = if on { body + 20.0 / 0.1 } else { body };
        if if on { foil > 252.0 } else { foil < 250.0 } {
            on = !on;
            switches += 1;
        }
    }
    f64::from(switches)
}

pub(crate) fn cases() -> Vec<HardCase> {
    let crossing = "sub-steps end where a sensor crosses its threshold";
    vec![
        HardCase::new(
            "thermostat, temperatures",
            "a tank between 280 and 285 K through 40 switches; exponentials between them",
            "K",
            DEFAULT,
        )
        .remedy(crossing, "asked once a frame of 16.7 s")
        .measured(
            |_, _| {
                let temperatures: Vec<f64> = Tank::run()?.rows.iter().map(|row| row[0]).collect();
                Ok(apart(&temperatures, &Tank::expected()))
            },
            |_| apart(&Tank::asked_once_a_frame().0, &Tank::expected()),
        ),
        HardCase::new(
            "thermostat, switching times",
            "the same tank: none of 40 switches lost; exponentials between them",
            "s",
            (0.05, "docs/numerics.md 6, switching time"),
        )
        .remedy(crossing, "asked once a frame of 16.7 s, which loses switches")
        .measured(
            |_, _| {
                let switches = Tank::run()?.switches;
                Ok(Tank::late(&switches.iter().map(|switch| switch.time).collect::<Vec<_>>()))
            },
            |_| Tank::late(&Tank::asked_once_a_frame().1),
        ),
        HardCase::new(
            "thermostat chatter",
            "a heater that moves its own sensor of C = 0 across the band: refused, not switched without end",
            "switches",
            (0.0, "refused by name"),
        )
        .remedy(
            "switches close upon each other end the run with the name of the thermostat",
            "asked after every step of 1 ms, in 10 s",
        )
        .measured(|_, _| chattering(), |_| asked_every_millisecond()),
    ]
}
