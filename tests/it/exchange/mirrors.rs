//! Sunlight that patches mirror once, against closed forms: a mirror over a black plate, a trough, a mirror that turns, and the energy of all.

use glam::{DAffine3, DVec3};
use isotherm::internals::{
    CraftLight, Exchange, ExchangeSettings, Gloss, Lit, Material, Mirrored, Mirrors, Patches, Scenery, StepLoad,
    reflection,
};

use super::shapes::{Shapes, grey};
use crate::device::{dark, sunlight};

const SUN: f64 = 1361.0;

/// A face of absorptivity 0.1 that mirrors a share of the rest.
fn mirror(specular: f64, roughness: f64) -> Material {
    let gloss = Gloss { specular, roughness, ..Gloss::default() };
    Material { gloss: [gloss; 2], ..grey(0.1, 0.05) }
}

struct Found {
    exchange: Exchange,
    mirrored: Mirrored,
    light: CraftLight,
}

fn find(shapes: &Shapes, patch_edge: f64, load: &StepLoad) -> Found {
    let settings = ExchangeSettings {
        rays: 64,
        patch_edge: Some(patch_edge),
        specular_sunlight: true,
        ..ExchangeSettings::default()
    };
    let patches = Patches::new(&shapes.surface, &shapes.materials, patch_edge, &[]);
    let scenery = Scenery::new(&shapes.surface, &load.joints);
    let exchange = Exchange::cast(&shapes.surface, &patches, &scenery, &settings);
    let mirrors = Mirrors::new(&shapes.surface, &patches, settings.rays).expect("a patch mirrors");
    let mirrored = mirrors.mirrored(load);
    let light = exchange.light(load, &Lit::default(), Some(&mirrored));
    Found { exchange, mirrored, light }
}

impl Found {
    /// Mirrored sunlight that a part absorbs at once [W].
    fn absorbed_by(&self, part: u32) -> f64 {
        let patches = self.exchange.patches.iter().zip(&self.light.mirrored);
        patches.filter(|(patch, _)| patch.part == part).map(|(patch, flux)| patch.area * flux).sum()
    }
}

/// Light that comes along -x, which a mirror of 1 m x 1 m at 45 deg sends straight down. The Sun grazes the black floor.
fn from_the_side() -> StepLoad {
    StepLoad { sun: sunlight([(DVec3::X, SUN)]), ..dark(0.0) }
}

/// A black floor of 4 m x 4 m at z = 0, part 0, and the mirror 1 m above it, part 1, from x = 1 to 1 + cos(45 deg) and from y = 1 to 2.
fn periscope(material: Material) -> Shapes {
    let mut shapes = Shapes::default();
    shapes.plate(DVec3::ZERO, DVec3::X * 4.0, DVec3::Y * 4.0, 64, grey(1.0, 0.9));
    let half = 0.5f64.sqrt();
    shapes.plate(DVec3::ONE, DVec3::Y, DVec3::new(half, 0.0, half), 16, material);
    shapes
}

#[test]
fn a_mirror_at_45_deg_lights_the_floor_below_it() {
    // 0.9 x 0.8 of 1361 W/m2 on 1 m2 x cos(45 deg), all of which reaches the floor.
    let power = 0.9 * 0.8 * SUN * 0.5f64.sqrt();
    let whole = find(&periscope(mirror(0.8, 0.0)), 9.0, &from_the_side());
    assert_eq!(whole.exchange.patches.len(), 2);
    let found = whole.absorbed_by(0);
    println!("floor: {found:.6} W, exact {power:.6} W");
    assert!((found / power - 1.0).abs() < 1e-12, "{found} W against {power} W");
    assert_eq!(whole.mirrored.lost, [0.0, 0.0]);
    // The rest is diffuse.
    let own = whole.exchange.patches.iter().position(|patch| patch.part == 1).expect("the mirror");
    let diffuse = 0.9 * 0.2 * SUN * 0.5f64.sqrt();
    assert!((whole.light.reflected[own][1] / diffuse - 1.0).abs() < 1e-12, "{:?}", whole.light.reflected);
    let other = find(&periscope(mirror(0.7, 0.0)), 9.0, &from_the_side()).absorbed_by(0);
    assert!((other / power - 1.0).abs() > 0.1, "another mirror must not pass");

    // In small patches the lit area has the flux 0.9 x 0.8 x 1361 W/m2 x cos(45 deg) / cos(45 deg), and no light falls beside it.
    let fine = find(&periscope(mirror(0.8, 0.0)), 0.125, &from_the_side());
    assert!((fine.absorbed_by(0) / power - 1.0).abs() < 1e-12);
    let (flux, edge) = (0.9 * 0.8 * SUN, 1.0 + 0.5f64.sqrt());
    let (mut squares, mut inside) = (0.0, 0);
    for (patch, found) in fine.exchange.patches.iter().zip(&fine.light.mirrored).filter(|(patch, _)| patch.part == 0) {
        let beyond = |at: f64, low: f64, high: f64| (low - at).max(at - high);
        let outside = beyond(patch.centre.x, 1.0, edge).max(beyond(patch.centre.y, 1.0, 2.0));
        if outside > 0.13 {
            assert_eq!(*found, 0.0, "at {} m", patch.centre);
        } else if outside < -0.08 {
            squares += (found / flux - 1.0f64).powi(2);
            inside += 1;
        }
    }
    let rms = (squares / f64::from(inside)).sqrt();
    let mirrors = fine.exchange.patches.iter().filter(|patch| patch.part == 1).count();
    // Of so many independent rays.
    let noise = (0.125f64.powi(2) / 0.5f64.sqrt() * 32.0 * mirrors as f64).sqrt().recip();
    println!("lit patches: {inside}, flux off by {rms:.3} (rms), independent rays {noise:.3}");
    assert!(inside >= 20 && rms < noise && noise < 0.25, "{inside} patches, {rms}, {noise}");
}

