//! The steps of preparing a scene, in the order in which `Prepared::with_materials` takes them.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::DVec3;

use super::density;
use super::exchange::ExchangeCraft;
use super::network::{self, SceneNetwork};
use super::prepare_error::{PrepareError, PrepareStage};
use crate::environment::joints::Joint;
use crate::environment::orbit::period_disagreement;
use crate::environment::shadow::tree_boxes;
use crate::environment::sky::SkyError;
use crate::environment::step::{StepLoads, halved};
use crate::environment::{Attitude, Orbit};
use crate::files;
use crate::gpu::effects::image::runs::TriangleRun;
use crate::gpu::effects::thermal::variant::LightBy;
use crate::misspelt::suggestion;
use crate::model::nodes::{GROUP, Nodes};
use crate::model::{MergeSummary, Model, ModelError, Skipped};
use crate::raster::traced::LARGEST_REFLECTED;
use crate::scene::{Camera, Draw, Initial, JointMotion, Reflections, Scene, file_hash, scene_hash};
use crate::thermal::balance::{balance_temperature, emissivity_sum};
use crate::thermal::material::{Material, Response, Sides};
use crate::thermal::radiative::{PARTS_AT_MOST, time_constant};
use crate::thermal::shell::Shell;

/// Number of remarks about the model that are printed. `isotherm info MODEL` prints all.
const MOST_REMARKS: usize = 5;
/// Temperature that the nodes of a network may have without a Sun [K].
const ROOM: f64 = 300.0;

/// Longest step as a share of an orbit, beyond which its middle represents it poorly: 6 deg.
const LONGEST_STEP: f64 = 1.0 / 60.0;

/// Greatest turn of the Sun in a step [deg], beyond which its samples represent it poorly.
const LARGEST_TURN_DEG: f64 = 20.0;

/// Most numbers in the series of a run: about 1 TB of text.
const MOST_NUMBERS: f64 = 1e11;

/// Steps of the walk of joints with a rate in one step of the scene.
const WALKS_A_STEP: f64 = 4.0;

/// Longest part of a step in which the eclipse begins or ends, as a share of the shortest time constant of a surface. It leaves up to 0.25 K at 340 K.
const LONGEST_PART: f64 = 0.15;

/// Most times that such a step is halved.
const HALVINGS_AT_MOST: f64 = 6.0;
/// Turn of the Sun or of a joint against the craft in a step above which the light is found more often than once [rad]. In low orbit the Sun turns by 3.9 deg a minute.
const WIDEST_TURN: f64 = 4.0 * std::f64::consts::PI / 180.0;
/// Part of the shortest time constant in which the light may turn as far as it does.
const LONGEST_TURNED_PART: f64 = 0.03;
const TURN_HALVINGS_AT_MOST: f64 = 4.0;

/// SHA-256 of the files of a scene (hexadecimal).
#[derive(Debug, Clone)]
pub struct SceneHashes {
    /// Of all files together.
    pub all: String,
    /// Of each file.
    pub files: BTreeMap<PathBuf, String>,
}

impl SceneHashes {
    /// Hash of a file. Empty where the scene does not have the file.
    pub(crate) fn of_file(&self, path: &Path) -> String {
        self.files.get(path).cloned().unwrap_or_default()
    }
}

/// SHA-256 of all files together, and of each.
pub(super) fn hashes(files: &[PathBuf]) -> Result<SceneHashes, PrepareError> {
    let read = |path: &PathBuf| files::read(path).map_err(|source| PrepareError::Read { path: path.clone(), source });
    let contents = files.iter().map(read).collect::<Result<Vec<_>, _>>()?;
    let all = scene_hash(&contents.iter().map(Vec::as_slice).collect::<Vec<_>>());
    Ok(SceneHashes {
        all,
        files: files.iter().cloned().zip(contents.iter().map(|content| file_hash(content))).collect(),
    })
}

