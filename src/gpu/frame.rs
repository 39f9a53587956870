//! The frame as data: a list of passes and hand-written barriers, built once per scene.
//!
//! From this list come the recorded commands, the debug labels, the timestamps, the description that `isotherm info`
//! prints, and the hazard check. Read [`Frame::step`] and [`Frame::settle`] from top to bottom.

use ash::vk::{AccessFlags2 as A, ImageLayout, PipelineStageFlags2 as S};

use crate::environment::shadow::{Method, SUN_RAYS};

use super::pass::{
    Access, CLEAR_WRITE, COMPUTE_READ, COMPUTE_UNIFORM, COMPUTE_WRITE, COPY_READ, COPY_WRITE, Pass, Resource, Scope,
    Step, Work, access, barrier, clear_pass, copy_pass, is_write, scope, to_host, transition,
};
use super::variant::{Curve, StepKind, ThermalVariant};

/// A run of nodes that one pipeline moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StepRange {
    /// Compiled variant.
    pub variant: ThermalVariant,
    /// Groups of four nodes: first, and the one after the last.
    pub groups: (u32, u32),
    /// The joint that moves them; 0 is the body.
    pub joint: u32,
}

/// A run of triangles whose nodes hang on one joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TriangleRun {
    /// The joint; 0 is the body.
    pub joint: u32,
    /// First triangle, and the one after the last.
    pub triangles: (u32, u32),
}

/// Triangles of one draw: those that a workgroup of `cull.comp` looks at.
pub const TRIANGLES_A_DRAW: u32 = 2048;

/// Draws whose commands are bound together: 1280 bytes, a multiple of every device's alignment.
const DRAWS_BOUND: u32 = 64;

/// Triangles that one dispatch culls at most: less than the 128 MiB that a device binds at once.
const CULLED_AT_ONCE: u32 = 32 * DRAWS_BOUND * TRIANGLES_A_DRAW;

impl TriangleRun {
    /// Its draws: first, and the one after the last. No two runs of a scene share one, since they follow each other and each
    /// joint has one run.
    pub fn draws(self) -> (u32, u32) {
        let (first, end) = self.triangles;
        let before = DRAWS_BOUND * (first / (DRAWS_BOUND * TRIANGLES_A_DRAW) + self.joint);
        (before, before + (end - first).div_ceil(TRIANGLES_A_DRAW))
    }

    /// The runs that one dispatch culls, and one call draws, each.
    pub fn pieces(self) -> impl Iterator<Item = Self> {
        let (first, end) = self.triangles;
        let piece = move |at: u32| (at, end.min(at.saturating_add(CULLED_AT_ONCE)));
        (first..end).step_by(CULLED_AT_ONCE as usize).map(move |at| Self { triangles: piece(at), ..self })
    }
}

/// Groups of four nodes that one dispatch of rays takes: 65,535 workgroups of 64 nodes, and whole workgroups of groups.
const TRACED_AT_ONCE: u32 = 65_535 / 4 * 64;

/// What a tick leaves for the host.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Wanted {
    /// An image.
    pub image: bool,
    /// Triangles to be culled for it; 0 where the camera has not moved against the craft since the last image.
    pub cull: u32,
    /// The temperatures of all nodes.
    pub temperatures: bool,
}

/// The list of one kind of frame.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Frame {
    /// Passes and barriers in the order of the queue.
    pub steps: Vec<Step>,
}

impl Frame {
    /// One tick: every range is stepped, then drawn and read back as wanted.
    pub fn step(ranges: &[StepRange], wanted: Wanted) -> Self {
        Self::step_in_runs(ranges, wanted, &[TriangleRun { joint: 0, triangles: (0, wanted.cull) }])
    }

