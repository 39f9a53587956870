//! Errors of the flux that patches absorb: noise of the rays, and the light that exchange areas leave out.

use rayon::prelude::*;

use super::factors::Factors;
use super::patches::Patch;
use super::step::{CraftLight, Exchange};
use crate::environment::StepLoad;
use crate::thermal::STEFAN_BOLTZMANN;
use crate::thermal::incident::incident;
use crate::thermal::received::PlanetShares;

/// Change over the largest light below which the light that arrives counts as settled.
const SETTLED: f64 = 1e-9;
const MOST: u32 = 20_000;

/// Errors of the flux that a patch absorbs [W/m2].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FluxError {
    /// Standard error as for independent rays. The true error is smaller, because the rays are spread evenly.
    pub noise: f64,
    /// Change by rounding and by pairs that were left out.
    pub left_out: f64,
}

/// Light that arrives at every patch [W/m2] with at most `bounces` reflections. `sent` leaves each patch at first [W/m2]. No pair is left out.
pub(crate) fn arriving(factors: &Factors, absorptivities: &[f64], bounces: Option<u32>, sent: &[f64]) -> Vec<f64> {
    let mut arrives = vec![0.0; sent.len()];
    for _ in 0..=bounces.unwrap_or(MOST).min(MOST) {
        let leaves = leaving(absorptivities, sent, &arrives);
        let at = |i: usize| -> f64 {
            factors.shared.row(i).iter().map(|(j, area)| area * leaves[*j as usize]).sum::<f64>() / factors.areas[i]
        };
        let next: Vec<f64> = (0..sent.len()).into_par_iter().map(at).collect();
        let largest = next.iter().fold(0.0, |most: f64, light| most.max(light.abs()));
        let change = next.iter().zip(&arrives).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        arrives = next;
        if change <= SETTLED * largest {
            break;
        }
    }
    arrives
}

fn leaving(absorptivities: &[f64], sent: &[f64], arrives: &[f64]) -> Vec<f64> {
    let leave = |((sent, arrives), taken): ((&f64, &f64), &f64)| sent + (1.0 - taken) * arrives;
    sent.iter().zip(arrives).zip(absorptivities).map(leave).collect()
}

impl Exchange {
    /// Errors of the flux that patches absorb where they send this infrared [W/m2] under a light.
    pub fn errors(&self, sent: &[f64], light: &CraftLight, bounces: Option<u32>) -> Vec<FluxError> {
        let absorptivities = |infrared: bool| -> Vec<f64> {
            let optics = self.patches.iter().map(|patch| patch.optics);
            optics.map(|optics| if infrared { optics.emissivity } else { optics.absorptivity }).collect()
        };
        let sunlight: Vec<f64> = light.reflected.iter().map(|both| both[1]).collect();
        let [infrared, sunlight] = [(true, sent), (false, &sunlight[..])].map(|(infrared, sent)| {
            let taken = absorptivities(infrared);
            let arrives = arriving(&self.factors, &taken, bounces, sent);
            let leaves = leaving(&taken, sent, &arrives);
            (taken, arrives, leaves)
        });
        let rows = self.absorbed(sent, light);
        let error = |i: usize| {
            let taken = infrared.0[i] * infrared.1[i] + sunlight.0[i] * sunlight.1[i];
            let (mut mean, mut square) = (0.0, 0.0);
            for (j, shared) in self.factors.shared.row(i) {
                let j = *j as usize;
                // The flux that a ray from patch j brings.
                let brings = infrared.0[i] * infrared.2[j] + sunlight.0[i] * sunlight.2[j];
                let share = shared / self.factors.areas[i];
                mean += share * brings;
                square += share * brings * brings;
            }
            let variance = (square - mean * mean).max(0.0) / f64::from(self.factors.rays);
            FluxError { noise: variance.sqrt(), left_out: rows[i] - taken - light.mirrored.get(i).unwrap_or(&0.0) }
        };
        (0..self.patches.len()).into_par_iter().map(error).collect()
    }

    /// Excess of the flux that patches absorb under held light over the flux under light of this very step [W/m2]. `temperature` gives the
    /// temperature of a node [K].
    pub fn held_too_long(
        &self,
        load: &StepLoad,
        [held, fresh]: [&CraftLight; 2],
        temperature: impl Fn(usize) -> f64 + Sync,
    ) -> Vec<f64> {
        let [before, now] = [held, fresh].map(|light| self.absorbed(&self.sent(load, light, &temperature), light));
        let excess = |(number, patch): (usize, &Patch)| {
            let normal = load.joint_from_body(patch.joint).transpose() * patch.normal;
            let open = incident(load, normal);
            let direct = |light: &CraftLight| {
                let PlanetShares { planet_ir, albedo } = light.planet_shares[number];
                patch.optics.emissivity * planet_ir * open.planet_ir + patch.optics.absorptivity * albedo * open.albedo
            };
            before[number] - now[number] + direct(held) - direct(fresh)
        };
        self.patches.par_iter().enumerate().map(excess).collect()
    }

    /// Change of the temperature of every patch by a flux of 1 W/m2 [K m2/W], where its nodes are in balance. `temperature` gives the temperature
    /// of a node [K].
    pub fn kelvin_per_flux(&self, temperature: impl Fn(usize) -> f64 + Sync) -> Vec<f64> {
        let kelvin = |patch: &Patch| {
            let nodes = &self.nodes[patch.nodes.clone()];
            let mean: f64 = nodes.iter().map(|(node, share)| share * temperature(*node as usize)).sum();
            let faces = nodes.first().map_or([super::patches::NONE; 2], |(node, _)| self.of_node[*node as usize]);
            let faces = faces.iter().filter_map(|face| self.patches.get(*face as usize));
            let emissivity: f64 = faces.map(|face| face.optics.emissivity).sum();
            1.0 / (4.0 * emissivity * STEFAN_BOLTZMANN * mean.powi(3))
        };
        self.patches.par_iter().map(kelvin).collect()
    }
}

/// An error [K] that was found with radiation as a straight line, at a temperature T [K]. Where it is large, it is half of the way between absolute zero and the temperature at which the surface
/// radiates what the line says. With x the error over T, the line says 1 + 4 x of the radiation at T.
pub(crate) fn at_most(error: f64, temperature: f64) -> f64 {
    error.min(0.5 * temperature * (1.0 + 4.0 * error / temperature).sqrt().sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 10 W/m2 that are missing on a black surface at 20 K are 5.5e3 K by a line. A surface that has them is at 115 K.
    #[test]
    fn an_error_in_the_cold_is_no_larger_than_what_the_flux_can_warm() {
        let [temperature, flux] = [20.0f64, 10.0];
        let line = flux / (4.0 * STEFAN_BOLTZMANN * temperature.powi(3));
        let warm = (temperature.powi(4) + flux / STEFAN_BOLTZMANN).sqrt().sqrt();
        let error = at_most(line, temperature);
        assert!(line > 5000.0 && (error - 0.5 * warm).abs() < 1e-9, "{line}, {error}, {warm}");
        // Smaller ones stay.
        assert_eq!([1.0, 100.0].map(|error| at_most(error, 300.0)), [1.0, 100.0]);
    }
}
