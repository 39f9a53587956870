//! The emissivity of a face as a product of two tables, over the angle and over the temperature: the twin of the shader (docs/numerics.md 5a).

use super::emissivity::BandEmissivity;
use super::passband::Passband;
use super::radiance::MIDDLE_TEMPERATURE;

/// Entries over the square root of the cosine from the normal, dense where a surface is seen edge-on, where metals have their peak.
pub(crate) const ANGLES: usize = 129;
/// Entries over v = T / (T + 400 K).
pub(crate) const TEMPERATURES: usize = 129;
pub(crate) const TABLE_VALUES: usize = ANGLES + TEMPERATURES;

/// Temperature of the last entry [K], whose v is 1.
const HOTTEST: f64 = 1e9;

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct EmissivityTable {
    /// Factors over the angle, then factors over the temperature: [`TABLE_VALUES`] numbers.
    pub(crate) values: Vec<f64>,
}

impl EmissivityTable {
    /// Tabulates a law in a band. `plain` is the emissivity of a face without one.
    pub(crate) fn new(law: &BandEmissivity, plain: f64, passband: impl Into<Passband>) -> Self {
        let passband = passband.into();
        let along_normal = law.by_angle.as_ref().map_or(1.0, |by_angle| by_angle.at(1.0));
        let angles = (0..ANGLES).map(|entry| {
            let cosine = (entry as f64 / (ANGLES - 1) as f64).powi(2);
            match (&law.by_angle, &law.by_wavelength) {
                (Some(by_angle), Some(_)) => by_angle.at(cosine) / along_normal,
                (Some(by_angle), None) => by_angle.at(cosine),
                (None, _) => 1.0,
            }
        });
        let temperatures = (0..TEMPERATURES).map(|entry| {
            let v = entry as f64 / (TEMPERATURES - 1) as f64;
            let temperature = if v < 1.0 { MIDDLE_TEMPERATURE * v / (1.0 - v) } else { HOTTEST };
            match (&law.by_wavelength, &law.by_angle) {
                (Some(by_wavelength), _) => by_wavelength.in_band(passband.clone(), temperature),
                (None, Some(_)) => 1.0,
                (None, None) => plain,
            }
        });
        Self { values: angles.chain(temperatures).collect() }
    }

    /// Emissivity at a temperature [K] and a cosine of the angle from the normal.
    pub(crate) fn emissivity(&self, temperature: f64, cosine: f64) -> f64 {
        self.temperature_factor(temperature) * self.angle_factor(cosine)
    }

    pub(crate) fn angle_factor(&self, cosine: f64) -> f64 {
        read(&self.values[..ANGLES], cosine.clamp(0.0, 1.0).sqrt())
    }

    pub(crate) fn temperature_factor(&self, temperature: f64) -> f64 {
        let temperature = temperature.max(0.0);
        read(&self.values[ANGLES..], temperature / (temperature + MIDDLE_TEMPERATURE))
    }

    /// Largest emissivity at any angle and temperature.
    pub(crate) fn largest(&self) -> f64 {
        let most = |values: &[f64]| values.iter().copied().fold(0.0, f64::max);
        most(&self.values[..ANGLES]) * most(&self.values[ANGLES..])
    }
}

/// Value of a table at a place in [0, 1].
fn read(values: &[f64], place: f64) -> f64 {
    let at = place * (values.len() - 1) as f64;
    let cell = (at as usize).min(values.len() - 2);
    values[cell] + (at - cell as f64) * (values[cell + 1] - values[cell])
}

#[cfg(test)]
mod tests {
    use super::super::emissivity::{ByAngle, ByWavelength};
    use super::super::planck::Band;
    use super::*;

    const BAND: Band = Band { lower: 8e-6, upper: 14e-6 };

    #[test]
    fn the_tables_follow_their_laws() {
        for (n, k) in [(1.5, 0.0), (2.0, 0.5), (12.0, 30.0), (33.6, 76.4)] {
            let by_angle = ByAngle::Fresnel { n, k };
            let law = BandEmissivity { by_angle: Some(by_angle.clone()), by_wavelength: None };
            let table = EmissivityTable::new(&law, 0.5, BAND);
            let error = |shift: f64| {
                let cosines = (0..=2000).map(|step| f64::from(step) / 2000.0);
                let off =
                    |cosine: f64| (table.emissivity(300.0, cosine) - by_angle.at((cosine + shift).min(1.0))).abs();
                cosines.map(off).fold(0.0, f64::max)
            };
            println!("n = {n}, k = {k}: off by {:.1e}", error(0.0));
            assert!(error(0.0) < 1e-3 && error(0.02) > 1e-3, "{n}, {k}: {}", error(0.0));
            assert!(table.largest() <= 1.0);
        }
    }

    #[test]
    fn a_law_over_wavelengths_follows_the_temperature() {
        let points = vec![[8e-6, 0.2], [9e-6, 0.9], [11e-6, 0.4], [14e-6, 0.8]];
        let by_wavelength = ByWavelength { points, temperature: None };
        let law = BandEmissivity { by_angle: None, by_wavelength: Some(by_wavelength.clone()) };
        let table = EmissivityTable::new(&law, 0.5, BAND);
        for temperature in [40.0, 77.0, 180.0, 255.0, 300.0, 411.0, 900.0, 5772.0] {
            let (computed, exact) = (table.emissivity(temperature, 0.3), by_wavelength.in_band(BAND, temperature));
            assert!((computed - exact).abs() < 2e-4, "{temperature} K: {computed} against {exact}");
        }
        assert!((by_wavelength.in_band(BAND, 200.0) - by_wavelength.in_band(BAND, 300.0)).abs() > 2e-3);
    }

    /// With both laws the angle says how the emissivity changes from that along the normal.
    #[test]
    fn both_laws_are_a_product() {
        let by_angle = ByAngle::Table(vec![[0.0, 0.5], [1.0, 0.25], [std::f64::consts::FRAC_PI_2, 0.0]]);
        let by_wavelength = ByWavelength { points: vec![[8e-6, 0.8], [14e-6, 0.8]], temperature: Some(300.0) };
        let law = BandEmissivity { by_angle: Some(by_angle), by_wavelength: Some(by_wavelength) };
        let table = EmissivityTable::new(&law, 0.1, BAND);
        assert!((table.emissivity(200.0, 1.0) - 0.8).abs() < 1e-12);
        assert!((table.emissivity(200.0, 1.0_f64.cos()) - 0.4).abs() < 2e-3);
    }
}
