//! Tests of valid and invalid attitude messages.

use std::path::Path;
use std::sync::Arc;

use glam::{DMat3, DQuat, DVec3};
use hifitime::TimeScale;

use super::super::{AttitudeOptions, read_attitude};
use crate::environment::rotation_history::{HistoryFrame, RotationHistory};
use crate::scene::epoch::parse_epoch;

/// Time between samples [s], and their number.
const STEP: u32 = 10;
const COUNT: u32 = 7;

fn options() -> AttitudeOptions {
    let start = parse_epoch("2024-060T00:00:00", TimeScale::UTC).ok();
    AttitudeOptions { start, ..AttitudeOptions::default() }
}

fn load(text: &str, options: &AttitudeOptions) -> Result<(Arc<RotationHistory>, Vec<String>), String> {
    let mut said = Vec::new();
    read_attitude(Path::new("made.aem"), text, options, &mut said)
        .map(|history| (history, said))
        .map_err(|error| error.to_string())
}

fn loaded(text: &str) -> Arc<RotationHistory> {
    load(text, &options()).unwrap_or_else(|error| panic!("{error}\n{text}")).0
}

fn refusal(text: &str) -> String {
    load(text, &options()).expect_err(text)
}

fn epoch(seconds: u32) -> String {
    format!("2024-060T00:{:02}:{:02}", seconds / 60, seconds % 60)
}

fn aem(version: &str, metadata: &str, data: &str) -> String {
    format!(
        "CCSDS_AEM_VERS = {version}\nCREATION_DATE = 2024-02-29\nORIGINATOR = TEST\nMETA_START\nOBJECT_NAME = CRAFT\n\
         OBJECT_ID = 2024-001A\nCENTER_NAME = EARTH\nTIME_SYSTEM = UTC\nSTART_TIME = 2024-060T00:00:00\n\
         STOP_TIME = 2024-060T00:01:00\n{metadata}META_STOP\nDATA_START\n{data}DATA_STOP\n"
    )
}

fn frames(a: &str, b: &str) -> String {
    format!("REF_FRAME_A = {a}\nREF_FRAME_B = {b}\n")
}

fn of_type(kind: &str) -> String {
    format!("{}ATTITUDE_TYPE = {kind}\n", frames("EME2000", "SC_BODY_1"))
}

/// Builds data lines from the numbers at each time.
fn data(numbers: impl Fn(f64) -> Vec<f64>) -> String {
    let line = |index: u32| {
        let numbers = numbers(f64::from(index * STEP));
        let text: Vec<String> = numbers.iter().map(|number| format!("{number:.17e}")).collect();
        format!("{} {}\n", epoch(index * STEP), text.join(" "))
    };
    (0..COUNT).map(line).collect()
}

/// Angles [rad] and angle rates [rad/s] of an attitude that turns about all axes.
fn angles(time: f64) -> ([f64; 3], [f64; 3]) {
    let (sin, cos) = (0.03 * time).sin_cos();
    ([0.4 + 0.02 * time, 0.7 * sin, -1.1 + 0.5 * cos], [0.02, 0.021 * cos, -0.015 * sin])
}

/// The matrix that changes vector components from one frame to the frame turned about an axis.
fn turned(axis: usize, angle: f64) -> DMat3 {
    let (s, c) = angle.sin_cos();
    let rows = match axis {
        0 => [DVec3::X, DVec3::new(0.0, c, s), DVec3::new(0.0, -s, c)],
        1 => [DVec3::new(c, 0.0, -s), DVec3::Y, DVec3::new(s, 0.0, c)],
        _ => [DVec3::new(c, s, 0.0), DVec3::new(-s, c, 0.0), DVec3::Z],
    };
    DMat3::from_cols(rows[0], rows[1], rows[2]).transpose()
}

