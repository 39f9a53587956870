//! Tests of valid and invalid trajectory and attitude files.

use std::path::Path;
use std::sync::Arc;

use glam::DVec3;
use hifitime::TimeScale;

use super::*;
use crate::scene::epoch::parse_epoch;

const RADIUS: f64 = 7000.0;
const RATE: f64 = 1.078e-3;

/// Position [km] and velocity [km/s] on a circle.
fn circle(seconds: f64) -> [f64; 6] {
    let (sin, cos) = (RATE * seconds).sin_cos();
    let speed = RADIUS * RATE;
    [RADIUS * cos, RADIUS * sin, 0.0, -speed * sin, speed * cos, 0.0]
}

/// An epoch on 29 February 2024, which is day 60.
fn epoch(seconds: u32) -> String {
    format!("2024-060T{:02}:{:02}:{:02}.000", seconds / 3600, seconds / 60 % 60, seconds % 60)
}

fn states(times: &[u32]) -> String {
    let line = |time: &u32| {
        let numbers = circle(f64::from(*time)).map(|number| format!("{number:.9}")).join(" ");
        format!("{} {numbers}\n", epoch(*time))
    };
    times.iter().map(line).collect()
}

fn metadata(extra: &str) -> String {
    format!(
        "META_START\nOBJECT_NAME = CRAFT\nOBJECT_ID = 2024-001A\nCENTER_NAME = EARTH\nREF_FRAME = EME2000\n\
         TIME_SYSTEM = UTC\nSTART_TIME = {}\n{extra}META_STOP\n",
        epoch(0)
    )
}

const HEAD: &str = "CCSDS_OEM_VERS = 2.0\nCREATION_DATE = 2024-02-29T00:00:00\nORIGINATOR = TEST\n\n";

fn times(from: u32, to: u32) -> Vec<u32> {
    (from..=to).step_by(60).collect()
}

fn load(text: &str, options: &Options) -> Result<(Arc<Trajectory>, Vec<String>), String> {
    let mut said = Vec::new();
    read(Path::new("made.oem"), text, options, &mut said)
        .map(|trajectory| (trajectory, said))
        .map_err(|error| error.to_string())
}

fn loaded(text: &str) -> Arc<Trajectory> {
    load(text, &Options::default()).expect("a trajectory").0
}

fn refusal(text: &str) -> String {
    load(text, &Options::default()).expect_err("this file must be refused")
}

/// Distance from the circle [m].
fn error(trajectory: &Trajectory, time: f64) -> f64 {
    let [x, y, z, ..] = circle(time);
    trajectory.state(time).expect("covered").position.distance(DVec3::new(x, y, z) * 1e3)
}

#[test]
fn segments_comments_covariances_and_gaps_of_a_message() {
    let text = format!(
        "{HEAD}{}COMMENT coasting\n{}COVARIANCE_START\nEPOCH = {}\n1e-6\n2e-9 1e-6\nCOVARIANCE_STOP\n{}{}",
        metadata("INTERPOLATION = HERMITE\nINTERPOLATION_DEGREE = 7\n"),
        states(&times(0, 1200)),
        epoch(600),
        metadata(""),
        states(&times(1800, 3600)),
    );
    let text = text.replace('\n', "\r\n");
    let (trajectory, said) = load(&text, &Options::default()).unwrap();
    assert!(said.iter().any(|line| line.contains("2024-02-29T00:00:00.000Z")), "{said:?}");
    for time in [0.0, 60.0, 333.0, 1200.0, 1800.0, 1801.0, 3599.0] {
        assert!(error(&trajectory, time) < 0.01, "{time}: {}", error(&trajectory, time));
    }
    assert!(trajectory.state(1500.0).is_none());
    let message = trajectory.check(1000.0, 2000.0).unwrap_err().to_string();
    for part in [
        "2024-02-29T00:16:40.000Z",
        "2024-02-29T01:00:00.000Z",
        "gaps: 2024-02-29T00:20:00.000Z to 2024-02-29T00:30:00.000Z",
    ] {
        assert!(message.contains(part), "{message}");
    }
    assert!(trajectory.check(0.0, 1200.0).is_ok() && trajectory.check(1800.0, 3600.0).is_ok());
    let before = trajectory.check(-60.0, 100.0).unwrap_err().to_string();
    assert!(before.contains("warm-up") && before.contains("2024-02-28T23:59:00.000Z"), "{before}");
}

