//! A plate that turns: rows of an older pose against rows of fresh rays.

use glam::{DAffine3, DVec3};
use isotherm::internals::{Exchange, ExchangeSettings, Patches, Scenery};

use super::shapes::{Shapes, grey};

const RAYS: u32 = 4096;

/// Two square plates with a common edge along y. The second one turns about it, from the pose in which they lie at 60 deg.
fn hinge() -> Shapes {
    let mut shapes = Shapes::default();
    shapes.plate(DVec3::ZERO, DVec3::X, DVec3::Y, 8, grey(0.5, 0.8));
    let tip = DVec3::new(60f64.to_radians().cos(), 0.0, 60f64.to_radians().sin());
    shapes.plate(DVec3::ZERO, DVec3::Y, tip, 8, grey(0.5, 0.8));
    let first = shapes.surface.joints.len() / 2;
    shapes.surface.joints[first..].fill(1);
    shapes
}

fn at(shapes: &Shapes, turned_deg: f64) -> Exchange {
    let settings = ExchangeSettings {
        rays: RAYS,
        patch_edge: Some(5.0),
        bounces: None,
        redraw_angle: 0.0,
        specular_sunlight: false,
        hold: Some(0.0),
    };
    let patches = Patches::new(&shapes.surface, &shapes.materials, 5.0, &[]);
    // A turn about -y opens the angle.
    let poses = [DAffine3::IDENTITY, DAffine3::from_rotation_y(-turned_deg.to_radians())];
    Exchange::cast(&shapes.surface, &patches, &Scenery::new(&shapes.surface, &poses), &settings)
}

/// While rows are in use their error is within the change of the open sky that is told when rays are cast anew.
#[test]
fn rows_of_an_older_pose_err_by_what_is_told_at_most() {
    let shapes = hinge();
    let open = |exchange: &Exchange| [0, 1].map(|patch| exchange.factors.to_space(patch));
    let [stale, anew] = [0.0, 10.0].map(|angle| open(&at(&shapes, angle)));
    let noise = 3.0 * (0.25 / f64::from(RAYS)).sqrt();
    let told = [0, 1].map(|patch| (anew[patch] - stale[patch]).abs());
    println!("told {told:?}");
    assert!(told.iter().all(|told| *told > 0.03), "a hinge that opens shows more of the sky: {told:?}");
    for angle in [2.5, 5.0, 7.5] {
        let fresh = open(&at(&shapes, angle));
        for patch in [0, 1] {
            let off = (fresh[patch] - stale[patch]).abs();
            println!("after {angle} deg plate {patch} is off by {off:.4}");
            assert!(off <= told[patch] + noise, "{angle} deg, plate {patch}: {off}");
            // The change goes with the angle: a tenth of it is not enough for the whole.
            assert!(off > 0.1 * angle / 10.0 * told[patch] - noise, "{angle} deg, plate {patch}: {off}");
        }
    }
    // Plates that share an edge at 60 deg: 1 - sin(30 deg) = 0.5 to each other if they were infinitely long, less for squares.
    assert!(stale.iter().all(|open| (0.5..0.75).contains(open)), "{stale:?}");
}
