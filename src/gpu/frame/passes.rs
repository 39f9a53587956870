//! The passes of a scene's frame: their bindings and number of workgroups.

use ash::vk::{AccessFlags2 as A, ImageLayout, PipelineStageFlags2 as S};

use crate::gpu::pass::{
    Access, COMPUTE_READ, COMPUTE_UNIFORM, COMPUTE_WRITE, Kernel, Pass, Said, Scope, Work, access, scope,
};
use crate::gpu::radiance_variant::RadianceVariant;
use crate::gpu::resource::Resource;
use crate::gpu::resource_row::Role;
use crate::gpu::sampling::{RowOf, Sampled};
use crate::gpu::variant::{Curve, StepKind, ThermalVariant};
use crate::model::nodes::RANGE_GROUPS;

/// A range of nodes with one pipeline.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StepRange {
    /// Shader variant.
    pub variant: ThermalVariant,
    /// First group of four nodes and the one after the last.
    pub groups: (u32, u32),
    /// Joint of the nodes; 0 is the body.
    pub joint: u32,
}

/// A run of triangles whose nodes belong to one joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TriangleRun {
    /// The joint; 0 is the body.
    pub joint: u32,
    /// First triangle and the one after the last.
    pub triangles: (u32, u32),
}

/// Triangles of one draw, which one workgroup of `cull.comp` culls.
pub const TRIANGLES_A_DRAW: u32 = 2048;

/// Draw commands that are bound together. Their 1280 bytes are a multiple of every device's offset alignment.
const DRAWS_BOUND: u32 = 64;

/// Most triangles that one dispatch culls, so that the binding stays below 128 MiB.
const CULLED_AT_ONCE: u32 = 32 * DRAWS_BOUND * TRIANGLES_A_DRAW;

impl TriangleRun {
    /// First draw of the run and the one after the last. Each joint has one run, so two runs never share a draw.
    pub fn draws(self) -> (u32, u32) {
        let (first, end) = self.triangles;
        let before = DRAWS_BOUND * (first / (DRAWS_BOUND * TRIANGLES_A_DRAW) + self.joint);
        (before, before + (end - first).div_ceil(TRIANGLES_A_DRAW))
    }

    /// Splits the run into runs of one culling dispatch and one draw call each.
    pub fn pieces(self) -> impl Iterator<Item = Self> {
        let (first, end) = self.triangles;
        let piece = move |at: u32| (at, end.min(at.saturating_add(CULLED_AT_ONCE)));
        (first..end).step_by(CULLED_AT_ONCE as usize).map(move |at| Self { triangles: piece(at), ..self })
    }
}

/// Groups of four nodes of a workgroup in the shadow shaders.
const GROUPS_OF_RAYS: u32 = 16;

/// Access to a whole resource through a binding.
fn bound(binding: u32, resource: Resource, scope: Scope) -> Access {
    Access { binding: Some(binding), ..access(resource, scope) }
}

/// Access to a range of nodes, triangles or draws through a binding.
fn of_range(range: (u32, u32)) -> impl Fn(u32, Resource, Scope) -> Access {
    move |binding, resource, scope| Access { groups: Some(range), ..bound(binding, resource, scope) }
}

/// Dispatch over a range of groups, with `each` groups a workgroup.
fn over(kernel: Kernel, (first, end): (u32, u32), each: u32, said: Said) -> Work {
    Work::Dispatch { kernel, workgroups: (end - first).div_ceil(each), set: first, said }
}

