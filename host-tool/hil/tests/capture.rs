//! Session files: what is written reads back, and what is malformed is refused with a number.

use hal_sim::random::Sequence;
use std::io::{Cursor, Write};

use hil::capture::{Capture, CaptureError, Probe, ReadOptions, Transition, read, write};
use zip::ZipWriter;
use zip::write::SimpleFileOptions;

const METADATA: &str = "[global]\nsigrok version=0.5.2\n\n[device 1]\ncapturefile=logic-1\n\
    total probes=8\nsamplerate=24 MHz\ntotal analog=0\nprobe1=D0\nprobe2=D1\nunitsize=1\n";

fn archive(entries: &[(&str, &[u8])]) -> Vec<u8> {
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    for (name, bytes) in entries {
        zip.start_file(*name, SimpleFileOptions::default()).unwrap();
        zip.write_all(bytes).unwrap();
    }
    zip.finish().unwrap().into_inner()
}

fn read_bytes(bytes: &[u8]) -> Result<Capture, CaptureError> {
    read(Cursor::new(bytes), &ReadOptions::default())
}

fn number(entries: &[(&str, &[u8])]) -> u8 {
    let error = read_bytes(&archive(entries)).expect_err("malformed");
    let text = error.to_string();
    assert!(text.starts_with("capture") && text.contains(';'), "{text}");
    error.number()
}

fn with_metadata(metadata: &str) -> u8 {
    number(&[
        ("version", b"2"),
        ("metadata", metadata.as_bytes()),
        ("logic-1-1", &[0, 1, 0]),
    ])
}

fn probes(bits: &[u8]) -> Vec<Probe> {
    let name = |bit: &u8| Probe {
        bit: *bit,
        name: format!("D{bit}"),
    };
    bits.iter().map(name).collect()
}

fn to_file(capture: &Capture) -> Vec<u8> {
    let mut out = Cursor::new(Vec::new());
    write(&mut out, capture).expect("a Vec takes all bytes");
    out.into_inner()
}

/// Capture with random transitions of the given bits.
fn random_capture(seed: u64, bits: &[u8], samples: u64) -> Capture {
    let mut random = Sequence::new(seed);
    let mask = bits.iter().fold(0_u64, |mask, bit| mask | 1 << bit);
    let first = random.next_word() & mask;
    let (mut sample, mut levels) = (0, first);
    let mut transitions = Vec::new();
    loop {
        sample += 1 + random.below(samples / 20);
        if sample >= samples {
            break;
        }
        levels ^= 1 << bits[random.below(bits.len() as u64) as usize];
        transitions.push(Transition { sample, levels });
    }
    Capture::new(24_000_000, samples, probes(bits), first, transitions).unwrap()
}

#[test]
fn captures_read_back_as_written() {
    let all: Vec<u8> = (0..64).collect();
    let sets: [&[u8]; 6] = [&[0], &[0, 1, 5], &all[..8], &[3, 12], &all[..21], &all];
    for (seed, bits) in sets.into_iter().enumerate() {
        for samples in [2_000, 1_000_000] {
            let capture = random_capture(seed as u64, bits, samples);
            let bytes = to_file(&capture);
            assert_eq!(read_bytes(&bytes).unwrap(), capture, "{bits:?}");
            assert_eq!(to_file(&capture), bytes, "equal captures give equal bytes");
        }
    }
}

#[test]
fn one_second_at_100_megasamples_streams() {
    let capture = random_capture(7, &[0, 1, 2, 3, 4, 5, 6, 7], 100_000_000);
    let bytes = to_file(&capture);
    assert!(bytes.len() < 1_000_000, "{}", bytes.len());
    assert_eq!(read_bytes(&bytes).unwrap(), capture);
}

