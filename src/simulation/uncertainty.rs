//! The error of every temperature [K], one standard deviation, carried in time beside a run (docs/numerics.md 8).
//!
//! A triangle shows straight lines between the temperatures of its nodes. The light on a corner of a triangle differs from the light that these lines stand
//! for: at the border of a shadow, beside a crease, and where a mesh is coarser than the features of the craft. Each corner therefore has a deviation d from the
//! drawn temperature T, with a sign. The balance of the surface itself carries it:
//!
//! ```text
//! C dd/dt = q - q_drawn - eps sigma ((T + d)^4 - mean of T_node^4) - g d,    g = 4 k thickness / A,
//! ```
//!
//! with the mean over the nodes of the triangle by their weights at the corner. The spread of light inside a corner is an amplitude of the corner. This spread
//! contains the noise of the samples of light. The other terms are errors of nodes ([`NodeErrors`]).

mod absorbed;
mod carry;
mod conducted;
mod drawn;
mod exchange;
mod lines;
mod materials;
mod node_errors;
mod reach;
pub(crate) mod rest;
mod sudden;
mod summary;

use rayon::prelude::*;

use super::StepResult;
use super::parts::Passing;
use super::prepare::Prepared;
use crate::environment::StepLoad;
use crate::environment::shadow::{CornerLight, LightAndPoses, Lit, LitAreas};
use crate::exchange::errors::at_most;
use crate::exchange::turn::turned;
use crate::exchange::uncertainty::swung;
use crate::model::nodes::GROUP;
use crate::scene::Initial;
use crate::thermal::misfit::{Misfit, check_length, part};
use crate::trace::span;
use absorbed::{Absorbed, AbsorbingSurface};
use carry::{PlaceBalance, within_step};
use conducted::{ConductedErrors, apart, areas_of_pieces};
use exchange::{ExchangeErrorState, ExchangeErrors};
use materials::SurfaceConstants;
use node_errors::{NodeErrors, spreads_of_nodes};
pub(crate) use summary::{PixelError, PixelErrors};

/// Weights of the nodes of a triangle in the middle of a corner, which is the part of the triangle nearest to its node: its own, and each of the others.
const OWN: f64 = 11.0 / 18.0;
const OTHER: f64 = 7.0 / 36.0;

/// Parts of an orbit before time 0 through which the errors are carried.
const PARTS_OF_ORBIT: u32 = 48;

/// A temperature below which no node is taken for the slope of its radiation [K].
const COLDEST: f64 = 20.0;

/// A turn from which on the light of a step says nothing of its mean [rad].
const FULL_TURN: f64 = std::f64::consts::TAU;

/// Rounding of a temperature in f32, over the temperature.
const ROUNDING: f64 = 1.0 / (1 << 24) as f64;

/// The errors of all temperatures, carried beside a run.
pub(crate) struct Uncertainty<'a> {
    prepared: &'a Prepared,
    /// Finds the lit share of corners. `None` where nothing turns away inside a node and nothing casts shadows.
    light: Option<LitAreas>,
    surface: AbsorbingSurface<'a>,
    /// Values of the material of each node.
    constants: Vec<SurfaceConstants>,
    /// Area of all that conducts to each node [m2]. Empty without a network.
    pieces: Vec<f64>,
    exchange: Option<ExchangeErrors>,
    state: UncertaintyState,
}

/// The saved state of the errors.
#[derive(Debug, Clone, Default, serde::Serialize, serde::Deserialize)]
pub(crate) struct UncertaintyState {
    begun: bool,
    found_for: Option<LightAndPoses>,
    /// Light of each corner, and lit area of each node.
    lights: Vec<CornerLight>,
    lit: Lit,
    /// Deviation of each corner from the drawn temperature [K].
    deviations: Vec<f64>,
    /// Amplitude of the spread inside each corner [K].
    spreads: Vec<f64>,
    /// Light of Sun and planet that each node absorbed in the last step [W/m2].
    fluxes: Vec<f64>,
    /// Change of each node's light by the last finding [W/m2].
    jumps: Vec<f64>,
    /// Direct sunlight that each node absorbs at the last two findings of the light, over the sunlight on a plate that faces it.
    sunlit: [Vec<f64>; 2],
    nodes: Vec<NodeErrors>,
    /// Temperature of each node at the end of the last step [K].
    temperatures: Vec<f32>,
    /// What each node radiates more for each kelvin [W/K].
    radiated: Vec<f64>,
    exchange: Option<ExchangeErrorState>,
    /// Errors of the pixels so far.
    pub(crate) pixels: PixelErrors,
}

