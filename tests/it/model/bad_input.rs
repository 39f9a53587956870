//! Damaged and hostile files give an error with file and element, and never a panic.

use isotherm::internals::Model;
use serde_json::{Value, json};

use super::check_promises;
use super::make::Maker;
use super::shared_files::shared;

/// The error message after a change to the cube.
fn message(change: impl FnOnce(&mut Maker)) -> String {
    let mut maker = Maker::cube();
    change(&mut maker);
    let folder = tempfile::tempdir().unwrap();
    let message = Model::load(&maker.save(folder.path())).expect_err("a damaged file was loaded").to_string();
    assert!(message.contains("made.glb"), "{message}");
    message
}

#[test]
fn errors_name_the_element() {
    // Each case: a JSON pointer, the value put there, and the words of the message.
    let cases: &[(&str, Value, &[&str])] = &[
        ("/accessors/0/count", json!(9), &["accessor 0", "buffer view 0"]),
        ("/accessors/0/count", json!(u64::MAX), &["accessor 0"]),
        ("/accessors/0/count", json!(0), &["accessor 0", "count of 0"]),
        ("/accessors/0/count", json!(-1), &["accessor 0"]),
        ("/accessors/0/count", json!(7), &["accessor 1", "index 8 is 7"]),
        ("/accessors/0/type", json!("VEC2"), &["accessor 0", "Vec2"]),
        ("/accessors/0/type", json!("SPHERE"), &["accessor 0", "unknown type"]),
        ("/accessors/0/componentType", json!(5123), &["accessor 0", "KHR_mesh_quantization"]),
        ("/accessors/0/componentType", json!(5125), &["accessor 0", "POSITION"]),
        ("/accessors/0/componentType", json!(1), &["accessor 0", "component type"]),
        ("/accessors/0/bufferView", json!(7), &["accessor 0", "buffer view 7"]),
        ("/accessors/1/componentType", json!(5126), &["accessor 1", "32-bit floats"]),
        ("/accessors/1/componentType", json!(5120), &["accessor 1", "8-bit integers"]),
        ("/accessors/1/type", json!("VEC3"), &["accessor 1", "Vec3"]),
        ("/bufferViews/0/byteLength", json!(95), &["accessor 0", "buffer view 0"]),
        ("/bufferViews/0/byteOffset", json!(u64::MAX), &["accessor 0", "buffer view 0"]),
        ("/bufferViews/0/buffer", json!(3), &["buffer view 0", "buffer 3"]),
        ("/bufferViews/1/byteLength", json!(1000), &["buffer view 1", "buffer 0"]),
        ("/buffers/0/byteLength", json!(1000), &["buffer 0", "1000 bytes", "binary chunk"]),
        ("/meshes/0/primitives/0/attributes/POSITION", json!(9), &["accessor 9"]),
        ("/meshes/0/primitives/0/indices", json!(9), &["accessor 9"]),
        ("/meshes/0/primitives/0/mode", json!(9), &["primitive 0", "mode"]),
        ("/meshes/0/primitives", json!("none"), &["mesh 0"]),
        ("/nodes/0/mesh", json!(4), &["node 0 \"body\"", "mesh 4"]),
        ("/scene", json!(2), &["scene", "2"]),
        ("/scene", json!("first"), &["scene"]),
        ("/scenes/0/nodes/0", json!(5), &["scene 0", "node 5"]),
        ("/scenes", json!([]), &["nothing to draw", "no scene"]),
        ("/scenes/0/nodes", json!([0, 0]), &["scene 0", "twice"]),
        ("/scenes/0/nodes", json!([]), &["nothing to draw"]),
        ("/asset/version", json!("1.0"), &["glTF 1.0", "docs/cad.md"]),
        ("/asset", json!({}), &["asset", "version"]),
        ("/nodes", json!({}), &["nodes", "array"]),
        ("/meshes/0/primitives/0/attributes", json!({}), &["nothing to draw", "no positions"]),
    ];
    for (pointer, value, named) in cases {
        let message = message(|maker| *maker.json.pointer_mut(pointer).unwrap() = value.clone());
        assert!(named.iter().all(|name| message.contains(name)), "{pointer} = {value}: {message}");
    }
}

