//! Where the craft is in the images: out of view, around the camera, or smaller than a pixel.

use glam::{DAffine3, DVec2, DVec3};

use super::finding::{CheckEffort, Finding, short};
use super::shapes::{PartShape, corners};
use crate::lens::Lens;
use crate::scene::work::{image_time, images};
use crate::scene::{Background, Camera, Motion};
use crate::simulation::pose_of;
use crate::simulation::prepare::Prepared;

/// Share of the sphere around the camera that a surface fills, from which the camera counts as inside. A closed body fills 1, a plane at most half.
const INSIDE: f64 = 0.75;
/// Most triangles that are placed in the image.
const SAMPLE: usize = 2000;
/// Extent in the image below which a craft is a point [px].
const POINT: f64 = 2.0;

#[derive(Debug, Clone, serde::Serialize)]
pub(crate) struct Sight {
    pub(crate) images: u64,
    pub(crate) looked_at: usize,
    /// How many of them do not show the craft.
    pub(crate) out_of_view: usize,
    /// Time of the first image [s].
    pub(crate) first_s: f64,
    /// Size of the box around the craft in the first image [px]. `None` where a part of it is beside or behind the camera.
    pub(crate) first_px: Option<[f64; 2]>,
    /// Distance from the camera to the middle of the craft in the first image [m].
    pub(crate) first_distance_m: f64,
}

/// A camera, and the way from the body frame to its axes.
#[derive(Clone, Copy)]
struct GuardCamera<'a> {
    lens: &'a Lens,
    /// Rays at the border of the image.
    low: DVec2,
    high: DVec2,
    near: f64,
    pose: DAffine3,
}

fn corners_of(low: DVec3, high: DVec3) -> [DVec3; 8] {
    std::array::from_fn(|corner| {
        let pick = |bit: usize, axis: usize| if corner >> bit & 1 == 0 { low[axis] } else { high[axis] };
        DVec3::new(pick(0, 0), pick(1, 1), pick(2, 2))
    })
}

impl<'a> GuardCamera<'a> {
    /// A camera at the body's origin that looks along its +Z.
    fn new(camera: &'a Camera) -> Self {
        let size = [camera.width, camera.height];
        // A pinhole that sees further than a field of rays reaches may show anything before it.
        let far = DVec2::splat(f64::INFINITY);
        let (low, high) = camera.lens.field(size).map_or((-far, far), |field| (field.low, field.high));
        Self { lens: &camera.lens, low, high, near: camera.near, pose: DAffine3::IDENTITY }
    }

    /// Whether a box, moved into camera axes, may be in the image. The answer no is certain.
    fn may_show(&self, corners: &[DVec3; 8]) -> bool {
        let outside = |beyond: &dyn Fn(DVec3) -> bool| corners.iter().all(|corner| beyond(*corner));
        let sides: [&dyn Fn(DVec3) -> bool; 5] = [
            &|corner| corner.z < self.near,
            &|corner| corner.x < self.low.x * corner.z,
            &|corner| corner.x > self.high.x * corner.z,
            &|corner| corner.y < self.low.y * corner.z,
            &|corner| corner.y > self.high.y * corner.z,
        ];
        !sides.into_iter().any(outside)
    }
}

