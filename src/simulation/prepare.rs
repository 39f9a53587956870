//! Prepares a scene for a run: model, materials, nodes in device order, loads.

use std::path::Path;
use std::sync::Arc;

use super::emissivity;
use super::exchange::{ExchangeCraft, surface_warnings};
use super::given::GivenTemperatures;
use super::joints;
use super::light::SceneLight;
use super::network::{self, SceneNetwork, light_area};
use super::pixel_light::PastLight;
use super::prepare_error::{PrepareError, PrepareStage};
use super::prepare_names;
use super::prepare_steps::{self as steps, Dense, SceneHashes};
use crate::environment::Attitude;
use crate::environment::shadow::LitAreas;
use crate::environment::step::StepLoads;
use crate::gpu::effects::image::runs::TriangleRun;
use crate::gpu::effects::thermal::variant::StepRange;
use crate::gpu::effects::thermal::variant::{Curve, LightBy, StepKind, ThermalVariant};
use crate::gpu::shapes;
use crate::model::MergeSummary;
use crate::model::Model;
use crate::model::nodes::{GROUP, Nodes, PADDING, RangeResponse};
use crate::scene::work::too_late;
use crate::scene::{Background, Draw, Reflections, Scene};
use crate::stop::Watch;
use crate::thermal::material::{Material, Response};

/// A joint's run of triangles begins at a multiple of this number, so that its indices can be bound separately.
const RUN: usize = 64;

/// Remark for readers of a scene with joints.
const JOINTS: &str = "Loads and shadows of a moving part in a step are those of its pose in the middle of the step; an \
                      image shows the pose at its own time. Probes and contacts are found in the file's pose, and \
                      Sun-tracking goes on in eclipse.";

/// Most groups of four nodes in one dispatch: 65,535 workgroups of 64, and 128 MiB of vec4.
const MAX_GROUPS: usize = 65_535 * 64;

/// Remark for readers of a transition's temperatures (docs/numerics.md 1).
const PROFILES: &str = "A transition is a profile in temperature, not physics: in orbit even the best t_max leaves a \
                        radiating node 10 to 37 K rms from its energy balance.";

/// What is told of a model.
#[derive(Clone)]
pub struct ModelSummary {
    /// Area [m2].
    pub area: f64,
    /// Triangles of the file.
    pub(crate) triangles: usize,
    /// Section and sentence of each pattern of the scene that has no effect.
    pub(crate) idle_patterns: Vec<(&'static str, String)>,
    /// Result of merging short edges, where the scene asks for it.
    pub(crate) merged: Option<MergeSummary>,
}

impl ModelSummary {
    /// The summary before edges are split. The area is not known yet.
    fn of(scene: &Scene, model: &Model) -> Self {
        let materials = scene.materials.idle_patterns(model).into_iter().map(|told| ("[[material]]", told));
        let parts = scene.density.idle_patterns(model).into_iter().map(|told| ("[[part]]", told));
        let idle_patterns = materials.chain(parts).collect();
        Self { area: 0.0, triangles: model.triangles.len(), idle_patterns, merged: None }
    }
}

/// A scene ready to run.
#[derive(Clone)]
pub struct Prepared {
    /// The scene file.
    pub scene: Scene,
    /// Hashes of its files.
    pub hashes: SceneHashes,
    /// Names of the parts.
    pub parts: Vec<String>,
    /// Materials in the order of the model.
    pub materials: Vec<Material>,
    /// Nodes in device order.
    pub nodes: Nodes,
    /// Node indices of the triangles. The triangles of each joint form a run.
    pub triangles: Vec<[u32; 3]>,
    /// The runs of `triangles`. Triangles without area stand between them.
    pub triangle_runs: Vec<TriangleRun>,
    /// The surface that the Sun lights, and how its light is found.
    pub(crate) light: SceneLight,
    /// Area of the model, and the result of merging its edges.
    pub model: ModelSummary,
    /// Loads of any step: Sun, planet and albedo.
    pub loads: StepLoads,
    pub(crate) probes: Vec<usize>,
    /// The thermal network of the materials with response `network`.
    pub network: Option<Arc<SceneNetwork>>,
    /// The temperatures of a file, where the scene takes them from one.
    pub(crate) given: Option<Arc<GivenTemperatures>>,
    /// Patches that radiate to each other, where the scene has `[exchange]`.
    pub exchange: Option<Arc<ExchangeCraft>>,
    /// Remarks for the user.
    pub warnings: Vec<String>,
}

impl Prepared {
    /// Loads and checks everything that the scene names. `progress` is called for each stage.
    ///
    /// # Errors
    /// The first problem that keeps the scene from running.
    pub fn new(path: &Path, progress: &mut dyn FnMut(PrepareStage)) -> Result<Self, PrepareError> {
        Self::from_scene(Scene::load(path)?, progress)
    }

