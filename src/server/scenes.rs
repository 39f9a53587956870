//! The scenes of a server, and the names by which clients ask for them. A client can name no other file.

use std::path::{Path, PathBuf};

use super::error::ServerError;
use crate::scene::Scene;
use crate::simulation::kept_casts::KeptCasts;
use crate::simulation::prepare::Prepared;

struct Named {
    names: Vec<String>,
    path: PathBuf,
    scene: Scene,
}

/// The scenes of a server.
#[derive(Default)]
pub struct Scenes {
    all: Vec<Named>,
    /// Findings for the crafts of scenes, from before any session.
    casts: Vec<KeptCasts>,
}

impl Scenes {
    /// Adds a scene, and returns it as it was prepared. Without `name`, the scene has three names: the path of its file as given, the file name, and the file name without its ending.
    ///
    /// # Errors
    /// A scene that can not run, or a name that another scene has.
    pub fn add(&mut self, name: Option<&str>, path: &Path, scene: Scene) -> Result<Prepared, ServerError> {
        let mut names = match name {
            Some(name) => vec![name.to_owned()],
            None => {
                let parts = [Some(path.as_os_str()), path.file_name(), path.file_stem()];
                parts.into_iter().flatten().map(|part| part.to_string_lossy().into_owned()).collect()
            }
        };
        names.dedup();
        for name in &names {
            if let Some(other) = self.named(name) {
                let (one, other) = (other.path.clone(), path.to_path_buf());
                return Err(ServerError::Twice { name: name.clone(), one, other });
            }
        }
        let prepared = Prepared::from_scene(scene.clone(), &mut |_| ())?;
        self.all.push(Named { names, path: path.to_path_buf(), scene });
        Ok(prepared)
    }

    /// Keeps the findings of a craft's rays for all sessions.
    pub(crate) fn keep_casts(&mut self, prepared: &Prepared) {
        self.casts.extend(prepared.exchange.iter().map(|craft| craft.kept_casts()));
    }

    /// Lets a craft have the findings that are kept for it.
    pub(crate) fn lend_casts(&self, prepared: &Prepared) {
        for (craft, casts) in
            prepared.exchange.iter().flat_map(|craft| self.casts.iter().map(move |casts| (craft, casts)))
        {
            // Those of another scene do not fit.
            let _ = craft.take_casts(casts);
        }
    }

    fn named(&self, name: &str) -> Option<&Named> {
        self.all.iter().find(|scene| scene.names.iter().any(|known| known == name))
    }

    pub(crate) fn get(&self, name: &str) -> Option<&Scene> {
        self.named(name).map(|named| &named.scene)
    }

    /// The shortest name of each scene, for messages.
    pub(crate) fn known(&self) -> String {
        let names = self.all.iter().filter_map(|scene| scene.names.iter().min_by_key(|name| name.len()));
        names.map(String::as_str).collect::<Vec<_>>().join(", ")
    }

    /// The scenes of the server, in words.
    pub(crate) fn told(&self) -> String {
        match self.known() {
            names if names.is_empty() => "no scene is here".to_owned(),
            names => format!("the scenes here are {names}"),
        }
    }
}
