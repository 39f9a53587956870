//! The thermal step: load on every node, then its response. Also the temperatures between two steps, and the readback.

pub(crate) mod load;
pub(crate) mod ranges;
pub(crate) mod variant;

use ash::vk::{AccessFlags2 as A, PipelineStageFlags2 as S};

use self::variant::{StepKind, StepRange, ThermalVariant};
use crate::environment::{MAX_SUN_SAMPLES, albedo};
use crate::gpu::layout::{self, FUSED_STEPS};
use crate::gpu::pass::{
    CLEAR_WRITE, COMPUTE, COMPUTE_READ, COMPUTE_WRITE, COPY_READ, COPY_WRITE, Frame, Pass, Scope, barrier, scope,
    to_host,
};
use crate::gpu::resource::Pieces::{Always, WithoutImage, WithoutNormals};
use crate::gpu::resource::Role::{FromHost, Readback, Storage};
use crate::gpu::resource::{GROUP, Per, Resource, lent, made, resources};
use crate::gpu::scene_data::{SceneData, only};
use crate::gpu::shaders::Shader;
use crate::model::nodes::RANGE_GROUPS;

/// Size of the Sun samples of a step [bytes].
const SAMPLES: usize = 16 * MAX_SUN_SAMPLES;

resources! {
    /// `Step`, written by the host.
    STEP = Resource::uniform::<layout::Step>("Step", |_| 1).each_joint();
    /// Sun samples of the step, written by the host.
    SUN_SAMPLES = Resource::uniform::<[u8; SAMPLES]>("SunSamples", |_| 1).each_joint();
    /// Albedo table over the directions of a normal, written by the host.
    ALBEDO_VALUES = Resource::new("AlbedoValues", 4, FromHost, Per::Scene, albedo_values).each_slot();
    /// `Step`s of a fused dispatch, written by the host.
    FUSED_LOADS = Resource::uniform::<layout::Step>("FusedSteps", fused_steps).each_joint();
    /// Sun samples of a fused dispatch, written by the host.
    FUSED_SUN_SAMPLES = Resource::uniform::<[u8; SAMPLES]>("FusedSunSamples", fused_steps).each_joint();
    /// Albedo tables of a fused dispatch, written by the host.
    FUSED_ALBEDO_VALUES =
        Resource::new("FusedAlbedoValues", 4, FromHost, Per::Scene, |data| fused_steps(data) * albedo_values(data))
            .each_slot();
    /// `Material` of every material.
    MATERIALS =
        Resource::new("Materials", size_of::<layout::Material>(), Storage, Per::Scene, |data| data.materials.len())
            .filled(|data| lent(data.materials));
    /// Straight pieces of the shaped response functions.
    SHAPES = Resource::new("Shapes", 8, Storage, Per::Scene, |data| data.shapes.values.len())
        .filled(|data| lent(&data.shapes.values));
    /// Material index of every group.
    GROUP_MATERIAL = Resource::new("GroupMaterial", 4, Storage, Per::Node, groups)
        .in_pieces(WithoutImage)
        .filled(|data| lent(data.group_material));
    /// x of the normals.
    NORMAL_X = Resource::new("NormalX", GROUP, Storage, Per::Node, loaded_groups)
        .in_pieces(WithoutNormals)
        .filled(|data| axis(data.normals, 0));
    /// y of the normals.
    NORMAL_Y = Resource::new("NormalY", GROUP, Storage, Per::Node, loaded_groups)
        .in_pieces(WithoutNormals)
        .filled(|data| axis(data.normals, 1));
    /// z of the normals.
    NORMAL_Z = Resource::new("NormalZ", GROUP, Storage, Per::Node, loaded_groups)
        .in_pieces(WithoutNormals)
        .filled(|data| axis(data.normals, 2));
    /// Target temperature of every node [K]. Under a plate it is the temperature of the structure.
    TARGET = Resource::new("Target", GROUP, Storage, Per::Node, full_state_groups).in_pieces(Always);
    /// Target minus old temperature of every node [K]. Along a shaped function it is target minus present temperature. Of a
    /// plate it is what f32 does not hold of its temperature.
    SPAN = Resource::new("Span", GROUP, Storage, Per::Node, |data| {
        only(data.any_range(|variant| variant.kind.has_state()), data.groups())
    })
    .in_pieces(Always);
    /// Time since the transition of every node began [steps]. Under a plate it is the rest and the trend of the structure.
    ELAPSED = Resource::new("Elapsed", GROUP, Storage, Per::Node, full_state_groups).in_pieces(Always);
    /// Temperature of every node [K], then the power of every heater of a network in one pass [W].
    TEMPERATURE = Resource::new("Temperature", GROUP, Storage, Per::Node, |data| {
        data.groups() + data.network.map_or(0, |network| network.heaters.len().div_ceil(crate::model::nodes::GROUP))
    })
    .in_pieces(WithoutImage);
    /// Temperature of every node before the last step [K], where images lie between steps.
    EARLIER_TEMPERATURE = Resource::new("EarlierTemperature", GROUP, Storage, Per::Node, between_groups);
    /// Temperature of every node at the time of an image between steps [K].
    BETWEEN_TEMPERATURE = Resource::new("BetweenTemperature", GROUP, Storage, Per::Node, between_groups);
    /// Host copy of `Temperature`.
    TEMPERATURE_READBACK =
        Resource::new("TemperatureReadback", GROUP, Readback, Per::Node, groups).each_slot();
}

