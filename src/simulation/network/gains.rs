//! The heat of a network's nodes by conductors and heaters.

use super::{NetworkRun, SceneNetwork};

/// Gains of the network's nodes at a moment [W].
pub(in crate::simulation) struct NodeGains {
    /// By conductors.
    pub(in crate::simulation) conducted: Vec<f64>,
    /// By heaters.
    pub(in crate::simulation) heated: Vec<f64>,
    /// Area of the drawn surface of each node [m2].
    pub(in crate::simulation) areas: Vec<f64>,
}

impl NetworkRun {
    /// Gains of the nodes with these temperatures [K] at a time [s].
    pub(in crate::simulation) fn gains(&self, temperatures: &[f64], time: f64) -> NodeGains {
        let scene = &self.scene;
        let nothing = vec![0.0; scene.network().len()];
        let mut gains = NodeGains { conducted: nothing.clone(), heated: nothing.clone(), areas: nothing };
        scene.network().add_conducted_heat(temperatures, &mut gains.conducted);
        let heaters = scene.heated.iter().enumerate().zip(scene.heaters_on(&self.course.on));
        for ((number, heater), _) in heaters.filter(|(_, on)| *on) {
            let power = scene.power(number).before(time);
            heater.shares.iter().for_each(|(node, share)| gains.heated[*node as usize] += share * power);
        }
        scene.add_areas(&mut gains.areas);
        gains
    }
}

impl SceneNetwork {
    fn add_areas(&self, areas: &mut [f64]) {
        for slot in (0..self.node_of_slot.len()).filter(|slot| self.has(*slot)) {
            areas[self.node_of(slot)] += self.load_areas[slot];
        }
    }
}
