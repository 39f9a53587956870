//! The surroundings of the craft in an image, and the emission and reflection of its materials.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec3, Vec3};
use rayon::prelude::*;

use super::prepare::Prepared;
use super::traced::TracedCraft;
use crate::environment::frames::gcrf_from_itrf;
use crate::environment::orbit::{SUN_DISTANCE, SUN_RADIUS};
use crate::environment::shadow::tree_boxes;
use crate::environment::view_factor::ApparentRadius;
use crate::gpu::effects::image::variant::RadianceVariant;
use crate::gpu::layout;
use crate::gpu::scene_data::Shown;
use crate::model::nodes::GROUP;
use crate::raster::traced::LARGEST_REFLECTED;
use crate::scene::{Background, Reflections, SUNNY, Scene, SceneBand, Surrounded};
use crate::thermal::crinkle::crinkled;
use crate::thermal::emissivity::BandEmissivity;
use crate::thermal::emissivity_table::{EmissivityTable, TABLE_VALUES};
use crate::thermal::lobe::{LOBE_VALUES, Lobe};
use crate::thermal::material::Material;
use crate::thermal::passband::Passband;
use crate::thermal::planet_map::{
    DayLaw, Equirectangular, MEAN_VALUES, MEANS_ANGLE, MapAxes, PlanetPattern, SeenPlanet,
};
use crate::thermal::radiance::{RadianceTable, band_radiance};
use crate::thermal::surroundings::{BandReflector, Looks, SUN_TEMPERATURE, Surroundings};

/// Whether any pixel shows the surroundings.
fn is_seen(settings: &Surrounded) -> bool {
    settings.reflections != Reflections::Off || settings.background != Background::Off
}

/// The surroundings at a time [s] in the axes of a camera. `None` where no pixel shows them.
pub fn surroundings_at(prepared: &Prepared, time: f64, pose: &DAffine3) -> Option<Surroundings> {
    if !is_seen(&prepared.scene.surrounded) {
        return None;
    }
    let sky = prepared.loads.sky_model().sky(time);
    let [planet_radiance, space_radiance, sun_radiance] = sky_radiances(prepared);
    Some(Surroundings {
        nadir: pose.matrix3 * sky.nadir_direction,
        planet: ApparentRadius::new(sky.distance_ratio),
        sun: pose.matrix3 * sky.sun_direction,
        sun_disc: ApparentRadius::new(SUN_DISTANCE / sky.solar_scale.sqrt() / SUN_RADIUS),
        planet_radiance,
        space_radiance,
        sun_radiance,
        lit_fraction: sky.lit_fraction,
        map_from_camera: map_from_inertial(prepared, time)
            .map(|map| map * sky.body_from_inertial.transpose() * pose.matrix3.transpose()),
    })
}

/// Radiances of planet, space and Sun [W m-2 sr-1].
fn sky_radiances(prepared: &Prepared) -> [f64; 3] {
    let (scene, environment) = (&prepared.scene, &prepared.scene.environment);
    let settings = &scene.surrounded;
    let table = RadianceTable::new(scene.passband());
    let radiance = |temperature| band_radiance(&table, temperature);
    let space = environment.background_temperature.unwrap_or(0.0);
    let planet = if settings.background == Background::Space && settings.reflections == Reflections::Off {
        space
    } else {
        settings.planet_temperature
    };
    let sun = environment.solar_constant.map_or(0.0, |_| radiance(SUN_TEMPERATURE));
    [radiance(planet) + daylight(prepared), radiance(space), sun]
}

/// The same surroundings in the band of another scene, which differs from theirs in the band alone.
pub(crate) fn surroundings_in_band(prepared: &Prepared, around: Surroundings) -> Surroundings {
    let [planet_radiance, space_radiance, sun_radiance] = sky_radiances(prepared);
    let map_from_camera = around.map_from_camera.filter(|_| has_map(&prepared.scene));
    Surroundings { planet_radiance, space_radiance, sun_radiance, map_from_camera, ..around }
}

