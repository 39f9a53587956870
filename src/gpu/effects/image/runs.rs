//! Runs of triangles that are culled and drawn together.

use crate::gpu::layout::DrawCommand;

/// Size of the three indices of a triangle [bytes].
pub(crate) const CORNERS: usize = 12;

/// A run of triangles whose nodes belong to one joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TriangleRun {
    /// The joint; 0 is the body.
    pub joint: u32,
    /// First triangle and the one after the last.
    pub triangles: (u32, u32),
}

/// Triangles of one draw, which one workgroup of `cull.comp` culls.
pub(crate) const TRIANGLES_A_DRAW: u32 = 2048;

/// Draw commands that are bound together. Their 1280 bytes are a multiple of every device's offset alignment.
const DRAWS_BOUND: u32 = 64;

/// Most triangles that one dispatch culls, so that the binding stays below 128 MiB.
const CULLED_AT_ONCE: u32 = 32 * DRAWS_BOUND * TRIANGLES_A_DRAW;

impl TriangleRun {
    /// First draw of the run and the one after the last. Each joint has one run, so two runs never share a draw.
    pub(crate) fn draws(self) -> (u32, u32) {
        let (first, end) = self.triangles;
        let before = DRAWS_BOUND * (first / (DRAWS_BOUND * TRIANGLES_A_DRAW) + self.joint);
        (before, before + (end - first).div_ceil(TRIANGLES_A_DRAW))
    }

    /// Splits the run into runs of one culling dispatch and one draw call each.
    pub(crate) fn pieces(self) -> impl Iterator<Item = Self> {
        let (first, end) = self.triangles;
        let piece = move |at: u32| (at, end.min(at.saturating_add(CULLED_AT_ONCE)));
        (first..end).step_by(CULLED_AT_ONCE as usize).map(move |at| Self { triangles: piece(at), ..self })
    }
}

/// Draw commands of all triangles, for drawing without culling.
pub(crate) fn whole_draws(runs: &[TriangleRun]) -> Vec<DrawCommand> {
    let mut draws = Vec::new();
    for run in runs.iter().flat_map(|run| run.pieces()) {
        let (first, end) = run.draws();
        draws.resize(first as usize, DrawCommand::default());
        let left = run.triangles.1 - run.triangles.0;
        draws.extend((0..end - first).map(|number| {
            let before = TRIANGLES_A_DRAW * number;
            DrawCommand {
                index_count: 3 * TRIANGLES_A_DRAW.min(left - before),
                instance_count: 1,
                first_index: 3 * (run.triangles.0 + before),
                vertex_offset: 0,
                first_instance: 0,
            }
        }));
    }
    draws
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Also covers joints without triangles, and a run of several dispatches.
    #[test]
    fn no_two_runs_of_a_scene_share_a_draw() {
        let (mut start, mut free) = (0, 0);
        for (joint, count) in [(0, 5_000_000), (1, 1), (2, 130_000), (5, 64), (6, 9_000_000)] {
            let run = TriangleRun { joint, triangles: (start, start + count) };
            let pieces: Vec<TriangleRun> = run.pieces().collect();
            assert_eq!(pieces[0].triangles.0, start);
            assert_eq!(pieces.iter().map(|piece| piece.triangles.1 - piece.triangles.0).sum::<u32>(), count);
            for (first, end) in pieces.into_iter().map(TriangleRun::draws) {
                assert!(first >= free && first % DRAWS_BOUND == 0, "joint {joint}: {first} after {free}");
                free = end;
            }
            start += count.next_multiple_of(64);
        }
    }
}
