//! Basilisk's protocol: images of a run that is sent step by step are those of the same run in process.

use glam::{DMat3, DQuat, DVec3};
use isotherm::internals::{PictureKind, read_png};
use isotherm::{CameraFrame, Image, Pose, Simulation, Target, internals};

use super::protobuf::{Camera, Fields, body, craft, message};
use super::zmtp::Requester;
use super::{server, serving};
use crate::craft::{Folder, scene_with};
use crate::device::{assert_silent, context};
use crate::program::{end, isotherm, refusal};

/// Half an hour about the exit from eclipse.
fn scene() -> String {
    scene_with(&[("phase_deg = 80", "phase_deg = 235")])
}

const SIZE: [u64; 2] = [96, 80];
const FOV: f64 = 40.0;
/// The camera in the body frame of the craft that it sees.
const SEEN_FROM: DVec3 = DVec3::new(8.0, 6.5, -9.0);
/// The camera on the craft that carries it.
const MOUNTED: DVec3 = DVec3::new(0.8, -0.35, 0.5);

/// A run as Basilisk sends it: the craft on the orbit of the scene, and a chaser whose camera stands still in the craft's body frame.
struct Run {
    simulation: Simulation,
    /// Where the positions of the messages begin [m].
    origin: DVec3,
    mu: f64,
    /// Offset [m], turn about z [deg] and scale of the model on its craft.
    mount: (DVec3, f64, f64),
}

impl Run {
    fn new(folder: &Folder, target: &Target, origin: DVec3) -> Self {
        let simulation = Simulation::load(&folder.path("scene.toml"), target).expect("a scene");
        let radius: f64 = 6371e3 + 408e3;
        let mu = (std::f64::consts::TAU / 5553.6).powi(2) * radius.powi(3);
        Self { simulation, origin, mu, mount: (DVec3::ZERO, 0.0, 1.0) }
    }

    fn state(&self, time: f64) -> (DVec3, DVec3, DQuat, DVec3) {
        let sky = self.simulation.prepared().loads.sky_model();
        let at = |time: f64| sky.point(time).expect("a place").position;
        let velocity = (at(time + 0.05) - at(time - 0.05)) / 0.1;
        let attitude = DQuat::from_mat3(&sky.sky(time).body_from_inertial.transpose()).normalize();
        (at(time), velocity, attitude, sky.point(time).expect("a place").sun)
    }

    /// The message of a step, and the pose of the camera.
    fn message(&self, frame: i64, time: f64, turned: DQuat) -> Fields {
        let (position, velocity, attitude, sun) = self.state(time);
        let chaser = attitude * DQuat::from_rotation_y(0.7) * DQuat::from_rotation_z(0.002 * time);
        let camera_from_seen = DMat3::from_quat(body_from_camera()).transpose();
        let camera_from_chaser = camera_from_seen * DMat3::from_quat(attitude.conjugate() * chaser);
        let (offset, turn, scale) = self.mount;
        let of_chaser = position + attitude * (scale * SEEN_FROM) - chaser * MOUNTED;
        let of_craft = attitude * turned * DQuat::from_rotation_z(-turn.to_radians());
        let bodies =
            [body("earth", self.origin, 1e-9 * self.mu, 6371.0), body("sun", self.origin + sun, 1.327e11, 695_000.0)];
        let all = [
            craft("target", self.origin + position - of_craft * offset, velocity, of_craft),
            craft("chaser", self.origin + of_chaser, velocity, chaser),
        ];
        let camera = |id, depth| {
            let camera_from_body = camera_from_chaser;
            Camera { id, size: SIZE, fov_deg: FOV, position: MOUNTED, camera_from_body, depth }.fields()
        };
        let model = Fields::default().text(1, "craft").text(2, "target");
        let model = model.vector(3, offset).doubles(4, &[0.0, 0.0, turn]).doubles(5, &[scale; 3]);
        let epoch = Fields::default().int(1, 2019).int(2, 1).int(3, 1);
        let sent = message(frame, time, &bodies, &all, &[camera(0, None), camera(7, Some(40.0))]);
        let sent = sent.message(7, &Fields::default().double(1, 0.2).message(12, &model));
        if frame == 1 { sent.message(8, &epoch) } else { sent }
    }

