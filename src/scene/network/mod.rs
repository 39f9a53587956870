//! The network file: nodes, conductors, heat and thermostats without geometry.
//!
//! `docs/network.md` describes the file.

use std::collections::HashMap;
use std::path::Path;

use super::error::SceneError;
use super::faults::Faults;
use super::file::{SourceFile, unreadable};
use super::quantity::Quantity;
use super::section::Section;
use crate::files::{self, Reach};
use crate::misspelt::suggestion;
use crate::thermal::network::schedule::{HeatTable, Schedule, Thermostat};
use crate::thermal::network::{LinearConductor, Network, NodeKind, RadiativeConductor};

pub(crate) mod export_tmd;
pub(crate) mod import_s2e;
pub(crate) mod import_tmd;
pub(in crate::scene) mod node;
pub(crate) mod tables;
mod write;

const ROOT: &[&str] = &["space_temperature", "node", "linear_conductor", "radiative_conductor", "thermostat", "output"];
const LINEAR: &[&str] = &["nodes", "conductance"];
const RADIATIVE: &[&str] = &["nodes", "exchange_area"];
const THERMOSTAT: &[&str] = &["node", "sensor", "power", "on_below", "off_above", "initially_on"];
const OUTPUT: &[&str] = &["times"];

/// A checked network file.
#[derive(Debug, Clone, PartialEq)]
pub struct NetworkFile {
    /// Labels of the nodes in the order of the file.
    pub labels: Vec<String>,
    /// The network at its start.
    pub network: Network,
    /// Heat, thermostats and output times. Each time occurs once, in ascending order. Without `[output]` there are
    /// none.
    pub schedule: Schedule,
    /// Output times [s] in file order. Each gives one row of the series.
    pub times: Vec<f64>,
    /// One sentence for each default that was used.
    pub assumptions: Vec<String>,
}

impl NetworkFile {
    /// Reads and checks a network file, which may be a pipe.
    ///
    /// # Errors
    /// A file that cannot be read, and everything that [`NetworkFile::parse`] refuses.
    pub fn load(path: &Path) -> Result<Self, SceneError> {
        let text = files::read_text_or_pipe(path).map_err(|fault| unreadable(path, &fault))?;
        Self::parse(&text, path)
    }

    /// Checks the text of a network file as if it lay at `path`.
    ///
    /// # Errors
    /// The first error, with file, line and key: see [`SceneError`].
    pub fn parse(text: &str, path: &Path) -> Result<Self, SceneError> {
        let reach = Reach::of(path);
        let faults = Faults::default();
        let file = SourceFile::new(path, text, &reach, &faults);
        let table = file.parse()?;
        let root = Section::root(&file, &table, ROOT)?;
        let mut assumptions = Vec::new();
        let sections = root.tables("node", node::KEYS)?;
        if sections.is_empty() {
            return Err(root.error("node", "is missing: a network has at least one [[node]]"));
        }
        let (mut labels, mut network, mut heat) = (Vec::new(), Network::default(), Vec::new());
        let mut numbers = HashMap::new();
        let mut dark = 0;
        for section in &sections {
            let node = node::read(section)?;
            let number = labels.len() as u32;
            if numbers.insert(node.label.clone(), number).is_some() {
                let message = format!("'{}' is the label of an earlier node", node.label);
                return Err(section.error("label", message));
            }
            labels.push(node.label);
            network.kinds.push(node.kind);
            network.capacitances.push(node.capacitance);
            dark += usize::from(node.emissive_area.is_none() && node.kind != NodeKind::Boundary);
            network.emissive_areas.push(node.emissive_area.unwrap_or(0.0));
            network.temperatures.push(node.temperature);
            heat.extend(node.heat.map(|table| (number, table)));
        }
        if dark > 0 {
            assumptions.push(format!("{dark} of the nodes do not radiate to space (emissive_area is absent)."));
        }
        let nodes = NodeNumbers { labels: &labels, numbers };
        network.space_temperature = space(&root, &network, &mut assumptions)?;
        for section in &root.tables("linear_conductor", LINEAR)? {
            let conductance = section.number("conductance", Quantity::non_negative("W/K"))?;
            let conductance = section.required("conductance", conductance, "the conductance [W/K]")?;
            network.linear.push(LinearConductor { nodes: nodes.pair(section)?, conductance });
        }
        for section in &root.tables("radiative_conductor", RADIATIVE)? {
            let exchange_area = section.number("exchange_area", Quantity::non_negative("m2"))?;
            let exchange_area = section.required("exchange_area", exchange_area, "the radiative exchange area [m2]")?;
            network.radiative.push(RadiativeConductor { nodes: nodes.pair(section)?, exchange_area });
        }
        let mut thermostats = Vec::new();
        for section in &root.tables("thermostat", THERMOSTAT)? {
            thermostats.push(nodes.thermostat(section, &mut assumptions)?);
        }
        let times = match root.table("output", OUTPUT)? {
            Some(section) => times(&section)?,
            None => Vec::new(),
        };
        assume(&labels, &network, &heat, &thermostats, &mut assumptions);
        assumptions.extend(faults.take_small());
        if let Some(node) = network.unbalanced_node() {
            let message = format!(
                "arithmetic node '{}' has no path to a node that stores heat, to a boundary or to space: give it a \
                 conductor or an emissive_area",
                labels[node]
            );
            return Err(sections[node].error("kind", message));
        }
        let mut ascending = times.clone();
        ascending.sort_unstable_by(f64::total_cmp);
        // -0 and 0 are the same time.
        ascending.dedup();
        let schedule = Schedule { heat, thermostats, times: ascending, ..Schedule::default() };
        Ok(Self { labels, network, schedule, times, assumptions })
    }
}

