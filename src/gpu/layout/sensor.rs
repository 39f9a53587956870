//! The structure of the sensor.

use super::shared::shared;

shared! {
    /// The sensor at one image. Four pixels that stand beside each other are a group.
    pub struct Sensor {
        /// Transmission, signal of the lens, signal of the housing, signal of the shutter [W m-2 sr-1].
        pub optics: [f32; 4],
        /// Width [px].
        pub width: u32,
        /// Height [px].
        pub height: u32,
        /// Groups of a row.
        pub groups: u32,
        /// Separable terms of the point spread.
        pub terms: u32,
        /// Radius of the point spread [px].
        pub radius: u32,
        /// Place of the halo's weights in the kernel.
        pub halo_weights: u32,
        /// Side of a cell of the halo [px].
        pub cell: u32,
        /// Cells in a row.
        pub cells_across: u32,
        /// Rows of cells.
        pub cells_down: u32,
        /// PassReach of the halo [cells].
        pub reach: u32,
        /// Seed of the noise.
        pub seed: u32,
        /// Lower word of the time [us].
        pub time_low: u32,
        /// Upper word of the time.
        pub time_high: u32,
        /// Number of shutter corrections.
        pub shutter: u32,
        /// Share of the light in the halo.
        pub halo_share: f32,
        /// Share of the bolometer's last state that is left.
        pub decay: f32,
        /// Standard deviation of the temporal noise [W m-2 sr-1].
        pub noise: f32,
        /// Standard deviation of the offsets [W m-2 sr-1].
        pub offset_pattern: f32,
        /// Standard deviation of the gains.
        pub gain_pattern: f32,
        /// Standard deviation of the drift by now [W m-2 sr-1].
        pub drift: f32,
        /// Digital numbers of a signal of 1 W m-2 sr-1.
        pub scale: f32,
        /// Digital number of a signal of 0.
        pub offset: f32,
        /// Largest digital number.
        pub most: f32,
        /// Share of bad pixels.
        pub bad: f32,
        /// Counts of a kelvin.
        pub counts: f32,
        /// Largest radiance with a brightness temperature [W m-2 sr-1].
        pub most_radiance: f32,
        /// Focal lengths [px].
        pub focal: [f32; 2],
        /// Principal point [px].
        pub centre: [f32; 2],
        /// Padding to the alignment of GLSL.
        pub unused: [f32; 2],
    }
}
