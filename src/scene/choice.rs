//! Words of which a key takes one, and messages that list them.

use crate::misspelt::suggestion;
use crate::text::plain;

/// The value of `word` in `choices`, or a message with the choices and the most similar one.
pub(super) fn choose<T: Copy>(word: &str, choices: &[(&str, T)]) -> Result<T, String> {
    let known = choices.iter().map(|(name, _)| *name);
    choices.iter().find(|(name, _)| *name == word).map(|(_, value)| *value).ok_or_else(|| {
        format!("'{}' is not one of {}{}", plain(word), list(known.clone()), nearest_suffix(word, known))
    })
}

fn nearest_suffix<'k>(word: &str, known: impl IntoIterator<Item = &'k str> + Clone) -> String {
    let text = suggestion(word, known);
    // The message already lists the known words.
    if text.starts_with("; did") { text } else { String::new() }
}

pub(super) fn list<'k>(words: impl IntoIterator<Item = &'k str>) -> String {
    words.into_iter().map(|word| format!("'{word}'")).collect::<Vec<_>>().join(", ")
}
