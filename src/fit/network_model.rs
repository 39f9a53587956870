//! Temperatures of a network file with other values of its nodes and conductors.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use wildmatch::WildMatch;

use super::FittingError;
use super::measurements::Measurements;
use super::prior::Unknown;
use super::result::FitModel;
use super::telemetry::{self, Places};
use crate::scene::network::NetworkFile;
use crate::scene::{FitInput, Parameter, ParameterKind};
use crate::thermal::network::control::{ControlError, IntegrationSettings, Integrator, integrate};
use crate::thermal::network::reference::ReferenceStepper;

/// A network file, and where and when its nodes were measured.
pub(super) struct NetworkModel<'a> {
    path: PathBuf,
    file: NetworkFile,
    /// Output times that the file itself states [s].
    stated: Vec<f64>,
    parameters: Vec<Parameter>,
    /// Row and node of each measured value.
    places: Vec<(usize, usize)>,
    stop: &'a AtomicBool,
}

impl<'a> NetworkModel<'a> {
    /// Reads a network file and its telemetry.
    ///
    /// # Errors
    /// A wrong file, or a measured value that does not fit the network.
    pub(super) fn load(
        path: &Path,
        input: &FitInput,
        tables: &[PathBuf],
        stop: &'a AtomicBool,
    ) -> Result<(Self, Measurements, Vec<Unknown>), FittingError> {
        let mut file = NetworkFile::load(path)?;
        let end = file.schedule.times.last().copied().unwrap_or(f64::INFINITY);
        let places = Places { parts: Vec::new(), probes: Vec::new(), nodes: file.labels.clone(), end, start: None };
        let (measurements, columns) = telemetry::read(input, tables, &places)?;
        let mut times: Vec<f64> = measurements.points.iter().map(|point| point.time).collect();
        times.sort_by(f64::total_cmp);
        times.dedup();
        let row = |time: f64| times.partition_point(|other| *other < time);
        let places = measurements.points.iter().map(|point| (row(point.time), columns[point.group])).collect();
        let unknown = |parameter: &Parameter| {
            let values: Vec<f64> = values(parameter, &mut file.clone()).into_iter().map(|value| *value).collect();
            let key = parameter.owner_key;
            let word = parameter.kind.word();
            if let Some((owner, near)) = parameter.unknown_owner(file.labels.iter().map(String::as_str)) {
                return Err(parameter.error(key, format!("the network has no {word} of '{owner}'{near}")).into());
            }
            if values.is_empty() {
                let message = format!("the network has no {word} of '{}'", parameter.owners.join("' and '"));
                return Err(parameter.error(if key.is_empty() { "vary" } else { key }, message).into());
            }
            if values.iter().all(|value| *value == 0.0) {
                return Err(parameter.error("vary", format!("{word} is 0, which no factor changes")).into());
            }
            Unknown::new(parameter, &values)
        };
        let unknowns = input.parameters.iter().map(unknown).collect::<Result<_, FittingError>>()?;
        let stated = std::mem::replace(&mut file.times, times.clone());
        file.schedule.times = times;
        let model = Self { path: path.to_path_buf(), file, stated, parameters: input.parameters.clone(), places, stop };
        Ok((model, measurements, unknowns))
    }

    fn changed(&self, factors: &[f64]) -> NetworkFile {
        let mut file = self.file.clone();
        for (parameter, factor) in self.parameters.iter().zip(factors) {
            values(parameter, &mut file).into_iter().for_each(|value| *value *= factor);
        }
        file
    }
}

impl FitModel for NetworkModel<'_> {
    fn computed(&mut self, factors: &[f64]) -> Result<Vec<f64>, FittingError> {
        let NetworkFile { network, schedule, .. } = self.changed(factors);
        // Differences of runs need the most exact integrator.
        let integrator = Integrator::Accurate;
        let settings = IntegrationSettings { integrator, tolerance: integrator.tolerance() };
        let mut stepper = ReferenceStepper::new(network.clone(), &schedule.sensors());
        let watch = |_: f64| !self.stop.load(Ordering::Relaxed);
        match integrate(&mut stepper, &network, &schedule, &settings, watch) {
            Ok(series) => Ok(self.places.iter().map(|(row, node)| series.rows[*row][*node]).collect()),
            Err(ControlError::Stopped) => Err(FittingError::Stopped),
            Err(_) => {
                let reason = "cannot be integrated with the values that the fit tries; `isotherm network` tells more of the file as it is";
                Err(FittingError::Measured { path: self.path.clone(), reason: reason.to_owned() })
            }
        }
    }

    fn fitted_text(&self, factors: &[f64], head: &[String]) -> String {
        NetworkFile { times: self.stated.clone(), ..self.changed(factors) }.text(head, &[])
    }
}

/// The values of a parameter. Of heat, all powers of its tables.
fn values<'f>(parameter: &Parameter, file: &'f mut NetworkFile) -> Vec<&'f mut f64> {
    let patterns: Vec<WildMatch> = parameter.owners.iter().map(|pattern| WildMatch::new(pattern)).collect();
    let labels = &file.labels;
    let fits = |node: usize| patterns.iter().any(|pattern| pattern.matches(&labels[node]));
    let joins = |ends: [u32; 2]| {
        let [a, b] = ends.map(|end| &labels[end as usize]);
        let [first, second] = [&patterns[0], &patterns[1]];
        (first.matches(a) && second.matches(b)) || (first.matches(b) && second.matches(a))
    };
    let network = &mut file.network;
    match parameter.kind {
        ParameterKind::Capacitance => of_nodes(&mut network.capacitances, fits),
        ParameterKind::EmissiveArea => of_nodes(&mut network.emissive_areas, fits),
        ParameterKind::NodeHeat => {
            let tables = file.schedule.heat.iter_mut().filter(|(node, _)| fits(*node as usize));
            tables.flat_map(|(_, table)| &mut table.powers).collect()
        }
        ParameterKind::Conductance => {
            let conductors = network.linear.iter_mut().filter(|conductor| joins(conductor.nodes));
            conductors.map(|conductor| &mut conductor.conductance).collect()
        }
        ParameterKind::ExchangeArea => {
            let conductors = network.radiative.iter_mut().filter(|conductor| joins(conductor.nodes));
            conductors.map(|conductor| &mut conductor.exchange_area).collect()
        }
        _ => Vec::new(),
    }
}

fn of_nodes(values: &mut [f64], fits: impl Fn(usize) -> bool) -> Vec<&mut f64> {
    values
        .iter_mut()
        .enumerate()
        .filter(|(node, value)| **value != 0.0 && fits(*node))
        .map(|(_, value)| value)
        .collect()
}
