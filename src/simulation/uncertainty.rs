//! The error of every temperature [K], one standard deviation, carried in time beside a run.
//!
//! A node has one temperature, and a triangle shows the straight line between its nodes. The sunlight on a corner of a triangle differs from the light that this
//! line stands for: at the border of a shadow, beside a crease, and where a mesh is coarser than the features of the craft. Each corner therefore has a deviation d
//! from the drawn temperature T, with a sign. It obeys the balance of the surface itself,
//!
//! ```text
//! C dd/dt = q - q_drawn - eps sigma ((T + d)^4 - mean of T_node^4) - g d,    g = 4 k thickness / A,
//! ```
//!
//! with the mean over the nodes of the triangle by their weights at the corner. The other terms are amplitudes of nodes, carried as E' = E exp(-dt / tau) + new:
//! the change of load within a step, and light that is held until the next finding. The spread of light inside a corner is an amplitude of the corner. It contains
//! the noise of the samples of light, because the noise of a mean is at most the spread of its samples.

mod carry;
mod drawn;
mod materials;
mod summary;

use glam::DVec3;
use rayon::prelude::*;

use super::prepare::Prepared;
use crate::environment::shadow::{LightAndPoses, LitAreas};
use crate::environment::{StepLoad, SunSample};
use crate::model::nodes::GROUP;
use crate::scene::Initial;
use crate::thermal::misfit::{Misfit, check_length};
use carry::{Balance, within_step};
use materials::SurfaceConstants;
pub(crate) use summary::{PixelError, PixelErrors};

/// Weights of the nodes of a triangle in the middle of a corner, which is the part of the triangle nearest to its node: its own, and each of the others.
const OWN: f64 = 11.0 / 18.0;
const OTHER: f64 = 7.0 / 36.0;

/// Parts of an orbit before time 0 through which the errors are carried.
const PARTS_OF_ORBIT: u32 = 48;

/// A temperature below which no node is taken for the slope of its radiation [K].
const COLDEST: f64 = 20.0;

/// The errors of all temperatures, carried beside a run.
pub(crate) struct Uncertainty<'a> {
    prepared: &'a Prepared,
    /// Finds the lit share of corners. `None` where nothing turns away inside a node and nothing casts shadows.
    light: Option<LitAreas>,
    /// Normal towards the node's side, and area [m2], of each corner.
    corners: Vec<(DVec3, f64)>,
    /// Sum of the areas of the corners of each node [m2].
    areas: Vec<f64>,
    /// Values of the material of each node.
    constants: Vec<SurfaceConstants>,
    /// Difference between the mean temperature of the nodes around each node and its own counts so much as error: 0 where nothing conducts.
    edges: Vec<u32>,
    state: UncertaintyState,
}

/// The saved state of the errors.
#[derive(Debug, Clone, Default, serde::Serialize, serde::Deserialize)]
pub(crate) struct UncertaintyState {
    begun: bool,
    found_for: Option<LightAndPoses>,
    /// Lit share of each corner.
    shares: Vec<f32>,
    /// Deviation of each corner from the drawn temperature [K].
    deviations: Vec<f64>,
    /// Amplitude of the spread inside each corner [K].
    spreads: Vec<f64>,
    /// Absorbed sunlight of each node in the last step [W/m2].
    fluxes: Vec<f64>,
    /// Change of each node's light by the last finding [W/m2].
    jumps: Vec<f64>,
    /// Error by the load within steps, with its sign, and by held light, of each node [K].
    of_steps: Vec<f64>,
    of_held: Vec<f64>,
    /// Difference of each node from its neighbours, where they conduct [K].
    of_lines: Vec<f64>,
    /// Errors of the pixels so far.
    pub(crate) pixels: PixelErrors,
}

/// Absorbed sunlight of corners and nodes in a step [W/m2].
struct Absorbed {
    /// On each corner, and on it if all of it were lit.
    corners: Vec<[f64; 2]>,
    nodes: Vec<f64>,
}

