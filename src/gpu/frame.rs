//! A frame as a list of passes and barriers.
//!
//! Command recording, debug labels, timestamps, `isotherm info` and the hazard check all use this list. [`Frame::step`]
//! and [`Frame::settle`] build it in the order of execution.

mod passes;

use ash::vk::{AccessFlags2 as A, ImageLayout, PipelineStageFlags2 as S};

pub use passes::{StepRange, TRIANGLES_A_DRAW, TriangleRun};

use passes::{DEPTH, DEPTH_WRITE, cull_pass, radiance_pass, ray_pass, solar_depth_pass, thermal_pass, visibility_pass};

use super::pass::{
    CLEAR_WRITE, COMPUTE_READ, COMPUTE_WRITE, COPY_READ, COPY_WRITE, Entry, Pass, Work, barrier, clear_pass, copy_pass,
    is_write, scope, to_host, transition,
};
use super::radiance_variant::RadianceVariant;
use super::resource::Resource;
use crate::environment::shadow::{Method, SUN_RAYS};

/// Most groups of one dispatch of shadow rays: 65,535 workgroups of 64 nodes, rounded down to whole ranges.
const TRACED_AT_ONCE: u32 = 65_535 / 4 * 64;

/// Outputs of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Wanted {
    /// Whether an image is drawn.
    pub image: bool,
    /// Triangles to cull before drawing. It is 0 if the view of the craft has not changed since the last image.
    pub cull: u32,
    /// Whether the host reads the temperatures of all nodes.
    pub temperatures: bool,
    /// What the pixels of the image show.
    pub shows: RadianceVariant,
}

/// Passes and barriers that are submitted together.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Frame {
    /// Passes and barriers in queue order.
    pub entries: Vec<Entry>,
}

impl Frame {
    /// One step of a craft without joints: thermal step of every range, then image and readback as wanted.
    pub fn step(ranges: &[StepRange], wanted: Wanted) -> Self {
        Self::step_in_runs(ranges, wanted, &[TriangleRun { joint: 0, triangles: (0, wanted.cull) }])
    }

    /// One step of a craft with joints. `culled` are the triangles to cull before drawing.
    pub fn step_in_runs(ranges: &[StepRange], wanted: Wanted, culled: &[TriangleRun]) -> Self {
        let mut entries = Vec::new();

        if !ranges.is_empty() {
            // The last frame may still write the state or read the temperatures that this frame replaces.
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
            entries.push(Entry::Barriers(barriers));
            entries.extend(ranges.iter().map(|range| Entry::Pass(thermal_pass(*range))));
        }
        if wanted.image && wanted.cull > 0 {
            // The draw of the last image may still read its triangles and draw commands.
            let indices = scope(S::INDEX_INPUT | S::COMPUTE_SHADER, A::SHADER_STORAGE_WRITE);
            let commands = scope(S::DRAW_INDIRECT | S::COMPUTE_SHADER, A::SHADER_STORAGE_WRITE);
            entries.push(Entry::Barriers(vec![
                barrier(Resource::VisibleTriangles, indices, COMPUTE_WRITE),
                barrier(Resource::Draws, commands, COMPUTE_WRITE),
            ]));
            entries.extend(culled.iter().flat_map(|run| run.pieces()).map(|run| Entry::Pass(cull_pass(run))));
            entries.push(Entry::Barriers(vec![
                barrier(Resource::VisibleTriangles, COMPUTE_WRITE, scope(S::INDEX_INPUT, A::INDEX_READ)),
                barrier(Resource::Draws, COMPUTE_WRITE, scope(S::DRAW_INDIRECT, A::INDIRECT_COMMAND_READ)),
            ]));
        }
        if wanted.image {
            let vertex_read = scope(S::VERTEX_SHADER, A::SHADER_STORAGE_READ);
            let colour = scope(S::COLOR_ATTACHMENT_OUTPUT, A::COLOR_ATTACHMENT_WRITE);
            let copied = scope(S::COPY, A::NONE);
            let (undefined, attachment) = (ImageLayout::UNDEFINED, ImageLayout::ATTACHMENT_OPTIMAL);
            let source = ImageLayout::TRANSFER_SRC_OPTIMAL;
            entries.push(Entry::Barriers(vec![
                barrier(Resource::Temperature, COMPUTE_WRITE, vertex_read),
                transition(Resource::RadianceImage, copied, colour, undefined, attachment),
                transition(Resource::IdentityImage, copied, colour, undefined, attachment),
                transition(Resource::DepthImage, DEPTH_WRITE, DEPTH, undefined, attachment),
            ]));
            entries.push(Entry::Pass(radiance_pass(wanted.shows)));
            entries.push(Entry::Barriers(vec![
                transition(Resource::RadianceImage, colour, COPY_READ, attachment, source),
                transition(Resource::IdentityImage, colour, COPY_READ, attachment, source),
            ]));
            entries.push(Entry::Pass(copy_pass("read radiance", Resource::RadianceImage, Resource::RadianceReadback)));
            entries.push(Entry::Pass(copy_pass("read identity", Resource::IdentityImage, Resource::IdentityReadback)));
            entries
                .push(Entry::Barriers(vec![to_host(Resource::RadianceReadback), to_host(Resource::IdentityReadback)]));
        }
        if wanted.temperatures {
            entries.push(Entry::Barriers(vec![barrier(Resource::Temperature, COMPUTE_WRITE, COPY_READ)]));
            entries.push(Entry::Pass(copy_pass(
                "read temperatures",
                Resource::Temperature,
                Resource::TemperatureReadback,
            )));
            entries.push(Entry::Barriers(vec![to_host(Resource::TemperatureReadback)]));
        }
        Self { entries }
    }

