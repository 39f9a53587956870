//! The errors of the pixels of a run: root mean square, ninety-ninth percentile and maximum.

/// Width of a bin of the histogram, as a share of the error.
const BIN: f64 = 0.02;
/// Lower end of the first bin [K].
const LEAST: f64 = 1e-6;
/// Bins, up to some ten thousand kelvin.
const BINS: usize = 1200;

/// Stated error of the temperatures of all visible pixels of a run's images, one standard deviation.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize)]
pub(crate) struct PixelError {
    /// Root mean square [K].
    pub(crate) rms_k: f64,
    /// Ninety-nine of a hundred pixels have at most this error [K], to 2 %.
    pub(crate) p99_k: f64,
    /// Largest [K].
    pub(crate) max_k: f64,
    /// Pixels that show the craft.
    pub(crate) pixels: u64,
    /// Images.
    pub(crate) images: u64,
}

/// The errors of pixels so far.
#[derive(Debug, Clone, Default, serde::Serialize, serde::Deserialize)]
pub(crate) struct PixelErrors {
    bins: Vec<u64>,
    squares: f64,
    largest: f64,
    pixels: u64,
    images: u64,
}

impl PixelErrors {
    /// Adds an image: the errors of its pixels [K], and which of them show the craft.
    pub(crate) fn add(&mut self, errors: &[f32], part: &[u32]) {
        self.bins.resize(BINS, 0);
        for (error, _) in errors.iter().zip(part).filter(|(_, part)| **part != 0) {
            let error = f64::from(*error);
            let bin = ((error / LEAST).max(1.0).ln() / BIN.ln_1p()) as usize;
            self.bins[bin.min(BINS - 1)] += 1;
            self.squares += error * error;
            self.largest = self.largest.max(error);
            self.pixels += 1;
        }
        self.images += 1;
    }

    /// The error so far. `None` without a pixel.
    pub(crate) fn error(&self) -> Option<PixelError> {
        let most = (0.99 * self.pixels as f64).ceil() as u64;
        let mut seen = 0;
        let bin = self.bins.iter().position(|count| {
            seen += count;
            seen >= most
        })?;
        (self.pixels > 0).then(|| PixelError {
            rms_k: (self.squares / self.pixels as f64).sqrt(),
            p99_k: (LEAST * (1.0 + BIN).powi(bin as i32 + 1)).min(self.largest),
            max_k: self.largest,
            pixels: self.pixels,
            images: self.images,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_those_of_sorted_pixels() {
        let mut errors = PixelErrors::default();
        let values: Vec<f32> = (1..=1000).map(|number| number as f32 * 0.01).collect();
        errors.add(&values, &[1; 1000]);
        let found = errors.error().unwrap();
        let rms = (values.iter().map(|value| f64::from(*value).powi(2)).sum::<f64>() / 1000.0).sqrt();
        assert!((found.rms_k - rms).abs() < 1e-9, "{found:?}");
        assert!((found.p99_k / 9.9 - 1.0).abs() < 0.021 && found.max_k == 10.0, "{found:?}");
        errors.add(&[500.0], &[0]);
        assert_eq!(errors.error().unwrap().max_k, 10.0, "the background has no error");
        assert!(PixelErrors::default().error().is_none());
    }
}
