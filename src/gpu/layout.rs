//! Every structure shared with GLSL, once in Rust; `glsl/types.glsl` is the other side, compared by tests/it/layout.rs.

use bytemuck::{Pod, Zeroable};

use crate::thermal::material::{Profile, Transition};

/// Values of one material.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct Material {
    /// Solar absorptivity of the outside.
    pub absorptivity: f32,
    /// Infrared emissivity of the outside.
    pub emissivity: f32,
    /// Solar absorptivity of the back; that of the outside where only the outside exchanges heat.
    pub back_absorptivity: f32,
    /// Infrared emissivity of the back, likewise.
    pub back_emissivity: f32,
    /// On heating: power of the remaining share, 1 linear, 2 quadratic; 0 of a shaped transition.
    pub heating_function: f32,
    /// Time to the target on heating [steps].
    pub heating_t_max: f32,
    /// The same on cooling.
    pub cooling_function: f32,
    /// Time to the target on cooling [steps].
    pub cooling_t_max: f32,
}

impl Material {
    /// Fills in how its nodes move; the functions of a shaped transition are in its shader.
    pub fn set_transition(&mut self, transition: &Transition) {
        let power =
            |profile: &Profile| profile.function.power().filter(|_| transition.is_power()).unwrap_or(0.0) as f32;
        [self.heating_function, self.cooling_function] = [power(&transition.heating), power(&transition.cooling)];
        self.heating_t_max = transition.heating.t_max_steps as f32;
        self.cooling_t_max = transition.cooling.t_max_steps as f32;
    }
}

/// What one tick commands, the same for every node.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct Tick {
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
    /// Length of the tick in steps.
    pub step: f32,
    /// Intervals of the albedo table each way.
    pub albedo_resolution: f32,
    /// The structure is as long as its alignment in GLSL asks.
    pub unused: [f32; 3],
}

/// Where the image is taken from, and with what.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
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
    /// The structure is as long as its alignment in GLSL asks.
    pub unused: f32,
}

/// Head of the table of a band.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct Band {
    /// c2 / longest wavelength [K].
    pub edge_high: f32,
    /// What its rounding left [K].
    pub edge_low: f32,
}

/// How many steps of a response to take at once.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct Steps {
    /// Steps.
    pub count: u32,
    /// Groups of four nodes of one step.
    pub groups: u32,
}

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

macro_rules! members {
    ($structure:ty: $($field:ident: $kind:ty),*) => {
        (stringify!($structure), size_of::<$structure>(), vec![$(Member {
            name: stringify!($field),
            offset: std::mem::offset_of!($structure, $field),
            size: size_of::<$kind>(),
        }),*])
    };
}

/// Name, size and members of every shared structure.
pub fn structures() -> Vec<(&'static str, usize, Vec<Member>)> {
    vec![
        members!(Material: absorptivity: f32, emissivity: f32, back_absorptivity: f32, back_emissivity: f32,
            heating_function: f32, heating_t_max: f32, cooling_function: f32, cooling_t_max: f32),
        members!(Tick: nadir: [f32; 4], sunward: [f32; 4], across: [f32; 4], planet_ir: f32, albedo_flux: f32,
            background_temperature_4: f32,
            step: f32, albedo_resolution: f32),
        members!(View: camera_from_body_x: [f32; 4], camera_from_body_y: [f32; 4], camera_from_body_z: [f32; 4],
            clip_scale: [f32; 2], clip_offset: [f32; 2], size: [f32; 2], near: f32),
        members!(Band: edge_high: f32, edge_low: f32),
        members!(Steps: count: u32, groups: u32),
    ]
}
