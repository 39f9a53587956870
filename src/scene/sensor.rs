//! `[sensor]`: optics, bolometer and digital numbers of the camera.

use std::path::PathBuf;

use super::Camera;
use super::error::SceneError;
use super::preset::Preset;
use super::quantity::Quantity;
use super::section::Section;
use super::sensor_tables::{kernel, map};
use crate::environment::orbit::{SUN_DISTANCE, SUN_RADIUS};
use crate::thermal::brightness::{BrightnessTable, brightness_temperature};
use crate::thermal::passband::Passband;
use crate::thermal::radiance::{RadianceTable, band_radiance};
use crate::thermal::sensor::gain_control::GainControl;
use crate::thermal::sensor::halo::Halo;
use crate::thermal::sensor::reading::radiance_slope;
use crate::thermal::sensor::spread::{MOST_RADIUS, Spread};
use crate::thermal::sensor::{Detector, MOST_PIXELS, Netd, Pattern, Sensor, SensorOptics, Vignetting};
use crate::thermal::surroundings::SUN_TEMPERATURE;

/// Default temperature of the scene that a NETD is stated for, of the shutter, and of the gains' reference [K].
const USUAL: f64 = 300.0;

/// Least share of its radiance in that of sunlight on a white surface with which a body counts in a band.
const LEAST_SHINE: f64 = 1e-4;

/// Values of other sections that `[sensor]` needs.
pub(super) struct SensorContext<'a> {
    pub(crate) camera: &'a Camera,
    pub(crate) preset: Option<&'static Preset>,
    /// Distance between pixels [m], where it is known.
    pub(crate) pitch: Option<f64>,
    pub(crate) passband: Passband,
}

#[derive(Clone, Copy)]
enum PointSpread {
    Gaussian,
    Airy,
    File,
}

/// Keys that belong to one choice of another key.
const OWNED: [(&str, &str, &str); 5] = [
    ("sigma", "point_spread", "gaussian"),
    ("wavelength_um", "point_spread", "airy"),
    ("kernel", "point_spread", "file"),
    ("percentiles", "gain_control", "linear"),
    ("plateau", "gain_control", "plateau"),
];

pub(super) fn read(
    section: &Section,
    context: &SensorContext,
    files: &mut Vec<PathBuf>,
    assumptions: &mut Vec<String>,
) -> Result<Sensor, SceneError> {
    let camera = context.camera;
    let pixels = u64::from(camera.width).next_multiple_of(4) * u64::from(camera.height);
    if pixels > MOST_PIXELS {
        let message = format!(
            "takes images of at most {MOST_PIXELS} pixels, and the camera has {} x {}",
            camera.width, camera.height
        );
        return Err(section.clash("bits", &["camera.width", "camera.height", "camera.preset"], message));
    }
    for (key, owner, choice) in OWNED {
        let stated = section.string(owner)?;
        if section.has(key) && stated != Some(choice) && !(owner == "gain_control" && stated.is_none()) {
            return Err(section.clash(key, &[owner], format!("belongs to {owner} = '{choice}'")));
        }
    }
    let seed = section.whole("seed", 0..=u32::MAX)?.unwrap_or_else(|| {
        assumptions.push("The seed of the sensor's noise is 0 (sensor.seed is absent).".to_owned());
        0
    });
    let f_number = section.number("f_number", Quantity::within(0.1, 100.0, ""))?;
    let table = RadianceTable::new(context.passband.clone());
    let of_radiances = radiance_range(section, &table)?;
    let range = of_radiances
        .or(section.numbers::<2>("range", Quantity::within(10.0, 6000.0, "K"))?)
        .or(context.preset.and_then(|preset| preset.range));
    let range = checked_range(section, range, &table)?;
    let noise = match radiance_noise(section, &table, range[1], f_number)? {
        Some(noise) => noise,
        None => noise(section, context, &table, f_number, assumptions)?,
    };
    let bits = match section.whole("bits", 8..=16)?.or(context.preset.and_then(|preset| preset.bits)) {
        Some(bits @ (8 | 14 | 16)) => bits,
        Some(bits) => return Err(section.error("bits", format!("must be 8, 14 or 16, found {bits}"))),
        None => {
            assumptions.push("Digital numbers have 14 bits (sensor.bits is absent).".to_owned());
            14
        }
    };
    let time_constant = time_constant(section, context, assumptions)?;
    let pattern = pattern(section)?;
    Ok(Sensor {
        seed,
        detector: detector(section, pattern.is_some(), assumptions)?,
        halo: halo(section)?,
        optics: optics(section)?,
        time_constant,
        pattern,
        noise: Some(noise).filter(|noise| noise.kelvin > 0.0),
        bits,
        range,
        kelvin_per_count: kelvin_per_count(section)?,
        gain_control: gain_control(section)?,
        vignetting: vignetting(section, camera, files)?,
        spread: spread(section, context, f_number, files)?,
    })
}

