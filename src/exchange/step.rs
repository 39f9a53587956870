//! The light that every patch receives in a step. Twin: `glsl/exchange_light.comp`, `glsl/exchange_send.comp` and `glsl/exchange_receive.comp`.
//!
//! The light of Sun and planet, with its reflections, does not depend on temperatures. This light is computed anew when Sun or planet have turned
//! against the craft ([`CraftLight`]). Infrared takes one product: the infrared that patches send, times the rows of their exchange areas. The product is
//! held for a time ([`super::sky::Renewal`]).
//!
//! A node emits to all sides, as it does without exchange: that stays in its own balance, with its temperature on the way through the step. Light
//! from other patches is a load, which follows from the temperatures at the start of the step and how they change ([`super::lead`]). The infrared of space, which the rest of isotherm lets
//! arrive from all sides, is taken off the infrared that patches send, so that hidden space sends nothing.

use std::sync::Arc;

use glam::DVec3;
use rayon::prelude::*;

use super::balance_sides::sides_of;
use super::bundles::SkyBundles;
use super::cast::Scenery;
use super::factors::Factors;
use super::for_light::{LateLightAreas, LightAreas, late};
use super::mirrors::Mirrored;
use super::patches::{Patch, PatchSurface, Patches};
use super::reflected::{Areas, exchange_areas};
use super::sky::PlanetFromPatch;
use super::slopes::Slopes;
use crate::environment::StepLoad;
use crate::environment::load::solar_flux;
use crate::environment::shadow::Lit;
use crate::stop::both;
use crate::thermal::STEFAN_BOLTZMANN;
use crate::thermal::balance::Incident;
use crate::thermal::incident::incident;
use crate::thermal::misfit::{Misfit, check_length};
use crate::thermal::received::{FaceLoad, PlanetShares};
use crate::trace::span;

/// How the rays and reflections of a scene are found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExchangeSettings {
    /// Rays of a patch.
    pub rays: u32,
    /// Size of a patch [m]. `None` is the side of a square that is 1 / [`PATCHES`] of the area of the craft.
    pub patch_edge: Option<f64>,
    /// Most reflections; `None` follows all.
    pub bounces: Option<u32>,
    /// Turn of Sun, planet or joint after which light is computed anew [rad].
    pub redraw_angle: f64,
    /// Whether patches mirror sunlight once, instead of reflecting all of it diffusely.
    pub specular_sunlight: bool,
    /// Time for which the infrared that patches exchange is held [s], and so the light while little turns. `None` follows how fast patches cool ([`super::hold`]).
    pub hold: Option<f64>,
}

impl Default for ExchangeSettings {
    fn default() -> Self {
        Self {
            rays: 4096,
            patch_edge: None,
            bounces: None,
            redraw_angle: 15f64.to_radians(),
            specular_sunlight: false,
            hold: None,
        }
    }
}

/// Squares on the area of a craft whose scene states no size of patches. Faces of sheets, parts and directions of normals make several times as many patches.
pub(crate) const PATCHES: f64 = 250.0;

/// Most patches of a craft, so that the number of one takes half a word.
pub(crate) const MOST_PATCHES: usize = 1 << 16;

/// The light of Sun and planet on a craft, held while they hardly turn against it.
#[derive(Debug, Clone, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct CraftLight {
    /// Shares of the planet's light that every patch sees.
    pub planet_shares: Vec<PlanetShares>,
    /// Infrared of the planet and sunlight that every patch reflects diffusely at first while they are held [W/m2]. Sunlight that others mirror onto the patch is
    /// included.
    pub reflected: Vec<[f64; 2]>,
    /// The same when they were found, without mirrored sunlight [W/m2].
    pub found: Vec<[f64; 2]>,
    /// Sunlight from all patches that each one absorbs [W/m2].
    pub sunlight: Vec<f64>,
    /// The part of it that others mirror directly onto the patch [W/m2]. Empty without mirrors.
    pub mirrored: Vec<f64>,
}

impl CraftLight {
    /// Refuses light of a saved state that is not of so many patches. Light that was not found yet fits all.
    ///
    /// # Errors
    /// Another number of patches.
    pub(crate) fn check_patches(&self, patches: usize) -> Result<(), Misfit> {
        if *self == Self::default() {
            return Ok(());
        }
        check_length("the planet's light on patches", &self.planet_shares, patches)?;
        check_length("reflected light of patches", &self.reflected, patches)?;
        check_length("light that patches reflected when it was found", &self.found, patches)?;
        check_length("sunlight on patches", &self.sunlight, patches)
    }
}