/// Warns of features of the model that are ignored.
pub(super) fn model_warnings(scene: &Scene, model: &mut Model) -> Vec<String> {
    let other = |skipped: &&Skipped| !skipped.what.ends_with("animation") && !skipped.what.ends_with("animations");
    let skipped = model.skipped.iter().filter(other);
    let mut remarks: Vec<String> = skipped.map(|one| format!("{}: left out, {}", one.what, one.why)).collect();
    remarks.extend(unplayed(scene, model));
    remarks.append(&mut model.notes);
    if remarks.len() > MOST_REMARKS {
        let more = remarks.len() - MOST_REMARKS;
        remarks.truncate(MOST_REMARKS);
        remarks.push(format!("and {more} more: isotherm info {}", scene.model_path.display()));
    }
    remarks
}

/// Says which animations no joint plays.
fn unplayed(scene: &Scene, model: &Model) -> Option<String> {
    let is_played = |name: &str| {
        let plays =
            |motion: &JointMotion| matches!(motion, JointMotion::Animation { name: played, .. } if played == name);
        scene.joints.iter().any(|joint| plays(&joint.motion))
    };
    let idle = model.animations.iter().filter(|one| !one.as_ref().is_ok_and(|animation| is_played(&animation.name)));
    let idle = idle.map(|one| match one {
        Ok(animation) => format!("'{}'", animation.name),
        Err(problem) => problem.clone(),
    });
    let idle: Vec<String> = idle.collect();
    let noun = if idle.len() == 1 { "animation" } else { "animations" };
    (!idle.is_empty())
        .then(|| format!("{} {noun} left out, because no [[joint]] plays it: {}", idle.len(), idle.join(", ")))
}

/// Reads the model, with a material for each part that rules tell apart, and places a camera without a pose before it.
pub(super) fn read_model(scene: &mut Scene) -> Result<Model, ModelError> {
    let (model, moved) = Model::load_within(&scene.model_path, &scene.reach)?.snap();
    let mut model = model.weld();
    if moved > 0 {
        scene.assumptions.push(format!("model: {moved} vertices lay beside others by rounding, and were moved there"));
    }
    scene.materials.split_by_part(&mut model);
    frame_camera(scene, &model);
    Ok(model)
}

fn frame_camera(scene: &mut Scene, model: &Model) {
    let drawn = model.triangles.iter().flatten().map(|vertex| model.positions[*vertex as usize]);
    let (low, high) = drawn.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
    let (middle, radius) = (0.5 * (low + high), 0.5 * (high - low).length());
    let told = scene.camera.as_mut().and_then(|camera| camera.frame(middle, radius));
    scene.assumptions.extend(told);
}

/// A model with the node density of its scene.
pub(super) struct Dense {
    pub(crate) model: Model,
    pub(crate) merged: Option<MergeSummary>,
    /// The triangles that cast shadows, as they were before long edges were split.
    pub(crate) occluders: Vec<[u32; 3]>,
}

/// Merges short edges and splits long ones.
pub(super) fn at_density(
    scene: &mut Scene,
    model: Model,
    materials: &[Material],
    progress: &mut dyn FnMut(PrepareStage),
) -> Result<Dense, PrepareError> {
    density::choose(scene, &model);
    let (mut model, merged) = density::merge(scene, model)?;
    scene.assumptions.extend(merged.as_ref().map(density::describe));
    let conducts = |material: u32| matches!(materials[material as usize].response, Response::Network);
    let split = model.split_at_hanging_vertices(conducts);
    if split > 0 {
        scene.assumptions.push(format!(
            "model: {split} triangle(s) have vertices of others within their edges, and were split there, so that heat is conducted across"
        ));
        model = model.weld();
    }
    // Splitting appends vertices, so these triangles keep their corners.
    let occluders = if scene.shadows.is_some() { model.triangles.clone() } else { Vec::new() };
    let has_network = materials.iter().any(|material| matches!(material.response, Response::Network));
    Ok(Dense { model: density::split(scene, model, has_network, progress)?, merged, occluders })
}

