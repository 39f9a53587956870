//! All keys of a scene file by section, and suggestions for misspelt keys.

use crate::misspelt::{nearest, suggestion};

/// The sections and the single keys of the root.
pub(crate) const ROOT: &[&str] = &[
    "name",
    "model",
    "part",
    "time",
    "orbit",
    "attitude",
    "environment",
    "shadows",
    "exchange",
    "joint",
    "materials",
    "material",
    "radiance",
    "camera",
    "sensor",
    "band",
    "initial",
    "temperatures",
    "probe",
    "network",
    "contact",
    "heater",
    "output",
    "uncertainty",
];

pub(super) const MODEL: &[&str] = &["path", "max_edge", "min_edge"];
pub(super) const PART: &[&str] = &["match", "max_edge", "min_edge"];
pub(super) const TIME: &[&str] = &[
    "start",
    "step",
    "steps",
    "warm_up_orbits",
    "warm_up",
    "warm_up_tolerance",
    "warm_up_step",
    "draw_every",
    "draw_steps",
    "images",
];
pub(super) const IMAGES: &[&str] = &["start", "stop", "rate_hz"];
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
pub(super) const ENVIRONMENT: &[&str] =
    &["solar_constant", "albedo", "planet_ir", "planet_radius", "background_temperature", "eclipse"];
pub(super) const SHADOWS: &[&str] = &["spacing", "redraw_angle_deg", "in_pixels", "method", "resolution"];
pub(super) const EXCHANGE: &[&str] =
    &["rays", "patch_edge", "bounces", "redraw_angle_deg", "specular_sunlight", "hold"];
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
pub(super) const SCHEDULE: &[&str] = &["time", "angle_deg", "distance", "file"];
/// Lists the keys of material values. Rules and table entries share the keys. glTF extras have the same keys, flat.
macro_rules! material_keys {
    (
        optics: $($optics:literal)*; laws: $($law:literal)*; ranges: $($range:literal)*; bulk: $($bulk:literal)*; over: $($over:literal)*; response: $($response:literal)*;
        profile: $($profile:literal)*; rule: $($rule:literal)*; sources: $($sources:literal)*;
    ) => {
        pub(super) const MATERIALS: &[&str] =
            &["table", "default", "response", "heating", "cooling", $($response),*];
        pub(super) const MATERIAL: &[&str] = &[
            $($rule,)* $($optics,)* $($law,)* $($range,)* "sides", "back", $($bulk,)* "over", "response", "heating", "cooling", $($response),*
        ];
        pub(super) const TABLE_ENTRY: &[&str] = &[
            $($sources,)* $($optics,)* $($law,)* $($range,)* "sides", "back", $($bulk,)* "over", "response", "heating", "cooling", $($response),*
        ];
        pub(super) const BACK: &[&str] = &[$($optics,)* $($law),*];
        pub(super) const OVER: &[&str] = &[$($over),*];
        pub(super) const PROFILE: &[&str] = &[$($profile),*];
        /// glTF `extras` of a material without the prefix `isotherm_`: the keys of a rule, flat.
        pub(super) const EXTRAS: &[&str] = &[
            "use", $($optics,)* "sides", $(concat!("back_", $optics),)* $($bulk,)* $(concat!("over_", $over),)* "response",
            $(concat!("heating_", $profile),)* $(concat!("cooling_", $profile),)* $($response),*
        ];
    };
}

material_keys! {
    optics: "absorptivity" "emissivity" "specular" "roughness" "normal_slope_variance" "normal_slope" "normal_seed";
    laws: "emissivity_by_angle" "emissivity_by_wavelength";
    ranges: "absorptivity_range" "emissivity_range";
    bulk: "thickness" "density" "specific_heat" "heat_capacity_per_area" "conductivity";
    over: "effective_emittance" "thickness" "density" "specific_heat" "conductivity";
    response: "retarget" "domain";
    profile: "function" "rate" "coefficients" "file" "target" "text" "t_max" "t_max_steps";
    rule: "match" "part" "use";
    sources: "finish" "note" "optics_source" "back_source" "bulk_source" "absorptivity_eol" "emissivity_eol" "eol"
        "temperature_range" "measured";
}

/// Keys of `emissivity_by_angle` and of `emissivity_by_wavelength`.
pub(super) const BY_ANGLE: &[&str] = &["law", "n", "k", "angle_deg", "emissivity"];
pub(super) const BY_WAVELENGTH: &[&str] = &["wavelength_um", "emissivity", "temperature"];

