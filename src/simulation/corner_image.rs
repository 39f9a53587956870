//! Values at the corners of triangles, drawn as an image shows them.

use glam::{DAffine3, DVec3};

use super::camera_pose::moments;
use super::image::Image;
use super::prepare::Prepared;
use super::viewpoint::raster_view;
use crate::raster::{RasterSurface, RasterView, rasterise};

/// The number of the triangle that a pixel shows, and the value there. `None` where no triangle is.
pub(super) type CornerPixel = Option<(u32, f64)>;

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
    match moments(prepared, image.time, number) {
        None => draw(&view, &poses),
        Some(moment) => (0..view.height)
            .flat_map(|row| {
                let at = moment(f64::from(row));
                let camera_from_body = at.pose;
                let mut of_row = RasterView { height: 1, camera_from_body, ..view };
                of_row.lens.centre[1] -= f64::from(row);
                draw(&of_row, &at.joints)
            })
            .collect(),
    }
}
