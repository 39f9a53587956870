//! The settings of a scene that trade time for error, and how each is refined.

use crate::exchange::step::ExchangeSettings;
use crate::model::nodes::GROUP;
use crate::scene::{Density, Draw, Edges, Scene};
use crate::simulation::prepare::Prepared;
use crate::simulation::prepare_error::PrepareError;
use crate::thermal::material::{Material, Response};
use crate::thermal::network::control::Integrator;

/// Most levels of a knob that has more than one.
pub(crate) const MOST_LEVELS: u32 = 3;
/// Most rays of a patch that a scene can state.
const MOST_RAYS: u32 = 65_536;

/// A setting that trades time for error.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Knob {
    /// Edges of the mesh, halved.
    Mesh,
    /// Samples of light, four times as many.
    Light,
    /// Turn of the Sun after which light is found anew, a quarter.
    LightRedraw,
    /// Rays of a patch, four times as many.
    Rays,
    /// Size of patches, halved.
    Patches,
    /// Time for which infrared is held, 0.
    Hold,
    /// Turn after which the rays of exchange are found anew, a quarter.
    Redraw,
    /// Length of a step, halved.
    Step,
    /// The accurate integrator of the network.
    Accurate,
}

/// Number of knobs.
pub(crate) const KNOBS: usize = 9;
/// How often each knob was refined, in the order of [`Knob::ALL`].
pub(crate) type Levels = [u32; KNOBS];

impl Knob {
    pub(crate) const ALL: [Self; KNOBS] = [
        Self::Mesh,
        Self::Light,
        Self::LightRedraw,
        Self::Rays,
        Self::Patches,
        Self::Hold,
        Self::Redraw,
        Self::Step,
        Self::Accurate,
    ];

    /// Name in tables and plots.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Mesh => "mesh",
            Self::Light => "light samples",
            Self::LightRedraw => "light redraw",
            Self::Rays => "rays",
            Self::Patches => "patches",
            Self::Hold => "hold",
            Self::Redraw => "redraw",
            Self::Step => "step",
            Self::Accurate => "integrator",
        }
    }

    /// The key in a scene file.
    pub(crate) fn key(self) -> &'static str {
        match self {
            Self::Mesh => "model.max_edge",
            Self::Light => "shadows.spacing",
            Self::LightRedraw => "shadows.redraw_angle_deg",
            Self::Rays => "exchange.rays",
            Self::Patches => "exchange.patch_edge",
            Self::Hold => "exchange.hold",
            Self::Redraw => "exchange.redraw_angle_deg",
            Self::Step => "time.step",
            Self::Accurate => "network.integrator",
        }
    }

    pub(crate) fn index(self) -> usize {
        Self::ALL.iter().position(|one| *one == self).unwrap_or(0)
    }

    /// These levels with one level of this knob.
    pub(crate) fn at(self, level: u32, mut levels: Levels) -> Levels {
        levels[self.index()] = level;
        levels
    }
}

/// A scene with every setting stated that a knob refines.
#[derive(Debug, Clone)]
pub(crate) struct KnobScene {
    scene: Scene,
    /// Whether something conducts heat, so that an integrator acts.
    has_network: bool,
}

impl KnobScene {
    /// States the settings that the scene left to its model: edges, spacing of light and size of patches.
    pub(crate) fn new(prepared: &Prepared, mut scene: Scene) -> Self {
        scene.density = stated(&scene.density, prepared);
        if let Some(shadows) = &mut scene.shadows {
            shadows.spacing = Some(prepared.light_spacing());
        }
        if let (Some(exchange), Some(craft)) = (&mut scene.exchange, &prepared.exchange) {
            exchange.patch_edge = craft.settings.patch_edge;
        }
        Self { scene, has_network: prepared.network.is_some() }
    }

    pub(crate) fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Highest level of a knob. 0 where the scene does not have it, or where no finer setting exists.
    pub(crate) fn most(&self, knob: Knob) -> u32 {
        let Scene { shadows, exchange, network, .. } = &self.scene;
        let lit = self.scene.environment.solar_constant.is_some_and(|flux| flux > 0.0);
        let once = |has: bool| u32::from(has);
        let often = |has: bool| if has { MOST_LEVELS } else { 0 };
        match knob {
            Knob::Mesh | Knob::Step => MOST_LEVELS,
            Knob::Light => often(lit && shadows.is_some()),
            Knob::LightRedraw => often(lit && shadows.is_some_and(|one| one.redraw_angle > 0.0)),
            Knob::Rays => exchange
                .map_or(0, |one| (1..=MOST_LEVELS).filter(|level| one.rays << (2 * level) <= MOST_RAYS).count() as u32),
            Knob::Patches => often(exchange.is_some()),
            Knob::Hold => once(exchange.is_some_and(|one| one.hold > 0.0)),
            Knob::Redraw => often(exchange.is_some_and(|one| one.redraw_angle > 0.0)),
            Knob::Accurate => once(self.has_network && network.integrator != Integrator::Accurate),
        }
    }

    /// The knobs that the scene has.
    pub(crate) fn knobs(&self) -> Vec<Knob> {
        Knob::ALL.into_iter().filter(|knob| self.most(*knob) > 0).collect()
    }

