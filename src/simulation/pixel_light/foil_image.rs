//! The pixels of an image that show foil, and what light of their own changes in them.

use glam::{DAffine3, DVec3};
use rayon::prelude::*;

use super::PastLight;
use super::place::{Places, interpolate};
use super::surface::FoilTriangle;
use crate::raster::RasterView;
use crate::raster::changes::{CoveredPlace, PixelChanges, visit_covered};
use crate::trace::span;

/// A change below which a pixel stays as it is [K].
const LEAST_CHANGE: f64 = 1e-3;

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
        let places =
            Places::new((&scene.surface, &scene.trees), (&self.past.moments, self.past.begins), (triangle, &lit));
        let corners = self.corners(triangle);
        let (mut changed, mut of_nodes) = (Vec::new(), None);
        self.visit(self.view, corners, |seen| {
            if !self.is_seen(corners, seen.weights) {
                return false;
            }
            let of_nodes = of_nodes.get_or_insert_with(|| places.of_nodes(self.temperatures));
            let place = interpolate(positions, seen.weights);
            let kelvin = of_nodes.map_or(0.0, |of_nodes| places.change(place, seen.weights, of_nodes));
            if kelvin.abs() >= LEAST_CHANGE {
                let value = [kelvin as f32, (triangle.part + 1) as f32];
                changed.push(SampleChange { pixel: seen.pixel, place: (seen.sample, seen.depth), value });
            }
            true
        });
        changed
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
