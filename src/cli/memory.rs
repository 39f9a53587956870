//! An amount of memory on the command line.

/// Units, with their bytes.
const UNITS: [(&str, u64); 4] = [("MB", 1_000_000), ("GB", 1_000_000_000), ("MiB", 1 << 20), ("GiB", 1 << 30)];

/// Reads an amount of memory, such as `500MB` or `4GiB` [bytes].
///
/// # Errors
/// It is no amount from 1 MB to 1e6 GB.
pub(super) fn parse_memory(text: &str) -> Result<u64, String> {
    let amount = UNITS.iter().find_map(|(unit, bytes)| {
        let number: f64 = text.strip_suffix(unit)?.trim_end().parse().ok()?;
        Some(number * *bytes as f64).filter(|amount| (1e6..=1e15).contains(amount))
    });
    amount.map(|amount| amount as u64).ok_or_else(|| "it takes an amount such as 500MB or 4GiB".to_owned())
}

#[cfg(test)]
mod tests {
    use super::parse_memory;

    #[test]
    fn an_amount_has_a_unit() {
        assert_eq!(parse_memory("500MB"), Ok(500_000_000));
        assert_eq!(parse_memory("1.5 GiB"), Ok(3 << 29));
        for wrong in ["", "4", "4G", "GiB", "-1GiB", "nanGB", "infGB", "1e99GB", "0.1MB"] {
            assert!(parse_memory(wrong).is_err(), "{wrong}");
        }
    }
}