impl<'a> Uncertainty<'a> {
    /// The errors of a scene, still 0.
    pub(crate) fn new(prepared: &'a Prepared) -> Self {
        let nodes = &prepared.nodes;
        let count = nodes.vertex_of_node.len();
        let corner = |number: usize| {
            let triangle = prepared.triangles[number / 3].map(|node| node as usize);
            let [a, b, c] = triangle.map(|node| nodes.positions[node].as_dvec3());
            let twice = (b - a).cross(c - a);
            let normal = twice.normalize_or_zero();
            let with = normal.dot(nodes.normals[triangle[number % 3]].as_dvec3()) >= 0.0;
            (if with { normal } else { -normal }, twice.length() / 6.0)
        };
        let corners: Vec<(DVec3, f64)> = (0..3 * prepared.triangles.len()).into_par_iter().map(corner).collect();
        let mut areas = vec![0.0; count];
        for (node, (_, area)) in prepared.triangles.as_flattened().iter().zip(&corners) {
            areas[*node as usize] += area;
        }
        let of_material: Vec<SurfaceConstants> =
            prepared.materials.iter().map(|material| SurfaceConstants::of(material, &prepared.scene.time)).collect();
        let constants = (0..count).map(|slot| of_material[nodes.group_material[slot / GROUP] as usize]).collect();
        let state = UncertaintyState {
            shares: vec![1.0; corners.len()],
            deviations: vec![0.0; corners.len()],
            spreads: vec![0.0; corners.len()],
            fluxes: vec![0.0; count],
            jumps: vec![0.0; count],
            of_steps: vec![0.0; count],
            of_held: vec![0.0; count],
            of_lines: vec![0.0; count],
            ..UncertaintyState::default()
        };
        let light = prepared.lit_areas(nodes.real().map(|(slot, _)| slot));
        Self {
            prepared,
            light,
            edges: materials::borders(&prepared.triangles, count),
            corners,
            areas,
            constants,
            state,
        }
    }

    /// Takes a saved state.
    ///
    /// # Errors
    /// A state of another scene.
    pub(crate) fn restore(&mut self, saved: &UncertaintyState) -> Result<(), Misfit> {
        check_length("errors of corners", &saved.deviations, self.corners.len())?;
        check_length("errors of nodes", &saved.of_steps, self.areas.len())?;
        self.state.clone_from(saved);
        if let Some(light) = &mut self.light {
            light.redraw.found_for.clone_from(&saved.found_for);
        }
        Ok(())
    }

    /// The state and the errors so far.
    pub(crate) fn save(&self) -> UncertaintyState {
        let found_for = self.light.as_ref().and_then(|light| light.redraw.found_for.clone());
        UncertaintyState { found_for, ..self.state.clone() }
    }

    /// Errors of the pixels so far.
    pub(crate) fn pixels(&self) -> &PixelErrors {
        &self.state.pixels
    }

    /// Takes the temperatures [K] at the end of a step, or with step 0 at the start of the run.
    pub(crate) fn take(&mut self, step: u32, temperatures: &[f32]) {
        let length = self.prepared.scene.time.step;
        let now = f64::from(step) * length;
        if !self.state.begun {
            self.begin(now, temperatures);
            self.state.begun = true;
        }
        if step > 0 {
            let load = self.prepared.loads.step_load(now - length, now);
            self.advance(&load, length, temperatures);
        }
        self.state.of_lines = self.lines(temperatures);
    }

    /// Finds the errors at the start of a run, from the orbit before it where the run has one, with the temperatures of the start.
    fn begin(&mut self, now: f64, temperatures: &[f32]) {
        let scene = &self.prepared.scene;
        let warm = scene.time.warm_up_orbits > 0.0;
        if !warm {
            if scene.initial == Initial::Balance {
                let load = self.prepared.loads.step_load(now, now);
                self.advance(&load, f64::INFINITY, temperatures);
            }
            return;
        }
        let span = scene.orbit.period() * scene.time.warm_up_orbits.min(1.0);
        let part = span / f64::from(PARTS_OF_ORBIT);
        let loads: Vec<StepLoad> = (0..PARTS_OF_ORBIT)
            .map(|number| {
                let start = now - span + f64::from(number) * part;
                self.prepared.loads.step_load(start, start + part)
            })
            .collect();
        // A surface that is slower than an orbit has the deviation of the mean load.
        let mut mean = vec![0.0; self.corners.len()];
        for load in &loads {
            self.find_light(load);
            let absorbed = self.absorbed(load);
            let drive = |number: usize| self.drive(&absorbed, number) / f64::from(PARTS_OF_ORBIT);
            mean.par_iter_mut().enumerate().for_each(|(number, mean)| *mean += drive(number));
        }
        self.state.deviations =
            (0..mean.len()).into_par_iter().map(|number| self.settled(number, mean[number], temperatures)).collect();
        loads.iter().for_each(|load| self.advance(load, part, temperatures));
        self.state.of_steps.fill(0.0);
    }

