//! Rules, table entries, common values and glTF extras combine into materials.

use std::path::PathBuf;

use glam::DMat4;
use isotherm::SceneError;
use isotherm::internals::{
    BandEmissivity, ByAngle, ByWavelength, Domain, Function, Gloss, MaterialRule, Model, ModelMaterial, Optics, Part,
    Profile, Response, Retarget, Sides, Transition,
};
use serde_json::json;

use super::{FULL, Folder, SHORT, TABLE};

fn model(materials: &[(&str, serde_json::Value)]) -> Model {
    let material = |(name, extras): &(&str, serde_json::Value)| ModelMaterial {
        name: (*name).to_string(),
        extras: extras.as_object().into_iter().flatten().map(|(key, value)| (key.clone(), value.clone())).collect(),
        colour: None,
    };
    Model {
        source: PathBuf::from("models/craft.glb"),
        materials: materials.iter().map(material).collect(),
        ..Model::default()
    }
}

fn named(names: &[&str]) -> Model {
    model(&names.iter().map(|name| (*name, json!({}))).collect::<Vec<_>>())
}

fn profile(function: Function, t_max_steps: f64) -> Profile {
    Profile { function, t_max_steps }
}

fn transition(heating: &Profile, cooling: &Profile, retarget: Retarget) -> Response {
    let domain = Domain::Temperature;
    Response::Transition(Transition { heating: heating.clone(), cooling: cooling.clone(), retarget, domain })
}

/// Issue 33, point 3: a rule may name parts, and a name of a part in `match` is told as one.
#[test]
fn rules_of_parts_give_their_surfaces_a_material_of_their_own() {
    let folder = Folder::new();
    let parts = |names: &[&str]| {
        names.iter().map(|name| Part { name: (*name).to_owned(), body_from_part: DMat4::IDENTITY }).collect()
    };
    let mut model = named(&["paint", "foil"]);
    model.parts = parts(&["body", "wing_left", "wing_right"]);
    (model.vertex_part, model.vertex_material) = (vec![0, 1, 2, 1], vec![0, 0, 0, 1]);
    let values = "emissivity = 0.8\nresponse = \"instant\"\n";
    let rules = format!(
        "[[material]]\npart = \"wing_*\"\nabsorptivity = 0.7\n{values}[[material]]\nmatch = \"*\"\nabsorptivity = 0.2\n{values}"
    );
    let (before, _) = SHORT.split_once("[materials]").expect("materials");
    let mut scene = folder.parse(&format!("{before}{rules}")).expect("a scene");
    scene.materials.split_by_part(&mut model);
    let names: Vec<&str> = model.materials.iter().map(|material| material.name.as_str()).collect();
    // The foil is on a wing alone, so it keeps its name.
    assert_eq!((names, &model.vertex_material[..]), (vec!["paint", "foil", "paint of wing_*"], &[0, 2, 2, 1][..]));
    let materials = scene.materials.resolve(&model, &mut Vec::new()).expect("values");
    assert_eq!(materials.iter().map(|one| one.front.absorptivity).collect::<Vec<_>>(), [0.2, 0.7, 0.7]);
    assert_eq!(scene.materials.idle_patterns(&model), Vec::<String>::new());
    // Without the part's key, the rule matches no material.
    let wrong = rules.replace("part = ", "match = ").replace("\"*\"", "\"none\"");
    let scene = folder.parse(&format!("{before}{wrong}")).expect("a scene");
    let error = scene.materials.resolve(&model, &mut Vec::new()).expect_err("no values").to_string();
    assert!(error.contains("matches no material of the model, but a part: 'match' takes"), "{error}");
    // A default takes its place, so a remark says it.
    assert!(scene.materials.idle_patterns(&model)[0].contains("but a part"));
}

