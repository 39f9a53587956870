//! A response function as the device holds it: cubic pieces of which f32 keeps both ends relatively accurate.
//!
//! The pieces are Hermite cubics in a coordinate y that is finer where the function is steep: y runs from 0 at either
//! end to 1/2 in the middle, y = s / (1 + c r) from the start and y = (1 + c) r / (1 + c r) from the end, with s the
//! share of the time gone and r = 1 - s. Pieces of the start half hold f, those of the end half w = 1 - f. The warp c
//! above -1 is chosen by the error that it leaves. glsl/shape.glsl evaluates them.

use super::Point;

/// Pieces of one function, half of them from the start and half from the end.
pub const CELLS: usize = 4096;
/// Extrema of the relative rate that a function keeps.
pub const MAX_TURNS: usize = 62;
/// Error of f that is good enough to stop looking for a better warp.
const GOOD: f64 = 3e-9;
/// Error of f beyond which a function is too sharp for its pieces.
pub const LARGEST_ERROR: f64 = 1e-5;

/// Where in a piece its slopes at the ends are taken.
const INSIDE: f64 = 1e-6;
/// Warps that are tried: finer at the start below 0, at the end above.
const WARPS: [f64; 10] = [-0.5, 1.0, -0.8, 4.0, -0.95, -0.99, -0.999, 20.0, 100.0, -0.9999];

/// The pieces, and how far they are from the function.
#[derive(Debug, Clone, PartialEq)]
pub struct Cubics {
    /// c of the coordinate.
    pub warp: f64,
    /// Coefficients of the powers of the place t in [0, 1) of a piece; first the start half, outwards from the start,
    /// then the end half, outwards from the end.
    pub cells: Vec<[f64; 4]>,
    /// Largest error of f.
    pub error: f64,
    /// s where it is.
    pub worst: f64,
}

impl Cubics {
    /// The pieces of a function with the least error over a list of warps.
    pub fn new(at: &dyn Fn(f64) -> Point) -> Self {
        let mut best = Self::with_warp(at, 0.0);
        let on_border = corner(at, best.worst).map(border_warp);
        for warp in on_border.into_iter().chain(WARPS) {
            if best.error < GOOD {
                break;
            }
            let cubics = Self::with_warp(at, warp);
            if cubics.error < best.error {
                best = cubics;
            }
        }
        best
    }

    fn with_warp(at: &dyn Fn(f64) -> Point, warp: f64) -> Self {
        // Of a half and y: the share of the time left, what the pieces hold, and its derivative by y.
        let side = |start: bool, y: f64| {
            if start {
                let s = y * (1.0 + warp) / (1.0 + warp * y);
                let point = at(1.0 - s);
                (s, 1.0 - point.left, point.rate * (1.0 + warp) / (1.0 + warp * y).powi(2))
            } else {
                let divisor = 1.0 + warp - warp * y;
                let point = at(y / divisor);
                (1.0 - y / divisor, point.left, point.rate * (1.0 + warp) / divisor.powi(2))
            }
        };
        let width = 1.0 / CELLS as f64;
        let mut cells = Vec::with_capacity(CELLS);
        let (mut error, mut worst) = (0.0, 0.0);
        for start in [true, false] {
            for i in 0..CELLS / 2 {
                let y = i as f64 * width;
                // Slopes just inside the piece: a corner of the function on its border is then no error.
                let (low, high) = (side(start, y + INSIDE * width), side(start, y + width - INSIDE * width));
                let (m0, m1) = (low.2 * width, high.2 * width);
                let (v0, v1) = (side(start, y).1, side(start, y + width).1);
                let step = v1 - v0;
                let cell = [v0, m0, 3.0 * step - 2.0 * m0 - m1, m0 + m1 - 2.0 * step];
                for t in [0.2, 0.5, 0.8] {
                    let (s, exact, _) = side(start, y + t * width);
                    let found = cell[0] + t * (cell[1] + t * (cell[2] + t * cell[3]));
                    if (found - exact).abs() > error {
                        (error, worst) = ((found - exact).abs(), s);
                    }
                }
                cells.push(cell);
            }
        }
        Self { warp, cells, error, worst }
    }
}

/// The place near s where the rate jumps, where it does.
fn corner(at: &dyn Fn(f64) -> Point, s: f64) -> Option<f64> {
    let rate = |s: f64| at(1.0 - s).rate;
    let reach = 2.0 / CELLS as f64;
    let (mut low, mut high) = ((s - reach).max(0.0), (s + reach).min(1.0));
    let jump = (rate(high) - rate(low)).abs();
    while high - low > 1e-13 {
        let middle = 0.5 * (low + high);
        if (rate(middle) - rate(low)).abs() > (rate(high) - rate(middle)).abs() { high = middle } else { low = middle }
    }
    let left = (rate(high) - rate(low)).abs();
    (left > 1e-9 && left > 0.5 * jump).then_some(0.5 * (low + high))
}

/// A small warp that puts s on the border of two pieces.
fn border_warp(s: f64) -> f64 {
    let r = 1.0 - s;
    let (near, far) = if s < r { (s, r) } else { (r, s) };
    let y = (near * CELLS as f64).round().max(1.0) / CELLS as f64;
    // From the start y = s / (1 + c r), from the end y = (1 + c) r / (1 + c r).
    if s < r { (near / y - 1.0) / far } else { (y - near) / (near * (1.0 - y)) }
}
