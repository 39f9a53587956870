//! The `isotherm` program: parse arguments, call one function, choose the exit code.

use std::process::ExitCode;

fn main() -> ExitCode {
    isotherm::main()
}
