//! Input data of a scene on the device, its memory plan, and the upload.

use std::sync::Arc;

use bytemuck::Zeroable;
use glam::Vec3;

use super::context::Context;
use super::error::GpuError;
use super::exchange::ExchangeTables;
use super::frame::{StepRange, TRIANGLES_A_DRAW, TriangleRun};
use super::heat::HeatTables;
use super::layout::{self, FUSED_STEPS};
use super::once::Once;
use super::one_pass::OnePassTables;
use super::radiance_variant::RadianceVariant;
use super::resource::Resource;
use super::resource_row::{Count, Pieces};
use super::sampling::{Mean, Sampled, Sampling};
use super::sensor::SensorTables;
use super::shapes::Shapes;
use super::store::Resources;
use super::variant::{StepKind, ThermalVariant};
use crate::environment::albedo;
use crate::environment::shadow::{Jointed, Occluders, Redraw};
use crate::exchange::mirrors::Mirrors;
use crate::exchange::sky::Renewal;
use crate::model::nodes::{GROUP, RANGE_GROUPS};

/// Nodes of a workgroup of the thermal step. Ranges are multiples of it.
pub const NODES_PER_WORKGROUP: usize = GROUP * RANGE_GROUPS;

/// Data of a scene. Nodes come in groups of four with a common material and part.
pub struct SceneData<'a> {
    /// Ranges of nodes with their pipelines.
    pub ranges: Vec<StepRange>,
    /// Material index of each group.
    pub group_material: &'a [u32],
    /// Part index of each group.
    pub group_part: &'a [u32],
    /// Unit normal of each node; zero for padding.
    pub normals: &'a [Vec3],
    /// Position of each node in the body frame [m].
    pub positions: &'a [Vec3],
    /// Node indices of the triangles.
    pub triangles: &'a [[u32; 3]],
    /// Materials.
    pub materials: &'a [layout::Material],
    /// Shaped response functions.
    pub shapes: &'a Shapes,
    /// Band table (see `blackbody::band_table`).
    pub band_table: &'a [f32],
    /// Width and height of the image [px]; `None` without an image.
    pub image: Option<[u32; 2]>,
    /// Whether images lie between steps, so that their temperatures are interpolated.
    pub between: bool,
    /// How the image is made; `None` if it is simply drawn.
    pub sampling: Option<Sampling>,
    /// Shadows; `None` if the craft does not shadow itself.
    pub shadows: Option<ShadowData<'a>>,
    /// Joints; `None` if no part moves.
    pub joints: Option<JointData<'a>>,
    /// Thermal network that the frames step in one pass.
    pub network: Option<&'a OnePassTables>,
    /// Runs of nodes whose absorbed heat is summed, if it is.
    pub heat: Option<&'a HeatTables>,
    /// Patches that radiate to each other; `None` without.
    pub exchange: Option<ExchangeData<'a>>,
    /// Sensor of the image; `None` without one.
    pub sensor: Option<&'a SensorTables>,
    /// What the image shows besides the emission of surfaces.
    pub shown: Shown<'a>,
}

impl<'a> SceneData<'a> {
    /// No nodes and no image, as a start for small scenes that are made by hand.
    pub fn empty(shapes: &'a Shapes) -> Self {
        Self {
            ranges: Vec::new(),
            group_material: &[],
            group_part: &[],
            normals: &[],
            positions: &[],
            triangles: &[],
            materials: &[],
            shapes,
            band_table: &[],
            image: None,
            between: false,
            sampling: None,
            shadows: None,
            joints: None,
            network: None,
            heat: None,
            exchange: None,
            sensor: None,
            shown: Shown::default(),
        }
    }
}

