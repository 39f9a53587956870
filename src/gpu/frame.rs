//! A frame as a list of passes and barriers.
//!
//! Command recording, debug labels, timestamps, `isotherm info` and the hazard check all use this list. [`Frame::step`]
//! and [`Frame::settle`] build it in the order of execution.

mod passes;

use ash::vk::{AccessFlags2 as A, ImageLayout, PipelineStageFlags2 as S};

pub use passes::{StepRange, TRIANGLES_A_DRAW, TriangleRun};

use passes::{
    DEPTH, DEPTH_WRITE, between_pass, cull_pass, distant_pass, mean_pass, radiance_pass, ray_pass, resample_pass,
    solar_depth_pass, thermal_pass, traced_passes, visibility_pass,
};

use super::pass::{
    CLEAR_WRITE, COMPUTE_READ, COMPUTE_WRITE, COPY_READ, COPY_WRITE, Entry, Kernel, Pass, Scope, barrier, clear_pass,
    copy_pass, is_write, scope, to_host, transition,
};
use super::radiance_variant::RadianceVariant;
use super::resource::Resource;
use super::sampling::{Distance, Sampled};
use crate::environment::shadow::{SUN_RAYS, ShadowMethod};

/// Most groups of one dispatch of shadow rays: 65,535 workgroups of 64 nodes, rounded down to whole ranges.
const TRACED_AT_ONCE: u32 = 65_535 / 4 * 64;

