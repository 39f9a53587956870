//! A surface to draw, and the values of a pixel of its image.

use glam::DVec3;

use super::traced::TracedTriangles;
use crate::thermal::surroundings::{BandReflector, Looks, Surroundings};

/// Triangles with the values of their vertices. A triangle has the part and material of its first vertex.
#[derive(Debug, Clone, Copy)]
pub struct RasterSurface<'a> {
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
    /// Surroundings and looks of the surface. `None` where it only emits, and alike to all sides.
    pub around: Option<SurfaceSurroundings<'a>>,
}

/// The surroundings of a surface, and how it reflects them.
#[derive(Debug, Clone, Copy)]
pub struct SurfaceSurroundings<'a> {
    /// The surroundings, in camera axes. `None` where no pixel shows them.
    pub(crate) surroundings: Option<&'a Surroundings>,
    pub(crate) background: bool,
    /// Normals of the vertices, body frame, interpolated between the vertices.
    pub(crate) normals: &'a [DVec3],
    pub(crate) reflects: bool,
    /// Front and back of each material. Empty where nothing reflects and every emissivity is one number.
    pub(crate) reflectors: &'a [[BandReflector; 2]],
    pub(crate) looks: Looks<'a>,
    /// The craft itself, where it is reflected too.
    pub(crate) traced: Option<TracedTriangles<'a>>,
}

/// One pixel. Temperature, depth and identity are taken at its centre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pixel {
    /// Emitted and reflected radiance in the band [W m-2 sr-1], in the mean of the samples. Where no surface is, the radiance of the sky, or 0
    /// without a sky.
    pub radiance: f64,
    /// The reflected part of it [W m-2 sr-1]. 0 where no surface is.
    pub(crate) reflected: f64,
    pub(crate) coverage: f64,
    /// Temperature [K]. 0 where no surface is.
    pub temperature: f64,
    /// Distance along the camera's axis [m]. Infinite where no surface is.
    pub depth: f64,
    /// Part + 1. 0 where no surface is.
    pub part: u32,
    /// Material + 1. 0 where no surface is.
    pub material: u32,
}

pub(crate) const EMPTY: Pixel = Pixel {
    radiance: 0.0,
    reflected: 0.0,
    coverage: 0.0,
    temperature: 0.0,
    depth: f64::INFINITY,
    part: 0,
    material: 0,
};
