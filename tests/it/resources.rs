//! The resource table: lists bind the buffers that shaders name, and anything else is refused.

use std::collections::BTreeSet;

use isotherm::environment::shadow::Method;
use isotherm::gpu::frame::{Frame, StepRange, Wanted};
use isotherm::gpu::lists;
use isotherm::gpu::network::small_frame::{Unknowns, dispatched};
use isotherm::gpu::pass::Kernel;
use isotherm::gpu::radiance_variant::RadianceVariant;
use isotherm::gpu::resource::Resource;

use crate::network::barriers::lists_of_all_plans;
use crate::one_pass::lists_of_all_shapes;
use crate::shaders::{CURVES, fused_variants, reflect, response_variants, thermal_variants};

/// Name of a variable's block. The compiler wraps blocks that do not end in a runtime array.
fn block_of(module: &naga::Module, ty: naga::Handle<naga::Type>) -> String {
    let of = &module.types[ty];
    match (&of.name, &of.inner) {
        (None, naga::TypeInner::Struct { members, .. }) if members.len() == 1 => block_of(module, members[0].ty),
        (name, _) => name.clone().unwrap_or_default(),
    }
}

/// A list for every kernel.
fn all_lists() -> Vec<Frame> {
    let drawn = Wanted { image: true, cull: 9, temperatures: true, ..Wanted::default() };
    let mut all = vec![lists::radiation(Kernel::Blackbody, 1), lists::radiation(Kernel::Brightness, 1)];
    for variant in CURVES.into_iter().flat_map(thermal_variants) {
        all.push(Frame::step(&[StepRange { variant, groups: (0, 64), joint: 0 }], drawn));
        if variant.shadow {
            let range = [StepRange { variant, groups: (0, 64), joint: 0 }];
            all.extend([Method::Depth, Method::Exact].map(|method| Frame::shadows(&range, method)));
        }
    }
    let shown = |shows| Frame::step(&[], Wanted { image: true, shows, ..Wanted::default() });
    all.extend(RadianceVariant::all().into_iter().map(shown));
    all.extend(CURVES.into_iter().flat_map(response_variants).map(|variant| lists::respond(variant, 1)));
    for variant in fused_variants() {
        for unknowns in [Unknowns::Arithmetic, Unknowns::Free] {
            all.extend([false, true].map(|odd| dispatched(variant, unknowns, odd)));
        }
    }
    all.extend(lists_of_all_plans());
    all.extend(lists_of_all_shapes());
    all
}

#[test]
fn resources_are_bound_to_the_blocks_that_the_table_states() {
    let (mut seen, mut bound) = (BTreeSet::new(), BTreeSet::new());
    for pass in all_lists().iter().flat_map(Frame::passes).filter(|pass| pass.kernel().is_some()) {
        let accesses: BTreeSet<_> = pass.accesses.iter().filter_map(|one| Some((one.binding?, one.resource))).collect();
        if !seen.insert((pass.kernel(), accesses.clone())) {
            continue;
        }
        for module in pass.kernel().into_iter().flat_map(Kernel::shaders).map(|shader| reflect(&shader)) {
            for variable in module.global_variables.iter().map(|(_, variable)| variable) {
                let Some(binding) = variable.binding.as_ref().map(|binding| binding.binding) else { continue };
                let block = block_of(&module, variable.ty);
                for (_, resource) in accesses.iter().filter(|(number, _)| *number == binding) {
                    let mut blocks = resource.row().blocks.split(' ').map(|name| format!("{name}Block"));
                    assert!(blocks.any(|name| name == block), "{}: {resource:?} is bound to {block}", pass.name);
                    bound.insert(*resource);
                }
            }
        }
    }
    let wanted = Resource::ALL.iter().filter(|one| !one.row().blocks.is_empty());
    assert_eq!(bound, wanted.copied().collect());
}
