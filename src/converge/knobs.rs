//! The settings of a scene that trade time for error, and how each is refined.

use crate::exchange::hold::longest_part;
use crate::model::nodes::GROUP;
use crate::scene::{Density, Draw, Edges, Scene, ShadowSettings, Time};
use crate::simulation::prepare::Prepared;
use crate::simulation::prepare_error::PrepareError;
use crate::thermal::material::{Material, Response};
use crate::thermal::network::control::Integrator;
use Kind::Scaled;

/// Most rays of a patch that a scene can state.
const MOST_RAYS: u32 = 65_536;

/// A setting that trades time for error.
pub(crate) struct Knob {
    /// The key in a scene file.
    pub(crate) key: &'static str,
    /// Error of the finer setting as a share of the change that the refinement made. Halved lengths count as order 1, which gives 1. A quarter of an angle
    /// of order 1 gives 1/3, and so does a half of a length of order 2. Noise of four times as many rays is half as large, which gives 1/2 at most. A setting without a finer one gives 0.
    pub(crate) left: f64,
    kind: Kind,
}

/// How a setting is refined.
enum Kind {
    /// Times a factor, where the scene has the value and it is above 0.
    Scaled(f64, fn(&mut Scene) -> Option<&mut f64>),
    Mesh,
    Rays,
    Hold,
    Step,
    Integrator,
}
/// All settings, in the order of the table.
pub(crate) static KNOBS: [Knob; 9] = [
    Knob { key: "model.max_edge", left: 1.0, kind: Kind::Mesh },
    Knob { key: "shadows.spacing", left: 1.0, kind: Scaled(0.5, |scene| lit(scene)?.spacing.as_mut()) },
    Knob {
        key: "shadows.redraw_angle_deg",
        left: 1.0 / 3.0,
        kind: Scaled(0.25, |scene| Some(&mut lit(scene)?.redraw_angle)),
    },
    Knob { key: "exchange.rays", left: 0.5, kind: Kind::Rays },
    Knob {
        key: "exchange.patch_edge",
        left: 1.0,
        kind: Scaled(0.5, |scene| scene.exchange.as_mut()?.patch_edge.as_mut()),
    },
    Knob { key: "exchange.hold", left: 1.0 / 3.0, kind: Kind::Hold },
    Knob {
        key: "exchange.redraw_angle_deg",
        left: 1.0 / 3.0,
        kind: Scaled(0.25, |scene| Some(&mut scene.exchange.as_mut()?.redraw_angle)),
    },
    Knob { key: "time.step", left: 1.0, kind: Kind::Step },
    Knob { key: "network.integrator", left: 0.0, kind: Kind::Integrator },
];

/// The shadows, where the Sun shines.
fn lit(scene: &mut Scene) -> Option<&mut ShadowSettings> {
    let flux = scene.environment.solar_constant;
    scene.shadows.as_mut().filter(|_| flux.is_some_and(|flux| flux > 0.0))
}

impl Knob {
    /// Whether a scene has the setting and can state a finer one.
    fn is_in(&self, scene: &Scene, has_network: bool) -> bool {
        match self.kind {
            Scaled(_, value) => value(&mut scene.clone()).is_some_and(|value| *value > 0.0),
            Kind::Mesh | Kind::Step => true,
            Kind::Hold => scene
                .exchange
                .and_then(|exchange| exchange.hold)
                .is_some_and(|hold| longest_part(0.5 * hold, scene.time.step) < hold),
            Kind::Rays => scene.exchange.is_some_and(|exchange| exchange.rays <= MOST_RAYS / 4),
            Kind::Integrator => has_network && scene.network.integrator != Integrator::Accurate,
        }
    }

    fn refine(&self, scene: &mut Scene) {
        match self.kind {
            Scaled(factor, value) => value(scene).into_iter().for_each(|value| *value *= factor),
            Kind::Mesh => {
                let rules = scene.density.parts.iter_mut().map(|rule| &mut rule.edges);
                for edges in rules.chain([&mut scene.density.model]) {
                    *edges = Edges { max: edges.max.map(|edge| edge / 2.0), min: edges.min.map(|edge| edge / 2.0) };
                }
            }
            Kind::Hold => scene.exchange.iter_mut().flat_map(|own| &mut own.hold).for_each(|hold| *hold *= 0.5),
            Kind::Rays => scene.exchange.iter_mut().for_each(|exchange| exchange.rays *= 4),
            Kind::Step => halve_step(&mut scene.time),
            Kind::Integrator => scene.network.integrator = Integrator::Accurate,
        }
    }

