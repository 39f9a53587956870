//! What every patch receives in a step. Twin: `glsl/exchange_send.comp` and `glsl/exchange_receive.comp`.
//!
//! A node emits to all sides, as it does without exchange: that stays in its own balance, with its temperature on the way through the step. What comes from
//! other patches is a load. It follows from the temperatures at the start of the step. The infrared of space, which the rest of isotherm lets arrive from all sides, is taken
//! off what patches send, so that hidden space sends nothing.

use glam::DVec3;
use rayon::prelude::*;

use super::cast::{SPACE, Scenery, ray_of};
use super::factors::Factors;
use super::patches::{NONE, Patch, Patches, Surface};
use super::reflected::{Areas, exchange_areas};
use super::sky::{PlanetView, word_of};
use crate::environment::StepLoad;
use crate::thermal::STEFAN_BOLTZMANN;
use crate::thermal::balance::Incident;
use crate::thermal::incident::incident;
use crate::thermal::received::{Received, Seen};

/// Most rays that keep the sky of a patch.
pub const SKY_RAYS: u32 = 4096;

/// How the rays and reflections of a scene are found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Rays of a patch.
    pub rays: u32,
    /// Size of a patch [m].
    pub patch_edge: f64,
    /// Most reflections; `None` follows all.
    pub bounces: Option<u32>,
    /// Angle after which what moves is found anew [rad].
    pub redraw_angle: f64,
}

/// An entry of a row: a patch, and the exchange areas of infrared and sunlight [m2].
pub type Entry = (u32, [f64; 2]);

/// The patches of a craft with all that they exchange.
#[derive(Debug, Clone)]
pub struct Exchange {
    /// The patches.
    pub patches: Vec<Patch>,
    /// Nodes of the patches, each with its share of the patch's area.
    pub nodes: Vec<(u32, f64)>,
    /// Patches of the front and of the back of each node, or [`NONE`].
    pub of_node: Vec<[u32; 2]>,
    /// View factors.
    pub factors: Factors,
    /// Exchange areas of infrared.
    pub infrared: Areas,
    /// Exchange areas of sunlight.
    pub sunlight: Areas,
    /// First entry of each row of `entries`, and the one after the last.
    pub first: Vec<u32>,
    /// The rows of both.
    pub entries: Vec<Entry>,
    /// Rays that keep the sky, the same number for each patch.
    pub sky: Vec<u32>,
}

impl Exchange {
    /// The exchange of patches whose rays end at `ends`, with the directions of the rays in the frame of the patch's joint.
    pub fn new(surface: &Surface, patches: &Patches, ends: &[u32], settings: &Settings) -> Self {
        let factors = Factors::new(&patches.all, ends, settings.rays);
        let of = |absorptivity: fn(&Patch) -> f64| {
            let absorptivities: Vec<f64> = patches.all.iter().map(absorptivity).collect();
            exchange_areas(&factors, &absorptivities, settings.bounces)
        };
        let (infrared, sunlight) = (of(|patch| patch.optics.emissivity), of(|patch| patch.optics.absorptivity));
        let mut first = vec![0];
        let mut entries: Vec<Entry> = Vec::new();
        for row in 0..patches.all.len() {
            let (a, b) = (infrared.between.row(row), sunlight.between.row(row));
            let mut columns: Vec<u32> = a.iter().chain(b).map(|entry| entry.0).collect();
            columns.sort_unstable();
            columns.dedup();
            let both = |column: u32| [infrared.between.at(row, column), sunlight.between.at(row, column)];
            entries.extend(columns.into_iter().map(|column| (column, both(column))));
            first.push(entries.len() as u32);
        }
        let kept = settings.rays.min(SKY_RAYS);
        let sky = (0..patches.all.len() as u32).into_par_iter().flat_map_iter(|patch| {
            let own = &ends[patch as usize * settings.rays as usize..];
            (0..kept).map(move |ray| {
                let [_, direction] = ray_of(surface, patches, 0.0, patch, ray);
                word_of(direction, own[ray as usize] == SPACE)
            })
        });
        Self {
            sky: sky.collect(),
            patches: patches.all.clone(),
            nodes: patches.nodes.clone(),
            of_node: patches.of_node.clone(),
            factors,
            infrared,
            sunlight,
            first,
            entries,
        }
    }

