//! What a scene's frames do, step by step: the state of its effects on the host, without a device.

use super::effects::exchange::state::Exchanging;
use super::effects::heat::HeatSections;
use super::effects::heat::tables::{HeatOf, HeatTables};
use super::effects::image::ImageRecipe;
use super::effects::image::culling::Culling;
use super::effects::image::runs::TriangleRun;
use super::effects::image::sampling::{Distance, Sampled, SubFrame};
use super::effects::image::variant::RadianceVariant;
use super::effects::network::state::OnePass;
use super::effects::sensor::state::ImageSensor;
use super::effects::thermal::load::DeviceLoad;
use super::effects::thermal::ranges::{fused, idle, is_of_network, ranges_of_load, ranges_of_step, without_exchange};
use super::effects::thermal::variant::StepRange;
use super::frame::{Frame, NetworkSteps, Recipe, compose};
use super::layout::View;
use super::request::Request;
use super::scene_data::SceneData;
use crate::environment::StepLoad;
use crate::environment::shadow::LitAreas;

/// Kinds of light of a step: whether there is sunlight, and whether there is albedo.
const LIGHTS: [(bool, bool); 3] = [(true, true), (true, false), (false, false)];

/// State of the effects of a scene from frame to frame.
pub(crate) struct SceneFrames {
    pub(crate) ranges: Vec<StepRange>,
    /// Whether images are drawn.
    draws: bool,
    /// How images are made from finer ones, if they are.
    pub(crate) sampled: Option<Sampled>,
    pub(crate) triangles: Vec<TriangleRun>,
    pub(crate) culling: Culling,
    /// Whether images lie between steps.
    between: bool,
    /// Number of joints, counting the body.
    pub(crate) joints: u32,
    /// What finds the lit areas of the nodes, if normals do not tell the light.
    pub(crate) light: Option<LitAreas>,
    /// Radiation between surfaces, if the scene has it.
    pub(crate) exchange: Option<Exchanging>,
    /// Whether what nodes receive in the next step was found already.
    pub(crate) exchanged: bool,
    /// The network, if the frames step it.
    pub(crate) network: Option<OnePass>,
    /// Runs of nodes whose absorbed heat is summed, by the place where it is found.
    heat: HeatSections,
    /// The sensor, if the image has one.
    pub(crate) sensor: Option<ImageSensor>,
    /// Width and height of the largest image that is drawn, and of the one with one sample of a texel, from which the image
    /// of a distant craft is made [texels].
    pub(crate) drawn: [[u32; 2]; 2],
    /// What the pixels of an image show.
    shows: RadianceVariant,
    /// The load whose balance is the target of every node, if known.
    pub(crate) commanded: Option<DeviceLoad>,
}

impl SceneFrames {
    /// The state before the first step.
    pub(crate) fn new(data: &SceneData<'_>) -> Self {
        let triangles = data.runs();
        Self {
            ranges: data.ranges.clone(),
            draws: data.image.is_some(),
            sampled: data.sampled(),
            culling: Culling::new(&triangles, data.triangles, data.positions),
            triangles,
            between: data.between,
            joints: data.joint_count(),
            light: data.light.clone(),
            exchange: data.exchange.as_ref().map(Exchanging::new),
            exchanged: false,
            network: data.network.map(OnePass::new),
            heat: data.heat.map(HeatTables::sections).unwrap_or_default(),
            sensor: data.sensor.filter(|_| data.image.is_some()).map(ImageSensor::new),
            drawn: [data.drawn(), data.drawn_singly()].map(Option::unwrap_or_default),
            shows: data.shown.variant,
            commanded: None,
        }
    }

    /// Texels whose reflections of the craft itself are traced, if any are.
    pub(crate) fn texels(&self, is_distant: bool) -> u32 {
        let [width, height] = self.drawn[usize::from(is_distant)];
        width * height
    }

    /// Whether pixels of foil may have light of their own.
    pub(crate) fn has_pixel_changes(&self) -> bool {
        self.draws && self.shows.in_pixels
    }

