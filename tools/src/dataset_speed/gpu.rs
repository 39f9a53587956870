//! What a GPU would need for an image of a data set, calculated from the bytes that its passes move. Nothing here is measured on a GPU.

use std::path::Path;
use std::process::Command;

use serde_json::Value as Json;

use super::shards::Measured;

/// Bytes of a pixel that the sensor of a SPEC reads and writes: its copy of the radiance, and what it reads to the host.
const SENSOR: f64 = 32.0;

/// Bytes of a pixel of the image that is drawn.
const RADIANCE: f64 = 16.0;

/// A GPU by its bandwidths.
#[derive(clap::Args)]
pub struct Gpu {
    /// Bandwidth of the memory of a GPU [GB/s], for the calculation
    #[arg(long, default_value_t = 500.0)]
    memory: f64,
    /// Bandwidth between GPU and host [GB/s], for the calculation
    #[arg(long, default_value_t = 20.0)]
    bus: f64,
    /// Time of submitting a step and waiting for it [us], for the calculation
    #[arg(long, default_value_t = 150.0)]
    submit: f64,
}

impl Gpu {
    /// Head of the table.
    pub const HEAD: &str = "| SPEC | steps an image | bytes of the steps | of the image | over the bus | their time on a GPU [ms] | submitting [ms] | labels and files on the host, measured [ms] | images an hour, at most |\n\
                            |---|---|---|---|---|---|---|---|---|";

    /// What the numbers are.
    pub fn sentence(&self) -> String {
        format!(
            "What a GPU would change, for one shard, calculated and not measured. A step reads and writes all bytes of the nodes once, an image all of its own once, and half of \
             them go to the host. Memory: {} GB/s. Bus: {} GB/s. {} us for each step and image that is submitted.\n",
            self.memory, self.bus, self.submit
        )
    }

    /// The row of a data set.
    ///
    /// # Errors
    /// `isotherm info` fails.
    pub fn row(&self, program: &Path, measured: &Measured) -> Result<String, String> {
        let info = info(program, &measured.scene)?;
        let number = |pointer: &str| info.pointer(pointer).and_then(Json::as_f64).unwrap_or_default();
        let of_nodes = number("/bytes_a_node") * number("/nodes");
        let buffers = info.pointer("/buffers").and_then(Json::as_array);
        let drawn = buffers.into_iter().flatten().find(|buffer| buffer["name"] == "RadianceImage");
        let pixels = drawn.and_then(|image| image["bytes"].as_f64()).unwrap_or_default() / RADIANCE;
        let of_image = number("/bytes") - of_nodes + SENSOR * pixels;
        // A forecast says "at most" before the steps of a warm-up that ends when it repeats.
        let steps = |key: &str| {
            let text = info.pointer(&format!("/forecast/{key}")).and_then(Json::as_str).unwrap_or_default();
            text.chars().filter(char::is_ascii_digit).collect::<String>().parse::<f64>().unwrap_or_default()
        };
        let an_image =
            (steps("steps of the warm-up") + steps("steps after it")) * measured.orbits as f64 / measured.images as f64;
        let of_steps = 2.0 * of_nodes * an_image;
        let over_bus = 0.5 * of_image;
        let moving = 1e3 * ((of_steps + 2.0 * of_image) / (1e9 * self.memory) + over_bus / (1e9 * self.bus));
        let submitting = 1e-3 * self.submit * (an_image + 1.0);
        let files = 1e3 * measured.seconds_of_files / measured.images as f64;
        Ok(format!(
            "| {} | {an_image:.1} | {of_steps:.1e} | {:.1e} | {over_bus:.1e} | {moving:.2} | {submitting:.2} | {files:.1} | {:.0} |",
            measured.name,
            2.0 * of_image,
            3.6e6 / (moving + submitting + files)
        ))
    }
}

/// `isotherm info --json` of a scene.
fn info(program: &Path, scene: &Path) -> Result<Json, String> {
    let failed = |reason: String| format!("isotherm info {}: {reason}", scene.display());
    let output = Command::new(program).arg("info").arg(scene).arg("--json").output();
    let output = output.map_err(|error| failed(error.to_string()))?;
    serde_json::from_slice(&output.stdout).map_err(|error| failed(error.to_string()))
}
