//! How uncertain the flux is that a patch absorbs from others [W/m2], one standard deviation for each cause.
//!
//! - Noise of rays: the variance of what a ray brings, over the number of rays ([`Exchange::errors`]), times what even spreading leaves of it ([`evenness`]). Light of pairs that
//!   were left out counts here.
//! - Size of patches: what arrives changes over a patch as a plane ([`super::slopes`]). How much it bends is left. A patch of a single node has no such error.
//! - Held light: what was held too long ([`Exchange::held_too_long`]), and rows that were held while a joint moved ([`held_rows`]).
//!
//! A flux becomes kelvin by [`Exchange::kelvin_per_flux`], in balance; a node with heat capacity sees less of it.

use super::directions::evenness;
use super::errors::FluxError;
use super::step::Exchange;

/// Standard deviations of the flux that a patch absorbs from others [W/m2].
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub(crate) struct FluxUncertainty {
    /// By the noise of rays, and by pairs that were left out.
    pub rays: f64,
    /// By the size of patches.
    pub size: f64,
    /// By light, infrared and rows that are held.
    pub held: f64,
}

/// Uncertainty of the flux by rows that are held for a share of the way between two poses: the flux by the rows of either, absorbed by each patch [W/m2].
/// A pose lies anywhere within the share, and rows are those of its middle, so the standard deviation is the share over the root of twelve.
pub(crate) fn held_rows(from: &[f64], to: &[f64], hold: f64) -> Vec<f64> {
    from.iter().zip(to).map(|(from, to)| (to - from).abs() * hold / 12f64.sqrt()).collect()
}

impl Exchange {
    /// Uncertainty of the flux that each patch absorbs [W/m2], with its errors ([`Exchange::errors`]). `held` is the excess by what is held [W/m2], where it is known.
    pub(crate) fn uncertainty(
        &self,
        errors: &[FluxError],
        absorbed: &[f64],
        held: Option<&[f64]>,
    ) -> Vec<FluxUncertainty> {
        let even = evenness(self.factors.rays);
        let size = self.slopes.errors(absorbed);
        let of = |(number, error): (usize, &FluxError)| FluxUncertainty {
            rays: (even * error.noise).hypot(error.left_out),
            size: size.get(number).copied().unwrap_or_default(),
            held: held.map_or(0.0, |held| held[number].abs()),
        };
        errors.iter().enumerate().map(of).collect()
    }
}
