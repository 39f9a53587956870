//! Every file in `../shared/data/gltf` and `../shared/data/models`.

use std::path::{Path, PathBuf};

use isotherm::internals::Model;
use serde_json::Value;

use super::{check_promises, volume};

/// The shared folder. `None` with a printed line if it is missing.
pub fn shared() -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data");
    if !path.is_dir() {
        println!("skipped: ../shared/data absent");
        return None;
    }
    Some(path)
}

/// Within 1e-6 of the expected value, relative.
fn close(value: f64, expected: f64) -> bool {
    (value - expected).abs() <= 1e-6 * expected.abs()
}

/// Compares a file with its row of `expected.json`.
fn agrees(row: &Value, loaded: &Result<Model, isotherm::ModelError>) -> bool {
    let model = match (row["load"].as_bool(), loaded) {
        (Some(true), Ok(model)) => model,
        (Some(false), Err(_)) => return true,
        _ => return false,
    };
    let triangles = row.get("tris").or(row.get("tris_nonzero_area")).and_then(Value::as_u64);
    let summary = serde_json::to_value(model.summary()).unwrap();
    let bounds = row.get("bbox").is_none_or(|bbox| {
        let expected = bbox.as_array().unwrap().iter().flat_map(|corner| corner.as_array().unwrap());
        let found = summary["bounds_m"].as_array().unwrap().iter().flat_map(|corner| corner.as_array().unwrap());
        expected.zip(found).all(|(expected, found)| (expected.as_f64().unwrap() - found.as_f64().unwrap()).abs() < 1e-6)
    });
    // Every normal of a convex body points away from the centre of its box.
    let outward = row.get("outward_normals").is_none() || {
        let [low, high] = model.bounds();
        let pairs = model.positions.iter().zip(&model.normals);
        pairs.into_iter().all(|(at, normal)| (at - 0.5 * (low + high)).dot(normal.as_dvec3()) > 0.0)
            && volume(model) > 0.0
    };
    triangles == summary["triangles"].as_u64()
        && close(summary["area_m2"].as_f64().unwrap(), row["area"].as_f64().unwrap())
        && bounds
        && outward
}

#[test]
fn generated_files_have_the_expected_counts_areas_and_bounds() {
    let Some(shared) = shared() else { return };
    let folder = shared.join("gltf/gen");
    let expected: Value = serde_json::from_slice(&std::fs::read(folder.join("expected.json")).unwrap()).unwrap();
    for (name, row) in expected.as_object().unwrap() {
        let loaded = Model::load(&folder.join(name));
        assert!(agrees(row, &loaded), "{name}: {loaded:?}");
        // A changed row must not agree.
        let mut wrong = row.clone();
        if row["load"] == true {
            wrong["area"] = (row["area"].as_f64().unwrap() * (1.0 + 3e-6)).into();
        } else {
            wrong["load"] = true.into();
        }
        assert!(!agrees(&wrong, &loaded), "{name} agrees with a wrong row");
        match loaded {
            Ok(model) => check_promises(&model),
            Err(error) => assert!(error.to_string().contains(name.as_str()), "{error}"),
        }
    }
}

#[test]
fn errors_of_generated_files_name_the_element() {
    let Some(shared) = shared() else { return };
    let message = |name: &str| Model::load(&shared.join("gltf").join(name)).unwrap_err().to_string();
    assert!(message("gen/bad_accessor_too_long.glb").contains("accessor 1"));
    assert!(message("gen/bad_index_oob.glb").contains("accessor 1"));
    assert!(message("gen/required_unknown_ext.glb").contains("EXT_unknown_thing"));
    assert!(message("IndexOutOfRange/IndexOutOfRange.gltf").contains("accessor 0"));
    assert!(message("IndexOutOfRange/AllIndicesOutOfRange.gltf").contains("accessor 0"));
}

#[test]
fn what_is_left_out_is_listed() {
    let Some(shared) = shared() else { return };
    let skipped = |name: &str| {
        let model = Model::load(&shared.join("gltf/gen").join(name)).unwrap();
        model.skipped.iter().map(|row| format!("{}: {}", row.what, row.why)).collect::<Vec<_>>()
    };
    assert_eq!(skipped("degenerate.glb"), ["2 triangles of part cube: zero area"]);
    assert!(skipped("camera_light.glb").iter().any(|row| row.starts_with("1 camera")));
    assert!(skipped("camera_light.glb").iter().any(|row| row.starts_with("1 light")));
    assert!(skipped("optional_unknown_ext.glb").iter().any(|row| row.contains("EXT_unknown_thing")));
    assert_eq!(skipped("two_scenes_default1_instanced.glb").len(), 1);
    assert!(skipped("idx_u8.glb").is_empty());
}

