//! Sections of the scene that a SPEC draws, for each orbit or for each image.

use super::distribution::Distribution;
use super::life::Life;
use super::reader::SpecTable;
use crate::misspelt::suggestion;
use crate::scene::SceneError;
use crate::scene::keys::{ROOT, SECTIONS};

/// The only section that is drawn for each image.
pub(super) const SENSOR: &str = "sensor";

/// Sections of the scene that are the same in all orbits of a data set, and why.
const FIXED: [(&str, &str); 5] = [
    ("name", "a data set is of one craft"),
    ("model", "all orbits have the same model"),
    ("part", "all orbits have the same model"),
    ("camera", "all images have the same camera, whose pose [camera] of the SPEC draws"),
    ("output", "the SPEC says what is written"),
];

/// Reads `[each_orbit]`, which has sections and keys of the scene file.
pub(super) fn each_orbit(root: &SpecTable) -> Result<Vec<(String, Distribution)>, SceneError> {
    let Some(table) = root.open_table("each_orbit")? else { return Ok(Vec::new()) };
    let sections = table.all_drawn()?;
    for (section, drawn) in &sections {
        if let Some((_, why)) = FIXED.iter().find(|(fixed, _)| fixed == section) {
            return Err(table.error(section, &format!("can not be drawn: {why}")));
        }
        if !ROOT.contains(&section.as_str()) {
            return Err(
                table.error(section, &format!("is no section of a scene{}", suggestion(section, ROOT.iter().copied())))
            );
        }
        check_keys(&table, section, drawn)?;
    }
    Ok(sections)
}

/// Reads `[each_image.sensor]`, which has keys of the scene's `[sensor]`.
pub(super) fn each_image(root: &SpecTable) -> Result<Option<Distribution>, SceneError> {
    let Some(table) = root.open_table("each_image")? else { return Ok(None) };
    let mut sections = table.all_drawn()?;
    if let Some((section, _)) = sections.iter().find(|(section, _)| section != SENSOR) {
        let message = "can not be drawn for an image: images of an orbit share its thermal run, and only [sensor] has no \
                       part in that. State it in [each_orbit]";
        return Err(table.error(section, message));
    }
    let Some((section, drawn)) = sections.pop() else { return Ok(None) };
    check_keys(&table, &section, &drawn)?;
    if drawn.keys().any(|key| key == "time_constant") {
        let message = "can not be drawn: images lie far apart in time, so the bolometer has settled in each";
        return Err(table.error_within(&section, "time_constant", message));
    }
    Ok(Some(drawn))
}

/// Refuses keys that a section of the scene does not have.
fn check_keys(table: &SpecTable, section: &str, drawn: &Distribution) -> Result<(), SceneError> {
    let known = SECTIONS.iter().find(|(header, _)| header.trim_matches(['[', ']']) == section);
    let Some((header, keys)) = known else { return Ok(()) };
    let of_tables = header.starts_with("[[");
    let tables: Vec<&[(String, Distribution)]> = match drawn {
        Distribution::List(items) if of_tables => items.iter().flat_map(Distribution::tables).collect(),
        // One of several tables may be drawn.
        Distribution::Choice(items, _) if !of_tables && drawn.tables().count() == items.len() => {
            drawn.tables().collect()
        }
        Distribution::Table(values) if !of_tables => vec![values],
        _ => return Err(table.error(section, &format!("expected a section {header} as in the scene"))),
    };
    for values in tables {
        if let Some((key, _)) = values.iter().find(|(key, _)| !keys.contains(&key.as_str())) {
            let message = format!("the scene's {header} has no key '{key}'{}", suggestion(key, keys.iter().copied()));
            return Err(table.error_within(section, key, &message));
        }
    }
    Ok(())
}

/// Refuses a value that two sections of the SPEC draw.
pub(super) fn refuse_twice(
    root: &SpecTable,
    each_orbit: &[(String, Distribution)],
    each_image: Option<&Distribution>,
    has_season: bool,
    life: Option<&Life>,
) -> Result<(), SceneError> {
    let values = |name: &str| each_orbit.iter().find(|(section, _)| section == name).map(|(_, drawn)| drawn);
    if has_season && values("orbit").is_some_and(|orbit| orbit.keys().any(|key| key == "beta_deg")) {
        return Err(
            root.error("season", "draws the beta angle, and so does each_orbit.orbit.beta_deg: state one of the two")
        );
    }
    if let (Some(of_orbit), Some(of_image)) = (values(SENSOR), each_image)
        && let Some(key) = of_image.keys().find(|key| of_orbit.keys().any(|other| other == *key))
    {
        let message = format!("draws sensor.{key}, and so does [each_orbit.sensor]: state one of the two");
        return Err(root.error("each_image", &message));
    }
    let Some(Distribution::List(materials)) = values("material") else { return Ok(()) };
    for material in materials {
        let Distribution::Table(values) = material else { continue };
        let name = values.iter().find(|(key, _)| key == "match").and_then(|(_, name)| name.text());
        let ages = |key: &str| name.zip(life).is_some_and(|(name, life)| life.states(name, key));
        if let Some((key, _)) = values.iter().find(|(key, _)| ages(key)) {
            return Err(root.error(
                "life",
                &format!("draws the {key} of a material for which [[each_orbit.material]] states it too"),
            ));
        }
    }
    Ok(())
}
