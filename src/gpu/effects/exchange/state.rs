//! What a renderer keeps of radiation between surfaces: the order of patches, and when what they exchange is found anew.

use std::sync::Arc;

use super::Exchanged;
use super::tables::places_of;
use crate::environment::StepLoad;
use crate::exchange::mirrors::{Mirrored, Mirrors};
use crate::exchange::sky::{Due, Renewal};
use crate::gpu::effects::thermal::variant::ThermalVariant;
use crate::gpu::layout;
use crate::gpu::scene_data::ExchangeData;

/// What a renderer keeps of the tables.
pub(crate) struct Exchanging {
    bundles: u32,
    joints: usize,
    /// Patch at each place of the device.
    pub(crate) order: Vec<u32>,
    pub(crate) room: usize,
    pub(crate) renewal: Renewal,
    /// Share of the second finding, and the slot of the first.
    pub(crate) share: (f32, u32),
    /// Whether all must be found anew, whatever the angle and the time.
    pub(crate) fresh: bool,
    /// Rows of the poses that the next frame needs.
    pub(crate) poses: Vec<[[f32; 4]; 3]>,
    /// The patches that mirror sunlight.
    mirrors: Option<Arc<Mirrors>>,
    /// Rows of mirrored sunlight that the next frame needs.
    pub(crate) mirrored: Vec<[u32; 2]>,
}

impl Exchanging {
    /// The state before the first step.
    pub(crate) fn new(data: &ExchangeData) -> Self {
        let ExchangeData { tables, renewal, mirrors } = data;
        Self {
            bundles: tables.bundles,
            joints: tables.joints,
            order: tables.order.clone(),
            room: tables.room,
            renewal: renewal.clone(),
            share: tables.share(),
            fresh: true,
            poses: Vec::new(),
            mirrors: mirrors.cloned(),
            mirrored: Vec::new(),
        }
    }

    /// What the passes find under a load that lasts `steps`. `None` where the earlier results still hold.
    pub(crate) fn due(&mut self, light: ThermalVariant, load: &StepLoad, steps: f64) -> Option<Exchanged> {
        let due = self.renewal.due(load, steps, std::mem::take(&mut self.fresh));
        if due == Due::Nothing {
            return None;
        }
        if due == Due::All {
            let pose = |joint: usize| layout::rows(&load.joints.get(joint).copied().unwrap_or_default());
            self.poses = (0..self.joints).map(pose).collect();
            let mirrors = self.mirrors.as_ref().filter(|_| light.sun);
            self.mirrored = mirrors.map(|mirrors| rows(&mirrors.mirrored(load), &self.order)).unwrap_or_default();
        }
        Some(self.exchanged(light, due == Due::All))
    }

    /// What the passes find under a light, `anew` or where the light of Sun and planet holds.
    pub(crate) fn exchanged(&self, light: ThermalVariant, anew: bool) -> Exchanged {
        let patches = self.order.len() as u32;
        Exchanged {
            patches,
            bundles: self.bundles,
            light,
            anew,
            mirrors: self.mirrors.is_some(),
            held: self.renewal.held as f32,
            lead: self.renewal.last.lead as f32,
            share: self.share.0,
            slot: self.share.1,
        }
    }

    /// Number of patches, and one for faces without any.
    pub(crate) fn places(&self) -> usize {
        self.order.len() + 1
    }
}

/// Rows of mirrored sunlight in the order of the device: the pairs of each patch by their first and the one after the last, then all pairs.
fn rows(mirrored: &Mirrored, order: &[u32]) -> Vec<[u32; 2]> {
    let places = places_of(order);
    let mut rows = vec![[0; 2]; order.len()];
    for (place, patch) in order.iter().enumerate() {
        let first = rows.len() as u32;
        let pair = |(from, share): &(u32, f64)| [places[*from as usize], (*share as f32).to_bits()];
        rows.extend(mirrored.arrives.row(*patch as usize).iter().map(pair));
        rows[place] = [first, rows.len() as u32];
    }
    rows
}
