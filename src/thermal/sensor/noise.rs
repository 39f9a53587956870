//! Noise by counting: each number follows from seed, counter, stream and place alone, on every device and in every order. Twin: `glsl/sensor_noise.glsl`.

/// Purpose of a random number. Numbers of different streams are independent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum NoiseStream {
    /// Temporal noise, counted by time.
    Time = 0,
    /// Offsets, counted by shutter corrections.
    Offset = 1,
    Gain = 2,
    /// Drift of offsets, counted by shutter corrections.
    Drift = 3,
    Bad = 4,
}

/// Hash of four words to four words (pcg4d of Jarzynski and Olano, "Hash Functions for GPU Rendering", Journal of Computer Graphics Techniques 9(3), 2020).
pub(crate) fn pcg4d(v: [u32; 4]) -> [u32; 4] {
    let [mut x, mut y, mut z, mut w] = v.map(|v| v.wrapping_mul(1_664_525).wrapping_add(1_013_904_223));
    let stir = |x: &mut u32, y: &mut u32, z: &mut u32, w: &mut u32| {
        *x = x.wrapping_add(y.wrapping_mul(*w));
        *y = y.wrapping_add(z.wrapping_mul(*x));
        *z = z.wrapping_add(x.wrapping_mul(*y));
        *w = w.wrapping_add(y.wrapping_mul(*z));
    };
    stir(&mut x, &mut y, &mut z, &mut w);
    [x, y, z, w] = [x, y, z, w].map(|v| v ^ (v >> 16));
    stir(&mut x, &mut y, &mut z, &mut w);
    [x, y, z, w]
}

/// Four random words for a group of four pixels.
pub(crate) fn random_words(seed: u32, counter: u64, stream: NoiseStream, group: u32) -> [u32; 4] {
    pcg4d([group, counter as u32, ((counter >> 32) as u32).wrapping_mul(16) + stream as u32, seed])
}

/// A word as a number between -1 and 1, neither included. The 23 upper bits decide, and f32 holds the number exactly.
pub(crate) fn symmetric(word: u32) -> f64 {
    (f64::from(word >> 9) + 0.5) / f64::from(1 << 22) - 1.0
}

/// A word as a number of the normal distribution, at most 5.3 standard deviations from 0. Giles's approximation of the inverse error function ("Approximating
/// the erfinv function", GPU Computing Gems 2, 2011) errs by less than 1e-6.
pub(crate) fn normal(word: u32) -> f64 {
    let x = symmetric(word);
    let w = -((1.0 - x) * (1.0 + x)).ln();
    let polynomial = |at: f64, coefficients: [f64; 9]| coefficients.into_iter().fold(0.0, |sum, c| sum * at + c);
    let central = polynomial(w - 2.5, CENTRAL);
    let tail = polynomial(w.sqrt() - 3.0, TAIL);
    std::f64::consts::SQRT_2 * x * if w < 5.0 { central } else { tail }
}

const CENTRAL: [f64; 9] = [
    2.810_226_36e-8,
    3.432_739_39e-7,
    -3.523_387_7e-6,
    -4.391_506_54e-6,
    0.000_218_580_87,
    -0.001_253_725_03,
    -0.004_177_681_64,
    0.246_640_727,
    1.501_409_41,
];

const TAIL: [f64; 9] = [
    -0.000_200_214_257,
    0.000_100_950_558,
    0.001_349_343_22,
    -0.003_673_428_44,
    0.005_739_507_73,
    -0.007_622_461_3,
    0.009_438_870_47,
    1.001_674_06,
    2.832_976_82,
];

#[cfg(test)]
mod tests {
    use super::*;

    /// Words of the normal distribution's quantiles, from tables: P(z < 1.959963985) = 0.975 and so on.
    #[test]
    fn normals_have_the_quantiles_of_the_tables() {
        for (p, z) in [
            (0.5, 0.0),
            (0.75, 0.674_489_750_2),
            (0.841_344_746_1, 1.0),
            (0.975, 1.959_963_985),
            (0.999, 3.090_232_306),
            (0.999_99, 4.264_890_794),
            (0.001, -3.090_232_306),
        ] {
            let computed = normal((p * 4_294_967_296.0) as u32);
            // A word stands for an interval of 2^-23, which is wide in the tail.
            let density = (-0.5f64 * z * z).exp() / 2.506_628;
            assert!((computed - z).abs() < 1e-6 + 1.2e-7 / density, "{p}: {computed} instead of {z}");
        }
        assert!((normal(u32::MAX) - 5.294).abs() < 0.01 && normal(0) == -normal(u32::MAX));
    }

    #[test]
    fn moments_are_those_of_independent_normals() {
        let count = 1 << 16;
        let stream =
            |stream| (0..count).flat_map(move |group| random_words(5, 40_000_000_000, stream, group).map(normal));
        let n = f64::from(4 * count);
        let moment = |power: i32| stream(NoiseStream::Time).map(|z| z.powi(power)).sum::<f64>() / n;
        // Standard errors of the moments of n = 262,144 normals: 1, sqrt 2, sqrt 15 and sqrt 96 over sqrt n.
        for (power, expected, variance) in [(1, 0.0, 1.0), (2, 1.0, 2.0), (3, 0.0, 15.0f64), (4, 3.0, 96.0)] {
            let error = (moment(power) - expected).abs() / (variance / n).sqrt();
            assert!(error < 4.0, "moment {power} is {error} standard errors off");
        }
        let pairs = stream(NoiseStream::Time).zip(stream(NoiseStream::Offset)).map(|(a, b)| a * b).sum::<f64>() / n;
        let next =
            stream(NoiseStream::Time).zip(stream(NoiseStream::Time).skip(1)).map(|(a, b)| a * b).sum::<f64>() / n;
        assert!(pairs.abs().max(next.abs()) < 4.0 / n.sqrt(), "{pairs} {next}");
        let same = stream(NoiseStream::Time).map(|a| a * a).sum::<f64>() / n;
        assert!(same > 0.9, "the test sees a correlation");
    }

    #[test]
    fn every_part_of_the_counter_matters() {
        let one = random_words(1, 2, NoiseStream::Gain, 3);
        for other in [
            random_words(2, 2, NoiseStream::Gain, 3),
            random_words(1, 3, NoiseStream::Gain, 3),
            random_words(1, 2 + (1 << 32), NoiseStream::Gain, 3),
            random_words(1, 2, NoiseStream::Drift, 3),
            random_words(1, 2, NoiseStream::Gain, 4),
        ] {
            assert!(one.iter().zip(other).all(|(a, b)| *a != b));
        }
    }
}
