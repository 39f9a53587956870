//! Keepers of the state of a warm-up, so that it can go on after it was ended.

use super::check::Check;
use super::engine::Engine;
use super::orbits::Orbits;

pub(crate) trait Keep<E> {
    /// Takes the state between two steps. `done` is the number of steps before it, `orbits` what a periodic warm-up goes on from.
    ///
    /// # Errors
    /// A call that fails.
    fn take(
        &mut self,
        done: u32,
        orbits: Option<&Orbits>,
        engine: &mut dyn Engine,
        check: Option<&mut Check>,
    ) -> Result<(), E>;

    /// Whether a state is to be saved after so many steps.
    fn wants(&self, done: u32) -> bool;

    /// Saves the state that was taken last.
    ///
    /// # Errors
    /// An error that ends the run.
    fn save(&mut self) -> Result<(), E>;
}

pub(crate) struct KeepNothing;

impl<E> Keep<E> for KeepNothing {
    fn take(&mut self, _: u32, _: Option<&Orbits>, _: &mut dyn Engine, _: Option<&mut Check>) -> Result<(), E> {
        Ok(())
    }

    fn wants(&self, _: u32) -> bool {
        false
    }

    fn save(&mut self) -> Result<(), E> {
        Ok(())
    }
}
