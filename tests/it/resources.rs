//! The resource table: lists bind the buffers that shaders name, and anything else is refused.

use std::collections::BTreeSet;

use isotherm::internals;
use isotherm::internals::{
    Distance, Frame, HeatOf, Kernel, RadianceVariant, Resource, RowOf, Sampled, SensorVariant, ShadowMethod, StepRange,
    TriangleRun, Wanted, absorbed_heat, exchange,
};

use crate::network::barriers::lists_of_all_plans;
use crate::one_pass::lists_of_all_shapes;
use crate::shaders::{CURVES, reflect, response_variants, thermal_variants};

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
    let sampled = |mean, lens, shutter| Wanted {
        sampled: Some(Sampled { mean, lens, shutter, rows: 9, distance: Distance::Near }),
        ..drawn
    };
    let of_images = [
        (None, true, None),
        (Some(1), true, None),
        (Some(4), false, Some(RowOf::Brown)),
        (None, false, Some(RowOf::Pinhole)),
    ]
    .map(|(mean, lens, shutter)| Frame::step(&[], sampled(mean, lens, shutter)));
    let mut all = vec![internals::radiation(Kernel::Blackbody, 1), internals::radiation(Kernel::Brightness, 1)];
    let whole = TriangleRun { joint: 0, triangles: (0, 9) };
    for variant in CURVES.into_iter().flat_map(thermal_variants) {
        all.push(Frame::between(&[StepRange { variant, groups: (0, 64), joint: 0 }], drawn, &[whole]));
        all.push(Frame::step(&[StepRange { variant, groups: (0, 64), joint: 0 }], drawn));
        if variant.exchange {
            all.extend([false, true].map(|mirrors| exchange(9, variant, true, mirrors)));
        }
        if variant.shadow {
            let range = [StepRange { variant, groups: (0, 64), joint: 0 }];
            all.extend([ShadowMethod::Depth, ShadowMethod::Exact].map(|method| Frame::shadows(&range, method)));
        }
    }
    let shown = |shows| Frame::step(&[], Wanted { image: true, shows, ..Wanted::default() });
    all.extend(RadianceVariant::all().into_iter().map(shown));
    let far = Some(Sampled { mean: None, lens: false, shutter: None, rows: 9, distance: Distance::Far });
    let of_far = |shows| Frame::step(&[], Wanted { image: true, shows, sampled: far, ..Wanted::default() });
    all.extend(RadianceVariant::all().into_iter().map(of_far));
    let of_mean = |shows| Frame::step(&[], Wanted { shows, ..sampled(Some(4), false, None) });
    all.extend(RadianceVariant::all().into_iter().filter(|shows| !shows.apart).map(of_mean));
    all.extend(CURVES.into_iter().flat_map(response_variants).map(|variant| internals::respond_list(variant, 1)));
    let places = [HeatOf::Balance, HeatOf::Target, HeatOf::Flux];
    all.push(absorbed_heat(&places.map(|of| (of, (0, 1)))));
    all.extend(of_images);
    for shown in [Resource::RadianceImage, Resource::ImageRadiance] {
        all.extend(SensorVariant::all().into_iter().map(|variant| internals::frame(variant, 64, 64, shown)));
    }
    all.push(internals::list(0, 9, 64));
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
