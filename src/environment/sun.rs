//! Position of the Sun as seen from the Earth's centre, between 1950 and 2100, without a download.

use glam::{DMat3, DVec3};

use super::frames::{gcrf_from_mean, mean_obliquity};
use super::orbit::SUN_DISTANCE;

/// Position of the Sun from the Earth's centre [m], GCRF. `centuries` is TT since J2000.
///
/// The position is geometric, without aberration (20.5 arc seconds). Source: VSOP87D of Bretagnon & Francou as printed by Meeus (Astronomical
/// Algorithms, appendix III) and Reda & Andreas (NREL/TP-560-34302), terms of 0.2 arc seconds and more, ecliptic and equinox of date, with IAU 2006
/// precession. The difference from `epv00` of ERFA (1950 to 2100) is at most 0.0007 deg and 1.1e-5 au.
pub(crate) fn sun_position(centuries: f64) -> DVec3 {
    let millennia = 0.1 * centuries;
    let longitude = series(LONGITUDE, millennia);
    let latitude = series(LATITUDE, millennia);
    let distance = series(DISTANCE, millennia) * SUN_DISTANCE;
    let (sin_longitude, cos_longitude) = longitude.sin_cos();
    let (sin_latitude, cos_latitude) = latitude.sin_cos();
    // The series gives the Earth as seen from the Sun.
    let ecliptic = -distance * DVec3::new(cos_latitude * cos_longitude, cos_latitude * sin_longitude, sin_latitude);
    gcrf_from_mean(centuries) * (DMat3::from_rotation_x(mean_obliquity(centuries)) * ecliptic)
}

/// Sum over powers of time of sums of A cos(B + C t), A in units of 1e-8.
fn series(powers: &[&[[f64; 3]]], millennia: f64) -> f64 {
    let terms = |rows: &[[f64; 3]]| rows.iter().map(|[a, b, c]| a * (b + c * millennia).cos()).sum::<f64>();
    powers.iter().rev().fold(0.0, |sum, rows| sum * millennia + terms(rows)) * 1e-8
}

/// Heliocentric longitude of the Earth, by powers of the time in millennia: A [1e-8 rad], B [rad], C [rad/millennium].
#[rustfmt::skip]
const LONGITUDE: &[&[[f64; 3]]] = &[
    &[
        [175_347_046.0, 0.0, 0.0],
        [3_341_656.0, 4.669_256_8, 6_283.075_85],
        [34_894.0, 4.626_1, 12_566.151_7],
        [3497.0, 2.744_1, 5_753.384_9],
        [3418.0, 2.828_9, 3.523_1],
        [3136.0, 3.627_7, 77_713.771_5],
        [2676.0, 4.418_1, 7_860.419_4],
        [2343.0, 6.135_2, 3_930.209_7],
        [1324.0, 0.742_5, 11_506.769_8],
        [1273.0, 2.037_1, 529.691],
        [1199.0, 1.109_6, 1_577.343_5],
        [990.0, 5.233, 5884.927],
        [902.0, 2.045, 26.298],
        [857.0, 3.508, 398.149],
        [780.0, 1.179, 5223.694],
        [753.0, 2.533, 5507.553],
        [505.0, 4.583, 18_849.228],
        [492.0, 4.205, 775.523],
        [357.0, 2.92, 0.067],
        [317.0, 5.849, 11_790.629],
        [284.0, 1.899, 796.298],
        [271.0, 0.315, 10_977.079],
        [243.0, 0.345, 5486.778],
        [206.0, 4.806, 2544.314],
        [205.0, 1.869, 5573.143],
        [202.0, 2.458, 6069.777],
        [156.0, 0.833, 213.299],
        [132.0, 3.411, 2942.463],
        [126.0, 1.083, 20.775],
        [115.0, 0.645, 0.98],
        [103.0, 0.636, 4694.003],
        [102.0, 0.976, 15_720.839],
        [102.0, 4.267, 7.114],
    ],
    &[
        [628_331_966_747.0, 0.0, 0.0],
        [206_059.0, 2.678_235, 6_283.075_85],
        [4303.0, 2.635_1, 12_566.151_7],
    ],
    &[
        [52_919.0, 0.0, 0.0],
    ],
];
/// Heliocentric latitude of the Earth, in the same form and units.
#[rustfmt::skip]
const LATITUDE: &[&[[f64; 3]]] = &[
    &[
        [280.0, 3.199, 84_334.662],
        [102.0, 5.422, 5507.553],
    ],
];
/// Distance of the Earth from the Sun, in the same form with A in 1e-8 au.
#[rustfmt::skip]
const DISTANCE: &[&[[f64; 3]]] = &[
    &[
        [100_013_989.0, 0.0, 0.0],
        [1_670_700.0, 3.098_463_5, 6_283.075_85],
        [13_956.0, 3.055_25, 12_566.151_7],
        [3084.0, 5.198_5, 77_713.771_5],
        [1628.0, 1.173_9, 5_753.384_9],
        [1576.0, 2.846_9, 7_860.419_4],
        [925.0, 5.453, 11_506.77],
        [542.0, 4.564, 3930.21],
        [472.0, 3.661, 5884.927],
        [346.0, 0.964, 5507.553],
        [329.0, 5.9, 5223.694],
        [307.0, 0.299, 5573.143],
        [243.0, 4.273, 11_790.629],
        [212.0, 5.847, 1577.344],
    ],
    &[
        [103_019.0, 1.107_49, 6_283.075_85],
    ],
];

