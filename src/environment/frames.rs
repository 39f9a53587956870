//! Rotations between the Earth's reference frames and GCRF: precession, nutation, sidereal time.
//!
//! GCRF, ICRF, EME2000 and J2000 count as one frame. The differences are about 0.02 arc seconds, which is 0.7 m in low orbit. Precession
//! is IAU 2006. Nutation is the 13 largest terms of IAU 1980, which stay within 0.05 arc seconds of IAU 2006/2000A between 1950 and 2100.
//! Polar motion (0.3 arc seconds) and UT1 - UTC (below 0.9 s) need a download and are left out.

use std::f64::consts::{PI, TAU};

use glam::{DMat3, DVec3};
use hifitime::Epoch;

use super::utc::utc_days;

/// Rate of the Earth's rotation [rad/s] (IERS Conventions 2010, table 1.2).
pub(crate) const EARTH_RATE: f64 = 7.292_115e-5;

const ARC_SECOND: f64 = PI / 648_000.0;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ReferenceFrame {
    /// GCRF, ICRF, EME2000, J2000.
    Inertial,
    /// True equator and mean equinox of date, the frame of SGP4.
    Teme,
    /// Fixed to the Earth.
    Itrf,
}

/// Julian centuries of TT since J2000.
pub(crate) fn tt_centuries(epoch: Epoch) -> f64 {
    epoch.to_tt_centuries_j2k()
}

/// Rotates vectors of the mean equator and equinox of date into GCRF. `centuries` is TT since J2000.
///
/// Source: Capitaine, Wallace & Chapront 2003, A&A 412, eq. 40 (the equatorial angles of IAU 2006).
pub(crate) fn gcrf_from_mean(centuries: f64) -> DMat3 {
    let t = centuries;
    let zeta = (((0.018_018_28 * t + 0.298_849_9) * t + 2_306.083_227) * t + 2.650_545) * ARC_SECOND;
    let z = (((0.018_268_37 * t + 1.092_734_8) * t + 2_306.077_181) * t - 2.650_545) * ARC_SECOND;
    let theta = ((-0.041_822_64 * t - 0.429_493_4) * t + 2_004.191_903) * t * ARC_SECOND;
    DMat3::from_rotation_z(-zeta) * DMat3::from_rotation_y(theta) * DMat3::from_rotation_z(-z)
}

/// Mean obliquity of the ecliptic [rad] (IAU 2006).
pub(crate) fn mean_obliquity(centuries: f64) -> f64 {
    let t = centuries;
    (((0.002_003_40 * t - 0.000_183_1) * t - 46.836_769) * t + 84_381.406) * ARC_SECOND
}

/// Nutation terms: the multiples of D, M, M', F and the node, then longitude and its rate, obliquity and its rate [0.0001 arc seconds, and
/// per century]. The table has the 13 largest terms of Wahr's series (Seidelmann 1982; Meeus, table 22.A).
const NUTATION: [([f64; 5], [f64; 4]); 13] = [
    ([0.0, 0.0, 0.0, 0.0, 1.0], [-171_996.0, -174.2, 92_025.0, 8.9]),
    ([-2.0, 0.0, 0.0, 2.0, 2.0], [-13_187.0, -1.6, 5736.0, -3.1]),
    ([0.0, 0.0, 0.0, 2.0, 2.0], [-2274.0, -0.2, 977.0, -0.5]),
    ([0.0, 0.0, 0.0, 0.0, 2.0], [2062.0, 0.2, -895.0, 0.5]),
    ([0.0, 1.0, 0.0, 0.0, 0.0], [1426.0, -3.4, 54.0, -0.1]),
    ([0.0, 0.0, 1.0, 0.0, 0.0], [712.0, 0.1, -7.0, 0.0]),
    ([-2.0, 1.0, 0.0, 2.0, 2.0], [-517.0, 1.2, 224.0, -0.6]),
    ([0.0, 0.0, 0.0, 2.0, 1.0], [-386.0, -0.4, 200.0, 0.0]),
    ([0.0, 0.0, 1.0, 2.0, 2.0], [-301.0, 0.0, 129.0, -0.1]),
    ([-2.0, -1.0, 0.0, 2.0, 2.0], [217.0, -0.5, -95.0, 0.3]),
    ([-2.0, 0.0, 1.0, 0.0, 0.0], [-158.0, 0.0, 0.0, 0.0]),
    ([-2.0, 0.0, 0.0, 2.0, 1.0], [129.0, 0.1, -70.0, 0.0]),
    ([0.0, 0.0, -1.0, 2.0, 2.0], [123.0, 0.0, -53.0, 0.0]),
];

