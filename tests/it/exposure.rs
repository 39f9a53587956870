//! Motion blur by sub-frames, and a rolling shutter that sees its surroundings.

use isotherm::Image;

use super::craft::{Folder, scene_with};
use super::reflections::{apart, by_reference, on_device, shining};

/// The wing of the craft faces the camera at 10 m: 20 by 40 px, from 10 px left to 10 px right of the axis.
const FOCAL: f64 = 100.0;
const DISTANCE: f64 = 10.0;
/// Rows in which nothing but the wing is seen, and the row of its middle.
const ROWS: std::ops::Range<usize> = 17..55;
const MIDDLE: f64 = 36.0;
const SUB_FRAMES: f64 = 51.0;

/// A camera before the wing that moves by `speed` [m/s] along its rows.
fn passing(speed: f64, keys: &str, joint: &str) -> Images {
    let pose = "path = \"path.csv\"\nframe = \"body\"";
    let camera = format!("focal_px = {FOCAL}\n{keys}");
    let joint = format!("{joint}\n[radiance]");
    let scene = scene_with(&[
        ("fov_deg = 45", &camera),
        ("frame = \"body\"\nposition = [6.5, 5, -7.5]\nlook_at = [0, 0, 0]\nup = [0, 0, -1]", pose),
        ("[radiance]", &joint),
    ]);
    let folder = Folder::new(&scene);
    let place = |time: f64| format!("{time},{},3.5,{},1,0,0,0\n", speed * time, -DISTANCE);
    let places: String = [-800.0, 0.0, 800.0].map(place).concat();
    folder.write("path.csv", &format!("time,x,y,z,qw,qx,qy,qz\n{places}"));
    let prepared = folder.prepared();
    [on_device(&prepared), by_reference(&prepared)]
}

/// An image of the device and of the reference.
type Images = [Image; 2];

/// Largest difference between a row's radiance over that of the wing, and the share of the exposure in which `covers` says that the wing covers a place
/// [px right of the axis] at a time [s].
fn off(image: &Image, exposure: [f64; 2], covers: impl Fn(f64, f64, f64) -> bool) -> f64 {
    let rows = &image.radiance[96 * ROWS.start..96 * ROWS.end];
    let whole = f64::from(rows.iter().copied().fold(0.0f32, f32::max));
    let [time, line_time] = exposure;
    let of_pixel = |row: usize, column: usize| {
        let (right, down) = (column as f64 + 0.5 - 48.0, row as f64 + 0.5 - MIDDLE);
        let instants = 2000;
        let at = |number: i32| line_time * row as f64 + time * ((f64::from(number) + 0.5) / f64::from(instants) - 0.5);
        let share =
            (0..instants).filter(|number| covers(right, down, at(*number))).count() as f64 / f64::from(instants);
        (f64::from(image.radiance[96 * row + column]) / whole - share).abs()
    };
    ROWS.flat_map(|row| (0..96).map(move |column| (row, column)))
        .map(|(row, column)| of_pixel(row, column))
        .fold(0.0, f64::max)
}

/// The edge of a plate that moves by 10 px in the exposure is a straight ramp of 10 px, and a rolling shutter shears it by speed times line time.
#[test]
fn an_edge_that_moves_is_a_ramp() {
    let speed = 2.0;
    let pixels = speed * FOCAL / DISTANCE;
    let moves = |right: f64, _: f64, time: f64| (right + pixels * time).abs() < 10.0;
    for line_time in [0.0, 0.01] {
        let keys = format!("line_time = {line_time}\nexposure_time = 0.5\nsub_frames = {SUB_FRAMES}");
        for image in &passing(speed, &keys, "") {
            let ramp = off(image, [0.5, line_time], moves);
            let (shorter, sheared) = (off(image, [0.4, line_time], moves), off(image, [0.5, line_time + 0.002], moves));
            println!("line time {line_time}: ramp {ramp:.4}, if shorter {shorter:.4}, if sheared {sheared:.4}");
            // A sub-frame more or less.
            assert!(ramp <= 1.02 / SUB_FRAMES, "{ramp}");
            assert!(shorter > 0.05 && sheared > 0.05, "{shorter} and {sheared}");
        }
    }
}

