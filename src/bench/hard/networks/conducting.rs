//! Hard cases of conduction: extreme capacitances and conductances, slivers, and a chain without capacitance.

use super::{Built, DEFAULT, FRAME, rows_apart};
use crate::bench::hard::case::{CaseScale, HardCase, apart, worst_of};
use crate::bench::hard::exact::Modes;
use crate::bench::hard::plain::{self, PlainStep};
use crate::bench::hard::way::integrated;
use crate::simulation::network::unfinished;
use crate::simulation::target::Target;
use crate::thermal::network::control::Integrator;
use crate::thermal::network::schedule::Schedule;
use crate::thermal::network::{Network, NodeKind};

/// A network under constant heat, with its exact temperatures at given times.
struct ConductionProblem {
    network: Network,
    heat: Vec<f64>,
    times: Vec<f64>,
    expected: Vec<Vec<f64>>,
}

impl ConductionProblem {
    /// A conducting network with its closed-form solution.
    fn of_modes(network: Network, heat: Vec<f64>, times: Vec<f64>) -> Self {
        let expected = match Modes::of(&network, &heat) {
            Some(modes) => times.iter().map(|time| modes.at(*time)).collect(),
            None => Vec::new(),
        };
        Self { network, heat, times, expected }
    }

    fn error(&self, integrator: Integrator) -> Result<f64, String> {
        let schedule = Schedule { constant: self.heat.clone(), times: self.times.clone(), ..Schedule::default() };
        let series = integrated(&self.network, &schedule, integrator).map_err(|error| unfinished(&error))?;
        Ok(rows_apart(&series.rows, &self.expected))
    }

    /// Largest error of equal plain steps, at times that are multiples of the step.
    fn plain(&self, step: f64, kind: PlainStep) -> f64 {
        let last = self.times.last().copied().unwrap_or(0.0);
        let rows = plain::steps(&self.network, &self.heat, step, (last / step).round() as u32, kind);
        let sampled = self.times.iter().zip(&self.expected).filter_map(|(time, expected)| {
            let number = (time / step).round();
            let whole = number >= 1.0 && (number * step - time).abs() < 1e-9 * time;
            whole.then(|| rows.get(number as usize - 1).map(|row| apart(row, expected))).flatten()
        });
        sampled.fold(0.0, worst_of)
    }
}

fn conducting(
    case: HardCase,
    problem: fn(CaseScale) -> ConductionProblem,
    without: fn(&ConductionProblem) -> f64,
) -> HardCase {
    let error = move |_: &Target, scale| {
        let problem = problem(scale);
        problem.error(Integrator::Default)
    };
    case.measured(error, move |scale| without(&problem(scale)))
}

/// A heated node of 0.1 J/K next to one of 100 kJ/K.
fn capacitance_ratio(_: CaseScale) -> ConductionProblem {
    let mut built = Built::default();
    let small = built.store(0.1, 350.0);
    let large = built.store(1e5, 250.0);
    built.join(small, large, 1.0);
    ConductionProblem::of_modes(built.0, vec![10.0, 0.0], vec![0.02, 0.1, 0.5, 1.0, 10.0, 100.0, 1000.0, 10_000.0])
}

/// A chain with alternating conductances of 1 mW/K and 1 kW/K.
fn conductance_ratio(_: CaseScale) -> ConductionProblem {
    let mut built = Built::default();
    let nodes: Vec<u32> = [10.0, 300.0, 50.0, 1000.0, 20.0, 400.0]
        .iter()
        .zip([320.0, 250.0, 300.0, 270.0, 340.0, 260.0])
        .map(|(capacitance, temperature)| built.store(*capacitance, temperature))
        .collect();
    for (pair, conductance) in nodes.windows(2).zip([1e3, 1e-3, 1.0, 1e3, 1e-3]) {
        built.join(pair[0], pair[1], conductance);
    }
    let heat = vec![0.0, 0.5, 0.0, 2.0, 0.0, 0.0];
    ConductionProblem::of_modes(built.0, heat, (1..=20).map(|row| FRAME * f64::from(row)).collect())
}

/// The error if every conductance is limited to the greatest value with which forward Euler is stable in one frame.
fn capped(problem: &ConductionProblem) -> f64 {
    let mut network = problem.network.clone();
    for conductor in &mut network.linear {
        let least = conductor.nodes.map(|node| problem.network.capacitances[node as usize]);
        conductor.conductance = conductor.conductance.min(0.25 * least[0].min(least[1]) / FRAME);
    }
    let capped =
        ConductionProblem { network, heat: problem.heat.clone(), times: problem.times.clone(), expected: vec![] };
    let modes = Modes::of(&capped.network, &capped.heat);
    let rows = modes.map(|modes| capped.times.iter().map(|time| modes.at(*time)).collect::<Vec<_>>());
    rows.map_or(f64::INFINITY, |rows| rows_apart(&rows, &problem.expected))
}

