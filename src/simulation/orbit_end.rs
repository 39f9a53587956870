//! Temperatures between two orbits of a warm-up, and an orbit of a scene beside which the same scene is warmed up with other values.
//!
//! The periodic state is known to the tolerance of the warm-up alone, and an orbit of the scene as it is still changes it by r. With other values a state is sought
//! that an orbit changes by the same r. To first order r is then absent from the difference of both states, so only the difference has to settle.

use std::sync::Arc;

use super::engine::{Engine, EngineError, Order};
use super::prepare::Prepared;
use super::state::BetweenSteps;
use crate::model::nodes::GROUP;
use crate::thermal::network::one_pass::HalvingCourse;

/// Share of the largest difference between both scenes to which the difference settles.
const SHARE: f64 = 1e-3;

/// Temperatures between two orbits [K].
pub(crate) struct OrbitEnd {
    pub(super) network: Option<Vec<f64>>,
    pub(super) structures: Vec<f64>,
    drawn: Vec<f32>,
}

impl OrbitEnd {
    /// The present temperatures of an engine.
    ///
    /// # Errors
    /// A call that fails.
    pub(crate) fn new(engine: &mut dyn Engine) -> Result<Self, EngineError> {
        let (network, structures) = (engine.network_temperatures()?, engine.structures()?);
        engine.submit(None, Order { temperatures: true, ..Order::default() })?;
        Ok(Self { network, structures, drawn: engine.deliver()?.temperatures.unwrap_or_default() })
    }

    /// Refuses temperatures that are no numbers. No change would tell them.
    ///
    /// # Errors
    /// The part of the first such node.
    pub(super) fn check(&self, prepared: &Prepared) -> Result<(), EngineError> {
        let nodes = &prepared.nodes;
        let is_none = |temperature: &f64| !temperature.is_finite();
        let in_network = || {
            let node = self.network.as_ref()?.iter().position(is_none)?;
            Some(prepared.network.as_ref()?.parts(nodes)[node])
        };
        let below = || Some(prepared.structures()[self.structures.iter().position(is_none)?]);
        let drawn = || nodes.real().map(|(slot, _)| slot).find(|slot| !self.drawn[*slot].is_finite());
        let part = in_network().or_else(|| Some(nodes.group_part[below().or_else(drawn)? / GROUP]));
        part.map_or(Ok(()), |part| Err(EngineError::NoTemperature { part: prepared.parts[part as usize].clone() }))
    }

    /// Largest change of a node since an orbit ago [K]. The drawn temperatures of a network that was moved change only at the next step, so its own
    /// temperatures are compared.
    pub(super) fn change(&self, before: &Self, prepared: &Prepared) -> f64 {
        let drawn = |slot: &usize| prepared.network.as_ref().is_none_or(|network| !network.has(*slot));
        let others = prepared.nodes.real().map(|(slot, _)| slot).filter(drawn);
        let others = others.map(|slot| f64::from((before.drawn[slot] - self.drawn[slot]).abs()));
        let network = before.network.iter().flatten().zip(self.network.iter().flatten());
        let exact = network.chain(before.structures.iter().zip(&self.structures));
        others.chain(exact.map(|(from, to)| (from - to).abs())).fold(0.0, f64::max)
    }
}

/// An orbit of a scene as it is: the one up to time 0, or the run where that is an orbit.
pub(crate) struct BaseOrbit {
    /// The state at its start.
    pub(super) state: BetweenSteps,
    pub(super) start: OrbitEnd,
    pub(super) end: OrbitEnd,
    /// Halvings of its steps, which orbits of other values take too.
    pub(super) halvings: Arc<[u32]>,
    /// Where the orbit is the run, the mean temperatures of the network's nodes [K].
    pub(super) run_mean: Option<Vec<f64>>,
}

/// Passes a run that is an orbit. Returns the mean temperatures of the drawn nodes [K].
pub(crate) type PassRun<'a, E> = &'a mut dyn FnMut(&mut dyn Engine) -> Result<Vec<f64>, E>;

/// Does steps of an engine. Returns its result, and the halvings of each step of a network in one pass.
///
/// # Errors
/// An error of `pass`.
pub(crate) fn with_halvings<T, E>(
    engine: &mut dyn Engine,
    pass: impl FnOnce(&mut dyn Engine) -> Result<T, E>,
) -> Result<(T, Arc<[u32]>), E> {
    engine.take_halving_course(HalvingCourse::Kept(Vec::new()));
    let result = pass(engine)?;
    Ok((result, engine.take_halving_course(HalvingCourse::Decided).kept()))
}

/// How far the temperatures of a network and of structures below plates are from the scene as it is [K].
pub(crate) struct Displacement {
    network: Vec<f64>,
    structures: Vec<f64>,
}

impl Displacement {
    /// Largest difference from another [K].
    pub(crate) fn distance(&self, other: &Self) -> f64 {
        let pairs = self.network.iter().zip(&other.network).chain(self.structures.iter().zip(&other.structures));
        pairs.map(|(own, other)| (own - other).abs()).fold(0.0, f64::max)
    }
}

