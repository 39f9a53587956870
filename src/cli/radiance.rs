//! `isotherm radiance`: band radiance of a blackbody and its inverse.

use super::device::{DeviceArguments, check_validation};
use super::digits::nine_digits;
use super::error::CliError;
use crate::gpu::blackbody::{band_radiances, brightness_temperatures};
use crate::output::console::answer;
use crate::output::console::say;
use crate::output::finite::finite;
use crate::simulation::target::Target;
use crate::thermal::brightness::{BrightnessTable, MAX_TEMPERATURE, brightness_temperature};
use crate::thermal::planck::Band;
use crate::thermal::radiance::{RadianceTable, band_radiance};

/// Print the band radiance of a blackbody [W m-2 sr-1] as CSV, or with --inverse its temperature [K].
///
/// The device computes in f32. The CSV has 9 significant digits.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  isotherm radiance --band 8:14 300 267 180\n  isotherm radiance --band 3:5 --inverse 1.5"
)]
pub(crate) struct Arguments {
    /// Band [um], within 1 to 50
    #[arg(long, value_name = "LOWER:UPPER", default_value = "8:14", value_parser = parse_band)]
    band: Band,
    /// Read radiances [W m-2 sr-1] and print brightness temperatures
    #[arg(long)]
    inverse: bool,
    /// Temperatures [K], or radiances
    #[arg(required = true, value_name = "NUMBER", allow_negative_numbers = true)]
    numbers: Vec<f64>,
    #[command(flatten)]
    device: DeviceArguments,
}

fn parse_band(text: &str) -> Result<Band, String> {
    let (lower, upper) = text.split_once(':').ok_or("a band is LOWER:UPPER in micrometres, such as 8:14")?;
    let number = |text: &str| text.trim().parse::<f64>().map_err(|_| format!("'{text}' is not a number"));
    let (lower, upper) = (number(lower)?, number(upper)?);
    if !(lower >= 1.0 && lower < upper && upper <= 50.0) {
        return Err("a band must be within 1 to 50 micrometres, with the lower end first".to_owned());
    }
    Ok(Band { lower: lower * 1e-6, upper: upper * 1e-6 })
}

pub(super) fn run(arguments: &Arguments) -> Result<(), CliError> {
    let table = RadianceTable::new(arguments.band);
    let guesses = BrightnessTable::new(&table);
    for number in &arguments.numbers {
        if arguments.inverse {
            guesses.check(*number)?;
        } else if !(0.0..=MAX_TEMPERATURE).contains(number) {
            let message = format!("a temperature must be finite and within 0 and {MAX_TEMPERATURE} K, not {number}");
            return Err(CliError::Usage(message));
        }
    }
    let chosen = arguments.device.open()?;
    say!("device: {}", chosen.name());
    let rounded: Vec<f32> = arguments.numbers.iter().map(|number| *number as f32).collect();
    let results: Vec<f64> = match &chosen {
        Target::Reference => arguments
            .numbers
            .iter()
            .map(|number| {
                if arguments.inverse {
                    brightness_temperature(&table, &guesses, *number)
                } else {
                    Ok(band_radiance(&table, *number))
                }
            })
            .collect::<Result<_, _>>()?,
        Target::Device(context) => {
            let results = if arguments.inverse {
                brightness_temperatures(context, &table, &guesses, &rounded)?
            } else {
                band_radiances(context, &table, &guesses, &rounded)?
            };
            results.into_iter().map(f64::from).collect()
        }
    };
    answer!("{}", if arguments.inverse { "radiance,temperature" } else { "temperature,radiance" });
    for (number, result) in arguments.numbers.iter().zip(results) {
        let result = finite(result, || format!("the result for {number}"))?;
        answer!("{number},{}", nine_digits(result));
    }
    check_validation(&chosen)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bands_are_checked() {
        assert!(parse_band("8:14").is_ok());
        for bad in ["14:8", "0.5:2", "8", "8:60", "a:b", "8:8", "nan:9"] {
            assert!(parse_band(bad).is_err(), "{bad}");
        }
    }
}
