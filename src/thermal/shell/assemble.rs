//! Assembles a thermal network: nodes and conductors of outer sheets and structures, contacts, merging.

use super::areas::vertex_areas;
use super::conductance::Weights;
use super::contact::{Contact, NeighbourRule, touching};
use super::intrinsic::Intrinsic;
use super::merge::{MergedNodes, apply, merge, summed, threshold};
use super::weld::weld;
use super::{NO_NODE, Sheet, Shell, ShellError, ShellMaterial, ShellSummary, ShellSurface};
use crate::thermal::network::{LinearConductor, Network, NodeKind, RadiativeConductor};

/// Nodes of one layer: the node of each vertex, and the weights of conducting pairs.
struct Layer {
    node: Vec<u32>,
}

struct ShellAssembly<'a> {
    surface: &'a ShellSurface<'a>,
    materials: &'a [Option<ShellMaterial>],
    network: Network,
    summary: ShellSummary,
}

impl Shell {
    /// The network of a surface. `materials` is `None` for materials with other responses. All nodes start at `temperature` [K]. Pairs faster than
    /// `merge_rate` [1/s] are merged (see [`MERGE_RATE`]). Without a rule for `neighbours` nobody looks for them.
    ///
    /// # Errors
    /// A contact that is not valid.
    pub(crate) fn new(
        surface: &ShellSurface,
        materials: &[Option<ShellMaterial>],
        contacts: &[Contact],
        neighbours: Option<NeighbourRule>,
        merge_rate: f64,
        space_temperature: f64,
    ) -> Result<Self, ShellError> {
        let mut assembly = ShellAssembly {
            surface,
            materials,
            network: Network { space_temperature, ..Network::default() },
            summary: ShellSummary::default(),
        };
        let material = |vertex: usize| materials[surface.materials[vertex] as usize].as_ref();
        let welded = |vertex: usize| material(vertex).is_some_and(ShellMaterial::welds);

        // Places of welded vertices come first, then places of single vertices.
        let (mut place, mut places) = weld(surface, welded);
        let conducting = places;
        for (vertex, place) in place.iter_mut().enumerate() {
            if material(vertex).is_some() && *place == NO_NODE {
                *place = places as u32;
                places += 1;
            }
        }
        let mut load_areas = vertex_areas(surface);
        let mut areas = vec![0.0; places];
        for (place, area) in place.iter().zip(&mut load_areas) {
            if *place == NO_NODE {
                *area = 0.0;
            } else {
                areas[*place as usize] += *area;
            }
        }
        let mut weights = assembly.weights(&place, conducting);
        weights.rename(&adopt_bare_places(surface, &mut place, &areas));

        // Without conduction the vertices of the outer sheet stay single, even over a structure that conducts.
        let outer = assembly.outer_layer(&place, &areas, &load_areas, conducting, &weights);
        let structure = assembly.structures(&place, &areas, &load_areas, &outer, (conducting, &weights));
        drop((weights, place, areas));
        assembly.summary.vertices = outer.node.iter().filter(|node| **node != NO_NODE).count();

        for contact in contacts {
            let conductors = contact.conductors(surface, materials, &structure.node)?;
            let total: f64 = conductors.iter().map(|one| one.conductance).sum();
            assembly.summary.contacts.push((contact.name.clone(), conductors.len(), total));
            assembly.network.linear.extend(conductors);
        }
        if let Some(rule) = neighbours {
            let touching = touching(surface, materials, &structure.node, contacts, &rule);
            if rule.join {
                let total: f64 = touching.conductors.iter().map(|one| one.conductance).sum();
                let name = format!("of {} pairs of neighbours (network.contacts = \"auto\")", touching.joined);
                assembly.summary.contacts.push((name, touching.conductors.len(), total));
                assembly.network.linear.extend(touching.conductors);
            }
            assembly.summary.neighbours = touching.apart;
        }
        let ShellAssembly { mut network, mut summary, .. } = assembly;
        // Several contacts or adjoining sheets may connect the same two nodes.
        let nodes = MergedNodes { node: (0..network.len() as u32).collect(), count: network.len() };
        apply(&mut network, &nodes);
        summary.merge_rate = threshold(&network, merge_rate);
        let merged = merge(&mut network, summary.merge_rate);
        summary.merged = merged.node.len() - merged.count;
        let renumber = |layer: Layer| {
            let new = |node: u32| if node == NO_NODE { NO_NODE } else { merged.node[node as usize] };
            layer.node.into_iter().map(new).collect()
        };
        Ok(Shell {
            network,
            node_of_vertex: renumber(outer),
            structure_of_vertex: renumber(structure),
            load_areas,
            summary,
        })
    }
}

