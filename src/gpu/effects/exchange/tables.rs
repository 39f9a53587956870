//! Tables of radiation between surfaces in the layout of the device.

use rayon::prelude::*;

use crate::exchange::patches::NONE;
use crate::exchange::reflected::Areas;
use crate::exchange::slopes::NEIGHBOURS;
use crate::exchange::sparse::{Sparse, joined};
use crate::exchange::step::Exchange;
use crate::exchange::words::{MOST as WORDS, pieces};
use crate::gpu::layout::{ExchangePatch, ExchangeRow};
use crate::model::nodes::GROUP;

/// Rows that one thread lays out together.
const CHUNK: usize = 64;
/// Room for the entries of a finding of a craft with joints, over those of its first pose.
const ROOM: usize = 3;
/// Fours of entries of a finding for which there is room in any case: 8 MiB. Surfaces may not see each other in the first pose.
const LEAST_ROOM: usize = 1 << 19;

/// Tables of a craft. A patch more than it has stands for faces without a patch, which see nothing of the craft.
#[derive(Debug, Clone, Default)]
pub struct ExchangeTables {
    /// Patches of the fronts of four nodes, then of their backs.
    pub(crate) nodes: Vec<[u32; 8]>,
    /// The patches.
    pub(crate) patches: Vec<ExchangePatch>,
    /// Nodes of the patches, and the bits of their shares.
    pub(crate) members: Vec<[u32; 2]>,
    /// The bits of the way of each member from the centre of its patch [m], and its node.
    pub(crate) ways: Vec<[u32; 4]>,
    /// Neighbours of each place: a place, and the bits of the vector by which its difference in flux counts for the gradient [1/m].
    pub(crate) neighbours: Vec<[u32; 4]>,
    /// Bundles of rays that keep the sky of each patch.
    pub(crate) bundles: u32,
    /// Patch at each place of the device. The longest rows come first, so that neighbouring invocations have as much to do.
    pub(crate) order: Vec<u32>,
    /// Joints, the body too.
    pub(crate) joints: usize,
    /// Room for the fours of entries of a finding, of which a craft with joints may need more later.
    pub(crate) room: usize,
    /// Findings for which there is room: one for a craft without joints.
    pub(crate) slots: usize,
    /// Slots for the findings between which a craft with joints is. One without has the first alone.
    pub(crate) findings: [FindingTables; 2],
    /// Slot of the first finding of the pair.
    pub(crate) slot: usize,
    /// Share of the second one.
    pub(crate) share: f64,
}

/// Tables of a finding for poses of the joints.
#[derive(Debug, Clone, Default)]
pub(crate) struct FindingTables {
    /// Rows of the patches.
    pub(crate) rows: Vec<ExchangeRow>,
    /// Four entries of a row: the upper half of an exchange area [m2] as f32, and below it a patch. First all rows of infrared, then all rows of sunlight.
    pub(crate) entries: Vec<[u32; 4]>,
    /// Bundles of rays that keep the sky, in fours for each patch.
    pub(crate) sky: Vec<[u32; 4]>,
    /// Share of space in the view of each patch.
    pub(crate) open: Vec<f32>,
    /// Share of all light that meets inner faces, and number and area [m2] of the patches inside other parts.
    pub(crate) inside: (f64, (usize, f64)),
    /// Share of the rays of each patch that met an inner face.
    pub(crate) inner: Vec<f32>,
}