    /// The same of a craft with joints, of whose triangles those in `culled` have moved against the camera.
    pub fn step_in_runs(ranges: &[StepRange], wanted: Wanted, culled: &[TriangleRun]) -> Self {
        let mut steps = Vec::new();

        if !ranges.is_empty() {
            // The last frame may still write the state, or read the temperatures that this one is about to replace.
            let readers = scope(S::COMPUTE_SHADER | S::VERTEX_SHADER | S::COPY, A::SHADER_STORAGE_WRITE);
            let state_writers =
                scope(S::COMPUTE_SHADER | S::COPY | S::CLEAR, A::SHADER_STORAGE_WRITE | A::TRANSFER_WRITE);
            let compute = scope(S::COMPUTE_SHADER, A::SHADER_STORAGE_READ | A::SHADER_STORAGE_WRITE);
            let mut barriers = vec![barrier(Resource::Temperature, readers, compute)];
            if has_state(ranges) {
                barriers.push(barrier(Resource::Target, state_writers, compute));
                barriers.push(barrier(Resource::Span, state_writers, compute));
                barriers.push(barrier(Resource::Elapsed, state_writers, compute));
            }
            steps.push(Step::Barriers(barriers));
            steps.extend(ranges.iter().map(|range| Step::Pass(thermal_pass(*range))));
        }
        if wanted.image && wanted.cull > 0 {
            // The last image may still read its triangles and draws.
            let indices = scope(S::INDEX_INPUT | S::COMPUTE_SHADER, A::SHADER_STORAGE_WRITE);
            let commands = scope(S::DRAW_INDIRECT | S::COMPUTE_SHADER, A::SHADER_STORAGE_WRITE);
            steps.push(Step::Barriers(vec![
                barrier(Resource::VisibleTriangles, indices, COMPUTE_WRITE),
                barrier(Resource::Draws, commands, COMPUTE_WRITE),
            ]));
            steps.extend(culled.iter().flat_map(|run| run.pieces()).map(|run| Step::Pass(cull_pass(run))));
            steps.push(Step::Barriers(vec![
                barrier(Resource::VisibleTriangles, COMPUTE_WRITE, scope(S::INDEX_INPUT, A::INDEX_READ)),
                barrier(Resource::Draws, COMPUTE_WRITE, scope(S::DRAW_INDIRECT, A::INDIRECT_COMMAND_READ)),
            ]));
        }
        if wanted.image {
            let vertex_read = scope(S::VERTEX_SHADER, A::SHADER_STORAGE_READ);
            let colour = scope(S::COLOR_ATTACHMENT_OUTPUT, A::COLOR_ATTACHMENT_WRITE);
            let depth_stages = S::EARLY_FRAGMENT_TESTS | S::LATE_FRAGMENT_TESTS;
            let depth_write = scope(depth_stages, A::DEPTH_STENCIL_ATTACHMENT_WRITE);
            let depth = scope(depth_stages, A::DEPTH_STENCIL_ATTACHMENT_READ | A::DEPTH_STENCIL_ATTACHMENT_WRITE);
            let copied = scope(S::COPY, A::NONE);
            let (undefined, attachment) = (ImageLayout::UNDEFINED, ImageLayout::ATTACHMENT_OPTIMAL);
            let source = ImageLayout::TRANSFER_SRC_OPTIMAL;
            steps.push(Step::Barriers(vec![
                barrier(Resource::Temperature, COMPUTE_WRITE, vertex_read),
                transition(Resource::RadianceImage, copied, colour, undefined, attachment),
                transition(Resource::IdentityImage, copied, colour, undefined, attachment),
                transition(Resource::DepthImage, depth_write, depth, undefined, attachment),
            ]));
            steps.push(Step::Pass(radiance_pass()));
            steps.push(Step::Barriers(vec![
                transition(Resource::RadianceImage, colour, COPY_READ, attachment, source),
                transition(Resource::IdentityImage, colour, COPY_READ, attachment, source),
            ]));
            steps.push(Step::Pass(copy_pass("read radiance", Resource::RadianceImage, Resource::RadianceReadback)));
            steps.push(Step::Pass(copy_pass("read identity", Resource::IdentityImage, Resource::IdentityReadback)));
            steps.push(Step::Barriers(vec![to_host(Resource::RadianceReadback), to_host(Resource::IdentityReadback)]));
        }
        if wanted.temperatures {
            steps.push(Step::Barriers(vec![barrier(Resource::Temperature, COMPUTE_WRITE, COPY_READ)]));
            steps.push(Step::Pass(copy_pass(
                "read temperatures",
                Resource::Temperature,
                Resource::TemperatureReadback,
            )));
            steps.push(Step::Barriers(vec![to_host(Resource::TemperatureReadback)]));
        }
        Self { steps }
    }

