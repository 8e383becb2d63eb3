//! The `bench` image gives the same results, bit by bit, on the host and as
//! Thumb code in QEMU. QEMU's cycle counter reads 0: nothing here is timing.

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