#[test]
fn xml_says_the_same_as_kvn() {
    let vector = |time: &u32| {
        let [x, y, z, u, v, w] = circle(f64::from(*time));
        format!(
            "<stateVector><EPOCH>{}</EPOCH><X units=\"km\">{x:.9}</X><Y units=\"km\">{y:.9}</Y><Z>{z:.9}</Z>\
             <X_DOT units=\"km/s\">{u:.9}</X_DOT><Y_DOT>{v:.9}</Y_DOT><Z_DOT>{w:.9}</Z_DOT></stateVector>\n",
            epoch(*time)
        )
    };
    let segment = |times: &[u32], extra: &str| {
        format!(
            "<segment>\n<metadata><OBJECT_NAME>CRAFT</OBJECT_NAME><OBJECT_ID>2024-001A</OBJECT_ID>\
             <CENTER_NAME>EARTH</CENTER_NAME><REF_FRAME>EME2000</REF_FRAME><TIME_SYSTEM>UTC</TIME_SYSTEM>{extra}\
             </metadata>\n<data><COMMENT>x</COMMENT>\n{}<covarianceMatrix><EPOCH>{}</EPOCH></covarianceMatrix></data>\n\
             </segment>\n",
            times.iter().map(vector).collect::<String>(),
            epoch(0)
        )
    };
    let usable = format!("<USEABLE_STOP_TIME>{}</USEABLE_STOP_TIME>", epoch(900));
    let body = format!("{}{}", segment(&times(0, 1200), &usable), segment(&times(1200, 2400), ""));
    let text = format!(
        "<?xml version=\"1.0\"?>\n<ndm><oem id=\"CCSDS_OEM_VERS\" version=\"2.0\"><header/><body>{body}</body></oem></ndm>"
    );
    let trajectory = loaded(&text);
    for time in [0.0, 432.1, 900.0, 1200.0, 1999.0] {
        assert!(error(&trajectory, time) < 0.01, "{time}");
    }
    assert!(trajectory.state(901.0).is_none(), "USEABLE_STOP_TIME");
    let wrong_unit = text.replacen("units=\"km\"", "units=\"m\"", 1);
    assert!(refusal(&wrong_unit).contains("X: is in m"), "{}", refusal(&wrong_unit));
    let torn = refusal(&text[..text.len() - 30]);
    assert!(torn.starts_with("made.oem:") && torn.contains("XML"), "{torn}");
    assert!(refusal("<ndm><opm/></ndm>").contains("holds no <oem>"));
    // Another message in the same ndm has segments of its own.
    let with_attitude = text.replace("<ndm>", "<ndm><aem><body><segment><metadata/></segment></body></aem>");
    assert_eq!(loaded(&with_attitude).state(432.1), trajectory.state(432.1));
}

#[test]
fn usable_times_degrees_and_time_systems_are_followed() {
    let usable = format!("USEABLE_START_TIME = {}\nUSEABLE_STOP_TIME = {}\n", epoch(120), epoch(1000));
    let trajectory = loaded(&format!("{HEAD}{}{}", metadata(&usable), states(&times(0, 1200))));
    // Time 0 is the first usable epoch.
    assert_eq!(trajectory.utc(0.0), "2024-02-29T00:02:00.000Z");
    assert!(trajectory.state(-1.0).is_none() && trajectory.state(881.0).is_none() && trajectory.state(880.0).is_some());

    let linear = metadata("INTERPOLATION = LAGRANGE\nINTERPOLATION_DEGREE = 1\n");
    let straight = loaded(&format!("{HEAD}{linear}{}", states(&times(0, 1200))));
    // A chord of 60 s lies R (w t)^2 / 8 inside the arc.
    let sagitta = RADIUS * 1e3 * (RATE * 60.0).powi(2) / 8.0;
    assert!((error(&straight, 90.0) / sagitta - 1.0).abs() < 1e-3);

    let text = format!("{HEAD}{}{}", metadata(""), states(&times(0, 1200)));
    let start = parse_epoch("2024-060T00:00:00", TimeScale::UTC).unwrap();
    let with_start = Options { start: Some(start), ..Options::default() };
    for (system, offset) in [("UTC", 0.0), ("TAI", -37.0), ("GPS", -18.0), ("TT", -69.184)] {
        let text = text.replace("TIME_SYSTEM = UTC", &format!("TIME_SYSTEM = {system}"));
        let (trajectory, _) = load(&text, &with_start).unwrap_or_else(|error| {
            // Other systems differ from UTC by up to 69 s. The ephemeris must still cover time 0.
            panic!("{system}: {error}")
        });
        assert!(error(&trajectory, 0.0) > 1e3 || offset == 0.0, "{system}");
        let [x, y, z, ..] = circle(500.0 - offset);
        let computed = trajectory.state(500.0).unwrap().position;
        assert!(computed.distance(DVec3::new(x, y, z) * 1e3) < 0.1, "{system}");
    }
}

