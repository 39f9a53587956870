//! Rotations and cameras as Basilisk sends them.

use glam::{DMat3, DQuat, DVec3};

use super::messages::{CustomModel, vector};
use crate::server::craft::ProtocolCamera;
use crate::server::error::Refusal;

/// The rotation from parent to child axes of modified Rodrigues parameters: tan(angle/4) along the axis. Schaub & Junkins, Analytical Mechanics of Space
/// Systems, eq. 3.152.
pub(crate) fn child_from_parent(parameters: DVec3) -> DMat3 {
    DMat3::from_quat(parent_from_child(parameters)).transpose()
}

/// The rotation of child vectors into parent axes.
pub(crate) fn parent_from_child(parameters: DVec3) -> DQuat {
    let square = parameters.length_squared();
    DQuat::from_vec4((2.0 * parameters).extend(1.0 - square) / (1.0 + square)).normalize()
}

/// The rotation of body vectors into camera axes (OpenCV) of the camera's direction on the wire. The camera on the wire looks along -x of its axes,
/// with y to the right and z up.
pub(crate) fn camera_from_body(direction: DVec3) -> DMat3 {
    let wire = child_from_parent(direction).transpose();
    DMat3::from_cols(wire.y_axis, -wire.z_axis, -wire.x_axis).transpose()
}

/// A craft's place for the geometry of an image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct CraftPlace {
    /// Position of the body frame's origin [m]. All places of an image have the same origin.
    pub(crate) position: DVec3,
    /// Rotates body vectors into the inertial axes.
    pub(crate) inertial_from_body: DQuat,
}

/// How a model stands in the body frame of its craft.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ModelMount {
    /// Place of the model's origin [m].
    offset: DVec3,
    /// Rotates vectors of the model into the body frame.
    body_from_model: DQuat,
    /// Metres in the body frame for a metre of the model.
    pub(crate) scale: f64,
}

impl ModelMount {
    /// A model that is the craft's body frame.
    pub(crate) const PLAIN: Self = Self { offset: DVec3::ZERO, body_from_model: DQuat::IDENTITY, scale: 1.0 };

    /// The mount that a message states. The turns follow each other about the craft's x, y and z axes.
    ///
    /// # Errors
    /// Values that are not three finite numbers, or a scale that differs along the axes or is not above 0.
    pub(crate) fn of(model: &CustomModel) -> Result<Self, Refusal> {
        let three = |what: &str, list: &[f64]| {
            vector(list).ok_or_else(|| Refusal::because(format!("its {what} is not three finite numbers")))
        };
        let offset = three("offset", &model.offset)?;
        let turns = three("rotation", &model.rotation)?.map(f64::to_radians);
        // An absent scale is 1, and so is the 0 that stands for absence.
        let scale = match three("scale", &model.scale)? {
            DVec3::ZERO => DVec3::ONE,
            scale => scale,
        };
        if scale.min_element() <= 0.0 || scale != DVec3::splat(scale.x) {
            return Err(Refusal::because(format!(
                "its scale {:?} is not one number above 0 for all axes",
                scale.to_array()
            )));
        }
        let [x, y, z] =
            [DQuat::from_rotation_x(turns.x), DQuat::from_rotation_y(turns.y), DQuat::from_rotation_z(turns.z)];
        Ok(Self { offset, body_from_model: z * y * x, scale: scale.x })
    }

    /// The place of the model on a craft.
    pub(crate) fn on(&self, craft: &CraftPlace) -> CraftPlace {
        CraftPlace {
            position: craft.position + craft.inertial_from_body * self.offset,
            inertial_from_body: craft.inertial_from_body * self.body_from_model,
        }
    }
}

/// A camera on a craft.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Mounted {
    /// Width and height in pixels.
    pub(crate) size: [u32; 2],
    /// Vertical field of view [rad].
    pub(crate) field_of_view: f64,
    /// Position in the body frame of the craft that carries it [m].
    pub(crate) position: DVec3,
    /// Rotates vectors of that body frame into camera axes (OpenCV).
    pub(crate) camera_from_body: DMat3,
}

