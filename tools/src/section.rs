//! Sections of a page that a tool writes.

use std::path::{Path, PathBuf};

/// The option of cargo with which this program was built.
pub const PROFILE: &str = if cfg!(debug_assertions) { "" } else { "--release " };

/// Prints a section, and replaces it between its marks in a page where one is given.
///
/// # Errors
/// The page has no such marks, or cannot be read or written.
pub fn tell(name: &str, text: &str, page: Option<&Path>) -> Result<(), String> {
    println!("{text}");
    let Some(path) = page else { return Ok(()) };
    let failed = |error: std::io::Error| format!("{}: {error}", path.display());
    let old = std::fs::read_to_string(path).map_err(failed)?;
    let (begin, end) = (format!("<!-- {name} -->"), format!("<!-- /{name} -->"));
    let lacks = || format!("{} lacks the marks {begin} and {end}", path.display());
    let (before, rest) = old.split_once(&begin).ok_or_else(lacks)?;
    let (_, after) = rest.split_once(&end).ok_or_else(lacks)?;
    std::fs::write(path, format!("{before}{begin}\n{}\n{end}{after}", text.trim_end())).map_err(failed)
}

/// The program `isotherm`: the given one, or the one beside this program.
///
/// # Errors
/// There is none.
pub fn program(given: Option<PathBuf>) -> Result<PathBuf, String> {
    let beside = || Some(std::env::current_exe().ok()?.with_file_name("isotherm"));
    let found = given.or_else(beside).ok_or("this program does not know where it is")?;
    let found = std::path::absolute(&found).map_err(|error| error.to_string())?;
    if found.is_file() { Ok(found) } else { Err(format!("there is no {}; build it first", found.display())) }
}
