//! The waveform file, read back by an independent parser.

use std::collections::HashMap;

use hal_sim::trace::{Levels, State, Trace, Vcd, write_vcd};
use vcd::{Command, Parser, TimescaleUnit, Value};

fn example() -> Trace {
    let mut trace = Trace::default();
    trace.record_dac(5, 9, 0xA5C3);
    let driven = Levels::ISOLATED
        .with_channel(9, State::Cathodic)
        .with_sync(true);
    trace.record_levels(30, driven);
    trace.record_levels(
        230,
        driven
            .with_channel(9, State::Grounded)
            .with_channel(0, State::Anodic),
    );
    trace.record_dac(240, 0, 1);
    trace.record_levels(1 << 33, Levels::ISOLATED);
    trace
}

/// End of the recording, µs.
const END_US: u64 = (1 << 33) + 5_000_000;

fn bit(line: bool) -> Value {
    Value::from(line)
}

#[test]
fn every_change_is_read_back_at_its_microsecond() {
    let trace = example();
    let mut bytes = Vec::new();
    write_vcd(&mut bytes, &trace, END_US).expect("a Vec takes all bytes");
    let mut parser = Parser::new(bytes.as_slice());
    let header = parser.parse_header().expect("own header");
    assert_eq!(header.timescale, Some((1, TimescaleUnit::US)));

    let mut names = HashMap::new();
    for channel in 1..=10 {
        for (line, size) in [("anodic", 1), ("cathodic", 1), ("dac", 16)] {
            // Unique by itself, for viewers that show no scopes.
            let path = ["flexor", &format!("ch{channel}_{line}")];
            let var = header.find_var(&path).expect("declared");
            assert_eq!(var.size, size);
            names.insert(var.code, format!("{channel}.{line}"));
        }
    }
    let sync = header.find_var(&["flexor", "sync"]).expect("declared");
    names.insert(sync.code, "sync".to_string());

    let mut now: HashMap<String, Vec<Value>> = HashMap::new();
    let mut t_us = 0;
    let mut seen: Vec<(u64, String, Vec<Value>)> = Vec::new();
    for command in parser {
        let (code, value) = match command.expect("own body") {
            Command::Timestamp(t) => {
                assert!(t >= t_us);
                t_us = t;
                continue;
            }
            Command::ChangeScalar(code, value) => (code, vec![value]),
            Command::ChangeVector(code, value) => (code, value.iter().collect()),
            other => panic!("{other:?}"),
        };
        let name = names[&code].clone();
        if now.insert(name.clone(), value.clone()) != Some(value.clone()) && t_us > 0 {
            seen.push((t_us, name, value));
        }
    }
    assert_eq!(now.len(), 31, "all variables have a value from the start");
    assert_eq!(t_us, END_US, "the last time stamp");

    let word = |code: u16| (0..16).rev().map(|i| bit(code >> i & 1 == 1)).collect();
    let line = |t_us, name: &str, high| (t_us, name.to_string(), vec![bit(high)]);
    assert_eq!(
        seen,
        [
            (5, "10.dac".to_string(), word(0xA5C3)),
            line(30, "10.cathodic", true),
            line(30, "sync", true),
            line(230, "1.anodic", true),
            line(230, "10.anodic", true),
            (240, "1.dac".to_string(), word(1)),
            line(1 << 33, "1.anodic", false),
            line(1 << 33, "10.anodic", false),
            line(1 << 33, "10.cathodic", false),
            line(1 << 33, "sync", false),
        ]
    );
}

#[test]
fn a_dump_written_in_pieces_is_the_dump_written_at_once() {
    let dump = |cuts: &[u64]| {
        let (mut trace, mut bytes) = (example(), Vec::new());
        let mut dump = Vcd::begin(&mut bytes).unwrap();
        for &cut in cuts {
            dump.append(&trace.take(cut)).unwrap();
        }
        dump.append(&trace).unwrap();
        dump.end(END_US).unwrap();
        bytes
    };
    let full_dump = dump(&[]);
    for cuts in [
        [0, 5, 6],
        [30, 31, 240],
        [230, 241, 1 << 33],
        [1, 1 << 33, 1 << 34],
    ] {
        assert!(dump(&cuts) == full_dump, "{cuts:?}");
    }
}

#[test]
fn a_device_that_puts_nothing_out_is_dumped_to_its_end() {
    let mut bytes = Vec::new();
    write_vcd(&mut bytes, &Trace::default(), 5_000_000).unwrap();
    assert!(bytes.ends_with(b"#5000000\n"));
}
