//! Emissivities of the materials in a band of sunlight, where they state none.

use crate::model::Model;
use crate::scene::SceneBand;
use crate::thermal::emissivity::{BandEmissivity, ByWavelength};
use crate::thermal::material::Material;

/// A band that ends here or before is one of sunlight: surfaces reflect in it as `absorptivity` says [m].
const SOLAR: f64 = 3e-6;
/// A band that ends here or before, as silicon does, shows colours [m].
const COLOURED: f64 = 1.1e-6;
/// Wavelengths of blue, green and red [m].
const COLOURS: [f64; 3] = [0.45e-6, 0.55e-6, 0.65e-6];
/// Ends of the laws of this file [m].
const ENDS: [f64; 2] = [0.2e-6, 3e-6];

/// A law without angles that is linear between wavelengths [m].
fn law(points: Vec<[f64; 2]>) -> BandEmissivity {
    BandEmissivity { by_angle: None, by_wavelength: Some(ByWavelength { points, temperature: None }) }
}

/// Front and back of each material in a band, and in words where they come from: a law of the material that reaches into the band, then the colour that
/// the model states, then `absorptivity`. Bands beyond sunlight have the emissivities of the materials.
pub(super) fn laws_in_band(
    band: &SceneBand,
    model: &Model,
    materials: &[Material],
) -> (Vec<[BandEmissivity; 2]>, Option<String>) {
    let ends = band.passband.band;
    let is_solar = ends.upper <= SOLAR;
    let reaches = |law: &ByWavelength| {
        let [first, last] = [law.points[0][0], law.points[law.points.len() - 1][0]];
        first < ends.upper && last > ends.lower
    };
    let (mut coloured, mut plain) = (Vec::new(), Vec::new());
    let mut of = |(number, material): (usize, &Material)| {
        let colour = model.materials.get(number).and_then(|one| one.colour).filter(|_| ends.upper <= COLOURED);
        [0, 1].map(|face| {
            let stated = &material.in_band[face];
            let by_wavelength = stated.by_wavelength.as_ref().filter(|law| reaches(law));
            if by_wavelength.is_some() || !is_solar {
                return BandEmissivity { by_wavelength: by_wavelength.cloned(), ..stated.clone() };
            }
            let names = if colour.is_some() { &mut coloured } else { &mut plain };
            if names.last() != Some(&material.name) {
                names.push(material.name.clone());
            }
            match colour {
                Some([red, green, blue]) => {
                    let inside = COLOURS.into_iter().zip([blue, green, red]);
                    let all = [(ENDS[0], blue)].into_iter().chain(inside).chain([(ENDS[1], red)]);
                    law(all.map(|(wavelength, albedo)| [wavelength, 1.0 - albedo]).collect())
                }
                None => {
                    let optics = if face == 0 { material.front } else { material.back() };
                    law(ENDS.map(|end| [end, optics.absorptivity]).to_vec())
                }
            }
        })
    };
    let laws = materials.iter().enumerate().map(&mut of).collect();
    let told =
        [(coloured, "reflect by the base colour of the model"), (plain, "reflect 1 - absorptivity, of all sunlight")];
    let told = told.iter().filter(|(names, _)| !names.is_empty());
    let told: Vec<String> = told.map(|(names, how)| format!("'{}' {how}", names.join("', '"))).collect();
    (laws, (!told.is_empty()).then(|| format!("Band '{}': {}.", band.name, told.join("; "))))
}
