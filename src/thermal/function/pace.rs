//! How fast the phase moves as the gap grows, as cubic pieces: what a merge is followed by where its root is not found
//! directly.
//!
//! The change of x = ln(s/r) with ln u is g (flow.rs), and a change of the target moves the phase along it from one gap to
//! the other. Where the relative rate h grows throughout, g is smooth, following it finds the root of phase.rs, and the
//! pieces are samples of [`Flow`]: with the relative accuracy of g a small shift has that of f32.
//!
//! Where h turns, g has a pole at each extremum, and the root moves as the square root of a change there: a change and its
//! reverse do not cancel, and what is near depends on how a change is divided. There the pace is limited. With
//! theta = -ln w, the e-folds of the way done, the exact pace is d theta / d ln u = -(h - h(0)) h / h'; of the paces that
//! are 0 at every extremum, nowhere beyond it, of its sign, and nowhere change by more than [`STEEPEST`] times theta, the
//! largest is taken. Where the exact pace changes no faster it is the exact one. So limited (the limit is Lipschitz's), the
//! phase after a change depends on the sum of changes only: a change and its reverse cancel, a division of a change makes
//! no difference, errors grow no faster than the limit, and the limit dt -> 0 exists for any function, one with corners in its
//! rate included.

use super::{Flow, Kind, Point};

/// Pieces from either end.
pub const HALF: usize = 512;
/// Largest change of the pace with the e-folds of the way.
const STEEPEST: f64 = 16.0;
/// Closest to an end, as a share of the time, that the pace of a function that turns is taken.
const MARGIN: f64 = 1e-4;
/// Longest step of Taylor's method, as a change of ln u times that of g with x: what it leaves is a 24th of its cube.
const LONGEST: f64 = 0.03;
/// The same where the pace is limited, and the steps are part of what is defined.
const LONGEST_LIMITED: f64 = 0.05;
/// Difference of g from that of a power that is none: what [`Flow`] leaves.
const POWER: f64 = 2e-7;
/// Most steps of a change.
pub const MOST_PARTS: f64 = 64.0;

/// g in pieces; a piece is of equal width in v, the root of the distance to the nearer end.
#[derive(Debug, Clone, PartialEq)]
pub struct Pace {
    /// Coefficients of the powers of the place t in [0, 1) of a piece, from the start outwards, then from the end outwards.
    pub cells: Vec<[f64; 4]>,
    /// Steps that a change of ln u by 1 is divided into, over v.
    pub parts: f64,
}

/// g, and its first two derivatives by x.
#[derive(Debug, Clone, Copy)]
struct Slopes {
    g: f64,
    first: f64,
    second: f64,
}

impl Pace {
    /// Of a function whose relative rate grows throughout.
    pub(super) fn of_flow(flow: &Flow) -> Self {
        let value = |distance: f64, start: bool| flow.at(if start { distance } else { 1.0 - distance });
        let halves = [true, false].map(|start| (0..=HALF).map(|i| value(distance(i), start)).collect::<Vec<_>>());
        let mut pace = Self { cells: [pieces(&halves[0]), pieces(&halves[1])].concat(), parts: 0.0 };
        pace.parts = pace.steepness(|at| at.first.abs().max((at.g * at.second).abs().sqrt())) / LONGEST;
        pace
    }

    /// Of a function whose relative rate turns.
    pub(super) fn limited(kind: &Kind) -> Self {
        let start = kind.at(1.0).rate;
        // From the start to the end: both halves have the middle.
        let places: Vec<(f64, f64)> = (0..=HALF)
            .map(|i| (distance(i), 1.0 - distance(i)))
            .chain((0..HALF).rev().map(|i| (1.0 - distance(i), distance(i))))
            .collect();
        let inside = |&(s, r): &(f64, f64)| s >= MARGIN && r >= MARGIN;
        let first = places.iter().position(inside).unwrap_or(0);
        let last = places.iter().rposition(inside).unwrap_or(0);
        let exact: Vec<Exact> = places[first..=last].iter().map(|&(s, r)| Exact::new(kind, start, s, r)).collect();
        let limited = limit(&exact);
        let of_x: Vec<f64> = limited.iter().zip(&places[first..=last]).map(|(g, (s, r))| g / (s * r)).collect();
        let value = |i: usize| of_x[i.clamp(first, last) - first];
        let from_start: Vec<f64> = (0..=HALF).map(value).collect();
        let from_end: Vec<f64> = (0..=HALF).map(|i| value(2 * HALF - i)).collect();
        let mut pace = Self { cells: [pieces(&from_start), pieces(&from_end)].concat(), parts: 0.0 };
        pace.parts = pace.steepness(|at| at.first.abs()) / LONGEST_LIMITED;
        pace
    }

    /// Whether the phase moves as that of a power does, whatever the function is written as: g = -1 throughout.
    pub fn is_of_a_power(&self) -> bool {
        self.cells.iter().all(|[g, rest @ ..]| (g + 1.0).abs() < POWER && rest.iter().all(|c| c.abs() < POWER))
    }

