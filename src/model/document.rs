//! Parses the JSON of a glTF file into typed values. Errors name the element.

use std::collections::BTreeMap;

use gltf::json::{Accessor, Buffer, Mesh, buffer::View};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};

use super::error::{counted, label};
use super::{Fault, ModelMaterial, Skipped};

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
/// The only extension whose geometry is supported.
const QUANTIZATION: &str = "KHR_mesh_quantization";
/// Extensions of compressed geometry, with the tools that undo the compression.
const COMPRESSION: &[&str] = &["EXT_meshopt_compression", "KHR_draco_mesh_compression", "KHR_meshopt_compression"];

/// A node. The type of the `gltf` crate has f32 transforms, which would be micrometres off on a station.
#[derive(Debug, Default, Deserialize)]
pub(super) struct Node {
    pub name: Option<String>,
    /// Index of its mesh.
    pub mesh: Option<usize>,
    #[serde(default)]
    pub children: Vec<usize>,
    /// Column-major transform. It replaces the three fields below.
    pub matrix: Option<[f64; 16]>,
    /// Translation [m].
    pub translation: Option<[f64; 3]>,
    /// Unit quaternion, scalar last.
    pub rotation: Option<[f64; 4]>,
    pub scale: Option<[f64; 3]>,
}

/// A glTF scene.
#[derive(Debug, Default, Deserialize)]
pub(super) struct Scene {
    pub name: Option<String>,
    #[serde(default)]
    pub nodes: Vec<usize>,
}

/// The used part of a glTF document. Its indices are unchecked.
pub(super) struct Document {
    pub accessors: Vec<Accessor>,
    pub views: Vec<View>,
    pub buffers: Vec<Buffer>,
    pub meshes: Vec<Mesh>,
    pub nodes: Vec<Node>,
    pub scenes: Vec<Scene>,
    pub materials: Vec<ModelMaterial>,
    /// Unchecked animations. An error only matters if a joint uses one.
    pub animations: Vec<Value>,
    /// Index of the default scene, or of the first one.
    pub default_scene: usize,
    /// Whether `KHR_mesh_quantization` is declared. It allows integer positions and normals.
    pub quantized: bool,
    /// The unused contents of the document.
    pub skipped: Vec<Skipped>,
}

impl Document {
    /// Parses the JSON text. It refuses glTF versions other than 2 and unsupported required extensions.
    pub fn parse(json: &[u8]) -> Result<Self, Fault> {
        let root: Map<String, Value> = serde_json::from_slice(json).map_err(Fault::Json)?;
        check_version(&root)?;
        let used = strings(&root, "extensionsUsed")?;
        let required = strings(&root, "extensionsRequired")?;
        check_required(&required)?;
        let default_scene = match root.get("scene") {
            None => 0,
            Some(scene) => index_of(scene)
                .ok_or_else(|| Fault::element("scene", format!("{scene} is not the index of a scene")))?,
        };
        Ok(Self {
            accessors: elements(&root, "accessors", "accessor")?,
            views: elements(&root, "bufferViews", "buffer view")?,
            buffers: elements(&root, "buffers", "buffer")?,
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
    pub fn node_label(&self, index: usize) -> String {
        label("node", index, self.nodes.get(index).and_then(|node| node.name.as_deref()))
    }

    /// `accessor 3 "name"`.
    pub fn accessor_label(&self, index: usize) -> String {
        label("accessor", index, self.accessors.get(index).and_then(|accessor| accessor.name.as_deref()))
    }
}

fn check_version(root: &Map<String, Value>) -> Result<(), Fault> {
    let asset = root.get("asset").ok_or_else(|| Fault::element("asset", "is absent, so this is no glTF 2.0 file"))?;
    for (key, wanted) in [("version", "2."), ("minVersion", "2.0")] {
        match asset.get(key).and_then(Value::as_str) {
            Some(version) if version.starts_with(wanted) => {}
            None if key == "minVersion" => {}
            Some(version) => {
                return Err(Fault::element("asset", format!("{key} {version:?} is not supported, only 2.0 is")));
            }
            None => return Err(Fault::element("asset", format!("{key} is absent"))),
        }
    }
    Ok(())
}

fn check_required(required: &[String]) -> Result<(), Fault> {
    let names: Vec<String> =
        required.iter().filter(|name| *name != QUANTIZATION && !is_harmless(name)).cloned().collect();
    if names.is_empty() {
        return Ok(());
    }
    let advice = if names.iter().any(|name| COMPRESSION.contains(&name.as_str())) {
        "; write the file again without compression, for example with `gltf-transform copy IN.glb OUT.glb`"
    } else {
        ""
    };
    Err(Fault::ExtensionsRequired { names, advice: advice.to_owned() })
}

fn is_harmless(extension: &str) -> bool {
    extension.starts_with(MATERIAL_EXTENSIONS) || HARMLESS_EXTENSIONS.contains(&extension)
}

/// The contents beyond geometry and material names.
fn unused(root: &Map<String, Value>, used: &[String]) -> Result<Vec<Skipped>, Fault> {
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
    for name in used.iter().filter(|name| *name != QUANTIZATION && *name != "KHR_lights_punctual") {
        let why =
            if is_harmless(name) { "moves no triangle" } else { "not supported, and the file does not require it" };
        skipped.push(Skipped { what: format!("extension {name}"), why: why.to_owned() });
    }
    Ok(skipped)
}

/// Name and `extras` of a material. Its appearance is not read.
fn material((index, value): (usize, &Value)) -> ModelMaterial {
    let name = match value.get("name").and_then(Value::as_str) {
        Some(name) if !name.is_empty() => name.to_owned(),
        _ => format!("material_{index}"),
    };
    let extras = value.get("extras").and_then(Value::as_object).into_iter().flatten();
    let own = extras.filter_map(|(key, value)| Some((key.strip_prefix(EXTRAS_PREFIX)?.to_owned(), value.clone())));
    ModelMaterial { name, extras: own.collect::<BTreeMap<_, _>>() }
}

/// The array under `key`. It is empty if the key is missing.
fn array<'a>(root: &'a Map<String, Value>, key: &str) -> Result<&'a [Value], Fault> {
    match root.get(key) {
        None => Ok(&[]),
        Some(Value::Array(values)) => Ok(values),
        Some(_) => Err(Fault::element(key, "is not an array")),
    }
}

fn elements<T: DeserializeOwned>(root: &Map<String, Value>, key: &str, kind: &str) -> Result<Vec<T>, Fault> {
    let read = |(index, value): (usize, &Value)| {
        T::deserialize(value).map_err(|error| {
            Fault::element(label(kind, index, value.get("name").and_then(Value::as_str)), error.to_string())
        })
    };
    array(root, key)?.iter().enumerate().map(read).collect()
}

fn strings(root: &Map<String, Value>, key: &str) -> Result<Vec<String>, Fault> {
    let text = |value: &Value| value.as_str().map(str::to_owned);
    let all: Option<Vec<String>> = array(root, key)?.iter().map(text).collect();
    all.ok_or_else(|| Fault::element(key, "holds something that is not a name"))
}

fn index_of(value: &Value) -> Option<usize> {
    usize::try_from(value.as_u64()?).ok()
}
