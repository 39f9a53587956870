//! Loads a glTF file as a [`Model`]: places every mesh of the default scene in the body frame.

use std::collections::HashSet;
use std::collections::hash_map::{Entry, HashMap};
use std::path::Path;

use glam::{DMat3, DVec3, Vec3};

use super::accessor::Accessors;
use super::alike::{first_alike, position_bits};
use super::document::Document;
use super::error::counted;
use super::graph::{self, Instance};
use super::measure::area_vector;
use super::primitive::{Geometry, read_mesh};
use super::{
    Model, ModelError, ModelFault, ModelMaterial, Part, Skipped, animation, buffer, container, format, instances,
};
use crate::files::{self, Reach};
use crate::stop::Watch;
use crate::text::plain;

const DEFAULT_MATERIAL: &str = "default";
/// A vertex that no triangle uses yet.
const UNUSED: u32 = u32::MAX;
/// Smallest normal f32 area [m2]. A node below it would have no capacitance.
const SMALLEST_AREA: f64 = f32::MIN_POSITIVE as f64;
/// Ratio of the sum of area vectors to one of them, below which only rounding errors are left.
const CANCELLED: f64 = 1e-12;

impl Model {
    /// Loads a `.glb` or `.gltf` file, whose buffers are in its own folder.
    ///
    /// The default scene is loaded, or the first one. Every instance of a mesh counts on its own. A mirroring transform reverses the
    /// winding, so that triangles still face outwards. Primitives without normals are shaded flat: their triangles share no
    /// vertices.
    ///
    /// Triangles of zero area are dropped and counted in `skipped`. Their corners coincide or lie on a line (the cross
    /// product is exactly 0 in f64), or their final area is below the smallest normal f32 (1.2e-38 m2). Slivers of
    /// larger area stay. Unused vertices are dropped.
    ///
    /// # Errors
    /// A file that is unreadable, breaks a rule of glTF 2.0, requires an unsupported extension, or holds no triangle.
    /// See [`ModelFault`].
    pub fn load(path: &Path) -> Result<Self, ModelError> {
        Self::load_within(path, &Reach::of(path))
    }

    /// Loads a file that may name the files of `reach`.
    ///
    /// # Errors
    /// As for `load`.
    pub fn load_within(path: &Path, reach: &Reach) -> Result<Self, ModelError> {
        let read = || {
            let bytes = files::read(path).map_err(ModelFault::Unreadable)?;
            read(&bytes, path, reach)
        };
        read().map_err(|fault| ModelError::File { path: path.to_owned(), fault })
    }

    /// Reads the bytes of a file as if it lay at `path`.
    ///
    /// # Errors
    /// As for `load`.
    pub fn parse(bytes: &[u8], path: &Path, reach: &Reach) -> Result<Self, ModelError> {
        read(bytes, path, reach).map_err(|fault| ModelError::File { path: path.to_owned(), fault })
    }
}

fn read(bytes: &[u8], path: &Path, reach: &Reach) -> Result<Model, ModelFault> {
    let named = |fault| format::named(fault, path);
    let container = container::split(bytes).map_err(named)?;
    let document = Document::parse(container.json).map_err(named)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let buffers = buffer::load(&document, container.binary, folder, reach)?;
    let accessors = Accessors::new(&document, container.json.len(), &buffers);
    let graph = graph::walk(&document)?;

    let mut assembly = ModelAssembly::new(
        &document,
        Model {
            source: path.to_owned(),
            gltf_nodes: graph.nodes.len(),
            animations: animation::read(&document, &accessors),
            tree: graph.nodes,
            skipped: document.skipped.clone(),
            ..Model::default()
        },
    );
    let mut meshes: HashMap<usize, Vec<Geometry>> = HashMap::new();
    let watch = Watch::begin();
    for instance in &instances::copied(&document, &accessors, graph.instances)? {
        watch.look();
        let geometries = match meshes.entry(instance.mesh) {
            Entry::Occupied(read) => read.into_mut(),
            Entry::Vacant(slot) => {
                slot.insert(read_mesh(&document, &accessors, instance.mesh, &mut assembly.model.skipped)?)
            }
        };
        charge(&document, &accessors, instance, geometries)?;
        assembly.place(instance, geometries)?;
    }
    let model = assembly.model;
    if model.triangles.is_empty() {
        let reasons: Vec<String> = model.skipped.iter().map(|row| format!("{}: {}", row.what, row.why)).collect();
        let reasons = if reasons.is_empty() { String::new() } else { format!(" (left out: {})", reasons.join("; ")) };
        return Err(ModelFault::NothingToDraw(format!("the default scene holds no triangle{reasons}")));
    }
    Ok(model)
}

