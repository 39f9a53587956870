//! Writes sensitivities: the table of all, the table of effects, the tornado plot and the images.

use super::search::{Sensitivities, Sensitivity};
use crate::output::OutputError;
use crate::output::exr::encode_with;
use crate::output::folder::Folder;
use crate::output::run_pictures::frame_stem;
use crate::output::tornado::{TornadoBar, tornado};
use crate::scene::ParameterRange;
use crate::text::{significant, time_of_step};

const TABLE: &str = "sensitivity.csv";
const EFFECTS: &str = "effects.csv";
const PLOT: &str = "tornado.svg";

/// All files of the command.
pub(crate) const FILES: [&str; 5] = [TABLE, EFFECTS, PLOT, "frames/step_#.exr", "frames/image_#.exr"];

const EFFECTS_HEAD: [&str; 11] =
    ["parameter", "value", "unit", "low", "high", "effect_k", "at_low_k", "at_high_k", "error_k", "place", "time"];

/// The largest effect of a parameter over its range: the place and the step, the effects at both ends, and the error of the larger one [K].
struct Effect<'a> {
    of: &'a Sensitivity,
    place: usize,
    step: usize,
    ends: [f64; 2],
    error: f64,
}

impl Effect<'_> {
    fn size(&self) -> f64 {
        (self.ends[1] - self.ends[0]).abs()
    }
}

/// Writes every file.
///
/// # Errors
/// A file that cannot be written.
pub(crate) fn write(folder: &Folder, all: &Sensitivities) -> Result<(), OutputError> {
    folder.write_csv(TABLE, std::iter::once(head()).chain(rows(all)))?;
    let effects = effects(all);
    folder.write_csv(EFFECTS, effect_rows(all, &effects))?;
    folder.write_bytes(PLOT, plot(all, &effects)?.as_bytes())?;
    for (number, (image, header)) in all.images.iter().enumerate() {
        let mut extra = Vec::new();
        for (place, sensitivity) in all.of.iter().enumerate() {
            let [derivative, error] = &sensitivity.images[number];
            let name = channel(place, &sensitivity.parameter.name);
            extra.push((format!("{name}_error"), error.clone()));
            extra.push((name, derivative.clone()));
        }
        let name = format!("frames/{}.exr", frame_stem(header.step, header.image));
        folder.write_bytes(&name, &encode_with(image, header, &extra)?)?;
    }
    Ok(())
}

/// Name of the channel of a parameter, with its number because names may differ in signs alone.
fn channel(place: usize, name: &str) -> String {
    let plain: String = name.chars().map(|sign| if sign.is_ascii_alphanumeric() { sign } else { '_' }).collect();
    format!("dT{}_{plain}", place + 1)
}

fn head() -> Vec<String> {
    let names = ["parameter", "kind", "name", "time", "temperature_k", "dt_dlnp_k", "dt_dp", "error_k"];
    names.map(str::to_owned).to_vec()
}

/// A row for each parameter, place and step. `dt_dlnp_k` is for a change by all of the value, and `error_k` its error.
fn rows(all: &Sensitivities) -> impl Iterator<Item = Vec<String>> {
    all.of.iter().flat_map(move |sensitivity| {
        let of_place = move |(place, (kind, name)): (usize, &(&'static str, String))| {
            let name = name.clone();
            let kind = (*kind).to_owned();
            (0..all.times.len()).filter_map(move |step| {
                let temperature = all.temperatures[step][place]?;
                let [derivative, error] = sensitivity.rows[step][place]?;
                let per_unit = sensitivity.value.map_or(String::new(), |value| format!("{:.9e}", derivative / value));
                Some(vec![
                    sensitivity.parameter.name.clone(),
                    kind.clone(),
                    name.clone(),
                    time_of_step(all.times[step]),
                    format!("{temperature:.6}"),
                    format!("{derivative:.6}"),
                    per_unit,
                    format!("{error:.6}"),
                ])
            })
        };
        all.places.iter().enumerate().flat_map(of_place)
    })
}

/// The largest effect of each parameter, the largest first.
fn effects(all: &Sensitivities) -> Vec<Effect<'_>> {
    let largest = |of: &'_ Sensitivity| -> (usize, usize, [f64; 2]) {
        let mut largest = (0, 0, [0.0f64; 2]);
        for (step, row) in of.rows.iter().enumerate() {
            for (place, derivative) in row.iter().enumerate() {
                if let Some(derivative) = derivative.filter(|one| one[0].abs() > largest.2[0].abs()) {
                    largest = (place, step, derivative);
                }
            }
        }
        largest
    };
    let mut effects: Vec<Effect<'_>> = Vec::new();
    for of in &all.of {
        let (place, step, [derivative, error]) = largest(of);
        let range = of.range();
        let ends = range.map(|share| share * derivative);
        effects.push(Effect { of, place, step, ends, error: error * range[0].abs().max(range[1].abs()) });
    }
    effects.sort_by(|a, b| b.size().total_cmp(&a.size()));
    effects
}

fn effect_rows(all: &Sensitivities, effects: &[Effect<'_>]) -> Vec<Vec<String>> {
    let number = |value: f64| format!("{value:.6}");
    let row = |effect: &Effect<'_>| {
        let Sensitivity { parameter, value, .. } = effect.of;
        let [low, high] = match (parameter.range, value) {
            (ParameterRange::Values(ends), _) => ends.map(|end| end.to_string()),
            (range, Some(value)) => range.shares(Some(*value)).map(|share| significant(value * (1.0 + share))),
            (ParameterRange::Percent(percent), None) => [-percent, percent].map(|percent| format!("{percent:+} %")),
        };
        let (kind, name) = &all.places[effect.place];
        vec![
            parameter.name.clone(),
            value.map_or(String::new(), |value| value.to_string()),
            parameter.kind.unit().to_owned(),
            low,
            high,
            number(effect.size()),
            number(effect.ends[0]),
            number(effect.ends[1]),
            number(effect.error),
            format!("{kind}:{name}"),
            time_of_step(all.times[effect.step]),
        ]
    };
    std::iter::once(EFFECTS_HEAD.map(str::to_owned).to_vec()).chain(effects.iter().map(row)).collect()
}

/// The table of effects that a terminal shows.
pub(crate) fn summary(all: &Sensitivities) -> Vec<Vec<String>> {
    effect_rows(all, &effects(all))
}

/// A bar for each parameter, from its effect at the low end of its range to its effect at the high end. The largest effect is on top.
fn plot(all: &Sensitivities, effects: &[Effect<'_>]) -> Result<String, OutputError> {
    let bar = |effect: &Effect<'_>| TornadoBar { name: effect.of.parameter.name.clone(), ends: effect.ends };
    tornado(
        &format!("What the ranges of parameters do: {}", all.scene),
        "largest change of a part or probe over the run at both ends of each range, by its derivative times the range; places and times are in effects.csv",
        "change of temperature [K]",
        &effects.iter().map(bar).collect::<Vec<_>>(),
    )
}
