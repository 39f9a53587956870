//! The error of a saved state that does not fit a scene, and the checks that find it.

/// A saved state of another scene.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Misfit {
    /// A list has another length.
    #[error("its list of {name} has {length} values, not {expected}")]
    Length {
        /// What the list holds.
        name: String,
        /// Its length.
        length: usize,
        /// The length in this scene.
        expected: usize,
    },
    /// A part of the state that this scene needs is absent.
    #[error("it has no state of {0}")]
    Absent(String),
}

/// Refuses a list of a saved state whose length is not that of the scene.
///
/// # Errors
/// Another length.
pub(crate) fn check_length<T>(name: &str, list: &[T], expected: usize) -> Result<(), Misfit> {
    if list.len() == expected {
        return Ok(());
    }
    Err(Misfit::Length { name: name.to_owned(), length: list.len(), expected })
}

/// A part of a saved state that the scene needs.
///
/// # Errors
/// The part is absent.
pub(crate) fn part<'a, T>(name: &str, saved: &'a Option<T>) -> Result<&'a T, Misfit> {
    saved.as_ref().ok_or_else(|| Misfit::Absent(name.to_owned()))
}
