//! The errors between the steps of a simulation whose scene may change: camera, sensor and loads.

use super::absorbed::{AbsorbingCorner, AbsorbingSurface};
use super::exchange::ExchangeErrors;
use super::materials::SurfaceConstants;
use super::{Uncertainty, UncertaintyState};
use crate::environment::shadow::LitAreas;
use crate::simulation::prepare::Prepared;

/// Errors that do not hold their scene.
pub(crate) struct RestingErrors {
    light: Option<LitAreas>,
    corners: Vec<AbsorbingCorner>,
    areas: Vec<f64>,
    constants: Vec<SurfaceConstants>,
    pieces: Vec<f64>,
    exchange: Option<ExchangeErrors>,
    state: UncertaintyState,
}

impl<'a> Uncertainty<'a> {
    /// Lets go of the scene.
    pub(crate) fn rest(self) -> RestingErrors {
        let Self {
            light, surface: AbsorbingSurface { corners, areas, .. }, constants, pieces, exchange, state, ..
        } = self;
        RestingErrors { light, corners, areas, constants, pieces, exchange, state }
    }

    /// Goes on with the errors of a scene.
    pub(crate) fn wake(prepared: &'a Prepared, errors: RestingErrors) -> Self {
        let RestingErrors { light, corners, areas, constants, pieces, exchange, state } = errors;
        let surface = AbsorbingSurface { prepared, corners, areas };
        Self { prepared, light, surface, constants, pieces, exchange, state }
    }
}