#[test]
fn rules_tables_and_common_values_add_up() {
    let folder = Folder::new();
    let scene = folder.parse(FULL).unwrap();
    let materials =
        scene.materials.resolve(&named(&["SOLAR_LEFT", "CELL1", "MAIN_TRUSS", "CELL12"]), &mut Vec::new()).unwrap();
    let [array, cell, truss, other] = materials.as_slice() else { panic!("one a name") };

    assert_eq!((array.name.as_str(), cell.name.as_str()), ("SOLAR_LEFT", "CELL1"));
    assert_eq!(array.front, Optics { absorptivity: 0.88, emissivity: 0.80 });
    // The absorptivity of the back comes from the table, its emissivity from the rule.
    assert_eq!(array.sides, Sides::Both { back: Optics { absorptivity: 0.40, emissivity: 0.7 } });
    assert_eq!(array.response, Response::Instant);
    assert_eq!(
        array.source,
        "scene.toml rule 1, over table.toml array (array sheet; optics: Fortescue 11.3; back: composed)"
    );
    assert_eq!((cell.front, cell.sides), (array.front, array.sides));

    assert_eq!(truss.front, Optics { absorptivity: 0.5, emissivity: 1.0 });
    let foil = Gloss { specular: 0.9, roughness: 0.1, slope_variance: 0.0, drawn_variance: 0.02, seed: 9 };
    assert_eq!((truss.gloss, array.gloss), ([foil; 2], [Gloss::default(); 2]));
    let averaged = Gloss { slope_variance: 0.02, drawn_variance: 0.0, ..foil };
    assert!((averaged.alpha().powi(2) - 0.03).abs() < 1e-15, "variances add up");
    assert!((foil.alpha() - 0.1).abs() < 1e-15, "and drawn slopes do not widen the mirror");
    let law = BandEmissivity {
        by_angle: Some(ByAngle::Table(vec![[0.0, 1.0], [90.0_f64.to_radians(), 0.5]])),
        by_wavelength: Some(ByWavelength {
            points: vec![[3.0 / 1e6, 0.9], [6.0 / 1e6, 0.7]],
            temperature: Some(300.0),
        }),
    };
    assert_eq!((&truss.in_band, &array.in_band), (&[law.clone(), law], &Default::default()));
    assert_eq!(truss.sides, Sides::Outside);
    let bulk = truss.bulk;
    assert_eq!((bulk.thickness, bulk.density), (Some(0.002), Some(2700.0)));
    assert_eq!((bulk.specific_heat, bulk.conductivity), (Some(900.0), Some(200.5)));
    // 775 s are 50 steps of 15.5 s.
    let (heating, cooling) = (profile(Function::Linear, 12.5), profile(Function::Linear, 50.0));
    assert_eq!(truss.response, transition(&heating, &cooling, Retarget::Merge));
    assert_eq!(truss.source, "scene.toml rule 2");

    // CELL? matches one character: CELL12 falls to the default, paint over metal.
    assert_eq!(other.front, Optics { absorptivity: 0.26, emissivity: 0.83 });
    assert_eq!((other.bulk.thickness, other.bulk.density), (None, Some(2770.0)));
    let heating = profile(Function::Quadratic, 100.0);
    assert_eq!(other.response, transition(&heating, &cooling, Retarget::Restart));
}

#[test]
fn the_first_rule_that_matches_wins_and_idle_patterns_are_named() {
    let folder = Folder::new();
    let rules = "[[material]]\nmatch = 'A*'\nuse = 'array'\n[[material]]\nmatch = ['AB', 'a*', 'B']\nuse = 'paint'\n";
    let scene = folder.parse(&format!("{SHORT}{rules}")).unwrap();
    let model = named(&["AB", "B"]);
    let materials = scene.materials.resolve(&model, &mut Vec::new()).unwrap();
    assert_eq!((materials[0].front.absorptivity, materials[1].front.absorptivity), (0.88, 0.26));
    assert_eq!(
        scene.materials.idle_patterns(&model),
        [
            "pattern 'AB' of rule 2 matches what earlier rules match",
            "pattern 'a*' of rule 2 matches no material of the model; did you mean 'AB'?",
        ]
    );
    // The error of a material without values names the pattern at fault, or the condition of two that fails.
    let told = |keys: &str| {
        let values = "absorptivity = 0.2\nemissivity = 0.8\nresponse = \"instant\"\n";
        let (before, _) = SHORT.split_once("[materials]").expect("materials");
        let mut scene = folder.parse(&format!("{before}[[material]]\n{keys}\n{values}")).expect("a scene");
        let mut model = named(&["MLI", "CELLS"]);
        scene.materials.split_by_part(&mut model);
        scene.materials.resolve(&model, &mut Vec::new()).expect_err("no values").to_string()
    };
    for (keys, words) in [
        ("match = 'mli'", "pattern 'mli' of rule 1 matches no material of the model; did you mean 'MLI'?"),
        ("match = 'MLI'\npart = 'bdy'", "pattern 'bdy' of rule 1 matches no part of the model"),
        ("match = 'ML'\npart = '*'", "pattern 'ML' of rule 1 matches no material of the model; did you mean 'MLI'?"),
    ] {
        assert!(told(keys).contains(words), "{}", told(keys));
    }
    let rule: &MaterialRule = &scene.materials.rules[1];
    assert!(rule.matches("B") && !rule.matches("b"));
}

