//! Measures the cost of each model choice, and its change in temperature and radiance. Each run changes one choice.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use rayon::prelude::*;
use serde::Serialize;

use super::clock::{Deadline, OUT_OF_TIME};
use super::frames::resize;
use crate::compare::responses::{self, OfMaterial};
use crate::compare::walk;
use crate::converge::pixels::SurfaceImage;
use crate::exchange::step::ExchangeSettings;
use crate::gpu::context::Context;
use crate::model::nodes::GROUP;
use crate::output::statistics::Percentiles;
use crate::scene::{Draw, Scene};
use crate::simulation::device_engine::DeviceEngine;
use crate::simulation::engine::{Engine, EngineError};
use crate::simulation::prepare::Prepared;
use crate::simulation::start;
use crate::thermal::material::{Domain, Retarget};
use crate::thermal::network::control::Integrator;

/// Steps of an orbit. Longer steps would represent planet loads badly.
const STEPS: u32 = 60;
/// Steps of a quick run: a quarter of an orbit instead of the periodic state.
const QUICK_STEPS: u32 = 12;
/// Most orbits of the warm-up if nothing conducts. Rays take up to a second a step.
pub(crate) const MOST_ORBITS: f64 = 3.0;
/// Steps between two images.
pub(crate) const DRAW_EVERY: u32 = 6;
/// Size of the images [px].
const IMAGE: [u32; 2] = [320, 256];
/// The model choices of one scene.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Models {
    pub(crate) scene: String,
    pub(crate) nodes: usize,
    /// Length of a step [s].
    pub(crate) step_s: f64,
    /// Number of compared steps.
    pub(crate) steps: u32,
    /// The choices. The base comes first.
    pub(crate) choices: Vec<ChoiceRow>,
}

#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub(crate) struct ChoiceRow {
    /// The choice, or its change against the base.
    pub(crate) choice: String,
    /// Median device time of the thermal and network passes of a step [ms]. The wall time where the processor
    /// steps a network.
    pub(crate) step_ms: Option<f64>,
    pub(crate) from_base: Option<Moved>,
    pub(crate) from_network: Option<Moved>,
    /// The reason if there are no numbers.
    pub(crate) failed: Option<String>,
}

/// The differences between two runs.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct Moved {
    /// Root mean square over area and steps [K].
    pub(crate) rms_k: f64,
    /// Largest [K].
    pub(crate) max_k: f64,
    /// Root mean square over the craft's pixels [W m-2 sr-1].
    pub(crate) radiance_rms: f64,
    /// Mean radiance of the craft's pixels in the other run [W m-2 sr-1].
    pub(crate) radiance_mean: f64,
}

/// An error of a choice.
pub(super) type Failed = Box<dyn std::error::Error>;

/// What moves the temperatures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Moves {
    Instant,
    /// The fitted transitions, with another retarget rule and domain where one is given.
    Transition(Option<Retarget>, Option<Domain>),
    Radiative,
    /// With another integrator at its own tolerance where one is given.
    Network(Option<Integrator>),
}

impl Moves {
    /// A scene with these responses. `of` has the fitted transition of each material.
    pub(super) fn prepared(self, mut scene: Scene, fits: &[OfMaterial]) -> Result<Prepared, Failed> {
        let quiet = &mut |_| ();
        Ok(match self {
            Self::Instant => responses::instant(&scene, quiet)?,
            Self::Transition(retarget, domain) => {
                let mut fits = fits.to_vec();
                for transition in fits.iter_mut().filter_map(|one| one.transition.as_mut()) {
                    transition.domain = domain.unwrap_or(transition.domain);
                    transition.retarget = retarget.unwrap_or(transition.retarget);
                }
                responses::transition(&scene, &fits, quiet)?
            }
            Self::Radiative => responses::radiative(&scene, quiet)?,
            Self::Network(integrator) => {
                if let Some(integrator) = integrator {
                    (scene.network.integrator, scene.network.tolerance) = (integrator, None);
                }
                responses::network(&scene, quiet)?
            }
        })
    }
}

