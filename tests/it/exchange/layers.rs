//! Layers of a wall of one part and material that face the same way: the upper one sees space, and the lower one a third layer between them.

use glam::DVec3;
use isotherm::internals::{NodeViews, Patches};

use super::shapes::{Shapes, grey};

/// There are so many patches that none is split for a small difference.
#[test]
fn layers_of_a_wall_are_patches_of_their_own_however_many_there_are() {
    const GAP: f64 = 0.01;
    let mut shapes = Shapes::default();
    let layer = |shapes: &mut Shapes, height: f64, [right, up]: [DVec3; 2]| {
        shapes.plate(height * DVec3::Z, right, up, 90, grey(0.5, 0.8));
    };
    let [x, y] = [DVec3::X, DVec3::Y];
    layer(&mut shapes, 0.0, [x, y]);
    layer(&mut shapes, 0.9 * GAP, [y, x]);
    layer(&mut shapes, GAP, [x, y]);
    for (part, material) in shapes.surface.parts.iter_mut().zip(&mut shapes.surface.materials) {
        (*part, *material) = (*part % 2, *material % 2);
    }
    let (surface, materials) = (&shapes.surface, &shapes.materials);
    let edge = 1.0 / 45.0;
    let mixed = |patches: &Patches| {
        let between = |height: f64| height > 0.01 * GAP && height < 0.89 * GAP;
        patches.all.iter().filter(|patch| between(patch.centre.z)).count()
    };
    let whole = Patches::new(surface, materials, edge, &[]);
    let split = Patches::resolved(surface, materials, edge, &NodeViews::new(surface, materials, &[]));
    println!("{} patches, {} of two layers; {} split", whole.all.len(), mixed(&whole), split.all.len());
    assert!(whole.all.len() > 3000 && mixed(&whole) > 1000);
    assert_eq!(mixed(&split), 0);
}
