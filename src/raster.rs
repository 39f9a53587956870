//! Rasteriser in f64: the reference of the graphics pass for every pixel of a radiance image.
//!
//! For the ray d = (x, y, 1) of a pixel in camera axes it solves w_a a + w_b b + w_c c = d (Olano & Greer 1997, homogeneous rasterisation). The ray meets
//! the triangle where all weights are positive. The camera depth is z = 1 / (w_a + w_b + w_c), and the barycentric coordinates are z w. This interpolates
//! in perspective without dividing by the depth of a vertex. A triangle may therefore cross the camera's plane, and the near plane is a test of z alone.
//! Every sample of a pixel has its own ray, through the distortion of the lens.

pub mod distant;
pub mod traced;

use glam::{DAffine3, DVec2, DVec3};
use rayon::prelude::*;

use self::traced::{Craft, Seen, Traced, traced_radiance};
use crate::lens::{Distortion, Lens};
use crate::thermal::surroundings::{Looks, Reflector, Surroundings, emissivity, reflected_radiance, sky_radiance};

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
    /// What surrounds the surface, and how it looks. `None` where it only emits, and alike to all sides.
    pub around: Option<Around<'a>>,
}

/// What surrounds a surface, and how it reflects that.
#[derive(Debug, Clone, Copy)]
pub struct Around<'a> {
    /// The surroundings, in camera axes. `None` where no pixel shows them.
    pub surroundings: Option<&'a Surroundings>,
    /// Whether they show behind the surface.
    pub background: bool,
    /// Normals of the vertices, body frame. They interpolate between the vertices.
    pub normals: &'a [DVec3],
    /// Whether it reflects them.
    pub reflects: bool,
    /// Front and back of each material. Empty where nothing reflects and every emissivity is one number.
    pub reflectors: &'a [[Reflector; 2]],
    /// The tables that they refer to.
    pub looks: Looks<'a>,
    /// The craft itself, where it is reflected too.
    pub traced: Option<Traced<'a>>,
}

/// A camera with OpenCV axes: +X right, +Y down, +Z forward.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// Rigid motion that takes body positions into camera axes.
    pub camera_from_body: DAffine3,
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Which ray a place in the image sees.
    pub lens: Lens,
    /// Samples of a pixel: 1, 4, 8 or 16.
    pub samples: u32,
    /// Distance of the near plane [m], > 0.
    pub near: f64,
}

/// One pixel. Temperature, depth and identity are those at its centre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pixel {
    /// Emitted and reflected radiance in the band [W m-2 sr-1], in the mean of the samples. Where no surface is, it is that of the sky, or 0 without one.
    pub radiance: f64,
    /// The reflected part of it [W m-2 sr-1]. 0 where no surface is.
    pub reflected: f64,
    /// Share of the samples that show a surface.
    pub coverage: f64,
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
pub const EMPTY: Pixel = Pixel {
    radiance: 0.0,
    reflected: 0.0,
    coverage: 0.0,
    temperature: 0.0,
    depth: f64::INFINITY,
    part: 0,
    material: 0,
};

/// A triangle in camera axes.
struct Projected {
    /// Weights of the vertices on the ray d are `planes[i] . d`.
    planes: [DVec3; 3],
    temperatures: [f64; 3],
    /// Rays that may meet it.
    rays: Bounds,
    /// Normals of the visible face at the vertices, camera axes. 0 where nothing needs them.
    normals: [DVec3; 3],
    /// 0 for the front, 1 for the back.
    face: usize,
    emissivity: f64,
    part: u32,
    material: u32,
}

/// A rectangle of rays.
#[derive(Debug, Clone, Copy)]
struct Bounds {
    low: DVec2,
    high: DVec2,
}

impl Bounds {
    /// No ray.
    const NONE: Self = Self { low: DVec2::INFINITY, high: DVec2::NEG_INFINITY };

    fn with(self, ray: DVec2) -> Self {
        Self { low: self.low.min(ray), high: self.high.max(ray) }
    }

    fn meets(&self, other: &Self) -> bool {
        self.low.cmple(other.high).all() && other.low.cmple(self.high).all()
    }
}

/// Pixels of a row that are tried together.
const BLOCK: usize = 16;

