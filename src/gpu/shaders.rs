//! SPIR-V of all shaders. An entry point is a file of `glsl/`, and words are preprocessor names that select a variant
//! of it.
//!
//! Entry points without words are compiled in advance, to `spirv/`. Variants with words are compiled at first use.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use super::compile::{self, CompileError};
use super::reflect::{BlockUse, block_uses};
use crate::exchange::slopes::NEIGHBOURS;
use crate::thermal::transition::MOVED;

macro_rules! entry_points {
    ($($file:literal)*) => {
        /// Entry points of `glsl/`, each with its SPIR-V without words.
        pub const ENTRY_POINTS: &[(&str, &[u8])] =
            &[$(($file, include_bytes!(concat!("../../spirv/", $file, ".spv")))),*];

        /// Their texts.
        const ENTRY_TEXTS: &[(&str, &str)] = texts![$($file)*];
    };
}

macro_rules! texts {
    ($($file:literal)*) => { &[$(($file, include_str!(concat!("../../glsl/", $file)))),*] };
}

entry_points! {
    "absorbed_heat.comp" "background.frag" "background.vert" "between.comp" "blackbody.comp" "brightness.comp"
    "cull.comp" "distant.comp" "empty.comp" "exchange_gradient.comp" "exchange_light.comp" "exchange_mirror.comp"
    "exchange_receive.comp" "exchange_send.comp" "exchange_sky.comp" "exchange_spread.comp" "expose.comp" "gather.comp" "one_pass.comp" "one_pass_heaters.comp"
    "one_pass_stage.comp" "radiance.frag" "radiance.vert" "resample.comp" "response.comp" "sensor_cells.comp"
    "sensor_halo.comp" "sensor_pixel.comp" "sensor_rows.comp" "thermal_step.comp" "traced.comp"
}

/// The other files of `glsl/`, which entry points include.
const INCLUDED: &[(&str, &str)] = texts![
    "albedo.glsl" "balance.glsl" "band_table.glsl" "between.glsl" "brightness.glsl" "cosine.glsl" "emissivity.glsl"
    "exchange_sky.glsl" "lobe.glsl" "local_step.glsl" "network_types.glsl" "pcg.glsl"
    "planck.glsl" "planet.glsl" "planet_map.glsl" "radiative.glsl" "reflection.glsl" "sensor_noise.glsl"
    "sensor_signal.glsl" "sensor_types.glsl" "shaped_transition.glsl" "shutter.glsl" "sky.glsl"
    "traced.glsl" "transition.glsl" "types.glsl" "walk.glsl"
];

/// Constants that GLSL shares with its twins in f64: preprocessor name and value. A float's `Debug` text is a GLSL
/// literal.
const VALUES: &[(&str, f32)] = &[("MOVED", MOVED as f32), ("EXCHANGE_NEIGHBOURS", NEIGHBOURS as f32)];

/// Text of a file in `glsl/`.
pub(super) fn text_of(file: &str) -> &'static str {
    ENTRY_TEXTS.iter().chain(INCLUDED).find(|(name, _)| *name == file).map_or("", |(_, text)| text)
}

/// An entry point with the words of a variant.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Shader {
    /// File in `glsl/`.
    pub entry: &'static str,
    /// Words in lower case. The preprocessor names are in upper case.
    pub words: Vec<&'static str>,
}

impl Shader {
    /// Makes a shader from an entry point and words.
    pub fn new(entry: &'static str, words: Vec<&'static str>) -> Self {
        Self { entry, words }
    }

    /// An entry point without words.
    pub fn plain(entry: &'static str) -> Self {
        Self::new(entry, Vec::new())
    }

    /// An entry point with the words whose flag is set.
    pub(crate) fn with(entry: &'static str, words: &[(bool, &'static str)]) -> Self {
        Self::new(entry, words.iter().filter_map(|(is, word)| is.then_some(*word)).collect())
    }

    /// The file name, or the stem with the words, such as `thermal_step.merge.sun.albedo`.
    pub fn name(&self) -> String {
        let stem = self.entry.rsplit_once('.').map_or(self.entry, |(stem, _)| stem);
        if self.words.is_empty() { self.entry.to_owned() } else { format!("{stem}.{}", self.words.join(".")) }
    }

    /// Compiles the GLSL to SPIR-V.
    pub fn compile(&self) -> Result<Vec<u32>, CompileError> {
        let mut text = String::new();
        self.expand(self.entry, &mut Vec::new(), &mut text);
        let words = self.words.iter().map(|word| (word.to_uppercase(), "1".to_owned()));
        let values = VALUES.iter().map(|(name, value)| ((*name).to_owned(), format!("{value:?}")));
        compile::compile(&self.name(), self.entry, &text, words.chain(values))
    }

    /// Appends a file and expands each `#include "file"` once, because naga does not support includes.
    fn expand<'a>(&'a self, file: &'a str, seen: &mut Vec<&'a str>, text: &mut String) {
        if seen.contains(&file) {
            return;
        }
        seen.push(file);
        for line in text_of(file).lines() {
            match line.strip_prefix("#include \"").and_then(|rest| rest.strip_suffix('"')) {
                Some(included) => self.expand(included, seen, text),
                None => text.extend([line, "\n"]),
            }
        }
    }
}

/// A compiled shader.
pub struct CompiledShader {
    /// SPIR-V.
    pub words: Vec<u32>,
    /// The buffers that it uses.
    pub uses: Vec<BlockUse>,
}

/// All shaders that the process has used so far.
static COMPILED: Mutex<BTreeMap<Shader, Arc<CompiledShader>>> = Mutex::new(BTreeMap::new());

/// A shader, compiled at first use.
///
/// # Errors
/// It does not compile.
pub fn module(shader: &Shader) -> Result<Arc<CompiledShader>, CompileError> {
    let mut compiled = COMPILED.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(known) = compiled.get(shader) {
        return Ok(Arc::clone(known));
    }
    let ahead = ENTRY_POINTS.iter().find(|(entry, _)| shader.words.is_empty() && *entry == shader.entry);
    let words = match ahead {
        Some((_, bytes)) => bytes.as_chunks().0.iter().map(|word| u32::from_le_bytes(*word)).collect(),
        None => shader.compile()?,
    };
    let module = Arc::new(CompiledShader { uses: block_uses(&words), words });
    compiled.insert(shader.clone(), Arc::clone(&module));
    Ok(module)
}
