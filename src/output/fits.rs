//! FITS images of unsigned 16-bit numbers (FITS Standard 4.0): cards of 80 characters in blocks of 2880 bytes, then the pixels.
//!
//! Written here because the crates either bind the C library cfitsio or only read.

/// Bytes of a block.
const BLOCK: usize = 2880;

/// A value in the header.
pub(crate) enum Value {
    Integer(i64),
    Real(f64),
    /// A text of at most 60 characters of ASCII.
    Text(String),
}

/// The file. Rows run from the top. FITS begins at the bottom, so the last row is written first, and readers show the image upright. Each card has a
/// keyword of at most 8 characters, a value and a comment.
pub(crate) fn fits_16([width, height]: [u32; 2], values: &[u16], cards: &[(&str, Value, &str)]) -> Vec<u8> {
    let mut header = String::new();
    let mut card = |keyword: &str, value: &Value, comment: &str| {
        let value = match value {
            Value::Integer(value) => format!("{value:>20}"),
            Value::Real(value) => format!("{value:>20.12E}"),
            Value::Text(text) => {
                let kept: String = text.chars().filter(|c| c.is_ascii() && !c.is_control()).take(60).collect();
                format!("'{:<8}'", kept.replace('\'', "''"))
            }
        };
        let line: String = format!("{keyword:<8}= {value} / {comment}").chars().take(80).collect();
        header.push_str(&format!("{line:<80}"));
    };
    card("BITPIX", &Value::Integer(16), "bits of a pixel");
    card("NAXIS", &Value::Integer(2), "number of axes");
    card("NAXIS1", &Value::Integer(width.into()), "columns");
    card("NAXIS2", &Value::Integer(height.into()), "rows, the lowest first");
    card("BZERO", &Value::Integer(32_768), "unsigned numbers");
    card("BSCALE", &Value::Integer(1), "unsigned numbers");
    cards.iter().for_each(|(keyword, value, comment)| card(keyword, value, comment));
    let first = format!("{:<80}", format!("SIMPLE  = {:>20} / FITS Standard 4.0", "T"));
    let mut file = format!("{first}{header}{:<80}", "END").into_bytes();
    file.resize(file.len().next_multiple_of(BLOCK), b' ');
    for row in values.chunks(width as usize).rev() {
        // BZERO moves the range onto signed numbers, which flips the upper bit.
        file.extend(row.iter().flat_map(|value| (value ^ 0x8000).to_be_bytes()));
    }
    file.resize(file.len().next_multiple_of(BLOCK), 0);
    file
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cards_and_pixels_are_where_the_standard_puts_them() {
        let values: Vec<u16> = vec![0, 1, 40_000, 65_535, 5, 6];
        let file = fits_16(
            [3, 2],
            &values,
            &[("SCALE", Value::Real(85.25), "per W"), ("UNIT", Value::Text("it's".into()), "")],
        );
        assert_eq!(file.len() % BLOCK, 0);
        let cards: Vec<&str> = file[..BLOCK].chunks(80).map(|card| std::str::from_utf8(card).unwrap()).collect();
        assert_eq!(&cards[0][..30], "SIMPLE  =                    T");
        assert_eq!(&cards[3][..30], "NAXIS1  =                    3");
        assert_eq!(&cards[7][..32], "SCALE   =     8.525000000000E1 /");
        assert!(cards[8].starts_with("UNIT    = 'it''s"));
        assert!(cards.iter().any(|card| card.trim_end() == "END"));
        let pixel =
            |at: usize| i32::from(i16::from_be_bytes([file[BLOCK + 2 * at], file[BLOCK + 2 * at + 1]])) + 32_768;
        assert_eq!((0..6).map(pixel).collect::<Vec<_>>(), [65_535, 5, 6, 0, 1, 40_000]);
    }
}
