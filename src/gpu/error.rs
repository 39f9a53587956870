//! What can go wrong on the device, with what to do about it.

use ash::vk;

/// A failure of Vulkan or of the device.
#[derive(Debug, thiserror::Error)]
pub enum GpuError {
    /// libvulkan is not installed.
    #[error(
        "no Vulkan loader found ({0}); install one with `apt-get install libvulkan1 mesa-vulkan-drivers`, \
         or run the f64 reference with `--device cpu`"
    )]
    NoLoader(String),
    /// The loader finds no driver.
    #[error(
        "no Vulkan device found; install a driver (`apt-get install mesa-vulkan-drivers` brings lavapipe, which needs \
         no GPU), or run the f64 reference with `--device cpu`"
    )]
    NoDevice,
    /// `--device` names none of the devices.
    #[error("no device matches '{wanted}'; there are: {present}")]
    UnknownDevice {
        /// What was asked for.
        wanted: String,
        /// Names of what there is.
        present: String,
    },
    /// The device lacks something that every scene needs.
    #[error("{device}: {lacks}; isotherm needs Vulkan 1.3 with dynamic rendering and synchronization2")]
    Unsuitable {
        /// Device name.
        device: String,
        /// What is missing.
        lacks: String,
    },
    /// Validation was asked for and its layer is not installed.
    #[error("validation was asked for, but the layer is not installed: `apt-get install vulkan-validationlayers`")]
    NoValidationLayer,
    /// A buffer is longer than a shader may see.
    #[error(
        "buffer '{buffer}' needs {bytes} bytes, and {device} binds at most {limit} bytes at once; \
         take a larger max_edge so that the scene has fewer nodes"
    )]
    BufferTooLong {
        /// Name of the buffer.
        buffer: String,
        /// Its size.
        bytes: u64,
        /// Device name.
        device: String,
        /// `maxStorageBufferRange`.
        limit: u64,
    },
    /// The host writes what somebody else holds too.
    #[error("buffer '{buffer}' cannot be written: something else still holds it")]
    SharedBuffer {
        /// Name of the buffer.
        buffer: String,
    },
    /// The scene does not fit.
    #[error(
        "the scene needs {needed} bytes of device memory, {images} of them for images, and {device} has {available} free; \
         take a larger max_edge or a smaller image"
    )]
    OutOfMemory {
        /// Sum over all buffers and images.
        needed: u64,
        /// Of these, what the size of the image decides.
        images: u64,
        /// Device name.
        device: String,
        /// What is free of its largest heap; where it shares the memory of the host, what is free there.
        available: u64,
    },
    /// The image is larger than the device draws.
    #[error("an image of {width} x {height} is more than {device} draws ({limit} pixels a side)")]
    ImageTooLarge {
        /// Width in pixels.
        width: u32,
        /// Height in pixels.
        height: u32,
        /// Device name.
        device: String,
        /// Limit a side.
        limit: u32,
    },
    /// The device does not integrate the network.
    #[error("the device does not integrate this network: {reason}; the f64 twin may, with `--device cpu`")]
    UnsupportedNetwork {
        /// Why.
        reason: String,
    },
    /// Device memory could not be had.
    #[error("allocating '{name}': {source}")]
    Allocation {
        /// Buffer or image.
        name: String,
        /// The allocator's reason.
        source: gpu_allocator::AllocationError,
    },
    /// A shader does not compile.
    #[error("compiling a shader: {0}")]
    Compile(#[from] super::compile::CompileError),
    /// A Vulkan call failed.
    #[error("{call}: {result}")]
    Call {
        /// What was attempted.
        call: &'static str,
        /// Vulkan's answer.
        result: vk::Result,
    },
}

/// Names the call in the error of a Vulkan result.
pub(crate) trait During<T> {
    /// Converts the error, with what was attempted.
    fn during(self, call: &'static str) -> Result<T, GpuError>;
}

impl<T> During<T> for Result<T, vk::Result> {
    fn during(self, call: &'static str) -> Result<T, GpuError> {
        self.map_err(|result| GpuError::Call { call, result })
    }
}
