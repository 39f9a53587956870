//! Another sensor for a simulation that is driven from outside.

use super::super::engine::Engine;
use super::super::facade_error::SimulationError;
use super::super::pose::CameraError;
use super::super::thermal_state::ThermalState;
use super::Simulation;
use crate::thermal::sensor::Sensor;

impl Simulation {
    /// Takes another sensor for the images from now on. Seed, strength of noise and patterns, temperatures, range, bits and the width of a Gaussian blur
    /// change at no cost. A sensor with other effects makes the resources of the image anew, and its bolometer begins anew.
    ///
    /// # Errors
    /// The scene has no sensor or no camera, the device can not hold the image, or a call fails.
    pub fn set_sensor(&mut self, sensor: Sensor) -> Result<(), SimulationError> {
        if self.prepared.scene.sensor.as_ref() == Some(&sensor) {
            return Ok(());
        }
        if self.prepared.scene.sensor.is_none() || self.drawn.is_none() {
            return Err(CameraError::Combination("a sensor takes the place of the scene's, which has none").into());
        }
        self.begin()?;
        let before = self.prepared.scene.sensor.replace(sensor);
        match self.engine_of_sensor() {
            Ok(None) => Ok(()),
            Ok(Some(engine)) => {
                self.engine = engine;
                Ok(())
            }
            Err(error) => {
                self.prepared.scene.sensor = before;
                Err(error)
            }
        }
    }

    /// Another engine for the sensor of the scene. `None` where the present one takes it.
    fn engine_of_sensor(&mut self) -> Result<Option<Box<dyn Engine>>, SimulationError> {
        if self.engine.take_sensor(&self.prepared)? {
            return Ok(None);
        }
        let state = ThermalState::take(&self.prepared, &mut *self.engine, None, self.time)?;
        self.engine_with(&state, self.drawn.as_ref()).map(Some)
    }
}
