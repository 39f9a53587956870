//! Cameras that move, images at their own times, and many poses from one thermal state.

use std::f64::consts::TAU;

use glam::{DQuat, DVec3};
use isotherm::internals::{
    CameraFrame, DeviceEngine, Draw, Engine, FrameHeader, Prepared, ReferenceEngine, StepResult, View,
    camera_from_body, device_view, read_exr, run, start,
};
use isotherm::{EngineError, Image, Motion, Scene};

use super::craft::{Folder, never, scene_with};
use super::device::{assert_silent, context};
use super::program::{end, isotherm, refusal, run as run_validated, succeed};

/// The camera of the craft's scene without its fixed pose, and no images at steps.
fn moving(images: &str, camera: &str) -> String {
    scene_with(&[
        ("draw_every = 4", images),
        ("frame = \"body\"\nposition = [6.5, 5, -7.5]\nlook_at = [0, 0, 0]\nup = [0, 0, -1]", camera),
    ])
}

/// A quarter of a circle of 12 m about the craft in 720 s, with a sample each minute.
fn circle() -> String {
    circle_from(0)
}

/// The same with its first sample at a time [s].
fn circle_from(start: i32) -> String {
    let mut text = "time,x,y,z\n".to_owned();
    for minute in 0..=12i32 {
        let angle = TAU / 4.0 * f64::from(minute) / 12.0;
        text += &format!("{},{},{},-3\n", start + 60 * minute, 12.0 * angle.cos(), 12.0 * angle.sin());
    }
    text
}

/// The images of a run from time 0: time, temperature, part.
fn images(prepared: &Prepared, engine: &mut dyn Engine) -> Vec<(f64, Vec<f32>, Vec<u32>)> {
    start(prepared, engine, None, &never(), &mut || ()).expect("a warm-up");
    let mut found = Vec::new();
    let mut take = |result: StepResult| {
        if let Some(pixels) = result.delivered.image {
            let temperatures = pixels.temperature.clone();
            found.push((result.time, temperatures, pixels.part.clone()));
        }
        Ok::<_, EngineError>(())
    };
    assert!(run(prepared, engine, None, &never(), &mut take).expect("a run"));
    found
}

fn on_device(prepared: &Prepared) -> Vec<(f64, Vec<f32>, Vec<u32>)> {
    let context = context();
    let camera = prepared.scene.camera.as_ref();
    let found = images(prepared, &mut DeviceEngine::new(&context, prepared, camera).expect("a small scene"));
    assert_silent(&context);
    found
}

/// Largest difference of temperatures where both images show the same part [K], and the number of those pixels.
fn difference(one: &(f64, Vec<f32>, Vec<u32>), two: &(f64, Vec<f32>, Vec<u32>)) -> (f32, usize) {
    let same = (0..one.1.len()).filter(|pixel| one.2[*pixel] != 0 && one.2[*pixel] == two.2[*pixel]);
    same.fold((0.0, 0), |(most, count), pixel| ((one.1[pixel] - two.1[pixel]).abs().max(most), count + 1))
}

