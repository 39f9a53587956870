//! Tests of output folders.

use super::*;

fn names(folder: &Path) -> Vec<String> {
    entries(folder).unwrap().iter().map(|p| p.file_name().unwrap().to_string_lossy().into_owned()).collect()
}

const OWN: [&str; 4] = ["series.csv", "frames/step_#.exr", "frames/step_#.png", "plots/*.svg"];

fn prepare(root: &Path, overwrite: bool, inputs: &[PathBuf]) -> Result<Folder, OutputError> {
    Folder::new(root, &OWN).prepare(overwrite, inputs)
}

/// A folder with the files of a run.
fn with_files(root: &Path) {
    let run = prepare(root, false, &[]).unwrap();
    for name in ["series.csv", "plots/materials.svg", "frames/step_000003.exr", "frames/step_000003.png"] {
        run.write_bytes(name, b"earlier").unwrap();
    }
}

#[test]
fn an_absent_or_empty_folder_is_made_ready_with_its_parents() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path().join("a/b/run");
    let run = prepare(&root, false, &[]).unwrap();
    assert_eq!(names(&root), [HOME, "frames", "plots"]);
    assert!(names(&root.join("frames")).is_empty(), "the write test must clean up");
    assert_eq!(run.file("plots/a.svg"), root.join("plots/a.svg"));
}

#[test]
fn a_folder_with_content_needs_force_which_removes_only_what_the_manifest_lists() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    with_files(folder.path());
    let others = [
        "notes.txt",
        "frames/mine.png",
        "frames/step_000003.txt",
        "frames/step_old.exr",
        "plots/mine.pdf",
        "step_000003.exr",
    ];
    for name in others {
        fs::write(at(name), b"the user's").unwrap();
    }
    let error = prepare(folder.path(), false, &[]).unwrap_err();
    assert!(error.to_string().contains("--force"), "{error}");
    assert!(at("series.csv").exists() && at("frames/step_000003.exr").exists(), "a refused folder is untouched");

    prepare(folder.path(), true, &[]).unwrap();
    assert!(others.iter().all(|name| at(name).exists()));
    assert_eq!(names(folder.path()), [HOME, "frames", "notes.txt", "plots", "step_000003.exr"]);
    assert_eq!(names(&at("frames")), ["mine.png", "step_000003.txt", "step_old.exr"]);
    assert_eq!(names(&at("plots")), ["mine.pdf"]);
}

#[test]
fn files_without_a_manifest_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("plots")).unwrap();
    fs::write(folder.path().join("plots/mine.svg"), b"the user's").unwrap();
    let error = prepare(folder.path(), true, &[]).unwrap_err();
    assert!(matches!(error, OutputError::NoManifest(_)), "{error}");
    let error = prepare(folder.path(), false, &[]).unwrap_err();
    assert!(matches!(error, OutputError::FolderNotEmpty(_)), "{error}");
    assert_eq!(names(folder.path()), ["plots"], "a refused folder is untouched");
}

#[test]
fn what_was_changed_or_is_not_listed_is_refused_before_anything_is_removed() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let refused = |named: &str| {
        let before = names(&at("frames"));
        let error = prepare(folder.path(), true, &[]).unwrap_err().to_string();
        assert!(error.contains(named), "{error}");
        assert_eq!(names(&at("frames")), before);
        assert!(at("series.csv").exists() && at("plots/materials.svg").exists());
    };
    with_files(folder.path());
    // The same size at another time.
    let svg = at("plots/materials.svg");
    fs::write(&svg, b"changed").unwrap();
    refused("plots/materials.svg is not as isotherm left it");
    fs::remove_file(&svg).unwrap();
    fs::create_dir(&svg).unwrap();
    refused("plots/materials.svg is not as");
    fs::remove_dir(&svg).unwrap();
    fs::write(at("plots/mine.svg"), b"").unwrap();
    fs::write(&svg, b"earlier").unwrap();
    fs::remove_file(&svg).unwrap();
    fs::write(&svg, b"x").unwrap();
    refused("plots/materials.svg is not as");
    fs::remove_file(&svg).unwrap();
    let error = prepare(folder.path(), true, &[]).unwrap_err().to_string();
    assert!(error.contains("plots/mine.svg was not written by isotherm"), "{error}");
    fs::remove_file(at("plots/mine.svg")).unwrap();
    prepare(folder.path(), true, &[]).unwrap();
}

#[cfg(unix)]
#[test]
fn links_are_not_followed() {
    use std::os::unix::fs::symlink;
    let folder = tempfile::tempdir().unwrap();
    let [root, outside] = ["out", "outside"].map(|name| folder.path().join(name));
    with_files(&root);
    fs::rename(root.join("plots"), &outside).unwrap();
    symlink(&outside, root.join("plots")).unwrap();
    let error = prepare(&root, true, &[]).unwrap_err();
    assert!(matches!(&error, OutputError::Link(path) if path.ends_with("plots")), "{error}");
    assert_eq!(names(&outside), ["materials.svg"]);
    assert_eq!(names(&root.join("frames")).len(), 2, "a refused folder is untouched");
    fs::remove_file(root.join("plots")).unwrap();
    // A link in place of a listed file.
    fs::rename(root.join("series.csv"), outside.join("series.csv")).unwrap();
    symlink(outside.join("series.csv"), root.join("series.csv")).unwrap();
    assert!(matches!(prepare(&root, true, &[]).unwrap_err(), OutputError::Link(_)));
    fs::remove_file(root.join("series.csv")).unwrap();
    // The folder itself may be named by a link.
    let link = folder.path().join("link");
    symlink(&root, &link).unwrap();
    let run = prepare(&link, true, &[]).unwrap();
    // A link that comes in between is not written through.
    fs::remove_dir(root.join("plots")).unwrap();
    symlink(&outside, root.join("plots")).unwrap();
    assert!(matches!(run.write_bytes("plots/a.svg", b"").unwrap_err(), OutputError::Link(_)));
    fs::write(root.join("series.csv"), b"the user's").unwrap();
    assert!(matches!(run.write_bytes("series.csv", b"").unwrap_err(), OutputError::Stranger(_)));
}

