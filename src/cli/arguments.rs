//! Arguments that commands share, and the command line as text. Arguments need not be UTF-8.

use std::path::{Path, PathBuf};

use clap::builder::{PathBufValueParser, TypedValueParser};

use crate::output::destination::STANDARD_OUTPUT;
use crate::text::is_hidden;

/// The parser of the folder that a command writes. Standard output takes one file, and no folder.
pub(super) fn folder() -> impl TypedValueParser<Value = PathBuf> {
    PathBufValueParser::new().try_map(|path| {
        if path == Path::new(STANDARD_OUTPUT) {
            return Err(
                "standard output takes one file, and this command writes a folder of files: name a folder, such as \
                        out/run, or ./- for one that is called -",
            );
        }
        Ok(path)
    })
}

/// The folder of files that a command writes.
#[derive(clap::Args)]
pub(super) struct FolderArguments {
    /// Output folder. Without --force it must be empty or absent
    #[arg(short, long, value_name = "DIR", value_parser = folder())]
    pub(super) output: PathBuf,
    /// Replace the files that isotherm wrote into the output folder, and keep all others. It refuses a file that was changed since
    #[arg(long)]
    pub(super) force: bool,
}

/// The command line, with the program's name.
pub(super) fn command_line() -> String {
    std::env::args_os().map(|argument| argument.to_string_lossy().into_owned()).collect::<Vec<_>>().join(" ")
}

/// Whether the command line holds characters that must not be shown as they are.
pub(super) fn hold_hidden() -> bool {
    command_line().contains(is_hidden)
}
