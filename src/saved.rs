//! Named lists of plain numbers, from which a run goes on later, bit for bit.
//!
//! Every room puts its own numbers under its own name and takes them back. `output/state_file.rs` writes the lists to a file.

use std::collections::BTreeMap;

use bytemuck::Pod;

/// A list that is absent or does not fit.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("its list '{name}' {reason}")]
pub struct SavedError {
    pub(crate) name: String,
    pub(crate) reason: String,
}

/// Lists of numbers by name.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Saved {
    lists: BTreeMap<String, Vec<u8>>,
}

impl Saved {
    pub(crate) fn put<T: Pod>(&mut self, name: impl Into<String>, values: &[T]) {
        self.lists.insert(name.into(), bytemuck::cast_slice(values).to_vec());
    }

    pub(crate) fn put_text(&mut self, name: impl Into<String>, text: &str) {
        self.put(name, text.as_bytes());
    }

    pub(crate) fn put_flags(&mut self, name: impl Into<String>, flags: &[bool]) {
        self.put(name, &flags.iter().map(|flag| u8::from(*flag)).collect::<Vec<_>>());
    }

    /// Puts lists under names that begin with a common part.
    pub(crate) fn put_all(&mut self, prefix: &str, other: Saved) {
        self.lists.extend(other.lists.into_iter().map(|(name, bytes)| (format!("{prefix}.{name}"), bytes)));
    }

    /// The lists whose names begin with a common part, without that part.
    pub(crate) fn part(&self, prefix: &str) -> Saved {
        let inside = |(name, bytes): (&String, &Vec<u8>)| {
            Some((name.strip_prefix(prefix)?.strip_prefix('.')?.to_owned(), bytes.clone()))
        };
        Saved { lists: self.lists.iter().filter_map(inside).collect() }
    }

    pub(crate) fn has(&self, name: &str) -> bool {
        self.lists.contains_key(name)
    }

    /// A list.
    ///
    /// # Errors
    /// It is absent, or its bytes are no whole number of values.
    pub fn list<T: Pod>(&self, name: &str) -> Result<Vec<T>, SavedError> {
        let bytes = self.lists.get(name).ok_or_else(|| wrong(name, "is absent"))?;
        if !bytes.len().is_multiple_of(size_of::<T>()) {
            return Err(wrong(name, &format!("has {} bytes, no multiple of {}", bytes.len(), size_of::<T>())));
        }
        Ok(bytes.chunks_exact(size_of::<T>()).map(bytemuck::pod_read_unaligned).collect())
    }

    /// A list of a known length.
    ///
    /// # Errors
    /// As [`Saved::list`], or another length.
    pub fn list_of<T: Pod>(&self, name: &str, length: usize) -> Result<Vec<T>, SavedError> {
        let list = self.list(name)?;
        if list.len() != length {
            return Err(wrong(name, &format!("has {} values, not {length}", list.len())));
        }
        Ok(list)
    }

    /// An array.
    ///
    /// # Errors
    /// As [`Saved::list_of`].
    pub(crate) fn array<T: Pod, const N: usize>(&self, name: &str) -> Result<[T; N], SavedError> {
        let list = self.list_of(name, N)?;
        list.try_into().map_err(|_| wrong(name, "has another length"))
    }

    /// Truth values.
    ///
    /// # Errors
    /// As [`Saved::list`].
    pub(crate) fn flags(&self, name: &str) -> Result<Vec<bool>, SavedError> {
        Ok(self.list::<u8>(name)?.into_iter().map(|flag| flag != 0).collect())
    }

    /// A text.
    ///
    /// # Errors
    /// It is absent or no UTF-8.
    pub(crate) fn text(&self, name: &str) -> Result<String, SavedError> {
        String::from_utf8(self.list(name)?).map_err(|_| wrong(name, "is no text"))
    }

    /// Names and bytes of all lists, in the order of the names.
    pub(crate) fn lists(&self) -> impl Iterator<Item = (&str, &[u8])> {
        self.lists.iter().map(|(name, bytes)| (name.as_str(), bytes.as_slice()))
    }
}

fn wrong(name: &str, reason: &str) -> SavedError {
    SavedError { name: name.to_owned(), reason: reason.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_come_back_bit_for_bit() {
        let mut saved = Saved::default();
        let values = [0.1, -0.0, f64::NAN, f64::INFINITY, 5e-324];
        saved.put("values", &values);
        saved.put_text("text", "δ");
        saved.put_flags("flags", &[true, false]);
        let mut outer = Saved::default();
        outer.put_all("inner", saved.clone());
        assert_eq!(outer.part("inner"), saved);
        assert!(!outer.part("inn").has("er.values") && outer.has("inner.values"));
        let back: [f64; 5] = outer.array("inner.values").unwrap();
        assert_eq!(back.map(f64::to_bits), values.map(f64::to_bits));
        assert_eq!(outer.text("inner.text").unwrap(), "δ");
        assert_eq!(outer.flags("inner.flags").unwrap(), [true, false]);
    }

    #[test]
    fn a_list_that_does_not_fit_is_named() {
        let mut saved = Saved::default();
        saved.put("odd", &[1u8, 2, 3]);
        assert_eq!(saved.list::<u32>("odd").unwrap_err().to_string(), "its list 'odd' has 3 bytes, no multiple of 4");
        assert_eq!(saved.list_of::<u8>("odd", 2).unwrap_err().to_string(), "its list 'odd' has 3 values, not 2");
        assert_eq!(saved.list::<u8>("none").unwrap_err().to_string(), "its list 'none' is absent");
    }
}
