//! Culling changes no pixel: the station drawn with it and without it.

use std::path::Path;

use isotherm::gpu::context::Context;
use isotherm::gpu::frame::{Frame, Wanted};
use isotherm::gpu::pass::{Resource, Step, Work};
use isotherm::gpu::renderer::Renderer;
use isotherm::gpu::resources::SceneData;
use isotherm::scene::Scene;
use isotherm::simulation::device_data::DeviceData;
use isotherm::simulation::prepare::Prepared;
use isotherm::simulation::viewpoint::{camera_from_body, device_view};

type Pixels = (Vec<[u32; 4]>, Vec<[u32; 2]>);

#[test]
fn culling_changes_no_pixel() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("models/station.toml");
    let mut scene = Scene::load(&path).expect("the station of models/");
    // As the file has it: what moves is culled by the same shader, and drawn in runs that half a list would break.
    scene.joints.clear();
    let prepared = Prepared::from_scene(scene, &mut |_| {}).expect("the station of models/");
    let mut camera = prepared.scene.require_camera().expect("a camera").clone();
    // A small image, so that most triangles cover no pixel's centre.
    camera.focal = camera.focal.map(|focal| focal * 0.25);
    camera.centre = camera.centre.map(|centre| centre * 0.25);
    (camera.width, camera.height) = (camera.width / 4, camera.height / 4);
    let device_data = DeviceData::new(&prepared);
    let data = device_data.scene_data(&prepared, Some(&camera));
    let context = Context::open(None, false).expect("a Vulkan device");
    let load = prepared.loads.tick_load(0.0, 15.0);
    let pose = camera_from_body(&camera, &prepared.loads.sky_model().sky(0.0));
    let view = device_view(&camera, &pose);

    let draw = |data: &SceneData, frame: &dyn Fn(u32) -> Frame| -> Pixels {
        let mut renderer = Renderer::new(&context, data).expect("the station on the device");
        renderer.settle(&load).expect("a settled state");
        let frame = frame(data.triangles.len() as u32);
        let wanted = Wanted { image: true, ..Wanted::default() };
        let submitted = renderer.submit_frame(&frame, None, Some(&view), wanted).expect("a frame");
        let collected = renderer.collect(submitted).expect("an image");
        let radiance = collected.radiance.expect("radiance").iter().map(|pixel| pixel.map(f32::to_bits)).collect();
        (radiance, collected.identity.expect("identity").to_vec())
    };
    let culled = |triangles| Frame::step(&[], Wanted { image: true, cull: triangles, temperatures: false });
    // The same list with a copy of all triangles in place of the cull.
    let whole = |triangles| {
        let mut frame = culled(triangles);
        for step in &mut frame.steps {
            match step {
                Step::Pass(pass) if matches!(pass.work, Work::Cull { .. }) => {
                    pass.work = Work::Copy { from: Resource::Triangles, to: Resource::VisibleTriangles };
                }
                Step::Barriers(barriers) => {
                    for barrier in barriers.iter_mut().filter(|b| b.resource == Resource::VisibleTriangles) {
                        barrier.before.stage = ash::vk::PipelineStageFlags2::ALL_COMMANDS;
                        barrier.before.access = ash::vk::AccessFlags2::MEMORY_WRITE;
                        barrier.after.stage = ash::vk::PipelineStageFlags2::ALL_COMMANDS;
                        barrier.after.access = ash::vk::AccessFlags2::MEMORY_READ | ash::vk::AccessFlags2::MEMORY_WRITE;
                    }
                }
                Step::Pass(_) => {}
            }
        }
        frame
    };
    // One triangle left out shows: the comparison is of single pixels.
    let without_cull = draw(&data, &whole);
    assert!(without_cull.1.iter().filter(|pixel| pixel[0] != 0).count() > 1000, "the station is in the picture");
    assert!(draw(&data, &culled) == without_cull, "an image with culled triangles differs");
    let half = SceneData { triangles: &data.triangles[..data.triangles.len() / 2], ..data };
    assert!(draw(&half, &culled) != without_cull, "the comparison sees triangles that are missing");
}
