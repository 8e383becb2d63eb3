//! Tests of the commands around a board that one can buy: list, pins, image, flash, analyser.

use super::program::{run_flexor, test_folder};
use serde_json::Value;
use std::fs;
use std::path::Path;

fn succeed(folder: &Path, arguments: &str) -> String {
    let arguments: Vec<&str> = arguments.split(' ').collect();
    let (exit, output, error) = run_flexor(folder, &arguments);
    assert_eq!(exit, Some(0), "{arguments:?}: {error}");
    for line in output.lines().filter(|_| !arguments.contains(&"--json")) {
        let is_long = arguments.contains(&"udev") || line.starts_with("capture ");
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
    assert_eq!(succeed(&folder, "board list").lines().count(), 6);
    let text = succeed(&folder, "board show feather --svg feather.svg");
    assert!(text.contains("breadboard: LEDs and analyser only, no output stage"));
    let svg = fs::read_to_string(folder.join("feather.svg")).unwrap();
    assert!(is_whole(&svg), "{svg}");
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
        assert!(text.contains("written and verified"), "{text}");
        let other = fail(
            &folder,
            &format!("flash --board feather --simulated --file {file}"),
        );
        assert!(other.contains("E804"), "{other}");
    }
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
    assert!(text.starts_with("verdict: passed (simulated"), "{text}");
    let sheet = fs::read_to_string(folder.join("sheet.json")).unwrap();
    let sheet: Value = serde_json::from_str(&sheet).unwrap();
    assert_eq!(
        (&sheet["kind"], &sheet["verdict"]),
        (&"simulated".into(), &"passed".into())
    );
    assert_eq!(sheet["lines"].as_array().unwrap().len(), 10);
    // The rehearsal begins 2 ms before a pulse: the first one, or a later one.
    for capture in sheet["captures"].as_array().unwrap() {
        let number = |key: &str| capture[key].as_f64().unwrap();
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
        short.contains("E822") && short.contains("Incomplete"),
        "{short}"
    );
    let exchanged = fail(&folder, &format!("{judge} {second} {first}"));
    assert!(exchanged.contains("E822"), "{exchanged}");
    assert!(fail(&folder, &format!("{judge} {first}")).contains("--plan"));
    assert!(fail(&folder, &format!("{judge} {first} sheet.json")).contains("E821"));
}