#[cfg(test)]
mod tests {
    use super::*;

    /// Centuries, then the Sun by `-erfa.epv00` (pyerfa 2.0.1.5) [au].
    const EXPECTED: &[(f64, [f64; 3])] = &[
        (-0.49998631074606437, [0.19129965671458252, -0.8848209765454675, -0.38373407824663186]),
        (-0.3636257855764996, [-0.8650266323027713, 0.4810570957034203, 0.20860655926135682]),
        (-0.22726526040694767, [0.935830116028107, 0.32874624817843473, 0.14255569386742578]),
        (-0.09090473523738295, [-0.38803285323780234, -0.8320407390090995, -0.3607531982918262]),
        (0.045455789932181766, [-0.4517348587183701, 0.8352313656156162, 0.36210978440791586]),
        (0.18181631510173374, [0.9688829856170736, -0.19784521031102822, -0.08576777891871872]),
        (0.31817684027129844, [-0.8352406967488335, -0.49455795088010507, -0.21436575583056622]),
        (0.4545373654408504, [0.10353382283958963, 0.9271693966411375, 0.40186574611212833]),
        (0.5908978906104151, [0.67671212219778, -0.657350353008899, -0.28489650040283765]),
        (0.7272584157799798, [-1.0036265399230222, 0.008849886045823088, 0.0038534354857964457]),
        (0.8636189409495318, [0.6259520615249582, 0.7275596162111791, 0.3152554339676672]),
        (0.9999794661190965, [0.15309095956916602, -0.891303012683093, -0.3861888436712115]),
    ];

    #[test]
    fn the_sun_of_150_years_agrees_with_the_standards_of_fundamental_astronomy() {
        for (centuries, position) in EXPECTED {
            let expected = DVec3::from_array(*position) * SUN_DISTANCE;
            let computed = sun_position(*centuries);
            let angle = computed.angle_between(expected).to_degrees();
            assert!(angle < 0.001, "{centuries}: {angle} deg");
            assert!((computed.length() / expected.length() - 1.0).abs() < 2e-5, "{centuries}");
            let an_hour_later = sun_position(centuries + 1.0 / 876_600.0);
            assert!(an_hour_later.angle_between(expected).to_degrees() > 0.02);
        }
    }
}
