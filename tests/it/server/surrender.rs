//! The protocol of SurRender's client: the pixels are those of the library, and every call is answered.

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::time::Duration;

use isotherm::internals::{Hash, PictureKind, Value, write_value};
use isotherm::{CameraFrame, Pose, Simulation, Target, internals};

use super::{server, serving};
use crate::craft::{Folder, SCENE};
use crate::device::context;
use glam::{DQuat, DVec3};

/// A client that reads answers as the real one does: until one has the name of the call.
struct Client(TcpStream);

impl Client {
    fn open(address: SocketAddr) -> Self {
        let stream = TcpStream::connect(address).expect("a connection");
        stream.set_read_timeout(Some(Duration::from_secs(120))).expect("a time limit");
        Self(stream)
    }

    fn call(&mut self, name: &str, values: &[(&str, Value)]) {
        let mut call = Hash::from([(String::new(), Value::Text(name.to_owned()))]);
        call.extend(values.iter().map(|(key, value)| ((*key).to_owned(), value.clone())));
        // In small pieces, as the client does.
        for piece in write_value(&call).chunks(7) {
            self.0.write_all(piece).expect("it takes a piece");
        }
    }

    fn bytes(&mut self, length: usize) -> Vec<u8> {
        let mut bytes = vec![0; length];
        self.0.read_exact(&mut bytes).expect("an answer");
        bytes
    }

    fn u32(&mut self) -> u32 {
        u32::from_be_bytes(self.bytes(4).try_into().expect("four bytes"))
    }

    fn sized(&mut self) -> Vec<u8> {
        match self.u32() {
            u32::MAX => Vec::new(),
            length => self.bytes(length as usize),
        }
    }

    fn text(&mut self) -> String {
        let words: Vec<u16> = self.sized().as_chunks::<2>().0.iter().map(|pair| u16::from_be_bytes(*pair)).collect();
        String::from_utf16(&words).expect("UTF-16")
    }

    fn hash(&mut self) -> Hash {
        (0..self.u32()).map(|_| (self.text(), self.value())).collect()
    }

    fn value(&mut self) -> Value {
        let kind = self.u32();
        assert_eq!(self.bytes(1), [0]);
        match kind {
            1 => Value::Bool(self.bytes(1) == [1]),
            2 => Value::Int(self.u32() as i32),
            6 => Value::Double(f64::from_be_bytes(self.bytes(8).try_into().expect("eight bytes"))),
            9 => Value::List((0..self.u32()).map(|_| self.value()).collect()),
            10 => Value::Text(self.text()),
            12 => Value::Bytes(self.sized()),
            other => panic!("type {other}"),
        }
    }

    /// The answer to a call, and the messages before it.
    fn answer(&mut self, name: &str) -> (Hash, String) {
        let mut messages = String::new();
        loop {
            let hash = self.hash();
            match (hash.get(""), hash.get("data")) {
                (Some(Value::Text(found)), _) if found == name => return (hash, messages),
                (Some(Value::Text(found)), Some(Value::Bytes(data))) if found.is_empty() => {
                    messages.push_str(std::str::from_utf8(data).expect("UTF-8"));
                }
                _ => {}
            }
        }
    }

    fn ask(&mut self, name: &str, values: &[(&str, Value)]) -> (Hash, String) {
        self.call(name, values);
        self.answer(name)
    }

    /// Sends a call, which must be answered without an error.
    fn done(&mut self, name: &str, values: &[(&str, Value)]) {
        let (_, messages) = self.ask(name, values);
        assert!(!messages.contains("[error]"), "{name}: {messages}");
    }
}

fn text(text: &str) -> Value {
    Value::Text(text.to_owned())
}

/// The pixels of an answer from top to bottom.
fn rows<const N: usize>(answer: &Hash, key: &str) -> Vec<[u8; N]> {
    let (Some(Value::Int(width)), Some(Value::Bytes(data))) = (answer.get("w"), answer.get(key)) else {
        panic!("{answer:?}")
    };
    let pixels = data.as_chunks::<N>().0;
    pixels.chunks(*width as usize).rev().flatten().copied().collect()
}

