//! The temperature service against closed forms: plates and a sphere under Sun and planet, a heater, a joint, and what a client does wrong.

use std::f64::consts::PI;
use std::io::{BufRead, BufReader, Write};
use std::net::{SocketAddr, TcpStream};
use std::path::Path;
use std::process::Command;
use std::sync::Arc;
use std::time::Duration;

use glam::DVec3;
use isotherm::internals::{PictureKind, STEFAN_BOLTZMANN, Server, ThermalState, talk_telemetry};
use isotherm::{PartTemperature, Simulation, Target};
use serde_json::{Value, json};

use super::{server, serving};
use crate::bounces::{Corners, save_quads};
use crate::craft::{Folder, SCENE};
use crate::model::make::Maker;

const LIGHT_SPEED: f64 = 299_792_458.0;
const SOLAR: f64 = 1361.0;
/// Distance of the craft from the planet's centre in units of its radius.
const DISTANCE: f64 = 1.5;

/// 2 m x 1 m about (3, 0, 0.5), its front to +Z.
const PLATE: Corners = [[2.0, -0.5, 0.5], [4.0, -0.5, 0.5], [4.0, 0.5, 0.5], [2.0, 0.5, 0.5]];
const AREA: f64 = 2.0;
const CENTRE: DVec3 = DVec3::new(3.0, 0.0, 0.5);

/// A scene of one material. `more` are further sections.
fn scene(material: &str, environment: &str, more: &str) -> String {
    format!(
        "[model]\npath = \"made.glb\"\n[time]\nstep = 10\nsteps = 1\n[orbit]\naltitude = 408e3\n[attitude]\n\
         mode = \"inertial\"\nquaternion = [1, 0, 0, 0]\n[environment]\nplanet_radius = 6371e3\neclipse = false\n\
         background_temperature = 0\n{environment}\n[[material]]\nmatch = \"plate\"\n{material}\n{more}\n"
    )
}

/// A client of one line a request.
struct Client {
    stream: TcpStream,
    lines: BufReader<TcpStream>,
}

impl Client {
    fn open(address: SocketAddr) -> Self {
        let stream = TcpStream::connect(address).expect("a connection");
        stream.set_read_timeout(Some(Duration::from_secs(120))).expect("a time limit");
        let lines = BufReader::new(stream.try_clone().expect("a handle"));
        Self { stream, lines }
    }

    fn send(&mut self, line: &[u8]) -> Value {
        self.stream.write_all(line).expect("it takes a line");
        self.stream.write_all(b"\n").expect("it takes the end of a line");
        let mut answer = String::new();
        self.lines.read_line(&mut answer).expect("an answer");
        serde_json::from_str(&answer).expect("an answer in JSON")
    }

    fn ask(&mut self, request: Value) -> Value {
        let answer = self.send(request.to_string().as_bytes());
        assert!(answer.get("error").is_none(), "{request}: {answer}");
        answer
    }

    /// The kind of the error and its message.
    fn refused(&mut self, line: &str) -> (String, String) {
        let answer = self.send(line.as_bytes());
        let text = |key: &str| answer["error"][key].as_str().unwrap_or_else(|| panic!("{line}: {answer}")).to_owned();
        (text("kind"), text("message"))
    }
}

/// Asks about a scene whose model lies in a folder.
fn asking<T>(folder: &Folder, scene: &str, with: impl FnOnce(&mut Client) -> T) -> T {
    folder.write("scene.toml", scene);
    let served = server(Some(&folder.path("scene.toml")), Target::Reference, PictureKind::Apparent);
    serving(&served, talk_telemetry, |address| with(&mut Client::open(address)))
}

fn plate() -> Folder {
    let folder = Folder::new(SCENE);
    save_quads(&folder, &[("plate", PLATE)]);
    folder
}

fn vector(value: &Value) -> DVec3 {
    DVec3::from([0, 1, 2].map(|axis| value[axis].as_f64().expect("a number")))
}

/// A place at a time, above the planet's centre along +X, with body axes along the inertial ones.
fn at(time: f64, sun: DVec3) -> Value {
    json!({"request": "step", "time": time, "position": [DISTANCE * 6371e3, 0, 0], "sun_direction": sun.to_array(),
        "quaternion": [1, 0, 0, 0]})
}