#[test]
fn a_rough_mirror_spreads_its_light() {
    let [smooth, rough] = [0.0, 0.5].map(|roughness| find(&periscope(mirror(1.0, roughness)), 9.0, &from_the_side()));
    let lost = rough.mirrored.lost[1].max(rough.mirrored.lost[0]);
    let (all, some) = (smooth.absorbed_by(0), rough.absorbed_by(0));
    println!("smooth {all:.1} W, rough {some:.1} W, {lost:.3} of it to space");
    assert!((0.1..0.9).contains(&lost) && (some + lost * all < all * (1.0 + 1e-12)), "{some} {lost}");
    // Between grazing and normal incidence no light goes below the surface.
    for cosine in [0.05f64, 0.5, 1.0] {
        let sun = DVec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
        assert!((reflection(sun, DVec3::Z, 0.0, [0.3, 0.7]) - DVec3::new(-sun.x, 0.0, sun.z)).length() < 1e-15);
        for k in 0..400 {
            let facet = [(f64::from(k) + 0.5) / 400.0, (f64::from(k) * 0.618).fract()];
            let way = reflection(sun, DVec3::Z, 0.6, facet);
            assert!(way.z > 0.0 && (way.length() - 1.0).abs() < 1e-12, "{way}");
        }
    }
}

/// A parabolic trough z = x^2 / 4 of 2 m x 1 m. Its focal line is 1 m above its bottom.
fn trough(height: f64, width: f64) -> Shapes {
    let mut shapes = Shapes::default();
    shapes.plate(DVec3::new(-0.5 * width, 1.0, height), DVec3::X * width, -DVec3::Y, 4, grey(1.0, 0.9));
    shapes.part([128, 2], mirror(0.8, 0.0), |u, v| {
        let x = 2.0 * u - 1.0;
        [DVec3::new(x, v, 0.25 * x * x), DVec3::new(-0.5 * x, 0.0, 1.0).normalize()]
    });
    shapes
}

#[test]
fn a_trough_concentrates_sunlight_on_its_focal_line() {
    let load = StepLoad { sun: sunlight([(DVec3::Z, SUN)]), ..dark(0.0) };
    let width = 0.08;
    let focused = find(&trough(1.0, width), 0.05, &load);
    // 0.9 x 0.8 of the Sun on the aperture of 2 m2, on an absorber of 0.08 m2: 25 Suns less what the mirror takes.
    let found = focused.absorbed_by(0) / width;
    let exact = 0.9 * 0.8 * SUN * 2.0 / width;
    println!("absorber {found:.1} W/m2, exact {exact:.1} W/m2: {:.2} Suns", found / SUN);
    assert!((found / exact - 1.0).abs() < 2e-3, "{found} against {exact}");
    let beside = find(&trough(0.6, width), 0.05, &load).absorbed_by(0) / width;
    println!("out of focus {beside:.1} W/m2");
    assert!(beside < 0.5 * exact, "out of focus less light meets the absorber");
    let tilted = StepLoad { sun: sunlight([(DVec3::new(0.1, 0.0, 1.0).normalize(), SUN)]), ..dark(0.0) };
    assert!(find(&trough(1.0, width), 0.05, &tilted).absorbed_by(0) / width < 0.1 * exact, "the Sun beside the axis");
}

