//! The built program as a user runs it: its arguments, what it prints and how it ends.

use std::path::Path;
use std::process::{Command, Output, Stdio};

use serde_json::Value;

/// `isotherm` in a folder, not yet run.
pub fn isotherm(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_isotherm"));
    command.args(arguments).current_dir(folder).stdin(Stdio::null());
    command
}

/// Runs it to its end.
pub fn end(mut command: Command) -> Output {
    command.output().expect("the program starts")
}

/// Runs it; fails where it does, with what it said. Returns its standard output.
pub fn succeed(folder: &Path, arguments: &[&str]) -> String {
    let output = end(isotherm(folder, arguments));
    assert!(output.status.success(), "{arguments:?}: {}", stderr(&output));
    String::from_utf8(output.stdout).expect("text")
}

/// The same where it prints JSON.
pub fn json(folder: &Path, arguments: &[&str]) -> Value {
    serde_json::from_str(&succeed(folder, arguments)).expect("JSON")
}

/// Standard error as text.
pub fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// The exit code, and the last line of standard error that starts with `error: `.
pub fn refusal(output: &Output) -> (Option<i32>, String) {
    let text = stderr(output);
    let line = text.lines().rfind(|line| line.starts_with("error: ")).unwrap_or_default();
    (output.status.code(), line.to_owned())
}

/// What a run left.
pub struct Ran {
    /// Exit code.
    pub code: i32,
    /// Standard output.
    pub out: String,
    /// Standard error.
    pub err: String,
}

/// Runs it under the validation layer where it computes on a device.
pub fn run(folder: &Path, arguments: &[&str]) -> Ran {
    let mut command = isotherm(folder, arguments);
    command.env("ISOTHERM_VALIDATION", "1");
    let output = end(command);
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    Ran { code: output.status.code().unwrap_or(-1), out: text(&output.stdout), err: text(&output.stderr) }
}
