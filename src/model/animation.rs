//! Animations of a glTF file: rotations and translations of nodes over time (glTF 2.0, 3.11 and appendix C).

use glam::DQuat;
use serde_json::Value;

use super::accessor::Accessors;
use super::document::Document;
use super::error::label;
use super::{Animation, NodeMotion};
use crate::environment::joints::keys::{KeyInterpolation, Keys};
use crate::text::plain;

/// Name of an animation's numbers in messages.
const KEYS: &str = "keys of an animation";

/// Every animation of a file. An invalid one is a message.
pub(super) fn read(document: &Document, accessors: &Accessors) -> Vec<Result<Animation, String>> {
    let one = |(index, value): (usize, &Value)| {
        let name = value.get("name").and_then(Value::as_str).filter(|name| !name.is_empty());
        animation(index, name, value, accessors)
            .map_err(|problem| format!("{}: {problem}", label("animation", index, name)))
    };
    document.animations.iter().enumerate().map(one).collect()
}

fn animation(index: usize, name: Option<&str>, value: &Value, accessors: &Accessors) -> Result<Animation, String> {
    let list = |key: &str| value.get(key).and_then(Value::as_array).ok_or_else(|| format!("has no array {key}"));
    let number = |value: &Value, key: &str| {
        let index = value.get(key).and_then(Value::as_u64).and_then(|number| usize::try_from(number).ok());
        index.ok_or_else(|| format!("has no index {key} where one is needed"))
    };
    let samplers = list("samplers")?;
    let mut animation = Animation {
        name: name.map_or_else(|| format!("animation_{index}"), |name| plain(name).into_owned()),
        duration: 0.0,
        nodes: Vec::new(),
    };
    for channel in list("channels")? {
        let target = channel.get("target").ok_or("has a channel without target")?;
        // glTF says to ignore a channel without a node.
        let Ok(node) = number(target, "node") else { continue };
        let place = animation.nodes.iter().position(|motion| motion.node == node).unwrap_or_else(|| {
            animation.nodes.push(NodeMotion { node, ..NodeMotion::default() });
            animation.nodes.len() - 1
        });
        let motion = &mut animation.nodes[place];
        let sampler = number(channel, "sampler")?;
        let sampler = samplers.get(sampler).ok_or_else(|| format!("has no sampler {sampler}"))?;
        let last = match target.get("path").and_then(Value::as_str) {
            Some("rotation") => {
                let keys = keys::<4>(sampler, accessors)?;
                let last = keys.last_time();
                if keys.stated().any(|value| DQuat::from_array(value).length() < 0.5) {
                    return Err(format!("turns node {node} by something that is no unit quaternion"));
                }
                motion.rotation = Some(keys);
                last
            }
            Some("translation") => {
                let keys = keys::<3>(sampler, accessors)?;
                let last = keys.last_time();
                motion.translation = Some(keys);
                last
            }
            other => {
                motion.other = Some(other.unwrap_or("nothing").to_owned());
                None
            }
        };
        animation.duration = animation.duration.max(last.unwrap_or(0.0));
    }
    Ok(animation)
}

fn keys<const N: usize>(sampler: &Value, accessors: &Accessors) -> Result<Keys<N>, String> {
    let accessor = |key: &str| {
        let index = sampler.get(key).and_then(Value::as_u64).and_then(|number| usize::try_from(number).ok());
        index.ok_or_else(|| format!("has a sampler without {key}"))
    };
    let interpolation = match sampler.get("interpolation").and_then(Value::as_str) {
        None | Some("LINEAR") => KeyInterpolation::Linear,
        Some("STEP") => KeyInterpolation::Step,
        Some("CUBICSPLINE") => KeyInterpolation::CubicSpline,
        Some(other) => return Err(format!("has a sampler with interpolation {other:?}")),
    };
    let fault = |fault: super::ModelFault| fault.to_string();
    let times: Vec<f64> =
        accessors.keys::<1>(accessor("input")?, KEYS).map_err(fault)?.into_iter().map(|[t]| t).collect();
    let values = accessors.keys::<N>(accessor("output")?, KEYS).map_err(fault)?;
    let each = if interpolation == KeyInterpolation::CubicSpline { 3 } else { 1 };
    if values.len() != each * times.len() {
        return Err(format!("has {} values for {} keys", values.len(), times.len()));
    }
    let finite = times.iter().chain(values.as_flattened()).all(|value| value.is_finite());
    if !finite || times[0] < 0.0 || times.windows(2).any(|pair| pair[0] >= pair[1]) {
        return Err("has keys that are not finite, before 0 s, or do not rise".to_owned());
    }
    Ok(Keys::new(times, values, interpolation))
}
