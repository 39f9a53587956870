//! Tests of files that appear whole or not at all.

use super::*;

fn names(folder: &Path) -> Vec<String> {
    fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect()
}

fn write_bytes(path: &Path, bytes: &[u8]) -> Result<(), OutputError> {
    write_atomic(path, |writer| writer.write_all(bytes).map_err(|source| OutputError::write(path, source)))
}

#[test]
fn a_finished_file_is_alone_in_its_folder_and_readable_by_others() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.txt");
    write_bytes(&path, b"one").unwrap();
    write_bytes(&path, b"two").unwrap();
    assert_eq!(fs::read(&path).unwrap(), b"two");
    assert_eq!(names(folder.path()), ["a.txt"]);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        let plain = folder.path().join("plain");
        fs::write(&plain, b"").unwrap();
        let mode = |p: &Path| fs::metadata(p).unwrap().permissions().mode();
        assert_eq!(mode(&path), mode(&plain));
    }
}

#[test]
fn a_failure_leaves_nothing_behind_and_the_old_file_as_it_was() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.txt");
    write_bytes(&path, b"old").unwrap();
    let error = write_atomic(&path, |writer| {
        writer.write_all(b"half of the new").unwrap();
        Err(OutputError::write(&path, io::Error::from(io::ErrorKind::StorageFull)))
    });
    assert!(error.is_err());
    assert_eq!(fs::read(&path).unwrap(), b"old");
    assert_eq!(names(folder.path()), ["a.txt"]);
}

#[test]
fn a_panic_leaves_nothing_behind() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.txt");
    let run = std::panic::catch_unwind(|| write_atomic(&path, |_| panic!("in the middle")));
    assert!(run.is_err());
    assert!(names(folder.path()).is_empty());
}

#[test]
fn a_missing_folder_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let error = write_bytes(&folder.path().join("absent/a.txt"), b"").unwrap_err().to_string();
    assert!(error.contains("a.txt") && error.contains("in folder") && error.contains("absent"), "{error}");
    let error = write_bytes(folder.path(), b"").unwrap_err();
    assert!(matches!(error, OutputError::NotAFile(_)), "{error}");
}

#[cfg(target_os = "linux")]
#[test]
fn a_folder_that_takes_no_file_is_an_error() {
    // /proc refuses new files even to root.
    let error = write_bytes(Path::new("/proc/isotherm.exr"), b"").unwrap_err();
    assert!(error.to_string().contains("/proc/isotherm.exr"), "{error}");
}