pub(super) const RADIANCE: &[&str] = &[
    "band_um",
    "reflections",
    "bounces",
    "background",
    "planet_temperature",
    "planet_map",
    "planet_day_night",
    "planet_albedo",
    "planet_albedo_map",
];
pub(super) const PLANET_MAP: &[&str] = &["file", "scale", "offset", "pole", "longitude_deg", "period"];
pub(super) const PLANET_DAY_NIGHT: &[&str] = &["day", "night", "law"];

/// Lists the keys of a camera: the keys that a ray of its image depends on, and the others. A preset may state some of the
/// former.
macro_rules! camera_keys {
    (lens: $($lens:literal)*; others: $($other:literal)*;) => {
        pub(super) const CAMERA: &[&str] = &[$($lens,)* $($other,)* "preset"];
        /// The keys that a ray of the image depends on.
        pub(super) const OF_THE_LENS: &[&str] = &[$($lens,)* "preset"];
    };
}

camera_keys! {
    lens: "width" "height" "fov_deg" "focal_length" "pixel_pitch" "focal_px" "fx" "fy" "cx"
        "cy" "skew" "distortion" "distortion_model";
    others: "samples" "line_time" "exposure_time" "sub_frames" "frame" "position" "look_at" "up" "quaternion" "path" "path_relative_to"
        "attitude" "object" "mount" "near";
}

pub(super) const SENSOR: &[&str] = &[
    "seed",
    "serial",
    "point_spread",
    "sigma",
    "f_number",
    "wavelength_um",
    "kernel",
    "pixel_fill",
    "stray_share",
    "stray_radius",
    "vignetting",
    "vignetting_map",
    "transmission",
    "lens_temperature",
    "housing_temperature",
    "time_constant",
    "netd",
    "netd_temperature",
    "netd_f_number",
    "offset_pattern",
    "gain_pattern",
    "drift",
    "shutter_interval",
    "shutter_temperature",
    "bad_pixels",
    "bits",
    "range",
    "radiance_noise",
    "radiance_range",
    "kelvin_per_count",
    "gain_control",
    "percentiles",
    "plateau",
];
pub(super) const BAND: &[&str] =
    &["name", "band_um", "response", "preset", "width_um", "planet_albedo", "noise", "sensor"];
pub(super) const INITIAL: &[&str] = &["temperature"];
pub(super) const TEMPERATURES: &[&str] = &["file", "by", "map", "distance", "unmapped", "start", "unit", "array"];
pub(super) const PROBE: &[&str] = &["name", "position", "part"];
pub(super) const NETWORK: &[&str] =
    &["integrator", "tolerance", "merge_rate", "contacts", "contact_conductance_per_area", "contact_distance"];
pub(super) const CONTACT: &[&str] =
    &["between", "between_materials", "distance", "conductance", "conductance_per_area"];
pub(super) const HEATER: &[&str] = &["part", "power", "probe", "on_below", "off_above", "initially_on"];
pub(super) const OUTPUT: &[&str] = &[
    "colour_range",
    "one_colour_range",
    "energy_balance",
    "error",
    "budget",
    "channels",
    "files",
    "video",
    "video_rate",
    "ratio",
];

pub(super) const UNCERTAINTY: &[&str] = &["parameter"];

/// Section headers with their keys, in file order.
pub(crate) const SECTIONS: &[(&str, &[&str])] = &[
    ("[model]", MODEL),
    ("[[part]]", PART),
    ("[time]", TIME),
    ("[orbit]", ORBIT),
    ("[attitude]", ATTITUDE),
    ("[environment]", ENVIRONMENT),
    ("[shadows]", SHADOWS),
    ("[exchange]", EXCHANGE),
    ("[[joint]]", JOINT),
    ("[materials]", MATERIALS),
    ("[[material]]", MATERIAL),
    ("[radiance]", RADIANCE),
    ("[camera]", CAMERA),
    ("[sensor]", SENSOR),
    ("[[band]]", BAND),
    ("[initial]", INITIAL),
    ("[[probe]]", PROBE),
    ("[network]", NETWORK),
    ("[[contact]]", CONTACT),
    ("[[heater]]", HEATER),
    ("[output]", OUTPUT),
    ("[uncertainty]", UNCERTAINTY),
];

/// Name of the section that a key belongs to, empty for the root.
pub(super) fn home(key: &str) -> Option<&'static str> {
    if ROOT.contains(&key) {
        return Some("");
    }
    let header = SECTIONS.iter().find(|(_, keys)| keys.contains(&key)).map(|(header, _)| *header);
    header.map(|header| header.trim_matches(['[', ']']))
}

/// The message for an unknown key: the most similar known key, or the section that has this key.
pub(crate) fn unknown_key(key: &str, known: &[&str]) -> String {
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

    /// The part of docs/scene.md that describes a section.
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