    /// Largest change of g with x, by a measure of it, over v.
    fn steepness(&self, measure: impl Fn(Slopes) -> f64) -> f64 {
        let places = (0..2 * HALF).map(|i| distance_of((i as f64 + 0.5) / 2.0));
        let both = places.flat_map(|near| [(near, 1.0 - near), (1.0 - near, near)].map(|(s, r)| (near, self.at(s, r))));
        both.map(|(near, at)| measure(at) / near.sqrt()).fold(0.0, f64::max)
    }

    fn at(&self, s: f64, r: f64) -> Slopes {
        let start = s < r;
        let near = if start { s } else { r };
        let place = near.sqrt() / WIDTH;
        let cell = (place as usize).min(HALF - 1);
        let t = place - cell as f64;
        let [a, b, c, d] = self.cells[cell + if start { 0 } else { HALF }];
        let (slope, bend) = (b + t * (2.0 * c + 3.0 * t * d), 2.0 * c + 6.0 * t * d);
        // dt/dx, and its own derivative by t.
        let side = if start { 0.5 } else { -0.5 };
        let pace = side * place * (1.0 - near);
        let change = side * (1.0 - 3.0 * near);
        Slopes { g: a + t * (b + t * (c + t * d)), first: pace * slope, second: pace * (change * slope + pace * bend) }
    }

    /// The share of the time left after the logarithm of the gap has grown, by Taylor's method of third order.
    pub(super) fn followed(&self, r: f64, growth: f64) -> f64 {
        let v = ((1.0 - r).min(r).sqrt() * (1.0 + growth.abs())).min(0.71);
        let number = (growth.abs() * v * self.parts).ceil().clamp(1.0, MOST_PARTS);
        let part = growth / number;
        let mut left = r;
        for _ in 0..number as usize {
            let gone = 1.0 - left;
            let Slopes { g, first, second } = self.at(gone, left);
            let change = part * g * (1.0 + 0.5 * part * (first + part / 3.0 * (first * first + g * second)));
            let e = change.exp_m1();
            left = (left - gone * left * e / (1.0 + gone * e)).clamp(f64::MIN_POSITIVE, 1.0);
        }
        left
    }
}

/// Width of a piece in v.
pub const WIDTH: f64 = std::f64::consts::FRAC_1_SQRT_2 / HALF as f64;

/// Distance to the end of the border between two pieces.
fn distance(border: usize) -> f64 {
    distance_of(border as f64)
}

fn distance_of(place: f64) -> f64 {
    (WIDTH * place).powi(2).min(0.5)
}

/// The exact pace at one place.
struct Exact {
    /// ds / d ln u.
    pace: f64,
    /// Of the sign of h'.
    turn: f64,
    /// Share of the way left.
    left: f64,
    /// Relative rate h.
    rate: f64,
}

impl Exact {
    fn new(kind: &Kind, start: f64, s: f64, r: f64) -> Self {
        let step = (0.01 * s.min(r)).min(1e-3);
        let rate = |n: f64| kind.at(r + n * step).rate;
        let bend = (8.0 * (rate(-1.0) - rate(1.0)) - (rate(-2.0) - rate(2.0))) / (12.0 * step);
        let Point { left, rate } = kind.at(r);
        let turn = rate * rate + left * bend;
        let pace = -(rate - left * start) * left / turn;
        // Where nothing moves there is no other phase to go to.
        let moves = rate > 0.0 && left > 0.0 && pace.is_finite();
        Self { pace: if moves { pace } else { 0.0 }, turn, left, rate: rate / left }
    }
}

/// The largest pace within the exact one that changes no faster than [`STEEPEST`], and is 0 where h turns.
fn limit(exact: &[Exact]) -> Vec<f64> {
    // E-folds of the way between neighbours.
    let folds: Vec<f64> = exact.windows(2).map(|pair| (pair[0].left / pair[1].left).ln()).collect();
    let mut size: Vec<f64> = exact.iter().map(|at| (at.pace * at.rate).abs()).collect();
    for (i, pair) in exact.windows(2).enumerate() {
        if pair[0].turn * pair[1].turn <= 0.0 {
            let share = pair[0].turn.abs() / (pair[0].turn.abs() + pair[1].turn.abs()).max(f64::MIN_POSITIVE);
            size[i] = size[i].min(STEEPEST * folds[i] * share);
            size[i + 1] = size[i + 1].min(STEEPEST * folds[i] * (1.0 - share));
        }
    }
    for i in 0..folds.len() {
        size[i + 1] = size[i + 1].min(size[i] + STEEPEST * folds[i]);
    }
    for i in (0..folds.len()).rev() {
        size[i] = size[i].min(size[i + 1] + STEEPEST * folds[i]);
    }
    exact.iter().zip(size).map(|(at, size)| if size > 0.0 { at.pace.signum() * size / at.rate } else { 0.0 }).collect()
}

