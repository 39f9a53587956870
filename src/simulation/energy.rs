//! The energy balance of a run: the heat that each part absorbs, emits, stores and gives to other parts.
//!
//! The device sums the absorbed heat of every step (`gpu/heat.rs`). The host sums the rest in f64 from the temperatures of every step. Emission in a
//! step is the integral of a parabola through its values at the last three steps, so the balance also shows an error of the step length. Heat from space counts as emission below zero.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::engine::{Engine, EngineError};
use super::prepare::Prepared;
use crate::gpu::effects::heat::tables::{HeatOf, HeatRun, HeatTables, RUN_GROUPS};
use crate::model::nodes::GROUP;
use crate::thermal::STEFAN_BOLTZMANN;
use crate::thermal::balance::emissivity_sum;
use crate::thermal::material::Response;
use crate::thermal::misfit::check_length;

/// Heat of a part over the run [J].
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct PartEnergy {
    /// Name of the part.
    pub part: String,
    /// Absorbed from Sun and planet.
    pub absorbed_j: f64,
    /// Emitted to space.
    pub emitted_j: f64,
    /// Given by heaters.
    pub heated_j: f64,
    /// Stored at the end, less stored at the start.
    pub stored_j: f64,
    /// Received from other parts by conductors: the rest of the other columns, or 0 for a part without conductors to others.
    pub(crate) received_j: f64,
    /// Absorbed less emitted by surfaces that store no heat. A transition makes or loses this heat.
    pub unstored_j: f64,
}

/// The energy balance of a run [J].
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct EnergyBalance {
    /// All parts together.
    pub all: PartEnergy,
    /// Every part that has an account.
    pub parts: Vec<PartEnergy>,
    /// Parts without one, whose response is `radiative` or `given`.
    pub(crate) parts_left_out: usize,
    /// Heat that the network lost or made, over the heat that it took or gave: the largest of all bodies of parts that conductors join. `None` without a
    /// network.
    pub closure: Option<f64>,
}

/// Absorbed heat of each run of nodes [W] from the flux that its nodes absorb [W/m2]. Twin: `glsl/absorbed_heat.comp`.
pub(crate) fn absorbed_heat(tables: &HeatTables, flux: impl Fn(usize) -> f64 + Sync) -> Vec<f64> {
    let of = |run: &HeatRun| slots(run).map(|slot| tables.areas[slot] * flux(slot)).sum();
    tables.runs.par_iter().map(of).collect()
}

fn slots(run: &HeatRun) -> std::ops::Range<usize> {
    GROUP * run.groups.0 as usize..GROUP * run.groups.1 as usize
}

/// The runs of nodes of a scene.
pub(crate) fn heat_tables(prepared: &Prepared) -> HeatTables {
    let nodes = &prepared.nodes;
    let mut runs: Vec<HeatRun> = Vec::new();
    for range in &nodes.ranges {
        for group in range.first_group..range.first_group + range.groups {
            let (part, index) = (nodes.group_part[group], nodes.group_material[group]);
            let material = &prepared.materials[index as usize];
            let of = match material.response {
                Response::Instant => HeatOf::Balance,
                Response::Transition(_) => HeatOf::Target,
                Response::Network => HeatOf::Flux,
                // The heat that it absorbs is not kept.
                Response::Radiative(_) => continue,
                // Another program has kept its heat.
                Response::Given => continue,
            };
            let emission = STEFAN_BOLTZMANN * emissivity_sum(material);
            let group = group as u32;
            match runs.last_mut() {
                Some(run)
                    if (run.of, run.part, run.emission, run.groups.1) == (of, part, emission, group)
                        && group - run.groups.0 < RUN_GROUPS =>
                {
                    run.groups.1 = group + 1;
                }
                _ => runs.push(HeatRun { groups: (group, group + 1), of, emission, part }),
            }
        }
    }
    HeatTables { runs, areas: (0..nodes.areas.len()).map(|slot| prepared.light_area(slot)).collect() }
}

