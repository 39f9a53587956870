//! What is wrong with a surface is counted, and patches inside others are told.

use glam::DVec3;
use isotherm::internals::{Defects, Exchange, ExchangeSettings, Lit, NodeViews, Patches, Scenery, Sides, StepLoad};

use super::shapes::{Shapes, grey};
use super::view_factors::exchange;
use crate::device::{dark, sunlight};

fn defects(shapes: &Shapes) -> Defects {
    Defects::of(&shapes.surface, &shapes.materials)
}

/// A box whose normals look outwards.
fn solid(shapes: &mut Shapes, low: DVec3, size: f64, cells: usize) {
    let (x, y, z) = (DVec3::X * size, DVec3::Y * size, DVec3::Z * size);
    for (corner, right, up) in
        [(low, y, x), (low + z, x, y), (low, z, y), (low + x, y, z), (low, x, z), (low + y, z, x)]
    {
        shapes.plate(corner, right, up, cells, grey(0.5, 0.8));
    }
}

#[test]
fn a_closed_box_has_no_defect_and_its_changes_are_counted() {
    let mut whole = Shapes::default();
    solid(&mut whole, DVec3::ZERO, 1.0, 2);
    assert_eq!(defects(&whole), Defects::default());
    assert!(defects(&whole).warnings().is_empty());

    let mut open = Shapes::default();
    solid(&mut open, DVec3::ZERO, 1.0, 2);
    open.surface.triangles.pop();
    assert_eq!(defects(&open), Defects { open_edges: 3, ..Defects::default() });

    let mut inward = Shapes::default();
    inward.room(DVec3::ONE, 2, |_| grey(0.5, 0.8));
    assert_eq!(defects(&inward), Defects { inward: 1, ..Defects::default() });

    let mut twice = Shapes::default();
    solid(&mut twice, DVec3::ZERO, 1.0, 2);
    twice.plate(DVec3::Z, DVec3::X, DVec3::Y, 2, grey(0.5, 0.8));
    let found = defects(&twice);
    // The inner edges of this face have four triangles, and those around it three.
    assert_eq!((found.coincident, found.open_edges, found.crowded_edges), (8, 0, 16));
    let told = found.warnings().join("\n");
    assert!(told.contains("8 triangles exactly on another") && told.contains("16 edges of more than two"), "{told}");

    // A panel in the skin of the box: as a sheet, as another body's skin that looks the same way, and as one that looks at it.
    let overlapping = |right: DVec3, up: DVec3, low: DVec3, both: bool| {
        let mut shapes = Shapes::default();
        solid(&mut shapes, DVec3::ZERO, 1.0, 2);
        let mut material = grey(0.5, 0.8);
        if both {
            material.sides = Sides::Both { back: material.front };
        }
        shapes.plate(low, right, up, 3, material);
        defects(&shapes).overlapping > 0
    };
    let (x, y, low) = (0.31 * DVec3::X, 0.47 * DVec3::Y, DVec3::new(0.2, 0.13, 1.0));
    assert!(overlapping(x, y, low, true) && overlapping(y, x, low, true) && overlapping(x, y, low, false));
    assert!(!overlapping(y, x, low, false), "nobody sees skins that touch");
    assert!(!overlapping(x, y, low + 0.001 * DVec3::Z, true), "a gap of a millimetre");

    let mut thin = Shapes::default();
    solid(&mut thin, DVec3::ZERO, 1.0, 2);
    let first = thin.surface.triangles[0];
    thin.surface.triangles.push([first[0], first[1], first[1]]);
    assert_eq!(defects(&thin), Defects { without_area: 1, ..Defects::default() });
}

/// A box inside another one sees inner faces only. It exchanges nothing, and is told.
#[test]
fn patches_inside_others_are_counted() {
    let mut shapes = Shapes::default();
    solid(&mut shapes, DVec3::ZERO, 2.0, 4);
    solid(&mut shapes, DVec3::splat(0.7), 0.5, 2);
    let found = exchange(&shapes, 5.0, 256);
    let (count, area) = found.factors.buried();
    assert_eq!(count, 6);
    assert!((area - 6.0 * 0.25).abs() < 1e-9, "{area}");
    let share = found.factors.inside_share();
    assert!((share - 1.5 / 25.5).abs() < 1e-9, "{share}");
    for (patch, own) in found.patches.iter().enumerate() {
        let itself = found.factors.shared.at(patch, patch as u32) / own.area;
        assert!((itself - if own.part < 6 { 0.0 } else { 1.0 }).abs() < 1e-12, "patch {patch}: {itself}");
    }
}

