//! State between frames of a thermal network that the frames step in one pass.

use std::sync::Arc;

use super::tables::OnePassTables;
use super::{COUPLINGS, MEAN_EVEN, MEAN_ODD, MEMORY, PlanConstants, STATES, SWITCHES, TOLD};
use crate::gpu::pass::Frame;
use crate::gpu::resource::{Resource, SLOTS};
use crate::model::nodes::GROUP;
use crate::thermal::network::control::Switch;
use crate::thermal::network::one_pass::{HALVINGS_AT_MOST, Halvings, OnePassPlan, Plans, Told, estimates};

/// Most steps of a network in a frame whose passes are timed: a coarse step of a warm-up has six of the scene, each halved three times.
pub(crate) const STEPS_AT_MOST: u32 = 6 << HALVINGS_AT_MOST;

/// State of a network between frames.
pub(crate) struct OnePass {
    pub(crate) tables: OnePassTables,
    pub(crate) plans: Plans,
    /// The plan whose weights are on the device.
    pub(crate) plan: Arc<OnePassPlan>,
    /// Numbers of this plan for the device.
    pub(crate) constants: PlanConstants,
    /// Whether the mean temperatures are in the odd buffer.
    pub(crate) odd: bool,
    /// Number of steps of the present length so far.
    pub(crate) age: u32,
    /// Number of steps of the next frame.
    pub(crate) count: u32,
    pub(crate) halvings: Halvings,
    /// The estimate of the error before what the device keeps.
    pub(crate) told: Told,
    /// Estimates since the device keeps them.
    pub(crate) told_steps: u64,
    /// Whether the heater of each thermostat is on, as far as the logs were read.
    pub(crate) on: Vec<bool>,
    /// Start and length [s] of the frame of each slot whose log is to be read.
    pub(crate) unread: [Option<[f64; 2]>; SLOTS],
    /// Switches that were read.
    pub(crate) switches: Vec<Switch>,
}

impl OnePass {
    pub(crate) fn new(tables: &OnePassTables) -> Self {
        let plan = Arc::clone(&tables.plan);
        let on = tables.heaters.iter().filter_map(|heater| heater.thermostat.as_ref()).map(|one| one.initially_on);
        Self {
            tables: tables.clone(),
            plans: Plans::new(&plan),
            halvings: Halvings::new(tables.tolerance, plan.halvings()),
            constants: PlanConstants::new(&plan, tables.shape.in_large()),
            plan,
            odd: false,
            age: 0,
            count: 1,
            told: Told::default(),
            told_steps: 0,
            on: on.collect(),
            unread: [None; SLOTS],
            switches: Vec::new(),
        }
    }

    /// Every list of a step, so that pipelines exist before a run.
    pub(crate) fn frames(&self) -> Vec<Frame> {
        // Vectors of both parities.
        let mut constants = self.constants.clone();
        constants.stages.resize(3, Default::default());
        let of = |count, age| [false, true].map(|odd| self.tables.shape.steps(count, age, odd, &constants).0);
        // Each part in the estimate, also in the last step of a frame.
        let single = [1, 2, 4].into_iter().flat_map(|age| of(1, age));
        of(STEPS_AT_MOST, 0).into_iter().chain(single).collect()
    }

    /// Buffers with the state between two steps, and their counts of numbers.
    pub(crate) fn state(&self) -> [(&'static Resource, usize); 7] {
        let nodes = GROUP * self.tables.shape.groups() as usize;
        let estimated = GROUP * self.tables.shape.estimated() as usize;
        let in_blocks = GROUP * self.tables.shape.in_blocks() as usize;
        [
            (&MEAN_EVEN, nodes),
            (&MEAN_ODD, nodes),
            (&STATES, 2 * nodes),
            (&COUPLINGS, in_blocks),
            (&MEMORY, 4 * estimated),
            (&TOLD, estimated),
            (&SWITCHES, 4 * self.tables.heaters.len()),
        ]
    }

    /// The estimate of the error in what the device keeps.
    pub(crate) fn told(&self, kept: &[[f32; 4]]) -> Told {
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

    /// Takes a plan of another length of step.
    pub(crate) fn take(&mut self, plan: Arc<OnePassPlan>) {
        self.constants = PlanConstants::new(&plan, self.tables.shape.in_large());
        (self.plan, self.age) = (plan, 0);
    }

    /// Prepares the steps of a frame of `steps` steps of the scene. Returns whether the device needs the weights of another plan.
    pub(crate) fn prepare(&mut self, steps: f64) -> bool {
        let (plan, count) = self.plans.over(steps * self.tables.step, self.halvings.begin());
        self.count = count;
        let changed = !Arc::ptr_eq(&plan, &self.plan);
        if changed {
            self.take(plan);
        }
        changed
    }

    /// Moves the state past steps of the present length.
    pub(crate) fn pass(&mut self, count: u32) {
        self.told_steps += estimates(self.age, count);
        self.odd = self.tables.shape.odd_after(count, self.age, self.odd);
        self.age = self.age.saturating_add(count);
    }
}