    /// The scene with finer settings.
    pub(crate) fn refined(&self, levels: &Levels) -> Scene {
        let mut scene = self.scene.clone();
        let level = |knob: Knob| levels[knob.index()];
        let part = |knob: Knob, base: u32| 1.0 / f64::from(base.pow(level(knob)));
        let mesh = part(Knob::Mesh, 2);
        scale(&mut scene.density.model, mesh);
        scene.density.parts.iter_mut().for_each(|rule| scale(&mut rule.edges, mesh));
        if let Some(shadows) = &mut scene.shadows {
            shadows.spacing = shadows.spacing.map(|spacing| spacing * part(Knob::Light, 2));
            shadows.redraw_angle *= part(Knob::LightRedraw, 4);
        }
        if let Some(exchange) = &mut scene.exchange {
            exchange.rays <<= 2 * level(Knob::Rays);
            exchange.patch_edge = exchange.patch_edge.map(|edge| edge * part(Knob::Patches, 2));
            exchange.hold = if level(Knob::Hold) > 0 { 0.0 } else { exchange.hold };
            exchange.redraw_angle *= part(Knob::Redraw, 4);
        }
        let times = 1 << level(Knob::Step);
        let time = &mut scene.time;
        time.step /= f64::from(times);
        time.warm_up_step /= f64::from(times);
        time.steps = time.steps.saturating_mul(times);
        match &mut time.draw {
            Draw::None | Draw::Times(_) => {}
            Draw::Every(stride) => *stride = stride.saturating_mul(times),
            Draw::Steps(steps) => steps.iter_mut().for_each(|step| *step = step.saturating_mul(times)),
        }
        if level(Knob::Accurate) > 0 {
            scene.network.integrator = Integrator::Accurate;
        }
        scene
    }

    /// A refined scene, prepared. A transition keeps its length in seconds.
    ///
    /// # Errors
    /// A refinement that cannot be prepared, such as too many patches.
    pub(crate) fn prepared(&self, levels: &Levels) -> Result<Prepared, PrepareError> {
        let times = f64::from(1 << levels[Knob::Step.index()]);
        Prepared::with_materials(self.refined(levels), |materials| stretch(materials, times), &mut |_| ())
    }

    /// The value of a knob at a level, as TOML.
    pub(crate) fn value(&self, knob: Knob, levels: &Levels) -> String {
        let scene = self.refined(levels);
        let of_exchange =
            |value: fn(&ExchangeSettings) -> String| scene.exchange.as_ref().map(value).unwrap_or_default();
        match knob {
            Knob::Mesh => number(scene.density.model.max.unwrap_or(f64::NAN)),
            Knob::Light => scene.shadows.and_then(|one| one.spacing).map(number).unwrap_or_default(),
            Knob::LightRedraw => scene.shadows.map(|one| number(one.redraw_angle.to_degrees())).unwrap_or_default(),
            Knob::Rays => of_exchange(|one| one.rays.to_string()),
            Knob::Patches => of_exchange(|one| one.patch_edge.map(number).unwrap_or_default()),
            Knob::Hold => of_exchange(|one| number(one.hold)),
            Knob::Redraw => of_exchange(|one| number(one.redraw_angle.to_degrees())),
            Knob::Step => number(scene.time.step),
            Knob::Accurate => format!("\"{}\"", scene.network.integrator),
        }
    }
}

/// A number as TOML, to six digits: settings need no more, and the rounding of a quotient would only confuse.
pub(crate) fn number(value: f64) -> String {
    let short: f64 = format!("{value:.5e}").parse().unwrap_or(value);
    short.to_string()
}

fn scale(edges: &mut Edges, share: f64) {
    edges.max = edges.max.map(|edge| edge * share);
    edges.min = edges.min.map(|edge| edge * share);
}

/// Transitions in steps that are shorter by this factor.
fn stretch(materials: &mut [Material], times: f64) {
    for material in materials {
        if let Response::Transition(transition) = &mut material.response {
            transition.heating.t_max_steps *= times;
            transition.cooling.t_max_steps *= times;
        }
    }
}

/// The density with a longest edge in `[model]` and in every `[[part]]`. A stated length above the longest edge of the mesh would halve without any
/// effect, so the longest edge takes its place.
fn stated(density: &Density, prepared: &Prepared) -> Density {
    let nodes = &prepared.nodes;
    let rules = density.parts.len();
    let rule_of: Vec<usize> = prepared
        .parts
        .iter()
        .map(|name| density.parts.iter().position(|rule| rule.matches(name)).unwrap_or(rules))
        .collect();
    let mut longest = vec![0.0f64; rules + 1];
    for [a, b, c] in &prepared.triangles {
        let rule = rule_of.get(nodes.group_part[*a as usize / GROUP] as usize).copied().unwrap_or(rules);
        let at = [a, b, c].map(|node| nodes.positions[*node as usize].as_dvec3());
        let edges = [(0, 1), (1, 2), (2, 0)].map(|(from, to)| at[from].distance(at[to]));
        longest[rule] = edges.into_iter().fold(longest[rule], f64::max);
    }
    let whole = longest.iter().copied().fold(0.0, f64::max);
    let edge = |rule: usize, stated: Option<f64>| {
        let found = if longest[rule] > 0.0 { longest[rule] } else { whole };
        Some(stated.map_or(found, |stated| stated.min(found)))
    };
    let mut density = density.clone();
    for (index, rule) in density.parts.iter_mut().enumerate() {
        rule.edges.max = edge(index, rule.edges.max.or(density.model.max));
        rule.edges.min = rule.edges.min.or(density.model.min);
    }
    density.model.max = edge(rules, density.model.max);
    density
}