#[test]
fn what_is_wrong_is_said_with_its_line() {
    let good = format!("{HEAD}{}{}", metadata(""), states(&times(0, 600)));
    for (from, to, expected) in [
        ("EME2000", "ITRF-97x", "made.oem:9: REF_FRAME: the frame 'ITRF-97x'"),
        ("EME2000", "LVLH", "is not one of 'EME2000'"),
        ("= EARTH", "= MARS BARYCENTER", "CENTER_NAME: is 'MARS BARYCENTER'"),
        ("TIME_SYSTEM = UTC", "TIME_SYSTEM = SCLK", "made.oem:10: TIME_SYSTEM: the time system 'SCLK'"),
        ("TIME_SYSTEM = UTC\n", "", "TIME_SYSTEM: is missing in the metadata"),
        ("2024-060T00:02:00.000", "2024-060T00:00:30.000", "epoch 2024-060T00:00:30.000: lies before"),
        ("2024-060T00:02:00.000", "2024-060T00:62:00.000", "is no time of the calendar"),
        ("2024-060T00:02:00.000 ", "2024-060T00:02:00.000 1 ", "a state has 6 numbers"),
        ("2024-060T00:02:00.000 ", "2024-060T00:02:00.000 x", "one of them is none"),
        ("META_STOP\n", "INTERPOLATION = SPLINE\nMETA_STOP\n", "'SPLINE' is not one of"),
        ("META_STOP\n", "INTERPOLATION_DEGREE = 99\nMETA_STOP\n", "from 1 to 31, found '99'"),
        ("META_STOP\n", "", "stands among"),
        ("CCSDS_OEM_VERS = 2.0", "CCSDS_OPM_VERS = 2.0", "CCSDS_OEM_VERS: must be the first line"),
    ] {
        let text = good.replacen(from, to, 1);
        let message = match (from, refusal(&text)) {
            // Without the end mark, the reader takes the states for metadata.
            ("META_STOP\n", message) if to.is_empty() => {
                assert!(message.contains("neither KEY = value nor data"), "{message}");
                continue;
            }
            (_, message) => message,
        };
        assert!(message.contains(expected), "{expected}: {message}");
    }
}

#[test]
fn what_is_no_trajectory_is_told_for_what_it_is() {
    for empty in ["", " \n\n", "\u{feff}"] {
        assert!(refusal(empty).contains("the file is empty"), "{empty:?}: {}", refusal(empty));
    }
    let good = format!("{HEAD}{}{}", metadata(""), states(&times(0, 600)));
    assert!(loaded(&format!("COMMENT made by hand\n{good}")).state(600.0).is_some());
    assert!(
        refusal(&good.replacen("CCSDS_OEM_VERS = 2.0\n", "", 1)).contains("CCSDS_OEM_VERS: must be the first line")
    );
    assert_eq!(loaded(&good.replace('\n', "\r")).state(100.0), loaded(&good).state(100.0));
    let fortran = good.replacen(" 7000.000000000 ", " 0.7000000000000D+04 ", 1);
    assert!(fortran.contains("D+04"));
    assert_eq!(loaded(&fortran).state(0.0), loaded(&good).state(0.0));
    assert!(refusal("hello\nworld\n").contains("nor as another format"));

    let lines: Vec<&str> = TLE.lines().collect();
    let [first, second] = [lines[lines.len() - 2], lines[lines.len() - 1]];
    assert!(refusal(first).contains("made.oem:1: TLE: line 1 is not followed by line 2"), "{}", refusal(first));
    let swapped = refusal(&format!("{second}\n{first}\n"));
    assert!(swapped.contains("made.oem:1: TLE: line 2 does not follow"), "{swapped}");
    let plain = loaded(TLE).state(0.0);
    assert_eq!(loaded(&format!("   {first}\n   {second}\n")).state(0.0), plain);
    for name in ["98067A", "1998-067A", "1998-067-A", "25544"] {
        let named = Options { object: Some(name.to_owned()), ..Options::default() };
        assert_eq!(load(TLE, &named).unwrap_or_else(|error| panic!("{name}: {error}")).0.state(0.0), plain);
    }
    assert!(load(TLE, &Options { object: Some("98067B".to_owned()), ..Options::default() }).is_err());
}

