//! The Sobol sequence with Owen's scrambling.
//!
//! Polynomials and initial numbers: Joe and Kuo (2008), file new-joe-kuo-6.21201. Scrambling: Burley (2020), Practical hash-based Owen scrambling.

pub(crate) const DIMENSIONS: usize = 21;

/// Polynomial and initial numbers of each dimension from the second on.
const TABLE: [(u32, &[u32]); DIMENSIONS - 1] = [
    (0, &[1]),
    (1, &[1, 3]),
    (1, &[1, 3, 1]),
    (2, &[1, 1, 1]),
    (1, &[1, 1, 3, 3]),
    (4, &[1, 3, 5, 13]),
    (2, &[1, 1, 5, 5, 17]),
    (4, &[1, 1, 5, 5, 5]),
    (7, &[1, 1, 7, 11, 19]),
    (11, &[1, 1, 5, 1, 1]),
    (13, &[1, 1, 1, 3, 11]),
    (14, &[1, 3, 5, 5, 31]),
    (1, &[1, 3, 3, 9, 7, 49]),
    (13, &[1, 1, 1, 15, 21, 21]),
    (16, &[1, 3, 1, 13, 27, 49]),
    (19, &[1, 1, 1, 15, 7, 5]),
    (22, &[1, 3, 1, 15, 13, 25]),
    (25, &[1, 1, 5, 5, 19, 61]),
    (1, &[1, 3, 7, 11, 23, 15, 103]),
    (4, &[1, 3, 7, 13, 13, 15, 69]),
];

/// Direction numbers of a dimension, from the most significant bit.
fn directions(dimension: usize) -> [u32; 32] {
    let mut numbers = [0; 32];
    let Some((polynomial, initial)) = dimension.checked_sub(1).map(|row| TABLE[row]) else {
        return std::array::from_fn(|bit| 1 << (31 - bit));
    };
    let degree = initial.len();
    for bit in 0..32 {
        numbers[bit] = match initial.get(bit) {
            Some(number) => number << (31 - bit),
            None => {
                let before = numbers[bit - degree];
                let sum = (1..degree).filter(|k| polynomial >> (degree - 1 - k) & 1 == 1);
                sum.fold(before ^ (before >> degree), |all, k| all ^ numbers[bit - k])
            }
        };
    }
    numbers
}

/// A point of a dimension before scrambling, as 32 bits of a fraction.
fn plain(index: u32, dimension: usize) -> u32 {
    let numbers = directions(dimension);
    (0..32).filter(|bit| index >> bit & 1 == 1).fold(0, |point, bit| point ^ numbers[bit])
}

/// A scrambled point of a dimension, as 32 bits of a fraction.
pub(crate) fn sobol(index: u32, dimension: usize, seed: u32) -> u32 {
    let mut point = plain(index, dimension).reverse_bits().wrapping_add(seed);
    for factor in [0x6c50_b47c, 0xb82f_1e52, 0xc7af_e638, 0x8d22_f6e6u32] {
        point ^= point.wrapping_mul(factor);
    }
    point.reverse_bits()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each dimension alone is a (0, 1)-sequence in base 2 (Niederreiter 1987), scrambled or not.
    #[test]
    fn every_dimension_has_a_point_in_each_interval() {
        for dimension in 0..DIMENSIONS {
            for seed in [0, 99] {
                let mut met: Vec<u32> = (0..256).map(|index| sobol(index, dimension, seed) >> 24).collect();
                met.sort_unstable();
                assert!(met.iter().copied().eq(0..256), "dimension {dimension}");
            }
        }
    }

    /// Sobol points of the first three dimensions (Bratley and Fox 1988, table of the first points in binary order).
    #[test]
    fn the_first_points_are_those_of_the_literature() {
        let point = |index, dimension| f64::from(plain(index, dimension)) / 4_294_967_296.0;
        let expected = [[0.0; 3], [0.5; 3], [0.25, 0.75, 0.75], [0.75, 0.25, 0.25]];
        for (index, row) in (0..).zip(expected) {
            assert_eq!([0, 1, 2].map(|dimension| point(index, dimension)), row);
        }
        assert_ne!(point(5, 1), point(5, 2));
    }
}
