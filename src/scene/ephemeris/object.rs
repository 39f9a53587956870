//! Names of objects in files of trajectories, and as scenes state them.

/// Whether the name of an object that a scene states is one of the names that a file has for it. An international
/// designator may be written as in an OEM, `1998-067A`, or as in a TLE, `98067A`.
pub(super) fn matches(wanted: &str, names: &[&str]) -> bool {
    let wanted = wanted.trim();
    let short = |name: &str| designator(name).unwrap_or_else(|| name.trim().to_ascii_uppercase());
    names.iter().any(|name| wanted.eq_ignore_ascii_case(name.trim()) || short(wanted) == short(name))
}

/// An international designator as a TLE writes it: two digits of the year, three of the launch, and the piece.
fn designator(text: &str) -> Option<String> {
    let plain: String = text.chars().filter(|letter| !matches!(letter, '-' | ' ')).collect::<String>().to_uppercase();
    let digits = plain.bytes().take_while(u8::is_ascii_digit).count();
    let piece = plain.get(digits..).filter(|piece| (1..=3).contains(&piece.len()))?;
    let is_designator = (digits == 5 || digits == 7) && piece.bytes().all(|letter| letter.is_ascii_uppercase());
    is_designator.then(|| plain[digits - 5..].to_owned())
}
