//! Errors of response functions, with their place.

use std::path::PathBuf;

/// An error of a response function. The user can correct all of them (exit code 2).
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FunctionError {
    /// An unknown name.
    #[error("{0}")]
    Syntax(String),
    /// A rate out of range.
    #[error("the rate of '{function}' must be from {least:e} to {largest}, found {rate}")]
    Rate {
        /// Kind of the function.
        function: &'static str,
        /// Given value.
        rate: f64,
        /// Smallest allowed value.
        least: f64,
        /// Largest allowed value.
        largest: f64,
    },
    /// Coefficients that are not valid.
    #[error("a polynomial needs coefficients c0, c1, ... from -1e12 to 1e12, and one after c0 must differ from 0")]
    Coefficients,
    /// A polynomial of too high a degree.
    #[error("a polynomial has at most {most} coefficients, found {rows}: use a table or an expression instead")]
    TooManyCoefficients {
        /// Number of coefficients.
        rows: usize,
        /// Greatest number of coefficients.
        most: usize,
    },
    /// A function that does not start at 0 or does not end at 1.
    #[error("{function}: f({s}) must be {wanted}, found {value}")]
    End {
        /// Kind of the function.
        function: &'static str,
        /// Share of the time: 0 or 1.
        s: f64,
        /// Expected value: 0 or 1.
        wanted: f64,
        /// Given value.
        value: f64,
    },
    /// A function that decreases somewhere.
    #[error(
        "{function}: falls at s = {s:.6}, where f = {value:.6} and its rate is {rate:.3e}: it must never turn back"
    )]
    Falls {
        /// Kind of the function.
        function: &'static str,
        /// Share of the time.
        s: f64,
        /// Value there.
        value: f64,
        /// Rate there.
        rate: f64,
    },
    /// A function that is not finite, or jumps.
    #[error("{function}: {what} at s = {s:.6}: f must be finite on [0, 1], without a jump")]
    NotFinite {
        /// Kind of the function.
        function: &'static str,
        /// The problem.
        what: &'static str,
        /// Share of the time.
        s: f64,
    },
    /// A function that changes too fast for the device's pieces.
    #[error("{function}: changes too fast near s = {s:.6} (its {pieces} pieces err by {error:.1e})", pieces = super::pieces::MOST)]
    Sharp {
        /// Kind of the function.
        function: &'static str,
        /// Share of the time.
        s: f64,
        /// Largest error of f.
        error: f64,
    },
    /// A polynomial that cancels too strongly for f64.
    #[error("polynomial: its terms cancel, and f loses its digits at s = {s:.3}: use a table instead")]
    Cancels {
        /// Share of the time.
        s: f64,
    },
    /// A table that cannot be read.
    #[error("{}: cannot be read: {reason}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// Message of the system.
        reason: String,
    },
    /// A row of a table that is not valid.
    #[error("{}row {row}: {message}", file_prefix(.path))]
    Row {
        /// The file, where the samples come from one.
        path: Option<PathBuf>,
        /// Line of the file, or number of the sample, counted from 1.
        row: u64,
        /// The problem.
        message: String,
    },
    /// A table that is not valid as a whole.
    #[error("{}{message}", file_prefix(.path))]
    Table {
        /// The file, where the samples come from one.
        path: Option<PathBuf>,
        /// The problem.
        message: String,
    },
    /// Text that is not a valid GLSL expression of s.
    #[error("expression '{text}': {message}")]
    Expression {
        /// The text.
        text: String,
        /// The problem.
        message: String,
    },
}

fn file_prefix(path: &Option<PathBuf>) -> String {
    path.as_ref().map_or(String::new(), |path| format!("{}: ", path.display()))
}
