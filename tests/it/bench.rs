//! `isotherm bench`: counts of work and errors of every integrator on small cases, and the files of the command. No
//! test depends on times.

use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::path::Path;
use std::sync::LazyLock;

use isotherm::internals;
use isotherm::internals::{
    ABSENT, Bench, CaseSummary, DeviceMeasurements, Fixed, Folder, FrameError, Integrated, Integrator,
    IntegratorEffort, IntegratorRun, NetworkCase, OWN, PAGE, RECORD, ReferenceStepper, Scheme, Size, Truth,
    measure_integrator,
};

use super::craft::{Folder as SceneFolder, glb_of_box};
use super::device::context;
use super::program::{end, isotherm, refusal, run};

const EFFORT: IntegratorEffort = IntegratorEffort { runs: 1, enough: 0.0, most: 600.0 };
/// Sub-steps a frame of the references: 0.26 s.
const FINE: u32 = 64;

/// The four cases at small size, around the entry into the planet's shadow.
static CASES: LazyLock<Vec<(NetworkCase, Truth)>> = LazyLock::new(|| {
    let size = Size { cube: 14, sheet: 8, blanket: 6, frames: 92..104 };
    let cases = internals::all_cases(&size).expect("the cases");
    let solved = |case: NetworkCase| {
        let truth = Truth::of(&case, FINE).expect("a reference");
        (case, truth)
    };
    cases.into_iter().map(solved).collect()
});

fn in_f64(case: &NetworkCase, truth: &Truth, scheme: Scheme) -> IntegratorRun {
    let mut stepper = ReferenceStepper::new(case.network.clone(), &[]);
    measure_integrator(&mut stepper, case, &truth.rows, scheme, EFFORT)
}

/// The stated largest error [K] of a scheme on a case, if any.
fn stated(case: &NetworkCase, scheme: Scheme) -> Option<f64> {
    match scheme {
        // docs/numerics.md 6: at most 20 mK by default, 2 mK accurate. Cheap has ten times the tolerance of the
        // default.
        Scheme::Controlled(Integrator::Default | Integrator::OnePass, _) => Some(20e-3),
        Scheme::Controlled(Integrator::Accurate, _) => Some(2e-3),
        Scheme::Controlled(Integrator::Cheap, _) => Some(200e-3),
        // Largest errors in the table of docs/numerics.md 3. The loads here differ, the meshes and materials do not.
        Scheme::Fixed(Fixed::Euler, _) => match case.key {
            "cube" => Some(0.020),
            "sheet" => Some(0.044),
            "blanket" => Some(0.012),
            _ => None,
        },
        Scheme::Fixed(Fixed::Rkl2, _) => match case.key {
            "cube" => Some(0.033),
            "blanket" => Some(0.13),
            _ => Some(1.9),
        },
        Scheme::Fixed(Fixed::TrBdf2, 4) => match case.key {
            "cube" => Some(0.017),
            "blanket" => Some(0.19),
            _ => Some(0.24),
        },
        Scheme::Fixed(Fixed::TrBdf2, _) => None,
    }
}

#[test]
#[ignore = "long: tools/test --all"]
fn the_work_of_each_scheme_is_what_it_was_and_its_error_below_what_is_stated() {
    let mut counts = String::new();
    for (case, truth) in CASES.iter() {
        for scheme in Scheme::all(case, true) {
            let run = in_f64(case, truth, scheme);
            let (key, name) = (case.key, &run.scheme);
            let Some(work) = run.work else {
                writeln!(counts, "{key}: {name}: {}", run.failed.expect("a reason")).expect("a string takes any text");
                continue;
            };
            let error = run.error.expect("an error");
            println!("{key}: {name}: rms {:.2e} K, largest {:.2e} K", error.rms, error.max);
            if let Some(limit) = stated(case, scheme) {
                assert!(error.max <= limit, "{key}: {name}: {} K", error.max);
            }
            let line = format!("{} stages, {} sub-steps", work.stages, work.sub_steps);
            writeln!(counts, "{key}: {name}: {line}").expect("a string takes any text");
        }
    }
    insta::assert_snapshot!("work_of_the_integrators", counts);
}

