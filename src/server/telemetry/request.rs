//! The requests of the temperature service.

use std::collections::BTreeMap;

use glam::{DQuat, DVec3};
use serde::Deserialize;
use serde_json::{Map, Value};

use crate::environment::orbit::SUN_DISTANCE;
use crate::server::connection::Connection;
use crate::server::error::{ConnectionEnd, Refusal};
use crate::simulation::facade::Placement;

/// Most bytes of a line.
pub(crate) const MOST_BYTES: usize = 1 << 20;

/// A request.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum TelemetryRequest {
    Open(Box<OpenRequest>),
    Step(Box<StepRequest>),
}

/// Begins a craft.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct OpenRequest {
    pub(crate) scene: String,
    /// Names of parts, with wildcards.
    #[serde(default = "everything")]
    pub(crate) parts: Vec<String>,
    /// Probes besides those of the scene.
    #[serde(default)]
    pub(crate) probes: Vec<ProbeRequest>,
    /// Whether answers hold heat flows.
    #[serde(default)]
    pub(crate) heat: bool,
    /// Whether answers hold force and torque of light.
    #[serde(default)]
    pub(crate) light: Option<LightRequest>,
}

fn everything() -> Vec<String> {
    vec!["*".to_owned()]
}

/// A place whose temperature a client asks for.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ProbeRequest {
    pub(crate) name: String,
    /// In the body frame [m].
    pub(crate) position: [f64; 3],
    pub(crate) part: Option<String>,
}

/// Asks for force and torque of light.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct LightRequest {
    /// The point of the torque in the body frame [m].
    #[serde(default)]
    pub(crate) about: [f64; 3],
}

/// Moves the craft to a time.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct StepRequest {
    /// Time since the start [s].
    pub(crate) time: f64,
    position: Option<[f64; 3]>,
    velocity: Option<[f64; 3]>,
    sun: Option<[f64; 3]>,
    sun_direction: Option<[f64; 3]>,
    quaternion: Option<[f64; 4]>,
    #[serde(default)]
    pub(crate) joints: BTreeMap<String, f64>,
    #[serde(default)]
    pub(crate) heaters: BTreeMap<String, f64>,
}

impl StepRequest {
    /// Where the craft is, if the request says it.
    ///
    /// # Errors
    /// The Sun stands twice, or a vector has no direction.
    pub(crate) fn placement(&self) -> Result<Option<Placement>, Refusal> {
        let Self { position, velocity, sun, sun_direction, quaternion, .. } = self;
        let stated = [position, velocity, sun, sun_direction].iter().any(|vector| vector.is_some());
        if !stated && quaternion.is_none() {
            return Ok(None);
        }
        let sun = match (sun, sun_direction) {
            (Some(_), Some(_)) => return Err(Refusal::because("'sun' and 'sun_direction' can not both be stated")),
            (Some(sun), None) => Some(DVec3::from(*sun)),
            (None, Some(direction)) => {
                let unit = DVec3::from(*direction).try_normalize();
                let unit = unit.ok_or_else(|| Refusal::because("'sun_direction' has no direction"))?;
                // Seen from the craft, where the request says where the craft is.
                Some(position.map_or(DVec3::ZERO, DVec3::from) + SUN_DISTANCE * unit)
            }
            (None, None) => None,
        };
        Ok(Some(Placement {
            time: self.time,
            position: position.map(DVec3::from),
            velocity: velocity.map(DVec3::from),
            sun,
            inertial_from_body: quaternion.map(|[w, x, y, z]| DQuat::from_xyzw(x, y, z, w)),
        }))
    }
}

/// The bytes of the next line that is not blank.
///
/// # Errors
/// The client closes or stays silent, or the line is too long.
pub(crate) fn next_line(connection: &mut Connection) -> Result<Vec<u8>, ConnectionEnd> {
    loop {
        connection.begin_message(MOST_BYTES)?;
        let mut line = Vec::new();
        loop {
            match connection.array::<1>()? {
                [b'\n'] => break,
                [byte] => line.push(byte),
            }
        }
        if !line.trim_ascii().is_empty() {
            return Ok(line);
        }
    }
}

/// The `id` of a line, and its request or why it is none.
pub(crate) fn read_request(line: &[u8]) -> (Option<Value>, Result<TelemetryRequest, String>) {
    let mut fields: Map<String, Value> = match serde_json::from_slice(line) {
        Ok(fields) => fields,
        Err(error) => return (None, Err(format!("this line is no JSON object: {error}"))),
    };
    let id = fields.remove("id");
    let known = "\"open\" or \"step\"";
    let request = match fields.remove("request") {
        Some(Value::String(name)) => name,
        Some(_) => return (id, Err(format!("'request' must be {known}"))),
        None => return (id, Err(format!("'request' is missing: {known}"))),
    };
    let fields = Value::Object(fields);
    let taken = match request.as_str() {
        "open" => OpenRequest::deserialize(fields).map(|open| TelemetryRequest::Open(Box::new(open))),
        "step" => StepRequest::deserialize(fields).map(|step| TelemetryRequest::Step(Box::new(step))),
        other => return (id, Err(format!("there is no request '{other}': {known}"))),
    };
    (id, taken.map_err(|error| format!("{request}: {error}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wrong_line_says_what_is_wrong() {
        let reason = |line: &str| read_request(line.as_bytes()).1.expect_err("it is wrong");
        assert!(reason("{").contains("no JSON object"));
        assert!(reason("[1]").contains("no JSON object"));
        assert!(reason("{}").contains("'request' is missing"));
        assert!(reason(r#"{"request": 3}"#).contains("must be"));
        assert!(reason(r#"{"request": "fly"}"#).contains("'fly'"));
        assert!(reason(r#"{"request": "step", "tiem": 3}"#).contains("unknown field `tiem`"));
        assert!(reason(r#"{"request": "step"}"#).contains("missing field `time`"));
        assert!(reason(r#"{"request": "step", "time": 1, "position": [1, 2]}"#).contains("step: "));
        assert!(read_request(&[0xFF, 0xFE]).1.is_err());
        assert!(reason(&"[".repeat(5000)).contains("no JSON object"));
        let (id, request) = read_request(br#"{"id": "a", "request": "step", "time": 1e999}"#);
        assert!(request.is_err() && id.is_none(), "a number beyond all numbers is no JSON");
        let (id, request) = read_request(br#"{"id": 7, "request": "step", "time": 2, "sun_direction": [0, 0, 2]}"#);
        let Ok(TelemetryRequest::Step(step)) = request else { panic!("it is right") };
        let sun = step.placement().expect("a place").expect("a place").sun.expect("a Sun");
        assert_eq!((id, sun), (Some(Value::from(7)), SUN_DISTANCE * DVec3::Z));
    }
}
