//! The uncertainty of the temperature of every node over a run, from which any image of the run is drawn (docs/numerics.md 12).

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use rayon::prelude::*;

use super::SensitivityError;
use super::search::Search;
use super::sigma::{Deviation, Uncertain, uncertain_scene};
use super::variant::VariantRun;
use crate::model::nodes::GROUP;
use crate::scene::Draw;
use crate::simulation::corner_image::{PixelNodes, pixel_nodes};
use crate::simulation::facade::Simulation;
use crate::simulation::image::{Image, ImageSigma};
use crate::simulation::pixel_light::gains::FoilGains;
use crate::simulation::prepare::Prepared;

/// Memory for the derivatives of all nodes [bytes].
const MEMORY: usize = 256 << 20;

/// How the temperature of every node depends on the parameters whose ranges the scene states.
pub(crate) struct NodeSigma {
    uncertain: Vec<Uncertain>,
    names: Arc<Vec<String>>,
    /// Length of a step [s].
    step: f64,
    /// Steps whose derivatives are kept.
    steps: Vec<u32>,
    /// Derivatives by step, parameter and node: for a change by all of the value [K].
    derivatives: Vec<Vec<Vec<f32>>>,
    /// Temperatures of the nodes in the scene as it is, by step [K].
    temperatures: Vec<Vec<f32>>,
}

/// The distance of the steps whose derivatives are kept, so that they take at most [`MEMORY`] bytes.
fn distance(steps: u32, nodes: usize, parameters: usize) -> u32 {
    // One more list for the temperatures, and six for the runs under way, two parameters at a time.
    let of_step = size_of::<f32>() * nodes * (parameters + 7);
    let most = (MEMORY / of_step.max(1)).max(2) as u32;
    steps.div_ceil(most - 1).max(1)
}

/// Takes the runs that the uncertainty of every node needs: two for each parameter, and one of the scene as it is.
///
/// # Errors
/// A scene without ranges, a parameter that does not fit, a run that fails, or a stop.
pub(crate) fn find_node_sigma(prepared: &Prepared, search: &Search<'_>) -> Result<NodeSigma, SensitivityError> {
    let (base, parameters, uncertain) = uncertain_scene(prepared)?;
    let every = distance(base.scene.time.steps, base.nodes.vertex_of_node.len(), parameters.len());
    let mut derivatives: Vec<Vec<Vec<f32>>> = Vec::new();
    let mut take = |number: usize, [up, down]: [VariantRun; 2]| {
        let over = (0.5 / parameters[number].step) as f32;
        derivatives.resize_with(up.nodes.len(), Vec::new);
        for (of_step, ((_, up), (_, down))) in derivatives.iter_mut().zip(up.nodes.iter().zip(&down.nodes)) {
            of_step.push(up.par_iter().zip(down).map(|(up, down)| over * (up - down)).collect());
        }
    };
    let search = Search { nodes_every: Some(every), ..*search };
    let run = search.pairs(&base, &parameters, &mut take)?;
    let (steps, temperatures) = run.nodes.into_iter().unzip();
    let names = Arc::new(uncertain.iter().map(|one| one.cause.name.clone()).collect());
    Ok(NodeSigma { uncertain, names, step: base.scene.time.step, steps, derivatives, temperatures })
}

/// Draws T_sigma and the cause into an image of a simulation.
type DrawSigma = Box<dyn Fn(&Simulation, &mut Image) + Send + Sync>;

/// The uncertainty of the images of a simulation on the orbit of its scene, up to a time [s]. An image after it, or off this orbit, has none.
///
/// # Errors
/// Errors of [`find_node_sigma`], in words.
pub fn find_image_sigma(simulation: &Simulation, until: f64, stop: &AtomicBool) -> Result<DrawSigma, String> {
    let mut scene = simulation.prepared().scene.clone();
    scene.time.steps = ((until / scene.time.step - 1e-9).ceil() as u32).max(1);
    scene.time.draw = Draw::None;
    let prepared = simulation.prepared().varied(scene, |_| ()).map_err(|error| error.to_string())?;
    let search = Search { target: simulation.target(), stop, news: &|_| (), kept: &[], nodes_every: None };
    let sigma = find_node_sigma(&prepared, &search).map_err(|error| error.to_string())?;
    let end = f64::from(prepared.scene.time.steps) * prepared.scene.time.step * (1.0 + 1e-9);
    Ok(Box::new(move |simulation, image| {
        if simulation.is_on_orbit() && image.time <= end {
            image.sigma = sigma.draw(simulation.prepared(), image);
        }
    }))
}

