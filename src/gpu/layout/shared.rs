//! What makes a structure one that is shared with GLSL: plain memory, and a list of its members for the comparison.

/// A member of a structure, for the comparison with the SPIR-V.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Member {
    /// Name in Rust and GLSL.
    pub name: &'static str,
    /// Offset from the start of the structure [bytes].
    pub offset: usize,
    /// Size [bytes].
    pub size: usize,
}

/// Name, size [bytes] and members of a structure. Members named `unused` are padding and are left out.
pub(crate) type Structure = (&'static str, usize, Vec<Member>);

macro_rules! shared {
    ($($(#[$doc:meta])* $vis:vis struct $name:ident { $($(#[$field_doc:meta])* $field_vis:vis $field:ident: $kind:ty,)* })*) => {
        $(
            $(#[$doc])*
            #[repr(C)]
            #[derive(Debug, Clone, Copy, PartialEq, Default, bytemuck::Pod, bytemuck::Zeroable)]
            $vis struct $name { $($(#[$field_doc])* $field_vis $field: $kind,)* }
        )*

        /// The structures of this file.
        pub(super) fn structures() -> Vec<$crate::gpu::layout::shared::Structure> {
            use $crate::gpu::layout::shared::Member;
            let member = |name, offset, size| Some(Member { name, offset, size }).filter(|_| name != "unused");
            vec![$((stringify!($name), size_of::<$name>(), [$(
                member(stringify!($field), std::mem::offset_of!($name, $field), size_of::<$kind>())
            ),*].into_iter().flatten().collect())),*]
        }
    };
}

pub(super) use shared;