/// Nutation in longitude and in obliquity [rad]. The arguments follow Meeus, chapter 22.
pub(crate) fn nutation(centuries: f64) -> [f64; 2] {
    let t = centuries;
    let arguments = [
        297.850_36 + (445_267.111_480 - 0.001_914_2 * t) * t,
        357.527_72 + (35_999.050_340 - 0.000_160_3 * t) * t,
        134.962_98 + (477_198.867_398 + 0.008_697_2 * t) * t,
        93.271_91 + (483_202.017_538 - 0.003_682_5 * t) * t,
        125.044_52 + (-1_934.136_261 + 0.002_070_8 * t) * t,
    ];
    let mut sums = [0.0; 2];
    for (multiples, [longitude, longitude_rate, obliquity, obliquity_rate]) in NUTATION {
        let degrees: f64 = multiples.iter().zip(arguments).map(|(multiple, argument)| multiple * argument).sum();
        let (sin, cos) = degrees.to_radians().sin_cos();
        sums[0] += (longitude + longitude_rate * t) * sin;
        sums[1] += (obliquity + obliquity_rate * t) * cos;
    }
    sums.map(|sum| sum * 1e-4 * ARC_SECOND)
}

/// Rotates vectors of the true equator and equinox of date into GCRF.
pub(crate) fn gcrf_from_true(centuries: f64) -> DMat3 {
    let [longitude, obliquity] = nutation(centuries);
    let mean = mean_obliquity(centuries);
    gcrf_from_mean(centuries)
        * DMat3::from_rotation_x(mean)
        * DMat3::from_rotation_z(-longitude)
        * DMat3::from_rotation_x(-(mean + obliquity))
}

/// Angle from the mean to the true equinox along the equator [rad]. Terms of 0.003 arc seconds are left out.
fn equation_of_equinoxes(centuries: f64) -> f64 {
    nutation(centuries)[0] * mean_obliquity(centuries).cos()
}

pub(crate) fn gcrf_from_teme(centuries: f64) -> DMat3 {
    gcrf_from_true(centuries) * DMat3::from_rotation_z(equation_of_equinoxes(centuries))
}

/// Greenwich apparent sidereal time [rad] (IAU 2006). UTC serves as UT1.
fn sidereal_time(epoch: Epoch) -> f64 {
    let days = utc_days(epoch);
    let rotation = TAU * (0.779_057_273_264_0 + 0.002_737_811_911_354_48 * days + days.rem_euclid(1.0));
    let t = tt_centuries(epoch);
    let accumulated = ((1.391_581_7 * t + 4_612.156_534) * t + 0.014_506) * ARC_SECOND;
    (rotation + accumulated + equation_of_equinoxes(t)).rem_euclid(TAU)
}

pub(crate) fn gcrf_from_itrf(epoch: Epoch) -> DMat3 {
    gcrf_from_true(tt_centuries(epoch)) * DMat3::from_rotation_z(sidereal_time(epoch))
}

pub(crate) fn to_gcrf(
    frame: ReferenceFrame,
    epoch: Epoch,
    position: DVec3,
    velocity: Option<DVec3>,
) -> (DVec3, Option<DVec3>) {
    match frame {
        ReferenceFrame::Inertial => (position, velocity),
        ReferenceFrame::Teme => {
            let rotation = gcrf_from_teme(tt_centuries(epoch));
            (rotation * position, velocity.map(|velocity| rotation * velocity))
        }
        ReferenceFrame::Itrf => {
            let rotation = gcrf_from_itrf(epoch);
            let spin = DVec3::Z * EARTH_RATE;
            (rotation * position, velocity.map(|velocity| rotation * (velocity + spin.cross(position))))
        }
    }
}

#[cfg(test)]
mod tests {
    use hifitime::TimeScale;

    use super::*;

    fn epoch(julian_day: f64) -> Epoch {
        // The reference values are for 0.3 days later.
        Epoch::from_jde_in_time_scale(julian_day + 0.3, TimeScale::UTC)
    }

