//! `camera.preset`: cameras whose figures are public, each figure with its source. A figure that no source states is `None`, never a
//! guess.

use super::error::SceneError;
use super::section::Section;

/// A camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Preset {
    /// Word in a scene file.
    pub key: &'static str,
    /// Name.
    pub name: &'static str,
    /// Width and height [px].
    pub size: [u32; 2],
    /// Horizontal field of view [deg]. `None` where the field depends on the lens.
    pub(crate) fov_deg: Option<f64>,
    /// Distance between pixels [m].
    pub(crate) pitch: Option<f64>,
    /// Shortest and longest wavelength [um].
    pub band_um: Option<[f64; 2]>,
    /// NETD [K].
    pub netd: Option<f64>,
    pub(crate) netd_f_number: Option<f64>,
    /// Thermal time constant [s].
    pub time_constant: Option<f64>,
    pub(crate) bits: Option<u32>,
    /// Range of temperatures [K].
    pub(crate) range: Option<[f64; 2]>,
    pub(crate) source: &'static str,
    /// Where its figures hold, and where sources differ. Empty where no source says.
    pub(crate) holds: &'static str,
}

const UNKNOWN: Preset = Preset {
    key: "",
    name: "",
    size: [0, 0],
    fov_deg: None,
    pitch: None,
    band_um: None,
    netd: None,
    netd_f_number: None,
    time_constant: None,
    bits: None,
    range: None,
    source: "",
    holds: "",
};

/// All cameras. `REFERENCES.md`, section 7, has the figures; the figures of Boson+ and Tau 2 stand in their data sheets.
pub const PRESETS: [Preset; 6] = [
    Preset {
        key: "tiri",
        name: "Hera TIRI",
        size: [1024, 768],
        fov_deg: Some(13.3),
        band_um: Some([8.0, 14.0]),
        range: Some([150.0, 450.0]),
        source: "size, field of view, band, calibrated range: JpGU 2022 PPS03-P08; NETD, time constant, bits: unknown",
        holds: "the range is the one in which it is to be calibrated",
        ..UNKNOWN
    },
    Preset {
        key: "hayabusa2_tir",
        name: "Hayabusa2 TIR",
        size: [328, 248],
        fov_deg: Some(16.7),
        band_um: Some([8.0, 12.0]),
        // The sources state at most 0.4 K.
        netd: Some(0.4),
        range: Some([150.0, 460.0]),
        source: "size, field of view, band, NETD (at most 0.4 K), range: DARTS archive and Space Sci. Rev. 208:255; time constant, bits, \
                 f-number of the NETD: unknown",
        holds: "the NETD is that of scenes of 230 to 420 K; JpGU 2018 states 16 x 12 deg and 0.88 mrad a pixel, and the kernel hyb2_tir_v04.ti (2024) revises the optics",
        ..UNKNOWN
    },
    Preset {
        key: "boson_640",
        name: "FLIR Boson 640",
        size: [640, 512],
        pitch: Some(12e-6),
        // The data sheet states less than 40 mK at f/1.0, and 8 to 12 ms.
        netd: Some(0.040),
        netd_f_number: Some(1.0),
        time_constant: Some(0.010),
        bits: Some(14),
        source: "size, pitch, NETD (below 40 mK at f/1.0), time constant (8 to 12 ms), bits: data sheet 102-2013-40; field of view: of the lens; \
                 band, range: unknown",
        holds: "the NETD is that of the best grade",
        ..UNKNOWN
    },
    Preset {
        key: "boson_640_plus",
        name: "FLIR Boson+ 640",
        size: [640, 512],
        pitch: Some(12e-6),
        bits: Some(14),
        source: "size, pitch, bits: as FLIR Boson 640, data sheet 102-2013-40; field of view: of the lens; NETD, time constant, band, range: unknown",
        ..UNKNOWN
    },
    Preset {
        key: "tau_2",
        name: "FLIR Tau 2 640",
        size: [640, 512],
        band_um: Some([7.5, 13.5]),
        // Less than 50 mK at f/1.0 and 300 K, which FLIR states for the Tau 320.
        netd: Some(0.050),
        netd_f_number: Some(1.0),
        bits: Some(14),
        source: "size, bits: product specification 102-PS242-40; NETD (below 50 mK at f/1.0 near 300 K, stated for Tau 320), band: flir.com, \
                 'What is the sensitivity of Tau cameras'; field of view: of the lens; pitch, time constant, range of the gain in use: unknown",
        holds: "it sees -25 to 135 deg C (248 to 408 K) in one gain, and -40 to 550 deg C (233 to 823 K) in the other; the NETD is that of scenes near 300 K",
        ..UNKNOWN
    },
    Preset {
        key: "raven_ircam",
        name: "Raven IRCam",
        size: [640, 480],
        band_um: Some([8.0, 14.0]),
        source: "size, band: NASA (STS-128 and 131); field of view, NETD, time constant, bits, range: unknown",
        ..UNKNOWN
    },
];

/// The figures of a camera in words: their sources, and where they hold.
pub(super) fn told(one: &Preset) -> String {
    let holds = if one.holds.is_empty() { String::new() } else { format!(" Where they hold: {}.", one.holds) };
    format!("Figures of {} (camera.preset): {}.{holds}", one.name, one.source)
}

/// Filters of a camera, each a band.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct BandPreset {
    /// Word in a scene file, and start of the names of the bands.
    pub(super) key: &'static str,
    pub(super) name: &'static str,
    /// Middle of each filter [um].
    pub(super) centres_um: &'static [f64],
}

/// The filters of all cameras. JpGU 2022 PPS03-P08 states the middles of TIRI's filters and not their widths.
pub(super) const BAND_PRESETS: [BandPreset; 1] =
    [BandPreset { key: "tiri", name: "Hera TIRI", centres_um: &[7.8, 8.6, 9.6, 10.6, 11.6, 13.1] }];

pub(super) fn read(camera: &Section) -> Result<Option<&'static Preset>, SceneError> {
    let choices: Vec<(&str, &'static Preset)> = PRESETS.iter().map(|preset| (preset.key, preset)).collect();
    camera.choice("preset", &choices)
}

#[cfg(test)]
mod tests {
    use super::PRESETS;

    #[test]
    fn every_preset_says_where_it_is_from_and_what_is_unknown() {
        for preset in PRESETS {
            assert!(
                preset.netd.is_none() || !preset.holds.is_empty(),
                "{}: for which scenes is its NETD?",
                preset.name
            );
            let (_, unknown) = preset.source.rsplit_once(';').expect("a list of what is unknown");
            assert!(unknown.ends_with(": unknown"), "{}", preset.name);
            for (word, is_unknown) in [
                ("NETD,", preset.netd.is_none()),
                ("time constant", preset.time_constant.is_none()),
                ("range", preset.range.is_none()),
                ("bits", preset.bits.is_none()),
            ] {
                assert_eq!(unknown.contains(word), is_unknown, "{}: {word}", preset.name);
            }
        }
    }
}
