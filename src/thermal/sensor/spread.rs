//! Point spread as a sum of separable kernels: rows first, then columns.
//!
//! Every kernel of n x n weights is a sum of at most n products of a row and a column (its singular value decomposition). A Gaussian is one product, an
//! Airy disc needs about five. Terms whose weights together stay below [`DROPPED`] of the whole are left out.

use libm::erf;
use rayon::prelude::*;

/// Largest distance of a weight from the middle [px].
pub(crate) const MOST_RADIUS: usize = 31;
/// Share of the kernel that terms left out may hold together.
pub(crate) const DROPPED: f64 = 1e-3;

/// A product of a column and a row of weights.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Term {
    /// Weights along a row, from -radius to radius.
    pub(crate) row: Vec<f64>,
    pub(crate) column: Vec<f64>,
}

/// A point spread. Beyond its borders an image goes on as at the border.
#[derive(Debug, Clone, PartialEq)]
pub struct Spread {
    /// Largest distance from the middle [px].
    pub(crate) radius: usize,
    /// Separable kernels. Their sum has the sum 1.
    pub(crate) terms: Vec<Term>,
    /// Weights of the whole kernel, row after row, with the sum 1.
    pub weights: Vec<f64>,
}

impl Spread {
    /// Room for weights on the device: 16 KiB of four weights each, which every device allows for a uniform buffer.
    pub(crate) const ROOM: usize = 1024;

    /// Whether a device has room for the weights, beside the weights of a halo.
    pub(crate) fn fits(&self) -> bool {
        self.terms.len() * (4 * self.radius + 5) + 32 <= Self::ROOM
    }

    /// A Gaussian with a standard deviation [px], integrated over pixels whose sensitive side is `fill` [px]. With a fill of 0 it is taken at points.
    pub(crate) fn gaussian(sigma: f64, fill: f64) -> Self {
        let radius = ((4.0 * sigma + fill / 2.0).ceil() as usize).clamp(1, MOST_RADIUS);
        let weight = |at: f64| match fill > 0.0 {
            true => {
                erf((at + fill / 2.0) / (sigma * std::f64::consts::SQRT_2))
                    - erf((at - fill / 2.0) / (sigma * std::f64::consts::SQRT_2))
            }
            false => (-0.5 * (at / sigma).powi(2)).exp(),
        };
        let line: Vec<f64> = (0..=2 * radius).map(|i| weight(i as f64 - radius as f64)).collect();
        let weights = line.iter().flat_map(|y| line.iter().map(move |x| x * y)).collect();
        Self::new(radius, weights)
    }

    /// The diffraction pattern of a round aperture, integrated over pixels whose sensitive side is `fill` [px]. `scale` is wavelength x f-number over the
    /// pitch of the pixels [px]; the first dark ring has the radius 1.22 x `scale`. The pattern is cut at 8 x `scale`, or where the radius is largest.
    pub fn airy(scale: f64, fill: f64) -> Self {
        // Simpson's rule needs a step well below the rings.
        let side = fill.max(1e-9);
        let parts = ((8.0 * side / scale.min(1.0)).ceil() as usize).clamp(1, 64) * 2;
        let radius = ((8.0 * scale + side / 2.0).ceil() as usize).clamp(2, MOST_RADIUS);
        let simpson = |i: usize| {
            if i == 0 || i == parts {
                1.0
            } else if i % 2 == 1 {
                4.0
            } else {
                2.0
            }
        };
        let place = |i: usize| side * (i as f64 / parts as f64 - 0.5);
        let weight = |x: f64, y: f64| {
            let weight = |i: usize, j: usize| {
                simpson(i) * simpson(j) * airy_intensity((x + place(i)).hypot(y + place(j)) / scale)
            };
            (0..=parts).flat_map(|i| (0..=parts).map(move |j| weight(i, j))).sum::<f64>()
        };
        let size = 2 * radius + 1;
        let weights = (0..size * size)
            .into_par_iter()
            .map(|at| weight((at % size) as f64 - radius as f64, (at / size) as f64 - radius as f64))
            .collect();
        Self::new(radius, weights)
    }

    /// A kernel of weights, row after row, whose side is 2 x radius + 1. The weights are divided by their sum, which is above 0.
    pub(crate) fn new(radius: usize, weights: Vec<f64>) -> Self {
        let sum: f64 = weights.iter().sum();
        let weights: Vec<f64> = weights.into_iter().map(|weight| weight / sum).collect();
        let terms = separable(&weights, 2 * radius + 1);
        Self { radius, terms, weights }
    }

