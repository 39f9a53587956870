//! Makes text from files and arguments safe to show: characters that steer a terminal, reorder a line or break XML become visible.

use std::borrow::Cow;
use std::fmt::Write;

/// Whether a character must not reach a terminal, a page or a drawing as it is: a control character (C0, DEL, C1), a line or paragraph separator, a mark
/// that changes the direction of text, or a code point that XML forbids.
pub fn is_hidden(character: char) -> bool {
    character.is_control()
        || matches!(
            character,
            '\u{61C}'
                | '\u{200E}'
                | '\u{200F}'
                | '\u{2028}'..='\u{202E}'
                | '\u{2066}'..='\u{2069}'
                | '\u{FEFF}'
                | '\u{FFF9}'..='\u{FFFB}'
                | '\u{FFFE}'
                | '\u{FFFF}'
        )
}

/// The text with hidden characters as Rust writes them: `\n`, `\t`, `\u{1b}`. The result is one line. A backslash stays as it is.
pub(crate) fn plain(text: &str) -> Cow<'_, str> {
    shown(text, is_hidden)
}

/// As [`plain`], but line feeds stay.
pub(crate) fn plain_lines(text: &str) -> Cow<'_, str> {
    shown(text, |character| character != '\n' && is_hidden(character))
}

/// A JSON text of the same value in which hidden characters are `\u001b` or the like. Line feeds outside strings stay.
pub(crate) fn plain_json(json: &str) -> Cow<'_, str> {
    let hidden = |character: char| character != '\n' && is_hidden(character);
    if !json.contains(hidden) {
        return Cow::Borrowed(json);
    }
    let mut shown = String::with_capacity(json.len());
    for character in json.chars() {
        match hidden(character) {
            // Every hidden character lies in the first plane, so one escape of four digits holds it.
            true => drop(write!(shown, "\\u{:04x}", u32::from(character))),
            false => shown.push(character),
        }
    }
    Cow::Owned(shown)
}

/// A number with at most seven significant digits, whatever its size.
pub(crate) fn significant(value: f64) -> String {
    format!("{value:.6e}").parse::<f64>().unwrap_or(value).to_string()
}

/// A time of a step [s] as files hold it, to a nanosecond: the product of a number and a length has rounding in its last digits, 3842.0699999999997.
pub(crate) fn time_of_step(time: f64) -> String {
    format!("{time:.9}").parse::<f64>().unwrap_or(time).to_string()
}

/// The text with 0.00 in place of -0.00, which a sum of nothing and a rounded number show. A name is left alone unless such a number stands in it by itself.
pub(crate) fn unsigned_zeros(text: &str) -> Cow<'_, str> {
    const SIGNED: &str = "-0.0";
    let mut unsigned = String::new();
    let mut rest = text;
    while let Some(at) = rest.find(SIGNED) {
        let (before, number) = rest.split_at(at);
        let begins = !before.ends_with(|character: char| character.is_alphanumeric() || "._-'".contains(character));
        let after = number[SIGNED.len()..].trim_start_matches('0');
        let ends = !after.starts_with(|character: char| character.is_alphanumeric() || "_-'".contains(character));
        let sign = usize::from(begins && ends);
        unsigned.push_str(before);
        unsigned.push_str(&number[sign..number.len() - after.len()]);
        rest = after;
    }
    if unsigned.is_empty() { Cow::Borrowed(text) } else { Cow::Owned(unsigned + rest) }
}

fn shown(text: &str, hidden: impl Fn(char) -> bool) -> Cow<'_, str> {
    let Some(first) = text.find(&hidden) else {
        return Cow::Borrowed(text);
    };
    let mut shown = text[..first].to_owned();
    for character in text[first..].chars() {
        match hidden(character) {
            true => shown.extend(character.escape_default()),
            false => shown.push(character),
        }
    }
    Cow::Owned(shown)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_of_steps_show_no_rounding_of_their_product() {
        assert_ne!((15.43 * 249.0).to_string(), "3842.07");
        assert_eq!(time_of_step(15.43 * 249.0), "3842.07");
        assert_eq!(time_of_step(0.1 * 3.0), "0.3");
        assert_eq!(
            [0.0, 1e-9, 1234567.125, 1e300].map(time_of_step),
            ["0", "0.000000001", "1234567.125", &1e300f64.to_string()]
        );
    }

    #[test]
    fn what_steers_a_terminal_becomes_visible_and_all_else_stays() {
        for harmless in ["", "skin", "+X panel", "Größe 2 µm", "名前", "a\\nb", "👩‍🚀"] {
            assert!(matches!(plain(harmless), Cow::Borrowed(same) if same == harmless));
        }
        assert_eq!(plain("a\x1b[31mb\x07\n"), "a\\u{1b}[31mb\\u{7}\\n");
        assert_eq!(plain("\u{7f}\u{9b}31m\u{202e}gnp\u{2066}"), "\\u{7f}\\u{9b}31m\\u{202e}gnp\\u{2066}");
        assert_eq!(plain_lines("one\ntwo\r\n"), "one\ntwo\\r\n");
        let every = (0..=0x2_0000).filter_map(char::from_u32).collect::<String>();
        assert!(!plain(&every).contains(is_hidden));
    }

    #[test]
    fn zeros_have_no_sign_and_other_numbers_and_names_stay() {
        for (text, expected) in [
            ("a step takes -0.00 ms", "a step takes 0.00 ms"),
            ("-0.0", "0.0"),
            ("axis (-0.000, 1.000, -0.000) at [-0.0,-0.0]", "axis (0.000, 1.000, 0.000) at [0.0,0.0]"),
            ("mean -0.00. Then {\"x\":-0.0}", "mean 0.00. Then {\"x\":0.0}"),
        ] {
            assert_eq!(unsigned_zeros(text), expected);
        }
        for same in
            ["", "-0.01 -0.003 K", "1e-0.0", "'-0.0'", "tank-0.0 a_-0.0b", "2026-0.0", "-0 -00.0", "-0.0e-5", "5 - 0.0"]
        {
            assert_eq!(unsigned_zeros(same), same);
        }
    }

    #[test]
    fn json_keeps_its_value() {
        let value = serde_json::json!({ "name": "\u{9b}31m\u{202e}\u{7f}\n\u{1b}" });
        let text = format!("{value:#}");
        let shown = plain_json(&text);
        assert!(!shown.contains(|character: char| character != '\n' && is_hidden(character)));
        assert_eq!(serde_json::from_str::<serde_json::Value>(&shown).unwrap(), value);
    }
}
