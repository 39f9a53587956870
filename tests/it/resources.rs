//! Accesses follow from shaders: every buffer that a shader names is known, and naga sees the same uses as the reader of SPIR-V.

use std::collections::{BTreeMap, BTreeSet};

use isotherm::internals;
use isotherm::internals::{
    Distance, Exchanged, Frame, HeatOf, RadianceVariant, Recipe, Role, RowOf, Sampled, Sensing, SensorVariant, Shader,
    StepKind, StepRange, SubFrame, ThermalVariant, TriangleRun, Vignette, Wanted, compose, module,
};

use crate::hazards::{ONE, absorbed_heat};
use crate::one_pass::runs_of_all_shapes;
use crate::shaders::{CURVES, reflect, thermal_variants};

/// The passes of radiation between surfaces.
pub fn exchange(patches: u32, light: ThermalVariant, anew: bool, mirrors: bool) -> Frame {
    let exchanged =
        Exchanged { patches, bundles: 1, light, anew, mirrors, held: 60.0, lead: 0.5, share: 0.25, slot: 1 };
    compose(&Recipe { exchange: Some(exchanged), ..Recipe::default() })
}

/// An image and its sensor.
fn sensed(variant: SensorVariant) -> Frame {
    let fine = Sampled { mean: Some(1), rows: 9, fine: true, ..ONE };
    let drawn = Wanted { image: true, sampled: Some(fine).filter(|_| variant.spread), ..Wanted::default() };
    let sensor = Some(Sensing { variant, groups: 64, cells: 64 });
    compose(&Recipe { sensor, ..drawn.recipe(&[]) })
}

/// Every sensor in any scene.
pub fn sensor_variants() -> Vec<SensorVariant> {
    let with = |vignette, bits: u32| {
        let is = |bit: u32| bits >> bit & 1 == 1;
        let [spread, halo, lag, noise, pattern, bad, kelvin] = [0, 1, 2, 3, 4, 5, 6].map(is);
        SensorVariant { spread, halo, vignette, lag, noise, pattern, bad, kelvin }
    };
    let vignettes = [Vignette::None, Vignette::Cos4, Vignette::Map];
    vignettes.into_iter().flat_map(|vignette| (0..128).map(move |bits| with(vignette, bits))).collect()
}

/// Everything that the pixels of a scene may show.
pub fn radiance_variants() -> Vec<RadianceVariant> {
    let plain = RadianceVariant::default();
    let mut all = vec![plain, RadianceVariant { background: true, ..plain }];
    all.push(RadianceVariant { background: true, sun: true, ..plain });
    for [rough, smooth] in [[false, false], [false, true], [true, false], [true, true]] {
        for number in 0..8 {
            let [sun, apart, background] = [1, 2, 4].map(|bit| number & bit != 0);
            let shows = RadianceVariant { rough, smooth, sun, apart, background, reflections: true, ..plain };
            all.extend([shows, RadianceVariant { map: true, ..shows }]);
            all.push(RadianceVariant { traced: true, dispatches: 1 + 2 * number % 4, map: apart, ..shows });
        }
    }
    all.extend([false, true].map(|sun| RadianceVariant { background: true, map: true, sun, ..plain }));
    let crinkled = RadianceVariant { reflections: true, crinkled: true, ..plain };
    all.push(RadianceVariant { in_pixels: true, ..plain });
    all.iter().flat_map(|shows| [*shows, RadianceVariant { tables: true, ..*shows }]).chain([crinkled]).collect()
}

