//! The structure of the sensor.

use super::shared::shared;

shared! {
    /// The sensor at one image. Four pixels that stand beside each other are a group.
    pub(crate) struct Sensor {
        /// Transmission, signal of the lens, signal of the housing, signal of the shutter [W m-2 sr-1].
        pub(crate) optics: [f32; 4],
        /// Width [px].
        pub(crate) width: u32,
        /// Height [px].
        pub(crate) height: u32,
        /// Groups of a row.
        pub(crate) groups: u32,
        /// Separable terms of the point spread.
        pub(crate) terms: u32,
        /// Radius of the point spread [px].
        pub(crate) radius: u32,
        /// Place of the halo's weights in the kernel.
        pub(crate) halo_weights: u32,
        /// Side of a cell of the halo [px].
        pub(crate) cell: u32,
        /// Cells in a row.
        pub(crate) cells_across: u32,
        /// Rows of cells.
        pub(crate) cells_down: u32,
        /// Reach of the halo [cells].
        pub(crate) reach: u32,
        /// Seed of the noise.
        pub(crate) seed: u32,
        /// Lower word of the time [us].
        pub(crate) time_low: u32,
        /// Upper word of the time.
        pub(crate) time_high: u32,
        /// Number of shutter corrections.
        pub(crate) shutter: u32,
        /// Share of the light in the halo.
        pub(crate) halo_share: f32,
        /// Share of the bolometer's last state that is left.
        pub(crate) decay: f32,
        /// Standard deviation of the temporal noise [W m-2 sr-1].
        pub(crate) noise: f32,
        /// Standard deviation of the offsets [W m-2 sr-1].
        pub(crate) offset_pattern: f32,
        /// Standard deviation of the gains.
        pub(crate) gain_pattern: f32,
        /// Standard deviation of the drift by now [W m-2 sr-1].
        pub(crate) drift: f32,
        /// Digital numbers of a signal of 1 W m-2 sr-1.
        pub(crate) scale: f32,
        /// Digital number of a signal of 0.
        pub(crate) offset: f32,
        /// Largest digital number.
        pub(crate) most: f32,
        /// Share of bad pixels.
        pub(crate) bad: f32,
        /// Counts of a kelvin.
        pub(crate) counts: f32,
        /// Largest radiance with a brightness temperature [W m-2 sr-1].
        pub(crate) most_radiance: f32,
        /// Focal lengths [px].
        pub(crate) focal: [f32; 2],
        /// Principal point [px].
        pub(crate) centre: [f32; 2],
        /// Serial number of the camera, the seed of its pattern and of its bad pixels.
        pub(crate) serial: u32,
        /// Share of the signal's change since the last image by which the bolometer is behind.
        pub(crate) behind: f32,
    }
}
