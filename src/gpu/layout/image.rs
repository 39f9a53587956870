//! Structures of an image: its camera, what surrounds the craft, and how surfaces emit and reflect in the band.

use super::shared::shared;
use crate::thermal::surroundings::sun_irradiance;

shared! {
    /// Camera of an image.
    #[derive(serde::Serialize, serde::Deserialize)]
    pub struct View {
        /// First row of camera_from_body: rotation and translation [m].
        pub camera_from_body_x: [f32; 4],
        /// Second row.
        pub camera_from_body_y: [f32; 4],
        /// Third row.
        pub camera_from_body_z: [f32; 4],
        /// Camera to clip coordinates: clip.x = scale.x * x + offset.x * z, and the same for y (OpenCV axes).
        pub(crate) clip_scale: [f32; 2],
        /// Factors of z in these equations.
        pub(crate) clip_offset: [f32; 2],
        /// Width and height [px].
        pub(crate) size: [f32; 2],
        /// Distance of the near plane [m]. Depth is reversed, with the far plane at infinity.
        pub(crate) near: f32,
        /// Image motion that culling tolerates [px].
        pub(crate) margin: f32,
    }

    /// Camera of an image with a rolling shutter, beside the `View` of its first row.
    pub struct Shutter {
        /// First row of camera_from_body at the time of the middle row of the image.
        pub(crate) middle_x: [f32; 4],
        /// Second row of it.
        pub(crate) middle_y: [f32; 4],
        /// Third row of it.
        pub(crate) middle_z: [f32; 4],
        /// First row of camera_from_body at the time of the last row of the image.
        pub(crate) last_x: [f32; 4],
        /// Second row of it.
        pub(crate) last_y: [f32; 4],
        /// Third row of it.
        pub(crate) last_z: [f32; 4],
        /// Smallest x and y, and largest x and y, of the rays whose row is computed.
        pub(crate) field: [f32; 4],
        /// Distortion: k1, k2, p1, p2; of a fisheye k1 to k4.
        pub(crate) first_numbers: [f32; 4],
        /// Distortion: k3, k4, k5, k6.
        pub(crate) second_numbers: [f32; 4],
        /// Distortion: s1, s2, s3, s4.
        pub(crate) third_numbers: [f32; 4],
        /// Share of the image for a unit of the distorted y.
        pub(crate) row_scale: f32,
        /// Share of the image above the centre of its first row where y is 0.
        pub(crate) row_offset: f32,
        /// Padding to the alignment of GLSL.
        pub(crate) unused: [f32; 2],
    }

    /// Rotations of directions in the sky from the axes of a camera with a rolling shutter to those at its first row.
    pub struct ShutterSky {
        /// First row of the rotation from the axes at the middle row.
        pub(crate) middle_x: [f32; 4],
        /// Second row of the rotation from the axes at the middle row.
        pub(crate) middle_y: [f32; 4],
        /// Third row of the rotation from the axes at the middle row.
        pub(crate) middle_z: [f32; 4],
        /// First row of the rotation from the axes at the last row.
        pub(crate) last_x: [f32; 4],
        /// Second row of the rotation from the axes at the last row.
        pub(crate) last_y: [f32; 4],
        /// Third row of the rotation from the axes at the last row.
        pub(crate) last_z: [f32; 4],
    }

    /// Sizes of an image that is made from a finer one.
    pub(crate) struct Sampling {
        /// Width of the image [px].
        pub(crate) width: u32,
        /// Height of the image [px].
        pub(crate) height: u32,
        /// Width of the source [texels].
        pub(crate) source_width: u32,
        /// Height of the source [texels].
        pub(crate) source_height: u32,
        /// Lookups along the width of a pixel.
        pub(crate) columns: u32,
        /// Lookups along the height of a pixel.
        pub(crate) rows: u32,
    }

    /// A crop around a craft that is far away.
    pub struct Distant {
        /// Upper left corner of the crop in the image [px].
        pub(crate) corner: [f32; 2],
        /// Focal lengths of the image [px].
        pub(crate) focal: [f32; 2],
        /// Principal point of the image [px].
        pub(crate) centre: [f32; 2],
        /// Texels along the side of a pixel.
        pub(crate) scale: f32,
        /// Places in a pixel along each axis at which the sky is seen.
        pub(crate) lookups: f32,
        /// Width of the image [px]. The crop is drawn into an image of this width.
        pub(crate) width: u32,
        /// Height of the image [px].
        pub(crate) height: u32,
        /// Width of the crop [texels].
        pub(crate) across: u32,
        /// Height of the crop [texels].
        pub(crate) down: u32,
    }

    /// What surrounds the craft, in the axes of the camera.
    pub struct Surroundings {
        /// Unit vector to the planet's centre; w: sine of the planet's angular radius.
        pub(crate) nadir: [f32; 4],
        /// Unit vector to the Sun's centre; w: sine of the Sun's angular radius.
        pub(crate) sun: [f32; 4],
        /// Cosine of the planet's angular radius.
        pub(crate) planet_cosine: f32,
        /// Cosine of the Sun's angular radius.
        pub(crate) sun_cosine: f32,
        /// Radiance of the planet [W m-2 sr-1].
        pub(crate) planet_radiance: f32,
        /// Radiance of deep space [W m-2 sr-1].
        pub(crate) space_radiance: f32,
        /// Radiance of the Sun's disc [W m-2 sr-1].
        pub(crate) sun_radiance: f32,
        /// Irradiance across the Sun's rays in the band [W/m2].
        pub(crate) sun_irradiance: f32,
        /// Padding to the alignment of GLSL.
        pub(crate) unused: [f32; 2],
    }

    /// How a face of a material emits and reflects in the band.
    pub(crate) struct Reflector {
        /// Emissivity.
        pub(crate) emissivity: f32,
        /// Share of the reflected light that leaves about the mirror direction.
        pub(crate) specular: f32,
        /// Roughness of the mirror; 0 for a smooth one.
        pub(crate) roughness: f32,
        /// Index of the first number of its lobe.
        pub(crate) lobe: f32,
        /// Index of the first number of its emissivities over angle and temperature.
        pub(crate) table: f32,
        /// Their factor at the temperature of the planet.
        pub(crate) of_planet: f32,
        /// Their factor at the temperature of deep space.
        pub(crate) of_space: f32,
        /// Their factor at the temperature of the Sun.
        pub(crate) of_sun: f32,
    }

    /// Rays of an image against the craft's own triangles.
    pub(crate) struct Tracing {
        /// Number of boxes in the tree.
        pub(crate) boxes: u32,
        /// Word of the time, so that each image has rays of its own.
        pub(crate) word: u32,
        /// Distance between a ray's start and its surface [m].
        pub(crate) start: f32,
        /// Width of the image [texels].
        pub(crate) width: u32,
        /// Number of its texels.
        pub(crate) texels: u32,
        /// Width of the image of surfaces [texels].
        pub(crate) surface_width: u32,
        /// Rays of a path at most.
        pub(crate) bounces: u32,
        /// Surfaces of a path that one dispatch follows.
        pub(crate) vertices: u32,
        /// Rays of a path after which chance ends it.
        pub(crate) roulette: u32,
        /// Share of the light below which a path ends.
        pub(crate) least: f32,
    }

    /// Axes of the map of a planet that is not uniform.
    pub struct PlanetView {
        /// +X of the map in the axes of the camera; w: columns of the map.
        pub(crate) x: [f32; 4],
        /// +Y of the map; w: rows of the map.
        pub(crate) y: [f32; 4],
        /// +Z of the map; w: 0.
        pub(crate) z: [f32; 4],
    }

    /// An indexed indirect draw command (VkDrawIndexedIndirectCommand).
    pub(crate) struct DrawCommand {
        /// Three for each triangle.
        pub(crate) index_count: u32,
        /// Always 1.
        pub(crate) instance_count: u32,
        /// First index in the buffer of all triangles.
        pub(crate) first_index: u32,
        /// Always 0.
        pub(crate) vertex_offset: i32,
        /// Always 0.
        pub(crate) first_instance: u32,
    }

    /// Head of the band table.
    pub(crate) struct Band {
        /// c2 divided by the longest wavelength, rounded to f32 [K].
        pub(crate) edge_high: f32,
        /// Remainder of that rounding [K].
        pub(crate) edge_low: f32,
    }
}

impl Surroundings {
    /// Rounds surroundings to f32.
    pub(crate) fn new(around: &crate::thermal::surroundings::Surroundings) -> Self {
        let with = |v: glam::DVec3, w: f64| [v.x as f32, v.y as f32, v.z as f32, w as f32];
        Self {
            nadir: with(around.nadir, around.planet.sin),
            sun: with(around.sun, around.sun_disc.sin),
            planet_cosine: around.planet.cos as f32,
            sun_cosine: around.sun_disc.cos as f32,
            planet_radiance: around.planet_radiance as f32,
            space_radiance: around.space_radiance as f32,
            sun_radiance: around.sun_radiance as f32,
            sun_irradiance: sun_irradiance(around) as f32,
            unused: [0.0; 2],
        }
    }
}

impl PlanetView {
    /// Rounds the rotation from camera axes into map axes to f32. `size` are the map's columns and rows.
    pub(crate) fn new(map_from_camera: &glam::DMat3, [columns, rows]: [usize; 2]) -> Self {
        let row = |axis: usize, size: usize| {
            let row = map_from_camera.row(axis);
            [row.x as f32, row.y as f32, row.z as f32, size as f32]
        };
        Self { x: row(0, columns), y: row(1, rows), z: row(2, 0) }
    }
}