    /// Prepares a scene that is already loaded.
    ///
    /// # Errors
    /// As for `new`.
    pub fn from_scene(scene: Scene, progress: &mut dyn FnMut(PrepareStage)) -> Result<Self, PrepareError> {
        Self::with_materials(scene, |_| (), progress)
    }

    /// Prepares a loaded scene with materials that the caller changes, such as their response.
    ///
    /// # Errors
    /// As for `new`.
    pub fn with_materials(
        scene: Scene,
        change: impl FnOnce(&mut [Material]),
        progress: &mut dyn FnMut(PrepareStage),
    ) -> Result<Self, PrepareError> {
        Self::made(scene, change, None, progress)
    }

    /// Prepares a scene that differs from this one in values of materials, conductors, heaters and the environment alone. None of them changes the light. Both share
    /// patches, the light that was found and, while this one's engine lives, view factors.
    ///
    /// # Errors
    /// As for `new`.
    pub(crate) fn varied(&self, scene: Scene, change: impl FnOnce(&mut [Material])) -> Result<Self, PrepareError> {
        Self::made(scene, change, Some(self), &mut |_| ())
    }

    fn made(
        mut scene: Scene,
        change: impl FnOnce(&mut [Material]),
        like: Option<&Self>,
        progress: &mut dyn FnMut(PrepareStage),
    ) -> Result<Self, PrepareError> {
        let watch = Watch::begin();
        let progress = &mut |stage| {
            watch.look();
            progress(stage);
        };
        progress(PrepareStage::Reading);
        let mut model = steps::read_model(&mut scene)?;
        let mut materials = prepare_names::materials(&mut scene, &model)?;
        change(&mut materials);
        steps::give_temperatures(&scene, &mut materials);
        steps::check_functions(&scene, &materials)?;
        let looks = emissivity::check_bands(&mut scene, &model, &mut materials)?;
        steps::set_hottest(&scene, &mut materials)?;
        let hashes = steps::hashes(&scene.files)?;
        let summary = ModelSummary::of(&scene, &model);
        let mut warnings = steps::model_warnings(&scene, &mut model);
        let Dense { mut model, merged, occluders } = steps::at_density(&mut scene, model, &materials, progress)?;
        warnings.extend(looks);
        warnings.extend(steps::orbit_warnings(&scene));
        if materials.iter().any(|material| matches!(material.response, Response::Transition { .. })) {
            scene.assumptions.push(PROFILES.to_owned());
        }
        let (moving, part_joint) = joints::joints(&scene, &model)?;
        if !moving.is_empty() {
            scene.assumptions.push(JOINTS.to_owned());
        }
        let parts: Vec<String> = model.parts.iter().map(|part| part.name.clone()).collect();
        steps::check_series(&scene, parts.len(), materials.len())?;

        progress(PrepareStage::Network);
        let shell = network::shell(&scene, &model, &parts, &materials, &part_joint)?;

        progress(PrepareStage::Ordering);
        let areas = model.node_areas();
        let nodes = Nodes::with_joints(&model, &areas, &materials, &part_joint);
        let (triangles, triangle_runs) = steps::by_joint(std::mem::take(&mut model.triangles), &nodes, RUN);
        let (occluders, runs) = steps::by_joint(occluders, &nodes, 1);
        let like = like.filter(|like| like.nodes == nodes);
        let anew = || SceneLight::new(&scene, &nodes, &triangles, (&occluders, &runs), &materials);
        let light = like.map_or_else(anew, |like| like.light.clone());
        steps::check_traced(&scene, &triangles)?;

        progress(PrepareStage::Loads);
        let mut loads = steps::loads(&scene, &materials, light.by, moving)?;
        like.iter().for_each(|like| loads.take_of(&like.loads));
        warnings.extend(steps::turn_warning(&scene, &loads));
        let probes = steps::probe_nodes(&scene, &parts, &nodes)?;
        let given = GivenTemperatures::new(&scene, &parts, &nodes)?.map(Arc::new);
        warnings.extend(given.iter().flat_map(|given| given.warnings().to_vec()));
        let network = steps::network(&mut scene, shell, &parts, &nodes, &probes, &materials)?;
        warnings.extend(network.iter().flat_map(|network| network.remarks(&materials)));
        progress(PrepareStage::Patches);
        let like = like.and_then(|like| like.exchange.as_ref());
        let exchange = steps::exchange(&scene, &nodes, &triangles, network.as_deref(), &materials, &loads, like)?;
        warnings.extend(surface_warnings(&scene, exchange.as_deref(), (&nodes, &triangles, &materials)));
        Ok(Self {
            light: light.with_pixels(&scene, (&nodes, &triangles, &materials), network.as_ref(), &loads),
            loads: loads.with_parts_up_to(exchange.as_ref().map_or(f64::INFINITY, |craft| craft.longest_part())),
            exchange,
            network,
            given,
            hashes,
            parts,
            materials,
            triangles,
            triangle_runs,
            model: ModelSummary { area: areas.iter().sum(), merged, ..summary },
            probes,
            warnings,
            nodes,
            scene,
        })
    }

