//! Hostile clients of the program, each under a limit of its memory: their work ends, and an honest client is served beside them.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use glam::{DMat3, DQuat, DVec3};
use isotherm::internals::{Hash, Value, write_value};

use super::protobuf::{Camera, Fields, body, craft, message};
use super::zmtp::{Requester, opening};
use crate::craft::{Folder, SCENE};

/// Longest wait for an answer that must come at once. A machine under load takes some of it.
/// Size of the honest client's image.
pub const SIZE: [u64; 2] = [32, 24];
const SOON: Duration = Duration::from_secs(20);

/// A server as a process of its own.
pub struct Program {
    pub child: Child,
    pub address: SocketAddr,
    folder: Folder,
}

impl Program {
    /// Serves `craft` with at most 3 GiB of address space.
    pub fn start(protocol: &str, more: &[&str]) -> Self {
        Self::serve(SCENE, protocol, more)
    }

    /// The same of another scene.
    fn serve(scene: &str, protocol: &str, more: &[&str]) -> Self {
        let folder = Folder::new(scene);
        let mut command = Command::new("sh");
        command.args(["-c", "ulimit -v 3145728; exec \"$0\" \"$@\"", env!("CARGO_BIN_EXE_isotherm")]);
        command.args(["serve", "craft=scene.toml", "--protocol", protocol, "--device", "cpu"]);
        command.args(["--listen", "127.0.0.1:0", "--log", "requests.log"]).args(more).current_dir(folder.0.path());
        let said = std::fs::File::create(folder.path("said")).expect("a file");
        let mut child = command.stdout(Stdio::piped()).stderr(said).spawn().expect("the program starts");
        let mut line = String::new();
        BufReader::new(child.stdout.take().expect("its output")).read_line(&mut line).expect("a line");
        let address = line.trim().strip_prefix("listening on ").expect("an address").parse().expect("an address");
        Self { child, address, folder }
    }

    fn open(&self) -> Requester {
        let client = Requester::open(self.address).expect("a connection");
        client.0.set_read_timeout(Some(SOON)).expect("a setting");
        client
    }

    /// Waits until the log has a line.
    fn logs(&self, text: &str) -> bool {
        let began = Instant::now();
        while began.elapsed() < SOON {
            if std::fs::read_to_string(self.folder.path("requests.log")).is_ok_and(|log| log.contains(text)) {
                return true;
            }
            std::thread::sleep(Duration::from_millis(50));
        }
        false
    }

