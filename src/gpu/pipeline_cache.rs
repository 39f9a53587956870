//! Pipelines that the driver has compiled, kept in the user's cache folder from run to run (`$XDG_CACHE_HOME/isotherm`, or `~/.cache/isotherm`).
//!
//! A file belongs to one device and one driver, which the header of Vulkan names (VkPipelineCacheHeaderVersionOne). It begins with the SHA-256 of the rest, so a
//! damaged file never reaches the driver. A file that cannot be read or written costs time and nothing else.

use std::env;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use ash::vk;
use sha2::{Digest as _, Sha256};

/// Bytes of the digest before the data.
const DIGEST: usize = 32;
/// Bytes of Vulkan's header: its length, its version, vendor and device (u32 each), and the UUID of the driver.
const HEADER: usize = 32;
/// Most bytes that are kept. A driver whose data grow beyond begins anew.
const MOST: usize = 64 << 20;

/// The pipelines of a device.
pub(super) struct PipelineCache {
    /// Null where the driver makes none.
    pub(super) raw: vk::PipelineCache,
    /// Vulkan's header of this device and driver.
    header: [u8; HEADER],
    /// Where the pipelines are kept. `None` for nowhere.
    path: Option<PathBuf>,
    /// Digest of what was read.
    read: Option<[u8; DIGEST]>,
}

impl PipelineCache {
    /// The pipelines that earlier runs kept in a folder for a device.
    pub(super) fn open(
        device: &ash::Device,
        properties: &vk::PhysicalDeviceProperties,
        folder: Option<PathBuf>,
    ) -> Self {
        let header = header_of(properties);
        let path = folder.map(|folder| folder.join(file_name(&header)));
        let kept = path.as_deref().and_then(|path| read(path, &header));
        let create = vk::PipelineCacheCreateInfo::default().initial_data(kept.as_deref().unwrap_or_default());
        // SAFETY: the device is alive, and the data are whole and of this device and driver.
        let raw = unsafe { device.create_pipeline_cache(&create, None) }.unwrap_or_default();
        Self { raw, header, path, read: kept.map(|data| digest(&data)) }
    }

    /// Keeps the pipelines, and frees what holds them.
    ///
    /// # Safety
    /// The device is that of `open`, is alive, and makes no pipeline.
    pub(super) unsafe fn close(&mut self, device: &ash::Device) {
        if let Some(path) = self.path.as_ref().filter(|_| self.raw != vk::PipelineCache::null()) {
            // SAFETY: the caller answers for the device, and the cache was made by it.
            let data = unsafe { device.get_pipeline_cache_data(self.raw) }.unwrap_or_default();
            // Some drivers keep nothing, and give the header alone.
            if data.len() > HEADER
                && data.len() <= MOST
                && data.starts_with(&self.header)
                && self.read != Some(digest(&data))
            {
                // A folder that cannot be written is no error.
                let _ = write(path, &data);
            }
        }
        // SAFETY: as above. A null handle may be destroyed.
        unsafe { device.destroy_pipeline_cache(self.raw, None) };
    }
}

/// The folder of isotherm in the user's cache folder.
pub(super) fn user_folder() -> Option<PathBuf> {
    let absolute = |name: &str| env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
    let cache = absolute("XDG_CACHE_HOME").or_else(|| Some(absolute("HOME")?.join(".cache")))?;
    Some(cache.join("isotherm"))
}

fn header_of(properties: &vk::PhysicalDeviceProperties) -> [u8; HEADER] {
    let version = vk::PipelineCacheHeaderVersion::ONE.as_raw() as u32;
    let mut header = [0; HEADER];
    let numbers = [HEADER as u32, version, properties.vendor_id, properties.device_id];
    header[..16].copy_from_slice(&numbers.map(u32::to_le_bytes).concat());
    header[16..].copy_from_slice(&properties.pipeline_cache_uuid);
    header
}

/// A name for each device and driver.
fn file_name(header: &[u8; HEADER]) -> String {
    let name: String = digest(header)[..8].iter().map(|byte| format!("{byte:02x}")).collect();
    format!("pipelines_{name}")
}

fn digest(data: &[u8]) -> [u8; DIGEST] {
    Sha256::digest(data).into()
}

/// The data of a file that is whole and has the header.
fn read(path: &Path, header: &[u8; HEADER]) -> Option<Vec<u8>> {
    let length = std::fs::metadata(path).ok().filter(std::fs::Metadata::is_file)?.len();
    if length > (DIGEST + MOST) as u64 {
        return None;
    }
    let mut data = std::fs::read(path).ok()?;
    let stated: Vec<u8> = data.drain(..DIGEST.min(data.len())).collect();
    (stated == digest(&data) && data.starts_with(header)).then_some(data)
}

/// Writes the file. It appears whole or not at all.
fn write(path: &Path, data: &[u8]) -> std::io::Result<()> {
    let folder = path.parent().unwrap_or(Path::new(""));
    std::fs::create_dir_all(folder)?;
    let mut file = tempfile::NamedTempFile::new_in(folder)?;
    file.write_all(&digest(data))?;
    file.write_all(data)?;
    file.persist(path)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const OF_DEVICE: [u8; HEADER] = [7; HEADER];

    #[test]
    fn only_a_whole_file_of_the_device_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("isotherm").join(file_name(&OF_DEVICE));
        assert_eq!(read(&path, &OF_DEVICE), None, "there is no file");
        let data = [&OF_DEVICE[..], b"pipelines"].concat();
        write(&path, &data).unwrap();
        assert_eq!(read(&path, &OF_DEVICE), Some(data));
        assert_eq!(read(&path, &[8; HEADER]), None, "another driver");
        let whole = std::fs::read(&path).unwrap();
        for place in 0..whole.len() {
            let mut damaged = whole.clone();
            damaged[place] ^= 1;
            std::fs::write(&path, damaged).unwrap();
            assert_eq!(read(&path, &OF_DEVICE), None, "byte {place}");
            std::fs::write(&path, &whole[..place]).unwrap();
            assert_eq!(read(&path, &OF_DEVICE), None, "{place} bytes");
        }
    }

    #[test]
    fn a_folder_that_cannot_be_written_is_no_panic() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("file");
        std::fs::write(&file, "text").unwrap();
        assert!(write(&file.join("pipelines"), &OF_DEVICE).is_err());
    }
}
