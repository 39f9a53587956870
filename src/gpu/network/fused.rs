//! Execution of a small network: one workgroup takes all sub-steps of an attempt in a few dispatches.

mod settle;

use std::collections::BTreeMap;
use std::sync::Arc;

use bytemuck::Zeroable;

use super::schedule::Schedule;
use super::small_frame::{Unknowns, dispatched, state};
use super::tables::Tables;
use super::weights::{device_stages, error_weights};
use crate::gpu::bindings::Bindings;
use crate::gpu::context::Context;
use crate::gpu::error::GpuError;
use crate::gpu::layout::{NetworkAttempt, NetworkStage};
use crate::gpu::once::Once;
use crate::gpu::resource::Resource;
use crate::gpu::store::Resources;
use crate::gpu::variant::{FusedKind, FusedVariant};
use crate::thermal::network::Network;
use crate::thermal::network::stepper::{Attempt, Method, WorkCounts};

/// Most nodes that fit into the shared memory of the kernels.
pub const NODES_AT_MOST: usize = 1024;
/// Most loop iterations of a dispatch (LOOPS_AT_MOST in glsl/network_fused.comp).
const LOOPS_AT_MOST: u32 = 48_000;
/// Size of the result buffer [32-bit words]: counts, then sensors.
const RESULT_WORDS: usize = 1 << 16;
const RESULT_HEAD: usize = 4;
/// Most sub-steps of a submission.
const SUB_STEPS_AT_MOST: u32 = 20_000;
/// Most stages of a sub-step.
const STAGES_AT_MOST: u32 = 999;
/// Most iterations of Newton's method in a dispatch.
const ITERATIONS: u32 = 12;

/// A small network with its buffers and pipelines. Fields are dropped in order.
pub struct Fused {
    once: Once,
    bindings: Bindings,
    resources: Resources,
    /// Elimination order of each system of equations.
    schedules: BTreeMap<Unknowns, Schedule>,
    tables: Tables,
    sensors: u32,
    space_temperature: f32,
    /// Whether the accepted state is in `SmallOdd`.
    odd: bool,
    lanes: u32,
    counts: WorkCounts,
    /// Number of stages and step length [s] of the stage buffer's content.
    staged: Option<(u32, f64)>,
}

impl Fused {
    /// Uploads a network. The result is `None` if the network is too large, or if its arithmetic nodes need too many
    /// products in the elimination.
    pub fn new(context: &Arc<Context>, network: &Network, sensors: &[u32]) -> Result<Option<Self>, GpuError> {
        if network.len() > NODES_AT_MOST {
            return Ok(None);
        }
        let tables = Tables::new(network);
        let Some(schedule) = Schedule::new(&tables, &tables.coupled) else { return Ok(None) };
        let lanes = lanes_for(network.len(), context.info.kind == "cpu");
        let nodes = network.len();
        let lists: Vec<u32> = sensors.iter().chain(&tables.lone).copied().collect();
        let mut resources = Resources::new(context);
        resources.make_of(Resource::SmallAttempt, 1)?;
        resources.make_with(Resource::SmallNodes, &tables.nodes)?;
        resources.make_with(Resource::SmallLinks, &tables.links)?;
        resources.make_with(Resource::SmallHeat, &vec![[0.0f32; 2]; nodes])?;
        resources.make_with(Resource::SmallStages, &vec![NetworkStage::zeroed(); STAGES_AT_MOST as usize])?;
        resources.make_with(Resource::SmallLists, &lists)?;
        resources.make_of(Resource::SmallEven, nodes)?;
        resources.make_of(Resource::SmallOdd, nodes)?;
        resources.make_of(Resource::SmallWork, nodes)?;
        resources.make_of(Resource::SmallResult, RESULT_WORDS)?;
        let mut fused = Self {
            once: Once::new(context)?,
            bindings: Bindings::plain(context),
            resources,
            schedules: BTreeMap::new(),
            tables,
            sensors: sensors.len() as u32,
            space_temperature: network.space_temperature as f32,
            odd: false,
            lanes,
            counts: WorkCounts::default(),
            staged: None,
        };
        fused.add_system(Unknowns::Arithmetic, schedule)?;
        // A balance must fit into one dispatch.
        let attempt = fused.describe(Unknowns::Arithmetic, fused.lanes);
        Ok((attempt.loops_iteration * ITERATIONS < LOOPS_AT_MOST).then_some(fused))
    }

    /// Device time of all submissions so far [ms]; `None` without timestamps.
    pub fn device_ms(&self) -> Option<f64> {
        self.once.device_ms()
    }