/// The places of the samples in a pixel, from its upper left corner: the standard sample locations of Vulkan (chapter Rasterization,
/// Multisampling).
pub fn places(samples: u32) -> &'static [[f64; 2]] {
    const ONE: [[f64; 2]; 1] = [[0.5, 0.5]];
    const FOUR: [[f64; 2]; 4] = [[0.375, 0.125], [0.875, 0.375], [0.125, 0.625], [0.625, 0.875]];
    const EIGHT: [[f64; 2]; 8] = [
        [0.5625, 0.3125],
        [0.4375, 0.6875],
        [0.8125, 0.5625],
        [0.3125, 0.1875],
        [0.1875, 0.8125],
        [0.0625, 0.4375],
        [0.6875, 0.9375],
        [0.9375, 0.0625],
    ];
    const SIXTEEN: [[f64; 2]; 16] = [
        [0.5625, 0.5625],
        [0.4375, 0.3125],
        [0.3125, 0.625],
        [0.75, 0.4375],
        [0.1875, 0.375],
        [0.625, 0.8125],
        [0.8125, 0.6875],
        [0.6875, 0.1875],
        [0.375, 0.875],
        [0.5, 0.0625],
        [0.25, 0.125],
        [0.125, 0.75],
        [0.0, 0.5],
        [0.9375, 0.25],
        [0.875, 0.9375],
        [0.0625, 0.0],
    ];
    match samples {
        0..=1 => &ONE,
        2..=4 => &FOUR,
        5..=8 => &EIGHT,
        _ => &SIXTEEN,
    }
}

/// Samples along the width and height of a pixel whose reflections of the craft are traced: those of a finer image.
fn grid(samples: u32) -> [u32; 2] {
    match samples {
        0..=1 => [1, 1],
        2..=4 => [2, 2],
        5..=8 => [4, 2],
        _ => [4, 4],
    }
}

/// The centres of the texels of a grid in a pixel.
fn centres([across, down]: [u32; 2]) -> Vec<[f64; 2]> {
    let place = |number: u32| [(number % across, across), (number / across, down)];
    let share = |(at, of): (u32, u32)| (f64::from(at) + 0.5) / f64::from(of);
    (0..across * down).map(|number| place(number).map(share)).collect()
}

/// The rays of places in the pixels of a row, pixel after pixel. Where the lens has none, the ray is no number and meets nothing.
fn rays_of_row(view: &View, row: u32, places: &[[f64; 2]]) -> Vec<DVec2> {
    let mut near = None;
    let pixels = (0..view.width)
        .flat_map(|column| places.iter().map(move |[x, y]| DVec2::new(f64::from(column) + x, f64::from(row) + y)));
    let ray = |pixel| {
        near = match near {
            Some(ray) if view.lens.distortion != Distortion::None => view.lens.unproject_from(ray, pixel),
            _ => None,
        }
        .or_else(|| view.lens.unproject(pixel));
        near.unwrap_or(DVec2::NAN)
    };
    pixels.map(ray).collect()
}

/// Draws both faces of a surface with a depth test, rows from the top. `radiance` gives the blackbody radiance in the band [W m-2 sr-1] at a temperature
/// [K].
pub fn rasterise(surface: &Surface, view: &View, radiance: impl Fn(f64) -> f64 + Sync) -> Vec<Pixel> {
    let projected: Vec<Projected> =
        surface.triangles.par_iter().filter_map(|&triangle| project(surface, view, triangle)).collect();
    let mut pixels = vec![EMPTY; view.width as usize * view.height as usize];
    let traced = surface.around.as_ref().and_then(|around| around.traced);
    let mut places = if traced.is_some() { centres(grid(view.samples)) } else { places(view.samples).to_vec() };
    let counted = places.len();
    // Identity and temperature are those of the centre, which is the place of a single sample.
    places.extend((counted > 1).then_some([0.5, 0.5]));
    let each = places.len();
    pixels.par_chunks_mut(view.width.max(1) as usize).enumerate().for_each(|(row, pixels)| {
        let rays = rays_of_row(view, row as u32, &places);
        let around = |rays: &[DVec2]| rays.iter().fold(Bounds::NONE, |bounds, ray| bounds.with(*ray));
        let blocks: Vec<Bounds> = rays.chunks(BLOCK * each).map(around).collect();
        let whole = blocks.iter().fold(Bounds::NONE, |all, block| all.with(block.low).with(block.high));
        let mut samples = vec![EMPTY; rays.len()];
        let mut shown = vec![None; rays.len()];
        for triangle in projected.iter().filter(|triangle| triangle.rays.meets(&whole)) {
            let drawn = samples.chunks_mut(BLOCK * each).zip(shown.chunks_mut(BLOCK * each));
            let drawn = rays.chunks(BLOCK * each).zip(drawn).zip(&blocks);
            for ((rays, (samples, shown)), _) in drawn.filter(|(_, block)| triangle.rays.meets(block)) {
                draw(triangle, view.near, rays, samples, shown);
            }
        }
        let drawn = samples.chunks_mut(each).zip(shown.chunks(each)).zip(rays.chunks(each));
        for (column, (pixel, ((samples, shown), rays))) in pixels.iter_mut().zip(drawn).enumerate() {
            for (((sample, shown), ray), place) in samples[..counted].iter_mut().zip(shown).zip(rays).zip(&places) {
                let around = surface.around.as_ref().filter(|_| ray.is_finite());
                let direction = ray.extend(1.0).normalize();
                // The field held the emissivity so far, so that only visible samples are converted.
                if sample.part > 0 {
                    let own =
                        around.zip(*shown).and_then(|(around, shown)| around.emissivity(sample, shown, direction));
                    sample.radiance = own.unwrap_or(sample.radiance) * radiance(sample.temperature);
                }
                if let Some(around) = around {
                    arrive(sample, around, *shown, direction);
                    if let (Some(traced), Some(shown), Some(surroundings)) = (&traced, shown, around.surroundings)
                        && let Some(reflector) = around.reflector(sample, *shown)
                    {
                        let [across, down] = grid(view.samples).map(f64::from);
                        let texel = [across * (column as f64 + place[0]), down * (row as f64 + place[1])];
                        let pixel = texel.map(|at| (16.0 * at) as u32);
                        let place = sample.depth * ray.extend(1.0);
                        let seen = Seen { reflector, normal: shown.normal, to_camera: -direction, place, pixel };
                        let craft = Craft {
                            traced,
                            surroundings,
                            reflectors: around.reflectors,
                            looks: &around.looks,
                            temperatures: surface.temperatures,
                            radiance: &radiance,
                        };
                        let light = traced_radiance(&craft, &view.camera_from_body, &seen);
                        sample.reflected += light;
                        sample.radiance += light;
                    }
                }
            }
            let mean = |value: fn(&Pixel) -> f64| samples[..counted].iter().map(value).sum::<f64>() / counted as f64;
            *pixel = Pixel {
                radiance: mean(|sample| sample.radiance),
                reflected: mean(|sample| sample.reflected),
                coverage: mean(|sample| sample.coverage),
                ..samples[each - 1]
            };
        }
    });
    pixels
}

