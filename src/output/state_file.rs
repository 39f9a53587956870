//! The file of a saved state.
//!
//! The file begins with the line `isotherm state` and the version of the format (u32, little endian). Then come the version of isotherm, the kind of the state and
//! the state itself in the format of postcard, which keeps the bits of every float. The SHA-256 of all this ends the file.
//!
//! A list takes memory as its values are read, so a damaged file can not ask for more than it holds.
//!
//! A state is written beside the old one, brought to the disk and renamed. So a kill, a full disk or a loss of power leaves the old or the new state
//! whole. An earlier state is not kept: a damaged file means a damaged disk, where nothing else in the folder can be trusted either.

use std::io::Write;

use serde::Serialize;
use serde::de::DeserializeOwned;
use sha2::{Digest, Sha256};

use super::OutputError;
use super::guarded::{Access, GuardedFolder};
use super::temporary::Unfinished;
use crate::simulation::thermal_state::ThermalState;

const MAGIC: &[u8] = b"isotherm state\n";
const FORMAT: u32 = 11;
const SUM_BYTES: usize = 32;
/// Version of isotherm. Any other may keep other numbers.
const VERSION: &str = env!("CARGO_PKG_VERSION");

/// A state that has a file.
pub trait SavedState: Serialize + DeserializeOwned {
    /// Its kind, in words.
    const KIND: &str;
}

impl SavedState for ThermalState {
    const KIND: &str = "thermal state of --save-state";
}

/// Why bytes can not be read as a state.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum StateFault {
    /// They do not begin like a state.
    #[error("is no saved state")]
    NoState,
    /// They end too early.
    #[error("is truncated")]
    Truncated,
    /// They have another format.
    #[error("was written by an earlier version of isotherm")]
    Earlier,
    /// They were written by another version.
    #[error("was written by version {0} of isotherm, and this is version {own}", own = VERSION)]
    Version(String),
    /// They are of a later format.
    #[error("has format {0}, and this program reads format {own}", own = FORMAT)]
    Later(u32),
    /// Their checksum is another.
    #[error("is damaged or truncated: its checksum does not fit")]
    Sum,
    /// Their checksum fits, but they are no state.
    #[error("is damaged: {0}")]
    Content(#[from] postcard::Error),
    /// They are a state of another kind.
    #[error("is no {0}")]
    Kind(&'static str),
}

impl StateFault {
    /// What to do about a state that a run saved for others. It follows the fault.
    pub fn advice(&self) -> &'static str {
        match self {
            Self::Earlier | Self::Version(_) | Self::Later(_) => "; start the run anew that saves it",
            _ => "",
        }
    }
}

/// The bytes of a state.
///
/// # Errors
/// A state that postcard does not take.
pub fn encode<T: SavedState>(state: &T) -> Result<Vec<u8>, OutputError> {
    let mut bytes = MAGIC.to_vec();
    bytes.extend(FORMAT.to_le_bytes());
    let mut bytes = postcard::to_extend(&(VERSION, T::KIND, state), bytes)
        .map_err(|error| OutputError::Encode("state".to_owned(), error.to_string()))?;
    let sum = Sha256::digest(&bytes);
    bytes.extend_from_slice(&sum);
    Ok(bytes)
}

/// Number of bytes of a state.
pub(crate) fn size<T: SavedState>(state: &T) -> usize {
    postcard::experimental::serialized_size(state).unwrap_or(usize::MAX)
}

/// The state in these bytes.
///
/// # Errors
/// The bytes are no such state, of another version, truncated or damaged.
pub fn decode<T: SavedState>(bytes: &[u8]) -> Result<T, StateFault> {
    let rest = bytes.strip_prefix(MAGIC).ok_or(StateFault::NoState)?;
    let (format, _) = rest.split_first_chunk().ok_or(StateFault::Truncated)?;
    match u32::from_le_bytes(*format) {
        FORMAT => {}
        later if later > FORMAT => return Err(StateFault::Later(later)),
        _ => return Err(StateFault::Earlier),
    }
    let (content, sum) = bytes.split_at_checked(bytes.len().saturating_sub(SUM_BYTES)).ok_or(StateFault::Truncated)?;
    if Sha256::digest(content).as_slice() != sum {
        return Err(StateFault::Sum);
    }
    let content = content.get(MAGIC.len() + 4..).ok_or(StateFault::Truncated)?;
    let ((version, kind), content) = postcard::take_from_bytes::<(String, String)>(content)?;
    if version != VERSION {
        return Err(StateFault::Version(version));
    }
    if kind != T::KIND {
        return Err(StateFault::Kind(T::KIND));
    }
    match postcard::take_from_bytes(content)? {
        (state, []) => Ok(state),
        _ => Err(StateFault::Content(postcard::Error::DeserializeBadEncoding)),
    }
}

/// Writes a state in place of an earlier one, at a path within a folder.
///
/// # Errors
/// The disk is full, or the folder cannot be written.
pub(crate) fn write<T: SavedState>(folder: &GuardedFolder, path: &str, state: &T) -> Result<(), OutputError> {
    let bytes = encode(state)?;
    let part = match path.rsplit_once('/') {
        Some((above, name)) => format!("{above}/part-{name}"),
        None => format!("part-{path}"),
    };
    let _unfinished = Unfinished::new(&folder.root().join(&part));
    let written = (|| {
        let mut file = folder.file(&part, Access::Anew)?;
        file.write_all(&bytes)?;
        file.sync_all()?;
        folder.rename(&part, path)?;
        // The new name must be on the disk too.
        folder.sync_above(path)
    })();
    if written.is_err() {
        let _ = folder.remove(&part);
    }
    written.map_err(|source| OutputError::write(&folder.root().join(path), source))
}

