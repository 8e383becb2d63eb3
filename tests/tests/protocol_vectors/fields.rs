//! Values of `Refusal::field`: every text that the device code, or its server, uses there is a
//! field of a table of protocol.md, or in its list.

use super::{PROTOCOL, read, types};
use std::collections::BTreeSet;
use std::path::Path;

/// Texts that follow one of these, apart from white space, are fields of refusals.
const BEFORE: [&str; 2] = ["Range::new(", "field:"];

fn sources(folder: &Path, texts: &mut Vec<String>) {
    for entry in std::fs::read_dir(folder).expect("the device code") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            sources(&path, texts);
        } else if path.extension().is_some_and(|e| e == "rs") {
            let text = std::fs::read_to_string(&path).expect("text");
            // Refusals in test code are no answers.
            texts.push(text.split("#[cfg(test)]").next().unwrap_or("").to_owned());
        }
    }
}

/// Returns the text literal at the start of `rest`.
fn literal(rest: &str) -> Option<&str> {
    rest.trim_start().strip_prefix('"')?.split('"').next()
}

/// Returns the fields that the code names.
fn named() -> BTreeSet<String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../firmware/src");
    let mut texts = Vec::new();
    for room in [
        "device", "link", "control", "haptics", "limb", "muscle", "pulse", "safety",
    ] {
        sources(&root.join(room), &mut texts);
    }
    // Includes the refusals of `flexor serve` in place of a device.
    let serving = root.join("../../host-tool/src/cli/serve/mod.rs");
    texts.push(std::fs::read_to_string(serving).expect("text"));
    let mut fields = BTreeSet::new();
    for text in &texts {
        for before in BEFORE {
            let rests = text.split(before).skip(1);
            fields.extend(rests.filter_map(literal).map(str::to_owned));
        }
        // `Refusal::new(Code::X, "field")`, on any number of lines.
        for rest in text.split("::new(").skip(1) {
            let inside = rest.trim_start();
            if inside.starts_with("Code::") || inside.starts_with("code,") {
                let second = inside.split_once(',').map_or("", |(_, second)| second);
                fields.extend(literal(second).map(str::to_owned));
            }
        }
    }
    // Includes the names of a setup's parts.
    let parts = std::fs::read_to_string(root.join("device/mistake.rs")).expect("text");
    let names = parts.split("=>").filter_map(literal);
    fields.extend(names.map(str::to_owned));
    // Includes a name alone on its line, in the list of refusals.
    let refusal = std::fs::read_to_string(root.join("link/refusal/mod.rs")).expect("text");
    let alone = refusal.lines().filter_map(|l| l.trim().strip_suffix("\","));
    fields.extend(alone.filter_map(|l| l.strip_prefix('"')).map(str::to_owned));
    fields
}

#[test]
fn every_field_that_a_refusal_may_name_is_told() {
    let text = read(PROTOCOL);
    let list = text
        .split_once("<!-- fields:begin -->")
        .and_then(|(_, rest)| rest.split_once("<!-- fields:end -->"))
        .expect("a list of fields")
        .0;
    let listed: BTreeSet<String> = list
        .lines()
        .filter_map(|line| Some(line.strip_prefix("| `")?.split_once('`')?.0.to_owned()))
        .filter(|name| name != "field")
        .collect();
    let mut of_tables = BTreeSet::new();
    for (_, rows) in types() {
        for (name, carries) in rows {
            of_tables.insert(name);
            // A variant carries "name: type, name: type".
            let carried = carries.split(", ").filter_map(|c| c.split_once(": "));
            of_tables.extend(carried.map(|(name, _)| name.to_owned()));
        }
    }
    let fields = named();
    println!("{} fields: {fields:?}", fields.len());
    assert!(fields.len() > 80, "the code is read another way");
    let untold: Vec<&String> = fields
        .iter()
        .filter(|f| !of_tables.contains(*f) && !listed.contains(*f))
        .collect();
    assert!(untold.is_empty(), "protocol.md does not tell {untold:?}");
    let unused: Vec<&String> = listed.iter().filter(|f| !fields.contains(*f)).collect();
    assert!(unused.is_empty(), "nothing names {unused:?}");
}