impl UncertaintyState {
    /// The state without the errors of the pixels of its run.
    pub(crate) fn without_pixels(self) -> Self {
        Self { pixels: PixelErrors::default(), ..self }
    }
}

impl<'a> Uncertainty<'a> {
    /// The errors of a scene, still 0.
    pub(crate) fn new(prepared: &'a Prepared) -> Self {
        let nodes = &prepared.nodes;
        let count = nodes.vertex_of_node.len();
        let surface = AbsorbingSurface::new(prepared);
        let of_material: Vec<SurfaceConstants> =
            prepared.materials.iter().map(|material| SurfaceConstants::of(material, &prepared.scene.time)).collect();
        let constants = (0..count).map(|slot| of_material[nodes.group_material[slot / GROUP] as usize]).collect();
        let state = UncertaintyState {
            lights: vec![CornerLight::UNHIDDEN; surface.corners.len()],
            deviations: vec![0.0; surface.corners.len()],
            spreads: vec![0.0; surface.corners.len()],
            fluxes: vec![0.0; count],
            jumps: vec![0.0; count],
            nodes: vec![NodeErrors::default(); count],
            radiated: vec![0.0; count],
            ..UncertaintyState::default()
        };
        Self {
            prepared,
            pieces: areas_of_pieces(prepared, &surface.areas),
            light: prepared.lit_areas(nodes.real().map(|(slot, _)| slot)),
            surface,
            constants,
            exchange: prepared.exchange.as_ref().map(ExchangeErrors::new),
            state,
        }
    }

    /// Takes a saved state.
    ///
    /// # Errors
    /// A state of another scene.
    fn restore(&mut self, saved: &UncertaintyState) -> Result<(), Misfit> {
        check_length("errors of corners", &saved.deviations, self.surface.corners.len())?;
        check_length("errors of nodes", &saved.nodes, self.constants.len())?;
        check_length("radiation of nodes", &saved.radiated, self.constants.len())?;
        if !saved.temperatures.is_empty() {
            check_length("temperatures of nodes", &saved.temperatures, self.constants.len())?;
        }
        self.state.clone_from(saved);
        if let Some(light) = &mut self.light {
            light.redraw.found_for.clone_from(&saved.found_for);
        }
        if let Some(exchange) = &mut self.exchange {
            exchange.restore(part("errors of radiation between surfaces", &saved.exchange)?)?;
        }
        Ok(())
    }

    /// The errors of a scene that asks for them, from a saved state where there is one.
    ///
    /// # Errors
    /// A state of another scene.
    pub(crate) fn asked(prepared: &'a Prepared, saved: Option<&UncertaintyState>) -> Result<Option<Self>, Misfit> {
        let mut errors = prepared.scene.images.error.then(|| Self::new(prepared));
        if let (Some(errors), Some(saved)) = (&mut errors, saved) {
            errors.restore(saved)?;
        }
        Ok(errors)
    }

    /// The state and the errors so far.
    pub(crate) fn save(&self) -> UncertaintyState {
        UncertaintyState {
            found_for: self.light.as_ref().and_then(|light| light.redraw.found_for.clone()),
            exchange: self.exchange.as_ref().map(ExchangeErrors::save),
            ..self.state.clone()
        }
    }

    /// Errors of the pixels so far.
    pub(crate) fn pixels(&self) -> &PixelErrors {
        &self.state.pixels
    }