#[test]
fn between_agrees_with_its_twin() {
    let scene = moving(
        "images = [0, 15, 90, 119.9, 120, 700.5]",
        "path = 'path.csv'\nframe = 'body'\nlook_at = [0, 0, 0]\nup = [0, 0, -1]",
    );
    let folder = Folder::new("");
    folder.write("path.csv", &circle());
    folder.write("scene.toml", &scene);
    let prepared = folder.prepared();
    let device = on_device(&prepared);
    let camera = prepared.scene.camera.as_ref();
    let twin = images(&prepared, &mut ReferenceEngine::new(&prepared, camera));
    let times = |of: &[(f64, Vec<f32>, Vec<u32>)]| of.iter().map(|image| image.0).collect::<Vec<_>>();
    assert_eq!(times(&device), [0.0, 15.0, 90.0, 119.9, 120.0, 700.5]);
    assert_eq!(times(&twin), times(&device));
    // On a crease of a part f32 and f64 may see different faces, so a few pixels may differ.
    let off = |one: &(f64, Vec<f32>, Vec<u32>), two: &(f64, Vec<f32>, Vec<u32>)| {
        let same = (0..one.1.len()).filter(|pixel| one.2[*pixel] != 0 && one.2[*pixel] == two.2[*pixel]);
        same.fold([0, 0], |[off, count], pixel| {
            [off + usize::from((one.1[pixel] - two.1[pixel]).abs() > 5e-3), count + 1]
        })
    };
    for (one, two) in device.iter().zip(&twin) {
        let [off, count] = off(one, two);
        assert!(count > 300 && off <= count / 200, "{} s: {off} of {count} pixels differ", one.0);
    }
    // A quarter of a step earlier, and the camera where it was.
    folder.write("scene.toml", &scene.replace("15, 90,", "15, 75,"));
    folder.write("path.csv", &circle_from(-15));
    let earlier = on_device(&folder.prepared());
    let [off, count] = off(&earlier[2], &twin[2]);
    assert!(off > count / 20, "{off} of {count} pixels");
}

/// The skin of the craft as a network.
const NETWORK: [(&str, &str); 1] = [(
    "response = \"transition\"\nretarget = \"merge\"\nheating = { function = \"quadratic\", t_max_steps = 20 }\n\
     cooling = { function = \"linear\", t_max_steps = 30 }",
    "response = \"network\"\nthickness = 0.002\ndensity = 2700\nspecific_heat = 900\nconductivity = 150",
)];

/// Also of nodes that a network moves, on the host or within the frames.
#[test]
fn an_image_between_steps_lies_between_their_images() {
    for (changes, more) in
        [(&[][..], ""), (&NETWORK[..], ""), (&NETWORK[..], "\n[network]\nintegrator = \"one_pass\"\n")]
    {
        let scene = |images: &str| scene_with(&[changes, &[("draw_every = 4", images)]].concat()) + more;
        let folder = Folder::new(&scene("images = [60, 75, 90, 120]"));
        let between = on_device(&folder.prepared());
        folder.write("scene.toml", &scene("draw_steps = [1, 2]"));
        let steps = on_device(&folder.prepared());
        for (image, share) in [(0, 0.0), (1, 0.25), (2, 0.5), (3, 1.0)] {
            let drawn = (0..between[image].1.len()).filter(|pixel| steps[0].2[*pixel] != 0);
            let off = |share: f64, pixel: usize| {
                let [early, late] = [&steps[0], &steps[1]].map(|step| f64::from(step.1[pixel]));
                (f64::from(between[image].1[pixel]) - early - share * (late - early)).abs()
            };
            let worst = |share: f64| drawn.clone().map(|pixel| off(share, pixel)).fold(0.0, f64::max);
            assert!(worst(share) < 2e-4, "image {image} {more}: {} K", worst(share));
            assert!(worst(share + 0.05) > 0.01, "image {image} must depend on its time");
        }
    }
}

/// A craft without images between steps has no buffer and no pass for them.
#[test]
fn what_is_not_between_steps_costs_nothing() {
    let still = "frame = \"body\"\nposition = [6.5, 5, -7.5]\nlook_at = [0, 0, 0]\nup = [0, 0, -1]";
    let folder = Folder::new(&moving("images = [60, 75]", still));
    let info = |folder: &Folder| succeed(folder.0.path(), &["info", "scene.toml"]);
    assert!(info(&folder).contains("EarlierTemperature"));
    folder.write("scene.toml", &scene_with(&[]));
    assert!(!info(&folder).contains("EarlierTemperature"));
}