#[test]
fn chunks_are_read_in_numeric_order() {
    let mut entries: Vec<(String, Vec<u8>)> = (1..=11_u8)
        .rev()
        .map(|n| (format!("logic-1-{n}"), vec![n % 2; usize::from(n)]))
        .collect();
    entries.push(("version".into(), b"2".to_vec()));
    entries.push(("metadata".into(), METADATA.into()));
    entries.push(("analog-1-9-1".into(), vec![0; 5]));
    let entries: Vec<(&str, &[u8])> = entries
        .iter()
        .map(|(name, bytes)| (name.as_str(), bytes.as_slice()))
        .collect();
    let capture = read_bytes(&archive(&entries)).unwrap();
    assert_eq!(capture.samples(), 66);
    assert_eq!(capture.samplerate_hz(), 24_000_000);
    assert_eq!(capture.first(), 1);
    let line = capture.line(0, "c1").unwrap();
    assert_eq!(line.edges, [1, 3, 6, 10, 15, 21, 28, 36, 45, 55]);
    assert!(line.first_high && capture.line(2, "c1").is_none());
}

#[test]
fn a_single_capture_file_and_unselected_probes() {
    let bytes = archive(&[
        ("version", b"1\n"),
        ("metadata", METADATA.as_bytes()),
        ("logic-1", &[0, 2, 2, 3, 1]),
    ]);
    let all = read_bytes(&bytes).unwrap();
    assert_eq!(all.transitions().len(), 3);
    let options = ReadOptions {
        probes: 0b10,
        ..ReadOptions::default()
    };
    let second = read(Cursor::new(&bytes), &options).unwrap();
    assert_eq!(second.line(1, "a1").unwrap().edges, [1, 4]);
    assert_eq!(second.transitions().len(), 2);
    assert_eq!(second.probes(), &probes(&[1]));
    let none = ReadOptions {
        probes: 0b100,
        ..options
    };
    assert_eq!(read(Cursor::new(&bytes), &none).unwrap_err().number(), 11);
}

#[test]
fn malformed_files_are_refused_with_their_number() {
    let version: (&str, &[u8]) = ("version", b"2");
    let metadata = ("metadata", METADATA.as_bytes());
    let logic: (&str, &[u8]) = ("logic-1-1", &[0, 1]);
    assert_eq!(read_bytes(b"").unwrap_err().number(), 1);
    assert_eq!(read_bytes(b"t_us,channel\n").unwrap_err().number(), 1);
    assert_eq!(number(&[metadata, logic]), 3);
    assert_eq!(number(&[version, logic]), 3);
    assert_eq!(number(&[("version", b"3"), metadata, logic]), 4);
    assert_eq!(number(&[("version", b"\xff"), metadata, logic]), 5);
    assert_eq!(number(&[version, ("metadata", &[b'#'; 70_000]), logic]), 5);
    assert_eq!(number(&[version, metadata]), 16);
    assert_eq!(number(&[version, metadata, ("logic-1-1", b"")]), 16);
    assert_eq!(number(&[version, metadata, ("logic-1-2", &[0])]), 12);
    let gap = [version, metadata, logic, ("logic-1-3", &[0][..])];
    assert_eq!(number(&gap), 12);
    let error = read_bytes(&archive(&gap)).unwrap_err().to_string();
    assert!(error.contains("`logic-1-2`"), "{error}");

    assert_eq!(with_metadata("[device 1\n"), 5);
    assert_eq!(with_metadata("[device 1]\nsamplerate\n"), 5);
    assert_eq!(
        with_metadata(&METADATA.replace("unitsize=1", "unitsize=one")),
        5
    );
    assert_eq!(
        with_metadata(&METADATA.replace("total probes=8", "total probes=-8")),
        5
    );
    for key in [
        "capturefile=logic-1\n",
        "samplerate=24 MHz\n",
        "unitsize=1\n",
    ] {
        assert_eq!(with_metadata(&METADATA.replace(key, "")), 6, "{key}");
    }
    assert_eq!(with_metadata(""), 6);
    assert_eq!(with_metadata(&format!("{METADATA}[device 2]\n")), 7);
    for rate in [
        "0 Hz",
        "101 GHz",
        "-1 MHz",
        "1.5 Hz",
        "99999999999999999999",
        "fast",
    ] {
        let text = METADATA.replace("24 MHz", rate);
        assert_eq!(with_metadata(&text), 8, "{rate}");
    }
    for unitsize in ["0", "9", "18446744073709551615"] {
        let text = METADATA.replace("unitsize=1", &format!("unitsize={unitsize}"));
        assert_eq!(with_metadata(&text), 9, "{unitsize}");
    }
    for probe in ["probe9=D8", "probe0=D", "probe1=D0", "probe3="] {
        let text = format!("{METADATA}{probe}\n");
        assert_eq!(with_metadata(&text), 10, "{probe}");
    }
    let silent = METADATA.replace("probe1=D0\nprobe2=D1\n", "");
    assert_eq!(with_metadata(&silent), 11);
    let wide = METADATA.replace("unitsize=1", "unitsize=2");
    assert_eq!(with_metadata(&wide), 13);
}

