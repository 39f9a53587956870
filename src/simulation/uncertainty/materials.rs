//! What a surface absorbs, emits, stores and conducts, as the carried errors need it.

use std::collections::HashMap;

use crate::scene::Time;
use crate::thermal::balance::emissivity_sum;
use crate::thermal::material::{Material, Response, Sides};

/// What a place remembers of its past.
#[derive(Debug, Clone, Copy)]
pub(super) enum Memory {
    /// Heat capacity [J m-2 K-1]. 0 follows its load at once.
    Capacity(f64),
    /// Mean time of a transition to its target [s].
    Time(f64),
}

impl Memory {
    /// Step of a length [s] over the time constant, for a slope [W m-2 K-1].
    pub(super) fn rate(self, length: f64, slope: f64) -> f64 {
        let time = match self {
            Self::Capacity(capacity) => capacity / slope,
            Self::Time(time) => time,
        };
        if time > 0.0 { length / time } else { f64::INFINITY }
    }
}

/// Values of a material.
#[derive(Debug, Clone, Copy)]
pub(super) struct SurfaceConstants {
    /// Absorptivity of front and back. The back of a surface with one face has 0.
    pub(super) absorptivities: [f64; 2],
    /// Sum of the emissivities of the faces.
    pub(super) emissivity: f64,
    pub(super) memory: Memory,
    /// Conductivity times thickness [W/K]. 0 outside a network.
    pub(super) conductance: f64,
}

impl SurfaceConstants {
    pub(super) fn of(material: &Material, time: &Time) -> Self {
        let back = match material.sides {
            Sides::Outside => 0.0,
            Sides::Both { back } => back.absorptivity,
        };
        let capacity = material.bulk.capacity_per_area().unwrap_or(0.0);
        let memory = match &material.response {
            Response::Instant | Response::Given => Memory::Capacity(0.0),
            Response::Radiative(plate) => Memory::Capacity(plate.capacity),
            Response::Network => Memory::Capacity(capacity),
            // A quadratic curve reaches its target in the mean after a third of its time.
            Response::Transition(curve) => {
                let both = curve.heating.duration() + curve.cooling.duration();
                Memory::Time(0.5 * both * time.step / 3.0)
            }
        };
        let conducts = matches!(material.response, Response::Network);
        let sheet = material.bulk.conductivity.unwrap_or(0.0) * material.bulk.thickness.unwrap_or(0.0);
        Self {
            absorptivities: [material.front.absorptivity, back],
            emissivity: emissivity_sum(material),
            memory,
            conductance: if conducts { sheet } else { 0.0 },
        }
    }
}

/// Number of edges of one triangle only at each of `count` nodes: 0 inside a surface.
pub(super) fn borders(triangles: &[[u32; 3]], count: usize) -> Vec<u32> {
    let mut uses: HashMap<[u32; 2], u32> = HashMap::with_capacity(3 * triangles.len() / 2);
    for triangle in triangles {
        for place in 0..3 {
            let [a, b] = [triangle[place], triangle[(place + 1) % 3]];
            *uses.entry([a.min(b), a.max(b)]).or_default() += 1;
        }
    }
    let mut borders = vec![0; count];
    for (edge, _) in uses.into_iter().filter(|(_, uses)| *uses == 1) {
        edge.iter().for_each(|node| borders[*node as usize] += 1);
    }
    borders
}
