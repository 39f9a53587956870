//! Builds the joints of a scene from its model: the parts that each joint moves, and its axis in the body frame.
//!
//! A joint is a rigid motion, so node data do not change when it moves. Light, planet and views are transformed into the frame of each joint instead. Nodes
//! are sorted by joint, with a dispatch and a draw for each. A dynamically indexed uniform would cost a gather for every node on lavapipe.

use glam::{DAffine3, DMat3, DMat4};
use wildmatch::WildMatch;

use super::prepare_error::PrepareError;
use crate::environment::joints::{Drive, Guided, Joint, JointDrive, JointKind, Played};
use crate::environment::step::StepLoads;
use crate::misspelt::suggestion;
use crate::model::nodes::Nodes;
use crate::model::{Model, SceneNode};
use crate::scene::{JointMotion, JointRule, Scene};

/// Relative error up to which a transform counts as a similarity.
const DISTORTION: f64 = 1e-6;

/// The joints of a scene, each after its parent, and the joint of each part (0 is the body, `i + 1` is joint `i`).
///
/// # Errors
/// A node that does not exist, that has two joints, or that can not move as the scene asks.
pub(super) fn joints(scene: &Scene, model: &Model) -> Result<(Vec<Joint>, Vec<u32>), PrepareError> {
    let mut rule_of: Vec<Option<&JointRule>> = vec![None; model.tree.len()];
    for rule in &scene.joints {
        let fail = |message: String| PrepareError::joint(scene, rule, message);
        for pattern in &rule.nodes {
            let fits = WildMatch::new(pattern);
            let mut any = false;
            for (place, node) in model.tree.iter().enumerate().filter(|(_, node)| fits.matches(&node.name)) {
                any = true;
                match rule_of[place].replace(rule) {
                    Some(other) if other.line != rule.line => {
                        let message = format!("the node '{}' has the joint of line {} already", node.name, other.line);
                        return Err(fail(message));
                    }
                    _ => {}
                }
            }
            if !any {
                let mut known: Vec<&str> = model.tree.iter().map(|node| node.name.as_str()).collect();
                known.sort_unstable();
                known.dedup();
                let near = suggestion(pattern, known);
                let message = format!("the model has no node '{pattern}'{near}");
                return Err(fail(message));
            }
        }
    }

    // A node stands after its parent, and so does a joint.
    let mut joints = Vec::new();
    let mut joint_of: Vec<u32> = Vec::with_capacity(model.tree.len());
    for (node, rule) in model.tree.iter().zip(rule_of) {
        let above = node.parent.map_or(0, |parent| joint_of[parent]);
        joint_of.push(match rule {
            None => above,
            Some(rule) => {
                let motion = motion(rule, node, model)
                    .map_err(|message| PrepareError::joint(scene, rule, format!("node '{}': {message}", node.name)))?;
                joints.push(Joint {
                    name: node.name.clone(),
                    parent: above.checked_sub(1).map(|at| at as usize),
                    motion,
                });
                joints.len() as u32
            }
        });
    }
    Ok((joints, model.part_nodes.iter().map(|place| joint_of[*place]).collect()))
}

/// The motion of a node, in the body frame.
fn motion(rule: &JointRule, node: &SceneNode, model: &Model) -> Result<JointDrive, String> {
    match &rule.motion {
        JointMotion::Guided(guided) => {
            let linear = DMat3::from_mat4(node.body_from_node);
            let along = |direction: glam::DVec3| (linear * direction).try_normalize();
            let axis = along(guided.axis).ok_or("its scale leaves nothing of the axis")?;
            let drive = match &guided.drive {
                Drive::Sun { facing, offset } => {
                    let facing = along(*facing).ok_or("its scale leaves nothing of sun_axis")?;
                    if axis.cross(facing).length() < DISTORTION {
                        return Err("its scale makes sun_axis parallel to the axis".to_owned());
                    }
                    Drive::Sun { facing, offset: *offset }
                }
                other => other.clone(),
            };
            // A mirrored frame reverses the sense of a rotation.
            let turned = guided.kind == JointKind::Rotation && linear.determinant() < 0.0;
            let axis = if turned { -axis } else { axis };
            let origin = node.body_from_node.transform_point3(guided.origin);
            Ok(JointDrive::Guided(Guided { axis, origin, drive, ..guided.clone() }))
        }
        JointMotion::Animation { name, repeats } => {
            played(name, *repeats, node, model).map(Box::new).map(JointDrive::Played)
        }
    }
}

