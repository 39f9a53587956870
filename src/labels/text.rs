//! JSON with sorted keys, and names that occur once.

use std::collections::HashSet;

use serde_json::Value;

/// A value on one line, with sorted keys. Numbers are the shortest that read back the same.
pub(crate) fn line(mut value: Value) -> String {
    value.sort_all_objects();
    value.to_string()
}

/// A list with one entry in each line, as `bop_toolkit` writes it.
pub(crate) fn list(entries: impl IntoIterator<Item = String>) -> String {
    enclosed("[", entries, "]\n").collect()
}

/// An object with one entry in each line, from keys and their values on one line.
pub(crate) fn object(entries: impl IntoIterator<Item = (impl std::fmt::Display, String)>) -> String {
    enclosed("{", entries.into_iter().map(|(key, value)| format!("\"{key}\": {value}")), "}\n").collect()
}

/// The pieces of a list with one entry in each line, between `open` and `close`.
pub(crate) fn enclosed<'a>(
    open: &'a str,
    entries: impl IntoIterator<Item = String>,
    close: &'a str,
) -> impl Iterator<Item = String> {
    let mut first = true;
    let entries = entries.into_iter().map(move |entry| {
        let between = if std::mem::take(&mut first) { "\n" } else { ",\n" };
        format!("{between}{entry}")
    });
    std::iter::once(open.to_owned()).chain(entries).chain(std::iter::once(format!("\n{close}")))
}

/// Makes names unique: a repeated name gets the first free suffix `#2`, `#3`.
pub(crate) fn unique(names: &[String]) -> Vec<String> {
    let given: HashSet<&String> = names.iter().collect();
    let mut used: HashSet<String> = HashSet::new();
    let mut result = Vec::with_capacity(names.len());
    for name in names {
        let free = |candidate: &String| !used.contains(candidate) && (candidate == name || !given.contains(candidate));
        let suffixed = (2..).map(|suffix| format!("{name}#{suffix}"));
        let free_name = std::iter::once(name.clone()).chain(suffixed).find(free).unwrap_or_else(|| name.clone());
        used.insert(free_name.clone());
        result.push(free_name);
    }
    result
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn keys_are_sorted_at_every_depth() {
        assert_eq!(line(json!({"b": {"d": 1, "c": 0.1}, "a": []})), r#"{"a":[],"b":{"c":0.1,"d":1}}"#);
        assert_eq!(list(["1", "2"].map(str::to_owned)), "[\n1,\n2\n]\n");
        assert_eq!(object([(0, "{}".to_owned())]), "{\n\"0\": {}\n}\n");
        assert_eq!(list(Vec::new()), "[\n]\n");
    }

    #[test]
    fn repeated_names_get_a_number() {
        let names = ["a", "a", "a#2", "a", "b"].map(str::to_owned);
        assert_eq!(unique(&names), ["a", "a#3", "a#2", "a#4", "b"]);
    }
}
