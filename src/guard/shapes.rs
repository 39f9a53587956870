//! Size and orientation of each part: a model in millimetres, and normals that point inward.

use std::collections::{BTreeMap, HashMap};

use glam::DVec3;

use super::finding::{Finding, named, short};
use crate::model::nodes::GROUP;
use crate::simulation::density::LONGEST_CRAFT;
use crate::simulation::prepare::Prepared;
use crate::thermal::material::Sides;

/// No closed body of a craft encloses more [m3]: Skylab's largest has 350, and all modules of the International Space Station together 1,005. A CubeSat
/// of one unit in cm has 1,000.
const LARGEST_BODY: f64 = 900.0;
/// No craft is longer along each of its axes [m]. The International Space Station is flat: 109 m by 73 m by less than 50 m.
const LARGEST_BLOCK: f64 = 50.0;
/// Triangles from which a model of one part is an asteroid or the like, and no simple craft in mm.
const DETAILED: usize = 1000;
/// What mends a model in mm or cm.
const SCALE: &str = "glTF is in metres: export it again in metres, or scale its root node by 0.001 (mm) or 0.01 (cm)";
/// No craft is shorter than this [m].
const SHORTEST: f64 = 0.02;
/// Sum of the area vectors of a closed surface, as a share of its area, that rounding leaves.
const CLOSED: f64 = 1e-3;
/// Share of the edges of a closed surface that may have no partner.
const OPEN_EDGES: f64 = 0.01;
/// Volume as a share of area^(3/2) below which a closed surface has no inside.
const FLAT: f64 = 1e-6;

#[derive(Debug, Clone)]
pub(super) struct PartShape {
    pub(crate) part: u32,
    /// Joint; 0 is the body.
    pub(crate) joint: u32,
    /// Corners of its box in the file's pose [m].
    pub(crate) low: DVec3,
    pub(crate) high: DVec3,
    /// Area [m2].
    pub(crate) area: f64,
    /// Area of each material on it [m2].
    pub(crate) materials: BTreeMap<u32, f64>,
    /// Mean of the longest edges of its triangles, weighted by area [m].
    pub(crate) edge: f64,
    /// Triangles, as places in `Prepared::triangles`.
    pub(crate) triangles: Vec<u32>,
    /// Sum of the area vectors [m2].
    vector: DVec3,
    /// Volume that it encloses if it is closed, negative where its triangles face inward [m3].
    volume: f64,
    /// Area whose normals point against the triangles [m2].
    against: f64,
}

impl PartShape {
    /// Longest side of its box [m].
    pub(crate) fn extent(&self) -> f64 {
        (self.high - self.low).max_element()
    }
}

pub(super) fn parts<'a>(prepared: &'a Prepared, shapes: &[&PartShape]) -> Vec<&'a str> {
    shapes.iter().map(|shape| prepared.parts[shape.part as usize].as_str()).collect()
}

/// Corners of a triangle [m].
pub(super) fn corners(prepared: &Prepared, triangle: u32) -> [DVec3; 3] {
    prepared.triangles[triangle as usize].map(|node| prepared.nodes.positions[node as usize].as_dvec3())
}

pub(super) fn of(prepared: &Prepared) -> Vec<PartShape> {
    let nodes = &prepared.nodes;
    let mut shapes: BTreeMap<u32, PartShape> = BTreeMap::new();
    for (number, triangle) in (0u32..).zip(&prepared.triangles) {
        let slot = triangle[0] as usize;
        let [a, b, c] = corners(prepared, number);
        let vector = 0.5 * (b - a).cross(c - a);
        let area = vector.length();
        if area == 0.0 {
            continue;
        }
        let part = nodes.group_part[slot / GROUP];
        let shape = shapes.entry(part).or_insert_with(|| PartShape {
            part,
            joint: nodes.joint(slot),
            low: DVec3::INFINITY,
            high: DVec3::NEG_INFINITY,
            area: 0.0,
            materials: BTreeMap::new(),
            edge: 0.0,
            triangles: Vec::new(),
            vector: DVec3::ZERO,
            volume: 0.0,
            against: 0.0,
        });
        shape.low = shape.low.min(a).min(b).min(c);
        shape.high = shape.high.max(a).max(b).max(c);
        shape.area += area;
        *shape.materials.entry(nodes.group_material[slot / GROUP]).or_default() += area;
        shape.edge += area * (b - a).length().max((c - b).length()).max((a - c).length());
        // Near the part the volume does not suffer from the distance to the origin.
        let origin = prepared.triangles[*shape.triangles.first().unwrap_or(&number) as usize][0];
        let origin = nodes.positions[origin as usize].as_dvec3();
        shape.volume += (a - origin).dot(vector) / 3.0;
        shape.vector += vector;
        let normal: DVec3 = triangle.iter().map(|node| nodes.normals[*node as usize].as_dvec3()).sum();
        if normal.dot(vector) < 0.0 {
            shape.against += area;
        }
        shape.triangles.push(number);
    }
    for shape in shapes.values_mut() {
        shape.edge /= shape.area;
    }
    shapes.into_values().collect()
}

