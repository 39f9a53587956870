//! The page of `isotherm view` over its WebSocket: its numbers are those of the façade, and no page can disturb another.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::process::Stdio;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use glam::DVec3;
use isotherm::internals::{Apparent, CHANNELS, ViewError, ViewSession, read_exr};
use isotherm::{CameraFrame, Image, Pose, Scene, Simulation, Target};
use serde_json::{Value, json};
use tungstenite::{Message, WebSocket};

use super::craft::{Folder, SCENE, scene_with};
use super::device::{assert_silent, validated_context};
use super::mesh_network::{CELLS, SKIN, TRANSITION};
use super::program::{isotherm, succeed};
use super::random::Random;

/// Longest wait for an answer.
const PATIENCE: Duration = Duration::from_secs(60);

/// Largest difference between a temperature of the page and of the façade [K].
const TOLERANCE: f32 = 0.05;

/// A session on a free port. It ends with the value.
struct Server {
    address: SocketAddr,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<Result<(), ViewError>>>,
}

impl Server {
    fn new(folder: &Folder, target: &Target) -> Self {
        let scene = Scene::load(&folder.path("scene.toml")).expect("a scene");
        let simulation = Simulation::from_scene(scene.clone(), target).expect("a simulation");
        let camera = simulation.camera().expect("a camera").clone();
        let session = ViewSession { scene, target: target.clone(), simulation, camera, has_camera: true };
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).expect("a free port");
        let address = listener.local_addr().expect("an address");
        let stop = Arc::new(AtomicBool::new(false));
        let flag = Arc::clone(&stop);
        let thread = Some(std::thread::spawn(move || session.serve(listener, &flag, Box::new(|| ()))));
        Self { address, stop, thread }
    }

    fn end(mut self) {
        self.stop.store(true, Ordering::Relaxed);
        let ended = self.thread.take().expect("a thread").join().expect("no panic");
        ended.expect("it ends in order");
    }
}

/// A page without a browser.
struct Page {
    socket: WebSocket<TcpStream>,
    hello: Value,
    texts: Vec<Value>,
}

/// An image as the page reads it.
struct Received {
    header: Value,
    planes: Vec<(String, Vec<f64>)>,
}

impl Received {
    fn new(bytes: &[u8]) -> Self {
        assert_eq!(&bytes[..4], b"ISOT");
        let length = u32::from_le_bytes(bytes[4..8].try_into().expect("four bytes")) as usize;
        let header: Value = serde_json::from_slice(&bytes[8..8 + length]).expect("a header");
        let count = (header["width"].as_u64().unwrap() * header["height"].as_u64().unwrap()) as usize;
        let mut at = 8 + length;
        let mut planes = Vec::new();
        for plane in header["planes"].as_array().expect("planes") {
            let (size, scale) = (plane["bytes"].as_u64().unwrap() as usize, plane["scale"].as_f64().unwrap());
            let offset = plane["offset"].as_f64().unwrap();
            let number = |bytes: &[u8]| bytes.iter().rev().fold(0.0, |sum, byte| 256.0 * sum + f64::from(*byte));
            let values = bytes[at..at + size * count].chunks(size).map(|bytes| scale * number(bytes) + offset);
            planes.push((plane["name"].as_str().unwrap().to_owned(), values.collect()));
            at += (size * count).next_multiple_of(4);
        }
        assert_eq!(at, bytes.len(), "the planes fill the message");
        Self { header, planes }
    }

    fn plane(&self, name: &str) -> &[f64] {
        &self.planes.iter().find(|(known, _)| known == name).unwrap_or_else(|| panic!("no plane {name}")).1
    }

    fn step(&self) -> u64 {
        self.header["step"].as_u64().expect("a step")
    }

    /// Largest difference of the temperatures to those of an image [K]. Parts and materials are equal.
    fn difference(&self, image: &Image) -> f32 {
        let labels = |values: &[f64]| values.iter().map(|value| *value as u32).collect::<Vec<_>>();
        assert_eq!(labels(self.plane("part")), image.part);
        assert_eq!(labels(self.plane("material")), image.material);
        let pairs = self.plane("temperature").iter().zip(&image.temperature);
        pairs.map(|(a, b)| (*a as f32 - b).abs()).fold(0.0, f32::max)
    }
}

