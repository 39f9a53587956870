//! Animations of a glTF file: how nodes turn and move over time (glTF 2.0, section 3.11 and appendix C).

use glam::{DQuat, DVec3};
use serde_json::Value;

use super::accessor::Accessors;
use super::document::Document;
use super::error::label;

/// How a channel goes from key to key.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Interpolation {
    /// It stays until the next.
    Step,
    /// Straight; rotations along the shortest arc.
    Linear,
    /// Cubic, by the tangents that the file gives.
    CubicSpline,
}

/// The keys of a channel: times [s], rising, and a value each, or tangent, value and tangent of a cubic.
#[derive(Debug, Clone, PartialEq)]
pub struct Keys<const N: usize> {
    times: Vec<f64>,
    values: Vec<[f64; N]>,
    interpolation: Interpolation,
}

/// How one node moves.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct NodeMotion {
    /// Index of the node in the file.
    pub node: usize,
    /// Its rotation (x, y, z, w), where that is animated.
    pub rotation: Option<Keys<4>>,
    /// Its translation [m], where that is animated.
    pub translation: Option<Keys<3>>,
    /// What else is animated, which no joint can follow.
    pub other: Option<String>,
}

/// One animation.
#[derive(Debug, Clone, PartialEq)]
pub struct Animation {
    /// glTF name, or `animation_N` where the file gives none.
    pub name: String,
    /// Time of its last key [s].
    pub duration: f64,
    /// The nodes that it moves.
    pub nodes: Vec<NodeMotion>,
}

impl<const N: usize> Keys<N> {
    /// Keys of values alone.
    pub fn new(times: Vec<f64>, values: Vec<[f64; N]>, interpolation: Interpolation) -> Self {
        Self { times, values, interpolation }
    }

    /// The key at or before a time, the length of the stretch to the next [s] and the share of it that has passed; the
    /// first or last key beyond the ends.
    fn place(&self, time: f64) -> (usize, f64, f64) {
        let after = self.times.partition_point(|key| *key <= time);
        if after == 0 || after == self.times.len() {
            return (after.saturating_sub(1), 0.0, 0.0);
        }
        let length = self.times[after] - self.times[after - 1];
        (after - 1, length, (time - self.times[after - 1]) / length)
    }

    /// The value of a key.
    fn value(&self, key: usize) -> [f64; N] {
        if self.interpolation == Interpolation::CubicSpline { self.values[3 * key + 1] } else { self.values[key] }
    }

    /// The value at a time; `blend` goes straight between two.
    fn at(&self, time: f64, blend: impl Fn([f64; N], [f64; N], f64) -> [f64; N]) -> [f64; N] {
        let (key, length, s) = self.place(time);
        if length == 0.0 {
            return self.value(key);
        }
        match self.interpolation {
            Interpolation::Step => self.value(key),
            Interpolation::Linear => blend(self.value(key), self.value(key + 1), s),
            Interpolation::CubicSpline => {
                let (s2, s3) = (s * s, s * s * s);
                let (from, to) = (self.value(key), self.value(key + 1));
                let (leaves, arrives) = (self.values[3 * key + 2], self.values[3 * (key + 1)]);
                std::array::from_fn(|i| {
                    (2.0 * s3 - 3.0 * s2 + 1.0) * from[i]
                        + length * (s3 - 2.0 * s2 + s) * leaves[i]
                        + (3.0 * s2 - 2.0 * s3) * to[i]
                        + length * (s3 - s2) * arrives[i]
                })
            }
        }
    }
}

impl Keys<3> {
    /// The vector at a time [s].
    pub fn vector(&self, time: f64) -> DVec3 {
        let blend = |a: [f64; 3], b: [f64; 3], s: f64| DVec3::from_array(a).lerp(DVec3::from_array(b), s).to_array();
        DVec3::from_array(self.at(time, blend))
    }
}