fn checked_range(section: &Section, range: Option<[f64; 2]>, table: &RadianceTable) -> Result<[f64; 2], SceneError> {
    let range = range.ok_or_else(|| {
        let what = "[low, high]: brightness temperatures at digital number 0 and at the largest one [K]";
        section.missing("range", &["camera.preset"], what)
    })?;
    if range[0] >= range[1] {
        return Err(section.error("range", format!("must run from low to high, found {} to {} K", range[0], range[1])));
    }
    if band_radiance(table, range[0]) < f64::from(f32::MIN_POSITIVE) {
        return Err(section.clash(
            "range",
            &["radiance.band_um", "band.*", "camera.preset"],
            format!("begins at {} K, where the band's radiance is 0 in 32 bits", range[0]),
        ));
    }
    Ok(range)
}

/// The noise of a sensor that states it as a radiance. It becomes a NETD at the upper end of the range.
fn radiance_noise(
    section: &Section,
    table: &RadianceTable,
    temperature: f64,
    f_number: Option<f64>,
) -> Result<Option<Netd>, SceneError> {
    let Some(noise) = section.number("radiance_noise", Quantity::within(0.0, 1e9, "W/(m2 sr)"))? else {
        return Ok(None);
    };
    for key in ["netd", "netd_temperature", "netd_f_number"] {
        section.exclusive("radiance_noise", key)?;
    }
    let f_number = f_number.unwrap_or(1.0);
    let kelvin = noise / radiance_slope(table, temperature);
    Ok(Some(Netd { kelvin, temperature, stated_f_number: f_number, f_number }))
}

/// The range of a sensor that states radiances, as brightness temperatures [K].
fn radiance_range(section: &Section, table: &RadianceTable) -> Result<Option<[f64; 2]>, SceneError> {
    section.exclusive("radiance_range", "range")?;
    let Some(range) = section.numbers::<2>("radiance_range", Quantity::within(0.0, 1e9, "W/(m2 sr)"))? else {
        return Ok(None);
    };
    let guesses = BrightnessTable::new(table);
    let [low, high] = range;
    if low >= high || high >= guesses.max_radiance {
        let most = guesses.max_radiance;
        let message = format!("must run from low to high, below {most:.4e}, found {low} to {high} W m-2 sr-1");
        return Err(section.error("radiance_range", message));
    }
    // A radiance of 0 has no brightness temperature. The next one that 32 bits hold stands for it.
    let least = 1.000_01 * guesses.min_radiance;
    let kelvin = |radiance: f64| {
        brightness_temperature(table, &guesses, radiance.max(least))
            .map_err(|error| section.error("radiance_range", error.to_string()))
    };
    Ok(Some([kelvin(low)?, kelvin(high)?]))
}

