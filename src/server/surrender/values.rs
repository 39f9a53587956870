//! Values in Qt's serialisation: a `QHash<QString, QVariant>`, big-endian, without a length around it.

use std::collections::BTreeMap;

use crate::server::connection::Connection;
use crate::server::error::ConnectionEnd;

/// Most bytes of a request. Scripts send textures of some megabytes.
pub(crate) const MOST_BYTES: usize = 64 << 20;
const MOST_VALUES: u32 = 100_000;
/// Deepest nesting of lists and hashes.
const DEEPEST: u32 = 16;
/// Length of an empty string or byte array.
const EMPTY: u32 = u32::MAX;

/// A hash. The empty key holds the name of a call.
pub type Hash = BTreeMap<String, Value>;

/// A value.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    /// No value.
    Nothing,
    /// A truth value.
    Bool(bool),
    /// An integer of 32 bits.
    Int(i32),
    /// A large integer.
    Unsigned(u64),
    /// A number.
    Double(f64),
    /// A list.
    List(Vec<Value>),
    /// A text.
    Text(String),
    /// Bytes.
    Bytes(Vec<u8>),
    /// A hash.
    Hash(Hash),
}

impl Value {
    pub(crate) fn number(&self) -> Option<f64> {
        match self {
            Self::Int(value) => Some(f64::from(*value)),
            Self::Unsigned(value) => Some(*value as f64),
            Self::Double(value) => Some(*value),
            _ => None,
        }
    }

    pub(crate) fn numbers<const N: usize>(&self) -> Option<[f64; N]> {
        let Self::List(list) = self else { return None };
        let numbers: Option<Vec<f64>> = list.iter().map(Self::number).collect();
        numbers?.try_into().ok()
    }

    /// A list of numbers.
    pub fn list(numbers: impl IntoIterator<Item = f64>) -> Self {
        Self::List(numbers.into_iter().map(Self::Double).collect())
    }
}

/// Reads a request. A request may come in pieces, and the next request may follow at once.
///
/// # Errors
/// Bytes that are no request, one that is too long or too deep, or a client that has gone.
pub(crate) fn read(connection: &mut Connection) -> Result<Hash, ConnectionEnd> {
    connection.begin_message(MOST_BYTES)?;
    ValueReader { connection, values: MOST_VALUES }.hash(0)
}

struct ValueReader<'r, 'c> {
    connection: &'r mut Connection<'c>,
    /// Values that the request may still have.
    values: u32,
}

impl ValueReader<'_, '_> {
    fn u32(&mut self) -> Result<u32, ConnectionEnd> {
        Ok(u32::from_be_bytes(self.connection.array()?))
    }

    fn count(&mut self) -> Result<u32, ConnectionEnd> {
        let count = self.u32()?;
        match self.values.checked_sub(count) {
            Some(left) => {
                self.values = left;
                Ok(count)
            }
            None => Err(ConnectionEnd::Malformed(format!("a request has more than {MOST_VALUES} values"))),
        }
    }

    fn bytes(&mut self) -> Result<Vec<u8>, ConnectionEnd> {
        match self.u32()? {
            EMPTY => Ok(Vec::new()),
            length => self.connection.take(u64::from(length)),
        }
    }

    fn text(&mut self) -> Result<String, ConnectionEnd> {
        let bytes = self.bytes()?;
        let (pairs, rest) = bytes.as_chunks::<2>();
        if !rest.is_empty() {
            return Err(ConnectionEnd::Malformed("a text has an odd number of bytes".to_owned()));
        }
        let words: Vec<u16> = pairs.iter().map(|pair| u16::from_be_bytes(*pair)).collect();
        String::from_utf16(&words).map_err(|_| ConnectionEnd::Malformed("a text is not UTF-16".to_owned()))
    }

    fn hash(&mut self, depth: u32) -> Result<Hash, ConnectionEnd> {
        let mut hash = Hash::new();
        for _ in 0..self.count()? {
            let key = self.text()?;
            hash.insert(key, self.value(depth + 1)?);
        }
        Ok(hash)
    }