/// A time between two steps that are kept.
struct BetweenKept {
    ends: [usize; 2],
    /// Share of the time between them that has passed.
    share: f64,
}

impl BetweenKept {
    /// The value of a node. `list` has the values of the nodes at a step that is kept.
    fn of_node<'a>(&self, node: usize, list: impl Fn(usize) -> &'a [f32]) -> f64 {
        let [before, after] = self.ends.map(|kept| f64::from(list(kept)[node]));
        (1.0 - self.share) * before + self.share * after
    }

    /// The value of a place between nodes.
    fn between<'a>(&self, nodes: &PixelNodes, list: impl Fn(usize) -> &'a [f32]) -> f64 {
        nodes.mix(|node| self.of_node(node, &list))
    }
}

impl NodeSigma {
    /// Names of the parameters. The first has the label 1.
    pub(crate) fn causes(&self) -> impl Iterator<Item = &str> {
        self.names.iter().map(String::as_str)
    }

    /// Steps from one whose derivatives are known to the next. Derivatives are linear between them.
    pub(crate) fn every(&self) -> u32 {
        self.steps.get(1).map_or(1, |second| second - self.steps[0])
    }

    /// A time among the steps that are kept [s].
    fn moment(&self, time: f64) -> BetweenKept {
        let step = time / self.step;
        let after = self.steps.partition_point(|known| f64::from(*known) < step).min(self.steps.len() - 1);
        let before = if f64::from(self.steps[after]) <= step { after } else { after.saturating_sub(1) };
        let span = f64::from(self.steps[after] - self.steps[before]);
        let share = if span > 0.0 { (step - f64::from(self.steps[before])) / span } else { 0.0 };
        BetweenKept { ends: [before, after], share }
    }

    /// T_sigma and the cause in each pixel of an image of the same scene. The radiance has none.
    pub(crate) fn draw(&self, prepared: &Prepared, image: &Image) -> ImageSigma {
        let (at, past) = (self.moment(image.time), prepared.past_light(image.time));
        let foil = past.as_ref().map(FoilGains::new);
        let of_pixel = |nodes: &Option<PixelNodes>| {
            let mut sum = Deviation::default();
            if let Some(nodes) = nodes {
                let own = foil.as_ref().and_then(|foil| {
                    let kelvin = nodes.nodes.map(|node| at.of_node(node, |kept| &self.temperatures[kept]));
                    foil.derivatives(nodes.nodes, nodes.weights, kelvin)
                });
                let material = &prepared.materials[prepared.nodes.group_material[nodes.nodes[0] / GROUP] as usize];
                for (number, of) in self.uncertain.iter().enumerate() {
                    let of_nodes = at.between(nodes, |kept| &self.derivatives[kept][number]);
                    let more = own.map_or(0.0, |own| of.own_derivative(material, &own));
                    sum.add(of_nodes + more, number, of);
                }
            }
            (sum.sigma() as f32, sum.label())
        };
        let (temperature, cause) = pixel_nodes(prepared, image, None).par_iter().map(of_pixel).unzip();
        ImageSigma { temperature, radiance: Vec::new(), cause, causes: Arc::clone(&self.names) }
    }
}

#[cfg(test)]
mod tests {
    use super::{MEMORY, distance};

    #[test]
    fn derivatives_have_a_bound_in_memory() {
        for (steps, nodes, parameters) in [(556, 2_000, 7), (600, 1_000_000, 12), (10, 10, 1)] {
            let every = distance(steps, nodes, parameters);
            let kept = steps.div_ceil(every) as usize + 1;
            assert!(kept * 4 * nodes * (parameters + 7) <= MEMORY || kept == 2, "{steps} {nodes}: {kept}");
            assert!(every == 1 || steps.div_ceil(every - 1) as usize * 4 * nodes * (parameters + 7) > MEMORY / 2);
        }
    }
}