impl ShellAssembly<'_> {
    /// Weights of the pairs of welded places, and their areas.
    fn weights(&mut self, place: &[u32], conducting: usize) -> Weights {
        let at = |vertex: u32| place[vertex as usize];
        let conducts = |triangle: &&[u32; 3]| (at(triangle[0]) as usize) < conducting;
        let is_whole = |triangle: &&[u32; 3]| {
            let [a, b, c] = triangle.map(at);
            a != b && b != c && c != a
        };
        let all = self.surface.triangles;
        let collapsed = all.iter().filter(conducts).filter(|triangle| !is_whole(triangle)).count();
        let mut whole = Vec::with_capacity(all.iter().filter(conducts).count() - collapsed);
        whole.extend(all.iter().filter(conducts).filter(is_whole).copied());
        let mut intrinsic = Intrinsic::new(&whole, self.surface.positions, at);
        drop(whole);
        intrinsic.make_delaunay();
        intrinsic.forget_twins();
        let weights = Weights::new(&intrinsic);
        self.summary.flips = intrinsic.flips;
        self.summary.non_manifold = intrinsic.non_manifold;
        self.summary.degenerate = weights.degenerate + collapsed;
        weights
    }

    fn push(&mut self, sheet: &Sheet, area: f64, emissivity: f64) -> u32 {
        let capacitance = sheet.capacitance * area;
        let kind = if capacitance > 0.0 { NodeKind::Diffusive } else { NodeKind::Arithmetic };
        self.network.kinds.push(kind);
        self.network.capacitances.push(capacitance);
        self.network.emissive_areas.push(emissivity * area);
        self.network.temperatures.push(self.network.space_temperature);
        self.network.kinds.len() as u32 - 1
    }

    /// Adds the conductors of welded places. Each place comes with its node and one of its vertices. `conductance` gives the conductance of a
    /// material's sheet [W/K].
    fn conduct(&mut self, weights: &Weights, place: &[[u32; 2]], conductance: impl Fn(&ShellMaterial) -> f64) {
        let of_vertex = |vertex: u32| {
            let material = self.materials[self.surface.materials[vertex as usize] as usize].as_ref();
            material.map_or(0.0, &conductance)
        };
        let conductors = weights.pairs.iter().filter_map(|(pair, weight)| {
            let [[a, vertex], [b, _]] = pair.map(|at| place[at as usize]);
            let joined = a != NO_NODE && b != NO_NODE;
            joined.then(|| LinearConductor { nodes: [a, b], conductance: weight * of_vertex(vertex) })
        });
        let count = conductors.clone().count();
        self.network.linear.reserve_exact(count);
        self.network.linear.extend(conductors);
    }

    fn outer_layer(
        &mut self,
        place: &[u32],
        areas: &[f64],
        load_areas: &[f64],
        conducting: usize,
        weights: &Weights,
    ) -> Layer {
        let mut node = vec![NO_NODE; place.len()];
        // For each place its node and one of its vertices.
        let mut of_place = vec![[NO_NODE; 2]; areas.len()];
        for vertex in 0..place.len() {
            let here = place[vertex];
            let Some(material) = self.materials[self.surface.materials[vertex] as usize] else { continue };
            if here == NO_NODE {
                continue;
            }
            let here = here as usize;
            if material.outer.conductance > 0.0 || here >= conducting {
                if of_place[here][0] == NO_NODE {
                    of_place[here] = [self.push(&material.outer, areas[here], material.emissivity), vertex as u32];
                }
                node[vertex] = of_place[here][0];
            } else if load_areas[vertex] > 0.0 {
                node[vertex] = self.push(&material.outer, load_areas[vertex], material.emissivity);
            }
        }
        // A vertex whose triangles have no area shows the node of another vertex at its place.
        let mut shown = vec![NO_NODE; areas.len()];
        for (node, here) in node.iter().zip(place).filter(|(node, _)| **node != NO_NODE) {
            shown[*here as usize] = *node;
        }
        for (node, here) in node.iter_mut().zip(place).filter(|(_, here)| **here != NO_NODE) {
            if *node == NO_NODE {
                *node = shown[*here as usize];
            }
        }
        drop(shown);
        self.conduct(weights, &of_place[..conducting], |material| material.outer.conductance);
        Layer { node }
    }

    /// Adds the nodes of the structure, and their exchange with the visible nodes.
    fn structures(
        &mut self,
        place: &[u32],
        areas: &[f64],
        load_areas: &[f64],
        outer: &Layer,
        (conducting, weights): (usize, &Weights),
    ) -> Layer {
        let mut node = outer.node.clone();
        if !self.materials.iter().flatten().any(|material| material.over.is_some()) {
            return Layer { node };
        }
        let mut of_place = vec![[NO_NODE; 2]; areas.len()];
        let mut exchanges = Vec::new();
        for vertex in 0..place.len() {
            let Some(material) = self.materials[self.surface.materials[vertex] as usize] else { continue };
            let Some((below, emittance)) = material.over else { continue };
            if place[vertex] == NO_NODE {
                continue;
            }
            let here = place[vertex] as usize;
            if of_place[here][0] == NO_NODE {
                of_place[here] = [self.push(&below, areas[here], 0.0), vertex as u32];
            }
            node[vertex] = of_place[here][0];
            exchanges.push(([outer.node[vertex], node[vertex]], emittance * load_areas[vertex]));
        }
        let exchanges = summed(exchanges).into_iter().filter(|(_, area)| *area > 0.0);
        self.network
            .radiative
            .extend(exchanges.map(|(nodes, exchange_area)| RadiativeConductor { nodes, exchange_area }));
        let below = |material: &ShellMaterial| material.over.map_or(0.0, |(below, _)| below.conductance);
        self.conduct(weights, &of_place[..conducting], below);
        Layer { node }
    }
}

