//! The rules of a fit against the reader of scenes.

use super::{Material, rule};
use crate::model::{Model, ModelMaterial, Part};
use crate::scene::Scene;
use crate::thermal::transition::tests::random::Random;

const SCENE: &str = include_str!("../../../tests/it/scene/short.toml");

/// The materials of a model whose names are `names`, by rules.
fn materials(folder: &std::path::Path, names: &[&str], rules: &str) -> Result<Vec<Material>, String> {
    let named = |name: &&str| ModelMaterial { name: (*name).to_owned(), extras: Default::default(), colour: None };
    resolved(folder, Model { materials: names.iter().map(named).collect(), ..Model::default() }, rules)
}

fn resolved(folder: &std::path::Path, mut model: Model, rules: &str) -> Result<Vec<Material>, String> {
    let (head, _) = SCENE.split_once("[materials]").expect("materials");
    let text = format!("{head}{rules}");
    let mut scene = Scene::parse(&text, &folder.join("scene.toml")).map_err(|error| format!("{error}\n{text}"))?;
    scene.materials.split_by_part(&mut model);
    scene.materials.resolve(&model, &mut Vec::new()).map_err(|error| format!("{error}\n{text}"))
}

/// The rule of a material with random values.
fn random_rule(random: &mut Random, name: &str) -> String {
    let mut one_of = |all: &[&str]| all[(random.bits() % all.len() as u64) as usize].to_owned();
    let response = one_of(&["instant", "network", "radiative"]);
    let bulk = one_of(&[
        "thickness = 0.002\ndensity = 2700\nspecific_heat = 900\n",
        "heat_capacity_per_area = 1500\nthickness = 1e-3\n",
    ]);
    let more = one_of(&[
        "",
        "",
        "sides = \"outside\"\n",
        "sides = \"both\"\nback = { absorptivity = 0.25, emissivity = 0.75 }\n",
    ]);
    let [absorptivity, emissivity, conductivity] = [0.01, 0.01, 0.1].map(|low| random.between(low, 1.0));
    format!(
        "[[material]]\nmatch = {}\nresponse = \"{response}\"\nabsorptivity = {absorptivity:?}\nemissivity = {emissivity:?}\n\
         {bulk}conductivity = {conductivity:?}\n{more}",
        toml::Value::String(name.to_owned())
    )
}

/// Each rule that a fit writes is read back as the material that was fitted, and touches no other.
#[test]
fn rules_are_read_back_as_what_was_fitted() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("craft.glb"), b"").expect("written");
    let names = ["paint", "a \"b\"", "foil\u{a0}1", "p?int", "sk*n", "skin", "back\\slash"];
    let mut random = Random(33);
    for _ in 0..40 {
        let rules: String = names.iter().rev().map(|name| random_rule(&mut random, name)).collect();
        let before = materials(folder.path(), &names, &rules).expect("a scene");
        let mut fitted = before.clone();
        let chosen = (random.bits() % names.len() as u64) as usize;
        fitted[chosen].front.emissivity *= random.between(0.3, 1.0);
        let bulk = &mut fitted[chosen].bulk;
        for value in [&mut bulk.thickness, &mut bulk.conductivity] {
            *value = value.map(|value| value * random.between(0.2, 5.0));
        }
        let mut text = String::new();
        rule(&mut text, &fitted[chosen], &before[chosen], &fitted);
        let again = materials(folder.path(), &names, &format!("{text}\n{rules}")).expect("a scene");
        let has_rule = text.contains("\n[[material]]");
        let wanted = if has_rule { &fitted } else { &before };
        for (material, wanted) in again.iter().zip(wanted) {
            assert_eq!(
                (material.front, material.sides, &material.gloss),
                (wanted.front, wanted.sides, &wanted.gloss),
                "{text}"
            );
            assert_eq!(material.bulk, wanted.bulk, "{text}");
        }
        assert!(has_rule || text.lines().all(|line| line.is_empty() || line.starts_with('#')), "{text}");
        assert!(again != before || !has_rule, "the rule changes nothing");
    }
}

/// The parts `arm` and `body` share a material, and a rule of `arm` has other values. The values of a fit of `body` leave `arm` as it is.
#[test]
fn a_rule_leaves_the_same_material_of_another_part() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("craft.glb"), b"").expect("written");
    let part = |name: &str| Part { name: name.to_owned(), body_from_part: glam::DMat4::IDENTITY };
    let paint = ModelMaterial { name: "paint".to_owned(), extras: Default::default(), colour: None };
    let model = || Model {
        parts: ["arm", "body"].map(part).to_vec(),
        materials: vec![paint.clone()],
        vertex_part: vec![0, 1],
        vertex_material: vec![0, 0],
        ..Model::default()
    };
    let mut random = Random(34);
    let of_arm = random_rule(&mut random, "paint") + "part = \"arm\"\n";
    let rules = of_arm + &random_rule(&mut random, "paint");
    let before = resolved(folder.path(), model(), &rules).expect("a scene");
    let mut fitted = before.clone();
    fitted[0].front.emissivity *= 0.7;
    let mut text = String::new();
    rule(&mut text, &fitted[0], &before[0], &fitted);
    let again = resolved(folder.path(), model(), &format!("{text}\n{rules}")).expect("a scene");
    assert_eq!((before.len(), &before[1].name, &again[1].front), (2, &"paint of arm".to_owned(), &before[1].front));
    assert!(text.contains("# emissivity = "), "{text}");
}
