//! Milliseconds against kelvin: every response with and without shadows, against the accurate network with all light and with every setting of
//! `converge` finer: mesh, step, light, rays and patches. Where the scene has radiation between surfaces, networks run with it too.

use std::sync::Arc;

use serde::Serialize;

use super::clock::{Deadline, OUT_OF_TIME};
use super::models::{Basis, Failed, ModelRun, Moves, run};
use crate::compare::responses;
use crate::converge::finest::{FinestScene, expected_s, images_after_start};
use crate::converge::pixels::{PixelDifference, SurfaceImage, between};
use crate::converge::search::seconds;
use crate::gpu::context::Context;
use crate::scene::Scene;
use crate::simulation::target::Target;
use crate::thermal::material::Domain;
use crate::thermal::network::control::Integrator;

/// A response, with or without shadows and radiation between surfaces.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub(crate) struct FrontierRow {
    pub(crate) response: String,
    pub(crate) shadows: bool,
    pub(crate) exchange: bool,
    /// Median device time of the thermal, shadow and network passes of a step [ms]. The wall time where the processor
    /// steps a network.
    pub(crate) step_ms: Option<f64>,
    /// Difference of the pixels from the reference.
    pub(crate) error: Option<PixelDifference>,
    /// Root mean square difference from the accurate network with all light on the same mesh in the same steps, over area and steps [K].
    pub(crate) from_accurate_k: Option<f64>,
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

/// Longest time that the reference may be expected to take [s], and the fewest orbits of a warm-up to the periodic state. Where joints come back to poses whose exchange is
/// kept it takes less, so the time is not told.
const LONGEST_S: f64 = 3600.0;
const FEWEST_ORBITS: f64 = 3.0;

/// The run from which the errors are.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub(crate) struct FrontierReference {
    /// Its finer settings as `key = value`.
    pub(crate) settings: String,
    /// Keys of the settings that stay as they are. Empty where all are finer.
    pub(crate) left: String,
    pub(crate) nodes: usize,
    /// Mean wall time of a step [ms].
    pub(crate) step_ms: f64,
    /// Wall time of the run with its warm-up [s].
    pub(crate) wall_s: f64,
    #[serde(skip)]
    images: Vec<SurfaceImage>,
}

impl FrontierReference {
    /// Runs the accurate network with all light and all settings finer, or without the costly ones where that takes too long.
    fn new(context: &Arc<Context>, basis: &Basis, says: &dyn Fn(&str)) -> Result<Self, Failed> {
        let target = Target::Device(Arc::clone(context));
        let mut shortest = f64::INFINITY;
        for (moves, left) in [(ACCURATE, &[][..]), (DEFAULT, &COSTLY[..3]), (DEFAULT, &COSTLY[..])] {
            says("frontier: a few steps of the reference");
            let scene = lit(basis, [true, basis.stated.is_some()]);
            let FinestScene { scene, settings, left } = FinestScene::of(&moves.prepared(scene, &basis.fits)?, left);
            let finest = responses::network(&scene, &mut |_| ())?;
            let expected = expected_s(&finest, &target, FEWEST_ORBITS)?;
            if expected <= LONGEST_S {
                says(&format!("frontier: reference with {settings}"));
                let (images, cost) = images_after_start(&finest, &target)?;
                let left = left.join(", ");
                return Ok(Self {
                    settings,
                    left,
                    nodes: cost.nodes,
                    step_ms: cost.step_ms,
                    wall_s: cost.wall_s,
                    images,
                });
            }
            shortest = shortest.min(expected);
        }
        let [shortest, longest] = [shortest, LONGEST_S].map(seconds);
        Err(format!("it would take {shortest} or more, and at most {longest} are spent on it").into())
    }
}

/// All rows, and their reference or why there is none.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Frontier {
    pub(crate) rows: Vec<FrontierRow>,
    pub(crate) reference: Option<Result<FrontierReference, String>>,
}

/// Settings that stay as they are where the reference takes too long with finer ones: each costs much. The last of them is left as it is only where the
/// others do not suffice, because exchange errs most by its patches.
const COSTLY: [&str; 4] = ["exchange.hold", "exchange.redraw_angle_deg", "network.integrator", "exchange.patch_edge"];

const ACCURATE: Moves = Moves::Network(Some(Integrator::Accurate));
const DEFAULT: Moves = Moves::Network(Some(Integrator::Default));

/// The responses. The accurate one comes first.
const RESPONSES: [(&str, Moves); 7] = [
    ("network, accurate", ACCURATE),
    ("network, default", DEFAULT),
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

/// Runs every response through the orbit of `basis`. A quick measurement has no reference, so it has times only.
pub(crate) fn measure(
    context: &Arc<Context>,
    basis: &Basis,
    quick: bool,
    deadline: Deadline,
    says: &dyn Fn(&str),
) -> Frontier {
    let reference = (!quick && !deadline.is_past())
        .then(|| FrontierReference::new(context, basis, says).map_err(|error| error.to_string()));
    let error = |ran: &ModelRun| between(&reference.as_ref()?.as_ref().ok()?.images, &ran.surfaces);
    let mut accurate: Option<ModelRun> = None;
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
                Ok(ran) => {
                    let from_accurate_k = accurate.as_ref().map(|accurate| ran.moved(accurate, &basis.areas).rms_k);
                    rows.push(FrontierRow { step_ms: ran.step_ms, error: error(&ran), from_accurate_k, ..row });
                    if moves == ACCURATE {
                        accurate.get_or_insert(ran);
                    }
                }
            }
        }
    }
    Frontier { rows, reference }
}
