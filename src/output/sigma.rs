//! The uncertainty of a run by the ranges of its parameters: of parts and probes at every step, and of the pixels of its images.

use std::collections::BTreeMap;

use serde::Serialize;

use super::frame::FrameHeader;
use super::series::unique;
use crate::simulation::image::{Image, ImageSigma};

/// Standard deviation of a temperature [K], and the number of the parameter that contributes most.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct PlaceSigma {
    pub(crate) kelvin: f64,
    pub(crate) cause: usize,
}

/// A parameter with its range, as the report shows it.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub(crate) struct SigmaCause {
    pub(crate) name: String,
    /// The value in the scene. `None` where its owners have several.
    pub(crate) value: Option<f64>,
    pub(crate) unit: &'static str,
    /// Ends of its range, as shares of the value by which it changes.
    pub(crate) range_share: [f64; 2],
    /// The largest part of a standard deviation that the parameter has by itself, of any part or probe [K].
    pub(crate) largest_k: f64,
}

/// The largest standard deviation of a part or probe over a run.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub(crate) struct LargestSigma {
    /// `part:NAME` or `probe:NAME`.
    pub(crate) place: String,
    pub(crate) sigma_k: f64,
    pub(crate) time_s: f64,
    pub(crate) cause: String,
}

/// The uncertainty of a run, as the report shows it.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub(crate) struct SigmaReport {
    /// The parameters, the largest first.
    pub(crate) causes: Vec<SigmaCause>,
    pub(crate) places: Vec<LargestSigma>,
}

/// The uncertainty of a run.
#[derive(Debug, Clone, Default)]
pub(crate) struct RunSigma {
    pub(crate) causes: Vec<SigmaCause>,
    /// Names of parts, then of probes, each with its kind.
    pub(crate) places: Vec<(&'static str, String)>,
    /// Time of each step [s].
    pub(crate) times: Vec<f64>,
    /// Of each place at each step. A part without area has none.
    pub(crate) rows: Vec<Vec<Option<PlaceSigma>>>,
    /// Of the pixels of each image, by its step and its number.
    pub(crate) images: BTreeMap<(u32, Option<u32>), ImageSigma>,
}

impl RunSigma {
    /// Gives a frame its uncertainty.
    pub(super) fn add_to(&self, image: &mut Image, header: &FrameHeader) {
        Self::add(self.images.get(&(header.step, header.image)), image);
    }

    /// Gives the only image its uncertainty.
    pub(crate) fn add_only_to(&self, image: &mut Image) {
        Self::add(self.images.values().next(), image);
    }

    fn add(sigma: Option<&ImageSigma>, image: &mut Image) {
        if let Some(sigma) = sigma {
            image.sigma = sigma.clone();
        }
    }

    /// Heads of the columns in the series: `part:NAME:sigma` and `probe:NAME:sigma` [K].
    pub(super) fn heads(&self) -> Vec<String> {
        self.place_names().into_iter().map(|name| format!("{name}:sigma")).collect()
    }

    /// Cells of these columns at a time [s].
    pub(super) fn cells(&self, time: f64) -> Vec<String> {
        let cell = |sigma: Option<&PlaceSigma>| sigma.map_or(String::new(), |sigma| format!("{:.6}", sigma.kelvin));
        match self.times.iter().position(|known| *known == time) {
            Some(step) => self.rows[step].iter().map(|sigma| cell(sigma.as_ref())).collect(),
            None => vec![String::new(); self.places.len()],
        }
    }

    /// `part:NAME` and `probe:NAME`. A repeated name of a part gets `#2`, `#3`, as in the series.
    fn place_names(&self) -> Vec<String> {
        let parts = self.places.iter().filter(|(kind, _)| *kind == "part");
        let parts = unique(&parts.map(|(_, name)| name.clone()).collect::<Vec<_>>());
        let probes = self.places[parts.len()..].iter().map(|(_, name)| format!("probe:{name}"));
        parts.iter().map(|name| format!("part:{name}")).chain(probes).collect()
    }

    pub(super) fn report(&self) -> SigmaReport {
        let largest = |(place, name): (usize, String)| {
            let at = |step: usize| self.rows[step][place].unwrap_or_default();
            let step = (0..self.rows.len()).max_by(|a, b| at(*a).kelvin.total_cmp(&at(*b).kelvin))?;
            self.rows[step][place].map(|PlaceSigma { kelvin, cause }| LargestSigma {
                place: name,
                sigma_k: kelvin,
                time_s: self.times[step],
                cause: self.causes[cause].name.clone(),
            })
        };
        let mut causes = self.causes.clone();
        causes.sort_by(|a, b| b.largest_k.total_cmp(&a.largest_k));
        SigmaReport { causes, places: self.place_names().into_iter().enumerate().filter_map(largest).collect() }
    }
}