/// A change of the scene. `ExchangeSettings` hold for radiation between surfaces.
type Change = fn(&mut Scene, ExchangeSettings);

/// A fit may be in either domain, and the base is in T.
const BASE: Moves = Moves::Transition(None, Some(Domain::Temperature));
const NETWORK: Moves = Moves::Network(None);
const UNCHANGED: Change = |_, _| ();
const EXCHANGE: Change = |scene, exchange| scene.exchange = Some(exchange);
/// The choices. The base comes first.
const CHOICES: [(&str, Moves, Change); 11] = [
    ("transition in T, merge, all loads, shadows", BASE, UNCHANGED),
    ("without shadows", BASE, |scene, _| scene.shadows = None),
    ("retarget = restart", Moves::Transition(Some(Retarget::Restart), Some(Domain::Temperature)), UNCHANGED),
    ("domain = T4", Moves::Transition(None, Some(Domain::FourthPower)), UNCHANGED),
    ("response = instant", Moves::Instant, UNCHANGED),
    ("response = network", NETWORK, UNCHANGED),
    ("without albedo", BASE, |scene, _| scene.environment.albedo = None),
    ("without the planet's infrared", BASE, |scene, _| scene.environment.planet_ir = None),
    ("without eclipse", BASE, |scene, _| scene.environment.eclipse = false),
    ("with radiation between surfaces", BASE, EXCHANGE),
    ("response = network, with radiation between surfaces", NETWORK, EXCHANGE),
];

/// The base scene for a choice.
fn changed(base: &Scene, moves: Moves, change: Change, exchange: ExchangeSettings) -> Scene {
    let mut scene = base.clone();
    if moves != NETWORK {
        scene.time.warm_up_orbits = scene.time.warm_up_orbits.min(MOST_ORBITS);
    }
    change(&mut scene, exchange);
    scene
}

pub(super) struct ModelRun {
    /// Temperatures of the vertices at every step [K].
    temperatures: Vec<Vec<f32>>,
    /// Radiance of the drawn steps [W m-2 sr-1].
    images: Vec<Vec<f32>>,
    /// Temperatures and parts of the same pixels.
    pub(super) surfaces: Vec<SurfaceImage>,
    /// Median time of a step [ms], including the network.
    pub(super) step_ms: Option<f64>,
}

/// Scene and settings that the choices have in common.
pub(crate) struct Basis {
    /// One orbit of the scene in long steps, with shadows.
    pub(super) scene: Scene,
    pub(super) fits: Vec<OfMaterial>,
    /// Areas of the vertices [m2].
    pub(super) areas: Vec<f64>,
    nodes: usize,
    /// Patches of the choices with radiation between surfaces.
    exchange: ExchangeSettings,
    /// The scene's own settings of this radiation, where the scene asks for it.
    pub(super) stated: Option<ExchangeSettings>,
}

impl Basis {
    /// The orbit of a scene whose materials state network values, and the transitions that fit them. `quick` takes a part of an orbit.
    ///
    /// # Errors
    /// The scene cannot be prepared, or the device fails.
    pub(crate) fn new(context: &Arc<Context>, scene: &Scene, quick: bool, says: &dyn Fn(&str)) -> Result<Self, Failed> {
        let mut base = one_orbit(scene, quick);
        let stated = base.exchange.take();
        // The fitted transitions need the network's values.
        let network = responses::network(&base, &mut |_| ())?;
        // Choices without light between surfaces have the same nodes.
        base.density.clone_from(&network.scene.density);
        says("model choices: what transitions are fitted to");
        let areas: Vec<f64> =
            network.nodes.node_of_vertex.iter().map(|node| network.nodes.areas[*node as usize]).collect();
        let exchange = stated.unwrap_or_default();
        let instant = changed(&base, Moves::Instant, UNCHANGED, exchange);
        let instant = run(context, &Moves::Instant.prepared(instant, &[])?)?;
        let material = |node: &u32| network.nodes.group_material[*node as usize / GROUP];
        let range = |vertex: usize| {
            let own = instant.temperatures.iter().map(|row| row[vertex]);
            own.fold([f32::INFINITY, f32::NEG_INFINITY], |[low, high], t| [low.min(t), high.max(t)])
        };
        let vertices = network.nodes.node_of_vertex.iter().zip(&areas).enumerate();
        let vertices = vertices.map(|(vertex, (node, area))| (material(node), *area, range(vertex)));
        let fits = responses::transitions(&network, &walk::swings(network.materials.len(), vertices))?;
        Ok(Self { scene: base, fits, areas, nodes: network.nodes.count, exchange, stated })
    }
}

