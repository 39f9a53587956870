//! `isotherm network`: solves a thermal network file over time.

use std::path::{Path, PathBuf};

use super::digits::nine_digits;
use super::error::CliError;
use super::network_report::{EXAMPLES, control_error, print_series, print_steady, steady_error};
use super::progress::{spinner, stop_flag};
use super::{network_export, network_import};
use crate::output::console::say;
use crate::output::destination::{Destination, STANDARD_OUTPUT, destinations, has_neighbours};
use crate::output::finite::finite;
use crate::output::inputs::keep_inputs;
use crate::output::plot::{Plot, PlotLine};
use crate::output::plot_axis::Axis;
use crate::scene::network::NetworkFile;
use crate::simulation::forecast::bytes;
use crate::simulation::prepare_error::PrepareError;
use crate::simulation::target::Target;
use crate::text::time_of_step;
use crate::thermal::network::control::{
    ControlError, IntegrationSettings, Integrator, Leg, MOST_SUB_STEPS, Series, integrate_leg,
};
use crate::thermal::network::reference::ReferenceStepper;
use crate::thermal::network::steady::steady;

/// Most nodes in a plot.
const PLOTTED: usize = 12;

/// Solve a thermal network file: write temperatures over time.
///
/// The file holds nodes, linear and radiative conductors, heat and thermostats (docs/network.md). The CSV has a row for
/// each output time of the file. Method, sub-steps and work go to standard error. Switching times of thermostats go to
/// OUT.events.csv. The processor integrates every network file in f64.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES, args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    command: Option<NetworkCommand>,
    #[command(flatten)]
    solve: SolveArguments,
}

#[derive(clap::Subcommand)]
enum NetworkCommand {
    Import(network_import::Arguments),
    Export(network_export::Arguments),
}

#[derive(clap::Args)]
struct SolveArguments {
    /// Network file (TOML, described in docs/network.md)
    #[arg(required = true, value_name = "FILE.toml")]
    file: Option<PathBuf>,
    /// CSV file for time and the temperature of every node [default: standard output, as with -]
    #[arg(short, long, value_name = "OUT.csv")]
    output: Option<PathBuf>,
    /// Integrator: default, cheap or accurate
    #[arg(long, value_name = "NAME", default_value = "default", value_parser = parse_integrator)]
    integrator: Integrator,
    /// Target error [K] [default: 0.005; cheap 0.05; accurate 0.0005]
    #[arg(long, value_name = "K", value_parser = parse_tolerance, allow_negative_numbers = true)]
    tolerance: Option<f64>,
    /// Write only the steady state under the heat of time 0
    #[arg(long)]
    steady: bool,
    /// SVG file for a plot
    #[arg(long, value_name = "OUT.svg", conflicts_with = "steady")]
    plot: Option<PathBuf>,
    /// Accepted as by the other commands; the processor integrates in f64 in any case
    #[arg(long, value_name = "NAME")]
    device: Option<String>,
}

fn parse_integrator(text: &str) -> Result<Integrator, String> {
    let all = [Integrator::Default, Integrator::Cheap, Integrator::Accurate];
    all.into_iter()
        .find(|integrator| integrator.to_string() == text)
        .ok_or_else(|| "the integrator is default, cheap or accurate".to_owned())
}

fn parse_tolerance(text: &str) -> Result<f64, String> {
    let tolerance: f64 = text.trim().parse().map_err(|_| format!("'{text}' is not a number"))?;
    if !(1e-6..=10.0).contains(&tolerance) {
        return Err(format!("the tolerance must be from 1e-6 to 10 K, not {text}"));
    }
    Ok(tolerance)
}

pub(super) fn run(arguments: &Arguments) -> Result<(), CliError> {
    match &arguments.command {
        Some(NetworkCommand::Import(arguments)) => network_import::run(arguments),
        Some(NetworkCommand::Export(arguments)) => network_export::run(arguments),
        None => solve(&arguments.solve),
    }
}

