//! Milliseconds against kelvin: every response with and without shadows, against the accurate network with all light of the scene. Where the scene has
//! radiation between surfaces, networks run with it too.

use std::sync::Arc;

use serde::Serialize;

use super::clock::{Deadline, OUT_OF_TIME};
use super::models::{Basis, Failed, ModelRun, run};
use crate::compare::responses;
use crate::gpu::context::Context;
use crate::simulation::prepare::Prepared;
use crate::thermal::material::Domain;
use crate::thermal::network::control::Integrator;

/// A response, with or without shadows and radiation between surfaces.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct FrontierRow {
    pub(crate) response: String,
    pub(crate) shadows: bool,
    pub(crate) exchange: bool,
    /// Median device time of the thermal, shadow and network passes of a step [ms].
    pub(crate) step_ms: Option<f64>,
    /// Root mean square difference from the accurate network with all light, over area and steps [K].
    pub(crate) rms_k: Option<f64>,
    /// The largest difference [K].
    pub(crate) max_k: Option<f64>,
    /// The reason if there are no numbers.
    pub(crate) failed: Option<String>,
}

impl FrontierRow {
    /// Light between parts, in words.
    pub(crate) fn light(&self) -> &'static str {
        match (self.shadows, self.exchange) {
            (true, true) => "shadows and exchange",
            (true, false) => "shadows",
            (false, true) => "exchange",
            (false, false) => "no shadows",
        }
    }
}

/// The way in which temperatures are computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum TemperatureModel {
    Accurate,
    Default,
    Radiative,
    Fitted,
    FourthPower,
    Temperature,
    Instant,
}

impl TemperatureModel {
    /// The reference comes first.
    const ALL: [Self; 7] = [
        Self::Accurate,
        Self::Default,
        Self::Radiative,
        Self::Fitted,
        Self::FourthPower,
        Self::Temperature,
        Self::Instant,
    ];

    fn name(self) -> &'static str {
        match self {
            Self::Accurate => "network, accurate",
            Self::Default => "network, default",
            Self::Radiative => "radiative",
            Self::Fitted => "transition, fitted",
            Self::FourthPower => "transition in T4",
            Self::Temperature => "transition in T",
            Self::Instant => "instant",
        }
    }

    /// The choices of light between parts, the most first: with shadows, and with radiation between surfaces.
    fn lights(self, exchange: bool) -> impl Iterator<Item = [bool; 2]> {
        let is_network = matches!(self, Self::Accurate | Self::Default);
        let all = [[true, true], [true, false], [false, false]];
        all.into_iter().filter(move |[_, exchanges]| !exchanges || (exchange && is_network))
    }

    fn prepared(self, basis: &Basis, [shadows, exchange]: [bool; 2]) -> Result<Prepared, Failed> {
        let Basis { scene, fits, .. } = basis;
        let mut scene = scene.clone();
        if !shadows {
            scene.shadows = None;
        }
        scene.exchange = basis.stated.filter(|_| exchange);
        let in_domain = |domain: Domain| {
            let mut fits = fits.to_vec();
            fits.iter_mut().filter_map(|one| one.transition.as_mut()).for_each(|one| one.domain = domain);
            fits
        };
        let quiet = &mut |_| ();
        Ok(match self {
            Self::Instant => responses::instant(&scene, quiet)?,
            Self::Temperature => responses::transition(&scene, &in_domain(Domain::Temperature), quiet)?,
            Self::FourthPower => responses::transition(&scene, &in_domain(Domain::FourthPower), quiet)?,
            Self::Fitted => responses::transition(&scene, fits, quiet)?,
            Self::Radiative => responses::radiative(&scene, quiet)?,
            Self::Default | Self::Accurate => {
                let integrator = if self == Self::Accurate { Integrator::Accurate } else { Integrator::Default };
                (scene.network.integrator, scene.network.tolerance) = (integrator, None);
                responses::network(&scene, quiet)?
            }
        })
    }
}

/// Runs every response through the orbit of `basis`. Without the accurate network there are times only.
pub(crate) fn measure(
    context: &Arc<Context>,
    basis: &Basis,
    quick: bool,
    deadline: Deadline,
    says: &dyn Fn(&str),
) -> Vec<FrontierRow> {
    let mut truth: Option<ModelRun> = None;
    let mut rows = Vec::new();
    for way in TemperatureModel::ALL {
        for light @ [shadows, exchange] in way.lights(basis.stated.is_some()) {
            let row = FrontierRow { response: way.name().to_owned(), shadows, exchange, ..FrontierRow::default() };
            let left_out = if deadline.is_past() {
                Some(OUT_OF_TIME)
            } else if quick && matches!(way, TemperatureModel::Accurate | TemperatureModel::Default) {
                Some("left out by --quick")
            } else {
                None
            };
            if let Some(reason) = left_out {
                rows.push(FrontierRow { failed: Some(reason.to_owned()), ..row });
                continue;
            }
            says(&format!("frontier: {}, {}", way.name(), row.light()));
            let ran = way.prepared(basis, light).and_then(|prepared| Ok(run(context, &prepared)?));
            match ran {
                Err(error) => rows.push(FrontierRow { failed: Some(error.to_string()), ..row }),
                Ok(ran) if way == TemperatureModel::Accurate && truth.is_none() => {
                    rows.push(FrontierRow { step_ms: ran.step_ms, rms_k: Some(0.0), max_k: Some(0.0), ..row });
                    truth = Some(ran);
                }
                Ok(ran) => {
                    let moved = truth.as_ref().map(|truth| ran.moved(truth, &basis.areas));
                    rows.push(FrontierRow {
                        step_ms: ran.step_ms,
                        rms_k: moved.map(|moved| moved.rms_k),
                        max_k: moved.map(|moved| moved.max_k),
                        ..row
                    });
                }
            }
        }
    }
    rows
}
