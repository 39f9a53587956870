//! Proves on the CPU that every dependency between the passes of consecutive frames has its barrier.
//!
//! The rules are those of the Vulkan specification, chapter "Synchronization and Cache Control": a read after a write
//! and a write after a write need the write made available and visible; a write after a read needs execution order.

use std::collections::BTreeMap;
use std::fmt;

use ash::vk::{AccessFlags2, ImageLayout, PipelineStageFlags2};

use isotherm::gpu::frame::Frame;
use isotherm::gpu::pass::{Access, Barrier, Entry, Scope, is_write, writes};
use isotherm::gpu::resource::{Resource, Role};

/// What may go wrong between two accesses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HazardKind {
    /// The value read may not be the one written.
    ReadAfterWrite,
    /// The value may change under the reader.
    WriteAfterRead,
    /// Either write may win.
    WriteAfterWrite,
    /// The image is not in the layout that the pass works with.
    Layout,
}

/// Two accesses without the barrier that they need.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Hazard {
    /// What may go wrong.
    pub kind: HazardKind,
    /// On what.
    pub resource: Resource,
    /// The earlier pass; the host or nothing for a layout.
    pub earlier: String,
    /// The later pass.
    pub later: String,
}

impl fmt::Display for Hazard {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "{:?} on {:?}: '{}' then '{}'", self.kind, self.resource, self.earlier, self.later)
    }
}

/// An access that a later one may collide with.
struct Past {
    pass: String,
    access: Access,
    /// Stages that come after it, by barriers so far.
    ordered_before: PipelineStageFlags2,
    /// Stages and accesses that see what it wrote.
    visible_to: Vec<(PipelineStageFlags2, AccessFlags2)>,
    /// Whether a barrier has made its write available.
    available: bool,
}

/// All hazards within and between frames that follow each other on one queue. Per-slot resources alternate between two
/// slots, whose reuse the host orders with a fence.
pub fn hazards<'a>(frames: impl IntoIterator<Item = &'a Frame>) -> Vec<Hazard> {
    let mut found = Vec::new();
    let mut past: BTreeMap<(Resource, usize), Vec<Past>> = BTreeMap::new();
    let mut layouts: BTreeMap<Resource, ImageLayout> = BTreeMap::new();
    for (number, frame) in frames.into_iter().enumerate() {
        let key = |resource: Resource| (resource, if resource.row().per_slot { number % 2 } else { 0 });
        for entry in &frame.entries {
            match entry {
                Entry::Barriers(barriers) => {
                    for barrier in barriers {
                        apply(barrier, past.entry(key(barrier.resource)).or_default(), &mut layouts, &mut found);
                    }
                }
                Entry::Pass(pass) => {
                    for access in &pass.accesses {
                        if access.resource.row().role.is_image()
                            && layouts.get(&access.resource) != Some(&access.layout)
                        {
                            found.push(Hazard {
                                kind: HazardKind::Layout,
                                resource: access.resource,
                                earlier: String::new(),
                                later: pass.name.clone(),
                            });
                        }
                        for earlier in past.entry(key(access.resource)).or_default().iter() {
                            if let Some(kind) = collision(earlier, access) {
                                found.push(Hazard {
                                    kind,
                                    resource: access.resource,
                                    earlier: earlier.pass.clone(),
                                    later: pass.name.clone(),
                                });
                            }
                        }
                    }
                    for access in &pass.accesses {
                        past.entry(key(access.resource)).or_default().push(Past {
                            pass: pass.name.clone(),
                            access: *access,
                            ordered_before: PipelineStageFlags2::NONE,
                            visible_to: Vec::new(),
                            available: false,
                        });
                    }
                }
            }
        }
    }
    found
}

/// A scope with all stages and kinds of access by name.
fn spelled(scope: Scope) -> Scope {
    let whole = |part: bool| if part { u64::MAX } else { 0 };
    let mut access = scope.access;
    if access.contains(AccessFlags2::MEMORY_READ) {
        access |= !writes(AccessFlags2::from_raw(u64::MAX)) & !AccessFlags2::HOST_READ;
    }
    if access.contains(AccessFlags2::MEMORY_WRITE) {
        access |= writes(AccessFlags2::from_raw(u64::MAX)) & !AccessFlags2::HOST_WRITE;
    }
    let commands = PipelineStageFlags2::from_raw(whole(scope.stage.contains(PipelineStageFlags2::ALL_COMMANDS)));
    Scope { stage: scope.stage | commands & !PipelineStageFlags2::HOST, access }
}