/// Memory of a placed triangle.
const TRIANGLE: usize = size_of::<[u32; 3]>();
/// Memory of a placed vertex, with what its normal is found from.
const VERTEX: usize = 2 * size_of::<DVec3>() + size_of::<Vec3>() + 3 * size_of::<u32>() + size_of::<VertexTriangles>();

/// Charges the part that an instance is about to become: a short file can place one mesh any number of times.
fn charge(
    document: &Document,
    accessors: &Accessors,
    instance: &Instance,
    geometries: &[Geometry],
) -> Result<(), ModelFault> {
    let placed = geometries.iter().try_for_each(|geometry| {
        let corners = 3 * geometry.triangles.len();
        let vertices = geometry.normals.as_ref().map_or(corners, |normals| normals.len().min(corners));
        accessors.charge(geometry.triangles.len(), TRIANGLE)?;
        accessors.charge(vertices, VERTEX)
    });
    // The name stands in the part, in the set of names and in a note.
    let name = document.nodes[instance.node].name.as_ref().map_or(0, String::len);
    let part = placed.and_then(|()| accessors.charge(3, size_of::<Part>() + name));
    part.map_err(|problem| ModelFault::element(document.node_label(instance.node), problem))
}

struct ModelAssembly<'a> {
    document: &'a Document<'a>,
    model: Model,
    /// Model index of each material in use, by its index in the document.
    materials: HashMap<Option<usize>, u32>,
    part_names: HashSet<String>,
    /// The number that the next part of a name gets.
    repeats: HashMap<String, usize>,
}

/// How a node transforms areas, normals and winding.
struct NodeTransform {
    /// Cofactors of the linear part times the sign of its determinant, which map outward area vectors to outward ones.
    outward: DMat3,
    mirrored: bool,
}

impl NodeTransform {
    fn new(linear: DMat3) -> Self {
        let DMat3 { x_axis: x, y_axis: y, z_axis: z } = linear;
        let cofactors = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y));
        let mirrored = x.dot(cofactors.x_axis) < 0.0;
        // The inverse transpose is cofactors / determinant. Only its direction matters, so singular matrices work too.
        Self { outward: if mirrored { -cofactors } else { cofactors }, mirrored }
    }
}

/// The triangles around a vertex, which give its normal if the file has none.
struct VertexTriangles {
    /// Sum of their outward area vectors [m2].
    sum: DVec3,
    /// Outward area vector of the first triangle [m2].
    first: DVec3,
    /// Sum of their unit normals times their angles here. Only summed for normals that were rounded.
    turned: DVec3,
}

impl VertexTriangles {
    /// The area-weighted mean direction, or the direction of the first triangle if the triangles cancel out.
    fn normal(&self) -> DVec3 {
        let cancelled = self.sum.length() < CANCELLED * self.first.length();
        if cancelled { self.first } else { self.sum }.normalize_or_zero()
    }

    /// The mean direction, by area or by angle, from which rounding may have made a given normal. The given one where there is none.
    ///
    /// The 8 bits of a component are 0.4 deg, which is 0.3 K of a flat panel that the Sun grazes.
    fn before_rounding(&self, given: DVec3, rounding: f64) -> DVec3 {
        let means = [self.normal(), self.turned.normalize_or_zero()];
        let near = means.into_iter().filter(|mean| mean.distance(given) <= rounding);
        near.min_by(|a, b| a.distance(given).total_cmp(&b.distance(given))).unwrap_or(given)
    }
}

