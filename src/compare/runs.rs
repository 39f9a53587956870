//! Runs the scene under the three responses and keeps all temperatures and some views.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use rayon::prelude::*;

use super::differences::{Differences, Vertices};
use super::record::Record;
use super::responses::{self, OfMaterial};
use super::{CompareError, INSTANT, NETWORK, RESPONSES, TRANSITION, walk};
use crate::model::nodes::GROUP;
use crate::output::clock::Seconds;
use crate::output::job::check_finite;
use crate::output::series::TemperatureSeries;
use crate::output::statistics::Percentiles;
use crate::output::tables::NodeGroups;
use crate::output::views::Views;
use crate::scene::{Draw, Scene};
use crate::simulation::engine::{Engine, EngineError};
use crate::simulation::orbits::Periodic;
use crate::simulation::prepare::Prepared;
use crate::simulation::target::Target;
use crate::simulation::{is_drawn, start};

/// Most steps that are shown as pictures.
pub(crate) const MOST_VIEWS: usize = 6;
/// Most pixels in all views together. Large images have fewer views.
const MOST_PIXELS: usize = 1 << 26;

pub(crate) enum Progress {
    /// A run begins: its index and number of steps. 0 if the length of its warm-up is unknown.
    Begins(usize, u64),
    /// A step, or an orbit of a periodic warm-up, is done.
    Stepped,
}

/// Cost of a run, in wall times on the host, measured in the same way for every response.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Cost {
    /// A thermal step [ms] from its submission until it is done, including the network.
    pub(crate) step: Option<Percentiles>,
    /// An image [ms] from its submission until radiance, temperature and labels are on the host.
    pub(crate) image: Option<Percentiles>,
    /// Mean device time of the thermal passes of a step [ms], without warm-up. For a network it includes only the
    /// loads.
    pub(crate) device_step_ms: Option<f64>,
    /// Steps of the warm-up, if its length is fixed.
    pub(crate) warm_up: u64,
    /// Wall time of the warm-up [s].
    pub(crate) warm_up_s: f64,
    /// Wall time of the run with start-up and warm-up but without pictures [s].
    pub(crate) wall_s: f64,
}

pub(crate) struct ComparedRun {
    pub(crate) prepared: Prepared,
    /// Temperatures of parts, materials and probes.
    pub(crate) series: TemperatureSeries,
    pub(crate) cost: Cost,
    pub(crate) periodic: Option<Periodic>,
    /// Settings and work of its network.
    pub(crate) network: Vec<(String, String)>,
    /// Differences from the network, empty for the network itself.
    pub(crate) differences: Differences,
    /// Lowest and highest temperature of each vertex [K].
    range: Vec<[f32; 2]>,
    /// Temperature and part of each pixel at the shown steps.
    images: Vec<(Vec<f32>, Vec<u32>)>,
}

pub(crate) struct Runs {
    /// The runs in the order of `RESPONSES`.
    pub(crate) ran: Vec<ComparedRun>,
    pub(crate) materials: Vec<OfMaterial>,
    /// The vertices, which all runs share.
    pub(crate) vertices: Vertices,
    /// The shown steps.
    pub(crate) views: Vec<Views>,
    pub(crate) device: String,
}

impl Runs {
    /// Warm-ups that did not become periodic, and fits that are not to be trusted.
    pub(crate) fn warnings(&self) -> Vec<String> {
        let mut warnings: Vec<String> = RESPONSES
            .iter()
            .zip(&self.ran)
            .filter_map(|(name, ran)| ran.periodic?.warning(&format!(" of '{name}'")))
            .collect();
        let ComparedRun { prepared, periodic, .. } = &self.ran[TRANSITION];
        let time = &prepared.scene.time;
        let orbits = periodic.map_or(0.0, |periodic| f64::from(periodic.orbits) * prepared.scene.orbit.period());
        let steps = f64::from(prepared.warm_up_steps()) + orbits / time.step + f64::from(time.steps);
        for material in &self.materials {
            warnings.extend(responses::fit_warnings(material, steps, time.step));
        }
        warnings
    }

    /// Parts in descending order of the difference between `instant` and the network. Parts without area are left out.
    pub(crate) fn farthest_parts(&self) -> Vec<usize> {
        let parts = &self.ran[INSTANT].differences.parts;
        let mut order: Vec<usize> = (0..parts.len()).filter(|part| parts[*part].area > 0.0).collect();
        order.sort_by(|a, b| parts[*b].rms().total_cmp(&parts[*a].rms()).then(a.cmp(b)));
        order
    }
}

