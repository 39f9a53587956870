//! Computes the response to targets from a file, on the device or in f64.

use std::path::{Path, PathBuf};

use super::device::{DeviceArguments, check_validation};
use super::digits::nine_digits;
use super::error::CliError;
use super::progress::spinner;
use crate::output::console::say;
use crate::output::destination::{Destination, STANDARD_OUTPUT, destinations};
use crate::output::finite::finite;
use crate::output::inputs::keep_inputs;
use crate::output::plot::{Mark, Plot, PlotLine};
use crate::output::plot_axis::Axis;
use crate::scene::targets::{self, MAX_STEPS};
use crate::thermal::function::Function;
use crate::thermal::material::{Domain, LONGEST_T_MAX, Profile, Retarget, SHORTEST_T_MAX, Transition};

pub(super) const HELP: &str = "\
F is linear, quadratic, polynomial=c0,c1,..., exponential=K, logarithmic=K, table=FILE (columns time,temperature) or
expression=... (GLSL of s, the share of the time gone); TMAX is the time to the target in steps, after the last colon.

TARGETS.csv has the columns step,target: a target [K] holds until the next row. Step 1 is the first that is taken.

Example:
  isotherm response --heating quadratic:361 --cooling exponential=3:100 --initial 2.7 --targets targets.csv";

#[derive(clap::Args)]
/// The arguments of `isotherm response`.
pub(crate) struct Targets {
    /// Function for heating, and its duration t_max [steps]
    #[arg(long, required = true, value_name = "F:TMAX", value_parser = parse_profile)]
    heating: Option<Profile>,
    /// Function for cooling, and its duration t_max [steps]
    #[arg(long, required = true, value_name = "F:TMAX", value_parser = parse_profile)]
    cooling: Option<Profile>,
    /// Temperature at step 0 [K]
    #[arg(long, required = true, value_name = "K", value_parser = targets::parse_temperature, allow_negative_numbers = true)]
    initial: Option<f64>,
    /// CSV file with the columns step,target
    #[arg(long, required = true, value_name = "TARGETS.csv")]
    targets: Option<PathBuf>,
    /// Quantity that moves: the temperature or its fourth power
    #[arg(long, default_value = "T", value_parser = parse_domain)]
    domain: Domain,
    /// Rule for a target that moves during a transition: merge or restart (which counts moves beyond 0.7 mK)
    #[arg(long, default_value = "merge", value_parser = parse_retarget)]
    retarget: Retarget,
    /// Steps to take [default: to the last row of the targets]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=i64::from(MAX_STEPS)))]
    steps: Option<u32>,
    /// CSV file for step,temperature [default: standard output]
    #[arg(short, long, value_name = "out.csv")]
    output: Option<PathBuf>,
    /// SVG file for a plot
    #[arg(long, value_name = "out.svg")]
    plot: Option<PathBuf>,
    #[command(flatten)]
    device: DeviceArguments,
}

fn parse_profile(text: &str) -> Result<Profile, String> {
    let (function, t_max) =
        text.rsplit_once(':').ok_or("write a function, a colon and the duration in steps, such as quadratic:361")?;
    let t_max_steps: f64 = t_max.trim().parse().map_err(|_| format!("'{t_max}' is not a number of steps"))?;
    if t_max_steps != 0.0 && !(SHORTEST_T_MAX..=LONGEST_T_MAX).contains(&t_max_steps) {
        return Err(format!("the duration must be 0 or from {SHORTEST_T_MAX} to {LONGEST_T_MAX} steps, not {t_max}"));
    }
    Ok(Profile { function: Function::parse(function).map_err(|error| error.to_string())?, t_max_steps })
}

fn parse_domain(text: &str) -> Result<Domain, String> {
    match text {
        "T" => Ok(Domain::Temperature),
        "T4" => Ok(Domain::FourthPower),
        _ => Err("the domain is T or T4".to_owned()),
    }
}

