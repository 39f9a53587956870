//! The silhouettes of the rigid objects of a craft, also where another object hides them or the frame ends.
//!
//! The visible mask comes from the part in each pixel. A silhouette comes from the f64 rasteriser, which tests the samples of each pixel, as the image
//! does.

use glam::{DVec2, DVec3};

use super::craft::{BopObject, Craft};
use super::image::LabelledImage;
use super::mask::{PixelBounds, bounds, bounds_of, pixels_of};
use crate::lens::Distortion;
use crate::raster::{RasterSurface, RasterView, rasterise};

/// The meshes of the rigid objects of a craft. The meshes are made once for a data set.
#[derive(Debug, Clone, PartialEq)]
pub struct Solids {
    objects: Vec<BopObject>,
    triangles: Vec<Vec<[u32; 3]>>,
    /// Object of each part, as its place in `objects`. `None` for a part of no target.
    object_of_part: Vec<Option<usize>>,
    positions: Vec<DVec3>,
    /// Temperatures, parts and materials that the rasteriser asks for.
    temperatures: Vec<f64>,
    zeros: Vec<u32>,
}

/// An object in an image.
#[derive(Debug, Clone, PartialEq)]
pub struct Silhouette {
    /// The pixels that its silhouette covers, hidden or not.
    pub full: Vec<bool>,
    /// The pixels that show it.
    pub visible: Vec<bool>,
    /// Pixels of the silhouette, also beyond the frame by one width and height on each side.
    pub count: u64,
    /// Box round the whole object, also beyond the frame.
    pub bounds: Option<PixelBounds>,
}

/// A part of the plane of the image, in pixels of the frame.
#[derive(Debug, Clone, Copy)]
struct SilhouetteCanvas {
    first: [i64; 2],
    size: [i64; 2],
}

impl Solids {
    /// The objects of a craft.
    pub fn new(craft: &Craft) -> Self {
        let objects = craft.objects();
        let of_part = |(part, link): (usize, &u32)| {
            let target = craft.target_of_part(part as u32);
            objects.iter().position(|object| object.link == *link && Some(object.target) == target)
        };
        Self {
            triangles: objects.iter().map(|object| craft.triangles_of(object)).collect(),
            object_of_part: craft.link_of_part.iter().enumerate().map(of_part).collect(),
            positions: craft.positions.clone(),
            temperatures: vec![0.0; craft.positions.len()],
            zeros: vec![0; craft.positions.len()],
            objects,
        }
    }

    /// The objects, in the order of their numbers.
    pub fn objects(&self) -> &[BopObject] {
        &self.objects
    }

    /// The silhouettes of all objects in an image.
    pub fn silhouettes(&self, image: &LabelledImage) -> Vec<Silhouette> {
        (0..self.objects.len()).map(|object| self.silhouette(object, image)).collect()
    }

    fn silhouette(&self, object: usize, image: &LabelledImage) -> Silhouette {
        let width = image.width as usize;
        let is_object = |part: &u32| *part != 0 && self.object_of_part.get(*part as usize - 1) == Some(&Some(object));
        let visible: Vec<bool> = image.channels.part.iter().map(is_object).collect();
        let is_alone = self.objects.len() == 1 && self.object_of_part.iter().all(Option::is_some);
        if is_alone && !touches_the_border(&visible, width) {
            let (count, bounds) = (pixels_of(&visible, width).count() as u64, bounds(&visible, width));
            return Silhouette { full: visible.clone(), visible, count, bounds };
        }
        let (canvas, drawn) = self.draw(object, image);
        let [left, top] = canvas.first;
        let in_frame =
            |[x, y]: &[i64; 2]| (0..i64::from(image.width)).contains(x) && (0..i64::from(image.height)).contains(y);
        let drawn = pixels_of(&drawn, canvas.size[0].max(1) as usize).map(|[x, y]| [x + left, y + top]);
        let (inside, beyond): (Vec<_>, Vec<_>) = drawn.partition(in_frame);
        // The image may show an object in a pixel at its edge where the rasteriser meets no sample. The image holds all of an object that nothing hides.
        let mut full = visible.clone();
        if !is_alone {
            inside.into_iter().for_each(|[x, y]| full[y as usize * width + x as usize] = true);
        }
        let all = || pixels_of(&full, width).chain(beyond.iter().copied());
        let (count, bounds) = (all().count() as u64, bounds_of(all()));
        Silhouette { full, visible, count, bounds }
    }

