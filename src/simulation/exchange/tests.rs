//! A hinge: a thin plate that turns beside a hot one, against the integral of the view factor over the hot plate at every pose.

use std::f64::consts::PI;

use glam::{DAffine3, DVec3};

use super::*;
use crate::environment::SunSample;
use crate::exchange::cast::{SPACE, cast_rays};
use crate::exchange::factors::Factors;
use crate::thermal::STEFAN_BOLTZMANN;
use crate::thermal::material::{Bulk, Optics, Response, Sides};
use crate::thermal::received::PlanetShares;

const SIZE: f64 = 2.0;
const CELLS: usize = 12;
const HOT: f64 = 400.0;
/// Heat capacity of the thin plate [J/(m2 K)].
const CAPACITY: f64 = 500.0;
const STEP: f64 = 10.0;
/// Rate of the hinge [rad/s], and the angles between which it opens.
const RATE: f64 = 0.2 * PI / 180.0;
const ANGLES: [f64; 2] = [PI / 6.0, 5.0 * PI / 6.0];

pub(in crate::simulation) fn black() -> Material {
    Material {
        name: "black".into(),
        front: Optics { absorptivity: 1.0, emissivity: 1.0 },
        sides: Sides::Outside,
        gloss: Default::default(),
        in_band: Default::default(),
        bulk: Bulk::default(),
        response: Response::Instant,
        transition: None,
        ranges: [None; 2],
        source: "test".into(),
    }
}

/// Two black plates with a common edge along y, the second one upright. It turns about y.
pub(in crate::simulation) fn craft(settings: ExchangeSettings) -> Arc<ExchangeCraft> {
    let mut surface = PatchSurface::default();
    for (joint, normal) in [(0u32, DVec3::Z), (1, DVec3::X)] {
        let first = surface.positions.len() as u32;
        let along = if joint == 0 { DVec3::X } else { DVec3::Z };
        for row in 0..=CELLS {
            for column in 0..=CELLS {
                let [u, v] = [row, column].map(|at| SIZE * at as f64 / CELLS as f64);
                surface.positions.push(u * along + v * DVec3::Y);
                surface.normals.push(normal);
                surface.areas.push(0.0);
                surface.parts.push(joint);
                surface.materials.push(0);
                surface.joints.push(joint);
            }
        }
        let across = CELLS as u32 + 1;
        for cell in 0..(CELLS * CELLS) as u32 {
            let a = first + cell / CELLS as u32 * across + cell % CELLS as u32;
            for [p, q, r] in [[a, a + across, a + across + 1], [a, a + across + 1, a + 1]] {
                // x cross y is z, and z cross y is -x.
                let triangle = if joint == 0 { [p, q, r] } else { [p, r, q] };
                triangle.iter().for_each(|node| surface.areas[*node as usize] += (SIZE / CELLS as f64).powi(2) / 6.0);
                surface.triangles.push(triangle);
            }
        }
    }
    let materials = [black()];
    let edge = (surface.areas.iter().sum::<f64>() / PATCHES).sqrt();
    let patches = Patches::resolved(&surface, &materials, edge, &NodeViews::new(&surface, &materials, &[]));
    Arc::new(ExchangeCraft {
        like: None,
        rays: RaysOfCraft::default(),
        shared: SharedRows::default(),
        in_use: ExchangesInUse::default(),
        defects: Defects::of(&surface, &materials),
        step: STEP,
        light_angle: LIGHT * settings.redraw_angle,
        mirrors: None,
        surface,
        patches,
        settings: ExchangeSettings { hold: settings.hold.or(Some(60.0)), ..settings },
    })
}

/// View factor from a point of the thin plate, at a distance from the hinge in the middle of its length, to the hot plate, at an angle between the two:
/// the integral of cos cos / (pi r^2), in strips that are fine beside the point.
fn view_factor(distance: f64, angle: f64) -> f64 {
    const STRIPS: usize = 240;
    let (sine, cosine) = angle.sin_cos();
    let mut sum = 0.0;
    for strip in 0..STRIPS {
        // Cubes bring strips close to the hinge.
        let [from, to] = [strip, strip + 1].map(|at| SIZE * (at as f64 / STRIPS as f64).powi(3));
        let x = 0.5 * (from + to);
        // In the plane across the hinge: along the thin plate, and away from it.
        let (along, away) = (x * cosine - distance, x * sine);
        let near = along.hypot(away);
        // Cosine at the point is away / r, at the strip distance * sine / r. The integral of 1 / r^4 over the strip's length, half on each side.
        let half = 0.5 * SIZE;
        let length = half / (near * near * (near * near + half * half)) + (half / near).atan() / near.powi(3);
        sum += away * distance * sine * length / PI * (to - from);
    }
    sum
}

