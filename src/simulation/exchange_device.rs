//! Radiation between the surfaces of a scene on a device: rays for poses of the joints, a share of them in each step.

use std::sync::Arc;
use std::thread::JoinHandle;

use glam::DAffine3;

use super::exchange::{ExchangeCraft, inside};
use super::exchange_poses::{Posed, PosedState, Task};
use crate::exchange::cast::Scenery;
use crate::exchange::step::Exchange;
use crate::gpu::context::Context;
use crate::gpu::effects::exchange::tables::ExchangeTables;
use crate::gpu::error::GpuError;
use crate::gpu::exchange_rays::{self, Caster};

/// Share of the rays of a patch beyond which a joint has moved it into another part.
const COVERED: f32 = 0.1;

/// Tables of a scene for the poses of its joints.
pub(super) struct DeviceExchange {
    craft: Arc<ExchangeCraft>,
    context: Arc<Context>,
    posed: Posed<ExchangeTables>,
    work: Option<CastingWork>,
    /// Changes of the open sky of patches as rays were cast anew.
    changes: Changes,
    /// Share of the rays of each patch that met an inner face in the first poses.
    inner: Vec<f32>,
    /// Most patches that joints have moved into another part, and their area [m2].
    covered: (usize, f64),
}

/// Rays that are being cast for a pose.
struct CastingWork {
    scenery: Scenery,
    caster: Option<Caster>,
    ends: Vec<u32>,
    solved: Option<JoinHandle<ExchangeTables>>,
}

/// How much the open sky of patches has changed from one casting of rays to the next.
#[derive(Debug, Clone, Copy, Default)]
struct Changes {
    times: u32,
    /// Largest root mean square over the patches of a casting.
    rms: f64,
    largest: f64,
}

impl DeviceExchange {
    /// The tables for the first poses.
    ///
    /// # Errors
    /// Buffers beyond the device, or a call that fails.
    pub(crate) fn new(
        context: &Arc<Context>,
        craft: &Arc<ExchangeCraft>,
        poses: &[DAffine3],
    ) -> Result<Self, GpuError> {
        let posed = Posed::new(craft.settings.redraw_angle, craft.shares());
        let (craft, context) = (Arc::clone(craft), Arc::clone(context));
        let mut own = Self {
            craft,
            context,
            posed,
            work: None,
            changes: Changes::default(),
            inner: Vec::new(),
            covered: (0, 0.0),
        };
        own.turn(poses, true)?;
        own.inner = own.tables().map(|tables| tables.inner.clone()).unwrap_or_default();
        Ok(own)
    }

    /// The tables that hold now.
    pub(crate) fn tables(&self) -> Option<&ExchangeTables> {
        self.posed.found()
    }

    /// Poses for which the rays that hold were cast.
    pub(crate) fn poses(&self) -> Option<&[DAffine3]> {
        self.posed.poses()
    }

