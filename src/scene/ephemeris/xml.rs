//! CCSDS messages in XML (CCSDS 505.0-B), alone or inside an `ndm`. OEM and AEM share them.

use std::path::Path;

use roxmltree::{Document, Node, ParsingOptions};

use super::super::error::SceneError;
use super::text::{FileLine, number};

/// The byte offset of every line. An XML node knows its byte offset only.
pub(super) struct LineOffsets(Vec<usize>);

impl LineOffsets {
    /// The line of a node, from 1.
    pub(super) fn of(&self, node: Node) -> usize {
        self.0.partition_point(|start| *start <= node.range().start)
    }
}

/// Parses a text. Returns the tree and the lines.
pub(super) fn document<'a>(path: &Path, text: &'a str) -> Result<(Document<'a>, LineOffsets), SceneError> {
    let text = text.trim_start_matches('\u{feff}');
    check_shape(text).map_err(|(at, message)| {
        let line = 1 + text.as_bytes()[..at].iter().filter(|byte| **byte == b'\n').count();
        FileLine { path, line }.error("XML", message)
    })?;
    let options = ParsingOptions { nodes_limit: u32::MAX, ..ParsingOptions::default() };
    let document = Document::parse_with_options(text, options)
        .map_err(|error| FileLine { path, line: error.pos().row as usize }.error("XML", error.to_string()))?;
    let ends = text.bytes().enumerate().filter(|(_, byte)| *byte == b'\n');
    Ok((document, LineOffsets(std::iter::once(0).chain(ends.map(|(index, _)| index + 1)).collect())))
}

/// Most attributes of a tag. The parser compares each with all others of its tag.
const MOST_ATTRIBUTES: usize = 100;
/// Deepest tag. The readers look through all that a tag holds, and a message is some ten tags deep.
const DEEPEST: usize = 100;

/// Refuses a text whose tags would take the parser and the readers a time that rises with the square of its length. The error is a byte and a message.
fn check_shape(text: &str) -> Result<(), (usize, String)> {
    let bytes = text.as_bytes();
    let mut depth = 0usize;
    let mut at = 0;
    while let Some(offset) = text[at..].find('<') {
        let tag = at + offset;
        let rest = &text[tag..];
        let skipped = [("<!--", "-->"), ("<![CDATA[", "]]>"), ("<?", "?>"), ("<!", ">")]
            .into_iter()
            .find(|(begin, _)| rest.starts_with(begin));
        if let Some((begin, end)) = skipped {
            let Some(length) = rest[begin.len()..].find(end) else { return Ok(()) };
            at = tag + begin.len() + length + end.len();
            continue;
        }
        let (mut quote, mut attributes, mut end) = (None, 0, tag + 1);
        while let Some(byte) = bytes.get(end).filter(|byte| quote.is_some() || **byte != b'>') {
            match (quote, byte) {
                (None, b'"' | b'\'') => quote = Some(*byte),
                (Some(open), byte) if open == *byte => quote = None,
                (None, b'=') => attributes += 1,
                _ => {}
            }
            end += 1;
        }
        if attributes > MOST_ATTRIBUTES {
            return Err((tag, format!("a tag has more than {MOST_ATTRIBUTES} attributes")));
        }
        if bytes.get(tag + 1) == Some(&b'/') {
            depth = depth.saturating_sub(1);
        } else if bytes.get(end - 1) != Some(&b'/') {
            depth += 1;
        }
        if depth > DEEPEST {
            return Err((tag, format!("tags are more than {DEEPEST} deep")));
        }
        at = (end + 1).min(text.len());
    }
    Ok(())
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
        let name = root.tag_name().name();
        return Err(FileLine { path, line: 1 }.error(name, format!("holds no <{kind}>: only {what} messages are read")));
    }
    Ok(messages)
}

pub(super) fn children<'a, 'i: 'a>(
    node: Node<'a, 'i>,
    name: &'static str,
) -> impl Iterator<Item = Node<'a, 'i>> + use<'a, 'i> {
    node.children().filter(move |child| child.tag_name().name() == name)
}

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