#[test]
fn what_the_metadata_leave_out_or_contradict_is_said() {
    let full = metadata(&format!("STOP_TIME = {}\n", epoch(600)));
    let good = format!("{HEAD}{full}{}", states(&times(0, 600)));
    let said = |text: &str| load(text, &Options::default()).unwrap().1.join("\n");
    assert!(!said(&good).contains("lack"), "{}", said(&good));
    assert!(!said(&good).contains("STOP_TIME") && !said(&good).contains("degree"), "{}", said(&good));
    for (line, expected) in [
        ("CENTER_NAME = EARTH\n", "lack CENTER_NAME: the centre is taken for the Earth"),
        ("OBJECT_NAME = CRAFT\n", "lack OBJECT_NAME."),
        ("STOP_TIME = 2024-060T00:10:00.000\n", "lack STOP_TIME."),
    ] {
        let text = good.replacen(line, "", 1);
        assert!(text != good && said(&text).contains(expected), "{}", said(&text));
    }
    let short = format!("{HEAD}{full}{}", states(&times(0, 540)));
    assert!(said(&short).contains("end at 2024-02-29T00:09:00.000Z, before its STOP_TIME"), "{}", said(&short));
    let cut = refusal(&good[..good.len() - 100]);
    assert!(cut.contains("a state has 6 numbers") || cut.contains("the file is cut"), "{cut}");
    let last_digit = short.trim_end();
    assert!(refusal(&last_digit[..last_digit.len() - 3]).contains("the file is cut"));
    let late = format!("{HEAD}{full}{}", states(&times(60, 600)));
    assert!(said(&late).contains("begin at 2024-02-29T00:01:00.000Z, after its START_TIME"), "{}", said(&late));

    let of_degree = |degree: u32| {
        good.replacen("META_STOP", &format!("INTERPOLATION = HERMITE\nINTERPOLATION_DEGREE = {degree}\nMETA_STOP"), 1)
    };
    assert!(said(&of_degree(8)).contains("of degree 8 is done with degree 9"), "{}", said(&of_degree(8)));
    assert!(said(&of_degree(1)).contains("of degree 1 is done with degree 3"));
    assert!(!said(&of_degree(7)).contains("is done with"));

    let outside = good.replacen("META_STOP", "USEABLE_START_TIME = 2024-070T00:00:00\nMETA_STOP", 1);
    let message = refusal(&outside);
    assert!(message.contains("leaves none") && message.contains("2024-02-29T00:10:00.000Z"), "{message}");
}

#[test]
fn metres_for_kilometres_are_refused() {
    let good = format!("{HEAD}{}{}", metadata(""), states(&times(0, 600)));
    let metres = good.replacen(" 7000.000000000 ", " 7000000.000000000 ", 1);
    assert!(metres != good && refusal(&metres).contains("an OEM states kilometres"), "{}", refusal(&metres));
    let fast = good.replacen(" 7.546000000 ", " 7546.0 ", 1);
    assert!(fast != good && refusal(&fast).contains("an OEM states km/s"), "{}", refusal(&fast));
    let kilometres = "time,x,y,z\n0,7000,0,0\n60,7000,10,0\n";
    let start = parse_epoch("2024-03-01", TimeScale::UTC).ok();
    let options = Options { frame: Some("GCRF".to_owned()), start, ..Options::default() };
    assert!(load(kilometres, &options).unwrap_err().contains("a table metres"));
}

#[test]
fn objects_are_told_apart() {
    let other = metadata("").replace("CRAFT", "OTHER").replace("2024-001A", "2024-002B");
    let text = format!("{HEAD}{}{}{other}{}", metadata(""), states(&times(0, 600)), states(&times(0, 600)));
    assert!(refusal(&text).contains("orbit.object"), "{}", refusal(&text));
    for name in ["craft", "2024-002B"] {
        assert!(load(&text, &Options { object: Some(name.to_owned()), ..Options::default() }).is_ok(), "{name}");
    }
    let message = load(&text, &Options { object: Some("none".to_owned()), ..Options::default() }).unwrap_err();
    assert!(message.contains("'none'"), "{message}");
}