    /// Follows the joints, `at_once` or by shares of the work. Returns tables where others hold than before.
    ///
    /// # Errors
    /// Buffers beyond the device, or a call that fails.
    pub(crate) fn turn(&mut self, poses: &[DAffine3], at_once: bool) -> Result<Option<&ExchangeTables>, GpuError> {
        let before = self.posed.found().map(|tables| tables.open.clone());
        let (craft, context, work) = (&self.craft, &self.context, &mut self.work);
        let turned = self.posed.turn::<GpuError>(poses, at_once, &mut |task| match task {
            Task::Whole(poses) => Ok(Some(cast(context, craft, poses)?)),
            Task::Share(poses, number) => {
                let work = match work {
                    Some(work) => work,
                    None => work.insert(CastingWork::new(context, craft, poses)?),
                };
                work.share(craft, number)?;
                Ok(None)
            }
            Task::Take(poses) => match work.take() {
                Some(work) => Ok(Some(work.take(craft))),
                // A restored run has the poses, but not the rays.
                None => Ok(Some(cast(context, craft, poses)?)),
            },
        })?;
        if let (Some(before), Some(now)) = (before, turned) {
            self.changes.take(&before, &now.open);
            let covered = covered(craft, [&self.inner, &now.inner]);
            self.covered = if covered.1 > self.covered.1 { covered } else { self.covered };
        }
        Ok(turned)
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
        let mut told: Vec<_> = self.tables().map(of_tables).into_iter().flatten().collect();
        if self.posed.stalest <= 1e-9 {
            return told;
        }
        let Changes { times, rms, largest } = self.changes;
        told.push((
            "turn of a joint since its rays were cast".to_owned(),
            format!("at most {:.2} deg", self.posed.stalest.to_degrees()),
        ));
        if times > 0 {
            told.push((
                "change of the open sky of a patch where rays were cast anew".to_owned(),
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
    ///
    /// # Errors
    /// As for `turn`.
    pub(crate) fn restore(&mut self, saved: &PosedState) -> Result<Option<&ExchangeTables>, GpuError> {
        self.work = None;
        let (craft, context) = (&self.craft, &self.context);
        self.posed.restore(saved, |poses| cast(context, craft, poses))
    }
}

impl CastingWork {
    fn new(context: &Arc<Context>, craft: &ExchangeCraft, poses: &[DAffine3]) -> Result<Self, GpuError> {
        let scenery = Scenery::new(&craft.surface, poses);
        let casts = || Caster::new(context, &craft.surface, &craft.patches, &scenery, craft.settings.rays);
        let caster = exchange_rays::can_walk(&scenery).then(casts).transpose()?;
        Ok(Self { scenery, caster, ends: Vec::new(), solved: None })
    }

    /// Casts a share of the rays. After the last share a thread computes the tables from the rays.
    fn share(&mut self, craft: &Arc<ExchangeCraft>, number: u32) -> Result<(), GpuError> {
        // Work that a restored run has begun anew casts the shares before too.
        let rays = craft.settings.rays;
        let first = (self.ends.len() / rays.max(1) as usize) as u32;
        let of = first..craft.patches_of_share(number).end;
        let ends = match &mut self.caster {
            Some(caster) => caster.ends(of)?,
            None => crate::exchange::cast::cast_rays(&craft.surface, &craft.patches, &self.scenery, rays, of),
        };
        self.ends.extend(ends);
        if number + 1 == craft.shares() {
            self.caster = None;
            let (craft, ends) = (Arc::clone(craft), std::mem::take(&mut self.ends));
            self.solved = Some(std::thread::spawn(move || solve(&craft, &ends)));
        }
        Ok(())
    }

    /// The result. A thread that is not done is waited for.
    fn take(self, craft: &ExchangeCraft) -> ExchangeTables {
        let Self { solved, scenery, .. } = self;
        let solved = solved.and_then(|thread| thread.join().ok());
        solved.unwrap_or_else(|| {
            let exchange = Exchange::cast(&craft.surface, &craft.patches, &scenery, &craft.settings);
            ExchangeTables::new(&exchange, true)
        })
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
    let shares = before.iter().zip(now).zip(&craft.patches.all);
    let more = shares.filter(|((before, now), _)| **now > **before + COVERED);
    more.fold((0, 0.0), |(count, area), (_, patch)| (count + 1, area + patch.area))
}

fn solve(craft: &ExchangeCraft, ends: &[u32]) -> ExchangeTables {
    ExchangeTables::new(&Exchange::new(&craft.surface, &craft.patches, ends, &craft.settings), true)
}

/// Casts the rays of all patches, on the device where it can walk their tree.
fn cast(context: &Arc<Context>, craft: &ExchangeCraft, poses: &[DAffine3]) -> Result<ExchangeTables, GpuError> {
    let scenery = Scenery::new(&craft.surface, poses);
    let (surface, patches, settings) = (&craft.surface, &craft.patches, &craft.settings);
    if exchange_rays::can_walk(&scenery) {
        return Ok(solve(craft, &exchange_rays::cast(context, surface, patches, &scenery, settings.rays)?));
    }
    Ok(ExchangeTables::new(&Exchange::cast(surface, patches, &scenery, settings), true))
}
