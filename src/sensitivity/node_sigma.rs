//! The uncertainty of the temperature of every node over a run, from which any image of the run is drawn (docs/numerics.md 12).

use rayon::prelude::*;

use super::SensitivityError;
use super::search::Search;
use super::sigma::{Deviation, Uncertain, uncertain_scene};
use super::variant::VariantRun;
use crate::simulation::corner_image::{PixelNodes, pixel_nodes};
use crate::simulation::image::{Image, ImageSigma};
use crate::simulation::prepare::Prepared;

/// Memory for the derivatives of all nodes [bytes].
const MEMORY: usize = 256 << 20;

/// How the temperature of every node depends on the parameters whose ranges the scene states.
pub(crate) struct NodeSigma {
    uncertain: Vec<Uncertain>,
    /// Steps whose derivatives are kept.
    steps: Vec<u32>,
    /// Derivatives by step, parameter and node: for a change by all of the value [K].
    derivatives: Vec<Vec<Vec<f32>>>,
}

/// The distance of the steps whose derivatives are kept, so that they take at most [`MEMORY`] bytes.
fn distance(steps: u32, nodes: usize, parameters: usize) -> u32 {
    // Six more lists for the runs under way, two parameters at a time.
    let of_step = size_of::<f32>() * nodes * (parameters + 6);
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
    let steps = run.nodes.iter().map(|(step, _)| *step).collect();
    Ok(NodeSigma { uncertain, steps, derivatives })
}

impl NodeSigma {
    /// Names of the parameters. The first has the label 1.
    pub(crate) fn causes(&self) -> impl Iterator<Item = &str> {
        self.uncertain.iter().map(|one| one.cause.name.as_str())
    }

    /// Steps from one whose derivatives are known to the next. Derivatives are linear between them.
    pub(crate) fn every(&self) -> u32 {
        self.steps.get(1).map_or(1, |second| second - self.steps[0])
    }

    /// T_sigma and the cause in each pixel of an image at the end of a step of the same scene. The radiance has none.
    pub(crate) fn draw(&self, prepared: &Prepared, image: &Image, step: u32) -> ImageSigma {
        let after = self.steps.partition_point(|known| *known < step).min(self.steps.len() - 1);
        let before = if self.steps[after] <= step { after } else { after.saturating_sub(1) };
        let span = f64::from(self.steps[after] - self.steps[before]);
        let share = if span > 0.0 { f64::from(step - self.steps[before]) / span } else { 0.0 };
        let of_pixel = |nodes: &Option<PixelNodes>| {
            let mut sum = Deviation::default();
            if let Some(nodes) = nodes {
                for (number, of) in self.uncertain.iter().enumerate() {
                    let at = |kept: usize| nodes.mix(|node| f64::from(self.derivatives[kept][number][node]));
                    sum.add((1.0 - share) * at(before) + share * at(after), number, of);
                }
            }
            (sum.sigma() as f32, sum.label())
        };
        let (temperature, cause) = pixel_nodes(prepared, image, None).par_iter().map(of_pixel).unzip();
        ImageSigma { temperature, radiance: Vec::new(), cause }
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
            assert!(kept * 4 * nodes * (parameters + 6) <= MEMORY || kept == 2, "{steps} {nodes}: {kept}");
            assert!(every == 1 || steps.div_ceil(every - 1) as usize * 4 * nodes * (parameters + 6) > MEMORY / 2);
        }
    }
}
