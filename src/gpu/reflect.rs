//! Which buffers a compiled shader reads and writes, found in its SPIR-V.

use std::collections::BTreeMap;

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

/// Opcodes of the SPIR-V specification, section 3.52.
mod op {
    pub(crate) const NAME: u32 = 5;
    pub(crate) const TYPE_STRUCT: u32 = 30;
    pub(crate) const TYPE_POINTER: u32 = 32;
    pub(crate) const FUNCTION_CALL: u32 = 57;
    pub(crate) const VARIABLE: u32 = 59;
    pub(crate) const LOAD: u32 = 61;
    pub(crate) const STORE: u32 = 62;
    pub(crate) const ACCESS_CHAIN: u32 = 65;
    pub(crate) const IN_BOUNDS_ACCESS_CHAIN: u32 = 66;
    pub(crate) const DECORATE: u32 = 71;
}
/// The decoration of a binding.
const BINDING: u32 = 33;
/// Words before the first instruction.
const HEADER: usize = 5;

/// The buffers that a module with one entry point uses, by binding. naga writes no function that the entry point does not call.
pub(crate) fn block_uses(words: &[u32]) -> Vec<BlockUse> {
    let mut names: BTreeMap<u32, String> = BTreeMap::new();
    let mut members: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    let mut pointees = BTreeMap::new();
    let mut bindings = BTreeMap::new();
    // The variable behind each pointer, and the use of each variable.
    let mut roots: BTreeMap<u32, u32> = BTreeMap::new();
    let mut uses: BTreeMap<u32, BlockUse> = BTreeMap::new();
    let mut at = HEADER;
    while let Some((length, code)) = words.get(at).map(|word| ((word >> 16) as usize, word & 0xffff)) {
        let operands = words.get(at + 1..at + length.max(1)).unwrap_or_default();
        at += length.max(1);
        match (code, operands) {
            (op::NAME, [target, text @ ..]) => {
                let bytes: Vec<u8> = text.iter().flat_map(|word| word.to_le_bytes()).take_while(|b| *b != 0).collect();
                names.insert(*target, String::from_utf8_lossy(&bytes).into_owned());
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
