//! Measures how long finding sunlight on areas takes, and how far it is from sixteen times as many lines.

use std::time::Instant;

use isotherm::Scene;
use isotherm::internals::{LitArea, PADDING, Prepared};

use super::AnyError;

/// Directions of the Sun: a Fibonacci spiral (Swinbank and Purser 2006) over the sphere.
const DIRECTIONS: usize = 24;

/// Prints a table with a row for each longest edge [m] of the scene's model.
pub fn measure(scene: &Scene, edges: &[f64]) -> Result<(), AnyError> {
    println!("Sunlight on '{}' from {DIRECTIONS} directions, in the file's pose.\n", scene.name);
    println!("| longest edge [m] | nodes | found in [ms] | worst [ms] | lit share off, rms | largest | lit area off |");
    println!("|---|---|---|---|---|---|---|");
    for edge in edges {
        let mut scene = scene.clone();
        scene.density.model.max = Some(*edge);
        let prepared = Prepared::from_scene(scene, &mut |_| ())?;
        let drawn: Vec<usize> = (0..prepared.nodes.positions.len())
            .filter(|slot| prepared.nodes.vertex_of_node[*slot] != PADDING)
            .collect();
        let light = prepared.lit_areas(drawn.iter().copied()).ok_or("the scene has no Sun")?;
        let poses = prepared.loads.joints_at(0.0).1;
        let mut times = Vec::new();
        let mut found = Vec::new();
        for direction in (0..DIRECTIONS).map(spiral) {
            let begun = Instant::now();
            found.push(light.under(direction, &poses));
            times.push(1e3 * begun.elapsed().as_secs_f64());
        }
        times.sort_by(f64::total_cmp);
        let finer = light.with_lines(16);
        let areas: Vec<f64> = drawn.iter().map(|slot| prepared.nodes.areas[*slot]).collect();
        let [mut squares, mut all, mut largest, mut area_off] = [0.0f64; 4];
        for (direction, found) in (0..DIRECTIONS).map(spiral).zip(&found) {
            let truth = finer.under(direction, &poses);
            let lit =
                |lit: &[LitArea]| -> f64 { lit.iter().zip(&areas).map(|(lit, area)| area * lit.vector.length()).sum() };
            area_off = area_off.max((lit(found) / lit(&truth) - 1.0).abs());
            for ((found, truth), area) in found.iter().zip(&truth).zip(&areas) {
                let off = found.vector.distance(truth.vector);
                squares += area * off * off;
                all += area;
                largest = largest.max(off);
            }
        }
        println!(
            "| {edge} | {} | {:.1} | {:.1} | {:.4} | {largest:.2} | {:.2} % |",
            drawn.len(),
            times[times.len() / 2],
            times[times.len() - 1],
            (squares / all).sqrt(),
            100.0 * area_off
        );
    }
    Ok(())
}

fn spiral(number: usize) -> glam::DVec3 {
    let z = 1.0 - (2 * number + 1) as f64 / DIRECTIONS as f64;
    let (sine, cosine) = (number as f64 * 2.399_963_229_728_653).sin_cos();
    let across = (1.0 - z * z).sqrt();
    glam::DVec3::new(across * cosine, across * sine, z)
}
