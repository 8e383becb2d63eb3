//! Layers of modules: calls go downwards only, and no two files depend on each other.
//!
//! A file depends on another if it names an item that is defined there; re-exported names (`pub
//! use`) count for the file that defines them. Items in a module's own `mod.rs` may be used by all
//! its files.

mod names;

use super::Findings;
use super::source::Source;
use names::{Module, Needs, Package};
use std::collections::{BTreeMap, BTreeSet};

/// Modules of each package, each above all that follow it. Modules in one entry are in the same
/// layer: neither calls the other. `""` is the package's root. A submodule may have a layer of its
/// own: `module::submodule`.
#[rustfmt::skip]
const LAYERS: &[(&str, &[&[&str]])] = &[
    ("firmware", &[&["board"], &["bench"], &["lockstep"], &["device"], &["link"], &["haptics"], &["control"], &["limb"], &["muscle"], &["safety"], &["pulse"], &["arithmetic", "board::wiring", "crc", "range", "seal", "units"]]),
    ("hal-sim", &[&["chip", "qemu"], &["world"], &["native"], &["lockstep"], &["body", "images", "trace", "wire"], &["input", "random"]]),
    ("host-tool", &[&["cli"], &["live", "protocol", "selftest"]]),
    ("host-tool/core", &[&["drive", "models"], &["calibration", "choice", "report", "search"], &["run"], &["analysis"], &["record"], &["session"], &["wearer"], &["disk", "fields", "link", "plot"], &["clock", "identify", "limb", "number", "statistics", "suggestion"]]),
    ("host-tool/dfu", &[&["usb"], &["simulated"], &["flash"], &["protocol"], &["chip", "container"], &["ids"]]),
    ("host-tool/hil", &[&["merge"], &["fit", "plan", "synthesise"], &["capture", "expected"], &["line"]]),
    ("host-tool/methods", &[&["bench"], &["control", "muscle"], &["real"]]),
    ("host-tool/python", &[&["benchmark", "device", "procedures"], &["open"], &["models", "statistics"], &["runner", "session", "setpoints"], &["body", "record", "supervise"], &["convert", "errors"]]),
    ("host-tool/studies", &[&["experiments", "faults", "figures"], &["catalog"], &["wearer_files"], &["detail", "hands"], &["buatier2024", "distributed", "hamana2022", "harris2017", "lee2020", "sierotowicz2023"], &["accuracy", "flags", "laboratory", "ladder", "limb", "stability"], &["tracking"], &["bench", "subjects"]]),
    ("tests", &[&["differential", "expectation", "fuzz", "verify"], &["desk", "record"]]),
];

