//! The rules of a fit against the reader of scenes.

use super::{Material, rule};
use crate::model::{Model, ModelMaterial};
use crate::scene::Scene;
use crate::thermal::transition::tests::random::Random;

const SCENE: &str = include_str!("../../../tests/it/scene/short.toml");

/// The materials of a model whose names are `names`, by rules.
fn materials(folder: &std::path::Path, names: &[&str], rules: &str) -> Result<Vec<Material>, String> {
    let (head, _) = SCENE.split_once("[materials]").expect("materials");
    let text = format!("{head}{rules}");
    let scene = Scene::parse(&text, &folder.join("scene.toml")).map_err(|error| format!("{error}\n{text}"))?;
    let named = |name: &&str| ModelMaterial { name: (*name).to_owned(), extras: Default::default(), colour: None };
    let model = Model { materials: names.iter().map(named).collect(), ..Model::default() };
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
        rule(&mut text, &fitted[chosen], &before[chosen]);
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
