//! Vulkan: everything that runs on the device, and the only room with unsafe code.
