//! The `bench` image gives the same results, bit by bit, on the host, as Thumb
//! code in QEMU and on the simulated core. QEMU's cycle counter reads 0; the
//! core runs here from memory without wait states, so its cycles are a bound.

mod chip_bench {
    pub mod desk;
}

use chip_bench::desk::on_core;
use firmware::bench::{NoClock, Row, run};
use hal_sim::images::Image;
use std::path::Path;
use std::process::{Command, Stdio};

/// Rows of the host build.
fn native() -> Vec<Row> {
    let mut rows = Vec::new();
    run(&NoClock, |row| rows.push(*row));
    rows
}

/// What the image prints in QEMU's model of the chip, without its heading.
fn in_qemu(elf: &Path) -> Vec<String> {
    let output = Command::new("qemu-system-arm")
        .args([
            "-machine",
            "netduinoplus2",
            "-nographic",
            "-monitor",
            "none",
        ])
        .args(["-semihosting-config", "enable=on,target=native"])
        .arg("-kernel")
        .arg(elf)
        .stdin(Stdio::null())
        .output()
        .expect("qemu-system-arm must be installed");
    let words = String::from_utf8_lossy(&output.stdout).into_owned();
    let complaints = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{words}{complaints}");
    let mut lines = words.lines().map(str::to_owned);
    let heading = lines.next();
    assert_eq!(heading.as_deref(), Some("name runs checksum min mean max"));
    lines.collect()
}

/// A line's name, runs and checksum.
fn results(line: &str) -> Vec<&str> {
    line.split(' ').take(3).collect()
}

#[test]
fn host_and_core_agree_on_every_result() {
    let workspace = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let elf = Image::Bench.build(workspace).unwrap();
    let lines = on_core(&elf);
    for line in &lines {
        println!("{line}");
    }
    let lines = &lines[1..];
    let host: Vec<_> = native().iter().map(Row::to_string).collect();
    let core: Vec<_> = lines.iter().map(|line| results(line)).collect();
    assert_eq!(
        core,
        host.iter().map(|line| results(line)).collect::<Vec<_>>()
    );
}

/// Nothing is fitted to this. Published for this core, with other compilers:
/// 3.40 (Arm), 3.37 on the STM32F405 at 168 MHz (ST).
#[test]
fn coremark_gives_its_known_results() {
    let workspace = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let folder = workspace.join("tests/coremark");
    let built = Command::new("sh")
        .arg(folder.join("build"))
        .status()
        .unwrap();
    assert!(built.success());
    let lines = on_core(&folder.join("target/thumbv7em-none-eabihf/release/coremark"));
    for line in &lines {
        println!("without wait states: {line}");
    }
    assert!(lines[0].ends_with("crcfinal bb53 valid"), "{lines:?}");
    assert!(lines[2].starts_with("CoreMark/MHz "), "{lines:?}");
}

#[test]
fn host_and_qemu_agree_on_every_result() {
    let workspace = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let elf = Image::Bench.build(workspace).unwrap();
    let host = native();
    assert!(host.len() >= 20, "{} algorithms", host.len());
    let host: Vec<_> = host.iter().map(Row::to_string).collect();
    for line in &host {
        println!("{line}");
    }
    assert_eq!(in_qemu(&elf), host);
}
