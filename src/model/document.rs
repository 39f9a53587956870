//! Parses the JSON of a glTF file into typed values. Errors name the element.

use std::collections::BTreeMap;

use serde::Deserialize;
use serde::de::{DeserializeOwned, IgnoredAny, MapAccess, Visitor};
use serde_json::value::RawValue;
use serde_json::{Map, Value};

use super::elements::{Accessor, BufferView, GltfMesh};
use super::error::{counted, label};
use super::format::GLTF_1;
use super::meshopt::{Compressed, StreamKind};
use super::meshopt_filter::Filter;
use super::{ModelFault, ModelMaterial, Skipped};
use crate::text::plain;

/// Prefix of isotherm's `extras` keys. Blender writes custom properties this way.
const EXTRAS_PREFIX: &str = "isotherm_";

/// Extensions that a file may require, because they move no triangle.
const HARMLESS_EXTENSIONS: &[&str] = &[
    "EXT_lights_image_based",
    "EXT_texture_avif",
    "EXT_texture_webp",
    "KHR_animation_pointer",
    "KHR_lights_punctual",
    "KHR_texture_basisu",
    "KHR_texture_transform",
    "KHR_xmp",
    "KHR_xmp_json_ld",
    "MSFT_texture_dds",
];
/// Prefix of extensions that only change the appearance.
const MATERIAL_EXTENSIONS: &str = "KHR_materials_";
/// Integer positions and normals.
const QUANTIZATION: &str = "KHR_mesh_quantization";
/// Copies of a mesh.
const INSTANCING: &str = "EXT_mesh_gpu_instancing";
/// Compressed buffer views.
const MESHOPT: &str = "EXT_meshopt_compression";
const SUPPORTED: &[&str] = &[QUANTIZATION, INSTANCING, MESHOPT];
/// Extensions of compressed geometry that are not read. A tool can undo the compression.
const COMPRESSION: &[&str] = &["KHR_draco_mesh_compression", "KHR_meshopt_compression"];

/// A node. Transforms in f32 would be micrometres off on a station.
#[derive(Debug, Default, Deserialize)]
#[serde(expecting = "struct Node")]
pub(super) struct GltfNode {
    pub(crate) name: Option<String>,
    pub(crate) mesh: Option<usize>,
    #[serde(default)]
    pub(crate) children: Vec<usize>,
    /// Column-major transform, which replaces the three fields below.
    pub(crate) matrix: Option<[f64; 16]>,
    /// Translation [m].
    pub(crate) translation: Option<[f64; 3]>,
    /// Unit quaternion, scalar last.
    pub(crate) rotation: Option<[f64; 4]>,
    pub(crate) scale: Option<[f64; 3]>,
    #[serde(default)]
    extensions: NodeExtensions,
}

#[derive(Debug, Default, Deserialize)]
struct NodeExtensions {
    #[serde(rename = "EXT_mesh_gpu_instancing")]
    copies: Option<Copies>,
}

#[derive(Debug, Deserialize)]
struct Copies {
    /// Accessors of the places.
    attributes: BTreeMap<String, usize>,
}

impl GltfNode {
    /// Accessors of the places of the copies of its mesh, by attribute. `None` where it has its mesh once.
    pub(crate) fn copies(&self) -> Option<&BTreeMap<String, usize>> {
        self.extensions.copies.as_ref().map(|copies| &copies.attributes)
    }
}

#[derive(Debug, Default, Deserialize)]
#[serde(expecting = "struct Scene")]
pub(super) struct GltfScene {
    pub name: Option<String>,
    #[serde(default)]
    pub(crate) nodes: Vec<usize>,
}

/// A buffer. The URI stays JSON text, because a data URI can have gigabytes.
pub(super) struct GltfBuffer<'a> {
    pub(crate) name: Option<String>,
    pub(crate) uri: Option<&'a RawValue>,
    pub(crate) byte_length: u64,
    /// Whether it only stands for decoded bytes, and has none of its own.
    pub(crate) is_fallback: bool,
}

