//! Errors of the GPU code, each with advice for the user.

use ash::vk;

use crate::host::OverBudget;
use crate::thermal::misfit::Misfit;

/// A failure of Vulkan or of the device.
#[derive(Debug, thiserror::Error)]
pub enum GpuError {
    /// The memory of the host does not suffice.
    #[error(transparent)]
    Memory(#[from] OverBudget),
    /// A saved state of another scene or device.
    #[error("the saved state does not fit: {0}")]
    Saved(#[from] Misfit),
    /// The Vulkan loader (libvulkan) is not installed, or can not be opened.
    #[error(
        "no Vulkan loader can be opened ({0}); install one with `apt-get install libvulkan1 mesa-vulkan-drivers` (`LD_DEBUG=libs \
         isotherm info` shows where it is searched for), or run the f64 reference, which needs no Vulkan, with `--device cpu`"
    )]
    NoLoader(String),
    /// The loader finds no driver, or none that works.
    #[error("the Vulkan loader has no driver that works: {found}; {}", advice())]
    NoDriver {
        /// The drivers, in words.
        found: String,
    },
    /// The drivers find no device.
    #[error("no Vulkan device: no driver finds a device that it can drive ({found}); {}", advice())]
    NoDevice {
        /// The drivers, in words.
        found: String,
    },
    /// `--device` matches no device.
    #[error("no device matches '{wanted}'; there are: {present}")]
    UnknownDevice {
        /// Value of `--device`.
        wanted: String,
        /// Names of the available devices.
        present: String,
    },
    /// The device lacks a feature that every scene needs.
    #[error("{device}: {lacks}; isotherm needs Vulkan 1.3 with dynamic rendering and synchronization2")]
    Unsuitable {
        /// Device name.
        device: String,
        /// Missing features.
        lacks: String,
    },
    /// Validation is requested, and its layer is not installed.
    #[error("validation was asked for, but the layer is not installed: `apt-get install vulkan-validationlayers`")]
    NoValidationLayer,
    /// The validation layer does not see a missing barrier, so its silence means nothing.
    #[error(
        "validation was asked for, but the layer says nothing about a barrier that is left out on purpose, so its silence means nothing; \
         a layer setting, such as VK_LAYER_MESSAGE_ID_FILTER or a vk_layer_settings.txt, may mute it, or its version is one that isotherm does not know"
    )]
    MuteValidationLayer,
    /// Joints have moved so that surfaces see more of each other than the buffers hold.
    #[error(
        "exchange: the joints have moved so that {entries} pairs of patches see each other, and there is room for {room}; state a larger patch_edge"
    )]
    ExchangeGrew {
        /// Pairs of patches.
        entries: usize,
        /// Room for pairs.
        room: usize,
    },
    /// A buffer is longer than the device can bind.
    #[error(
        "buffer '{buffer}' needs {bytes} bytes, and {device} binds at most {limit} bytes at once; \
         take a larger max_edge so that the scene has fewer nodes, or a smaller image or fewer samples"
    )]
    BufferTooLong {
        /// Name of the buffer.
        buffer: String,
        /// Size [bytes].
        bytes: u64,
        /// Device name.
        device: String,
        /// `maxStorageBufferRange` [bytes].
        limit: u64,
    },
    /// The host writes a buffer that has another owner.
    #[error("buffer '{buffer}' cannot be written, because it is still in use")]
    SharedBuffer {
        /// Name of the buffer.
        buffer: String,
    },
    /// The scene does not fit into device memory.
    #[error(
        "the scene needs {needed} bytes of device memory, {images} of them for images, and {device} has {available} free; \
         take a larger max_edge or a smaller image"
    )]
    OutOfMemory {
        /// Sum over all buffers and images [bytes].
        needed: u64,
        /// Part of `needed` that depends on the image size [bytes].
        images: u64,
        /// Device name.
        device: String,
        /// Free device memory, or free host memory on a CPU device [bytes].
        available: u64,
    },
    /// The image is larger than the device can draw.
    #[error(
        "an image of {width} x {height} is too large for {device}, which draws at most {limit} pixels a side; with \
         camera.samples or camera.distortion it is a multiple of the camera's: take fewer samples or a smaller image"
    )]
    ImageTooLarge {
        /// Width in pixels.
        width: u32,
        /// Height in pixels.
        height: u32,
        /// Device name.
        device: String,
        /// Largest width or height [px].
        limit: u32,
    },
    /// Allocation of device memory failed.
    #[error("allocating '{name}': {source}")]
    Allocation {
        /// Name of the buffer or image.
        name: String,
        /// Reason from the allocator.
        source: gpu_allocator::AllocationError,
    },
    /// A shader does not compile.
    #[error("compiling a shader: {0}")]
    Compile(#[from] super::compile::CompileError),
    /// A Vulkan call failed.
    #[error("{call}: {result}")]
    Call {
        /// Purpose of the call.
        call: &'static str,
        /// Result code of Vulkan.
        result: vk::Result,
    },
}

/// Converts a Vulkan result to a [`GpuError`].
pub(crate) trait During<T> {
    /// Adds the name of the call to the error.
    fn during(self, call: &'static str) -> Result<T, GpuError>;
}

impl<T> During<T> for Result<T, vk::Result> {
    fn during(self, call: &'static str) -> Result<T, GpuError> {
        self.map_err(|result| GpuError::Call { call, result })
    }
}

/// What helps where a driver is missing or broken.
fn advice() -> &'static str {
    "`VK_LOADER_DEBUG=all isotherm info` shows what the loader tries, VK_DRIVER_FILES names other driver files; install a driver \
     (`apt-get install mesa-vulkan-drivers` brings lavapipe, which needs no GPU), or run the f64 reference, which needs no \
     Vulkan, with `--device cpu`"
}
