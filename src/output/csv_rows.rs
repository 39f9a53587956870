//! Rows of a CSV file. A spreadsheet shows each cell as a number or as text, never as a formula.

use std::borrow::Cow;
use std::cell::Cell;
use std::io::{self, Write};

use super::OutputError;
use crate::text::plain;

/// Characters that a spreadsheet takes for the start of a formula, in plain and in wide form.
const FORMULA: [char; 8] = ['=', '+', '-', '@', '＝', '＋', '－', '＠'];

/// Characters for which a cell needs quotes. The semicolon separates cells where a comma separates decimals.
const SEPARATORS: [char; 3] = [',', ';', '"'];

/// Writes CSV as [`write_rows`] does, up to the first row that is an error. `failed` tells of a destination that takes no more.
///
/// # Errors
/// A row is an error, or the destination takes no more.
pub(super) fn write_checked_rows(
    writer: &mut dyn Write,
    rows: impl IntoIterator<Item = Result<Vec<String>, OutputError>>,
    failed: impl FnOnce(io::Error) -> OutputError,
) -> Result<(), OutputError> {
    let broken = Cell::new(None);
    let rows = rows.into_iter().map_while(|row| row.map_err(|error| broken.set(Some(error))).ok());
    write_rows(writer, rows).map_err(failed)?;
    broken.take().map_or(Ok(()), Err)
}

/// Writes CSV with a header. All rows have the header's length. A cell that a spreadsheet would compute gets an apostrophe in front.
pub(super) fn write_rows<C: AsRef<str>>(
    writer: impl Write,
    rows: impl IntoIterator<Item = impl IntoIterator<Item = C>>,
) -> io::Result<()> {
    let mut csv = csv::WriterBuilder::new().quote_style(csv::QuoteStyle::Never).from_writer(writer);
    let failed = |error: csv::Error| match error.into_kind() {
        csv::ErrorKind::Io(error) => error,
        other => io::Error::other(format!("{other:?}")),
    };
    for row in rows {
        for text in row {
            csv.write_field(cell(text.as_ref()).as_bytes()).map_err(failed)?;
        }
        csv.write_record(None::<&[u8]>).map_err(failed)?;
    }
    csv.flush()
}

/// A cell as it stands in the file, with its quotes.
///
/// Numbers stay as they are. In other text hidden characters are escaped. Text that a spreadsheet would compute gets an apostrophe in front, which
/// spreadsheets take for the mark of text, and quotes. Quotes alone do not help, because a spreadsheet removes them before it looks.
fn cell(text: &str) -> Cow<'_, str> {
    let shown = plain(text);
    let computed = shown.trim_start().starts_with(FORMULA) && shown.parse::<f64>().is_err();
    if !computed && !shown.contains(SEPARATORS) {
        return shown;
    }
    let guard = if computed { "'" } else { "" };
    Cow::Owned(format!("\"{guard}{}\"", shown.replace('"', "\"\"")))
}

#[cfg(test)]
mod tests {
    use super::cell;

    #[test]
    fn numbers_stay_and_formulas_become_text() {
        for same in ["", "-1.5", "+2e3", "0", "time", "part:+X:min", "it's", "a b", "Größe", "2026-11-22T00:00:00Z"] {
            assert_eq!(cell(same), same);
        }
        let told = [
            ("=1+1", "\"'=1+1\""),
            ("+X panel", "\"'+X panel\""),
            ("-Y", "\"'-Y\""),
            ("@SUM(A1)", "\"'@SUM(A1)\""),
            ("  =1", "\"'  =1\""),
            ("＝1", "\"'＝1\""),
            ("=\"a\",b", "\"'=\"\"a\"\",b\""),
            ("\t=1", "\\t=1"),
            ("\r=1", "\\r=1"),
            ("a;=1", "\"a;=1\""),
            ("a\nb", "a\\nb"),
            ("a,b", "\"a,b\""),
        ];
        for (text, expected) in told {
            assert_eq!(cell(text), expected);
        }
    }
}
