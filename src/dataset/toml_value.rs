//! Values of TOML as numbers and as messages show them.

use toml::de::DeValue;

use crate::text::plain;

/// A number that may be written as an integer.
pub(super) fn number(value: &DeValue) -> Option<f64> {
    match value {
        DeValue::Float(float) => float.as_str().parse().ok(),
        DeValue::Integer(integer) => {
            i128::from_str_radix(integer.as_str(), integer.radix()).ok().map(|number| number as f64)
        }
        _ => None,
    }
}

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
