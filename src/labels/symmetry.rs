//! Turns after which an object of BOP looks the same, and whether its mesh does (docs/bop_datasets_format.md of bop_toolkit, "models_info.json").

use std::f64::consts::TAU;

use glam::{DAffine3, DMat3, DVec3};
use rayon::prelude::*;

use super::craft::{BopObject, Craft, Symmetries};
use super::key_points::corners;
use super::ply::diameter;

/// Most turns of an object. A finite group of more than 60 rotations is cyclic or dihedral.
const MOST: usize = 240;
/// Largest difference between the numbers of two rotations that are taken for the same one, for axes that are written with few digits.
const SAME: f64 = 1e-4;
/// Vertices of an object that are turned besides the corners of its parts, at most.
const VERTICES: usize = 512;
/// Turns by which a continuous axis is looked at: multiples of the golden angle, of which none is near a share of the circle.
const LOOKS: u32 = 8;
/// The golden angle, as a share of the circle.
const GOLDEN: f64 = 0.381_966_011_250_105;

/// Which turns about an axis leave an object as it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum SymmetryTurns {
    /// The turns by this share of the circle and its multiples.
    Share(u32),
    Any,
}

/// A symmetry as somebody states it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Symmetry {
    /// The object. `None` for the craft, or for its body where it has joints.
    pub(crate) object: Option<String>,
    /// Unit vector along the axis, body frame.
    pub(crate) axis: DVec3,
    /// A point of the axis, body frame [m].
    pub(crate) origin: DVec3,
    pub(crate) turns: SymmetryTurns,
    /// Greatest distance of a turned vertex from the mesh, as a share of the object's diameter.
    pub(crate) tolerance: f64,
}

/// Why a symmetry can not be.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(crate) enum SymmetryError {
    #[error("[[symmetry]] names the object '{object}', and the objects are: {known}")]
    Object {
        object: String,
        /// The objects that there are.
        known: String,
    },
    #[error(
        "[[symmetry]] gives the object '{object}' two continuous axes: only a sphere has more than one, for which BOP has no words"
    )]
    TwoAxes { object: String },
    #[error(
        "[[symmetry]] turns the continuous axis of the object '{object}' into another one: besides it, only half turns about axes that cross it at \
         right angles leave it as it is"
    )]
    MovesAxis { object: String },
    #[error(
        "the axes of [[symmetry]] do not fit together for the object '{object}': one turn after another gives more than {MOST} different ones. They \
         must cross in one point, at the angles of a regular body, with at least five digits"
    )]
    Endless { object: String },
    /// A mesh that is another after a turn.
    #[error(
        "the object '{object}' is not the same after a turn of {angle:.1} deg about [{}, {}, {}]: the vertex at [{:.4}, {:.4}, {:.4}] m then lies \
         {distance:.4} m beside its mesh, which is {share:.4} of its diameter; [[symmetry]] allows {tolerance} (tolerance)",
        axis.x, axis.y, axis.z, vertex.x, vertex.y, vertex.z
    )]
    Another {
        object: String,
        axis: DVec3,
        /// The turn [deg].
        angle: f64,
        /// The vertex that comes to lie farthest from the mesh [m].
        vertex: DVec3,
        /// Distance of that vertex from the mesh after the turn [m].
        distance: f64,
        /// The same as a share of the object's diameter.
        share: f64,
        /// The greatest share that is allowed.
        tolerance: f64,
    },
}

impl Symmetry {
    /// The turn by a share of the circle.
    fn turn(&self, share: f64) -> DAffine3 {
        let (x, y, z) = self.axis.into();
        let (sine, cosine) = (libm::sin(TAU * share), libm::cos(TAU * share));
        // Rodrigues' formula, column by column.
        let cross = DMat3::from_cols(DVec3::new(0.0, z, -y), DVec3::new(-z, 0.0, x), DVec3::new(y, -x, 0.0));
        let along = DMat3::from_cols(self.axis * x, self.axis * y, self.axis * z);
        let turn = DMat3::IDENTITY * cosine + cross * sine + along * (1.0 - cosine);
        DAffine3::from_mat3_translation(turn, self.origin - turn * self.origin)
    }