/// The poses that a scene's camera has at some times.
fn poses(folder: &Folder, times: &[f64]) -> Vec<View> {
    let prepared = folder.prepared();
    let camera = prepared.scene.camera.as_ref().expect("a camera");
    let view = |time: &f64| {
        let sky = prepared.loads.sky_model().sky(*time);
        let there = camera.at(*time, None).expect("covered");
        device_view(&there, &camera_from_body(&there, &sky))
    };
    times.iter().map(view).collect()
}

fn largest(one: &[View], two: &[View]) -> f32 {
    let rows = |view: &View| [view.camera_from_body_x, view.camera_from_body_y, view.camera_from_body_z].concat();
    one.iter()
        .zip(two)
        .flat_map(|(one, two)| rows(one).into_iter().zip(rows(two)).map(|(a, b)| (a - b).abs()).collect::<Vec<_>>())
        .fold(0.0, f32::max)
}

/// The same way stated from the craft in its orbit frame, and from the planet's centre in the inertial frame.
#[test]
fn a_relative_and_an_absolute_path_are_the_same_way() {
    let times: Vec<f64> = (0..=12).map(|step| 60.0 * f64::from(step)).collect();
    let folder = Folder::new("");
    let lvlh = circle();
    folder.write("lvlh.csv", &lvlh);
    let look = "look_at = [0, 0, 0]\nup = [0.1, 0.2, 1]";
    folder.write(
        "scene.toml",
        &moving("draw_every = 1", &format!("path = 'lvlh.csv'\npath_relative_to = 'orbit'\n{look}")),
    );
    let relative = folder.prepared();
    assert_eq!(relative.scene.camera.as_ref().map(|camera| camera.frame), Some(CameraFrame::Orbit));
    let mut absolute = "time,x,y,z,qw,qx,qy,qz\n".to_owned();
    let mut halved = "time,x,y,z,qw,qx,qy,qz\n".to_owned();
    for time in &times {
        let point = relative.scene.orbit.point(*time, 6371e3).expect("covered");
        let camera = relative.scene.camera.as_ref().expect("a camera").at(*time, None).expect("covered");
        let q = DQuat::from_mat3(&point.inertial_from_orbit) * camera.frame_from_camera;
        let row = |position: DVec3| {
            format!("{time},{},{},{},{},{},{},{}\n", position.x, position.y, position.z, q.w, q.x, q.y, q.z)
        };
        absolute += &row(point.position + point.inertial_from_orbit * camera.position);
        halved += &row(point.position + point.inertial_from_orbit * camera.position * 0.5);
    }
    let before = poses(&folder, &times);
    folder.write("absolute.csv", &absolute);
    let inertial = "path = 'absolute.csv'\npath_relative_to = 'inertial'";
    folder.write("scene.toml", &moving("draw_every = 1", inertial));
    // The positions are 7e6 m long, so their differences are good to 1e-9 m before the device's rounding.
    let error = largest(&before, &poses(&folder, &times));
    assert!(error < 1e-5, "{error}");
    folder.write("absolute.csv", &halved);
    assert!(largest(&before, &poses(&folder, &times)) > 1.0);
}

/// The scene's refusal of a path.
fn refused(camera: &str, path: &str) -> String {
    let folder = Folder::new(&moving("images = { start = 0, stop = 60, rate_hz = 0.5 }", camera));
    folder.write("path.csv", path);
    let output = end(isotherm(folder.0.path(), &["run", "scene.toml", "-o", "out"]));
    let (code, message) = refusal(&output);
    assert!(code != Some(0) && !folder.path("out").exists(), "{message}: nothing is written");
    message
}