impl Page {
    fn open(address: SocketAddr) -> Self {
        let stream = TcpStream::connect(address).expect("a connection");
        stream.set_read_timeout(Some(PATIENCE)).expect("a timeout");
        let (socket, _) = tungstenite::client(format!("ws://{address}/stream"), stream).expect("a WebSocket");
        let mut page = Self { socket, hello: Value::Null, texts: Vec::new() };
        page.hello = page.text("hello");
        page
    }

    fn ask(&mut self, request: &Value) {
        self.socket.send(Message::text(request.to_string())).expect("it is sent");
    }

    /// The next image. Texts before it are kept.
    fn image(&mut self) -> Received {
        loop {
            match self.socket.read().expect("a message") {
                Message::Binary(bytes) => {
                    self.ask(&json!({ "do": "shown" }));
                    return Received::new(&bytes);
                }
                Message::Text(text) => self.texts.push(serde_json::from_str(&text).expect("JSON")),
                _ => {}
            }
        }
    }

    /// The next text of a type. Images before it are dropped.
    fn text(&mut self, kind: &str) -> Value {
        loop {
            if let Some(place) = self.texts.iter().position(|text| text["type"] == kind) {
                return self.texts.remove(place);
            }
            match self.socket.read().expect("a message") {
                Message::Binary(_) => self.ask(&json!({ "do": "shown" })),
                Message::Text(text) => self.texts.push(serde_json::from_str(&text).expect("JSON")),
                _ => {}
            }
        }
    }

    /// The first image for which a condition holds.
    fn image_where(&mut self, condition: impl Fn(&Received) -> bool) -> Received {
        loop {
            let image = self.image();
            if condition(&image) {
                return image;
            }
        }
    }

    fn seek(&mut self, step: u64) -> Received {
        self.ask(&json!({ "do": "seek", "time": 60.0 * step as f64 }));
        self.image_where(|image| image.step() == step)
    }
}

/// Images of the façade at the ends of steps.
fn images(folder: &Folder, target: &Target, steps: &[u64], pose: &Pose) -> Vec<Image> {
    let mut simulation = Simulation::load(&folder.path("scene.toml"), target).expect("a simulation");
    let camera = simulation.camera().expect("a camera").clone();
    let image = |step: &u64| {
        simulation.step_to(60.0 * *step as f64).expect("it steps");
        simulation.image(&camera, pose).expect("an image")
    };
    steps.iter().map(image).collect()
}

fn expected(folder: &Folder, target: &Target, step: u64, pose: &Pose) -> Image {
    images(folder, target, &[step], pose).remove(0)
}

/// The page has the errors of the temperatures where the scene asks, also after time went back.
#[test]
fn errors_are_those_of_the_facade() {
    let scene = scene_with(&[("draw_every = 4", "draw_every = 4\nwarm_up_orbits = 0.1")]);
    let folder = Folder::new(&format!("{scene}\n[shadows]\n[output]\nerror = true\n"));
    let server = Server::new(&folder, &Target::Reference);
    let mut page = Page::open(server.address);
    assert_eq!(page.hello["error"], true);
    let own = images(&folder, &Target::Reference, &[3, 9], &Pose::OfCamera);
    let largest = own.iter().flat_map(|image| &image.error).copied().fold(0.0, f32::max);
    assert!(largest > 0.01, "{largest} K");
    for step in [9, 3, 9] {
        let image = page.seek(step);
        let differs = |own: &Image| {
            let pairs = image.plane("error").iter().zip(&own.error);
            pairs.map(|(a, b)| (*a as f32 - b).abs()).fold(0.0, f32::max)
        };
        // Half a number, whose value is 0.1 mK or more with the largest error.
        let half = 1e-4f32.max(largest / f32::from(u16::MAX));
        let [early, late] = [differs(&own[0]), differs(&own[1])];
        let [right, other] = if step == 3 { [early, late] } else { [late, early] };
        assert!(right <= half && other > 10.0 * half, "step {step}: {right} and {other} K");
    }
    server.end();
    let server = Server::new(&Folder::new(SCENE), &Target::Reference);
    let mut page = Page::open(server.address);
    assert_eq!(page.hello["error"], false);
    assert!(page.image().planes.iter().all(|(name, _)| name != "error"));
    server.end();
}

