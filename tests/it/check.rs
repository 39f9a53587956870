//! `isotherm check`, and the same warnings at the start of a run: each wrong scene is warned of, and a right one is not.

use glam::Vec3;
use isotherm::internals::{CheckEffort, Finding, Prepared, check};
use isotherm::{Simulation, Target};
use serde_json::json;

use super::craft::{Folder, SCENE, glb, scene_with};
use super::model::make::Maker;
use super::model::shared_files::shared;
use super::program::{self, refusal, run, stderr, succeed};

/// What the checks find in the craft's scene with some lines replaced, after a change to what was made of it.
fn found(changes: &[(&str, &str)], change: impl FnOnce(&mut Prepared)) -> Vec<Finding> {
    let mut prepared = Folder::new(&scene_with(changes)).prepared();
    change(&mut prepared);
    check(&prepared, CheckEffort::WHOLE).findings
}

/// The only finding.
fn only(changes: &[(&str, &str)], change: impl FnOnce(&mut Prepared)) -> Finding {
    let mut findings = found(changes, change);
    assert_eq!(findings.len(), 1, "{findings:#?}");
    findings.remove(0)
}

/// The mast as a plate of these values.
fn mast(values: &str) -> String {
    format!("response = \"radiative\"\n{values}\nspecific_heat = 900\n[radiance]")
}

/// Lines of the mast's rule that other rules do not have.
const MAST: &str = "response = \"instant\"\n[radiance]";

#[test]
fn a_right_scene_is_not_warned_of() {
    assert_eq!(found(&[], |_| ()), []);
    let right = mast("thickness = 0.002\ndensity = 2700");
    assert_eq!(found(&[(MAST, &right)], |_| ()), []);
}

#[test]
fn a_model_in_millimetres_is_told_by_its_length() {
    let scaled = |scale: f32| {
        move |prepared: &mut Prepared| prepared.nodes.positions.iter_mut().for_each(|position| *position *= scale)
    };
    let large: Vec<Finding> = found(&[], scaled(1000.0)).into_iter().filter(|one| one.check == "units").collect();
    assert!(large.len() == 1 && large[0].to_string().contains("probably in mm"), "{large:?}");
    assert!(large[0].message.contains("the craft is 1") && large[0].about.contains("made.glb"), "{large:?}");
    assert!(found(&[], scaled(1e-3)).iter().any(|one| one.check == "units"));
    assert!(found(&[], scaled(4.0)).iter().all(|one| one.check != "units"));
    // A CubeSat in mm or cm is no longer than a station, but its body is larger. A station is not told.
    let in_cm = found(&[], scaled(5.0));
    assert!(in_cm.iter().any(|one| one.check == "units" && one.message.contains("encloses 1000 m3")), "{in_cm:?}");
    let vast: Vec<Finding> = found(&[], scaled(15.0)).into_iter().filter(|one| one.check == "units").collect();
    assert!(vast.len() == 1 && vast[0].message.contains("encloses 27000 m3, more than any module"), "{vast:?}");
}

/// Issue 33: millions of edges were split before a word of the unit was said, or the error said nothing of it.
#[test]
fn a_long_craft_with_short_edges_is_told_before_they_are_split() {
    let folder = Folder::new(&scene_with(&[("max_edge = 0.7", "max_edge = 0.001")]));
    let mut maker = glb();
    maker.json["nodes"].as_array_mut().expect("a list").iter_mut().for_each(|node| {
        node["scale"] = json!([10, 10, 10]);
    });
    maker.save(folder.0.path());
    let ran = run(folder.0.path(), &["check", "scene.toml"]);
    let (warning, error) =
        (ran.err.find("m long, and its edges make"), ran.err.find("m long: use a longer edge. If the file is in mm"));
    assert!(ran.code == 2 && warning.is_some() && warning < error, "{}", ran.err);
}

