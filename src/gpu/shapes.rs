//! The response functions of a scene that are no powers, as the device has them: pieces in one buffer.

use super::variant::{Curve, StepKind};
use crate::thermal::function::Function;
use crate::thermal::function::pieces::FEWEST;
use crate::thermal::material::{Domain, Material, Response, Retarget, Transition};

/// The functions of the shaped transitions of a scene.
#[derive(Debug, Clone, Default)]
pub struct Shapes {
    /// Functions, and what says where their pieces are.
    places: Vec<(Function, f32)>,
    /// Pieces that the shaders read; empty where none does.
    pub values: Vec<[f32; 4]>,
}

impl Shapes {
    /// The functions that the materials use.
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
                let cells = function.pieces().cells;
                let doublings = (cells.len() / (2 * FEWEST)).ilog2() as usize;
                let place = self.values.len() / (2 * FEWEST) * 16 + doublings;
                self.places.push((function.clone(), place as f32));
                self.values.extend(cells);
            }
        }
    }

    /// Where the pieces of a function are: 16 times the place of the first, in units of the fewest that a function has, and how
    /// often it has twice as many. 0 of a function without pieces.
    pub fn place(&self, function: &Function) -> f32 {
        self.places.iter().find(|(known, _)| known == function).map_or(0.0, |(_, place)| *place)
    }
}

/// What moves along a transition, and how.
pub fn curve(transition: &Transition) -> (StepKind, Curve) {
    let kind = match transition.retarget {
        Retarget::Merge => StepKind::Merge,
        Retarget::Restart => StepKind::Restart,
    };
    let fourth_power = transition.domain == Domain::FourthPower;
    (kind, if transition.is_power() { Curve::Power } else { Curve::Shaped { fourth_power } })
}