/// Force and torque by a cause on the plate at a temperature, about the body's origin.
fn push(material: &str, environment: &str, temperature: f64, cause: &str, sun: DVec3) -> [DVec3; 2] {
    let initial = format!("[initial]\ntemperature = {temperature}");
    asking(&plate(), &scene(material, environment, &initial), |client| {
        client.ask(json!({"request": "open", "scene": "craft", "light": {}}));
        let answer = client.ask(at(0.0, sun));
        [&answer["light"][cause]["force"], &answer["light"][cause]["torque"]].map(vector)
    })
}

fn optics(absorptivity: f64, emissivity: f64) -> String {
    let values = format!("absorptivity = {absorptivity}\nemissivity = {emissivity}\nsides = \"outside\"");
    format!("{values}\nresponse = \"radiative\"\nheat_capacity_per_area = 1000")
}

#[track_caller]
fn close(value: DVec3, expected: DVec3, share: f64) {
    let error = value.distance(expected) / expected.length();
    assert!(error < share, "{value:?} beside {expected:?}: {error:e}");
}

/// A plate under the Sun: what comes in presses along the light, what is reflected diffusely presses with 2/3 along the normal.
#[test]
fn sunlight_presses_on_a_plate_as_in_the_closed_form() {
    let sun_only = format!("solar_constant = {SOLAR}");
    for absorptivity in [1.0, 0.3, 0.0] {
        for tilt in [0.0f64, 60.0] {
            let (sine, cosine) = tilt.to_radians().sin_cos();
            let sun = DVec3::new(0.0, sine, cosine);
            let [force, torque] = push(&optics(absorptivity, 0.8), &sun_only, 3.0, "sun", sun);
            let incoming = SOLAR * AREA * cosine / LIGHT_SPEED;
            let expected = -incoming * (sun + 2.0 / 3.0 * (1.0 - absorptivity) * DVec3::Z);
            close(force, expected, 1e-6);
            close(torque, CENTRE.cross(expected), 1e-6);
            let mirror = -2.0 * incoming * (1.0 - absorptivity) * cosine * DVec3::Z - incoming * absorptivity * sun;
            assert!(absorptivity == 1.0 || force.distance(mirror) > 0.05 * incoming, "a mirror would differ");
        }
    }
    let [behind, _] = push(&optics(1.0, 0.8), &sun_only, 3.0, "sun", DVec3::NEG_Z);
    assert_eq!(behind, DVec3::ZERO, "the back takes no light");
}

#[test]
fn a_plate_that_radiates_is_pushed_back_by_two_thirds_of_its_emission() {
    let dark = "solar_constant = 0";
    let [force, torque] = push(&optics(0.5, 0.8), dark, 350.0, "emitted", DVec3::X);
    let emission = 0.8 * STEFAN_BOLTZMANN * 350f64.powi(4) * AREA / LIGHT_SPEED;
    close(force, -2.0 / 3.0 * emission * DVec3::Z, 1e-6);
    close(torque, CENTRE.cross(-2.0 / 3.0 * emission * DVec3::Z), 1e-6);
    // Equal faces push against each other.
    let both =
        format!("{}\nback = {{ absorptivity = 0.5, emissivity = 0.8 }}", optics(0.5, 0.8).replace("outside", "both"));
    let [balanced, _] = push(&both, dark, 350.0, "emitted", DVec3::X);
    assert!(balanced.length() < 1e-12 * emission, "{balanced}");
    let unequal = both.replace("emissivity = 0.8 }", "emissivity = 0.2 }");
    let [force, _] = push(&unequal, dark, 350.0, "emitted", DVec3::X);
    close(force, -2.0 / 3.0 * 0.75 * emission * DVec3::Z, 1e-6);
}

