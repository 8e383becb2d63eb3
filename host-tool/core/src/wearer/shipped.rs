//! The wearers that are part of the program.

/// File name and text of each of `host-tool/wearers`.
pub const SHIPPED: [(&str, &str); 0] = [];

/// The text of the shipped wearer file of this name, with or without `.toml`.
#[must_use]
pub fn shipped(name: &str) -> Option<&'static str> {
    let name = name.strip_suffix(".toml").unwrap_or(name);
    let is = |file: &str| file.strip_suffix(".toml") == Some(name);
    let found = SHIPPED.iter().find(|(file, _)| is(file));
    found.map(|(_, text)| *text)
}
