//! What files may name, hold and ask for: folders, kinds of files, sizes of numbers, and bounds on work.

use std::path::Path;
use std::time::Instant;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use isotherm::internals::{Function, Model, NetworkFile, Prepared};
use isotherm::{Reach, Scene, internals};
use serde_json::{Value, json};

use super::craft::{Folder, SCENE, scene_with};
use super::model::make::Maker;
use super::program::{end, isotherm, refusal, stderr, succeed};

const TLE: &str = include_str!("../../models/iss.tle");

/// A folder with a scene in `scenes/`, and files beside that folder that it must not read.
fn neighbours() -> Folder {
    let folder = Folder::new(SCENE);
    let inside = folder.path("scenes");
    std::fs::create_dir(&inside).unwrap();
    std::fs::copy(folder.path("made.glb"), inside.join("made.glb")).unwrap();
    folder.write("outside.tle", TLE);
    folder.write("outside.csv", "time,temperature\n0,300\n10,280\n");
    folder.write(
        "outside.toml",
        "[paint]\nfinish = 'none'\nabsorptivity = 0.2\nemissivity = 0.8\noptics_source = 'none'\n",
    );
    folder
}

/// The edit of `SCENE` that names `path` where a scene can name a file of this kind.
fn naming(kind: &str, path: &str) -> String {
    match kind {
        "glb" => scene_with(&[("path = \"made.glb\"", &format!("path = '{path}'"))]),
        "tle" => {
            let circular = "altitude = 408e3\nperiod = 5553.6\nbeta_deg = 20\nphase_deg = 80";
            scene_with(&[(circular, &format!("file = '{path}'"))])
        }
        "toml" => format!("{SCENE}[materials]\ntable = '{path}'\n"),
        _ => scene_with(&[(
            "heating = { function = \"quadratic\", t_max_steps = 20 }",
            &format!("heating = {{ function = 'table', file = '{path}', t_max_steps = 20 }}"),
        )]),
    }
}

#[test]
fn a_scene_names_files_of_its_own_folder() {
    let folder = neighbours();
    std::fs::rename(folder.path("made.glb"), folder.path("outside.glb")).unwrap();
    for kind in ["glb", "tle", "toml", "csv"] {
        let name = format!("outside.{kind}");
        let link = format!("link.{kind}");
        std::os::unix::fs::symlink(folder.path(&name), folder.path("scenes").join(&link)).unwrap();
        let absolute = folder.path(&name).display().to_string();
        for path in [format!("../{name}"), format!("../scenes/../{name}"), absolute, link] {
            let scene = folder.write("scenes/scene.toml", &naming(kind, &path));
            let message = Scene::load(&scene).expect_err(&path).to_string();
            assert!(message.contains("lies outside") && message.contains("--allow-outside"), "{path}: {message}");
            assert!(message.contains("scene.toml:"), "{message}");
            Scene::load_within(&scene, Reach::Anywhere).unwrap_or_else(|error| panic!("{path}: {error}"));
        }
    }
    let scene = folder.write("scenes/scene.toml", &naming("glb", "../outside.glb"));
    let scene = scene.to_str().unwrap();
    for command in [vec!["info", scene], vec!["render", scene, "--time", "0", "-o", "x.exr", "--device", "cpu"]] {
        let (code, message) = refusal(&end(isotherm(folder.0.path(), &command)));
        assert!(code == Some(2) && message.contains("--allow-outside"), "{message}");
        succeed(folder.0.path(), &[&command[..], &["--allow-outside"]].concat());
    }
}

#[test]
fn a_scene_names_regular_files() {
    let folder = neighbours();
    let pipe = folder.path("scenes/pipe");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    std::os::unix::fs::symlink("/dev/zero", folder.path("scenes/zero")).unwrap();
    for kind in ["glb", "tle", "toml", "csv"] {
        for (path, what) in [("pipe", "a pipe"), ("zero", "a device"), ("../scenes", "a directory")] {
            let scene = folder.write("scenes/scene.toml", &naming(kind, path));
            let message = Scene::load_within(&scene, Reach::Anywhere).expect_err(path).to_string();
            assert!(message.contains(what), "{kind} {path}: {message}");
        }
    }
}

/// The cube with its buffer under a URI.
fn cube_with(uri: &str) -> Vec<u8> {
    let mut json = Maker::cube().json;
    json["buffers"][0]["uri"] = json!(uri);
    json.to_string().into_bytes()
}

