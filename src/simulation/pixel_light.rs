//! Light in pixels: how far the temperature in a pixel of foil is from that which its nodes show, because the edge of a shadow crosses its triangle.
//!
//! A node holds the mean light of its share of the surface, and triangles show straight lines between nodes. In the truth an edge of a shadow is sharp. A surface
//! that stores little and does not conduct has at each place the balance of that place alone. Both balances are stepped through the past minutes: the one of the
//! place, whose light comes and goes as rays to the Sun tell, and the one that the nodes show there. What differs at the end is added to the pixel.
//!
//! ```text
//! C dT/dt = v q_open + q_planet - eps sigma T^4    at the place,    C dT/dt = q_nodes - eps sigma T^4    as the nodes show it
//! ```
//!
//! with the share v of the Sun's disc that the place sees, the sunlight q_open that would be absorbed if nothing hid the Sun, and q_nodes that which the nodes absorb. Where all nodes
//! of a triangle are lit or dark v is known without a ray. With radiation between surfaces, or with a structure below a blanket, each node also takes an even flux, which brings it to its temperature,
//! and the place takes the flux between them.

mod disc;
mod foil_image;
pub(crate) mod gains;
mod moments;
mod place;
mod surface;

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

use self::moments::{DARK, LIT, Moment, NodeLight, Quarters, Shadows};
use self::place::Beginning;
use self::surface::{Foil, FoilSurface, FoilTriangle};
use super::network::SceneNetwork;
use crate::environment::Attitude;
use crate::environment::shadow::{JointTrees, LitAreas};
use crate::environment::step::StepLoads;
use crate::model::nodes::Nodes;
use crate::scene::{Initial, Scene};
use crate::thermal::material::Material;
use crate::trace::span;

/// Share of the shortest time constant that an interval of the past lasts: whole steps, or an even part of one.
const INTERVAL: f64 = 0.15;
/// The same where the light turns far in steps: of those that are in view the past is then four time constants long.
const LEAST_INTERVAL: f64 = 0.05;
/// Time constants that are stepped through.
const MEMORY: f64 = 8.0;
/// Most intervals of the past.
const INTERVALS: u32 = 48;
/// Intervals before an image that are as short as the last one.
const RECENT: u32 = 32;
/// Length of an older interval over the length of a recent one: what it brought has faded. The recent interval in its middle has its shadows.
const OLDER: u32 = 3;
/// Most intervals whose shadows are kept.
const SHADOWS: usize = 3;
/// Light below which nodes show what a place absorbs [W/m2].
const LEAST_LIGHT: f64 = 0.05;

/// The surfaces of a scene whose pixels have light of their own.
pub(crate) struct PixelLight {
    surface: FoilSurface,
    light: LitAreas,
    /// Length of a recent interval of the past [s], and how many intervals there are.
    interval: f64,
    count: u32,
    start: Beginning,
    /// Whether surfaces take more than the light of Sun and planet: radiation of each other, or what the structure below a blanket sends.
    takes_more: bool,
    /// The triangles that hide the Sun.
    trees: JointTrees,
    /// Moments and shadows that were found before.
    known: Mutex<Known>,
}

/// What was found before. The values that were used last stand at the end.
#[derive(Default)]
struct Known {
    moments: VecDeque<Arc<Moment>>,
    /// Images in one interval have its shadows in common.
    shadows: VecDeque<Arc<Shadows>>,
}

/// The past of the light up to the time of an image.
pub struct PastLight {
    scene: Arc<PixelLight>,
    /// The oldest first.
    moments: Vec<Arc<Moment>>,
    /// Sun and joints between each moment and the next ([`Moment::quarters`]).
    quarters: Vec<Quarters>,
    begins: Beginning,
}

impl std::fmt::Debug for PastLight {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(out, "PastLight of {} moments", self.moments.len())
    }
}

impl PixelLight {
    /// The surfaces of a scene whose pixels have light of their own. `None` where there are none, or where the scene does not ask for them.
    pub(crate) fn of(
        scene: &Scene,
        (nodes, triangles, materials): (&Nodes, &[[u32; 3]], &[Material]),
        light: LitAreas,
        network: Option<&Arc<SceneNetwork>>,
        loads: &StepLoads,
    ) -> Option<Self> {
        if !light.by_rays() || !scene.shadows?.in_pixels || scene.attitude == Attitude::Tumble {
            return None;
        }
        let surface = FoilSurface::new((nodes, triangles), materials, light.numbers(), network)?;
        let step = scene.time.step;
        let times = || surface.foils.iter().flatten().map(Foil::time_constant);
        let (shortest, longest) = (times().fold(f64::INFINITY, f64::min), times().fold(0.0, f64::max));
        let turned = loads.turn_share(0.0, step);
        let stride = ((INTERVAL * shortest).max(MEMORY * longest / f64::from(INTERVALS)) / step).min(turned.recip());
        let part = || loads.turned_part(step).max(LEAST_INTERVAL * shortest).min(step);
        let interval = match stride {
            _ if turned > 1.0 => part(),
            stride if stride >= 1.0 => step * stride.floor(),
            stride => step / stride.recip().ceil(),
        };
        let is_long = |count: &u32| recent_lengths(*count) * interval >= MEMORY * longest;
        let has_past = scene.time.warm_up_orbits > 0.0 || scene.time.periodic.is_some();
        let start = match scene.initial {
            _ if has_past => Beginning::Past,
            Initial::Balance => Beginning::Balance,
            Initial::Temperature(kelvin) => Beginning::Temperature(kelvin),
        };
        let has_structure = surface.foils.iter().flatten().any(|foil| foil.below > 0.0);
        Some(Self {
            trees: light.trees(),
            count: (1..INTERVALS).find(is_long).unwrap_or(INTERVALS),
            surface,
            light,
            interval,
            start,
            takes_more: scene.exchange.is_some() || has_structure,
            known: Mutex::default(),
        })
    }

