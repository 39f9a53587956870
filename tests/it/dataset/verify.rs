//! What `isotherm dataset verify` finds.

use std::fs;
use std::sync::atomic::AtomicBool;

use isotherm::Target;
use isotherm::internals::{Begin, Verified, again, checksums, labels, picked, sum_of};

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

/// Whether a changed list is noticed, by the command that has nothing else to go by.
#[test]
fn every_change_of_a_list_of_checksums_is_noticed() {
    let workshop = Workshop::new(&[("samples = 6", "samples = 2")]);
    workshop.whole("set");
    let root = workshop.path("set");
    let count = || {
        let mut found = Verified::default();
        checksums(&root, &mut found).expect("a data set");
        found.faults.len()
    };
    assert_eq!(count(), 0);
    let lists: Vec<String> =
        workshop.tree("set").into_keys().filter(|name| name.ends_with("checksums.sha256")).collect();
    assert!(lists.len() > 1, "{lists:?}");
    let mut random = super::super::random::Random(7);
    for list in &lists {
        let path = root.join(list);
        let whole = fs::read(&path).expect("a list");
        let mut wrong = vec![
            whole[..whole.len() - 1].to_vec(),
            [&whole[..], b"\n"].concat(),
            [&whole[..], b"x"].concat(),
            whole[whole.iter().position(|byte| *byte == b'\n').expect("lines") + 1..].to_vec(),
            String::from_utf8_lossy(&whole).replace('\n', "\r\n").into_bytes(),
            [&whole[..], &whole].concat(),
            Vec::new(),
        ];
        for _ in 0..16 {
            let mut bytes = whole.clone();
            let at = (random.bits() as usize) % bytes.len();
            bytes[at] ^= 1 << (random.bits() % 7);
            wrong.push(bytes);
        }
        for bytes in wrong {
            fs::write(&path, &bytes).expect("written");
            assert!(count() > 0, "{list}: {}", String::from_utf8_lossy(&bytes));
        }
        fs::write(&path, &whole).expect("written");
    }
    assert_eq!(count(), 0);
    std::os::unix::fs::symlink("dataset.json", root.join("link")).expect("a link");
    assert_eq!(count(), 1);
}

#[test]
fn a_resumed_set_is_complete_only_if_its_files_are_as_they_were_written() {
    let workshop = Workshop::new(&[("samples = 6", "samples = 2")]);
    workshop.whole("set");
    let root = workshop.path("set");
    let resume =
        || workshop.make("set", (0, 1), Begin::Resume).map(|made| made.complete).map_err(|error| error.to_string());
    assert_eq!(resume(), Ok(true));
    let names: Vec<String> = workshop.tree("set").into_keys().collect();
    let named = |part: &str| names.iter().find(|name| name.contains(part)).expect("a file").clone();
    for name in [
        "index.parquet".to_owned(),
        named("/gray/"),
        named("/label/"),
        "spec.toml".to_owned(),
        "checksums.sha256".to_owned(),
    ] {
        let whole = fs::read(root.join(&name)).expect("a file");
        let mut bytes = whole.clone();
        let middle = bytes.len() / 2;
        bytes[middle] ^= 1;
        fs::write(root.join(&name), &bytes).expect("written");
        let message = resume().expect_err(&name);
        assert!(message.contains("is not as it was written"), "{message}");
        fs::write(root.join(&name), &whole).expect("written");
    }
    fs::remove_file(root.join(named("/depth/"))).expect("removed");
    let message = resume().expect_err("a missing file");
    assert!(message.contains("--resume makes this orbit again"), "{message}");
    let orbit = named("/depth/");
    fs::remove_dir_all(root.join(&orbit[..orbit.find("/depth/").expect("a folder")])).expect("removed");
    assert_eq!(resume(), Ok(true));
}

/// The same guard as that of a run: no link within the folder is followed.
#[test]
fn a_data_set_is_not_written_through_a_link() {
    let workshop = Workshop::new(&[("samples = 6", "samples = 2")]);
    let root = workshop.path("set");
    let outside = workshop.path("outside");
    workshop.whole("set");
    let names: Vec<String> = workshop.tree("set").into_keys().collect();
    let image = names.iter().find(|name| name.contains("/gray/")).expect("an image");
    let split = image.split('/').next().expect("a folder");
    for (name, begin) in
        [(".isotherm", Begin::Fresh), (split, Begin::Resume), (split, Begin::Force), ("index.parquet", Begin::Resume)]
    {
        let _ = fs::remove_dir_all(&root);
        let _ = fs::remove_dir_all(&outside);
        fs::create_dir_all(&outside).expect("a folder");
        if name == ".isotherm" {
            fs::create_dir(&root).expect("a folder");
        } else {
            workshop.whole("set");
            fs::remove_file(root.join("checksums.sha256")).expect("removed");
            match root.join(name).is_dir() {
                true => fs::remove_dir_all(root.join(name)).expect("removed"),
                false => fs::remove_file(root.join(name)).expect("removed"),
            }
        }
        fs::create_dir_all(outside.join("000000")).expect("a folder");
        fs::write(outside.join("000000/checksums.sha256"), "mine").expect("written");
        std::os::unix::fs::symlink(&outside, root.join(name)).expect("a link");
        let made = workshop.make("set", (0, 1), begin);
        // A link in the place of a file is replaced, as the file would be.
        assert_eq!(made.is_ok(), name == "index.parquet", "{name}: {:?}", made.err().map(|error| error.to_string()));
        let left = super::tree(&outside);
        assert_eq!(
            left.into_iter().collect::<Vec<_>>(),
            [("000000/checksums.sha256".to_owned(), b"mine".to_vec())],
            "{name}"
        );
    }
}
