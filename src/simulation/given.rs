//! Temperatures that a scene takes from a file: which node of the file each node of the model has, and its temperature at any time.

use std::collections::HashMap;
use std::sync::Arc;

use glam::DVec3;
use rayon::prelude::*;
use wildmatch::WildMatch;

use super::prepare_error::PrepareError;
use crate::misspelt::suggestion;
use crate::model::nodes::{GROUP, Nodes};
use crate::scene::{Mapping, Scene, SolvedNode, Temperatures};

/// A node of the model to which no node of the file belongs.
const NONE: u32 = u32::MAX;
/// Share of a step by which a time may be rounded.
const SLACK: f64 = 1e-9;

/// Temperatures of a scene from a file.
#[derive(Debug, Clone)]
pub(crate) struct GivenTemperatures {
    temperatures: Arc<Temperatures>,
    /// Node of the file of each node on the device.
    node_of_slot: Vec<u32>,
    remarks: Remarks,
}

/// Remarks on a mapping.
#[derive(Debug, Clone, Default)]
struct Remarks {
    /// Nodes of the file, and surfaces, that are not mapped.
    warnings: Vec<String>,
    /// Names and values for the report.
    lines: Vec<(String, String)>,
}

impl GivenTemperatures {
    /// Maps the nodes of the scene's file to the nodes of the model. `None` where the scene has no such file.
    ///
    /// # Errors
    /// Times that the file does not cover, several nodes for a part without place or distance, or surfaces without a node where the scene states no
    /// temperature for them.
    pub(crate) fn new(scene: &Scene, parts: &[String], nodes: &Nodes) -> Result<Option<Self>, PrepareError> {
        let Some(temperatures) = &scene.temperatures else { return Ok(None) };
        let wrong = |reason: String| PrepareError::Temperatures { path: scene.source.clone(), reason };
        covers(scene, temperatures).map_err(wrong)?;
        let mut node_of_slot = vec![NONE; nodes.vertex_of_node.len()];
        let all = &temperatures.solution.nodes;
        let everything: Vec<u32> = (0..all.len() as u32).collect();
        let grid = |chosen: &[u32]| temperatures.distance.map(|distance| Grid::new(all, chosen, distance));
        let everywhere = if temperatures.mapping == Mapping::Place { grid(&everything) } else { None };
        let mut slots_of_part = vec![Vec::new(); parts.len()];
        for (slot, _) in nodes.real() {
            slots_of_part[nodes.group_part[slot / GROUP] as usize].push(slot);
        }
        let mut bare = Vec::new();
        for (part, slots) in parts.iter().zip(&slots_of_part).filter(|(_, slots)| !slots.is_empty()) {
            let chosen = candidates(&temperatures.mapping, all, part);
            let own;
            let grid = match (&everywhere, chosen.as_slice()) {
                (Some(everywhere), _) => everywhere,
                (None, []) => {
                    bare.push(format!("{part} (all {} nodes)", slots.len()));
                    continue;
                }
                (None, [alone]) => {
                    slots.iter().for_each(|slot| node_of_slot[*slot] = *alone);
                    continue;
                }
                (None, several) => {
                    if several.iter().any(|node| all[*node as usize].place.is_none()) {
                        let count = several.len();
                        return Err(wrong(format!(
                            "part '{part}' has {count} nodes of the file, which have no place: name one in temperatures.map"
                        )));
                    }
                    let missing = || {
                        wrong(format!(
                            "part '{part}' has {} nodes of the file: state temperatures.distance, the most distance between a vertex \
                             and its node [m]",
                            several.len()
                        ))
                    };
                    own = grid(several).ok_or_else(missing)?;
                    &own
                }
            };
            let found: Vec<u32> =
                slots.par_iter().map(|slot| grid.nearest(nodes.positions[*slot].as_dvec3())).collect();
            let without = found.iter().filter(|node| **node == NONE).count();
            if without > 0 {
                bare.push(format!("{part} ({without} of {} nodes)", slots.len()));
            }
            slots.iter().zip(found).for_each(|(slot, node)| node_of_slot[*slot] = node);
        }
        let mapped = node_of_slot.iter().filter(|node| **node != NONE).count();
        if mapped == 0 {
            let names: Vec<&str> = all.iter().take(5).map(|node| &*node.name).filter(|name| !name.is_empty()).collect();
            return Err(wrong(format!(
                "no node of {} fits any surface {}; the file has {} nodes{}, and the parts are: {}",
                temperatures.file.display(),
                temperatures.mapping.describe(),
                all.len(),
                if names.is_empty() { String::new() } else { format!(" ({}, ..)", names.join(", ")) },
                parts.join(", ")
            )));
        }
        if temperatures.unmapped.is_none() && !bare.is_empty() {
            return Err(wrong(format!(
                "surfaces of {} have no node of the file: {}; map them, or state temperatures.unmapped, their temperature [K]{}",
                of_parts(&bare),
                bare.join(", "),
                match names_of(&idle(all, &node_of_slot)) {
                    names if names.is_empty() => String::new(),
                    names => format!(". Nodes of the file that are not on the model: {names}"),
                }
            )));
        }
        let remarks = remarks(temperatures, parts, &node_of_slot, nodes.count, &bare);
        Ok(Some(Self { temperatures: Arc::new(temperatures.clone()), node_of_slot, remarks }))
    }

