//! Automatic gain control: digital numbers to the 8 bits of a display, in integers, so that every machine shows the same.

/// How digital numbers become 8 bits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum GainControl {
    /// Linear between two percentiles of the image.
    Linear {
        /// Percentiles that become 0 and 255.
        percentiles: [f64; 2],
    },
    /// The cumulative histogram, in which no number counts for more than a share of the pixels (plateau equalisation). So a large uniform background takes no
    /// more than its share of the grey levels.
    Plateau {
        /// The share.
        share: f64,
    },
}

impl Default for GainControl {
    fn default() -> Self {
        Self::Plateau { share: 0.01 }
    }
}

impl GainControl {
    /// The 8 bits of each digital number. `most` is the largest number.
    pub(crate) fn display(&self, numbers: &[u16], most: u16) -> Vec<u8> {
        let curve = self.curve(numbers, most);
        numbers.iter().map(|number| curve[usize::from((*number).min(most))]).collect()
    }

    /// The 8 bits of all digital numbers, for the histogram of an image.
    pub(crate) fn curve(&self, numbers: &[u16], most: u16) -> Vec<u8> {
        let mut histogram = vec![0u64; usize::from(most) + 1];
        for number in numbers {
            histogram[usize::from((*number).min(most))] += 1;
        }
        match *self {
            Self::Linear { percentiles } => {
                let pixels = numbers.len() as f64;
                let [low, high] = percentiles.map(|percentile| {
                    let rank = (percentile / 100.0 * pixels).floor().min(pixels - 1.0) as u64;
                    let mut below = 0;
                    histogram.iter().position(|count| {
                        below += count;
                        below > rank
                    })
                });
                let (low, high) = (low.unwrap_or(0), high.unwrap_or(usize::from(most)));
                let span = (high - low).max(1);
                (0..histogram.len()).map(|n| (n.clamp(low, low + span) - low) * 255 / span).map(|n| n as u8).collect()
            }
            Self::Plateau { share } => {
                let plateau = ((share * numbers.len() as f64).ceil() as u64).max(1);
                let sum: u64 = histogram.iter().map(|count| (*count).min(plateau)).sum();
                let mut below = 0;
                let clipped = |count: &u64| {
                    let present = (*count).min(plateau);
                    // The middle of the number's own step.
                    let level = (2 * below + present) * 255 / (2 * sum.max(1));
                    below += present;
                    level as u8
                };
                histogram.iter().map(clipped).collect()
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn linear_gain_maps_its_percentiles_to_the_ends() {
        let numbers: Vec<u16> = (0..1000).map(|i| 4000 + i).collect();
        let shown = GainControl::Linear { percentiles: [10.0, 90.0] }.display(&numbers, 16_383);
        // Numbers 4100 and 4900 are the ranks 100 and 900 of 1000.
        assert_eq!([shown[99], shown[100], shown[500], shown[900], shown[999]], [0, 0, 127, 255, 255]);
        assert!(shown[104] == 1 && shown[896] == 253, "{} {}", shown[104], shown[896]);
    }

    #[test]
    fn a_plateau_gives_a_large_background_no_more_than_its_share() {
        let mut numbers = vec![100u16; 9000];
        numbers.extend((0..1000).map(|i| 2000 + i));
        let display = |share| GainControl::Plateau { share }.display(&numbers, 16_383);
        let span = |shown: &[u8]| shown[9999] - shown[9000];
        // Whole equalisation leaves the 1000 numbers a tenth of 255; with a plateau of 1 % (100 pixels) they have ten elevenths.
        assert_eq!(span(&display(1.0)), 25);
        assert!((229..=233).contains(&span(&display(0.01))), "{}", span(&display(0.01)));
    }

    /// Warm panels of 20 K before a cold sky, and an Earth with clouds of 10 K.
    #[test]
    fn the_default_shows_craft_and_earth() {
        let mut numbers = vec![0u16; 6000];
        numbers.extend((0..1000u16).map(|i| 4000 + i / 4));
        numbers.extend((0..300u16).map(|i| 9000 + 2 * i));
        let spans = |control: GainControl| {
            let shown = control.display(&numbers, 16_383);
            [shown[6999] - shown[6000], shown[7299] - shown[7000]]
        };
        let [earth, craft] = spans(GainControl::default());
        assert!(earth > 100 && craft > 50, "{earth} and {craft} grey levels");
        let [earth, _] = spans(GainControl::Linear { percentiles: [0.5, 99.5] });
        assert!(earth < 10, "a line leaves the Earth {earth} grey levels");
    }

    #[test]
    fn brighter_is_never_darker_and_uniform_images_are_shown() {
        let numbers: Vec<u16> = (0..5000u32).map(|i| ((i * i * 31) % 9973) as u16).collect();
        for control in [GainControl::Linear { percentiles: [0.5, 99.5] }, GainControl::Plateau { share: 0.001 }] {
            let curve = control.curve(&numbers, 16_383);
            assert!(curve.windows(2).all(|pair| pair[0] <= pair[1]));
            assert_eq!(control.display(&[7; 10], 255).len(), 10);
        }
    }
}