    /// What the camera sees in process.
    fn image(&mut self, time: f64) -> Image {
        self.simulation.step_to(time).expect("it steps");
        let mut camera = self.simulation.camera().expect("a camera").clone();
        (camera.width, camera.height) = (SIZE[0] as u32, SIZE[1] as u32);
        let focal = 0.5 * SIZE[1] as f64 / (0.5 * FOV.to_radians()).tan();
        camera.lens.focal = [focal; 2];
        camera.lens.centre = SIZE.map(|side| 0.5 * side as f64);
        let pose = Pose::new(CameraFrame::Body, SEEN_FROM, body_from_camera()).expect("a pose");
        self.simulation.image(&camera, &pose).expect("an image")
    }
}

fn body_from_camera() -> DQuat {
    let Ok(Pose::Given { frame_from_camera, .. }) =
        Pose::look_at(CameraFrame::Body, SEEN_FROM, DVec3::new(0.3, -0.2, 0.1), DVec3::NEG_Z)
    else {
        panic!("a pose")
    };
    frame_from_camera
}

/// Temperatures of a picture of 16 bits [K].
fn kelvin(png: &[u8]) -> Vec<f32> {
    let (size, bytes) = read_png(png).expect("a PNG");
    assert_eq!(size.map(u64::from), SIZE);
    bytes.as_chunks::<2>().0.iter().map(|pair| f32::from(u16::from_be_bytes(*pair)) * 0.01).collect()
}

/// Image where one picture has a surface and the other has none, and the largest difference of temperatures where both have one [K].
fn differences(found: &[f32], expected: &Image) -> (usize, f32) {
    let (mut edges, mut worst) = (0, 0.0f32);
    for (pixel, found) in found.iter().enumerate() {
        match (*found > 0.0, expected.part[pixel] != 0) {
            (true, true) => worst = worst.max((found - expected.temperature[pixel]).abs()),
            (false, false) => {}
            _ => edges += 1,
        }
    }
    (edges, worst)
}

/// Sends a message whose answer must be `OK`.
fn update(client: &mut Requester, message: &Fields) {
    let answer = client.ask(&[b"SIM_UPDATE", b"", b"", &message.0]).expect("an answer");
    assert_eq!(answer, [b"OK"]);
}

/// Without a display Basilisk sends its first 11 steps and then only those of images. The server steps through the gaps, which are three steps long.
#[test]
fn images_of_a_run_are_those_in_process() {
    let folder = Folder::new(&scene());
    let target = Target::Device(context());
    let served = server(Some(&folder.path("scene.toml")), target.clone(), PictureKind::Surface16);
    serving(&served, internals::talk_vizard, |address| {
        // Two runs, one after the other, on one connection; the second far from the origin.
        let mut client = Requester::open(address).expect("a connection");
        for origin in [DVec3::ZERO, DVec3::new(1.1e11, -0.9e11, 0.4e11)] {
            let mut run = Run::new(&folder, &target, origin);
            for _ in 0..2 {
                assert_eq!(client.ask(&[b"PING"]).expect("an answer"), [b"PONG"]);
            }
            for frame in 1..=11 {
                update(&mut client, &run.message(frame, frame as f64, DQuat::IDENTITY));
            }
            let mut temperatures = Vec::new();
            for time in [60.0, 240.0, 420.0, 600.0, 690.0, 870.0] {
                update(&mut client, &run.message(time as i64, time, DQuat::IDENTITY));
                let found = kelvin(&client.image(0));
                let expected = run.image(time);
                let (edges, worst) = differences(&found, &expected);
                println!("{time} s: {edges} pixels at edges, {worst:.4} K");
                assert!(edges <= 2 && worst < 0.05, "{time} s: {edges} pixels, {worst} K");
                assert!(expected.part.iter().filter(|part| **part != 0).count() > 500);
                temperatures.push(found.iter().fold(0.0f32, |most, one| most.max(*one)));
                // Depth of the same view.
                let depth = depths(&client.image(7), 40.0);
                let error =
                    depth.iter().zip(&expected.depth).filter(|(found, expected)| **found < 40.0 && **expected > 0.0);
                let error = error.map(|(found, expected)| (found - f64::from(*expected)).abs()).fold(0.0, f64::max);
                assert!(error < 1e-4, "{error} m");
                assert_eq!(client.ask(&[b"PING"]).expect("an answer"), [b"PONG"]);
            }
            assert!(temperatures[5] > temperatures[0] + 30.0, "the craft leaves the shadow: {temperatures:?}");
            // A craft that is turned a little has other pixels.
            update(&mut client, &run.message(930, 930.0, DQuat::from_rotation_x(0.05)));
            let (edges, worst) = differences(&kelvin(&client.image(0)), &run.image(930.0));
            assert!(edges > 20 || worst > 0.5, "a turned craft must not pass: {edges} {worst}");
        }
        assert_eq!(client.image(3), b"", "there is no such camera");
        // The run goes on after a refused image.
        assert_eq!(client.ask(&[b"REQUEST_INPUT"]).expect("an answer"), [&b"VIZARD_INPUT"[..], b""]);
    });
    if let Target::Device(context) = &target {
        assert_silent(context);
    }
}