    /// The start: every node settled at the balance temperature of the load in place.
    pub fn settle(ranges: &[StepRange]) -> Self {
        let instant: Vec<StepRange> =
            ranges.iter().map(|range| StepRange { variant: range.variant.settling(), ..*range }).collect();
        let mut frame = Self::step(&instant, Wanted::default());
        for step in &mut frame.steps {
            if let Step::Pass(pass) = step {
                pass.name = format!("settle {}", pass.name);
            }
        }
        if has_state(ranges) {
            // A run may be started anew, so the steps of the last one come before.
            let stepped = scope(S::COMPUTE_SHADER | S::COPY | S::CLEAR, A::SHADER_STORAGE_WRITE | A::TRANSFER_WRITE);
            frame.steps.push(Step::Barriers(vec![
                barrier(Resource::Temperature, COMPUTE_WRITE, COPY_READ),
                barrier(Resource::Target, stepped, COPY_WRITE),
                barrier(Resource::Span, stepped, CLEAR_WRITE),
                barrier(Resource::Elapsed, stepped, CLEAR_WRITE),
            ]));
            frame.steps.push(Step::Pass(copy_pass("settle target", Resource::Temperature, Resource::Target)));
            frame.steps.push(Step::Pass(clear_pass("settle span", Resource::Span)));
            frame.steps.push(Step::Pass(clear_pass("settle elapsed", Resource::Elapsed)));
        }
        frame
    }

    /// Before a tick in which the Sun has moved against the craft: the share of it that every node of the ranges with
    /// shadows sees. Empty where none has.
    pub fn shadows(ranges: &[StepRange], method: Method) -> Self {
        let shadowed: Vec<StepRange> = ranges.iter().copied().filter(|range| range.variant.shadow).collect();
        let mut steps = Vec::new();
        if !shadowed.is_empty() {
            match method {
                Method::Depth => steps.extend(shadows_by_depth(&shadowed)),
                Method::Exact => steps.extend(shadows_by_rays(&shadowed)),
            }
            steps.push(Step::Barriers(vec![barrier(Resource::Visibility, COMPUTE_WRITE, COMPUTE_READ)]));
        }
        Self { steps }
    }

    /// One list after another in the same command buffer.
    pub fn then(mut self, next: Self) -> Self {
        self.steps.extend(next.steps);
        self
    }

    /// The passes in order.
    pub fn passes(&self) -> impl Iterator<Item = &Pass> {
        self.steps.iter().filter_map(|step| match step {
            Step::Pass(pass) => Some(pass),
            Step::Barriers(_) => None,
        })
    }

    /// Number of barriers.
    pub fn barrier_count(&self) -> usize {
        self.steps.iter().map(|step| if let Step::Barriers(barriers) = step { barriers.len() } else { 0 }).sum()
    }

    /// The same list without its n-th barrier: what the hazard check and the validation layer must complain about.
    pub fn without_barrier(&self, n: usize) -> Self {
        let mut left = n;
        let mut frame = self.clone();
        for step in &mut frame.steps {
            if let Step::Barriers(barriers) = step {
                if left < barriers.len() {
                    barriers.remove(left);
                    break;
                }
                left -= barriers.len();
            }
        }
        frame
    }
}

impl std::fmt::Display for Frame {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        for step in &self.steps {
            match step {
                Step::Pass(pass) => {
                    let touched = |write: bool| {
                        let names: Vec<String> = pass
                            .accesses
                            .iter()
                            .filter(|access| is_write(access.scope.access) == write)
                            .map(|access| format!("{:?}", access.resource))
                            .collect();
                        if names.is_empty() { "nothing".to_owned() } else { names.join(" ") }
                    };
                    writeln!(out, "{}", pass.name)?;
                    writeln!(out, "    reads  {}", touched(false))?;
                    writeln!(out, "    writes {}", touched(true))?;
                }
                Step::Barriers(barriers) => {
                    for barrier in barriers {
                        writeln!(
                            out,
                            "  barrier {:?}: {:?} -> {:?}",
                            barrier.resource, barrier.before.stage, barrier.after.stage
                        )?;
                    }
                }
            }
        }
        Ok(())
    }
}

