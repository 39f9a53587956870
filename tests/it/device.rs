//! The Vulkan device of the tests, loose nodes to step on it, and comparisons of numbers.

use std::sync::Arc;

use glam::{DVec3, Vec3};
use isotherm::GpuError;
use isotherm::internals::{
    Bulk, Context, Curve, Domain, Function, GROUP, Material, NODES_PER_WORKGROUP, Optics, PlanetLoad, Profile,
    ReferenceNode, Renderer, Request, Response, Retarget, SceneData, Shapes, Sides, StepKind, StepLoad, StepRange,
    SunSample, ThermalVariant, Transition, device_material, emissivity_sum,
};

use crate::random::Random;

/// Whether `ISOTHERM_VALIDATION=1` asks for the validation layer, as `tools/test` does.
pub fn validation_is_asked_for() -> bool {
    std::env::var_os("ISOTHERM_VALIDATION").is_some_and(|value| value == "1")
}

/// A context on the best device. Every test has its own, so that the messages of the validation layer are its own.
pub fn context() -> Arc<Context> {
    Context::open(None, validation_is_asked_for()).expect("a Vulkan device (tools/setup installs lavapipe)")
}

/// A context with the validation layer. If the layer is not installed and `ISOTHERM_VALIDATION=1` does not ask for it,
/// prints a line and returns `None`.
pub fn validated_context() -> Option<Arc<Context>> {
    match Context::open(None, true) {
        Err(GpuError::NoValidationLayer) if !validation_is_asked_for() => {
            println!("skipped: the Vulkan validation layer is not installed (tools/setup tests)");
            None
        }
        context => Some(context.expect("a Vulkan device and its validation layer")),
    }
}

/// Fails if the validation layer reported anything.
pub fn assert_silent(context: &Context) {
    assert_eq!(context.validation_messages(), Vec::<String>::new());
}

impl Random {
    /// A random direction, uniform over the sphere.
    pub fn direction(&mut self) -> DVec3 {
        let (z, azimuth) = (self.between(-1.0, 1.0), self.between(0.0, std::f64::consts::TAU));
        let across = (1.0 - z * z).sqrt();
        DVec3::new(across * azimuth.cos(), across * azimuth.sin(), z)
    }
}

/// A material with these values. Its other values do not affect a node.
pub fn material(absorptivity: f64, emissivity: f64, sides: Sides, response: Response) -> Material {
    let front = Optics { absorptivity, emissivity };
    let name = format!("a {absorptivity:.3}, e {emissivity:.3}, {sides:?}, {response:?}");
    Material {
        name,
        front,
        sides,
        gloss: Default::default(),
        in_band: Default::default(),
        bulk: Bulk::default(),
        response,
        transition: None,
        ranges: [None; 2],
        source: "test".to_owned(),
    }
}

/// A black surface: sigma T^4 is the incident flux.
pub fn black() -> Material {
    material(1.0, 1.0, Sides::Outside, Response::Instant)
}

/// Transition with these times [steps].
pub fn transition(heating: (Function, f64), cooling: (Function, f64), retarget: Retarget) -> Response {
    let profile = |(function, t_max_steps)| Profile { function, t_max_steps };
    let (heating, cooling) = (profile(heating), profile(cooling));
    Response::Transition(Transition { heating, cooling, retarget, domain: Domain::Temperature })
}

/// A load with only the temperature of space [K].
pub fn dark(background_temperature: f64) -> StepLoad {
    StepLoad { start: 0.0, sun: Vec::new(), planet: None, albedo: None, background_temperature, joints: Vec::new() }
}

/// Sunlight from these directions, with these fluxes [W/m2].
pub fn sunlight(samples: impl IntoIterator<Item = (DVec3, f64)>) -> Vec<SunSample> {
    samples.into_iter().map(|(direction, flux)| SunSample { direction, flux }).collect()
}

/// A planet below. The Sun is at an angle from its zenith [rad] towards `side`.
pub fn planet(nadir: DVec3, side: DVec3, distance_ratio: f64, planet_ir: f64, sun_zenith: f64) -> PlanetLoad {
    let sunward = (side - nadir * nadir.dot(side)).normalize();
    PlanetLoad { nadir, sunward, distance_ratio, planet_ir, albedo_flux: 0.0, sun_zenith }
}

/// The loads of a scene.
#[derive(Debug, Clone, Copy, Default)]
pub struct Present {
    pub sun: bool,
    pub planet_ir: bool,
    pub albedo: bool,
}

/// All loads.
pub const ALL: Present = Present { sun: true, planet_ir: true, albedo: true };

/// Nodes without a surface. Every material is combined with every normal. Each material has its own range.
pub struct LooseNodes {
    pub materials: Vec<Material>,
    pub ranges: Vec<StepRange>,
    directions: usize,
    normals: Vec<Vec3>,
    group_material: Vec<u32>,
}

