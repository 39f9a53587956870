//! A connection whose client can neither wait for ever inside a message nor send more than a message may hold.

use std::io::{ErrorKind, Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

use super::error::ConnectionEnd;
use super::sessions::Session;

/// How often a wait looks whether the server stops.
const LOOK: Duration = Duration::from_millis(100);
/// Bytes that are read at once, so that no length that a client states is allocated before its bytes have come.
const CHUNK: usize = 1 << 16;

/// Fewest bytes of an answer that a client takes in a second.
const SLOWEST: u64 = 1 << 18;

/// How long a client may take.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Patience {
    /// For its greeting, or for its first request in a protocol without one.
    pub greeting: Duration,
    /// For the next request to begin.
    pub idle: Duration,
    /// For the next request to begin, where another client needs the place.
    pub spare: Duration,
    /// For a call to be done.
    pub call: Duration,
    /// For the rest of a message that has begun, and for taking an answer.
    pub message: Duration,
}

impl Default for Patience {
    fn default() -> Self {
        let [greeting, idle, spare, call, message] = [10, 3600, 60, 600, 30].map(Duration::from_secs);
        Self { greeting, idle, spare, call, message }
    }
}

/// A client's connection.
pub struct Connection<'a> {
    stream: TcpStream,
    session: &'a Session,
    patience: Patience,
    /// Until when the client must have greeted. `None` after it.
    greeting: Option<Instant>,
    buffer: Box<[u8]>,
    /// Range of the buffer that has not been taken.
    waiting: std::ops::Range<usize>,
    /// Until when the message under way must be whole, and the time that it has in all.
    until: (Instant, Duration),
    /// Bytes that the message under way may still have.
    left: usize,
}

impl<'a> Connection<'a> {
    /// Takes a connection.
    ///
    /// # Errors
    /// The system refuses its settings.
    pub(crate) fn new(stream: TcpStream, session: &'a Session, patience: Patience) -> Result<Self, ConnectionEnd> {
        stream.set_nonblocking(false)?;
        stream.set_nodelay(true)?;
        stream.set_read_timeout(Some(LOOK))?;
        stream.set_write_timeout(Some(LOOK))?;
        let buffer = vec![0; CHUNK].into_boxed_slice();
        let now = Instant::now();
        let (greeting, until) = (Some(now + patience.greeting), (now, Duration::ZERO));
        Ok(Self { stream, session, patience, greeting, buffer, waiting: 0..0, until, left: 0 })
    }

    pub(crate) fn session(&self) -> &'a Session {
        self.session
    }

    /// How long a call may take.
    pub(crate) fn longest_call(&self) -> Duration {
        self.patience.call
    }

    /// The client has greeted.
    pub(crate) fn greeted(&mut self) {
        self.greeting = None;
    }

    /// Gives the client some time from now on, or what is left of the time for its greeting.
    fn give(&mut self, time: Duration) {
        let until = Instant::now() + time;
        self.until = match self.greeting {
            Some(greeting) if greeting < until => (greeting, self.patience.greeting),
            _ => (until, time),
        };
    }

    /// Waits for the first byte of a message of at most `most` bytes.
    ///
    /// # Errors
    /// The client closes or stays silent, or the server stops.
    pub(crate) fn begin_message(&mut self, most: usize) -> Result<(), ConnectionEnd> {
        self.left = most;
        self.give(self.patience.idle);
        if self.waiting.is_empty() {
            self.fill()?;
        }
        self.give(self.patience.message);
        Ok(())
    }

    /// Takes exactly as many bytes as the list has.
    ///
    /// # Errors
    /// As for [`Connection::begin_message`], and a message that is too long.
    pub(crate) fn take_into(&mut self, bytes: &mut [u8]) -> Result<(), ConnectionEnd> {
        self.spend(bytes.len())?;
        let mut done = 0;
        while done < bytes.len() {
            done += self.some(&mut bytes[done..])?;
        }
        Ok(())
    }

    /// Takes a number of bytes that the client states.
    ///
    /// # Errors
    /// As for [`Connection::take_into`].
    pub(crate) fn take(&mut self, length: u64) -> Result<Vec<u8>, ConnectionEnd> {
        let length = usize::try_from(length).unwrap_or(usize::MAX);
        self.spend(length)?;
        let mut bytes = Vec::new();
        while bytes.len() < length {
            let done = bytes.len();
            bytes.resize(length.min(done + CHUNK), 0);
            let some = self.some(&mut bytes[done..])?;
            bytes.truncate(done + some);
        }
        Ok(bytes)
    }

    /// Takes a list of fixed length.
    ///
    /// # Errors
    /// As for [`Connection::take_into`].
    pub(crate) fn array<const N: usize>(&mut self) -> Result<[u8; N], ConnectionEnd> {
        let mut bytes = [0; N];
        self.take_into(&mut bytes)?;
        Ok(bytes)
    }

    fn spend(&mut self, length: usize) -> Result<(), ConnectionEnd> {
        match self.left.checked_sub(length) {
            Some(left) => {
                self.left = left;
                Ok(())
            }
            None => Err(ConnectionEnd::Malformed(format!(
                "a message states {length} bytes, and {} are left for it",
                self.left
            ))),
        }
    }

    /// At least one byte.
    fn some(&mut self, bytes: &mut [u8]) -> Result<usize, ConnectionEnd> {
        if self.waiting.is_empty() {
            self.fill()?;
        }
        let count = bytes.len().min(self.waiting.len());
        let start = self.waiting.start;
        bytes[..count].copy_from_slice(&self.buffer[start..start + count]);
        self.waiting.start += count;
        Ok(count)
    }

    fn fill(&mut self) -> Result<(), ConnectionEnd> {
        loop {
            self.look()?;
            match self.stream.read(&mut self.buffer) {
                Ok(0) => return Err(ConnectionEnd::Closed),
                Ok(count) => {
                    self.waiting = 0..count;
                    return Ok(());
                }
                Err(error) if is_wait(error.kind()) => {}
                Err(error) if error.kind() == ErrorKind::ConnectionReset => return Err(ConnectionEnd::Closed),
                Err(error) => return Err(error.into()),
            }
        }
    }

    /// Sends bytes.
    ///
    /// # Errors
    /// The client takes none for too long, or has gone.
    pub(crate) fn send(&mut self, bytes: &[u8]) -> Result<(), ConnectionEnd> {
        let mut done = 0;
        self.give(self.patience.message + Duration::from_secs(bytes.len() as u64 / SLOWEST));
        while done < bytes.len() {
            self.look()?;
            match self.stream.write(&bytes[done..]) {
                Ok(0) => return Err(ConnectionEnd::Closed),
                Ok(count) => done += count,
                Err(error) if is_wait(error.kind()) => {}
                Err(error) if matches!(error.kind(), ErrorKind::ConnectionReset | ErrorKind::BrokenPipe) => {
                    return Err(ConnectionEnd::Closed);
                }
                Err(error) => return Err(error.into()),
            }
        }
        Ok(())
    }

    fn look(&self) -> Result<(), ConnectionEnd> {
        if let Some(end) = self.session.verdict() {
            return Err(end);
        }
        let (until, time) = self.until;
        if Instant::now() > until { Err(ConnectionEnd::TimeOut(time.as_secs())) } else { Ok(()) }
    }
}

fn is_wait(kind: ErrorKind) -> bool {
    matches!(kind, ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted)
}
