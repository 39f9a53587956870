//! `isotherm dataset`: makes a data set of labelled images.

use std::path::PathBuf;

use super::arguments::folder;
use super::device::{DeviceArguments, check_validation};
use super::error::CliError;
use super::progress::{progress_bar, stop_flag};
use super::reach::ReachArguments;
use crate::dataset::make::{Made, Order, Shard, make};
use crate::dataset::scene_values::SceneText;
use crate::dataset::spec::Spec;
use crate::dataset::store::Begin;
use crate::output::console::{answer, say};

/// Make a data set of labelled images, as a SPEC file describes it (docs/datasets.md).
#[derive(clap::Args)]
#[command(
    args_conflicts_with_subcommands = true,
    subcommand_negates_reqs = true,
    after_help = "Examples:\n  isotherm dataset models/cubesat_dataset.toml -o out/cubesat_set\n  \
isotherm dataset models/cubesat_dataset.toml -o out/cubesat_set --resume\n  \
isotherm dataset models/station_dataset.toml -o out/station_set --shard 0/3"
)]
pub struct Arguments {
    /// SPEC file (TOML, described in docs/datasets.md)
    #[arg(required = true)]
    spec: Option<PathBuf>,
    /// Folder of the data set. It is empty or absent, or holds other shards of the same data set
    #[arg(short, long, value_name = "DIR", required = true, value_parser = folder())]
    output: Option<PathBuf>,
    /// Make the orbits j with j mod N = I. Shards may run at once, on one machine or several, and write into the same folder
    #[arg(long, value_name = "I/N", default_value = "0/1", value_parser = parse_shard)]
    shard: Shard,
    /// Keep the orbits that are there, and make the others. The files are those of an undisturbed run
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

fn parse_shard(text: &str) -> Result<Shard, String> {
    let wrong = || "it takes a number and how many there are, counted from 0, such as 0/3".to_owned();
    let (index, of) = text.split_once('/').ok_or_else(wrong)?;
    let (index, of) = (index.parse().map_err(|_| wrong())?, of.parse().map_err(|_| wrong())?);
    if index < of { Ok(Shard { index, of }) } else { Err(wrong()) }
}

pub(super) fn run(arguments: &Arguments) -> Result<(), CliError> {
    let (Some(path), Some(root)) = (&arguments.spec, &arguments.output) else {
        return Err(CliError::Usage("name a SPEC, and a folder with -o".to_owned()));
    };
    let spec = Spec::load(path, &arguments.reach.of(path))?;
    let scenes = SceneText::load(&spec.scene, arguments.reach.of(&spec.scene))?;
    let target = arguments.device.open()?;
    let begin = match (arguments.resume, arguments.force) {
        (true, _) => Begin::Resume,
        (_, true) => Begin::Force,
        _ => Begin::Fresh,
    };
    let own: u64 = arguments.shard.orbits(&spec).map(|orbit| spec.images_of(orbit)).map(|images| images.end - images.start).sum();
    say!("{} images of {} orbits on {}", spec.samples, spec.orbits(), target.name());
    let bar = progress_bar(own, "images");
    let order = Order {
        spec: &spec,
        scenes: &scenes,
        target: &target,
        root,
        shard: arguments.shard,
        begin,
        allows_outside: arguments.reach.allows_outside(),
    };
    let made = make(&order, &stop_flag(), &mut |images| bar.inc(images));
    bar.finish_and_clear();
    tell(&made?, root);
    check_validation(&target)
}

/// Tells what was made.
fn tell(made: &Made, root: &std::path::Path) {
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
        answer!("the data set is complete: {}", root.join(crate::dataset::store::CHECKSUMS).display());
    } else {
        answer!("orbits of other shards are missing; the process that makes the last of them writes the index");
    }
}