/// The quaternion of a turn from A to B. The matrix `b_from_a` is the matrix of its inverse.
fn quaternion(axes: [usize; 3], time: f64) -> DQuat {
    let (angles, _) = angles(time);
    let b_from_a = turned(axes[2], angles[2]) * turned(axes[1], angles[1]) * turned(axes[0], angles[0]);
    DQuat::from_mat3(&b_from_a.transpose()).normalize()
}

fn degrees(numbers: [f64; 3]) -> Vec<f64> {
    numbers.map(f64::to_degrees).to_vec()
}

fn apart(a: &RotationHistory, b: &RotationHistory) -> f64 {
    (0..=120).fold(0.0, |worst, half_second| {
        let time = 0.5 * f64::from(half_second);
        let turn = a.rotation(time).unwrap().inverse() * b.rotation(time).unwrap();
        f64::max(worst, 2.0 * turn.xyz().length())
    })
}

const SEQUENCES: [[usize; 3]; 12] = [
    [0, 1, 2],
    [0, 2, 1],
    [1, 0, 2],
    [1, 2, 0],
    [2, 0, 1],
    [2, 1, 0],
    [0, 1, 0],
    [0, 2, 0],
    [1, 0, 1],
    [1, 2, 1],
    [2, 0, 2],
    [2, 1, 2],
];

/// Wertz (1978), appendix E: components in B are the product of three matrices. The first turn stands rightmost.
#[test]
fn euler_angles_of_every_sequence_are_the_quaternions_of_the_same_attitude() {
    for axes in SEQUENCES {
        let name = |letters: &str| -> String { axes.iter().map(|axis| &letters[*axis..=*axis]).collect() };
        let angles = data(|time| degrees(angles(time).0));
        let quaternions = data(|time| quaternion(axes, time).to_array().to_vec());
        for (a, b, direction) in
            [("EME2000", "SC_BODY_1", "A2B"), ("EME2000", "SC_BODY_1", "B2A"), ("SC_BODY_1", "ICRF", "B2A")]
        {
            let head = format!("{}ATTITUDE_DIR = {direction}\n", frames(a, b));
            let of = |kind: &str, data: &str| loaded(&aem("1.0", &format!("{head}ATTITUDE_TYPE = {kind}"), data));
            let digits = of(&format!("EULER_ANGLE\nEULER_ROT_SEQ = {}\n", name("123")), &angles);
            let expected = of("QUATERNION\nQUATERNION_TYPE = LAST\n", &quaternions);
            assert!(apart(&digits, &expected) < 1e-12, "{axes:?}, {direction}: {:e}", apart(&digits, &expected));
            let [first, second, third] = axes;
            let other = [third, second, first].map(|axis| char::from(b'1' + axis as u8));
            let backwards = String::from_iter(other);
            if backwards != name("123") {
                let wrong = of(&format!("EULER_ANGLE\nEULER_ROT_SEQ = {backwards}\n"), &angles);
                assert!(apart(&wrong, &expected) > 0.1, "the sequence backwards must show");
            }
        }
        let letters = format!("{}EULER_ROT_SEQ = {}\n", of_type("EULER_ANGLE"), name("XYZ"));
        let expected = loaded(&aem("2.0", &of_type("QUATERNION"), &quaternions));
        assert!(apart(&loaded(&aem("2.0", &letters, &angles)), &expected) < 1e-12, "{axes:?}");
    }
}

/// Yaw, pitch and roll are 90, 0 and 90 deg. The body's X then lies along the frame's Y, Y along Z and Z along X.
#[test]
fn yaw_comes_before_roll_in_321() {
    let text =
        aem("2.0", &format!("{}EULER_ROT_SEQ = ZYX\n", of_type("EULER_ANGLE")), &data(|_| vec![90.0, 0.0, 90.0]));
    let rotation = loaded(&text).rotation(7.0).unwrap();
    assert!((rotation * DVec3::X).distance(DVec3::Y) < 1e-12);
    assert!((rotation * DVec3::Y).distance(DVec3::Z) < 1e-12);
}

