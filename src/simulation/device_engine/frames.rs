//! Frames of a device under way, and the results of steps that they become.

use std::collections::VecDeque;

use crate::gpu::effects::heat::tables::{HeatOf, HeatTables};
use crate::gpu::error::GpuError;
use crate::gpu::renderer::{Renderer, Submitted};
use crate::simulation::engine::Delivered;
use crate::simulation::image::Image;
use crate::trace::span;

/// Pixels of a block, whose values fit the first cache of a processor.
const BLOCK: usize = 1024;

/// What the fourth value of a pixel is, after radiance, temperature and depth.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Fourth {
    /// Nothing that is an output.
    Nothing,
    /// Share of the samples that show a surface.
    Coverage,
    /// Reflected radiance.
    Reflected,
}

/// A frame under way.
pub(super) struct Flying {
    pub(crate) submitted: Submitted,
    /// The image that was asked for, without pixels.
    pub(crate) image: Option<Image>,
    /// Heat that each run of network nodes absorbs in the step [W], where the host steps the network.
    pub(crate) heat: Option<Vec<f64>>,
}

/// Frames under way, and the results of those that ended before somebody asked for them.
pub(super) struct Frames {
    flying: VecDeque<Flying>,
    ready: VecDeque<Delivered>,
    /// Runs of nodes whose absorbed heat is summed.
    pub(crate) tables: Option<HeatTables>,
}

impl Frames {
    /// No frame yet.
    pub(crate) fn new(tables: Option<HeatTables>) -> Self {
        Self { flying: VecDeque::new(), ready: VecDeque::new(), tables }
    }

    /// Takes a frame that was submitted.
    pub(crate) fn push(&mut self, frame: Flying) {
        self.flying.push_back(frame);
    }

    /// Waits for all frames under way, because the host needs the device. `fourth` says what the fourth value of a pixel is.
    pub(crate) fn end(&mut self, renderer: &mut Renderer, fourth: Fourth) -> Result<(), GpuError> {
        while let Some(flying) = self.flying.pop_front() {
            let delivered = self.collect(renderer, flying, fourth)?;
            self.ready.push_back(delivered);
        }
        Ok(())
    }

    /// Keeps a result until somebody asks for it. No frame is under way.
    pub(crate) fn keep(&mut self, delivered: Delivered) {
        self.ready.push_back(delivered);
    }

    /// The oldest result that is ready.
    pub(crate) fn ready(&mut self) -> Option<Delivered> {
        self.ready.pop_front()
    }

    /// The oldest frame under way.
    pub(crate) fn oldest(&mut self) -> Option<Flying> {
        self.flying.pop_front()
    }

    /// Waits for a frame, and makes it the result of a step. `fourth` says what the fourth value of a pixel is.
    pub(crate) fn collect(
        &self,
        renderer: &mut Renderer,
        flying: Flying,
        fourth: Fourth,
    ) -> Result<Delivered, GpuError> {
        let collected = renderer.collect(flying.submitted)?;
        let _reads = span("reading what the device found");
        let mut absorbed: Option<Vec<f64>> =
            collected.absorbed.map(|heat| heat.iter().map(|watts| f64::from(*watts)).collect());
        if let (Some(tables), Some(of_network)) = (&self.tables, flying.heat) {
            let absorbed = absorbed.get_or_insert_with(|| vec![0.0; tables.runs.len()]);
            for (number, _) in tables.runs.iter().enumerate().filter(|(_, run)| run.of == HeatOf::Flux) {
                absorbed[number] = of_network[number];
            }
        }
        let pixels = collected.radiance.zip(collected.identity);
        let image = flying.image.zip(pixels).map(|(image, (values, labels))| {
            let mut image = image;
            let fourth = match fourth {
                Fourth::Nothing => None,
                Fourth::Coverage => Some(&mut image.coverage),
                Fourth::Reflected => Some(&mut image.reflected),
            };
            let [radiance, temperature, depth] = [&mut image.radiance, &mut image.temperature, &mut image.depth];
            split(values, [Some(radiance), Some(temperature), Some(depth), fourth]);
            split(labels, [Some(&mut image.part), Some(&mut image.material)]);
            image.with_readings(collected.readings.as_deref())
        });
        Ok(Delivered { image, temperatures: collected.temperatures.map(<[f32]>::to_vec), absorbed })
    }
}

/// Appends the values of all pixels to the list of each. Pixels are taken in blocks, so that memory is read once.
fn split<T: Copy, const N: usize>(pixels: &[[T; N]], mut lists: [Option<&mut Vec<T>>; N]) {
    lists.iter_mut().flatten().for_each(|list| list.reserve_exact(pixels.len()));
    for block in pixels.chunks(BLOCK) {
        for (place, list) in lists.iter_mut().enumerate() {
            let Some(list) = list else { continue };
            list.extend(block.iter().map(|pixel| pixel[place]));
        }
    }
}