/// Measures all choices of a scene. `quick` leaves the network out. If a choice fails, its row states the reason.
pub(crate) fn measure(
    context: &Arc<Context>,
    basis: &Basis,
    quick: bool,
    deadline: Deadline,
    says: &dyn Fn(&str),
) -> Models {
    let Basis { scene: base, fits, areas, nodes, exchange, .. } = basis;
    let mut rows: Vec<(ChoiceRow, Option<ModelRun>)> = Vec::new();
    for (name, moves, change) in CHOICES {
        let row = ChoiceRow { choice: name.to_owned(), ..ChoiceRow::default() };
        if quick && moves == NETWORK {
            rows.push((ChoiceRow { failed: Some("left out by --quick".to_owned()), ..row }, None));
            continue;
        }
        if !rows.is_empty() && deadline.is_past() {
            rows.push((ChoiceRow { failed: Some(OUT_OF_TIME.to_owned()), ..row }, None));
            continue;
        }
        says(&format!("model choices: {name}"));
        let scene = changed(base, moves, change, *exchange);
        let ran = moves.prepared(scene, fits).and_then(|prepared| Ok(run(context, &prepared)?));
        match ran {
            Err(error) => rows.push((ChoiceRow { failed: Some(error.to_string()), ..row }, None)),
            Ok(ran) => rows.push((ChoiceRow { step_ms: ran.step_ms, ..row }, Some(ran))),
        }
    }
    let network = CHOICES.iter().position(|(_, moves, _)| *moves == NETWORK).unwrap_or(0);
    let moved = |ran: &ModelRun, from: usize, choice: usize| -> Option<Moved> {
        rows[from].1.as_ref().filter(|_| from != choice).map(|from| ran.moved(from, areas))
    };
    let choices = rows.iter().enumerate().map(|(choice, (row, ran))| match ran {
        None => row.clone(),
        Some(ran) => {
            ChoiceRow { from_base: moved(ran, 0, choice), from_network: moved(ran, network, choice), ..row.clone() }
        }
    });
    Models {
        scene: base.name.clone(),
        nodes: *nodes,
        step_s: base.time.step,
        steps: base.time.steps,
        choices: choices.collect(),
    }
}

/// The scene through one orbit of long steps with shadows. The run starts from the periodic state if the scene asks for it, otherwise after one
/// orbit. With `quick` it starts after a quarter of an orbit.
fn one_orbit(scene: &Scene, quick: bool) -> Scene {
    let mut base = scene.clone();
    base.sensor = None;
    base.time.draw = Draw::Every(DRAW_EVERY);
    base.time.steps = if quick { QUICK_STEPS } else { STEPS };
    base.time.step = base.orbit.period() / f64::from(base.time.steps);
    base.time.periodic = scene.time.periodic.filter(|_| !quick).map(|tolerance| tolerance.max(0.5));
    if base.time.periodic.is_none() {
        base.time.warm_up_orbits = if quick { 0.25 } else { 1.0 };
    }
    base.shadows = Some(scene.shadows.unwrap_or_default());
    if let Some(camera) = &mut base.camera {
        resize(camera, IMAGE);
    }
    base
}

