//! For how long the infrared that patches exchange is held, and the parts of a step that this asks for.
//!
//! Infrared that is held arrives late. Two surfaces that see each other, with a heat capacity so small that both cool within this time, pass what is late back and forth.
//! How fast they act on each other is the root of the product of both rates of cooling and of the share that one has in the view of the other.

use rayon::prelude::*;

use crate::environment::step::halved;

/// Most time for which infrared is held where a scene states none [s].
const MOST: f64 = 60.0;
/// Part of the least time constant of radiation for which it is held then.
const OF_FASTEST: f64 = 0.5;
/// Part of the least time in which surfaces act on each other for which it is held then. Plates that warm by 200 K within five minutes (`sandwich` of tools/oracle) are 3 K rms wrong at a quarter and below 2 K at a fifth.
const OF_TOGETHER: f64 = 0.2;
/// Temperature of these times [K].
const AT_TEMPERATURE: f64 = 300.0;
/// Most times that a step is halved for infrared.
const HALVINGS_AT_MOST: f64 = 3.0;
/// Share of the area that may act faster on what it sees.
const FASTER: f64 = 0.01;

/// How fast surfaces act on each other, over the third power of temperature [1/(s K3)], from how fast each cools [1/(s K3)], its area [m2], and the ends of its `rays` rays: numbers of surfaces, or of none. A share [`FASTER`] of the area may be faster. A surface without a heat capacity does not count.
pub(super) fn together(surfaces: &[[f64; 2]], ends: &[u32], rays: usize) -> f64 {
    let of_end = |end: &u32| surfaces.get(*end as usize).map_or(0.0, |[cooling, _]| counted(*cooling));
    let of_surface = |([cooling, area], ends): (&[f64; 2], &[u32])| {
        let seen = ends.iter().map(of_end).sum::<f64>() / rays as f64;
        [(counted(*cooling) * seen).sqrt(), *area]
    };
    let mut found: Vec<[f64; 2]> = surfaces.par_iter().zip(ends.par_chunks(rays)).map(of_surface).collect();
    found.sort_unstable_by(|a, b| b[0].total_cmp(&a[0]));
    let mut left = FASTER * surfaces.iter().map(|[_, area]| area).sum::<f64>();
    let is_slower = |[_, area]: &&[f64; 2]| {
        left -= area;
        left < 0.0
    };
    found.iter().find(is_slower).map_or(0.0, |[rate, _]| *rate)
}

/// How fast a surface cools [1/(s K3)], and 0 where it has no heat capacity.
fn counted(cooling: f64) -> f64 {
    if cooling.is_finite() { cooling } else { 0.0 }
}

/// Time for which infrared is held [s] in steps of a length [s], where a scene states none. 0 finds it anew in every step. `cooling` is how fast each patch cools, and `together` how fast patches act on each other, both over the third power of temperature [1/(s K3)].
pub(crate) fn chosen(cooling: impl Iterator<Item = f64>, together: f64, step: f64) -> f64 {
    let fastest = cooling.map(counted).fold(0.0, f64::max);
    let within = |share: f64, rate: f64| share / (rate * AT_TEMPERATURE.powi(3));
    let told = |time: f64| (10.0 * time).floor() / 10.0;
    let both = within(OF_TOGETHER, together);
    if both < step {
        return told(both).max(0.1);
    }
    let hold = MOST.min(told(within(OF_FASTEST, fastest).min(both)));
    if hold < step { 0.0 } else { hold }
}

/// Longest part in which a step of a length [s] is taken, where infrared is held for a time [s]: the step, halved until infrared is held for no longer, but three times at most.
pub(crate) fn longest_part(hold: f64, step: f64) -> f64 {
    if hold > 0.0 { halved(step, hold, HALVINGS_AT_MOST) } else { step }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// How fast surfaces with these time constants at 300 K cool [1/(s K3)], each of 1 m2.
    fn surfaces<const N: usize>(constants: [f64; N]) -> [[f64; 2]; N] {
        constants.map(|constant| [1.0 / (constant * AT_TEMPERATURE.powi(3)), 1.0])
    }

    #[test]
    fn surfaces_act_on_each_other_by_what_they_see_of_each_other() {
        const SPACE: u32 = u32::MAX;
        let time = |rate: f64| 1.0 / (rate * AT_TEMPERATURE.powi(3));
        // Two plates that see nothing else, and two that see half of each other.
        for (ends, expected) in [([1, 1, 0, 0], 60.0), ([1, SPACE, 0, SPACE], 60.0 * 2f64.sqrt())] {
            let found = time(together(&surfaces([40.0, 90.0]), &ends, 2));
            assert!((found - expected).abs() < 1e-9, "{found}");
        }
        // A wall without a heat capacity, and space alone.
        assert_eq!(together(&surfaces([40.0, 0.0]), &[1, 1, 0, 0], 2), 0.0);
        assert_eq!(together(&surfaces([40.0, 90.0]), &[SPACE; 4], 2), 0.0);
        // Two plates of 0.4 % of the area do not count, and of 2 % they do.
        for (area, expected) in [(0.004, 900.0), (0.02, 1.0)] {
            let mut all = surfaces([1.0, 1.0, 900.0, 900.0]);
            all[..2].iter_mut().for_each(|one| one[1] = area);
            let found = time(together(&all, &[1, 0, 3, 2], 1));
            assert!((found - expected).abs() < 1e-9, "{area}: {found}");
        }
    }

    #[test]
    fn infrared_is_held_for_less_than_a_step_only_between_fast_surfaces() {
        let rate = |constant: f64| 1.0 / (constant * AT_TEMPERATURE.powi(3));
        // The fastest time constant, the time between surfaces and the step [s], and the time for which infrared is held.
        for (one, both, step, held) in [
            (1e4, 1e4, 15.0, 60.0),
            (1e4, 1e4, 90.0, 0.0),
            (100.02, 1e4, 15.0, 50.0),
            (20.0, 1e4, 15.0, 0.0),
            (100.02, 50.02, 15.0, 10.0),
            (100.02, 0.3, 15.0, 0.1),
        ] {
            assert_eq!(chosen([rate(one)].into_iter(), rate(both), step), held, "{one} {both}");
        }
        // Nothing cools.
        assert_eq!(chosen([f64::INFINITY].into_iter(), 0.0, 15.0), MOST);
    }

    #[test]
    fn a_step_is_halved_until_infrared_is_held_for_no_longer() {
        for (hold, part) in [(0.0, 16.0), (60.0, 16.0), (16.0, 16.0), (15.9, 8.0), (8.0, 8.0), (2.1, 2.0), (0.1, 2.0)] {
            assert_eq!(longest_part(hold, 16.0), part, "{hold}");
        }
    }
}
