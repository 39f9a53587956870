//! Surfaces made of a few flat quads, drawn on the device.

use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec3, Vec3};
use isotherm::internals::{
    Band, Camera, CameraFrame, Context, Curve, Material, NODES_PER_WORKGROUP, Pixel, RadianceTable, RasterSurface,
    Renderer, Request, SceneData, Shapes, StepKind, StepRange, ThermalVariant, View, band_radiance, band_table,
    device_material, device_view, raster_view, rasterise, sampling, source_view,
};
use isotherm::{Image, Lens, Motion};

/// Quads with temperatures at their corners. Each is a group of four nodes.
pub struct Quads {
    pub materials: Vec<Material>,
    pub variant: ThermalVariant,
    pub band: Band,
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    temperatures: Vec<f32>,
    group_part: Vec<u32>,
    group_material: Vec<u32>,
    triangles: Vec<[u32; 3]>,
}

impl Quads {
    /// No quads, in 8 to 14 um, without loads.
    pub fn new(materials: Vec<Material>) -> Self {
        let both_sides = false;
        Self {
            materials,
            variant: ThermalVariant { both_sides, ..ThermalVariant::bare(StepKind::Instant, Curve::Power) },
            band: Band { lower: 8e-6, upper: 14e-6 },
            positions: Vec::new(),
            normals: Vec::new(),
            temperatures: Vec::new(),
            group_part: Vec::new(),
            group_material: Vec::new(),
            triangles: Vec::new(),
        }
    }

    /// Adds a quad. Corners are counter-clockwise seen from the front [m].
    pub fn add(&mut self, corners: [DVec3; 4], part: u32, material: u32, temperature: impl Fn(DVec3) -> f64) {
        let first = self.positions.len() as u32;
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
        self.positions.extend(corners.map(DVec3::as_vec3));
        self.normals.extend([normal.as_vec3(); 4]);
        self.temperatures.extend(corners.map(|corner| temperature(corner) as f32));
        self.group_part.push(part);
        self.group_material.push(material);
        self.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    }

    /// A square around a centre with a half-width, spanned by two unit vectors. Its front faces `right` x `up`.
    pub fn square(centre: DVec3, right: DVec3, up: DVec3, half: f64) -> [DVec3; 4] {
        [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(u, v)| centre + half * (u * right + v * up))
    }

    /// The scene on a device with the temperatures of the corners.
    pub fn renderer(&self, context: &Arc<Context>, camera: &Camera) -> Renderer {
        let nodes = self.positions.len().next_multiple_of(NODES_PER_WORKGROUP);
        let padded = |values: &[Vec3]| [values, &vec![Vec3::ZERO; nodes - values.len()]].concat();
        let groups = |values: &[u32]| [values, &vec![0; nodes / 4 - values.len()]].concat();
        let shapes = Shapes::of(&self.materials);
        let data = SceneData {
            ranges: vec![StepRange { variant: self.variant, groups: (0, nodes as u32 / 4), joint: 0 }],
            group_material: &groups(&self.group_material),
            group_part: &groups(&self.group_part),
            normals: &padded(&self.normals),
            positions: &padded(&self.positions),
            triangles: &self.triangles,
            materials: &self.materials.iter().map(|material| device_material(material, &shapes)).collect::<Vec<_>>(),
            band_table: &band_table(&RadianceTable::new(self.band)),
            image: Some([camera.width, camera.height]),
            sampling: sampling(camera, context.info.sample_counts, false, false),
            ..SceneData::empty(&shapes)
        };
        let mut renderer = Renderer::new(context, &data).expect("a small scene");
        let mut temperatures = self.temperatures.clone();
        temperatures.resize(nodes, 0.0);
        renderer.settle_at(&temperatures).expect("the device settles");
        renderer
    }

    /// The image in f64.
    pub fn rasterised(&self, camera: &Camera, pose: &DAffine3) -> Vec<Pixel> {
        let positions: Vec<DVec3> = self.positions.iter().map(|position| position.as_dvec3()).collect();
        let temperatures: Vec<f64> = self.temperatures.iter().map(|temperature| f64::from(*temperature)).collect();
        let of_nodes = |groups: &[u32]| groups.iter().flat_map(|value| [*value; 4]).collect::<Vec<_>>();
        let emissivities = |material: &Material| {
            let device = device_material(material, &Shapes::default());
            [device.emissivity, device.back_emissivity].map(f64::from)
        };
        let surface = RasterSurface {
            around: None,
            positions: &positions,
            triangles: &self.triangles,
            temperatures: &temperatures,
            vertex_part: &of_nodes(&self.group_part),
            vertex_material: &of_nodes(&self.group_material),
            emissivities: &self.materials.iter().map(emissivities).collect::<Vec<_>>(),
        };
        let table = RadianceTable::new(self.band);
        rasterise(&surface, &raster_view(camera, pose), |temperature| band_radiance(&table, temperature))
    }

    /// The image that the device draws.
    pub fn draw(&self, context: &Arc<Context>, camera: &Camera, pose: &DAffine3) -> Image {
        let mut renderer = self.renderer(context, camera);
        let submitted = renderer
            .submit(Request { views: &[seen(context, camera, pose)], ..Request::default() })
            .expect("the device draws");
        let collected = renderer.collect(submitted).expect("the device answers");
        let radiance = collected.radiance.expect("an image was asked for");
        let labels = collected.identity.expect("an image was asked for");
        let channel = |channel: usize| radiance.iter().map(|pixel| pixel[channel]).collect();
        Image {
            time: 0.0,
            camera: camera.clone(),
            camera_from_body: *pose,
            radiance: channel(0),
            temperature: channel(1),
            depth: channel(2),
            part: labels.iter().map(|label| label[0]).collect(),
            material: labels.iter().map(|label| label[1]).collect(),
            coverage: channel(3),
            reflected: Vec::new(),
            error: Vec::new(),
            budget: Vec::new(),
            sigma: Default::default(),
            digital_numbers: None,
            counts: None,
            bands: Default::default(),
            changes: None,
        }
    }
}

/// The view of a camera on a device.
fn seen(context: &Context, camera: &Camera, pose: &DAffine3) -> View {
    match sampling(camera, context.info.sample_counts, false, false) {
        Some(sampling) => source_view(&sampling, camera.near, pose),
        None => device_view(camera, pose),
    }
}

/// A camera at the origin of its own frame. The pose places it.
pub fn camera(width: u32, height: u32, focal: f64) -> Camera {
    Camera {
        width,
        height,
        lens: Lens::pinhole([focal, focal], [0.5 * f64::from(width), 0.5 * f64::from(height)]),
        samples: 1,
        line_time: 0.0,
        motion: Motion::Still,
        frame: CameraFrame::Body,
        position: DVec3::ZERO,
        frame_from_camera: glam::DQuat::IDENTITY,
        near: 0.1,
    }
}

/// A pose at a position that looks at another. The image's lower edge points to `down`.
pub fn looking(from: DVec3, at: DVec3, down: DVec3) -> DAffine3 {
    let forward = (at - from).normalize();
    let right = down.cross(forward).normalize();
    let body_from_camera = DMat3::from_cols(right, forward.cross(right), forward);
    DAffine3::from_mat3_translation(body_from_camera, from).inverse()
}