/// The patches of a craft with all that they exchange.
#[derive(Debug, Clone)]
pub struct Exchange {
    /// The patches.
    pub patches: Arc<Vec<Patch>>,
    /// Nodes of the patches, each with its share of the patch's area.
    pub(crate) nodes: Arc<Vec<(u32, f64)>>,
    /// Patches of the front and of the back of each node, or [`NONE`].
    pub of_node: Arc<Vec<[u32; 2]>>,
    /// How fluxes differ within patches.
    pub(crate) slopes: Arc<Slopes>,
    /// View factors.
    pub factors: Factors,
    /// Exchange areas of infrared.
    pub infrared: Areas,
    /// Exchange areas of sunlight, and the sky.
    pub for_light: LateLightAreas,
    /// The same bundles with nothing open.
    pub(super) directions: Arc<Vec<u32>>,
    pub(super) bundles: usize,
}

impl Exchange {
    /// The exchange of patches whose rays end at `ends`, with the directions of the rays in the frame of the patch's joint.
    pub(crate) fn new(surface: &PatchSurface, patches: &Patches, ends: &[u32], settings: &ExchangeSettings) -> Self {
        Self::of_bundles(&SkyBundles::new(surface, patches, settings.rays), patches, ends, settings)
    }

    /// The same with bundles that are known.
    pub(crate) fn of_bundles(
        bundles: &SkyBundles,
        patches: &Patches,
        ends: &[u32],
        settings: &ExchangeSettings,
    ) -> Self {
        let _finds = span("finding reflections");
        let factors = Factors::new(&patches.all, ends, settings.rays);
        let [infrared, sunlight] = reflections(&factors, patches, settings.bounces, None);
        Self {
            bundles: bundles.of_patch(),
            for_light: late({
                let sky = bundles.opened(ends);
                || LightAreas { sunlight, sky }
            }),
            directions: Arc::clone(&bundles.words),
            patches: Arc::clone(&patches.all),
            nodes: Arc::clone(&patches.nodes),
            of_node: Arc::clone(&patches.of_node),
            slopes: Arc::clone(&patches.slopes),
            factors,
            infrared,
        }
    }

    /// The exchange of the same patches with other optics, from the same view factors.
    pub(crate) fn with_optics(&self, patches: &Patches, bounces: Option<u32>) -> Self {
        let [infrared, sunlight] = reflections(&self.factors, patches, bounces, Some(self));
        let sky = self.for_light.sky.clone();
        let for_light = late(|| LightAreas { sunlight, sky });
        Self { patches: Arc::clone(&patches.all), infrared, for_light, ..self.clone() }
    }

    /// The exchange of a craft in the pose of its scenery, with rays of the processor.
    pub fn cast(surface: &PatchSurface, patches: &Patches, scenery: &Scenery, settings: &ExchangeSettings) -> Self {
        let ends = super::cast::cast_rays(surface, patches, scenery, settings.rays, 0..patches.all.len() as u32);
        Self::new(surface, patches, &ends, settings)
    }

    /// Share of a patch that direct sunlight can reach. Inside another part the share counts the rays that do not end on the inner face of a skin.
    pub fn exposed(&self, patch: usize) -> f64 {
        if self.patches[patch].buried { 1.0 - self.factors.inside[patch] } else { 1.0 }
    }

    pub(crate) fn bundles(&self) -> usize {
        self.bundles
    }

    pub(crate) fn sky_of(&self, patch: usize) -> &[u32] {
        &self.for_light.sky[patch * self.bundles..(patch + 1) * self.bundles]
    }

    /// Shares of the planet's light that every patch sees.
    pub fn seen(&self, load: &StepLoad) -> Vec<PlanetShares> {
        let Some(planet) = &load.planet else { return vec![PlanetShares::ALL; self.patches.len()] };
        let share = |(patch, rays): (&Patch, &[u32])| PlanetFromPatch::new(planet, load, patch.joint).seen(rays);
        self.patches.par_iter().zip(self.for_light.sky.par_chunks(self.bundles.max(1))).map(share).collect()
    }

    /// The light of Sun and planet. `lit` has the lit area of each node. With `mirrored` the specular share of direct sunlight goes where it says.
    pub fn light(&self, load: &StepLoad, lit: &Lit, mirrored: Option<&Mirrored>) -> CraftLight {
        self.light_ahead(load, lit, mirrored, (&CraftLight::default(), 0.0))
    }

