//! The light of a sample: emission and reflection of a surface there, or the sky where none is.

use glam::{DVec2, DVec3};

use super::surface::{Pixel, RasterSurface, SurfaceSurroundings};
use super::traced::{ReflectedCraft, TracedSample, traced_radiance};
use super::triangle::ShownFace;
use super::view::RasterView;
use crate::thermal::surroundings::{BandReflector, emissivity, reflected_radiance, sky_radiance};

pub(super) struct SampleLight<'a> {
    pub(crate) surface: &'a RasterSurface<'a>,
    pub(crate) view: &'a RasterView,
    /// Texels along the width and height of a pixel, by which the rays of a place are drawn.
    pub(crate) texels: [u32; 2],
    /// Radiance of a blackbody at a temperature [K].
    pub(crate) radiance: &'a dyn Fn(f64) -> f64,
}

impl SampleLight<'_> {
    /// Gives a sample its light. `ray` passes through its place in the image. So far the radiance holds the emissivity, so that only visible samples
    /// are converted.
    pub(crate) fn shine(&self, sample: &mut Pixel, shown: Option<ShownFace>, ray: DVec2, place: [f64; 2]) {
        let around = self.surface.around.as_ref().filter(|_| ray.is_finite());
        let direction = ray.extend(1.0).normalize();
        if sample.part > 0 {
            let emissivity = around.zip(shown).and_then(|(around, shown)| around.emissivity(sample, shown, direction));
            sample.radiance = emissivity.unwrap_or(sample.radiance) * (self.radiance)(sample.temperature);
        }
        let Some(around) = around else { return };
        arrive(sample, around, shown, direction);
        if let Some(light) = shown.and_then(|shown| self.of_craft(sample, around, shown, ray, place)) {
            sample.reflected += light;
            sample.radiance += light;
        }
    }

    /// The craft's own light that a sample reflects. `None` where the craft is not traced.
    fn of_craft(
        &self,
        sample: &Pixel,
        around: &SurfaceSurroundings,
        shown: ShownFace,
        ray: DVec2,
        place: [f64; 2],
    ) -> Option<f64> {
        let traced = around.traced.as_ref()?;
        let surroundings = around.surroundings?;
        let [across, down] = self.texels.map(f64::from);
        let texel = [across * place[0], down * place[1]];
        let sample = TracedSample {
            node: shown.node,
            face: shown.face,
            normal: shown.normal,
            to_camera: -ray.extend(1.0).normalize(),
            place: sample.depth * ray.extend(1.0),
            pixel: texel.map(|at| (16.0 * at) as u32),
        };
        let craft = ReflectedCraft {
            traced,
            surroundings,
            reflectors: around.reflectors,
            looks: &around.looks,
            temperatures: self.surface.temperatures,
            radiance: self.radiance,
        };
        Some(traced_radiance(&craft, &self.view.camera_from_body, &sample))
    }
}

impl SurfaceSurroundings<'_> {
    fn reflector(&self, sample: &Pixel, shown: ShownFace) -> Option<&BandReflector> {
        self.reflectors.get(sample.material as usize - 1).map(|faces| &faces[shown.face])
    }

    /// Emissivity of the face that a sample shows. `direction` leads from the camera to it.
    fn emissivity(&self, sample: &Pixel, shown: ShownFace, direction: DVec3) -> Option<f64> {
        let reflector = self.reflector(sample, shown)?;
        Some(emissivity(reflector, &self.looks, sample.temperature, shown.normal.dot(-direction).max(0.0)))
    }
}

/// Adds the reflection of a surface, or the sky where none is. `direction` leads from the camera to the sample.
fn arrive(sample: &mut Pixel, around: &SurfaceSurroundings, shown: Option<ShownFace>, direction: DVec3) {
    let Some(surroundings) = around.surroundings else { return };
    match shown {
        None if around.background => sample.radiance = sky_radiance(surroundings, &around.looks, direction),
        None => {}
        Some(shown) => {
            if let Some(reflector) = around.reflector(sample, shown).filter(|_| around.reflects) {
                sample.reflected = reflected_radiance(surroundings, reflector, &around.looks, shown.normal, -direction);
                sample.radiance += sample.reflected;
            }
        }
    }
}
