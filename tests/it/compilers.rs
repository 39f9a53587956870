//! All shaders with the compiler of a driver whose device need not be there.

use std::collections::BTreeSet;

use isotherm::internals::{Frame, compile_pass};

use super::device::context;
use super::resources::all_lists;

/// `tools/amd` runs it on AMD's compiler, and reads what the driver writes between the names. `ISOTHERM_EVERY=12` compiles every twelfth set of shaders.
#[test]
#[ignore = "tools/amd"]
fn every_shader_compiles() {
    let context = context();
    let every = std::env::var("ISOTHERM_EVERY").map_or(1, |every| every.parse().expect("a number"));
    let mut known = BTreeSet::new();
    for pass in all_lists().iter().flat_map(Frame::passes) {
        let names: Vec<String> = pass.shaders().iter().map(|shader| shader.name()).collect();
        if names.is_empty() || !known.insert(names.clone()) {
            continue;
        }
        if known.len() % every != 0 {
            continue;
        }
        eprintln!("shaders: {}", names.join(" "));
        assert!(compile_pass(&context, pass).expect("the driver takes the shaders"));
    }
    eprintln!("shaders: end, {} on {}", known.len(), context.info.name);
}