/// What an image shows besides the emission of surfaces. By default that is nothing.
#[derive(Debug, Clone, Copy, Default)]
pub struct Shown<'a> {
    /// Shader variant.
    pub variant: RadianceVariant,
    /// Front and back of each material, if they reflect.
    pub reflectors: &'a [layout::Reflector],
    /// Number of values of all lobes. The values belong to the planet's distance and come with the requests.
    pub lobe_values: usize,
    /// Emissivities of the faces over angle and temperature, if they have any.
    pub emissivities: &'a [f32],
    /// Radiances of a planet that is not uniform, over that of its mean temperature.
    pub planet_map: &'a [f32],
    /// Nodes of the corners of the triangles in the tree for reflections of the craft, and their material. The tree follows the
    /// joints and comes with the requests.
    pub traced: &'a [[u32; 4]],
    /// Boxes of this tree.
    pub traced_boxes: usize,
    /// Normals of all nodes, if the image has normals of its own.
    pub crinkled: &'a [Vec3],
    /// Number of its means over the direction of a surface, which come with the requests.
    pub planet_means: usize,
}

/// Patches that radiate to each other.
#[derive(Clone)]
pub struct ExchangeData<'a> {
    /// Their tables.
    pub tables: &'a ExchangeTables,
    /// When what they exchange is found anew.
    pub renewal: Renewal,
    /// The patches that mirror sunlight.
    pub mirrors: Option<&'a Arc<Mirrors>>,
}

impl ExchangeData<'_> {
    /// Number of elements for a `count`; 0 for those of others.
    fn count(&self, count: Count) -> usize {
        let patches = self.tables.patches.len();
        match (count, self.mirrors) {
            (Count::ExchangeMirrors, Some(mirrors)) => patches + mirrors.most_pairs(),
            (Count::ExchangeMirrored, Some(_)) => patches + 1,
            _ => self.tables.count(count),
        }
    }
}

/// Triangles of each joint.
#[derive(Clone)]
pub struct JointData<'a> {
    /// Number of joints, counting the body.
    pub count: u32,
    /// Runs of triangles. Each begins at a multiple of 64.
    pub triangles: &'a [TriangleRun],
    /// Runs of the triangles that cast shadows.
    pub occluders: &'a [TriangleRun],
    /// Shadow casters in the pose of the model file, for shadow rays only.
    pub casters: Option<Jointed>,
}

/// Shadow casters, and when to update the shadows.
#[derive(Clone)]
pub struct ShadowData<'a> {
    /// Node indices of the triangles that cast shadows.
    pub occluders: &'a [[u32; 3]],
    /// View from the Sun, and when to update it.
    pub redraw: Redraw,
    /// Tree of the triangles, for shadow rays only.
    pub tree: Option<&'a Occluders>,
}

/// A planned buffer or image.
#[derive(Debug, Clone)]
pub struct Planned {
    /// Resource.
    pub resource: Resource,
    /// Size of all its copies [bytes].
    pub bytes: u64,
}

