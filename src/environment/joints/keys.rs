//! Keys of an animation: values at times, and their interpolation (glTF 2.0, appendix C).

use glam::{DQuat, DVec3};

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum KeyInterpolation {
    /// Constant until the next key.
    Step,
    /// Linear. Rotations take the shortest arc.
    Linear,
    /// A cubic with the tangents of the file.
    CubicSpline,
}

/// The keys of a channel: rising times [s], and for each a value, or a tangent, value and tangent of a cubic.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Keys<const N: usize> {
    times: Vec<f64>,
    values: Vec<[f64; N]>,
    interpolation: KeyInterpolation,
}

impl<const N: usize> Keys<N> {
    /// Keys of values without tangents.
    pub(crate) fn new(times: Vec<f64>, values: Vec<[f64; N]>, interpolation: KeyInterpolation) -> Self {
        Self { times, values, interpolation }
    }

    /// Time of the last key [s].
    pub(crate) fn last_time(&self) -> Option<f64> {
        self.times.last().copied()
    }

    /// The value of every key, without tangents.
    pub(crate) fn stated(&self) -> impl Iterator<Item = [f64; N]> {
        (0..self.times.len()).map(|key| self.value(key))
    }

    /// The key at or before a time, the length of the interval to the next [s] and the share of it that has passed. Beyond the ends it is
    /// the first or the last key.
    fn place(&self, time: f64) -> (usize, f64, f64) {
        let after = self.times.partition_point(|key| *key <= time);
        if after == 0 || after == self.times.len() {
            return (after.saturating_sub(1), 0.0, 0.0);
        }
        let length = self.times[after] - self.times[after - 1];
        (after - 1, length, (time - self.times[after - 1]) / length)
    }

    fn value(&self, key: usize) -> [f64; N] {
        if self.interpolation == KeyInterpolation::CubicSpline { self.values[3 * key + 1] } else { self.values[key] }
    }

    /// The value at a time. `blend` interpolates linearly between two values.
    fn at(&self, time: f64, blend: impl Fn([f64; N], [f64; N], f64) -> [f64; N]) -> [f64; N] {
        let (key, length, s) = self.place(time);
        if length == 0.0 {
            return self.value(key);
        }
        match self.interpolation {
            KeyInterpolation::Step => self.value(key),
            KeyInterpolation::Linear => blend(self.value(key), self.value(key + 1), s),
            KeyInterpolation::CubicSpline => {
                let (s2, s3) = (s * s, s * s * s);
                let (from, to) = (self.value(key), self.value(key + 1));
                let (leaves, arrives) = (self.values[3 * key + 2], self.values[3 * (key + 1)]);
                std::array::from_fn(|i| {
                    (2.0 * s3 - 3.0 * s2 + 1.0) * from[i]
                        + length * (s3 - 2.0 * s2 + s) * leaves[i]
                        + (3.0 * s2 - 2.0 * s3) * to[i]
                        + length * (s3 - s2) * arrives[i]
                })
            }
        }
    }
}

impl Keys<3> {
    /// The vector at a time [s].
    pub(crate) fn vector(&self, time: f64) -> DVec3 {
        let blend = |a: [f64; 3], b: [f64; 3], s: f64| DVec3::from_array(a).lerp(DVec3::from_array(b), s).to_array();
        DVec3::from_array(self.at(time, blend))
    }
}

impl Keys<4> {
    /// The rotation at a time [s].
    pub(crate) fn rotation(&self, time: f64) -> DQuat {
        let unit = |value: [f64; 4]| DQuat::from_array(value).normalize();
        let blend = |a: [f64; 4], b: [f64; 4], s: f64| unit(a).slerp(unit(b), s).to_array();
        unit(self.at(time, blend))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A cubic spline holds t^2 (slopes 0 and 2) and t^3 (slopes 0 and 3) exactly.
    #[test]
    fn a_cubic_goes_by_its_tangents() {
        let keys = |slope: f64| Keys::<3> {
            times: vec![1.0, 2.0],
            values: vec![[0.0; 3], [0.0; 3], [0.0; 3], [slope, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0; 3]],
            interpolation: KeyInterpolation::CubicSpline,
        };
        for s in [0.0, 0.25, 0.5, 1.0f64] {
            assert!((keys(2.0).vector(1.0 + s).x - s * s).abs() < 1e-15);
            assert!((keys(3.0).vector(1.0 + s).x - s * s * s).abs() < 1e-15);
        }
        assert!((keys(2.0).vector(1.5).x - 0.125).abs() > 0.1);
    }

    #[test]
    fn rotations_take_the_shortest_arc_and_steps_stay() {
        let turn = |degrees: f64| DQuat::from_rotation_z(degrees.to_radians());
        // The second key is the quaternion of 90 deg with the opposite sign, which is the same rotation.
        let values = vec![turn(0.0).to_array(), (-turn(90.0)).to_array()];
        let keys = |interpolation| Keys::<4> { times: vec![0.0, 10.0], values: values.clone(), interpolation };
        let linear = keys(KeyInterpolation::Linear);
        for (time, degrees) in [(-1.0, 0.0), (0.0, 0.0), (2.5, 22.5), (10.0, 90.0), (11.0, 90.0)] {
            assert!(linear.rotation(time).angle_between(turn(degrees)) < 1e-7, "{time} s");
        }
        assert!(keys(KeyInterpolation::Step).rotation(9.9).angle_between(turn(0.0)) < 1e-7);
    }
}
