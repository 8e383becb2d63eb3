//! Files and lines written by people or by an interrupted program.

use firmware::range::OutOfRange;
use firmware::safety::{StageKind, StageTable, StageWords, Stages};
use host_core::calibration::{self, Entry, Machine, Order, PartialLine, Plan};
use host_core::record::{self, RecordError, Run};
use host_core::report::{ComparedRecord, Report, compare_body, compare_text, document};
use host_core::wearer::Wearer;
use std::cell::OnceCell;
use std::path::{Path, PathBuf};

/// Fuzzes a wearer file: it is refused with a report that can be shown, or it reads back unchanged
/// from its own output, and a calibration is planned from it or refused with a reason.
pub fn wearer(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else {
        return;
    };
    let wearer = match Wearer::parse("wearer.toml", text) {
        Ok(wearer) => wearer,
        Err(error) => return assert_numbered(&error.lines()),
    };
    let written = wearer.to_toml();
    match Wearer::parse("written.toml", &written) {
        Ok(again) => assert_eq!(again, wearer, "a wearer changes when it is written"),
        Err(error) => panic!("what was written is refused: {}", error.lines()),
    }
    if let Err(error) = Plan::from_wearer(&wearer) {
        assert_numbered(&error.to_string());
    }
}

/// Fuzzes a calibration's journal: it is refused with an error number, or the calibration continues
/// from it. Runs once unchanged and once with corrected checksums, so that the contents are read
/// too.
pub fn journal(data: &[u8]) {
    for text in [data.to_vec(), with_checksums(data)] {
        let kept = match calibration::parse_journal(Path::new("x.journal"), &text) {
            Ok(kept) => kept,
            Err(error) => {
                assert_numbered(&error.to_string());
                continue;
            }
        };
        assert!(kept.whole <= text.len(), "more was kept than there is");
        assert!(matches!(kept.entries.first(), Some(Entry::Begun(_))));
        let again = calibration::parse_journal(Path::new("x.journal"), &text[..kept.whole]);
        assert_eq!(again.ok().as_ref(), Some(&kept), "a whole journal is cut");
        let mut machine = Machine::new(plan(), &kept.entries);
        let ceiling = machine.plan().electrodes[0].ceiling;
        machine.begin();
        for found in machine.results() {
            let levels = [found.threshold, found.limit, found.minimum, found.maximum];
            let highest = levels.into_iter().flatten().max();
            assert!(highest <= Some(ceiling), "{highest:?} above {ceiling:?}");
        }
    }
}

/// Returns the plan of the journals in the corpus.
fn plan() -> Plan {
    thread_local!(static PLAN: OnceCell<Plan> = const { OnceCell::new() });
    let text = include_str!("../../../host-tool/calibrations/one_electrode.toml");
    let read = || Plan::parse("plan.toml", text).expect("a shipped plan");
    PLAN.with(|plan| plan.get_or_init(read).clone())
}

/// Returns the lines with the numbers and checksums that the program would write: the first 64 bits
/// of SHA-256 over the last checksum and the line up to its own.
fn with_checksums(data: &[u8]) -> Vec<u8> {
    let (mut out, mut sum) = (Vec::new(), String::new());
    for line in data.split_inclusive(|byte| *byte == b'\n') {
        let text = String::from_utf8_lossy(line);
        let told = text.rsplit_once(",\"sum\":\"").map(|(told, _)| told);
        let Some(body) = told.filter(|_| line.ends_with(b"\n")) else {
            out.extend_from_slice(line);
            continue;
        };
        sum = record::sha256(format!("{sum}{body}").as_bytes());
        sum.truncate(16);
        out.extend_from_slice(format!("{body},\"sum\":\"{sum}\"}}\n").as_bytes());
    }
    out
}

