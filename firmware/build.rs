//! Lets the linker find the workspace's `memory.x`, for images only.

use std::env::var;

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-changed=../memory.x");
    if var("CARGO_CFG_TARGET_OS").as_deref() == Ok("none") {
        let package = var("CARGO_MANIFEST_DIR").unwrap_or_default();
        println!("cargo:rustc-link-search={package}/..");
        // No page alignment between segments: flash is not paged.
        println!("cargo:rustc-link-arg-bins=--nmagic");
    }
}