/// The thin plate's temperature after a step under a flux that is absorbed [W/m2], in many small steps.
fn stepped(mut temperature: f64, absorbed: f64) -> f64 {
    for _ in 0..50 {
        temperature += STEP / 50.0 / CAPACITY * (absorbed - STEFAN_BOLTZMANN * temperature.powi(4));
    }
    temperature
}

/// Differences of the thin plate from the truth along its middle, largest and rms over steps [K], the stated staleness [deg] and how often rays were
/// cast. With `frozen` the rows keep the pose of the last turn by such an angle [rad].
fn hinge(settings: ExchangeSettings, frozen: f64) -> ([f64; 2], f64, u64) {
    let craft = craft(settings);
    let surface = &craft.surface;
    let pose = |angle: f64| vec![DAffine3::IDENTITY, DAffine3::from_rotation_y(0.5 * PI - angle)];
    let middle: Vec<usize> = (0..surface.positions.len())
        .filter(|node| {
            let place = surface.positions[*node];
            surface.joints[*node] == 1 && (place.y - 0.5 * SIZE).abs() < 1e-9 && (0.1..SIZE - 0.1).contains(&place.z)
        })
        .collect();
    let mut twin = ExchangeTwin::new(&craft, &pose(ANGLES[0]));
    let start = |node: &usize| HOT * view_factor(surface.positions[*node].z, ANGLES[0]).powf(0.25);
    let mut truth: Vec<f64> = middle.iter().map(start).collect();
    let mut found = truth.clone();
    let (mut most, mut squares, mut count, mut held) = (0.0f64, 0.0, 0.0, ANGLES[0]);
    for step in 0..((ANGLES[1] - ANGLES[0]) / RATE / STEP) as usize {
        let angle = ANGLES[0] + RATE * STEP * (step as f64 + 0.5);
        held = if angle - held >= frozen { angle } else { held };
        let load = StepLoad {
            start: STEP * step as f64,
            sun: Vec::new(),
            planet: None,
            albedo: None,
            background_temperature: 0.0,
            joints: pose(held),
        };
        let hot = |node: usize| if surface.joints[node] == 0 { HOT } else { 0.0 };
        let absorbed = twin.absorbed(&load, 1.0, hot, &Lit::default());
        for (place, node) in middle.iter().enumerate() {
            let flux = absorbed[craft.patches.of_node[*node][0] as usize];
            found[place] = stepped(found[place], flux);
            let exact = STEFAN_BOLTZMANN * HOT.powi(4) * view_factor(surface.positions[*node].z, angle);
            truth[place] = stepped(truth[place], exact);
            most = most.max((found[place] - truth[place]).abs());
            squares += (found[place] - truth[place]).powi(2);
            count += 1.0;
        }
    }
    ([most, (squares / count).sqrt()], twin.found.stalest.to_degrees(), twin.found.made)
}

/// The strip formula against Howell's C-14 for plates of equal size at a right angle, 0.20004, and long plates at an angle, where it is
/// (1 + (w cos - x) / r) / 2 at a point.
#[test]
fn the_integral_of_the_view_factor_is_right() {
    let points = 200;
    let near = |at: usize| SIZE * (at as f64 + 0.5) / points as f64;
    let middle: f64 = (0..points).map(|at| view_factor(near(at), 0.5 * PI)).sum::<f64>() / points as f64;
    // The middle of the length sees more than the mean of the plate, and less than of an endless one, 1 - sin(45 deg).
    assert!((0.20..0.2929).contains(&middle), "{middle}");
    let short = 1e-3;
    for angle in [0.6f64, 1.5, 2.4] {
        // Beside the hinge the plate is endless: half of one plus the cosine.
        let expected = 0.5 * (1.0 + angle.cos());
        assert!((view_factor(short, angle) - expected).abs() < 2e-3, "{angle}: {}", view_factor(short, angle));
    }
}

