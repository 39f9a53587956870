//! The lists of network passes: no hazard in complete lists, and a hazard if any barrier is missing.

use std::collections::BTreeMap;

use isotherm::internals::{Entry, Frame, WidePlan, uses};

use crate::hazard::{hazards, unread_by_host};
use crate::hazards::each_barrier_is_needed;
use crate::shaders::{bindings_of, wide_variants};

/// Every list of every plan.
pub fn lists_of_all_plans() -> Vec<Frame> {
    plans().into_iter().chain(solving_plans()).flat_map(frames).collect()
}

/// Attempts of several sub-steps, some accepted and some rejected. Another attempt follows the last.
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

/// A network with several workgroups.
const SIZES: WidePlan = WidePlan {
    radiative: false,
    tails: false,
    lone: false,
    coupled: false,
    groups: 512,
    arithmetic: 100,
    free: 500,
    sensors: 0,
    stages: 1,
    iterations: [1, 1],
};

fn plans() -> Vec<WidePlan> {
    let mut plans = Vec::new();
    for stages in [1, 2, 3, 5, 6] {
        for (lone, sensors) in [(false, 0), (true, 0), (false, 1), (true, 1)] {
            let (coupled, iterations) = (false, [1, 1]);
            plans.push(WidePlan { radiative: lone, tails: lone, lone, coupled, sensors, stages, iterations, ..SIZES });
        }
    }
    plans
}

/// The plans that solve linear systems.
fn solving_plans() -> Vec<WidePlan> {
    let mut plans = Vec::new();
    for (stages, coupled) in [(0, false), (0, true), (1, true), (3, true)] {
        for iterations in [[1, 1], [2, 3]] {
            let (radiative, tails, lone, sensors) = (coupled, false, false, 1);
            plans.push(WidePlan { radiative, tails, lone, coupled, sensors, stages, iterations, ..SIZES });
        }
    }
    plans
}

#[test]
fn tries_in_a_row_have_all_their_barriers() {
    for plan in plans().into_iter().chain(solving_plans()) {
        let frames = frames(plan);
        let found = hazards(&frames);
        assert!(found.is_empty(), "{plan:?}: {} hazards, such as {}", found.len(), found[0]);
        assert_eq!(unread_by_host(&frames), [], "{plan:?}");
    }
}

#[test]
fn each_barrier_of_a_network_that_is_taken_away_is_missed() {
    for plan in plans() {
        // From the second attempt on. The first was accepted.
        each_barrier_is_needed(&frames(plan), 6);
    }
}

/// Every pass of the solver needs its own barriers. Removing any group of them makes a hazard.
#[test]
fn barriers_of_the_solver_that_are_taken_away_are_missed() {
    for plan in solving_plans().into_iter().filter(|plan| plan.coupled && plan.iterations == [2, 3]) {
        // A sub-step with the passes before and after it.
        let whole = frames(plan)[1..9].to_vec();
        for number in [6] {
            for place in 0..whole[number].entries.len() {
                if matches!(whole[number].entries[place], Entry::Barriers(_)) {
                    let mut broken = whole.clone();
                    broken[number].entries.remove(place);
                    assert!(!hazards(&broken).is_empty(), "{plan:?}: frame {number} without step {place}");
                }
            }
        }
    }
}

/// Shaders read and write exactly what their passes declare.
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