/// One attitude, stated with quaternion rates, with Euler rates, and with angular velocities in either frame.
#[test]
fn derivatives_are_one_however_they_are_stated() {
    let axes = [2, 1, 0];
    let derivative = |time: f64| {
        let (_, rates) = angles(time);
        let step = 1e-3;
        let slope = (quaternion(axes, time + step) - quaternion(axes, time - step)) / (2.0 * step);
        // The central difference is accurate to 1e-9 here. The velocity from the angle rates is exact.
        let turn = |axis: usize, angle: f64| DQuat::from_axis_angle(DVec3::AXES[axis], angle);
        let (now, _) = angles(time);
        let [first, second] = [turn(axes[0], now[0]), turn(axes[1], now[1])];
        let along_a = DVec3::AXES[axes[0]] * rates[0]
            + first * DVec3::AXES[axes[1]] * rates[1]
            + first * second * DVec3::AXES[axes[2]] * rates[2];
        let exact = DQuat::from_vec4((0.5 * along_a).extend(0.0)) * quaternion(axes, time);
        assert!((exact - slope).length() < 1e-8, "{exact} and {slope}");
        (exact, along_a)
    };
    let hermite = "INTERPOLATION_METHOD = HERMITE\nINTERPOLATION_DEGREE = 3\n";
    let of = |kind: &str, extra: &str, numbers: &dyn Fn(f64) -> Vec<f64>| {
        loaded(&aem("2.0", &format!("{}{extra}{hermite}", of_type(kind)), &data(numbers)))
    };
    let q = |time: f64| quaternion(axes, time);
    let reference =
        of("QUATERNION/DERIVATIVE", "", &|time| [q(time).to_array(), derivative(time).0.to_array()].concat());
    let velocity = |time: f64, frame: &str| {
        let along_a = derivative(time).1;
        let along = if frame == "EME2000" { along_a } else { q(time).inverse() * along_a };
        degrees(along.to_array())
    };
    for frame in ["EME2000", "SC_BODY_1"] {
        let extra = format!("ANGVEL_FRAME = {frame}\n");
        let computed =
            of("QUATERNION/ANGVEL", &extra, &|time| [q(time).to_array().to_vec(), velocity(time, frame)].concat());
        assert!(apart(&computed, &reference) < 1e-12, "{frame}: {:e}", apart(&computed, &reference));
        let extra = format!("EULER_ROT_SEQ = ZYX\n{extra}");
        let found = of("EULER_ANGLE/ANGVEL", &extra, &|time| [degrees(angles(time).0), velocity(time, frame)].concat());
        assert!(apart(&found, &reference) < 1e-12, "{frame}: {:e}", apart(&found, &reference));
    }
    let found = of("EULER_ANGLE/DERIVATIVE", "EULER_ROT_SEQ = ZYX\n", &|time| {
        [degrees(angles(time).0), degrees(angles(time).1)].concat()
    });
    assert!(apart(&found, &reference) < 1e-12, "{:e}", apart(&found, &reference));
    let wrong = of("QUATERNION/ANGVEL", "ANGVEL_FRAME = EME2000\n", &|time| {
        [q(time).to_array().to_vec(), velocity(time, "SC_BODY_1")].concat()
    });
    assert!(apart(&wrong, &reference) > 1e-3, "the wrong frame must show");

    // Without derivatives the reader fits a polynomial through the rotations and says so.
    let plain = |method: &str| {
        let extra = format!("INTERPOLATION_METHOD = {method}\nINTERPOLATION_DEGREE = 3\n");
        let numbers = |time: f64| q(time).to_array().to_vec();
        load(&aem("2.0", &format!("{}{extra}", of_type("QUATERNION")), &data(numbers)), &options()).unwrap()
    };
    let ((lagrange, _), (hermite, said), (linear, _)) = (plain("lagrange"), plain("hermite"), plain("LINEAR"));
    assert!(apart(&lagrange, &hermite) < 1e-15);
    assert!(said.iter().any(|said| said.contains("HERMITE is done as LAGRANGE of degree 3")), "{said:?}");
    let (cubic, straight) = (apart(&lagrange, &reference), apart(&linear, &reference));
    assert!(cubic < 0.1 * straight && cubic > 1e-6, "{cubic:e}, {straight:e}");
}