#[test]
fn a_thin_plate_on_a_hinge_is_as_warm_as_its_view_says() {
    let settings = ExchangeSettings::default();
    let ([most, rms], stale, made) = hinge(settings, 0.0);
    println!("default: {most:.2} K at most, {rms:.2} K rms, rows miss {stale:.2} deg, {made} poses");
    assert!(most < 3.0 && stale < 4.0 && made < 25, "{most} K, {stale} deg, {made}");
    let settings = ExchangeSettings { rays: 1024, ..settings };
    let fine = ExchangeSettings { redraw_angle: PI / 180.0, ..settings };
    let ([fine, rms], stale, made) = hinge(fine, 0.0);
    println!("1 deg: {fine:.2} K at most, {rms:.2} K rms, rows miss {stale:.2} deg, {made} poses");
    assert!(fine < 2.0 && stale < 1.01, "{fine} K, {stale} deg");
    // Rows that stay as the joint turns by 30 deg.
    let ([frozen, rms], ..) = hinge(settings, PI / 6.0);
    println!("frozen: {frozen:.2} K at most, {rms:.2} K rms");
    assert!(frozen > 6.0, "{frozen} K");
}

/// A wall along the Sun's way receives nothing but what the floor reflects, which goes with the cosine of the Sun's zenith angle. Light is held for up to 5 deg of it, and so it must be
/// right in the middle of this time, not at its start.
#[test]
fn light_that_is_held_arrives_in_the_middle_of_its_time() {
    let half = Material { front: Optics { absorptivity: 0.5, emissivity: 1.0 }, ..black() };
    let craft = craft(ExchangeSettings { rays: 256, ..ExchangeSettings::default() }).with_optics(&[half]);
    let exchange = craft.cast(&[]);
    // 1 deg a step, as in low orbit with steps of 15 s.
    let load = |step: u32| {
        let angle = (f64::from(step) - 60.0).to_radians();
        let sun = vec![SunSample { direction: DVec3::new(0.0, angle.sin(), angle.cos()), flux: 1000.0 }];
        let start = STEP * f64::from(step);
        StepLoad { start, sun, planet: None, albedo: None, background_temperature: 0.0, joints: Vec::new() }
    };
    let wall = exchange.patches.iter().position(|patch| patch.joint == 1).expect("a wall");
    let noon = exchange.light(&load(60), &Lit::default(), None).sunlight[wall];
    let mut twin = ExchangeTwin::new(&craft, &[]);
    let (mut late, mut renewal) = (0.0, craft.renewal());
    let (mut offs, mut count) = ([[0.0f64; 2]; 2], 0.0);
    for step in 0..=120 {
        let truth = (f64::from(step) - 60.0).to_radians().cos();
        let held = twin.absorbed(&load(step), 1.0, |_| 0.0, &Lit::default())[wall] / noon;
        if renewal.due(&load(step), 1.0, step == 0) == Due::All {
            late = exchange.light(&load(step), &Lit::default(), None).sunlight[wall] / noon;
        }
        // Light leads from the second finding on.
        if step >= 10 {
            let rises = if step < 60 { 1.0 } else { -1.0 };
            for (sums, light) in offs.iter_mut().zip([held, late]) {
                *sums = [sums[0] + (light - truth).powi(2), sums[1] + rises * (light - truth)];
            }
            count += 1.0;
        }
    }
    let [[rms, lag], [late_rms, late_lag]] = offs.map(|[squares, sum]| [(squares / count).sqrt(), -sum / count]);
    println!("{rms:.4} rms, {lag:.4} behind; {late_rms:.4} and {late_lag:.4} without");
    assert!(rms < 0.02 && lag.abs() < 0.003, "{rms}, {lag}");
    assert!(late_rms > 0.02 && late_lag > 0.012, "{late_rms}, {late_lag}");
}

