//! ESATAN TMD files: the public deck DISCTR against its own solution, a small file against its closed form, refusals, and a network there and back.

use std::path::{Path, PathBuf};

use glam::DVec3;
use hdf5_writer::{AttributeBuilder, Hdf5Builder, WriteOptions};
use isotherm::internals;
use isotherm::internals::{
    Conductors, ImportedTmd, IntegrationSettings, Integrator, Network, NetworkFile, NodeKind, ReferenceStepper, Tmd,
    TmdError, TmdNode, TmdSolution, integrate, tmd,
};

use super::command::FILE;
use crate::model::shared_files::shared;
use crate::program::run;

/// What an imported solution may differ from that of the file [K].
pub const LIMIT: f64 = 20e-3;

/// Temperatures of all nodes at the times of the file, as its default integrator finds them [K].
pub fn solved(file: &NetworkFile) -> Vec<Vec<f64>> {
    let mut stepper = ReferenceStepper::new(file.network.clone(), &file.schedule.sensors());
    let settings = IntegrationSettings::of(Integrator::Default);
    integrate(&mut stepper, &file.network, &file.schedule, &settings, |_| true).expect("a solution").rows
}

/// Greatest difference between rows and the temperatures of a TMD `late` times later [K].
fn off(file: &NetworkFile, rows: &[Vec<f64>], tmd: &Tmd, late: usize) -> f64 {
    let mut worst = 0.0f64;
    for (at, label) in file.labels.iter().enumerate() {
        let node = tmd.nodes.iter().find(|node| node.name == *label).expect("a node of the TMD");
        for (row, kelvin) in rows.iter().zip(&node.temperatures[late..]) {
            worst = worst.max((row[at] - kelvin).abs());
        }
    }
    worst
}

/// A TMD as a network, by way of the text of a network file.
fn imported(tmd: &Tmd) -> (NetworkFile, ImportedTmd) {
    let imported = internals::network(tmd).expect("a network");
    let text = imported.file.text(&["a comment".to_owned()], &imported.comments);
    let read = NetworkFile::parse(&text, Path::new("imported.toml")).expect("a network file");
    assert_eq!((&read.labels, &read.network), (&imported.file.labels, &imported.file.network));
    assert_eq!((&read.times, &read.schedule), (&imported.file.times, &imported.file.schedule));
    (read, imported)
}

/// The public deck: the file that ISOTHERM_DISCTR names, or that of the shared folder. `None` with a printed line without it.
pub fn deck() -> Option<PathBuf> {
    let named = std::env::var_os("ISOTHERM_DISCTR").map(PathBuf::from);
    let path = named.or_else(|| shared().map(|shared| shared.join("thermal/DISCTR_TRANSIENT.TMD")))?;
    if !path.exists() {
        println!("skipped: {} is not there (pycanha-core, test/data/esatan)", path.display());
        return None;
    }
    Some(path)
}

#[test]
fn the_public_deck_is_met() {
    let Some(path) = deck() else { return };
    let tmd = Tmd::load(&path).expect("the deck");
    let (mut file, imported) = imported(&tmd);
    assert_eq!((file.network.len(), file.network.linear.len(), file.network.radiative.len()), (102, 190, 5050));
    assert_eq!((file.times.len(), file.times[100]), (101, 10_000.0));
    assert!(imported.notes.iter().any(|note| note.contains("99998 (INACTIVE_NODE)")), "{:?}", imported.notes);
    let error = off(&file, &solved(&file), &tmd, 0);
    println!("DISCTR: {:.3} mK off its own solution", 1e3 * error);
    assert!(error <= LIMIT, "{error}");
    assert!(off(&file, &solved(&file)[..100], &tmd, 1) > LIMIT, "rows of another time must not pass");
    file.network.radiative.iter_mut().for_each(|conductor| conductor.exchange_area *= 1.01);
    assert!(off(&file, &solved(&file), &tmd, 0) > LIMIT, "another model must not pass");
}

