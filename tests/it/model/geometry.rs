//! The loader and legal but unusual geometry.

use glam::{DVec3, Vec3};
use isotherm::internals::Model;
use serde_json::json;

use super::make::{CUBE_TRIANGLES, Maker, cube_corners};
use super::{check_promises, volume};

fn load(maker: &Maker) -> Model {
    let folder = tempfile::tempdir().unwrap();
    let model = Model::load(&maker.save(folder.path())).unwrap();
    check_promises(&model);
    model
}

fn assert_cube(model: &Model) {
    assert_eq!(model.triangles.len(), 12);
    assert!((model.area() - 24.0).abs() < 1e-12, "area {}", model.area());
    assert!((volume(model) - 8.0).abs() < 1e-12, "volume {}", volume(model));
    assert_eq!(model.bounds(), [DVec3::NEG_ONE, DVec3::ONE]);
}

#[test]
fn sparse_values_replace_those_of_the_buffer_view() {
    let mut maker = Maker::cube();
    // The base has corners 3 and 6 at the origin. The sparse values correct them.
    maker.binary[36..48].fill(0);
    maker.binary[72..84].fill(0);
    let indices = maker.view(&[3, 0, 6, 0]);
    let corners: Vec<u8> = [3, 6].iter().flat_map(|at| cube_corners()[*at]).flat_map(f32::to_le_bytes).collect();
    let values = maker.view(&corners);
    assert!((load(&maker).area() - 24.0).abs() > 0.1, "without the sparse entries it is no cube");
    maker.json["accessors"][0]["sparse"] = Maker::sparse(2, indices, 5123, values);
    assert_cube(&load(&maker));
}

#[test]
fn sparse_accessor_without_buffer_view_starts_from_zeros() {
    let mut maker = Maker::new();
    let indices = maker.view(&[1, 2]);
    let values: Vec<u8> = [1.0f32, 0.0, 0.0, 0.0, 2.0, 0.0].iter().flat_map(|value| value.to_le_bytes()).collect();
    let values = maker.view(&values);
    let sparse = Maker::sparse(2, indices, 5121, values);
    maker.push("accessors", json!({"componentType": 5126, "count": 3, "type": "VEC3", "sparse": sparse}));
    maker.primitive(json!({"attributes": {"POSITION": 0}}));
    assert_eq!(load(&maker).area(), 1.0);
}

/// The cube in each component type of KHR_mesh_quantization, scaled back to [-1, 1] by its node.
#[test]
fn quantized_positions() {
    // Component type, normalized, stored values of -1 and +1, and the node scale and translation that undo it.
    let cases: [(u32, bool, [i32; 2], f64, f64); 8] = [
        (5120, false, [-100, 100], 0.01, 0.0),
        (5120, true, [-127, 127], 1.0, 0.0),
        (5121, false, [0, 200], 0.01, -1.0),
        (5121, true, [0, 255], 2.0, -1.0),
        (5122, false, [-1000, 1000], 0.001, 0.0),
        (5122, true, [-32767, 32767], 1.0, 0.0),
        (5123, false, [0, 50000], 4e-5, -1.0),
        (5123, true, [0, 65535], 2.0, -1.0),
    ];
    for (component, normalized, stored, scale, shift) in cases {
        let mut maker = Maker::new();
        let size = if component < 5122 { 1 } else { 2 };
        // glTF requires strides that are multiples of four.
        let stride = if size == 1 { 4 } else { 8 };
        let mut bytes = Vec::new();
        for corner in cube_corners() {
            for value in corner {
                bytes.extend_from_slice(&stored[usize::from(value > 0.0)].to_le_bytes()[..size]);
            }
            bytes.resize(bytes.len().next_multiple_of(stride), 0xAA);
        }
        let fields = json!({"componentType": component, "normalized": normalized, "count": 8, "type": "VEC3"});
        let positions = maker.accessor(&bytes, fields);
        maker.json["bufferViews"][0]["byteStride"] = json!(stride);
        let indices = maker.accessor(&CUBE_TRIANGLES, json!({"componentType": 5121, "count": 36, "type": "SCALAR"}));
        maker.primitive(json!({"attributes": {"POSITION": positions}, "indices": indices}));
        maker.json["extensionsUsed"] = json!(["KHR_mesh_quantization"]);
        maker.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
        maker.json["nodes"][0]["scale"] = json!([scale, scale, scale]);
        maker.json["nodes"][0]["translation"] = json!([shift, shift, shift]);
        let model = load(&maker);
        assert!((model.area() - 24.0).abs() < 1e-9, "{component} {normalized}: area {}", model.area());
        assert!((model.bounds()[1] - 1.0).abs().max_element() < 1e-12, "{component} {normalized}");
    }
}

