//! Albedo of a Lambert planet on a plate of any direction: the exact integral, and a table of it for one tick.

/// `albedo_factor` over the directions of a normal, for one Sun zenith angle and one distance.
///
/// A direction d (x towards the Sun's side, z to nadir, y across; the factor is even in y) falls at
/// p = (dx, dz) / (|dx| + |dy| + |dz|), in [-1, 1]^2; the grid has `RESOLUTION + 1` values each way, row after row in z,
/// and is read bilinearly. Its creases (p = 0) lie on grid lines.
#[derive(Debug, Clone, PartialEq)]
pub struct AlbedoTable {
    /// (RESOLUTION + 1)^2 values, albedo flux over (albedo x solar constant).
    pub values: Vec<f64>,
}

/// Intervals of the table each way; even, so that p = 0 is a grid line.
pub const RESOLUTION: usize = 128;
