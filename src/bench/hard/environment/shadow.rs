//! Hard case: the shadow edge of a disc that leaves a plate as the Sun sets.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::{DVec3, Vec3};

use super::Loose;
use crate::bench::hard::case::{CaseScale, HardCase};
use crate::environment::shadow::{Jointed, Occluders, Redraw, ShadowCasters, ShadowMethod};
use crate::environment::{StepLoad, SunSample};
use crate::gpu::context::Context;
use crate::gpu::effects::thermal::variant::StepKind;
use crate::gpu::renderer::Renderer;
use crate::gpu::scene_data::{NODES_PER_WORKGROUP, ShadowData};
use crate::gpu::shapes::Shapes;
use crate::simulation::target::Target;

/// Edge of the plate, height of the disc above it, and radius of the disc [m].
const EDGE: f64 = 4.0;
const HEIGHT: f64 = 2.0;
const RADIUS: f64 = 0.8;
/// Nodes along an edge of the plate, and number of disc corners.
const NODES: usize = 128;
const CORNERS: usize = 256;
/// Texels along an edge of the depth map.
const RESOLUTION: u32 = 1024;
/// Sun angle after which shadows are computed again [rad].
const REDRAW: f64 = 1e-3;

/// Positions of the plate nodes, the disc centre and the disc corners [m].
fn positions() -> Vec<DVec3> {
    let place = |i: usize| EDGE * ((i as f64 + 0.5) / NODES as f64 - 0.5);
    let plate = (0..NODES).flat_map(|i| (0..NODES).map(move |j| DVec3::new(place(i), place(j), 0.0)));
    let corner = |i: usize| {
        let (sine, cosine) = (2.0 * PI * i as f64 / CORNERS as f64).sin_cos();
        DVec3::new(RADIUS * cosine, RADIUS * sine, HEIGHT)
    };
    plate.chain([DVec3::new(0.0, 0.0, HEIGHT)]).chain((0..CORNERS).map(corner)).collect()
}

fn triangles() -> Vec<[u32; 3]> {
    let centre = (NODES * NODES) as u32;
    let corner = |i: usize| centre + 1 + (i % CORNERS) as u32;
    (0..CORNERS).map(|i| [centre, corner(i), corner(i + 1)]).collect()
}

/// Shifts of the shadow along X [m], from the middle of the plate until it has left.
fn shifts(scale: CaseScale) -> Vec<f64> {
    let count = scale.of(8, 15, 30);
    (0..=count).map(|step| (0.5 * EDGE + RADIUS) * f64::from(step) / f64::from(count)).collect()
}

fn load(shift: f64) -> StepLoad {
    let direction = DVec3::new(-shift, 0.0, HEIGHT).normalize();
    StepLoad {
        start: 0.0,
        sun: vec![SunSample { direction, flux: 1361.0 }],
        planet: None,
        albedo: None,
        background_temperature: 2.7,
        joints: Vec::new(),
    }
}

/// Shadow area that remains on the plate [m2].
fn area(shift: f64) -> f64 {
    // The part beyond the edge is a segment of the disc.
    let inside = ((0.5 * EDGE - shift) / RADIUS).clamp(-1.0, 1.0);
    RADIUS * RADIUS * (PI - inside.acos() + inside * (1.0 - inside * inside).sqrt())
}

fn bounds() -> [DVec3; 2] {
    [DVec3::new(-0.5 * EDGE, -0.5 * EDGE, 0.0), DVec3::new(0.5 * EDGE, 0.5 * EDGE, HEIGHT)]
}

fn redraw(angle: f64) -> Redraw {
    Redraw { bounds: vec![(0, bounds())], resolution: RESOLUTION, angle, found_for: None }
}

/// Largest error over all shifts, in percent of the whole shadow.
fn error(scale: CaseScale, mut visibility: impl FnMut(&StepLoad) -> Result<Vec<f64>, String>) -> Result<f64, String> {
    let cell = (EDGE / NODES as f64).powi(2);
    shifts(scale).into_iter().try_fold(0.0f64, |worst, shift| {
        let shares = visibility(&load(shift))?;
        let shaded: f64 = shares[..NODES * NODES].iter().map(|share| (1.0 - share) * cell).sum();
        Ok(worst.max(100.0 * (shaded - area(shift)).abs() / (PI * RADIUS * RADIUS)))
    })
}

fn on_reference(method: ShadowMethod, scale: CaseScale, angle: f64) -> Result<f64, String> {
    let nodes = positions()[..NODES * NODES].iter().map(|position| [*position, DVec3::Z]).collect();
    let casters = Jointed { positions: positions(), triangles: triangles(), joints: Vec::new() };
    let mut shadows = ShadowCasters::new(nodes, Vec::new(), casters, redraw(angle), method);
    let mut last = Vec::new();
    error(scale, |load| {
        if let Some(visibility) = shadows.visibility(load) {
            last = visibility;
        }
        Ok(last.clone())
    })
}

fn on_device(context: &Arc<Context>, method: ShadowMethod, scale: CaseScale) -> Result<f64, String> {
    let failed = |error: crate::gpu::error::GpuError| error.to_string();
    let (places, triangles) = (positions(), triangles());
    let tree = (method == ShadowMethod::Exact).then(|| Occluders::new(&places, &triangles));
    let mut positions: Vec<Vec3> = places.iter().map(|place| place.as_vec3()).collect();
    positions.resize(places.len().next_multiple_of(NODES_PER_WORKGROUP), Vec3::ZERO);
    let normals = vec![Vec3::Z; positions.len()];
    let nodes = Loose { kind: StepKind::Instant, shadow: true, normals, positions };
    let shadows = ShadowData { occluders: &triangles, redraw: redraw(REDRAW), tree: tree.as_ref() };
    let shapes = Shapes::default();
    let mut renderer = Renderer::new(context, &nodes.data(&shapes, Some(shadows))).map_err(failed)?;
    error(scale, |load| {
        renderer.settle(load).map_err(failed)?;
        Ok(renderer.visibility().map_err(failed)?.into_iter().map(f64::from).collect())
    })
}

/// The case by depth map and by rays.
pub(crate) fn cases() -> Vec<HardCase> {
    let case = |name: &str, method: ShadowMethod| {
        HardCase::new(
            format!("moving shadow edge, {name}"),
            "a disc 2 m above a plate of 128 x 128 nodes, whose shadow moves off its edge; area of the part of a disc",
            "% of the shadow",
            (1.0, "docs/numerics.md 6, lit area"),
        )
        .remedy("shadows are found again when the Sun has moved by more than a stated angle", "found once")
        .measured(
            move |target, scale| match target {
                Target::Device(context) => on_device(context, method, scale),
                Target::Reference => on_reference(method, scale, REDRAW),
            },
            move |_| on_reference(method, CaseScale::Small, PI).unwrap_or(f64::INFINITY),
        )
    };
    vec![case("depth map", ShadowMethod::Depth), case("rays", ShadowMethod::Exact)]
}
