//! The simulation of a page at the ends of steps: forward by steps, back by kept states.

use std::sync::atomic::AtomicBool;

use glam::{DVec2, DVec3};

use super::kept::Kept;
use super::probe_place::posed;
use crate::model::nodes::GROUP;
use crate::output::state_file::size;
use crate::simulation::facade::Simulation;
use crate::simulation::facade_error::SimulationError;
use crate::simulation::image::Image;
use crate::simulation::thermal_state::ThermalState;

/// Memory for states to which time can go back, and for temperatures of which curves are drawn [bytes].
const MEMORY: usize = 256 << 20;

/// States that are kept of a run where memory allows.
const STATES: u32 = 64;

/// A node whose temperature is drawn over time.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub(crate) struct PlottedNode {
    pub(crate) id: u64,
    /// Name of the probe in the scene, or the name of the node's part.
    pub(crate) name: String,
    pub(crate) material: String,
    /// Vertex of the model, with the scene's node density.
    pub(crate) node: usize,
}

/// The part and depth of an image's pixels, to find the node at a pixel.
pub(crate) struct ShownImage {
    image: Image,
}

impl ShownImage {
    /// Keeps the lists of an image that a later question needs.
    pub(crate) fn new(image: Image) -> Self {
        let unneeded = (Vec::new(), Vec::new(), Vec::new());
        let image = Image { radiance: unneeded.0, temperature: unneeded.1, coverage: unneeded.2, ..image };
        Self { image }
    }
}

/// A simulation that stands at the end of a step, or at time 0.
pub(crate) struct Player {
    simulation: Simulation,
    step: u32,
    states: Kept<ThermalState>,
    temperatures: Kept<Vec<f32>>,
    probes: Vec<PlottedNode>,
    next_probe: u64,
    /// Host time of the last step [ms].
    step_ms: f64,
}

impl Player {
    /// Takes a simulation at time 0.
    ///
    /// # Errors
    /// A call that fails.
    pub(crate) fn new(simulation: Simulation) -> Result<Self, SimulationError> {
        let every = (simulation.prepared().scene.time.steps / STATES).max(1);
        let mut player = Self {
            simulation,
            step: 0,
            states: Kept::new(every, MEMORY),
            temperatures: Kept::new(1, MEMORY),
            probes: Vec::new(),
            next_probe: 0,
            step_ms: 0.0,
        };
        let prepared = player.simulation.prepared();
        let listed = prepared.scene.probes.iter().zip(&prepared.probes);
        let probes: Vec<(String, usize)> = listed.map(|(probe, slot)| (probe.name.clone(), *slot)).collect();
        for (name, slot) in probes {
            player.add(slot, Some(name));
        }
        player.keep()?;
        Ok(player)
    }

    pub(crate) fn simulation(&mut self) -> &mut Simulation {
        &mut self.simulation
    }

    /// Number of the present step.
    pub(crate) fn step(&self) -> u32 {
        self.step
    }

    pub(crate) fn steps(&self) -> u32 {
        self.simulation.prepared().scene.time.steps
    }

    /// The step whose end is nearest to a time [s]. `None` outside the scene.
    pub(crate) fn step_at(&self, time: f64) -> Option<u32> {
        let length = self.simulation.prepared().scene.time.step;
        let step = (time / length).round();
        (0.0..=f64::from(self.steps())).contains(&step).then_some(step as u32)
    }

    /// Host time of the last step [ms].
    pub(crate) fn step_ms(&self) -> f64 {
        self.step_ms
    }

    /// Goes towards a step: back to the last kept state before it, or one step on. Returns whether it is there.
    ///
    /// # Errors
    /// A call that fails.
    pub(crate) fn towards(&mut self, goal: u32, stop: &AtomicBool) -> Result<bool, SimulationError> {
        let nearer = self.states.before(goal).filter(|(step, _)| self.step > goal || *step > self.step);
        if let Some((step, saved)) = nearer {
            self.simulation.restore(saved)?;
            self.step = step;
        }
        if self.step < goal {
            let length = self.simulation.prepared().scene.time.step;
            let began = std::time::Instant::now();
            if self.simulation.step_to_with(f64::from(self.step + 1) * length, stop, &mut || ())? {
                self.step += 1;
                self.step_ms = began.elapsed().as_secs_f64() * 1e3;
                self.keep()?;
            }
        }
        Ok(self.step == goal)
    }