pub(super) fn check(prepared: &Prepared, shapes: &[PartShape], effort: CheckEffort) -> (Option<Sight>, Vec<Finding>) {
    let none = (None, Vec::new());
    let Some(camera) = &prepared.scene.camera else { return none };
    let time = &prepared.scene.time;
    let images = if effort.at.is_some() { 1 } else { images(time) };
    if images == 0 || effort.images == 0 || shapes.is_empty() {
        return none;
    }
    let chosen = spread(images, effort.images);
    let here = GuardCamera::new(camera);
    let (mut hidden, mut around) = (Vec::new(), Vec::new());
    let (mut planet_seen, mut most_within) = (false, 0.0_f64);
    let mut first = None;
    for (place, number) in chosen.iter().enumerate() {
        let stated = effort.at.map(|at| (at, None)).or_else(|| image_time(time, *number));
        let Some((time, listed)) = stated else { continue };
        let Some(pose) = pose_of(prepared, time, listed) else { continue };
        let joints = prepared.loads.joints_at(time).1;
        let look = GuardCamera { pose, ..here };
        let moved =
            |shape: &PartShape| look.pose * joints.get(shape.joint as usize).copied().unwrap_or(DAffine3::IDENTITY);
        let boxes: Vec<[DVec3; 8]> = shapes
            .iter()
            .map(|shape| corners_of(shape.low, shape.high).map(|corner| moved(shape).transform_point3(corner)))
            .collect();
        let low = boxes.iter().flatten().copied().fold(DVec3::INFINITY, DVec3::min);
        let high = boxes.iter().flatten().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
        if !boxes.iter().any(|corners| look.may_show(corners)) {
            let middle = 0.5 * (low + high);
            hidden.push((time, middle.angle_between(DVec3::Z).to_degrees(), middle.length()));
        }
        planet_seen = planet_seen || may_see_planet(prepared, &look, time);
        most_within = most_within.max(share_within(prepared, shapes, &look, &moved));
        let tried = place.is_multiple_of(chosen.len().div_ceil(effort.inside).max(1));
        if tried && low.cmple(DVec3::ZERO).all() && high.cmpge(DVec3::ZERO).all() {
            let placed = |shape: &PartShape| moved(shape).inverse().transform_point3(DVec3::ZERO);
            around.extend(part_around(prepared, shapes, &placed).map(|part| (time, part)));
        }
        if first.is_none() {
            first = Some((time, in_pixels(&look, &boxes), (0.5 * (low + high)).length()));
        }
    }
    let Some((first_s, first_px, first_distance_m)) = first else { return none };
    let (looked_at, out_of_view) = (chosen.len(), hidden.len());
    let sight = Sight { images, looked_at, out_of_view, first_s, first_px, first_distance_m };
    let mut findings = Vec::new();
    findings.extend(hidden.first().map(|image| find_hidden(prepared, *image, [out_of_view, looked_at])));
    findings.extend(around.first().map(|(time, part)| find_inside(prepared, *time, *part)));
    findings.extend(first_px.filter(|_| hidden.is_empty()).and_then(find_small));
    findings.extend((hidden.len() < looked_at && around.is_empty()).then(|| find_cut(most_within)).flatten());
    let surrounded = &prepared.scene.surrounded;
    if surrounded.background == Background::Planet && !surrounded.is_unstated && !planet_seen {
        findings.push(find_no_planet(looked_at));
    }
    (Some(sight), findings)
}

/// The part that the camera is inside of, or no part where only all parts together surround it. `None` if it is outside.
fn part_around(prepared: &Prepared, shapes: &[PartShape], placed: &dyn Fn(&PartShape) -> DVec3) -> Option<Option<u32>> {
    let shares: Vec<f64> = shapes.iter().map(|shape| filled(prepared, shape, &placed(shape))).collect();
    let body = shapes.iter().zip(&shares).find(|(_, share)| share.abs() > INSIDE);
    let is_inside = body.is_some() || shares.iter().sum::<f64>().abs() > INSIDE;
    is_inside.then(|| body.map(|(shape, _)| shape.part))
}

fn find_hidden(
    prepared: &Prepared,
    (time, angle, distance): (f64, f64, f64),
    [out_of_view, looked_at]: [usize; 2],
) -> Finding {
    let how_many =
        if looked_at == 1 { "in the image".to_owned() } else { format!("in {out_of_view} of {looked_at} images") };
    let message = format!(
        "the craft is not in view {how_many}, first at {time} s: its middle is {angle:.0} deg off the camera's axis, \
         {} m away",
        short(distance)
    );
    let moves = prepared.scene.camera.as_ref().is_some_and(|camera| camera.motion != Motion::Still);
    let key = if moves { "camera.path" } else { "camera" };
    let remedy = if moves {
        "check the quaternions of the path (scalar first, camera axes +X right, +Y down, +Z forward), camera.mount, and camera.frame"
    } else {
        "check camera.position, camera.look_at or camera.quaternion, and camera.frame"
    };
    Finding { check: "view", about: key.to_owned(), message, remedy: remedy.to_owned() }
}

fn find_inside(prepared: &Prepared, time: f64, part: Option<u32>) -> Finding {
    let what = part.map_or("the craft".to_owned(), |part| format!("the part '{}'", prepared.parts[part as usize]));
    Finding {
        check: "inside",
        about: "camera.position".to_owned(),
        message: format!("the camera is inside {what} at {time} s"),
        remedy: "move the camera away; if the place is right, the model may be in mm instead of m".to_owned(),
    }
}