    /// The same for the middle of the time for which it is held: with a part of the change since it was found before.
    pub fn light_ahead(
        &self,
        load: &StepLoad,
        lit: &Lit,
        mirrored: Option<&Mirrored>,
        (before, lead): (&CraftLight, f64),
    ) -> CraftLight {
        let planet_shares = self.seen(load);
        let reflect = |(number, (patch, planet)): (usize, (&Patch, &PlanetShares))| {
            let body_from_joint = load.joint_from_body(patch.joint).transpose();
            let Incident { solar, albedo, planet_ir } = incident(load, body_from_joint * patch.normal);
            let on_face = |(node, share): &(u32, f64)| *share * lit.areas[*node as usize].on_face(patch.back);
            let solar = match lit.areas.is_empty() {
                true => solar,
                false => {
                    let vector: DVec3 = self.nodes[patch.nodes.clone()].iter().map(on_face).sum();
                    solar_flux(load, body_from_joint * vector)
                }
            };
            let solar = if lit.by_rays { solar } else { self.exposed(number) * solar };
            let optics = patch.optics;
            let smooth = if mirrored.is_some() { patch.gloss.specular } else { 0.0 };
            let direct = (1.0 - optics.absorptivity) * solar;
            let diffuse = (1.0 - smooth) * direct + (1.0 - optics.absorptivity) * (planet.albedo * albedo);
            ([(1.0 - optics.emissivity) * planet.planet_ir * planet_ir, diffuse], smooth * direct)
        };
        let (found, sent): (Vec<[f64; 2]>, Vec<f64>) =
            self.patches.par_iter().zip(&planet_shares).enumerate().map(reflect).unzip();
        let ahead = |(number, now): (usize, &[f64; 2])| {
            let before = before.found.get(number).unwrap_or(now);
            [0, 1].map(|kind| (now[kind] + lead * (now[kind] - before[kind])).max(0.0))
        };
        let mut reflected: Vec<[f64; 2]> = found.iter().enumerate().map(ahead).collect();
        let arrives = |to: usize| {
            let rows = mirrored.map_or(&[][..], |mirrored| mirrored.arrives.row(to));
            rows.iter().map(|(from, share)| share * sent[*from as usize]).sum::<f64>()
        };
        let mut direct = Vec::new();
        for (number, patch) in self.patches.iter().enumerate().filter(|_| mirrored.is_some()) {
            let arrives = arrives(number);
            reflected[number][1] += (1.0 - patch.optics.absorptivity) * arrives;
            direct.push(patch.optics.absorptivity * arrives);
        }
        let mut sunlight =
            self.gathered(&self.for_light.sunlight, |from| reflected[from][1], |patch| patch.optics.absorptivity);
        sunlight.iter_mut().zip(&direct).for_each(|(all, direct)| *all += direct);
        CraftLight { planet_shares, reflected, found, sunlight, mirrored: direct }
    }

    /// Emission of each patch above the emission of space [W/m2]. `temperature` gives the temperature of a node [K].
    pub(super) fn emitted(&self, load: &StepLoad, temperature: impl Fn(usize) -> f64 + Sync) -> Vec<f64> {
        let space = load.background_temperature.powi(4);
        let emitted = |patch: &Patch| {
            let fourth = |(node, share): &(u32, f64)| share * temperature(*node as usize).powi(4);
            let fourth: f64 = self.nodes[patch.nodes.clone()].iter().map(fourth).sum();
            patch.optics.emissivity * STEFAN_BOLTZMANN * (fourth - space)
        };
        self.patches.par_iter().map(emitted).collect()
    }

    /// Infrared that leaves each patch at first [W/m2]: emission above the emission of space, and reflected infrared of the planet. `temperature`
    /// gives the temperature of a node [K].
    pub fn sent(&self, load: &StepLoad, light: &CraftLight, temperature: impl Fn(usize) -> f64 + Sync) -> Vec<f64> {
        let emitted = self.emitted(load, temperature);
        emitted.iter().zip(&light.reflected).map(|(emitted, reflected)| emitted + reflected[0]).collect()
    }

    /// Flux from all patches that each one absorbs [W/m2].
    pub fn absorbed(&self, sent: &[f64], light: &CraftLight) -> Vec<f64> {
        let infrared = self.gathered(&self.infrared, |from| sent[from], |patch| patch.optics.emissivity);
        infrared.into_iter().zip(&light.sunlight).map(|(infrared, sunlight)| infrared + sunlight).collect()
    }