    /// Takes a result of the loop of a run: the temperatures at the end of a step, or with step 0 at the start, and then the image.
    pub(crate) fn follow(&mut self, result: &mut StepResult) {
        if let Some(temperatures) = &result.delivered.temperatures {
            let length = self.prepared.scene.time.step;
            let now = f64::from(result.step) * length;
            if result.step == 0 {
                self.begin(now, temperatures, true);
            } else {
                self.pass(Passing { start: now - length, end: now, steps: 1.0 }, temperatures);
            }
        }
        if let Some(image) = &mut result.delivered.image {
            self.draw(image, result.image);
        }
    }

    /// Takes the temperatures [K] at the end of a step.
    pub(crate) fn pass(&mut self, passing: Passing, temperatures: &[f32]) {
        let before = std::mem::take(&mut self.state.temperatures);
        for part in passing.parts(&self.prepared.loads) {
            let load = self.prepared.loads.step_load(part.start, part.end);
            let share = ((part.end - passing.start) / (passing.end - passing.start)) as f32;
            // A straight line leads to temperatures within the step. Without earlier temperatures all parts have the last ones.
            let on_the_way = |(before, end): (&f32, &f32)| before + share * (end - before);
            let within: Vec<f32> = before.iter().zip(temperatures).map(on_the_way).collect();
            let within = if before.is_empty() || part == passing { temperatures } else { &within };
            self.advance(&load, part.steps, part.steps * self.prepared.scene.time.step, within);
        }
        self.state.temperatures = temperatures.to_vec();
    }

    /// Number of equal parts of a step of the scene.
    fn parts_of_a_step(&self) -> u32 {
        Passing { start: 0.0, end: self.prepared.scene.time.step, steps: 1.0 }.equal_parts(&self.prepared.loads)
    }

    /// Finds the errors at the start of a run, from the orbit before it where the run has one, with the temperatures of the start. Errors of a saved state stay.
    pub(crate) fn begin(&mut self, now: f64, temperatures: &[f32], has_past: bool) {
        if self.state.begun {
            return;
        }
        self.state.begun = true;
        let scene = &self.prepared.scene;
        let steps = 1.0 / f64::from(self.parts_of_a_step());
        if has_past && scene.time.warm_up_orbits > 0.0 {
            self.pass_orbit(now, temperatures);
        } else if scene.initial == Initial::Balance {
            let load = self.prepared.loads.step_load(now, now);
            self.advance(&load, steps, f64::INFINITY, temperatures);
            self.state.nodes.iter_mut().for_each(|node| node.steps = 0.0);
        }
        let load = self.prepared.loads.step_load(now, now);
        self.find_light(&load);
        if let Some(exchange) = self.exchange.as_mut().filter(|exchange| exchange.is_fresh()) {
            let spreads =
                || spreads_of_nodes(self.prepared, &self.surface, [&self.state.deviations, &self.state.spreads]);
            exchange.take(&load, steps, temperatures, |_| 0.0, spreads, &self.state.lit);
        }
        self.state.fluxes = self.absorbed(&load).nodes;
        self.state.jumps.fill(0.0);
        self.state.sunlit = Default::default();
        self.state.nodes.iter_mut().for_each(|node| node.late = 0.0);
        self.state.temperatures = temperatures.to_vec();
    }

