//! The elements of a glTF document that hold geometry (glTF 2.0, 5). A number or a word that glTF does not know is `None`: it only matters where it is used.

use std::collections::BTreeMap;

use serde::de::IgnoredAny;
use serde::{Deserialize, Deserializer};

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Accessor {
    pub(crate) name: Option<String>,
    pub(crate) buffer_view: Option<usize>,
    #[serde(default)]
    pub(crate) byte_offset: u64,
    pub(crate) count: u64,
    #[serde(deserialize_with = "component_type")]
    pub(crate) component_type: Option<ComponentType>,
    #[serde(rename = "type", deserialize_with = "element_type")]
    pub(crate) element_type: Option<ElementType>,
    #[serde(default)]
    pub(crate) normalized: bool,
    pub(crate) sparse: Option<Substitutes>,
}

/// Elements of an accessor that have other values.
#[derive(Deserialize)]
pub(super) struct Substitutes {
    pub(crate) count: u64,
    pub(crate) indices: SparseIndices,
    pub(crate) values: SparseValues,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct SparseIndices {
    pub(crate) buffer_view: usize,
    #[serde(default)]
    pub(crate) byte_offset: u64,
    #[serde(deserialize_with = "component_type")]
    pub(crate) component_type: Option<ComponentType>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct SparseValues {
    pub(crate) buffer_view: usize,
    #[serde(default)]
    pub(crate) byte_offset: u64,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct BufferView {
    pub(crate) name: Option<String>,
    pub(crate) buffer: usize,
    #[serde(default)]
    pub(crate) byte_offset: u64,
    pub(crate) byte_length: u64,
    /// Distance between elements [bytes].
    pub(crate) byte_stride: Option<usize>,
}

#[derive(Deserialize)]
pub(super) struct GltfMesh {
    pub(crate) name: Option<String>,
    pub(crate) primitives: Vec<Primitive>,
}

#[derive(Deserialize)]
pub(super) struct Primitive {
    /// Accessors by attribute, such as `POSITION`.
    pub(crate) attributes: BTreeMap<String, usize>,
    pub(crate) indices: Option<usize>,
    pub(crate) material: Option<usize>,
    #[serde(default = "triangles", deserialize_with = "primitive_mode")]
    pub(crate) mode: Option<PrimitiveMode>,
    /// Morph targets.
    #[serde(default)]
    pub(crate) targets: Option<Vec<IgnoredAny>>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ComponentType {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl ComponentType {
    /// Bytes of a component.
    pub(crate) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ElementType {
    Scalar,
    Vec2,
    Vec3,
    Vec4,
    Mat2,
    Mat3,
    Mat4,
}

impl ElementType {
    /// Numbers of an element.
    pub(crate) fn components(self) -> usize {
        match self {
            Self::Scalar => 1,
            Self::Vec2 => 2,
            Self::Vec3 => 3,
            Self::Vec4 | Self::Mat2 => 4,
            Self::Mat3 => 9,
            Self::Mat4 => 16,
        }
    }
}

/// How corners make shapes (glTF 2.0, 3.7.2.1).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum PrimitiveMode {
    Points,
    Lines,
    Triangles,
    TriangleStrip,
    TriangleFan,
}

fn component_type<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<ComponentType>, D::Error> {
    Ok(match u64::deserialize(deserializer)? {
        5120 => Some(ComponentType::I8),
        5121 => Some(ComponentType::U8),
        5122 => Some(ComponentType::I16),
        5123 => Some(ComponentType::U16),
        5125 => Some(ComponentType::U32),
        5126 => Some(ComponentType::F32),
        _ => None,
    })
}

fn element_type<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<ElementType>, D::Error> {
    Ok(match String::deserialize(deserializer)?.as_str() {
        "SCALAR" => Some(ElementType::Scalar),
        "VEC2" => Some(ElementType::Vec2),
        "VEC3" => Some(ElementType::Vec3),
        "VEC4" => Some(ElementType::Vec4),
        "MAT2" => Some(ElementType::Mat2),
        "MAT3" => Some(ElementType::Mat3),
        "MAT4" => Some(ElementType::Mat4),
        _ => None,
    })
}

fn triangles() -> Option<PrimitiveMode> {
    Some(PrimitiveMode::Triangles)
}

fn primitive_mode<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<PrimitiveMode>, D::Error> {
    Ok(match u64::deserialize(deserializer)? {
        0 => Some(PrimitiveMode::Points),
        1..=3 => Some(PrimitiveMode::Lines),
        4 => Some(PrimitiveMode::Triangles),
        5 => Some(PrimitiveMode::TriangleStrip),
        6 => Some(PrimitiveMode::TriangleFan),
        _ => None,
    })
}
