//! Heat that the parts of a scene absorb, summed on the device over runs of nodes.

pub(crate) mod tables;

use self::tables::HeatOf;
use super::thermal::{TARGET, TEMPERATURE};
use crate::gpu::layout::HeatPass;
use crate::gpu::pass::{COMPUTE_READ, COMPUTE_WRITE, Frame, HOST_READ, Pass, barrier, scope};
use crate::gpu::resource::Role::{Storage, ToHost};
use crate::gpu::resource::{GROUP, Per, Resource, made, resources};
use crate::gpu::scene_data::only;
use crate::gpu::shaders::Shader;
use ash::vk::{AccessFlags2 as A, PipelineStageFlags2 as S};

resources! {
    /// Groups and emission of every run of nodes whose absorbed heat is summed.
    HEAT_RUNS = Resource::new("HeatRuns", 16, Storage, Per::Scene, |data| data.heat.map_or(0, |heat| heat.runs.len()))
            .filled(|data| data.heat.map_or_else(Default::default, |heat| made(&heat.words())));
    /// Area over which every node absorbs [m2].
    HEAT_AREAS =
        Resource::new("HeatAreas", GROUP, Storage, Per::Node, |data| only(data.heat.is_some(), data.groups()))
            .filled(|data| {
            let areas = |areas: &[f64]| areas.iter().map(|area| *area as f32).collect::<Vec<f32>>();
            data.heat.map_or_else(Default::default, |heat| made(&areas(&heat.areas)))
        });
    /// Heat that every run absorbs in a step [W].
    ABSORBED_HEAT =
        Resource::new("AbsorbedHeat", 4, ToHost, Per::Scene, |data| data.heat.map_or(0, |heat| heat.runs.len()))
            .each_slot();
}

/// Places where heat is found, each with its first run and the one after the last.
pub(crate) type HeatSections = Vec<(HeatOf, (u32, u32))>;

/// Sums the absorbed heat of sections. It follows the thermal step, and precedes the step of a network. `space` is the
/// fourth power of the radiative temperature of space [K4].
pub(crate) fn passes(frame: &mut Frame, sections: &[(HeatOf, (u32, u32))], space: f32) {
    if sections.is_empty() {
        return;
    }
    let reads = |targets: bool| sections.iter().any(|(of, _)| (*of == HeatOf::Target) == targets);
    let writers = scope(S::COMPUTE_SHADER | S::COPY, A::SHADER_STORAGE_WRITE | A::TRANSFER_WRITE);
    let temperatures = reads(false).then(|| barrier(&TEMPERATURE, COMPUTE_WRITE, COMPUTE_READ));
    frame.wait(temperatures.into_iter().chain(reads(true).then(|| barrier(&TARGET, writers, COMPUTE_READ))));
    for (number, (of, (first, end))) in sections.iter().enumerate() {
        if number > 0 {
            // Sections write different places of one buffer.
            frame.wait([barrier(&ABSORBED_HEAT, COMPUTE_WRITE, COMPUTE_WRITE)]);
        }
        let words = [(*of == HeatOf::Target, "target"), (*of == HeatOf::Flux, "flux")];
        let shader = Shader::with("absorbed_heat.comp", &words);
        let constants = HeatPass { first: *first, background_temperature_4: space };
        frame.pass(Pass::dispatch(shader.name(), shader, end - first).told(&constants));
    }
    frame.wait([barrier(&ABSORBED_HEAT, COMPUTE_WRITE, HOST_READ)]);
}
