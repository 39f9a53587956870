//! Tests of `series`, and what other tests take from them.

use super::*;

/// A series of parts and materials that heat and cool smoothly over an orbit.
pub(crate) fn orbit(parts: usize, materials: usize, probes: usize) -> TemperatureSeries {
    let names = |prefix: &str, count: usize| (0..count).map(|i| format!("{prefix}_{i}")).collect::<Vec<_>>();
    let mut series =
        TemperatureSeries::new(&names("B0_module", parts), &names("mat", materials), &names("probe", probes));
    for step in 0..=360 {
        let time = f64::from(step) * 15.5;
        let mean = |i: usize| {
            let swing = 15.0 + 9.0 * i as f64;
            260.0 + 3.0 * i as f64 + swing * (time / 5580.0 * std::f64::consts::TAU + 0.3 * i as f64).cos()
        };
        let summary = |i: usize| {
            let mean = mean(i);
            Some(Summary { min: mean as f32 - 12.0, mean, max: mean as f32 + 6.0 + i as f32 })
        };
        let row = SeriesRow {
            time,
            all: summary(0),
            parts: (0..parts).map(summary).collect(),
            materials: (0..materials).map(summary).collect(),
            probes: (0..probes).map(|i| mean(i) as f32).collect(),
        };
        series.push(row).unwrap();
    }
    series
}

pub(crate) fn text(series: &TemperatureSeries) -> String {
    let mut bytes = Vec::new();
    series.write(&mut bytes).unwrap();
    String::from_utf8(bytes).unwrap()
}

fn names(list: &[&str]) -> Vec<String> {
    list.iter().map(|&name| name.to_owned()).collect()
}

#[test]
fn the_file_has_the_columns_and_numbers_that_are_promised() {
    let mut series = TemperatureSeries::new(&names(&["hull, left"]), &names(&["a", "a"]), &names(&["tip"]));
    let summary = Some(Summary { min: 2.7, mean: 100.123_456_789, max: 200.5 });
    let row =
        SeriesRow { time: 16.5, all: summary, parts: vec![summary], materials: vec![summary, None], probes: vec![0.1] };
    series.push(row.clone()).unwrap();
    let expected = "time,\"part:hull, left:min\",\"part:hull, left:mean\",\"part:hull, left:max\",\
        material:a:min,material:a:mean,material:a:max,material:a#2:min,material:a#2:mean,material:a#2:max,\
        all:min,all:mean,all:max,probe:tip\n\
        16.5,2.7,100.123457,200.5,2.7,100.123457,200.5,,,,2.7,100.123457,200.5,0.1\n";
    assert_eq!(text(&series), expected);

    let wrong = SeriesRow { probes: vec![], ..row };
    let error = series.push(wrong).unwrap_err();
    assert_eq!(error.to_string(), "series row at 16.5 s has 0 probe values for 1 probe columns");
}

#[test]
fn names_become_unique_without_stealing_another_name() {
    let made = unique(&names(&["a", "a#2", "a", "a", "b"]));
    assert_eq!(made, ["a", "a#2", "a#3", "a#4", "b"]);
}

#[test]
fn a_series_without_rows_or_groups_is_a_header() {
    assert_eq!(text(&TemperatureSeries::new(&[], &[], &[])), "time,all:min,all:mean,all:max\n");
}
