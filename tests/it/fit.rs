//! `isotherm fit`: hidden values, closed forms and scipy, and wrong input.

use std::f64::consts::TAU;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Stdio};

use isotherm::Image;
use isotherm::internals::{
    Apparent, Axis, FrameHeader, Mark, Plot, PlotLine, RadianceTable, STEFAN_BOLTZMANN, band_radiance, read_exr,
    write_exr,
};
use serde_json::Value;

use super::budget::{LIT, scene, squares, sunlight};
use super::craft::{Folder, scene_with};
use super::mesh_network::{CELLS, TRANSITION};
use super::program::{end, isotherm, refusal, stderr, succeed};
use super::random::Random;

const CPU: [&str; 2] = ["--device", "cpu"];

/// A normal deviate (Box and Muller 1958).
fn normal(random: &mut Random) -> f64 {
    (-2.0 * (1.0 - random.unit()).ln()).sqrt() * (TAU * random.unit()).cos()
}

/// Fits, and reads the results.
fn fit(folder: &Path, arguments: &[&str]) -> Value {
    succeed(folder, &[&["fit"], arguments].concat());
    let place = arguments.iter().position(|argument| *argument == "-o").expect("a folder") + 1;
    let text = std::fs::read_to_string(folder.join(arguments[place]).join("fit.json")).expect("results");
    serde_json::from_str(&text).expect("JSON")
}

/// Logarithm of the factor of each parameter, and its standard deviation.
fn logarithms(fitted: &Value) -> Vec<[f64; 2]> {
    let list = fitted["parameters"].as_array().expect("a list").iter();
    let number = |value: &Value| value.as_f64().expect("a number");
    list.map(|parameter| [number(&parameter["factor"]).ln(), number(&parameter["log_sigma"])]).collect()
}

fn sentences(fitted: &Value) -> String {
    fitted["text"].as_array().expect("a list").iter().filter_map(Value::as_str).collect::<Vec<_>>().join("\n")
}

fn network(capacitance: f64, area: f64, conductance: f64, times: &[f64]) -> String {
    format!(
        "space_temperature = 2.7\n[[node]]\nlabel = \"panel\"\nkind = \"diffusive\"\ncapacitance = {capacitance}\nemissive_area = {area}\n\
         temperature = 285\nheat = 9\n[[node]]\nlabel = \"structure\"\nkind = \"diffusive\"\ncapacitance = 450\ntemperature = 288\n\
         [[linear_conductor]]\nnodes = [\"panel\", \"structure\"]\nconductance = {conductance}\n[output]\ntimes = {times:?}\n"
    )
}

fn three_parameters(prior: &str) -> String {
    [
        ("capacitance", "node = \"pan*\"", 40),
        ("emissive_area", "node = \"panel\"", 40),
        ("conductance", "between = [\"structure\", \"panel\"]", 100),
    ]
    .map(|(vary, owner, percent)| format!("[[parameter]]\nvary = \"{vary}\"\n{owner}\npercent = {percent}\n{prior}\n"))
    .concat()
}

const FIT_NETWORK: [&str; 6] = ["network.toml", "--measured", "t.csv", "--parameters", "p.toml", "-o"];

