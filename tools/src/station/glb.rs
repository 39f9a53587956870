//! A station as a binary glTF 2.0 container (.glb): JSON chunk, then one binary chunk.

use serde_json::{Value, json};

use crate::layout::{Node, Station};
use crate::material::Material;
use crate::mesh::{Mesh, Surface};

/// glTF's code for a 32-bit unsigned integer.
const UNSIGNED_INT: u32 = 5125;
/// glTF's code for a 32-bit float.
const FLOAT: u32 = 5126;
/// glTF's code for a buffer of vertex attributes.
const ARRAY_BUFFER: u32 = 34962;
/// glTF's code for a buffer of vertex indices.
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

/// The binary chunk in its three sections and the accessors into them.
#[derive(Default)]
struct Buffers {
    indices: Vec<u8>,
    positions: Vec<u8>,
    normals: Vec<u8>,
    accessors: Vec<Value>,
}

impl Buffers {
    /// Adds an accessor and returns its index.
    fn accessor(&mut self, accessor: Value) -> usize {
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    /// Adds a surface and returns its glTF primitive.
    fn primitive(&mut self, surface: &Surface) -> Value {
        let index_offset = self.indices.len();
        for index in surface.triangles.as_flattened() {
            self.indices.extend(index.to_le_bytes());
        }
        let position_offset = self.positions.len();
        let (mut lower, mut upper) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
        for position in &surface.positions {
            for (axis, value) in position.as_vec3().to_array().into_iter().enumerate() {
                lower[axis] = lower[axis].min(value);
                upper[axis] = upper[axis].max(value);
                self.positions.extend(value.to_le_bytes());
            }
        }
        let normal_offset = self.normals.len();
        for normal in &surface.normals {
            for value in normal.as_vec3().to_array() {
                self.normals.extend(value.to_le_bytes());
            }
        }
        let vertices = surface.positions.len();
        let indices = self.accessor(json!({
            "bufferView": 0, "byteOffset": index_offset, "componentType": UNSIGNED_INT,
            "count": surface.triangles.len() * 3, "type": "SCALAR",
        }));
        let position = self.accessor(json!({
            "bufferView": 1, "byteOffset": position_offset, "componentType": FLOAT,
            "count": vertices, "type": "VEC3", "min": lower, "max": upper,
        }));
        let normal = self.accessor(json!({
            "bufferView": 2, "byteOffset": normal_offset, "componentType": FLOAT, "count": vertices, "type": "VEC3",
        }));
        let material = Material::ALL.iter().position(|m| *m == surface.material);
        json!({ "attributes": { "POSITION": position, "NORMAL": normal }, "indices": indices, "material": material })
    }

    /// A glTF mesh.
    fn mesh(&mut self, name: &str, mesh: &Mesh) -> Value {
        let primitives: Vec<Value> = mesh.surfaces.iter().map(|s| self.primitive(s)).collect();
        json!({ "name": name, "primitives": primitives })
    }
}

/// Writes a node and what hangs on it to `nodes`, parents first, and returns its index.
fn write_node(node: &Node, nodes: &mut Vec<Value>) -> usize {
    let index = nodes.len();
    nodes.push(Value::Null);
    let children: Vec<usize> = node.children.iter().map(|child| write_node(child, nodes)).collect();
    let mut value = json!({ "name": node.name });
    if node.translation != glam::DVec3::ZERO {
        value["translation"] = json!(node.translation.to_array());
    }
    if let Some(mesh) = node.mesh {
        value["mesh"] = json!(mesh);
    }
    // glTF forbids empty arrays.
    if !children.is_empty() {
        value["children"] = json!(children);
    }
    nodes[index] = value;
    index
}

/// The glTF material of a thermal material.
fn write_material(material: Material) -> Value {
    let looks = material.appearance();
    let [red, green, blue] = looks.base_colour;
    let mut value = json!({
        "name": material.name(),
        "pbrMetallicRoughness": {
            "baseColorFactor": [red, green, blue, 1.0],
            "metallicFactor": looks.metallic,
            "roughnessFactor": looks.roughness,
        },
    });
    if material.is_sheet() {
        value["doubleSided"] = json!(true);
    }
    value
}

/// The bytes of the file.
pub fn write(station: &Station) -> Vec<u8> {
    let mut buffers = Buffers::default();
    let meshes: Vec<Value> = station.meshes.iter().map(|(name, mesh)| buffers.mesh(name, mesh)).collect();
    let mut nodes = vec![];
    let root = write_node(&station.root, &mut nodes);
    let materials: Vec<Value> = Material::ALL.iter().map(|m| write_material(*m)).collect();

    // All three sections hold 4-byte values, so that each starts aligned.
    let (indices, positions, normals) = (buffers.indices.len(), buffers.positions.len(), buffers.normals.len());
    let total = indices + positions + normals;
    let vertices = |offset: usize, length: usize| {
        let stride = 12;
        json!({
            "buffer": 0, "byteOffset": offset, "byteLength": length, "byteStride": stride, "target": ARRAY_BUFFER,
        })
    };
    let document = json!({
        "asset": { "version": "2.0", "generator": "isotherm-tools station" },
        "scene": 0,
        "scenes": [{ "name": "station", "nodes": [root] }],
        "nodes": nodes,
        "meshes": meshes,
        "materials": materials,
        "accessors": buffers.accessors,
        "bufferViews": [
            { "buffer": 0, "byteOffset": 0, "byteLength": indices, "target": ELEMENT_ARRAY_BUFFER },
            vertices(indices, positions),
            vertices(indices + positions, normals),
        ],
        "buffers": [{ "byteLength": total }],
    });
    let mut text = document.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');

    let mut file = Vec::with_capacity(28 + text.len() + total);
    file.extend(b"glTF");
    let lengths = [2, 28 + text.len() + total, text.len()];
    file.extend(lengths.into_iter().flat_map(|length| (length as u32).to_le_bytes()));
    file.extend(b"JSON");
    file.extend(&text);
    file.extend((total as u32).to_le_bytes());
    file.extend(b"BIN\0");
    for section in [&buffers.indices, &buffers.positions, &buffers.normals] {
        file.extend(section);
    }
    file
}
