//! Compares the paper's cube in orbit (figures 2, 3 and 4) with the energy balance.
//!
//! The paper's numbers come from its plots or are approximate. The paper states no solar constant and no planet loads. The altitude does not fit the
//! period (docs/numerics.md 2). Where that matters, both values are shown.

use super::checks::{PaperCheck, Tolerance};
use super::cube::{ALTITUDES, Extremes, FACES, PERIOD, PLANET_RADIUS, SIDE, SPACE, ZENITH, mean};
use super::orbits::{Orbits, SolvedCube};
use crate::environment::orbit::kepler_period;

/// The rows of docs/numerics.md 2.
pub(crate) fn checks(orbits: &Orbits) -> Vec<PaperCheck> {
    let mut rows = CheckRows(Vec::new());
    rows.orbit(orbits);
    rows.aluminium(orbits);
    rows.mli(orbits);
    rows.all_loads(orbits);
    rows.0
}

/// docs/numerics.md 2: lowest and highest temperature [K] of every face at both altitudes, rounded to 1 K.
const RANGES: [[[f64; 2]; 6]; 2] = [
    [[194.0, 695.0], [194.0, 695.0], [194.0, 396.0], [194.0, 396.0], [3.0, 692.0], [250.0, 511.0]],
    [[175.0, 694.0], [175.0, 694.0], [175.0, 355.0], [175.0, 355.0], [3.0, 692.0], [240.0, 568.0]],
];

/// Step half an orbit after noon. No visible ground is lit, so planet infrared is the only load.
const MIDNIGHT: usize = 160;
/// Step at which the +Y face leaves the eclipse in the paper.
const STATED_EXIT: usize = 264;

struct CheckRows(Vec<PaperCheck>);

impl CheckRows {
    fn state(&mut self, statement: &str, expected: f64, computed: f64, unit: &'static str, tolerance: Tolerance) {
        self.0.push(PaperCheck { statement: format!("scenario: {statement}"), expected, computed, tolerance, unit });
    }

    fn read(&mut self, statement: &str, expected: f64, computed: f64, unit: &'static str, reading: f64) {
        self.state(statement, expected, computed, unit, Tolerance::Reading(reading));
    }

    fn orbit(&mut self, orbits: &Orbits) {
        let period = kepler_period(PLANET_RADIUS + ALTITUDES[0]);
        self.read("period of a circular orbit at the stated 224 km", PERIOD, period, "s", 1.0);
        let night = |faces: &[f64; 6]| faces[ZENITH] < SPACE + 1.0;
        let zenith = &orbits.mli[0].orbit;
        let begins = zenith.iter().position(night).unwrap_or(0);
        let ends = zenith.iter().skip(begins).position(|t| !night(t)).map_or(zenith.len(), |steps| begins + steps);
        self.read("eclipse begins, taken as the zenith face's own night", 75.0, begins as f64, "steps", 5.0);
        self.read("eclipse ends, taken as the zenith face's own night", 250.0, ends as f64, "steps", 5.0);
        for solved in &orbits.shadowed {
            let place = format!("taken as the planet's shadow at {}", altitude(solved));
            let [begins, ends] = solved.shadow.unwrap_or([f64::NAN; 2]);
            self.read(&format!("eclipse begins, {place}"), 75.0, begins, "steps", 5.0);
            self.read(&format!("eclipse ends, {place}"), 250.0, ends, "steps", 5.0);
        }
    }

    fn aluminium(&mut self, orbits: &Orbits) {
        for solved in &orbits.aluminium {
            let (what, extremes) = (figure_2(solved), Extremes::of(&solved.orbit, ZENITH));
            let mean = mean(&solved.orbit, ZENITH);
            self.read(&format!("{what}: mean, in the upper 200s"), 285.0, mean, "K", 10.0);
            let swing = extremes.highest - extremes.lowest;
            self.read(&format!("{what}: highest less lowest"), 1.0, swing, "K", 0.1);
            self.read(&format!("{what}: step of the lowest"), 270.0, extremes.lowest_step, "steps", 5.0);
            self.read(&format!("{what}: step of the highest"), 50.0, extremes.highest_step, "steps", 5.0);
            self.read(&format!("{what}: rise, 140 to 150"), 145.0, extremes.rise(), "steps", 5.0);
            self.read(&format!("{what}: fall"), 220.0, extremes.fall(), "steps", 5.0);
        }
        for solved in orbits.conducting.iter().chain(&orbits.shadowed) {
            let mean = mean(&solved.orbit, ZENITH);
            self.read(&format!("{}: mean, on a scale to 260 K", figure_2(solved)), 260.0, mean, "K", 5.0);
        }
        for (without, with) in orbits.aluminium.iter().zip(&orbits.conducting) {
            let [without, fall] = [without, with].map(|solved| Extremes::of(&solved.orbit, ZENITH).fall());
            let statement = format!("{}: falls a little faster than without conduction, fall", figure_2(with));
            self.state(&statement, without, fall, "steps", Tolerance::Below);
        }
    }

    fn mli(&mut self, orbits: &Orbits) {
        for solved in &orbits.mli {
            let (what, extremes) = (figure_2(solved), Extremes::of(&solved.orbit, ZENITH));
            self.read(&format!("{what}: highest temperature"), 700.0, extremes.highest, "K", 10.0);
            self.read(&format!("{what}: lowest temperature"), 0.0, extremes.lowest, "K", 10.0);
            self.read(&format!("{what}: step of the highest"), 340.0, extremes.highest_step, "steps", 1.0);
        }
    }

