//! The errors of the pixels of an image.

use super::Uncertainty;
use crate::simulation::corner_image::draw_corners;
use crate::simulation::image::Image;
use crate::trace::span;

/// Error of a change by light in pixels, over the largest change beside it: found against places that were followed by themselves (`tools/oracle`: `struts`, `spin`,
/// `station_cut_1m`).
const OF_CHANGE: f64 = 0.1;
/// Error of a change by light that came and went before [K], whatever the change of today; found in the same way.
const OF_BEFORE: f64 = 0.15;

impl Uncertainty<'_> {
    /// States the error of every pixel of an image [K], from the errors at the end of the last step. `number` is the number of an image at its own time.
    pub(crate) fn draw(&mut self, image: &mut Image, number: Option<u32>) {
        let _draws = span("drawing errors");
        let corners = self.of_corners(true);
        let drawn = draw_corners(self.prepared, &corners, image, number);
        let mut errors: Vec<Option<f32>> = drawn.iter().map(|shown| shown.map(|(_, error)| error as f32)).collect();
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
        self.draw_changed(image, number);
        self.state.pixels.add(&image.error, &image.part);
    }

    /// States the errors of pixels with light of their own, which have none of the light within a cell.
    fn draw_changed(&self, image: &mut Image, number: Option<u32>) {
        let Some(changes) = image.changes.clone() else { return };
        let of_nodes = draw_corners(self.prepared, &self.of_corners(false), image, number);
        let (width, height) = (image.camera.width as usize, image.camera.height as usize);
        let changed = |pixel: usize| f64::from(changes.of(pixel, image.part[pixel]).abs());
        for (pixel, of_nodes) in of_nodes.iter().enumerate().filter(|(pixel, _)| changed(*pixel) > 0.0) {
            let (row, column) = (pixel / width, pixel % width);
            let around = (row.saturating_sub(1)..(row + 2).min(height)).flat_map(|row| {
                (column.saturating_sub(1)..(column + 2).min(width)).map(move |column| row * width + column)
            });
            let largest = around.map(changed).fold(0.0, f64::max);
            let of_nodes = of_nodes.map_or(0.0, |(_, error)| error);
            image.error[pixel] = of_nodes.hypot(OF_CHANGE * largest).hypot(OF_BEFORE) as f32;
        }
    }
}
