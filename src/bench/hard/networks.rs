//! Hard cases of networks: heat too small for f32, capacitances and conductances of all sizes, thermostats, cold, a day.

use super::exact::{Modes, root_of_falling};
use super::plain::{self, Step};
use super::stepper::{Place, fixed_euler, integrated};
use super::{Case, Scale, apart, worst_of};
use crate::bench::run::Target;
use crate::paper::cube::{self, ALTITUDES, ALUMINIUM, Loads, SOLAR_CONSTANTS};
use crate::simulation::network::unfinished;
use crate::thermal::STEFAN_BOLTZMANN;
use crate::thermal::network::control::{ControlError, Integrator};
use crate::thermal::network::reference::ReferenceStepper;
use crate::thermal::network::schedule::{HeatTable, Schedule};
use crate::thermal::network::stepper::{Method, Stepper};
use crate::thermal::network::{LinearConductor, Network, NodeKind};
use crate::thermal::step_response::Plate;

mod thermostats;

/// Issue 4: the largest error by default, with the accurate option, and of the paper's cube in small steps.
const DEFAULT: (f64, &str) = (20e-3, "issue 4, default");
const ACCURATE: (f64, &str) = (2e-3, "issue 4, accurate");
const SMALL_STEPS: (f64, &str) = (2e-3, "issue 4, the cube at 10 and 100 Hz");

/// A network of nodes that are added one by one.
#[derive(Default)]
struct Built(Network);

impl Built {
    fn node(&mut self, kind: NodeKind, capacitance: f64, area: f64, temperature: f64) -> u32 {
        self.0.kinds.push(kind);
        self.0.capacitances.push(capacitance);
        self.0.emissive_areas.push(area);
        self.0.temperatures.push(temperature);
        self.0.len() as u32 - 1
    }

    fn store(&mut self, capacitance: f64, temperature: f64) -> u32 {
        self.node(NodeKind::Diffusive, capacitance, 0.0, temperature)
    }

    fn join(&mut self, a: u32, b: u32, conductance: f64) {
        self.0.linear.push(LinearConductor { nodes: [a, b], conductance });
    }
}

/// A network under constant heat, the times at which it is looked at, and its temperatures then.
struct Problem {
    network: Network,
    heat: Vec<f64>,
    times: Vec<f64>,
    expected: Vec<Vec<f64>>,
}

impl Problem {
    /// Of a network that only conducts.
    fn of_modes(network: Network, heat: Vec<f64>, times: Vec<f64>) -> Self {
        let expected = match Modes::of(&network, &heat) {
            Some(modes) => times.iter().map(|time| modes.at(*time)).collect(),
            None => Vec::new(),
        };
        Self { network, heat, times, expected }
    }

    fn error(&self, place: Place<'_>, integrator: Integrator) -> Result<f64, String> {
        let schedule = Schedule { constant: self.heat.clone(), times: self.times.clone(), ..Schedule::default() };
        let series = integrated(place, &self.network, &schedule, integrator).map_err(|error| unfinished(&error))?;
        Ok(rows_apart(&series.rows, &self.expected))
    }

    /// Largest error of equal plain steps, at those times that are whole steps.
    fn plain(&self, step: f64, kind: Step) -> f64 {
        let last = self.times.last().copied().unwrap_or(0.0);
        let rows = plain::steps(&self.network, &self.heat, step, (last / step).round() as u32, kind);
        let seen = self.times.iter().zip(&self.expected).filter_map(|(time, expected)| {
            let number = (time / step).round();
            let whole = number >= 1.0 && (number * step - time).abs() < 1e-9 * time;
            whole.then(|| rows.get(number as usize - 1).map(|row| apart(row, expected))).flatten()
        });
        seen.fold(0.0, worst_of)
    }
}

/// Largest difference of two lists of rows.
fn rows_apart(found: &[Vec<f64>], expected: &[Vec<f64>]) -> f64 {
    if found.len() != expected.len() {
        return f64::INFINITY;
    }
    found.iter().zip(expected).fold(0.0, |worst, (a, b)| worst_of(worst, apart(a, b)))
}

