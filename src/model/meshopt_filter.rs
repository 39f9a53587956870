//! Filters of EXT_meshopt_compression for decoded attributes (appendix B of its specification).

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum Filter {
    /// The elements are as they are.
    #[default]
    None,
    /// Unit vectors as two coordinates of an octahedron, 8 or 16 bits each.
    Octahedral,
    /// Unit quaternions without their largest component, 16 bits each.
    Quaternion,
    /// Floats as an exponent of 8 bits and a mantissa of 24.
    Exponential,
}

impl Filter {
    /// Undoes the filter of elements of `stride` bytes, in place.
    ///
    /// # Errors
    /// A stride that the filter does not have, in words.
    pub(super) fn apply(self, elements: &mut [u8], stride: usize) -> Result<(), String> {
        match (self, stride) {
            (Self::None, _) => {}
            (Self::Octahedral, 4) => elements.as_chunks_mut::<4>().0.iter_mut().for_each(|bytes| {
                let [x, y, one, rest] = bytes.map(|byte| byte as i8);
                let unit = octahedral([x, y, one].map(f64::from), 127.0);
                let [x, y, z] = unit.map(|value| value as i8);
                *bytes = [x, y, z, rest].map(|value| value as u8);
            }),
            (Self::Octahedral, 8) => each_of_four(elements, |[x, y, one, rest]| {
                let [x, y, z] = octahedral([x, y, one].map(f64::from), 32767.0).map(|value| value as i16);
                [x, y, z, rest]
            }),
            (Self::Quaternion, 8) => each_of_four(elements, quaternion),
            (Self::Exponential, stride) if stride.is_multiple_of(4) => {
                elements.as_chunks_mut::<4>().0.iter_mut().for_each(|bytes| {
                    let value = i32::from_le_bytes(*bytes);
                    let (exponent, mantissa) = (value >> 24, value << 8 >> 8);
                    *bytes = ((f64::from(mantissa) * f64::from(exponent).exp2()) as f32).to_le_bytes();
                });
            }
            (filter, stride) => return Err(format!("has elements of {stride} bytes, which {filter:?} does not take")),
        }
        Ok(())
    }
}

/// Changes elements of four 16-bit integers.
fn each_of_four(elements: &mut [u8], change: impl Fn([i16; 4]) -> [i16; 4]) {
    for bytes in elements.as_chunks_mut::<8>().0 {
        let [a, b, c, d, e, f, g, h] = *bytes;
        let values = [[a, b], [c, d], [e, f], [g, h]].map(i16::from_le_bytes);
        bytes.copy_from_slice(change(values).map(i16::to_le_bytes).as_flattened());
    }
}

/// A unit vector times `largest`, from two coordinates in units of `one`. The lower half of the octahedron is folded over the upper.
fn octahedral([x, y, one]: [f64; 3], largest: f64) -> [f64; 3] {
    let z = one - x.abs() - y.abs();
    let fold = z.min(0.0);
    let unfold = |value: f64| if value >= 0.0 { value + fold } else { value - fold };
    let (x, y) = (unfold(x), unfold(y));
    let length = (x * x + y * y + z * z).sqrt();
    [x, y, z].map(|value| if length > 0.0 { (value * largest / length).round() } else { 0.0 })
}

/// A unit quaternion in units of 1/32767. The two lowest bits of the last number say which component is left out; the rest of it is the unit of the others,
/// which are at most 1/sqrt(2).
fn quaternion([x, y, z, last]: [i16; 4]) -> [i16; 4] {
    let unit = std::f64::consts::FRAC_1_SQRT_2 / f64::from(last | 3);
    let [x, y, z] = [x, y, z].map(|value| f64::from(value) * unit);
    let largest = (1.0 - x * x - y * y - z * z).max(0.0).sqrt();
    let mut quaternion = [0; 4];
    let first = (last & 3) as usize;
    for (at, value) in [largest, x, y, z].into_iter().enumerate() {
        quaternion[(first + at) % 4] = (value * 32767.0).round() as i16;
    }
    quaternion
}

#[cfg(test)]
mod tests {
    use super::*;

    fn filtered(filter: Filter, mut elements: Vec<u8>, stride: usize) -> Vec<u8> {
        filter.apply(&mut elements, stride).unwrap();
        elements
    }

    #[test]
    fn vectors_of_an_octahedron_by_hand() {
        let signed = |values: [i8; 4]| values.map(|value| value as u8).to_vec();
        let of = |values| filtered(Filter::Octahedral, signed(values), 4);
        assert_eq!(of([0, 0, 127, 9]), signed([0, 0, 127, 9]), "the top");
        assert_eq!(of([0, -127, 127, 0]), signed([0, -127, 0, 0]), "a corner");
        assert_eq!(of([127, 127, 127, 0]), signed([0, 0, -127, 0]), "the bottom is at the corners of the square");
        // A third each of x, y and z: 127 / sqrt(3) = 73.3.
        assert_eq!(of([1, 1, 3, 0]), signed([73, 73, 73, 0]));
        let wide = |values: [i16; 4]| values.map(i16::to_le_bytes).as_flattened().to_vec();
        // 0.6, 0, -0.8 on the octahedron: (3/7, 0) lies below, folded to (1, 4/7) in the first quadrant: 1023, 585 of 1023.
        let computed = filtered(Filter::Octahedral, wide([1023, 585, 1023, 1]), 8);
        let x = i16::from_le_bytes([computed[0], computed[1]]);
        assert!((f64::from(x) / 32767.0 - 0.6).abs() < 1e-3, "{x}");
    }

    #[test]
    fn quaternions_and_exponents_by_hand() {
        let wide = |values: [i16; 4]| values.map(i16::to_le_bytes).as_flattened().to_vec();
        // 90 deg about z: (0, 0, s, s) with s = 1/sqrt(2). The last is left out: 2047 units of s are z.
        let computed = filtered(Filter::Quaternion, wide([0, 0, 2047, 2044 | 3]), 8);
        assert_eq!(computed, wide([0, 0, 23170, 23170]));
        // The first is left out, and is all.
        assert_eq!(filtered(Filter::Quaternion, wide([0, 0, 0, 2044]), 8), wide([32767, 0, 0, 0]));
        // 5 x 2^-2 and -3 x 2^1.
        let bits = |exponent: i32, mantissa: i32| (exponent << 24 | mantissa & 0xff_ffff).to_le_bytes();
        let found = filtered(Filter::Exponential, [bits(-2, 5), bits(1, -3)].concat(), 8);
        assert_eq!(found, [1.25f32.to_le_bytes(), (-6.0f32).to_le_bytes()].concat());
        assert!(Filter::Octahedral.apply(&mut [0; 12], 12).is_err());
        assert!(Filter::Quaternion.apply(&mut [0; 4], 4).is_err());
    }
}
