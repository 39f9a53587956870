//! The built program as a user runs it: arguments, output and exit code.

use std::path::Path;
use std::process::{Command, Output, Stdio};

use serde_json::Value;

/// The command `isotherm` in a folder. It is not started.
pub fn isotherm(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_isotherm"));
    command.args(arguments).current_dir(folder).stdin(Stdio::null());
    command
}

pub fn end(mut command: Command) -> Output {
    command.output().expect("the program starts")
}

/// Runs it and returns its standard output. If it fails, the test fails with its message.
pub fn succeed(folder: &Path, arguments: &[&str]) -> String {
    let output = end(isotherm(folder, arguments));
    assert!(output.status.success(), "{arguments:?}: {}", stderr(&output));
    String::from_utf8(output.stdout).expect("text")
}

/// Runs it and parses its output as JSON.
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

/// The results of a run.
pub struct Ran {
    pub code: i32,
    pub out: String,
    pub err: String,
}

/// Runs it. If it computes on a device, the validation layer is on.
pub fn run(folder: &Path, arguments: &[&str]) -> Ran {
    let mut command = isotherm(folder, arguments);
    command.env("ISOTHERM_VALIDATION", "1");
    let output = end(command);
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    Ran { code: output.status.code().unwrap_or(-1), out: text(&output.stdout), err: text(&output.stderr) }
}
