//! Kills runs at random moments, resumes them and compares their files with those of undisturbed runs.

mod craft;
mod trial;

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser;
use isotherm_tools::random::Random;
use isotherm_tools::{exit_code, section};
use trial::{NETWORK, TRANSITION, Trial};

/// Kill runs at random moments with SIGKILL, SIGTERM and SIGINT in turn, resume them until they are done, and compare all files.
#[derive(Parser)]
struct Arguments {
    /// Number of kills in all
    #[arg(long, default_value_t = 100)]
    count: u32,
    /// Kills of one run
    #[arg(long, default_value_t = 5)]
    each: u32,
    /// Seed of the random moments
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// The built program [default: beside this one]
    #[arg(long)]
    program: Option<PathBuf>,
    /// Steps of a run
    #[arg(long, default_value_t = 600)]
    steps: u32,
    /// Replace the section between `<!-- kills -->` and `<!-- /kills -->` of this page
    #[arg(long, value_name = "FILE.md")]
    page: Option<PathBuf>,
}

fn main() -> ExitCode {
    exit_code(work(&Arguments::parse()))
}

fn work(arguments: &Arguments) -> Result<(), String> {
    let program = section::program(arguments.program.clone())?;
    let mut random = Random(arguments.seed);
    let mut rows = Vec::new();
    let mut done = 0;
    let kinds = [
        ("transition, shadows, three joints", TRANSITION, Some("cpu")),
        ("network, two thermostats", NETWORK, Some("cpu")),
        ("transition, shadows, three joints", TRANSITION, None),
        ("network, two thermostats", NETWORK, None),
    ];
    for (number, (what, scene, device)) in kinds.into_iter().enumerate() {
        let folder = std::env::temp_dir().join(format!("isotherm-kills-{}-{number}", std::process::id()));
        std::fs::create_dir_all(&folder).map_err(|error| error.to_string())?;
        let trial = Trial::new(&program, &folder, scene, arguments.steps, device)?;
        // The last kind takes what is left.
        let until = arguments.count * (number as u32 + 1) / kinds.len() as u32;
        let (mut kills, mut runs, mut files, mut early, mut warm) = (BTreeMap::new(), 0, 0, 0, 0);
        while done < until {
            let some = arguments.each.min(until - done);
            let met = trial.run(some, done, &mut || random.unit())?;
            done += some;
            met.kills.iter().for_each(|(name, count)| *kills.entry(*name).or_insert(0) += count);
            (runs, files, early) = (runs + met.runs, files + met.files, early + met.before_a_state);
            warm += met.in_warm_up;
            eprintln!("{what} on {}: {done} of {} kills", device.unwrap_or("the device"), arguments.count);
        }
        let of = |name: &str| kills.get(name).copied().unwrap_or(0);
        rows.push(format!(
            "| {what} | {} | {runs} | {} | {} | {} | {early} | {warm} | {files} | 0 |",
            device.unwrap_or("best Vulkan device"),
            of("KILL"),
            of("TERM"),
            of("INT"),
        ));
        std::fs::remove_dir_all(&folder).map_err(|error| error.to_string())?;
    }
    let text = format!(
        "`cargo run {}-p isotherm-tools --bin kills -- --count {} --seed {} --steps {} --page docs/reliability.md`\n\n\
         Runs of {} steps were ended at random moments, at most {} times each, and resumed until they were done. A run that was killed before it \
         saved a state began anew. All files were compared with those of an undisturbed run, byte for byte: EXR, PNG, CSV, SVG, and the report \
         without its wall-clock times.\n\n\
         | scene | device | runs | SIGKILL | SIGTERM | SIGINT | before a state | in the warm-up | files compared | files that differ |\n\
         |---|---|---|---|---|---|---|---|---|---|\n{}\n",
        section::PROFILE,
        arguments.count,
        arguments.seed,
        arguments.steps,
        arguments.steps,
        arguments.each,
        rows.join("\n")
    );
    section::tell("kills", &text, arguments.page.as_deref())
}
