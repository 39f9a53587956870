//! Uniform numbers by counting: each follows from seed, stream, number, attempt and name alone, in every order and on every machine.
//!
//! A number is the first 53 bits of a SHA-256 (FIPS 180-4) of a line of text: `seed/stream/number/attempt/name`. Only the first attempt of a sample is
//! stratified. The attempts after a rejection take plain random numbers.

use sha2::{Digest, Sha256};

use super::sobol::{DIMENSIONS, sobol};

/// How the first attempts of all samples fill the unit cube.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum CubeSampling {
    /// Independent numbers.
    Random,
    /// Each of N samples lies in its own N-th of each quantity.
    LatinHypercube,
    /// A Sobol sequence with Owen's scrambling, for the first 21 numbers of a sample. Further numbers are independent.
    Sobol,
}

/// The things that have random numbers of their own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum RandomStream {
    Orbit,
    Image,
}

impl RandomStream {
    fn word(self) -> &'static str {
        match self {
            Self::Orbit => "orbit",
            Self::Image => "image",
        }
    }
}

/// The numbers of a data set.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct RandomPlan {
    pub(crate) seed: u64,
    pub(crate) sampling: CubeSampling,
    /// Number of orbits, and of images.
    pub(crate) counts: [u64; 2],
    /// Names of the numbers of an orbit, and of an image, in the order of their Sobol dimensions.
    pub(crate) names: [Vec<String>; 2],
}

/// The numbers of one orbit or image.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RandomSource<'a> {
    plan: &'a RandomPlan,
    stream: RandomStream,
    number: u64,
    attempt: u32,
}

impl RandomPlan {
    /// The numbers of an orbit or image in one of its attempts, from 0.
    pub(crate) fn source(&self, stream: RandomStream, number: u64, attempt: u32) -> RandomSource<'_> {
        RandomSource { plan: self, stream, number, attempt }
    }

    /// A number that belongs to a name alone.
    fn key(&self, stream: RandomStream, name: &str) -> u64 {
        word(&format!("{}/{}/key/{name}", self.seed, stream.word()))
    }

    /// A place from 0 to `count - 1` for each number from 0 to `count - 1`, no place twice.
    pub(crate) fn place(&self, stream: RandomStream, name: &str, number: u64, count: u64) -> u64 {
        permuted(number, count, self.key(stream, name))
    }
}

impl RandomSource<'_> {
    /// A number between 0 and 1, without the ends.
    pub(crate) fn uniform(&self, name: &str) -> f64 {
        let Self { plan, stream, number, attempt } = *self;
        let plain = unit(word(&format!("{}/{}/{number}/{attempt}/{name}", plan.seed, stream.word())));
        if attempt > 0 {
            return plain;
        }
        match plan.sampling {
            CubeSampling::Random => plain,
            CubeSampling::LatinHypercube => {
                let count = plan.counts[stream as usize].max(1);
                (plan.place(stream, name, number, count) as f64 + plain) / count as f64
            }
            CubeSampling::Sobol => {
                let dimension = plan.names[stream as usize].iter().position(|known| known == name);
                match dimension.filter(|dimension| *dimension < DIMENSIONS) {
                    Some(dimension) => {
                        let cell = sobol(number as u32, dimension, plan.key(stream, name) as u32);
                        (f64::from(cell) + plain) / 4_294_967_296.0
                    }
                    None => plain,
                }
            }
        }
    }

    /// 32 bits, such as a seed of a sensor.
    pub(crate) fn bits(&self, name: &str) -> u32 {
        let Self { plan, stream, number, attempt } = *self;
        word(&format!("{}/{}/{number}/{attempt}/{name}", plan.seed, stream.word())) as u32
    }
}

/// The first 64 bits of a SHA-256.
fn word(text: &str) -> u64 {
    let sum = Sha256::digest(text.as_bytes());
    sum.iter().take(8).fold(0, |all, byte| all << 8 | u64::from(*byte))
}

