//! Reads glTF accessors: typed values from buffers, with sparse values and checked bounds (glTF 2.0, 3.6.2).

use std::borrow::Cow;
use std::cell::OnceCell;

use super::ModelFault;
use super::document::Document;
use super::elements::{Accessor, ComponentType, ElementType, Substitutes};
use super::error::label;
use super::meshopt_filter::Filter;
use crate::files::Expansion;

/// Most elements of an accessor without a buffer view. The file size does not bound them.
const MAX_ZERO_ELEMENTS: usize = 1 << 24;

/// The purpose of an accessor, which decides the allowed types.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum AccessorUse {
    Position,
    Normal,
}

/// A document with the bytes of its buffers.
pub(super) struct Accessors<'a> {
    document: &'a Document<'a>,
    buffers: &'a [Cow<'a, [u8]>],
    /// The decoded bytes of compressed buffer views, each from its first use on.
    decoded: Vec<OnceCell<Result<Vec<u8>, String>>>,
    expansion: Expansion,
}

/// Elements of equal size at equal distances in a byte slice.
struct Strided<'a> {
    bytes: &'a [u8],
    stride: usize,
    size: usize,
}

impl Strided<'_> {
    fn get(&self, index: usize) -> &[u8] {
        let start = index * self.stride;
        &self.bytes[start..start + self.size]
    }
}