    /// Temperatures of all nodes in device order at a time of the scene [K]. Padding is at 0 K.
    pub(crate) fn at(&self, time: f64) -> Vec<f64> {
        let rows = self.temperatures.solution.at(time + self.temperatures.start);
        let unmapped = self.temperatures.unmapped.unwrap_or(0.0);
        self.node_of_slot.iter().map(|node| if *node == NONE { unmapped } else { rows[*node as usize] }).collect()
    }

    /// The nodes of the file and the surfaces that are not mapped, in words.
    pub(crate) fn warnings(&self) -> &[String] {
        &self.remarks.warnings
    }

    /// The mapping, in words.
    pub(crate) fn lines(&self) -> &[(String, String)] {
        &self.remarks.lines
    }
}

/// Refuses a file whose times do not cover the times of the scene. A file with one time covers all.
fn covers(scene: &Scene, temperatures: &Temperatures) -> Result<(), String> {
    let times = &temperatures.solution.times;
    let ends = [0.0, f64::from(scene.time.steps) * scene.time.step].map(|time| time + temperatures.start);
    let slack = SLACK * scene.time.step;
    if times.len() < 2 || (times[0] <= ends[0] + slack && times[times.len() - 1] >= ends[1] - slack) {
        return Ok(());
    }
    Err(format!(
        "{} covers {} to {} s, and the scene needs {} to {} s (time.steps x time.step, temperatures.start)",
        temperatures.file.display(),
        times[0],
        times[times.len() - 1],
        ends[0],
        ends[1]
    ))
}

/// Nodes that a part may have. By place a part may have all, which need no list.
fn candidates(mapping: &Mapping, all: &[SolvedNode], part: &str) -> Vec<u32> {
    let fits: Box<dyn Fn(&SolvedNode) -> bool> = match mapping {
        Mapping::Place => return Vec::new(),
        Mapping::Name => Box::new(|node| node.name == part || node.label == part),
        Mapping::Table(rows) => {
            let of_part = rows.iter().filter(|[pattern, _]| WildMatch::new(pattern).matches(part));
            let patterns: Vec<WildMatch> = of_part.map(|[_, node]| WildMatch::new(node)).collect();
            Box::new(move |node| {
                patterns.iter().any(|pattern| pattern.matches(&node.name) || pattern.matches(&node.label))
            })
        }
    };
    (0..all.len() as u32).filter(|number| fits(&all[*number as usize])).collect()
}

/// A number of parts in words.
fn of_parts(parts: &[String]) -> String {
    if parts.len() == 1 { "1 part".to_owned() } else { format!("{} parts", parts.len()) }
}

/// The names that are not empty, one after another.
fn names_of(names: &[String]) -> String {
    names.iter().map(|name| &**name).filter(|name| !name.is_empty()).collect::<Vec<_>>().join(", ")
}

/// Names of the nodes of a file that are on no surface, empty for a node without a name.
fn idle(all: &[SolvedNode], node_of_slot: &[u32]) -> Vec<String> {
    let mut used = vec![false; all.len()];
    node_of_slot.iter().filter(|node| **node != NONE).for_each(|node| used[*node as usize] = true);
    let idle = all.iter().zip(&used).filter(|(_, used)| !**used);
    let named = idle.map(|(node, _)| match &*node.label {
        label if label.is_empty() || node.name.is_empty() => node.name.clone(),
        label => format!("{} ({label})", node.name),
    });
    named.collect()
}

