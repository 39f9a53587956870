//! Compares the temperatures of two runs, pixel by pixel.

/// Surface temperature [K] and part of every pixel of an image. Part 0 shows no surface.
pub(crate) type SurfaceImage = (Vec<f32>, Vec<u32>);

/// The difference between two runs over the pixels that show the same part in both.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize)]
pub(crate) struct PixelDifference {
    /// Root mean square [K].
    pub(crate) rms: f64,
    /// Value that 99 % of the pixels do not exceed [K].
    pub(crate) p99: f64,
    /// Largest [K].
    pub(crate) max: f64,
    /// Number of compared pixels.
    pub(crate) pixels: usize,
    /// Pixels that show the craft in one run, and another part or none in the other.
    pub(crate) left_out: usize,
}

/// Compares images of the same cameras. `None` where no pixel shows the same part in both.
pub(crate) fn between(one: &[SurfaceImage], other: &[SurfaceImage]) -> Option<PixelDifference> {
    let mut apart: Vec<f64> = Vec::new();
    let mut left_out = 0;
    for ((here, parts), (there, other_parts)) in one.iter().zip(other) {
        let pixels = here.iter().zip(parts).zip(there.iter().zip(other_parts));
        for ((a, part), (b, other_part)) in pixels.filter(|((_, a), (_, b))| **a != 0 || **b != 0) {
            if part == other_part {
                apart.push((f64::from(*a) - f64::from(*b)).abs());
            } else {
                left_out += 1;
            }
        }
    }
    apart.sort_by(f64::total_cmp);
    let pixels = apart.len();
    let max = *apart.last()?;
    let rank = (pixels * 99).div_ceil(100).max(1) - 1;
    let rms = (apart.iter().map(|value| value * value).sum::<f64>() / pixels as f64).sqrt();
    Some(PixelDifference { rms, p99: apart[rank], max, pixels, left_out })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_of_other_parts_and_of_the_sky_do_not_count() {
        let one = vec![(vec![300.0, 310.0, 250.0, 0.0, 280.0], vec![1, 1, 2, 0, 1])];
        let other = vec![(vec![303.0, 306.0, 290.0, 0.0, 0.0], vec![1, 1, 1, 0, 0])];
        let apart = between(&one, &other).unwrap();
        assert_eq!((apart.pixels, apart.left_out), (2, 2));
        assert!((apart.rms - 12.5f64.sqrt()).abs() < 1e-12 && (apart.p99 - 4.0).abs() < 1e-12);
        assert!((apart.max - 4.0).abs() < 1e-12);
        assert_eq!(between(&[(vec![0.0], vec![0])], &[(vec![0.0], vec![0])]), None);
    }

    #[test]
    fn one_hundredth_of_the_pixels_lies_above_p99() {
        let image =
            |far: usize| vec![((0..1000).map(|i| if i < far { 305.0 } else { 300.0 }).collect(), vec![1; 1000])];
        assert!(between(&image(10), &image(0)).unwrap().p99.abs() < 1e-12);
        assert!((between(&image(11), &image(0)).unwrap().p99 - 5.0).abs() < 1e-12);
    }
}