#[test]
fn directions_turn_either_way() {
    let x_at = |text: &str, time: f64| loaded(text).rotation(time).unwrap() * DVec3::X;
    // A quarter turn about Z in a minute takes the body's X to the frame's Y.
    let half = 0.5_f64.sqrt();
    let last = format!("2024-060T00:00:00 0 0 0 1\nCOMMENT on the way\n2024-060T00:01:00 0 0 {half} {half}\n");
    let first = format!("2024-060T00:00:00 1 0 0 0\n2024-060T00:01:00 {half} 0 0 {half}\n");
    let usual = of_type("QUATERNION");
    let diagonal = DVec3::new(half, half, 0.0);
    assert!(x_at(&aem("1.0", &format!("{usual}QUATERNION_TYPE = LAST\n"), &last), 60.0).distance(DVec3::Y) < 1e-9);
    let scalar_first = format!("{usual}QUATERNION_TYPE = FIRST\nATTITUDE_DIR = A2B\n");
    assert!(x_at(&aem("1.0", &scalar_first, &first), 30.0).distance(diagonal) < 1e-9);
    let back = aem("1.0", &format!("{usual}ATTITUDE_DIR = B2A\n"), &last);
    assert!(x_at(&back, 60.0).distance(-DVec3::Y) < 1e-9);
    let swapped = format!("{}ATTITUDE_TYPE = QUATERNION\n", frames("SC_BODY_1", "EME2000"));
    assert!(x_at(&aem("2.0", &swapped, &last), 60.0).distance(-DVec3::Y) < 1e-9);
    let both = aem("1.0", &format!("{swapped}ATTITUDE_DIR = B2A\n"), &last);
    assert!(x_at(&both, 60.0).distance(DVec3::Y) < 1e-9);
    let orbit = format!("{}ATTITUDE_TYPE = QUATERNION\n", frames("LVLH", "SC_BODY_1"));
    assert_eq!(loaded(&aem("2.0", &orbit, &last)).frame, HistoryFrame::Orbit);

    let (_, said) = load(&aem("1.0", &usual, &last), &options()).unwrap();
    for expected in ["QUATERNION_TYPE is missing and taken for LAST", "ATTITUDE_DIR is missing and taken for A2B"] {
        assert!(said.iter().any(|said| said.contains(expected)), "{said:?}");
    }
    let (_, said) = load(&aem("2.0", &usual, &last), &options()).unwrap();
    assert!(said.iter().all(|said| !said.contains("missing")), "{said:?}");
}

/// Right ascension and declination give the axis. The body's X is 90 deg ahead of the first, as in Orekit's
/// `SpinFinder`.
#[test]
fn a_spin_turns_about_its_axis_at_its_rate() {
    let spin = of_type("SPIN");
    // The axis lies along +X. The body makes ten turns between samples that are 100 s apart.
    let (history, said) =
        load(&aem("1.0", &spin, "2024-060T00:00:00 0 0 0 36\n2024-060T00:01:40 0 0 0 36\n"), &options()).unwrap();
    assert!((history.rotation(33.0).unwrap() * DVec3::Z).distance(DVec3::X) < 1e-9);
    assert!((history.rotation(0.0).unwrap() * DVec3::X).distance(DVec3::Y) < 1e-9);
    assert!((history.rotation(2.5).unwrap() * DVec3::X).distance(DVec3::Z) < 1e-9, "a quarter turn in 2.5 s");
    assert!(said.iter().any(|said| said.contains("90 deg ahead")), "{said:?}");
    // The example of CCSDS 504.0-B-1, figure 4-3: its rate agrees with its angles to a thousandth of a turn.
    let example = "2024-060T00:00:00.071 2.6862511e+002 6.8448486e+001 1.5969509e+002 -1.0996528e+002\n\
                   2024-060T00:00:00.196 2.6863990e+002 6.8432197e+001 1.4593720e+002 -1.0996493e+002\n";
    let history = loaded(&aem("1.0", &spin, example));
    let axis = history.rotation(0.071).unwrap() * DVec3::Z;
    let (alpha, delta) = (268.62511_f64.to_radians(), 68.448486_f64.to_radians());
    assert!(axis.distance(DVec3::new(delta.cos() * alpha.cos(), delta.cos() * alpha.sin(), delta.sin())) < 1e-9);
    let between = history.rotation(0.1335).unwrap() * DVec3::X;
    let half_way = history.rotation(0.071).unwrap() * DQuat::from_rotation_z((0.5 * -13.7579_f64).to_radians());
    assert!(between.distance(half_way * DVec3::X) < 1e-3, "{between}");
}

