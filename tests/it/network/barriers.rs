//! The frames of large networks: no hazard as they are, and one wherever a barrier is taken away.

use std::collections::BTreeMap;

use isotherm::gpu::frame::Frame;
use isotherm::gpu::hazard::hazards;
use isotherm::gpu::network::frame::WidePlan;
use isotherm::gpu::network::uses::uses;
use isotherm::gpu::pass::{Resource, Step, is_write};

use crate::shaders::{bindings_of, wide_variants};

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
            let (coupled, iterations) = (false, [1, 1]);
            plans.push(WidePlan { radiative: lone, tails: lone, lone, coupled, sensors, stages, iterations });
        }
    }
    plans
}

/// Those that solve systems.
fn solving_plans() -> Vec<WidePlan> {
    let mut plans = Vec::new();
    for (stages, coupled) in [(0, false), (0, true), (1, true), (3, true)] {
        for iterations in [[1, 1], [2, 3]] {
            let (radiative, tails, lone, sensors) = (coupled, false, false, true);
            plans.push(WidePlan { radiative, tails, lone, coupled, sensors, stages, iterations });
        }
    }
    plans
}

/// What the host reads after the last submission without a barrier.
fn unread(frames: &[Frame]) -> bool {
    let host = [Resource::NetworkErrors, Resource::NetworkSensed, Resource::SolverScalars, Resource::NetworkKept];
    let mut waiting = Vec::new();
    for step in frames.iter().flat_map(|frame| &frame.steps) {
        match step {
            Step::Pass(pass) => {
                let written = pass.accesses.iter().filter(|access| is_write(access.scope.access));
                waiting.extend(written.map(|access| access.resource).filter(|one| host.contains(one)));
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
    for plan in plans().into_iter().chain(solving_plans()) {
        let frames = frames(plan);
        let found = hazards(&frames);
        assert!(found.is_empty(), "{plan:?}: {} hazards, such as {}", found.len(), found[0]);
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

/// Every pass of the solver has barriers of its own: without all that are recorded together there is a hazard.
#[test]
fn barriers_of_the_solver_that_are_taken_away_are_missed() {
    for plan in solving_plans().into_iter().filter(|plan| plan.coupled && plan.iterations == [2, 3]) {
        // A sub-step, and what comes before and after it.
        let whole = frames(plan)[1..9].to_vec();
        for number in [6] {
            for place in 0..whole[number].steps.len() {
                if matches!(whole[number].steps[place], Step::Barriers(_)) {
                    let mut broken = whole.clone();
                    broken[number].steps.remove(place);
                    assert!(!hazards(&broken).is_empty(), "{plan:?}: frame {number} without step {place}");
                }
            }
        }
    }
}

/// What the shaders read and write is what the passes declare.
#[test]
fn passes_declare_what_their_shaders_touch() {
    for variant in wide_variants() {
        let declared: BTreeMap<u32, bool> = uses(variant).iter().map(|one| (one.binding, one.writes)).collect();
        let shader = variant.shader();
        for (binding, (written, _)) in bindings_of(&shader) {
            let found = declared.get(&binding);
            assert!(found.is_some(), "{}: binding {binding} is not declared", shader.name());
            assert!(found == Some(&true) || !written, "{}: binding {binding} is written", shader.name());
        }
    }
}