#[test]
fn a_gltf_names_regular_files_of_its_folder() {
    let folder = neighbours();
    let binary = Maker::cube().binary;
    std::fs::write(folder.path("outside.bin"), &binary).unwrap();
    std::fs::write(folder.path("scenes/in side.bin"), &binary).unwrap();
    std::os::unix::fs::symlink(folder.path("outside.bin"), folder.path("scenes/link.bin")).unwrap();
    std::os::unix::fs::symlink("in side.bin", folder.path("scenes/inner.bin")).unwrap();
    std::os::unix::fs::symlink("/dev/zero", folder.path("scenes/zero.bin")).unwrap();
    assert!(std::process::Command::new("mkfifo").arg(folder.path("scenes/pipe.bin")).status().unwrap().success());
    let path = folder.path("scenes/cube.gltf");
    let load = |uri: &str| {
        std::fs::write(&path, cube_with(uri)).unwrap();
        Model::load(&path)
    };
    for uri in ["in%20side.bin", "inner.bin", "../scenes/in side.bin"] {
        assert_eq!(load(uri).unwrap_or_else(|error| panic!("{uri}: {error}")).triangles.len(), 12);
    }
    let absolute = folder.path("outside.bin").display().to_string();
    let encoded = absolute.replace('/', "%2F");
    for uri in ["../outside.bin", "%2e%2e/outside.bin", "..%2Foutside.bin", &absolute, &encoded, "link.bin"] {
        let message = load(uri).expect_err(uri).to_string();
        assert!(message.contains("buffer 0") && message.contains("--allow-outside"), "{uri}: {message}");
        Model::load_within(&path, &Reach::Anywhere).unwrap();
    }
    for (uri, what) in [("zero.bin", "a device"), ("pipe.bin", "a pipe"), (".", "a directory")] {
        load(uri).expect_err(uri);
        let message = Model::load_within(&path, &Reach::Anywhere).expect_err(uri).to_string();
        assert!(message.contains(what), "{uri}: {message}");
    }
}

/// A terabyte of holes behind the bytes that count.
#[test]
fn no_more_of_a_buffer_is_read_than_its_length() {
    let folder = neighbours();
    let file = std::fs::File::create(folder.path("scenes/long.bin")).unwrap();
    std::io::Write::write_all(&mut &file, &Maker::cube().binary).unwrap();
    file.set_len(1 << 40).unwrap();
    let path = folder.path("scenes/cube.gltf");
    std::fs::write(&path, cube_with("long.bin")).unwrap();
    assert_eq!(Model::load(&path).unwrap().triangles.len(), 12);
    let mut json = Maker::cube().json;
    json["buffers"][0] = json!({"uri": "long.bin", "byteLength": 1u64 << 50});
    std::fs::write(&path, json.to_string()).unwrap();
    assert!(Model::load(&path).unwrap_err().to_string().contains("needs 1125899906842624 bytes"));
}

