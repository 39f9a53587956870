//! Radiation between the surfaces of a scene on a device: its tables follow the joints.

use std::sync::Arc;

use glam::DAffine3;

use super::exchange::{ExchangeCraft, inside};
use super::exchange_poses::{Posed, PosedState, RowsBetween};
use crate::exchange::step::Exchange;
use crate::gpu::effects::exchange::tables::ExchangeTables;
use crate::thermal::received::FaceLoad;
use crate::trace::span;

/// Share of the rays of a patch beyond which a joint has moved it into another part.
const COVERED: f32 = 0.1;

/// Tables of a scene for the poses of its joints.
pub(super) struct DeviceExchange {
    craft: Arc<ExchangeCraft>,
    posed: Posed<Exchange>,
    tables: ExchangeTables,
    /// Changes of the open sky of patches as rows changed.
    changes: Changes,
    /// Share of the rays of each patch that met an inner face in the first poses.
    inner: Vec<f32>,
    /// Most patches that joints have moved into another part, and their area [m2].
    covered: (usize, f64),
}

/// How much the open sky of patches has changed from rows to the next.
#[derive(Debug, Clone, Copy, Default)]
struct Changes {
    times: u32,
    /// Largest root mean square over the patches.
    rms: f64,
    largest: f64,
}

impl DeviceExchange {
    /// The tables for the first poses.
    pub(crate) fn new(craft: &Arc<ExchangeCraft>, poses: &[DAffine3]) -> Self {
        let mut posed = Posed::new(craft.settings.redraw_angle);
        let found = posed.turn(poses, &mut |poses| craft.find(poses));
        let tables = found.map(|exchange| ExchangeTables::new(exchange, poses.len() > 1)).unwrap_or_default();
        Self {
            craft: Arc::clone(craft),
            posed,
            inner: tables.inner.clone(),
            tables,
            changes: Changes::default(),
            covered: (0, 0.0),
        }
    }

    /// The tables that hold now.
    pub(crate) fn tables(&self) -> &ExchangeTables {
        &self.tables
    }

    /// Poses between which the rows that hold lie.
    pub(crate) fn rows(&self) -> Option<RowsBetween> {
        self.posed.rows()
    }

    /// The light on the two faces of every node, from the light on every patch.
    pub(crate) fn of_nodes(&self, patches: &[FaceLoad]) -> Vec<[FaceLoad; 2]> {
        self.posed.found().map_or_else(Vec::new, |exchange| exchange.spread(patches))
    }

    /// Infrared that nodes absorb from each other [W/m2], if each emits like a black body of this flux [W/m2]. Computed by the host.
    pub(crate) fn exchanged_infrared(&self, black: &[f64]) -> Vec<f64> {
        self.posed.found().map(|exchange| exchange.exchanged_infrared(black)).unwrap_or_default()
    }

    /// Follows the joints. Returns tables where others hold than before, or where light is found that the last ones do not serve. `finds_light` tells whether light is
    /// found with rows that are new or not.
    pub(crate) fn turn(
        &mut self,
        poses: &[DAffine3],
        finds_light: impl FnOnce(bool) -> bool,
    ) -> Option<&ExchangeTables> {
        let craft = &self.craft;
        let is_new = self.posed.turn(poses, &mut |poses| craft.find(poses)).is_some();
        craft.share(&self.posed);
        let for_light = finds_light(is_new);
        if !is_new && (self.tables.for_light || !for_light) {
            return None;
        }
        let now = self.posed.found()?;
        let _orders = span("ordering the exchange");
        let before = std::mem::take(&mut self.tables.open);
        self.tables.renew(now, for_light);
        if !is_new {
            return Some(&self.tables);
        }
        self.changes.take(&before, &self.tables.open);
        let covered = covered(craft, [&self.inner, &self.tables.inner]);
        self.covered = if covered.1 > self.covered.1 { covered } else { self.covered };
        Some(&self.tables)
    }

    /// The facts of the exchange, and of the rays that followed joints, in words.
    pub(crate) fn description(&self) -> Vec<(String, String)> {
        let of_tables = |tables: &ExchangeTables| {
            let per_patch = 4.0 * tables.entries.len() as f64 / tables.order.len().max(1) as f64;
            [
                ("entries of a patch, infrared and sunlight".to_owned(), format!("{per_patch:.0}")),
                ("light that meets the inner face of a skin".to_owned(), inside(tables.inside.0, tables.inside.1)),
            ]
        };
        let mut told: Vec<_> = of_tables(&self.tables).into();
        if self.posed.stalest <= 1e-9 {
            return told;
        }
        told.push((
            "poses for which rays were cast".to_owned(),
            format!("{}, {:.2} deg apart at most", self.posed.made, self.craft.settings.redraw_angle.to_degrees()),
        ));
        let Changes { times, rms, largest } = self.changes;
        told.push((
            "turn of a joint against the rows in use".to_owned(),
            format!("at most {:.2} deg", self.posed.stalest.to_degrees()),
        ));
        if times > 0 {
            told.push((
                "change of the open sky of a patch where rows changed".to_owned(),
                format!("{times} times, at most {rms:.1e} (rms over patches), {largest:.1e} of a patch"),
            ));
        }
        let (count, area) = self.covered;
        if count > 0 {
            let text =
                format!("at most {count} of {area:.2} m2; the rays that meet inner faces bring them their own light");
            told.push(("patches that joints moved into other parts, by a tenth or more".to_owned(), text));
        }
        told
    }

    /// The poses, without their tables.
    pub(crate) fn save(&self) -> PosedState {
        self.posed.save()
    }

    /// Restores a saved state. Returns the tables that held then.
    pub(crate) fn restore(&mut self, saved: &PosedState) -> Option<&ExchangeTables> {
        let craft = &self.craft;
        let now = self.posed.restore(saved, &mut |poses| craft.find(poses))?;
        self.tables.renew(now, true);
        Some(&self.tables)
    }
}

impl Changes {
    fn take(&mut self, before: &[f32], now: &[f32]) {
        let change = |(before, now): (&f32, &f32)| f64::from((before - now).abs());
        let changes = before.iter().zip(now).map(change);
        let squares: f64 = changes.clone().map(|change| change * change).sum();
        self.times += 1;
        self.rms = self.rms.max((squares / before.len().max(1) as f64).sqrt());
        self.largest = changes.fold(self.largest, f64::max);
    }
}

/// Patches of which a tenth more rays meet inner faces than before, and their area [m2].
fn covered(craft: &ExchangeCraft, [before, now]: [&[f32]; 2]) -> (usize, f64) {
    let shares = before.iter().zip(now).zip(craft.patches.all.iter());
    let more = shares.filter(|((before, now), _)| **now > **before + COVERED);
    more.fold((0, 0.0), |(count, area), (_, patch)| (count + 1, area + patch.area))
}