    /// Infrared that nodes absorb from each other [W/m2], if each emits like a black body of this flux [W/m2].
    pub fn exchanged_infrared(&self, black: &[f64]) -> Vec<f64> {
        let sent = |patch: &Patch| {
            let shares = self.nodes[patch.nodes.clone()].iter();
            patch.optics.emissivity * shares.map(|(node, share)| share * black[*node as usize]).sum::<f64>()
        };
        let sent: Vec<f64> = self.patches.iter().map(sent).collect();
        let absorbed = self.gathered(&self.infrared, |from| sent[from], |patch| patch.optics.emissivity);
        self.on_faces(&absorbed).into_iter().map(|[front, back]| front + back).collect()
    }

    fn gathered(
        &self,
        areas: &Areas,
        sent: impl Fn(usize) -> f64 + Sync,
        absorptivity: impl Fn(&Patch) -> f64 + Sync,
    ) -> Vec<f64> {
        let gathered = |(number, patch): (usize, &Patch)| {
            let arrives: f64 = areas.between.row(number).iter().map(|(from, area)| area * sent(*from as usize)).sum();
            absorptivity(patch) * arrives / patch.area
        };
        self.patches.par_iter().enumerate().map(gathered).collect()
    }

    /// The light on the two faces of every node, from the flux that every patch absorbs and the sky that it sees.
    pub fn of_nodes(&self, absorbed: &[f64], planet_shares: &[PlanetShares]) -> Vec<[FaceLoad; 2]> {
        let of_patch = |(number, absorbed): (usize, &f64)| FaceLoad {
            absorbed: *absorbed,
            planet_shares: planet_shares[number],
            exposed: self.exposed(number),
        };
        let loads: Vec<FaceLoad> = absorbed.iter().enumerate().map(of_patch).collect();
        self.spread(&loads)
    }

    /// The light on the two faces of every node, from the light on every patch. What a patch absorbs from others differs from node to node.
    pub(crate) fn spread(&self, loads: &[FaceLoad]) -> Vec<[FaceLoad; 2]> {
        let absorbed: Vec<f64> = loads.iter().map(|load| load.absorbed).collect();
        let on_faces = self.on_faces(&absorbed);
        let face = |patch: u32, absorbed: f64| match loads.get(patch as usize) {
            Some(load) => FaceLoad { absorbed, ..*load },
            None => FaceLoad::NOTHING,
        };
        let faces = self.of_node.iter().zip(on_faces);
        faces.map(|(patches, absorbed)| std::array::from_fn(|side| face(patches[side], absorbed[side]))).collect()
    }

    /// Flux that the two faces of every node absorb [W/m2], where patches absorb these fluxes.
    fn on_faces(&self, absorbed: &[f64]) -> Vec<[f64; 2]> {
        let of_patch = |patch: &u32| absorbed.get(*patch as usize).copied().unwrap_or_default();
        let mut faces: Vec<[f64; 2]> = self.of_node.iter().map(|faces| faces.each_ref().map(of_patch)).collect();
        let differences = self.slopes.differences(absorbed);
        for patch in self.patches.iter().filter(|_| !differences.is_empty()) {
            for place in patch.nodes.clone() {
                faces[self.nodes[place].0 as usize][usize::from(patch.back)] += differences[place];
            }
        }
        faces
    }
}

/// Exchange areas of infrared and of sunlight. One of them is taken from a known exchange of the same view factors where its optics are the same.
fn reflections(factors: &Factors, patches: &Patches, bounces: Option<u32>, known: Option<&Exchange>) -> [Areas; 2] {
    let sides = sides_of(&patches.all);
    let areas = |absorptivity: fn(&Patch) -> f64, of: fn(&Exchange) -> &Areas| {
        let is_same =
            |known: &&Exchange| known.patches.iter().map(absorptivity).eq(patches.all.iter().map(absorptivity));
        if let Some(known) = known.filter(is_same) {
            return of(known).clone();
        }
        let absorptivities: Vec<f64> = patches.all.iter().map(absorptivity).collect();
        exchange_areas(factors, &sides, &absorptivities, bounces)
    };
    // Each has works for one thread.
    both(
        || areas(|patch| patch.optics.emissivity, |known| &known.infrared),
        || areas(|patch| patch.optics.absorptivity, |known| &known.for_light.sunlight),
    )
    .into()
}
