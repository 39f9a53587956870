//! Culling changes no pixel: the station drawn with it and without it.

use std::path::Path;
use std::sync::Arc;

use glam::{DAffine3, DQuat};
use isotherm::internals::{
    Camera, Collected, Context, DeviceData, Frame, ListEntry, PassWork, Prepared, Renderer, Request, Sampled,
    SceneData, View, Wanted, camera_from_body, device_view,
};
use isotherm::{Scene, internals};

use super::device::{assert_silent, validation_is_asked_for};
use super::hazards::ONE;

type Pixels = (Vec<[u32; 4]>, Vec<[u32; 2]>);

/// The station without joints, and its camera in an image so small that most triangles cover no pixel's centre.
fn small() -> (Prepared, Camera) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("models/station_transition.toml");
    let mut scene = Scene::load(&path).expect("the station of models/");
    // No joints: a joint needs its own runs of triangles, and half a list would break them.
    scene.joints.clear();
    let prepared = Prepared::from_scene(scene, &mut |_| {}).expect("the station of models/");
    let mut camera = prepared.scene.require_camera().expect("a camera").clone();
    camera.samples = 1;
    camera.lens.focal = camera.lens.focal.map(|focal| focal * 0.25);
    camera.lens.centre = camera.lens.centre.map(|centre| centre * 0.25);
    (camera.width, camera.height) = (camera.width / 4, camera.height / 4);
    (prepared, camera)
}

fn bits(collected: &Collected) -> Pixels {
    let radiance = collected.radiance.expect("radiance").iter().map(|pixel| pixel.map(f32::to_bits)).collect();
    (radiance, collected.identity.expect("identity").to_vec())
}

/// An image from a view, with its own list if there is one.
fn drawn<'a>(view: &'a View, list: Option<&'a Frame>) -> Request<'a> {
    Request { views: std::slice::from_ref(view), list, ..Request::default() }
}

/// During slow motion the triangles are not culled for every image. No image must show that.
#[test]
fn slow_motion_is_culled_ahead_of_and_changes_no_pixel() {
    let (prepared, camera) = small();
    let device_data = DeviceData::new(&prepared);
    let data = device_data.scene_data(&prepared, Some(&camera));
    let context = Context::open(None, false).expect("a Vulkan device");
    let load = prepared.loads.step_load(0.0, 15.0);
    let pose = camera_from_body(&camera, &prepared.loads.sky_model().sky(0.0));
    let view = |step: f64| {
        // 0.02 of a pixel a step about the camera's own axis Y.
        let turn = DQuat::from_rotation_y(0.02 * step / camera.lens.focal[0]);
        device_view(&camera, &(DAffine3::from_quat(turn) * pose))
    };
    let renderer = || {
        let mut renderer = Renderer::new(&context, &data).expect("the station on the device");
        renderer.settle(&load).expect("a settled state");
        renderer
    };
    let (mut creeping, mut anew) = (renderer(), renderer());
    let image = |cull| Wanted { image: true, cull, temperatures: false, ..Wanted::default() };
    let whole = image(data.triangles.len() as u32);
    for step in 0..9 {
        let view = view(f64::from(step));
        let submitted = creeping.submit(drawn(&view, None)).expect("a frame");
        let crept = bits(&creeping.collect(submitted).expect("an image"));
        let submitted = anew.submit(drawn(&view, Some(&Frame::step(&[], whole)))).expect("a frame");
        assert!(crept == bits(&anew.collect(submitted).expect("an image")), "image {step} differs");
    }
    let culled = creeping.pass_times().iter().find(|(name, _)| *name == "cull").map_or(0, |(_, times)| times.len());
    assert!((2..6).contains(&culled), "culled {culled} times");
    // The triangles of a view differ from those of a view one pixel away.
    let away = view(50.0);
    let submitted = anew.submit(drawn(&away, Some(&Frame::step(&[], image(0))))).expect("a frame");
    let stale = bits(&anew.collect(submitted).expect("an image"));
    let submitted = anew.submit(drawn(&away, Some(&Frame::step(&[], whole)))).expect("a frame");
    assert!(stale != bits(&anew.collect(submitted).expect("an image")), "the comparison sees stale triangles");
}