    /// The light up to a time [s] of an image. `None` where the loads do not say where the craft was.
    pub(crate) fn past(self: &Arc<Self>, loads: &StepLoads, materials: &[Material], time: f64) -> Option<PastLight> {
        // A beginning is looked for further back.
        let (first, count) = match self.start {
            Beginning::Past => (f64::NEG_INFINITY, self.count),
            _ => (0.0, INTERVALS),
        };
        let begin = (time - recent_lengths(count) * self.interval).max(first);
        loads.sky_model().check(begin.min(time), time).ok()?;
        let mut intervals = Vec::new();
        let mut end = time;
        while intervals.len() < count as usize && end > first + 1e-9 * self.interval {
            let older = if intervals.len() < RECENT as usize { 1 } else { OLDER };
            let length = f64::from(older) * self.interval;
            let start = ((end / length - 1e-9).ceil() - 1.0) * length;
            let middle = start + f64::from(older / 2) * self.interval;
            intervals.push(([start.max(first), end], [middle.max(first), middle + self.interval]));
            end = start;
        }
        let begins_in_view = end <= first + 1e-9 * self.interval;
        if begins_in_view && (self.start == Beginning::Balance || intervals.is_empty()) {
            intervals.push(([0.0; 2], [0.0; 2]));
        }
        // The oldest first. New moments make room among those that no later image needs.
        let moment = |(times, shadows)| self.moment(loads, materials, times, shadows);
        let moments: Vec<_> = intervals.into_iter().rev().map(moment).collect();
        let quarters = moments.windows(2).map(|pair| pair[0].quarters(&pair[1])).collect();
        let begins = if begins_in_view { self.start } else { Beginning::Past };
        Some(PastLight { scene: Arc::clone(self), moments, quarters, begins })
    }

    /// The light between two times [s], with the shadows between two others.
    fn moment(
        &self,
        loads: &StepLoads,
        materials: &[Material],
        [start, end]: [f64; 2],
        shadows: [f64; 2],
    ) -> Arc<Moment> {
        let load = loads.step_load(start, end);
        let whole = if shadows == [start, end] { load.clone() } else { loads.step_load(shadows[0], shadows[1]) };
        let known = || self.known.lock().unwrap_or_else(PoisonError::into_inner);
        let key = Moment::key(&load, &whole, end);
        let again = |known: &mut Known| {
            let place = known.moments.iter().position(|moment| moment.key == key)?;
            let moment = known.moments.remove(place)?;
            known.moments.push_back(Arc::clone(&moment));
            Some(moment)
        };
        if let Some(moment) = again(&mut known()) {
            return moment;
        }
        let held = known().shadows.iter().find(|shadows| shadows.are_of(&whole)).cloned();
        let shadows = held.unwrap_or_else(|| Arc::new(Shadows::new(&self.light, &self.nodes_of_light(), &whole)));
        let _lights = span("light of foil in the past");
        let moment = Arc::new(Moment::new(&self.surface, materials, &load, &shadows, (key, end - start)));
        let mut known = known();
        keep(&mut known.moments, &moment, INTERVALS as usize + 2);
        keep(&mut known.shadows, &shadows, SHADOWS);
        moment
    }

    /// Places of the foil's nodes among the nodes of the light.
    fn nodes_of_light(&self) -> Vec<usize> {
        let mut slots = self.surface.nodes.iter().map(|node| node.slot as usize).peekable();
        self.light.numbers().enumerate().filter_map(|(place, slot)| slots.next_if_eq(&slot).map(|_| place)).collect()
    }
}

/// Length of all intervals together, over the length of a recent one, where there are so many.
fn recent_lengths(count: u32) -> f64 {
    f64::from(count.min(RECENT) + OLDER * count.saturating_sub(RECENT))
}

/// Keeps a value among the last ones.
fn keep<T>(all: &mut VecDeque<Arc<T>>, one: &Arc<T>, most: usize) {
    all.push_back(Arc::clone(one));
    if all.len() > most {
        all.pop_front();
    }
}

impl PastLight {
    /// Whether changes need the temperatures of the nodes.
    pub(crate) fn needs_temperatures(&self) -> bool {
        self.scene.takes_more
    }

    /// Whether a triangle is lit at each moment, `None` where a ray has to tell. Empty where its nodes show what each of its places absorbs.
    fn known(&self, triangle: &FoilTriangle) -> Vec<Option<bool>> {
        let mut differs = false;
        let known = self.moments.iter().map(|moment| {
            let nodes = triangle.nodes.map(|node| moment.nodes[node]);
            let lit = match nodes.map(|node| node.lit) {
                [LIT, LIT, LIT] => Some(true),
                _ if nodes.iter().all(|node| node.lit == DARK || node.open == 0.0) => Some(false),
                _ => None,
            };
            let is_shown = |lit: bool| {
                let light = |node: &NodeLight| if lit { node.open } else { 0.0 };
                nodes.iter().all(|node| (light(node) + node.planet - node.shown).abs() < LEAST_LIGHT as f32)
            };
            differs |= !lit.is_some_and(is_shown);
            lit
        });
        let known: Vec<Option<bool>> = known.collect();
        if differs { known } else { Vec::new() }
    }
}
