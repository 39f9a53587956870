//! The lens of a camera in f64: where a ray meets the image, and which ray a pixel sees. The device has its results as a table.
//!
//! A ray is (x, y) = (X / Z, Y / Z) in camera axes: +X right, +Y down, +Z forward. The models and the order of their numbers follow OpenCV (module
//! calib3d: `projectPoints` and `fisheye::projectPoints`). Pixels differ by half a pixel: the centre of the upper left pixel is (0.5, 0.5) here and
//! (0, 0) in OpenCV.

pub(crate) mod rolling;

use glam::{DMat2, DVec2};

/// Largest angle between a ray and the camera's axis that a distorted image may have [rad]: an image plane shows no more.
pub(crate) const WIDEST: f64 = 75.0 * std::f64::consts::PI / 180.0;

/// Least area of a ray's surroundings in the image, as a share of their area without distortion. Below it the image folds.
const LEAST_AREA: f64 = 1e-4;

/// Steps from the principal point to a pixel. Each begins where the last one ended, so that the ray stays on the branch of the axis.
const STEPS: u32 = 32;

const ITERATIONS: u32 = 20;

/// Rays from the principal point to the border of the frame along each side, on which the distortion is checked.
const SPOKES: u32 = 64;

/// Distortion of the ray before the focal lengths.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Distortion {
    /// None.
    None,
    /// The model of Brown and Conrady: k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4. Numbers that a calibration does not have are 0.
    BrownConrady([f64; 12]),
    /// A fisheye of Kannala and Brandt: k1, k2, k3, k4.
    Fisheye([f64; 4]),
}

/// Focal lengths, principal point, skew and distortion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lens {
    /// Focal lengths in pixels (x, y).
    pub focal: [f64; 2],
    /// Principal point in pixels. The centre of the upper left pixel is (0.5, 0.5).
    pub centre: [f64; 2],
    /// Pixels to the right for each unit of the distorted y.
    pub skew: f64,
    /// Distortion.
    pub distortion: Distortion,
}

/// A lens that cannot be used.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum LensError {
    /// Two rays, or none, belong to a pixel.
    #[error(
        "folds the image: no single ray belongs to the pixel at ({:.1}, {:.1}), within the frame or between it and the principal point", .0.x, .0.y
    )]
    Folds(DVec2),
    /// A pixel looks too far from the axis.
    #[error(
        "makes the pixel at ({:.1}, {:.1}) look more than {:.0} deg from the camera's axis, which is the most that an image with distortion may show",
        .0.x, .0.y, WIDEST.to_degrees()
    )]
    TooWide(DVec2),
}

/// The rays of a whole image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Field {
    pub(crate) low: DVec2,
    pub(crate) high: DVec2,
    /// Most pixels for a unit of the ray, in any direction at any place.
    pub(crate) finest: f64,
}

