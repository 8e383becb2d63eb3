//! Property tests and the short fuzz test in rounds, each on its own seed.
//!
//! The tests are found in the sources: every module that generates random inputs. A failing round
//! does not stop the next.

use super::Workspace;
use super::command::{execute, execute_with};
use super::console::{Console, seconds};
use super::report::Report;
use super::rules::{self, Source};
use super::suite;
use std::collections::BTreeSet;
use std::hash::{BuildHasher, Hasher, RandomState};
use std::process::ExitCode;
use std::time::{Duration, Instant};

/// Code that marks modules with random inputs.
const DRAWS: [&str; 3] = ["proptest!", "TestRunner", "rng_seed"];

/// Environment variable with proptest's seed, which takes precedence over .cargo/config.toml.
const SEED: &str = "PROPTEST_RNG_SEED";

/// Packages and modules with random inputs, as cargo and test programs name them.
#[derive(PartialEq, Eq, Debug, Default)]
struct Drawing {
    packages: BTreeSet<String>,
    modules: BTreeSet<String>,
}

/// Results of the rounds so far.
#[derive(PartialEq, Eq, Debug, Default)]
struct Rounds {
    done: u32,
    total: Report,
    /// Seeds of the rounds in which something failed.
    failing: Vec<u64>,
}

/// Runs rounds on fresh seeds until `length` is over, and finishes the last.
pub(super) fn run_fresh_seeds(at: &Workspace, length: Duration) -> ExitCode {
    soak(at, std::iter::repeat_with(fresh_seed), Some(length))
}

/// Returns a seed from the operating system's random numbers.
fn fresh_seed() -> u64 {
    RandomState::new().build_hasher().finish()
}

/// Runs one round.
pub(super) fn run_seed(at: &Workspace, seed: u64) -> ExitCode {
    soak(at, std::iter::once(seed), None)
}

fn soak(at: &Workspace, seeds: impl Iterator<Item = u64>, length: Option<Duration>) -> ExitCode {
    let mut console = Console::new();
    let mut rounds = Rounds::default();
    let prepared = prepare(at, &mut console);
    let begin = Instant::now(); // building does not count
    match prepared {
        Err(problem) => rounds.total.add(problem),
        Ok(drawing) => {
            for seed in seeds {
                console.begin(&format!("[round {}] seed {seed}", rounds.done + 1));
                let mut report =
                    round(at, &mut console, &drawing, seed).unwrap_or_else(Report::from_error);
                if report.failed > 0 {
                    report.lines.push(repeat_hint(seed));
                } else {
                    report.lines.clear();
                }
                console.end(&report);
                rounds.note(seed, report);
                if length.is_some_and(|length| begin.elapsed() >= length) {
                    break;
                }
            }
        }
    }
    println!();
    for line in rounds.closing(begin.elapsed()) {
        println!("{line}");
    }
    ExitCode::from(u8::from(rounds.total.failed > 0))
}

/// Finds the tests and builds them, once.
fn prepare(at: &Workspace, console: &mut Console) -> Result<Drawing, Report> {
    console.begin("[build]");
    let sources = rules::sources(&at.root).map_err(Report::from_error)?;
    let drawing = random_tests(&sources);
    let arguments = [drawing.arguments(), vec!["--no-run"]].concat();
    let report = match execute(at, console, "cargo", &arguments) {
        Ok(finished) => finished.report("cargo test --no-run"),
        Err(error) => Report::from_error(error),
    };
    console.end(&report);
    if report.failed > 0 {
        return Err(report);
    }
    Ok(drawing)
}

fn round(
    at: &Workspace,
    console: &mut Console,
    drawing: &Drawing,
    seed: u64,
) -> anyhow::Result<Report> {
    let mut arguments = drawing.arguments();
    arguments.push("--");
    arguments.extend(drawing.modules.iter().map(String::as_str));
    let seed = seed.to_string();
    let finished = execute_with(at, console, "cargo", &arguments, &[(SEED, &seed)])?;
    let mut report = suite::judge(finished);
    if report.passed + report.failed == 0 {
        report.add(Report::fail(vec!["no test ran".into()]));
    }
    Ok(report)
}

impl Drawing {
    /// Returns cargo's arguments for the test programs of these packages.
    fn arguments(&self) -> Vec<&str> {
        let packages = self.packages.iter().flat_map(|name| ["--package", name]);
        let which = ["test", "--no-fail-fast", "--lib", "--test", "suite"];
        which.into_iter().chain(packages).collect()
    }
}