/// Warns of a step that is long for the orbit, and of a period that differs from Kepler's.
pub(super) fn orbit_warnings(scene: &Scene) -> Vec<String> {
    let mut warnings = Vec::new();
    if scene.time.step > LONGEST_STEP * scene.orbit.period() {
        warnings.push(format!(
            "a step of {} s is {:.1} deg of the orbit: planet infrared and albedo are those of its middle, not its mean",
            scene.time.step,
            360.0 * scene.time.step / scene.orbit.period()
        ));
    }
    if let Orbit::Circular(orbit) = &scene.orbit
        && let Some(disagreement) = period_disagreement(orbit, scene.environment.planet_radius)
    {
        warnings.push(disagreement.to_string());
    }
    warnings
}

/// Triangles with node indices instead of vertex indices, sorted by joint. Each joint's run begins at a multiple of `alignment`, after triangles without
/// area. The order within a joint is kept. Without joints the list does not change.
pub(super) fn by_joint(triangles: Vec<[u32; 3]>, nodes: &Nodes, alignment: usize) -> (Vec<[u32; 3]>, Vec<TriangleRun>) {
    let of_nodes = |triangle: [u32; 3]| triangle.map(|vertex| nodes.node_of_vertex[vertex as usize]);
    let triangles: Vec<_> = triangles.into_iter().map(of_nodes).collect();
    let joints = nodes.ranges.iter().map(|range| range.joint + 1).max().unwrap_or(1);
    if joints == 1 {
        let runs = vec![TriangleRun { joint: 0, triangles: (0, triangles.len() as u32) }];
        return (triangles, runs);
    }
    let mut of_joint = vec![Vec::new(); joints as usize];
    for triangle in triangles {
        of_joint[nodes.joint(triangle[0] as usize) as usize].push(triangle);
    }
    let (mut sorted, mut runs) = (Vec::new(), Vec::new());
    for (joint, triangles) in of_joint.into_iter().enumerate().filter(|(_, triangles)| !triangles.is_empty()) {
        sorted.resize(sorted.len().next_multiple_of(alignment), [0; 3]);
        let first = sorted.len() as u32;
        sorted.extend(triangles);
        runs.push(TriangleRun { joint: joint as u32, triangles: (first, sorted.len() as u32) });
    }
    (sorted, runs)
}

/// Refuses reflections of a craft with more triangles than the tree for their rays can hold.
pub(super) fn check_traced(scene: &Scene, triangles: &[[u32; 3]]) -> Result<(), PrepareError> {
    let boxes = tree_boxes(triangles.len());
    if scene.surrounded.reflections != Reflections::Traced || boxes <= LARGEST_REFLECTED {
        return Ok(());
    }
    Err(PrepareError::TooManyReflected { path: scene.source.clone(), triangles: triangles.len(), boxes })
}

/// Loads of every step from the start of the warm-up, and the walks of the joints.
pub(super) fn loads(
    scene: &Scene,
    materials: &[Material],
    light: LightBy,
    moving: Vec<Joint>,
) -> Result<StepLoads, PrepareError> {
    let failed = |source| PrepareError::Sky { path: scene.source.clone(), source };
    let loads = StepLoads::new(&scene.orbit, &scene.attitude, &scene.environment).map_err(failed)?;
    // A periodic warm-up steps the same orbit again.
    let orbits = if scene.time.periodic.is_some() { 1.0 } else { scene.time.warm_up_orbits };
    let before = orbits * scene.orbit.period();
    if !before.is_finite() {
        return Err(failed(SkyError::NotFinite { what: "the warm-up of an orbit that is not closed", value: before }));
    }
    // One more step at both ends, because the lengths of a warm-up and of a shorter last step are rounded.
    let slack = if before > 0.0 { scene.time.step.max(scene.time.warm_up_step) } else { 0.0 };
    // The last rows of a rolling shutter are taken after the last step.
    let shutter = scene.camera.as_ref().filter(|_| scene.time.draw != Draw::None).map_or(0.0, Camera::shutter_time);
    let span = [-before - slack, f64::from(scene.time.steps) * scene.time.step + shutter];
    loads.sky_model().check(span[0], span[1]).map_err(failed)?;
    let loads = loads.with_parts_of(shortest_part(scene, materials));
    let loads = loads.with_parts_by_turn(turned_parts(scene, materials, light));
    Ok(loads.with_joints(moving, span[0], scene.time.step / WALKS_A_STEP))
}

