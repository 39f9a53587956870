//! The part of a scene that needs no model: time, orbit, attitude and environment.

use std::path::{Path, PathBuf};

use super::error::SceneError;
use super::faults::{Faults, read_all};
use super::file::{SourceFile, read_text};
use super::section::Section;
use super::{Time, attitude, environment, keys, orbit, time, work};
use crate::environment::trajectory::Trajectory;
use crate::environment::{Attitude, Environment, Orbit};
use crate::files::Reach;
use crate::text::plain;

/// Time, orbit, attitude and environment of a scene.
#[derive(Debug, Clone)]
pub struct SkyScene {
    /// Name for titles: the file's `name` key, or its stem.
    pub(crate) name: String,
    pub(crate) time: Time,
    /// The orbit or trajectory.
    pub orbit: Orbit,
    /// The orientation of the craft.
    pub attitude: Attitude,
    /// Sun, planet and space.
    pub environment: Environment,
    /// One sentence for each default that was used.
    pub(crate) assumptions: Vec<String>,
    /// Every file that was read, the scene file first. Empty inside a whole [`super::Scene`].
    pub(crate) files: Vec<PathBuf>,
}

impl SkyScene {
    /// Reads and checks these sections of a scene file, which may name the files of `reach`, and ignores the others.
    ///
    /// # Errors
    /// A file that cannot be read, or an error in it with its line and key.
    pub fn load(path: &Path, reach: &Reach) -> Result<Self, SceneError> {
        let text = read_text(path)?;
        read_all(path, |faults| Self::parse(&text, path, reach, faults))
    }

    fn parse(text: &str, path: &Path, reach: &Reach, faults: &Faults) -> Result<Self, SceneError> {
        let file = SourceFile::new(path, text, reach, faults);
        let table = file.parse()?;
        let root = Section::root(&file, &table, keys::ROOT)?;
        let mut assumptions = Vec::new();
        let mut files = vec![path.to_path_buf()];
        let mut sky = Self::read(&root, path, &mut files, &mut assumptions)?;
        assumptions.extend(faults.take_small());
        (sky.assumptions, sky.files) = (assumptions, files);
        Ok(sky)
    }

    /// Reads the sections from the root of a scene. Files that they name join `files`.
    pub(super) fn read(
        root: &Section,
        path: &Path,
        files: &mut Vec<PathBuf>,
        assumptions: &mut Vec<String>,
    ) -> Result<Self, SceneError> {
        let steps = root.required_table("time", keys::TIME)?;
        let time = time::read(&steps, assumptions)?;
        let environment = environment::read(&root.required_table("environment", keys::ENVIRONMENT)?, assumptions)?;
        let section = root.required_table("orbit", keys::ORBIT)?;
        let orbit = orbit::read(&section, environment.planet_radius, time.start, files, assumptions)?;
        work::check_steps(&steps, &time, &orbit)?;
        let start = orbit.trajectory().map(Trajectory::start).or(time.start);
        let attitude = attitude::read(&root.required_table("attitude", keys::ATTITUDE)?, start, files, assumptions)?;
        let name = match root.name("name")? {
            Some(name) => name,
            None => plain(&path.file_stem().unwrap_or(path.as_os_str()).to_string_lossy()).into_owned(),
        };
        Ok(Self { name, time, orbit, attitude, environment, assumptions: Vec::new(), files: Vec::new() })
    }
}
