//! WebDataset: a tar whose members of one name and several endings are one sample. The endings of poses and masks follow BOP-webdataset
//! (`bop_toolkit_lib/dataset/bop_webdataset.py`).

use std::io::{self, Write};

use serde_json::{Value, json};

use super::image::LabelledImage;
use super::mask::runs;
use super::silhouette::Silhouette;
use super::text::line;

/// Rights of a member.
const MODE: u32 = 0o644;

/// A tar under construction. The bytes depend on the members alone: owner, group and time are 0.
pub(crate) struct Tar<W: Write>(tar::Builder<W>);

impl<W: Write> Tar<W> {
    pub(crate) fn new(writer: W) -> Self {
        Self(tar::Builder::new(writer))
    }

    /// Adds a sample: its key, and the endings and bytes of its files. The files are sorted by their endings.
    ///
    /// # Errors
    /// The writer fails, or a name is too long for a tar.
    pub(crate) fn add<'a>(
        &mut self,
        key: &str,
        files: impl IntoIterator<Item = (&'a str, &'a [u8])>,
    ) -> io::Result<()> {
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
    /// The writer fails.
    pub(crate) fn finish(self) -> io::Result<W> {
        self.0.into_inner()
    }
}

/// The masks of all objects as lists of run lengths, by their places in `gt.json` (`save_masks` in `bop_imagewise.py`).
pub(crate) fn masks<'a>(image: &LabelledImage, masks: impl IntoIterator<Item = &'a [bool]>) -> String {
    let [width, height] = [image.width as usize, image.height as usize];
    let entry = |(place, mask): (usize, &[bool])| {
        (place.to_string(), json!({ "counts": runs(mask, [width, height]), "size": [height, width] }))
    };
    line(Value::Object(masks.into_iter().enumerate().map(entry).collect())) + "\n"
}

pub(crate) fn visible_masks(image: &LabelledImage, silhouettes: &[Silhouette]) -> String {
    masks(image, silhouettes.iter().map(|silhouette| silhouette.visible.as_slice()))
}

pub(crate) fn full_masks(image: &LabelledImage, silhouettes: &[Silhouette]) -> String {
    masks(image, silhouettes.iter().map(|silhouette| silhouette.full.as_slice()))
}

#[cfg(test)]
mod tests {
    use std::io::Read;

    use super::super::image::tests::small;
    use super::*;

    /// A sample: its key, and endings with contents.
    type Sample<'a> = (&'a str, &'a [(&'a str, &'a [u8])]);

    fn tar_of(samples: &[Sample<'_>]) -> Vec<u8> {
        let mut tar = Tar::new(Vec::new());
        for (key, files) in samples {
            tar.add(key, files.iter().copied()).expect("it takes them");
        }
        tar.finish().expect("it ends")
    }

    #[test]
    fn a_tar_holds_its_samples_and_nothing_of_the_day() {
        let bytes = tar_of(&[
            ("000003_000001", &[("json", b"{}"), ("gray.png", b"png")]),
            ("000003_000002", &[("json", b"[]")]),
        ]);
        let mut archive = tar::Archive::new(bytes.as_slice());
        let mut computed = Vec::new();
        for entry in archive.entries().expect("entries") {
            let mut entry = entry.expect("an entry");
            let header = entry.header();
            assert_eq!((header.mtime().ok(), header.uid().ok(), header.gid().ok()), (Some(0), Some(0), Some(0)));
            let name = entry.path().expect("a name").to_string_lossy().into_owned();
            let mut content = String::new();
            entry.read_to_string(&mut content).expect("its bytes");
            computed.push((name, content));
        }
        let expected = [("000003_000001.gray.png", "png"), ("000003_000001.json", "{}"), ("000003_000002.json", "[]")];
        assert_eq!(computed, expected.map(|(name, content)| (name.to_owned(), content.to_owned())));
        // The order of the endings does not matter, and the bytes do.
        let again = [
            ("000003_000001", &[("gray.png", b"png".as_slice()), ("json", b"{}")][..]),
            ("000003_000002", &[("json", b"[]")]),
        ];
        assert_eq!(tar_of(&again), bytes);
        assert_ne!(tar_of(&again[..1]), bytes);
    }

    #[test]
    fn masks_are_run_lengths_down_the_columns() {
        let image = small();
        let visible: Vec<bool> = image.channels.part.iter().map(|part| *part == 1).collect();
        assert_eq!(masks(&image, [visible.as_slice()]), "{\"0\":{\"counts\":[4,1,2,1,4],\"size\":[3,4]}}\n");
    }
}