#[test]
fn pixels_are_those_of_the_library() {
    let folder = Folder::new(SCENE);
    let target = Target::Device(context());
    let served = server(Some(&folder.path("scene.toml")), target.clone(), PictureKind::Apparent);
    let mut own = Simulation::load(&folder.path("scene.toml"), &target).expect("a scene");
    serving(&served, internals::talk_surrender, |address| {
        let mut client = Client::open(address);
        let (version, _) = client.ask("version", &[]);
        assert!(matches!(version.get("version"), Some(Value::Text(text)) if text.starts_with("isotherm ")));
        let conventions = [("quaternion_convention", Value::Int(1)), ("camera_convention", Value::Int(1))];
        client.done("setConventions", &conventions);
        let (answer, _) = client.ask("getConventions", &[]);
        assert_eq!(answer.get("conventions"), Some(&Value::List(vec![Value::Int(1); 2])));
        for formal in ["closeViewer", "enableDoublePrecisionMode", "enableRaytracing"] {
            client.done(formal, &[]);
        }
        let mesh = [("object_name", text("target")), ("model_name", text("craft")), ("scale", Value::Double(1.0))];
        client.done("createMesh", &mesh);
        client.done("setImageSize", &[("width", Value::Int(64)), ("height", Value::Int(48))]);
        let fov_y = 2.0 * (0.75 * (0.5f64 * 40f64.to_radians()).tan()).atan();
        client
            .done("setCameraFOVRad", &[("fov_x", Value::Double(40f64.to_radians())), ("fov_y", Value::Double(fov_y))]);
        for time in [0.0, 300.0] {
            if time > 0.0 {
                let (answer, _) = client.ask("runLUACode", &[("code", text("isotherm.step_to(300)"))]);
                assert_eq!(answer.get("return"), Some(&Value::Double(300.0)));
            }
            own.step_to(time).expect("it steps");
            for turn in [0.0, 1.3] {
                // The camera stands on a circle around the craft, which is far from the origin and turned.
                let of_craft = DQuat::from_rotation_z(turn) * DQuat::from_rotation_x(0.4 * turn);
                let place = DVec3::new(7e9, -1.2e11, 3e10) * turn;
                let position = DVec3::new(9.0, 8.0, -6.0);
                let pose = Pose::look_at(CameraFrame::Body, position, DVec3::ZERO, DVec3::NEG_Z).expect("a pose");
                let Pose::Given { frame_from_camera, .. } = pose else { panic!("a given pose") };
                let scalar_first = |q: DQuat| Value::list([q.w, q.x, q.y, q.z]);
                let put = |client: &mut Client, name: &str, position: DVec3, attitude: DQuat| {
                    let position = [("object_name", text(name)), ("pos", Value::list(position.to_array()))];
                    client.done("setObjectPosition", &position);
                    client.done(
                        "setObjectAttitude",
                        &[("object_name", text(name)), ("attitude", scalar_first(attitude))],
                    );
                };
                put(&mut client, "target", place, of_craft);
                put(&mut client, "camera", place + of_craft * position, of_craft * frame_from_camera);
                client.done("render", &[]);
                let mut camera = own.camera().expect("a camera").clone();
                (camera.width, camera.height) = (64, 48);
                camera.lens.focal = [32.0 / (20f64.to_radians()).tan(); 2];
                camera.lens.centre = [32.0, 24.0];
                let image = own.image(&camera, &pose).expect("an image");
                let (answer, messages) = client.ask("getImageGray32F", &[]);
                assert_eq!(
                    (answer.get("w"), answer.get("h")),
                    (Some(&Value::Int(64)), Some(&Value::Int(48))),
                    "{messages}"
                );
                let radiance: Vec<f32> = rows::<4>(&answer, "image_data").into_iter().map(f32::from_le_bytes).collect();
                let (answer, _) = client.ask("getDepthMap", &[]);
                let depth: Vec<f64> = rows::<8>(&answer, "depth_data").into_iter().map(f64::from_le_bytes).collect();
                if turn == 0.0 {
                    assert!(radiance == image.radiance, "the same pixels, bit for bit");
                    assert!(depth.iter().zip(&image.depth).all(|(found, own)| *found == f64::from(*own)));
                    assert!(image.depth.iter().filter(|depth| **depth > 0.0).count() > 200);
                } else {
                    // At 1.6e11 m a position has 15 micrometres.
                    let off = radiance.iter().zip(&image.radiance).filter(|(a, b)| (*a - *b).abs() > 1e-2).count();
                    assert!(off < 10, "{off} pixels");
                }
            }
        }
        // A list of channels, all of them the radiance.
        let (answer, _) = client.ask("getImage", &[]);
        assert_eq!(rows::<16>(&answer, "image_data").len(), 64 * 48);
        // What is not done says so, and the session goes on.
        for (name, values, expected) in [
            ("getNormalMap", vec![], "[error] getNormalMap: isotherm does not do this"),
            ("setPSFSigma", vec![("sigma", Value::Double(1.0))], "[warning] setPSFSigma"),
            (
                "createMesh",
                vec![("object_name", text("x")), ("model_name", text("/etc/passwd"))],
                "the scenes here are craft",
            ),
            ("setImageSize", vec![("width", Value::Int(-1))], "[error] setImageSize: 'width'"),
            ("runLUACode", vec![("code", text("os.exit()"))], "no Lua"),
            ("shutdownEverything", vec![], "[error]"),
        ] {
            let (_, messages) = client.ask(name, &values);
            assert!(messages.contains(expected), "{name}: {messages}");
        }
        client.done("reset", &[]);
        assert!(client.ask("getImageGray32F", &[]).1.contains("nothing was rendered"));
        // A second client has a stage of its own.
        let mut other = Client::open(address);
        let (answer, _) = other.ask("exists", &[("object_name", text("target"))]);
        assert_eq!(answer.get("exists"), Some(&Value::Bool(false)));
    });
}