/// The page has the budgets of the pixels where the scene asks, also after time went back.
#[test]
fn budgets_are_those_of_the_facade() {
    let scene = scene_with(&[("draw_every = 4", "draw_every = 4\nwarm_up_orbits = 0.1")]);
    let folder = Folder::new(&format!("{scene}\n[shadows]\n[output]\nbudget = true\n"));
    let server = Server::new(&folder, &Target::Reference);
    let mut page = Page::open(server.address);
    assert_eq!(page.hello["causes"].as_array().map(Vec::len), Some(8));
    let own = images(&folder, &Target::Reference, &[3, 9], &Pose::OfCamera);
    for step in [9, 3, 9] {
        let image = page.seek(step);
        let differs = |own: &Image, cause: usize| {
            let pairs = image.plane(CHANNELS[cause]).iter().zip(&own.budget);
            pairs.map(|(a, b)| (*a as f32 - b[cause]).abs()).fold(0.0, f32::max)
        };
        for (cause, name) in CHANNELS.into_iter().enumerate() {
            let (right, other) = if step == 3 { (&own[0], &own[1]) } else { (&own[1], &own[0]) };
            assert!(differs(right, cause) <= 0.05, "{name} at step {step}: {}", differs(right, cause));
            assert!(cause != 7 || differs(other, cause) > 1.0, "another step emits otherwise");
        }
    }
    server.end();
    let server = Server::new(&Folder::new(SCENE), &Target::Reference);
    let mut page = Page::open(server.address);
    assert_eq!(page.hello["causes"].as_array().map(Vec::len), Some(0));
    assert!(page.image().planes.iter().all(|(name, _)| name != "Q_sun"));
    server.end();
}

/// The page has the uncertainty of the pixels once it asks, and `isotherm render` finds the same by images instead of nodes.
#[test]
fn the_uncertainty_is_that_of_render() {
    let one = |name: &str| {
        format!(
            "[[uncertainty.parameter]]\nname = \"{name}\"\nvary = \"emissivity\"\nmaterial = \"{name}\"\npercent = 5\n"
        )
    };
    let asks = format!("[uncertainty]\n{}{}", one("skin"), one("cells"));
    let cells = (CELLS, "response = \"radiative\"\nheat_capacity_per_area = 1500\n");
    let folder = Folder::new(&format!("{}{asks}", scene_with(&[(TRANSITION, SKIN), cells])));
    let drawn = [3, 9].map(|step: u32| {
        let time = (60 * step).to_string();
        succeed(folder.0.path(), &["render", "scene.toml", "--time", &time, "-o", "a.exr", "--device", "cpu"]);
        read_exr(&folder.path("a.exr")).expect("an image").0
    });
    let server = Server::new(&folder, &Target::Reference);
    let mut page = Page::open(server.address);
    assert_eq!(page.hello["uncertainty"], true);
    assert!(page.image().planes.iter().all(|(name, _)| name != "sigma"));
    page.ask(&json!({ "do": "sigma" }));
    page.ask(&json!({ "do": "sigma" }));
    assert!(page.text("problem")["message"].as_str().is_some_and(|text| text.contains("under way")));
    let causes = loop {
        let told = page.text("sigma");
        assert_eq!(told["failed"], Value::Null);
        if told["causes"] != Value::Null {
            break told["causes"].clone();
        }
    };
    assert_eq!([&causes[0]["name"], &causes[1]["name"]], ["skin", "cells"]);
    for step in [9, 3, 9] {
        page.ask(&json!({ "do": "seek", "time": 60.0 * step as f64 }));
        let image = page.image_where(|image| image.step() == step && image.planes.len() > 3);
        let differs = |own: &Image| {
            let pairs = image.plane("sigma").iter().zip(&own.sigma.temperature);
            pairs.map(|(a, b)| (*a as f32 - b).abs()).fold(0.0, f32::max)
        };
        let (right, other) = if step == 3 { (&drawn[0], &drawn[1]) } else { (&drawn[1], &drawn[0]) };
        assert!(differs(right) < 1e-3 && differs(other) > 5e-3, "{} and {} K", differs(right), differs(other));
        let craft = right.part.iter().filter(|part| **part != 0).count();
        let causes = image.plane("cause").iter().zip(&right.sigma.cause).zip(&right.part);
        let alike = causes.filter(|((a, b), part)| **part != 0 && **a as u32 == **b).count();
        assert!(alike as f64 > 0.99 * craft as f64, "{alike} of {craft}");
        assert!([1, 2].iter().all(|cause| right.sigma.cause.contains(cause)), "both causes are shown");
    }
    assert!(Page::open(server.address).text("sigma")["causes"].is_array(), "a page that comes later is told");
    server.end();
    let server = Server::new(&Folder::new(SCENE), &Target::Reference);
    let mut page = Page::open(server.address);
    assert_eq!(page.hello["uncertainty"], false);
    page.ask(&json!({ "do": "sigma" }));
    assert_eq!(page.text("problem")["message"], "the scene has no [uncertainty]");
    server.end();
}

