//! The errors of the pixels of an image.

use glam::DVec3;

use super::Uncertainty;
use crate::raster::{RasterSurface, RasterView, rasterise};
use crate::simulation::image::Image;
use crate::simulation::viewpoint::raster_view;
use crate::simulation::{moments, prepare::Prepared};

impl Uncertainty<'_> {
    /// States the error of every pixel of an image [K], from the errors at the end of the last step. `number` is the number of an image at its own time.
    pub(crate) fn draw(&mut self, image: &mut Image, number: Option<u32>) {
        let corners = self.of_corners();
        let mut errors = rasterised(self.prepared, &corners, image, number);
        let width = image.camera.width as usize;
        // At the rim of the craft rounding may show a pixel on one side only. Such a pixel has the largest error beside it.
        let shown = image.part.iter().zip(&errors).enumerate();
        let lost: Vec<usize> =
            shown.filter(|(_, (part, error))| **part != 0 && error.is_none()).map(|(pixel, _)| pixel).collect();
        let beside: Vec<Option<f32>> = lost
            .iter()
            .map(|pixel| {
                let near = [pixel.wrapping_sub(1), pixel + 1, pixel.wrapping_sub(width), pixel + width];
                near.iter().filter_map(|near| errors.get(*near).copied().flatten()).reduce(f32::max)
            })
            .collect();
        let mean = (corners.iter().map(|error| error * error).sum::<f64>() / corners.len().max(1) as f64).sqrt() as f32;
        lost.iter().zip(beside).for_each(|(pixel, beside)| errors[*pixel] = Some(beside.unwrap_or(mean)));
        let of_pixel = |(error, part): (&Option<f32>, &u32)| if *part == 0 { 0.0 } else { error.unwrap_or(mean) };
        image.error = errors.iter().zip(&image.part).map(of_pixel).collect();
        self.state.pixels.add(&image.error, &image.part);
    }
}

/// Draws the errors of corners [K]. `None` where no triangle is.
fn rasterised(prepared: &Prepared, corners: &[f64], image: &Image, number: Option<u32>) -> Vec<Option<f32>> {
    let view = RasterView { samples: 1, ..raster_view(&image.camera, &image.camera_from_body) };
    let poses = prepared.loads.joints_at(image.time).1;
    let draw = |view: &RasterView, poses: &[glam::DAffine3]| {
        let place = |node: &u32| {
            let at = prepared.nodes.positions[*node as usize].as_dvec3();
            poses.get(prepared.nodes.joint(*node as usize) as usize).map_or(at, |pose| pose.transform_point3(at))
        };
        let positions: Vec<DVec3> = prepared.triangles.as_flattened().iter().map(place).collect();
        let triangles: Vec<[u32; 3]> =
            (0..prepared.triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        let none = vec![0; positions.len()];
        let surface = RasterSurface {
            positions: &positions,
            triangles: &triangles,
            temperatures: corners,
            vertex_part: &none,
            vertex_material: &none,
            emissivities: &[[1.0; 2]],
            around: None,
        };
        let pixels = rasterise(&surface, view, |_| 0.0);
        pixels.iter().map(|pixel| (pixel.part != 0).then_some(pixel.temperature as f32)).collect::<Vec<_>>()
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
