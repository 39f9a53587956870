//! The f64 reference as an engine: the twins of the device functions, and a rasteriser in f64.

use std::borrow::Cow;
use std::collections::VecDeque;
use std::sync::Arc;

use glam::{DAffine3, DVec3};

use super::device_data::is_own;
use super::distant::DistantParts;
use super::energy::{absorbed_heat, heat_tables};
use super::engine::{Delivered, Engine, EngineError, EngineStep, InstantPoses, Order, Pixels, RowMoments};
use super::exchange::ExchangeTwin;
use super::given::GivenTemperatures;
use super::network::NetworkRun;
use super::pose::draws_alike;
use super::prepare::Prepared;
use super::surroundings::Finishes;
use super::viewpoint::{raster_view, sensor_view};
use crate::environment::StepLoad;
use crate::environment::shadow::{Jointed, ShadowCasters};
use crate::gpu::effects::heat::tables::HeatTables;
use crate::model::nodes::{GROUP, PADDING};
use crate::raster::distant::gather;
use crate::raster::{self, RasterSurface, SurfaceSurroundings, rasterise};
use crate::saved::Saved;
use crate::scene::Camera;
use crate::thermal::between::between;
use crate::thermal::incident::{IncidentFunction, incident};
use crate::thermal::radiance::{RadianceTable, band_radiance};
use crate::thermal::reference::Reference;
use crate::thermal::sensor::twin::SensorTwin;
use crate::thermal::surroundings::Surroundings;
use crate::trace::{Trace, Track};

