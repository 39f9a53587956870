//! Images through distorting lenses and with several samples of a pixel: the device against the f64 rasteriser and against closed forms.

use glam::{DAffine3, DMat4, DVec3};
use isotherm::internals::{
    Camera, Delivered, DeviceEngine, Engine, EngineOrder as Order, FrameMaker, ImageMoments, Prepared, ReferenceEngine,
    Response, Rolling, Sides, StepResult, band_radiance_exact, moments, pose_at, raster_view, read_exr, sampling,
    start, write_exr,
};
use isotherm::{Distortion, Image, Lens, internals};

use super::craft::{Folder, never, scene_with};
use super::device::{Worst, assert_silent, context, material};
use super::quads::{Quads, camera, looking};
use super::random::Random;

const BARREL: Distortion =
    Distortion::BrownConrady([-0.31, 0.12, 0.0011, -0.0007, -0.021, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
const FISHEYE: Distortion = Distortion::Fisheye([-0.013, 0.0042, -0.0019, 0.0002]);

fn lenses() -> Vec<(&'static str, Lens)> {
    let lens = |focal: [f64; 2], skew, distortion| Lens { focal, centre: [79.2, 61.4], skew, distortion };
    let prism = [-0.2, 0.05, 0.001, 0.0005, 0.0, 0.0, 0.0, 0.0, 0.004, -0.001, -0.003, 0.002];
    let rational = [1.21, 0.43, -0.0004, 0.0006, 0.017, 1.57, 0.66, 0.09, 0.0, 0.0, 0.0, 0.0];
    vec![
        ("skew", lens([128.0, 127.0], 3.0, Distortion::None)),
        ("5 numbers", lens([128.0, 127.0], 0.0, BARREL)),
        ("8 numbers", lens([128.0, 127.0], 0.0, Distortion::BrownConrady(rational))),
        ("12 numbers", lens([128.0, 127.0], -1.0, Distortion::BrownConrady(prism))),
        ("fisheye", lens([105.0, 104.0], 0.0, FISHEYE)),
        ("wide fisheye", lens([80.0, 80.0], 0.0, FISHEYE)),
    ]
}

/// A warm wall with a gradient, and plates before it.
fn room() -> Quads {
    let paint = material(0.5, 0.8, Sides::Outside, Response::Instant);
    let mut quads = Quads::new(vec![paint]);
    quads.add(Quads::square(DVec3::Z * 9.0, DVec3::Y, DVec3::X, 60.0), 0, 0, |at| 260.0 + 0.4 * at.x - 0.3 * at.y);
    for (number, (x, y)) in [(-3.0, -2.0), (0.2, -1.4), (3.1, 0.3), (-1.5, 1.9), (1.7, 2.2)].into_iter().enumerate() {
        let (across, down) = (DVec3::new(0.8, 0.6, 0.1).normalize(), DVec3::new(-0.6, 0.8, 0.0));
        let corners = Quads::square(DVec3::new(x, y, 6.0), down, across, 0.6);
        quads.add(corners, number as u32 + 1, 0, |at| 320.0 + 9.0 * (at.x - x));
    }
    quads
}

/// Whether all neighbours of a pixel show its part.
fn is_inside(parts: &[u32], width: usize, pixel: usize) -> bool {
    let (x, y) = (pixel % width, pixel / width);
    let height = parts.len() / width;
    (x > 0 && y > 0 && x + 1 < width && y + 1 < height)
        && (y - 1..=y + 1).all(|row| (x - 1..=x + 1).all(|column| parts[row * width + column] == parts[pixel]))
}

#[test]
fn an_image_through_a_lens_is_that_of_the_reference() {
    let context = context();
    let (room, pose) = (room(), DAffine3::IDENTITY);
    for (name, lens) in lenses() {
        let camera = Camera { lens, ..camera(160, 120, 1.0) };
        let image = room.draw(&context, &camera, &pose);
        let exact = room.rasterised(&camera, &pose);
        let other = room.rasterised(
            &Camera { lens: Lens { focal: lens.focal.map(|f| 1.02 * f), ..lens }, ..camera.clone() },
            &pose,
        );
        let parts: Vec<u32> = exact.iter().map(|pixel| pixel.part).collect();
        let [mut temperature, mut radiance, mut depth, mut changed] = [(); 4].map(|()| Worst::none());
        let (mut seen, mut elsewhere) = (0, 0);
        for (pixel, exact) in exact.iter().enumerate() {
            elsewhere += usize::from(image.part[pixel] != exact.part);
            if exact.part == 0 || !is_inside(&parts, 160, pixel) {
                continue;
            }
            seen += 1;
            assert_eq!(image.labels(pixel), [exact.part, exact.material], "{name}: pixel {pixel}");
            // A lookup is off by at most a quarter of a pixel along each axis, and by the bend of the map within a pixel. At the rim of the image a pixel is
            // as wide as the rays of its corners differ.
            let corner = |x: f64, y: f64| {
                let place = glam::DVec2::new((pixel % 160) as f64 + x, (pixel / 160) as f64 + y);
                lens.unproject(place).expect("a ray")
            };
            let wide = (corner(1.0, 0.5) - corner(0.0, 0.5)).abs() + (corner(0.5, 1.0) - corner(0.5, 0.0)).abs();
            let off = 0.27 * exact.depth * wide.max_element();
            // The plates are tilted by a tenth.
            let gradient = if exact.part == 1 { 0.7 } else { 10.5 };
            let [l, t, z] = image.values(pixel).map(f64::from);
            let at = || format!("{name}: pixel {pixel}");
            temperature.see((t - exact.temperature) / (gradient * off), 0.0, at);
            changed.see((t - other[pixel].temperature) / (gradient * off), 0.0, at);
            depth.see((z - exact.depth) / off, 0.0, at);
            // About 2 % for a kelvin.
            radiance.see((l / exact.radiance - 1.0) / (0.02 * gradient * off), 0.0, at);
        }
        assert!(seen > 9_000, "{name}: {seen} pixels");
        assert!(elsewhere < 250, "{name}: {elsewhere} pixels at edges show another part");
        temperature.within(1.0, "of what a quarter of a pixel makes", &format!("{name}: temperature"));
        depth.within(1.0, "of a quarter of a pixel", &format!("{name}: depth"));
        radiance.within(1.0, "of what a quarter of a pixel makes", &format!("{name}: radiance"));
        assert!(changed.difference > 2.0, "{name}: two per cent of the focal length must show");
    }
    assert_silent(&context);
}

#[test]
fn what_is_not_distorted_has_no_passes_for_it() {
    let plain = camera(160, 120, 128.0);
    assert_eq!(sampling(&plain, 5, false, false), None);
    let bent = Camera { lens: Lens { distortion: BARREL, ..plain.lens }, ..plain.clone() };
    assert!(
        sampling(&bent, 5, false, false).is_some_and(|sampling| !sampling.map.is_empty() && sampling.mean.is_none())
    );
    let sampled = sampling(&Camera { samples: 4, ..plain.clone() }, 5, false, false).expect("a mean");
    assert!(sampled.map.is_empty() && sampled.mean.is_none() && sampled.gathered == 4);
    let rolling = sampling(&Camera { line_time: 1e-5, ..plain }, 5, false, false).expect("a shutter");
    assert!(rolling.map.is_empty() && rolling.mean.is_none() && rolling.shutter.is_some());
}

#[test]
fn the_mean_of_four_samples_is_that_of_the_reference() {
    let context = context();
    let (room, pose) = (room(), looking(DVec3::new(0.3, 0.2, 0.1), DVec3::new(0.1, 0.2, 9.0), DVec3::Y));
    let camera = Camera { samples: 4, ..camera(160, 120, 110.0) };
    let image = room.draw(&context, &camera, &pose);
    let exact = room.rasterised(&camera, &pose);
    let one = Camera { samples: 1, ..camera };
    let (single, centres) = (room.rasterised(&one, &pose), room.draw(&context, &one, &pose));
    // Where the centre shows a surface, everything but the radiance is as with one sample, bit for bit.
    let shown = |at: usize, image: &Image| (image.part[at], image.material[at], image.temperature[at], image.depth[at]);
    let (central, others): (Vec<usize>, Vec<usize>) =
        (0..centres.part.len()).partition(|pixel| centres.part[*pixel] > 0 || image.coverage[*pixel] == 0.0);
    assert!(central.iter().all(|pixel| shown(*pixel, &image) == shown(*pixel, &centres)));
    assert!(others.iter().all(|pixel| image.part[*pixel] > 0), "a pixel with a surface shows it");
    let [mut apart, mut mixed, mut sums, mut worst] = [0, 0, 0, 0].map(f64::from);
    for (pixel, (exact, single)) in exact.iter().zip(&single).enumerate() {
        let l = f64::from(image.radiance[pixel]);
        sums += l - exact.radiance;
        let error = (l / exact.radiance - 1.0).abs();
        apart += f64::from(u8::from(error > 0.02));
        mixed += f64::from(u8::from((single.radiance / exact.radiance - 1.0).abs() > 0.02));
        worst = if error > 0.02 { worst } else { error.max(worst) };
    }
    println!("{apart} pixels apart of {mixed} that several samples change; others within {worst:.1e}");
    assert!(mixed > 100.0, "{mixed} pixels show that they have several samples");
    // Corners are rounded to 1/256 of a pixel, so that a sample in a hundred of those at edges is on the other side.
    assert!(apart <= 8.0, "{apart} pixels differ");
    let total: f64 = exact.iter().map(|pixel| pixel.radiance).sum();
    assert!((sums / total).abs() < 2e-4, "{sums} of {total}");
    assert_silent(&context);
}

/// Change of temperature in 1/256 of a pixel, to which corners are rounded, on strips of 0.2 px across which it is 100 K [K].
const ROUNDED: f64 = 100.0 / 0.2 / 256.0;

/// Strips much narrower than a pixel, whose temperature changes by 100 K across them. A place outside the triangle would have another temperature.
#[test]
fn no_temperature_lies_outside_that_of_its_triangle() {
    let context = context();
    let paint = material(0.5, 0.8, Sides::Outside, Response::Instant);
    let mut quads = Quads::new(vec![paint]);
    for number in 0..40 {
        let x = 0.017 * f64::from(number) - 0.35;
        // 0.2 px wide, and 300 K at one side and 400 K at the other.
        let corners = [(0.0, -0.3), (0.002, -0.3), (0.002, 0.3), (0.0, 0.3)].map(|(u, v)| DVec3::new(x + u, v, 1.0));
        quads.add(corners, 0, 0, |at| if at.x > x + 0.001 { 400.0 } else { 300.0 });
    }
    for samples in [4, 8, 16] {
        let camera = Camera { samples, ..camera(80, 64, 100.0) };
        let image = quads.draw(&context, &camera, &DAffine3::IDENTITY);
        let mut seen = 0;
        for (pixel, (radiance, temperature)) in image.radiance.iter().zip(&image.temperature).enumerate() {
            let coverage = image.coverage[pixel];
            assert!((0.0..=1.0).contains(&coverage));
            assert_eq!(coverage == 0.0, *radiance == 0.0, "pixel {pixel}");
            if coverage > 0.0 {
                seen += 1;
                let own = f64::from(radiance / coverage) / 0.8;
                let [least, most] = [300.0 - ROUNDED, 400.0 + ROUNDED].map(|t| band_radiance_exact(quads.band, t));
                assert!(own > least * 0.999 && own < most * 1.001, "{samples} samples, pixel {pixel}: {own}");
            }
            if image.part[pixel] > 0 {
                let temperature = f64::from(*temperature);
                assert!(
                    (300.0 - ROUNDED..400.0 + ROUNDED).contains(&temperature),
                    "{samples} samples, pixel {pixel}: {temperature} K"
                );
            }
        }
        assert!(seen > 500, "{samples} samples: {seen} pixels");
    }
    assert_silent(&context);
}

/// Plates of a third of a pixel, each alone: what the image receives of each against its area in the image.
#[test]
fn plates_smaller_than_a_pixel_give_their_radiance() {
    let context = context();
    let mut random = Random(16);
    let mut quads = Quads::new(vec![material(0.5, 0.8, Sides::Outside, Response::Instant)]);
    // One in each block of 5 x 5 pixels, at any place in its pixel, turned at random. The focal length is 100 px, so 1 m is 1 px.
    let (width, height, half) = (200, 160, 0.3);
    for row in 0..height / 5 {
        for column in 0..width / 5 {
            let mut place = |block: u32, side: u32| f64::from(5 * block) + 2.0 + random.unit() - 0.5 * f64::from(side);
            let centre = DVec3::new(place(column, width), place(row, height), 100.0);
            let turn = std::f64::consts::TAU * random.unit();
            let (across, down) = (DVec3::new(turn.cos(), turn.sin(), 0.0), DVec3::new(-turn.sin(), turn.cos(), 0.0));
            quads.add(Quads::square(centre, down, across, half), 0, 0, |_| 300.0);
        }
    }
    let expected = 0.8 * band_radiance_exact(quads.band, 300.0) * (2.0 * half).powi(2);
    // Standard deviation of one plate, and error of the sum over all 1280.
    let mut figures = Vec::new();
    for samples in [1, 4, 8, 16] {
        let camera = Camera { samples, ..camera(width, height, 100.0) };
        let mut per_plate = Vec::new();
        for image in [
            quads
                .draw(&context, &camera, &DAffine3::IDENTITY)
                .radiance
                .iter()
                .map(|radiance| f64::from(*radiance))
                .collect::<Vec<_>>(),
            quads.rasterised(&camera, &DAffine3::IDENTITY).iter().map(|pixel| pixel.radiance).collect(),
        ] {
            let mut sums = vec![0.0; (width * height / 25) as usize];
            for (pixel, radiance) in image.iter().enumerate() {
                let (x, y) = (pixel as u32 % width, pixel as u32 / width);
                sums[(y / 5 * (width / 5) + x / 5) as usize] += radiance / expected - 1.0 / 25.0;
            }
            let count = sums.len() as f64;
            let spread = (sums.iter().map(|error| error * error).sum::<f64>() / count).sqrt();
            per_plate.push((spread, sums.iter().sum::<f64>() / count));
        }
        println!("{samples} samples: spread and mean error on the device and in f64 {per_plate:.3?}");
        figures.push(per_plate);
    }
    // A sample meets a plate of 0.36 px with that chance: the spread of one sample is sqrt(0.64 / 0.36) = 1.33.
    let limits = [(1.2..1.5, 0.12), (0.0..0.65, 0.06), (0.0..0.5, 0.04), (0.0..0.35, 0.03)];
    for (figures, (spreads, mean)) in figures.iter().zip(limits) {
        for (spread, error) in figures {
            assert!(spreads.contains(spread) && error.abs() < mean, "{figures:?} against {spreads:?} and {mean}");
        }
    }
    assert_silent(&context);
}

/// The same plate as two triangles and as 20,000 far smaller than a pixel.
#[test]
fn a_mesh_finer_than_the_pixels_has_the_radiance_of_the_plate() {
    let context = context();
    let mut fine = Quads::new(vec![material(0.5, 0.8, Sides::Outside, Response::Instant)]);
    // 30 m in the plane at 100 m, with 1 px for 1 m, turned by a tenth.
    let (across, down) = (DVec3::new(1.0, 0.1, 0.0).normalize(), DVec3::new(-0.1, 1.0, 0.0).normalize());
    for i in 0..100 {
        for j in 0..100 {
            let at = |place: i32| 0.3 * (f64::from(place) + 0.5) - 15.0;
            let centre = DVec3::Z * 100.0 + at(i) * across + at(j) * down;
            fine.add(Quads::square(centre, down, across, 0.15), 0, 0, |_| 300.0);
        }
    }
    let exact = 900.0 * 0.8 * band_radiance_exact(fine.band, 300.0);
    for (samples, limit) in [(1, 7e-3), (4, 5e-3), (16, 2.5e-3)] {
        let camera = Camera { samples, ..camera(64, 64, 100.0) };
        let image = fine.draw(&context, &camera, &DAffine3::IDENTITY);
        let sum: f64 = image.radiance.iter().map(|radiance| f64::from(*radiance)).sum();
        println!("{samples} samples: {:.2e} of the plate's radiance", sum / exact - 1.0);
        assert!((sum / exact - 1.0).abs() < limit, "{samples} samples: {sum} of {exact}");
        // Inside the plate no sample is missed between the triangles.
        let [radiance, temperature, _] = image.values(32 * 64 + 32).map(f64::from);
        assert!((radiance * 900.0 / exact - 1.0).abs() < 2e-5 && (temperature - 300.0).abs() < 1e-3);
        assert_eq!(image.coverage[32 * 64 + 32], 1.0);
    }
    assert_silent(&context);
}

/// A scene with a lens and samples, from its file to the images of both engines.
#[test]
fn a_scene_with_a_calibrated_camera_is_drawn_alike_on_device_and_reference() {
    let keys = "fx = 116.1\nfy = 115.3\ncx = 47.1\ncy = 36.8\nskew = 0.4\ndistortion = [-0.31, 0.12, 0.0011, -0.0007, -0.021]\nsamples = 16";
    let folder = Folder::new(&scene_with(&[("fov_deg = 45", keys)]));
    let prepared = folder.prepared();
    let camera = prepared.scene.camera.as_ref();
    assert_eq!(camera.map(|camera| (camera.lens.centre, camera.samples)), Some(([47.1, 36.8], 16)));
    let context = context();
    let device = drawn(&prepared, &mut DeviceEngine::new(&context, &prepared, camera).expect("a small scene"));
    let exact = drawn(&prepared, &mut ReferenceEngine::new(&prepared, camera));
    let mut apart = 0.0;
    let mut partly = 0;
    for (pixel, (a, b)) in device.coverage.iter().zip(&exact.coverage).enumerate() {
        partly += usize::from(*b > 0.0 && *b < 1.0);
        apart += f64::from((a - b).abs());
        assert!((a - b).abs() <= 0.45, "pixel {pixel}: coverage {a} and {b}");
    }
    assert!(partly > 100, "{partly} pixels are covered in part");
    assert!(apart / (partly as f64) < 0.1, "coverage differs by {} in the mean", apart / partly as f64);
    let sum = |image: &Image| image.radiance.iter().map(|radiance| f64::from(*radiance)).sum::<f64>();
    assert!((sum(&device) / sum(&exact) - 1.0).abs() < 2e-3, "{} and {}", sum(&device), sum(&exact));
    assert_silent(&context);
}

/// The image at time 0 of a scene.
fn drawn(prepared: &Prepared, engine: &mut dyn Engine) -> Image {
    start(prepared, engine, None, &never(), &mut || ()).expect("a start");
    let joints = prepared.loads.joints_at(0.0).1;
    let moments = moments(prepared, 0.0, None);
    let moments = moments.as_ref().map(|moments| ImageMoments(moments));
    let order = Order { pose: pose_at(prepared, 0.0), joints: &joints, moments, ..Order::default() };
    engine.submit(None, order).expect("a drawing");
    engine.deliver().expect("an image").image.expect("an image")
}

/// The image of vertices that stand where the twin of the vertex shader puts them, in f64. `slower` divides the time of a row.
fn by_twin(prepared: &Prepared, slower: f64) -> Vec<internals::Pixel> {
    let camera = prepared.scene.camera.as_ref().expect("a camera");
    let moment = moments(prepared, 0.0, None).expect("a rolling shutter");
    let last = f64::from(camera.height - 1);
    let rolling = Rolling {
        poses: [0.0, 0.5 * last, last].map(|row| moment(row * camera.line_time / slower).pose),
        lens: camera.lens,
        field: camera.lens.field([camera.width, camera.height]).ok(),
        rows: camera.height,
    };
    let nodes = &prepared.nodes;
    let positions: Vec<DVec3> = nodes.positions.iter().map(|position| rolling.rolled(position.as_dvec3())).collect();
    let of_group = |group: &[u32]| (0..positions.len()).map(|node| group[node / 4]).collect::<Vec<_>>();
    let (parts, materials) = (of_group(&nodes.group_part), of_group(&nodes.group_material));
    let surface = internals::RasterSurface {
        positions: &positions,
        triangles: &prepared.triangles,
        temperatures: &vec![300.0; positions.len()],
        vertex_part: &parts,
        vertex_material: &materials,
        emissivities: &vec![[1.0; 2]; prepared.materials.len()],
        around: None,
    };
    internals::rasterise(&surface, &raster_view(camera, &DAffine3::IDENTITY), |_| 1.0)
}

/// A craft that turns while the rows are taken, through each kind of lens.
#[test]
fn each_row_of_a_rolling_shutter_sees_the_pose_of_its_time() {
    let spin = "mode = \"spin\"\nquaternion = [1, 0, 0, 0]\nspin_axis = [0.3, 0.2, 0.9]\nrate_deg = 10";
    let context = context();
    for lens in [
        "",
        "distortion = [-0.31, 0.12, 0.0011, -0.0007, -0.021]",
        "distortion = [-0.01, 0.004, 0, 0]\ndistortion_model = \"fisheye\"",
    ] {
        let prepared = |line_time: f64| {
            let keys = format!("fx = 116.1\nfy = 115.3\ncx = 47.1\ncy = 36.8\nline_time = {line_time}\n{lens}");
            let scene = scene_with(&[
                ("fov_deg = 45", &keys),
                ("mode = \"nadir\"\nnadir_axis = \"+Z\"\nforward_axis = \"+X\"", spin),
                ("frame = \"body\"", "frame = \"inertial\""),
            ]);
            Folder::new(&scene).prepared()
        };
        // 72 rows in 0.72 s, and 7.2 deg of the craft.
        let (rolling, still) = (prepared(0.01), prepared(0.0));
        let camera = rolling.scene.camera.clone();
        let found =
            drawn(&rolling, &mut DeviceEngine::new(&context, &rolling, camera.as_ref()).expect("a small scene"));
        let exact = drawn(&rolling, &mut ReferenceEngine::new(&rolling, camera.as_ref()));
        let global = drawn(&still, &mut ReferenceEngine::new(&still, still.scene.camera.as_ref()));
        let apart =
            |a: &Image, b: &Image| (0..a.part.len()).filter(|pixel| a.labels(*pixel) != b.labels(*pixel)).count();
        let seen = exact.part.iter().filter(|part| **part > 0).count();
        let (off, moved) = (apart(&found, &exact), apart(&global, &exact));
        if lens.is_empty() {
            // The same vertices in f64: depths to rounding, and edges that rasterisers round.
            let differ = |twin: &[internals::Pixel]| {
                let pairs = found.depth.iter().zip(&found.part).zip(twin);
                let apart = |((depth, part), twin): &((&f32, &u32), &internals::Pixel)| {
                    let depth = (f64::from(**depth) / twin.depth - 1.0).abs();
                    **part != twin.part || (twin.part > 0 && depth > 1e-5)
                };
                pairs.filter(apart).count()
            };
            let (off, wrong) = (differ(&by_twin(&rolling, 1.0)), differ(&by_twin(&rolling, 1.1)));
            println!("{off} pixels differ from the twin, and {wrong} where a row takes a tenth less");
            assert!(off <= 12 && wrong > 100, "{off} and {wrong}");
        }
        println!("'{lens}': {off} of {seen} pixels show another part, and {moved} without the shutter");
        assert!(seen > 500, "{seen} pixels");
        // At edges: a quarter of a pixel through a lens, and rounding without one.
        let allowed = if lens.is_empty() { 12 } else { 60 };
        assert!(off <= allowed && moved > 2 * off.max(20), "'{lens}': {off} of {seen}, {moved} without the shutter");
        assert_eq!(rolling.scene.camera.as_ref().map(|camera| camera.line_time), Some(0.01));
    }
    assert_silent(&context);
}

/// The mean over several samples is drawn with a rolling shutter too.
#[test]
fn a_rolling_shutter_takes_several_samples() {
    let context = context();
    let of = |samples: u32| {
        let keys = format!("fov_deg = 45\nline_time = 0.01\nsamples = {samples}");
        let prepared = Folder::new(&scene_with(&[("fov_deg = 45", &keys)])).prepared();
        let camera = prepared.scene.camera.clone();
        drawn(&prepared, &mut DeviceEngine::new(&context, &prepared, camera.as_ref()).expect("a small scene"))
    };
    let (one, four, sixteen) = (of(1), of(4), of(16));
    let central = (0..one.part.len()).filter(|pixel| one.part[*pixel] > 0);
    assert!(central.clone().count() > 500);
    assert!(
        central.clone().all(|pixel| (one.part[pixel], one.material[pixel]) == (four.part[pixel], four.material[pixel]))
    );
    let sum = |pixels: &Image| pixels.radiance.iter().map(|radiance| f64::from(*radiance)).sum::<f64>();
    let share = sum(&four) / sum(&sixteen);
    assert!((share - 1.0).abs() < 0.01, "the mean of 4 samples has {share} of the light of 16");
    assert!(four.coverage.iter().any(|share| *share > 0.0 && *share < 1.0), "edges cover a part of a pixel");
    assert_silent(&context);
}

/// The camera of each frame is the stated pose in its own frame, and all three agree on where the craft is.
#[test]
fn a_header_states_the_pose_in_all_frames_and_the_joints() {
    let joint = "\n[[joint]]\npart = \"wing_starboard\"\nmode = \"fixed\"\naxis = \"+X\"\nangle_deg = 30\n[radiance]";
    for frame in ["body", "orbit", "inertial"] {
        let change = format!("frame = \"{frame}\"");
        let scene = scene_with(&[("frame = \"body\"", &change), ("\n[radiance]", joint)]);
        let folder = Folder::new(&scene);
        let prepared = folder.prepared();
        let camera = prepared.scene.camera.as_ref().expect("a camera");
        let image = Some(drawn(&prepared, &mut ReferenceEngine::new(&prepared, Some(camera))));
        let delivered = Delivered { image, ..Delivered::default() };
        let result =
            StepResult { step: 0, image: None, time: 0.0, pose: pose_at(&prepared, 0.0), delivered, budgets: None };
        let maker = FrameMaker::new(&prepared, "a device");
        let (image, header) = maker.frame(result).expect("a frame").expect("an image");
        let path = folder.path("image.exr");
        write_exr(&path, &image, &header).expect("a file");
        let (image, header) = read_exr(&path).expect("the file");
        let from_body = glam::DMat4::from(image.camera_from_body);
        let (from_orbit, from_inertial) =
            header.camera_from_orbit.zip(header.camera_from_inertial).expect("both poses");
        let own = match frame {
            "body" => from_body,
            "orbit" => from_orbit,
            _ => from_inertial,
        };
        let stated = DMat4::from_rotation_translation(camera.frame_from_camera, camera.position);
        assert!((own * stated).abs_diff_eq(DMat4::IDENTITY, 1e-9), "{frame}: {own}");
        // The axes of the orbit frame in the craft: X along the velocity and Z to nadir, as the attitude has them.
        let body_from_orbit = from_body.inverse() * from_orbit;
        assert!(body_from_orbit.abs_diff_eq(DMat4::IDENTITY, 1e-9), "{frame}: {body_from_orbit}");
        // The phase is 80 deg from noon, so +Z of the inertial frame is the orbit normal, which is -Y of the orbit frame.
        let body_from_inertial = from_body.inverse() * from_inertial;
        let normal = body_from_inertial.transform_vector3(DVec3::Z);
        assert!((normal - DVec3::NEG_Y).length() < 1e-9, "{frame}: {normal}");
        let up =
            body_from_inertial.transform_vector3(DVec3::new(80f64.to_radians().cos(), 80f64.to_radians().sin(), 0.0));
        assert!((up - DVec3::NEG_Z).length() < 1e-9, "{frame}: {up}");
        let [(name, pose)] = header.joints.as_slice() else { panic!("{:?}", header.joints) };
        assert_eq!(name, "wing_starboard");
        // A turn about an axis parallel to X.
        let turned = pose.transform_vector3(DVec3::Y);
        assert!((turned - DVec3::new(0.0, 30f64.to_radians().cos(), 0.5)).length() < 1e-9, "{turned}");
    }
}
