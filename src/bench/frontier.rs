//! Milliseconds against kelvin: every response with and without shadows, against the accurate network with all light of the scene. Where the scene has
//! radiation between surfaces, networks run with it too.

use std::sync::Arc;

use serde::Serialize;

use super::clock::{Deadline, OUT_OF_TIME};
use super::models::{Basis, ModelRun, Moves, run};
use crate::gpu::context::Context;
use crate::scene::Scene;
use crate::thermal::material::Domain;
use crate::thermal::network::control::Integrator;

/// A response, with or without shadows and radiation between surfaces.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct FrontierRow {
    pub(crate) response: String,
    pub(crate) shadows: bool,
    pub(crate) exchange: bool,
    /// Median device time of the thermal, shadow and network passes of a step [ms]. The wall time where the processor
    /// steps a network.
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

const ACCURATE: Moves = Moves::Network(Some(Integrator::Accurate));

/// The responses. The reference comes first.
const RESPONSES: [(&str, Moves); 7] = [
    ("network, accurate", ACCURATE),
    ("network, default", Moves::Network(Some(Integrator::Default))),
    ("radiative", Moves::Radiative),
    ("transition, fitted", Moves::Transition(None, None)),
    ("transition in T4", Moves::Transition(None, Some(Domain::FourthPower))),
    ("transition in T", Moves::Transition(None, Some(Domain::Temperature))),
    ("instant", Moves::Instant),
];

/// The light between parts of a response, the most first: with shadows, and with radiation between surfaces.
fn lights(moves: Moves, exchange: bool) -> impl Iterator<Item = [bool; 2]> {
    let is_network = matches!(moves, Moves::Network(_));
    let all = [[true, true], [true, false], [false, false]];
    all.into_iter().filter(move |[_, exchanges]| !exchanges || (exchange && is_network))
}

/// The scene of `basis` with this light between parts.
fn lit(basis: &Basis, [shadows, exchange]: [bool; 2]) -> Scene {
    let shadows = basis.scene.shadows.filter(|_| shadows);
    Scene { shadows, exchange: basis.stated.filter(|_| exchange), ..basis.scene.clone() }
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
    for (name, moves) in RESPONSES {
        for light @ [shadows, exchange] in lights(moves, basis.stated.is_some()) {
            let row = FrontierRow { response: name.to_owned(), shadows, exchange, ..FrontierRow::default() };
            let left_out = if deadline.is_past() {
                Some(OUT_OF_TIME)
            } else if quick && matches!(moves, Moves::Network(_)) {
                Some("left out by --quick")
            } else {
                None
            };
            if let Some(reason) = left_out {
                rows.push(FrontierRow { failed: Some(reason.to_owned()), ..row });
                continue;
            }
            says(&format!("frontier: {name}, {}", row.light()));
            let ran = moves.prepared(lit(basis, light), &basis.fits).and_then(|prepared| Ok(run(context, &prepared)?));
            match ran {
                Err(error) => rows.push(FrontierRow { failed: Some(error.to_string()), ..row }),
                Ok(ran) if moves == ACCURATE && truth.is_none() => {
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