fn xml(version: &str, metadata: &str, states: &str) -> String {
    let tags: String = metadata
        .lines()
        .filter_map(|line| line.split_once(" = "))
        .map(|(key, value)| format!("<{key}>{value}</{key}>\n"))
        .collect();
    format!(
        "<?xml version=\"1.0\"?>\n<aem id=\"CCSDS_AEM_VERS\" version=\"{version}\">\n<header/><body><segment><metadata>\n\
         <OBJECT_NAME>CRAFT</OBJECT_NAME><OBJECT_ID>2024-001A</OBJECT_ID><TIME_SYSTEM>UTC</TIME_SYSTEM>\n\
         <START_TIME>2024-060T00:00:00</START_TIME><STOP_TIME>2024-060T00:01:00</STOP_TIME>\n\
         {tags}</metadata>\n<data>\n{states}</data></segment></body></aem>\n"
    )
}

/// Turns the columns of a data line into the states of an XML message.
fn states(element: &str, columns: &str, data: &str) -> String {
    let state = |line: &str| {
        let mut cells = line.split_whitespace();
        let epoch = cells.next().unwrap();
        let tags: String =
            columns.split(' ').zip(cells).map(|(name, cell)| format!("<{name}>{cell}</{name}>")).collect();
        format!("<attitudeState><{element}><EPOCH>{epoch}</EPOCH>{tags}</{element}></attitudeState>\n")
    };
    data.lines().map(state).collect()
}

#[test]
fn xml_says_what_keywords_and_values_say() {
    let axes = [2, 0, 2];
    let q = |time: f64| quaternion(axes, time).to_array().to_vec();
    let hermite = "INTERPOLATION_METHOD = HERMITE\nINTERPOLATION_DEGREE = 5\n";
    let euler = "EULER_ROT_SEQ = ZXZ\n";
    for (version, kind, extra, element, columns, numbers) in [
        ("2.0", "QUATERNION", "", "quaternionEphemeris", "Q1 Q2 Q3 QC", data(q)),
        ("1.0", "QUATERNION", "QUATERNION_TYPE = FIRST\n", "quaternionState", "QC Q1 Q2 Q3", {
            data(|time| [vec![q(time)[3]], q(time)[..3].to_vec()].concat())
        }),
        ("2.0", "QUATERNION/DERIVATIVE", hermite, "quaternionDerivative", "Q1 Q2 Q3 QC Q1_DOT Q2_DOT Q3_DOT QC_DOT", {
            data(|time| [q(time), vec![0.01, 0.002, -0.01, 0.003]].concat())
        }),
        ("2.0", "EULER_ANGLE", euler, "eulerAngle", "ANGLE_1 ANGLE_2 ANGLE_3", data(|time| degrees(angles(time).0))),
        ("1.0", "SPIN", "", "spin", "SPIN_ALPHA SPIN_DELTA SPIN_ANGLE SPIN_ANGLE_VEL", {
            data(|time| vec![20.0, 30.0, 6.0 * time, 6.0])
        }),
    ] {
        let metadata = format!("{}{extra}", of_type(kind));
        let in_xml = xml(version, &metadata, &states(element, columns, &numbers));
        let (of_xml, of_kvn) = (loaded(&in_xml), loaded(&aem(version, &metadata, &numbers)));
        assert!(apart(&of_xml, &of_kvn) < 1e-15, "{kind}");
        let inside = in_xml.replace("<?xml version=\"1.0\"?>", "<ndm><oem><body/></oem>") + "</ndm>";
        assert!(apart(&loaded(&inside), &of_kvn) < 1e-15, "{kind} in an ndm");
        let later = numbers.replacen(&epoch(10), &epoch(11), 1);
        let other = xml(version, &metadata, &states(element, columns, &later));
        assert!(apart(&loaded(&other), &of_kvn) > 1e-3, "{kind}: another epoch must show");
    }
}

