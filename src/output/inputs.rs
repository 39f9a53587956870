//! Files that a command reads, which none of its outputs may replace.

use std::fs;
use std::path::{Path, PathBuf};

use super::OutputError;

/// Refuses an output that would replace one of the inputs.
///
/// # Errors
/// [`OutputError::Overwrites`].
pub(crate) fn keep_inputs<'a>(output: &Path, inputs: impl IntoIterator<Item = &'a PathBuf>) -> Result<(), OutputError> {
    let output_file = real(output);
    match inputs.into_iter().any(|input| real(input) == output_file) {
        true => Err(OutputError::Overwrites(output.to_path_buf())),
        false => Ok(()),
    }
}

/// A path with links resolved. A path that does not exist stays as it is.
pub(crate) fn real(path: &Path) -> PathBuf {
    fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_input_is_known_whatever_its_path_is() {
        let folder = tempfile::tempdir().unwrap();
        let input = folder.path().join("series.csv");
        fs::write(&input, b"the user's").unwrap();
        let inputs = [input];
        let aliased = folder.path().join(".").join("series.csv");
        assert!(matches!(keep_inputs(&aliased, &inputs), Err(OutputError::Overwrites(_))));
        assert!(keep_inputs(&folder.path().join("other.csv"), &inputs).is_ok());
    }
}
