//! Values of TOML as messages show them.

use toml::de::DeValue;

use crate::text::plain;

/// A value as messages show it.
pub(super) fn shown(value: &DeValue) -> String {
    match value {
        DeValue::String(text) => format!("the text \"{}\"", plain(text)),
        DeValue::Integer(integer) => integer.to_string(),
        DeValue::Float(float) => float.to_string(),
        DeValue::Boolean(boolean) => boolean.to_string(),
        DeValue::Datetime(_) => "a date".to_owned(),
        DeValue::Array(items) => format!("an array of {}", items.len()),
        DeValue::Table(_) => "a table".to_owned(),
    }
}
