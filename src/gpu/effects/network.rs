//! A thermal network that the frames step in one pass. `glsl/one_pass.comp` takes the step, and stages conduct inside large blocks.

pub(crate) mod heaters;
pub(crate) mod order;
pub(crate) mod sections;
pub(crate) mod state;
pub(crate) mod tables;

use self::heaters::LOGGED;
use self::sections::{OnePassKind, OnePassShape, Section, section};
use self::tables::OnePassTables;
use super::thermal::TEMPERATURE;
use crate::gpu::layout::{HeaterStep, NetworkStage, NetworkStep};
use crate::gpu::pass::{COMPUTE, COMPUTE_WRITE, Frame, HOST_READ, Pass, barrier};
use crate::gpu::resource::Role::{FromHost, Storage, ToHost};
use crate::gpu::resource::{GROUP, PAIRS, Per, Resource, lent, made, resources};
use crate::gpu::shaders::Shader;
use crate::thermal::network::one_pass::{EstimatePart, OnePassPlan, SeriesStage, since};

/// A buffer of a network, with its number of elements and perhaps its contents.
macro_rules! buffer {
    ($name:literal, $element:expr, $role:expr, $per:ident, $count:expr) => {
        Resource::new($name, $element, $role, Per::$per, |data| data.network.map_or(0, $count))
    };
    ($name:literal, $element:expr, $role:expr, $per:ident, $count:expr, $contents:expr) => {
        buffer!($name, $element, $role, $per, $count)
            .filled(|data| data.network.map_or_else(Default::default, $contents))
    };
}

resources! {
    /// 1 / C and emission of the nodes.
    NODES = buffer!("OnePassNodes", PAIRS, Storage, Node, |one| one.shape.groups() as usize, |one| lent(&one.nodes));
    /// Range of links and of sources of every group.
    ROWS = buffer!("OnePassRows", 16, Storage, Node, |one| one.shape.groups() as usize, |one| lent(&one.rows));
    /// Neighbours by weak conductors, and these conductors.
    LINKS = buffer!("OnePassLinks", 16, Storage, Node, |one| one.links.len(), |one| lent(&one.links));
    /// Drawn nodes that heat every group, and the areas.
    SOURCES = buffer!("OnePassSources", 16, Storage, Node, |one| one.sources.len(), |one| lent(&one.sources));
    /// Range of groups, first weight and factors of every group in blocks. In large blocks, range of the links inside.
    UNITS = buffer!("OnePassUnits", PAIRS, Storage, Node, |one| one.shape.in_blocks() as usize, |one| lent(&one.units));
    /// Weights of the conduction inside blocks.
    WEIGHTS =
        buffer!("OnePassWeights", 16, Storage, Node, OnePassTables::weight_count, |one| made(&one.weights(&one.plan)));
    /// Mean temperatures of every other step [K].
    MEAN_EVEN = buffer!("OnePassMeanEven", GROUP, Storage, Node, |one| one.shape.groups() as usize);
    /// Mean temperatures of the steps that `MEAN_EVEN` skips.
    MEAN_ODD = buffer!("OnePassMeanOdd", GROUP, Storage, Node, |one| one.shape.groups() as usize);
    /// Bases and rests of the temperatures [K].
    STATES = buffer!("OnePassStates", PAIRS, Storage, Node, |one| one.shape.groups() as usize);
    /// What the nodes of blocks receive in a step, and their temperatures at its start [K].
    DRIVES = buffer!("OnePassDrives", PAIRS, Storage, Node, |one| one.shape.in_blocks() as usize);
    /// Change by conduction inside blocks in the last step [K].
    COUPLINGS = buffer!("OnePassCouplings", GROUP, Storage, Node, |one| one.shape.in_blocks() as usize);
    /// Every other vector of the stages of large blocks: changes and errors [K].
    VECTOR_EVEN = buffer!("OnePassVectorEven", PAIRS, Storage, Node, |one| one.shape.in_large() as usize);
    /// The vectors that `VECTOR_EVEN` skips.
    VECTOR_ODD = buffer!("OnePassVectorOdd", PAIRS, Storage, Node, |one| one.shape.in_large() as usize);
    /// Sums of these vectors by their parts [K].
    SUMS = buffer!("OnePassSums", PAIRS, Storage, Node, |one| one.shape.in_large() as usize);
    /// What the estimate of the error keeps: four numbers of every node.
    MEMORY = buffer!("OnePassMemory", 4 * GROUP, Storage, Node, |one| one.shape.estimated() as usize);
    /// Error of the nodes of blocks before it spreads, and the error since the last estimate [K].
    ERRORS = buffer!("OnePassErrors", PAIRS, Storage, Node, |one| one.shape.in_blocks() as usize);
    /// Sum of the squares of the estimated errors of every group [K2], the largest [K], and its place. Estimates are added to it.
    TOLD =
        buffer!("OnePassTold", GROUP, Storage, Node,
        |one| one.shape.estimated() as usize, |one| made(&vec![[0.0f32; 4]; one.shape.estimated() as usize]));
    /// Sensor, place, thresholds and gain of every heater.
    HEATERS =
        buffer!("OnePassHeaters", PAIRS, Storage, Scene,
        |one| one.heaters.len(), |one| made(&one.heater_words(&one.plan)));
    /// Power of every heater while it is on [W], written by the host.
    POWERS = buffer!("OnePassPowers", 4, FromHost, Scene, |one| one.heaters.len()).each_slot();
    /// State of the thermostat of every heater.
    SWITCHES = buffer!("OnePassSwitches", 16, Storage, Scene, |one| one.heaters.len());
    /// Switches of every heater in a frame.
    LOG = buffer!("OnePassLog", 4 * LOGGED, ToHost, Scene, |one| one.heaters.len()).each_slot();
}

