//! Tables of radiation between surfaces in the layout of the device, and its passes.

use ash::vk::AccessFlags2 as A;
use ash::vk::PipelineStageFlags2 as S;

use super::exchange_variant::ExchangeVariant;
use super::frame::Frame;
use super::layout::ExchangePatch;
use super::pass::{
    Access, COMPUTE_READ, COMPUTE_UNIFORM, COMPUTE_WRITE, Entry, Kernel, Pass, Said, Scope, Work, access, barrier,
    scope,
};
use super::resource::Resource;
use super::resource_row::Count;
use super::variant::ThermalVariant;
use crate::exchange::patches::NONE;
use crate::exchange::reflected::Areas;
use crate::exchange::sparse::Sparse;
use crate::exchange::step::Exchange;
use crate::exchange::words::pieces;
use crate::model::nodes::GROUP;

/// Patches of a workgroup.
const WORKGROUP: u32 = 64;

/// Tables of a craft. A patch more than it has stands for faces without a patch, which see nothing of the craft.
#[derive(Debug, Clone, Default)]
pub struct ExchangeTables {
    /// Patches of the fronts of four nodes, then of their backs.
    pub nodes: Vec<[u32; 8]>,
    /// The patches.
    pub patches: Vec<ExchangePatch>,
    /// Nodes of the patches, and the bits of their shares.
    pub members: Vec<[u32; 2]>,
    /// Four entries of a row: the upper half of an exchange area [m2] as f32, and below it a patch. First all rows of infrared, then those of sunlight.
    pub entries: Vec<[u32; 4]>,
    /// Bundles of rays that keep the sky, in fours for each patch.
    pub sky: Vec<[u32; 4]>,
    /// Bundles of each patch among them.
    pub bundles: u32,
    /// Patch at each place of the device. The longest rows come first, so that neighbouring invocations have as much to do.
    pub order: Vec<u32>,
    /// Joints, the body too.
    pub joints: usize,
    /// Share of space in the view of each patch.
    pub open: Vec<f32>,
    /// Share of all light that meets inner faces, and number and area [m2] of the patches inside other parts.
    pub inside: (f64, (usize, f64)),
    /// Share of the rays of each patch that met an inner face.
    pub inner: Vec<f32>,
    /// Room for entries, of which a craft with joints may need more later.
    pub room: usize,
}