/// A black plate that faces the planet takes (2 pi / 3)(1 - cos^3) of its radiance over c, less than if the light came from the planet's centre.
#[test]
fn the_planets_infrared_comes_from_its_whole_disc() {
    let infrared = "planet_ir = 237";
    let facing = [[0.0, -0.5, -0.5], [0.0, -0.5, 0.5], [0.0, 0.5, 0.5], [0.0, 0.5, -0.5]];
    let folder = Folder::new(SCENE);
    save_quads(&folder, &[("plate", facing)]);
    let scene = scene(&optics(0.5, 1.0), infrared, "[initial]\ntemperature = 3");
    let force = asking(&folder, &scene, |client| {
        client.ask(json!({"request": "open", "scene": "craft", "light": {"about": [0, 0, 1]}}));
        vector(&client.ask(at(0.0, DVec3::Y))["light"]["planet"]["force"])
    });
    let limb = (1.0 - DISTANCE.powi(-2)).sqrt();
    let momentum = 237.0 / PI * (2.0 * PI / 3.0) * (1.0 - limb.powi(3)) / LIGHT_SPEED;
    close(force, momentum * DVec3::X, 1e-5);
    let from_centre = 237.0 * DISTANCE.powi(-2) / LIGHT_SPEED;
    assert!((from_centre / momentum - 1.0).abs() > 0.03, "{}", from_centre / momentum);
}

/// An octahedron whose edges were halved `times` times, on the unit sphere.
fn sphere(times: u32) -> Maker {
    let mut corners: Vec<DVec3> = vec![DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z];
    let mut faces = Vec::new();
    for (x, y, z) in [(0, 2, 4), (2, 1, 4), (1, 3, 4), (3, 0, 4), (2, 0, 5), (1, 2, 5), (3, 1, 5), (0, 3, 5)] {
        faces.push([x, y, z]);
    }
    for _ in 0..times {
        let mut halved = Vec::new();
        let mut middles = std::collections::BTreeMap::new();
        for [a, b, c] in faces {
            let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(one, other): (usize, usize)| {
                *middles.entry((one.min(other), one.max(other))).or_insert_with(|| {
                    corners.push((corners[one] + corners[other]).normalize());
                    corners.len() - 1
                })
            });
            halved.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        faces = halved;
    }
    let mut maker = Maker::new();
    let points: Vec<[f32; 3]> = corners.iter().map(|corner| corner.as_vec3().to_array()).collect();
    let positions = maker.floats(&points);
    let normals = maker.floats(&points);
    let indices: Vec<u8> = faces.iter().flatten().flat_map(|index| (*index as u16).to_le_bytes()).collect();
    let fields = json!({"componentType": 5123, "count": 3 * faces.len(), "type": "SCALAR"});
    let indices = maker.accessor(&indices, fields);
    maker.push("materials", json!({"name": "plate"}));
    let attributes = json!({"POSITION": positions, "NORMAL": normals});
    maker.primitive(json!({"attributes": attributes, "indices": indices, "material": 0}));
    maker
}

/// A sphere of radius R takes S pi R^2 / c, and 4/9 of the reflected share more. At one temperature its emission pushes nowhere.
#[test]
fn a_sphere_is_pushed_as_in_the_closed_form() {
    let folder = Folder::new(SCENE);
    sphere(4).save(folder.0.path());
    let sun = DVec3::new(0.48, -0.6, 0.64);
    for absorptivity in [1.0, 0.2] {
        let scene =
            scene(&optics(absorptivity, 0.9), &format!("solar_constant = {SOLAR}"), "[initial]\ntemperature = 300");
        let [by_sun, emitted, torque] = asking(&folder, &scene, |client| {
            client.ask(json!({"request": "open", "scene": "craft", "light": {}}));
            let light = &client.ask(at(0.0, sun))["light"];
            [&light["sun"]["force"], &light["emitted"]["force"], &light["all"]["torque"]].map(vector)
        });
        let incoming = SOLAR * PI / LIGHT_SPEED;
        close(by_sun, -incoming * (1.0 + 4.0 / 9.0 * (1.0 - absorptivity)) * sun, 6e-3);
        assert!(absorptivity == 1.0 || by_sun.length() > 1.2 * incoming, "without the recoil it is {incoming:e}");
        let emission = 0.9 * STEFAN_BOLTZMANN * 300f64.powi(4) * 4.0 * PI / LIGHT_SPEED;
        assert!(emitted.length() < 1e-7 * emission, "{emitted:?} of {emission:e}");
        assert!(torque.length() < 2e-3 * incoming, "{torque:?}");
    }
}

