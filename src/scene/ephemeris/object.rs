//! Compares object names in trajectory files with the name in the scene.

/// Whether the name in the scene is one of the file's names. International designators may have the OEM form
/// `1998-067A` or the TLE form `98067A`.
pub(super) fn matches(wanted: &str, names: &[&str]) -> bool {
    let wanted = wanted.trim();
    let short = |name: &str| designator(name).unwrap_or_else(|| name.trim().to_ascii_uppercase());
    names.iter().any(|name| wanted.eq_ignore_ascii_case(name.trim()) || short(wanted) == short(name))
}

/// A designator in TLE form: two digits of the year, three of the launch, and the piece.
fn designator(text: &str) -> Option<String> {
    let plain: String = text.chars().filter(|letter| !matches!(letter, '-' | ' ')).collect::<String>().to_uppercase();
    let digits = plain.bytes().take_while(u8::is_ascii_digit).count();
    let piece = plain.get(digits..).filter(|piece| (1..=3).contains(&piece.len()))?;
    let is_designator = (digits == 5 || digits == 7) && piece.bytes().all(|letter| letter.is_ascii_uppercase());
    is_designator.then(|| plain[digits - 5..].to_owned())
}
