//! `cargo test`: execution and summary.

use super::Workspace;
use super::command::{Finished, execute};
use super::console::{Console, seconds};
use super::report::Report;
use std::time::Duration;

/// Time above which a suite is listed.
const SLOW: Duration = Duration::from_secs(5);

/// Result of one test program.
#[derive(Clone, PartialEq, Debug, Default)]
struct Suite {
    name: String,
    passed: u32,
    failed: u32,
    time: Duration,
    /// Whether the program printed its result; a program that crashed did not.
    has_result: bool,
    failing: Vec<String>,
    ignored: Vec<String>,
    /// Tests that the program reported as slow.
    slow: Vec<String>,
    /// Output of the failing tests.
    details: Vec<String>,
}

/// Runs every test of the workspace.
pub(super) fn run(at: &Workspace, console: &mut Console) -> anyhow::Result<Report> {
    let arguments = ["test", "--workspace", "--no-fail-fast"];
    Ok(judge(execute(at, console, "cargo", &arguments)?))
}

/// Judges a run of `cargo test`.
pub(super) fn judge(finished: Finished) -> Report {
    let mut report = sum_up(&parse(&finished.lines));
    if !finished.success && report.failed == 0 {
        report.add(finished.report("cargo test")); // it did not compile
    }
    report
}

fn sum_up(suites: &[Suite]) -> Report {
    let mut report = Report::default();
    for suite in suites {
        report.passed += suite.passed;
        report.failed += suite.failed;
        if !suite.has_result {
            let problem = format!("{}: ended without a result", suite.name);
            report.add(Report::fail(vec![problem]));
        }
        let say = |kind: &str, name: &String| format!("{kind} {} {name}", suite.name);
        let lines = &mut report.lines;
        lines.extend(suite.failing.iter().map(|name| say("FAILED ", name)));
        lines.extend(suite.details.iter().map(|line| format!("  {line}")));
        lines.extend(suite.ignored.iter().map(|name| say("ignored", name)));
        lines.extend(suite.slow.iter().map(|name| say("slow   ", name)));
        if suite.time > SLOW {
            lines.push(format!("slow    {} {}", suite.name, seconds(suite.time)));
        }
    }
    let counts = suites.iter().map(|suite| suite.passed + suite.failed);
    let ran: Vec<_> = counts.filter(|count| *count > 0).collect();
    let tests: u32 = ran.iter().sum();
    let line = format!("{tests} tests in {} suites", ran.len());
    report.lines.push(line);
    report
}

/// Parses the output of `cargo test` and its test programs.
fn parse(lines: &[String]) -> Vec<Suite> {
    let mut suites: Vec<Suite> = Vec::new();
    let mut in_details = false;
    let mut package = String::new();
    for line in lines {
        if let Some(name) = suite_name(line, &mut package) {
            in_details = false;
            suites.push(Suite {
                name,
                ..Suite::default()
            });
            continue;
        }
        let Some(suite) = suites.last_mut() else {
            continue;
        };
        if line.starts_with("test result: ") {
            in_details = false;
            suite.take_result(line);
        } else if line == "failures:" {
            in_details = true;
        } else if in_details {
            suite.details.push(line.clone());
        } else if let Some(test) = line.strip_prefix("test ") {
            suite.take_test(test);
        }
    }
    for suite in &mut suites {
        suite.trim_details();
    }
    suites
}

impl Suite {
    /// Parses `NAME ... FAILED`, `NAME ... ignored, reason` and `NAME has been running for over 60
    /// seconds`.
    fn take_test(&mut self, line: &str) {
        if let Some((name, time)) = line.split_once(" has been running for ") {
            self.slow.push(format!("{name} {time}"));
        }
        let Some((name, verdict)) = line.split_once(" ... ") else {
            return;
        };
        if verdict == "FAILED" {
            self.failing.push(name.into());
        } else if let Some(reason) = verdict.strip_prefix("ignored") {
            self.ignored.push(format!("{name}{reason}"));
        }
    }

    /// Parses `test result: ok. 3 passed; 0 failed; 1 ignored; …; finished in 0.01s`.
    fn take_result(&mut self, line: &str) {
        self.has_result = true;
        for part in line.split("; ").flat_map(|part| part.split(". ")) {
            if let Some(count) = part.strip_suffix(" passed") {
                self.passed = count.parse().unwrap_or(0);
            } else if let Some(count) = part.strip_suffix(" failed") {
                self.failed = count.parse().unwrap_or(0);
            } else if let Some(time) = part.strip_prefix("finished in ") {
                let time = time.trim_end_matches('s').parse().unwrap_or(0.0);
                self.time = Duration::try_from_secs_f64(time).unwrap_or_default();
            }
        }
    }

