//! Exchange in f64 against closed forms: isothermal boxes, two plates, sunlight in a box, and the planet behind a plate.

use glam::DVec3;
use isotherm::internals::{Exchange, Lit, PlanetFromPatch, PlanetLoad, STEFAN_BOLTZMANN, StepLoad};

use super::shapes::{Shapes, grey};
use super::view_factors::exchange;
use crate::device::{dark, sunlight};

/// Net flux of each patch [W/m2] at these temperatures, positive where it loses heat.
fn net(exchange: &Exchange, load: &StepLoad, temperature: impl Fn(u32) -> f64 + Sync) -> Vec<f64> {
    let part_of_node = |node: usize| {
        let patch = exchange.of_node[node][0];
        exchange.patches[patch as usize].part
    };
    let light = exchange.light(load, &Lit::default(), None);
    let sent = exchange.sent(load, &light, |node| temperature(part_of_node(node)));
    let absorbed = exchange.absorbed(&sent, &light);
    let patches = exchange.patches.iter().zip(absorbed);
    patches
        .map(|(patch, in_)| patch.optics.emissivity * STEFAN_BOLTZMANN * temperature(patch.part).powi(4) - in_)
        .collect()
}

#[test]
fn nothing_flows_in_an_isothermal_box() {
    let mut shapes = Shapes::default();
    shapes.room(DVec3::new(1.0, 2.0, 0.5), 6, |wall| grey(0.5, [0.05, 0.9, 0.3, 1.0, 0.6, 0.2][wall]));
    let exchange = exchange(&shapes, 0.4, 64);
    let sent = STEFAN_BOLTZMANN * 300f64.powi(4);
    let most = |temperature: &(dyn Fn(u32) -> f64 + Sync)| {
        net(&exchange, &dark(0.0), temperature).into_iter().map(f64::abs).fold(0.0, f64::max)
    };
    assert!(most(&|_| 300.0) < 1e-9 * sent, "{}", most(&|_| 300.0) / sent);
    assert!(most(&|part| if part == 2 { 301.0 } else { 300.0 }) > 1e-3 * sent);
}

#[test]
fn what_patches_lose_space_gets() {
    let mut shapes = Shapes::default();
    shapes.plate(DVec3::ZERO, DVec3::X, DVec3::Y, 8, grey(0.3, 0.2));
    shapes.plate(DVec3::Z * 0.4, DVec3::Y, DVec3::X, 8, grey(0.3, 0.7));
    shapes.plate(DVec3::ZERO, DVec3::Y, DVec3::Z, 8, grey(0.3, 0.4));
    let exchange = exchange(&shapes, 0.3, 256);
    let temperature = |part: u32| [310.0, 250.0, 120.0][part as usize];
    let (mut lost, mut exchanged) = (0.0, 0.0);
    for (patch, net) in exchange.patches.iter().zip(net(&exchange, &dark(0.0), temperature)) {
        lost += patch.area * net;
        exchanged += patch.area * patch.optics.emissivity * STEFAN_BOLTZMANN * temperature(patch.part).powi(4);
    }
    let to_space: f64 = exchange
        .patches
        .iter()
        .zip(&exchange.infrared.space)
        .map(|(patch, area)| area * patch.optics.emissivity * STEFAN_BOLTZMANN * temperature(patch.part).powi(4))
        .sum();
    println!(
        "lost {lost:.6} W, to space {to_space:.6} W, off {:.1e} of what is exchanged",
        (lost - to_space) / exchanged
    );
    assert!((lost - to_space).abs() < 1e-12 * exchanged, "{lost} against {to_space}");
    assert!(to_space > 0.3 * exchanged);
}

/// Sheets that store no heat answer each other a step late. What one sends never comes back as more.
#[test]
fn sheets_without_heat_capacity_do_not_swing_up() {
    let mut shapes = Shapes::default();
    shapes.plate(DVec3::ZERO, DVec3::X, DVec3::Y, 6, grey(0.5, 0.9));
    shapes.plate(DVec3::Z * 0.05, DVec3::Y, DVec3::X, 6, grey(0.5, 0.9));
    let exchange = exchange(&shapes, 2.0, 256);
    let light = exchange.light(&dark(0.0), &Lit::default(), None);
    let mut fourth = [300f64.powi(4), 0.0];
    let mut whole = f64::INFINITY;
    for _ in 0..50 {
        let temperature = |node: usize| fourth[exchange.of_node[node][0] as usize].powf(0.25);
        let absorbed = exchange.absorbed(&exchange.sent(&dark(0.0), &light, temperature), &light);
        fourth = [0, 1].map(|patch| absorbed[patch] / (0.9 * STEFAN_BOLTZMANN));
        let now: f64 = fourth.iter().sum();
        assert!(now < whole && fourth.iter().all(|fourth| *fourth >= 0.0), "{now} after {whole}");
        whole = now;
    }
    assert!(whole < 0.1 * 300f64.powi(4), "it leaves through the gap: {whole}");
}

