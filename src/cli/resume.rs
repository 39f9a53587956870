//! The run of a saved state: its command line, device and files, and whether the run may go on.

use std::path::{Path, PathBuf};

use super::error::CliError;
use super::reach::ReachArguments;
use crate::output::OutputError;
use crate::output::folder::Folder;
use crate::output::job::{FILES, frames_of};
use crate::output::state_file;
use crate::saved::{Saved, SavedError};
use crate::scene::file_hash;
use crate::simulation::prepare::Prepared;
use crate::simulation::target::Target;

/// A run that is to go on: its folder, which is locked, and its state.
pub(super) struct EarlierRun {
    pub(crate) folder: Folder,
    pub(crate) state: Saved,
}

impl EarlierRun {
    /// Opens a run. `None` where it is finished.
    pub(crate) fn open(root: &Path) -> Result<Option<Self>, CliError> {
        let folder = Folder::new(root, &FILES).reopen()?;
        if folder.is_finished() {
            return Ok(None);
        }
        let state = state_file::read(&folder.state())?;
        let earlier = Self { folder, state };
        let now = env!("CARGO_PKG_VERSION");
        let version = earlier.text("version")?;
        if version != now {
            return Err(earlier.refused(&format!("is of version {version}, and this is version {now}")));
        }
        let frames = frames_of(&earlier.state).map_err(|error| earlier.refused(&error.to_string()))?;
        match frames.iter().map(|frame| earlier.folder.file(frame)).find(|path| !path.exists()) {
            Some(path) => Err(earlier.refused(&format!("names {}, which is gone", path.display()))),
            None => Ok(Some(earlier)),
        }
    }

    fn refused(&self, reason: &str) -> CliError {
        OutputError::State(self.folder.state(), reason.to_owned()).into()
    }

    fn text(&self, name: &str) -> Result<String, CliError> {
        self.state.text(&format!("run.{name}")).map_err(|error: SavedError| self.refused(&error.to_string()))
    }

    /// The scene file, from where the run was begun or from here. A given path of the same file is the same.
    pub(crate) fn scene(&self, given: Option<&Path>) -> Result<PathBuf, CliError> {
        let saved = PathBuf::from(self.text("scene")?);
        let directory = PathBuf::from(self.text("directory")?);
        let from_there = directory.join(&saved);
        let is_here = std::env::current_dir().is_ok_and(|here| here == directory);
        let path = if is_here || !from_there.exists() { saved } else { from_there };
        let same = |given: &Path| given.canonicalize().ok().zip(path.canonicalize().ok()).is_some_and(|(a, b)| a == b);
        Ok(given.filter(|given| !same(given)).map_or(path, Path::to_path_buf))
    }

    pub(crate) fn device(&self) -> Result<String, CliError> {
        let name = self.text("device")?;
        Ok(if name == Target::Reference.name() { "cpu".to_owned() } else { name })
    }

    pub(crate) fn command_line(&self) -> Result<String, CliError> {
        self.text("command_line")
    }

    /// Nodes that the reference also steps.
    pub(crate) fn check(&self) -> Result<Option<usize>, CliError> {
        let saved: Result<[u64; 1], _> = self.state.array("run.check");
        let [nodes] = saved.map_err(|error| self.refused(&error.to_string()))?;
        Ok(usize::try_from(nodes).ok().filter(|nodes| *nodes > 0))
    }

    /// Whether the run was begun with `--allow-outside`.
    pub(crate) fn allows_outside(&self) -> Result<bool, CliError> {
        let saved: Result<[u64; 1], _> = self.state.array("run.allow_outside");
        Ok(saved.map_err(|error| self.refused(&error.to_string()))? == [1])
    }

    /// Refuses a run that would go on under another scene, device or check.
    pub(crate) fn compare(&self, now: &Saved) -> Result<(), CliError> {
        let mut differences = Vec::new();
        for (name, what) in [("device", "device"), ("driver", "driver")] {
            let (then, now) = (self.text(name)?, now.text(&format!("run.{name}")).unwrap_or_default());
            if then != now {
                differences.push(format!("the {what} was {then} and is {now}"));
            }
        }
        let files = |text: String| -> Vec<(String, String)> {
            text.lines().filter_map(|line| line.split_once(' ')).map(|(a, b)| (b.to_owned(), a.to_owned())).collect()
        };
        let (then, is) = (files(self.text("files")?), files(now.text("run.files").unwrap_or_default()));
        for (number, (path, sum)) in then.iter().enumerate() {
            match is.get(number) {
                Some((_, now)) if now == sum => {}
                Some(_) => differences.push(format!("{path} has changed")),
                None => differences.push(format!("{path} is not used any more")),
            }
        }
        differences.extend(is.iter().skip(then.len()).map(|(path, _)| format!("{path} was not used")));
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
) -> Saved {
    let mut saved = Saved::default();
    let driver = chosen.device().map_or(String::new(), |context| context.info.driver.clone());
    let directory = std::env::current_dir().unwrap_or_default();
    let known = prepared.scene.files.iter().map(|path| {
        let sum = prepared.file_hashes.get(path).cloned().unwrap_or_default();
        format!("{sum} {}", path.display())
    });
    let buffers = buffers_of(&prepared.scene.model_path).into_iter().map(|path| {
        let bytes = std::fs::read(&path).unwrap_or_default();
        format!("{} {}", file_hash(&bytes), path.display())
    });
    let files = known.chain(buffers);
    for (name, text) in [
        ("version", env!("CARGO_PKG_VERSION").to_owned()),
        ("device", chosen.name()),
        ("driver", driver),
        ("scene", scene.display().to_string()),
        ("directory", directory.display().to_string()),
        ("command_line", command_line.to_owned()),
        ("files", files.collect::<Vec<_>>().join("\n")),
    ] {
        saved.put_text(format!("run.{name}"), &text);
    }
    saved.put("run.allow_outside", &[u64::from(reach.allows_outside())]);
    saved.put("run.check", &[check.unwrap_or(0) as u64]);
    saved
}
