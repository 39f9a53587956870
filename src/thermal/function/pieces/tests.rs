//! Pieces of functions of every kind, and what they must notice.

use super::*;
use crate::thermal::function::{Function, TemperatureSample};

/// Largest difference between the pieces and a function, also between their interpolation points.
fn error(pieces: &FunctionPieces, remaining: impl Fn(f64) -> f64) -> f64 {
    let places =
        (0..=200_000).map(|i| f64::from(i) / 200_000.0).chain((3..30).map(|n| 0.1f64.powf(f64::from(n) / 3.0)));
    places.map(|r| (pieces.remaining(r) - remaining(r)).abs()).fold(0.0, f64::max)
}

#[test]
fn pieces_follow_functions_that_start_and_end_as_powers() {
    for text in [
        "s",
        "s*s*s*s",
        "sqrt(s)",
        "pow(s, 1.5)",
        "1.0-pow(1.0-s, 2.5)",
        "1.0-acos(s)/1.5707963",
        "1.0-acos(s*s)/1.5707963",
        "smoothstep(0.0, 1.0, s)",
        "tanh(20.0*s)/tanh(20.0)",
    ] {
        let function = Function::expression(text).unwrap_or_else(|error| panic!("{error}"));
        let pieces = function.pieces();
        let idle = 1.0 - function.active();
        let computed = error(&pieces, |r| function.remaining(idle + (1.0 - idle) * r));
        assert!(computed < 5e-7 && pieces.error < 5e-7, "{text}: {computed:.1e}, told {:.1e}", pieces.error);
        assert!(error(&pieces, |r| function.remaining(0.999 * r)) > 1e-5, "{text}: another function shows");
    }
    for function in [Function::exponential(500.0), Function::logarithmic(1e4), Function::logarithmic(1.75)] {
        let function = function.unwrap_or_else(|error| panic!("{error}"));
        // An exponential of rate 500 is over, in f64, when a fourteenth of its time has passed.
        let idle = 1.0 - function.active();
        let found = error(&function.pieces(), |r| function.remaining(idle + (1.0 - idle) * r));
        assert!(found < 5e-7, "{function}: {found:.1e}");
    }
}

#[test]
fn corners_are_met_wherever_they_are() {
    for place in [0.3, 0.4, 0.123_456, 0.5, 0.777_77, 0.01, 0.99] {
        let text = format!("s < {place} ? {}*s : 1.0 - {}*(1.0-s)", 0.8 / place, 0.2 / (1.0 - place));
        let function = Function::expression(&text).unwrap_or_else(|error| panic!("{error}"));
        let computed = error(&function.pieces(), |r| function.remaining(r));
        assert!(computed < 1e-6, "{text}: {computed:.1e}");
    }
    // One line alone would err by a share of the corner.
    let bent = Function::expression("clamp(100.0*(s-0.3), 0.0, 1.0)").unwrap_or_else(|error| panic!("{error}"));
    let found = error(&bent.pieces(), |r| bent.remaining(1.0 - bent.active() + bent.active() * r));
    assert!(found < LARGEST_ERROR, "{found:.1e}");
    let alone = bent.pieces().cells[..2 * SIDE].iter().filter(|cell| cell[1] < 0.0).count();
    assert!(alone > 0 && alone < SIDE / 10, "{alone} pieces are divided");
}

/// A table with steep changes of rate has more pieces.
#[test]
fn sharp_functions_have_more_pieces() {
    let points = [(0.0, 300.0), (5.0, 299.0), (5.02, 230.0), (5.05, 229.0), (10.0, 200.0)];
    let samples = points.map(|(time, temperature)| TemperatureSample { time, temperature });
    let function = Function::table(&samples, None).unwrap_or_else(|error| panic!("{error}"));
    let pieces = function.pieces();
    assert!(pieces.cells.len() > 2 * SIDE && pieces.cells.len() <= MOST, "{}", pieces.cells.len());
    let computed = error(&pieces, |r| function.remaining(r));
    assert!(computed < 1.5 * SMALL_ERROR, "{computed:.1e}");
    let plain = Function::Quadratic.pieces();
    assert_eq!(plain.cells.len(), 2 * SIDE, "a smooth function needs no smaller pieces");
}

/// A piece stores its first value in f32 and ends at the value of the function in f64. The next piece begins at that value rounded to f32. This rounds a
/// share of 1/2 by 2^-26 at most, half of its last place. The rounding of an increase is below 1e-10.
const ROUNDING: f64 = 1.0 / (1u64 << 26) as f64 + 1e-10;

/// Largest decrease of the share done where two pieces meet.
fn largest_fall(pieces: &FunctionPieces) -> f64 {
    const BESIDE: f64 = 1e-13;
    let fall = |r: f64| pieces.remaining(r - BESIDE) - pieces.remaining(r + BESIDE);
    let mut worst = fall(0.5);
    for number in 0..2 * SIDE {
        // A divided piece has at most two levels of parts.
        let parts = if pieces.cells[number][1] < 0.0 { PARTS * PARTS } else { 1 };
        for part in (0..parts).filter(|part| number % SIDE + part > 0) {
            let v = ((number % SIDE) as f64 + part as f64 / parts as f64) / SIDE as f64;
            worst = worst.max(fall(if number < SIDE { 1.0 - distance(v) } else { distance(v) }));
        }
    }
    worst
}

#[test]
fn no_piece_falls() {
    let corners = "clamp(100.0*(s-0.3), 0.0, 1.0)";
    for text in ["s*s*s*s*s*s*s*s", "1.0-pow(1.0-s, 9.0)", "tanh(20.0*s)/tanh(20.0)", "min(1.0, 2.0*s)", corners] {
        let pieces = Function::expression(text).unwrap_or_else(|error| panic!("{error}")).pieces();
        assert!(pieces.cells.iter().all(|cell| cell[1] >= 0.0 || cell[1] <= -((2 * SIDE) as f32)), "{text}");
        assert!(largest_fall(&pieces) <= ROUNDING, "{text}: {:e}", largest_fall(&pieces));
        let mut steeper = pieces;
        steeper.cells[SIDE / 2][1] += 1e-7;
        assert!(largest_fall(&steeper) > ROUNDING, "{text}: a piece that ends above the next one shows");
    }
}
