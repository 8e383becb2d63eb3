//! Tests of the commands around a board that one can buy: list, pins, image, flash, analyser.

use super::program::{run_flexor, test_folder};
use serde_json::Value;
use std::fs;
use std::path::Path;

const BREADBOARD: &str = "breadboard: LEDs and analyser only, no output stage";

fn succeed(folder: &Path, arguments: &str) -> String {
    let arguments: Vec<&str> = arguments.split(' ').collect();
    let (exit, output, error) = run_flexor(folder, &arguments);
    assert_eq!(exit, Some(0), "{arguments:?}: {error}");
    for line in output.lines().filter(|_| !arguments.contains(&"--json")) {
        let is_long = arguments.contains(&"udev");
        assert!(
            is_long || line.chars().count() <= 80 || line.contains('/'),
            "{line}"
        );
    }
    output
}

fn fail(folder: &Path, arguments: &str) -> String {
    let arguments: Vec<&str> = arguments.split(' ').collect();
    let (exit, _, error) = run_flexor(folder, &arguments);
    assert_ne!(exit, Some(0), "{arguments:?}");
    error
}

#[test]
fn boards_their_pins_and_their_rules_are_shown() {
    let folder = test_folder("board_cli");
    let list = succeed(&folder, "board list");
    assert_eq!(list.matches(BREADBOARD).count(), 2, "{list}");
    let text = succeed(&folder, "board show feather --svg feather.svg");
    let svg = fs::read_to_string(folder.join("feather.svg")).unwrap();
    assert!(is_whole(&svg), "{svg}");
    for words in [BREADBOARD, "anode (long leg)", "3V3", "GND"] {
        assert!(text.contains(words) && svg.contains(words), "{words}");
    }
    assert!(text.contains("pin B0 (BOOT0)"), "{text}");
    let weact = succeed(&folder, "board show weact");
    assert!(weact.contains("hold button B0"), "{weact}");
    // The reference board has stages, and inputs that a breadboard leaves open.
    let text = succeed(&folder, "board show reference --svg reference.svg");
    let svg = fs::read_to_string(folder.join("reference.svg")).unwrap();
    for shown in [text, svg] {
        assert!(!shown.contains("LED") && !shown.contains("breadboard:"));
        for pin in ["PA4", "PA6", "PA7", "PA8", "PB10", "PA1", "PC0"] {
            assert!(shown.contains(pin), "{pin}: {shown}");
        }
    }
    assert!(succeed(&folder, "board udev").contains("0483"));
    succeed(&folder, "devices");
    let shown: Value = serde_json::from_str(&succeed(&folder, "--json board show weact")).unwrap();
    assert_eq!(shown["pins"].as_array().unwrap().len(), 28);
    assert!(fail(&folder, "board show nucleo").contains("weact"));
}

/// Returns whether every element of an SVG is closed.
fn is_whole(svg: &str) -> bool {
    svg.matches("<text").count() == svg.matches("</text>").count() && svg.contains("</svg>")
}

#[test]
fn an_image_is_written_into_files_and_read_back() {
    let folder = test_folder("image_cli");
    for (option, file) in [("--bin", "w.bin"), ("--hex", "w.hex"), ("--dfu", "w.dfu")] {
        succeed(&folder, &format!("image --board weact {option} {file}"));
        let text = succeed(
            &folder,
            &format!("flash --board weact --simulated --file {file}"),
        );
        assert!(
            text.contains("verified in a simulated boot loader"),
            "{text}"
        );
        assert!(!text.contains("nothing was written"), "{text}");
        let other = fail(
            &folder,
            &format!("flash --board feather --simulated --file {file}"),
        );
        assert!(other.contains("E804"), "{other}");
    }
    succeed(&folder, "image --board weact --bin b.bin --hex b.hex");
    assert_eq!(
        fs::read(folder.join("b.bin")).unwrap(),
        fs::read(folder.join("w.bin")).unwrap()
    );
    assert!(folder.join("b.hex").is_file());
    let twice = fail(&folder, "image --board weact --bin c.bin --hex c.bin");
    assert!(
        twice.contains("two formats") && !folder.join("c.bin").exists(),
        "{twice}"
    );
    // A file for a virtual serial port of ST, with a right checksum.
    let mut serial = fs::read(folder.join("w.dfu")).unwrap();
    let end = serial.len();
    serial[end - 14..end - 12].copy_from_slice(&0x5740_u16.to_le_bytes());
    let crc = dfu::container::dfu_crc(&serial[..end - 4]);
    serial[end - 4..].copy_from_slice(&crc.to_le_bytes());
    fs::write(folder.join("serial.dfu"), serial).unwrap();
    // One bit in the middle: a wrong checksum. Cut, empty, or of another program: refused too.
    let mut bytes = fs::read(folder.join("w.bin")).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 4;
    fs::write(folder.join("bit.bin"), &bytes).unwrap();
    fs::write(folder.join("cut.bin"), &bytes[..middle]).unwrap();
    fs::write(folder.join("empty.bin"), b"").unwrap();
    fs::write(folder.join("text.bin"), vec![b'x'; 4_096]).unwrap();
    // Bytes that the checksum does not cover, of another image or erased.
    for (file, byte) in [("behind.bin", 0xA5), ("erased.bin", 0xFF)] {
        let mut longer = fs::read(folder.join("w.bin")).unwrap();
        longer.extend([byte; 4]);
        fs::write(folder.join(file), longer).unwrap();
    }
    let hex = fs::read_to_string(folder.join("w.hex")).unwrap();
    // Four bytes at 0x0808_0000.
    let far = ":020000040808EA\n:0400000001020304F2\n:00000001FF";
    let far = hex.replacen(":00000001FF", far, 1);
    assert_ne!(hex, far);
    fs::write(folder.join("behind.hex"), far).unwrap();
    // Another origin: 0x0801_0000.
    let moved = hex.replacen(":020000040800F2", ":020000040801F1", 1);
    assert_ne!(hex, moved);
    fs::write(folder.join("moved.hex"), moved).unwrap();
    for file in [
        "bit.bin",
        "behind.bin",
        "behind.hex",
        "erased.bin",
        "cut.bin",
        "empty.bin",
        "text.bin",
        "moved.hex",
        "none.bin",
        "serial.dfu",
    ] {
        let error = fail(
            &folder,
            &format!("flash --board weact --simulated --file {file}"),
        );
        assert!(error.contains("E803"), "{file}: {error}");
    }
}

