//! What a command's single output may be.

use std::os::unix::fs::{FileTypeExt, PermissionsExt, symlink};
use std::os::unix::net::UnixListener;

use super::*;

fn written(path: &Path, bytes: &[u8]) -> Result<(), OutputError> {
    Destination::at(path)?.write_bytes(bytes)
}

#[test]
fn a_file_appears_whole_and_keeps_its_permissions() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.csv");
    written(&path, b"first").unwrap();
    for mode in [0o600, 0o644, 0o666] {
        fs::set_permissions(&path, fs::Permissions::from_mode(mode)).unwrap();
        written(&path, b"second").unwrap();
        assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o7777, mode);
    }
    let failing = |writer: &mut dyn Write| {
        writer.write_all(b"half").unwrap();
        Err(OutputError::Mismatch("in the middle".to_owned()))
    };
    assert!(Destination::at(&path).unwrap().write(failing).is_err());
    assert_eq!(fs::read(&path).unwrap(), b"second");
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "no temporary stays");
}

#[test]
fn links_are_followed_to_their_targets() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    fs::create_dir(at("store")).unwrap();
    fs::write(at("store/real"), b"old").unwrap();
    symlink("store/real", at("link")).unwrap();
    symlink("link", at("link_to_link")).unwrap();
    symlink("store/missing", at("dangling")).unwrap();
    written(&at("link_to_link"), b"new").unwrap();
    written(&at("dangling"), b"made").unwrap();
    assert_eq!(fs::read(at("store/real")).unwrap(), b"new");
    assert_eq!(fs::read(at("store/missing")).unwrap(), b"made");
    for link in ["link", "link_to_link", "dangling"] {
        assert!(fs::symlink_metadata(at(link)).unwrap().is_symlink());
    }
    symlink("round", at("round")).unwrap();
    symlink("store", at("to_folder")).unwrap();
    assert!(matches!(Destination::at(&at("round")), Err(OutputError::Write(..))));
    for folder in ["to_folder", "store", "store/", "new/", "new/.", "store/.."] {
        assert!(matches!(Destination::at(&at(folder)), Err(OutputError::NotAFile(_))), "{folder}");
    }
}

#[test]
fn devices_pipes_and_sockets_are_written_and_stay() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    symlink("/dev/null", at("nothing")).unwrap();
    for device in [Path::new("/dev/null"), &at("nothing")] {
        written(device, b"bytes").unwrap();
    }
    assert!(fs::metadata("/dev/null").unwrap().file_type().is_char_device());
    assert!(matches!(written(Path::new("/dev/full"), b"bytes"), Err(OutputError::Write(..))));
    assert!(std::process::Command::new("mkfifo").arg(at("pipe")).status().unwrap().success());
    let listener = UnixListener::bind(at("socket")).unwrap();
    std::thread::scope(|scope| {
        let piped = scope.spawn(|| fs::read(at("pipe")).unwrap());
        written(&at("pipe"), b"piped").unwrap();
        assert_eq!(piped.join().unwrap(), b"piped");
        let sent = scope.spawn(|| io::read_to_string(listener.accept().unwrap().0).unwrap());
        written(&at("socket"), b"sent").unwrap();
        assert_eq!(sent.join().unwrap(), "sent");
    });
    assert!(fs::metadata(at("pipe")).unwrap().file_type().is_fifo());
    assert!(fs::metadata(at("socket")).unwrap().file_type().is_socket());
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 3, "no temporary stays");
}

#[test]
fn what_a_process_has_open_is_appended_to() {
    use std::os::fd::AsRawFd;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log");
    fs::write(&path, b"before ").unwrap();
    let open = File::open(&path).unwrap();
    for name in ["/dev/fd", "/proc/self/fd"] {
        written(&PathBuf::from(format!("{name}/{}", open.as_raw_fd())), b"more ").unwrap();
    }
    assert_eq!(fs::read(&path).unwrap(), b"before more more ");
    for name in ["-", "/dev/stdout", "/dev/fd/1", "/proc/self/fd/1"] {
        assert_eq!(Destination::at(Path::new(name)).unwrap(), Destination::StandardOutput);
    }
    let dash = folder.path().join("-");
    assert_eq!(Destination::at(&dash).unwrap(), Destination::File(dash));
}

#[test]
fn two_outputs_never_share_a_place() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    symlink("a", at("b")).unwrap();
    assert!(matches!(destinations([Some(&*at("a")), None, Some(&*at("b"))]), Err(OutputError::Twice(..))));
    let null = Path::new("/dev/null");
    let computed = destinations([Some(null), Some(null), Some(&*at("a")), None]).unwrap();
    assert_eq!(computed[2], Some(Destination::File(at("a"))));
    assert!(!at("a").exists(), "a check makes nothing");
    assert!(destinations([Some(&*at("missing/a"))]).is_err());
}
