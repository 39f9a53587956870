//! Rasteriser in f64: the reference of the graphics pass for every pixel of a radiance image.
//!
//! For the ray d = (x, y, 1) of a pixel in camera axes it solves w_a a + w_b b + w_c c = d (Olano & Greer 1997, homogeneous rasterisation). The ray meets
//! the triangle where all weights are positive. The camera depth is z = 1 / (w_a + w_b + w_c), and the barycentric coordinates are z w. This interpolates
//! in perspective without dividing by the depth of a vertex. A triangle may therefore cross the camera's plane, and the near plane is a test of z alone.

use glam::{DAffine3, DVec3};
use rayon::prelude::*;

use crate::thermal::lobe::Lobe;
use crate::thermal::surroundings::{Reflector, Surroundings, reflected_radiance, sky_radiance};

/// Triangles with the values of their vertices. A triangle has the part and material of its first vertex.
#[derive(Debug, Clone, Copy)]
pub struct Surface<'a> {
    /// Vertex positions, body frame [m].
    pub positions: &'a [DVec3],
    /// Vertex indices, counter-clockwise seen from the front.
    pub triangles: &'a [[u32; 3]],
    /// Temperatures of the vertices [K].
    pub temperatures: &'a [f64],
    /// Part of each vertex.
    pub vertex_part: &'a [u32],
    /// Material of each vertex.
    pub vertex_material: &'a [u32],
    /// Emissivities of front and back for each material.
    pub emissivities: &'a [[f64; 2]],
    /// What surrounds the surface. `None` where no pixel shows it.
    pub around: Option<Around<'a>>,
}

/// What surrounds a surface, and how it reflects that.
#[derive(Debug, Clone, Copy)]
pub struct Around<'a> {
    /// The surroundings, in camera axes.
    pub surroundings: &'a Surroundings,
    /// Whether they show behind the surface.
    pub background: bool,
    /// Normals of the vertices, body frame. They interpolate between the vertices.
    pub normals: &'a [DVec3],
    /// Front and back of each material. Empty where nothing reflects.
    pub reflectors: &'a [[Reflector; 2]],
    /// The lobes that they refer to.
    pub lobes: &'a [Lobe],
}

/// A pinhole camera with OpenCV axes: +X right, +Y down, +Z forward.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// Rigid motion that takes body positions into camera axes.
    pub camera_from_body: DAffine3,
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Focal lengths in pixels (x, y).
    pub focal: [f64; 2],
    /// Principal point in pixels. The centre of the upper left pixel is (0.5, 0.5).
    pub centre: [f64; 2],
    /// Distance of the near plane [m], > 0.
    pub near: f64,
}

/// One pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pixel {
    /// Emitted and reflected radiance in the band [W m-2 sr-1]. Where no surface is, it is that of the sky, or 0 without one.
    pub radiance: f64,
    /// The reflected part of it [W m-2 sr-1]. 0 where no surface is.
    pub reflected: f64,
    /// Temperature [K]. 0 where no surface is.
    pub temperature: f64,
    /// Distance along the camera's axis [m]. Infinite where no surface is.
    pub depth: f64,
    /// Part + 1. 0 where no surface is.
    pub part: u32,
    /// Material + 1. 0 where no surface is.
    pub material: u32,
}

/// A pixel that no triangle covers.
pub const EMPTY: Pixel =
    Pixel { radiance: 0.0, reflected: 0.0, temperature: 0.0, depth: f64::INFINITY, part: 0, material: 0 };

/// A triangle in camera axes.
struct Projected {
    /// Weights of the vertices on the ray d are `planes[i] . d`.
    planes: [DVec3; 3],
    temperatures: [f64; 3],
    /// Pixels that it may cover: ranges of columns and rows, ends excluded.
    columns: [u32; 2],
    rows: [u32; 2],
    /// Normals of the visible face at the vertices, camera axes. 0 where nothing reflects.
    normals: [DVec3; 3],
    /// 0 for the front, 1 for the back.
    face: usize,
    emissivity: f64,
    part: u32,
    material: u32,
}

