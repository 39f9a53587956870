//! The space environment in f64: orbit, attitude, eclipse, view factors, and the loads of a step.
//!
//! The *body* frame is the frame of the model. The *inertial* frame has X to orbit noon (the Sun's direction projected on the orbit plane) and Z
//! along the orbit normal. On a real trajectory it is GCRF. `body_from_inertial` rotates vectors from the inertial frame into the body frame.

use glam::{DAffine3, DMat3, DVec3};

pub(crate) mod albedo;
pub(crate) mod albedo_field;
mod albedo_series;
pub(crate) mod attitude;
pub(crate) mod coast;
pub(crate) mod divided_differences;
pub(crate) mod eclipse;
pub(crate) mod ephemeris;
pub(crate) mod frames;
pub(crate) mod joints;
pub(crate) mod load;
pub(crate) mod orbit;
pub(crate) mod orbit_point;
pub(crate) mod placements;
pub(crate) mod planet_light;
pub(crate) mod pose_path;
pub(crate) mod position_history;
pub(crate) mod quadrature;
pub(crate) mod rotation_history;
pub(crate) mod scene_time;
pub(crate) mod shadow;
pub(crate) mod sky;
pub(crate) mod spacing;
pub(crate) mod state;
pub(crate) mod step;
pub(crate) mod sun;
pub(crate) mod trajectory;
pub(crate) mod utc;
pub(crate) mod view_factor;

pub use attitude::Attitude;
pub use orbit::CircularOrbit;
pub use orbit_point::Orbit;

/// Heat sources of the craft. A `None` is absent and costs nothing.
#[derive(Debug, Clone, PartialEq)]
pub struct Environment {
    /// Solar flux at one astronomical unit [W/m2].
    pub solar_constant: Option<f64>,
    /// Bond albedo of the planet (Lambert).
    pub albedo: Option<f64>,
    /// Infrared exitance of the planet [W/m2].
    pub planet_ir: Option<f64>,
    /// Radius of the planet [m].
    pub planet_radius: f64,
    /// Whether the planet shadows the Sun.
    pub eclipse: bool,
    /// Radiative temperature of space [K]. `None` is 0 K.
    pub background_temperature: Option<f64>,
}

/// The sky at one instant.
#[derive(Debug, Clone, PartialEq)]
pub struct Sky {
    /// Time since the start [s].
    pub time: f64,
    /// Rotates inertial vectors into the body frame.
    pub body_from_inertial: DMat3,
    /// Rotates orbit-frame (LVLH) vectors into the body frame.
    pub body_from_orbit: DMat3,
    /// Unit vector to the Sun, body frame.
    pub sun_direction: DVec3,
    /// Unit vector to the planet's centre, body frame.
    pub nadir_direction: DVec3,
    /// Share of the Sun's disc that the planet leaves visible, in [0, 1].
    pub lit_fraction: f64,
    /// Distance to the planet's centre over its radius, > 1.
    pub distance_ratio: f64,
    /// Angle at the planet's centre between the craft and the Sun [rad]: the Sun's zenith angle below the craft.
    pub(crate) sun_zenith: f64,
    /// Flux of sunlight over its flux at one astronomical unit.
    pub(crate) solar_scale: f64,
}

impl Sky {
    /// A sky that is not known. All its values are NaN.
    fn nowhere(time: f64) -> Self {
        Self {
            time,
            body_from_inertial: DMat3::NAN,
            body_from_orbit: DMat3::NAN,
            sun_direction: DVec3::NAN,
            nadir_direction: DVec3::NAN,
            lit_fraction: f64::NAN,
            distance_ratio: f64::NAN,
            sun_zenith: f64::NAN,
            solar_scale: f64::NAN,
        }
    }
}

/// One direction of the Sun during a step. The absorbed solar flux of a plate with normal n and absorptivity a, averaged over the step, is `a * sum(flux *
/// max(0, n . direction))`.
///
/// A sample represents a stretch of the step. `flux * direction` is the integral of solar flux x lit fraction x direction over the stretch, divided by the
/// length of the step. A plate that is lit throughout therefore gets its exact mean.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SunSample {
    /// Unit vector to the Sun, body frame.
    pub direction: DVec3,
    /// Solar flux x lit fraction x share of the step [W/m2], > 0.
    pub flux: f64,
}

/// The planet at the middle of a step.
///
/// For a craft that tumbles, `nadir` is 0, and every surface receives `planet_ir` and `albedo_flux`: the means over all orientations of planet infrared, and of
/// direct and reflected sunlight together.
#[derive(Debug, Clone, PartialEq)]
pub struct PlanetLoad {
    /// Unit vector to the planet's centre, body frame.
    pub nadir: DVec3,
    /// Unit vector at right angles to `nadir` towards the Sun, body frame.
    pub sunward: DVec3,
    /// Distance to the planet's centre over its radius, > 1.
    pub distance_ratio: f64,
    /// Infrared exitance [W/m2]. 0 where absent.
    pub planet_ir: f64,
    /// Solar constant x albedo [W/m2], which multiplies `albedo_factor`. 0 where absent or dark.
    pub albedo_flux: f64,
    /// Sun's zenith angle at the sub-satellite point [rad].
    pub sun_zenith: f64,
}

impl PlanetLoad {
    /// Whether the load is a mean over orientations.
    pub(crate) fn is_mean(&self) -> bool {
        self.nadir == DVec3::ZERO
    }
}

/// The load of a step: means over its length, in the body frame.
#[derive(Debug, Clone, PartialEq)]
pub struct StepLoad {
    /// When the step starts [s].
    pub start: f64,
    /// Sun samples, at most [`MAX_SUN_SAMPLES`]. Empty in umbra and without a Sun.
    pub sun: Vec<SunSample>,
    /// Planet infrared and albedo. `None` where the scene has neither.
    pub planet: Option<PlanetLoad>,
    /// Albedo table of this step. `None` where the scene has no albedo, or the step has no light.
    pub albedo: Option<albedo::AlbedoTable>,
    /// Radiative temperature of space [K].
    pub background_temperature: f64,
    /// Pose of the body and of every joint, `body_from_joint`, at the middle of the step. Empty where nothing moves.
    pub joints: Vec<DAffine3>,
}

impl StepLoad {
    /// Rotates body vectors into the joint's frame, in which its nodes keep the pose of the file.
    pub(crate) fn joint_from_body(&self, joint: u32) -> DMat3 {
        self.joints.get(joint as usize).map_or(DMat3::IDENTITY, |pose| pose.matrix3.transpose())
    }
}

/// Most Sun samples in one step. The device reads this many without a loop, because a loop costs more than all samples.
pub const MAX_SUN_SAMPLES: usize = 8;
