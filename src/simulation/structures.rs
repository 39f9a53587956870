//! Structures below plates in a periodic warm-up. Each is moved to where the secant of its last two orbits finds its periodic state.

/// Largest share of its distance that a structure may keep over an orbit, beyond which the secant is not used.
const STUCK: f64 = 0.9999;

/// The last orbit of every structure: its temperatures at the start and at the end [K].
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub(super) struct Structures {
    last: Option<[Vec<f64>; 2]>,
}

impl Structures {
    /// Temperatures nearer to the periodic state [K], after an orbit from `from` to `to` [K]. `None` in the first orbit.
    pub(crate) fn ahead(&mut self, from: &[f64], to: &[f64]) -> Option<Vec<f64>> {
        let last = self.last.replace([from.to_vec(), to.to_vec()])?;
        let [starts, ends] = &last;
        let own = |(((from, to), start), end): (((&f64, &f64), &f64), &f64)| {
            let kept = (to - end) / (from - start);
            let ahead = (to - kept * from) / (1.0 - kept);
            let sane = kept.abs() < STUCK && ahead > 0.5 * to && ahead < 2.0 * to;
            if sane { ahead } else { *to }
        };
        Some(from.iter().zip(to).zip(starts).zip(ends).map(own).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slow_structure_is_found_after_two_orbits() {
        // They keep 0.97 and 0.2 of their distance over an orbit. The third does not move.
        let orbit = |t: &[f64]| vec![280.0 + 0.97 * (t[0] - 280.0), 200.0 + 0.2 * (t[1] - 200.0), t[2]];
        let mut structures = Structures::default();
        let start = vec![250.0, 300.0, 270.0];
        let first = orbit(&start);
        assert_eq!(structures.ahead(&start, &first), None);
        let second = orbit(&first);
        let found = structures.ahead(&first, &second).unwrap();
        for (found, exact) in found.iter().zip([280.0, 200.0, 270.0]) {
            assert!((found - exact).abs() < 1e-9, "{found} for {exact}");
        }
        assert!((second[0] - 280.0).abs() > 20.0, "without the secant it is far away");
    }
}
