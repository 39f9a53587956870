//! The tables of a run: temperatures, joints and budgets of every step, appended as it goes.

use rayon::prelude::*;

use super::OutputError;
use super::budgets::BudgetRows;
use super::eclipses::Eclipses;
use super::folder::Folder;
use super::growing::Growing;
use super::joints::JointColumns;
use super::report::{PartBudget, PlotEntry};
use super::series::{SeriesRow, TemperatureSeries};
use super::series_lines::SeriesLines;
use super::sigma::RunSigma;
use super::statistics::StatisticsGroups;
use super::temperature_plots::temperature_plots;
use crate::model::nodes::GROUP;
use crate::simulation::budget::part_budgets;
use crate::simulation::prepare::Prepared;
use crate::thermal::budget::Budget;

/// Temperatures over time.
pub(crate) const SERIES: &str = "series.csv";
/// Positions of joints over time.
pub(crate) const JOINTS: &str = "joints.csv";
/// Budgets of parts over time.
pub(crate) const BUDGET: &str = "budget.csv";

/// The growing tables of a run.
pub(super) struct Tables<'a> {
    groups: NodeGroups,
    columns: TemperatureSeries,
    series: Growing<'a>,
    joint_columns: JointColumns,
    joints: Option<Growing<'a>>,
    budget_rows: BudgetRows,
    budgets: Option<Growing<'a>>,
    sigma: Option<&'a RunSigma>,
}

impl<'a> Tables<'a> {
    pub(crate) fn begin(
        prepared: &Prepared,
        folder: &'a Folder,
        sigma: Option<&'a RunSigma>,
    ) -> Result<Self, OutputError> {
        let begin = |name: &str, head: Vec<String>, _: usize| Growing::begin(folder, name, head);
        Self::new(prepared, begin, sigma)
    }

    /// Goes on with the tables of an earlier part of the run, which had these lengths [bytes].
    pub(crate) fn again(
        prepared: &Prepared,
        folder: &'a Folder,
        lengths: [u64; 3],
        sigma: Option<&'a RunSigma>,
    ) -> Result<Self, OutputError> {
        Self::new(prepared, |name, _, number| Growing::again(folder, name, lengths[number]), sigma)
    }

    fn new(
        prepared: &Prepared,
        open: impl Fn(&str, Vec<String>, usize) -> Result<Growing<'a>, OutputError>,
        sigma: Option<&'a RunSigma>,
    ) -> Result<Self, OutputError> {
        let names: Vec<String> = prepared.materials.iter().map(|material| material.name.clone()).collect();
        let probes: Vec<String> = prepared.scene.probes.iter().map(|probe| probe.name.clone()).collect();
        let columns = TemperatureSeries::new(&prepared.parts, &names, &probes);
        let head = columns.column_names().into_iter().chain(sigma.map(RunSigma::heads).unwrap_or_default()).collect();
        let joints = prepared.loads.joints().joints();
        let joint_columns = JointColumns::new(joints.iter().map(|joint| (joint.name.clone(), joint.turns())));
        Ok(Self {
            groups: NodeGroups::new(prepared)?,
            series: open(SERIES, head, 0)?,
            joints: (!joint_columns.is_empty()).then(|| open(JOINTS, joint_columns.head(), 1)).transpose()?,
            budgets: prepared.scene.images.budget.then(|| open(BUDGET, BudgetRows::head(), 2)).transpose()?,
            budget_rows: BudgetRows::new(&prepared.parts),
            columns,
            joint_columns,
            sigma,
        })
    }

    pub(crate) fn add(&mut self, prepared: &Prepared, time: f64, temperatures: &[f32]) -> Result<(), OutputError> {
        let row = self.groups.row(time, temperatures, &prepared.probes)?;
        let mut cells = self.columns.cells(&row)?;
        cells.extend(self.sigma.map(|sigma| sigma.cells(time)).unwrap_or_default());
        self.series.push(cells)?;
        match &mut self.joints {
            Some(joints) => joints.push(self.joint_columns.cells(time, &prepared.loads.joints_at(time).0)),
            None => Ok(()),
        }
    }

    /// Adds the budget of every node in device order [W/m2] at a time [s].
    pub(crate) fn add_budgets(
        &mut self,
        prepared: &Prepared,
        time: f64,
        budgets: &[Budget],
    ) -> Result<(), OutputError> {
        let Some(table) = &mut self.budgets else { return Ok(()) };
        self.budget_rows.rows(time, &part_budgets(prepared, budgets)).try_for_each(|row| table.push(row))
    }

    /// The mean budget of each part over the run. Empty where the scene does not ask for budgets.
    pub(crate) fn mean_budgets(&mut self) -> Result<Vec<PartBudget>, OutputError> {
        let Some(table) = &mut self.budgets else { return Ok(Vec::new()) };
        self.budget_rows.means(table.reader()?)
    }

    /// Brings the tables to the disk. Returns their lengths [bytes].
    pub(crate) fn sync(&mut self) -> Result<[u64; 3], OutputError> {
        let length = |table: &mut Option<Growing<'_>>| table.as_mut().map_or(Ok(0), Growing::sync);
        Ok([self.series.sync()?, length(&mut self.joints)?, length(&mut self.budgets)?])
    }

    pub(crate) fn plots(&mut self, eclipses: &Eclipses) -> Result<Vec<PlotEntry>, OutputError> {
        let series = &mut self.series;
        let mut plots =
            temperature_plots(SeriesLines::read(&self.columns, self.sigma.is_some(), || series.reader())?, eclipses)?;
        if let Some(joints) = &mut self.joints {
            plots.extend(self.joint_columns.plots(|| joints.reader(), eclipses)?);
        }
        Ok(plots)
    }
}

/// Nodes grouped by part, by material and all together, for the series.
pub(crate) struct NodeGroups {
    parts: StatisticsGroups,
    materials: StatisticsGroups,
    all: StatisticsGroups,
    /// Device index of each vertex. Padding nodes have no vertex, so they do not affect minima.
    node_of_vertex: Vec<u32>,
}

impl NodeGroups {
    pub(crate) fn new(prepared: &Prepared) -> Result<Self, OutputError> {
        let nodes = &prepared.nodes;
        let node_of_vertex = nodes.node_of_vertex.clone();
        let areas: Vec<f64> = node_of_vertex.iter().map(|node| nodes.areas[*node as usize]).collect();
        let angle =
            |groups: &[u32]| node_of_vertex.iter().map(|node| groups[*node as usize / GROUP]).collect::<Vec<u32>>();
        Ok(Self {
            parts: StatisticsGroups::new(areas.clone(), angle(&nodes.group_part), prepared.parts.len())?,
            materials: StatisticsGroups::new(areas.clone(), angle(&nodes.group_material), prepared.materials.len())?,
            all: StatisticsGroups::all(areas),
            node_of_vertex,
        })
    }

    /// The series row of a step. `device` has the temperatures in device order [K], `probes` the nodes of the probes.
    pub(crate) fn row(&self, time: f64, device: &[f32], probes: &[usize]) -> Result<SeriesRow, OutputError> {
        let temperatures: Vec<f32> = self.node_of_vertex.par_iter().map(|node| device[*node as usize]).collect();
        Ok(SeriesRow {
            time,
            all: self.all.summaries(&temperatures)?.pop().flatten(),
            parts: self.parts.summaries(&temperatures)?,
            materials: self.materials.summaries(&temperatures)?,
            probes: probes.iter().map(|node| device[*node]).collect(),
        })
    }
}