fn solve(arguments: &SolveArguments) -> Result<(), CliError> {
    let Some(path) = &arguments.file else {
        return Err(CliError::Usage("a network file is needed".to_owned()));
    };
    let file = NetworkFile::load(path).map_err(PrepareError::from)?;
    if file.schedule.times.is_empty() && !arguments.steady {
        let reason = "output.times is missing: the times of output [s]; --steady needs none";
        return Err(CliError::Usage(format!("{}: {reason}", path.display())));
    }
    let output = arguments.output.as_deref().unwrap_or(Path::new(STANDARD_OUTPUT));
    let events = (!arguments.steady && has_neighbours(output)?).then(|| events_path(output));
    let outputs = [Some(output), events.as_deref(), arguments.plot.as_deref()];
    for output in outputs.into_iter().flatten() {
        keep_inputs(output, [path])?;
    }
    let outputs = destinations(outputs)?;
    for assumption in &file.assumptions {
        say!("assumed: {assumption}");
    }
    let device = Target::Reference.name();
    say!("device: {device}");
    if let Some(named) = arguments.device.as_ref().filter(|named| !named.eq_ignore_ascii_case("cpu")) {
        say!("integrated: in f64 on the processor, as every network file; --device {named} changes nothing");
    }
    let mut stepper = ReferenceStepper::new(file.network.clone(), &file.schedule.sensors());
    solve_with(&mut stepper, &file, path, arguments, outputs, &device)
}

fn solve_with(
    stepper: &mut ReferenceStepper,
    file: &NetworkFile,
    path: &Path,
    arguments: &SolveArguments,
    outputs: [Option<Destination>; 3],
    device: &str,
) -> Result<(), CliError> {
    if arguments.steady {
        let [output, ..] = outputs;
        let steady_state =
            steady(stepper, &file.network, &file.schedule).map_err(|error| steady_error(error, file, path))?;
        print_steady(&steady_state, file, stepper.counts());
        return write_rows(output, &file.labels, &[0.0], &[steady_state.temperatures]);
    }
    let tolerance = arguments.tolerance.unwrap_or(arguments.integrator.tolerance());
    let settings = IntegrationSettings { integrator: arguments.integrator, tolerance };
    say!("{}", forecast(file));
    let stop = stop_flag();
    let bar = spinner("time [s]");
    let watch = |now: f64| {
        bar.set_position(now as u64);
        !stop.load(std::sync::atomic::Ordering::Relaxed)
    };
    let (series, ended) =
        integrate_leg(stepper, &file.network, &file.schedule, &settings, Leg::whole(&file.schedule), watch);
    bar.finish_and_clear();
    match ended {
        Ok(()) => print_series(&series, file, &settings),
        // A file of an earlier run is better than one without any row.
        Err(error) if series.rows.is_empty() => return Err(control_error(error, file, path)),
        Err(ControlError::Stopped) => {
            write_series(&series, file, path, outputs, device)?;
            let kept = arguments.output.clone().unwrap_or_else(|| PathBuf::from("standard output"));
            return Err(CliError::Stopped(kept));
        }
        Err(error) => {
            write_series(&series, file, path, outputs, device)?;
            let (rows, all) = (series.rows.len(), file.schedule.times.len());
            say!(
                "written: what was computed until then, {rows} of {all} output times and {} switches",
                series.switches.len()
            );
            return Err(control_error(error, file, path));
        }
    }
    write_series(&series, file, path, outputs, device)
}

/// The size of the work, known before it begins. The estimated error decides on the sub-steps, so only their least and most are known.
fn forecast(file: &NetworkFile) -> String {
    let (schedule, nodes) = (&file.schedule, file.labels.len());
    let rows = file.times.len();
    // A temperature has nine decimals.
    let size = rows as f64 * (20.0 + 14.0 * nodes as f64);
    format!(
        "forecast: {rows} output times to {} s for {nodes} nodes and {} thermostats; at most {} of CSV; from {} to {MOST_SUB_STEPS:e} \
         sub-steps, as the tolerance needs",
        schedule.times.last().copied().unwrap_or(0.0),
        schedule.thermostats.len(),
        bytes(size),
        schedule.fewest_sub_steps()
    )
}

