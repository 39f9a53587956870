//! Takes a scene under one choice of responses through its steps and images.

use std::time::Instant;

use rayon::prelude::*;

use crate::simulation::engine::{Engine, EngineError, EngineStep, ImageMoments, Order};
use crate::simulation::image::Image;
use crate::simulation::parts::Passing;
use crate::simulation::prepare::Prepared;
use crate::simulation::surroundings::surroundings_at;
use crate::simulation::{moments, pose_at};

/// Takes a step that is not the start. Returns its wall time [ms].
///
/// # Errors
/// A call that fails.
pub(crate) fn advance(prepared: &Prepared, engine: &mut dyn Engine, step: u32) -> Result<f64, EngineError> {
    let length = prepared.scene.time.step;
    let end = f64::from(step) * length;
    let mut milliseconds = 0.0;
    for part in (Passing { start: end - length, end, steps: 1.0 }).parts(&prepared.loads) {
        milliseconds += advance_part(prepared, engine, part, false)?;
    }
    Ok(milliseconds)
}

/// Takes a part of a step. Returns its wall time [ms]. `keep` keeps the temperatures before the part, for images between them and those after it.
///
/// # Errors
/// A call that fails.
pub(crate) fn advance_part(
    prepared: &Prepared,
    engine: &mut dyn Engine,
    Passing { start, end, steps }: Passing,
    keep: bool,
) -> Result<f64, EngineError> {
    let load = prepared.loads.step_load(start, end);
    let began = Instant::now();
    let step = EngineStep { load: &load, steps, start, length: end - start };
    engine.submit(Some(step), Order { keep, ..Order::default() })?;
    engine.deliver()?;
    Ok(began.elapsed().as_secs_f64() * 1e3)
}

/// Temperatures of all nodes in device order, padding included [K].
///
/// # Errors
/// A call that fails.
pub(crate) fn temperatures(engine: &mut dyn Engine) -> Result<Vec<f32>, EngineError> {
    engine.submit(None, Order { temperatures: true, ..Order::default() })?;
    Ok(engine.deliver()?.temperatures.unwrap_or_default())
}

/// The values of vertices, from the values of nodes in device order.
pub(crate) fn of_vertices(prepared: &Prepared, of_nodes: &[f32]) -> Vec<f32> {
    prepared.nodes.node_of_vertex.par_iter().map(|node| of_nodes[*node as usize]).collect()
}

/// Draws the image of a time [s]. Returns it with its wall time [ms], where the scene has a camera.
///
/// # Errors
/// A call that fails.
pub(crate) fn draw(
    prepared: &Prepared,
    engine: &mut dyn Engine,
    time: f64,
) -> Result<(f64, Option<Image>), EngineError> {
    let joints = prepared.loads.joints_at(time).1;
    let pose = pose_at(prepared, time);
    let moments = moments(prepared, time, None);
    let moments = moments.as_ref().map(|moments| ImageMoments(moments));
    let surroundings = pose.and_then(|pose| surroundings_at(prepared, time, &pose));
    let began = Instant::now();
    engine.submit(None, Order { pose, joints: &joints, moments, surroundings, ..Order::default() })?;
    let pixels = engine.deliver()?.image;
    Ok((began.elapsed().as_secs_f64() * 1e3, pixels))
}

/// Mean lowest and mean highest temperature of each of `materials` [K], weighted by area, from the material, the area
/// and the lowest and highest temperature of every vertex.
pub(crate) fn swings(materials: usize, vertices: impl Iterator<Item = (u32, f64, [f32; 2])>) -> Vec<[f64; 2]> {
    let mut sums = vec![[0.0f64; 3]; materials];
    for (material, area, [low, high]) in vertices {
        let [whole, cold, hot] = &mut sums[material as usize];
        *whole += area;
        *cold += area * f64::from(low);
        *hot += area * f64::from(high);
    }
    // A material without nodes has no temperatures. Its transition has no effect.
    let mean = |[whole, cold, hot]: [f64; 3]| if whole > 0.0 { [cold / whole, hot / whole] } else { [250.0, 300.0] };
    sums.into_iter().map(mean).collect()
}
