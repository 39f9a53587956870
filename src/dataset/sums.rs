//! Lists of checksums, of an orbit and of the whole set: their one form, and whether files and lists are as they were written.

use std::collections::BTreeSet;
use std::io;

use rayon::prelude::*;
use sha2::{Digest, Sha256};

use super::orbit_folder::{CHECKSUMS, hexadecimal};
use crate::output::guarded::{Access, GuardedFolder};

/// Letters of a checksum.
const LETTERS: usize = 64;

/// The checksums and paths of a list. A list has one form: a line for each file, in the order of the paths, with small letters and two spaces.
///
/// # Errors
/// The first line that is otherwise, in words.
pub(super) fn lines(list: &str) -> Result<Vec<(&str, &str)>, String> {
    let mut lines: Vec<(&str, &str)> = Vec::new();
    for (number, line) in list.split_inclusive('\n').enumerate() {
        let parts = line.strip_suffix('\n').and_then(|line| line.split_once("  "));
        let parts = parts.filter(|(sum, path)| {
            let digits = sum.bytes().all(|byte| matches!(byte, b'0'..=b'9' | b'a'..=b'f'));
            let follows = lines.last().is_none_or(|(_, before)| before < path);
            sum.len() == LETTERS && digits && follows && !path.is_empty() && !path.contains(char::is_control)
        });
        lines.push(parts.ok_or_else(|| format!("line {} is not as it was written", number + 1))?);
    }
    if lines.is_empty() { Err("the list is empty".to_owned()) } else { Ok(lines) }
}

/// The checksum of a file.
fn sum_of_file(set: &GuardedFolder, name: &str) -> io::Result<String> {
    let mut hasher = Sha256::new();
    io::copy(&mut set.file(name, Access::Read)?, &mut hasher)?;
    Ok(hexadecimal(&hasher.finalize()))
}

/// The faults of the files of some lines, in words.
pub(super) fn faults_of_files(set: &GuardedFolder, lines: &[(&str, &str)]) -> Vec<String> {
    let check = |(sum, name): &(&str, &str)| match sum_of_file(set, name) {
        Err(error) => Some(format!("{name} can not be read: {error}")),
        Ok(own) if own != *sum => Some(format!("{name} was changed: its checksum is another")),
        Ok(_) => None,
    };
    lines.par_iter().filter_map(check).collect()
}

/// The folder of the orbit that has a file: `train/000001` of `train/000001/gray/000004.png`.
fn orbit_of(path: &str) -> Option<&str> {
    let (orbit, _) = path.split_at(path.match_indices('/').nth(1)?.0);
    let (_, number) = orbit.split_once('/')?;
    (number.len() == 6 && number.bytes().all(|byte| byte.is_ascii_digit())).then_some(orbit)
}

/// The faults of the orbits' lists, each of which has the lines of its folder. `list` are the lines of the whole set.
pub(super) fn faults_of_lists(set: &GuardedFolder, list: &[(&str, &str)]) -> Vec<String> {
    let orbits: BTreeSet<&str> = list.iter().filter_map(|(_, path)| orbit_of(path)).collect();
    let check = |orbit: &&str| {
        let of_orbit = list.iter().filter(|(_, path)| orbit_of(path) == Some(orbit));
        let expected: String = of_orbit.map(|(sum, path)| format!("{sum}  {path}\n")).collect();
        match set.read_text(&format!("{orbit}/{CHECKSUMS}")) {
            Err(error) => Some(format!("{orbit}/{CHECKSUMS} can not be read: {error}")),
            Ok(there) if there != expected => {
                Some(format!("{orbit}/{CHECKSUMS} and {CHECKSUMS} have other lines for this orbit"))
            }
            Ok(_) => None,
        }
    };
    orbits.par_iter().filter_map(check).collect()
}

/// The first fault of an orbit that stands in its place: its list, its files, or a file that the list does not have.
pub(crate) fn fault_of_orbit(set: &GuardedFolder, place: &str) -> Option<String> {
    let name = format!("{place}/{CHECKSUMS}");
    let list = match set.read_text(&name) {
        Err(error) => return Some(format!("{name} can not be read: {error}")),
        Ok(list) => list,
    };
    let lines = match lines(&list) {
        Err(fault) => return Some(format!("{name}: {fault}")),
        Ok(lines) => lines,
    };
    if let Some((_, path)) = lines.iter().find(|(_, path)| orbit_of(path) != Some(place)) {
        return Some(format!("{name} names {path}, which is not of this orbit"));
    }
    faults_of_files(set, &lines).into_iter().next()
}

/// The first fault of the lists and of the files of the whole set. Each process checks its own orbits.
pub(crate) fn fault_of_whole(set: &GuardedFolder) -> Option<String> {
    let list = match set.read_text(CHECKSUMS) {
        Err(error) => return Some(format!("{CHECKSUMS} can not be read: {error}")),
        Ok(list) => list,
    };
    let lines = match lines(&list) {
        Err(fault) => return Some(format!("{CHECKSUMS}: {fault}")),
        Ok(lines) => lines,
    };
    if let Some(fault) = faults_of_lists(set, &lines).into_iter().next() {
        return Some(fault);
    }
    let of_set: Vec<(&str, &str)> = lines.into_iter().filter(|(_, path)| orbit_of(path).is_none()).collect();
    faults_of_files(set, &of_set).into_iter().next()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_list_has_one_form() {
        let sum = "0123456789abcdef".repeat(4);
        let list = format!("{sum}  a/000001/x\n{sum}  b\n");
        assert_eq!(lines(&list).unwrap(), [(&*sum, "a/000001/x"), (&*sum, "b")]);
        // Each changed, missing or further byte of a sum or of the form is noticed. A changed path names another file.
        for at in 0..list.len() {
            let mut bytes = list.clone().into_bytes();
            bytes[at] ^= 0x20;
            let text = String::from_utf8(bytes).unwrap();
            assert!(lines(&text).ok() != lines(&list).ok(), "byte {at}");
            let cut = format!("{}{}", &list[..at], &list[at + 1..]);
            assert!(lines(&cut).ok() != lines(&list).ok(), "cut at {at}");
        }
        let swapped = format!("{sum}  b\n{sum}  a/000001/x\n");
        for wrong in
            [String::new(), swapped, format!("{list}\n"), list.replace('\n', "\r\n"), format!("{list}{sum}  b\n")]
        {
            assert!(lines(&wrong).is_err(), "{wrong}");
        }
        assert!(lines(&list.to_uppercase()).is_err());
    }
}
