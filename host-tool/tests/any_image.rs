//! Tests of `flexor chip` with small images, made here byte by byte, with symbols.

use crate::program::{FLEXOR, ProgramOutput, flexor_command, run_flexor, test_folder, write_file};
use serde_json::Value;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::time::{Duration, Instant};

/// Address of the code, after sixteen vectors.
const CODE: u32 = 0x0800_0040;

/// Builds an ELF with `main`, half-words of Thumb code, and `HardFault_Handler` (`b .`) after it.
fn elf(main: &[u16]) -> Vec<u8> {
    let handler = CODE + 2 * main.len() as u32;
    let mut flash = Vec::new();
    for word in [0x2001_0000, CODE + 1, handler + 1, handler + 1]
        .into_iter()
        .chain([0; 12])
    {
        flash.extend(u32::to_le_bytes(word));
    }
    let code = main.iter().chain(&[0xE7FE]);
    flash.extend(code.flat_map(|half| half.to_le_bytes()));
    let names = b"\0main\0HardFault_Handler\0.symtab\0.strtab\0";
    let mut symbols = vec![0; 16];
    for (name, address, size) in [(1, CODE, handler - CODE), (6, handler, 2)] {
        for word in [name, address + 1, size] {
            symbols.extend(u32::to_le_bytes(word));
        }
        symbols.extend([0x12, 0, 0xF1, 0xFF]); // a function, absolute instead of in a section
    }
    let [flash_at, symbols_at] = [84, 84 + flash.len() as u32];
    let names_at = symbols_at + symbols.len() as u32;
    let sections_at = names_at + names.len() as u32;
    let mut file = b"\x7fELF\x01\x01\x01\0\0\0\0\0\0\0\0\0\x02\0\x28\0".to_vec();
    let size = flash.len() as u32;
    let mut words = vec![1, CODE + 1, 52, sections_at, 0x0500_0000];
    words.extend([52 | 32 << 16, 1 | 40 << 16, 3 | 2 << 16]); // half-words of the header
    words.extend([1, flash_at, 0x0800_0000, 0x0800_0000, size, size, 5, 4]);
    file.extend(words.into_iter().flat_map(u32::to_le_bytes));
    file.extend([&flash[..], &symbols, names].concat());
    let symtab = [24, 2, 0, 0, symbols_at, symbols.len() as u32, 2, 1, 4, 16];
    let strtab = [32, 3, 0, 0, names_at, names.len() as u32, 0, 0, 1, 0];
    let sections = [[0; 10], symtab, strtab].concat();
    file.extend(sections.into_iter().flat_map(u32::to_le_bytes));
    file
}

/// Encodes MOVW and MOVT, which load `value` into R`d`.
fn set(d: u16, value: u32) -> [u16; 4] {
    let half = |opcode: u16, value: u32| {
        let imm = value as u16;
        let first = opcode | (imm >> 11 & 1) << 10 | imm >> 12;
        [first, (imm >> 8 & 7) << 12 | d << 8 | imm & 0xFF]
    };
    let [low, high] = [half(0xF240, value & 0xFFFF), half(0xF2C0, value >> 16)];
    [low[0], low[1], high[0], high[1]]
}

/// Encodes a write of `value` to `address`: str r1,[r0].
fn store_word(address: u32, value: u32) -> Vec<u16> {
    [&set(0, address)[..], &set(1, value), &[0x6001]].concat()
}

const GPIOA: u32 = 0x4002_0000;

/// Encodes a loop that toggles PA5 for ever through the bit-band alias of its ODR bit.
fn blink() -> Vec<u16> {
    let odr_bit = 0x4200_0000 + 0x2_0014 * 32 + 5 * 4;
    [
        &store_word(0x4002_3830, 1)[..],
        &[0x6801], // ldr r1,[r0]: the clock is on now
        &store_word(GPIOA, 0xA800_0400),
        &set(0, odr_bit),
        &set(3, 2_000),
        // again: movs r1,#1; str; mov r2,r3; subs r2,#1; bne; movs r1,#0; str; mov r2,r3; subs
        // r2,#1; bne; b again
        &[0x2101, 0x6001, 0x461A, 0x3A01, 0xD1FD],
        &[0x2100, 0x6001, 0x461A, 0x3A01, 0xD1FD, 0xE7F4],
    ]
    .concat()
}

