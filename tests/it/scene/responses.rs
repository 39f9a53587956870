//! Keys of response functions in rules, table entries, `[materials]` and glTF extras.

use std::path::PathBuf;

use isotherm::Scene;
use isotherm::internals::{
    Domain, Function, Model, ModelMaterial, Profile, Response, Retarget, TemperatureSample, Transition,
};
use serde_json::{Value, json};

use super::{Folder, SHORT, TABLE};

const CSV: &str = "time,temperature\n0,300\n1,280\n3,250\n9,240\n";

/// The values of a function in TOML and in JSON, and the function.
fn functions() -> Vec<(&'static str, Value, Function)> {
    let samples = [(0.0, 300.0), (1.0, 280.0), (3.0, 250.0), (9.0, 240.0)];
    let samples = samples.map(|(time, temperature)| TemperatureSample { time, temperature });
    vec![
        ("function = 'linear'", json!({ "function": "linear" }), Function::Linear),
        ("function = 'quadratic'", json!({ "function": "quadratic" }), Function::Quadratic),
        (
            "function = 'polynomial', coefficients = [0, 2, -1]",
            json!({ "function": "polynomial", "coefficients": [0, 2, -1] }),
            Function::polynomial(&[0.0, 2.0, -1.0]).unwrap(),
        ),
        (
            "function = 'exponential', rate = 3",
            json!({ "function": "exponential", "rate": 3 }),
            Function::exponential(3.0).unwrap(),
        ),
        (
            "function = 'logarithmic', rate = 1.5",
            json!({ "function": "logarithmic", "rate": 1.5 }),
            Function::logarithmic(1.5).unwrap(),
        ),
        (
            "function = 'table', file = 'cool.csv'",
            json!({ "function": "table", "file": "cool.csv" }),
            Function::table(&samples, None).unwrap(),
        ),
        (
            "function = 'table', file = 'cool.csv', target = 200",
            json!({ "function": "table", "file": "cool.csv", "target": 200 }),
            Function::table(&samples, Some(200.0)).unwrap(),
        ),
        (
            "function = 'expression', text = 's*s*(3.0-2.0*s)'",
            json!({ "function": "expression", "text": "s*s*(3.0-2.0*s)" }),
            Function::expression("s*s*(3.0-2.0*s)").unwrap(),
        ),
    ]
}

fn folder() -> Folder {
    let folder = Folder::new();
    std::fs::write(folder.path("cool.csv"), CSV).unwrap();
    folder
}

/// The response of the model's only material, `A`.
fn response(folder: &Folder, scene: &Scene, extras: &Value) -> Response {
    let extras = extras.as_object().into_iter().flatten().map(|(key, value)| (key.clone(), value.clone())).collect();
    let material = ModelMaterial { name: "A".to_string(), extras, colour: None };
    let model = Model { source: folder.path("craft.glb"), materials: vec![material], ..Model::default() };
    scene.materials.resolve(&model, &mut Vec::<PathBuf>::new()).unwrap().remove(0).response
}

#[test]
fn every_function_is_read_wherever_a_material_may_state_it() {
    let folder = folder();
    let rest = "domain = 'T4'\nretarget = 'restart'\n";
    for (toml, keys, function) in functions() {
        // 25 s are 2.5 steps of 10 s.
        let profile = |t_max_steps| Profile { function: function.clone(), t_max_steps };
        let expected = Response::Transition(Transition {
            heating: profile(2.5),
            cooling: profile(7.0),
            retarget: Retarget::Restart,
            domain: Domain::FourthPower,
        });
        let stated = format!(
            "response = 'transition'\nheating = {{ {toml}, t_max = 25 }}\ncooling = {{ {toml}, t_max_steps = 7 }}\n{rest}"
        );

        let rule = folder.parse(&format!("{SHORT}[[material]]\nmatch = 'A'\nuse = 'paint'\n{stated}")).unwrap();
        assert_eq!(response(&folder, &rule, &json!({})), expected, "{toml} in a rule");

        let common = folder.parse(&SHORT.replace("response = \"instant\"\n", &stated)).unwrap();
        assert_eq!(response(&folder, &common, &json!({})), expected, "{toml} in [materials]");

        let table = TABLE.replacen("finish = 'white paint'\n", &format!("finish = 'white paint'\n{stated}"), 1);
        std::fs::write(folder.path("table.toml"), table).unwrap();
        let entry = folder.parse(&SHORT.replace("response = \"instant\"\n", "")).unwrap();
        assert_eq!(response(&folder, &entry, &json!({})), expected, "{toml} in an entry");
        std::fs::write(folder.path("table.toml"), TABLE).unwrap();

        let mut extras = json!({
            "use": "paint", "response": "transition", "domain": "T4", "retarget": "restart",
            "heating_t_max": 25, "cooling_t_max_steps": 7,
        });
        for (key, value) in keys.as_object().unwrap() {
            extras[format!("heating_{key}")] = value.clone();
            extras[format!("cooling_{key}")] = value.clone();
        }
        let scene = folder.parse(SHORT).unwrap();
        assert_eq!(response(&folder, &scene, &extras), expected, "{toml} in extras");
        extras["cooling_t_max_steps"] = json!(8);
        assert_ne!(response(&folder, &scene, &extras), expected, "another t_max must show");
    }
}

#[test]
fn what_a_transition_leaves_open_is_told() {
    let folder = folder();
    let rule = "[[material]]\nmatch = 'A'\nuse = 'paint'\nresponse = 'transition'\n\
                heating = { function = 'linear', t_max = 25 }\ncooling = { function = 'linear', t_max = 25 }\n";
    let told = |text: &str, key: &str| {
        let scene = folder.parse(&format!("{SHORT}{text}")).unwrap();
        scene.assumptions.iter().any(|sentence| sentence.contains(&format!("({key} is absent): rule 1 (A).")))
    };
    for key in ["domain", "retarget"] {
        assert!(told(rule, key), "{key}");
    }
    assert!(!told(&format!("{rule}domain = 'T'\n"), "domain"));
    assert!(!told(&format!("{rule}retarget = 'merge'\n"), "retarget"));
    assert!(!told(&rule.replace("'transition'", "'instant'"), "domain"), "nothing moves");
}
