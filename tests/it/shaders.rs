//! Every possible shader is valid, `spirv/` matches `glsl/`, and its structures match those of Rust.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::process::Command;

use isotherm::internals;
use isotherm::internals::{
    Curve, ENTRY_POINTS, Frame, LightBy, RowOf, Sampled, Shader, StepKind, ThermalVariant, Wanted, module,
};
use naga::front::spv;

use crate::device::validation_is_asked_for;
use crate::hazards::ONE;

/// The ways to evaluate a transition.
pub const CURVES: [Curve; 3] =
    [Curve::Power, Curve::Shaped { fourth_power: false }, Curve::Shaped { fourth_power: true }];

/// Every variant of a curve in any scene.
pub fn thermal_variants(curve: Curve) -> Vec<ThermalVariant> {
    let bare = |kind| ThermalVariant::bare(kind, curve);
    let mut all = vec![bare(StepKind::Advance)];
    let stateless: &[StepKind] = if curve == Curve::Power { &[StepKind::Instant, StepKind::Absorb] } else { &[] };
    let plate = |over, fast| StepKind::Radiative { over, fast };
    let plates = [plate(false, false), plate(false, true), plate(true, false), plate(true, true)];
    let plates = plates.into_iter().filter(|_| curve == Curve::Power);
    for kind in stateless.iter().copied().chain([StepKind::Merge, StepKind::Restart]).chain(plates) {
        for both_sides in [false, true] {
            for (sun, planet_ir, albedo) in [
                (false, false, false),
                (true, false, false),
                (false, true, false),
                (true, true, false),
                (true, false, true),
                (true, true, true),
            ] {
                let plain = ThermalVariant { both_sides, sun, planet_ir, albedo, ..bare(kind) };
                let lit = [LightBy::Area, LightBy::Rays].map(|light| sun.then_some(ThermalVariant { light, ..plain }));
                let unfused = [Some(plain), lit[0], lit[1]].into_iter().flatten();
                let exchanging = |variant: ThermalVariant| ThermalVariant { exchange: true, ..variant };
                all.extend(unfused.flat_map(|one| [Some(one), one.fused(), Some(exchanging(one))]).flatten());
            }
        }
    }
    all
}

/// Every shader in any scene, and every entry point without words.
fn all_shaders() -> Vec<Shader> {
    let plain = ENTRY_POINTS.iter().map(|(entry, _)| Shader::plain(entry));
    let mut all: BTreeSet<Shader> = plain.chain(crate::resources::all_shaders()).collect();
    for row_of in [RowOf::Pinhole, RowOf::Brown, RowOf::Fisheye] {
        for (mean, gathered) in [(None, 1), (Some(4), 1), (None, 4)] {
            let sampled = Some(Sampled { mean, gathered, shutter: Some(row_of), rows: 9, ..ONE });
            let frame = Frame::step(&[], Wanted { image: true, cull: 9, sampled, ..Wanted::default() });
            all.extend(frame.passes().flat_map(|pass| pass.shaders().into_iter().cloned().collect::<Vec<_>>()));
        }
    }
    all.into_iter().collect()
}

#[test]
fn spirv_is_what_glsl_compiles_to() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let files = |folder: &str| -> Vec<String> {
        let entries = std::fs::read_dir(root.join(folder)).expect("a folder of the repository");
        let name = |entry: std::io::Result<std::fs::DirEntry>| entry.expect("an entry").file_name();
        let mut names: Vec<_> = entries.map(|entry| name(entry).to_string_lossy().into_owned()).collect();
        names.retain(|name| !name.ends_with(".glsl"));
        names.sort();
        names
    };
    let known: Vec<_> = ENTRY_POINTS.iter().map(|(entry, _)| (*entry).to_owned()).collect();
    assert_eq!(files("glsl"), known);
    assert_eq!(files("spirv"), known.iter().map(|entry| format!("{entry}.spv")).collect::<Vec<_>>());
    for (entry, ahead) in ENTRY_POINTS {
        let compiled = Shader::plain(entry).compile().unwrap_or_else(|error| panic!("{error}"));
        assert!(
            little_endian(&compiled) == *ahead,
            "{entry} is out of date: run `cargo run -p isotherm-tools --bin shaders`"
        );
    }
}