/// Encodes a program that sends "hi" on USART2 and exits by semihosting with this status.
fn greet(status: u32) -> Vec<u16> {
    const BLOCK: u32 = 0x2000_0100;
    [
        store_word(0x4002_3840, 1 << 17),
        store_word(0x4000_4408, 16),
        store_word(0x4000_440C, 0x2008),
        store_word(0x4000_4404, b'h'.into()),
        store_word(0x4000_4404, b'i'.into()),
        set(0, 0x4000_4400).to_vec(),
        vec![0x6801, 0x0649, 0xD5FC], // ldr r1,[r0]; lsls r1,#25 (TC); bpl
        store_word(BLOCK, u32::from_le_bytes(*b"ok\n\0")),
        set(1, BLOCK).to_vec(),
        vec![0x2004, 0xBEAB],
        store_word(BLOCK, 0x2_0026),
        store_word(BLOCK + 4, status),
        set(1, BLOCK).to_vec(),
        vec![0x2020, 0xBEAB],
    ]
    .concat()
}

/// Creates a folder with `image.elf`, made from `main`.
fn folder_with_image(test: &str, main: &[u16]) -> PathBuf {
    let folder = test_folder(&format!("any_image/{test}"));
    write_file(&folder, "image.elf", elf(main));
    folder
}

fn json((exit, out, error): ProgramOutput) -> (Option<i32>, Value) {
    let value = serde_json::from_str(&out).unwrap_or_else(|why| panic!("{why}: {out}{error}"));
    (exit, value)
}

/// Reads all edges of `pin` from a dump, and the end of the dump, ns.
fn edges(dump: &Path, pin: &str) -> (Vec<u64>, u64) {
    let text = std::fs::read(dump).unwrap();
    let mut parser = vcd::Parser::new(text.as_slice());
    let header = parser.parse_header().unwrap();
    let code = header.find_var(&["chip", pin]).unwrap().code;
    let (mut now, mut found) = (0, Vec::new());
    for command in parser {
        match command.unwrap() {
            vcd::Command::Timestamp(ns) => now = ns,
            vcd::Command::ChangeScalar(id, _) if id == code && now > 0 => found.push(now),
            _ => {}
        }
    }
    (found, now)
}

#[test]
fn pins_are_dumped_and_counted_for_as_long_as_was_asked() {
    let folder = folder_with_image("pins", &blink());
    let command = [
        "--json",
        "chip",
        "image.elf",
        "--for",
        "20ms",
        "--vcd",
        "pins.vcd",
    ];
    let (exit, report) = json(run_flexor(&folder, &command));
    assert_eq!(
        (exit, &report["ended"]),
        (Some(0), &"time".into()),
        "{report}"
    );
    let seconds = report["seconds"].as_f64().unwrap();
    assert!((0.02..0.0203).contains(&seconds), "{seconds}");
    assert_eq!(report["cycles"], (seconds * 16e6).round() as u64, "HSI");
    let (found, end) = edges(&folder.join("pins.vcd"), "PA5");
    assert_eq!(report["pin_edges"]["PA5"], found.len());
    assert!(found.len() > 20, "{found:?}");
    assert_eq!(end, (seconds * 1e9).round() as u64);
    // Two thousand turns of a loop, all of the same length.
    let gaps: Vec<u64> = found.windows(2).map(|pair| pair[1] - pair[0]).collect();
    assert!(
        gaps.iter().all(|gap| gap.abs_diff(gaps[0]) < 1_000),
        "{gaps:?}"
    );
    assert_eq!(
        report["function"].as_str().unwrap().split(' ').next(),
        Some("main")
    );

    // The text output agrees, and an existing file is not replaced.
    let (exit, out, _) = run_flexor(&folder, &["chip", "image.elf", "--for", "20ms"]);
    assert_eq!(exit, Some(0));
    assert!(
        out.contains(&format!("pin PA5: {} edges", found.len())),
        "{out}"
    );
    let (exit, _, error) = run_flexor(&folder, &command[1..]);
    assert_eq!(exit, Some(1));
    assert!(error.contains("E587"), "{error}");
    let replaced = [&command[1..], &["--overwrite"]].concat();
    assert_eq!(run_flexor(&folder, &replaced).0, Some(0));
    let itself = ["chip", "image.elf", "--vcd", "image.elf", "--overwrite"];
    assert!(run_flexor(&folder, &itself).2.contains("E586"));
}

