//! Reading goes on after an error, so that all errors of a file are reported at once.
//!
//! A reader ends at its first error. The file is then read again with a valid value in place of the wrong one, until nothing new is found. An error that may
//! follow from an earlier one is not told.

use std::cell::RefCell;
use std::path::{Path, PathBuf};

use super::error::SceneError;
use super::keys::home;

const MOST_ERRORS: usize = 200;
const MOST_READINGS: usize = 600;

/// Stands for all keys of the other files that are read, such as the materials table.
pub(super) const OTHER_FILES: &str = "(other files)";
/// Stands for all keys of the same section.
pub(super) const OWN_SECTION: &str = "*";

/// Start of a section where a key belongs that stands elsewhere.
const ANYWHERE: usize = usize::MAX - 1;

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct KeyPlace {
    pub(super) path: PathBuf,
    /// Name of the section, empty for the root.
    pub(super) section: String,
    /// Byte at which the section begins, which distinguishes the elements of an array of tables.
    pub(super) start: usize,
    pub(super) key: String,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum FaultKind {
    Number,
    Missing,
    Unknown,
    /// Anything else. Other keys of the section may be missing because of it.
    Other,
}

/// The stand-in that a section gives for a wrong key.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Instead {
    Valid,
    /// The value under a misspelt key.
    Of(String),
    /// Nothing, as if the key were absent.
    Nothing,
}

#[derive(Debug)]
struct SceneFault {
    place: KeyPlace,
    kind: FaultKind,
    /// How often a reading ended here.
    times: u32,
    misspelt: Option<String>,
}

#[derive(Debug)]
struct LastFault {
    place: KeyPlace,
    kind: FaultKind,
    /// Keys that it depends on too.
    others: Vec<String>,
    /// Whether it may follow from an earlier one.
    follows: bool,
    /// Whether its section is one of several of the same name.
    one_of_several: bool,
    /// The known key that was probably meant, for an unknown one.
    meant: Option<String>,
    text: String,
}

#[derive(Debug, Default)]
pub(super) struct Faults {
    faults: RefCell<Vec<SceneFault>>,
    given_up: RefCell<Vec<KeyPlace>>,
    last: RefCell<Option<LastFault>>,
    /// The first number that counts as 0, in words, and how many do.
    small: RefCell<Option<(String, u64)>>,
}

/// Reads until no new error is found.
///
/// # Errors
/// The only error, or [`SceneError::Several`] in the order of their lines. Errors in `path` come first.
pub(super) fn read_all<T>(
    path: &Path,
    mut read: impl FnMut(&Faults) -> Result<T, SceneError>,
) -> Result<T, SceneError> {
    let faults = Faults::default();
    let mut errors: Vec<(SceneError, Option<LastFault>)> = Vec::new();
    for _ in 0..MOST_READINGS {
        faults.last.take();
        let error = match read(&faults) {
            Ok(value) if errors.is_empty() => return Ok(value),
            Ok(_) => break,
            Err(error) => error,
        };
        let last = faults.last.take().filter(|last| last.text == error.to_string());
        let goes_on = last.as_ref().is_some_and(|last| faults.learn(last));
        if errors.is_empty() || last.as_ref().is_some_and(|last| !last.follows) {
            errors.push((error, last));
        }
        if !goes_on || errors.len() >= MOST_ERRORS {
            break;
        }
    }
    // A section may be read before the one that has its key by mistake.
    errors.retain(|(_, last)| !last.as_ref().is_some_and(|last| faults.are_explained(last)));
    let mut errors: Vec<SceneError> = errors.into_iter().map(|(error, _)| error).collect();
    errors.sort_by_cached_key(|error| {
        let (file, line) = error.position();
        (file.as_deref().is_some_and(|file| file != path), file, line)
    });
    Err(match errors.len() {
        1 => errors.remove(0),
        _ => SceneError::Several(errors),
    })
}

impl Faults {
    /// Notes an error that is made at a place. `others` are keys that it depends on too.
    pub(super) fn note(
        &self,
        place: KeyPlace,
        kind: FaultKind,
        others: &[&str],
        one_of_several: bool,
        meant: Option<String>,
        text: String,
    ) {
        let follows = self.follows(&place, kind, others, |_| true) || self.is_unread(&place, others);
        let others = others.iter().map(|other| (*other).to_owned()).collect();
        *self.last.borrow_mut() = Some(LastFault { place, kind, others, follows, one_of_several, meant, text });
    }

    /// Notes a number that counts as 0.
    pub(super) fn note_small(&self, text: impl FnOnce() -> String) {
        let mut small = self.small.borrow_mut();
        match &mut *small {
            Some((_, count)) => *count += 1,
            None => *small = Some((text(), 1)),
        }
    }

    /// The numbers that count as 0, in one sentence for the user. `None` where there are none.
    pub(super) fn take_small(&self) -> Option<String> {
        let (first, count) = self.small.take()?;
        Some(match count {
            1 => format!("{first}."),
            _ => format!("{first}, as the first of {count} such numbers."),
        })
    }

