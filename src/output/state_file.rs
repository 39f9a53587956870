//! The file of a saved state.
//!
//! The line `isotherm state` begins the file, then come the version of the format (u32), the number 0x01020304 (u32) and the number of lists (u64).
//! Each list has the length of its name (u64), its name, its number of bytes (u64) and its bytes. The SHA-256 of all this ends the file. Numbers are
//! in the byte order of the machine. The number 0x01020304 shows the byte order. `simulation/state.rs` describes the lists of a simulation,
//! `job_state.rs` and `cli/resume.rs` add the lists of a run.
//!
//! A state is written beside the old one, brought to the disk and renamed. So a kill, a full disk or a loss of power leaves the old or the new state
//! whole. An earlier state is not kept: a damaged file means a damaged disk, where nothing else in the folder can be trusted either.

use std::fs::{self, File};
use std::io::Write;
use std::path::Path;

use sha2::{Digest, Sha256};

use super::OutputError;
use super::temporary::Unfinished;
use crate::saved::Saved;

const MAGIC: &[u8] = b"isotherm state\n";
const VERSION: u32 = 1;
const ORDER: u32 = 0x0102_0304;
const SUM_BYTES: usize = 32;

/// The bytes of a state.
pub fn encode(saved: &Saved) -> Vec<u8> {
    let mut bytes = MAGIC.to_vec();
    bytes.extend(VERSION.to_ne_bytes());
    bytes.extend(ORDER.to_ne_bytes());
    bytes.extend((saved.lists().count() as u64).to_ne_bytes());
    for (name, list) in saved.lists() {
        for part in [name.as_bytes(), list] {
            bytes.extend((part.len() as u64).to_ne_bytes());
            bytes.extend_from_slice(part);
        }
    }
    let sum = Sha256::digest(&bytes);
    bytes.extend_from_slice(&sum);
    bytes
}

/// The state in these bytes.
///
/// # Errors
/// The bytes are no state, of another version, truncated or damaged.
pub fn decode(bytes: &[u8]) -> Result<Saved, String> {
    let rest = bytes.strip_prefix(MAGIC).ok_or("is no saved state")?;
    let word = |at: usize| rest.get(at..at + 4).and_then(|word| word.try_into().ok()).map(u32::from_ne_bytes);
    let (version, order) = word(0).zip(word(4)).ok_or("is truncated")?;
    if order != ORDER {
        return Err("is of a machine with another byte order".to_owned());
    }
    if version != VERSION {
        return Err(format!("has format {version}, and this program reads format {VERSION}"));
    }
    let (content, sum) = bytes.split_at_checked(bytes.len().saturating_sub(SUM_BYTES)).ok_or("is truncated")?;
    if Sha256::digest(content).as_slice() != sum {
        return Err("is damaged or truncated: its checksum does not fit".to_owned());
    }
    let mut at = MAGIC.len() + 8;
    let mut take = |count: usize| {
        let piece = at.checked_add(count).and_then(|end| content.get(at..end)).ok_or("is truncated")?;
        at += count;
        Ok::<&[u8], String>(piece)
    };
    let length = |bytes: &[u8]| bytes.try_into().map(u64::from_ne_bytes).unwrap_or(u64::MAX);
    let mut saved = Saved::default();
    for _ in 0..length(take(8)?) {
        let name = length(take(8)?);
        let name = String::from_utf8(take(name as usize)?.to_vec()).map_err(|_| "has a name that is no text")?;
        let list = length(take(8)?);
        saved.put(name, take(list as usize)?);
    }
    Ok(saved)
}

/// Writes a state in place of an earlier one.
///
/// # Errors
/// The disk is full, or the folder cannot be written.
pub(crate) fn write(path: &Path, saved: &Saved) -> Result<(), OutputError> {
    let failed = |source| OutputError::write(path, source);
    let part = path.with_file_name("part-state");
    let _unfinished = Unfinished::new(&part);
    let written = (|| {
        let mut file = File::create(&part)?;
        file.write_all(&encode(saved))?;
        file.sync_all()?;
        fs::rename(&part, path)?;
        match path.parent() {
            // The new name must be on the disk too.
            Some(home) if cfg!(unix) => File::open(home)?.sync_all(),
            _ => Ok(()),
        }
    })();
    if written.is_err() {
        let _ = fs::remove_file(&part);
    }
    written.map_err(failed)
}

/// Reads a state.
///
/// # Errors
/// There is none, or it is no whole state of this format.
pub(crate) fn read(path: &Path) -> Result<Saved, OutputError> {
    let refused = |reason: String| OutputError::State(path.to_path_buf(), reason);
    let bytes = match fs::read(path) {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
            return Err(refused("is not there, because the run was ended before it saved one".to_owned()));
        }
        read => read.map_err(|source| OutputError::Read(path.to_path_buf(), source))?,
    };
    decode(&bytes).map_err(refused)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn saved() -> Saved {
        let mut saved = Saved::default();
        saved.put("a.numbers", &[1.5f64, -2.0]);
        saved.put_text("name", "station");
        saved.put::<u8>("empty", &[]);
        saved
    }

    #[test]
    fn a_state_comes_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("state");
        write(&path, &Saved::default()).unwrap();
        write(&path, &saved()).unwrap();
        assert_eq!(read(&path).unwrap(), saved());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn every_changed_byte_and_every_cut_is_refused() {
        let bytes = encode(&saved());
        for at in 0..bytes.len() {
            let mut changed = bytes.clone();
            changed[at] ^= 0x40;
            assert!(decode(&changed).is_err(), "byte {at}");
            assert!(decode(&bytes[..at]).is_err(), "cut at {at}");
        }
        assert!(decode(&[bytes.as_slice(), b"x"].concat()).is_err());
        let folder = tempfile::tempdir().unwrap();
        let error = read(&folder.path().join("state")).unwrap_err().to_string();
        assert!(error.contains("is not there") && error.contains("--force"), "{error}");
    }
}