/// A beam that stands half in a box: light that comes back from inner faces would warm its free half too, were both halves one patch.
#[test]
fn faces_inside_another_part_share_no_patch_with_faces_in_the_open() {
    let mut shapes = Shapes::default();
    solid(&mut shapes, DVec3::ZERO, 2.0, 4);
    let (low, x, y, z) = (DVec3::new(1.0, 0.75, 0.75), 2.0 * DVec3::X, 0.5 * DVec3::Y, 0.5 * DVec3::Z);
    for (corner, up, normal) in
        [(low, y, -DVec3::Z), (low + z, y, DVec3::Z), (low, z, -DVec3::Y), (low + y, z, DVec3::Y)]
    {
        shapes.part([32, 4], grey(0.5, 0.8), |u, v| [corner + u * x + v * up, normal]);
    }
    let settings = ExchangeSettings {
        rays: 256,
        patch_edge: Some(5.0),
        bounces: None,
        redraw_angle: 0.0,
        specular_sunlight: false,
        hold: Some(0.0),
    };
    let inside = |buried: &[[bool; 2]]| {
        let patches = Patches::new(&shapes.surface, &shapes.materials, 5.0, buried);
        let scenery = Scenery::new(&shapes.surface, &[]);
        let found = Exchange::cast(&shapes.surface, &patches, &scenery, &settings);
        let beam = found.patches.iter().zip(&found.factors.inside).filter(|(patch, _)| patch.part >= 6);
        beam.map(|(_, share)| *share).collect::<Vec<f64>>()
    };
    // A node column of 32 lies on the skin, half of it inside: 1/64 of the free half.
    let split = inside(&NodeViews::new(&shapes.surface, &shapes.materials, &[]).buried());
    assert_eq!(split.len(), 8, "{split:?}");
    assert!(split.iter().all(|share| !(0.04..=0.96).contains(share)), "{split:?}");
    let whole = inside(&[]);
    assert!(whole.len() == 4 && whole.iter().all(|share| (0.4..0.6).contains(share)), "{whole:?}");
}

/// A closed patch could not give away the light that it took, so it takes none; the free half of the beam takes all.
#[test]
fn a_face_inside_another_part_takes_no_sunlight() {
    let mut shapes = Shapes::default();
    solid(&mut shapes, DVec3::ZERO, 2.0, 4);
    let (x, y) = (2.0 * DVec3::X, 0.5 * DVec3::Y);
    shapes.part([32, 4], grey(0.5, 0.8), |u, v| [DVec3::new(1.0, 0.75, 1.25) + u * x + v * y, DVec3::Z]);
    let patches = |buried: &[[bool; 2]]| {
        let patches = Patches::new(&shapes.surface, &shapes.materials, 5.0, buried);
        let settings = ExchangeSettings { patch_edge: Some(5.0), ..ExchangeSettings::default() };
        Exchange::cast(&shapes.surface, &patches, &Scenery::new(&shapes.surface, &[]), &settings)
    };
    let found = patches(&NodeViews::new(&shapes.surface, &shapes.materials, &[]).buried());
    let of_beam = |found: &Exchange| -> Vec<f64> {
        let beam = (0..found.patches.len()).filter(|patch| found.patches[*patch].part >= 6);
        beam.map(|patch| found.exposed(patch)).collect()
    };
    let exposed = of_beam(&found);
    assert_eq!(exposed.len(), 2, "{exposed:?}");
    let [least, most] = [f64::min, f64::max].map(|of| exposed.iter().copied().reduce(of).expect("two halves"));
    assert!(least < 0.04 && most == 1.0, "{exposed:?}");
    let load = StepLoad { sun: sunlight([(DVec3::Z, 1000.0)]), ..dark(0.0) };
    let light = found.light(&load, &Lit::default(), None);
    for (number, patch) in found.patches.iter().enumerate().filter(|(_, patch)| patch.part >= 6) {
        let reflected = (1.0 - patch.optics.absorptivity) * 1000.0 * found.exposed(number);
        assert!((light.reflected[number][1] - reflected).abs() < 1e-9, "patch {number}");
    }
    // Faces that were not told apart take all of it.
    assert!(of_beam(&patches(&[])).iter().all(|share| *share == 1.0));
}