/// q = sigma (T1^4 - T2^4) / (1/e1 + 1/e2 - 1), between the walls of a flat box whose narrow sides take no heat: they are white.
#[test]
fn two_plates_reach_the_closed_form() {
    let mut shapes = Shapes::default();
    let (size, gap) = (1.0, 0.002);
    shapes.plate(DVec3::ZERO, DVec3::X * size, DVec3::Y * size, 8, grey(0.5, 0.1));
    shapes.plate(DVec3::Z * gap, DVec3::Y * size, DVec3::X * size, 8, grey(0.5, 0.9));
    let exchange = exchange(&shapes, 2.0, 4096);
    let flux: f64 = net(&exchange, &dark(0.0), |part| [350.0, 250.0][part as usize])[0];
    let driven = STEFAN_BOLTZMANN * (350f64.powi(4) - 250f64.powi(4));
    let closed = driven / (1.0 / 0.1 + 1.0 / 0.9 - 1.0);
    // A part of the light leaves through the gap.
    let open = exchange.factors.to_space(0);
    println!("flux {flux:.4} W/m2, closed form {closed:.4} W/m2, view factor to space {open:.1e}");
    assert!(open < 6e-3);
    let mut boxed = Shapes::default();
    boxed.room(
        DVec3::new(size, size, gap),
        8,
        |wall| if wall < 2 { grey(0.5, [0.1, 0.9][wall]) } else { grey(0.5, 1e-5) },
    );
    let exchange = super::view_factors::exchange(&boxed, 2.0, 4096);
    let flux: f64 = net(&exchange, &dark(0.0), |part| if part == 0 { 350.0 } else { 250.0 })[0];
    println!("in a box: {flux:.4} W/m2, off {:.1e}", flux / closed - 1.0);
    assert!((flux / closed - 1.0).abs() < 1e-3, "{flux} against {closed}");
}

/// q = sigma (T1^4 - T2^4) / (1/e1 + (A1/A2) (1/e2 - 1)) from a sphere in a shell. Most light that the shell reflects to the sphere comes by pairs of which each has little, on sides of
/// few patches. Patches of a convex body see each other by reflection alone.
#[test]
fn a_sphere_in_a_shell_that_reflects_loses_what_the_closed_form_says() {
    let mut shapes = Shapes::default();
    shapes.sphere(0.3, true, grey(0.5, 0.8)).sphere(0.7, false, grey(0.5, 0.4));
    let exchange = exchange(&shapes, 0.1, 4096);
    let fluxes = net(&exchange, &dark(0.0), |part| [320.0, 280.0][part as usize]);
    let of_part = |part: u32| exchange.patches.iter().zip(&fluxes).filter(move |(patch, _)| patch.part == part);
    let heat = |part: u32| of_part(part).map(|(patch, flux)| patch.area * flux).sum::<f64>();
    let area = |part: u32| of_part(part).map(|(patch, _)| patch.area).sum::<f64>();
    let driven = area(0) * STEFAN_BOLTZMANN * (320f64.powi(4) - 280f64.powi(4));
    let closed = driven / (1.0 / 0.8 + area(0) / area(1) * (1.0 / 0.4 - 1.0));
    println!("{} patches: {:.3} W, closed form {closed:.3} W", exchange.patches.len(), heat(0));
    assert!((heat(0) / closed - 1.0).abs() < 0.01, "{} against {closed}", heat(0));
    assert!((heat(1) / heat(0) + 1.0).abs() < 1e-9, "a closed shell keeps it");
}

