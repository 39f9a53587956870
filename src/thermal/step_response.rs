//! The step response of a radiating plate, and the transition that fits it. A transition can represent a material's heat capacity only in this way.
//!
//! A plate of capacitance c [J/(m2 K)] and emissivity e (the sum over its faces) with the balance temperature B follows c dT/dt = e sigma (B^4 - T^4). The
//! time to reach T from the start follows by partial fractions of 1 / (B^4 - T^4):
//!
//! t = c / (4 e sigma B^3) [ln |(B + T) / (B - T)| + 2 atan(T / B)]

use super::STEFAN_BOLTZMANN;
use super::fit::{Fit, FitError, TemperatureSample, fit};
use super::function::Function;
use super::material::{Domain, Profile, Retarget, Transition};

const ROWS: u32 = 100;
/// Share of the way that is left at the end of the sampled response.
const LEFT: f64 = 0.01;
/// Least difference of two balance temperatures [K]. Below it there is no response to fit.
pub(crate) const LEAST_STEP: f64 = 10.0;
/// Least value of the lower balance temperature [K].
pub(crate) const COLDEST: f64 = 10.0;

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct MaterialPlate {
    /// Capacitance [J/(m2 K)].
    pub(crate) capacitance: f64,
    /// Sum of the emissivities of the faces that radiate.
    pub(crate) emissivity: f64,
}

/// A transition fitted to a plate's heating and cooling between two balance temperatures.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Fitted {
    pub(crate) transition: Transition,
    /// The balance temperatures [K], the lower first.
    pub(crate) between: [f64; 2],
    /// Root mean square and largest difference between plate and transition during heating [K].
    pub(crate) heating: [f64; 2],
    /// Root mean square and largest difference during cooling [K].
    pub(crate) cooling: [f64; 2],
    /// Reasons not to trust the fit of the heating or cooling, in words.
    pub(crate) doubts: Vec<String>,
}

impl MaterialPlate {
    /// Time [s] in which the plate moves from `from` to `to` [K] towards its `balance` [K]. Infinite where `to` is the balance or lies beyond it.
    pub(crate) fn time(&self, from: f64, to: f64, balance: f64) -> f64 {
        let way = |t: f64| ((balance + t) / (balance - t)).abs().ln() + 2.0 * (t / balance).atan();
        if (balance - to) * (balance - from) <= 0.0 {
            return f64::INFINITY;
        }
        self.capacitance / (4.0 * self.emissivity * STEFAN_BOLTZMANN * balance.powi(3)) * (way(to) - way(from))
    }

    /// Temperature [K] at `time` [s] after the balance of a plate at `from` moved to `balance` [K].
    pub(crate) fn temperature(&self, from: f64, balance: f64, time: f64) -> f64 {
        // The bisection is over the share of the way left. The time grows as the share falls.
        let [mut short, mut long] = [1.0f64, 0.0f64];
        for _ in 0..100 {
            let middle = 0.5 * (short + long);
            if self.time(from, balance + (from - balance) * middle, balance) < time {
                short = middle;
            } else {
                long = middle;
            }
        }
        balance + (from - balance) * 0.5 * (short + long)
    }

    /// The sampled response from one balance temperature to another [K], until a hundredth of the way is left.
    pub(crate) fn record(&self, from: f64, balance: f64) -> Vec<TemperatureSample> {
        let end = self.time(from, balance + (from - balance) * LEFT, balance);
        let time = |row: u32| end * f64::from(row) / f64::from(ROWS);
        let sample =
            |row| TemperatureSample { time: time(row), temperature: self.temperature(from, balance, time(row)) };
        (0..=ROWS).map(sample).collect()
    }

    /// The transition that fits the plate best between two balance temperatures [K], with heating and cooling in one domain. `step` [s] converts its times
    /// to steps. Temperatures closer than `LEAST_STEP` are moved apart. A plate without capacitance gets an immediate response.
    ///
    /// # Errors
    /// A response that no function fits.
    pub(crate) fn fit(&self, between: [f64; 2], step: f64) -> Result<Fitted, FitError> {
        let between = apart(between);
        let [cold, hot] = between;
        if self.capacitance <= 0.0 {
            let at_once = Profile { function: Function::Linear, t_max_steps: 0.0 };
            let transition = transition(at_once.clone(), at_once, Domain::Temperature);
            return Ok(Fitted { transition, between, heating: [0.0; 2], cooling: [0.0; 2], doubts: Vec::new() });
        }
        let heating = fit(&self.record(cold, hot), Some(hot))?.best;
        let cooling = fit(&self.record(hot, cold), Some(cold))?.best;
        let mut best: Option<(f64, Fitted)> = None;
        for domain in [Domain::Temperature, Domain::FourthPower] {
            let (Some(heating), Some(cooling)) = (of_domain(&heating, domain), of_domain(&cooling, domain)) else {
                continue;
            };
            let squares = heating.rms.powi(2) + cooling.rms.powi(2);
            let profile =
                |fit: &Fit| Profile { function: fit.response.function.clone(), t_max_steps: fit.response.t_max / step };
            let fitted = Fitted {
                transition: transition(profile(heating), profile(cooling), domain),
                between,
                heating: [heating.rms, heating.max],
                cooling: [cooling.rms, cooling.max],
                doubts: [("heating", heating), ("cooling", cooling)]
                    .iter()
                    .flat_map(|(branch, fit)| fit.doubts().into_iter().map(move |doubt| format!("{branch}: {doubt}")))
                    .collect(),
            };
            if best.as_ref().is_none_or(|(least, _)| squares < *least) {
                best = Some((squares, fitted));
            }
        }
        best.map(|(_, fitted)| fitted).ok_or(FitError::Constant(cold))
    }
}