/// Numbers of a plan that its passes tell the device.
#[derive(Debug, Clone, Default)]
pub struct PlanConstants {
    /// Length of a step [s].
    pub step: f64,
    /// Runge-Kutta steps in a local step of a fast node.
    pub local_steps: u32,
    /// Fourth power of the radiative temperature of space [K4].
    pub space_temperature_4: f32,
    /// Stages of the conduction inside large blocks. The first one makes the first vector.
    pub stages: Vec<NetworkStage>,
}

/// Invocations of a workgroup.
const WORKGROUP: u32 = 64;

/// Place of a step in its frame.
#[derive(Clone, Copy)]
struct OnePassPlace<'a> {
    /// Its number. A trial has the number of the step that it is for.
    number: u32,
    /// Its part in the estimate of the error.
    sample: EstimatePart,
    /// Steps since the last estimate.
    since: u32,
    first: bool,
    /// Whether it follows its trial.
    tried: bool,
    /// Whether the mean temperatures at its start are in the odd buffer.
    odd: bool,
    /// Whether its temperatures are not kept.
    trial: bool,
    /// Whether the drawn nodes take its temperatures.
    shown: bool,
    /// Numbers of the plan.
    told: &'a PlanConstants,
}

/// Mean temperatures from which a step starts. The step leaves the means of the next step in the other buffer.
fn means(odd: bool) -> &'static Resource {
    if odd { &MEAN_ODD } else { &MEAN_EVEN }
}

/// Vectors of a stage.
fn vectors(stage: u32) -> &'static Resource {
    if stage.is_multiple_of(2) { &VECTOR_EVEN } else { &VECTOR_ODD }
}

