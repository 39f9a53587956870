//! The tutorial as a reader follows it: writes its files and runs its commands from `docs/tutorial.md`.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

use isotherm::internals::read_exr;

use super::model::shared_files::shared;
use super::program::stderr;

/// The model that replaces the reader's own.
const CRAFT: &str = "models/HST_42.glb";

/// An instruction to the reader.
#[derive(Debug, PartialEq)]
enum Block {
    /// Shell commands.
    Commands(String),
    /// A file to write, or lines to add to a file.
    File { name: String, text: String, added: bool },
}

fn repository(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

/// The blocks ```` ```sh ```` and ```` ```toml ```` of a page, in order.
fn blocks(page: &str) -> Vec<Block> {
    let mut found = Vec::new();
    for fenced in page.split("\n```").skip(1).step_by(2) {
        let (kind, text) = fenced.split_once('\n').expect("a block has lines");
        match kind {
            "sh" => found.push(Block::Commands(text.to_owned())),
            "toml" => {
                let first = text.lines().next().expect("a line");
                let added = first.starts_with("# Add to: ");
                let name = first.strip_prefix("# File: ").or_else(|| first.strip_prefix("# Add to: "));
                let name = name.unwrap_or_else(|| panic!("'{first}' does not name the file")).to_owned();
                found.push(Block::File { name, text: text.to_owned(), added });
            }
            "text" => {}
            other => panic!("a block of the kind '{other}'"),
        }
    }
    found
}

/// Follows a block in a folder. The error is the shell's message.
fn follow(folder: &Path, block: &Block) -> Result<(), String> {
    match block {
        Block::File { name, text, added } => {
            let mut options = std::fs::OpenOptions::new();
            let options = if *added { options.append(true) } else { options.write(true).create_new(true) };
            let mut file = options.open(folder.join(name)).map_err(|error| format!("{name}: {error}"))?;
            writeln!(file, "\n{text}").map_err(|error| error.to_string())
        }
        Block::Commands(text) => {
            let program = Path::new(env!("CARGO_BIN_EXE_isotherm")).parent().expect("a folder");
            let path = format!("{}:{}", program.display(), std::env::var("PATH").unwrap_or_default());
            let mut shell = Command::new("bash");
            shell.args(["-euo", "pipefail", "-c", text]).current_dir(folder).env("PATH", path);
            let output = shell.output().map_err(|error| error.to_string())?;
            if output.status.success() { Ok(()) } else { Err(format!("{text}: {}", stderr(&output))) }
        }
    }
}

/// Files in the page's table of results.
fn promised(page: &str) -> Vec<&str> {
    page.lines().filter_map(|line| line.strip_prefix("| `")?.split_once('`').map(|(name, _)| name)).collect()
}

#[test]
#[ignore = "long: tools/test --all"]
fn the_commands_of_the_tutorial_run_as_written() {
    let page = std::fs::read_to_string(repository("docs/tutorial.md")).expect("the tutorial");
    let blocks = blocks(&page);
    let commands = blocks.iter().filter(|block| matches!(block, Block::Commands(_))).count();
    assert_eq!((blocks.len(), commands), (8, 5), "{blocks:?}");
    assert_eq!(promised(&page).len(), 6, "{:?}", promised(&page));
    let Some(shared) = shared() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::copy(shared.join(CRAFT), folder.path().join("craft.glb")).expect("a copy of the craft");
    for block in &blocks {
        follow(folder.path(), block).unwrap_or_else(|error| panic!("{error}"));
    }

    for name in promised(&page).into_iter().chain(["first/contact_sheet.png", "noon.exr"]) {
        let length = std::fs::metadata(folder.path().join(name)).map(|file| file.len());
        assert!(length.as_ref().is_ok_and(|length| *length > 0), "{name}: {length:?}");
    }
    let (frame, header) = read_exr(&folder.path().join("out/frames/step_000024.exr")).expect("an image");
    assert!(header.materials.iter().any(|name| name == "hbltel_3"), "{:?}", header.materials);
    let craft: Vec<f32> = frame.radiance.iter().copied().filter(|radiance| *radiance > 1.0).collect();
    // The craft covers much of the image, and nothing is hotter than a surface that faces the Sun.
    assert!(
        craft.len() > frame.radiance.len() / 20,
        "{} of {} pixels show the craft",
        craft.len(),
        frame.radiance.len()
    );
    assert!(craft.iter().all(|radiance| *radiance < 150.0), "8 to 14 um, 150 W m-2 sr-1 are 400 K");
    let (first, _) = read_exr(&folder.path().join("first/frames/step_000024.exr")).expect("an image");
    assert!(first.radiance != frame.radiance, "the rules for materials must show");
}

#[test]
fn a_wrong_command_in_a_tutorial_fails() {
    let folder = tempfile::tempdir().expect("a folder");
    let page = "# Page\n\n```sh\nisotherm info\nisotherm inform craft.glb\nisotherm info\n```\n";
    let [block] = &blocks(page)[..] else { panic!("one block") };
    let error = follow(folder.path(), block).expect_err("there is no command 'inform'");
    assert!(error.contains("unrecognized subcommand 'inform'"), "{error}");
    let absent = Block::Commands("isotherm info craft.glb\n".to_owned());
    assert!(follow(folder.path(), &absent).is_err_and(|error| error.contains("craft.glb")));
    let added = Block::File { name: "craft.toml".to_owned(), text: String::new(), added: true };
    assert!(follow(folder.path(), &added).is_err(), "lines are added to a file that was written before");
}
