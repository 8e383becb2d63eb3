//! Rules of the project that no compiler checks, one check each, on plain source text.
//!
//! In: the working tree. Out: violations as `file:line`.

mod empty_comments;
mod evidence;
mod layers;
mod modules;
mod source;
mod words;

use super::report::Report;
pub(super) use source::Source;
use source::find_word;
use std::iter;
use std::path::Path;

/// Number of lines above which a file is reported as long.
const LONG_LINES: usize = 400;
/// Largest number of lines of a file of the product.
const TOO_LONG_LINES: usize = 450;
/// Largest number of lines of a test file.
const TOO_LONG_TEST_LINES: usize = 600;

/// Files and folders without sources of this project.
const FOREIGN: [&str; 4] = [".git", "target", "out", "artifacts"];

const BOARD: &str = "firmware/src/board/";
const METHODS: &str = "host-tool/methods/src/";
const IMAGES: &str = "firmware/src/bin/";

/// Files of `hal-sim` and `host-core` that may read a clock: each is behind a feature. The packages
/// run in a browser without them, where the standard library's clock panics.
const CLOCKS: [&str; 6] = [
    "hal-sim/src/qemu.rs",
    "hal-sim/src/wire/byte_stream.rs",
    "hal-sim/src/wire/tcp.rs",
    "host-tool/core/src/clock/system.rs",
    "host-tool/core/src/link/elapsed.rs",
    "host-tool/core/src/link/paced.rs",
];

/// Calls that can panic.
const PANICS: [&str; 6] = [
    ".unwrap()",
    ".expect(",
    "panic!",
    "todo!",
    "unimplemented!",
    "unreachable!",
];

/// Places at which a file breaks a rule.
type Findings = Vec<String>;