/// Whether any pixel shows a planet with a map.
fn has_map(scene: &Scene) -> bool {
    let settings = &scene.surrounded;
    let shows = settings.background == Background::Planet || settings.reflections != Reflections::Off;
    shows && (settings.planet.is_some() || settings.planet_albedo > 0.0 || scene.albedos(scene.band).is_some())
}

/// Radiance of sunlight that the planet reflects below the Sun, as at the start of the scene [W m-2 sr-1]: albedo times irradiance over pi (Lambert's law). With a
/// map of albedos an albedo of 1 counts.
fn daylight(prepared: &Prepared) -> f64 {
    let scene = &prepared.scene;
    let albedo = if scene.albedos(scene.band).is_some() { 1.0 } else { scene.surrounded.planet_albedo };
    if albedo == 0.0 {
        return 0.0;
    }
    let sun = band_radiance(&RadianceTable::new(prepared.scene.passband()), SUN_TEMPERATURE);
    let scale = prepared.loads.sky_model().sky(0.0).solar_scale;
    albedo * sun * scale * (SUN_RADIUS / SUN_DISTANCE).powi(2)
}

/// Whether sunlight in the images of a scene without rays for reflections is shaded by rays: where it shades the craft in its heat balance, and the camera
/// sees sunlight.
fn is_shaded(prepared: &Prepared) -> bool {
    let scene = &prepared.scene;
    scene.surrounded.reflections == Reflections::Environment
        && scene.shadows.is_some()
        && !(prepared.joints() > 1 && scene.camera.as_ref().is_some_and(|camera| camera.line_time > 0.0))
        && scene.environment.solar_constant.is_some()
        && scene.band.lower < SUNNY
        && tree_boxes(prepared.triangles.len()) <= LARGEST_REFLECTED
}

/// Rotates inertial vectors into the axes of the planet's map at a time [s]. `None` for a planet that is uniform in all bands.
fn map_from_inertial(prepared: &Prepared, time: f64) -> Option<DMat3> {
    let (scene, settings) = (&prepared.scene, &prepared.scene.surrounded);
    let is_lit = |band: &SceneBand| scene.albedo_in(band) > 0.0 || scene.albedos(band.passband.band).is_some();
    if !has_map(scene) && !scene.bands.iter().any(is_lit) {
        return None;
    }
    let axes = settings.planet.as_ref().or(settings.albedo_map.as_ref()).map_or(MapAxes::Sun, |pattern| pattern.axes);
    let sun = prepared.loads.sky_model().point(time).map_or(DVec3::X, |point| point.sun.normalize());
    let epoch = prepared.scene.orbit.trajectory().map(|trajectory| trajectory.epoch(time));
    Some(axes.map_from_inertial(time, sun, || epoch.map_or(DMat3::IDENTITY, |epoch| gcrf_from_itrf(epoch).transpose())))
}

/// Emission and reflection of the materials of a scene, and the settings of the radiance in its pixels.
pub(crate) struct Finishes {
    /// Front and back of each material. Empty where nothing reflects and every emissivity is one number.
    pub(crate) reflectors: Vec<[BandReflector; 2]>,
    /// Their emissivities over angle and temperature. Empty where every emissivity is one number.
    tables: Vec<EmissivityTable>,
    /// The lobes of the rough reflectors.
    pub(crate) lobes: Lobes,
    /// The planet, where it is not uniform.
    pub(crate) planet: Option<MappedPlanet>,
    /// The craft, where its surfaces reflect each other.
    pub(crate) traced: Option<TracedCraft>,
    variant: RadianceVariant,
    /// Normals of the nodes with the slopes of crinkled foil that is drawn. Empty where none is.
    pub(crate) crinkled: Vec<Vec3>,
    rounded: Vec<layout::Reflector>,
    rounded_tables: Vec<f32>,
}