/// The used part of a glTF document. Indices are unchecked.
pub(super) struct Document<'a> {
    pub(crate) accessors: Vec<Accessor>,
    pub(crate) views: Vec<BufferView>,
    pub(crate) compressed: Vec<Option<Compressed>>,
    pub(crate) buffers: Vec<GltfBuffer<'a>>,
    pub(crate) meshes: Vec<GltfMesh>,
    pub(crate) nodes: Vec<GltfNode>,
    pub(crate) scenes: Vec<GltfScene>,
    pub(crate) materials: Vec<ModelMaterial>,
    /// Unchecked animations. An error only matters if a joint uses one.
    pub(crate) animations: Vec<Value>,
    pub(crate) default_scene: usize,
    /// Whether `KHR_mesh_quantization` is declared, which allows integer positions and normals.
    pub(crate) quantized: bool,
    pub(crate) skipped: Vec<Skipped>,
}

impl<'a> Document<'a> {
    /// Parses the JSON text. Refuses glTF versions other than 2 and unsupported required extensions.
    pub(crate) fn parse(json: &'a [u8]) -> Result<Self, ModelFault> {
        let Root { values: root, buffers } = serde_json::from_slice(json).map_err(ModelFault::Json)?;
        check_version(&root)?;
        let used = strings(&root, "extensionsUsed")?;
        let required = strings(&root, "extensionsRequired")?;
        check_required(&required)?;
        let default_scene = match root.get("scene") {
            None => 0,
            Some(scene) => index_of(scene)
                .ok_or_else(|| ModelFault::element("scene", format!("{scene} is not the index of a scene")))?,
        };
        Ok(Self {
            accessors: elements(&root, "accessors", "accessor")?,
            views: elements(&root, "bufferViews", "buffer view")?,
            compressed: compressed(&root)?,
            buffers: read_buffers(buffers)?,
            meshes: elements(&root, "meshes", "mesh")?,
            nodes: elements(&root, "nodes", "node")?,
            scenes: elements(&root, "scenes", "scene")?,
            materials: array(&root, "materials")?.iter().enumerate().map(material).collect(),
            animations: array(&root, "animations")?.to_vec(),
            default_scene,
            quantized: used.iter().chain(&required).any(|name| name == QUANTIZATION),
            skipped: unused(&root, &used)?,
        })
    }

    /// `node 5 "name"`.
    pub(crate) fn node_label(&self, index: usize) -> String {
        label("node", index, self.nodes.get(index).and_then(|node| node.name.as_deref()))
    }

    /// `accessor 3 "name"`.
    pub(crate) fn accessor_label(&self, index: usize) -> String {
        label("accessor", index, self.accessors.get(index).and_then(|accessor| accessor.name.as_deref()))
    }
}

/// The root of the document. Members that are not read are not kept, and buffers stay text.
struct Root<'a> {
    values: Map<String, Value>,
    buffers: Option<&'a RawValue>,
}

/// Keys of the root with images and their like, which a file can hold as text of gigabytes.
const UNREAD: &[&str] = &["images", "textures", "samplers", "extras"];

impl<'de> Deserialize<'de> for Root<'de> {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_map(RootVisitor)
    }
}

struct RootVisitor;

impl<'de> Visitor<'de> for RootVisitor {
    type Value = Root<'de>;

    fn expecting(&self, formatter: &mut std::fmt::Formatter) -> std::fmt::Result {
        formatter.write_str("a map")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Root<'de>, A::Error> {
        let mut root = Root { values: Map::new(), buffers: None };
        while let Some(key) = map.next_key::<String>()? {
            if key == "buffers" {
                root.buffers = Some(map.next_value()?);
            } else if UNREAD.contains(&key.as_str()) {
                map.next_value::<IgnoredAny>()?;
            } else {
                let mut value = map.next_value()?;
                whole_numbers(&mut value);
                root.values.insert(key, value);
            }
        }
        Ok(root)
    }
}

/// Most digits of a whole number that an f64 holds exactly.
const EXACT: f64 = 9_007_199_254_740_992.0;

/// Turns `1.0` into `1` everywhere, since JSON knows one kind of number (glTF 2.0, 2.4) and some writers always add the point.
fn whole_numbers(value: &mut Value) {
    match value {
        Value::Array(items) => items.iter_mut().for_each(whole_numbers),
        Value::Object(items) => items.values_mut().for_each(whole_numbers),
        Value::Number(number) if number.is_f64() => {
            let whole = number
                .as_f64()
                .filter(|f| f.fract() == 0.0 && f.abs() <= EXACT && !(*f == 0.0 && f.is_sign_negative()));
            if let Some(whole) = whole {
                *value = Value::from(whole as i64);
            }
        }
        _ => {}
    }
}

