//! The schema of session files: the committed schema, agreement with the parser, and rules that
//! only the parser checks.

use std::path::{Path, PathBuf};

use hal_sim::random::Random;
use host_core::session::{Session, SessionError, manual, schema};
use jsonschema::Validator;
use serde_json::Value;

use crate::session_files::files;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Compares a generated text with the committed file, or with `FLEXOR_OVERWRITE` replaces it.
pub(crate) fn as_committed(path: &Path, made: &str) {
    if std::env::var_os("FLEXOR_OVERWRITE").is_some() {
        return std::fs::write(path, made).unwrap();
    }
    let committed = std::fs::read_to_string(path).unwrap_or_default();
    let renew = "FLEXOR_OVERWRITE=1 cargo test -p host-core --test suite session_schema";
    assert!(committed == made, "{} is stale: {renew}", path.display());
}

#[test]
fn the_schema_is_as_committed() {
    let made = serde_json::to_string_pretty(&schema()).unwrap() + "\n";
    as_committed(&root().join("host-tool/sessions/schema.json"), &made);
}

/// Every table of docs/reference/sessions.md below `<!-- fields: PATH -->` is generated from the field
/// declarations.
#[test]
fn the_manual_tells_the_declared_fields() {
    let path = root().join("docs/reference/sessions.md");
    let (made, tables) = with_tables(&path, "file", manual);
    assert!(tables >= 20, "{tables} tables");
    as_committed(&path, &made);
}

/// Returns a page with regenerated tables below `<!-- fields: PATH -->`, and their number; `root`
/// is the path of the whole file there.
pub(crate) fn with_tables(
    path: &Path,
    root: &str,
    manual: fn(&str) -> Option<String>,
) -> (String, usize) {
    let text = std::fs::read_to_string(path).unwrap();
    let (mut made, mut tables) = (String::new(), 0);
    let mut lines = text.split_inclusive('\n').peekable();
    while let Some(line) = lines.next() {
        made += line;
        let mark = line.trim_end().strip_prefix("<!-- fields: ");
        if let Some(at) = mark.and_then(|mark| mark.strip_suffix(" -->")) {
            while lines.next_if(|line| line.starts_with('|')).is_some() {}
            let at = at.strip_prefix(root).unwrap_or(at);
            made += &manual(at).unwrap_or_else(|| panic!("no table {at}"));
            tables += 1;
        }
    }
    (made, tables)
}

/// Converts a TOML file to JSON for the schema.
fn json(document: &toml::Table) -> Value {
    serde_json::to_value(document).unwrap()
}

fn shipped() -> Vec<(PathBuf, String, toml::Table)> {
    let files = files().into_iter();
    let read = files.map(|path| {
        let text = std::fs::read_to_string(&path).unwrap();
        let document = text.parse().unwrap();
        (path, text, document)
    });
    read.collect()
}

fn validator() -> Validator {
    jsonschema::draft7::new(&schema()).unwrap()
}

#[test]
fn every_shipped_file_names_and_keeps_the_schema() {
    let validator = validator();
    for (path, text, document) in shipped() {
        let named = text.lines().find_map(|line| line.strip_prefix("#:schema "));
        let found = path.parent().unwrap().join(named.expect("a schema"));
        assert!(found.is_file(), "{}", path.display());
        let wrong: Vec<String> = validator
            .iter_errors(&json(&document))
            .map(|e| format!("{} {e}", e.instance_path()))
            .collect();
        assert_eq!(wrong, [""; 0], "{}", path.display());
    }
}

/// Kind of a mutation of one field.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Kind {
    Key,
    Type,
    Choice,
    Range,
}

/// Collects every field of a document that is no table, with its path and its schema.
fn leaves(value: &toml::Value, schema: &Value, path: &str, entries: &mut Vec<(String, Value)>) {
    match value {
        toml::Value::Table(table) => {
            for (name, value) in table {
                let schema = &schema["properties"][name];
                leaves(value, schema, &format!("{path}/{name}"), entries);
            }
        }
        toml::Value::Array(list) => {
            for (place, value) in list.iter().enumerate() {
                leaves(value, &schema["items"], &format!("{path}/{place}"), entries);
            }
        }
        _ => entries.push((path.to_owned(), schema.clone())),
    }
}

/// Returns the parent of the field at a path, and the field's name.
fn at<'d>(document: &'d mut toml::Value, path: &str) -> (&'d mut toml::Value, String) {
    let (parent, name) = path.rsplit_once('/').unwrap();
    let parts = parent.split('/').skip(1);
    let holder = parts.fold(document, |value, part| match value {
        toml::Value::Array(list) => &mut list[part.parse::<usize>().unwrap()],
        other => &mut other[part],
    });
    (holder, name.to_owned())
}

