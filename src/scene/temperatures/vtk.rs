//! Reads temperatures from a mesh of VTK in XML: `.vtu` (UnstructuredGrid) and `.vtp` (PolyData).
//!
//! A temperature belongs to a point, or to a cell, whose place is then the mean of its points.

use std::path::Path;

use glam::DVec3;
use roxmltree::{Document, Node};

use super::solution::{HOTTEST, Solution, SolvedNode};
use super::table::refuse;
use crate::files;
use crate::scene::error::SceneError;
use crate::scene::file::unreadable;
use crate::text::plain;

mod arrays;

use arrays::Arrays;

/// Names of an array of temperatures, where the scene names none.
const NAMES: [&str; 4] = ["temperature", "temp", "t", "temperature_k"];

/// Counts of cells that a piece may state.
const CELLS: [&str; 5] = ["NumberOfCells", "NumberOfVerts", "NumberOfLines", "NumberOfPolys", "NumberOfStrips"];
/// Memory of a point or cell that becomes a node.
const POINT: usize = 2 * size_of::<DVec3>() + size_of::<SolvedNode>() + size_of::<f64>();

/// Reads a mesh. `array` names the array of the temperatures, and `zero` [K] is 0 of its unit.
pub(super) fn load(path: &Path, array: Option<&str>, zero: f64) -> Result<Solution, SceneError> {
    let bytes = files::read(path).map_err(|fault| unreadable(path, &fault))?;
    parse(&bytes, path, array, zero)
}

/// Reads the bytes of a mesh as if it lay at `path`.
pub(super) fn parse(bytes: &[u8], path: &Path, array: Option<&str>, zero: f64) -> Result<Solution, SceneError> {
    let (text, appended) = arrays::parted(bytes, path)?;
    let document =
        Document::parse(&text).map_err(|error| refuse(path, u64::from(error.pos().row), "VTKFile", error))?;
    let root = document.root_element();
    let grid = ["UnstructuredGrid", "PolyData"].into_iter().find_map(|name| child(root, name));
    let (true, Some(grid)) = (root.has_tag_name("VTKFile"), grid) else {
        return Err(refuse(path, 1, "VTKFile", "holds neither an UnstructuredGrid (.vtu) nor PolyData (.vtp)"));
    };
    let arrays = Arrays::new(root, appended, path, bytes.len())?;
    let (mut nodes, mut temperatures, mut notes) = (Vec::new(), Vec::new(), Vec::new());
    for piece in grid.children().filter(|node| node.has_tag_name("Piece")) {
        let (places, kelvin) = of_piece(piece, &arrays, array, zero, &mut notes)?;
        nodes.extend(places.into_iter().map(|place| SolvedNode {
            name: String::new(),
            label: String::new(),
            place: Some(place),
        }));
        temperatures.extend(kelvin);
    }
    if nodes.is_empty() {
        return Err(refuse(path, 1, "Piece", "is missing or empty: the mesh has no points"));
    }
    notes.dedup();
    Ok(Solution { nodes, times: vec![0.0], temperatures, notes })
}

fn child<'a, 'i>(node: Node<'a, 'i>, name: &str) -> Option<Node<'a, 'i>> {
    node.children().find(|child| child.has_tag_name(name))
}