#[test]
fn a_program_s_own_end_is_the_command_s() {
    let folder = folder_with_image("exit", &greet(0));
    let (exit, out, _) = run_flexor(&folder, &["chip", "image.elf", "--uart"]);
    assert_eq!(exit, Some(0));
    assert!(
        out.starts_with("hiok\n") || out.starts_with("ok\nhi"),
        "{out}"
    );
    assert!(out.contains("with status 0"), "{out}");
    let (_, out, _) = run_flexor(&folder, &["chip", "image.elf"]);
    assert!(out.starts_with("ok\n"), "not asked for: {out}");
    let (exit, report) = json(run_flexor(
        &folder,
        &["--json", "chip", "image.elf", "--uart"],
    ));
    assert_eq!(exit, Some(0));
    assert_eq!([&report["uart"], &report["console"]], ["hi", "ok\n"]);

    let folder = folder_with_image("exit_3", &greet(3));
    let (exit, report) = json(run_flexor(&folder, &["--json", "chip", "image.elf"]));
    assert_eq!((exit, &report["status"]), (Some(1), &3.into()));
    let error = report["error"].as_str().unwrap();
    assert!(error.starts_with("E569 image.elf"), "{error}");
}

#[test]
fn faults_and_lock_ups_are_named_with_registers_and_function() {
    let folder = folder_with_image(
        "fault",
        &[&set(3, 7)[..], &set(0, 0x4002_5000), &[0x6801]].concat(),
    );
    let (exit, out, error) = run_flexor(&folder, &["chip", "image.elf", "--for", "10s"]);
    assert_eq!(exit, Some(1));
    for part in [
        "E559 image.elf",
        "HardFault: a bus error at a data access at 0x40025000",
        "main + 0x10",
    ] {
        assert!(error.contains(part), "{error}");
    }
    for part in ["r3 0x00000007", "cfsr 0x00008200", "pc 0x08000050"] {
        assert!(out.contains(part), "{out}");
    }
    // A fault in the fault handler: the vector of hard faults points to no code.
    let mut file = elf(&[0xDE00]);
    file[84 + 12..84 + 16].fill(0);
    write_file(&folder, "lock.elf", file);
    let (exit, report) = json(run_flexor(&folder, &["--json", "chip", "lock.elf"]));
    assert_eq!((exit, &report["ended"]), (Some(1), &"stopped".into()));
    let error = report["error"].as_str().unwrap();
    for part in [
        "E558 lock.elf",
        "locked up",
        "an undefined instruction",
        "main + 0x0",
    ] {
        assert!(error.contains(part), "{error}");
    }
}

#[test]
fn what_is_not_modelled_is_named_with_register_and_function() {
    let code = [
        store_word(0x4002_3840, 1 << 19),
        store_word(0x4000_4C08, 0x16D),
    ]
    .concat();
    let folder = folder_with_image("refused", &code);
    let (exit, report) = json(run_flexor(&folder, &["--json", "chip", "image.elf"]));
    assert_eq!(exit, Some(1));
    let error = report["error"].as_str().unwrap();
    for part in [
        "E558",
        "UART4_BRR",
        "0x40004c08",
        "written with 0x0000016d",
        "(in main + 0x22)",
    ] {
        assert!(error.contains(part), "{error}");
    }
}

#[test]
fn a_core_that_sleeps_for_ever_is_no_failure_and_is_told() {
    let folder = folder_with_image("asleep", &[0xBF30, 0xE7FD]);
    let (exit, report) = json(run_flexor(
        &folder,
        &["--json", "chip", "image.elf", "--for", "60s"],
    ));
    assert_eq!((exit, &report["sleeps_for_good"]), (Some(0), &true.into()));
    assert_eq!(report["instructions"], 1);
}

