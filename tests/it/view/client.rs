//! A session of `isotherm view`, a page of it without a browser, and the images of the façade that the page is held against.

use std::net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use isotherm::internals::{ViewError, ViewSession};
use isotherm::{Image, Pose, Scene, Simulation, Target};
use serde_json::{Value, json};
use tungstenite::{Message, WebSocket};

use crate::craft::Folder;

/// Longest wait for an answer.
pub const PATIENCE: Duration = Duration::from_secs(60);

/// Largest difference between a temperature of the page and of the façade [K].
pub const TOLERANCE: f32 = 0.05;

/// A session on a free port. It ends with the value.
pub struct Server {
    pub address: SocketAddr,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<Result<(), ViewError>>>,
}

impl Server {
    pub fn new(folder: &Folder, target: &Target) -> Self {
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

    pub fn end(mut self) {
        self.stop.store(true, Ordering::Relaxed);
        let ended = self.thread.take().expect("a thread").join().expect("no panic");
        ended.expect("it ends in order");
    }
}

/// A page without a browser.
pub struct Page {
    pub socket: WebSocket<TcpStream>,
    pub hello: Value,
    pub texts: Vec<Value>,
}

/// An image as the page reads it.
pub struct Received {
    pub header: Value,
    pub planes: Vec<(String, Vec<f64>)>,
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

    pub fn plane(&self, name: &str) -> &[f64] {
        &self.planes.iter().find(|(known, _)| known == name).unwrap_or_else(|| panic!("no plane {name}")).1
    }

    pub fn step(&self) -> u64 {
        self.header["step"].as_u64().expect("a step")
    }

    /// Largest difference of the temperatures to those of an image [K]. Parts and materials are equal.
    pub fn difference(&self, image: &Image) -> f32 {
        let labels = |values: &[f64]| values.iter().map(|value| *value as u32).collect::<Vec<_>>();
        assert_eq!(labels(self.plane("part")), image.part);
        assert_eq!(labels(self.plane("material")), image.material);
        let pairs = self.plane("temperature").iter().zip(&image.temperature);
        pairs.map(|(a, b)| (*a as f32 - b).abs()).fold(0.0, f32::max)
    }
}

impl Page {
    pub fn open(address: SocketAddr) -> Self {
        let stream = TcpStream::connect(address).expect("a connection");
        stream.set_read_timeout(Some(PATIENCE)).expect("a timeout");
        let (socket, _) = tungstenite::client(format!("ws://{address}/stream"), stream).expect("a WebSocket");
        let mut page = Self { socket, hello: Value::Null, texts: Vec::new() };
        page.hello = page.text("hello");
        page
    }

    pub fn ask(&mut self, request: &Value) {
        self.socket.send(Message::text(request.to_string())).expect("it is sent");
    }

    /// The next image. Texts before it are kept.
    pub fn image(&mut self) -> Received {
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
    pub fn text(&mut self, kind: &str) -> Value {
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
    pub fn image_where(&mut self, condition: impl Fn(&Received) -> bool) -> Received {
        loop {
            let image = self.image();
            if condition(&image) {
                return image;
            }
        }
    }

    pub fn seek(&mut self, step: u64) -> Received {
        self.ask(&json!({ "do": "seek", "time": 60.0 * step as f64 }));
        self.image_where(|image| image.step() == step)
    }
}

/// Images of the façade at the ends of steps.
pub fn images(folder: &Folder, target: &Target, steps: &[u64], pose: &Pose) -> Vec<Image> {
    let mut simulation = Simulation::load(&folder.path("scene.toml"), target).expect("a simulation");
    let camera = simulation.camera().expect("a camera").clone();
    let image = |step: &u64| {
        simulation.step_to(60.0 * *step as f64).expect("it steps");
        simulation.image(&camera, pose).expect("an image")
    };
    steps.iter().map(image).collect()
}

pub fn expected(folder: &Folder, target: &Target, step: u64, pose: &Pose) -> Image {
    images(folder, target, &[step], pose).remove(0)
}
