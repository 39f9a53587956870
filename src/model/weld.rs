//! Joins identical vertices.

use super::Model;
use super::alike::{first_alike, position_bits};

impl Model {
    /// Joins vertices with bit-identical position, normal, part and material.
    ///
    /// Files often give every triangle its own corners. Identical nodes have the same loads and the same temperature,
    /// so one of them is enough. Shape, shading, areas and creases stay. Welding saves most before
    /// [`Model::subdivide`], because new vertices are then shared too.
    pub fn weld(mut self) -> Self {
        let key = |vertex: usize| {
            (
                position_bits(self.positions[vertex]),
                (self.normals[vertex] + 0.0).to_array().map(f32::to_bits),
                self.vertex_part[vertex],
                self.vertex_material[vertex],
            )
        };
        let first = first_alike(self.positions.len(), key);
        self.keep_vertices(|vertex| first[vertex] == vertex as u32, |vertex| first[vertex]);
        self
    }

    /// Drops the vertices that are not `kept`. Triangles use the replacement in `for_vertex` instead.
    pub(super) fn keep_vertices(&mut self, kept: impl Fn(usize) -> bool, for_vertex: impl Fn(usize) -> u32) {
        let mut count = 0;
        let mut renamed = vec![0; self.positions.len()];
        for (vertex, renamed) in renamed.iter_mut().enumerate() {
            if kept(vertex) {
                *renamed = count as u32;
                self.positions[count] = self.positions[vertex];
                self.normals[count] = self.normals[vertex];
                self.vertex_part[count] = self.vertex_part[vertex];
                self.vertex_material[count] = self.vertex_material[vertex];
                count += 1;
            }
        }
        self.positions.truncate(count);
        self.normals.truncate(count);
        self.vertex_part.truncate(count);
        self.vertex_material.truncate(count);
        for vertex in self.triangles.as_flattened_mut() {
            *vertex = renamed[for_vertex(*vertex as usize) as usize];
        }
    }
}
