//! Makes small glTF files from JSON and bytes.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};

/// A document with one buffer that grows as accessors are added.
pub struct Maker {
    pub json: Value,
    pub binary: Vec<u8>,
}

/// Corners of the cube [-1, 1]^3, vertex index = 4 x + 2 y + z.
pub fn cube_corners() -> Vec<[f32; 3]> {
    (0..8u8).map(|corner| [4, 2, 1].map(|bit| if corner & bit == 0 { -1.0 } else { 1.0 })).collect()
}

/// Its twelve triangles, wound outwards.
pub const CUBE_TRIANGLES: [u8; 36] =
    [0, 1, 3, 0, 3, 2, 4, 6, 7, 4, 7, 5, 0, 4, 5, 0, 5, 1, 2, 3, 7, 2, 7, 6, 0, 2, 6, 0, 6, 4, 1, 5, 7, 1, 7, 3];

impl Maker {
    /// A document with an empty scene.
    pub fn new() -> Self {
        let json = json!({
            "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"name": "body", "mesh": 0}],
            "meshes": [], "materials": [], "accessors": [], "bufferViews": [], "buffers": [{"byteLength": 0}]
        });
        Self { json, binary: Vec::new() }
    }

    /// The cube as one node with one indexed primitive: accessor 0 positions, 1 indices.
    pub fn cube() -> Self {
        let mut maker = Self::new();
        let positions = maker.floats(&cube_corners());
        let indices = maker.accessor(&CUBE_TRIANGLES, json!({"componentType": 5121, "count": 36, "type": "SCALAR"}));
        maker.primitive(json!({"attributes": {"POSITION": positions}, "indices": indices, "mode": 4}));
        maker
    }

    /// A buffer view on these bytes.
    pub fn view(&mut self, bytes: &[u8]) -> usize {
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        let offset = self.binary.len();
        self.binary.extend_from_slice(bytes);
        self.json["buffers"][0]["byteLength"] = json!(self.binary.len());
        self.push("bufferViews", json!({"buffer": 0, "byteOffset": offset, "byteLength": bytes.len()}))
    }

    /// An accessor of these bytes, with a buffer view of its own.
    pub fn accessor(&mut self, bytes: &[u8], mut fields: Value) -> usize {
        fields["bufferView"] = json!(self.view(bytes));
        self.push("accessors", fields)
    }

    /// An accessor of f32 vectors.
    pub fn floats(&mut self, vectors: &[[f32; 3]]) -> usize {
        let bytes: Vec<u8> = vectors.as_flattened().iter().flat_map(|value| value.to_le_bytes()).collect();
        self.accessor(&bytes, json!({"componentType": 5126, "count": vectors.len(), "type": "VEC3"}))
    }

    /// The `sparse` object of an accessor: indices of a component type in one buffer view, values in another.
    pub fn sparse(count: u64, indices: usize, component: u32, values: usize) -> Value {
        json!({
            "count": count,
            "indices": {"bufferView": indices, "componentType": component},
            "values": {"bufferView": values}
        })
    }

    /// A mesh with this primitive.
    pub fn primitive(&mut self, primitive: Value) -> usize {
        self.push("meshes", json!({"primitives": [primitive]}))
    }

    /// Appends to an array of the document; returns the index.
    pub fn push(&mut self, key: &str, value: Value) -> usize {
        let array = self.json[key].as_array_mut().unwrap();
        array.push(value);
        array.len() - 1
    }

    /// The bytes of a GLB file.
    pub fn glb(&self) -> Vec<u8> {
        let mut text = serde_json::to_vec(&self.json).unwrap();
        text.resize(text.len().next_multiple_of(4), b' ');
        let mut binary = self.binary.clone();
        binary.resize(binary.len().next_multiple_of(4), 0);
        let length = 12 + 8 + text.len() + 8 + binary.len();
        let word = |value: usize| (value as u32).to_le_bytes();
        [
            &b"glTF"[..],
            &word(2),
            &word(length),
            &word(text.len()),
            b"JSON",
            &text,
            &word(binary.len()),
            b"BIN\0",
            &binary,
        ]
        .concat()
    }

    /// Writes the GLB file into a folder.
    pub fn save(&self, folder: &Path) -> PathBuf {
        let path = folder.join("made.glb");
        std::fs::write(&path, self.glb()).unwrap();
        path
    }
}
