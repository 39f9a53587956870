//! Scene files: every value of a full one, and the defaults of a short one.

use std::path::{Path, PathBuf};

use approx::assert_relative_eq;
use glam::{DMat4, DQuat, DVec3};
use isotherm::internals::{
    Attitude, Background, Bounces, CameraFrame, Detector, Draw, Edges, GainControl, Halo, ImageFile, ImageFiles,
    Initial, Mapping, Netd, Orbit, PRESETS, Part, Pattern, Reflections, SensorOptics, Spread, Surrounded, Video,
    Vignetting,
};
use isotherm::{Distortion, Lens, Motion, Scene, SceneError};

mod materials;
mod refusals;
mod responses;

/// A folder with an empty model, whose existence is enough, and a table.
struct Folder(tempfile::TempDir);

const TABLE: &str = include_str!("scene/surfaces.toml");

impl Folder {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("craft.glb"), b"").unwrap();
        std::fs::write(folder.path().join("table.toml"), TABLE).unwrap();
        Self(folder)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn parse(&self, text: &str) -> Result<Scene, SceneError> {
        Scene::parse(text, &self.path("scene.toml"))
    }

    /// The message with the folder's own path taken out.
    fn refusal(&self, text: &str) -> String {
        let error = self.parse(text).expect_err("this scene must be refused");
        error.to_string().replace(&format!("{}/", self.0.path().display()), "")
    }
}

/// A scene that states every key, but those of [temperatures], which would switch others off.
const FULL: &str = include_str!("scene/full.toml");

/// A minimal scene. `[materials]` is last so that rules can follow.
const SHORT: &str = include_str!("scene/short.toml");