#[test]
fn nonsense_is_refused_before_anything_runs() {
    let folder = folder_with_image("nonsense", &blink());
    for (time, why) in [
        ("5", "unit"),
        ("0s", "1us"),
        ("2h", "unit"),
        ("4000s", "3600s"),
    ] {
        let (exit, _, error) = run_flexor(&folder, &["chip", "image.elf", "--for", time]);
        assert_eq!(exit, Some(2), "{error}");
        assert!(error.contains("E518") && error.contains(why), "{error}");
    }
    let (exit, _, error) = run_flexor(&folder, &["chip", "image.elf", "--usb=tcp:0.0.0.0:0"]);
    assert_eq!(exit, Some(2), "{error}");
    assert!(error.contains("of this computer"), "{error}");
    write_file(
        &folder,
        "notes.elf",
        "no ELF, but a text that is longer than its header",
    );
    let (exit, _, error) = run_flexor(&folder, &["chip", "notes.elf"]);
    assert_eq!(exit, Some(1));
    assert!(error.contains("E531 notes.elf"), "{error}");
    let (exit, _, error) = run_flexor(&folder, &["chip", "nowhere.elf"]);
    assert!(exit == Some(1) && error.contains("E530"), "{error}");
}

#[test]
fn the_usb_port_is_offered_at_a_socket() {
    let folder = folder_with_image("usb", &blink());
    let mut command = flexor_command(
        &folder,
        &["--json", "chip", "image.elf", "--usb", "--for", "2s"],
    );
    let mut running = command.stdout(Stdio::piped()).spawn().unwrap();
    let mut lines = BufReader::new(running.stdout.take().unwrap()).lines();
    let place: Value = serde_json::from_str(&lines.next().unwrap().unwrap()).unwrap();
    let place = place["usb_at"]
        .as_str()
        .unwrap()
        .strip_prefix("tcp:")
        .unwrap();
    let _client = std::net::TcpStream::connect(place).unwrap();
    let report: Value = serde_json::from_str(&lines.next().unwrap().unwrap()).unwrap();
    assert_eq!(report["usb"], "no serial port appeared");
    assert_eq!(report["ended"], "time");
    assert!(running.wait().unwrap().success());
}

/// Ctrl-C ends the run in order: the dump is complete and states its length, the summary is
/// printed.
#[cfg(unix)]
#[test]
fn a_signal_ends_it_with_a_dump_that_is_whole() {
    let folder = folder_with_image("signal", &blink());
    let arguments = ["chip", "image.elf", "--for", "3600s", "--vcd", "pins.vcd"];
    let mut command = flexor_command(&folder, &arguments);
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    let running = command.spawn().unwrap();
    let dump = folder.join("pins.vcd");
    let begin = Instant::now();
    while std::fs::metadata(&dump).map_or(0, |metadata| metadata.len()) < 50_000 {
        assert!(begin.elapsed() < Duration::from_secs(300), "no dump grows");
        std::thread::sleep(Duration::from_millis(10));
    }
    let number = running.id().to_string();
    let sent = std::process::Command::new("kill")
        .args(["-INT", &number])
        .status();
    assert!(sent.unwrap().success());
    let output = running.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130));
    let error = String::from_utf8(output.stderr).unwrap();
    assert!(error.contains("E580 SIGINT"), "{error}");
    let out = String::from_utf8(output.stdout).unwrap();
    assert!(out.contains("ended: by a signal"), "{out}");
    let (found, end) = edges(&dump, "PA5");
    let last = *found.last().unwrap();
    assert!(end >= last && end - last < 10_000_000, "{last} {end}");
    let line = format!("pin PA5: {} edges", found.len());
    assert!(out.contains(&line), "{line}: {out}");
}

/// Every command that docs/how/chip.md shows works as described.
#[test]
fn the_commands_of_the_document_run() {
    let folder = folder_with_image("document", &greet(0));
    std::fs::rename(folder.join("image.elf"), folder.join("blink.elf")).unwrap();
    let document = include_str!("../../docs/how/chip.md");
    let shown: Vec<&str> = document
        .lines()
        .filter_map(|line| line.strip_prefix("    flexor chip "))
        .map(|line| line.split(" #").next().unwrap_or(line).trim())
        .collect();
    assert!(shown.len() >= 4, "{shown:?}");
    for line in shown {
        let arguments: Vec<&str> = ["chip"]
            .into_iter()
            .chain(line.split_whitespace())
            .collect();
        let (exit, _, error) = run_flexor(&folder, &arguments);
        assert_eq!(exit, Some(0), "{FLEXOR} {line}: {error}");
    }
    assert!(folder.join("pins.vcd").is_file());
}
