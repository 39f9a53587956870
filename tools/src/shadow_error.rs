//! Compares shadows by depth map with shadows by rays: wrong nodes, wrong area and kelvin, by node density and map
//! resolution.

use std::sync::Arc;
use std::time::Instant;

use isotherm::Scene;
use isotherm::internals::{
    Context, DeviceData, PADDING, Prepared, Renderer, Request, ShadowMethod, ShadowSettings, WRONG_SHARE, facing,
    wrong_shadows,
};

use super::AnyError;

/// Number of positions in the orbit. The first is half a position after noon.
const PLACES: u32 = 8;

/// Results of one shadow method at every sunlit position.
struct Found {
    nodes: usize,
    texel_m: Option<f64>,
    /// Visible share of the Sun of the nodes that face it.
    seen: Vec<Vec<Option<f32>>>,
    /// Balance temperatures [K].
    temperatures: Vec<Vec<f32>>,
    /// Area of each node [m2]. It is 0 for padding.
    areas: Vec<f64>,
    /// Time to compute shadows and settle the nodes at one position [s].
    seconds: f64,
}

/// Prints a table.
pub fn measure(context: &Arc<Context>, scene: &Scene, edges: &[f64], resolutions: &[u32]) -> Result<(), AnyError> {
    println!(
        "Shadows of '{}' by depth against rays, in {PLACES} places of its orbit; nodes and area are of those that face the Sun,\n\
         wrong where the share of it is off by more than {WRONG_SHARE}; temperatures are those of balance, without any inertia.\n",
        scene.name
    );
    println!(
        "| longest edge [m] | nodes | map | texel [cm] | wrong nodes | wrong area | rms [K] | largest [K] | rms without shadows [K] \
         | by depth [ms] | by rays [ms] |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|");
    for edge in edges {
        let exact =
            found(context, scene, *edge, Some(ShadowSettings { method: ShadowMethod::Exact, ..Default::default() }))?;
        let without = apart(&found(context, scene, *edge, None)?, &exact);
        for resolution in resolutions {
            let settings =
                ShadowSettings { method: ShadowMethod::Depth, resolution: *resolution, ..Default::default() };
            let fast = found(context, scene, *edge, Some(settings))?;
            let wrong = wrong_shadows(&fast.seen, &exact.seen, &fast.areas).ok_or("no place is in sunlight")?;
            let [rms, most] = apart(&fast, &exact);
            println!(
                "| {edge} | {} | {resolution} | {:.1} | {:.2} % | {:.2} % | {rms:.2} | {most:.0} | {:.2} | {:.0} | {:.0} |",
                fast.nodes,
                1e2 * fast.texel_m.unwrap_or(0.0),
                1e2 * wrong.nodes,
                1e2 * wrong.area,
                without[0],
                1e3 * fast.seconds,
                1e3 * exact.seconds
            );
        }
    }
    Ok(())
}

fn found(context: &Arc<Context>, scene: &Scene, edge: f64, shadows: Option<ShadowSettings>) -> Result<Found, AnyError> {
    let mut scene = scene.clone();
    scene.density.model.max = Some(edge);
    scene.shadows = shadows;
    let prepared = Prepared::from_scene(scene, &mut |_| ())?;
    let device = DeviceData::new(&prepared);
    let mut renderer = Renderer::new(context, &device.scene_data(&prepared, None))?;
    let nodes = &prepared.nodes;
    let area_of = |vertex: &u32| if *vertex == PADDING { None } else { Some(*vertex) };
    let mut of = Found {
        nodes: nodes.count,
        texel_m: None,
        seen: vec![],
        temperatures: vec![],
        areas: nodes
            .vertex_of_node
            .iter()
            .zip(&nodes.areas)
            .map(|(v, area)| area_of(v).map_or(0.0, |_| *area))
            .collect(),
        seconds: f64::INFINITY,
    };
    let (period, step) = (prepared.scene.orbit.period(), prepared.scene.time.step);
    for place in 0..PLACES {
        let time = (f64::from(place) + 0.5) / f64::from(PLACES) * period;
        let load = prepared.loads.step_load(time, time + step);
        if load.sun.is_empty() {
            continue;
        }
        of.texel_m = of.texel_m.or(prepared.redraw().and_then(|mut redraw| Some(redraw.view(&load)?.texel)));
        let began = Instant::now();
        renderer.settle(&load)?;
        // The minimum, because the first ones compile.
        of.seconds = of.seconds.min(began.elapsed().as_secs_f64());
        if shadows.is_some() {
            let lit = facing(&prepared, &load).into_iter().zip(&of.areas).map(|(facing, area)| facing && *area > 0.0);
            of.seen.push(lit.zip(renderer.visibility()?).map(|(lit, seen)| lit.then_some(seen)).collect());
        }
        let submitted = renderer.submit(Request::default().and_temperatures())?;
        of.temperatures.push(renderer.collect(submitted)?.temperatures.unwrap_or_default().to_vec());
    }
    Ok(of)
}

/// Area-weighted rms and largest difference of temperatures [K].
fn apart(one: &Found, other: &Found) -> [f64; 2] {
    let pairs = one.temperatures.iter().zip(&other.temperatures).flat_map(|(a, b)| a.iter().zip(b).zip(&one.areas));
    let (mut sum, mut whole, mut most) = (0.0, 0.0, 0.0f64);
    for ((a, b), area) in pairs.filter(|(_, area)| **area > 0.0) {
        let difference = f64::from(*a) - f64::from(*b);
        sum += area * difference * difference;
        whole += area;
        most = most.max(difference.abs());
    }
    [(sum / whole).sqrt(), most]
}
