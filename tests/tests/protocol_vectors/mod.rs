//! Compares docs/protocol.md and docs/protocol_vectors.json with the code.
//!
//! `FLEXOR_OVERWRITE=1 cargo test -p tests --test suite protocol_vectors` rewrites the vectors, and
//! the marked blocks and the tables of types of protocol.md, whose words are in
//! host-tool/src/protocol/fields.toml.

mod alive;
mod fields;
mod messages;
mod schema;
mod session;
mod setup_sums;

use firmware::board::wiring::BOARD_NAME;
use firmware::haptics::JOINTS;
use firmware::limb::VIAS;
use firmware::link::{Code, MAX_MESSAGE, Refusal, Response, SCHEMA, ToDevice, encode};
use firmware::pulse::{CHANNELS, MAX_GROUPS};
use firmware::safety::{Fault, MAX_LISTED};
use host_core::link::{advice, meaning};
use host_tool::protocol::{Protocol, TypeDescription, Variant, describe};
use postcard_schema::{Schema, schema::NamedType};
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};

/// Returns one request of each kind.
pub fn requests() -> Vec<firmware::link::Request> {
    let vectors = messages::requests().into_iter();
    vectors.map(|(_, sent)| sent.request).collect()
}

const PROTOCOL: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/protocol.md");
const VECTORS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/protocol_vectors.json");

const CLIENT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/examples/client.py");

fn hex(bytes: &[u8], between: &str) -> String {
    let digits: Vec<String> = bytes.iter().map(|b| format!("{b:02x}")).collect();
    digits.join(between)
}

fn read(path: &str) -> String {
    std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{path}: {e}"))
}

/// Checks that the file contains `text`, or writes it there.
fn check_or_update(path: &str, text: &str) {
    if std::env::var_os("FLEXOR_OVERWRITE").is_some() {
        // Replaced in one step, because another test may be reading.
        let new = format!("{path}.new");
        std::fs::write(&new, text).expect("docs/ is writable");
        std::fs::rename(&new, path).expect("docs/ is writable");
    }
    let message = "is out of date: run this test with FLEXOR_OVERWRITE=1 and review the diff";
    assert!(read(path) == text, "{path} {message}");
}

