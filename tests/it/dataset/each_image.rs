//! A sensor that is drawn for each image.

use std::sync::atomic::AtomicBool;

use isotherm::Target;
use isotherm::internals::{Verified, again, picked};
use serde_json::Value;

use super::{Workshop, differing};

const OF_ORBIT: &str = "netd = { log_uniform = [0.05, 0.5] }\n";
const OF_IMAGE: &str =
    "[each_image.sensor]\nnetd = { log_uniform = [0.05, 0.5] }\noffset_pattern = { uniform = [0.1, 1] }\n\n[life]\n";

fn labels(workshop: &Workshop) -> Vec<Value> {
    let files = workshop.tree("set").into_iter().filter(|(name, _)| name.contains("/label/"));
    files.map(|(_, bytes)| serde_json::from_slice(&bytes).expect("JSON")).collect()
}

#[test]
fn each_image_has_its_own_sensor_and_the_thermal_run_stays() {
    let of_orbit = Workshop::new(&[]);
    of_orbit.whole("set");
    let of_image = Workshop::new(&[(OF_ORBIT, ""), ("[life]\n", OF_IMAGE)]);
    of_image.whole("set");
    let differ = differing(&of_orbit.tree("set"), &of_image.tree("set"));
    let has = |what: &str| differ.iter().any(|name| name.contains(what));
    assert!(has("/gray/") && has("/label/"), "{differ:?}");
    for same in ["/temperature/", "/depth/", "/part/", "/mask/", "scene_gt.json"] {
        assert!(!has(same), "{same}: {differ:?}");
    }
    let (of_orbit, all) = (labels(&of_orbit), labels(&of_image));
    let netd = |labels: &[Value]| labels.iter().map(|label| label["sensor"]["netd_K"].as_f64()).collect::<Vec<_>>();
    let different = |labels: &[Value]| {
        netd(labels).iter().map(|one| one.map(f64::to_bits)).collect::<std::collections::BTreeSet<_>>().len()
    };
    assert_eq!((different(&of_orbit), different(&all)), (3, 6));
    for label in &all {
        assert_eq!(label["sensor"]["netd_K"], label["drawn"]["sensor.netd"]);
        assert_eq!(label["sensor"]["offset_pattern_K"], label["drawn"]["sensor.offset_pattern"]);
    }
}

/// The sensor of an image does not depend on the images before it.
#[test]
fn an_image_comes_out_alone_as_in_the_whole_set() {
    let workshop = Workshop::new(&[(OF_ORBIT, ""), ("[life]\n", OF_IMAGE)]);
    workshop.whole("set");
    let (spec, scenes) = workshop.spec();
    let mut found = Verified::default();
    let images = picked(&spec, 3, 1);
    let never = AtomicBool::new(false);
    again(&workshop.path("set"), (&spec, &scenes, &Target::Reference), &images, &never, &mut found).expect("images");
    assert_eq!(
        (found.faults, found.rendered),
        (Vec::new(), images.values().map(std::collections::BTreeSet::len).sum())
    );
}
