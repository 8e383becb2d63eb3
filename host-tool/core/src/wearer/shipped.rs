//! The built-in wearers, which are part of the program.

macro_rules! wearers {
    ($($name:literal)*) => {
        [$((concat!($name, ".toml"), include_str!(concat!("../../../wearers/", $name, ".toml")))),*]
    };
}

/// File name and text of each wearer file in `host-tool/wearers`.
pub const SHIPPED: [(&str, &str); 17] = wearers![
    "K01" "K02" "K03" "K04" "K05" "K06" "K07" "K08" "K09" "K10"
    "P" "Q" "R" "S"
    "harris-1" "harris-2" "arm-1"
];

/// Returns the text of the built-in wearer file with this name (with or without `.toml`), or `None`
/// if there is none.
#[must_use]
pub fn builtin_wearer(name: &str) -> Option<&'static str> {
    let name = name.strip_suffix(".toml").unwrap_or(name);
    let is = |file: &str| file.strip_suffix(".toml") == Some(name);
    let found = SHIPPED.iter().find(|(file, _)| is(file));
    found.map(|(_, text)| *text)
}