#[test]
fn captures_of_the_chips_pins_pass_and_exchanged_ones_do_not() {
    let folder = test_folder("hil_cli");
    let plan = succeed(&folder, "hil five_channels --board feather --plan");
    assert_eq!(plan.matches("sync").count(), 2, "{plan}");
    succeed(
        &folder,
        "hil five_channels --board feather --seconds 0.3 --rehearse captures",
    );
    let files = ["captures/capture-1.sr", "captures/capture-2.sr"];
    let [first, second] = files;
    let judge = "hil five_channels --board feather --seconds 0.3";
    let text = succeed(
        &folder,
        &format!("{judge} {first} {second} --sheet sheet.json"),
    );
    assert!(
        text.starts_with("verdict: passed\nsimulated captures"),
        "{text}"
    );
    assert!(text.contains(BREADBOARD), "{text}");
    let sheet = fs::read_to_string(folder.join("sheet.json")).unwrap();
    let sheet: Value = serde_json::from_str(&sheet).unwrap();
    assert_eq!(
        (&sheet["kind"], &sheet["verdict"]),
        (&"simulated".into(), &"passed".into())
    );
    assert_eq!(sheet["lines"].as_array().unwrap().len(), 10);
    assert_eq!(sheet["session"]["file"], "five_channels");
    assert_eq!(
        (&sheet["seconds"], &sheet["common_line"]),
        (&0.3.into(), &"sync".into())
    );
    assert!(sheet["program"]["version"].is_string(), "{sheet}");
    let hash = |value: &Value| value["sha256"].as_str().map_or(0, str::len);
    assert_eq!(hash(&sheet["session"]), 64);
    // The rehearsal begins 2 ms before a pulse: the first one, or a later one.
    for capture in sheet["captures"].as_array().unwrap() {
        let number = |key: &str| capture[key].as_f64().unwrap();
        assert_eq!(hash(capture), 64, "{capture}");
        assert!(
            capture["file"].as_str().unwrap().ends_with(".sr"),
            "{capture}"
        );
        assert!((number("start_us") + 2_000.0).abs() < 0.2, "{capture}");
        assert!((number("from_us") - 0.0).abs() < 0.2, "{capture}");
        assert!((number("until_us") - 299_000.0).abs() < 50.0, "{capture}");
        assert_eq!(capture["alignment"]["kind"], "repeated");
        assert_eq!(capture["alignment"]["period_us"], 20_000);
    }
    assert!(text.contains("-2.0 to 299.0 ms, or a multiple of 20.0 ms later"));
    // Shorter than asked for, but without any fault.
    let longer = judge.replace("0.3", "0.5");
    let short = fail(&folder, &format!("{longer} {first} {second}"));
    assert!(
        short.contains("E822 the comparison is incomplete"),
        "{short}"
    );
    let exchanged = fail(&folder, &format!("{judge} {second} {first}"));
    assert!(exchanged.contains("E822"), "{exchanged}");
    assert!(fail(&folder, &format!("{judge} {first}")).contains("--plan"));
    assert!(fail(&folder, &format!("{judge} {first} sheet.json")).contains("E821"));
}

/// The image measures the crystal at boot, and keeps the failure where a debug probe finds it.
#[test]
fn an_image_for_another_board_is_explained_and_logged() {
    let folder = test_folder("wrong_image");
    let built: Value =
        serde_json::from_str(&succeed(&folder, "--json image --board weact")).unwrap();
    let image = built["source"].as_str().unwrap();
    let words =
        format!("run five_channels --device chip --board feather --image {image} --log log");
    let error = fail(&folder, &words);
    for words in [
        "E541",
        "the crystal has 12.00 MHz",
        "for a board with 8.00 MHz",
    ] {
        assert!(error.contains(words), "{words}: {error}");
    }
    let log = fs::read_to_string(folder.join("log")).unwrap();
    assert!(log.lines().count() > 0 && log.contains("crystal"), "{log}");
}

#[test]
fn commands_that_run_a_breadboard_say_what_it_is() {
    let folder = test_folder("breadboard_words");
    let chip = "--device chip --board feather";
    for command in [
        &format!("run five_channels {chip} --out o"),
        &format!("serve {chip} --tcp 127.0.0.1:0 --seconds 0.1"),
        "hil five_channels --board feather --plan",
    ] {
        let text = succeed(&folder, command);
        assert!(text.contains(BREADBOARD), "{command}: {text}");
    }
    let page = fs::read_to_string(folder.join("o/report.html")).unwrap();
    assert!(page.contains(BREADBOARD));
    let auto = fail(&folder, "serve --device auto --tcp 127.0.0.1:0");
    assert!(auto.contains("E515 auto cannot be served"), "{auto}");
}
