//! Execution of a network: each stage is a dispatch over all nodes.

mod budget;
mod constants;
mod solve;

use std::sync::Arc;

use self::budget::Budget;
use self::constants::Constants;
use super::bytes::{SOLVER, is_of_host, lodgings, plan};
use super::frame::{SUB_STEPS_AT_MOST, WidePlan};
use super::sliced::{GROUP, Sliced};
use super::uses::WORKGROUP;
use crate::gpu::bindings::Bindings;
use crate::gpu::context::Context;
use crate::gpu::error::GpuError;
use crate::gpu::frame::Frame;
use crate::gpu::memory::Buffer;
use crate::gpu::once::Once;
use crate::gpu::pass::Said;
use crate::gpu::resource::Resource;
use crate::gpu::resources::Planned;
use crate::gpu::store::{Region, Resources};
use crate::saved::{Saved, SavedError};
use crate::thermal::network::Network;
use crate::thermal::network::stepper::{Attempt, StepMethod, WorkCounts};

/// Most nodes of a dispatch: 65,535 workgroups with four nodes an invocation.
pub const NODES_AT_MOST: usize = 65_535 * WORKGROUP * GROUP;
/// Most links of a node, because some drivers stop a shader loop after 65,535 iterations.
pub const LINKS_AT_MOST: usize = 60_000;
/// Number of passes after which a submission ends.
const PASSES_AT_MOST: u32 = 4_000;

/// A network with its buffers and pipelines. Fields are dropped in order.
pub struct Wide {
    once: Once,
    bindings: Bindings,
    resources: Resources,
    /// Buffers of the scene that may hold the solver's vectors while the network is stepped.
    spare: Vec<Arc<Buffer>>,
    /// Whether the solver has written to spare buffers since the last query.
    wrote_spare: bool,
    /// Place of each node in the device order.
    slot_of_node: Vec<u32>,
    plan: WidePlan,
    space_temperature: f32,
    /// Whether the last attempt left its state in `NetworkOdd`.
    odd: bool,
    counts: WorkCounts,
    /// Recorded iterations for the balance of a stage, for a TR-BDF2 stage and for a steady state.
    budgets: [Budget; 3],
}

impl Wide {
    /// Uploads the network.
    ///
    /// # Errors
    /// The device can not hold the network, or a Vulkan call fails.
    pub fn new(
        context: &Arc<Context>,
        network: &Network,
        sensors: &[u32],
        spare: Vec<Arc<Buffer>>,
    ) -> Result<Self, GpuError> {
        let sliced = Sliced::new(network);
        let mut once = Once::new(context)?;
        let mut resources = Resources::new(context);
        for Planned { resource, bytes } in plan(&sliced.sizes(), sensors.len()) {
            if !SOLVER.contains(&resource) {
                resources.make(resource, bytes)?;
            }
        }
        let groups = sliced.groups;
        let wide_plan = WidePlan {
            radiative: sliced.radiative,
            tails: !sliced.links.is_empty(),
            lone: !sliced.arithmetic.is_empty() && !sliced.coupled,
            coupled: sliced.coupled,
            groups: groups as u32,
            arithmetic: sliced.arithmetic.len() as u32,
            free: sliced.free.len() as u32,
            sensors: sensors.len() as u32,
            stages: 1,
            iterations: [1, 1],
        };
        let Sliced { rows, slices, neighbours, conductances, radiators, tails, links, .. } = sliced;
        let Sliced { arithmetic, free, slot_of_node, .. } = sliced;
        let sensor_slots: Vec<u32> = sensors.iter().map(|sensor| slot_of_node[*sensor as usize]).collect();
        // Each table is freed after its upload.
        upload(&mut resources, &mut once, Resource::NetworkRows, rows)?;
        upload(&mut resources, &mut once, Resource::NetworkSlices, slices)?;
        upload(&mut resources, &mut once, Resource::NetworkNeighbours, neighbours)?;
        upload(&mut resources, &mut once, Resource::NetworkConductances, conductances)?;
        upload(&mut resources, &mut once, Resource::NetworkRadiators, radiators)?;
        upload(&mut resources, &mut once, Resource::NetworkTails, tails)?;
        upload(&mut resources, &mut once, Resource::NetworkLinks, links)?;
        upload(&mut resources, &mut once, Resource::NetworkArithmetic, arithmetic)?;
        upload(&mut resources, &mut once, Resource::NetworkFree, free)?;
        upload(&mut resources, &mut once, Resource::NetworkSensors, sensor_slots)?;
        resources.free_staging();
        // The heat is 0 until it is set. The padding nodes of the last slice stay at 0 K.
        let zeros = vec![[0.0f32; 2]; GROUP * groups];
        resources.write(Resource::NetworkHeat, 0, &zeros)?;
        resources.write(Resource::NetworkKept, 0, &zeros)?;
        let mut wide = Self {
            once,
            bindings: Bindings::plain(context),
            resources,
            spare,
            wrote_spare: false,
            slot_of_node,
            plan: wide_plan,
            space_temperature: network.space_temperature as f32,
            odd: false,
            counts: WorkCounts::default(),
            budgets: [Budget::balance(), Budget::stage(), Budget::steady()],
        };
        if wide_plan.coupled {
            wide.make_solver()?;
        }
        Ok(wide)
    }

