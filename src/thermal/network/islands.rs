//! Islands of a network: nodes that exchange heat with each other and with no others. Islands that are about as fast take sub-steps together, so that few fast
//! nodes do not cut the sub-steps of all.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::connection::root;
use super::control::{ControlError, IntegrationSettings, Leg, MethodUse, Series, Switch, integrate_leg};
use super::reference::ReferenceStepper;
use super::schedule::{Schedule, Thermostat};
use super::{LinearConductor, Network, RadiativeConductor};

/// Largest ratio of the rates of islands that take sub-steps together.
const RATIO: f64 = 2.0;
/// Temperature at which islands are compared [K].
const WARM: f64 = 300.0;

/// Islands that are about as fast.
struct IslandSet {
    /// Their nodes in the whole network, and their thermostats in its schedules.
    nodes: Vec<u32>,
    thermostats: Vec<usize>,
    network: Network,
    stepper: ReferenceStepper,
}

/// A network in sets of islands.
pub(crate) struct Islands {
    sets: Vec<IslandSet>,
    /// Number of each node in its set.
    places: Vec<u32>,
}

impl Islands {
    /// The islands of a network whose thermostats each tie a sensor and heated nodes together.
    pub(crate) fn new(network: &Network, tied: &[(u32, &[(u32, f64)])]) -> Self {
        let mut parent: Vec<u32> = (0..network.len() as u32).collect();
        let heated = tied.iter().flat_map(|(sensor, shares)| shares.iter().map(|(node, _)| [*sensor, *node]));
        let conductors = network.linear.iter().map(|linear| linear.nodes);
        for pair in conductors.chain(network.radiative.iter().map(|radiative| radiative.nodes)).chain(heated) {
            let [a, b] = pair.map(|node| root(&mut parent, node));
            parent[b as usize] = a;
        }
        let roots: Vec<usize> = (0..parent.len() as u32).map(|node| root(&mut parent, node) as usize).collect();
        let mut fastest = vec![0.0f64; roots.len()];
        for (root, rate) in roots.iter().zip(network.rates(&vec![WARM; roots.len()])) {
            fastest[*root] = fastest[*root].max(rate);
        }
        let mut sets: BTreeMap<i32, Vec<u32>> = BTreeMap::new();
        for (node, root) in (0..).zip(&roots) {
            sets.entry((fastest[*root].ln() / RATIO.ln()).floor() as i32).or_default().push(node);
        }
        let mut places = vec![0; roots.len()];
        for nodes in sets.values() {
            (0..).zip(nodes).for_each(|(place, node)| places[*node as usize] = place);
        }
        let sets = sets.into_values().map(|nodes| IslandSet::new(network, nodes, &places, tied)).collect();
        Self { sets, places }
    }

    /// Integrates the one leg of a schedule. The sets begin with these sub-steps [s], which become those of the next leg.
    ///
    /// # Errors
    /// As for [`integrate_leg`].
    pub(crate) fn integrate(
        &mut self,
        schedule: &Schedule,
        settings: &IntegrationSettings,
        horizon: f64,
        steps: &mut Vec<f64>,
    ) -> Result<Series, ControlError> {
        steps.resize(self.sets.len(), f64::INFINITY);
        let places = &self.places;
        let one = |(set, step): (&mut IslandSet, &mut f64)| {
            let own = set.schedule(schedule, places);
            let leg = Leg { horizon, step: *step, tight_switches: false };
            let (series, ended) = integrate_leg(&mut set.stepper, &set.network, &own, settings, leg, |_| true);
            *step = series.first_step.unwrap_or(series.step);
            ended.map(|()| series).map_err(|error| set.named(error))
        };
        let all: Result<Vec<Series>, ControlError> = self.sets.par_iter_mut().zip(steps).map(one).collect();
        let on = schedule.thermostats.iter().map(|thermostat| thermostat.initially_on).collect();
        let mut sum = Series { on, ..Series::default() };
        for (set, series) in self.sets.iter().zip(all?) {
            set.thermostats.iter().zip(series.on).for_each(|(number, on)| sum.on[*number] = on);
            let switched = series.switches.into_iter();
            sum.switches
                .extend(switched.map(|switch| Switch { thermostat: set.thermostats[switch.thermostat], ..switch }));
            sum.rejected += series.rejected;
            sum.uses = MethodUse::sums(sum.uses, series.uses);
        }
        sum.switches.sort_by(|a, b| a.time.total_cmp(&b.time));
        Ok(sum)
    }

