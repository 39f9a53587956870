//! Hazard check on the CPU: every dependency between passes of consecutive frames must have a barrier.
//!
//! The rules are in the Vulkan specification, chapter "Synchronization and Cache Control". A read or write after a
//! write needs a memory dependency. A write after a read needs an execution dependency.

use std::cell::RefCell;
use std::collections::{BTreeMap, HashMap};
use std::fmt;
use std::rc::Rc;

use ash::vk::{AccessFlags2, ImageLayout, PipelineStageFlags2};

use isotherm::internals::{Access, Barrier, Frame, ListEntry, Pass, PassWork, Resource, Role, Scope, is_write, writes};

/// Kind of a missing dependency.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HazardKind {
    /// The read may see the old value.
    ReadAfterWrite,
    /// The write may change the value during the read.
    WriteAfterRead,
    /// The order of the writes is undefined.
    WriteAfterWrite,
    /// The image is not in the layout that the pass needs.
    Layout,
}

/// Two accesses without the barrier between them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Hazard {
    /// Kind.
    pub kind: HazardKind,
    /// Resource of both accesses.
    pub resource: &'static Resource,
    /// Name of the earlier pass; the host or empty for a layout.
    pub earlier: String,
    /// Name of the later pass.
    pub later: String,
}

impl fmt::Display for Hazard {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "{:?} on {:?}: '{}' then '{}'", self.kind, self.resource, self.earlier, self.later)
    }
}

/// An earlier access that a later access may conflict with.
struct Past {
    pass: String,
    access: Access,
    /// Stages that wait for it because of the barriers so far.
    ordered_before: PipelineStageFlags2,
    /// Stages and accesses that its write is visible to.
    visible_to: Vec<(PipelineStageFlags2, AccessFlags2)>,
    /// Whether a barrier made its write available.
    available: bool,
}

/// Passes with their accesses.
type KnownAccesses = Vec<(Pass, Rc<Vec<Access>>)>;

thread_local! {
    /// Accesses of the passes so far, by the names of the passes.
    static KNOWN: RefCell<HashMap<String, KnownAccesses>> = RefCell::default();
}

/// Accesses of a pass, found once for all passes with the same shaders and buffers.
fn accesses(pass: &Pass) -> Rc<Vec<Access>> {
    let alike = |known: &Pass| match (&known.work, &pass.work) {
        (PassWork::Dispatch { shader: a, .. }, PassWork::Dispatch { shader: b, .. }) => a == b,
        (a, b) => a == b,
    };
    KNOWN.with_borrow_mut(|known| {
        if let Some(passes) = known.get(&pass.name)
            && let Some((_, accesses)) = passes.iter().find(|(one, _)| one.reach == pass.reach && alike(one))
        {
            return Rc::clone(accesses);
        }
        let accesses = Rc::new(pass.accesses().expect("shaders that compile"));
        known.entry(pass.name.clone()).or_default().push((pass.clone(), Rc::clone(&accesses)));
        accesses
    })
}