    /// Start of a run: sets every node to the balance temperature of the present load.
    pub fn settle(ranges: &[StepRange]) -> Self {
        let instant: Vec<StepRange> =
            ranges.iter().map(|range| StepRange { variant: range.variant.settling(), ..*range }).collect();
        let mut frame = Self::step(&instant, Wanted::default());
        for entry in &mut frame.entries {
            if let Entry::Pass(pass) = entry {
                pass.name = format!("settle {}", pass.name);
            }
        }
        if has_state(ranges) {
            // A run may restart, so the barriers also wait for the steps of the last run.
            let stepped = scope(S::COMPUTE_SHADER | S::COPY | S::CLEAR, A::SHADER_STORAGE_WRITE | A::TRANSFER_WRITE);
            frame.entries.push(Entry::Barriers(vec![
                barrier(Resource::Temperature, COMPUTE_WRITE, COPY_READ),
                barrier(Resource::Target, stepped, COPY_WRITE),
                barrier(Resource::Span, stepped, CLEAR_WRITE),
                barrier(Resource::Elapsed, stepped, CLEAR_WRITE),
            ]));
            frame.entries.push(Entry::Pass(copy_pass("settle target", Resource::Temperature, Resource::Target)));
            frame.entries.push(Entry::Pass(clear_pass("settle span", Resource::Span)));
            frame.entries.push(Entry::Pass(clear_pass("settle elapsed", Resource::Elapsed)));
        }
        frame
    }

    /// Updates the share of the Sun that each node sees, in the ranges with shadows. It precedes a step in which the
    /// Sun has moved in the body frame. It is empty if no range has shadows.
    pub fn shadows(ranges: &[StepRange], method: Method) -> Self {
        let shadowed: Vec<StepRange> = ranges.iter().copied().filter(|range| range.variant.shadow).collect();
        let mut entries = Vec::new();
        if !shadowed.is_empty() {
            match method {
                Method::Depth => entries.extend(shadows_by_depth(&shadowed)),
                Method::Exact => entries.extend(shadows_by_rays(&shadowed)),
            }
            entries.push(Entry::Barriers(vec![barrier(Resource::Visibility, COMPUTE_WRITE, COMPUTE_READ)]));
        }
        Self { entries }
    }

    /// Appends another list to the same command buffer.
    pub fn then(mut self, next: Self) -> Self {
        self.entries.extend(next.entries);
        self
    }

    /// The passes in queue order.
    pub fn passes(&self) -> impl Iterator<Item = &Pass> {
        self.entries.iter().filter_map(|entry| match entry {
            Entry::Pass(pass) => Some(pass),
            Entry::Barriers(_) => None,
        })
    }

    /// Destinations of the copies.
    pub fn copied_to(&self) -> impl Iterator<Item = Resource> {
        self.passes().filter_map(|pass| if let Work::Copy { to, .. } = pass.work { Some(to) } else { None })
    }
}

impl std::fmt::Display for Frame {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        for entry in &self.entries {
            match entry {
                Entry::Pass(pass) => {
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
                Entry::Barriers(barriers) => {
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

/// Whether nodes of the ranges keep a state between steps.
fn has_state(ranges: &[StepRange]) -> bool {
    ranges.iter().any(|range| range.variant.kind.has_state())
}

/// Shadows by shadow map: draws the depth as the Sun sees it, copies it to a buffer, and looks up every node.
fn shadows_by_depth(ranges: &[StepRange]) -> Vec<Entry> {
    let (undefined, attachment) = (ImageLayout::UNDEFINED, ImageLayout::ATTACHMENT_OPTIMAL);
    let source = ImageLayout::TRANSFER_SRC_OPTIMAL;
    let copied = scope(S::COPY, A::NONE);
    let read = scope(S::COMPUTE_SHADER, A::NONE);
    let mut entries = vec![
        // The last copy must finish before the image is drawn again.
        Entry::Barriers(vec![transition(Resource::SunDepthImage, copied, DEPTH, undefined, attachment)]),
        Entry::Pass(solar_depth_pass()),
        Entry::Barriers(vec![
            transition(Resource::SunDepthImage, DEPTH_WRITE, COPY_READ, attachment, source),
            barrier(Resource::SunDepth, read, COPY_WRITE),
        ]),
        Entry::Pass(copy_pass("read solar_depth", Resource::SunDepthImage, Resource::SunDepth)),
        Entry::Barriers(vec![
            barrier(Resource::SunDepth, COPY_WRITE, COMPUTE_READ),
            barrier(Resource::Visibility, COMPUTE_WRITE, COMPUTE_WRITE),
        ]),
    ];
    entries.extend(ranges.iter().map(|range| Entry::Pass(visibility_pass(range))));
    entries
}

/// Shadows by rays: one dispatch for each point of the Sun's disc adds its share to each node.
fn shadows_by_rays(ranges: &[StepRange]) -> Vec<Entry> {
    let both = scope(S::COMPUTE_SHADER, A::SHADER_STORAGE_READ | A::SHADER_STORAGE_WRITE);
    let mut entries = Vec::new();
    for ray in 0..SUN_RAYS as u32 {
        let after = if ray == 0 { COMPUTE_WRITE } else { both };
        entries.push(Entry::Barriers(vec![barrier(Resource::Visibility, COMPUTE_WRITE, after)]));
        for StepRange { groups: (first, end), joint, .. } in ranges {
            let pieces = (*first..*end).step_by(TRACED_AT_ONCE as usize);
            let piece = |at: u32| (at, end.to_owned().min(at.saturating_add(TRACED_AT_ONCE)));
            entries.extend(pieces.map(|at| Entry::Pass(ray_pass(ray, *joint, piece(at)))));
        }
    }
    entries
}
