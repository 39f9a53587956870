//! A moment of the past: the shadows, and what foil absorbs there.

use std::sync::Arc;

use glam::{DAffine3, DVec3};
use rayon::prelude::*;

use super::disc::{SunShape, free_share};
use super::surface::{FoilNode, FoilSurface};
use crate::environment::StepLoad;
use crate::environment::load::solar_flux;
use crate::environment::shadow::{JointTrees, LitArea, LitAreas, NodesInSun};
use crate::thermal::balance::{Incident, absorbed_flux};
use crate::thermal::incident::incident;
use crate::thermal::material::Material;

/// Kinds of light of a node: none, part of what it had if nothing hid the Sun, and all of it.
pub(super) const DARK: u8 = 0;
const PART: u8 = 1;
pub(super) const LIT: u8 = 2;
/// Difference of lit areas that is rounding.
const ROUNDING: f64 = 1e-6;

/// What a node of foil absorbs [W/m2].
#[derive(Debug, Clone, Copy)]
pub(super) struct NodeLight {
    /// Sunlight if nothing hid the Sun.
    pub(super) open: f32,
    /// Light of the planet.
    pub(super) planet: f32,
    /// Light of Sun and planet as the node takes it, together with nodes that have one temperature with it.
    pub(super) shown: f32,
    pub(super) lit: u8,
}

/// Sun and joints of an interval.
pub(super) struct SunRays {
    sun: DVec3,
    /// Poses of the joints, and their inverses.
    poses: Vec<[DAffine3; 2]>,
}

/// Sun and joints at a quarter, the half and three quarters of the way between two moments, where they are known.
pub(super) type Quarters = Option<[SunRays; 3]>;

/// Turn of the Sun from one moment to the next [rad] from which on nothing is known of the time between them.
const FAR: f64 = 0.5;

impl SunRays {
    /// Sun and joints at a share of the time between two others. A rotation by a small angle is nearly the straight line.
    fn between(from: &Self, to: &Self, share: f64) -> Self {
        let mix = |[from, _]: &[DAffine3; 2], [to, _]: &[DAffine3; 2]| {
            let [from, to] = [from, to].map(DAffine3::to_cols_array);
            let pose = DAffine3::from_cols_array(&std::array::from_fn(|k| from[k] + share * (to[k] - from[k])));
            [pose, pose.inverse()]
        };
        let poses = from.poses.iter().zip(&to.poses).map(|(from, to)| mix(from, to)).collect();
        Self { sun: from.sun.lerp(to.sun, share).normalize(), poses }
    }

    /// Share of the Sun that a place of a joint (in its frame) sees past triangles from one of its sides. `side` is a unit normal there.
    pub(super) fn share(
        &self,
        trees: &JointTrees,
        (place, joint): (DVec3, u32),
        (side, both_sides): (DVec3, bool),
        shape: SunShape,
    ) -> f64 {
        let Self { sun, poses } = self;
        let [pose, _] = poses.get(joint as usize).copied().unwrap_or([DAffine3::IDENTITY; 2]);
        let outward = pose.matrix3 * side;
        let cosine = outward.dot(*sun);
        if cosine == 0.0 || (cosine < 0.0 && !both_sides) {
            return 0.0;
        }
        let start = pose.transform_point3(place) + trees.start * outward * cosine.signum();
        let frame = |joint: usize| poses.get(joint).map(|[_, frame]| frame);
        free_share(*sun, shape, |direction| !trees.hide(start, direction, f64::INFINITY, frame))
    }
}

/// The shadows of an interval.
pub(super) struct Shadows {
    /// `None` in the dark.
    rays: Option<Arc<SunRays>>,
    /// Lit area of each node of foil, and the same if nothing hid the Sun. Empty in the dark.
    areas: Vec<[LitArea; 2]>,
    found_for: Vec<u64>,
}

/// An interval of the past.
pub(super) struct Moment {
    pub(super) key: Vec<u64>,
    /// Its length [s].
    pub(super) length: f64,
    pub(super) nodes: Vec<NodeLight>,
    /// Fourth power of the temperature of space [K4].
    pub(super) space: f64,
    rays: Option<Arc<SunRays>>,
}

/// Bits of a load: Sun, planet, and poses.
fn bits(load: &StepLoad) -> Vec<u64> {
    let sun = load.sun.iter().flat_map(|sample| (sample.direction * sample.flux).to_array());
    let nadir = load.planet.iter().flat_map(|planet| planet.nadir.to_array());
    let poses = load.joints.iter().flat_map(DAffine3::to_cols_array);
    sun.chain(nadir).chain(poses).map(f64::to_bits).collect()
}