/// Spheres, 8 bits, and calls that have a reason of their own.
#[test]
fn a_sphere_and_pictures_of_8_bits() {
    let folder = Folder::new(SCENE);
    let scene = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("models/sphere.toml");
    let mut served = server(Some(&folder.path("scene.toml")), Target::Reference, PictureKind::Apparent);
    let sphere = isotherm::Scene::load(&scene).expect("a scene");
    served.scenes.add(Some("sphere"), &scene, sphere).expect("a scene that can run");
    serving(&served, internals::talk_surrender, |address| {
        let mut client = Client::open(address);
        let radius = |radius: f64| Value::Hash(Hash::from([("radius".to_owned(), Value::Double(radius))]));
        for (name, size) in [("sun", 7e8), ("earth", 6.4e6)] {
            client.done(
                "createShape",
                &[("name", text(name)), ("filename", text("sphere.shp")), ("parameters", radius(size))],
            );
            client.done(
                "createBody",
                &[("body_name", text(name)), ("shape_name", text(name)), ("brdf_name", text("mate"))],
            );
        }
        client
            .done("setConventions", &[("quaternion_convention", Value::Int(1)), ("camera_convention", Value::Int(1))]);
        client.done("setImageSize", &[("width", Value::Int(64)), ("height", Value::Int(64))]);
        client.done("setCameraFOVDeg", &[("fov_x", Value::Double(30.0)), ("fov_y", Value::Double(30.0))]);
        // The Sun of the scene stands along +X: the camera looks from there, along -X, from 5 radii.
        let half = 0.5f64.sqrt();
        client.done("setObjectPosition", &[("object_name", text("camera")), ("pos", Value::list([3.2e7, 0.0, 0.0]))]);
        client.done(
            "setObjectAttitude",
            &[("object_name", text("camera")), ("attitude", Value::list([half, 0.0, -half, 0.0]))],
        );
        client.done("render", &[]);
        let (answer, _) = client.ask("getDepthMap", &[]);
        let depth: Vec<f64> = rows::<8>(&answer, "depth_data").into_iter().map(f64::from_le_bytes).collect();
        let middle = 32 * 64 + 32;
        assert!((depth[middle] / (3.2e7 - 6.4e6) - 1.0).abs() < 2e-3, "{}", depth[middle]);
        // A sphere of sine 1/5 of its half angle: 0.2041 of the tangent, over tan 15 deg, of half the 64 pixels.
        let across = depth[32 * 64..33 * 64].iter().filter(|depth| **depth > 0.0).count() as f64;
        let expected = 64.0 * (0.2f64.asin().tan() / 15f64.to_radians().tan());
        assert!((across - expected).abs() <= 1.5, "{across} beside {expected}");
        let (grey, _) = client.ask("getImageGray8", &[]);
        let grey = rows::<1>(&grey, "image_data");
        let (colour, _) = client.ask("getImageRGBA8", &[]);
        let colour = rows::<4>(&colour, "image_data");
        // Below the Sun it is in balance: 0.9 x 1361 = 0.95 sigma T^4 gives 388.6 K, and its brightness temperature is less.
        let kelvin = 150.0 + 250.0 * f64::from(grey[middle][0]) / 255.0;
        assert!((375.0..388.0).contains(&kelvin), "{kelvin}");
        assert!(grey.iter().zip(&colour).all(|([grey], colour)| *colour == [*grey, *grey, *grey, 255]));
        assert_eq!(grey[0], [0], "space is black");
        let (_, messages) = client.ask("createSphericalDEM", &[("object_name", text("ceres"))]);
        assert!(messages.contains("[error]") && messages.contains("no terrain"), "{messages}");
        let (_, messages) = client.ask("record", &[]);
        assert!(messages.contains("[warning]"), "{messages}");
        // A mesh by the name that a script has for it.
        client.done(
            "createMesh",
            &[("object_name", text("asteroid")), ("model_name", text("craft")), ("scale", Value::Double(1e3))],
        );
    });
}
