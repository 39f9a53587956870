//! The pixels of an image that show foil, and what light of their own changes in them.

use std::collections::HashMap;

use glam::{DAffine3, DVec3};
use rayon::prelude::*;

use super::PastLight;
use super::disc::SunShape;
use super::place::{Places, interpolate};
use super::surface::FoilTriangle;
use crate::raster::RasterView;
use crate::raster::changes::{CoveredPlace, PixelChanges, visit_covered};
use crate::trace::span;

/// A change below which a pixel stays as it is [K].
const LEAST_CHANGE: f64 = 1e-3;

/// Looks at the Sun as a disc from the places of a triangle on both sides of an edge of a shadow, from those at the triangle's rim, and from those beside a place that sees a part of it.
/// `found` has the change of each place and the share of the Sun that it sees. `change` gives these where a place sees a part of the Sun.
fn soften(
    width: usize,
    seen: &[CoveredPlace],
    found: &mut [[f64; 2]],
    change: impl Fn(&CoveredPlace) -> Option<[f64; 2]>,
) {
    let number: HashMap<usize, usize> = seen.iter().enumerate().map(|(number, place)| (place.pixel, number)).collect();
    let beside = |place: usize| {
        let pixel = seen[place].pixel;
        let near = [pixel.wrapping_sub(1), pixel + 1, pixel.wrapping_sub(width), pixel + width];
        near.map(|near| number.get(&near).copied())
    };
    let is_at_edge =
        |place: &usize| beside(*place).iter().any(|near| near.is_none_or(|near| found[near][1] != found[*place][1]));
    let mut next: Vec<usize> = (0..seen.len()).filter(is_at_edge).collect();
    let mut looked = vec![false; seen.len()];
    while let Some(place) = next.pop() {
        if std::mem::replace(&mut looked[place], true) {
            continue;
        }
        if let Some(soft) = change(&seen[place]) {
            found[place] = soft;
            next.extend(beside(place).into_iter().flatten());
        }
    }
}

/// An image of foil, through a lens without distortion.
struct FoilImage<'a> {
    past: &'a PastLight,
    view: &'a RasterView,
    /// Poses of the joints, and their inverses.
    joints: &'a [DAffine3],
    frames: Vec<DAffine3>,
    /// Place of the camera [m].
    camera: DVec3,
    /// Temperatures of the nodes in device order [K], where they are needed.
    temperatures: Option<&'a [f64]>,
}

/// What a place of a sample changes in its pixel.
struct SampleChange {
    pixel: usize,
    /// Number of the sample, and its depth [m].
    place: (usize, f64),
    /// The change [K], and the index of the part + 1.
    value: [f32; 2],
}

impl PastLight {
    /// The changes of all pixels by light of their own. The lens has no distortion. `joints` are poses, and `temperatures` [K] are of the nodes in device order, where
    /// they are needed. `None` where nothing changes.
    pub(crate) fn changes(&self, view: &RasterView, joints: &[DAffine3], temperatures: &[f64]) -> Option<PixelChanges> {
        let _finds = span("finding the light of pixels");
        let temperatures = Some(temperatures).filter(|_| self.needs_temperatures());
        let changes = FoilImage::new(self, view, joints, temperatures).changes();
        (!changes.is_empty()).then_some(changes)
    }
}

impl<'a> FoilImage<'a> {
    fn new(past: &'a PastLight, view: &'a RasterView, joints: &'a [DAffine3], temperatures: Option<&'a [f64]>) -> Self {
        let frames = joints.iter().map(DAffine3::inverse).collect();
        Self { past, view, joints, frames, camera: view.camera_from_body.inverse().translation, temperatures }
    }

    /// What each pixel changes. The first of its samples that shows a change tells it.
    fn changes(&self) -> PixelChanges {
        let mut changes = PixelChanges::none(self.view.width, self.view.height);
        let triangles = &self.past.scene.surface.triangles;
        let all: Vec<SampleChange> = triangles.par_iter().flat_map_iter(|triangle| self.changes_of(triangle)).collect();
        let mut first = vec![(usize::MAX, f64::INFINITY); changes.values.len()];
        for SampleChange { pixel, place, value } in all {
            if place < first[pixel] {
                first[pixel] = place;
                changes.values[1 + pixel] = value;
            }
        }
        let aside: Vec<bool> = first.iter().map(|(sample, _)| (1..usize::MAX).contains(sample)).collect();
        for pixel in self.shown_at_centre(&aside, &changes) {
            changes.values[1 + pixel] = [0.0; 2];
        }
        changes
    }

