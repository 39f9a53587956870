//! The budget of every node and of every pixel: what a surface gains by each cause at a moment [W/m2] (docs/numerics.md 9).
//!
//! The light is the light of the last step, which every response was stepped with. Temperatures, conduction and heaters are the present ones. Storage is the loss
//! that closes the budget. A node of a network or a plate thus has exactly the rate at which its temperature changes.

use rayon::prelude::*;

use super::corner_image::{PixelNodes, pixel_nodes};
use super::engine::{Engine, EngineError, SurfaceState};
use super::image::Image;
use super::parts::Passing;
use super::pixel_light::gains::FoilGains;
use super::prepare::Prepared;
use crate::environment::StepLoad;
use crate::environment::shadow::Lit;
use crate::model::nodes::GROUP;
use crate::thermal::budget::{Budget, CAUSES, EMITTED, STORED, SUN, SurfaceGains};
use crate::thermal::incident::{IncidentFunction, incident};
use crate::thermal::material::{Material, Response};
use crate::thermal::reference::Reference;

/// The budgets of all nodes in device order, at a time [s]. `last` is the step that ended there; before the first one, the light is the light of the warm-up's end.
///
/// # Errors
/// A call that fails.
pub(crate) fn node_budgets(
    prepared: &Prepared,
    engine: &mut dyn Engine,
    last: Option<Passing>,
    time: f64,
) -> Result<Vec<Budget>, EngineError> {
    let load = load_before(prepared, last, time);
    let state = engine.surfaces()?;
    let mut gains = light(prepared, &load, &state);
    let material = |slot: usize| &prepared.materials[prepared.nodes.group_material[slot / GROUP] as usize];
    for (slot, _) in prepared.nodes.real() {
        gains[slot] = gains[slot].at(material(slot), state.temperatures[slot], load.background_temperature);
    }
    for (slot, structure) in prepared.structures().into_iter().zip(&state.structures) {
        gains[slot].conduction = by_structure(material(slot), state.temperatures[slot], *structure);
    }
    conduct(prepared, engine, &load, &state, time, &mut gains);
    Ok(gains.iter().map(SurfaceGains::closed).collect())
}

/// The load under which the last step ended.
pub(super) fn load_before(prepared: &Prepared, last: Option<Passing>, time: f64) -> StepLoad {
    let scene = &prepared.scene;
    let warmed = || {
        let length = scene.time.warm_up_step;
        Passing { start: time - length, end: time, steps: length / scene.time.step }
    };
    let last = last.or_else(|| (scene.time.warm_up_orbits > 0.0).then(warmed));
    let part = last.and_then(|last| last.parts(&prepared.loads).pop());
    part.map_or_else(|| prepared.loads.step_load(time, time), |part| prepared.loads.step_load(part.start, part.end))
}

/// All nodes under the light of a step, and the slot of each on the device.
pub(super) fn lit_nodes(
    prepared: &Prepared,
    load: &StepLoad,
    state: &SurfaceState,
) -> (Vec<usize>, Reference<IncidentFunction>) {
    let nodes = &prepared.nodes;
    let slots: Vec<usize> = nodes.real().map(|(slot, _)| slot).collect();
    let joints = if prepared.joints() > 1 { prepared.joints_of(slots.iter().copied()) } else { Vec::new() };
    let own = slots.iter().map(|slot| nodes.reference_node(*slot)).collect();
    let incident = incident as IncidentFunction;
    let mut reference = Reference::new(own, prepared.materials.clone(), incident).with_joints(joints);
    match &state.lit {
        Some(Lit { areas, by_rays }) => {
            reference.light(Lit { areas: slots.iter().map(|slot| areas[*slot]).collect(), by_rays: *by_rays });
        }
        None => reference.find_light(&mut prepared.lit_areas(slots.iter().copied()), load),
    }
    if !state.received.is_empty() {
        reference.receive(slots.iter().map(|slot| state.received[*slot]).collect());
    }
    (slots, reference)
}

/// The light that every node absorbs.
fn light(prepared: &Prepared, load: &StepLoad, state: &SurfaceState) -> Vec<SurfaceGains> {
    let (slots, reference) = lit_nodes(prepared, load, state);
    let nodes = &prepared.nodes;
    let mut gains = vec![SurfaceGains::default(); nodes.vertex_of_node.len()];
    slots.iter().zip(reference.gains(load)).for_each(|(slot, of_node)| gains[*slot] = of_node);
    gains
}

/// Heat that a plate gains from the structure below [W/m2].
fn by_structure(material: &Material, plate: f64, structure: f64) -> f64 {
    match &material.response {
        Response::Radiative(own) => own.exchange() * (structure.powi(4) - plate.powi(4)),
        _ => 0.0,
    }
}