/// `python3 tools/oracle/fitted.py tests/oracle/fit_network.csv` (scipy 1.17.1) printed these.
#[test]
fn a_network_is_fitted_as_scipy_does() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).expect("a file");
    write("network.toml", &network(120.0, 0.0085, 0.35, &[0.0, 6000.0]));
    write("t.csv", include_str!("../oracle/fit_network.csv"));
    let known = [[-0.214680, 0.037265], [0.119232, 0.006331], [0.337248, 0.016146]];
    let off = |fitted: &Value| {
        let pairs = logarithms(fitted).into_iter().zip(known);
        let off = pairs.map(|([x, sigma], [x0, sigma0])| ((x - x0).abs() / sigma0).max((sigma / sigma0 - 1.0).abs()));
        off.fold(0.0, f64::max)
    };
    write("p.toml", &three_parameters(""));
    let fitted = fit(folder.path(), &[&FIT_NETWORK[..], &["out"]].concat());
    assert!(off(&fitted) < 0.02, "{} of a standard deviation: {fitted}", off(&fitted));
    let correlation = fitted["correlation"][0][1].as_f64().expect("a number");
    assert!((correlation + 0.94904).abs() < 0.003, "{correlation}");
    // Without the loss the glitch of 8 K shows.
    write("p.toml", &(three_parameters("") + "[fit]\nloss = \"square\"\n"));
    let square = fit(folder.path(), &[&FIT_NETWORK[..], &["square"]].concat());
    assert!(off(&square) > 0.1, "{}", off(&square));
    // The fitted file is a network file that computes what the fit says.
    let text = std::fs::read_to_string(folder.path().join("out/fitted.toml")).expect("a file");
    write("network.toml", &text);
    write("p.toml", &three_parameters(""));
    let again = fit(folder.path(), &[&FIT_NETWORK[..], &["again"]].concat());
    let before = again["rms"]["before_k"].as_f64().expect("a number");
    assert!((before - fitted["rms"]["after_k"].as_f64().expect("a number")).abs() < 1e-4);
    for name in ["parameters.csv", "correlation.csv", "misfits.csv", "residuals.csv", "measured.svg", "residuals.svg"] {
        assert!(folder.path().join("out").join(name).exists(), "{name}");
    }
}

/// Telemetry of a network with hidden values; forty draws of the noise, without priors.
#[test]
fn hidden_values_lie_within_two_standard_deviations() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).expect("a file");
    let times: Vec<f64> = (1..=40).map(|row| 150.0 * f64::from(row)).collect();
    let hidden = [1.0 / 1.2, 1.12, 1.4];
    write("true.toml", &network(120.0 * hidden[0], 0.0085 * hidden[1], 0.35 * hidden[2], &times));
    succeed(folder.path(), &["network", "true.toml", "-o", "truth.csv"]);
    let table = std::fs::read_to_string(folder.path().join("truth.csv")).expect("a table");
    let truth: Vec<Vec<f64>> = table
        .lines()
        .skip(1)
        .map(|line| line.split(',').map(|cell| cell.parse().expect("a number")).collect())
        .collect();
    write("network.toml", &network(120.0, 0.0085, 0.35, &times));
    write("p.toml", &three_parameters("prior = \"none\""));
    let [mut within, mut within_a_third, mut all] = [0, 0, 0];
    for trial in 0..40 {
        let mut random = Random(trial);
        let mut rows = "time,sensor,temperature,sigma\n".to_owned();
        for row in &truth {
            for (node, name) in ["panel", "structure"].into_iter().enumerate() {
                rows += &format!("{},{name},{:.5},0.5\n", row[0], row[node + 1] + 0.5 * normal(&mut random));
            }
        }
        write("t.csv", &rows);
        let fitted = fit(folder.path(), &[&FIT_NETWORK[..], &["out", "--force"]].concat());
        for ([x, sigma], hidden) in logarithms(&fitted).into_iter().zip(hidden) {
            let off = (x - hidden.ln()).abs() / sigma;
            all += 1;
            within += usize::from(off <= 2.0);
            within_a_third += usize::from(off <= 2.0 / 3.0);
        }
    }
    println!("{within} of {all} within two standard deviations");
    assert!(within * 100 >= 90 * all, "{within} of {all}");
    assert!(within_a_third * 100 < 90 * all, "a third of the deviation would be too small");
}

