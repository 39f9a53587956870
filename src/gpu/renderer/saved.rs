//! The state of a scene on the device that a run needs to go on later, bit for bit.

use super::Renderer;
use crate::environment::shadow::LightAndPoses;
use crate::exchange::sky::LastFound;
use crate::gpu::effects::exchange::tables::places_of;
use crate::gpu::effects::exchange::{EMITTED, ON_NODES, RECEIVED, REFLECTED, SEEN, SUNLIGHT};
use crate::gpu::effects::light::{LIT_FRONT, LIT_X, LIT_Y, LIT_Z};
use crate::gpu::effects::network::state::OnePass;
use crate::gpu::effects::sensor::BOLOMETER;
use crate::gpu::effects::thermal::load::DeviceLoad;
use crate::gpu::effects::thermal::{ELAPSED, SPAN, TARGET, TEMPERATURE};
use crate::gpu::error::GpuError;
use crate::gpu::frame::compose;
use crate::gpu::layout::View;
use crate::gpu::request::Request;
use crate::gpu::resource::Resource;
use crate::gpu::timing::PassTimes;
use crate::thermal::misfit::{Misfit, check_length, part};
use crate::thermal::network::one_pass::{Halving, Told};
use crate::thermal::sensor::twin::SensorState;

/// Buffers with the state of the nodes, one value for each node.
static NODE_STATE: [&Resource; 8] = [&TEMPERATURE, &TARGET, &SPAN, &ELAPSED, &LIT_X, &LIT_Y, &LIT_Z, &LIT_FRONT];

/// Buffers with the state of the patches of radiation between surfaces, and how many values each patch has.
static PATCH_STATE: [(&Resource, usize); 5] =
    [(&SEEN, 2), (&REFLECTED, 4), (&SUNLIGHT, 1), (&EMITTED, 1), (&RECEIVED, 2)];

/// The saved state of a scene on the device.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub struct RendererState {
    /// Buffers by the names of their resources.
    buffers: Vec<(String, Vec<f32>)>,
    network: Option<OnePassProgress>,
    sensor: Option<SensorState<f32>>,
    commanded: Option<DeviceLoad>,
    light: Option<LightAndPoses>,
    exchange: Option<LastFound>,
    culled: Vec<[Option<View>; 2]>,
    fused_steps: u64,
    times: PassTimes,
}

/// The saved state of a network in one pass, apart from its buffers.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
struct OnePassProgress {
    odd: bool,
    age: u32,
    halving: Halving,
    told: Told,
    told_steps: u64,
    on: Vec<bool>,
    /// Length of the last step [s].
    step: f64,
}

impl RendererState {
    /// A buffer of the state, by the name of its resource.
    pub fn buffer(&self, name: &str) -> Option<&[f32]> {
        self.buffers.iter().find(|(known, _)| known == name).map(|(_, values)| values.as_slice())
    }

    /// The state of the sensor.
    pub(crate) fn sensor_mut(&mut self) -> &mut Option<SensorState<f32>> {
        &mut self.sensor
    }

    /// Forgets what belongs to one run only: measured times, counts of work, and triangles culled for its camera.
    pub(crate) fn forget_run(&mut self) {
        self.culled.clear();
        self.fused_steps = 0;
        self.times.clear();
    }
}

impl Renderer {
    /// The state between two steps. No frame is in flight afterwards.
    ///
    /// # Errors
    /// A call that fails.
    pub fn save(&mut self) -> Result<RendererState, GpuError> {
        self.wait()?;
        let mut buffers = Vec::new();
        for (resource, count) in self.state_buffers() {
            let mut values = self.resources.download(&mut self.once, resource, count)?;
            if let Some((order, each)) = self.order_of(resource) {
                values = taken(&values, &places_of(order), each);
            }
            buffers.push((resource.name.to_owned(), values));
        }
        let sensor = match &self.scene.sensor {
            Some(sensor) => {
                let count = 2 * sensor.padded_pixels();
                let bolometer = self.resources.get(&BOLOMETER).is_some();
                let mut signal = || self.resources.download(&mut self.once, &BOLOMETER, count);
                Some(SensorState { signal: if bolometer { signal()? } else { Vec::new() }, last: sensor.last })
            }
            None => None,
        };
        Ok(RendererState {
            buffers,
            network: self.scene.network.as_ref().map(|network| OnePassProgress {
                odd: network.odd,
                age: network.age,
                halving: network.halvings.now,
                told: network.told,
                told_steps: network.told_steps,
                on: network.on.clone(),
                step: network.plan.step(),
            }),
            sensor,
            commanded: self.scene.commanded.clone(),
            light: self.scene.light.as_ref().and_then(|light| light.redraw.found_for.clone()),
            exchange: self.scene.exchange.as_ref().map(|exchange| exchange.renewal.last.clone()),
            culled: self.scene.culling.save(),
            fused_steps: self.fused_steps,
            times: self.pass_times().clone(),
        })
    }