#[test]
fn sixteen_probes_and_disabled_ones_are_allowed() {
    let text = METADATA
        .replace("unitsize=1", "unitsize=2")
        .replace("total probes=8", "total probes=34")
        .replace("probe2=D1", "probe16=D15");
    let bytes = archive(&[
        ("version", b"2"),
        ("metadata", text.as_bytes()),
        ("logic-1-1", &[0, 0, 0, 0x80, 1, 0x7f]),
    ]);
    let capture = read_bytes(&bytes).unwrap();
    assert_eq!(capture.line(15, "x").unwrap().edges, [1, 2]);
    assert_eq!(capture.line(0, "x").unwrap().edges, [2]);
    assert_eq!(capture.samples(), 3);
}

#[test]
fn limits_hold() {
    let capture = random_capture(3, &[0, 1], 1_000_000);
    let bytes = to_file(&capture);
    let limited = |max_transitions, max_bytes| {
        let options = ReadOptions {
            max_transitions,
            max_bytes,
            ..ReadOptions::default()
        };
        read(Cursor::new(&bytes), &options).map_err(|error| error.number())
    };
    let count = capture.transitions().len();
    assert_eq!(limited(count, 1_000_000).as_ref(), Ok(&capture));
    assert_eq!(limited(count - 1, 1_000_000), Err(15));
    assert_eq!(limited(count, 999_999), Err(14));
}

#[test]
fn truncated_and_damaged_files_never_panic() {
    let bytes = to_file(&random_capture(1, &[0, 1, 2], 3_000));
    for length in 0..bytes.len() {
        assert!(read_bytes(&bytes[..length]).is_err(), "{length}");
    }
    let mut random = Sequence::new(9);
    let options = ReadOptions {
        max_bytes: 1 << 20,
        ..ReadOptions::default()
    };
    let mut refused = 0;
    for _ in 0..20_000 {
        let mut damaged = bytes.clone();
        for _ in 0..=random.below(3) {
            let place = random.below(damaged.len() as u64) as usize;
            damaged[place] = random.next_word() as u8;
        }
        refused += u32::from(read(Cursor::new(damaged), &options).is_err());
    }
    // The remaining bytes are dates and other fields that do not matter.
    assert!(refused > 10_000, "{refused}");
}

#[test]
fn bad_captures_cannot_be_built() {
    let new = |rate, samples, bits: &[u8], list: &[(u64, u64)]| {
        let transition = |&(sample, levels)| Transition { sample, levels };
        let transitions = list.iter().map(transition).collect();
        let capture = Capture::new(rate, samples, probes(bits), 0, transitions);
        capture.map_err(|error| error.number()).err()
    };
    assert_eq!(new(1, 3, &[0], &[(1, 1), (2, 0)]), None);
    assert_eq!(new(0, 3, &[0], &[]), Some(8));
    assert_eq!(new(u64::MAX, 3, &[0], &[]), Some(8));
    assert_eq!(new(1, 3, &[0, 0], &[]), Some(10));
    assert_eq!(new(1, 3, &[64], &[]), Some(10));
    for list in [&[(0, 1)][..], &[(3, 1)], &[(1, 0)], &[(2, 1), (1, 0)]] {
        assert_eq!(new(1, 3, &[0], list), Some(17), "{list:?}");
    }
    let empty = Capture::new(1, 0, probes(&[0]), 0, Vec::new()).unwrap();
    let none = Capture::new(1, 1, Vec::new(), 0, Vec::new()).unwrap();
    let mut out = Cursor::new(Vec::new());
    assert_eq!(write(&mut out, &empty).unwrap_err().number(), 16);
    assert_eq!(write(&mut out, &none).unwrap_err().number(), 11);
}
