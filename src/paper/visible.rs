//! The left half of figure 7: the craft in visible light, so that readers recognise it.
//!
//! The f64 rasteriser shades each face by Lambert's law with the Sun alone. The grey level is 1 minus the solar
//! absorptivity, times the cosine of the Sun angle. There are no cast shadows, no planet light and no colours. Some
//! ambient light keeps unlit faces visible.

use glam::DVec3;

use crate::model::nodes::{GROUP, Nodes};
use crate::output::canvas::{Canvas, Rgb};
use crate::raster::{RasterSurface, RasterView, rasterise};
use crate::thermal::material::{Material, Sides};

/// Ambient light, as a share of direct sunlight on a plate that faces the Sun.
const AMBIENT: f64 = 0.05;
/// Colour of the sky, darker than any surface.
const SKY: Rgb = [6, 8, 14];

/// The craft: nodes in device order, triangles and materials.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CraftMesh<'a> {
    /// Positions and normals of the nodes.
    pub(crate) nodes: &'a Nodes,
    /// Node indices.
    pub(crate) triangles: &'a [[u32; 3]],
    /// The materials that the nodes refer to.
    pub(crate) materials: &'a [Material],
}

/// Draws the craft in sunlight from the unit vector `sun` (body frame). `lit_fraction` is the visible share of the Sun.
pub(crate) fn draw(craft: &CraftMesh, view: &RasterView, sun: DVec3, lit_fraction: f64) -> Canvas {
    // The rasteriser multiplies an interpolated number by one of the visible face. Here these are the cosine of the Sun
    // angle and the reflectivity. A back face has the opposite normal, so its reflectivity is negative. The product is
    // positive if the visible face is lit.
    let cosines: Vec<f64> = craft.nodes.normals.iter().map(|normal| normal.as_dvec3().dot(sun)).collect();
    let positions: Vec<DVec3> = craft.nodes.positions.iter().map(|position| position.as_dvec3()).collect();
    let of_node = |group: &[u32]| (0..positions.len()).map(|node| group[node / GROUP]).collect::<Vec<u32>>();
    let reflectivities: Vec<[f64; 2]> = craft.materials.iter().map(reflectivities).collect();
    let signed: Vec<[f64; 2]> = reflectivities.iter().map(|[front, back]| [*front, -back]).collect();
    let surface = RasterSurface {
        around: None,
        positions: &positions,
        triangles: craft.triangles,
        temperatures: &cosines,
        vertex_part: &of_node(&craft.nodes.group_part),
        vertex_material: &of_node(&craft.nodes.group_material),
        emissivities: &signed,
    };
    let pixels = rasterise(&surface, view, |cosine| cosine);
    let colours = pixels.iter().map(|pixel| match pixel.part {
        0 => SKY,
        _ => {
            let [front, back] = reflectivities[pixel.material as usize - 1];
            let ambient = AMBIENT * 0.5 * (front + back);
            [srgb(lit_fraction * pixel.radiance.max(0.0) + ambient); 3]
        }
    });
    Canvas::from_pixels(view.width, view.height, colours.collect())
}

/// Reflected share of sunlight of front and back.
fn reflectivities(material: &Material) -> [f64; 2] {
    let front = 1.0 - material.front.absorptivity;
    match material.sides {
        Sides::Outside => [front, front],
        Sides::Both { back } => [front, 1.0 - back.absorptivity],
    }
}

/// Linear light in [0, 1] as an sRGB level (IEC 61966-2-1).
fn srgb(linear: f64) -> u8 {
    let linear = linear.clamp(0.0, 1.0);
    let encoded = if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
    (encoded * 255.0).round() as u8
}

#[cfg(test)]
mod tests {
    use glam::{DAffine3, DMat3, Vec3};

    use super::*;
    use crate::lens::Lens;
    use crate::thermal::material::{Bulk, Optics, Response};

    fn material(front: f64, back: f64) -> Material {
        let optics = |absorptivity| Optics { absorptivity, emissivity: 0.9 };
        Material {
            gloss: Default::default(),
            in_band: Default::default(),
            name: "sheet".into(),
            front: optics(front),
            sides: Sides::Both { back: optics(back) },
            bulk: Bulk::default(),
            response: Response::Instant,
            transition: None,
            ranges: [None; 2],
            source: "test".into(),
        }
    }

    /// Grey level of a sheet at z = 0 seen from above. Its front looks along `normal_z`.
    fn grey(normal_z: f32, sun: DVec3, lit_fraction: f64) -> Rgb {
        let corners = [[-9.0, -9.0], [9.0, -9.0], [9.0, 9.0], [-9.0, 9.0]];
        let nodes = Nodes {
            count: 4,
            groups: 1,
            vertex_of_node: vec![0, 1, 2, 3],
            node_of_vertex: vec![0, 1, 2, 3],
            group_material: vec![0],
            group_part: vec![0],
            ranges: Vec::new(),
            normals: vec![Vec3::new(0.0, 0.0, normal_z); 4],
            positions: corners.map(|[x, y]| Vec3::new(x, y, 0.0)).to_vec(),
            areas: vec![1.0; 4],
        };
        let triangles = if normal_z > 0.0 { [[0, 1, 2], [0, 2, 3]] } else { [[0, 2, 1], [0, 3, 2]] };
        let craft = CraftMesh { nodes: &nodes, triangles: &triangles, materials: &[material(0.25, 0.75)] };
        let camera_from_body = DAffine3::from_mat3(DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0)))
            * DAffine3::from_translation(DVec3::new(0.0, 0.0, -10.0));
        let view = RasterView {
            camera_from_body,
            width: 8,
            height: 8,
            lens: Lens::pinhole([8.0; 2], [4.0; 2]),
            samples: 1,
            near: 0.1,
            first_row: 0,
        };
        let canvas = draw(&craft, &view, sun, lit_fraction);
        canvas.get(4, 4).unwrap()
    }

    #[test]
    fn a_face_shines_with_its_own_reflectivity_and_the_cosine_of_the_sun() {
        let tilted = DVec3::new(3f64.sqrt(), 0.0, 1.0).normalize();
        // The front reflects 1 - 0.25, the back 1 - 0.75. Ambient light uses their mean.
        let expected = |reflectivity: f64, cosine: f64| [srgb(reflectivity * cosine + AMBIENT * 0.5); 3];
        assert_eq!(grey(1.0, DVec3::Z, 1.0), expected(0.75, 1.0));
        assert_eq!(grey(1.0, tilted, 1.0), expected(0.75, 0.5));
        assert_eq!(grey(-1.0, tilted, 1.0), expected(0.25, 0.5), "the back is seen, and lit");
        assert_eq!(grey(1.0, DVec3::NEG_Z, 1.0), expected(0.0, 0.0), "lit from behind");
        assert_eq!(grey(1.0, DVec3::Z, 0.0), expected(0.0, 0.0), "in the planet's shadow");
        assert_ne!(grey(1.0, tilted, 1.0), grey(-1.0, tilted, 1.0));
    }

    #[test]
    fn light_is_encoded_as_srgb() {
        // IEC 61966-2-1: 18 % grey is level 118, and half of the light is level 188.
        assert_eq!([0.0, 0.18, 0.5, 1.0, 7.0].map(srgb), [0, 118, 188, 255, 255]);
    }
}
