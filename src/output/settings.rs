//! The settings of a scene in words, for the report.

use super::report::SettingGroup;
use crate::environment::{Attitude, Orbit};
use crate::lens::{Distortion, Lens};
use crate::scene::{Camera, Draw, Initial, MotionBlur, Scene};
use crate::simulation::exchange::ExchangeCraft;
use crate::simulation::prepare::Prepared;
use crate::thermal::material::{Domain, Material, Profile, Response, Retarget, Sides};
use crate::thermal::sensor::{Sensor, Vignetting};

/// All settings in groups, in file order.
pub(crate) fn groups(prepared: &Prepared) -> Vec<SettingGroup> {
    let scene = &prepared.scene;
    let mut groups = group_density(scene);
    groups.push(group_time(prepared));
    if let Some(given) = &prepared.given {
        let lines = given.lines().iter().map(|(name, value)| (&**name, value.clone()));
        groups.push(group("Temperatures from a file", lines.collect()));
    }
    groups.extend([
        group("Orbit", describe_orbit(&scene.orbit)),
        group("Attitude", vec![("law", describe_attitude(&scene.attitude))]),
        group_environment(scene),
    ]);
    groups.extend(prepared.exchange.as_deref().map(group_exchange));
    groups.extend(scene.camera.as_ref().map(|camera| group_camera(camera, scene)));
    groups.extend(scene.sensor.as_ref().map(|sensor| group("Sensor", of_sensor(sensor))));
    groups.extend(prepared.materials.iter().map(group_material));
    groups
}

fn group(title: &str, entries: Vec<(&str, String)>) -> SettingGroup {
    let entries = entries.into_iter().map(|(name, value)| (name.to_owned(), value)).collect();
    SettingGroup { title: title.to_owned(), entries }
}

/// The groups of the model and of its parts with edge lengths.
fn group_density(scene: &Scene) -> Vec<SettingGroup> {
    let mut groups = vec![group(
        "Model",
        vec![
            ("path", scene.model_path.display().to_string()),
            ("max_edge", max_edge(scene.density.model.max)),
            ("min_edge", min_edge(scene.density.model.min)),
        ],
    )];
    for rule in &scene.density.parts {
        let edges = [
            rule.edges.max.map(|_| ("max_edge", max_edge(rule.edges.max))),
            rule.edges.min.map(|_| ("min_edge", min_edge(rule.edges.min))),
        ];
        let title = format!("Parts {}", rule.patterns.join(", "));
        groups.push(group(&title, edges.into_iter().flatten().collect()));
    }
    groups
}

fn group_time(prepared: &Prepared) -> SettingGroup {
    let scene = &prepared.scene;
    group(
        "Time",
        vec![
            ("step", format!("{} s", scene.time.step)),
            ("steps", scene.time.steps.to_string()),
            ("warm-up", format!("{} orbits, {} steps", scene.time.warm_up_orbits, prepared.warm_up_steps())),
            ("step of the warm-up", format!("{} s", scene.time.warm_up_step)),
            (
                "drawn",
                match &scene.time.draw {
                    Draw::None => "no step".to_owned(),
                    Draw::Every(1) => "every step".to_owned(),
                    Draw::Every(n) => format!("every {n} steps"),
                    Draw::Steps(steps) => format!("steps {steps:?}"),
                    Draw::Times(times) => format!("{} images at their own times, {}", times.len(), ends(times)),
                },
            ),
            (
                "start",
                match scene.initial {
                    Initial::Balance => "balance temperature of the first load".to_owned(),
                    Initial::Temperature(temperature) => format!("{temperature} K"),
                },
            ),
        ],
    )
}

fn describe_orbit(orbit: &Orbit) -> Vec<(&'static str, String)> {
    match orbit {
        Orbit::Circular(orbit) => vec![
            ("altitude", format!("{} km", orbit.altitude / 1e3)),
            ("period", format!("{} s", orbit.period)),
            ("beta", format!("{:.3} deg", orbit.beta.to_degrees())),
            ("phase", format!("{:.3} deg", orbit.phase.to_degrees())),
        ],
        Orbit::Trajectory(trajectory) => vec![
            ("trajectory", trajectory.description.clone()),
            ("time 0", trajectory.utc(0.0)),
            ("period", format!("{:.1} s (osculating at time 0)", trajectory.period())),
        ],
        Orbit::Given(_) => vec![("places", "given from outside".to_owned())],
    }
}