    /// Corners of a triangle in the frame of the body [m].
    fn corners(&self, triangle: &FoilTriangle) -> [DVec3; 3] {
        let nodes = triangle.nodes.map(|node| &self.past.scene.surface.nodes[node]);
        let pose = self.joints.get(nodes[0].joint as usize);
        nodes.map(|node| pose.map_or(node.position, |pose| pose.transform_point3(node.position)))
    }

    fn visit(&self, view: &RasterView, corners: [DVec3; 3], look: impl FnMut(&CoveredPlace) -> bool) {
        visit_covered(view, corners.map(|at| view.camera_from_body.transform_point3(at)), look);
    }

    /// Whether the camera sees a place of a triangle.
    fn is_seen(&self, corners: [DVec3; 3], weights: [f64; 3]) -> bool {
        let trees = &self.past.scene.trees;
        let at = interpolate(corners, weights);
        let to_camera = self.camera - at;
        let distance = to_camera.length();
        let outward = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
        let lift = trees.start * outward * outward.dot(to_camera).signum();
        !trees.hide(at + lift, to_camera / distance, distance - self.view.near, |joint| self.frames.get(joint))
    }

    /// What the places of a triangle change.
    fn changes_of(&self, triangle: &FoilTriangle) -> Vec<SampleChange> {
        let lit = self.past.known(triangle);
        if lit.is_empty() {
            return Vec::new();
        }
        let scene = &*self.past.scene;
        let positions = triangle.nodes.map(|node| scene.surface.nodes[node].position);
        let PastLight { moments, quarters, begins, .. } = self.past;
        let places = Places::new((&scene.surface, &scene.trees), (moments, quarters, *begins), (triangle, &lit));
        let slots = triangle.nodes.map(|node| scene.surface.nodes[node].slot as usize);
        let temperatures = self.temperatures.map(|all| slots.map(|slot| all[slot]));
        let corners = self.corners(triangle);
        let mut seen = Vec::new();
        self.visit(self.view, corners, |covered| {
            let is_seen = self.is_seen(corners, covered.weights);
            if is_seen {
                seen.push(*covered);
            }
            is_seen
        });
        let Some(of_nodes) = places.of_nodes(temperatures).filter(|_| !seen.is_empty()) else { return Vec::new() };
        let change = |place: &CoveredPlace, shape: SunShape| {
            places.change(interpolate(positions, place.weights), place.weights, of_nodes, shape)
        };
        let mut found: Vec<[f64; 2]> = seen.iter().map(|place| change(place, SunShape::Middle)).collect();
        if lit.last() == Some(&None) {
            let is_partly_lit = |place: &CoveredPlace| {
                let share = places.share_now(interpolate(positions, place.weights));
                share > 0.0 && share < 1.0
            };
            let change = |place: &CoveredPlace| is_partly_lit(place).then(|| change(place, SunShape::Disc));
            soften(self.view.width as usize, &seen, &mut found, change);
        }
        let changed = seen.iter().zip(found).filter(|(_, [kelvin, _])| kelvin.abs() >= LEAST_CHANGE);
        let value = |(place, [kelvin, _]): (&CoveredPlace, [f64; 2])| SampleChange {
            pixel: place.pixel,
            place: (place.sample, place.depth),
            value: [kelvin as f32, (triangle.part + 1) as f32],
        };
        changed.map(value).collect()
    }

    /// Pixels, among some, whose centres show the part that another of their samples would change.
    fn shown_at_centre(&self, pixels: &[bool], changes: &PixelChanges) -> Vec<usize> {
        if !pixels.contains(&true) {
            return Vec::new();
        }
        let centres = RasterView { samples: 1, ..*self.view };
        let shown = |triangle: &FoilTriangle| {
            let corners = self.corners(triangle);
            let mut shown = Vec::new();
            self.visit(&centres, corners, |seen| {
                let is_of_part = || changes.values[1 + seen.pixel][1] == (triangle.part + 1) as f32;
                if pixels[seen.pixel] && is_of_part() && self.is_seen(corners, seen.weights) {
                    shown.push(seen.pixel);
                }
                true
            });
            shown
        };
        self.past.scene.surface.triangles.par_iter().flat_map_iter(shown).collect()
    }
}
