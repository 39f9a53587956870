//! Measures networks by number of nodes: the cost of a stage on a device, and the number up to which the processor in f64 is faster.

use std::sync::Arc;
use std::time::Instant;

use isotherm::internals::{
    Context, ESTIMATE_FLOOR, FLOOR, HeatTable, IntegrationSettings, Integrator, LinearConductor, Network,
    NetworkStepper, NodeKind, RadiativeConductor, ReferenceStepper, Schedule, Series, StepMethod, Stepper, integrate,
    stable_product,
};

use super::AnyError;

/// Stages of the measured sub-step.
const STAGES: u32 = 15;
/// Rounds of a measurement, because other programs may run meanwhile.
const ROUNDS: usize = 9;

/// Prints nodes, time to build, and time of a node and stage of RKL2.
pub fn measure(context: &Arc<Context>, nodes: &[usize]) -> Result<(), AnyError> {
    println!(
        "Network of a square shell, a dispatch a stage, RKL2 with {STAGES} stages: least and median of {ROUNDS} rounds\n"
    );
    println!(
        "| nodes | conductors | on the host and upload [s] | stages a round | round [ms] | ns a node and stage | ns of processor |"
    );
    println!("|---|---|---|---|---|---|---|");
    for &count in nodes {
        let network = shell((count as f64).sqrt().round() as usize);
        let began = Instant::now();
        let mut stepper = NetworkStepper::new(context, &network, &[])?;
        let built = began.elapsed().as_secs_f64();
        let power: Vec<f64> = (0..network.len()).map(|node| 0.02 + 0.01 * (node as f64 * 0.001).sin()).collect();
        stepper.set_heat(&power, &vec![0.0; network.len()])?;
        let step = 0.9 * stable_product(STAGES) / network.fastest_rate(&network.temperatures);
        // At least 0.1 s a round, so that the submission costs as little as in normal use.
        let sub_steps = (2_000_000 / network.len()).clamp(2, 64) as u32;
        let (mut rounds, mut busy) = (Vec::new(), Vec::new());
        // The first round compiles pipelines.
        for round in 0..=ROUNDS {
            let (began, before) = (Instant::now(), processor_seconds());
            stepper.attempt(StepMethod::Rkl2 { stages: STAGES }, 0.0, step, sub_steps)?;
            if round > 0 {
                rounds.push(began.elapsed().as_secs_f64());
                busy.push(processor_seconds() - before);
            }
        }
        rounds.sort_by(f64::total_cmp);
        busy.sort_by(f64::total_cmp);
        let stages = STAGES * sub_steps;
        let each = |seconds: f64| seconds * 1e9 / (network.len() as f64 * f64::from(stages));
        let (least, median) = (rounds[0], rounds[ROUNDS / 2]);
        println!(
            "| {} | {} | {built:.2} | {stages} | {:.1}, {:.1} | {:.2}, {:.2} | {:.2} |",
            network.len(),
            network.linear.len(),
            least * 1e3,
            median * 1e3,
            each(least),
            each(median),
            each(busy[ROUNDS / 2])
        );
    }
    println!();
    Ok(())
}

/// Length of an integration [s], and the times at which the heat of every node changes.
const DURATION: f64 = 300.0;
const CHANGES: [f64; 2] = [75.0, 175.0];

/// Prints the time of a whole integration on the processor in f64 and on the device, by number of nodes.
pub fn compare(context: &Arc<Context>, nodes: &[usize]) -> Result<(), AnyError> {
    println!(
        "Networks over {DURATION} s on the processor (f64) and on the device (f32), with the building of the stepper\n"
    );
    println!(
        "| network | nodes | integrator | processor [ms] | device [ms] | device over processor | stages | iterations |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    for &count in nodes {
        for (kind, network) in kinds(count) {
            for integrator in [Integrator::Default, Integrator::Accurate] {
                let schedule = schedule(&network);
                let began = Instant::now();
                let mut stepper = ReferenceStepper::new(network.clone(), &[]);
                let settings = |floor| IntegrationSettings { floor, ..IntegrationSettings::of(integrator) };
                let done = |ended: Result<Series, String>| ended.map_err(AnyError::from);
                let series = integrate(&mut stepper, &network, &schedule, &settings(FLOOR), |_| true);
                let on_processor = done(series.map_err(|error| format!("{error:?}")))?;
                let processor = began.elapsed().as_secs_f64();
                let began = Instant::now();
                let mut stepper = NetworkStepper::new(context, &network, &[])?;
                let series = integrate(&mut stepper, &network, &schedule, &settings(ESTIMATE_FLOOR), |_| true);
                done(series.map_err(|error| format!("{error:?}")))?;
                let device = began.elapsed().as_secs_f64();
                println!(
                    "| {kind} | {} | {integrator} | {:.2} | {:.1} | {:.2} | {} | {} |",
                    network.len(),
                    processor * 1e3,
                    device * 1e3,
                    device / processor,
                    on_processor.counts.stages,
                    on_processor.counts.iterations
                );
            }
        }
    }
    println!();
    Ok(())
}