    fn draw(&self, object: usize, image: &LabelledImage) -> (SilhouetteCanvas, Vec<bool>) {
        let canvas = self.canvas(object, image);
        let mut lens = image.lens;
        lens.centre = [0, 1].map(|axis| lens.centre[axis] - canvas.first[axis] as f64);
        let surface = RasterSurface {
            positions: &self.positions,
            triangles: &self.triangles[object],
            temperatures: &self.temperatures,
            vertex_part: &self.zeros,
            vertex_material: &self.zeros,
            emissivities: &[[1.0; 2]],
            around: None,
        };
        let view = RasterView {
            camera_from_body: image.camera_from_link(self.objects[object].link as usize),
            width: canvas.size[0] as u32,
            height: canvas.size[1] as u32,
            lens,
            samples: image.channels.samples,
            near: image.near,
            first_row: 0,
        };
        let drawn = rasterise(&surface, &view, |_| 0.0);
        (canvas, drawn.iter().map(|pixel| pixel.part != 0).collect())
    }

    /// The box round the vertices of an object, up to a frame's width and height beyond the frame on each side. A lens with distortion has no image
    /// beyond its frame.
    fn canvas(&self, object: usize, image: &LabelledImage) -> SilhouetteCanvas {
        let [width, height] = [image.width, image.height].map(i64::from);
        let beyond = if image.lens.distortion == Distortion::None { 1 } else { 0 };
        let least = [-beyond * width, -beyond * height];
        let most = [(1 + beyond) * width, (1 + beyond) * height];
        let pose = image.camera_from_link(self.objects[object].link as usize);
        let vertices = self.triangles[object].iter().flatten();
        let points = vertices.map(|vertex| pose.transform_point3(self.positions[*vertex as usize]));
        // A vertex behind the camera has no place, so the whole canvas is drawn.
        let places = points.map(|point| (point.z > image.near).then(|| image.lens.project(point.truncate() / point.z)));
        let [low, high] = match places.collect::<Option<Vec<DVec2>>>() {
            Some(places) if beyond > 0 => places
                .iter()
                .fold([DVec2::INFINITY, DVec2::NEG_INFINITY], |[low, high], place| [low.min(*place), high.max(*place)]),
            _ => [DVec2::NEG_INFINITY, DVec2::INFINITY],
        };
        let low = [0, 1].map(|axis| (low[axis].floor() as i64).clamp(least[axis], most[axis] - 1));
        let high = [0, 1].map(|axis| (high[axis].ceil() as i64).clamp(low[axis] + 1, most[axis]));
        SilhouetteCanvas { first: low, size: [0, 1].map(|axis| high[axis] - low[axis]) }
    }
}

fn touches_the_border(mask: &[bool], width: usize) -> bool {
    let last = (mask.len() / width.max(1)).saturating_sub(1);
    let on_border = |at: usize| [0, width - 1].contains(&(at % width)) || [0, last].contains(&(at / width));
    mask.iter().enumerate().any(|(at, set)| *set && on_border(at))
}

#[cfg(test)]
mod tests {
    use super::super::image::tests::{small, small_craft};
    use super::*;

    /// The image may show an object in a pixel at its edge where the rasteriser meets no sample.
    #[test]
    fn a_silhouette_holds_every_pixel_that_shows_its_object() {
        let (mut image, solids) = (small(), Solids::new(&small_craft()));
        let width = image.width as usize;
        let before = solids.silhouettes(&image);
        let free = (0..image.pixels()).find(|pixel| image.channels.part[*pixel] == 0 && !before[0].full[*pixel]);
        let free = free.expect("a pixel beside the hull");
        image.channels.part[free] = 1;
        let after = &solids.silhouettes(&image)[0];
        assert!(after.visible.iter().zip(&after.full).all(|(visible, full)| !visible || *full));
        assert_eq!(after.count, before[0].count + 1);
        let [x, y] = [(free % width) as i64, (free / width) as i64];
        let PixelBounds { first, last } = after.bounds.expect("a box");
        assert!(first[0] <= x && x <= last[0] && first[1] <= y && y <= last[1]);
    }
}
