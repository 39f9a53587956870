//! The order of a network's nodes on the device: sections of groups whose nodes are treated alike.

/// Work of a dispatch.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum OnePassKind {
    /// Nodes without conductors take the whole step.
    Alone,
    /// Nodes without capacity take the temperatures of their balance.
    Balance,
    /// Other nodes outside blocks take the whole step.
    Advance,
    /// Computes what the nodes of blocks receive.
    Drive,
    /// Conduction inside the blocks.
    Conduct,
}

/// Sizes that the passes of a network depend on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OnePassShape {
    /// Group of four nodes after the last one of each of the [`SECTIONS`].
    pub ends: [u32; SECTIONS.len()],
    /// Number of heaters.
    pub heaters: u32,
}

/// A run of groups whose nodes are treated alike.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Section {
    /// Work on the nodes of the section.
    pub kind: OnePassKind,
    /// Whether they radiate to other nodes.
    pub(crate) radiative: bool,
    /// Whether a Runge-Kutta step is too coarse for one of them.
    pub(crate) fast: bool,
    /// Whether they are in large blocks.
    pub(crate) large: bool,
}

pub(super) const fn section(kind: OnePassKind, radiative: bool, fast: bool) -> Section {
    Section { kind, radiative, fast, large: false }
}

const fn large(radiative: bool, fast: bool) -> Section {
    Section { kind: OnePassKind::Drive, radiative, fast, large: true }
}

/// Sections of the groups in order. Large blocks come first, then other blocks, and what has no estimate last.
pub const SECTIONS: [Section; 15] = [
    large(true, true),
    large(true, false),
    large(false, true),
    large(false, false),
    section(OnePassKind::Drive, true, true),
    section(OnePassKind::Drive, true, false),
    section(OnePassKind::Drive, false, true),
    section(OnePassKind::Drive, false, false),
    section(OnePassKind::Advance, true, true),
    section(OnePassKind::Advance, true, false),
    section(OnePassKind::Advance, false, true),
    section(OnePassKind::Advance, false, false),
    section(OnePassKind::Alone, false, true),
    section(OnePassKind::Alone, false, false),
    section(OnePassKind::Balance, true, false),
];
/// Number of sections with large blocks.
const LARGE: usize = 4;
/// Number of sections with blocks.
const BLOCKS: usize = 8;
/// Number of sections with an estimate.
const ESTIMATED: usize = 12;

impl OnePassShape {
    /// Groups in large blocks.
    pub(crate) fn in_large(&self) -> u32 {
        self.ends[LARGE - 1]
    }

    /// Groups in blocks.
    pub(crate) fn in_blocks(&self) -> u32 {
        self.ends[BLOCKS - 1]
    }

    /// All groups.
    pub(crate) fn groups(&self) -> u32 {
        self.ends[SECTIONS.len() - 1]
    }

    /// Groups whose error is estimated.
    pub(crate) fn estimated(&self) -> u32 {
        self.ends[ESTIMATED - 1]
    }

    /// The sections with nodes, and their groups.
    pub(super) fn sections(&self) -> impl Iterator<Item = (Section, (u32, u32))> {
        let starts = std::iter::once(0).chain(self.ends);
        SECTIONS.into_iter().zip(starts.zip(self.ends)).filter(|(_, (first, end))| first < end)
    }
}
