//! The sensor on the device against its f64 twin, its figures, its state, and its barriers.

use std::sync::Arc;

use glam::{DAffine3, DVec3};
use isotherm::Distortion;
use isotherm::internals::{
    Camera, Context, Curve, Detector, DeviceEngine, Distance, Engine, EngineOrder as Order, Frame, Halo, Netd, Pattern,
    Prepared, RadianceTable, Recipe, ReferenceEngine, Sampled, Sensing, Sensor, SensorConstants, SensorOptics,
    SensorVariant, Spread, StepKind, StepRange, ThermalVariant, TriangleRun, Vignetting, Wanted, band_radiance,
    compose, pose_at, radiance_slope,
};

use super::craft::{Folder, SCENE};
use super::device::{assert_silent, context};
use super::hazard::{barrier_count, hazards, unread_by_host, without_barrier};
use super::hazards::ONE;
use super::resources::sensor_variants;

const DETECTOR: Detector = Detector { serial: 8, bad_pixels: 0.01 };

/// A sensor with 14 bits and nothing else.
fn plain() -> Sensor {
    Sensor { seed: 3, ..Sensor::ideal(14, [150.0, 400.0]) }
}

fn netd(kelvin: f64) -> Option<Netd> {
    Some(Netd { kelvin, temperature: 300.0, stated_f_number: 1.0, f_number: 1.0 })
}

fn pattern() -> Option<Pattern> {
    Some(Pattern { offset: 0.2, gain: 0.01, drift: 0.01, interval: Some(50.0), shutter: 290.0 })
}

/// Everything at once.
fn whole(pixels: usize) -> Sensor {
    Sensor {
        spread: Some(Spread::airy(0.9, 1.0)),
        halo: Some(Halo { share: 0.1, radius: 9.0 }),
        vignetting: Some(Vignetting::Map((0..pixels).map(|i| 1.0 - 0.4 * (i % 97) as f64 / 97.0).collect())),
        optics: SensorOptics { transmission: 0.8, lens: Some(290.0), housing: Some(300.0) },
        time_constant: Some(30.0),
        noise: netd(0.1),
        pattern: pattern(),
        detector: DETECTOR,
        kelvin_per_count: Some(0.01),
        ..plain()
    }
}

/// A sensor on the craft. The width is no multiple of four.
fn scene(sensor: &Sensor) -> Prepared {
    let mut prepared = Folder::new(&SCENE.replace("width = 96", "width = 94")).prepared();
    prepared.scene.sensor = Some(sensor.clone());
    prepared
}

const PIXELS: usize = 94 * 72;

fn device(context: &Arc<Context>, prepared: &Prepared) -> DeviceEngine {
    let mut engine = DeviceEngine::new(context, prepared, prepared.scene.camera.as_ref()).expect("a small scene");
    engine.settle_at(320.0, prepared.nodes.vertex_of_node.len()).expect("a settled state");
    engine
}

fn reference(prepared: &Prepared) -> ReferenceEngine {
    let mut engine = ReferenceEngine::new(prepared, prepared.scene.camera.as_ref());
    engine.settle_at(320.0, prepared.nodes.vertex_of_node.len()).expect("a settled state");
    engine
}

/// What the sensor reads at a time [s]. The craft does not change.
fn read(prepared: &Prepared, engine: &mut dyn Engine, time: f64) -> Vec<[u16; 2]> {
    read_from(pose_at(prepared, 0.0), engine, time)
}

/// The same from another pose.
fn read_from(pose: Option<DAffine3>, engine: &mut dyn Engine, time: f64) -> Vec<[u16; 2]> {
    let order = Order { pose, time, ..Order::default() };
    engine.submit(None, order).expect("an image is submitted");
    let image = engine.deliver().expect("the device answers").image.expect("an image");
    let (numbers, counts) = image.digital_numbers.zip(image.counts).expect("a sensor");
    numbers.into_iter().zip(counts).map(<[u16; 2]>::from).collect()
}

