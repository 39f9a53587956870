//! Tables of radiation between surfaces in the layout of the device, and its passes.

use ash::vk::AccessFlags2 as A;
use ash::vk::PipelineStageFlags2 as S;

use super::exchange_variant::ExchangeVariant;
use super::frame::Frame;
use super::layout::ExchangePatch;
use super::nodes::GROUP;
use super::pass::{
    Access, COMPUTE_READ, COMPUTE_UNIFORM, COMPUTE_WRITE, Entry, Kernel, Pass, Said, Scope, Work, access, barrier,
    scope,
};
use super::resource::Resource;
use super::resource_row::Count;
use super::variant::ThermalVariant;
use crate::exchange::patches::NONE;
use crate::exchange::step::Exchange;

/// Patches of a workgroup.
const WORKGROUP: u32 = 64;

/// Patches of a joint: the joint, the first and the one after the last.
pub type PatchRun = (u32, u32, u32);

/// Tables of a craft. A patch more than it has stands for faces without a patch, which see nothing of the craft.
#[derive(Debug, Clone, Default)]
pub struct ExchangeTables {
    /// Patches of the fronts of four nodes, then of their backs.
    pub nodes: Vec<[u32; 8]>,
    /// The patches.
    pub patches: Vec<ExchangePatch>,
    /// Nodes of the patches, and the bits of their shares.
    pub members: Vec<[u32; 2]>,
    /// Four entries of a row: patches, and the bits of the exchange areas of infrared and of sunlight.
    pub entries: Vec<[[u32; 4]; 3]>,
    /// Rays that keep the sky.
    pub sky: Vec<u32>,
    /// Rays of each patch among them.
    pub sky_rays: u32,
    /// Patch at each place of the device. Within a joint the longest rows come first, so that neighbouring invocations have as much to do.
    pub order: Vec<u32>,
    /// Patches of each joint.
    pub runs: Vec<PatchRun>,
    /// Room for entries, of which a craft with joints may need more later.
    pub room: usize,
}

impl ExchangeTables {
    /// The tables of an exchange. With `moves` there is room for twice the entries.
    pub fn new(exchange: &Exchange, moves: bool) -> Self {
        let without = exchange.patches.len() as u32;
        let entries_of = |patch: usize| exchange.first[patch + 1] - exchange.first[patch];
        let mut order: Vec<u32> = (0..without).collect();
        order.sort_by_key(|patch| {
            let patch = *patch as usize;
            (exchange.patches[patch].joint, std::cmp::Reverse(entries_of(patch)))
        });
        let mut places = vec![0u32; order.len()];
        (0..).zip(&order).for_each(|(place, patch)| places[*patch as usize] = place);
        let patch_of = |patch: u32| if patch == NONE { without } else { places[patch as usize] };
        let nodes = exchange.of_node.chunks(GROUP).map(|group| {
            std::array::from_fn(|k| group.get(k % GROUP).map_or(without, |faces| patch_of(faces[k / GROUP])))
        });
        let (mut patches, mut entries, mut runs) = (Vec::new(), Vec::new(), Vec::<PatchRun>::new());
        for (place, number) in (0..).zip(order.iter().map(|patch| *patch as usize)) {
            let patch = &exchange.patches[number];
            let first_entry = entries.len() as u32;
            let row = &exchange.entries[exchange.first[number] as usize..exchange.first[number + 1] as usize];
            entries.extend(row.chunks(4).map(|four| {
                let of = |k: usize| {
                    four.get(k).map_or((place, [0.0; 2]), |(patch, areas)| (places[*patch as usize], *areas))
                };
                let areas = |kind: usize| std::array::from_fn(|k| (of(k).1[kind] as f32).to_bits());
                [std::array::from_fn(|k| of(k).0), areas(0), areas(1)]
            }));
            patches.push(ExchangePatch {
                normal: patch.normal.as_vec3().to_array(),
                emissivity: patch.optics.emissivity as f32,
                absorptivity: patch.optics.absorptivity as f32,
                per_area: (1.0 / patch.area) as f32,
                first_node: patch.nodes.start as u32,
                end_node: patch.nodes.end as u32,
                first_entry,
                end_entry: entries.len() as u32,
                unused: [0; 2],
            });
            let end = place + 1;
            match runs.last_mut() {
                Some(run) if run.0 == patch.joint => run.2 = end,
                _ => runs.push((patch.joint, end - 1, end)),
            }
        }
        Self {
            nodes: nodes.collect(),
            patches,
            members: exchange.nodes.iter().map(|(node, share)| [*node, (*share as f32).to_bits()]).collect(),
            room: if moves { 2 * entries.len() } else { entries.len() },
            entries,
            sky: order.iter().flat_map(|patch| exchange.sky_of(*patch as usize)).copied().collect(),
            sky_rays: exchange.sky_rays() as u32,
            order,
            runs,
        }
    }

    /// Number of elements for a `count`; 0 for those of others.
    pub fn count(&self, count: Count) -> usize {
        match count {
            Count::ExchangeGroups => self.nodes.len(),
            Count::ExchangePatches => self.patches.len() + 1,
            Count::ExchangeMembers => self.members.len(),
            Count::ExchangeEntries => self.room,
            Count::ExchangeSky => self.sky.len(),
            _ => 0,
        }
    }
}