/// The sums of a run under way.
pub struct Account {
    tables: HeatTables,
    /// Length of a step [s].
    step: f64,
    /// Fourth power of the temperature of space [K4].
    space: f64,
    pub(crate) sums: EnergySums,
}

/// The sums of an account. A saved state keeps them.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct EnergySums {
    /// Absorbed and emitted heat of each run [J].
    absorbed: Vec<f64>,
    emitted: Vec<f64>,
    /// Emission of each run at the last step, and at the step before [W].
    last: Vec<f64>,
    before: Vec<f64>,
    /// Steps that were taken.
    steps: u64,
    /// Temperatures of the network's nodes at the start [K].
    start: Vec<f64>,
}

impl Account {
    /// An empty account at time 0 of a run.
    ///
    /// # Errors
    /// A call that fails.
    pub fn open(prepared: &Prepared, engine: &mut dyn Engine) -> Result<Self, EngineError> {
        if let Some(network) = engine.network_mut() {
            network.count_heat();
        }
        Self::of(prepared, engine)
    }

    /// The account of a run that goes on, with the sums that it saved. The engine has its own state again.
    ///
    /// # Errors
    /// A call that fails, or sums of another scene.
    pub(crate) fn again(prepared: &Prepared, engine: &mut dyn Engine, sums: &EnergySums) -> Result<Self, EngineError> {
        let account = Self::of(prepared, engine)?;
        let fresh = &account.sums;
        for (own, list) in [
            (&fresh.absorbed, &sums.absorbed),
            (&fresh.emitted, &sums.emitted),
            (&fresh.last, &sums.last),
            (&fresh.before, &sums.before),
            (&fresh.start, &sums.start),
        ] {
            check_length("sums of energy", list, own.len())?;
        }
        Ok(Self { sums: sums.clone(), ..account })
    }

    fn of(prepared: &Prepared, engine: &mut dyn Engine) -> Result<Self, EngineError> {
        let tables = heat_tables(prepared);
        let nothing = vec![0.0; tables.runs.len()];
        Ok(Self {
            step: prepared.scene.time.step,
            space: prepared.scene.environment.background_temperature.unwrap_or(0.0).powi(4),
            sums: EnergySums {
                absorbed: nothing.clone(),
                emitted: nothing.clone(),
                last: nothing.clone(),
                before: nothing,
                steps: 0,
                start: engine.network_temperatures()?.unwrap_or_default(),
            },
            tables,
        })
    }

    /// Takes the temperatures after a step [K], and the heat that each run absorbed in it [W]. The first call has none.
    pub fn take(&mut self, temperatures: &[f32], absorbed: Option<&[f64]>) {
        let (tables, space) = (&self.tables, self.space);
        let of = |run: &HeatRun| {
            let fourth = |slot: usize| f64::from(temperatures[slot]).powi(4) - space;
            run.emission * slots(run).map(|slot| tables.areas[slot] * fourth(slot)).sum::<f64>()
        };
        let now: Vec<f64> = tables.runs.par_iter().map(of).collect();
        if let Some(absorbed) = absorbed {
            for (number, run) in tables.runs.iter().enumerate() {
                let [now, last, before] = [now[number], self.sums.last[number], self.sums.before[number]];
                let emitted = match (run.of, self.sums.steps) {
                    // What is in balance emits what it absorbs, in every part of a step.
                    (HeatOf::Balance, _) => absorbed[number],
                    (_, 0) => 0.5 * (now + last),
                    // Adams-Moulton: Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, III.1.
                    _ => (5.0 * now + 8.0 * last - before) / 12.0,
                };
                self.sums.absorbed[number] += self.step * absorbed[number];
                self.sums.emitted[number] += self.step * emitted;
            }
            self.sums.steps += 1;
        }
        self.sums.before = std::mem::replace(&mut self.sums.last, now);
    }

