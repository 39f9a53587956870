//! A response function as straight pieces, the form that the device evaluates for every kind.
//!
//! The pieces have equal width in v, the square root of the distance to the nearer end of the time. The pieces are therefore narrow near the ends,
//! where a function that varies as a power of 1/2 or more is smooth in v. A piece stores the share done or the share left, whichever is smaller, for
//! accuracy. A piece that a line does not follow, because the function has a corner in it, is divided into smaller ones. No piece decreases, so a
//! transition never turns back. Only where two pieces meet may the share fall, by the rounding of f32: 1.5e-8 of the way.

/// Pieces on either side.
pub(crate) const SIDE: usize = 1 << 14;
/// Number of smaller pieces that a piece is divided into.
pub(crate) const PARTS: usize = 1 << 4;
/// Error of the share done above which a function is refused: 3 mK of 300 K.
pub(crate) const LARGEST_ERROR: f64 = 1e-5;
/// Error of the share done above which a piece is divided.
const SMALL_ERROR: f64 = 1e-6;
const DEEPEST: u32 = 2;
pub(crate) const MOST: usize = 1 << 20;
/// Places in a piece at which its error is measured.
const LOOKED_AT: [f64; 3] = [0.25, 0.5, 0.75];
/// Number of pieces in a stretch over which [`are_plain`] compares a function with a line.
const STRETCH: usize = 16;
/// Places in a stretch at which it is compared, at uneven distances, so that no function that repeats is met at its zeros.
const COMPARED_AT: [f64; 4] = [0.137, 0.381, 0.618, 0.853];

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct FunctionPieces {
    /// Value at the near end of each piece, and its increase to the far end. [`SIDE`] pieces go from the start inwards, as many from the end inwards.
    /// The smaller pieces follow. A piece that is divided has instead of its increase minus the index of the first of its [`PARTS`] parts. On the
    /// side of the start the value is the share done, or minus the share left. On the side of the end the value is the share left, or minus the share
    /// done.
    pub(crate) cells: Vec<[f32; 2]>,
    /// Largest error of the share done.
    pub(crate) error: f64,
    /// Share of the time gone at which it occurs.
    pub(crate) worst: f64,
}

impl FunctionPieces {
    /// Pieces of a function. The function gives the share of the way left when a share of the time is left.
    pub(crate) fn new(remaining: &dyn Fn(f64) -> f64) -> Self {
        let mut pieces = Self { cells: vec![[0.0; 2]; 2 * SIDE], error: 0.0, worst: 0.0 };
        for start in [true, false] {
            let side = FunctionSide { start, remaining };
            pieces.fill(if start { 0 } else { SIDE }, &side, (0.0, 1.0), SIDE, 0);
        }
        pieces
    }

    /// Fills `count` pieces from an index on, for an interval of v on a side.
    fn fill(&mut self, first: usize, side: &FunctionSide, (low, high): (f64, f64), count: usize, depth: u32) {
        let place = |number: f64| low + (high - low) * number / count as f64;
        let mut before = side.left(low);
        for number in 0..count {
            let [near, far] = [place(number as f64), place(number as f64 + 1.0)];
            let after = side.left(far);
            let mostly_left = side.left(0.5 * (near + far)) > 0.5;
            let value = |left| side.value(left, mostly_left);
            let [v, w] = [value(before), value(after)];
            before = after;
            let error = LOOKED_AT.map(|t| (v + t * (w - v) - value(side.left(near + t * (far - near)))).abs());
            let error = error.into_iter().fold(0.0, f64::max);
            // The sign says which share this is, also where f32 has no number for it but 0.
            let v = if side.start == mostly_left { v as f32 } else { (v as f32).min(-f32::MIN_POSITIVE) };
            let room = self.cells.len() + PARTS <= MOST;
            self.cells[first + number] = if error > SMALL_ERROR && depth < DEEPEST && room {
                let parts = self.cells.len();
                self.cells.resize(parts + PARTS, [0.0; 2]);
                self.fill(parts, side, (near, far), PARTS, depth + 1);
                [v, -(parts as f32)]
            } else {
                // If places err alike to within rounding, the first one counts.
                if error > 1.001 * self.error {
                    // The smallest pieces at the middle of the time would be printed as the middle itself.
                    let [near, far] = if depth == 0 { [near, far] } else { [low, high] };
                    let distance = distance(0.5 * (near + far));
                    self.worst = if side.start { distance } else { 1.0 - distance };
                }
                self.error = self.error.max(error);
                [v, (w - f64::from(v)).max(0.0) as f32]
            };
        }
    }

    /// Share of the way left when the share `r` of the time is left, from the pieces.
    #[cfg(test)]
    pub(crate) fn remaining(&self, r: f64) -> f64 {
        let start = 1.0 - r < r;
        let place = (2.0 * r.min(1.0 - r)).sqrt() * SIDE as f64;
        let number = (place as usize).min(SIDE - 1);
        let mut t = place - number as f64;
        let mut cell = self.cells[number + if start { 0 } else { SIDE }];
        while cell[1] < 0.0 {
            let part = ((PARTS as f64 * t) as usize).min(PARTS - 1);
            t = PARTS as f64 * t - part as f64;
            cell = self.cells[-cell[1] as usize + part];
        }
        let [value, rise] = cell.map(f64::from);
        let small = (value + t * rise).abs();
        if start == (value >= 0.0) { 1.0 - small } else { small }
    }
}

/// Whether a function needs no pieces to show that they would follow it: it follows lines that are `STRETCH` times as long as a piece. This takes a
/// twentieth of the values that pieces take. A function that never decreases keeps each jump until its end, so a jump or a corner shows between any two of
/// the places that are looked at, but for one that the function makes up for within a twentieth of a stretch.
pub(crate) fn are_plain(remaining: &dyn Fn(f64) -> f64) -> bool {
    [true, false].into_iter().all(|start| {
        let side = FunctionSide { start, remaining };
        let count = SIDE / STRETCH;
        let mut before = side.left(0.0);
        (0..count).all(|number| {
            let [near, far] = [number as f64, (number + 1) as f64].map(|number| number / count as f64);
            let after = side.left(far);
            let follows = |t: f64| {
                let left = side.left(near + t * (far - near));
                (before + t * (after - before) - left).abs() <= SMALL_ERROR
            };
            let all = COMPARED_AT.into_iter().all(follows);
            before = after;
            all
        })
    })
}

struct FunctionSide<'a> {
    start: bool,
    remaining: &'a dyn Fn(f64) -> f64,
}

impl FunctionSide<'_> {
    /// Share of the way left at a v.
    fn left(&self, v: f64) -> f64 {
        (self.remaining)(if self.start { 1.0 - distance(v) } else { distance(v) })
    }

    /// The stored value of a share left: the larger share is stored as its difference from 1.
    fn value(&self, left: f64, mostly_left: bool) -> f64 {
        match (self.start, mostly_left) {
            (true, true) => 1.0 - left,
            (true, false) => -left,
            (false, true) => left - 1.0,
            (false, false) => left,
        }
    }
}

/// Share of the time between the end of a side and a v.
fn distance(v: f64) -> f64 {
    (0.5 * v * v).min(0.5)
}

#[cfg(test)]
mod tests;