/// Tables of the faces of all materials, front and back in turn. Empty where every emissivity is one number.
pub(crate) fn emissivity_tables(materials: &[Material], passband: &Passband) -> Vec<EmissivityTable> {
    if materials.iter().flat_map(|material| &material.in_band).all(BandEmissivity::is_plain) {
        return Vec::new();
    }
    let of = |material: &Material| {
        let plain = [material.front.emissivity, material.back().emissivity];
        [0, 1].map(|face| EmissivityTable::new(&material.in_band[face], plain[face], passband.clone()))
    };
    materials.par_iter().flat_map_iter(of).collect()
}

/// Normals of all nodes where the slopes of a material are drawn. Empty where none are.
fn crinkled_normals(prepared: &Prepared) -> Vec<Vec3> {
    let (nodes, materials) = (&prepared.nodes, &prepared.materials);
    if materials.iter().all(|material| material.gloss[0].drawn_variance == 0.0) {
        return Vec::new();
    }
    let of = |(slot, normal): (usize, &Vec3)| {
        let gloss = materials[nodes.group_material[slot / GROUP] as usize].gloss[0];
        let drawn = || crinkled(normal.as_dvec3(), nodes.positions[slot], gloss.drawn_variance, gloss.seed).as_vec3();
        if gloss.drawn_variance > 0.0 { drawn() } else { *normal }
    };
    nodes.normals.par_iter().enumerate().map(of).collect()
}

/// Emission and reflection of both faces of materials, and the roughnesses of their mirrors. `sources` are the temperatures of planet, space and Sun [K].
fn reflectors_of(
    materials: &[Material],
    tables: &[EmissivityTable],
    sources: [f64; 3],
    reflects: bool,
) -> (Vec<[BandReflector; 2]>, Vec<f64>) {
    let mut roughnesses: Vec<f64> = Vec::new();
    let mut reflectors = Vec::new();
    for (number, material) in materials.iter().enumerate() {
        let optics = [material.front, material.back()];
        reflectors.push([0, 1].map(|face| {
            let gloss = material.gloss[face];
            let lobe = (reflects && gloss.specular > 0.0 && gloss.alpha() > 0.0).then(|| {
                roughnesses.iter().position(|known| *known == gloss.alpha()).unwrap_or_else(|| {
                    roughnesses.push(gloss.alpha());
                    roughnesses.len() - 1
                })
            });
            let table = tables.get(2 * number + face);
            let of_source = |temperature| table.map_or(0.0, |table| table.temperature_factor(temperature));
            BandReflector {
                emissivity: optics[face].emissivity,
                specular: gloss.specular,
                lobe,
                table: table.map(|_| 2 * number + face),
                of_sources: sources.map(of_source),
            }
        }));
    }
    (reflectors, roughnesses)
}

