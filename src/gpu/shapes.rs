//! Straight pieces of a scene's shaped response functions, in one buffer.

use super::effects::thermal::variant::{Curve, StepKind};
use crate::thermal::function::Function;
use crate::thermal::material::{Domain, Material, Response, Retarget, Transition};

/// The shaped response functions of a scene.
#[derive(Debug, Clone, Default)]
pub struct Shapes {
    /// Functions, each with its result of `place`.
    places: Vec<(Function, f32)>,
    /// Pieces for the shaders, empty without shaped functions.
    pub values: Vec<[f32; 2]>,
}

impl Shapes {
    /// The functions of the materials.
    pub fn of(materials: &[Material]) -> Self {
        let mut shapes = Self::default();
        for material in materials {
            if let Response::Transition(transition) = &material.response {
                shapes.add(transition);
            }
        }
        shapes
    }

    /// The functions of one transition.
    pub fn one(transition: &Transition) -> Self {
        let mut shapes = Self::default();
        shapes.add(transition);
        shapes
    }

    fn add(&mut self, transition: &Transition) {
        for function in [&transition.heating.function, &transition.cooling.function] {
            if !transition.is_power() && self.places.iter().all(|(known, _)| known != function) {
                self.places.push((function.clone(), self.values.len() as f32));
                self.values.extend(function.pieces().cells);
            }
        }
    }

    /// Index of a function's first piece, 0 without pieces.
    pub(crate) fn place(&self, function: &Function) -> f32 {
        self.places.iter().find(|(known, _)| known == function).map_or(0.0, |(_, place)| *place)
    }
}

/// Shader variant of a transition.
pub fn curve(transition: &Transition) -> (StepKind, Curve) {
    let kind = match transition.retarget {
        Retarget::Merge => StepKind::Merge,
        Retarget::Restart => StepKind::Restart,
    };
    let fourth_power = transition.domain == Domain::FourthPower;
    (kind, if transition.is_power() { Curve::Power } else { Curve::Shaped { fourth_power } })
}
