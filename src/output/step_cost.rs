//! Where the cost of a step goes, from the times of passes.

use super::report::PassTime;

/// Kinds of work with the beginnings of the names of their passes. The first that fits counts.
const KINDS: [(&str, &[&str]); 8] = [
    ("shadows", &["solar_", "read solar_"]),
    ("radiation between surfaces", &["exchange_"]),
    ("loads", &["thermal_step.absorb"]),
    ("responses of other parts", &["thermal_step."]),
    ("heaters", &["one_pass_heaters"]),
    ("conduction inside blocks", &["one_pass.conduct", "one_pass_stage"]),
    ("local step and weak conduction", &["one_pass."]),
    ("image", &["cull", "radiance", "read radiance", "read identity"]),
];

/// Device time of each kind of work in words, in nanoseconds a node and step: the median of each pass, times its number. Empty without times.
pub(crate) fn step_cost(passes: &[PassTime], steps: u64, nodes: usize) -> String {
    let kind = |name: &str| KINDS.iter().position(|(_, starts)| starts.iter().any(|start| name.starts_with(start)));
    let mut sums = [0.0; KINDS.len()];
    for pass in passes {
        if let Some(kind) = kind(&pass.name) {
            sums[kind] += 1e6 * pass.median_ms * pass.count as f64;
        }
    }
    let of_all = (steps.max(1) as f64) * nodes.max(1) as f64;
    let parts = KINDS.iter().zip(sums).filter(|(_, sum)| *sum > 0.0);
    parts.map(|((name, _), sum)| format!("{name} {:.2}", sum / of_all)).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn passes_count_once_by_their_kind() {
        let pass = |name: &str, median_ms, count| PassTime {
            name: name.to_owned(),
            median_ms,
            p10_ms: 0.0,
            p90_ms: 0.0,
            count,
        };
        let passes = [
            pass("thermal_step.absorb.sun", 0.2, 10),
            pass("one_pass.drive", 0.3, 10),
            pass("one_pass.advance.shown", 0.1, 10),
            pass("one_pass.conduct.shown", 0.4, 10),
            pass("radiance", 5.0, 2),
            pass("settle target", 9.0, 1),
        ];
        let expected = "loads 2.00, conduction inside blocks 4.00, local step and weak conduction 4.00, image 10.00";
        assert_eq!(step_cost(&passes, 10, 100_000), expected);
        assert_eq!(step_cost(&[], 10, 100_000), "");
    }
}
