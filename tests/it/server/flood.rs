//! Random and mutated messages on loopback: no panic, no hang, and memory stays.

use std::io::{BufRead, BufReader, ErrorKind, Read, Write};
use std::net::{Shutdown, SocketAddr, TcpStream};
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

use glam::{DMat3, DQuat, DVec3};
use isotherm::internals::{Hash, PictureKind, Talk, Value, write_value};
use isotherm::{Target, internals};

use super::protobuf::{Camera, Fields, body, craft, message};
use super::zmtp::{Requester, opening, request};
use super::{server, serving};
use crate::craft::{Folder, SCENE};
use crate::program::isotherm;
use crate::random::Random;

/// Longest time of a flood.
const LONGEST: Duration = Duration::from_secs(600);

/// Bytes of memory of a process.
fn memory(process: u32) -> u64 {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).expect("the process is there");
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:")).expect("its memory");
    1024 * line.trim().trim_end_matches(" kB").parse::<u64>().expect("a number")
}

/// The message with bytes changed, left out, repeated or replaced.
pub fn mutated(message: &[u8], random: &mut Random) -> Vec<u8> {
    let mut bytes = message.to_vec();
    let below = |random: &mut Random, bound: usize| (random.bits() % bound.max(1) as u64) as usize;
    for _ in 0..=below(random, 4) {
        let at = below(random, bytes.len());
        match below(random, 6) {
            0 => bytes[at] ^= 1 << below(random, 8),
            1 => bytes[at] = [0, 1, 0x7F, 0x80, 0xFF][below(random, 5)],
            2 => bytes.truncate(at.max(1)),
            3 => {
                let end = (at + below(random, 64)).min(bytes.len());
                let part = bytes[at..end].to_vec();
                bytes.splice(at..at, part);
            }
            4 => drop(bytes.splice(at..(at + 9).min(bytes.len()), random.bits().to_be_bytes())),
            _ => bytes[at] = random.bits() as u8,
        }
    }
    bytes
}

pub fn vizard_messages() -> Vec<Vec<u8>> {
    let bodies = [body("earth", DVec3::ZERO, 398_600.0, 6371.0), body("sun", DVec3::X * 1.5e11, 1.327e11, 695_000.0)];
    let at = |name: &str, x: f64| craft(name, DVec3::new(x, 7e6, 0.0), DVec3::X * 7500.0, DQuat::IDENTITY);
    let camera = Camera {
        id: 1,
        size: [16, 12],
        fov_deg: 30.0,
        position: DVec3::ZERO,
        camera_from_body: DMat3::IDENTITY,
        depth: None,
    };
    let model = Fields::default().text(1, "craft").text(2, "target");
    let settings = Fields::default().message(12, &model);
    let update = message(1, 1.0, &bodies, &[at("target", 0.0), at("chaser", 9.0)], &[camera.fields()]);
    let update = update.message(7, &settings).message(8, &Fields::default().int(1, 2019).int(2, 1).int(3, 1));
    vec![
        opening(),
        request(&[b"PING"]),
        request(&[b"SIM_UPDATE", b"", b"", &update.0]),
        request(&[b"REQUEST_IMAGE_1"]),
        request(&[b"REQUEST_INPUT"]),
    ]
}

fn surrender_messages() -> Vec<Vec<u8>> {
    let text = |text: &str| Value::Text(text.to_owned());
    let call = |name: &str, values: &[(&str, Value)]| {
        let mut call = Hash::from([(String::new(), text(name))]);
        call.extend(values.iter().map(|(key, value)| ((*key).to_owned(), value.clone())));
        write_value(&call)
    };
    let name = || ("object_name", text("target"));
    vec![
        call("version", &[]),
        call("setConventions", &[("quaternion_convention", Value::Int(1)), ("camera_convention", Value::Int(0))]),
        call("createMesh", &[name(), ("model_name", text("craft")), ("scale", Value::Double(1.0))]),
        call("setObjectPosition", &[name(), ("pos", Value::list([1.0, 2.0, 3.0]))]),
        call("setObjectAttitude", &[name(), ("attitude", Value::list([1.0, 0.0, 0.0, 0.0]))]),
        call("setImageSize", &[("width", Value::Int(16)), ("height", Value::Int(12))]),
        call("setPSF", &[("psf", Value::Bytes(vec![7; 300])), ("w", Value::Int(5))]),
        call("createBRDF", &[("parameters", Value::Hash(Hash::from([("a".to_owned(), Value::Bool(true))])))]),
        call("render", &[]),
        call("getImageGray32F", &[]),
        call("runLUACode", &[("code", text("isotherm.step_to(1)"))]),
    ]
}