    /// Temperatures of all nodes [K].
    pub(crate) fn temperatures(&self) -> Vec<f64> {
        let mut all = vec![0.0; self.places.len()];
        for set in &self.sets {
            set.nodes.iter().zip(set.stepper.temperatures()).for_each(|(node, kelvin)| all[*node as usize] = kelvin);
        }
        all
    }

    /// Replaces the temperatures of all nodes [K].
    pub(crate) fn set_temperatures(&mut self, all: &[f64]) {
        for set in &mut self.sets {
            let own: Vec<f64> = set.nodes.iter().map(|node| all[*node as usize]).collect();
            set.stepper.set_temperatures(&own);
        }
    }
}

impl IslandSet {
    fn new(whole: &Network, nodes: Vec<u32>, places: &[u32], tied: &[(u32, &[(u32, f64)])]) -> Self {
        let is_own = |node: u32| nodes.binary_search(&node).is_ok();
        let placed = |pair: [u32; 2]| pair.map(|node| places[node as usize]);
        let linear = whole.linear.iter().filter(|linear| is_own(linear.nodes[0]));
        let radiative = whole.radiative.iter().filter(|radiative| is_own(radiative.nodes[0]));
        let own = |values: &[f64]| -> Vec<f64> { nodes.iter().map(|node| values[*node as usize]).collect() };
        let network = Network {
            space_temperature: whole.space_temperature,
            kinds: nodes.iter().map(|node| whole.kinds[*node as usize]).collect(),
            capacitances: own(&whole.capacitances),
            emissive_areas: own(&whole.emissive_areas),
            temperatures: own(&whole.temperatures),
            linear: linear.map(|linear| LinearConductor { nodes: placed(linear.nodes), ..*linear }).collect(),
            radiative: radiative.map(|one| RadiativeConductor { nodes: placed(one.nodes), ..*one }).collect(),
        };
        let thermostats: Vec<usize> = (0..tied.len()).filter(|number| is_own(tied[*number].0)).collect();
        let sensors: Vec<u32> = thermostats.iter().map(|number| places[tied[*number].0 as usize]).collect();
        let stepper = ReferenceStepper::new(network.clone(), &sensors);
        Self { nodes, thermostats, network, stepper }
    }

    /// The part of a schedule that belongs to the set.
    fn schedule(&self, whole: &Schedule, places: &[u32]) -> Schedule {
        let place = |node: u32| places[node as usize];
        let thermostat = |number: &usize| {
            let one = &whole.thermostats[*number];
            Thermostat { node: place(one.node), sensor: place(one.sensor), ..one.clone() }
        };
        let spread =
            |number: &usize| whole.spread[*number].iter().map(|(node, share)| (place(*node), *share)).collect();
        let heat = whole.heat.iter().filter(|(node, _)| self.nodes.binary_search(node).is_ok());
        Schedule {
            constant: self.nodes.iter().map(|node| whole.constant[*node as usize]).collect(),
            heat: heat.map(|(node, table)| (place(*node), table.clone())).collect(),
            thermostats: self.thermostats.iter().map(thermostat).collect(),
            spread: self.thermostats.iter().map(spread).collect(),
            times: whole.times.clone(),
        }
    }