impl LooseNodes {
    /// The nodes in device order. Normals are rounded to f32.
    pub fn new(present: Present, materials: Vec<Material>, directions: &[DVec3]) -> Self {
        let padded = directions.len().next_multiple_of(NODES_PER_WORKGROUP);
        let mut nodes = Self {
            ranges: Vec::new(),
            directions: directions.len(),
            normals: Vec::new(),
            group_material: Vec::new(),
            materials,
        };
        for (index, material) in nodes.materials.iter().enumerate() {
            let first = nodes.group_material.len() as u32;
            nodes.normals.extend(directions.iter().map(|direction| direction.as_vec3()));
            nodes.normals.resize((index + 1) * padded, Vec3::ZERO);
            nodes.group_material.resize((index + 1) * padded / GROUP, index as u32);
            let kind = match &material.response {
                Response::Instant => StepKind::Instant,
                Response::Network | Response::Given => StepKind::Absorb,
                Response::Radiative(plate) => {
                    StepKind::Radiative { over: plate.over.is_some(), fast: plate.is_fast(emissivity_sum(material)) }
                }
                Response::Transition(Transition { retarget: Retarget::Merge, .. }) => StepKind::Merge,
                Response::Transition(Transition { retarget: Retarget::Restart, .. }) => StepKind::Restart,
            };
            let variant = ThermalVariant {
                both_sides: matches!(material.sides, Sides::Both { .. }),
                sun: present.sun,
                planet_ir: present.planet_ir,
                albedo: present.albedo,
                ..ThermalVariant::bare(kind, Curve::Power)
            };
            nodes.ranges.push(StepRange { variant, groups: (first, nodes.group_material.len() as u32), joint: 0 });
        }
        nodes
    }

    /// The nodes on a device, with additional ranges `more`.
    pub fn renderer(&self, context: &Arc<Context>, more: &[StepRange]) -> Renderer {
        let shapes = Shapes::of(&self.materials);
        let materials: Vec<_> = self.materials.iter().map(|material| device_material(material, &shapes)).collect();
        let data = SceneData {
            ranges: [&self.ranges, more].concat(),
            group_material: &self.group_material,
            group_part: &vec![0; self.group_material.len()],
            normals: &self.normals,
            positions: &vec![Vec3::ZERO; self.normals.len()],
            materials: &materials,
            band_table: &[0.0],
            ..SceneData::empty(&shapes)
        };
        Renderer::new(context, &data).expect("a small scene")
    }

    /// Indices of the nodes without padding.
    pub fn places(&self) -> impl Iterator<Item = usize> {
        let padded = self.normals.len() / self.materials.len();
        let directions = self.directions;
        (0..self.normals.len()).filter(move |place| place % padded < directions)
    }

    /// Number of nodes, padding included.
    pub fn len(&self) -> usize {
        self.normals.len()
    }

    /// The nodes as the f64 reference takes them, in the order of `places`.
    pub fn reference_nodes(&self) -> Vec<ReferenceNode> {
        let node = |place: usize| ReferenceNode {
            normal: self.normals[place].as_dvec3(),
            material: self.group_material[place / GROUP],
        };
        self.places().map(node).collect()
    }
}

/// Temperatures [K] on the device after settling under a load, in the order of `places`.
pub fn settled(nodes: &LooseNodes, renderer: &mut Renderer, load: &StepLoad) -> Vec<f64> {
    renderer.settle(load).expect("the device settles");
    temperatures(nodes, renderer)
}

/// The current temperatures [K], in the order of `places`.
pub fn temperatures(nodes: &LooseNodes, renderer: &mut Renderer) -> Vec<f64> {
    let submitted = renderer.submit(Request::default().and_temperatures()).expect("the device copies");
    let collected = renderer.collect(submitted).expect("the device answers");
    let all = collected.temperatures.expect("temperatures were asked for");
    nodes.places().map(|place| f64::from(all[place])).collect()
}

/// The largest difference between the device and its twin, and its node.
#[derive(Debug, Clone)]
pub struct Worst {
    /// Largest |device - twin|. It is infinite if a number is NaN.
    pub difference: f64,
    /// The node in words.
    pub node: String,
    pub device: f64,
    pub twin: f64,
}

impl Worst {
    pub fn none() -> Self {
        Self { difference: 0.0, node: "no node".to_owned(), device: 0.0, twin: 0.0 }
    }

    /// Adds one comparison. `node` is called only if it is the worst so far.
    pub fn see(&mut self, device: f64, twin: f64, node: impl FnOnce() -> String) {
        let difference = (device - twin).abs();
        if difference > self.difference || difference.is_nan() {
            let difference = if difference.is_nan() { f64::INFINITY } else { difference };
            *self = Self { difference, node: node(), device, twin };
        }
    }

    /// Compares two lists. Nodes are numbered in list order.
    pub fn of(device: &[f64], twin: &[f64], node: impl Fn(usize) -> String) -> Self {
        assert_eq!(device.len(), twin.len());
        let mut worst = Self::none();
        for (index, (device, twin)) in device.iter().zip(twin).enumerate() {
            worst.see(*device, *twin, || node(index));
        }
        worst
    }

    /// Fails with the name of the node if the difference exceeds the tolerance. Otherwise prints it.
    pub fn within(&self, tolerance: f64, unit: &str, what: &str) {
        let Self { difference, node, device, twin } = self;
        let sentence = format!("{what}: {difference:.2e} {unit} at {node}: device {device}, twin {twin}");
        assert!(*difference <= tolerance, "beyond {tolerance:e} {unit}: {sentence}");
        println!("{sentence}");
    }
}

/// Grid on which a device rounds triangle corners, relative to 1/256 of a pixel, the grid of lavapipe and GPUs.
/// SwiftShader's is 16 times as wide (`subPixelPrecisionBits`, Vulkan 1.3, required limits: at least 4 bits).
pub fn corner_grid(context: &Context) -> f64 {
    0.5f64.powi(context.info.sub_pixel_bits as i32 - 8).max(1.0)
}