fn describe_attitude(attitude: &Attitude) -> String {
    match attitude {
        Attitude::Nadir { nadir_axis, forward_axis } => format!("nadir {nadir_axis}, forward {forward_axis}"),
        Attitude::Inertial { inertial_from_body: q } => format!("inertial [{}, {}, {}, {}]", q.w, q.x, q.y, q.z),
        Attitude::Sun { sun_axis, north_axis } => format!("Sun {sun_axis}, orbit normal {north_axis}"),
        Attitude::Spin { axis, rate, .. } => format!("spinning about {axis}, {:.4} deg/s", rate.to_degrees()),
        Attitude::Tumble => "tumbling: means over all orientations".to_owned(),
        Attitude::History(history) => history.description.clone(),
    }
}

fn group_environment(scene: &Scene) -> SettingGroup {
    let environment = &scene.environment;
    let optional = |value: Option<f64>, unit: &str| value.map_or("off".to_owned(), |value| format!("{value} {unit}"));
    group(
        "Environment",
        vec![
            ("solar constant", optional(environment.solar_constant, "W/m2")),
            ("albedo", optional(environment.albedo, "")),
            ("planet infrared", optional(environment.planet_ir, "W/m2")),
            ("planet radius", format!("{} km", environment.planet_radius / 1e3)),
            ("eclipse", if environment.eclipse { "on" } else { "off" }.to_owned()),
            ("background", optional(environment.background_temperature, "K")),
        ],
    )
}

fn group_exchange(craft: &ExchangeCraft) -> SettingGroup {
    let settings = &craft.settings;
    group(
        "Radiation between surfaces",
        vec![
            ("patches", craft.patches.all.len().to_string()),
            ("patch_edge", settings.patch_edge.map_or("chosen from the area".to_owned(), |edge| format!("{edge} m"))),
            ("rays", settings.rays.to_string()),
            ("bounces", settings.bounces.map_or("all".to_owned(), |bounces| bounces.to_string())),
            ("redraw angle", format!("{:.3} deg", settings.redraw_angle.to_degrees())),
            ("hold", format!("{} s", craft.held_time())),
        ],
    )
}

fn group_camera(camera: &Camera, scene: &Scene) -> SettingGroup {
    let mut entries = vec![("size", format!("{} x {}", camera.width, camera.height))];
    entries.extend(lens_lines(camera));
    entries.extend([
        ("frame", format!("{:?}", camera.frame).to_lowercase()),
        ("position", format!("{} m", camera.position)),
        ("band", scene.band.to_string()),
    ]);
    entries.extend(scene.bands.iter().map(|band| ("[[band]]", format!("{}, {}", band.name, band.passband.band))));
    group("Camera", entries)
}

fn group_material(material: &Material) -> SettingGroup {
    let back = match material.sides {
        Sides::Outside => "radiates outside only".to_owned(),
        Sides::Both { back } => format!("back {} / {}", back.absorptivity, back.emissivity),
    };
    let response = describe_response(&material.response);
    group(
        &format!("Material {}", material.name),
        vec![
            ("absorptivity / emissivity", format!("{} / {}", material.front.absorptivity, material.front.emissivity)),
            ("sides", back),
            ("response", response),
            ("source", material.source.clone()),
        ],
    )
}

fn describe_response(response: &Response) -> String {
    match response {
        Response::Instant => "instant".to_owned(),
        Response::Network => "network".to_owned(),
        Response::Given => "given by temperatures.file".to_owned(),
        Response::Radiative(plate) => format!(
            "radiative, {:.4} J/(m2 K){}",
            plate.capacity,
            plate.over.map_or(String::new(), |over| format!(
                " over {:.4} J/(m2 K), effective emittance {}",
                over.capacity, over.effective_emittance
            ))
        ),
        Response::Transition(transition) => format!(
            "transition of {}, heating {}, cooling {}, {}",
            match transition.domain {
                Domain::Temperature => "T",
                Domain::FourthPower => "T4",
            },
            profile(&transition.heating),
            profile(&transition.cooling),
            match transition.retarget {
                Retarget::Merge => "merge",
                Retarget::Restart => "restart",
            }
        ),
    }
}