/// A plate in balance: T^4 = alpha S / (eps sigma). Telemetry fixes the ratio of the two, and the priors the rest: a Gaussian with two linear terms.
#[test]
fn telemetry_of_a_plate_fixes_absorptivity_over_emissivity() {
    let own = "emissivity = 0.8\nheat_capacity_per_area = 2430\nsides = \"outside\"\nresponse = \"radiative\"\n";
    let text = scene(&[("plate", own)], LIT, "").replace("draw_every = 5", "draw_every = 0");
    let folder = squares(&text, &[("plate", [0.0; 3], true)]);
    let measured = (1.05 * sunlight() / (0.8 * STEFAN_BOLTZMANN)).powf(0.25);
    let rows: String = (0..=10).map(|step| format!("{},top,{measured:.6},\n", 60 * step)).collect();
    folder.write("t.csv", &format!("time,sensor,temperature,sigma\n{rows}"));
    let pair = |[first, second]: [&str; 2]| {
        format!(
            "[[parameter]]\nvary = \"absorptivity\"\nmaterial = \"plate\"\npercent = 10\n{first}\n\
             [[parameter]]\nvary = \"emissivity\"\nmaterial = \"plate\"\npercent = 10\n{second}\n\
             [[sensor]]\nname = \"top\"\nposition = [0.4, 0.3, 0]\nsigma = 0.1\n"
        )
    };
    folder.write("p.toml", &pair(["prior_sigma = 0.1", "prior_sigma = 0.2"]));
    let arguments = [&["scene.toml", "--measured", "t.csv", "--parameters", "p.toml", "-o", "out"], &CPU[..]].concat();
    let fitted = fit(folder.0.path(), &arguments);
    // The initial state is the balance of the values that are tried, so every row is T = c (alpha / eps)^(1/4).
    let of_data = (4.0 * 0.1 / measured).powi(2) / 11.0;
    let whole = 0.01 + 0.04 + of_data;
    let ratio = 1.05f64.ln();
    let known = [
        [0.01 / whole * ratio, (0.01 - 0.01f64.powi(2) / whole).sqrt()],
        [-0.04 / whole * ratio, (0.04 - 0.04f64.powi(2) / whole).sqrt()],
    ];
    for ([x, sigma], [x0, sigma0]) in logarithms(&fitted).into_iter().zip(known) {
        assert!(
            (x - x0).abs() < 0.01 * sigma0 && (sigma / sigma0 - 1.0).abs() < 0.01,
            "{x} {sigma}, not {x0} {sigma0}"
        );
        assert!((sigma / sigma0 - 1.03).abs() > 0.01, "three percent more must show");
    }
    let covariance = fitted["covariance_of_logarithms"][0][1].as_f64().expect("a number");
    assert!((covariance / (0.01 * 0.04 / whole) - 1.0).abs() < 0.02, "{covariance}");
    let said = sentences(&fitted);
    assert!(said.contains("the data fix 'absorptivity of plate' / 'emissivity of plate', not each"), "{said}");
    // Without priors nothing tells the two apart.
    folder.write("p.toml", &pair(["prior = \"none\"", "prior = \"none\""]));
    let output = end(isotherm(folder.0.path(), &[&["fit"], &arguments[..5], &["-o", "singular"], &CPU[..]].concat()));
    let (code, line) = refusal(&output);
    assert!(
        code == Some(2) && line.contains("singular: the data fix 'absorptivity of plate' /"),
        "{}",
        stderr(&output)
    );
    assert!(!folder.path("singular").exists());
}

/// Factors by which six values of the craft differ from its scene: absorptivity, emissivity and capacity of the skin, and of the cells.
const HIDDEN: [f64; 6] = [1.12, 0.94, 0.9, 1.05, 1.04, 1.15];

/// The craft over 140 deg of its orbit, from noon into the eclipse. The camera looks from above or from below.
fn orbiting(factors: [f64; 6], camera: &str) -> String {
    let [a, e, c, ac, ec, cc] = factors;
    let text = scene_with(&[
        ("max_edge = 0.7", "max_edge = 4"),
        (
            "step = 60\nsteps = 12\ndraw_every = 4",
            "start = \"2026-11-26\"\nstep = 60\nsteps = 36\nimages = [600, 1560]",
        ),
        ("phase_deg = 80", "phase_deg = 0"),
        // No table of albedo is made, which would take most of the time.
        ("albedo = 0.3\n", ""),
        ("absorptivity = 0.29\nemissivity = 0.83", &format!("absorptivity = {}\nemissivity = {}", 0.29 * a, 0.83 * e)),
        (
            "absorptivity = 0.75\nemissivity = 0.82",
            &format!("absorptivity = {}\nemissivity = {}", 0.75 * ac, 0.82 * ec),
        ),
        (TRANSITION, &format!("response = \"radiative\"\nheat_capacity_per_area = {}\n", 2400.0 * c)),
        (CELLS, &format!("response = \"radiative\"\nheat_capacity_per_area = {}\n", 2000.0 * cc)),
        ("width = 96\nheight = 72", "width = 48\nheight = 36"),
    ]);
    text.replace("position = [6.5, 5, -7.5]", camera)
}