/// Cooling in the dark: T^-3 = T0^-3 + 3 eps sigma t / C. What is emitted is what the plate loses.
#[test]
fn a_plate_cools_as_in_the_closed_form_and_its_heat_flows_close() {
    let scene = scene(&optics(0.5, 0.8), "solar_constant = 0", "[initial]\ntemperature = 400");
    asking(&plate(), &scene, |client| {
        let opened = client.ask(json!({"id": 5, "request": "open", "scene": "craft", "heat": true,
            "probes": [{"name": "corner", "position": [2, -0.5, 0.5]}, {"name": "edge", "position": [9, 0, 0], "part": "plate"}]}));
        assert_eq!((&opened["id"], &opened["parts"]), (&json!(5), &json!(["plate"])));
        assert_eq!(opened["probes"], json!(["corner", "edge"]));
        let off = opened["warnings"].to_string();
        assert!(off.contains("probe 'edge': lies off the craft"), "{off}");
        client.ask(at(0.0, DVec3::X));
        for time in [10.0, 35.0, 100.0, 400.0] {
            let answer = client.ask(at(time, DVec3::X));
            let expected = (400f64.powi(-3) + 3.0 * 0.8 * STEFAN_BOLTZMANN * time / 1000.0).powf(-1.0 / 3.0);
            let mean = answer["parts"]["plate"]["mean"].as_f64().expect("a number");
            assert!((mean - expected).abs() < 0.02, "{time} s: {mean} beside {expected}");
            assert!((answer["probes"]["corner"].as_f64().expect("a number") - mean).abs() < 1e-6);
            let heat = |cause: &str| answer["heat"]["plate"][cause].as_f64().expect("a number");
            let emitted = 0.8 * STEFAN_BOLTZMANN * mean.powi(4) * AREA;
            assert!((heat("emitted") + emitted).abs() < 1e-6 * emitted, "{}", heat("emitted"));
            assert!((heat("stored") - emitted).abs() < 1e-6 * emitted, "the plate gives what it emits");
            assert_eq!(answer["time"], json!(time));
        }
    });
}

const HEATED: &str = "thickness = 0.002\ndensity = 2700\nspecific_heat = 900\nconductivity = 200\nabsorptivity = 0.5\n\
                      emissivity = 0.8\nsides = \"outside\"\nresponse = \"network\"";

/// A power from outside holds the plate where it emits as much; without the power it cools as in the closed form. A saved power of the scene does not act.
#[test]
fn a_power_from_outside_heats_a_plate() {
    let more = "[network]\n[[heater]]\npart = \"plate\"\npower = 5\n";
    for integrator in ["default", "accurate"] {
        let more = more.replace("[network]", &format!("[network]\nintegrator = \"{integrator}\""));
        let scene = scene(HEATED, "solar_constant = 0", &more);
        asking(&plate(), &scene, |client| {
            let opened = client.ask(json!({"request": "open", "scene": "craft", "heat": true}));
            assert_eq!(opened["heaters"], json!({"plate": 5.0}));
            let step = |time: f64, power: Option<f64>| {
                let mut step = at(time, DVec3::X);
                if let Some(power) = power {
                    step["heaters"] = json!({ "plate": power });
                }
                step
            };
            let mean = |answer: &Value| answer["parts"]["plate"]["mean"].as_f64().expect("a number");
            let balance = |power: f64| (power / (0.8 * STEFAN_BOLTZMANN * AREA)).powf(0.25);
            let first = client.ask(step(0.0, Some(600.0)));
            assert!((mean(&first) - balance(600.0)).abs() < 0.02, "{} beside {}", mean(&first), balance(600.0));
            assert!((balance(5.0) - balance(600.0)).abs() > 50.0);
            let held = client.ask(step(100.0, None));
            assert!((mean(&held) - balance(600.0)).abs() < 0.02, "the power stays: {}", mean(&held));
            assert!((held["heat"]["plate"]["heater"].as_f64().expect("a number") - 600.0).abs() < 1e-9);
            let capacity = 0.002 * 2700.0 * 900.0;
            let cooled = client.ask(step(700.0, Some(0.0)));
            let rate = 3.0 * 0.8 * STEFAN_BOLTZMANN * 600.0 / capacity;
            let expected = (balance(600.0).powi(-3) + rate).powf(-1.0 / 3.0);
            assert!((mean(&cooled) - expected).abs() < 0.1, "{} beside {expected}", mean(&cooled));
            let (kind, message) = client
                .refused(&step(710.0, None).to_string().replace("\"time\"", "\"heaters\": {\"battery\": 3}, \"time\""));
            assert!(kind == "refused" && message.contains("'battery'") && message.contains("plate"), "{message}");
        });
    }
}

