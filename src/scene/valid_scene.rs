//! A small valid scene, whose sections stand in place of wrong ones while the rest of a file is read.

use std::sync::LazyLock;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

pub(super) const VALID: &str = "
[model]
path = 'scene.toml'
[time]
step = 1
steps = 1
[orbit]
altitude = 4e5
[attitude]
mode = 'nadir'
[environment]
[camera]
width = 64
height = 64
fov_deg = 30
position = [9, 0, 0]
look_at = [0, 0, 0]
";

pub(super) fn section(key: &str) -> Option<&'static DeTable<'static>> {
    static SCENE: LazyLock<Option<Spanned<DeTable<'static>>>> = LazyLock::new(|| DeTable::parse(VALID).ok());
    match SCENE.as_ref()?.get_ref().get(key)?.get_ref() {
        DeValue::Table(table) => Some(table),
        _ => None,
    }
}
