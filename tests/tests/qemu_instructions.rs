//! The simulated core against QEMU: 200,000 random instructions, with every register, flag and byte
//! of scratch memory compared after every few, and every encoding in the images executed at least
//! 200 times.

use hal_sim::images::Image;
use std::collections::BTreeSet;
use std::path::Path;
use std::time::Instant;
use tests::differential::encodings::Kind;
use tests::differential::{
    Encodings, Program, RECORD_WORDS, chip, find_instructions, qemu, record_word_name,
};

/// Number of instructions to execute.
const INSTRUCTIONS: u32 = 200_000;
/// Smallest number of executions of an encoding in the images.
const TIMES: u32 = 200;

fn words(record: &[u8]) -> Vec<u32> {
    let word = |b: &[u8]| u32::from_le_bytes([b[0], b[1], b[2], b[3]]);
    record.chunks_exact(4).map(word).collect()
}

/// Describes the differences in case `index` for people.
fn explain(program: &Program, index: usize, ours: &[u8], theirs: &[u8]) -> String {
    let (at, case) = &program.cases[index];
    let mut lines = vec![format!("seed {}, case {index} at {at:#010x}", program.seed)];
    lines.push(format!("code {:04x?}", case.code));
    lines.push(format!("before {:#010x?}", case.input));
    for (word, (ours, theirs)) in words(ours).into_iter().zip(words(theirs)).enumerate() {
        if ours != theirs {
            let name = record_word_name(word);
            lines.push(format!("{name}: here {ours:#010x}, QEMU {theirs:#010x}"));
        }
    }
    lines.join("\n")
}

/// Returns the differences from QEMU in the records of `program`.
fn differences(program: &Program, ours: &[u8], theirs: &[u8]) -> Vec<String> {
    let size = RECORD_WORDS * 4;
    let mut found: Vec<String> = ours
        .chunks(size)
        .zip(theirs.chunks(size))
        .enumerate()
        .filter(|(_, (ours, theirs))| ours != theirs)
        .map(|(index, (ours, theirs))| explain(program, index, ours, theirs))
        .collect();
    for (machine, records) in [("here", ours), ("QEMU", theirs)] {
        let count = records.len() / size;
        if count != program.cases.len() {
            let (_, case) = &program.cases[count];
            let seed = program.seed;
            found.push(format!(
                "{machine}, seed {seed}: case {count} ended the program: {case:#x?}"
            ));
        }
    }
    found
}

#[test]
fn the_core_computes_what_qemu_computes() {
    let start = Instant::now();
    let encodings = Encodings::new();
    let directory = Path::new(env!("CARGO_TARGET_TMPDIR"));
    let mut planned = vec![0; encodings.0.len()];
    let mut executed = vec![0; encodings.0.len()];
    let mut seed = 0;
    while executed.iter().sum::<u32>() < INSTRUCTIONS {
        seed += 1;
        let output = format!("qemu_instructions_{seed}");
        let program = Program::new(seed, &encodings, &mut planned, &output);
        let ours = chip::records(&program, &encodings, &mut executed).unwrap();
        let theirs = qemu::records(&program, directory, &output).unwrap();
        let found = differences(&program, &ours, &theirs);
        let count = found.len();
        let first = found.into_iter().take(3).collect::<Vec<_>>().join("\n\n");
        assert!(count == 0, "{count} differences:\n{first}");
    }
    let total: u32 = executed.iter().sum();
    println!(
        "{total} instructions, seeds 1–{seed}, in {:.1} s: no difference",
        start.elapsed().as_secs_f64()
    );
    let missing = [rare(&encodings, &executed), unknown(&encodings)].concat();
    assert!(missing.is_empty(), "{}", missing.join("\n"));
}

/// Returns the encodings that were executed too rarely.
fn rare(encodings: &Encodings, executed: &[u32]) -> Vec<String> {
    let executions = encodings.0.iter().map(|p| p.encoding).zip(executed);
    let counted = executions.filter(|(encoding, _)| !matches!(encoding.kind, Kind::Left(_)));
    let (count, least) = counted
        .clone()
        .fold((0, u32::MAX), |(count, least), (_, times)| {
            (count + 1, least.min(*times))
        });
    println!("{count} encodings, each at least {least} times");
    let rare = counted.filter(|(_, times)| **times < TIMES);
    rare.map(|(encoding, times)| format!("{}: {times} times only", encoding.name))
        .collect()
}

/// Returns the images' instructions that have no known encoding.
fn unknown(encodings: &Encodings) -> Vec<String> {
    let workspace = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut unknown = Vec::new();
    let mut contained = BTreeSet::new();
    for image in [Image::Stimulator, Image::Qemu, Image::Bench] {
        let elf = image.build(&workspace).unwrap_or_else(|e| panic!("{e}"));
        let found = find_instructions(&elf, encodings).unwrap_or_else(|e| panic!("{e:#}"));
        contained.extend(found.known.into_keys());
        for (at, width, code) in found.unknown {
            let digits = width as usize / 4;
            let name = image.name();
            unknown.push(format!(
                "{name}: no encoding of {code:0digits$x} at {at:#010x}"
            ));
        }
    }
    println!("{} of them are in the images", contained.len());
    for encoding in contained.iter().map(|id| encodings.0[*id].encoding) {
        if let Kind::Left(why) = encoding.kind {
            println!("in an image, but not executed: {}: it {why}", encoding.name);
        }
    }
    unknown
}