    /// Carries the errors through the orbit before the run.
    fn pass_orbit(&mut self, now: f64, temperatures: &[f32]) {
        let scene = &self.prepared.scene;
        let span = scene.orbit.period() * scene.time.warm_up_orbits.min(1.0);
        let length = span / f64::from(PARTS_OF_ORBIT);
        let loads: Vec<StepLoad> = (0..PARTS_OF_ORBIT)
            .map(|number| {
                let start = now - span + f64::from(number) * length;
                self.prepared.loads.step_load(start, start + length)
            })
            .collect();
        // A surface that is slower than an orbit has the deviation and the spread of the mean load.
        let mut mean = vec![[0.0; 2]; self.surface.corners.len()];
        for load in &loads {
            self.find_light(load);
            let absorbed = self.absorbed(load);
            let share = 1.0 / f64::from(PARTS_OF_ORBIT);
            let add = |(number, [drive, spread]): (usize, &mut [f64; 2])| {
                *drive += share * self.drive(&absorbed, number);
                *spread += share * self.spread(&absorbed, number);
            };
            mean.par_iter_mut().enumerate().for_each(add);
        }
        self.advance(&loads[0], 1.0, f64::INFINITY, temperatures);
        let settled = |(number, [drive, spread]): (usize, &[f64; 2])| {
            let (deviation, [_, gained]) = self.balance(number, temperatures).deviation(0.0, *drive, f64::INFINITY);
            (deviation, spread * gained)
        };
        (self.state.deviations, self.state.spreads) = mean.par_iter().enumerate().map(settled).unzip();
        loads.iter().for_each(|load| self.advance(load, 1.0, length, temperatures));
        self.state.nodes.iter_mut().for_each(|node| (node.steps, node.held, node.sudden) = (0.0, 0.0, 0.0));
    }

    /// Finds the light of corners anew where the last one no longer holds.
    fn find_light(&mut self, load: &StepLoad) -> bool {
        let Some(light) = &mut self.light else { return false };
        let Some(sun) = light.redraw.due(load) else { return false };
        let (areas, lights) = light.corners_under(sun, &load.joints);
        self.state.lights = lights;
        self.state.lit = Lit { areas, by_rays: light.by_rays() }.of_slots(light.numbers(), self.constants.len());
        true
    }