/// A square sheet, the same under a blanket without capacitance, and the same with every second row without capacitance.
fn kinds(count: usize) -> [(&'static str, Network); 3] {
    let side = (count as f64).sqrt().round().max(2.0) as usize;
    let sheet = shell(side);
    let half = shell(((0.5 * count as f64).sqrt().round().max(2.0)) as usize);
    let mut blanket = half.clone();
    for node in 0..half.len() {
        blanket.kinds.push(NodeKind::Arithmetic);
        blanket.capacitances.push(0.0);
        blanket.emissive_areas.push(0.8e-4);
        blanket.temperatures.push(290.0);
        blanket.emissive_areas[node] = 0.0;
        let nodes = [node as u32, (half.len() + node) as u32];
        blanket.radiative.push(RadiativeConductor { nodes, exchange_area: 0.02e-4 });
    }
    let mut rows = sheet.clone();
    for node in (0..sheet.len()).filter(|node| (node / side) % 2 == 1) {
        rows.kinds[node] = NodeKind::Arithmetic;
        rows.capacitances[node] = 0.0;
    }
    [("sheet", sheet), ("blanket, lone massless nodes", blanket), ("sheet, coupled massless rows", rows)]
}

/// A heat that differs from node to node and jumps.
fn schedule(network: &Network) -> Schedule {
    let table = |node: usize| {
        let (low, high) = (0.01, 0.05 + 0.01 * (node as f64 * 0.1).sin());
        let [on, off] = CHANGES;
        HeatTable { times: vec![on, on, off, off], powers: vec![low, high, high, low] }
    };
    let heat = (0..network.len()).map(|node| (node as u32, table(node))).collect();
    Schedule { heat, times: vec![DURATION], ..Schedule::default() }
}

/// Processor time of this program [s], which does not depend on other programs (proc(5), `/proc/self/stat`: fields 14
/// and 15, in units of 1/100 s). NaN if there is no such file.
pub(super) fn processor_seconds() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields: Vec<f64> = stat.rsplit(')').next().unwrap_or_default().split(' ').flat_map(str::parse).collect();
    // The state, the third field, is not a number.
    fields.get(10).zip(fields.get(11)).map_or(f64::NAN, |(user, system)| (user + system) / 100.0)
}

/// A sheet of aluminium, 1 mm thick, of `side` x `side` cells of 1 cm. It radiates on one side.
fn shell(side: usize) -> Network {
    // Aluminium 6061: 2700 kg/m3, 896 J/kg/K, 167 W/m/K (ECSS-E-HB-31-01 Part 5A); between square cells GL = k x thickness.
    let capacitance = 2700.0 * 896.0 * 1e-3 * 1e-4;
    let at = |x: usize, y: usize| (y * side + x) as u32;
    let mut linear = Vec::new();
    for y in 0..side {
        for x in 0..side {
            if x + 1 < side {
                linear.push(LinearConductor { nodes: [at(x, y), at(x + 1, y)], conductance: 0.167 });
            }
            if y + 1 < side {
                linear.push(LinearConductor { nodes: [at(x, y), at(x, y + 1)], conductance: 0.167 });
            }
        }
    }
    let size = side * side;
    Network {
        space_temperature: 2.7,
        kinds: vec![NodeKind::Diffusive; size],
        capacitances: vec![capacitance; size],
        emissive_areas: vec![0.8e-4; size],
        temperatures: (0..size).map(|node| 290.0 + 5.0 * (node as f64 * 0.01).sin()).collect(),
        linear,
        radiative: Vec::new(),
    }
}