/// Sends messages, each good, mutated or random, on connections that begin anew after some, and reads what comes.
fn flood(address: SocketAddr, good: &[Vec<u8>], first: Option<&[u8]>, count: u32) {
    let mut random = Random(20_261_123);
    let began = Instant::now();
    let mut sent = 0;
    let mut answers = vec![0; 1 << 16];
    while sent < count && began.elapsed() < LONGEST {
        let mut stream = TcpStream::connect(address).expect("the server accepts");
        stream.set_nodelay(true).expect("a setting");
        if let Some(first) = first.filter(|_| !random.bits().is_multiple_of(8)) {
            stream.write_all(first).expect("it takes the opening");
        }
        for _ in 0..1 + random.bits() % 32 {
            let message = &good[(random.bits() % good.len() as u64) as usize];
            let bytes = match random.bits() % 8 {
                0 => (0..random.bits() % 200).map(|_| random.bits() as u8).collect(),
                1 | 2 => message.clone(),
                _ => mutated(message, &mut random),
            };
            sent += 1;
            if stream.write_all(&bytes).is_err() {
                break;
            }
            // What has come so far is read, so that the server never waits for us.
            stream.set_nonblocking(true).expect("a setting");
            let read = stream.read(&mut answers);
            stream.set_nonblocking(false).expect("a setting");
            match read {
                Ok(0) => break,
                Err(error) if error.kind() != ErrorKind::WouldBlock => break,
                _ => {}
            }
        }
        // The server ends the connection when we do, however much it has yet to answer.
        let _ = stream.shutdown(Shutdown::Write);
        stream.set_read_timeout(Some(Duration::from_secs(60))).expect("a setting");
        loop {
            match stream.read(&mut answers) {
                Ok(0) => break,
                Err(error) if error.kind() == ErrorKind::ConnectionReset => break,
                Err(error) => panic!("the server hangs: {error}"),
                Ok(_) => {}
            }
        }
    }
    assert!(sent >= count, "{sent} of {count} messages in {:?}", began.elapsed());
}

/// What is sent: good messages, and the bytes with which a connection opens.
type Messages = (Vec<Vec<u8>>, Option<Vec<u8>>);

/// The server under a flood, and whether it then serves as before.
fn endures(talk: Talk, scene: Option<&Folder>, (good, first): &Messages, count: u32, is_alive: fn(SocketAddr)) {
    let scene = scene.map(|folder| folder.path("scene.toml"));
    let served = server(scene.as_deref(), Target::Reference, PictureKind::Apparent);
    serving(&served, talk, |address| {
        flood(address, good, first.as_deref(), count);
        is_alive(address);
    });
}

/// A program that ends with its test.
struct Program(Child);