    /// Value in a scene, as TOML.
    fn value(&self, scene: &mut Scene) -> String {
        match self.kind {
            Scaled(_, value) => {
                let is_angle = self.key.ends_with("_deg");
                let value = value(scene).map(|value| if is_angle { value.to_degrees() } else { *value });
                value.map(number).unwrap_or_default()
            }
            Kind::Mesh => scene.density.model.max.map(number).unwrap_or_default(),
            Kind::Hold => scene.exchange.and_then(|exchange| exchange.hold).map(number).unwrap_or_default(),
            Kind::Rays => scene.exchange.map(|exchange| exchange.rays.to_string()).unwrap_or_default(),
            Kind::Step => scene.time.step.to_string(),
            Kind::Integrator => format!("\"{}\"", scene.network.integrator),
        }
    }
}

/// Settings that are refined: a bit for each of [`KNOBS`].
pub(crate) type Refined = u16;

/// The settings of a choice.
pub(crate) fn knobs_of(refined: Refined) -> impl Iterator<Item = (Refined, &'static Knob)> {
    (0..).zip(&KNOBS).map(|(bit, knob)| (1 << bit, knob)).filter(move |(bit, _)| refined & bit != 0)
}

/// A scene with every setting stated that a knob refines.
pub(crate) struct KnobScene {
    scene: Scene,
    /// The settings that the scene has.
    pub(crate) all: Refined,
}

impl KnobScene {
    /// States the settings that the scene left to its model: edges, spacing of light and size of patches.
    pub(crate) fn new(prepared: &Prepared, mut scene: Scene) -> Self {
        scene.density = stated(&scene.density, prepared);
        if let Some(shadows) = &mut scene.shadows {
            shadows.spacing = Some(prepared.light.spacing());
        }
        if let (Some(exchange), Some(craft)) = (&mut scene.exchange, &prepared.exchange) {
            (exchange.patch_edge, exchange.hold) = (craft.settings.patch_edge, craft.settings.hold);
        }
        let has_network = prepared.network.is_some();
        let all = knobs_of(Refined::MAX).filter(|(_, knob)| knob.is_in(&scene, has_network));
        let all = all.fold(0, |all, (bit, _)| all | bit);
        Self { scene, all }
    }

    pub(crate) fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The scene with finer settings.
    pub(crate) fn refined(&self, refined: Refined) -> Scene {
        let mut scene = self.scene.clone();
        knobs_of(refined).for_each(|(_, knob)| knob.refine(&mut scene));
        scene
    }

    /// The scene with finer settings, prepared. What a material holds for a step follows the length of the step: transitions keep theirs in seconds.
    ///
    /// # Errors
    /// A refinement that cannot be prepared, such as too many patches.
    pub(crate) fn prepared(&self, refined: Refined) -> Result<Prepared, PrepareError> {
        let scene = self.refined(refined);
        let step = scene.time.step;
        let times = self.scene.time.step / step;
        let follow = |materials: &mut [Material]| {
            for material in materials {
                match &mut material.response {
                    Response::Transition(transition) => {
                        transition.heating.t_max_steps *= times;
                        transition.cooling.t_max_steps *= times;
                    }
                    Response::Radiative(plate) => plate.step = step,
                    Response::Instant | Response::Network | Response::Given => {}
                }
            }
        };
        Prepared::with_materials(scene, follow, &mut |_| ())
    }

    /// Value of a setting as TOML, before and after its refinement.
    pub(crate) fn values(&self, bit: Refined, knob: &Knob) -> [String; 2] {
        [0, bit].map(|refined| knob.value(&mut self.refined(refined)))
    }

    /// The refined settings as `key = value`.
    pub(crate) fn sentence(&self, refined: Refined) -> String {
        let stated = |(bit, knob): (Refined, &Knob)| format!("{} = {}", knob.key, self.values(bit, knob)[1]);
        let stated: Vec<String> = knobs_of(refined).map(stated).collect();
        if stated.is_empty() { "the settings of the scene".to_owned() } else { stated.join(", ") }
    }