/// The shown steps: the drawn steps, thinned evenly to `most`.
pub(crate) fn shown_steps(draw: &Draw, steps: u32, most: usize) -> Vec<u32> {
    let drawn: Vec<u32> = (0..=steps).filter(|step| is_drawn(draw, *step)).collect();
    let count = drawn.len().min(most);
    // The middles of equal shares avoid the ends, and include both noon and midnight of an orbit.
    (0..count).map(|i| drawn[(2 * i + 1) * drawn.len() / (2 * count)]).collect()
}

/// Runs the scene as network, instant and transition, in this order. Transitions are fitted to the range of balance
/// temperatures in the instant run.
///
/// # Errors
/// A scene that cannot be compared, a device error, or Ctrl-C.
pub(crate) fn all(
    scene: &Scene,
    target: &Target,
    folder: &Path,
    stop: &AtomicBool,
    progress: &dyn Fn(Progress),
    prepared_network: Prepared,
) -> Result<Runs, CompareError> {
    let vertices = vertices(&prepared_network);
    let pixels = scene.camera.as_ref().map_or(1, |camera| camera.width as usize * camera.height as usize);
    let most = (MOST_PIXELS / (3 * pixels)).clamp(1, MOST_VIEWS);
    let shown = match scene.camera {
        Some(_) => shown_steps(&scene.time.draw, scene.time.steps, most),
        None => Vec::new(),
    };
    let mut record = Record::new(folder, vertices.areas.len())?;
    let setting = RunSetting { target, stop, progress, vertices: &vertices, shown: &shown };
    let network = setting.run(NETWORK, prepared_network, &mut Held::Recorded(&mut record))?;
    // A step ends at the load of its last part, so all runs need the same parts.
    let mut prepared = responses::instant(scene, &mut |_| ())?;
    prepared.loads.take_parts_of(&network.prepared.loads);
    let instant = setting.run(INSTANT, prepared, &mut Held::Against(&mut record))?;
    let of_vertices = vertices.materials.iter().zip(&vertices.areas).zip(&instant.range);
    let of_vertices = of_vertices.map(|((material, area), range)| (*material, *area, *range));
    let swings = walk::swings(instant.prepared.materials.len(), of_vertices);
    let materials = responses::transitions(&network.prepared, &swings)?;
    let mut prepared = responses::transition(scene, &materials, &mut |_| ())?;
    prepared.loads.take_parts_of(&network.prepared.loads);
    let transition = setting.run(TRANSITION, prepared, &mut Held::Against(&mut record))?;

    let mut ran = vec![instant, transition, network];
    let views = views(&mut ran, &shown);
    Ok(Runs { ran, materials, vertices, views, device: target.name() })
}

fn vertices(prepared: &Prepared) -> Vertices {
    let nodes = &prepared.nodes;
    let by_vertex = |group: &[u32]| nodes.node_of_vertex.iter().map(|node| group[*node as usize / GROUP]).collect();
    Vertices {
        areas: nodes.node_of_vertex.iter().map(|node| nodes.areas[*node as usize]).collect(),
        parts: by_vertex(&nodes.group_part),
        materials: by_vertex(&nodes.group_material),
        positions: nodes.node_of_vertex.iter().map(|node| nodes.positions[*node as usize].to_array()).collect(),
    }
}

fn views(ran: &mut [ComparedRun], shown: &[u32]) -> Vec<Views> {
    let Some(camera) = ran[NETWORK].prepared.scene.camera.clone() else { return Vec::new() };
    let time = ran[NETWORK].prepared.scene.time.step;
    let sky = ran[NETWORK].prepared.loads.sky_model().clone();
    let mut images: Vec<std::vec::IntoIter<_>> =
        ran.iter_mut().map(|one| std::mem::take(&mut one.images).into_iter()).collect();
    let view = |step: &u32| {
        let mut temperatures = Vec::new();
        let mut parts: Vec<Vec<u32>> = Vec::new();
        for (temperature, part) in images.iter_mut().filter_map(Iterator::next) {
            temperatures.push(temperature);
            parts.push(part);
        }
        let [first, second, third] = <[Vec<f32>; 3]>::try_from(temperatures).ok()?;
        // All runs share one mesh. Pixels with different parts are ties in depth and are left out.
        let mut part = parts.pop()?;
        for other in &parts {
            part.iter_mut().zip(other).filter(|(one, other)| *one != *other).for_each(|(one, _)| *one = 0);
        }
        let seconds = f64::from(*step) * time;
        let digits = Seconds::between(&[0.0, time]);
        let lit = match sky.lit_fraction(seconds) {
            lit if lit >= 1.0 => "in sunlight",
            lit if lit <= 0.0 => "in umbra",
            _ => "in penumbra",
        };
        Some(Views {
            step: *step,
            caption: format!("step {step}, t = {} s, {lit}", digits.of(seconds)),
            width: camera.width,
            height: camera.height,
            temperatures: [first, second, third],
            part,
        })
    };
    shown.iter().filter_map(view).collect()
}