/// Draws both faces of a surface with a depth test, rows from the top. `radiance` gives the blackbody radiance in the band [W m-2 sr-1] at a temperature
/// [K].
pub fn rasterise(surface: &Surface, view: &View, radiance: impl Fn(f64) -> f64 + Sync) -> Vec<Pixel> {
    let projected: Vec<Projected> =
        surface.triangles.par_iter().filter_map(|&triangle| project(surface, view, triangle)).collect();
    let mut pixels = vec![EMPTY; view.width as usize * view.height as usize];
    pixels.par_chunks_mut(view.width.max(1) as usize).enumerate().for_each(|(row, pixels)| {
        let row = row as u32;
        let mut shown = vec![None; pixels.len()];
        for triangle in projected.iter().filter(|triangle| (triangle.rows[0]..triangle.rows[1]).contains(&row)) {
            draw_row(triangle, view, row, pixels, &mut shown);
        }
        for (column, (pixel, shown)) in pixels.iter_mut().zip(shown).enumerate() {
            // The field held the emissivity so far, so that only visible pixels are converted.
            if pixel.part > 0 {
                pixel.radiance *= radiance(pixel.temperature);
            }
            if let Some(around) = &surface.around {
                let direction = ray(view, column as u32, row).normalize();
                arrive(pixel, around, shown, direction);
            }
        }
    });
    pixels
}

/// Ray of a pixel in camera axes, with a depth of 1.
fn ray(view: &View, column: u32, row: u32) -> DVec3 {
    DVec3::new(
        (f64::from(column) + 0.5 - view.centre[0]) / view.focal[0],
        (f64::from(row) + 0.5 - view.centre[1]) / view.focal[1],
        1.0,
    )
}

/// Adds what a surface reflects, or the sky where none is. `direction` leads from the camera to the pixel.
fn arrive(pixel: &mut Pixel, around: &Around, shown: Option<Shown>, direction: DVec3) {
    match shown {
        None if around.background => pixel.radiance = sky_radiance(around.surroundings, direction),
        None => {}
        Some(Shown { normal, face }) => {
            if let Some(reflectors) = around.reflectors.get(pixel.material as usize - 1) {
                pixel.reflected =
                    reflected_radiance(around.surroundings, &reflectors[face], around.lobes, normal, -direction);
                pixel.radiance += pixel.reflected;
            }
        }
    }
}

/// The face that a pixel shows.
#[derive(Debug, Clone, Copy)]
struct Shown {
    /// Normal of length 1, camera axes.
    normal: DVec3,
    face: usize,
}

/// Draws one row of a triangle, with its emissivity in place of the radiance.
fn draw_row(triangle: &Projected, view: &View, row: u32, pixels: &mut [Pixel], shown: &mut [Option<Shown>]) {
    for column in triangle.columns[0]..triangle.columns[1] {
        let ray = ray(view, column, row);
        let weights = triangle.planes.map(|plane| plane.dot(ray));
        let depth = 1.0 / weights.iter().sum::<f64>();
        let pixel = &mut pixels[column as usize];
        if weights.iter().all(|&w| w >= 0.0) && depth >= view.near && depth < pixel.depth {
            let weighted: f64 = weights.iter().zip(triangle.temperatures).map(|(w, t)| w * t).sum();
            let normal: DVec3 = weights.iter().zip(triangle.normals).map(|(weight, normal)| *weight * normal).sum();
            shown[column as usize] = Some(Shown { normal: normal.normalize_or_zero(), face: triangle.face });
            *pixel = Pixel {
                reflected: 0.0,
                radiance: triangle.emissivity,
                temperature: weighted * depth,
                depth,
                part: triangle.part + 1,
                material: triangle.material + 1,
            };
        }
    }
}

/// Prepares a triangle. `None` where it can not cover a pixel: behind the near plane, beside the image, or seen edge-on.
fn project(surface: &Surface, view: &View, triangle: [u32; 3]) -> Option<Projected> {
    let indices = triangle.map(|vertex| vertex as usize);
    let [a, b, c] = indices.map(|vertex| view.camera_from_body.transform_point3(surface.positions[vertex]));
    let (columns, rows) = bounds(view, [a, b, c])?;
    // a . (b x c) as a product with edges, which does not cancel for a small triangle far away.
    let volume = a.dot((b - a).cross(c - a));
    if volume == 0.0 {
        return None;
    }
    let planes = [b.cross(c - b), c.cross(a - c), a.cross(b - a)].map(|plane| plane / volume);
    let material = surface.vertex_material[indices[0]];
    // The camera is at the origin, so the outward normal points to it where a . normal < 0.
    let face = usize::from(volume > 0.0);
    let side = if face == 0 { 1.0 } else { -1.0 };
    let normals = indices.map(|vertex| {
        let normal = surface.around.as_ref().and_then(|around| around.normals.get(vertex));
        normal.map_or(DVec3::ZERO, |normal| side * (view.camera_from_body.matrix3 * *normal))
    });
    Some(Projected {
        normals,
        face,
        planes,
        temperatures: indices.map(|vertex| surface.temperatures[vertex]),
        columns,
        rows,
        emissivity: surface.emissivities[material as usize][face],
        part: surface.vertex_part[indices[0]],
        material,
    })
}

