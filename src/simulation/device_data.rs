//! Scene data rounded to f32 for the device: materials, response functions and the band.

use super::distant::DistantParts;
use super::energy::heat_tables;
use super::prepare::Prepared;
use super::sampling::{ALWAYS, sampling};
use super::surroundings::Finishes;
use super::viewpoint::sensor_view;
use crate::gpu::blackbody::band_table;
use crate::gpu::effects::exchange::tables::ExchangeTables;
use crate::gpu::effects::heat::tables::HeatTables;
use crate::gpu::effects::network::tables::OnePassTables;
use crate::gpu::effects::sensor::tables::SensorTables;
use crate::gpu::layout;
use crate::gpu::scene_data::{ExchangeData, JointData, SceneData};
use crate::gpu::shapes::Shapes;
use crate::scene::Camera;
use crate::thermal::balance::emissivity_sum;
use crate::thermal::material::{Material, Response};
use crate::thermal::radiance::RadianceTable;

/// Data that the device needs in addition to the arrays of `Prepared`.
pub struct DeviceData {
    materials: Vec<layout::Material>,
    shapes: Shapes,
    band_table: Vec<f32>,
    network: Option<OnePassTables>,
    /// Runs of nodes whose absorbed heat is summed.
    pub(crate) heat: Option<HeatTables>,
    sensor: Option<SensorTables>,
    exchange: Option<ExchangeTables>,
    pub(super) finishes: Finishes,
}

impl DeviceData {
    /// Rounds the scene's materials and band to f32.
    pub fn new(prepared: &Prepared) -> Self {
        let table = RadianceTable::new(prepared.scene.passband());
        let shapes = Shapes::of(&prepared.materials);
        let materials = prepared.materials.iter().map(|material| device_material(material, &shapes)).collect();
        let network = prepared.network.as_ref().and_then(|network| network.tables());
        Self {
            materials,
            shapes,
            band_table: band_table(&table),
            network,
            heat: prepared.scene.energy_balance.then(|| heat_tables(prepared)),
            sensor: sensor_tables(prepared),
            exchange: None,
            finishes: Finishes::new(prepared),
        }
    }

    /// The same with radiation between surfaces.
    pub fn with_exchange(self, exchange: Option<ExchangeTables>) -> Self {
        Self { exchange, ..self }
    }

    /// The scene as plain numbers for any device.
    pub fn scene_data<'a>(&'a self, prepared: &'a Prepared, camera: Option<&Camera>) -> SceneData<'a> {
        self.scene_data_with(prepared, camera, ALWAYS)
    }

    /// The same for a device whose images may have these numbers of samples of a texel, as a sum of powers of two.
    pub(crate) fn scene_data_with<'a>(
        &'a self,
        prepared: &'a Prepared,
        camera: Option<&Camera>,
        counts: u32,
    ) -> SceneData<'a> {
        let shown = self.finishes.shown();
        // Rays start from the surface of each texel, and texels of several samples have several.
        let counts = if shown.variant.traced { 1 } else { counts };
        SceneData {
            ranges: prepared.step_ranges(),
            group_material: &prepared.nodes.group_material,
            group_part: &prepared.nodes.group_part,
            normals: &prepared.nodes.normals,
            positions: &prepared.nodes.positions,
            triangles: &prepared.triangles,
            materials: &self.materials,
            shapes: &self.shapes,
            band_table: &self.band_table,
            image: camera.map(|camera| [camera.width, camera.height]),
            between: prepared.scene.time.draw.is_between_steps(),
            sampling: camera.and_then(|camera| {
                sampling(camera, counts, DistantParts::new(prepared, camera).is_some(), spreads(prepared, camera))
            }),
            light: prepared.lit_areas(prepared.nodes.real().map(|(slot, _)| slot)),
            joints: (prepared.joints() > 1)
                .then(|| JointData { count: prepared.joints() as u32, triangles: &prepared.triangle_runs }),
            network: self.network.as_ref(),
            heat: self.heat.as_ref(),
            exchange: self.exchange.as_ref().zip(prepared.exchange.as_ref()).map(|(tables, craft)| ExchangeData {
                tables,
                renewal: craft.renewal(),
                mirrors: craft.mirrors.as_ref(),
            }),
            sensor: self.sensor.as_ref().filter(|_| is_own(prepared, camera)),
            shown,
        }
    }
}

/// The tables of the scene's sensor for a device. `None` without a sensor.
pub(crate) fn sensor_tables(prepared: &Prepared) -> Option<SensorTables> {
    let (sensor, camera) = prepared.scene.sensor.as_ref().zip(prepared.scene.camera.as_ref())?;
    Some(SensorTables::new(sensor, &RadianceTable::new(prepared.scene.passband()), &sensor_view(camera)))
}

/// Whether the sensor that sees the images of a camera has a point spread.
pub(super) fn spreads(prepared: &Prepared, camera: &Camera) -> bool {
    is_own(prepared, Some(camera)) && prepared.scene.sensor.as_ref().is_some_and(|sensor| sensor.spread.is_some())
}

/// Whether a camera has the image of the scene's own, for which the tables of the sensor are made.
pub(super) fn is_own(prepared: &Prepared, camera: Option<&Camera>) -> bool {
    let size = |camera: &Camera| [camera.width, camera.height];
    camera.map(size) == prepared.scene.camera.as_ref().map(size)
}

/// A material rounded to f32. Where only the outside exchanges heat, the back has the optics of the front.
pub fn device_material(material: &Material, shapes: &Shapes) -> layout::Material {
    let back = material.back();
    let mut device = layout::Material {
        absorptivity: material.front.absorptivity as f32,
        emissivity: material.front.emissivity as f32,
        back_absorptivity: back.absorptivity as f32,
        back_emissivity: back.emissivity as f32,
        ..bytemuck::Zeroable::zeroed()
    };
    match &material.response {
        Response::Transition(transition) => device.set_transition(transition, shapes),
        Response::Radiative(plate) => device.set_plate(plate, emissivity_sum(material)),
        Response::Instant | Response::Network | Response::Given => {}
    }
    device
}