    /// The image after the point spread. `width` is the width of the image [px].
    pub(crate) fn apply(&self, image: &[f64], width: usize) -> Vec<f64> {
        let height = image.len() / width;
        let mut sum = vec![0.0; image.len()];
        for term in &self.terms {
            let rows = spread_rows(image, width, &term.row);
            let columns = spread_columns(&rows, width, height, &term.column);
            sum.iter_mut().zip(columns).for_each(|(sum, value)| *sum += value);
        }
        sum
    }
}

pub(crate) fn spread_rows(image: &[f64], width: usize, weights: &[f64]) -> Vec<f64> {
    let radius = (weights.len() / 2) as isize;
    let at = |row: usize, column: isize| image[row * width + column.clamp(0, width as isize - 1) as usize];
    let one = |place: usize| {
        let (row, column) = (place / width, (place % width) as isize);
        weights.iter().zip(-radius..).map(|(weight, by)| weight * at(row, column + by)).sum()
    };
    (0..image.len()).into_par_iter().map(one).collect()
}

pub(crate) fn spread_columns(image: &[f64], width: usize, height: usize, weights: &[f64]) -> Vec<f64> {
    let radius = (weights.len() / 2) as isize;
    let at = |row: isize, column: usize| image[row.clamp(0, height as isize - 1) as usize * width + column];
    let one = |place: usize| {
        let (row, column) = ((place / width) as isize, place % width);
        weights.iter().zip(-radius..).map(|(weight, by)| weight * at(row + by, column)).sum()
    };
    (0..image.len()).into_par_iter().map(one).collect()
}

/// The separable terms of a kernel with side `n`, by one-sided Jacobi rotations of its columns (Hestenes 1958).
fn separable(weights: &[f64], n: usize) -> Vec<Term> {
    // Columns of `u` become orthogonal, and `v` holds the rotations: weights = u v^T.
    let mut u: Vec<Vec<f64>> = (0..n).map(|j| (0..n).map(|i| weights[i * n + j]).collect()).collect();
    let mut v: Vec<Vec<f64>> = (0..n).map(|j| (0..n).map(|i| f64::from(u8::from(i == j))).collect()).collect();
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let rotate = |columns: &mut [Vec<f64>], p: usize, q: usize, c: f64, s: f64| {
        let (left, right) = columns.split_at_mut(q);
        for (a, b) in left[p].iter_mut().zip(&mut right[0]) {
            (*a, *b) = (c * *a - s * *b, s * *a + c * *b);
        }
    };
    for _ in 0..60 {
        let mut turned = false;
        for p in 0..n {
            for q in p + 1..n {
                let (a, b, g) = (dot(&u[p], &u[p]), dot(&u[q], &u[q]), dot(&u[p], &u[q]));
                if g.abs() <= 1e-15 * (a * b).sqrt() || g.abs() < 1e-30 {
                    continue;
                }
                turned = true;
                let zeta = (b - a) / (2.0 * g);
                let t = zeta.signum() / (zeta.abs() + (1.0 + zeta * zeta).sqrt());
                let c = 1.0 / (1.0 + t * t).sqrt();
                rotate(&mut u, p, q, c, c * t);
                rotate(&mut v, p, q, c, c * t);
            }
        }
        if !turned {
            break;
        }
    }
    let mut order: Vec<(f64, usize)> = (0..n).map(|j| (dot(&u[j], &u[j]).sqrt(), j)).collect();
    order.sort_by(|a, b| b.0.total_cmp(&a.0));
    // The weights of a term are at most the sum of the absolute products of its column and row.
    let size = |j: usize| u[j].iter().map(|x| x.abs()).sum::<f64>() * v[j].iter().map(|x| x.abs()).sum::<f64>();
    let mut kept = n;
    let mut dropped = 0.0;
    while kept > 1 && dropped + size(order[kept - 1].1) < DROPPED {
        dropped += size(order[kept - 1].1);
        kept -= 1;
    }
    let mut terms: Vec<Term> = order[..kept]
        .iter()
        .map(|(length, j)| {
            let scale = length.sqrt().max(f64::MIN_POSITIVE);
            let column = u[*j].iter().map(|x| x / scale).collect();
            Term { column, row: v[*j].iter().map(|x| x * scale).collect() }
        })
        .collect();
    // A uniform image must not change, so the first term makes up for the terms that are left out.
    let sum = |term: &Term| term.row.iter().sum::<f64>() * term.column.iter().sum::<f64>();
    let (first, rest) = (sum(&terms[0]), terms[1..].iter().map(sum).sum::<f64>());
    terms[0].row.iter_mut().for_each(|weight| *weight *= (1.0 - rest) / first);
    terms
}