fn node(number: i64, label: &str, kind: char, start: f64, capacitance: f64) -> TmdNode {
    TmdNode {
        number,
        name: number.to_string(),
        label: label.to_owned(),
        kind,
        position: DVec3::new(0.5 * number as f64, -1.0, 0.0),
        temperatures: vec![start; TIMES],
        capacitances: vec![capacitance; TIMES],
        loads: [0; 5].map(|_| vec![0.0; TIMES]),
    }
}

/// Times of the small file, 100 s apart.
const TIMES: usize = 9;

/// A plate of 200 J/K at 300 K takes 3 W of its heater and 2 W of the Sun and gives 0.5 W/K to a wall at 250 K, by way of a node without capacitance and two
/// conductors of 1 W/K. It tends to 260 K within 400 s.
pub fn small() -> Tmd {
    let mut plate = node(10, "PLATE", 'D', 300.0, 200.0);
    plate.loads[2] = vec![3.0; TIMES];
    plate.loads[4] = vec![2.0; TIMES];
    let mut between = node(20, "JOINT", 'D', 275.0, 0.0);
    let at = |time: usize| 260.0 + 40.0 * (-(100.0 * time as f64) / 400.0).exp();
    plate.temperatures = (0..TIMES).map(at).collect();
    between.temperatures = plate.temperatures.iter().map(|kelvin| 0.5 * (kelvin + 250.0)).collect();
    Tmd {
        description: "SMALL".to_owned(),
        times: (0..TIMES).map(|time| 100.0 * time as f64).collect(),
        nodes: vec![plate, between, node(30, "WALL", 'B', 250.0, 0.0), node(40, "OLD", 'X', 0.0, 7.0)],
        linear: Conductors {
            nodes: vec![[0, 1], [1, 2], [0, 3]],
            values: vec![1.0, 1.0, 5.0],
            ..Conductors::default()
        },
        radiative: Conductors::default(),
        notes: Vec::new(),
    }
}

/// The small file with something changed, as it is read.
fn changed(change: impl Fn(&mut Tmd)) -> Result<Tmd, TmdError> {
    let mut tmd = small();
    change(&mut tmd);
    Tmd::parse(tmd.bytes().expect("a file"), Path::new("small.TMD"))
}

#[test]
fn a_small_file_is_read_and_solved() {
    let read = changed(|_| ()).expect("a TMD");
    let written = small();
    assert_eq!((&read.description, &read.times), (&written.description, &written.times));
    assert_eq!((&read.linear, &read.radiative), (&written.linear, &written.radiative));
    for (read, written) in read.nodes.iter().zip(&written.nodes) {
        let kelvin = read.temperatures.iter().zip(&written.temperatures);
        assert!(kelvin.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) < 1e-12);
        assert_eq!(&TmdNode { temperatures: written.temperatures.clone(), ..read.clone() }, written);
    }
    let (file, imported) = imported(&read);
    assert_eq!(file.network.kinds, [NodeKind::Diffusive, NodeKind::Arithmetic, NodeKind::Boundary]);
    for part in ["40 (OLD)", "1 GL end at an inactive node", "QI up to 3 W", "QS up to 2 W"] {
        assert!(imported.notes.iter().any(|note| note.contains(part)), "{part}: {:?}", imported.notes);
    }
    let error = off(&file, &solved(&file), &read, 0);
    println!("small TMD: {:.3} mK off the closed form", 1e3 * error);
    assert!(error <= LIMIT, "{error}");
    let other = changed(|tmd| tmd.linear.values[1] = 1.01).expect("a TMD");
    let (file, _) = self::imported(&other);
    assert!(off(&file, &solved(&file), &read, 0) > LIMIT, "another conductor must not pass");
}

#[test]
fn heat_that_changes_becomes_a_table() {
    let read = changed(|tmd| tmd.nodes[0].loads[0] = (0..TIMES).map(|time| if time < 4 { 1.0 } else { 2.0 }).collect());
    let (file, _) = imported(&read.expect("a TMD"));
    let [(0, table)] = file.schedule.heat.as_slice() else { panic!("{:?}", file.schedule.heat) };
    assert_eq!(table.times, [0.0, 300.0, 400.0, 800.0]);
    assert_eq!(table.powers, [6.0, 6.0, 7.0, 7.0]);
}