impl ExchangeTables {
    /// The tables of an exchange. With `moves` there is room for the findings of other poses.
    pub fn new(exchange: &Exchange, moves: bool) -> Self {
        let mut order: Vec<u32> = (0..exchange.patches.len() as u32).collect();
        order.sort_by_key(|patch| std::cmp::Reverse(exchange.infrared.between.row(*patch as usize).len()));
        let places = places_of(&order);
        let without = exchange.patches.len() as u32;
        let patch_of = |patch: u32| if patch == NONE { without } else { places[patch as usize] };
        let nodes = exchange.of_node.chunks(GROUP).map(|group| {
            std::array::from_fn(|k| group.get(k % GROUP).map_or(without, |faces| patch_of(faces[k / GROUP])))
        });
        let finding = FindingTables::new(exchange, &order, 0);
        // No row has more entries than there are patches, in infrared or in sunlight, and each has so many words at most.
        let most = 2 * order.len() * (WORDS * order.len()).div_ceil(4);
        let room = (ROOM * finding.entries.len()).max(LEAST_ROOM).min(most).max(finding.entries.len());
        Self {
            nodes: nodes.collect(),
            patches: order.iter().map(|number| patch_of_device(exchange, *number as usize)).collect(),
            members: exchange.nodes.iter().map(|(node, share)| [*node, (*share as f32).to_bits()]).collect(),
            ways: ways(exchange),
            neighbours: neighbours(exchange, &order, &places),
            bundles: exchange.bundles() as u32,
            joints: exchange.patches.iter().map(|patch| patch.joint as usize + 1).max().unwrap_or(1),
            room: if moves { room } else { finding.entries.len() },
            slots: if moves { 2 } else { 1 },
            findings: [finding, FindingTables::default()],
            order,
            slot: 0,
            share: 0.0,
        }
    }

    /// Takes the exchange of the same patches for other poses as one of both findings.
    pub(crate) fn renew(&mut self, slot: usize, exchange: &Exchange) {
        self.findings[slot] = FindingTables::new(exchange, &self.order, (slot * self.room) as u32);
    }

    /// Share of the second finding, and the slot of the first.
    pub(crate) fn share(&self) -> (f32, u32) {
        (self.share as f32, self.slot as u32)
    }

    /// Mean of a value of each patch in both findings.
    pub(crate) fn mean(&self, of: fn(&FindingTables) -> &Vec<f32>) -> Vec<f32> {
        let share = self.share as f32;
        match [self.slot, 1 - self.slot].map(|slot| of(&self.findings[slot])) {
            [first, _] if share == 0.0 => first.clone(),
            [_, second] if share == 1.0 => second.clone(),
            [first, second] => first.iter().zip(second).map(|(a, b)| a + share * (b - a)).collect(),
        }
    }
}

impl FindingTables {
    /// The tables of an exchange with the patches in this order. Its entries begin at `first` in the buffer of all.
    fn new(exchange: &Exchange, order: &[u32], first: u32) -> Self {
        let places = places_of(order);
        let (mut parts, mut start) = (Vec::<Vec<[u32; 4]>>::new(), first);
        let mut rows = |of: &Sparse| -> Vec<[u32; 2]> {
            let chunk = |(chunk, numbers): (usize, &[u32])| {
                let mut all = Vec::new();
                let ends = (chunk * CHUNK..).zip(numbers).map(|(place, number)| {
                    put_fours(of.row(*number as usize), *number, place as u32, &places, &mut all);
                    all.len() as u32
                });
                (ends.collect(), all)
            };
            let chunks: Vec<(Vec<u32>, Vec<[u32; 4]>)> = order.par_chunks(CHUNK).enumerate().map(chunk).collect();
            let mut rows = Vec::with_capacity(order.len());
            for (ends, chunk) in chunks {
                let mut first = start;
                for end in ends {
                    rows.push([first, start + end]);
                    first = start + end;
                }
                start = first;
                parts.push(chunk);
            }
            rows
        };
        let [infrared, sunlight] = [&exchange.infrared, &exchange.for_light.sunlight];
        let runs = [rows(&infrared.between), rows(&sunlight.between)];
        let mut entries = joined(&parts);
        // A craft whose surfaces do not see each other has a buffer all the same. No row has this entry.
        if entries.is_empty() {
            entries.push([0; 4]);
        }
        let row = |(place, number): (usize, &u32)| {
            let itself = |areas: &Areas| areas.between.at(*number as usize, *number) as f32;
            let [[first_entry, end_entry], [first_reflected, end_reflected]] = runs.each_ref().map(|runs| runs[place]);
            ExchangeRow {
                first_entry,
                end_entry,
                first_reflected,
                end_reflected,
                itself: itself(infrared),
                itself_reflected: itself(sunlight),
                exposed: exchange.exposed(*number as usize) as f32,
            }
        };
        Self {
            rows: order.iter().enumerate().map(row).collect(),
            entries,
            sky: sky_in_order(exchange, order),
            open: (0..exchange.patches.len()).map(|patch| exchange.factors.to_space(patch) as f32).collect(),
            inside: (exchange.factors.inside_share(), exchange.factors.buried()),
            inner: exchange.factors.inside.iter().map(|share| *share as f32).collect(),
        }
    }
}