fn played(name: &str, repeats: bool, node: &SceneNode, model: &Model) -> Result<Played, String> {
    let found = model.animations.iter().flatten().find(|animation| animation.name == name);
    let Some(animation) = found else {
        if let Some(Err(problem)) = model.animations.iter().find(|one| one.as_ref().is_err_and(|p| p.contains(name))) {
            return Err(problem.clone());
        }
        let known = model.animations.iter().flatten().map(|animation| animation.name.as_str());
        return Err(format!("the model has no animation '{name}'{}", suggestion(name, known)));
    };
    let Some(motion) = animation.nodes.iter().find(|motion| motion.node == node.index) else {
        let moved = animation.nodes.iter().filter_map(|motion| {
            model.tree.iter().find(|node| node.index == motion.node).map(|node| node.name.as_str())
        });
        return Err(format!(
            "the animation '{name}' does not move it; it moves {}",
            moved.collect::<Vec<_>>().join(", ")
        ));
    };
    if let Some(other) = &motion.other {
        return Err(format!("the animation '{name}' changes its {other}; a joint can only rotate and translate"));
    }
    let rest = node.rest.ok_or("it has a matrix, which an animation cannot replace")?;
    let body_from_parent = similarity(node.body_from_parent).ok_or("the nodes above it scale it unevenly")?;
    let (rotation, translation) = (motion.rotation.clone(), motion.translation.clone());
    Ok(Played { rotation, translation, duration: animation.duration, repeats, rest, body_from_parent })
}

/// A transform that keeps angles (a similarity). `None` where it does not.
fn similarity(transform: DMat4) -> Option<DAffine3> {
    let affine = DAffine3::from_mat4(transform);
    let squares = affine.matrix3.transpose() * affine.matrix3;
    let scale = squares.x_axis.x;
    let uneven = (squares - DMat3::from_diagonal(glam::DVec3::splat(scale))).to_cols_array();
    (scale > 0.0 && uneven.iter().all(|value| value.abs() <= DISTORTION * scale)).then_some(affine)
}

/// A joint as `isotherm info` prints it.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub(crate) struct Description {
    /// Name of its glTF node.
    pub(crate) name: String,
    /// The parent joint, or `body`.
    pub(crate) hangs_on: String,
    /// `rotation`, `translation` or `animation`.
    pub(crate) kind: &'static str,
    /// `fixed`, `sun`, `schedule` or `animation`.
    pub(crate) mode: &'static str,
    /// Unit axis in the file's pose, body frame.
    pub(crate) axis: Option<[f64; 3]>,
    /// A point on the axis [m].
    pub(crate) origin: Option<[f64; 3]>,
    /// Least and greatest position [deg or m].
    pub(crate) limits: Option<[f64; 2]>,
    /// Greatest rate [deg/s or m/s].
    pub(crate) rate: Option<f64>,
    /// Position at time 0 [deg or m].
    pub(crate) position: f64,
    /// Unit of the position: `deg` or `m`.
    pub(crate) unit: &'static str,
    /// Nodes that the joint moves, without the nodes of its child joints.
    pub(crate) nodes: usize,
}

impl Description {
    /// The joint in words.
    pub(crate) fn sentence(&self) -> String {
        let Self { kind, mode, hangs_on, unit, position, nodes, .. } = self;
        let mut text = format!("{kind}, {mode}, on {hangs_on}: {position:.3} {unit}, {nodes} nodes");
        if let (Some([x, y, z]), Some([a, b, c])) = (self.axis, self.origin) {
            text += &format!("; axis ({x:.3}, {y:.3}, {z:.3}) at ({a:.3}, {b:.3}, {c:.3}) m");
        }
        if let Some([low, high]) = self.limits {
            text += &format!(", {low} to {high} {unit}");
        }
        if let Some(rate) = self.rate {
            text += &format!(", at most {rate} {unit}/s");
        }
        text
    }
}

/// The joints of a scene, in the order of the model.
pub(crate) fn describe(loads: &StepLoads, nodes: &Nodes) -> Vec<Description> {
    let joints = loads.joints().joints();
    let positions = loads.joints_at(0.0).0;
    let shown = |turns: bool, value: f64| {
        // Rounded to a nanodegree, so that a value in degrees prints as it was written.
        if turns { (value.to_degrees() * 1e9).round() / 1e9 } else { value }
    };
    let one = |(index, joint): (usize, &Joint)| {
        let (turns, number) = (joint.turns(), index as u32 + 1);
        let ranges = nodes.ranges.iter().filter(|range| range.joint == number);
        let base = Description {
            name: joint.name.clone(),
            hangs_on: joint.parent.map_or("body".to_owned(), |parent| joints[parent].name.clone()),
            kind: "animation",
            mode: "animation",
            axis: None,
            origin: None,
            limits: None,
            rate: None,
            position: shown(turns, positions[index]),
            unit: if turns { "deg" } else { "m" },
            nodes: ranges.map(|range| range.nodes).sum(),
        };
        match &joint.motion {
            JointDrive::Played(_) => base,
            JointDrive::Guided(guided) => Description {
                kind: if turns { "rotation" } else { "translation" },
                mode: match guided.drive {
                    Drive::Fixed(_) => "fixed",
                    Drive::Schedule { .. } => "schedule",
                    Drive::Sun { .. } => "sun",
                },
                axis: Some(guided.axis.to_array()),
                origin: Some(guided.origin.to_array()),
                limits: guided.limits.map(|limits| limits.map(|limit| shown(turns, limit))),
                rate: guided.rate.map(|rate| shown(turns, rate)),
                ..base
            },
        }
    };
    joints.iter().enumerate().map(one).collect()
}
