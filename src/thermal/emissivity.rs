//! Emissivity of a face in the band of the images, over the angle from its normal and over the wavelength.

use super::passband::Passband;
use super::planck::Band;
use crate::environment::quadrature::GaussLegendre;

/// Emissivity over the angle from the normal.
#[derive(Debug, Clone, PartialEq)]
pub enum ByAngle {
    /// A smooth surface of a complex refractive index n + ik in vacuum, not polarised.
    Fresnel {
        /// Refractive index n.
        n: f64,
        /// Extinction coefficient k.
        k: f64,
    },
    /// Angles [rad] from 0 to a right angle, rising, and the emissivity at each, linear in the angle between them.
    Table(Vec<[f64; 2]>),
}

/// Emissivity over the wavelength.
#[derive(Debug, Clone, PartialEq)]
pub struct ByWavelength {
    /// Wavelengths [m], rising, and the emissivity at each, linear in the wavelength between them.
    pub points: Vec<[f64; 2]>,
    /// Temperature of Planck's law that weighs the wavelengths [K]. `None` is the temperature of the emitting surface.
    pub temperature: Option<f64>,
}

/// Emissivity of a face in the band. Without laws, the emissivity of the energy balance.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct BandEmissivity {
    /// Over the angle.
    pub by_angle: Option<ByAngle>,
    /// Over the wavelength. The law over the angle then says how the emissivity changes from that along the normal.
    pub by_wavelength: Option<ByWavelength>,
}

impl BandEmissivity {
    /// Whether it has no law of its own.
    pub(crate) fn is_plain(&self) -> bool {
        self.by_angle.is_none() && self.by_wavelength.is_none()
    }
}

impl ByAngle {
    /// Emissivity at a cosine of the angle from the normal, in [0, 1].
    pub(crate) fn at(&self, cosine: f64) -> f64 {
        match self {
            Self::Fresnel { n, k } => 1.0 - fresnel_reflectivity(*n, *k, cosine),
            Self::Table(points) => interpolate(points, cosine.clamp(0.0, 1.0).acos()),
        }
    }

    /// Mean over the hemisphere, weighed with the cosine.
    pub(crate) fn hemispherical(&self) -> f64 {
        let rule = GaussLegendre::new(8);
        let panels = 64;
        let panel = |number: usize| [number, number + 1].map(|end| end as f64 / f64::from(panels));
        let share = |[start, end]: [f64; 2]| {
            // cos = x^2 is dense where a surface is seen edge-on, and 2 cos d(cos) = 4 x^3 dx.
            rule.on(start, end).map(|(x, weight)| weight * 4.0 * x.powi(3) * self.at(x * x)).sum::<f64>()
        };
        (0..panels as usize).map(|number| share(panel(number))).sum()
    }
}

/// Reflectivity of a smooth surface of the refractive index n + ik for light that is not polarised (Fresnel; Siegel & Howell, Thermal Radiation Heat
/// Transfer, chapter 3).
pub fn fresnel_reflectivity(n: f64, k: f64, cosine: f64) -> f64 {
    let sine2 = 1.0 - cosine * cosine;
    let difference = n * n - k * k - sine2;
    let length = difference.hypot(2.0 * n * k);
    let (a, b2) = ((0.5 * (length + difference)).max(0.0).sqrt(), (0.5 * (length - difference)).max(0.0));
    let across = ((a - cosine).powi(2) + b2) / ((a + cosine).powi(2) + b2);
    let (far, near) = (a * cosine - sine2, a * cosine + sine2);
    let along = across * (far * far + b2 * cosine * cosine) / (near * near + b2 * cosine * cosine);
    0.5 * (across + along)
}

impl ByWavelength {
    /// Emissivity in a band at a temperature [K]: the mean that Planck's law weighs, with the response of the band. The points cover the band.
    pub(crate) fn in_band(&self, passband: impl Into<Passband>, temperature: f64) -> f64 {
        let passband = passband.into();
        let temperature = self.temperature.unwrap_or(temperature);
        let emissivity = |wavelength: f64| interpolate(&self.points, wavelength);
        if temperature <= 0.0 {
            // Only the edge at the longest wavelength radiates.
            return emissivity(passband.band.upper);
        }
        let cuts: Vec<f64> = self.points.iter().map(|[wavelength, _]| *wavelength).collect();
        let (mut sum, mut whole) = (0.0, 0.0);
        for (wavelength, power) in passband.weights_between(temperature, &cuts) {
            sum += power * emissivity(wavelength);
            whole += power;
        }
        sum / whole
    }

