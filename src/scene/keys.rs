//! Every key that a scene file may hold, by section, and the nearest known one to a word that is none of them.

/// Sections of the root, with the single keys of the root.
pub(super) const ROOT: &[&str] = &[
    "name",
    "model",
    "part",
    "time",
    "orbit",
    "attitude",
    "environment",
    "shadows",
    "joint",
    "materials",
    "material",
    "radiance",
    "camera",
    "initial",
    "probe",
    "network",
    "contact",
    "heater",
    "output",
];

/// `[model]`.
pub(super) const MODEL: &[&str] = &["path", "max_edge", "min_edge"];
/// `[[part]]`.
pub(super) const PART: &[&str] = &["match", "max_edge", "min_edge"];
/// `[time]`.
pub(super) const TIME: &[&str] =
    &["start", "step", "steps", "warm_up_orbits", "warm_up", "warm_up_tolerance", "draw_every", "draw_steps"];
/// `[orbit]`.
pub(super) const ORBIT: &[&str] = &[
    "altitude",
    "period",
    "beta_deg",
    "phase_deg",
    "file",
    "object",
    "frame",
    "time_system",
    "interpolation",
    "degree",
];
/// `[attitude]`.
pub(super) const ATTITUDE: &[&str] = &[
    "mode",
    "nadir_axis",
    "forward_axis",
    "sun_axis",
    "north_axis",
    "quaternion",
    "spin_axis",
    "rate_deg",
    "file",
    "object",
    "frame",
    "time_system",
];
/// `[environment]`.
pub(super) const ENVIRONMENT: &[&str] =
    &["solar_constant", "albedo", "planet_ir", "planet_radius", "background_temperature", "eclipse"];
/// `[shadows]`.
pub(super) const SHADOWS: &[&str] = &["method", "resolution", "redraw_angle_deg"];
/// `[[joint]]`.
pub(super) const JOINT: &[&str] = &[
    "part",
    "kind",
    "axis",
    "origin",
    "limits_deg",
    "limits",
    "rate_deg",
    "rate",
    "mode",
    "angle_deg",
    "distance",
    "sun_axis",
    "offset_deg",
    "schedule",
    "animation",
    "repeat",
];
/// `schedule = { .. }` of a joint.
pub(super) const SCHEDULE: &[&str] = &["time", "angle_deg", "distance", "file"];
/// The lists of keys that state the values of a material. Optics, bulk, how the response moves and the profile of a
/// branch each stand once here: rules and table entries have them all, glTF extras have them flat.
macro_rules! material_keys {
    (
        optics: $($optics:literal)*; bulk: $($bulk:literal)*; over: $($over:literal)*; response: $($response:literal)*;
        profile: $($profile:literal)*; rule: $($rule:literal)*; sources: $($sources:literal)*;
    ) => {
        /// `[materials]`: the table, and what holds for all rules.
        pub(super) const MATERIALS: &[&str] =
            &["table", "default", "response", "heating", "cooling", $($response),*];
        /// `[[material]]`: a rule.
        pub(super) const MATERIAL: &[&str] = &[
            $($rule,)* $($optics,)* "sides", "back", $($bulk,)* "over", "response", "heating", "cooling", $($response),*
        ];
        /// An entry of a materials table.
        pub(super) const TABLE_ENTRY: &[&str] = &[
            $($sources,)* $($optics,)* "sides", "back", $($bulk,)* "over", "response", "heating", "cooling", $($response),*
        ];
        /// `back = { .. }` of a material.
        pub(super) const BACK: &[&str] = &[$($optics),*];
        /// `over = { .. }` of a material.
        pub(super) const OVER: &[&str] = &[$($over),*];
        /// `heating = { .. }` and `cooling = { .. }`.
        pub(super) const PROFILE: &[&str] = &[$($profile),*];
        /// glTF `extras` of a material, prefix `isotherm_` removed: a rule's keys, flat, as Blender's custom properties
        /// are.
        pub(super) const EXTRAS: &[&str] = &[
            "use", $($optics,)* "sides", $(concat!("back_", $optics),)* $($bulk,)* $(concat!("over_", $over),)* "response",
            $(concat!("heating_", $profile),)* $(concat!("cooling_", $profile),)* $($response),*
        ];
    };
}

material_keys! {
    optics: "absorptivity" "emissivity";
    bulk: "thickness" "density" "specific_heat" "conductivity";
    over: "effective_emittance" "thickness" "density" "specific_heat" "conductivity";
    response: "retarget" "domain";
    profile: "function" "rate" "coefficients" "file" "target" "text" "t_max" "t_max_steps";
    rule: "match" "use";
    sources: "finish" "note" "optics_source" "back_source" "bulk_source";
}

/// `[radiance]`.
pub(super) const RADIANCE: &[&str] = &["band_um"];
/// `[camera]`.
pub(super) const CAMERA: &[&str] = &[
    "width",
    "height",
    "fov_deg",
    "focal_length",
    "pixel_pitch",
    "focal_px",
    "frame",
    "position",
    "look_at",
    "up",
    "quaternion",
    "near",
];
/// `[initial]`.
pub(super) const INITIAL: &[&str] = &["temperature"];
/// `[[probe]]`.
pub(super) const PROBE: &[&str] = &["name", "position", "part"];
/// `[network]`.
pub(super) const NETWORK: &[&str] = &["integrator", "tolerance", "merge_rate"];
/// `[[contact]]`.
pub(super) const CONTACT: &[&str] =
    &["between", "between_materials", "distance", "conductance", "conductance_per_area"];
