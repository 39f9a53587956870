//! `isotherm paper` as a user runs it, with a cube instead of the station.

use std::path::Path;

use super::model::make::Maker;
use super::program::run;

const SCENE: &str = "\
name = 'cube'
[model]
path = 'made.glb'
[time]
step = 15
steps = 10
[orbit]
altitude = 408e3
period = 5553
beta_deg = 20
phase_deg = 0
[attitude]
mode = 'nadir'
nadir_axis = '+Z'
forward_axis = '+X'
[environment]
solar_constant = 1361
planet_ir = 237
background_temperature = 2.7
[[material]]
match = '*'
absorptivity = 0.3
emissivity = 0.8
sides = 'outside'
response = 'transition'
heating = { function = 'quadratic', t_max_steps = 5 }
cooling = { function = 'quadratic', t_max_steps = 5 }
[camera]
width = 96
height = 64
fov_deg = 40
frame = 'body'
position = [4, 3, -4]
look_at = [0, 0, 0]
up = [0, 0, -1]
";

/// Writes `cube.toml` and its model to a folder.
pub fn cube_scene(folder: &Path) {
    Maker::cube().save(folder);
    std::fs::write(folder.join("cube.toml"), SCENE).unwrap();
}

fn rows(path: &Path) -> Vec<Vec<String>> {
    let mut reader = csv::Reader::from_path(path).unwrap();
    reader.records().map(|record| record.unwrap().iter().map(str::to_owned).collect()).collect()
}

/// The numbers of a table without its column `step`.
fn numbers(path: &Path) -> Vec<Vec<f64>> {
    let numbers = |row: Vec<String>| row[1..].iter().map(|cell| cell.parse().unwrap()).collect();
    rows(path).into_iter().map(numbers).collect()
}

/// A column of numbers. The first is 1.
fn column(rows: &[Vec<f64>], number: usize) -> Vec<Vec<f64>> {
    rows.iter().map(|row| vec![row[number - 1]]).collect()
}

