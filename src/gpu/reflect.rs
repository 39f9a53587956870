//! Which buffers a compiled shader reads and writes, found in its SPIR-V.

use std::collections::BTreeMap;

use super::spirv::{instructions, op, text};

/// A buffer that a shader uses.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BlockUse {
    /// Binding in the descriptor set.
    pub binding: u32,
    /// Name of its GLSL block, without the suffix `Block`.
    pub(crate) block: String,
    /// Whether the shader reads it.
    pub reads: bool,
    /// Whether the shader writes it.
    pub writes: bool,
}

/// The decoration of a binding.
const BINDING: u32 = 33;

/// The buffers that a module with one entry point uses, by binding. naga writes no function that the entry point does not call.
pub(crate) fn block_uses(words: &[u32]) -> Vec<BlockUse> {
    let mut names: BTreeMap<u32, String> = BTreeMap::new();
    let mut members: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    let mut pointees = BTreeMap::new();
    let mut bindings = BTreeMap::new();
    // The variable behind each pointer, and the use of each variable.
    let mut roots: BTreeMap<u32, u32> = BTreeMap::new();
    let mut uses: BTreeMap<u32, BlockUse> = BTreeMap::new();
    for (code, operands) in instructions(words) {
        match (code, operands) {
            (op::NAME, [target, name @ ..]) => {
                names.insert(*target, text(name));
            }
            (op::DECORATE, [target, BINDING, number]) => {
                bindings.insert(*target, *number);
            }
            (op::TYPE_STRUCT, [result, inner @ ..]) => {
                members.insert(*result, inner.to_vec());
            }
            (op::TYPE_POINTER, [result, _, pointee]) => {
                pointees.insert(*result, *pointee);
            }
            (op::VARIABLE, [kind, result, ..]) if bindings.contains_key(result) => {
                let mut structure = pointees.get(kind).copied().unwrap_or_default();
                // The compiler wraps blocks that do not end in a runtime array.
                while let (None, Some([inner])) = (names.get(&structure), members.get(&structure).map(Vec::as_slice)) {
                    structure = *inner;
                }
                let name = names.get(&structure).map_or("", |name| name.strip_suffix("Block").unwrap_or(name));
                let none = BlockUse { binding: bindings[result], block: name.to_owned(), reads: false, writes: false };
                roots.insert(*result, *result);
                uses.insert(*result, none);
            }
            (op::ACCESS_CHAIN | op::IN_BOUNDS_ACCESS_CHAIN, [_, result, base, ..]) => {
                roots.get(base).copied().map(|root| roots.insert(*result, root));
            }
            (op::LOAD, [_, _, pointer, ..]) => mark(&roots, &mut uses, *pointer, |one| one.reads = true),
            (op::STORE, [pointer, ..]) => mark(&roots, &mut uses, *pointer, |one| one.writes = true),
            (op::FUNCTION_CALL, [_, _, _, arguments @ ..]) => {
                arguments.iter().for_each(|argument| mark(&roots, &mut uses, *argument, |one| one.reads = true));
            }
            _ => {}
        }
    }
    let mut uses: Vec<BlockUse> = uses.into_values().filter(|one| one.reads || one.writes).collect();
    uses.sort_by_key(|one| one.binding);
    uses
}

fn mark(
    roots: &BTreeMap<u32, u32>,
    uses: &mut BTreeMap<u32, BlockUse>,
    pointer: u32,
    change: impl FnOnce(&mut BlockUse),
) {
    roots.get(&pointer).and_then(|root| uses.get_mut(root)).map(change);
}
