//! Hard cases of cold: bodies that cool to space, and bodies that lose all their heat.

use super::{Built, DEFAULT};
use crate::bench::hard::case::{HardCase, apart};
use crate::bench::hard::plain::{self, PlainStep};
use crate::bench::hard::way::integrated;
use crate::simulation::network::unfinished;
use crate::thermal::network::control::{ControlError, Integrator};
use crate::thermal::network::schedule::{HeatTable, Schedule};
use crate::thermal::network::{Network, NodeKind};
use crate::thermal::step_response::MaterialPlate;

/// Error limit of the accurate integrator [K], and its source.
const ACCURATE: (f64, &str) = (2e-3, "docs/numerics.md 6, accurate");

/// A foil of 100 J/K and 0.8 m2 that radiates from 1000 K to a tenth of a kelvin above space.
struct Cooling;

impl Cooling {
    const PLATE: MaterialPlate = MaterialPlate { capacitance: 100.0, emissivity: 0.8 };
    const SPACE: f64 = 2.7;

    fn times() -> Vec<f64> {
        let last = Self::PLATE.time(1000.0, Self::SPACE + 0.1, Self::SPACE);
        let rows = 60;
        // Times are evenly spaced in the logarithm, from a hundredth of a second.
        (0..=rows).map(|row| 0.01 * (last / 0.01).powf(f64::from(row) / f64::from(rows))).collect()
    }

    fn expected() -> Vec<f64> {
        Self::times().iter().map(|time| Self::PLATE.temperature(1000.0, Self::SPACE, *time)).collect()
    }

    fn error(integrator: Integrator) -> Result<f64, String> {
        let mut built = Built(Network { space_temperature: Self::SPACE, ..Network::default() });
        built.node(NodeKind::Diffusive, Self::PLATE.capacitance, Self::PLATE.emissivity, 1000.0);
        let schedule = Schedule { times: Self::times(), ..Schedule::default() };
        let series = integrated(&built.0, &schedule, integrator).map_err(|error| unfinished(&error))?;
        let temperatures: Vec<f64> = series.rows.iter().map(|row| row[0]).collect();
        Ok(apart(&temperatures, &Self::expected()))
    }

    fn at_the_bound() -> f64 {
        let MaterialPlate { capacitance, emissivity } = Self::PLATE;
        let times = Self::times();
        let temperatures = plain::cooling_at_the_bound(capacitance, emissivity, Self::SPACE, 1000.0, &times);
        apart(&temperatures, &Self::expected())
    }
}

fn free_cooling(integrator: Integrator, limit: (f64, &'static str)) -> HardCase {
    let name = format!("free cooling from 1000 K to 2.8 K, {integrator}");
    HardCase::new(name, "a body that radiates to 2.7 K, looked at 61 times; its closed form", "K", limit)
        .remedy(
            "the sub-step follows an estimate of its error, and the bound of stability only picks the method",
            "Euler at the bound of its stability",
        )
        .measured(move |_, _| Cooling::error(integrator), |_| Cooling::at_the_bound())
}

/// A node that loses all its heat.
struct Empties {
    network: Network,
    heat: (u32, HeatTable),
    /// Time when its heat is gone [s].
    at: f64,
}

impl Empties {
    /// A body of 100 J/K at 50 K under -1 W.
    fn body() -> Self {
        let mut built = Built::default();
        built.store(1000.0, 300.0);
        let small = built.store(100.0, 50.0);
        Self { network: built.0, heat: (small, HeatTable::constant(-1.0)), at: 5000.0 }
    }

    /// A foil with 0.1 W/K to a boundary at 50 K. The negative load of the foil grows by 1 mW/s. The boundary supplies at most 5 W.
    fn foil() -> Self {
        let mut built = Built::default();
        let base = built.node(NodeKind::Boundary, 0.0, 0.0, 50.0);
        let foil = built.node(NodeKind::Arithmetic, 0.0, 0.0, 50.0);
        built.join(base, foil, 0.1);
        built.store(1000.0, 300.0);
        let growing = HeatTable { times: vec![0.0, 1e4], powers: vec![0.0, -10.0] };
        Self { network: built.0, heat: (foil, growing), at: 5000.0 }
    }

    /// Difference between that time and the time [s] when the run refuses the network with the node's name.
    fn refused(&self) -> Result<f64, String> {
        let times = (1..=100).map(|row| 100.0 * f64::from(row)).collect();
        let schedule = Schedule { heat: vec![self.heat.clone()], times, ..Schedule::default() };
        match integrated(&self.network, &schedule, Integrator::Default) {
            Err(ControlError::NoStep { time, node, .. } | ControlError::Unbalanced { time, node })
                if node == self.heat.0 as usize =>
            {
                Ok((time - self.at).abs())
            }
            Err(error) => Err(format!("refused otherwise: {}", unfinished(&error))),
            Ok(_) => Ok(f64::INFINITY),
        }
    }

    /// The error of plain steps: infinite, because plain steps continue below 0 K.
    fn unrefused(&self) -> f64 {
        let mut power = vec![0.0; self.network.len()];
        power[self.heat.0 as usize] = self.heat.1.after(1e4).0;
        let rows = plain::steps(&self.network, &power, 1.0, 10_000, PlainStep::OneSweep);
        if rows.iter().flatten().any(|kelvin| *kelvin < 0.0) { f64::INFINITY } else { 0.0 }
    }
}

fn below_zero(name: &str, what: &str, limit: (f64, &str), empties: fn() -> Empties) -> HardCase {
    HardCase::new(name, what, "s", limit)
        .remedy(
            "no sub-step may leave the range of temperatures, and what cannot go on ends with node and time",
            "Euler goes on below 0 K and says nothing",
        )
        .measured(move |_, _| empties().refused(), move |_| empties().unrefused())
}

pub(crate) fn cases() -> Vec<HardCase> {
    vec![
        free_cooling(Integrator::Default, DEFAULT),
        free_cooling(Integrator::Accurate, ACCURATE),
        below_zero(
            "a body that runs out of heat",
            "1 W drawn from 100 J/K at 50 K: refused by name at 5000 s",
            (0.05, "docs/numerics.md 6, as switching times"),
            Empties::body,
        ),
        below_zero(
            "a foil from which more is drawn than arrives",
            "C = 0, a load that grows to the 5 W that its neighbour can bring: refused by name at 5000 s",
            (100.0, "one interval of outputs, at which such nodes are looked at"),
            Empties::foil,
        ),
    ]
}
