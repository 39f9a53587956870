//! How what a patch absorbs differs from node to node: a plane through its flux and the fluxes of the patches around it. Twins: `glsl/exchange_gradient.comp` and
//! `glsl/exchange_spread.comp`.
//!
//! Rays tell one flux of a patch, the mean over its nodes. What arrives changes smoothly over a flat side, so the patches of the same side around it tell a gradient, by least
//! squares with weights inverse to squared distances. Ways of nodes are counted from the mean place of the patch, so a plane changes no sum: heat stays balanced.
//!
//! Fluxes jump at the edge of what hides a wall, and no plane follows a jump. There gradients change from patch to patch. So a gradient counts by the part of it in which its
//! neighbours' gradients agree, less the part in which they do not. The node farthest from the centre can not differ from the mean by more than the mean itself, so no flux changes its sign.
//!
//! How much the flux bends is the error that is left ([`Slopes::errors`]).

use std::ops::Range;
use std::sync::Arc;

use glam::{DMat3, DVec3, Vec3};
use rayon::prelude::*;

/// Most neighbours from which the gradient over a patch is taken.
pub(crate) const NEIGHBOURS: usize = 8;
/// Part of the trace that is added to a matrix of distances, so that a direction in which neighbours hardly differ has no gradient: a row of patches tells none across itself.
const FLAT: f64 = 1e-2;
/// Square of a distance, over the square of the largest one, below which a neighbour lies at the same place.
const SAME: f64 = 1e-4;

/// Patches among their neighbours. Without any patch, no flux differs within patches.
#[derive(Debug, Clone, Default)]
pub(crate) struct Slopes {
    pub(crate) patches: Vec<Slope>,
    /// Nodes of the patches, each with its share of the patch's area.
    nodes: Arc<Vec<(u32, f64)>>,
    /// Way of each of these nodes from the centre of its patch, in the file's pose [m].
    pub(crate) ways: Vec<Vec3>,
    /// Share of what each patch absorbs that reflections carry too far ([`super::echoes`]). Empty where it is 0.
    pub(super) spread: Vec<f64>,
}

/// A patch among its neighbours.
#[derive(Debug, Clone)]
pub(crate) struct Slope {
    /// Its nodes, as places among all.
    nodes: Range<usize>,
    /// Mean squared distance of the nodes from the centre, by area [m2].
    spread: f64,
    /// Way of the farthest node from the centre [m].
    pub(crate) radius: f64,
    pub(crate) neighbours: Vec<Neighbour>,
}

/// A patch of the same side.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Neighbour {
    /// Its number.
    pub(crate) patch: u32,
    /// Way to its centre [m].
    way: DVec3,
    /// Vector by which its difference in flux counts for the gradient [1/m].
    pub(crate) weight: Vec3,
}

impl Slopes {
    /// Patches with the numbers of their sides, their centres, and their nodes as places among `nodes`. Positions are of all nodes of the craft, in the file's pose [m].
    pub(crate) fn new(
        patches: &[(u32, DVec3, Range<usize>)],
        nodes: &Arc<Vec<(u32, f64)>>,
        positions: &[DVec3],
    ) -> Self {
        let most = patches.iter().map(|(side, ..)| *side as usize + 1).max().unwrap_or(0);
        let mut of_sides: Vec<Vec<u32>> = vec![Vec::new(); most];
        (0..).zip(patches).for_each(|(number, (side, ..))| of_sides[*side as usize].push(number));
        let ways = |(_, centre, nodes_of): &(u32, DVec3, Range<usize>)| -> Vec<Vec3> {
            nodes[nodes_of.clone()].iter().map(|(node, _)| (positions[*node as usize] - centre).as_vec3()).collect()
        };
        let ways: Vec<Vec3> = patches.iter().flat_map(ways).collect();
        let square = |place: usize| nodes[place].1 * ways[place].as_dvec3().length_squared();
        let spreads: Vec<f64> = patches.iter().map(|(.., nodes_of)| nodes_of.clone().map(square).sum()).collect();
        let slope = |(number, (side, centre, nodes_of)): (usize, &(u32, DVec3, Range<usize>))| {
            let spread = spreads[number];
            let farthest = ways[nodes_of.clone()].iter().map(|way| way.length_squared()).fold(0.0, f32::max);
            let radius = f64::from(farthest).sqrt();
            let others = of_sides[*side as usize].iter().filter(|other| **other as usize != number);
            let away = |other: &u32| (*other, patches[*other as usize].1 - centre);
            let near = others.map(away).filter(|(_, way)| way.length_squared() > 0.0).collect();
            let neighbours = neighbours(near, |other| spread.max(spreads[other as usize]));
            Slope { nodes: nodes_of.clone(), spread, radius, neighbours }
        };
        let patches = patches.par_iter().enumerate().map(slope).collect();
        Self { patches, nodes: Arc::clone(nodes), ways, spread: Vec::new() }
    }

