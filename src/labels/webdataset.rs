//! WebDataset: a tar whose members of one name and several endings are one sample. The endings of poses and masks are those of BOP-webdataset
//! (`bop_toolkit_lib/dataset/bop_webdataset.py`).

use std::io::{self, Write};

use serde_json::{Value, json};

use super::image::LabelledImage;
use super::mask::runs;
use super::silhouette::Silhouette;
use super::text::line;

/// Rights of a member.
const MODE: u32 = 0o644;

/// A tar under construction. Its bytes depend on its members alone: owner, group and time are 0.
pub struct Tar<W: Write>(tar::Builder<W>);

impl<W: Write> Tar<W> {
    /// An empty tar.
    pub fn new(writer: W) -> Self {
        Self(tar::Builder::new(writer))
    }

    /// Adds a sample: its key, and the endings and bytes of its files. They are sorted by their endings.
    ///
    /// # Errors
    /// What the writer returns, or a name beyond what a tar holds.
    pub fn add<'a>(&mut self, key: &str, files: impl IntoIterator<Item = (&'a str, &'a [u8])>) -> io::Result<()> {
        let mut files: Vec<(&str, &[u8])> = files.into_iter().collect();
        files.sort_unstable_by_key(|(ending, _)| *ending);
        for (ending, bytes) in files {
            let mut header = tar::Header::new_ustar();
            header.set_size(bytes.len() as u64);
            header.set_mode(MODE);
            header.set_uid(0);
            header.set_gid(0);
            header.set_mtime(0);
            header.set_entry_type(tar::EntryType::Regular);
            self.0.append_data(&mut header, format!("{key}.{ending}"), bytes)?;
        }
        Ok(())
    }

    /// Writes the end, and returns the writer.
    ///
    /// # Errors
    /// What the writer returns.
    pub fn finish(self) -> io::Result<W> {
        self.0.into_inner()
    }
}

/// The masks of all objects as lists of run lengths, by their places in `gt.json` (`save_masks` in `bop_imagewise.py`).
pub fn masks<'a>(image: &LabelledImage, masks: impl IntoIterator<Item = &'a [bool]>) -> String {
    let [width, height] = [image.width as usize, image.height as usize];
    let entry = |(place, mask): (usize, &[bool])| {
        (place.to_string(), json!({ "counts": runs(mask, [width, height]), "size": [height, width] }))
    };
    line(Value::Object(masks.into_iter().enumerate().map(entry).collect())) + "\n"
}

/// The visible masks of silhouettes.
pub fn visible_masks(image: &LabelledImage, silhouettes: &[Silhouette]) -> String {
    masks(image, silhouettes.iter().map(|silhouette| silhouette.visible.as_slice()))
}

/// The whole masks of silhouettes.
pub fn full_masks(image: &LabelledImage, silhouettes: &[Silhouette]) -> String {
    masks(image, silhouettes.iter().map(|silhouette| silhouette.full.as_slice()))
}