    fn said(&self) -> String {
        std::fs::read_to_string(self.folder.path("said")).expect("messages")
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A message of a circular orbit round a planet of a gravitational parameter [km3/s2].
pub fn state(frame: i64, time: f64, mu: f64, size: [u64; 2], names: &[&str]) -> Fields {
    let bodies = [body("earth", DVec3::ZERO, mu, 6371.0), body("sun", DVec3::X * 1.5e11, 1.327e11, 695_000.0)];
    let angle = 7546.0 / 7e6 * (time % 5828.0);
    let (sin, cos) = angle.sin_cos();
    let (position, velocity) = (7e6 * DVec3::new(cos, sin, 0.0), 7546.0 * DVec3::new(-sin, cos, 0.0));
    let at = |name: &&str| craft(name, position, velocity, DQuat::IDENTITY);
    let mut all: Vec<Fields> = names.iter().map(at).collect();
    all.push(craft("chaser", position - 20.0 * DVec3::Z, velocity, DQuat::IDENTITY));
    let (position, camera_from_body) = (DVec3::ZERO, DMat3::IDENTITY);
    let camera = Camera { id: 0, size, fov_deg: 30.0, position, camera_from_body, depth: None };
    let mut settings = Fields::default();
    for name in names {
        settings = settings.message(12, &Fields::default().text(1, "craft").text(2, name));
    }
    message(frame, time, &bodies, &all, &[camera.fields()]).message(7, &settings)
}

fn update(client: &mut Requester, message: &Fields) {
    let answer = client.ask(&[b"SIM_UPDATE", b"", b"", &message.0]).expect("an answer");
    assert_eq!(answer, [b"OK"]);
}

/// The Earth [km3/s2].
pub const MU: f64 = 398_600.441_8;

/// An honest client gets its image.
fn serves(program: &Program) {
    let mut client = program.open();
    update(&mut client, &state(1, 1.0, MU, SIZE, &["target"]));
    update(&mut client, &state(2, 61.0, MU, SIZE, &["target"]));
    assert!(client.image(0).len() > 60, "{}", program.said());
}

/// At 1e17 s a sum of steps of one second stays where it is.
#[test]
fn a_time_beyond_reason_takes_neither_memory_nor_time() {
    let program = Program::start("vizard", &[]);
    let mut hostile = program.open();
    update(&mut hostile, &state(1, 1e17, MU, SIZE, &["target"]));
    update(&mut hostile, &state(2, 1e17 + 1e5, MU, SIZE, &["target"]));
    for (frame, time) in [(1, 1e17), (2, 1e17 + 1e6), (3, f64::MAX), (4, f64::NAN), (5, 1.01e11)] {
        update(&mut hostile, &state(frame, time, MU, SIZE, &["target"]));
        assert_eq!(hostile.image(0), b"", "at {time} s");
    }
    assert!(program.said().contains("limit of 1e11 s"), "{}", program.said());
    serves(&program);
    // The latest time of all is served.
    update(&mut hostile, &state(1, 9.9e10, MU, SIZE, &["target"]));
    assert!(hostile.image(0).len() > 60, "{}", program.said());
}

/// A gravitational parameter that asks for 2e9 steps of the integration.
#[test]
fn a_planet_beyond_reason_starts_no_integration() {
    let program = Program::start("vizard", &[]);
    for mu in [1e20, 1e30, 1e60] {
        let mut hostile = program.open();
        update(&mut hostile, &state(1, 1.0, mu, SIZE, &["target"]));
        update(&mut hostile, &state(2, 1.0 + 5.9e6, mu, SIZE, &["target"]));
        assert_eq!(hostile.image(0), b"");
    }
    assert!(program.said().contains("steps of its integration"), "{}", program.said());
    serves(&program);
}

/// A call of the other protocol.
fn call(name: &str, values: &[(&str, Value)]) -> Vec<u8> {
    let mut call = Hash::from([(String::new(), Value::Text(name.to_owned()))]);
    call.extend(values.iter().map(|(key, value)| ((*key).to_owned(), value.clone())));
    write_value(&call)
}

/// A client asks for a thousand million steps and goes.
#[test]
fn work_ends_with_the_client_that_waits_for_it() {
    let program = Program::start("surrender", &[]);
    let text = |text: &str| Value::Text(text.to_owned());
    let mut hostile = TcpStream::connect(program.address).expect("a connection");
    let client = hostile.local_addr().expect("its address");
    let mesh = [("object_name", text("target")), ("model_name", text("craft")), ("scale", Value::Double(1.0))];
    hostile.write_all(&call("createMesh", &mesh)).expect("it takes a call");
    hostile.write_all(&call("runLUACode", &[("code", text("isotherm.step_to(900000000)"))])).expect("it takes a call");
    assert!(program.logs(&format!("{client} runLUACode")), "the call begins");
    // A call that waits behind it hides the end of the connection from a read.
    hostile.write_all(&call("version", &[])).expect("it takes a call");
    drop(hostile);
    assert!(program.logs(&format!("{client} end")), "{}", program.said());
}

/// A client asks for a craft whose rays take minutes, and goes.
#[test]
fn a_craft_is_prepared_only_as_long_as_its_client_waits() {
    let slow = crate::craft::scene_with(&[("[radiance]", "[exchange]\npatch_edge = 0.2\nrays = 60000\n[radiance]")]);
    let program = Program::serve(&slow, "surrender", &[]);
    let mut hostile = TcpStream::connect(program.address).expect("a connection");
    let client = hostile.local_addr().expect("its address");
    let names = [("object_name", "target"), ("model_name", "craft")];
    let mut mesh: Vec<_> = names.iter().map(|(key, name)| (*key, Value::Text((*name).to_owned()))).collect();
    mesh.push(("scale", Value::Double(1.0)));
    hostile.write_all(&call("createMesh", &mesh)).expect("it takes a call");
    assert!(program.logs(&format!("{client} createMesh")), "the call begins");
    std::thread::sleep(Duration::from_secs(1));
    drop(hostile);
    assert!(program.logs(&format!("{client} end")), "{}", program.said());
}

/// Sixteen clients that connect and say nothing, or only half a greeting.
#[test]
fn silent_clients_shut_nobody_out() {
    let program = Program::start("vizard", &[]);
    let mut silent: Vec<TcpStream> =
        (0..16).map(|_| TcpStream::connect(program.address).expect("a connection")).collect();
    silent.iter_mut().step_by(2).for_each(|client| client.write_all(&opening()[..20]).expect("it takes them"));
    std::thread::sleep(Duration::from_secs(12));
    serves(&program);
    let mut rest = Vec::new();
    silent[0].set_read_timeout(Some(SOON)).expect("a setting");
    silent[0].read_to_end(&mut rest).expect("the end of the connection");
}

/// Memory of a process [bytes], from a line of its status.
pub fn memory(process: u32, name: &str) -> u64 {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).expect("the process is there");
    let line = status.lines().find_map(|line| line.strip_prefix(name)).expect("its memory");
    1024 * line.trim().trim_end_matches(" kB").parse::<u64>().expect("a number")
}

/// Eight craft in an image of 16 million pixels, in either protocol.
#[test]
fn a_session_has_a_share_of_the_memory() {
    let program = Program::start("vizard", &["--max-memory", "400MiB"]);
    let mut hostile = program.open();
    let names = ["a", "b", "c", "d", "e", "f", "g", "h"];
    update(&mut hostile, &state(1, 1.0, MU, [4096, 4096], &names));
    assert_eq!(hostile.image(0), b"");
    let said = program.said();
    assert!(said.contains("an image of 4096 x 4096 pixels of 8 craft needs") && said.contains("a session"), "{said}");
    update(&mut hostile, &state(2, 2.0, MU, [400, 300], &names));
    assert!(hostile.image(0).len() > 60, "{}", program.said());
    serves(&program);
    let peak = memory(program.child.id(), "VmHWM:");
    assert!(peak < 400 << 20, "{peak} bytes");
}

#[test]
fn an_image_beyond_the_memory_is_refused_before_it_is_drawn() {
    let folder =
        Folder::new(&crate::craft::scene_with(&[("width = 96", "width = 16384"), ("height = 72", "height = 16384")]));
    for budget in [&["--max-memory", "2GiB"][..], &[]] {
        let mut command = Command::new("sh");
        command.args(["-c", "ulimit -v 3145728; exec \"$0\" \"$@\"", env!("CARGO_BIN_EXE_isotherm")]);
        command.args(["render", "scene.toml", "--time", "60", "-o", "a.exr", "--device", "cpu"]).args(budget);
        let output = command.current_dir(folder.0.path()).output().expect("it starts");
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(said.contains("error: an image of 16384 x 16384 pixels needs"), "{said}");
    }
}
