//! CCSDS messages in XML (CCSDS 505.0-B), alone or inside an `ndm`. OEM and AEM share them.

use std::path::Path;

use roxmltree::{Document, Node, ParsingOptions};

use super::super::error::SceneError;
use super::text::{FileLine, number};

/// The byte offset of every line. An XML node knows its byte offset only.
pub(super) struct Lines(Vec<usize>);

impl Lines {
    /// The line of a node, from 1.
    pub(super) fn of(&self, node: Node) -> usize {
        self.0.partition_point(|start| *start <= node.range().start)
    }
}

/// Parses a text. Returns the tree and the lines.
pub(super) fn document<'a>(path: &Path, text: &'a str) -> Result<(Document<'a>, Lines), SceneError> {
    let text = text.trim_start_matches('\u{feff}');
    let options = ParsingOptions { nodes_limit: u32::MAX, ..ParsingOptions::default() };
    let document = Document::parse_with_options(text, options)
        .map_err(|error| FileLine { path, line: error.pos().row as usize }.error("XML", error.to_string()))?;
    let ends = text.bytes().enumerate().filter(|(_, byte)| *byte == b'\n');
    Ok((document, Lines(std::iter::once(0).chain(ends.map(|(index, _)| index + 1)).collect())))
}

/// The messages of one kind: `oem` or `aem`. An `ndm` may hold other kinds too.
pub(super) fn messages<'a, 'i>(
    path: &Path,
    document: &'a Document<'i>,
    kind: &'static str,
    what: &str,
) -> Result<Vec<Node<'a, 'i>>, SceneError> {
    let root = document.root_element();
    let messages: Vec<Node> = root.descendants().filter(|node| node.tag_name().name() == kind).collect();
    if messages.is_empty() {
        let found = root.tag_name().name();
        return Err(
            FileLine { path, line: 1 }.error(found, format!("holds no <{kind}>: only {what} messages are read"))
        );
    }
    Ok(messages)
}

pub(super) fn children<'a, 'i: 'a>(
    node: Node<'a, 'i>,
    name: &'static str,
) -> impl Iterator<Item = Node<'a, 'i>> + use<'a, 'i> {
    node.children().filter(move |child| child.tag_name().name() == name)
}

/// The text of a node, trimmed.
pub(super) fn text<'a>(node: Node<'a, '_>) -> &'a str {
    node.text().unwrap_or_default().trim()
}

/// The number in a node. If the node states `units`, they must be `unit`.
pub(super) fn value(node: Node, unit: &str) -> Result<f64, String> {
    if let Some(stated) = node.attribute("units").filter(|stated| *stated != unit) {
        return Err(format!("is in {stated}; it must be in {unit}"));
    }
    let text = text(node);
    number(text).ok_or_else(|| format!("'{text}' is not a number"))
}