impl Distortion {
    /// The distorted ray, and its derivatives by x and y.
    fn bend(&self, ray: DVec2) -> (DVec2, DMat2) {
        let DVec2 { x, y } = ray;
        let r2 = ray.length_squared();
        match self {
            Self::None => (ray, DMat2::IDENTITY),
            Self::BrownConrady([k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4]) => {
                let above = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
                let below = 1.0 + r2 * (k4 + r2 * (k5 + r2 * k6));
                let (above_slope, below_slope) =
                    (k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3), k4 + r2 * (2.0 * k5 + r2 * 3.0 * k6));
                let radial = above / below;
                // By r2.
                let slope = (above_slope - radial * below_slope) / below;
                let (prism_x, prism_y) = (2.0 * (s1 + 2.0 * s2 * r2), 2.0 * (s3 + 2.0 * s4 * r2));
                let bent = DVec2::new(
                    x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x) + r2 * (s1 + s2 * r2),
                    y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y + r2 * (s3 + s4 * r2),
                );
                let cross = 2.0 * x * y * slope + 2.0 * p1 * x + 2.0 * p2 * y;
                let by_x = DVec2::new(
                    radial + 2.0 * x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x + x * prism_x,
                    cross + x * prism_y,
                );
                let by_y = DVec2::new(
                    cross + y * prism_x,
                    radial + 2.0 * y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x + y * prism_y,
                );
                (bent, DMat2::from_cols(by_x, by_y))
            }
            Self::Fisheye([k1, k2, k3, k4]) => {
                let r = r2.sqrt();
                if r < 1e-8 {
                    return (ray, DMat2::IDENTITY);
                }
                let angle = r.atan();
                let a2 = angle * angle;
                let bent = angle * (1.0 + a2 * (k1 + a2 * (k2 + a2 * (k3 + a2 * k4))));
                let by_angle = 1.0 + a2 * (3.0 * k1 + a2 * (5.0 * k2 + a2 * (7.0 * k3 + a2 * 9.0 * k4)));
                let scale = bent / r;
                let slope = (by_angle / (1.0 + r2) - scale) / r2;
                let outer = DMat2::from_cols(ray * x, ray * y);
                (ray * scale, DMat2::from_diagonal(DVec2::splat(scale)) + outer * slope)
            }
        }
    }
}

impl Lens {
    /// A lens without skew and distortion.
    pub fn pinhole(focal: [f64; 2], centre: [f64; 2]) -> Self {
        Self { focal, centre, skew: 0.0, distortion: Distortion::None }
    }

    /// Whether the lens has neither skew nor distortion.
    pub(crate) fn is_pinhole(&self) -> bool {
        self.skew == 0.0 && self.distortion == Distortion::None
    }

    /// The matrix from the distorted ray to pixels, without the principal point.
    fn matrix(&self) -> DMat2 {
        DMat2::from_cols(DVec2::new(self.focal[0], 0.0), DVec2::new(self.skew, self.focal[1]))
    }

    /// Where a ray meets the image [px]. A ray far outside the frame may land within it, because a model holds only for rays inside its frame.
    pub(crate) fn project(&self, ray: DVec2) -> DVec2 {
        self.matrix() * self.distortion.bend(ray).0 + DVec2::from(self.centre)
    }

    /// Change of the pixel by x and y of the ray [px].
    fn slopes(&self, ray: DVec2) -> DMat2 {
        self.matrix() * self.distortion.bend(ray).1
    }

    /// The ray that a place in the image sees [px]. `None` where the distortion folds the image between it and the principal point.
    pub fn unproject(&self, pixel: DVec2) -> Option<DVec2> {
        let centre = DVec2::from(self.centre);
        if self.distortion == Distortion::None {
            return Some(self.matrix().inverse() * (pixel - centre));
        }
        (1..=STEPS).try_fold(DVec2::ZERO, |ray, step| {
            self.unproject_from(ray, centre.lerp(pixel, f64::from(step) / f64::from(STEPS)))
        })
    }

    /// The ray of `pixel` by Newton's method, from the ray `near` of a place close to it.
    pub(crate) fn unproject_from(&self, near: DVec2, pixel: DVec2) -> Option<DVec2> {
        let tolerance = 1e-10 * (1.0 + pixel.abs().max_element());
        let least = LEAST_AREA * self.focal[0] * self.focal[1];
        let mut ray = near;
        for _ in 0..ITERATIONS {
            let slopes = self.slopes(ray);
            let missed = self.project(ray) - pixel;
            // Also false where it is no number.
            if !slopes.determinant().ge(&least) {
                return None;
            }
            // The last iteration squares the error that is left.
            ray -= slopes.inverse() * missed;
            if missed.abs().max_element() <= tolerance {
                return Some(ray);
            }
        }
        None
    }

