//! A small craft and its scene in a folder of their own: a box, two array wings and a mast.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use isotherm::internals::Prepared;
use serde_json::json;

use super::model::make::Maker;

/// A temporary folder with `made.glb` and `scene.toml`.
pub struct Folder(pub tempfile::TempDir);

/// Sun, planet and albedo; half an hour about the entry into eclipse.
pub const SCENE: &str = include_str!("craft.toml");

impl Folder {
    /// The craft under a scene.
    pub fn new(scene: &str) -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        glb().save(folder.path());
        let folder = Self(folder);
        folder.write("scene.toml", scene);
        folder
    }

    /// A path inside.
    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Writes a file; returns its path. A scene has one sample of a pixel, unless a test states others.
    pub fn write(&self, name: &str, text: &str) -> PathBuf {
        let path = self.path(name);
        let states = name.ends_with(".toml") && text.matches("\nsamples = ").count() > 1;
        let once = text.replacen("\nsamples = 1\n", "\n", 1);
        let text = if states { once.as_str() } else { text };
        std::fs::write(&path, text).expect("the folder can be written");
        path
    }

    /// The scene, ready to run.
    pub fn prepared(&self) -> Prepared {
        prepared(&self.path("scene.toml"))
    }
}

/// A scene file, ready to run.
pub fn prepared(path: &Path) -> Prepared {
    Prepared::new(path, &mut |_| ()).expect("a scene that can run")
}

/// Nobody presses Ctrl-C.
pub fn never() -> AtomicBool {
    AtomicBool::new(false)
}

/// `SCENE` with lines replaced; every `from` must be there.
pub fn scene_with(changes: &[(&str, &str)]) -> String {
    changes.iter().fold(SCENE.to_owned(), |scene, (from, to)| {
        assert!(scene.contains(from), "the scene has no '{from}'");
        scene.replace(from, to)
    })
}

/// Area of the craft [m2]: the cube's 24, two wings of 2 x 4, a mast of 0.2 x 2.
pub const AREA: f64 = 24.0 + 16.0 + 0.4;

/// The model: four parts, three materials.
pub fn glb() -> Maker {
    let mut maker = Maker::cube();
    for (index, name) in ["skin", "cells", "mast"].into_iter().enumerate() {
        assert_eq!(maker.push("materials", json!({ "name": name })), index);
    }
    maker.json["meshes"][0]["primitives"][0]["material"] = json!(0);
    let strip = |maker: &mut Maker, corners: [[f32; 3]; 4], material: usize| {
        let positions = maker.floats(&corners);
        let fields = json!({"componentType": 5121, "count": 6, "type": "SCALAR"});
        let indices = maker.accessor(&[0u8, 1, 2, 0, 2, 3], fields);
        let attributes = json!({ "POSITION": positions });
        maker.primitive(json!({"attributes": attributes, "indices": indices, "material": material}))
    };
    let wing = strip(&mut maker, [[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 4.0, 0.0], [-1.0, 4.0, 0.0]], 1);
    let mast = strip(&mut maker, [[-0.1, 0.0, 0.0], [0.1, 0.0, 0.0], [0.1, 0.0, 2.0], [-0.1, 0.0, 2.0]], 2);
    let nodes = [
        json!({"name": "wing_port", "mesh": wing, "translation": [0, -5.5, 0]}),
        json!({"name": "wing_starboard", "mesh": wing, "translation": [0, 1.5, 0]}),
        json!({"name": "mast", "mesh": mast, "translation": [0, 0, -3]}),
    ];
    for node in nodes {
        let index = maker.push("nodes", node);
        maker.json["scenes"][0]["nodes"].as_array_mut().expect("a list").push(json!(index));
    }
    maker
}

/// The box of the craft alone: closed and convex.
pub fn glb_of_box() -> Maker {
    let mut maker = Maker::cube();
    maker.push("materials", json!({ "name": "skin" }));
    maker.json["meshes"][0]["primitives"][0]["material"] = json!(0);
    maker
}
