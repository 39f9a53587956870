//! `isotherm bench`: counts of work and errors of every integrator on small cases, and the files of the command. No
//! test depends on times.

use std::fmt::Write as _;
use std::path::Path;
use std::sync::LazyLock;

use isotherm::internals;
use isotherm::internals::{
    ABSENT, Bench, CaseSummary, DeviceMeasurements, Fixed, Folder, FrameError, Integrated, Integrator,
    IntegratorEffort, IntegratorRun, NetworkCase, OWN, PAGE, RECORD, ReferenceStepper, Scheme, Size, Truth,
    measure_integrator,
};

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