/// Values of the albedo table.
fn albedo_values(data: &SceneData<'_>) -> usize {
    only(data.any_range(|variant| variant.albedo), (albedo::RESOLUTION + 1).pow(2))
}

fn groups(data: &SceneData<'_>) -> usize {
    data.groups()
}

fn fused_steps(data: &SceneData<'_>) -> usize {
    only(data.fuses(), FUSED_STEPS)
}

/// Groups, if a load or a reflection depends on the normal of a node.
fn loaded_groups(data: &SceneData<'_>) -> usize {
    let shows = data.shown.variant;
    let drawn = data.draws() && shows.needs_normals() && !shows.crinkled;
    only(drawn || data.any_range(|variant| variant.sun || variant.planet_ir), data.groups())
}

/// Groups, if the state of nodes has three numbers.
fn full_state_groups(data: &SceneData<'_>) -> usize {
    only(data.any_range(|variant| variant.kind.has_full_state()), data.groups())
}

fn between_groups(data: &SceneData<'_>) -> usize {
    only(data.draws() && data.between, data.groups())
}

/// One component of vectors.
pub(super) fn axis(vectors: &[glam::Vec3], axis: usize) -> std::borrow::Cow<'static, [u8]> {
    made(&vectors.iter().map(|vector| vector[axis]).collect::<Vec<f32>>())
}

/// Stages that may read temperatures to draw them.
pub(super) const NODE_READ: Scope =
    scope(S::from_raw(S::VERTEX_SHADER.as_raw() | S::COMPUTE_SHADER.as_raw()), A::SHADER_STORAGE_READ);

/// Shader stages, copies and fills that may have written the state of nodes.
const STATE_WRITERS: Scope = scope(
    S::from_raw(S::COMPUTE_SHADER.as_raw() | S::COPY.as_raw() | S::CLEAR.as_raw()),
    A::from_raw(A::SHADER_STORAGE_WRITE.as_raw() | A::TRANSFER_WRITE.as_raw()),
);

/// Keeps the temperatures before a step, for images between them and those after it.
pub(crate) fn keep(frame: &mut Frame) {
    // The passes of the last image may still read the temperatures that this frame replaces.
    let readers = scope(S::COMPUTE_SHADER | S::COPY, A::TRANSFER_WRITE);
    frame.wait([barrier(&TEMPERATURE, COMPUTE_WRITE, COPY_READ), barrier(&EARLIER_TEMPERATURE, readers, COPY_WRITE)]);
    frame.pass(Pass::copy("keep temperatures", &TEMPERATURE, &EARLIER_TEMPERATURE));
}

/// The step of every range.
pub(crate) fn step(frame: &mut Frame, ranges: &[StepRange]) {
    if ranges.is_empty() {
        return;
    }
    // The last frame may still write the state or read the temperatures that this frame replaces.
    let readers = scope(S::COMPUTE_SHADER | NODE_READ.stage | S::COPY, A::SHADER_STORAGE_WRITE);
    let state = state_of(ranges).map(|resource| barrier(resource, STATE_WRITERS, COMPUTE));
    frame.wait([barrier(&TEMPERATURE, readers, COMPUTE)].into_iter().chain(state));
    frame.passes_of(ranges.iter().map(|StepRange { variant, groups, joint }| {
        let shader = variant.shader();
        over_nodes(Pass::dispatch(shader.name(), shader, workgroups(*groups)), *groups).of_joint(*joint)
    }));
}