fn remarks(
    temperatures: &Temperatures,
    parts: &[String],
    node_of_slot: &[u32],
    count: usize,
    bare: &[String],
) -> Remarks {
    let solution = &temperatures.solution;
    let all = &solution.nodes;
    let mapped = node_of_slot.iter().filter(|node| **node != NONE).count();
    let idle = idle(all, node_of_slot);
    let file = temperatures.file.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let mut warnings: Vec<String> = solution.notes.iter().map(|note| format!("{file}: {note}")).collect();
    if !idle.is_empty() {
        let (count, names) = (idle.len(), names_of(&idle));
        let listed = if names.is_empty() { String::new() } else { format!(": {names}") };
        warnings.push(format!("{count} of the {} nodes of {file} are not on the model{listed}", all.len()));
    }
    if let (Some(kelvin), false) = (temperatures.unmapped, bare.is_empty()) {
        warnings.push(format!(
            "surfaces of {} have no node of {file} and are at {kelvin} K (temperatures.unmapped): {}",
            of_parts(bare),
            bare.join(", ")
        ));
    }
    if let Mapping::Table(rows) = &temperatures.mapping {
        for [part, node] in rows {
            let pattern = WildMatch::new(part);
            if !parts.iter().any(|part| pattern.matches(part)) {
                let near = suggestion(part, parts.iter().map(String::as_str));
                warnings.push(format!("temperatures.map: the model has no part '{part}'{near}"));
            }
            let pattern = WildMatch::new(node);
            if !all.iter().any(|own| pattern.matches(&own.name) || pattern.matches(&own.label)) {
                let near = suggestion(node, all.iter().flat_map(|own| [&*own.name, &*own.label]));
                warnings.push(format!("temperatures.map: {file} has no node '{node}'{near}"));
            }
        }
    }
    let last = solution.times.len() - 1;
    let lines = vec![
        ("file", file),
        ("its nodes", format!("{}, of which {} are on the model", all.len(), all.len() - idle.len())),
        (
            "its times",
            match last {
                0 => "one, which holds at all times".to_owned(),
                _ => format!(
                    "{} from {} to {} s, at most {} s apart; linear between them",
                    last + 1,
                    solution.times[0],
                    solution.times[last],
                    solution.longest()
                ),
            },
        ),
        ("time of the file at time 0", format!("{} s", temperatures.start)),
        ("mapped", temperatures.mapping.describe()),
        ("most distance", temperatures.distance.map_or("any".to_owned(), |distance| format!("{distance} m"))),
        ("nodes of the model with a temperature of the file", format!("{mapped} of {count}")),
    ];
    let lines = lines.into_iter().map(|(name, value)| (name.to_owned(), value)).collect();
    Remarks { warnings, lines }
}

/// Places of nodes in cubes as wide as the most distance.
struct Grid {
    cells: HashMap<[i64; 3], Vec<(DVec3, u32)>>,
    distance: f64,
}

impl Grid {
    fn new(all: &[SolvedNode], chosen: &[u32], distance: f64) -> Self {
        let mut cells: HashMap<_, Vec<_>> = HashMap::new();
        for number in chosen {
            if let Some(place) = all[*number as usize].place {
                cells.entry(cell(place, distance)).or_default().push((place, *number));
            }
        }
        Self { cells, distance }
    }

    /// The nearest node, the first of several.
    fn nearest(&self, position: DVec3) -> u32 {
        let [x, y, z] = cell(position, self.distance);
        let mut best = (self.distance, NONE);
        for (dx, dy, dz) in (0..27).map(|number| (number % 3 - 1, number / 3 % 3 - 1, number / 9 - 1)) {
            for (place, number) in self.cells.get(&[x + dx, y + dy, z + dz]).into_iter().flatten() {
                let distance = place.distance(position);
                if distance < best.0 || (distance == best.0 && *number < best.1) {
                    best = (distance, *number);
                }
            }
        }
        best.1
    }
}

fn cell(place: DVec3, edge: f64) -> [i64; 3] {
    // A place beyond 1e15 edges lies in the last cell, which is far from any model.
    (place / edge).floor().clamp(DVec3::splat(-1e15), DVec3::splat(1e15)).to_array().map(|at| at as i64)
}
