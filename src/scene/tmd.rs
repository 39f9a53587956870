//! An ESATAN TMD file (HDF5): nodes, conductors, and the values of nodes over time.
//!
//! | object | read values |
//! |---|---|
//! | attribute `FileVersion` | must begin with `01.` |
//! | `AnalysisSet1`, attributes `TAbs`, `StefanBoltzmann` | 0 degrees of the temperatures [K]; the constant of its radiative conductors |
//! | `AnalysisSet1/models` | the field `modelName` |
//! | `AnalysisSet1/thermalNodes` | number and model of each node |
//! | `AnalysisSet1/conductorsGL`, `conductorsGR` | the two nodes of each conductor, as places in `thermalNodes` from 1 |
//! | `AnalysisSet1/DataGroup1/times` | the times [s] |
//! | `DataGroup1/thermalNodesRealData` | time x node x attribute; `thermalNodesRealAttributes` names the attributes |
//! | `DataGroup1/thermalNodesStringData` | time x node x attribute: type and label |
//! | `DataGroup1/conductorDataGL`, `conductorDataGR` | time x conductor x 2: the value stands first |
//!
//! `docs/network.md` says where this layout is from.

use std::path::PathBuf;

use glam::DVec3;

use crate::files::FileFault;

mod read;
mod write;

const SET: &str = "AnalysisSet1";
const GROUP: &str = "DataGroup1";
/// The loads of a node, in the order of [`TmdNode::loads`]: QA, QE, QI, QR and QS.
const LOADS: [&str; 5] = [
    "Total_Albedo_Heat_Source",
    "Total_Earth_Heat_Source",
    "Total_Internal_Heat_Source",
    "Total_Rest_Heat_Source",
    "Total_Solar_Heat_Source",
];

/// A TMD file.
#[derive(Debug, Clone, PartialEq)]
pub struct Tmd {
    /// The description in the file, in one line.
    pub description: String,
    /// Times [s], ascending.
    pub times: Vec<f64>,
    /// All nodes, inactive ones included.
    pub nodes: Vec<TmdNode>,
    /// Linear conductors [W/K].
    pub linear: Conductors,
    /// Radiative conductors [m2], for the Stefan-Boltzmann constant of isotherm.
    pub radiative: Conductors,
    /// One sentence for each thing that is not taken over as it stands in the file.
    pub notes: Vec<String>,
}

/// A node of a TMD file.
#[derive(Debug, Clone, PartialEq)]
pub struct TmdNode {
    /// Number, unique within its model.
    pub number: i64,
    /// The number, after the name of the model where the file has several.
    pub name: String,
    /// Label, which several nodes may share.
    pub label: String,
    /// Type: `D`, `A`, `B` or `X`.
    pub kind: char,
    /// Place [m].
    pub position: DVec3,
    /// Temperature at each time [K].
    pub temperatures: Vec<f64>,
    /// Capacitance at each time [J/K].
    pub capacitances: Vec<f64>,
    /// QA, QE, QI, QR and QS at each time [W].
    pub loads: [Vec<f64>; 5],
}

/// Conductors of one kind.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Conductors {
    /// The two nodes of each, from 0.
    pub nodes: Vec<[u32; 2]>,
    /// The value of each at the first time.
    pub values: Vec<f64>,
    /// How many of the values change over time.
    pub changing: usize,
    /// Their greatest relative change from the first time.
    pub change: f64,
}

/// Why a TMD file is not read.
#[derive(Debug, thiserror::Error)]
pub enum TmdError {
    /// The operating system does not read it.
    #[error("{}: cannot be read: {fault}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// The reason.
        fault: FileFault,
    },
    /// A file that is not HDF5.
    #[error("{}: is not a TMD file: it does not begin as an HDF5 file", path.display())]
    Signature {
        /// The file.
        path: PathBuf,
    },
    /// A file that is truncated, or lacks an object.
    #[error("{}: {object}: cannot be read: {source}; the file is truncated, damaged, or not a TMD file", path.display())]
    Hdf5 {
        /// The file.
        path: PathBuf,
        /// Path of the object within it.
        object: String,
        /// Error of the reader.
        source: Box<hdf5_reader::error::Error>,
    },
    /// Another version of the format.
    #[error("{}: FileVersion: is '{version}'; isotherm reads 01.xx", path.display())]
    Version {
        /// The file.
        path: PathBuf,
        /// The version that the file states.
        version: String,
    },
    /// An object has another shape, or a value is out of its range.
    #[error("{}: {object}: {message}", path.display())]
    Value {
        /// The file.
        path: PathBuf,
        /// Path of the object within it.
        object: String,
        /// The fault, in words.
        message: String,
    },
}
