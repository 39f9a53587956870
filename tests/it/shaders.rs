//! What runs is what is written: `spirv/` is what `glsl/` compiles to, and its structures are those of Rust.

use std::collections::BTreeMap;
use std::path::Path;

use isotherm::gpu::compile::compile_own;
use isotherm::gpu::frame::{Frame, StepRange, Wanted};
use isotherm::gpu::layout;
use isotherm::gpu::pass::{Pass, Work, is_write};
use isotherm::gpu::pipeline::MODULES;
use isotherm::gpu::variant::{Curve, StepKind, ThermalVariant};
use naga::front::spv;

#[test]
fn spirv_is_what_glsl_compiles_to() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let compiled = isotherm_tools::compile_all(&root.join("glsl")).expect("glsl/ compiles");
    let mut present: Vec<String> = std::fs::read_dir(root.join("spirv"))
        .expect("spirv/ is there")
        .map(|entry| entry.expect("an entry of spirv/").file_name().to_string_lossy().into_owned())
        .collect();
    present.sort();
    let mut wanted: Vec<&String> = compiled.iter().map(|(name, _)| name).collect();
    wanted.sort();
    assert_eq!(present.iter().collect::<Vec<_>>(), wanted, "run `cargo run -p isotherm-tools --bin shaders`");
    for (name, bytes) in &compiled {
        let checked_in = std::fs::read(root.join("spirv").join(name)).expect("a file of spirv/");
        assert!(&checked_in == bytes, "{name} is out of date: run `cargo run -p isotherm-tools --bin shaders`");
    }
}

fn reflect(name: &str) -> naga::Module {
    let bytes = MODULES.iter().find(|(module, _)| *module == name).expect("a module of spirv/").1;
    parse(bytes)
}

fn parse(bytes: &[u8]) -> naga::Module {
    let options = spv::Options { adjust_coordinate_space: false, strict_capabilities: false, ..Default::default() };
    spv::parse_u8_slice(bytes, &options).expect("naga reads what it wrote")
}

/// Stride, and name, offset and size of each member.
type Structure = (usize, Vec<(String, usize, usize)>);

/// The named structures of a module.
fn shared_structures(module: &naga::Module) -> BTreeMap<String, Structure> {
    let mut layouter = naga::proc::Layouter::default();
    layouter.update(module.to_ctx()).expect("sizes of all types");
    let mut found = BTreeMap::new();
    for (handle, kind) in module.types.iter() {
        let (Some(name), naga::TypeInner::Struct { members, .. }) = (&kind.name, &kind.inner) else { continue };
        let members = members
            .iter()
            .map(|member| {
                let size = layouter[member.ty].size as usize;
                (member.name.clone().unwrap_or_default(), member.offset as usize, size)
            })
            .collect();
        found.insert(name.clone(), (layouter[handle].to_stride() as usize, members));
    }
    found
}

#[test]
fn structures_agree_with_glsl() {
    let mut seen = BTreeMap::new();
    for (name, _) in MODULES {
        let structures = shared_structures(&reflect(name));
        for (rust_name, size, members) in layout::structures() {
            let Some((stride, glsl)) = structures.get(rust_name) else { continue };
            let rust: Vec<_> =
                members.iter().map(|member| (member.name.to_owned(), member.offset, member.size)).collect();
            assert_eq!(&rust, glsl, "{rust_name} in {name}");
            assert_eq!(size, *stride, "{rust_name} in {name}: size against stride");
            // The comparison sees a member that moves.
            let mut moved = rust.clone();
            moved[0].1 += 4;
            assert_ne!(&moved, glsl);
            *seen.entry(rust_name).or_insert(0) += 1;
        }
    }
    let expected: Vec<&str> = layout::structures().iter().map(|(name, ..)| *name).collect();
    let mut found: Vec<&str> = seen.keys().copied().collect();
    found.sort_by_key(|name| expected.iter().position(|wanted| wanted == name));
    assert_eq!(found, expected, "every shared structure stands in some shader");
}

/// Bindings of a module: number -> whether it is written, and whether it is a uniform.
pub fn bindings_of(module: &str) -> BTreeMap<u32, (bool, bool)> {
    bindings_in(reflect(module))
}

fn bindings_in(module: naga::Module) -> BTreeMap<u32, (bool, bool)> {
    let info = naga::valid::Validator::new(naga::valid::ValidationFlags::all(), naga::valid::Capabilities::all())
        .validate(&module)
        .expect("a valid module");
    let function = info.get_entry_point(0);
    module
        .global_variables
        .iter()
        .filter(|(handle, _)| !function[*handle].is_empty())
        .filter_map(|(handle, variable)| {
            let written = function[handle].contains(naga::valid::GlobalUse::WRITE);
            let uniform = variable.space == naga::AddressSpace::Uniform;
            variable.binding.as_ref().map(|binding| (binding.binding, (written, uniform)))
        })
        .collect()
}

fn declared(pass: &Pass) -> BTreeMap<u32, (bool, bool)> {
    let mut declared = BTreeMap::new();
    for access in &pass.accesses {
        if let Some(binding) = access.binding {
            let entry = declared.entry(binding).or_insert((false, access.resource.is_uniform()));
            entry.0 |= is_write(access.scope.access);
        }
    }
    declared
}

#[test]
fn passes_declare_what_their_shaders_touch() {
    for variant in ThermalVariant::all() {
        let frame = Frame::step(&[StepRange { variant, groups: (0, 64), joint: 0 }], Wanted::default());
        let pass = frame.passes().next().expect("one thermal pass");
        assert_eq!(declared(pass), bindings_of(&variant.name()), "{}", variant.name());
    }
    for (kind, fourth_power) in
        [StepKind::Merge, StepKind::Restart].into_iter().flat_map(|kind| [(kind, false), (kind, true)])
    {
        let asked = |variant: &ThermalVariant| variant.kind == kind || variant.kind == StepKind::Advance;
        for variant in ThermalVariant::all_of(Curve::Shaped { fourth_power }).into_iter().filter(asked) {
            let frame = Frame::step(&[StepRange { variant, groups: (0, 64), joint: 0 }], Wanted::default());
            let pass = frame.passes().next().expect("one thermal pass");
            let words = compile_own(&variant.name(), "thermal_step.comp", &variant.defines()).expect("it compiles");
            let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
            assert_eq!(declared(pass), bindings_in(parse(&bytes)), "{}", variant.name());
        }
    }
    let frame = Frame::step(&[], Wanted { image: true, cull: 9, temperatures: false });
    let cull = frame.passes().find(|pass| matches!(pass.work, Work::Cull { .. })).expect("a cull pass");
    assert_eq!(declared(cull), bindings_of("cull.comp"));
    let radiance = frame.passes().find(|pass| pass.work == Work::Radiance).expect("a radiance pass");
    let mut shaders = bindings_of("radiance.vert");
    shaders.extend(bindings_of("radiance.frag"));
    assert_eq!(declared(radiance), shaders);
}
