//! Key points: named points of the craft, where they appear in an image, and whether they are seen there.

use glam::{DVec2, DVec3};

pub(crate) use super::craft::KeyPoint;

use super::craft::Craft;
use super::image::LabelledImage;

/// Key points of a craft for which nobody chose any.
pub(crate) const CHOSEN: usize = 12;

/// Distance by which a key point may lie behind the surface at its pixel, in distances between neighbouring pixels at the depth of the key point. Two
/// such distances are the change of depth from one pixel to the next on a surface whose normal is at 63 deg to the line of sight.
const SPACINGS: f64 = 2.0;

/// Distance beyond the box around the craft, as a share of its size, from which a key point is refused.
const BESIDE: f64 = 0.1;

/// Share of the size of a part by which vertices may differ that reach equally far.
const LEVEL: f64 = 1e-6;

/// Further distance by which a key point may lie behind the surface, as a share of its depth, for the rounding of depths to f32.
const ROUNDING: f64 = 1e-5;

/// Whether a key point is seen. The numbers are COCO's.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Visibility {
    /// The key point lies outside the frame or behind the camera.
    Outside = 0,
    /// A surface hides it, or no pixel near it shows the craft.
    Hidden = 1,
    /// The key point is seen.
    Visible = 2,
}

/// A key point in an image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImageKeyPoint {
    /// Place in camera axes [m].
    pub(crate) point: DVec3,
    /// Where it appears, in OpenCV's pixels. `None` behind the camera.
    pub pixel: Option<DVec2>,
    /// Whether it is seen, by the four pixels around it.
    pub visibility: Visibility,
    /// Whether it is seen, by the one pixel in which it lies.
    pub strict: Visibility,
}

/// Why a key point can not be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(crate) enum KeyPointError {
    #[error("the key point '{name}' lies on the part '{part}', but the parts are: {known}")]
    Part {
        name: String,
        part: String,
        /// The parts that there are.
        known: String,
    },
    #[error("the place of the key point '{0}' must be finite")]
    NotFinite(String),
    #[error(
        "the key point '{name}' lies {distance:.3} m off the box around the craft, which is {size:.3} m across: a position is in metres, in the \
         body frame and the file's pose"
    )]
    Off { name: String, distance: f64, size: f64 },
    #[error("two key points have the name '{0}'")]
    Twice(String),
}

/// A key point at a place in the body frame, with all joints as they are in the model's file [m]. The key point moves with the part `part`, or
/// without a name with the part of the nearest vertex.
///
/// # Errors
/// A part that does not exist, or a place that is not finite or far off the craft.
pub(crate) fn given(craft: &Craft, name: &str, position: DVec3, part: Option<&str>) -> Result<KeyPoint, KeyPointError> {
    if !position.is_finite() {
        return Err(KeyPointError::NotFinite(name.to_owned()));
    }
    let [low, high] = used(craft)
        .into_iter()
        .map(|vertex| craft.positions[vertex as usize])
        .fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[low, high], point| [low.min(point), high.max(point)]);
    let size = (high - low).length();
    if low.is_finite() {
        let distance = position.distance(position.clamp(low, high));
        if distance > BESIDE * size {
            return Err(KeyPointError::Off { name: name.to_owned(), distance, size });
        }
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
    Ok(KeyPoint { name: name.to_owned(), part: number as u32, link, position })
}

/// Refuses a name that stands twice.
///
/// # Errors
/// The name.
pub(crate) fn check_names(points: &[KeyPoint]) -> Result<(), KeyPointError> {
    let mut names: Vec<&str> = points.iter().map(|point| point.name.as_str()).collect();
    names.sort_unstable();
    match names.windows(2).find(|pair| pair[0] == pair[1]) {
        Some(pair) => Err(KeyPointError::Twice(pair[0].to_owned())),
        None => Ok(()),
    }
}

