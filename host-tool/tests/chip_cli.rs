//! Tests of the messages about images that cannot be flashed, and about options in the wrong place:
//! one line, a number, exit code 1 or 2.

use crate::program::{TRIGGER, flexor_command, run_flexor, test_folder, write_file};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::Stdio;

/// Builds an ELF for `machine` without sections: header, one program header, `segment` at `address`
/// of the flash.
fn elf(machine: u16, address: u32, segment: &[u8]) -> Vec<u8> {
    let mut file = b"\x7fELF\x01\x01\x01\0\0\0\0\0\0\0\0\0\x02\0".to_vec();
    file.extend(machine.to_le_bytes());
    // Version, entry (Thumb), offset of the program headers, no sections, EABI 5.
    for word in [1, 0x0800_0041, 52, 0, 0x0500_0000u32] {
        file.extend(word.to_le_bytes());
    }
    for half in [52u16, 32, 1, 40, 0, 0] {
        file.extend(half.to_le_bytes());
    }
    let size = segment.len() as u32;
    for word in [1, 84, address, address, size, size, 5, 4] {
        file.extend(word.to_le_bytes());
    }
    file.extend(segment);
    file
}

/// Returns a vector table and an endless loop.
fn code() -> Vec<u8> {
    let mut words = [0u32; 17];
    (words[0], words[1]) = (0x2000_4000, 0x0800_0041);
    words[16] = 0xE7FE_E7FE; // B .
    words.iter().flat_map(|word| word.to_le_bytes()).collect()
}

const ARM: u16 = 40;

fn image(name: &str, bytes: &[u8]) -> PathBuf {
    write_file(&test_folder(&format!("images/{name}")), name, bytes)
}

/// Returns the one line on standard error, without `error: `.
#[track_caller]
fn expect_error(arguments: &[&str], image: &Path, exit: i32) -> String {
    let arguments = [arguments, &["--image", image.to_str().unwrap()]].concat();
    let (code, _, text) = run_flexor(Path::new("."), &arguments);
    assert_eq!(code, Some(exit), "{text}");
    let errors = text.lines().filter(|line| !line.starts_with("note: "));
    let errors: Vec<_> = errors.collect();
    assert_eq!(errors.len(), 1, "{text}");
    errors[0].strip_prefix("error: ").unwrap().to_owned()
}

const RUN: [&str; 4] = ["run", TRIGGER, "--device", "chip"];

/// Checks the start of `error`, and that it contains all parts.
#[track_caller]
fn assert_error(error: &str, number: &str, parts: &[&str]) {
    assert!(error.starts_with(number), "{error}");
    assert!(parts.iter().all(|part| error.contains(part)), "{error}");
}

#[test]
#[rustfmt::skip]
fn an_image_that_cannot_be_flashed_is_named_with_the_reason() {
    let mut even = code();
    even[4] = 0x40;
    let flash = 0x0800_0000;
    let rows = [
        ("text.elf", b"#!/bin/sh\nexit 0 # no ELF".to_vec(), "E531", "magic"),
        ("cut.elf", elf(ARM, flash, &code())[..100].to_vec(), "E531", "end of the file"),
        ("riscv.elf", elf(243, flash, &code()), "E532", "machine number is 243"),
        ("even.elf", elf(ARM, flash, &even), "E533", "even"),
        ("ram.elf", elf(ARM, 0x2000_0000, &code()), "E534", "0x20000000"),
        ("big.elf", elf(ARM, flash, &vec![0; (1 << 20) + 4]), "E534", "1048580 bytes"),
    ];
    let serve = ["serve", "--device", "chip", "--tcp", "127.0.0.1:0"];
    for (name, bytes, number, reason) in rows {
        let path = image(name, &bytes);
        for command in [&RUN[..], &["profile", TRIGGER], &serve] {
            assert_error(&expect_error(command, &path, 1), number, &[name, reason]);
        }
    }
    let error = expect_error(&RUN, Path::new("nowhere.elf"), 1);
    assert_error(&error, "E530", &["nowhere.elf"]);
}

#[test]
fn logs_without_a_table_are_refused_before_anything_runs() {
    let path = image("silent.elf", &elf(ARM, 0x0800_0000, &code()));
    let error = expect_error(&[&RUN[..], &["--log", "-"]].concat(), &path, 1);
    assert_error(&error, "E535", &["silent.elf"]);
}

#[test]
fn a_log_that_is_there_stays() {
    let path = image("logging.elf", &elf(ARM, 0x0800_0000, &code()));
    let log = path.with_file_name("kept.log");
    std::fs::write(&log, "kept").unwrap();
    let words = [&RUN[..], &["--log", log.to_str().unwrap()]].concat();
    assert_error(&expect_error(&words, &path, 1), "E587", &["kept.log"]);
    assert_eq!(std::fs::read_to_string(&log).unwrap(), "kept");
}

#[test]
fn an_image_that_never_opens_its_port_is_told_after_its_time() {
    let path = image("idle.elf", &elf(ARM, 0x0800_0000, &code()));
    let error = expect_error(&RUN, &path, 1);
    assert_error(&error, "E541", &["3 s"]);
}

/// A launcher tests whether the debugger's server is open before it connects.
#[test]
fn a_debugger_s_port_is_served_until_the_program_ends() {
    let path = image("debugged.elf", &elf(ARM, 0x0800_0000, &code()));
    let path = path.to_str().unwrap();
    let words = [
        "serve",
        "--device",
        "chip",
        "--tcp",
        "127.0.0.1:0",
        "--gdb",
        "0",
    ];
    let mut serve = flexor_command(Path::new("."), &[&words[..], &["--image", path]].concat());
    let mut serve = serve.stderr(Stdio::piped()).spawn().unwrap();
    let mut line = String::new();
    let stderr = serve.stderr.take().unwrap();
    BufReader::new(stderr).read_line(&mut line).unwrap();
    let (_, at) = line.split_once("gdb: target remote ").unwrap();
    let connect = || TcpStream::connect(at.trim()).unwrap();
    drop(connect()); // tests whether the port is open
    for _ in 0..3 {
        let mut gdb = connect();
        gdb.write_all(b"$?#3f").unwrap();
        let mut answer = [0; 17];
        gdb.read_exact(&mut answer).unwrap();
        assert_eq!(&answer, b"+$T05thread:1;#d7");
        gdb.write_all(b"+$k#6b").unwrap();
    }
    assert!(serve.try_wait().unwrap().is_none(), "it serves on");
    serve.kill().unwrap();
    serve.wait().unwrap();
}

#[test]
fn options_of_the_chip_need_the_chip() {
    let path = image("fine.elf", &elf(ARM, 0x0800_0000, &code()));
    let readings = ["selftest", "--prefetched", "not-cached"];
    for command in [&["run", TRIGGER][..], &readings] {
        assert_error(&expect_error(command, &path, 2), "E518", &["--device chip"]);
    }
}
