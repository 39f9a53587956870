//! How far the device is from the f64 reference: a sample of nodes is stepped along with a run.

use super::engine::{IncidentFunction, incident};
use super::prepare::Prepared;
use crate::environment::TickLoad;
use crate::output::report::Accuracy;
use crate::thermal::STEFAN_BOLTZMANN;
use crate::thermal::nodes::{GROUP, PADDING};
use crate::thermal::reference::{Reference, ReferenceNode};

/// Nodes that are stepped along.
const SAMPLE: usize = 256;

/// Below this the balance temperature is ill-conditioned: at 85 K a black surface moves by 2e-3 K for 7e-5 W/m2, half a
/// unit in the last place of the sunlight in f32. There the radiated flux is compared [K].
const COLD: f64 = 85.0;

/// The reference of a sample of nodes and what has been found so far.
pub struct Check {
    slots: Vec<usize>,
    reference: Reference<IncidentFunction>,
    compared: u64,
    sum_of_squares: f64,
    largest: f64,
    worst: (usize, u32, f64),
    cold: u64,
    largest_cold_flux: f64,
    steps: u64,
}

impl Check {
    /// A sample spread evenly over the nodes.
    pub fn new(prepared: &Prepared) -> Self {
        let nodes = &prepared.nodes;
        let real: Vec<usize> =
            (0..nodes.vertex_of_node.len()).filter(|slot| nodes.vertex_of_node[*slot] != PADDING).collect();
        let count = real.len().min(SAMPLE);
        let slots: Vec<usize> = (0..count).map(|i| real[i * real.len() / count]).collect();
        let sample = slots
            .iter()
            .map(|slot| ReferenceNode {
                normal: nodes.normals[*slot].as_dvec3(),
                material: nodes.group_material[*slot / GROUP],
            })
            .collect();
        Self {
            slots,
            reference: Reference::new(sample, prepared.materials.clone(), incident as IncidentFunction),
            compared: 0,
            sum_of_squares: 0.0,
            largest: 0.0,
            worst: (0, 0, 0.0),
            cold: 0,
            largest_cold_flux: 0.0,
            steps: 0,
        }
    }

    /// Settles the sample at a load.
    pub fn settle(&mut self, load: &TickLoad) {
        self.reference.settle(load);
    }

    /// Settles the sample at a temperature [K].
    pub fn settle_at(&mut self, temperature: f64) {
        self.reference.settle_at(temperature);
    }

    /// Steps the sample.
    pub fn step(&mut self, load: &TickLoad, steps: f64) {
        self.reference.step(load, steps);
    }

    /// The sample's temperatures now [K], to be compared when the device delivers.
    pub fn temperatures(&self) -> Vec<f64> {
        self.reference.temperatures().to_vec()
    }

    /// Compares what the device delivered with what the reference had at that step.
    pub fn compare(&mut self, step: u32, time: f64, reference: &[f64], device: &[f32]) {
        self.steps += 1;
        for (slot, expected) in self.slots.iter().zip(reference) {
            let found = f64::from(device[*slot]);
            if *expected < COLD {
                self.cold += 1;
                let flux = STEFAN_BOLTZMANN * (found.powi(4) - expected.powi(4));
                self.largest_cold_flux = self.largest_cold_flux.max(flux.abs());
                continue;
            }
            let difference = (found - expected).abs();
            self.compared += 1;
            self.sum_of_squares += difference * difference;
            // A NaN must show as the worst there is.
            if difference > self.largest || difference.is_nan() {
                self.largest = difference;
                self.worst = (*slot, step, time);
            }
        }
    }

    /// The result.
    pub fn accuracy(&self, prepared: &Prepared) -> Accuracy {
        let (slot, step, time) = self.worst;
        let nodes = &prepared.nodes;
        let group = slot / GROUP;
        let part = nodes.group_part.get(group).map_or("", |part| &prepared.parts[*part as usize]);
        let material = nodes.group_material.get(group).map_or("", |index| &prepared.materials[*index as usize].name);
        let mut notes = vec![
            "The reference has the same loads: what their sampling leaves out (at most 0.05 W/m2 of sunlight on a plate \
             that the Sun rises or sets on during a 17 s tick, 1e-4 of a unit flux of albedo) is not in these figures."
                .to_owned(),
        ];
        if self.cold > 0 {
            notes.push(format!(
                "{} comparisons of nodes below {COLD} K, where the balance is ill-conditioned, were made in radiated \
                 flux (sigma T^4): largest difference {:.1e} W/m2",
                self.cold, self.largest_cold_flux
            ));
        }
        Accuracy {
            nodes: self.slots.len() as u64,
            of_nodes: nodes.count as u64,
            steps: self.steps,
            max_k: self.largest,
            rms_k: (self.sum_of_squares / self.compared.max(1) as f64).sqrt(),
            worst_node: format!("node {slot}, part {part}, material {material}"),
            worst_step: u64::from(step),
            worst_time_s: time,
            notes,
        }
    }
}
