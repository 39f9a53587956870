//! The periodic states of the cubes in figures 2, 3 and 4.

use super::cube::{
    ALTITUDES, ALUMINIUM, Cube, CubeProblem, FaceOrbit, Loads, MLI, PLANET_RADIUS, Panel, SOLAR_CONSTANTS,
};
use crate::environment::sky::SkyError;

/// Number of cubes.
pub(crate) const CASES: u64 = 14;

/// A cube and its periodic state.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SolvedCube {
    /// The cube and its orbit.
    pub(crate) case: Cube,
    /// Temperatures of its faces [K].
    pub(crate) orbit: FaceOrbit,
    /// Steps at which the planet covers and uncovers half of the Sun. `None` without shadow.
    pub(crate) shadow: Option<[f64; 2]>,
}

/// All cubes. Pairs differ in solar constant or in altitude.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Orbits {
    /// Aluminium, radiating only, Sun only, by solar constant.
    pub(crate) aluminium: [SolvedCube; 2],
    /// Aluminium, conducting, Sun only, by solar constant.
    pub(crate) conducting: [SolvedCube; 2],
    /// Aluminium, conducting, Sun with planet shadow, by altitude.
    pub(crate) shadowed: [SolvedCube; 2],
    /// MLI, radiating only, Sun only, by solar constant.
    pub(crate) mli: [SolvedCube; 2],
    /// MLI, conducting, Sun only, by solar constant.
    pub(crate) conducting_mli: [SolvedCube; 2],
    /// MLI, radiating only, all loads, by altitude.
    pub(crate) all_loads: [SolvedCube; 2],
    /// MLI, radiating only, all loads but albedo, by altitude.
    pub(crate) without_albedo: [SolvedCube; 2],
}

impl Orbits {
    /// Solves all cubes. `settle` finds the periodic state of a network.
    ///
    /// # Errors
    /// An error of `settle`. The paper's values cause no sky errors.
    pub(crate) fn compute<E: From<SkyError>>(
        mut settle: impl FnMut(&Cube, &CubeProblem) -> Result<FaceOrbit, E>,
    ) -> Result<Self, E> {
        let mut pair = |panel: Panel, conducting: bool, loads: Loads| {
            let [dim, bright] = SOLAR_CONSTANTS;
            let [low, high] = ALTITUDES;
            let places = match loads {
                Loads::Sun => [(dim, low), (bright, low)],
                Loads::SunAndShadow => [(dim, low), (dim, high)],
                Loads::All | Loads::AllButAlbedo => [(bright, low), (bright, high)],
            };
            let mut solve = |(solar_constant, altitude)| {
                let case = Cube { panel, conducting, loads, solar_constant, altitude };
                let orbit = settle(&case, &case.problem()?)?;
                Ok::<_, E>(SolvedCube { case, orbit, shadow: case.shadow()? })
            };
            Ok::<_, E>([solve(places[0])?, solve(places[1])?])
        };
        Ok(Self {
            aluminium: pair(ALUMINIUM, false, Loads::Sun)?,
            conducting: pair(ALUMINIUM, true, Loads::Sun)?,
            shadowed: pair(ALUMINIUM, true, Loads::SunAndShadow)?,
            mli: pair(MLI, false, Loads::Sun)?,
            conducting_mli: pair(MLI, true, Loads::Sun)?,
            all_loads: pair(MLI, false, Loads::All)?,
            without_albedo: pair(MLI, false, Loads::AllButAlbedo)?,
        })
    }

    /// The values that isotherm chose where the paper is silent or contradicts itself.
    pub(crate) fn assumed(&self) -> Vec<String> {
        let mut lines = vec![
            "the cube: a node a panel, which radiates outside only (inside exchange is off) and conducts from middle to \
             middle of its four neighbours, 20 W/K each in aluminium"
                .to_owned(),
            "the load of step n is the mean over one step length, from n - 1/2 to n + 1/2".to_owned(),
            format!("planet radius {} km; solar constant and altitude as each figure says", PLANET_RADIUS / 1e3),
        ];
        lines.extend(self.all_loads[0].case.period_disagreement().map(|disagreement| disagreement.to_string()));
        lines
    }
}
