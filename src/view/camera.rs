//! The camera of a page: the scene's with the size of the page's image, and its poses.

use glam::{DQuat, DVec3};

use crate::lens::Lens;
use crate::scene::{Camera, CameraFrame, Motion, MotionBlur};
use crate::simulation::facade_error::SimulationError;
use crate::simulation::pose::Pose;
use crate::simulation::prepare::Prepared;

/// Most pixels of an image where the user gives no size.
const MOST_PIXELS: f64 = 640.0 * 480.0;

/// Size of the image of a scene without a camera [px], and its field of view [rad].
const SIZE: [u32; 2] = [640, 480];
const FIELD: f64 = 0.6;

/// The near plane lies at most at this share of the distance to the point that is looked at.
const NEAR_SHARE: f64 = 0.05;

/// The scene's camera with another size and the same field of view from top to bottom. Without `size`, the image has the size of the scene, or a
/// smaller size of the same shape. With a sensor the image always has the size of the scene. A scene without a camera gets a plain camera.
///
/// # Errors
/// A size for a scene with a sensor, in words.
pub(crate) fn camera(of_scene: Option<&Camera>, sensor: bool, size: Option<[u32; 2]>) -> Result<Camera, String> {
    let Some(of_scene) = of_scene else { return Ok(plain(size.unwrap_or(SIZE))) };
    if sensor {
        return match size {
            Some(_) => Err("--size can not be combined with [sensor], whose pixels are those of the scene".to_owned()),
            None => Ok(of_scene.clone()),
        };
    }
    let present = [of_scene.width, of_scene.height];
    let pixels = f64::from(of_scene.width) * f64::from(of_scene.height);
    let share = (MOST_PIXELS / pixels).sqrt().min(1.0);
    let smaller = present.map(|side| ((f64::from(side) * share).round() as u32).max(1));
    Ok(sized(of_scene, size.unwrap_or(smaller)))
}

fn sized(of_scene: &Camera, [width, height]: [u32; 2]) -> Camera {
    if [width, height] == [of_scene.width, of_scene.height] {
        return of_scene.clone();
    }
    let scale = f64::from(height) / f64::from(of_scene.height);
    let across = f64::from(width) / f64::from(of_scene.width);
    let lens = Lens {
        focal: of_scene.lens.focal.map(|focal| focal * scale),
        centre: [of_scene.lens.centre[0] * across, of_scene.lens.centre[1] * scale],
        skew: of_scene.lens.skew * scale,
        ..of_scene.lens
    };
    Camera { width, height, lens, ..of_scene.clone() }
}

fn plain([width, height]: [u32; 2]) -> Camera {
    let focal = 0.5 * f64::from(height) / (0.5 * FIELD).tan();
    Camera {
        width,
        height,
        lens: Lens::pinhole([focal; 2], [f64::from(width) / 2.0, f64::from(height) / 2.0]),
        samples: 1,
        line_time: 0.0,
        exposure: MotionBlur::default(),
        motion: Motion::Still,
        frame: CameraFrame::Body,
        position: DVec3::new(0.0, 0.0, -10.0),
        frame_from_camera: DQuat::IDENTITY,
        near: 0.1,
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum PageCamera {
    /// Where the scene's camera is.
    Scene,
    /// At a position, with a point in the middle of the image, in the body frame [m].
    At {
        /// Position [m].
        position: DVec3,
        /// The point [m].
        target: DVec3,
        /// Up in the image.
        up: DVec3,
    },
}

impl PageCamera {
    /// Camera and pose for an image.
    ///
    /// # Errors
    /// A pose that can not be used.
    pub(crate) fn of(&self, camera: &Camera) -> Result<(Camera, Pose), SimulationError> {
        match *self {
            Self::Scene => Ok((camera.clone(), Pose::OfCamera)),
            Self::At { position, target, up } => {
                let pose = Pose::look_at(CameraFrame::Body, position, target, up)?;
                let near = camera.near.min(NEAR_SHARE * position.distance(target));
                Ok((Camera { near, line_time: 0.0, exposure: MotionBlur::default(), ..camera.clone() }, pose))
            }
        }
    }
}

/// Middle of the craft and the radius of a ball around it in the file's pose [m].
pub(crate) fn extent(prepared: &Prepared) -> (DVec3, f64) {
    let nodes = &prepared.nodes;
    let positions = || nodes.node_of_vertex.iter().map(|slot| nodes.positions[*slot as usize].as_dvec3());
    let ends = positions().fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[low, high], at| [low.min(at), high.max(at)]);
    let middle = 0.5 * (ends[0] + ends[1]);
    (middle, positions().map(|at| at.distance(middle)).fold(1e-3, f64::max))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_smaller_image_has_the_same_field() {
        let mut own = plain([2048, 1536]);
        own.lens.skew = 3.0;
        let small = camera(Some(&own), false, None).unwrap();
        assert_eq!([small.width, small.height], [640, 480]);
        assert!((small.lens.focal[1] / 480.0 - own.lens.focal[1] / 1536.0).abs() < 1e-12);
        assert_eq!(small.lens.centre, [320.0, 240.0]);
        let wide = camera(Some(&own), false, Some([800, 400])).unwrap();
        assert!((wide.lens.focal[0] / 400.0 - own.lens.focal[0] / 1536.0).abs() < 1e-12);
        assert_eq!(camera(Some(&own), true, None).unwrap(), own);
        assert!(camera(Some(&own), true, Some([8, 8])).is_err());
        assert_eq!(camera(None, false, Some([30, 20])).unwrap().width, 30);
    }

    #[test]
    fn the_near_plane_follows_the_camera() {
        let near = |distance: f64| {
            let look = PageCamera::At { position: DVec3::X * distance, target: DVec3::ZERO, up: DVec3::Z };
            look.of(&plain(SIZE)).unwrap().0.near
        };
        assert_eq!((near(100.0), near(1.0)), (0.1, 0.05));
        assert!(PageCamera::At { position: DVec3::Z, target: DVec3::ZERO, up: DVec3::Z }.of(&plain(SIZE)).is_err());
    }
}
