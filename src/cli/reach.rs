//! `--allow-outside`: which files a scene or a glTF may name.

use std::path::Path;

use super::error::CliError;
use crate::files::Reach;
use crate::scene::Scene;
use crate::simulation::prepare_error::PrepareError;

#[derive(clap::Args, Clone, Copy, Default)]
pub(super) struct ReachArguments {
    /// Read also files outside the folder of the scene or glTF that names them
    #[arg(long)]
    allow_outside: bool,
}

impl ReachArguments {
    /// Allows files outside the folder if an earlier part of the run did.
    pub(super) fn or(self, allow_outside: bool) -> Self {
        Self { allow_outside: self.allow_outside || allow_outside }
    }

    pub(super) fn allows_outside(self) -> bool {
        self.allow_outside
    }

    /// The files that the file at `path` may name.
    pub(super) fn of(self, path: &Path) -> Reach {
        if self.allow_outside { Reach::Anywhere } else { Reach::of(path) }
    }

    pub(super) fn scene(self, path: &Path) -> Result<Scene, CliError> {
        Ok(Scene::load_within(path, self.of(path)).map_err(PrepareError::from)?)
    }
}
