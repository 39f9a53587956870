//! `[temperatures]`: temperatures that another program found, and how they are mapped to the model.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::error::SceneError;
use super::file::read_text;
use super::quantity::Quantity;
use super::section::Section;
use super::tmd::Tmd;

mod map;
mod solution;
mod table;
mod vtk;

use solution::HOTTEST;
pub(crate) use solution::{Solution, SolvedNode};

/// Temperatures from a file, instead of a thermal model.
#[derive(Debug, Clone)]
pub struct Temperatures {
    /// The file.
    pub file: PathBuf,
    pub(crate) solution: Arc<Solution>,
    /// How its nodes are mapped to the model.
    pub mapping: Mapping,
    /// Most distance between a vertex and its node, where several nodes are possible [m].
    pub distance: Option<f64>,
    /// Temperature of surfaces without a node [K].
    pub unmapped: Option<f64>,
    /// Time of the file at time 0 of the scene [s].
    pub start: f64,
}

/// How the nodes of a file are mapped to the parts of a model.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Mapping {
    /// A part takes the nodes whose name or label is its own name.
    Name,
    /// A part takes the nodes of the rows that name it: patterns of parts and of nodes.
    Table(Vec<[String; 2]>),
    /// Every vertex takes the nearest node.
    Place,
}

impl Mapping {
    pub(crate) fn describe(&self) -> String {
        match self {
            Self::Name => "by the names of the parts".to_owned(),
            Self::Table(rows) => format!("by a table of {} rows", rows.len()),
            Self::Place => "by place".to_owned(),
        }
    }
}

impl Solution {
    /// Reads a CSV file with temperatures in kelvin.
    ///
    /// # Errors
    /// A file that cannot be read or is no such table: see [`SceneError`].
    pub(crate) fn load_csv(path: &Path) -> Result<Self, SceneError> {
        table::parse(&read_text(path)?, path, 0.0)
    }
}

/// The number of places of a mesh whose bytes these are.
pub(super) fn mesh_nodes(bytes: &[u8], path: &Path) -> Result<usize, SceneError> {
    vtk::parse(bytes, path, None, 0.0).map(|solution| solution.nodes.len())
}

/// Reads `[temperatures]`. The files join `files`.
pub(super) fn read(section: Option<&Section>, files: &mut Vec<PathBuf>) -> Result<Option<Temperatures>, SceneError> {
    let Some(section) = section else { return Ok(None) };
    // Where the file is wrong, the other keys are read as for some CSV file.
    let any = section.stands_in("file");
    let file = if any { Some(PathBuf::from("any.csv")) } else { section.path("file")? };
    let file = section.required("file", file, "the file with the temperatures")?;
    let ending = file.extension().map(|ending| ending.to_string_lossy().to_lowercase()).unwrap_or_default();
    let celsius = section.choice("unit", &[("K", false), ("degC", true)])?;
    let array = section.name("array")?;
    let only = |key: &str, section_name: &str| match section.has(key) {
        true => Err(section.clash(key, &["file"], format!("belongs to {section_name}, not to .{ending}"))),
        false => Ok(()),
    };
    if ending != "vtu" && ending != "vtp" {
        only("array", "a VTK file (.vtu, .vtp)")?;
    }
    let zero = if celsius == Some(true) { CELSIUS } else { 0.0 };
    let solution = match ending.as_str() {
        _ if any => Solution::any(),
        "tmd" | "h5" | "hdf5" => {
            only("unit", "a CSV or VTK file (a TMD states its own)")?;
            let tmd = Tmd::load(&file).map_err(|error| section.error("file", error))?;
            Solution::of_tmd(&tmd)
        }
        "csv" => {
            section.blame("file", &["unit"], read_text(&file).and_then(|text| table::parse(&text, &file, zero)))?
        }
        "vtu" | "vtp" => section.blame("file", &["unit", "array"], vtk::load(&file, array.as_deref(), zero))?,
        _ => {
            let message = format!("ends in .{ending}; isotherm reads .csv, .TMD (or .h5), .vtu and .vtp");
            return Err(section.error("file", message));
        }
    };
    files.push(file.clone());
    let table = section.path("map")?;
    let by = section.choice("by", &[("name", By::Name), ("table", By::Table), ("place", By::Place)])?;
    let is_mesh = matches!(ending.as_str(), "vtu" | "vtp");
    let by = by.unwrap_or(match (&table, is_mesh) {
        (Some(_), _) => By::Table,
        (None, true) => By::Place,
        (None, false) => By::Name,
    });
    let mapping = match (by, table) {
        (By::Table, Some(path)) => {
            let rows = section.blame("map", &[], read_text(&path).and_then(|text| map::parse(&text, &path)))?;
            files.push(path);
            Mapping::Table(rows)
        }
        (By::Table, None) => {
            let what = "by = \"table\" needs a CSV file with the columns part and node";
            return Err(section.missing("map", &["by"], what));
        }
        (_, Some(_)) => return Err(section.clash("map", &["by"], "belongs to by = \"table\"")),
        (By::Name, None) if is_mesh => {
            return Err(section.clash("by", &["file"], "the points of a VTK file have no names: use \"place\""));
        }
        (By::Name, None) => Mapping::Name,
        (By::Place, None) => Mapping::Place,
    };
    let distance = section.number("distance", Quantity::positive("m"))?;
    if mapping == Mapping::Place && distance.is_none() {
        return Err(section.missing("distance", &["by"], "the most distance between a vertex and its node [m]"));
    }
    if mapping == Mapping::Place && !solution.has_places() {
        return Err(section.clash("by", &["file"], "the nodes of the file have no place: use \"name\" or \"table\""));
    }
    Ok(Some(Temperatures {
        file,
        solution: Arc::new(solution),
        mapping,
        distance,
        unmapped: section.number("unmapped", Quantity::within(0.0, HOTTEST, "K"))?,
        start: section.number("start", Quantity::any("s"))?.unwrap_or(0.0),
    }))
}

#[derive(Debug, Clone, Copy)]
enum By {
    Name,
    Table,
    Place,
}

/// 0 degrees Celsius [K].
pub(super) const CELSIUS: f64 = 273.15;
