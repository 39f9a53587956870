//! Makes cases from valid seeds: numbers, lines, bytes and pieces of other seeds replaced, or noise.

use isotherm_tools::random;

/// Random choices. The same seed gives the same cases everywhere.
pub struct Random(random::Random);

impl Random {
    pub fn new(seed: u64) -> Self {
        Self(random::Random(seed))
    }

    pub fn next(&mut self) -> u64 {
        self.0.bits()
    }

    /// A number below `end`, or 0 where `end` is 0.
    pub fn below(&mut self, end: usize) -> usize {
        (self.next() % (end.max(1) as u64)) as usize
    }

    pub fn pick<'a, T>(&mut self, from: &'a [T]) -> &'a T {
        &from[self.below(from.len())]
    }
}

/// Texts that stand where a number stood.
const NUMBERS: [&str; 34] = [
    "0",
    "-0",
    "-1",
    "1",
    "0.5",
    "1e-50",
    "5e-324",
    "2.2e-308",
    "1e-38",
    "1e38",
    "3.5e38",
    "1e308",
    "1.8e308",
    "1e999",
    "-1e308",
    "inf",
    "-inf",
    "nan",
    "NaN",
    "+1",
    "1.0",
    "1.",
    ".5",
    "0x7f",
    "1_000",
    "4294967295",
    "4294967296",
    "9223372036854775807",
    "18446744073709551616",
    "-2147483649",
    "1e9",
    "1e19",
    "",
    "--",
];
/// Pieces that mean something to one of the readers.
const PIECES: [&str; 30] = [
    "\n",
    "\r",
    "\0",
    "\u{feff}",
    "\"",
    "'",
    "[",
    "]",
    "{",
    "}",
    "=",
    ",",
    "#",
    "..",
    "/",
    "\\",
    "\\u0000",
    "%00",
    "é",
    "\u{202e}",
    "<a>",
    "</a>",
    "<!--",
    "&#0;",
    "[[",
    "]]",
    "{x=1}",
    "true",
    "null",
    "2023-13-45T99:99:99",
];
/// Pieces that are repeated until a case is deep or long.
const NESTS: [&str; 8] = ["[", "{\"a\":", "(", "<a>", "-", "a=", "1,", "(s+"];

/// A case from the seeds.
pub fn case(seeds: &[Vec<u8>], random: &mut Random) -> Vec<u8> {
    if random.below(50) == 0 {
        return (0..random.below(400)).map(|_| random.next() as u8).collect();
    }
    let mut bytes = random.pick(seeds).clone();
    for _ in 0..=random.below(4) {
        change(&mut bytes, seeds, random);
    }
    bytes
}

fn change(bytes: &mut Vec<u8>, seeds: &[Vec<u8>], random: &mut Random) {
    let at = random.below(bytes.len() + 1);
    match random.below(100) {
        0..=39 => replace_number(bytes, at, random.pick(&NUMBERS).as_bytes()),
        40..=54 => {
            if let Some(byte) = bytes.get_mut(at) {
                *byte ^= 1 << random.below(8);
            }
        }
        55..=66 => insert(bytes, at, random.pick(&PIECES).as_bytes()),
        67..=76 => {
            let line = line(bytes, at);
            bytes.drain(line);
        }
        77..=84 => {
            let copy = bytes[line(bytes, at)].to_vec();
            let to = line(bytes, random.below(bytes.len() + 1)).start;
            insert(bytes, to, &copy);
        }
        85..=92 => {
            let other = random.pick(seeds);
            let from = random.below(other.len() + 1);
            let piece = &other[from..(from + random.below(120)).min(other.len())];
            insert(bytes, at, piece);
        }
        93..=97 => bytes.truncate(at),
        98 => {
            let piece = random.pick(&NESTS).repeat(1 << random.below(9));
            insert(bytes, at, piece.as_bytes());
        }
        _ => {
            let end = (at + random.below(30)).min(bytes.len());
            bytes.drain(at..end);
        }
    }
}

fn insert(bytes: &mut Vec<u8>, at: usize, piece: &[u8]) {
    bytes.splice(at..at, piece.iter().copied());
}

/// Replaces the first number at or after `at`.
fn replace_number(bytes: &mut Vec<u8>, at: usize, number: &[u8]) {
    let Some(first) = (at..bytes.len()).find(|i| bytes[*i].is_ascii_digit()) else { return };
    let is_part = |byte: &u8| byte.is_ascii_digit() || matches!(byte, b'.' | b'e' | b'E' | b'-' | b'+');
    let begin = bytes[..first].iter().rposition(|byte| !is_part(byte)).map_or(0, |before| before + 1);
    let end = bytes[first..].iter().position(|byte| !is_part(byte)).map_or(bytes.len(), |length| first + length);
    bytes.splice(begin..end, number.iter().copied());
}

/// The line around `at`, with its end.
fn line(bytes: &[u8], at: usize) -> std::ops::Range<usize> {
    let begin = bytes[..at].iter().rposition(|byte| *byte == b'\n').map_or(0, |before| before + 1);
    let end = bytes[at..].iter().position(|byte| *byte == b'\n').map_or(bytes.len(), |length| at + length + 1);
    begin..end
}
