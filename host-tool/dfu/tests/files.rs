//! Firmware files: round trips, facts of the formats, hostile input and other tools.

use dfu::container::{
    ContainerError, DfuseIds, Segment, dfu_crc, read, read_dfuse, read_hex, write_dfuse, write_hex,
};
use hal_sim::random::Sequence;
use std::path::PathBuf;
use std::process::Command;

fn segments() -> Vec<Segment> {
    let mut random = Sequence::new(7);
    let mut bytes = |length| (0..length).map(|_| random.byte()).collect::<Vec<_>>();
    vec![
        Segment {
            address: 0x0800_0000,
            bytes: bytes(1001),
        },
        Segment {
            address: 0x0800_FFF8,
            bytes: bytes(40),
        },
        Segment {
            address: 0x0802_0000,
            bytes: bytes(70_000),
        },
    ]
}

/// Returns DFUImageSize in the prefix.
fn size_field(file: &[u8]) -> usize {
    u32::from_le_bytes(file[6..10].try_into().unwrap()) as usize
}

/// Returns the file with the checksum of its contents.
fn with_checksum(mut file: Vec<u8>) -> Vec<u8> {
    let body = file.len() - 4;
    let crc = dfu_crc(&file[..body]);
    file[body..].copy_from_slice(&crc.to_le_bytes());
    file
}

fn file(name: &str, contents: &[u8]) -> PathBuf {
    let path = std::env::temp_dir().join(format!("dfu-{}-{name}", std::process::id()));
    std::fs::write(&path, contents).unwrap();
    path
}

/// Output of a tool; `None`, with a note, if it is not installed.
fn tool(name: &str, arguments: &[&str]) -> Option<String> {
    match Command::new(name).args(arguments).output() {
        Ok(output) => {
            let text = [output.stdout, output.stderr].concat();
            Some(String::from_utf8_lossy(&text).into_owned())
        }
        Err(_) => {
            println!("{name} is not installed; this check was skipped");
            None
        }
    }
}

#[test]
fn the_checksum_is_crc_32_without_final_inversion() {
    // CRC-32 of "123456789" is 0xCBF43926.
    assert_eq!(dfu_crc(b"123456789"), !0xCBF4_3926);
    assert_eq!(dfu_crc(b""), 0xFFFF_FFFF);
}

#[test]
fn dfuse_round_trip_and_layout() {
    let ids = DfuseIds {
        device: 0x2200,
        ..DfuseIds::default()
    };
    let bytes = write_dfuse(&segments(), "flexor", ids).unwrap();
    let data: usize = segments()
        .iter()
        .map(|segment| segment.bytes.len() + 8)
        .sum();
    assert_eq!(bytes.len(), 11 + 274 + data + 16);
    assert_eq!(&bytes[..6], b"DfuSe\x01");
    assert_eq!(size_field(&bytes), bytes.len() - 16, "without the suffix");
    // Some programs include the suffix.
    let mut longer = bytes.clone();
    let length = u32::try_from(bytes.len()).unwrap();
    longer[6..10].copy_from_slice(&length.to_le_bytes());
    assert_eq!(read(&with_checksum(longer.clone()), 0).unwrap(), segments());
    longer[6] ^= 1;
    assert!(read(&with_checksum(longer), 0).is_err());
    assert_eq!(
        &bytes[bytes.len() - 16..bytes.len() - 4],
        b"\x00\x22\x11\xDF\x83\x04\x1A\x01UFD\x10"
    );
    let back = read_dfuse(&bytes).unwrap();
    assert_eq!(
        (back.segments, back.name.as_str(), back.ids),
        (segments(), "flexor", ids)
    );
    assert_eq!(read(&bytes, 0).unwrap(), segments());
    let long = write_dfuse(&[], &"é".repeat(400), DfuseIds::default()).unwrap();
    assert!(read_dfuse(&long).unwrap().segments.is_empty());
}