/// The first image of a sensor is that of the façade, digital number by digital number.
#[test]
fn digital_numbers_are_those_of_the_sensor() {
    let folder = Folder::new(&format!("{SCENE}\n[sensor]\nnetd = 0.05\nrange = [150, 400]\n"));
    let server = Server::new(&folder, &Target::Reference);
    let mut page = Page::open(server.address);
    page.ask(&json!({ "do": "show", "quantity": "counts" }));
    let image = page.image_where(|image| image.planes.len() == 4);
    let own = expected(&folder, &Target::Reference, 0, &Pose::OfCamera).digital_numbers.expect("a sensor");
    let found: Vec<u16> = image.plane("counts").iter().map(|value| *value as u16).collect();
    let off = found.iter().zip(&own).map(|(a, b)| a.abs_diff(*b)).max().expect("pixels");
    let span = own.iter().max().unwrap() - own.iter().min().unwrap();
    assert!(off <= span / 100, "{off} of {span}");
    server.end();
}

#[test]
fn its_numbers_are_those_of_the_facade() {
    let Some(context) = validated_context() else { return };
    for (scene, target) in [
        (
            scene_with(&[("draw_every = 4", "draw_every = 4\nwarm_up_orbits = 0.1")]),
            Target::Device(Arc::clone(&context)),
        ),
        (SCENE.to_owned(), Target::Reference),
    ] {
        let folder = Folder::new(&scene);
        let server = Server::new(&folder, &target);
        let steps = [0, 3, 5, 7, 12];
        let own = images(&folder, &target, &steps, &Pose::OfCamera);
        let mut page = Page::open(server.address);
        assert_eq!((page.hello["scene"].as_str(), page.hello["steps"].as_u64()), (Some("craft"), Some(12)));
        assert_eq!(page.hello["parts"].as_array().expect("parts").len(), 4);
        assert!(!page.hello["umbra"].as_array().expect("eclipses").is_empty(), "the scene enters the eclipse");
        // On, back and on again, also where no state was kept.
        for step in [0, 7, 3, 12, 0, 5] {
            let image = page.seek(step);
            for (other, own) in steps.iter().zip(&own) {
                let difference = image.difference(own);
                assert_eq!(difference <= TOLERANCE, *other == step, "step {step} and {other}: {difference} K");
            }
            assert_eq!(image.header["time"].as_f64(), Some(60.0 * step as f64));
        }
        page.ask(&json!({ "do": "show", "quantity": "apparent" }));
        page.ask(&json!({ "do": "look", "position": [0, -9, -3], "target": [0, 1, 0], "up": [0, 0, -1] }));
        let moved = |image: &Received| image.header["scene_camera"] == false && image.planes.len() == 4;
        let image = page.image_where(moved);
        let pose = Pose::look_at(CameraFrame::Body, DVec3::new(0.0, -9.0, -3.0), DVec3::Y, DVec3::NEG_Z).unwrap();
        let other = expected(&folder, &target, 5, &pose);
        assert!(image.difference(&other) <= TOLERANCE);
        let apparent = Apparent::new(Scene::load(&folder.path("scene.toml")).unwrap().band);
        for (found, radiance) in image.plane("apparent").iter().zip(&other.radiance) {
            assert!((*found as f32 - apparent.temperature(*radiance)).abs() <= TOLERANCE);
        }
        server.end();
    }
    assert_silent(&context);
}

