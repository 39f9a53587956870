//! Directions in words: which combinations of parameters the data fix, and which stay open.

use super::posterior::{DataDirection, Posterior, is_fixed};
use super::prior::Unknown;

/// Share of the largest component below which a parameter is not named.
const NAMED: f64 = 0.2;

/// The parameters of a direction with their components, the largest first.
fn named(direction: &[f64]) -> Vec<(usize, f64)> {
    let largest = direction.iter().fold(0.0f64, |largest, component| largest.max(component.abs()));
    let mut named: Vec<(usize, f64)> =
        direction.iter().copied().enumerate().filter(|(_, component)| component.abs() > NAMED * largest).collect();
    named.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
    named
}

/// A standard deviation of a logarithm as a share: `0.4 %`, or a factor where it is large.
pub(super) fn share(sigma: f64) -> String {
    match sigma {
        sigma if !sigma.is_finite() => "not at all".to_owned(),
        sigma if sigma > 0.5 => format!("to a factor of {:.2}", sigma.exp()),
        sigma if sigma >= 0.01 => format!("to {:.1} %", 100.0 * sigma),
        sigma => format!("to {} %", rounded(100.0 * sigma)),
    }
}

/// Two significant digits.
pub(super) fn rounded(value: f64) -> String {
    let digits = (1.0 - value.abs().max(1e-12).log10().floor()).max(0.0) as usize;
    format!("{value:.digits$}")
}

/// `'a' / 'b'` or `'a' x 'b'`, with the power of `b` where that is not 1.
fn pair(a: &str, b: &str, power: f64) -> String {
    let sign = if power > 0.0 { "x" } else { "/" };
    let size = power.abs();
    let raised = if (size - 1.0).abs() < 0.1 { String::new() } else { format!("^{size:.2}") };
    format!("'{a}' {sign} '{b}'{raised}")
}

/// The combination of two parameters that stays as it is along a direction.
fn kept([(i, a), (j, b)]: [(usize, f64); 2], count: usize) -> Vec<f64> {
    let mut combination = vec![0.0; count];
    (combination[i], combination[j]) = (1.0, -a / b);
    combination
}

/// The sentence on a direction that the data leave open, one of all directions.
pub(super) fn open(direction: &DataDirection, all: &[DataDirection], unknowns: &[Unknown]) -> String {
    let name = |i: usize| &unknowns[i].name;
    match named(&direction.vector)[..] {
        [(i, _)] => format!("the data do not fix '{}'", name(i)),
        [first, second] if !is_fixed(&kept([first, second], unknowns.len()), all, unknowns) => {
            format!("the data fix neither '{}' nor '{}'", name(first.0), name(second.0))
        }
        [(i, a), (j, b)] => format!("the data fix {}, not each", pair(name(i), name(j), -a / b)),
        ref all => {
            let first = all[0].1;
            let part = |(i, component): &(usize, f64)| format!("'{}' by {:+.0} %", name(*i), 10.0 * component / first);
            format!("the data leave open a change of {} together", all.iter().map(part).collect::<Vec<_>>().join(", "))
        }
    }
}

/// The sentence on a direction with its figures.
pub(super) fn sentence(direction: &DataDirection, posterior: &Posterior, unknowns: &[Unknown]) -> String {
    let named = named(&direction.vector);
    if !direction.is_fixed() {
        let kept = match named[..] {
            [first, second] => {
                let combination = kept([first, second], unknowns.len());
                let fixed = is_fixed(&combination, &posterior.directions, unknowns);
                let known = || format!(" (that combination {})", share(posterior.sigma_of(&combination)));
                fixed.then(known).unwrap_or_default()
            }
            _ => String::new(),
        };
        let open = open(direction, &posterior.directions, unknowns);
        return format!("{open}{kept}: what is known beyond that is the prior");
    }
    let name = |i: usize| &unknowns[i].name;
    match named[..] {
        [(i, _)] => format!("the data fix '{}' {}", name(i), share(direction.data)),
        [(i, a), (j, b)] => {
            format!("the data fix {} {}", pair(name(i), name(j), b / a), share(direction.data / a.abs()))
        }
        ref all => {
            let power = |(i, component): &(usize, f64)| format!("'{}'^{:.2}", name(*i), component / all[0].1);
            let product: Vec<String> = all.iter().map(power).collect();
            format!("the data fix {} {}", product.join(" x "), share(direction.data / all[0].1.abs()))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unknowns() -> Vec<Unknown> {
        let unknown = |name: &str| Unknown {
            name: name.to_owned(),
            unit: "",
            value: Some(0.5),
            prior: None,
            bounds: [-1.0, 1.0],
            step: 0.01,
        };
        ["absorptivity of paint", "emissivity of paint", "capacity of paint"].map(unknown).to_vec()
    }

    #[test]
    fn both_signs_and_a_single_parameter_are_said_right() {
        let of = |vector: [f64; 3], data: f64| DataDirection { vector: vector.to_vec(), data, prior: 1.0 };
        let across = |[a, b, _]: [f64; 3]| of([-b, a, 0.0], 0.01);
        let said = |vector| open(&of(vector, 9.0), &[across(vector), of(vector, 9.0)], &unknowns());
        // Both grow together: their ratio stays.
        assert_eq!(said([0.7, 0.7, 0.01]), "the data fix 'absorptivity of paint' / 'emissivity of paint', not each");
        assert_eq!(said([0.7, -0.7, 0.01]), "the data fix 'absorptivity of paint' x 'emissivity of paint', not each");
        assert_eq!(said([0.0, 0.1, 0.99]), "the data do not fix 'capacity of paint'");
        assert!(said([0.6, 0.5, 0.6]).contains("by +10 %, 'capacity of paint' by +10 %"));
        // One datum of three values: two directions across it are open, and no combination of two values is fixed.
        let third = 1.0 / 3f64.sqrt();
        let all = [of([third; 3], 0.01), of([0.8, -0.6, -0.1], f64::INFINITY), of([0.2, 0.5, -0.8], f64::INFINITY)];
        let neither = "the data fix neither 'absorptivity of paint' nor 'emissivity of paint'";
        assert_eq!(open(&all[1], &all, &unknowns()), neither);
        assert_eq!(share(0.004), "to 0.40 %");
        assert_eq!(share(2.0), "to a factor of 7.39");
    }
}