/// What is reflected at first is absorbed or leaves: diffusely to space, or mirrored past the craft.
#[test]
fn the_energy_of_mirrored_sunlight_balances() {
    let mut shapes = Shapes::default();
    shapes.plate(DVec3::ZERO, DVec3::X * 2.0, DVec3::Y * 2.0, 8, mirror(0.6, 0.1));
    shapes.plate(DVec3::ZERO, DVec3::Y * 2.0, DVec3::Z * 2.0, 8, mirror(0.9, 0.0));
    shapes.plate(DVec3::new(0.4, 0.4, 1.0), DVec3::X, DVec3::Y, 6, grey(0.3, 0.4));
    shapes.plate(DVec3::new(0.0, 2.0, 0.0), DVec3::X * 2.0, DVec3::Z * 1.5, 6, grey(0.8, 0.4));
    let directions = [[1.0, 0.3, 0.8], [0.9, -0.4, 1.0], [0.2, -0.5, 1.0]].map(DVec3::from_array);
    let load = StepLoad { sun: sunlight(directions.map(|way| (way.normalize(), 400.0))), ..dark(0.0) };
    let found = find(&shapes, 0.6, &load);
    let Found { exchange, mirrored, light } = &found;
    let absorbed = exchange.absorbed(&exchange.sent(&load, light, |_| 0.0), light);
    let (mut direct, mut absorbs, mut leaves, mut past) = (0.0, 0.0, 0.0, 0.0);
    for (number, patch) in exchange.patches.iter().enumerate() {
        let incident: f64 = load.sun.iter().map(|sun| sun.flux * sun.direction.dot(patch.normal).max(0.0)).sum();
        let reflected = (1.0 - patch.optics.absorptivity) * patch.area * incident;
        direct += reflected;
        absorbs += patch.area * absorbed[number];
        leaves += exchange.for_light.sunlight.space[number] * light.reflected[number][1];
        past += patch.gloss.specular * reflected * mirrored.lost[number];
    }
    let off = (absorbs + leaves + past) / direct - 1.0;
    println!("{direct:.1} W reflected, {absorbs:.1} W absorbed, {leaves:.1} W and {past:.1} W leave, off {off:.1e}");
    assert!(off.abs() < 1e-12, "{off}");
    assert!([absorbs, leaves, past].iter().all(|part| *part > 0.05 * direct));
    // Shares of each patch's light sum to 1: those that arrive, over the areas, and what leaves.
    for (from, patch) in exchange.patches.iter().enumerate().filter(|(_, patch)| patch.gloss.specular > 0.0) {
        let rows = exchange.patches.iter().enumerate();
        let arrives: f64 = rows.map(|(to, own)| mirrored.arrives.at(to, from as u32) * own.area / patch.area).sum();
        assert!((arrives + mirrored.lost[from] - 1.0).abs() < 1e-12, "patch {from}");
    }
    // With the whole share of the Sun and no mirror, other patches absorb other light.
    let diffuse = exchange.light(&load, &Lit::default(), None);
    assert!(diffuse.mirrored.is_empty());
    let apart = diffuse.sunlight.iter().zip(&light.sunlight).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(apart > 50.0, "a mirror changes what is absorbed: {apart} W/m2");
}

/// Rays of a mirror follow the present pose of its joint, without new trees.
#[test]
fn a_mirror_follows_its_joint() {
    let half = 0.5f64.sqrt();
    let mut shapes = Shapes::default();
    shapes.plate(DVec3::ZERO, DVec3::X * 4.0, DVec3::Y * 4.0, 32, grey(1.0, 0.9));
    // In the file it lies flat and looks down.
    shapes.plate(DVec3::ONE, DVec3::Y, DVec3::X, 16, mirror(0.8, 0.0));
    let first = shapes.surface.joints.len() - 17 * 17;
    shapes.surface.joints[first..].fill(1);
    let at = |turned_deg: f64| {
        let about = DVec3::new(1.0, 0.0, 1.0);
        let turn = DAffine3::from_rotation_y(-f64::to_radians(turned_deg));
        let pose = DAffine3::from_translation(about) * turn * DAffine3::from_translation(-about);
        find(&shapes, 9.0, &StepLoad { joints: vec![DAffine3::IDENTITY, pose], ..from_the_side() })
    };
    let power = 0.9 * 0.8 * SUN * half;
    let found = at(45.0).absorbed_by(0);
    assert!((found / power - 1.0).abs() < 1e-9, "{found} W against {power} W");
    // At 30 deg the light comes down at 30 deg from the vertical and still meets the floor: less of it is caught.
    let less = at(30.0).absorbed_by(0);
    assert!((less / (0.9 * 0.8 * SUN * 0.5) - 1.0).abs() < 1e-9, "{less} W");
    assert_eq!(at(0.0).absorbed_by(0), 0.0, "a flat mirror catches nothing of a Sun that grazes it");
}
