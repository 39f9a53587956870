//! Radiation between surfaces: what patches of the craft send to each other, and what they reflect of Sun and planet.

pub(crate) mod state;
pub(crate) mod tables;

use self::tables::FindingTables;
use super::thermal::TEMPERATURE;
use super::thermal::variant::ThermalVariant;
use crate::gpu::layout::{self, ExchangePass};
use crate::gpu::pass::{Barrier, COMPUTE, COMPUTE_READ, COMPUTE_WRITE, Frame, Pass, barrier, scope};
use crate::gpu::resource::Pieces::Always;
use crate::gpu::resource::Role::{FromHost, Storage};
use crate::gpu::resource::{PAIRS, Per, Resource, lent, made, resources};
use crate::gpu::scene_data::{ExchangeData, SceneData};
use crate::gpu::shaders::Shader;
use ash::vk::{AccessFlags2 as A, PipelineStageFlags2 as S};

/// A buffer with a number of elements that the exchange gives, if the scene has it.
macro_rules! buffer {
    ($name:literal, $element:expr, $role:expr, $count:expr) => {
        Resource::new($name, $element, $role, Per::Scene, |data| data.exchange.as_ref().map_or(0, $count))
    };
}

resources! {
    /// Patches of the fronts of four nodes, then of their backs.
    NODES = Resource::new("ExchangeNodes", PAIRS, Storage, Per::Node, faces_of)
    .in_pieces(Always)
    .filled(|data| data.exchange.as_ref().map_or_else(Default::default, |exchange| lent(&exchange.tables.nodes)));
    /// `ExchangePatch` of every patch.
    PATCHES = buffer!("ExchangePatches", size_of::<layout::ExchangePatch>(), Storage, places)
        .filled(|data| data.exchange.as_ref().map_or_else(Default::default, |exchange| lent(&exchange.tables.patches)));
    /// Nodes of the patches, and their shares.
    MEMBERS = buffer!("ExchangeMembers", 8, Storage, |exchange| exchange.tables.members.len())
        .filled(|data| data.exchange.as_ref().map_or_else(Default::default, |exchange| lent(&exchange.tables.members)));
    /// `ExchangeRow` of every patch, for each finding.
    ROWS = buffer!("ExchangeRows", size_of::<layout::ExchangeRow>(), Storage, |exchange| of_findings(exchange, exchange.tables.patches.len()))
        .filled(|data| first_finding(data).map_or_else(Default::default, |finding| lent(&finding.rows)));
    /// Rows of the exchange areas of infrared and of sunlight in fours, for each finding.
    ENTRIES = buffer!("ExchangeEntries", 16, Storage, |exchange| of_findings(exchange, exchange.tables.room))
        .filled(|data| first_finding(data).map_or_else(Default::default, |finding| lent(&finding.entries)));
    /// Rows of the poses of the body and of the joints, written by the host.
    POSES = buffer!("ExchangePoses", 48, FromHost, |exchange| exchange.tables.joints).each_slot();
    /// Directions of rays, and whether they are open, for each finding.
    SKY = buffer!("ExchangeSky", 16, Storage, |exchange| of_findings(exchange, exchange.tables.findings[0].sky.len()))
        .filled(|data| first_finding(data).map_or_else(Default::default, |finding| lent(&finding.sky)));
    /// Shares of the planet's infrared and albedo that every patch sees.
    SEEN = buffer!("ExchangeSeen", 8, Storage, places).filled(|data| made(&vec![[1.0f32; 2]; places_of(data)]));
    /// Infrared of the planet and sunlight that every patch reflects at first [W/m2] while they are held, and when they were found.
    REFLECTED =
        buffer!("ExchangeReflected", 16, Storage, places).filled(|data| made(&vec![[0.0f32; 4]; places_of(data)]));
    /// Sunlight from other patches that every patch absorbs [W/m2].
    SUNLIGHT = buffer!("ExchangeSunlight", 4, Storage, places).filled(|data| made(&vec![0.0f32; places_of(data)]));
    /// Rows of the shares of mirrored sunlight, written by the host.
    MIRRORS = buffer!("ExchangeMirrors", 8, FromHost, |exchange| exchange
        .mirrors
        .map_or(0, |mirrors| exchange.tables.patches.len() + mirrors.most_pairs()))
    .each_slot();
    /// Sunlight that every patch mirrors [W/m2].
    MIRRORED = buffer!("ExchangeMirrored", 4, Storage, |exchange| exchange.mirrors.map_or(0, |_| places(exchange)));
    /// Infrared that every patch sends at first [W/m2].
    SENT = buffer!("ExchangeSent", 4, Storage, places);
    /// Infrared that every patch emitted at the last finding, above that of space [W/m2].
    EMITTED = buffer!("ExchangeEmitted", 4, Storage, places).filled(|data| made(&vec![0.0f32; places_of(data)]));
    /// Flux from other patches that every patch absorbs [W/m2], and the share of each that sunlight can reach.
    RECEIVED =
        buffer!("ExchangeReceived", 8, Storage, places).filled(|data| made(&vec![[0.0f32, 1.0]; places_of(data)]));
    /// Neighbours of every patch, and the vectors by which their fluxes count for a gradient.
    NEIGHBOURS = buffer!("ExchangeNeighbours", 16, Storage, |exchange| exchange.tables.neighbours.len())
        .filled(|data| data.exchange.as_ref().map_or_else(Default::default, |exchange| lent(&exchange.tables.neighbours)));
    /// Gradient of the flux over every patch [W/m3].
    GRADIENTS = buffer!("ExchangeGradients", 16, Storage, places);
    /// Ways of the nodes of patches from the centre, and the nodes.
    WAYS = buffer!("ExchangeWays", 16, Storage, |exchange| exchange.tables.ways.len())
        .filled(|data| data.exchange.as_ref().map_or_else(Default::default, |exchange| lent(&exchange.tables.ways)));
    /// Flux from other patches that the fronts of four nodes absorb [W/m2], then their backs.
    ON_NODES = Resource::new("ExchangeOnNodes", PAIRS, Storage, Per::Node, faces_of)
        .filled(|data| made(&vec![[0.0f32; 8]; faces_of(data)]));
}