/// The corners of each part: the vertices that reach farthest along the axes and the diagonals between them. Of vertices that reach equally far, the
/// vertex farthest from the middle of the part is taken, and then the first.
pub(super) fn corners(craft: &Craft) -> Vec<u32> {
    let mut of_part: Vec<Vec<u32>> = vec![Vec::new(); craft.parts.len()];
    for vertex in used(craft) {
        of_part[craft.vertex_part[vertex as usize] as usize].push(vertex);
    }
    let steps = || [-1.0, 0.0, 1.0].into_iter();
    let directions = steps().flat_map(|x| steps().flat_map(move |y| steps().map(move |z| DVec3::new(x, y, z))));
    let directions: Vec<DVec3> = directions.filter(|direction| *direction != DVec3::ZERO).collect();
    let mut corners = Vec::new();
    for vertices in of_part {
        let place = |vertex: &u32| craft.positions[*vertex as usize];
        let middle = middle(vertices.iter().map(place));
        for direction in &directions {
            let reach = |vertex: &u32| (place(vertex) - middle).dot(*direction);
            let most = vertices.iter().map(reach).fold(f64::NEG_INFINITY, f64::max);
            let size = vertices.iter().map(|vertex| place(vertex).distance(middle)).fold(0.0, f64::max);
            let level = vertices.iter().copied().filter(|vertex| reach(vertex) >= most - LEVEL * size);
            let distances = level.map(|vertex| (vertex, place(&vertex).distance(middle)));
            let farthest = distances.reduce(|best, other| if other.1 > best.1 { other } else { best });
            corners.extend(farthest.map(|(vertex, _)| vertex));
        }
    }
    corners.sort_unstable();
    corners.dedup();
    corners
}

/// The vertices that triangles use.
fn used(craft: &Craft) -> Vec<u32> {
    let mut used: Vec<u32> = craft.triangles.iter().flatten().copied().collect();
    used.sort_unstable();
    used.dedup();
    used
}

/// The middle of the box round some points.
fn middle(points: impl Iterator<Item = DVec3>) -> DVec3 {
    let [low, high] =
        points.fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[low, high], point| [low.min(point), high.max(point)]);
    0.5 * (low + high)
}

/// Key points for which nobody chose any, so many for each target ([`chosen_of`]).
pub fn chosen(craft: &Craft, count: usize) -> Vec<KeyPoint> {
    (0..craft.target_names().len()).flat_map(|target| chosen_of(craft, target, count)).collect()
}

/// The key points of a target: the corner of a part that is farthest from its middle, and then again and again the corner farthest from
/// all that were chosen (Gonzalez 1985). Of corners at one distance the first is taken. A target with too few corners gives other vertices too. The
/// name of a key point is its number and part.
fn chosen_of(craft: &Craft, target: usize, count: usize) -> Vec<KeyPoint> {
    let place = |vertex: u32| craft.positions[vertex as usize];
    let of_target = |mut vertices: Vec<u32>| {
        vertices.retain(|vertex| craft.target_of_vertex(*vertex) == Some(target));
        vertices
    };
    let middle = middle(of_target(used(craft)).into_iter().map(place));
    let mut points: Vec<KeyPoint> = Vec::new();
    for candidates in [of_target(corners(craft)), of_target(used(craft))] {
        let from_chosen = |vertex: &u32, points: &[KeyPoint]| match points {
            [] => place(*vertex).distance_squared(middle),
            _ => {
                points.iter().map(|point| point.position.distance_squared(place(*vertex))).fold(f64::INFINITY, f64::min)
            }
        };
        let mut nearest: Vec<f64> = candidates.iter().map(|vertex| from_chosen(vertex, &points)).collect();
        while points.len() < count {
            let farthest =
                nearest.iter().enumerate().fold(None, |best: Option<(usize, f64)>, (index, distance)| match best {
                    Some((_, greatest)) if greatest >= *distance => best,
                    _ => Some((index, *distance)),
                });
            let first = points.is_empty();
            let Some((index, _)) = farthest.filter(|(_, distance)| *distance > 0.0 || first) else { break };
            let vertex = candidates[index];
            let part = craft.vertex_part[vertex as usize] as usize;
            let name = format!("{:02}_{}", points.len() + 1, craft.parts[part]);
            points.push(KeyPoint { name, part: part as u32, link: craft.link_of_part[part], position: place(vertex) });
            for (other, nearest) in candidates.iter().zip(&mut nearest) {
                let distance = place(*other).distance_squared(place(vertex));
                *nearest = if first { distance } else { nearest.min(distance) };
            }
        }
    }
    points
}