/// A page that is opened in the warm-up is told how far it is, and an end does not wait for it.
#[test]
fn pages_are_told_of_the_warm_up() {
    let scene = |orbits: &str| scene_with(&[("draw_every = 4", &format!("draw_every = 4\nwarm_up_orbits = {orbits}"))]);
    let folder = Folder::new(&scene("40"));
    let server = Server::new(&folder, &Target::Reference);
    let mut page = Page::open(server.address);
    let told: Vec<Value> = page.texts.iter().filter(|text| text["type"] == "warm_up").cloned().collect();
    let done: Vec<u64> = told.iter().map(|text| text["done"].as_u64().expect("a number")).collect();
    assert!(done.len() > 1 && done.is_sorted() && done[0] < done[done.len() - 1], "{done:?}");
    assert!(told.iter().all(|text| text["steps"].as_u64().is_some_and(|steps| steps >= done[done.len() - 1])));
    assert_eq!(page.image().step(), 0);
    server.end();
    let server = Server::new(&Folder::new(&scene("0")), &Target::Reference);
    let page = Page::open(server.address);
    assert!(page.texts.iter().all(|text| text["type"] != "warm_up" || text["done"] == 0));
    server.end();
    let server = Server::new(&Folder::new(&scene("100000")), &Target::Reference);
    let stream = TcpStream::connect(server.address).expect("a connection");
    let (mut early, _) = tungstenite::client(format!("ws://{}/stream", server.address), stream).expect("a WebSocket");
    early.send(Message::text(json!({ "do": "step", "by": 1 }).to_string())).expect("it is sent");
    let mut problem = || early.read().expect("a message").to_string().contains("still in its warm-up");
    assert!((0..20).any(|_| problem()), "a wish in the warm-up has no answer");
    server.end();
}

#[test]
fn two_pages_share_time_and_have_a_camera_each() {
    let folder = Folder::new(SCENE);
    let target = Target::Reference;
    let server = Server::new(&folder, &target);
    let mut one = Page::open(server.address);
    let mut two = Page::open(server.address);
    one.ask(&json!({ "do": "look", "position": [9, 0, 0], "target": [0, 0, 0], "up": [0, 0, -1] }));
    one.image_where(|image| image.header["scene_camera"] == false);
    one.seek(4);
    let image = two.image_where(|image| image.step() == 4);
    assert_eq!(image.header["scene_camera"], true);
    assert!(image.difference(&expected(&folder, &target, 4, &Pose::OfCamera)) <= TOLERANCE);
    // Time plays to the end for both, and stands there.
    two.ask(&json!({ "do": "play", "rate": 240 }));
    for page in [&mut one, &mut two] {
        page.image_where(|image| image.step() == 12 && image.header["playing"] == false);
    }
    drop(one);
    two.ask(&json!({ "do": "step", "by": -2 }));
    two.image_where(|image| image.step() == 10);
    drop(two);
    // A page that is loaded again finds the time where it was.
    let mut again = Page::open(server.address);
    assert_eq!(again.image().step(), 10);
    server.end();
}

#[test]
fn malformed_messages_end_nothing() {
    let folder = Folder::new(SCENE);
    let server = Server::new(&folder, &Target::Reference);
    let mut calm = Page::open(server.address);
    calm.image();
    let mut page = Page::open(server.address);
    for text in
        ["", "{", "[]", "null", "{\"do\":\"dance\"}", "{\"do\":\"seek\"}", "\u{0}", "{\"do\":\"play\",\"rate\":-1}"]
    {
        page.socket.send(Message::text(text)).expect("it is sent");
        page.text("problem");
    }
    page.socket.send(Message::binary(vec![1, 2, 3])).expect("it is sent");
    page.text("problem");
    for (request, problem) in [
        (json!({ "do": "seek", "time": -61 }), "the scene has no time -61 s"),
        (json!({ "do": "seek", "time": 1e300 }), "the scene has no time"),
        (json!({ "do": "step", "by": i32::MIN }), "the scene has no step"),
        (
            json!({ "do": "look", "position": [0, 0, 1], "target": [0, 0, 0], "up": [0, 0, 1] }),
            "it must look at a point",
        ),
        (json!({ "do": "look", "position": [1e308, 1e308, 1], "target": [-1e308, 0, 0], "up": [0, 0, 1] }), "camera"),
        (json!({ "do": "probe", "x": 4_000_000_000u32, "y": 0 }), "shows no surface"),
        (json!({ "do": "remove", "probe": 77 }), "there is no probe 77"),
        (json!({ "do": "compare" }), ""),
    ] {
        page.ask(&request);
        if problem.is_empty() {
            let answer = page.text("accuracy");
            assert_eq!(answer["failed"], "this is the f64 reference itself");
        } else {
            let answer = page.text("problem")["message"].as_str().expect("a message").to_owned();
            assert!(answer.contains(problem), "{request}: {answer}");
        }
    }
    // Messages changed at random, and bytes that are no WebSocket.
    let mut random = Random(18);
    let valid = json!({ "do": "look", "position": [0, -9, -3], "target": [0, 1, 0], "up": [0, 0, -1] }).to_string();
    for _ in 0..300 {
        let mut bytes = valid.clone().into_bytes();
        for _ in 0..=random.bits() % 3 {
            let place = random.bits() as usize % bytes.len();
            bytes[place] = (random.bits() % 128) as u8;
        }
        page.socket.send(Message::text(String::from_utf8(bytes).expect("ASCII"))).expect("it is sent");
    }
    for bytes in [&b"\0\xff\xfe"[..], b"GET / HTTP/9.9\r\n\r\n", b"GET /stream HTTP/1.1\r\nUpgrade: websocket\r\n\r\n"]
    {
        let mut stream = TcpStream::connect(server.address).expect("a connection");
        stream.write_all(bytes).expect("it is sent");
    }
    // One message that is too long ends its own page only.
    let mut long = Page::open(server.address);
    let _ = long.socket.send(Message::text("x".repeat(1 << 20)));
    let ended = (0..100).any(|_| long.socket.read().is_err());
    assert!(ended, "a page that sends too much is closed");
    assert_eq!(calm.seek(2).step(), 2);
    page.image_where(|image| image.step() == 2);
    server.end();
}