    fn value(&mut self, depth: u32) -> Result<Value, ConnectionEnd> {
        if depth > DEEPEST {
            return Err(ConnectionEnd::Malformed(format!("values are nested more than {DEEPEST} deep")));
        }
        let kind = self.u32()?;
        // Whether the value is null, which says no more than the value.
        self.connection.array::<1>()?;
        Ok(match kind {
            0 => Value::Nothing,
            1 => Value::Bool(self.connection.array::<1>()? != [0]),
            2 => Value::Int(i32::from_be_bytes(self.connection.array()?)),
            3 => Value::Unsigned(u64::from(self.u32()?)),
            5 => Value::Unsigned(u64::from_be_bytes(self.connection.array()?)),
            6 => Value::Double(f64::from_be_bytes(self.connection.array()?)),
            8 | 28 => Value::Hash(self.hash(depth)?),
            9 => {
                let mut list = Vec::new();
                for _ in 0..self.count()? {
                    list.push(self.value(depth + 1)?);
                }
                Value::List(list)
            }
            10 => Value::Text(self.text()?),
            12 => Value::Bytes(self.bytes()?),
            other => return Err(ConnectionEnd::Malformed(format!("a value has the unknown type {other}"))),
        })
    }
}

/// The bytes of a hash.
pub fn write_value(hash: &Hash) -> Vec<u8> {
    let mut bytes = Vec::new();
    put_hash(&mut bytes, hash);
    bytes
}

fn put_hash(bytes: &mut Vec<u8>, hash: &Hash) {
    bytes.extend((hash.len() as u32).to_be_bytes());
    for (key, value) in hash {
        put_text(bytes, key);
        put(bytes, value);
    }
}

fn put_text(bytes: &mut Vec<u8>, text: &str) {
    let words: Vec<u8> = text.encode_utf16().flat_map(u16::to_be_bytes).collect();
    put_bytes(bytes, &words);
}

fn put_bytes(bytes: &mut Vec<u8>, content: &[u8]) {
    let length = if content.is_empty() { EMPTY } else { content.len() as u32 };
    bytes.extend(length.to_be_bytes());
    bytes.extend_from_slice(content);
}

fn put(bytes: &mut Vec<u8>, value: &Value) {
    let kind: u32 = match value {
        Value::Nothing => 0,
        Value::Bool(_) => 1,
        Value::Int(_) => 2,
        Value::Unsigned(_) => 5,
        Value::Double(_) => 6,
        Value::List(_) => 9,
        Value::Text(_) => 10,
        Value::Bytes(_) => 12,
        Value::Hash(_) => 28,
    };
    bytes.extend(kind.to_be_bytes());
    bytes.push(0);
    match value {
        Value::Nothing => {}
        Value::Bool(value) => bytes.push(u8::from(*value)),
        Value::Int(value) => bytes.extend(value.to_be_bytes()),
        Value::Unsigned(value) => bytes.extend(value.to_be_bytes()),
        Value::Double(value) => bytes.extend(value.to_be_bytes()),
        Value::List(list) => {
            bytes.extend((list.len() as u32).to_be_bytes());
            list.iter().for_each(|value| put(bytes, value));
        }
        Value::Text(text) => put_text(bytes, text),
        Value::Bytes(content) => put_bytes(bytes, content),
        Value::Hash(hash) => put_hash(bytes, hash),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The bytes of the call `version` that the client was seen to send.
    #[test]
    fn a_call_has_the_measured_bytes() {
        let call = Hash::from([(String::new(), Value::Text("version".to_owned()))]);
        let measured =
            [&[0, 0, 0, 1, 0xFF, 0xFF, 0xFF, 0xFF, 0, 0, 0, 10, 0, 0, 0, 0, 14][..], b"\0v\0e\0r\0s\0i\0o\0n"].concat();
        assert_eq!(write_value(&call), measured);
        assert_eq!(measured.len(), 31);
    }
}
