//! Runs the program as a user does.

use std::path::Path;
use std::process::Command;

/// What a run left.
pub struct Ran {
    /// Exit code.
    pub code: i32,
    /// Standard output.
    pub out: String,
    /// Standard error.
    pub err: String,
}

/// Runs `isotherm` in a folder, under the validation layer where it computes on a device.
pub fn isotherm(folder: &Path, arguments: &[&str]) -> Ran {
    let output = Command::new(env!("CARGO_BIN_EXE_isotherm"))
        .args(arguments)
        .current_dir(folder)
        .env("ISOTHERM_VALIDATION", "1")
        .output()
        .unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8_lossy(&bytes).into_owned();
    Ran { code: output.status.code().unwrap_or(-1), out: text(output.stdout), err: text(output.stderr) }
}