fn find_small([width, height]: [f64; 2]) -> Option<Finding> {
    (width.max(height) < POINT).then(|| Finding {
        check: "size",
        about: "camera".to_owned(),
        message: format!(
            "the craft is {} x {} pixels, so it may fall between the centres of pixels",
            short(width),
            short(height)
        ),
        remedy: "state camera.samples = 16, or a narrower field of view".to_owned(),
    })
}

/// Whether the planet may be in the image. The answer no is certain.
fn may_see_planet(prepared: &Prepared, look: &GuardCamera, time: f64) -> bool {
    let sky = prepared.loads.sky_model().sky(time);
    let off_axis = (look.pose.matrix3 * sky.nadir_direction).angle_between(DVec3::Z);
    let radius = (1.0 / sky.distance_ratio).clamp(0.0, 1.0).asin();
    let corner = look.low.abs().max(look.high.abs()).length().atan();
    off_axis < radius + corner
}

/// Share of the area of the craft that lies within the frame, from a sample of its triangles.
fn share_within(
    prepared: &Prepared,
    shapes: &[PartShape],
    look: &GuardCamera,
    moved: &dyn Fn(&PartShape) -> DAffine3,
) -> f64 {
    let stride = (prepared.triangles.len() / SAMPLE).max(1);
    let (mut within, mut all) = (0.0, 0.0);
    for shape in shapes {
        let pose = moved(shape);
        for triangle in shape.triangles.iter().step_by(stride) {
            let corners = corners(prepared, *triangle);
            let area = (corners[1] - corners[0]).cross(corners[2] - corners[0]).length();
            let middle = pose.transform_point3((corners[0] + corners[1] + corners[2]) / 3.0);
            all += area;
            if look.may_show(&[middle; 8]) {
                within += area;
            }
        }
    }
    if all > 0.0 { within / all } else { 1.0 }
}

fn find_cut(share: f64) -> Option<Finding> {
    (share < 0.5).then(|| Finding {
        check: "view",
        about: "camera".to_owned(),
        message: format!("at most {:.0} % of the craft lies within the frame", 100.0 * share),
        remedy: "move the camera away or widen its field of view; without a pose, the camera is placed so that it sees the whole craft".to_owned(),
    })
}

fn find_no_planet(looked_at: usize) -> Finding {
    let images = if looked_at == 1 { "the image".to_owned() } else { format!("any of {looked_at} images") };
    Finding {
        check: "background",
        about: "radiance.background".to_owned(),
        message: format!("the planet is not in the frame of {images}"),
        remedy: "turn the camera towards the planet, or state background = \"space\"".to_owned(),
    }
}

/// At most `most` numbers below `count`, with the first and the last.
fn spread(count: u64, most: usize) -> Vec<u64> {
    if count <= most as u64 {
        return (0..count).collect();
    }
    (0..most as u64).map(|place| place * (count - 1) / (most as u64 - 1)).collect()
}

/// Size of the boxes in the image [px]. `None` where one of them reaches beside or behind the camera.
fn in_pixels(look: &GuardCamera, boxes: &[[DVec3; 8]]) -> Option<[f64; 2]> {
    let all = boxes.iter().flatten();
    if all.clone().any(|corner| corner.z < look.near) {
        return None;
    }
    let pixels = all.map(|corner| look.lens.project(corner.truncate() / corner.z));
    let (low, high) =
        pixels.fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(low, high), pixel| (low.min(pixel), high.max(pixel)));
    Some((high - low).to_array())
}

/// Share of the sphere around a point that a shape fills, signed by the sense of its triangles. 1 or -1 inside a closed body, 0 outside. The solid
/// angle of a triangle follows Van Oosterom & Strackee 1983.
fn filled(prepared: &Prepared, shape: &PartShape, point: &DVec3) -> f64 {
    let angles = shape.triangles.iter().map(|triangle| {
        let [a, b, c] = corners(prepared, *triangle).map(|corner| corner - *point);
        let [x, y, z] = [a.length(), b.length(), c.length()];
        let volume = a.dot(b.cross(c));
        2.0 * volume.atan2(x * y * z + a.dot(b) * z + b.dot(c) * x + c.dot(a) * y)
    });
    angles.sum::<f64>() / (4.0 * std::f64::consts::PI)
}
