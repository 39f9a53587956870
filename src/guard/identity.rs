//! Which material each pixel shows, in the f64 rasteriser.

use glam::{DAffine3, DMat3, DVec3};

use crate::lens::Lens;
use crate::model::nodes::GROUP;
use crate::raster::{RasterSurface, RasterView, rasterise};
use crate::scene::work::image_time;
use crate::simulation::pose_of;
use crate::simulation::prepare::Prepared;
use crate::simulation::viewpoint::raster_view;

/// Longest side of a picture [px].
const LONGEST: u32 = 1280;
/// Size of a picture of the whole craft [px].
const WHOLE: [u32; 2] = [960, 720];
/// Half the field of view of that picture [rad].
const HALF_FIELD: f64 = 0.25;

/// Part and material of each pixel, rows from the top.
#[derive(Debug, Clone)]
pub(crate) struct Identity {
    /// Width [px].
    pub(crate) width: u32,
    /// Part + 1 and material + 1 of each pixel. 0 where no surface is.
    pub(crate) pixels: Vec<[u32; 2]>,
}

/// Identities in the first image, with its time [s]. `None` where the scene draws none.
pub(crate) fn of_first_image(prepared: &Prepared) -> Option<(f64, Identity)> {
    let camera = prepared.scene.camera.as_ref()?;
    let (time, listed) = image_time(&prepared.scene.time, 0)?;
    let pose = pose_of(prepared, time, listed)?;
    let view = RasterView { samples: 1, ..raster_view(camera, &pose) };
    let shrink = f64::from(view.width.max(view.height).div_ceil(LONGEST));
    let side = |pixels: u32| ((f64::from(pixels) / shrink) as u32).max(1);
    let lens = Lens {
        focal: view.lens.focal.map(|length| length / shrink),
        centre: view.lens.centre.map(|place| place / shrink),
        skew: view.lens.skew / shrink,
        ..view.lens
    };
    Some((time, draw(prepared, time, &RasterView { lens, width: side(view.width), height: side(view.height), ..view })))
}

/// The whole craft at time 0, seen obliquely from above: from +X, -Y and +Z of the body.
pub(crate) fn of_whole_craft(prepared: &Prepared) -> Identity {
    let places = prepared.nodes_at(0.0);
    let drawn = prepared.triangles.iter().flatten().map(|node| places.positions[*node as usize].as_dvec3());
    let (low, high) = drawn.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
    let (middle, radius) = (0.5 * (low + high), (0.5 * (high - low).length()).max(1e-9));
    let from = DVec3::new(1.0, -1.2, 0.8).normalize();
    let distance = radius / HALF_FIELD.sin();
    let [width, height] = WHOLE;
    let (forward, right) = (-from, (-from).cross(DVec3::Z).normalize());
    let rotation = DMat3::from_cols(right, forward.cross(right), forward);
    let pose = DAffine3::from_mat3_translation(rotation, middle + distance * from).inverse();
    let focal = f64::from(height) / 2.0 / HALF_FIELD.tan();
    let centre = [f64::from(width) / 2.0, f64::from(height) / 2.0];
    let near = 0.01 * distance;
    let lens = Lens::pinhole([focal; 2], centre);
    draw(prepared, 0.0, &RasterView { camera_from_body: pose, width, height, lens, samples: 1, near, first_row: 0 })
}

fn draw(prepared: &Prepared, time: f64, view: &RasterView) -> Identity {
    let nodes = prepared.nodes_at(time);
    let of_group =
        |groups: &[u32]| -> Vec<u32> { (0..nodes.positions.len()).map(|slot| groups[slot / GROUP]).collect() };
    let positions: Vec<DVec3> = nodes.positions.iter().map(|position| position.as_dvec3()).collect();
    let surface = RasterSurface {
        positions: &positions,
        triangles: &prepared.triangles,
        temperatures: &vec![1.0; positions.len()],
        vertex_part: &of_group(&nodes.group_part),
        vertex_material: &of_group(&nodes.group_material),
        emissivities: &vec![[1.0; 2]; prepared.materials.len()],
        around: None,
    };
    let pixels = rasterise(&surface, view, |_| 1.0).into_iter().map(|pixel| [pixel.part, pixel.material]).collect();
    Identity { width: view.width, pixels }
}