/// Time constant of the bolometer [s], if it lags.
fn time_constant(
    section: &Section,
    context: &SensorContext,
    assumptions: &mut Vec<String>,
) -> Result<Option<f64>, SceneError> {
    let stated = section.number("time_constant", Quantity::non_negative("s"))?;
    let constant = stated.or(context.preset.and_then(|preset| preset.time_constant));
    if constant.is_none() {
        assumptions.push("The bolometer has settled in every image (sensor.time_constant is absent).".to_owned());
    }
    Ok(constant.filter(|constant| *constant > 0.0))
}

fn detector(section: &Section, has_pattern: bool, assumptions: &mut Vec<String>) -> Result<Detector, SceneError> {
    let serial = section.whole("serial", 0..=u32::MAX)?;
    let bad_pixels = section.number("bad_pixels", Quantity::within(0.0, 1.0, ""))?.unwrap_or(0.0);
    if serial.is_none() && (bad_pixels > 0.0 || has_pattern) {
        assumptions.push(
            "The camera has the serial number 0, from which its pattern follows (sensor.serial is absent).".to_owned(),
        );
    }
    Ok(Detector { serial: serial.unwrap_or(0), bad_pixels })
}

fn noise(
    section: &Section,
    context: &SensorContext,
    table: &RadianceTable,
    f_number: Option<f64>,
    assumptions: &mut Vec<String>,
) -> Result<Netd, SceneError> {
    let of_preset = context.preset.and_then(|preset| preset.netd);
    let Some(kelvin) = section.number("netd", Quantity::non_negative("K"))?.or(of_preset) else {
        let unknown = context.preset.map_or(String::new(), |preset| format!("; that of {} is unknown", preset.name));
        let what = format!("the noise-equivalent temperature difference [K], 0 for no noise{unknown}");
        return Err(section.missing("netd", &["camera.preset"], &what));
    };
    let temperature = section.number("netd_temperature", Quantity::within(10.0, 6000.0, "K"))?.unwrap_or_else(|| {
        if kelvin > 0.0 {
            assumptions.push("The NETD is that at 300 K (sensor.netd_temperature is absent).".to_owned());
        }
        USUAL
    });
    if kelvin > 0.0 {
        bodies_shine(section, table, temperature)?;
    }
    let stated = section.number("netd_f_number", Quantity::within(0.1, 100.0, ""))?;
    let stated = stated.or(context.preset.filter(|_| !section.has("netd")).and_then(|preset| preset.netd_f_number));
    if stated.is_some() && f_number.is_none() && kelvin > 0.0 {
        assumptions.push("The lens has the f-number of the NETD (sensor.f_number is absent).".to_owned());
    }
    if stated.is_none() && f_number.is_some() && kelvin > 0.0 {
        assumptions.push("The NETD is that with the camera's own lens (sensor.netd_f_number is absent).".to_owned());
    }
    let stated_f_number = stated.or(f_number).unwrap_or(1.0);
    Ok(Netd { kelvin, temperature, stated_f_number, f_number: f_number.unwrap_or(stated_f_number) })
}

/// Refuses a NETD at a temperature at which a body does not shine in the band: no change of a temperature makes the noise that it means.
fn bodies_shine(section: &Section, table: &RadianceTable, temperature: f64) -> Result<(), SceneError> {
    let sunlight = band_radiance(table, SUN_TEMPERATURE) * (SUN_RADIUS / SUN_DISTANCE).powi(2);
    let share = band_radiance(table, temperature) / sunlight;
    if share >= LEAST_SHINE {
        return Ok(());
    }
    let message = format!(
        "is noise as a temperature difference at {temperature} K, where a body sends {share:.0e} of what a white surface in \
         the Sun sends in this band: state radiance_noise [W/(m2 sr)] instead, or netd_temperature, at which bodies shine"
    );
    let others = ["netd_temperature", "radiance_noise", "radiance.band_um", "band.*", "camera.preset"];
    Err(section.clash("netd", &others, message))
}