/// Outputs of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Wanted {
    /// Whether an image is drawn.
    pub image: bool,
    /// How the image is made. `None` if it is simply drawn.
    pub sampled: Option<Sampled>,
    /// Triangles to cull before drawing. It is 0 if the view of the craft has not changed since the last image.
    pub cull: u32,
    /// Whether the host reads the temperatures of all nodes.
    pub temperatures: bool,
    /// What the pixels of the image show.
    pub shows: RadianceVariant,
    /// Texels whose reflections of the craft itself are traced, where `shows` has them.
    pub texels: u32,
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
        Self::step_shown(ranges, wanted, culled, Resource::Temperature)
    }

    /// Keeps the temperatures before a step, for images between them and those after it.
    pub fn keep() -> Self {
        // The passes of the last image may still read the temperatures that this frame replaces.
        let readers = scope(S::COMPUTE_SHADER | S::COPY, A::TRANSFER_WRITE);
        Self {
            entries: vec![
                Entry::Barriers(vec![
                    barrier(Resource::Temperature, COMPUTE_WRITE, COPY_READ),
                    barrier(Resource::EarlierTemperature, readers, COPY_WRITE),
                ]),
                Entry::Pass(copy_pass("keep temperatures", Resource::Temperature, Resource::EarlierTemperature)),
            ],
        }
    }

    /// An image between two steps: temperatures of its time, then the image. `culled` are the triangles to cull before drawing.
    pub fn between(ranges: &[StepRange], wanted: Wanted, culled: &[TriangleRun]) -> Self {
        let drawn = scope(NODE_READ.stage, A::NONE);
        let mut entries = vec![Entry::Barriers(vec![
            barrier(Resource::Temperature, COMPUTE_WRITE, COMPUTE_READ),
            barrier(Resource::EarlierTemperature, COPY_WRITE, COMPUTE_READ),
            barrier(Resource::BetweenTemperature, drawn, COMPUTE_WRITE),
        ])];
        entries.extend(ranges.iter().map(|range| Entry::Pass(between_pass(range))));
        Self { entries }.then(Self::step_shown(&[], wanted, culled, Resource::BetweenTemperature))
    }

    /// A step whose image shows the temperatures in the buffer `shown`.
    fn step_shown(ranges: &[StepRange], wanted: Wanted, culled: &[TriangleRun], shown: Resource) -> Self {
        let mut entries = Vec::new();

        if !ranges.is_empty() {
            // The last frame may still write the state or read the temperatures that this frame replaces.
            let readers = scope(S::COMPUTE_SHADER | NODE_READ.stage | S::COPY, A::SHADER_STORAGE_WRITE);
            let state_writers =
                scope(S::COMPUTE_SHADER | S::COPY | S::CLEAR, A::SHADER_STORAGE_WRITE | A::TRANSFER_WRITE);
            let compute = scope(S::COMPUTE_SHADER, A::SHADER_STORAGE_READ | A::SHADER_STORAGE_WRITE);
            let mut barriers = vec![barrier(Resource::Temperature, readers, compute)];
            barriers.extend(state_of(ranges).map(|resource| barrier(resource, state_writers, compute)));
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
            let kernel = match wanted.sampled {
                Some(Sampled { mean, shutter, .. }) if mean.is_some() || shutter.is_some() => {
                    Kernel::CullSamples { several: mean.is_some(), shutter }
                }
                _ => Kernel::Cull,
            };
            entries.extend(culled.iter().flat_map(|run| run.pieces()).map(|run| Entry::Pass(cull_pass(run, kernel))));
            entries.push(Entry::Barriers(vec![
                barrier(Resource::VisibleTriangles, COMPUTE_WRITE, scope(S::INDEX_INPUT, A::INDEX_READ)),
                barrier(Resource::Draws, COMPUTE_WRITE, scope(S::DRAW_INDIRECT, A::INDIRECT_COMMAND_READ)),
            ]));
        }
        if wanted.image {
            entries.extend(image(&wanted, shown));
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
            let after = |resource| if resource == Resource::Target { COPY_WRITE } else { CLEAR_WRITE };
            let mut barriers: Vec<_> =
                state_of(ranges).map(|resource| barrier(resource, stepped, after(resource))).collect();
            if has_full_state(ranges) {
                barriers.push(barrier(Resource::Temperature, COMPUTE_WRITE, COPY_READ));
            }
            frame.entries.push(Entry::Barriers(barriers));
            frame.entries.extend(state_of(ranges).map(|resource| {
                Entry::Pass(match resource {
                    Resource::Target => copy_pass("settle target", Resource::Temperature, Resource::Target),
                    Resource::Span => clear_pass("settle span", Resource::Span),
                    other => clear_pass("settle elapsed", other),
                })
            }));
        }
        frame
    }

    /// Updates the share of the Sun that each node sees, in the ranges with shadows. It precedes a step in which the
    /// Sun has moved in the body frame. It is empty if no range has shadows.
    pub fn shadows(ranges: &[StepRange], method: ShadowMethod) -> Self {
        let shadowed: Vec<StepRange> = ranges.iter().copied().filter(|range| range.variant.shadow).collect();
        let mut entries = Vec::new();
        if !shadowed.is_empty() {
            match method {
                ShadowMethod::Depth => entries.extend(shadows_by_depth(&shadowed)),
                ShadowMethod::Exact => entries.extend(shadows_by_rays(&shadowed)),
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

    /// Resources that the host may read after the list.
    pub fn left_to_host(&self) -> impl Iterator<Item = Resource> {
        let barriers = self.entries.iter().flat_map(|entry| match entry {
            Entry::Barriers(barriers) => barriers.as_slice(),
            Entry::Pass(_) => &[],
        });
        barriers.filter(|barrier| barrier.after.stage.contains(S::HOST)).map(|barrier| barrier.resource)
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

/// Read of the temperatures of nodes by a draw.
const VERTEX_READ: Scope = scope(S::VERTEX_SHADER, A::SHADER_STORAGE_READ);
/// The same where rays of reflections read them too.
const NODE_READ: Scope =
    scope(S::from_raw(S::VERTEX_SHADER.as_raw() | S::COMPUTE_SHADER.as_raw()), A::SHADER_STORAGE_READ);
/// Write of a colour attachment.
const COLOUR: Scope = scope(S::COLOR_ATTACHMENT_OUTPUT, A::COLOR_ATTACHMENT_WRITE);
/// End of the copies, which only read.
const COPIED: Scope = scope(S::COPY, A::NONE);

/// Draws an image with the temperatures in the buffer `shown`, computes another from it where one is wanted, and copies it to the host.
fn image(wanted: &Wanted, shown: Resource) -> Vec<Entry> {
    let Wanted { sampled, shows, .. } = *wanted;
    let (undefined, attachment) = (ImageLayout::UNDEFINED, ImageLayout::ATTACHMENT_OPTIMAL);
    let source = ImageLayout::TRANSFER_SRC_OPTIMAL;
    let shutter = sampled.and_then(|sampled| sampled.shutter);
    let mean = sampled.and_then(|sampled| sampled.mean);
    let mut before = vec![
        barrier(shown, COMPUTE_WRITE, if shows.traced { NODE_READ } else { VERTEX_READ }),
        transition(Resource::RadianceImage, COPIED, COLOUR, undefined, attachment),
        transition(Resource::IdentityImage, COPIED, COLOUR, undefined, attachment),
        transition(Resource::DepthImage, DEPTH_WRITE, DEPTH, undefined, attachment),
    ];
    let mut drawn = vec![
        transition(Resource::RadianceImage, COLOUR, COPY_READ, attachment, source),
        transition(Resource::IdentityImage, COLOUR, COPY_READ, attachment, source),
    ];
    if shows.traced {
        before.push(transition(Resource::SurfaceImage, COPIED, COLOUR, undefined, attachment));
        drawn.push(transition(Resource::SurfaceImage, COLOUR, COPY_READ, attachment, source));
    }
    // A mean takes the place of the radiance of single samples.
    let single = match sampled {
        // The sky stands behind the pixels, not behind the texels of a crop.
        Some(Sampled { distance: Distance::Far, .. }) => RadianceVariant { background: false, ..shows },
        _ if mean.is_some() => RadianceVariant::PLAIN,
        _ => shows,
    };
    let mut passes = vec![Entry::Pass(radiance_pass(single, shutter, shown))];
    if let Some(each) = mean {
        before.push(transition(Resource::MeanImage, COPIED, COLOUR, undefined, attachment));
        before.push(transition(Resource::MeanDepthImage, DEPTH_WRITE, DEPTH, undefined, attachment));
        if each > 1 {
            // Only draws use this image.
            before.push(transition(Resource::MultiImage, COLOUR, COLOUR, undefined, attachment));
        }
        passes.push(Entry::Pass(mean_pass(shows, each, shutter, shown)));
        drawn.push(transition(Resource::MeanImage, COLOUR, COPY_READ, attachment, source));
    }
    let mut entries = vec![Entry::Barriers(before)];
    entries.extend(passes);
    entries.push(Entry::Barriers(drawn));
    let resampled = sampled.filter(Sampled::is_resampled);
    if resampled.is_some() || shows.traced {
        entries.extend(computed(resampled, wanted, shown));
    }
    let [radiance, identity] = match resampled {
        Some(_) => [Resource::ImageRadiance, Resource::ImageIdentity],
        None if shows.traced => [Resource::DrawnRadiance, Resource::IdentityImage],
        None => [Resource::RadianceImage, Resource::IdentityImage],
    };
    entries.extend([
        Entry::Pass(copy_pass("read radiance", radiance, Resource::RadianceReadback)),
        Entry::Pass(copy_pass("read identity", identity, Resource::IdentityReadback)),
        Entry::Barriers(vec![to_host(Resource::RadianceReadback), to_host(Resource::IdentityReadback)]),
    ]);
    entries
}

/// Copies drawn images to buffers, adds reflections of the craft where it is traced, and computes another image where it is `resampled`.
fn computed(resampled: Option<Sampled>, wanted: &Wanted, shown: Resource) -> Vec<Entry> {
    let Wanted { shows, texels, .. } = *wanted;
    let mean = resampled.and_then(|sampled| sampled.mean);
    let lit = if mean.is_some() { Resource::Mean } else { Resource::DrawnRadiance };
    let mut copies = vec![("copy radiance", Resource::RadianceImage, Resource::DrawnRadiance)];
    copies.extend(resampled.map(|_| ("copy identity", Resource::IdentityImage, Resource::DrawnIdentity)));
    copies.extend(mean.map(|_| ("copy mean", Resource::MeanImage, Resource::Mean)));
    copies.extend(shows.traced.then_some(("copy surfaces", Resource::SurfaceImage, Resource::Surface)));
    // The passes of the last image may still use the buffers that this one replaces.
    let used = scope(S::COMPUTE_SHADER | S::COPY, A::SHADER_STORAGE_WRITE);
    let written = copies.iter().map(|(_, _, to)| barrier(*to, used, COPY_WRITE));
    let mut entries = vec![Entry::Barriers(written.collect())];
    entries.extend(copies.iter().map(|(name, from, to)| Entry::Pass(copy_pass(name, *from, *to))));
    let added = scope(S::COMPUTE_SHADER, A::SHADER_STORAGE_READ | A::SHADER_STORAGE_WRITE);
    let read = copies
        .iter()
        .map(|(_, _, to)| barrier(*to, COPY_WRITE, if shows.traced && *to == lit { added } else { COMPUTE_READ }));
    let mut read: Vec<_> = read.collect();
    if shows.traced {
        entries.push(Entry::Barriers(std::mem::take(&mut read)));
        entries.extend(traced_passes(shows, lit, texels, shown).into_iter().map(Entry::Pass));
        read.push(barrier(lit, COMPUTE_WRITE, if resampled.is_some() { COMPUTE_READ } else { COPY_READ }));
    }
    let Some(sampled) = resampled else {
        entries.push(Entry::Barriers(read));
        return entries;
    };
    read.push(barrier(Resource::ImageRadiance, COPIED, COMPUTE_WRITE));
    read.push(barrier(Resource::ImageIdentity, COPIED, COMPUTE_WRITE));
    entries.extend([
        Entry::Barriers(read),
        Entry::Pass(if sampled.distance == Distance::Far {
            distant_pass(sampled, shows)
        } else {
            resample_pass(sampled)
        }),
        Entry::Barriers(vec![
            barrier(Resource::ImageRadiance, COMPUTE_WRITE, COPY_READ),
            barrier(Resource::ImageIdentity, COMPUTE_WRITE, COPY_READ),
        ]),
    ]);
    entries
}

/// Whether nodes of the ranges keep a state between steps.
fn has_state(ranges: &[StepRange]) -> bool {
    ranges.iter().any(|range| range.variant.kind.has_state())
}

/// Whether that state has three numbers.
fn has_full_state(ranges: &[StepRange]) -> bool {
    ranges.iter().any(|range| range.variant.kind.has_full_state())
}

/// The resources of that state, without the temperature.
fn state_of(ranges: &[StepRange]) -> impl Iterator<Item = Resource> {
    let (any, full) = (has_state(ranges), has_full_state(ranges));
    let all = [(full, Resource::Target), (any, Resource::Span), (full, Resource::Elapsed)];
    all.into_iter().filter_map(|(present, resource)| present.then_some(resource))
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