impl ExchangeTables {
    /// The tables of an exchange. With `moves` there is room for twice the entries.
    pub fn new(exchange: &Exchange, moves: bool) -> Self {
        let without = exchange.patches.len() as u32;
        let mut order: Vec<u32> = (0..without).collect();
        order.sort_by_key(|patch| std::cmp::Reverse(exchange.infrared.between.row(*patch as usize).len()));
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
                unused: [0.0; 3],
            }
        });
        let patches: Vec<ExchangePatch> = patches.collect();
        Self {
            nodes: nodes.collect(),
            patches,
            members: exchange.nodes.iter().map(|(node, share)| [*node, (*share as f32).to_bits()]).collect(),
            room: if moves { 2 * entries.len() } else { entries.len() },
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

    /// Number of elements for a `count`; 0 for those of others.
    pub fn count(&self, count: Count) -> usize {
        match count {
            Count::ExchangeGroups => self.nodes.len(),
            Count::ExchangePatches => self.patches.len() + 1,
            Count::ExchangeMembers => self.members.len(),
            Count::ExchangeEntries => self.room,
            Count::ExchangeJoints => self.joints,
            Count::ExchangeSky => self.sky.len(),
            _ => 0,
        }
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

/// Access to a whole resource through a binding.
fn bound(binding: u32, resource: Resource, scope: Scope) -> Access {
    Access { binding: Some(binding), ..access(resource, scope) }
}

fn pass(variant: ExchangeVariant, patches: u32, accesses: Vec<Access>) -> Entry {
    let work = Work::Dispatch {
        kernel: Kernel::Exchange(variant),
        workgroups: patches.div_ceil(WORKGROUP),
        set: 0,
        said: Said::Patches { first: 0, end: patches },
    };
    Entry::Pass(Pass { name: variant.shader().name(), work, accesses })
}

fn sky_pass(patches: u32) -> Entry {
    let accesses = vec![
        bound(0, Resource::Step, COMPUTE_UNIFORM),
        bound(1, Resource::ExchangeSky, COMPUTE_READ),
        bound(2, Resource::ExchangeSeen, COMPUTE_WRITE),
        bound(3, Resource::ExchangePatches, COMPUTE_READ),
        bound(4, Resource::ExchangePoses, COMPUTE_READ),
    ];
    pass(ExchangeVariant::Sky, patches, accesses)
}

fn light_pass(light: ThermalVariant, patches: u32, mirrors: bool) -> Entry {
    let mut accesses = vec![
        bound(0, Resource::Step, COMPUTE_UNIFORM),
        bound(3, Resource::ExchangePatches, COMPUTE_READ),
        bound(7, Resource::ExchangePoses, COMPUTE_READ),
        bound(8, Resource::ExchangeReflected, COMPUTE_WRITE),
    ];
    let mut when = |has: bool, binding: u32, resource: Resource, scope: Scope| {
        accesses.extend(has.then(|| bound(binding, resource, scope)));
    };
    when(light.sun, 1, Resource::SunSamples, COMPUTE_UNIFORM);
    when(light.albedo, 2, Resource::AlbedoValues, COMPUTE_READ);
    when(light.sun && light.shadow, 4, Resource::ExchangeMembers, COMPUTE_READ);
    when(light.sun && light.shadow, 5, Resource::Visibility, COMPUTE_READ);
    when(light.planet_ir || light.albedo, 6, Resource::ExchangeSeen, COMPUTE_READ);
    when(light.sun && mirrors, 9, Resource::ExchangeMirrored, COMPUTE_WRITE);
    pass(ExchangeVariant::light(light, mirrors), patches, accesses)
}

fn mirror_pass(patches: u32) -> Entry {
    let accesses = vec![
        bound(0, Resource::ExchangePatches, COMPUTE_READ),
        bound(1, Resource::ExchangeMirrors, COMPUTE_READ),
        bound(2, Resource::ExchangeMirrored, COMPUTE_READ),
        bound(3, Resource::ExchangeReflected, COMPUTE_READ),
        bound(3, Resource::ExchangeReflected, COMPUTE_WRITE),
        bound(4, Resource::ExchangeSunlight, COMPUTE_WRITE),
    ];
    pass(ExchangeVariant::Mirror, patches, accesses)
}

fn reflected_pass(patches: u32, mirrors: bool) -> Entry {
    let mut accesses = vec![
        bound(0, Resource::ExchangePatches, COMPUTE_READ),
        bound(1, Resource::ExchangeEntries, COMPUTE_READ),
        bound(2, Resource::ExchangeReflected, COMPUTE_READ),
        bound(3, Resource::ExchangeSunlight, COMPUTE_WRITE),
    ];
    accesses.extend(mirrors.then(|| bound(3, Resource::ExchangeSunlight, COMPUTE_READ)));
    pass(ExchangeVariant::Reflected { mirrors }, patches, accesses)
}

fn send_pass(planet_ir: bool, patches: u32) -> Entry {
    let mut accesses = vec![
        bound(0, Resource::Step, COMPUTE_UNIFORM),
        bound(1, Resource::ExchangePatches, COMPUTE_READ),
        bound(2, Resource::ExchangeMembers, COMPUTE_READ),
        bound(3, Resource::Temperature, COMPUTE_READ),
        bound(5, Resource::ExchangeSent, COMPUTE_WRITE),
    ];
    accesses.extend(planet_ir.then(|| bound(4, Resource::ExchangeReflected, COMPUTE_READ)));
    pass(ExchangeVariant::Send { planet_ir }, patches, accesses)
}

fn receive_pass(sun: bool, patches: u32) -> Entry {
    let mut accesses = vec![
        bound(0, Resource::ExchangePatches, COMPUTE_READ),
        bound(1, Resource::ExchangeEntries, COMPUTE_READ),
        bound(2, Resource::ExchangeSent, COMPUTE_READ),
        bound(3, Resource::ExchangeReceived, COMPUTE_WRITE),
    ];
    accesses.extend(sun.then(|| bound(4, Resource::ExchangeSunlight, COMPUTE_READ)));
    pass(ExchangeVariant::Receive { sun }, patches, accesses)
}

/// The passes before the thermal step, under the light of its variants. With `anew` the light of Sun and planet is found anew, with `mirrors` that of mirrors too.
pub fn exchange(patches: u32, light: ThermalVariant, anew: bool, mirrors: bool) -> Frame {
    let mut entries = Vec::new();
    let barriers = |between: &[(Resource, Scope, Scope)]| {
        Entry::Barriers(between.iter().map(|(resource, before, after)| barrier(*resource, *before, *after)).collect())
    };
    // The last frame may still read what it received.
    let read = scope(S::COMPUTE_SHADER, A::SHADER_STORAGE_WRITE);
    let found = (COMPUTE_WRITE, COMPUTE_READ);
    let changed = scope(S::COMPUTE_SHADER, A::SHADER_STORAGE_READ | A::SHADER_STORAGE_WRITE);
    let mirrors = mirrors && light.sun;
    let lit = light.sun || light.planet_ir;
    if anew && (light.planet_ir || light.albedo) {
        entries.push(barriers(&[(Resource::ExchangeSeen, read, COMPUTE_WRITE)]));
        entries.push(sky_pass(patches));
        entries.push(barriers(&[(Resource::ExchangeSeen, found.0, found.1)]));
    }
    if anew && lit {
        let mut before = vec![(Resource::ExchangeReflected, read, COMPUTE_WRITE)];
        before.extend(mirrors.then_some((Resource::ExchangeMirrored, read, COMPUTE_WRITE)));
        entries.push(barriers(&before));
        entries.push(light_pass(light, patches, mirrors));
        if mirrors {
            entries.push(barriers(&[
                (Resource::ExchangeReflected, COMPUTE_WRITE, changed),
                (Resource::ExchangeMirrored, found.0, found.1),
                (Resource::ExchangeSunlight, read, COMPUTE_WRITE),
            ]));
            entries.push(mirror_pass(patches));
        }
        entries.push(barriers(&[(Resource::ExchangeReflected, found.0, found.1)]));
    }
    if anew && light.sun {
        entries.push(barriers(&[match mirrors {
            true => (Resource::ExchangeSunlight, COMPUTE_WRITE, changed),
            false => (Resource::ExchangeSunlight, read, COMPUTE_WRITE),
        }]));
        entries.push(reflected_pass(patches, mirrors));
        entries.push(barriers(&[(Resource::ExchangeSunlight, found.0, found.1)]));
    }
    entries.push(barriers(&[
        (Resource::Temperature, COMPUTE_WRITE, COMPUTE_READ),
        (Resource::ExchangeSent, read, COMPUTE_WRITE),
    ]));
    entries.push(send_pass(light.planet_ir, patches));
    entries.push(barriers(&[
        (Resource::ExchangeSent, found.0, found.1),
        (Resource::ExchangeReceived, read, COMPUTE_WRITE),
    ]));
    entries.push(receive_pass(light.sun, patches));
    entries.push(barriers(&[(Resource::ExchangeReceived, found.0, found.1)]));
    Frame { entries }
}
