//! What several tools use.

#[path = "../../tests/it/random.rs"]
pub mod random;
pub mod section;

use std::fmt::Display;
use std::process::ExitCode;

/// The exit code of a tool. An error is told.
pub fn exit_code(result: Result<(), impl Display>) -> ExitCode {
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}
