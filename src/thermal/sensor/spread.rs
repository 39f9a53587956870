//! Point spread as a sum of separable kernels: rows first, then columns.
//!
//! The kernel acts on an image with [`FINENESS`] texels along each side of a pixel. Its weights join the optics and the sensitive area of a pixel, so that
//! light is blurred before pixels integrate it.
//!
//! Every kernel of n x n weights is a sum of at most n products of a row and a column (its singular value decomposition). A Gaussian is one product, an
//! Airy disc needs about five. Terms whose weights together stay below [`DROPPED`] of the whole are left out.

use libm::erf;
use rayon::prelude::*;

/// Texels along each side of a pixel.
pub(crate) const FINENESS: usize = 4;
/// Largest distance of a weight from the middle [px].
pub(crate) const MOST_RADIUS: usize = 31;
/// Share of the kernel that terms left out may hold together.
pub(crate) const DROPPED: f64 = 1e-3;

/// A product of a column and a row of weights.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Term {
    /// Weights of the texels along a row, from -radius to radius around the centre of a pixel.
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
}

impl Spread {
    /// Room for weights on the device: 16 KiB of four weights each, which every device allows for a uniform buffer.
    pub(crate) const ROOM: usize = 1024;

    /// Whether a device has room for the weights, beside the weights of a halo.
    pub(crate) fn fits(&self) -> bool {
        let terms = self.terms.len();
        terms * (2 * self.radius + 7) <= Self::ROOM && terms * (2 * self.radius + 1) + 32 <= Self::ROOM
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
        let line: Vec<f64> = places(radius).map(weight).collect();
        let sum: f64 = line.iter().sum();
        let line: Vec<f64> = line.into_iter().map(|weight| weight / sum).collect();
        Self { radius, terms: vec![Term { row: line.clone(), column: line }] }
    }

    /// The diffraction pattern of a round aperture, integrated over pixels whose sensitive side is `fill` [px]. `scale` is wavelength x f-number over the
    /// pitch of the pixels [px]; the first dark ring has the radius 1.22 x `scale`. The pattern is cut at 8 x `scale`, or where the radius is largest.
    pub fn airy(scale: f64, fill: f64) -> Self {
        let radius = ((8.0 * scale + fill / 2.0).ceil() as usize).clamp(2, MOST_RADIUS);
        // A quarter of the kernel has all of it: both axes mirror it.
        let half = radius * FINENESS;
        let place = |at: usize| (at as f64 + 0.5) / FINENESS as f64;
        let quarter: Vec<f64> = (0..half * half)
            .into_par_iter()
            .map(|at| airy_weight(scale, fill, place(at % half), place(at / half)))
            .collect();
        let mirrored = |line: &[f64]| line.iter().rev().chain(line).map(|weight| 0.5 * weight).collect();
        let terms = separable(&quarter, half).into_iter();
        let terms = terms.map(|term| Term { row: mirrored(&term.row), column: mirrored(&term.column) }).collect();
        Self { radius, terms }
    }

    /// A kernel that was measured at whole pixels, row after row, whose side is 2 x radius + 1. The weights are divided by their sum, which is above 0, and
    /// cubics (Keys 1981) join them.
    pub fn measured(radius: usize, weights: &[f64]) -> Self {
        let joined = |line: &[f64]| -> Vec<f64> {
            let near = |at: f64| {
                let each = line.iter().zip(-(radius as isize)..);
                each.map(|(weight, pixel)| weight * keys(at - pixel as f64)).sum::<f64>() / FINENESS as f64
            };
            places(radius + 2).map(near).collect()
        };
        let terms = separable(weights, 2 * radius + 1).into_iter();
        let terms = terms.map(|term| Term { row: joined(&term.row), column: joined(&term.column) }).collect();
        Self { radius: radius + 2, terms }
    }

    /// The pixels after the point spread. `width` is their number in a row, `texels` the finer image.
    pub(crate) fn apply(&self, texels: &[f64], width: usize) -> Vec<f64> {
        let height = texels.len() / (width * FINENESS * FINENESS);
        let mut sum = vec![0.0; width * height];
        for term in &self.terms {
            let rows = spread_rows(texels, width, &term.row);
            let columns = spread_columns(&rows, width, height, &term.column);
            sum.iter_mut().zip(columns).for_each(|(sum, value)| *sum += value);
        }
        sum
    }
}