/// A list for every kernel.
pub fn all_lists() -> Vec<Frame> {
    let drawn = Wanted { image: true, cull: 9, temperatures: true, ..Wanted::default() };
    let sampled =
        |mean, lens, shutter| Wanted { sampled: Some(Sampled { mean, lens, shutter, rows: 9, ..ONE }), ..drawn };
    let of_images = [
        (None, true, None),
        (Some(1), true, None),
        (Some(4), false, Some(RowOf::Brown)),
        (None, false, Some(RowOf::Pinhole)),
    ]
    .map(|(mean, lens, shutter)| Frame::step(&[], sampled(mean, lens, shutter)));
    let mut all = vec![internals::radiances(1), internals::brightnesses(1)];
    let whole = TriangleRun { joint: 0, triangles: (0, 9) };
    for variant in CURVES.into_iter().flat_map(thermal_variants) {
        all.push(Frame::between(&[StepRange { variant, groups: (0, 64), joint: 0 }], drawn, &[whole]));
        all.push(Frame::step(&[StepRange { variant, groups: (0, 64), joint: 0 }], drawn));
        if variant.exchange {
            all.extend([false, true].map(|mirrors| exchange(9, variant, true, mirrors)));
        }
    }
    let shown = |shows| Frame::step(&[], Wanted { image: true, shows, texels: 9, ..Wanted::default() });
    all.extend(radiance_variants().into_iter().map(shown));
    let far = Sampled { rows: 9, distance: Distance::Far, ..ONE };
    let of_far =
        |shows| Frame::step(&[], Wanted { image: true, shows, texels: 9, sampled: Some(far), ..Wanted::default() });
    all.extend(radiance_variants().into_iter().map(of_far));
    let fine = Sampled { distance: Distance::Near, mean: Some(1), ..far };
    for sampled in [far, fine, Sampled { lens: true, ..fine }] {
        let sampled = Some(Sampled { fine: true, ..sampled });
        let wanted = |shows| Wanted { image: true, shows, texels: 9, sampled, ..Wanted::default() };
        let variants = radiance_variants().into_iter().filter(|shows| !shows.apart);
        all.extend(variants.map(|shows| Frame::step(&[], wanted(shows))));
    }
    let sampled_fine = Some(Sampled { fine: true, exposed: true, ..fine });
    all.extend((0..3).map(|number| {
        let sub_frame = Some(SubFrame { number, count: 3 });
        Frame::step(&[], Wanted { image: true, sampled: sampled_fine, sub_frame, ..Wanted::default() })
    }));
    let rolling = Some(Sampled { shutter: Some(RowOf::Pinhole), gathered: 4, mean: None, ..fine });
    let variants = radiance_variants().into_iter().filter(|shows| !shows.apart);
    all.extend(variants.map(|shows| Frame::step(&[], Wanted { shows, texels: 9, sampled: rolling, ..drawn })));
    let of_mean = |shows| Frame::step(&[], Wanted { shows, texels: 9, ..sampled(Some(4), false, None) });
    all.extend(radiance_variants().into_iter().filter(|shows| !shows.apart).map(of_mean));
    let gathered = Some(Sampled { gathered: 4, mean: None, ..fine });
    let of_gathered = |shows| Frame::step(&[], Wanted { shows, texels: 9, sampled: gathered, ..drawn });
    all.extend(radiance_variants().into_iter().filter(|shows| !shows.apart).map(of_gathered));
    for curve in CURVES {
        all.extend([StepKind::Merge, StepKind::Restart].map(|kind| internals::respond_list(kind, curve, 1)));
    }
    let places = [HeatOf::Balance, HeatOf::Target, HeatOf::Flux];
    all.push(absorbed_heat(&places.map(|of| (of, (0, 1)))));
    all.extend(of_images);
    all.extend(sensor_variants().into_iter().map(sensed));
    all.extend([internals::upload(&internals::TEMPERATURE), internals::download(&internals::TEMPERATURE)]);
    all.extend([internals::filled(), internals::copied(), internals::dispatched(2)]);
    all.extend(runs_of_all_shapes().concat());
    all
}

/// Every shader of every list.
pub fn all_shaders() -> BTreeSet<Shader> {
    all_lists()
        .iter()
        .flat_map(Frame::passes)
        .flat_map(|pass| pass.shaders().into_iter().cloned().collect::<Vec<_>>())
        .collect()
}

#[test]
fn naga_sees_the_uses_that_the_reader_of_spirv_sees() {
    for shader in all_shaders() {
        let reflected = reflect(&shader);
        let info = naga::valid::Validator::new(naga::valid::ValidationFlags::all(), naga::valid::Capabilities::all())
            .validate(&reflected)
            .expect("a valid module");
        let function = info.get_entry_point(0);
        let mut expected = BTreeMap::new();
        for (handle, variable) in reflected.global_variables.iter().filter(|(handle, _)| !function[*handle].is_empty())
        {
            let Some(binding) = &variable.binding else { continue };
            let uses = |which| function[handle].contains(which);
            let flags = (uses(naga::valid::GlobalUse::READ), uses(naga::valid::GlobalUse::WRITE));
            expected.insert(binding.binding, flags);
        }
        let compiled = module(&shader).expect("a shader that compiles");
        let read: BTreeMap<_, _> = compiled.uses.iter().map(|one| (one.binding, (one.reads, one.writes))).collect();
        assert_eq!(read, expected, "{}", shader.name());
    }
}

/// Of each binding, whether the shader declares a uniform there.
fn uniforms(shader: &Shader) -> BTreeMap<u32, bool> {
    let module = reflect(shader);
    let variables = module.global_variables.iter().map(|(_, variable)| variable);
    let bound = variables.filter_map(|variable| variable.binding.as_ref().map(|at| (at.binding, variable.space)));
    bound.map(|(binding, space)| (binding, space == naga::AddressSpace::Uniform)).collect()
}

/// A buffer is read as a uniform exactly where its shaders declare one, and every buffer that shaders may use is used.
#[test]
fn a_block_has_the_name_of_its_buffer() {
    let mut bound = BTreeSet::new();
    // Many passes have the same shader.
    let mut spaces: BTreeMap<Shader, BTreeMap<u32, bool>> = BTreeMap::new();
    for pass in all_lists().iter().flat_map(Frame::passes) {
        let accesses = pass.accesses().expect("blocks with buffers");
        bound.extend(accesses.iter().filter(|access| access.binding.is_some()).map(|access| access.resource));
        for shader in pass.shaders() {
            let are_uniforms = spaces.entry(shader.clone()).or_insert_with(|| uniforms(shader));
            for access in &accesses {
                let Some(is_uniform) = access.binding.and_then(|binding| are_uniforms.get(&binding)) else { continue };
                assert_eq!(access.resource.role == Role::Uniform, *is_uniform, "{}: {access:?}", pass.name);
            }
        }
    }
    let names: BTreeSet<&str> = internals::all_resources().map(|resource| resource.name).collect();
    assert_eq!(names.len(), internals::all_resources().count(), "each name stands for one resource");
    let shaded =
        |role| !matches!(role, Role::Readback | Role::Staging | Role::Copied | Role::Indices) && !Role::is_image(role);
    assert_eq!(bound, internals::all_resources().filter(|resource| shaded(resource.role)).collect());
}
