//! Instructions of SPIR-V, and what naga leaves for this room to mend in a module.
//!
//! naga gives a type the same layout (Offset, ArrayStride) in buffers and in variables of functions and workgroups. SPIR-V allows it in buffers alone
//! (VUID-StandaloneSpirv-None-10684). [`mended`] takes the layout from types that no buffer holds. A type of both gets a second type without a layout, and loads and
//! stores of variables convert between the two member by member (Mesa 22.3 knows no OpCopyLogical). naga also leaves a compiler free to contract a product and a sum to one operation, which [`EXACT`]
//! functions forbid (NoContraction).

use std::collections::{BTreeMap, BTreeSet};

/// Functions of `glsl/` that depend on the rounding of each operation: residues of sums, changes in last places, and the split of the band table.
const EXACT: [&str; 9] = [
    "carried",
    "finish",
    "high_part",
    "local_rate",
    "places_of",
    "retarget_merge",
    "retarget_restart",
    "scaled_radiance",
    "transition_step",
];

/// Opcodes of the SPIR-V specification, section 3.52.
pub(super) mod op {
    pub(crate) const NAME: u32 = 5;
    pub(crate) const TYPE_VOID: u32 = 19;
    pub(crate) const TYPE_ARRAY: u32 = 28;
    pub(crate) const TYPE_RUNTIME_ARRAY: u32 = 29;
    pub(crate) const TYPE_STRUCT: u32 = 30;
    pub(crate) const TYPE_POINTER: u32 = 32;
    pub(crate) const TYPE_FUNCTION: u32 = 33;
    pub(crate) const CONSTANT: u32 = 43;
    pub(crate) const CONSTANT_COMPOSITE: u32 = 44;
    pub(crate) const CONSTANT_NULL: u32 = 46;
    pub(crate) const FUNCTION: u32 = 54;
    pub(crate) const FUNCTION_PARAMETER: u32 = 55;
    pub(crate) const FUNCTION_CALL: u32 = 57;
    pub(crate) const VARIABLE: u32 = 59;
    pub(crate) const LOAD: u32 = 61;
    pub(crate) const STORE: u32 = 62;
    pub(crate) const ACCESS_CHAIN: u32 = 65;
    pub(crate) const IN_BOUNDS_ACCESS_CHAIN: u32 = 66;
    pub(crate) const DECORATE: u32 = 71;
    pub(crate) const MEMBER_DECORATE: u32 = 72;
    pub(crate) const COMPOSITE_CONSTRUCT: u32 = 80;
    pub(crate) const COMPOSITE_EXTRACT: u32 = 81;
    pub(crate) const F_ADD: u32 = 129;
    pub(crate) const F_SUB: u32 = 131;
    pub(crate) const F_MUL: u32 = 133;
}

/// Decorations of the layout of a type: row and column major, the strides of arrays and matrices, and the offset of a member.
const LAYOUT: [u32; 5] = [4, 5, 6, 7, 35];
const NO_CONTRACTION: u32 = 42;
/// Storage classes of variables without a layout: workgroup, private and function.
const PLAIN: [u32; 3] = [4, 6, 7];
/// Words before the first instruction. The bound of all numbers is among them.
const HEADER: usize = 5;
const BOUND: usize = 3;

/// The opcode and the operands of each instruction of a module.
pub(super) fn instructions(words: &[u32]) -> impl Iterator<Item = (u32, &[u32])> {
    let mut at = HEADER;
    std::iter::from_fn(move || {
        let word = *words.get(at)?;
        let length = ((word >> 16) as usize).max(1);
        let operands = words.get(at + 1..at + length).unwrap_or_default();
        at += length;
        Some((word & 0xffff, operands))
    })
}

/// The text of an operand.
pub(super) fn text(words: &[u32]) -> String {
    let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).take_while(|byte| *byte != 0).collect();
    String::from_utf8_lossy(&bytes).into_owned()
}

/// A module that means the same to every driver.
pub(super) fn mended(words: &[u32]) -> Vec<u32> {
    let mut module = Mended::new(words);
    for (code, operands) in instructions(words) {
        module.take(code, operands);
    }
    module.out[BOUND] = module.bound;
    module.out
}