    /// The scene in one of its bands by itself, for images at temperatures that another engine finds.
    pub(crate) fn in_band(&self, index: usize) -> Self {
        let scene = self.scene.in_band(index);
        let mut other = Self { scene, exchange: None, network: None, given: None, ..self.clone() };
        for (material, in_band) in other.materials.iter_mut().zip(&other.scene.bands[0].in_band) {
            material.in_band.clone_from(in_band);
        }
        if other.scene.time.draw.is_between_steps() {
            // The temperatures between steps come from the other engine too.
            other.scene.time.draw = Draw::Every(1);
        }
        other
    }

    /// The pipelines of the scene and the groups of nodes that each advances, split to the size of a dispatch.
    pub fn step_ranges(&self) -> Vec<StepRange> {
        let environment = &self.scene.environment;
        let sun = environment.solar_constant.is_some_and(|flux| flux > 0.0);
        let tumble = self.scene.attitude == Attitude::Tumble;
        let mut ranges = Vec::new();
        for range in &self.nodes.ranges {
            let material = &self.materials[self.nodes.group_material[range.first_group] as usize];
            let (kind, curve) = match (&material.response, range.kind.response) {
                (Response::Transition(transition), RangeResponse::Transition { .. }) => shapes::curve(transition),
                (_, RangeResponse::Radiative { over, fast }) => (StepKind::Radiative { over, fast }, Curve::Power),
                (Response::Network | Response::Given, _) => (StepKind::Absorb, Curve::Power),
                _ => (StepKind::Instant, Curve::Power),
            };
            let variant = ThermalVariant {
                kind,
                curve,
                both_sides: range.kind.both_sides,
                sun,
                planet_ir: environment.planet_ir.is_some_and(|flux| flux > 0.0),
                albedo: sun && (tumble || environment.albedo.is_some_and(|albedo| albedo > 0.0)),
                tumble,
                light: if sun { self.light.by } else { LightBy::Normal },
                exchange: self.exchange.is_some(),
                fused: false,
            };
            let end = range.first_group + range.groups;
            for first in (range.first_group..end).step_by(MAX_GROUPS) {
                let groups = (first as u32, end.min(first + MAX_GROUPS) as u32);
                ranges.push(StepRange { variant, groups, joint: range.joint });
            }
        }
        ranges
    }

    /// The lit areas of some nodes. `None` where there is no Sun, or where normals tell the light.
    pub fn lit_areas(&self, slots: impl Iterator<Item = usize>) -> Option<LitAreas> {
        self.light.lit_areas(&self.nodes, &self.materials, slots)
    }