const ABOVE: &str = "position = [6.5, 5, -7.5]";
const BELOW: &str = "position = [5, 4, 8]";

/// What is measured of the craft with hidden values, before noise.
struct HiddenCraft {
    folder: Folder,
    /// Time, sensor and temperature [K].
    telemetry: Vec<(f64, &'static str, f64)>,
    images: Vec<(Image, FrameHeader)>,
}

const SENSORS: [&str; 3] = ["body", "wing_port", "wing_starboard"];
const IMAGES: [&str; 4] = ["above_0.exr", "above_1.exr", "below_0.exr", "below_1.exr"];

impl HiddenCraft {
    fn new() -> Self {
        let folder = Folder::new(&orbiting([1.0; 6], ABOVE));
        let mut images = Vec::new();
        for (name, camera) in [("above", ABOVE), ("below", BELOW)] {
            folder.write("true.toml", &orbiting(HIDDEN, camera));
            succeed(folder.0.path(), &[&["run", "true.toml", "-o", name], &CPU[..]].concat());
            for number in 0..2 {
                let path = folder.path(&format!("{name}/frames/image_{number:06}.exr"));
                images.push(read_exr(&path).expect("an image"));
            }
        }
        let table = std::fs::read_to_string(folder.path("above/series.csv")).expect("a series");
        let mut reader = csv::Reader::from_reader(table.as_bytes());
        let heads = reader.headers().expect("heads").clone();
        let column = |name: &str| heads.iter().position(|head| head == format!("part:{name}:mean")).expect("a part");
        let mut telemetry = Vec::new();
        for row in reader.records().map(|row| row.expect("a row")) {
            let number = |place: usize| row[place].parse::<f64>().expect("a number");
            telemetry.extend(SENSORS.map(|sensor| (number(0), sensor, number(column(sensor)))));
        }
        let hidden = Self { folder, telemetry, images };
        let parameter = |material: &str, vary: &str| {
            format!("[[parameter]]\nvary = \"{vary}\"\nmaterial = \"{material}\"\npercent = 60\n")
        };
        let three =
            |material: &str| ["absorptivity", "emissivity", "capacity"].map(|vary| parameter(material, vary)).concat();
        let six = three("skin") + &three("cells");
        hidden.folder.write("telemetry.toml", &six);
        hidden.folder.write("both.toml", &(six + "[[image]]\nfile = \"*.exr\"\nsigma = 0.05\n"));
        hidden
    }

    /// Writes telemetry with noise of 0.5 K and images of a camera of 50 mK.
    fn measure(&self, seed: u64) {
        let mut random = Random(seed);
        let mut rows = "time,sensor,temperature,sigma\n".to_owned();
        for (time, sensor, temperature) in &self.telemetry {
            rows += &format!("{time},{sensor},{:.5},0.5\n", temperature + 0.5 * normal(&mut random));
        }
        self.folder.write("t.csv", &rows);
        for ((image, header), name) in self.images.iter().zip(IMAGES) {
            let (table, apparent) = (RadianceTable::new(header.band), Apparent::new(header.band));
            let mut noisy = image.clone();
            for radiance in noisy.radiance.iter_mut().filter(|radiance| **radiance > 1e-3) {
                let temperature = f64::from(apparent.temperature(*radiance)) + 0.05 * normal(&mut random);
                *radiance = band_radiance(&table, temperature) as f32;
            }
            write_exr(&self.folder.path(name), &noisy, header).expect("an image");
        }
    }