/// CCSDS 505.0-B-1, 4.8.2.6: each angle of version 1 names its axis.
#[test]
fn angles_of_version_1_are_found_by_their_axes() {
    let metadata =
        format!("{}ATTITUDE_DIR = A2B\nEULER_ROT_SEQ = 321\nRATE_FRAME = REF_FRAME_B\n", of_type("EULER_ANGLE/RATE"));
    let state = |seconds: u32, order: [usize; 3]| {
        let tags: String = order
            .iter()
            .enumerate()
            .map(|(index, axis)| {
                let value = ["30", "-20", "70"][*axis];
                let letter = ["X", "Y", "Z"][*axis];
                format!("<rotation{0} angle=\"{letter}_ANGLE\" units=\"deg\">{value}</rotation{0}>", index + 1)
            })
            .collect();
        format!(
            "<attitudeState><eulerAngleRate><EPOCH>{}</EPOCH><rotationAngles>{tags}</rotationAngles>\n\
             <rotationRates><rotation1 rate=\"Z_RATE\">1</rotation1></rotationRates></eulerAngleRate></attitudeState>\n",
            epoch(seconds)
        )
    };
    let kvn = loaded(&aem("1.0", &metadata, &data(|_| vec![70.0, -20.0, 30.0, 0.0, 0.0, 0.0])));
    for order in [[2, 1, 0], [0, 1, 2]] {
        let text = xml("1.0", &metadata, &format!("{}{}", state(0, order), state(60, order)));
        assert!(apart(&loaded(&text), &kvn) < 1e-12, "{order:?}");
    }
    let twice = xml("1.0", &metadata, &state(0, [2, 1, 2]));
    assert!(refusal(&twice).contains("'Z_ANGLE' has no place"), "{}", refusal(&twice));
}

#[test]
fn usable_times_gaps_and_ends_are_those_of_trajectories() {
    let usable = "USEABLE_START_TIME = 2024-060T00:00:05\nUSEABLE_STOP_TIME = 2024-060T00:00:55\n";
    let metadata = format!("{}{usable}", of_type("QUATERNION"));
    let text = aem("2.0", &metadata, &data(|time| quaternion([2, 1, 0], time).to_array().to_vec()));
    assert_eq!(loaded(&text).coverage(), [(5.0, 55.0)]);
    let whole = loaded(&text.replace(usable, ""));
    assert_eq!(whole.coverage(), [(0.0, 60.0)]);
    assert_eq!(loaded(&text).rotation(7.0), whole.rotation(7.0), "samples outside are still neighbours");
    let gap = text.replace(usable, "").replace(&format!("{} ", epoch(60)), "2024-060T00:05:00 ");
    assert_eq!(loaded(&gap).coverage(), [(0.0, 50.0), (300.0, 300.0)]);
    let outside = text.replace("STOP_TIME = 2024-060T00:00:55", "STOP_TIME = 2024-060T00:00:04");
    assert!(refusal(&outside).contains("made.aem:15: USEABLE_STOP_TIME"), "{}", refusal(&outside));
    let none = text.replace(usable, &usable.replace("T00:00:", "T00:02:"));
    assert!(refusal(&none).contains("leaves none of the rotations"), "{}", refusal(&none));
    let late = text.replace("STOP_TIME = 2024-060T00:01:00", "STOP_TIME = 2024-060T00:20:00");
    let (_, said) = load(&late, &options()).unwrap();
    assert!(said.iter().any(|said| said.contains("before its STOP_TIME")), "{said:?}");
    let torn = late.replace("DATA_STOP\n", "");
    assert!(refusal(&torn).contains("the file is cut"), "{}", refusal(&torn));
}

