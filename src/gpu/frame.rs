//! The frame as data: a list of passes and hand-written barriers, built once per scene.
//!
//! From this list come the recorded commands, the debug labels, the timestamps, the description that `isotherm info`
//! prints, and the hazard check. Read [`Frame::step`] and [`Frame::settle`] from top to bottom.

use ash::vk::{AccessFlags2 as A, ImageLayout, PipelineStageFlags2 as S};

use super::variant::{Curve, StepKind, ThermalVariant};

/// Whatever a pass reads or writes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Resource {
    /// `Tick`, written by the host.
    Tick,
    /// Sun samples of the tick, written by the host.
    SunSamples,
    /// Albedo over the directions of a normal, written by the host.
    AlbedoValues,
    /// `View`, written by the host.
    View,
    /// `Material` of every material.
    Materials,
    /// Pieces of the response functions that are no powers.
    Shapes,
    /// Material of every group of four nodes.
    GroupMaterial,
    /// Part of every group of four nodes.
    GroupPart,
    /// Normals, one buffer a component.
    NormalX,
    /// See `NormalX`.
    NormalY,
    /// See `NormalX`.
    NormalZ,
    /// Positions [m], one buffer a component.
    PositionX,
    /// See `PositionX`.
    PositionY,
    /// See `PositionX`.
    PositionZ,
    /// Node indices of the triangles.
    Triangles,
    /// The same with empty triangles in place of those that cover no pixel's centre.
    VisibleTriangles,
    /// Table of the band's radiance.
    BandTable,
    /// Target temperature of every node [K].
    Target,
    /// Target less old temperature of every node [K].
    Span,
    /// Steps since the transition began, of every node.
    Elapsed,
    /// Temperature of every node [K].
    Temperature,
    /// Radiance, temperature and depth of every pixel.
    RadianceImage,
    /// Part and material of every pixel.
    IdentityImage,
    /// Depth buffer.
    DepthImage,
    /// The images and temperatures where the host reads them.
    RadianceReadback,
    /// See `RadianceReadback`.
    IdentityReadback,
    /// See `RadianceReadback`.
    TemperatureReadback,
}

impl Resource {
    /// Whether the two frames in flight have one each; a fence orders the uses of each by the host.
    pub fn per_slot(self) -> bool {
        matches!(
            self,
            Self::Tick
                | Self::SunSamples
                | Self::AlbedoValues
                | Self::View
                | Self::RadianceReadback
                | Self::IdentityReadback
                | Self::TemperatureReadback
        )
    }

    /// Whether shaders see it as a uniform buffer: small, and read by every invocation at the same address. (On lavapipe
    /// each scalar of a storage buffer costs every invocation 0.5 ns; a uniform is read once.)
    pub fn is_uniform(self) -> bool {
        matches!(self, Self::Tick | Self::SunSamples | Self::View)
    }

    /// Whether its size on the device follows the number of nodes; what only the host reads is not counted.
    pub fn grows_with_nodes(self) -> bool {
        matches!(
            self,
            Self::GroupMaterial
                | Self::GroupPart
                | Self::NormalX
                | Self::NormalY
                | Self::NormalZ
                | Self::PositionX
                | Self::PositionY
                | Self::PositionZ
                | Self::Triangles
                | Self::VisibleTriangles
                | Self::Target
                | Self::Span
                | Self::Elapsed
                | Self::Temperature
        )
    }

    /// Whether its size on the device follows the number of pixels.
    pub fn grows_with_pixels(self) -> bool {
        self.is_image() || matches!(self, Self::RadianceReadback | Self::IdentityReadback)
    }

    /// Whether it is an image, which has a layout.
    pub fn is_image(self) -> bool {
        matches!(self, Self::RadianceImage | Self::IdentityImage | Self::DepthImage)
    }
}

/// A stage and how it touches memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Scope {
    /// Pipeline stages.
    pub stage: S,
    /// Kinds of access; empty where a barrier orders execution only.
    pub access: A,
}

const fn scope(stage: S, access: A) -> Scope {
    Scope { stage, access }
}

