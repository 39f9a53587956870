//! Grey TIFF of 16 bits: baseline TIFF 6.0, one strip without compression, which every reader knows. A description holds scale and offset.

/// The file. `description` goes into the tag ImageDescription (270).
pub(crate) fn tiff_16([width, height]: [u32; 2], values: &[u16], description: &str) -> Vec<u8> {
    const SHORT: u16 = 3;
    const LONG: u16 = 4;
    const ASCII: u16 = 2;
    const ENTRIES: u16 = 11;
    // TIFF's ASCII has 7 bits.
    let mut text: Vec<u8> = description.chars().map(|c| if c.is_ascii() { c as u8 } else { b'?' }).collect();
    text.push(0);
    let text_at = 8 + 2 + 12 * u32::from(ENTRIES) + 4;
    let data_at = (text_at + text.len() as u32).next_multiple_of(4);
    let bytes = 2 * width * height;
    let entries: [(u16, u16, u32, u32); ENTRIES as usize] = [
        (256, LONG, 1, width),
        (257, LONG, 1, height),
        // Bits of a sample.
        (258, SHORT, 1, 16),
        // No compression.
        (259, SHORT, 1, 1),
        // 0 is black.
        (262, SHORT, 1, 1),
        (270, ASCII, text.len() as u32, text_at),
        (273, LONG, 1, data_at),
        (277, SHORT, 1, 1),
        (278, LONG, 1, height),
        (279, LONG, 1, bytes),
        // Unsigned integers.
        (339, SHORT, 1, 1),
    ];
    let mut file = b"II\x2a\0\x08\0\0\0".to_vec();
    file.extend(ENTRIES.to_le_bytes());
    for (tag, kind, count, value) in entries {
        file.extend(tag.to_le_bytes());
        file.extend(kind.to_le_bytes());
        file.extend(count.to_le_bytes());
        // A short value stands in the lower half, which comes first.
        file.extend(value.to_le_bytes());
    }
    file.extend(0u32.to_le_bytes());
    file.extend(text);
    file.resize(data_at as usize, 0);
    file.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    file
}

#[cfg(test)]
mod tests {
    use super::tiff_16;

    /// Reads the tags as TIFF 6.0, section 2, lays them out.
    #[test]
    fn the_tags_lead_to_the_pixels() {
        let values: Vec<u16> = (0..6).map(|i| 1000 * i + 7).collect();
        let file = tiff_16([3, 2], &values, "{\"scale\": 1}");
        let u16_at = |at: usize| u16::from_le_bytes(file[at..at + 2].try_into().unwrap());
        let u32_at = |at: usize| u32::from_le_bytes(file[at..at + 4].try_into().unwrap());
        assert_eq!((&file[..4], u32_at(4)), (b"II\x2a\0".as_slice(), 8));
        let tag = |wanted: u16| {
            let place =
                (0..usize::from(u16_at(8))).map(|entry| 10 + 12 * entry).find(|at| u16_at(*at) == wanted).unwrap();
            (u32_at(place + 4) as usize, u32_at(place + 8))
        };
        assert_eq!([tag(256).1, tag(257).1, tag(258).1, tag(279).1], [3, 2, 16, 12]);
        let (length, text) = tag(270);
        assert_eq!(&file[text as usize..text as usize + length], b"{\"scale\": 1}\0");
        let at = tag(273).1 as usize;
        assert_eq!(file.len(), at + 12);
        assert_eq!((0..6).map(|i| u16_at(at + 2 * i)).collect::<Vec<_>>(), values);
        let tags: Vec<u16> = (0..usize::from(u16_at(8))).map(|entry| u16_at(10 + 12 * entry)).collect();
        assert!(tags.is_sorted(), "tags stand in ascending order");
    }
}
