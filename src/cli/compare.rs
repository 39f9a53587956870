//! `isotherm compare`: one scene under three responses.

use std::cell::RefCell;
use std::path::PathBuf;
use std::time::Instant;

use super::arguments::{FolderArguments, command_line};
use super::device::{DeviceArguments, check_validation};
use super::error::CliError;
use super::prepare::{guard, say_notes};
use super::progress::{building_bar, progress_bar, show_stage, stop_flag};
use super::reach::ReachArguments;
use crate::compare::files::{PAGE, own_files, write};
use crate::compare::page::ComparePage;
use crate::compare::responses::{self, ResponseOrigin};
use crate::compare::runs::{Progress, Runs, all};
use crate::compare::{INSTANT, NETWORK, PERIODIC_START, RESPONSES, TRANSITION};
use crate::guard::finding::CheckEffort;
use crate::output::console::{answer, say};
use crate::output::folder::Folder;
use crate::output::statistics::Percentiles;

/// Run a scene under three responses (instant, transition and network) and show how the results differ.
///
/// `instant` is the balance temperature under the present load. `transition` uses the heating and cooling functions of
/// the scene. If a material states none, they are fitted to the step response of a plate of the material. The step is
/// between the mean coldest and mean hottest balance temperature of its nodes. `network` solves the energy balance, so
/// every material must state thickness, density, specific_heat and conductivity. A material with response = "instant"
/// and none of the first three stays instant in all runs. Contacts and heaters act in the network only. If the scene states
/// no warm-up, each run starts from its own periodic state; warm_up_orbits = 0 keeps the cold start.
///
/// Writes compare.html, compare.csv (rms and largest difference by part), differences.csv (over time), comparison.png,
/// panels/ (temperatures and differences from the network), plots/ and series_RESPONSE.csv. The pictures show at most
/// six of the drawn steps, and fewer for very large images.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  isotherm compare models/station.toml -o out/compare\n  \
isotherm compare models/station.toml -o out/compare --force --device cpu")]
pub(crate) struct Arguments {
    /// Scene file (TOML; docs/scene.md says what it holds)
    scene: PathBuf,
    #[command(flatten)]
    folder: FolderArguments,
    #[command(flatten)]
    reach: ReachArguments,
    #[command(flatten)]
    device: DeviceArguments,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), CliError> {
    let began = Instant::now();
    let mut scene = arguments.reach.scene(&arguments.scene)?.periodic_unless_stated(PERIODIC_START);
    if scene.temperatures.is_some() {
        let path = arguments.scene.display();
        let message = "takes its temperatures from a file ([temperatures]), so it has no responses to compare";
        return Err(CliError::Usage(format!("{path}: {message}")));
    }
    // Surface temperatures are compared, which no sensor changes.
    scene.sensor = None;
    let bar = building_bar();
    let network = responses::network(&scene, &mut |stage| show_stage(&bar, stage));
    bar.finish_and_clear();
    let mut network = network?;
    say_notes(&network);
    guard(&mut network, CheckEffort::BRIEF);
    let chosen = arguments.device.open()?;
    say!("device: {}", chosen.name());
    let folder =
        Folder::new(&arguments.folder.output, &own_files()).prepare(arguments.folder.force, &network.scene.files)?;
    let stop = stop_flag();
    // Only one bar is shown at a time.
    let bar = RefCell::new(progress_bar(0, ""));
    let progress = |progress| match progress {
        Progress::Begins(run, steps) => bar.replace(progress_bar(steps, RESPONSES[run])).finish_and_clear(),
        Progress::Stepped => bar.borrow().inc(1),
    };
    let runs = all(&scene, &chosen, folder.root(), &stop, &progress, network);
    bar.borrow().finish_and_clear();
    let runs = runs.inspect_err(|_| folder.take_back())?;
    let pictures = progress_bar(runs.views.len() as u64, "pictures");
    let page = ComparePage { command_line: command_line(), wall_s: began.elapsed().as_secs_f64() };
    let written = write(&folder, &runs, &page, &|| pictures.inc(1));
    pictures.finish_and_clear();
    written?;
    for warning in runs.warnings() {
        say!("warning: {warning}");
    }
    print_summary(&runs);
    answer!("report: {}", folder.file(PAGE).display());
    check_validation(&chosen)
}

fn print_summary(runs: &Runs) {
    for material in &runs.materials {
        let (ResponseOrigin::Fitted(fitted), Some(transition)) = (&material.origin, &material.transition) else {
            continue;
        };
        let step = runs.ran[TRANSITION].prepared.scene.time.step;
        let [heating, cooling] =
            [&transition.heating, &transition.cooling].map(|one| responses::profile_text(one, step));
        answer!(
            "{}, fitted between {:.0} and {:.0} K in {}: heating {heating} (rms {:.2} K), cooling {cooling} (rms {:.2} K)",
            material.name,
            fitted.between[0],
            fitted.between[1],
            responses::domain_text(transition.domain),
            fitted.heating[0],
            fitted.cooling[0]
        );
    }
    for run in [INSTANT, TRANSITION, NETWORK] {
        let ran = &runs.ran[run];
        let all = &ran.differences.all;
        let difference = match all.largest() {
            Some(largest) => format!("rms {:.2} K, largest {:+.1} K from the network; ", all.rms(), largest.difference),
            None => String::new(),
        };
        let median = |time: Option<Percentiles>| time.map_or(0.0, |time| time.median);
        let (step, image) = (median(ran.cost.step), median(ran.cost.image));
        answer!("{:<11}{difference}a step takes {step:.2} ms, an image {image:.2} ms", RESPONSES[run]);
    }
}