/// `[[heater]]`.
pub(super) const HEATER: &[&str] = &["part", "power", "probe", "on_below", "off_above", "initially_on"];
/// `[output]`.
pub(super) const OUTPUT: &[&str] = &["colour_range"];

/// Headers of the sections with their keys, in the order of the file.
pub(super) const SECTIONS: &[(&str, &[&str])] = &[
    ("[model]", MODEL),
    ("[[part]]", PART),
    ("[time]", TIME),
    ("[orbit]", ORBIT),
    ("[attitude]", ATTITUDE),
    ("[environment]", ENVIRONMENT),
    ("[shadows]", SHADOWS),
    ("[[joint]]", JOINT),
    ("[materials]", MATERIALS),
    ("[[material]]", MATERIAL),
    ("[radiance]", RADIANCE),
    ("[camera]", CAMERA),
    ("[initial]", INITIAL),
    ("[[probe]]", PROBE),
    ("[network]", NETWORK),
    ("[[contact]]", CONTACT),
    ("[[heater]]", HEATER),
    ("[output]", OUTPUT),
];

/// The known word that is most like `word`, where one is like it at all.
pub(super) fn nearest<'k>(word: &str, known: impl IntoIterator<Item = &'k str>) -> Option<&'k str> {
    let word = word.to_lowercase();
    known
        .into_iter()
        .map(|candidate| (likeness(&word, &candidate.to_lowercase()), candidate))
        .filter(|(likeness, _)| *likeness >= 0.5)
        .max_by(|(a, _), (b, _)| a.total_cmp(b))
        .map(|(_, candidate)| candidate)
}

/// Likeness of two words in [0, 1]. A word that contains the other whole (`altitude_km`) counts as near,
/// and nearer than another at the same number of edits.
fn likeness(word: &str, candidate: &str) -> f64 {
    let edits = strsim::normalized_damerau_levenshtein(word, candidate);
    let contained = word.len() > 2
        && candidate.len() > 2
        && (word.starts_with(candidate) || candidate.starts_with(word) || word.ends_with(candidate));
    if contained { edits.max(0.75) + 0.05 } else { edits }
}

/// `; did you mean 'step'?`, or the list of what is known where nothing is near.
pub(super) fn suggestion<'k>(word: &str, known: impl IntoIterator<Item = &'k str> + Clone) -> String {
    match nearest(word, known.clone()) {
        Some(near) => format!("; did you mean '{near}'?"),
        None => format!("; known here: {}", known.into_iter().collect::<Vec<_>>().join(", ")),
    }
}

/// The message for a key that `section` does not know: the nearest that it does know, or the section it belongs to.
pub(super) fn unknown_key(key: &str, known: &[&str]) -> String {
    let home = SECTIONS.iter().find(|(_, keys)| keys.contains(&key));
    match (nearest(key, known.iter().copied()), home) {
        (None, Some((section, _))) => format!("unknown key; '{key}' belongs in {section}"),
        _ => format!("unknown key{}", suggestion(key, known.iter().copied())),
    }
}

#[cfg(test)]
mod tests {
    use super::{
        BACK, EXTRAS, MATERIAL, ORBIT, OVER, PROFILE, ROOT, SECTIONS, TABLE_ENTRY, TIME, nearest, unknown_key,
    };

    const REFERENCE: &str = include_str!("../../docs/scene.md");

    /// The reference's part under the title that names the section.
    fn part(header: &str) -> &'static str {
        let titled = |part: &&str| part.lines().next().is_some_and(|title| title.contains(header));
        REFERENCE.split("\n## ").skip(1).find(titled).unwrap_or("")
    }

    #[test]
    fn the_reference_explains_every_key() {
        for (header, keys) in SECTIONS {
            for key in *keys {
                assert!(part(header).contains(&format!("`{key}`")), "docs/scene.md is silent on {header} {key}");
            }
        }
        for key in ROOT {
            let explained =
                ["`{}`", "`[{}]`", "`[[{}]]`"].iter().any(|form| REFERENCE.contains(&form.replace("{}", key)));
            assert!(explained, "docs/scene.md is silent on {key}");
        }
        for key in BACK.iter().chain(OVER).chain(PROFILE).chain(TABLE_ENTRY) {
            assert!(part("[[material]]").contains(&format!("`{key}`")), "docs/scene.md is silent on {key}");
        }
        for key in EXTRAS {
            assert!(REFERENCE.contains(&format!("`isotherm_{key}`")), "docs/scene.md is silent on isotherm_{key}");
        }
        assert!(!part("[time]").contains("`altitude`"), "a key must be explained in its own section");
    }

    #[test]
    fn the_nearest_key_is_found_for_usual_slips() {
        for (slip, meant) in [
            ("absorbtivity", "absorptivity"),
            ("emisivity", "emissivity"),
            ("specificHeat", "specific_heat"),
            ("Thickness", "thickness"),
            ("conductivty", "conductivity"),
        ] {
            assert_eq!(nearest(slip, MATERIAL.iter().copied()), Some(meant));
        }
        assert_eq!(nearest("altitude_km", ORBIT.iter().copied()), Some("altitude"));
        assert_eq!(nearest("setp", TIME.iter().copied()), Some("step"));
        assert_eq!(nearest("xyzzy", TIME.iter().copied()), None);
    }

    #[test]
    fn a_key_of_another_section_is_sent_home() {
        assert_eq!(unknown_key("solar_constant", ORBIT), "unknown key; 'solar_constant' belongs in [environment]");
        assert_eq!(unknown_key("xyzzy", &ORBIT[..2]), "unknown key; known here: altitude, period");
    }
}