impl SceneData<'_> {
    /// Whether one dispatch may take many steps. This needs transitions that depend on nothing but the load.
    pub fn fuses(&self) -> bool {
        let kinds = || self.ranges.iter().map(|range| range.variant.kind);
        self.joints.is_none()
            && self.exchange.is_none()
            && kinds().any(StepKind::has_state)
            && kinds().all(|kind| kind != StepKind::Absorb)
    }

    /// Triangles of the body and of each joint.
    pub fn runs(&self) -> Vec<TriangleRun> {
        let whole = TriangleRun { joint: 0, triangles: (0, self.triangles.len() as u32) };
        self.joints.as_ref().map_or_else(|| vec![whole], |joints| joints.triangles.to_vec())
    }

    /// Draw commands of all triangles, for drawing without culling.
    fn whole_draws(&self) -> Vec<layout::DrawCommand> {
        let mut draws = Vec::new();
        for run in self.runs().into_iter().flat_map(TriangleRun::pieces) {
            let (first, end) = run.draws();
            draws.resize(first as usize, layout::DrawCommand::zeroed());
            let left = run.triangles.1 - run.triangles.0;
            draws.extend((0..end - first).map(|number| {
                let before = TRIANGLES_A_DRAW * number;
                layout::DrawCommand {
                    index_count: 3 * TRIANGLES_A_DRAW.min(left - before),
                    instance_count: 1,
                    first_index: 3 * (run.triangles.0 + before),
                    vertex_offset: 0,
                    first_instance: 0,
                }
            }));
        }
        draws
    }

    /// Everything that the scene needs on the device, in the order of the table.
    pub fn plan(&self) -> Vec<Planned> {
        let planned = |resource: &Resource| {
            let row = resource.row();
            let joints = self.joints.as_ref().filter(|_| row.per_joint).map(|joints| joints.count as usize);
            let one = joints.map_or(row.element, |joints| joints * layout::SLICE);
            let bytes = (row.copies() * self.count(row.count) * one) as u64;
            (bytes > 0).then_some(Planned { resource: *resource, bytes })
        };
        Resource::ALL.iter().filter_map(planned).collect()
    }

    /// A number of an image that is not simply drawn, or 0.
    fn of_sampling(&self, number: impl Fn(&Sampling) -> usize) -> usize {
        self.sampling.as_ref().map_or(0, number)
    }

    /// A number of an image that is computed from drawn ones, or 0.
    fn of_computed(&self, number: impl Fn(&Sampling) -> usize) -> usize {
        let computed = self.sampled().is_some_and(|sampled| sampled.is_resampled());
        self.sampling.as_ref().filter(|_| computed).map_or(0, number)
    }

    /// A number of the image from which the mean over several samples is made, or 0.
    fn of_mean(&self, number: impl Fn(&Mean) -> usize) -> usize {
        self.sampling.as_ref().and_then(|sampling| sampling.mean.as_ref()).map_or(0, number)
    }

    /// What the passes of the image depend on, if it is not simply drawn.
    pub fn sampled(&self) -> Option<Sampled> {
        Some(self.sampling.as_ref()?.passes(self.image?))
    }

    /// Where the frame leaves the radiance of the image.
    pub fn shown_in(&self) -> Resource {
        match self.sampled() {
            Some(sampled) if sampled.is_resampled() => Resource::ImageRadiance,
            _ if self.shown.variant.traced => Resource::DrawnRadiance,
            _ => Resource::RadianceImage,
        }
    }

    /// Width and height of the largest image that is drawn [px].
    pub fn drawn(&self) -> Option<[u32; 2]> {
        self.sampling.as_ref().map(Sampling::largest).or(self.image)
    }

    /// Width and height of the image with one sample of a texel [texels].
    pub fn drawn_singly(&self) -> Option<[u32; 2]> {
        self.sampling.as_ref().map(|sampling| sampling.drawn).or(self.image)
    }

    /// Texels of the largest image that is drawn, if surfaces reflect the craft itself, or 0.
    pub fn texels(&self) -> usize {
        self.drawn().filter(|_| self.shown.variant.traced).map_or(0, area)
    }

    /// Number of elements for a `count`; 0 if no scene has such elements.
    fn count(&self, count: Count) -> usize {
        let groups = self.normals.len() / GROUP;
        let only = |present: bool, number: usize| if present { number } else { 0 };
        let of_ranges = |has: fn(&ThermalVariant) -> bool| self.ranges.iter().any(|range| has(&range.variant));
        let tree = self.shadows.as_ref().and_then(|shadows| shadows.tree);
        let seen = self.shadows.as_ref().filter(|_| tree.is_none());
        let directions = only(of_ranges(|variant| variant.albedo), (albedo::RESOLUTION + 1).pow(2));
        let steps = only(self.fuses(), FUSED_STEPS);
        let drawn = self.image.is_some();
        match count {
            Count::Once => 1,
            Count::FusedSteps => steps,
            Count::Albedo => directions,
            Count::FusedAlbedo => steps * directions,
            Count::Materials => self.materials.len(),
            Count::Shapes => self.shapes.values.len(),
            Count::Surroundings => only(drawn && self.shown.variant.sees_surroundings(), 1),
            Count::Reflectors => only(drawn, self.shown.reflectors.len()),
            Count::Lobes => only(drawn, self.shown.lobe_values),
            Count::Emissivities => only(drawn, self.shown.emissivities.len()),
            Count::Tracing => only(drawn && self.shown.variant.traced, 1),
            Count::TraceBoxes => only(drawn, self.shown.traced_boxes),
            Count::TraceTriangles => only(drawn, self.shown.traced.len()),
            Count::PlanetView => only(drawn && self.shown.variant.map, 1),
            Count::PlanetMap => only(drawn, self.shown.planet_map.len()),
            Count::PlanetMeans => only(drawn, self.shown.planet_means),
            Count::Groups => groups,
            Count::HeatedGroups => groups + self.network.map_or(0, |network| network.heaters.len().div_ceil(GROUP)),
            Count::LoadedGroups => {
                let seen = drawn && self.shown.variant.needs_normals() && !self.shown.variant.crinkled;
                only(seen || of_ranges(|variant| variant.sun || variant.planet_ir), groups)
            }
            Count::CrinkledGroups => only(drawn, self.shown.crinkled.len() / GROUP),
            Count::MovingGroups => only(of_ranges(|variant| variant.kind.has_state()), groups),
            Count::TargetGroups => only(of_ranges(|variant| variant.kind.has_full_state()), groups),
            Count::PlacedGroups => only(drawn || self.shadows.is_some(), groups),
            Count::DrawnGroups => only(drawn, groups),
            Count::BetweenGroups => only(drawn && self.between, groups),
            Count::ShadowedGroups => only(self.shadows.is_some(), groups),
            Count::Triangles => only(drawn, self.triangles.len()),
            Count::Draws => only(drawn, self.runs().iter().map(|run| run.draws().1 as usize).max().unwrap_or(0)),
            Count::Band => self.band_table.len(),
            Count::SunView => only(seen.is_some(), 1),
            Count::Occluders => seen.map_or(0, |shadows| shadows.occluders.len()),
            Count::SunTexels => seen.map_or(0, |shadows| (shadows.redraw.resolution as usize).pow(2)),
            // A tree that is rebuilt for moved parts has the same number of boxes.
            Count::Boxes => tree.map_or(0, |tree| tree.tree.nodes.len()),
            Count::Traced => tree.map_or(0, |tree| tree.triangles.len()),
            Count::Pixels => self.image.map_or(0, area),
            Count::DrawnTexels => self.drawn_singly().map_or(0, area),
            Count::ReadTexels => self.of_computed(|sampling| area(sampling.drawn)),
            Count::LitTexels => {
                let traced = only(self.shown.variant.traced, self.drawn_singly().map_or(0, area));
                self.of_computed(|sampling| area(sampling.drawn)).max(traced)
            }
            Count::SurfaceTexels => self.texels(),
            Count::ComputedPixels => self.of_computed(|_| self.image.map_or(0, area)),
            Count::MeanTexels => self.of_mean(|mean| area(mean.size)),
            Count::MeanSamples => self.of_mean(|mean| area(mean.size) * mean.each as usize),
            Count::MultiSamples => {
                self.of_mean(|mean| if mean.each > 1 { area(mean.size) * mean.each as usize } else { 0 })
            }
            Count::LensCorners => self.of_sampling(|sampling| sampling.map.len()),
            Count::ComputedOnce => self.of_computed(|_| 1),
            Count::DistantOnce => self.of_sampling(|sampling| usize::from(sampling.distant)),
            Count::RollingOnce => self.of_sampling(|sampling| usize::from(sampling.shutter.is_some())),
            Count::HeatRuns => self.heat.map_or(0, |heat| heat.runs.len()),
            Count::HeatGroups => only(self.heat.is_some(), groups),
            other => {
                let of_sensor = self.sensor.filter(|_| drawn).map_or(0, |sensor| sensor.count(other));
                let of_exchange = self.exchange.as_ref().map_or(0, |exchange| exchange.count(other));
                of_sensor + of_exchange + self.network.map_or(0, |network| network.count(other))
            }
        }
    }
}