#[test]
fn extras_give_a_material_what_no_rule_gives() {
    let folder = Folder::new();
    let text = SHORT.replace("default = \"paint\"\nresponse = \"instant\"\n", "");
    let scene = folder.parse(&format!("{text}[[material]]\nmatch = 'RULED'\nuse = 'paint'\nresponse = 'instant'\n"));
    let scene = scene.unwrap();
    let complete = json!({
        "absorptivity": 0.9, "emissivity": 0.8, "sides": "both", "back_absorptivity": 0.5, "back_emissivity": 1,
        "thickness": 0.01, "response": "transition", "heating_function": "linear", "heating_t_max": 25.0,
        "cooling_function": "quadratic", "cooling_t_max_steps": 3,
    });
    let used = json!({ "use": "array", "emissivity": 0.5, "response": "instant" });
    let materials = scene
        .materials
        .resolve(&model(&[("RULED", complete.clone()), ("OWN", complete.clone()), ("USED", used)]), &mut Vec::new());
    let materials = materials.unwrap();
    assert_eq!(materials[0].front.absorptivity, 0.26, "a rule comes before extras");
    assert_eq!(materials[1].front, Optics { absorptivity: 0.9, emissivity: 0.8 });
    assert_eq!(materials[1].sides, Sides::Both { back: Optics { absorptivity: 0.5, emissivity: 1.0 } });
    assert_eq!(materials[1].bulk.thickness, Some(0.01));
    // 25 s are 2.5 steps of 10 s.
    let (heating, cooling) = (profile(Function::Linear, 2.5), profile(Function::Quadratic, 3.0));
    assert_eq!(materials[1].response, transition(&heating, &cooling, Retarget::Merge));
    assert_eq!(
        materials[1].source,
        "craft.glb extras; merged, because retarget is absent; T moves, because domain is absent"
    );
    assert_eq!(materials[2].front, Optics { absorptivity: 0.88, emissivity: 0.5 });

    let refused = |key: &str, value: serde_json::Value, expected: &str| {
        let mut extras = complete.clone();
        extras[key] = value;
        let error = scene.materials.resolve(&model(&[("OWN", extras)]), &mut Vec::new()).unwrap_err().to_string();
        assert_eq!(error, format!("models/craft.glb: material 'OWN': {expected}"));
    };
    refused("absorbtivity", json!(0.5), "isotherm_absorbtivity: unknown key; did you mean 'absorptivity'?");
    refused("emissivity", json!(-0.1), "isotherm_emissivity: must be in [0, 1], found -0.1");
    refused("emissivity", json!("high"), "isotherm_emissivity: expected a number, found \"high\"");
    refused("back_emissivity", json!(1.5), "isotherm_back_emissivity: must be in [0, 1], found 1.5");
    refused(
        "heating_t_max_steps",
        json!(1),
        "isotherm_heating_t_max: cannot be combined with 't_max_steps': state one of the two",
    );
    refused("sides", json!("bth"), "isotherm_sides: 'bth' is not one of 'outside', 'both'; did you mean 'both'?");
    refused(
        "sides",
        json!("outside"),
        "isotherm_back: is used with sides = 'both' only: state that, or leave the back out",
    );

    let incomplete =
        scene.materials.resolve(&model(&[("OWN", json!({ "absorptivity": 0.5 }))]), &mut Vec::new()).unwrap_err();
    assert!(incomplete.to_string().contains("material 'OWN': isotherm_emissivity: emissivity is missing"));
}

#[test]
fn every_unmatched_material_is_named_in_one_error() {
    let folder = Folder::new();
    let text = SHORT.replace("default = \"paint\"\n", "");
    let scene = folder.parse(&format!("{text}[[material]]\nmatch = 'HULL'\nuse = 'paint'\n")).unwrap();
    let error = scene.materials.resolve(&named(&["HULL", "TRUSS", "WING"]), &mut Vec::new()).unwrap_err();
    let SceneError::Unmatched { line, ref names, .. } = error else { panic!("{error}") };
    assert_eq!((line, names.as_slice()), (21, ["'TRUSS'".to_string(), "'WING'".to_string()].as_slice()));
    assert!(error.to_string().ends_with("to 2 of models/craft.glb: 'TRUSS', 'WING'"), "{error}");
}

#[test]
fn an_entry_of_the_table_comes_before_what_is_common_to_all() {
    let folder = Folder::new();
    let common = SHORT.replace("\"instant\"", "\"transition\"");
    // The common response lacks its profiles. Only an entry with another response can use it.
    assert!(folder.parse(&common).is_err());
    let table = TABLE.replace("[metal]", "response = 'instant'\n[metal]");
    std::fs::write(folder.path("table.toml"), table).unwrap();
    let default = folder.parse(&common).unwrap().materials.default.unwrap();
    assert_eq!(default.material.response, Response::Instant);
}
