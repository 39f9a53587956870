//! The scale of temperature differences: colours, and the marks of its bar.

use super::canvas::Rgb;
use super::colour::NOT_A_NUMBER;
use super::ticks;
use super::views::Views;

/// Share of the scale's end below which the scale is linear. Above it the scale is logarithmic, so that small
/// differences stay visible.
pub(super) const LINEAR: f64 = 0.02;
/// Share of the differences that the scale covers. The rest has the colour of an end, which is marked.
const HELD: f64 = 0.995;

/// Colours of differences: blue below zero, white at zero, red above. The map is ColorBrewer's RdBu, which suits the
/// colour-blind, over asinh of the difference.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct DifferenceScale {
    /// Largest absolute difference on the scale [K].
    pub(crate) limit: f64,
}

impl DifferenceScale {
    /// A scale with round ends that covers nearly all differences in the views.
    pub(crate) fn covering(views: &[Views]) -> Self {
        let all = views.iter().flat_map(|view| view.differences(0).chain(view.differences(1)));
        let mut sizes: Vec<f32> = all.map(f32::abs).filter(|size| size.is_finite()).collect();
        if sizes.is_empty() {
            return Self { limit: 1.0 };
        }
        let rank = ((sizes.len() - 1) as f64 * HELD).round() as usize;
        let (_, held, _) = sizes.select_nth_unstable_by(rank, f32::total_cmp);
        let held = f64::from(*held).max(1e-3);
        Self { limit: ticks::round_range(-held, held)[1] }
    }

    /// Position of a difference [K] on the scale, from -1 to 1.
    pub(super) fn place(&self, difference: f64) -> f64 {
        (difference / (LINEAR * self.limit)).asinh() / (1.0 / LINEAR).asinh()
    }

    /// Difference [K] at a position on the scale.
    pub(super) fn at(&self, place: f64) -> f64 {
        (place * (1.0 / LINEAR).asinh()).sinh() * LINEAR * self.limit
    }

    /// Marks for a bar of `length` pixels: 0, and 1, 2 and 5 of every decade. Marks start at the ends and stop when
    /// there is no more room.
    pub(super) fn marks(&self, length: f64) -> Vec<f64> {
        const ROOM: f64 = 40.0;
        let mut marks = vec![0.0];
        let mut free = 1.0 + 1e-9;
        let mut decade = 10f64.powi(self.limit.log10().floor() as i32);
        while self.place(5.0 * decade) * 0.5 * length > ROOM {
            for value in [5.0, 2.0, 1.0].map(|digit| digit * decade) {
                let place = self.place(value);
                if place <= free && place * 0.5 * length > ROOM {
                    marks.extend([value, -value]);
                    free = place - 2.0 * ROOM / length;
                }
            }
            decade *= 0.1;
        }
        marks
    }

    /// Colour of a difference [K].
    pub(crate) fn colour(&self, difference: f32) -> Rgb {
        if difference.is_nan() {
            return NOT_A_NUMBER;
        }
        let share = (0.5 - 0.5 * self.place(f64::from(difference))).clamp(0.0, 1.0);
        // The ends of the map are so dark that they would merge with the background, so they are cut.
        let colour = colorous::RED_BLUE.eval_continuous(0.06 + 0.88 * share);
        [colour.r, colour.g, colour.b]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::colour::BACKGROUND;
    use crate::output::views::tests::views;

    #[test]
    fn zero_is_white_and_the_ends_are_red_and_blue() {
        let scale = DifferenceScale { limit: 20.0 };
        // ColorBrewer's middle is 247. The spline through the map passes below it.
        assert!(scale.colour(0.0).iter().all(|channel| *channel > 230), "{:?}", scale.colour(0.0));
        let ([r, _, b], [r2, _, b2]) = (scale.colour(20.0), scale.colour(-20.0));
        assert!(r > b + 60 && b2 > r2 + 60);
        assert_eq!(scale.colour(35.0), scale.colour(20.0));
        assert_eq!(scale.colour(f32::NAN), NOT_A_NUMBER);
        for i in -200..=200 {
            let colour = scale.colour(i as f32 * 0.1);
            for special in [BACKGROUND, NOT_A_NUMBER] {
                let distance: u32 = colour.iter().zip(special).map(|(a, b)| u32::from(a.abs_diff(b))).sum();
                assert!(distance > 60, "{colour:?} is close to {special:?}");
            }
        }
    }

    #[test]
    fn a_small_difference_shows_and_the_bar_says_what_it_is() {
        let scale = DifferenceScale { limit: 250.0 };
        // 10 K of 250 K: asinh(2) / asinh(50) = 0.31. A linear scale gives 0.04, which is white.
        assert!((scale.place(10.0) - 0.313).abs() < 1e-3);
        for value in [-250.0, -3.0, 0.0, 40.0, 250.0] {
            assert!((scale.at(scale.place(value)) - value).abs() < 1e-9);
        }
        let mut marks = scale.marks(450.0);
        marks.sort_by(f64::total_cmp);
        assert_eq!(marks, [-200.0, -50.0, -20.0, -5.0, 0.0, 5.0, 20.0, 50.0, 200.0]);
        assert!(scale.marks(1000.0).len() > marks.len() && DifferenceScale { limit: 0.001 }.marks(450.0).len() > 2);
    }

    #[test]
    fn rms_and_scale_come_from_what_is_in_view() {
        let mut view = views(29.0);
        assert!((view.rms(0).unwrap() - 29.0).abs() < 1e-4 && (view.rms(1).unwrap() - 2.0).abs() < 1e-4);
        assert_eq!(DifferenceScale::covering(std::slice::from_ref(&view)).limit, 30.0);
        // Background pixels do not count. A few pixels out of thousands may exceed the scale.
        let miss = view.part.iter().position(|part| *part == 0).unwrap();
        view.temperatures[0][miss] = 9999.0;
        let hit = view.part.iter().position(|part| *part != 0).unwrap();
        view.temperatures[0][hit] += 500.0;
        assert_eq!(DifferenceScale::covering(std::slice::from_ref(&view)).limit, 30.0);
        assert!(view.rms(0).unwrap() > 29.5);
        view.part.fill(0);
        assert_eq!(view.rms(0), None);
        assert_eq!(DifferenceScale::covering(&[view]).limit, 1.0);
    }
}
