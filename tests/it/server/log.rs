//! `isotherm run --mcap`: the records of the log, read as the format says.

use isotherm::internals::{read_exr, read_png};

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
    for topic in ["/camera/temperature", "/camera/radiance", "/camera/camera_info", "/craft/pose", "/tf"] {
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

/// Digital numbers as they are, the craft where its orbit is, and a frame for each joint.
#[test]
fn a_log_has_the_sensor_the_craft_and_its_joints() {
    let more = "[sensor]\nbits = 14\nnetd = 0\nrange = [150, 450]\n[[joint]]\npart = \"mast\"\nkind = \"translation\"\nmode = \"fixed\"\n\
                axis = \"-Z\"\ndistance = 0.4\n";
    let folder = Folder::new(&format!("{SCENE}{more}").replace("steps = 12", "steps = 4"));
    succeed(folder.0.path(), &["run", "scene.toml", "-o", "out", "--mcap", "log.mcap", "--device", "cpu"]);
    let log = messages(&std::fs::read(folder.path("log.mcap")).expect("the log"));
    let of = |topic: &str| log.iter().filter(|message| message.topic == topic).collect::<Vec<_>>();
    let f64s = |data: &[u8]| data.as_chunks::<8>().0.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect::<Vec<_>>();
    for (step, raw) in [0, 4].iter().zip(of("/camera/image_raw")) {
        let png = std::fs::read(folder.path(&format!("out/frames/step_{step:06}_dn.png"))).expect("a file");
        let (_, pixels) = read_png(&png).expect("a PNG");
        let turned: Vec<u8> = pixels.as_chunks::<2>().0.iter().flat_map(|[high, low]| [*low, *high]).collect();
        assert_eq!(raw.data[raw.data.len() - turned.len()..], turned);
        assert!(raw.data.windows(7).any(|word| word == b"mono16\0"));
    }
    assert_eq!(of("/camera/image_raw").len(), 2);
    for (step, pose) in [0.0, 4.0].into_iter().zip(of("/craft/pose")) {
        let numbers = f64s(&pose.data[pose.data.len() - 56..]);
        // Phase 80 deg at the start, and a revolution in 5553.6 s.
        let angle = (80.0 + 360.0 * 60.0 * step / 5553.6_f64).to_radians();
        let (sine, cosine) = angle.sin_cos();
        let off = [numbers[0] - 6_779e3 * cosine, numbers[1] - 6_779e3 * sine, numbers[2]];
        assert!(off.iter().all(|off| off.abs() < 1.0), "{numbers:?}");
        // The body's +Z is nadir.
        let [x, y, z, w] = [numbers[3], numbers[4], numbers[5], numbers[6]];
        let nadir = glam::DQuat::from_xyzw(x, y, z, w) * glam::DVec3::Z;
        assert!(nadir.distance(-glam::DVec3::new(cosine, sine, 0.0)) < 1e-6, "{nadir}");
    }
    for tf in of("/tf") {
        let at = tf.data.windows(11).position(|word| word == b"joint/mast\0").expect("the frame of the joint") + 11;
        let numbers = f64s(&tf.data[4 + (at - 4).next_multiple_of(8)..][..56]);
        assert!(
            numbers.iter().zip([0.0, 0.0, -0.4, 0.0, 0.0, 0.0, 1.0]).all(|(a, b)| (a - b).abs() < 1e-6),
            "{numbers:?}"
        );
        assert!(tf.data.windows(7).any(|word| word == b"planet\0"));
    }
}

fn frame_differs(folder: &Folder) -> bool {
    let frame = |step: u32| read_exr(&folder.path(&format!("out/frames/step_{step:06}.exr"))).expect("a frame").0;
    frame(0).radiance != frame(12).radiance
}