#[test]
fn a_file_for_another_usb_device_is_refused() {
    let write = |vendor, product| {
        let ids = DfuseIds {
            vendor,
            product,
            ..DfuseIds::default()
        };
        read(&write_dfuse(&segments(), "x", ids).unwrap(), 0)
    };
    for (vendor, product) in [(0x0483, 0xDF11), (0xFFFF, 0xFFFF), (0x0483, 0xFFFF)] {
        assert!(write(vendor, product).is_ok(), "{vendor:04x}:{product:04x}");
    }
    for (vendor, product) in [(0x0483, 0x5740), (0x28E9, 0xDF11), (0x1209, 0xFFFF)] {
        let refused = ContainerError::OtherDevice { vendor, product };
        assert_eq!(write(vendor, product), Err(refused));
    }
}

#[test]
fn hex_round_trip() {
    let text = write_hex(&segments()).unwrap();
    assert_eq!(read_hex(&text).unwrap(), segments());
    assert_eq!(read(text.as_bytes(), 0).unwrap(), segments());
    assert_eq!(read_hex(&text.replace('\n', "\r\n")).unwrap(), segments());
    let end = Segment {
        address: 0xFFFF_FFF0,
        bytes: vec![1; 16],
    };
    let text = write_hex(std::slice::from_ref(&end)).unwrap();
    assert_eq!(read_hex(&text).unwrap(), [end]);
}

#[test]
fn bad_files_are_named() {
    assert_eq!(read(b"\x7FELF\x01", 0), Err(ContainerError::Elf));
    let raw = read(b"\x00\xC0\x01\x20", 0x0800_0000).unwrap();
    assert_eq!((raw[0].address, raw[0].bytes.len()), (0x0800_0000, 4));
    let beyond = Segment {
        address: 0xFFFF_FFFF,
        bytes: vec![0; 2],
    };
    let outside = Err(ContainerError::AddressSpace {
        address: 0xFFFF_FFFF,
    });
    assert_eq!(write_hex(std::slice::from_ref(&beyond)), outside);
    assert!(write_dfuse(&[beyond], "", DfuseIds::default()).is_err());
    assert_eq!(read_hex(":020000040800F2\n"), Err(ContainerError::HexEnd));
    for (text, line) in [
        (":00000001FF\n:00000001FF", 2),
        (":00000001FE", 1),
        ("\n:0000", 2),
        (":é", 1),
        (":02000004FFFFFC\n:02FFFF00010203\n:00000001FF", 2),
    ] {
        let error = read_hex(text).unwrap_err();
        assert!(
            matches!(error, ContainerError::HexLine { line: at, .. } if at == line),
            "{error}"
        );
    }
    let good = write_dfuse(&segments(), "", DfuseIds::default()).unwrap();
    let mut flipped = good.clone();
    flipped[500] ^= 1;
    assert!(matches!(
        read_dfuse(&flipped),
        Err(ContainerError::Checksum { .. })
    ));
    assert!(matches!(
        read_dfuse(b"DfuSe"),
        Err(ContainerError::Truncated { .. })
    ));
    assert!(read_dfuse(&good[..good.len() - 1]).is_err());
}

#[test]
fn mutated_files_never_panic() {
    let mut random = Sequence::new(11);
    let small = [Segment {
        address: 0x0800_0000,
        bytes: vec![0xA5; 40],
    }];
    let dfu = write_dfuse(&small, "x", DfuseIds::default()).unwrap();
    let hex = write_hex(&small).unwrap();
    let mut accepted = 0;
    for _ in 0..20_000 {
        let mut file = dfu.clone();
        for _ in 0..=random.below(3) {
            let at = random.below(file.len() as u64) as usize;
            file[at] = random.byte();
        }
        // A right checksum lets the fields behind it be read.
        let file = with_checksum(file);
        accepted += u32::from(read(&file, 0).is_ok());
        let mut text = hex.clone().into_bytes();
        let at = random.below(text.len() as u64) as usize;
        text[at] = random.byte();
        let _ = read(&text, 0);
    }
    println!("{accepted} of 20000 mutated .dfu files are still valid");
}