#[test]
fn a_path_that_gives_no_pose_is_refused_with_file_line_and_range() {
    let head = "time,x,y,z,qw,qx,qy,qz\n";
    let rows = |rows: &str| format!("{head}{rows}");
    for (path, expected) in [
        (
            rows("0,5,0,0,1,0,0,0\n30,5,0,0,1,0,0,0\n"),
            "path.csv:1: camera.path: has no position at 32 s: it covers 0 to 30 s",
        ),
        (rows("10,5,0,0,1,0,0,0\n80,5,0,0,1,0,0,0\n"), "has no position at 0 s: it covers 10 to 80 s"),
        (
            rows(
                "0,5,0,0,1,0,0,0\n1,5,0,0,1,0,0,0\n2,5,0,0,1,0,0,0\n50,5,0,0,1,0,0,0\n51,5,0,0,1,0,0,0\n70,5,0,0,1,0,0,0\n",
            ),
            "has no position at 4 s: it covers 0 to 2 s, 50 to 51 s, 70 to 70 s",
        ),
        (
            rows("0,5,0,0,0,0,0,0\n80,5,0,0,1,0,0,0\n"),
            "path.csv:2: time 0: a quaternion has length 1 to within 0.01, not 0",
        ),
        (rows("0,5,0,0,1,0,0,0\n80,5,0,0,1,1,0,0\n"), "path.csv:3: time 80: a quaternion has length 1"),
        (
            rows("0,5,0,0,1,0,0,0\n0,5,0,0,1,0,0,0\n"),
            "path.csv:3: time 0: does not come after the time of the row above",
        ),
        (rows("0,5,0,nan,1,0,0,0\n"), "path.csv:2: time 0: 'nan' is not a number"),
        (rows("nan,5,0,0,1,0,0,0\n"), "path.csv:2: time: 'nan' is no number of seconds"),
        (rows("0,5,0,0,1,0,0\n"), "path.csv:2: row: has 7 cells, and the header 8"),
        (rows("0,5,0,1e15,1,0,0,0\n"), "path.csv:2: time 0: a coordinate of 1e15 m is beyond 1e13 m"),
        (rows("2024-01-01T00:00:00,5,0,0,1,0,0,0\n"), "for a date the scene needs time.start"),
        (rows(""), "path.csv:1: camera.path: has no rows"),
        ("time,x,y,z,qw\n0,1,1,1,1\n".to_owned(), "path.csv:1: qx: is missing in the header"),
        ("0,1,1,1\n".to_owned(), "begins neither with the header of a table"),
        (String::new(), "begins neither with the header of a table"),
    ] {
        let message = refused("path = 'path.csv'\nframe = 'orbit'", &path);
        assert!(message.contains(expected), "expected {expected}\n found {message}");
    }
    let good = circle();
    for (camera, expected) in [
        ("path = 'none.csv'\nframe = 'orbit'", "camera.path: none.csv: cannot be read: No such file"),
        ("path = 7", "camera.path: expected a string"),
        ("path = 'path.csv'\nposition = [1, 2, 3]", "camera.position: cannot be combined with 'path'"),
        ("path = 'path.csv'\nquaternion = [1, 0, 0, 0]", "camera.quaternion: cannot be combined with 'path'"),
        (
            "path = 'path.csv'",
            "camera.look_at: is missing: the point that the camera looks at, because camera.path states no rotations",
        ),
        (
            "path = 'path.csv'\nlook_at = [0, 0, 0]\nframe = 'body'\npath_relative_to = 'orbit'",
            "camera.path_relative_to: says that the path is in the frame 'orbit'",
        ),
        (
            "path = 'path.csv'\nlook_at = [0, 0, 0]\npath_relative_to = 'body'",
            "camera.path_relative_to: 'body' is not one of 'orbit', 'inertial'",
        ),
        (
            "position = [1, 2, 3]\nlook_at = [0, 0, 0]\npath_relative_to = 'orbit'",
            "camera.path_relative_to: belongs to camera.path, which is missing",
        ),
        (
            "path = 'path.csv'\nlook_at = [0, 0, 0]\nmount = [1, 0, 0, 0]",
            "camera.mount: turns the camera on its carrier",
        ),
        ("path = 'path.csv'\nframe = 'inertial'\nattitude = 'path.csv'", "camera.attitude: is no CCSDS AEM"),
        ("path = 'path.csv'\nlook_at = [12, 0, -3]\nup = [0, 0, 1]", "gives no direction at 0 s"),
    ] {
        let message = refused(camera, &good);
        assert!(message.contains(expected), "{camera}: expected {expected}\n found {message}");
    }
    let message = refused("path = 'path.csv'\nframe = 'orbit'", OEM);
    assert!(message.contains("camera.frame and path_relative_to are 'inertial'"), "{message}");
    let message = refused("path = 'path.csv'", OEM);
    assert!(message.contains("the orbit of the scene is circular, without a date"), "{message}");
}

