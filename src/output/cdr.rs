//! The serialisation of ROS 2 messages (OMG's Common Data Representation, plain, little-endian).

/// Bytes before the message, which say how it is written.
const ENCAPSULATION: [u8; 4] = [0, 1, 0, 0];

/// A message under way. Numbers stand at multiples of their length after the first four bytes.
pub(super) struct Cdr(Vec<u8>);

impl Cdr {
    pub(super) fn new() -> Self {
        Self(ENCAPSULATION.to_vec())
    }

    /// A message that begins with a `std_msgs/Header`.
    pub(super) fn with_header(stamp: (i32, u32), frame: &str) -> Self {
        let mut cdr = Self::new();
        cdr.header(stamp, frame);
        cdr
    }

    fn align(&mut self, length: usize) {
        let body = self.0.len() - ENCAPSULATION.len();
        self.0.resize(ENCAPSULATION.len() + body.next_multiple_of(length), 0);
    }

    pub(super) fn header(&mut self, (seconds, nanoseconds): (i32, u32), frame: &str) -> &mut Self {
        self.align(4);
        self.0.extend(seconds.to_le_bytes());
        self.u32(nanoseconds).text(frame)
    }

    pub(super) fn u8(&mut self, value: u8) -> &mut Self {
        self.0.push(value);
        self
    }

    pub(super) fn u32(&mut self, value: u32) -> &mut Self {
        self.align(4);
        self.0.extend(value.to_le_bytes());
        self
    }

    /// A string, with the zero at its end.
    pub(super) fn text(&mut self, text: &str) -> &mut Self {
        self.u32(text.len() as u32 + 1);
        self.0.extend_from_slice(text.as_bytes());
        self.u8(0)
    }

    /// A sequence of bytes.
    pub(super) fn bytes(&mut self, bytes: &[u8]) -> &mut Self {
        self.u32(bytes.len() as u32);
        self.0.extend_from_slice(bytes);
        self
    }

    /// A sequence of numbers.
    pub(super) fn f64s(&mut self, values: &[f64]) -> &mut Self {
        self.u32(values.len() as u32);
        if values.is_empty() { self } else { self.f64_array(values) }
    }

    /// An array of fixed length.
    pub(super) fn f64_array(&mut self, values: &[f64]) -> &mut Self {
        self.align(8);
        self.0.extend(values.iter().flat_map(|value| value.to_le_bytes()));
        self
    }

    pub(super) fn finish(self) -> Vec<u8> {
        self.0
    }
}