impl Finishes {
    /// The finishes of a scene. A scene without reflections and without laws of emissivity has none.
    pub(crate) fn new(prepared: &Prepared) -> Self {
        let (scene, settings) = (&prepared.scene, &prepared.scene.surrounded);
        let tables = emissivity_tables(&prepared.materials, &scene.passband());
        let reflects = settings.reflections != Reflections::Off;
        let space = scene.environment.background_temperature.unwrap_or(0.0);
        let sources = [settings.planet_temperature, space, SUN_TEMPERATURE];
        let has_reflectors = reflects || !tables.is_empty();
        let described = if has_reflectors { &prepared.materials[..] } else { &[] };
        let (reflectors, roughnesses) = reflectors_of(described, &tables, sources, reflects);
        let planet = has_map(scene).then(|| {
            let even =
                || PlanetPattern::day_night(settings.planet_temperature, settings.planet_temperature, DayLaw::Step);
            let pattern = settings.planet.clone().unwrap_or_else(|| Arc::new(even()));
            let light = (settings.planet_temperature, daylight(prepared));
            let roughnesses = reflects.then_some(roughnesses.clone());
            match scene.albedos(scene.band) {
                Some(albedos) => MappedPlanet::lit(albedos, light, scene.passband(), roughnesses),
                None => MappedPlanet::new(&pattern.temperatures, light, scene.passband(), roughnesses),
            }
        });
        let crinkled = if reflectors.is_empty() { Vec::new() } else { crinkled_normals(prepared) };
        let variant = RadianceVariant {
            reflections: reflects,
            rough: !roughnesses.is_empty(),
            smooth: reflects && reflectors.as_flattened().iter().any(|face| face.specular > 0.0 && face.lobe.is_none()),
            traced: settings.reflections == Reflections::Traced || is_shaded(prepared),
            dispatches: 0,
            sun: is_seen(settings) && scene.environment.solar_constant.is_some(),
            apart: settings.channels,
            background: settings.background != Background::Off,
            tables: !tables.is_empty(),
            map: planet.is_some(),
            crinkled: !crinkled.is_empty(),
            in_pixels: prepared.has_pixel_light(),
        };
        let rounded = |face: &BandReflector| layout::Reflector {
            emissivity: face.emissivity as f32,
            specular: face.specular as f32,
            roughness: face.lobe.map_or(0.0, |lobe| roughnesses[lobe] as f32),
            lobe: face.lobe.map_or(0.0, |lobe| (lobe * LOBE_VALUES) as f32),
            table: face.table.map_or(0.0, |table| (table * TABLE_VALUES) as f32),
            of_planet: face.of_sources[0] as f32,
            of_space: face.of_sources[1] as f32,
            of_sun: face.of_sources[2] as f32,
        };
        let rounded = reflectors.as_flattened().iter().map(rounded).collect();
        let rounded_tables = tables.iter().flat_map(|table| &table.values).map(|value| *value as f32).collect();
        let lobes = Lobes::new(roughnesses);
        let reflectivity = reflectors.as_flattened().iter().map(|face| match face.table {
            // The table has other emissivities too.
            Some(_) => 1.0,
            None => 1.0 - face.emissivity,
        });
        let reflectivity = reflectivity.fold(0.0, f64::max);
        let traced = variant.traced.then(|| TracedCraft::new(prepared, reflectivity, variant.sun));
        let variant = RadianceVariant { dispatches: traced.as_ref().map_or(0, TracedCraft::dispatches), ..variant };
        Self { reflectors, lobes, tables, planet, traced, variant, crinkled, rounded, rounded_tables }
    }

    /// The tables for the device.
    pub(crate) fn shown(&self) -> Shown<'_> {
        Shown {
            variant: self.variant,
            reflectors: &self.rounded,
            lobe_values: self.lobes.roughnesses.len() * LOBE_VALUES,
            emissivities: &self.rounded_tables,
            planet_map: self.planet.as_ref().map_or(&[], |planet| &planet.map.values),
            traced: self.traced.as_ref().map_or(&[], |traced| &traced.corners_in_tree),
            traced_nodes: self.traced.as_ref().map_or(&[], |traced| &traced.words),
            traced_boxes: self.traced.as_ref().map_or(0, TracedCraft::boxes),
            crinkled: &self.crinkled,
            planet_means: self.planet.as_ref().map_or(0, MappedPlanet::mean_values),
        }
    }

    /// Whether the sky is drawn behind the craft.
    pub(crate) fn has_background(&self) -> bool {
        self.variant.background
    }

    pub(crate) fn reflects(&self) -> bool {
        self.variant.reflections
    }

    /// Whether the frames show the reflected radiance apart.
    pub(crate) fn is_apart(&self) -> bool {
        self.variant.apart
    }

    /// Makes the tables that depend on the surroundings of an image.
    pub(crate) fn look_at(&mut self, around: &Surroundings) {
        self.lobes.before(around.planet);
        if let Some((planet, axes)) = self.planet.as_mut().zip(around.map_from_camera) {
            planet.light(axes * around.sun);
            planet.look_at(axes * around.nadir, around.planet);
        }
    }

    /// The tables for the surroundings that were looked at last.
    pub(crate) fn looks(&self) -> Looks<'_> {
        Looks {
            lobes: self.lobes.latest(),
            tables: &self.tables,
            planet: self.planet.as_ref().and_then(|planet| planet.seen.as_ref()),
        }
    }
}

