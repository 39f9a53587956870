//! A REQ socket of ZeroMQ, as libzmq 4.3 opens one.

use std::io::{Read, Result, Write};
use std::net::{SocketAddr, TcpStream};
use std::time::Duration;

pub struct Requester(pub TcpStream);

/// What libzmq sends before the first request.
pub fn opening() -> Vec<u8> {
    let mut bytes = vec![0xFF, 0, 0, 0, 0, 0, 0, 0, 1, 0x7F, 3, 1];
    bytes.extend(b"NULL");
    bytes.resize(64, 0);
    bytes.extend([4, 38]);
    bytes.extend(b"\x05READY\x0bSocket-Type\0\0\0\x03REQ\x08Identity\0\0\0\0");
    bytes
}

/// The bytes of a request.
pub fn request(frames: &[&[u8]]) -> Vec<u8> {
    let mut bytes = vec![1, 0];
    for (number, frame) in frames.iter().enumerate() {
        let more = u8::from(number + 1 < frames.len());
        if frame.len() < 256 {
            bytes.extend([more, frame.len() as u8]);
        } else {
            bytes.push(more | 2);
            bytes.extend((frame.len() as u64).to_be_bytes());
        }
        bytes.extend_from_slice(frame);
    }
    bytes
}

impl Requester {
    pub fn open(address: SocketAddr) -> Result<Self> {
        let stream = TcpStream::connect(address)?;
        stream.set_read_timeout(Some(Duration::from_secs(120)))?;
        let mut requester = Self(stream);
        requester.0.write_all(&opening())?;
        let greeting: [u8; 64] = requester.array()?;
        assert_eq!((greeting[0], greeting[9], &greeting[10..16]), (0xFF, 0x7F, &b"\x03\x01NULL"[..]));
        let [flags, length] = requester.array()?;
        assert_eq!(flags, 4);
        let ready = requester.bytes(usize::from(length))?;
        assert!(ready.starts_with(b"\x05READY\x0bSocket-Type\0\0\0\x03REP"), "{ready:?}");
        Ok(requester)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N]> {
        let mut bytes = [0; N];
        self.0.read_exact(&mut bytes)?;
        Ok(bytes)
    }

    fn bytes(&mut self, length: usize) -> Result<Vec<u8>> {
        let mut bytes = vec![0; length];
        self.0.read_exact(&mut bytes)?;
        Ok(bytes)
    }

    /// The frames of an answer.
    pub fn answer(&mut self) -> Result<Vec<Vec<u8>>> {
        let mut frames = Vec::new();
        loop {
            let [flags] = self.array()?;
            let length = match flags & 2 {
                0 => usize::from(self.array::<1>()?[0]),
                _ => u64::from_be_bytes(self.array()?) as usize,
            };
            assert!(flags < 4 && length < 1 << 28, "{flags} {length}");
            frames.push(self.bytes(length)?);
            if flags & 1 == 0 {
                assert!(frames.remove(0).is_empty(), "an answer begins with the empty frame");
                return Ok(frames);
            }
        }
    }

    pub fn ask(&mut self, frames: &[&[u8]]) -> Result<Vec<Vec<u8>>> {
        self.0.write_all(&request(frames))?;
        self.answer()
    }

    /// The image of a camera. Its length must be told.
    pub fn image(&mut self, camera: i64) -> Vec<u8> {
        let answer = self.ask(&[format!("REQUEST_IMAGE_{camera}").as_bytes()]).expect("an answer");
        let [length, image] = &answer[..] else { panic!("two frames, not {}", answer.len()) };
        assert_eq!(length[..], (image.len() as i32).to_be_bytes());
        image.clone()
    }
}