#[test]
fn a_manifest_that_points_elsewhere_removes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path().join("out");
    for path in ["../victim", "/etc/hostname", "frames/../../victim"] {
        with_files(&root);
        fs::write(folder.path().join("victim"), b"").unwrap();
        let manifest = root.join(HOME).join("manifest");
        let computed = fs::metadata(folder.path().join("victim")).unwrap();
        let since = computed.modified().unwrap().duration_since(std::time::UNIX_EPOCH).unwrap().as_nanos();
        let line = format!("{{\"file\":\"{path}\",\"bytes\":\"0\",\"modified_ns\":\"{since}\"}}\n");
        let text = fs::read_to_string(&manifest).unwrap() + &line;
        fs::write(&manifest, text).unwrap();
        prepare(&root, true, &[]).unwrap_err();
        assert!(folder.path().join("victim").exists() && root.join("series.csv").exists());
        fs::write(&manifest, "{\"fil").unwrap();
        let error = prepare(&root, true, &[]).unwrap_err();
        assert!(matches!(error, OutputError::Stranger(_)), "half a line lists nothing: {error}");
        fs::write(&manifest, "nonsense\n").unwrap();
        let error = prepare(&root, true, &[]).unwrap_err();
        assert!(matches!(error, OutputError::Manifest(..)), "{error}");
        fs::remove_dir_all(&root).unwrap();
    }
}

#[test]
fn a_second_run_into_a_folder_is_refused_as_long_as_the_first_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let run = prepare(folder.path(), false, &[]).unwrap();
    for overwrite in [false, true] {
        let error = prepare(folder.path(), overwrite, &[]).unwrap_err();
        assert!(matches!(error, OutputError::InUse(_)), "{error}");
    }
    assert!(matches!(Folder::new(folder.path(), &OWN).reopen().unwrap_err(), OutputError::InUse(_)));
    drop(run);
    prepare(folder.path(), true, &[]).unwrap();
    let absent = Folder::new(&folder.path().join("absent"), &OWN).reopen().unwrap_err();
    assert!(matches!(absent, OutputError::NoRun(_)), "{absent}");
}

#[test]
fn files_that_were_not_written_leave_no_folders() {
    let outside = tempfile::tempdir().unwrap();
    let fresh = outside.path().join("fresh");
    let prepared = prepare(&fresh, false, &[]).unwrap();
    assert!(fresh.join("frames").is_dir());
    prepared.take_back();
    assert!(!fresh.exists());

    let empty = outside.path().join("empty");
    fs::create_dir(&empty).unwrap();
    prepare(&empty, false, &[]).unwrap().take_back();
    assert!(names(&empty).is_empty(), "the user's own folder stays");
    fs::write(empty.join("mine.txt"), b"mine").unwrap();
    assert!(prepare(&empty, true, &[]).is_err());
    fs::remove_file(empty.join("mine.txt")).unwrap();

    let prepared = prepare(&fresh, false, &[]).unwrap();
    fs::write(fresh.join("plots/mine.txt"), b"mine").unwrap();
    prepared.take_back();
    assert!(fresh.join("plots/mine.txt").exists() && !fresh.join("frames").exists());
    drop(prepared);
    prepare(&fresh, true, &[]).unwrap();
}

#[test]
fn a_file_in_the_way_is_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run");
    fs::write(&path, b"").unwrap();
    assert!(matches!(prepare(&path, true, &[]), Err(OutputError::NotAFolder(_))));
    assert!(matches!(prepare(&path.join("deeper"), false, &[]), Err(OutputError::CreateFolder { .. })));
}

#[test]
fn a_file_that_is_read_is_not_written_whatever_it_is_called() {
    let folder = tempfile::tempdir().unwrap();
    let input = folder.path().join("series.csv");
    fs::write(&input, b"the user's").unwrap();
    let inputs = [input.clone()];
    let aliased = folder.path().join(".").join("series.csv");
    assert!(Folder::new(&folder.path().join("out"), &OWN).keep_inputs(&inputs).is_ok());
    let error = Folder::new(folder.path(), &OWN).keep_inputs(&inputs).unwrap_err();
    assert!(error.to_string().contains("series.csv") && error.is_about_the_folder(), "{error}");
    let error = prepare(folder.path(), true, &[aliased]).unwrap_err();
    assert!(matches!(error, OutputError::Overwrites(_)) && input.exists(), "{error}");
}

#[cfg(unix)]
#[test]
fn a_link_that_is_read_is_not_removed() {
    let folder = tempfile::tempdir().unwrap();
    let [own, link] = ["plots/a.svg", "material.svg"].map(|name| folder.path().join(name));
    fs::create_dir(folder.path().join("plots")).unwrap();
    fs::write(&own, b"earlier").unwrap();
    std::os::unix::fs::symlink(&own, &link).unwrap();
    let error = prepare(folder.path(), true, std::slice::from_ref(&link)).unwrap_err();
    assert!(matches!(&error, OutputError::Overwrites(path) if *path == link), "{error}");
    assert!(own.exists(), "a refused folder is untouched");
}

#[cfg(target_os = "linux")]
#[test]
fn a_folder_that_cannot_be_written_is_an_error() {
    // /proc refuses new files even to root.
    let error = prepare(Path::new("/proc/isotherm-output"), false, &[]).unwrap_err();
    assert!(matches!(error, OutputError::CreateFolder { .. }), "{error}");
}