/// The f64 reference of all nodes, and its rasteriser.
pub struct ReferenceEngine {
    reference: Reference<IncidentFunction>,
    shadows: Option<ShadowCasters>,
    exchange: Option<ExchangeTwin>,
    node_of_slot: Vec<u32>,
    slots: usize,
    /// Temperatures before the last step, where images lie between steps [K].
    earlier: Vec<f64>,
    /// The surface that is drawn, in the file's pose.
    surface: Jointed,
    /// Normals of the surface, in the file's pose. Empty where no pixel needs them.
    normals: Vec<DVec3>,
    finishes: Finishes,
    /// The boxes of a craft that may be far away.
    distance: Option<DistantParts>,
    parts: Vec<u32>,
    materials: Vec<u32>,
    emissivities: Vec<[f64; 2]>,
    network: Option<NetworkRun>,
    /// Temperatures of a file.
    given: Option<Arc<GivenTemperatures>>,
    heat: HeatTables,
    steps: u64,
    camera: Option<Camera>,
    table: RadianceTable,
    sensor: Option<SensorTwin>,
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
        let has_normals = !finishes.reflectors.is_empty();
        let shown = if finishes.crinkled.is_empty() { &nodes.normals } else { &finishes.crinkled };
        let normals = shown.iter().filter(|_| has_normals).map(|normal| normal.as_dvec3()).collect();
        Self {
            normals,
            finishes,
            distance: camera.and_then(|camera| DistantParts::new(prepared, camera)),
            reference: Reference::new(reference_nodes, prepared.materials.clone(), incident as IncidentFunction)
                .with_joints(joints),
            shadows: prepared.shadows(node_of_slot.iter().map(|slot| *slot as usize)),
            exchange: prepared
                .exchange
                .as_ref()
                .map(|craft| ExchangeTwin::new(craft, &prepared.loads.joints_at(0.0).1)),
            slots: nodes.vertex_of_node.len(),
            earlier: Vec::new(),
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
            given: prepared.given.clone(),
            heat: heat_tables(prepared),
            steps: 0,
            camera: camera.cloned(),
            sensor: prepared.scene.sensor.as_ref().zip(camera).filter(|_| is_own(prepared, camera)).map(
                |(sensor, camera)| {
                    SensorTwin::new(sensor, &RadianceTable::new(prepared.scene.band), sensor_view(camera))
                },
            ),
            table: RadianceTable::new(prepared.scene.band),
            delivered: VecDeque::new(),
            trace: Trace::default(),
        }
    }

    /// Heat of the network's nodes under a load [W], without that of heaters and of other surfaces. Empty without a network.
    pub(crate) fn network_heat(&mut self, load: &StepLoad) -> Vec<f64> {
        self.reference.find_shadows(&mut self.shadows, load);
        self.heat(load)
    }

    /// Heat of the network's nodes [W]. Empty without a network.
    fn heat(&self, load: &StepLoad) -> Vec<f64> {
        let Some(network) = &self.network else { return Vec::new() };
        let flux = self.flux(load);
        network.scene().heat(|slot| flux[slot])
    }

    /// Flux that every node of the device absorbs [W/m2].
    fn flux(&self, load: &StepLoad) -> Vec<f64> {
        let mut of_slot = vec![0.0; self.slots];
        for (slot, absorbed) in self.node_of_slot.iter().zip(self.reference.absorbed(load)) {
            of_slot[*slot as usize] = absorbed;
        }
        of_slot
    }

    /// Finds what nodes receive from the craft in a step.
    fn exchange(&mut self, load: &StepLoad, steps: f64) {
        let Some(exchange) = &mut self.exchange else { return };
        let mut of_slot = vec![[0.0, 0.0]; self.slots];
        let nodes = self.reference.temperatures().iter().zip(self.reference.visibility());
        for (slot, (temperature, visibility)) in self.node_of_slot.iter().zip(nodes) {
            of_slot[*slot as usize] = [*temperature, *visibility];
        }
        let received = exchange.received(load, steps, |slot| of_slot[slot][0], |slot| of_slot[slot][1]);
        self.reference.receive(self.node_of_slot.iter().map(|slot| received[*slot as usize]).collect());
    }

    /// Temperatures of all nodes in device order [K], 0 for padding.
    fn temperatures(&self) -> Vec<f64> {
        let mut temperatures = vec![0.0; self.slots];
        for (slot, temperature) in self.node_of_slot.iter().zip(self.reference.temperatures()) {
            temperatures[*slot as usize] = *temperature;
        }
        temperatures
    }

    /// Normals of the surface as the joints turn it.
    fn turned(&self, joints: &[DAffine3]) -> Cow<'_, [DVec3]> {
        if self.surface.joints.is_empty() {
            return Cow::Borrowed(&self.normals);
        }
        let turn = |(normal, joint): (&DVec3, &u32)| joints[*joint as usize].matrix3 * *normal;
        Cow::Owned(self.normals.iter().zip(&self.surface.joints).map(turn).collect())
    }

    /// Draws the surface as the joints place it, in the surroundings that were looked at last.
    fn draw(
        &self,
        temperatures: &[f64],
        joints: &[DAffine3],
        view: &raster::RasterView,
        (surroundings, time): (Option<&Surroundings>, f64),
    ) -> Vec<raster::Pixel> {
        let placed;
        let positions = if self.surface.joints.is_empty() {
            &self.surface.positions
        } else {
            placed = self.surface.placed(joints);
            &placed
        };
        let normals = self.turned(joints);
        let seen = surroundings.is_some() || !self.finishes.reflectors.is_empty();
        let around = seen.then(|| SurfaceSurroundings {
            surroundings,
            background: self.finishes.has_background(),
            normals: &normals,
            reflects: self.finishes.reflects(),
            reflectors: &self.finishes.reflectors,
            looks: self.finishes.looks(),
            traced: self.finishes.traced.as_ref().map(|traced| traced.seen(time)),
        });
        let surface = RasterSurface {
            around,
            positions,
            triangles: &self.surface.triangles,
            temperatures,
            vertex_part: &self.parts,
            vertex_material: &self.materials,
            emissivities: &self.emissivities,
        };
        rasterise(&surface, view, |t| band_radiance(&self.table, t))
    }

    /// Takes the temperatures of a file at a time [s].
    fn take_given(&mut self, time: f64) {
        let Some(given) = &self.given else { return };
        let temperatures = given.at(time);
        for (node, slot) in self.node_of_slot.iter().enumerate() {
            self.reference.set_temperature(node, temperatures[*slot as usize]);
        }
    }

    /// Draws what stands behind the surface.
    fn draw_sky(&self, view: &raster::RasterView, surroundings: Option<&Surroundings>) -> Vec<raster::Pixel> {
        let around = surroundings.map(|surroundings| SurfaceSurroundings {
            surroundings: Some(surroundings),
            background: self.finishes.has_background(),
            normals: &[],
            reflects: false,
            reflectors: &[],
            looks: self.finishes.looks(),
            traced: None,
        });
        let nothing = RasterSurface {
            around,
            positions: &[],
            triangles: &[],
            temperatures: &[],
            vertex_part: &[],
            vertex_material: &[],
            emissivities: &[],
        };
        rasterise(&nothing, view, |_| 0.0)
    }

    fn take_network(&mut self) {
        let Some(network) = &self.network else { return };
        let temperatures = network.temperatures();
        let mut of_slot = vec![f64::NAN; self.slots];
        network.scene().scatter(&temperatures, |slot, temperature| of_slot[slot] = temperature);
        for (node, slot) in self.node_of_slot.iter().enumerate() {
            if !of_slot[*slot as usize].is_nan() {
                self.reference.set_temperature(node, of_slot[*slot as usize]);
            }
        }
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
        self.reference.receive(Vec::new());
        self.reference.settle(load);
        self.take_given(time);
        let heat = self.heat(load);
        match &mut self.network {
            Some(network) => network.settle(heat, time)?,
            None => return Ok(()),
        }
        self.take_network();
        Ok(())
    }

    fn settle_at(&mut self, temperature: f64, _nodes: usize) -> Result<(), EngineError> {
        self.reference.settle_at(temperature);
        if let Some(network) = &mut self.network {
            network.settle_at(temperature);
        }
        Ok(())
    }

    fn take_camera(&mut self, camera: &Camera) -> bool {
        let fits = self.camera.as_ref().is_some_and(|own| draws_alike(own, camera, self.sensor.is_none()));
        if fits {
            self.camera = Some(camera.clone());
        }
        fits
    }

    fn take_sensor(&mut self, prepared: &Prepared) -> Result<bool, EngineError> {
        let Some((own, sensor)) = self.sensor.as_mut().zip(prepared.scene.sensor.as_ref()) else { return Ok(false) };
        own.take(sensor);
        Ok(true)
    }

    fn submit(&mut self, step: Option<EngineStep<'_>>, order: Order<'_>) -> Result<(), EngineError> {
        let trace = self.trace.clone();
        let _computes = trace.span(Track::Host, "f64 reference");
        let mut absorbed = None;
        if order.keep {
            self.earlier = self.temperatures();
        }
        if let Some(step) = step {
            self.steps += 1;
            self.reference.find_shadows(&mut self.shadows, step.load);
            self.exchange(step.load, step.steps);
            self.reference.step(step.load, step.steps);
            if order.absorbed {
                let flux = self.flux(step.load);
                absorbed = Some(absorbed_heat(&self.heat, |slot| flux[slot]));
            }
            if let Some(network) = &mut self.network {
                network.step_begins();
            }
            let heat = self.heat(step.load);
            if let Some(network) = &mut self.network {
                network.step(heat, step.start, step.length)?;
            }
            self.take_network();
            self.take_given(step.start + step.length);
            if let Some(network) = &mut self.network {
                network.step_ends();
            }
        }
        let mut temperatures = self.temperatures();
        if let Some(share) = order.between {
            let pairs = self.earlier.iter().zip(temperatures);
            temperatures = pairs.map(|(earlier, later)| between(*earlier, later, share)).collect();
        }
        if let Some(around) = &order.surroundings {
            self.finishes.look_at(around);
        }
        if let Some(traced) = self.finishes.traced.as_mut().filter(|_| order.pose.is_some()) {
            traced.follow(order.joints);
        }
        let apart = self.finishes.is_apart();
        let mut pixels = order.pose.as_ref().zip(self.camera.as_ref()).map(|(pose, camera)| {
            let surroundings = order.surroundings.as_ref();
            let draw = |joints: &[DAffine3], view: &raster::RasterView| {
                self.draw(&temperatures, joints, view, (surroundings, order.time))
            };
            let drawn = match order.rows {
                None => {
                    let view = raster_view(camera, pose);
                    let crop = self.distance.as_ref().and_then(|distance| distance.crop(camera, pose, order.joints));
                    match crop {
                        None => draw(order.joints, &view),
                        Some(crop) => {
                            let texels = draw(order.joints, &crop.view(&view));
                            let mut image = self.draw_sky(&view, surroundings);
                            gather(&mut image, view.width as usize, &crop, &texels);
                            image
                        }
                    }
                }
                Some(RowMoments(moment)) => {
                    let row = |row: u32| {
                        let InstantPoses { pose, joints } = moment(f64::from(row));
                        let mut view = raster_view(camera, &pose);
                        view.lens.centre[1] -= f64::from(row);
                        draw(&joints, &raster::RasterView { height: 1, ..view })
                    };
                    (0..camera.height).flat_map(row).collect()
                }
            };
            let value = |pixel: &raster::Pixel| match pixel.part {
                0 => [pixel.radiance as f32, 0.0, 0.0],
                _ => [pixel.radiance as f32, pixel.temperature as f32, pixel.depth as f32],
            };
            let radiance: Vec<f64> = drawn.iter().map(|pixel| pixel.radiance).collect();
            let pixels = Pixels {
                readings: None,
                radiance_temperature_depth: drawn.iter().map(value).collect(),
                identity: drawn.iter().map(|pixel| [pixel.part, pixel.material]).collect(),
                coverage: match camera.samples {
                    1 => Vec::new(),
                    _ => drawn.iter().map(|pixel| pixel.coverage as f32).collect(),
                },
                reflected: drawn.iter().filter(|_| apart).map(|pixel| pixel.reflected as f32).collect(),
            };
            (pixels, radiance)
        });
        if let (Some((pixels, radiance)), Some(sensor)) = (&mut pixels, &mut self.sensor) {
            pixels.readings = Some(sensor.expose(radiance, order.time));
        }
        let pixels = pixels.map(|(pixels, _)| pixels);
        let temperatures = order.temperatures.then(|| temperatures.iter().map(|t| *t as f32).collect());
        self.delivered.push_back(Delivered { pixels, temperatures, absorbed });
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
        if let Some(exchange) = &self.exchange {
            saved.put_all("exchange", exchange.save());
        }
        if let Some(network) = &mut self.network {
            saved.put_all("network", network.save());
        }
        if let Some(sensor) = &self.sensor {
            saved.put_all("sensor", sensor.save());
        }
        Ok(saved)
    }

    fn restore(&mut self, saved: &Saved, most_times: usize) -> Result<(), EngineError> {
        self.reference.restore(&saved.part("nodes"))?;
        if let Some(shadows) = &mut self.shadows {
            shadows.restore(&saved.part("shadows"))?;
        }
        if let Some(exchange) = &mut self.exchange {
            exchange.restore(&saved.part("exchange"))?;
        }
        if let Some(network) = &mut self.network {
            network.restore(&saved.part("network"), most_times)?;
        }
        if let Some(sensor) = &mut self.sensor {
            sensor.restore(&saved.part("sensor"))?;
        }
        [self.steps] = saved.array("steps")?;
        Ok(())
    }

    fn exchanged_infrared(&self, black: &[f64]) -> Vec<f64> {
        let exchange = self.exchange.as_ref().and_then(ExchangeTwin::exchange);
        exchange.map(|exchange| exchange.exchanged_infrared(black)).unwrap_or_default()
    }

    fn exchange_poses(&self) -> Option<&[DAffine3]> {
        self.exchange.as_ref().and_then(ExchangeTwin::poses)
    }

    fn structures(&mut self) -> Result<Vec<f64>, EngineError> {
        Ok(self.reference.structures().flatten().collect())
    }

    fn set_structures(&mut self, temperatures: &[f64]) -> Result<(), EngineError> {
        let own: Vec<usize> =
            self.reference.structures().enumerate().filter_map(|(node, own)| own.map(|_| node)).collect();
        own.iter().zip(temperatures).for_each(|(node, temperature)| self.reference.set_structure(*node, *temperature));
        Ok(())
    }

    fn network(&self) -> Option<&NetworkRun> {
        self.network.as_ref()
    }

    fn network_mut(&mut self) -> Option<&mut NetworkRun> {
        self.network.as_mut()
    }
}
