//! CCSDS Attitude Ephemeris Message in keyword-value notation (CCSDS 504.0-B, section 4).

use std::path::Path;

use super::super::error::SceneError;
use super::kvn::{KvnLine, check_version, lines};
use super::rotation::{AttitudeSegment, Metadata, RotationRow, interpret, version};
use super::text::{FileLine, number};

#[derive(Clone, Copy, PartialEq)]
enum AemBlock {
    Header,
    Metadata,
    BeforeData,
    Data,
    AfterData,
}

pub(super) fn parse(
    path: &Path,
    text: &str,
    assumptions: &mut Vec<String>,
) -> Result<Vec<AttitudeSegment>, SceneError> {
    check_version(path, text, "CCSDS_AEM_VERS")?;
    let version = match lines(text).next() {
        Some((line, KvnLine::Pair(_, stated))) => version(&FileLine { path, line }, stated)?,
        _ => 1,
    };
    let mut segments: Vec<AttitudeSegment> = Vec::new();
    let mut metadata = Metadata::default();
    let mut block = AemBlock::Header;
    for (line, content) in lines(text) {
        let at = FileLine { path, line };
        match (content, block) {
            (KvnLine::Mark("META_START"), AemBlock::Header | AemBlock::Data | AemBlock::AfterData) => {
                metadata = Metadata { line, version, entries: Vec::new() };
                block = AemBlock::Metadata;
            }
            (KvnLine::Mark("META_STOP"), AemBlock::Metadata) => {
                segments.push(interpret(path, &metadata, assumptions)?);
                block = AemBlock::BeforeData;
            }
            (KvnLine::Mark("DATA_START"), AemBlock::BeforeData) => block = AemBlock::Data,
            (KvnLine::Mark("DATA_STOP"), AemBlock::Data) => block = AemBlock::AfterData,
            (KvnLine::Mark(mark), _) => return Err(at.error(mark, "does not belong here")),
            (KvnLine::Pair(..), AemBlock::Header) => {}
            (KvnLine::Pair(key, value), AemBlock::Metadata) => {
                metadata.entries.push((line, key.to_owned(), value.to_owned()));
            }
            (KvnLine::Data(data), AemBlock::Data) => {
                if let Some(segment) = segments.last_mut() {
                    let row = row(&at, data, segment)?;
                    segment.rows.push(row);
                }
            }
            (KvnLine::Pair(key, _), _) => {
                return Err(at.error(key, "stands outside the metadata, which are between META_START and META_STOP"));
            }
            (KvnLine::Data(data), _) => {
                let start = data.split_whitespace().next().unwrap_or(data);
                return Err(at.error(start, "stands outside the data, which are between DATA_START and DATA_STOP"));
            }
        }
    }
    let missing =
        |key: &str| FileLine { path, line: text.lines().count() }.error(key, "is missing: the file ends before it");
    match block {
        AemBlock::Header => {
            Err(FileLine { path, line: 1 }.error("META_START", "is missing: the message has no segment"))
        }
        AemBlock::Metadata => Err(missing("META_STOP")),
        AemBlock::BeforeData => Err(missing("DATA_START")),
        AemBlock::Data | AemBlock::AfterData => {
            if let Some(last) = segments.last_mut() {
                last.torn = block == AemBlock::Data;
            }
            Ok(segments)
        }
    }
}

/// Reads a line of data: an epoch, then the numbers of the segment's type.
fn row(at: &FileLine, data: &str, segment: &AttitudeSegment) -> Result<RotationRow, SceneError> {
    let mut cells = data.split_whitespace();
    let epoch = cells.next().unwrap_or_default().to_owned();
    let wrong = |message: String| at.error(&format!("epoch {epoch}"), message);
    let numbers: Option<Vec<f64>> = cells.map(number).collect();
    let numbers = numbers.ok_or_else(|| wrong("a rotation is an epoch and numbers; one of them is none".to_owned()))?;
    let columns = segment.kind.columns();
    if numbers.len() != columns.len() {
        let (count, given) = (columns.len(), numbers.len());
        return Err(wrong(format!(
            "{} has {count} numbers after the epoch ({}), found {given}",
            segment.kind.name,
            columns.join(" ")
        )));
    }
    Ok(RotationRow { line: at.line, epoch, numbers })
}

#[cfg(test)]
mod tests;
