//! Radiation between the surfaces of a scene: its patches, and their exchange in a step in f64.

use std::sync::Arc;

use glam::DAffine3;

use super::exchange_poses::{Finding, Posed, PosedState, RowsBetween};
use super::exchange_shared::{ExchangesInUse, RaysOfCraft, SharedRows};
use super::network::{SceneNetwork, light_area};
use crate::environment::StepLoad;
use crate::environment::joints::Joints;
use crate::environment::shadow::Lit;
use crate::exchange::bundles::SkyBundles;
use crate::exchange::cast::Scenery;
use crate::exchange::defects::Defects;
use crate::exchange::hold;
use crate::exchange::jointed_rays::JointedRays;
use crate::exchange::lead::Lead;
use crate::exchange::mirrors::Mirrors;
use crate::exchange::packed::PackedExchange;
use crate::exchange::patches::{PatchSurface, Patches};
use crate::exchange::sky::{Due, LastFound, Renewal};
use crate::exchange::split::NodeViews;
use crate::exchange::step::{CraftLight, Exchange, ExchangeSettings, MOST_PATCHES, PATCHES};
use crate::host::check_memory;
use crate::model::nodes::{GROUP, Nodes, PADDING};
use crate::scene::{Initial, Scene};
use crate::thermal::material::Material;
use crate::thermal::memory::cooling;
use crate::thermal::misfit::{Misfit, check_length};
use crate::thermal::received::FaceLoad;
use crate::trace::span;

/// Most rays of a scene. Their ends take 1 GiB.
pub(crate) const MOST_RAYS: usize = 1 << 28;

/// Part of the redraw angle after which the light of Sun and planet is found anew.
const LIGHT: f64 = 1.0 / 3.0;

/// The surface of a scene and its patches. Nodes are in device order.
#[derive(Debug, Clone)]
pub struct ExchangeCraft {
    /// The nodes and triangles.
    pub surface: PatchSurface,
    /// The patches.
    pub patches: Patches,
    pub(crate) defects: Defects,
    /// How rays and reflections are found.
    pub settings: ExchangeSettings,
    /// The patches that mirror sunlight, where the scene wants it and some do.
    pub mirrors: Option<Arc<Mirrors>>,
    /// Length of a step [s].
    step: f64,
    /// Angle after which the light of Sun and planet is found anew [rad].
    pub light_angle: f64,
    pub(super) in_use: ExchangesInUse,
    rays: RaysOfCraft,
    shared: SharedRows,
    /// The craft with the same patches and other optics whose view factors serve this one too.
    like: Option<Arc<Self>>,
}

impl ExchangeCraft {
    /// Gathers the nodes of a scene with steps of a length [s].
    ///
    /// # Errors
    /// More rays than [`MOST_RAYS`], in words.
    pub(crate) fn new(
        settings: ExchangeSettings,
        step: f64,
        nodes: &Nodes,
        triangles: &[[u32; 3]],
        network: Option<&SceneNetwork>,
        materials: &[Material],
        joints: &Joints,
    ) -> Result<Self, String> {
        let surface = patch_surface(nodes, triangles, network);
        let edge = settings.patch_edge.unwrap_or_else(|| (surface.areas.iter().sum::<f64>() / PATCHES).sqrt());
        let settings = ExchangeSettings { patch_edge: Some(edge), ..settings };
        let check = |count: usize| match count > MOST_PATCHES {
            true => Err(format!(
                "{count} patches are more than {MOST_PATCHES}: state a larger patch_edge, or join parts of the model"
            )),
            false => Ok(()),
        };
        // Rays split patches further, and are cast only where the rest fits.
        check(Patches::new(&surface, materials, edge, &[]).all.len())?;
        let views = NodeViews::new(&surface, materials, &joints.at_ends());
        let patches = Patches::resolved(&surface, materials, edge, &views);
        check(patches.all.len())?;
        let rays = patches.all.len().saturating_mul(settings.rays as usize);
        if rays > MOST_RAYS {
            return Err(format!(
                "{} patches of {} rays are more than {MOST_RAYS} rays: state a larger patch_edge or fewer rays",
                patches.all.len(),
                settings.rays
            ));
        }
        let what = || format!("exchange of {} patches with {} rays each", patches.all.len(), settings.rays);
        check_memory((rays * size_of::<u32>()) as u64, what).map_err(|error| error.to_string())?;
        let cooling = patches.all.iter().map(|patch| patch.cooling);
        let hold = settings.hold.unwrap_or_else(|| hold::chosen(cooling, views.together, step));
        let settings = ExchangeSettings { hold: Some(hold), ..settings };
        let mirrors = settings.specular_sunlight.then(|| Mirrors::new(&surface, &patches, settings.rays)).flatten();
        Ok(Self {
            defects: Defects::of(&surface, materials),
            step,
            light_angle: LIGHT * settings.redraw_angle,
            mirrors: mirrors.map(Arc::new),
            surface,
            patches,
            settings,
            in_use: ExchangesInUse::default(),
            rays: RaysOfCraft::default(),
            shared: SharedRows::default(),
            like: None,
        })
    }

