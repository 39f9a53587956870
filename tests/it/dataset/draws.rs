//! What is drawn, on the scale of a whole data set.

use isotherm::internals::{Begin, Split, empty_splits, split_of};

use super::Workshop;

/// A SPEC of many orbits has the shares of its split, and each orbit one purpose.
#[test]
fn the_split_has_its_shares_of_the_orbits() {
    let workshop = Workshop::new(&[("samples = 6", "samples = 2000")]);
    let (spec, _) = workshop.spec();
    let count = |split| (0..spec.orbits()).filter(|orbit| split_of(&spec, *orbit) == split).count();
    assert_eq!(Split::ALL.map(count), [340, 330, 330]);
}

/// Six orbits leave one for a share of a tenth, and none for the other.
#[test]
fn a_share_without_an_orbit_is_told() {
    let split = ("{ train = 0.34, val = 0.33, test = 0.33 }", "{ train = 0.8, val = 0.1, test = 0.1 }");
    for (samples, expected) in [("samples = 12", vec![Split::Validation]), ("samples = 40", Vec::new())] {
        let (spec, _) = Workshop::new(&[split, ("samples = 6", samples)]).spec();
        assert_eq!(empty_splits(&spec), expected, "{samples}");
        let empty = |split| (0..spec.orbits()).all(|orbit| split_of(&spec, orbit) != split);
        assert_eq!(Split::ALL.into_iter().filter(|split| empty(*split)).collect::<Vec<_>>(), expected, "{samples}");
    }
    let (spec, _) = Workshop::new(&[("split = { train = 0.34, val = 0.33, test = 0.33 }", "")]).spec();
    assert_eq!(empty_splits(&spec), []);
}

/// Samples of a latin hypercube lie one in each stratum, so every tenth of the orbits has a tenth of the phases.
#[test]
fn orbits_of_a_latin_hypercube_fill_each_stratum_once() {
    for (sampling, expected) in [("latin_hypercube", 20), ("random", 0)] {
        let workshop =
            Workshop::new(&[("samples = 6", "samples = 40"), ("\"latin_hypercube\"", &format!("\"{sampling}\""))]);
        let (spec, scenes) = workshop.spec();
        let mut strata = std::collections::BTreeSet::new();
        for orbit in 0..spec.orbits() {
            let drawn = scenes.of_orbit(&spec, orbit).expect("a scene").values.drawn;
            let phase = drawn["orbit"]["phase_deg"].as_f64().expect("a number");
            strata.insert((phase / 18.0) as u32);
        }
        assert_eq!(strata.len() == 20, expected == 20, "{sampling}: {strata:?}");
    }
}

/// The scene of an orbit has the values that were drawn, and every other value of the file.
#[test]
fn the_scene_of_an_orbit_has_its_values() {
    let workshop = Workshop::new(&[]);
    let (spec, scenes) = workshop.spec();
    let [one, other] = [0, 1].map(|orbit| scenes.of_orbit(&spec, orbit).expect("a scene"));
    assert_ne!(one.values.drawn, other.values.drawn);
    let sensor = one.scene.sensor.expect("a sensor");
    assert_eq!(Some(sensor.noise.expect("noise").kelvin), one.values.drawn["sensor"]["netd"].as_f64());
    assert_ne!(sensor.seed, other.scene.sensor.expect("a sensor").seed);
    assert_eq!(one.scene.name, "craft");
    assert!(workshop.make("set", (5, 6), Begin::Fresh).expect("a shard without orbits").images == 0);
}