/// The pass of `thermal_step.comp` over a range.
pub(super) fn thermal_pass(range: StepRange) -> Pass {
    let StepRange { variant, groups, joint } = range;
    let loaded = variant.sun || variant.planet_ir;
    let commands = variant.kind != StepKind::Advance;
    let moves = variant.kind.is_transition();
    let plate = matches!(variant.kind, StepKind::Radiative { .. });
    let full = variant.kind.has_full_state();
    let (step, sun_samples, albedo_values) = if variant.fused {
        (Resource::FusedSteps, Resource::FusedSunSamples, Resource::FusedAlbedoValues)
    } else {
        (Resource::Step, Resource::SunSamples, Resource::AlbedoValues)
    };
    let mut accesses = Vec::new();
    let mut bind = |present: bool, binding: u32, resource: Resource, scopes: &[Scope]| {
        if present {
            let row = resource.row();
            accesses.extend(scopes.iter().map(|scope| Access {
                groups: row.count.grows_with_nodes().then_some(groups),
                slice: if row.per_joint { joint } else { 0 },
                ..bound(binding, resource, *scope)
            }));
        }
    };
    bind(variant.planet_ir || variant.albedo || variant.kind != StepKind::Absorb, 0, step, &[COMPUTE_UNIFORM]);
    bind(variant.sun, 1, sun_samples, &[COMPUTE_UNIFORM]);
    bind(variant.albedo, 2, albedo_values, &[COMPUTE_READ]);
    bind(true, 3, Resource::Materials, &[COMPUTE_READ]);
    bind(true, 4, Resource::GroupMaterial, &[COMPUTE_READ]);
    bind(loaded, 5, Resource::NormalX, &[COMPUTE_READ]);
    bind(loaded, 6, Resource::NormalY, &[COMPUTE_READ]);
    bind(loaded, 7, Resource::NormalZ, &[COMPUTE_READ]);
    bind(full, 8, Resource::Target, if commands { &[COMPUTE_READ, COMPUTE_WRITE] } else { &[COMPUTE_READ] });
    bind(
        variant.kind.has_state(),
        9,
        Resource::Span,
        if commands || variant.curve != Curve::Power { &[COMPUTE_READ, COMPUTE_WRITE] } else { &[COMPUTE_READ] },
    );
    bind(full, 10, Resource::Elapsed, &[COMPUTE_READ, COMPUTE_WRITE]);
    bind(true, 11, Resource::Temperature, if plate { &[COMPUTE_READ, COMPUTE_WRITE] } else { &[COMPUTE_WRITE] });
    bind(variant.shadow, 13, Resource::Visibility, &[COMPUTE_READ]);
    bind(moves && variant.curve != Curve::Power, 12, Resource::Shapes, &[COMPUTE_READ]);
    bind(variant.exchange, 14, Resource::ExchangeNodes, &[COMPUTE_READ]);
    bind(variant.exchange, 15, Resource::ExchangeReceived, &[COMPUTE_READ]);
    bind(variant.exchange && (variant.planet_ir || variant.albedo), 16, Resource::ExchangeSeen, &[COMPUTE_READ]);
    let work = over(Kernel::Thermal(variant), groups, RANGE_GROUPS as u32, Said::Nothing);
    Pass { name: variant.shader().name(), work, accesses }
}

/// Positions and normals of a range, at bindings from 1.
fn surface(groups: (u32, u32)) -> Vec<Access> {
    use Resource as R;
    let components = [R::PositionX, R::PositionY, R::PositionZ, R::NormalX, R::NormalY, R::NormalZ];
    let of_nodes = of_range(groups);
    (1..).zip(components).map(|(binding, component)| of_nodes(binding, component, COMPUTE_READ)).collect()
}

/// Positions of all nodes, at bindings from 1.
fn places(scope: Scope) -> [Access; 3] {
    let components = [(1, Resource::PositionX), (2, Resource::PositionY), (3, Resource::PositionZ)];
    components.map(|(binding, component)| bound(binding, component, scope))
}

pub(super) fn ray_pass(ray: u32, joint: u32, groups: (u32, u32)) -> Pass {
    let mut accesses = surface(groups);
    accesses.extend([
        bound(7, Resource::ShadowTree, COMPUTE_READ),
        of_range(groups)(8, Resource::Visibility, COMPUTE_WRITE),
        bound(9, Resource::ShadowTriangles, COMPUTE_READ),
    ]);
    if ray > 0 {
        accesses.push(of_range(groups)(8, Resource::Visibility, COMPUTE_READ));
    }
    let work = over(Kernel::SunRay { first: ray == 0 }, groups, GROUPS_OF_RAYS, Said::Ray(ray, joint));
    Pass { name: "solar_rays".to_owned(), work, accesses }
}

/// Depth write.
pub(super) const DEPTH_WRITE: Scope = scope(
    S::from_raw(S::EARLY_FRAGMENT_TESTS.as_raw() | S::LATE_FRAGMENT_TESTS.as_raw()),
    A::DEPTH_STENCIL_ATTACHMENT_WRITE,
);

/// Depth test and write.
pub(super) const DEPTH: Scope = scope(
    DEPTH_WRITE.stage,
    A::from_raw(A::DEPTH_STENCIL_ATTACHMENT_READ.as_raw() | A::DEPTH_STENCIL_ATTACHMENT_WRITE.as_raw()),
);