/// Length down to which a step is halved where the eclipse begins or ends in it [s]. Infinite where the step is short for every surface.
fn shortest_part(scene: &Scene, materials: &[Material]) -> f64 {
    part_of_fastest(scene, materials, LONGEST_PART, HALVINGS_AT_MOST)
}

/// Turn of the Sun or of a joint above which a step is halved [rad], and the length down to which it is [s]. Infinite where normals tell the light, or where the step is short for every surface.
fn turned_parts(scene: &Scene, materials: &[Material], light: LightBy) -> [f64; 2] {
    match light {
        LightBy::Normal => [f64::INFINITY; 2],
        _ => [WIDEST_TURN, part_of_fastest(scene, materials, LONGEST_TURNED_PART, TURN_HALVINGS_AT_MOST)],
    }
}

/// The step, halved down to a share of the shortest time constant but `at_most` times [s]. Infinite where the step is that short.
fn part_of_fastest(scene: &Scene, materials: &[Material], share: f64, at_most: f64) -> f64 {
    let constants = materials.iter().zip(hottest(scene, materials));
    let shortest =
        constants.filter_map(|(material, hottest)| time_constant(material, hottest)).fold(f64::INFINITY, f64::min);
    let part = halved(scene.time.step, share * shortest, at_most);
    if part < scene.time.step { part } else { f64::INFINITY }
}

/// Refuses a series that no disk would hold.
pub(super) fn check_series(scene: &Scene, parts: usize, materials: usize) -> Result<(), PrepareError> {
    let columns = 3 * (1 + parts + materials) + scene.probes.len();
    let rows = u64::from(scene.time.steps) + 1;
    if rows as f64 * columns as f64 <= MOST_NUMBERS {
        return Ok(());
    }
    Err(PrepareError::LongSeries { path: scene.source.clone(), rows, columns, limit: MOST_NUMBERS })
}

/// Warns of a craft that turns far against the Sun in a step.
pub(super) fn turn_warning(scene: &Scene, loads: &StepLoads) -> Option<String> {
    // The chords of a sweep do not contain whole turns.
    let turn = match scene.attitude {
        Attitude::Spin { rate, .. } => (rate * scene.time.step).abs(),
        _ => loads.sky_model().sun_sweep(0.0, scene.time.step),
    }
    .to_degrees();
    (scene.environment.solar_constant.is_some() && turn > LARGEST_TURN_DEG).then(|| {
        format!("the craft turns {turn:.0} deg against the Sun in a step: its loads are averaged over few directions")
    })
}

pub(super) fn probe_nodes(scene: &Scene, parts: &[String], nodes: &Nodes) -> Result<Vec<usize>, PrepareError> {
    let mut found = Vec::new();
    for probe in &scene.probes {
        let part = match &probe.part {
            None => None,
            Some(name) => Some(parts.iter().position(|part| part == name).ok_or_else(|| PrepareError::ProbePart {
                path: scene.source.clone(),
                probe: probe.name.clone(),
                part: name.clone(),
                near: suggestion(name, parts.iter().map(String::as_str)),
            })? as u32),
        };
        found.push(nearest_node(nodes, probe.position, part).unwrap_or(0));
    }
    Ok(found)
}

/// The node nearest to a position in the file's pose [m], of a part where one is stated.
pub(super) fn nearest_node(nodes: &Nodes, position: DVec3, part: Option<u32>) -> Option<usize> {
    let distance = |node: &u32| nodes.positions[*node as usize].as_dvec3().distance_squared(position);
    let of_part = |node: &&u32| part.is_none_or(|part| nodes.group_part[**node as usize / GROUP] == part);
    let nearest = nodes.node_of_vertex.iter().filter(of_part).min_by(|a, b| distance(a).total_cmp(&distance(b)));
    nearest.map(|node| *node as usize)
}

/// Lets the temperatures of `[temperatures]` take the place of what materials do.
pub(super) fn give_temperatures(scene: &Scene, materials: &mut [Material]) {
    if scene.temperatures.is_some() {
        materials.iter_mut().for_each(|material| material.response = Response::Given);
    }
}

