//! Radiation between the surfaces of a scene on a device: its tables follow the joints.

use std::sync::Arc;

use glam::DAffine3;

use super::exchange::{ExchangeCraft, inside};
use super::exchange_poses::{FindingPair, Posed, PosedState, RowsBetween};
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
    /// Numbers of the findings in the tables.
    findings: [Option<u64>; 2],
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
        let first = found.map(|held| held.from.0);
        let tables = found.map(|held| ExchangeTables::new(&held.from.1, poses.len() > 1)).unwrap_or_default();
        Self {
            craft: Arc::clone(craft),
            posed,
            inner: tables.findings[0].inner.clone(),
            tables,
            findings: [first, None],
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

    /// Follows the joints. Returns which findings of the tables are new, where other rows hold than before.
    pub(crate) fn turn(&mut self, poses: &[DAffine3]) -> Option<[bool; 2]> {
        let craft = Arc::clone(&self.craft);
        let held = self.posed.turn(poses, &mut |poses| craft.find(poses)).cloned();
        craft.share(&self.posed);
        let held = held?;
        let before = self.tables.mean(|finding| &finding.open);
        let new = self.take(&held);
        self.changes.take(&before, &self.tables.mean(|finding| &finding.open));
        let covered = covered(&craft, [&self.inner, &self.tables.mean(|finding| &finding.inner)]);
        self.covered = if covered.1 > self.covered.1 { covered } else { self.covered };
        Some(new)
    }

    /// Takes a pair into the tables. A finding that is there already stays in its place. Returns which are new.
    fn take(&mut self, held: &FindingPair<Exchange>) -> [bool; 2] {
        let FindingPair { from, to, share, .. } = held;
        let place = |number: u64| self.findings.iter().position(|own| *own == Some(number));
        let first = place(from.0).unwrap_or_else(|| place(to.0).map_or(0, |place| 1 - place));
        let second = if from.0 == to.0 { first } else { 1 - first };
        (self.tables.slot, self.tables.share) = (first, *share);
        let mut new = [false; 2];
        for (slot, (number, exchange)) in [(first, from), (second, to)] {
            if self.findings[slot] != Some(*number) {
                let _orders = span("ordering the exchange");
                self.tables.renew(slot, exchange);
                (self.findings[slot], new[slot]) = (Some(*number), true);
            }
        }
        new
    }

    /// The facts of the exchange, and of the rays that followed joints, in words.
    pub(crate) fn description(&self) -> Vec<(String, String)> {
        let of_tables = |tables: &ExchangeTables| {
            let finding = &tables.findings[tables.slot];
            let per_patch = 4.0 * finding.entries.len() as f64 / tables.order.len().max(1) as f64;
            let (share, buried) = finding.inside;
            [
                ("entries of a patch, infrared and sunlight".to_owned(), format!("{per_patch:.0}")),
                ("light that meets the inner face of a skin".to_owned(), inside(share, buried)),
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

    /// Restores a saved state. Returns which findings of the tables are new.
    pub(crate) fn restore(&mut self, saved: &PosedState) -> Option<[bool; 2]> {
        let craft = Arc::clone(&self.craft);
        let held = Arc::clone(self.posed.restore(saved, &mut |poses| craft.find(poses))?);
        // Numbers of another run are of other findings.
        self.findings = [None; 2];
        Some(self.take(&held))
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
