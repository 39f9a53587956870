//! Values at the corners of triangles, drawn as an image shows them.

use glam::{DAffine3, DVec3};
use rayon::prelude::*;

use super::camera_pose::moments;
use super::image::Image;
use super::prepare::Prepared;
use super::viewpoint::raster_view;
use crate::model::nodes::GROUP;
use crate::raster::{RasterSurface, RasterView, rasterise};

/// The number of the triangle that a pixel shows, and the value there. `None` where no triangle is.
pub(super) type CornerPixel = Option<(u32, f64)>;

/// The nodes of the triangle that a pixel shows, and their weights there.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PixelNodes {
    pub(crate) nodes: [usize; 3],
    pub(crate) weights: [f64; 3],
}

impl PixelNodes {
    /// The value at the pixel, from the values of nodes.
    pub(crate) fn mix(&self, value: impl Fn(usize) -> f64) -> f64 {
        self.nodes.iter().zip(self.weights).map(|(node, weight)| weight * value(*node)).sum()
    }
}

/// The nodes that each pixel of an image shows. At the rim of a part rounding may show a pixel on one side only. Such a pixel takes the nodes of a pixel beside
/// it that shows the same part. `None` where no surface is, and where no such pixel is. `number` is the number of an image at its own time.
pub(crate) fn pixel_nodes(prepared: &Prepared, image: &Image, number: Option<u32>) -> Vec<Option<PixelNodes>> {
    let corners = 3 * prepared.triangles.len();
    let drawn = [0, 1].map(|corner| {
        let weights: Vec<f64> = (0..corners).map(|other| f64::from(u8::from(other % 3 == corner))).collect();
        draw_corners(prepared, &weights, image, number)
    });
    let of_pixel = |(first, second): (&CornerPixel, &CornerPixel)| {
        let ((triangle, first), (_, second)) = ((*first)?, (*second)?);
        let nodes = prepared.triangles[triangle as usize].map(|node| node as usize);
        Some(PixelNodes { nodes, weights: [first, second, 1.0 - first - second] })
    };
    let shown: Vec<Option<PixelNodes>> = drawn[0].par_iter().zip(&drawn[1]).map(of_pixel).collect();
    let width = image.camera.width as usize;
    let beside = |(pixel, part): (usize, &u32)| {
        let part = part.checked_sub(1)?;
        let near = [pixel, pixel.wrapping_sub(1), pixel + 1, pixel.wrapping_sub(width), pixel + width];
        let of_part = |of: &PixelNodes| prepared.nodes.group_part[of.nodes[0] / GROUP] == part;
        near.iter().find_map(|near| shown.get(*near).copied().flatten().filter(of_part))
    };
    image.part.iter().enumerate().map(beside).collect()
}

/// Draws values of corners, three for each triangle of the scene, for the camera of an image. `number` is the number of an image at its own time.
pub(super) fn draw_corners(
    prepared: &Prepared,
    values: &[f64],
    image: &Image,
    number: Option<u32>,
) -> Vec<CornerPixel> {
    let view = raster_view(&image.camera, &image.camera_from_body);
    let poses = prepared.loads.joints_at(image.time).1;
    let draw = |view: &RasterView, poses: &[DAffine3]| {
        let place = |node: &u32| {
            let at = prepared.nodes.positions[*node as usize].as_dvec3();
            poses.get(prepared.nodes.joint(*node as usize) as usize).map_or(at, |pose| pose.transform_point3(at))
        };
        let positions: Vec<DVec3> = prepared.triangles.as_flattened().iter().map(place).collect();
        let count = prepared.triangles.len() as u32;
        let triangles: Vec<[u32; 3]> = (0..count).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        let numbers: Vec<u32> = (0..count).flat_map(|number| [number; 3]).collect();
        let surface = RasterSurface {
            positions: &positions,
            triangles: &triangles,
            temperatures: values,
            vertex_part: &numbers,
            vertex_material: &vec![0; positions.len()],
            emissivities: &[[1.0; 2]],
            around: None,
        };
        let pixels = rasterise(&surface, view, |_| 0.0);
        pixels.iter().map(|pixel| Some((pixel.part.checked_sub(1)?, pixel.temperature))).collect::<Vec<_>>()
    };
    let line_time = image.camera.line_time;
    match moments(prepared, image.time, number).filter(|_| line_time > 0.0) {
        None => draw(&view, &poses),
        Some(moment) => (0..view.height)
            .flat_map(|row| {
                let at = moment(f64::from(row) * line_time);
                let camera_from_body = at.pose;
                let mut of_row = RasterView { height: 1, camera_from_body, ..view };
                of_row.lens.centre[1] -= f64::from(row);
                draw(&of_row, &at.joints)
            })
            .collect(),
    }
}