/// The stated uncertainty of a thin plate's flux, by rays and by the size of patches, against the truth.
#[test]
fn the_stated_uncertainty_is_near_the_error() {
    for (rays, edge) in [(64, 0.2), (1024, 0.2), (4096, 0.7)] {
        let settings = ExchangeSettings { rays, patch_edge: Some(edge), ..ExchangeSettings::default() };
        let whole = craft(settings);
        let patches = Patches::new(&whole.surface, &[black()], edge, &[]).with_slopes(&whole.surface);
        let craft = ExchangeCraft { patches, ..(*whole).clone() };
        let exchange = craft.cast(&[]);
        let (patches, surface) = (&exchange.patches, &craft.surface);
        let sent: Vec<f64> =
            patches.iter().map(|patch| if patch.joint == 0 { STEFAN_BOLTZMANN * HOT.powi(4) } else { 0.0 }).collect();
        let light = CraftLight {
            sunlight: vec![0.0; sent.len()],
            reflected: vec![[0.0; 2]; sent.len()],
            ..CraftLight::default()
        };
        let absorbed = exchange.absorbed(&sent, &light);
        let stated = exchange.uncertainty(&exchange.errors(&sent, &light, None), &absorbed, None);
        let on_nodes = exchange.of_nodes(&absorbed, &vec![PlanetShares::ALL; absorbed.len()]);
        let (mut truly, mut told, mut count) = (0.0, 0.0, 0.0);
        for (node, faces) in on_nodes.iter().enumerate() {
            let place = surface.positions[node];
            if surface.joints[node] == 0 || (place.y - 0.5 * SIZE).abs() > 1e-9 || !(0.1..SIZE - 0.1).contains(&place.z)
            {
                continue;
            }
            let patch = craft.patches.of_node[node][0] as usize;
            let exact = STEFAN_BOLTZMANN * HOT.powi(4) * view_factor(place.z, 0.5 * PI);
            truly += (faces[0].absorbed - exact).powi(2);
            told += stated[patch].rays.hypot(stated[patch].size).powi(2);
            count += 1.0;
        }
        let [truly, told] = [truly, told].map(|sum: f64| (sum / count).sqrt());
        println!("{rays} rays, {edge} m: {truly:.1} W/m2 rms off, {told:.1} told");
        assert!(truly < 2.0 * told && told < 4.0 * truly, "{rays} rays, {edge} m: {truly} off, {told} told");
    }
}

#[test]
fn the_exchange_of_a_pose_is_found_once_while_it_is_in_use_or_among_the_last() {
    let craft = craft(ExchangeSettings { rays: 64, patch_edge: Some(0.7), ..ExchangeSettings::default() });
    let turned = |angle: f64| [DAffine3::IDENTITY, DAffine3::from_rotation_x(angle)];
    let (first, again) = (craft.find(&turned(0.1)), craft.find(&turned(0.1)));
    assert!(Arc::ptr_eq(&first, &again));
    assert!(!Arc::ptr_eq(&first, &craft.find(&turned(0.2))));
    // A copy may have other patches.
    assert!(!Arc::ptr_eq(&first, &(*craft).clone().find(&turned(0.1))));
    let unused = Arc::downgrade(&first);
    drop((first, again));
    assert!(unused.upgrade().is_some_and(|first| Arc::ptr_eq(&first, &craft.find(&turned(0.1)))), "it is held");
    (0..64).for_each(|more| drop(craft.find(&turned(0.3 + 0.01 * f64::from(more)))));
    assert!(unused.upgrade().is_none(), "it made room");
}

#[test]
fn rays_up_to_their_own_joint_end_where_rays_through_the_whole_craft_end() {
    let craft = craft(ExchangeSettings { rays: 256, patch_edge: Some(0.7), ..ExchangeSettings::default() });
    let ExchangeCraft { surface, patches, settings, .. } = &*craft;
    let jointed = JointedRays::new(surface, patches, settings.rays).expect("two joints");
    let count = patches.all.len() as u32;
    let turned = |angle: f64| {
        [DAffine3::from_rotation_z(0.4), DAffine3::from_rotation_z(0.4) * DAffine3::from_rotation_y(angle)]
    };
    let whole =
        |angle: f64| cast_rays(surface, patches, &Scenery::new(surface, &turned(angle)), settings.rays, 0..count);
    let differ = |a: &[u32], b: &[u32]| a.iter().zip(b).filter(|(a, b)| a != b).count() as f64 / a.len() as f64;
    for angle in [-0.6, 0.0, 0.5, 1.4, 3.0] {
        let off = differ(&jointed.cast(surface, patches, &turned(angle)), &whole(angle));
        assert!(off < 2e-3, "{angle}: {off} of the rays");
    }
    // Another pose has other ends.
    assert!(differ(&whole(0.0), &whole(-0.1)) > 0.01);
}