/// Refuses response functions whose pieces do not follow them. Almost all such functions were refused where they were read.
pub(super) fn check_functions(scene: &Scene, materials: &[Material]) -> Result<(), PrepareError> {
    for material in materials {
        let Response::Transition(transition) = &material.response else { continue };
        for profile in [&transition.heating, &transition.cooling] {
            profile.function.check().map_err(|source| PrepareError::Function {
                path: scene.source.clone(),
                material: material.name.clone(),
                source,
            })?;
        }
    }
    Ok(())
}

/// Tells plates how hot they get. Refuses structures that store too little heat for the step.
pub(super) fn set_hottest(scene: &Scene, materials: &mut [Material]) -> Result<(), PrepareError> {
    let start = match scene.initial {
        Initial::Balance => 0.0,
        Initial::Temperature(temperature) => temperature,
    };
    let hottest = hottest(scene, materials);
    for (material, hottest) in materials.iter_mut().zip(hottest) {
        let Response::Radiative(plate) = &mut material.response else { continue };
        plate.hottest = hottest.max(start);
        if plate.parts() > PARTS_AT_MOST {
            return Err(PrepareError::LightStructure {
                path: scene.source.clone(),
                material: material.name.clone(),
                step: scene.time.step,
            });
        }
    }
    Ok(())
}

/// Balance temperature of each material in full sunlight [K], at least that of a room.
pub(super) fn hottest(scene: &Scene, materials: &[Material]) -> Vec<f64> {
    let environment = &scene.environment;
    let sun = environment.solar_constant.unwrap_or(0.0) * (1.0 + environment.albedo.unwrap_or(0.0));
    let balance = |material: &Material| {
        let back = match material.sides {
            Sides::Outside => 0.0,
            Sides::Both { back } => back.absorptivity,
        };
        let emissivity = emissivity_sum(material);
        let infrared = emissivity * environment.planet_ir.unwrap_or(0.0);
        let absorbed = material.front.absorptivity.max(back) * sun + infrared;
        let balance = balance_temperature(absorbed, emissivity, environment.background_temperature.unwrap_or(0.0));
        if balance.is_finite() { balance.max(ROOM) } else { ROOM }
    };
    materials.iter().map(balance).collect()
}

/// The thermal network of the model's shell, with the scene's contacts and heaters.
pub(super) fn network(
    scene: &mut Scene,
    shell: Option<Shell>,
    parts: &[String],
    nodes: &Nodes,
    probes: &[usize],
    materials: &[Material],
) -> Result<Option<Arc<SceneNetwork>>, PrepareError> {
    let Some(shell) = shell else {
        if scene.contacts.is_empty() && scene.heaters.is_empty() {
            return Ok(None);
        }
        let message = "[[contact]] and [[heater]] need materials with response = 'network'";
        return Err(PrepareError::network(scene, message));
    };
    let network = SceneNetwork::new(shell, scene, parts, nodes, probes, &hottest(scene, materials))?;
    let hollow = if scene.exchange.is_some() { network::HOLLOW_WITH_EXCHANGE } else { network::HOLLOW };
    scene.assumptions.push(hollow.to_owned());
    Ok(Some(Arc::new(network)))
}

/// The patches that radiate to each other, where the scene has `[exchange]`. They are the patches of a craft that is `like` this one, where there is one.
pub(super) fn exchange(
    scene: &Scene,
    nodes: &Nodes,
    triangles: &[[u32; 3]],
    network: Option<&SceneNetwork>,
    materials: &[Material],
    loads: &StepLoads,
    like: Option<&Arc<ExchangeCraft>>,
) -> Result<Option<Arc<ExchangeCraft>>, PrepareError> {
    let craft = |settings| match like {
        Some(like) => Ok(like.with_optics(materials)),
        None => {
            let joints = loads.joints();
            ExchangeCraft::new(settings, scene.time.step, nodes, triangles, network, materials, joints).map(Arc::new)
        }
    };
    let exchange = scene.exchange.map(craft).transpose();
    exchange.map_err(|message| PrepareError::Exchange { path: scene.source.clone(), message })
}