/// Distances of texels from the centre of a pixel [px].
fn places(radius: usize) -> impl Iterator<Item = f64> {
    (0..2 * radius * FINENESS).map(move |texel| (texel as f64 + 0.5) / FINENESS as f64 - radius as f64)
}

/// The first of the texels with weights around the centre of a pixel.
fn first_of(pixel: usize, taps: usize) -> isize {
    (pixel * FINENESS + FINENESS / 2) as isize - (taps / 2) as isize
}

/// Each row of texels at the centres of the pixels' columns.
pub(crate) fn spread_rows(texels: &[f64], width: usize, weights: &[f64]) -> Vec<f64> {
    let across = width * FINENESS;
    let one = |place: usize| {
        let row = &texels[place / width * across..][..across];
        let at = |texel: isize| row[texel.clamp(0, across as isize - 1) as usize];
        weights.iter().zip(first_of(place % width, weights.len())..).map(|(weight, texel)| weight * at(texel)).sum()
    };
    (0..texels.len() / FINENESS).into_par_iter().map(one).collect()
}

/// The pixels from [`spread_rows`].
pub(crate) fn spread_columns(rows: &[f64], width: usize, height: usize, weights: &[f64]) -> Vec<f64> {
    let last = (height * FINENESS) as isize - 1;
    let one = |place: usize| {
        let at = |texel: isize| rows[texel.clamp(0, last) as usize * width + place % width];
        weights.iter().zip(first_of(place / width, weights.len())..).map(|(weight, texel)| weight * at(texel)).sum()
    };
    (0..width * height).into_par_iter().map(one).collect()
}

/// Share of a sample at a distance, in units of their spacing (Keys, IEEE Transactions on Acoustics, Speech and Signal Processing 29, 1981, with a = -1/2).
fn keys(distance: f64) -> f64 {
    match distance.abs() {
        x if x < 1.0 => 1.0 + x * x * (1.5 * x - 2.5),
        x if x < 2.0 => 2.0 + x * (-4.0 + x * (2.5 - 0.5 * x)),
        _ => 0.0,
    }
}