impl<'a> Accessors<'a> {
    /// Accessors of a document of `length` bytes.
    pub(crate) fn new(document: &'a Document<'a>, length: usize, buffers: &'a [Cow<'a, [u8]>]) -> Self {
        let decoded = document.views.iter().map(|_| OnceCell::new()).collect();
        let size = length + buffers.iter().map(|bytes| bytes.len()).sum::<usize>();
        Self { document, buffers, decoded, expansion: Expansion::of(size) }
    }

    /// Counts `count` things of `each` bytes that the file is about to become.
    pub(crate) fn charge(&self, count: usize, each: usize) -> Result<(), String> {
        self.expansion.charge(count, each).map_err(|fault| format!("takes too much memory: {fault}"))
    }

    /// Reads positions or normals as f64. The `normalized` flag decides the conversion of integers.
    pub(crate) fn vectors(&self, index: usize, purpose: AccessorUse) -> Result<Vec<[f64; 3]>, ModelFault> {
        let (accessor, component) = self.typed(index, ElementType::Vec3)?;
        let normalized = accessor.normalized;
        use ComponentType::{F32, I8, I16, U8, U16, U32};
        let allowed = match component {
            F32 => true,
            U32 => false,
            U8 | U16 => self.document.quantized && purpose == AccessorUse::Position,
            I8 | I16 => self.document.quantized && (purpose == AccessorUse::Position || normalized),
        };
        if !allowed {
            let sign = if normalized { "normalized " } else { "" };
            let key = if purpose == AccessorUse::Position { "POSITION" } else { "NORMAL" };
            let problem = format!(
                "holds {sign}{}, which {key} may not be{}",
                component_name(component),
                if self.document.quantized { "" } else { " unless the file uses KHR_mesh_quantization" }
            );
            return Err(ModelFault::element(self.document.accessor_label(index), problem));
        }
        self.read(index, accessor, component, |bytes| {
            let size = component.size();
            [0, 1, 2].map(|axis| decode(component, normalized, &bytes[axis * size..(axis + 1) * size]))
        })
    }

    /// Error that rounding may have left in unit vectors of an accessor, as a length. 0 for floats.
    pub(crate) fn rounding(&self, index: usize) -> f64 {
        let Some(accessor) = self.document.accessors.get(index) else { return 0.0 };
        let largest = match accessor.component_type {
            Some(ComponentType::I8) => f64::from(i8::MAX),
            Some(ComponentType::I16) => f64::from(i16::MAX),
            _ => return 0.0,
        };
        let view = accessor.buffer_view.and_then(|view| self.document.compressed.get(view)?.as_ref());
        let is_octahedral = view.is_some_and(|view| view.filter == Filter::Octahedral);
        // Half a unit in each of three components. The filter rounds twice.
        let units = if is_octahedral { 2.0 } else { 0.5 * 3.0_f64.sqrt() };
        units / largest
    }

    pub(crate) fn indices(&self, index: usize) -> Result<Vec<u32>, ModelFault> {
        let (accessor, component) = self.typed(index, ElementType::Scalar)?;
        if !is_index(component) || accessor.normalized {
            let problem = format!("holds {}, which vertex indices may not be", component_name(component));
            return Err(ModelFault::element(self.document.accessor_label(index), problem));
        }
        self.read(index, accessor, component, |bytes| unsigned(component, bytes))
    }

    /// Reads elements of `N` numbers each: 1 is a scalar, 3 or 4 a vector. Integers must be normalized (glTF 2.0, 3.11). `holder` names them in
    /// messages.
    pub(crate) fn keys<const N: usize>(&self, index: usize, holder: &str) -> Result<Vec<[f64; N]>, ModelFault> {
        let wanted = match N {
            1 => ElementType::Scalar,
            3 => ElementType::Vec3,
            _ => ElementType::Vec4,
        };
        let (accessor, component) = self.typed(index, wanted)?;
        let normalized = accessor.normalized;
        if component != ComponentType::F32 && !(normalized && component != ComponentType::U32) {
            let problem = format!("holds {}, which {holder} may not be", component_name(component));
            return Err(ModelFault::element(self.document.accessor_label(index), problem));
        }
        self.read(index, accessor, component, |bytes| {
            let size = component.size();
            std::array::from_fn(|i| decode(component, normalized, &bytes[i * size..(i + 1) * size]))
        })
    }

    /// The accessor with a checked type, and its component type.
    fn typed(&self, index: usize, wanted: ElementType) -> Result<(&'a Accessor, ComponentType), ModelFault> {
        let fail = |problem: String| ModelFault::element(self.document.accessor_label(index), problem);
        let Some(accessor) = self.document.accessors.get(index) else {
            return Err(fail(format!("does not exist, the file has {}", self.document.accessors.len())));
        };
        match accessor.element_type {
            Some(kind) if kind == wanted => {}
            Some(kind) => return Err(fail(format!("is of type {kind:?} where {wanted:?} is needed"))),
            None => return Err(fail("has an unknown type".to_owned())),
        }
        let component = accessor.component_type.ok_or_else(|| fail("has an unknown component type".to_owned()))?;
        Ok((accessor, component))
    }

    fn read<T: Clone>(
        &self,
        index: usize,
        accessor: &Accessor,
        component: ComponentType,
        decode: impl Fn(&[u8]) -> T,
    ) -> Result<Vec<T>, ModelFault> {
        let fail = |problem: String| ModelFault::element(self.document.accessor_label(index), problem);
        let kind = accessor.element_type.ok_or_else(|| fail("has an unknown type".to_owned()))?;
        let size = component.size() * kind.components();
        let count = usize::try_from(accessor.count).ok().filter(|count| *count > 0);
        let count = count.ok_or_else(|| fail(format!("has a count of {}", accessor.count)))?;
        self.charge(count, size_of::<T>()).map_err(fail)?;

        let mut values = match (accessor.buffer_view, &accessor.sparse) {
            (Some(view), _) => {
                let base = self.strided(view, accessor.byte_offset, count, size, true).map_err(fail)?;
                (0..count).map(|element| decode(base.get(element))).collect()
            }
            (None, Some(_)) if count > MAX_ZERO_ELEMENTS => {
                return Err(fail(format!(
                    "has {count} elements and no buffer view; at most {MAX_ZERO_ELEMENTS} are allowed"
                )));
            }
            (None, Some(_)) => vec![decode(&[0; 16]); count],
            (None, None) => {
                return Err(fail(
                    "has neither a buffer view nor sparse values (is the file compressed? write it again without)"
                        .to_owned(),
                ));
            }
        };
        if let Some(sparse) = &accessor.sparse {
            self.substitute(sparse, size, &mut values, decode).map_err(fail)?;
        }
        Ok(values)
    }

    /// Overwrites the elements that a sparse accessor lists (3.6.2.3).
    fn substitute<T>(
        &self,
        sparse: &Substitutes,
        size: usize,
        values: &mut [T],
        decode: impl Fn(&[u8]) -> T,
    ) -> Result<(), String> {
        let count = usize::try_from(sparse.count).ok().filter(|count| (1..=values.len()).contains(count));
        let count = count.ok_or_else(|| {
            format!("has {} sparse values, where 1 to its {} elements are possible", sparse.count, values.len())
        })?;
        let indices = &sparse.indices;
        let component = indices.component_type.filter(|component| is_index(*component));
        let component = component.ok_or("has sparse indices of a type that is not allowed")?;
        let indices = self.strided(indices.buffer_view, indices.byte_offset, count, component.size(), false)?;
        let substitutes = &sparse.values;
        let substitutes = self.strided(substitutes.buffer_view, substitutes.byte_offset, count, size, false)?;
        let length = values.len();
        let mut previous = None;
        for entry in 0..count {
            let target = unsigned(component, indices.get(entry));
            if previous.is_some_and(|previous| previous >= target) {
                return Err(format!("has sparse indices that do not increase, at number {entry}"));
            }
            previous = Some(target);
            let value = values.get_mut(target as usize);
            *value.ok_or_else(|| format!("has sparse index {target}, but only {length} elements"))? =
                decode(substitutes.get(entry));
        }
        Ok(())
    }

    /// `count` elements of `size` bytes from `offset` in a buffer view. The elements are checked to lie inside.
    fn strided(
        &self,
        view: usize,
        offset: u64,
        count: usize,
        size: usize,
        may_stride: bool,
    ) -> Result<Strided<'_>, String> {
        let (bytes, stride) = self.view(view)?;
        // Decoded elements lie as far apart as they were compressed.
        let is_decoded = self.document.compressed.get(view).is_some_and(Option::is_some);
        let stride = stride.filter(|_| may_stride || is_decoded).unwrap_or(size);
        if stride < size {
            return Err(format!("has elements of {size} bytes in buffer view {view} with a stride of {stride}"));
        }
        let end = (count - 1).checked_mul(stride).and_then(|last| last.checked_add(size));
        let bytes = usize::try_from(offset)
            .ok()
            .and_then(|offset| bytes.get(offset..))
            .filter(|rest| end.is_some_and(|end| end <= rest.len()));
        let bytes = bytes.ok_or_else(|| {
            format!("needs {count} elements of {size} bytes from byte {offset} on, past the end of buffer view {view}")
        })?;
        Ok(Strided { bytes, stride, size })
    }

    /// The bytes of a buffer view, and the distance between its elements, where it is stated.
    fn view(&self, index: usize) -> Result<(&[u8], Option<usize>), String> {
        let views = &self.document.views;
        let view =
            views.get(index).ok_or_else(|| format!("refers to buffer view {index}, the file has {}", views.len()))?;
        if let Some(compressed) = &self.document.compressed[index] {
            let bytes = self.decoded[index].get_or_init(|| {
                let (buffer, offset, length) = (compressed.buffer, compressed.offset, compressed.length);
                let decoded = self.bytes(buffer, offset, length).and_then(|bytes| {
                    self.charge(compressed.count, compressed.stride)?;
                    compressed.decode(bytes)
                });
                decoded.map_err(|problem| format!("refers to compressed buffer view {index}, which {problem}"))
            });
            return Ok((bytes.as_ref().map_err(String::clone)?, Some(compressed.stride)));
        }
        let bytes = self.bytes(view.buffer, view.byte_offset, view.byte_length);
        let label = label("buffer view", index, view.name.as_deref());
        let bytes = bytes.map_err(|problem| format!("refers to {label}, which {problem}"))?;
        Ok((bytes, view.byte_stride))
    }

    fn bytes(&self, buffer: usize, offset: u64, length: u64) -> Result<&'a [u8], String> {
        let stored = self.buffers.get(buffer);
        let bytes = stored.ok_or_else(|| format!("refers to buffer {buffer}; the file has {}", self.buffers.len()))?;
        let range = usize::try_from(offset).ok().zip(usize::try_from(length).ok());
        let slice = range.and_then(|(offset, length)| bytes.get(offset..offset.checked_add(length)?));
        slice.ok_or_else(|| {
            let has = bytes.len();
            format!("has {length} bytes from byte {offset} on, past the end of buffer {buffer} ({has} bytes)")
        })
    }
}