    fn settled(&self, corner: usize, drive: f64, temperatures: &[f32]) -> f64 {
        self.balance(corner, temperatures).deviation(0.0, drive, f64::INFINITY).0
    }

    /// Finds the lit shares anew where they no longer hold.
    fn find_light(&mut self, load: &StepLoad) -> bool {
        let Some(light) = &mut self.light else { return false };
        let Some(sun) = light.redraw.due(load) else { return false };
        self.state.shares = light.corner_shares(sun, &load.joints);
        true
    }

    /// Carries all errors through a step of a length [s], which ends at these temperatures [K].
    fn advance(&mut self, load: &StepLoad, length: f64, temperatures: &[f32]) {
        let held = self.absorbed(load);
        let absorbed = if self.find_light(load) {
            let found = self.absorbed(load);
            self.state.jumps = held.nodes.iter().zip(&found.nodes).map(|(held, found)| (found - held).abs()).collect();
            found
        } else {
            held
        };
        let carried = |number: usize| {
            let balance = self.balance(number, temperatures);
            let (deviation, [kept, gained]) =
                balance.deviation(self.state.deviations[number], self.drive(&absorbed, number), length);
            let lit = f64::from(self.state.shares[number]);
            let spread = absorbed.corners[number][1] * (lit * (1.0 - lit)).max(0.0).sqrt();
            (deviation, self.state.spreads[number] * kept + spread * gained)
        };
        let carried: Vec<(f64, f64)> = (0..self.corners.len()).into_par_iter().map(carried).collect();
        let of_nodes = |node: usize| {
            let balance = self.balance_of_node(node, temperatures);
            let (rate, slope) = balance.rate(length);
            let kept = (-rate).exp();
            let change = absorbed.nodes[node] - self.state.fluxes[node];
            let steps = self.state.of_steps[node] * kept + change / slope * within_step(rate);
            // The light was right when it was found, and is off by the jump at its end.
            let held = self.state.jumps[node] / 3f64.sqrt() / slope;
            (steps, self.state.of_held[node] * kept + held * (1.0 - kept))
        };
        let of_nodes: Vec<(f64, f64)> = (0..self.areas.len()).into_par_iter().map(of_nodes).collect();
        (self.state.deviations, self.state.spreads) = carried.into_iter().unzip();
        (self.state.of_steps, self.state.of_held) = of_nodes.into_iter().unzip();
        self.state.fluxes = absorbed.nodes;
    }

    /// Sunlight on the corners and nodes [W/m2].
    fn absorbed(&self, load: &StepLoad) -> Absorbed {
        let joints = load.joints.len().max(1) as u32;
        let turned = |joint: u32| {
            let frame = load.joint_from_body(joint);
            load.sun.iter().map(|sun| SunSample { direction: frame * sun.direction, flux: sun.flux }).collect()
        };
        let suns: Vec<Vec<SunSample>> = (0..joints).map(turned).collect();
        let nodes = &self.prepared.nodes;
        let on_triangle = |(number, triangle): (usize, &[u32; 3])| {
            let sun = &suns[(nodes.joint(triangle[0] as usize) as usize).min(suns.len() - 1)];
            [0, 1, 2].map(|place| {
                let corner = 3 * number + place;
                let normal = self.corners[corner].0;
                let [front, back] = self.constants[triangle[place] as usize].absorptivities;
                let absorbed = |sun: &SunSample| {
                    let cosine = normal.dot(sun.direction);
                    sun.flux * if cosine >= 0.0 { front * cosine } else { -back * cosine }
                };
                let full: f64 = sun.iter().map(absorbed).sum();
                [full * f64::from(self.state.shares[corner]), full]
            })
        };
        let corners: Vec<[[f64; 2]; 3]> = self.prepared.triangles.par_iter().enumerate().map(on_triangle).collect();
        let corners = corners.as_flattened().to_vec();
        let mut sums = vec![0.0; self.areas.len()];
        for (node, (absorbed, (_, area))) in
            self.prepared.triangles.as_flattened().iter().zip(corners.iter().zip(&self.corners))
        {
            sums[*node as usize] += area * absorbed[0];
        }
        sums.iter_mut().zip(&self.areas).filter(|(_, area)| **area > 0.0).for_each(|(sum, area)| *sum /= area);
        Absorbed { corners, nodes: sums }
    }