/// A joint at 60 deg turns the plate out of the Sun: T = (alpha S cos 60 / (eps sigma))^(1/4).
#[test]
fn a_joint_from_outside_turns_a_plate() {
    let instant = "absorptivity = 0.5\nemissivity = 0.8\nsides = \"outside\"\nresponse = \"instant\"";
    let joint = "[[joint]]\npart = \"plate\"\nmode = \"fixed\"\naxis = \"+X\"\nangle_deg = 0\nlimits_deg = [-90, 90]\n";
    let scene = scene(instant, &format!("solar_constant = {SOLAR}"), joint);
    asking(&plate(), &scene, |client| {
        let opened = client.ask(json!({"request": "open", "scene": "craft", "light": {}}));
        assert_eq!(opened["joints"], json!({"plate": 0.0}));
        client.ask(at(0.0, DVec3::Z));
        for (time, angle) in [(10.0, 0.0f64), (20.0, 60.0), (30.0, -40.0)] {
            let mut step = at(time, DVec3::Z);
            step["joints"] = json!({"plate": angle.to_radians()});
            let answer = client.ask(step);
            let mean = answer["parts"]["plate"]["mean"].as_f64().expect("a number");
            let (sine, cosine) = angle.to_radians().sin_cos();
            let expected = (0.5 * SOLAR * cosine / (0.8 * STEFAN_BOLTZMANN)).powf(0.25);
            assert!((mean - expected).abs() < 1e-3, "{angle}: {mean} beside {expected}");
            // The recoil follows the turned normal.
            let normal = DVec3::new(0.0, -sine, cosine);
            let incoming = SOLAR * AREA * cosine / LIGHT_SPEED;
            let force = vector(&answer["light"]["sun"]["force"]);
            close(force, -incoming * (DVec3::Z + 2.0 / 3.0 * 0.5 * normal), 1e-6);
        }
        let (kind, message) = client.refused(r#"{"request": "step", "time": 40, "joints": {"plate": 3}}"#);
        assert!(kind == "refused" && message.contains("'plate' can not be at 3"), "{message}");
    });
}

#[test]
fn a_wrong_line_ends_nothing_and_a_refused_request_changes_nothing() {
    let scene = scene(&optics(0.5, 0.8), &format!("solar_constant = {SOLAR}"), "[initial]\ntemperature = 300");
    asking(&plate(), &scene, |client| {
        let (kind, message) = client.refused(r#"{"request": "step", "time": 0}"#);
        assert!(kind == "refused" && message.contains("'open' comes first"), "{message}");
        for line in [
            "{",
            "null",
            "[1, 2]",
            "\u{1}",
            r#"{"request": "open"}"#,
            r#"{"request": "open", "scene": "x", "prats": []}"#,
        ] {
            let (kind, _) = client.refused(line);
            assert_eq!(kind, "malformed", "{line}");
        }
        assert_eq!(client.send(&[0xFF, 0xFE, 0x00])["error"]["kind"], "malformed");
        let (kind, message) = client.refused(r#"{"request": "open", "scene": "../etc/passwd"}"#);
        assert!(kind == "refused" && message.contains("the scenes here are craft"), "{message}");
        let (_, message) = client.refused(r#"{"request": "open", "scene": "craft", "parts": ["wing"]}"#);
        assert!(message.contains("no part matches 'wing'; the parts are plate"), "{message}");
        // A blank line has no answer.
        client.stream.write_all(b"\n  \r\n").expect("it takes blank lines");
        client.ask(json!({"request": "open", "scene": "craft"}));
        client.ask(at(0.0, DVec3::Z));
        // The craft stays open.
        let (kind, _) = client.refused(r#"{"request": "open", "scene": "craft", "parts": ["wing"]}"#);
        assert_eq!(kind, "refused");
        for (step, reason) in [
            (r#"{"request": "step", "time": 10, "position": [1, 2, 3]}"#, "centre of a planet"),
            (r#"{"request": "step", "time": 10, "quaternion": [0, 0, 0, 0]}"#, "must be finite and not zero"),
            (r#"{"request": "step", "time": 10, "quaternion": [2, 0, 0, 0]}"#, "must have length 1"),
            (r#"{"request": "step", "time": 10, "sun": [1, 2, 3], "sun_direction": [1, 0, 0]}"#, "both"),
            (r#"{"request": "step", "time": -10, "position": [9e6, 0, 0]}"#, ""),
            (r#"{"request": "step", "time": 10, "position": [9e6, 0, 0], "joints": {"arm": 1}}"#, "'arm'"),
            (r#"{"request": "step", "time": 10, "position": [9e6, 0, 0], "heaters": {"arm": 1}}"#, "'arm'"),
            (r#"{"request": "step", "time": 10}"#, "places from 0 to 0 s"),
        ] {
            let (kind, message) = client.refused(step);
            assert!(kind == "refused" && message.contains(reason), "{step}: {message}");
        }
        let here = client.ask(json!({"request": "step", "time": 0}));
        let mean = here["parts"]["plate"]["mean"].as_f64().expect("a number");
        assert!(here["time"] == json!(0.0) && (mean - 300.0).abs() < 1e-9, "{here}");
        client.ask(at(10.0, DVec3::Z));
    });
}

/// With a warm-up or a saved state the craft begins with that, wherever the first place is.
#[test]
fn a_craft_begins_with_its_warm_up_or_with_a_saved_state() {
    let folder = Folder::new(&SCENE.replace("steps = 12", "steps = 12\nwarm_up_orbits = 1\nwarm_up_step = 60"));
    let path = folder.path("scene.toml");
    let mut own = Simulation::load(&path, &Target::Reference).expect("a scene");
    own.begin().expect("a warm-up");
    let warm = own.part_temperatures().expect("temperatures");
    own.step_to(300.0).expect("steps");
    let (later, state) = (own.part_temperatures().expect("temperatures"), own.save().expect("a state"));
    let first = |state: Option<Arc<ThermalState>>, warm_up: bool| {
        let served = server(Some(&path), Target::Reference, PictureKind::Apparent);
        let has_past = warm_up || state.is_some();
        let served = Server { state, warm_up, ..served };
        serving(&served, talk_telemetry, |address| {
            let mut client = Client::open(address);
            client.ask(json!({"request": "open", "scene": "craft"}));
            let answer = client.ask(at(7.0, DVec3::X));
            let next = client.ask(at(60.0, DVec3::X));
            assert_eq!(answer["parts"] != next["parts"], has_past, "only a craft in balance stays as it is");
            answer
        })
    };
    let expect = |answer: &Value, expected: &[PartTemperature]| {
        let mean = |part: &PartTemperature| answer["parts"][&part.part]["mean"].as_f64().expect("a number");
        expected.iter().map(|part| (mean(part) - part.mean).abs()).fold(0.0, f64::max)
    };
    assert!(expect(&first(None, true), &warm) < 1e-9);
    assert!(expect(&first(Some(Arc::new(state)), false), &later) < 1e-9);
    assert!(expect(&first(None, false), &warm) > 1.0, "in balance it begins otherwise");
}

/// The client of `docs/telemetry.md`, as it stands there.
#[test]
fn the_client_of_the_document_runs() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/telemetry.md");
    let page = std::fs::read_to_string(page).expect("the page");
    let code = page.split("```python\n").nth(1).and_then(|rest| rest.split("```").next()).expect("a program");
    assert!(code.lines().count() <= 20, "{} lines", code.lines().count());
    let folder = Folder::new(SCENE);
    let served = server(Some(&folder.path("scene.toml")), Target::Reference, PictureKind::Apparent);
    serving(&served, talk_telemetry, |address| {
        let mut python = Command::new("python3");
        let output = python.arg("-c").arg(code).arg(address.port().to_string()).arg("craft").output();
        let output = output.expect("python3 starts");
        let said = String::from_utf8_lossy(&output.stdout);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        assert!(said.contains("parts: ") && said.contains("wing_port"), "{said}");
        assert!(said.lines().count() >= 4 && said.contains("hottest"), "{said}");
    });
}