/// A model that is moved, turned and scaled on its craft is where and as large as the script says: the same picture of a craft that stands otherwise.
#[test]
fn a_custom_model_stands_as_the_script_says() {
    let folder = Folder::new(&scene());
    let target = Target::Reference;
    let served = server(Some(&folder.path("scene.toml")), target.clone(), PictureKind::Surface16);
    serving(&served, internals::talk_vizard, |address| {
        let mut client = Requester::open(address).expect("a connection");
        for mount in
            [(DVec3::new(0.5, -0.3, 2.0), 0.0, 1.0), (DVec3::ZERO, 70.0, 1.0), (DVec3::new(1.0, 0.0, 0.0), -30.0, 4.0)]
        {
            let mut run = Run { mount, ..Run::new(&folder, &target, DVec3::ZERO) };
            update(&mut client, &run.message(1, 1.0, DQuat::IDENTITY));
            update(&mut client, &run.message(2, 2.0, DQuat::IDENTITY));
            let expected = run.image(2.0);
            let (edges, worst) = differences(&kelvin(&client.image(0)), &expected);
            assert!(edges <= 2 && worst < 0.05, "{mount:?}: {edges} pixels, {worst} K");
            let far = 40.0;
            let depth = depths(&client.image(7), far);
            let scaled = expected.depth.iter().map(|depth| mount.2 * f64::from(*depth));
            let error = depth.iter().zip(scaled).filter(|(found, expected)| **found < far && *expected > 0.0);
            assert!(error.map(|(found, expected)| (found - expected).abs()).fold(0.0, f64::max) < 1e-3, "{mount:?}");
            // A craft that is turned a little has another picture.
            update(&mut client, &run.message(3, 3.0, DQuat::from_rotation_x(0.05)));
            let (edges, _) = differences(&kelvin(&client.image(0)), &run.image(3.0));
            assert!(edges > 10, "{mount:?}: {edges} pixels");
        }
        // A scale that differs along the axes can not be drawn.
        let craft = Run::new(&folder, &target, DVec3::ZERO).message(1, 1.0, DQuat::IDENTITY);
        let model = Fields::default().text(1, "craft").text(2, "target").doubles(5, &[1.0, 1.0, 2.0]);
        update(&mut client, &craft.message(7, &Fields::default().message(12, &model)));
        assert_eq!(client.image(0), b"");
    });
}

/// Depths of a coloured picture [m]. What is white lies at the far plane or beyond.
fn depths(png: &[u8], far: f64) -> Vec<f64> {
    let (_, bytes) = read_png(png).expect("a PNG");
    let (pixels, rest) = bytes.as_chunks::<3>();
    assert!(rest.is_empty() && pixels.len() as u64 == SIZE[0] * SIZE[1]);
    let share = |[r, g, b]: &[u8; 3]| f64::from(*r) / 255.0 + f64::from(*g) / 65025.0 + f64::from(*b) / 16_581_375.0;
    pixels.iter().map(|pixel| if *pixel == [255; 3] { far } else { far * share(pixel) }).collect()
}