    /// Work so far.
    pub fn counts(&self) -> WorkCounts {
        self.counts
    }

    /// Takes up work counts of an earlier part of the run.
    pub fn set_counts(&mut self, counts: WorkCounts) {
        self.counts = counts;
    }

    /// Sets the heat of every node [W] and its slope [W/s].
    pub fn set_heat(&mut self, heat: &[[f32; 2]]) -> Result<(), GpuError> {
        self.resources.write(Resource::SmallHeat, 0, heat)
    }

    /// Base and rest of every node in the accepted state [K].
    pub fn state(&self) -> &[[f32; 2]] {
        self.resources.read(state(self.odd), 0, self.tables.nodes.len())
    }

    /// Replaces the accepted state.
    pub fn set_state(&mut self, pairs: &[[f32; 2]]) -> Result<(), GpuError> {
        self.resources.write(state(self.odd), 0, pairs)
    }

    /// Accepts the state of the last attempt.
    pub fn keep(&mut self) {
        self.odd = !self.odd;
    }

    /// Attempts sub-steps. The result is `None` if the method needs more than one dispatch allows.
    pub fn attempt(&mut self, method: Method, t: f64, step: f64, count: u32) -> Result<Option<Attempt>, GpuError> {
        let (stages, unknowns) = match method {
            Method::Euler => (1, Unknowns::Arithmetic),
            Method::Rkl2 { stages } => (stages, Unknowns::Arithmetic),
            Method::TrBdf2 => (2, Unknowns::Free),
        };
        if !self.knows(unknowns)? || stages > STAGES_AT_MOST {
            return Ok(None);
        }
        let lanes = FusedVariant::LANES.into_iter().filter(|lanes| *lanes >= self.lanes);
        let plans = lanes.filter_map(|lanes| self.plan(lanes, unknowns, stages).map(|plan| (lanes, plan)));
        let Some((lanes, (mut planned, per_dispatch))) = plans.into_iter().next() else { return Ok(None) };
        planned.step = step as f32;
        [planned.error_end, planned.error_start, planned.error_change] = error_weights(method, step);
        if method != Method::TrBdf2 && self.staged != Some((stages, step)) {
            self.resources.write(Resource::SmallStages, 0, &device_stages(stages, step))?;
            self.staged = Some((stages, step));
        }
        let kind = match method {
            Method::TrBdf2 => FusedKind::Implicit,
            _ => FusedKind::Explicit { radiative: self.tables.radiative, elimination: !self.tables.coupled.is_empty() },
        };
        self.copy_state()?;

        let mut attempt = Attempt::default();
        let room = (RESULT_WORDS - RESULT_HEAD) as u32 / 2 / self.sensors.max(1);
        let mut first = 0;
        while first < count {
            let some = (count - first).min(room).min(SUB_STEPS_AT_MOST);
            planned.time = (t + f64::from(first) * step) as f32;
            planned.count = some;
            let head = self.sub_steps((FusedVariant { kind, lanes }, unknowns), planned, per_dispatch)?;
            let error = f64::from(f32::from_bits(head));
            // `max` would discard a NaN.
            attempt.error = if error.is_nan() { f64::INFINITY } else { attempt.error.max(error) };
            let words: &[u32] =
                self.resources.read(Resource::SmallResult, 0, RESULT_HEAD + 2 * (some * self.sensors) as usize);
            let part = |word: u32| f64::from(f32::from_bits(word));
            attempt.sensed.extend(words[RESULT_HEAD..].chunks_exact(2).map(|pair| part(pair[0]) + part(pair[1])));
            self.counts.sub_steps += u64::from(some);
            self.counts.stages += u64::from(some) * u64::from(stages);
            first += some;
        }
        Ok(Some(attempt))
    }

    /// Parameters of dispatches with `lanes` invocations, and the sub-steps of each; `None` if not even one fits.
    fn plan(&self, lanes: u32, unknowns: Unknowns, stages: u32) -> Option<(NetworkAttempt, u32)> {
        let mut planned = self.describe(unknowns, lanes);
        let pass = self.tables.loops(&self.all(), lanes);
        let lone = self.tables.loops(&self.tables.lone, lanes) + 13 * (self.tables.lone.len() as u32).div_ceil(lanes);
        planned.loops_sub_step = (stages + 3) * (pass + lone + 4) + planned.sensors + 8;
        planned.stages = stages;
        let newtons = if planned.unknowns == 0 { 0 } else { 3 * stages + 3 };
        let sub_step = planned.loops_sub_step + newtons * planned.loops_iteration;
        if planned.loops_sub_step + sub_step.max(9 * planned.loops_iteration) > LOOPS_AT_MOST {
            return None;
        }
        let per_dispatch = (LOOPS_AT_MOST - planned.loops_sub_step) / sub_step;
        Some((planned, per_dispatch))
    }

