//! The run of a saved state: its command line, device and files, and whether the run may go on.

use std::path::{Path, PathBuf};

use super::error::CliError;
use super::reach::ReachArguments;
use crate::output::OutputError;
use crate::output::folder::{Folder, STATE};
use crate::output::guarded::Kind;
use crate::output::job::FILES;
use crate::output::run_state::{RunIdentity, RunState};
use crate::output::state_file;
use crate::scene::file_hash;
use crate::simulation::prepare::Prepared;
use crate::simulation::target::Target;

/// A run that is to go on: its folder, which is locked, and its state.
pub(super) struct EarlierRun {
    pub(crate) folder: Folder,
    pub(crate) state: RunState,
}

impl EarlierRun {
    /// Opens a run. `None` where it is finished.
    pub(crate) fn open(root: &Path) -> Result<Option<Self>, CliError> {
        let folder = Folder::new(root, &FILES).reopen()?;
        if folder.is_finished() {
            return Ok(None);
        }
        let state: RunState = state_file::read(folder.guarded()?, STATE)?;
        let gone = {
            let guarded = folder.guarded()?;
            let is_there = |frame: &String| matches!(guarded.kind(frame), Ok(Some(Kind::File)));
            state.progress.frames().find(|frame| !is_there(frame))
        };
        let earlier = Self { folder, state };
        match gone {
            Some(frame) => {
                let path = earlier.folder.file(&frame);
                Err(earlier.refused(&format!("names {}, which is gone", path.display())))
            }
            None => Ok(Some(earlier)),
        }
    }

    fn refused(&self, reason: &str) -> CliError {
        OutputError::State(self.folder.state(), reason.to_owned()).into()
    }

    /// What the run was begun with.
    pub(crate) fn identity(&self) -> &RunIdentity {
        &self.state.identity
    }

    /// The scene file, from where the run was begun or from here. A given path of the same file is the same.
    pub(crate) fn scene(&self, given: Option<&Path>) -> PathBuf {
        let saved = PathBuf::from(&self.identity().scene);
        let directory = PathBuf::from(&self.identity().directory);
        let from_there = directory.join(&saved);
        let is_here = std::env::current_dir().is_ok_and(|here| here == directory);
        let path = if is_here || !from_there.exists() { saved } else { from_there };
        let same = |given: &Path| given.canonicalize().ok().zip(path.canonicalize().ok()).is_some_and(|(a, b)| a == b);
        given.filter(|given| !same(given)).map_or(path, Path::to_path_buf)
    }

    /// The device for `--device`.
    pub(crate) fn device(&self) -> String {
        let name = &self.identity().device;
        if *name == Target::Reference.name() { "cpu".to_owned() } else { name.clone() }
    }

    /// Refuses a run that would go on under another scene, device or check.
    pub(crate) fn compare(&self, now: &RunIdentity) -> Result<(), CliError> {
        let then = self.identity();
        let mut differences = Vec::new();
        for (what, then, now) in [("device", &then.device, &now.device), ("driver", &then.driver, &now.driver)] {
            if then != now {
                differences.push(format!("the {what} was {then} and is {now}"));
            }
        }
        for (number, (path, sum)) in then.files.iter().enumerate() {
            match now.files.get(number) {
                Some((_, now)) if now == sum => {}
                Some(_) => differences.push(format!("{path} has changed")),
                None => differences.push(format!("{path} is not used any more")),
            }
        }
        differences.extend(now.files.iter().skip(then.files.len()).map(|(path, _)| format!("{path} was not used")));
        if differences.is_empty() {
            return Ok(());
        }
        Err(self.refused(&format!("is of another run: {}", differences.join("; "))))
    }
}

/// Files of numbers that a glTF file names.
fn buffers_of(model: &Path) -> Vec<PathBuf> {
    let json: serde_json::Value =
        std::fs::read(model).ok().and_then(|bytes| serde_json::from_slice(&bytes).ok()).unwrap_or_default();
    let uris = json["buffers"].as_array().into_iter().flatten().filter_map(|buffer| buffer["uri"].as_str());
    let folder = model.parent().unwrap_or(Path::new(""));
    uris.filter(|uri| !uri.contains(':')).map(|uri| folder.join(uri)).filter(|path| path.is_file()).collect()
}

/// The lists by which a saved state names its run: version, device, scene, files and options.
pub(super) fn identity(
    prepared: &Prepared,
    scene: &Path,
    reach: ReachArguments,
    chosen: &Target,
    check: Option<usize>,
    command_line: &str,
) -> RunIdentity {
    let known = prepared.scene.files.iter().map(|path| (path.display().to_string(), prepared.hashes.of_file(path)));
    let buffers = buffers_of(&prepared.scene.model_path).into_iter().map(|path| {
        let bytes = std::fs::read(&path).unwrap_or_default();
        (path.display().to_string(), file_hash(&bytes))
    });
    RunIdentity {
        device: chosen.name(),
        driver: chosen.device().map_or(String::new(), |context| context.info.driver.clone()),
        scene: scene.display().to_string(),
        directory: std::env::current_dir().unwrap_or_default().display().to_string(),
        command_line: command_line.to_owned(),
        files: known.chain(buffers).collect(),
        allow_outside: reach.allows_outside(),
        check,
    }
}