/// Access to a render target.
fn drawn(resource: Resource, scope: Scope) -> Access {
    Access { layout: ImageLayout::ATTACHMENT_OPTIMAL, ..access(resource, scope) }
}

pub(super) fn solar_depth_pass() -> Pass {
    let mut accesses = vec![
        access(Resource::Occluders, scope(S::INDEX_INPUT, A::INDEX_READ)),
        bound(0, Resource::SunView, scope(S::VERTEX_SHADER, A::UNIFORM_READ)),
    ];
    accesses.extend(places(scope(S::VERTEX_SHADER, A::SHADER_STORAGE_READ)));
    accesses.push(drawn(Resource::SunDepthImage, DEPTH));
    Pass { name: "solar_depth".to_owned(), work: Work::Draw(Kernel::SunDepth), accesses }
}

pub(super) fn visibility_pass(range: &StepRange) -> Pass {
    let mut accesses = vec![Access { slice: range.joint, ..bound(0, Resource::SunView, COMPUTE_UNIFORM) }];
    accesses.extend(surface(range.groups));
    accesses.push(bound(7, Resource::SunDepth, COMPUTE_READ));
    accesses.push(of_range(range.groups)(8, Resource::Visibility, COMPUTE_WRITE));
    let work = over(Kernel::Visibility, range.groups, RANGE_GROUPS as u32, Said::Nothing);
    Pass { name: "solar_visibility".to_owned(), work, accesses }
}

pub(super) fn between_pass(range: &StepRange) -> Pass {
    let of_nodes = of_range(range.groups);
    let accesses = vec![
        of_nodes(0, Resource::EarlierTemperature, COMPUTE_READ),
        of_nodes(1, Resource::Temperature, COMPUTE_READ),
        of_nodes(2, Resource::BetweenTemperature, COMPUTE_WRITE),
    ];
    let work = over(Kernel::Between, range.groups, RANGE_GROUPS as u32, Said::Share);
    Pass { name: "between".to_owned(), work, accesses }
}

/// Culls for a kernel: of pixel centres or of all samples.
pub(super) fn cull_pass(run: TriangleRun, kernel: Kernel) -> Pass {
    let TriangleRun { joint, triangles } = run;
    let mut accesses = vec![Access { slice: joint, ..bound(0, Resource::View, COMPUTE_UNIFORM) }];
    accesses.extend(places(COMPUTE_READ));
    accesses.extend([
        of_range(triangles)(4, Resource::Triangles, COMPUTE_READ),
        of_range(triangles)(5, Resource::VisibleTriangles, COMPUTE_WRITE),
        of_range(run.draws())(6, Resource::Draws, COMPUTE_WRITE),
    ]);
    if let Kernel::CullSamples { shutter: Some(_), .. } = kernel {
        accesses.push(Access { slice: joint, ..bound(7, Resource::Shutter, COMPUTE_UNIFORM) });
    }
    let work = over(kernel, triangles, TRIANGLES_A_DRAW, Said::Triangle(triangles.0));
    Pass { name: "cull".to_owned(), work, accesses }
}

/// Draws the temperatures in a buffer with one sample of a pixel. With a rolling shutter it shows no surroundings.
pub(super) fn radiance_pass(shows: RadianceVariant, shutter: Option<RowOf>, temperature: Resource) -> Pass {
    let kernel = shutter.map_or(Kernel::Radiance(shows), Kernel::RadianceOfRows);
    let images = [&[Resource::RadianceImage, Resource::IdentityImage], surfaces(kernel), &[Resource::DepthImage]];
    draw_pass("radiance", kernel, temperature, &images.concat())
}

/// Draws the mean over several samples. With several of a texel, they are averaged at its end.
pub(super) fn mean_pass(shows: RadianceVariant, each: u32, shutter: Option<RowOf>, temperature: Resource) -> Pass {
    let multiple: &[Resource] = if each > 1 { &[Resource::MultiImage] } else { &[] };
    let kernel = match shutter {
        None => Kernel::Mean { each, shows },
        Some(row_of) => Kernel::MeanOfRows { each, row_of },
    };
    let images = [multiple, &[Resource::MeanImage], surfaces(kernel), &[Resource::MeanDepthImage]];
    draw_pass("mean", kernel, temperature, &images.concat())
}