/// Whether any node of the ranges keeps a state between ticks.
fn has_state(ranges: &[StepRange]) -> bool {
    ranges.iter().any(|range| range.variant.kind.has_state())
}

/// Shader bindings of a variant of `thermal_step.comp`.
fn thermal_pass(range: StepRange) -> Pass {
    let StepRange { variant, groups, joint } = range;
    let loaded = variant.sun || variant.planet_ir;
    let commands = variant.kind != StepKind::Advance;
    let moves = variant.kind.has_state();
    let (tick, sun_samples, albedo_values) = if variant.fused {
        (Resource::FusedTicks, Resource::FusedSunSamples, Resource::FusedAlbedoValues)
    } else {
        (Resource::Tick, Resource::SunSamples, Resource::AlbedoValues)
    };
    let mut accesses = Vec::new();
    let mut bind = |present: bool, binding: u32, resource: Resource, scopes: &[Scope]| {
        if present {
            let by_host = resource.per_slot();
            let by_group = !by_host && !matches!(resource, Resource::Materials | Resource::Shapes);
            accesses.extend(scopes.iter().map(|scope| Access {
                groups: by_group.then_some(groups),
                slice: if resource.per_joint() { joint } else { 0 },
                binding: Some(binding),
                ..access(resource, *scope)
            }));
        }
    };
    bind(variant.planet_ir || variant.albedo || variant.kind != StepKind::Absorb, 0, tick, &[COMPUTE_UNIFORM]);
    bind(variant.sun, 1, sun_samples, &[COMPUTE_UNIFORM]);
    bind(variant.albedo, 2, albedo_values, &[COMPUTE_READ]);
    bind(true, 3, Resource::Materials, &[COMPUTE_READ]);
    bind(true, 4, Resource::GroupMaterial, &[COMPUTE_READ]);
    bind(loaded, 5, Resource::NormalX, &[COMPUTE_READ]);
    bind(loaded, 6, Resource::NormalY, &[COMPUTE_READ]);
    bind(loaded, 7, Resource::NormalZ, &[COMPUTE_READ]);
    bind(moves, 8, Resource::Target, if commands { &[COMPUTE_READ, COMPUTE_WRITE] } else { &[COMPUTE_READ] });
    bind(moves, 9, Resource::Span, if commands { &[COMPUTE_READ, COMPUTE_WRITE] } else { &[COMPUTE_READ] });
    bind(moves, 10, Resource::Elapsed, &[COMPUTE_READ, COMPUTE_WRITE]);
    bind(true, 11, Resource::Temperature, &[COMPUTE_WRITE]);
    bind(variant.shadow, 13, Resource::Visibility, &[COMPUTE_READ]);
    bind(moves && variant.curve != Curve::Power, 12, Resource::Shapes, &[COMPUTE_READ]);
    Pass { name: variant.name(), work: Work::Thermal { variant, groups }, accesses }
}

/// What the Sun sees, drawn, copied to where shaders read it, and looked up for every node.
fn shadows_by_depth(ranges: &[StepRange]) -> Vec<Step> {
    let depth_stages = S::EARLY_FRAGMENT_TESTS | S::LATE_FRAGMENT_TESTS;
    let depth = scope(depth_stages, A::DEPTH_STENCIL_ATTACHMENT_READ | A::DEPTH_STENCIL_ATTACHMENT_WRITE);
    let depth_write = scope(depth_stages, A::DEPTH_STENCIL_ATTACHMENT_WRITE);
    let (undefined, attachment) = (ImageLayout::UNDEFINED, ImageLayout::ATTACHMENT_OPTIMAL);
    let source = ImageLayout::TRANSFER_SRC_OPTIMAL;
    let copied = scope(S::COPY, A::NONE);
    let read = scope(S::COMPUTE_SHADER, A::NONE);
    let mut steps = vec![
        // The last copy must be over before the image is drawn anew.
        Step::Barriers(vec![transition(Resource::SunDepthImage, copied, depth, undefined, attachment)]),
        Step::Pass(solar_depth_pass()),
        Step::Barriers(vec![
            transition(Resource::SunDepthImage, depth_write, COPY_READ, attachment, source),
            barrier(Resource::SunDepth, read, COPY_WRITE),
        ]),
        Step::Pass(copy_pass("read solar_depth", Resource::SunDepthImage, Resource::SunDepth)),
        Step::Barriers(vec![
            barrier(Resource::SunDepth, COPY_WRITE, COMPUTE_READ),
            barrier(Resource::Visibility, COMPUTE_WRITE, COMPUTE_WRITE),
        ]),
    ];
    steps.extend(ranges.iter().map(|range| Step::Pass(visibility_pass(range))));
    steps
}

