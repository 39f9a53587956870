//! Tests of the light of Sun and planet on patches, and of when it is found anew.

use super::*;
use crate::environment::{StepLoad, SunSample};
use crate::exchange::directions::{cosine_direction, fractions};

#[test]
fn a_word_keeps_its_direction() {
    for ray in 0..2000 {
        let [u, _, s, t] = fractions(1, ray);
        let axis = cosine_direction(DVec3::Z, [s, t]) * if u < 0.5 { -1.0 } else { 1.0 };
        for open in [0, 5, PARTS] {
            let word = word_of(axis, open);
            assert_eq!(open_share(word), f64::from(open) / 12.0);
            let back = direction_of(word);
            // Half a step in both coordinates moves the third by twice as much: 1.5e-4, times sqrt(3) at the middle of a face, which is
            // nearest to the centre.
            assert!(back.distance(axis) < 3e-4, "{axis} came back as {back}");
        }
    }
}

/// Rays of which those with `x > 0.2` are blocked.
fn rays(patch: u32, count: u32) -> Vec<PatchRay> {
    let ray = |ray| {
        let [_, _, s, t] = fractions(patch, ray);
        let direction = cosine_direction(DVec3::Z, [s, t]);
        PatchRay { place: [s, t], direction }
    };
    (0..count).map(ray).collect()
}

fn is_open(ray: &PatchRay) -> bool {
    ray.direction.x <= 0.2
}

fn bundled(rays: &[PatchRay]) -> Vec<u32> {
    let (order, words) = gathered(rays);
    opened(&order, &words, |ray| is_open(&rays[usize::from(ray)])).collect()
}

#[test]
fn bundles_keep_what_is_open_and_lose_less_than_fewer_rays_would() {
    for count in [1, 2, 3, 5, 30, 256] {
        let own = rays(4, count);
        let open = own.iter().filter(|ray| is_open(ray)).count() as f64;
        let words = bundled(&own);
        assert_eq!(words.len(), bundles_of(count as usize));
        let share: f64 = words.iter().map(|word| open_share(*word)).sum::<f64>() / words.len() as f64;
        // The last bundles of a number that four does not divide are smaller.
        assert!((share - open / f64::from(count)).abs() < if count % 4 == 0 { 1e-12 } else { 0.2 }, "{count}");
    }
    let view = |nadir: DVec3| PlanetFromPatch { nadir, sun: DVec3::Y, distance_ratio: 1.064 };
    let mut errors = [0.0; 3];
    for patch in 0..200 {
        let [a, b, ..] = fractions(patch, 7);
        let planet = view(cosine_direction(DVec3::Z, [a, b]));
        let singly = |count: u32| {
            let words: Vec<u32> = rays(patch, count)
                .iter()
                .map(|ray| word_of(ray.direction, if is_open(ray) { PARTS } else { 0 }))
                .collect();
            planet.seen(&words).planet_ir
        };
        let exact = singly(8192);
        let computed = [singly(256), planet.seen(&bundled(&rays(patch, 256))).planet_ir, singly(64)];
        errors.iter_mut().zip(computed).for_each(|(error, found)| *error += (found - exact).powi(2) / 200.0);
    }
    let [single, bundles, quarter] = errors.map(f64::sqrt);
    println!(
        "error of the planet's share: 256 rays {single:.4}, in bundles {bundles:.4}, a quarter of the rays {quarter:.4}"
    );
    assert!(bundles < 1.5 * single && bundles < 0.8 * quarter, "{single} {bundles} {quarter}");
}

fn load(degrees: u32) -> StepLoad {
    let (sine, cosine) = f64::from(degrees).to_radians().sin_cos();
    let sun = vec![SunSample { direction: DVec3::new(cosine, sine, 0.0), flux: 1361.0 }];
    StepLoad {
        sun,
        planet: None,
        albedo: None,
        background_temperature: 3.0,
        joints: Vec::new(),
        start: f64::from(degrees),
    }
}

/// What is found anew in steps in which the Sun turns by 1 deg.
fn found(renewal: &mut Renewal, steps: std::ops::Range<u32>) -> Vec<Due> {
    steps.map(|number| renewal.due(&load(number), 1.0, false)).collect()
}