/// Statement of a rule, and the function that checks it.
type Rule = (&'static str, fn(&Source) -> Findings);

#[rustfmt::skip]
const RULES: [Rule; 10] = [
    ("`unsafe` is used only in board code and CoreMark", unsafe_elsewhere),
    ("device code cannot panic; boards and images need a comment that proves it", panics),
    ("the pulse path uses no floating point", floats),
    ("`body` and `trace` of hal-sim do not use the firmware", dependent_simulator),
    ("no source file has more than 450 lines, no test file more than 600", too_long),
    ("no absolute path of one computer is committed", machine_paths),
    ("tests draw their random inputs from the committed seed", own_seeds),
    ("simulators and sessions read a clock only behind a Cargo feature", clocks),
    ("no comment merely repeats the name and type below it", empty_comments::judge),
    ("what is simulated computes functions with libm, equal on every system", system_functions),
];

/// Statement of the rule on orphan files, which needs all files.
const NO_FILE_IS_LOST: &str = "every source file belongs to a program, every test file to a suite";

/// Statement of the rule on words, for trees that have the list of words.
const WORDS_ARE_THE_FIELDS: &str = "no word of docs/words.toml is used";

/// Statement of the rule on evidence, for trees that have the safety page.
const EVIDENCE_IS_THERE: &str = "all evidence that docs/how/safety.md names exists";

/// Checks every rule on every file under `root`.
pub(super) fn run(root: &Path) -> anyhow::Result<Report> {
    let sources = sources(root)?;
    let mut report = judge(&sources);
    report.add(rule_report(
        EVIDENCE_IS_THERE,
        &evidence::missing_evidence(&sources),
    ));
    Ok(report)
}

/// Reads every text file under `root`.
pub(super) fn sources(root: &Path) -> anyhow::Result<Vec<Source>> {
    let mut sources = Vec::new();
    read(root, root, &mut sources)?;
    Ok(sources)
}

fn judge(sources: &[Source]) -> Report {
    let mut report = Report::default();
    let results = RULES.map(|(statement, broken)| {
        let findings: Findings = sources.iter().flat_map(broken).collect();
        (statement, findings)
    });
    let lost = (NO_FILE_IS_LOST, modules::orphan_files(sources));
    let unwanted = (WORDS_ARE_THE_FIELDS, words::judge(sources));
    let wide = [lost, unwanted].into_iter().chain(layers::judge(sources));
    for (statement, findings) in results.into_iter().chain(wide) {
        report.add(rule_report(statement, &findings));
    }
    for source in sources.iter().filter(|s| s.is_rust()) {
        let count = source.text.lines().count();
        if (LONG_LINES + 1..=max_lines(source)).contains(&count) {
            let note = format!("note: {} has {count} lines: split it?", source.path);
            report.lines.push(note);
        }
    }
    report
}

/// Returns whether a rule holds, with its violations.
fn rule_report(statement: &str, findings: &[String]) -> Report {
    if findings.is_empty() {
        return Report::pass();
    }
    let lines = findings.iter().map(|finding| format!("  {finding}"));
    let heading = iter::once(format!("broken rule: {statement}"));
    Report::fail(heading.chain(lines).collect())
}

/// Reads every text file below `folder`, in the order of names.
fn read(root: &Path, folder: &Path, sources: &mut Vec<Source>) -> anyhow::Result<()> {
    let mut entries: Vec<_> = std::fs::read_dir(folder)?.collect::<Result<_, _>>()?;
    entries.sort_by_key(std::fs::DirEntry::file_name);
    for entry in entries {
        let path = entry.path();
        let kind = entry.file_type()?;
        if FOREIGN.iter().any(|name| entry.file_name() == *name) {
            continue;
        }
        if kind.is_dir() {
            read(root, &path, sources)?;
        } else if kind.is_file()
            && let Ok(text) = String::from_utf8(std::fs::read(&path)?)
        {
            let path = path.strip_prefix(root)?.to_string_lossy();
            sources.push(Source::new(&path.replace('\\', "/"), text));
        }
    }
    Ok(())
}

/// Separate image with a few lines of board code: an allocator and registers.
const COREMARK: &str = "tests/coremark/src/";

/// C interface of the page, which exports functions and has no `unsafe` block.
const C_INTERFACE: &str = "host-tool/web/src/lib.rs";

fn unsafe_elsewhere(source: &Source) -> Findings {
    let is_board = source.path.starts_with(BOARD) || source.path.starts_with(COREMARK);
    if !source.is_rust() || is_board {
        return Vec::new();
    }
    let is_export = |at: &usize| {
        source.path == C_INTERFACE && source.code[*at..].starts_with("unsafe(no_mangle)")
    };
    let found = find_word(&source.code, "unsafe").into_iter();
    source.places(found.filter(|at| !is_export(at)).collect())
}

/// Returns panics in images and boards without a comment on the same line or the line above; such a
/// comment must prove that the panic cannot happen.
fn panics(source: &Source) -> Findings {
    let is_device = |room| source.path.starts_with(room);
    if !source.is_rust() || !["firmware/src/", METHODS].iter().any(is_device) {
        return Vec::new();
    }
    let may_prove = source.path.starts_with(BOARD) || source.path.starts_with(IMAGES);
    let panics = PANICS
        .iter()
        .flat_map(|panic| source.shipped.match_indices(panic));
    let unproven = |at: &usize| !(may_prove && source.has_comment(*at));
    source.places(panics.map(|(at, _)| at).filter(unproven).collect())
}

fn floats(source: &Source) -> Findings {
    let rooms = ["firmware/src/pulse/", "firmware/src/safety/"];
    if !rooms.iter().any(|room| source.path.starts_with(room)) {
        return Vec::new();
    }
    let found = ["f32", "f64"].map(|float| find_word(&source.shipped, float));
    source.places(found.concat())
}

fn dependent_simulator(source: &Source) -> Findings {
    let rooms = ["hal-sim/src/body", "hal-sim/src/trace"];
    if !source.is_rust() || !rooms.iter().any(|room| source.path.starts_with(room)) {
        return Vec::new();
    }
    source.places(find_word(&source.shipped, "firmware"))
}

fn clocks(source: &Source) -> Findings {
    let rooms = ["hal-sim/src/", "host-tool/core/src/"];
    let is_judged = rooms.iter().any(|room| source.path.starts_with(room));
    if !is_judged || CLOCKS.contains(&&*source.path) {
        return Vec::new();
    }
    let found = ["Instant", "SystemTime", "chrono"].map(|clock| find_word(&source.shipped, clock));
    source.places(found.concat())
}

/// Functions of the standard library whose last bits depend on the system's C library.
#[rustfmt::skip]
const SYSTEM_FUNCTIONS: [&str; 24] = [
    ".exp()", ".exp_m1()", ".exp2()", ".ln()", ".ln_1p()", ".log10()", ".log2()", ".log(",
    ".sin()", ".cos()", ".tan()", ".sin_cos()", ".asin()", ".acos()", ".atan()", ".atan2(",
    ".sinh()", ".cosh()", ".tanh()", ".asinh()", ".acosh()", ".powf(", ".hypot(", ".cbrt()",
];

/// File with theory in complex numbers, which are not simulated.
const COMPLEX: &str = "host-tool/studies/src/stability/describing.rs";

fn system_functions(source: &Source) -> Findings {
    let rooms = [
        "hal-sim/src/",
        "host-tool/core/src/",
        "host-tool/studies/src/",
    ];
    if source.path == COMPLEX || !rooms.iter().any(|room| source.path.starts_with(room)) {
        return Vec::new();
    }
    let found = SYSTEM_FUNCTIONS.iter();
    let found = found.flat_map(|function| source.shipped.match_indices(function));
    source.places(found.map(|(at, _)| at).collect())
}

/// Returns the largest allowed number of lines of a file.
fn max_lines(source: &Source) -> usize {
    match source.is_test() {
        true => TOO_LONG_TEST_LINES,
        false => TOO_LONG_LINES,
    }
}

fn too_long(source: &Source) -> Findings {
    let count = source.text.lines().count();
    if source.is_rust() && count > max_lines(source) {
        vec![format!("{}: {count} lines", source.path)]
    } else {
        Vec::new()
    }
}

/// Returns absolute paths to folders of users or of work.
fn machine_paths(source: &Source) -> Findings {
    let mut found = Vec::new();
    for folder in ["work", "home", "root", "Users"] {
        let path = format!("/{folder}/");
        let is_absolute = |at: &usize| {
            let before = source.text[..*at].chars().next_back();
            before.is_none_or(|c| !(c.is_alphanumeric() || "._-~*}".contains(c)))
        };
        let hits = source.text.match_indices(&path).map(|(at, _)| at);
        found.extend(hits.filter(is_absolute));
    }
    source.places(found)
}

/// Returns places with a fixed seed, which `cargo verify --soak` would not vary, or with a seed
/// file, whose cases would not be run by name.
fn own_seeds(source: &Source) -> Findings {
    let found = [
        "from_seed",
        "new_with_rng",
        "deterministic",
        "failure_persistence",
    ];
    // Excludes this rule and the test that a seed is committed.
    let is_judge = ["tests/src/verify/", "tests/tests/committed_seed.rs"];
    if is_judge.iter().any(|judge| source.path.starts_with(judge))
        || !source.text.contains("proptest")
    {
        return Vec::new();
    }
    source.places(found.map(|own| find_word(&source.code, own)).concat())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn broken(path: &str, text: &str) -> Vec<&'static str> {
        let source = Source::new(path, text.to_owned());
        let broken = RULES.iter().filter(|(_, rule)| !rule(&source).is_empty());
        broken.map(|(statement, _)| *statement).collect()
    }

    #[test]
    fn unsafe_belongs_to_the_board() {
        let block = "fn f() { unsafe { g() } }";
        assert_eq!(broken("hal-sim/src/x.rs", block), [RULES[0].0]);
        assert_eq!(broken("firmware/src/bin/qemu.rs", block), [RULES[0].0]);
        assert!(broken("firmware/src/board/x.rs", block).is_empty());
        assert!(broken("firmware/src/x.rs", "#![deny(unsafe_code)] // unsafe").is_empty());
    }

    #[test]
    fn device_code_panics_only_with_a_proof_on_the_board() {
        for panic in ["a.unwrap();", "b.expect(\"x\");", "panic!();", "todo!()"] {
            assert_eq!(broken("firmware/src/x.rs", panic), [RULES[1].0]);
            assert_eq!(broken("firmware/src/board/x.rs", panic), [RULES[1].0]);
            let proof = format!("// Taken once.\n{panic}");
            assert_eq!(broken("firmware/src/x.rs", &proof), [RULES[1].0]);
            assert!(broken("firmware/src/board/x.rs", &proof).is_empty());
            assert!(broken("host-tool/src/x.rs", panic).is_empty());
            let test = format!("#[cfg(test)]\nmod tests {{ fn f() {{ {panic} }} }}");
            assert!(broken("firmware/src/x.rs", &test).is_empty());
        }
        assert!(broken("firmware/src/x.rs", "a.unwrap_or(1); b.expect_none()").is_empty());
    }

    #[test]
    fn the_pulse_path_counts_in_integers() {
        let found = broken("firmware/src/pulse/x.rs", "let a: f32;");
        assert_eq!(found, [RULES[2].0]);
        assert!(broken("firmware/src/muscle/x.rs", "let a: f32;").is_empty());
    }

    #[test]
    fn simulators_stay_independent() {
        let import = "use firmware::pulse::Train;";
        for path in ["hal-sim/src/body/finger.rs", "hal-sim/src/trace/mod.rs"] {
            assert_eq!(broken(path, import), [RULES[3].0]);
            assert!(broken(path, "// use firmware").is_empty());
        }
        assert!(broken("hal-sim/src/world.rs", import).is_empty());
        assert!(broken("hal-sim/src/trace/check/tests/x.rs", import).is_empty());
    }

    #[test]
    fn property_tests_have_no_seed_of_their_own() {
        let own = "use proptest::test_runner::TestRng; fn f() { TestRng::from_seed(a, &[1; 32]); }";
        assert_eq!(broken("hal-sim/tests/x.rs", own), [RULES[6].0]);
        let kept = "use proptest::prelude::*; const C: C = C { failure_persistence: None };";
        assert_eq!(broken("firmware/src/x.rs", kept), [RULES[6].0]);
        let plain = "use proptest::prelude::*; fn f() { TestRunner::new(config()) }";
        assert!(broken("firmware/tests/x.rs", plain).is_empty());
    }

    #[test]
    fn clocks_are_read_behind_a_feature() {
        let read = "fn f() { std::time::Instant::now(); }";
        assert_eq!(broken("hal-sim/src/world.rs", read), [RULES[7].0]);
        assert_eq!(broken("host-tool/core/src/run/x.rs", read), [RULES[7].0]);
        for path in CLOCKS.into_iter().chain(["host-tool/src/cli/run.rs"]) {
            assert!(broken(path, read).is_empty(), "{path}");
        }
        let test = format!("#[cfg(test)]\nmod tests {{ {read} }}");
        assert!(broken("hal-sim/src/world.rs", &test).is_empty());
    }

    #[test]
    fn functions_of_the_system_are_found_in_what_is_simulated() {
        let read = "fn f(x: f64) -> f64 { x.exp() }";
        for path in ["hal-sim/src/body/x.rs", "host-tool/core/src/run/x.rs"] {
            assert_eq!(broken(path, read), [RULES[9].0]);
            assert!(broken(path, "fn f(x: f64) -> f64 { libm::exp(x) }").is_empty());
        }
        assert!(broken("host-tool/src/cli/run.rs", read).is_empty());
    }

    #[test]
    fn the_c_interface_only_exports() {
        let export = "#[unsafe(no_mangle)] pub extern \"C\" fn f() {}";
        assert!(broken(C_INTERFACE, export).is_empty());
        assert_eq!(broken("hal-sim/src/x.rs", export), [RULES[0].0]);
        assert_eq!(
            broken(C_INTERFACE, "fn f() { unsafe { g() } }"),
            [RULES[0].0]
        );
    }

    #[test]
    fn long_files_are_noted_then_refused() {
        for (path, most) in [("a/src/b.rs", 450), ("a/tests/b.rs", 600)] {
            let report = |lines: usize| {
                let suite = Source::new("a/tests/suite.rs", "mod b;".to_owned());
                let lib = Source::new("a/src/lib.rs", "mod b;".to_owned());
                judge(&[suite, lib, Source::new(path, "\n".repeat(lines))])
            };
            assert!(report(400).lines.is_empty());
            assert_eq!((report(most).failed, report(most).lines.len()), (0, 1));
            assert_eq!(report(most + 1).failed, 1);
        }
    }

    #[test]
    fn paths_of_a_machine_are_found_anywhere() {
        let path = ["", "home", "someone", "x"].join("/");
        for text in ["{}", "see `{}`", "file://{}"] {
            let text = text.replace("{}", &path);
            assert_eq!(broken("docs/a.md", &text), [RULES[5].0], "{text}");
        }
        for text in ["https://a.org{}", "..{}", "out{}", "$HOME}{}"] {
            assert!(broken("a.md", &text.replace("{}", &path)).is_empty());
        }
    }
}
