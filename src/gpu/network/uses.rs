//! What each pass over a large network binds: the numbers are those of glsl/network_wide.comp and glsl/network_solve.comp.

use crate::gpu::pass::Resource;
use crate::gpu::wide_variant::{WideKind, WideVariant};

/// What a binding points to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Target {
    /// What never changes on the device: number of the table.
    Table,
    /// The present stage.
    Present,
    /// The next stage.
    Next,
    /// A resource.
    Of(Resource),
    /// The list of groups of nodes, or of sensors.
    List,
}

/// One binding.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Use {
    /// Number.
    pub binding: u32,
    /// What it points to.
    pub target: Target,
    /// Whether the pass reads it.
    pub reads: bool,
    /// Whether the pass writes it.
    pub writes: bool,
}

/// Tables: rows, slices, neighbours, conductances, radiators, tails, links, and the heat, which the host writes.
const TABLES: std::ops::Range<u32> = 0..8;
/// Bindings of tables that only nodes with radiation, and with long rows, have.
const RADIATORS: u32 = 4;
const TAILS: [u32; 2] = [5, 6];

/// The bindings of a pass.
pub fn uses(variant: WideVariant) -> Vec<Use> {
    use Resource as R;
    let read = |binding, target| Use { binding, target, reads: true, writes: false };
    let write = |binding, target| Use { binding, target, reads: false, writes: true };
    let both = |binding, target| Use { binding, target, reads: true, writes: true };
    let (present, gathered) = (read(8, Target::Present), read(9, Target::Present));
    let start = |how: fn(u32, Target) -> Use| how(11, Target::Of(R::NetworkStart));
    let rates = |how: fn(u32, Target) -> Use| how(12, Target::Of(R::NetworkRates));
    let listed = read(13, Target::List);
    let of = |how: fn(u32, Target) -> Use, binding, resource| how(binding, Target::Of(resource));
    let right_side = [of(write, 18, R::SolverConditioned), of(write, 25, R::SolverDiagonal)];
    let mut uses = Vec::new();
    if variant.kind.evaluates() {
        let wanted = |binding: &u32| match *binding {
            RADIATORS => variant.radiative,
            binding if TAILS.contains(&binding) => variant.tails,
            _ => true,
        };
        uses.extend(TABLES.filter(wanted).map(|binding| read(binding, Target::Table)));
    }
    match variant.kind {
        WideKind::Begin => uses.extend([present, gathered, rates(write)]),
        WideKind::First => uses.extend([present, write(10, Target::Next), start(write), rates(read)]),
        WideKind::Stage => uses.extend([present, gathered, both(10, Target::Next), start(read), rates(read)]),
        WideKind::Lone => {
            uses.extend([both(8, Target::Present), gathered]);
            uses.push(listed);
        }
        WideKind::Last => {
            uses.extend([present, gathered, start(read), rates(both), of(both, 15, R::NetworkErrors)]);
        }
        WideKind::Sense => uses.extend([gathered, read(13, Target::List), of(write, 16, R::NetworkSensed)]),
        WideKind::Start => uses.extend([present, gathered, write(10, Target::Next), start(write), rates(write)]),
        WideKind::Balance => {
            uses.extend([present, gathered]);
            uses.push(listed);
            uses.extend(right_side);
        }
        WideKind::Residual => {
            uses.extend([present, gathered, read(10, Target::Next), start(read), rates(read)]);
            uses.push(listed);
            uses.extend(right_side);
        }
        WideKind::Product => {
            uses.push(listed);
            uses.extend([
                of(read, 18, R::SolverConditioned),
                of(read, 19, R::SolverConditioned),
                of(write, 24, R::SolverProduct),
                of(read, 25, R::SolverDiagonal),
                of(write, 27, R::SolverPartials),
            ]);
            if variant.radiative {
                uses.extend([present, gathered]);
            }
        }
        WideKind::Scalars => uses.extend([of(read, 27, R::SolverPartials), of(both, 28, R::SolverScalars)]),
        WideKind::Update => {
            uses.push(listed);
            uses.extend([
                of(both, 18, R::SolverConditioned),
                of(both, 21, R::SolverDirection),
                of(both, 22, R::SolverProductDirection),
                of(both, 23, R::SolverSolution),
                of(read, 24, R::SolverProduct),
                of(read, 25, R::SolverDiagonal),
                of(read, 28, R::SolverScalars),
            ]);
        }
        WideKind::Move => {
            uses.push(listed);
            uses.extend([
                both(8, Target::Present),
                of(read, 23, R::SolverSolution),
                of(write, 27, R::SolverPartials),
                of(read, 28, R::SolverScalars),
            ]);
        }
        WideKind::Middle => {
            uses.push(listed);
            uses.extend([present, read(10, Target::Next), start(write)]);
        }
        WideKind::Estimate => {
            uses.push(listed);
            uses.extend([
                present,
                gathered,
                read(10, Target::Next),
                of(both, 15, R::NetworkErrors),
                of(read, 23, R::SolverSolution),
                of(read, 25, R::SolverDiagonal),
            ]);
        }
    }
    uses
}
