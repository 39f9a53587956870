//! Every structure shared with GLSL, once in Rust; `glsl/types.glsl` and `glsl/network_types.glsl` are the other side, compared by tests/it/layout.rs.

use bytemuck::{Pod, Zeroable};

use super::shapes::Shapes;
use crate::environment::shadow::Occluders;
use crate::thermal::material::{Profile, Transition};

/// A member of a structure, for the comparison with SPIR-V.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Member {
    /// Name, the same on both sides.
    pub name: &'static str,
    /// Bytes from the start of the structure.
    pub offset: usize,
    /// Bytes.
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

        /// Name, size and members of every shared structure; what is `unused` only fills up.
        pub fn structures() -> Vec<(&'static str, usize, Vec<Member>)> {
            let member = |name, offset, size| Some(Member { name, offset, size }).filter(|_| name != "unused");
            vec![$((stringify!($name), size_of::<$name>(), [$(
                member(stringify!($field), std::mem::offset_of!($name, $field), size_of::<$kind>())
            ),*].into_iter().flatten().collect())),*]
        }
    };
}

shared! {
    /// Values of one material.
    pub struct Material {
        /// Solar absorptivity of the outside.
        pub absorptivity: f32,
        /// Infrared emissivity of the outside.
        pub emissivity: f32,
        /// Solar absorptivity of the back; that of the outside where only the outside exchanges heat.
        pub back_absorptivity: f32,
        /// Infrared emissivity of the back, likewise.
        pub back_emissivity: f32,
        /// On heating: power of the remaining share, 1 linear, 2 quadratic; of a shaped transition where its pieces are.
        pub heating_function: f32,
        /// Time to the target on heating [steps].
        pub heating_t_max: f32,
        /// The same on cooling.
        pub cooling_function: f32,
        /// Time to the target on cooling [steps].
        pub cooling_t_max: f32,
    }

    /// What one step commands, the same for every node.
    pub struct Step {
        /// Unit vector to the planet's centre, body frame; w: sine of the planet's angular radius.
        pub nadir: [f32; 4],
        /// Unit vector towards the Sun's side, at right angles to nadir; w: cosine of the planet's angular radius.
        pub sunward: [f32; 4],
        /// nadir x sunward; w: 0.
        pub across: [f32; 4],
        /// Infrared exitance of the planet [W/m2].
        pub planet_ir: f32,
        /// Albedo x solar constant [W/m2].
        pub albedo_flux: f32,
        /// Fourth power of the radiative temperature of space [K4].
        pub background_temperature_4: f32,
        /// Length in steps of the scene.
        pub length: f32,
        /// Intervals of the albedo table each way.
        pub albedo_resolution: f32,
        /// Steps of a fused dispatch, said by the first of them.
        pub count: f32,
        /// The structure is as long as its alignment in GLSL asks.
        pub unused: [f32; 2],
    }

    /// Where the image is taken from, and with what.
    pub struct View {
        /// First row of camera_from_body: rotation and translation [m].
        pub camera_from_body_x: [f32; 4],
        /// Second row.
        pub camera_from_body_y: [f32; 4],
        /// Third row.
        pub camera_from_body_z: [f32; 4],
        /// Clip coordinates from camera coordinates: factors of x and y.
        pub clip_scale: [f32; 2],
        /// Clip coordinates from camera coordinates: factors of z.
        pub clip_offset: [f32; 2],
        /// Width and height in pixels.
        pub size: [f32; 2],
        /// Distance of the near plane [m].
        pub near: f32,
        /// Motion in the image that culling allows for [px].
        pub margin: f32,
    }

    /// A draw of indexed triangles as the device reads it (VkDrawIndexedIndirectCommand).
    pub struct DrawCommand {
        /// Three a triangle.
        pub index_count: u32,
        /// 1.
        pub instance_count: u32,
        /// Of all triangles.
        pub first_index: u32,
        /// 0.
        pub vertex_offset: i32,
        /// 0.
        pub first_instance: u32,
    }

    /// The Sun's parallel view of the craft.
    pub struct SunView {
        /// Column of a point [texels]: factors of its coordinates, and what is added.
        pub texel_from_body_x: [f32; 4],
        /// Row of a point [texels].
        pub texel_from_body_y: [f32; 4],
        /// Depth of a point, 0 to 1.
        pub texel_from_body_z: [f32; 4],
        /// Unit vector to the Sun, body frame; w: how far a node is lifted off its surface [m].
        pub sun: [f32; 4],
        /// Unit vector along rows; w: depth of one texel's side.
        pub right: [f32; 4],
        /// Unit vector along columns; w: texels each way.
        pub down: [f32; 4],
    }

    /// A box of the tree that rays are tried against.
    pub struct ShadowBox {
        /// Lower corner [m].
        pub low: [f32; 3],
        /// The box to go on with where this one is missed.
        pub skip: u32,
        /// Upper corner [m].
        pub high: [f32; 3],
        /// First triangle x 8 + their number; none where there are boxes in it.
        pub triangles: u32,
    }

    /// A triangle that casts a shadow [m].
    pub struct ShadowTriangle {
        /// A corner.
        pub corner: [f32; 4],
        /// The edge to the next.
        pub first: [f32; 4],
        /// The edge to the last.
        pub second: [f32; 4],
    }

    /// A point of the Sun's disc.
    pub struct SunRay {
        /// Unit vector to the middle of the Sun; w: how far a ray starts off its surface [m].
        pub sun: [f32; 4],
        /// Unit vector to the point; w: its share of the disc.
        pub direction: [f32; 4],
        /// Boxes of the tree.
        pub boxes: u32,
        /// The structure is as long as its alignment in GLSL asks.
        pub unused: [u32; 3],
    }

    /// Head of the table of a band.
    pub struct Band {
        /// c2 / longest wavelength [K].
        pub edge_high: f32,
        /// What its rounding left [K].
        pub edge_low: f32,
    }

    /// How many steps of a response to take at once.
    pub struct Steps {
        /// Steps.
        pub count: u32,
        /// Groups of four nodes of one step.
        pub groups: u32,
    }

    /// A node of a network.
    pub struct NetworkNode {
        /// 1 / C [K/J]; 0 of a node that stores no heat.
        pub inverse_capacitance: f32,
        /// C [J/K].
        pub capacitance: f32,
        /// Stefan-Boltzmann constant x emissivity x area to space [W/K4].
        pub emission: f32,
        /// Sum of GL [W/K].
        pub conductance_sum: f32,
        /// Stefan-Boltzmann constant x (sum of GR + emissivity x area) [W/K4].
        pub emission_sum: f32,
        /// Its first link.
        pub links_begin: u32,
        /// The one after its last link.
        pub links_end: u32,
    }

    /// What a node exchanges with one neighbour.
    pub struct NetworkLink {
        /// The other node.
        pub neighbour: u32,
        /// GL [W/K].
        pub conductance: f32,
        /// Stefan-Boltzmann constant x GR [W/K4].
        pub exchange: f32,
    }

    /// One stage of RKL2.
    pub struct NetworkStage {
        /// Weight of the last stage.
        pub mu: f32,
        /// Weight of the one before.
        pub nu: f32,
        /// Weight of the rate of the last stage [s].
        pub mu_step: f32,
        /// Weight of the rate at the start [s].
        pub gamma_step: f32,
        /// Time of the stage [s] since the sub-step's start.
        pub time: f32,
    }

    /// What one dispatch of the fused kernels of a network does.
    pub struct NetworkAttempt {
        /// Nodes.
        pub nodes: u32,
        /// Sub-steps, or iterations of a balance.
        pub count: u32,
        /// Stages of a sub-step.
        pub stages: u32,
        /// Sensors.
        pub sensors: u32,
        /// Arithmetic nodes without arithmetic neighbours.
        pub lone: u32,
        /// Start [s] since the heat was set.
        pub time: f32,
        /// Length of a sub-step [s].
        pub step: f32,
        /// Radiative temperature of space [K].
        pub space_temperature: f32,
        /// Weight of the rates at the end of a sub-step in the estimate of its error [s].
        pub error_end: f32,
        /// Of the rates at its start [s].
        pub error_start: f32,
        /// Of the change.
        pub error_change: f32,
        /// Turns of loops of a sub-step.
        pub loops_sub_step: u32,
        /// Turns of loops of an iteration of Newton's method.
        pub loops_iteration: u32,
        /// Nodes of the system that is solved by elimination.
        pub unknowns: u32,
        /// Levels of the elimination.
        pub levels: u32,
        /// First of the nodes in the schedule.
        pub nodes_at: u32,
        /// First of the links' entries.
        pub entries_at: u32,
        /// First of the levels.
        pub levels_at: u32,
        /// First of the targets.
        pub targets_at: u32,
        /// First of the terms.
        pub terms_at: u32,
        /// First of the pivots.
        pub pivots_at: u32,
        /// First of the entries right of the pivots.
        pub uppers_at: u32,
        /// First entry of the matrix that only elimination fills.
        pub fill_begin: u32,
        /// The one after the last.
        pub fill_end: u32,
        /// First entry of the right side.
        pub right_at: u32,
    }

    /// What one dispatch of the wide kernels and of the solver of a network does.
    pub struct NetworkPass {
        /// Invocations that work; of the solver's decisions, workgroups that left a part.
        pub count: u32,
        /// Where the sensors of this sub-step lie.
        pub sensed_at: u32,
        /// Whether an update is the first; what the solver decides.
        pub mode: u32,
        /// Time of the stage [s] since the heat was set.
        pub time: f32,
        /// Radiative temperature of space [K].
        pub space_temperature: f32,
        /// Weight of the last stage; in the estimate of the error that of the change; of a right side, of the heat now.
        pub mu: f32,
        /// Weight of the stage before; of a right side, of the heat at the start.
        pub nu: f32,
        /// Weight of the rate of the last stage [s]; of a right side, of what the change stores.
        pub mu_step: f32,
        /// Weight of the rate at the start [s]; of a right side, of what the change of the first stage stores.
        pub gamma_step: f32,
        /// 1 / (alpha h) [1/s].
        pub inverse_step: f32,
        /// Share of the first residual, squared, at which conjugate gradients stop; relative change of a temperature at which
        /// Newton's method does, which after `mu` iterations may be four times as large.
        pub accuracy: f32,
    }

    /// What the solver of a large network knows of itself.
    pub struct NetworkSolver {
        /// Product of residual and preconditioned residual [W K].
        pub gamma: f32,
        /// Step along the direction.
        pub alpha: f32,
        /// What of it the solution moves by: 0 once there is no more to gain.
        pub step: f32,
        /// Share of the last direction in the next.
        pub beta: f32,
        /// `gamma` of the first iteration.
        pub gamma_start: f32,
        /// `gamma` of the first system of a stage.
        pub gamma_first: f32,
        /// Iterations of conjugate gradients.
        pub gradients: f32,
        /// 1 where more would change nothing.
        pub gradients_done: f32,
        /// Iterations of Newton's method.
        pub newtons: f32,
        /// 1 where more would change nothing.
        pub newtons_done: f32,
        /// Most iterations of one system.
        pub most_gradients: f32,
        /// Most iterations of Newton's method of one stage.
        pub most_newtons: f32,
        /// All iterations of conjugate gradients.
        pub iterations: f32,
        /// 1 where a system needed more iterations than were recorded.
        pub short_gradients: f32,
        /// 1 where a stage did.
        pub short_newtons: f32,
        /// 1 where what came was no number.
        pub lost: f32,
        /// Largest relative change of a temperature in the last iteration.
        pub largest_move: f32,
    }
}