    /// Node of a corner, and the two other nodes of its triangle.
    fn nodes_of(&self, corner: usize) -> [usize; 3] {
        let triangle = self.prepared.triangles[corner / 3].map(|node| node as usize);
        [0, 1, 2].map(|turn| triangle[(corner % 3 + turn) % 3])
    }

    /// Light on a corner that its nodes do not have [W/m2].
    fn drive(&self, absorbed: &Absorbed, corner: usize) -> f64 {
        let [own, b, c] = self.nodes_of(corner).map(|node| absorbed.nodes[node]);
        absorbed.corners[corner][0] - OWN * own - OTHER * (b + c)
    }

    fn balance(&self, corner: usize, temperatures: &[f32]) -> Balance {
        let nodes = self.nodes_of(corner);
        let [own, b, c] = nodes.map(|node| f64::from(temperatures[node]).max(COLDEST));
        Balance::new(
            &self.constants[nodes[0]],
            self.areas[nodes[0]],
            OWN * own + OTHER * (b + c),
            OWN * own.powi(4) + OTHER * (b.powi(4) + c.powi(4)),
        )
    }

    fn balance_of_node(&self, node: usize, temperatures: &[f32]) -> Balance {
        let temperature = f64::from(temperatures[node]).max(COLDEST);
        Balance::new(&self.constants[node], self.areas[node], temperature, temperature.powi(4))
    }

    /// Error of the straight lines between nodes that conduct [K]: half of the distance of a node from the mean of its neighbours, as far as conduction and not
    /// light makes it.
    fn lines(&self, temperatures: &[f32]) -> Vec<f64> {
        if self.constants.iter().all(|constants| constants.conductance == 0.0) {
            return vec![0.0; self.areas.len()];
        }
        let mut sums = vec![[0.0, 0.0]; self.areas.len()];
        for triangle in &self.prepared.triangles {
            for place in 0..3 {
                let [own, other] = [triangle[place], triangle[(place + 1) % 3]].map(|node| node as usize);
                for (node, neighbour) in [(own, other), (other, own)] {
                    sums[node][0] += f64::from(temperatures[neighbour]);
                    sums[node][1] += 1.0;
                }
            }
        }
        let line = |node: usize| {
            let [sum, count] = sums[node];
            if count == 0.0 || self.edges[node] != 0 {
                return 0.0;
            }
            let share = self.balance_of_node(node, temperatures).conducted_share();
            0.5 * share * (sum / count - f64::from(temperatures[node])).abs()
        };
        (0..self.areas.len()).into_par_iter().map(line).collect()
    }

    /// Error of each corner of each triangle [K].
    fn of_corners(&self) -> Vec<f64> {
        let state = &self.state;
        let of_triangle = |number: usize| {
            let square = |corner: usize| state.deviations[corner].powi(2) + state.spreads[corner].powi(2);
            let own = [0, 1, 2].map(|place| square(3 * number + place));
            let mean = own.iter().sum::<f64>() / 3.0;
            [0, 1, 2].map(|place| {
                let node = self.prepared.triangles[number][place] as usize;
                let of_node = state.of_steps[node].powi(2) + state.of_held[node].powi(2) + state.of_lines[node].powi(2);
                (0.5 * (own[place] + mean) + of_node).sqrt()
            })
        };
        let errors: Vec<[f64; 3]> = (0..self.prepared.triangles.len()).into_par_iter().map(of_triangle).collect();
        errors.as_flattened().to_vec()
    }
}