/// Gives vertices with one key the triangles of all of them: a seam of the texture does not end a surface.
fn join_alike<K: Ord>(around: &mut [VertexTriangles], key: impl Fn(usize) -> K + Sync) {
    let first: Vec<usize> = first_alike(around.len(), key).into_iter().map(|first| first as usize).collect();
    for (vertex, first) in first.iter().copied().enumerate().filter(|(vertex, first)| vertex != first) {
        let [sum, turned] = [around[vertex].sum, around[vertex].turned];
        around[first].sum += sum;
        around[first].turned += turned;
    }
    for (vertex, first) in first.iter().copied().enumerate() {
        let [sum, turned] = [around[first].sum, around[first].turned];
        (around[vertex].sum, around[vertex].turned) = (sum, turned);
    }
}

/// Angle at a corner of a triangle [rad].
fn angle([here, a, b]: [DVec3; 3]) -> f64 {
    (a - here).angle_between(b - here)
}

/// Counts of triangles and normals of a primitive.
#[derive(Default)]
struct Tally {
    dropped: usize,
    flat: usize,
    computed: usize,
    inward: usize,
}

impl<'a> ModelAssembly<'a> {
    fn new(document: &'a Document<'a>, model: Model) -> Self {
        Self { document, model, materials: HashMap::new(), part_names: HashSet::new(), repeats: HashMap::new() }
    }

    fn place(&mut self, instance: &Instance, geometries: &[Geometry]) -> Result<(), ModelFault> {
        let placement = NodeTransform::new(DMat3::from_mat4(instance.body_from_part));
        let part = self.model.parts.len() as u32;
        let mut tally = Tally::default();
        let before = self.model.triangles.len();
        for geometry in geometries {
            self.place_geometry(instance, &placement, geometry, part, &mut tally)?;
        }
        let node = &self.document.nodes[instance.node];
        let name = match &node.name {
            Some(name) if !name.is_empty() => plain(name).into_owned(),
            _ => format!("node_{}", instance.node),
        };
        let name = instance.copy.map_or(name.clone(), |copy| format!("{name}[{copy}]"));
        let drawn = self.model.triangles.len() > before;
        let name = if drawn { self.unique_part_name(name) } else { name };
        self.report(&name, &tally);
        if drawn {
            self.model.parts.push(Part { name, body_from_part: instance.body_from_part });
            self.model.part_nodes.push(instance.place);
        }
        Ok(())
    }