    /// The refined settings as sections of a scene file.
    pub(crate) fn toml(&self, refined: Refined) -> String {
        let scene = self.refined(refined);
        let mut sections: Vec<(&str, String)> = Vec::new();
        for (bit, knob) in knobs_of(refined) {
            let (section, key) = knob.key.split_once('.').unwrap_or(("", knob.key));
            if sections.last().is_none_or(|(last, _)| *last != section) {
                sections.push((section, String::new()));
            }
            let Some((_, text)) = sections.last_mut() else { continue };
            text.push_str(&format!("{key} = {}\n", self.values(bit, knob)[1]));
            match section {
                "model" => text.extend(scene.density.model.min.map(|edge| format!("min_edge = {}\n", number(edge)))),
                "time" => text.push_str(&time_lines(&scene.time)),
                _ => {}
            }
        }
        let mut text: String = sections.iter().map(|(name, text)| format!("\n[{name}]\n{text}")).collect();
        let refines_mesh = sections.iter().any(|(name, _)| *name == "model");
        for rule in scene.density.parts.iter().filter(|_| refines_mesh) {
            let patterns = toml::Value::from(rule.patterns.clone());
            text.push_str(&format!("\n[[part]]\nmatch = {patterns}\n"));
            text.extend(rule.edges.max.map(|edge| format!("max_edge = {}\n", number(edge))));
            text.extend(rule.edges.min.map(|edge| format!("min_edge = {}\n", number(edge))));
        }
        text
    }
}

/// The keys of `[time]` that go with a step of half the length.
fn time_lines(time: &Time) -> String {
    let mut text = format!("steps = {}\n", time.steps);
    if (time.warm_up_step - time.step).abs() > 1e-9 * time.step {
        text.push_str(&format!("warm_up_step = {}\n", time.warm_up_step));
    }
    match &time.draw {
        Draw::Every(stride) => text.push_str(&format!("draw_every = {stride}\n")),
        Draw::Steps(steps) => text.push_str(&format!("draw_steps = {steps:?}\n")),
        Draw::None | Draw::Times(_) => {}
    }
    text + "# A material that states t_max_steps needs twice as many.\n"
}

/// A number as TOML, to six digits: settings need no more, and the rounding of a quotient would only confuse.
fn number(value: f64) -> String {
    let short: f64 = format!("{value:.5e}").parse().unwrap_or(value);
    short.to_string()
}

fn halve_step(time: &mut Time) {
    time.step /= 2.0;
    time.warm_up_step /= 2.0;
    time.steps = time.steps.saturating_mul(2);
    match &mut time.draw {
        Draw::None | Draw::Times(_) => {}
        Draw::Every(stride) => *stride = stride.saturating_mul(2),
        Draw::Steps(steps) => steps.iter_mut().for_each(|step| *step = step.saturating_mul(2)),
    }
}

/// The density with a longest edge in `[model]` and in every `[[part]]`. A stated length above the longest edge of the mesh would halve without any
/// effect, so the longest edge takes its place.
fn stated(density: &Density, prepared: &Prepared) -> Density {
    let nodes = &prepared.nodes;
    let rules = density.parts.len();
    let rule = |name: &String| density.parts.iter().position(|rule| rule.matches(name)).unwrap_or(rules);
    let rule_of: Vec<usize> = prepared.parts.iter().map(rule).collect();
    let mut longest = vec![0.0f64; rules + 1];
    for [a, b, c] in &prepared.triangles {
        let rule = rule_of.get(nodes.group_part[*a as usize / GROUP] as usize).copied().unwrap_or(rules);
        let at = [a, b, c].map(|node| nodes.positions[*node as usize].as_dvec3());
        let edges = [(0, 1), (1, 2), (2, 0)].map(|(from, to)| at[from].distance(at[to]));
        longest[rule] = edges.into_iter().fold(longest[rule], f64::max);
    }
    let whole = longest.iter().copied().fold(0.0, f64::max);
    let edge = |rule: usize, stated: Option<f64>| {
        let longest = if longest[rule] > 0.0 { longest[rule] } else { whole };
        Some(stated.map_or(longest, |stated| stated.min(longest)))
    };
    let mut density = density.clone();
    for (index, rule) in density.parts.iter_mut().enumerate() {
        rule.edges.max = edge(index, rule.edges.max.or(density.model.max));
        rule.edges.min = rule.edges.min.or(density.model.min);
    }
    density.model.max = edge(rules, density.model.max);
    density
}
