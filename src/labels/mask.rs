//! Masks as run lengths and boxes, as COCO and BOP have them.
//!
//! The string of run lengths follows `rleToString` in `maskApi.c` of cocodataset/cocoapi (revision 28dffd92): runs of zeros and ones in turn along
//! the columns, from the third on less the run two before, in groups of five bits from the lowest on. Bit 5 says that another group follows, and 48
//! is added.

/// A box in pixels: columns and rows of the first and of the last pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PixelBounds {
    /// First column and row.
    pub(crate) first: [i64; 2],
    /// Last column and row.
    pub(crate) last: [i64; 2],
}

impl PixelBounds {
    /// The box as BOP has it: x, y, width and height between the first and the last pixel, so that a single pixel has the width 0 (`calc_2d_bbox` in
    /// `misc.py` of bop_toolkit).
    pub fn bop(&self) -> [i64; 4] {
        let [[x, y], [right, bottom]] = [self.first, self.last];
        [x, y, right - x, bottom - y]
    }

    /// The box as COCO has it: x, y, width and height in pixels, so that a single pixel has the width 1 (`rleToBbox`).
    pub(crate) fn coco(&self) -> [i64; 4] {
        let [x, y, width, height] = self.bop();
        [x, y, width + 1, height + 1]
    }
}

/// Column and row of each pixel of a mask that is set, of an image of this width.
pub(crate) fn pixels_of(mask: &[bool], width: usize) -> impl Iterator<Item = [i64; 2]> {
    let set = mask.iter().enumerate().filter(|(_, set)| **set);
    set.map(move |(at, _)| [(at % width) as i64, (at / width) as i64])
}

/// The box round the pixels of a mask. `None` for an empty mask.
pub(crate) fn bounds(mask: &[bool], width: usize) -> Option<PixelBounds> {
    bounds_of(pixels_of(mask, width))
}

/// The box round pixels. `None` for none.
pub(crate) fn bounds_of(pixels: impl Iterator<Item = [i64; 2]>) -> Option<PixelBounds> {
    pixels.fold(None, |bounds: Option<PixelBounds>, [x, y]| {
        let PixelBounds { first, last } = bounds.unwrap_or(PixelBounds { first: [x, y], last: [x, y] });
        Some(PixelBounds { first: [first[0].min(x), first[1].min(y)], last: [last[0].max(x), last[1].max(y)] })
    })
}

/// Run lengths along the columns. The first run is of pixels that are not set, and may be 0.
pub(crate) fn runs(mask: &[bool], [width, height]: [usize; 2]) -> Vec<u64> {
    let mut runs = vec![0];
    let mut set = false;
    for at in (0..width).flat_map(|column| (0..height).map(move |row| row * width + column)) {
        if mask[at] != set {
            runs.push(0);
            set = !set;
        }
        if let Some(run) = runs.last_mut() {
            *run += 1;
        }
    }
    runs
}

/// The string of run lengths.
pub(crate) fn compressed(runs: &[u64]) -> String {
    let mut text = String::new();
    for (place, run) in runs.iter().enumerate() {
        let mut left = *run as i64 - if place > 2 { runs[place - 2] as i64 } else { 0 };
        loop {
            let bits = (left & 0x1f) as u8;
            left >>= 5;
            // The highest bit of the last group is the sign.
            let more = if bits & 0x10 != 0 { left != -1 } else { left != 0 };
            text.push(char::from(bits + if more { 0x20 } else { 0 } + 48));
            if !more {
                break;
            }
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The mask of rows of `#` and `.`.
    fn mask(rows: &[&str]) -> (Vec<bool>, [usize; 2]) {
        (rows.concat().chars().map(|sign| sign == '#').collect(), [rows[0].len(), rows.len()])
    }

    #[test]
    fn runs_go_down_the_columns() {
        let (mask, size) = mask(&[".#.", "##.", "#.."]);
        assert_eq!(runs(&mask, size), [1, 4, 4]);
        assert_eq!(runs(&[true, false], [2, 1]), [0, 1, 1]);
        assert_eq!(runs(&[false; 6], [3, 2]), [6]);
    }

    /// Strings of pycocotools 2.0.11: `mask.encode(numpy.asfortranarray(mask))["counts"]`.
    #[test]
    fn the_string_is_that_of_pycocotools() {
        for (runs, expected) in ORACLE {
            assert_eq!(compressed(runs), *expected, "{runs:?}");
        }
        // One pixel more in the last two runs is another string.
        assert_ne!(compressed(&[1, 4, 5]), compressed(&[1, 4, 4]));
    }

    const ORACLE: &[(&[u64], &str)] = &[
        (&[1, 4, 4], "144"),
        (&[0, 1, 1], "011"),
        (&[6], "6"),
        (&[0, 6], "06"),
        (&[100, 30, 70, 30, 70, 30, 970], "T3n0V2000Tl0"),
        (&[5, 40, 1000, 3, 2000, 900, 12, 40], "5X1Xo0kNXo0Ql0lQNTUO"),
        (&[100_000, 1, 1, 199_998], "PeQ311mYS6"),
        (&[3, 50, 2, 31, 17, 16, 15, 33, 33], "3b12]O?ANa0b0"),
    ];

    #[test]
    fn boxes_of_bop_end_at_the_last_pixel_and_those_of_coco_behind_it() {
        let (mask, [width, _]) = mask(&["....", "..#.", ".##."]);
        let bounds = bounds(&mask, width).expect("a box");
        assert_eq!(bounds.bop(), [1, 1, 1, 1]);
        assert_eq!(bounds.coco(), [1, 1, 2, 2]);
        assert_eq!(super::bounds(&[false; 4], 2), None);
    }
}
