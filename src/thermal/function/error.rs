//! What is wrong with a response function, said with where.

use std::path::PathBuf;

/// Why something is no response function. The user can mend every one of them (exit code 2).
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FunctionError {
    /// A function that is not known by that name.
    #[error("{0}")]
    Syntax(String),
    /// A rate out of range.
    #[error("the rate of '{function}' must be above 0 and at most {largest}, found {rate}")]
    Rate {
        /// Kind of the function.
        function: &'static str,
        /// What was found.
        rate: f64,
        /// What is possible.
        largest: f64,
    },
    /// Coefficients that are none.
    #[error("a polynomial needs finite coefficients c0, c1, ... of which one after c0 is not 0")]
    Coefficients,
    /// A polynomial of too high a degree.
    #[error("a polynomial has at most {most} coefficients, found {found}: use a table or an expression instead")]
    TooManyCoefficients {
        /// How many there are.
        found: usize,
        /// How many there may be.
        most: usize,
    },
    /// A function that does not start at 0 or does not end at 1.
    #[error("{function}: f({s}) must be {wanted}, found {found}")]
    End {
        /// Kind of the function.
        function: &'static str,
        /// Where: 0 or 1.
        s: f64,
        /// 0 or 1.
        wanted: f64,
        /// What it is.
        found: f64,
    },
    /// A function that falls somewhere.
    #[error(
        "{function}: falls at s = {s:.6}, where f = {value:.6} and its rate is {rate:.3e}: it must never turn back"
    )]
    Falls {
        /// Kind of the function.
        function: &'static str,
        /// Where.
        s: f64,
        /// Its value there.
        value: f64,
        /// Its rate there.
        rate: f64,
    },
    /// A function that is not finite, or jumps.
    #[error("{function}: {what} at s = {s:.6}: f must be finite on [0, 1], without a jump")]
    NotFinite {
        /// Kind of the function.
        function: &'static str,
        /// What is wrong.
        what: &'static str,
        /// Where.
        s: f64,
    },
    /// A function that changes faster than the device's pieces follow.
    #[error("{function}: changes too fast near s = {s:.6} (its {pieces} pieces err by {error:.1e})", pieces = 2 * super::pieces::MOST)]
    Sharp {
        /// Kind of the function.
        function: &'static str,
        /// Where.
        s: f64,
        /// Largest error of f.
        error: f64,
    },
    /// A polynomial that f64 cannot evaluate.
    #[error("polynomial: its terms cancel so far that f is lost at s = {s:.3}: use a table instead")]
    Cancels {
        /// Where.
        s: f64,
    },
    /// A table that cannot be read.
    #[error("{}: cannot be read: {reason}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the system said.
        reason: String,
    },
    /// A row of a table that cannot be.
    #[error("{}row {row}: {message}", file_prefix(.path))]
    Row {
        /// The file, where the samples come from one.
        path: Option<PathBuf>,
        /// Line of the file, or number of the sample; from 1.
        row: u64,
        /// What is wrong.
        message: String,
    },
    /// A table that is wrong as a whole.
    #[error("{}{message}", file_prefix(.path))]
    Table {
        /// The file, where the samples come from one.
        path: Option<PathBuf>,
        /// What is wrong.
        message: String,
    },
    /// Text that is no GLSL expression of s.
    #[error("expression '{text}': {message}")]
    Expression {
        /// The text.
        text: String,
        /// What is wrong.
        message: String,
    },
}

fn file_prefix(path: &Option<PathBuf>) -> String {
    path.as_ref().map_or(String::new(), |path| format!("{}: ", path.display()))
}
