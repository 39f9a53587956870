//! Joins vertices that nothing tells apart.

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use super::Model;

impl Model {
    /// Joins vertices whose position, normal, part and material are the same to the last bit.
    ///
    /// Files often give every triangle corners of its own. Nodes that agree in all four get the same loads and so the
    /// same temperature; joined, they cost once. Shape, shading, areas and creases stay as they are. Before
    /// [`Model::subdivide`] it saves most, because new vertices are then shared too.
    pub fn weld(mut self) -> Self {
        let mut first_of = HashMap::with_capacity(self.positions.len() / 2);
        let mut kept = 0;
        let mut renamed = Vec::with_capacity(self.positions.len());
        for vertex in 0..self.positions.len() {
            // Adding 0 makes -0 and 0 one.
            let key = (
                (self.positions[vertex] + 0.0).to_array().map(f64::to_bits),
                (self.normals[vertex] + 0.0).to_array().map(f32::to_bits),
                self.vertex_part[vertex],
                self.vertex_material[vertex],
            );
            match first_of.entry(key) {
                Entry::Occupied(first) => renamed.push(*first.get()),
                Entry::Vacant(slot) => {
                    slot.insert(kept as u32);
                    renamed.push(kept as u32);
                    self.positions[kept] = self.positions[vertex];
                    self.normals[kept] = self.normals[vertex];
                    self.vertex_part[kept] = self.vertex_part[vertex];
                    self.vertex_material[kept] = self.vertex_material[vertex];
                    kept += 1;
                }
            }
        }
        self.positions.truncate(kept);
        self.normals.truncate(kept);
        self.vertex_part.truncate(kept);
        self.vertex_material.truncate(kept);
        for vertex in self.triangles.as_flattened_mut() {
            *vertex = renamed[*vertex as usize];
        }
        self
    }
}
