//! The state of a scene on the device that a run needs to go on later, bit for bit.

use super::Renderer;
use crate::environment::shadow::Redraw;
use crate::gpu::effects::light::VISIBILITY;
use crate::gpu::effects::sensor::BOLOMETER;
use crate::gpu::effects::thermal::load::DeviceLoad;
use crate::gpu::effects::thermal::{ELAPSED, SPAN, TARGET, TEMPERATURE};
use crate::gpu::error::GpuError;
use crate::gpu::frame::compose;
use crate::gpu::layout;
use crate::gpu::request::Request;
use crate::gpu::resource::Resource;
use crate::gpu::samples::Samples;
use crate::gpu::timing::PassTimes;
use crate::saved::{Saved, SavedError};
use crate::thermal::network::one_pass::{HALVINGS_AT_MOST, Halving, Told};

/// Buffers with the state of the nodes, one value for each node.
static NODE_STATE: [(&Resource, &str); 5] = [
    (&TEMPERATURE, "temperature"),
    (&TARGET, "target"),
    (&SPAN, "span"),
    (&ELAPSED, "elapsed"),
    (&VISIBILITY, "visibility"),
];

impl Renderer {
    /// The state between two steps. No frame is in flight afterwards.
    ///
    /// # Errors
    /// A call that fails.
    pub fn save(&mut self) -> Result<Saved, GpuError> {
        self.wait()?;
        let mut saved = Saved::default();
        for (resource, name) in NODE_STATE {
            if self.resources.get(resource).is_some() {
                let values: Vec<f32> = self.resources.download(&mut self.once, resource, self.nodes)?;
                saved.put(name, &values);
            }
        }
        if let Some(network) = &self.scene.network {
            for (resource, name, count) in network.state() {
                if self.resources.get(resource).is_some() {
                    let values: Vec<f32> = self.resources.download(&mut self.once, resource, count)?;
                    saved.put(name, &values);
                }
            }
            saved.put_flags("one_pass.flags", &[network.odd]);
            let Halving { count, since, exceeded, most, .. } = network.halving;
            saved.put("one_pass.counts", &[network.age, count, since, exceeded, most]);
            let Told { squares, count, most, node } = network.told;
            saved.put("one_pass.told_before", &[squares, most]);
            saved.put("one_pass.told_counts", &[count, node as u64, network.told_steps]);
            saved.put_flags("one_pass.on", &network.on);
            saved.put("one_pass.step", &[network.plan.step()]);
        }
        if let Some(sensor) = &self.scene.sensor {
            if self.resources.get(&BOLOMETER).is_some() {
                let count = sensor.padded_pixels();
                saved.put("sensor.bolometer", &self.resources.download::<f32>(&mut self.once, &BOLOMETER, count)?);
            }
            saved.put("sensor.last", &[sensor.last.unwrap_or(f64::NAN)]);
        }
        if let Some(load) = &self.scene.commanded {
            saved.put_all("commanded", load.save());
        }
        if let Some(redraw) = &self.scene.light.redraw {
            saved.put_all("shadows", redraw.save());
        }
        if let Some(exchange) = &self.scene.exchange {
            saved.put_all("exchange", exchange.save());
            saved.put("exchange.seen", &self.seen()?);
            let (reflected, sunlight) = self.exchanged_light()?;
            let received = self.received_at_places()?;
            saved.put("exchange.reflected", &reflected);
            saved.put("exchange.sunlight", &sunlight);
            saved.put("exchange.received", &received);
        }
        saved.put("culled", &self.scene.culling.save());
        saved.put("fused_steps", &[self.fused_steps]);
        saved.put("pass_names", self.pass_times().keys().cloned().collect::<Vec<_>>().join("\n").as_bytes());
        for (number, times) in self.pass_times().values().enumerate() {
            saved.put(format!("pass.{number}"), times);
            saved.put(format!("pass_counts.{number}"), &[times.count(), times.every()]);
        }
        Ok(saved)
    }