#[test]
fn quantized_normals_are_unit_vectors() {
    let mut maker = Maker::new();
    let positions = maker.floats(&[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    // -128 means -1, like -127 (glTF 2.0, 3.11). The third normal leans by 45 degrees.
    let bytes = [0u8, 0, 127, 0, 0, 0, 127, 0, 90, 0, 90, 0];
    let fields = json!({"componentType": 5120, "normalized": true, "count": 3, "type": "VEC3"});
    let normals = maker.accessor(&bytes, fields);
    maker.json["bufferViews"][1]["byteStride"] = json!(4);
    maker.json["extensionsUsed"] = json!(["KHR_mesh_quantization"]);
    maker.primitive(json!({"attributes": {"POSITION": positions, "NORMAL": normals}}));
    let model = load(&maker);
    assert_eq!(model.normals[0], Vec3::Z);
    assert!((model.normals[2] - Vec3::new(0.5f32.sqrt(), 0.0, 0.5f32.sqrt())).length() < 1e-6);
}

/// A plane at 45 degrees, stretched threefold along x. Its normal turns against the stretch.
#[test]
fn normals_follow_the_inverse_transpose() {
    let mut maker = Maker::new();
    let positions = maker.floats(&[[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 1.0]]);
    let lean = 0.5f32.sqrt();
    let normals = maker.floats(&[[lean, 0.0, lean]; 3]);
    maker.primitive(json!({"attributes": {"POSITION": positions, "NORMAL": normals}}));
    for scale in [[3.0, 1.0, 1.0], [-3.0, 1.0, 1.0], [-3.0, -1.0, 1.0], [-3.0, -1.0, -1.0]] {
        maker.json["nodes"][0]["scale"] = json!(scale);
        let model = load(&maker);
        let [x, _, z] = scale;
        let expected = DVec3::new(1.0 / x, 0.0, 1.0 / z).normalize();
        let found = model.normals[0].as_dvec3();
        assert!((found - expected).length() < 1e-6, "{scale:?}: {found} not {expected}");
        let [a, b, c] = model.triangles[0].map(|vertex| model.positions[vertex as usize]);
        assert!((b - a).cross(c - a).dot(expected) > 0.0, "{scale:?}: winding");
        let stretched = DVec3::new(x, 0.0, z).normalize();
        assert!((found - stretched).length() > 0.1, "{scale:?}: a normal that is stretched like a position");
    }
}

#[test]
fn triangles_without_normals_are_flat() {
    let model = load(&Maker::cube());
    assert_cube(&model);
    assert_eq!(model.positions.len(), 36);
    for (triangle, outward) in model.triangles.iter().zip(model.triangles.iter().map(|triangle| {
        let [a, b, c] = triangle.map(|vertex| model.positions[vertex as usize]);
        (b - a).cross(c - a).normalize()
    })) {
        assert!(triangle.iter().all(|vertex| model.normals[*vertex as usize].as_dvec3() == outward));
    }
    assert!(model.notes[0].contains("12 triangles of part body"), "{:?}", model.notes);
}

/// Normals that are zero or not finite become the area-weighted mean of the triangles around. At a cube corner the
/// split of the faces decides the direction.
#[test]
fn useless_normals_are_computed() {
    let mut maker = Maker::cube();
    let mut normals: Vec<[f32; 3]> = cube_corners();
    normals[0] = [0.0; 3];
    normals[7] = [f32::NAN, 0.0, 1.0];
    let normals = maker.floats(&normals);
    maker.json["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = json!(normals);
    let model = load(&maker);
    assert_cube(&model);
    assert_eq!(model.positions.len(), 8);
    assert!(model.notes[0].contains("2 vertices of part body"), "{:?}", model.notes);
    // At corners 0 and 7 two triangles of each face meet (CUBE_TRIANGLES), so all three faces count equally.
    for (position, normal) in model.positions.iter().zip(&model.normals) {
        assert!((normal.as_dvec3() - position.normalize()).length() < 1e-6, "{position}: {normal}");
    }
}

#[test]
fn slivers_stay_and_zero_areas_go() {
    let mut maker = Maker::new();
    let positions = maker.floats(&[
        [0.0, 0.0, 0.0],
        [52.0, 0.0, 0.0],
        [26.0, 1e-7, 0.0],
        // On a line.
        [0.1, 0.1, 0.1],
        [0.3, 0.3, 0.3],
        [0.7, 0.7, 0.7],
        // Two corners in one place.
        [1.0, 2.0, 3.0],
        [1.0, 2.0, 3.0],
        [5.0, 2.0, 3.0],
        // The area is below the smallest normal f32.
        [0.0, 0.0, 0.0],
        [1e-20, 0.0, 0.0],
        [0.0, 1e-20, 0.0],
    ]);
    maker.primitive(json!({"attributes": {"POSITION": positions}}));
    maker.json["nodes"][0]["rotation"] = json!([0.6, 0.0, 0.0, 0.8]);
    let model = load(&maker);
    assert_eq!((model.triangles.len(), model.positions.len()), (1, 3));
    assert!((model.area() / (26.0 * f64::from(1e-7f32)) - 1.0).abs() < 1e-9);
    assert_eq!(model.skipped[0].what, "3 triangles of part body");
}

#[test]
fn names_materials_and_extras() {
    let mut maker = Maker::cube();
    maker.json["materials"] = json!([
        {"name": "unused"},
        {"extras": {"isotherm_emissivity": 0.8, "isotherm_note": ["a", 1], "other": 2}},
        {"name": "steel", "alphaMode": "NONSENSE"}
    ]);
    let primitive = maker.json["meshes"][0]["primitives"][0].clone();
    let mut list = vec![primitive.clone(); 3];
    list[1]["material"] = json!(1);
    list[2]["material"] = json!(2);
    maker.json["meshes"][0]["primitives"] = json!(list);
    maker.json["nodes"] =
        json!([{"children": [1, 2, 3]}, {"mesh": 0, "name": "a"}, {"mesh": 0, "name": "a"}, {"mesh": 0}]);
    let model = load(&maker);
    let names: Vec<&str> = model.materials.iter().map(|material| material.name.as_str()).collect();
    assert_eq!(names, ["default", "material_1", "steel"]);
    let extras = &model.materials[1].extras;
    assert_eq!(extras.len(), 2);
    assert_eq!((&extras["emissivity"], &extras["note"]), (&json!(0.8), &json!(["a", 1])));
    let parts: Vec<&str> = model.parts.iter().map(|part| part.name.as_str()).collect();
    assert_eq!(parts, ["a", "a#2", "node_3"]);
    assert_eq!((model.gltf_nodes, model.triangles.len()), (4, 3 * 36));
}

/// Transforms are multiplied in f64: a large translation and its opposite cancel exactly.
#[test]
fn transforms_accumulate_in_f64() {
    let mut maker = Maker::cube();
    maker.json["nodes"] = json!([
        {"children": [1], "translation": [6_371_000.123_456_789, 0, 0]},
        {"children": [2], "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, -6_371_000.123_456_789, 0, 0, 1]},
        {"mesh": 0}
    ]);
    assert_cube(&load(&maker));
}

#[test]
fn a_deep_chain_of_nodes_is_walked() {
    let mut maker = Maker::cube();
    let depth = 20_000;
    let mut nodes: Vec<_> = (1..depth).map(|child| json!({"children": [child]})).collect();
    nodes.push(json!({"mesh": 0}));
    maker.json["nodes"] = json!(nodes);
    let model = load(&maker);
    assert_cube(&model);
    assert_eq!(model.gltf_nodes, depth);
}

#[test]
fn buffers_in_files_and_data_uris() {
    let maker = Maker::cube();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cube.gltf");
    std::fs::write(folder.path().join("with space.bin"), &maker.binary).unwrap();
    let percent: String = maker.binary.iter().map(|byte| format!("%{byte:02x}")).collect();
    for uri in
        ["with%20space.bin".to_owned(), "with space.bin".to_owned(), format!("data:application/gltf-buffer,{percent}")]
    {
        let mut json = maker.json.clone();
        json["buffers"][0]["uri"] = json!(uri);
        std::fs::write(&path, json.to_string()).unwrap();
        assert_cube(&Model::load(&path).unwrap());
    }
}