/// A number between 0 and 1 from the upper 53 bits.
fn unit(word: u64) -> f64 {
    ((word >> 11) as f64 + 0.5) / 9_007_199_254_740_992.0
}

/// The finaliser of splitmix64 (Steele, Lea and Flood 2014).
fn mixed(mut word: u64) -> u64 {
    word = (word ^ (word >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    word = (word ^ (word >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    word ^ (word >> 31)
}

/// A permutation of 0 to `count - 1`: a Feistel network over a power of 4, walked until it is within (Black and Rogaway 2002).
fn permuted(number: u64, count: u64, key: u64) -> u64 {
    let half = (64 - (count - 1).leading_zeros()).div_ceil(2).max(1);
    let mask = (1u64 << half) - 1;
    let mut place = number;
    loop {
        let (mut left, mut right) = (place >> half, place & mask);
        for round in 0..6u64 {
            let next = left ^ (mixed(right ^ key.wrapping_add(round.wrapping_mul(0x9e37_79b9_7f4a_7c15))) & mask);
            (left, right) = (right, next);
        }
        place = left << half | right;
        if place < count {
            return place;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan(sampling: CubeSampling, count: u64) -> RandomPlan {
        RandomPlan {
            seed: 7,
            sampling,
            counts: [count, count],
            names: [Vec::new(), vec!["a".to_owned(), "b".to_owned()]],
        }
    }

    #[test]
    fn a_number_is_the_hash_that_the_text_says() {
        // printf '7/image/3/1/a' | sha256sum
        let expected = 0x85ee_7bc8_4f7e_cc3e;
        let computed = plan(CubeSampling::Random, 9).source(RandomStream::Image, 3, 1).uniform("a");
        assert_eq!(computed, unit(expected));
        assert_ne!(computed, plan(CubeSampling::Random, 9).source(RandomStream::Orbit, 3, 1).uniform("a"));
    }

    #[test]
    fn a_permutation_meets_each_place_once() {
        for count in [1, 2, 3, 17, 64, 1000] {
            let mut met: Vec<u64> = (0..count).map(|number| permuted(number, count, 5)).collect();
            assert!(count < 17 || met != (0..count).collect::<Vec<_>>());
            met.sort_unstable();
            assert_eq!(met, (0..count).collect::<Vec<_>>());
        }
    }

    #[test]
    fn a_latin_hypercube_has_one_number_in_each_stratum() {
        let strata = |sampling| {
            let plan = plan(sampling, 100);
            let of = |number| (plan.source(RandomStream::Image, number, 0).uniform("a") * 100.0) as usize;
            (0..100).map(of).collect::<std::collections::BTreeSet<_>>().len()
        };
        assert_eq!(strata(CubeSampling::LatinHypercube), 100);
        assert!(strata(CubeSampling::Random) < 80);
    }

    /// The first 2^m points of a (0, 2)-sequence in base 2 have one in each elementary interval (Niederreiter 1987).
    #[test]
    fn two_sobol_dimensions_are_a_net() {
        let intervals = |sampling| {
            let plan = plan(sampling, 64);
            let of = |number| {
                let source = plan.source(RandomStream::Image, number, 0);
                [(source.uniform("a") * 8.0) as usize, (source.uniform("b") * 8.0) as usize]
            };
            (0..64).map(of).collect::<std::collections::BTreeSet<_>>().len()
        };
        assert_eq!(intervals(CubeSampling::Sobol), 64);
        assert!(intervals(CubeSampling::Random) < 60);
    }

    #[test]
    fn the_mean_of_uniform_numbers_is_a_half() {
        let plan = plan(CubeSampling::Random, 1);
        let mean =
            (0..4000).map(|number| plan.source(RandomStream::Image, number, 0).uniform("x")).sum::<f64>() / 4000.0;
        // The standard deviation of the mean is 1 / sqrt(12 * 4000).
        assert!((mean - 0.5).abs() < 4.0 / (12.0f64 * 4000.0).sqrt(), "{mean}");
    }
}
