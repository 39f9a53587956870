//! The thermal state of a craft in a file of its own, from which another run of the same craft begins.
//!
//! It holds the lists of `state.rs` without what belongs to one run only: measured times, counts of work, and triangles culled for one camera. These lists
//! say of which craft the state is, and where it was taken:
//!
//! | list | what |
//! |---|---|
//! | `of.model` | SHA-256 of the glTF file |
//! | `of.nodes` | SHA-256 of the nodes in device order: positions, normals, parts, materials |
//! | `of.materials` | a line for each material: SHA-256 of its values, and its name |
//! | `of.network`, `of.shadows`, `of.step` | settings that the state depends on |
//! | `of.engine` | `device` or `reference`, which keep the state of a node in different numbers |
//! | `of.scene`, `of.time` | scene file, and time of the state [s] |

use super::check::Check;
use super::engine::{Engine, EngineError};
use super::prepare::Prepared;
use super::state::{capture, restore};
use crate::saved::{Saved, SavedError};
use crate::scene::file_hash;
use crate::thermal::material::{Material, Response};

/// The kinds of engines.
const KINDS: [&str; 2] = ["reference", "device"];

/// What the state of a prepared scene depends on, apart from the engine.
fn identity(prepared: &Prepared, on_device: bool) -> Saved {
    let scene = &prepared.scene;
    let nodes = &prepared.nodes;
    let bytes = [
        bytemuck::cast_slice::<_, u8>(&nodes.vertex_of_node),
        bytemuck::cast_slice(&nodes.group_material),
        bytemuck::cast_slice(&nodes.group_part),
        bytemuck::cast_slice(&nodes.positions),
        bytemuck::cast_slice(&nodes.normals),
    ];
    let materials = prepared.materials.iter().map(|Material { name, front, sides, bulk, response, .. }| {
        let values = format!("{front:?} {sides:?} {bulk:?} {response:?}");
        format!("{} {name}", file_hash(values.as_bytes()))
    });
    let has_network = prepared.network.is_some();
    let network = format!("{:?} {:?} {:?}", scene.network, scene.contacts, scene.heaters);
    let moves = prepared.materials.iter().any(|material| matches!(material.response, Response::Transition(_)));
    let mut saved = Saved::default();
    for (name, text) in [
        ("of.model", prepared.file_hashes.get(&scene.model_path).cloned().unwrap_or_default()),
        ("of.nodes", file_hash(&bytes.concat())),
        ("of.materials", materials.collect::<Vec<_>>().join("\n")),
        ("of.network", if has_network { file_hash(network.as_bytes()) } else { String::new() }),
        ("of.shadows", format!("{:?}", scene.shadows)),
        ("of.step", if moves { format!("{} s", scene.time.step) } else { String::new() }),
        ("of.engine", KINDS[usize::from(on_device)].to_owned()),
        ("of.scene", scene.source.display().to_string()),
    ] {
        saved.put_text(name, &text);
    }
    saved
}

/// The present state, which is that of a time [s].
///
/// # Errors
/// A call that fails.
pub fn take(
    prepared: &Prepared,
    engine: &mut dyn Engine,
    check: Option<&mut Check>,
    time: f64,
) -> Result<Saved, EngineError> {
    let on_device = engine.pass_times().is_some();
    let mut saved = identity(prepared, on_device);
    saved.put("of.time", &[time]);
    saved.put_all("state", capture(0, engine, check)?);
    // What follows belongs to the run that ends here.
    saved.put("state.engine.steps", &[0u64]);
    if on_device {
        saved.put::<u8>("state.engine.scene.culled", &[]);
        saved.put::<u8>("state.engine.scene.pass_names", &[]);
        saved.put("state.engine.scene.fused_steps", &[0u64]);
    }
    for network in ["state.engine.network", "state.check.network.run", "state.check.halves.network.run"] {
        if saved.has(&format!("{network}.costs")) {
            saved.put::<u8>(format!("{network}.costs"), &[]);
            saved.put(format!("{network}.cost_counts"), &[0u64, 1]);
        }
    }
    if saved.has("state.check.sums") {
        saved.put("state.check.sums", &[0.0f64; 4]);
        saved.put("state.check.counts", &[0u64; 5]);
        saved.put("state.check.halves.sums", &[0.0f64; 3]);
        saved.put("state.check.halves.counts", &[0u64; 2]);
    }
    Ok(saved)
}

/// Where a state was taken, in words.
///
/// # Errors
/// A list is absent.
pub fn origin(saved: &Saved) -> Result<String, SavedError> {
    let [time] = saved.array::<f64, 1>("of.time")?;
    Ok(format!("{time} s of {}", saved.text("of.scene")?))
}

/// In what the craft of a state differs from that of a scene. Empty where the state fits.
///
/// # Errors
/// A list is absent, because the file holds another kind of state.
pub fn differences(saved: &Saved, prepared: &Prepared, on_device: bool) -> Result<Vec<String>, SavedError> {
    let now = identity(prepared, on_device);
    let both = |name: &str| Ok::<_, SavedError>((saved.text(name)?, now.text(name)?));
    let mut found = Vec::new();
    let (then, is) = both("of.model")?;
    if then != is {
        found.push(format!("the model {} is another file", prepared.scene.model_path.display()));
    }
    let (then, is) = both("of.materials")?;
    let entries = |text: &str| -> Vec<(String, String)> {
        let pair = |line: &str| line.split_once(' ').map(|(hash, name)| (name.to_owned(), hash.to_owned()));
        text.lines().filter_map(pair).collect()
    };
    let (then, is) = (entries(&then), entries(&is));
    for (name, hash) in &is {
        match then.iter().find(|(known, _)| known == name) {
            None => found.push(format!("the material '{name}' is new")),
            Some((_, known)) if known != hash => found.push(format!("the material '{name}' has other values")),
            Some(_) => {}
        }
    }
    let gone = then.iter().filter(|(name, _)| !is.iter().any(|(known, _)| known == name));
    found.extend(gone.map(|(name, _)| format!("the material '{name}' is gone")));
    for (name, what) in [
        (
            "of.nodes",
            "the order of the nodes is another (model.max_edge, [[part]], [[joint]] or the response of a material)",
        ),
        ("of.network", "the thermal network is another ([network], [[contact]], [[heater]])"),
        ("of.shadows", "[shadows] is another"),
    ] {
        let (then, is) = both(name)?;
        if then != is {
            found.push(what.to_owned());
        }
    }
    let (then, is) = both("of.step")?;
    if then != is && !then.is_empty() && !is.is_empty() {
        found.push(format!("time.step was {then} and is {is}; transitions count in steps"));
    }
    let (then, is) = both("of.engine")?;
    if then != is {
        let name = |kind: &str| if kind == KINDS[0] { "the f64 reference (--device cpu)" } else { "a device" };
        found.push(format!("it was taken on {}, and this runs on {}", name(&then), name(&is)));
    }
    Ok(found)
}

/// Brings the engine to a state that fits. Returns whether the check has taken it too: its sample must be that of the run that saved it.
///
/// # Errors
/// A call that fails, or lists of another length.
pub fn begin_from(saved: &Saved, engine: &mut dyn Engine, check: Option<&mut Check>) -> Result<bool, EngineError> {
    let state = saved.part("state");
    restore(&state, engine, None)?;
    let Some(check) = check else { return Ok(false) };
    if !state.has("check.counts") || check.restore(&state.part("check")).is_err() {
        return Ok(false);
    }
    check.begin_halves();
    Ok(true)
}
