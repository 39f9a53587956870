//! Finds the name that a misspelt one means.

use crate::text::plain;

/// Most names that a message lists.
const LISTED: usize = 30;

/// The known word most similar to `word`, if any is similar. Wildcards of a pattern do not count.
pub(crate) fn nearest<'k>(word: &str, known: impl IntoIterator<Item = &'k str>) -> Option<&'k str> {
    let word = word.replace(['*', '?'], "").to_lowercase();
    known
        .into_iter()
        .map(|candidate| (likeness(&word, &candidate.to_lowercase()), candidate))
        .filter(|(likeness, _)| *likeness >= 0.5)
        .max_by(|(a, _), (b, _)| a.total_cmp(b))
        .map(|(_, candidate)| candidate)
}

/// Similarity of two words in [0, 1]. A word that contains the other one (`altitude_km`) counts as similar, and wins over a
/// word with the same number of edits.
fn likeness(word: &str, candidate: &str) -> f64 {
    let edits = strsim::normalized_damerau_levenshtein(word, candidate);
    let contained = word.len() > 2
        && candidate.len() > 2
        && (word.starts_with(candidate) || candidate.starts_with(word) || word.ends_with(candidate));
    if contained { edits.max(0.75) + 0.05 } else { edits }
}

/// `; did you mean 'step'?`. If no word is similar, it lists the known words, the first of many.
pub(crate) fn suggestion<'k>(word: &str, known: impl IntoIterator<Item = &'k str> + Clone) -> String {
    if let Some(near) = nearest(word, known.clone()) {
        return format!("; did you mean '{}'?", plain(near));
    }
    let mut known: Vec<&str> = known.into_iter().filter(|name| !name.is_empty()).collect();
    let more = known.len().saturating_sub(LISTED);
    known.truncate(LISTED);
    let listed = known.join(", ");
    match (listed.is_empty(), more) {
        (true, _) => "; none is known here".to_owned(),
        (false, 0) => format!("; known here: {}", plain(&listed)),
        (false, more) => format!("; known here: {} and {more} more", plain(&listed)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_misspelt_name_is_found_or_the_first_names_are_listed() {
        let parts = ["body", "wing_port", "wing_starboard"];
        assert_eq!(suggestion("wing_prt*", parts), "; did you mean 'wing_port'?");
        assert_eq!(suggestion("tail", parts), "; known here: body, wing_port, wing_starboard");
        assert_eq!(suggestion("tail", []), "; none is known here");
        let many: Vec<String> = (0..312).map(|number| format!("{number}")).collect();
        let told = suggestion("radiator", many.iter().map(String::as_str));
        assert!(told.starts_with("; known here: 0, 1, ") && told.ends_with(", 29 and 282 more"), "{told}");
    }
}