#[test]
fn inward_triangles_and_opposite_normals_are_told_apart() {
    let flip = |prepared: &mut Prepared| prepared.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
    let turn =
        |prepared: &mut Prepared| prepared.nodes.normals.iter_mut().for_each(|normal: &mut Vec3| *normal = -*normal);
    let inward = only(&[], |prepared| {
        flip(prepared);
        turn(prepared);
    });
    assert!(inward.check == "normals" && inward.message.contains("closed body face inward"), "{inward:?}");
    // Wings and mast are open, so nobody knows which side is meant.
    assert!(inward.about.starts_with("part '") && !inward.about.contains("wing"), "{inward:?}");
    let against = only(&[], turn);
    assert!(against.message.contains("to the back of their triangles"), "{against:?}");
}

#[test]
fn a_camera_inside_or_beside_the_craft_is_told() {
    let inside = only(&[("position = [6.5, 5, -7.5]", "position = [0.3, 0.1, 0.2]")], |_| ());
    assert!(inside.check == "inside" && inside.message.contains("the camera is inside the part"), "{inside:?}");
    // Between the wings, in the box around the craft but in no part of it.
    let beside = found(&[("position = [6.5, 5, -7.5]", "position = [0, 3, 0.5]")], |_| ());
    assert!(beside.iter().all(|one| one.check != "inside"), "{beside:?}");
    let away = only(&[("look_at = [0, 0, 0]", "look_at = [13, 10, -15]")], |_| ());
    assert!(away.check == "view" && away.message.contains("not in view in 4 of 4 images"), "{away:?}");
    assert!(away.message.contains("180 deg off") && away.remedy.contains("camera.look_at"), "{away:?}");
    let point = only(&[("fov_deg = 45", "focal_px = 1")], |_| ());
    assert!(point.check == "size" && point.remedy.contains("camera.samples"), "{point:?}");
}

#[test]
fn a_path_that_looks_away_part_of_the_time_is_told_with_the_time() {
    let folder = Folder::new(&scene_with(&[(
        "frame = \"body\"\nposition = [6.5, 5, -7.5]\nlook_at = [0, 0, 0]\nup = [0, 0, -1]",
        "path = \"path.csv\"",
    )]));
    // At first it looks along +Z from below, at the end along -Z.
    folder.write("path.csv", "time,x,y,z,qw,qx,qy,qz\n0,0,0,-20,1,0,0,0\n300,0,0,-20,1,0,0,0\n720,0,0,-20,0,1,0,0\n");
    let findings = check(&folder.prepared(), CheckEffort::WHOLE).findings;
    let [away] = findings.as_slice() else { panic!("{findings:?}") };
    assert!(away.about == "camera.path" && away.message.contains("in 2 of 4 images, first at 480 s"), "{away:?}");
}

#[test]
fn values_in_the_wrong_unit_are_told_with_the_material() {
    let told = |values: &str, check: &str, words: &str| {
        let findings = found(&[(MAST, &mast(values))], |_| ());
        let one = findings.iter().find(|one| one.check == check).unwrap_or_else(|| panic!("{check}: {findings:?}"));
        assert!(one.about == "material 'mast'" && one.to_string().contains(words), "{one:?}");
    };
    told(
        "thickness = 1\ndensity = 2700",
        "thickness",
        "thickness = 1 m is over a tenth of the part 'mast', which measures 2 m",
    );
    told("thickness = 0.002\ndensity = 2.7", "density", "multiply a value in g/cm3 by 1000");
    told("thickness = 1e-5\ndensity = 2700", "step", "is shorter than time.step = 60 s");
    let hot = only(&[("absorptivity = 0.85\nemissivity = 0.85", "absorptivity = 0.85\nemissivity = 0.1")], |_| ());
    // (0.85 x 1361 / (0.1 sigma) + 2.7^4)^(1/4)
    assert!(hot.check == "balance" && hot.message.contains("is 672.1 K"), "{hot:?}");
}

