//! Splits a page into its elements, attributes and entities.

use super::{EVIL, HARMLESS};
use std::collections::BTreeSet;

/// Returns the elements of a page, each with the names of its attributes, and its entities.
pub fn parts(page: &str) -> BTreeSet<String> {
    let mut parts = BTreeSet::new();
    let mut rest = page;
    while let Some(at) = rest.find(['<', '&']) {
        let found = &rest[at..];
        if let Some(entity) = found.strip_prefix('&') {
            let end = found.find(';').unwrap_or(1);
            parts.insert(found[..=end.min(8)].to_owned());
            rest = entity;
            continue;
        }
        let (tag, end) = element(found);
        let is_style = tag.starts_with("style");
        parts.insert(tag);
        rest = &found[end..];
        if is_style {
            rest = &rest[rest.find("</style").expect("a style ends")..];
        }
    }
    parts
}

/// Returns an element's name with the names of its attributes, and its end.
fn element(text: &str) -> (String, usize) {
    let (mut quote, mut name, mut is_value) = (None, String::new(), false);
    for (at, letter) in text.char_indices().skip(1) {
        match (quote, letter) {
            (Some(open), _) if open == letter => (quote, is_value) = (None, false),
            (None, '"' | '\'') if is_value => quote = Some(letter),
            (None, '>') => return (name, at + 1),
            (None, '=') => is_value = true,
            (None, ' ' | '\n') => {
                is_value = false;
                name.push(' ');
            }
            (None, _) if !is_value => name.push(letter),
            _ => {}
        }
    }
    (name, text.len())
}

#[test]
fn what_is_looked_for_is_found() {
    let page = |text: &str| format!("<p class=\"a b\" id=x>{text}</p><style>a>b</style>");
    let clean = parts(&page(HARMLESS));
    let wanted = ["p class id", "/p", "style", "/style"];
    assert_eq!(clean, wanted.map(str::to_owned).into());
    for part in [
        "script",
        "flexor-evil onflexor",
        "img src onerror",
        "&flexor;",
    ] {
        assert!(parts(&page(EVIL)).contains(part), "{part}");
    }
    let inside = format!("<p title=\"{EVIL}\">");
    assert!(parts(&inside).contains("img src onerror"));
}
