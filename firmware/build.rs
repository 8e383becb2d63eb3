//! Passes linker scripts and `memory.x` to the images, and only to them.
//!
//! `host-tool/methods` builds its images with this script too.

use std::env::{var, var_os};
use std::path::PathBuf;

fn main() {
    let package = PathBuf::from(var("CARGO_MANIFEST_DIR").unwrap_or_default());
    let root = package
        .ancestors()
        .find(|folder| folder.join("memory.x").is_file())
        .expect("memory.x lies in the workspace's root");
    // Cargo would rebuild the package at every call if this path did not exist.
    println!("cargo:rerun-if-changed={}", root.join("memory.x").display());
    if var("CARGO_CFG_TARGET_OS").as_deref() != Ok("none") {
        return;
    }
    println!("cargo:rustc-link-search={}", root.display());
    // Flash has no pages, so segments need no page alignment.
    println!("cargo:rustc-link-arg-bins=--nmagic");
    println!("cargo:rustc-link-arg-bins=-Tlink.x");
    // Puts strings last. Some of them are source paths, whose length depends on where cargo keeps
    // the sources; the tables before them, and so the cycle counts, stay in place.
    println!("cargo:rustc-link-arg-bins=--sort-section=alignment");
    // In the benchmark and in QEMU a whole device with its muscles' tables is on the stack, and no
    // pulse tape is in SRAM2: the stack begins at the end of SRAM2, which follows SRAM1 (RM0090
    // section 2.3).
    for (feature, image) in [("BENCH", "bench"), ("QEMU", "qemu")] {
        let is_built = var_os(format!("CARGO_FEATURE_{feature}")).is_some();
        if is_built && var("CARGO_PKG_NAME").as_deref() == Ok("firmware") {
            println!("cargo:rustc-link-arg-bin={image}=--defsym=_stack_start=0x20020000");
        }
    }
    if var_os("CARGO_FEATURE_STM32F405").is_some() {
        println!("cargo:rustc-link-arg-bins=-Tdefmt.x");
    }
}
