//! Where single outputs go, and what happens if nobody takes them: files, links, devices, pipes and standard streams.

use std::ffi::OsStr;
use std::fs::{self, File};
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::{FileTypeExt, PermissionsExt, symlink};
use std::path::Path;
use std::process::{Command, Output, Stdio};

use super::craft::{Folder, SCENE, scene_with};
use super::network;
use super::program::{end, isotherm, stderr};

/// Every command that writes a single file. The file's path comes last.
const COMMANDS: [&str; 9] = [
    "network net.toml --device cpu -o",
    "network net.toml --device cpu -o other.csv --plot",
    "network import s2e -o",
    "environment scene.toml -o",
    "render short.toml --time 0 --device cpu -o",
    "response --heating quadratic:9 --cooling linear:9 --initial 3 --targets targets.csv --device cpu -o",
    "response --heating quadratic:9 --cooling linear:9 --initial 3 --targets targets.csv --device cpu -o other.csv --plot",
    "response fit data.csv --plot",
    "run short.toml -o out --force --device cpu --trace",
];

/// A folder with an input for every command.
fn inputs() -> Folder {
    let folder = Folder::new(SCENE);
    let short = [("steps = 12", "steps = 1"), ("draw_every = 4", "draw_every = 0"), ("max_edge = 0.7", "max_edge = 3")];
    folder.write("short.toml", &scene_with(&short));
    folder.write("net.toml", network::command::FILE);
    folder.write("targets.csv", "step,target\n1,300\n9,200\n20,200\n");
    let rows = (0..=150).map(|step| {
        let rest = 1.0 - f64::from(step.min(100)) / 100.0;
        format!("{step},{:.6}\n", 267.0 - 264.3 * rest * rest)
    });
    folder.write("data.csv", &format!("time,temperature\n{}", rows.collect::<String>()));
    fs::create_dir(folder.path("s2e")).expect("a folder");
    let header = "Node_id,Node_label,node_type,heater_node_id,capacity,alpha,epsilon,area,x,y,z,initial_temperature";
    folder.write("s2e/node.csv", &format!("{header}\n0,A\x1b[31m,0,0,241.2,0,0,0,0,0,0,293\n"));
    folder.write("s2e/cij.csv", "[W/K],A\nA,0\n");
    folder.write("s2e/rij.csv", "[m2],A\nA,0\n");
    folder
}

fn command(folder: &Folder, arguments: &str, output: &str) -> Command {
    isotherm(folder.0.path(), &arguments.split(' ').chain([output]).collect::<Vec<_>>())
}

fn succeed(command: Command) -> Output {
    let output = end(command);
    assert!(output.status.success(), "{}", stderr(&output));
    output
}

/// Neither a panic nor a signal ended the program.
fn ended_well(output: &Output) {
    let code = output.status.code();
    assert!(
        code.is_some_and(|code| code != 101) && !stderr(output).contains("panicked"),
        "{code:?} {}",
        stderr(output)
    );
}

fn no_temporary(folder: &Path) {
    let names = fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").file_name());
    let left: Vec<_> = names.filter(|name| name.as_bytes().starts_with(b".isotherm")).collect();
    assert!(left.is_empty(), "{left:?}");
}

#[test]
fn one_output_goes_where_its_path_leads() {
    let folder = inputs();
    let at = |name: &str| folder.path(name);
    symlink("/dev/null", at("nothing")).expect("a link");
    symlink("target", at("link")).expect("a link");
    assert!(Command::new("mkfifo").arg(at("pipe")).status().expect("mkfifo").success());
    for arguments in COMMANDS {
        succeed(command(&folder, arguments, "plain"));
        let expected = fs::read(at("plain")).expect("written");
        // A trace and its run hold times, which differ.
        let same = |found: &[u8], what: &str| {
            assert!(
                !found.is_empty() && (arguments.starts_with("run") || found == expected),
                "{arguments:?} to {what}"
            );
        };
        // A link without its target, then with it. The permissions stay.
        let _ = fs::remove_file(at("target"));
        succeed(command(&folder, arguments, "link"));
        fs::set_permissions(at("target"), fs::Permissions::from_mode(0o640)).expect("permissions");
        succeed(command(&folder, arguments, "link"));
        same(&fs::read(at("target")).expect("written"), "a link");
        assert!(fs::symlink_metadata(at("link")).expect("a link").is_symlink());
        assert_eq!(fs::metadata(at("target")).expect("a file").permissions().mode() & 0o777, 0o640);

        let piped = std::thread::spawn({
            let pipe = at("pipe");
            move || fs::read(pipe).expect("the pipe")
        });
        succeed(command(&folder, arguments, "pipe"));
        assert!(fs::metadata(at("pipe")).expect("a pipe").file_type().is_fifo(), "{arguments:?}");
        same(&piped.join().expect("read"), "a pipe");

        succeed(command(&folder, arguments, "nothing"));
        assert!(fs::symlink_metadata(at("nothing")).expect("a link").is_symlink());
        assert!(fs::metadata("/dev/null").expect("a device").file_type().is_char_device());

        // Standard output holds the file and nothing else.
        same(&succeed(command(&folder, arguments, "-")).stdout, "-");
        assert!(!at("-").exists());

        let full = end(command(&folder, arguments, "/dev/full"));
        ended_well(&full);
        assert!(!full.status.success() && stderr(&full).contains("error: cannot write /dev/full"), "{}", stderr(&full));
        for wrong in ["s2e", "s2e/", "new/"] {
            let refused = end(command(&folder, arguments, wrong));
            assert_eq!(refused.status.code(), Some(2), "{arguments:?} {wrong}");
            assert!(stderr(&refused).contains("is a folder"), "{}", stderr(&refused));
        }
        no_temporary(folder.0.path());
    }
    assert!(!Path::new("/dev/null.events.csv").exists() && !at("nothing.events.csv").exists());
}

