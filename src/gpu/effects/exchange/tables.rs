//! Tables of radiation between surfaces in the layout of the device.

use crate::exchange::patches::NONE;
use crate::exchange::reflected::Areas;
use crate::exchange::sparse::Sparse;
use crate::exchange::step::Exchange;
use crate::exchange::words::pieces;
use crate::gpu::layout::ExchangePatch;
use crate::model::nodes::GROUP;

/// Room for the entries of a craft with joints, over those of its first pose: rows between two poses have the entries of both.
const ROOM: usize = 4;

/// Tables of a craft. A patch more than it has stands for faces without a patch, which see nothing of the craft.
#[derive(Debug, Clone, Default)]
pub struct ExchangeTables {
    /// Patches of the fronts of four nodes, then of their backs.
    pub(crate) nodes: Vec<[u32; 8]>,
    /// The patches.
    pub(crate) patches: Vec<ExchangePatch>,
    /// Nodes of the patches, and the bits of their shares.
    pub(crate) members: Vec<[u32; 2]>,
    /// Four entries of a row: the upper half of an exchange area [m2] as f32, and below it a patch. First all rows of infrared, then all rows of sunlight.
    pub(crate) entries: Vec<[u32; 4]>,
    /// Bundles of rays that keep the sky, in fours for each patch.
    pub(crate) sky: Vec<[u32; 4]>,
    /// Bundles of each patch among them.
    pub(crate) bundles: u32,
    /// Patch at each place of the device. The longest rows come first, so that neighbouring invocations have as much to do.
    pub(crate) order: Vec<u32>,
    /// Joints, the body too.
    pub(crate) joints: usize,
    /// Share of space in the view of each patch.
    pub(crate) open: Vec<f32>,
    /// Share of all light that meets inner faces, and number and area [m2] of the patches inside other parts.
    pub(crate) inside: (f64, (usize, f64)),
    /// Share of the rays of each patch that met an inner face.
    pub(crate) inner: Vec<f32>,
    /// Room for entries, of which a craft with joints may need more later.
    pub(crate) room: usize,
}

impl ExchangeTables {
    /// The tables of an exchange. With `moves` there is room for more entries.
    pub fn new(exchange: &Exchange, moves: bool) -> Self {
        let mut order: Vec<u32> = (0..exchange.patches.len() as u32).collect();
        order.sort_by_key(|patch| std::cmp::Reverse(exchange.infrared.between.row(*patch as usize).len()));
        let tables = Self::in_order(exchange, &order);
        // No row has more entries than there are patches, in infrared or in sunlight.
        let most = 2 * order.len() * order.len().div_ceil(4);
        let room = if moves { (ROOM * tables.entries.len()).min(most) } else { tables.entries.len() };
        Self { room, ..tables }
    }