fn patch_of_device(exchange: &Exchange, number: usize) -> ExchangePatch {
    let patch = &exchange.patches[number];
    ExchangePatch {
        normal: patch.normal.as_vec3().to_array(),
        emissivity: patch.optics.emissivity as f32,
        absorptivity: patch.optics.absorptivity as f32,
        per_area: (1.0 / patch.area) as f32,
        first_node: patch.nodes.start as u32,
        end_node: patch.nodes.end as u32,
        joint: patch.joint,
        specular: patch.gloss.specular as f32,
        back: u32::from(patch.back),
        cooling: patch.cooling.min(f64::from(f32::MAX)) as f32,
        radius: exchange.slopes.patches.get(number).map_or(0.0, |slope| slope.radius as f32),
        unused: [0.0; 3],
    }
}

/// The place of each patch in an order.
pub(crate) fn places_of(order: &[u32]) -> Vec<u32> {
    let mut places = vec![0u32; order.len()];
    (0..).zip(order).for_each(|(place, patch)| places[*patch as usize] = place);
    places
}

/// Adds the entries of a row but the diagonal, in fours. What is missing in the last four has no area.
fn put_fours(row: &[(u32, f64)], own: u32, place: u32, places: &[u32], fours: &mut Vec<[u32; 4]>) {
    let (mut four, mut count) = ([place; 4], 0);
    for (column, area) in row.iter().filter(|(column, _)| *column != own) {
        for half in pieces(*area) {
            four[count] = half << 16 | places[*column as usize];
            count += 1;
            if count == 4 {
                fours.push(four);
                (four, count) = ([place; 4], 0);
            }
        }
    }
    fours.extend((count > 0).then_some(four));
}

/// The bits of the ways of the nodes of patches from their centres [m], and the nodes. Ways are 0 where fluxes do not differ within patches.
fn ways(exchange: &Exchange) -> Vec<[u32; 4]> {
    let of = |(place, (node, _)): (usize, &(u32, f64))| {
        let [x, y, z] = exchange.slopes.ways.get(place).copied().unwrap_or_default().to_array().map(f32::to_bits);
        [x, y, z, *node]
    };
    exchange.nodes.iter().enumerate().map(of).collect()
}

/// Neighbours of the patches in an order. What is missing of the last ones is the patch itself.
fn neighbours(exchange: &Exchange, order: &[u32], places: &[u32]) -> Vec<[u32; 4]> {
    let of = |number: &u32| -> [[u32; 4]; NEIGHBOURS] {
        let known = exchange.slopes.patches.get(*number as usize).map_or(&[][..], |slope| &slope.neighbours);
        std::array::from_fn(|k| match known.get(k) {
            Some(other) => {
                let [x, y, z] = other.weight.to_array().map(f32::to_bits);
                [places[other.patch as usize], x, y, z]
            }
            None => [places[*number as usize], 0, 0, 0],
        })
    };
    order.iter().flat_map(of).collect()
}

/// Bundles of the patches in an order, in fours.
fn sky_in_order(exchange: &Exchange, order: &[u32]) -> Vec<[u32; 4]> {
    let fours = exchange.bundles().div_ceil(4);
    let mut sky = vec![[0; 4]; fours * order.len()];
    sky.par_chunks_mut(fours.max(1)).zip(order).for_each(|(sky, patch)| {
        let words = exchange.sky_of(*patch as usize).chunks(4).map(four);
        sky.iter_mut().zip(words).for_each(|(own, words)| *own = words);
    });
    sky
}

/// Four words. The last ones may be missing.
fn four(words: &[u32]) -> [u32; 4] {
    std::array::from_fn(|k| words.get(k).copied().unwrap_or_default())
}
