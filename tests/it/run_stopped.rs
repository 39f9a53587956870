//! Runs that a signal or a full disk ends: what they leave, and how they go on.

use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use isotherm::internals::read_exr;

use super::craft::{Folder, scene_with};
use super::program::{end, isotherm, refusal, stderr, succeed};
use super::run::{files, report};

/// Starts a command and sends a signal some time after `there` is true. Returns its output.
pub fn interrupted(mut command: Command, signal: &str, there: impl Fn() -> bool) -> Output {
    let child = command.spawn().expect("the program starts");
    let began = Instant::now();
    while !there() {
        assert!(began.elapsed() < Duration::from_secs(60), "nothing appears");
        std::thread::sleep(Duration::from_millis(20));
    }
    // `there` becomes true just before the work begins.
    std::thread::sleep(Duration::from_millis(700));
    // The shell has a built-in kill. A minimal Debian has no such program.
    let kill = Command::new("sh").args(["-c", &format!("kill -{signal} {}", child.id())]).status();
    assert!(kill.expect("a shell is there").success());
    child.wait_with_output().expect("the program ends")
}

/// `run` of a scene into `out` with captured output.
fn quiet_run(folder: &Folder) -> Command {
    let mut command = isotherm(folder.0.path(), &["run", "scene.toml", "-o", "out"]);
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

#[cfg(unix)]
#[test]
fn control_c_keeps_what_is_finished() {
    let folder = Folder::new(&scene_with(&[("steps = 12", "steps = 100000"), ("draw_every = 4", "draw_every = 2")]));
    let third = folder.path("out/frames/step_000004.exr");
    let output = interrupted(quiet_run(&folder), "INT", || third.exists());
    let (code, line) = refusal(&output);
    assert_eq!(code, Some(1), "{}", stderr(&output));
    assert!(line.contains("stopped; what was finished is in out"), "{line}");
    let left = files(&folder.path("out"));
    let report = report(&left);
    assert_eq!(report["interrupted"], true);
    let frames: Vec<&String> = left.keys().filter(|name| name.ends_with(".exr")).collect();
    assert!(frames.len() >= 3 && report["frames"].as_array().expect("a list").len() == frames.len());
    for name in frames {
        read_exr(&folder.path(&format!("out/{name}"))).expect("every frame is whole");
        assert!(left.contains_key(&name.replace(".exr", ".png")), "{name} has its picture");
    }
    let steps = String::from_utf8(left["series.csv"].clone()).expect("text").lines().count() as u64 - 2;
    assert_eq!(report["speed"]["steps"], steps);
    let named = |name: &String| name.contains(".part") || name.contains(".isotherm-");
    assert!(!left.keys().any(named), "no partial file remains: {:?}", left.keys());
}

#[cfg(unix)]
#[test]
fn control_c_in_the_warm_up_and_in_a_still() {
    let slow = scene_with(&[("steps = 12", "steps = 12\nwarm_up_orbits = 100000")]);
    let folder = Folder::new(&slow);
    let state = folder.path("out/.isotherm/state");
    let output = interrupted(quiet_run(&folder), "INT", || state.exists());
    assert_eq!(refusal(&output).0, Some(1), "{}", stderr(&output));
    let left = files(&folder.path("out"));
    assert_eq!(report(&left)["interrupted"], true);
    assert!(!left.keys().any(|name| name.starts_with("frames/")), "{:?}", left.keys());

    let mut command = isotherm(folder.0.path(), &["render", "scene.toml", "--time", "60", "-o", "image.exr"]);
    command.stderr(std::fs::File::create(folder.path("said")).expect("a file"));
    let said = || std::fs::read_to_string(folder.path("said")).unwrap_or_default();
    let output = interrupted(command, "INT", || said().contains("device: "));
    assert_eq!(output.status.code(), Some(1), "{}", said());
    assert!(said().contains("error: stopped; nothing was written"), "{}", said());
    let left: Vec<String> = files(folder.0.path()).into_keys().filter(|name| !name.contains('/')).collect();
    assert_eq!(left, ["made.glb", "said", "scene.toml"]);
}

#[cfg(unix)]
#[test]
#[ignore = "long: tools/test --all"]
fn a_signal_leaves_what_was_computed_and_the_run_goes_on_from_there() {
    let scene = scene_with(&[("steps = 12", "steps = 100000"), ("draw_every = 4", "draw_every = 1000")]);
    let folder = Folder::new(&scene);
    let series = folder.path("out/series.csv");
    let rows = || std::fs::read(&series).map_or(0, |text| text.iter().filter(|byte| **byte == b'\n').count());
    let output = interrupted(quiet_run(&folder), "TERM", || {
        // A second run is refused while the first goes on.
        if rows() == 0 {
            return false;
        }
        for more in [&["scene.toml", "-o", "out"][..], &["scene.toml", "-o", "out", "--force"], &["--resume", "out"]] {
            let arguments: Vec<&str> = ["run"].iter().chain(more).copied().collect();
            let (code, line) = refusal(&end(isotherm(folder.0.path(), &arguments)));
            assert!(code == Some(2) && line.contains("another run writes into"), "{line}");
        }
        true
    });
    let (code, line) = refusal(&output);
    assert!(code == Some(1) && line.contains("isotherm run --resume out"), "{line}");
    let left = files(&folder.path("out"));
    assert_eq!(report(&left)["interrupted"], true);
    assert_eq!(rows() as u64, report(&left)["speed"]["steps"].as_u64().expect("a number") + 2);
    let resume = |arguments: &[&str]| {
        let arguments: Vec<&str> = ["run", "--resume", "out"].iter().chain(arguments).copied().collect();
        end(isotherm(folder.0.path(), &arguments))
    };

    // Nothing that would make it another run is taken.
    let state = folder.path("out/.isotherm/state");
    let whole = std::fs::read(&state).expect("a state");
    let refused = |output: Output, reason: &str| {
        let (code, line) = refusal(&output);
        assert!(code == Some(2) && line.contains(reason), "{code:?} {line}");
    };
    refused(resume(&["--device", "cpu"]), "the device was");
    folder.write("scene.toml", &scene.replace("planet_ir = 237", "planet_ir = 238"));
    refused(resume(&[]), "scene.toml has changed");
    folder.write("scene.toml", &scene);
    std::fs::write(&state, &whole[..whole.len() - 100]).expect("a shorter state");
    refused(resume(&[]), "damaged or truncated");
    let earlier = [&b"isotherm state\n"[..], &1u32.to_ne_bytes(), &0x0102_0304u32.to_ne_bytes(), &[0; 40]].concat();
    std::fs::write(&state, earlier).expect("a state of an earlier version");
    refused(resume(&[]), "was written by an earlier version of isotherm; begin anew with --force");
    std::fs::write(&state, &whole).expect("the state again");
    let from = ["run", "scene.toml", "-o", "new", "--from-state", "out/.isotherm/state"];
    refused(end(isotherm(folder.0.path(), &from)), "is no thermal state of --save-state");
    let contents = left["series.csv"].clone();
    std::fs::write(&series, b"mine").expect("another series");
    refused(resume(&[]), "series.csv is not as isotherm left it");
    assert!(!folder.path("out/.isotherm/part-0").exists());
    std::fs::remove_dir_all(folder.path("out")).expect("the run goes");
    refused(resume(&[]), "no run was begun in out");
    assert!(contents.ends_with(b"\n"), "only whole lines are written");
}

#[cfg(unix)]
#[test]
#[ignore = "long: tools/test --all"]
fn a_finished_run_is_not_resumed_and_a_stopped_one_ends_as_an_undisturbed_one() {
    let scene = scene_with(&[("steps = 12", "steps = 3000"), ("draw_every = 4", "draw_every = 1000")]);
    let folder = Folder::new(&scene);
    // The first image may be encoded late, where other programs use the machine.
    let series = folder.path("out/series.csv");
    interrupted(quiet_run(&folder), "HUP", || series.exists());
    let said = succeed(folder.0.path(), &["run", "--resume", "out", "scene.toml"]);
    assert!(said.contains("3000 steps"), "{said}");
    let said = succeed(folder.0.path(), &["run", "--resume", "out"]);
    assert!(said.contains("the run in out is finished"), "{said}");
    succeed(folder.0.path(), &["run", "scene.toml", "-o", "whole"]);
    let [out, whole] = ["out", "whole"].map(|name| files(&folder.path(name)));
    assert!(out.keys().eq(whole.keys()));
    for (name, bytes) in out.iter().filter(|(name, _)| !name.starts_with("report.")) {
        assert!(*bytes == whole[name], "{name} differs");
    }
    assert_eq!(report(&out)["accuracy"], report(&whole)["accuracy"]);
}

#[cfg(unix)]
#[test]
fn a_signal_to_a_command_without_steps_leaves_no_unfinished_file() {
    let folder = Folder::new(&scene_with(&[("steps = 12", "steps = 3000000")]));
    for signal in ["INT", "TERM"] {
        let mut command = isotherm(folder.0.path(), &["environment", "scene.toml", "-o", "env.csv"]);
        command.stdout(Stdio::null()).stderr(Stdio::null());
        let names = || -> Vec<String> {
            let found = std::fs::read_dir(folder.0.path()).expect("the folder").flatten();
            found
                .map(|entry| entry.file_name().to_string_lossy().into_owned())
                .filter(|name| name.ends_with(".part"))
                .collect()
        };
        let output = interrupted(command, signal, || !names().is_empty());
        assert_eq!(output.status.code(), Some(130), "{}", stderr(&output));
        assert!(names().is_empty() && !folder.path("env.csv").exists());
    }
}

/// A limit on the size of files acts as a full disk does: a write fails.
#[cfg(unix)]
#[test]
#[ignore = "long: tools/test --all"]
fn a_full_disk_names_the_file_keeps_what_is_whole_and_the_run_goes_on() {
    let scene = scene_with(&[("steps = 12", "steps = 900"), ("draw_every = 4", "draw_every = 300")]);
    let folder = Folder::new(&scene);
    succeed(folder.0.path(), &["run", "scene.toml", "-o", "whole", "--device", "cpu"]);
    // Blocks of 512 bytes in sh, 1024 in some. The shell hands on that the signal is ignored.
    let mut command = Command::new("sh");
    let program = env!("CARGO_BIN_EXE_isotherm");
    command.args(["-c", &format!("trap '' XFSZ; ulimit -f 160; exec {program} run scene.toml -o out --device cpu")]);
    let output = end({
        command.current_dir(folder.0.path()).stdin(Stdio::null());
        command
    });
    let (code, line) = refusal(&output);
    assert!(code == Some(2) && line.contains("cannot write out/series.csv"), "{}", stderr(&output));
    let left = files(&folder.path("out"));
    let text = String::from_utf8(left["series.csv"].clone()).expect("text");
    assert!(text.lines().count() > 50, "{} rows were kept", text.lines().count());
    for name in left.keys().filter(|name| name.ends_with(".exr")) {
        read_exr(&folder.path(&format!("out/{name}"))).expect("every frame is whole");
    }
    succeed(folder.0.path(), &["run", "--resume", "out"]);
    let (whole, again) = (files(&folder.path("whole")), files(&folder.path("out")));
    assert!(whole.keys().eq(again.keys()), "{:?} and {:?}", whole.keys(), again.keys());
    for (name, bytes) in whole.iter().filter(|(name, _)| !name.starts_with("report.")) {
        assert!(again[name] == *bytes, "{name}");
    }
}

/// Without a handler the system ends the program at once, and nobody learns why.
#[test]
fn a_file_beyond_the_limit_of_the_shell_is_named() {
    let scene = scene_with(&[("steps = 12", "steps = 900"), ("draw_every = 4", "draw_every = 300")]);
    let folder = Folder::new(&scene);
    let mut command = Command::new("sh");
    let program = env!("CARGO_BIN_EXE_isotherm");
    command.args(["-c", &format!("ulimit -f 160; exec {program} run scene.toml -o out --device cpu")]);
    command.current_dir(folder.0.path()).stdin(Stdio::null());
    let output = end(command);
    let (code, line) = refusal(&output);
    assert!(code == Some(2) && line.contains("cannot write out/series.csv"), "{code:?}: {}", stderr(&output));
}

/// Nobody reads the pipe, so no step comes to an end.
#[test]
fn a_signal_ends_a_wait_for_another_program() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name);
    std::fs::write(path("net.toml"), include_str!("../../models/cubesat_network.toml")).expect("written");
    assert!(Command::new("mkfifo").arg(path("pipe")).status().expect("mkfifo").success());
    let mut command = isotherm(folder.path(), &["network", "net.toml", "-o", "pipe"]);
    let mut child = command.stderr(Stdio::piped()).spawn().expect("the program starts");
    std::thread::sleep(Duration::from_secs(3));
    assert!(child.try_wait().expect("a state").is_none(), "it waits for a reader");
    assert!(
        Command::new("sh").args(["-c", "kill -TERM $0", &child.id().to_string()]).status().expect("a shell").success()
    );
    let began = Instant::now();
    while child.try_wait().expect("a state").is_none() {
        assert!(began.elapsed() < Duration::from_secs(30), "it waits on");
        std::thread::sleep(Duration::from_millis(50));
    }
    let output = child.wait_with_output().expect("an end");
    assert_eq!(output.status.code(), Some(130));
    assert!(stderr(&output).contains("nobody reads the output"), "{}", stderr(&output));
}
