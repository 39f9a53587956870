//! `isotherm dataset`: makes a data set of labelled images.

use std::path::{Path, PathBuf};

use super::arguments::folder;
use super::device::{DeviceArguments, check_validation};
use super::error::CliError;
use super::progress::{progress_bar, stop_flag};
use super::reach::ReachArguments;
use crate::dataset::error::DatasetError;
use crate::dataset::orbit_folder::CHECKSUMS;
use crate::dataset::preview::{SAMPLES, preview};
use crate::dataset::scene_values::SceneText;
use crate::dataset::spec::Spec;
use crate::dataset::store::{Begin, identity};
use crate::dataset::verify::{Verified, again, checksums, copy_of_spec, labels, picked};
use crate::dataset::{
    make::make,
    order::{DatasetOrder, DatasetSummary, Shard},
};
use crate::output::console::{self, answer, say};
use crate::output::destination::{Destination, destinations};
use crate::output::inputs::keep_inputs;
use crate::simulation::target::Target;
use crate::stop::{Stopped, until};

/// Make a data set of labelled images, as a SPEC file describes it (docs/datasets.md).
#[derive(clap::Args)]
#[command(
    args_conflicts_with_subcommands = true,
    subcommand_negates_reqs = true,
    after_help = "Examples:\n  isotherm dataset models/cubesat_dataset.toml -o out/cubesat_set\n  \
isotherm dataset models/cubesat_dataset.toml -o out/cubesat_set --resume\n  \
isotherm dataset models/station_dataset.toml -o out/station_set --shard 0/3"
)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    other: Option<Other>,
    /// SPEC file (TOML, described in docs/datasets.md)
    #[arg(required = true)]
    spec: Option<PathBuf>,
    /// Folder of the data set. It is empty or absent, or holds other shards of the same data set
    #[arg(short, long, value_name = "DIR", required = true, value_parser = folder())]
    output: Option<PathBuf>,
    /// Make the orbits j with j mod N = I. Shards may run at once, on one machine or several, and write into the same folder
    #[arg(long, value_name = "I/N", default_value = "0/1", value_parser = parse_shard)]
    shard: Shard,
    /// Keep the orbits that are there, and make the others. The files come out as in an undisturbed run
    #[arg(long, conflicts_with = "force")]
    resume: bool,
    /// Remove the data set that is in the folder first
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    reach: ReachArguments,
    #[command(flatten)]
    device: DeviceArguments,
}

/// Other work with a data set.
#[derive(clap::Subcommand)]
enum Other {
    Verify(VerifyArguments),
    Preview(PreviewArguments),
}

/// Check a data set: its checksums, whether its labels agree, and whether some images come out again.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  isotherm dataset verify out/cubesat_set\n  \
isotherm dataset verify out/cubesat_set --samples 0\n  \
isotherm dataset verify out/cubesat_set --samples 20 --draw 2 --spec models/cubesat_dataset.toml")]
struct VerifyArguments {
    /// Folder of the data set
    folder: PathBuf,
    /// Number of images to render again and compare, byte by byte
    #[arg(long, value_name = "K", default_value_t = 4)]
    samples: u64,
    /// Which images these are
    #[arg(long, value_name = "NUMBER", default_value_t = 0)]
    draw: u64,
    /// The SPEC file, if it has moved since
    #[arg(long, value_name = "SPEC.toml")]
    spec: Option<PathBuf>,
    #[command(flatten)]
    reach: ReachArguments,
    #[command(flatten)]
    device: DeviceArguments,
}

/// Draw 24 samples of a SPEC with boxes, key points and axes, and histograms.
#[derive(clap::Args)]
#[command(after_help = "Example:\n  isotherm dataset preview models/cubesat_dataset.toml -o out/cubesat_set.png")]
struct PreviewArguments {
    /// SPEC file (TOML, described in docs/datasets.md)
    spec: PathBuf,
    /// Picture to write, or - for standard output
    #[arg(short, long, value_name = "FILE.png")]
    output: PathBuf,
    #[command(flatten)]
    reach: ReachArguments,
    #[command(flatten)]
    device: DeviceArguments,
}

fn parse_shard(text: &str) -> Result<Shard, String> {
    let wrong = || "it takes a number and how many there are, counted from 0, such as 0/3".to_owned();
    let (index, shards) = text.split_once('/').ok_or_else(wrong)?;
    let (index, shards) = (index.parse().map_err(|_| wrong())?, shards.parse().map_err(|_| wrong())?);
    if index < shards { Ok(Shard { index, shards }) } else { Err(wrong()) }
}

pub(super) fn run(arguments: &Arguments) -> Result<(), CliError> {
    match &arguments.other {
        Some(Other::Verify(arguments)) => return verify(arguments),
        Some(Other::Preview(arguments)) => return show(arguments),
        None => {}
    }
    let (Some(path), Some(root)) = (&arguments.spec, &arguments.output) else {
        return Err(CliError::Usage("name a SPEC, and a folder with -o".to_owned()));
    };
    let (spec, scenes) = load(path, arguments.reach)?;
    let target = arguments.device.open()?;
    let begin = match (arguments.resume, arguments.force) {
        (true, _) => Begin::Resume,
        (_, true) => Begin::Force,
        _ => Begin::Fresh,
    };
    let samples: u64 =
        arguments.shard.orbits(&spec).map(|orbit| spec.images_of(orbit)).map(|images| images.end - images.start).sum();
    say!("{} images of {} orbits on {}", spec.samples, spec.orbits(), target.name());
    let bar = progress_bar(samples, "images");
    let order = DatasetOrder {
        spec: &spec,
        scenes: &scenes,
        target: &target,
        root,
        shard: arguments.shard,
        begin,
        allows_outside: arguments.reach.allows_outside(),
        warn: &|warning| say!("warning: {warning}"),
        assume: &|assumption| say!("assumed: {assumption}"),
    };
    let stop = stop_flag();
    // Kept images take no time, so they say nothing of the time that is left.
    let mut progress = |images, kept| if kept { bar.dec_length(images) } else { bar.inc(images) };
    let made = until(&stop, || make(&order, &stop, &mut progress));
    bar.finish_and_clear();
    tell(&made.map_err(|Stopped| DatasetError::Stopped(root.clone()))??, root);
    check_validation(&target)
}

