//! What each pass reads and writes: its shaders tell the blocks, and a block has the name of its buffer.

use std::collections::BTreeMap;
use std::fmt;
use std::sync::LazyLock;

use ash::vk::{AccessFlags2 as A, ImageLayout, PipelineStageFlags2 as S};

use super::compile::CompileError;
use super::effects;
use super::pass::{
    Access, CLEAR_WRITE, COLOUR, COMPUTE_WRITE, COPY_READ, COPY_WRITE, DEPTH, Frame, ListEntry, Pass, PassReach,
    PassWork, Scope, is_write, scope,
};
use super::resource::{Resource, Role};
use super::shaders::{Shader, module};

/// Each resource by its name.
static BY_NAME: LazyLock<BTreeMap<&'static str, &'static Resource>> =
    LazyLock::new(|| effects::all().map(|resource| (resource.name, resource)).collect());

/// Access to a whole resource without a binding.
fn whole(resource: &'static Resource, scope: Scope) -> Access {
    Access { resource, scope, range: None, slice: 0, binding: None, layout: ImageLayout::UNDEFINED }
}

impl PassReach {
    /// The buffer that a block stands for.
    fn buffer(&self, block: &str) -> Option<&'static Resource> {
        let instead = self.instead.iter().find(|(name, _)| *name == block);
        instead.map(|(_, resource)| *resource).or_else(|| BY_NAME.get(block).copied())
    }

    /// Accesses of a shader.
    fn of_shader(&self, shader: &Shader) -> Result<Vec<Access>, CompileError> {
        let stage = match shader.entry.rsplit('.').next() {
            Some("vert") => S::VERTEX_SHADER,
            Some("frag") => S::FRAGMENT_SHADER,
            _ => S::COMPUTE_SHADER,
        };
        let mut accesses = Vec::new();
        for used in &module(shader)?.uses {
            let unknown =
                || CompileError { name: shader.name(), message: format!("no buffer is named '{}'", used.block) };
            let resource = self.buffer(&used.block).ok_or_else(unknown)?;
            let range = self.ranges.iter().find(|(per, _)| *per == resource.per).map(|(_, range)| *range);
            let reads = if resource.role == Role::Uniform { A::UNIFORM_READ } else { A::SHADER_STORAGE_READ };
            for (_, access) in
                [(used.reads, reads), (used.writes, A::SHADER_STORAGE_WRITE)].into_iter().filter(|one| one.0)
            {
                let slice = if resource.per_joint { self.joint } else { 0 };
                let binding = Some(used.binding);
                accesses.push(Access { range, slice, binding, ..whole(resource, scope(stage, access)) });
            }
        }
        Ok(accesses)
    }
}

impl Pass {
    /// Everything that it reads and writes.
    ///
    /// # Errors
    /// A shader that does not compile, or a block that has no buffer.
    pub fn accesses(&self) -> Result<Vec<Access>, CompileError> {
        Ok(match &self.work {
            PassWork::Dispatch { shader, .. } => {
                let mut accesses = self.reach.of_shader(shader)?;
                accesses.extend(self.reach.nominal.map(|resource| whole(resource, COMPUTE_WRITE)));
                accesses
            }
            PassWork::Draw(drawing) => {
                let indices = scope(S::INDEX_INPUT, A::INDEX_READ);
                let commands = scope(S::DRAW_INDIRECT, A::INDIRECT_COMMAND_READ);
                let mut accesses = vec![whole(drawing.indices, indices)];
                accesses.push(whole(drawing.commands, commands));
                for shader in self.shaders() {
                    accesses.extend(self.reach.of_shader(shader)?);
                }
                let drawn = |resource: &'static Resource, scope| Access {
                    layout: ImageLayout::ATTACHMENT_OPTIMAL,
                    ..whole(resource, scope)
                };
                let colours = drawing.colours.iter().flat_map(|(image, mean)| [Some(*image), *mean]);
                accesses.extend(colours.flatten().map(|image| drawn(image, COLOUR)));
                accesses.push(drawn(drawing.depth, DEPTH));
                accesses
            }
            PassWork::Copy { from, to } => {
                let layout =
                    if from.role.is_image() { ImageLayout::TRANSFER_SRC_OPTIMAL } else { ImageLayout::UNDEFINED };
                vec![Access { layout, ..whole(from, COPY_READ) }, whole(to, COPY_WRITE)]
            }
            PassWork::Fill(resource, _) => vec![whole(resource, CLEAR_WRITE)],
        })
    }
}

impl fmt::Display for Frame {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        for entry in &self.entries {
            match entry {
                ListEntry::Pass(pass) => {
                    let accesses = pass.accesses().map_err(|_| fmt::Error)?;
                    let touched = |write: bool| {
                        let touched = accesses.iter().filter(|access| is_write(access.scope.access) == write);
                        let names: Vec<&str> = touched.map(|access| access.resource.name).collect();
                        if names.is_empty() { "nothing".to_owned() } else { names.join(" ") }
                    };
                    writeln!(out, "{}", pass.name)?;
                    writeln!(out, "    reads  {}", touched(false))?;
                    writeln!(out, "    writes {}", touched(true))?;
                }
                ListEntry::Barriers(barriers) => {
                    for barrier in barriers {
                        let (before, after) = (barrier.before.stage, barrier.after.stage);
                        writeln!(out, "  barrier {:?}: {before:?} -> {after:?}", barrier.resource)?;
                    }
                }
            }
        }
        Ok(())
    }
}
