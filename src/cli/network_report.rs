//! Messages of `isotherm network` about its work and its errors.

use std::path::Path;

use super::error::CliError;
use crate::output::console::say;
use crate::scene::network::NetworkFile;
use crate::thermal::network::control::{
    ControlError, IntegrationSettings, MOST_SUB_STEPS, MethodUse, STIFFEST, Series,
};
use crate::thermal::network::steady::{Steady, SteadyError};
use crate::thermal::network::stepper::WorkCounts;

pub(super) const EXAMPLES: &str = "\
Columns of OUT.csv: time [s], then one temperature [K] for each node, in the order of the file.
Columns of OUT.events.csv: time [s], the heated node, true or false.

Examples:
  isotherm network models/cubesat_network.toml -o cubesat.csv --plot cubesat.svg
  isotherm network models/cubesat_network.toml -o cubesat.csv --integrator accurate
  isotherm network models/cubesat_network.toml --steady
  isotherm network import DISCTR_TRANSIENT.TMD -o disctr.toml
  isotherm network export models/cubesat_network.toml --series cubesat.csv -o cubesat.TMD";

/// Prints method, sub-steps and work of a series to standard error.
pub(super) fn print_series(series: &Series, file: &NetworkFile, settings: &IntegrationSettings) {
    say!("integrator: {}, tolerance {} mK", settings.integrator, short(1e3 * settings.tolerance));
    if let Some([slow, fast]) = series.rates {
        say!("stiffness: the fastest node relaxes at up to {} to {} /s", short(slow), short(fast));
    }
    let whole: f64 = series.uses.iter().flatten().map(|used| used.time).sum();
    for (place, used) in series.uses.iter().enumerate() {
        let Some(used) = used else { continue };
        let MethodUse { sub_steps, time, range: [least, most], stages: [few, many] } = used;
        let (name, reason) = match place {
            0 => ("Euler".to_owned(), "the sub-step is stable and its error small enough"),
            1 => {
                let stages = if few == many { few.to_string() } else { format!("{few} to {many}") };
                (format!("RKL2 with {stages} stages"), "stages follow sub-step x stiffness")
            }
            _ => ("TR-BDF2".to_owned(), "accurate, or RKL2 would need too many stages"),
        };
        let share = 100.0 * time / whole.max(1e-300);
        say!(
            "method: {name} over {share:.0} % of the time ({reason}): {sub_steps} sub-steps of {} to {} s",
            short(*least),
            short(*most)
        );
    }
    print_counts(series.counts);
    say!("rejected: {} tries; switches: {}; nodes: {}", series.rejected, series.switches.len(), file.labels.len());
}

/// Prints thermostat states and work of a steady state to standard error.
pub(super) fn print_steady(steady: &Steady, file: &NetworkFile, counts: WorkCounts) {
    say!("steady state under the heat just after time 0, by Newton's method");
    for (thermostat, on) in file.schedule.thermostats.iter().zip(&steady.on) {
        let node = &file.labels[thermostat.node as usize];
        say!("thermostat of '{node}': {}", if *on { "on" } else { "off" });
    }
    print_counts(counts);
}

fn print_counts(counts: WorkCounts) {
    let WorkCounts { stages, sub_steps, iterations } = counts;
    say!("work: {sub_steps} sub-steps, {stages} stages, {iterations} iterations");
}

/// Three significant digits.
fn short(value: f64) -> String {
    format!("{value:.2e}").parse::<f64>().unwrap_or(value).to_string()
}

/// Adds advice to an integration error.
pub(super) fn control_error(error: ControlError, file: &NetworkFile, path: &Path) -> CliError {
    let label = |node: usize| &file.labels[node];
    let message = match error {
        ControlError::Stopped => return CliError::StoppedBefore,
        ControlError::Unbalanced { time, node } => {
            format!(
                "at {time} s no temperature balances arithmetic node '{}': more heat leaves it than arrives",
                label(node)
            )
        }
        ControlError::NoStep { time, node, temperature } => format!(
            "at {time} s no sub-step is short enough: node '{}' is at {temperature:.6} K and likely loses more heat than \
             it can",
            label(node)
        ),
        ControlError::Stiff { time, nodes: [a, b], conductance, rate } => format!(
            "at {time} s no sub-step is short enough: the GL of {conductance:e} W/K between '{}' and '{}' evens them out \
             in {:.0e} s; GL over capacitance may be {STIFFEST:e} 1/s at most, beyond which the two are one node",
            label(a),
            label(b),
            1.0 / rate
        ),
        ControlError::TooLong { time, step } => format!(
            "asks for too much work: at {time} s {MOST_SUB_STEPS:e} sub-steps were done, the most of a run; the last was {step:.1e} s \
             long; use a larger --tolerance, or earlier output.times"
        ),
        ControlError::Chatter { time, thermostat, switches, within } => {
            let thermostat = &file.schedule.thermostats[thermostat];
            let why = thermostat.chatter(switches, within);
            format!("at {time} s the thermostat of '{}' {why}", label(thermostat.node as usize))
        }
    };
    CliError::Usage(format!("{}: {message}", path.display()))
}

/// Adds advice to the error of a steady state that was not found.
pub(super) fn steady_error(error: SteadyError, file: &NetworkFile, path: &Path) -> CliError {
    let label = |node: usize| &file.labels[node];
    let message = match error {
        SteadyError::Closed { node } => format!(
            "there is no steady state: the heat of node '{}' has no path to a boundary or to space",
            label(node)
        ),
        SteadyError::NotFound { node } => {
            format!("no steady state was found: the balance of node '{}' does not close", label(node))
        }
        SteadyError::Cycles { thermostat } => format!(
            "there is no steady state: the thermostat of '{}' would switch off while on and on while off",
            label(file.schedule.thermostats[thermostat].node as usize)
        ),
    };
    CliError::Usage(format!("{}: {message}", path.display()))
}
