//! A hand-written transition for the processor: f32 arrays, a loop over chunks, rayon. It is a peer of the device's
//! pass and shares only the numbers of the load with Isotherm.
//!
//! It supports one material and a power of 1 or 2, which is less than the device's pass.

use rayon::prelude::*;

use isotherm::internals;
use isotherm::internals::StepLoad;

/// Nodes in a chunk. Its seven arrays fit into the first-level cache.
const CHUNK: usize = 1024;
/// W m-2 K-4, CODATA 2018.
const STEFAN_BOLTZMANN: f32 = 5.670_374e-8;

/// One material.
#[derive(Debug, Clone, Copy)]
pub struct Surface {
    pub absorptivity: f32,
    pub emissivity: f32,
    /// Steps that a transition takes.
    pub t_max: f32,
}

/// The planet at a step.
struct Planet {
    nadir: [f32; 3],
    sunward: [f32; 3],
    across: [f32; 3],
    /// Sine of the planet's angular radius.
    sine: f32,
    cosine: f32,
    infrared: f32,
    albedo_flux: f32,
    albedo: Vec<f32>,
}

/// A load in single precision.
pub struct Load {
    /// Direction and flux of each Sun sample.
    sun: Vec<[f32; 4]>,
    planet: Option<Planet>,
    space_4: f32,
}

impl Load {
    pub fn new(load: &StepLoad) -> Self {
        let single = |v: glam::DVec3| v.as_vec3().to_array();
        let sun = load.sun.iter().map(|sample| {
            let [x, y, z] = single(sample.direction);
            [x, y, z, sample.flux as f32]
        });
        let planet = load.planet.as_ref().map(|planet| {
            let sine = 1.0 / planet.distance_ratio;
            Planet {
                nadir: single(planet.nadir),
                sunward: single(planet.sunward),
                across: single(planet.nadir.cross(planet.sunward)),
                sine: sine as f32,
                cosine: (1.0 - sine * sine).sqrt() as f32,
                infrared: planet.planet_ir as f32,
                albedo_flux: planet.albedo_flux as f32,
                albedo: load.albedo.iter().flat_map(|table| &table.values).map(|value| *value as f32).collect(),
            }
        });
        Self { sun: sun.collect(), planet, space_4: load.background_temperature.powi(4) as f32 }
    }
}

/// All nodes as one array for each quantity.
#[derive(Clone)]
pub struct Nodes {
    normals: [Vec<f32>; 3],
    target: Vec<f32>,
    span: Vec<f32>,
    elapsed: Vec<f32>,
    pub temperature: Vec<f32>,
}

struct Chunk<'a> {
    normals: [&'a [f32]; 3],
    target: &'a mut [f32],
    span: &'a mut [f32],
    elapsed: &'a mut [f32],
    temperature: &'a mut [f32],
}

impl Nodes {
    /// Nodes with these normals at rest under a load.
    pub fn settled(normals: &[glam::Vec3], load: &Load, surface: &Surface) -> Self {
        let axis = |axis: usize| normals.iter().map(|normal| normal[axis]).collect::<Vec<f32>>();
        let zeros = || vec![0.0f32; normals.len()];
        let normals = [axis(0), axis(1), axis(2)];
        let mut nodes = Self { normals, target: zeros(), span: zeros(), elapsed: zeros(), temperature: zeros() };
        nodes.chunks().for_each(|chunk| {
            balances(&chunk.normals, load, surface, chunk.target);
            chunk.temperature.copy_from_slice(chunk.target);
            chunk.elapsed.fill(surface.t_max);
        });
        nodes
    }

