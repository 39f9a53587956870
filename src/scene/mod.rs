//! The scene file, checked and in SI units.
//!
//! `docs/scene.md` describes every key with its unit, range and default.

use std::path::PathBuf;

use glam::{DQuat, DVec3};
use hifitime::Epoch;

use crate::environment::{Attitude, Environment, Orbit};
use crate::exchange::step::ExchangeSettings;
use crate::files::Reach;
use crate::lens::Lens;
use crate::thermal::planck::Band;
use crate::thermal::sensor::Sensor;

mod attitude;
mod band;
mod camera;
mod choice;
mod combinations;
mod density;
mod emissivity;
mod environment;
mod ephemeris;
mod epoch;
mod error;
mod exchange;
mod extras;
mod faults;
mod file;
mod fit_input;
mod joint;
pub(crate) mod keys;
mod load;
mod material;
mod material_record;
mod mesh_network;
mod motion;
pub(crate) mod network;
mod orbit;
mod output;
mod parameters;
mod planet;
pub(crate) mod preset;
mod profile;
mod quantity;
mod radiance;
mod scene_band;
pub(crate) mod section;
mod sensor;
mod sensor_tables;
mod shadows;
mod sky_scene;
mod table;
pub(crate) mod targets;
mod telemetry;
mod temperatures;
pub(crate) mod texts;
mod time;
pub(crate) mod tmd;
mod valid_scene;
mod value_source;
mod values;
mod vector;
mod view;
pub(crate) mod work;

pub(crate) use camera::{Poses, USUAL_SAMPLES, read_poses};
pub(crate) use combinations::rays_follow_no_joints;
pub use density::{Density, Edges};
pub use error::SceneError;
pub(crate) use fit_input::{FitInput, HoldOut, ImageRule, Loss, SensorPlace, SensorRule};
pub(crate) use joint::{JointMotion, JointRule};
pub(crate) use load::{file_hash, scene_hash};
pub use material::MaterialRule;
pub(crate) use material::MaterialRules;
pub(crate) use material_record::MaterialRecord;
pub(crate) use mesh_network::{
    CONTACT_DISTANCE, ContactRule, LISTED_DISTANCE, MeshHeater, NEIGHBOUR_CONDUCTANCE, NeighbourContacts,
    NetworkSettings, OwnerPatterns,
};
pub use motion::Motion;
pub use output::{ImageFile, ImageFiles, Video};
pub(crate) use parameters::{Parameter, ParameterKind, ParameterPrior, ParameterRange, read_parameters};
pub(crate) use preset::Preset;
pub use radiance::{Background, Bounces, Reflections, Surrounded};
pub(crate) use radiance::{MOST_BOUNCES, SUNNY};
pub(crate) use scene_band::BandRatio;
pub use scene_band::SceneBand;
pub use shadows::ShadowSettings;
pub use sky_scene::SkyScene;
pub(crate) use table::read_material_records;
pub(crate) use telemetry::{TelemetryRow, read_telemetry};
pub use temperatures::Mapping;
pub(crate) use temperatures::{Solution, SolvedNode, Temperatures};
pub(crate) use values::StatedOptics;
pub(crate) use vector::AXES;
pub use view::Initial;
pub(crate) use view::Probe;

/// A checked scene. `assumptions` lists every default that was used.
#[derive(Debug, Clone)]
pub struct Scene {
    /// The scene file.
    pub source: PathBuf,
    /// The files that the scene and its model may name.
    pub reach: Reach,
    /// Name for titles: the `name` key, or the file stem.
    pub name: String,
    /// Path of the glTF file.
    pub model_path: PathBuf,
    /// The longest and shortest triangle edges.
    pub density: Density,
    /// The steps, and which of them are drawn.
    pub time: Time,
    /// The orbit or trajectory.
    pub orbit: Orbit,
    /// The orientation of the craft.
    pub attitude: Attitude,
    /// Sun, planet and space.
    pub environment: Environment,
    /// Shadows that the craft casts on itself. `None` switches them off.
    pub shadows: Option<ShadowSettings>,
    /// Radiation between the surfaces of the craft. `None` switches it off.
    pub exchange: Option<ExchangeSettings>,
    /// The joints.
    pub joints: Vec<JointRule>,
    /// Rules that assign thermal values to glTF materials.
    pub materials: MaterialRules,
    /// The camera. A scene that draws nothing may have none ([`Scene::require_camera`]).
    pub camera: Option<Camera>,
    /// The camera that `camera.preset` names.
    pub preset: Option<&'static Preset>,
    /// The sensor of the camera. `None` without a section `[sensor]`.
    pub sensor: Option<Sensor>,
    /// Spectral band of the images.
    pub band: Band,
    /// The bands of the scene's `[[band]]`, of which the first is `band`. Empty without one.
    pub bands: Vec<SceneBand>,
    /// The temperature from the ratio of two bands, where the scene asks for it.
    pub(crate) ratio: Option<BandRatio>,
    /// Light that arrives at the camera besides the emission of surfaces.
    pub surrounded: Surrounded,
    /// Temperatures at the start.
    pub initial: Initial,
    /// Temperatures of a file, which take the place of the thermal model.
    pub temperatures: Option<Temperatures>,
    /// Points whose temperature the series records.
    pub probes: Vec<Probe>,
    /// How thermal networks are built and integrated.
    pub network: NetworkSettings,
    /// Contacts between parts or materials of the network.
    pub contacts: Vec<ContactRule>,
    /// Heaters of the network.
    pub heaters: Vec<MeshHeater>,
    /// Temperature range of the false-colour pictures [K]. `None` takes the range of the run.
    pub colour_range: Option<[f64; 2]>,
    /// Whether a run keeps the balance of the heat of each part.
    pub energy_balance: bool,
    /// Files of each image beside EXR and surface temperature, and the video.
    pub images: ImageFiles,
    /// The parameters of `[uncertainty]`. `None` without this section.
    pub(crate) uncertainty: Option<Vec<Parameter>>,
    /// All files of the scene: scene, model, trajectory, attitude, materials table and function tables. Files that glTF
    /// `extras` name join when the model is known.
    pub files: Vec<PathBuf>,
    /// The trajectory and attitude files among `files`.
    pub sky_files: Vec<PathBuf>,
    /// One sentence for each default that was used.
    pub assumptions: Vec<String>,
}