/// Those of a list with an item for each key point of a craft that lie on a target.
pub(super) fn points_of<'a, T>(craft: &'a Craft, list: &'a [T], target: usize) -> impl Iterator<Item = &'a T> {
    let on_target = move |(point, _): &(&KeyPoint, &T)| craft.target_of_part(point.part) == Some(target);
    craft.key_points.iter().zip(list).filter(on_target).map(|(_, item)| item)
}

/// Where the key points of a craft appear in an image, and whether they are seen.
///
/// A key point is hidden if the four pixels around it all show a surface before it. If the point lies on the surface, the depths at the centres of
/// these pixels enclose its depth, so only the bend of an edge and the rounding of depths need a margin. A key point is also hidden if none of the
/// sixteen pixels around it shows the craft, as on a panel seen edge-on.
pub fn seen(points: &[KeyPoint], image: &LabelledImage) -> Vec<ImageKeyPoint> {
    points.iter().map(|point| see(point, image)).collect()
}

fn see(point: &KeyPoint, image: &LabelledImage) -> ImageKeyPoint {
    let place = image.camera_from_link(point.link as usize).transform_point3(point.position);
    let pixel = image.project(place);
    let inside = |pixel: &DVec2| {
        let [width, height] = [image.width, image.height].map(f64::from);
        pixel.x >= -0.5 && pixel.y >= -0.5 && pixel.x < width - 0.5 && pixel.y < height - 0.5
    };
    let visibility = match pixel.filter(inside) {
        None => Visibility::Outside,
        Some(pixel) if is_hidden(image, place.z, pixel) || !is_shown(image, pixel) => Visibility::Hidden,
        Some(_) => Visibility::Visible,
    };
    let strict = match (visibility, pixel) {
        (Visibility::Visible, Some(pixel)) if !is_on_surface(image, place.z, pixel) => Visibility::Hidden,
        (other, _) => other,
    };
    ImageKeyPoint { point: place, pixel, visibility, strict }
}

/// The pixels whose columns and rows lie up to `reach` pixels before and behind a place, with pixels of the border in place of pixels beyond it.
fn around(image: &LabelledImage, pixel: DVec2, reach: i32) -> impl Iterator<Item = usize> {
    let (corner, [width, height]) = (pixel.floor(), [image.width, image.height]);
    let clamped = |at: f64, size: u32| at.clamp(0.0, f64::from(size) - 1.0) as usize;
    let offsets = move || (1 - reach..=reach).map(f64::from);
    offsets().flat_map(move |y| {
        offsets().map(move |x| clamped(corner.y + y, height) * width as usize + clamped(corner.x + x, width))
    })
}

/// Whether the four pixels around a place all show a surface before a depth [m].
fn is_hidden(image: &LabelledImage, depth: f64, pixel: DVec2) -> bool {
    let finest = image.lens.focal[0].min(image.lens.focal[1]);
    let before = depth - SPACINGS * depth / finest - ROUNDING * depth;
    around(image, pixel, 1).all(|at| image.channels.part[at] != 0 && f64::from(image.channels.depth[at]) < before)
}

/// Whether the pixel in which a place lies shows the craft at a depth [m], within the margin of the four pixels to both sides.
fn is_on_surface(image: &LabelledImage, depth: f64, pixel: DVec2) -> bool {
    let finest = image.lens.focal[0].min(image.lens.focal[1]);
    let [column, row] = [(pixel.x, image.width), (pixel.y, image.height)]
        .map(|(at, size)| at.round().clamp(0.0, f64::from(size) - 1.0) as usize);
    let at = row * image.width as usize + column;
    let apart = (f64::from(image.channels.depth[at]) - depth).abs();
    image.channels.part[at] != 0 && apart <= SPACINGS * depth / finest + ROUNDING * depth
}

/// Whether one of the sixteen pixels around a place shows the craft. A panel that is seen edge-on may have no pixel.
fn is_shown(image: &LabelledImage, pixel: DVec2) -> bool {
    around(image, pixel, 2).any(|at| image.channels.part[at] != 0)
}

#[cfg(test)]
mod tests {
    use super::super::image::tests::{small, small_craft};
    use super::*;