/// Number of pixels of an image.
fn area([width, height]: [u32; 2]) -> usize {
    width as usize * height as usize
}

/// Part of a plan that grows with the nodes and triangles [bytes], without buffers that only the host reads.
pub fn device_bytes(plan: &[Planned]) -> u64 {
    plan.iter().filter(|planned| planned.resource.row().grows_with_nodes()).map(|planned| planned.bytes).sum()
}

/// Checks that the device can hold a plan, before anything is allocated.
///
/// # Errors
/// The plan needs more memory than the device has, or the image is larger than the device can draw.
pub fn check_plan(context: &Context, plan: &[Planned], image: Option<[u32; 2]>) -> Result<(), GpuError> {
    let info = &context.info;
    let needed = plan.iter().map(|planned| planned.bytes).sum::<u64>();
    let available = context.free_memory();
    if needed > available {
        let of_images = plan.iter().filter(|planned| planned.resource.row().count.is_of_images());
        let images = of_images.map(|planned| planned.bytes).sum();
        return Err(GpuError::OutOfMemory { needed, images, device: info.name.clone(), available });
    }
    match image {
        Some([width, height]) if width.max(height) > info.max_framebuffer_side => {
            Err(GpuError::ImageTooLarge { width, height, device: info.name.clone(), limit: info.max_framebuffer_side })
        }
        _ => Ok(()),
    }
}