/// A heated aluminium sheet, 1 mm thick with cells of 1 cm. Every fifth column is a sliver of 0.1 mm.
fn slivers(scale: CaseScale) -> ConductionProblem {
    let side = scale.of(6, 8, 10);
    let width = |x: usize| if x % 5 == 3 { 0.01 } else { 1.0 };
    let at = |x: usize, y: usize| (y * side + x) as u32;
    let mut built = Built::default();
    let mut heat = Vec::new();
    for y in 0..side {
        for x in 0..side {
            // 2700 kg/m3, 896 J/kg/K and 167 W/m/K are from ECSS-E-HB-31-01 Part 5A.
            built.store(2700.0 * 896.0 * 1e-3 * 1e-4 * width(x), 290.0 + 5.0 * ((7 * x + 3 * y) as f64).sin());
            let spot = (x as f64 - 3.0).powi(2) + (y as f64 - 2.0).powi(2);
            heat.push(0.04 * width(x) * (-0.5 * spot).exp());
        }
    }
    for y in 0..side {
        for x in 0..side {
            if x + 1 < side {
                built.join(at(x, y), at(x + 1, y), 0.167 * 2.0 / (width(x) + width(x + 1)));
            }
            if y + 1 < side {
                built.join(at(x, y), at(x, y + 1), 0.167 * width(x));
            }
        }
    }
    ConductionProblem::of_modes(built.0, heat, (1..=8).map(|row| FRAME * f64::from(row)).collect())
}

/// Two bodies joined by a chain of five nodes without capacitance. The second and the fourth are heated.
fn chain(_: CaseScale) -> ConductionProblem {
    const LINKS: usize = 6;
    const LINK: f64 = 3.0;
    let mut built = Built::default();
    let hot = built.store(300.0, 330.0);
    let nodes: Vec<u32> = (1..LINKS).map(|_| built.node(NodeKind::Arithmetic, 0.0, 0.0, 300.0)).collect();
    let cold = built.store(100.0, 250.0);
    let whole: Vec<u32> = std::iter::once(hot).chain(nodes).chain([cold]).collect();
    whole.windows(2).for_each(|pair| built.join(pair[0], pair[1], LINK));
    let heat = vec![0.0, 0.0, 20.0, 0.0, 10.0, 0.0, 0.0];
    let times: Vec<f64> = (1..=20).map(|row| FRAME * f64::from(row)).collect();
    // For the bodies the chain is one conductance. Heat into the chain divides by the number of links to either end.
    let mut bodies = Built::default();
    let ends = [bodies.store(300.0, 330.0), bodies.store(100.0, 250.0)];
    bodies.join(ends[0], ends[1], LINK / LINKS as f64);
    let to_cold = |node: usize| heat[node] * node as f64 / LINKS as f64;
    let cold_share: f64 = (0..=LINKS).map(to_cold).sum();
    let share = [heat.iter().sum::<f64>() - cold_share, cold_share];
    let modes = Modes::of(&bodies.0, &share);
    let row = |time: &f64| {
        let [hot, cold] = modes.as_ref().map(|modes| modes.at(*time)).and_then(|ends| ends.try_into().ok())?;
        let inside = |node: usize| {
            let along = node as f64 / LINKS as f64;
            // Green's function of a chain with fixed ends.
            let raised: f64 = (0..=LINKS)
                .map(|source| {
                    let (near, far) = (source.min(node) as f64, source.max(node) as f64);
                    heat[source] * near * (LINKS as f64 - far) / (LINKS as f64 * LINK)
                })
                .sum();
            hot + (cold - hot) * along + raised
        };
        Some((0..=LINKS).map(inside).collect::<Vec<f64>>())
    };
    let expected: Option<Vec<Vec<f64>>> = times.iter().map(row).collect();
    ConductionProblem { network: built.0, heat, times, expected: expected.unwrap_or_default() }
}

pub(crate) fn cases() -> Vec<HardCase> {
    let case = |name: &str, what: &str| HardCase::new(name, what, "K", DEFAULT);
    vec![
        conducting(
            case(
                "C ratio of 1e6",
                "0.1 J/K under 10 W joined by 1 W/K to 100 kJ/K, for 10,000 s; sums of exponentials",
            )
            .remedy(
                "the method follows the stiffness: stages of RKL2, or TR-BDF2",
                "Euler with steps of 1 s, which overflows",
            ),
            capacitance_ratio,
            |problem| problem.plain(1.0, PlainStep::Euler),
        ),
        conducting(
            case("GL ratio of 1e6", "a chain of six nodes joined by 1 mW/K to 1 kW/K; sums of exponentials").remedy(
                "the method follows the stiffness: stages of RKL2, or TR-BDF2",
                "conductances capped so that Euler takes a frame",
            ),
            conductance_ratio,
            capped,
        ),
        conducting(
            case(
                "slivers",
                "a 1 mm sheet of cells of 1 cm and slivers of 0.1 mm under a spot of heat; sums of exponentials",
            )
            .remedy(
                "all nodes step together: stages of RKL2, or TR-BDF2 with conjugate gradients",
                "an exponential for each node by itself",
            ),
            slivers,
            |problem| problem.plain(FRAME, PlainStep::Exponential),
        ),
        conducting(
            case("arithmetic chain", "five nodes of C = 0 between two bodies, two of them heated; closed form").remedy(
                "coupled nodes are solved together, to convergence, at every stage, the first included",
                "each balanced once a step of 0.1 s",
            ),
            chain,
            |problem| problem.plain(0.1, PlainStep::OneSweep),
        ),
    ]
}
