//! The same bytes however a data set is made.

use std::fs;
use std::sync::atomic::AtomicBool;

use isotherm::internals::{Begin, OrbitRun, read_exr};
use isotherm::{DatasetError, Image, Pose, Simulation, Target};
use serde_json::Value;

use super::{Workshop, differing};

#[test]
fn one_run_three_shards_and_a_resumed_run_give_the_same_files() {
    let workshop = Workshop::new(&[]);
    let made = workshop.whole("one");
    assert_eq!((made.images, made.orbits), (6, 3));
    let one = workshop.tree("one");
    for name in ["index.parquet", "README.txt", "camera.json", "spec.toml", "coco/train.json", "speed/validation.json"]
    {
        assert!(one.contains_key(name), "{name} is missing: {:?}", one.keys());
    }
    for what in ["gray", "radiance", "depth", "part", "temperature", "label"] {
        let count = one.keys().filter(|name| name.contains(&format!("/{what}/"))).count();
        assert_eq!(count, 6, "{what}");
    }

    // In another order, the last of them finishes the set.
    let complete = [2, 0, 1].map(|index| workshop.make("shards", (index, 3), Begin::Fresh).expect("a shard").complete);
    assert_eq!(complete, [false, false, true]);
    assert_eq!(differing(&one, &workshop.tree("shards")), [""; 0]);

    // An orbit and the files of the whole set are lost, as if a kill had come before them.
    let lost = ["train", "val", "test"].map(|split| workshop.path("one").join(split)).into_iter();
    let lost =
        lost.flat_map(|split| fs::read_dir(split).into_iter().flatten()).next().expect("an orbit").expect("an orbit");
    fs::remove_dir_all(lost.path()).expect("removed");
    fs::remove_file(workshop.path("one/checksums.sha256")).expect("removed");
    fs::remove_file(workshop.path("one/index.parquet")).expect("removed");
    assert!(matches!(workshop.make("one", (0, 1), Begin::Fresh), Err(DatasetError::Begun { count: 2, .. })));
    let again = workshop.make("one", (0, 1), Begin::Resume).expect("the rest");
    assert_eq!((again.orbits, again.kept, again.complete), (1, 2, true));
    assert_eq!(differing(&one, &workshop.tree("one")), [""; 0]);

    // Another seed shows that a difference is seen.
    workshop.change(&[("seed = 5", "seed = 6")]);
    assert!(matches!(workshop.make("one", (0, 1), Begin::Resume), Err(DatasetError::Other { .. })));
    workshop.make("one", (0, 1), Begin::Force).expect("a data set");
    let other = differing(&one, &workshop.tree("one"));
    assert!(
        other.iter().any(|name| name.ends_with(".exr")) && other.contains(&"index.parquet".to_owned()),
        "{other:?}"
    );
}

#[test]
fn rejections_are_counted_and_stand_in_the_summary() {
    let workshop = Workshop::new(&[
        ("samples = 6", "samples = 3"),
        ("poses_per_orbit = 2", "poses_per_orbit = 3"),
        ("pointing_px = { normal = [0, 4] }", "pointing_px = { uniform = [-60, 60] }"),
    ]);
    let made = workshop.whole("set");
    let rejected: u64 = made.rejections.values().sum();
    assert!(rejected > 0);
    let summary: Value =
        serde_json::from_slice(&fs::read(workshop.path("set/dataset.json")).expect("a file")).expect("JSON");
    let told = summary["rejected"].as_object().expect("an object").values().filter_map(Value::as_u64).sum::<u64>();
    assert_eq!(told, rejected);
    let report: Value =
        serde_json::from_slice(&fs::read(workshop.path("set/report-0-of-1.json")).expect("a file")).expect("JSON");
    assert!(report["images_an_hour"].as_f64().expect("a number") > 0.0);
}

/// The craft fills at least six tenths of the view's points, and lies where the labels say.
#[test]
fn a_sample_is_what_the_spec_asks_for() {
    let workshop = Workshop::new(&[("samples = 6", "samples = 2")]);
    workshop.whole("set");
    let orbit = ["train", "val", "test"].map(|split| workshop.path("set").join(split).join("000000"));
    let orbit = orbit.iter().find(|folder| folder.is_dir()).expect("an orbit");
    let own: Value = serde_json::from_slice(&fs::read(orbit.join("orbit.json")).expect("a file")).expect("JSON");
    for row in own["images"].as_array().expect("a list") {
        let number = |key: &str| row[key].as_f64().unwrap_or_else(|| panic!("{key}: {row}"));
        assert!((9.0..=40.0).contains(&number("distance_m")), "{row}");
        assert!((0.0..=555.36).contains(&number("time_s")));
        assert!([8.0, 14.0, 16.0].contains(&number("sensor.bits")));
        assert!((0.05..=0.5).contains(&number("drawn.sensor.netd")));
        assert_eq!(number("drawn.sensor.netd"), number("sensor.netd_K"));
        let (age, absorptivity) = (number("drawn.life.age"), number("drawn.life.material.skin.absorptivity"));
        assert!((absorptivity - (0.20 + 0.20 * age)).abs() < 1e-12);
        // Absorptivity and emissivity age together.
        assert!((number("drawn.life.material.skin.emissivity") - (0.85 - 0.05 * age)).abs() < 1e-12);
        assert!(number("visible_pixels") >= 1.0);
    }
}

