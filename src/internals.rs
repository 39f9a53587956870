//! Items that the tests, the tools and the Python package of this repository use besides the public face. Any name here may go at any time.

pub use crate::bench::cases::{NetworkCase, Size, all_cases};
pub use crate::bench::files::{OWN, PAGE, RECORD, write_bench_files};
pub use crate::bench::hard::{CaseScale, HardCase, HardRow, all_hard_cases, measure_hard_case, without};
pub use crate::bench::integrators::{FrameError, Integrated, IntegratorEffort, IntegratorRun, measure_integrator};
pub use crate::bench::models::{WRONG_SHARE, facing, wrong_shadows};
pub use crate::bench::record::{Bench, DeviceMeasurements};
pub use crate::bench::responses::time_pass;
pub use crate::bench::schemes::{ABSENT, Fixed, Scheme};
pub use crate::bench::tables::all_tables;
pub use crate::bench::truth::{CaseSummary, Truth};
pub use crate::dataset::error::DatasetError;
pub use crate::dataset::make::{DatasetOrder, DatasetSummary, Shard, make};
pub use crate::dataset::orbit::{OrbitRun, Rejections};
pub use crate::dataset::orbit_folder::sum_of;
pub use crate::dataset::preview::preview;
pub use crate::dataset::scene_values::SceneText;
pub use crate::dataset::spec::Spec;
pub use crate::dataset::split::{empty_splits, split_of};
pub use crate::dataset::store::Begin;
pub use crate::dataset::verify::{Verified, again, checksums, labels, picked};
pub use crate::dataset::view_check::Reason;
pub use crate::environment::albedo::RESOLUTION;
pub use crate::environment::albedo_field::AlbedoField;
pub use crate::environment::load::{albedo_flux, exact_albedo_flux, planet_ir_flux, solar_flux};
pub use crate::environment::shadow::{DepthMap, Occluders, ShadowCasters, ShadowMethod, SunProjection};
pub use crate::environment::sky::{Boundary, SkyModel};
pub use crate::environment::step::StepLoads;
pub use crate::environment::{
    Attitude, CircularOrbit, Environment, MAX_SUN_SAMPLES, Orbit, PlanetLoad, Sky, StepLoad, SunSample,
};
pub use crate::exchange::between::{To, ViewFactor, view_factors};
pub use crate::exchange::buried::buried;
pub use crate::exchange::cast::{Scenery, cast_rays};
pub use crate::exchange::defects::Defects;
pub use crate::exchange::mirrors::{Mirrored, Mirrors, reflection};
pub use crate::exchange::patches::{PatchSurface, Patches};
pub use crate::exchange::sky::PlanetFromPatch;
pub use crate::exchange::step::{CraftLight, Exchange, ExchangeSettings};
pub use crate::files::Reach;
pub use crate::gpu::blackbody::{band_radiances, band_table, brightness_temperatures};
pub use crate::gpu::context::{Context, devices};
pub use crate::gpu::effects::all as all_resources;
pub use crate::gpu::effects::exchange::Exchanged;
pub use crate::gpu::effects::exchange::tables::ExchangeTables;
pub use crate::gpu::effects::heat::tables::HeatOf;
pub use crate::gpu::effects::image::resources::{
    BAND_TABLE, DISTANT, DRAWS, EMISSIVITIES, GROUP_PART, IMAGE_RADIANCE, LOBES, PLANET_MAP, PLANET_MEANS, PLANET_VIEW,
    POSITION_X, REFLECTORS, SURROUNDINGS, TRIANGLES, VISIBLE_TRIANGLES,
};
pub use crate::gpu::effects::image::runs::TriangleRun;
pub use crate::gpu::effects::image::sampling::{Distance, RowOf, Sampled};
pub use crate::gpu::effects::image::variant::RadianceVariant;
pub use crate::gpu::effects::light::{Casting, OCCLUDERS, SHADOW_TREE, SHADOW_TRIANGLES, VISIBILITY};
pub use crate::gpu::effects::network::sections::{OnePassKind, OnePassShape, SECTIONS};
pub use crate::gpu::effects::network::{PlanConstants, WEIGHTS};
pub use crate::gpu::effects::sensor::Sensing;
pub use crate::gpu::effects::sensor::tables::{SensorVariant, Vignette};
pub use crate::gpu::effects::thermal::variant::{Curve, StepKind, StepRange, ThermalVariant};
pub use crate::gpu::effects::thermal::{
    ALBEDO_VALUES, GROUP_MATERIAL, MATERIALS, NORMAL_X, STEP as STEP_RESOURCE, TARGET, TEMPERATURE,
};
pub use crate::gpu::effects::traced::{SURFACE, SURFACE_IMAGE, TRACE_BOXES, TRACE_CORNERS, TRACE_TRIANGLES, TRACING};
pub use crate::gpu::error::GpuError;
pub use crate::gpu::exchange_rays::cast as cast_on_device;
pub use crate::gpu::frame::{Frame, Recipe, Wanted, compose};
pub use crate::gpu::layout::{ExchangePass, FUSED_STEPS, Material as DeviceMaterial, View, structures};
pub use crate::gpu::limits::copies;
pub use crate::gpu::lists::{
    brightnesses, copied, dispatched, download, filled, radiances, rays, respond as respond_list, upload,
};
pub use crate::gpu::pass::{Access, Barrier, ListEntry, Pass, PassWork, Scope, is_write, writes};
pub use crate::gpu::plan::{Planned, device_bytes};
pub use crate::gpu::renderer::{Collected, Renderer, RendererState, Request};
pub use crate::gpu::resource::{Resource, Role};
pub use crate::gpu::response::{ResponseRun, respond as respond_on_device};
pub use crate::gpu::samples::Samples;
pub use crate::gpu::scene_data::{NODES_PER_WORKGROUP, SceneData};
pub use crate::gpu::shaders::{ENTRY_POINTS, Shader, module};
pub use crate::gpu::shapes::{Shapes, curve};
pub use crate::guard::check;
pub use crate::guard::finding::{CheckEffort, Finding};
pub use crate::host::peak_memory;
pub use crate::labels::craft::Craft;
pub use crate::labels::from_scene::{craft, labelled};
pub use crate::labels::image::{ImageIdentity, LabelledImage, Split};
pub use crate::labels::key_points::{Visibility, chosen, seen};
pub use crate::labels::made::{ImageLabels, ImageLines, fixed, made, orbit};
pub use crate::labels::silhouette::Solids;
pub use crate::labels::speed::entry;
pub use crate::lens::rolling::Rolling;
pub use crate::lens::{Distortion, Lens};
pub use crate::model::nodes::{GROUP, PADDING};
pub use crate::model::{Model, ModelError, ModelMaterial, Part};
pub use crate::output::apparent::Apparent;
pub use crate::output::colour::ColourScale;
pub use crate::output::exr::{read_exr, write_exr};
pub use crate::output::folder::Folder;
pub use crate::output::frame::{Frame as OutputFrame, FrameHeader};
pub use crate::output::frame_maker::FrameMaker;
pub use crate::output::gray::read_png;
pub use crate::output::picture::picture;
pub use crate::output::plot::{Mark, Plot, PlotLine};
pub use crate::output::plot_axis::Axis;
pub use crate::output::report::PassTime;
pub use crate::output::state_file::{SavedState, StateFault, decode, encode};
pub use crate::paper::cube::{ALTITUDES, ALUMINIUM, Cube, Loads, SOLAR_CONSTANTS, STEP, STEPS};
pub use crate::raster::{Pixel, RasterSurface, rasterise};
pub use crate::scene::network::NetworkFile;
pub use crate::scene::network::export_tmd::{TmdSolution, tmd};
pub use crate::scene::network::import_s2e::{Files, convert};
pub use crate::scene::network::import_tmd::{ImportedTmd, network};
pub use crate::scene::preset::PRESETS;
pub use crate::scene::targets::parse;
pub use crate::scene::texts::{attitude, materials, trajectory};
pub use crate::scene::tmd::{Conductors, Tmd, TmdError, TmdNode};
pub use crate::scene::{
    Background, Camera, CameraFrame, Density, Draw, Edges, ImageFile, ImageFiles, Initial, Mapping, MaterialRule,
    Motion, Reflections, Scene, SceneError, ShadowSettings, SkyScene, Surrounded, Video,
};
pub use crate::server::connection::Patience;
pub use crate::server::listen::{Server, Talk, bind, serve};
pub use crate::server::log::Log;
pub use crate::server::picture::{PictureKind, PictureStyle};
pub use crate::server::scenes::Scenes;
pub use crate::server::surrender::talk_surrender;
pub use crate::server::surrender::values::{Hash, Value, write_value};
pub use crate::server::vizard::talk_vizard;
pub use crate::simulation::check::{Check, StepLengthError};
pub use crate::simulation::device_data::{DeviceData, device_material};
pub use crate::simulation::device_engine::DeviceEngine;
pub use crate::simulation::energy::{Account, EnergyBalance};
pub use crate::simulation::engine::{
    Delivered, Engine, EngineError, EngineStep, Order as EngineOrder, Pixels, RowMoments,
};
pub use crate::simulation::network::StepCost;
pub use crate::simulation::network_file::network_file;
pub use crate::simulation::pose::check_camera;
pub use crate::simulation::prepare::Prepared;
pub use crate::simulation::reference_engine::ReferenceEngine;
pub use crate::simulation::sampling::sampling;
pub use crate::simulation::surroundings::surroundings_at;
pub use crate::simulation::target::{Target, respond_f64};
pub use crate::simulation::thermal_state::ThermalState;
pub use crate::simulation::viewpoint::{camera_from_body, device_view, raster_view, source_view};
pub use crate::simulation::{StepResult, moments, pose_at, run, start, still};
pub use crate::text::is_hidden;
pub use crate::thermal::STEFAN_BOLTZMANN;
pub use crate::thermal::balance::{absorbed_flux, emissivity_sum};
pub use crate::thermal::brightness::{BrightnessTable, MAX_TEMPERATURE};
pub use crate::thermal::emissivity::{BandEmissivity, ByAngle, ByWavelength, fresnel_reflectivity};
pub use crate::thermal::function::{Function, TemperatureSample};
pub use crate::thermal::incident::{IncidentFunction, incident};
pub use crate::thermal::material::{
    Below, Bulk, Domain, Gloss, Material, Optics, Profile, Radiative, Response, Retarget, Sides, Transition,
};
pub use crate::thermal::network::control::{ControlError, IntegrationSettings, Integrator, Series, integrate};
pub use crate::thermal::network::reference::ReferenceStepper;
pub use crate::thermal::network::rkl2::{stable_product, stages_for};
pub use crate::thermal::network::schedule::{HeatTable, Schedule, Thermostat};
pub use crate::thermal::network::steady::{SteadyError, steady};
pub use crate::thermal::network::stepper::{Attempt, StepMethod};
pub use crate::thermal::network::{LinearConductor, Network, NodeKind, RadiativeConductor};
pub use crate::thermal::planck::{Band, band_radiance_exact};
pub use crate::thermal::planet_map::{DayLaw, PlanetPattern};
pub use crate::thermal::radiance::{RadianceTable, band_radiance};
pub use crate::thermal::reference::{Reference, ReferenceNode, commanded_temperature};
pub use crate::thermal::sensor::gain_control::GainControl;
pub use crate::thermal::sensor::halo::Halo;
pub use crate::thermal::sensor::reading::{SensorConstants, radiance_slope};
pub use crate::thermal::sensor::spread::Spread;
pub use crate::thermal::sensor::{Netd, Pattern, Sensor, SensorOptics, Vignetting};
pub use crate::thermal::transition::{TransitionState, temperature, transition_step};
pub use crate::view::session::{ViewError, ViewSession};