fn directions() -> [&'static NamedType; 2] {
    [ToDevice::SCHEMA, <Response<'static> as Schema>::SCHEMA]
}

/// Rows of a type: (field, type) of a struct, (number and variant, contents) of an enum.
type Rows = Vec<(String, String)>;

/// Returns the rows of every type on the link.
fn types() -> BTreeMap<String, Rows> {
    let rows = |description: TypeDescription| match description {
        TypeDescription::Struct(fields) => fields
            .into_iter()
            .map(|field| (field.name, field.ty))
            .collect(),
        TypeDescription::Enum(variants) => {
            let row = |variant: Variant| {
                let name = format!("{} {}", variant.number, variant.name);
                (name, variant.carries().replace('`', ""))
            };
            variants.into_iter().map(row).collect()
        }
    };
    let protocol = describe().expect("the program's own files");
    let types = protocol.types.into_iter();
    types
        .map(|(name, described)| (name, rows(described)))
        .collect()
}

fn vector<T: Serialize>(name: &str, direction: &str, message: &T) -> (String, Vec<u8>) {
    let frame = encode(message).unwrap_or_else(|| panic!("{name} does not fit"));
    let bytes = session::decode(&frame);
    let line = format!(
        "{{\"name\": {}, \"direction\": \"{direction}\", \"message\": {},\n  \"postcard\": \"{}\",\n  \"frame\": \"{}\"}}",
        serde_json::to_string(name).expect("text"),
        serde_json::to_string(message).expect("plain data"),
        hex(&bytes, ""),
        hex(&frame, ""),
    );
    (line, bytes)
}

#[test]
fn vectors_are_what_the_code_encodes_and_decodes() {
    let mut lines = vec![];
    let mut left = BTreeSet::new();
    for (t, rows) in types() {
        // Each row of an enum begins with its number.
        let variants = rows.iter().filter_map(|(name, _)| name.split_once(' '));
        left.extend(variants.map(|(_, name)| (t.clone(), name.to_owned())));
    }
    for (name, message) in messages::requests() {
        let (line, bytes) = vector(name, "to device", &message);
        assert_eq!(postcard::from_bytes(&bytes).as_ref(), Ok(&message));
        let json = serde_json::to_value(&message).expect("plain data");
        schema::tick_off(ToDevice::SCHEMA, &json, &mut left);
        lines.push(line);
    }
    for (name, message) in messages::responses() {
        let (line, bytes) = vector(&name, "to host", &message);
        assert_eq!(postcard::from_bytes(&bytes).as_ref(), Ok(&message));
        let json = serde_json::to_value(&message).expect("plain data");
        schema::tick_off(Response::SCHEMA, &json, &mut left);
        lines.push(line);
    }
    assert_eq!(left, BTreeSet::new(), "no vector shows these variants");
    let text = format!(
        "{{\"schema\": \"{SCHEMA:#018x}\",\n\"vectors\": [\n{}\n],\n\"setup_sums\": [\n{}\n]}}\n",
        lines.join(",\n"),
        setup_sums::lines().join(",\n")
    );
    serde_json::from_str::<serde_json::Value>(&text).expect("valid JSON");
    check_or_update(VECTORS, &text);
}

#[test]
fn the_largest_messages_fit() {
    let bound = |path: &str| match path.rsplit('.').next() {
        Some("Groups") => MAX_GROUPS,
        Some("values" | "widths" | "amplitudes" | "widths_us" | "forces_mn" | "force_control") => {
            CHANNELS
        }
        Some("pulses") => MAX_LISTED,
        Some("flexors") => 2,
        Some("joints") => JOINTS,
        Some("vias") => VIAS,
        Some("field") => 250,
        Some("board") => BOARD_NAME,
        _ => panic!("how long is {path}?"),
    };
    for t in directions() {
        let length = schema::longest(t, "", &bound);
        println!("{}: at most {length} bytes", t.name);
        assert!(length <= MAX_MESSAGE, "{} has {length} bytes", t.name);
    }
    // The bound on texts covers all that are too long for a name.
    let long = "x".repeat(250);
    let refusal = Refusal {
        code: u16::MAX,
        field: &long,
        channel: Some(u8::MAX),
        min: i32::MIN,
        max: i32::MIN,
    };
    let seq = Some(u16::MAX);
    assert!(encode(&Response::Refused { seq, refusal }).is_some());
}

/// Returns `text` with the first table below each heading of the form "### `Name`" replaced by that
/// of the type, and the names of the headings.
fn with_tables(text: &str, protocol: &Protocol) -> (String, BTreeSet<String>) {
    let mut names = BTreeSet::new();
    let (mut out, mut wanted, mut is_inside) = (String::new(), None, false);
    for line in text.lines() {
        if line.starts_with('#') {
            let heading = line.strip_prefix("### `").and_then(|l| l.strip_suffix('`'));
            wanted = heading.map(str::to_owned);
        }
        let is_row = line.starts_with('|');
        if is_row && let Some(name) = wanted.take() {
            let described = protocol.types.get(&name);
            let described = described.unwrap_or_else(|| panic!("{name} is not on the link"));
            out += &described.to_markdown();
            names.insert(name);
            is_inside = true;
        }
        is_inside &= is_row;
        if !is_inside {
            out += line;
            out += "\n";
        }
    }
    (out, names)
}

#[test]
fn the_tables_of_protocol_md_are_those_of_the_described_protocol() {
    let protocol = describe().expect("the program's own files");
    let (text, names) = with_tables(&read(PROTOCOL), &protocol);
    check_or_update(PROTOCOL, &text);
    let known: BTreeSet<String> = protocol.types.keys().cloned().collect();
    assert_eq!(names, known, "types with a table, types on the link");
    for fault in (1..=24).filter_map(Fault::from_number) {
        let (place, number) = (fault.number() - 1, fault.number());
        let row = format!("| {place} | `{fault:?}` | – | fault {number}:");
        assert!(text.contains(&row), "protocol.md has no row {row}");
    }
}

fn codes() -> String {
    let mut table = String::from("| No. | Name | Meaning | What to do |\n|---|---|---|---|\n");
    for code in Code::ALL {
        let (number, explanation, advice) = (code as u16, meaning(code), advice(code));
        table += &format!("| {number} | `{code:?}` | {explanation} | {advice} |\n");
    }
    table
}

#[test]
fn protocol_md_s_blocks_are_what_the_code_makes() {
    let mut text = read(PROTOCOL);
    let blocks = [
        ("schema", format!("`{SCHEMA:#018x}`\n")),
        ("codes", codes()),
        ("session", session::transcript()),
    ];
    for (name, block) in blocks {
        let (begin, end) = (
            format!("<!-- {name}:begin -->\n"),
            format!("<!-- {name}:end -->"),
        );
        let from = text.find(&begin).unwrap_or_else(|| panic!("no {begin}")) + begin.len();
        let to = text.find(&end).unwrap_or_else(|| panic!("no {end}"));
        text.replace_range(from..to, &format!("\n{block}\n"));
    }
    check_or_update(PROTOCOL, &text);
}

#[test]
fn the_example_client_names_this_schema() {
    let text = read(CLIENT);
    let begin = "\nSCHEMA = 0x";
    let from = text.find(begin).expect("a schema") + begin.len();
    let mut new = text.clone();
    new.replace_range(from..from + 16, &format!("{SCHEMA:016X}"));
    check_or_update(CLIENT, &new);
}