    /// Takes a saved state.
    ///
    /// # Errors
    /// A state of another scene, or a call that fails.
    pub fn restore(&mut self, saved: &RendererState) -> Result<(), GpuError> {
        self.wait()?;
        for (resource, count) in self.state_buffers() {
            let values = saved.buffer(resource.name).ok_or_else(|| Misfit::Absent(resource.name.to_owned()))?;
            check_length(resource.name, values, count)?;
            match self.order_of(resource).map(|(order, each)| taken(values, order, each)) {
                Some(values) => self.resources.upload(&mut self.once, resource, &values)?,
                None => self.resources.upload(&mut self.once, resource, values)?,
            }
        }
        if let Some(network) = &mut self.scene.network {
            let saved = part("a network in one pass", &saved.network)?;
            check_length("thermostats", &saved.on, network.on.len())?;
            let plan = network.plans.over(saved.step, 1).0;
            network.take(plan);
            network.on.clone_from(&saved.on);
            (network.odd, network.age) = (saved.odd, saved.age);
            network.halvings.now = network.halvings.now.with_decisions_of(saved.halving);
            (network.told, network.told_steps) = (saved.told, saved.told_steps);
        }
        self.upload_plan()?;
        if let Some(exchange) = &mut self.scene.exchange {
            exchange.renewal.last = part("radiation between surfaces", &saved.exchange)?.clone();
            exchange.fresh = false;
        }
        if let Some(sensor) = &mut self.scene.sensor {
            // A state of a scene without a sensor: the first image has settled, as without a state.
            sensor.last = saved.sensor.as_ref().and_then(|saved| saved.last);
            if let Some(saved) = &saved.sensor
                && self.resources.get(&BOLOMETER).is_some()
            {
                check_length("signals of the sensor", &saved.signal, 2 * sensor.padded_pixels())?;
                self.resources.upload(&mut self.once, &BOLOMETER, &saved.signal)?;
            }
        }
        self.resources.free_staging();
        self.scene.commanded.clone_from(&saved.commanded);
        if let Some(light) = &mut self.scene.light {
            light.redraw.found_for.clone_from(&saved.light);
        }
        self.scene.culling.restore(&saved.culled);
        self.fused_steps = saved.fused_steps;
        self.cull_again()?;
        let most = self.slots.most_times;
        self.slots.times.clone_from(&saved.times);
        self.slots.times.values_mut().for_each(|times| times.bound(most));
        Ok(())
    }

    /// Buffers with the state between two steps, and their counts of numbers.
    fn state_buffers(&self) -> Vec<(&'static Resource, usize)> {
        let mut buffers: Vec<_> = NODE_STATE.map(|resource| (resource, self.nodes)).into();
        buffers.extend(self.scene.network.iter().flat_map(OnePass::state));
        if let Some(exchange) = &self.scene.exchange {
            buffers.extend(PATCH_STATE.map(|(resource, each)| (resource, each * exchange.places())));
            buffers.push((&ON_NODES, 2 * self.nodes));
        }
        buffers.retain(|(resource, _)| self.resources.get(resource).is_some());
        buffers
    }

    /// The order of the patches on the device, and the number of values of each, where a buffer has values of patches. A state holds them by patch: the order follows the
    /// first pose of a run, and a run that goes on may begin in another.
    fn order_of(&self, resource: &Resource) -> Option<(&[u32], usize)> {
        let (_, each) = PATCH_STATE.iter().find(|(own, _)| own.name == resource.name)?;
        Some((&self.scene.exchange.as_ref()?.order, *each))
    }

    /// Culls the triangles anew from the views of the last culling, whose result lies on the device only. The image of this frame is not used,
    /// and no rays are sent for it.
    fn cull_again(&mut self) -> Result<(), GpuError> {
        if self.scene.sampled.is_some_and(|sampled| sampled.gathered > 1) {
            // Every sample has triangles of its own, and only a crop holds them from image to image.
            self.scene.culling.forget();
        }
        let Some((views, culled)) = self.scene.culling.last_culled(self.scene.joints) else { return Ok(()) };
        let frame = compose(&self.scene.drawn_recipe(self.scene.sampled, 0, culled, None));
        let submitted = self.send(&frame, Request { views: &views, ..Request::default() })?;
        self.collect(submitted).map(|_| ())
    }

    /// Bounds the measured times that are kept of each pass, and times only some of the frames, because timestamps lengthen a step.
    pub(crate) fn keep_few_times(&mut self, most: usize) {
        self.slots.time_few = true;
        self.slots.most_times = most;
        self.slots.times.values_mut().for_each(|times| times.bound(most));
    }
}

/// The values of a buffer in another order: `of` has the place from which the values of each place come. The last place has no patch and stays.
fn taken(values: &[f32], of: &[u32], each: usize) -> Vec<f32> {
    let moved = of.iter().flat_map(|place| &values[*place as usize * each..][..each]);
    moved.chain(&values[of.len() * each..]).copied().collect()
}
