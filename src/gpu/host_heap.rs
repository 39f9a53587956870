//! How the C library's heap serves a driver that rasterises on the processor.

/// Freed bytes that an arena of the heap keeps.
const KEPT: i32 = 256 << 20;
/// Bytes from which a block is mapped apart and given back as soon as it is freed: the most that glibc allows.
const MAPPED_APART: i32 = 32 << 20;
/// Bytes by which an arena grows and shrinks at least.
const STEP: i32 = 16 << 20;

/// Lets the heap keep what a software driver frees. lavapipe takes and frees blocks of some 100 kB for every few hundred
/// triangles, and glibc would hand each to the kernel and fault it in anew: a quarter of a step with an image of a million triangles.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
pub(super) fn keep_freed_memory() {
    // SAFETY: mallopt takes any numbers, at any time, and changes when memory is returned to the kernel, never what is in it.
    unsafe {
        libc::mallopt(libc::M_MMAP_THRESHOLD, MAPPED_APART);
        libc::mallopt(libc::M_TRIM_THRESHOLD, KEPT);
        libc::mallopt(libc::M_TOP_PAD, STEP);
    }
}

/// Other C libraries have no such settings.
#[cfg(not(all(target_os = "linux", target_env = "gnu")))]
pub(super) fn keep_freed_memory() {}