    /// Carries all errors through an interval of `steps` steps and a length [s], which ends at these temperatures [K].
    fn advance(&mut self, load: &StepLoad, steps: f64, length: f64, temperatures: &[f32]) {
        let begins = span("carrying errors");
        let held = self.absorbed(load);
        drop(begins);
        let is_found = self.find_light(load);
        let goes_on = span("carrying errors");
        let absorbed = if is_found { self.absorbed(load) } else { held.clone() };
        if is_found {
            self.state.jumps =
                held.nodes.iter().zip(&absorbed.nodes).map(|(held, found)| (found - held).abs()).collect();
        }
        let sudden = self.sudden(load, &absorbed, is_found);
        drop(goes_on);
        if let Some(exchange) = &mut self.exchange {
            let spreads =
                || spreads_of_nodes(self.prepared, &self.surface, [&self.state.deviations, &self.state.spreads]);
            exchange.take(load, steps, temperatures, |node| self.state.nodes[node].late, spreads, &self.state.lit);
        }
        let _goes_on = span("carrying errors");
        let carried = |number: usize| {
            let balance = self.balance(number, temperatures);
            let (deviation, [kept, gained]) =
                balance.deviation(self.state.deviations[number], self.drive(&absorbed, number), length);
            (deviation, self.state.spreads[number] * kept + self.spread(&absorbed, number) * gained)
        };
        let corners: Vec<(f64, f64)> = (0..self.surface.corners.len()).into_par_iter().map(carried).collect();
        let lines = lines::lines(self.prepared, temperatures);
        let turns = self.turns(load.start, length);
        let held_time = self.exchange.as_ref().map_or(0.0, ExchangeErrors::held_time);
        let rows_held_for = self.exchange.as_ref().map_or(0.0, ExchangeErrors::rows_held_for);
        let carried = |node: usize| {
            let before = &self.state.nodes[node];
            let balance = self.balance_of_node(node, 0.0, temperatures);
            let [kept, gained] = balance.passed(length);
            let change = absorbed.nodes[node] - self.state.fluxes[node];
            // Light is right when it is found, and is off by the jump before the next finding.
            let held = if is_found { 0.0 } else { self.state.jumps[node] / 3f64.sqrt() };
            let held = held.hypot(absorbed.nodes[node] * turns.get(self.joint(node)).unwrap_or(&0.0));
            let exchanged = self.exchange.as_ref().map(|exchange| exchange.of_node(node)).unwrap_or_default();
            // Rows that are held err alike over a patch, so heat leaves over its rim. Other errors are alike over neighbours too: none of a late or uneven light is conducted away, and
            // the rest is moved afterwards.
            let alike = self.balance_of_node(node, exchanged.area, temperatures);
            let (rows_rate, alike_slope) = alike.rate(rows_held_for);
            let alone = self.balance_of_node(node, f64::INFINITY, temperatures);
            let [alone_kept, alone_gained] = alone.passed(length);
            let (alone_rate, alone_slope) = alone.rate(length);
            let piece = self.pieces.get(node).copied().unwrap_or(0.0);
            let apart = apart(self.constants[node].conductance / alone_slope, piece, exchanged.area);
            let corrected = exchanged.corrected * alone.passed((held_time - length).max(0.0))[1];
            let (held_rate, held_slope) = alone.rate(held_time);
            let rising = exchanged.rising / held_slope * within_step(held_rate);
            let temperature = f64::from(temperatures[node]);
            NodeErrors {
                steps: before.steps * alone_kept + change / alone_slope * within_step(alone_rate),
                held: before.held * alone_kept + held * alone_gained,
                sudden: (before.sudden * kept).hypot(sudden.get(node).unwrap_or(&0.0) * gained),
                exchange: before.exchange * kept + exchanged.own * gained,
                alike: before.alike * alone_kept + exchanged.alike * apart * alone_gained,
                rows: exchanged.rows / alike_slope * swung(rows_rate),
                uneven: before.uneven * alone_kept + exchanged.uneven * alone_gained,
                late: (before.late + corrected) * alone_kept + exchanged.late * alone_gained + rising,
                lines: lines.get(node).map_or(0.0, |line| line * balance.conducted_share()),
                rounding: (before.rounding * kept).hypot(ROUNDING * temperature),
            }
        };
        let mut nodes: Vec<NodeErrors> = (0..self.constants.len()).into_par_iter().map(carried).collect();
        self.conduct(&mut nodes, length, temperatures);
        let radiated =
            |node: usize| self.surface.areas[node] * self.balance_of_node(node, 0.0, temperatures).radiated_slope();
        self.state.radiated = (0..self.constants.len()).into_par_iter().map(radiated).collect();
        (self.state.deviations, self.state.spreads) = corners.into_iter().unzip();
        self.state.nodes = nodes;
        self.state.fluxes = absorbed.nodes;
    }

    /// Lets conduction move what nodes err with others.
    fn conduct(&self, nodes: &mut [NodeErrors], length: f64, temperatures: &[f32]) {
        let weight = |node: usize| {
            let [_, gained] = self.balance_of_node(node, f64::INFINITY, temperatures).passed(length);
            self.surface.areas[node] / gained.max(f64::MIN_POSITIVE)
        };
        let Some(conduction) = ConductedErrors::new(self.prepared, weight) else { return };
        let terms: [fn(&mut NodeErrors) -> &mut f64; 3] =
            [|node| &mut node.steps, |node| &mut node.held, |node| &mut node.alike];
        for term in terms {
            let mut errors: Vec<f64> = nodes.iter_mut().map(|node| *term(node)).collect();
            if errors.iter().any(|error| *error != 0.0) {
                conduction.spread(&mut errors);
                nodes.iter_mut().zip(errors).for_each(|(node, error)| *term(node) = error);
            }
        }
    }

    /// Light that a step with each joint in the pose of its middle errs by, over the light: the mean of 1 - cos over the turn in the step, turn^2 / 24.
    fn turns(&self, start: f64, length: f64) -> Vec<f64> {
        if self.prepared.joints() < 2 || !length.is_finite() {
            return Vec::new();
        }
        let [from, to] = [start, start + length].map(|time| self.prepared.loads.joints_at(time).1);
        from.iter().zip(to).map(|(from, to)| turned(&[*from], &[to]).min(FULL_TURN).powi(2) / 24.0).collect()
    }