/// Writes temperatures, switches and the plot of the output times that were reached.
fn write_series(
    series: &Series,
    file: &NetworkFile,
    path: &Path,
    [output, events, plotted]: [Option<Destination>; 3],
    device: &str,
) -> Result<(), CliError> {
    let times = file.asked(&file.schedule.times[..series.rows.len()]);
    write_rows(output, &file.labels, &times, &file.asked(&series.rows))?;
    match events {
        Some(events) => write_events(&events, file, series)?,
        None => {
            for switch in &series.switches {
                let node = &file.labels[file.schedule.thermostats[switch.thermostat].node as usize];
                say!("switch: {} s, {node} {}", nine_digits(switch.time), if switch.on { "on" } else { "off" });
            }
        }
    }
    match plotted {
        Some(plotted) => Ok(plotted.write_bytes(plot(file, series, path, device).svg()?.as_bytes())?),
        None => Ok(()),
    }
}

/// `X.events.csv` beside `X.csv`.
fn events_path(output: &Path) -> PathBuf {
    let name = output.file_name().unwrap_or_default().to_string_lossy();
    let stem = name.strip_suffix(".csv").unwrap_or(&name);
    output.with_file_name(format!("{stem}.events.csv"))
}

fn write_rows(
    output: Option<Destination>,
    labels: &[String],
    times: &[f64],
    rows: &[Vec<f64>],
) -> Result<(), CliError> {
    for (time, row) in times.iter().zip(rows) {
        for (label, kelvin) in labels.iter().zip(row) {
            finite(*kelvin, || format!("the temperature of node '{label}' at {time} s"))?;
        }
    }
    let header: Vec<String> = std::iter::once("time".to_owned()).chain(labels.iter().cloned()).collect();
    let rows = times.iter().zip(rows).map(|(time, row)| {
        std::iter::once(time_of_step(*time)).chain(row.iter().map(|kelvin| digits(*kelvin))).collect()
    });
    let output = output.unwrap_or(Destination::StandardOutput);
    Ok(output.write_csv(std::iter::once(header).chain(rows))?)
}

/// A temperature [K] with nine decimals.
fn digits(kelvin: f64) -> String {
    if kelvin >= 1.0 { format!("{kelvin:.9}") } else { nine_digits(kelvin) }
}

fn write_events(events: &Destination, file: &NetworkFile, series: &Series) -> Result<(), CliError> {
    let header = ["time", "node", "on"].map(str::to_owned).to_vec();
    let rows = series.switches.iter().map(|switch| {
        let node = file.schedule.thermostats[switch.thermostat].node as usize;
        vec![format!("{:.6}", switch.time), file.labels[node].clone(), switch.on.to_string()]
    });
    Ok(events.write_csv(std::iter::once(header).chain(rows))?)
}

fn plot(file: &NetworkFile, series: &Series, path: &Path, device: &str) -> Plot {
    let times = &file.schedule.times;
    let line = |node: usize| PlotLine {
        name: file.labels[node].clone(),
        points: times.iter().zip(&series.rows).map(|(time, row)| [*time, row[node]]).collect(),
        ..PlotLine::default()
    };
    let shown = file.labels.len().min(PLOTTED);
    let left_out = file.labels.len() - shown;
    let rest =
        if left_out > 0 { format!("; the first {shown} nodes, {left_out} more are not shown") } else { String::new() };
    Plot {
        title: "Temperatures of the network".to_owned(),
        subtitle: format!("{}, on {device}{rest}", path.file_name().unwrap_or_default().to_string_lossy()),
        x: Axis::linear("time [s]"),
        y: Axis::linear("temperature [K]"),
        series: (0..shown).map(line).collect(),
        shaded: Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn events_lie_beside_the_series() {
        for (output, events) in
            [("a/series.csv", "a/series.events.csv"), ("out", "out.events.csv"), ("a.b.txt", "a.b.txt.events.csv")]
        {
            assert_eq!(events_path(Path::new(output)), Path::new(events));
        }
    }
}
