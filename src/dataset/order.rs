//! How a data set is made, and the work that was done.

use std::path::Path;

use super::orbit::Rejections;
use super::scene_values::SceneText;
use super::spec::Spec;
use super::split::split_of;
use super::store::Begin;
use crate::labels::image::Split;
use crate::simulation::target::Target;

/// One of several parts of a data set: the orbits j with j mod `of` = `index`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    /// Number of the shard, from 0.
    pub index: u64,
    /// Number of the shards.
    pub shards: u64,
}

impl Shard {
    /// The orbits of the shard.
    pub(crate) fn orbits(self, spec: &Spec) -> impl Iterator<Item = u64> + use<> {
        (self.index..spec.orbits()).step_by(self.shards as usize)
    }
}

/// The work that was done.
#[derive(Debug, Clone, Default)]
pub struct DatasetSummary {
    /// Images that were drawn.
    pub images: u64,
    /// Orbits that were run.
    pub orbits: u64,
    /// Orbits that were there before.
    pub kept: u64,
    /// Bytes that were written.
    pub bytes: u64,
    /// Rejected attempts.
    pub rejections: Rejections,
    /// Time of the work [s].
    pub seconds: f64,
    /// Time in which images were labelled, encoded and written, without steps and drawing [s]: the sum over orbits that are made at once.
    pub(crate) seconds_of_files: f64,
    /// Whether the whole set is there.
    pub complete: bool,
}

impl DatasetSummary {
    pub(crate) fn images_an_hour(&self) -> f64 {
        if self.seconds > 0.0 { self.images as f64 / self.seconds * 3600.0 } else { 0.0 }
    }

    /// Adds the work of another thread. The time of the whole and its end are not of a thread.
    pub(super) fn add(&mut self, other: Self) {
        self.images += other.images;
        self.orbits += other.orbits;
        self.kept += other.kept;
        self.bytes += other.bytes;
        self.seconds_of_files += other.seconds_of_files;
        self.count(other.rejections);
    }

    /// Adds rejected attempts.
    pub(super) fn count(&mut self, rejections: Rejections) {
        for (reason, rejected) in rejections {
            *self.rejections.entry(reason).or_default() += rejected;
        }
    }

    pub(crate) fn bytes_an_image(&self) -> f64 {
        self.bytes as f64 / self.images.max(1) as f64
    }
}

/// How a data set is made.
pub struct DatasetOrder<'a> {
    /// The SPEC.
    pub spec: &'a Spec,
    /// Its scene.
    pub scenes: &'a SceneText,
    /// Where to compute.
    pub target: &'a Target,
    /// The folder.
    pub root: &'a Path,
    /// The orbits to make.
    pub shard: Shard,
    /// Treatment of orbits that the folder holds already.
    pub begin: Begin,
    /// Whether the scene may name files outside its folder.
    pub allows_outside: bool,
    /// Hears what is probably wrong in the first scene, before it runs.
    pub warn: &'a (dyn Fn(&str) + Sync),
    /// Hears what the first scene assumes, before it runs.
    pub assume: &'a (dyn Fn(&str) + Sync),
}

/// The folder of an orbit.
pub(super) fn place(spec: &Spec, orbit: u64) -> (Split, u32) {
    (split_of(spec, orbit), orbit as u32)
}
