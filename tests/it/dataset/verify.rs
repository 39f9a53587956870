//! What `isotherm dataset verify` finds.

use std::fs;
use std::sync::atomic::AtomicBool;

use isotherm::Target;
use isotherm::internals::{Verified, again, checksums, labels, picked, sum_of};

use super::super::program::{end, isotherm, refusal, succeed};
use super::Workshop;

#[test]
fn a_flipped_byte_a_wrong_label_and_another_image_are_found() {
    let workshop = Workshop::new(&[("samples = 6", "samples = 2")]);
    workshop.whole("set");
    let root = workshop.path("set");
    let (spec, scenes) = workshop.spec();
    let never = AtomicBool::new(false);
    let all = |found: &mut Verified| {
        checksums(&root, found).expect("a data set");
        labels(&root, &spec, &never, found).expect("labels");
        again(&root, (&spec, &scenes, &Target::Reference), &picked(&spec, 1, 3), &never, found).expect("images");
    };
    let mut found = Verified::default();
    all(&mut found);
    assert_eq!((found.faults, found.images, found.rendered), (Vec::new(), 2, 1));
    assert!(found.files > 20);

    let names: Vec<String> = workshop.tree("set").into_keys().collect();
    let gray = names.iter().find(|name| name.contains("/gray/")).expect("an image");
    let mut bytes = fs::read(root.join(gray)).expect("a file");
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(root.join(gray), &bytes).expect("written");
    fs::write(root.join("stranger.txt"), "").expect("written");
    let mut found = Verified::default();
    checksums(&root, &mut found).expect("a data set");
    assert_eq!(found.faults.len(), 2, "{:?}", found.faults);
    assert!(found.faults[0].contains(gray) && found.faults[1].contains("stranger.txt"));
    bytes[middle] ^= 1;
    fs::write(root.join(gray), &bytes).expect("written");
    fs::remove_file(root.join("stranger.txt")).expect("removed");

    // A label whose checksum fits.
    let label = names.iter().find(|name| name.contains("/label/")).expect("a label");
    let text = fs::read_to_string(root.join(label)).expect("a file");
    let changed = text.replacen("\"pixel\":[", "\"pixel\":[9", 1);
    assert_ne!(text, changed);
    let list = fs::read_to_string(root.join("checksums.sha256")).expect("a list");
    let swapped = list.replace(&sum_of(text.as_bytes()), &sum_of(changed.as_bytes()));
    assert_ne!(list, swapped);
    fs::write(root.join(label), changed).expect("written");
    fs::write(root.join("checksums.sha256"), swapped).expect("written");
    let mut found = Verified::default();
    all(&mut found);
    assert!(found.faults.iter().any(|fault| fault.contains("from its projection")), "{:?}", found.faults);
    assert!(!found.faults.iter().any(|fault| fault.contains("was changed")), "{:?}", found.faults);
}

/// A copy without isotherm's own records, as an archive or an object store may have it.
#[test]
fn a_copy_without_records_is_checked_as_far_as_it_can_be() {
    let workshop = Workshop::new(&[("samples = 6", "samples = 1")]);
    workshop.whole("set");
    fs::remove_dir_all(workshop.path("set/.isotherm")).expect("removed");
    let home = workshop.0.0.path();
    let (code, error) = refusal(&end(isotherm(home, &["dataset", "verify", "set"])));
    assert!(code == Some(2) && error.contains("set does not say where its SPEC is"), "{error}");
    let told = succeed(home, &["dataset", "verify", "set", "--samples", "0"]);
    assert!(told.contains("the labels of 1 images and 0 images that were rendered again"), "{told}");
    let told = succeed(home, &["dataset", "verify", "set", "--spec", "spec.toml", "--device", "cpu"]);
    assert!(told.contains("the labels of 1 images and 1 images that were rendered again"), "{told}");
}

/// Nothing is written, so there is nothing to go on with.
#[test]
fn a_stopped_verification_promises_no_resume() {
    let workshop = Workshop::new(&[("samples = 6", "samples = 1")]);
    workshop.whole("set");
    let (spec, _) = workshop.spec();
    let stopped = labels(&workshop.path("set"), &spec, &AtomicBool::new(true), &mut Verified::default());
    assert_eq!(stopped.expect_err("stopped").to_string(), "stopped; nothing was written");
}