    /// Takes a saved state.
    ///
    /// # Errors
    /// A state of another scene, or a call that fails.
    pub fn restore(&mut self, saved: &Saved) -> Result<(), GpuError> {
        self.wait()?;
        let mut lists = Vec::new();
        for (resource, name) in NODE_STATE {
            if self.resources.get(resource).is_some() {
                lists.push((resource, saved.list_of::<f32>(name, self.nodes)?));
            }
        }
        if let Some(network) = &mut self.scene.network {
            for (resource, name, count) in network.state() {
                if self.resources.get(resource).is_some() {
                    lists.push((resource, saved.list_of::<f32>(name, count)?));
                }
            }
            let [step] = saved.array("one_pass.step")?;
            let plan = network.plans.over(step, 1).0;
            network.take(plan);
            network.on = saved.flags("one_pass.on")?;
            let flags = saved.flags("one_pass.flags")?;
            network.odd = flags.first() == Some(&true);
            let halving = &mut network.halving;
            [network.age, halving.count, halving.since, halving.exceeded, halving.most] =
                saved.array("one_pass.counts")?;
            halving.count = halving.count.min(HALVINGS_AT_MOST);
            let [squares, most] = saved.array("one_pass.told_before")?;
            let [count, node, steps] = saved.array::<u64, 3>("one_pass.told_counts")?;
            network.told = Told { squares, count, most, node: node as usize };
            network.told_steps = steps;
        }
        self.upload_plan()?;
        self.restore_exchange(&saved.part("exchange"))?;
        if let Some(sensor) = &mut self.scene.sensor {
            if self.resources.get(&BOLOMETER).is_some() {
                lists.push((&BOLOMETER, saved.list_of::<f32>("sensor.bolometer", sensor.padded_pixels())?));
            }
            let [last] = saved.array::<f64, 1>("sensor.last")?;
            sensor.last = Some(last).filter(|last| !last.is_nan());
        }
        for (resource, values) in lists {
            self.resources.upload(&mut self.once, resource, &values)?;
        }
        self.resources.free_staging();
        self.restore_host(saved)?;
        self.cull_again()?;
        self.slots.times = times_of(saved, self.slots.most_times)?;
        Ok(())
    }

    fn restore_host(&mut self, saved: &Saved) -> Result<(), SavedError> {
        let commanded = saved.part("commanded");
        self.scene.commanded = if saved.has("commanded.steps") { Some(DeviceLoad::restore(&commanded)?) } else { None };
        if let Some(redraw) = &mut self.scene.light.redraw {
            *redraw = Redraw { found_for: Redraw::found_for(&saved.part("shadows"))?, ..redraw.clone() };
        }
        self.scene.culling.restore(&saved.list("culled")?);
        [self.fused_steps] = saved.array("fused_steps")?;
        Ok(())
    }

    /// Culls the triangles anew from the views of the last culling, whose result lies on the device only. The image of this frame is not used,
    /// and no rays are sent for it.
    fn cull_again(&mut self) -> Result<(), GpuError> {
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

fn times_of(saved: &Saved, most: usize) -> Result<PassTimes, SavedError> {
    let names = saved.text("pass_names")?;
    let one = |(number, name): (usize, &str)| {
        let [count, every] = saved.array(&format!("pass_counts.{number}"))?;
        let times = Samples::again(saved.list(&format!("pass.{number}"))?, most, every, count);
        Ok((name.to_owned(), times))
    };
    names.lines().enumerate().map(one).collect()
}

impl DeviceLoad {
    fn save(&self) -> Saved {
        let mut saved = Saved::default();
        saved.put("steps", &self.steps);
        saved.put("samples", &self.samples);
        if let Some(albedo) = &self.albedo {
            saved.put("albedo", albedo);
        }
        saved
    }

    fn restore(saved: &Saved) -> Result<Self, SavedError> {
        Ok(Self {
            steps: saved.list::<layout::Step>("steps")?,
            samples: saved.list("samples")?,
            albedo: if saved.has("albedo") { Some(saved.list("albedo")?) } else { None },
        })
    }
}