/// The paper's cube of aluminium without its radiation: panels that gain 2e-5 to 1.2e-4 K/s and nothing else.
fn slow_heating(rate: u32) -> Case {
    let panels = || {
        let mut built = Built::default();
        (0..6).for_each(|_| {
            built.store(24_300.0, 290.0);
        });
        built.0
    };
    let heat = || (1..=6).map(|panel| 2e-5 * f64::from(panel) * 24_300.0).collect::<Vec<f64>>();
    // A frame of 10 s; steps as long as a tenth, a hundredth, a thousandth of a second.
    let frame = 10.0;
    let frames = move |scale: Scale| match rate {
        10 => scale.of(60, 600, 6_000),
        100 => scale.of(20, 60, 600),
        _ => scale.of(10, 10, 60),
    };
    let expected = |frames: usize| {
        let row = |frame: usize| (1..=6).map(|panel| 290.0 + 2e-5 * f64::from(panel) * 10.0 * frame as f64).collect();
        (1..=frames).map(row).collect::<Vec<Vec<f64>>>()
    };
    let steps = 10 * rate;
    Case {
        name: format!("heating too small for f32 at {rate} Hz"),
        what: format!(
            "six panels of 24,300 J/K at 290 K gain 2e-5 to 1.2e-4 K/s, {:.0e} K a step and less; a straight line",
            1.2e-4 / f64::from(rate)
        ),
        unit: "K",
        limit: SMALL_STEPS.0,
        source: SMALL_STEPS.1.to_owned(),
        remedy: "a temperature is a multiple of 1/256 K and a small rest, which the step is added to",
        removed: "Euler in plain f32",
        expects_reference: false,
        measure: Box::new(move |target, scale| {
            let count = frames(scale);
            let error = |place: Place<'_>, count: usize| {
                let found = fixed_euler(place, &panels(), &mut std::iter::repeat_n(heat(), count), frame, steps)?;
                Ok(rows_apart(&found, &expected(count)))
            };
            // A dispatch for every step takes its time: a minute of it at 10 Hz says what there is to say.
            if rate == 10 {
                return Place::worst(target, |place| error(place, if place.is_wide() { 6 } else { count }));
            }
            error(Place::own(target), count)
        }),
        without: Box::new(move |scale| {
            let count = frames(scale);
            let found = plain::euler_f32(&panels(), &mut std::iter::repeat_n(heat(), count), frame, steps);
            rows_apart(&found, &expected(count))
        }),
    }
}

/// A foil that stores nothing between a boundary and space.
struct Foil;

impl Foil {
    const CONDUCTANCE: f64 = 0.2;
    const AREA: f64 = 0.1;
    const SPACE: f64 = 3.0;
    const BOUNDARY: f64 = 290.0;
    /// A capacitance that stands in for none [J/K].
    const STORE: f64 = 10.0;

    fn network(kind: NodeKind, capacitance: f64) -> Network {
        let mut built = Built(Network { space_temperature: Self::SPACE, ..Network::default() });
        let foil = built.node(kind, capacitance, Self::AREA, 100.0);
        let base = built.node(NodeKind::Boundary, 0.0, 0.0, Self::BOUNDARY);
        built.join(foil, base, Self::CONDUCTANCE);
        // Something that stores heat, so that the integrator has steps to choose.
        let body = built.store(500.0, 300.0);
        built.join(body, base, 0.5);
        built.0
    }

    /// Ramps from 0 to 50 W, jumps to 5 W at 100 s, and rises again.
    fn table() -> HeatTable {
        HeatTable { times: vec![0.0, 100.0, 100.0, 200.0], powers: vec![0.0, 50.0, 5.0, 30.0] }
    }

    fn times() -> Vec<f64> {
        (0..=40).map(|row| 5.0 * f64::from(row)).collect()
    }