/// Access to a whole resource through a binding.
fn bound(binding: u32, resource: Resource, joint: u32, scope: Scope) -> Access {
    let slice = if resource.row().per_joint { joint } else { 0 };
    Access { binding: Some(binding), slice, ..access(resource, scope) }
}

fn pass(variant: ExchangeVariant, first: u32, end: u32, accesses: Vec<Access>) -> Pass {
    let work = Work::Dispatch {
        kernel: Kernel::Exchange(variant),
        workgroups: (end - first).div_ceil(WORKGROUP),
        set: first,
        said: Said::Patches { first, end },
    };
    Pass { name: variant.shader().name(), work, accesses }
}

fn sky_pass((joint, first, end): PatchRun) -> Pass {
    let accesses = vec![
        bound(0, Resource::Step, joint, COMPUTE_UNIFORM),
        bound(1, Resource::ExchangeSky, joint, COMPUTE_READ),
        bound(2, Resource::ExchangeSeen, joint, COMPUTE_WRITE),
    ];
    pass(ExchangeVariant::Sky, first, end, accesses)
}

fn send_pass(light: ThermalVariant, (joint, first, end): PatchRun) -> Pass {
    let variant = ExchangeVariant::sent_under(light);
    let mut accesses = vec![
        bound(0, Resource::Step, joint, COMPUTE_UNIFORM),
        bound(3, Resource::ExchangePatches, joint, COMPUTE_READ),
        bound(4, Resource::ExchangeMembers, joint, COMPUTE_READ),
        bound(5, Resource::Temperature, joint, COMPUTE_READ),
        bound(8, Resource::ExchangeSent, joint, COMPUTE_WRITE),
    ];
    let mut when = |has: bool, binding: u32, resource: Resource, scope: Scope| {
        accesses.extend(has.then(|| bound(binding, resource, joint, scope)));
    };
    when(light.sun, 1, Resource::SunSamples, COMPUTE_UNIFORM);
    when(light.albedo, 2, Resource::AlbedoValues, COMPUTE_READ);
    when(light.sun && light.shadow, 6, Resource::Visibility, COMPUTE_READ);
    when(light.planet_ir || light.albedo, 7, Resource::ExchangeSeen, COMPUTE_READ);
    pass(variant, first, end, accesses)
}

fn receive_pass(sun: bool, patches: u32) -> Pass {
    let accesses = vec![
        bound(0, Resource::ExchangePatches, 0, COMPUTE_READ),
        bound(1, Resource::ExchangeEntries, 0, COMPUTE_READ),
        bound(2, Resource::ExchangeSent, 0, COMPUTE_READ),
        bound(3, Resource::ExchangeReceived, 0, COMPUTE_WRITE),
    ];
    pass(ExchangeVariant::Receive { sun }, 0, patches, accesses)
}

/// Passes that write parts of one buffer. The check of hazards sees the whole buffer, so a barrier stands between them. Only a craft with joints has several.
fn one_by_one(passes: impl Iterator<Item = Pass>, written: Resource) -> Vec<Entry> {
    let mut entries = Vec::new();
    for pass in passes {
        if !entries.is_empty() {
            entries.push(Entry::Barriers(vec![barrier(written, COMPUTE_WRITE, COMPUTE_WRITE)]));
        }
        entries.push(Entry::Pass(pass));
    }
    entries
}

/// The passes before the thermal step, under the light of its variants. With `sky` the shares of the planet's light are found anew.
pub fn exchange(runs: &[PatchRun], light: ThermalVariant, sky: bool) -> Frame {
    let mut entries = Vec::new();
    // The last frame may still read what it received.
    let read = scope(S::COMPUTE_SHADER, A::SHADER_STORAGE_WRITE);
    if sky {
        entries.push(Entry::Barriers(vec![barrier(Resource::ExchangeSeen, read, COMPUTE_WRITE)]));
        entries.extend(one_by_one(runs.iter().map(|run| sky_pass(*run)), Resource::ExchangeSeen));
        entries.push(Entry::Barriers(vec![barrier(Resource::ExchangeSeen, COMPUTE_WRITE, COMPUTE_READ)]));
    }
    entries.push(Entry::Barriers(vec![
        barrier(Resource::Temperature, COMPUTE_WRITE, COMPUTE_READ),
        barrier(Resource::ExchangeSent, read, COMPUTE_WRITE),
    ]));
    entries.extend(one_by_one(runs.iter().map(|run| send_pass(light, *run)), Resource::ExchangeSent));
    entries.push(Entry::Barriers(vec![
        barrier(Resource::ExchangeSent, COMPUTE_WRITE, COMPUTE_READ),
        barrier(Resource::ExchangeReceived, read, COMPUTE_WRITE),
    ]));
    let patches = runs.last().map_or(0, |run| run.2);
    entries.push(Entry::Pass(receive_pass(light.sun, patches)));
    entries.push(Entry::Barriers(vec![barrier(Resource::ExchangeReceived, COMPUTE_WRITE, COMPUTE_READ)]));
    Frame { entries }
}
