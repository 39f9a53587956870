//! The frames of large networks: no hazard as they are, and one wherever a barrier is taken away.

use isotherm::gpu::frame::Frame;
use isotherm::gpu::hazard::hazards;
use isotherm::gpu::network::frame::WidePlan;
use isotherm::gpu::pass::{Resource, Step};

/// Tries of some sub-steps, each kept or taken back; the last one is followed by another try.
fn frames(plan: WidePlan) -> Vec<Frame> {
    let mut frames = Vec::new();
    for kept in [true, false, true] {
        frames.push(plan.start());
        let mut odd = false;
        for number in 0..3 {
            let (frame, next) = plan.sub_step(number, odd);
            frames.push(frame);
            odd = next;
        }
        frames.push(plan.end());
        if kept {
            frames.push(WidePlan::keep(odd));
        }
    }
    frames
}

fn plans() -> Vec<WidePlan> {
    let mut plans = Vec::new();
    for stages in [1, 2, 3, 5, 6] {
        for (lone, sensors) in [(false, false), (true, false), (false, true), (true, true)] {
            plans.push(WidePlan { radiative: lone, lone, sensors, stages });
        }
    }
    plans
}

/// What the host reads after the last submission without a barrier.
fn unread(frames: &[Frame]) -> bool {
    let host = [Resource::NetworkErrors, Resource::NetworkSensed];
    let mut waiting = Vec::new();
    for step in frames.iter().flat_map(|frame| &frame.steps) {
        match step {
            Step::Pass(pass) => {
                waiting.extend(pass.accesses.iter().map(|access| access.resource).filter(|one| host.contains(one)));
            }
            Step::Barriers(barriers) => {
                let shown = |resource: &Resource| {
                    let reads = ash::vk::AccessFlags2::HOST_READ;
                    barriers.iter().any(|one| one.resource == *resource && one.after.access.contains(reads))
                };
                waiting.retain(|resource| !shown(resource));
            }
        }
    }
    !waiting.is_empty()
}

#[test]
fn tries_in_a_row_have_all_their_barriers() {
    for plan in plans() {
        let frames = frames(plan);
        let found = hazards(&frames);
        assert!(found.is_empty(), "{plan:?}: {}", found[0]);
        assert!(!unread(&frames), "{plan:?}");
    }
}

#[test]
fn each_barrier_of_a_network_that_is_taken_away_is_missed() {
    for plan in plans() {
        let whole = frames(plan);
        // The second try, which follows one that was kept, and what comes after it.
        for (number, frame) in whole.iter().enumerate().skip(6).take(10) {
            for n in 0..frame.barrier_count() {
                let mut broken = whole.clone();
                broken[number] = frame.without_barrier(n);
                let missed = !hazards(&broken).is_empty() || unread(&broken[..=number]);
                assert!(missed, "{plan:?}: frame {number} without barrier {n}\n{frame}");
            }
        }
    }
}
