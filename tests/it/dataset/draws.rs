//! What is drawn, on the scale of a whole data set.

use isotherm::dataset::split::split_of;
use isotherm::dataset::store::Begin;
use isotherm::labels::image::Split;

use super::Workshop;

/// A SPEC of many orbits has the shares of its split, and each orbit one purpose.
#[test]
fn the_split_has_its_shares_of_the_orbits() {
    let workshop = Workshop::new(&[("samples = 6", "samples = 2000")]);
    let (spec, _) = workshop.spec();
    let count = |split| (0..spec.orbits()).filter(|orbit| split_of(&spec, *orbit) == split).count();
    assert_eq!(Split::ALL.map(count), [340, 330, 330]);
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