#[test]
fn what_is_no_tmd_is_refused() {
    let refused = |bytes: &[u8]| Tmd::parse(bytes.to_vec(), Path::new("bad.TMD")).expect_err("refused").to_string();
    let whole = small().bytes().expect("a file");
    assert!(refused(b"time,node,T\n").contains("does not begin as an HDF5 file"));
    for length in (8..whole.len()).step_by(97).chain([whole.len() / 2, whole.len() - 1]) {
        let message = refused(&whole[..length]);
        assert!(message.starts_with("bad.TMD: ") && message.contains("truncated"), "{length}: {message}");
    }
    let other = Hdf5Builder::new().attribute(AttributeBuilder::fixed_string_vector("FileVersion", &["02.10"]).unwrap());
    let other = other.into_plan().unwrap().encode(WriteOptions::default()).unwrap();
    assert_eq!(refused(&other), "bad.TMD: FileVersion: is '02.10'; isotherm reads 01.xx");
    let plain = Hdf5Builder::new().into_plan().unwrap().encode(WriteOptions::default()).unwrap();
    assert!(refused(&plain).contains("FileVersion: cannot be read"));
    // Names of attributes are the data of a dataset, which has no checksum.
    let mut renamed = whole;
    let place = renamed.windows(11).position(|bytes| bytes == b"Capacitance").expect("a name");
    renamed[place] = b'K';
    assert!(refused(&renamed).ends_with("thermalNodesRealData: has no attribute Capacitance"));
    let message = |change: &dyn Fn(&mut Tmd)| changed(change).expect_err("refused").to_string();
    assert!(message(&|tmd| tmd.nodes[0].temperatures[3] = f64::NAN).contains("temperature of node 10 at 300 s is NaN"));
    assert!(message(&|tmd| tmd.nodes[0].temperatures[3] = -1.0).contains("below 0 K"));
    assert!(message(&|tmd| tmd.times[3] = 50.0).contains("must ascend"));
    assert!(message(&|tmd| tmd.nodes[1].number = 10).contains("two nodes have the number 10"));
    assert!(message(&|tmd| tmd.nodes[1].kind = 'Q').contains("is of type 'Q'"));
    assert!(message(&|tmd| tmd.linear.nodes[0] = [0, 9]).contains("joins node 10 of 4"));
    assert!(message(&|tmd| tmd.linear.values[0] = -1.0).contains("conductor 1 is -1 at time 1"));
    let empty = changed(|tmd| tmd.nodes.iter_mut().for_each(|node| node.kind = 'X')).expect("a TMD");
    assert_eq!(internals::network(&empty).unwrap_err(), "no node is active");
}

/// Two networks with numbers that differ by rounding of degrees Celsius alone.
fn same(a: &Network, b: &Network) -> bool {
    let close = a.temperatures.iter().zip(&b.temperatures).all(|(a, b)| (a - b).abs() < 1e-12);
    close && Network { temperatures: b.temperatures.clone(), ..a.clone() } == *b
}

#[test]
fn a_network_there_and_back_is_the_same() {
    let (file, _) = imported(&small());
    let rows = solved(&file);
    let (there, notes) = tmd(&file, "again", Some(TmdSolution { times: &file.schedule.times, rows: &rows }));
    assert!(notes.is_empty(), "{notes:?}");
    let read = Tmd::parse(there.bytes().expect("a file"), Path::new("again.TMD")).expect("a TMD");
    assert!(off(&file, &rows, &read, 0) < 1e-12);
    let (back, _) = imported(&read);
    assert!(same(&file.network, &back.network));
    assert_eq!((&file.labels, &file.schedule, &file.times), (&back.labels, &back.schedule, &back.times));
    let mut other = back.network;
    other.capacitances[0] += 1e-9;
    assert!(!same(&file.network, &other));
}