    /// Makes the solver's vectors at first use. It places them in the scene's spare buffers if they fit.
    fn make_solver(&mut self) -> Result<(), GpuError> {
        let vector = (SOLVER[0].row().element * self.plan.groups as usize) as u64;
        let spare: Vec<u64> = self.spare.iter().map(|buffer| buffer.bytes).collect();
        for (resource, lodging) in SOLVER.into_iter().zip(lodgings(&spare, vector)) {
            match lodging {
                _ if self.resources.get(resource).is_some() => {}
                Some((number, offset)) => {
                    self.resources.lodge(resource, Region::lodged(&self.spare[number], offset, vector));
                }
                None => self.resources.make(resource, vector)?,
            }
        }
        Ok(())
    }

    /// Whether the solver has written to spare buffers since the last call.
    pub fn wrote_spare(&mut self) -> bool {
        std::mem::take(&mut self.wrote_spare)
    }

    /// Allocated device memory [bytes], without host-visible and spare buffers.
    pub fn device_bytes(&self) -> u64 {
        self.resources.bytes(|resource| !is_of_host(resource))
    }

    /// Device time of all submissions so far [ms]; `None` without timestamps.
    pub fn device_ms(&self) -> Option<f64> {
        self.once.device_ms()
    }

    /// Work so far.
    pub fn counts(&self) -> WorkCounts {
        self.counts
    }

    /// The recorded iterations, and the work so far.
    pub fn save(&self) -> Saved {
        let mut saved = Saved::default();
        saved.put("budgets", &self.budgets.map(Budget::words));
        saved
    }

    /// Takes what `save` gave, and work counts.
    ///
    /// # Errors
    /// Lists of another length.
    pub fn restore(&mut self, saved: &Saved, counts: WorkCounts) -> Result<(), SavedError> {
        self.budgets = saved.array::<_, 3>("budgets")?.map(Budget::from_words);
        self.counts = counts;
        Ok(())
    }

    /// Sets the heat of every node [W] and its slope [W/s].
    pub fn set_heat(&mut self, heat: &[[f32; 2]]) -> Result<(), GpuError> {
        let slots = self.in_slots(heat);
        self.resources.write(Resource::NetworkHeat, 0, &slots)
    }

    /// Reorders a pair for every node into device order.
    fn in_slots(&self, pairs: &[[f32; 2]]) -> Vec<[f32; 2]> {
        let mut slots = vec![[0.0; 2]; pairs.len()];
        for (slot, pair) in self.slot_of_node.iter().zip(pairs) {
            slots[*slot as usize] = *pair;
        }
        slots
    }