/// Moves vertices whose place has no area to the place of the nearest corner with area, because a node without area could not balance. Without such a
/// corner they get a place of their material, or no place. Returns the new place of every place.
fn adopt_bare_places(surface: &ShellSurface, place: &mut [u32], areas: &[f64]) -> Vec<u32> {
    let mut renamed: Vec<u32> = (0..areas.len() as u32).collect();
    let bare = |place: u32| place != NO_NODE && areas[place as usize] <= 0.0;
    if !place.iter().any(|place| bare(*place)) {
        return renamed;
    }
    let mut nearest: Vec<(f64, u32)> = vec![(f64::INFINITY, NO_NODE); areas.len()];
    for triangle in surface.triangles.iter().filter(|triangle| place[triangle[0] as usize] != NO_NODE) {
        for vertex in triangle.iter().filter(|vertex| bare(place[**vertex as usize])) {
            for other in triangle.iter().filter(|other| !bare(place[**other as usize])) {
                let [here, there] = [*vertex, *other].map(|vertex| surface.positions[vertex as usize]);
                let candidate = (here.distance(there), place[*other as usize]);
                let best = &mut nearest[place[*vertex as usize] as usize];
                if candidate.0 < best.0 {
                    *best = candidate;
                }
            }
        }
    }
    let mut of_material = std::collections::HashMap::new();
    for (vertex, place) in place.iter().enumerate().filter(|(_, place)| **place != NO_NODE && !bare(**place)) {
        of_material.entry((surface.parts[vertex], surface.materials[vertex])).or_insert(*place);
    }
    for vertex in 0..place.len() {
        if bare(place[vertex]) {
            let node = nearest[place[vertex] as usize].1;
            let key = (surface.parts[vertex], surface.materials[vertex]);
            let node = if node == NO_NODE { of_material.get(&key).copied().unwrap_or(NO_NODE) } else { node };
            renamed[place[vertex] as usize] = node;
            place[vertex] = node;
        }
    }
    renamed
}