#[test]
#[ignore = "long: tools/test --all"]
fn the_references_agree_with_another_method_within_their_own_error() {
    for (case, truth) in CASES.iter() {
        assert!(truth.error.max < 1e-4, "{}: {:?}", case.key, truth.error);
        let other = in_f64(case, truth, Scheme::Fixed(Fixed::TrBdf2, FINE)).error.expect("an error");
        // TR-BDF2 also has an error. Twice the sub-steps reduce it by a factor of four.
        let coarser = in_f64(case, truth, Scheme::Fixed(Fixed::TrBdf2, FINE / 2)).error.expect("an error");
        let own = truth.error.max;
        println!("{}: reference {own:.2e} K, TR-BDF2 {:.2e} and {:.2e} K", case.key, coarser.max, other.max);
        assert!(other.max < 2e-4 && other.max < 0.5 * coarser.max + 2.0 * own, "{}", case.key);
    }
}

#[test]
#[ignore = "long: tools/test --all"]
fn a_wrong_network_is_seen_in_the_errors() {
    let (case, truth) = &CASES[1];
    let scheme = Scheme::Controlled(Integrator::Accurate, 5e-4);
    let mut wrong = case.clone();
    wrong.network.emissive_areas.iter_mut().for_each(|area| *area *= 1.001);
    let limit = stated(case, scheme).expect("a limit");
    let error = |case: &NetworkCase| in_f64(case, truth, scheme).error.expect("an error").max;
    assert!(error(case) <= limit);
    assert!(error(&wrong) > limit, "a thousandth of the emissive areas must show");
}

#[test]
#[ignore = "long: tools/test --all"]
fn a_run_that_takes_too_long_tells_how_far_it_came() {
    let (case, truth) = &CASES[1];
    let effort = IntegratorEffort { runs: 1, enough: 0.0, most: 0.0 };
    let mut stepper = ReferenceStepper::new(case.network.clone(), &[]);
    let run = measure_integrator(&mut stepper, case, &truth.rows, Scheme::Fixed(Fixed::Rkl2, 1), effort);
    assert_eq!(run.work.map(|work| work.frames), Some(1));
}

fn bench_of(runs: Vec<IntegratorRun>, solved: &(NetworkCase, Truth)) -> Bench {
    let measured = DeviceMeasurements {
        name: "a <device>".to_owned(),
        load_average: [Some([1.0, 2.0, 3.0]), None],
        stolen: Some(0.125),
        integrators: vec![Integrated { case: solved.0.key.to_owned(), runs }],
        ..DeviceMeasurements::default()
    };
    Bench {
        version: "0".to_owned(),
        command_line: "isotherm bench".to_owned(),
        release: true,
        quick: true,
        processors: 2,
        cases: vec![CaseSummary::of(solved)],
        devices: vec![measured],
        drivers: Vec::new(),
        wall_s: 1.0,
    }
}

#[test]
fn the_page_names_every_scheme_and_what_is_absent() {
    let solved = &CASES[1];
    let failed = IntegratorRun {
        scheme: "a scheme".to_owned(),
        failed: Some("no <reason>".to_owned()),
        ..IntegratorRun::default()
    };
    let run = in_f64(&solved.0, &solved.1, Scheme::Fixed(Fixed::Rkl2, 1));
    let bench = bench_of(vec![run, failed], solved);
    let folder = tempfile::tempdir().expect("a folder");
    let files = Folder::new(folder.path(), &OWN).prepare(false, &[]).expect("an empty folder");
    internals::write_bench_files(&files, &bench).expect("a folder to write to");
    let page = std::fs::read_to_string(files.file(PAGE)).expect("the page");
    for text in ["RKL2, fixed, 1 sub-step", "a scheme", "no &lt;reason&gt;", "a &lt;device&gt;", "<svg", "1, 2, 3"] {
        assert!(page.contains(text), "{text}");
    }
    for (method, why) in ABSENT {
        assert!(page.contains(method) && page.contains(why), "{method}");
    }
    for outside in ["http://", "https://", "<link", "<script", "@import", "url("] {
        assert!(!page.replace("http://www.w3.org/2000/svg", "").contains(outside), "{outside}");
    }
    let text = internals::all_tables(&bench)[0].markdown();
    let widths: Vec<usize> =
        text.lines().filter(|line| line.starts_with('|')).map(|line| line.matches('|').count()).collect();
    assert!(widths.len() > 6 && widths.iter().all(|width| *width == widths[0]), "{text}");
    let record: serde_json::Value =
        serde_json::from_slice(&std::fs::read(files.file(RECORD)).expect("the record")).expect("JSON");
    assert!(record["devices"][0]["integrators"][0]["runs"][0]["error"]["max_k"].as_f64() > Some(0.0));
    assert!(folder.path().join("plots/work_precision_1_sheet.svg").exists());
}