    fn joint(&self, node: usize) -> usize {
        if self.surface.areas[node] > 0.0 { self.prepared.nodes.joint(node) as usize } else { 0 }
    }

    fn absorbed(&self, load: &StepLoad) -> Absorbed {
        self.surface.absorbed(load, &self.state.lights)
    }

    /// Node of a corner, and the two other nodes of its triangle.
    fn nodes_of(&self, corner: usize) -> [usize; 3] {
        let triangle = self.prepared.triangles[corner / 3].map(|node| node as usize);
        [0, 1, 2].map(|turn| triangle[(corner % 3 + turn) % 3])
    }

    /// Light on a corner that its nodes do not have [W/m2].
    fn drive(&self, absorbed: &Absorbed, corner: usize) -> f64 {
        let [own, b, c] = self.nodes_of(corner).map(|node| absorbed.nodes[node]);
        absorbed.corners[corner].absorbed - OWN * own - OTHER * (b + c)
    }

    /// Spread of light inside a corner [W/m2].
    fn spread(&self, absorbed: &Absorbed, corner: usize) -> f64 {
        self.state.lights[corner].spread() * absorbed.corners[corner].if_lit
    }

    fn balance(&self, corner: usize, temperatures: &[f32]) -> PlaceBalance {
        let nodes = self.nodes_of(corner);
        let [own, b, c] = nodes.map(|node| f64::from(temperatures[node]).max(COLDEST));
        PlaceBalance::new(
            &self.constants[nodes[0]],
            self.surface.areas[nodes[0]],
            OWN * own + OTHER * (b + c),
            OWN * own.powi(4) + OTHER * (b.powi(4) + c.powi(4)),
        )
    }

    /// The balance of a node among neighbours that err alike over an area [m2], and over its own at least.
    fn balance_of_node(&self, node: usize, alike: f64, temperatures: &[f32]) -> PlaceBalance {
        let temperature = f64::from(temperatures[node]).max(COLDEST);
        PlaceBalance::new(&self.constants[node], self.surface.areas[node].max(alike), temperature, temperature.powi(4))
    }

    /// Error of each corner of each triangle [K], `between` nodes or of what the nodes show alone.
    fn of_corners(&self, between: bool) -> Vec<f64> {
        let state = &self.state;
        let square = |corner: usize| state.deviations[corner].powi(2) + state.spreads[corner].powi(2);
        let mut own = vec![0.0; self.constants.len()];
        if between {
            for (corner, node) in self.prepared.triangles.as_flattened().iter().enumerate() {
                own[*node as usize] += self.surface.corners[corner].area * square(corner);
            }
        }
        let own: Vec<f64> = own
            .iter()
            .zip(&self.surface.areas)
            .zip(&state.nodes)
            .map(|((sum, area), node)| if *area > 0.0 { sum / area + node.lines.powi(2) } else { 0.0 })
            .collect();
        let reached = reach::reach(self.prepared, &own, &state.radiated);
        let of_triangle = |number: usize| {
            let own = [0, 1, 2].map(|place| square(3 * number + place));
            let mean = own.iter().sum::<f64>() / 3.0;
            // A pixel between corners sees a little of all.
            [0, 1, 2].map(|place| {
                let node = self.prepared.triangles[number][place] as usize;
                let reached = reached.get(node).copied().unwrap_or(0.0);
                let between = if between { 0.5 * (own[place] + mean) } else { 0.0 };
                let own = state.nodes[node].square().sqrt();
                let temperature = state.temperatures.get(node).map(|kelvin| f64::from(*kelvin).max(COLDEST));
                let own = temperature.map_or(own, |temperature| at_most(own, temperature));
                (between + reached + own * own).sqrt()
            })
        };
        let errors: Vec<[f64; 3]> = (0..self.prepared.triangles.len()).into_par_iter().map(of_triangle).collect();
        errors.as_flattened().to_vec()
    }
}
