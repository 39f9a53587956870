//! `isotherm response fit`: fits a function and t_max to a measured step response.

use std::path::{Path, PathBuf};

use super::error::CliError;
use super::progress::spinner;
use crate::files;
use crate::output::console::{answer, say};
use crate::output::destination::destinations;
use crate::output::inputs::keep_inputs;
use crate::output::plot::{Mark, Plot, PlotLine};
use crate::output::plot_axis::Axis;
use crate::thermal::fit::{Fit, Fits, TemperatureSample, fit};
use crate::thermal::function::{Function, FunctionKind};
use crate::thermal::material::Domain;

/// Number of fits in the plot.
const PLOTTED: usize = 3;
/// Most dots in the plot. More would hide each other.
const MOST_DOTS: usize = 400;

/// Fit a function and t_max to a measured step response.
///
/// The first row must be the initial temperature at rest. The target is estimated unless --target states it. Every kind
/// of function is fitted in T and in T4. A table passes through every row, so its residual comes from a table of every
/// second row, evaluated at the other rows. The order follows Schwarz's criterion, which penalises free numbers. The
/// last lines can be pasted into a [[material]] of a scene.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  isotherm response fit cooling.csv\n  \
isotherm response fit cooling.csv --target 2.7 --plot cooling.svg")]
pub(crate) struct Arguments {
    /// CSV with the columns time [s] (or step) and temperature [K]
    #[arg(value_name = "DATA.csv")]
    data: PathBuf,
    /// Target, if known [K]
    #[arg(long, value_name = "K", allow_negative_numbers = true)]
    target: Option<f64>,
    /// Plot of the data and the best fits
    #[arg(long, value_name = "OUT.svg")]
    plot: Option<PathBuf>,
}

/// The data, their lines in the file, and the unit of their time.
struct FitFile {
    samples: Vec<TemperatureSample>,
    lines: Vec<u64>,
    in_steps: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), CliError> {
    if let Some(path) = &arguments.plot {
        keep_inputs(path, [&arguments.data])?;
    }
    let [plotted] = destinations([arguments.plot.as_deref()])?;
    let in_file = |reason: String| CliError::Usage(format!("{}: {reason}", arguments.data.display()));
    let data = read(&arguments.data).map_err(in_file)?;
    let bar = spinner("fitting");
    let fits =
        fit(&data.samples, arguments.target).map_err(|error| in_file(error.in_lines(&data.lines).to_string()))?;
    bar.finish_and_clear();
    if let Some(plotted) = &plotted {
        let name = arguments.data.file_name().unwrap_or_default().to_string_lossy();
        plotted.write_bytes(plot(&data, &fits.best, &name).svg()?.as_bytes())?;
    }
    if let Some(best) = fits.best.first() {
        for doubt in best.doubts() {
            say!("warning: {} in {}: {doubt}", best.response.function.kind_name(), domain(best));
        }
    }
    answer!("{}", table(&data, &fits).trim_end());
    if let Some(best) = fits.best.first() {
        answer!("\n{}", to_paste(best, arguments, data.in_steps).trim_end());
    }
    Ok(())
}

fn read(path: &Path) -> Result<FitFile, String> {
    let file = files::read_text_or_pipe(path).map_err(|fault| format!("cannot be read: {fault}"))?;
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).comment(Some(b'#')).from_reader(file.as_bytes());
    let headers = reader.headers().map_err(text)?.clone();
    let column = |name: &str| headers.iter().position(|header| header.eq_ignore_ascii_case(name));
    let time = column("time").or(column("step"));
    let (Some(time), Some(temperature)) = (time, column("temperature")) else {
        let columns = headers.iter().collect::<Vec<_>>().join(",");
        return Err(format!("the first line must name the columns time (or step) and temperature; it is '{columns}'"));
    };
    let (mut samples, mut lines) = (Vec::new(), Vec::new());
    for record in reader.records() {
        let record = record.map_err(text)?;
        let line = record.position().map_or(0, csv::Position::line);
        let number = |index: usize| {
            let cell = record.get(index).unwrap_or_default();
            cell.parse::<f64>().map_err(|_| format!("row {line}: '{cell}' is not a number"))
        };
        lines.push(line);
        samples.push(TemperatureSample { time: number(time)?, temperature: number(temperature)? });
    }
    Ok(FitFile { samples, lines, in_steps: column("time").is_none() })
}

fn text(error: csv::Error) -> String {
    error.to_string()
}

fn unit(in_steps: bool) -> &'static str {
    if in_steps { "steps" } else { "s" }
}

fn domain(fit: &Fit) -> &'static str {
    match fit.response.domain {
        Domain::Temperature => "T",
        Domain::FourthPower => "T4",
    }
}

