//! The orbits of a periodic warm-up so far, and their extrapolation by Anderson's method (J. ACM 12, 1965).

use super::structures::Structures;

/// Orbits that an extrapolation uses.
const DEPTH: usize = 3;
/// Result of a periodic warm-up.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Periodic {
    /// Number of orbits.
    pub orbits: u32,
    /// Number of coarse orbits, which come first.
    pub(crate) coarse: u32,
    /// Largest change of a node over the last orbit [K].
    pub(crate) change: f64,
    /// Tolerance [K].
    pub(crate) tolerance: f64,
}

impl Periodic {
    /// Whether a fine orbit met the tolerance.
    pub fn is_met(&self) -> bool {
        self.change <= self.tolerance && self.coarse < self.orbits
    }

    /// The warm-up in words.
    pub fn summary(&self) -> String {
        let coarse = match self.coarse {
            0 => String::new(),
            coarse => format!(" ({coarse} of them coarse)"),
        };
        format!("{} orbits{coarse}; the last one changed a node by up to {:.1e} K", self.orbits, self.change)
    }

    /// A warning for the user if the warm-up missed its tolerance. `of` names the run.
    pub(crate) fn warning(&self, of: &str) -> Option<String> {
        self.missed(of, "State a larger warm_up_orbits or warm_up_tolerance")
    }

    /// The same of a run beside another one, which `most` orbits end, or earlier orbits that no longer come nearer to each other.
    pub(crate) fn warning_beside(&self, of: &str, most: f64) -> Option<String> {
        let stalled = "The orbits came no nearer to each other, as with a thermostat that switches at other times: what is left stands in the error";
        if f64::from(self.orbits) < most { self.missed(of, stalled) } else { self.warning(of) }
    }

    fn missed(&self, of: &str, advice: &str) -> Option<String> {
        (!self.is_met()).then(|| {
            let tolerance = self.tolerance;
            format!("The warm-up{of} did not become periodic within {tolerance} K: {}. {advice}.", self.summary())
        })
    }
}

/// The orbits of a periodic warm-up so far. A saved state keeps them.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(crate) struct Orbits {
    pub(super) done: Periodic,
    pub(super) history: History,
    pub(super) structures: Structures,
    pub(super) coarse: bool,
    /// Change of the last orbit [K].
    pub(super) last: f64,
}

impl Orbits {
    pub(super) fn new(tolerance: f64, coarse: bool) -> Self {
        let done = Periodic { orbits: 0, coarse: 0, change: f64::INFINITY, tolerance };
        Self { done, history: History::default(), structures: Structures::default(), coarse, last: f64::INFINITY }
    }
}

/// The last orbits: the temperatures at the end of each, and their changes.
#[derive(Debug, Clone, Default, serde::Serialize, serde::Deserialize)]
pub(super) struct History {
    ends: Vec<Vec<f64>>,
    changes: Vec<Vec<f64>>,
}

impl History {
    /// Temperatures nearer to the periodic state than the end `to` of the orbit from `from`. `None` where there is no earlier orbit, or the result is not a
    /// valid temperature.
    pub(super) fn extrapolate(&mut self, from: &[f64], to: &[f64]) -> Option<Vec<f64>> {
        let change: Vec<f64> = to.iter().zip(from).map(|(to, from)| to - from).collect();
        let known = self.ends.len();
        let differences: Vec<Vec<f64>> = self.changes.iter().map(|old| minus(&change, old)).collect();
        let weights = least_squares(&differences, &change);
        let mut guess = to.to_vec();
        if let Some(weights) = weights.filter(|_| known > 0) {
            for (weight, end) in weights.iter().zip(&self.ends) {
                for ((guess, to), end) in guess.iter_mut().zip(to).zip(end) {
                    *guess -= weight * (to - end);
                }
            }
        }
        self.ends.push(to.to_vec());
        self.changes.push(change);
        if self.ends.len() > DEPTH {
            self.ends.remove(0);
            self.changes.remove(0);
        }
        let sane = guess.iter().zip(to).all(|(guess, to)| *guess > 0.5 * to && *guess < 2.0 * to);
        (known > 0 && sane).then_some(guess)
    }
}

fn minus(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

/// Weights of `columns` whose sum is nearest to `target`, by the normal equations with slight regularisation.
fn least_squares(columns: &[Vec<f64>], target: &[f64]) -> Option<Vec<f64>> {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let n = columns.len();
    let mut rows: Vec<Vec<f64>> = (0..n)
        .map(|i| {
            let mut row: Vec<f64> = (0..n).map(|j| dot(&columns[i], &columns[j])).collect();
            row[i] *= 1.0 + 1e-10;
            row.push(dot(&columns[i], target));
            row
        })
        .collect();
    for pivot in 0..n {
        let best = (pivot..n).max_by(|a, b| rows[*a][pivot].abs().total_cmp(&rows[*b][pivot].abs()))?;
        rows.swap(pivot, best);
        if rows[pivot][pivot].abs() < 1e-30 {
            return None;
        }
        for other in (0..n).filter(|other| *other != pivot) {
            let factor = rows[other][pivot] / rows[pivot][pivot];
            let row = rows[pivot].clone();
            rows[other].iter_mut().zip(&row).for_each(|(value, pivot)| *value -= factor * pivot);
        }
    }
    Some((0..n).map(|i| rows[i][n] / rows[i][i]).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_orbits_are_advised_where_they_were_the_limit() {
        let missed = Periodic { orbits: 4, coarse: 0, change: 1.0, tolerance: 0.01 };
        let advises =
            |most| missed.warning_beside(" of a", most).is_some_and(|said| said.contains("larger warm_up_orbits"));
        assert!(advises(4.0) && !advises(100.0));
    }

    #[test]
    fn linear_maps_of_few_rates_are_solved_in_a_few_orbits() {
        // Two families of nodes keep 0.9 and 0.5 of their distance to the periodic state over an orbit.
        let periodic: Vec<f64> = (0..20).map(|i| 250.0 + f64::from(i)).collect();
        let orbit = |t: &[f64]| -> Vec<f64> {
            let kept = |i: usize| if i < 12 { 0.9 } else { 0.5 };
            (0..20).map(|i| periodic[i] + kept(i) * (t[i] - periodic[i])).collect()
        };
        let mut history = History::default();
        let mut now = vec![300.0; 20];
        let mut orbits = 0;
        while (0..20).any(|i| (now[i] - periodic[i]).abs() > 1e-3) {
            let end = orbit(&now);
            now = history.extrapolate(&now, &end).unwrap_or(end);
            orbits += 1;
            assert!(orbits < 10);
        }
        let mut plain = vec![300.0; 20];
        for _ in 0..orbits {
            plain = orbit(&plain);
        }
        assert!((plain[0] - periodic[0]).abs() > 10.0, "without extrapolation it would be far away");
    }
}