fn spread(
    section: &Section,
    context: &SensorContext,
    f_number: Option<f64>,
    files: &mut Vec<PathBuf>,
) -> Result<Option<Spread>, SceneError> {
    let choices = [("gaussian", PointSpread::Gaussian), ("airy", PointSpread::Airy), ("file", PointSpread::File)];
    let fill = section.number("pixel_fill", Quantity::within(0.0, 1.0, ""))?;
    let Some(kind) = section.choice("point_spread", &choices)? else {
        return match fill {
            Some(_) => Err(section.clash("pixel_fill", &["point_spread"], "needs point_spread, which is missing")),
            None => Ok(None),
        };
    };
    let fill = fill.unwrap_or(1.0);
    let spread = match kind {
        PointSpread::Gaussian => {
            let most = MOST_RADIUS as f64 / 4.0;
            let sigma = section.number("sigma", Quantity::within(0.05, most - 0.25, "pixels"))?;
            let sigma = section.required("sigma", sigma, "the standard deviation of the Gaussian [px]")?;
            Spread::gaussian(sigma, fill)
        }
        PointSpread::Airy => {
            let f_number =
                section.required("f_number", f_number, "point_spread = 'airy' needs the f-number of the lens")?;
            let wavelength = section.number("wavelength_um", Quantity::within(1.0, 50.0, "um"))?;
            let wavelength =
                section.required("wavelength_um", wavelength, "point_spread = 'airy' needs a wavelength [um]")?;
            let Some(pitch) = context.pitch else {
                return Err(section.clash(
                    "point_spread",
                    &["camera.*"],
                    "'airy' needs camera.pixel_pitch, with camera.focal_length",
                ));
            };
            let scale = wavelength * 1e-6 * f_number / pitch;
            if !(0.05..=4.0).contains(&scale) {
                let message = format!("wavelength x f-number is {scale:.3} pixels, and isotherm draws from 0.05 to 4");
                return Err(section.clash("wavelength_um", &["f_number", "camera.*"], message));
            }
            Spread::airy(scale, fill)
        }
        PointSpread::File => {
            if section.has("pixel_fill") {
                return Err(section.clash("pixel_fill", &["point_spread"], "a measured kernel has the pixel in it"));
            }
            let path = section.required(
                "kernel",
                section.path("kernel")?,
                "a CSV file with the weights of the point spread",
            )?;
            let spread = kernel(&path).map_err(|message| section.error("kernel", message))?;
            files.push(path);
            spread
        }
    };
    if !spread.fits() {
        let message = format!(
            "needs {} separable terms with a radius of {} pixels, and devices have no room for so many",
            spread.terms.len(),
            spread.radius
        );
        let others = ["sigma", "wavelength_um", "f_number", "kernel", "pixel_fill", "camera.*"];
        return Err(section.clash("point_spread", &others, message));
    }
    Ok(Some(spread))
}

fn halo(section: &Section) -> Result<Option<Halo>, SceneError> {
    let share = section.number("stray_share", Quantity::within(0.0, 1.0, ""))?;
    let radius = section.number("stray_radius", Quantity::within(4.0, 4096.0, "pixels"))?;
    match (share, radius) {
        (None, None) => Ok(None),
        (Some(share), Some(radius)) => Ok(Some(Halo { share, radius }).filter(|halo| halo.share > 0.0)),
        (Some(_), None) => Err(section.missing(
            "stray_radius",
            &["stray_share"],
            "how far stray light goes, a standard deviation [px]",
        )),
        (None, Some(_)) => {
            Err(section.missing("stray_share", &["stray_radius"], "the share of all light that is stray"))
        }
    }
}

fn vignetting(section: &Section, camera: &Camera, files: &mut Vec<PathBuf>) -> Result<Option<Vignetting>, SceneError> {
    let stated = section.choice("vignetting", &[("cos4", Vignetting::Cos4)].map(|(word, _)| (word, ())))?;
    section.exclusive("vignetting", "vignetting_map")?;
    let Some(path) = section.path("vignetting_map")? else { return Ok(stated.map(|()| Vignetting::Cos4)) };
    let size = [camera.width as usize, camera.height as usize];
    let shares = map(&path, size).map_err(|message| {
        section.clash("vignetting_map", &["camera.width", "camera.height", "camera.preset"], message)
    })?;
    files.push(path);
    Ok(Some(Vignetting::Map(shares)))
}

