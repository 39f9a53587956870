//! A data set whose process is killed and resumed has the files of an undisturbed one.

use std::process::{Command, Stdio};
use std::time::Duration;

use super::super::program::{isotherm, succeed};
use super::super::random::Random;
use super::{Workshop, differing};

const MAKE: [&str; 6] = ["dataset", "spec.toml", "--device", "cpu", "-o", "killed"];

#[test]
#[ignore = "long: tools/test --all"]
fn a_data_set_survives_two_kills() {
    let workshop = Workshop::new(&[("samples = 6", "samples = 12")]);
    let began = std::time::Instant::now();
    workshop.whole("one");
    let took = began.elapsed();
    let mut random = Random(0x5DEE_CE66);
    for number in 0..2 {
        let mut command: Command = isotherm(workshop.0.0.path(), &MAKE);
        let more: &[&str] = if number == 0 { &[] } else { &["--resume"] };
        command.args(more);
        let mut child = command.stderr(Stdio::null()).stdout(Stdio::null()).spawn().expect("the program starts");
        std::thread::sleep(Duration::from_secs_f64(took.as_secs_f64() * random.unit()));
        let _ = child.kill();
        let _ = child.wait();
    }
    let told = succeed(workshop.0.0.path(), &[&MAKE[..], &["--resume"]].concat());
    assert!(told.contains("the data set is complete"), "{told}");
    assert_eq!(differing(&workshop.tree("one"), &workshop.tree("killed")), [""; 0]);
    let told = succeed(workshop.0.0.path(), &["dataset", "verify", "killed"]);
    assert!(told.contains("are as they were written"), "{told}");
}
