//! The row of an image in the index.

use glam::DVec3;
use serde_json::{Map, Value as Json, json};

use super::spec::ImageKind;
use crate::labels::image::LabelledImage;
use crate::labels::places;

/// The file of an image of a kind, in the data set.
pub(crate) fn file_of(image: &LabelledImage, kind: ImageKind) -> (&'static str, String) {
    match kind {
        ImageKind::Numbers => ("gray", places::of_image(image, "gray", "png")),
        ImageKind::Radiance => ("radiance", places::of_image(image, "radiance", "exr")),
    }
}

/// The row of an image, in the order of the columns.
pub(crate) fn row(image: &LabelledImage, kinds: &[ImageKind]) -> Map<String, Json> {
    let mut row = Map::new();
    let mut put = |key: &str, value: Json| {
        row.insert(key.to_owned(), value);
    };
    put("sample", json!(image.identity.sample));
    put("split", json!(image.identity.split.name()));
    put("orbit", json!(image.identity.orbit));
    put("number", json!(image.identity.number));
    for kind in kinds {
        let (name, path) = file_of(image, *kind);
        put(name, json!(path));
    }
    if kinds.contains(&ImageKind::Numbers) {
        put("gray8", json!(places::of_image(image, "gray8", "png")));
    }
    put("time_s", json!(image.time));
    put("lit_fraction", json!(image.lit));
    let place = image.camera_from_body.translation;
    put("distance_m", json!(place.length()));
    put("phase_angle_deg", json!(phase_angle_deg(image)));
    for (key, value) in ["tx_m", "ty_m", "tz_m"].into_iter().zip(place.to_array()) {
        put(key, json!(value));
    }
    let turn = image.quaternion();
    for (key, value) in [("qw", turn.w), ("qx", turn.x), ("qy", turn.y), ("qz", turn.z)] {
        put(key, json!(value));
    }
    for (name, direction) in [("sun", image.sun), ("planet", image.planet)] {
        for (axis, value) in ["x", "y", "z"].into_iter().zip(direction.to_array()) {
            put(&format!("{name}_{axis}"), json!(value));
        }
    }
    put("planet_half_angle_deg", json!(image.planet_radius.to_degrees()));
    let [fx, _, cx, _, fy, cy, ..] = image.camera_matrix();
    for (key, value) in [("fx_px", fx), ("fy_px", fy), ("cx_px", cx), ("cy_px", cy)] {
        put(key, json!(value));
    }
    put("width_px", json!(image.width));
    put("height_px", json!(image.height));
    let pixels = CraftPixels::of(image);
    put("visible_pixels", json!(pixels.pixels));
    for (key, value) in ["box_x_px", "box_y_px", "box_width_px", "box_height_px"].into_iter().zip(pixels.bounds()) {
        put(key, json!(value));
    }
    for (key, value) in
        ["temperature_least_K", "temperature_mean_K", "temperature_greatest_K"].into_iter().zip(pixels.temperatures)
    {
        put(key, json!(value));
    }
    for joint in &image.joints {
        let unit = if joint.turns { "rad" } else { "m" };
        put(&format!("joint.{}_{unit}", joint.name), json!(joint.position));
    }
    for (name, value) in &image.identity.sensor {
        put(&format!("sensor.{name}"), json!(value));
    }
    for (name, value) in &image.identity.drawn {
        put(&format!("drawn.{name}"), json!(value));
    }
    row
}

/// Angle at the craft between the directions to the Sun and to the camera [deg].
pub(crate) fn phase_angle_deg(image: &LabelledImage) -> f64 {
    let to_camera = -image.camera_from_body.translation.normalize_or(DVec3::NEG_Z);
    to_camera.cross(image.sun).length().atan2(to_camera.dot(image.sun)).to_degrees()
}

/// Extent and temperatures of the pixels that show the craft.
struct CraftPixels {
    pixels: u64,
    first: [u32; 2],
    last: [u32; 2],
    /// Least, mean and greatest temperature [K].
    temperatures: [f64; 3],
}

impl CraftPixels {
    fn of(image: &LabelledImage) -> Self {
        let mut craft = Self { pixels: 0, first: [u32::MAX; 2], last: [0; 2], temperatures: [f64::INFINITY, 0.0, 0.0] };
        let mut sum = 0.0;
        for (at, _) in image.channels.part.iter().enumerate().filter(|(_, part)| **part != 0) {
            let place = [at as u32 % image.width, at as u32 / image.width];
            let temperature = f64::from(image.channels.temperature[at]);
            craft.pixels += 1;
            sum += temperature;
            for (axis, at) in place.into_iter().enumerate() {
                craft.first[axis] = craft.first[axis].min(at);
                craft.last[axis] = craft.last[axis].max(at);
            }
            craft.temperatures[0] = craft.temperatures[0].min(temperature);
            craft.temperatures[2] = craft.temperatures[2].max(temperature);
        }
        if craft.pixels == 0 {
            return Self { first: [0; 2], temperatures: [0.0; 3], ..craft };
        }
        craft.temperatures[1] = sum / craft.pixels as f64;
        craft
    }

    /// Left, top, width and height. A single pixel has the width 1.
    fn bounds(&self) -> [u32; 4] {
        let size = |axis: usize| if self.pixels == 0 { 0 } else { self.last[axis] - self.first[axis] + 1 };
        [self.first[0], self.first[1], size(0), size(1)]
    }
}
