//! Tests with gdb itself (Debian's `gdb-multiarch`) at the port: commands of a user, and gdb's
//! output.

use super::*;
use crate::chip::image::tests::file;
use std::path::PathBuf;
use std::process::Command;

/// The system's gdb, and the image file that it reads.
struct Client {
    file: PathBuf,
}

impl Client {
    /// Writes the image of [`TOUCHES`] to a file for this test only.
    fn new(test: &str) -> Self {
        let name = format!("flexor-gdb-{test}-{}.elf", std::process::id());
        let path = std::env::temp_dir().join(name);
        std::fs::write(&path, file(&TOUCHES, &[("Reset", CODE, 20)])).unwrap();
        Self { file: path }
    }

    /// Returns the text that gdb prints while it carries out `commands` at `port`.
    fn prints(&self, port: SocketAddr, commands: &[&str]) -> String {
        let mut gdb = Command::new("gdb-multiarch");
        gdb.args(["--batch", "-nx", "-ex", "set pagination off"]);
        gdb.args(["-ex", "set remotetimeout 60"]).arg(&self.file);
        for command in commands {
            gdb.args(["-ex", &command.replace("PORT", &port.to_string())]);
        }
        let output = gdb.output().expect("gdb-multiarch, which the system has");
        let text = [output.stdout, output.stderr].concat();
        String::from_utf8_lossy(&text).into_owned()
    }
}

impl Drop for Client {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.file);
    }
}

/// Checks that `text` contains all of `parts`, in this order.
#[track_caller]
fn says(text: &str, parts: &[&str]) {
    let mut rest = text;
    for part in parts {
        let Some((_, after)) = rest.split_once(part) else {
            panic!("{part:?} is missing in what is left:\n{rest}\nof\n{text}");
        };
        rest = after;
    }
}

#[test]
fn gdb_loads_steps_breaks_and_comes_again() {
    let served = ServedBoard::for_ever(&LOOP);
    let client = Client::new("loads");
    // The flash contains LOOP until TOUCHES is loaded.
    let text = client.prints(
        served.at,
        &[
            "target extended-remote PORT",
            "monitor reset halt",
            "compare-sections",
            "load",
            "compare-sections",
            "monitor reset halt",
            "p/x $pc",
            "info mem",
            "break *0x08000044",
            "continue",
            "p/x $r0",
            "stepi",
            "p $r1",
            "info registers msp psp primask basepri faultmask control",
            "set $msp = 0x20001000",
            "maintenance flush register-cache",
            "p/x $sp",
            "set $psp = 0x20001800",
            "set $basepri = 0x40",
            "set $primask = 1",
            "set $faultmask = 1",
            "set $control = 2",
            "maintenance flush register-cache",
            "p/x $sp",
            "p/x $primask + $faultmask + $basepri",
            "set $s3 = 1.5",
            "p $d1",
            "p $s3",
            "x/wx 0xE0042000",
            "x/hx 0x1FFF7A22",
            "set {unsigned short} 0x40023844 = 1",
            "set {unsigned short} 0x40010034 = 0x1234",
            "x/hx 0x40010034",
            "set {unsigned char} 0x20000101 = 0xAB",
            "x/wx 0x20000100",
            "monitor frobnicate",
            "monitor swo enable",
            "detach",
        ],
    );
    says(
        &text,
        &[
            "MIS-MATCHED!",
            "Loading section .text",
            "matched.",
            "= 0x8000040",
        ],
    );
    says(&text, &["0x08000000", "flash blocksize 0x4000"]);
    says(
        &text,
        &["Breakpoint 1, 0x08000044 in Reset", "= 0x20000000", "= 1"],
    );
    says(&text, &["msp            0x20004000", "control        0x0"]);
    says(&text, &["= 0x20001000", "= 0x20001800", "= 0x42", "= 1.5"]);
    says(&text, &["0xe0042000:\t0x10076413", "0x1fff7a22:\t0x0400"]);
    says(&text, &["0x40010034:\t0x1234", "0x20000100:\t0x0000ab00"]);
    says(&text, &["unknown command: frobnicate", "no trace port"]);
    says(&text, &["detached"]);
    // The core runs meanwhile, and the next client halts it where it is.
    let text = client.prints(
        served.at,
        &["target remote PORT", "p/x $r0", "p $r1 > 1", "kill"],
    );
    says(&text, &["Reset", "= 0x20000000", "= 1", "killed"]);
    let text = client.prints(
        served.at,
        &["target remote PORT", "p/x $pc", "p/x $r0", "disconnect"],
    );
    says(&text, &["= 0x8000040", "= 0x0"]);
}

#[test]
fn gdb_watches_data_and_is_told_what_is_too_much() {
    let served = ServedBoard::for_ever(&TOUCHES);
    let client = Client::new("watches");
    let text = client.prints(
        served.at,
        &[
            "target remote PORT",
            "watch *(unsigned int *) 0x20000000",
            "continue",
            "continue",
            "delete",
            "rwatch *(unsigned short *) 0x20000004",
            "continue",
            "delete",
            "awatch *(unsigned char *) 0x20000009",
            "continue",
            "watch *(unsigned char *) 0x20000010",
            "watch *(unsigned char *) 0x20000011",
            "watch *(unsigned char *) 0x20000012",
            "watch *(unsigned char *) 0x20000013",
            "continue",
        ],
    );
    says(
        &text,
        &[
            "Hardware watchpoint 1: *(unsigned int *) 0x20000000",
            "Old value = 0",
            "New value = 1",
            "Old value = 1",
            "New value = 2",
            "Hardware read watchpoint 2: *(unsigned short *) 0x20000004",
            "Value = 0",
            "Hardware access (read/write) watchpoint 3",
            "Could not insert hardware watchpoint 7",
        ],
    );
}

#[test]
fn a_second_gdb_is_told_who_has_the_core() {
    let served = ServedBoard::for_ever(&LOOP);
    let mut first = served.connect();
    assert_eq!(first.exchange("?"), HALTED);
    let text = Client::new("second").prints(served.at, &["target remote PORT"]);
    let own = first.stream.local_addr().unwrap().to_string();
    says(
        &text,
        &[
            &own,
            "already debugs this chip; only one debugger can attach",
        ],
    );
    first.exchanges(&[("s", HALTED)]);
}