impl Material {
    /// Fills in how its nodes move.
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

impl SunView {
    /// The view rounded to f32.
    pub fn new(view: &crate::environment::shadow::SunView) -> Self {
        let with = |v: glam::DVec3, w: f64| [v.x as f32, v.y as f32, v.z as f32, w as f32];
        let [x, y, z] = view.rows().map(|row| row.map(|value| value as f32));
        Self {
            texel_from_body_x: x,
            texel_from_body_y: y,
            texel_from_body_z: z,
            sun: with(view.sun, view.lift()),
            right: with(view.right, view.texel_depth()),
            down: with(view.down, f64::from(view.resolution)),
        }
    }
}

/// Rows of a rigid motion, rounded to f32; rays take those of body_from_joint after their `SunRay`.
pub fn rows(motion: &glam::DAffine3) -> [[f32; 4]; 3] {
    [0, 1, 2].map(|i| {
        let rotation = motion.matrix3.row(i);
        [rotation.x as f32, rotation.y as f32, rotation.z as f32, motion.translation[i] as f32]
    })
}

/// Steps that one dispatch takes at most: STEPS of glsl/thermal_step.comp. Their Sun samples fill 4 of the 16 KiB that
/// every device reads as a uniform, and no driver ends a loop of so few turns.
pub const FUSED_STEPS: usize = 32;

/// Bytes between the slices of joints in a uniform buffer: what every device can begin a binding at.
pub const SLICE: usize = 256;

/// The tree and the triangles of [`Occluders`], rounded to f32; boxes grow by the rounding.
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