/// Every point of the Sun's disc in turn, each added to the last.
fn shadows_by_rays(ranges: &[StepRange]) -> Vec<Step> {
    let both = scope(S::COMPUTE_SHADER, A::SHADER_STORAGE_READ | A::SHADER_STORAGE_WRITE);
    let mut steps = Vec::new();
    for ray in 0..SUN_RAYS as u32 {
        let after = if ray == 0 { COMPUTE_WRITE } else { both };
        steps.push(Step::Barriers(vec![barrier(Resource::Visibility, COMPUTE_WRITE, after)]));
        for StepRange { groups: (first, end), joint, .. } in ranges {
            let pieces = (*first..*end).step_by(TRACED_AT_ONCE as usize);
            let piece = |at: u32| (at, end.to_owned().min(at.saturating_add(TRACED_AT_ONCE)));
            steps.extend(pieces.map(|at| Step::Pass(ray_pass(ray, *joint, piece(at)))));
        }
    }
    steps
}

fn ray_pass(ray: u32, joint: u32, groups: (u32, u32)) -> Pass {
    let of_nodes =
        |binding, resource, scope| Access { binding: Some(binding), groups: Some(groups), ..access(resource, scope) };
    let bound = |binding, resource| Access { binding: Some(binding), ..access(resource, COMPUTE_READ) };
    let mut accesses = vec![
        of_nodes(1, Resource::PositionX, COMPUTE_READ),
        of_nodes(2, Resource::PositionY, COMPUTE_READ),
        of_nodes(3, Resource::PositionZ, COMPUTE_READ),
        of_nodes(4, Resource::NormalX, COMPUTE_READ),
        of_nodes(5, Resource::NormalY, COMPUTE_READ),
        of_nodes(6, Resource::NormalZ, COMPUTE_READ),
        bound(7, Resource::ShadowTree),
        of_nodes(8, Resource::Visibility, COMPUTE_WRITE),
        bound(9, Resource::ShadowTriangles),
    ];
    if ray > 0 {
        accesses.push(of_nodes(8, Resource::Visibility, COMPUTE_READ));
    }
    Pass { name: "solar_rays".to_owned(), work: Work::SunRay { ray, joint, groups }, accesses }
}

fn solar_depth_pass() -> Pass {
    let vertex = scope(S::VERTEX_SHADER, A::SHADER_STORAGE_READ);
    let depth = scope(
        S::EARLY_FRAGMENT_TESTS | S::LATE_FRAGMENT_TESTS,
        A::DEPTH_STENCIL_ATTACHMENT_READ | A::DEPTH_STENCIL_ATTACHMENT_WRITE,
    );
    let bound = |binding, resource, scope| Access { binding: Some(binding), ..access(resource, scope) };
    Pass {
        name: "solar_depth".to_owned(),
        work: Work::SunDepth,
        accesses: vec![
            access(Resource::Occluders, scope(S::INDEX_INPUT, A::INDEX_READ)),
            bound(0, Resource::SunView, scope(S::VERTEX_SHADER, A::UNIFORM_READ)),
            bound(1, Resource::PositionX, vertex),
            bound(2, Resource::PositionY, vertex),
            bound(3, Resource::PositionZ, vertex),
            Access { layout: ImageLayout::ATTACHMENT_OPTIMAL, ..access(Resource::SunDepthImage, depth) },
        ],
    }
}

