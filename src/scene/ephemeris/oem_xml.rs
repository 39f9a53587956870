//! CCSDS Orbit Ephemeris Message in XML (CCSDS 505.0-B), alone or inside an `ndm`.

use std::path::Path;

use glam::DVec3;
use roxmltree::{Document, Node, ParsingOptions};

use super::super::error::SceneError;
use super::oem::{metadata, note_missing};
use super::{Place, StateLine, Stated, number};

/// The segments of a message.
///
/// # Errors
/// What is wrong, with its line.
pub(super) fn parse(path: &Path, text: &str) -> Result<Vec<Stated>, SceneError> {
    let options = ParsingOptions { nodes_limit: u32::MAX, ..ParsingOptions::default() };
    let document = Document::parse_with_options(text.trim_start_matches('\u{feff}'), options).map_err(|error| {
        SceneError::Value {
            path: path.to_path_buf(),
            line: error.pos().row as usize,
            key: "XML".to_owned(),
            message: error.to_string(),
        }
    })?;
    // The position of a node is counted from the start of the text: lines are told once, in order.
    let starts: Vec<usize> =
        std::iter::once(0).chain(text.bytes().enumerate().filter(|(_, b)| *b == b'\n').map(|(i, _)| i + 1)).collect();
    let line = |node: Node| starts.partition_point(|start| *start <= node.range().start);
    let root = document.root_element();
    if !root.descendants().any(|node| node.tag_name().name() == "oem") {
        let found = root.tag_name().name();
        return Err(Place { path, line: 1 }.error(found, "holds no <oem>: only orbit ephemeris messages are read"));
    }
    let mut segments = Vec::new();
    let messages = root.descendants().filter(|node| node.tag_name().name() == "oem");
    // An ndm may hold other messages too.
    let of_messages = messages.flat_map(|message| message.descendants());
    for node in of_messages.filter(|node| node.tag_name().name() == "segment") {
        let mut segment = Stated { line: line(node), ..Stated::default() };
        for item in children(node, "metadata").flat_map(|metadata| metadata.children()) {
            metadata(&mut segment, line(item), item.tag_name().name(), item.text().unwrap_or_default().trim());
        }
        for vector in children(node, "data").flat_map(|data| children(data, "stateVector")) {
            segment.lines.push(state(&Place { path, line: line(vector) }, vector)?);
        }
        note_missing(&mut segment);
        segments.push(segment);
    }
    Ok(segments)
}

fn children<'a, 'i: 'a>(node: Node<'a, 'i>, name: &'static str) -> impl Iterator<Item = Node<'a, 'i>> {
    node.children().filter(move |child| child.tag_name().name() == name)
}

fn state(at: &Place, vector: Node) -> Result<StateLine, SceneError> {
    let child = |name: &'static str| children(vector, name).next();
    let epoch = child("EPOCH").and_then(|node| node.text()).unwrap_or_default().trim().to_owned();
    let wrong = |key: &str, message: String| at.error(&format!("epoch {epoch}: {key}"), message);
    let component = |name: &'static str, unit: &str| {
        let node = child(name).ok_or_else(|| wrong(name, "is missing".to_owned()))?;
        if let Some(stated) = node.attribute("units").filter(|stated| *stated != unit) {
            return Err(wrong(name, format!("is in {stated}; an OEM has {unit}")));
        }
        let text = node.text().unwrap_or_default();
        Ok(number(text).ok_or_else(|| wrong(name, format!("'{text}' is not a number")))? * 1e3)
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
