//! CCSDS Attitude Ephemeris Message in XML (CCSDS 505.0-B), alone or inside an `ndm`.

use std::path::Path;

use roxmltree::Node;

use super::super::error::SceneError;
use super::rotation::{AttitudeSegment, Metadata, RotationForm, RotationRow, interpret, unit, version};
use super::text::FileLine;
use super::xml::{children, document, messages, text, value};

pub(super) fn parse(
    path: &Path,
    content: &str,
    assumptions: &mut Vec<String>,
) -> Result<Vec<AttitudeSegment>, SceneError> {
    let (document, lines) = document(path, content)?;
    let mut segments = Vec::new();
    for message in messages(path, &document, "aem", "attitude ephemeris")? {
        let at = FileLine { path, line: lines.of(message) };
        let stated = message.attribute("version").ok_or_else(|| at.error("aem", "has no version"))?;
        let version = version(&at, stated)?;
        for node in message.descendants().filter(|node| node.tag_name().name() == "segment") {
            let items = children(node, "metadata").flat_map(|metadata| metadata.children());
            let entries = items.filter(Node::is_element);
            let entries = entries
                .map(|item| (lines.of(item), item.tag_name().name().to_owned(), text(item).to_owned()))
                .collect();
            let metadata = Metadata { line: lines.of(node), version, entries };
            let mut segment = interpret(path, &metadata, assumptions)?;
            let states = children(node, "data").flat_map(|data| children(data, "attitudeState"));
            for state in states {
                let row = row(&FileLine { path, line: lines.of(state) }, state, &segment)?;
                segment.rows.push(row);
            }
            segments.push(segment);
        }
    }
    Ok(segments)
}

/// The epoch and the numbers of a state, in the order of the keyword-value notation.
fn row(at: &FileLine, state: Node, segment: &AttitudeSegment) -> Result<RotationRow, SceneError> {
    let find = |name: &str| state.descendants().find(|node| node.tag_name().name() == name);
    let epoch = find("EPOCH").map(text).unwrap_or_default().to_owned();
    if epoch.is_empty() {
        return Err(at.error("EPOCH", "is missing in this attitudeState"));
    }
    let wrong = |name: &str, message: String| at.error(&format!("epoch {epoch}: {name}"), message);
    let labelled = match (&segment.kind.shape, find("rotationAngles")) {
        (RotationForm::Euler { axes }, Some(angles)) => {
            Some(by_label(angles, axes).map_err(|(name, m)| wrong(&name, m))?)
        }
        _ => None,
    };
    let number = |(place, name): (usize, &&'static str)| match labelled {
        Some(angles) if place < angles.len() => Ok(angles[place]),
        // The reader does not use rates of version 1. Their tags differ from their names.
        _ if name.ends_with("_RATE") => Ok(0.0),
        _ => find(name)
            .ok_or_else(|| format!("is missing; {} has {}", segment.kind.name, segment.kind.columns().join(", ")))
            .and_then(|node| value(node, unit(name)))
            .map_err(|message| wrong(name, message)),
    };
    let numbers = segment.kind.columns().iter().enumerate().map(number).collect::<Result<_, _>>()?;
    Ok(RotationRow { line: at.line, epoch, numbers })
}

/// Angles of version 1, `<rotation1 angle="Z_ANGLE">`, in the order of the turns. If an axis occurs twice, its angles
/// keep the order of the tags.
fn by_label(angles: Node, axes: &[usize; 3]) -> Result<[f64; 3], (String, String)> {
    let mut by_place: [Option<f64>; 3] = [None; 3];
    for node in angles.children().filter(Node::is_element) {
        let name = node.tag_name().name().to_owned();
        let label = node.attribute("angle").unwrap_or_default();
        let axis = ["X_ANGLE", "Y_ANGLE", "Z_ANGLE"].iter().position(|known| *known == label);
        let place = (0..3).find(|place| Some(axes[*place]) == axis && by_place[*place].is_none());
        let Some(place) = place else {
            return Err((name, format!("its angle '{label}' has no place in the sequence of EULER_ROT_SEQ")));
        };
        by_place[place] = Some(value(node, "deg").map_err(|message| (name, message))?);
    }
    match by_place {
        [Some(first), Some(second), Some(third)] => Ok([first, second, third]),
        _ => Err(("rotationAngles".to_owned(), "must hold three angles".to_owned())),
    }
}
