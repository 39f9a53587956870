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
    /// more than its share of the grey levels. Noise is never stretched over more than [`NOISE_LEVELS`].
    Plateau {
        /// The share.
        share: f64,
    },
}

/// Most grey levels of a standard deviation of the noise, or of one digital number where that is more. Grain of so few is hardly seen.
const NOISE_LEVELS: f64 = 4.0;
/// Grey levels of a display.
const LEVELS: u64 = 255;

impl Default for GainControl {
    fn default() -> Self {
        Self::Plateau { share: 0.01 }
    }
}

impl GainControl {
    /// The 8 bits of each digital number. `most` is the largest number, and `noise` the standard deviation of the noise in digital numbers.
    pub(crate) fn display(&self, numbers: &[u16], most: u16, noise: f64) -> Vec<u8> {
        let curve = self.curve(numbers, most, noise);
        numbers.iter().map(|number| curve[usize::from((*number).min(most))]).collect()
    }

    /// The 8 bits of all digital numbers, for the histogram of an image.
    pub(crate) fn curve(&self, numbers: &[u16], most: u16, noise: f64) -> Vec<u8> {
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
                let counts: Vec<u64> = histogram.into_iter().map(|count| count.min(plateau)).collect();
                equalised(&counts, noise)
            }
        }
    }
}

/// The grey levels of numbers that count so much, each in the middle of its own step.
fn equalised(counts: &[u64], noise: f64) -> Vec<u8> {
    // A step is counted in parts of a grey level.
    let parts = counts.iter().sum::<u64>().max(1);
    let most = (NOISE_LEVELS / noise.max(1.0) * parts as f64) as u64;
    let mut steps: Vec<u64> = counts.iter().map(|count| (LEVELS * count).min(most)).collect();
    let first = counts.iter().position(|count| *count > 0).unwrap_or(0);
    let last = counts.iter().rposition(|count| *count > 0).unwrap_or(0);
    // What noise may not have, the numbers between share evenly, so that things that lie apart are told from each other.
    let left = (LEVELS * parts).saturating_sub(steps.iter().sum());
    let between = &mut steps[first..=last];
    let taken = |each: u64| between.iter().map(|step| each.min(most.saturating_sub(*step))).sum::<u64>();
    let (mut each, mut beyond) = (0, most + 1);
    while each + 1 < beyond {
        let middle = each.midpoint(beyond);
        if taken(middle) <= left { each = middle } else { beyond = middle }
    }
    between.iter_mut().for_each(|step| *step += each.min(most.saturating_sub(*step)));
    // An image with fewer levels lies in the middle of all.
    let mut below = (LEVELS * parts).saturating_sub(steps.iter().sum());
    let level = |step: u64| {
        let level = (below + step) / (2 * parts);
        below += 2 * step;
        level as u8
    };
    steps.into_iter().map(level).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn linear_gain_maps_its_percentiles_to_the_ends() {
        let numbers: Vec<u16> = (0..1000).map(|i| 4000 + i).collect();
        let shown = GainControl::Linear { percentiles: [10.0, 90.0] }.display(&numbers, 16_383, 0.0);
        // Numbers 4100 and 4900 are the ranks 100 and 900 of 1000.
        assert_eq!([shown[99], shown[100], shown[500], shown[900], shown[999]], [0, 0, 127, 255, 255]);
        assert!(shown[104] == 1 && shown[896] == 253, "{} {}", shown[104], shown[896]);
    }

    #[test]
    fn a_plateau_gives_a_large_background_no_more_than_its_share() {
        let mut numbers = vec![100u16; 9000];
        numbers.extend((0..1000).map(|i| 2000 + i));
        let display = |share| GainControl::Plateau { share }.display(&numbers, 16_383, 0.0);
        let span = |shown: &[u8]| shown[9999] - shown[9000];
        // By whole equalisation the 1000 numbers have a tenth of 255, and a part of what the one number may not have. With a plateau of 1 % (100 pixels) they have
        // more than ten elevenths.
        assert_eq!(span(&display(1.0)), 103);
        assert!((236..=240).contains(&span(&display(0.01))), "{}", span(&display(0.01)));
    }

    /// Warm panels of 20 K before a cold sky, and an Earth with clouds of 10 K.
    #[test]
    fn the_default_shows_craft_and_earth() {
        let mut numbers = vec![0u16; 6000];
        numbers.extend((0..1000u16).map(|i| 4000 + i / 4));
        numbers.extend((0..300u16).map(|i| 9000 + 2 * i));
        let spans = |control: GainControl| {
            let shown = control.display(&numbers, 16_383, 0.0);
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
            let curve = control.curve(&numbers, 16_383, 3.0);
            assert!(curve.windows(2).all(|pair| pair[0] <= pair[1]));
            assert_eq!(control.display(&[7; 10], 255, 0.0).len(), 10);
        }
    }

    /// An image of one temperature with noise is grey, and two such halves are told from each other.
    #[test]
    fn noise_is_not_stretched() {
        // The sum of twelve numbers of 0 to 63 has a standard deviation of 64.
        let noise = |pixel: u32| (0..12).map(|draw| (pixel * 12 + draw).wrapping_mul(2_654_435_761) >> 26).sum::<u32>();
        let deviation = |shown: &[u8]| {
            let mean = shown.iter().map(|level| f64::from(*level)).sum::<f64>() / shown.len() as f64;
            let squares = shown.iter().map(|level| (f64::from(*level) - mean).powi(2)).sum::<f64>();
            (mean, (squares / shown.len() as f64).sqrt())
        };
        let uniform: Vec<u16> = (0..10_000).map(|pixel| 4000 + noise(pixel) as u16).collect();
        let (mean, grain) = deviation(&GainControl::default().display(&uniform, 16_383, 64.0));
        assert!(grain < 4.5 && (110.0..145.0).contains(&mean), "{grain} around {mean}");
        let (_, stretched) = deviation(&GainControl::default().display(&uniform, 16_383, 0.0));
        assert!(stretched > 40.0, "{stretched} without a stated noise");
        let halves: Vec<u16> = (0..10_000).map(|pixel| (4000 + pixel / 5000 * 6000 + noise(pixel)) as u16).collect();
        let shown = GainControl::default().display(&halves, 16_383, 64.0);
        let [(dark, grain), (bright, _)] = [&shown[..5000], &shown[5000..]].map(deviation);
        assert!(grain < 4.5 && bright - dark > 180.0, "{grain}, {dark} to {bright}");
        // Rounding to two neighbouring numbers is no picture either.
        let rounded: Vec<u16> = (0..100).map(|pixel| 7 + pixel % 2).collect();
        let shown = GainControl::default().display(&rounded, 16_383, 0.0);
        assert!(shown[1] - shown[0] <= 4, "{shown:?}");
    }
}