    /// The balance at a time [s].
    ///
    /// # Errors
    /// A call that fails.
    pub fn close(&self, prepared: &Prepared, engine: &mut dyn Engine, time: f64) -> Result<EnergyBalance, EngineError> {
        let name = |part: &String| PartEnergy { part: part.clone(), ..PartEnergy::default() };
        let mut parts: Vec<PartEnergy> = prepared.parts.iter().map(name).collect();
        for (run, (absorbed, emitted)) in self.tables.runs.iter().zip(self.sums.absorbed.iter().zip(&self.sums.emitted))
        {
            let part = &mut parts[run.part as usize];
            part.absorbed_j += absorbed;
            part.emitted_j += emitted;
            if run.of != HeatOf::Flux {
                part.unstored_j += absorbed - emitted;
            }
        }
        let mut closure = None;
        if let Some(network) = &prepared.network {
            let end = engine.network_temperatures()?.unwrap_or_default();
            let given = engine.network().map(|network| network.given(time)).unwrap_or_default();
            let part_of_node = network.parts(&prepared.nodes);
            for (node, part) in part_of_node.iter().enumerate() {
                let change = end.get(node).zip(self.sums.start.get(node)).map_or(0.0, |(end, start)| end - start);
                parts[*part as usize].stored_j += network.network().capacitances[node] * change;
            }
            for (number, joules) in given.iter().enumerate() {
                for (node, share) in network.heated_nodes(number) {
                    parts[part_of_node[*node as usize] as usize].heated_j += share * joules;
                }
            }
            closure = Some(conducted(&mut parts, &network.bodies(&part_of_node, prepared.parts.len())));
        }
        let mut all = PartEnergy { part: "all".to_owned(), ..PartEnergy::default() };
        for part in &parts {
            all.absorbed_j += part.absorbed_j;
            all.emitted_j += part.emitted_j;
            all.heated_j += part.heated_j;
            all.stored_j += part.stored_j;
            all.received_j += part.received_j;
            all.unstored_j += part.unstored_j;
        }
        let mut has_account = vec![false; parts.len()];
        self.tables.runs.iter().for_each(|run| has_account[run.part as usize] = true);
        let parts: Vec<_> = parts.into_iter().zip(&has_account).filter_map(|(part, has)| has.then_some(part)).collect();
        Ok(EnergyBalance { all, parts_left_out: has_account.len() - parts.len(), parts, closure })
    }
}

/// Finds the heat that parts received from each other. `bodies` has for each part the number of its body: parts that conductors join. Returns the
/// largest rest of a body over the heat that it took or gave.
fn conducted(parts: &mut [PartEnergy], bodies: &[usize]) -> f64 {
    let mut sums = vec![[0.0, 0.0]; parts.len()];
    let mut members = vec![0; parts.len()];
    bodies.iter().for_each(|body| members[*body] += 1);
    for (part, body) in parts.iter_mut().zip(bodies) {
        let missing = part.emitted_j + part.stored_j + part.unstored_j - part.absorbed_j - part.heated_j;
        if members[*body] > 1 {
            part.received_j = missing;
        }
        let [rest, moved] = &mut sums[*body];
        *rest += missing;
        *moved += (part.absorbed_j + part.heated_j).abs().max(part.emitted_j.abs());
    }
    let share = |[rest, moved]: &[f64; 2]| if *moved > 0.0 { rest.abs() / moved } else { 0.0 };
    sums.iter().map(share).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn part(absorbed: f64, emitted: f64, stored: f64) -> PartEnergy {
        PartEnergy { absorbed_j: absorbed, emitted_j: emitted, stored_j: stored, ..PartEnergy::default() }
    }

    #[test]
    fn what_a_part_receives_another_one_gives() {
        // Two parts in contact, and one by itself.
        let mut parts = [part(100.0, 60.0, 10.0), part(0.0, 25.0, 5.0), part(50.0, 49.0, 1.0)];
        let closure = conducted(&mut parts, &[0, 0, 2]);
        assert_eq!(parts.each_ref().map(|part| part.received_j), [-30.0, 30.0, 0.0]);
        assert_eq!(closure, 0.0);
        // A joule that a part by itself lost is seen there.
        parts[2].stored_j = 0.0;
        assert!((conducted(&mut parts, &[0, 0, 2]) - 0.02).abs() < 1e-15);
    }
}