#[test]
fn infrared_is_held_for_steps_and_light_for_an_angle() {
    use Due::{All, Infrared, Nothing};
    let held = [All, Nothing, Nothing, Nothing, Infrared, Nothing, Nothing, Nothing];
    let mut renewal = Renewal::new(10.5f64.to_radians(), 4.0, 1.0);
    // Light after 12 steps would be a turn of 12 deg, so it is found after 8.
    assert_eq!(found(&mut renewal, 0..16), [held, held].concat());
    // In every step, and light beyond its angle.
    let mut renewal = Renewal::new(1.5f64.to_radians(), 0.0, 1.0);
    assert_eq!(found(&mut renewal, 0..5), [All, Infrared, All, Infrared, All]);
    // Never for longer than 3.7 steps, and in every part of a step that asks for that.
    let mut renewal = Renewal::new(1.0, 3.7, 1.0);
    assert_eq!(found(&mut renewal, 0..7), [All, Nothing, Nothing, Infrared, Nothing, Nothing, Infrared]);
    let mut renewal = Renewal::new(1.0, 0.3, 1.0);
    let parts: Vec<Due> = (0..3).map(|number| renewal.due(&load(number), 0.25, false)).collect();
    assert_eq!(parts, [All, Infrared, Infrared]);
    // A saved state goes on alike.
    let (mut first, mut again) = (Renewal::new(0.5, 3.0, 1.0), Renewal::new(0.5, 3.0, 1.0));
    found(&mut first, 0..2);
    again.last = first.last.clone();
    assert_eq!(found(&mut again, 2..7), [Nothing, Infrared, Nothing, Nothing, Infrared]);
    assert_eq!(again.due(&load(7), 1.0, true), All);
}

/// The lead of light at the steps in which it is found, under a Sun at these angles [deg], with an angle of 5 deg.
fn leads(angles: &[f64]) -> Vec<(usize, f64)> {
    let mut renewal = Renewal::new(5f64.to_radians(), 0.0, 15.0);
    let found = angles.iter().enumerate().filter_map(|(step, angle)| {
        let (sine, cosine) = angle.to_radians().sin_cos();
        let sun = vec![SunSample { direction: DVec3::new(sine, 0.0, cosine), flux: 1000.0 }];
        let load = StepLoad {
            start: 15.0 * step as f64,
            sun,
            planet: None,
            albedo: None,
            background_temperature: 0.0,
            joints: Vec::new(),
        };
        (renewal.due(&load, 1.0, step == 0) == Due::All).then_some((step, renewal.last.lead))
    });
    found.collect()
}

#[test]
fn light_leads_where_the_sun_turns_steadily_and_nowhere_else() {
    let steady: Vec<f64> = (0..20).map(|step| 2.0 * f64::from(step)).collect();
    // Held for three steps of 2 deg: from the middle of the first to the middle of all three.
    let third = |lead: f64| (lead - 1.0 / 3.0).abs() < 1e-9;
    assert!(
        matches!(leads(&steady)[..], [(0, 0.0), (3, a), (6, b), ..] if third(a) && third(b)),
        "{:?}",
        leads(&steady)
    );
    // A jump after a standstill, and nothing more.
    let mut jump = [0.0; 20];
    jump[10..].fill(85.0);
    assert_eq!(leads(&jump), [(0, 0.0), (10, 0.0)]);
    // Light is found again once the Sun stands still, whether it led or not.
    let stops: Vec<f64> = (0..20).map(|step| 2.0 * f64::from(step.min(7))).collect();
    assert!(matches!(leads(&stops)[..], [_, _, (6, lead), (8, 0.0)] if third(lead)), "{:?}", leads(&stops));
    jump[..10].fill(84.0);
    assert_eq!(leads(&jump), [(0, 0.0), (11, 0.0)]);
}
#[test]
fn light_is_found_with_the_rows_of_joints_that_rest() {
    let load = |angle: f64| StepLoad {
        start: 0.0,
        sun: Vec::new(),
        planet: None,
        albedo: None,
        background_temperature: 0.0,
        joints: vec![DAffine3::from_rotation_y(angle)],
    };
    let mut renewal = Renewal::new(0.1, 10.0, 1.0);
    assert_eq!(renewal.due(&load(0.0), 1.0, true), Due::All);
    // A joint jumps, rests, and then has rows of its own.
    assert_eq!(renewal.due(&load(1.0), 1.0, false), Due::All);
    assert_eq!(renewal.due(&load(1.0), 1.0, false), Due::Nothing);
    renewal.new_rows();
    assert_eq!(renewal.due(&load(1.0), 1.0, false), Due::All);
    assert_eq!(renewal.due(&load(1.0), 1.0, false), Due::Nothing);
}