    /// The same craft with the optics of materials. Where these are the same, it is this craft.
    pub(crate) fn with_optics(self: &Arc<Self>, materials: &[Material]) -> Arc<Self> {
        let mut patches = self.patches.clone();
        for patch in Arc::make_mut(&mut patches.all) {
            let material = &materials[patch.material as usize];
            patch.optics = if patch.back { material.back() } else { material.front };
            patch.cooling = cooling(material);
        }
        if patches.all == self.patches.all {
            return Arc::clone(self);
        }
        Arc::new(Self { patches, like: Some(Arc::clone(self)), ..(**self).clone() })
    }

    /// Time for which infrared is held [s]: whole steps or whole parts of a step.
    pub(crate) fn held_time(&self) -> f64 {
        let part = self.longest_part();
        (self.hold() / part).floor().max(1.0) * part
    }

    /// Longest part in which a step is taken, so that infrared is held for no longer [s].
    pub(crate) fn longest_part(&self) -> f64 {
        hold::longest_part(self.hold(), self.step)
    }

    /// Most time for which infrared is held, or 0 for none [s].
    fn hold(&self) -> f64 {
        self.settings.hold.unwrap_or_default()
    }

    /// Warnings for the user before the run.
    pub(crate) fn warnings(&self) -> Vec<String> {
        let mut warnings = self.defects.warnings();
        if self.settings.specular_sunlight && self.mirrors.is_none() {
            warnings.push("[exchange]: specular_sunlight changes nothing, because no material of the craft states 'specular' above 0.".to_owned());
        }
        warnings
    }

    /// The rule for when the exchange between patches is found anew.
    pub(crate) fn renewal(&self) -> Renewal {
        Renewal::new(self.light_angle, self.hold() / self.step, self.step)
    }

    /// The exchange between the patches in a pose, found by the processor. An engine and its check share the exchange of a pose, because the same function would
    /// find the same again.
    pub(super) fn find(&self, poses: &[DAffine3]) -> Arc<PackedExchange> {
        self.in_use.get_or_make(poses, || match &self.like {
            Some(like) if self.has_optics_of(like) => like.find(poses).with_patches(&self.patches.all),
            Some(like) => PackedExchange::new(like.cast(poses).with_optics(&self.patches, self.settings.bounces)),
            None => PackedExchange::new(self.cast_anew(poses)),
        })
    }

    fn has_optics_of(&self, other: &Self) -> bool {
        let optics = |craft: &Self| craft.patches.all.iter().map(|patch| patch.optics).collect::<Vec<_>>();
        optics(self) == optics(other)
    }

    fn cast_anew(&self, poses: &[DAffine3]) -> Exchange {
        let Self { surface, patches, settings, .. } = self;
        let jointed = || {
            let _prepares = span("preparing the rays");
            JointedRays::new(surface, patches, settings.rays)
        };
        // Without poses nothing ever moves.
        match if poses.is_empty() { &None } else { self.rays.jointed.get_or_init(jointed) } {
            Some(rays) => {
                let ends = rays.cast(surface, patches, poses);
                Exchange::of_bundles(self.bundles(), patches, &ends, settings)
            }
            None => Exchange::cast(surface, patches, &Scenery::new(surface, poses), settings),
        }
    }

    /// The bundles of rays that keep the sky in all poses.
    pub(super) fn bundles(&self) -> &SkyBundles {
        self.rays.bundles.get_or_init(|| {
            let _prepares = span("preparing the rays");
            SkyBundles::new(&self.surface, &self.patches, self.settings.rays)
        })
    }

    /// Lets others use the rows that an engine uses now.
    pub(super) fn share(&self, posed: &Posed<Exchange>) {
        self.shared.share(posed.rows(), posed.held());
    }

    /// The exchange between two poses, without view factors between patches, or in a pose. A check has the rows of its engine, because the same function would find the
    /// same again.
    pub(super) fn between(&self, rows: &RowsBetween) -> Arc<Exchange> {
        if rows.from == rows.to {
            return self.cast(&rows.from);
        }
        self.shared.get(rows).unwrap_or_else(|| {
            let [from, to] = [&rows.from, &rows.to].map(|poses| self.find(poses).unpack_rows());
            let _means = span("rows between two poses");
            Arc::new(from.at(&to, rows.share))
        })
    }

    /// The exchange that [`Self::find`] finds.
    pub fn cast(&self, poses: &[DAffine3]) -> Arc<Exchange> {
        Arc::new(self.find(poses).unpack())
    }
}