impl Around<'_> {
    /// The reflector that a sample shows.
    fn reflector(&self, sample: &Pixel, shown: Shown) -> Option<&Reflector> {
        self.reflectors.get(sample.material as usize - 1).map(|faces| &faces[shown.face])
    }

    /// Emissivity of what a sample shows. `direction` leads from the camera to it.
    fn emissivity(&self, sample: &Pixel, shown: Shown, direction: DVec3) -> Option<f64> {
        let reflector = self.reflector(sample, shown)?;
        Some(emissivity(reflector, &self.looks, sample.temperature, shown.normal.dot(-direction).max(0.0)))
    }
}

/// Adds what a surface reflects, or the sky where none is. `direction` leads from the camera to the sample.
fn arrive(sample: &mut Pixel, around: &Around, shown: Option<Shown>, direction: DVec3) {
    let Some(surroundings) = around.surroundings else { return };
    match shown {
        None if around.background => sample.radiance = sky_radiance(surroundings, &around.looks, direction),
        None => {}
        Some(shown) => {
            if let Some(reflector) = around.reflector(sample, shown).filter(|_| around.reflects) {
                sample.reflected = reflected_radiance(surroundings, reflector, &around.looks, shown.normal, -direction);
                sample.radiance += sample.reflected;
            }
        }
    }
}

/// The face that a sample shows.
#[derive(Debug, Clone, Copy)]
struct Shown {
    /// Normal of length 1, camera axes.
    normal: DVec3,
    face: usize,
}

/// Draws the samples of a triangle, with its emissivity in place of the radiance.
fn draw(triangle: &Projected, near: f64, rays: &[DVec2], samples: &mut [Pixel], shown: &mut [Option<Shown>]) {
    for ((ray, sample), shown) in rays.iter().zip(samples).zip(shown) {
        let weights = triangle.planes.map(|plane| plane.dot(ray.extend(1.0)));
        let depth = 1.0 / weights.iter().sum::<f64>();
        if weights.iter().all(|&w| w >= 0.0) && depth >= near && depth < sample.depth {
            let weighted: f64 = weights.iter().zip(triangle.temperatures).map(|(w, t)| w * t).sum();
            let normal: DVec3 = weights.iter().zip(triangle.normals).map(|(weight, normal)| *weight * normal).sum();
            *shown = Some(Shown { normal: normal.normalize_or_zero(), face: triangle.face });
            *sample = Pixel {
                reflected: 0.0,
                radiance: triangle.emissivity,
                coverage: 1.0,
                temperature: weighted * depth,
                depth,
                part: triangle.part + 1,
                material: triangle.material + 1,
            };
        }
    }
}