/// The separable terms of a kernel with side `n` over the sum of its weights, by one-sided Jacobi rotations of its columns (Hestenes 1958).
fn separable(weights: &[f64], n: usize) -> Vec<Term> {
    let whole: f64 = weights.iter().sum();
    // Columns of `u` become orthogonal, and `v` holds the rotations: weights = u v^T.
    let mut u: Vec<Vec<f64>> = (0..n).map(|j| (0..n).map(|i| weights[i * n + j] / whole).collect()).collect();
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

/// The diffraction pattern integrated over a pixel that is off by x and y [px], but for a factor, by Simpson's rule.
fn airy_weight(scale: f64, fill: f64, x: f64, y: f64) -> f64 {
    // The step stays well below the rings.
    let side = fill.max(1e-9);
    let parts = ((8.0 * side / scale.min(1.0)).ceil() as usize).clamp(1, 64) * 2;
    let simpson = |i: usize| match i {
        i if i == 0 || i == parts => 1.0,
        i if i % 2 == 1 => 4.0,
        _ => 2.0,
    };
    let place = |i: usize| side * (i as f64 / parts as f64 - 0.5);
    let weight =
        |i: usize, j: usize| simpson(i) * simpson(j) * airy_intensity((x + place(i)).hypot(y + place(j)) / scale);
    (0..=parts).flat_map(|i| (0..=parts).map(move |j| weight(i, j))).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    /// The whole kernel, row after row.
    fn whole(spread: &Spread) -> Vec<f64> {
        let side = 2 * spread.radius * FINENESS;
        let weight = |at: usize| spread.terms.iter().map(|term| term.column[at / side] * term.row[at % side]).sum();
        (0..side * side).map(weight).collect()
    }

    /// The transfer function along x.
    fn transfer(spread: &Spread, frequency: f64) -> f64 {
        let wave = |(weight, at): (&f64, f64)| weight * (2.0 * PI * frequency * at).cos();
        let of_term = |term: &Term| {
            term.row.iter().zip(places(spread.radius)).map(wave).sum::<f64>() * term.column.iter().sum::<f64>()
        };
        spread.terms.iter().map(of_term).sum()
    }

    #[test]
    fn the_pattern_is_dark_at_its_first_ring() {
        // 3.8317 / pi: the first zero of J1 (Abramowitz and Stegun, table 9.5).
        assert!(airy_intensity(1.219_670) < 1e-10 && airy_intensity(0.0) == 1.0, "the first dark ring");
    }

    #[test]
    fn separable_terms_are_the_whole_kernel() {
        for (scale, most) in [(0.8, 7), (1.5, 12)] {
            let spread = Spread::airy(scale, 1.0);
            assert!(spread.terms.len() <= most, "{} terms, radius {}", spread.terms.len(), spread.radius);
            let places: Vec<f64> = places(spread.radius).collect();
            let exact: Vec<f64> =
                places.iter().flat_map(|y| places.iter().map(|x| airy_weight(scale, 1.0, *x, *y))).collect();
            let sum: f64 = exact.iter().sum();
            let off = |spread: &Spread| {
                whole(spread).iter().zip(&exact).map(|(weight, exact)| (weight - exact / sum).abs()).sum::<f64>()
            };
            assert!(off(&spread) < 2.0 * DROPPED, "{}", off(&spread));
            let broken = Spread { terms: spread.terms[..1].to_vec(), ..spread };
            assert!(off(&broken) > 0.05, "the comparison sees a broken kernel");
        }
    }

    #[test]
    fn pixels_are_the_whole_kernel_over_the_texels() {
        let (width, height) = (5usize, 4usize);
        let texels: Vec<f64> =
            (0..width * height * FINENESS * FINENESS).map(|i| f64::from(((i * 7919) % 97) as u32)).collect();
        let uneven: Vec<f64> = (0..25).map(|i| 1.0 + f64::from((i * 31) % 7)).collect();
        for spread in [Spread::gaussian(0.8, 1.0), Spread::airy(0.8, 1.0), Spread::measured(2, &uneven)] {
            let (kernel, side) = (whole(&spread), 2 * spread.radius * FINENESS);
            assert!((kernel.iter().sum::<f64>() - 1.0).abs() < 1e-12);
            let [across, down] = [width, height].map(|pixels| (pixels * FINENESS) as isize);
            let at = |x: isize, y: isize| texels[(y.clamp(0, down - 1) * across + x.clamp(0, across - 1)) as usize];
            for (place, computed) in spread.apply(&texels, width).iter().enumerate() {
                let [left, top] =
                    [place % width, place / width].map(|pixel| (pixel * 4 + 2) as isize - side as isize / 2);
                let exact: f64 = kernel
                    .iter()
                    .zip(0..)
                    .map(|(weight, tap): (&f64, isize)| {
                        weight * at(left + tap % side as isize, top + tap / side as isize)
                    })
                    .sum();
                assert!((computed - exact).abs() < 1e-9, "{computed} and {exact}");
            }
        }
    }

    #[test]
    fn a_uniform_image_stays_as_it_is() {
        for spread in [Spread::gaussian(2.0, 1.0), Spread::airy(0.8, 1.0)] {
            let texels = vec![3.5; 30 * 20 * FINENESS * FINENESS];
            assert!(spread.apply(&texels, 30).iter().all(|value| (value - 3.5).abs() < 1e-12));
        }
    }

    /// exp(-2 pi^2 sigma^2 f^2) of a Gaussian, and of a round aperture 2/pi (acos s - s sqrt(1 - s^2)) with s = f x scale, times sinc(f) of the pixel.
    #[test]
    fn the_transfer_is_that_of_the_formulas() {
        let gaussian = |sigma: f64, f: f64| (-2.0 * (PI * sigma * f).powi(2)).exp();
        let airy = |scale: f64, f: f64| {
            let share = (f * scale).min(1.0);
            2.0 / PI * (share.acos() - share * (1.0 - share * share).sqrt())
        };
        for f in [0.1f64, 0.2, 0.3, 0.4, 0.5] {
            let pixel = (PI * f).sin() / (PI * f);
            for sigma in [0.05, 0.3, 0.8, 2.0] {
                let (own, exact) = (transfer(&Spread::gaussian(sigma, 1.0), f), gaussian(sigma, f) * pixel);
                assert!((own - exact).abs() < 0.05 * exact + 1e-4, "{sigma} px at {f}: {own} and {exact}");
                let other = transfer(&Spread::gaussian(sigma, 0.0), f);
                assert!(sigma > 1.0 || (other - exact).abs() > 0.01 * exact, "without the pixel it is another");
            }
            for scale in [0.5, 10.0 / 12.0, 14.0 / 12.0] {
                let (own, exact) = (transfer(&Spread::airy(scale, 1.0), f), airy(scale, f) * pixel);
                assert!((own - exact).abs() < 0.05 * exact, "{scale} px at {f}: {own} and {exact}");
            }
        }
    }
}