impl Resources {
    /// Makes and fills all resources of a scene.
    pub fn of_scene(context: &Arc<Context>, once: &mut Once, data: &SceneData<'_>) -> Result<Self, GpuError> {
        let plan = data.plan();
        check_plan(context, &plan, data.drawn())?;
        let mut resources = Self::new(context);
        for Planned { resource, bytes } in plan {
            let row = resource.row();
            if row.role.is_image() {
                let size = match &data.shadows {
                    Some(shadows) if row.count == Count::SunTexels => [shadows.redraw.resolution; 2],
                    _ if row.count == Count::DrawnTexels => {
                        data.drawn_singly().expect("images are planned where something is drawn")
                    }
                    _ => data.drawn().expect("images are planned where something is drawn"),
                };
                let mean = data.sampling.as_ref().and_then(|sampling| sampling.mean);
                let each = mean.filter(|_| row.count.is_multiple()).map_or(1, |mean| mean.each);
                resources.make_image(resource, size, each)?;
                continue;
            }
            let in_pieces = match row.pieces {
                Pieces::Never => false,
                Pieces::WithoutImage => data.image.is_none(),
                Pieces::WithoutNormals => {
                    let variant = data.shown.variant;
                    data.image.is_none() || !variant.needs_normals() || variant.crinkled
                }
                Pieces::Always => true,
            };
            for slot in 0..row.copies() {
                resources.make_in(resource, slot, bytes / row.copies() as u64, in_pieces)?;
            }
        }
        resources.fill(once, data)?;
        Ok(resources)
    }