#[test]
fn coarse_meshes_are_told() {
    let coarse = ("max_edge = 0.7\n", "max_edge = \"file\"\n");
    let shadows = only(&[coarse, ("[environment]", "[shadows]\n[environment]")], |_| ());
    assert!(shadows.check == "mesh" && shadows.message.contains("too coarse for shadows"), "{shadows:?}");
    assert_eq!(found(&[("max_edge = 0.7\n", ""), ("[environment]", "[shadows]\n[environment]")], |_| ()), []);
    let sheet = "response = \"network\"\nthickness = 0.002\ndensity = 2700\nspecific_heat = 900\nconductivity = 200\n[radiance]";
    let conduction = found(&[coarse, (MAST, sheet)], |_| ());
    assert!(conduction.iter().any(|one| one.message.contains("too coarse for conduction")), "{conduction:?}");
    assert_eq!(found(&[(MAST, sheet)], |_| ()), []);
}

/// A sheet drawn twice stores and conducts twice. Its two sides, drawn as two faces that look apart, are a body.
#[test]
fn sheets_drawn_twice_are_told() {
    let sheet = "response = \"network\"\nthickness = 0.002\ndensity = 2700\nspecific_heat = 900\nconductivity = 200\n[radiance]";
    let doubled = |prepared: &mut Prepared, corners: fn([u32; 3]) -> [u32; 3]| {
        let again: Vec<[u32; 3]> = prepared.triangles.iter().map(|triangle| corners(*triangle)).collect();
        prepared.triangles.extend(again);
    };
    let twice = only(&[(MAST, sheet)], |prepared| doubled(prepared, |[a, b, c]| [c, a, b]));
    assert!(twice.check == "mesh" && twice.about == "part 'mast'", "{twice:?}");
    assert!(twice.message.contains("drawn twice in one place"), "{twice:?}");
    let back = found(&[(MAST, sheet)], |prepared| doubled(prepared, |[a, b, c]| [a, c, b]));
    assert!(back.iter().all(|one| !one.message.contains("drawn twice")), "{back:?}");
    let sides = "emissivity = 0.85\nsides = \"outside\"\nresponse = \"instant\"\n[radiance]";
    let both =
        format!("emissivity = 0.85\nsides = \"both\"\nback = {{ absorptivity = 0.5, emissivity = 0.8 }}\n{sheet}");
    let back = found(&[(sides, &both)], |prepared| doubled(prepared, |[a, b, c]| [a, c, b]));
    assert!(back.iter().any(|one| one.message.contains("drawn twice")), "{back:?}");
}