/// Prepares a triangle. `None` where it can not cover a pixel: behind the near plane, or seen edge-on.
fn project(surface: &Surface, view: &View, triangle: [u32; 3]) -> Option<Projected> {
    let indices = triangle.map(|vertex| vertex as usize);
    let [a, b, c] = indices.map(|vertex| view.camera_from_body.transform_point3(surface.positions[vertex]));
    let rays = bounds(view.near, [a, b, c]);
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
        rays,
        emissivity: surface.emissivities[material as usize][face],
        part: surface.vertex_part[indices[0]],
        material,
    })
}

/// Rays that may meet a triangle, from its corners clipped at the near plane.
fn bounds(near: f64, corners: [DVec3; 3]) -> Bounds {
    let mut found = Bounds::NONE;
    for i in 0..3 {
        let (from, to) = (corners[i], corners[(i + 1) % 3]);
        if from.z >= near {
            found = found.with(from.truncate() / from.z);
        }
        if (from.z >= near) != (to.z >= near) {
            let clipped = from.lerp(to, (near - from.z) / (to.z - from.z));
            found = found.with(clipped.truncate() / clipped.z);
        }
    }
    // A little more on each side against rounding. The weights decide which rays meet the triangle.
    let rounding = 1e-9 * (DVec2::ONE + found.low.abs().max(found.high.abs()));
    Bounds { low: found.low - rounding, high: found.high + rounding }
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
        let lens = Lens::pinhole([70.0, 72.0], [39.3, 30.8]);
        View { camera_from_body, width: 80, height: 60, lens, samples: 1, near: 0.1 }
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
        let ray = view.lens.unproject(DVec2::new(column as f64 + 0.5, row as f64 + 0.5)).expect("a ray").extend(1.0);
        let body_from_camera = view.camera_from_body.inverse();
        let (origin, direction) =
            (body_from_camera.transform_point3(DVec3::ZERO), body_from_camera.transform_vector3(ray));
        let depth = -origin.z / direction.z;
        (origin + depth * direction, depth)
    }

    #[test]
    fn plate_with_a_gradient_agrees_with_the_closed_form() {
        let bent = Distortion::BrownConrady([-0.2, 0.04, 1e-3, -2e-3, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        for (height, tilt, distortion) in [
            (9.0, 0.0, Distortion::None),
            (6.0, 0.6, Distortion::None),
            (30.0, 0.2, Distortion::None),
            (0.5, 1.3, Distortion::None),
            (9.0, 0.3, bent),
            (6.0, 0.6, Distortion::Fisheye([-0.01, 0.0, 0.002, 0.0])),
        ] {
            let mut view = view(height, tilt);
            view.lens.distortion = distortion;
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

    /// A plate whose edges cross pixels at an angle.
    #[test]
    fn the_mean_of_the_samples_is_that_of_the_area() {
        for samples in [4, 8, 16] {
            let mut view = View { samples, ..view(40.0, 0.0) };
            view.camera_from_body = DAffine3::from_quat(DQuat::from_rotation_z(0.3)) * view.camera_from_body;
            let mut plate = plate();
            plate.temperatures = vec![300.0; 4];
            let pixels = draw(&plate, &PLATE_TRIANGLES, &view);
            let covered: f64 = pixels.iter().map(|pixel| pixel.coverage).sum();
            let radiant: f64 = pixels.iter().map(|pixel| pixel.radiance).sum();
            // 20 m at a distance of 40 m.
            let exact = 400.0 * 70.0 * 72.0 / 40.0f64.powi(2);
            // A border of about 90 pixels, each off by about 0.1 at random.
            assert!((covered / exact - 1.0).abs() < 3e-3, "{samples} samples: {covered} of {exact} px");
            assert!((radiant / (covered * 0.5 * radiance(300.0)) - 1.0).abs() < 1e-12);
            let border = pixels.iter().filter(|pixel| pixel.coverage > 0.0 && pixel.coverage < 1.0).count();
            assert!(border > 80, "{border} pixels are covered in part");
        }
    }

    #[test]
    fn nothing_behind_the_camera_is_drawn() {
        let view = View { camera_from_body: DAffine3::from_translation(DVec3::new(0.0, 0.0, -3.0)), ..view(1.0, 0.0) };
        assert!(draw(&plate(), &PLATE_TRIANGLES, &view).iter().all(|pixel| *pixel == EMPTY));
        let hidden = View { near: 9.5, ..self::view(9.0, 0.0) };
        assert!(draw(&plate(), &PLATE_TRIANGLES, &hidden).iter().all(|pixel| *pixel == EMPTY));
    }
}