    /// What each node of each patch absorbs above the mean of the patch, where patches absorb these fluxes [W/m2]. Empty where none differs.
    pub(crate) fn differences(&self, absorbed: &[f64]) -> Vec<f64> {
        let told = self.gradients(absorbed);
        let of = |(number, slope): (usize, &Slope)| -> Vec<f64> {
            let gradient = self.used(number, &told, absorbed);
            self.ways[slope.nodes.clone()].iter().map(|way| gradient.dot(way.as_dvec3())).collect()
        };
        self.patches.par_iter().enumerate().flat_map_iter(of).collect()
    }

    /// Gradient of the flux over each patch [W/m3], as its neighbours tell it.
    fn gradients(&self, absorbed: &[f64]) -> Vec<DVec3> {
        let told = |(slope, mean): (&Slope, &f64)| {
            let apart = |other: &Neighbour| other.weight.as_dvec3() * (absorbed[other.patch as usize] - mean);
            slope.neighbours.iter().map(apart).sum()
        };
        self.patches.par_iter().zip(absorbed).map(told).collect()
    }

    /// The gradient of a patch [W/m3], less what its neighbours do not confirm. It is limited so that no node can differ from the mean by more than the mean.
    fn used(&self, number: usize, told: &[DVec3], absorbed: &[f64]) -> DVec3 {
        let (slope, own) = (&self.patches[number], told[number]);
        let square = own.length_squared();
        if square == 0.0 {
            return own;
        }
        let agrees = |other: &Neighbour| {
            let counts = f64::from(other.weight.length());
            (counts, counts * (told[other.patch as usize].dot(own) / square).clamp(0.0, 1.0))
        };
        let sums = slope.neighbours.iter().map(agrees).fold((0.0, 0.0), |sum, one| (sum.0 + one.0, sum.1 + one.1));
        let gradient = own * (2.0 * sums.1 / sums.0 - 1.0).max(0.0);
        let most = gradient.length() * slope.radius;
        let mean = absorbed[number].abs();
        if most > mean { gradient * (mean / most) } else { gradient }
    }

    /// Uncertainty of the flux on the nodes of each patch [W/m2], one standard deviation, where patches absorb these fluxes [W/m2]. Empty where no flux differs.
    ///
    /// - Neighbours that lie off the plane tell how much the flux bends. Within a patch it bends less by the square of the distances.
    /// - At a rim all neighbours lie on one side, so a flux that bends tilts the plane. How gradients differ tells by how much.
    /// - What was taken off a gradient counts whole.
    /// - Light that goes to and fro between shiny patches is spread over each of them. As much of the largest difference between the patch and its neighbours is uncertain.
    ///
    /// A plane that is steep over a short way between two patches says nothing of a wide one. So no error is larger than the largest difference between the patch and its neighbours.
    pub(crate) fn errors(&self, absorbed: &[f64]) -> Vec<f64> {
        let gradients = self.gradients(absorbed);
        let of = |(number, slope): (usize, &Slope)| {
            let (told, used) = (gradients[number], self.used(number, &gradients, absorbed));
            let tilt =
                |other: &Neighbour| other.weight.as_dvec3() * other.way.dot(gradients[other.patch as usize] - told);
            let tilt: DVec3 = slope.neighbours.iter().map(tilt).sum();
            let bend = |other: &Neighbour| {
                let off = absorbed[other.patch as usize] - absorbed[number] - told.dot(other.way);
                (off * (slope.spread / other.way.length_squared()).min(1.0)).powi(2)
            };
            let bends = slope.neighbours.iter().map(bend).sum::<f64>() / slope.neighbours.len().max(1) as f64;
            let lost = |place: usize| {
                let way = self.ways[place].as_dvec3();
                self.nodes[place].1 * ((told - used).dot(way).powi(2) + tilt.dot(way).powi(2))
            };
            let apart = |other: &Neighbour| (absorbed[other.patch as usize] - absorbed[number]).abs();
            let most = slope.neighbours.iter().map(apart).fold(0.0, f64::max);
            let spread = self.spread.get(number).map_or(0.0, |spread| spread * most);
            (bends + slope.nodes.clone().map(lost).sum::<f64>() + spread * spread).sqrt().min(most)
        };
        self.patches.par_iter().enumerate().map(of).collect()
    }
}