/// Whether every edge of a shape belongs to two triangles that turn the same way.
fn is_closed(prepared: &Prepared, shape: &PartShape) -> bool {
    if shape.vector.length() > CLOSED * shape.area {
        return false;
    }
    let key = |point: DVec3| point.as_vec3().to_array().map(|number| (number + 0.0).to_bits());
    let mut edges: HashMap<[[u32; 3]; 2], i32> = HashMap::new();
    for triangle in &shape.triangles {
        let [a, b, c] = corners(prepared, *triangle).map(key);
        for (from, to) in [(a, b), (b, c), (c, a)] {
            let (edge, sense) = if from < to { ([from, to], 1) } else { ([to, from], -1) };
            *edges.entry(edge).or_default() += sense;
        }
    }
    let open = edges.values().filter(|count| **count != 0).count();
    open as f64 <= OPEN_EDGES * edges.len() as f64
}

/// Finds closed bodies whose inner face is said to see space.
fn find_closed_sheets(prepared: &Prepared, shapes: &[PartShape]) -> Option<Finding> {
    let is_sheet = |material: u32| matches!(prepared.materials[material as usize].sides, Sides::Both { .. });
    let sheet = |shape: &PartShape| shape.materials.iter().filter(|one| is_sheet(*one.0)).map(|one| one.1).sum::<f64>();
    let closed = |shape: &&PartShape| {
        sheet(shape) > 0.5 * shape.area
            && shape.volume.abs() > FLAT * shape.area.powf(1.5)
            && is_closed(prepared, shape)
    };
    let closed: Vec<&PartShape> = shapes.iter().filter(closed).collect();
    (!closed.is_empty()).then(|| Finding {
        check: "sides",
        about: named("part", &parts(prepared, &closed)),
        message: "a closed body has sides = \"both\", so its inside radiates to space and its area counts twice"
            .to_owned(),
        remedy: "state sides = \"outside\"; for a thin slab give both faces half the thickness and a [[contact]]"
            .to_owned(),
    })
}

/// Tells of a craft that is no longer than a station, but is a block or has a body that none has: a CubeSat in mm, or a larger craft in cm.
fn find_vast(prepared: &Prepared, shapes: &[PartShape], size: DVec3) -> Option<String> {
    if prepared.parts.len() == 1 && prepared.model.triangles >= DETAILED {
        return None;
    }
    let vast = |shape: &&PartShape| shape.volume.abs() > LARGEST_BODY && is_closed(prepared, shape);
    let why = match shapes.iter().find(vast) {
        Some(body) => {
            let part = &prepared.parts[body.part as usize];
            format!(
                "its part '{part}' encloses {} m3, more than any module of a space station",
                short(body.volume.abs())
            )
        }
        None if size.min_element() > LARGEST_BLOCK => "no craft is so large along all its axes".to_owned(),
        None => return None,
    };
    let [x, y, z] = size.to_array().map(short);
    Some(format!("the craft is {x} x {y} x {z} m, and {why}, so the model is probably in mm or cm"))
}

pub(super) fn check(prepared: &Prepared, shapes: &[PartShape], size: DVec3) -> Vec<Finding> {
    let mut findings = Vec::new();
    let model = prepared.scene.model_path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let extent = size.max_element();
    let of_size = |message: String, remedy: &str| Finding {
        check: "units",
        about: format!("model.path ({model})"),
        message,
        remedy: remedy.to_owned(),
    };
    if extent > LONGEST_CRAFT {
        let message = format!("the craft is {} m long, so the model is probably in mm or cm", short(extent));
        findings.push(of_size(message, SCALE));
    } else if let Some(message) = find_vast(prepared, shapes, size) {
        findings.push(of_size(message, SCALE));
    } else if extent < SHORTEST {
        let message = format!("the craft is {} m long, so the model is probably not in metres", short(extent));
        findings.push(of_size(message, "glTF is in metres: export it again in metres, or scale its root node"));
    }
    let inward = |shape: &&PartShape| shape.volume < -FLAT * shape.area.powf(1.5) && is_closed(prepared, shape);
    let inward: Vec<&PartShape> = shapes.iter().filter(inward).collect();
    if !inward.is_empty() {
        findings.push(Finding {
            check: "normals",
            about: named("part", &parts(prepared, &inward)),
            message: "the triangles of a closed body face inward, so its inside is lit and seen".to_owned(),
            remedy: "flip the normals in the modelling program (in Blender: Mesh, Normals, Recalculate Outside)"
                .to_owned(),
        });
    }
    findings.extend(find_closed_sheets(prepared, shapes));
    let against: Vec<&PartShape> = shapes.iter().filter(|shape| shape.against > 0.5 * shape.area).collect();
    if !against.is_empty() {
        findings.push(Finding {
            check: "normals",
            about: named("part", &parts(prepared, &against)),
            message: "most normals point to the back of their triangles, so the wrong side is lit".to_owned(),
            remedy: "recalculate the normals in the modelling program, or export without them".to_owned(),
        });
    }
    findings
}