/// The program gets 64 MiB more memory than twice the URI. The slashes are escaped, as PHP writes JSON.
#[test]
#[ignore = "long: tools/test --all"]
fn a_data_uri_takes_twice_its_length() {
    const LENGTH: usize = 150 << 20;
    let folder = neighbours();
    let mut binary = Maker::cube().binary;
    binary.resize(LENGTH, 0xff);
    let data = STANDARD.encode(&binary).replace('/', "\\/");
    // Each escape counts as one character of the URI.
    assert!(data.len() > LENGTH);
    let mut json = Maker::cube().json;
    json["buffers"][0] = json!({"uri": "URI", "byteLength": LENGTH});
    let text = json.to_string().replace("URI", &format!("data:application\\/octet-stream;base64,{data}"));
    folder.write("scenes/big.gltf", &text);
    let limit = (2 * text.len() + (64 << 20)) >> 10;
    let script = format!("ulimit -v {limit}; exec \"$0\" info scenes/big.gltf");
    let output = std::process::Command::new("bash")
        .args(["-c", &script, env!("CARGO_BIN_EXE_isotherm")])
        .current_dir(folder.0.path())
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

fn with_points(value: &mut Value) {
    match value {
        Value::Array(items) => items.iter_mut().for_each(with_points),
        Value::Object(items) => items.values_mut().for_each(with_points),
        Value::Number(number) => *value = json!(number.as_f64().unwrap()),
        _ => {}
    }
}

#[test]
fn whole_numbers_of_a_gltf_may_have_a_point() {
    let mut maker = Maker::cube();
    with_points(&mut maker.json);
    assert!(maker.json.to_string().contains("\"componentType\":5126.0"));
    let folder = tempfile::tempdir().unwrap();
    assert_eq!(Model::load(&maker.save(folder.path())).unwrap().triangles.len(), 12);
    let mut maker = Maker::cube();
    maker.json["accessors"][0]["count"] = json!(7.5);
    assert!(Model::load(&maker.save(folder.path())).unwrap_err().to_string().contains("accessor 0"));
}

/// Issues 29.8 and 31.7: rounding leaves such numbers, in a probe and in the heat of an exported network.
#[test]
fn a_number_too_small_for_its_unit_counts_as_0_and_is_told_once() {
    let folder = Folder::new(&scene_with(&[]));
    let of_small = |assumptions: &[String]| -> Vec<String> {
        assumptions.iter().filter(|text| text.contains("counts as 0")).cloned().collect()
    };
    let scene = scene_with(&[("position = [0, 5.5, 0]", "position = [6e-17, 5.5, -1e-300]")]);
    let scene = Scene::parse(&scene, &folder.path("scene.toml")).expect("a scene");
    assert_eq!(scene.probes[0].position.to_array(), [0.0, 5.5, 0.0]);
    let told = of_small(&scene.assumptions);
    assert!(told.len() == 1 && told[0].contains("probe.position: 6e-17") && told[0].contains("first of 2"), "{told:?}");
    let node = "[[node]]\nlabel = 'a'\nkind = 'diffusive'\ncapacitance = 1\ntemperature = 300\nheat = ";
    let network =
        |heat: &str| NetworkFile::parse(&format!("{node}{heat}\n"), Path::new("net.toml")).expect("a network");
    let told = of_small(&network("{ time = [0, 9], power = [-6.7e-16, 5] }").assumptions);
    assert!(told.len() == 1 && told[0].contains("net.toml:6: node.heat.power: -6.7e-16"), "{told:?}");
    assert_eq!(of_small(&network("5").assumptions), Vec::<String>::new());
    assert_eq!(
        of_small(&Scene::parse(&scene_with(&[]), &folder.path("scene.toml")).expect("a scene").assumptions).len(),
        0
    );
}

#[test]
fn numbers_beyond_reason_are_refused_where_they_stand() {
    let folder = Folder::new(SCENE);
    let joint = |keys: &str| format!("{SCENE}[[joint]]\npart = 'wing_starboard'\naxis = '+Y'\n{keys}\n");
    let sun = "mode = 'sun'\nsun_axis = '-Z'\n";
    let cases = [
        (joint(&format!("{sun}rate_deg = 1e-50")), "joint.rate_deg: must be"),
        (joint(&format!("{sun}rate_deg = 5e-324")), "joint.rate_deg: must be"),
        (joint(&format!("{sun}rate_deg = 1e300")), "joint.rate_deg: must be"),
        (joint(&format!("{sun}limits_deg = [-120, 1e38]")), "joint.limits_deg: must be"),
        (joint("mode = 'schedule'\nschedule = { time = [0], angle_deg = [1e308] }"), "schedule.angle_deg: must be"),
        (joint("mode = 'schedule'\nschedule = { time = [1.8e19], angle_deg = [1] }"), "schedule.time: must be"),
        (scene_with(&[("max_edge = 0.7", "max_edge = 1e-320")]), "model.max_edge: must be"),
        (scene_with(&[("phase_deg = 80", "phase_deg = 1e300")]), "orbit.phase_deg: must be"),
        (scene_with(&[("planet_radius = 6371e3", "planet_radius = 1e300")]), "environment.planet_radius: must be"),
        (scene_with(&[("position = [0, 5.5, 0]", "position = [0, 1e200, 0]")]), "probe.position: must be"),
        (scene_with(&[("t_max_steps = 30", "t_max_steps = 1e-300")]), "t_max_steps: must be"),
        (scene_with(&[("t_max_steps = 30", "t_max = 1e300")]), "t_max: must be"),
        (
            scene_with(&[("\"quadratic\", t_max_steps = 20", "\"exponential\", rate = 5e-324, t_max_steps = 20")]),
            "the rate of 'exponential' must be from 1e-9",
        ),
        (
            scene_with(&[(
                "\"quadratic\", t_max_steps = 20",
                "\"polynomial\", coefficients = [0, 1e308, -1e308, 1], t_max_steps = 20",
            )]),
            "a polynomial needs coefficients",
        ),
    ];
    for (scene, said) in cases {
        let message = Scene::parse(&scene, &folder.path("scene.toml")).expect_err(said).to_string();
        assert!(message.contains(said), "{said}: {message}");
    }
    let network = |node: &str| {
        let text = format!("[[node]]\nlabel = 'a'\nkind = 'diffusive'\ncapacitance = 1\ntemperature = 300\n{node}\n");
        NetworkFile::parse(&text, Path::new("net.toml")).map_err(|error| error.to_string())
    };
    assert!(network("heat = 5").is_ok());
    // A number too small for its unit counts as 0, and the file's assumptions tell it.
    let told = network("emissive_area = 1e-320").expect("it counts as 0").assumptions;
    assert!(told.iter().any(|line| line.contains("node.emissive_area: 1e-320 is too small")), "{told:?}");
    for (node, said) in [
        ("heat = 1e19", "node.heat: must be"),
        ("heat = { time = [0, 1.8e19], power = [1, 2] }", "node.heat.time: must be"),
        ("[output]\ntimes = [1e300]", "output.times: must be"),
    ] {
        let message = network(node).expect_err(node);
        assert!(message.contains(said), "{message}");
    }
    let table = |text: &str| Function::parse_table(text, Path::new("t.csv"), None).map_err(|error| error.to_string());
    assert!(table("time,temperature\n0,300\n10,200\n20,199\n").is_ok());
    for text in [
        "time,temperature\n0,300\n1.8e19,200\n",
        "time,temperature\n0,300\n1,1e300\n",
        "time,temperature\n0,300\n1e-300,250\n10,200\n",
        "time,temperature\n0,5e-324\n10,1e-323\n",
    ] {
        assert!(table(text).is_err(), "{text}");
    }
}

#[test]
fn elements_that_are_no_numbers_are_refused() {
    let path = Path::new("iss.tle");
    assert!(internals::trajectory(TLE, path).is_ok());
    for (from, to, field) in [
        (" 51.6441", "     NaN", "inclination"),
        (" 22.2092", "     inf", "right ascension"),
        (" 68.5079", "     nan", "argument of perigee"),
        (" 66.2522", "    -inf", "mean anomaly"),
        ("15.49821000", "        NaN", "mean motion"),
        ("15.49821000", "-1.49821000", "mean motion"),
    ] {
        let lines: Vec<&str> = TLE.lines().collect();
        let second = lines[2].replacen(from, to, 1);
        assert_ne!(second, lines[2]);
        // The sum of the digits, where a minus counts 1, makes the line valid.
        let digit = |letter: char| if letter == '-' { 1 } else { letter.to_digit(10).unwrap_or(0) };
        let sum = second[..68].chars().map(digit).sum::<u32>() % 10;
        let text = format!("{}\n{}{sum}\n", lines[1], &second[..68]);
        let message = internals::trajectory(&text, path).expect_err(field).to_string();
        assert!(message.contains(field), "{message}");
    }
}

#[test]
fn elements_without_a_checksum_are_refused() {
    let text = TLE.replacen("9993", "999!", 1);
    let message = internals::trajectory(&text, Path::new("iss.tle")).unwrap_err().to_string();
    assert!(message.contains("in column 69 is no digit"), "{message}");
}

#[test]
fn work_without_bounds_is_refused_before_it_begins() {
    let folder = Folder::new(SCENE);
    let rated = "[[joint]]\npart = 'wing_starboard'\naxis = '+Y'\nmode = 'sun'\nsun_axis = '-Z'\nrate_deg = 0.1\n";
    let cases = [
        (scene_with(&[("steps = 12", "steps = 4294967295")]), "time.steps: asks for too much work"),
        (
            scene_with(&[("step = 60\n", "step = 1e6\n"), ("steps = 12", "steps = 1000000")]),
            "time.steps: asks for too much work",
        ),
        (
            scene_with(&[("steps = 12", "steps = 12\nwarm_up_orbits = 1e6"), ("step = 60\n", "step = 1\n")]),
            "time.warm_up_orbits: asks",
        ),
        (
            scene_with(&[
                ("steps = 12", "steps = 900000000"),
                ("step = 60\n", "step = 1\n"),
                ("draw_every = 4", "draw_every = 1"),
            ]),
            "time.draw_every: asks for too much work",
        ),
        (
            scene_with(&[
                ("steps = 12", "steps = 12\nwarm_up = 'periodic'\nwarm_up_orbits = 1e6"),
                ("step = 60\n", "step = 1\n"),
            ]),
            "time.warm_up_orbits: asks for too much work: a warm-up of",
        ),
    ];
    for (scene, said) in cases {
        let path = folder.write("long.toml", &scene);
        let began = Instant::now();
        let error = Prepared::new(&path, &mut |_| ()).err().unwrap_or_else(|| panic!("{said}")).to_string();
        assert!(error.contains(said), "{said}: {error}");
        assert!(began.elapsed().as_secs_f64() < 5.0, "{said}");
    }
    for time in ["9e10", "1e12", "1e300"] {
        let arguments = ["render", "scene.toml", "--time", time, "-o", "x.exr", "--device", "cpu"];
        let (code, message) = refusal(&end(isotherm(folder.0.path(), &arguments)));
        assert!(code == Some(2) && message.contains("limit"), "{message}");
    }
    // A joint with a rate is walked as the run goes on, and not before: 9e8 steps, and 10,000 orbits before them that end at the first that repeats.
    let scene = scene_with(&[
        ("steps = 12", "steps = 900000000\nwarm_up_orbits = 10000"),
        ("draw_every = 4", "draw_every = 0"),
        ("step = 60\n", "step = 1\n"),
    ]);
    let began = Instant::now();
    Prepared::new(&folder.write("long.toml", &(scene + rated)), &mut |_| ()).unwrap();
    assert!(began.elapsed().as_secs_f64() < 5.0, "{:?}", began.elapsed());
}

/// 93 steps an orbit; 72 x 96 pixels of 23 bytes; rows of 3 x (1 + 4 parts + 3 materials) + 1 numbers of 11 bytes and a time.
#[test]
fn the_work_of_a_run_is_told_before_its_first_step() {
    let folder = Folder::new(&scene_with(&[("steps = 12", "steps = 12\nwarm_up_orbits = 2")]));
    let told = "forecast: 185 steps of warm-up, 12 steps and 4 images; at most 639.7 kB of files; about ";
    let said = stderr(&end(isotherm(folder.0.path(), &["run", "scene.toml", "-o", "out", "--device", "cpu"])));
    assert!(said.contains(told), "{said}");
    let report = std::fs::read_to_string(folder.path("out/report.html")).unwrap();
    assert!(report.contains("Forecast before the first step"));
    let periodic = scene_with(&[("steps = 12", "steps = 12\nwarm_up = 'periodic'\nwarm_up_orbits = 30")]);
    folder.write("scene.toml", &periodic);
    let info = succeed(folder.0.path(), &["info", "scene.toml"]);
    for (name, value) in [("steps of the warm-up", "at most 2790"), ("images", "4"), ("files", "at most 639.7 kB")] {
        let row =
            info.lines().find(|line| line.trim_start().starts_with(name)).unwrap_or_else(|| panic!("{name}: {info}"));
        assert!(row.trim_end().ends_with(value), "{row}");
    }
    folder.write(
        "net.toml",
        "[[node]]\nlabel = 'a'\nkind = 'diffusive'\ncapacitance = 100\ntemperature = 300\nheat = { time = [0, 10, 50], power = [1, 2, 2] }\n\
         [output]\ntimes = [0, 20, 60]\n",
    );
    let said = stderr(&end(isotherm(folder.0.path(), &["network", "net.toml", "--device", "cpu"])));
    let told = "forecast: 3 output times to 60 s for 1 nodes and 0 thermostats; at most 102 bytes of CSV; from 4 to 1e10 sub-steps";
    assert!(said.contains(told), "{said}");
}

/// A jump of 4e-5 that the function makes up for between two of the places that a quick look takes.
#[test]
fn a_function_that_hides_its_jump_is_refused_when_the_scene_is_prepared() {
    let text = "s < 0.233785 ? s : max(s, min(0.233825, s + 4e8*(s-0.233785)))";
    assert!(Function::expression(text).is_ok(), "the quick look does not find it");
    let folder = Folder::new(&scene_with(&[(
        "heating = { function = \"quadratic\", t_max_steps = 20 }",
        &format!("heating = {{ function = 'expression', text = '{text}', t_max_steps = 20 }}"),
    )]));
    let (code, line) = refusal(&end(isotherm(folder.0.path(), &["run", "scene.toml", "-o", "out", "--device", "cpu"])));
    assert!(
        code == Some(2) && line.contains("material 'skin': expression: changes too fast near s = 0.2337"),
        "{line}"
    );
    assert!(!folder.path("out").exists());
}

#[test]
fn xml_of_many_attributes_and_deep_tags_is_refused_at_once() {
    let began = Instant::now();
    let attributes: String = (0..100_000).map(|number| format!(" a{number}=\"1\"")).collect();
    let tags = [
        (format!("<ndm{attributes}><oem/></ndm>"), "attributes"),
        ("<oem>".repeat(200_000), "deep"),
        (format!("<ndm>{}</ndm>", "<!-- <a b=\"1\"> -->".repeat(100_000)), "holds no <oem>"),
    ];
    for (text, said) in tags {
        let message = internals::trajectory(&text, Path::new("made.oem")).expect_err(said).to_string();
        assert!(message.contains(said), "{message}");
    }
    assert!(began.elapsed().as_secs_f64() < 2.0, "{:?}", began.elapsed());
}

#[test]
fn a_plate_s_altitude_is_in_metres() {
    let folder = tempfile::tempdir().unwrap();
    let plate = |altitude: &str| {
        end(isotherm(folder.path(), &["environment", "plate", "--altitude", altitude, "--nadir-angle", "0"]))
    };
    let (code, message) = refusal(&plate("540"));
    assert!(code == Some(2) && message.contains("it is in metres"), "{message}");
    assert!(plate("540e3").status.success());
}

/// It gets as far as the device, which does not exist.
#[test]
fn the_paper_needs_no_repository() {
    let folder = tempfile::tempdir().unwrap();
    let (code, message) = refusal(&end(isotherm(folder.path(), &["paper", "-o", "out", "--device", "no such device"])));
    assert!(code == Some(2) && message.contains("no such device"), "{message}");
}

#[test]
fn networks_targets_and_data_may_come_through_a_pipe() {
    let folder = tempfile::tempdir().unwrap();
    let network = concat!(env!("CARGO_MANIFEST_DIR"), "/models/cubesat_network.toml");
    let through = |arguments: &[&str]| {
        let mut command = isotherm(folder.path(), arguments);
        let mut cat =
            std::process::Command::new("cat").arg(network).stdout(std::process::Stdio::piped()).spawn().unwrap();
        command.stdin(cat.stdout.take().unwrap());
        let output = end(command);
        cat.wait().unwrap();
        output
    };
    assert!(through(&["network", "/dev/stdin", "--steady", "--device", "cpu"]).status.success());
    let (code, message) = refusal(&through(&["info", "/dev/stdin"]));
    assert!(code == Some(2) && message.contains("only regular files"), "{message}");
}

#[test]
fn elements_hold_for_a_year_only() {
    let folder = Folder::new(SCENE);
    folder.write("iss.tle", TLE);
    let circular = "altitude = 408e3\nperiod = 5553.6\nbeta_deg = 20\nphase_deg = 80";
    let scene = |start: &str| {
        let text = scene_with(&[(circular, "file = 'iss.tle'"), ("[time]", &format!("[time]\nstart = '{start}'"))]);
        let scene = Scene::parse(&text, &folder.path("scene.toml")).map_err(|error| error.to_string())?;
        let sky = internals::SkyModel::new(&scene.orbit, &scene.attitude, &scene.environment)
            .map_err(|error| error.to_string())?;
        sky.check(0.0, 5000.0).map_err(|error| error.to_string()).map(|()| scene.assumptions)
    };
    let told = |start: &str| scene(start).expect(start).iter().any(|said| said.contains("days from time 0"));
    assert!(!told("2023-10-29T18:00:00") && told("2023-11-20T18:00:00"));
    let months = scene("2024-01-29T18:00:00").expect("three months");
    assert!(months.iter().any(|said| said.contains("a guess after a month")), "{months:?}");
    for start in ["1900-01-01T00:00:00", "1957-10-04T00:00:00", "2024-11-01T00:00:00", "2200-01-01T00:00:00"] {
        let message = scene(start).expect_err(start);
        assert!(message.contains("days away") && message.contains("elements of that date"), "{start}: {message}");
    }
}
