//! Items that the tests and the tools of this repository use besides the public face. Any name here may go at any time.

pub use crate::bench::{
    cases::{NetworkCase, Size, all_cases},
    files::{OWN, PAGE, RECORD, write_bench_files},
    hard::{CaseScale, HardCase, HardRow, all_hard_cases, measure_hard_case, without},
    integrators::{FrameError, Integrated, IntegratorEffort, IntegratorRun, measure_integrator},
    record::{Bench, DeviceMeasurements},
    responses::time_pass,
    schemes::{ABSENT, Fixed, Scheme},
    tables::all_tables,
    truth::{CaseSummary, Truth},
};
pub use crate::dataset::{
    make::make,
    orbit::{OrbitRun, Rejections},
    orbit_folder::sum_of,
    order::{DatasetOrder, DatasetSummary, Shard},
    preview::preview,
    scene_values::SceneText,
    spec::Spec,
    split::{empty_splits, split_of},
    store::Begin,
    verify::{Verified, again, checksums, labels, picked},
    view_check::Reason,
};
pub use crate::environment::{
    Attitude, CircularOrbit, Environment, MAX_SUN_SAMPLES, Orbit, PlanetLoad, StepLoad, SunSample,
    albedo::RESOLUTION,
    albedo_field::AlbedoField,
    load::{albedo_flux, exact_albedo_flux, planet_ir_flux, solar_flux},
    shadow::{Lit, LitArea, LitAreas, Occluders},
    sky::{Boundary, SkyModel},
    step::StepLoads,
};
pub use crate::exchange::{
    between::{To, ViewFactor, view_factors},
    cast::Scenery,
    defects::Defects,
    mirrors::{Mirrored, Mirrors, reflection},
    patches::{PatchSurface, Patches},
    sky::PlanetFromPatch,
    split::NodeViews,
    step::{CraftLight, Exchange, ExchangeSettings},
};
pub use crate::fit::case::fit_files;
pub use crate::gpu::{
    bindings::compile_pass,
    blackbody::{band_radiances, band_table, brightness_temperatures},
    context::{Context, devices},
    effects::{
        all as all_resources,
        exchange::{Exchanged, tables::ExchangeTables},
        heat::tables::HeatOf,
        image::{
            resources::{
                BAND_TABLE, DISTANT, DRAWS, EMISSIVITIES, GROUP_PART, IMAGE_RADIANCE, LOBES, PLANET_MAP, PLANET_MEANS,
                PLANET_VIEW, POSITION_X, REFLECTORS, SURROUNDINGS, TRIANGLES, VISIBLE_TRIANGLES,
            },
            runs::TriangleRun,
            sampling::{Distance, RowOf, Sampled, SubFrame},
            variant::RadianceVariant,
        },
        light::LIT_X,
        network::{
            PlanConstants, WEIGHTS,
            sections::{OnePassKind, OnePassShape, SECTIONS},
        },
        sensor::{
            Sensing,
            tables::{SensorVariant, Vignette},
        },
        thermal::{
            ALBEDO_VALUES, GROUP_MATERIAL, MATERIALS, NORMAL_X, STEP as STEP_RESOURCE, TARGET, TEMPERATURE,
            variant::{Curve, LightBy, StepKind, StepRange, ThermalVariant},
        },
        traced::{SURFACE, SURFACE_IMAGE, TRACE_BOXES, TRACE_CORNERS, TRACE_TRIANGLES, TRACING},
    },
    frame::{Frame, Recipe, Wanted, compose},
    layout::{FUSED_STEPS, Material as DeviceMaterial, View, structures},
    limits::copies,
    lists::{brightnesses, copied, dispatched, download, filled, radiances, respond as respond_list, upload},
    pass::{Access, Barrier, ListEntry, Pass, PassWork, Scope, is_write, writes},
    plan::{Planned, device_bytes},
    renderer::{Collected, Renderer, RendererState, Request},
    resource::{Resource, Role},
    response::{ResponseRun, respond as respond_on_device},
    samples::Samples,
    scene_data::{NODES_PER_WORKGROUP, SceneData},
    shaders::{ENTRY_POINTS, Shader, module},
    shapes::{Shapes, curve},
};
pub use crate::guard::{
    check,
    finding::{CheckEffort, Finding},
};
pub use crate::labels::{
    craft::Craft,
    from_scene::{craft, labelled},
    image::{ImageIdentity, LabelledImage, Split},
    key_points::{Visibility, chosen, seen},
    made::{ImageLabels, ImageLines, fixed, made, orbit},
    silhouette::Solids,
    speed::entry,
};
pub use crate::lens::rolling::Rolling;
pub use crate::model::{
    Model, ModelMaterial, Part,
    nodes::{GROUP, PADDING},
};
pub use crate::output::{
    apparent::Apparent,
    colour::ColourScale,
    exr::{decode_exr, read_exr, write_exr},
    folder::Folder,
    frame::FrameHeader,
    frame_maker::FrameMaker,
    gray::read_png,
    picture::picture,
    plot::{Mark, Plot, PlotLine},
    plot_axis::Axis,
    report::PassTime,
    run_state::RunState,
    state_file::{SavedState, StateFault, decode, encode},
};
pub use crate::paper::cube::{ALTITUDES, ALUMINIUM, Cube, Loads, SOLAR_CONSTANTS, STEP, STEPS};
pub use crate::raster::{Pixel, RasterSurface, rasterise};
pub use crate::scene::{
    Background, Bounces, Camera, CameraFrame, Density, Draw, Edges, ImageFile, ImageFiles, Initial, Mapping,
    MaterialRule, Reflections, SceneBand, ShadowSettings, SkyScene, Surrounded, Video,
    network::{
        NetworkFile,
        export_tmd::{TmdSolution, tmd},
        import_s2e::{Files, convert},
        import_tmd::{ImportedTmd, network},
    },
    preset::PRESETS,
    targets::parse,
    texts::{attitude, materials, mesh, planet_map, trajectory},
    tmd::{Conductors, Tmd, TmdError, TmdNode},
};
pub use crate::server::{
    connection::Patience,
    listen::{Server, Talk, bind, serve},
    log::Log,
    picture::{PictureKind, PictureStyle},
    scenes::Scenes,
    surrender::{
        talk_surrender,
        values::{Hash, Value, write_value},
    },
    telemetry::session::talk_telemetry,
    vizard::talk_vizard,
};
pub use crate::simulation::{
    StepResult,
    check::{Check, StepLengthError},
    device_data::{DeviceData, device_material},
    device_engine::DeviceEngine,
    energy::{Account, EnergyBalance},
    engine::{Delivered, Engine, EngineStep, ImageMoments, Order as EngineOrder},
    image::{BandImage, BandImages, RatioImage},
    moments,
    network::StepCost,
    network_file::network_file,
    pose::check_camera,
    pose_at,
    prepare::Prepared,
    reference_engine::ReferenceEngine,
    run,
    sampling::sampling,
    start, still,
    surroundings::surroundings_at,
    target::respond_f64,
    thermal_state::ThermalState,
    viewpoint::{camera_from_body, device_view, raster_view, source_view},
};
pub use crate::thermal::{
    STEFAN_BOLTZMANN,
    balance::{absorbed_flux, emissivity_sum},
    brightness::{BrightnessTable, MAX_TEMPERATURE},
    budget::{CAUSES, CHANNELS},
    emissivity::{BandEmissivity, ByAngle, ByWavelength, fresnel_reflectivity},
    function::{Function, TemperatureSample},
    incident::{IncidentFunction, incident},
    material::{
        Below, Bulk, Domain, Gloss, Material, Optics, Profile, Radiative, Response, Retarget, Sides, Transition,
    },
    network::{
        LinearConductor, Network, NodeKind, RadiativeConductor,
        control::{ControlError, IntegrationSettings, Integrator, Series, integrate},
        reference::ReferenceStepper,
        schedule::{HeatTable, Schedule, Thermostat},
        steady::{SteadyError, steady},
        stepper::{Attempt, StepMethod},
    },
    passband::Passband,
    planck::{Band, band_radiance_exact},
    planet_map::{DayLaw, PlanetPattern},
    radiance::{RadianceTable, band_radiance},
    reference::{Reference, ReferenceNode, commanded_temperature},
    sensor::{
        Detector, Netd, Pattern, Sensor, SensorOptics, Vignetting,
        gain_control::GainControl,
        halo::Halo,
        reading::{SensorConstants, radiance_slope},
        spread::Spread,
    },
    transition::{TransitionState, temperature, transition_step},
};
pub use crate::view::session::{ViewError, ViewSession};
pub use crate::{
    host::peak_memory,
    stop::{Stopped, until},
    text::is_hidden,
};