    #[test]
    fn the_farthest_vertices_are_chosen_one_after_another() {
        let craft = small_craft();
        let points = chosen(&craft, 3);
        // The middle is (1.5, 0.5), from which (0, 0), (0, 1), (3, 0) and (3, 1) are equally far.
        let places: Vec<[f64; 2]> = points.iter().map(|point| point.position.truncate().to_array()).collect();
        assert_eq!(places, [[0.0, 0.0], [3.0, 1.0], [1.0, 0.0]]);
        let names: Vec<(&str, u32)> = points.iter().map(|point| (point.name.as_str(), point.link)).collect();
        assert_eq!(names, [("01_hull", 0), ("02_wing", 1), ("03_hull", 0)]);
        // Two vertices share a place, which is chosen once.
        assert_eq!(chosen(&craft, 20).len(), 5);
    }

    #[test]
    fn a_point_is_hidden_by_what_stands_before_it() {
        let mut image = small();
        image.camera_from_body = glam::DAffine3::from_translation(DVec3::new(0.0, 0.0, 4.0));
        let point =
            |x: f64, y: f64| KeyPoint { name: "p".to_owned(), part: 0, link: 0, position: DVec3::new(x, y, 0.0) };
        let pixel = |x: f64, y: f64| point((x - 1.5) * 4.0 / 10.0, (y - 1.0) * 4.0 / 20.0);
        let visibility =
            |image: &LabelledImage, point: &KeyPoint| seen(std::slice::from_ref(point), image)[0].visibility;
        // Only two of the four pixels round (1.5, 1.5) show something.
        assert_eq!(visibility(&image, &pixel(1.5, 1.5)), Visibility::Visible);
        let strict = |image: &LabelledImage, point: &KeyPoint| seen(std::slice::from_ref(point), image)[0].strict;
        // The pixel in which it lies shows none of the craft, and one that does must have its depth.
        assert_eq!(strict(&image, &pixel(1.4, 1.6)), Visibility::Hidden);
        let mut near = image.clone();
        near.channels.depth[5] = 4.0;
        assert_eq!(strict(&near, &pixel(1.2, 1.2)), Visibility::Visible);
        near.channels.depth[5] = 9.0;
        assert_eq!(strict(&near, &pixel(1.2, 1.2)), Visibility::Hidden);
        assert_eq!(visibility(&near, &pixel(1.2, 1.2)), Visibility::Visible, "a surface behind it hides nothing");
        image.channels.part[9] = 1;
        image.channels.part[10] = 1;
        image.channels.depth[9] = 2.0;
        image.channels.depth[10] = 2.0;
        assert_eq!(visibility(&image, &pixel(1.5, 1.5)), Visibility::Hidden);
        // Within two spacings of the pixels, which are 0.4 m, it is taken for the surface itself.
        for at in [5, 6, 9, 10] {
            image.channels.depth[at] = 3.25;
        }
        assert_eq!(visibility(&image, &pixel(1.5, 1.5)), Visibility::Visible);
        assert_eq!(visibility(&image, &pixel(3.6, 1.0)), Visibility::Outside);
        assert_eq!(visibility(&image, &pixel(3.4, 1.0)), Visibility::Visible);
        // Where no pixel near shows the craft, nothing is seen.
        let mut empty = image.clone();
        empty.channels.part = vec![0; 12];
        assert_eq!(visibility(&empty, &pixel(3.4, 1.0)), Visibility::Hidden);
        // A link moves its points: 1 m farther away.
        let moved = KeyPoint { link: 1, ..point(0.0, 0.0) };
        assert_eq!(seen(&[moved], &image)[0].point, DVec3::new(0.0, 0.0, 5.0));
    }

    #[test]
    fn given_points_need_a_part_a_place_and_a_name_of_their_own() {
        let craft = small_craft();
        let place = DVec3::new(3.1, 0.9, 0.0);
        assert_eq!(given(&craft, "a", place, None).map(|point| point.link), Ok(1));
        assert_eq!(given(&craft, "a", place, Some("hull")).map(|point| point.link), Ok(0));
        let error = given(&craft, "a", place, Some("mast")).unwrap_err().to_string();
        assert_eq!(error, "the key point 'a' lies on the part 'mast', but the parts are: hull, wing");
        assert!(given(&craft, "a", DVec3::NAN, None).is_err());
        let twice =
            [given(&craft, "a", place, None).expect("a point"), given(&craft, "a", place, None).expect("a point")];
        assert_eq!(check_names(&twice), Err(KeyPointError::Twice("a".to_owned())));
        assert_eq!(check_names(&twice[..1]), Ok(()));
    }
}