/// Reads a state at a path within a folder.
///
/// # Errors
/// There is none, or it is no whole state of this format.
pub(crate) fn read<T: SavedState>(folder: &GuardedFolder, name: &str) -> Result<T, OutputError> {
    let path = folder.root().join(name);
    let refused = |reason: String| OutputError::State(path.clone(), reason);
    let bytes = match folder.read(name) {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
            return Err(refused("is not there, because the run was ended before it saved one".to_owned()));
        }
        read => read.map_err(|source| OutputError::Read(path.clone(), source))?,
    };
    decode(&bytes).map_err(|fault| refused(fault.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers of all kinds that states have.
    #[derive(Debug, Serialize, serde::Deserialize)]
    struct Numbers {
        doubles: [f64; 5],
        floats: Vec<f32>,
        flags: Vec<bool>,
        name: Option<String>,
    }

    impl SavedState for Numbers {
        const KIND: &str = "list of numbers";
    }

    fn numbers() -> Numbers {
        let odd = f32::from_bits(0x7fa0_1234);
        Numbers {
            doubles: [0.1, -0.0, f64::from_bits(0x7ff4_0000_0000_0001), f64::INFINITY, 5e-324],
            floats: vec![odd, -0.0, 1e-45],
            flags: vec![true, false],
            name: Some("δ".to_owned()),
        }
    }

    fn assert_same(found: &Numbers) {
        let expected = numbers();
        assert_eq!(found.doubles.map(f64::to_bits), expected.doubles.map(f64::to_bits));
        let bits = |numbers: &Numbers| numbers.floats.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(found), bits(&expected));
        assert_eq!((&found.flags, &found.name), (&expected.flags, &expected.name));
    }

    #[test]
    fn a_state_comes_back_bit_for_bit() {
        let folder = tempfile::tempdir().unwrap();
        let guarded = GuardedFolder::open(folder.path()).unwrap();
        write(&guarded, "home/state", &Numbers { flags: Vec::new(), ..numbers() }).unwrap();
        write(&guarded, "home/state", &numbers()).unwrap();
        assert_same(&read(&guarded, "home/state").unwrap());
        assert_eq!(std::fs::read_dir(folder.path().join("home")).unwrap().count(), 1);
    }

    #[test]
    fn every_changed_byte_and_every_cut_is_refused() {
        let bytes = encode(&numbers()).unwrap();
        for at in 0..bytes.len() {
            let mut changed = bytes.clone();
            changed[at] ^= 0x40;
            assert!(decode::<Numbers>(&changed).is_err(), "byte {at}");
            assert!(decode::<Numbers>(&bytes[..at]).is_err(), "cut at {at}");
        }
        assert!(decode::<Numbers>(&[bytes.as_slice(), b"x"].concat()).is_err());
        let folder = tempfile::tempdir().unwrap();
        let guarded = GuardedFolder::open(folder.path()).unwrap();
        let error = read::<Numbers>(&guarded, "state").unwrap_err().to_string();
        assert!(error.contains("is not there") && error.contains("--force"), "{error}");
        // A state behind a link is another folder's.
        let elsewhere = tempfile::tempdir().unwrap();
        std::fs::write(elsewhere.path().join("state"), &bytes).unwrap();
        #[cfg(unix)]
        std::os::unix::fs::symlink(elsewhere.path(), folder.path().join("home")).unwrap();
        assert!(read::<Numbers>(&guarded, "home/state").is_err());
    }

    /// Bytes of a state with a checksum that fits.
    fn summed(mut bytes: Vec<u8>) -> Vec<u8> {
        let sum = Sha256::digest(&bytes);
        bytes.extend_from_slice(&sum);
        bytes
    }

    #[test]
    fn states_of_other_versions_and_kinds_are_refused_in_words() {
        let with = |format: u32, content: &[u8]| summed([MAGIC, &format.to_le_bytes(), content].concat());
        let content = |version: &str, kind: &str| postcard::to_stdvec(&(version, kind, numbers())).unwrap();
        for (bytes, expected) in [
            (with(1, &[4, 3, 2, 1]), "was written by an earlier version of isotherm"),
            (with(FORMAT + 1, &[]), "has format 12, and this program reads format 11"),
            (
                with(FORMAT, &content("0.0.7", Numbers::KIND)),
                "was written by version 0.0.7 of isotherm, and this is version",
            ),
            (with(FORMAT, &content(VERSION, "list of words")), "is no list of numbers"),
        ] {
            let error = decode::<Numbers>(&bytes).unwrap_err().to_string();
            assert!(error.contains(expected), "{error}");
        }
    }

    /// With a checksum that fits, content of any kind is an error or a state, and takes no more memory than the file has bytes.
    #[test]
    fn content_that_lies_is_no_panic() {
        let whole = encode(&numbers()).unwrap();
        let whole = &whole[..whole.len() - SUM_BYTES];
        for at in MAGIC.len()..whole.len() {
            for value in [0x00, 0x01, 0x7f, 0x80, 0xff] {
                let mut changed = whole.to_vec();
                changed[at] = value;
                let _ = decode::<Numbers>(&summed(changed));
            }
            assert!(decode::<Numbers>(&summed(whole[..at].to_vec())).is_err());
        }
        // A list of 2^63 values.
        let head = postcard::to_stdvec(&(VERSION, Numbers::KIND, [0.0f64; 5])).unwrap();
        let many = [&[0xff; 8][..], &[0x7f]].concat();
        let lying = [MAGIC, &FORMAT.to_le_bytes(), &head, &many].concat();
        assert!(matches!(decode::<Numbers>(&summed(lying)), Err(StateFault::Content(_))));
    }
}
