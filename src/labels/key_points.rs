//! Key points: named points of the craft, where they appear in an image, and whether they are seen there.

use glam::{DVec2, DVec3};

use super::craft::Craft;
use super::image::LabelledImage;

/// Key points of a craft for which nobody chose any.
pub const CHOSEN: usize = 12;

/// Spacings of the pixels by which a key point may lie behind what its pixel shows. A surface at 63 deg to the line of sight changes its depth by
/// two of them from one pixel to the next.
const SPACINGS: f64 = 2.0;

/// Share of its depth by which a key point may lie behind what its pixel shows, for the rounding of depths to f32.
const ROUNDING: f64 = 1e-5;

/// A named point of the craft.
#[derive(Debug, Clone, PartialEq)]
pub struct KeyPoint {
    /// Its name.
    pub name: String,
    /// The link that carries it: 0 is the body, `i + 1` is joint `i`.
    pub link: u32,
    /// Its place in the body frame with all joints as they are in the model's file [m].
    pub position: DVec3,
}

/// Whether a key point is seen. The numbers are those of COCO.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Visibility {
    /// It lies outside the frame or behind the camera.
    Outside = 0,
    /// A surface hides it.
    Hidden = 1,
    /// It is seen.
    Visible = 2,
}

/// A key point in an image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Seen {
    /// Its place in camera axes [m].
    pub point: DVec3,
    /// Where it appears, in OpenCV's pixels. `None` behind the camera.
    pub pixel: Option<DVec2>,
    /// Whether it is seen.
    pub visibility: Visibility,
}

/// Why a key point can not be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum KeyPointError {
    /// The craft has no such part.
    #[error("the key point '{name}' lies on the part '{part}', but the parts are: {known}")]
    Part {
        /// Name of the key point.
        name: String,
        /// The part.
        part: String,
        /// The parts that there are.
        known: String,
    },
    /// A place that is not finite.
    #[error("the place of the key point '{0}' must be finite")]
    NotFinite(String),
    /// A name that another one has.
    #[error("two key points have the name '{0}'")]
    Twice(String),
}

/// A key point at a place in the body frame, with all joints as they are in the model's file [m]. It moves with a part, which without a name is that of
/// the nearest vertex.
///
/// # Errors
/// A part that does not exist, or a place that is not finite.
pub fn given(craft: &Craft, name: &str, position: DVec3, part: Option<&str>) -> Result<KeyPoint, KeyPointError> {
    if !position.is_finite() {
        return Err(KeyPointError::NotFinite(name.to_owned()));
    }
    let nearest = || {
        let distance = |vertex: &usize| craft.positions[*vertex].distance_squared(position);
        let vertex = (0..craft.positions.len()).min_by(|a, b| distance(a).total_cmp(&distance(b)));
        vertex.map_or(0, |vertex| craft.vertex_part[vertex] as usize)
    };
    let number = match part {
        None => nearest(),
        Some(part) => craft.parts.iter().position(|known| known == part).ok_or_else(|| KeyPointError::Part {
            name: name.to_owned(),
            part: part.to_owned(),
            known: craft.parts.join(", "),
        })?,
    };
    let link = craft.link_of_part.get(number).copied().unwrap_or(0);
    Ok(KeyPoint { name: name.to_owned(), link, position })
}

/// Refuses a name that stands twice.
///
/// # Errors
/// The name.
pub fn check_names(points: &[KeyPoint]) -> Result<(), KeyPointError> {
    let mut names: Vec<&str> = points.iter().map(|point| point.name.as_str()).collect();
    names.sort_unstable();
    match names.windows(2).find(|pair| pair[0] == pair[1]) {
        Some(pair) => Err(KeyPointError::Twice(pair[0].to_owned())),
        None => Ok(()),
    }
}

/// Key points for which nobody chose any: the vertex farthest from the middle of the craft, and then again and again the vertex farthest from all that
/// were chosen (Gonzalez 1985). Of vertices at one distance it takes the first. These are the corners of the craft. They are named by number and part.
pub fn chosen(craft: &Craft, count: usize) -> Vec<KeyPoint> {
    let used: Vec<u32> = {
        let mut used: Vec<u32> = craft.triangles.iter().flatten().copied().collect();
        used.sort_unstable();
        used.dedup();
        used
    };
    let place = |vertex: u32| craft.positions[vertex as usize];
    let [low, high] = used.iter().fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[low, high], vertex| {
        [low.min(place(*vertex)), high.max(place(*vertex))]
    });
    let middle = 0.5 * (low + high);
    let mut nearest: Vec<f64> = used.iter().map(|vertex| place(*vertex).distance_squared(middle)).collect();
    let mut points = Vec::new();
    while points.len() < count {
        let farthest =
            nearest.iter().enumerate().fold(None, |best: Option<(usize, f64)>, (index, distance)| match best {
                Some((_, greatest)) if greatest >= *distance => best,
                _ => Some((index, *distance)),
            });
        let Some((index, distance)) = farthest.filter(|(_, distance)| *distance > 0.0 || points.is_empty()) else {
            break;
        };
        debug_assert!(distance.is_finite());
        let vertex = used[index];
        let part = craft.vertex_part[vertex as usize] as usize;
        let name = format!("{:02}_{}", points.len() + 1, craft.parts[part]);
        let first = points.is_empty();
        points.push(KeyPoint { name, link: craft.link_of_part[part], position: place(vertex) });
        for (other, nearest) in used.iter().zip(&mut nearest) {
            let distance = place(*other).distance_squared(place(vertex));
            *nearest = if first { distance } else { nearest.min(distance) };
        }
    }
    points
}

/// Where the key points of a craft appear in an image, and whether they are seen.
///
/// A key point is hidden if the four pixels around it all show a surface before it. Depths at their centres enclose that of a surface which the point lies
/// on, so only the bend of an edge and the rounding of depths need a margin.
pub fn seen(points: &[KeyPoint], image: &LabelledImage) -> Vec<Seen> {
    points.iter().map(|point| see(point, image)).collect()
}

fn see(point: &KeyPoint, image: &LabelledImage) -> Seen {
    let place = image.camera_from_link(point.link as usize).transform_point3(point.position);
    let pixel = image.project(place);
    let inside = |pixel: &DVec2| {
        let [width, height] = [image.width, image.height].map(f64::from);
        pixel.x >= -0.5 && pixel.y >= -0.5 && pixel.x < width - 0.5 && pixel.y < height - 0.5
    };
    let visibility = match pixel.filter(inside) {
        None => Visibility::Outside,
        Some(pixel) if is_hidden(image, place.z, pixel) => Visibility::Hidden,
        Some(_) => Visibility::Visible,
    };
    Seen { point: place, pixel, visibility }
}

/// Whether the four pixels around a place all show a surface before a depth [m].
fn is_hidden(image: &LabelledImage, depth: f64, pixel: DVec2) -> bool {
    let finest = image.lens.focal[0].min(image.lens.focal[1]);
    let before = depth - SPACINGS * depth / finest - ROUNDING * depth;
    let corner = pixel.floor();
    let clamped = |at: f64, size: u32| at.clamp(0.0, f64::from(size) - 1.0) as usize;
    [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]].into_iter().all(|[x, y]| {
        let column = clamped(corner.x + x, image.width);
        let row = clamped(corner.y + y, image.height);
        let at = row * image.width as usize + column;
        image.part[at] != 0 && f64::from(image.depth[at]) < before
    })
}
