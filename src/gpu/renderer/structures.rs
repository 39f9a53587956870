//! Reads the temperatures of nodes, and reads and sets the temperatures of the structures below plates.

use super::Renderer;
use crate::gpu::effects::thermal::{ELAPSED, TARGET, TEMPERATURE};
use crate::gpu::error::GpuError;

impl Renderer {
    /// Temperatures of the structures [K], one value for each node. The values of nodes without a structure mean nothing. No frame is in flight afterwards.
    ///
    /// # Errors
    /// A call that fails.
    pub(crate) fn structures(&mut self) -> Result<Vec<f32>, GpuError> {
        self.wait()?;
        self.resources.download(&mut self.once, &TARGET, self.nodes)
    }

    /// Temperatures of all nodes [K]. No frame is in flight afterwards.
    ///
    /// # Errors
    /// A call that fails.
    pub(crate) fn temperatures(&mut self) -> Result<Vec<f64>, GpuError> {
        self.wait()?;
        let values: Vec<f32> = self.resources.download(&mut self.once, &TEMPERATURE, self.nodes)?;
        self.resources.free_staging();
        Ok(values.into_iter().map(f64::from).collect())
    }

    /// Replaces the temperatures of the structures below some nodes [K].
    ///
    /// # Errors
    /// A call that fails.
    pub(crate) fn set_structures(&mut self, nodes: &[usize], temperatures: &[f64]) -> Result<(), GpuError> {
        let mut values = self.structures()?;
        let mut words: Vec<i32> = self.resources.download(&mut self.once, &ELAPSED, self.nodes)?;
        for (node, temperature) in nodes.iter().zip(temperatures) {
            // Without a rest, and without a last change.
            (values[*node], words[*node]) = (*temperature as f32, 0);
        }
        self.resources.upload(&mut self.once, &TARGET, &values)?;
        self.resources.upload(&mut self.once, &ELAPSED, &words)?;
        self.resources.free_staging();
        Ok(())
    }
}