/// A planet that is not uniform, before the surfaces of a scene.
pub(crate) struct MappedPlanet {
    /// Radiances, as multiples of the radiance at the planet's mean temperature.
    map: Arc<Equirectangular>,
    /// Roughnesses of the mirrors that see it. `None` where nothing reflects.
    roughnesses: Option<Vec<f64>>,
    /// Where it was looked at.
    place: Option<(DVec3, ApparentRadius)>,
    seen: Option<SeenPlanet>,
    rounded: Vec<f32>,
    /// The albedos of its places, where they have a map.
    lit: Option<LitPlanet>,
}

/// A planet whose places reflect sunlight differently.
struct LitPlanet {
    albedos: Equirectangular,
    /// Shares of its own radiance, and of sunlight that an albedo of 1 reflects below the Sun, in their sum.
    shares: [f64; 2],
    /// The direction of the Sun for which the map was made, in the axes of the map.
    sun: Option<DVec3>,
    /// Whether the device has another map.
    is_new: bool,
}

/// Least columns and rows of a map with sunlight, so that its terminator is as fine as half a degree.
const LIT_CELLS: [usize; 2] = [720, 360];

impl MappedPlanet {
    /// A planet with a map of albedos. `mean` is its temperature, and `daylight` the radiance of sunlight that an albedo of 1 reflects below the Sun.
    fn lit(
        albedos: &PlanetPattern,
        (mean, daylight): (f64, f64),
        passband: Passband,
        roughnesses: Option<Vec<f64>>,
    ) -> Self {
        let own = band_radiance(&RadianceTable::new(passband), mean);
        let whole = (own + daylight).max(f64::MIN_POSITIVE);
        let albedos = albedos.temperatures.clone();
        let size = [albedos.columns.max(LIT_CELLS[0]), albedos.rows.max(LIT_CELLS[1])];
        let map = Arc::new(Equirectangular::of_directions(size, |_| own / whole));
        let shares = [own / whole, daylight / whole];
        let lit = Some(LitPlanet { albedos, shares, sun: None, is_new: false });
        Self { map, roughnesses, place: None, seen: None, rounded: Vec::new(), lit }
    }

    /// Lets the Sun shine on a planet with a map of albedos, from a direction in the axes of the map.
    fn light(&mut self, sun: DVec3) {
        let Some(lit) = &mut self.lit else { return };
        if lit.sun.is_some_and(|last| last.angle_between(sun) < MEANS_ANGLE) {
            return;
        }
        let [own, daylight] = lit.shares;
        let value = |place: DVec3| own + daylight * lit.albedos.at(place) * place.dot(sun).max(0.0);
        self.map = Arc::new(Equirectangular::of_directions([self.map.columns, self.map.rows], value));
        (lit.sun, lit.is_new, self.place) = (Some(sun), true, None);
    }

    /// The map, where it is another than before.
    pub(crate) fn take_new_map(&mut self) -> Option<Arc<Equirectangular>> {
        let lit = self.lit.as_mut().filter(|lit| lit.is_new)?;
        lit.is_new = false;
        Some(Arc::clone(&self.map))
    }