impl Keys<4> {
    /// The rotation at a time [s].
    pub fn rotation(&self, time: f64) -> DQuat {
        let unit = |value: [f64; 4]| DQuat::from_array(value).normalize();
        let blend = |a: [f64; 4], b: [f64; 4], s: f64| unit(a).slerp(unit(b), s).to_array();
        unit(self.at(time, blend))
    }
}

/// Every animation of a file, or what is wrong with it.
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
        let found = value.get(key).and_then(Value::as_u64).and_then(|number| usize::try_from(number).ok());
        found.ok_or_else(|| format!("has no index {key} where one is needed"))
    };
    let samplers = list("samplers")?;
    let mut animation = Animation {
        name: name.map_or_else(|| format!("animation_{index}"), str::to_owned),
        duration: 0.0,
        nodes: Vec::new(),
    };
    for channel in list("channels")? {
        let target = channel.get("target").ok_or("has a channel without target")?;
        // A channel without node is to be ignored.
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
                let last = keys.times.last().copied();
                if (0..keys.times.len()).any(|key| DQuat::from_array(keys.value(key)).length() < 0.5) {
                    return Err(format!("turns node {node} by something that is no unit quaternion"));
                }
                motion.rotation = Some(keys);
                last
            }
            Some("translation") => {
                let keys = keys::<3>(sampler, accessors)?;
                let last = keys.times.last().copied();
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
        None | Some("LINEAR") => Interpolation::Linear,
        Some("STEP") => Interpolation::Step,
        Some("CUBICSPLINE") => Interpolation::CubicSpline,
        Some(other) => return Err(format!("has a sampler with interpolation {other:?}")),
    };
    let fault = |fault: super::Fault| fault.to_string();
    let times: Vec<f64> = accessors.keys::<1>(accessor("input")?).map_err(fault)?.into_iter().map(|[t]| t).collect();
    let values = accessors.keys::<N>(accessor("output")?).map_err(fault)?;
    let each = if interpolation == Interpolation::CubicSpline { 3 } else { 1 };
    if values.len() != each * times.len() {
        return Err(format!("has {} values for {} keys", values.len(), times.len()));
    }
    let finite = times.iter().chain(values.as_flattened()).all(|value| value.is_finite());
    if !finite || times[0] < 0.0 || times.windows(2).any(|pair| pair[0] >= pair[1]) {
        return Err("has keys that are not finite, before 0 s, or do not rise".to_owned());
    }
    Ok(Keys { times, values, interpolation })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// x = t^2 from 0 to 1 has the slopes 0 and 2; x = t^3 those 0 and 3: a cubic spline holds both exactly.
    #[test]
    fn a_cubic_goes_by_its_tangents() {
        let keys = |slope: f64| Keys::<3> {
            times: vec![1.0, 2.0],
            values: vec![[0.0; 3], [0.0; 3], [0.0; 3], [slope, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0; 3]],
            interpolation: Interpolation::CubicSpline,
        };
        for s in [0.0, 0.25, 0.5, 1.0f64] {
            assert!((keys(2.0).vector(1.0 + s).x - s * s).abs() < 1e-15);
            assert!((keys(3.0).vector(1.0 + s).x - s * s * s).abs() < 1e-15);
        }
        assert!((keys(2.0).vector(1.5).x - 0.125).abs() > 0.1);
    }

    #[test]
    fn rotations_take_the_shortest_arc_and_steps_stay() {
        let turn = |degrees: f64| DQuat::from_rotation_z(degrees.to_radians());
        // The second key is the same rotation as 90 deg with the other sign.
        let values = vec![turn(0.0).to_array(), (-turn(90.0)).to_array()];
        let keys = |interpolation| Keys::<4> { times: vec![0.0, 10.0], values: values.clone(), interpolation };
        let linear = keys(Interpolation::Linear);
        for (time, degrees) in [(-1.0, 0.0), (0.0, 0.0), (2.5, 22.5), (10.0, 90.0), (11.0, 90.0)] {
            assert!(linear.rotation(time).angle_between(turn(degrees)) < 1e-7, "{time} s");
        }
        assert!(keys(Interpolation::Step).rotation(9.9).angle_between(turn(0.0)) < 1e-7);
    }
}