    /// Whether the points reach over a band, to a rounding.
    pub(crate) fn covers(&self, band: Band) -> bool {
        let first = self.points.first().map_or(f64::INFINITY, |point| point[0]);
        let last = self.points.last().map_or(0.0, |point| point[0]);
        first <= band.lower * (1.0 + 1e-9) && last >= band.upper * (1.0 - 1e-9)
    }
}

/// Value at a place between points with rising places. Beyond them the nearest point's value.
fn interpolate(points: &[[f64; 2]], place: f64) -> f64 {
    let next = points.partition_point(|[at, _]| *at < place).clamp(1, points.len() - 1);
    let ([before, first], [after, second]) = (points[next - 1], points[next]);
    first + ((place - before) / (after - before)).clamp(0.0, 1.0) * (second - first)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::thermal::planck::band_radiance_exact;

    /// Along the normal a surface reflects ((n - 1)^2 + k^2) / ((n + 1)^2 + k^2). At Brewster's angle a dielectric reflects only one polarisation.
    #[test]
    fn fresnel_agrees_with_closed_forms() {
        for (n, k) in [(1.5_f64, 0.0_f64), (4.0, 0.0), (0.6, 3.0), (33.6, 76.4)] {
            let normal = ((n - 1.0).powi(2) + k * k) / ((n + 1.0).powi(2) + k * k);
            assert!((fresnel_reflectivity(n, k, 1.0) - normal).abs() < 1e-14);
            assert!((fresnel_reflectivity(n, k, 0.0) - 1.0).abs() < 1e-12, "edge-on it reflects all");
        }
        let n: f64 = 1.5;
        let cosine = 1.0 / (1.0 + n * n).sqrt();
        let across = ((n * n - 1.0) / (n * n + 1.0)).powi(2);
        assert!((fresnel_reflectivity(n, 0.0, cosine) - 0.5 * across).abs() < 1e-14);
        assert!((fresnel_reflectivity(n, 0.01, cosine) - 0.5 * across).abs() > 1e-6);
    }

    /// The hemispherical emissivity of a dielectric (Dunkle 1965; Howell, Menguc, Daun & Siegel, eq. 3.23).
    #[test]
    fn the_hemispherical_mean_of_a_dielectric_is_dunkles() {
        for n in [1.1_f64, 1.5, 2.0, 4.0] {
            let (p, m) = (n * n + 1.0, n * n - 1.0);
            let reflectivity = 0.5
                + (3.0 * n + 1.0) * (n - 1.0) / (6.0 * (n + 1.0).powi(2))
                + n * n * m * m / p.powi(3) * ((n - 1.0) / (n + 1.0)).ln()
                - 2.0 * n.powi(3) * (n * n + 2.0 * n - 1.0) / (p * (n.powi(4) - 1.0))
                + 8.0 * n.powi(4) * (n.powi(4) + 1.0) / (p * (n.powi(4) - 1.0).powi(2)) * n.ln();
            let computed = ByAngle::Fresnel { n, k: 0.0 }.hemispherical();
            assert!((computed - (1.0 - reflectivity)).abs() < 1e-6, "{n}: {computed} against {}", 1.0 - reflectivity);
        }
        let flat = ByAngle::Table(vec![[0.0, 0.7], [1.0, 0.7], [std::f64::consts::FRAC_PI_2, 0.7]]);
        assert!((flat.hemispherical() - 0.7).abs() < 1e-12);
    }

    #[test]
    fn the_band_emissivity_is_the_mean_that_planck_weighs() {
        let band = Band { lower: 8e-6, upper: 14e-6 };
        // A step at 11 um, 1 nm wide: the share of the radiance below it.
        let step =
            ByWavelength { points: vec![[8e-6, 1.0], [11e-6, 1.0], [11.001e-6, 0.0], [14e-6, 0.0]], temperature: None };
        for t in [30.0, 120.0, 300.0, 900.0, 5772.0] {
            let below = band_radiance_exact(Band { upper: 11.0005e-6, ..band }, t) / band_radiance_exact(band, t);
            let computed = step.in_band(band, t);
            assert!((computed - below).abs() < 1e-6 + 1e-4 * below, "{t} K: {computed} against {below}");
            assert!((step.in_band(band, 2.0 * t) - below).abs() > 1e-4 * below);
        }
        let stated = ByWavelength { temperature: Some(300.0), ..step.clone() };
        assert_eq!(stated.in_band(band, 20.0), step.in_band(band, 300.0));
        assert_eq!(step.in_band(band, 0.0), 0.0);
        assert!(step.covers(band) && !step.covers(Band { upper: 14.1e-6, ..band }));
    }
}
