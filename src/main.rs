//! The `isotherm` program: parse arguments, call one function, choose the exit code.

fn main() {}
