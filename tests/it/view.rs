//! The page of `isotherm view` over its WebSocket: its numbers are those of the façade, and no page can disturb another.

mod client;
mod planes;

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::Stdio;
use std::sync::Arc;

use glam::DVec3;
use isotherm::internals::Apparent;
use isotherm::{CameraFrame, Pose, Scene, Simulation, Target};
use serde_json::{Value, json};
use tungstenite::Message;

use self::client::{PATIENCE, Page, Received, Server, TOLERANCE, expected, images};
use super::craft::{Folder, SCENE, scene_with};
use super::device::{assert_silent, validated_context};
use super::program::isotherm;
use super::random::Random;

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