    fn fit(&self, images: bool, output: &str) -> Value {
        let (measured, parameters) = if images { (&IMAGES[..], "both.toml") } else { (&[][..], "telemetry.toml") };
        let rest = ["--parameters", parameters, "-o", output, "--force", "--device", "cpu"];
        fit(self.folder.0.path(), &[&["scene.toml", "--measured", "t.csv"], measured, &rest].concat())
    }
}

fn condition(fitted: &Value) -> f64 {
    fitted["condition"].as_f64().unwrap_or(f64::INFINITY)
}

/// Images tell emissivity by what they receive, and telemetry tells it only by the balance with what is absorbed.
#[test]
fn images_separate_what_telemetry_leaves_joined() {
    let hidden = HiddenCraft::new();
    hidden.measure(1);
    let [alone, both] = [hidden.fit(false, "alone"), hidden.fit(true, "both")];
    println!(
        "condition {:.3e} alone, {:.3e} with images\n{}\n\n{}",
        condition(&alone),
        condition(&both),
        sentences(&alone),
        sentences(&both)
    );
    assert!(condition(&alone) > 1e4 && condition(&both) < 100.0);
    for (([x, sigma], [_, wide]), hidden) in logarithms(&both).into_iter().zip(logarithms(&alone)).zip(HIDDEN) {
        assert!((x - hidden.ln()).abs() < 3.5 * sigma, "{x} {sigma} {}", hidden.ln());
        assert!(sigma < 0.5 * wide, "{sigma} {wide}");
    }
    // All three values of the skin can grow together: every flow of heat grows with them, and the temperature stays.
    let joined = |fitted: &Value| fitted["correlation"][0][1].as_f64().expect("a number");
    assert!(joined(&alone) > 0.99 && joined(&both).abs() < 0.9, "{} {}", joined(&alone), joined(&both));
    assert!(sentences(&alone).contains("the data leave open a change of"));
    // The fitted rules stand before the first rule of the scene, and the next fit begins where this one ended.
    let rules = std::fs::read_to_string(hidden.folder.path("both/fitted.toml")).expect("rules");
    let text = orbiting([1.0; 6], ABOVE).replacen("[[material]]", &format!("{rules}\n[[material]]"), 1);
    hidden.folder.write("scene.toml", &text);
    let again = hidden.fit(true, "again");
    let [before, after] =
        [&again["rms"]["before_k"], &both["rms"]["after_k"]].map(|rms| rms.as_f64().expect("a number"));
    assert!((before / after - 1.0).abs() < 1e-3, "{before} {after}");
}

/// Images as counts of a PNG with a mask, from the scene's own camera, and telemetry in degrees Celsius at dates.
#[test]
fn other_forms_of_measurements_tell_the_same() {
    let hidden = HiddenCraft::new();
    hidden.measure(2);
    let skin = "[[parameter]]\nvary = \"emissivity\"\nmaterial = \"skin\"\npercent = 60\n";
    let rule = "[[image]]\nfile = \"above_0.*\"\nsigma = 0.05\n";
    hidden.folder.write("p.toml", &format!("{skin}{rule}"));
    let arguments = |table: &'static str, image: &'static str, output: &'static str| {
        [&["scene.toml", "--measured", table, image, "--parameters", "p.toml", "-o", output], &CPU[..]].concat()
    };
    let exr = fit(hidden.folder.0.path(), &arguments("t.csv", "above_0.exr", "exr"));
    let (image, header) = read_exr(&hidden.folder.path("above_0.exr")).expect("an image");
    let apparent = Apparent::new(header.band);
    let counts = image.radiance.iter().map(|radiance| (apparent.temperature(*radiance) / 0.01).round() as u16);
    write_png(&hidden.folder.path("above_0.png"), counts.collect());
    // The left half counts.
    write_png(&hidden.folder.path("mask.png"), (0..48 * 36).map(|pixel| u16::from(pixel % 48 < 24)).collect());
    let table = std::fs::read_to_string(hidden.folder.path("t.csv")).expect("a table");
    let dated: String = table
        .lines()
        .skip(1)
        .map(|line| {
            let cells: Vec<&str> = line.split(',').collect();
            let seconds: u32 = cells[0].parse().expect("seconds");
            let celsius = cells[2].parse::<f64>().expect("a number") - 273.15;
            format!("2026-11-26T00:{:02}:{:02}Z,{},{celsius:.5},0.5\n", seconds / 60, seconds % 60, cells[1])
        })
        .collect();
    hidden.folder.write("dated.csv", &format!("time,sensor,temperature_degC,sigma\n{dated}"));
    let more = "scale = 0.01\nutc = \"2026-11-26T00:10:00\"\n";
    hidden.folder.write("p.toml", &format!("{skin}{rule}{more}"));
    let png = fit(hidden.folder.0.path(), &arguments("dated.csv", "above_0.png", "png"));
    let [[x, sigma], [x0, sigma0]] = [&png, &exr].map(|fitted| logarithms(fitted)[0]);
    assert!((x - x0).abs() < 0.2 * sigma0 && (sigma / sigma0 - 1.0).abs() < 1e-3, "{x} {sigma}, not {x0} {sigma0}");
    hidden.folder.write("p.toml", &format!("{skin}{rule}{more}mask = \"mask.png\"\n"));
    let masked = fit(hidden.folder.0.path(), &arguments("dated.csv", "above_0.png", "masked"));
    let pixels = |fitted: &Value| fitted["measured"][3]["rms"]["values"].as_u64().expect("a number");
    assert!(pixels(&masked) > 10 && pixels(&masked) < pixels(&png), "{} of {}", pixels(&masked), pixels(&png));
}

