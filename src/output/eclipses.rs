//! The eclipses of a run, which its plots shade.

use crate::simulation::prepare::Prepared;

/// Eclipses: start and end of each [s].
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Eclipses {
    /// The planet hides the whole Sun.
    pub(crate) umbra: Vec<(f64, f64)>,
    /// The planet hides a part of the Sun.
    pub(crate) penumbra: Vec<(f64, f64)>,
}

impl Eclipses {
    /// Umbra and penumbra intervals, clipped to the run.
    pub(crate) fn of(prepared: &Prepared) -> Self {
        let time = &prepared.scene.time;
        let end = f64::from(time.steps) * time.step;
        let sky = prepared.loads.sky_model();
        let mut borders = vec![0.0];
        borders.extend(sky.contacts(0.0, end));
        borders.push(end);
        let mut eclipses = Self::default();
        if prepared.scene.environment.solar_constant.is_none() {
            return eclipses;
        }
        for pair in borders.windows(2) {
            let lit = sky.lit_fraction(0.5 * (pair[0] + pair[1]));
            if lit <= 0.0 {
                eclipses.umbra.push((pair[0], pair[1]));
            } else if lit < 1.0 {
                eclipses.penumbra.push((pair[0], pair[1]));
            }
        }
        eclipses
    }

    /// Name of the shadow at a time [s]: `umbra` or `penumbra`.
    pub(crate) fn at(&self, time: f64) -> Option<&'static str> {
        let within = |intervals: &[(f64, f64)]| intervals.iter().any(|(start, end)| (*start..*end).contains(&time));
        let shadows = [("umbra", &self.umbra), ("penumbra", &self.penumbra)];
        shadows.into_iter().find(|(_, intervals)| within(intervals)).map(|(name, _)| name)
    }
}

#[cfg(test)]
mod tests {
    use super::Eclipses;

    #[test]
    fn a_time_has_the_name_of_its_shadow() {
        let eclipses = Eclipses { umbra: vec![(2100.0, 4200.0)], penumbra: vec![(2092.0, 2100.0), (4200.0, 4208.0)] };
        let names = [2091.0, 2092.0, 2100.0, 4199.0, 4207.0, 4208.0].map(|time| eclipses.at(time));
        assert_eq!(names, [None, Some("penumbra"), Some("umbra"), Some("umbra"), Some("penumbra"), None]);
        assert_eq!(Eclipses::default().at(3000.0), None);
    }
}