    /// An error with the numbers of the whole network.
    fn named(&self, error: ControlError) -> ControlError {
        let node_of = |node: usize| self.nodes[node] as usize;
        match error {
            ControlError::Unbalanced { time, node } => ControlError::Unbalanced { time, node: node_of(node) },
            ControlError::NoStep { time, node, temperature } => {
                ControlError::NoStep { time, node: node_of(node), temperature }
            }
            ControlError::Stiff { time, nodes, conductance, rate } => {
                ControlError::Stiff { time, nodes: nodes.map(node_of), conductance, rate }
            }
            ControlError::Chatter { time, thermostat, switches, within } => {
                ControlError::Chatter { time, thermostat: self.thermostats[thermostat], switches, within }
            }
            other => other,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::NodeKind;
    use super::super::control::Integrator;
    use super::*;

    /// Two pairs of nodes, one a hundred times as fast. A thermostat heats the slow one.
    #[test]
    fn islands_end_where_the_whole_network_ends_and_slow_ones_take_fewer_sub_steps() {
        let conductance = [5.0, 0.5];
        let network = Network {
            space_temperature: 3.0,
            kinds: vec![NodeKind::Diffusive; 4],
            capacitances: vec![10.0, 12.0, 1000.0, 900.0],
            emissive_areas: vec![0.1; 4],
            temperatures: vec![250.0, 300.0, 280.0, 290.0],
            linear: (0..2)
                .map(|k| LinearConductor { nodes: [2 * k, 2 * k + 1], conductance: conductance[k as usize] })
                .collect(),
            radiative: Vec::new(),
        };
        let thermostat =
            Thermostat { node: 3, sensor: 2, power: 500.0, on_below: 282.0, off_above: 284.0, initially_on: true };
        let schedule = |on| Schedule {
            constant: vec![20.0, 0.0, 10.0, 5.0],
            thermostats: vec![Thermostat { initially_on: on, ..thermostat.clone() }],
            spread: vec![vec![(3, 1.0)]],
            times: vec![15.0],
            ..Schedule::default()
        };
        let settings = IntegrationSettings::of(Integrator::Default);
        let mut islands = Islands::new(&network, &[(2, &[(3, 1.0)])]);
        assert_eq!(islands.sets.len(), 2);
        let mut whole = ReferenceStepper::new(network.clone(), &[2]);
        let (mut steps, mut step, mut ons, mut used) = (Vec::new(), f64::INFINITY, [true; 2], [0, 0]);
        let mut switches = 0;
        for _ in 0..60 {
            let sums = islands.integrate(&schedule(ons[0]), &settings, 900.0, &mut steps).expect("sub-steps");
            let leg = Leg { horizon: 900.0, step, tight_switches: false };
            let (series, ended) = integrate_leg(&mut whole, &network, &schedule(ons[1]), &settings, leg, |_| true);
            ended.expect("sub-steps");
            (step, switches) = (series.first_step.unwrap_or(series.step), switches + sums.switches.len());
            let count = |uses: [Option<MethodUse>; 3]| uses.iter().flatten().map(|used| used.sub_steps).sum::<u64>();
            used = [used[0] + count(sums.uses), used[1] + 2 * count(series.uses)];
            ons = [sums.on[0], series.on[0]];
        }
        let ends = islands.temperatures().into_iter().zip(whole.temperatures());
        let off = ends.map(|(own, whole)| (own - whole).abs()).fold(0.0, f64::max);
        println!("{off:e} K, {used:?} sub-steps of sets, {switches} switches");
        assert!(off < settings.tolerance && switches > 0 && 10 * used[0] < 9 * used[1], "{off:e} {used:?} {switches}");
        // The comparison sees a thermostat that is tied to nothing.
        islands.set_temperatures(&[250.0, 300.0, 280.0, 290.0]);
        islands
            .integrate(&Schedule { constant: vec![0.0; 4], ..schedule(false) }, &settings, 900.0, &mut steps)
            .expect("sub-steps");
        assert!((islands.temperatures()[0] - whole.temperatures()[0]).abs() > 1.0);
    }
}
