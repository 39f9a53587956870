//! State between frames of a thermal network that the frames step in one pass.

use std::sync::Arc;

use crate::gpu::frame::Frame;
use crate::gpu::layout::{HeaterStep, NetworkStep};
use crate::gpu::nodes::GROUP;
use crate::gpu::one_pass::OnePassTables;
use crate::gpu::resource::{Resource, SLOTS};
use crate::gpu::variant::StepKind;
use crate::thermal::network::control::Switch;
use crate::thermal::network::one_pass::{Plan, Plans};

/// Most steps of a network in a frame whose passes are timed.
pub(super) const STEPS_AT_MOST: u32 = 8;

/// State of a network between frames.
pub(super) struct OnePass {
    pub tables: OnePassTables,
    pub plans: Plans,
    /// The plan whose weights are on the device.
    pub plan: Arc<Plan>,
    /// Whether the mean temperatures are in the odd buffer.
    pub odd: bool,
    /// Whether the last step had the same length.
    pub started: bool,
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
            plan,
            odd: false,
            started: false,
            on: on.collect(),
            unread: [None; SLOTS],
            switches: Vec::new(),
        }
    }

    /// Every list of a step, so that pipelines exist before a run.
    pub fn frames(&self) -> Vec<Frame> {
        let of = |odd| self.tables.shape.steps(STEPS_AT_MOST, true, odd).0;
        vec![of(false), of(true)]
    }

    /// Buffers with the state between two steps: name, and count of numbers.
    pub fn state(&self) -> [(Resource, &'static str, usize); 5] {
        let nodes = GROUP * self.tables.shape.groups() as usize;
        let in_blocks = GROUP * self.tables.shape.in_blocks() as usize;
        [
            (Resource::OnePassMeanEven, "one_pass.mean_even", 2 * nodes),
            (Resource::OnePassMeanOdd, "one_pass.mean_odd", 2 * nodes),
            (Resource::OnePassRests, "one_pass.rests", nodes),
            (Resource::OnePassCouplings, "one_pass.couplings", in_blocks),
            (Resource::OnePassSwitches, "one_pass.switches", 4 * self.tables.heaters.len()),
        ]
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
    pub fn constants(&self, first: u32, end: u32) -> NetworkStep {
        NetworkStep {
            first,
            end,
            count: self.plan.local_steps(),
            step: self.plan.step() as f32,
            space_temperature_4: self.plan.network().space_temperature.powi(4) as f32,
        }
    }
}

/// Whether a kind of range belongs to a network.
pub(super) fn is_of_network(kind: StepKind) -> bool {
    kind == StepKind::Absorb
}