    /// Base and rest of every node in the accepted state [K].
    pub fn state(&self) -> impl Iterator<Item = [f32; 2]> + '_ {
        let slots: &[[f32; 2]] = self.resources.read(Resource::NetworkKept, 0, self.slot_of_node.len());
        self.slot_of_node.iter().map(|slot| slots[*slot as usize])
    }

    /// Replaces the accepted state.
    pub fn set_state(&mut self, state: &[[f32; 2]]) -> Result<(), GpuError> {
        let slots = self.in_slots(state);
        self.resources.write(Resource::NetworkKept, 0, &slots)
    }

    /// Accepts the state of the last attempt.
    pub fn keep(&mut self) -> Result<(), GpuError> {
        self.submit(&[WidePlan::keep(self.odd)], Constants::none())
    }

    /// Attempts sub-steps.
    pub fn attempt(&mut self, method: StepMethod, t: f64, step: f64, count: u32) -> Result<Attempt, GpuError> {
        self.plan.stages = match method {
            StepMethod::Rkl2 { stages } => stages,
            StepMethod::Euler => 1,
            StepMethod::TrBdf2 => 0,
        };
        if method == StepMethod::TrBdf2 {
            self.make_solver()?;
        }
        let solves = self.plan.coupled || method == StepMethod::TrBdf2;
        let which = usize::from(method == StepMethod::TrBdf2);
        loop {
            self.plan.iterations = self.budgets[which].iterations();
            let attempt = self.attempt_once(method, t, step, count)?;
            if !solves {
                return Ok(attempt);
            }
            let solver = self.solver();
            self.counts.iterations += solver.iterations as u64;
            if solver.lost > 0.0 {
                return Ok(Attempt { error: f64::INFINITY, ..attempt });
            }
            if self.budgets[which].was_enough(&solver) {
                return Ok(attempt);
            }
            if !self.budgets[which].grow(&solver) {
                self.budgets[which] = if which == 0 { Budget::balance() } else { Budget::stage() };
                return Ok(Attempt { error: f64::INFINITY, ..attempt });
            }
        }
    }

    fn attempt_once(&mut self, method: StepMethod, t: f64, step: f64, count: u32) -> Result<Attempt, GpuError> {
        let mut constants = Constants::new(method, t, step);
        self.odd = false;
        let mut attempt = Attempt::default();
        let passes = self.plan.sub_step(0, false).0.entries.len() as u32 / 2;
        let at_once = (PASSES_AT_MOST / passes.max(1)).clamp(1, SUB_STEPS_AT_MOST);
        for first in (0..count).step_by(at_once as usize) {
            let some = (count - first).min(at_once);
            let mut frames = if first == 0 { vec![self.plan.start()] } else { Vec::new() };
            for number in 0..some {
                let (frame, odd) = self.plan.sub_step(number, self.odd);
                self.odd = odd;
                frames.push(frame);
            }
            frames.push(self.plan.end());
            constants.time = t + f64::from(first) * step;
            self.submit(&frames, constants.clone())?;
            let sensed: &[[f32; 2]] =
                self.resources.read(Resource::NetworkSensed, 0, (self.plan.sensors * some) as usize);
            attempt.sensed.extend(sensed.iter().map(|[base, rest]| f64::from(*base) + f64::from(*rest)));
            self.counts.sub_steps += u64::from(some);
            self.counts.stages += u64::from(some) * constants.stages_of_method();
        }
        let groups = self.plan.groups as usize;
        let words = if method == StepMethod::TrBdf2 { groups } else { groups.div_ceil(WORKGROUP) };
        let errors: &[u32] = self.resources.read(Resource::NetworkErrors, 0, words);
        let largest = f32::from_bits(errors.iter().max().copied().unwrap_or(0));
        attempt.error = if largest.is_nan() { f64::INFINITY } else { f64::from(largest) };
        Ok(attempt)
    }

    /// Records and runs lists in order.
    fn submit(&mut self, lists: &[Frame], mut constants: Constants) -> Result<(), GpuError> {
        constants.radiative = self.plan.radiative;
        self.wrote_spare |= !self.spare.is_empty() && self.resources.get(SOLVER[0]).is_some();
        let passes = || lists.iter().flat_map(Frame::passes);
        self.bindings.add(&self.resources, passes())?;
        let (sensors, space_temperature) = (self.plan.sensors as usize, self.space_temperature);
        let told = |said: Said| match said {
            Said::Network(work) => bytemuck::bytes_of(&constants.of(work, sensors, space_temperature)).to_vec(),
            _ => Vec::new(),
        };
        self.once.run(lists, &self.resources, Some(&self.bindings), &told)?;
        self.counts.dispatches += passes().filter(|pass| pass.kernel().is_some()).count() as u64;
        Ok(())
    }
}

/// Uploads a table and frees its staging buffer.
fn upload<T: bytemuck::Pod>(
    resources: &mut Resources,
    once: &mut Once,
    resource: Resource,
    values: Vec<T>,
) -> Result<(), GpuError> {
    resources.upload(once, resource, &values)
}