    /// The tables of an exchange with the patches in the order of earlier tables. Results at the places of the device go on to hold.
    pub(crate) fn in_order(exchange: &Exchange, order: &[u32]) -> Self {
        let without = exchange.patches.len() as u32;
        let order = order.to_vec();
        let mut places = vec![0u32; order.len()];
        (0..).zip(&order).for_each(|(place, patch)| places[*patch as usize] = place);
        let patch_of = |patch: u32| if patch == NONE { without } else { places[patch as usize] };
        let nodes = exchange.of_node.chunks(GROUP).map(|group| {
            std::array::from_fn(|k| group.get(k % GROUP).map_or(without, |faces| patch_of(faces[k / GROUP])))
        });
        let mut entries = Vec::new();
        let mut rows = |of: &Sparse| -> Vec<[u32; 2]> {
            let row = |(place, number): (u32, &u32)| {
                let first = entries.len() as u32;
                push_row(&mut entries, of.row(*number as usize), *number, place, &places);
                [first, entries.len() as u32]
            };
            (0..).zip(&order).map(row).collect()
        };
        let [infrared, reflected] = [&exchange.infrared, &exchange.sunlight].map(|areas| rows(&areas.between));
        // A craft whose surfaces do not see each other has a buffer all the same. No row has this entry.
        if entries.is_empty() {
            entries.push([0; 4]);
        }
        let patches = order.iter().zip(infrared.iter().zip(&reflected)).map(|(number, (entries, reflected))| {
            let patch = &exchange.patches[*number as usize];
            let itself = |areas: &Areas| areas.between.at(*number as usize, *number) as f32;
            ExchangePatch {
                normal: patch.normal.as_vec3().to_array(),
                emissivity: patch.optics.emissivity as f32,
                absorptivity: patch.optics.absorptivity as f32,
                per_area: (1.0 / patch.area) as f32,
                first_node: patch.nodes.start as u32,
                end_node: patch.nodes.end as u32,
                first_entry: entries[0],
                end_entry: entries[1],
                first_reflected: reflected[0],
                end_reflected: reflected[1],
                itself: itself(&exchange.infrared),
                itself_reflected: itself(&exchange.sunlight),
                joint: patch.joint,
                specular: patch.gloss.specular as f32,
                exposed: exchange.exposed(*number as usize) as f32,
                back: u32::from(patch.back),
                cooling: patch.cooling.min(f64::from(f32::MAX)) as f32,
                unused: 0.0,
            }
        });
        let patches: Vec<ExchangePatch> = patches.collect();
        Self {
            nodes: nodes.collect(),
            patches,
            members: exchange.nodes.iter().map(|(node, share)| [*node, (*share as f32).to_bits()]).collect(),
            room: entries.len(),
            entries,
            sky: order.iter().flat_map(|patch| exchange.sky_of(*patch as usize).chunks(4)).map(four).collect(),
            bundles: exchange.bundles() as u32,
            order,
            open: (0..exchange.patches.len()).map(|patch| exchange.factors.to_space(patch) as f32).collect(),
            inside: (exchange.factors.inside_share(), exchange.factors.buried()),
            inner: exchange.factors.inside.iter().map(|share| *share as f32).collect(),
            joints: exchange.patches.iter().map(|patch| patch.joint as usize + 1).max().unwrap_or(1),
        }
    }

    /// Infrared that nodes absorb from each other [W/m2], if each emits like a black body of this flux [W/m2]. Computed by the host.
    pub fn exchanged_infrared(&self, black: &[f64]) -> Vec<f64> {
        let members = |patch: &ExchangePatch| &self.members[patch.first_node as usize..patch.end_node as usize];
        let share = |[node, share]: &[u32; 2]| black[*node as usize] * f64::from(f32::from_bits(*share));
        let sent = |patch: &ExchangePatch| f64::from(patch.emissivity) * members(patch).iter().map(share).sum::<f64>();
        let sent: Vec<f64> = self.patches.iter().map(sent).collect();
        let area = |word: &u32| f64::from(f32::from_bits(word & 0xffff_0000)) * sent[(word & 0xffff) as usize];
        let absorbed = |(own, patch): (&f64, &ExchangePatch)| {
            let entries = self.entries[patch.first_entry as usize..patch.end_entry as usize].iter().flatten();
            let arrives = entries.map(area).sum::<f64>() + f64::from(patch.itself) * own;
            f64::from(patch.emissivity * patch.per_area) * arrives
        };
        let absorbed: Vec<f64> = sent.iter().zip(&self.patches).map(absorbed).collect();
        let of_face = |patch: u32| absorbed.get(patch as usize).copied().unwrap_or_default();
        let of_group =
            |faces: &[u32; 8]| std::array::from_fn::<f64, GROUP, _>(|k| of_face(faces[k]) + of_face(faces[k + GROUP]));
        self.nodes.iter().flat_map(of_group).collect()
    }
}

/// Adds the entries of a row but the diagonal, in fours. What is missing in the last four has no area.
fn push_row(entries: &mut Vec<[u32; 4]>, row: &[(u32, f64)], own: u32, place: u32, places: &[u32]) {
    let others = row.iter().filter(|(column, _)| *column != own);
    let words =
        others.flat_map(|(column, area)| pieces(*area).into_iter().map(|half| half << 16 | places[*column as usize]));
    let words: Vec<u32> = words.collect();
    entries.extend(words.chunks(4).map(|four| std::array::from_fn(|k| four.get(k).copied().unwrap_or(place))));
}

/// Four words. The last ones may be missing.
fn four(words: &[u32]) -> [u32; 4] {
    std::array::from_fn(|k| words.get(k).copied().unwrap_or_default())
}
