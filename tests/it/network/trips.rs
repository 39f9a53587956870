//! Networks there and back: each exporter against its importer, on random networks and with numbers far below the ranges of a network file.

use std::path::Path;

use isotherm::internals::{self, HeatTable, NetworkFile, NodeKind, Tmd, tmd};

use super::random::{Random, case};

/// Cases of each test.
const CASES: u64 = 120;
/// Smallest size of a power, an area and a capacitance in a network file (docs/scene.md, "Sizes of numbers").
const SMALLEST: [f64; 3] = [1e-15, 1e-15, 1e-12];

/// A random network as a file would hold it.
fn file(seed: u64) -> NetworkFile {
    let case = case(seed, 40);
    let labels = (0..case.network.len()).map(|node| format!("node {node} \"{seed}\"")).collect();
    let times = case.schedule.times.clone();
    NetworkFile { labels, network: case.network, schedule: case.schedule, times, assumptions: Vec::new() }
}

fn read(file: &NetworkFile) -> Result<NetworkFile, String> {
    let text = file.text(&["made by a test".to_owned()], &[]);
    NetworkFile::parse(&text, Path::new("made.toml")).map_err(|error| error.to_string())
}

/// A network by way of the bytes of a TMD, with its labels, and of the text of a network file.
fn by_tmd(file: &NetworkFile, change: impl FnOnce(&mut Tmd)) -> Result<NetworkFile, String> {
    let (mut made, _) = tmd(file, "made by a test", None);
    change(&mut made);
    let read_back = Tmd::parse(made.bytes()?, Path::new("made.TMD")).map_err(|error| error.to_string())?;
    read(&internals::network(&read_back)?.file)
}

fn power_at(file: &NetworkFile, node: usize, time: f64) -> f64 {
    let tables = file.schedule.heat.iter().filter(|(heated, _)| *heated as usize == node);
    tables.map(|(_, table): &(u32, HeatTable)| table.after(time).0).sum()
}

#[test]
fn a_network_is_the_same_after_its_text() {
    for seed in 0..CASES {
        let made = file(seed);
        let again = read(&made).unwrap_or_else(|error| panic!("seed {seed}: {error}"));
        assert_eq!((&again.labels, &again.network), (&made.labels, &made.network), "seed {seed}");
        assert_eq!(again.text(&[], &[]), made.text(&[], &[]), "seed {seed}");
    }
}

#[test]
fn a_network_is_the_same_after_its_tmd() {
    for seed in 0..CASES {
        let made = read(&file(seed)).unwrap_or_else(|error| panic!("seed {seed}: {error}"));
        let back = by_tmd(&made, |_| ()).unwrap_or_else(|error| panic!("seed {seed}: {error}"));
        let (here, there) = (&made.network, &back.network);
        for node in 0..here.len() {
            assert_eq!((here.kinds[node], here.capacitances[node]), (there.kinds[node], there.capacitances[node]));
            assert!((here.temperatures[node] - there.temperatures[node]).abs() < 1e-9, "seed {seed}, node {node}");
            for time in made.times.iter().filter(|_| here.kinds[node] != NodeKind::Boundary) {
                let [stated, found] = [power_at(&made, node, *time), power_at(&back, node, *time - made.times[0])];
                assert!(
                    (stated - found).abs() <= 1e-6 * stated.abs().max(1e-6),
                    "seed {seed}, node {node}: {stated} {found}"
                );
            }
        }
        assert_eq!(here.linear, there.linear[..here.linear.len()], "seed {seed}");
        // Each emissive area is a conductor to a node of space.
        let open =
            (0..here.len()).filter(|node| here.emissive_areas[*node] > 0.0 && here.kinds[*node] != NodeKind::Boundary);
        assert_eq!(there.radiative.len(), here.radiative.len() + open.count(), "seed {seed}");
    }
}

/// Our own CubeSat was refused on its way back from a TMD, because of a power of 6.7e-16 W.
#[test]
fn numbers_too_small_for_their_range_count_as_0_and_are_told_once() {
    let mut random = Random(33);
    for seed in 0..CASES {
        let made = read(&file(seed)).expect("a network");
        let small = by_tmd(&made, |tmd| {
            for node in &mut tmd.nodes {
                let scale = random.scale(1e-30, 1e-3);
                node.loads.iter_mut().flatten().for_each(|watts| *watts *= scale);
                if random.chance(0.3) {
                    node.capacitances.iter_mut().for_each(|capacitance| *capacitance *= 1e-20);
                }
            }
            tmd.linear.values.iter_mut().for_each(|value| *value *= 1e-30);
            tmd.radiative.values.iter_mut().filter(|_| seed % 3 == 0).for_each(|value| *value *= 1e-20);
        });
        // A node that loses all that it is joined by has no balance, which is an error of its own.
        let small = match small {
            Err(error) if error.contains("has no path to a node") => continue,
            small => small.unwrap_or_else(|error| panic!("seed {seed}: {error}")),
        };
        let [watts, areas, stored] = SMALLEST;
        let beyond = |value: &f64, least: f64| *value == 0.0 || value.abs() >= least;
        for (_, table) in &small.schedule.heat {
            assert!(table.powers.iter().all(|power| beyond(power, watts)), "seed {seed}: {table:?}");
        }
        assert!(small.network.radiative.iter().all(|one| beyond(&one.exchange_area, areas)), "seed {seed}");
        assert!(small.network.capacitances.iter().all(|one| beyond(one, stored)), "seed {seed}");
        let told = small.assumptions.iter().filter(|told| told.contains("counts as 0")).count();
        assert!(told <= 1, "seed {seed}: {:?}", small.assumptions);
    }
}

#[test]
fn a_number_above_its_range_is_refused_by_name() {
    let made = read(&file(3)).expect("a network");
    let error =
        by_tmd(&made, |tmd| tmd.nodes[0].loads[2].iter_mut().for_each(|watts| *watts = 1e19)).expect_err("1e19 W");
    assert!(error.contains("heat") && error.contains("1e19"), "{error}");
}