/// What can not be drawn has an empty image, so that the run goes on.
#[test]
fn what_a_server_does_not_know_has_no_image() {
    let folder = Folder::new(&scene());
    let target = Target::Reference;
    let served = server(Some(&folder.path("scene.toml")), target.clone(), PictureKind::Apparent);
    let run = Run::new(&folder, &target, DVec3::ZERO);
    serving(&served, internals::talk_vizard, |address| {
        let mut client = Requester::open(address).expect("a connection");
        assert_eq!(client.image(0), b"", "no state has come");
        let (position, velocity, attitude, _) = run.state(1.0);
        let camera = Camera {
            id: 0,
            size: SIZE,
            fov_deg: FOV,
            position: MOUNTED,
            camera_from_body: DMat3::IDENTITY,
            depth: None,
        };
        let earth = body("earth", DVec3::ZERO, 398_600.0, 6371.0);
        let at = |name: &str, position| craft(name, position, velocity, attitude);
        let chaser = at("chaser", position + attitude * DVec3::new(0.0, 0.0, -20.0));
        let good = [at("craft", position), chaser.clone()];
        let ends = |client: &mut Requester, message: Fields| {
            update(client, &message);
            client.image(0).len()
        };
        // A craft of another name; no planet; the planet's centre; a field of view of nothing.
        let camera_fields = [camera.fields()];
        let epoch = Fields::default().int(1, 2019).int(2, 1).int(3, 1);
        let cases = [
            message(1, 1.0, std::slice::from_ref(&earth), &[at("other", position), chaser.clone()], &camera_fields),
            message(1, 1.0, &[], &good, &camera_fields),
            message(1, 1.0, std::slice::from_ref(&earth), &[at("craft", DVec3::ZERO), chaser], &camera_fields)
                .message(8, &epoch),
            message(1, 1.0, std::slice::from_ref(&earth), &good, &[Camera { fov_deg: 0.0, ..camera }.fields()]),
            // Neither a Sun nor a date.
            message(1, 1.0, std::slice::from_ref(&earth), &good, &camera_fields),
        ];
        for (number, case) in cases.into_iter().enumerate() {
            assert_eq!(ends(&mut client, case), 0, "case {number}");
        }
        // With a date the Sun is that of the date, also where all bodies are at the origin.
        let sun = body("sun", DVec3::ZERO, 1.327e11, 695_000.0);
        for bodies in [vec![earth.clone()], vec![earth.clone(), sun]] {
            assert!(ends(&mut client, message(1, 1.0, &bodies, &good, &camera_fields).message(8, &epoch)) > 100);
        }
        // The end of a run, in live mode.
        let last = message(2, 2.0, &[earth], &good, &camera_fields).message(10, &Fields::default().int(3, 1));
        assert_eq!(ends(&mut client, last), 0, "the run is over");
        assert_eq!(client.ask(&[b"SIM_UPDATE", b"", b"", &[0xFF; 9]]).expect("an answer"), [b"ERROR"]);
        assert_eq!(client.ask(&[b"PING"]).expect("an answer"), [b"PONG"]);
    });
}

#[test]
fn the_program_listens_to_this_machine_unless_told_otherwise() {
    use std::io::{BufRead, BufReader};
    use std::process::Stdio;
    let folder = Folder::new(&scene());
    let remote = ["serve", "scene.toml", "--protocol", "vizard", "--device", "cpu", "--listen", "0.0.0.0:0"];
    let (code, message) = refusal(&end(isotherm(folder.0.path(), &remote)));
    assert_eq!(code, Some(2));
    assert!(message.contains("no authentication") && message.contains("--allow-remote"), "{message}");
    let twice = ["serve", "scene.toml", "scene.toml", "--protocol", "vizard", "--listen", "127.0.0.1:0"];
    assert!(refusal(&end(isotherm(folder.0.path(), &twice))).1.contains("NAME=PATH"));
    let mut command = isotherm(folder.0.path(), &["serve", "a=scene.toml", "--protocol", "vizard", "--device", "cpu"]);
    command.args(["--listen", "127.0.0.1:0", "--log", "requests.log"]).stdout(Stdio::piped()).stderr(Stdio::null());
    let mut program = command.spawn().expect("the program starts");
    let mut line = String::new();
    BufReader::new(program.stdout.take().expect("its output")).read_line(&mut line).expect("a line");
    let address = line.trim().strip_prefix("listening on ").expect("an address").parse().expect("an address");
    let mut client = Requester::open(address).expect("a connection");
    assert_eq!(client.ask(&[b"PING"]).expect("an answer"), [b"PONG"]);
    program.kill().expect("it can be killed");
    program.wait().expect("it ends");
    assert!(client.ask(&[b"PING"]).is_err(), "the client sees the end of the connection");
    let log = std::fs::read_to_string(folder.path("requests.log")).expect("the log");
    assert!(log.contains(" begin\n") && log.contains(" PING\n"), "{log}");
}