/// The EXR files of a scene that asks have the errors of a simulation that is driven through the same times.
#[test]
fn a_scene_that_asks_has_errors_in_its_radiance() {
    let workshop = Workshop::new(&[("samples = 6", "samples = 2")]);
    let scene = fs::read_to_string(workshop.path("scene.toml")).expect("a scene");
    workshop.0.write("scene.toml", &format!("{scene}\n[shadows]\n[output]\nerror = true\n"));
    workshop.whole("set");
    let mut errors = Vec::new();
    for (name, _) in workshop.tree("set").into_iter().filter(|(name, _)| name.ends_with(".exr")) {
        errors.push(read_exr(&workshop.path("set").join(name)).expect("an image").0);
    }
    let (spec, scenes) = workshop.spec();
    let mut run = OrbitRun::new(&spec, &scenes, &Target::Reference, 0).expect("an orbit");
    let mut other: Option<Simulation> = None;
    let mut images = 0;
    run.run(&|_| true, &AtomicBool::new(false), &mut |_, simulation, image, _| {
        let fresh =
            || Simulation::from_scene(simulation.prepared().scene.clone(), &Target::Reference).expect("a scene");
        let other = other.get_or_insert_with(fresh);
        other.step_to(image.time).expect("it steps");
        let expected = other.image(&image.camera, &Pose::OfCamera).expect("an image");
        assert!(expected.error.iter().any(|error| *error > 0.0));
        let file = errors.iter().find(|file| file.time.to_bits() == image.time.to_bits()).expect("its file");
        // The orbits of a data set share tables of albedo, which are interpolated.
        let apart = |file: &Image| {
            let pairs = file.error.iter().zip(&expected.error);
            pairs.map(|(file, expected)| (file - expected).abs() / expected.max(1e-3)).fold(0.0, f32::max)
        };
        println!("errors apart by {:.1e}", apart(file));
        assert!(apart(file) < 2e-3, "at {} s: {}", image.time, apart(file));
        let another = errors.iter().find(|file| file.time.to_bits() != image.time.to_bits()).expect("another file");
        assert!(apart(another) > 2e-3);
        images += 1;
        Ok(())
    })
    .expect("it runs");
    assert_eq!(images, 2);

    // The solar constant is known within 4 %, which is two standard deviations.
    let asks = "[uncertainty]\n[[uncertainty.parameter]]\nvary = \"solar_constant\"\npercent = 4\n";
    workshop.0.write("scene.toml", &format!("{scene}\n{asks}"));
    workshop.whole("uncertain");
    workshop.0.write("scene.toml", &scene.replace("solar_constant = 1361", "solar_constant = 1374.61"));
    workshop.whole("more");
    let (mut stated, mut known) = (0.0, 0.0);
    for (name, _) in workshop.tree("more").into_iter().filter(|(name, _)| name.ends_with(".exr")) {
        let [uncertain, more] =
            ["uncertain", "more"].map(|set| read_exr(&workshop.path(set).join(&name)).expect("an image").0);
        assert_eq!(*uncertain.sigma.causes, ["solar_constant"]);
        assert!(uncertain.sigma.radiance.is_empty() && more.sigma.cause.is_empty());
        let of_pixels = uncertain.temperature.iter().zip(&more.temperature).map(|(now, more)| f64::from(more - now));
        for (sigma, change) in uncertain.sigma.temperature.iter().zip(of_pixels) {
            (stated, known) = (stated + f64::from(*sigma), known + 2.0 * change.abs());
        }
    }
    println!("T_sigma: {stated:.1} K over all pixels, by a change {known:.1} K");
    assert!(known > 10.0 && (stated / known - 1.0).abs() < 0.03 && (1.1 * stated / known - 1.0).abs() > 0.03);

    workshop.change(&[(r#"images = ["numbers", "radiance"]"#, r#"images = ["numbers"]"#)]);
    workshop.0.write("scene.toml", &format!("{scene}\n[shadows]\n[output]\nerror = true\n"));
    let error = workshop.make("other", (0, 1), Begin::Fresh).expect_err("no place for errors").to_string();
    assert!(error.contains("T_error") && error.contains("radiance"), "{error}");
    workshop.0.write("scene.toml", &format!("{scene}\n[shadows]\n[uncertainty]\n"));
    let error = workshop.make("other", (0, 1), Begin::Fresh).expect_err("no place for T_sigma").to_string();
    assert!(error.contains("[uncertainty]"), "{error}");
}
