//! glibc's heap: its settings for lists of pixels, which come and go with each image, and for a driver that renders on the CPU, and what it gives back.

/// Freed bytes that the heap keeps.
const KEPT: i32 = 256 << 20;
/// Size from which a block gets its own mapping [bytes]. It is the largest value that glibc accepts.
const MAPPED_APART: i32 = 32 << 20;
/// Least growth of the heap [bytes].
const STEP: i32 = 16 << 20;

/// Lets the heap keep memory that is freed. The lists of an image are then pages that the process has already. lavapipe allocates and frees blocks of about 100 kB for every few
/// hundred triangles. By default glibc returns each to the kernel, which costs a quarter of a step with a million
/// triangles.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
pub(super) fn keep_freed_memory() {
    // SAFETY: mallopt accepts any numbers at any time, and only changes when memory returns to the kernel.
    unsafe {
        libc::mallopt(libc::M_MMAP_THRESHOLD, MAPPED_APART);
        libc::mallopt(libc::M_TRIM_THRESHOLD, KEPT);
        libc::mallopt(libc::M_TOP_PAD, STEP);
    }
}

/// Does nothing: other C libraries have no such settings.
#[cfg(not(all(target_os = "linux", target_env = "gnu")))]
pub(super) fn keep_freed_memory() {}

/// Gives freed memory back to the system, after work that needed much more than what follows.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
pub(crate) fn give_back_freed_memory() {
    // SAFETY: malloc_trim may be called at any time, and only returns memory that nobody uses.
    unsafe { libc::malloc_trim(0) };
}

/// Does nothing: other C libraries have no such call.
#[cfg(not(all(target_os = "linux", target_env = "gnu")))]
pub(crate) fn give_back_freed_memory() {}