    /// The rays of a frame of this size. One ray belongs to each place in it.
    ///
    /// # Errors
    /// Distortion that folds the image within the frame, or between it and the principal point; a frame that looks beyond [`WIDEST`].
    pub fn field(&self, [width, height]: [u32; 2]) -> Result<Field, LensError> {
        let [width, height] = [width, height].map(f64::from);
        let mut field = Field {
            low: DVec2::INFINITY,
            high: DVec2::NEG_INFINITY,
            finest: largest_stretch(self.slopes(DVec2::ZERO)),
        };
        let centre = DVec2::from(self.centre);
        let along = (0..SPOKES).map(|spoke| f64::from(spoke) / f64::from(SPOKES));
        let border = along.flat_map(|share| {
            [
                DVec2::new(width * share, 0.0),
                DVec2::new(width, height * share),
                DVec2::new(width * (1.0 - share), height),
                DVec2::new(0.0, height * (1.0 - share)),
            ]
        });
        for end in border {
            let mut ray = DVec2::ZERO;
            for step in 1..=STEPS {
                let pixel = centre.lerp(end, f64::from(step) / f64::from(STEPS));
                ray = self.unproject_from(ray, pixel).ok_or(LensError::Folds(pixel))?;
                if ray.length() > WIDEST.tan() {
                    return Err(LensError::TooWide(pixel));
                }
                field.finest = field.finest.max(largest_stretch(self.slopes(ray)));
            }
            field.low = field.low.min(ray);
            field.high = field.high.max(ray);
        }
        Ok(field)
    }
}