    /// Where its heat balances; at the jump the heat before it.
    fn balance(time: f64) -> f64 {
        let power = if time <= 100.0 { 0.5 * time } else { 5.0 + 0.25 * (time - 100.0) };
        let gain = |t: f64| {
            power + Self::CONDUCTANCE * (Self::BOUNDARY - t)
                - Self::AREA * STEFAN_BOLTZMANN * (t.powi(4) - Self::SPACE.powi(4))
        };
        root_of_falling(gain, 0.0, 2000.0)
    }

    fn error(series: &[Vec<f64>]) -> f64 {
        let found: Vec<f64> = series.iter().map(|row| row[0]).collect();
        apart(&found, &Self::times().into_iter().map(Self::balance).collect::<Vec<_>>())
    }

    fn schedule() -> Schedule {
        Schedule { heat: vec![(0, Self::table())], times: Self::times(), ..Schedule::default() }
    }
}

fn no_capacitance() -> Case {
    Case {
        name: "C = 0".to_owned(),
        what: "a foil between 290 K and space whose heat ramps and jumps; the root of its balance".to_owned(),
        unit: "K",
        limit: DEFAULT.0,
        source: DEFAULT.1.to_owned(),
        remedy: "its balance is solved by Newton's method at every stage, with that stage's heat",
        removed: "10 J/K in place of none",
        expects_reference: false,
        measure: Box::new(|target, _| {
            let network = Foil::network(NodeKind::Arithmetic, 0.0);
            Place::worst(target, |place| {
                let series = integrated(place, &network, &Foil::schedule(), Integrator::Default);
                Ok(Foil::error(&series.map_err(|error| unfinished(&error))?.rows))
            })
        }),
        without: Box::new(|_| {
            let network = Foil::network(NodeKind::Diffusive, Foil::STORE);
            let series = integrated(Place::own(&Target::Reference), &network, &Foil::schedule(), Integrator::Accurate);
            series.map_or(f64::INFINITY, |series| Foil::error(&series.rows))
        }),
    }
}

/// What a conducting network is called, and what it takes away.
struct Words {
    name: &'static str,
    what: &'static str,
    remedy: &'static str,
    removed: &'static str,
}

fn conducting(words: &Words, problem: fn(Scale) -> Problem, without: fn(&Problem) -> f64) -> Case {
    Case {
        name: words.name.to_owned(),
        what: words.what.to_owned(),
        unit: "K",
        limit: DEFAULT.0,
        source: DEFAULT.1.to_owned(),
        remedy: words.remedy,
        removed: words.removed,
        expects_reference: false,
        measure: Box::new(move |target, scale| {
            let problem = problem(scale);
            Place::worst(target, |place| problem.error(place, Integrator::Default))
        }),
        without: Box::new(move |scale| without(&problem(scale))),
    }
}

/// 0.1 J/K that is heated beside 100 kJ/K.
fn capacitance_ratio(_: Scale) -> Problem {
    let mut built = Built::default();
    let small = built.store(0.1, 350.0);
    let large = built.store(1e5, 250.0);
    built.join(small, large, 1.0);
    Problem::of_modes(built.0, vec![10.0, 0.0], vec![0.02, 0.1, 0.5, 1.0, 10.0, 100.0, 1000.0, 10_000.0])
}

/// A chain whose conductances are 1 mW/K and 1 kW/K in turn.
fn conductance_ratio(_: Scale) -> Problem {
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
    Problem::of_modes(built.0, heat, (1..=20).map(|row| FRAME * f64::from(row)).collect())
}

/// A frame of the paper's orbit [s].
const FRAME: f64 = 16.7;

/// Every conductance held to what forward Euler takes in a frame at either end.
fn capped(problem: &Problem) -> f64 {
    let mut network = problem.network.clone();
    for conductor in &mut network.linear {
        let least = conductor.nodes.map(|node| problem.network.capacitances[node as usize]);
        conductor.conductance = conductor.conductance.min(0.25 * least[0].min(least[1]) / FRAME);
    }
    let capped = Problem { network, heat: problem.heat.clone(), times: problem.times.clone(), expected: vec![] };
    let modes = Modes::of(&capped.network, &capped.heat);
    let found = modes.map(|modes| capped.times.iter().map(|time| modes.at(*time)).collect::<Vec<_>>());
    found.map_or(f64::INFINITY, |found| rows_apart(&found, &problem.expected))
}

