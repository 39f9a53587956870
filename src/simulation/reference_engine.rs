//! The f64 reference as an engine: the twins of the device functions, and a rasteriser in f64.

use std::collections::VecDeque;

use glam::DVec3;

use super::engine::{Delivered, Engine, EngineError, Order, Pixels, Step};
use super::network::NetworkRun;
use super::prepare::Prepared;
use super::surroundings::Finishes;
use super::viewpoint::raster_view;
use crate::environment::StepLoad;
use crate::environment::shadow::{Jointed, Shadows};
use crate::gpu::nodes::{GROUP, PADDING};
use crate::raster::{self, Around, Surface, rasterise};
use crate::saved::Saved;
use crate::scene::Camera;
use crate::thermal::incident::{IncidentFunction, incident};
use crate::thermal::radiance::{RadianceTable, band_radiance};
use crate::thermal::reference::Reference;
use crate::trace::{Trace, Track};

/// The f64 reference of all nodes, and its rasteriser.
pub struct ReferenceEngine {
    reference: Reference<IncidentFunction>,
    shadows: Option<Shadows>,
    node_of_slot: Vec<u32>,
    slots: usize,
    /// The surface that is drawn, in the file's pose.
    surface: Jointed,
    /// Normals of the surface, in the file's pose. Empty where it reflects nothing.
    normals: Vec<DVec3>,
    finishes: Finishes,
    parts: Vec<u32>,
    materials: Vec<u32>,
    emissivities: Vec<[f64; 2]>,
    network: Option<NetworkRun>,
    steps: u64,
    camera: Option<Camera>,
    table: RadianceTable,
    delivered: VecDeque<Delivered>,
    trace: Trace,
}

impl ReferenceEngine {
    /// The scene on the reference. Images are drawn where `camera` is given.
    pub fn new(prepared: &Prepared, camera: Option<&Camera>) -> Self {
        let nodes = &prepared.nodes;
        let node_of_slot: Vec<u32> = (0..nodes.vertex_of_node.len() as u32)
            .filter(|slot| nodes.vertex_of_node[*slot as usize] != PADDING)
            .collect();
        let of_group = |group: &[u32]| (0..nodes.vertex_of_node.len()).map(|slot| group[slot / GROUP]).collect();
        let moves = prepared.joints() > 1;
        let own_joints = |slots: &[u32]| {
            if moves { prepared.joints_of(slots.iter().map(|slot| *slot as usize)) } else { Vec::new() }
        };
        let joints = own_joints(&node_of_slot);
        let position_joints = own_joints(&(0..nodes.vertex_of_node.len() as u32).collect::<Vec<_>>());
        let reference_nodes = node_of_slot.iter().map(|slot| nodes.reference_node(*slot as usize)).collect();
        let finishes = Finishes::new(prepared);
        let reflects = !finishes.reflectors.is_empty();
        let normals = nodes.normals.iter().filter(|_| reflects).map(|normal| normal.as_dvec3()).collect();
        Self {
            normals,
            finishes,
            reference: Reference::new(reference_nodes, prepared.materials.clone(), incident as IncidentFunction)
                .with_joints(joints),
            shadows: prepared.shadows(node_of_slot.iter().map(|slot| *slot as usize)),
            slots: nodes.vertex_of_node.len(),
            node_of_slot,
            surface: Jointed {
                positions: nodes.positions.iter().map(|position| position.as_dvec3()).collect(),
                triangles: prepared.triangles.clone(),
                joints: position_joints,
            },
            parts: of_group(&nodes.group_part),
            materials: of_group(&nodes.group_material),
            emissivities: prepared
                .materials
                .iter()
                .map(|material| [material.front.emissivity, material.back().emissivity])
                .collect(),
            network: prepared.network.as_ref().map(NetworkRun::reference),
            steps: 0,
            camera: camera.cloned(),
            table: RadianceTable::new(prepared.scene.band),
            delivered: VecDeque::new(),
            trace: Trace::default(),
        }
    }

    /// Heat of the network's nodes [W]. Empty without a network.
    fn heat(&self, load: &StepLoad) -> Vec<f64> {
        let Some(network) = &self.network else { return Vec::new() };
        let absorbed = self.reference.absorbed(load);
        let mut of_slot = vec![0.0; self.slots];
        for (slot, absorbed) in self.node_of_slot.iter().zip(absorbed) {
            of_slot[*slot as usize] = absorbed;
        }
        network.scene().heat(|slot| of_slot[slot])
    }

    fn take_network(&mut self) -> Result<(), EngineError> {
        let Some(network) = &mut self.network else { return Ok(()) };
        let temperatures = network.temperatures()?;
        let mut of_slot = vec![f64::NAN; self.slots];
        network.scene().scatter(&temperatures, |slot, temperature| of_slot[slot] = temperature);
        for (node, slot) in self.node_of_slot.iter().enumerate() {
            if !of_slot[*slot as usize].is_nan() {
                self.reference.set_temperature(node, of_slot[*slot as usize]);
            }
        }
        Ok(())
    }
}

impl Engine for ReferenceEngine {
    fn record(&mut self, trace: Trace) {
        self.trace = trace;
    }

