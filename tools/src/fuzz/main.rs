//! Fuzzes the readers of isotherm: random changes of valid files, and noise. No case may panic, end the process, take 2 s or leave numbers that are not finite.
//!
//! `tools/fuzz` runs it and writes the counts into `docs/reliability.md`.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use clap::Parser;

mod containers;
mod folder;
mod mutate;
mod targets;

use folder::Folder;
use mutate::Random;
use targets::{TARGETS, Target};

/// Longest time of a case.
const LONGEST: Duration = Duration::from_secs(2);
/// Cases of a stretch, which has a seed of its own. Stretches are shared out to the processors.
const STRETCH: u64 = 1000;

/// Fuzz the readers.
#[derive(Parser)]
struct Arguments {
    /// Cases in all, shared out to the targets
    #[arg(long, default_value_t = 10_000_000)]
    cases: u64,
    /// First seed
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Fuzz only these readers
    #[arg(long, value_delimiter = ',')]
    only: Vec<String>,
    /// Write the counts between the markers `<!-- fuzz -->` and `<!-- /fuzz -->` of this page
    #[arg(long)]
    page: Option<PathBuf>,
}

/// The cases of a target.
#[derive(Debug, Default, Clone)]
struct Outcome {
    cases: u64,
    accepted: u64,
    slowest: Duration,
    /// A message for each case that failed.
    failures: Vec<String>,
}

/// Runs `cases` cases of a target.
fn fuzz(target: &Target, cases: u64, seed: u64) -> std::io::Result<Outcome> {
    let folder = Folder::new(target.name)?;
    let seeds = (target.seeds)();
    // A seed that is refused would test little.
    let refused = seeds.iter().find_map(|seed| (target.read)(seed, &folder).err());
    if let Some(refused) = refused {
        let failures = vec![format!("{}: a seed is refused: {refused}", target.name)];
        return Ok(Outcome { failures, ..Outcome::default() });
    }
    let next = Mutex::new(0u64);
    let found = Mutex::new(Outcome::default());
    let work = || {
        loop {
            let stretch = {
                let Ok(mut next) = next.lock() else { return };
                *next += 1;
                *next - 1
            };
            if stretch * STRETCH >= cases {
                return;
            }
            let count = STRETCH.min(cases - stretch * STRETCH);
            let one =
                run_stretch(target, &seeds, &folder, seed.wrapping_mul(0x1_0000_0000).wrapping_add(stretch), count);
            let Ok(mut all) = found.lock() else { return };
            all.cases += one.cases;
            all.accepted += one.accepted;
            all.slowest = all.slowest.max(one.slowest);
            all.failures.extend(one.failures);
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..std::thread::available_parallelism().map_or(1, usize::from) {
            // Nested inputs may take the stack of a main thread, as in the program.
            let thread = std::thread::Builder::new().stack_size(8 << 20).spawn_scoped(scope, work);
            thread.map(|_| ())?;
        }
        Ok::<_, std::io::Error>(())
    })?;
    Ok(found.into_inner().unwrap_or_default())
}

fn run_stretch(target: &Target, seeds: &[Vec<u8>], folder: &Folder, seed: u64, count: u64) -> Outcome {
    let mut random = Random::new(seed);
    let mut outcome = Outcome { cases: count, ..Outcome::default() };
    for number in 0..count {
        let case = match target.make {
            // Some of what is made is changed further.
            Some(make) if random.below(4) > 0 => match random.below(4) {
                0 => mutate::case(&[make(&mut random, seeds)], &mut random),
                _ => make(&mut random, seeds),
            },
            _ => mutate::case(seeds, &mut random),
        };
        let try_it = || catch_unwind(AssertUnwindSafe(|| (target.read)(&case, folder)));
        let began = Instant::now();
        let (mut read, mut took) = (try_it(), began.elapsed());
        if took > LONGEST {
            // A busy machine can hold up any case. The time of the processor says more, where the system tells it.
            let (began, worked) = (Instant::now(), processor_time());
            read = try_it();
            let again = worked.zip(processor_time()).map_or(began.elapsed(), |(before, after)| after - before);
            took = took.min(again);
        }
        outcome.slowest = outcome.slowest.max(took);
        let failure = match read {
            Err(panic) => {
                let said = panic.downcast_ref::<String>().map(String::as_str).or(panic.downcast_ref::<&str>().copied());
                Some(format!("panic: {}", said.unwrap_or_default()))
            }
            Ok(_) if took > LONGEST => Some(format!("took {:.1} s", took.as_secs_f64())),
            Ok(read) => {
                outcome.accepted += u64::from(read.is_ok());
                None
            }
        };
        if let Some(failure) = failure {
            let file = std::env::temp_dir().join(format!("isotherm_fuzz_{}_{seed:x}_{number}", target.name));
            let kept = std::fs::write(&file, &case).map_or(String::new(), |()| format!(", kept in {}", file.display()));
            outcome.failures.push(format!("{} case {number} of seed {seed:#x}: {failure}{kept}", target.name));
        }
    }
    outcome
}