#[test]
fn a_packed_exchange_loses_nothing_and_takes_half_of_the_memory() {
    let craft = craft(ExchangeSettings { rays: 64, patch_edge: Some(0.7), ..ExchangeSettings::default() });
    let poses = [DAffine3::IDENTITY, DAffine3::from_rotation_x(0.1)];
    let scenery = Scenery::new(&craft.surface, &poses);
    let exchange = Exchange::cast(&craft.surface, &craft.patches, &scenery, &craft.settings);
    let rows = |exchange: &Exchange| {
        let Exchange { factors, infrared, for_light, .. } = exchange;
        16 * [&factors.shared, &infrared.between, &for_light.sunlight.between]
            .map(|rows| rows.entries.len())
            .iter()
            .sum::<usize>()
    };
    let packed = Arc::new(PackedExchange::new(exchange.clone()));
    let again = packed.unpack();
    assert!(again.factors == exchange.factors);
    assert!(again.infrared == exchange.infrared && **again.for_light == **exchange.for_light);
    let (packed, whole) = (packed.bytes(), rows(&exchange));
    println!("{packed} of {whole} B");
    assert!(2 * packed < whole, "{packed} of {whole} B");
}

#[test]
fn patches_around_one_centre_tell_no_gradient() {
    // A triangle in another one. The centres are apart by `off`.
    let flux = |off: f64| {
        let corners = [DVec3::new(0.0, 1.0, 0.0), DVec3::new(-0.8, -0.5, 0.0), DVec3::new(0.8, -0.5, 0.0)];
        let inner = corners.map(|at| 0.1 * at + off * DVec3::X);
        let surface = PatchSurface {
            positions: [corners, inner].concat(),
            normals: vec![DVec3::Z; 6],
            areas: vec![0.4, 0.4, 0.4, 0.004, 0.004, 0.004],
            parts: vec![0; 6],
            materials: vec![0, 0, 0, 1, 1, 1],
            joints: vec![0; 6],
            triangles: vec![[0, 1, 2], [3, 4, 5]],
        };
        let patches = Patches::new(&surface, &[black(), black()], 10.0, &[]).with_slopes(&surface);
        patches.slopes.differences(&[100.0, 0.0])
    };
    let [near, far] = [1e-9, 2.0].map(flux);
    println!("{near:?} {far:?}");
    assert!(near.iter().all(|flux| *flux < 1e-3), "{near:?}");
    assert!(far.iter().any(|flux| *flux > 20.0), "{far:?}");
}

/// Rays of a large patch seldom meet a small one. Where none did, that says little.
#[test]
fn a_small_patch_that_rays_of_others_miss_has_what_its_own_rays_tell() {
    let triangle = |at: DVec3, edge: f64| [at, at + edge * DVec3::X, at + edge * DVec3::Y];
    let surface = PatchSurface {
        positions: [triangle(DVec3::ZERO, 0.05), triangle(DVec3::Z, 1.4)].concat(),
        normals: vec![DVec3::Z; 6],
        areas: [[0.05 * 0.05 / 6.0; 3], [1.4 * 1.4 / 6.0; 3]].concat(),
        parts: vec![0, 0, 0, 1, 1, 1],
        materials: vec![0; 6],
        joints: vec![0; 6],
        triangles: vec![[0, 1, 2], [3, 4, 5]],
    };
    let patches = Patches::new(&surface, &[black()], 10.0, &[]);
    let (rays, met) = (1000, 20);
    // Rays of the small patch, and of the large one, which end in space.
    let ends: Vec<u32> = (0..2 * rays).map(|ray| if ray < met { 1 } else { SPACE }).collect();
    let factors = Factors::new(&patches.all, &ends, rays);
    let found = factors.shared.at(0, 1) / factors.areas[0];
    println!("{found} of the small patch's view");
    assert!((found - 0.02).abs() < 0.001, "{found}");
}