/// Returns both rules with their violations.
pub(super) fn judge(sources: &[Source]) -> [(&'static str, Findings); 2] {
    let (mut calls, mut circles) = (Findings::new(), Findings::new());
    for (name, layers) in LAYERS {
        let needs = Package::read(name, sources).needs();
        calls.extend(upward_calls(name, layers, &needs));
        circles.extend(circular_needs(name, &needs));
    }
    [
        ("a module calls only modules below it", calls),
        ("no two files depend on each other", circles),
    ]
}

/// Returns calls between modules that do not go down, and modules without a layer.
fn upward_calls(name: &str, layers: &[&[&str]], needs: &Needs) -> Findings {
    let depth = |room: &str| layers.iter().position(|rooms| rooms.contains(&room));
    let room = |module: &Module| -> Option<String> {
        let inner = module.get(..2).map(|names| names.join("::"));
        let inner = inner.filter(|names| depth(names).is_some());
        inner.or_else(|| module.first().cloned())
    };
    let mut found = Findings::new();
    let mut lost = BTreeSet::new();
    for (from, needed) in needs {
        for (to, place) in needed {
            let (Some(a), Some(b)) = (room(from), room(to)) else {
                continue;
            };
            match (depth(&a), depth(&b)) {
                (Some(above), Some(below)) if a == b || above < below => {}
                (Some(_), Some(_)) => found.push(format!("{place}: {a} calls {b}")),
                (None, _) => drop(lost.insert(a)),
                (_, None) => drop(lost.insert(b)),
            }
        }
    }
    let lost = lost.into_iter();
    found.extend(lost.map(|room| format!("{name}: `{room}` has no layer")));
    found
}

/// Returns files that depend on each other, directly or indirectly, one line per cycle.
fn circular_needs(name: &str, needs: &Needs) -> Findings {
    let reach = needs
        .keys()
        .map(|from| (from, reachable_modules(from, needs)));
    let reach: BTreeMap<_, _> = reach.collect();
    let mut found = BTreeSet::new();
    for (from, all) in reach.iter().filter(|(from, all)| all.contains(*from)) {
        let is_back = |to: &&&Module| reach.get(*to).is_some_and(|back| back.contains(from));
        let names = all.iter().filter(is_back).map(|module| module.join("::"));
        found.insert(format!("{name}: {}", names.collect::<Vec<_>>().join(", ")));
    }
    found.into_iter().collect()
}

/// Returns the direct and indirect dependencies of `from`.
fn reachable_modules<'a>(from: &'a Module, needs: &'a Needs) -> BTreeSet<&'a Module> {
    let mut reached = BTreeSet::new();
    let mut open: Vec<&Module> = vec![from];
    while let Some(module) = open.pop() {
        let next = needs.get(module).into_iter().flat_map(BTreeMap::keys);
        open.extend(next.filter(|to| reached.insert(*to)));
    }
    reached
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sources(files: &[(&str, &str)]) -> Vec<Source> {
        let source = |(path, text): &(&str, &str)| Source::new(path, (*text).to_owned());
        files.iter().map(source).collect()
    }

    fn broken(files: &[Source]) -> [Findings; 2] {
        judge(files).map(|(_, findings)| findings)
    }

    #[test]
    fn a_call_upward_is_found_with_its_line() {
        let files = sources(&[
            ("firmware/src/lib.rs", "pub mod device;\npub mod pulse;\n"),
            (
                "firmware/src/device.rs",
                "use crate::pulse::Train;\npub struct Device(Train);",
            ),
            (
                "firmware/src/pulse.rs",
                "pub struct Train;\nfn f() { crate::device::Device; }",
            ),
        ]);
        let [calls, circles] = broken(&files);
        assert_eq!(calls, ["firmware/src/pulse.rs:2: pulse calls device"]);
        assert_eq!(circles, ["firmware: device, pulse"]);
    }

    #[test]
    fn names_are_followed_to_where_they_are_defined() {
        let files = sources(&[
            ("firmware/src/lib.rs", "pub mod pulse;"),
            (
                "firmware/src/pulse/mod.rs",
                "mod a; mod b; pub use a::{A, Other as Named};",
            ),
            (
                "firmware/src/pulse/a.rs",
                "use super::b;\npub struct A; pub struct Other; fn f() { b::g() }",
            ),
            (
                "firmware/src/pulse/b.rs",
                "use super::Named;\npub fn g() {}",
            ),
        ]);
        let pair = vec!["firmware: pulse::a, pulse::b".to_owned()];
        assert_eq!(broken(&files), [vec![], pair]);
    }

    #[test]
    fn a_room_s_files_may_use_what_the_room_says_and_tests_anything() {
        let files = sources(&[
            ("firmware/src/lib.rs", "pub mod pulse; pub mod device;"),
            ("firmware/src/device.rs", "pub struct Device;"),
            (
                "firmware/src/pulse/mod.rs",
                "mod a; pub struct Room; fn f() { a::g() }",
            ),
            (
                "firmware/src/pulse/a.rs",
                "use super::Room; pub fn g() {}\n#[cfg(test)]\nmod tests { use crate::device::Device; }",
            ),
        ]);
        assert_eq!(broken(&files), [Findings::new(), Findings::new()]);
    }

    #[test]
    fn a_module_inside_a_room_may_have_a_layer_of_its_own() {
        let files = sources(&[
            ("firmware/src/lib.rs", "pub mod board; pub mod pulse;"),
            ("firmware/src/board/mod.rs", "pub mod wiring; pub mod chip;"),
            (
                "firmware/src/board/chip.rs",
                "use crate::pulse::Train;\nuse super::wiring::Pin;\npub struct Chip(Train, Pin);",
            ),
            (
                "firmware/src/board/wiring/mod.rs",
                "use crate::pulse::Train;\npub struct Pin(Train);",
            ),
            (
                "firmware/src/pulse.rs",
                "pub struct Train;\nfn f() { crate::board::wiring::Pin; crate::board::chip::Chip; }",
            ),
        ]);
        let [calls, _] = broken(&files);
        let upward = [
            "firmware/src/board/wiring/mod.rs:1: board::wiring calls pulse",
            "firmware/src/pulse.rs:2: pulse calls board",
        ];
        assert_eq!(calls, upward);
    }

    #[test]
    fn a_room_without_a_layer_is_named() {
        let files = sources(&[
            ("hal-sim/src/lib.rs", "mod new; mod trace;"),
            ("hal-sim/src/new.rs", "use crate::trace::Trace;"),
            ("hal-sim/src/trace.rs", "pub struct Trace;"),
        ]);
        let [calls, _] = broken(&files);
        assert_eq!(calls, ["hal-sim: `new` has no layer"]);
    }
}
