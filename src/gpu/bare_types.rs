//! A pass over SPIR-V that takes the layout from types of variables that have none in memory.
//!
//! naga decorates a structure with offsets and an array with its stride wherever the type is used. Vulkan allows that only of
//! memory whose layout the host knows (VUID-StandaloneSpirv-None-10684, which SPIRV-Tools checks from 2026 on). The pass gives
//! every value and every other variable a bare copy of such a type, and copies member by member (`OpCopyLogical`) where a value
//! comes from that memory or goes there.

use std::collections::{BTreeMap, BTreeSet};

/// Opcodes of the SPIR-V specification, section 3.52.
mod op {
    pub(crate) const TYPE_VOID: u32 = 19;
    pub(crate) const TYPE_ARRAY: u32 = 28;
    pub(crate) const TYPE_STRUCT: u32 = 30;
    pub(crate) const TYPE_POINTER: u32 = 32;
    pub(crate) const TYPE_FUNCTION: u32 = 33;
    pub(crate) const FUNCTION_PARAMETER: u32 = 55;
    pub(crate) const VARIABLE: u32 = 59;
    pub(crate) const LOAD: u32 = 61;
    pub(crate) const STORE: u32 = 62;
    pub(crate) const ACCESS_CHAIN: u32 = 65;
    pub(crate) const IN_BOUNDS_ACCESS_CHAIN: u32 = 66;
    pub(crate) const DECORATE: u32 = 71;
    pub(crate) const MEMBER_DECORATE: u32 = 72;
    pub(crate) const COPY_LOGICAL: u32 = 400;
}
/// The decorations of a stride and of an offset.
const ARRAY_STRIDE: u32 = 6;
const OFFSET: u32 = 35;
/// Storage classes whose layout the host knows: uniform, push constant and storage buffer.
const SHARED: [u32; 3] = [2, 9, 12];
/// Words before the first instruction. The fourth is the bound of all identifiers.
const HEADER: usize = 5;
const BOUND: usize = 3;

/// The module with bare types. `words` are a valid module.
pub(crate) fn with_bare_types(words: &[u32]) -> Vec<u32> {
    let all: Vec<&[u32]> = instructions(words).collect();
    // Names and decorations stand before the first type, types before what uses them.
    let (head, body) = all.split_at(all.iter().position(|one| is_type(code(one))).unwrap_or(all.len()));
    let needed = needed(head, body);
    let bound = words[BOUND];
    let next = bound + needed.len() as u32;
    let bare = needed.into_iter().zip(bound..).collect();
    let out = [&words[..HEADER], &head.concat()].concat();
    let mut pass = Pass { bare, shared: BTreeMap::new(), pointers: BTreeMap::new(), next, out };
    body.iter().for_each(|instruction| pass.rewrite(instruction));
    pass.out[BOUND] = pass.next;
    pass.out
}

fn instructions(words: &[u32]) -> impl Iterator<Item = &[u32]> {
    let mut rest = words.get(HEADER..).unwrap_or_default();
    std::iter::from_fn(move || {
        let length = (rest.first()? >> 16).max(1) as usize;
        let (instruction, later) = rest.split_at_checked(length)?;
        rest = later;
        Some(instruction)
    })
}

fn code(instruction: &[u32]) -> u32 {
    instruction[0] & 0xffff
}

fn is_type(code: u32) -> bool {
    (op::TYPE_VOID..=op::TYPE_FUNCTION).contains(&code)
}

