//! A small craft for trials of whole runs.

use std::fs;
use std::path::Path;

/// Writes `craft.gltf` and `craft.bin` into a folder: a box with two wings and a mast.
///
/// # Errors
/// The folder cannot be written.
pub fn write_model(folder: &Path) -> std::io::Result<()> {
    let corner = |i: usize| [0, 1, 2].map(|axis| if i >> axis & 1 == 0 { -1.0f32 } else { 1.0 });
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let body: Vec<[f32; 3]> = faces.iter().flatten().map(|i| corner(*i)).collect();
    let plate = |x: f32, y: f32| vec![[-x, 0.0, 0.0], [x, 0.0, 0.0], [x, y, 0.0], [-x, y, 0.0]];
    let (mut bytes, mut views, mut accessors, mut meshes) = (Vec::<u8>::new(), Vec::new(), Vec::new(), Vec::new());
    for (material, positions) in [body, plate(1.0, 3.0), plate(0.2, 2.0)].into_iter().enumerate() {
        let quads = positions.len() as u16 / 4;
        let indices: Vec<u16> = (0..quads).flat_map(|quad| [0, 1, 2, 0, 2, 3].map(|i| 4 * quad + i)).collect();
        let parts = [
            (
                positions.iter().flatten().flat_map(|value| value.to_le_bytes()).collect::<Vec<u8>>(),
                5126,
                positions.len(),
            ),
            (indices.iter().flat_map(|index| index.to_le_bytes()).collect(), 5123, indices.len()),
        ];
        for (part, kind, count) in parts {
            views.push(serde_json::json!({"buffer": 0, "byteOffset": bytes.len(), "byteLength": part.len()}));
            let mut accessor =
                serde_json::json!({"bufferView": views.len() - 1, "componentType": kind, "count": count});
            accessor["type"] = if kind == 5126 { "VEC3" } else { "SCALAR" }.into();
            if kind == 5126 {
                let ends = |end: fn(f32, f32) -> f32| [0, 1, 2].map(|i| positions.iter().map(|p| p[i]).reduce(end));
                accessor["min"] = serde_json::json!(ends(f32::min));
                accessor["max"] = serde_json::json!(ends(f32::max));
            }
            accessors.push(accessor);
            bytes.extend(part);
            bytes.resize(bytes.len().next_multiple_of(4), 0);
        }
        let primitive = serde_json::json!({
            "attributes": {"POSITION": accessors.len() - 2}, "indices": accessors.len() - 1, "material": material
        });
        meshes.push(serde_json::json!({"primitives": [primitive]}));
    }
    let model = serde_json::json!({
        "asset": {"version": "2.0"},
        "buffers": [{"uri": "craft.bin", "byteLength": bytes.len()}],
        "bufferViews": views,
        "accessors": accessors,
        "meshes": meshes,
        "materials": [{"name": "skin"}, {"name": "cells"}, {"name": "mast"}],
        "nodes": [
            {"name": "body", "mesh": 0},
            {"name": "wing_port", "mesh": 1, "translation": [0, -4.5, 0]},
            {"name": "wing_starboard", "mesh": 1, "translation": [0, 1.5, 0]},
            {"name": "mast", "mesh": 2, "translation": [0, 0, 1]},
        ],
        "scenes": [{"nodes": [0, 1, 2, 3]}],
        "scene": 0,
    });
    fs::write(folder.join("craft.bin"), bytes)?;
    fs::write(folder.join("craft.gltf"), model.to_string())
}