fn write_png(path: &Path, values: Vec<u16>) {
    let mut encoder = png::Encoder::new(std::fs::File::create(path).expect("a file"), 48, 36);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Sixteen);
    let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_be_bytes()).collect();
    encoder.write_header().expect("a head").write_image_data(&bytes).expect("pixels");
}

/// Forty draws of both noises. With `ISOTHERM_FIGURES=docs` the figure of docs/fit.md is written there.
#[test]
#[ignore = "a minute"]
fn forty_trials_of_the_craft_cover_the_hidden_values() {
    let hidden = HiddenCraft::new();
    let [mut within, mut within_a_third, mut all] = [0, 0, 0];
    let mut estimates = Vec::new();
    for trial in 0..40 {
        hidden.measure(100 + trial);
        let fitted = hidden.fit(true, "out");
        for ([x, sigma], hidden) in logarithms(&fitted).into_iter().zip(HIDDEN) {
            let off = (x - hidden.ln()).abs() / sigma;
            all += 1;
            within += usize::from(off <= 2.0);
            within_a_third += usize::from(off <= 2.0 / 3.0);
        }
        estimates.push(logarithms(&fitted));
        if trial == 39
            && let Some(place) = std::env::var_os("ISOTHERM_FIGURES")
        {
            let alone = hidden.fit(false, "alone");
            let figure = figure([&alone, &fitted], &estimates);
            std::fs::write(Path::new(&place).join("fit_images.svg"), figure.svg().expect("a figure")).expect("a file");
        }
    }
    println!("{within} of {all} within two standard deviations");
    assert!(within * 100 >= 90 * all, "{within} of {all}");
    assert!(within_a_third * 100 < 90 * all, "a third of the deviation would be too small");
}

/// Absorptivity and emissivity of the skin: ellipses of two standard deviations from telemetry alone and with images, all estimates, and the truth.
fn figure(fits: [&Value; 2], estimates: &[Vec<[f64; 2]>]) -> Plot {
    let place = |x: f64, y: f64| [0.29 * x.exp(), 0.83 * y.exp()];
    let ellipse = |fitted: &Value| -> Vec<[f64; 2]> {
        let at = |i: usize, j: usize| fitted["covariance_of_logarithms"][i][j].as_f64().expect("a number");
        let [x, y] = [0, 1].map(|i| logarithms(fitted)[i][0]);
        // The factor of Cholesky takes a circle to the ellipse.
        let a = at(0, 0).sqrt();
        let b = at(0, 1) / a;
        let c = (at(1, 1) - b * b).sqrt();
        let point = |step: u32| {
            let (sine, cosine) = (TAU * f64::from(step) / 200.0).sin_cos();
            place(x + 2.0 * a * cosine, y + 2.0 * (b * cosine + c * sine))
        };
        (0..=200).map(point).collect()
    };
    let line = |name: &str, points: Vec<[f64; 2]>, mark: Mark| PlotLine {
        name: name.to_owned(),
        points,
        mark,
        ..PlotLine::default()
    };
    let [alone, both] = fits;
    Plot {
        title: "Images separate what telemetry leaves joined".to_owned(),
        subtitle: format!(
            "skin of the test craft, ellipses of two standard deviations; condition {:.0} by telemetry, {:.0} with images",
            condition(alone),
            condition(both)
        ),
        x: Axis::linear("absorptivity"),
        y: Axis::linear("emissivity"),
        series: vec![
            line("telemetry and images", ellipse(both), Mark::Line),
            line("telemetry alone", ellipse(alone), Mark::Line),
            line("40 draws of both", estimates.iter().map(|all| place(all[0][0], all[1][0])).collect(), Mark::Points),
            line("hidden value", vec![place(HIDDEN[0].ln(), HIDDEN[1].ln())], Mark::Points),
        ],
        ..Plot::default()
    }
}