    /// What the frame of a request does. `views` get the motion that culling tolerates, and `lit` tells that sunlight was found
    /// anew.
    pub(crate) fn recipe(&mut self, request: &Request<'_>, views: &mut [View], lit: bool) -> Recipe {
        let mut recipe = Recipe { keeps: request.keep, ..self.image(request, views) };
        let Some((load, steps)) = request.step else { return recipe };
        let (network, others): (Vec<StepRange>, Vec<StepRange>) =
            ranges_of_load(&self.ranges, load).into_iter().partition(|range| is_of_network(range.variant.kind));
        if !std::mem::take(&mut self.exchanged) {
            recipe.exchange = self.exchange_due(load, steps);
        }
        if request.absorbed {
            recipe.heat = (self.heat_sections(), load.background_temperature.powi(4) as f32);
        }
        // If the load is unchanged, a cheaper variant continues the transitions.
        let now = Some(DeviceLoad::new(load, self.joints));
        let holds = !lit && self.commanded == now && self.exchange.is_none();
        recipe.ranges = if holds { idle(&others) } else { others };
        self.commanded = now;
        // Where the host steps the network, its nodes have temperatures that the host has already written.
        if let Some(one) = &mut self.network {
            recipe.ranges.extend(network);
            recipe.network = Some(one.steps());
            one.pass(one.count);
        }
        recipe
    }

    /// The image of a request, and the readback of temperatures.
    fn image(&mut self, request: &Request<'_>, views: &mut [View]) -> Recipe {
        let is_far = request.pixels.is_crop();
        let sampled = self.sampled.map(|sampled| if is_far { sampled.far() } else { sampled });
        let is_gathered = sampled.is_some_and(|sampled| sampled.gathered > 1);
        if is_gathered || sampled.is_some_and(|sampled| sampled.shutter.is_some()) {
            // The view of the first row does not tell how the others moved, and each gathered sample has triangles of its own.
            self.culling.forget();
        }
        let culled = if is_gathered { self.triangles.clone() } else { self.culling.due(views) };
        let mut recipe = self.drawn_recipe(sampled, self.texels(is_far), culled, request.between);
        recipe.temperatures = request.temperatures;
        if views.is_empty() {
            (recipe.image, recipe.between) = (None, None);
        }
        let is_whole = request.sub_frame.is_none_or(SubFrame::is_last);
        if let Some(image) = &mut recipe.image {
            image.sub_frame = request.sub_frame;
        }
        if let (Some(sensor), Some(time), true) = (&mut self.sensor, request.time, recipe.image.is_some() && is_whole) {
            sensor.expose(time);
            recipe.sensor = Some(sensor.sensing());
        }
        recipe
    }

    /// An image of the scene. It lies `between` two steps, or shows the present temperatures.
    pub(crate) fn drawn_recipe(
        &self,
        sampled: Option<Sampled>,
        texels: u32,
        culled: Vec<TriangleRun>,
        between: Option<f32>,
    ) -> Recipe {
        Recipe {
            image: Some(ImageRecipe { sampled, shows: self.shows, texels, sub_frame: None, culled }),
            between: self.between.then(|| (self.ranges.clone(), between)),
            ..Recipe::default()
        }
    }

    /// What surfaces send to each other in a load that lasts `steps`, if it is found anew.
    pub(crate) fn exchange_due(&mut self, load: &StepLoad, steps: f64) -> Option<super::effects::exchange::Exchanged> {
        let light = ranges_of_load(&self.ranges, load).first()?.variant;
        self.exchange.as_mut()?.due(light, load, steps)
    }

    /// The sums of absorbed heat. Where the host steps the network, temperatures stand in the place of its flux.
    fn heat_sections(&self) -> HeatSections {
        let of_frame = |(of, _): &&(HeatOf, (u32, u32))| *of != HeatOf::Flux || self.network.is_some();
        self.heat.iter().filter(of_frame).copied().collect()
    }

    /// The passes under which temperatures of a thermal network's flux are read, before the host steps the network.
    pub(crate) fn flux(&mut self, load: &StepLoad, steps: Option<f64>) -> Recipe {
        let mut ranges = ranges_of_load(&self.ranges, load);
        ranges.retain(|range| is_of_network(range.variant.kind));
        let mut recipe = Recipe { temperatures: true, ..Recipe::default() };
        if let Some(steps) = steps {
            recipe.exchange = self.exchange_due(load, steps);
            self.exchanged = true;
            recipe.ranges = ranges;
        } else {
            recipe.ranges = without_exchange(ranges);
        }
        recipe
    }

