//! Response functions of a scene: unused ones cost nothing, and their files are read.

use serde_json::{Value, json};

use super::craft::{Folder, SCENE, glb, scene_with};
use super::program::json;

/// The frame, the buffers and their sizes, as `info` prints them.
fn cost(folder: &Folder) -> [Value; 5] {
    let value = json(folder.0.path(), &["info", "scene.toml", "--json"]);
    ["nodes_by_response", "frame", "buffers", "bytes", "bytes_a_node"].map(|key| value[key].clone())
}

/// A material whose functions are not powers. No other material of the craft uses its rule.
fn shaped(name: &str) -> String {
    format!(
        "[[material]]\nmatch = \"{name}\"\nabsorptivity = 0.5\nemissivity = 0.5\nresponse = \"transition\"\n\
         heating = {{ function = \"exponential\", rate = 3, t_max_steps = 9 }}\n\
         cooling = {{ function = \"expression\", text = \"s*s\", t_max_steps = 9 }}\n"
    )
}

#[test]
fn functions_that_nothing_uses_cost_nothing() {
    let before = cost(&Folder::new(SCENE));
    let first_rule = "[[material]]\nmatch = \"skin\"";
    let with = |name: &str| scene_with(&[(first_rule, &format!("{}{first_rule}", shaped(name)))]);
    assert_eq!(cost(&Folder::new(&with("spare"))), before, "a rule that matches nothing");
    let used = cost(&Folder::new(&with("mast")));
    assert!((0..2).all(|part| used[part] != before[part]), "a function in use must show: {used:?}");

    // A material without triangles also costs nothing.
    let mut model = glb();
    model.push("materials", json!({ "name": "spare" }));
    let folder = Folder::new(&with("spare"));
    model.save(folder.0.path());
    assert_eq!(cost(&folder), before, "a material that nothing has");
}

#[test]
fn the_table_of_a_function_belongs_to_the_scenes_files_and_its_hash() {
    let scene = scene_with(&[(
        "heating = { function = \"quadratic\", t_max_steps = 20 }",
        "heating = { function = \"table\", file = \"heating.csv\", t_max_steps = 20 }",
    )]);
    let folder = Folder::new(&scene);
    let table = folder.write("heating.csv", "time,temperature\n0,200\n1,260\n3,300\n");
    let first = folder.prepared();
    assert_eq!(first.scene.files, [folder.path("scene.toml"), folder.path("made.glb"), table.clone()]);
    assert_eq!(first.hashes.files.len(), 3);
    folder.write("heating.csv", "time,temperature\n0,200\n1,261\n3,300\n");
    let second = folder.prepared();
    assert_ne!(first.hashes.all, second.hashes.all);
    assert_ne!(first.hashes.files[&table], second.hashes.files[&table]);
    assert_eq!(first.hashes.files[&folder.path("made.glb")], second.hashes.files[&folder.path("made.glb")]);

    // Extras name a table next to the model, which is read too.
    let rule = SCENE.split("[[material]]").find(|rule| rule.contains("\"mast\"")).expect("a rule");
    let (rule, _) = rule.split_once("[radiance]").expect("the last rule");
    let folder = Folder::new(&scene_with(&[(&format!("[[material]]{rule}"), "")]));
    let mut model = glb();
    model.json["materials"][2]["extras"] = json!({
        "isotherm_absorptivity": 0.85, "isotherm_emissivity": 0.85, "isotherm_response": "transition",
        "isotherm_heating_function": "table", "isotherm_heating_file": "mast.csv", "isotherm_heating_t_max_steps": 9,
        "isotherm_cooling_function": "table", "isotherm_cooling_file": "mast.csv", "isotherm_cooling_t_max": 540,
    });
    model.save(folder.0.path());
    let table = folder.write("mast.csv", "time,temperature\n0,200\n1,260\n3,300\n");
    let first = folder.prepared();
    assert_eq!(first.scene.files[2..], [table], "named once");
    folder.write("mast.csv", "time,temperature\n0,200\n1,262\n3,300\n");
    assert_ne!(first.hashes.all, folder.prepared().hashes.all);
}