impl Finding for Exchange {
    type Packed = PackedExchange;

    fn at(&self, other: &Self, share: f64) -> Self {
        self.at(other, share)
    }

    fn share_to_hold(&self, other: &Self) -> f64 {
        self.share_to_hold(other)
    }

    fn bends(&self, others: [&Self; 2], ratio: f64) -> bool {
        self.bends(others, ratio)
    }

    fn unpack(packed: &Arc<PackedExchange>) -> Self {
        packed.unpack_rows()
    }

    fn bytes(packed: &PackedExchange) -> usize {
        packed.bytes()
    }
}

/// The exchange of a scene in f64, step by step.
#[derive(Debug, Clone)]
pub(crate) struct ExchangeTwin {
    craft: Arc<ExchangeCraft>,
    found: Posed<Exchange>,
    renewal: Renewal,
    light: CraftLight,
    lead: Lead,
    /// Infrared that patches absorb [W/m2].
    absorbed: Vec<f64>,
}

impl ExchangeTwin {
    /// An exchange whose rays are cast for poses first.
    pub(crate) fn new(craft: &Arc<ExchangeCraft>, poses: &[DAffine3]) -> Self {
        let mut twin = Self {
            craft: Arc::clone(craft),
            found: Posed::new(craft.settings.redraw_angle),
            renewal: craft.renewal(),
            light: CraftLight::default(),
            lead: Lead::default(),
            absorbed: Vec::new(),
        };
        twin.turn(poses);
        twin
    }

    /// Follows the joints. Returns whether other rows hold than before.
    fn turn(&mut self, poses: &[DAffine3]) -> bool {
        let craft = &self.craft;
        let turned = self.found.turn(poses, &mut |poses| craft.find(poses)).is_some();
        craft.share(&self.found);
        turned
    }

    /// Poses between which the rows that hold lie.
    pub(crate) fn rows(&self) -> Option<RowsBetween> {
        self.found.rows()
    }

    /// The exchange between the patches in the present pose.
    pub(crate) fn exchange(&self) -> Option<&Exchange> {
        self.found.found().map(|found| &**found)
    }

    /// What every patch absorbs from the others in a load that lasts `steps` [W/m2]. `temperature` [K] is a function of the node, and `lit` has the lit area of each.
    pub(crate) fn absorbed(
        &mut self,
        load: &StepLoad,
        steps: f64,
        temperature: impl Fn(usize) -> f64 + Sync,
        lit: &Lit,
    ) -> Vec<f64> {
        if self.turn(&load.joints) {
            self.renewal.new_rows();
        }
        let Some(exchange) = self.found.found() else { return Vec::new() };
        let due = self.renewal.due(load, steps, self.light.planet_shares.is_empty());
        if due == Due::All {
            let mirrored = self.craft.mirrors.as_ref().map(|mirrors| mirrors.mirrored(load));
            self.light = exchange.light_ahead(load, lit, mirrored.as_ref(), (&self.light, self.renewal.last.lead));
        }
        if due > Due::Nothing {
            let sent = self.lead.sent(exchange, load, &self.light, temperature, self.renewal.held);
            self.absorbed = exchange.absorbed(&sent, &self.light);
        }
        self.absorbed.clone()
    }

    /// The light on the faces of every node in a load that lasts `steps`. `temperature` [K] is a function of the node, and `lit` has the lit area of each.
    pub(crate) fn received(
        &mut self,
        load: &StepLoad,
        steps: f64,
        temperature: impl Fn(usize) -> f64 + Sync,
        lit: &Lit,
    ) -> Vec<[FaceLoad; 2]> {
        let absorbed = self.absorbed(load, steps, temperature, lit);
        self.of_nodes(&absorbed)
    }

    /// The light on the faces of every node, where patches absorb this infrared [W/m2].
    pub(crate) fn of_nodes(&self, absorbed: &[f64]) -> Vec<[FaceLoad; 2]> {
        let Some(exchange) = self.found.found() else { return Vec::new() };
        exchange.of_nodes(absorbed, &self.light.planet_shares)
    }

    pub(crate) fn save(&self) -> ExchangeTwinState {
        ExchangeTwinState {
            found: self.found.save(),
            last: self.renewal.last.clone(),
            light: self.light.clone(),
            lead: self.lead.clone(),
            absorbed: self.absorbed.clone(),
        }
    }