#[test]
fn objects_are_told_apart() {
    let one = aem("2.0", &of_type("QUATERNION"), &data(|_| vec![0.0, 0.0, 0.0, 1.0]));
    let other = one[one.find("META_START").unwrap()..].replace("CRAFT", "OTHER").replace("2024-001A", "2024-002B");
    let other = other.replace("0.00000000000000000e0 1.", "1.00000000000000000e0 0.");
    let text = format!("{one}{other}");
    assert!(refusal(&text).contains("attitude.object"), "{}", refusal(&text));
    let named = |name: &str| load(&text, &AttitudeOptions { object: Some(name.to_owned()), ..options() });
    assert!(apart(&named("CRAFT").unwrap().0, &loaded(&one)) < 1e-15);
    assert!(apart(&named("24002B").unwrap().0, &loaded(&one)) > 1.0);
    assert!(named("none").unwrap_err().contains("'none'"));
}

#[test]
fn what_is_wrong_is_said_with_its_line() {
    let quaternion = of_type("QUATERNION");
    let euler = format!("{}EULER_ROT_SEQ = ZYX\n", of_type("EULER_ANGLE"));
    let one = "2024-060T00:00:00 0 0 0 1\n";
    let angles = "2024-060T00:00:00 0 0 0\n";
    // The metadata begin in line 11.
    for (text, expected) in [
        (
            aem("2.0", &quaternion, "2024-060T00:00:00 0 0 0 0.5\n"),
            "made.aem:16: epoch 2024-060T00:00:00: a quaternion has length 1",
        ),
        (
            aem("2.0", &quaternion, "2024-060T00:00:00 0 0 0 1 0\n"),
            "made.aem:16: epoch 2024-060T00:00:00: QUATERNION has 4 numbers after the epoch (Q1 Q2 Q3 QC), found 5",
        ),
        (aem("2.0", &quaternion, "2024-060T00:00:00 0 0 x 1\n"), "one of them is none"),
        (aem("2.0", &quaternion, "2024-060T25:00:00 0 0 0 1\n"), "made.aem:16: epoch"),
        (
            aem("2.0", &quaternion, &format!("2024-060T00:01:40 0 0 0 1\n{one}")),
            "made.aem:17: epoch 2024-060T00:00:00: lies before",
        ),
        (aem("2.0", &euler, one), "made.aem:17: epoch 2024-060T00:00:00: EULER_ANGLE has 3 numbers"),
        (aem("2.0", &of_type("EULER_ANGLE"), angles), "made.aem:4: EULER_ROT_SEQ: is missing"),
        (aem("2.0", &euler.replace("ZYX", "ZZX"), angles), "made.aem:14: EULER_ROT_SEQ: 'ZZX'"),
        (aem("1.0", &euler.replace("ZYX", "421"), angles), "made.aem:14: EULER_ROT_SEQ: '421'"),
        (aem("2.0", &euler.replace("ZYX", "ZY"), angles), "made.aem:14: EULER_ROT_SEQ: 'ZY'"),
        (aem("2.0", &of_type("SPIN/NUTATION"), one), "made.aem:13: ATTITUDE_TYPE: 'SPIN/NUTATION' is not read"),
        (
            aem("1.0", &format!("{}ATTITUDE_DIR = B2A\n", of_type("SPIN")), one),
            "made.aem:14: ATTITUDE_DIR: the axis of a spin",
        ),
        (aem("1.0", &format!("{quaternion}ATTITUDE_DIR = A\n"), one), "made.aem:14: ATTITUDE_DIR: 'A' is not one of"),
        (
            aem("2.0", &format!("{quaternion}ATTITUDE_DIR = B2A\n"), one),
            "made.aem:14: ATTITUDE_DIR: B2A belongs to version 1",
        ),
        (
            aem("2.0", &format!("{quaternion}QUATERNION_TYPE = FIRST\n"), one),
            "made.aem:14: QUATERNION_TYPE: FIRST belongs",
        ),
        (aem("1.0", &format!("{quaternion}QUATERNION_TYPE = MIDDLE\n"), one), "made.aem:14: QUATERNION_TYPE: 'MIDDLE'"),
        (
            aem("2.0", &format!("{quaternion}INTERPOLATION_METHOD = SPLINE\n"), one),
            "made.aem:14: INTERPOLATION_METHOD: 'SPLINE'",
        ),
        (
            aem("2.0", &format!("{quaternion}INTERPOLATION_METHOD = LAGRANGE\nINTERPOLATION_DEGREE = 0\n"), one),
            "made.aem:15: INTERPOLATION_DEGREE",
        ),
        (
            aem("2.0", &format!("{}INTERPOLATION_METHOD = HERMITE\n", of_type("QUATERNION/ANGVEL")), one),
            "ANGVEL_FRAME: is missing",
        ),
        (
            aem("2.0", &frames("EME2000", "ICRF"), one),
            "made.aem:11: REF_FRAME_A: one of the two frames must be the body",
        ),
        (aem("2.0", &frames("TOD", "SC_BODY_1"), one), "made.aem:11: REF_FRAME: 'TOD' is not one of"),
        (aem("3.0", &quaternion, one), "made.aem:1: CCSDS_AEM_VERS: version '3.0'"),
        (aem("2.0", &quaternion, "FOO = 1\n"), "made.aem:16: FOO: stands outside the metadata"),
        (aem("2.0", &quaternion, one).replace("DATA_START\n", ""), "stands outside the data"),
        (aem("2.0", &quaternion, one).replace("META_STOP\n", ""), "made.aem:14: DATA_START: does not belong here"),
        (
            xml(
                "2.0",
                &quaternion,
                "<attitudeState><quaternionEphemeris><EPOCH>2024-060T00:00:00</EPOCH><Q1>0</Q1></quaternionEphemeris></attitudeState>\n",
            ),
            "made.aem:11: epoch 2024-060T00:00:00: Q2: is missing",
        ),
        (
            xml(
                "2.0",
                &euler,
                "<attitudeState><eulerAngle><EPOCH>2024-060T00:00:00</EPOCH><ANGLE_1 units=\"rad\">0</ANGLE_1></eulerAngle></attitudeState>\n",
            ),
            "ANGLE_1: is in rad; it must be in deg",
        ),
        (xml("2.0", &quaternion, "<attitudeState/>\n"), "made.aem:11: EPOCH: is missing"),
        (xml("2.0", &frames("EME2000", "ICRF"), ""), "made.aem:6: REF_FRAME_A"),
        (xml("2.0", &quaternion, "").replace("</metadata>", "</meta>"), "XML"),
        ("<oem><body/></oem>".to_owned(), "holds no <aem>"),
        ("time,qw,qx,qy,qz\n0,1,0,0,0\n".to_owned(), "attitude.frame: is missing"),
    ] {
        let message = refusal(&text);
        assert!(message.contains(expected), "expected '{expected}' in:\n{message}\n{text}");
    }
    let no_start = load(&aem("2.0", &quaternion, one), &AttitudeOptions::default()).unwrap_err();
    assert!(no_start.contains("time.start"), "{no_start}");
    let in_orbit = AttitudeOptions { frame: Some(HistoryFrame::Orbit), ..AttitudeOptions::default() };
    let table = load("time,qw,qx,qy,qz\n0,1,0,0,0\n100,0,0,0,1\n", &in_orbit).unwrap().0;
    assert!((table.rotation(50.0).unwrap() * DVec3::X).y.abs() > 0.999);
}