/// Types with a layout that values or variables without one have.
fn needed(head: &[&[u32]], body: &[&[u32]]) -> BTreeSet<u32> {
    let laid_out: BTreeSet<u32> = head
        .iter()
        .filter_map(|instruction| match (code(instruction), &instruction[1..]) {
            (op::DECORATE, [target, ARRAY_STRIDE, ..]) | (op::MEMBER_DECORATE, [target, _, OFFSET, ..]) => {
                Some(*target)
            }
            _ => None,
        })
        .collect();
    let mut needed = BTreeSet::new();
    for instruction in body {
        match (code(instruction), &instruction[1..]) {
            (op::TYPE_POINTER, [_, class, pointee]) if !SHARED.contains(class) => {
                needed.insert(*pointee);
            }
            (op::TYPE_FUNCTION, [_, parts @ ..]) => needed.extend(parts),
            (code, [kind, ..]) if !is_type(code) => {
                needed.insert(*kind);
            }
            _ => {}
        }
    }
    needed.retain(|one| laid_out.contains(one));
    // A type stands after the types of its members.
    for instruction in body.iter().rev() {
        if let (op::TYPE_ARRAY | op::TYPE_STRUCT, [result, parts @ ..]) = (code(instruction), &instruction[1..])
            && needed.contains(result)
        {
            needed.extend(parts.iter().filter(|part| laid_out.contains(part)));
        }
    }
    needed
}

struct Pass {
    /// The bare copy of each type.
    bare: BTreeMap<u32, u32>,
    /// Types of pointers to laid out memory, with what they point to.
    shared: BTreeMap<u32, u32>,
    /// Types of pointers.
    pointers: BTreeMap<u32, u32>,
    /// The next free identifier.
    next: u32,
    out: Vec<u32>,
}

impl Pass {
    fn rewrite(&mut self, instruction: &[u32]) {
        let mut new = instruction.to_vec();
        match (code(instruction), &instruction[1..]) {
            (op::TYPE_ARRAY | op::TYPE_STRUCT, [result, ..]) => {
                if let Some(copy) = self.bare.get(result) {
                    self.out.extend(instruction);
                    new[1] = *copy;
                    self.make_bare(&mut new[2..]);
                }
            }
            (op::TYPE_POINTER, [result, class, pointee]) if SHARED.contains(class) => {
                self.shared.insert(*result, *pointee);
            }
            (op::TYPE_POINTER, _) => self.make_bare(&mut new[3..]),
            (op::TYPE_FUNCTION, _) => self.make_bare(&mut new[2..]),
            (op::LOAD, [kind, result, pointer, ..]) if self.points_to(*pointer) == Some(*kind) => {
                if let Some(copy) = self.bare.get(kind).copied() {
                    new[2] = self.fresh();
                    self.out.extend(&new);
                    new = copy_logical(copy, *result, new[2]);
                }
            }
            (op::STORE, [pointer, value, ..]) => {
                if let Some(kind) = self.points_to(*pointer).filter(|kind| self.bare.contains_key(kind)) {
                    new[2] = self.fresh();
                    self.out.extend(copy_logical(kind, new[2], *value));
                }
            }
            (code, [kind, rest @ ..]) if !is_type(code) => {
                if let (true, [result, ..]) = (MAKES_POINTERS.contains(&code), rest) {
                    self.pointers.insert(*result, *kind);
                }
                self.make_bare(&mut new[1..2]);
            }
            _ => {}
        }
        self.out.extend(new);
    }

    /// What a pointer to laid out memory points to.
    fn points_to(&self, pointer: u32) -> Option<u32> {
        self.shared.get(self.pointers.get(&pointer)?).copied()
    }

    fn make_bare(&self, types: &mut [u32]) {
        types.iter_mut().for_each(|one| *one = self.bare.get(one).copied().unwrap_or(*one));
    }

    fn fresh(&mut self) -> u32 {
        self.next += 1;
        self.next - 1
    }
}

const MAKES_POINTERS: [u32; 4] = [op::FUNCTION_PARAMETER, op::VARIABLE, op::ACCESS_CHAIN, op::IN_BOUNDS_ACCESS_CHAIN];

fn copy_logical(kind: u32, result: u32, value: u32) -> Vec<u32> {
    vec![4 << 16 | op::COPY_LOGICAL, kind, result, value]
}