impl Shadows {
    /// The shadows of a load on nodes at these places among the nodes of the light.
    pub(super) fn new(light: &LitAreas, places: &[usize], load: &StepLoad) -> Self {
        let found_for = bits(load);
        let Some(NodesInSun { sun, poses, areas }) = light.beside(load, places) else {
            return Self { rays: None, areas: Vec::new(), found_for };
        };
        let poses = poses.iter().map(|pose| [*pose, pose.inverse()]).collect();
        Self { rays: Some(Arc::new(SunRays { sun, poses })), areas, found_for }
    }

    /// Whether they belong to a load.
    pub(super) fn are_of(&self, load: &StepLoad) -> bool {
        self.found_for == bits(load)
    }
}

impl Moment {
    pub(super) fn key(load: &StepLoad, whole: &StepLoad, end: f64) -> Vec<u64> {
        let times = [load.start.to_bits(), end.to_bits()];
        times.into_iter().chain(bits(load)).chain(bits(whole)).collect()
    }

    /// What foil absorbs under a load.
    pub(super) fn new(
        surface: &FoilSurface,
        materials: &[Material],
        load: &StepLoad,
        shadows: &Shadows,
        (key, length): (Vec<u64>, f64),
    ) -> Self {
        let light = |(number, node): (usize, &FoilNode)| {
            let material = &materials[node.material as usize];
            let frame = load.joint_from_body(node.joint).transpose();
            let normal = frame * node.normal;
            let planet = |normal: DVec3| Incident { solar: 0.0, ..incident(load, normal) };
            let planet =
                load.planet.as_ref().map_or(0.0, |_| absorbed_flux(material, planet(normal), || planet(-normal)));
            let [own, open] = shadows.areas.get(number).copied().unwrap_or([LitArea::default(); 2]);
            let absorbed = |area: LitArea| {
                let flux = solar_flux(load, frame * area.vector);
                let back = material.back().absorptivity;
                flux * (area.front * material.front.absorptivity + (1.0 - area.front) * back)
            };
            let lit = match own.vector {
                vector if vector.abs_diff_eq(open.vector, ROUNDING) => LIT,
                DVec3::ZERO => DARK,
                _ => PART,
            };
            let (open, own) = (absorbed(open), absorbed(own));
            NodeLight { open: open as f32, planet: planet as f32, shown: (own + planet) as f32, lit }
        };
        let mut nodes: Vec<NodeLight> = surface.nodes.par_iter().enumerate().map(light).collect();
        let mut shown: Vec<f32> = nodes.iter().map(|node| node.shown).collect();
        surface.share(&mut shown);
        nodes.iter_mut().zip(shown).for_each(|(node, shown)| node.shown = shown);
        Self { key, length, nodes, space: load.background_temperature.powi(4), rays: shadows.rays.clone() }
    }

    /// Sun and joints at a quarter, the half and three quarters of the way from the middle of this moment to the middle of the next. `None` in the dark, and where the Sun jumps.
    pub(super) fn quarters(&self, next: &Self) -> Quarters {
        let [own, other] = [self.rays.as_deref()?, next.rays.as_deref()?];
        let goes = self.length > 0.0 && next.length > 0.0 && own.sun.angle_between(other.sun) < FAR;
        goes.then(|| [0.25, 0.5, 0.75].map(|share| SunRays::between(own, other, share)))
    }

    /// Whether the Sun stands behind a surface of a joint, whose front has this normal in the frame of the joint.
    pub(super) fn is_behind(&self, joint: u32, front: DVec3) -> bool {
        let Some(SunRays { sun, poses }) = self.rays.as_deref() else { return false };
        let [pose, _] = poses.get(joint as usize).copied().unwrap_or([DAffine3::IDENTITY; 2]);
        (pose.matrix3 * front).dot(*sun) < 0.0
    }

    /// See [`SunRays::share`]. 0 in the dark.
    pub(super) fn sun_share(
        &self,
        trees: &JointTrees,
        place: (DVec3, u32),
        sides: (DVec3, bool),
        shape: SunShape,
    ) -> f64 {
        self.rays.as_deref().map_or(0.0, |rays| rays.share(trees, place, sides, shape))
    }
}