/// Time steps.
#[derive(Debug, Clone, PartialEq)]
pub struct Time {
    /// Date of time 0, if the scene states it.
    pub(crate) start: Option<Epoch>,
    /// Length of a step [s].
    pub step: f64,
    /// Number of steps.
    pub steps: u32,
    /// Length of a step of the warm-up [s].
    pub warm_up_step: f64,
    /// Number of orbits before time 0.
    pub warm_up_orbits: f64,
    /// Whether the scene states no warm-up, so that `warm_up_orbits` is 0.
    pub(crate) warm_up_assumed: bool,
    /// Change over an orbit [K] below which the warm-up ends early. `None` always runs all orbits.
    pub(crate) periodic: Option<f64>,
    /// Which steps are drawn, or the times of the images.
    pub draw: Draw,
}

/// The steps or times that are drawn. Step 0 is the initial state.
#[derive(Debug, Clone, PartialEq)]
pub enum Draw {
    /// No step.
    None,
    /// Every n-th step, including step 0.
    Every(u32),
    /// The listed steps.
    Steps(Vec<u32>),
    /// Images at these times [s], which do not decrease and need not be times of steps.
    Times(Vec<f64>),
}

impl Draw {
    pub(crate) fn is_between_steps(&self) -> bool {
        matches!(self, Self::Times(_))
    }

    /// Number and time [s] of the images at their own times that lie in the interval of a step of this length [s]. Step 0 has the images of
    /// time 0.
    pub(crate) fn in_step(&self, step: u32, length: f64) -> Vec<(u32, f64)> {
        let Self::Times(times) = self else { return Vec::new() };
        let before = |number: f64| times.partition_point(|time| time / length <= number + STEP_SLACK);
        let first = if step == 0 { 0 } else { before(f64::from(step) - 1.0) };
        let end = before(f64::from(step)).max(first);
        (first as u32..).zip(times[first..end].iter().copied()).collect()
    }
}

/// Share of a step by which the time of an image may be rounded.
const STEP_SLACK: f64 = 1e-9;

/// The frame of the camera's pose. Every frame has the origin of the craft's body frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CameraFrame {
    /// The body frame of the craft.
    Body,
    /// X along the velocity, Y against the orbit normal, Z to nadir (CCSDS LVLH).
    Orbit,
    /// On a circular orbit: X to orbit noon, Z along the orbit normal. On a trajectory: GCRF.
    Inertial,
}

/// A camera with OpenCV axes: +X right, +Y down, +Z forward.
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Focal lengths, principal point, skew and distortion.
    pub lens: Lens,
    /// Samples of a pixel: 1, 4, 8 or 16. With more than one the radiance is their mean.
    pub samples: u32,
    /// Time from a row to the next one below [s]. The first row sees the pose of the image's time. 0 if all rows do.
    pub line_time: f64,
    /// How long a pixel collects light.
    pub exposure: MotionBlur,
    /// How the pose changes with time.
    pub motion: Motion,
    /// The frame of the pose.
    pub frame: CameraFrame,
    /// Position in that frame [m]. A camera that moves has the position of its path's first sample.
    pub position: DVec3,
    /// Rotates camera axes into that frame. A camera that moves has the rotation of its path's first sample.
    pub frame_from_camera: DQuat,
    /// Distance of the near plane [m].
    pub near: f64,
}

/// The interval in which a pixel collects light, with the image's time in its middle, and the sub-frames whose mean stands for it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionBlur {
    /// Length [s]. 0 for an instant.
    pub time: f64,
    /// Number of sub-frames, odd. 1 for an instant.
    pub sub_frames: u32,
}

impl Default for MotionBlur {
    /// One instant.
    fn default() -> Self {
        Self { time: 0.0, sub_frames: 1 }
    }
}

impl MotionBlur {
    /// Longest time [s].
    pub(crate) const LONGEST: f64 = 60.0;
    /// Most sub-frames.
    pub(crate) const MOST: u32 = 101;

    /// Whether an image is the mean over sub-frames.
    pub(crate) fn is_mean(&self) -> bool {
        self.time > 0.0
    }

    /// Times of the sub-frames after the image's time [s]: 0, then the others by their distance from it.
    pub(crate) fn offsets(&self) -> impl Iterator<Item = f64> + use<> {
        let (each, half) = (self.time / f64::from(self.sub_frames), self.sub_frames / 2);
        let beside = (1..=half).flat_map(move |number| [-each, each].map(|each| f64::from(number) * each));
        std::iter::once(0.0).chain(beside)
    }
}

impl Camera {
    /// Time from the first row of an image to its last [s].
    pub(crate) fn shutter_time(&self) -> f64 {
        self.line_time * f64::from(self.height.saturating_sub(1))
    }
}
