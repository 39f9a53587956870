//! Parses times: ISO 8601 dates or days of the year, in a CCSDS time system.

use hifitime::{Epoch, TimeScale, Unit};

use super::choice::list;
use crate::environment::utc::leap_second_after;

const TIME_SYSTEMS: [(&str, TimeScale); 5] = [
    ("UTC", TimeScale::UTC),
    ("TAI", TimeScale::TAI),
    ("TT", TimeScale::TT),
    ("TDB", TimeScale::TDB),
    ("GPS", TimeScale::GPST),
];

/// The time system with this name, or a message that lists the known ones.
pub(super) fn time_system(name: &str) -> Result<TimeScale, String> {
    let system = TIME_SYSTEMS.iter().find(|(known, _)| known.eq_ignore_ascii_case(name));
    system.map(|(_, scale)| *scale).ok_or_else(|| {
        format!("the time system '{name}' is not one of {}", list(TIME_SYSTEMS.iter().map(|(name, _)| *name)))
    })
}

/// Parses `2023-10-29T17:03:44.412`, `2023-302T17:03:44.412Z`, or a date alone. The `Z` is optional. The epoch counts
/// in TAI, because durations can only be added in TAI.
pub(super) fn parse_epoch(text: &str, scale: TimeScale) -> Result<Epoch, String> {
    let wrong = || format!("'{text}' is no time: write 2023-10-29T17:03:44.412 or 2023-302T17:03:44.412");
    let bare = text.trim();
    let bare = bare.strip_suffix(['Z', 'z']).unwrap_or(bare);
    let (date, clock) = bare.split_once(['T', 't', ' ']).unwrap_or((bare, "00:00:00"));
    let digits = |part: &str| {
        if part.is_empty() || !part.bytes().all(|byte| byte.is_ascii_digit()) { None } else { part.parse::<u32>().ok() }
    };
    let parts: Vec<u32> = date.split('-').map(digits).collect::<Option<_>>().ok_or_else(wrong)?;
    let (year, month, day) = match parts[..] {
        [year, month, day] => (year, month, day),
        [year, day] => day_of_year(year, day).ok_or_else(wrong)?,
        _ => return Err(wrong()),
    };
    if !(1900..=2200).contains(&year) {
        return Err(format!("'{text}': the year is not within 1900 and 2200"));
    }
    let mut clock = clock.trim().split(':');
    let (hour, minute) = (clock.next().and_then(digits), clock.next().and_then(digits));
    let (second, fraction) = match clock.next() {
        None => (Some(0), Some(0)),
        Some(seconds) => match seconds.split_once('.') {
            None => (digits(seconds), Some(0)),
            Some((whole, fraction)) => (digits(whole), nanoseconds(fraction)),
        },
    };
    let (Some(hour), Some(minute), Some(second), Some(fraction), None) = (hour, minute, second, fraction, clock.next())
    else {
        return Err(wrong());
    };
    let none = || format!("'{text}' is no time of the calendar");
    if hour == 24 && (minute, second, fraction) != (0, 0, 0) {
        return Err(none());
    }
    let byte = |value: u32| u8::try_from(value).unwrap_or(u8::MAX);
    // hifitime maps a leap second to the second before it.
    let leaping = second == 60;
    let (second, whole) = if leaping { (59, 0) } else { (second, fraction) };
    let epoch = Epoch::maybe_from_gregorian(
        year as i32,
        byte(month),
        byte(day),
        byte(hour),
        byte(minute),
        byte(second),
        whole,
        scale,
    )
    .map_err(|_| none())?;
    if !leaping {
        return Ok(epoch.to_time_scale(TimeScale::TAI));
    }
    if scale != TimeScale::UTC {
        return Err(none());
    }
    let leap = leap_second_after(epoch).ok_or_else(|| format!("'{text}': there was no leap second then"))?;
    Ok(leap + Unit::Nanosecond * i64::from(fraction))
}

/// Digits after the point, in nanoseconds. Digits beyond the ninth are cut.
fn nanoseconds(fraction: &str) -> Option<u32> {
    if !fraction.bytes().all(|byte| byte.is_ascii_digit()) {
        return None;
    }
    let nine: String = fraction.chars().chain("000000000".chars()).take(9).collect();
    nine.parse().ok()
}