    fn fill(&mut self, once: &mut Once, data: &SceneData<'_>) -> Result<(), GpuError> {
        let component = |values: &[Vec3], axis: usize| values.iter().map(|value| value[axis]).collect::<Vec<f32>>();
        self.upload(once, Resource::Materials, data.materials)?;
        self.upload(once, Resource::Shapes, &data.shapes.values)?;
        self.upload(once, Resource::Reflectors, data.shown.reflectors)?;
        self.upload(once, Resource::Emissivities, data.shown.emissivities)?;
        self.upload(once, Resource::PlanetMap, data.shown.planet_map)?;
        self.upload(once, Resource::TraceCorners, data.shown.traced)?;
        self.upload(once, Resource::GroupMaterial, data.group_material)?;
        self.upload(once, Resource::GroupPart, data.group_part)?;
        self.upload(once, Resource::Triangles, data.triangles)?;
        self.upload(once, Resource::Draws, &data.whole_draws())?;
        if let Some(shadows) = &data.shadows {
            self.upload(once, Resource::Occluders, shadows.occluders)?;
            if let Some(tree) = shadows.tree {
                self.upload_tree(once, tree)?;
            }
        }
        if let Some(network) = data.network {
            self.upload(once, Resource::OnePassNodes, &network.nodes)?;
            self.upload(once, Resource::OnePassRows, &network.rows)?;
            self.upload(once, Resource::OnePassLinks, &network.links)?;
            self.upload(once, Resource::OnePassSources, &network.sources)?;
            self.upload(once, Resource::OnePassUnits, &network.units)?;
            self.upload(once, Resource::OnePassWeights, &network.weights(&network.plan))?;
            self.upload(once, Resource::OnePassHeaters, &network.heater_words(&network.plan))?;
            // Estimates are added to it, and new memory may hold anything.
            self.upload(once, Resource::OnePassTold, &vec![[0.0f32; 4]; network.shape.estimated() as usize])?;
        }
        if let Some(ExchangeData { tables, .. }) = &data.exchange {
            let places = tables.count(Count::ExchangePatches);
            self.upload(once, Resource::ExchangeNodes, &tables.nodes)?;
            self.upload(once, Resource::ExchangePatches, &tables.patches)?;
            self.upload(once, Resource::ExchangeMembers, &tables.members)?;
            self.upload(once, Resource::ExchangeEntries, &tables.entries)?;
            self.upload(once, Resource::ExchangeSky, &tables.sky)?;
            self.upload(once, Resource::ExchangeSeen, &vec![[1.0f32; 2]; places])?;
            self.upload(once, Resource::ExchangeReflected, &vec![[0.0f32; 2]; places])?;
            self.upload(once, Resource::ExchangeSunlight, &vec![0.0f32; places])?;
            self.upload(once, Resource::ExchangeReceived, &vec![[0.0f32, 1.0]; places])?;
        }
        if let Some(heat) = data.heat {
            let areas: Vec<f32> = heat.areas.iter().map(|area| *area as f32).collect();
            self.upload(once, Resource::HeatRuns, &heat.words())?;
            self.upload(once, Resource::HeatAreas, &areas)?;
        }
        if let (Some(sampling), Some(image)) = (&data.sampling, data.image) {
            // Both do nothing where the image is not computed.
            self.write(Resource::Sampling, 0, &[sampling.sizes(image)])?;
            self.upload(once, Resource::LensMap, &sampling.map)?;
        }
        if let Some(sensor) = data.sensor.filter(|_| data.image.is_some()) {
            self.write(Resource::SensorKernel, 0, &sensor.kernel)?;
            self.upload(once, Resource::SensorVignetting, &sensor.vignetting)?;
            self.upload(once, Resource::SensorGuesses, &sensor.guesses)?;
            self.upload(once, Resource::SensorBolometer, &vec![0.0f32; 4 * sensor.count(Count::SensorBolometer)])?;
        }
        self.upload(once, Resource::BandTable, data.band_table)?;
        let crinkled = [Resource::CrinkledX, Resource::CrinkledY, Resource::CrinkledZ];
        for (axis, resource) in crinkled.into_iter().enumerate().filter(|_| !data.shown.crinkled.is_empty()) {
            self.upload(once, resource, &component(data.shown.crinkled, axis))?;
        }
        for (axis, resource) in [Resource::NormalX, Resource::NormalY, Resource::NormalZ].into_iter().enumerate() {
            self.upload(once, resource, &component(data.normals, axis))?;
        }
        for (axis, resource) in [Resource::PositionX, Resource::PositionY, Resource::PositionZ].into_iter().enumerate()
        {
            self.upload(once, resource, &component(data.positions, axis))?;
        }
        self.free_staging();
        Ok(())
    }

    /// Replaces the tree for shadow rays.
    pub(super) fn upload_tree(&mut self, once: &mut Once, tree: &Occluders) -> Result<(), GpuError> {
        let (boxes, triangles) = layout::shadow_tree(tree);
        self.upload(once, Resource::ShadowTree, &boxes)?;
        self.upload(once, Resource::ShadowTriangles, &triangles)
    }
}