#[cfg(unix)]
#[test]
fn control_c_keeps_the_best_values_so_far() {
    let own = "emissivity = 0.8\nheat_capacity_per_area = 2430\nsides = \"outside\"\nresponse = \"radiative\"\n";
    let text = scene(&[("plate", own)], LIT, "").replace("steps = 10\ndraw_every = 5", "steps = 40000\ndraw_every = 0");
    let folder = squares(&text, &[("plate", [0.0; 3], true)]);
    folder.write("t.csv", "time,sensor,temperature,sigma\n300,plate,300,0.5\n2400000,plate,300,0.5\n");
    folder.write("p.toml", "[[parameter]]\nvary = \"absorptivity\"\nmaterial = \"plate\"\npercent = 60\n");
    let arguments =
        ["fit", "scene.toml", "--measured", "t.csv", "--parameters", "p.toml", "-o", "out", "--device", "cpu"];
    let mut command = isotherm(folder.0.path(), &arguments);
    let mut child = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("the program starts");
    let mut lines = BufReader::new(child.stderr.take().expect("its messages")).lines().map_while(Result::ok);
    assert!(lines.any(|line| line.starts_with("step 0: ")), "the first derivatives are there");
    let kill = Command::new("sh").args(["-c", &format!("kill -INT {}", child.id())]).status();
    assert!(kill.expect("a shell").success());
    let rest: Vec<String> = lines.collect();
    assert_eq!(child.wait().expect("it ends").code(), Some(1), "{rest:?}");
    assert!(rest.iter().any(|line| line.contains("stopped; what was finished is in out")), "{rest:?}");
    let text = std::fs::read_to_string(folder.path("out/fit.json")).expect("results");
    let fitted: Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!((&fitted["stopped"], &fitted["converged"]), (&true.into(), &false.into()));
}

#[test]
fn what_does_not_fit_is_refused_and_nothing_is_written() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).expect("a file");
    write("network.toml", &network(120.0, 0.0085, 0.35, &[0.0, 1000.0]));
    let good = "time,sensor,temperature,sigma\n0,panel,285,0.5\n500,panel,290,0.5\n";
    let one = "[[parameter]]\nvary = \"capacitance\"\nnode = \"panel\"\npercent = 40\n";
    let head = "time,sensor,temperature,sigma\n";
    let cases = [
        (String::new(), one.to_owned(), "t.csv:1: time: is missing in the header"),
        (head.to_owned(), one.to_owned(), "t.csv:1: table: has no rows"),
        (format!("{head}0,panel,285,-1\n"), one.to_owned(), "t.csv:2: sigma: must be above 0 K"),
        (
            "time,sensor,temperature\n0,panel,285\n".to_owned(),
            one.to_owned(),
            "t.csv:2: sigma: is missing for sensor 'panel'",
        ),
        (format!("{head}0,panel,warm,1\n"), one.to_owned(), "t.csv:2: temperature: 'warm' is no number"),
        (format!("{head}0,panel,-4,1\n"), one.to_owned(), "must be above 0 K"),
        (format!("{good}1001,panel,285,1\n"), one.to_owned(), "t.csv:4: time: 1001 s lies outside the run"),
        (format!("{head}-1,panel,285,1\n"), one.to_owned(), "-1 s lies outside the run"),
        (format!("{head}2026-01-01,panel,285,1\n"), one.to_owned(), "needs time.start"),
        (format!("{good}0,pannel,285,1\n"), one.to_owned(), "no [[sensor]] says where 'pannel' is"),
        (good.to_owned(), format!("{one}[[sensor]]\nname = \"panel\"\nnode = \"panle\"\n"), "did you mean 'panel'?"),
        (
            good.to_owned(),
            format!("{one}[[sensor]]\nname = \"idle\"\nnode = \"panel\"\n"),
            "no measured row is of sensor 'idle'",
        ),
        (good.to_owned(), format!("{one}[[sensor]]\nname = \"panel\"\npart = \"panel\"\n"), "the model has no parts"),
        (good.to_owned(), format!("{one}[[sensor]]\nname = \"panel\"\n"), "needs one place"),
        (
            good.to_owned(),
            format!("{one}[[image]]\nfile = \"*.exr\"\nsigma = 1\n"),
            "has no meaning for a network file",
        ),
        (good.to_owned(), one.replace("panel", "panels"), "the network has no capacitance of 'panels'"),
        (
            good.to_owned(),
            one.replace("capacitance", "absorptivity").replace("node", "material"),
            "the network has no absorptivity",
        ),
        (good.to_owned(), format!("{one}prior_value = 100\n"), "prior_sigma: is missing"),
        (good.to_owned(), format!("{one}[fit]\nhold_out = [600, 700]\n"), "keeps 0 of 2 measured values out"),
        (good.to_owned(), format!("{one}[fit]\nhold_out = [0, 700]\n"), "keeps 2 of 2 measured values out"),
        (good.to_owned(), format!("{one}[fit]\nloss = \"hubber\"\n"), "fit.loss: 'hubber' is not one of"),
        // The structure is not measured, and its capacitance is not the panel's.
        (
            head.to_owned() + "0,panel,285,0.5\n",
            format!("{one}prior = \"none\"\n"),
            "the fit is singular: the data do not fix 'capacitance of panel'",
        ),
    ];
    for (table, parameters, why) in cases {
        write("t.csv", &table);
        write("p.toml", &parameters);
        let (code, line) = refusal(&end(isotherm(folder.path(), &[&["fit"], &FIT_NETWORK[..], &["out"]].concat())));
        assert!(code == Some(2) && line.contains(why), "{why}: {line}");
        assert!(!folder.path().join("out").exists(), "{why}");
    }
}