/// Share of pixels that differ, and the largest difference.
fn apart(a: &[[u16; 2]], b: &[[u16; 2]], which: usize) -> (f64, u16) {
    let differences: Vec<u16> = a.iter().zip(b).map(|(a, b)| a[which].abs_diff(b[which])).collect();
    let differing = differences.iter().filter(|difference| **difference > 0).count();
    (differing as f64 / a.len() as f64, differences.into_iter().max().unwrap_or(0))
}

#[test]
fn every_effect_on_the_device_is_that_of_its_twin() {
    let (context, whole) = (context(), whole(PIXELS));
    let effects = [
        ("nothing", plain()),
        ("point spread", Sensor { spread: whole.spread.clone(), ..plain() }),
        ("halo", Sensor { halo: whole.halo, ..plain() }),
        ("cos4", Sensor { vignetting: Some(Vignetting::Cos4), ..plain() }),
        ("map and optics", Sensor { vignetting: whole.vignetting.clone(), optics: whole.optics, ..plain() }),
        ("lag", Sensor { time_constant: whole.time_constant, ..plain() }),
        ("noise", Sensor { noise: whole.noise, ..plain() }),
        ("pattern", Sensor { pattern: whole.pattern, ..plain() }),
        ("bad pixels", Sensor { detector: DETECTOR, bits: 16, ..plain() }),
        ("temperatures", Sensor { kelvin_per_count: Some(0.1), bits: 8, ..plain() }),
        ("all", whole),
    ];
    let mut before: Option<Vec<[u16; 2]>> = None;
    for (name, sensor) in effects {
        let prepared = scene(&sensor);
        let (mut device, mut reference) = (device(&context, &prepared), reference(&prepared));
        for time in [0.0, 7.0, 60.0] {
            let found = read(&prepared, &mut device, time);
            let expected = read(&prepared, &mut reference, time);
            let (share, most) = apart(&found, &expected, 0);
            // A pixel at an edge of the craft may show another face, which the sensor did not do. Other numbers differ where f32 rounds to the other side.
            let edges = 0.004;
            let spread_edges = if sensor.spread.is_some() || sensor.halo.is_some() { 0.15 } else { 0.0 };
            assert!(
                share < edges + spread_edges,
                "{name} at {time} s: {share} of the pixels differ, at most by {most}"
            );
            let large = found.iter().zip(&expected).filter(|(a, b)| a[0].abs_diff(b[0]) > 1).count();
            assert!(
                (large as f64) < 0.004 * PIXELS as f64 + 150.0 * spread_edges,
                "{name} at {time} s: {large} pixels differ by more than 1"
            );
            if let Some(kelvin) = sensor.kelvin_per_count {
                // Where the scene sends little, f32 takes it from the far larger signal of the optics.
                let warm: Vec<usize> = (0..PIXELS)
                    .filter(|i| f64::from(expected[*i][1]) * kelvin > 150.0 && found[*i][0] == expected[*i][0])
                    .collect();
                let off = warm.iter().filter(|i| found[**i][1].abs_diff(expected[**i][1]) > 1).count();
                assert!(
                    warm.len() > 500 && off == 0,
                    "{name} at {time} s: {off} of {} temperatures differ",
                    warm.len()
                );
            }
            if time == 0.0 && name != "lag" {
                if let Some(before) = &before {
                    assert!(
                        apart(&found, before, 0).0 > 0.005,
                        "{name} changes nothing, or the comparison sees nothing"
                    );
                }
                before = Some(found);
            }
        }
    }
    assert_silent(&context);
}

#[test]
fn noise_has_the_stated_netd_and_follows_from_the_time_alone() {
    let sensor = Sensor { noise: netd(0.4), ..plain() };
    let (context, prepared) = (context(), scene(&sensor));
    let mut engine = device(&context, &prepared);
    let images: Vec<_> = (0..24).map(|image| read(&prepared, &mut engine, f64::from(image))).collect();
    let mut again = device(&context, &prepared);
    assert_eq!(read(&prepared, &mut again, 20.0), images[20], "the order of images does not matter");
    assert_eq!(read(&prepared, &mut again, 3.0), images[3]);
    assert_ne!(images[3], images[4]);
    let table = RadianceTable::new(prepared.scene.band);
    let constants = SensorConstants::new(&sensor, &table);
    let lit: Vec<usize> = (0..PIXELS).filter(|pixel| images[0][*pixel][0] > 2000).collect();
    let variance = |pixel: &usize| {
        let values: Vec<f64> = images.iter().map(|image| f64::from(image[*pixel][0])).collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (values.len() - 1) as f64
    };
    let sigma = (lit.iter().map(variance).sum::<f64>() / lit.len() as f64).sqrt();
    let kelvin = sigma / constants.scale / radiance_slope(&table, 300.0);
    // The standard error of 1000 pixels x 23 degrees of freedom is 0.5 %.
    assert!(lit.len() > 1000 && (kelvin / 0.4 - 1.0).abs() < 0.03, "{} pixels: {kelvin} K", lit.len());
    assert_eq!((constants.scale * band_radiance(&table, 400.0) + constants.offset).round(), 16_383.0);
}

