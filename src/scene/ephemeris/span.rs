//! Compares the times in the metadata of a CCSDS segment with the times of its data.

use std::path::Path;

use hifitime::{Epoch, TimeScale};

use super::super::epoch::parse_epoch;
use super::super::error::SceneError;
use super::text::FileLine;
use crate::environment::trajectory::seconds_between;
use crate::environment::utc::utc;

/// Largest rounding difference between the stated span and the data [s].
const SPAN_TOLERANCE: f64 = 1e-3;

/// The stated times of a segment, and the last line of the file.
pub(super) struct StatedSpan<'a> {
    pub(super) start: &'a StatedValue,
    pub(super) stop: &'a StatedValue,
    pub(super) usable_start: &'a StatedValue,
    pub(super) usable_stop: &'a StatedValue,
    pub(super) torn: Option<usize>,
}

/// The value of a metadata key, with its line.
pub(super) type StatedValue = Option<(usize, String)>;

/// Compares the first and last epochs with the stated span, because a file may be cut off.
pub(super) fn check_span(
    path: &Path,
    span: &StatedSpan,
    scale: TimeScale,
    (what, first, last): (&str, Epoch, Epoch),
    assume: &mut impl FnMut(String),
) -> Result<(), SceneError> {
    let parse = |key: &str, stated: &StatedValue| {
        let parse = |(line, text): &(usize, String)| {
            parse_epoch(text, scale).map_err(|message| FileLine { path, line: *line }.error(key, message))
        };
        stated.as_ref().map(parse).transpose()
    };
    if let Some(start) = parse("START_TIME", span.start)?
        && seconds_between(start, first) > SPAN_TOLERANCE
    {
        let (first, start) = (utc(first), utc(start));
        assume(format!("the {what} of this segment begin at {first}, after its START_TIME, {start}."));
    }
    if let Some(stop) = parse("STOP_TIME", span.stop)?
        && seconds_between(last, stop) > SPAN_TOLERANCE
    {
        let (last, stop) = (utc(last), utc(stop));
        if let Some(line) = span.torn {
            let message = format!("ends within a line, and before STOP_TIME, {stop}: the file is cut");
            return Err(FileLine { path, line }.error("the file", message));
        }
        assume(format!("the {what} of this segment end at {last}, before its STOP_TIME, {stop}: the file may be cut."));
    }
    Ok(())
}

/// The usable times of a segment, as its metadata state them. Some time must be left between `first` and `last`.
pub(super) fn usable_times(
    path: &Path,
    span: &StatedSpan,
    scale: TimeScale,
    (what, ends): (&str, Option<(Epoch, Epoch)>),
) -> Result<(Option<Epoch>, Option<Epoch>), SceneError> {
    let at = |line: usize| FileLine { path, line };
    let parse = |key: &str, stated: &StatedValue| {
        let parse = |(line, text): &(usize, String)| parse_epoch(text, scale).map_err(|m| at(*line).error(key, m));
        stated.as_ref().map(parse).transpose()
    };
    let usable = (parse("USEABLE_START_TIME", span.usable_start)?, parse("USEABLE_STOP_TIME", span.usable_stop)?);
    if let (Some(from), Some(to), Some((line, _))) = (usable.0, usable.1, span.usable_stop)
        && seconds_between(from, to) < 0.0
    {
        return Err(at(*line).error("USEABLE_STOP_TIME", "lies before USEABLE_START_TIME"));
    }
    if let (Some((first, last)), Some((line, _))) = (ends, span.usable_start.as_ref().or(span.usable_stop.as_ref()))
        && (usable.0.is_some_and(|from| seconds_between(last, from) > 0.0)
            || usable.1.is_some_and(|to| seconds_between(to, first) > 0.0))
    {
        let message = format!("leaves none of the {what} of its segment, {} to {}", utc(first), utc(last));
        return Err(at(*line).error("USEABLE_START_TIME to USEABLE_STOP_TIME", message));
    }
    Ok(usable)
}