#[test]
fn the_command_measures_the_limits_and_refuses_what_it_does_not_know() {
    let folder = tempfile::tempdir().expect("a folder");
    let ran = run(folder.path(), &["bench", "-o", "out", "--quick", "--only", "limits"]);
    assert_eq!(ran.code, 0, "{}", ran.err);
    assert!(ran.out.contains("copy of 64 MiB") && ran.out.contains("empty dispatch"), "{}", ran.out);
    let record = std::fs::read(folder.path().join("out").join(RECORD)).expect("the record");
    let record: serde_json::Value = serde_json::from_slice(&record).expect("JSON");
    let first = &record["devices"][0];
    for key in ["name", "driver", "kind", "api_version"] {
        assert!(first["info"][key].is_string(), "{key}");
    }
    assert!(first["limits"]["copies"][0]["gigabytes_per_second"]["median"].as_f64() > Some(0.0));
    assert!(Path::exists(&folder.path().join("out").join(PAGE)));
    for (arguments, word) in [
        (&["bench", "-o", "out", "--only", "limits"][..], "--force"),
        (&["bench", "-o", "new", "--only", "speed"][..], "integrators"),
    ] {
        let output = end(isotherm(folder.path(), arguments));
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(refusal(&output).0, Some(2), "{text}");
        assert!(text.contains(word), "{text}");
    }
}

#[test]
fn differences_are_over_all_nodes_and_frames() {
    let rows = |values: [[f64; 2]; 2]| values.map(|row| row.to_vec()).to_vec();
    let found = FrameError::between(&rows([[1.0, 2.0], [3.0, 4.0]]), &rows([[1.0, 2.0], [3.0, 6.0]]));
    assert_eq!(found, FrameError { rms: 1.0, max: 2.0 });
}

#[test]
fn a_copy_may_be_longer_than_a_binding() {
    let context = context();
    let longer = context.info.max_storage_buffer_range + 4;
    if longer > 1 << 30 {
        println!("not tried: {} binds more than 1 GiB", context.info.name);
        return;
    }
    let samples = isotherm::internals::copies(&context, longer, 1).expect("no shader binds what is copied");
    assert_eq!(samples.wall_ms.len(), 1);
}

/// Period of the plate's orbit, and its step and that of its warm-up [s].
const PERIOD: f64 = 5553.6;
const STEPS: [f64; 2] = [PERIOD / 60.0, 60.0];

/// Temperatures of a plate [K] in ten images of an orbit, whose cosine to the Sun is cos 30 sin 50 + sin 30 cos 50 cos(20 deg + 2 pi t / period), under the
/// mean load of each step, by the classical Runge-Kutta method. `finer` divides all steps.
fn plate(capacity: f64, finer: f64) -> Vec<f64> {
    let [step, warm_up] = STEPS.map(|step| step / finer);
    let before = (PERIOD / warm_up).round() as i32;
    let warm = (-before..0).map(|number| [f64::from(number), f64::from(number + 1)].map(|number| number * warm_up));
    let after = (0..(PERIOD / step).round() as i32)
        .map(|number| [f64::from(number), f64::from(number + 1)].map(|number| number * step));
    let every = 6 * finer as usize;
    let mut kelvin = 300.0f64;
    let mut drawn = Vec::new();
    for (number, ends) in warm.chain(after).enumerate() {
        let [from, to] = ends.map(|time| 20f64.to_radians() + TAU * time / PERIOD);
        let (tilt, beta) = (30f64.to_radians(), 50f64.to_radians());
        let mean = tilt.cos() * beta.sin() + tilt.sin() * beta.cos() * (to.sin() - from.sin()) / (to - from);
        let rate = |kelvin: f64| (0.4 * 1361.0 * mean - 0.63 * 5.670374419e-8 * kelvin.powi(4)) / capacity;
        let h = (ends[1] - ends[0]) / 200.0;
        for _ in 0..200 {
            let a = rate(kelvin);
            let b = rate(kelvin + h / 2.0 * a);
            let c = rate(kelvin + h / 2.0 * b);
            let d = rate(kelvin + h * c);
            kelvin += h / 6.0 * (a + 2.0 * b + 2.0 * c + d);
        }
        if (number + 1).checked_sub(before as usize).is_some_and(|step| step > 0 && step.is_multiple_of(every)) {
            drawn.push(kelvin);
        }
    }
    drawn
}

