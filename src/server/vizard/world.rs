//! States of craft, planet and Sun in a message.

use glam::DVec3;
use hifitime::{Epoch, TimeScale, Unit};

use super::frames::{CraftPlace, ModelMount, parent_from_child};
use super::messages::{self, Body, Spacecraft, VizMessage, vector};
use crate::environment::frames::tt_centuries;
use crate::environment::scene_time::SceneTime;
use crate::environment::sun::sun_position;
use crate::server::course::CourseState;
use crate::server::error::Refusal;

/// Least distance of the Sun from a planet [m]. Bodies without an ephemeris are all at the origin.
const LEAST_SUN_DISTANCE: f64 = 1e9;

/// Where the Sun's position is from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum SunFrom {
    Message,
    /// The date, because the message has no Sun.
    NoSun,
    /// The date, because in the message the Sun is where the planet is.
    AtThePlanet,
}

/// Planet and Sun of a message. Vectors have the message's origin and axes.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Heavens {
    pub(crate) planet: String,
    /// Radius of the planet [m]. 0 if it is unknown.
    pub(crate) radius: f64,
    position: DVec3,
    velocity: DVec3,
    gravity: f64,
    sun: DVec3,
    pub(crate) sun_from: SunFrom,
}

/// The date of a message's epoch.
///
/// # Errors
/// It is no date.
pub(crate) fn date(epoch: &messages::Epoch) -> Result<Epoch, Refusal> {
    let small = |value: i32| u8::try_from(value).ok();
    let parts = small(epoch.month).zip(small(epoch.day)).zip(small(epoch.hours)).zip(small(epoch.minutes));
    let date = parts.filter(|_| (1900..=2200).contains(&epoch.year)).and_then(|(((month, day), hours), minutes)| {
        Epoch::maybe_from_gregorian(epoch.year, month, day, hours, minutes, 0, 0, TimeScale::UTC).ok()
    });
    match date {
        Some(date) if (0.0..=61.0).contains(&epoch.seconds) => Ok(date + Unit::Second * epoch.seconds),
        _ => Err(Refusal::because("the epoch is no date")),
    }
}

fn is_sun(body: &Body) -> bool {
    body.name.trim_end_matches("_planet_data").eq_ignore_ascii_case("sun")
}

fn usable(what: &str, name: &str, list: &[f64]) -> Result<DVec3, Refusal> {
    vector(list).ok_or_else(|| Refusal::because(format!("the {what} of '{name}' is not three finite numbers")))
}

/// Planet and Sun for a craft at a position. The planet is the named planet, or the largest in the craft's sky. `now` is the date of the message.
///
/// # Errors
/// There is no planet, or no Sun and no date.
pub(crate) fn heavens(
    message: &VizMessage,
    craft: DVec3,
    planet: Option<&str>,
    now: Option<Epoch>,
) -> Result<Heavens, Refusal> {
    let mut nearest: Option<(f64, &Body, DVec3)> = None;
    for body in message.bodies.iter().filter(|body| !is_sun(body)) {
        let position = usable("position", &body.name, &body.position)?;
        let size = match planet {
            Some(name) if name == body.name => f64::INFINITY,
            Some(_) => continue,
            None => body.radius.max(1.0) / (craft - position).length().max(1.0),
        };
        if nearest.is_none_or(|(largest, ..)| size > largest) {
            nearest = Some((size, body, position));
        }
    }
    let Some((_, planet, position)) = nearest else {
        return Err(Refusal::because("the messages have no planet: add one to the gravity bodies of the spacecraft"));
    };
    let sun = message.bodies.iter().find(|body| is_sun(body));
    let sun = sun.map(|sun| usable("position", &sun.name, &sun.position)).transpose()?;
    let (sun, sun_from) = match sun {
        Some(sun) if sun.distance(position) > LEAST_SUN_DISTANCE => (sun, SunFrom::Message),
        found => {
            let from = if found.is_some() { SunFrom::AtThePlanet } else { SunFrom::NoSun };
            let now = now.filter(|_| planet.name.trim_end_matches("_planet_data").eq_ignore_ascii_case("earth"));
            let Some(now) = now else {
                return Err(Refusal::because(
                    "the messages do not say where the Sun is: add it to the gravity bodies and link an ephemeris",
                ));
            };
            (position + sun_position(tt_centuries(now)), from)
        }
    };
    Ok(Heavens {
        planet: planet.name.clone(),
        radius: if planet.radius.is_finite() { 1e3 * planet.radius.max(0.0) } else { 0.0 },
        position,
        velocity: usable("velocity", &planet.name, &planet.velocity)?,
        gravity: if planet.mu.is_finite() { 1e9 * planet.mu.max(0.0) } else { 0.0 },
        sun,
        sun_from,
    })
}