    /// Whether a key that stands in another section explains an error.
    fn are_explained(&self, last: &LastFault) -> bool {
        let others: Vec<&str> = last.others.iter().map(String::as_str).collect();
        self.follows(&last.place, last.kind, &others, |fault| fault.place.start == ANYWHERE)
    }

    /// Whether an error at a place may follow from one of the known faults that count.
    fn follows(
        &self,
        place: &KeyPlace,
        kind: FaultKind,
        others: &[&str],
        counts: impl Fn(&SceneFault) -> bool,
    ) -> bool {
        let faults = self.faults.borrow();
        let same_section = |fault: &SceneFault| {
            let KeyPlace { path, section, start, .. } = &fault.place;
            (path, section) == (&place.path, &place.section) && (*start == place.start || *start == ANYWHERE)
        };
        let below = |fault: &SceneFault, key: &str| {
            let name = if place.section.is_empty() { key.to_owned() } else { format!("{}.{key}", place.section) };
            fault.place.section == name || fault.place.section.starts_with(&format!("{name}."))
        };
        let concerns =
            |fault: &SceneFault, key: &str| (same_section(fault) && fault.place.key == key) || below(fault, key);
        let far = |fault: &SceneFault, section: &str, key: &str| {
            let inside = fault.place.section == section && (key == "*" || fault.place.key == key);
            let deeper = fault.place.section.strip_prefix(section).and_then(|rest| rest.strip_prefix('.'));
            let whole = fault.place.section.is_empty() && fault.place.key == section;
            inside || whole || deeper.is_some_and(|table| key == "*" || table == key)
        };
        let hidden = kind == FaultKind::Missing && !place.section.is_empty();
        faults.iter().filter(|fault| counts(fault)).any(|fault| {
            (concerns(fault, &place.key) && (fault.place.start != ANYWHERE || kind == FaultKind::Missing))
                || (hidden && same_section(fault) && fault.kind == FaultKind::Other)
                || others.iter().any(|other| match (*other, other.split_once('.')) {
                    (OTHER_FILES, _) => fault.place.path != place.path,
                    (OWN_SECTION, _) => {
                        same_section(fault) || fault.place.section.starts_with(&format!("{}.", place.section))
                    }
                    (_, Some((section, key))) => far(fault, section, key),
                    (key, None) => concerns(fault, key),
                })
        })
    }

    /// Whether one of the keys that an error depends on stands in a section that is no longer read.
    fn is_unread(&self, place: &KeyPlace, others: &[&str]) -> bool {
        self.given_up.borrow().iter().any(|section| {
            others.iter().any(|other| match other.split_once('.') {
                Some((name, _)) => section.section == name,
                None => *other == OTHER_FILES && section.path != place.path,
            })
        })
    }

    /// Keeps the place of an error. Returns whether reading can go on.
    fn learn(&self, last: &LastFault) -> bool {
        let mut faults = self.faults.borrow_mut();
        let known = faults.iter_mut().find(|fault| fault.place == last.place);
        let times = known.map_or(1, |fault| {
            fault.times += 1;
            fault.times
        });
        if times > 2 || (last.follows && last.one_of_several) {
            let section = KeyPlace { key: String::new(), ..last.place.clone() };
            let mut given_up = self.given_up.borrow_mut();
            if section.section.is_empty() || given_up.contains(&section) {
                return false;
            }
            given_up.push(section);
        } else if times == 1 {
            if let (FaultKind::Unknown, Some(section)) = (last.kind, home(&last.place.key)) {
                let place = KeyPlace { section: section.to_owned(), start: ANYWHERE, ..last.place.clone() };
                faults.push(SceneFault { place, kind: FaultKind::Number, times: 0, misspelt: None });
            }
            if let Some(meant) = &last.meant {
                let place = KeyPlace { key: meant.clone(), ..last.place.clone() };
                if faults.iter().all(|fault| fault.place != place) {
                    faults.push(SceneFault {
                        place,
                        kind: FaultKind::Number,
                        times: 0,
                        misspelt: Some(last.place.key.clone()),
                    });
                }
            }
            faults.push(SceneFault { place: last.place.clone(), kind: last.kind, times: 1, misspelt: None });
        }
        true
    }

    /// The stand-in for a key. `None` where no error about the key is known.
    pub(super) fn instead(&self, place: &KeyPlace) -> Option<Instead> {
        let faults = self.faults.borrow();
        let fault = faults.iter().find(|fault| fault.place == *place)?;
        Some(match (&fault.misspelt, fault.times) {
            (Some(key), 0) => Instead::Of(key.clone()),
            (_, 1) => Instead::Valid,
            _ => Instead::Nothing,
        })
    }

    pub(super) fn is_empty(&self) -> bool {
        self.faults.borrow().is_empty()
    }

    pub(super) fn gave_up(&self, section: &KeyPlace) -> bool {
        self.given_up.borrow().contains(section)
    }
}