const COMPUTE_READ: Scope = scope(S::COMPUTE_SHADER, A::SHADER_STORAGE_READ);
const COMPUTE_UNIFORM: Scope = scope(S::COMPUTE_SHADER, A::UNIFORM_READ);
const COMPUTE_WRITE: Scope = scope(S::COMPUTE_SHADER, A::SHADER_STORAGE_WRITE);
const COPY_READ: Scope = scope(S::COPY, A::TRANSFER_READ);
const COPY_WRITE: Scope = scope(S::COPY, A::TRANSFER_WRITE);
/// `vkCmdFillBuffer` is a clear command; validation layers before February 2024 (Vulkan-ValidationLayers, pull request
/// 7543) take it for a copy.
const CLEAR_WRITE: Scope =
    Scope { stage: S::from_raw(S::COPY.as_raw() | S::CLEAR.as_raw()), access: A::TRANSFER_WRITE };

/// The groups of four nodes, or the triangles, that an access is confined to: the first, and the one after the last.
/// `None` is the whole resource.
pub type Groups = Option<(u32, u32)>;

/// One use of a resource by a pass.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Access {
    /// What is touched.
    pub resource: Resource,
    /// Where and how.
    pub scope: Scope,
    /// Which part of it.
    pub groups: Groups,
    /// Shader binding, where it is bound to one.
    pub binding: Option<u32>,
    /// Layout, of an image.
    pub layout: ImageLayout,
}

/// What a pass does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Work {
    /// `thermal_step` on a run of whole workgroups.
    Thermal {
        /// Compiled variant.
        variant: ThermalVariant,
        /// Groups of four nodes: first, and the one after the last.
        groups: (u32, u32),
    },
    /// Finds the triangles that may cover a pixel's centre.
    Cull {
        /// Triangles: first, and the one after the last.
        triangles: (u32, u32),
    },
    /// Draws the triangles that are left.
    Radiance,
    /// Copies a buffer or an image to a buffer.
    Copy {
        /// From here.
        from: Resource,
        /// To there.
        to: Resource,
    },
    /// Fills a buffer of floats with zero.
    Clear(Resource),
}

/// A named piece of work and everything that it touches.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pass {
    /// Debug label and name of its timestamps.
    pub name: String,
    /// What it does.
    pub work: Work,
    /// What it touches.
    pub accesses: Vec<Access>,
}

/// Orders the accesses of one resource.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Barrier {
    /// What it guards.
    pub resource: Resource,
    /// What came before.
    pub before: Scope,
    /// What comes after.
    pub after: Scope,
    /// Old and new layout, of an image.
    pub layouts: Option<(ImageLayout, ImageLayout)>,
}

/// One entry of the list.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Step {
    /// Work.
    Pass(Pass),
    /// Barriers that are recorded together.
    Barriers(Vec<Barrier>),
}

/// A run of nodes that one pipeline moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StepRange {
    /// Compiled variant.
    pub variant: ThermalVariant,
    /// Groups of four nodes: first, and the one after the last.
    pub groups: (u32, u32),
}

/// Triangles that one dispatch culls at most: 65,535 workgroups of 64. A multiple of 64 keeps bindings aligned.
const CULLED_AT_ONCE: u32 = 65_535 * 64;

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
            let index_read = scope(S::INDEX_INPUT, A::INDEX_READ);
            // The last image may still read its triangles.
            let drawn = scope(S::INDEX_INPUT | S::COMPUTE_SHADER, A::SHADER_STORAGE_WRITE);
            steps.push(Step::Barriers(vec![barrier(Resource::VisibleTriangles, drawn, COMPUTE_WRITE)]));
            for first in (0..wanted.cull).step_by(CULLED_AT_ONCE as usize) {
                let end = wanted.cull.min(first.saturating_add(CULLED_AT_ONCE));
                steps.push(Step::Pass(cull_pass((first, end))));
            }
            steps.push(Step::Barriers(vec![barrier(Resource::VisibleTriangles, COMPUTE_WRITE, index_read)]));
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
    ranges.iter().any(|range| range.variant.kind != StepKind::Instant)
}

/// The kinds of access that write.
pub fn writes(access: A) -> A {
    access
        & (A::SHADER_STORAGE_WRITE
            | A::TRANSFER_WRITE
            | A::COLOR_ATTACHMENT_WRITE
            | A::DEPTH_STENCIL_ATTACHMENT_WRITE
            | A::HOST_WRITE
            | A::MEMORY_WRITE)
}