/// Mesh_PrimitiveMode README: 00 to 03 and 07 to 10 are points and lines. The rest are a square of side 1 made of two
/// triangles.
#[test]
fn primitive_modes() {
    let Some(shared) = shared() else { return };
    for number in 0..16 {
        let path = shared.join(format!("gltf/Mesh_PrimitiveMode/Mesh_PrimitiveMode_{number:02}.gltf"));
        let loaded = Model::load(&path);
        if number <= 3 || (7..=10).contains(&number) {
            let message = loaded.unwrap_err().to_string();
            assert!(message.contains("nothing to draw") && message.contains("not triangles"), "{message}");
        } else {
            let model = loaded.unwrap();
            check_promises(&model);
            assert_eq!(model.triangles.len(), 2, "{number}");
            assert!(close(model.area(), 1.0), "{number}");
            // The square lies in z = 0 and always faces +z. Wrong winding in a strip would show here.
            assert!(model.normals.iter().all(|normal| normal.z > 0.999), "{number}");
        }
    }
}

#[test]
fn boxes() {
    let Some(shared) = shared() else { return };
    let gltf = shared.join("gltf");
    for name in [
        "BoxTextured-glTF/BoxTextured.gltf",
        "BoxTextured-glTF-Embedded/BoxTextured.gltf",
        "BoxTextured-glTF-Binary/BoxTextured.glb",
    ] {
        let model = Model::load(&gltf.join(name)).unwrap();
        check_promises(&model);
        assert_eq!((model.triangles.len(), model.positions.len(), model.gltf_nodes), (12, 24, 2));
        assert!(close(model.area(), 6.0) && close(volume(&model), 1.0));
        assert_eq!(model.materials[0].name, "Texture");
        assert_eq!(model.parts[0].name, "node_1");
        assert!(model.notes.is_empty(), "{:?}", model.notes);
    }
    // Four normals of length 0, four of length 0.1.
    let bad = Model::load(&gltf.join("BoxBadNormals-glTF-Binary/BoxBadNormals.glb")).unwrap();
    check_promises(&bad);
    assert!(close(bad.area(), 6.0) && close(volume(&bad), 1.0));
    assert!(bad.notes.iter().any(|note| note.contains("4 vertices of part nodes_1")), "{:?}", bad.notes);
}

/// Counted with another program: 9,244 drawn triangles, 30 materials, 55 nodes, 74 x 109 x 33 m.
#[test]
fn the_station() {
    let Some(shared) = shared() else { return };
    let model = Model::load(&shared.join("models/ISS_42.glb")).unwrap();
    check_promises(&model);
    let summary = model.summary();
    assert_eq!((summary.triangles, summary.materials.len(), summary.nodes), (9_244, 30, 55));
    let [low, high] = model.bounds();
    assert_eq!((high - low).round().to_array(), [74.0, 109.0, 33.0]);
    for shares in [&summary.materials, &summary.parts] {
        assert_eq!(shares.iter().map(|share| share.triangles).sum::<usize>(), 9_244);
        assert!(close(shares.iter().map(|share| share.area_m2).sum(), summary.area_m2));
    }
    let mut names: Vec<_> = summary.parts.iter().map(|part| part.name.as_str()).collect();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), summary.parts.len());
    let keys: Vec<String> = serde_json::to_value(&summary).unwrap().as_object().unwrap().keys().cloned().collect();
    let wanted = ["triangles", "vertices", "nodes", "area_m2", "bounds_m", "materials", "parts", "skipped"];
    assert_eq!(keys, wanted);
    let text = summary.to_string();
    assert!(text.contains("materials (30)") && text.contains("SOLAR_CELL"), "{text}");
}

/// Hubble has 12 triangles of zero area, and a primitive without normals.
#[test]
fn other_models() {
    let Some(shared) = shared() else { return };
    for entry in std::fs::read_dir(shared.join("models")).unwrap() {
        let path = entry.unwrap().path();
        let model = Model::load(&path).unwrap();
        check_promises(&model);
        println!("{}", model.summary());
        let name = path.file_stem().unwrap().to_str().unwrap();
        let zero_area: Vec<&str> =
            model.skipped.iter().filter(|row| row.why == "zero area").map(|row| row.what.as_str()).collect();
        match name {
            "HST_42" => {
                assert_eq!(zero_area, ["12 triangles of part B0_HST"]);
                assert!(model.notes.iter().any(|note| note.contains("which have none")), "{:?}", model.notes);
            }
            "dimorphos_celestia" => assert_eq!(model.triangles.len(), 49_152),
            _ => assert!(zero_area.is_empty(), "{name}: {zero_area:?}"),
        }
    }
}