    /// Restores a saved state.
    ///
    /// # Errors
    /// A state of other patches.
    pub(crate) fn restore(&mut self, saved: &ExchangeTwinState) -> Result<(), Misfit> {
        let patches = self.craft.patches.all.len();
        saved.light.check_patches(patches)?;
        saved.lead.check_patches(patches)?;
        if !saved.absorbed.is_empty() {
            check_length("light that patches absorb", &saved.absorbed, patches)?;
        }
        let craft = &self.craft;
        self.found.restore(&saved.found, &mut |poses| craft.find(poses));
        self.renewal.last.clone_from(&saved.last);
        self.light.clone_from(&saved.light);
        self.lead.clone_from(&saved.lead);
        self.absorbed.clone_from(&saved.absorbed);
        Ok(())
    }
}

fn patch_surface(nodes: &Nodes, triangles: &[[u32; 3]], network: Option<&SceneNetwork>) -> PatchSurface {
    let slots = 0..nodes.vertex_of_node.len();
    let area = |slot: usize| light_area(network, nodes, slot);
    let joint = |slot: usize| if nodes.vertex_of_node[slot] == PADDING { 0 } else { nodes.joint(slot) };
    PatchSurface {
        positions: nodes.positions.iter().map(|position| position.as_dvec3()).collect(),
        normals: nodes.normals.iter().map(|normal| normal.as_dvec3()).collect(),
        areas: slots.clone().map(area).collect(),
        parts: slots.clone().map(|slot| nodes.group_part[slot / GROUP]).collect(),
        materials: slots.clone().map(|slot| nodes.group_material[slot / GROUP]).collect(),
        joints: slots.map(joint).collect(),
        // The triangles between the runs of joints have no area.
        triangles: triangles.iter().copied().filter(|[a, b, c]| a != b && b != c).collect(),
    }
}

/// Warnings about a surface that misleads rays between surfaces, or rays to the Sun where there is no exchange, and about a start without neighbours.
pub(super) fn surface_warnings(
    scene: &Scene,
    exchange: Option<&ExchangeCraft>,
    (nodes, triangles, materials): (&Nodes, &[[u32; 3]], &[Material]),
) -> Vec<String> {
    match exchange {
        Some(craft) => craft.warnings().into_iter().chain(start_warning(scene)).collect(),
        None if scene.shadows.is_none() => Vec::new(),
        None => Defects::of(&patch_surface(nodes, triangles, None), materials).of_shadows(),
    }
}

/// Warns of a start without neighbours in a scene whose surfaces warm each other, where the scene states no start.
fn start_warning(scene: &Scene) -> Option<String> {
    (scene.initial == Initial::Balance && scene.time.warm_up_assumed).then(|| {
        "[exchange]: without --from-state, every surface starts in balance with Sun, planet and space alone: one that faces others starts too cold, and one in a cavity near 0 K. State \
         warm_up = \"periodic\" in [time], or a temperature in [initial]"
            .to_owned()
    })
}

/// The saved state of an exchange.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(crate) struct ExchangeTwinState {
    found: PosedState,
    last: LastFound,
    light: CraftLight,
    lead: Lead,
    absorbed: Vec<f64>,
}

/// Light that meets inner faces, in words: its share, and the number and area [m2] of patches inside other parts.
pub(crate) fn inside(share: f64, (count, area): (usize, f64)) -> String {
    let buried = if count == 0 {
        String::new()
    } else {
        format!("; {count} patches of {area:.2} m2 lie inside other parts and exchange nothing")
    };
    format!("{:.2} %{buried}", 100.0 * share)
}

/// The facts of a craft's exchange, in words.
pub(crate) fn describe(craft: &ExchangeCraft, exchange: &Exchange) -> Vec<(String, String)> {
    let correction = exchange.factors.correction;
    let per_patch = |entries: usize| entries as f64 / exchange.patches.len().max(1) as f64;
    let [infrared, sunlight] =
        [&exchange.infrared, &exchange.for_light.sunlight].map(|areas| per_patch(areas.between.entries.len()));
    let returned = exchange.infrared.returned.max(exchange.for_light.sunlight.returned);
    let mut told = vec![
        ("patches".to_owned(), exchange.patches.len().to_string()),
        ("rays of a patch".to_owned(), craft.settings.rays.to_string()),
        (
            "patches that a patch exchanges with".to_owned(),
            format!("{infrared:.1} in infrared, {sunlight:.1} in sunlight"),
        ),
        (
            "change of view factors to be reciprocal".to_owned(),
            format!("{:.1e} (rms), at most {:.1e}", correction.rms, correction.largest),
        ),
        ("light of a patch that was left out".to_owned(), format!("at most {returned:.1e}")),
        (
            "light that meets the inner face of a skin".to_owned(),
            inside(exchange.factors.inside_share(), exchange.factors.buried()),
        ),
    ];
    if correction.unclosed > 1e-9 {
        told.push(("rows that do not close".to_owned(), format!("at most {:.1e} of their area", correction.unclosed)));
    }
    told
}

#[cfg(test)]
pub(super) mod tests;
