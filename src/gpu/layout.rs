//! Structures shared with GLSL. Their twins are in `glsl/types.glsl` and `glsl/network_types.glsl`; a test compares
//! both.

use bytemuck::{Pod, Zeroable};

use super::shapes::Shapes;
use crate::environment::shadow::Occluders;
use crate::thermal::STEFAN_BOLTZMANN;
use crate::thermal::material::{Profile, Radiative, Transition};
use crate::thermal::surroundings::sun_irradiance;

/// A member of a structure, for the comparison with the SPIR-V.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Member {
    /// Name in Rust and GLSL.
    pub name: &'static str,
    /// Offset from the start of the structure [bytes].
    pub offset: usize,
    /// Size [bytes].
    pub size: usize,
}

macro_rules! shared {
    ($($(#[$doc:meta])* pub struct $name:ident { $($(#[$field_doc:meta])* pub $field:ident: $kind:ty,)* })*) => {
        $(
            $(#[$doc])*
            #[repr(C)]
            #[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
            pub struct $name { $($(#[$field_doc])* pub $field: $kind,)* }
        )*

        /// Name, size [bytes] and members of every shared structure. Members named `unused` are padding and are left
        /// out.
        pub fn structures() -> Vec<(&'static str, usize, Vec<Member>)> {
            let member = |name, offset, size| Some(Member { name, offset, size }).filter(|_| name != "unused");
            vec![$((stringify!($name), size_of::<$name>(), [$(
                member(stringify!($field), std::mem::offset_of!($name, $field), size_of::<$kind>())
            ),*].into_iter().flatten().collect())),*]
        }
    };
}

shared! {
    /// Properties of a material.
    pub struct Material {
        /// Solar absorptivity of the front.
        pub absorptivity: f32,
        /// Infrared emissivity of the front.
        pub emissivity: f32,
        /// Solar absorptivity of the back. It equals that of the front if only the front exchanges heat.
        pub back_absorptivity: f32,
        /// Infrared emissivity of the back, or of the front if only the front exchanges heat.
        pub back_emissivity: f32,
        /// Response on heating: the power of the remaining share, or the value of `Shapes::place` for a shaped
        /// transition.
        pub heating_function: f32,
        /// Duration of the transition on heating [steps].
        pub heating_t_max: f32,
        /// Response on cooling, like `heating_function`.
        pub cooling_function: f32,
        /// Duration of the transition on cooling [steps].
        pub cooling_t_max: f32,
        /// Change of a plate in a step by a flux of 1 W/m2 [K m2/W].
        pub share: f32,
        /// Emission of a plate to space and to its structure [W/(m2 K4)].
        pub emission: f32,
        /// Emission of a plate to space [W/(m2 K4)].
        pub own_emission: f32,
        /// Radiative conductance between a plate and its structure [W/(m2 K4)].
        pub exchange: f32,
        /// Change of the structure in a step by a flux of 1 W/m2 [K m2/W].
        pub structure_share: f32,
        /// Parts of a step in which the structure is held.
        pub parts: f32,
    }

    /// Load of one step, common to all nodes.
    pub struct Step {
        /// Unit vector to the planet's centre, body frame; w: sine of the planet's angular radius.
        pub nadir: [f32; 4],
        /// Unit vector perpendicular to nadir, on the Sun's side; w: cosine of the planet's angular radius.
        pub sunward: [f32; 4],
        /// Cross product nadir x sunward; w: 0.
        pub across: [f32; 4],
        /// Infrared exitance of the planet [W/m2].
        pub planet_ir: f32,
        /// Planet albedo times solar constant [W/m2].
        pub albedo_flux: f32,
        /// Fourth power of the radiative temperature of space [K4].
        pub background_temperature_4: f32,
        /// Length [steps].
        pub length: f32,
        /// Intervals of the albedo table along each axis.
        pub albedo_resolution: f32,
        /// Number of steps of a fused dispatch, set in the first of them.
        pub count: f32,
        /// Sine of the zenith angle of the Sun below the craft.
        pub sun_sine: f32,
        /// Its cosine.
        pub sun_cosine: f32,
    }

    /// Camera of an image.
    pub struct View {
        /// First row of camera_from_body: rotation and translation [m].
        pub camera_from_body_x: [f32; 4],
        /// Second row.
        pub camera_from_body_y: [f32; 4],
        /// Third row.
        pub camera_from_body_z: [f32; 4],
        /// Camera to clip coordinates: clip.x = scale.x * x + offset.x * z, and the same for y (OpenCV axes).
        pub clip_scale: [f32; 2],
        /// Factors of z in these equations.
        pub clip_offset: [f32; 2],
        /// Width and height [px].
        pub size: [f32; 2],
        /// Distance of the near plane [m]. Depth is reversed, with the far plane at infinity.
        pub near: f32,
        /// Image motion that culling tolerates [px].
        pub margin: f32,
    }

    /// Camera of an image with a rolling shutter, beside the `View` of its first row.
    pub struct Shutter {
        /// First row of camera_from_body at the time of the middle row of the image.
        pub middle_x: [f32; 4],
        /// Second row of it.
        pub middle_y: [f32; 4],
        /// Third row of it.
        pub middle_z: [f32; 4],
        /// First row of camera_from_body at the time of the last row of the image.
        pub last_x: [f32; 4],
        /// Second row of it.
        pub last_y: [f32; 4],
        /// Third row of it.
        pub last_z: [f32; 4],
        /// Smallest x and y, and largest x and y, of the rays whose row is computed.
        pub field: [f32; 4],
        /// Distortion: k1, k2, p1, p2; of a fisheye k1 to k4.
        pub first_numbers: [f32; 4],
        /// Distortion: k3, k4, k5, k6.
        pub second_numbers: [f32; 4],
        /// Distortion: s1, s2, s3, s4.
        pub third_numbers: [f32; 4],
        /// Share of the image for a unit of the distorted y.
        pub row_scale: f32,
        /// Share of the image above the centre of its first row where y is 0.
        pub row_offset: f32,
        /// Padding to the alignment of GLSL.
        pub unused: [f32; 2],
    }

    /// Sizes of an image that is made from a finer one.
    pub struct Sampling {
        /// Width of the image [px].
        pub width: u32,
        /// Height of the image [px].
        pub height: u32,
        /// Width of the source [texels].
        pub source_width: u32,
        /// Height of the source [texels].
        pub source_height: u32,
        /// Lookups along the width of a pixel.
        pub columns: u32,
        /// Lookups along the height of a pixel.
        pub rows: u32,
    }

    /// A crop around a craft that is far away.
    pub struct Distant {
        /// Upper left corner of the crop in the image [px].
        pub corner: [f32; 2],
        /// Focal lengths of the image [px].
        pub focal: [f32; 2],
        /// Principal point of the image [px].
        pub centre: [f32; 2],
        /// Texels along the side of a pixel.
        pub scale: f32,
        /// Places in a pixel along each axis at which the sky is seen.
        pub lookups: f32,
        /// Width of the image [px]. The crop is drawn into an image of this width.
        pub width: u32,
        /// Height of the image [px].
        pub height: u32,
        /// Width of the crop [texels].
        pub across: u32,
        /// Height of the crop [texels].
        pub down: u32,
    }

    /// What surrounds the craft, in the axes of the camera.
    pub struct Surroundings {
        /// Unit vector to the planet's centre; w: sine of the planet's angular radius.
        pub nadir: [f32; 4],
        /// Unit vector to the Sun's centre; w: sine of the Sun's angular radius.
        pub sun: [f32; 4],
        /// Cosine of the planet's angular radius.
        pub planet_cosine: f32,
        /// Cosine of the Sun's angular radius.
        pub sun_cosine: f32,
        /// Radiance of the planet [W m-2 sr-1].
        pub planet_radiance: f32,
        /// Radiance of deep space [W m-2 sr-1].
        pub space_radiance: f32,
        /// Radiance of the Sun's disc [W m-2 sr-1].
        pub sun_radiance: f32,
        /// Irradiance across the Sun's rays in the band [W/m2].
        pub sun_irradiance: f32,
        /// Padding to the alignment of GLSL.
        pub unused: [f32; 2],
    }

    /// How a face of a material emits and reflects in the band.
    pub struct Reflector {
        /// Emissivity.
        pub emissivity: f32,
        /// Share of the reflected light that leaves about the mirror direction.
        pub specular: f32,
        /// Roughness of the mirror; 0 for a smooth one.
        pub roughness: f32,
        /// Index of the first number of its lobe.
        pub lobe: f32,
        /// Index of the first number of its emissivities over angle and temperature.
        pub table: f32,
        /// Their factor at the temperature of the planet.
        pub of_planet: f32,
        /// Their factor at the temperature of deep space.
        pub of_space: f32,
        /// Their factor at the temperature of the Sun.
        pub of_sun: f32,
    }

    /// Rays of an image against the craft's own triangles.
    pub struct Tracing {
        /// Number of boxes in the tree.
        pub boxes: u32,
        /// Word of the time, so that each image has rays of its own.
        pub word: u32,
        /// Distance between a ray's start and its surface [m].
        pub start: f32,
        /// Width of the image [texels].
        pub width: u32,
        /// Number of its texels.
        pub texels: u32,
        /// Width of the image of surfaces [texels].
        pub surface_width: u32,
    }

    /// Axes of the map of a planet that is not uniform.
    pub struct PlanetView {
        /// +X of the map in the axes of the camera; w: columns of the map.
        pub x: [f32; 4],
        /// +Y of the map; w: rows of the map.
        pub y: [f32; 4],
        /// +Z of the map; w: 0.
        pub z: [f32; 4],
    }

    /// An indexed indirect draw command (VkDrawIndexedIndirectCommand).
    pub struct DrawCommand {
        /// Three for each triangle.
        pub index_count: u32,
        /// Always 1.
        pub instance_count: u32,
        /// First index in the buffer of all triangles.
        pub first_index: u32,
        /// Always 0.
        pub vertex_offset: i32,
        /// Always 0.
        pub first_instance: u32,
    }

    /// Orthographic view of the craft from the Sun.
    pub struct SunView {
        /// Row of the transform from a point to its column in the shadow map [texels].
        pub texel_from_body_x: [f32; 4],
        /// Row of the transform from a point to its row in the shadow map [texels].
        pub texel_from_body_y: [f32; 4],
        /// Row of the transform from a point to its depth, 0 to 1.
        pub texel_from_body_z: [f32; 4],
        /// Unit vector to the Sun, body frame; w: offset of a node from its surface [m].
        pub sun: [f32; 4],
        /// Unit vector along texel rows; w: side of a texel in units of depth.
        pub right: [f32; 4],
        /// Unit vector along texel columns; w: texels along a side of the map.
        pub down: [f32; 4],
    }

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
        /// Reach of the halo [cells].
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

    /// A node of the bounding box tree for shadow rays.
    pub struct ShadowBox {
        /// Lower corner [m].
        pub low: [f32; 3],
        /// Index of the next box if the ray misses this one.
        pub skip: u32,
        /// Upper corner [m].
        pub high: [f32; 3],
        /// First triangle times 8 plus the number of triangles. The number is 0 for an inner box.
        pub triangles: u32,
    }

    /// A triangle that casts a shadow.
    pub struct ShadowTriangle {
        /// A corner [m].
        pub corner: [f32; 4],
        /// Edge from that corner to the second one [m].
        pub first: [f32; 4],
        /// Edge from that corner to the third one [m].
        pub second: [f32; 4],
    }

    /// Push constants of one shadow ray dispatch, for one point of the Sun's disc.
    pub struct SunRay {
        /// Unit vector to the Sun's centre; w: offset of the ray's start from its surface [m].
        pub sun: [f32; 4],
        /// Unit vector to the point; w: share of the disc that the point stands for.
        pub direction: [f32; 4],
        /// Number of boxes in the tree.
        pub boxes: u32,
        /// Padding to the alignment of GLSL.
        pub unused: [u32; 3],
    }

    /// Head of the band table.
    pub struct Band {
        /// c2 divided by the longest wavelength, rounded to f32 [K].
        pub edge_high: f32,
        /// Remainder of that rounding [K].
        pub edge_low: f32,
    }

    /// A patch of a surface that radiates to others.
    pub struct ExchangePatch {
        /// Unit normal away from the face, in the frame of its joint.
        pub normal: [f32; 3],
        /// Emissivity.
        pub emissivity: f32,
        /// Absorptivity of sunlight.
        pub absorptivity: f32,
        /// 1 over the area [1/m2].
        pub per_area: f32,
        /// First of its nodes.
        pub first_node: u32,
        /// The node after the last.
        pub end_node: u32,
        /// First four entries of its row of infrared.
        pub first_entry: u32,
        /// The four after the last.
        pub end_entry: u32,
        /// First four entries of its row of sunlight.
        pub first_reflected: u32,
        /// The four after the last.
        pub end_reflected: u32,
        /// Exchange area of infrared with itself [m2].
        pub itself: f32,
        /// The same of sunlight [m2].
        pub itself_reflected: f32,
        /// Joint; 0 is the body.
        pub joint: u32,
        /// Share of reflected sunlight that leaves in the mirror direction, where patches mirror sunlight.
        pub specular: f32,
        /// Share of the patch outside other parts, which sunlight can reach.
        pub exposed: f32,
        /// Rounds the size up to that of vectors.
        pub unused: [f32; 3],
    }

    /// Push constants of a pass over patches.
    pub struct ExchangePass {
        /// First patch.
        pub first: u32,
        /// Patch after the last.
        pub end: u32,
        /// Rays of each patch.
        pub rays: u32,
        /// Number of boxes in the tree, for a pass that casts rays.
        pub boxes: u32,
        /// Distance between the start of a ray and its surface [m].
        pub start: f32,
    }

    /// Push constants of a dispatch that sums absorbed heat.
    pub struct HeatPass {
        /// First run of nodes.
        pub first: u32,
        /// Fourth power of the radiative temperature of space [K4].
        pub background_temperature_4: f32,
    }

    /// Size of a response dispatch.
    pub struct Steps {
        /// Number of steps.
        pub count: u32,
        /// Groups of four nodes of one step.
        pub groups: u32,
    }

    /// Heat exchange of a node with one neighbour.
    pub struct NetworkLink {
        /// Number of the neighbour.
        pub neighbour: u32,
        /// Linear conductor GL [W/K].
        pub conductance: f32,
        /// Stefan-Boltzmann constant x radiative conductor GR [W/K4].
        pub exchange: f32,
    }

    /// A step of the heaters of a network in one pass.
    pub struct HeaterStep {
        /// Number of heaters.
        pub heaters: u32,
        /// 1 in the first step of a frame.
        pub first: u32,
        /// 1 in a step that is taken to learn its change, so that the last change is not known.
        pub trial: u32,
        /// Start since that of the frame [s].
        pub start: f32,
        /// Length [s].
        pub step: f32,
    }

    /// A step of a network in one pass, over a range of its groups.
    pub struct NetworkStep {
        /// First group.
        pub first: u32,
        /// Group after the last.
        pub end: u32,
        /// Runge-Kutta steps in a local step of a fast node.
        pub count: u32,
        /// Steps since the last estimate of the error.
        pub since: u32,
        /// Length [s].
        pub step: f32,
        /// Fourth power of the radiative temperature of space [K4].
        pub space_temperature_4: f32,
    }

    /// Push constants of a pass over a network.
    pub struct NetworkPass {
        /// Number of active invocations. A solver decision reads this number of partial sums instead.
        pub count: u32,
        /// Index of the sensor temperatures of this sub-step.
        pub sensed_at: u32,
        /// Update: 1 in the first iteration. Solver decision: which one.
        pub mode: u32,
        /// Time of the stage since the heat was set [s].
        pub time: f32,
        /// Radiative temperature of space [K].
        pub space_temperature: f32,
        /// Weight of the previous stage. Error estimate: of the change. Right-hand side: of the present heat.
        pub mu: f32,
        /// Weight of the stage before the previous one. Right-hand side: of the heat at the start.
        pub nu: f32,
        /// Weight of the previous stage's rate [s]. Right-hand side: of the heat stored by the change.
        pub mu_step: f32,
        /// Weight of the start rate [s]. Right-hand side: of the heat stored by the first stage's change.
        pub gamma_step: f32,
        /// 1 / (alpha h), with the step length h [1/s].
        pub inverse_step: f32,
        /// Tolerance. Conjugate gradients: squared residual relative to the first one. Newton's method: relative
        /// temperature change, four times as large after `mu` iterations.
        pub accuracy: f32,
    }

    /// State of the solver of a network.
    pub struct NetworkSolver {
        /// Product of residual and preconditioned residual [W K].
        pub gamma: f32,
        /// Step length along the search direction.
        pub alpha: f32,
        /// Step length that the solution uses; 0 after convergence.
        pub step: f32,
        /// Share of the last direction in the next one.
        pub beta: f32,
        /// `gamma` in the first iteration.
        pub gamma_start: f32,
        /// `gamma` at the start of the first system of a stage.
        pub gamma_first: f32,
        /// Iterations of conjugate gradients in this system.
        pub gradients: f32,
        /// 1 if conjugate gradients have converged.
        pub gradients_done: f32,
        /// Iterations of Newton's method in this stage.
        pub newtons: f32,
        /// 1 if Newton's method has converged.
        pub newtons_done: f32,
        /// Most iterations of conjugate gradients in one system.
        pub most_gradients: f32,
        /// Most iterations of Newton's method in one stage.
        pub most_newtons: f32,
        /// Total iterations of conjugate gradients.
        pub iterations: f32,
        /// 1 if a system needed more iterations than were recorded.
        pub short_gradients: f32,
        /// 1 if a stage needed more iterations than were recorded.
        pub short_newtons: f32,
        /// 1 if a value is not finite.
        pub lost: f32,
        /// Largest relative temperature change in the last iteration.
        pub largest_move: f32,
    }
}

impl Material {
    /// Sets the response functions and durations.
    pub fn set_transition(&mut self, transition: &Transition, shapes: &Shapes) {
        let function = |profile: &Profile| match profile.function.power().filter(|_| transition.is_power()) {
            Some(power) => power as f32,
            None => shapes.place(&profile.function),
        };
        [self.heating_function, self.cooling_function] = [function(&transition.heating), function(&transition.cooling)];
        self.heating_t_max = transition.heating.duration() as f32;
        self.cooling_t_max = transition.cooling.duration() as f32;
    }
}

impl Material {
    /// Sets the values of a plate whose faces have this sum of emissivities.
    pub fn set_plate(&mut self, plate: &Radiative, emissivity: f64) {
        let own = STEFAN_BOLTZMANN * emissivity;
        self.share = plate.share() as f32;
        self.emission = (own + plate.exchange()) as f32;
        self.own_emission = own as f32;
        self.exchange = plate.exchange() as f32;
        self.structure_share = plate.structure_share() as f32;
        self.parts = plate.parts() as f32;
    }
}

impl Surroundings {
    /// Rounds surroundings to f32.
    pub fn new(around: &crate::thermal::surroundings::Surroundings) -> Self {
        let with = |v: glam::DVec3, w: f64| [v.x as f32, v.y as f32, v.z as f32, w as f32];
        Self {
            nadir: with(around.nadir, around.planet.sin),
            sun: with(around.sun, around.sun_disc.sin),
            planet_cosine: around.planet.cos as f32,
            sun_cosine: around.sun_disc.cos as f32,
            planet_radiance: around.planet_radiance as f32,
            space_radiance: around.space_radiance as f32,
            sun_radiance: around.sun_radiance as f32,
            sun_irradiance: sun_irradiance(around) as f32,
            unused: [0.0; 2],
        }
    }
}

impl PlanetView {
    /// Rounds the rotation from camera axes into those of a map to f32. `size` are the map's columns and rows.
    pub fn new(map_from_camera: &glam::DMat3, [columns, rows]: [usize; 2]) -> Self {
        let row = |axis: usize, size: usize| {
            let row = map_from_camera.row(axis);
            [row.x as f32, row.y as f32, row.z as f32, size as f32]
        };
        Self { x: row(0, columns), y: row(1, rows), z: row(2, 0) }
    }
}

impl SunView {
    /// Rounds a view to f32.
    pub fn new(view: &crate::environment::shadow::SunView) -> Self {
        let with = |v: glam::DVec3, w: f64| [v.x as f32, v.y as f32, v.z as f32, w as f32];
        let [x, y, z] = view.rows().map(|row| row.map(|value| value as f32));
        Self {
            texel_from_body_x: x,
            texel_from_body_y: y,
            texel_from_body_z: z,
            sun: with(view.sun, view.lift),
            right: with(view.right, view.texel_depth()),
            down: with(view.down, f64::from(view.resolution)),
        }
    }
}

/// Rows of a rigid motion, rounded to f32. Shadow rays get those of body_from_joint after `SunRay`.
pub fn rows(motion: &glam::DAffine3) -> [[f32; 4]; 3] {
    [0, 1, 2].map(|i| {
        let rotation = motion.matrix3.row(i);
        [rotation.x as f32, rotation.y as f32, rotation.z as f32, motion.translation[i] as f32]
    })
}

/// Most steps of one fused dispatch (STEPS in glsl/thermal_step.comp). Their Sun samples take 4 of the 16 KiB that
/// every device allows for a uniform buffer.
pub const FUSED_STEPS: usize = 32;

/// Distance between the joint slices of a uniform buffer [bytes]. Every device accepts it as an offset alignment.
pub const SLICE: usize = 256;

/// Boxes and triangles of the tree, rounded to f32. Boxes grow by the rounding error.
pub fn shadow_tree(occluders: &Occluders) -> (Vec<ShadowBox>, Vec<ShadowTriangle>) {
    let low = |value: f64| (value as f32).next_down();
    let high = |value: f64| (value as f32).next_up();
    let boxes = occluders.tree.nodes.iter().map(|node| ShadowBox {
        low: node.low.to_array().map(low),
        skip: node.skip,
        high: node.high.to_array().map(high),
        triangles: node.first << 3 | node.count,
    });
    let padded = |v: glam::DVec3| [v.x as f32, v.y as f32, v.z as f32, 0.0];
    let triangles = occluders.triangles.iter().map(|[corner, first, second]| ShadowTriangle {
        corner: padded(*corner),
        first: padded(*first),
        second: padded(*second),
    });
    (boxes.collect(), triangles.collect())
}