/// Returns `document` with one field mutated in this way, or `None` if it has no such field.
fn spoilt(
    document: &toml::Table,
    kind: Kind,
    random: &mut Random,
) -> Option<(String, toml::Table)> {
    let mut value = toml::Value::Table(document.clone());
    let mut entries = Vec::new();
    leaves(&value, &schema(), "", &mut entries);
    entries.retain(|(path, schema)| match kind {
        Kind::Key => !path.ends_with(|c: char| c.is_ascii_digit()),
        Kind::Type => !schema["description"].is_null(),
        Kind::Choice => !schema["enum"].is_null(),
        Kind::Range => !schema["maximum"].is_null(),
    });
    let (path, schema) = entries
        .get(random.below(entries.len().max(1) as u64) as usize)?
        .clone();
    let (holder, name) = at(&mut value, &path);
    if let (Kind::Key, Some(table)) = (kind, holder.as_table_mut()) {
        let field = table.remove(&name)?;
        table.insert(format!("{name}x"), field);
    } else {
        let field = match holder {
            toml::Value::Array(list) => &mut list[name.parse::<usize>().unwrap()],
            table => &mut table[&name],
        };
        *field = match (kind, &field) {
            (Kind::Choice, _) => "no-such-choice".into(),
            (Kind::Range, _) if random.below(2) == 0 => (schema["minimum"].as_f64()? - 1.0).into(),
            (Kind::Range, _) => (schema["maximum"].as_f64()? + 1.0).into(),
            (_, toml::Value::String(_)) => 7.into(),
            _ => "seven".into(),
        };
    }
    let toml::Value::Table(document) = value else {
        return None;
    };
    Some((format!("{kind:?} of {path}"), document))
}

fn numbers(e: &SessionError) -> Vec<u16> {
    e.errors().map(|e| e.problem().number()).collect()
}

/// 90 single mutations of a field: both the schema and the parser refuse each, and the parser names
/// the field itself instead of a consequence.
#[test]
fn ninety_mistakes_within_a_field_are_refused_by_schema_and_reader() {
    let (validator, shipped) = (validator(), shipped());
    let mut random = Random::new(12);
    let mut made = 0;
    while made < 90 {
        let kind = [Kind::Key, Kind::Type, Kind::Choice, Kind::Range][made % 4];
        let (path, _, document) = &shipped[random.below(shipped.len() as u64) as usize];
        let Some((edit, bad)) = spoilt(document, kind, &mut random) else {
            continue;
        };
        made += 1;
        let description = format!("{edit} in {}", path.display());
        let is_valid = validator.is_valid(&json(&bad));
        assert!(!is_valid, "the schema accepts {description}");
        let text = toml::to_string(&bad).unwrap();
        let Err(e) = Session::parse("bad.toml", &text) else {
            panic!("the reader accepts {description}");
        };
        let numbers = numbers(&e);
        assert_eq!(numbers.len(), 1, "{description}: {}", e.lines());
        assert!(
            (402..=408).contains(&numbers[0]),
            "{description}: {numbers:?}"
        );
    }
}

/// Mistakes between fields: file, text, replacement, and error number.
#[rustfmt::skip]
const BETWEEN: [(&str, &str, &str, u16); 10] = [
    ("hamana_exp4_two_point_finger.toml", "max_current_ma = 20.0", "max_current_ma = 15.0", 450),
    ("hamana_exp4_two_point_finger.toml", "extensor = { channel = 3,", "extensor = { channel = 1,", 420),
    ("hamana_exp4_two_point_finger.toml", "rate_hz = 90", "rate_hz = 10", 462),
    ("hamana_exp4_two_point_finger.toml", "from_s = 10.0\nto_s = 30.0", "from_s = 10.0\nto_s = 9.0", 410),
    ("hamana_exp4_two_point_finger.toml", "amplitude_deg = 40.0", "amplitude_deg = 80.0", 407),
    ("hamana_exp4_two_point_finger.toml", "channels = [1, 2]", "channels = [1, 4]", 421),
    ("force_ramp.toml", "n = 12.0", "n = 120.0", 470),
    ("ten_channels.toml", "number = 2\n", "number = 1\n", 420),
    ("trigger.toml", "every_s = 1.0", "every_s = 99.0", 407),
    ("harris_wall/3_pre_wall_co_contraction.toml", "depth_deg = 9.0", "depth_deg = 9.0, end = 81.0", 407),
];

#[test]
fn ten_mistakes_between_parts_are_left_to_the_reader() {
    let validator = validator();
    for (file, find, replace, number) in BETWEEN {
        let text = std::fs::read_to_string(root().join("host-tool/sessions").join(file)).unwrap();
        assert!(text.contains(find), "{file}: {find}");
        let bad = text.replacen(find, replace, 1);
        let is_valid = validator.is_valid(&json(&bad.parse().unwrap()));
        assert!(is_valid, "{file}: {replace}");
        let e = Session::parse(file, &bad).unwrap_err();
        let is_told = numbers(&e).contains(&number);
        assert!(is_told, "{file}: {replace}: {}", e.lines());
    }
}

#[test]
fn six_mistakes_of_one_file_are_told_in_one_run() {
    let path = root().join("host-tool/sessions/hamana_exp4_two_point_finger.toml");
    let mut text = std::fs::read_to_string(path).unwrap();
    let mistakes = [
        ("rise_ms = 200", "rise_ms = 20_000", 407),
        ("load_ohm = 2000", "load_ohm = \"2000\"", 403),
        ("limit = 36.0", "limit = 36.0005", 405),
        ("partner = \"conducted\"", "partner = \"conductive\"", 408),
        ("sensor = \"adc\"", "senzor = \"adc\"", 402),
        ("to_s = 30.0", "to_s = 31.0", 407),
    ];
    for (find, replace, number) in mistakes {
        assert!(text.contains(find), "{find}: {number}");
        text = text.replacen(find, replace, 1);
    }
    let e = Session::parse("six.toml", &text).unwrap_err();
    insta::assert_snapshot!(e.lines());
    let mut problem_numbers = numbers(&e);
    problem_numbers.sort_unstable();
    assert_eq!(problem_numbers, [402, 403, 405, 407, 407, 408]);
}