    fn object_in(&self, objects: &[BopObject]) -> Result<BopObject, SymmetryError> {
        let object = match &self.object {
            None => objects.first(),
            Some(name) => objects.iter().find(|object| object.name == *name),
        };
        object.cloned().ok_or_else(|| SymmetryError::Object {
            object: self.object.clone().unwrap_or_default(),
            known: objects.iter().map(|object| object.name.as_str()).collect::<Vec<_>>().join(", "),
        })
    }
}

/// The symmetries of the objects of a craft, with all turns that follow from the stated turns.
///
/// # Errors
/// An object that does not exist, or turns that do not fit together.
pub(crate) fn symmetries(craft: &Craft, stated: &[Symmetry]) -> Result<Vec<Symmetries>, SymmetryError> {
    let objects = craft.objects();
    let with_object = stated.iter().map(|one| Ok((one.object_in(&objects)?, one)));
    let with_object = with_object.collect::<Result<Vec<_>, SymmetryError>>()?;
    let mut all = Vec::new();
    for object in &objects {
        let stated_here: Vec<&Symmetry> =
            with_object.iter().filter(|(symmetric, _)| symmetric == object).map(|(_, one)| *one).collect();
        if stated_here.is_empty() {
            continue;
        }
        let mut continuous =
            stated_here.iter().filter(|one| one.turns == SymmetryTurns::Any).map(|one| [one.axis, one.origin]);
        let axis = continuous.next();
        if continuous.next().is_some() {
            return Err(SymmetryError::TwoAxes { object: object.name.clone() });
        }
        let share = |one: &&Symmetry| match one.turns {
            SymmetryTurns::Share(count) => Some(one.turn(1.0 / f64::from(count))),
            SymmetryTurns::Any => None,
        };
        let turns: Vec<DAffine3> = stated_here.iter().filter_map(share).collect();
        let size = stated_here.iter().map(|one| one.origin.length()).fold(0.0, f64::max);
        if let Some([axis, origin]) = axis {
            let keeps = |turn: &DAffine3| {
                let beside = axis.cross(turn.transform_point3(origin) - origin).length();
                axis.cross(turn.matrix3 * axis).length() <= SAME && beside <= SAME * size
            };
            if !turns.iter().all(keeps) {
                return Err(SymmetryError::MovesAxis { object: object.name.clone() });
            }
        }
        let discrete = group(&turns, size).ok_or_else(|| SymmetryError::Endless { object: object.name.clone() })?;
        all.push(Symmetries { object: object.id, discrete, continuous: axis });
    }
    Ok(all)
}

/// All turns that follow from `turns`, made one after another, without the identity. `size` is the distance of the farthest origin [m]. `None` where
/// there is no end.
fn group(turns: &[DAffine3], size: f64) -> Option<Vec<DAffine3>> {
    let same = |a: &DAffine3, b: &DAffine3| {
        a.matrix3.abs_diff_eq(b.matrix3, SAME) && a.translation.distance(b.translation) <= SAME * size
    };
    let mut all = vec![DAffine3::IDENTITY];
    let mut next = 0;
    while next < all.len() {
        for turn in turns {
            let product = *turn * all[next];
            if !all.iter().any(|known| same(known, &product)) {
                all.push(product);
            }
        }
        if all.len() > MOST {
            return None;
        }
        next += 1;
    }
    all.remove(0);
    Some(all)
}

/// Turns the corners of the parts and some other vertices of each object, and looks how far they then lie from its mesh.
///
/// # Errors
/// An object that is another after a turn.
pub(crate) fn check(craft: &Craft, stated: &[Symmetry]) -> Result<(), SymmetryError> {
    let objects = craft.objects();
    for one in stated {
        let object = one.object_in(&objects)?;
        let triangles = craft.triangles_of(&object);
        let mut vertices: Vec<u32> = triangles.iter().flatten().copied().collect();
        vertices.sort_unstable();
        vertices.dedup();
        let place = |vertex: &u32| craft.positions[*vertex as usize];
        let diameter = diameter(&vertices.iter().map(place).collect::<Vec<_>>());
        let is_of_object = |vertex: &u32| craft.is_of(&object, *vertex);
        let stride = vertices.len().div_ceil(VERTICES).max(1);
        let points: Vec<DVec3> = corners(craft)
            .iter()
            .filter(|vertex| is_of_object(vertex))
            .chain(vertices.iter().step_by(stride))
            .map(place)
            .collect();
        let shares: Vec<f64> = match one.turns {
            SymmetryTurns::Share(count) => vec![1.0 / f64::from(count)],
            SymmetryTurns::Any => (1..=LOOKS).map(|look| (f64::from(look) * GOLDEN).fract()).collect(),
        };
        for share in shares {
            let turn = one.turn(share);
            let far = points.par_iter().filter_map(|point| {
                let distance = beside(craft, &triangles, turn.transform_point3(*point), one.tolerance * diameter);
                distance.map(|distance| (distance, *point))
            });
            let farthest = far.max_by(|a, b| a.0.total_cmp(&b.0));
            if let Some((distance, vertex)) = farthest {
                return Err(SymmetryError::Another {
                    object: object.name,
                    axis: one.axis,
                    angle: 360.0 * share,
                    vertex,
                    distance,
                    share: distance / diameter,
                    tolerance: one.tolerance,
                });
            }
        }
    }
    Ok(())
}