    fn keep(&mut self) -> Result<(), SimulationError> {
        if self.temperatures.wants(self.step) {
            let temperatures = self.simulation.node_temperatures()?;
            let bytes = size_of_val(&*temperatures);
            self.temperatures.keep(self.step, temperatures, bytes);
        }
        if self.states.wants(self.step) {
            let saved = self.simulation.save()?;
            let bytes = size(&saved);
            self.states.keep(self.step, saved, bytes);
        }
        Ok(())
    }

    pub(crate) fn probes(&self) -> &[PlottedNode] {
        &self.probes
    }

    /// Times [s] and temperatures [K] of a probe at all steps that are kept.
    pub(crate) fn curve(&self, probe: &PlottedNode) -> Vec<(f64, f32)> {
        let length = self.simulation.prepared().scene.time.step;
        let point = |(step, all): (u32, &Vec<f32>)| (f64::from(step) * length, all[probe.node]);
        self.temperatures.all().map(point).collect()
    }

    /// Present temperatures of the probes [K], if this step is kept.
    pub(crate) fn present(&self) -> Option<Vec<f32>> {
        let (_, all) = self.temperatures.before(self.step).filter(|(step, _)| *step == self.step)?;
        Some(self.probes.iter().map(|probe| all[probe.node]).collect())
    }

    /// Adds a probe at the node nearest to the point at a pixel. Returns whether there is one.
    pub(crate) fn add_at(&mut self, shown_image: &ShownImage, x: u32, y: u32) -> bool {
        let node = self.node_at(&shown_image.image, x, y);
        if let Some(slot) = node {
            self.add(slot, None);
        }
        node.is_some()
    }

    /// Removes a probe. Returns whether there was one.
    pub(crate) fn remove(&mut self, id: u64) -> bool {
        let before = self.probes.len();
        self.probes.retain(|probe| probe.id != id);
        self.probes.len() < before
    }

    fn add(&mut self, slot: usize, name: Option<String>) {
        let prepared = self.simulation.prepared();
        let group = slot / GROUP;
        let material = prepared.materials[prepared.nodes.group_material[group] as usize].name.clone();
        let part = prepared.parts[prepared.nodes.group_part[group] as usize].clone();
        let node = prepared.nodes.vertex_of_node[slot] as usize;
        self.probes.push(PlottedNode { id: self.next_probe, name: name.unwrap_or(part), material, node });
        self.next_probe += 1;
    }

    /// The node nearest to the point at a pixel, among the nodes of the part there.
    fn node_at(&self, image: &Image, x: u32, y: u32) -> Option<usize> {
        let [width, height] = image.size();
        if x >= width || y >= height {
            return None;
        }
        let pixel = (y * width + x) as usize;
        let part = image.part.get(pixel)?.checked_sub(1)?;
        let ray = image.camera.lens.unproject(DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5))?;
        let depth = f64::from(image.depth[pixel]);
        let point = image.camera_from_body.inverse().transform_point3(DVec3::new(ray.x, ray.y, 1.0) * depth);
        let prepared = self.simulation.prepared();
        let joints = prepared.loads.joints_at(image.time).1;
        let nodes = &prepared.nodes;
        let of_part = nodes.node_of_vertex.iter().map(|slot| *slot as usize);
        let of_part = of_part.filter(|slot| nodes.group_part[slot / GROUP] == part);
        let distance = |slot: usize| posed(nodes, &joints, slot).distance_squared(point);
        of_part.map(|slot| (slot, distance(slot))).min_by(|a, b| a.1.total_cmp(&b.1)).map(|(slot, _)| slot)
    }
}
