//! A response function as cubic pieces, the form that the device evaluates for every kind.
//!
//! The pieces have equal width in v, the square root of the distance to the nearer end of the time. They are therefore narrow near the ends, where a
//! function that varies as a power of 1/2 or more is smooth in v. A piece stores the share done or the share left, whichever is smaller, for accuracy. A
//! piece that contains a corner of the function is two straight lines. No piece decreases, so a transition never turns back.

/// Fewest pieces on either side.
pub const FEWEST: usize = 2048;
/// Most pieces on either side.
pub const MOST: usize = FEWEST << 5;
/// Error of the share done above which a function is refused: 3 mK of 300 K.
pub const LARGEST_ERROR: f64 = 1e-5;
/// Error of the share done above which more pieces are used.
const SMALL_ERROR: f64 = 1e-6;
/// Offset added to the place of a corner in the last coefficient of its piece. The last coefficient of a cubic is far smaller.
pub const CORNER: f64 = 16.0;

/// Error below which no corner is searched for.
const GOOD: f64 = 1e-8;
/// Number of places in a piece at which its error is measured.
const LOOKED_AT: [f64; 3] = [1.0 / 6.0, 0.5, 5.0 / 6.0];

/// The pieces of a function, and their error.
#[derive(Debug, Clone, PartialEq)]
pub struct Pieces {
    /// Coefficients of each piece, from the start inwards, then from the end inwards. A cubic has the coefficients of the powers of the place in [0, 1).
    /// Two lines have the value at 0, the first slope, the increase of the slope, and the place of the corner + [`CORNER`]. On the side of the start the
    /// value is the share done, or minus the share left. On the side of the end it is the share left, or minus the share done.
    pub cells: Vec<[f32; 4]>,
    /// Largest error of the share done.
    pub error: f64,
    /// Share of the time gone at which it occurs.
    pub worst: f64,
}

impl Pieces {
    /// Pieces of a function. The function gives the share of the way left when a share of the time is left.
    pub fn new(remaining: &dyn Fn(f64) -> f64) -> Self {
        let mut half = FEWEST;
        loop {
            let pieces = Self::with(half, remaining);
            if pieces.error < SMALL_ERROR || half == MOST {
                return pieces;
            }
            half *= 2;
        }
    }

    fn with(half: usize, remaining: &dyn Fn(f64) -> f64) -> Self {
        let mut pieces = Self { cells: Vec::with_capacity(2 * half), error: 0.0, worst: 0.0 };
        for start in [true, false] {
            let distance = |place: f64| (0.5 * (place / half as f64).powi(2)).min(0.5);
            let left = |place: f64| remaining(if start { 1.0 - distance(place) } else { distance(place) });
            for number in 0..half {
                let most_left = left(number as f64 + 0.5) > 0.5;
                let (cell, error) = piece(&|t| match left(number as f64 + t) {
                    left if start == most_left => {
                        if start {
                            1.0 - left
                        } else {
                            left
                        }
                    }
                    left => {
                        if start {
                            -left
                        } else {
                            left - 1.0
                        }
                    }
                });
                if error > pieces.error {
                    let near = distance(number as f64 + 0.5);
                    (pieces.error, pieces.worst) = (error, if start { near } else { 1.0 - near });
                }
                let mut cell = cell.map(|c| c as f32);
                if start != most_left {
                    // The sign says which share this is, also where f32 has no number for it but 0.
                    cell[0] = cell[0].min(-f32::MIN_POSITIVE);
                }
                pieces.cells.push(cell);
            }
        }
        pieces
    }

    /// Share of the way left when the share `r` of the time is left, from the pieces.
    pub fn remaining(&self, r: f64) -> f64 {
        let half = self.cells.len() / 2;
        let start = 1.0 - r < r;
        let place = (2.0 * r.min(1.0 - r)).sqrt() * half as f64;
        let number = (place as usize).min(half - 1);
        let cell = self.cells[number + if start { 0 } else { half }].map(f64::from);
        let small = evaluated(cell, place - number as f64).abs();
        if start == (cell[0] >= 0.0) { 1.0 - small } else { small }
    }
}

fn evaluated([c0, c1, c2, c3]: [f64; 4], t: f64) -> f64 {
    if c3 > 0.5 * CORNER { c0 + t * c1 + c2 * (t - (c3 - CORNER)).max(0.0) } else { c0 + t * (c1 + t * (c2 + t * c3)) }
}

/// The best piece for a function from 0 to 1, and its error.
fn piece(value: &dyn Fn(f64) -> f64) -> ([f64; 4], f64) {
    let exact = LOOKED_AT.map(|t| (t, value(t)));
    let error = |cell: [f64; 4]| exact.iter().map(|(t, v)| (evaluated(cell, *t) - v).abs()).fold(0.0, f64::max);
    let ends = [value(0.0), value(1.0)];
    let cubic = through([ends[0], value(1.0 / 3.0), value(2.0 / 3.0), ends[1]]);
    let mut best = (cubic, if falls(cubic) { f64::INFINITY } else { error(cubic) });
    if best.1 > GOOD {
        let corner = corner(value);
        for border in [corner, 0.5] {
            let cell = lines(ends, border, value(border));
            if error(cell) < best.1 {
                best = (cell, error(cell));
            }
        }
    }
    best
}

/// The cubic through values at 0, 1/3, 2/3 and 1.
fn through([v, a, b, c]: [f64; 4]) -> [f64; 4] {
    let (a, b, c) = (a - v, b - v, c - v);
    [v, 9.0 * a - 4.5 * b + c, 4.5 * (4.0 * b - 5.0 * a - c), 4.5 * (3.0 * (a - b) + c)]
}

fn falls([_, c1, c2, c3]: [f64; 4]) -> bool {
    let slope = |t: f64| c1 + t * (2.0 * c2 + 3.0 * t * c3);
    let turn = -c2 / (3.0 * c3);
    slope(0.0) < 0.0 || slope(1.0) < 0.0 || (turn > 0.0 && turn < 1.0 && slope(turn) < 0.0)
}

/// Two lines from one end to the other with a corner between.
fn lines([first, last]: [f64; 2], border: f64, there: f64) -> [f64; 4] {
    let (before, after) = ((there - first) / border, (last - there) / (1.0 - border));
    [first, before, after - before, border + CORNER]
}

/// The sharpest bend of a function, found by searching for the interval whose middle is farthest from its chord.
fn corner(value: &dyn Fn(f64) -> f64) -> f64 {
    let (mut low, mut width) = (0.0, 1.0);
    while width > 1e-6 {
        let v = [0.0, 0.25, 0.5, 0.75, 1.0].map(|t| value(low + t * width));
        let bend = |i: usize| (v[i] - 2.0 * v[i + 1] + v[i + 2]).abs();
        let number = (0..3).fold(0, |most, i| if bend(i) > bend(most) { i } else { most });
        (low, width) = (low + 0.25 * number as f64 * width, 0.5 * width);
    }
    (low + 0.5 * width).clamp(1e-3, 1.0 - 1e-3)
}

#[cfg(test)]
mod tests;