    fn chunks(&mut self) -> impl IndexedParallelIterator<Item = Chunk<'_>> {
        let [x, y, z] = &self.normals;
        let state = (&mut self.target, &mut self.span, &mut self.elapsed, &mut self.temperature);
        let (target, span, elapsed, temperature) = state;
        let arrays = (
            x.par_chunks(CHUNK),
            y.par_chunks(CHUNK),
            z.par_chunks(CHUNK),
            target.par_chunks_mut(CHUNK),
            span.par_chunks_mut(CHUNK),
            elapsed.par_chunks_mut(CHUNK),
            temperature.par_chunks_mut(CHUNK),
        );
        arrays.into_par_iter().map(|(x, y, z, target, span, elapsed, temperature)| Chunk {
            normals: [x, y, z],
            target,
            span,
            elapsed,
            temperature,
        })
    }

    /// Does one step. Without a load the targets stay. `wide` uses instructions beyond the x86-64 of 2003, which `cargo
    /// build --release` does not use.
    pub fn step(&mut self, load: Option<&Load>, surface: &Surface, power: u32, wide: bool) {
        let step = match (power, wide && has_avx2()) {
            (1, false) => chunk_step::<1>,
            (_, false) => chunk_step::<2>,
            (1, true) => chunk_step_avx2::<1>,
            (_, true) => chunk_step_avx2::<2>,
        };
        self.chunks().for_each(|chunk| step(chunk, load, surface));
    }
}

/// Whether the processor has AVX2 and fused multiply-add.
pub fn has_avx2() -> bool {
    #[cfg(target_arch = "x86_64")]
    return is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma");
    #[cfg(not(target_arch = "x86_64"))]
    false
}

fn chunk_step_avx2<const POWER: u32>(chunk: Chunk<'_>, load: Option<&Load>, surface: &Surface) {
    #[cfg(target_arch = "x86_64")]
    {
        #[target_feature(enable = "avx2,fma")]
        fn with_avx2<const POWER: u32>(chunk: Chunk<'_>, load: Option<&Load>, surface: &Surface) {
            chunk_step::<POWER>(chunk, load, surface);
        }
        // SAFETY: only called where `has_avx2` found both features.
        unsafe { with_avx2::<POWER>(chunk, load, surface) }
    }
    #[cfg(not(target_arch = "x86_64"))]
    chunk_step::<POWER>(chunk, load, surface);
}

#[inline(always)]
fn chunk_step<const POWER: u32>(chunk: Chunk<'_>, load: Option<&Load>, surface: &Surface) {
    let Chunk { normals, target, span, elapsed, temperature } = chunk;
    let inverse = 1.0 / surface.t_max;
    if let Some(load) = load {
        let mut commanded = [0.0f32; CHUNK];
        let commanded = &mut commanded[..target.len()];
        balances(&normals, load, surface, commanded);
        for i in 0..target.len() {
            let gone = 1.0 - elapsed[i] * inverse;
            let (merged, phase) = merged::<POWER>(span[i], commanded[i] - target[i], gone.max(0.0));
            target[i] = commanded[i];
            span[i] = merged;
            elapsed[i] = surface.t_max * (1.0 - phase);
        }
    }
    for i in 0..target.len() {
        elapsed[i] = (elapsed[i] + 1.0).min(surface.t_max);
        let left = 1.0 - elapsed[i] * inverse;
        temperature[i] = target[i] - span[i] * if POWER == 2 { left * left } else { left };
    }
}

/// The merge rule of docs/numerics.md 1 for a change `d` of the target: the new span and the remaining share of time.
#[inline(always)]
fn merged<const POWER: u32>(span: f32, d: f32, left: f32) -> (f32, f32) {
    let share = if POWER == 2 { left * left } else { left };
    let rate = if POWER == 2 {
        left
    } else if left > 0.0 {
        1.0
    } else {
        0.0
    };
    let u = span * share + d;
    let q = span * rate + d;
    let fresh = u * q <= 0.0 || q.abs() < u.abs();
    let phase = if fresh { 1.0 } else { u / q };
    let share = if POWER == 2 { phase * phase } else { phase };
    let new = if fresh { u } else { u / share };
    if d == 0.0 { (span, left) } else { (new, phase) }
}