    /// Many steps in one dispatch, with the light of the first.
    pub(crate) fn fused(&self, first: &StepLoad) -> Frame {
        let ranges = fused(&ranges_of_load(&self.ranges, first));
        // Timestamps of many steps get another name.
        compose(&Recipe { ranges, ..Recipe::default() }).named("forward")
    }

    /// What the second step of a run does, with all light that the scene has, with an image where images are drawn, and with its
    /// triangles culled. The first step also tries the step of a network.
    pub(crate) fn whole(&mut self) -> Recipe {
        let network = self.network.as_mut().map(|one| {
            one.prepare(1.0);
            NetworkSteps { age: one.count, ..one.steps() }
        });
        let recipe = self.lit_by(true, true);
        Recipe { keeps: self.between, network, ..recipe }
    }

    /// All that a step does but the network, under some kinds of light.
    fn lit_by(&self, sun: bool, albedo: bool) -> Recipe {
        let ranges = ranges_of_step(&self.ranges, sun, albedo);
        let light = ranges.first().map(|range| range.variant);
        Recipe {
            exchange: self.exchange.as_ref().zip(light).map(|(one, light)| one.exchanged(light, true)),
            ranges,
            heat: (self.heat_sections(), 0.0),
            temperatures: true,
            sensor: self.sensor.as_ref().map(ImageSensor::sensing),
            ..self.whole_image(self.sampled, self.texels(false))
        }
    }

    /// An image with all its triangles culled, where images are drawn.
    fn whole_image(&self, sampled: Option<Sampled>, texels: u32) -> Recipe {
        match self.draws {
            true => self.drawn_recipe(sampled, texels, self.triangles.clone(), Some(1.0)),
            false => Recipe::default(),
        }
    }

    /// The sub-frames of an exposure, where images are exposed.
    fn exposed(&self) -> Vec<Frame> {
        let Some(sampled) = self.sampled.filter(|sampled| sampled.exposed) else { return Vec::new() };
        let is_far = sampled.distance == Distance::MayBeFar;
        let sampled = std::iter::once((sampled, false)).chain(is_far.then(|| (sampled.far(), true)));
        let of = |(sampled, is_far), number| {
            let mut recipe = self.whole_image(Some(sampled), self.texels(is_far));
            if let Some(image) = &mut recipe.image {
                image.sub_frame = Some(SubFrame { number, count: 3 });
            }
            recipe.sensor = self.sensor.as_ref().filter(|_| number == 2).map(ImageSensor::sensing);
            compose(&recipe)
        };
        sampled.flat_map(|sampled| (0..3).map(move |number| of(sampled, number))).collect()
    }

    /// Frames with every pass that a run may record but fused ones, so that pipelines exist before it.
    pub(crate) fn every(&self) -> Vec<Frame> {
        let mut frames = vec![Frame::keep()];
        for (sun, albedo) in LIGHTS {
            let ranges = ranges_of_step(&self.ranges, sun, albedo);
            frames.push(compose(&self.lit_by(sun, albedo)));
            frames.push(Frame::settle(&ranges));
            if self.exchange.is_some() {
                frames.push(Frame::step(&without_exchange(ranges), Default::default()));
            }
        }
        frames.push(Frame::step(&idle(&self.ranges), Default::default()));
        if let Some(sampled) = self.sampled.filter(|sampled| sampled.distance == Distance::MayBeFar) {
            frames.push(compose(&self.whole_image(Some(sampled.far()), self.texels(true))));
        }
        frames.extend(self.exposed());
        frames
    }
}

impl OnePass {
    /// The steps of the next frame.
    fn steps(&self) -> NetworkSteps {
        let (shape, constants) = (self.tables.shape, self.constants.clone());
        NetworkSteps { shape, count: self.count, age: self.age, odd: self.odd, constants }
    }
}