fn apply(
    barrier: &Barrier,
    past: &mut Vec<Past>,
    layouts: &mut BTreeMap<Resource, ImageLayout>,
    found: &mut Vec<Hazard>,
) {
    for earlier in past.iter_mut() {
        let (before, after) = (spelled(barrier.before), spelled(barrier.after));
        let direct = before.stage.intersects(earlier.access.scope.stage);
        let chained = before.stage.intersects(earlier.ordered_before);
        if !direct && !chained {
            continue;
        }
        earlier.ordered_before |= after.stage;
        earlier.available |= direct && before.access.contains(writes(earlier.access.scope.access));
        if earlier.available {
            earlier.visible_to.push((after.stage, after.access));
        }
    }
    let Some((old, new)) = barrier.layouts else { return };
    let layout = layouts.entry(barrier.resource).or_insert(ImageLayout::UNDEFINED);
    if old != ImageLayout::UNDEFINED && old != *layout {
        found.push(Hazard {
            kind: HazardKind::Layout,
            resource: barrier.resource,
            earlier: String::new(),
            later: "barrier".to_owned(),
        });
    }
    *layout = new;
    // A change of layout writes the image: whatever came before must be ordered before the barrier.
    for earlier in past.iter() {
        let ordered = barrier.before.stage.intersects(earlier.access.scope.stage | earlier.ordered_before);
        let unavailable = is_write(earlier.access.scope.access) && !earlier.available;
        if !ordered || unavailable {
            found.push(Hazard {
                kind: if unavailable { HazardKind::WriteAfterWrite } else { HazardKind::WriteAfterRead },
                resource: barrier.resource,
                earlier: earlier.pass.clone(),
                later: "change of layout".to_owned(),
            });
        }
    }
    // From here on the change of layout is the last write.
    past.clear();
    past.push(Past {
        pass: "change of layout".to_owned(),
        access: Access {
            resource: barrier.resource,
            scope: Scope { stage: barrier.before.stage, access: AccessFlags2::MEMORY_WRITE },
            groups: None,
            slice: 0,
            binding: None,
            layout: new,
        },
        ordered_before: barrier.after.stage,
        visible_to: vec![(barrier.after.stage, barrier.after.access)],
        available: true,
    });
}

fn collision(earlier: &Past, later: &Access) -> Option<HazardKind> {
    if let (Some((start, end)), Some((later_start, later_end))) = (earlier.access.groups, later.groups)
        && (end <= later_start || later_end <= start)
    {
        return None;
    }
    let (wrote, writes) = (is_write(earlier.access.scope.access), is_write(later.scope.access));
    let ordered = earlier.ordered_before.contains(later.scope.stage);
    let visible = earlier
        .visible_to
        .iter()
        .any(|(stage, access)| stage.contains(later.scope.stage) && access.contains(later.scope.access));
    match (wrote, writes) {
        (true, false) if !visible => Some(HazardKind::ReadAfterWrite),
        (true, true) if !visible => Some(HazardKind::WriteAfterWrite),
        (false, true) if !ordered => Some(HazardKind::WriteAfterRead),
        _ => None,
    }
}

/// Resources that the host reads after some lists without a barrier that makes the device's last write visible to it.
pub fn unread_by_host<'a>(frames: impl IntoIterator<Item = &'a Frame>) -> Vec<Resource> {
    let mut waiting: Vec<Resource> = Vec::new();
    for entry in frames.into_iter().flat_map(|frame| &frame.entries) {
        match entry {
            Entry::Pass(pass) => {
                let written = pass.accesses.iter().filter(|access| is_write(access.scope.access));
                let of_host = |resource: &Resource| matches!(resource.row().role, Role::Readback | Role::ToHost);
                waiting.extend(written.map(|access| access.resource).filter(of_host));
            }
            Entry::Barriers(barriers) => {
                let shows = |resource: Resource| {
                    let of = barriers.iter().filter(move |barrier| barrier.resource == resource);
                    of.into_iter().any(|barrier| barrier.after.access.contains(AccessFlags2::HOST_READ))
                };
                waiting.retain(|resource| !shows(*resource));
            }
        }
    }
    waiting
}

/// Number of barriers of a list.
pub fn barrier_count(frame: &Frame) -> usize {
    frame.entries.iter().map(|entry| if let Entry::Barriers(barriers) = entry { barriers.len() } else { 0 }).sum()
}

/// The same list without its n-th barrier: what the hazard check and the validation layer must complain about.
pub fn without_barrier(frame: &Frame, n: usize) -> Frame {
    let mut left = n;
    let mut frame = frame.clone();
    for entry in &mut frame.entries {
        if let Entry::Barriers(barriers) = entry {
            if left < barriers.len() {
                barriers.remove(left);
                break;
            }
            left -= barriers.len();
        }
    }
    frame
}
