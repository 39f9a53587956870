//! How uncertain the flux is that a patch absorbs from others [W/m2], one standard deviation for each cause.
//!
//! - Noise of rays: the variance of what a ray brings, over the number of rays ([`Exchange::errors`]), times what even spreading leaves of it ([`evenness`]). Light of pairs that
//!   were left out counts here.
//! - Size of patches: what arrives changes over a patch as a plane ([`super::slopes`]). How much it bends is left. A patch of a single node has no such error.
//! - Held light: what was held too long ([`Exchange::held_too_long`]).
//! - Rows that were held while a joint moved ([`held_rows`]). They err both ways in turn, so a node with heat capacity sees little of it ([`swung`]).
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
    /// By light and infrared that are held.
    pub held: f64,
}

/// Uncertainty of the flux by rows that are held for a share of the way between two poses: the flux by the rows of either, absorbed by each patch [W/m2].
/// A pose lies anywhere within the share, and rows are those of its middle, so the standard deviation is the share over the root of twelve.
pub(crate) fn held_rows(from: &[f64], to: &[f64], hold: f64) -> Vec<f64> {
    from.iter().zip(to).map(|(from, to)| (to - from).abs() * hold / 12f64.sqrt()).collect()
}

/// Swing of a temperature by a flux that goes from an error to its opposite evenly, again and again, over the swing where it follows at once; both root mean squares.
/// `rate` is the time of one passage over the time constant k: the root of 1 - 12 (k/2 coth(k/2) - 1) / k2, by the Fourier series of a sawtooth through a low-pass of the first order.
pub(crate) fn swung(rate: f64) -> f64 {
    // Below this the difference is rounding: k / sqrt(60).
    if rate < 0.1 {
        return rate / 60f64.sqrt();
    }
    let rate = rate.min(1e6);
    let half = 0.5 * rate;
    (1.0 - 12.0 * (half / half.tanh() - 1.0) / (rate * rate)).max(0.0).sqrt()
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

#[cfg(test)]
mod tests {
    use super::*;

    /// The root mean square of y in dy/dt = k (e - y), where e falls from 1 to -1 evenly in each unit of time, over the one of e, by many small steps.
    fn stepped(rate: f64) -> f64 {
        const STEPS: u32 = 20_000;
        let kept = (-rate / f64::from(STEPS)).exp();
        let e = |step: u32| 1.0 - 2.0 * (f64::from(step) + 0.5) / f64::from(STEPS);
        let pass = |y: f64| {
            (0..STEPS).fold((y, 0.0), |(y, sum), step| {
                let y = y * kept + e(step) * (1.0 - kept);
                (y, sum + y * y / f64::from(STEPS))
            })
        };
        // What comes again after a passage: y = y kept^STEPS + passed.
        let start = pass(0.0).0 / (1.0 - (-rate).exp());
        (3.0 * pass(start).1).sqrt()
    }

    #[test]
    fn a_slow_node_hardly_follows_rows_that_err_both_ways() {
        for rate in [0.02, 0.099, 0.101, 0.7, 3.0, 30.0, 500.0] {
            let (told, stepped) = (swung(rate), stepped(rate));
            assert!((told / stepped - 1.0).abs() < 2e-3, "{rate}: {told} and {stepped}");
        }
    }
}