/// Issue 33, point 2: settings that ran without a word.
#[test]
fn settings_that_hardly_mean_what_they_say_are_told() {
    let sensor = |keys: &str| format!("[sensor]\n{keys}\n[[probe]]");
    let told = |keys: &str| found(&[("[[probe]]", &sensor(keys))], |_| ());
    assert_eq!(told("netd = 0.05\nrange = [200, 400]"), []);
    for (keys, about) in [
        ("netd = 50\nrange = [200, 400]", "sensor.netd"),
        ("netd = 0.05\nrange = [600, 900]", "sensor.range"),
        ("netd = 0.05\nrange = [400, 600]", "sensor.range"),
        ("netd = 0.05\nrange = [30, 60]", "sensor.range"),
    ] {
        let findings = told(keys);
        assert!(findings.len() == 1 && findings[0].about == about, "{keys}: {findings:#?}");
    }
    let range = &told("netd = 0.05\nrange = [400, 600]")[0];
    // (1361 / sigma + 2.7^4)^(1/4)
    assert!(range.message.contains("balance temperature of 393.6 K in full sunlight"), "{range:?}");
    let idle = only(&[("step = 60", "step = 60\nwarm_up_step = 30")], |_| ());
    assert!(idle.about == "time.warm_up_step" && idle.message.contains("no warm-up"), "{idle:?}");
    let probe = only(&[("position = [0, 5.5, 0]", "position = [0, 5500, 0]")], |_| ());
    assert!(probe.about == "probe 'tip'" && probe.message.contains("off the craft"), "{probe:?}");
    let cut = only(&[("look_at = [0, 0, 0]", "look_at = [0, 9.5, 0]")], |_| ());
    assert!(cut.check == "view" && cut.message.contains("lies within the frame"), "{cut:?}");
    let away = only(
        &[
            ("band_um = [8, 14]", "band_um = [8, 14]\nbackground = \"planet\""),
            ("fov_deg = 45", "fov_deg = 4"),
            ("position = [6.5, 5, -7.5]", "position = [20, 0, 199]"),
        ],
        |_| (),
    );
    assert!(away.check == "background" && away.message.contains("not in the frame"), "{away:?}");
    let seen = [
        ("band_um = [8, 14]", "band_um = [8, 14]\nbackground = \"planet\""),
        ("position = [6.5, 5, -7.5]", "position = [2, 0, -20]"),
    ];
    assert_eq!(found(&seen, |_| ()), [], "nadir is +Z");
    let sheet = (
        "sides = \"outside\"\nresponse = \"transition\"",
        "sides = \"both\"\nback = { absorptivity = 0.3, emissivity = 0.8 }\nresponse = \"transition\"",
    );
    let closed = only(&[sheet], |_| ());
    assert!(closed.check == "sides" && closed.message.contains("counts twice"), "{closed:?}");
}

/// Issue 33: all pixels were 0 in all images, and nobody said it.
#[test]
fn a_run_tells_images_at_an_end_of_the_range() {
    for (range, told) in [("[350, 600]", true), ("[200, 400]", false)] {
        let sensor = format!("[sensor]\nnetd = 0.05\nrange = {range}\n[[probe]]");
        let folder = Folder::new(&scene_with(&[
            ("[[probe]]", &sensor),
            ("absorptivity = 0.75", "absorptivity = 0.3"),
            ("absorptivity = 0.85", "absorptivity = 0.2"),
        ]));
        let ran = run(folder.0.path(), &["run", "scene.toml", "-o", "out", "--device", "cpu"]);
        let words = "in 4 of 4 images all pixels of the craft are at an end of the range";
        assert!(ran.code == 0 && ran.err.contains(words) == told, "{range}: {}", ran.err);
    }
}

/// Issue 33: the end of a run was not compared with the age of the elements.
#[test]
fn old_elements_are_told_at_the_end_of_a_run_too() {
    let orbit = "altitude = 408e3\nperiod = 5553.6\nbeta_deg = 20\nphase_deg = 80";
    let ran = |steps: &str| {
        let steps = format!("steps = {steps}\nstart = \"2023-11-01T00:00:00Z\"");
        let changes = [
            (orbit, "file = \"x.tle\""),
            ("step = 60", "step = 3600"),
            ("steps = 12", &steps),
            ("eclipse = true\n", ""),
        ];
        let folder = Folder::new(&scene_with(&changes));
        folder.write(
            "x.tle",
            "1 25544U 98067A   23302.71093069  .00024763  00000+0  44330-3 0  9993\n2 25544  51.6441  22.2092 0000603  68.5079  66.2522 15.49821000422656\n",
        );
        run(folder.0.path(), &["check", "scene.toml"])
    };
    assert!(!ran("100").out.contains("from the epoch"));
    let late = ran("2000");
    assert!(late.out.contains("time 7200000 s is 86 days from the epoch of the elements"), "{} {}", late.out, late.err);
    let sunk = ran("20000").err;
    assert!(sunk.contains("of 6371 km: the elements are ") && sunk.contains("take elements of that time"), "{sunk}");
}