const OEM: &str = "CCSDS_OEM_VERS = 2.0\nCREATION_DATE = 2024-01-01T00:00:00\nORIGINATOR = TEST\nMETA_START\n\
OBJECT_NAME = CHASER\nOBJECT_ID = 2024-001A\nCENTER_NAME = EARTH\nREF_FRAME = EME2000\nTIME_SYSTEM = UTC\n\
START_TIME = 2024-01-01T00:00:00\nSTOP_TIME = 2024-01-01T00:01:00\nMETA_STOP\n\
2024-01-01T00:00:00 7000 0 0 0 7.5 0\n2024-01-01T00:01:00 6985 450 0 -0.5 7.48 0\n";

/// An OEM of a body on a circle of 7000 km, ahead of another by an angle [rad].
fn oem(name: &str, first: u32, ahead: f64) -> String {
    let rate = (3.986_004_418e14_f64 / 7e6_f64.powi(3)).sqrt();
    let mut text = format!(
        "CCSDS_OEM_VERS = 2.0\nCREATION_DATE = 2024-01-01T00:00:00\nORIGINATOR = TEST\nMETA_START\nOBJECT_NAME = {name}\n\
         OBJECT_ID = {name}\nCENTER_NAME = EARTH\nREF_FRAME = EME2000\nTIME_SYSTEM = UTC\nSTART_TIME = 2024-01-01T00:{first:02}:00\n\
         STOP_TIME = 2024-01-01T00:40:00\nMETA_STOP\n"
    );
    for minute in first..=40 {
        let (sin, cos) = (rate * 60.0 * f64::from(minute) + ahead).sin_cos();
        let speed = rate * 7000.0;
        text += &format!(
            "2024-01-01T00:{minute:02}:00 {} {} 0 {} {} 0\n",
            7000.0 * cos,
            7000.0 * sin,
            -speed * sin,
            speed * cos
        );
    }
    text
}

