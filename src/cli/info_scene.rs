//! `isotherm info MODEL --scene`: a scene to begin with, which has a rule for each material of a model.

use std::path::Path;

use toml::Value;

/// What a scene needs besides model and materials.
const REST: &str = r#"
[time]
step = 60                    # [s]
steps = 96
warm_up = "periodic"         # start where an orbit ends as it began,
warm_up_tolerance = 0.5      # to half a kelvin
draw_every = 24              # an image every 24 steps

[orbit]
altitude = 540e3             # [m]
beta_deg = -30               # how far the Sun stands above the plane of the orbit

[attitude]
mode = "nadir"               # the craft keeps one side to the planet
nadir_axis = "-Z"
forward_axis = "+X"

[environment]
solar_constant = 1361        # [W/m2]
albedo = 0.3
planet_ir = 237              # [W/m2]
background_temperature = 2.7 # [K]

[shadows]                    # parts shade each other,
[exchange]                   # warm each other,

[network]
contacts = "auto"            # and conduct where they touch
"#;

/// A guess of a surface: white paint on 2 mm of aluminium.
const SURFACE: &str = "\
absorptivity = 0.29
emissivity = 0.83
thickness = 0.002      # [m]
density = 2700         # [kg/m3]
specific_heat = 900    # [J/(kg K)]
conductivity = 160     # [W/(m K)]
response = \"network\"
";

/// The scene of a model at `path`, for a file in the model's folder.
pub(super) fn text<'m>(path: &Path, materials: impl Iterator<Item = &'m str>) -> String {
    let quoted = |name: &str| Value::from(name).to_string();
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let mut text = format!(
        "# A scene to begin with, in the folder of its model. Its orbit and its surfaces are guesses: docs/tutorial.md goes on from here.\n\
         [model]\npath = {}\n{REST}",
        quoted(&name)
    );
    for material in materials {
        text += &format!("\n[[material]]\nmatch = {}\n{SURFACE}", quoted(material));
    }
    text
}