/// The use of a run's temperatures.
enum Held<'a> {
    /// The run is the network: record them.
    Recorded(&'a mut Record),
    /// The run is another one: compare them with the network.
    Against(&'a mut Record),
}

/// The common settings of the runs.
struct RunSetting<'a> {
    target: &'a Target,
    stop: &'a AtomicBool,
    progress: &'a dyn Fn(Progress),
    vertices: &'a Vertices,
    shown: &'a [u32],
}

impl RunSetting<'_> {
    fn run(&self, number: usize, prepared: Prepared, held: &mut Held<'_>) -> Result<ComparedRun, CompareError> {
        let began = Instant::now();
        let scene = &prepared.scene;
        let camera = scene.camera.as_ref().filter(|_| !self.shown.is_empty());
        let time = &scene.time;
        let warm_up = u64::from(prepared.warm_up_steps());
        (self.progress)(Progress::Begins(number, warm_up + u64::from(time.steps) + 1));
        let mut engine = self.target.engine(&prepared, camera).map_err(EngineError::from)?;
        let before = Instant::now();
        let periodic = start(&prepared, &mut *engine, None, self.stop, &mut || (self.progress)(Progress::Stepped))?;
        let warm_up_s = before.elapsed().as_secs_f64();
        let (passes, passes_ms) = thermal_passes(&*engine);

        let groups = NodeGroups::new(&prepared)?;
        let names: Vec<String> = prepared.materials.iter().map(|material| material.name.clone()).collect();
        let probes: Vec<String> = scene.probes.iter().map(|probe| probe.name.clone()).collect();
        let mut series = TemperatureSeries::new(&prepared.parts, &names, &probes);
        let mut differences = Differences::new(self.vertices, prepared.parts.len());
        let mut range = vec![[f32::INFINITY, f32::NEG_INFINITY]; self.vertices.areas.len()];
        let mut images = Vec::new();
        let (mut step_ms, mut image_ms) = (Vec::new(), Vec::new());
        for step in 0..=time.steps {
            if self.stop.load(Ordering::Relaxed) {
                return Err(CompareError::Stopped);
            }
            let now = f64::from(step) * time.step;
            if step > 0 {
                step_ms.push(walk::advance(&prepared, &mut *engine, step)?);
            }
            let device = walk::temperatures(&mut *engine)?;
            check_finite(&prepared, step, &device)?;
            series.push(groups.row(now, &device, &prepared.probes)?)?;
            let of_vertex = walk::of_vertices(&prepared, &device);
            range.par_iter_mut().zip(&of_vertex).for_each(|(range, t)| *range = [range[0].min(*t), range[1].max(*t)]);
            match held {
                Held::Recorded(record) => record.push(&of_vertex)?,
                Held::Against(record) => differences.add(self.vertices, step, now, &of_vertex, &record.row(step)?),
            }
            if self.shown.binary_search(&step).is_ok() {
                let (ms, image) = walk::draw(&prepared, &mut *engine, now)?;
                image_ms.push(ms);
                images.extend(image.map(|image| (image.temperature, image.part)));
            }
            (self.progress)(Progress::Stepped);
        }
        let (all_passes, all_passes_ms) = thermal_passes(&*engine);
        let device_step_ms = (all_passes > passes).then(|| (all_passes_ms - passes_ms) / f64::from(time.steps));
        let cost = Cost {
            step: Percentiles::of(&step_ms),
            image: Percentiles::of(&image_ms),
            device_step_ms,
            warm_up,
            warm_up_s,
            wall_s: began.elapsed().as_secs_f64(),
        };
        let network = engine.network_description();
        Ok(ComparedRun { series, cost, periodic, network, differences, range, images, prepared })
    }
}

/// Number of thermal passes so far, and device time of the thermal and network passes [ms].
fn thermal_passes(engine: &dyn Engine) -> (usize, f64) {
    let passes = |start: &'static str| {
        engine.pass_times().into_iter().flatten().filter(move |(name, _)| name.starts_with(start))
    };
    let thermal = passes("thermal_step.");
    let network: f64 = passes("one_pass").map(|(_, times)| times.iter().sum::<f64>()).sum();
    thermal.fold((0, network), |(count, sum), (_, times)| (count + times.len(), sum + times.iter().sum::<f64>()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shown_steps_are_drawn_ones_spread_over_the_run() {
        assert_eq!(shown_steps(&Draw::Every(4), 12, 6), [0, 4, 8, 12]);
        assert_eq!(shown_steps(&Draw::Every(10), 360, 6), [30, 90, 150, 210, 270, 330]);
        assert_eq!(shown_steps(&Draw::Steps(vec![3, 5]), 12, 1), [5]);
        assert!(shown_steps(&Draw::None, 12, 6).is_empty());
    }
}
