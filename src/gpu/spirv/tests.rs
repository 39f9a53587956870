//! Modules of the entry points as they are after they were mended.

use super::*;
use crate::gpu::shaders::{ENTRY_POINTS, Shader, text_of};

/// The instructions of a shader without words.
fn of(text: &'static str) -> Vec<(u32, Vec<u32>)> {
    let words = Shader::plain(text).compile().expect("a shader that compiles");
    instructions(&words).map(|(code, operands)| (code, operands.to_vec())).collect()
}

#[test]
fn variables_have_types_without_a_layout() {
    let all = of("thermal_step.comp");
    let laid: BTreeSet<u32> = all
        .iter()
        .filter(|(code, operands)| *code == op::MEMBER_DECORATE && LAYOUT.contains(&operands[2]))
        .map(|(_, operands)| operands[0])
        .collect();
    assert!(!laid.is_empty(), "buffers have layouts");
    let pointers = |plain: bool| {
        let of_class = move |operands: &&Vec<u32>| PLAIN.contains(&operands[1]) == plain;
        let all = all.iter().filter(|(code, _)| *code == op::TYPE_POINTER).map(|(_, operands)| operands);
        all.filter(of_class).filter(|operands| laid.contains(&operands[2])).count()
    };
    assert_eq!(pointers(true), 0);
    assert!(pointers(false) > 0);
}

#[test]
fn a_residue_is_not_contracted() {
    let exact = |entry: &'static str| {
        let all = of(entry);
        let is = |(code, operands): &&(u32, Vec<u32>)| *code == op::DECORATE && operands[1] == NO_CONTRACTION;
        all.iter().filter(is).count()
    };
    assert!(exact("response.comp") > 0 && exact("blackbody.comp") > 0);
    assert_eq!(exact("cull.comp"), 0);
    let glsl: String = ENTRY_POINTS.iter().map(|(entry, _)| text_of(entry)).collect();
    let included = [
        "radiative.glsl",
        "shaped_transition.glsl",
        "transition.glsl",
        "band_table.glsl",
        "planck.glsl",
        "local_step.glsl",
    ];
    let glsl = included.iter().fold(glsl, |all, file| all + text_of(file));
    for name in EXACT {
        assert!(glsl.contains(&format!(" {name}(")), "no function is named {name}");
    }
}
