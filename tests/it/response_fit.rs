//! `isotherm response fit` as a user runs it: table, lines to paste, plot, errors.

use std::path::Path;

use super::paper::cube_scene;
use super::program::{Ran, run};

fn fit(folder: &Path, data: &str, arguments: &[&str]) -> Ran {
    std::fs::write(folder.join("data.csv"), data).unwrap();
    run(folder, &[&["response", "fit", "data.csv"], arguments].concat())
}

/// 2.7 K to 267 K, quadratic in 100 steps (docs/numerics.md 1, figure 5.2).
fn heating(first_column: &str) -> String {
    let temperature = |step: u32| 267.0 + (2.7 - 267.0) * (1.0 - f64::from(step.min(100)) / 100.0).powi(2);
    let rows = (0..=150).map(|step| format!("{step},{:.6}\n", temperature(step)));
    format!("{first_column},temperature\n{}", rows.collect::<String>())
}

#[test]
fn the_best_comes_first_and_can_be_pasted() {
    let folder = tempfile::tempdir().unwrap();
    let ran = fit(folder.path(), &heating("time"), &["--plot", "fit.svg"]);
    assert_eq!(ran.code, 0, "{}", ran.err);
    let lines: Vec<&str> = ran.out.lines().collect();
    assert!(lines[0].contains("t_max [s]") && lines[1].starts_with("quadratic    T "), "{}", ran.out);
    assert!(["linear", "exponential", "logarithmic", "polynomial"].iter().all(|kind| ran.out.contains(kind)));
    assert!(ran.out.contains("\nheating = { function = \"quadratic\", t_max = 100 }\n"), "{}", ran.out);
    let svg = std::fs::read_to_string(folder.path().join("fit.svg")).unwrap();
    assert!(svg.contains("data.csv") && svg.contains("quadratic in T"));

    let steps = fit(folder.path(), &heating("step"), &["--target", "267"]);
    assert!(steps.out.contains("heating = { function = \"quadratic\", t_max_steps = 100 }"), "{}", steps.out);
}

#[test]
fn what_is_proposed_can_stand_in_a_scene() {
    let folder = tempfile::tempdir().unwrap();
    cube_scene(folder.path());
    let scene = std::fs::read_to_string(folder.path().join("cube.toml")).unwrap();
    let check = |pasted: &str| {
        let material = "response = 'transition'\n";
        let other = if pasted.contains("cooling = ") { "heating" } else { "cooling" };
        let (before, _) = scene.split_once(material).unwrap();
        let (_, camera) = scene.split_once("[camera]").unwrap();
        let other = format!("{other} = {{ function = 'linear', t_max = 10 }}\n");
        let text = format!("{before}{material}{pasted}{other}[camera]{camera}");
        std::fs::write(folder.path().join("fitted.toml"), &text).unwrap();
        run(folder.path(), &["info", "fitted.toml"])
    };
    type Curve = fn(f64) -> f64;
    let curves: [(&str, Curve); 5] = [
        ("exponential", |s| (-3.0 * s).exp_m1() / (-3f64).exp_m1()),
        ("logarithmic", |s| (8.0 * s).ln_1p() / 8f64.ln_1p()),
        // It is flat at both ends, where rounded coefficients could make it turn back.
        ("polynomial", |s| s * s * (3.0 - 2.0 * s)),
        ("table", |s| if s < 0.25 { 2.0 * s } else { 0.5 + (s - 0.25) * 2.0 / 3.0 }),
        ("domain", |s| s),
    ];
    for (kind, curve) in curves {
        let temperature = |time: u32| {
            let done = curve((f64::from(time) / 100.0).min(1.0));
            let power = if kind == "domain" { 4.0 } else { 1.0 };
            (300f64.powf(power) * (1.0 - done) + 200f64.powf(power) * done).powf(1.0 / power)
        };
        let rows: String = (0..=140).map(|time| format!("{time},{:.9}\n", temperature(time))).collect();
        let ran = fit(folder.path(), &format!("time,temperature\n{rows}"), &[]);
        let (_, pasted) = ran.out.split_once("\n\n").unwrap();
        assert!(pasted.contains(kind) && pasted.contains("cooling = "), "{}", ran.out);
        let info = check(pasted);
        assert_eq!(info.code, 0, "{pasted}: {}", info.err);
        let wrong = check(&pasted.replace("t_max", "t_min"));
        assert_eq!(wrong.code, 2, "{pasted}");
    }
}

#[test]
fn data_that_cannot_be_fitted_exit_with_2_and_name_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let cases = [
        ("time,temperature\n0,300\n1,290\n1,280\n2,270\n3,260\n4,255\n", "row 4"),
        ("time,temperature\n0,300\n1,nan\n2,280\n3,270\n4,265\n5,262\n", "row 3"),
        ("time,temperature\n0,300\n1,29O\n", "row 3: '29O' is not a number"),
        ("time,temperature\n0,300\n1,290\n", "too few"),
        ("time,temperature\n0,300\n1,300\n2,300\n3,300\n4,300\n5,300\n", "no response"),
        ("time,temp\n0,300\n", "must name the columns"),
    ];
    for (data, message) in cases {
        let ran = fit(folder.path(), data, &["--plot", "fit.svg"]);
        assert_eq!(ran.code, 2, "{message}: {}", ran.err);
        assert!(ran.err.contains(message) && ran.err.contains("data.csv") && ran.out.is_empty(), "{}", ran.err);
        assert!(!folder.path().join("fit.svg").exists());
    }
    let absent = run(folder.path(), &["response", "fit", "absent.csv"]);
    assert!(absent.code == 2 && absent.err.contains("absent.csv"), "{}", absent.err);
}

/// A fit at a bound, far beyond its data, or with a poor residual says so.
#[test]
fn a_fit_that_is_not_to_be_trusted_warns() {
    let folder = tempfile::tempdir().unwrap();
    let rows = |of: &dyn Fn(f64) -> f64| {
        let row = |time: u32| format!("{time},{:.6}\n", of(f64::from(time)));
        format!("time,temperature\n{}", (0..=40).map(row).collect::<String>())
    };
    let good = fit(folder.path(), &heating("time"), &[]);
    assert!(good.code == 0 && !good.err.contains("warning"), "{}", good.err);
    // The first thousandth of a way to a stated target.
    let early = fit(folder.path(), &rows(&|t| 300.0 - 0.0025 * t), &["--target", "200"]);
    assert!(early.err.contains("warning: ") && early.err.contains("times the length of the data"), "{}", early.err);
    // It goes there and back, as no step response does.
    let back = fit(folder.path(), &rows(&|t| 300.0 - 50.0 * (0.157 * t).sin()), &[]);
    assert!(back.err.contains("warning: ") && back.err.contains("% of the step"), "{}", back.err);
}
