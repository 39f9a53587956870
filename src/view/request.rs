//! Requests of a page, each one JSON object in a text message.

use serde::Deserialize;

/// Longest message of a page [bytes].
pub(crate) const LONGEST: usize = 4096;

/// Range of the rate at which time plays [steps/s].
const RATES: std::ops::RangeInclusive<f64> = 0.1..=240.0;

/// The numbers that come with an image, beside surface temperature, part and material.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case", expecting = "enum Quantity")]
pub(crate) enum PageQuantity {
    /// Surface temperature, which comes with every image.
    Temperature,
    /// Brightness temperature: the temperature at which a blackbody has the radiance of the pixel.
    Apparent,
    /// Digital numbers of the sensor.
    Counts,
}

/// A wish of a page.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(tag = "do", rename_all = "snake_case", deny_unknown_fields, expecting = "internally tagged enum Request")]
pub(crate) enum PageRequest {
    /// An image has arrived, so another may follow.
    Shown {},
    /// The camera looks from a position to a point, in the body frame [m].
    Look {
        /// Position [m].
        position: [f64; 3],
        /// The point in the middle of the image [m].
        target: [f64; 3],
        /// The direction that is up in the image.
        up: [f64; 3],
    },
    /// Puts the camera where the scene's camera is.
    SceneCamera {},
    /// Chooses the quantity that comes with an image.
    Show {
        quantity: PageQuantity,
    },
    Play {
        /// At most so many steps in a second.
        rate: f64,
    },
    Pause {},
    /// Goes to the step nearest to a time.
    Seek {
        /// Time since the start [s].
        time: f64,
    },
    /// Goes some steps on or back.
    Step {
        /// How many.
        by: i32,
    },
    /// Adds a probe where a pixel of the last image shows the craft.
    Probe {
        /// Column.
        x: u32,
        /// Row.
        y: u32,
    },
    Remove {
        probe: u64,
    },
    /// Compares a run of the scene with the f64 reference.
    Compare {},
    /// Finds the uncertainty by the ranges of parameters.
    Sigma {},
}

impl PageRequest {
    /// Reads a message.
    ///
    /// # Errors
    /// The fault of the message, in words.
    pub(crate) fn read(text: &str) -> Result<Self, String> {
        let request: Self =
            serde_json::from_str(text).map_err(|error| format!("the message is not understood: {error}"))?;
        match request {
            Self::Play { rate } if !RATES.contains(&rate) => {
                Err(format!("time plays at {} to {} steps a second, not {rate}", RATES.start(), RATES.end()))
            }
            request => Ok(request),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_are_read_or_refused() {
        assert_eq!(PageRequest::read(r#"{"do":"shown"}"#), Ok(PageRequest::Shown {}));
        assert_eq!(PageRequest::read(r#"{"do":"seek","time":1.5}"#), Ok(PageRequest::Seek { time: 1.5 }));
        let look = PageRequest::Look { position: [4.0, 0.0, 0.0], target: [0.0; 3], up: [0.0, 0.0, -1.0] };
        let text = r#"{"do":"look","position":[4,0,0],"target":[0,0,0],"up":[0,0,-1]}"#;
        assert_eq!(PageRequest::read(text), Ok(look));
        for (text, reason) in [
            ("", "EOF"),
            ("{}", "missing field `do`"),
            (r#"{"do":"fly"}"#, "unknown variant `fly`"),
            (r#"{"do":"pause","now":1}"#, "unknown field `now`"),
            (r#"{"do":"seek","time":"noon"}"#, "invalid type"),
            (r#"{"do":"seek","time":1e999}"#, "number out of range"),
            (r#"{"do":"play","rate":0}"#, "0.1 to 240 steps a second, not 0"),
            (r#"{"do":"look","position":[1,2],"target":[0,0,0],"up":[0,0,1]}"#, "invalid length 2"),
        ] {
            let computed = PageRequest::read(text).unwrap_err();
            assert!(computed.contains(reason), "{text}: {computed}");
        }
    }
}