/// Intensity of the diffraction pattern (2 J1(v) / v)^2 at v = pi r, with the distance r in units of wavelength x f-number. 1 in the middle.
pub(crate) fn airy_intensity(r: f64) -> f64 {
    let v = std::f64::consts::PI * r;
    if v < 1e-6 { 1.0 } else { (2.0 * libm::j1(v) / v).powi(2) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The whole kernel, applied directly.
    fn direct(spread: &Spread, image: &[f64], width: usize) -> Vec<f64> {
        let (radius, height) = (spread.radius as isize, (image.len() / width) as isize);
        let size = 2 * spread.radius + 1;
        let at = |x: isize, y: isize| {
            image[(y.clamp(0, height - 1) * width as isize + x.clamp(0, width as isize - 1)) as usize]
        };
        (0..image.len() as isize)
            .map(|place| {
                let (x, y) = (place % width as isize, place / width as isize);
                let weight =
                    |dx: isize, dy: isize| spread.weights[(dy + radius) as usize * size + (dx + radius) as usize];
                (-radius..=radius)
                    .flat_map(|dy| (-radius..=radius).map(move |dx| (dx, dy)))
                    .map(|(dx, dy)| weight(dx, dy) * at(x + dx, y + dy))
                    .sum()
            })
            .collect()
    }

    #[test]
    fn the_pattern_is_dark_at_its_first_ring() {
        // 3.8317 / pi: the first zero of J1 (Abramowitz and Stegun, table 9.5).
        assert!(airy_intensity(1.219_670) < 1e-10 && airy_intensity(0.0) == 1.0, "the first dark ring");
    }

    #[test]
    fn separable_terms_are_the_whole_kernel() {
        let (width, height) = (23, 17);
        let image: Vec<f64> = (0..width * height).map(|i| f64::from(((i * 7919) % 97) as u32)).collect();
        let uneven: Vec<f64> = (0..25).map(|i| 1.0 + f64::from((i * 31) % 7)).collect();
        for (spread, terms) in [
            (Spread::gaussian(0.8, 0.0), 1),
            (Spread::gaussian(1.3, 1.0), 1),
            (Spread::airy(0.8, 1.0), 6),
            (Spread::airy(1.5, 1.0), 9),
            (Spread::new(2, uneven), 5),
        ] {
            assert!(spread.terms.len() <= terms, "{} terms, radius {}", spread.terms.len(), spread.radius);
            assert!((spread.weights.iter().sum::<f64>() - 1.0).abs() < 1e-12);
            let (computed, exact) = (spread.apply(&image, width), direct(&spread, &image, width));
            let worst = computed.iter().zip(&exact).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(worst < DROPPED * 97.0, "{worst}");
            let broken = Spread {
                terms: vec![Term {
                    row: spread.terms[0].column.iter().map(|x| 0.9 * x).collect(),
                    ..spread.terms[0].clone()
                }],
                ..spread.clone()
            };
            let worst = broken.apply(&image, width).iter().zip(&exact).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(worst > 0.1, "the comparison sees a broken kernel");
        }
    }

    #[test]
    fn a_uniform_image_stays_as_it_is() {
        for spread in [Spread::gaussian(2.0, 1.0), Spread::airy(0.8, 1.0)] {
            let image = vec![3.5; 30 * 20];
            assert!(spread.apply(&image, 30).iter().all(|value| (value - 3.5).abs() < 1e-12));
        }
    }

    /// The transform of a Gaussian over pixels: exp(-2 pi^2 sigma^2 f^2) x sinc(f), for a sigma that pixels resolve.
    #[test]
    fn the_transfer_of_a_gaussian_is_that_of_the_formula() {
        let (sigma, pi) = (1.0, std::f64::consts::PI);
        let spread = Spread::gaussian(sigma, 1.0);
        let line: Vec<f64> =
            spread.terms[0].row.iter().map(|w| w * spread.terms[0].column.iter().sum::<f64>()).collect();
        for f in [0.05f64, 0.15, 0.25] {
            let computed: f64 =
                line.iter().zip(-(spread.radius as i32)..).map(|(w, x)| w * (2.0 * pi * f * f64::from(x)).cos()).sum();
            let exact = (-2.0 * (pi * sigma * f).powi(2)).exp() * (pi * f).sin() / (pi * f);
            assert!((computed - exact).abs() < 2e-3, "{f}: {computed} and {exact}");
            assert!((computed - exact / ((pi * f).sin() / (pi * f))).abs() > 2e-3, "without the pixel it is another");
        }
    }
}
