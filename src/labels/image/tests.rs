//! A small labelled image and craft for tests, and where its pixels lie.

use glam::Vec3;

use super::super::craft::{Craft, KeyPoint};
use super::*;

/// Two triangles: a hull on the body, and a wing on a joint.
pub(crate) fn small_craft() -> Craft {
    let corner = |x: f64, y: f64| DVec3::new(x, y, 0.0);
    Craft {
        name: "small".to_owned(),
        parts: vec!["hull".to_owned(), "wing".to_owned()],
        materials: vec!["paint".to_owned()],
        links: vec!["body".to_owned(), "hinge".to_owned()],
        link_of_part: vec![0, 1],
        positions: vec![
            corner(0.0, 0.0),
            corner(1.0, 0.0),
            corner(0.0, 1.0),
            corner(1.0, 0.0),
            corner(3.0, 0.0),
            corner(3.0, 1.0),
        ],
        normals: vec![Vec3::Z; 6],
        vertex_part: vec![0, 0, 0, 1, 1, 1],
        triangles: vec![[0, 1, 2], [3, 4, 5]],
        key_points: vec![KeyPoint { name: "tip".to_owned(), part: 1, link: 1, position: corner(3.0, 1.0) }],
        symmetries: Vec::new(),
        targets: Vec::new(),
    }
}

/// Four by three pixels: two of the hull and one of the wing.
pub(crate) fn small() -> LabelledImage {
    let seen = |hull: f32, wing: f32| {
        let mut values = vec![0.0; 12];
        (values[5], values[6], values[2]) = (hull, hull, wing);
        values
    };
    let whole = |values: Vec<f32>| values.iter().map(|value| *value as u32).collect::<Vec<_>>();
    LabelledImage {
        identity: ImageIdentity {
            sample: 7,
            orbit: 3,
            number: 2,
            split: Split::Validation,
            bits: 14,
            sensor: vec![("temperature_K".to_owned(), 293.0)],
            drawn: Vec::new(),
        },
        width: 4,
        height: 3,
        lens: Lens::pinhole([10.0, 20.0], [2.0, 1.5]),
        near: 0.1,
        line_time: 0.0,
        time: 12.5,
        camera_from_body: DAffine3::from_rotation_translation(
            DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2),
            DVec3::new(0.25, 0.0, 2.0),
        ),
        links: vec![DAffine3::IDENTITY, DAffine3::from_translation(DVec3::new(0.0, 0.0, 1.0))],
        joints: vec![JointPosition { name: "hinge".to_owned(), position: 1.0, turns: false }],
        sun: DVec3::X,
        lit: 1.0,
        planet: DVec3::NEG_Y,
        planet_radius: 1.2,
        channels: ImageChannels {
            digital_numbers: Some(vec![5; 12]),
            radiance: seen(40.0, 50.0),
            temperature: seen(280.0, 300.004),
            depth: seen(2.0, 3.0),
            part: whole(seen(1.0, 2.0)),
            material: whole(seen(1.0, 1.0)),
            samples: 1,
            coverage: Vec::new(),
        },
    }
}

#[test]
fn pixels_are_those_of_opencv() {
    let image = small();
    assert_eq!(image.camera_matrix(), [10.0, 0.0, 1.5, 0.0, 20.0, 1.0, 0.0, 0.0, 1.0]);
    assert_eq!(image.project(DVec3::new(0.0, 0.0, 3.0)), Some(DVec2::new(1.5, 1.0)));
    assert_eq!(image.project(DVec3::new(1.0, 0.0, -3.0)), None);
    let turn = image.quaternion();
    assert!((turn * DVec3::X).distance(DVec3::Y) < 1e-15, "X of the body is down in the image");
    assert!(turn.w > 0.0);
}
