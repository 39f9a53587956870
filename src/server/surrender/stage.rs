//! Camera and objects of a script, in its conventions.

use std::collections::BTreeMap;

use glam::{DMat3, DQuat, DVec3, DVec4};

use crate::server::craft::{ProtocolCamera, ServedCraft};
use crate::server::error::Refusal;
use crate::thermal::planck::Band;

const MOST_OBJECTS: usize = 10_000;
/// Most bytes of a name.
const LONGEST_NAME: usize = 1000;
/// Name of the camera among the objects.
pub(crate) const CAMERA: &str = "camera";
/// Size of an image before a script sets one [px].
const SIZE: [u32; 2] = [512, 512];
/// Field of view before a script sets one [rad].
const FIELD: f64 = std::f64::consts::FRAC_PI_6;

/// Takes axes that look along -z, with y up, into axes that look along +z, with y down, and back.
fn forward_from_backward() -> DMat3 {
    DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0))
}

pub(crate) struct SurrenderObject {
    /// Position in the script's frame [m].
    pub(crate) position: DVec3,
    /// Rotates its axes into the script's frame.
    pub(crate) attitude: DQuat,
    /// Metres of the script for a metre of its scene.
    pub(crate) scale: f64,
    /// The craft, where a scene belongs to it.
    pub(crate) craft: Option<ServedCraft>,
}

impl Default for SurrenderObject {
    fn default() -> Self {
        Self { position: DVec3::ZERO, attitude: DQuat::IDENTITY, scale: 1.0, craft: None }
    }
}

/// Camera and objects.
pub(crate) struct SurrenderStage {
    /// Whether quaternions begin with the scalar.
    pub(crate) scalar_first: bool,
    /// Whether the camera looks along +z of its axes.
    pub(crate) looks_forward: bool,
    /// Width and height of the image [px].
    pub(crate) size: [u32; 2],
    /// Full fields of view (x, y) [rad].
    pub(crate) field: [f64; 2],
    position: DVec3,
    /// Rotates camera axes (OpenCV) into the script's frame.
    attitude: DMat3,
    objects: BTreeMap<String, SurrenderObject>,
    /// Radius of each shape that is a sphere [m].
    shapes: BTreeMap<String, f64>,
}

impl Default for SurrenderStage {
    fn default() -> Self {
        Self {
            scalar_first: false,
            looks_forward: false,
            size: SIZE,
            field: [FIELD; 2],
            position: DVec3::ZERO,
            // A script that sets no attitude sees along -z of its frame.
            attitude: forward_from_backward(),
            objects: BTreeMap::new(),
            shapes: BTreeMap::new(),
        }
    }
}

impl SurrenderStage {
    /// The object of a name, which is made where there is none.
    ///
    /// # Errors
    /// There are too many.
    pub(crate) fn object(&mut self, name: &str) -> Result<&mut SurrenderObject, Refusal> {
        if self.objects.len() >= MOST_OBJECTS && !self.objects.contains_key(name) {
            return Err(Refusal::because(format!("there are {MOST_OBJECTS} objects already")));
        }
        if name.len() > LONGEST_NAME {
            return Err(Refusal::because(format!("the name of an object has more than {LONGEST_NAME} bytes")));
        }
        Ok(self.objects.entry(name.to_owned()).or_default())
    }

    /// Keeps a shape. `radius` is the radius of a sphere [m].
    ///
    /// # Errors
    /// There are too many.
    pub(crate) fn set_shape(&mut self, name: &str, radius: Option<f64>) -> Result<(), Refusal> {
        if self.shapes.len() >= MOST_OBJECTS || name.len() > LONGEST_NAME {
            return Err(Refusal::because(format!(
                "there are {MOST_OBJECTS} shapes, or the name of one has more than {LONGEST_NAME} bytes"
            )));
        }
        self.shapes.remove(name);
        self.shapes.extend(radius.map(|radius| (name.to_owned(), radius)));
        Ok(())
    }

    /// Radius of a sphere [m].
    pub(crate) fn radius(&self, shape: &str) -> Option<f64> {
        self.shapes.get(shape).copied()
    }

    /// The band of the first craft.
    pub(crate) fn band(&mut self) -> Option<Band> {
        let mut craft = self.objects.values_mut().filter_map(|object| object.craft.as_mut());
        craft.next().map(|craft| craft.simulation().prepared().scene.band)
    }

    pub(crate) fn known(&self, name: &str) -> Option<&SurrenderObject> {
        self.objects.get(name)
    }

    pub(crate) fn craft_count(&self) -> usize {
        self.objects.values().filter(|object| object.craft.is_some()).count()
    }

