//! Response functions that are no powers, as the shaders read them (glsl/shape.glsl).

use crate::thermal::function::{Function, Point, cubics::CELLS, cubics::Cubics, cubics::MAX_TURNS};
use crate::thermal::material::{Material, Response, Transition};

/// vec4s of one function: head, pieces, turns, and room to a round number.
const STRIDE: usize = 4160;
const _: () = assert!(STRIDE >= 1 + CELLS + MAX_TURNS && STRIDE.is_multiple_of(16));

/// The functions of all shaped transitions of a scene, each once, by number.
#[derive(Debug, Clone, Default)]
pub struct Shapes {
    functions: Vec<Function>,
    /// What the shaders read.
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

    /// Adds the functions of a transition, where it is shaped.
    pub fn add(&mut self, transition: &Transition) {
        if !transition.is_power() {
            for function in [&transition.heating.function, &transition.cooling.function] {
                if !self.functions.contains(function) {
                    self.functions.push(function.clone());
                    self.values.extend(shape(function));
                }
            }
        }
    }

    /// What a shader knows the heating and the cooling function of a transition by: powers, or numbers of shapes.
    pub fn functions(&self, transition: &Transition) -> [f32; 2] {
        [&transition.heating.function, &transition.cooling.function].map(|function| {
            let number = || self.functions.iter().position(|known| known == function).unwrap_or_default() as f32;
            if transition.is_power() { function.power().map_or_else(number, |power| power as f32) } else { number() }
        })
    }
}

/// Head, pieces and turns of a function.
fn shape(function: &Function) -> Vec<[f32; 4]> {
    let of_power;
    let (cubics, turns) = match function {
        Function::Shaped(shape) => (shape.cubics(), shape.turns()),
        Function::Linear | Function::Quadratic => {
            of_power = Cubics::new(&|r| function.at(r));
            (&of_power, [].as_slice())
        }
    };
    let mut values = vec![[cubics.warp as f32, function.at(1.0).rate as f32, turns.len() as f32, 0.0]];
    values.extend(cubics.cells.iter().map(|cell| cell.map(|c| c as f32)));
    values.extend(turns.iter().map(|&r| {
        let Point { left, rate } = function.at(r);
        [r as f32, (rate / (left + rate)) as f32, 0.0, 0.0]
    }));
    values.resize(STRIDE, [0.0; 4]);
    values
}