/// The view of another craft's model, of a scale, from a camera on one craft. Only differences of positions count, in f64.
pub(crate) fn view(camera: &Mounted, carrier: &CraftPlace, craft: &CraftPlace, scale: f64) -> ProtocolCamera {
    let focal = 0.5 * f64::from(camera.size[1]) / (0.5 * camera.field_of_view).tan();
    let seen_from_inertial = craft.inertial_from_body.conjugate();
    let apart = carrier.position - craft.position + carrier.inertial_from_body * camera.position;
    let seen_from_carrier = DMat3::from_quat(seen_from_inertial * carrier.inertial_from_body);
    ProtocolCamera {
        size: camera.size,
        focal: [focal; 2],
        position: seen_from_inertial * apart,
        body_from_camera: seen_from_carrier * camera.camera_from_body.transpose(),
        scale,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place(position: [f64; 3], parameters: [f64; 3]) -> CraftPlace {
        CraftPlace { position: DVec3::from(position), inertial_from_body: parent_from_child(DVec3::from(parameters)) }
    }

    /// A point of the model is scaled, turned and moved, in this order: (1, 0, 0) by 2, a quarter about z and then (0, 0, 5) is (0, 2, 5).
    #[test]
    fn a_model_is_scaled_turned_and_moved() {
        let model = CustomModel {
            offset: vec![0.0, 0.0, 5.0],
            rotation: vec![0.0, 0.0, 90.0],
            scale: vec![2.0; 3],
            ..CustomModel::default()
        };
        let mount = ModelMount::of(&model).expect("a mount");
        let craft = place([7e6, 0.0, 0.0], [0.0; 3]);
        let on = mount.on(&craft);
        let point = on.position + on.inertial_from_body * (mount.scale * DVec3::X) - craft.position;
        assert!(point.distance(DVec3::new(0.0, 2.0, 5.0)) < 1e-9, "{point}");
        // The craft's own axes stay: x first, then z.
        let both = CustomModel { rotation: vec![90.0, 0.0, 90.0], ..CustomModel::default() };
        let both = ModelMount::of(&both).expect("a mount");
        assert!((both.on(&craft).inertial_from_body * DVec3::Y).distance(DVec3::Z) < 1e-12);
        assert_eq!((both.scale, ModelMount::of(&CustomModel::default()).expect("one")), (1.0, ModelMount::PLAIN));
        for wrong in [vec![1.0, 1.0, 2.0], vec![-1.0; 3], vec![f64::NAN; 3], vec![1.0]] {
            assert!(ModelMount::of(&CustomModel { scale: wrong, ..CustomModel::default() }).is_err());
        }
    }

    /// Numbers that Basilisk 2.12.1 sent at 30 s of a run. The expected ones follow from its own messages and from the rotation that the script set.
    #[test]
    fn a_measured_camera_sees_a_measured_target() {
        let target = place(
            [-2_606_730.565_634_227, -3_452_469.079_407_109, -5_218_098.715_506_474],
            [0.211_820_999_501_637_4, -0.459_561_077_186_301_35, 0.137_356_895_784_643_5],
        );
        let chaser = place(
            [-2_606_783.564_722_990_6, -3_452_442.365_572_214_6, -5_218_089.913_937_523],
            [-0.030_079_524_882_360_053, 0.558_837_381_777_804_5, 0.182_234_697_949_948_1],
        );
        let camera = Mounted {
            size: [320, 256],
            field_of_view: 20f64.to_radians(),
            position: DVec3::new(0.8, -0.35, 0.5),
            camera_from_body: camera_from_body(DVec3::new(
                0.237_997_757_956_816_32,
                0.276_989_813_325_534_9,
                0.142_174_781_888_190_33,
            )),
        };
        let rows = [
            [0.034_586_068, 0.537_964_06, 0.842_257_962],
            [-0.908_134_609, 0.368_767_814, -0.198_246_894],
            [-0.417_247_331, -0.758_027_024, 0.501_298_01],
        ];
        let expected = DMat3::from_cols_array_2d(&rows).transpose();
        assert!(camera.camera_from_body.abs_diff_eq(expected, 1e-8));
        let set_by_the_script = child_from_parent(DVec3::new(0.12, -0.27, 0.31));
        assert!(camera.camera_from_body.abs_diff_eq(set_by_the_script, 1e-14));
        let seen = view(&camera, &chaser, &target, 1.0);
        let to_camera = |point: DVec3| seen.body_from_camera.transpose() * (point - seen.position);
        assert!(to_camera(DVec3::ZERO).distance(DVec3::new(1.758_614_389, 1.608_113_235, 59.780_295_877)) < 1e-8);
        let cases = [
            ([4.0, 0.0, 0.0], [162.258_801, 192.222_882, 59.177_526]),
            ([-3.0, 1.0, -1.5], [215.093_047, 121.536_138, 59.596_793]),
        ];
        for (point, expected) in cases {
            let there = to_camera(DVec3::from(point));
            let pixel = [160.0 + seen.focal[0] * there.x / there.z, 128.0 + seen.focal[1] * there.y / there.z, there.z];
            let error = pixel.iter().zip(expected).map(|(computed, expected)| (computed - expected).abs());
            assert!(error.fold(0.0, f64::max) < 2e-6, "{pixel:?}");
        }
        let turned = CraftPlace { inertial_from_body: chaser.inertial_from_body.conjugate(), ..chaser };
        assert!(view(&camera, &turned, &target, 1.0).position.distance(seen.position) > 0.1);
    }

    /// Far from the origin the differences stay those of f64: 1.5e11 m has 15 micrometres.
    #[test]
    fn a_far_origin_moves_nothing() {
        let camera = Mounted {
            size: [64, 64],
            field_of_view: 0.3,
            position: DVec3::new(0.8, -0.35, 0.5),
            camera_from_body: DMat3::from_rotation_x(0.3),
        };
        let [near, far] = [DVec3::ZERO, DVec3::new(1.1e11, -0.9e11, 0.4e11)].map(|origin| {
            let at = |position: DVec3, axis: f64| CraftPlace {
                position: origin + position,
                inertial_from_body: DQuat::from_rotation_z(axis),
            };
            view(&camera, &at(DVec3::new(0.0, 7e6, 0.0), 0.3), &at(DVec3::new(40.0, 7e6, 30.0), 1.0), 1.0)
        });
        assert!(near.position.distance(far.position) < 1e-4, "{near:?} {far:?}");
        assert!(near.position.distance(DVec3::ZERO) > 40.0);
    }

    #[test]
    fn both_sets_of_parameters_are_the_same_rotation() {
        let one = DVec3::new(0.3, -0.5, 0.2);
        let shadow = -one / one.length_squared();
        assert!(child_from_parent(one).abs_diff_eq(child_from_parent(shadow), 1e-14));
        assert!(!child_from_parent(one).abs_diff_eq(child_from_parent(-one), 0.1));
    }
}
