//! Copies of a mesh by EXT_mesh_gpu_instancing, against a file that has a node for each.

use glam::{DQuat, DVec3};
use isotherm::ModelError;
use isotherm::internals::Model;
use serde_json::{Value, json};

use super::make::Maker;
use super::{check_promises, volume};

/// Scale, rotation and translation of the copies. The last one mirrors.
fn places() -> Vec<(DVec3, DQuat, DVec3)> {
    vec![
        (DVec3::ONE, DQuat::IDENTITY, DVec3::new(0.0, 0.0, 5.0)),
        (DVec3::splat(0.5), DQuat::from_rotation_z(1.1), DVec3::new(4.0, -1.0, 0.0)),
        (
            DVec3::new(1.0, 2.0, 0.25),
            DQuat::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), -0.7),
            DVec3::new(-6.0, 2.0, 1.0),
        ),
        (DVec3::new(-1.0, 1.0, 1.5), DQuat::from_rotation_x(2.0), DVec3::new(0.0, 9.0, 0.0)),
    ]
}

/// How rotations are stored.
#[derive(Clone, Copy)]
enum Rotations {
    Floats,
    Shorts,
    Bytes,
}

fn load(maker: &Maker) -> Result<Model, ModelError> {
    let folder = tempfile::tempdir().unwrap();
    Model::load(&maker.save(folder.path()))
}

/// The cube in a node that is turned and moved, with copies.
fn copies(rotations: Rotations) -> Maker {
    let mut maker = Maker::cube();
    let places = places();
    let vector = |of: &dyn Fn(&(DVec3, DQuat, DVec3)) -> DVec3| {
        places.iter().map(|place| of(place).as_vec3().to_array()).collect::<Vec<_>>()
    };
    let scales = maker.floats(&vector(&|place| place.0));
    let translations = maker.floats(&vector(&|place| place.2));
    let quaternions: Vec<f64> = places.iter().flat_map(|place| place.1.to_array()).collect();
    let (bytes, component): (Vec<u8>, u32) = match rotations {
        Rotations::Floats => (quaternions.iter().flat_map(|value| (*value as f32).to_le_bytes()).collect(), 5126),
        Rotations::Shorts => {
            (quaternions.iter().flat_map(|value| ((value * 32767.0).round() as i16).to_le_bytes()).collect(), 5122)
        }
        Rotations::Bytes => (quaternions.iter().map(|value| (value * 127.0).round() as i8 as u8).collect(), 5120),
    };
    let normalized = component != 5126;
    let fields = json!({"componentType": component, "normalized": normalized, "count": places.len(), "type": "VEC4"});
    let rotations = maker.accessor(&bytes, fields);
    maker.json["extensionsUsed"] = json!(["EXT_mesh_gpu_instancing"]);
    maker.json["extensionsRequired"] = json!(["EXT_mesh_gpu_instancing"]);
    let attributes = json!({"TRANSLATION": translations, "ROTATION": rotations, "SCALE": scales, "_ID": 0});
    maker.json["nodes"][0] = json!({
        "name": "truss", "mesh": 0, "translation": [1, 2, 3], "scale": [2, 2, 2],
        "extensions": {"EXT_mesh_gpu_instancing": {"attributes": attributes}}
    });
    maker
}

/// The same as nodes below one.
fn nodes() -> Maker {
    let mut maker = Maker::cube();
    maker.json["nodes"] =
        json!([{"name": "all", "translation": [1, 2, 3], "scale": [2, 2, 2], "children": [1, 2, 3, 4]}]);
    for (scale, rotation, translation) in places() {
        let node = json!({
            "name": "truss", "mesh": 0, "scale": scale.to_array(), "rotation": rotation.to_array(),
            "translation": translation.to_array()
        });
        maker.push("nodes", node);
    }
    maker
}

/// Largest distance of the vertices of two models [m].
fn apart(one: &Model, other: &Model) -> f64 {
    assert_eq!(one.triangles, other.triangles);
    one.positions.iter().zip(&other.positions).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max)
}

#[test]
fn copies_are_parts_like_nodes_of_their_own() {
    let expected = load(&nodes()).unwrap();
    for (rotations, tolerance) in [(Rotations::Floats, 2e-6), (Rotations::Shorts, 1e-3), (Rotations::Bytes, 0.2)] {
        let found = load(&copies(rotations)).unwrap();
        check_promises(&found);
        let distance = apart(&found, &expected);
        assert!(distance < tolerance, "{distance} m");
        assert!((found.area() / expected.area() - 1.0).abs() < 1e-5 && volume(&found) > 0.0);
        let names: Vec<&str> = found.parts.iter().map(|part| part.name.as_str()).collect();
        assert_eq!(names, ["truss[0]", "truss[1]", "truss[2]", "truss[3]"]);
        assert!(found.part_nodes.iter().all(|node| *node == 0), "a joint of the node moves all of them");
        assert!(found.skipped.is_empty(), "{:?}", found.skipped);
    }
    let mut moved = copies(Rotations::Floats);
    moved.json["nodes"][0]["translation"] = json!([1, 2, 3.001]);
    assert!(apart(&load(&moved).unwrap(), &expected) > 1e-3, "a millimetre would be seen");
}

#[test]
fn attributes_that_are_missing_or_do_not_agree_are_refused() {
    let refused = |attributes: Value| {
        let mut maker = copies(Rotations::Floats);
        let three = maker.floats(&[[1.0; 3]; 3]);
        let endless = maker.floats(&[[1.0, f32::NAN, 1.0]; 4]);
        let all = &mut maker.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"];
        for (name, value) in attributes.as_object().unwrap() {
            all[name] = match value.as_str() {
                Some("three") => json!(three),
                Some("endless") => json!(endless),
                _ => value.clone(),
            };
        }
        all.as_object_mut().unwrap().retain(|_, value| !value.is_null());
        load(&maker).unwrap_err().to_string()
    };
    let error = refused(json!({"TRANSLATION": null, "ROTATION": null, "SCALE": null}));
    assert!(error.contains("truss") && error.contains("EXT_mesh_gpu_instancing"), "{error}");
    let error = refused(json!({"TRANSLATION": "three"}));
    assert!(error.contains("3 and 4 values"), "{error}");
    let error = refused(json!({"SCALE": "endless"}));
    assert!(error.contains("copy 0") && error.contains("not finite"), "{error}");
    let error = refused(json!({"ROTATION": "three"}));
    assert!(error.contains("Vec3") && error.contains("Vec4"), "{error}");
    let error = refused(json!({"TRANSLATION": 99}));
    assert!(error.contains("accessor 99"), "{error}");
}
