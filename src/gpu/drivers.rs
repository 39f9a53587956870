//! The driver files that the Vulkan loader reads, for errors about drivers that do not work.

use std::env;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// The driver files of this computer, each with what is wrong with it as far as its text tells.
pub(super) fn description() -> String {
    let files = files();
    if files.is_empty() {
        return "no driver is installed".to_owned();
    }
    files.iter().map(|file| state(file)).collect::<Vec<_>>().join("; ")
}

/// Paths of the driver files, in the order of the loader. Environment variables take the place of the usual folders.
fn files() -> Vec<PathBuf> {
    let set = |name: &str| env::var_os(name).filter(|value| !value.is_empty());
    match set("VK_DRIVER_FILES").or_else(|| set("VK_ICD_FILENAMES")) {
        Some(named) => env::split_paths(&named).collect(),
        None => folders(&set).iter().flat_map(|folder| in_folder(&folder.join("vulkan/icd.d"))).collect(),
    }
}

fn folders(set: &dyn Fn(&str) -> Option<OsString>) -> Vec<PathBuf> {
    let home = |below: &str| set("HOME").map(|home| PathBuf::from(home).join(below));
    let one = |name: &str, below: &str| set(name).map(PathBuf::from).or_else(|| home(below));
    let many = |name: &str, usual: &str| {
        let list = set(name).unwrap_or_else(|| usual.into());
        env::split_paths(&list).collect::<Vec<_>>()
    };
    let mut all = Vec::new();
    all.extend(one("XDG_CONFIG_HOME", ".config"));
    all.extend(many("XDG_CONFIG_DIRS", "/etc/xdg"));
    all.push(PathBuf::from("/etc"));
    all.extend(one("XDG_DATA_HOME", ".local/share"));
    all.extend(many("XDG_DATA_DIRS", "/usr/local/share:/usr/share"));
    all
}

fn in_folder(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut files: Vec<PathBuf> =
        entries.map(|entry| entry.path()).filter(|path| path.extension().is_some_and(|end| end == "json")).collect();
    files.sort();
    files
}

/// A driver file in words.
fn state(file: &Path) -> String {
    let shown = file.display();
    match std::fs::metadata(file) {
        Err(error) => return format!("{shown} can not be read ({error})"),
        Ok(found) if !found.is_file() => return format!("{shown} is no file"),
        Ok(_) => {}
    }
    let text = match std::fs::read_to_string(file) {
        Ok(text) => text,
        Err(error) => return format!("{shown} can not be read ({error})"),
    };
    let json: serde_json::Value = match serde_json::from_str(&text) {
        Ok(json) => json,
        Err(error) => return format!("{shown} is not JSON ({error})"),
    };
    let Some(library) = json["ICD"]["library_path"].as_str() else {
        return format!("{shown} names no library (ICD.library_path)");
    };
    // A name without a folder is searched by the dynamic linker, which this can not ask without loading the driver.
    let beside = file.parent().unwrap_or(Path::new("")).join(library);
    if library.contains('/') && !beside.exists() {
        return format!("{shown} names the library {library}, which does not exist");
    }
    format!("{shown} with the library {library}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_driver_file_says_what_is_wrong_with_it() {
        let folder = tempfile::tempdir().unwrap();
        let of = |text: &str| {
            let file = folder.path().join("driver.json");
            std::fs::write(&file, text).unwrap();
            state(&file)
        };
        assert!(of("{").contains("is not JSON"));
        assert!(of("{}").contains("names no library"));
        assert!(of(r#"{"ICD":{"library_path":"./absent.so"}}"#).contains("absent.so, which does not exist"));
        assert!(of(r#"{"ICD":{"library_path":"./driver.json"}}"#).ends_with("with the library ./driver.json"));
        assert!(of(r#"{"ICD":{"library_path":"libvulkan_lvp.so"}}"#).ends_with("with the library libvulkan_lvp.so"));
        assert!(state(Path::new("/nonexistent")).contains("can not be read"));
        assert!(state(folder.path()).ends_with("is no file"));
    }
}