impl NetworkFile {
    /// Selects the rows that the file asks for from the rows at the schedule's times.
    pub(crate) fn asked<T: Clone>(&self, rows: &[T]) -> Vec<T> {
        let row = |time: &f64| rows.get(self.schedule.times.partition_point(|at| at < time)).cloned();
        self.times.iter().filter_map(row).collect()
    }
}

/// The node number of each label.
struct NodeNumbers<'a> {
    labels: &'a [String],
    numbers: HashMap<String, u32>,
}

impl NodeNumbers<'_> {
    fn number(&self, section: &Section, key: &str, label: &str) -> Result<u32, SceneError> {
        self.numbers.get(label).copied().ok_or_else(|| {
            let near = suggestion(label, self.labels.iter().map(String::as_str));
            section.error(key, format!("no node has the label '{label}'{near}"))
        })
    }

    fn named(&self, section: &Section, key: &str, what: &str) -> Result<u32, SceneError> {
        let label = section.name(key)?;
        self.number(section, key, &section.required(key, label, what)?)
    }

    fn pair(&self, section: &Section) -> Result<[u32; 2], SceneError> {
        let labels = if section.is_array("nodes") { section.strings("nodes")? } else { None };
        let Some([a, b]) = labels.as_deref() else {
            return Err(section.error("nodes", "must be the labels of two nodes: nodes = [\"a\", \"b\"]"));
        };
        let pair = [self.number(section, "nodes", a)?, self.number(section, "nodes", b)?];
        if pair[0] == pair[1] {
            return Err(section.error("nodes", format!("'{a}' cannot be joined to itself")));
        }
        Ok(pair)
    }

    fn thermostat(&self, section: &Section, assumptions: &mut Vec<String>) -> Result<Thermostat, SceneError> {
        let node = self.named(section, "node", "the label of the heated node")?;
        let label = &self.labels[node as usize];
        let sensor = match section.name("sensor")? {
            Some(sensor) => self.number(section, "sensor", &sensor)?,
            None => {
                assumptions.push(format!("The thermostat of '{label}' senses that node itself (sensor is absent)."));
                node
            }
        };
        let number =
            |key: &str, quantity: Quantity, what: &str| section.required(key, section.number(key, quantity)?, what);
        let power = number("power", Quantity::non_negative("W"), "the heat while it is on [W]")?;
        let kelvin = Quantity::non_negative("K");
        let on_below = number("on_below", kelvin, "the temperature below which it switches on [K]")?;
        let off_above = number("off_above", kelvin, "the temperature above which it switches off [K]")?;
        if off_above <= on_below {
            let message = format!("must be above on_below, {on_below} K, found {off_above} K");
            return Err(section.error("off_above", message));
        }
        let initially_on = section.boolean("initially_on")?.unwrap_or_else(|| {
            assumptions.push(format!("The thermostat of '{label}' is off at time 0 (initially_on is absent)."));
            false
        });
        Ok(Thermostat { node, sensor, power, on_below, off_above, initially_on })
    }
}

fn space(root: &Section, network: &Network, assumptions: &mut Vec<String>) -> Result<f64, SceneError> {
    if let Some(temperature) = root.number("space_temperature", Quantity::non_negative("K"))? {
        return Ok(temperature);
    }
    if network.emissive_areas.iter().any(|area| *area > 0.0) {
        assumptions.push("Space is at 0 K (space_temperature is absent).".to_owned());
    }
    Ok(0.0)
}

fn times(section: &Section) -> Result<Vec<f64>, SceneError> {
    let times = section.list("times", Quantity::any("s"))?;
    let times = section.required("times", times, "the times of output [s]")?;
    if let Some(early) = times.iter().find(|time| **time < 0.0) {
        return Err(section.error("times", format!("must not lie before the start, time 0, found {early}")));
    }
    if times.is_empty() {
        return Err(section.error("times", "must not be empty"));
    }
    Ok(times)
}

/// Lists the defaults that were used.
fn assume(
    labels: &[String],
    network: &Network,
    heat: &[(u32, HeatTable)],
    thermostats: &[Thermostat],
    assumptions: &mut Vec<String>,
) {
    let is_boundary = |node: u32| network.kinds[node as usize] == NodeKind::Boundary;
    let heated = heat.iter().map(|(node, _)| *node).chain(thermostats.iter().map(|thermostat| thermostat.node));
    for node in heated.filter(|node| is_boundary(*node)) {
        assumptions.push(format!("Boundary node '{}' keeps its temperature whatever heats it.", labels[node as usize]));
    }
}

#[cfg(test)]
mod tests;