/// Largest factor by which a matrix stretches a vector: its greater singular value.
fn largest_stretch(matrix: DMat2) -> f64 {
    let squares = matrix.transpose() * matrix;
    let mean = 0.5 * (squares.x_axis.x + squares.y_axis.y);
    let spread = DVec2::new(0.5 * (squares.x_axis.x - squares.y_axis.y), squares.y_axis.x);
    (mean + spread.length()).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    const BARREL: [f64; 12] = [-0.31, 0.12, 0.0011, -0.0007, -0.021, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    const RATIONAL: [f64; 12] = [1.21, 0.43, -0.0004, 0.0006, 0.017, 1.57, 0.66, 0.09, 0.0, 0.0, 0.0, 0.0];
    const PRISM: [f64; 12] = [-0.2, 0.05, 0.001, 0.0005, 0.0, 0.0, 0.0, 0.0, 0.004, -0.001, -0.003, 0.002];
    const FISHEYE: [f64; 4] = [-0.013, 0.0042, -0.0019, 0.0002];

    fn lens(distortion: Distortion) -> Lens {
        Lens { focal: [513.7, 509.2], centre: [323.9, 251.3], skew: 0.0, distortion }
    }

    fn all() -> [Lens; 5] {
        [
            lens(Distortion::None),
            lens(Distortion::BrownConrady(BARREL)),
            lens(Distortion::BrownConrady(RATIONAL)),
            Lens { skew: 1.75, ..lens(Distortion::BrownConrady(PRISM)) },
            Lens { skew: -0.9, ..lens(Distortion::Fisheye(FISHEYE)) },
        ]
    }

    /// Pixels of (0.31, -0.22) and (-0.45, 0.4), from opencv-python-headless 5.0.0.93 (`projectPoints`, `fisheye.projectPoints` with alpha = skew / fx) with cx
    /// and cy less by a half, plus a half. The skew of the fourth lens is added by hand, because `projectPoints` has none.
    const OPENCV: [[[f64; 2]; 2]; 5] = [
        [[483.147, 139.276], [92.735, 454.98]],
        [[476.2043051265523, 144.20429772283288], [114.81881455875975, 435.61009206968754]],
        [[475.95851125428044, 144.3347178731953], [115.90954699681248, 434.5854659942431]],
        [[478.638964625225, 142.28520791030002], [109.31848358593746, 441.38738337499996]],
        [[476.01820384504254, 144.4237124554734], [116.22837962843366, 433.9954136152926]],
    ];

    #[test]
    fn points_appear_where_opencv_has_them() {
        for (lens, expected) in all().iter().zip(OPENCV) {
            for (ray, pixel) in [DVec2::new(0.31, -0.22), DVec2::new(-0.45, 0.4)].into_iter().zip(expected) {
                let missed = lens.project(ray) - DVec2::from(pixel);
                assert!(missed.length() < 1e-9, "{lens:?}: {missed} px from {pixel:?}");
                assert!((lens.project(ray + 1e-9) - DVec2::from(pixel)).length() > 1e-9, "a nanoradian shows");
            }
        }
    }

    #[test]
    fn slopes_are_those_of_the_projection() {
        for lens in all() {
            for ray in [DVec2::new(0.21, -0.33), DVec2::new(-0.4, 0.1), DVec2::ZERO] {
                let step = 1e-6;
                let by =
                    |axis: DVec2| (lens.project(ray + step * axis) - lens.project(ray - step * axis)) / (2.0 * step);
                let expected = DMat2::from_cols(by(DVec2::X), by(DVec2::Y));
                let slopes = lens.slopes(ray);
                assert!(slopes.abs_diff_eq(expected, 1e-5), "{lens:?} at {ray}: {slopes} against {expected}");
            }
        }
    }

    #[test]
    fn a_pixel_sees_the_ray_that_appears_in_it() {
        for lens in all() {
            for x in 0..=16 {
                for y in 0..=16 {
                    let pixel = DVec2::new(40.0 * f64::from(x), 32.0 * f64::from(y));
                    let ray = lens.unproject(pixel).expect("one ray for each pixel");
                    assert!((lens.project(ray) - pixel).length() < 1e-7, "{lens:?} at {pixel}");
                }
            }
        }
    }

    #[test]
    fn a_field_holds_the_rays_of_all_pixels_and_its_finest_spacing() {
        for lens in all() {
            let field = lens.field([640, 512]).expect("a lens");
            for x in 0..=64 {
                for y in 0..=64 {
                    let ray = lens.unproject(DVec2::new(10.0 * f64::from(x), 8.0 * f64::from(y))).expect("a ray");
                    assert!((ray + 1e-4).cmpge(field.low).all() && (ray - 1e-4).cmple(field.high).all(), "{ray}");
                    assert!(largest_stretch(lens.slopes(ray)) < field.finest * 1.001);
                }
            }
        }
    }

    #[test]
    fn an_image_that_folds_is_refused() {
        // r (1 + k1 r^2) has its maximum at r = 1 / sqrt(-3 k1), where the image is 2 r / 3 wide.
        let folding = |k1: f64| {
            let mut numbers = [0.0; 12];
            numbers[0] = k1;
            lens(Distortion::BrownConrady(numbers)).field([640, 512])
        };
        // The corner (0, 512) is 0.813 focal lengths from the principal point, so the limit of k1 is -4 / (27 0.813^2) = -0.224.
        assert!(folding(-0.22).is_ok());
        assert!(matches!(folding(-0.23), Err(LensError::Folds(_))));
        assert!(matches!(lens(Distortion::Fisheye([-0.9, 0.0, 0.0, 0.0])).field([640, 512]), Err(LensError::Folds(_))));
    }

    #[test]
    fn a_frame_beyond_one_plane_is_refused() {
        let equidistant = |focal: f64| Lens {
            focal: [focal; 2],
            centre: [320.0, 256.0],
            skew: 0.0,
            distortion: Distortion::Fisheye([0.0; 4]),
        };
        // The corner is 409.8 px from the centre: 75 deg with a focal length of 313.1 px.
        assert!(equidistant(314.0).field([640, 512]).is_ok());
        assert!(matches!(equidistant(312.0).field([640, 512]), Err(LensError::TooWide(_))));
        assert!(matches!(equidistant(150.0).field([640, 512]), Err(LensError::TooWide(_))));
    }
}
