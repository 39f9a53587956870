//! A time on the command line.

use crate::environment::scene_time::SceneTime;

/// Reads a time since the start of a scene [s].
///
/// # Errors
/// A number that is no time, or a time before the start.
pub(super) fn parse_time(text: &str) -> Result<f64, String> {
    let number = text.parse().map_err(|_| "it takes a number of seconds from 0".to_owned())?;
    let time = SceneTime::new(number).map_err(|error| error.to_string())?.seconds();
    if time < 0.0 { Err("it is not below 0 s".to_owned()) } else { Ok(time) }
}
