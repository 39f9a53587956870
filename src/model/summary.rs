//! The contents of a model for `isotherm info MODEL`, as JSON and as text.

use std::fmt;
use std::path::PathBuf;

use serde::Serialize;

use super::{Model, Skipped};

/// The part of a model that belongs to one material or one part.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Share {
    /// Name of the material or part.
    pub name: String,
    /// Number of triangles.
    pub triangles: usize,
    /// Area [m2], one side of each triangle.
    pub area_m2: f64,
}

/// Counts, areas and extent of a model. The fields are the keys of `isotherm info MODEL --json`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ModelSummary {
    /// The file, which is not in the JSON.
    #[serde(skip)]
    pub(crate) source: PathBuf,
    /// Triangles of all instances in the default scene that have an area.
    pub triangles: usize,
    pub(crate) vertices: usize,
    /// Number of glTF nodes in the default scene, including nodes without mesh.
    pub nodes: usize,
    /// Area [m2], one side of each triangle.
    pub area_m2: f64,
    /// Smallest and largest coordinates in the body frame [m].
    pub(crate) bounds_m: [[f64; 3]; 2],
    /// Share of each material, in order of first use.
    pub materials: Vec<Share>,
    /// Share of each part, in traversal order.
    pub parts: Vec<Share>,
    /// Parts of the file that were left out, with the reason.
    pub(crate) skipped: Vec<Skipped>,
    /// Remarks, which are not in the JSON.
    #[serde(skip)]
    pub(crate) notes: Vec<String>,
}

impl Model {
    /// Counts, areas and extent.
    pub fn summary(&self) -> ModelSummary {
        let [low, high] = self.bounds();
        ModelSummary {
            source: self.source.clone(),
            triangles: self.triangles.len(),
            vertices: self.positions.len(),
            nodes: self.gltf_nodes,
            area_m2: self.area(),
            bounds_m: [low.to_array(), high.to_array()],
            materials: self.shares(self.materials.iter().map(|material| &material.name), &self.vertex_material),
            parts: self.shares(self.parts.iter().map(|part| &part.name), &self.vertex_part),
            skipped: self.skipped.clone(),
            notes: self.notes.clone(),
        }
    }

    /// Triangles and area of each owner. A triangle belongs to the owner of its vertices.
    fn shares<'a>(&self, names: impl Iterator<Item = &'a String>, owner: &[u32]) -> Vec<Share> {
        let mut shares: Vec<Share> =
            names.map(|name| Share { name: name.clone(), triangles: 0, area_m2: 0.0 }).collect();
        for (index, triangle) in self.triangles.iter().enumerate() {
            let share = &mut shares[owner[triangle[0] as usize] as usize];
            share.triangles += 1;
            share.area_m2 += self.triangle_area(index);
        }
        shares
    }
}

impl fmt::Display for ModelSummary {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let [low, high] = self.bounds_m;
        writeln!(f, "{}", self.source.display())?;
        writeln!(f, "  triangles  {}", self.triangles)?;
        writeln!(f, "  vertices   {}", self.vertices)?;
        writeln!(f, "  nodes      {}", self.nodes)?;
        writeln!(f, "  area       {:.3} m2", self.area_m2)?;
        for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
            writeln!(f, "  {name}          {:.3} to {:.3} m", low[axis], high[axis])?;
        }
        write_shares(f, "materials", &self.materials)?;
        write_shares(f, "parts", &self.parts)?;
        if !self.skipped.is_empty() {
            writeln!(f, "left out")?;
        }
        for Skipped { what, why } in &self.skipped {
            writeln!(f, "  {what}: {why}")?;
        }
        if !self.notes.is_empty() {
            writeln!(f, "notes")?;
        }
        for note in &self.notes {
            writeln!(f, "  {note}")?;
        }
        Ok(())
    }
}

fn write_shares(f: &mut fmt::Formatter, title: &str, shares: &[Share]) -> fmt::Result {
    let heading = format!("{title} ({})", shares.len());
    let longest = shares.iter().map(|share| share.name.chars().count()).max().unwrap_or(0);
    let width = (longest + 2).max(heading.chars().count());
    writeln!(f, "{heading:<width$}  {:>10}  {:>14}", "triangles", "area [m2]")?;
    for Share { name, triangles, area_m2 } in shares {
        writeln!(f, "  {name:<0$}  {triangles:>10}  {area_m2:>14.4}", width - 2)?;
    }
    Ok(())
}
