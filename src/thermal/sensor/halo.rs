//! Stray light far from its source (the size-of-source effect): a share of all light is spread over a wide Gaussian.
//!
//! The halo is found on a grid of cells of a quarter of its radius and read between their middles. Averaging and reading widen it; the Gaussian on the grid is
//! narrower by as much. Twins: `glsl/sensor_cells.comp`, `glsl/sensor_halo.comp` and `halo_at` in `glsl/sensor_signal.glsl`.

/// Stray light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Halo {
    /// Share of the light.
    pub share: f64,
    /// Standard deviation of its distance along each axis [px].
    pub radius: f64,
}

/// Cells across a radius.
const FINENESS: f64 = 4.0;
/// Radii at which the halo ends.
const REACH: f64 = 3.5;

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct HaloGrid {
    /// Side of a cell [px].
    pub(crate) cell: usize,
    pub(crate) size: [usize; 2],
    /// Weights at distances of 0, 1, 2 ... cells. All weights along an axis have the sum 1.
    pub(crate) weights: Vec<f64>,
}

impl HaloGrid {
    pub(crate) fn new(halo: &Halo, [width, height]: [usize; 2]) -> Self {
        let cell = ((halo.radius / FINENESS).floor() as usize).max(1);
        // A cell's average adds cell^2 / 12 to the variance, reading between the middles cell^2 / 6.
        let widened = if cell == 1 { 0.0 } else { (cell * cell) as f64 / 4.0 };
        let sigma = (halo.radius * halo.radius - widened).sqrt() / cell as f64;
        let reach = (REACH * sigma).ceil() as usize;
        let mut weights: Vec<f64> = (0..=reach).map(|i| (-0.5 * (i as f64 / sigma).powi(2)).exp()).collect();
        let sum = weights[0] + 2.0 * weights[1..].iter().sum::<f64>();
        weights.iter_mut().for_each(|weight| *weight /= sum);
        Self { cell, size: [width.div_ceil(cell), height.div_ceil(cell)], weights }
    }

    /// Mean of an image over each cell.
    pub(crate) fn cells(&self, image: &[f64], width: usize) -> Vec<f64> {
        let height = image.len() / width;
        let mean = |place: usize| {
            let (left, top) = (place % self.size[0] * self.cell, place / self.size[0] * self.cell);
            let (right, bottom) = ((left + self.cell).min(width), (top + self.cell).min(height));
            let sum: f64 = (top..bottom).map(|y| image[y * width + left..y * width + right].iter().sum::<f64>()).sum();
            sum / ((right - left) * (bottom - top)) as f64
        };
        (0..self.size[0] * self.size[1]).map(mean).collect()
    }

    /// The Gaussian over the cells. Beyond its borders the image goes on as at the border.
    pub(crate) fn halo(&self, cells: &[f64]) -> Vec<f64> {
        let (reach, [columns, rows]) = (self.weights.len() as isize - 1, self.size.map(|size| size as isize));
        let one = |place: isize| {
            let (x, y) = (place % columns, place / columns);
            let row = |y: isize| -> f64 {
                let at = |dx: isize| cells[(y.clamp(0, rows - 1) * columns + (x + dx).clamp(0, columns - 1)) as usize];
                (-reach..=reach).map(|dx| self.weights[dx.unsigned_abs()] * at(dx)).sum()
            };
            (-reach..=reach).map(|dy| self.weights[dy.unsigned_abs()] * row(y + dy)).sum()
        };
        (0..columns * rows).map(one).collect()
    }

    /// The halo at a pixel, between the middles of four cells.
    pub(crate) fn halo_at(&self, halo: &[f64], x: usize, y: usize) -> f64 {
        let place = |at: usize, axis: usize| {
            let middle = (at as f64 + 0.5) / self.cell as f64 - 0.5;
            let low = middle.floor();
            let last = self.size[axis] as f64 - 1.0;
            (low.clamp(0.0, last) as usize, (low + 1.0).clamp(0.0, last) as usize, middle - low)
        };
        let ((left, right, fx), (top, bottom, fy)) = (place(x, 0), place(y, 1));
        let row = |y: usize| halo[y * self.size[0] + left] * (1.0 - fx) + halo[y * self.size[0] + right] * fx;
        row(top) * (1.0 - fy) + row(bottom) * fy
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_grid_follows_the_gaussian_itself() {
        let (width, height, halo) = (160usize, 120usize, Halo { share: 0.1, radius: 12.0 });
        // A bright square of 20 pixels in the middle.
        let bright = |x: usize, y: usize| (70..90).contains(&x) && (50..70).contains(&y);
        let image: Vec<f64> = (0..width * height).map(|i| f64::from(u8::from(bright(i % width, i / width)))).collect();
        let grid = HaloGrid::new(&halo, [width, height]);
        let coarse = grid.halo(&grid.cells(&image, width));
        let of_square = |at: usize, from: f64, to: f64| {
            let z = |edge: f64| libm::erf((edge - at as f64 - 0.5) / (12.0 * std::f64::consts::SQRT_2));
            0.5 * (z(to) - z(from))
        };
        let mut worst = 0.0f64;
        for (x, y) in [(80, 60), (60, 60), (40, 50), (100, 80), (79, 30)] {
            let exact = of_square(x, 70.0, 90.0) * of_square(y, 50.0, 70.0);
            worst = worst.max((grid.halo_at(&coarse, x, y) - exact).abs());
        }
        // Measured: 0.003 of the square's brightness. A halo takes a few percent of it.
        assert!(worst < 0.006, "{worst}");
        assert!((grid.halo_at(&coarse, 80, 60) - of_square(80, 70.0, 90.0)).abs() > 0.06, "the test sees another halo");
        let flat = grid.halo(&grid.cells(&vec![2.0; width * height], width));
        assert!(flat.iter().all(|value| (value - 2.0).abs() < 1e-12));
    }
}