fn visibility_pass(range: &StepRange) -> Pass {
    let (groups, joint) = (range.groups, range.joint);
    let of_nodes =
        |binding, resource, scope| Access { binding: Some(binding), groups: Some(groups), ..access(resource, scope) };
    let bound = |binding, resource, scope| Access { binding: Some(binding), ..access(resource, scope) };
    Pass {
        name: "solar_visibility".to_owned(),
        work: Work::Visibility { groups },
        accesses: vec![
            Access { slice: joint, ..bound(0, Resource::SunView, COMPUTE_UNIFORM) },
            of_nodes(1, Resource::PositionX, COMPUTE_READ),
            of_nodes(2, Resource::PositionY, COMPUTE_READ),
            of_nodes(3, Resource::PositionZ, COMPUTE_READ),
            of_nodes(4, Resource::NormalX, COMPUTE_READ),
            of_nodes(5, Resource::NormalY, COMPUTE_READ),
            of_nodes(6, Resource::NormalZ, COMPUTE_READ),
            bound(7, Resource::SunDepth, COMPUTE_READ),
            of_nodes(8, Resource::Visibility, COMPUTE_WRITE),
        ],
    }
}

fn cull_pass(run: TriangleRun) -> Pass {
    let TriangleRun { joint, triangles } = run;
    let of_triangles = |binding, resource, scope| Access {
        binding: Some(binding),
        groups: Some(triangles),
        ..access(resource, scope)
    };
    let bound = |binding, resource, scope| Access { binding: Some(binding), ..access(resource, scope) };
    Pass {
        name: "cull".to_owned(),
        work: Work::Cull { triangles },
        accesses: vec![
            Access { slice: joint, ..bound(0, Resource::View, COMPUTE_UNIFORM) },
            bound(1, Resource::PositionX, COMPUTE_READ),
            bound(2, Resource::PositionY, COMPUTE_READ),
            bound(3, Resource::PositionZ, COMPUTE_READ),
            of_triangles(4, Resource::Triangles, COMPUTE_READ),
            of_triangles(5, Resource::VisibleTriangles, COMPUTE_WRITE),
            Access { groups: Some(run.draws()), ..of_triangles(6, Resource::Draws, COMPUTE_WRITE) },
        ],
    }
}

fn radiance_pass() -> Pass {
    let vertex = scope(S::VERTEX_SHADER, A::SHADER_STORAGE_READ);
    let fragment = scope(S::FRAGMENT_SHADER, A::SHADER_STORAGE_READ);
    let colour = scope(S::COLOR_ATTACHMENT_OUTPUT, A::COLOR_ATTACHMENT_WRITE);
    let depth = scope(
        S::EARLY_FRAGMENT_TESTS | S::LATE_FRAGMENT_TESTS,
        A::DEPTH_STENCIL_ATTACHMENT_READ | A::DEPTH_STENCIL_ATTACHMENT_WRITE,
    );
    let bound = |binding, resource, scope| Access { binding: Some(binding), ..access(resource, scope) };
    let drawn = |resource, scope| Access { layout: ImageLayout::ATTACHMENT_OPTIMAL, ..access(resource, scope) };
    Pass {
        name: "radiance".to_owned(),
        work: Work::Radiance,
        accesses: vec![
            access(Resource::VisibleTriangles, scope(S::INDEX_INPUT, A::INDEX_READ)),
            access(Resource::Draws, scope(S::DRAW_INDIRECT, A::INDIRECT_COMMAND_READ)),
            bound(0, Resource::View, scope(S::VERTEX_SHADER, A::UNIFORM_READ)),
            bound(1, Resource::PositionX, vertex),
            bound(2, Resource::PositionY, vertex),
            bound(3, Resource::PositionZ, vertex),
            bound(4, Resource::Temperature, vertex),
            bound(5, Resource::GroupMaterial, vertex),
            bound(6, Resource::GroupPart, vertex),
            bound(7, Resource::Materials, fragment),
            bound(8, Resource::BandTable, fragment),
            drawn(Resource::RadianceImage, colour),
            drawn(Resource::IdentityImage, colour),
            drawn(Resource::DepthImage, depth),
        ],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Runs follow each other from multiples of 64 on, joints may be without triangles, and a run may take several dispatches.
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