fn parse_retarget(text: &str) -> Result<Retarget, String> {
    match text {
        "merge" => Ok(Retarget::Merge),
        "restart" => Ok(Retarget::Restart),
        _ => Err("the rule is merge or restart".to_owned()),
    }
}

pub(super) fn run(arguments: &Targets) -> Result<(), CliError> {
    // clap requires all four.
    let (Some(heating), Some(cooling), Some(initial), Some(targets)) =
        (&arguments.heating, &arguments.cooling, arguments.initial, &arguments.targets)
    else {
        return Err(CliError::Usage("--heating, --cooling, --initial and --targets are needed".to_owned()));
    };
    let outputs = [Some(arguments.output.as_deref().unwrap_or(Path::new(STANDARD_OUTPUT))), arguments.plot.as_deref()];
    for output in outputs.into_iter().flatten() {
        keep_inputs(output, [targets])?;
    }
    let [output, plotted] = destinations(outputs)?;
    let rows = targets::load(targets).map_err(|error| CliError::Usage(error.to_string()))?;
    let steps = arguments.steps.or(rows.last().map(|row| row.step)).unwrap_or(0);
    let targets = targets::commanded(&rows, initial, steps);
    let transition = Transition {
        heating: heating.clone(),
        cooling: cooling.clone(),
        retarget: arguments.retarget,
        domain: arguments.domain,
    };
    let chosen = arguments.device.open()?;
    say!("device: {}", chosen.name());
    // A device also rounds the initial temperature.
    let first = if chosen.device().is_some() { f64::from(initial as f32) } else { initial };
    let mut temperatures = vec![first];
    let bar = spinner("stepping");
    temperatures.extend(chosen.respond(&transition, initial, &targets)?);
    bar.finish_and_clear();
    for (step, temperature) in temperatures.iter().enumerate() {
        finite(*temperature, || format!("the temperature of step {step}"))?;
    }
    let numbered = temperatures.iter().enumerate().map(|(step, t)| [step.to_string(), nine_digits(*t)]);
    let rows = std::iter::once(["step", "temperature"].map(str::to_owned)).chain(numbered);
    output.unwrap_or(Destination::StandardOutput).write_csv(rows)?;
    if let Some(plotted) = plotted {
        plotted.write_bytes(plot(&transition, &chosen.name(), &targets, &temperatures).svg()?.as_bytes())?;
    }
    check_validation(&chosen)
}

fn plot(transition: &Transition, device: &str, targets: &[f64], temperatures: &[f64]) -> Plot {
    let numbered = |first: usize, values: &[f64]| {
        values.iter().enumerate().map(|(step, value)| [(first + step) as f64, *value]).collect::<Vec<_>>()
    };
    let branch = |profile: &Profile| format!("{} in {} steps", profile.function, profile.t_max_steps);
    Plot {
        title: "Response to given targets".to_owned(),
        subtitle: format!(
            "heating {}; cooling {}; on {device}",
            branch(&transition.heating),
            branch(&transition.cooling)
        ),
        x: Axis::linear("step"),
        y: Axis::linear("temperature [K]"),
        series: vec![
            PlotLine { name: "temperature".to_owned(), points: numbered(0, temperatures), ..PlotLine::default() },
            PlotLine {
                name: "target".to_owned(),
                points: numbered(1, targets),
                mark: Mark::Dashed,
                ..PlotLine::default()
            },
        ],
        shaded: Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn profiles_end_in_their_time() {
        let profile = parse_profile("expression=s < 0.5 ? s : s:100.5").unwrap();
        assert_eq!(profile.t_max_steps, 100.5);
        assert_eq!(profile.function, Function::expression("s < 0.5 ? s : s").unwrap());
        assert_eq!(parse_profile("quadratic:0").unwrap().t_max_steps, 0.0);
        for wrong in [
            "quadratic",
            "quadratic:",
            "quadratic:-1",
            "quadratic:nan",
            "quadratic:inf",
            "quadratic:10000001",
            "cubic:9",
            ":9",
        ] {
            assert!(parse_profile(wrong).is_err(), "{wrong}");
        }
    }
}