/// All walls of a box of albedo 1/2 have received sunlight k times with the share 2^-k, so that the walls absorb together what enters.
#[test]
fn sunlight_in_a_box_ends_where_the_series_says() {
    let mut shapes = Shapes::default();
    shapes.room(DVec3::ONE, 4, |_| grey(0.5, 0.9));
    let load = StepLoad { sun: sunlight([(DVec3::Z, 1000.0)]), ..dark(0.0) };
    let exchange = exchange(&shapes, 1.5, 4096);
    let light = exchange.light(&load, &Lit::default(), None);
    let absorbed = exchange.absorbed(&exchange.sent(&load, &light, |_| 0.0), &light);
    // Only the floor, wall 0, looks at the Sun. It absorbs 500 W and reflects 500 W. With e_k the light that meets the floor, a side wall and the ceiling
    // after k reflections, e_(k+1) = F e_k / 2.
    let (opposite, beside) = (0.199825, 0.200044);
    let mut arrived = [0.0; 6];
    let mut radiosity = [500.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    for _ in 0..200 {
        let arrives: [f64; 6] = std::array::from_fn(|to| {
            (0..6)
                .filter(|from| *from != to)
                .map(|from| radiosity[from] * if from / 2 == to / 2 { opposite } else { beside })
                .sum()
        });
        (0..6).for_each(|wall| arrived[wall] += arrives[wall]);
        radiosity = arrives.map(|arrives| 0.5 * arrives);
    }
    for (patch, absorbed) in exchange.patches.iter().zip(&absorbed) {
        let expected = 0.5 * arrived[patch.part as usize];
        println!("wall {}: {absorbed:.4} W/m2, series {expected:.4}", patch.part);
        assert!((absorbed - expected).abs() < 2e-3 * 500.0, "wall {}: {absorbed} against {expected}", patch.part);
    }
    let all: f64 = exchange.patches.iter().zip(&absorbed).map(|(patch, absorbed)| patch.area * absorbed).sum();
    assert!((all - 500.0).abs() < 1e-6 * 500.0, "{all} W of 500 W");
}

/// A plate below a large one, which hides the middle of the planet. The reference integrates directions in rings.
#[test]
fn a_plate_hides_the_planet_behind_it() {
    let mut shapes = Shapes::default();
    shapes.plate(DVec3::new(-0.05, -0.05, 0.0), DVec3::X * 0.1, DVec3::Y * 0.1, 2, grey(0.5, 0.5));
    let half = 0.6;
    shapes.plate(DVec3::new(-half, -half, 0.5), DVec3::Y * 2.0 * half, DVec3::X * 2.0 * half, 8, grey(0.5, 0.5));
    let exchange = exchange(&shapes, 5.0, 4096);
    let nadir = DVec3::new(0.3, 0.1, 1.0).normalize();
    let planet = PlanetLoad {
        nadir,
        sunward: nadir.any_orthonormal_vector(),
        distance_ratio: 1.064,
        planet_ir: 237.0,
        albedo_flux: 400.0,
        sun_zenith: 1.2,
    };
    let load = StepLoad { planet: Some(planet.clone()), ..dark(0.0) };
    let seen = exchange.seen(&load)[0];
    // Brute force: directions by cosine, from points of the small plate.
    let sun = planet.sunward * planet.sun_zenith.sin() - nadir * planet.sun_zenith.cos();
    let mut sums = [0.0; 4];
    let n = 700;
    for place in 0..9 {
        let from = DVec3::new((place % 3 - 1) as f64, (place / 3 - 1) as f64, 0.0) * (0.1 / 3.0);
        for i in 0..n * n {
            let (u, v) = ((i % n) as f64 + 0.5, (i / n) as f64 + 0.5);
            let (r, angle) = ((u / n as f64).sqrt(), std::f64::consts::TAU * v / n as f64);
            let d = DVec3::new(r * angle.cos(), r * angle.sin(), (1.0 - r * r).sqrt());
            let cosine = d.dot(nadir);
            let inner = 1.0 - 1.064f64.powi(2) * (1.0 - cosine * cosine);
            if cosine <= 0.0 || inner <= 0.0 {
                continue;
            }
            let ground = (1.064 * cosine - inner.sqrt()) * d - 1.064 * nadir;
            let lit = ground.dot(sun).max(0.0);
            let at = from + d * (0.5 / d.z);
            let open = if at.x.abs() < half && at.y.abs() < half { 0.0 } else { 1.0 };
            [1.0, open, lit, open * lit].iter().zip(&mut sums).for_each(|(value, sum)| *sum += value);
        }
    }
    let exact = [sums[1] / sums[0], sums[3] / sums[2]];
    println!(
        "seen of the infrared {:.4} (exact {:.4}), of the albedo {:.4} ({:.4})",
        seen.planet_ir, exact[0], seen.albedo, exact[1]
    );
    assert!((seen.planet_ir - exact[0]).abs() < 0.01 && (seen.albedo - exact[1]).abs() < 0.01, "{seen:?} {exact:?}");
    assert!(exact[0] < 0.9, "the large plate hides much");
    let open = PlanetFromPatch::new(&planet, &load, 0).seen(&exchange.for_light.sky[..1]);
    assert!((open.planet_ir - exact[0]).abs() > 0.01, "one ray is not enough");
}

/// A floor in the Sun reflects onto a wall that the Sun grazes, so what the wall absorbs goes with the cosine of the Sun on the floor.
#[test]
fn light_that_is_held_errs_by_what_is_told() {
    let mut shapes = Shapes::default();
    shapes.plate(DVec3::ZERO, DVec3::X, DVec3::Y, 4, grey(0.4, 0.9));
    shapes.plate(DVec3::ZERO, DVec3::Y, DVec3::Z, 4, grey(0.7, 0.9));
    let exchange = exchange(&shapes, 5.0, 1024);
    let at = |zenith_deg: f64| {
        let (sine, cosine) = zenith_deg.to_radians().sin_cos();
        StepLoad { sun: sunlight([(DVec3::new(0.0, sine, cosine), 1000.0)]), ..dark(0.0) }
    };
    let [before, now] = [40.0, 45.0].map(at);
    let [held, fresh] = [&before, &now].map(|load| exchange.light(load, &Lit::default(), None));
    let told = exchange.held_too_long(&now, [&held, &fresh], |_| 250.0);
    let wall = exchange.patches.iter().position(|patch| patch.part == 1).expect("the wall");
    let more = fresh.sunlight[wall] * (40f64.to_radians().cos() / 45f64.to_radians().cos() - 1.0);
    println!(
        "the wall absorbs {:.3} W/m2, and {:.3} W/m2 more under light that is held",
        fresh.sunlight[wall], told[wall]
    );
    assert!((told[wall] / more - 1.0).abs() < 1e-9 && more > 1.0, "{} against {more}", told[wall]);
    assert!(exchange.held_too_long(&now, [&fresh; 2], |_| 250.0).iter().all(|error| *error == 0.0));
    // The planet's infrared through a sky that is held as half open.
    let nadir = DVec3::Z;
    let planet = PlanetLoad {
        nadir,
        sunward: DVec3::X,
        distance_ratio: 1.1,
        planet_ir: 237.0,
        albedo_flux: 0.0,
        sun_zenith: 1.0,
    };
    let load = StepLoad { planet: Some(planet), ..dark(0.0) };
    let fresh = exchange.light(&load, &Lit::default(), None);
    let mut held = fresh.clone();
    held.planet_shares.iter_mut().for_each(|seen| seen.planet_ir *= 0.5);
    let told = exchange.held_too_long(&load, [&held, &fresh], |_| 250.0);
    // A plate that faces the planet takes 237 W/m2 over 1.1^2.
    let exact = -0.5 * 0.9 * 237.0 / 1.21 * fresh.planet_shares[0].planet_ir;
    assert!((told[0] / exact - 1.0).abs() < 1e-9, "{} against {exact}", told[0]);
}

/// A plate before a hot wall of many patches: the noise of its rays, and what pairs are left out, against many castings and against nothing left out.
#[test]
fn stated_errors_are_those_that_are_found() {
    let mut shapes = Shapes::default();
    shapes.plate(DVec3::ZERO, DVec3::X, DVec3::Y, 12, grey(0.5, 0.9));
    shapes.plate(DVec3::Z * 0.7, DVec3::Y, DVec3::X, 12, grey(0.5, 0.6));
    let hot = |exchange: &Exchange| {
        let light = exchange.light(&dark(0.0), &Lit::default(), None);
        let temperature = |node: usize| {
            let patch = &exchange.patches[exchange.of_node[node][0] as usize];
            if patch.part == 1 && patch.centre.x < 0.5 { 400.0 } else { 200.0 }
        };
        let sent = exchange.sent(&dark(0.0), &light, temperature);
        let absorbed = exchange.absorbed(&sent, &light);
        (absorbed, exchange.errors(&sent, &light, None))
    };
    // A reference with so many rays that it has hardly any noise.
    let (fine, _) = hot(&exchange(&shapes, 0.11, 16_384));
    let coarse = exchange(&shapes, 0.11, 64);
    let (found, stated) = hot(&coarse);
    let rms = |of: &dyn Fn(usize) -> f64| {
        let plate = (0..found.len()).filter(|patch| coarse.patches[*patch].part == 0);
        let (sum, count) = plate.fold((0.0, 0), |(sum, count), patch| (sum + of(patch).powi(2), count + 1));
        (sum / f64::from(count)).sqrt()
    };
    let (noise, apart) = (rms(&|patch| stated[patch].noise), rms(&|patch| found[patch] - fine[patch]));
    let left_out = rms(&|patch| stated[patch].left_out);
    println!("noise {noise:.2} W/m2 stated, {apart:.2} found; left out {left_out:.3} W/m2");
    assert!(apart < 1.3 * noise && apart > 0.1 * noise, "{noise} W/m2 stated, {apart} found");
    assert!(left_out < noise, "{left_out} W/m2 left out");
    // Whole rows leave nothing out but rounding, which the diagonal takes.
    let kelvin = coarse.kelvin_per_flux(|_| 300.0)[0];
    assert!((kelvin * 4.0 * 0.9 * STEFAN_BOLTZMANN * 300f64.powi(3) - 1.0).abs() < 1e-12, "{kelvin}");
}