    /// A planet of these temperatures. `mean` is their mean, and `daylight` the radiance of sunlight that the point below the Sun reflects, at the map's +Z.
    fn new(
        temperatures: &Equirectangular,
        (mean, daylight): (f64, f64),
        passband: Passband,
        roughnesses: Option<Vec<f64>>,
    ) -> Self {
        let table = RadianceTable::new(passband);
        let whole = (band_radiance(&table, mean) + daylight).max(f64::MIN_POSITIVE);
        let (columns, rows) = (temperatures.columns, temperatures.rows);
        let height = |index: usize| {
            let down = ((index / columns) as f64 - 0.5).clamp(0.0, rows as f64) / rows as f64;
            (down * PI).cos().max(0.0)
        };
        let relative = |(index, kelvin): (usize, &f32)| {
            let reflected = if daylight > 0.0 { daylight * height(index) } else { 0.0 };
            ((band_radiance(&table, f64::from(*kelvin)) + reflected) / whole) as f32
        };
        let values = temperatures.values.par_iter().enumerate().map(relative).collect();
        let map = Arc::new(Equirectangular { columns: temperatures.columns, rows: temperatures.rows, values });
        Self { map, roughnesses, place: None, seen: None, rounded: Vec::new(), lit: None }
    }

    fn mean_values(&self) -> usize {
        self.roughnesses.as_ref().map_or(0, |roughnesses| (1 + roughnesses.len()) * MEAN_VALUES)
    }

    /// Makes the means anew where the planet has moved.
    fn look_at(&mut self, nadir: DVec3, disc: ApparentRadius) {
        let near = |(last, radius): &(DVec3, ApparentRadius)| {
            last.angle_between(nadir) < MEANS_ANGLE && (radius.sin / disc.sin).ln().abs() < RADIUS_STEP
        };
        if self.place.as_ref().is_some_and(near) {
            return;
        }
        self.place = Some((nadir, disc));
        let seen = match &self.roughnesses {
            Some(roughnesses) => SeenPlanet::new(&self.map, nadir, disc, roughnesses),
            None => SeenPlanet { map: Arc::clone(&self.map), means: Vec::new() },
        };
        self.rounded = seen.means.iter().flat_map(|mean| mean.values.iter().copied()).collect();
        self.seen = Some(seen);
    }

    /// The values of an image for the device: the axes of the map in camera axes, and the means.
    pub(crate) fn told(&self, around: &Surroundings) -> Option<(layout::PlanetView, &[f32])> {
        let axes = around.map_from_camera?;
        Some((layout::PlanetView::new(&axes, [self.map.columns, self.map.rows]), &self.rounded))
    }
}

/// Step of the logarithm of the planet's apparent radius between two tables of lobes. The tables count the angle from the limb, so a rounded radius
/// changes the curvature of the limb alone.
const RADIUS_STEP: f64 = 2e-3;

/// Lobes of rough mirrors before the planet. The lobes are made anew where the apparent radius of the planet changes.
pub(crate) struct Lobes {
    roughnesses: Vec<f64>,
    /// Number of the rounded radius of the planet that the lobes belong to.
    radius: Option<i64>,
    lobes: Vec<Lobe>,
    values: Vec<f32>,
}

impl Lobes {
    fn new(roughnesses: Vec<f64>) -> Self {
        Self { roughnesses, radius: None, lobes: Vec::new(), values: Vec::new() }
    }

    /// The lobes before a planet.
    pub(crate) fn before(&mut self, planet: ApparentRadius) -> &[Lobe] {
        let rounded = (planet.sin.atan2(planet.cos).ln() / RADIUS_STEP).round();
        if self.radius != Some(rounded as i64) && !self.roughnesses.is_empty() {
            let radius = (rounded * RADIUS_STEP).exp().min(std::f64::consts::FRAC_PI_2);
            let (sin, cos) = radius.sin_cos();
            let lobe = |roughness: &f64| Lobe::new(*roughness, ApparentRadius { sin, cos });
            self.lobes = self.roughnesses.iter().map(lobe).collect();
            self.values = self.lobes.iter().flat_map(|lobe| lobe.values.iter().map(|value| *value as f32)).collect();
            self.radius = Some(rounded as i64);
        }
        &self.lobes
    }

    /// The lobes before the last planet.
    pub(crate) fn latest(&self) -> &[Lobe] {
        &self.lobes
    }

    /// The same, rounded to f32 for the device.
    pub(crate) fn values_before(&mut self, planet: ApparentRadius) -> &[f32] {
        self.before(planet);
        &self.values
    }
}
