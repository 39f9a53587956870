//! What rays found lies beside a saved state: a run from the state casts nothing twice, and a file that does not serve changes no result.

use serde_json::Value;

use super::craft::{Folder, scene_with};
use super::program::{Ran, run};

const STATE: &str = "warm.state";
const CASTS: &str = "warm.state.casts";
const NOTE: &str = "they are not cast again";
const EXCHANGE: &str = "[exchange]\nrays = 64\npatch_edge = 1\nredraw_angle_deg = 10\n";
/// A wing that turns for the first five steps, through several poses for which rays are cast.
const WING: &str = "[[joint]]\npart = \"wing_starboard\"\nmode = \"schedule\"\naxis = \"+Y\"\n\
                    schedule = { time = [0, 300], angle_deg = [0, 35] }\n";

fn scene(changes: &[(&str, &str)]) -> String {
    let warm = ("draw_every = 4", "draw_every = 4\nwarm_up_orbits = 0.1");
    let changes = [&[warm], changes].concat();
    format!("{}{EXCHANGE}{WING}", scene_with(&changes))
}

/// Runs a command with a timeline. Returns what it said, and how many times reflections of a pose were found.
fn traced(folder: &Folder, arguments: &[&str]) -> (Ran, usize) {
    let ran = run(folder.0.path(), &[&["run", "--trace", "trace.json"], arguments].concat());
    assert_eq!(ran.code, 0, "{arguments:?}: {}", ran.err);
    (ran, casts(folder))
}

/// How many times reflections of a pose were found in the last run.
fn casts(folder: &Folder) -> usize {
    count(folder, "finding reflections")
}

/// How many times a work was done in the last run.
fn count(folder: &Folder, work: &str) -> usize {
    let trace = std::fs::read(folder.path("trace.json")).expect("a timeline");
    let trace: Value = serde_json::from_slice(&trace).expect("JSON");
    let events = trace["traceEvents"].as_array().expect("events").iter();
    events.filter(|event| event["ph"] == "X" && event["name"] == work).count()
}

fn assert_same(folder: &Folder, one: &str, other: &str) {
    for name in ["series.csv", "frames/step_000000.exr", "frames/step_000008.exr", "frames/step_000012.exr"] {
        let [a, b] = [one, other].map(|root| std::fs::read(folder.path(&format!("{root}/{name}"))).expect(name));
        assert!(a == b, "{name} of {one} and {other} differ");
    }
}

fn runs_from_a_state(device: &[&str]) {
    let folder = Folder::new(&scene(&[]));
    let save = ["scene.toml", "-o", "one", "--save-state", STATE, "--save-state-at", "0"];
    let (_, first) = traced(&folder, &[&save, device].concat());
    assert!(first >= 4, "{first} poses");
    let from = |out: &str, scene: &str| {
        let (ran, casts) =
            traced(&folder, &[&[scene, "-o", out, "--from-state", STATE, "--save-every", "1steps"], device].concat());
        (ran.err, casts)
    };
    let (said, again) = from("two", "scene.toml");
    assert_eq!(again, 0, "{said}");
    assert!(said.contains(&format!("note: rays of {first} poses are in {CASTS}: {NOTE}")), "{said}");
    assert_same(&folder, "one", "two");
    // The run's own file is written once, as nothing was found since.
    let [states, files] = ["saving the state", "saving the cast rays"].map(|work| count(&folder, work));
    assert!(states > 10 && files == 1, "{files} files beside {states} states");

    // Without the file, and with a byte of another value, rays are cast anew.
    let whole = std::fs::read(folder.path(CASTS)).expect("a file beside the state");
    std::fs::remove_file(folder.path(CASTS)).expect("it goes");
    let (said, anew) = from("three", "scene.toml");
    assert!(anew >= 4 && !said.contains("note: "), "{anew}: {said}");
    assert_same(&folder, "one", "three");
    let mut flipped = whole.clone();
    flipped[whole.len() / 2] ^= 0x10;
    for (out, bytes, reason) in [
        ("four", flipped.as_slice(), "is damaged or truncated: its checksum does not fit; rays are cast anew"),
        ("five", &whole[..whole.len() / 2], "is damaged or truncated: its checksum does not fit; rays are cast anew"),
        ("six", &[], "is no saved state; rays are cast anew"),
    ] {
        std::fs::write(folder.path(CASTS), bytes).expect("it is written");
        let (said, casts) = from(out, "scene.toml");
        assert!(casts == anew && said.contains(&format!("note: {CASTS} {reason}")), "{casts}: {said}");
        assert_same(&folder, "one", out);
    }

    // The file of a craft with other optics.
    std::fs::write(folder.path("other.toml"), scene(&[("absorptivity = 0.29", "absorptivity = 0.35")]))
        .expect("a scene");
    traced(&folder, &[&["other.toml", "-o", "other", "--save-state", "other.state"], device].concat());
    std::fs::rename(folder.path("other.state.casts"), folder.path(CASTS)).expect("it is moved");
    let (said, casts) = from("seven", "scene.toml");
    assert!(casts == anew && said.contains(&format!("note: {CASTS} is of another craft")), "{casts}: {said}");
    assert_same(&folder, "one", "seven");
}

#[test]
fn a_run_from_a_state_casts_no_ray_twice() {
    runs_from_a_state(&["--device", "cpu"]);
}

#[test]
fn a_run_from_a_state_casts_no_ray_twice_on_the_device() {
    runs_from_a_state(&[]);
}

/// The joint rests when the signal comes, so all poses are known.
#[cfg(unix)]
#[test]
fn a_run_that_goes_on_casts_no_ray_twice() {
    use super::program::{isotherm, stderr};
    use super::run_stopped::interrupted;
    use std::process::Stdio;

    let folder = Folder::new(&scene(&[("steps = 12", "steps = 100000"), ("draw_every = 4", "draw_every = 100000")]));
    let rows =
        || std::fs::read(folder.path("out/series.csv")).map_or(0, |text| text.split(|byte| *byte == b'\n').count());
    let part = |arguments: &[&str], more: usize| {
        let before = rows();
        let mut command = isotherm(folder.0.path(), &[&["run", "--trace", "trace.json"], arguments].concat());
        command.args(["--device", "cpu"]).stdout(Stdio::piped()).stderr(Stdio::piped());
        let output = interrupted(command, "TERM", || rows() > before + more);
        assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
        (casts(&folder), stderr(&output))
    };
    let (first, said) = part(&["scene.toml", "-o", "out"], 20);
    assert!(first >= 4 && !said.contains(NOTE), "{first}: {said}");
    let (again, said) = part(&["--resume", "out"], 20);
    assert!(again == 0 && said.contains(NOTE), "{again}: {said}");
    std::fs::remove_file(folder.path("out/.isotherm/casts")).expect("it goes");
    let (anew, said) = part(&["--resume", "out"], 20);
    assert!(anew > 0 && !said.contains("note: "), "{anew}: {said}");
}
