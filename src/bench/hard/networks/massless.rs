//! Hard case: a node without heat capacity.

use super::{Built, DEFAULT};
use crate::bench::hard::case::{HardCase, apart};
use crate::bench::hard::exact::root_of_falling;
use crate::bench::hard::way::integrated;
use crate::simulation::network::unfinished;
use crate::thermal::STEFAN_BOLTZMANN;
use crate::thermal::network::control::Integrator;
use crate::thermal::network::schedule::{HeatTable, Schedule};
use crate::thermal::network::{Network, NodeKind};

/// A foil without capacitance between a boundary and space.
struct Foil;

impl Foil {
    const CONDUCTANCE: f64 = 0.2;
    const AREA: f64 = 0.1;
    const SPACE: f64 = 3.0;
    const BOUNDARY: f64 = 290.0;
    /// Capacitance that replaces zero [J/K].
    const STORE: f64 = 10.0;

    fn network(kind: NodeKind, capacitance: f64) -> Network {
        let mut built = Built(Network { space_temperature: Self::SPACE, ..Network::default() });
        let foil = built.node(kind, capacitance, Self::AREA, 100.0);
        let base = built.node(NodeKind::Boundary, 0.0, 0.0, Self::BOUNDARY);
        built.join(foil, base, Self::CONDUCTANCE);
        // The body stores heat, so the integrator must choose sub-steps.
        let body = built.store(500.0, 300.0);
        built.join(body, base, 0.5);
        built.0
    }

    /// Heat that ramps from 0 to 50 W, jumps to 5 W at 100 s, and rises again.
    fn table() -> HeatTable {
        HeatTable { times: vec![0.0, 100.0, 100.0, 200.0], powers: vec![0.0, 50.0, 5.0, 30.0] }
    }

    fn times() -> Vec<f64> {
        (0..=40).map(|row| 5.0 * f64::from(row)).collect()
    }

    /// Balance temperature at a time [K]. At the jump it uses the heat before it.
    fn balance(time: f64) -> f64 {
        let power = if time <= 100.0 { 0.5 * time } else { 5.0 + 0.25 * (time - 100.0) };
        let gain = |t: f64| {
            power + Self::CONDUCTANCE * (Self::BOUNDARY - t)
                - Self::AREA * STEFAN_BOLTZMANN * (t.powi(4) - Self::SPACE.powi(4))
        };
        root_of_falling(gain, 0.0, 2000.0)
    }

    fn error(series: &[Vec<f64>]) -> f64 {
        let temperatures: Vec<f64> = series.iter().map(|row| row[0]).collect();
        apart(&temperatures, &Self::times().into_iter().map(Self::balance).collect::<Vec<_>>())
    }

    fn schedule() -> Schedule {
        Schedule { heat: vec![(0, Self::table())], times: Self::times(), ..Schedule::default() }
    }
}

/// The case of C = 0.
pub(crate) fn no_capacitance() -> HardCase {
    let error = |kind, capacitance, integrator| {
        let series = integrated(&Foil::network(kind, capacitance), &Foil::schedule(), integrator);
        Ok(Foil::error(&series.map_err(|error| unfinished(&error))?.rows))
    };
    let what = "a foil between 290 K and space whose heat ramps and jumps; the root of its balance";
    HardCase::new("C = 0", what, "K", DEFAULT)
        .remedy(
            "its balance is solved by Newton's method at every stage, with that stage's heat",
            "10 J/K in place of none",
        )
        .measured(
            move |_, _| error(NodeKind::Arithmetic, 0.0, Integrator::Default),
            move |_| error(NodeKind::Diffusive, Foil::STORE, Integrator::Accurate).unwrap_or(f64::INFINITY),
        )
}