    /// Transposed `erfa.c2t06a(jd, 0.3, jd, 0.3, 0, 0)` of pyerfa 2.0.1.5 (IAU 2006/2000A), TT = UT1.
    #[test]
    fn the_earth_turns_as_the_standards_of_fundamental_astronomy_say() {
        let expected = [
            (
                2_433_282.5,
                DMat3::from_cols_array(&[
                    -0.874_508_768_932_8,
                    -0.484_991_095_404_6,
                    -0.004_248_580_012_593,
                    0.484_985_299_139_8,
                    -0.874_519_089_100_2,
                    0.002_371_163_768_281,
                    -0.004_865_457_635_959,
                    1.310_465_961_046e-5,
                    0.999_988_163_505_1,
                ]),
            ),
            (
                2_460_000.5,
                DMat3::from_cols_array(&[
                    -0.128_777_821_409_5,
                    -0.991_673_419_566_9,
                    3.188_062_478_409e-4,
                    0.991_670_960_012_7,
                    -0.128_778_212_131_4,
                    -0.002_208_879_284_729,
                    0.002_231_542_172_311,
                    3.169_623_581_034e-5,
                    0.999_997_509_604_3,
                ]),
            ),
            (
                2_488_070.5,
                DMat3::from_cols_array(&[
                    -0.876_786_782_744_6,
                    -0.480_804_364_948_4,
                    0.008_491_186_666_053,
                    0.480_781_075_916_5,
                    -0.876_827_895_387_3,
                    -0.004_732_748_796_569,
                    0.009_720_835_613_331,
                    -6.720_972_976_865e-5,
                    0.999_952_749_302_6,
                ]),
            ),
        ];
        for (day, rotation) in expected {
            let centuries = (day + 0.3 - 2_451_545.0) / 36_525.0;
            let days = day + 0.3 - 2_451_545.0;
            let turned = TAU * (0.779_057_273_264_0 + 1.002_737_811_911_354_5 * days)
                + ((1.391_581_7 * centuries + 4_612.156_534) * centuries + 0.014_506) * ARC_SECOND
                + equation_of_equinoxes(centuries);
            let computed = gcrf_from_true(centuries) * DMat3::from_rotation_z(turned);
            let worst = (computed - rotation).to_cols_array().into_iter().fold(0.0_f64, |a, b| a.max(b.abs()));
            assert!(worst < 0.15 * ARC_SECOND, "{day}: {} arc seconds", worst / ARC_SECOND);
            let late = gcrf_from_true(centuries) * DMat3::from_rotation_z(turned + ARC_SECOND);
            assert!((late - rotation).to_cols_array().iter().any(|error| error.abs() > 0.3 * ARC_SECOND));
            // This call uses UTC as UT1. TT is 32 to 70 s ahead of UTC, which changes precession by nothing that matters.
            let by_epoch = gcrf_from_itrf(epoch(day));
            let worst = (by_epoch - rotation).to_cols_array().into_iter().fold(0.0_f64, |a, b| a.max(b.abs()));
            assert!(worst < 0.2 * ARC_SECOND, "{day}: {} arc seconds by epoch", worst / ARC_SECOND);
        }
    }

    #[test]
    fn what_rests_on_the_ground_moves_with_it() {
        let start = epoch(2_460_000.5);
        let place = DVec3::new(4.0e6, 1.0e6, 4.8e6);
        let at = |seconds: f64| {
            to_gcrf(ReferenceFrame::Itrf, start + hifitime::Unit::Second * seconds, place, Some(DVec3::ZERO))
        };
        let velocity = at(0.0).1.unwrap();
        let chord = (at(50.0).0 - at(-50.0).0) / 100.0;
        assert!(velocity.distance(chord) < 1e-2, "{velocity} {chord}");
        assert!(velocity.length() > 250.0);
    }

    /// The rotation follows the Earth's rate. A lost second would move the equator by 0.46 km.
    #[test]
    fn the_ground_turns_steadily_up_to_a_leap_second() {
        let midnight = Epoch::from_gregorian_utc_hms(2017, 1, 1, 0, 0, 0).to_time_scale(TimeScale::TAI);
        let at = |seconds: f64| gcrf_from_itrf(midnight + hifitime::Unit::Second * seconds) * DVec3::X;
        for before in [90.0, 36.0, 20.0, 2.0] {
            let turned = at(-before).angle_between(at(-before + 0.5));
            assert!((turned / (0.5 * EARTH_RATE) - 1.0).abs() < 1e-3, "{before}: {turned}");
        }
        let across = at(-100.0).angle_between(at(-20.0));
        assert!((across / (80.0 * EARTH_RATE) - 1.0).abs() < 1e-4, "{across}");
    }

    /// Meeus, example 22.a: 1987 April 10, 0h TD, -3.788" and +9.443".
    #[test]
    fn nutation_of_a_published_example() {
        let [longitude, obliquity] = nutation((2_446_895.5 - 2_451_545.0) / 36_525.0).map(|angle| angle / ARC_SECOND);
        assert!((longitude + 3.788).abs() < 0.05 && (obliquity - 9.443).abs() < 0.03, "{longitude} {obliquity}");
    }
}
