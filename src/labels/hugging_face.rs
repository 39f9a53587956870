//! `README.md` of a data set: the card of Hugging Face, which says what `datasets.load_dataset` finds where.
//!
//! Each kind of picture is a configuration of its own. Without them `load_dataset` would mix all files of a folder. All configurations of a card have one builder, so
//! the tars and the index are loaded by their paths.

use std::fmt::Write;

use serde_json::Value;

use super::image::Split;
use super::places::CONVENTIONS;

/// The kinds of files of a data set, for its card.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CardFiles {
    /// Digital numbers, with their copy of 8 bits.
    pub(crate) numbers: bool,
    pub(crate) webdataset: bool,
    /// Maps of targets.
    pub(crate) instances: bool,
}

/// Name of a split in Hugging Face.
fn name(split: Split) -> &'static str {
    split.long_name()
}

/// The card. `splits` are those that have images, with their numbers.
pub(crate) fn card(craft: &str, splits: &[(Split, usize)], files: CardFiles) -> String {
    let mut kinds = vec!["depth", "temperature", "part", "planet", "mask", "mask_visib"];
    if files.numbers {
        kinds.splice(0..0, ["gray", "gray8"]);
    }
    if files.instances {
        kinds.push("instance");
    }
    let mut text = format!("---\npretty_name: {}\n", Value::from(format!("{craft} in the thermal infrared")));
    text += "tags:\n- thermal-infrared\n- spacecraft\n- pose-estimation\ntask_categories:\n- object-detection\n- \
             image-segmentation\n- depth-estimation\n- keypoint-detection\nconfigs:\n";
    let first = kinds[0];
    for kind in kinds {
        // A text takes everything that is written to it.
        let _ = writeln!(text, "- config_name: {kind}\n  drop_labels: true\n  data_files:");
        for (split, _) in splits {
            let _ = writeln!(text, "  - split: {}\n    path: \"{}/*/{kind}/*.png\"", name(*split), split.name());
        }
    }
    text += "---\n\n";
    let _ = writeln!(text, "# {craft} in the thermal infrared\n");
    let _ = writeln!(
        text,
        "Made by isotherm {}. `{CONVENTIONS}` states the convention of every label.\n",
        env!("CARGO_PKG_VERSION")
    );
    text += "| split | images |\n|---|---|\n";
    for (split, images) in splits {
        let _ = writeln!(text, "| {} | {images} |", name(*split));
    }
    let (split, folder) = splits.first().map_or(("train", "train"), |(split, _)| (name(*split), split.name()));
    let _ = write!(
        text,
        "\n```python\nfrom datasets import load_dataset\n\npictures = load_dataset(\"FOLDER\", \"{first}\", split=\"{split}\")\nindex = \
         load_dataset(\"parquet\", data_files=\"FOLDER/index.parquet\", split=\"train\")  # a row for each image of all splits\n"
    );
    if files.webdataset {
        let _ = writeln!(
            text,
            "samples = load_dataset(\"webdataset\", data_files={{\"{split}\": \"FOLDER/{folder}/*/webdataset.tar\"}}, split=\"{split}\")"
        );
    }
    text += "```\n\nEach configuration has one kind of picture, in the order of the paths. State a licence here before you publish the set.\n";
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_kind_of_file_is_a_configuration() {
        let files = CardFiles { numbers: true, webdataset: true, instances: false };
        let text = card("a \"craft\"", &[(Split::Train, 8), (Split::Validation, 2)], files);
        let configs: Vec<&str> = text.lines().filter_map(|line| line.strip_prefix("- config_name: ")).collect();
        assert_eq!(configs[..3], ["gray", "gray8", "depth"]);
        assert!(text.contains("  - split: validation\n    path: \"val/*/gray/*.png\"\n"), "{text}");
        assert!(text.starts_with("---\npretty_name: \"a \\\"craft\\\" in the thermal infrared\"\n"), "{text}");
        assert!(!text.contains("split: test"));
        let few = card("c", &[(Split::Train, 8)], CardFiles { numbers: false, webdataset: false, instances: true });
        assert!(!few.contains("gray") && !few.contains("webdataset"));
        assert!(few.contains("/instance/") && !text.contains("/instance/"));
    }
}