pub(super) fn run(context: &Arc<Context>, prepared: &Prepared) -> Result<ModelRun, EngineError> {
    let camera = prepared.scene.camera.as_ref();
    let mut engine = DeviceEngine::new(context, prepared, camera)?;
    start(prepared, &mut engine, None, &AtomicBool::new(false), &mut || ())?;
    let mut before = device_ms(&engine);
    let mut step_ms = Vec::new();
    let length = prepared.scene.time.step;
    let mut ran = ModelRun { temperatures: vec![], images: vec![], surfaces: vec![], step_ms: None };
    for number in 1..=prepared.scene.time.steps {
        let to = f64::from(number) * length;
        walk::advance(prepared, &mut engine, number)?;
        let after = device_ms(&engine);
        let device = after.zip(before).map(|(after, before)| after - before);
        // The cost of a network that the processor steps includes the passes of the device.
        step_ms.extend(engine.network_costs().last().map(|cost| cost.wall_ms).or(device));
        before = after;
        ran.temperatures.push(walk::of_vertices(prepared, &walk::temperatures(&mut engine)?));
        if camera.is_some()
            && number % DRAW_EVERY == 0
            && let Some(image) = walk::draw(prepared, &mut engine, to)?.1
        {
            ran.images.push(image.radiance);
            ran.surfaces.push((image.temperature, image.part));
        }
    }
    // A median, because the first steps also compile pipelines.
    ran.step_ms = Percentiles::of(&step_ms).map(|spread| spread.median);
    Ok(ran)
}

/// Device time of all thermal and network passes so far [ms].
fn device_ms(engine: &dyn Engine) -> Option<f64> {
    let passes = engine.pass_times()?;
    let of_step = |name: &str| ["thermal_step", "exchange_", "one_pass"].iter().any(|start| name.starts_with(start));
    let passes = passes.iter().filter(|(name, _)| of_step(name));
    Some(passes.map(|(_, samples)| samples.iter().sum::<f64>()).sum())
}

impl ModelRun {
    pub(super) fn moved(&self, from: &Self, areas: &[f64]) -> Moved {
        let whole: f64 = areas.iter().sum::<f64>() * self.temperatures.len() as f64;
        let of_step = |(here, other): (&Vec<f32>, &Vec<f32>)| {
            let differences = here.iter().zip(other).map(|(a, b)| f64::from(*a) - f64::from(*b));
            let squares: f64 = differences.clone().zip(areas).map(|(d, area)| area * d * d).sum();
            (squares, differences.map(f64::abs).fold(0.0, f64::max))
        };
        let rows: Vec<(f64, f64)> = self.temperatures.par_iter().zip(&from.temperatures).map(of_step).collect();
        let pixels = || {
            let images = self.images.iter().zip(&from.images).flat_map(|(a, b)| a.iter().zip(b));
            images.map(|(a, b)| (f64::from(*a), f64::from(*b))).filter(|(a, b)| *a > 0.0 || *b > 0.0)
        };
        let count = pixels().count().max(1) as f64;
        Moved {
            rms_k: (rows.iter().map(|row| row.0).sum::<f64>() / whole).sqrt(),
            max_k: rows.iter().map(|row| row.1).fold(0.0, f64::max),
            radiance_rms: (pixels().map(|(a, b)| (a - b) * (a - b)).sum::<f64>() / count).sqrt(),
            radiance_mean: pixels().map(|(_, b)| b).sum::<f64>() / count,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ran(temperature: f32, radiance: f32) -> ModelRun {
        let images = vec![vec![radiance, 0.0]];
        ModelRun { temperatures: vec![vec![temperature, 300.0]; 2], images, surfaces: vec![], step_ms: None }
    }

    #[test]
    fn what_moved_is_weighted_with_area_and_counts_no_empty_pixel() {
        let moved = ran(304.0, 12.0).moved(&ran(300.0, 10.0), &[1.0, 3.0]);
        // A quarter of the area differs by 4 K.
        assert_eq!(moved, Moved { rms_k: 2.0, max_k: 4.0, radiance_rms: 2.0, radiance_mean: 10.0 });
    }
}
