//! The response functions of a scene that are no powers, as the device has them: GLSL text, and pieces of long tables and of paces.

use super::shape_text::{self, Firsts};
use super::variant::{Curve, Shaped, StepKind};
use crate::thermal::function::Function;
use crate::thermal::material::{Domain, Material, Response, Retarget, Transition};

/// vec4s at whose multiples the pieces of a table begin.
const ALIGNMENT: usize = 16;

/// What is read in pieces.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Piecewise {
    Function,
    Pace,
}

/// The functions of the shaped transitions of a scene.
#[derive(Debug, Clone, Default)]
pub struct Shapes {
    /// Text of each pair, by its number.
    texts: Vec<(u32, String)>,
    /// Pieces in `values`: of which function, of what of it, and where.
    places: Vec<(Function, Piecewise, usize)>,
    /// Pieces that the shaders read; empty where none does.
    pub values: Vec<[f32; 4]>,
}

impl Shapes {
    /// The functions that the materials use.
    pub fn of(materials: &[Material]) -> Self {
        let mut shapes = Self::default();
        for (index, material) in materials.iter().enumerate() {
            if let Response::Transition(transition) = &material.response
                && Transition::first_like(materials, index) == Some(index as u32)
            {
                shapes.add(index as u32, transition);
            }
        }
        shapes
    }

    /// The functions of one transition, as number 0.
    pub fn one(transition: &Transition) -> Self {
        let mut shapes = Self::default();
        if !transition.is_power() {
            shapes.add(0, transition);
        }
        shapes
    }

    fn add(&mut self, number: u32, transition: &Transition) {
        let firsts = [&transition.heating.function, &transition.cooling.function].map(|function| Firsts {
            cubics: self.place(function, Piecewise::Function),
            pace: if transition.retarget == Retarget::Merge { self.place(function, Piecewise::Pace) } else { 0 },
        });
        self.texts.push((number, shape_text::pair(transition, firsts)));
    }

    /// Where pieces of a function begin; 0 where there are none.
    fn place(&mut self, function: &Function, of: Piecewise) -> usize {
        let Some(cells) = pieces(function, of) else { return 0 };
        if let Some((.., place)) = self.places.iter().find(|(known, what, _)| known == function && *what == of) {
            return *place;
        }
        let place = self.values.len();
        self.values.extend(cells.iter().map(|cell| cell.map(|c| c as f32)));
        self.values.resize(self.values.len().next_multiple_of(ALIGNMENT), [0.0; 4]);
        self.places.push((function.clone(), of, place));
        place
    }

    /// GLSL of the functions of a curve; empty where there are none.
    pub fn text(&self, curve: Curve) -> &str {
        let Curve::Shaped(shaped) = curve else { return "" };
        self.texts.iter().find(|(number, _)| *number == shaped.number).map_or("", |(_, text)| text)
    }
}

/// What moves along a transition, and how; `number` is that of its pair of functions.
pub fn curve(transition: &Transition, number: u32) -> (StepKind, Curve) {
    let kind = match transition.retarget {
        Retarget::Merge => StepKind::Merge,
        Retarget::Restart => StepKind::Restart,
    };
    if transition.is_power() {
        return (kind, Curve::Power);
    }
    let functions = [&transition.heating.function, &transition.cooling.function];
    let shaped = Shaped {
        number,
        fourth_power: transition.domain == Domain::FourthPower,
        pieces: functions.iter().any(|function| pieces(function, Piecewise::Function).is_some()),
        paced: kind == StepKind::Merge && functions.iter().any(|function| pieces(function, Piecewise::Pace).is_some()),
    };
    (kind, Curve::Shaped(shaped))
}

fn pieces(function: &Function, of: Piecewise) -> Option<&[[f64; 4]]> {
    let Function::Shaped(shape) = function else { return None };
    match of {
        Piecewise::Function => shape.cubics().map(|cubics| cubics.cells.as_slice()),
        Piecewise::Pace => shape.pace().filter(|pace| !pace.is_of_a_power()).map(|pace| pace.cells.as_slice()),
    }
}