/// Year, month and day from a day of the year. The first day is 1.
fn day_of_year(year: u32, day: u32) -> Option<(u32, u32, u32)> {
    let leap = year.is_multiple_of(4) && (!year.is_multiple_of(100) || year.is_multiple_of(400));
    let lengths = [31, if leap { 29 } else { 28 }, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31];
    let mut rest = day;
    for (month, length) in (1..).zip(lengths) {
        if (1..=length).contains(&rest) {
            return Some((year, month, rest));
        }
        rest = rest.checked_sub(length)?;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tai(text: &str, scale: TimeScale) -> f64 {
        parse_epoch(text, scale).unwrap().to_tai_seconds()
    }

    #[test]
    fn days_of_the_year_and_calendar_dates_are_the_same_times() {
        for (ordinal, calendar) in [
            ("2025-057T12:04:00.000", "2025-02-26T12:04:00Z"),
            ("2024-366T00:00:00.5Z", "2024-12-31T00:00:00.500000"),
            ("2023-302T17:03", "2023-10-29T17:03:00.000"),
        ] {
            assert_eq!(tai(ordinal, TimeScale::UTC), tai(calendar, TimeScale::UTC), "{ordinal}");
        }
    }

    /// UTC has had 37 leap seconds since 2017. TT = TAI + 32.184 s, GPS = TAI - 19 s. TDB is within 2 ms of TT.
    #[test]
    fn the_time_systems_differ_by_what_they_should() {
        let of = |scale| tai("2020-06-01T00:00:00", scale);
        let base = of(TimeScale::TAI);
        assert!((of(TimeScale::UTC) - base - 37.0).abs() < 1e-6);
        assert!((of(TimeScale::TT) - base + 32.184).abs() < 1e-6);
        assert!((of(TimeScale::GPST) - base - 19.0).abs() < 1e-6);
        assert!((of(TimeScale::TDB) - of(TimeScale::TT)).abs() < 2e-3);
        // A leap second at the end of 2016.
        assert!((tai("2017-01-01", TimeScale::UTC) - tai("2016-12-31T23:59:59", TimeScale::UTC) - 2.0).abs() < 1e-6);
    }

    /// IERS Bulletin C 52: 23h 59m 60s on 2016 December 31.
    #[test]
    fn leap_seconds_are_seconds_of_their_own() {
        let midnight = tai("2017-01-01", TimeScale::UTC);
        for (text, before) in [
            ("2016-12-31T23:59:60", 1.0),
            ("2016-366T23:59:60.25Z", 0.75),
            ("2016-12-31T23:59:59", 2.0),
            ("2016-12-31T24:00:00", 0.0),
        ] {
            assert!((midnight - tai(text, TimeScale::UTC) - before).abs() < 1e-6, "{text}");
        }
        for bad in [
            "2016-12-31T23:58:60",
            "2016-12-31T22:59:60",
            "2016-06-30T23:59:60",
            "2015-12-31T23:59:60",
            "2016-12-31T23:59:61",
            "2016-12-31T24:00:01",
            "2016-12-31T24:00:00.5",
        ] {
            assert!(parse_epoch(bad, TimeScale::UTC).is_err(), "{bad}");
        }
        for scale in [TimeScale::TAI, TimeScale::GPST, TimeScale::TT] {
            assert!(parse_epoch("2016-12-31T23:59:60", scale).is_err(), "{scale}");
        }
    }

    #[test]
    fn what_is_no_time_is_refused() {
        for bad in [
            "2023-13-01T00:00:00",
            "2023-02-30T00:00:00",
            "2023-366T00:00:00",
            "2023-302T25:00:00",
            "2023-302T00:00:00.1x",
            "yesterday",
            "",
            "2023-1-1-1",
            "12-01-01",
            "2023-302T00:00:00:00",
        ] {
            assert!(parse_epoch(bad, TimeScale::UTC).is_err(), "{bad}");
        }
        assert!(time_system("utc").is_ok());
        assert!(time_system("UT1").unwrap_err().contains("'GPS'"));
    }
}