#[test]
fn every_value_of_a_full_scene_arrives() {
    let folder = Folder::new();
    let scene = folder.parse(FULL).unwrap();
    assert_eq!(scene.name, "station");
    assert_eq!(scene.model_path, folder.path("craft.glb"));
    assert_eq!(scene.files, [folder.path("scene.toml"), folder.path("craft.glb"), folder.path("table.toml")]);
    let of = |name: &str| {
        let part = Part { name: name.to_owned(), body_from_part: DMat4::IDENTITY };
        let Edges { max, min } = scene.density.of(&part);
        (max, min)
    };
    assert_eq!(
        (of("array 2"), of("mast"), of("Mast")),
        ((Some(0.25), Some(0.02)), (Some(0.25), Some(0.02)), (Some(1.5), Some(0.0)))
    );
    assert_eq!((scene.time.step, scene.time.steps, scene.time.warm_up_orbits), (15.5, 360, 0.5));
    assert_eq!(scene.time.warm_up_step, 31.0);
    assert_eq!(scene.time.draw, Draw::Steps(vec![0, 90, 360]));
    let Orbit::Circular(orbit) = &scene.orbit else { panic!("a circular orbit") };
    assert_eq!((orbit.altitude, orbit.period), (772e3, 6017.0));
    assert_eq!((orbit.beta, orbit.phase), ((-30.0_f64).to_radians(), 90.0_f64.to_radians()));
    assert_eq!(scene.attitude, Attitude::Nadir { nadir_axis: DVec3::NEG_Y, forward_axis: DVec3::Z });
    let environment = &scene.environment;
    assert_eq!(environment.solar_constant, Some(1361.0));
    assert_eq!(environment.albedo, Some(0.3));
    assert_eq!(environment.planet_ir, Some(237.5));
    assert_eq!(environment.planet_radius, 6378137.0);
    assert_eq!(environment.background_temperature, Some(2.7));
    assert!(!environment.eclipse);
    assert_eq!((scene.band.lower, scene.band.upper), (3.5e-6, 5e-6));
    let surrounded = Surrounded {
        reflections: Reflections::Traced,
        bounces: Bounces::Most(12),
        background: Background::Planet,
        planet_temperature: 260.0,
        is_unstated: false,
        planet: None,
        albedo_map: None,
        planet_albedo: 0.25,
        channels: false,
    };
    assert_eq!(scene.surrounded, surrounded);
    assert_eq!(scene.initial, Initial::Temperature(290.0));
    assert_eq!(scene.probes.len(), 2);
    assert_eq!((scene.probes[0].name.as_str(), scene.probes[0].position), ("tip", DVec3::new(1.0, -2.5, 3.0)));
    assert_eq!((scene.probes[0].part.as_deref(), scene.probes[1].part.as_deref()), (Some("wing"), None));
    assert_eq!((scene.colour_range, scene.energy_balance), (Some([150.0, 350.0]), false));
    let shadows = scene.shadows.expect("the scene has shadows");
    assert_eq!(shadows.spacing, Some(0.2));
    assert_relative_eq!(shadows.redraw_angle, 0.5f64.to_radians(), epsilon = 1e-15);
    let exchange = scene.exchange.expect("the scene has exchange");
    assert_eq!((exchange.rays, exchange.patch_edge, exchange.bounces), (512, Some(1.5), Some(3)));
    assert_relative_eq!(exchange.redraw_angle, 2f64.to_radians(), epsilon = 1e-15);
    assert!(exchange.specular_sunlight);
    // The table's entries do not state the sides of the default. The other sentence says what exchange takes for granted.
    let [left_out, sides, figures] = scene.assumptions.as_slice() else { panic!("{:?}", scene.assumptions) };
    assert!(figures.contains("Figures of FLIR Boson 640 (camera.preset)") && figures.contains("unknown"), "{figures}");
    assert!(left_out.contains("reflect diffusely, but mirror direct sunlight once"), "{left_out}");
    assert_eq!(sides, "Surfaces exchange heat on their outside only (sides is absent): materials.default.");

    let sensor = scene.sensor.as_ref().expect("the scene has a sensor");
    assert_eq!((sensor.seed, sensor.bits, sensor.range), (9, 16, [250.0, 400.0]));
    assert_eq!((sensor.time_constant, sensor.kelvin_per_count), (Some(0.012), Some(0.01)));
    assert_eq!(sensor.detector, Detector { serial: 5, bad_pixels: 0.001 });
    let scale = 4.2 * 1e-6 * 1.4 / 12e-6;
    assert!(sensor.spread == Some(Spread::airy(scale, 0.9)) && sensor.spread != Some(Spread::airy(scale, 0.8)));
    assert_eq!(sensor.halo, Some(Halo { share: 0.05, radius: 40.0 }));
    assert_eq!(sensor.vignetting, Some(Vignetting::Cos4));
    assert_eq!(sensor.optics, SensorOptics { transmission: 0.9, lens: Some(290.0), housing: Some(300.0) });
    let netd = Netd { kelvin: 0.05, temperature: 303.0, stated_f_number: 1.0, f_number: 1.4 };
    assert_eq!(sensor.noise, Some(netd));
    let pattern = Pattern { offset: 0.1, gain: 0.005, drift: 0.0001, interval: Some(120.0), shutter: 295.0 };
    assert_eq!(sensor.pattern, Some(pattern));
    assert_eq!(sensor.gain_control, GainControl::Plateau { share: 0.02 });
    let images = ImageFiles {
        files: vec![ImageFile::NumbersPng, ImageFile::NumbersFits, ImageFile::KelvinTiff, ImageFile::DisplayPng],
        video: Some(Video::Apng),
        video_rate: 25.0,
        error: true,
        budget: true,
        one_colour_range: false,
    };
    assert_eq!(scene.images, images);
    assert_eq!(scene.preset.map(|preset| preset.name), Some("FLIR Boson 640"));

    let camera = scene.require_camera().unwrap();
    assert_eq!((camera.width, camera.height, camera.near), (640, 512, 0.5));
    assert_eq!(camera.lens.focal, [0.018 / 12e-6; 2]);
    assert_eq!((camera.lens.centre, camera.lens.skew), ([322.5, 255.0], 0.25));
    let numbers = [-0.1, 0.02, 0.001, -0.002, 0.003, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    assert_eq!(camera.lens.distortion, Distortion::BrownConrady(numbers));
    assert_eq!((camera.samples, camera.line_time), (16, 0.0));
    assert_eq!((camera.frame, camera.position), (CameraFrame::Orbit, DVec3::new(-50.0, 0.0, 0.0)));
    // From behind, along +X of the orbit frame with -Z up: right is +Y (against the orbit normal), down is nadir.
    for (axis, expected) in [(DVec3::X, DVec3::Y), (DVec3::Y, DVec3::Z), (DVec3::Z, DVec3::X)] {
        assert!((camera.frame_from_camera * axis - expected).length() < 1e-15);
    }
}

/// `[temperatures]` can not stand in the full scene: it takes the place of what other sections state.
#[test]
fn temperatures_of_a_file_switch_the_thermal_model_off() {
    let folder = Folder::new();
    std::fs::write(folder.path("t.csv"), "node,T\nROOT,20\ntip,30\n").unwrap();
    std::fs::write(folder.path("map.csv"), "part,node\nwing,t*\n*,ROOT\n").unwrap();
    let keys = "file = \"t.csv\"\nby = \"table\"\nmap = \"map.csv\"\ndistance = 0.2\nunmapped = 250\nstart = 60\nunit = \"degC\"\n";
    let full = FULL.replace("error = true\n", "");
    let scene = folder.parse(&format!("{full}[temperatures]\n{keys}")).unwrap();
    let given = scene.temperatures.as_ref().expect("temperatures");
    assert_eq!(
        (&given.file, given.distance, given.unmapped, given.start),
        (&folder.path("t.csv"), Some(0.2), Some(250.0), 60.0)
    );
    let rows = [["wing", "t*"], ["*", "ROOT"]].map(|row| row.map(str::to_owned));
    assert_eq!(given.mapping, Mapping::Table(rows.to_vec()));
    assert_eq!((scene.exchange, &scene.initial, scene.time.warm_up_orbits), (None, &Initial::Balance, 0.0));
    assert!(scene.contacts.is_empty() && scene.heaters.is_empty() && !scene.energy_balance);
    let told =
        |scene: &Scene| scene.assumptions.iter().any(|text| text.contains("All temperatures are those of t.csv"));
    assert!(told(&scene) && !told(&folder.parse(FULL).unwrap()));
}

#[test]
fn a_short_scene_says_what_it_assumes() {
    let folder = Folder::new();
    let scene = folder.parse(SHORT).unwrap();
    assert_eq!(scene.name, "scene");
    assert_eq!((scene.density.model.max, scene.colour_range, scene.energy_balance), (None, None, true));
    assert_eq!((scene.time.warm_up_orbits, &scene.time.draw), (0.0, &Draw::Every(1)));
    assert_eq!(scene.attitude, Attitude::Nadir { nadir_axis: DVec3::Z, forward_axis: DVec3::X });
    assert_eq!(scene.initial, Initial::Balance);
    assert_eq!((scene.band.lower, scene.band.upper), (8e-6, 14e-6));
    assert_eq!((scene.environment.albedo, scene.environment.background_temperature), (None, None));
    assert!(scene.environment.eclipse);
    assert_eq!(scene.environment.planet_radius, 6371e3);
    // 2 pi sqrt((6371e3 + 408e3)^3 / 3.986004418e14), computed with Python.
    assert_relative_eq!(scene.orbit.period(), 5554.684945512347, epsilon = 1e-9);
    let camera = scene.require_camera().unwrap();
    // tan 45 deg = 1: the focal length is half the width.
    assert_relative_eq!(camera.lens.focal[0], 50.0, epsilon = 1e-12);
    assert_eq!((camera.frame, camera.near), (CameraFrame::Body, 0.1));
    let expected = [
        "(time.warm_up_orbits is absent)",
        "(environment.planet_radius is absent)",
        "(environment.albedo is absent)",
        "(environment.planet_ir is absent)",
        "(environment.background_temperature is absent)",
        "(environment.eclipse is absent)",
        "(orbit.period is absent;",
        "(orbit.beta_deg is absent)",
        "(orbit.phase_deg is absent)",
        "(attitude.nadir_axis is absent)",
        "(attitude.forward_axis is absent)",
        "(there is no section [shadows])",
        "(there is no section [exchange])",
        "(model.max_edge is absent)",
        "(sides is absent)",
        "(radiance.band_um is absent)",
        "(camera.frame is absent: 'body')",
        "(camera.up is absent)",
        "(camera.near is absent)",
        "(initial.temperature is absent)",
    ];
    for (assumption, key) in scene.assumptions.iter().zip(expected) {
        assert!(assumption.contains(key), "'{assumption}' is not about {key}");
    }
    assert_eq!(scene.assumptions.len(), expected.len());
}

#[test]
fn attitudes_cameras_and_times_have_their_other_forms() {
    let folder = Folder::new();
    let with = |from: &str, to: &str| {
        assert!(SHORT.contains(from));
        folder.parse(&SHORT.replace(from, to)).unwrap()
    };
    let half = 0.5_f64.sqrt();
    let scene = with("mode = \"nadir\"", "mode = \"inertial\"\nquaternion = [0.7071, 0, 0, 0.7071]");
    let Attitude::Inertial { inertial_from_body } = scene.attitude else { panic!("inertial") };
    // The scalar comes first. A quarter turn about +Z takes X to Y.
    assert!(inertial_from_body.angle_between(DQuat::from_xyzw(0.0, 0.0, half, half)) < 1e-7);
    assert!((inertial_from_body * DVec3::X - DVec3::Y).length() < 1e-12);
    assert!(scene.assumptions.iter().any(|sentence| sentence.contains("is normalised")));

    let scene = with("mode = \"nadir\"", "mode = \"sun\"\nsun_axis = \"+Z\"\nnorth_axis = [-7, 0, 0]");
    assert_eq!(scene.attitude, Attitude::Sun { sun_axis: DVec3::Z, north_axis: DVec3::NEG_X });

    let calibrated = with("fov_deg = 90", "fx = 800\nfy = 790\ncx = 51\ncy = 24.5\ndistortion = [0.1, 0, 0, 0.01]");
    // Four numbers are OpenCV's, and readers of older files are told.
    assert!(calibrated.assumptions.iter().any(|told| told.contains("k1, k2, p1, p2")), "{:?}", calibrated.assumptions);
    let calibrated = calibrated.camera.unwrap();
    let mut numbers = [0.0; 12];
    (numbers[0], numbers[3]) = (0.1, 0.01);
    let distortion = Distortion::BrownConrady(numbers);
    assert_eq!(calibrated.lens, Lens { focal: [800.0, 790.0], centre: [51.0, 24.5], skew: 0.0, distortion });
    let fisheye = "fov_deg = 90\ndistortion = [0.1, 0, 0, 0.01]\ndistortion_model = \"fisheye\"";
    let distortion = with("fov_deg = 90", fisheye).camera.unwrap().lens.distortion;
    assert_eq!(distortion, Distortion::Fisheye([0.1, 0.0, 0.0, 0.01]));
    assert_eq!((calibrated.samples, calibrated.line_time), (4, 0.0));
    let rolling = with("fov_deg = 90", "fov_deg = 90\nsamples = 8\nline_time = 30e-6").camera.unwrap();
    assert_eq!((rolling.samples, rolling.line_time), (8, 30e-6));
    assert_eq!(with("fov_deg = 90", "focal_px = 800").camera.unwrap().lens.focal, [800.0; 2]);
    let camera = with("look_at = [0, 0, 0]", "quaternion = [1, 0, 0, 0]").camera.unwrap();
    assert_eq!(camera.frame_from_camera, DQuat::IDENTITY);

    assert_eq!(with("steps = 100", "steps = 100\ndraw_every = 25").time.draw, Draw::Every(25));
    assert_eq!(with("steps = 100", "steps = 100\ndraw_every = 0").time.draw, Draw::None);
    assert_eq!(with("steps = 100", "steps = 100\ndraw_steps = []").time.draw, Draw::None);

    let scene = with("altitude = 408e3", "altitude = 224e3\nperiod = 6017");
    assert_eq!(scene.orbit.period(), 6017.0);
    // docs/numerics.md 2: 5330 s with R = 6371 km.
    assert!(scene.assumptions.iter().any(|sentence| sentence.contains("stated altitude takes 5330.1 s")));
}

/// Every preset is a scene where the user states what is unknown, and the user's own values come first.
#[test]
fn presets_state_what_is_known_and_ask_for_the_rest() {
    let folder = Folder::new();
    let camera = "width = 100\nheight = 50\nfov_deg = 90\n";
    for preset in PRESETS {
        let text = SHORT.replace(camera, &format!("preset = \"{}\"\nfov_deg = 12\n", preset.key));
        let scene = folder.parse(&format!("{text}[sensor]\nnetd = 0.07\nrange = [200, 400]\n")).unwrap();
        let (camera, sensor) = (scene.camera.unwrap(), scene.sensor.unwrap());
        assert_eq!([camera.width, camera.height], preset.size);
        assert_relative_eq!(
            camera.lens.focal[0],
            f64::from(preset.size[0]) / 2.0 / 6f64.to_radians().tan(),
            max_relative = 1e-12
        );
        assert_eq!((sensor.noise.unwrap().kelvin, sensor.time_constant), (0.07, preset.time_constant));
        if let Some([lower, upper]) = preset.band_um {
            assert_eq!((scene.band.lower, scene.band.upper), (lower / 1e6, upper / 1e6));
        }
        assert!(folder.parse(&text).unwrap().sensor.is_none(), "without [sensor] there is none");
        let bare = folder.parse(&format!("{text}[sensor]\nrange = [200, 400]\n"));
        match preset.netd {
            Some(netd) => assert_eq!(bare.unwrap().sensor.unwrap().noise.unwrap().kelvin, netd),
            None => {
                let message = bare.unwrap_err().to_string();
                assert!(message.contains("sensor.netd: is missing") && message.contains(preset.name), "{message}");
            }
        }
    }
    let tiri = SHORT.replace(camera, "preset = \"tiri\"\n");
    let scene = folder.parse(&tiri).unwrap();
    // 13.3 deg over 1024 pixels.
    assert_relative_eq!(scene.camera.unwrap().lens.focal[0], 512.0 / 6.65f64.to_radians().tan(), max_relative = 1e-12);
}

#[test]
fn tables_of_the_sensor_are_read_and_refused() {
    let folder = Folder::new();
    let with = |keys: &str| format!("{SHORT}[sensor]\nnetd = 0\nrange = [200, 400]\n{keys}");
    std::fs::write(folder.path("psf.csv"), "0,1,0\n1,4,1\n0,1,0\n").unwrap();
    let row = format!("{}\n", vec!["0.5"; 100].join(","));
    std::fs::write(folder.path("map.csv"), row.repeat(50)).unwrap();
    let text = with("point_spread = \"file\"\nkernel = \"psf.csv\"\nvignetting_map = \"map.csv\"\n");
    let scene = folder.parse(&text).unwrap();
    let sensor = scene.sensor.unwrap();
    let cross = |middle: f64| Spread::measured(1, &[0.0, 1.0, 0.0, 1.0, middle, 1.0, 0.0, 1.0, 0.0]);
    assert!(sensor.spread == Some(cross(4.0)) && sensor.spread != Some(cross(5.0)));
    assert_eq!(sensor.vignetting, Some(Vignetting::Map(vec![0.5; 5000])));
    assert!(scene.files.contains(&folder.path("psf.csv")) && scene.files.contains(&folder.path("map.csv")));
    assert_eq!(sensor.noise, None);
    for (file, content, expected) in [
        ("psf.csv", "1,2\n3,4\n", "sensor.kernel: has 2 rows: a kernel has an odd number from 3 to 63"),
        ("psf.csv", "1,2,3\n1,2\n1,2,3\n", "sensor.kernel: row 2 has 2 numbers"),
        ("psf.csv", "1,2,3\n1,-2,3\n1,2,3\n", "sensor.kernel: has the weight -2"),
        ("psf.csv", "1,2,3\n1,x,3\n1,2,3\n", "sensor.kernel: line 2: 'x' is no finite number"),
        ("psf.csv", "0,0,0\n0,0,0\n0,0,0\n", "sensor.kernel: has weights whose sum is 0"),
        ("map.csv", "1,1\n", "sensor.vignetting_map: has 1 rows, and the image has 50"),
    ] {
        std::fs::write(folder.path("psf.csv"), "0,1,0\n1,4,1\n0,1,0\n").unwrap();
        std::fs::write(folder.path(file), content).unwrap();
        let message = folder.refusal(&text);
        assert!(message.contains(expected), "expected {expected}\n found {message}");
    }
}

#[test]
fn a_scene_that_draws_nothing_needs_no_camera() {
    let folder = Folder::new();
    let (before, camera) = SHORT.split_once("[camera]").unwrap();
    let (_, after) = camera.split_once("[materials]").unwrap();
    let blind = format!("{before}[materials]{after}").replace("steps = 100", "steps = 100\ndraw_every = 0");
    let scene = folder.parse(&blind).unwrap();
    assert_eq!(scene.camera, None);
    assert!(scene.require_camera().unwrap_err().to_string().contains("scene.toml:1: camera: is missing"));
    // A scene that draws gets a camera, which is placed when the model is known.
    let drawn = folder.parse(&blind.replace("draw_every = 0", "draw_every = 1")).unwrap();
    let camera = drawn.require_camera().unwrap();
    assert_eq!((camera.width, camera.height, &camera.motion), (640, 512, &Motion::Framed));
    assert!(drawn.assumptions.iter().any(|told| told.contains("no [camera]")), "{:?}", drawn.assumptions);
}

/// Issue 33, point 1: images with a sensor had a black planet unless the scene asked for one.
#[test]
fn a_sensor_sees_the_planet_unless_the_scene_says_otherwise() {
    let folder = Folder::new();
    let sensor = |environment: &str, radiance: &str, camera: &str| {
        let text = SHORT
            .replace("[environment]", &format!("[environment]\n{environment}"))
            .replace("fov_deg = 90", &format!("fov_deg = 90\n{camera}"));
        folder.parse(&format!("{text}\n[radiance]\n{radiance}\n[sensor]\nnetd = 0.05\nrange = [200, 400]\n")).unwrap()
    };
    let told = |scene: &Scene, words: &str| scene.assumptions.iter().any(|told| told.contains(words));
    let seen = sensor("planet_ir = 237", "", "");
    assert_eq!(seen.surrounded.background, Background::Planet);
    // By hand: (237 / 5.670374e-8)^(1/4) = 254.26 K.
    assert!(told(&seen, "254.26 K") && told(&seen, "\"off\" leaves it out"), "{:?}", seen.assumptions);
    assert_eq!(sensor("planet_ir = 237", "background = \"off\"", "").surrounded.background, Background::Off);
    let unknown = sensor("", "", "");
    assert!(unknown.surrounded.background == Background::Off && told(&unknown, "how warm it is"));
    let rolling = sensor("planet_ir = 237", "", "line_time = 1e-5");
    assert_eq!(rolling.surrounded.background, Background::Planet);
}

#[test]
fn the_example_of_the_reference_is_a_scene() {
    let models = Path::new(env!("CARGO_MANIFEST_DIR")).join("models");
    let reference = std::fs::read_to_string(models.join("../docs/scene.md")).unwrap();
    let example = reference.split("```toml\n").nth(1).unwrap().split("```").next().unwrap();
    let folder = Folder::new();
    std::fs::copy(models.join("materials.toml"), folder.path("materials.toml")).unwrap();
    std::fs::copy(folder.path("craft.glb"), folder.path("station.glb")).unwrap();
    let scene = folder.parse(example).unwrap();
    assert_eq!((scene.name.as_str(), scene.materials.rules.len()), ("station", 2));
    assert!(folder.refusal(&example.replace("HANDRAIL?\"", "HANDRAIL?\"\nuse = \"foil\"")).contains("material.use"));
}