/// Barriers between compute passes over the buffers for which it is true.
fn wait(frame: &mut Frame, buffers: &[(&'static Resource, bool)]) {
    let needed = buffers.iter().filter(|(_, is)| *is);
    frame.wait(needed.map(|(resource, _)| barrier(resource, COMPUTE_WRITE, COMPUTE)));
}

impl OnePassShape {
    /// Steps of one length, after the flux of the drawn nodes. `age` is the number of such steps before them. The state is
    /// in the odd buffer if `odd`. Where there were none, the first one is tried before. Large blocks conduct in a number of `stages`. The second result is
    /// `odd` for the new state.
    pub fn steps(&self, count: u32, age: u32, odd: bool, told: &PlanConstants) -> (Frame, bool) {
        let tried = age == 0;
        let all = count + u32::from(tried);
        let mut frame = Frame::default();
        for number in 0..all {
            let trial = tried && number == 0;
            let own = number.saturating_sub(u32::from(tried));
            let age = age.saturating_add(own);
            self.step(
                OnePassPlace {
                    number: own,
                    sample: if trial { EstimatePart::None } else { EstimatePart::of(age) },
                    since: since(age),
                    first: number == 0,
                    tried: tried && number == 1,
                    odd: odd ^ (number % 2 == 1),
                    trial,
                    shown: number + 1 == all,
                    told,
                },
                &mut frame,
            );
        }
        if self.heaters > 0 {
            frame.wait([barrier(&LOG, COMPUTE_WRITE, HOST_READ)]);
        }
        (frame, self.odd_after(count, age, odd))
    }

    /// Whether the state is in the odd buffer after steps.
    pub(crate) fn odd_after(&self, count: u32, age: u32, odd: bool) -> bool {
        odd ^ ((count + u32::from(age == 0)) % 2 == 1)
    }

    /// The phases of a step with their barriers. The heaters come first, because nodes take their power. Nodes without capacity come before others, which take
    /// their temperatures. Then come all other nodes, and at last the conduction inside blocks, which needs what their nodes received.
    fn step(&self, place: OnePassPlace<'_>, frame: &mut Frame) {
        use OnePassKind as K;
        let OnePassPlace { sample, first, tried, trial, shown, odd, .. } = place;
        let (this, next) = (means(odd), means(!odd));
        let (heats, balances, in_blocks) = (self.heaters > 0, self.has(&[K::Balance]), self.has(&[K::Drive]));
        // Nodes that gather from others, and nodes that finish their step, before the conduction or without one.
        let (gathers, finishes) = (self.has(&[K::Drive, K::Advance]), self.has(&[K::Advance, K::Alone]));
        let (others, leads) = (gathers || finishes, finishes && !in_blocks);
        let (estimates, samples) =
            (sample == EstimatePart::Estimate, sample != EstimatePart::None && self.estimated() > 0);

        // What earlier steps left, and the loads of this frame. A trial only reads the states.
        wait(
            frame,
            &[
                (&TEMPERATURE, first || heats || shown && (balances || leads)),
                (this, heats || balances || gathers),
                (next, true),
                (&STATES, !tried || (balances || leads) && !(heats && others)),
                (&DRIVES, in_blocks),
                (&COUPLINGS, in_blocks),
                (&MEMORY, samples),
                (&ERRORS, estimates && in_blocks),
                (&TOLD, estimates && samples),
                (&SWITCHES, heats),
                (&LOG, heats),
            ],
        );
        if heats {
            frame.pass(self.heat(place));
            // The power is read. What the sensors read is overwritten.
            let states = balances || leads && !trial;
            wait(frame, &[(&TEMPERATURE, true), (this, balances), (&STATES, states)]);
        }
        if balances {
            let passes = self.sections().filter(|(section, _)| section.kind == K::Balance);
            frame.passes_of(passes.map(|(section, groups)| self.pass(section, place, groups)));
            wait(frame, &[(&TEMPERATURE, shown && others), (this, gathers), (next, finishes), (&STATES, others)]);
        }
        let mut last: Option<OnePassKind> = None;
        let steps = self.sections().filter(|(section, _)| matches!(section.kind, K::Drive | K::Advance | K::Alone));
        for (of, groups) in steps {
            let kind = Some(of.kind);
            if last.is_some() {
                // Other nodes of the same buffers.
                let (still_drives, ends) = (kind == Some(K::Drive), kind != Some(K::Drive));
                wait(
                    frame,
                    &[
                        (&TEMPERATURE, shown && ends),
                        (next, last != Some(K::Drive)),
                        (&STATES, ends && !trial),
                        (&DRIVES, still_drives),
                        (&MEMORY, samples && kind != Some(K::Alone)),
                        (&ERRORS, estimates && still_drives),
                        (&TOLD, estimates && last == Some(K::Advance) && kind == last),
                    ],
                );
            }
            frame.pass(self.pass(of, place, groups));
            last = kind;
        }
        if in_blocks {
            self.conduct(place, frame);
        }
    }

    /// Whether the network has nodes of some kinds.
    fn has(&self, kinds: &[OnePassKind]) -> bool {
        self.sections().any(|(section, _)| kinds.contains(&section.kind))
    }

    /// The conduction inside blocks, after all that their nodes received.
    fn conduct(&self, place: OnePassPlace<'_>, frame: &mut Frame) {
        use OnePassKind as K;
        let OnePassPlace { sample, trial, shown, odd, .. } = place;
        let (next, estimates, large) = (means(!odd), sample == EstimatePart::Estimate, self.in_large() > 0);
        if large {
            self.stages(place, frame);
        }
        wait(
            frame,
            &[
                (&TEMPERATURE, shown),
                (next, self.has(&[K::Advance, K::Alone, K::Balance])),
                (&STATES, !trial),
                (&DRIVES, !large),
                (&COUPLINGS, true),
                (&MEMORY, estimates),
                (&ERRORS, estimates && !large),
                (&TOLD, estimates && self.has(&[K::Advance])),
                (&SUMS, large),
            ],
        );
        let conducts = section(K::Conduct, false, false);
        let ranges = [(true, (0, self.in_large())), (false, (self.in_large(), self.in_blocks()))];
        let mut passes = ranges.into_iter().filter(|(_, (first, end))| first < end);
        let mut pass = |(large, groups)| self.pass(Section { large, ..conducts }, place, groups);
        frame.passes_of(passes.next().map(&mut pass));
        if let Some(other) = passes.next() {
            // Other nodes of the same buffers.
            wait(
                frame,
                &[
                    (&TEMPERATURE, shown),
                    (next, true),
                    (&STATES, !trial),
                    (&COUPLINGS, true),
                    (&MEMORY, estimates),
                    (&TOLD, estimates),
                ],
            );
            frame.pass(pass(other));
        }
    }

    /// The stages of the conduction inside large blocks. Each reads the vectors of the one before.
    fn stages(&self, place: OnePassPlace<'_>, frame: &mut Frame) {
        let estimates = place.sample == EstimatePart::Estimate;
        for number in 0..place.told.stages.len() as u32 {
            let begins = number == 0;
            wait(
                frame,
                &[
                    (&DRIVES, begins),
                    (&ERRORS, begins && estimates),
                    (&VECTOR_EVEN, true),
                    (&VECTOR_ODD, !begins),
                    (&SUMS, true),
                ],
            );
            frame.pass(self.stage(number, place));
        }
    }

    fn stage(&self, number: u32, OnePassPlace { told, sample, .. }: OnePassPlace<'_>) -> Pass {
        let words = [(number == 0, "begin"), (sample == EstimatePart::Estimate, "estimate")];
        let shader = Shader::with("one_pass_stage.comp", &words);
        let pass = Pass::dispatch(shader.name(), shader, self.in_large().div_ceil(WORKGROUP));
        let pass = pass.instead("Start", &DRIVES).instead("Spread", &ERRORS).instead("Vector", vectors(number));
        let before = vectors(number + 1);
        pass.instead("Before", before).instead("Gathered", before).told(&told.stages[number as usize])
    }

    /// The power of the heaters in a step.
    fn heat(&self, OnePassPlace { number, first, trial, odd, told, .. }: OnePassPlace<'_>) -> Pass {
        let constants = HeaterStep {
            heaters: self.heaters,
            first: u32::from(first),
            trial: u32::from(trial),
            start: (f64::from(number) * told.step) as f32,
            step: told.step as f32,
        };
        let workgroups = self.heaters.div_ceil(WORKGROUP);
        let pass = Pass::dispatch("one_pass_heaters", Shader::plain("one_pass_heaters.comp"), workgroups);
        pass.instead("Gathered", means(odd)).told(&constants)
    }

    /// A pass over a range of groups.
    fn pass(&self, of: Section, place: OnePassPlace<'_>, (first, end): (u32, u32)) -> Pass {
        let OnePassPlace { since, odd, told, .. } = place;
        let shader = shader(of, place.sample, place.trial, place.shown);
        let constants = NetworkStep {
            first,
            end,
            count: told.local_steps,
            since,
            step: told.step as f32,
            space_temperature_4: told.space_temperature_4,
        };
        let pass = Pass::dispatch(shader.name(), shader, (end - first).div_ceil(WORKGROUP)).told(&constants);
        pass.instead("Means", means(odd)).instead("Gathered", means(odd)).instead("Next", means(!odd))
    }
}

/// The shader of a section in a step, such as `one_pass.advance.shown.radiative`, without words that its work does not depend on.
fn shader(of: Section, sample: EstimatePart, trial: bool, shown: bool) -> Shader {
    use OnePassKind as K;
    let Section { kind, radiative, fast, large } = of;
    let (drives, conducts) = (kind == K::Drive, kind == K::Conduct);
    let (alone, balances) = (kind == K::Alone, kind == K::Balance);
    let sampled = !(trial || alone || balances || conducts && sample == EstimatePart::Note);
    let name = match kind {
        K::Alone => "alone",
        K::Balance => "balance",
        K::Advance => "advance",
        K::Drive => "drive",
        K::Conduct => "conduct",
    };
    let words = [
        (true, name),
        (large && conducts, "large"),
        (trial && !balances, "trial"),
        (sampled && sample == EstimatePart::Note, "note"),
        (sampled && sample == EstimatePart::Estimate, "estimate"),
        (shown && !drives && !trial, "shown"),
        (radiative && !conducts && !alone || balances, "radiative"),
        (fast && !conducts && !balances, "fast"),
    ];
    Shader::with("one_pass.comp", &words)
}

impl PlanConstants {
    /// The numbers of a plan whose large blocks have so many groups.
    pub(crate) fn new(plan: &OnePassPlan, in_large: u32) -> Self {
        let step = plan.step();
        let stage = |SeriesStage { rate, here, older, part }: SeriesStage| NetworkStage {
            end: in_large,
            rate: (step * rate) as f32,
            here: here as f32,
            older: older as f32,
            part: part as f32,
        };
        let stages = plan.series().map(|series| {
            let first = SeriesStage { rate: 1.0, here: 0.0, older: 0.0, part: series.first() };
            let others = (1..=series.stages()).map(|number| stage(series.stage(number)));
            std::iter::once(stage(first)).chain(others).collect()
        });
        Self {
            step,
            local_steps: plan.local_steps(),
            space_temperature_4: plan.network().space_temperature.powi(4) as f32,
            stages: stages.unwrap_or_else(|| vec![stage(SeriesStage::default())]),
        }
    }
}