/// Sets every node to the balance temperature of the present load, at the start of a run.
pub(crate) fn settle(ranges: &[StepRange]) -> Frame {
    let instant: Vec<StepRange> =
        ranges.iter().map(|range| StepRange { variant: range.variant.settling(), ..*range }).collect();
    let mut frame = Frame::default();
    step(&mut frame, &instant);
    let mut frame = frame.named("settle");
    // A run may restart, so the barriers also wait for the steps of the last run.
    let mut barriers: Vec<_> = state_of(ranges)
        .map(|resource| barrier(resource, STATE_WRITERS, if *resource == TARGET { COPY_WRITE } else { CLEAR_WRITE }))
        .collect();
    if any(ranges, StepKind::has_full_state) {
        barriers.push(barrier(&TEMPERATURE, COMPUTE_WRITE, COPY_READ));
    }
    frame.wait(barriers);
    frame.passes_of(state_of(ranges).map(|resource| match resource.name {
        "Target" => Pass::copy("settle target", &TEMPERATURE, &TARGET),
        "Span" => Pass::fill("settle span", &SPAN, 0),
        _ => Pass::fill("settle elapsed", &ELAPSED, 0),
    }));
    frame
}

/// Temperatures at the time of an image between two steps, of which a `share` has passed.
pub(crate) fn between(frame: &mut Frame, ranges: &[StepRange], share: f32) {
    let drawn = scope(NODE_READ.stage, A::NONE);
    frame.wait([
        barrier(&TEMPERATURE, COMPUTE_WRITE, COMPUTE_READ),
        barrier(&EARLIER_TEMPERATURE, COPY_WRITE, COMPUTE_READ),
        barrier(&BETWEEN_TEMPERATURE, drawn, COMPUTE_WRITE),
    ]);
    frame.passes_of(ranges.iter().map(|StepRange { groups, .. }| {
        let pass = Pass::dispatch("between", Shader::plain("between.comp"), workgroups(*groups));
        over_nodes(pass, *groups).told(&share)
    }));
}

/// The temperatures of all nodes for the host.
pub(crate) fn read(frame: &mut Frame) {
    frame.wait([barrier(&TEMPERATURE, COMPUTE_WRITE, COPY_READ)]);
    frame.pass(Pass::copy("read temperatures", &TEMPERATURE, &TEMPERATURE_READBACK));
    frame.wait([to_host(&TEMPERATURE_READBACK)]);
}

/// Limits a pass to groups of nodes.
pub(super) fn over_nodes(pass: Pass, groups: (u32, u32)) -> Pass {
    pass.over(Per::Node, groups)
}

/// Workgroups over groups of nodes.
pub(super) fn workgroups((first, end): (u32, u32)) -> u32 {
    (end - first).div_ceil(RANGE_GROUPS as u32)
}

/// Whether a kind of range has something.
fn any(ranges: &[StepRange], has: fn(StepKind) -> bool) -> bool {
    ranges.iter().any(|range| has(range.variant.kind))
}

/// The resources of the state of nodes between steps, without the temperature.
fn state_of(ranges: &[StepRange]) -> impl Iterator<Item = &'static Resource> {
    let (some, full) = (any(ranges, StepKind::has_state), any(ranges, StepKind::has_full_state));
    let all = [(full, &TARGET), (some, &SPAN), (full, &ELAPSED)];
    all.into_iter().filter_map(|(present, resource)| present.then_some(resource))
}

impl ThermalVariant {
    /// Its shader, such as `thermal_step.merge.sun.planet_ir.albedo.both_sides`.
    pub fn shader(&self) -> Shader {
        let [lit, by_rays] = self.light.words();
        let switches = [
            (self.fused, "fused"),
            (self.sun, "sun"),
            (self.planet_ir, "planet_ir"),
            (self.albedo, "albedo"),
            (self.tumble && self.planet_ir, "tumble"),
            lit,
            by_rays,
            (self.exchange, "exchange"),
            (self.both_sides, "both_sides"),
        ];
        let mut shader = Shader::with("thermal_step.comp", &switches);
        shader.words.splice(0..0, self.kind.words().iter().chain(self.curve.words()).copied());
        shader
    }
}