#[test]
fn transforms_are_checked() {
    let cases: &[(&str, Value, &str)] = &[
        ("rotation", json!([0, 0, 0, 0]), "length 0"),
        ("rotation", json!([1, 1, 1, 1]), "length 2"),
        ("matrix", json!([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 2]), "last row"),
        ("matrix", json!([1, 2, 3]), "16"),
        ("scale", json!([1e200, 1, 1]), "32-bit"),
        ("scale", json!([0, 0, 0]), "zero area"),
    ];
    for (key, value, named) in cases {
        let message = message(|maker| maker.json["nodes"][0][key] = value.clone());
        assert!(message.contains(named), "{key} = {value}: {message}");
    }
    let both = message(|maker| {
        maker.json["nodes"][0]["scale"] = json!([1, 1, 1]);
        maker.json["nodes"][0]["matrix"] = json!([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]);
    });
    assert!(both.contains("node 0 \"body\": has a matrix and also"), "{both}");
    let product = message(|maker| {
        maker.json["nodes"] = json!([{"children": [1], "scale": [1e200, 1, 1]}, {"mesh": 0, "scale": [1e200, 1, 1]}]);
    });
    assert!(product.contains("node 1: its transform"), "{product}");
}

#[test]
fn the_node_graph_is_checked() {
    let cases: &[(Value, &str)] = &[
        (json!([{"children": [0], "mesh": 0}]), "node 0: is its own ancestor"),
        (json!([{"children": [1], "mesh": 0}, {"children": [2]}, {"children": [0]}]), "cycle"),
        // A cycle outside the scene.
        (json!([{"mesh": 0}, {"children": [2]}, {"children": [1]}]), "cycle"),
        (json!([{"children": [1, 2]}, {"children": [3]}, {"children": [3]}, {"mesh": 0}]), "node 2: has child 3"),
        (json!([{"children": [1, 1]}, {"mesh": 0}]), "child of node 0 already"),
        (json!([{"children": [8], "mesh": 0}]), "has child 8"),
    ];
    for (nodes, named) in cases {
        let message = message(|maker| maker.json["nodes"] = nodes.clone());
        assert!(message.contains(named), "{nodes}: {message}");
    }
    let below = message(|maker| {
        maker.json["nodes"] = json!([{"children": [1]}, {"mesh": 0}]);
        maker.json["scenes"][0]["nodes"] = json!([0, 1]);
    });
    assert!(below.contains("scene 0: has root node 1, which is a child of node 0"), "{below}");
}

#[test]
fn values_must_be_finite() {
    for value in [f32::NAN, f32::INFINITY] {
        let message = message(|maker| maker.binary[16..20].copy_from_slice(&value.to_le_bytes()));
        assert!(message.contains("accessor 0: position 1 is not finite"), "{message}");
    }
}

#[test]
fn strides_and_sparse_entries_are_checked() {
    let stride = message(|maker| maker.json["bufferViews"][0]["byteStride"] = json!(8));
    assert!(stride.contains("accessor 0") && stride.contains("stride of 8"), "{stride}");
    let sparse = |count: u64, indices: [u8; 2]| {
        message(|maker| {
            let indices = maker.view(&indices);
            let values = maker.view(&[0; 24]);
            maker.json["accessors"][0]["sparse"] = Maker::sparse(count, indices, 5121, values);
        })
    };
    assert!(sparse(2, [3, 3]).contains("do not increase"));
    assert!(sparse(2, [3, 8]).contains("sparse index 8"));
    assert!(sparse(3, [3, 4]).contains("buffer view 2"));
    assert!(sparse(0, [3, 4]).contains("0 sparse values"));
    assert!(sparse(u64::MAX, [3, 4]).contains("sparse values"));
    let bomb = message(|maker| {
        let view = maker.view(&[0; 12]);
        maker.json["accessors"][0] = json!({
            "componentType": 5126, "type": "VEC3", "count": 4_000_000_000u64,
            "sparse": Maker::sparse(1, view, 5121, view)
        });
    });
    assert!(bomb.contains("accessor 0") && bomb.contains("takes too much memory"), "{bomb}");
}

#[test]
fn required_extensions() {
    let require = |names: Value| message(|maker| maker.json["extensionsRequired"] = names);
    let draco = require(json!(["KHR_mesh_quantization", "KHR_draco_mesh_compression"]));
    assert!(draco.contains("requires KHR_draco_mesh_compression,") && draco.contains("without compression"), "{draco}");
    let meshopt = require(json!(["EXT_meshopt_compression", "KHR_meshopt_compression", "EXT_mesh_gpu_instancing"]));
    assert!(
        meshopt.contains("requires KHR_meshopt_compression,") && meshopt.contains("without compression"),
        "{meshopt}"
    );
    assert!(require(json!([1])).contains("extensionsRequired"));
    let mut harmless = Maker::cube();
    harmless.json["extensionsRequired"] =
        json!(["KHR_materials_unlit", "KHR_texture_transform", "KHR_mesh_quantization"]);
    let folder = tempfile::tempdir().unwrap();
    assert!(Model::load(&harmless.save(folder.path())).is_ok());
}

