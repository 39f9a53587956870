//! Findings go from a craft to bytes and into another craft of the same surface, optics and settings, and into no other.

use super::*;
use crate::exchange::sparse::Sparse;
use crate::exchange::step::ExchangeSettings;
use crate::simulation::exchange::tests::{black, craft};
use crate::thermal::material::Material;

const SETTINGS: ExchangeSettings = ExchangeSettings {
    rays: 64,
    patch_edge: Some(0.7),
    bounces: None,
    redraw_angle: 0.2,
    specular_sunlight: false,
    hold: None,
};

fn pose(angle: f64) -> Vec<DAffine3> {
    vec![DAffine3::IDENTITY, DAffine3::from_rotation_y(angle)]
}

#[test]
fn a_craft_takes_what_another_one_found_and_finds_nothing_anew() {
    let first = craft(SETTINGS);
    let found = [0.0, 0.3].map(|angle| first.cast(&pose(angle)));
    assert_eq!(first.found_so_far(), 2);
    let bytes = postcard::to_stdvec(&first.kept_casts()).unwrap();
    // Other times at which something is found change nothing of it.
    let second = craft(ExchangeSettings { redraw_angle: 0.1, hold: Some(7.0), ..SETTINGS });
    assert_eq!(second.take_casts(&postcard::from_bytes(&bytes).unwrap()), Ok(2));
    for (angle, found) in [0.0, 0.3].into_iter().zip(&found) {
        let again = second.cast(&pose(angle));
        assert!(again.factors == found.factors && again.infrared == found.infrared);
        assert!(**again.for_light == **found.for_light);
    }
    assert_eq!(second.found_so_far(), 2, "nothing is found anew");
    second.cast(&pose(0.5));
    assert_eq!(second.found_so_far(), 3);
    // What is kept stays for engines that come later, and is taken once.
    assert_eq!(second.take_casts(&postcard::from_bytes(&bytes).unwrap()), Ok(2));
    assert_eq!((second.found_so_far(), second.kept_casts().poses.len()), (3, 3));
}

#[test]
fn another_craft_and_damaged_findings_are_left_alone() {
    let first = craft(SETTINGS);
    first.cast(&pose(0.3));
    let kept = first.kept_casts();
    let mut gray: Material = black();
    gray.front.emissivity = 0.9;
    let mut moved = (*craft(SETTINGS)).clone();
    moved.surface.positions[0].x += 1e-9;
    let mut turned = (*craft(SETTINGS)).clone();
    turned.surface.triangles[0].rotate_left(1);
    let others = [
        craft(ExchangeSettings { rays: 65, ..SETTINGS }),
        craft(ExchangeSettings { bounces: Some(3), ..SETTINGS }),
        craft(ExchangeSettings { specular_sunlight: true, ..SETTINGS }),
        craft(SETTINGS).with_optics(&[gray]),
        Arc::new(moved),
        Arc::new(turned),
    ];
    for (number, other) in others.iter().enumerate() {
        assert_eq!(other.take_casts(&kept), Err(CastsMisfit::Craft), "{number}");
        assert_eq!(other.found_so_far(), 0);
    }
    // A checksum that fits, around a finding of fewer rays.
    let small = craft(ExchangeSettings { rays: 32, ..SETTINGS });
    small.cast(&pose(0.3));
    let lying = KeptCasts { craft: kept.craft, ..small.kept_casts() };
    let second = craft(SETTINGS);
    assert_eq!((second.take_casts(&lying), second.found_so_far()), (Err(CastsMisfit::Content), 0));
}

/// A finding changes with the way in which rays are cast. Then earlier files must serve no more. The sum has eight digits, because functions of another system round otherwise.
#[test]
fn another_way_to_cast_rays_has_another_number() {
    let mut gray = black();
    (gray.front.emissivity, gray.front.absorptivity) = (0.5, 0.4);
    let found = craft(SETTINGS).with_optics(&[gray]).cast(&pose(0.3));
    let areas = |rows: &Sparse| rows.entries.iter().zip(1..).map(|((_, area), k)| area * f64::from(k)).sum::<f64>();
    let sum = areas(&found.factors.shared)
        + 2.0 * areas(&found.infrared.between)
        + 3.0 * areas(&found.for_light.sunlight.between);
    assert_eq!((WAY, format!("{sum:.7e}").as_str()), (1, "9.7970865e4"), "raise WAY, and state the new sum here");
}
