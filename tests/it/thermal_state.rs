//! A thermal state in a file: a run that begins with it is the run that saved it, and one of another craft is refused.

use super::craft::{Folder, SCENE, scene_with};
use super::program::{end, isotherm, refusal, run, stderr, succeed};

const STATE: &str = "warm.state";

/// A scene with a warm-up.
fn warm() -> String {
    scene_with(&[("draw_every = 4", "draw_every = 4\nwarm_up_orbits = 0.3")])
}

fn read(folder: &Folder, name: &str) -> Vec<u8> {
    std::fs::read(folder.path(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}

/// Runs a scene that saves its state after the warm-up, then one that begins with it.
fn both(scene: &str, device: &[&str]) -> Folder {
    let folder = Folder::new(scene);
    let save = ["run", "scene.toml", "-o", "one", "--save-state", STATE, "--save-state-at", "0"];
    let ran = run(folder.0.path(), &[&save[..], device].concat());
    assert_eq!(ran.code, 0, "{}", ran.err);
    let ran = run(folder.0.path(), &[&["run", "scene.toml", "-o", "two", "--from-state", STATE], device].concat());
    assert_eq!(ran.code, 0, "{}", ran.err);
    assert!(ran.err.contains("There is no warm-up, and [initial] is not used"), "{}", ran.err);
    folder
}

fn assert_same(folder: &Folder) {
    for name in ["series.csv", "frames/step_000000.exr", "frames/step_000012.exr"] {
        let [one, two] = ["one", "two"].map(|root| read(folder, &format!("{root}/{name}")));
        assert!(one == two, "{name} differs");
    }
    let [one, two] = ["one", "two"].map(|root| {
        let report: serde_json::Value =
            serde_json::from_slice(&read(folder, &format!("{root}/report.json"))).expect("JSON");
        (report["accuracy"].clone(), report["speed"]["steps"].as_u64().expect("a number"))
    });
    assert_eq!(one.0, two.0, "the check goes on too");
    assert!(one.1 > two.1 && two.1 == 12, "{} and {} steps", one.1, two.1);
}

#[test]
fn a_run_from_a_state_is_the_run_that_saved_it() {
    let folder = both(&warm(), &[]);
    assert_same(&folder);
    // Without the state it is another one.
    folder.write("cold.toml", SCENE);
    succeed(folder.0.path(), &["run", "cold.toml", "-o", "cold"]);
    assert!(read(&folder, "cold/series.csv") != read(&folder, "one/series.csv"));
    // Another camera, orbit and attitude may follow.
    let other =
        scene_with(&[("width = 96", "width = 48"), ("beta_deg = 20", "beta_deg = -40"), ("steps = 12", "steps = 2")]);
    folder.write("other.toml", &other);
    succeed(folder.0.path(), &["run", "other.toml", "-o", "other", "--from-state", STATE]);
    // The image at time 0 is that of the state.
    succeed(folder.0.path(), &["render", "scene.toml", "--time", "0", "-o", "one.exr", "--from-state", STATE]);
    let frame = |name: &str| isotherm::internals::read_exr(&folder.path(name)).expect("a frame").0;
    assert_eq!(frame("one.exr").temperature, frame("one/frames/step_000000.exr").temperature);
    // Another sample has no state in the file.
    let without =
        end(isotherm(folder.0.path(), &["run", "scene.toml", "-o", "three", "--from-state", STATE, "--check=7"]));
    assert!(without.status.success() && stderr(&without).contains("nothing was compared with the f64 reference"));
}

#[test]
fn so_it_is_on_the_reference_and_with_shadows() {
    assert_same_of_reference(&both(&warm(), &["--device", "cpu"]));
    assert_same(&both(&format!("{}\n[shadows]\n", warm()), &[]));
}

fn assert_same_of_reference(folder: &Folder) {
    for name in ["series.csv", "frames/step_000012.exr"] {
        let [one, two] = ["one", "two"].map(|root| read(folder, &format!("{root}/{name}")));
        assert!(one == two, "{name} differs");
    }
}

/// A run that begins in another pose of a joint than the run that saved its state: patches have another order on the device there. What surfaces receive from each other is
/// that of the state, on the device and on the reference.
#[test]
fn what_surfaces_receive_goes_on_from_another_pose() {
    let scene = |schedule: &str| {
        let joint = format!(
            "[shadows]\n[exchange]\nrays = 128\npatch_edge = 0.8\n[[joint]]\npart = \"wing_port\"\naxis = \"+Y\"\norigin = [0, 0, 0]\nmode = \"schedule\"\n\
             schedule = {schedule}\n[output]\nbudget = true\n[radiance]"
        );
        scene_with(&[("[radiance]", &joint)])
    };
    for device in [&[][..], &["--device", "cpu"]] {
        let folder = Folder::new(&scene("{ time = [0, 720], angle_deg = [0, 90] }"));
        folder.write("later.toml", &scene("{ time = [-300, 420], angle_deg = [0, 90] }"));
        let save = ["run", "scene.toml", "-o", "one", "--save-state", STATE, "--save-state-at", "300"];
        succeed(folder.0.path(), &[&save[..], device].concat());
        succeed(folder.0.path(), &[&["run", "later.toml", "-o", "two", "--from-state", STATE], device].concat());
        let received = |root: &str, time: &str| -> Vec<(String, f64)> {
            let text = String::from_utf8(read(&folder, &format!("{root}/budget.csv"))).expect("text");
            let column = text.lines().next().expect("a head").split(',').position(|name| name == "Q_exchange");
            let rows = text.lines().map(|row| row.split(',').collect::<Vec<_>>()).filter(|row| row[0] == time);
            rows.map(|row| (row[1].to_owned(), row[column.expect("a column")].parse().expect("a number"))).collect()
        };
        let [saved, other, begun] =
            [("one", "300"), ("one", "360"), ("two", "0")].map(|(root, time)| received(root, time));
        let apart = |one: &[(String, f64)]| {
            let each = one
                .iter()
                .zip(&begun)
                .map(|((part, one), (same, begun))| if part == same { (one - begun).abs() } else { 1e9 });
            each.fold(0.0, f64::max)
        };
        assert!(saved.len() > 2 && saved.iter().any(|(_, watts)| *watts > 1.0), "{saved:?}");
        assert!(apart(&saved) < 1e-3 && apart(&other) > 0.05, "{saved:?} {begun:?} {other:?}");
    }
}

/// The temperatures at the end of a run are those at time 0 of the next.
#[test]
fn a_state_of_the_end_begins_the_next_run() {
    let folder = Folder::new(SCENE);
    succeed(folder.0.path(), &["run", "scene.toml", "-o", "one", "--save-state", STATE]);
    succeed(folder.0.path(), &["run", "scene.toml", "-o", "two", "--from-state", STATE]);
    let rows = |name: &str| -> Vec<String> {
        String::from_utf8(read(&folder, name)).expect("text").lines().map(str::to_owned).collect()
    };
    let values = |row: &str| row.split_once(',').expect("a time").1.to_owned();
    let (one, two) = (rows("one/series.csv"), rows("two/series.csv"));
    assert_eq!(values(&one[13]), values(&two[1]));
    assert_ne!(values(&one[1]), values(&two[1]));
}

#[test]
fn a_state_that_does_not_fit_is_refused_with_what_differs() {
    let folder = Folder::new(SCENE);
    succeed(folder.0.path(), &["run", "scene.toml", "-o", "one", "--save-state", STATE]);
    let refused = |scene: &str, state: &str, more: &[&str]| {
        folder.write("other.toml", scene);
        let arguments = [&["run", "other.toml", "-o", "none", "--from-state", state], more].concat();
        let (code, message) = refusal(&end(isotherm(folder.0.path(), &arguments)));
        assert!(code != Some(0) && !folder.path("none").exists(), "{message}");
        message
    };
    for (from, to, expected) in [
        ("emissivity = 0.83", "emissivity = 0.84", "the material 'skin' has other values"),
        ("t_max_steps = 20", "t_max_steps = 21", "the material 'skin' has other values"),
        ("max_edge = 0.7", "max_edge = 0.5", "the order of the nodes is another"),
        ("step = 60", "step = 30", "time.step was 60 s and is 30 s"),
        ("[radiance]", "[shadows]\n[radiance]", "[shadows] is another"),
    ] {
        let message = refused(&scene_with(&[(from, to)]), STATE, &[]);
        assert!(message.contains("is of another craft") && message.contains(expected), "{message}");
        assert!(expected.contains("'skin'") || !message.contains("material '"), "only what differs: {message}");
    }
    assert!(refused(SCENE, STATE, &["--device", "cpu"]).contains("it was taken on a device"));
    std::fs::copy(folder.path("made.glb"), folder.path("kept.glb")).expect("a copy");
    let mut model = read(&folder, "made.glb");
    // Blanks behind the JSON of a glTF are allowed, so this is another file of the same craft.
    let at = model.windows(4).position(|four| four == b"skin").expect("a name");
    model[at] = b'k';
    std::fs::write(folder.path("made.glb"), &model).expect("a file");
    let message = refused(&SCENE.replace("\"skin\"", "\"kkin\""), STATE, &[]);
    for part in ["the model made.glb is another file", "the material 'kkin' is new", "the material 'skin' is gone"] {
        assert!(message.contains(part), "{message}");
    }
    std::fs::copy(folder.path("kept.glb"), folder.path("made.glb")).expect("a copy");

    let whole = read(&folder, STATE);
    for (name, bytes, expected) in [
        ("cut.state", &whole[..whole.len() / 2], "is damaged or truncated"),
        ("empty.state", &[][..], "is no saved state"),
        (
            "turned.state",
            &{
                let mut turned = whole.clone();
                turned[whole.len() / 2] ^= 1;
                turned
            }[..],
            "its checksum does not fit",
        ),
    ] {
        std::fs::write(folder.path(name), bytes).expect("a file");
        assert!(refused(SCENE, name, &[]).contains(expected), "{name}");
    }
    let earlier = [&b"isotherm state\n"[..], &1u32.to_ne_bytes(), &0x0102_0304u32.to_ne_bytes(), &[0; 40]].concat();
    std::fs::write(folder.path("earlier.state"), earlier).expect("a file");
    let message = refused(SCENE, "earlier.state", &[]);
    let expected = "earlier.state was written by an earlier version of isotherm; start the run anew that saves it";
    assert!(message.contains(expected), "{message}");
    assert!(refused(SCENE, "absent.state", &[]).contains("absent.state cannot be read"));
    let wrong_time = ["run", "scene.toml", "-o", "none", "--save-state", "x.state", "--save-state-at", "61"];
    let (_, message) = refusal(&end(isotherm(folder.0.path(), &wrong_time)));
    assert!(message.contains("--save-state-at is the time of a step, a multiple of 60 s from 0 to 720 s"), "{message}");
}