/// A module that is mended, and what is known of the one before.
struct Mended<'a> {
    out: Vec<u32>,
    bound: u32,
    /// Arrays and structures: opcode, and the operands after the number of the type.
    compounds: BTreeMap<u32, (u32, &'a [u32])>,
    /// Types with a layout that buffers hold.
    laid_out: BTreeSet<u32>,
    /// Composite and null constants: opcode and operands.
    constants: BTreeMap<u32, (u32, &'a [u32])>,
    /// Values of other constants: the lengths of arrays are among them.
    values: BTreeMap<u32, u32>,
    /// Types to which pointers of variables without a layout point.
    pointees: BTreeMap<u32, u32>,
    /// The pointer type of each pointer in the code.
    pointers: BTreeMap<u32, u32>,
    /// Initial values of variables in functions.
    initial: Vec<u32>,
    /// Results that are not contracted.
    exact: Vec<u32>,
    /// The type or constant without a layout in the place of another.
    plain: BTreeMap<u32, u32>,
    /// Which of these types are not written yet.
    unwritten: BTreeSet<u32>,
}

impl<'a> Mended<'a> {
    fn new(words: &'a [u32]) -> Self {
        let mut module = Self {
            out: words[..HEADER].to_vec(),
            bound: words[BOUND],
            compounds: BTreeMap::new(),
            laid_out: BTreeSet::new(),
            constants: BTreeMap::new(),
            values: BTreeMap::new(),
            pointees: BTreeMap::new(),
            pointers: BTreeMap::new(),
            initial: Vec::new(),
            exact: Vec::new(),
            plain: BTreeMap::new(),
            unwritten: BTreeSet::new(),
        };
        let (mut names, mut in_buffers, mut decorated) = (BTreeMap::new(), Vec::new(), BTreeSet::new());
        let mut is_exact = false;
        for (code, operands) in instructions(words) {
            match (code, operands) {
                (op::NAME, [target, name @ ..]) => {
                    names.insert(*target, text(name));
                }
                (op::DECORATE, [target, kind, ..]) | (op::MEMBER_DECORATE, [target, _, kind, ..])
                    if LAYOUT.contains(kind) =>
                {
                    decorated.insert(*target);
                }
                (op::TYPE_ARRAY | op::TYPE_RUNTIME_ARRAY | op::TYPE_STRUCT, [result, rest @ ..]) => {
                    module.compounds.insert(*result, (code, rest));
                }
                (op::TYPE_POINTER, [result, class, pointee]) if PLAIN.contains(class) => {
                    module.pointees.insert(*result, *pointee);
                }
                (op::TYPE_POINTER, [_, _, pointee]) => in_buffers.push(*pointee),
                (op::CONSTANT, [_, result, value, ..]) => {
                    module.values.insert(*result, *value);
                }
                (op::CONSTANT_COMPOSITE | op::CONSTANT_NULL, [_, result, ..]) => {
                    module.constants.insert(*result, (code, operands));
                }
                (op::VARIABLE, [_, _, _, value]) => module.initial.push(*value),
                (op::FUNCTION, [_, result, ..]) => {
                    is_exact = names.get(result).is_some_and(|name| EXACT.contains(&name.as_str()));
                }
                (op::F_ADD | op::F_SUB | op::F_MUL, [_, result, ..]) if is_exact => module.exact.push(*result),
                _ => {}
            }
        }
        while let Some(kind) = in_buffers.pop() {
            if decorated.contains(&kind) {
                module.laid_out.insert(kind);
            }
            in_buffers.extend(module.inner(kind));
        }
        let mut in_variables: Vec<u32> = module.pointees.values().copied().collect();
        while let Some(kind) = in_variables.pop() {
            if module.has_layout(kind) && !module.plain.contains_key(&kind) {
                let result = module.next();
                module.plain.insert(kind, result);
                module.unwritten.insert(kind);
                in_variables.extend(module.inner(kind));
            }
        }
        module
    }

    /// The types in an array or a structure.
    fn inner(&self, kind: u32) -> &'a [u32] {
        match self.compounds.get(&kind).copied() {
            Some((op::TYPE_STRUCT, members)) => members,
            Some((_, operands)) => &operands[..1],
            None => &[],
        }
    }

    /// Whether a type has a layout that it keeps for buffers.
    fn has_layout(&self, kind: u32) -> bool {
        self.laid_out.contains(&kind) || self.inner(kind).iter().any(|inner| self.has_layout(*inner))
    }

    fn write(&mut self, code: u32, operands: &[u32]) {
        self.out.push(((operands.len() as u32 + 1) << 16) | code);
        self.out.extend(operands);
    }

    fn next(&mut self) -> u32 {
        self.bound += 1;
        self.bound - 1
    }

    /// A type without a layout, written where it is first needed.
    fn plain_type(&mut self, kind: u32) -> u32 {
        let Some(result) = self.plain.get(&kind).copied() else { return kind };
        if self.unwritten.remove(&kind) {
            let (code, operands) = self.compounds[&kind];
            let (inner, rest) = operands.split_at(self.inner(kind).len());
            let inner: Vec<u32> = inner.iter().map(|inner| self.plain_type(*inner)).collect();
            self.write(code, &[&[result], &inner[..], rest].concat());
        }
        result
    }

    /// The same constant of a type without a layout.
    fn plain_constant(&mut self, constant: u32) -> u32 {
        let Some((code, [kind, _, parts @ ..])) = self.constants.get(&constant).copied() else { return constant };
        if !self.has_layout(*kind) {
            return constant;
        }
        if let Some(known) = self.plain.get(&constant) {
            return *known;
        }
        let parts: Vec<u32> = parts.iter().map(|part| self.plain_constant(*part)).collect();
        let (kind, result) = (self.plain_type(*kind), self.next());
        self.write(code, &[&[kind, result], &parts[..]].concat());
        self.plain.insert(constant, result);
        result
    }

    /// The value of a type with a layout, given the one without, or the other way round. Its number is `result` where one is given.
    fn convert(&mut self, kind: u32, (value, to_plain): (u32, bool), result: Option<u32>) -> u32 {
        let Some(plain) = self.plain.get(&kind).copied() else { return value };
        let members = match self.compounds[&kind] {
            (op::TYPE_ARRAY, [element, length, ..]) => vec![*element; self.values[length] as usize],
            _ => self.inner(kind).to_vec(),
        };
        let parts: Vec<u32> = members
            .into_iter()
            .zip(0..)
            .map(|(member, place)| {
                let of_source = if to_plain { member } else { self.plain.get(&member).copied().unwrap_or(member) };
                let part = self.next();
                self.write(op::COMPOSITE_EXTRACT, &[of_source, part, value, place]);
                self.convert(member, (part, to_plain), None)
            })
            .collect();
        let result = result.unwrap_or_else(|| self.next());
        let of_result = if to_plain { plain } else { kind };
        self.write(op::COMPOSITE_CONSTRUCT, &[&[of_result, result], &parts[..]].concat());
        result
    }

    /// The type of what a pointer points to, where a variable has it without a layout and buffers have it with one.
    fn converted(&self, pointer: u32) -> Option<u32> {
        let pointee = *self.pointees.get(self.pointers.get(&pointer)?)?;
        self.has_layout(pointee).then_some(pointee)
    }

    /// Takes the next instruction of the module before.
    fn take(&mut self, code: u32, operands: &'a [u32]) {
        if (op::TYPE_VOID..=op::TYPE_FUNCTION).contains(&code) {
            for result in std::mem::take(&mut self.exact) {
                self.write(op::DECORATE, &[result, NO_CONTRACTION]);
            }
        }
        match (code, operands) {
            (op::DECORATE, [kind, decoration, ..]) | (op::MEMBER_DECORATE, [kind, _, decoration, ..])
                if LAYOUT.contains(decoration) && !self.laid_out.contains(kind) => {}
            (op::TYPE_POINTER, [result, class, pointee]) if PLAIN.contains(class) => {
                let pointee = self.plain_type(*pointee);
                self.write(code, &[*result, *class, pointee]);
            }
            (op::FUNCTION, _) => {
                for value in std::mem::take(&mut self.initial) {
                    self.plain_constant(value);
                }
                self.write(code, operands);
            }
            (op::VARIABLE, [kind, result, class, value]) => {
                self.pointers.insert(*result, *kind);
                let value = if self.converted(*result).is_some() { self.plain_constant(*value) } else { *value };
                self.write(code, &[*kind, *result, *class, value]);
            }
            (op::LOAD, [kind, result, pointer, rest @ ..]) if self.converted(*pointer).is_some() => {
                let (plain, loaded) = (self.plain[kind], self.next());
                self.write(code, &[&[plain, loaded, *pointer], rest].concat());
                self.convert(*kind, (loaded, false), Some(*result));
            }
            (op::STORE, [pointer, value, rest @ ..]) => {
                let Some(kind) = self.converted(*pointer) else { return self.write(code, operands) };
                let stored = self.convert(kind, (*value, true), None);
                self.write(code, &[&[*pointer, stored], rest].concat());
            }
            (
                op::VARIABLE | op::ACCESS_CHAIN | op::IN_BOUNDS_ACCESS_CHAIN | op::FUNCTION_PARAMETER,
                [kind, result, ..],
            ) => {
                self.pointers.insert(*result, *kind);
                self.write(code, operands);
            }
            _ => self.write(code, operands),
        }
    }
}

#[cfg(test)]
mod tests;