/// The largest difference of two tables.
fn furthest(a: &[Vec<f64>], b: &[Vec<f64>]) -> f64 {
    assert_eq!(a.len(), b.len());
    let pairs = a.iter().zip(b).flat_map(|(a, b)| a.iter().zip(b));
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

#[test]
#[ignore = "long: tools/test --all"]
fn the_device_and_the_reference_draw_the_same_figures_and_agree_with_the_paper() {
    let folder = tempfile::tempdir().unwrap();
    cube_scene(folder.path());
    for (out, device) in [("device", None), ("cpu", Some(["--device", "cpu"]))] {
        let mut arguments = vec!["paper", "-o", out, "--scene", "cube.toml", "--time", "60"];
        arguments.extend(device.iter().flatten());
        let ran = run(folder.path(), &arguments);
        assert_eq!(ran.code, 0, "{}", ran.err);
        assert!(ran.out.contains("figures 5 and 6: 90 of 90 numbers agree"), "{}", ran.out);
        assert!(ran.out.contains("the scenario: 47 of 59 numbers agree"), "{}", ran.out);
        assert!(ran.err.contains("224 km means a period of 5339 s"), "{}", ran.err);
        assert!(ran.err.contains("14 periodic states"), "{}", ran.err);
        let again = run(folder.path(), &arguments);
        assert!(again.code == 2 && again.err.contains("--force"), "{}", again.err);
    }
    let mut largest = 0.0f64;
    for (figure, panels) in [(5, 6), (6, 4)] {
        for panel in 1..=panels {
            let series = |out: &str| rows(&folder.path().join(out).join(format!("figure{figure}_{panel}.csv")));
            let (device, reference) = (series("device"), series("cpu"));
            assert_eq!(device.len(), 1001);
            for (step, (a, b)) in device.iter().zip(&reference).enumerate() {
                assert_eq!(a[0], step.to_string());
                largest = largest.max((a[1].parse::<f64>().unwrap() - b[1].parse::<f64>().unwrap()).abs());
            }
        }
    }
    // At most 2e-4 K on the device (docs/numerics.md 6). A difference above 0 shows that the device computed it.
    assert!(largest <= 2e-4 && largest > 0.0, "{largest} K");

    let mut largest = 0.0f64;
    let cubes = ["figure2_1", "figure2_2", "figure2_3", "figure2_4", "figure3_1", "figure3_2", "figure4"];
    for name in cubes {
        let series = |out: &str| numbers(&folder.path().join(format!("{out}/{name}.csv")));
        let (device, reference) = (series("device"), series("cpu"));
        assert_eq!(device.len(), 361);
        // The orbit is periodic.
        assert!(furthest(&device[..1], &device[360..]) <= 2e-3, "{name}");
        largest = largest.max(furthest(&device, &reference));
        let (first, second) = (column(&device, 1), column(&device, 2));
        assert!(furthest(&first, &second) > 0.25, "{name}: the lines of a panel differ");
    }
    assert_eq!(largest, 0.0, "the processor solves the cubes in both");
    // docs/numerics.md 2, zenith face of figure 2: means and peaks at 1361 W/m2.
    let zenith = |name: &str| column(&numbers(&folder.path().join(format!("device/{name}.csv"))), 1);
    let mean = |name: &str| zenith(name)[..360].iter().map(|row| row[0]).sum::<f64>() / 360.0;
    let highest = |name: &str| zenith(name).iter().map(|row| row[0]).fold(0.0, f64::max);
    assert!((mean("figure2_1") - 284.47).abs() < 0.01, "{}", mean("figure2_1"));
    assert!((mean("figure2_2") - 257.26).abs() < 0.01, "{}", mean("figure2_2"));
    assert!((highest("figure2_3") - 691.02).abs() < 0.01, "{}", highest("figure2_3"));

    let checks = rows(&folder.path().join("device/checks.csv"));
    let row = |words: [&str; 2]| checks.iter().find(|row| words.iter().all(|word| row[0].contains(word))).unwrap();
    for words in [["falls a little faster", "1361"], ["near step 264", "224 km"], ["about 180 K", "224 km"]] {
        assert_eq!(row(words)[4], "false", "{words:?}");
    }
    assert_eq!(row(["about 180 K", "772 km"])[4], "true");
    let figures = |row: &&Vec<String>| row[0].starts_with("figure ");
    assert!(checks.iter().filter(figures).count() == 90 && checks.iter().filter(figures).all(|row| row[4] == "true"));
    assert!(checks.iter().any(|row| row[0].contains("period") && row[4] == "false"));
    let page = std::fs::read_to_string(folder.path().join("device/index.html")).unwrap();
    assert!(
        page.contains("5.1 heating")
            && page.contains("6.4 cooling")
            && page.contains("3.2 MLI")
            && page.contains("data:image/png;base64,")
    );
    assert!(!page.replace("http://www.w3.org/2000/svg", "").contains("http"));
}

#[test]
fn a_scene_that_is_not_there_is_told_before_anything_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let ran = run(folder.path(), &["paper", "-o", "out", "--scene", "models/station.toml"]);
    assert_eq!(ran.code, 2);
    assert!(ran.err.contains("models/station.toml: cannot be read"), "{}", ran.err);
    assert!(!folder.path().join("out").exists());
}

/// Other commands told it, and this one did not.
#[test]
fn what_is_probably_wrong_is_told_before_the_work() {
    let folder = tempfile::tempdir().unwrap();
    cube_scene(folder.path());
    let scene = folder.path().join("cube.toml");
    let text = std::fs::read_to_string(&scene).unwrap();
    std::fs::write(&scene, format!("{text}\n[[probe]]\nname = 'far'\nposition = [90, 0, 0]\n")).unwrap();
    // The folder that is already full ends the command.
    std::fs::create_dir(folder.path().join("out")).unwrap();
    std::fs::write(folder.path().join("out/index.html"), "of another run").unwrap();
    let ran = run(folder.path(), &["paper", "-o", "out", "--scene", "cube.toml", "--device", "cpu"]);
    assert!(ran.code == 2 && ran.err.contains("warning: probe 'far': lies off the craft"), "{}", ran.err);
}
