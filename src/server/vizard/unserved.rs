//! Fields of a message that change nothing in an image. A session tells each of them once.

use prost::encoding::{DecodeContext, WireType, decode_key, decode_varint, skip_field};

/// Kinds of messages with fields of either sort.
#[derive(Debug, Clone, Copy)]
enum VizPart {
    Whole,
    Craft,
    Camera,
    Settings,
    Model,
    Live,
    Planet,
}

impl VizPart {
    /// The fields that are served, as numbers of the schema, with the part that each holds.
    fn served(self) -> &'static [(u32, Option<VizPart>)] {
        match self {
            Self::Whole => &[
                (1, None),
                (2, Some(Self::Planet)),
                (3, Some(Self::Craft)),
                (4, Some(Self::Camera)),
                (7, Some(Self::Settings)),
                (8, None),
                (10, Some(Self::Live)),
            ],
            Self::Craft => &[(1, None), (2, None), (3, None), (4, None), (19, None)],
            // The render rate is Basilisk's own, and every picture is new.
            Self::Camera => &[
                (1, None),
                (2, None),
                (3, None),
                (4, None),
                (5, None),
                (7, None),
                (8, None),
                (9, None),
                (16, None),
                (17, None),
            ],
            Self::Settings => &[(12, Some(Self::Model))],
            Self::Model => &[(1, None), (2, None), (3, None), (4, None), (5, None)],
            Self::Live => &[(3, None)],
            // Planets are spheres of one temperature, whatever way they turn.
            Self::Planet => &[(1, None), (2, None), (3, None), (4, None), (5, None), (6, None), (8, None)],
        }
    }

    /// Name of a field that is not served. Fields of the screen have numbers alone.
    fn name(self, field: u32) -> String {
        let known: &[(u32, &str)] = match self {
            Self::Whole => &[(9, "locations")],
            Self::Craft => &[
                (5, "reaction wheels"),
                (6, "thrusters"),
                (7, "Sun sensors"),
                (8, "sensors"),
                (9, "sprite"),
                (10, "transceivers"),
                (11, "storage"),
                (12, "lights"),
                (13, "built-in model"),
                (14, "orbit colour"),
                (15, "trajectory colour"),
                (16, "logo"),
                (17, "charge"),
                (18, "ellipsoids"),
            ],
            Self::Camera => &[
                (10, "sky box"),
                (11, "post-processing"),
                (12, "focus distance"),
                (13, "aperture"),
                (14, "focal length"),
                (15, "blur"),
                (18, "display"),
            ],
            Self::Settings => &[(1, "ambient light"), (11, "sky box"), (44, "Sun intensity")],
            Self::Model => &[(6, "texture"), (7, "normal map"), (8, "shader"), (9, "colour")],
            Self::Live => &[(1, "lines"), (2, "relative orbit")],
            Self::Planet => &[(7, "flattening")],
        };
        let owner = match self {
            Self::Whole => "message",
            Self::Craft => "spacecraft",
            Self::Camera => "camera",
            Self::Settings => "settings",
            Self::Model => "custom model",
            Self::Live => "live settings",
            Self::Planet => "body",
        };
        let name = known.iter().find(|(number, _)| *number == field).map(|(_, name)| *name);
        name.map_or_else(|| format!("{owner}: field {field}"), |name| format!("{owner}: {name}"))
    }
}

/// Names of the fields of a message that have a value and are not served. Bytes that can not be read end the list.
pub(crate) fn unserved(message: &[u8]) -> Vec<String> {
    let mut names = Vec::new();
    look(VizPart::Whole, message, &mut names);
    names.sort_unstable();
    names.dedup();
    names
}

fn look(part: VizPart, mut bytes: &[u8], names: &mut Vec<String>) {
    while !bytes.is_empty() {
        let Ok((field, wire)) = decode_key(&mut bytes) else { return };
        match part.served().iter().find(|(number, _)| *number == field) {
            Some((_, Some(inner))) if wire == WireType::LengthDelimited => {
                let Ok(length) = decode_varint(&mut bytes) else { return };
                let Some((own, rest)) = usize::try_from(length).ok().and_then(|length| bytes.split_at_checked(length))
                else {
                    return;
                };
                look(*inner, own, names);
                bytes = rest;
            }
            served => {
                let before = bytes;
                if skip_field(wire, field, &mut bytes, DecodeContext::default()).is_err() {
                    return;
                }
                let value = &before[..before.len() - bytes.len()];
                // A number of 0 and an empty list are the defaults.
                if served.is_none() && value.iter().any(|byte| *byte != 0) {
                    names.push(part.name(field));
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use prost::Message;

    use super::super::messages::{MessageTime, Spacecraft, VizMessage};
    use super::*;

    #[test]
    fn fields_that_are_not_served_are_named() {
        let craft = Spacecraft { name: "target".to_owned(), position: vec![1.0, 2.0, 3.0], ..Spacecraft::default() };
        let time = Some(MessageTime { frame: 3, elapsed: 1e9 });
        let message = VizMessage { time, spacecraft: vec![craft], ..VizMessage::default() };
        let mut bytes = message.encode_to_vec();
        assert_eq!(unserved(&bytes), [""; 0]);
        // Settings with an ambient light, a display switch and a custom model with a texture; a location; a craft with a thruster.
        let model = [&[0x0A, 1, b'm'][..], &[0x32, 1, b't']].concat();
        let settings = [&[0x09][..], &1.0f64.to_le_bytes(), &[0x10, 1], &[0x62, model.len() as u8], &model].concat();
        bytes.extend([&[0x3A, settings.len() as u8][..], &settings].concat());
        bytes.extend([0x4A, 2, 0x0A, 0]);
        bytes.extend([0x1A, 4, 0x32, 2, 0x0A, 0]);
        // The field 2 of the settings is 0.
        bytes.extend([0x3A, 2, 0x10, 0]);
        let expected = [
            "custom model: texture",
            "message: locations",
            "settings: ambient light",
            "settings: field 2",
            "spacecraft: thrusters",
        ];
        assert_eq!(unserved(&bytes), expected);
        assert_eq!(unserved(&bytes[..bytes.len() - 1]), expected, "the last field was a default");
        for length in 0..bytes.len() {
            unserved(&bytes[..length]);
        }
    }
}