    /// The exchange of a craft in the pose of its scenery, with rays of the processor.
    pub fn cast(surface: &Surface, patches: &Patches, scenery: &Scenery, settings: &Settings) -> Self {
        let ends = super::cast::cast(surface, patches, scenery, settings.rays, 0..patches.all.len() as u32);
        Self::new(surface, patches, &ends, settings)
    }

    /// Number of rays that keep the sky of a patch.
    pub fn sky_rays(&self) -> usize {
        self.sky.len() / self.patches.len().max(1)
    }

    /// Rays that keep the sky of a patch.
    pub fn sky_of(&self, patch: usize) -> &[u32] {
        let rays = self.sky_rays();
        &self.sky[patch * rays..(patch + 1) * rays]
    }

    /// Shares of the planet's light that every patch sees.
    pub fn seen(&self, load: &StepLoad) -> Vec<Seen> {
        let Some(planet) = &load.planet else { return vec![Seen::ALL; self.patches.len()] };
        let rays = self.sky_rays();
        let seen = |(patch, own): (&Patch, &[u32])| PlanetView::new(planet, load, patch.joint).seen(&own[..rays]);
        self.patches.par_iter().zip(self.sky.par_chunks(rays.max(1))).map(seen).collect()
    }

    /// Infrared and sunlight that leave each patch at first [W/m2]: emission above that of space, and the reflection of what comes from Sun and planet. `temperature` [K]
    /// and `visibility`, the share of the Sun, are those of a node.
    pub fn sent(
        &self,
        load: &StepLoad,
        seen: &[Seen],
        temperature: impl Fn(usize) -> f64 + Sync,
        visibility: impl Fn(usize) -> f64 + Sync,
    ) -> Vec<[f64; 2]> {
        let space = load.background_temperature.powi(4);
        let of = |(patch, seen): (&Patch, &Seen)| {
            let (mut fourth, mut lit) = (0.0, 0.0);
            for (node, share) in &self.nodes[patch.nodes.clone()] {
                fourth += share * temperature(*node as usize).powi(4);
                lit += share * visibility(*node as usize);
            }
            let normal: DVec3 = load.joint_from_body(patch.joint).transpose() * patch.normal;
            let Incident { solar, albedo, planet_ir } = incident(load, normal);
            let optics = patch.optics;
            [
                optics.emissivity * STEFAN_BOLTZMANN * (fourth - space)
                    + (1.0 - optics.emissivity) * seen.planet_ir * planet_ir,
                (1.0 - optics.absorptivity) * (lit * solar + seen.albedo * albedo),
            ]
        };
        self.patches.par_iter().zip(seen).map(of).collect()
    }

    /// Flux from all patches that each one absorbs [W/m2].
    pub fn absorbed(&self, sent: &[[f64; 2]]) -> Vec<f64> {
        let of = |(number, patch): (usize, &Patch)| {
            let (mut infrared, mut sunlight) = (0.0, 0.0);
            for (from, areas) in &self.entries[self.first[number] as usize..self.first[number + 1] as usize] {
                infrared += areas[0] * sent[*from as usize][0];
                sunlight += areas[1] * sent[*from as usize][1];
            }
            (patch.optics.emissivity * infrared + patch.optics.absorptivity * sunlight) / patch.area
        };
        self.patches.par_iter().enumerate().map(of).collect()
    }

    /// What the two faces of a node receive, from what every patch absorbs and sees.
    pub fn of_node(&self, node: usize, absorbed: &[f64], seen: &[Seen]) -> [Received; 2] {
        self.of_node[node].map(|patch| match patch {
            NONE => Received::NOTHING,
            patch => Received { absorbed: absorbed[patch as usize], seen: seen[patch as usize] },
        })
    }
}
