//! The rule of the silhouette: lit area vectors of all nodes sum up to the area that a craft shows to the Sun, as Embree counts it (tools/oracle).

use std::path::{Path, PathBuf};

use glam::{DAffine3, DVec3};
use isotherm::internals::{LitArea, PADDING, Prepared};

use super::craft::{Folder, prepared};

/// Largest share by which the sum over 100 directions, and the difference in any of them over the mean, may be off.
const BOUND: f64 = 2e-3;

/// A row of a table: unit vector to the Sun, and the part of the silhouette that receives light [m2].
fn table(name: &str) -> Vec<(DVec3, f64)> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/oracle").join(name);
    let text = std::fs::read_to_string(path).expect("the table is in the repository");
    let row = |line: &str| {
        let numbers: Vec<f64> = line.split(',').map(|number| number.parse().expect("a number")).collect();
        (DVec3::new(numbers[0], numbers[1], numbers[2]).normalize(), numbers[4])
    };
    text.lines().filter(|line| !line.starts_with(['#', 'x'])).map(row).collect()
}

/// Worst difference in a direction over the mean area, in one of so many directions, and difference of the sums over all directions.
fn apart(
    prepared: &Prepared,
    name: &str,
    every: usize,
    poses: &[DAffine3],
    scale: impl Fn(DVec3) -> f64,
) -> (f64, f64) {
    let table: Vec<(DVec3, f64)> = table(name).into_iter().step_by(every).collect();
    assert_eq!(table.len(), 100 / every);
    let nodes = &prepared.nodes;
    let slots: Vec<usize> =
        (0..nodes.vertex_of_node.len()).filter(|slot| nodes.vertex_of_node[*slot] != PADDING).collect();
    let light = prepared.lit_areas(slots.iter().copied()).expect("shadows are on");
    // Lit area of the craft [m2]: the sum over its nodes.
    let lit = |sun: DVec3| -> f64 {
        let areas = light.under(sun, poses);
        let of_node = |(slot, lit): (&usize, &LitArea)| {
            let vector = poses.get(nodes.joint(*slot) as usize).map_or(lit.vector, |pose| pose.matrix3 * lit.vector);
            prepared.light_area(*slot) * vector.dot(sun).max(0.0) * scale(nodes.positions[*slot].as_dvec3())
        };
        slots.iter().zip(&areas).map(of_node).sum()
    };
    let all: f64 = table.iter().map(|(_, area)| area).sum();
    let differences: Vec<f64> = table.iter().map(|(sun, area)| lit(*sun) - area).collect();
    let of_itself = differences.iter().zip(&table).map(|(off, (_, area))| (off / area).abs()).fold(0.0, f64::max);
    println!("{name}: the worst direction is {:.3} % of its own area off", 100.0 * of_itself);
    let worst = differences.iter().map(|difference| difference.abs()).fold(0.0, f64::max) / (all / table.len() as f64);
    (worst, differences.iter().sum::<f64>().abs() / all)
}

fn check(prepared: &Prepared, name: &str, poses: &[DAffine3]) {
    let (worst, sum) = apart(prepared, name, 1, poses, |_| 1.0);
    println!("{name}: worst {:.3} %, sum {:.4} %", 100.0 * worst, 100.0 * sum);
    assert!(worst <= BOUND && sum <= BOUND, "{name}: worst {worst}, sum {sum}");
}

fn models() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("models")
}

/// The ISS with its arrays turned by fixed angles, or not at all. `None` where its model is not there.
fn iss(angles: [f64; 3]) -> Option<Prepared> {
    let model = models().join("../../shared/data/models/ISS_42.glb");
    if !model.exists() {
        println!("skipped: ../shared/data/models/ISS_42.glb is not there");
        return None;
    }
    let mut scene = std::fs::read_to_string(models().join("iss.toml")).expect("models/iss.toml is there");
    scene = scene.replace("../../shared/data/models/ISS_42.glb", "ISS_42.glb");
    // The same joints in the same order, each at its own angle.
    for angle in angles {
        let fixed = format!("mode = \"fixed\"\nangle_deg = {angle:.1}\n");
        scene = scene.replacen("mode = \"sun\"\n", &fixed, 1);
    }
    scene = scene.replace("sun_axis = \"+Z\"\nrate_deg = 0.15\n", "");
    let folder = Folder(tempfile::tempdir().expect("a temporary folder"));
    std::fs::copy(model, folder.path("ISS_42.glb")).expect("the model can be copied");
    Some(prepared(&folder.write("scene.toml", &scene)))
}

#[test]
fn the_station_is_lit_over_its_silhouette() {
    let station = prepared(&models().join("station.toml"));
    check(&station, "silhouette_station.csv", &[]);
    // One part in a hundred too much light on the port half must be seen.
    let (_, sum) = apart(&station, "silhouette_station.csv", 10, &[], |at| if at.y < 0.0 { 1.01 } else { 1.0 });
    assert!(sum > BOUND, "{sum}");
}

#[test]
fn the_iss_is_lit_over_its_silhouette() {
    let Some(iss) = iss([0.0; 3]) else { return };
    check(&iss, "silhouette_iss.csv", &[]);
}

#[test]
fn the_iss_is_lit_over_its_silhouette_with_its_arrays_turned() {
    let Some(iss) = iss([35.0, -50.0, 20.0]) else { return };
    let (_, poses) = iss.loads.joints_at(0.0);
    check(&iss, "silhouette_iss_turned.csv", &poses);
    // In the file's pose the arrays show another area.
    let (worst, _) = apart(&iss, "silhouette_iss_turned.csv", 10, &[], |_| 1.0);
    assert!(worst > 10.0 * BOUND, "{worst}");
}