fn of_piece(
    piece: Node,
    arrays: &Arrays,
    array: Option<&str>,
    zero: f64,
    notes: &mut Vec<String>,
) -> Result<(Vec<DVec3>, Vec<f64>), SceneError> {
    let points = child(piece, "Points").and_then(|points| child(points, "DataArray"));
    let points = points.ok_or_else(|| arrays.wrong(piece, "has no Points"))?;
    let coordinates = arrays.values(points)?;
    if coordinates.len() % 3 != 0 || coordinates.iter().any(|value| !value.is_finite()) {
        return Err(arrays.wrong(points, "must hold three finite coordinates for each point"));
    }
    let count = coordinates.len() / 3;
    check_stated(piece, arrays, &["NumberOfPoints"], count)?;
    arrays.charge(points, count, POINT)?;
    let points: Vec<DVec3> = coordinates.chunks_exact(3).map(DVec3::from_slice).collect();
    if points.is_empty() {
        return Ok((Vec::new(), Vec::new()));
    }
    let arrays_of = |section: &str| -> Vec<Node> {
        let arrays = child(piece, section).into_iter().flat_map(|section| section.children());
        arrays.filter(|node| node.has_tag_name("DataArray") && components(*node) == 1).collect()
    };
    let (of_points, of_cells) = (arrays_of("PointData"), arrays_of("CellData"));
    let chosen = |all: &[Node]| -> Option<usize> {
        let named = |node: &Node| {
            let name = node.attribute("Name").unwrap_or("");
            array.map_or_else(|| NAMES.iter().any(|known| name.eq_ignore_ascii_case(known)), |wanted| name == wanted)
        };
        all.iter().position(named)
    };
    let (values, places) = match (chosen(&of_points), chosen(&of_cells)) {
        (Some(index), other) => {
            if other.is_some() {
                notes.push("Points and cells have temperatures: those of the points are taken.".to_owned());
            }
            (of_points[index], points)
        }
        (None, Some(index)) => {
            let centres = centres(piece, arrays, &points)?;
            check_stated(piece, arrays, &CELLS, centres.len())?;
            arrays.charge(of_cells[index], centres.len(), POINT)?;
            (of_cells[index], centres)
        }
        (None, None) => {
            let names = of_points.iter().chain(&of_cells).map(|node| node.attribute("Name").unwrap_or("(no name)"));
            let names = plain(&names.collect::<Vec<_>>().join(", ")).into_owned();
            let wanted = array.map_or_else(|| "temperature".to_owned(), |name| format!("'{name}'"));
            let message = format!("has no array {wanted} with one component (temperatures.array); there are: {names}");
            return Err(arrays.wrong(piece, message));
        }
    };
    let kelvin: Vec<f64> = arrays.values(values)?.iter().map(|value| value + zero).collect();
    if kelvin.len() != places.len() {
        return Err(arrays.wrong(values, format!("has {} values for {} places", kelvin.len(), places.len())));
    }
    if let Some(at) = kelvin.iter().position(|value| !(0.0..=HOTTEST).contains(value)) {
        let message =
            format!("value {} is {} K; a temperature is from 0 to {HOTTEST} K (temperatures.unit)", at + 1, kelvin[at]);
        return Err(arrays.wrong(values, message));
    }
    Ok((places, kelvin))
}

/// Checks the counts that a piece states, if any, against the number that is there.
fn check_stated(piece: Node, arrays: &Arrays, keys: &[&str], count: usize) -> Result<(), SceneError> {
    let mut sum = None;
    for (key, text) in keys.iter().filter_map(|key| Some((key, piece.attribute(*key)?))) {
        let stated = text.trim().parse::<usize>();
        let stated =
            stated.map_err(|_| arrays.wrong(piece, format!("has {key} '{}', which is no count", plain(text))))?;
        sum = Some(sum.unwrap_or(0usize).saturating_add(stated));
    }
    match sum.filter(|sum| *sum != count) {
        None => Ok(()),
        Some(sum) => Err(arrays.wrong(piece, format!("states {sum} by {}, and has {count}", keys.join(", ")))),
    }
}

fn components(array: Node) -> usize {
    array.attribute("NumberOfComponents").and_then(|text| text.parse().ok()).unwrap_or(1)
}

/// The mean of the points of each cell. The cells of PolyData are vertices, lines, polygons and strips, in this order.
fn centres(piece: Node, arrays: &Arrays, points: &[DVec3]) -> Result<Vec<DVec3>, SceneError> {
    let mut centres = Vec::new();
    for cells in ["Cells", "Verts", "Lines", "Polys", "Strips"].into_iter().filter_map(|name| child(piece, name)) {
        let named = |name: &str| {
            let array =
                cells.children().find(|node| node.has_tag_name("DataArray") && node.attribute("Name") == Some(name));
            array.map_or(Ok(Vec::new()), |array| arrays.values(array))
        };
        let (corners, ends) = (named("connectivity")?, named("offsets")?);
        let mut first = 0;
        for end in ends {
            let points_of_cell = corners.get(first..end as usize).filter(|points_of_cell| !points_of_cell.is_empty());
            let points_of_cell = points_of_cell
                .ok_or_else(|| arrays.wrong(cells, format!("cell {} has no points", centres.len() + 1)))?;
            let mut sum = DVec3::ZERO;
            for corner in points_of_cell {
                let point = points.get(*corner as usize).filter(|_| *corner >= 0.0);
                sum +=
                    *point.ok_or_else(|| arrays.wrong(cells, format!("names point {corner} of {}", points.len())))?;
            }
            centres.push(sum / points_of_cell.len() as f64);
            first = end as usize;
        }
    }
    Ok(centres)
}
