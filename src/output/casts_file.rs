//! The file of findings of rays beside a saved state: it is written where they found more, and one that does not serve is told of and left alone.
//!
//! A state is whole without it. So no fault of this file ends a command, and results are the same with it and without it.

use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use super::OutputError;
use super::console::say;
use super::destination::Destination;
use super::folder::{CASTS, Folder};
use super::guarded::Access;
use super::state_file::{self, SavedState, decode, encode};
use crate::files::{self, FileFault};
use crate::simulation::exchange::ExchangeCraft;
use crate::simulation::kept_casts::KeptCasts;
use crate::simulation::prepare::Prepared;
use crate::trace::span;

/// Most bytes of a file that is read: twice the memory that findings may take.
const MOST_BYTES: u64 = 1 << 30;

impl SavedState for KeptCasts {
    const KIND: &str = "file of cast rays beside a state";
}

/// Path of the file beside a state's.
pub(crate) fn beside(state: &Path) -> PathBuf {
    let mut path = state.as_os_str().to_owned();
    path.push(".casts");
    path.into()
}

/// Writes the file beside a state that was written to a file. A stream has no place beside it.
pub(crate) fn write_beside(state: &Path, prepared: &Prepared) {
    let Some(craft) = with_findings(prepared) else { return };
    let _saves = span("saving the cast rays");
    let path = beside(state);
    let written = (|| match (Destination::at(state)?, Destination::at(&path)?) {
        (Destination::File(_), to @ Destination::File(_)) => to.write_bytes(&encode(&craft.kept_casts())?),
        _ => Ok(()),
    })();
    tell_unwritten(written);
}

/// Lets a craft have the findings in the file beside a state.
pub(crate) fn read_beside(state: &Path, prepared: &Prepared) {
    let path = beside(state);
    take(prepared, &path, || files::open(&path).map(|(file, _)| file));
}

/// Lets the craft of a run that goes on have the findings in the file in its folder.
pub(crate) fn read_in(folder: &Folder, prepared: &Prepared) {
    let opened = || match folder.guarded() {
        Ok(guarded) => Ok(guarded.file(CASTS, Access::Read)?),
        Err(error) => Err(io::Error::other(error.to_string()).into()),
    };
    take(prepared, &folder.file(CASTS), opened);
}

/// The file in the folder of a run.
#[derive(Debug, Default)]
pub(super) struct CastsOfRun {
    /// Findings that the craft had had when the file was written last.
    written: AtomicU64,
}

impl CastsOfRun {
    /// Writes the file where something was found since.
    pub(super) fn save(&self, folder: &Folder, prepared: &Prepared) {
        let Some(craft) = with_findings(prepared) else { return };
        let found = craft.found_so_far();
        if self.written.swap(found, Ordering::Relaxed) == found {
            return;
        }
        let _saves = span("saving the cast rays");
        let written = folder.guarded().and_then(|guarded| state_file::write(guarded, CASTS, &craft.kept_casts()));
        tell_unwritten(written);
    }
}

fn with_findings(prepared: &Prepared) -> Option<&ExchangeCraft> {
    prepared.exchange.as_deref().filter(|craft| craft.found_so_far() > 0)
}

fn tell_unwritten(written: Result<(), OutputError>) {
    if let Err(error) = written {
        say!("note: {error}; a run from this state casts its rays anew");
    }
}

fn take(prepared: &Prepared, path: &Path, open: impl FnOnce() -> Result<File, FileFault>) {
    let Some(craft) = &prepared.exchange else { return };
    let _reads = span("reading the cast rays");
    match taken(craft, open) {
        Ok(count) => say!("note: rays of {count} poses are in {}: they are not cast again", path.display()),
        Err(fault) if fault.is_absence() => {}
        Err(fault) => say!("note: {} {fault}; rays are cast anew", path.display()),
    }
}

/// Why a file does not serve.
#[derive(Debug, thiserror::Error)]
enum CastsFault {
    #[error("cannot be read: {0}")]
    File(#[from] FileFault),
    #[error("has more than {MOST_BYTES} bytes")]
    Long,
    #[error(transparent)]
    State(#[from] state_file::StateFault),
    #[error(transparent)]
    Misfit(#[from] crate::simulation::kept_casts::CastsMisfit),
}

impl CastsFault {
    fn is_absence(&self) -> bool {
        matches!(self, Self::File(FileFault::Io(error)) if error.kind() == io::ErrorKind::NotFound)
    }
}

fn taken(craft: &ExchangeCraft, open: impl FnOnce() -> Result<File, FileFault>) -> Result<usize, CastsFault> {
    let mut bytes = Vec::new();
    open()?.take(MOST_BYTES + 1).read_to_end(&mut bytes).map_err(FileFault::from)?;
    if bytes.len() as u64 > MOST_BYTES {
        return Err(CastsFault::Long);
    }
    Ok(craft.take_casts(&decode::<KeptCasts>(&bytes)?)?)
}