/// A camera without a pose sees the whole craft.
#[test]
fn a_camera_without_a_pose_frames_the_craft() {
    let pose = "frame = \"body\"\nposition = [6.5, 5, -7.5]\nlook_at = [0, 0, 0]\nup = [0, 0, -1]\n";
    let checked = |changes: &[(&str, &str)]| {
        let prepared = Folder::new(&scene_with(changes)).prepared();
        assert!(prepared.scene.assumptions.iter().any(|told| told.contains("sees the whole craft from")));
        let value = serde_json::to_value(check(&prepared, CheckEffort::WHOLE)).expect("JSON");
        assert_eq!(value["findings"], json!([]));
        let size: Vec<f64> = value["sight"]["first_px"]
            .as_array()
            .expect("a size")
            .iter()
            .filter_map(serde_json::Value::as_f64)
            .collect();
        (
            size,
            [
                prepared.scene.camera.as_ref().expect("a camera").width,
                prepared.scene.camera.as_ref().expect("a camera").height,
            ],
        )
    };
    for changes in [
        vec![(pose, "")],
        vec![(pose, ""), ("fov_deg = 45", "fov_deg = 5")],
        vec![(pose, ""), ("width = 96", "width = 40")],
    ] {
        let (size, image) = checked(&changes);
        let shares = [size[0] / f64::from(image[0]), size[1] / f64::from(image[1])];
        let most = shares[0].max(shares[1]);
        assert!(most < 1.0 && most > 0.4, "{changes:?}: {shares:?}");
    }
}

#[test]
fn the_command_tells_and_writes_what_it_says() {
    let folder = Folder::new(SCENE);
    let at = folder.0.path();
    let text = succeed(at, &["check", "scene.toml", "-o", "pictures"]);
    for words in [
        "craft: 2 x 11 x 4 m, 4 parts",
        "tau/step",
        "in view in 4 of 4 images",
        "nothing is probably wrong",
        "mast",
        "transition",
    ] {
        assert!(text.contains(words), "{words}: {text}");
    }
    for name in ["materials.png", "craft.png"] {
        let bytes = std::fs::read(folder.path("pictures").join(name)).unwrap();
        assert!(bytes.starts_with(b"\x89PNG") && bytes.len() > 1000, "{name}");
    }
    let value = program::json(at, &["check", "scene.toml", "--json"]);
    assert_eq!(value["checked"]["findings"].as_array().map(Vec::len), Some(0), "{value}");
    assert_eq!(value["checked"]["materials"].as_array().map(Vec::len), Some(3), "{value}");
}

#[test]
fn warnings_end_well_unless_strict_and_a_run_tells_them_too() {
    let folder =
        Folder::new(&scene_with(&[("look_at = [0, 0, 0]", "look_at = [13, 10, -15]"), ("steps = 12", "steps = 4")]));
    let at = folder.0.path();
    let text = succeed(at, &["check", "scene.toml"]);
    assert!(text.contains("warning: camera: the craft is not in view in 2 of 2 images"), "{text}");
    let strict = run(at, &["check", "scene.toml", "--strict"]);
    assert!(strict.code == 2 && strict.err.contains("error: 1 of the warnings"), "{}", strict.err);
    let ran = run(at, &["run", "scene.toml", "-o", "out", "--device", "cpu"]);
    assert!(ran.code == 0 && ran.err.matches("the craft is not in view").count() == 1, "{}", ran.err);
    let report = std::fs::read_to_string(folder.path("out/report.json")).unwrap();
    assert_eq!(report.matches("the craft is not in view").count(), 1);
    let still = run(at, &["render", "scene.toml", "--time", "0", "-o", "still.exr", "--device", "cpu"]);
    assert!(still.code == 0 && still.err.contains("not in view in the image, first at 0 s"), "{}", still.err);
}