/// Time for which this thread had a processor, where the system tells.
fn processor_time() -> Option<Duration> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    text.split_whitespace().next()?.parse().ok().map(Duration::from_nanos)
}

/// Most memory that the process had [MiB], where the system tells.
fn peak_memory() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok().map(|kilobytes| kilobytes >> 10)
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    match run(&arguments) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("fuzz: {error}");
            ExitCode::from(2)
        }
    }
}

fn run(arguments: &Arguments) -> Result<bool, Box<dyn std::error::Error>> {
    let chosen: Vec<&Target> = TARGETS
        .iter()
        .filter(|target| arguments.only.is_empty() || arguments.only.iter().any(|name| name == target.name))
        .collect();
    if chosen.is_empty() {
        return Err(format!("the readers are {}", TARGETS.map(|target| target.name).join(", ")).into());
    }
    let each = arguments.cases.div_ceil(chosen.len() as u64);
    let seed = arguments.seed;
    let mut table = String::from(
        "| reader | cases | accepted | failed | slowest case [ms] | cases a second |\n|---|---|---|---|---|---|\n",
    );
    let (mut all, mut failed) = (0, 0);
    let began = Instant::now();
    for target in chosen {
        let before = Instant::now();
        let outcome = fuzz(target, each, seed)?;
        let row = format!(
            "| {} | {} | {} | {} | {:.1} | {:.0} |\n",
            target.name,
            outcome.cases,
            outcome.accepted,
            outcome.failures.len(),
            outcome.slowest.as_secs_f64() * 1e3,
            outcome.cases as f64 / before.elapsed().as_secs_f64()
        );
        eprint!("{row}");
        outcome.failures.iter().take(10).for_each(|failure| eprintln!("  {failure}"));
        table.push_str(&row);
        all += outcome.cases;
        failed += outcome.failures.len();
    }
    let memory = peak_memory().map_or(String::new(), |peak| format!(" The process had at most {peak} MiB of memory."));
    let text = format!(
        "`tools/fuzz --cases {} --seed {seed}`: {all} cases in {:.0} s, {failed} of them failed. Stretch n of {STRETCH} cases has the seed \
         {seed} x 2^32 + n.{memory}\n\n{table}",
        arguments.cases,
        began.elapsed().as_secs_f64()
    );
    println!("{text}");
    if let Some(page) = &arguments.page {
        let old = std::fs::read_to_string(page)?;
        let (head, rest) = old.split_once("<!-- fuzz -->").ok_or("the page has no marker <!-- fuzz -->")?;
        let (_, tail) = rest.split_once("<!-- /fuzz -->").ok_or("the page has no marker <!-- /fuzz -->")?;
        std::fs::write(page, format!("{head}<!-- fuzz -->\n{text}<!-- /fuzz -->{tail}"))?;
    }
    Ok(failed == 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Most cases of a reader with containers here: making and reading one of meshopt takes 12 ms in a debug build.
    const CONTAINERS: u64 = 3000;

    fn fuzzed(most: u64) {
        let cases = |target: &Target| if target.make.is_some() { most.min(CONTAINERS) } else { most };
        let outcomes = TARGETS.map(|target| (target, fuzz(&target, cases(&target), 7).unwrap()));
        for (target, outcome) in &outcomes {
            println!("{}: {} accepted, slowest {:?}", target.name, outcome.accepted, outcome.slowest);
        }
        let failures: Vec<&String> = outcomes.iter().flat_map(|(_, outcome)| &outcome.failures).collect();
        assert_eq!(failures, Vec::<&String>::new());
        // A line of elements has a checksum: one changed case in sixty is valid. Containers around hostile sizes are mostly refused. Other readers
        // accept twice as many at least.
        for (target, outcome) in &outcomes {
            let cases = cases(target);
            let one_in = if target.name == "tle" || target.make.is_some() { 100 } else { 50 };
            assert!(
                outcome.accepted * one_in > cases,
                "{}: only {} of {cases} cases are valid",
                target.name,
                outcome.accepted
            );
        }
    }

    #[test]
    fn a_few_thousand_cases_do_no_harm() {
        fuzzed(2000);
    }

    #[test]
    #[ignore = "long: tools/test --all"]
    fn ten_thousand_cases_of_each_plain_reader_do_no_harm() {
        fuzzed(10_000);
    }
}
