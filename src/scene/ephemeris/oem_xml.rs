//! CCSDS Orbit Ephemeris Message in XML (CCSDS 505.0-B), alone or inside an `ndm`.

use std::path::Path;

use glam::DVec3;
use roxmltree::Node;

use super::super::error::SceneError;
use super::oem::{metadata, note_missing};
use super::stated::{StateLine, Stated};
use super::text::FileLine;
use super::xml::{children, document, messages, text, value};

pub(super) fn parse(path: &Path, content: &str) -> Result<Vec<Stated>, SceneError> {
    let (document, lines) = document(path, content)?;
    let mut segments = Vec::new();
    let messages = messages(path, &document, "oem", "orbit ephemeris")?;
    let of_messages = messages.into_iter().flat_map(|message| message.descendants());
    for node in of_messages.filter(|node| node.tag_name().name() == "segment") {
        let mut segment = Stated { line: lines.of(node), ..Stated::default() };
        for item in children(node, "metadata").flat_map(|metadata| metadata.children()) {
            metadata(&mut segment, lines.of(item), item.tag_name().name(), text(item));
        }
        for vector in children(node, "data").flat_map(|data| children(data, "stateVector")) {
            segment.lines.push(state(&FileLine { path, line: lines.of(vector) }, vector)?);
        }
        note_missing(&mut segment);
        segments.push(segment);
    }
    Ok(segments)
}

fn state(at: &FileLine, vector: Node) -> Result<StateLine, SceneError> {
    let child = |name: &'static str| children(vector, name).next();
    let epoch = child("EPOCH").map(text).unwrap_or_default().to_owned();
    let component = |name: &'static str, unit: &str| {
        let number = child(name).ok_or_else(|| "is missing".to_owned()).and_then(|node| value(node, unit));
        number.map(|number| number * 1e3).map_err(|message| at.error(&format!("epoch {epoch}: {name}"), message))
    };
    Ok(StateLine {
        line: at.line,
        position: DVec3::new(component("X", "km")?, component("Y", "km")?, component("Z", "km")?),
        velocity: Some(DVec3::new(
            component("X_DOT", "km/s")?,
            component("Y_DOT", "km/s")?,
            component("Z_DOT", "km/s")?,
        )),
        epoch,
    })
}