/// Issue 33: only run, render, view and check told what is probably wrong.
#[test]
fn every_program_that_prepares_a_scene_tells_its_mistakes_once() {
    let scene = scene_with(&[("[[probe]]", "[sensor]\nnetd = 50\nrange = [200, 400]\n[[probe]]")]);
    let folder = Folder::new(&scene);
    let spec = "scene = \"scene.toml\"\nsamples = 1\nposes_per_orbit = 1\nimages = [\"numbers\"]\n[camera]\nkind = \"shell\"\ndistance = 30\n";
    folder.write("spec.toml", spec);
    for arguments in [
        &["dataset", "spec.toml", "-o", "set", "--device", "cpu"][..],
        &["dataset", "preview", "spec.toml", "-o", "sheet.png", "--device", "cpu"],
        &["info", "scene.toml"],
        &["serve", "scene.toml", "--protocol", "telemetry", "--listen", "127.0.0.1:0", "--device", "none"],
    ] {
        let ran = run(folder.0.path(), arguments);
        assert_eq!(ran.err.matches("a noise of 50 K hides a craft").count(), 1, "{arguments:?}: {}", ran.err);
        assert_eq!(ran.code == 0, !arguments.contains(&"none"), "{arguments:?}: {}", ran.err);
    }
    let simulation = Simulation::load(&folder.path("scene.toml"), &Target::Reference).expect("a scene");
    assert_eq!(simulation.warnings().iter().filter(|warning| warning.contains("hides a craft")).count(), 1);
}

/// Issue 33: a rule that matches nothing was a remark, also with `--strict`.
#[test]
fn a_rule_that_matches_nothing_is_a_warning() {
    let rule =
        "[[material]]\nmatch = \"FOIL\"\nabsorptivity = 0.5\nemissivity = 0.5\nresponse = \"instant\"\n[[probe]]";
    let idle = only(&[("[[probe]]", rule)], |_| ());
    assert!(idle.check == "names" && idle.message.contains("'FOIL' of rule 4 matches no material"), "{idle:?}");
    let folder = Folder::new(&scene_with(&[("[[probe]]", rule)]));
    let strict = run(folder.0.path(), &["check", "scene.toml", "--strict"]);
    assert!(strict.code == 2 && strict.out.matches("'FOIL'").count() == 1, "{} {}", strict.out, strict.err);
}

#[test]
fn all_errors_of_a_file_are_told_and_nothing_is_written() {
    let folder =
        Folder::new(&scene_with(&[("step = 60", "step = -1"), ("fov_deg = 45", "fov_deg = 450"), ("albedo", "albdo")]));
    let at = folder.0.path();
    for arguments in [
        vec!["check", "scene.toml", "-o", "out"],
        vec!["run", "scene.toml", "-o", "out"],
        vec!["render", "scene.toml", "--time", "0", "-o", "out"],
        vec!["compare", "scene.toml", "-o", "out"],
    ] {
        let output = program::end(program::isotherm(at, &arguments));
        let text = stderr(&output);
        let errors: Vec<&str> = text.lines().filter(|line| line.starts_with("error: ")).collect();
        assert_eq!(refusal(&output).0, Some(2), "{text}");
        let [step, albedo, fov] = errors.as_slice() else { panic!("{arguments:?}: {text}") };
        assert!(step.contains("scene.toml:6: time.step: must be"), "{step}");
        assert!(albedo.contains("environment.albdo: unknown key; did you mean 'albedo'?"), "{albedo}");
        assert!(fov.contains("camera.fov_deg: must be"), "{fov}");
        assert!(!folder.path("out").exists(), "{arguments:?}");
    }
}

/// Warnings of the craft's scene with more lines, after a change to its model.
fn remarks(more: &str, change: impl FnOnce(&mut Maker)) -> Vec<String> {
    let folder = Folder::new(&format!("{SCENE}{more}"));
    let mut maker = glb();
    change(&mut maker);
    maker.save(folder.0.path());
    folder.prepared().warnings
}

