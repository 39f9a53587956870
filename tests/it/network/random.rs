//! Random networks of kinds that are difficult for integrators, the same in every run.

use isotherm::internals::{HeatTable, LinearConductor, Network, NodeKind, RadiativeConductor, Schedule, Thermostat};

pub use crate::random::Random;

impl Random {
    /// A number with a uniform logarithm.
    pub fn scale(&mut self, low: f64, high: f64) -> f64 {
        self.between(low.ln(), high.ln()).exp()
    }

    pub fn chance(&mut self, share: f64) -> bool {
        self.unit() < share
    }

    pub fn below(&mut self, end: usize) -> usize {
        ((self.unit() * end as f64) as usize).min(end - 1)
    }
}

/// A network, its schedule, and a description of its difficulty.
pub struct Case {
    pub name: String,
    pub network: Network,
    pub schedule: Schedule,
}

/// The case of a seed, with at most `most` nodes.
pub fn case(seed: u64, most: usize) -> Case {
    let mut random = Random(seed.wrapping_mul(0x1234_5678_9abc_def1) ^ 77);
    let size = random.scale(1.0, most as f64 + 0.99) as usize;
    let with_thermostats = random.chance(0.4);
    let with_arithmetic = size > 2 && random.chance(0.5);
    let with_slivers = size > 1 && random.chance(0.3);
    let with_boundary = size > 1 && random.chance(0.4);
    let duration = if with_thermostats { random.scale(600.0, 2e4) } else { random.scale(300.0, 2e6) };
    let mut network = Network { space_temperature: random.between(0.0, 5.0), ..Network::default() };
    let level = random.between(200.0, 350.0);
    for node in 0..size {
        let kind = match node {
            0 => NodeKind::Diffusive,
            _ if with_boundary && node == size - 1 => NodeKind::Boundary,
            _ if with_arithmetic && random.chance(0.4) => NodeKind::Arithmetic,
            _ => NodeKind::Diffusive,
        };
        let small = with_slivers && node > 0 && random.chance(0.3);
        let capacitance = if small { random.scale(1e-6, 1e-2) } else { random.scale(20.0, 5000.0) };
        network.kinds.push(kind);
        network.capacitances.push(if kind == NodeKind::Diffusive { capacitance } else { 0.0 });
        let emits = random.chance(0.5) || node == 0;
        network.emissive_areas.push(if emits { random.scale(1e-3, 0.3) } else { 0.0 });
        network.temperatures.push(level + random.between(-50.0, 50.0));
        // A tree gives every node a neighbour. It is a chain if the neighbour is the previous node.
        if node > 0 {
            let other = if random.chance(0.6) { node - 1 } else { random.below(node) };
            let nodes = [node as u32, other as u32];
            let sliver = kind == NodeKind::Diffusive && small;
            if sliver || random.chance(0.7) {
                let conductance = if sliver { random.scale(1.0, 1e3) } else { random.scale(0.01, 10.0) };
                network.linear.push(LinearConductor { nodes, conductance });
            } else {
                network.radiative.push(RadiativeConductor { nodes, exchange_area: random.scale(1e-3, 0.3) });
            }
        }
    }
    for _ in 0..size / 2 {
        let (a, b) = (random.below(size), random.below(size));
        if a != b {
            let nodes = [a as u32, b as u32];
            if random.chance(0.5) {
                network.linear.push(LinearConductor { nodes, conductance: random.scale(0.01, 3.0) });
            } else {
                network.radiative.push(RadiativeConductor { nodes, exchange_area: random.scale(1e-4, 0.1) });
            }
        }
    }
    let heat = heat(&network, duration, &mut random);
    let thermostats = if with_thermostats { thermostats(&network, &mut random) } else { Vec::new() };
    let count = 2 + random.below(10);
    let mut times: Vec<f64> = (0..count).map(|_| random.between(0.0, duration)).collect();
    times.extend([0.0, duration]);
    // Some outputs are exactly at jumps of the heat.
    times.extend(heat.iter().filter_map(|(_, table): &(u32, HeatTable)| table.times.get(1).copied()).take(2));
    times.retain(|time| *time >= 0.0);
    times.sort_by(f64::total_cmp);
    times.dedup();
    let mark = |flag: bool, word: &'static str| if flag { word } else { "" };
    let name = format!(
        "seed {seed}: {size} nodes, {duration:.0} s{}{}{}{}",
        mark(with_arithmetic, ", arithmetic"),
        mark(with_slivers, ", slivers"),
        mark(with_boundary, ", boundary"),
        mark(!thermostats.is_empty(), ", thermostats")
    );
    Case { name, network, schedule: Schedule { heat, thermostats, times, ..Schedule::default() } }
}

fn heat(network: &Network, duration: f64, random: &mut Random) -> Vec<(u32, HeatTable)> {
    let mut heat = Vec::new();
    let heated: Vec<u32> = (0..network.len() as u32)
        .filter(|node| {
            network.kinds[*node as usize] == NodeKind::Arithmetic || network.capacitances[*node as usize] > 1.0
        })
        .collect();
    let spot = random.chance(0.4);
    let width = duration / 8.0_f64.max(heated.len() as f64).min(20.0);
    for (place, node) in heated.iter().enumerate() {
        if spot && place < 20 {
            // The hot spot moves from node to node.
            let start = width * place as f64;
            let power = random.scale(1.0, 30.0);
            heat.push((
                *node,
                HeatTable { times: vec![start, start + 0.5 * width, start + width], powers: vec![0.5, power, 0.5] },
            ));
        } else if random.chance(0.5) {
            let power = random.scale(0.1, 50.0);
            heat.push((
                *node,
                match random.below(3) {
                    0 => HeatTable::constant(power),
                    1 => {
                        let [a, b] = [random.between(0.0, 0.5), random.between(0.5, 1.0)].map(|share| share * duration);
                        HeatTable { times: vec![a, a, b, b], powers: vec![0.0, power, power, 0.1 * power] }
                    }
                    _ => {
                        // Switches on and off many times.
                        let period = duration / random.between(2.0, 12.0);
                        let (mut times, mut powers) = (Vec::new(), Vec::new());
                        let mut at = 0.0;
                        while at < duration {
                            times.extend([at, at, at + 0.6 * period, at + 0.6 * period]);
                            powers.extend([0.0, power, power, 0.0]);
                            at += period;
                        }
                        HeatTable { times, powers }
                    }
                },
            ));
        }
    }
    heat
}

fn thermostats(network: &Network, random: &mut Random) -> Vec<Thermostat> {
    let count = 1 + random.below(3);
    let solid: Vec<usize> = (0..network.len()).filter(|node| network.capacitances[*node] > 1.0).collect();
    let light: Vec<usize> = (0..network.len()).filter(|node| network.kinds[*node] == NodeKind::Arithmetic).collect();
    (0..count)
        .map(|_| {
            let node = solid[random.below(solid.len())];
            // Some sensors are arithmetic nodes, and some heaters heat another node.
            let sensor = match random.below(6) {
                0 if !light.is_empty() => light[random.below(light.len())],
                1 => solid[random.below(solid.len())],
                _ => node,
            };
            let on_below = network.temperatures[sensor] - random.between(-3.0, 6.0);
            Thermostat {
                node: node as u32,
                sensor: sensor as u32,
                power: random.scale(5.0, 100.0),
                on_below,
                off_above: on_below + random.between(1.5, 8.0),
                initially_on: random.chance(0.4),
            }
        })
        .collect()
}