/// A chaser 1e-5 rad ahead on a circle of 7000 km is 70 m ahead of the craft, and its body turns once in an orbit.
#[test]
fn a_chaser_by_oem_and_aem_is_where_its_trajectory_says() {
    let folder = Folder::new("");
    folder.write("craft.oem", &oem("CRAFT", 0, 0.0));
    folder.write("chaser.oem", &oem("CHASER", 5, 1e-5));
    let aem = "CCSDS_AEM_VERS = 1.0\nCREATION_DATE = 2024-01-01T00:00:00\nORIGINATOR = TEST\nMETA_START\nOBJECT_NAME = CHASER\n\
        OBJECT_ID = CHASER\nREF_FRAME_A = EME2000\nREF_FRAME_B = SC_BODY_1\nATTITUDE_DIR = A2B\nTIME_SYSTEM = UTC\n\
        START_TIME = 2024-01-01T00:00:00\nSTOP_TIME = 2024-01-01T00:40:00\nATTITUDE_TYPE = QUATERNION\nQUATERNION_TYPE = LAST\n\
        META_STOP\nDATA_START\n2024-01-01T00:00:00 0 0 0 1\n2024-01-01T00:20:00 0 0 0.3826834323650898 0.9238795325112867\n\
        2024-01-01T00:40:00 0 0 0.7071067811865476 0.7071067811865476\nDATA_STOP\n";
    folder.write("chaser.aem", aem);
    let scene = moving(
        "images = [600, 720]",
        "path = 'chaser.oem'\nattitude = 'chaser.aem'\nmount = [0.7071067811865476, 0, 0.7071067811865476, 0]",
    );
    let scene = scene.replace("altitude = 408e3\nperiod = 5553.6\nbeta_deg = 20\nphase_deg = 80", "file = 'craft.oem'");
    folder.write("scene.toml", &scene);
    let loaded = Scene::load(&folder.path("scene.toml")).expect("a scene");
    let camera = loaded.camera.as_ref().expect("a camera");
    assert_eq!(camera.frame, CameraFrame::Inertial);
    let rate = (3.986_004_418e14_f64 / 7e6_f64.powi(3)).sqrt();
    for time in [600.0, 630.0, 720.0] {
        let there = camera.at(time, None).expect("covered");
        let (sin, cos) = (rate * time).sin_cos();
        assert!((there.position - DVec3::new(-sin, cos, 0.0) * 70.0).length() < 2e-3, "{time}: {}", there.position);
        // The camera looks along the chaser's +X, which has turned 45 deg after 20 minutes.
        let angle = TAU / 8.0 * time / 1200.0;
        let forward = there.frame_from_camera * DVec3::Z;
        assert!((forward - DVec3::new(angle.cos(), angle.sin(), 0.0)).length() < 1e-6, "{time}: {forward}");
    }
    let error = camera.at(60.0, None).unwrap_err().to_string();
    assert!(error.contains("has no position at 60 s: it covers 300 to 2400 s"), "{error}");
    let late = scene.replace("images = [600, 720]", "images = [0]");
    folder.write("scene.toml", &late);
    let message = Scene::load(&folder.path("scene.toml")).unwrap_err().to_string();
    assert!(message.contains("chaser.oem:1: camera.path: has no position at 0 s"), "{message}");
}

#[test]
fn times_of_images_are_checked() {
    let folder = Folder::new("");
    let parse = |time: &str| {
        let scene = scene_with(&[("draw_every = 4", time)]);
        Scene::parse(&scene, &folder.path("scene.toml"))
    };
    let times = |time: &str| match parse(time).expect("a scene").time.draw {
        Draw::Times(times) => times,
        other => panic!("{other:?}"),
    };
    let tenths = times("images = { start = 0, stop = 60, rate_hz = 10 }");
    assert_eq!((tenths.len(), tenths[3], tenths[600]), (601, 0.3, 60.0));
    assert_eq!(times("images = { start = 1, stop = 1.99, rate_hz = 2 }"), [1.0, 1.5]);
    assert_eq!(times("images = [3, 7.25]"), [3.0, 7.25]);
    assert_eq!(parse("images = []").expect("a scene").time.draw, Draw::None);
    assert_eq!(
        parse("images = [3]\nwarm_up_orbits = 1\nwarm_up_step = 120").expect("a scene").time.warm_up_step,
        120.0
    );
    for (time, expected) in [
        ("images = [3]\ndraw_every = 2", "time.images: cannot be combined with 'draw_every'"),
        ("images = [3]\ndraw_steps = [2]", "time.images: cannot be combined with 'draw_steps'"),
        ("images = [3, 3]", "time.images: must increase, but 3 follows 3"),
        ("images = [-1]", "time.images: must be 0 or above [s], found -1"),
        ("images = [721]", "time.images: an image at 721 s lies after the last step, at 720 s: state more time.steps"),
        ("images = 'all'", "time.images: expected an array of numbers"),
        ("images = { start = 0, stop = 60 }", "time.images.rate_hz: is missing: the number of images in a second"),
        ("images = { start = 0, stop = 60, rate = 10 }", "time.images.rate: unknown key; did you mean 'rate_hz'?"),
        ("images = { start = 60, stop = 0, rate_hz = 1 }", "time.images.stop: 0 s lies before the start, 60 s"),
        ("images = { start = 0, stop = 60, rate_hz = 0 }", "time.images.rate_hz: must be above 0 [1/s], found 0"),
        (
            "images = { start = 0, stop = 60, rate_hz = 1e9 }",
            "time.images.rate_hz: asks for too much work: 6.000e10 images",
        ),
        ("warm_up_orbits = 1\nwarm_up_step = 0", "time.warm_up_step: must be in [0.000001, 10000000] [s], found 0"),
    ] {
        let message = parse(time).unwrap_err().to_string();
        assert!(message.contains(expected), "{time}: expected {expected}\n found {message}");
    }
}