/// Fuzzes the lines that a program or person enters at a calibration, in pieces: each line is a
/// command, or is refused with an error number. A command can be parsed from its own output.
pub fn lines(data: &[u8]) {
    let (mut line_buffer, mut pieces) = (PartialLine::default(), PartialLine::default());
    let lines = line_buffer.take_lines(data, true);
    let mut again = Vec::new();
    for piece in data.chunks(7) {
        again.extend(pieces.take_lines(piece, false));
    }
    again.extend(pieces.take_lines(&[], true));
    assert_eq!(lines, again, "lines depend on how they come");
    for line in lines {
        match Order::parse(&line) {
            Ok(order) => {
                let written = serde_json::to_string(&order).expect("orders are JSON");
                assert_eq!(Order::parse(&written), Ok(order));
            }
            Err(error) => assert_numbered(&error.to_string()),
        }
    }
}

/// Fuzzes the two copies of a board's stage table in flash, preceded by the chip's ID. The board
/// accepts them only if both are equal and complete, belong to this chip and lie within the ranges;
/// writing them again gives the same words. Runs once unchanged and once with corrected magic,
/// version and checksums.
pub fn stage_words(data: &[u8]) {
    let words: Vec<u32> = data
        .chunks_exact(4)
        .filter_map(|word| word.first_chunk().copied().map(u32::from_le_bytes))
        .collect();
    let Some((unique_id, rest)) = words.split_first_chunk::<3>() else {
        return;
    };
    let mut copies = [[0; size_of::<StageWords>() / 4]; 2];
    for (to, from) in copies.iter_mut().flatten().zip(rest) {
        *to = *from;
    }
    check_stages(&copies, *unique_id);
    check_stages(
        &copies.map(|words| with_valid_checksum(words, *unique_id)),
        *unique_id,
    );
}

/// Returns the words with magic, version, chip ID and checksum as a board writes them.
fn with_valid_checksum(mut words: StageWords, [a, b, c]: [u32; 3]) -> StageWords {
    let [magic, version, x, y, z, ..] = &mut words;
    (*magic, *version) = (u32::from_le_bytes(*b"FXST"), *version & 1 | 1 << 16);
    (*x, *y, *z) = (a, b, c);
    let last = words.len() - 1;
    let bytes: Vec<u8> = words[..last].iter().flat_map(|w| w.to_le_bytes()).collect();
    words[last] = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&bytes);
    words
}

fn check_stages(copies: &[StageWords; 2], unique_id: [u32; 3]) {
    let [first, second] = copies;
    match Stages::from_copies([first, second], unique_id) {
        Stages::Stored(table) => {
            assert!(
                check_ranges(&table).is_ok(),
                "{table:?} is beyond its ranges"
            );
            let written = table.to_words(unique_id);
            assert_eq!([&written, &written], [first, second]);
        }
        Stages::Unknown(_) => {}
        Stages::AsConfigured | Stages::Simulated { .. } => {
            panic!("a board with a memory believes its host")
        }
    }
}

/// Checks the ranges of docs/protocol.md, which are repeated here so that a mistake in them is not
/// shared.
fn check_ranges(table: &StageTable) -> Result<(), OutOfRange> {
    for stage in table.stages.iter().flatten() {
        let (value, highest) = match *stage {
            StageKind::Current { full_scale_ua } => (full_scale_ua, 100_000),
            StageKind::Voltage { full_scale_mv } => (full_scale_mv, 150_000),
        };
        assert!((1_000..=highest).contains(&value), "{value}");
    }
    table.validate()
}

/// Fuzzes a record in which one file is replaced by the input: its name, a line, its contents. The
/// record is refused with an error number, or loaded and checked for damage.
pub fn record(data: &[u8]) {
    with_spoilt_file(data, |dir| drop(load(dir)));
}

/// Fuzzes a record as the target `record` does; if the record loads, it is shown and compared, as
/// the commands `report` and `compare` do.
pub fn report(data: &[u8]) {
    with_spoilt_file(data, |dir| {
        if let Some(run) = load(dir) {
            check_pages(run);
        }
    });
}