/// Lens and samples of a camera, in words.
pub(crate) fn lens_lines(camera: &Camera) -> Vec<(&'static str, String)> {
    let Lens { focal: [fx, fy], centre: [cx, cy], skew, distortion } = camera.lens;
    let (x, y) = (cx - 0.5, cy - 0.5);
    let mut lines = vec![
        ("focal length", format!("{fx:.3} x {fy:.3} pixels")),
        ("principal point", format!("({cx}, {cy}) px with pixel centres at +0.5; OpenCV's cx = {x}, cy = {y}")),
    ];
    lines.extend((skew != 0.0).then(|| ("skew", format!("{skew} px"))));
    lines.extend(match distortion {
        Distortion::None => None,
        Distortion::BrownConrady(numbers) => Some((
            "distortion",
            format!("Brown-Conrady {numbers:?} (OpenCV's order: k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4)"),
        )),
        Distortion::Fisheye(numbers) => Some(("distortion", format!("fisheye {numbers:?} (OpenCV's k1 k2 k3 k4)"))),
    });
    lines.extend((camera.samples > 1).then(|| ("samples", format!("{} of a pixel", camera.samples))));
    let MotionBlur { time, sub_frames } = camera.exposure;
    lines.extend((time > 0.0).then(|| ("exposure", format!("{time} s, the mean over {sub_frames} sub-frames"))));
    lines.extend((camera.line_time > 0.0).then(|| ("line time", format!("{} s from row to row", camera.line_time))));
    lines
}

fn of_sensor(sensor: &Sensor) -> Vec<(&'static str, String)> {
    let optional = |value: Option<String>| value.unwrap_or_else(|| "off".to_owned());
    let noise =
        sensor.noise.map(|netd| format!("{:.4} K at {} K, f/{}", netd.at_f_number(), netd.temperature, netd.f_number));
    let pattern = sensor
        .pattern
        .map(|pattern| format!("offsets {} K, gains {}, drift {} K/s", pattern.offset, pattern.gain, pattern.drift));
    let [low, high] = sensor.range;
    vec![
        ("digital numbers", format!("{} bits over {low} to {high} K", sensor.bits)),
        ("NETD", optional(noise)),
        ("seed", sensor.seed.to_string()),
        ("serial", sensor.detector.serial.to_string()),
        ("time constant", optional(sensor.time_constant.map(|constant| format!("{constant} s")))),
        ("fixed pattern", optional(pattern)),
        ("bad pixels", sensor.detector.bad_pixels.to_string()),
        (
            "point spread",
            optional(sensor.spread.as_ref().map(|one| format!("radius {} px, {} terms", one.radius, one.terms.len()))),
        ),
        ("stray light", optional(sensor.halo.map(|halo| format!("{} over {} px", halo.share, halo.radius)))),
        (
            "vignetting",
            match &sensor.vignetting {
                None => "off",
                Some(Vignetting::Cos4) => "cos4",
                Some(Vignetting::Map(_)) => "map",
            }
            .to_owned(),
        ),
        ("transmission", sensor.optics.transmission.to_string()),
        ("radiometric output", optional(sensor.kelvin_per_count.map(|kelvin| format!("{kelvin} K a count")))),
    ]
}

fn max_edge(edge: Option<f64>) -> String {
    edge.filter(|edge| edge.is_finite()).map_or("as in the file".to_owned(), |edge| format!("{edge} m"))
}

fn min_edge(edge: Option<f64>) -> String {
    edge.map_or("off".to_owned(), |edge| format!("{edge} m"))
}

fn profile(profile: &Profile) -> String {
    format!("{} in {:.1} steps", profile.function, profile.t_max_steps)
}
/// The first and the last of some times [s], in words.
fn ends(times: &[f64]) -> String {
    match times {
        [first, .., last] => format!("{first} to {last} s"),
        [only] => format!("{only} s"),
        [] => String::new(),
    }
}