/// Gives the nodes of a network their conduction, their heaters, and their emission at its temperatures. Nodes of the device that are one node of the network have one
/// temperature, so conduction evens out what each absorbs.
fn conduct(
    prepared: &Prepared,
    engine: &dyn Engine,
    load: &StepLoad,
    state: &SurfaceState,
    time: f64,
    gains: &mut [SurfaceGains],
) {
    let (Some(scene), Some(run)) = (&prepared.network, engine.network()) else { return };
    let of_nodes = run.gains(&state.network, time);
    let slots = || prepared.nodes.real().map(|(slot, _)| slot).filter(|slot| scene.has(*slot));
    let mut sums = of_nodes.conducted;
    for slot in slots() {
        let node = scene.node_of(slot);
        let material = &prepared.materials[prepared.nodes.group_material[slot / GROUP] as usize];
        gains[slot] = gains[slot].at(material, state.network[node], load.background_temperature);
        sums[node] += scene.load_area(slot).unwrap_or(0.0) * gains[slot].sum();
    }
    for slot in slots() {
        let node = scene.node_of(slot);
        let area = of_nodes.areas[node];
        if area > 0.0 {
            gains[slot].conduction = sums[node] / area - gains[slot].sum();
            gains[slot].heater = of_nodes.heated[node] / area;
        }
    }
}

/// Budgets between two moments, of which this share has passed.
pub(crate) fn between_budgets(before: &[Budget], after: &[Budget], share: f64) -> Vec<Budget> {
    let mix = |(before, after): (&Budget, &Budget)| -> Budget {
        std::array::from_fn(|cause| before[cause] + share * (after[cause] - before[cause]))
    };
    before.iter().zip(after).map(mix).collect()
}

/// The heat of each part by each cause [W], and the area of the part [m2].
pub(crate) fn part_heat(prepared: &Prepared, budgets: &[Budget]) -> Vec<(Budget, f64)> {
    let nodes = &prepared.nodes;
    let mut sums = vec![([0.0; CAUSES], 0.0); prepared.parts.len()];
    for (slot, _) in nodes.real() {
        let area = prepared.light_area(slot);
        let (sum, whole) = &mut sums[nodes.group_part[slot / GROUP] as usize];
        sum.iter_mut().zip(budgets[slot]).for_each(|(sum, gain)| *sum += area * gain);
        *whole += area;
    }
    sums
}

/// The budget of each part, as the mean over its area [W/m2]. A part without area has none.
pub(crate) fn part_budgets(prepared: &Prepared, budgets: &[Budget]) -> Vec<Budget> {
    let sums = part_heat(prepared, budgets);
    sums.iter().map(|(sum, area)| sum.map(|sum| if *area > 0.0 { sum / area } else { 0.0 })).collect()
}

/// States the budget of every pixel of an image. Between the nodes of a triangle every gain follows a straight line. A pixel with light of its own has sunlight and
/// emission of its own too. `number` is the number of an image at its own time.
pub(crate) fn draw_budgets(prepared: &Prepared, budgets: &[Budget], image: &mut Image, number: Option<u32>) {
    let parts = part_budgets(prepared, budgets);
    let of_part = |part: &u32| Some(*parts.get(part.checked_sub(1)? as usize)?);
    let past = prepared.past_light(image.time);
    let foil = past.as_ref().map(FoilGains::new);
    let nodes = pixel_nodes(prepared, image, number);
    let between = |of: PixelNodes, kelvin: f64| -> Budget {
        let mixed: Budget = std::array::from_fn(|cause| of.mix(|node| budgets[node][cause]));
        let emitted = of.nodes.map(|node| budgets[node][EMITTED]);
        let own = foil.as_ref().and_then(|foil| foil.of_place(of.nodes, of.weights, (kelvin, emitted)));
        own.map_or(mixed, |[sun, emitted]| with_own_light(mixed, sun, emitted))
    };
    let shown = |(pixel, part): (usize, &u32)| -> [f32; CAUSES] {
        let of_nodes = nodes[pixel].map(|of| between(of, f64::from(image.temperature[pixel])));
        // A lone pixel at the rim has the budget of its part.
        of_nodes.or_else(|| of_part(part)).unwrap_or_default().map(|gain| gain as f32)
    };
    image.budget = image.part.par_iter().enumerate().map(shown).collect();
}

/// A budget with another sunlight and another emission. The difference is stored.
fn with_own_light(budget: Budget, sun: f64, emitted: f64) -> Budget {
    let more = sun - budget[SUN] + emitted - budget[EMITTED];
    let mut own = budget;
    (own[SUN], own[EMITTED], own[STORED]) = (sun, emitted, budget[STORED] - more);
    own
}