#[test]
fn only_animations_that_no_joint_plays_are_called_left_out() {
    let animated = |names: &'static [&'static str]| {
        move |maker: &mut Maker| {
            let bytes = |values: &[f32]| values.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<u8>>();
            let scalars = json!({"componentType": 5126, "count": 2, "type": "SCALAR"});
            let input = maker.accessor(&bytes(&[0.0, 600.0]), scalars);
            let turns = json!({"componentType": 5126, "count": 2, "type": "VEC4"});
            let output = maker.accessor(&bytes(&[0.0, 0.0, 0.0, 1.0, 0.6, 0.0, 0.0, 0.8]), turns);
            let node = maker.json["nodes"].as_array().expect("a list").iter().position(|n| n["name"] == "wing_port");
            let animation = |name: &&str| {
                json!({
                    "name": name,
                    "samplers": [{"input": input, "output": output, "interpolation": "LINEAR"}],
                    "channels": [{"sampler": 0, "target": {"node": node, "path": "rotation"}}]
                })
            };
            maker.json["animations"] = names.iter().map(animation).collect();
        }
    };
    let about = |more: &str, names: &'static [&'static str]| -> Vec<String> {
        let all = remarks(more, animated(names));
        all.into_iter().filter(|remark| remark.contains("animation")).collect()
    };
    let joint = "[[joint]]\npart = \"wing_port\"\nmode = \"animation\"\nanimation = \"unfold\"\n";
    assert_eq!(about(joint, &["unfold"]), Vec::<String>::new());
    let left = "1 animation left out, because no [[joint]] plays it: 'fold'";
    assert_eq!(about(joint, &["unfold", "fold"]), [left]);
    let left = "2 animations left out, because no [[joint]] plays it: 'unfold', 'fold'";
    assert_eq!(about("", &["unfold", "fold"]), [left]);
}

#[test]
fn a_warning_about_the_step_names_the_step_of_the_scene() {
    let folder = Folder::new(&scene_with(&[("step = 60", "step = 600"), ("steps = 12", "steps = 2")]));
    let warnings = folder.prepared().warnings.join("\n");
    assert!(warnings.contains("a step of 600 s is 38.9 deg of the orbit"), "{warnings}");
    assert!(!warnings.contains("tick") && !warnings.contains("17 s"), "{warnings}");
}

#[test]
fn all_names_that_the_model_lacks_are_told() {
    let folder = Folder::new(&scene_with(&[
        ("match = \"mast\"", "match = \"mst\""),
        ("part = \"wing_starboard\"", "part = \"wing\""),
    ]));
    folder.write(
        "scene.toml",
        &(std::fs::read_to_string(folder.path("scene.toml")).unwrap()
            + "[[joint]]\npart = \"hinge\"\nmode = \"fixed\"\naxis = \"+X\"\nangle_deg = 5\n"),
    );
    let ran = run(folder.0.path(), &["check", "scene.toml"]);
    let errors: Vec<&str> = ran.err.lines().filter(|line| line.starts_with("error: ")).collect();
    assert!(ran.code == 2 && errors.len() == 3, "{}", ran.err);
    for words in ["give values to 1 of", "has no node 'hinge'", "has no part 'wing'; did you mean 'wing_"] {
        assert!(errors.iter().any(|error| error.contains(words)), "{words}: {}", ran.err);
    }
}

#[test]
fn the_scenes_of_this_repository_are_not_warned_of() {
    let models = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("models");
    let mut scenes = vec!["cubesat.toml", "cubesat_conduction.toml", "station.toml", "station_transition.toml"];
    if shared().is_some() {
        scenes.extend(["iss.toml", "iss_transition.toml"]);
    }
    for name in scenes {
        let value = program::json(&models, &["check", name, "--json", "--allow-outside"]);
        assert_eq!(
            value["checked"]["findings"].as_array().map(Vec::len),
            // The arrays of the ISS are closed slabs that its scenes take as sheets, as iss.toml says. Two radiators of the network have both faces in one place.
            Some(usize::from(name.starts_with("iss")) + usize::from(name == "iss.toml")),
            "{name}: {:#}",
            value["checked"]["findings"]
        );
    }
}