impl BaseOrbit {
    /// Takes an engine at its periodic state at time 0 through its run, which is an orbit.
    ///
    /// # Errors
    /// A call that fails, or an error of `pass`.
    pub(crate) fn of_run<E: From<EngineError>>(
        prepared: &Prepared,
        engine: &mut dyn Engine,
        pass: PassRun<'_, E>,
    ) -> Result<Self, E> {
        let (state, start) = (BetweenSteps::capture(0, engine, None)?, OrbitEnd::new(engine)?);
        let (drawn, halvings) = with_halvings(engine, pass)?;
        let end = OrbitEnd::new(engine)?;
        // Nodes that are not drawn are slow.
        let both = start.network.iter().flatten().zip(end.network.iter().flatten());
        let mut mean: Vec<f64> = both.map(|(start, end)| 0.5 * (start + end)).collect();
        if let Some(network) = &prepared.network {
            let in_network = drawn.iter().enumerate().filter(|(slot, _)| network.has(*slot));
            in_network.for_each(|(slot, drawn)| mean[network.node_of(slot)] = *drawn);
        }
        Ok(Self { state, start, end, halvings, run_mean: Some(mean) })
    }

    /// The change over an orbit to which a scene with other values settles [K].
    pub(super) fn tolerance(&self, after: &OrbitEnd, prepared: &Prepared) -> f64 {
        SHARE * after.change(&self.end, prepared)
    }

    /// The end of an orbit of other values, less what the orbit of the scene as it is changes.
    pub(super) fn without_its_change(&self, after: &OrbitEnd) -> OrbitEnd {
        let less = |after: &[f64], start: &[f64], end: &[f64]| moved(after, -1.0, &minus(end, start));
        let drawn = after.drawn.iter().zip(self.end.drawn.iter().zip(&self.start.drawn));
        let network = |after: &Vec<f64>| {
            let [start, end] = [&self.start, &self.end].map(|orbit| orbit.network.as_deref().unwrap_or_default());
            less(after, start, end)
        };
        OrbitEnd {
            network: after.network.as_ref().map(network),
            structures: less(&after.structures, &self.start.structures, &self.end.structures),
            drawn: drawn.map(|(after, (end, start))| after - (end - start)).collect(),
        }
    }

    /// Adds to the temperatures of a network what the orbit of the scene as it is changes.
    ///
    /// # Errors
    /// A call that fails.
    pub(super) fn add_its_change(&self, engine: &mut dyn Engine) -> Result<(), EngineError> {
        let (Some(start), Some(end)) = (&self.start.network, &self.end.network) else { return Ok(()) };
        let Some(now) = engine.network_temperatures()? else { return Ok(()) };
        engine.set_network_temperatures(&moved(&now, 1.0, &minus(end, start)))
    }

    /// Brings an engine to the state at the start of the orbit, moved by so many times a displacement.
    ///
    /// # Errors
    /// A state that does not fit the engine, or a call that fails.
    pub(super) fn restore(
        &self,
        engine: &mut dyn Engine,
        shift: Option<(&Displacement, f64)>,
    ) -> Result<(), EngineError> {
        self.state.restore(engine, None)?;
        let Some((displacement, times)) = shift else { return Ok(()) };
        if let Some(network) = &self.start.network {
            engine.set_network_temperatures(&moved(network, times, &displacement.network))?;
        }
        if self.start.structures.is_empty() {
            return Ok(());
        }
        engine.set_structures(&moved(&self.start.structures, times, &displacement.structures))
    }

    /// How far an engine at time 0 is from the scene as it is.
    ///
    /// # Errors
    /// A call that fails.
    pub(crate) fn displacement(&self, engine: &mut dyn Engine) -> Result<Displacement, EngineError> {
        let network = engine.network_temperatures()?.unwrap_or_default();
        let then = if self.run_mean.is_some() { &self.start } else { &self.end };
        Ok(Displacement {
            network: minus(&network, then.network.as_deref().unwrap_or_default()),
            structures: minus(&engine.structures()?, &then.structures),
        })
    }
}

/// Draws the temperatures of a network that was moved, which otherwise appear after the next step.
///
/// # Errors
/// A call that fails.
pub(super) fn show_network(prepared: &Prepared, engine: &mut dyn Engine) -> Result<(), EngineError> {
    let (Some(network), Some(temperatures)) = (&prepared.network, engine.network_temperatures()?) else {
        return Ok(());
    };
    let mut drawn = OrbitEnd::new(engine)?.drawn;
    network.scatter(&temperatures, |slot, temperature| drawn[slot] = temperature as f32);
    engine.show(&drawn)
}

fn minus(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

/// Temperatures after so many times a change, which keeps them above half of what they were.
fn moved(from: &[f64], times: f64, change: &[f64]) -> Vec<f64> {
    from.iter().zip(change).map(|(from, change)| (from + times * change).max(0.5 * from)).collect()
}