    /// Runs dispatches until all planned sub-steps are done. Returns the bits of the largest error.
    fn sub_steps(
        &mut self,
        (variant, unknowns): (FusedVariant, Unknowns),
        planned: NetworkAttempt,
        per_dispatch: u32,
    ) -> Result<u32, GpuError> {
        self.plan_next(planned)?;
        loop {
            let done = self.resources.read::<u32>(Resource::SmallResult, 0, 1)[0];
            if done >= planned.count {
                break;
            }
            let dispatches = (planned.count - done).div_ceil(per_dispatch.max(1));
            self.submit(variant, unknowns, dispatches)?;
            let head: &[u32] = self.resources.read(Resource::SmallResult, 0, RESULT_HEAD);
            if head[0] == done {
                // Newton's method used up the loop iterations before one sub-step was done.
                return Ok(f32::INFINITY.to_bits());
            }
        }
        let head: &[u32] = self.resources.read(Resource::SmallResult, 0, RESULT_HEAD);
        self.counts.iterations += u64::from(head[2]);
        Ok(head[1])
    }

    fn all(&self) -> Vec<u32> {
        (0..self.tables.nodes.len() as u32).collect()
    }

    /// Copies the accepted state to the buffer of the attempt.
    fn copy_state(&mut self) -> Result<(), GpuError> {
        let kept = self.state().to_vec();
        self.resources.write(state(!self.odd), 0, &kept)
    }

    /// Writes the parameters of the next submissions and resets their progress.
    fn plan_next(&mut self, planned: NetworkAttempt) -> Result<(), GpuError> {
        self.resources.write(Resource::SmallAttempt, 0, &[planned])?;
        self.resources.write(Resource::SmallResult, 0, &[0u32; RESULT_HEAD])
    }

    /// Runs dispatches on the state of the attempt.
    fn submit(&mut self, variant: FusedVariant, unknowns: Unknowns, dispatches: u32) -> Result<(), GpuError> {
        let list = dispatched(variant, unknowns, !self.odd);
        self.bindings.add(&self.resources, list.passes())?;
        let lists = std::iter::repeat_n(&list, dispatches as usize);
        self.once.run(lists, &self.resources, Some(&self.bindings), &|_| Vec::new())?;
        self.counts.dispatches += u64::from(dispatches);
        Ok(())
    }

    /// Parameters common to all dispatches of a system.
    fn describe(&self, unknowns: Unknowns, lanes: u32) -> NetworkAttempt {
        let mut attempt = NetworkAttempt {
            nodes: self.tables.nodes.len() as u32,
            sensors: self.sensors,
            lone: self.tables.lone.len() as u32,
            space_temperature: self.space_temperature,
            ..NetworkAttempt::zeroed()
        };
        if let Some(schedule) = self.schedules.get(&unknowns) {
            schedule.describe(&mut attempt, &self.tables, lanes);
        }
        attempt
    }

    /// Makes the elimination order at first use. Returns whether the system is small enough.
    fn knows(&mut self, unknowns: Unknowns) -> Result<bool, GpuError> {
        if !self.schedules.contains_key(&unknowns) {
            let Some(schedule) = Schedule::new(&self.tables, &self.tables.free) else { return Ok(false) };
            self.add_system(unknowns, schedule)?;
        }
        let attempt = self.describe(unknowns, self.lanes);
        Ok(attempt.unknowns == 0 || attempt.loops_iteration * ITERATIONS < LOOPS_AT_MOST)
    }

    fn add_system(&mut self, unknowns: Unknowns, schedule: Schedule) -> Result<(), GpuError> {
        let [words, matrix] = unknowns.resources();
        self.resources.make_with(words, &schedule.words)?;
        self.resources.make_of(matrix, schedule.values)?;
        self.schedules.insert(unknowns, schedule);
        Ok(())
    }
}

/// Invocations of the workgroup. A CPU device uses fewer, because it runs eight of them at a time.
fn lanes_for(nodes: usize, processor: bool) -> u32 {
    let few = if processor { 64 } else { 8 };
    match nodes {
        _ if nodes <= few => 8,
        _ if nodes <= 256 || processor => 64,
        _ => 256,
    }
}
