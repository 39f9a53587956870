//! UTC of an instant with correct leap seconds. hifitime looks them up by TAI, which is wrong just before each.

use hifitime::leap_seconds::LatestLeapSeconds;
use hifitime::{Duration, Epoch, Unit};

/// UTC clock since 1900, and whether it is in a leap second. The clock counts that second twice.
fn clock(tai: Duration) -> (Duration, bool) {
    let mut offset = 0.0;
    let mut leaping = false;
    for leap in LatestLeapSeconds::default().filter(|leap| leap.announced_by_iers) {
        // The table's time is the clock's midnight after the leap second.
        let midnight = Unit::Second * (leap.timestamp_tai_s + leap.delta_at);
        if tai >= midnight {
            (offset, leaping) = (leap.delta_at, false);
        } else {
            // The ten seconds of 1972 are not leap seconds.
            leaping = leap.delta_at - offset == 1.0 && tai >= midnight - Unit::Second * 1;
            break;
        }
    }
    let clock = tai - Unit::Second * offset;
    (if leaping { clock - Unit::Second * 1 } else { clock }, leaping)
}

/// UTC as ISO 8601, to the nearest millisecond. The second is 60 in a leap second.
pub(crate) fn utc(epoch: Epoch) -> String {
    let (clock, leaping) = clock(epoch.to_tai_duration().round(Unit::Millisecond * 1));
    let (year, month, day, hour, minute, second, nanoseconds) = Epoch::from_tai_duration(clock).to_gregorian_tai();
    let second = second + u8::from(leaping);
    let milliseconds = nanoseconds / 1_000_000;
    format!("{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}.{milliseconds:03}Z")
}

/// Days of UTC since J2000 (2000-01-01 12:00). A day with a leap second counts its last second twice.
pub(crate) fn utc_days(epoch: Epoch) -> f64 {
    /// Days from 1900-01-01 0h to 2000-01-01 12h.
    const J2000: f64 = 36_524.5;
    clock(epoch.to_tai_duration()).0.to_unit(Unit::Day) - J2000
}

/// Start of the leap second after `23:59:59` UTC. `None` where there is none.
pub(crate) fn leap_second_after(last: Epoch) -> Option<Epoch> {
    let next = Epoch::from_tai_duration(last.to_tai_duration() + Unit::Second * 1);
    clock(next.to_tai_duration()).1.then_some(next)
}

#[cfg(test)]
mod tests {
    use hifitime::TimeScale;

    use super::*;

    fn utc_epoch(text: [u32; 3], clock: [u8; 3]) -> Epoch {
        let [year, month, day] = text;
        let [hour, minute, second] = clock;
        Epoch::from_gregorian(year as i32, month as u8, day as u8, hour, minute, second, 0, TimeScale::UTC)
            .to_time_scale(TimeScale::TAI)
    }

    /// IERS Bulletin C 52: 2016 December 31, 23h 59m 60s; 2017 January 1, 0h 0m 0s.
    #[test]
    fn the_clock_shows_every_second_before_in_and_after_a_leap_second() {
        let start = utc_epoch([2016, 12, 31], [23, 59, 0]);
        for second in 0..=62 {
            let expected = match second {
                0..=60 => format!("2016-12-31T23:59:{second:02}.250Z"),
                _ => format!("2017-01-01T00:00:{:02}.250Z", second - 61),
            };
            assert_eq!(utc(start + Unit::Millisecond * (f64::from(second) * 1e3 + 250.0)), expected);
        }
        assert_eq!(utc(start + Unit::Millisecond * 60_999.6), "2017-01-01T00:00:00.000Z");
    }

    #[test]
    fn all_leap_seconds_are_found_and_no_others() {
        let ends = (1960..2030).flat_map(|year| [[year, 6, 30], [year, 12, 31], [year, 3, 31]]);
        let count = ends.filter(|day| leap_second_after(utc_epoch(*day, [23, 59, 59])).is_some()).count();
        // 10 s on 1972-01-01 and 37 s on 2017-01-01.
        assert_eq!(count, 27);
        assert!(leap_second_after(utc_epoch([2016, 12, 31], [23, 59, 58])).is_none());
        assert_eq!(utc(utc_epoch([1965, 5, 4], [3, 2, 1])), "1965-05-04T03:02:01.000Z");
    }

    #[test]
    fn days_run_on_up_to_the_leap_second() {
        let start = utc_epoch([2016, 12, 31], [23, 59, 0]);
        for second in [0.0, 10.0, 30.0, 59.5] {
            let days = utc_days(start + Unit::Second * second);
            let expected = 6209.5 - (60.0 - second) / 86_400.0;
            assert!((days - expected).abs() * 86_400.0 < 1e-5, "{second}: {days} {expected}");
        }
        assert!((utc_days(start + Unit::Second * 61.0) - 6209.5).abs() < 1e-10);
    }
}