    /// Each craft with the camera's view of it.
    ///
    /// # Errors
    /// Fields of view that are none.
    pub(crate) fn views(&mut self) -> Result<Vec<(ProtocolCamera, &mut ServedCraft)>, Refusal> {
        let (size, attitude, position) = (self.size, self.attitude, self.position);
        let [x, y] = self.field;
        let good = |field: f64| field > 0.0 && field < std::f64::consts::PI;
        if !good(x) || !good(y) {
            return Err(Refusal::because(format!("the fields of view of {x} and {y} rad are not between 0 and pi")));
        }
        let focal = [0, 1].map(|axis| 0.5 * f64::from(size[axis]) / (0.5 * self.field[axis]).tan());
        let view = |object: &SurrenderObject| {
            let body_from_stage = object.attitude.conjugate();
            ProtocolCamera {
                size,
                focal,
                position: body_from_stage * (position - object.position),
                body_from_camera: DMat3::from_quat(body_from_stage) * attitude,
                scale: object.scale,
            }
        };
        let views = self.objects.values_mut().filter_map(|object| Some((view(object), object.craft.as_mut()?)));
        Ok(views.collect())
    }

    /// Puts an object somewhere [m].
    ///
    /// # Errors
    /// There are too many objects, or a number is not finite.
    pub(crate) fn set_position(&mut self, name: &str, position: [f64; 3]) -> Result<(), Refusal> {
        let position = DVec3::from(position);
        if !position.is_finite() {
            return Err(Refusal::because(format!("the position of '{name}' is not finite")));
        }
        match name {
            CAMERA => self.position = position,
            _ => self.object(name)?.position = position,
        }
        Ok(())
    }

    /// Turns an object.
    ///
    /// # Errors
    /// There are too many objects, or the quaternion has no direction.
    pub(crate) fn set_attitude(&mut self, name: &str, [a, b, c, d]: [f64; 4]) -> Result<(), Refusal> {
        let numbers = if self.scalar_first { DVec4::new(b, c, d, a) } else { DVec4::new(a, b, c, d) };
        let Some(unit) = numbers.try_normalize() else {
            return Err(Refusal::because(format!("the attitude of '{name}' is no rotation")));
        };
        let turned = DQuat::from_vec4(unit);
        if name == CAMERA {
            let rotation = DMat3::from_quat(turned);
            self.attitude = if self.looks_forward { rotation } else { rotation * forward_from_backward() };
        } else {
            self.object(name)?.attitude = turned;
        }
        Ok(())
    }

    /// Position of an object [m].
    pub(crate) fn position(&self, name: &str) -> Option<DVec3> {
        if name == CAMERA { Some(self.position) } else { self.known(name).map(|object| object.position) }
    }

    /// Attitude of an object, in the order and with the camera axes of the present conventions.
    pub(crate) fn attitude(&self, name: &str) -> Option<[f64; 4]> {
        let of_camera = || if self.looks_forward { self.attitude } else { self.attitude * forward_from_backward() };
        let quaternion = if name == CAMERA { DQuat::from_mat3(&of_camera()) } else { self.known(name)?.attitude };
        let [x, y, z, w] = quaternion.to_array();
        Some(if self.scalar_first { [w, x, y, z] } else { [x, y, z, w] })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `look_at` of the client reads the conventions, sets others, turns the camera and sets them back.
    #[test]
    fn a_change_of_conventions_turns_nothing() {
        let mut stage = SurrenderStage::default();
        assert!((stage.attitude * DVec3::Z).distance(DVec3::NEG_Z) < 1e-15, "a new camera looks along -z");
        stage.set_attitude(CAMERA, [0.0, 0.0, 0.0, 1.0]).expect("a rotation");
        assert!((stage.attitude * DVec3::Z).distance(DVec3::NEG_Z) < 1e-15);
        (stage.scalar_first, stage.looks_forward) = (true, true);
        assert!((stage.attitude * DVec3::Z).distance(DVec3::NEG_Z) < 1e-15);
        let half = 0.5f64.sqrt();
        stage.set_attitude(CAMERA, [half, half, 0.0, 0.0]).expect("a rotation");
        // A quarter about +x takes +z to -y.
        assert!((stage.attitude * DVec3::Z).distance(DVec3::NEG_Y) < 1e-15);
        let told = stage.attitude(CAMERA).expect("the camera");
        assert!(told.iter().zip([half, half, 0.0, 0.0]).all(|(a, b)| (a - b).abs() < 1e-15), "{told:?}");
        stage.set_attitude("craft", [half, 0.0, 0.0, half]).expect("a rotation");
        assert!((stage.known("craft").expect("it").attitude * DVec3::X).distance(DVec3::Y) < 1e-15);
        assert!(stage.set_attitude("craft", [0.0; 4]).is_err());
        assert!(stage.set_position("craft", [f64::NAN, 0.0, 0.0]).is_err());
    }
}