#[derive(Deserialize)]
struct StatedBuffer<'a> {
    #[serde(borrow)]
    uri: Option<&'a RawValue>,
    #[serde(rename = "byteLength")]
    byte_length: Option<Value>,
    name: Option<Value>,
    extensions: Option<Value>,
}

fn read_buffers(text: Option<&RawValue>) -> Result<Vec<GltfBuffer<'_>>, ModelFault> {
    let Some(text) = text else { return Ok(Vec::new()) };
    let all: Vec<&RawValue> =
        serde_json::from_str(text.get()).map_err(|_| ModelFault::element("buffers", "is not an array"))?;
    all.into_iter().enumerate().map(|(index, text)| read_buffer(index, text)).collect()
}

fn read_buffer(index: usize, text: &RawValue) -> Result<GltfBuffer<'_>, ModelFault> {
    let stated: StatedBuffer = serde_json::from_str(text.get())
        .map_err(|error| ModelFault::element(label("buffer", index, None), error.to_string()))?;
    let name = stated.name.as_ref().and_then(Value::as_str).map(str::to_owned);
    let mut length = stated.byte_length.unwrap_or_default();
    whole_numbers(&mut length);
    let byte_length = length.as_u64().ok_or_else(|| {
        let problem = format!("byteLength is to be a whole number of bytes, found {length}");
        ModelFault::element(label("buffer", index, name.as_deref()), problem)
    })?;
    let fallback = stated.extensions.as_ref().and_then(|all| all.get(MESHOPT)?.get("fallback")?.as_bool());
    Ok(GltfBuffer { name, uri: stated.uri, byte_length, is_fallback: fallback == Some(true) })
}

/// The compressed buffer view of the extension.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct StatedCompression {
    buffer: usize,
    #[serde(default)]
    byte_offset: u64,
    byte_length: u64,
    byte_stride: usize,
    count: usize,
    mode: String,
    filter: Option<String>,
}

fn compressed(root: &Map<String, Value>) -> Result<Vec<Option<Compressed>>, ModelFault> {
    let read = |(index, view): (usize, &Value)| {
        let Some(stated) = view.get("extensions").and_then(|all| all.get(MESHOPT)) else { return Ok(None) };
        let fail = |problem: String| {
            ModelFault::element(label("buffer view", index, view.get("name").and_then(Value::as_str)), problem)
        };
        let stated = StatedCompression::deserialize(stated).map_err(|error| fail(format!("{MESHOPT}: {error}")))?;
        let mode = match stated.mode.as_str() {
            "ATTRIBUTES" => StreamKind::Attributes,
            "TRIANGLES" => StreamKind::Triangles,
            "INDICES" => StreamKind::Indices,
            other => return Err(fail(format!("{MESHOPT}: mode {other:?} is not supported"))),
        };
        let filter = match stated.filter.as_deref() {
            None | Some("NONE") => Filter::None,
            Some("OCTAHEDRAL") => Filter::Octahedral,
            Some("QUATERNION") => Filter::Quaternion,
            Some("EXPONENTIAL") => Filter::Exponential,
            Some(other) => return Err(fail(format!("{MESHOPT}: filter {other:?} is not supported"))),
        };
        let StatedCompression { buffer, byte_offset: offset, byte_length: length, byte_stride: stride, count, .. } =
            stated;
        Ok(Some(Compressed { buffer, offset, length, stride, count, mode, filter }))
    };
    array(root, "bufferViews")?.iter().enumerate().map(read).collect()
}

fn check_version(root: &Map<String, Value>) -> Result<(), ModelFault> {
    let asset =
        root.get("asset").ok_or_else(|| ModelFault::element("asset", "is absent, so this is no glTF 2.0 file"))?;
    for (key, wanted) in [("version", "2."), ("minVersion", "2.0")] {
        match asset.get(key).and_then(Value::as_str) {
            Some(version) if version.starts_with(wanted) => {}
            None if key == "minVersion" => {}
            Some(version) if version.starts_with("1.") => return Err(ModelFault::Format(GLTF_1)),
            Some(version) => {
                return Err(ModelFault::element("asset", format!("{key} {version:?} is not supported, only 2.0 is")));
            }
            None => return Err(ModelFault::element("asset", format!("{key} is absent"))),
        }
    }
    Ok(())
}