/// The bolometer has seen another image before, so its state must be saved for the next one to be the same.
#[test]
fn a_resumed_sensor_goes_on_bit_for_bit() {
    let (context, prepared) = (context(), scene(&whole(PIXELS)));
    let aside = pose_at(&prepared, 0.0).map(|pose| DAffine3::from_translation(DVec3::X) * pose);
    for engines in [
        [&mut device(&context, &prepared) as &mut dyn Engine, &mut device(&context, &prepared)],
        [&mut reference(&prepared), &mut reference(&prepared)],
    ] {
        let [first, second] = engines;
        first.keep_few_times(100);
        read_from(aside, first, 5.0);
        let saved = first.save().expect("a state");
        let whole = read(&prepared, first, 9.0);
        second.keep_few_times(100);
        assert!(apart(&read(&prepared, second, 9.0), &whole, 0).0 > 0.05, "the earlier image lags behind");
        second.restore(&saved, 100).expect("its own state");
        assert_eq!(read(&prepared, second, 9.0), whole);
    }
}

/// With several samples or a distorting lens the image is computed from others, and that is the one that the sensor sees.
#[test]
fn the_sensor_sees_the_image_of_several_samples_and_of_a_lens() {
    let context = context();
    let of = |change: &dyn Fn(&mut Camera)| {
        let mut prepared = scene(&plain());
        change(prepared.scene.camera.as_mut().expect("a camera"));
        let device = read(&prepared, &mut device(&context, &prepared), 0.0);
        (device, read(&prepared, &mut reference(&prepared), 0.0))
    };
    let (simple, _) = of(&|_| ());
    let pincushion = Distortion::BrownConrady([1.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    // A pixel takes the texel at its centre, so some pixels at edges differ behind the lens.
    let images =
        [("samples", of(&|camera| camera.samples = 4)), ("lens", of(&|camera| camera.lens.distortion = pincushion))];
    for (name, (found, expected)) in images {
        let [share, moved] = [&expected, &simple].map(|other| apart(&found, other, 0).0);
        println!("{name}: {share} of the pixels differ from the reference, {moved} from the simple image");
        assert!(share < 0.01 && moved > 0.03, "{name}: {share} and {moved}");
    }
    assert_silent(&context);
}

/// A point spread reads the texels in the pixels: of the image, behind a lens, of a crop, and of the rows of a rolling shutter.
#[test]
fn a_point_spread_reads_the_texels_of_every_image() {
    let context = context();
    let spread = Sensor { spread: Some(Spread::airy(1.0, 1.0)), ..plain() };
    let of = |change: &dyn Fn(&mut Camera), sensor: &Sensor| {
        let mut prepared = scene(sensor);
        change(prepared.scene.camera.as_mut().expect("a camera"));
        let device = read(&prepared, &mut device(&context, &prepared), 0.0);
        (device, read(&prepared, &mut reference(&prepared), 0.0))
    };
    let pincushion = Distortion::BrownConrady([1.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let far = |camera: &mut Camera| camera.position *= 10.0;
    let bent = |camera: &mut Camera| camera.lens.distortion = pincushion;
    let still = |_: &mut Camera| ();
    // Behind a lens a texel lies between four of the finer image.
    for (name, change, most) in
        [("near", &still as &dyn Fn(&mut Camera), 1e-3), ("lens", &bent, 0.08), ("far", &far, 1e-3)]
    {
        let (found, expected) = of(change, &spread);
        let (_, sharp) = of(change, &plain());
        let off = |other: &[[u16; 2]]| {
            let squares = found.iter().zip(other).map(|(a, b)| f64::from(a[0].abs_diff(b[0])).powi(2));
            (squares.sum::<f64>() / PIXELS as f64).sqrt()
        };
        let [own, without] = [off(&expected), off(&sharp)];
        println!("{name}: {own:.3} digital numbers from the reference, {without:.1} from the sharp image");
        assert!(own < most * without && without > 10.0, "{name}: {own} and {without}");
    }
    assert_silent(&context);
}

/// Of two orbits with one camera only the noise differs.
#[test]
fn patterns_and_bad_pixels_are_those_of_the_serial_number() {
    let sensor = Sensor { pattern: pattern(), detector: DETECTOR, ..plain() };
    let of = |sensor: Sensor| {
        let prepared = scene(&sensor);
        read(&prepared, &mut reference(&prepared), 7.0)
    };
    let first = of(sensor.clone());
    assert_eq!(of(Sensor { seed: 99, ..sensor.clone() }), first);
    let other = Detector { serial: 9, ..DETECTOR };
    assert!(apart(&of(Sensor { detector: other, ..sensor.clone() }), &first, 0).0 > 0.1, "another camera");
    let noisy = Sensor { noise: netd(0.1), ..sensor };
    assert_ne!(of(Sensor { seed: 99, ..noisy.clone() }), of(noisy));
}

/// Numbers at the ends of the range, and bad pixels with them, have no temperature.
#[test]
fn saturated_and_bad_pixels_count_no_temperature() {
    let sensor = Sensor { kelvin_per_count: Some(0.01), detector: DETECTOR, ..plain() };
    let (context, prepared) = (context(), scene(&sensor));
    for engine in [&mut device(&context, &prepared) as &mut dyn Engine, &mut reference(&prepared)] {
        let readings = read(&prepared, engine, 0.0);
        let at_end = readings.iter().filter(|[number, _]| *number == 0 || *number == 16_383).count();
        assert!(readings.iter().all(|[number, count]| (*count == 0) == (*number == 0 || *number == 16_383)));
        assert!(at_end > 100 && at_end < PIXELS - 100, "{at_end} pixels saturate");
    }
}

#[test]
fn each_barrier_of_the_sensor_is_needed() {
    let instant = ThermalVariant { planet_ir: true, ..ThermalVariant::bare(StepKind::Instant, Curve::Power) };
    let ranges = [StepRange { variant: instant, groups: (0, 64), joint: 0 }];
    let settle = Frame::settle(&ranges);
    let drawn = Wanted { image: true, cull: 100, ..Wanted::default() };
    let culled = [TriangleRun { joint: 0, triangles: (0, 100) }];
    // A point spread reads the texels of an image that is computed.
    let images = |variant: &SensorVariant| {
        let of = |lens: bool, mean: Option<u32>, distance: Distance| Wanted {
            sampled: Some(Sampled { lens, mean, distance, fine: variant.spread, ..ONE }),
            ..drawn
        };
        let far = of(false, None, Distance::Far);
        [if variant.spread { far } else { drawn }, of(true, Some(if variant.spread { 1 } else { 4 }), Distance::Near)]
    };
    for (variant, wanted) in sensor_variants().into_iter().flat_map(|one| images(&one).map(|image| (one, image))) {
        let recipe = Recipe { ranges: ranges.to_vec(), ..wanted.recipe(&culled) };
        let before = barrier_count(&compose(&recipe));
        let sensor = Some(Sensing { variant, groups: 128, cells: 20 });
        let image = compose(&Recipe { sensor, ..recipe });
        assert_eq!(hazards([&settle, &image, &image]), []);
        assert!(unread_by_host([&image]).is_empty());
        for n in before..barrier_count(&image) {
            let broken = without_barrier(&image, n);
            let missed = !hazards([&settle, &broken, &broken]).is_empty() || !unread_by_host([&broken]).is_empty();
            assert!(missed, "without barrier {n} of\n{image}");
        }
    }
}
