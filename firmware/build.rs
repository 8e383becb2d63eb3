//! Hands the images, and nothing else, their linker scripts and `memory.x`.
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
    // A path that does not exist would make Cargo rebuild the package at every call.
    println!("cargo:rerun-if-changed={}", root.join("memory.x").display());
    if var("CARGO_CFG_TARGET_OS").as_deref() != Ok("none") {
        return;
    }
    println!("cargo:rustc-link-search={}", root.display());
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