/// The image of surfaces, where a kernel draws them.
fn surfaces(kernel: Kernel) -> &'static [Resource] {
    if kernel.target().is_some_and(|target| target.surfaces) { &[Resource::SurfaceImage] } else { &[] }
}

/// Most texels of a dispatch of rays, few enough that no driver stops it as hanging.
const LIT_AT_ONCE: u32 = 1 << 20;

/// Texels of a workgroup of these rays.
const TEXELS_OF_RAYS: u32 = 64;

/// Adds what surfaces reflect of the craft itself to the radiance of `texels` texels in a buffer, which is `Mean` or `DrawnRadiance`.
pub(super) fn traced_passes(shows: RadianceVariant, lit: Resource, texels: u32, temperature: Resource) -> Vec<Pass> {
    let mut shared = vec![
        bound(0, Resource::View, COMPUTE_UNIFORM),
        bound(1, Resource::Surface, COMPUTE_READ),
        bound(4, temperature, COMPUTE_READ),
        bound(7, Resource::Reflectors, COMPUTE_READ),
        bound(8, Resource::BandTable, COMPUTE_READ),
        bound(12, Resource::Surroundings, COMPUTE_UNIFORM),
        bound(19, Resource::Tracing, COMPUTE_UNIFORM),
        bound(20, Resource::TraceBoxes, COMPUTE_READ),
        bound(21, Resource::TraceTriangles, COMPUTE_READ),
        bound(22, Resource::TraceCorners, COMPUTE_READ),
    ];
    shared.extend(shows.rough.then(|| bound(13, Resource::Lobes, COMPUTE_READ)));
    shared.extend(shows.tables.then(|| bound(15, Resource::Emissivities, COMPUTE_READ)));
    if shows.map {
        shared.extend([
            bound(16, Resource::PlanetView, COMPUTE_UNIFORM),
            bound(17, Resource::PlanetMap, COMPUTE_READ),
            bound(18, Resource::PlanetMeans, COMPUTE_READ),
        ]);
    }
    let kernel = Kernel::Traced { shows, several: lit == Resource::Mean };
    let piece = |first: u32| {
        let range = (first, texels.min(first.saturating_add(LIT_AT_ONCE)));
        let mut accesses = shared.clone();
        accesses.extend([COMPUTE_READ, COMPUTE_WRITE].map(|scope| of_range(range)(2, lit, scope)));
        Pass { name: "traced".to_owned(), work: over(kernel, range, TEXELS_OF_RAYS, Said::Texel(first)), accesses }
    };
    (0..texels.max(1)).step_by(LIT_AT_ONCE as usize).map(piece).collect()
}

/// Computes the image from drawn ones.
pub(super) fn resample_pass(sampled: Sampled) -> Pass {
    let mut accesses = vec![
        bound(0, Resource::Sampling, COMPUTE_UNIFORM),
        bound(1, Resource::DrawnRadiance, COMPUTE_READ),
        bound(2, Resource::DrawnIdentity, COMPUTE_READ),
        bound(3, Resource::ImageRadiance, COMPUTE_WRITE),
        bound(4, Resource::ImageIdentity, COMPUTE_WRITE),
    ];
    accesses.extend(sampled.lens.then(|| bound(5, Resource::LensMap, COMPUTE_READ)));
    accesses.extend(sampled.mean.map(|_| bound(6, Resource::Mean, COMPUTE_READ)));
    let kernel = Kernel::Resample { lens: sampled.lens, several: sampled.mean.is_some() };
    let work = Work::Dispatch { kernel, workgroups: sampled.rows, set: 0, said: Said::Nothing };
    Pass { name: "resample".to_owned(), work, accesses }
}

/// Computes the image of a craft that is far away from a crop around it.
pub(super) fn distant_pass(sampled: Sampled, shows: RadianceVariant) -> Pass {
    let mut accesses = vec![
        bound(0, Resource::Distant, COMPUTE_UNIFORM),
        bound(1, Resource::DrawnRadiance, COMPUTE_READ),
        bound(2, Resource::DrawnIdentity, COMPUTE_READ),
        bound(3, Resource::ImageRadiance, COMPUTE_WRITE),
        bound(4, Resource::ImageIdentity, COMPUTE_WRITE),
    ];
    if shows.background {
        accesses.push(bound(12, Resource::Surroundings, COMPUTE_UNIFORM));
    }
    if shows.background && shows.map {
        accesses.push(bound(16, Resource::PlanetView, COMPUTE_UNIFORM));
        accesses.push(bound(17, Resource::PlanetMap, COMPUTE_READ));
    }
    let work = Work::Dispatch { kernel: Kernel::Distant(shows), workgroups: sampled.rows, set: 0, said: Said::Nothing };
    Pass { name: "distant".to_owned(), work, accesses }
}