/// The nearest of some patches, with their ways. `spread` is the larger one of both patches [m2].
fn neighbours(mut near: Vec<(u32, DVec3)>, spread: impl Fn(u32) -> f64) -> Vec<Neighbour> {
    let nearer =
        |a: &(u32, DVec3), b: &(u32, DVec3)| a.1.length_squared().total_cmp(&b.1.length_squared()).then(a.0.cmp(&b.0));
    if near.len() > NEIGHBOURS {
        near.select_nth_unstable_by(NEIGHBOURS, nearer);
        near.truncate(NEIGHBOURS);
    }
    near.sort_unstable_by(nearer);
    // Patches around the same centre tell no gradient, such as a ring and the node in its middle, or nodes at an edge between facets. So a distance counts against the
    // spread, and against the largest distance.
    let least = SAME * near.last().map_or(0.0, |(_, way)| way.length_squared());
    let weight = |patch: u32, way: DVec3| (way.length_squared() + spread(patch).max(least)).recip();
    let square =
        |(patch, way): &(u32, DVec3)| DMat3::from_cols(*way * way.x, *way * way.y, *way * way.z) * weight(*patch, *way);
    let squares = near.iter().map(square).fold(DMat3::ZERO, |sum, one| sum + one);
    let trace = squares.x_axis.x + squares.y_axis.y + squares.z_axis.z;
    let inverse = (squares + DMat3::from_diagonal(DVec3::splat((FLAT * trace).max(FLAT)))).inverse();
    let counted =
        |(patch, way): (u32, DVec3)| Neighbour { patch, way, weight: (inverse * way * weight(patch, way)).as_vec3() };
    near.into_iter().map(counted).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Patches along an edge of a plate, and nodes along an edge of a patch.
    const PATCHES: usize = 6;
    const NODES: usize = 4;

    /// A plate of 1 m in patches: their slopes, and the places of their nodes, one patch after the other.
    fn plate() -> (Slopes, Vec<DVec3>) {
        let at = |patch: usize, node: usize| ((patch * NODES + node) as f64 + 0.5) / (PATCHES * NODES) as f64;
        let mut positions = Vec::new();
        let mut patches = Vec::new();
        for patch in 0..PATCHES * PATCHES {
            let first = positions.len();
            let places = (0..NODES * NODES)
                .map(|node| DVec3::new(at(patch % PATCHES, node % NODES), at(patch / PATCHES, node / NODES), 0.0));
            positions.extend(places);
            let own = &positions[first..];
            patches.push((0, own.iter().sum::<DVec3>() / own.len() as f64, first..positions.len()));
        }
        let share = 1.0 / (NODES * NODES) as f64;
        let nodes = Arc::new((0..positions.len() as u32).map(|node| (node, share)).collect());
        (Slopes::new(&patches, &nodes, &positions), positions)
    }

    /// What patches absorb of a flux, the mean over their nodes, and by how much nodes differ from the truth: with slopes, and with uniform patches.
    fn off(flux: impl Fn(DVec3) -> f64) -> (Vec<f64>, [Vec<f64>; 2]) {
        let (slopes, positions) = plate();
        let true_ones: Vec<f64> = positions.iter().map(|at| flux(*at)).collect();
        let absorbed: Vec<f64> =
            true_ones.chunks(NODES * NODES).map(|own| own.iter().sum::<f64>() / own.len() as f64).collect();
        let uniform = |(place, truth): (usize, &f64)| absorbed[place / (NODES * NODES)] - truth;
        let flat: Vec<f64> = true_ones.iter().enumerate().map(uniform).collect();
        let sloped = flat.iter().zip(slopes.differences(&absorbed)).map(|(off, differs)| off + differs).collect();
        (absorbed, [sloped, flat])
    }

    fn rms(values: &[f64]) -> f64 {
        (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt()
    }

    #[test]
    fn a_flux_that_changes_evenly_is_right_at_every_node() {
        let (_, off) = off(|at| 100.0 + 50.0 * at.x - 20.0 * at.y);
        let [sloped, flat] = off.each_ref().map(|off| rms(off));
        println!("{sloped:.4} W/m2 rms, {flat:.4} with uniform patches");
        assert!(sloped < 0.03 * flat && flat > 2.0, "{sloped}, {flat}");
    }

    #[test]
    fn no_sum_changes_and_no_flux_its_sign() {
        let (slopes, _) = plate();
        // Hot at one edge, and ever less beside it.
        let absorbed: Vec<f64> =
            (0..PATCHES * PATCHES).map(|patch| 400.0 * 0.02f64.powi((patch % PATCHES) as i32)).collect();
        let differences = slopes.differences(&absorbed);
        let mut limited = 0;
        for (own, mean) in differences.chunks(NODES * NODES).zip(&absorbed) {
            assert!(own.iter().sum::<f64>().abs() < 1e-4, "{own:?}");
            assert!(own.iter().all(|differs| mean + differs > -1e-4), "{own:?} about {mean}");
            limited += usize::from(own.iter().any(|differs| differs.abs() > 0.6 * mean));
        }
        assert!(limited >= 2, "no gradient beside the edge is limited");
    }

    /// A wall that is hidden from one half of the plate: uniform patches are exact, and a plane through the jump is not.
    #[test]
    fn a_jump_between_patches_hardly_tilts_them() {
        let (_, [sloped, _]) = off(|at| if at.x < 0.5 { 100.0 } else { 20.0 });
        println!("{:.2} W/m2 rms", rms(&sloped));
        // With all that neighbours tell, 6.2.
        assert!(rms(&sloped) < 2.0, "{}", rms(&sloped));
    }

    /// The centre of a ring lies beside the node in its middle by rounding alone.
    #[test]
    fn a_ring_and_the_node_in_its_middle_tell_no_gradient() {
        let turn = |node: usize| f64::from(node as u32) / 16.0 * std::f64::consts::TAU;
        let mut positions: Vec<DVec3> =
            (0..16).map(|node| DVec3::new(turn(node).cos(), turn(node).sin(), 0.0)).collect();
        let centre = positions.iter().sum::<DVec3>() / 16.0;
        positions.extend([centre + 1e-13 * DVec3::X, DVec3::new(1.5, 0.0, 0.0)]);
        let nodes = Arc::new((0..16).map(|node| (node, 1.0 / 16.0)).chain([(16, 1.0), (17, 1.0)]).collect());
        let patches = [(0, centre, 0..16), (0, positions[16], 16..17), (0, positions[17], 17..18)];
        let slopes = Slopes::new(&patches, &nodes, &positions);
        let stated = slopes.errors(&[100.0, 140.0, 90.0]);
        assert!(stated.iter().all(|error| *error < 60.0), "{stated:?}");
        // Two nodes of one place, on both sides of an edge.
        let positions = [0.0, 1e-9, 0.3].map(|x| DVec3::new(x, 0.0, 0.0));
        let patches = [0, 1, 2].map(|node| (0, positions[node], node..node + 1));
        let nodes = Arc::new((0..3).map(|node| (node, 1.0)).collect());
        let stated = Slopes::new(&patches, &nodes, &positions).errors(&[100.0, 140.0, 90.0]);
        assert!(stated.iter().all(|error| *error < 60.0), "{stated:?}");
    }

    /// Two small patches 1 cm apart differ by 20 W/m2, beside one of 2 m. A plane through them says 2 kW/m2 over a metre.
    #[test]
    fn a_short_way_between_neighbours_says_little_of_a_wide_patch() {
        let wide = (0..21).map(|node| DVec3::new(0.1 * f64::from(node) - 1.0, 0.0, 0.0));
        let positions: Vec<DVec3> = wide.chain([-0.005, 0.005].map(|x| DVec3::new(x, 0.01, 0.0))).collect();
        let nodes = Arc::new((0..23).map(|node| (node, if node < 21 { 1.0 / 21.0 } else { 1.0 })).collect());
        let patches = [(0, DVec3::ZERO, 0..21), (0, positions[21], 21..22), (0, positions[22], 22..23)];
        let stated = Slopes::new(&patches, &nodes, &positions).errors(&[100.0, 90.0, 110.0]);
        println!("{stated:?}");
        assert!(stated[0] <= 10.0 && stated[1].max(stated[2]) <= 20.0, "{stated:?}");
    }

    #[test]
    fn the_stated_error_is_that_of_a_flux_that_bends() {
        let (slopes, _) = plate();
        let (absorbed, [sloped, flat]) = off(|at| 100.0 + 80.0 * at.x * at.x);
        let stated = slopes.errors(&absorbed);
        // The patches at the rim have neighbours on one side, so the plane is steeper or flatter than the flux.
        for rim in [false, true] {
            let is_rim = |patch: usize| matches!(patch % PATCHES, 0 | 5) == rim;
            let of = |off: &[f64]| {
                let own = off.chunks(NODES * NODES).enumerate().filter(|(patch, _)| is_rim(*patch));
                rms(&own.flat_map(|(_, own)| own.to_vec()).collect::<Vec<_>>())
            };
            let told: Vec<f64> =
                stated.iter().enumerate().filter(|(patch, _)| is_rim(*patch)).map(|(_, told)| *told).collect();
            let [truly, uniform] = [&sloped, &flat].map(|off| of(off));
            println!("rim {rim}: {truly:.4} W/m2 rms, {:.4} stated, {uniform:.4} with uniform patches", rms(&told));
            assert!(truly < 2.0 * rms(&told) && rms(&told) < 4.0 * truly && truly < 0.5 * uniform);
        }
    }
}
