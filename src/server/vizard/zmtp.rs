//! The server's end of ZeroMQ's wire protocol (ZMTP 3.1, <https://rfc.zeromq.org/spec/23/>) for a REP socket without security.
//!
//! No library serves. The crate `zeromq` 0.7 reserves as many bytes as a frame states, so that nine bytes of a client end the process, and knows
//! neither a limit of sizes nor a time limit for the handshake. The C++ library has both limits, but needs a C++ compiler, and its code would read
//! bytes of strangers. A REP socket that speaks to each client on its own connection needs no more than this file.

use crate::server::connection::Connection;
use crate::server::error::ConnectionEnd;

/// Most bytes of a message. A real message has some kilobytes.
pub(crate) const MOST_BYTES: usize = 1 << 20;
/// Most frames of a message. A real message has five.
const MOST_FRAMES: usize = 16;
/// Bytes of a greeting.
const GREETING: usize = 64;

const MORE: u8 = 1;
const LONG: u8 = 2;
const COMMAND: u8 = 4;

/// A frame: its flags and its body.
struct ZmtpFrame {
    flags: u8,
    body: Vec<u8>,
}

/// A request: the envelope that leads the answer back, and the frames of the message.
pub(crate) struct ZmtpRequest {
    envelope: Vec<Vec<u8>>,
    pub(crate) frames: Vec<Vec<u8>>,
}

/// Greets a client and agrees on the socket types.
///
/// # Errors
/// A client that speaks another protocol, version or security, or that waits too long.
pub(crate) fn greet(connection: &mut Connection) -> Result<(), ConnectionEnd> {
    connection.send(&greeting())?;
    connection.begin_message(MOST_BYTES)?;
    let theirs = connection.array::<GREETING>()?;
    if theirs[0] != 0xFF || theirs[9] & 1 == 0 {
        return Err(ConnectionEnd::Malformed("this is no greeting of ZeroMQ".to_owned()));
    }
    if theirs[10] < 3 {
        return Err(ConnectionEnd::Malformed(format!("ZMTP {} is too old, 3.0 is needed", theirs[10])));
    }
    let mechanism = theirs[12..32].split(|byte| *byte == 0).next().unwrap_or_default();
    if mechanism != b"NULL" {
        let name = String::from_utf8_lossy(mechanism);
        return Err(ConnectionEnd::Malformed(format!("the security mechanism {name} is unknown; only NULL is")));
    }
    let properties = [(&b"Socket-Type"[..], &b"REP"[..]), (b"Identity", b"")];
    connection.send(&ready(&properties))?;
    let ready = frame(connection)?;
    let socket = Some(&ready.body).filter(|_| ready.flags & COMMAND != 0).and_then(|body| socket_type(body));
    match socket {
        Some(b"REQ" | b"DEALER") => Ok(()),
        Some(other) => {
            Err(ConnectionEnd::Malformed(format!("a {} socket can not ask", String::from_utf8_lossy(other))))
        }
        None => Err(ConnectionEnd::Malformed("the client does not say what kind of socket it is".to_owned())),
    }
}

fn greeting() -> [u8; GREETING] {
    let mut greeting = [0; GREETING];
    (greeting[0], greeting[9]) = (0xFF, 0x7F);
    greeting[10..12].copy_from_slice(&[3, 1]);
    greeting[12..16].copy_from_slice(b"NULL");
    greeting
}

/// The frame of the command READY.
fn ready(properties: &[(&[u8], &[u8])]) -> Vec<u8> {
    let mut body = b"\x05READY".to_vec();
    for (name, value) in properties {
        body.push(name.len() as u8);
        body.extend_from_slice(name);
        body.extend((value.len() as u32).to_be_bytes());
        body.extend_from_slice(value);
    }
    let mut bytes = vec![COMMAND, body.len() as u8];
    bytes.extend(body);
    bytes
}

/// The property `Socket-Type` of the command READY. `None` in anything else.
fn socket_type(body: &[u8]) -> Option<&[u8]> {
    let mut rest = body.strip_prefix(b"\x05READY")?;
    while let [length, after @ ..] = rest {
        let (name, after) = after.split_at_checked(usize::from(*length))?;
        let (length, after) = after.split_first_chunk::<4>()?;
        let (value, after) = after.split_at_checked(u32::from_be_bytes(*length) as usize)?;
        if name.eq_ignore_ascii_case(b"Socket-Type") {
            return Some(value);
        }
        rest = after;
    }
    None
}

fn frame(connection: &mut Connection) -> Result<ZmtpFrame, ConnectionEnd> {
    connection.begin_message(MOST_BYTES)?;
    frame_within(connection)
}

/// A frame of a message that has begun.
fn frame_within(connection: &mut Connection) -> Result<ZmtpFrame, ConnectionEnd> {
    let [flags] = connection.array()?;
    if flags & !(MORE | LONG | COMMAND) != 0 || flags & (MORE | COMMAND) == MORE | COMMAND {
        return Err(ConnectionEnd::Malformed(format!("a frame has the flags {flags:#04x}")));
    }
    let length = if flags & LONG == 0 {
        u64::from(connection.array::<1>()?[0])
    } else {
        u64::from_be_bytes(connection.array()?)
    };
    Ok(ZmtpFrame { flags, body: connection.take(length)? })
}

/// The next request. Commands between requests are answered on the way.
///
/// # Errors
/// Bytes that are no message, a message that is too long, or a client that has gone.
pub(crate) fn receive(connection: &mut Connection) -> Result<ZmtpRequest, ConnectionEnd> {
    connection.begin_message(MOST_BYTES)?;
    let mut frames = Vec::new();
    loop {
        let ZmtpFrame { flags, body } = frame_within(connection)?;
        if flags & COMMAND != 0 {
            // A heartbeat carries a time to live of two bytes and up to 16 bytes that come back.
            if let Some(context) = body.strip_prefix(b"\x04PING").and_then(|rest| rest.get(2..)) {
                let body = [b"\x04PONG", &context[..context.len().min(16)]].concat();
                connection.send(&[&[COMMAND, body.len() as u8], &body[..]].concat())?;
            }
            if frames.is_empty() {
                connection.begin_message(MOST_BYTES)?;
            }
            continue;
        }
        if frames.len() == MOST_FRAMES {
            return Err(ConnectionEnd::Malformed(format!("a message has more than {MOST_FRAMES} frames")));
        }
        frames.push(body);
        if flags & MORE == 0 {
            break;
        }
    }
    match frames.iter().position(Vec::is_empty) {
        Some(delimiter) if delimiter + 1 < frames.len() => {
            let message = frames.split_off(delimiter + 1);
            Ok(ZmtpRequest { envelope: frames, frames: message })
        }
        _ => Err(ConnectionEnd::Malformed("a request lacks its empty frame".to_owned())),
    }
}

/// Answers a request.
///
/// # Errors
/// A client that has gone.
pub(crate) fn answer(
    connection: &mut Connection,
    request: &ZmtpRequest,
    frames: &[Vec<u8>],
) -> Result<(), ConnectionEnd> {
    let all = request.envelope.iter().chain(frames);
    let count = request.envelope.len() + frames.len();
    let mut bytes = Vec::new();
    for (number, body) in all.enumerate() {
        let more = if number + 1 < count { MORE } else { 0 };
        match u8::try_from(body.len()) {
            Ok(length) => bytes.extend([more, length]),
            Err(_) => {
                bytes.push(more | LONG);
                bytes.extend((body.len() as u64).to_be_bytes());
            }
        }
        bytes.extend_from_slice(body);
    }
    connection.send(&bytes)
}