/// Place of a craft.
///
/// # Errors
/// Numbers that are not finite.
pub(crate) fn place(craft: &Spacecraft) -> Result<CraftPlace, Refusal> {
    Ok(CraftPlace {
        position: usable("position", &craft.name, &craft.position)?,
        inertial_from_body: parent_from_child(usable("rotation", &craft.name, &craft.rotation)?),
    })
}

/// State of a craft at a time, from the planet's centre.
///
/// # Errors
/// Numbers that are not finite.
pub(crate) fn state(
    craft: &Spacecraft,
    mount: &ModelMount,
    heavens: &Heavens,
    time: SceneTime,
) -> Result<CourseState, Refusal> {
    let CraftPlace { position, inertial_from_body } = mount.on(&place(craft)?);
    Ok(CourseState {
        time,
        position: position - heavens.position,
        velocity: usable("velocity", &craft.name, &craft.velocity)? - heavens.velocity,
        sun: heavens.sun - heavens.position,
        inertial_from_body,
        gravity: heavens.gravity,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn body(name: &str, position: [f64; 3], radius: f64) -> Body {
        Body { name: name.to_owned(), position: position.to_vec(), radius, ..Body::default() }
    }

    fn message(bodies: Vec<Body>) -> VizMessage {
        VizMessage { bodies, ..VizMessage::default() }
    }

    #[test]
    fn the_sun_is_that_of_the_message_or_that_of_the_date() {
        let now = date(&messages::Epoch { year: 2026, month: 3, day: 20, hours: 14, minutes: 46, seconds: 0.0 }).ok();
        let craft = DVec3::new(7e6, 0.0, 0.0);
        let earth = body("earth", [0.0; 3], 6378.1);
        let told = message(vec![earth.clone(), body("sun", [0.0, -1.5e11, 0.0], 7e5)]);
        let computed = heavens(&told, craft, None, now).expect("a sky");
        assert_eq!((computed.sun, computed.sun_from), (DVec3::new(0.0, -1.5e11, 0.0), SunFrom::Message));
        // At the March equinox of 2026 the Sun is near +X.
        let together = message(vec![earth.clone(), body("sun", [0.0; 3], 7e5)]);
        let found = heavens(&together, craft, None, now).expect("a sky");
        assert_eq!(found.sun_from, SunFrom::AtThePlanet);
        assert!(found.sun.normalize().distance(DVec3::X) < 0.01, "{}", found.sun);
        let alone = message(vec![earth]);
        assert_eq!(heavens(&alone, craft, None, now).expect("a sky").sun_from, SunFrom::NoSun);
        assert!(heavens(&alone, craft, None, None).is_err());
        assert!(heavens(&message(Vec::new()), craft, None, now).is_err());
        let mars = message(vec![body("mars", [0.0; 3], 3396.0)]);
        assert!(heavens(&mars, craft, None, now).is_err(), "the date gives the Sun of the Earth only");
    }

    #[test]
    fn the_planet_is_the_largest_in_the_sky() {
        let all = vec![
            body("sun", [1.5e11, 0.0, 0.0], 7e5),
            body("earth", [0.0; 3], 6378.1),
            body("moon", [3.8e8, 0.0, 0.0], 1737.0),
        ];
        let name = |craft, planet| heavens(&message(all.clone()), craft, planet, None).expect("a sky").planet;
        assert_eq!(name(DVec3::X * 7e6, None), "earth");
        assert_eq!(name(DVec3::X * 3.78e8, None), "moon");
        assert_eq!(name(DVec3::X * 3.78e8, Some("earth")), "earth");
    }

    #[test]
    fn what_is_no_date_is_refused() {
        let new_year = messages::Epoch { year: 2019, month: 1, day: 1, ..messages::Epoch::default() };
        assert!(date(&new_year).is_ok());
        for wrong in [
            messages::Epoch { month: 13, ..new_year.clone() },
            messages::Epoch { day: 0, ..new_year.clone() },
            messages::Epoch { year: i32::MAX, ..new_year.clone() },
            messages::Epoch { seconds: f64::NAN, ..new_year.clone() },
            messages::Epoch { hours: -1, ..new_year },
        ] {
            assert!(date(&wrong).is_err(), "{wrong:?}");
        }
    }
}