fn with_spoilt_file(data: &[u8], call: fn(&Path)) {
    let end = data.iter().position(|byte| *byte == b'\n');
    let (name, contents) = match end {
        Some(end) => (&data[..end], &data[end + 1..]),
        None => (data, &[][..]),
    };
    let known = RECORD.iter().position(|(file, _)| file.as_bytes() == name);
    let index = known.unwrap_or(name.len() % RECORD.len());
    thread_local!(static FOLDER: Folder = Folder::with_record());
    FOLDER.with(|folder| folder.with_replaced_file(index, contents, call));
}

/// Loads a record as `report`, `rerun` and `compare` do.
fn load(dir: &Path) -> Option<Run> {
    let run = match record::load(dir) {
        Ok(run) => run,
        Err(error) => {
            assert_numbered(&error.to_string());
            return None;
        }
    };
    let damaged: Option<RecordError> = run.damage_error(dir);
    if let Some(error) = damaged {
        assert_numbered(&error.to_string());
    }
    Some(run)
}

fn check_pages(run: Run) {
    let page = host_core::report::page(&Report::from_run(&run));
    assert!(page.ends_with("</html>\n"), "a page without an end");
    let records = ["one", "other"].map(|name| ComparedRecord::from_run(Path::new(name), &run));
    assert!(!compare_text(&records).is_empty());
    assert!(document("both", &compare_body(&records)).ends_with("</html>\n"));
}

/// Files of the fuzzed record, with their contents.
const RECORD: [(&str, &str); 6] = [
    (
        "run.json",
        include_str!("../../fuzz/corpus/record/run.json"),
    ),
    (
        "summary.json",
        include_str!("../../fuzz/corpus/record/summary.json"),
    ),
    (
        "trial.json",
        include_str!("../../fuzz/corpus/record/trial.json"),
    ),
    (
        "samples.csv",
        include_str!("../../fuzz/corpus/record/samples.csv"),
    ),
    (
        "edges.csv",
        include_str!("../../fuzz/corpus/record/edges.csv"),
    ),
    (
        "session.toml",
        include_str!("../../fuzz/corpus/record/session.toml"),
    ),
];

/// Temporary folder of this thread, removed at the end.
struct Folder(PathBuf);

impl Folder {
    fn with_record() -> Self {
        let thread = format!("{:?}", std::thread::current().id());
        let thread: String = thread.chars().filter(char::is_ascii_digit).collect();
        let name = format!("flexor-fuzz-{}-{thread}", std::process::id());
        let folder = Self(std::env::temp_dir().join(name));
        std::fs::create_dir_all(folder.0.join(TRIAL)).expect("a folder for temporary files");
        for (index, (_, text)) in RECORD.iter().enumerate() {
            folder.write(
                index,
                text.split_once('\n').map_or("", |pair| pair.1).as_bytes(),
            );
        }
        folder
    }

    fn write(&self, index: usize, contents: &[u8]) {
        let (file, _) = RECORD[index];
        let folder = match file {
            "run.json" | "summary.json" => self.0.clone(),
            _ => self.0.join(TRIAL),
        };
        std::fs::write(folder.join(file), contents).expect("a temporary file");
    }

    /// Calls `call` with one file replaced, and restores the file.
    fn with_replaced_file(&self, index: usize, contents: &[u8], call: fn(&Path)) {
        self.write(index, contents);
        let done = std::panic::catch_unwind(|| call(&self.0));
        let (_, text) = RECORD[index];
        self.write(
            index,
            text.split_once('\n').map_or("", |pair| pair.1).as_bytes(),
        );
        if let Err(why) = done {
            std::panic::resume_unwind(why);
        }
    }
}

/// Folder of the record's only trial.
const TRIAL: &str = "01-ten-channels-and-the-finger";

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0); // a temporary folder may stay
    }
}

/// Checks that an error begins with its number.
fn assert_numbered(error: &str) {
    let digits = error.strip_prefix('E').unwrap_or_default();
    let is_numbered = digits.len() > 3 && digits.as_bytes()[..3].iter().all(u8::is_ascii_digit);
    assert!(is_numbered, "an error without a number: {error}");
}