/// A tenth of the steps before time 0, and nearly the same state.
#[test]
fn a_warm_up_has_its_own_step() {
    let with = |own: &str| {
        let folder =
            Folder::new(&scene_with(&[("draw_every = 4", &format!("draw_steps = [0]\nwarm_up_orbits = 0.5\n{own}"))]));
        let prepared = folder.prepared();
        (prepared.warm_up_steps(), on_device(&prepared))
    };
    let ((many, fine), (few, coarse)) = (with(""), with("warm_up_step = 300"));
    assert_eq!((many, few), (46, 9));
    let (most, _) = difference(&fine[0], &coarse[0]);
    assert!(most > 1e-3 && most < 12.0, "{most} K");
}

fn frame(folder: &Folder, name: &str) -> (Image, FrameHeader) {
    read_exr(&folder.path(name)).expect("a frame")
}

#[test]
fn a_run_along_a_path_names_its_images_and_their_poses() {
    let camera = "path = 'path.csv'\nframe = 'body'\nlook_at = [0, 0, 0]\nup = [0, 0, -1]";
    let folder = Folder::new(&moving("images = { start = 0, stop = 120, rate_hz = 0.05 }", camera));
    folder.write("path.csv", &circle());
    let ran = run_validated(folder.0.path(), &["run", "scene.toml", "-o", "out"]);
    assert_eq!(ran.code, 0, "{}", ran.err);
    assert!(ran.out.contains("temperatures between steps are off by up to"), "{}", ran.out);
    let (image, header) = frame(&folder, "out/frames/image_000005.exr");
    assert_eq!((image.time, header.image, header.step), (100.0, Some(5), 2));
    let prepared = folder.prepared();
    let there = prepared.scene.camera.as_ref().expect("a camera").at(100.0, None).expect("covered");
    assert_eq!(image.camera.position, there.position);
    assert_eq!(image.camera.motion, Motion::Still);
    let pose = camera_from_body(&there, &prepared.loads.sky_model().sky(100.0));
    assert!(image.camera_from_body.abs_diff_eq(pose, 1e-12));
    let angle = TAU / 4.0 * 100.0 / 720.0;
    assert!((there.position - DVec3::new(12.0 * angle.cos(), 12.0 * angle.sin(), -3.0)).length() < 2e-3);
    let index = std::fs::read_to_string(folder.path("out/images.csv")).expect("the index");
    let lines: Vec<&str> = index.lines().collect();
    assert_eq!((lines[0], lines.len()), ("time,x,y,z,qw,qx,qy,qz,image,file", 8));
    assert!(lines[6].starts_with("100,") && lines[6].ends_with(",5,frames/image_000005.exr"), "{}", lines[6]);
    let report = std::fs::read_to_string(folder.path("out/report.json")).expect("a report");
    assert!(report.contains("7 images at their own times, 0 to 120 s") && report.contains("frames/image_000006.png"));

    // The index is a table of poses. The images from it are those of the run.
    let ran = run_validated(folder.0.path(), &["render", "scene.toml", "--poses", "out/images.csv", "-o", "again"]);
    assert_eq!(ran.code, 0, "{}", ran.err);
    for number in 0..7 {
        let name = format!("frames/image_{number:06}.exr");
        let [(one, head), (two, other)] = ["out", "again"].map(|root| frame(&folder, &format!("{root}/{name}")));
        assert!(one.camera_from_body.abs_diff_eq(two.camera_from_body, 1e-9));
        let one = Image { camera: two.camera.clone(), camera_from_body: two.camera_from_body, ..one };
        assert_eq!(one, two);
        assert_eq!((head.step, head.image), (other.step, other.image));
    }
    let (one, two) =
        (frame(&folder, "out/frames/image_000001.exr").0, frame(&folder, "again/frames/image_000002.exr").0);
    assert!(one.temperature != two.temperature);
    assert_eq!(
        std::fs::read_to_string(folder.path("again/images.csv")).expect("the index").lines().count(),
        lines.len()
    );
}