    fn all_loads(&mut self, orbits: &Orbits) {
        for solved in &orbits.all_loads {
            let what = format!("figure 4, MLI, +Y face, all loads, {}", altitude(solved));
            let at = |step: usize| solved.orbit.get(step).map_or(f64::NAN, |faces| faces[SIDE]);
            self.read(&format!("{what}: in eclipse, about 180 K"), 180.0, at(MIDNIGHT), "K", 10.0);
            let Extremes { lowest, highest, .. } = Extremes::of(&solved.orbit, SIDE);
            let share = 100.0 * (at(STATED_EXIT) - lowest) / (highest - lowest);
            let statement =
                format!("{what}: leaves the eclipse near step {STATED_EXIT}, share of the rise done by then");
            self.read(&statement, 0.0, share, "%", 10.0);
        }
        for (solved, ranges) in orbits.all_loads.iter().zip(RANGES) {
            for (face, [lowest, highest]) in ranges.into_iter().enumerate() {
                let what = format!("figure 3, MLI, {} face, all loads, {}", FACES[face], altitude(solved));
                let extremes = Extremes::of(&solved.orbit, face);
                for (end, expected, computed) in
                    [("lowest", lowest, extremes.lowest), ("highest", highest, extremes.highest)]
                {
                    let statement = format!("{what}: {end}, against an independent computation");
                    self.read(&statement, expected, computed, "K", 1.0);
                }
            }
        }
    }
}

fn altitude(solved: &SolvedCube) -> String {
    format!("{} km", solved.case.altitude / 1e3)
}

/// Description of a line in figure 2.
fn figure_2(solved: &SolvedCube) -> String {
    let shadow = match solved.shadow {
        Some(_) => format!("planet shadow at {}", altitude(solved)),
        None => "no planet shadow".to_owned(),
    };
    format!("figure 2, {}, zenith face, {} W/m2, {shadow}", solved.case, solved.case.solar_constant)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper::independent_tests;

    fn find<'a>(checks: &'a [PaperCheck], words: &[&str]) -> &'a PaperCheck {
        let mut computed = checks.iter().filter(|check| words.iter().all(|word| check.statement.contains(word)));
        let check = computed.next().unwrap_or_else(|| panic!("no row {words:?}"));
        assert!(computed.next().is_none(), "more than one row {words:?}");
        check
    }

    /// docs/numerics.md 2: the column "computed", and whether the paper's number is reproduced.
    #[test]
    fn the_rows_are_those_of_numerics_2() {
        let checks = checks(&independent_tests::orbits());
        let al = "Al, radiating, zenith";
        let conducting = "Al, radiating and conducting, zenith";
        let [dim, bright, bare] = ["1361 W", "1367 W", "no planet shadow"];
        let rows: [(&[&str], f64, f64, bool); 33] = [
            (&[al, dim, "mean"], 284.47, 0.006, true),
            (&[al, bright, "mean"], 284.78, 0.006, true),
            (&[al, dim, "highest less"], 1.064, 6e-4, true),
            (&[al, bright, "highest less"], 1.069, 6e-4, true),
            (&[al, dim, "of the lowest"], 268.4, 0.06, true),
            (&[al, dim, "of the highest"], 51.3, 0.06, true),
            (&[al, dim, "rise"], 142.9, 0.06, true),
            (&[al, dim, ": fall"], 217.1, 0.06, true),
            (&[conducting, dim, bare, "mean"], 257.3, 0.06, true),
            (&[conducting, bright, bare, "mean"], 257.5, 0.06, true),
            (&[conducting, dim, "shadow at 224", "mean"], 224.2, 0.06, false),
            (&[conducting, dim, "shadow at 772", "mean"], 230.4, 0.06, false),
            (&[conducting, dim, "falls a little faster"], 219.1, 0.06, false),
            (&["MLI, radiating, zenith", dim, "highest temp"], 691.0, 0.06, true),
            (&["MLI, radiating, zenith", bright, "highest temp"], 691.8, 0.06, true),
            (&["MLI, radiating, zenith", dim, "lowest"], 2.7, 1e-6, true),
            (&["MLI, radiating, zenith", dim, "step of"], 340.0, 0.01, true),
            (&["eclipse begins", "own night"], 70.0, 1.1, true),
            (&["eclipse ends", "own night"], 250.0, 1.1, true),
            (&["eclipse begins", "224 km"], 85.0, 0.6, false),
            (&["eclipse ends", "224 km"], 235.0, 0.6, false),
            (&["eclipse begins", "772 km"], 97.0, 0.6, false),
            (&["eclipse ends", "772 km"], 223.0, 0.6, false),
            (&["+Y", "224 km", "in eclipse"], 193.8, 0.06, false),
            (&["+Y", "772 km", "in eclipse"], 174.6, 0.06, true),
            (&["period of"], 5339.0, 1.0, false),
            (&["224 km", "+Z", "highest"], 692.0, 0.6, true),
            (&["224 km", "-Z", "lowest"], 250.0, 0.6, true),
            (&["224 km", "-Z", "highest"], 511.0, 0.6, true),
            (&["772 km", "-Z", "highest"], 568.0, 0.6, true),
            (&["224 km", "-X", "highest"], 695.0, 0.6, true),
            (&["224 km", "+Y", "highest"], 396.0, 0.6, true),
            (&["772 km", "+Y", "highest"], 355.0, 0.6, true),
        ];
        for check in &checks {
            println!("{} {:.4} {}", check.statement_with_unit(), check.computed, check.agrees());
        }
        for (words, value, margin, agrees) in rows {
            let check = find(&checks, words);
            assert!((check.computed - value).abs() <= margin, "{value}: {check:?}");
            assert_eq!(check.agrees(), agrees, "{check:?}");
        }
    }
}