/// Every kind of function with its residual, best first.
fn table(data: &FitFile, fits: &Fits) -> String {
    let unit = unit(data.in_steps);
    let mut lines = format!(
        "{:<12} {:<6} {:>12} {:>12} {:>12} {:>12} {:>7}\n",
        "function",
        "domain",
        format!("t_max [{unit}]"),
        "target [K]",
        "rms [K]",
        "max [K]",
        "numbers"
    );
    for fit in &fits.best {
        lines.push_str(&format!(
            "{:<12} {:<6} {:>12} {:>12} {:>12} {:>12} {:>7}{}\n",
            fit.response.function.kind_name(),
            domain(fit),
            number(fit.response.t_max),
            number(fit.response.target),
            residual(fit.rms),
            residual(fit.max),
            fit.parameters,
            if fit.ends_after_data { "  ends after the data" } else { "" }
        ));
    }
    for (kind, reason) in &fits.left_out {
        lines.push_str(&format!("{kind:<12} left out: {reason}\n"));
    }
    lines
}

/// Six significant digits without trailing zeros.
fn number(value: f64) -> String {
    format!("{value:.5e}").parse::<f64>().unwrap_or(value).to_string()
}

fn residual(value: f64) -> String {
    if value >= 1e-3 { format!("{value:.4}") } else { format!("{value:.1e}") }
}

/// The fit as lines for a [[material]].
fn to_paste(fit: &Fit, arguments: &Arguments, in_steps: bool) -> String {
    let response = &fit.response;
    let parameters = match &response.function {
        Function::Linear | Function::Quadratic => String::new(),
        Function::Shaped(shape) => match &shape.kind {
            FunctionKind::Exponential { rate } | FunctionKind::Logarithmic { rate } => {
                format!("rate = {}, ", number(*rate))
            }
            FunctionKind::Polynomial(polynomial) => {
                let list = polynomial.coefficients().iter().map(|c| format!("{c:.9}")).collect::<Vec<_>>();
                format!("coefficients = [{}], ", list.join(", "))
            }
            FunctionKind::Table(_) => {
                let file = toml::Value::String(arguments.data.display().to_string());
                let target = arguments.target.map_or(String::new(), |target| format!("target = {target}, "));
                format!("file = {file}, {target}")
            }
            FunctionKind::Expression(expression) => {
                format!("text = {}, ", toml::Value::String(expression.text().to_owned()))
            }
        },
    };
    let branch = if response.target > response.initial { "heating" } else { "cooling" };
    let key = if in_steps { "t_max_steps" } else { "t_max" };
    let (kind, t_max) = (response.function.kind_name(), number(response.t_max));
    let mut lines = String::new();
    if kind == "table" {
        let rename = if in_steps { "; rename its column step to time" } else { "" };
        lines.push_str(&format!("# file: as seen from the scene{rename}\n"));
    }
    lines.push_str(&format!("{branch} = {{ function = \"{kind}\", {parameters}{key} = {t_max} }}\n"));
    if response.domain == Domain::FourthPower {
        lines.push_str("domain = \"T4\"\n");
    }
    lines
}

fn plot(data: &FitFile, fits: &[Fit], file: &str) -> Plot {
    let unit = unit(data.in_steps);
    let stride = data.samples.len().div_ceil(MOST_DOTS).max(1);
    let dots = data.samples.iter().step_by(stride).map(|sample| [sample.time, sample.temperature]);
    let [start, end] = [0, data.samples.len().saturating_sub(1)].map(|row| data.samples[row].time);
    let mut series: Vec<PlotLine> = fits
        .iter()
        .take(PLOTTED)
        .map(|fit| PlotLine {
            name: format!("{} in {}: {} K", fit.response.function.kind_name(), domain(fit), residual(fit.rms)),
            points: (0..=500)
                .map(|i| (end - start) * f64::from(i) / 500.0)
                .map(|time| [start + time, fit.response.temperature(time)])
                .collect(),
            ..PlotLine::default()
        })
        .collect();
    series.push(PlotLine {
        name: "data".to_owned(),
        points: dots.collect(),
        mark: Mark::Points,
        ..PlotLine::default()
    });
    let every = if stride > 1 { format!("; one row of {stride} is shown") } else { String::new() };
    let best = fits.first().map(|Fit { response, .. }| {
        format!("{}, t_max = {} {unit}", response.function.kind_name(), number(response.t_max))
    });
    Plot {
        title: format!("Step response: {}", best.unwrap_or_default()),
        subtitle: format!("{file}, and the {PLOTTED} best fits with their rms difference{every}"),
        x: Axis::linear(&format!("time [{unit}]")),
        y: Axis::linear("temperature [K]"),
        series,
        shaded: Vec::new(),
    }
}
