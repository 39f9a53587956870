//! The cubes of the paper's figures 2 to 4, solved as thermal networks on the chosen device.

use super::{Chosen, CliError};
use crate::paper::orbits::Orbits;

/// Their periodic states, and what was done for them.
pub(super) fn compute(_chosen: &Chosen) -> Result<(Orbits, String), CliError> {
    Err(CliError::Usage("stub".into()))
}