/// Poses of one time show one state from several sides, and are those of `--time`.
#[test]
fn many_poses_are_the_images_of_each() {
    let folder = Folder::new(&scene_with(&[("steps = 12", "steps = 12\nwarm_up_orbits = 0.1")]));
    let q = "0.18257,0.36515,0.54772,0.73030";
    folder.write("poses.csv", &format!("# three views\ntime,x,y,z,qw,qx,qy,qz\n0,0,0,-20,1,0,0,0\n240,0,0,-20,1,0,0,0\n240,0,1,-16,1,0,0,0\n700,-1,2,3,{q}\n"));
    let ran = run_validated(folder.0.path(), &["render", "scene.toml", "--poses", "poses.csv", "-o", "out"]);
    assert_eq!(ran.code, 0, "{}", ran.err);
    let pose = "position = [6.5, 5, -7.5]\nlook_at = [0, 0, 0]\nup = [0, 0, -1]";
    for (number, time, camera) in [
        (0, "0", "position = [0, 0, -20]\nquaternion = [1, 0, 0, 0]"),
        (1, "240", "position = [0, 0, -20]\nquaternion = [1, 0, 0, 0]"),
        (2, "240", "position = [0, 1, -16]\nquaternion = [1, 0, 0, 0]"),
    ] {
        let scene = scene_with(&[("steps = 12", "steps = 12\nwarm_up_orbits = 0.1"), (pose, camera)]);
        folder.write("one.toml", &scene);
        succeed(folder.0.path(), &["render", "one.toml", "--time", time, "-o", "one.exr"]);
        let (one, _) = frame(&folder, "one.exr");
        let (many, _) = frame(&folder, &format!("out/frames/image_{number:06}.exr"));
        assert!(one.part.iter().filter(|part| **part > 0).count() > 300);
        assert_eq!((one.part, one.temperature, one.depth), (many.part, many.temperature, many.depth), "{number}");
    }
    for (table, expected) in [
        ("time,x,y,z\n0,1,1,1\n", "poses.csv:2: qw: is missing in the header"),
        (
            "time,x,y,z,qw,qx,qy,qz\n5,1,1,1,1,0,0,0\n4,1,1,1,1,0,0,0\n",
            "poses.csv:3: time 4: lies before the time of the row above",
        ),
        ("time,x,y,z,qw,qx,qy,qz\n-5,1,1,1,1,0,0,0\n", "poses.csv:2: time: -5 s lies before time 0"),
        ("time,x,y,z,qw,qx,qy,qz\n5,1,1,1,0,0,0,0\n", "poses.csv:2: time 5: a quaternion has length 1"),
        ("time,x,y,z,qw,qx,qy,qz\n1e10,1,1,1,1,0,0,0\n", "poses.csv: "),
    ] {
        folder.write("poses.csv", table);
        let output = end(isotherm(folder.0.path(), &["render", "scene.toml", "--poses", "poses.csv", "-o", "none"]));
        let (code, message) = refusal(&output);
        assert!(code != Some(0) && message.contains(expected) && !folder.path("none").exists(), "{message}");
    }
    let output = end(isotherm(folder.0.path(), &["render", "scene.toml", "--poses", "poses.csv", "-o", "-"]));
    assert!(refusal(&output).1.contains("name a folder"));
}
