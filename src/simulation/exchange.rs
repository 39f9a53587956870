//! Radiation between the surfaces of a scene: its patches, and what they exchange in a step in f64.

use std::convert::Infallible;
use std::sync::Arc;

use glam::DAffine3;

use super::exchange_poses::Posed;
use super::network::SceneNetwork;
use crate::environment::StepLoad;
use crate::exchange::cast::Scenery;
use crate::exchange::patches::{Patches, Surface};
use crate::exchange::sky::Renewal;
use crate::exchange::step::{Exchange, Settings};
use crate::gpu::nodes::{GROUP, Nodes, PADDING};
use crate::saved::{Saved, SavedError};
use crate::thermal::material::Material;
use crate::thermal::received::{Received, Seen};

/// Most rays of a scene. Their ends take 1 GiB.
pub const MOST_RAYS: usize = 1 << 28;

/// The surface of a scene and its patches. Nodes are those of the device.
#[derive(Debug, Clone)]
pub struct Craft {
    /// The nodes and triangles.
    pub surface: Surface,
    /// The patches.
    pub patches: Patches,
    /// How rays and reflections are found.
    pub settings: Settings,
}

impl Craft {
    /// Gathers the nodes of a scene.
    ///
    /// # Errors
    /// More rays than [`MOST_RAYS`], in words.
    pub fn new(
        settings: Settings,
        nodes: &Nodes,
        triangles: &[[u32; 3]],
        network: Option<&SceneNetwork>,
        materials: &[Material],
    ) -> Result<Self, String> {
        let slots = 0..nodes.vertex_of_node.len();
        let area = |slot: usize| network.and_then(|network| network.load_area(slot)).unwrap_or(nodes.areas[slot]);
        let joint = |slot: usize| if nodes.vertex_of_node[slot] == PADDING { 0 } else { nodes.joint(slot) };
        let surface = Surface {
            positions: nodes.positions.iter().map(|position| position.as_dvec3()).collect(),
            normals: nodes.normals.iter().map(|normal| normal.as_dvec3()).collect(),
            areas: slots.clone().map(area).collect(),
            parts: slots.clone().map(|slot| nodes.group_part[slot / GROUP]).collect(),
            materials: slots.clone().map(|slot| nodes.group_material[slot / GROUP]).collect(),
            joints: slots.map(joint).collect(),
            // The triangles between the runs of joints have no area.
            triangles: triangles.iter().copied().filter(|[a, b, c]| a != b && b != c).collect(),
        };
        let patches = Patches::new(&surface, materials, settings.patch_edge);
        let rays = patches.all.len().saturating_mul(settings.rays as usize);
        if rays > MOST_RAYS {
            return Err(format!(
                "{} patches of {} rays are more than {MOST_RAYS} rays: state a larger patch_edge or fewer rays",
                patches.all.len(),
                settings.rays
            ));
        }
        Ok(Self { surface, patches, settings })
    }

    /// What the patches exchange in a pose, found by the processor.
    pub fn cast(&self, poses: &[DAffine3]) -> Exchange {
        Exchange::cast(&self.surface, &self.patches, &Scenery::new(&self.surface, poses), &self.settings)
    }
}

/// The exchange of a scene in f64, step by step.
#[derive(Debug, Clone)]
pub struct ExchangeTwin {
    craft: Arc<Craft>,
    found: Posed<Exchange>,
    renewal: Renewal,
    seen: Vec<Seen>,
}

impl ExchangeTwin {
    /// An exchange whose rays are cast for poses first.
    pub fn new(craft: &Arc<Craft>, poses: &[DAffine3]) -> Self {
        let angle = craft.settings.redraw_angle;
        let renewal = Renewal { angle, found_for: None };
        let mut found = Posed::new(angle);
        let Ok(_) = found.turn(poses, |poses| Ok::<_, Infallible>(craft.cast(poses)));
        Self { craft: Arc::clone(craft), found, renewal, seen: Vec::new() }
    }

    /// What the faces of every node receive in a step. Temperatures [K] and shares of the Sun are those of the nodes.
    pub fn received(
        &mut self,
        load: &StepLoad,
        temperature: impl Fn(usize) -> f64 + Sync,
        visibility: impl Fn(usize) -> f64 + Sync,
    ) -> Vec<[Received; 2]> {
        let Ok(turned) = self.found.turn(&load.joints, |poses| Ok::<_, Infallible>(self.craft.cast(poses)));
        let turned = turned.is_some();
        let Some(exchange) = self.found.found() else { return Vec::new() };
        if self.renewal.is_due(load) || turned || self.seen.is_empty() {
            self.seen = exchange.seen(load);
        }
        let sent = exchange.sent(load, &self.seen, temperature, visibility);
        let absorbed = exchange.absorbed(&sent);
        (0..exchange.of_node.len()).map(|node| exchange.of_node(node, &absorbed, &self.seen)).collect()
    }

    /// The state between two steps.
    pub fn save(&self) -> Saved {
        let mut saved = self.renewal.save();
        saved.put_all("rays", self.found.save());
        saved.put("seen", &self.seen.iter().map(|seen| [seen.planet_ir, seen.albedo]).collect::<Vec<_>>());
        saved
    }

    /// Takes what `save` gave.
    ///
    /// # Errors
    /// Lists of another kind.
    pub fn restore(&mut self, saved: &Saved) -> Result<(), SavedError> {
        self.renewal.restore(saved)?;
        self.found.restore(&saved.part("rays"), |poses| Ok::<_, SavedError>(self.craft.cast(poses)))?;
        let seen: Vec<[f64; 2]> = saved.list("seen")?;
        self.seen = seen.into_iter().map(|[planet_ir, albedo]| Seen { planet_ir, albedo }).collect();
        Ok(())
    }
}

/// What was found of a craft, in words.
pub fn describe(craft: &Craft, exchange: &Exchange) -> Vec<(String, String)> {
    let correction = exchange.factors.correction;
    let pairs = exchange.entries.len() as f64 / exchange.patches.len().max(1) as f64;
    let returned = exchange.infrared.returned.max(exchange.sunlight.returned);
    let mut told = vec![
        ("patches".to_owned(), exchange.patches.len().to_string()),
        ("rays of a patch".to_owned(), craft.settings.rays.to_string()),
        ("patches that a patch sees or that reflect".to_owned(), format!("{pairs:.1}")),
        (
            "change of view factors to be reciprocal".to_owned(),
            format!("{:.1e} (rms), at most {:.1e}", correction.rms, correction.largest),
        ),
        ("light of a patch that was left out".to_owned(), format!("at most {returned:.1e}")),
        ("rays to the inner face of a skin".to_owned(), format!("{:.2} %", 100.0 * exchange.factors.inside)),
    ];
    if correction.unclosed > 1e-9 {
        told.push(("rows that do not close".to_owned(), format!("at most {:.1e} of their area", correction.unclosed)));
    }
    told
}