    fn trace(&self) -> Trace {
        self.trace.clone()
    }

    fn device_name(&self) -> String {
        "cpu (f64 reference)".to_owned()
    }

    fn settle(&mut self, load: &StepLoad, time: f64) -> Result<(), EngineError> {
        self.reference.find_shadows(&mut self.shadows, load);
        self.reference.settle(load);
        let heat = self.heat(load);
        match &mut self.network {
            Some(network) => network.settle(heat, time)?,
            None => return Ok(()),
        }
        self.take_network()
    }

    fn settle_at(&mut self, temperature: f64, _nodes: usize) -> Result<(), EngineError> {
        self.reference.settle_at(temperature);
        self.network.as_mut().map_or(Ok(()), |network| network.settle_at(temperature))
    }

    fn submit(&mut self, step: Option<Step<'_>>, order: Order<'_>) -> Result<(), EngineError> {
        let trace = self.trace.clone();
        let _computes = trace.span(Track::Host, "f64 reference");
        if let Some(step) = step {
            self.steps += 1;
            self.reference.find_shadows(&mut self.shadows, step.load);
            self.reference.step(step.load, step.steps);
            if let Some(network) = &mut self.network {
                network.step_begins();
            }
            let heat = self.heat(step.load);
            if let Some(network) = &mut self.network {
                network.step(heat, step.start, step.length)?;
            }
            self.take_network()?;
            if let Some(network) = &mut self.network {
                network.step_ends();
            }
        }
        let mut temperatures = vec![0.0f64; self.slots];
        for (slot, temperature) in self.node_of_slot.iter().zip(self.reference.temperatures()) {
            temperatures[*slot as usize] = *temperature;
        }
        let pixels = order.pose.as_ref().zip(self.camera.as_ref()).map(|(pose, camera)| {
            let placed;
            let positions = if self.surface.joints.is_empty() {
                &self.surface.positions
            } else {
                placed = self.surface.placed(order.joints);
                &placed
            };
            let turned: Vec<DVec3>;
            let normals = if self.surface.joints.is_empty() {
                &self.normals
            } else {
                let joints = self.surface.joints.iter();
                let turn = |(normal, joint): (&DVec3, &u32)| order.joints[*joint as usize].matrix3 * *normal;
                turned = self.normals.iter().zip(joints).map(turn).collect();
                &turned
            };
            let (background, apart) = (self.finishes.has_background(), self.finishes.is_apart());
            let Finishes { reflectors, lobes, .. } = &mut self.finishes;
            let lobes = order.surroundings.map_or(&[][..], |around| lobes.before(around.planet));
            let around = order.surroundings.as_ref().map(|surroundings| Around {
                surroundings,
                background,
                normals,
                reflectors,
                lobes,
            });
            let surface = Surface {
                around,
                positions,
                triangles: &self.surface.triangles,
                temperatures: &temperatures,
                vertex_part: &self.parts,
                vertex_material: &self.materials,
                emissivities: &self.emissivities,
            };
            let drawn = rasterise(&surface, &raster_view(camera, pose), |t| band_radiance(&self.table, t));
            let value = |pixel: &raster::Pixel| match pixel.part {
                0 => [pixel.radiance as f32, 0.0, 0.0],
                _ => [pixel.radiance as f32, pixel.temperature as f32, pixel.depth as f32],
            };
            Pixels {
                radiance_temperature_depth: drawn.iter().map(value).collect(),
                identity: drawn.iter().map(|pixel| [pixel.part, pixel.material]).collect(),
                reflected: drawn.iter().filter(|_| apart).map(|pixel| pixel.reflected as f32).collect(),
            }
        });
        let temperatures = order.temperatures.then(|| temperatures.iter().map(|t| *t as f32).collect());
        self.delivered.push_back(Delivered { pixels, temperatures });
        Ok(())
    }

    fn deliver(&mut self) -> Result<Delivered, EngineError> {
        Ok(self.delivered.pop_front().unwrap_or_default())
    }

    fn steps(&self) -> u64 {
        self.steps
    }

    fn save(&mut self) -> Result<Saved, EngineError> {
        let mut saved = Saved::default();
        saved.put("steps", &[self.steps]);
        saved.put_all("nodes", self.reference.save());
        if let Some(shadows) = &self.shadows {
            saved.put_all("shadows", shadows.save());
        }
        if let Some(network) = &mut self.network {
            saved.put_all("network", network.save()?);
        }
        Ok(saved)
    }

    fn restore(&mut self, saved: &Saved, most_times: usize) -> Result<(), EngineError> {
        self.reference.restore(&saved.part("nodes"))?;
        if let Some(shadows) = &mut self.shadows {
            shadows.restore(&saved.part("shadows"))?;
        }
        if let Some(network) = &mut self.network {
            network.restore(&saved.part("network"), most_times)?;
        }
        [self.steps] = saved.array("steps")?;
        Ok(())
    }

    fn network(&self) -> Option<&NetworkRun> {
        self.network.as_ref()
    }

    fn network_mut(&mut self) -> Option<&mut NetworkRun> {
        self.network.as_mut()
    }
}