/// Balance temperatures of a chunk [K].
#[inline(always)]
fn balances(normals: &[&[f32]; 3], load: &Load, surface: &Surface, into: &mut [f32]) {
    let [x, y, z] = normals.map(|axis| &axis[..into.len()]);
    into.fill(0.0);
    for [sx, sy, sz, flux] in &load.sun {
        let flux = surface.absorptivity * flux;
        for i in 0..into.len() {
            into[i] += flux * (x[i] * sx + y[i] * sy + z[i] * sz).max(0.0);
        }
    }
    if let Some(planet) = &load.planet {
        for i in 0..into.len() {
            let [nx, ny, nz] = planet.nadir;
            into[i] += surface.emissivity * planet.infrared * planet.view_factor(x[i] * nx + y[i] * ny + z[i] * nz);
        }
        if !planet.albedo.is_empty() {
            for i in 0..into.len() {
                into[i] += surface.absorptivity * planet.albedo_flux * planet.albedo([x[i], y[i], z[i]]);
            }
        }
    }
    let inverse = 1.0 / (surface.emissivity * STEFAN_BOLTZMANN);
    for value in into {
        *value = (*value * inverse + load.space_4).sqrt().sqrt();
    }
}

impl Planet {
    /// View factor from a plate to a sphere, exact for every tilt.
    #[inline(always)]
    fn view_factor(&self, cos_tilt: f32) -> f32 {
        let (sine, cosine) = (self.sine, self.cosine);
        let x = (cos_tilt / sine).clamp(-1.0, 1.0);
        let w = ((1.0 - x) * (1.0 + x)).sqrt();
        let cap = arc_tangent(sine * w, cosine);
        let arc = arc_tangent(w, -cosine * x);
        let cut = (cap - sine * cosine * w + sine * sine * cos_tilt * arc).max(0.0) * std::f32::consts::FRAC_1_PI;
        let seen = if cos_tilt >= sine { sine * sine * cos_tilt } else { cut };
        if cos_tilt <= -sine { 0.0 } else { seen }
    }

    /// The step's albedo table over the directions of a normal (octahedral), bilinear.
    #[inline(always)]
    fn albedo(&self, normal: [f32; 3]) -> f32 {
        const LAST: f32 = internals::RESOLUTION as f32 - 1.0;
        const MIDDLE: f32 = 0.5 * internals::RESOLUTION as f32;
        const STRIDE: usize = internals::RESOLUTION + 1;
        let dot = |axis: &[f32; 3]| normal[0] * axis[0] + normal[1] * axis[1] + normal[2] * axis[2];
        let (x, y, z) = (dot(&self.sunward), dot(&self.across), dot(&self.nadir));
        let sum = (x.abs() + y.abs() + z.abs()).max(1e-6);
        let (column, row) = (x * (MIDDLE / sum) + MIDDLE, z * (MIDDLE / sum) + MIDDLE);
        let (left, top) = (column.floor().min(LAST), row.floor().min(LAST));
        let (u, v) = (column - left, row - top);
        let at = top as usize * STRIDE + left as usize;
        let upper = self.albedo[at] * (1.0 - u) + self.albedo[at + 1] * u;
        let lower = self.albedo[at + STRIDE] * (1.0 - u) + self.albedo[at + STRIDE + 1] * u;
        sum * (upper * (1.0 - v) + lower * v)
    }
}

/// Arc tangent of y / x in [0, pi] for y >= 0, without branches (Cephes' atanf, S. Moshier). Compilers cannot vectorise
/// calls of `f32::atan2`.
#[inline(always)]
fn arc_tangent(y: f32, x: f32) -> f32 {
    use std::f32::consts::{FRAC_PI_2, FRAC_PI_4, PI};
    let ax = x.abs();
    let t = ax.min(y) / ax.max(y).max(1e-30);
    let upper = t > 0.414_213_56;
    let z = if upper { (t - 1.0) / (t + 1.0) } else { t };
    let z2 = z * z;
    let series = ((8.053_744_5e-2 * z2 - 1.387_768_6e-1) * z2 + 1.997_771e-1) * z2 - 3.333_295e-1;
    let angle = series * z2 * z + z + if upper { FRAC_PI_4 } else { 0.0 };
    let angle = if y > ax { FRAC_PI_2 - angle } else { angle };
    if x < 0.0 { PI - angle } else { angle }
}
