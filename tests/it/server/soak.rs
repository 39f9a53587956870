//! Sixteen hostile clients and an honest one, for as long as `ISOTHERM_SOAK_S` says [s]: the images of the honest one arrive, and memory stays.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

use super::bounds::{MU, Program, SIZE, memory, state};
use super::flood::{mutated, vizard_messages};
use super::zmtp::{Requester, opening, request};
use crate::random::Random;

const HOSTILE: u64 = 16;
/// Time between two images of the honest client.
const PAUSE: Duration = Duration::from_millis(200);
/// Tricks that hostile clients play to their end at least, and how much longer than asked a busy machine waits for them.
const PLAYED: u64 = 10;
const LONGER: Duration = Duration::from_secs(60);
/// Longest time that a hostile client gives to one trick.
const TRICK: Duration = Duration::from_secs(15);
/// Memory that the program may take [bytes], and by which it may grow after its first third.
const BUDGET: u64 = 600 << 20;
const GROWTH: u64 = 48 << 20;
const TRICKS: [&str; 10] = [
    "silent",
    "half a greeting",
    "late",
    "heavy planet",
    "8 large images",
    "gap and gone",
    "mutated",
    "pings",
    "deaf",
    "large",
];

type Tried = std::io::Result<()>;

/// One trick of a hostile client. Refusals and lost connections are part of it.
fn trick(program: &Program, number: usize, random: &mut Random) -> Tried {
    let mut raw = TcpStream::connect(program.address)?;
    raw.set_read_timeout(Some(TRICK))?;
    raw.set_write_timeout(Some(TRICK))?;
    if number < 2 {
        raw.write_all(&opening()[..number * 30])?;
        return raw.read_to_end(&mut Vec::new()).map(drop);
    }
    drop(raw);
    let mut client = Requester::open(program.address)?;
    client.0.set_read_timeout(Some(TRICK))?;
    client.0.set_write_timeout(Some(TRICK))?;
    let mut send = |frame, time, mu, side: u64, names: &[&str]| {
        let message = state(frame, time, mu, [side, side], names);
        client.ask(&[b"SIM_UPDATE", b"", b"", &message.0]).map(drop)
    };
    match number {
        2 => {
            send(1, 1e17, MU, 32, &["a"])?;
            send(2, 1e17 + 1e5, MU, 32, &["a"])
        }
        3 => {
            send(1, 1.0, 1e40, 32, &["a"])?;
            send(2, 5e6, 1e40, 32, &["a"])
        }
        4 | 8 | 9 => {
            let (side, names) =
                [(4000, &["a", "b", "c", "d", "e", "f", "g", "h"][..]), (800, &["a"])][usize::from(number > 4)];
            send(1, 1.0, MU, side, names)?;
            client.0.write_all(&request(&[b"REQUEST_IMAGE_0"]))?;
            if number == 8 {
                std::thread::sleep(Duration::from_secs(2));
                return Ok(());
            }
            client.answer().map(drop)
        }
        5 => {
            send(1, 1.0, MU, 32, &["a"])?;
            let message = state(2, 5.9e6, MU, [32, 32], &["a"]);
            client.0.write_all(&request(&[b"SIM_UPDATE", b"", b"", &message.0]))?;
            std::thread::sleep(Duration::from_millis(200));
            Ok(())
        }
        6 => {
            let good = vizard_messages();
            for _ in 0..20 {
                let message = &good[(random.bits() % good.len() as u64) as usize];
                client.0.write_all(&mutated(message, random))?;
            }
            Ok(())
        }
        _ => (0..200).try_for_each(|_| client.ask(&[b"PING"]).map(drop)),
    }
}

/// What the honest client saw: the number of its images, and the longest wait for one.
#[derive(Default)]
struct Honest {
    images: u64,
    longest: Duration,
}

impl Honest {
    fn ask(&mut self, client: &mut Requester, frame: i64) {
        let began = Instant::now();
        let message = state(frame, 0.5 * frame as f64, MU, SIZE, &["target"]);
        let answer = client.ask(&[b"SIM_UPDATE", b"", b"", &message.0]).expect("an answer");
        assert_eq!(answer, [b"OK"]);
        assert!(client.image(0).len() > 60, "image {frame}");
        self.images += 1;
        self.longest = self.longest.max(began.elapsed());
    }
}

#[cfg(target_os = "linux")]
#[test]
fn an_honest_client_is_served_beside_sixteen_hostile_ones() {
    let seconds = std::env::var("ISOTHERM_SOAK_S").map_or(8.0, |text| text.parse().expect("a number of seconds"));
    let whole = Duration::from_secs_f64(seconds);
    let program = Program::start("vizard", &["--max-memory", "600MiB"]);
    let mut client = Requester::open(program.address).expect("a connection");
    let over = AtomicBool::new(false);
    let done: [AtomicU64; TRICKS.len()] = Default::default();
    let played = || done[2..].iter().map(|done| done.load(Ordering::Relaxed)).sum::<u64>();
    let mut honest = Honest::default();
    let mut samples: Vec<u64> = Vec::new();
    let began = Instant::now();
    std::thread::scope(|threads| {
        /// Ends the hostile clients also where the honest one fails.
        struct Over<'s>(&'s AtomicBool);
        impl Drop for Over<'_> {
            fn drop(&mut self) {
                self.0.store(true, Ordering::Relaxed);
            }
        }
        let _over = Over(&over);
        for hostile in 0..HOSTILE {
            let (program, over, done) = (&program, &over, &done);
            threads.spawn(move || {
                let mut random = Random(30 + hostile);
                while !over.load(Ordering::Relaxed) {
                    let number = (random.bits() % TRICKS.len() as u64) as usize;
                    if trick(program, number, &mut random).is_ok() {
                        done[number].fetch_add(1, Ordering::Relaxed);
                    } else {
                        std::thread::sleep(Duration::from_millis(100));
                    }
                }
            });
        }
        for frame in 1.. {
            honest.ask(&mut client, frame);
            samples.push(memory(program.child.id(), "VmRSS:"));
            if began.elapsed() > whole && (played() > PLAYED || began.elapsed() > whole + LONGER) {
                break;
            }
            std::thread::sleep(PAUSE);
        }
    });
    let most = |part: &[u64]| part.iter().copied().max().unwrap_or_default();
    let (early, late) = (most(&samples[..samples.len().div_ceil(3)]), most(&samples[samples.len() / 3..]));
    let peak = memory(program.child.id(), "VmHWM:");
    let took = began.elapsed().as_secs_f64();
    println!("{} images in {took:.1} s, the longest wait {:.2} s", honest.images, honest.longest.as_secs_f64());
    println!(
        "memory at most {} MiB in the first third, {} MiB after it; peak {} MiB",
        early >> 20,
        late >> 20,
        peak >> 20
    );
    for (name, done) in TRICKS.iter().zip(&done) {
        println!("{name}: {}", done.load(Ordering::Relaxed));
    }
    assert!(played() > PLAYED, "the hostile clients came to nothing");
    assert!(peak < BUDGET, "{peak} bytes");
    assert!(seconds < 60.0 || late < early + GROWTH, "{early} and then {late} bytes");
    assert!(honest.images as f64 > 0.3 * took, "{} images", honest.images);
}