#[test]
fn space_jumps_and_names_survive_in_what_is_solved() {
    let text = FILE
        .split("[[thermostat]]")
        .next()
        .expect("nodes")
        .replace("space_temperature = 0.0", "space_temperature = 3.0")
        .replace(
            "capacitance = 400.0",
            "capacitance = 400.0\nemissive_area = 0.3\nheat = { time = [0, 150, 150, 300], power = [5, 10, 60, 80] }",
        )
        + "[output]\ntimes = [0, 100, 200, 400]\n";
    let file = NetworkFile::parse(&text, Path::new("net.toml")).expect("a network");
    let (there, notes) = tmd(&file, "net.toml", None);
    for part in ["99999", "have numbers", "3 times are added", "those of the start"] {
        assert!(notes.iter().any(|note| note.contains(part)), "{part}: {notes:?}");
    }
    let read = Tmd::parse(there.bytes().expect("a file"), Path::new("net.TMD")).expect("a TMD");
    assert_eq!(read.nodes[0].label, "tank, left");
    let (back, _) = imported(&read);
    assert_eq!(back.labels, ["1", "2", "99999"]);
    let [ours, theirs] = [&file, &back].map(|file| (file.schedule.times.clone(), solved(file)));
    for (time, row) in ours.0.iter().zip(&ours.1) {
        let at = theirs.0.iter().position(|own| own == time).expect("the same times");
        assert!((row[0] - theirs.1[at][0]).abs() < 5e-3, "{time} s: {} {}", row[0], theirs.1[at][0]);
    }
    assert!((ours.1[3][0] - ours.1[2][0]).abs() > 1.0);
}

#[test]
fn the_program_exports_and_imports() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("net.toml"), FILE).expect("written");
    let done = |arguments: &[&str]| {
        let ran = run(folder.path(), arguments);
        assert_eq!(ran.code, 0, "{arguments:?}: {}", ran.err);
        ran.err
    };
    done(&["network", "net.toml", "-o", "out.csv"]);
    let told = done(&["network", "export", "net.toml", "--series", "out.csv", "-o", "net.TMD"]);
    assert!(told.contains("thermostat of 'tank, left', 30 W from 280 to 285 K, is left out"), "{told}");
    let told = done(&["network", "import", "net.TMD", "-o", "back.toml"]);
    assert!(told.contains("imported: 2 of 2 nodes, 1 GL, 0 GR, 3 times to 400 s"), "{told}");
    let read = Tmd::load(&folder.path().join("net.TMD")).expect("a TMD");
    assert!((read.nodes[0].temperatures[1] - 285.2998).abs() < 1e-3);
    done(&["network", "export", "net.toml", "-o", "tables"]);
    let table = |name: &str| std::fs::read_to_string(folder.path().join("tables").join(name)).expect("a table");
    assert_eq!(table("gl.csv"), "from,to,gl_w_per_k\n\"tank, left\",rack,0.5\n");
    assert!(table("nodes.csv").contains("\"tank, left\",diffusive,400,0,290\n"), "{}", table("nodes.csv"));
    let again = NetworkFile::load(&folder.path().join("tables/network.toml")).expect("a network file");
    let first = NetworkFile::load(&folder.path().join("net.toml")).expect("a network file");
    assert_eq!((&again.network, &again.schedule, &again.times), (&first.network, &first.schedule, &first.times));
    let ran = run(folder.path(), &["network", "export", "net.toml", "-o", "tables"]);
    assert_eq!(ran.code, 2, "a folder with files is refused: {}", ran.err);
    std::fs::write(folder.path().join("cut.TMD"), &std::fs::read(folder.path().join("net.TMD")).expect("read")[..900])
        .expect("written");
    let ran = run(folder.path(), &["network", "import", "cut.TMD", "-o", "cut.toml"]);
    assert_eq!(ran.code, 2);
    assert!(ran.err.contains("cut.TMD") && ran.err.contains("truncated"), "{}", ran.err);
    assert!(!folder.path().join("cut.toml").exists());
}