/// Whether any of the kinds of access writes.
pub fn is_write(access: A) -> bool {
    !writes(access).is_empty()
}

fn barrier(resource: Resource, before: Scope, after: Scope) -> Barrier {
    Barrier { resource, before, after, layouts: None }
}

fn transition(resource: Resource, before: Scope, after: Scope, old: ImageLayout, new: ImageLayout) -> Barrier {
    Barrier { resource, before, after, layouts: Some((old, new)) }
}

fn to_host(resource: Resource) -> Barrier {
    barrier(resource, COPY_WRITE, scope(S::HOST, A::HOST_READ))
}

fn access(resource: Resource, scope: Scope) -> Access {
    Access { resource, scope, groups: None, binding: None, layout: ImageLayout::UNDEFINED }
}

/// Shader bindings of a variant of `thermal_step.comp`.
fn thermal_pass(range: StepRange) -> Pass {
    let StepRange { variant, groups } = range;
    let loaded = variant.sun || variant.planet_ir;
    let commands = variant.kind != StepKind::Advance;
    let moves = variant.kind != StepKind::Instant;
    let mut accesses = Vec::new();
    let mut bind = |present: bool, binding: u32, resource: Resource, scopes: &[Scope]| {
        if present {
            let by_group = !matches!(
                resource,
                Resource::Tick | Resource::SunSamples | Resource::AlbedoValues | Resource::Materials | Resource::Shapes
            );
            accesses.extend(scopes.iter().map(|scope| Access {
                groups: by_group.then_some(groups),
                binding: Some(binding),
                ..access(resource, *scope)
            }));
        }
    };
    bind(true, 0, Resource::Tick, &[COMPUTE_UNIFORM]);
    bind(variant.sun, 1, Resource::SunSamples, &[COMPUTE_UNIFORM]);
    bind(variant.albedo, 2, Resource::AlbedoValues, &[COMPUTE_READ]);
    bind(true, 3, Resource::Materials, &[COMPUTE_READ]);
    bind(true, 4, Resource::GroupMaterial, &[COMPUTE_READ]);
    bind(loaded, 5, Resource::NormalX, &[COMPUTE_READ]);
    bind(loaded, 6, Resource::NormalY, &[COMPUTE_READ]);
    bind(loaded, 7, Resource::NormalZ, &[COMPUTE_READ]);
    bind(moves, 8, Resource::Target, if commands { &[COMPUTE_READ, COMPUTE_WRITE] } else { &[COMPUTE_READ] });
    bind(moves, 9, Resource::Span, if commands { &[COMPUTE_READ, COMPUTE_WRITE] } else { &[COMPUTE_READ] });
    bind(moves, 10, Resource::Elapsed, &[COMPUTE_READ, COMPUTE_WRITE]);
    bind(true, 11, Resource::Temperature, &[COMPUTE_WRITE]);
    bind(moves && variant.curve != Curve::Power, 12, Resource::Shapes, &[COMPUTE_READ]);
    Pass { name: variant.name(), work: Work::Thermal { variant, groups }, accesses }
}

fn cull_pass(triangles: (u32, u32)) -> Pass {
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
            bound(0, Resource::View, COMPUTE_UNIFORM),
            bound(1, Resource::PositionX, COMPUTE_READ),
            bound(2, Resource::PositionY, COMPUTE_READ),
            bound(3, Resource::PositionZ, COMPUTE_READ),
            of_triangles(4, Resource::Triangles, COMPUTE_READ),
            of_triangles(5, Resource::VisibleTriangles, COMPUTE_WRITE),
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

fn copy_pass(name: &str, from: Resource, to: Resource) -> Pass {
    let layout = if from.is_image() { ImageLayout::TRANSFER_SRC_OPTIMAL } else { ImageLayout::UNDEFINED };
    Pass {
        name: name.to_owned(),
        work: Work::Copy { from, to },
        accesses: vec![Access { layout, ..access(from, COPY_READ) }, access(to, COPY_WRITE)],
    }
}

fn clear_pass(name: &str, resource: Resource) -> Pass {
    Pass { name: name.to_owned(), work: Work::Clear(resource), accesses: vec![access(resource, CLEAR_WRITE)] }
}
