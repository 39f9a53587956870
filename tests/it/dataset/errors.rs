//! Errors of SPEC files and folders, as users see them.

use isotherm::DatasetError;
use isotherm::internals::Begin;

use super::super::cases::Case;
use super::super::program::{end, isotherm, refusal};
use super::{SPEC, Workshop};

#[test]
fn a_wrong_spec_is_refused_before_a_folder_is_made() {
    let workshop = Workshop::new(&[]);
    let own = format!("{}/", workshop.0.0.path().display());
    let cases = Case::all(include_str!("refusals.txt"));
    let mut wrong = String::new();
    for case in &cases {
        let spoilt = case.spoil(SPEC).unwrap_or_else(|| panic!("no case of spec.toml:\n{}", case.text));
        workshop.0.write("spec.toml", &spoilt);
        let found = match workshop.make("set", (0, 1), Begin::Fresh) {
            Ok(_) => "nothing is refused".to_owned(),
            Err(error) => error.to_string().replace(&own, ""),
        };
        if !case.expected.iter().all(|expected| found.starts_with(expected)) || workshop.path("set").exists() {
            wrong.push_str(&format!("{}\nfound\n> {found}\n\n", case.text));
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
    assert!(cases.len() >= 45, "only {} cases were read", cases.len());
}

#[test]
fn no_sample_after_all_attempts_is_an_error_with_the_reasons() {
    let workshop =
        Workshop::new(&[("pointing_px = { normal = [0, 4] }", "pointing_px = 400"), ("attempts = 50", "attempts = 7")]);
    let error = workshop.make("set", (0, 1), Begin::Fresh).expect_err("no sample");
    assert!(matches!(error, DatasetError::NoSample { attempts: 7, .. }));
    assert!(error.to_string().contains("after 7 attempts: 7 craft out of view"), "{error}");
    assert!(error.is_of_the_user());
}

#[test]
fn a_folder_that_can_not_be_used_is_refused() {
    let workshop = Workshop::new(&[]);
    workshop.0.write("file", "");
    std::fs::create_dir(workshop.path("full")).expect("a folder");
    workshop.0.write("full/mine.txt", "mine");
    for (folder, expected) in
        [("file", "is a file"), ("file/below", "cannot create output folder"), ("full", "is not empty")]
    {
        for begin in [Begin::Fresh, Begin::Force] {
            let error = workshop.make(folder, (0, 1), begin).expect_err(folder).to_string();
            assert!(error.contains(expected), "{folder}: {error}");
        }
    }
    assert!(workshop.path("full/mine.txt").exists());
}

#[test]
fn the_command_tells_what_is_wrong_with_exit_code_2() {
    let workshop = Workshop::new(&[("seed = 5", "sead = 5")]);
    let run = |arguments: &[&str]| refusal(&end(isotherm(workshop.0.0.path(), arguments)));
    let (code, error) = run(&["dataset", "spec.toml", "-o", "set", "--device", "cpu"]);
    assert_eq!(code, Some(2));
    assert_eq!(error, "error: spec.toml:4: sead: unknown key; did you mean 'seed'?");
    workshop.change(&[]);
    let (code, error) = run(&["dataset", "spec.toml", "-o", "set", "--shard", "3/3"]);
    assert!(code == Some(2) && error.contains("such as 0/3"), "{error}");
    let (code, error) = run(&["dataset", "verify", "nowhere"]);
    assert!(code == Some(2) && error.contains("holds no data set"), "{error}");
}

/// What `--force` removes is in the folder, whatever a list of checksums says.
#[test]
fn a_list_that_names_files_elsewhere_removes_none_of_them() {
    let workshop = Workshop::new(&[("samples = 6", "samples = 1")]);
    workshop.whole("set");
    let (beside, own) = (workshop.0.write("beside.txt", "mine"), workshop.path("set/README.txt"));
    let absolute = workshop.0.write("absolute.txt", "mine");
    let list = workshop.path("set/checksums.sha256");
    let text = std::fs::read_to_string(&list).expect("a list");
    std::fs::write(&list, format!("{text}0  ../beside.txt\n0  {}\n", absolute.display())).expect("written");
    workshop
        .change(&[("samples = 6", "samples = 1"), ("images = [\"numbers\", \"radiance\"]", "images = [\"radiance\"]")]);
    let written = std::fs::metadata(&own).and_then(|file| file.modified()).expect("a time");
    workshop.make("set", (0, 1), Begin::Force).expect("another data set");
    assert!(beside.exists() && absolute.exists());
    assert_ne!(std::fs::metadata(&own).and_then(|file| file.modified()).expect("a time"), written);
}

/// A file of the scene that only some orbits take is a part of the data set for all of them.
#[test]
fn a_resumed_set_has_the_same_files_in_all_orbits() {
    let map = |value: f64| format!("{}\n", vec![value.to_string(); 48].join(",")).repeat(36);
    let drawn = "netd = { log_uniform = [0.05, 0.5] }";
    let with_map =
        format!("{drawn}\nhousing_temperature = 293\nvignetting_map = {{ choice = [\"a.csv\", \"b.csv\"] }}");
    let workshop = Workshop::new(&[(drawn, &with_map)]);
    for name in ["a.csv", "b.csv"] {
        workshop.0.write("a.csv", &map(0.9));
        workshop.0.write("b.csv", &map(0.8));
        let set = &format!("set_{name}");
        workshop.make(set, (0, 3), Begin::Fresh).expect("an orbit");
        workshop.make(set, (0, 3), Begin::Resume).expect("nothing has changed");
        workshop.0.write(name, &map(0.7));
        let error = workshop.make(set, (1, 3), Begin::Fresh).expect_err(name).to_string();
        assert!(error.contains("holds a data set with another scene or model"), "{name}: {error}");
    }
}
