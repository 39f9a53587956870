//! State between frames of a thermal network that the frames step in one pass.

use std::sync::Arc;

use crate::gpu::frame::Frame;
use crate::gpu::layout::{HeaterStep, NetworkStage, NetworkStep};
use crate::gpu::nodes::GROUP;
use crate::gpu::one_pass::OnePassTables;
use crate::gpu::resource::Resource;
use crate::gpu::resource_row::SLOTS;
use crate::gpu::variant::StepKind;
use crate::thermal::network::control::Switch;
use crate::thermal::network::one_pass::{
    ChebyshevSeries, HALVINGS_AT_MOST, Halving, OnePassPlan, Plans, SeriesStage, Told,
};

/// Most steps of a network in a frame whose passes are timed: a coarse step of a warm-up has six of the scene, each halved three times.
pub(super) const STEPS_AT_MOST: u32 = 6 << HALVINGS_AT_MOST;

/// State of a network between frames.
pub(super) struct OnePass {
    pub tables: OnePassTables,
    pub plans: Plans,
    /// The plan whose weights are on the device.
    pub plan: Arc<OnePassPlan>,
    /// Whether the mean temperatures are in the odd buffer.
    pub odd: bool,
    /// Number of steps of the present length so far.
    pub age: u32,
    pub halving: Halving,
    /// The estimate of the error before what the device keeps.
    pub told: Told,
    /// Estimates since the device keeps them.
    pub told_steps: u64,
    /// Whether the heater of each thermostat is on, as far as the logs were read.
    pub on: Vec<bool>,
    /// Start and length [s] of the frame of each slot whose log is to be read.
    pub unread: [Option<[f64; 2]>; SLOTS],
    /// Switches that were read.
    pub switches: Vec<Switch>,
}

impl OnePass {
    pub fn new(tables: &OnePassTables) -> Self {
        let plan = Arc::clone(&tables.plan);
        let on = tables.heaters.iter().filter_map(|heater| heater.thermostat.as_ref()).map(|one| one.initially_on);
        Self {
            tables: tables.clone(),
            plans: Plans::new(&plan),
            halving: Halving::new(tables.tolerance, plan.halvings()),
            plan,
            odd: false,
            age: 0,
            told: Told::default(),
            told_steps: 0,
            on: on.collect(),
            unread: [None; SLOTS],
            switches: Vec::new(),
        }
    }

    /// Every list of a step, so that pipelines exist before a run.
    pub fn frames(&self) -> Vec<Frame> {
        // Vectors of both parities.
        let stages = 2;
        let of = |count, age| [false, true].map(|odd| self.tables.shape.steps(count, age, odd, stages).0);
        // Each part in the estimate, also in the last step of a frame.
        let single = [1, 2, 4].into_iter().flat_map(|age| of(1, age));
        of(STEPS_AT_MOST, 0).into_iter().chain(single).collect()
    }

    /// Buffers with the state between two steps: name, and count of numbers.
    pub fn state(&self) -> [(Resource, &'static str, usize); 7] {
        let nodes = GROUP * self.tables.shape.groups() as usize;
        let estimated = GROUP * self.tables.shape.estimated() as usize;
        let in_blocks = GROUP * self.tables.shape.in_blocks() as usize;
        [
            (Resource::OnePassMeanEven, "one_pass.mean_even", nodes),
            (Resource::OnePassMeanOdd, "one_pass.mean_odd", nodes),
            (Resource::OnePassStates, "one_pass.states", 2 * nodes),
            (Resource::OnePassCouplings, "one_pass.couplings", in_blocks),
            (Resource::OnePassMemory, "one_pass.memory", 4 * estimated),
            (Resource::OnePassTold, "one_pass.told", estimated),
            (Resource::OnePassSwitches, "one_pass.switches", 4 * self.tables.heaters.len()),
        ]
    }

    /// The estimate of the error in what the device keeps.
    pub fn told(&self, kept: &[[f32; 4]]) -> Told {
        let tables = &self.tables;
        let mut told = Told { count: self.told_steps * tables.slot_of_node.len() as u64, ..Told::default() };
        let mut largest = None;
        for (group, [squares, most, place, _]) in kept.iter().enumerate() {
            told.squares += f64::from(*squares);
            if f64::from(*most) > told.most {
                (told.most, largest) = (f64::from(*most), Some((GROUP * group) as u32 + *place as u32));
            }
        }
        let node = tables.slot_of_node.iter().position(|slot| Some(*slot) == largest);
        Told { node: node.unwrap_or(0), ..told }
    }

    /// Stages of the conduction inside large blocks.
    pub fn stages(&self) -> u32 {
        self.plan.series().map_or(0, |series| series.stages() as u32)
    }

    /// Push constants of a stage. 0 is the first vector.
    pub fn stage_constants(&self, number: u32) -> NetworkStage {
        let (end, step) = (self.tables.shape.in_large(), self.plan.step());
        let of = |series: &ChebyshevSeries| match number {
            0 => SeriesStage { rate: 1.0, here: 0.0, older: 0.0, part: series.first() },
            number => series.stage(number as usize),
        };
        let SeriesStage { rate, here, older, part } = self.plan.series().map(of).unwrap_or_default();
        NetworkStage { end, rate: (step * rate) as f32, here: here as f32, older: older as f32, part: part as f32 }
    }

    /// Push constants of a pass of the heaters.
    pub fn heater_constants(&self, number: u32, first: bool, trial: bool) -> HeaterStep {
        let step = self.plan.step();
        HeaterStep {
            heaters: self.tables.heaters.len() as u32,
            first: u32::from(first),
            trial: u32::from(trial),
            start: (f64::from(number) * step) as f32,
            step: step as f32,
        }
    }

    /// Push constants over a range of groups.
    pub fn constants(&self, first: u32, end: u32, since: u32) -> NetworkStep {
        NetworkStep {
            first,
            end,
            count: self.plan.local_steps(),
            since,
            step: self.plan.step() as f32,
            space_temperature_4: self.plan.network().space_temperature.powi(4) as f32,
        }
    }
}

/// Whether a kind of range belongs to a network.
pub(super) fn is_of_network(kind: StepKind) -> bool {
    kind == StepKind::Absorb
}