#[test]
fn a_click_adds_a_probe_whose_curve_has_all_steps() {
    let folder = Folder::new(SCENE);
    let target = Target::Reference;
    let server = Server::new(&folder, &target);
    let mut page = Page::open(server.address);
    let own = page.text("curves");
    assert_eq!(own["curves"][0]["probe"]["name"], "tip");
    let image = page.seek(6);
    // In the middle of the image is the cube, far from the edges of its part.
    let [x, y] = [48, 36];
    let pixel = y * 96 + x;
    page.ask(&json!({ "do": "probe", "x": x, "y": y }));
    let curve = loop {
        let told = page.text("curves");
        if told["curves"].as_array().expect("curves").len() == 2 {
            break told["curves"][1].clone();
        }
    };
    let points = curve["points"].as_array().expect("points");
    let times: Vec<f64> = points.iter().map(|point| point[0].as_f64().expect("a time")).collect();
    assert_eq!(times, (0..=6).map(|step| 60.0 * f64::from(step)).collect::<Vec<_>>());
    let part = image.plane("part")[pixel] as usize;
    assert_eq!(curve["probe"]["name"], page.hello["parts"][part - 1]);
    let mut simulation = Simulation::load(&folder.path("scene.toml"), &target).expect("a simulation");
    let node = curve["probe"]["node"].as_u64().expect("a node") as usize;
    for point in points {
        simulation.step_to(point[0].as_f64().unwrap()).expect("it steps");
        let temperature = simulation.node_temperatures().expect("temperatures")[node];
        assert_eq!(point[1].as_f64().map(|value| value as f32), Some(temperature));
    }
    // The node lies within an edge of the mesh of what the pixel shows.
    let other = expected(&folder, &target, 6, &Pose::OfCamera);
    let ray = other.camera.lens.unproject(glam::DVec2::new(x as f64 + 0.5, y as f64 + 0.5)).expect("a ray");
    let seen = DVec3::new(ray.x, ray.y, 1.0) * f64::from(other.depth[pixel]);
    let seen = other.camera_from_body.inverse().transform_point3(seen);
    let node = glam::Vec3::from(simulation.node_positions()[node]).as_dvec3();
    assert!(node.distance(seen) < 0.7, "{node} is not at {seen}");
    // The page is told where the node is, and where the image has it.
    let marked = page.image_where(|image| image.header["probe_places"].as_array().is_some_and(|all| all.len() == 2));
    let place = &marked.header["probe_places"][1];
    let numbers = |value: &Value| -> Vec<f64> {
        value.as_array().expect("numbers").iter().map(|number| number.as_f64().expect("a number")).collect()
    };
    assert!(DVec3::from_slice(&numbers(&place["position"])).distance(node) < 1e-6, "{place}");
    let in_camera = other.camera_from_body.transform_point3(node);
    let lens = other.camera.lens;
    let known = [0, 1].map(|i| lens.focal[i] * in_camera[i] / in_camera.z + lens.centre[i]);
    let apart =
        |pixel: [f64; 2]| numbers(&place["pixel"]).iter().zip(pixel).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(apart(known) < 1e-6 && apart([known[1], known[0]]) > 1.0, "{place}, not {known:?}");
    assert_eq!(place["hidden"], false);
    // From behind, the cube hides it.
    let back = DVec3::from_slice(&numbers(&marked.header["position"])) * -1.0;
    page.ask(&json!({ "do": "look", "position": back.to_array(), "target": [0, 0, 0], "up": [0, 0, -1] }));
    let behind = page.image_where(|image| image.header["scene_camera"] == false);
    assert_eq!(behind.header["probe_places"][1]["hidden"], true);
    let id = curve["probe"]["id"].as_u64().expect("a number");
    page.ask(&json!({ "do": "remove", "probe": id }));
    let left = page.text("curves");
    assert_eq!(left["curves"].as_array().expect("curves").len(), 1);
    server.end();
}