#[test]
fn two_outputs_of_a_command_do_not_share_standard_output() {
    let folder = inputs();
    let refused = end(command(&folder, "network net.toml --device cpu --plot", "-"));
    assert_eq!(refused.status.code(), Some(2));
    assert!(refused.stdout.is_empty() && stderr(&refused).contains("same output"), "{}", stderr(&refused));
    let events = succeed(command(&folder, COMMANDS[0], "-"));
    assert!(stderr(&events).contains("switch: "), "{}", stderr(&events));
}

/// A stream whose reader has left.
fn left() -> Stdio {
    let (reader, writer) = std::io::pipe().expect("a pipe");
    drop(reader);
    writer.into()
}

/// A stream on a full disk.
fn full() -> Stdio {
    File::options().write(true).open("/dev/full").expect("/dev/full").into()
}

#[test]
fn a_run_without_readers_writes_all_its_files() {
    let folder = inputs();
    let files = |name: &OsStr| {
        let mut found = Vec::new();
        let mut folders = vec![folder.0.path().join(name)];
        while let Some(next) = folders.pop() {
            for entry in fs::read_dir(next).expect("a folder").map(|entry| entry.expect("an entry")) {
                let kind = entry.file_type().expect("a kind");
                if kind.is_dir() { folders.push(entry.path()) } else { found.push(entry.file_name()) }
            }
        }
        found.sort();
        found
    };
    let run = |name: &OsStr, out: Stdio, err: Stdio| {
        let mut command = isotherm(folder.0.path(), &["run", "scene.toml", "--device", "cpu", "-o"]);
        command.arg(name).stdout(out).stderr(err);
        end(command)
    };
    assert!(run(OsStr::new("heard"), Stdio::null(), Stdio::null()).status.success());
    let heard = files(OsStr::new("heard"));
    // The name of a folder need not be UTF-8.
    let unheard = OsStr::from_bytes(b"un\xffheard");
    assert_eq!(run(unheard, left(), left()).status.code(), Some(0), "a reader that leaves is no error");
    assert_eq!(files(unheard), heard);
    let told = run(OsStr::new("full"), full(), Stdio::piped());
    assert_eq!(told.status.code(), Some(1));
    assert!(stderr(&told).contains("error: cannot write to standard output"), "{}", stderr(&told));
    assert_eq!(files(OsStr::new("full")), heard);
}

#[test]
fn no_command_panics_if_its_streams_take_nothing() {
    let folder = inputs();
    let answers: [&[&str]; 8] = [
        &["--help"],
        &["--version"],
        &["info", "made.glb"],
        &["info", "scene.toml", "--json"],
        &["radiance", "300", "--device", "cpu"],
        &["environment", "plate", "--altitude", "4e5", "--nadir-angle", "0"],
        &["network", "net.toml", "--device", "cpu"],
        &["response", "fit", "data.csv"],
    ];
    for arguments in answers {
        let run = |out: Stdio, err: Stdio| {
            let mut command = isotherm(folder.0.path(), arguments);
            command.stdout(out).stderr(err);
            end(command)
        };
        let whole = run(Stdio::piped(), full());
        assert!(whole.status.success() && !whole.stdout.is_empty(), "{arguments:?}");
        let quiet = run(left(), Stdio::piped());
        assert!(quiet.status.success() && !stderr(&quiet).contains("error"), "{arguments:?} {}", stderr(&quiet));
        let told = run(full(), Stdio::piped());
        assert_eq!(told.status.code(), Some(1), "{arguments:?}");
        assert!(stderr(&told).contains("error: cannot write to standard output"), "{}", stderr(&told));
        assert_eq!(run(full(), full()).status.code(), Some(1), "{arguments:?}");
    }
    for (arguments, code) in [(&["--nonsense"][..], 2), (&["info", "missing.toml"], 2), (&["run"], 2)] {
        for stream in [full, left] {
            let mut command = isotherm(folder.0.path(), arguments);
            command.stdout(stream()).stderr(stream());
            assert_eq!(end(command).status.code(), Some(code), "{arguments:?}");
        }
    }
    for arguments in COMMANDS {
        let mut command = command(&folder, arguments, "some");
        command.stdout(Stdio::null()).stderr(full());
        assert_eq!(end(command).status.code(), Some(0), "{arguments:?}");
    }
}

/// Every file of the program writes to the standard streams through `output/console.rs`, which does not panic.
#[test]
fn no_file_prints_by_itself() {
    fn scan(folder: &Path, found: &mut Vec<String>) {
        for entry in fs::read_dir(folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                scan(&path, found);
            } else if !path.ends_with("output/console.rs") && !path.ends_with("tests.rs") {
                let text = fs::read_to_string(&path).unwrap_or_default();
                let code = text.split("#[cfg(test)]").next().unwrap_or_default();
                let prints = ["print!(", "println!(", "dbg!(", "io::stdout(", "io::stderr("];
                let lines = code.lines().filter(|line| !line.trim_start().starts_with("//"));
                let of_file = lines.filter(|line| prints.iter().any(|print| line.contains(print)));
                found.extend(of_file.map(|line| format!("{}: {}", path.display(), line.trim())));
            }
        }
    }
    let mut found = Vec::new();
    scan(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src"), &mut found);
    assert!(found.is_empty(), "use say! or answer!: {found:#?}");
}