    /// Drops empty lines and the list of names, which is already shown.
    fn trim_details(&mut self) {
        let names: Vec<_> = self.failing.iter().map(|n| format!("    {n}")).collect();
        self.details
            .retain(|line| !line.is_empty() && !names.contains(line));
    }
}

/// Parses `     Running unittests src/lib.rs (target/release/deps/firmware-0123)`, `     Running
/// tests/x.rs (…)` and `   Doc-tests firmware`. Only the first kind names its `package`, which the
/// following lines share.
fn suite_name(line: &str, package: &mut String) -> Option<String> {
    if let Some(package) = line.strip_prefix("   Doc-tests ") {
        return Some(format!("{package} doc-tests"));
    }
    let (source, program) = line.strip_prefix("     Running ")?.split_once(" (")?;
    let Some(source) = source.strip_prefix("unittests ") else {
        return Some(format!("{package} {source}").trim_start().to_owned());
    };
    let file = program.rsplit(['/', '\\']).next()?;
    file.rsplit_once('-')
        .map_or(file, |(name, _)| name)
        .clone_into(package);
    Some(format!("{package} {source}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    const OUTPUT: &str = "
   Compiling firmware v0.1.0
    Finished `release` profile [optimized] target(s) in 3.21s
     Running unittests src/lib.rs (target/release/deps/hal_sim-0f2a)

running 3 tests
test a::good ... ok
test a::bad ... FAILED
test a::slow ... ignored, needs a board
test a::good has been running for over 60 seconds

failures:

---- a::bad stdout ----
thread 'a::bad' panicked at x.rs:1:2:
no

failures:
    a::bad

test result: FAILED. 1 passed; 1 failed; 1 ignored; 0 measured; 0 filtered out; finished in 12.50s

error: test failed, to rerun pass `-p hal-sim --lib`
     Running tests/crash.rs (target/release/deps/crash-77)

running 2 tests
error: test failed, to rerun pass `-p tests --test crash`

Caused by:
  process didn't exit successfully: `crash-77` (signal: 11, SIGSEGV)
   Doc-tests firmware

running 1 test
test firmware/src/units.rs - units (line 3) ... ok

test result: ok. 1 passed; 0 failed; 0 ignored; 0 measured; 0 filtered out; finished in 0.10s
";

    fn lines(text: &str) -> Vec<String> {
        text.lines().map(str::to_owned).collect()
    }

    #[test]
    fn every_suite_is_read() {
        let suites = parse(&lines(OUTPUT));
        let names: Vec<_> = suites.iter().map(|s| s.name.as_str()).collect();
        let expected = "hal_sim src/lib.rs, hal_sim tests/crash.rs, firmware doc-tests";
        assert_eq!(names.join(", "), expected);
        let first = &suites[0];
        assert_eq!((first.passed, first.failed), (1, 1));
        assert_eq!(first.failing, ["a::bad"]);
        assert_eq!(first.ignored, ["a::slow, needs a board"]);
        assert_eq!(first.time, Duration::from_millis(12_500));
        let expected = [
            "---- a::bad stdout ----",
            "thread 'a::bad' panicked at x.rs:1:2:",
            "no",
        ];
        assert_eq!(first.details, expected);
        assert!(!suites[1].has_result);
        assert!(suites[2].has_result);
    }

    #[test]
    fn a_crash_counts_as_a_failure_beside_failing_tests() {
        let report = sum_up(&parse(&lines(OUTPUT)));
        assert_eq!((report.passed, report.failed), (2, 2));
        let text = report.lines.join("\n");
        for part in [
            "FAILED  hal_sim src/lib.rs a::bad",
            "ignored hal_sim src/lib.rs a::slow, needs a board",
            "slow    hal_sim src/lib.rs 12.5 s",
            "slow    hal_sim src/lib.rs a::good over 60 seconds",
            "hal_sim tests/crash.rs: ended without a result",
            "3 tests in 2 suites",
        ] {
            assert!(text.contains(part), "{part} is not in\n{text}");
        }
    }

    #[test]
    fn output_without_a_suite_gives_no_suite() {
        let output = "   Compiling x\nerror[E0425]: no such value\ntest result: ok. 9 passed\n";
        assert_eq!(parse(&lines(output)), []);
    }
}