#[test]
fn the_device_is_compared_with_f64() {
    let Some(context) = validated_context() else { return };
    let folder = Folder::new(SCENE);
    let server = Server::new(&folder, &Target::Device(Arc::clone(&context)));
    let mut page = Page::open(server.address);
    page.ask(&json!({ "do": "compare" }));
    let result = loop {
        let told = page.text("accuracy");
        assert_eq!(told["failed"], Value::Null);
        if told["result"] != Value::Null {
            break told["result"].clone();
        }
    };
    let most = result["max_k"].as_f64().expect("a difference");
    assert!(most > 0.0 && most < 0.1, "{result}");
    assert_eq!(result["steps"].as_u64(), Some(13));
    server.end();
    assert_silent(&context);
}

/// The answer to a plain request.
fn get(address: &str, path: &str, more: &str) -> String {
    let mut stream = TcpStream::connect(address).expect("a connection");
    stream.set_read_timeout(Some(PATIENCE)).expect("a timeout");
    let request = format!("GET {path} HTTP/1.1\r\nConnection: close\r\n{more}\r\n");
    stream.write_all(request.as_bytes()).expect("it is sent");
    let mut answer = String::new();
    stream.read_to_string(&mut answer).expect("text");
    answer
}

#[test]
fn the_program_prints_its_address_and_serves_its_page_to_this_computer() {
    let folder = Folder::new(SCENE);
    let arguments = ["view", "scene.toml", "--no-browser", "--device", "cpu", "--size", "64x48"];
    let mut command = isotherm(&folder.path(""), &arguments);
    let mut program = command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().expect("it starts");
    let mut line = String::new();
    BufReader::new(program.stdout.take().expect("output")).read_line(&mut line).expect("a line");
    let address =
        line.trim().strip_prefix("http://").and_then(|rest| rest.strip_suffix('/')).expect("an address").to_owned();
    assert!(address.starts_with("127.0.0.1:"), "{address}");
    let host = format!("Host: {address}\r\n");
    let page = get(&address, "/", &host);
    assert!(page.starts_with("HTTP/1.1 200") && page.contains("<title>Isotherm</title>"), "{page}");
    assert!(page.contains("content-security-policy: default-src 'none'"), "{page}");
    // All that the page names is there, and nothing is elsewhere.
    let named = page.split("src=\"").chain(page.split("href=\"")).skip(1).filter_map(|rest| rest.split('"').next());
    for name in named.filter(|name| name.contains('.') && !name.contains('<')) {
        assert!(!name.contains("//"), "{name}");
        assert!(get(&address, &format!("/{name}"), &host).starts_with("HTTP/1.1 200"), "{name}");
    }
    assert!(get(&address, "/Cargo.toml", &host).starts_with("HTTP/1.1 404"));
    assert!(get(&address, "/", "Host: evil.example\r\n").starts_with("HTTP/1.1 403"));
    assert!(get(&address, "/stream", &format!("{host}Origin: http://evil.example\r\n")).starts_with("HTTP/1.1 403"));
    let mut one = Page::open(address.parse().expect("an address"));
    assert_eq!(one.hello["size"], json!([64, 48]));
    one.image();
    drop(one);
    #[cfg(unix)]
    {
        // A bare Debian 13 has no program of this name, but each shell knows the word.
        let kill = ["-c", "kill $0", &program.id().to_string()];
        let ended = std::process::Command::new("sh").args(kill).status().expect("a shell starts");
        assert!(ended.success());
        assert_eq!(program.wait().expect("it ends").code(), Some(0));
    }
    #[cfg(not(unix))]
    {
        program.kill().expect("it ends");
        program.wait().expect("it ends");
    }
}