/// Draws the triangles that culling kept into images, the last of which is the depth buffer, and the sky behind them.
fn draw_pass(name: &str, kernel: Kernel, temperature: Resource, images: &[Resource]) -> Pass {
    let shows = match kernel {
        Kernel::Radiance(shows) | Kernel::Mean { shows, .. } => shows,
        _ => RadianceVariant::PLAIN,
    };
    let vertex = scope(S::VERTEX_SHADER, A::SHADER_STORAGE_READ);
    let fragment = scope(S::FRAGMENT_SHADER, A::SHADER_STORAGE_READ);
    let colour = scope(S::COLOR_ATTACHMENT_OUTPUT, A::COLOR_ATTACHMENT_WRITE);
    let uniform = |stage| scope(stage, A::UNIFORM_READ);
    let mut accesses = vec![
        access(Resource::VisibleTriangles, scope(S::INDEX_INPUT, A::INDEX_READ)),
        access(Resource::Draws, scope(S::DRAW_INDIRECT, A::INDIRECT_COMMAND_READ)),
        bound(0, Resource::View, uniform(S::VERTEX_SHADER)),
    ];
    accesses.extend(places(vertex));
    accesses.extend([
        bound(4, temperature, vertex),
        bound(5, Resource::GroupMaterial, vertex),
        bound(6, Resource::GroupPart, vertex),
        bound(7, if shows.needs_normals() { Resource::Reflectors } else { Resource::Materials }, fragment),
        bound(8, Resource::BandTable, fragment),
    ]);
    if shows.needs_normals() {
        let normals = match shows.crinkled {
            false => [Resource::NormalX, Resource::NormalY, Resource::NormalZ],
            true => [Resource::CrinkledX, Resource::CrinkledY, Resource::CrinkledZ],
        };
        accesses.extend((9..).zip(normals).map(|(binding, component)| bound(binding, component, vertex)));
    }
    if shows.background {
        accesses.push(bound(0, Resource::View, uniform(S::FRAGMENT_SHADER)));
    }
    if shows.sees_surroundings() {
        accesses.push(bound(12, Resource::Surroundings, uniform(S::FRAGMENT_SHADER)));
    }
    if shows.rough {
        accesses.push(bound(13, Resource::Lobes, fragment));
    }
    if shows.tables {
        accesses.push(bound(15, Resource::Emissivities, fragment));
    }
    if shows.map {
        accesses.push(bound(16, Resource::PlanetView, uniform(S::FRAGMENT_SHADER)));
        if shows.smooth || shows.background {
            accesses.push(bound(17, Resource::PlanetMap, fragment));
        }
        if shows.reflections {
            accesses.push(bound(18, Resource::PlanetMeans, fragment));
        }
    }
    if let Kernel::RadianceOfRows(_) | Kernel::MeanOfRows { .. } = kernel {
        accesses.push(bound(14, Resource::Shutter, uniform(S::VERTEX_SHADER)));
    }
    let is_depth = |image: Resource| image.row().role == Role::Depth;
    accesses.extend(images.iter().map(|image| drawn(*image, if is_depth(*image) { DEPTH } else { colour })));
    Pass { name: name.to_owned(), work: Work::Draw(kernel), accesses }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Also covers joints without triangles, and a run of several dispatches.
    #[test]
    fn no_two_runs_of_a_scene_share_a_draw() {
        let (mut start, mut free) = (0, 0);
        for (joint, count) in [(0, 5_000_000), (1, 1), (2, 130_000), (5, 64), (6, 9_000_000)] {
            let run = TriangleRun { joint, triangles: (start, start + count) };
            let pieces: Vec<TriangleRun> = run.pieces().collect();
            assert_eq!(pieces[0].triangles.0, start);
            assert_eq!(pieces.iter().map(|piece| piece.triangles.1 - piece.triangles.0).sum::<u32>(), count);
            for (first, end) in pieces.into_iter().map(TriangleRun::draws) {
                assert!(first >= free && first % DRAWS_BOUND == 0, "joint {joint}: {first} after {free}");
                free = end;
            }
            start += count.next_multiple_of(64);
        }
    }
}
