//! Mutants of device code: a random sample of the list of cargo-mutants, and the proofs of
//! docs/how/safety.md that should detect them.
//!
//! In: cargo-mutants' JSON, the page, a file's text. Out: mutants, proofs, mutated text. This
//! module runs no program.

use anyhow::Context;
use hal_sim::random::Random;
use serde::{Deserialize, Serialize};

/// Small change of a source file, as `cargo mutants --list --json` prints it.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord, Debug, Deserialize, Serialize)]
pub struct Mutant {
    /// Path relative to the workspace's folder.
    pub file: String,
    /// Range of the replaced text.
    pub span: Span,
    /// New text for the range.
    pub replacement: String,
    /// Description: file, line, column and change.
    pub name: String,
}

/// Range of text.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Deserialize, Serialize)]
pub struct Span {
    /// First character.
    pub start: Position,
    /// Character after the last.
    pub end: Position,
}

/// Position of a character in a text; both numbers count from 1.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Deserialize, Serialize)]
pub struct Position {
    pub line: usize,
    /// Column, in characters.
    pub column: usize,
}

impl Position {
    /// Returns the byte offset of the position in `text`, or `None` if `text` has no such position.
    fn offset(self, text: &str) -> Option<usize> {
        let before = self.line.checked_sub(1)?;
        let start: usize = text.split_inclusive('\n').take(before).map(str::len).sum();
        let line = text.get(start..)?;
        let column = self.column.checked_sub(1)?;
        let ends = std::iter::once(line.len());
        let within = line.char_indices().map(|(at, _)| at).chain(ends);
        Some(start + within.take(column + 1).nth(column)?)
    }
}

impl Mutant {
    /// Returns the mutated text of the file.
    ///
    /// # Errors
    /// Fails if `text` has no such span.
    pub fn apply(&self, text: &str) -> anyhow::Result<String> {
        let place = self.span.start.offset(text).zip(self.span.end.offset(text));
        let parts = place.and_then(|(start, end)| Some((text.get(..start)?, text.get(end..)?)));
        let (before, after) = parts.with_context(|| format!("{}: no such span", self.name))?;
        Ok(format!("{before}{}{after}", self.replacement))
    }
}

/// Returns the mutants in cargo-mutants' `json` in a random order that depends only on `seed`.
///
/// # Errors
/// Fails if `json` is not the output of cargo-mutants 25 to 27.
pub fn shuffled(json: &str, seed: u64) -> anyhow::Result<Vec<Mutant>> {
    let mut mutants: Vec<Mutant> = serde_json::from_str(json)?;
    mutants.sort();
    Random::new(seed).shuffle(&mut mutants);
    Ok(mutants)
}

/// Test that docs/how/safety.md names as a proof.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Proof {
    /// `P` and a number.
    pub number: String,
    /// File of the test, relative to the workspace's folder.
    pub file: String,
    /// Name of the test function.
    pub test: String,
}

/// Parses the list of proofs at the end of docs/how/safety.md; `page` is its text.
#[must_use]
pub fn parse_proofs(page: &str) -> Vec<Proof> {
    let list = page.split_once("\n## The proofs\n").unwrap_or_default().1;
    let (mut file, mut proofs) = ("", Vec::new());
    for line in list.lines().filter_map(|line| line.strip_prefix("    ")) {
        let mut words = line.split_whitespace();
        match (words.next(), words.next()) {
            (Some(path), None) => file = path,
            (Some(number), Some(test)) => proofs.push(Proof {
                number: number.to_owned(),
                file: file.to_owned(),
                test: test.to_owned(),
            }),
            _ => {}
        }
    }
    proofs
}

impl Proof {
    /// Returns the member of `tests`, names as libtest lists them, that is this proof.
    #[must_use]
    pub fn test_path<'a>(&self, tests: &[&'a str]) -> Option<&'a str> {
        let inside = self.file.split_once("/src/");
        let (_, module) = inside.or_else(|| self.file.split_once("/tests/"))?;
        let module = module.strip_suffix(".rs")?;
        let module = module.strip_suffix("/mod").unwrap_or(module);
        let (start, end) = (module.replace('/', "::"), format!("::{}", self.test));
        let is_this = |test: &&&str| {
            let rest = test.strip_prefix(start.as_str());
            rest.is_some_and(|rest| rest.starts_with("::") && rest.ends_with(&end))
        };
        tests.iter().find(is_this).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SOURCE: &str = "fn µ() -> u8 {\n    1 + 2\n}\n";

    fn json(spans: &[(usize, usize, usize, usize)]) -> String {
        let mutants = spans.iter().map(|&(line, column, end, last)| {
            serde_json::json!({
                "name": format!("a.rs:{line}:{column}: replace"), "package": "p",
                "file": "a.rs", "replacement": "3", "genre": "FnValue", "function": null,
                "span": {
                    "start": { "line": line, "column": column },
                    "end": { "line": end, "column": last },
                },
            })
        });
        serde_json::Value::from_iter(mutants).to_string()
    }

    #[test]
    fn a_span_is_replaced_and_nothing_else() {
        let spans = [(2, 7, 2, 8), (1, 15, 3, 1), (1, 4, 1, 5), (3, 2, 3, 2)];
        let mutants: Vec<Mutant> = serde_json::from_str(&json(&spans)).unwrap();
        let mutated: Vec<_> = mutants.iter().map(|m| m.apply(SOURCE).unwrap()).collect();
        assert_eq!(mutated[0], "fn µ() -> u8 {\n    1 3 2\n}\n");
        assert_eq!(mutated[1], "fn µ() -> u8 {3}\n");
        assert_eq!(mutated[2], "fn 3() -> u8 {\n    1 + 2\n}\n");
        assert_eq!(mutated[3], "fn µ() -> u8 {\n    1 + 2\n}3\n");
        assert!(mutants[0].apply("fn µ() {}").is_err());
    }

    #[test]
    fn the_order_depends_on_the_seed_alone() {
        let mut spans: Vec<_> = (1..50).map(|line| (line, 1, line, 2)).collect();
        let order = shuffled(&json(&spans), 1).unwrap();
        assert_ne!(order, shuffled(&json(&spans), 2).unwrap());
        spans.reverse();
        assert_eq!(order, shuffled(&json(&spans), 1).unwrap());
    }

    #[test]
    fn a_proof_is_found_by_file_and_name() {
        let page = "P1\n\n## The proofs\n\ntext\n\n    a/src/b/c.rs\n      P1  one\n    \
                    d/tests/e/mod.rs\n      P2 two\n";
        let found = parse_proofs(page);
        let tests = ["b::c::tests::one", "b::cd::one", "e::two", "e::one_two"];
        let path = |proof: &Proof| proof.test_path(&tests);
        let paths: Vec<_> = found.iter().map(path).collect();
        assert_eq!(paths, [Some("b::c::tests::one"), Some("e::two")]);
        assert_eq!(found[1].number, "P2");
        assert_eq!(
            found[0].test_path(&["b::cd::one", "b::c::another_one"]),
            None
        );
    }
}