    fn place_geometry(
        &mut self,
        instance: &Instance,
        placement: &NodeTransform,
        geometry: &Geometry,
        part: u32,
        tally: &mut Tally,
    ) -> Result<(), ModelFault> {
        let first = self.model.positions.len();
        let mut vertices = vec![UNUSED; if geometry.normals.is_some() { geometry.positions.len() } else { 0 }];
        let mut around: Vec<VertexTriangles> = Vec::new();
        let mut given: Vec<DVec3> = Vec::new();
        let mut material = None;
        for triangle in &geometry.triangles {
            let local = triangle.map(|corner| geometry.positions[corner as usize]);
            let outward = placement.outward * area_vector(local);
            let placed = local.map(|corner| instance.body_from_part.transform_point3(corner));
            if !placed.iter().all(|corner| corner.as_vec3().is_finite()) {
                let problem = "places its mesh beyond the range of 32-bit floats";
                return Err(ModelFault::element(self.document.node_label(instance.node), problem));
            }
            if outward == DVec3::ZERO || area_vector(placed).length() < SMALLEST_AREA {
                tally.dropped += 1;
                continue;
            }
            let material = *material.get_or_insert_with(|| self.material(geometry.material));
            let mut corners = [0; 3];
            for (slot, corner) in corners.iter_mut().zip([0, 1, 2]) {
                let source = triangle[corner] as usize;
                let shared = vertices.get(source).copied().unwrap_or(UNUSED);
                *slot = if shared == UNUSED {
                    let vertex = self.push_vertex(instance.node, placed[corner], part, material)?;
                    if let Some(normals) = &geometry.normals {
                        vertices[source] = vertex;
                        given.push((placement.outward * normals[source]).normalize_or_zero());
                    }
                    around.push(VertexTriangles { sum: DVec3::ZERO, first: outward, turned: DVec3::ZERO });
                    vertex
                } else {
                    shared
                };
                let around = &mut around[*slot as usize - first];
                around.sum += outward;
                if geometry.rounding > 0.0 {
                    let corners = [0, 1, 2].map(|turn| placed[(corner + turn) % 3]);
                    around.turned += outward.normalize_or_zero() * angle(corners);
                }
            }
            if placement.mirrored {
                corners.swap(1, 2);
            }
            self.model.triangles.push(corners);
        }

        if geometry.rounding > 0.0 {
            let key =
                |vertex: usize| (position_bits(self.model.positions[first + vertex]), position_bits(given[vertex]));
            join_alike(&mut around, key);
        }
        for (vertex, around) in around.iter().enumerate() {
            let normal = match given.get(vertex) {
                Some(normal) if *normal != DVec3::ZERO => {
                    tally.inward += usize::from(normal.dot(around.sum) < 0.0);
                    around.before_rounding(*normal, geometry.rounding)
                }
                Some(_) => {
                    tally.computed += 1;
                    around.normal()
                }
                None => around.normal(),
            };
            self.model.normals.push(normal.as_vec3());
        }
        if geometry.normals.is_none() {
            tally.flat += around.len() / 3;
        }
        Ok(())
    }

    fn push_vertex(&mut self, node: usize, position: DVec3, part: u32, material: u32) -> Result<u32, ModelFault> {
        let vertex = u32::try_from(self.model.positions.len()).ok().filter(|vertex| *vertex != UNUSED);
        let vertex = vertex.ok_or_else(|| {
            ModelFault::element(self.document.node_label(node), "brings the vertices to more than 32 bits can count")
        })?;
        self.model.positions.push(position);
        self.model.vertex_part.push(part);
        self.model.vertex_material.push(material);
        Ok(vertex)
    }

    /// Index of a material in the model. The first use adds it.
    fn material(&mut self, source: Option<usize>) -> u32 {
        let (document, materials) = (self.document, &mut self.model.materials);
        *self.materials.entry(source).or_insert_with(|| {
            materials.push(match source {
                Some(index) => document.materials[index].clone(),
                None => ModelMaterial { name: DEFAULT_MATERIAL.to_owned(), extras: Default::default(), colour: None },
            });
            (materials.len() - 1) as u32
        })
    }

    fn unique_part_name(&mut self, name: String) -> String {
        if self.part_names.insert(name.clone()) {
            return name;
        }
        let next = self.repeats.entry(name.clone()).or_insert(2);
        loop {
            let unique = format!("{name}#{next}");
            *next += 1;
            if self.part_names.insert(unique.clone()) {
                return unique;
            }
        }
    }

    fn report(&mut self, part: &str, tally: &Tally) {
        let Tally { dropped, flat, computed, inward } = *tally;
        if dropped > 0 {
            let what = format!("{} of part {part}", counted(dropped, "triangle"));
            self.model.skipped.push(Skipped { what, why: "zero area".to_owned() });
        }
        let notes = &mut self.model.notes;
        if flat > 0 {
            notes.push(format!(
                "normals computed for {} of part {part}, which have none: flat, as glTF asks",
                counted(flat, "triangle")
            ));
        }
        if computed > 0 {
            let vertices = if computed == 1 { "1 vertex".to_owned() } else { format!("{computed} vertices") };
            notes.push(format!(
                "normals computed for {vertices} of part {part}, because their own are zero or not finite: mean of \
                 the triangles around, weighted by area"
            ));
        }
        if inward > 0 {
            let normals = if inward == 1 { "1 normal points".to_owned() } else { format!("{inward} normals point") };
            notes.push(format!("{normals} to the back of the triangles in part {part}; used as they are"));
        }
    }
}