/// Cubics through values at equal distances, with the slopes of the parabolas through three neighbours.
fn pieces(values: &[f64]) -> Vec<[f64; 4]> {
    let last = values.len() - 1;
    let slope = |i: usize| match i {
        0 => 2.0 * values[1] - 1.5 * values[0] - 0.5 * values[2],
        i if i == last => 1.5 * values[i] + 0.5 * values[i - 2] - 2.0 * values[i - 1],
        i => 0.5 * (values[i + 1] - values[i - 1]),
    };
    (0..last)
        .map(|i| {
            let (step, before, after) = (values[i + 1] - values[i], slope(i), slope(i + 1));
            [values[i], before, 3.0 * step - 2.0 * before - after, before + after - 2.0 * step]
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::super::{Function, FunctionError, Sample, Shape, phase};
    use super::*;
    use crate::thermal::function::Superposition;
    use std::sync::Arc;

    fn shape(function: Result<Function, FunctionError>) -> Arc<Shape> {
        let Ok(Function::Shaped(shape)) = function else { panic!("a shape") };
        shape
    }

    /// Functions whose relative rate turns: once, by corners, many times.
    fn turning() -> Vec<Arc<Shape>> {
        let points =
            [(0.0, 300.0), (1.0, 280.0), (2.0, 261.0), (4.0, 235.0), (7.0, 211.0), (9.0, 203.0), (12.0, 200.0)];
        let samples = points.map(|(time, temperature)| Sample { time, temperature });
        vec![
            shape(Function::logarithmic(2.0)),
            shape(Function::logarithmic(9.0)),
            shape(Function::logarithmic(100.0)),
            shape(Function::table(&samples, None)),
        ]
    }

    fn pace(shape: &Shape) -> &Pace {
        shape.pace().expect("a pace")
    }

    #[test]
    fn where_the_relative_rate_grows_following_finds_the_root() {
        for text in ["s*s*(3.0-2.0*s)", "pow(s, 1.5)", "1.0-pow(1.0-s, 2.5)", "log(1.0+s)/log(2.0)"] {
            let shape = shape(Function::expression(text));
            for i in 5..=95 {
                let (r, change) = (f64::from(i) / 100.0, [0.01_f64, -0.01, 0.3, -0.3, 2.0][i as usize % 5]);
                let sum = Superposition::new(1.0, change);
                let root = phase::merged(&shape.kind, &[], r, sum);
                let found = pace(&shape).followed(r, change.ln_1p());
                assert!((found - root).abs() < 2e-6, "{text}, r {r}, {change}: {found} for {root}");
                assert!((root - r).abs() > 2e-4, "{text}, r {r}, {change}: nothing moves");
            }
        }
    }

    /// Away from the extremum, where a = h'/h^2 is above a half, the rule of the root stays.
    #[test]
    fn a_logarithm_takes_the_root_away_from_its_extremum() {
        for rate in [2.0, 9.0] {
            let shape = shape(Function::logarithmic(rate));
            let bend = |r: f64| (1.0 - f64::ln_1p(rate) * shape.kind.at(r).left).abs();
            let mut compared = 0;
            for i in 1..200 {
                let (r, change) = (f64::from(i) / 200.0, if i % 2 == 0 { 0.02_f64 } else { -0.02 });
                let found = pace(&shape).followed(r, change.ln_1p());
                if bend(r) > 0.5 && bend(found) > 0.5 {
                    let root = phase::merged(&shape.kind, shape.turns(), r, Superposition::new(1.0, change));
                    assert!((found - root).abs() < 1e-5, "rate {rate}, r {r}: {found} for {root}");
                    compared += usize::from((root - r).abs() > 1e-4);
                }
            }
            assert!(compared > 60, "rate {rate}: {compared} compared");
        }
    }

    /// A change and its reverse cancel, and its parts make the same of it; the rule of the root fails both next to an extremum.
    #[test]
    fn what_turns_is_followed_there_and_back_and_in_parts() {
        for shape in turning() {
            let follow = |r: f64, growth: f64| pace(&shape).followed(r, growth);
            let root = |r: f64, growth: f64| {
                phase::merged(&shape.kind, shape.turns(), r, Superposition::new(1.0, growth.exp_m1()))
            };
            let worst = |rule: &dyn Fn(f64, f64) -> f64| {
                let mut worst = [0.0_f64; 2];
                for i in 1..400 {
                    let (r, growth) = (f64::from(i) / 400.0, if i % 2 == 0 { 0.02_f64 } else { -0.02 });
                    let there = rule(r, growth);
                    let in_parts = (0..20).fold(r, |r, _| rule(r, growth / 20.0));
                    worst = [worst[0].max((rule(there, -growth) - r).abs()), worst[1].max((in_parts - there).abs())];
                }
                worst
            };
            let (followed, rooted) = (worst(&follow), worst(&root));
            // What is left is of Taylor's method, most at rate 100.
            assert!(followed.iter().all(|error| *error < 5e-4), "{}: {followed:?}", shape.kind.name());
            assert!(rooted.iter().all(|error| *error > 2e-3), "{}: {rooted:?}", shape.kind.name());
        }
    }
}