/// A sheet of aluminium 1 mm thick of cells of 1 cm, of which one column in five is a sliver of 0.1 mm, under a spot of heat.
fn slivers(scale: Scale) -> Problem {
    let side = scale.of(6, 8, 10);
    let width = |x: usize| if x % 5 == 3 { 0.01 } else { 1.0 };
    let at = |x: usize, y: usize| (y * side + x) as u32;
    let mut built = Built::default();
    let mut heat = Vec::new();
    for y in 0..side {
        for x in 0..side {
            // 2700 kg/m3, 896 J/kg/K, 167 W/m/K: ECSS-E-HB-31-01 Part 5A.
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
    Problem::of_modes(built.0, heat, (1..=8).map(|row| FRAME * f64::from(row)).collect())
}

/// Two bodies joined by a chain of five nodes that store nothing, the second and fourth of which are heated.
fn chain(_: Scale) -> Problem {
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
    // Seen from the bodies the chain is one conductance, and heat within it divides as the links to either end.
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
            // Green's function of a chain that is held at its ends.
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
    Problem { network: built.0, heat, times, expected: expected.unwrap_or_default() }
}

/// A foil of 100 J/K and 0.8 m2 that radiates from 1000 K until it is a tenth of a kelvin above space.
struct Cooling;

impl Cooling {
    const PLATE: Plate = Plate { capacitance: 100.0, emissivity: 0.8 };
    const SPACE: f64 = 2.7;

    fn times() -> Vec<f64> {
        let last = Self::PLATE.time(1000.0, Self::SPACE + 0.1, Self::SPACE);
        let rows = 60;
        // Evenly in the logarithm from a hundredth of a second.
        (0..=rows).map(|row| 0.01 * (last / 0.01).powf(f64::from(row) / f64::from(rows))).collect()
    }

    fn expected() -> Vec<f64> {
        Self::times().iter().map(|time| Self::PLATE.temperature(1000.0, Self::SPACE, *time)).collect()
    }

    fn error(place: Place<'_>, integrator: Integrator) -> Result<f64, String> {
        let mut built = Built(Network { space_temperature: Self::SPACE, ..Network::default() });
        built.node(NodeKind::Diffusive, Self::PLATE.capacitance, Self::PLATE.emissivity, 1000.0);
        let schedule = Schedule { times: Self::times(), ..Schedule::default() };
        let series = integrated(place, &built.0, &schedule, integrator).map_err(|error| unfinished(&error))?;
        let found: Vec<f64> = series.rows.iter().map(|row| row[0]).collect();
        Ok(apart(&found, &Self::expected()))
    }

    fn at_the_bound() -> f64 {
        let Plate { capacitance, emissivity } = Self::PLATE;
        let times = Self::times();
        let found = plain::cooling_at_the_bound(capacitance, emissivity, Self::SPACE, 1000.0, &times);
        apart(&found, &Self::expected())
    }
}

fn free_cooling(integrator: Integrator, (limit, source): (f64, &str)) -> Case {
    Case {
        name: format!("free cooling from 1000 K to 2.8 K, {integrator}"),
        what: "a body that radiates to 2.7 K, looked at 61 times; its closed form".to_owned(),
        unit: "K",
        limit,
        source: source.to_owned(),
        remedy: "the sub-step follows an estimate of its error, and the bound of stability only picks the method",
        removed: "Euler at the bound of its stability",
        expects_reference: false,
        measure: Box::new(move |target, _| Place::worst(target, |place| Cooling::error(place, integrator))),
        without: Box::new(|_| Cooling::at_the_bound()),
    }
}

/// Nodes that heat is drawn from until there is none left: which one, and when [s].
fn empties() -> [(Network, Vec<(u32, HeatTable)>, u32, f64); 2] {
    // 100 J/K at 50 K under -1 W.
    let mut stores = Built::default();
    stores.store(1000.0, 300.0);
    let small = stores.store(100.0, 50.0);
    let drawn = vec![(small, HeatTable::constant(-1.0))];
    // A foil that a boundary at 50 K brings 0.1 W/K, under a load that grows by 1 mW/s: 5 W are all it can bring.
    let mut foils = Built::default();
    let base = foils.node(NodeKind::Boundary, 0.0, 0.0, 50.0);
    let foil = foils.node(NodeKind::Arithmetic, 0.0, 0.0, 50.0);
    foils.join(base, foil, 0.1);
    foils.store(1000.0, 300.0);
    let growing = vec![(foil, HeatTable { times: vec![0.0, 1e4], powers: vec![0.0, -10.0] })];
    [(stores.0, drawn, small, 5000.0), (foils.0, growing, foil, 5000.0)]
}

fn below_zero(number: usize, name: &str, what: &str, (limit, source): (f64, &str)) -> Case {
    let schedule = |heat: Vec<(u32, HeatTable)>| Schedule {
        heat,
        times: (1..=100).map(|row| 100.0 * f64::from(row)).collect(),
        ..Schedule::default()
    };
    Case {
        name: name.to_owned(),
        what: what.to_owned(),
        unit: "s",
        limit,
        source: source.to_owned(),
        remedy: "no sub-step may leave the range of temperatures, and what cannot go on ends with node and time",
        removed: "Euler, which goes on below 0 K and says nothing",
        expects_reference: false,
        measure: Box::new(move |target, _| {
            let (network, heat, expected, empty) = empties()[number].clone();
            let schedule = schedule(heat);
            Place::worst(target, |place| match integrated(place, &network, &schedule, Integrator::Default) {
                Err(ControlError::NoStep { time, node, .. } | ControlError::Unbalanced { time, node })
                    if node == expected as usize =>
                {
                    Ok((time - empty).abs())
                }
                Err(error) => Err(format!("refused otherwise: {}", unfinished(&error))),
                Ok(_) => Ok(f64::INFINITY),
            })
        }),
        without: Box::new(move |_| {
            let (network, heat, ..) = &empties()[number];
            let mut power = vec![0.0; network.len()];
            heat.iter().for_each(|(node, table)| power[*node as usize] = table.after(1e4).0);
            let below = |row: &Vec<f64>| row.iter().any(|kelvin| *kelvin < 0.0);
            // A temperature below 0 K that nothing refuses.
            if plain::steps(network, &power, 1.0, 10_000, Step::OneSweep).iter().any(below) {
                f64::INFINITY
            } else {
                0.0
            }
        }),
    }
}

/// The paper's conducting cube through its orbit at 10 Hz for a day, heat constant over each of its 16.7 s steps.
struct Day;

impl Day {
    /// Steps of 0.1 s in a frame, near enough: 864,540 a day.
    const STEPS: u32 = 167;

    fn problem() -> Result<cube::Problem, String> {
        let [solar_constant, _] = SOLAR_CONSTANTS;
        let [_, altitude] = ALTITUDES;
        let case = cube::Case { panel: ALUMINIUM, conducting: true, loads: Loads::All, solar_constant, altitude };
        case.problem().map_err(|error| error.to_string())
    }

    fn frames(scale: Scale) -> usize {
        scale.of(40, cube::STEPS, (86_400.0 / cube::STEP).ceil() as usize)
    }

    fn heat(problem: &cube::Problem, frames: usize) -> impl Iterator<Item = Vec<f64>> {
        (0..frames).map(|frame| problem.heat[frame % cube::STEPS].to_vec())
    }

    /// RKL2 in f64 with steps of a quarter of a second.
    fn expected(problem: &cube::Problem, frames: usize) -> Vec<Vec<f64>> {
        let mut stepper = ReferenceStepper::new(problem.network.clone(), &[]);
        let mut row = |heat: Vec<f64>| {
            let Ok(()) = stepper.set_heat(&heat, &[0.0; 6]);
            let Ok(_) = stepper.attempt(Method::Rkl2 { stages: 3 }, 0.0, cube::STEP / 64.0, 64);
            let Ok(()) = stepper.keep();
            let Ok(now) = stepper.temperatures();
            now
        };
        Self::heat(problem, frames).map(&mut row).collect()
    }
}

fn day() -> Case {
    Case {
        name: "a day of the paper's cube at 10 Hz".to_owned(),
        what: "864,000 steps of Euler (an orbit in --quick), aluminium, conducting; RKL2 in f64 with steps of 0.26 s"
            .to_owned(),
        unit: "K",
        limit: SMALL_STEPS.0,
        source: SMALL_STEPS.1.to_owned(),
        remedy: "a temperature is a multiple of 1/256 K and a small rest, which the step is added to",
        removed: "Euler in plain f32",
        expects_reference: false,
        measure: Box::new(|target, scale| {
            let (problem, frames) = (Day::problem()?, Day::frames(scale));
            let heat = &mut Day::heat(&problem, frames);
            let found = fixed_euler(Place::own(target), &problem.network, heat, cube::STEP, Day::STEPS)?;
            Ok(rows_apart(&found, &Day::expected(&problem, frames)))
        }),
        without: Box::new(|scale| {
            let (Ok(problem), frames) = (Day::problem(), Day::frames(scale)) else { return f64::INFINITY };
            let heat = &mut Day::heat(&problem, frames);
            let found = plain::euler_f32(&problem.network, heat, cube::STEP, Day::STEPS);
            rows_apart(&found, &Day::expected(&problem, frames))
        }),
    }
}

/// All of them.
pub fn cases() -> Vec<Case> {
    let mut cases: Vec<Case> = [10, 100, 1000].map(slow_heating).into();
    cases.push(no_capacitance());
    cases.push(conducting(
        &Words {
            name: "C ratio of 1e6",
            what: "0.1 J/K under 10 W joined by 1 W/K to 100 kJ/K, for 10,000 s; sums of exponentials",
            remedy: "the method follows the stiffness: stages of RKL2, or TR-BDF2",
            removed: "Euler with steps of 1 s",
        },
        capacitance_ratio,
        |problem| problem.plain(1.0, Step::Euler),
    ));
    cases.push(conducting(
        &Words {
            name: "GL ratio of 1e6",
            what: "a chain of six nodes joined by 1 mW/K to 1 kW/K; sums of exponentials",
            remedy: "the method follows the stiffness: stages of RKL2, or TR-BDF2",
            removed: "conductances capped so that Euler takes a frame",
        },
        conductance_ratio,
        capped,
    ));
    cases.push(conducting(
        &Words {
            name: "slivers",
            what: "a 1 mm sheet of cells of 1 cm and slivers of 0.1 mm under a spot of heat; sums of exponentials",
            remedy: "all nodes step together: stages of RKL2, or TR-BDF2 with conjugate gradients",
            removed: "an exponential for each node by itself",
        },
        slivers,
        |problem| problem.plain(FRAME, Step::Exponential),
    ));
    cases.push(conducting(
        &Words {
            name: "arithmetic chain",
            what: "five nodes of C = 0 between two bodies, two of them heated; closed form",
            remedy: "coupled nodes are solved together, to convergence, at every stage, the first included",
            removed: "each balanced once a step of 0.1 s",
        },
        chain,
        |problem| problem.plain(0.1, Step::OneSweep),
    ));
    cases.extend(thermostats::cases());
    cases.push(free_cooling(Integrator::Default, DEFAULT));
    cases.push(free_cooling(Integrator::Accurate, ACCURATE));
    cases.push(below_zero(
        0,
        "a body that runs out of heat",
        "1 W drawn from 100 J/K at 50 K: refused by name at 5000 s",
        (0.05, "as switching times of issue 4"),
    ));
    cases.push(below_zero(
        1,
        "a foil from which more is drawn than arrives",
        "C = 0, a load that grows to the 5 W that its neighbour can bring: refused by name at 5000 s",
        (100.0, "one interval of outputs, at which such nodes are looked at"),
    ));
    cases.push(day());
    cases
}
