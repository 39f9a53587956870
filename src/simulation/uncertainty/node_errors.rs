//! Errors of a node, cause by cause, and how much the temperature differs within its cell.

use super::absorbed::AbsorbingSurface;
use crate::simulation::prepare::Prepared;

/// Errors of a node [K].
#[derive(Debug, Clone, Copy, Default, serde::Serialize, serde::Deserialize)]
pub(super) struct NodeErrors {
    /// By the load within steps, with its sign.
    pub(super) steps: f64,
    /// By light that is held until the next finding, and by poses of joints that are held for a step.
    pub(super) held: f64,
    /// By light that comes or goes at once within a step, whenever that is. It errs anew in each step.
    pub(super) sudden: f64,
    /// By the size of patches, and by lines between what nodes receive of the craft.
    pub(super) exchange: f64,
    /// By the noise of exchange's rays, by light of exchange that is held, and by straight lines between its rows. It is alike over a patch.
    pub(super) alike: f64,
    /// By rows of exchange that are held, which err both ways in turn.
    pub(super) rows: f64,
    /// By light that others send unevenly, with its sign.
    pub(super) uneven: f64,
    /// By infrared that arrives late, with its sign: what the node lacks.
    pub(super) late: f64,
    /// By straight lines to the nodes to which the node conducts.
    pub(super) lines: f64,
    /// By rounding.
    pub(super) rounding: f64,
}

/// Root mean square of the difference from the drawn temperature within the cell of each node [K], by the deviations and spreads of corners [K].
pub(super) fn spreads_of_nodes(
    prepared: &Prepared,
    surface: &AbsorbingSurface<'_>,
    [deviations, spreads]: [&[f64]; 2],
) -> Vec<f64> {
    let mut sums = vec![[0.0; 2]; surface.areas.len()];
    let corners = surface.corners.iter().zip(deviations.iter().zip(spreads));
    for (node, (corner, (deviation, spread))) in prepared.triangles.iter().flatten().zip(corners) {
        let [square, area] = &mut sums[*node as usize];
        *square += corner.area * (deviation * deviation + spread * spread);
        *area += corner.area;
    }
    sums.iter().map(|[square, area]| if *area > 0.0 { (square / area).sqrt() } else { 0.0 }).collect()
}

impl NodeErrors {
    /// Sum of the squares of all errors [K2].
    pub(super) fn square(&self) -> f64 {
        let Self { steps, held, sudden, exchange, alike, rows, uneven, late, lines, rounding } = self;
        [steps, held, sudden, exchange, alike, rows, uneven, late, lines, rounding]
            .iter()
            .map(|error| *error * *error)
            .sum()
    }
}