fn check_required(required: &[String]) -> Result<(), ModelFault> {
    let names: Vec<String> =
        required.iter().filter(|name| !SUPPORTED.contains(&name.as_str()) && !is_harmless(name)).cloned().collect();
    if names.is_empty() {
        return Ok(());
    }
    let advice = if names.iter().any(|name| COMPRESSION.contains(&name.as_str())) {
        "; write the file again without compression, for example with `gltf-transform copy IN.glb OUT.glb`"
    } else {
        ""
    };
    Err(ModelFault::ExtensionsRequired { names, advice: advice.to_owned() })
}

fn is_harmless(extension: &str) -> bool {
    extension.starts_with(MATERIAL_EXTENSIONS) || HARMLESS_EXTENSIONS.contains(&extension)
}

/// The contents beyond geometry and material names.
fn unused(root: &Map<String, Value>, used: &[String]) -> Result<Vec<Skipped>, ModelFault> {
    let mut skipped = Vec::new();
    let mut skip = |count: usize, noun: &str, why: &str| {
        if count > 0 {
            skipped.push(Skipped { what: counted(count, noun), why: why.to_owned() });
        }
    };
    skip(array(root, "cameras")?.len(), "camera", "the scene file describes the camera");
    let lights = root.get("extensions").and_then(|all| all.get("KHR_lights_punctual")?.get("lights")?.as_array());
    skip(lights.map_or(0, Vec::len), "light", "the scene file describes what heats the craft");
    skip(
        array(root, "animations")?.len(),
        "animation",
        "the nodes stay as their transforms place them, unless a [[joint]] of a scene plays it",
    );
    skip(array(root, "skins")?.len(), "skin", "skinned meshes stay as their nodes place them");
    let others = array(root, "scenes")?.len().saturating_sub(1);
    skip(others, "other scene", "only the default scene is drawn");
    for name in used.iter().filter(|name| !SUPPORTED.contains(&name.as_str()) && *name != "KHR_lights_punctual") {
        let why =
            if is_harmless(name) { "moves no triangle" } else { "not supported, and the file does not require it" };
        skipped.push(Skipped { what: format!("extension {name}"), why: why.to_owned() });
    }
    Ok(skipped)
}

/// Name, `extras` and base colour of a material. Textures are not read.
fn material((index, value): (usize, &Value)) -> ModelMaterial {
    let name = match value.get("name").and_then(Value::as_str) {
        Some(name) if !name.is_empty() => plain(name).into_owned(),
        _ => format!("material_{index}"),
    };
    let extras = value.get("extras").and_then(Value::as_object).into_iter().flatten();
    let prefixed = extras.filter_map(|(key, value)| Some((key.strip_prefix(EXTRAS_PREFIX)?.to_owned(), value.clone())));
    ModelMaterial { name, extras: prefixed.collect::<BTreeMap<_, _>>(), colour: colour(value) }
}

/// `baseColorFactor` of a material without its opacity, where it is one.
fn colour(value: &Value) -> Option<[f64; 3]> {
    let factor = value.get("pbrMetallicRoughness")?.get("baseColorFactor")?.as_array()?;
    let mut colour = [0.0; 3];
    for (channel, value) in colour.iter_mut().zip(factor.get(..3)?) {
        *channel = value.as_f64().filter(|value| (0.0..=1.0).contains(value))?;
    }
    Some(colour)
}

/// The array under `key`, or an empty one if the key is missing.
fn array<'a>(root: &'a Map<String, Value>, key: &str) -> Result<&'a [Value], ModelFault> {
    match root.get(key) {
        None => Ok(&[]),
        Some(Value::Array(values)) => Ok(values),
        Some(_) => Err(ModelFault::element(key, "is not an array")),
    }
}

fn elements<T: DeserializeOwned>(root: &Map<String, Value>, key: &str, kind: &str) -> Result<Vec<T>, ModelFault> {
    let read = |(index, value): (usize, &Value)| {
        T::deserialize(value).map_err(|error| {
            ModelFault::element(label(kind, index, value.get("name").and_then(Value::as_str)), error.to_string())
        })
    };
    array(root, key)?.iter().enumerate().map(read).collect()
}

fn strings(root: &Map<String, Value>, key: &str) -> Result<Vec<String>, ModelFault> {
    let text = |value: &Value| value.as_str().map(str::to_owned);
    let all: Option<Vec<String>> = array(root, key)?.iter().map(text).collect();
    all.ok_or_else(|| ModelFault::element(key, "holds something that is not a name"))
}

fn index_of(value: &Value) -> Option<usize> {
    usize::try_from(value.as_u64()?).ok()
}