impl Rounds {
    fn note(&mut self, seed: u64, report: Report) {
        self.done += 1;
        if report.failed > 0 {
            self.failing.push(seed);
        }
        self.total.add(report);
    }

    fn closing(&self, time: Duration) -> Vec<String> {
        let mut lines = vec![format!("rounds: {} in {}", self.done, seconds(time))];
        lines.extend(self.failing.iter().map(|&seed| repeat_hint(seed)));
        let Report { passed, failed, .. } = self.total;
        lines.push(format!("{passed} passed, {failed} failed"));
        lines
    }
}

fn repeat_hint(seed: u64) -> String {
    format!("failed on seed {seed}; repeat it: cargo verify --soak-seed {seed}")
}

/// Returns every module with random inputs, except for those of this program.
fn random_tests(sources: &[Source]) -> Drawing {
    let mut drawing = Drawing::default();
    for source in sources {
        let draws = DRAWS.iter().any(|word| source.code.contains(word));
        if let Some((package, module)) = module(&source.path)
            && draws
            && !source.path.starts_with("tests/src/verify/")
        {
            drawing.packages.insert(package);
            drawing.modules.insert(module);
        }
    }
    drawing
}

/// Returns the package of a file in `src` or `tests`, and its module path in test names.
fn module(path: &str) -> Option<(String, String)> {
    let mut parts: Vec<_> = path.strip_suffix(".rs")?.split('/').collect();
    if parts.last() == Some(&"mod") {
        parts.pop();
    }
    match parts[..] {
        [package, "src" | "tests", ref module @ ..] if !module.is_empty() => {
            Some((package.into(), module.join("::") + "::"))
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn modules_that_draw_are_found_by_what_they_say() {
        let source = |path: &str, text: &str| Source::new(path, text.to_owned());
        let sources = [
            source("a/src/b/c.rs", "mod tests { proptest! {} }"),
            source("a/src/b/mod.rs", "// proptest!"),
            source("d-e/tests/f/mod.rs", "fn t() { TestRunner::new(x); }"),
            source("d-e/tests/g.rs", "proptest::proptest! { }"),
            source("tests/fuzz/fuzz_targets/h.rs", "TestRunner"),
            source("tests/src/verify/soak.rs", "TestRunner"),
        ];
        let found = random_tests(&sources);
        assert_eq!(found.packages, ["a", "d-e"].map(str::to_owned).into());
        let modules = ["b::c::", "f::", "g::"].map(str::to_owned);
        assert_eq!(found.modules, modules.into());
        let arguments = found.arguments().join(" ");
        let expected = "test --no-fail-fast --lib --test suite --package a --package d-e";
        assert_eq!(arguments, expected);
    }

    #[test]
    fn the_property_tests_of_this_workspace_are_among_them() {
        let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
        let sources = rules::sources(root.parent().unwrap()).unwrap();
        let found = random_tests(&sources);
        let some = "device_fuzz:: muscle_properties:: trace_scheduler:: million_pulses:: \
                    device_stops:: fuzz_short:: arithmetic::division:: pulse::scheduler::tests::";
        for module in some.split(' ') {
            assert!(found.modules.contains(module), "{module}: {found:?}");
        }
    }

    #[test]
    fn rounds_are_counted_and_failing_seeds_kept() {
        let mut rounds = Rounds::default();
        let passed = |passed| Report {
            passed,
            ..Report::default()
        };
        let mut bad = passed(8);
        bad.add(Report::fail(vec!["FAILED x".into()]));
        rounds.note(7, passed(9));
        rounds.note(10_u64.pow(19), bad);
        rounds.note(9, passed(9));
        let (seed, closing_lines) = (
            "10000000000000000000",
            rounds.closing(Duration::from_secs(61)),
        );
        let again = format!("failed on seed {seed}; repeat it: cargo verify --soak-seed {seed}");
        assert_eq!(
            closing_lines,
            ["rounds: 3 in 1 min 01 s", &again, "26 passed, 1 failed"]
        );
    }

    #[test]
    fn seeds_differ() {
        let seeds: BTreeSet<_> = (0..1_000).map(|_| fresh_seed()).collect();
        assert_eq!(seeds.len(), 1_000);
    }
}
