//! Copies of a node's mesh, each with a place of its own: the glTF extension EXT_mesh_gpu_instancing.

use glam::DMat4;

use super::ModelFault;
use super::accessor::Accessors;
use super::document::Document;
use super::graph::{Instance, transform};

/// Replaces every instance whose node states copies by those copies.
///
/// # Errors
/// Attributes that are missing, of unequal count, or no transforms.
pub(super) fn copied(
    document: &Document,
    accessors: &Accessors,
    instances: Vec<Instance>,
) -> Result<Vec<Instance>, ModelFault> {
    let mut all = Vec::with_capacity(instances.len());
    for instance in instances {
        match document.nodes[instance.node].copies() {
            None => all.push(instance),
            Some(_) => copies(document, accessors, &instance, &mut all)?,
        }
    }
    Ok(all)
}

fn copies(
    document: &Document,
    accessors: &Accessors,
    node: &Instance,
    all: &mut Vec<Instance>,
) -> Result<(), ModelFault> {
    let fail = |problem: String| ModelFault::element(document.node_label(node.node), problem);
    let attributes = document.nodes[node.node].copies().into_iter().flatten();
    let stated: Vec<(&str, usize)> = attributes.map(|(name, accessor)| (name.as_str(), *accessor)).collect();
    let find = |wanted: &str| stated.iter().find(|(name, _)| *name == wanted).map(|(_, accessor)| *accessor);
    const HOLDER: &str = "places of copies";
    let translations = find("TRANSLATION").map(|index| accessors.keys::<3>(index, HOLDER)).transpose()?;
    let rotations = find("ROTATION").map(|index| accessors.keys::<4>(index, HOLDER)).transpose()?;
    let scales = find("SCALE").map(|index| accessors.keys::<3>(index, HOLDER)).transpose()?;
    let counts = [translations.as_ref().map(Vec::len), rotations.as_ref().map(Vec::len), scales.as_ref().map(Vec::len)];
    let mut known = counts.into_iter().flatten();
    let Some(count) = known.next() else {
        return Err(fail("has copies (EXT_mesh_gpu_instancing) without TRANSLATION, ROTATION or SCALE".to_owned()));
    };
    if let Some(other) = known.find(|other| *other != count) {
        return Err(fail(format!("has copies (EXT_mesh_gpu_instancing) with {count} and {other} values")));
    }
    accessors.charge(count, size_of::<Instance>()).map_err(fail)?;
    for copy in 0..count {
        let value = |values: &Option<Vec<[f64; 3]>>| values.as_ref().map(|values| values[copy]);
        let rotation = rotations.as_ref().map(|rotations| rotations[copy]);
        let copy_transform = transform(value(&scales), rotation, value(&translations))
            .map_err(|problem| fail(format!("copy {copy}: {problem}")))?;
        let body_from_part: DMat4 = node.body_from_part * copy_transform;
        if !body_from_part.is_finite() {
            return Err(fail(format!("copy {copy}: its transform, with those above it, is not finite")));
        }
        all.push(Instance { copy: Some(copy), body_from_part, ..*node });
    }
    Ok(())
}