/// A wing that turns about its middle in the plane of the image: its edge moves the faster the farther it is from the axis.
#[test]
fn a_joint_that_turns_is_blurred() {
    let joint = "[[joint]]\npart = \"wing_starboard\"\nmode = \"schedule\"\naxis = \"+Z\"\n\
                 origin = [0, 2, 0]\nschedule = { time = [-1, 1], angle_deg = [-30, 30] }";
    let keys = format!("exposure_time = 0.4\nsub_frames = {SUB_FRAMES}");
    let turned = |rate: f64| {
        move |right: f64, down: f64, time: f64| {
            let (sin, cos) = (rate.to_radians() * time).sin_cos();
            (right * cos + down * sin).abs() < 10.0 && (down * cos - right * sin).abs() < 20.0
        }
    };
    for image in &passing(0.0, &keys, joint) {
        let [right, slower] = [30.0, 24.0].map(|rate| off(image, [0.4, 0.0], turned(rate)));
        println!("a turning wing: {right:.4}, if slower {slower:.4}");
        assert!(right <= 1.02 / SUB_FRAMES && slower > 0.05, "{right} and {slower}");
    }
}

/// The sensor reads the mean of the sub-frames, with a point spread from their texels, through the crop of a distant craft too.
#[test]
fn a_sensor_sees_the_exposure() {
    for (far, spread) in [("", ""), ("", "point_spread = \"gaussian\"\nsigma = 0.7\n"), ("e1", "")] {
        let sensor = format!("[sensor]\nnetd = 0\nrange = [100, 400]\n{spread}[[probe]]");
        let place = format!("position = [6.5{far}, 5{far}, -7.5{far}]");
        let scene = |time: f64| {
            let keys = format!("fov_deg = 45\nexposure_time = {time}\nsub_frames = 3");
            let spin = "mode = \"spin\"\nquaternion = [1, 0, 0, 0]\nspin_axis = [0.3, 0.2, 0.9]\nrate_deg = 10";
            let scene = scene_with(&[
                ("fov_deg = 45", &keys),
                ("mode = \"nadir\"\nnadir_axis = \"+Z\"\nforward_axis = \"+X\"", spin),
                ("frame = \"body\"", "frame = \"inertial\""),
                ("position = [6.5, 5, -7.5]", &place),
                ("[[probe]]", &sensor),
            ]);
            Folder::new(&scene).prepared()
        };
        let prepared = scene(0.3);
        let (found, expected) = (on_device(&prepared), by_reference(&prepared));
        let shorter = by_reference(&scene(0.24));
        let numbers = |image: &Image| image.digital_numbers.clone().expect("a sensor");
        let differ = |other: &Image| {
            let pairs = numbers(&found).into_iter().zip(numbers(other));
            pairs.filter(|(one, other)| one.abs_diff(*other) > 2).count()
        };
        let (right, wrong) = (differ(&expected), differ(&shorter));
        println!("'{spread}' {far}: {right} pixels differ, and {wrong} where the exposure is shorter");
        assert!(right <= 12 && wrong > 2 * right.max(4), "{right} and {wrong}");
    }
}

/// Each row sees the planet, and mirrors see it, from the pose of its own time.
#[test]
fn the_rows_of_a_rolling_shutter_see_their_surroundings() {
    let spin = "mode = \"spin\"\nquaternion = [1, 0, 0, 0]\nspin_axis = [0.3, 0.2, 0.9]\nrate_deg = 10";
    for (reflections, lens) in
        [("environment", ""), ("environment", "\ndistortion = [-0.31, 0.12, 0.0011, -0.0007, -0.021]"), ("traced", "")]
    {
        let scene = |line_time: f64| {
            let keys = format!("fov_deg = 45\nline_time = {line_time}{lens}");
            let shown = format!("reflections = \"{reflections}\"");
            Folder::new(&shining(&[
                ("reflections = \"environment\"", &shown),
                ("specular = 0.7\nroughness = 0.2", "specular = 1"),
                ("specular = 0.9", "specular = 1"),
                ("fov_deg = 45", &keys),
                ("mode = \"nadir\"\nnadir_axis = \"+Z\"\nforward_axis = \"+X\"", spin),
                ("frame = \"body\"", "frame = \"inertial\""),
            ]))
            .prepared()
        };
        let prepared = scene(0.01);
        let (found, expected, faster) = (on_device(&prepared), by_reference(&prepared), by_reference(&scene(0.007)));
        let ([sky, surface], worst) = apart(&found, &expected, 5e-3);
        let ([moved, turned], _) = apart(&found, &faster, 5e-3);
        println!(
            "{reflections}{lens}: {sky:.4} of the sky, {surface:.4} of the surfaces, else {worst:.1e}; {moved:.4}, {turned:.4} if faster"
        );
        assert!(sky < 0.01 && surface < 0.03, "{reflections}: {sky} and {surface}");
        assert!(moved + turned > 0.005 + 2.0 * (sky + surface), "{reflections}: a faster shutter must show");
    }
}
