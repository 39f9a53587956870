//! Where a network left the one pass.

use crate::thermal::network::one_pass::Estimate;

/// Where a network left the one pass.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct OnePassExit {
    /// Scene time [s].
    pub(crate) time: f64,
    /// Estimated error at that time.
    pub(crate) estimate: Estimate,
}