/// Root mean square difference of two lists [K].
fn apart(one: &[f64], other: &[f64]) -> f64 {
    (one.iter().zip(other).map(|(a, b)| (a - b) * (a - b)).sum::<f64>() / one.len() as f64).sqrt()
}

/// The accurate network has an error too: that of its mesh, its light and its step.
#[test]
fn the_frontier_has_the_true_error_of_the_accurate_network() {
    let device = context().info.name.clone();
    let folder = SceneFolder::new(&format!(
        "name = \"plate\"\n[model]\npath = \"made.glb\"\n[time]\nstep = 60\nsteps = 10\ndraw_every = 5\n\
         [orbit]\naltitude = 408e3\nperiod = {PERIOD}\nbeta_deg = 50\nphase_deg = 20\n[attitude]\nmode = \"nadir\"\n\
         [environment]\nsolar_constant = 1361\neclipse = false\n[shadows]\n[initial]\ntemperature = 300\n\
         [[material]]\nmatch = \"skin\"\nabsorptivity = 0.4\nemissivity = 0.63\nsides = \"outside\"\nresponse = \"network\"\n\
         thickness = 0.0005\ndensity = 1000\nspecific_heat = 400\nconductivity = 0\n\
         heating = {{ function = \"quadratic\", t_max = 200 }}\ncooling = {{ function = \"quadratic\", t_max = 200 }}\n\
         [radiance]\nband_um = [8, 14]\n[camera]\nwidth = 24\nheight = 24\nfov_deg = 40\nframe = \"body\"\n\
         position = [0, -3.4641016, -2]\nlook_at = [0, 0, 0]\nup = [1, 0, 0]\n"
    ));
    let mut maker = glb_of_box();
    // The face away from the planet turns to the Sun's side of the orbit.
    maker.json["nodes"][0]["rotation"] = serde_json::json!([-0.5, 0.0, 0.0, 0.866_025_4]);
    maker.save(folder.0.path());
    let arguments = ["bench", "-o", "out", "--only", "models", "--model-scene", "scene.toml", "--device", &device];
    let ran = run(folder.0.path(), &arguments);
    assert_eq!(ran.code, 0, "{}", ran.err);
    let record = std::fs::read(folder.path("out").join(RECORD)).expect("the record");
    let record: serde_json::Value = serde_json::from_slice(&record).expect("JSON");
    let frontier = &record["devices"][0]["frontier"];
    let row = |number: usize| &frontier["rows"][number];
    assert_eq!(row(0)["response"], "network, accurate", "{frontier}");
    let error = row(0)["error"]["rms"].as_f64().expect("an error");
    let known = |capacity| apart(&plate(capacity, 1.0), &plate(capacity, 2.0));
    println!("{error} K for {} K", known(200.0));
    assert!((error - known(200.0)).abs() < 0.01 * known(200.0), "{error} K for {} K", known(200.0));
    assert!((error - known(220.0)).abs() > 0.01 * known(200.0), "a plate that stores more must show");
    // From the accurate network on the same mesh the difference is another one.
    let instant = frontier["rows"].as_array().expect("rows").iter().find(|row| row["response"] == "instant");
    let instant = instant.expect("a row");
    let other = instant["error"]["rms"].as_f64().expect("an error");
    assert!((other - error).abs() > 0.01 * error && instant["from_accurate_k"].as_f64() > Some(1.0), "{instant}");
    assert!(row(0)["from_accurate_k"].is_null());
    let settings = frontier["reference"]["Ok"]["settings"].as_str().expect("settings");
    assert!(settings.contains("time.step = 46.28") && settings.contains("model.max_edge"), "{settings}");
    assert!(ran.out.contains("all settings of `isotherm converge` finer") && ran.out.contains(settings), "{}", ran.out);
    assert!(folder.path("out/plots/frontier_1.svg").exists());
}