#[test]
fn dfu_util_accepts_the_file() {
    let bytes = write_dfuse(&segments(), "flexor", DfuseIds::default()).unwrap();
    let path = file("ours.dfu", &bytes);
    let name = path.to_str().unwrap();
    if let Some(text) = tool("dfu-suffix", &["-c", name]) {
        println!("{text}");
        assert!(
            text.contains("idVendor:\t0x0483") || text.contains("0x0483"),
            "{text}"
        );
        assert!(text.contains("0x011A") || text.contains("0x011a"), "{text}");
        assert!(
            !text.contains("Invalid") && !text.contains("mismatch"),
            "{text}"
        );
    }
    let mut bad = bytes;
    bad[400] ^= 1;
    std::fs::write(&path, bad).unwrap();
    if let Some(text) = tool("dfu-suffix", &["-c", name]) {
        assert!(text.to_lowercase().contains("crc"), "{text}");
    }
    let _ = std::fs::remove_file(path);
}

#[test]
fn dfuse_pack_and_this_crate_agree() {
    let ours = write_dfuse(
        &segments(),
        "ST...",
        DfuseIds {
            device: 0,
            ..DfuseIds::default()
        },
    );
    let output = file("pack.dfu", b"");
    let mut arguments = Vec::new();
    let mut paths = Vec::new();
    for (index, segment) in segments().iter().enumerate() {
        let path = file(&format!("part{index}.bin"), &segment.bytes);
        arguments.push("-b".to_owned());
        arguments.push(format!("0x{:08X}:{}", segment.address, path.display()));
        paths.push(path);
    }
    arguments.push(output.display().to_string());
    let arguments: Vec<_> = arguments.iter().map(String::as_str).collect();
    if let Some(text) = tool("dfuse-pack", &arguments) {
        let theirs = std::fs::read(&output).unwrap();
        let back = read_dfuse(&theirs).unwrap_or_else(|error| panic!("{error}: {text}"));
        assert_eq!(back.segments, segments());
        // Size and so checksum: versions of dfuse-pack differ in whether the suffix counts.
        let (ours, end) = (ours.unwrap(), theirs.len() - 4);
        assert_eq!(ours[10..end], theirs[10..end], "not byte-identical");
    }
    paths.push(output);
    paths
        .iter()
        .for_each(|path| drop(std::fs::remove_file(path)));
}

#[test]
fn objcopy_reads_and_writes_the_same_hex() {
    let mut flat = vec![0xFF; 0x2_0000 + 70_000];
    for segment in segments() {
        let at = (segment.address - 0x0800_0000) as usize;
        flat[at..at + segment.bytes.len()].copy_from_slice(&segment.bytes);
    }
    let hex = file("ours.hex", write_hex(&segments()).unwrap().as_bytes());
    let bin = file("theirs.bin", b"");
    let (hex_name, bin_name) = (hex.to_str().unwrap(), bin.to_str().unwrap());
    let to_bin = [
        "-I",
        "ihex",
        "-O",
        "binary",
        "--gap-fill",
        "0xff",
        hex_name,
        bin_name,
    ];
    if let Some(text) = tool("objcopy", &to_bin) {
        assert_eq!(std::fs::read(&bin).unwrap(), flat, "{text}");
        let back = [
            "-I",
            "binary",
            "-O",
            "ihex",
            "--change-addresses",
            "0x08000000",
        ];
        let back: Vec<_> = back.into_iter().chain([bin_name, hex_name]).collect();
        tool("objcopy", &back);
        let theirs = std::fs::read_to_string(&hex).unwrap();
        let read = read_hex(&theirs).unwrap();
        assert_eq!((read.len(), read[0].address), (1, 0x0800_0000));
        assert_eq!(read[0].bytes, flat);
    }
    let _ = (std::fs::remove_file(hex), std::fs::remove_file(bin));
}