fn table(header: &str, with_velocity: bool) -> String {
    let row = |index: u32| {
        let seconds = f64::from(index) * 60.0;
        let numbers = circle(seconds).map(|number| format!("{:.6}", number * 1e3));
        let count = if with_velocity { 6 } else { 3 };
        format!("{seconds}, {}\n", numbers[..count].join(", "))
    };
    format!("# made\n{header}\n{}", (0..20).map(row).collect::<String>())
}

#[test]
fn tables_have_a_stated_frame_and_seconds_or_dates() {
    let start = parse_epoch("2024-03-01", TimeScale::UTC).unwrap();
    let options = Options { frame: Some("GCRF".to_owned()), start: Some(start), ..Options::default() };
    for (header, with_velocity) in [("time,x,y,z", false), ("time, x, y, z, vx, vy, vz", true)] {
        let (trajectory, _) = load(&table(header, with_velocity), &options).unwrap();
        for time in [0.0, 60.0, 601.0, 1111.0] {
            assert!(error(&trajectory, time) < 0.1, "{time}: {}", error(&trajectory, time));
        }
    }
    let good = table("time,x,y,z", false);
    let without_frame = load(&good, &Options { frame: None, ..options.clone() }).unwrap_err();
    assert!(without_frame.contains("orbit.frame: is missing"), "{without_frame}");
    let without_start = load(&good, &Options { start: None, ..options.clone() }).unwrap_err();
    assert!(without_start.contains("time.start"), "{without_start}");
    let unknown = load(&table("time,x,y,q", false), &options).unwrap_err();
    assert!(unknown.contains("made.oem:2: q"), "{unknown}");
    let short = good.replacen("\n60, ", "\n60, 1, ", 1);
    assert!(load(&short, &options).unwrap_err().contains("made.oem:4: row"));
    let word = good.replacen("\n60, ", "\n60, a", 1);
    assert!(load(&word, &options).unwrap_err().contains("is not a number"));
}

#[test]
fn frames_are_turned_into_one() {
    let text = format!("{HEAD}{}{}", metadata(""), states(&times(0, 600)));
    let inertial = loaded(&text).state(0.0).unwrap();
    let moved = |frame: &str| {
        let text = text.replace("EME2000", frame);
        loaded(&text).state(0.0).unwrap().position.distance(inertial.position)
    };
    assert_eq!(moved("ICRF"), 0.0);
    // Precession is 50.3 arc seconds a year. The frames are 24 years apart.
    assert!((moved("TEME") / 7e6 - 24.16 * 50.3 / 206_265.0).abs() < 2e-4, "{}", moved("TEME"));
    assert!(moved("ITRF2014") > 1e6);
}

const TLE: &str = include_str!("../../../models/iss.tle");

#[test]
fn element_sets_are_named_checked_and_aged() {
    let (trajectory, said) = load(TLE, &Options::default()).unwrap();
    assert_eq!(trajectory.utc(0.0), "2023-10-29T17:03:44.412Z");
    assert!(said[0].contains("epoch of the elements"), "{said:?}");
    assert!((trajectory.period() - 5570.0).abs() < 40.0, "{}", trajectory.period());

    let broken = TLE.replace("22.2092", "22.2093");
    assert!(refusal(&broken).contains("made.oem:2: TLE"), "{}", refusal(&broken));
    let twice = format!("{TLE}{}", TLE.replace("ISS (ZARYA)", "OTHER"));
    assert!(refusal(&twice).contains("orbit.object"));
    assert!(load(&twice, &Options { object: Some("OTHER".to_owned()), ..Options::default() }).is_ok());
    let late = Options { start: parse_epoch("2023-11-20", TimeScale::UTC).ok(), ..Options::default() };
    assert!(load(TLE, &late).unwrap().1[0].contains("21.3 days"));
    let of_table = Options { frame: Some("TEME".to_owned()), ..Options::default() };
    assert!(load(TLE, &of_table).unwrap_err().contains("orbit.frame"));
    let half = TLE.lines().take(2).collect::<Vec<_>>().join("\n");
    assert!(load(&half, &Options::default()).is_err());
}