/// Checked by spirv-val, which must exist if validation is on (`tools/setup tests` installs it).
#[test]
fn every_shader_is_valid() {
    let shaders = all_shaders();
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut names = BTreeSet::new();
    for shader in &shaders {
        assert!(names.insert(shader.name()), "{} stands for two shaders", shader.name());
        std::fs::write(folder.path().join(shader.name()), bytes(shader)).expect("a file is written");
    }
    for name in &names {
        let checked =
            Command::new("spirv-val").args(["--target-env", "vulkan1.3"]).arg(folder.path().join(name)).output();
        match checked {
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
                assert!(!validation_is_asked_for(), "spirv-val is not installed");
                eprintln!("NOT CHECKED: spirv-val is not installed, so no shader was validated by it");
                return;
            }
            checked => {
                let output = checked.expect("spirv-val runs");
                assert!(output.status.success(), "{name}: {}", String::from_utf8_lossy(&output.stderr));
            }
        }
    }
}

/// A define that its shader does not use would be a mistake.
#[test]
fn every_word_has_a_meaning() {
    // Includes the names without defines.
    let mut meant =
        BTreeSet::from([("thermal_step.comp", "instant"), ("response.comp", "merge"), ("one_pass.comp", "advance")]);
    let shaders = all_shaders();
    let pairs = |shader: &Shader| shader.words.iter().map(|word| (shader.entry, *word)).collect::<Vec<_>>();
    for shader in &shaders {
        for (entry, word) in pairs(shader) {
            let without = shader.words.iter().copied().filter(|other| *other != word).collect();
            if !meant.contains(&(entry, word)) && bytes(shader) != bytes(&Shader::new(entry, without)) {
                meant.insert((entry, word));
            }
        }
    }
    let unknown: Vec<_> = shaders.iter().flat_map(pairs).filter(|pair| !meant.contains(pair)).collect();
    assert!(unknown.is_empty(), "{unknown:?}");
}

/// SPIR-V of a shader, which the first test to ask for it compiles.
fn bytes(shader: &Shader) -> Vec<u8> {
    let compiled = module(shader).unwrap_or_else(|error| panic!("{error}"));
    little_endian(&compiled.words)
}

fn little_endian(words: &[u32]) -> Vec<u8> {
    words.iter().copied().flat_map(u32::to_le_bytes).collect()
}

pub fn reflect(shader: &Shader) -> naga::Module {
    let options = spv::Options { adjust_coordinate_space: false, strict_capabilities: false, ..Default::default() };
    spv::parse_u8_slice(&bytes(shader), &options).expect("naga reads what it wrote")
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
    for shader in all_shaders() {
        let (name, structures) = (shader.name(), shared_structures(&reflect(&shader)));
        for (rust_name, size, members) in internals::structures() {
            let Some((stride, glsl)) = structures.get(rust_name) else { continue };
            let rust: Vec<_> =
                members.iter().map(|member| (member.name.to_owned(), member.offset, member.size)).collect();
            assert_eq!(&rust, glsl, "{rust_name} in {name}");
            assert_eq!(size, *stride, "{rust_name} in {name}: size against stride");
            // The comparison detects a moved member.
            let mut moved = rust.clone();
            moved[0].1 += 4;
            assert_ne!(&moved, glsl);
            *seen.entry(rust_name).or_insert(0) += 1;
        }
    }
    let expected: Vec<&str> = internals::structures().iter().map(|(name, ..)| *name).collect();
    let mut found: Vec<&str> = seen.keys().copied().collect();
    found.sort_by_key(|name| expected.iter().position(|wanted| wanted == name));
    assert_eq!(found, expected, "every shared structure stands in some shader");
}
