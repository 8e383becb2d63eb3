//! The `bench` image gives the same results, bit by bit, on the host, as Thumb code in QEMU and on
//! the simulated chip. QEMU's cycle counter reads 0.

use firmware::bench::{NoClock, Row, run};
use firmware::device::MuscleTables;
use hal_sim::chip::alone::{self, FlashWait};
use hal_sim::chip::image;
use hal_sim::images::{self, Image};
use std::path::Path;
use std::process::{Command, Stdio};

/// First line of the image's output.
const HEADING: &str = "name runs checksum min mean max";

fn workspace() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap()
}

/// Returns the rows of the host build.
fn native() -> Vec<String> {
    let mut rows = Vec::new();
    let mut tables = Box::new(MuscleTables::NONE);
    run(&NoClock, &mut tables, |row: &Row| {
        rows.push(row.to_string())
    });
    assert!(rows.len() >= 20, "{} algorithms", rows.len());
    rows
}

/// Returns the image's output in QEMU's model of the chip, without its heading.
fn in_qemu(elf: &Path) -> Vec<String> {
    let output = Command::new("qemu-system-arm")
        .args(["-machine", "netduinoplus2"])
        .args(["-nographic", "-monitor", "none"])
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
    assert_eq!(lines.next().as_deref(), Some(HEADING));
    lines.collect()
}

/// Returns the output of the image at `elf` on the simulated chip.
fn on_chip(elf: &Path, wait: FlashWait) -> Vec<String> {
    let image = image::Image::open(elf).unwrap();
    let ended = alone::run(&image, wait).unwrap_or_else(|e| panic!("{e}"));
    let (instructions, cycles) = (ended.instructions, ended.cycles);
    println!("{wait:?}: {instructions} instructions, {cycles} cycles");
    ended.console.lines().map(str::to_owned).collect()
}

/// Returns each line's name, runs and checksum.
fn results(lines: &[String]) -> Vec<Vec<&str>> {
    let parts = lines.iter().map(|line| line.split(' ').take(3).collect());
    parts.collect()
}

#[test]
fn host_and_chip_agree_on_every_result() {
    let elf = Image::Bench.build(workspace()).unwrap();
    let host = native();
    for wait in FlashWait::ALL {
        let lines = on_chip(&elf, wait);
        for line in &lines {
            println!("{line}");
        }
        assert_eq!(lines[0], HEADING);
        assert_eq!(results(&lines[1..]), results(&host));
    }
}

#[test]
fn host_and_qemu_agree_on_every_result() {
    let elf = Image::Bench.build(workspace()).unwrap();
    assert_eq!(in_qemu(&elf), native());
}

/// No parameter is fitted to this result. Published for this core, with other compilers: 3.40
/// (Arm), 3.37 on the STM32F405 at 168 MHz (ST).
#[test]
fn coremark_gives_its_known_results() {
    let elf = images::coremark(workspace()).unwrap();
    for wait in FlashWait::ALL {
        let lines = on_chip(&elf, wait);
        for line in &lines {
            println!("{line}");
        }
        assert!(lines[0].ends_with("crcfinal bb53 valid"), "{lines:?}");
        assert!(lines[2].starts_with("CoreMark/MHz "), "{lines:?}");
        assert!(lines[3].ends_with("crcfinal bb53 valid"), "{lines:?}");
    }
}
