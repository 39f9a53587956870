//! `isotherm run --mcap`: the records of the log, read as the format says.

use isotherm::internals::read_exr;

use crate::craft::{Folder, SCENE};
use crate::program::succeed;

/// A message of a topic.
struct Message {
    topic: String,
    time: u64,
    data: Vec<u8>,
}

fn messages(bytes: &[u8]) -> Vec<Message> {
    let stream = mcap::MessageStream::new(bytes).expect("an MCAP file");
    let read = stream.map(|message| message.expect("a whole message"));
    read.map(|message| {
        assert_eq!(message.channel.message_encoding, "cdr");
        let schema = message.channel.schema.as_ref().expect("a schema");
        assert_eq!(schema.encoding, "ros2msg");
        Message { topic: message.channel.topic.clone(), time: message.log_time, data: message.data.to_vec() }
    })
    .collect()
}

#[test]
fn a_log_has_the_images_of_the_run() {
    let folder = Folder::new(&SCENE.replace("step = 60\n", "step = 60\nstart = \"2026-01-02T03:04:05Z\"\n"));
    let run = ["run", "scene.toml", "-o", "out", "--mcap", "log.mcap", "--device", "cpu"];
    succeed(folder.0.path(), &run);
    let log = messages(&std::fs::read(folder.path("log.mcap")).expect("the log"));
    let of = |topic: &str| log.iter().filter(|message| message.topic == topic).collect::<Vec<_>>();
    let steps = [0, 4, 8, 12];
    for topic in ["/camera/temperature", "/camera/radiance", "/camera/camera_info", "/tf"] {
        let times: Vec<u64> = of(topic).iter().map(|message| message.time).collect();
        assert_eq!(times, steps.map(|step| (1_767_323_045 + 60 * step) * 1_000_000_000), "{topic}");
    }
    for (step, (temperature, radiance)) in
        steps.iter().zip(of("/camera/temperature").iter().zip(of("/camera/radiance")))
    {
        let (frame, _) = read_exr(&folder.path(&format!("out/frames/step_{step:06}.exr"))).expect("a frame");
        let pixels = frame.part.len();
        let counts = temperature.data[temperature.data.len() - 2 * pixels..].as_chunks::<2>().0;
        let worst = counts
            .iter()
            .zip(&frame.temperature)
            .map(|(count, kelvin)| (0.01 * f64::from(u16::from_le_bytes(*count)) - f64::from(*kelvin)).abs());
        assert!(worst.fold(0.0, f64::max) < 0.00501);
        let floats = radiance.data[radiance.data.len() - 4 * pixels..].as_chunks::<4>().0;
        assert!(floats.iter().zip(&frame.radiance).all(|(bytes, radiance)| f32::from_le_bytes(*bytes) == *radiance));
        assert!(temperature.data.windows(7).any(|word| word == b"mono16\0"));
        assert!(radiance.data.windows(6).any(|word| word == b"32FC1\0"));
    }
    assert!(frame_differs(&folder), "frames of different steps must not pass for each other");
}

fn frame_differs(folder: &Folder) -> bool {
    let frame = |step: u32| read_exr(&folder.path(&format!("out/frames/step_{step:06}.exr"))).expect("a frame").0;
    frame(0).radiance != frame(12).radiance
}