fn is_index(component: ComponentType) -> bool {
    matches!(component, ComponentType::U8 | ComponentType::U16 | ComponentType::U32)
}

fn component_name(component: ComponentType) -> &'static str {
    match component {
        ComponentType::I8 => "8-bit integers",
        ComponentType::U8 => "unsigned 8-bit integers",
        ComponentType::I16 => "16-bit integers",
        ComponentType::U16 => "unsigned 16-bit integers",
        ComponentType::U32 => "unsigned 32-bit integers",
        ComponentType::F32 => "32-bit floats",
    }
}

/// The first bytes of a slice as an array. Missing bytes would be 0, but the callers' bounds exclude that.
fn lead<const N: usize>(bytes: &[u8]) -> [u8; N] {
    bytes.first_chunk::<N>().copied().unwrap_or([0; N])
}

/// One component. Normalized integers follow glTF 2.0, 3.11.
fn decode(component: ComponentType, normalized: bool, bytes: &[u8]) -> f64 {
    let (value, largest) = match component {
        ComponentType::I8 => (f64::from(i8::from_le_bytes(lead(bytes))), f64::from(i8::MAX)),
        ComponentType::U8 => (f64::from(u8::from_le_bytes(lead(bytes))), f64::from(u8::MAX)),
        ComponentType::I16 => (f64::from(i16::from_le_bytes(lead(bytes))), f64::from(i16::MAX)),
        ComponentType::U16 => (f64::from(u16::from_le_bytes(lead(bytes))), f64::from(u16::MAX)),
        ComponentType::U32 => (f64::from(u32::from_le_bytes(lead(bytes))), f64::from(u32::MAX)),
        ComponentType::F32 => return f64::from(f32::from_le_bytes(lead(bytes))),
    };
    if normalized { (value / largest).max(-1.0) } else { value }
}

fn unsigned(component: ComponentType, bytes: &[u8]) -> u32 {
    match component {
        ComponentType::U8 | ComponentType::I8 => u32::from(u8::from_le_bytes(lead(bytes))),
        ComponentType::U16 | ComponentType::I16 => u32::from(u16::from_le_bytes(lead(bytes))),
        ComponentType::U32 | ComponentType::F32 => u32::from_le_bytes(lead(bytes)),
    }
}