/// Columns and rows that a triangle may cover, from its corners clipped at the near plane.
fn bounds(view: &View, corners: [DVec3; 3]) -> Option<([u32; 2], [u32; 2])> {
    let mut low = [f64::INFINITY; 2];
    let mut high = [f64::NEG_INFINITY; 2];
    let mut include = |point: DVec3| {
        for (axis, value) in [point.x, point.y].into_iter().enumerate() {
            let pixel = view.focal[axis] * value / point.z + view.centre[axis];
            low[axis] = low[axis].min(pixel);
            high[axis] = high[axis].max(pixel);
        }
    };
    for i in 0..3 {
        let (from, to) = (corners[i], corners[(i + 1) % 3]);
        if from.z >= view.near {
            include(from);
        }
        if (from.z >= view.near) != (to.z >= view.near) {
            include(from.lerp(to, (view.near - from.z) / (to.z - from.z)));
        }
    }
    // One more pixel on each side against rounding. The weights decide which pixels are covered.
    let range = |axis: usize, size: u32| {
        let first = (low[axis] - 1.5).floor().clamp(0.0, f64::from(size)) as u32;
        let end = (high[axis] + 1.5).ceil().clamp(0.0, f64::from(size)) as u32;
        (first < end).then_some([first, end])
    };
    Some((range(0, view.width)?, range(1, view.height)?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::thermal::planck::Band;
    use crate::thermal::planck::band_radiance_exact;
    use glam::{DMat3, DQuat};

    const EMISSIVITIES: [[f64; 2]; 2] = [[0.9, 0.4], [0.5, 0.1]];

    fn radiance(t: f64) -> f64 {
        band_radiance_exact(Band { lower: 8e-6, upper: 14e-6 }, t)
    }

    /// Looks along -Z of the body (front faces have a normal towards +Z) from (0, 0, height), turned by `tilt` about X.
    fn view(height: f64, tilt: f64) -> View {
        let down = DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0));
        let camera_from_body = DAffine3::from_quat(DQuat::from_rotation_x(tilt))
            * DAffine3::from_mat3(down)
            * DAffine3::from_translation(DVec3::new(0.0, 0.0, -height));
        View { camera_from_body, width: 80, height: 60, focal: [70.0, 72.0], centre: [39.3, 30.8], near: 0.1 }
    }

    /// A square of 20 m at z = 0 whose temperature is linear in x and y.
    struct Plate {
        positions: Vec<DVec3>,
        temperatures: Vec<f64>,
    }

    const PLATE_TRIANGLES: [[u32; 3]; 2] = [[0, 1, 2], [0, 2, 3]];
    const BACK_TRIANGLES: [[u32; 3]; 2] = [[0, 2, 1], [0, 3, 2]];

    fn field(p: DVec3) -> f64 {
        250.0 + 11.0 * p.x - 4.0 * p.y
    }

    fn plate() -> Plate {
        let corners = [(-10.0, -10.0), (10.0, -10.0), (10.0, 10.0), (-10.0, 10.0)];
        let positions: Vec<DVec3> = corners.iter().map(|&(x, y)| DVec3::new(x, y, 0.0)).collect();
        let temperatures = positions.iter().map(|&p| field(p)).collect();
        Plate { positions, temperatures }
    }

    fn draw(plate: &Plate, triangles: &[[u32; 3]], view: &View) -> Vec<Pixel> {
        let vertices = plate.positions.len();
        let (parts, materials) = (vec![4; vertices], vec![1; vertices]);
        let surface = Surface {
            positions: &plate.positions,
            triangles,
            temperatures: &plate.temperatures,
            vertex_part: &parts,
            vertex_material: &materials,
            emissivities: &EMISSIVITIES,
            around: None,
        };
        rasterise(&surface, view, radiance)
    }

    /// Point where a pixel's ray meets the plane z = 0 of the body, and its camera depth, without the rasteriser.
    fn meet(view: &View, index: usize) -> (DVec3, f64) {
        let (column, row) = (index % view.width as usize, index / view.width as usize);
        let ray = DVec3::new(
            (column as f64 + 0.5 - view.centre[0]) / view.focal[0],
            (row as f64 + 0.5 - view.centre[1]) / view.focal[1],
            1.0,
        );
        let body_from_camera = view.camera_from_body.inverse();
        let (origin, direction) =
            (body_from_camera.transform_point3(DVec3::ZERO), body_from_camera.transform_vector3(ray));
        let depth = -origin.z / direction.z;
        (origin + depth * direction, depth)
    }

    #[test]
    fn plate_with_a_gradient_agrees_with_the_closed_form() {
        for (height, tilt) in [(9.0, 0.0), (6.0, 0.6), (30.0, 0.2), (0.5, 1.3)] {
            let view = view(height, tilt);
            let pixels = draw(&plate(), &PLATE_TRIANGLES, &view);
            let mut covered = 0;
            for (index, pixel) in pixels.iter().enumerate() {
                let (point, depth) = meet(&view, index);
                let edge = 10.0 - point.x.abs().max(point.y.abs());
                if depth < view.near || edge < -1e-9 {
                    assert_eq!(*pixel, EMPTY);
                } else if edge > 1e-9 {
                    covered += 1;
                    let (t, l) = (field(point), 0.5 * radiance(field(point)));
                    assert!((pixel.temperature - t).abs() < 1e-9, "{} against {t} K", pixel.temperature);
                    assert!((pixel.radiance - l).abs() < 1e-9 * l, "{} against {l}", pixel.radiance);
                    assert!((pixel.depth - depth).abs() < 1e-9);
                    assert_eq!((pixel.part, pixel.material), (5, 2));
                    let beside = field(point + DVec3::new(1e-6, 0.0, 0.0));
                    assert!((pixel.temperature - beside).abs() > 1e-9);
                }
            }
            assert!(covered > 500, "{height} m, {tilt} rad: {covered} pixels");
        }
    }

    #[test]
    fn the_back_has_its_own_emissivity() {
        let view = view(9.0, 0.3);
        let (front, back) = (draw(&plate(), &PLATE_TRIANGLES, &view), draw(&plate(), &BACK_TRIANGLES, &view));
        let mut seen = 0;
        for (front, back) in front.iter().zip(&back).filter(|(front, _)| front.part > 0) {
            seen += 1;
            assert!((back.radiance / front.radiance - 0.1 / 0.5).abs() < 1e-12);
        }
        assert!(seen > 500);
    }

    #[test]
    fn the_nearest_wins_in_any_order() {
        let mut plate = plate();
        let nearer = plate.positions.iter().map(|p| DVec3::new(0.2 * p.x, 0.2 * p.y, 1.0)).collect::<Vec<_>>();
        plate.positions.extend(nearer);
        plate.temperatures.extend([400.0; 4]);
        let mut triangles = vec![[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]];
        let view = view(9.0, 0.0);
        let one = draw(&plate, &triangles, &view);
        triangles.reverse();
        assert_eq!(one, draw(&plate, &triangles, &view));
        let centre = one[30 * 80 + 39];
        assert!((centre.temperature - 400.0).abs() < 1e-9 && (centre.depth - 8.0).abs() < 1e-12, "{centre:?}");
        assert!(one.iter().any(|pixel| (pixel.depth - 9.0).abs() < 1e-12), "and the plate shows beside it");
    }

    #[test]
    fn nothing_behind_the_camera_is_drawn() {
        let view = View { camera_from_body: DAffine3::from_translation(DVec3::new(0.0, 0.0, -3.0)), ..view(1.0, 0.0) };
        assert!(draw(&plate(), &PLATE_TRIANGLES, &view).iter().all(|pixel| *pixel == EMPTY));
        let hidden = View { near: 9.5, ..self::view(9.0, 0.0) };
        assert!(draw(&plate(), &PLATE_TRIANGLES, &hidden).iter().all(|pixel| *pixel == EMPTY));
    }
}