fn optics(section: &Section) -> Result<SensorOptics, SceneError> {
    let transmission = section.number("transmission", Quantity::within(0.01, 1.0, ""))?;
    let lens = section.number("lens_temperature", Quantity::within(10.0, 6000.0, "K"))?;
    let housing = section.number("housing_temperature", Quantity::within(10.0, 6000.0, "K"))?;
    if lens.is_some() && transmission.is_none() {
        return Err(section.missing(
            "transmission",
            &["lens_temperature"],
            "the share of the light that a lens with lens_temperature passes",
        ));
    }
    if housing.is_some() && !section.has("vignetting") && !section.has("vignetting_map") {
        return Err(section.clash(
            "housing_temperature",
            &["vignetting", "vignetting_map"],
            "needs vignetting or vignetting_map: the housing is seen where the image is vignetted",
        ));
    }
    Ok(SensorOptics { transmission: transmission.unwrap_or(1.0), lens, housing })
}

fn pattern(section: &Section) -> Result<Option<Pattern>, SceneError> {
    let offset = section.number("offset_pattern", Quantity::non_negative("K"))?.unwrap_or(0.0);
    let gain = section.number("gain_pattern", Quantity::within(0.0, 1.0, ""))?.unwrap_or(0.0);
    let drift = section.number("drift", Quantity::within(0.0, 1e3, "K/s"))?.unwrap_or(0.0);
    let interval = section.number("shutter_interval", Quantity::positive("s"))?;
    let shutter = section.number("shutter_temperature", Quantity::within(10.0, 6000.0, "K"))?;
    if interval.is_some_and(|interval| interval < 1e-3) {
        return Err(section.error("shutter_interval", "must be at least 0.001 [s]"));
    }
    let present = offset > 0.0 || gain > 0.0 || drift > 0.0;
    if !present && (interval.is_some() || shutter.is_some()) {
        let key = if interval.is_some() { "shutter_interval" } else { "shutter_temperature" };
        return Err(section.clash(
            key,
            &["offset_pattern", "gain_pattern", "drift"],
            "corrects nothing: state offset_pattern, gain_pattern or drift",
        ));
    }
    Ok(present.then_some(Pattern { offset, gain, drift, interval, shutter: shutter.unwrap_or(USUAL) }))
}

fn kelvin_per_count(section: &Section) -> Result<Option<f64>, SceneError> {
    match section.number("kelvin_per_count", Quantity::any("K"))? {
        None => Ok(None),
        Some(kelvin) if kelvin == 0.01 || kelvin == 0.1 => Ok(Some(kelvin)),
        Some(kelvin) => Err(section.error("kelvin_per_count", format!("must be 0.01 or 0.1 [K], found {kelvin}"))),
    }
}

fn gain_control(section: &Section) -> Result<GainControl, SceneError> {
    let percentiles = section.numbers::<2>("percentiles", Quantity::within(0.0, 100.0, "%"))?;
    if let Some([low, high]) = percentiles.filter(|[low, high]| low >= high) {
        return Err(section.error("percentiles", format!("must run from low to high, found {low} to {high} %")));
    }
    let plateau = section.number("plateau", Quantity::within(0.0, 1.0, ""))?;
    section.exclusive("percentiles", "plateau")?;
    let is_linear = section.choice("gain_control", &[("linear", true), ("plateau", false)])?;
    Ok(match (is_linear.unwrap_or(percentiles.is_some()), plateau) {
        (true, _) => GainControl::Linear { percentiles: percentiles.unwrap_or([0.5, 99.5]) },
        (false, Some(share)) => GainControl::Plateau { share },
        (false, None) => GainControl::default(),
    })
}