/// All hazards within and between frames that follow each other on one queue. Resources with one copy per slot
/// alternate between two slots, and a fence orders the reuse of a slot.
pub fn hazards<'a>(frames: impl IntoIterator<Item = &'a Frame>) -> Vec<Hazard> {
    let mut found = Vec::new();
    let mut past: BTreeMap<(&'static Resource, usize), Vec<Past>> = BTreeMap::new();
    let mut layouts: BTreeMap<&'static Resource, ImageLayout> = BTreeMap::new();
    for (number, frame) in frames.into_iter().enumerate() {
        let key = |resource: &'static Resource| (resource, if resource.per_slot { number % 2 } else { 0 });
        for entry in &frame.entries {
            match entry {
                ListEntry::Barriers(barriers) => {
                    for barrier in barriers {
                        apply(barrier, past.entry(key(barrier.resource)).or_default(), &mut layouts, &mut found);
                    }
                }
                ListEntry::Pass(pass) => {
                    let accesses = accesses(pass);
                    for access in accesses.iter() {
                        if access.resource.role.is_image() && layouts.get(&access.resource) != Some(&access.layout) {
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
                    for access in accesses.iter() {
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

/// Replaces the collective flags of a scope by the stages and accesses that they stand for.
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
    layouts: &mut BTreeMap<&'static Resource, ImageLayout>,
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
    // A layout change writes the image, so the barrier must come after every earlier access.
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
    // The layout change is the last write from here on.
    past.clear();
    past.push(Past {
        pass: "change of layout".to_owned(),
        access: Access {
            resource: barrier.resource,
            scope: Scope { stage: barrier.before.stage, access: AccessFlags2::MEMORY_WRITE },
            range: None,
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
    if let (Some((start, end)), Some((later_start, later_end))) = (earlier.access.range, later.range)
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

/// Resources that the host reads although no barrier makes the last write of the device visible to it.
pub fn unread_by_host<'a>(frames: impl IntoIterator<Item = &'a Frame>) -> Vec<&'static Resource> {
    let mut waiting: Vec<&'static Resource> = Vec::new();
    for entry in frames.into_iter().flat_map(|frame| &frame.entries) {
        match entry {
            ListEntry::Pass(pass) => {
                let accesses = accesses(pass);
                let written = accesses.iter().filter(|access| is_write(access.scope.access));
                let of_host = |resource: &&'static Resource| matches!(resource.role, Role::Readback | Role::ToHost);
                waiting.extend(written.map(|access| access.resource).filter(of_host));
            }
            ListEntry::Barriers(barriers) => {
                let shows = |resource: &'static Resource| {
                    let of = barriers.iter().filter(move |barrier| barrier.resource == resource);
                    of.into_iter().any(|barrier| barrier.after.access.contains(AccessFlags2::HOST_READ))
                };
                waiting.retain(|resource| !shows(resource));
            }
        }
    }
    waiting
}

/// Number of barriers of a list.
pub fn barrier_count(frame: &Frame) -> usize {
    frame.entries.iter().map(|entry| if let ListEntry::Barriers(barriers) = entry { barriers.len() } else { 0 }).sum()
}

/// The same list without its n-th barrier: what the hazard check and the validation layer must complain about.
pub fn without_barrier(frame: &Frame, n: usize) -> Frame {
    let mut left = n;
    let mut frame = frame.clone();
    for entry in &mut frame.entries {
        if let ListEntry::Barriers(barriers) = entry {
            if left < barriers.len() {
                barriers.remove(left);
                break;
            }
            left -= barriers.len();
        }
    }
    frame
}

/// The same passes with barriers that follow from their accesses alone, frame after frame: a second judge.
pub fn derive<'a>(frames: impl IntoIterator<Item = &'a Frame>) -> Vec<Frame> {
    let mut past: BTreeMap<(&'static Resource, usize), Vec<Past>> = BTreeMap::new();
    let mut layouts: BTreeMap<&'static Resource, ImageLayout> = BTreeMap::new();
    let join = |a: Scope, b: Scope| Scope { stage: a.stage | b.stage, access: a.access | b.access };
    let mut derived = Vec::new();
    for (number, frame) in frames.into_iter().enumerate() {
        let key = |resource: &'static Resource| (resource, if resource.per_slot { number % 2 } else { 0 });
        let mut entries = Vec::new();
        let mut left: BTreeMap<&'static Resource, Scope> = BTreeMap::new();
        for pass in frame.passes() {
            let mut by_resource: BTreeMap<&'static Resource, Vec<Access>> = BTreeMap::new();
            for access in accesses(pass).iter().copied() {
                by_resource.entry(access.resource).or_default().push(access);
            }
            let mut barriers = Vec::new();
            for (resource, accesses) in &by_resource {
                let after = accesses.iter().map(|one| one.scope).reduce(join).expect("an access");
                let change = resource.role.is_image() && layouts.get(resource) != Some(&accesses[0].layout);
                let old = past.entry(key(resource)).or_default();
                let collides = |one: &&Past| change || accesses.iter().any(|access| collision(one, access).is_some());
                let before = old.iter().filter(collides).map(|one| Scope {
                    stage: one.access.scope.stage | one.ordered_before,
                    access: writes(spelled(one.access.scope).access),
                });
                let before = before.reduce(join);
                if before.is_some() || change {
                    let before = before.unwrap_or(Scope { stage: after.stage, access: AccessFlags2::NONE });
                    let now = layouts.get(resource).copied().unwrap_or(ImageLayout::UNDEFINED);
                    barriers.push(Barrier {
                        resource,
                        before,
                        after,
                        layouts: change.then_some((now, accesses[0].layout)),
                    });
                }
            }
            take(&mut entries, barriers, |barrier| {
                apply(barrier, past.entry(key(barrier.resource)).or_default(), &mut layouts, &mut Vec::new());
            });
            entries.push(ListEntry::Pass(pass.clone()));
            for access in by_resource.into_values().flatten() {
                if is_write(access.scope.access) && matches!(access.resource.role, Role::Readback | Role::ToHost) {
                    let wrote = Scope { access: writes(access.scope.access), ..access.scope };
                    let before = left.get(&access.resource).copied().unwrap_or(wrote);
                    left.insert(access.resource, join(before, wrote));
                }
                past.entry(key(access.resource)).or_default().push(Past {
                    pass: pass.name.clone(),
                    access,
                    ordered_before: PipelineStageFlags2::NONE,
                    visible_to: Vec::new(),
                    available: false,
                });
            }
        }
        let host = Scope { stage: PipelineStageFlags2::HOST, access: AccessFlags2::HOST_READ };
        let to_host =
            left.into_iter().map(|(resource, before)| Barrier { resource, before, after: host, layouts: None });
        take(&mut entries, to_host.collect(), |barrier| {
            apply(barrier, past.entry(key(barrier.resource)).or_default(), &mut layouts, &mut Vec::new());
        });
        derived.push(Frame { entries });
    }
    derived
}

/// Adds barriers to a list after they had their effect.
fn take(entries: &mut Vec<ListEntry>, barriers: Vec<Barrier>, effect: impl FnMut(&Barrier)) {
    barriers.iter().for_each(effect);
    if !barriers.is_empty() {
        entries.push(ListEntry::Barriers(barriers));
    }
}