fn transition(heating: Profile, cooling: Profile, domain: Domain) -> Transition {
    Transition { heating, cooling, retarget: Retarget::Merge, domain }
}

/// The best closed form. A table would only repeat the samples.
fn of_domain(fits: &[Fit], domain: Domain) -> Option<&Fit> {
    fits.iter().find(|fit| fit.response.domain == domain && fit.response.function.kind_name() != "table")
}

fn apart([cold, hot]: [f64; 2]) -> [f64; 2] {
    let middle = 0.5 * (cold + hot);
    let half = (0.5 * (hot - cold)).max(0.5 * LEAST_STEP);
    let cold = (middle - half).max(COLDEST);
    [cold, (middle + half).max(cold + LEAST_STEP)]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 2 mm of aluminium with white paint.
    const PLATE: MaterialPlate = MaterialPlate { capacitance: 4860.0, emissivity: 0.83 };

    #[test]
    fn the_closed_form_solves_the_balance() {
        // Classical Runge-Kutta of order 4 with steps of 1 s. Its error is far below the tolerance, because tau is about 20 min.
        let integrated = |capacitance: f64, from: f64, balance: f64, seconds: u32| {
            let rate = |t: f64| PLATE.emissivity * STEFAN_BOLTZMANN * (balance.powi(4) - t.powi(4)) / capacitance;
            (0..seconds).fold(from, |t, _| {
                let a = rate(t);
                let b = rate(t + 0.5 * a);
                let c = rate(t + 0.5 * b);
                let d = rate(t + c);
                t + (a + 2.0 * b + 2.0 * c + d) / 6.0
            })
        };
        for (from, balance) in [(150.0, 320.0), (320.0, 150.0), (320.0, 20.0)] {
            let exact = PLATE.temperature(from, balance, 1500.0);
            assert!((exact - integrated(4860.0, from, balance, 1500)).abs() < 1e-6, "{from} K to {balance} K: {exact}");
            assert!((exact - integrated(4900.0, from, balance, 1500)).abs() > 0.1, "another capacitance shows");
        }
        assert_eq!(PLATE.time(200.0, 300.0, 300.0), f64::INFINITY);
        assert_eq!(PLATE.time(200.0, 310.0, 300.0), f64::INFINITY);
    }

    #[test]
    fn a_fitted_transition_follows_the_plate() {
        let fitted = PLATE.fit([200.0, 320.0], 15.0).unwrap();
        for (profile, from, to) in
            [(&fitted.transition.heating, 200.0, 320.0), (&fitted.transition.cooling, 320.0, 200.0)]
        {
            let domain = fitted.transition.domain;
            let worst = |slower: f64| {
                PLATE.record(from, to).iter().fold(0.0f64, |worst, row| {
                    let done = profile.function.done(row.time / 15.0 / (profile.t_max_steps * slower));
                    let t = domain.temperature(domain.of(from) * (1.0 - done) + domain.of(to) * done);
                    worst.max((t - row.temperature).abs())
                })
            };
            let told = if to > from { fitted.heating[1] } else { fitted.cooling[1] };
            assert!((worst(1.0) - told).abs() < 1e-6, "{} K against {told} K", worst(1.0));
            assert!(worst(1.5) > told + 1.0, "another time is worse: {} K against {told} K", worst(1.5));
        }
        // A plate of half the capacitance takes half the time.
        let half = MaterialPlate { capacitance: 2430.0, ..PLATE }.fit([200.0, 320.0], 15.0).unwrap();
        let ratio = half.transition.heating.t_max_steps / fitted.transition.heating.t_max_steps;
        assert!((ratio - 0.5).abs() < 1e-3, "{ratio}");
    }

    #[test]
    fn a_fit_that_is_not_to_be_trusted_says_so() {
        let doubts = |between: [f64; 2]| PLATE.fit(between, 15.0).unwrap().doubts;
        assert_eq!(doubts([200.0, 320.0]), Vec::<String>::new());
        // Towards a cold target a plate slows down as no closed form does.
        let cold = doubts([20.0, 320.0]);
        assert!(cold.iter().any(|doubt| doubt.starts_with("cooling: ") && doubt.contains("% of the step")), "{cold:?}");
    }

    #[test]
    fn hard_cases_have_a_transition() {
        let at_once = MaterialPlate { capacitance: 0.0, ..PLATE }.fit([200.0, 320.0], 15.0).unwrap();
        assert_eq!(at_once.transition.cooling.t_max_steps, 0.0);
        assert_eq!(PLATE.fit([250.0, 250.0], 15.0).unwrap().between, [245.0, 255.0]);
        assert_eq!(PLATE.fit([2.7, 2.7], 15.0).unwrap().between, [10.0, 20.0]);
        assert!(PLATE.fit([10.0, 400.0], 15.0).unwrap().heating[0].is_finite());
    }
}
