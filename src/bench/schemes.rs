//! The integration schemes of a case: fixed sub-steps, or sub-steps controlled by a tolerance.

use std::fmt;

use super::cases::NetworkCase;
use crate::thermal::network::control::Integrator;

/// A method with fixed sub-steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fixed {
    /// Forward Euler with a carried residual.
    Euler,
    /// RKL2 with the number of stages that its sub-step needs.
    Rkl2,
    /// TR-BDF2.
    TrBdf2,
}

/// An integration scheme.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Scheme {
    /// A method with a number of equal sub-steps a frame.
    Fixed(Fixed, u32),
    /// The controller, with a tolerance [K].
    Controlled(Integrator, f64),
}

/// Methods of docs/numerics.md 3 that isotherm lacks, and the reason.
pub const ABSENT: [(&str, &str); 3] = [
    ("per-node exponential", "left out: wrong by tens of kelvin wherever nodes conduct (docs/numerics.md 3)"),
    ("backward Euler + Jacobi", "left out: unconverged Jacobi is wrong by 5 to 50 K (docs/numerics.md 3)"),
    ("DuFort-Frankel", "left out: Euler, or RKL2, is the cheap integrator"),
];

/// Most passes a frame for forward Euler.
const MOST_EULER: f64 = 2000.0;

impl Scheme {
    /// The schemes for a case. `quick` keeps only the ends of each family.
    pub fn all(case: &NetworkCase, quick: bool) -> Vec<Self> {
        let stable = (case.stiffness().floor() + 1.0) as u32;
        let (euler, fixed): (&[u32], &[u32]) = if quick { (&[1], &[1, 4]) } else { (&[1, 4], &[1, 2, 4, 8]) };
        // If even the cheapest is refused, one row says so.
        let euler = if case.stiffness() > MOST_EULER { &euler[..1] } else { euler };
        let mut all: Vec<Self> =
            euler.iter().map(|times| Self::Fixed(Fixed::Euler, times.saturating_mul(stable))).collect();
        all.extend(fixed.iter().map(|count| Self::Fixed(Fixed::Rkl2, *count)));
        all.extend(fixed.iter().map(|count| Self::Fixed(Fixed::TrBdf2, *count)));
        for integrator in [Integrator::Cheap, Integrator::Default, Integrator::Accurate] {
            let factors: &[f64] = if quick { &[1.0] } else { &[10.0, 1.0, 0.1] };
            all.extend(factors.iter().map(|factor| Self::Controlled(integrator, factor * integrator.tolerance())));
        }
        all
    }

    /// The method without its sub-steps or tolerance.
    pub fn family(&self) -> String {
        match self {
            Self::Fixed(Fixed::Euler, _) => "Euler, fixed".to_owned(),
            Self::Fixed(Fixed::Rkl2, _) => "RKL2, fixed".to_owned(),
            Self::Fixed(Fixed::TrBdf2, _) => "TR-BDF2, fixed".to_owned(),
            Self::Controlled(integrator, _) => integrator.to_string(),
        }
    }

    /// The reason if the scheme cannot run on a case.
    pub fn refusal(&self, case: &NetworkCase) -> Option<String> {
        let hopeless = matches!(self, Self::Fixed(Fixed::Euler, _)) && case.stiffness() > MOST_EULER;
        hopeless.then(|| format!("it is stable from {:.2e} passes a frame on only", case.stiffness()))
    }
}

impl fmt::Display for Scheme {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Fixed(_, 1) => write!(out, "{}, 1 sub-step", self.family()),
            Self::Fixed(_, count) => write!(out, "{}, {count} sub-steps", self.family()),
            Self::Controlled(integrator, tolerance) => {
                let millikelvin = format!("{:.3}", 1e3 * tolerance);
                let short = millikelvin.trim_end_matches('0').trim_end_matches('.');
                write!(out, "{integrator}, {short} mK")
            }
        }
    }
}