/// Elements of all findings, each of which has this number.
fn of_findings(exchange: &ExchangeData<'_>, count: usize) -> usize {
    exchange.tables.slots * count
}

fn first_finding<'a>(data: &SceneData<'a>) -> Option<&'a FindingTables> {
    data.exchange.as_ref().map(|exchange| &exchange.tables.findings[0])
}

/// Number of patches, and one for faces without any.
fn places(exchange: &ExchangeData<'_>) -> usize {
    exchange.tables.patches.len() + 1
}

fn places_of(data: &SceneData<'_>) -> usize {
    data.exchange.as_ref().map_or(0, places)
}

fn faces_of(data: &SceneData<'_>) -> usize {
    data.exchange.as_ref().map_or(0, |exchange| exchange.tables.nodes.len())
}

/// Patches of a workgroup.
const WORKGROUP: u32 = 64;

/// What the passes before a thermal step depend on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Exchanged {
    /// Number of patches.
    pub patches: u32,
    /// Bundles of rays that keep the sky of each patch.
    pub bundles: u32,
    /// Variant of a thermal step, which tells the kinds of light.
    pub light: ThermalVariant,
    /// Whether the light of Sun and planet is found anew.
    pub anew: bool,
    /// Whether patches mirror sunlight.
    pub mirrors: bool,
    /// Time for which the last infrared was held [s]. 0 where none came before.
    pub held: f32,
    /// Part of the change since light was found before by which its light goes on.
    pub lead: f32,
    /// Share of the second finding.
    pub share: f32,
    /// Slot of the first finding.
    pub slot: u32,
}

/// The passes before the thermal step.
pub(crate) fn passes(frame: &mut Frame, exchanged: &Exchanged) {
    let Exchanged { patches, bundles, light, anew, mirrors, held, lead, share, slot } = *exchanged;
    let constants = ExchangePass { first: 0, end: patches, rays: bundles, held, lead, patches, share, slot };
    let pass = |entry: &'static str, words: &[(bool, &'static str)]| {
        let shader = Shader::with(entry, words);
        Pass::dispatch(shader.name(), shader, patches.div_ceil(WORKGROUP)).told(&constants)
    };
    // The last frame may still read what it received.
    let free = |resource: &'static Resource| -> Barrier {
        barrier(resource, scope(S::COMPUTE_SHADER, A::SHADER_STORAGE_WRITE), COMPUTE_WRITE)
    };
    let done = |resource: &'static Resource| barrier(resource, COMPUTE_WRITE, COMPUTE_READ);
    let changed = |resource: &'static Resource| barrier(resource, COMPUTE_WRITE, COMPUTE);
    let mirrors = mirrors && light.sun;
    if anew && (light.planet_ir || light.albedo) {
        frame.wait([free(&SEEN)]);
        frame.pass(pass("exchange_sky.comp", &[]));
        frame.wait([done(&SEEN)]);
    }
    if anew && (light.sun || light.planet_ir) {
        frame.wait([Some(changed(&REFLECTED)), mirrors.then(|| free(&MIRRORED))].into_iter().flatten());
        let [lit, by_rays] = light.light.words();
        let words = [
            (light.sun, "sun"),
            (light.planet_ir, "planet_ir"),
            (light.albedo, "albedo"),
            lit,
            by_rays,
            (mirrors, "mirrors"),
        ];
        frame.pass(pass("exchange_light.comp", &words));
        if mirrors {
            frame.wait([changed(&REFLECTED), done(&MIRRORED), free(&SUNLIGHT)]);
            frame.pass(pass("exchange_mirror.comp", &[]));
        }
        frame.wait([done(&REFLECTED)]);
    }
    if anew && light.sun {
        frame.wait([if mirrors { changed(&SUNLIGHT) } else { free(&SUNLIGHT) }]);
        frame.pass(pass("exchange_receive.comp", &[(true, "reflected"), (mirrors, "mirrors")]));
        frame.wait([done(&SUNLIGHT)]);
    }
    frame.wait([done(&TEMPERATURE), free(&SENT), changed(&EMITTED)]);
    frame.pass(pass("exchange_send.comp", &[(light.planet_ir, "planet_ir")]));
    frame.wait([done(&SENT), free(&RECEIVED)]);
    frame.pass(pass("exchange_receive.comp", &[(light.sun, "sun")]));
    frame.wait([done(&RECEIVED), free(&GRADIENTS)]);
    frame.pass(pass("exchange_gradient.comp", &[]));
    frame.wait([done(&GRADIENTS), free(&ON_NODES)]);
    frame.pass(pass("exchange_spread.comp", &[]));
    frame.wait([done(&ON_NODES)]);
}
