//! Settings that can run and hardly mean what they say: a sensor in millikelvin, old elements, a step of no warm-up, a probe off the craft.

use glam::DVec3;

use super::finding::{Finding, named, short};
use super::materials::MaterialFacts;
use crate::simulation::prepare::Prepared;

/// NETD that no thermal camera reaches [K]. Microbolometers have 0.02 to 0.1, thermopiles up to 1.
const NOISY: f64 = 2.0;
/// Temperature that surfaces near a planet seldom fall below [K].
const COLD: f64 = 100.0;
/// Age of elements after which a place along the orbit is off by hundreds of kilometres [s].
const OLD: f64 = 14.0 * 86_400.0;
/// Distance beyond the box around the craft, as a share of its size, from which a point counts as off the craft.
const BESIDE: f64 = 0.05;

/// Whether a place lies off a craft with this box [m].
pub(super) fn is_beside(place: DVec3, [low, high]: [DVec3; 2]) -> bool {
    place.distance(place.clamp(low, high.max(low))) > BESIDE * (high - low).length()
}

pub(super) fn check(prepared: &Prepared, facts: &[MaterialFacts], [low, high]: [DVec3; 2]) -> Vec<Finding> {
    let finding = |check: &'static str, about: &str, message: String, remedy: &str| Finding {
        check,
        about: about.to_owned(),
        message,
        remedy: remedy.to_owned(),
    };
    let mut findings = Vec::new();
    let scene = &prepared.scene;
    if let Some(netd) = scene.sensor.as_ref().and_then(|sensor| sensor.noise).filter(|netd| netd.kelvin > NOISY) {
        findings.push(finding(
            "sensor",
            "sensor.netd",
            format!("a noise of {} K hides a craft", short(netd.kelvin)),
            "netd is in kelvin: state 0.05 for 50 mK",
        ));
    }
    findings.extend(out_of_range(prepared, facts));
    let last = f64::from(scene.time.steps) * scene.time.step;
    let trajectory = scene.orbit.trajectory();
    let ages = [0.0, last].map(|time| trajectory.and_then(|one| Some((time, one.age_of_elements(time)?))));
    if let Some((time, age)) = ages.into_iter().flatten().find(|(_, age)| age.abs() > OLD) {
        findings.push(finding(
            "orbit",
            "orbit.file",
            format!(
                "time {time} s is {:.0} days from the epoch of the elements, and in low orbit SGP4 errs by 1 to 3 km a day",
                age / 86_400.0
            ),
            "state elements of the date, or a time.start near their epoch and fewer steps",
        ));
    }
    let time = &scene.time;
    if time.warm_up_step != time.step && time.warm_up_orbits == 0.0 && time.periodic.is_none() {
        findings.push(finding(
            "step",
            "time.warm_up_step",
            "there is no warm-up, so its step has no effect".to_owned(),
            "state warm_up = \"periodic\" or warm_up_orbits, or leave it out",
        ));
    }
    let probes = scene.probes.iter().map(|probe| (probe.name.as_str(), probe.position));
    findings.extend(find_off(probes, [low, high]));
    findings
}

/// Finds probes that lie off the box around the craft.
pub(super) fn find_off<'a>(probes: impl Iterator<Item = (&'a str, DVec3)>, [low, high]: [DVec3; 2]) -> Option<Finding> {
    find_beside(("probe", "lies off the craft, and shows its nearest node"), probes, [low, high])
}

/// Finds points of a kind, such as a probe, that lie off the box around the craft. They are told with a message.
pub(super) fn find_beside<'a>(
    (kind, message): (&'static str, &str),
    points: impl Iterator<Item = (&'a str, DVec3)>,
    [low, high]: [DVec3; 2],
) -> Option<Finding> {
    let off: Vec<&str> = points.filter(|point| is_beside(point.1, [low, high])).map(|(name, _)| name).collect();
    (!off.is_empty() && low.is_finite()).then(|| Finding {
        check: kind,
        about: named(kind, &off),
        message: message.to_owned(),
        remedy: "a position is in metres, in the body frame and the file's pose".to_owned(),
    })
}

/// Finds a sensor whose range begins above the balance temperature of every material, or ends in the cold.
fn out_of_range(prepared: &Prepared, facts: &[MaterialFacts]) -> Option<Finding> {
    let [low, high] = prepared.scene.sensor.as_ref()?.range;
    let used = facts.iter().filter(|fact| fact.area_m2 > 0.0 && prepared.given.is_none());
    let hottest = used.map(|fact| fact.hottest_k).reduce(f64::max)?;
    let message = if hottest > 0.0 && low > hottest {
        format!(
            "begins at {} K, and the hottest material has a balance temperature of {} K in full sunlight",
            short(low),
            short(hottest)
        )
    } else if high < COLD {
        format!("ends at {} K, and surfaces near a planet are seldom so cold", short(high))
    } else {
        return None;
    };
    let remedy =
        "state the brightness temperatures in kelvin that the sensor tells apart, such as [200, 400]".to_owned();
    Some(Finding { check: "sensor", about: "sensor.range".to_owned(), message, remedy })
}
