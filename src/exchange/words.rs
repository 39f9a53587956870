//! Numbers as sums of a few numbers of 8 bits, as the device keeps exchange areas: a column and such a number share a word.

/// The nearest number with 8 significant bits, the upper half of an f32.
pub(crate) fn short(value: f64) -> f64 {
    f64::from(f32::from_bits(upper_half(value) << 16))
}

/// The number nearest to a value among sums of at most `most` numbers of 8 bits. The sum ends where the rest is at most
/// `least`.
pub(crate) fn rounded(value: f64, least: f64, most: usize) -> f64 {
    let mut sum = short(value);
    for _ in 1..most {
        if (value - sum).abs() <= least {
            break;
        }
        sum += short(value - sum);
    }
    sum
}

/// The upper halves of the f32 whose sum is a value that `rounded` gave.
pub(crate) fn pieces(value: f64) -> impl Iterator<Item = u32> {
    let mut rest = value;
    (0..MOST).map_while(move |_| {
        let piece = (rest != 0.0).then(|| upper_half(rest));
        rest -= short(rest);
        piece
    })
}

/// Most numbers of a sum: they hold the 24 bits of an f32.
pub(crate) const MOST: usize = 3;

fn upper_half(value: f64) -> u32 {
    let bits = (value as f32).to_bits();
    (bits + 0x7fff + (bits >> 16 & 1)) >> 16
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_come_back_from_their_pieces() {
        for k in 1..5000 {
            let value = f64::from(k) * 0.000_123_456_789;
            for most in 1..=MOST {
                let kept = rounded(value, 0.0, most);
                assert!(
                    (kept / value - 1.0).abs() <= 0.5f64.powi(if most == 3 { 24 } else { 9 * most as i32 - 1 }),
                    "{value}"
                );
                let sum: f64 = pieces(kept).map(|half| f64::from(f32::from_bits(half << 16))).sum();
                assert_eq!(sum, kept, "{value} in {most}");
            }
        }
        assert_eq!(rounded(1.0 + 1.0 / 300.0, 0.01, 3), 1.0);
        assert!(rounded(1.0 + 1.0 / 300.0, 0.001, 3) != 1.0 && pieces(0.0).next().is_none());
    }
}
