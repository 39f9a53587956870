//! Devices that come and go beside other threads, and when objects have names.

use std::process::Command;
use std::sync::atomic::{AtomicBool, Ordering};

use gpu_allocator::MemoryLocation;

use super::*;
use crate::gpu::instance::layer_takes_settings;
use crate::gpu::memory::Buffer;

fn named() -> Arc<Context> {
    let mut context = Context::unproven(None, false).expect("a Vulkan device");
    let loader = lock_loader();
    context.give_names();
    drop(loader);
    Arc::new(context)
}

/// Without the lock of `instance.rs` the loader of Debian 13 ends the process here.
#[test]
fn devices_come_and_go_while_other_threads_name_objects() {
    let is_over = AtomicBool::new(false);
    let name_until_the_end = || {
        let context = named();
        let mut count = 0;
        while !is_over.load(Ordering::Relaxed) {
            let usage = vk::BufferUsageFlags::STORAGE_BUFFER;
            Buffer::new(&context, "named", 16, usage, MemoryLocation::GpuOnly).expect("a small buffer");
            count += 1;
        }
        count
    };
    std::thread::scope(|scope| {
        let namers = [(); 2].map(|()| scope.spawn(name_until_the_end));
        let makers = [(); 2].map(|()| {
            scope.spawn(|| {
                for _ in 0..10 {
                    drop(named());
                    devices().expect("devices");
                }
            })
        });
        for maker in makers {
            maker.join().expect("devices come and go");
        }
        is_over.store(true, Ordering::Relaxed);
        for namer in namers {
            assert!(namer.join().expect("objects are named") > 0);
        }
    });
}

/// The test starts itself anew with the validation layer in the place of a debugger: a tool that isotherm did not ask for.
/// Layers that take settings tell that they watch. Version 1.3.239 does not.
#[test]
fn objects_are_named_only_where_something_reads_the_names() {
    const OF_TOOLS: &str = "VK_INSTANCE_LAYERS";
    let has_names = |validate| Context::open(None, validate).map(|context| context.labels.is_some());
    if std::env::var_os(OF_TOOLS).is_some() {
        // SAFETY: loading the Vulkan loader runs its initialisers, as in any Vulkan program.
        let entry = unsafe { ash::Entry::load() }.expect("a Vulkan loader");
        let tells = layer_takes_settings(&entry).expect("the validation layer");
        assert_eq!(has_names(false).expect("a Vulkan device"), tells);
        return;
    }
    assert!(!has_names(false).expect("a Vulkan device"));
    match has_names(true) {
        Err(GpuError::NoValidationLayer) => println!("skipped: the Vulkan validation layer is not installed"),
        has_names => {
            assert!(has_names.expect("a validated device"));
            let name = std::thread::current().name().expect("the name of the test").to_owned();
            let mut child = Command::new(std::env::current_exe().expect("the path of the tests"));
            child.args(["--exact", &name]).env(OF_TOOLS, "VK_LAYER_KHRONOS_validation");
            let output = child.output().expect("the tests start");
            let text = String::from_utf8_lossy(&output.stdout);
            assert!(output.status.success() && text.contains("1 passed"), "{text}");
        }
    }
}
