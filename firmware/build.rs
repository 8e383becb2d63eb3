//! Hands the images, and nothing else, their linker scripts and `memory.x`.

use std::env::{var, var_os};

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-changed=../memory.x");
    if var("CARGO_CFG_TARGET_OS").as_deref() != Ok("none") {
        return;
    }
    let package = var("CARGO_MANIFEST_DIR").unwrap_or_default();
    println!("cargo:rustc-link-search={package}/..");
    // No page alignment between segments: flash is not paged.
    println!("cargo:rustc-link-arg-bins=--nmagic");
    println!("cargo:rustc-link-arg-bins=-Tlink.x");
    // Strings last: among them the paths of sources, whose length depends on
    // where cargo keeps them. Tables before them, and so cycles, do not.
    println!("cargo:rustc-link-arg-bins=--sort-section=alignment");
    if var_os("CARGO_FEATURE_STM32F405").is_some() {
        println!("cargo:rustc-link-arg-bins=-Tdefmt.x");
    }
}