/// A device that takes one command with each indirect draw draws the same.
#[test]
fn one_command_a_draw_changes_no_pixel() {
    let (prepared, camera) = small();
    let device_data = DeviceData::new(&prepared);
    let data = device_data.scene_data(&prepared, Some(&camera));
    let load = prepared.loads.step_load(0.0, 15.0);
    let view = device_view(&camera, &camera_from_body(&camera, &prepared.loads.sky_model().sky(0.0)));
    let image = |draws_many: bool| {
        let mut context = Context::open(None, validation_is_asked_for()).expect("a Vulkan device");
        Arc::get_mut(&mut context).expect("a device of this test").info.draws_many &= draws_many;
        let mut renderer = Renderer::new(&context, &data).expect("the station on the device");
        renderer.settle(&load).expect("a settled state");
        let submitted = renderer.submit(drawn(&view, None)).expect("a frame");
        let pixels = bits(&renderer.collect(submitted).expect("an image"));
        assert_silent(&context);
        pixels
    };
    let many = image(true);
    assert!(many.0.iter().any(|bits| *bits != many.0[0]), "the image shows the station");
    assert!(many == image(false));
}

/// With four samples the triangles are culled for each of them.
#[test]
fn culling_changes_no_pixel() {
    for samples in [1, 4] {
        without_culling_is_the_same(samples);
    }
}

fn without_culling_is_the_same(samples: u32) {
    let (prepared, mut camera) = small();
    camera.samples = samples;
    let device_data = DeviceData::new(&prepared);
    let data = device_data.scene_data(&prepared, Some(&camera));
    let context = Context::open(None, false).expect("a Vulkan device");
    let load = prepared.loads.step_load(0.0, 15.0);
    let pose = camera_from_body(&camera, &prepared.loads.sky_model().sky(0.0));
    let view = device_view(&camera, &pose);

    let draw = |data: &SceneData, frame: &dyn Fn(u32) -> Frame| -> Pixels {
        let mut renderer = Renderer::new(&context, data).expect("the station on the device");
        renderer.settle(&load).expect("a settled state");
        let frame = frame(data.triangles.len() as u32);
        let submitted = renderer.submit(drawn(&view, Some(&frame))).expect("a frame");
        bits(&renderer.collect(submitted).expect("an image"))
    };
    let sampled = (samples > 1).then_some(Sampled { gathered: samples, rows: camera.height, ..ONE });
    let culled = |cull| Frame::step(&[], Wanted { image: true, cull, sampled, ..Wanted::default() });
    // The same list with a copy of all triangles instead of culling.
    let whole = |triangles| {
        let mut frame = culled(triangles);
        for entry in &mut frame.entries {
            match entry {
                ListEntry::Pass(pass) if pass.entry() == Some("cull.comp") => {
                    pass.work = PassWork::Copy { from: &internals::TRIANGLES, to: &internals::VISIBLE_TRIANGLES };
                }
                ListEntry::Barriers(barriers) => {
                    for barrier in barriers.iter_mut().filter(|b| b.resource == &internals::VISIBLE_TRIANGLES) {
                        barrier.before.stage = ash::vk::PipelineStageFlags2::ALL_COMMANDS;
                        barrier.before.access = ash::vk::AccessFlags2::MEMORY_WRITE;
                        barrier.after.stage = ash::vk::PipelineStageFlags2::ALL_COMMANDS;
                        barrier.after.access = ash::vk::AccessFlags2::MEMORY_READ | ash::vk::AccessFlags2::MEMORY_WRITE;
                    }
                }
                ListEntry::Pass(_) => {}
            }
        }
        frame
    };
    // A missing triangle is visible, because the comparison is by pixel.
    let without_cull = draw(&data, &whole);
    assert!(without_cull.1.iter().filter(|pixel| pixel[0] != 0).count() > 1000, "the station is in the picture");
    assert!(draw(&data, &culled) == without_cull, "an image with culled triangles differs");
    let half = SceneData { triangles: &data.triangles[..data.triangles.len() / 2], ..data };
    assert!(draw(&half, &culled) != without_cull, "the comparison sees triangles that are missing");
}