/// Distance of a place from the nearest of some triangles [m]. `None` where it is not above `least`.
fn beside(craft: &Craft, triangles: &[[u32; 3]], place: DVec3, least: f64) -> Option<f64> {
    let mut nearest = f64::INFINITY;
    for triangle in triangles {
        nearest = nearest.min(from_triangle(place, triangle.map(|vertex| craft.positions[vertex as usize])));
        if nearest <= least {
            return None;
        }
    }
    Some(nearest)
}

/// Distance of a place from a triangle [m].
fn from_triangle(place: DVec3, corners: [DVec3; 3]) -> f64 {
    let [a, b, c] = corners;
    let normal = (b - a).cross(c - a);
    let sides = [[a, b], [b, c], [c, a]];
    let within = |[from, to]: [DVec3; 2]| normal.dot((to - from).cross(place - from)) >= 0.0;
    if normal != DVec3::ZERO && sides.into_iter().all(within) {
        return normal.dot(place - a).abs() / normal.length();
    }
    let from_side = |[from, to]: [DVec3; 2]| {
        let along =
            ((place - from).dot(to - from) / (to - from).length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        (from + (to - from) * along).distance(place)
    };
    sides.into_iter().map(from_side).fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    /// A bar of 4 by 2 by 2 m round a place, along X.
    fn bar(middle: DVec3) -> Craft {
        let corner = |number: u32| {
            let sign = |bit: u32| if number >> bit & 1 == 0 { -1.0 } else { 1.0 };
            middle + DVec3::new(2.0 * sign(0), sign(1), sign(2))
        };
        let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        Craft {
            name: "bar".to_owned(),
            parts: vec!["bar".to_owned()],
            materials: vec!["paint".to_owned()],
            links: vec!["body".to_owned()],
            link_of_part: vec![0],
            positions: (0..8).map(corner).collect(),
            normals: vec![Vec3::Z; 8],
            vertex_part: vec![0; 8],
            triangles: faces.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect(),
            key_points: Vec::new(),
            symmetries: Vec::new(),
            targets: Vec::new(),
        }
    }

    fn about(axis: DVec3, turns: SymmetryTurns) -> Symmetry {
        Symmetry { object: None, axis, origin: DVec3::ZERO, turns, tolerance: 0.01 }
    }

    #[test]
    fn turns_of_two_axes_give_the_whole_group() {
        let count = |stated: &[Symmetry]| symmetries(&bar(DVec3::ZERO), stated).map(|all| all[0].discrete.len() + 1);
        let [x, y, z] = DVec3::AXES;
        assert_eq!(count(&[about(x, SymmetryTurns::Share(4))]), Ok(4));
        // The rotations of a square prism, of a box, of a cube and of an icosahedron (Coxeter, Regular Polytopes, 3.8).
        assert_eq!(count(&[about(x, SymmetryTurns::Share(4)), about(z, SymmetryTurns::Share(2))]), Ok(8));
        assert_eq!(count(&[about(x, SymmetryTurns::Share(2)), about(y, SymmetryTurns::Share(2))]), Ok(4));
        assert_eq!(count(&[about(x, SymmetryTurns::Share(4)), about(z, SymmetryTurns::Share(4))]), Ok(24));
        let five = DVec3::new(0.0, 1.0, 0.5 * (1.0 + 5.0_f64.sqrt())).normalize();
        assert_eq!(count(&[about(five, SymmetryTurns::Share(5)), about(z, SymmetryTurns::Share(2))]), Ok(60));
        // An axis 1 deg off, and one beside the other.
        let off = DVec3::new(1.0_f64.to_radians().sin(), 0.0, 1.0_f64.to_radians().cos());
        let endless = Err(SymmetryError::Endless { object: "bar".to_owned() });
        assert_eq!(count(&[about(x, SymmetryTurns::Share(4)), about(off, SymmetryTurns::Share(4))]), endless);
        let beside = Symmetry { origin: y, ..about(x, SymmetryTurns::Share(2)) };
        assert_eq!(count(&[about(x, SymmetryTurns::Share(2)), beside]), endless);
    }

    #[test]
    fn a_continuous_axis_stays_where_it_is() {
        let of = |stated: &[Symmetry]| symmetries(&bar(DVec3::ZERO), stated);
        let [x, y, _] = DVec3::AXES;
        let all = of(&[about(x, SymmetryTurns::Any), about(y, SymmetryTurns::Share(2))]).expect("a cylinder");
        assert_eq!((all[0].discrete.len(), all[0].continuous), (1, Some([x, DVec3::ZERO])));
        assert!(matches!(
            of(&[about(x, SymmetryTurns::Any), about(y, SymmetryTurns::Share(4))]),
            Err(SymmetryError::MovesAxis { .. })
        ));
        let shifted = Symmetry { origin: y, ..about(x, SymmetryTurns::Share(2)) };
        assert!(matches!(of(&[about(x, SymmetryTurns::Any), shifted]), Err(SymmetryError::MovesAxis { .. })));
        assert!(matches!(
            of(&[about(x, SymmetryTurns::Any), about(y, SymmetryTurns::Any)]),
            Err(SymmetryError::TwoAxes { .. })
        ));
        let named = Symmetry { object: Some("wing".to_owned()), ..about(x, SymmetryTurns::Any) };
        let error = of(&[named]).expect_err("no wing").to_string();
        assert_eq!(error, "[[symmetry]] names the object 'wing', and the objects are: bar");
    }

    #[test]
    fn a_turn_that_the_mesh_does_not_have_is_found() {
        let middle = DVec3::new(0.0, 3.0, 1.0);
        let [x, y, z] = DVec3::AXES;
        let at = |axis, turns| Symmetry { origin: middle, ..about(axis, turns) };
        let craft = bar(middle);
        for right in [at(x, SymmetryTurns::Share(4)), at(y, SymmetryTurns::Share(2)), at(z, SymmetryTurns::Share(2))] {
            assert_eq!(check(&craft, &[right]), Ok(()));
        }
        // A quarter turn about Y takes the ends of the bar 1 m beyond its long faces.
        let Err(SymmetryError::Another { angle, distance, share, .. }) =
            check(&craft, &[at(y, SymmetryTurns::Share(4))])
        else {
            panic!("the bar is not the same after a quarter turn");
        };
        assert_eq!(angle, 90.0);
        assert!((distance - 1.0).abs() < 1e-12 && (share - 1.0 / 24.0_f64.sqrt()).abs() < 1e-12, "{distance}, {share}");
        // A prism of four sides is no cylinder: its edge lies up to 2^0.5 - 1 m beside a face.
        let Err(SymmetryError::Another { distance, .. }) = check(&craft, &[at(x, SymmetryTurns::Any)]) else {
            panic!("the bar is no cylinder");
        };
        assert!((0.3..0.4143).contains(&distance), "{distance}");
        assert_eq!(check(&craft, &[Symmetry { tolerance: 0.09, ..at(x, SymmetryTurns::Any) }]), Ok(()));
        // About an axis elsewhere.
        assert!(check(&craft, &[about(x, SymmetryTurns::Share(4))]).is_err());
    }

    #[test]
    fn the_distance_from_a_triangle_is_that_of_its_nearest_point() {
        let corners = [DVec3::ZERO, DVec3::X, DVec3::Y];
        for (place, expected) in [
            ([0.2, 0.2, -3.0], 3.0),
            ([-3.0, -4.0, 0.0], 5.0),
            ([0.5, -2.0, 0.0], 2.0),
            ([1.0, 1.0, 0.0], 0.5_f64.sqrt()),
            ([4.0, 0.0, 4.0], 5.0),
        ] {
            assert!((from_triangle(DVec3::from(place), corners) - expected).abs() < 1e-15, "{place:?}");
        }
        // Without an area it is an edge.
        assert_eq!(from_triangle(DVec3::Y, [DVec3::ZERO, DVec3::X, DVec3::ZERO]), 1.0);
    }
}