#[test]
fn buffers_are_checked() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cube.gltf");
    let maker = Maker::cube();
    std::fs::write(folder.path().join("short.bin"), &maker.binary[1..]).unwrap();
    let cases = [
        ("absent.bin", "absent.bin cannot be read"),
        ("short.bin", "short.bin has 131"),
        ("data:application/octet-stream;base64,AA!A", "base64"),
        ("data:application/octet-stream;base64", "comma"),
        ("data:,AAAA", "its data URI has 4"),
        ("data:,%4", "hexadecimal"),
        ("https://example.org/cube.bin", "\"https\""),
    ];
    for (uri, named) in cases {
        let mut json = maker.json.clone();
        json["buffers"][0]["uri"] = json!(uri);
        std::fs::write(&path, json.to_string()).unwrap();
        let message = Model::load(&path).unwrap_err().to_string();
        assert!(message.contains("buffer 0") && message.contains(named), "{uri}: {message}");
    }
    std::fs::write(&path, maker.json.to_string()).unwrap();
    assert!(Model::load(&path).unwrap_err().to_string().contains("no binary chunk"));
}

#[test]
fn files_that_are_no_gltf() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("made.glb");
    assert!(Model::load(&path).unwrap_err().to_string().contains("cannot be read"));
    assert!(Model::load(folder.path()).unwrap_err().to_string().contains("cannot be read"));
    let nested = [vec![b'['; 100_000], vec![b']'; 100_000]].concat();
    let cases: [&[u8]; 8] = [
        b"",
        b"solid cube",
        b"[]",
        b"glTF",
        b"glTF\x02\0\0\0\0\0\0\0",
        b"glTF\x02\0\0\0\xff\xff\xff\xff",
        b"glTF\x01\0\0\0\x0c\0\0\0",
        &nested,
    ];
    for bytes in cases {
        std::fs::write(&path, bytes).unwrap();
        let message = Model::load(&path).unwrap_err().to_string();
        assert!(
            ["the file is empty", "GLB", "JSON", "an STL file", "this is glTF 1.0"]
                .iter()
                .any(|word| message.contains(word)),
            "{message}"
        );
    }
}

/// Every truncated file and every flipped byte gives an error or a valid model.
#[test]
#[ignore = "long: tools/test --all"]
fn damaged_bytes_never_panic() {
    damage(1);
}

/// The same at every 17th place, which is no multiple of what glTF aligns to.
#[test]
fn some_damaged_bytes_never_panic() {
    damage(17);
}

fn damage(every: usize) {
    let mut files = vec![Maker::cube().glb()];
    let mut rich = Maker::cube();
    let indices = rich.view(&[3, 6]);
    let values = rich.view(&[0; 24]);
    rich.json["accessors"][0]["sparse"] = Maker::sparse(2, indices, 5121, values);
    let normals = rich.floats(&super::make::cube_corners());
    rich.json["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = json!(normals);
    files.push(rich.glb());
    if let Some(shared) = shared() {
        let names = ["nested_trs_matrix.glb", "two_scenes_default1_instanced.glb", "strip.glb", "data_uri.gltf"];
        files.extend(names.map(|name| std::fs::read(shared.join("gltf/gen").join(name)).unwrap()));
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("made.glb");
    let (mut errors, mut models) = (0, 0);
    let mut attempt = |bytes: &[u8]| {
        std::fs::write(&path, bytes).unwrap();
        match Model::load(&path) {
            Ok(model) => {
                check_promises(&model);
                models += 1;
            }
            Err(error) => {
                assert!(error.to_string().contains("made.glb"), "{error}");
                errors += 1;
            }
        }
    };
    for file in &files {
        for length in (0..file.len()).step_by(every) {
            attempt(&file[..length]);
        }
        for at in (0..file.len()).step_by(every) {
            for flip in [0x01, 0x08, 0x80, 0xFF] {
                let mut damaged = file.clone();
                damaged[at] ^= flip;
                attempt(&damaged);
            }
        }
    }
    println!("{errors} errors, {models} models");
    assert!(errors * every > 1_000 && models * every > 1_000, "both outcomes must have been met");
}