#[test]
fn images_that_do_not_fit_are_refused_and_nothing_is_written() {
    let folder = Folder::new(&orbiting([1.0; 6], ABOVE));
    folder.write("small.toml", &orbiting([1.0; 6], ABOVE).replace("width = 48", "width = 40"));
    succeed(folder.0.path(), &[&["run", "small.toml", "-o", "small"], &CPU[..]].concat());
    write_png(&folder.path("a.png"), vec![30000; 48 * 36]);
    write_png(&folder.path("dark.png"), vec![0; 48 * 36]);
    folder.write("b.exr", "no image");
    let one = "[[parameter]]\nvary = \"emissivity\"\nmaterial = \"skin\"\npercent = 60\n";
    let small = "small/frames/image_000000.exr";
    for (image, rule, why) in [
        (small, "file = \"*.exr\"\nsigma = 0.05", "is an image of 40 x 36 pixels, and the scene's camera has 48 x 36"),
        (small, "file = \"*.png\"\nsigma = 0.05", "no [[image]] has a pattern that fits its name"),
        ("a.png", "file = \"*.png\"\nsigma = 0.05", "does not say how many kelvins a count is"),
        ("a.png", "file = \"*.png\"\nsigma = 0.05\nscale = 0.01", "states no time"),
        ("a.png", "file = \"*.png\"\nsigma = 0.05\nscale = 0.01\ntime = 9e6", "lies outside the run"),
        ("a.png", "file = \"*.png\"\nscale = 0.01\ntime = 9", "image.sigma: is missing"),
        ("a.png", "file = \"*.png\"\nsigma = -1\nscale = 0.01\ntime = 9", "image.sigma: must be above 0"),
        (
            "a.png",
            "file = \"*.png\"\nsigma = 1\nscale = 0.01\ntime = 9\npose = [0, 0, 0, 2, 0, 0, 0]",
            "a quaternion of length 1",
        ),
        ("dark.png", "file = \"*.png\"\nsigma = 1\nscale = 0.01\ntime = 9", "no pixel counts"),
        ("b.exr", "file = \"*.exr\"\nsigma = 0.05", "is no frame of isotherm"),
    ] {
        folder.write("p.toml", &format!("{one}[[image]]\n{rule}\n"));
        let arguments =
            ["fit", "scene.toml", "--measured", image, "--parameters", "p.toml", "-o", "out", "--device", "cpu"];
        let (code, line) = refusal(&end(isotherm(folder.0.path(), &arguments)));
        assert!(code == Some(2) && line.contains(why), "{why}: {line}");
        assert!(!folder.path("out").exists(), "{why}");
    }
}