    /// Area on which the light of a node falls [m2].
    pub fn light_area(&self, slot: usize) -> f64 {
        light_area(self.network.as_deref(), &self.nodes, slot)
    }

    /// The light up to the time of an image [s], where pixels have light of their own and the craft's way there is known.
    pub(crate) fn past_light(&self, time: f64) -> Option<PastLight> {
        self.light.in_pixels.as_ref().and_then(|light| light.past(&self.loads, &self.materials, time))
    }

    /// Whether some pixels have light of their own.
    pub(crate) fn has_pixel_light(&self) -> bool {
        self.light.in_pixels.is_some()
    }

    /// Nodes with a structure below them that is no node of the network.
    pub fn structures(&self) -> Vec<usize> {
        let nodes = &self.nodes;
        let has = |slot: &usize| {
            let material = nodes.group_material[slot / GROUP] as usize;
            nodes.vertex_of_node[*slot] != PADDING && self.materials[material].has_own_structure()
        };
        (0..nodes.vertex_of_node.len()).filter(has).collect()
    }

    /// The nodes as placed by the joints at a time [s].
    pub(crate) fn nodes_at(&self, time: f64) -> Nodes {
        let mut nodes = self.nodes.clone();
        let poses = self.loads.joints_at(time).1;
        for slot in 0..nodes.positions.len() {
            if let Some(pose) = poses.get(self.nodes.joint(slot) as usize) {
                nodes.positions[slot] = pose.transform_point3(nodes.positions[slot].as_dvec3()).as_vec3();
                nodes.normals[slot] = (pose.matrix3 * nodes.normals[slot].as_dvec3()).as_vec3();
            }
        }
        nodes
    }

    /// Number of joints, including the body.
    pub fn joints(&self) -> usize {
        self.loads.joints().joints().len() + 1
    }

    /// Joint of each of some nodes; 0 is the body.
    pub(crate) fn joints_of(&self, slots: impl Iterator<Item = usize>) -> Vec<u32> {
        slots.map(|slot| self.nodes.joint(slot)).collect()
    }

    /// Triangles of the model as it is drawn.
    pub(crate) fn triangle_count(&self) -> usize {
        self.triangle_runs.iter().map(|run| (run.triangles.1 - run.triangles.0) as usize).sum()
    }

    /// Checks the work up to a time [s] that may lie beyond the scene's steps.
    ///
    /// # Errors
    /// More steps, time or orbits than a run may have.
    pub(crate) fn cover(&self, time: f64) -> Result<(), PrepareError> {
        match too_late(time, self.scene.time.step, &self.scene.orbit) {
            Some(reason) => Err(PrepareError::Late { path: self.scene.source.clone(), reason }),
            None => Ok(()),
        }
    }

    /// Steps of the warm-up: its orbits in whole steps. 0 where it ends at the periodic state.
    pub fn warm_up_steps(&self) -> u32 {
        let time = &self.scene.time;
        if time.periodic.is_some() {
            return 0;
        }
        (time.warm_up_orbits * self.scene.orbit.period() / time.warm_up_step).round() as u32
    }

    /// Effects that the scene leaves out or that isotherm does not model, in words.
    pub(crate) fn switched_off(&self) -> Vec<String> {
        let environment = &self.scene.environment;
        let absent = [
            (environment.solar_constant.is_none(), "Sun"),
            (environment.planet_ir.is_none(), "planet infrared"),
            (environment.albedo.is_none(), "albedo"),
            (!environment.eclipse, "eclipse by the planet"),
            (environment.background_temperature.is_none(), "background (space is at 0 K)"),
            (self.scene.shadows.is_none(), "self-shadowing"),
            (self.scene.exchange.is_none(), "radiation between surfaces"),
            (self.loads.joints().is_empty(), "joints in motion"),
            (self.network.is_none(), "network (conduction, heaters)"),
            (self.scene.surrounded.reflections == Reflections::Off, "reflected radiance"),
            (self.scene.surrounded.background == Background::Off, "planet and space behind the craft"),
            (self.scene.sensor.is_none(), "sensor effects"),
        ];
        absent.iter().filter(|(off, _)| *off).map(|(_, name)| (*name).to_owned()).collect()
    }
}