fn load(path: &Path, reach: ReachArguments) -> Result<(Spec, SceneText), CliError> {
    let spec = Spec::load(path, &reach.of(path))?;
    let scenes = SceneText::load(&spec.scene, reach.of(&spec.scene))?;
    Ok((spec, scenes))
}

fn verify(arguments: &VerifyArguments) -> Result<(), CliError> {
    let root = &arguments.folder;
    let identity = match identity(root) {
        // A copy without isotherm's own records, such as one from an archive, still has its list.
        Err(_) if root.join(CHECKSUMS).is_file() => serde_json::Value::Null,
        found => found?,
    };
    let stop = stop_flag();
    let mut verified = Verified::default();
    checksums(root, &mut verified)?;
    let of_identity = |key: &str| identity.get(key).and_then(serde_json::Value::as_str).unwrap_or_default();
    let path = arguments.spec.clone().unwrap_or_else(|| PathBuf::from(of_identity("spec")));
    if path.as_os_str().is_empty() && arguments.samples > 0 {
        return Err(CliError::Usage(format!(
            "{} does not say where its SPEC is, so no image can be rendered again: name the SPEC with --spec, or pass --samples 0",
            root.display()
        )));
    }
    // The copy says the same, but the scene lies beside the SPEC itself.
    let copy = copy_of_spec(root)?;
    labels(root, &copy, &stop, &mut verified)?;
    if arguments.samples > 0 {
        let reach = arguments.reach.or(identity.get("allow_outside") == Some(&true.into()));
        let (spec, scenes) = load(&path, reach)?;
        if spec.text != copy.text {
            return Err(CliError::Usage(format!(
                "{} is not the SPEC of the data set: name it with --spec, or pass --samples 0",
                path.display()
            )));
        }
        let target = match (&arguments.device.device, of_identity("device")) {
            (None, name) if !name.is_empty() => {
                Target::open(Some(if name.starts_with("cpu (f64") { "cpu" } else { name }))?
            }
            _ => arguments.device.open()?,
        };
        let images = picked(&spec, arguments.samples, arguments.draw);
        again(root, (&spec, &scenes, &target), &images, &stop, &mut verified)?;
        check_validation(&target)?;
    }
    for fault in &verified.faults {
        answer!("{fault}");
    }
    match verified.faults.first() {
        None => {
            answer!(
                "{} files, the labels of {} images and {} images that were rendered again are as they were written",
                verified.files,
                verified.images,
                verified.rendered
            );
            Ok(())
        }
        Some(first) => {
            let (folder, count) = (root.clone(), verified.faults.len());
            Err(DatasetError::Damaged { folder, count, first: first.clone() }.into())
        }
    }
}

fn show(arguments: &PreviewArguments) -> Result<(), CliError> {
    let [output] = destinations([Some(&*arguments.output)])?;
    let output = output.unwrap_or(Destination::StandardOutput);
    if output == Destination::StandardOutput && console::is_seen() {
        return Err(CliError::Usage("a picture is no text for a terminal: name a file, or redirect it".to_owned()));
    }
    let (spec, scenes) = load(&arguments.spec, arguments.reach)?;
    keep_inputs(&arguments.output, &[spec.path.clone(), spec.scene.clone()])?;
    let target = arguments.device.open()?;
    let bar = progress_bar(SAMPLES.min(spec.samples), "samples");
    let preview = preview(&spec, &scenes, &target, &stop_flag(), &mut || bar.inc(1));
    bar.finish_and_clear();
    let preview = preview?;
    output.write_bytes(&preview.canvas.png()?)?;
    preview.warnings.iter().for_each(|warning| say!("warning: {warning}"));
    for (reason, count) in &preview.rejections {
        say!("rejected: {count} {}", reason.words());
    }
    if output != Destination::StandardOutput {
        answer!("{}", arguments.output.display());
    }
    check_validation(&target)
}

/// Tells the number of images and orbits that were made, and the rejections.
fn tell(made: &DatasetSummary, root: &Path) {
    answer!(
        "{} images in {}: {:.0} an hour, {:.0} bytes each",
        made.images,
        root.display(),
        made.images_an_hour(),
        made.bytes_an_image()
    );
    if made.kept > 0 {
        answer!("{} orbits were there before", made.kept);
    }
    for (reason, count) in &made.rejections {
        answer!("rejected: {count} {}", reason.words());
    }
    if made.complete {
        answer!("the data set is complete: {}", root.join(CHECKSUMS).display());
    } else {
        answer!("orbits of other shards are missing; the process that makes the last of them writes the index");
    }
}