impl Drop for Program {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// The program under a flood. It is a process of its own, whose memory no other test changes. No message names its scene, so it makes no images.
fn the_program_endures(protocol: &str, (good, first): &Messages, count: u32, is_alive: fn(SocketAddr)) {
    let folder = Folder::new(SCENE);
    let arguments =
        ["serve", "nobody=scene.toml", "--protocol", protocol, "--device", "cpu", "--listen", "127.0.0.1:0"];
    let mut command = isotherm(folder.0.path(), &arguments);
    let mut program =
        Program(command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().expect("the program starts"));
    let mut line = String::new();
    BufReader::new(program.0.stdout.take().expect("its output")).read_line(&mut line).expect("a line");
    let address = line.trim().strip_prefix("listening on ").expect("an address").parse().expect("an address");
    flood(address, good, first.as_deref(), count / 10);
    is_alive(address);
    let before = memory(program.0.id());
    flood(address, good, first.as_deref(), count);
    is_alive(address);
    let more = memory(program.0.id()).saturating_sub(before);
    assert!(more < 16 << 20, "{more} bytes more after {count} messages");
    println!("{count} messages, {more} bytes more");
}

fn vizard_flood() -> Messages {
    (vizard_messages(), Some(opening()))
}

/// All connections may be in use by clients that the server has yet to give up.
fn some_time_later(answers: impl Fn() -> bool) {
    let alive = (0..100).any(|_| {
        std::thread::sleep(Duration::from_millis(50));
        answers()
    });
    assert!(alive);
}

fn vizard_is_alive(address: SocketAddr) {
    some_time_later(|| {
        TcpStream::connect(address).is_ok() && Requester::open(address).and_then(|mut c| c.ask(&[b"PING"])).is_ok()
    });
}

fn surrender_is_alive(address: SocketAddr) {
    some_time_later(|| {
        let mut stream = TcpStream::connect(address).expect("the server accepts");
        stream.set_read_timeout(Some(Duration::from_secs(5))).expect("a setting");
        let mut answer = [0; 4];
        stream.write_all(&surrender_messages()[0]).is_ok() && stream.read_exact(&mut answer).is_ok()
    });
}

#[test]
fn vizard_endures_malformed_messages() {
    endures(internals::talk_vizard, None, &vizard_flood(), 1000, vizard_is_alive);
    endures(internals::talk_vizard, Some(&Folder::new(SCENE)), &vizard_flood(), 300, vizard_is_alive);
}

#[test]
fn surrender_endures_malformed_messages() {
    let messages = (surrender_messages(), None);
    endures(internals::talk_surrender, None, &messages, 1000, surrender_is_alive);
    endures(internals::talk_surrender, Some(&Folder::new(SCENE)), &messages, 300, surrender_is_alive);
}

#[cfg(target_os = "linux")]
#[test]
#[ignore = "tens of thousands of messages: tools/test --all"]
fn vizard_endures_a_flood() {
    the_program_endures("vizard", &vizard_flood(), 20_000, vizard_is_alive);
}

#[cfg(target_os = "linux")]
#[test]
#[ignore = "tens of thousands of messages: tools/test --all"]
fn surrender_endures_a_flood() {
    the_program_endures("surrender", &(surrender_messages(), None), 20_000, surrender_is_alive);
}

/// One client's malformed bytes leave the session of another as it is.
#[test]
fn sessions_are_apart() {
    let served = server(None, Target::Reference, PictureKind::Apparent);
    serving(&served, internals::talk_vizard, |address| {
        let mut client = Requester::open(address).expect("a connection");
        for bytes in [
            &b"GET / HTTP/1.1\r\n\r\nGET / HTTP/1.1\r\n\r\nGET / HTTP/1.1\r\n\r\nGET / HTTP/1.1\r\n\r\n"[..],
            // A frame of 2^62 bytes, and one of 1 GiB.
            &[&opening()[..], &[2, 0x40, 0, 0, 0, 0, 0, 0, 0]].concat(),
            &[&opening()[..], &[2, 0, 0, 0, 0, 0x40, 0, 0, 0, 1]].concat(),
            &[&opening()[..], &[0x80, 0]].concat(),
        ] {
            let mut other = TcpStream::connect(address).expect("a connection");
            other.write_all(bytes).expect("it takes them");
            other.set_read_timeout(Some(Duration::from_secs(20))).expect("a setting");
            let mut rest = Vec::new();
            // The server ends this connection, with or without a reset.
            let end = other.read_to_end(&mut rest);
            assert!(end.is_ok() || end.is_err_and(|error| error.kind() == ErrorKind::ConnectionReset));
            assert_eq!(client.ask(&[b"PING"]).expect("an answer"), [b"PONG"]);
        }
        // A client that stops inside a message is given up.
        let mut slow = Requester::open(address).expect("a connection");
        slow.0.write_all(&[1, 0, 0]).expect("it takes them");
        let mut rest = Vec::new();
        slow.0.read_to_end(&mut rest).expect("the end of the connection");
        assert_eq!(client.ask(&[b"PING"]).expect("an answer"), [b"PONG"]);
    });
}
