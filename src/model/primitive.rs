//! Reads the triangles of a glTF mesh in the mesh's own frame.

use glam::DVec3;

use super::accessor::{AccessorUse, Accessors};
use super::document::Document;
use super::elements::{Primitive, PrimitiveMode};
use super::error::{counted, label};
use super::{ModelFault, Skipped};

/// One primitive: vertices of one material and the triangles between them.
pub(super) struct Geometry {
    /// Index into the document's materials, in range.
    pub(crate) material: Option<usize>,
    /// Positions, all finite.
    pub(crate) positions: Vec<DVec3>,
    /// Normals of the file, one for each position, of any length and possibly not finite.
    pub(crate) normals: Option<Vec<DVec3>>,
    /// Error that rounding may have left in the normals, as a length of unit vectors. 0 for floats.
    pub(crate) rounding: f64,
    /// Indices into `positions`, in range, counter-clockwise seen from outside.
    pub(crate) triangles: Vec<[u32; 3]>,
}

/// Reads the triangles of a mesh. Primitives without triangles join `skipped`.
pub(super) fn read_mesh(
    document: &Document,
    accessors: &Accessors,
    mesh: usize,
    skipped: &mut Vec<Skipped>,
) -> Result<Vec<Geometry>, ModelFault> {
    let source = &document.meshes[mesh];
    let mesh_label = label("mesh", mesh, source.name.as_deref());
    let mut all = Vec::with_capacity(source.primitives.len());
    for (number, primitive) in source.primitives.iter().enumerate() {
        let name = format!("primitive {number} of {mesh_label}");
        let mut skip = |what: String, why: &str| skipped.push(Skipped { what, why: why.to_owned() });
        if primitive.targets.as_ref().is_some_and(|targets| !targets.is_empty()) {
            skip(format!("morph targets of {name}"), "the mesh stays in its base shape");
        }
        let Some(mode) = primitive.mode else {
            return Err(ModelFault::element(name, "has an unknown mode"));
        };
        let Some(positions) = primitive.attributes.get("POSITION") else {
            skip(name, "it has no positions");
            continue;
        };
        if let Some(shape) = not_triangles(mode) {
            skip(name, &format!("it holds {shape}, not triangles"));
            continue;
        }
        let positions = read_positions(document, accessors, *positions)?;
        let (corners, geometry) = read_primitive(document, accessors, primitive, mode, positions, &name)?;
        let rest = match mode {
            PrimitiveMode::Triangles => corners % 3,
            _ if corners < 3 => corners,
            _ => 0,
        };
        if rest > 0 {
            skip(format!("{} of {name}", counted(rest, "last corner")), "it takes three to make a triangle");
        }
        all.push(geometry);
    }
    Ok(all)
}

fn not_triangles(mode: PrimitiveMode) -> Option<&'static str> {
    match mode {
        PrimitiveMode::Points => Some("points"),
        PrimitiveMode::Lines => Some("lines"),
        PrimitiveMode::Triangles | PrimitiveMode::TriangleStrip | PrimitiveMode::TriangleFan => None,
    }
}

fn read_positions(document: &Document, accessors: &Accessors, index: usize) -> Result<Vec<DVec3>, ModelFault> {
    let positions: Vec<DVec3> =
        accessors.vectors(index, AccessorUse::Position)?.into_iter().map(DVec3::from_array).collect();
    match positions.iter().position(|position| !position.is_finite()) {
        None => Ok(positions),
        Some(at) => {
            let problem = format!("position {at} is not finite: {}", positions[at]);
            Err(ModelFault::element(document.accessor_label(index), problem))
        }
    }
}

/// Number of corners in the file, and the geometry.
fn read_primitive(
    document: &Document,
    accessors: &Accessors,
    primitive: &Primitive,
    mode: PrimitiveMode,
    positions: Vec<DVec3>,
    name: &str,
) -> Result<(usize, Geometry), ModelFault> {
    let material = primitive.material;
    if let Some(material) = material
        && material >= document.materials.len()
    {
        let problem = format!("refers to material {material}, the file has {}", document.materials.len());
        return Err(ModelFault::element(name, problem));
    }
    let stated = primitive.attributes.get("NORMAL");
    let rounding = stated.map_or(0.0, |index| accessors.rounding(*index));
    let normals = match stated {
        None => None,
        Some(index) => {
            let normals = accessors.vectors(*index, AccessorUse::Normal)?;
            if normals.len() != positions.len() {
                let problem = format!("has {} positions and {} normals", positions.len(), normals.len());
                return Err(ModelFault::element(name, problem));
            }
            Some(normals.into_iter().map(DVec3::from_array).collect())
        }
    };
    let vertices = u32::try_from(positions.len()).map_err(|_| {
        ModelFault::element(name, format!("has {} positions, more than 32 bits can count", positions.len()))
    })?;
    let charge = |count, each| accessors.charge(count, each).map_err(|problem| ModelFault::element(name, problem));
    let corners = match primitive.indices {
        None => {
            charge(positions.len(), size_of::<u32>())?;
            (0..vertices).collect()
        }
        Some(index) => {
            let corners = accessors.indices(index)?;
            if let Some(at) = corners.iter().position(|corner| *corner >= vertices) {
                let problem = format!("index {at} is {}, but {name} has {vertices} positions", corners[at]);
                return Err(ModelFault::element(document.accessor_label(index), problem));
            }
            corners
        }
    };
    charge(triangles_of(mode, corners.len()), size_of::<[u32; 3]>())?;
    let triangles = assemble(mode, &corners);
    Ok((corners.len(), Geometry { material, positions, normals, rounding, triangles }))
}

/// Most triangles that a list of corners makes.
fn triangles_of(mode: PrimitiveMode, corners: usize) -> usize {
    if mode == PrimitiveMode::Triangles { corners / 3 } else { corners }
}

/// Triangles from a list of corners, with the winding of glTF 2.0, 3.7.2.1.
fn assemble(mode: PrimitiveMode, corners: &[u32]) -> Vec<[u32; 3]> {
    match mode {
        PrimitiveMode::TriangleStrip => {
            let triangles = corners.windows(3).enumerate();
            triangles.map(|(at, c)| if at % 2 == 0 { [c[0], c[1], c[2]] } else { [c[0], c[2], c[1]] }).collect()
        }
        PrimitiveMode::TriangleFan => match corners {
            [hub, rim @ ..] => rim.windows(2).map(|pair| [pair[0], pair[1], *hub]).collect(),
            [] => Vec::new(),
        },
        _ => corners.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect(),
    }
}
