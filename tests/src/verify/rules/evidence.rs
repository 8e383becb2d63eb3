//! Rule for the evidence named in docs/how/safety.md: each file, command, test and proof must exist.

use super::Findings;
use super::source::Source;
use std::collections::BTreeSet;

const PAGE: &str = "docs/how/safety.md";

/// Returns the evidence on the page that the tree lacks.
pub(super) fn missing_evidence(sources: &[Source]) -> Findings {
    let page = sources.iter().find(|source| source.path == PAGE);
    let Some(page) = page else {
        return vec![format!("{PAGE} does not exist")];
    };
    let (prose, list) = page
        .text
        .split_once("\n## The proofs\n")
        .unwrap_or_default();
    let (proofs, mut found) = proofs(list, sources);
    if proofs.is_empty() {
        found.push(format!("{PAGE} has no list of proofs"));
    }
    let cited = cited_proofs(prose);
    let tell = |defect: &str, name: &str| format!("{PAGE}: {name} {defect}");
    found.extend(
        cited
            .difference(&proofs)
            .map(|p| tell("is not in the list of proofs", p)),
    );
    found.extend(
        proofs
            .difference(&cited)
            .map(|p| tell("is not cited on the page", p)),
    );
    let quoted = prose.split('`').skip(1).step_by(2);
    let is_gone = |quoted: &&str| !exists_in_tree(quoted, sources);
    found.extend(
        quoted
            .filter(is_gone)
            .map(|text| tell("does not exist", text)),
    );
    found.extend(
        links(prose)
            .filter(is_gone)
            .map(|links| tell("does not exist", links)),
    );
    found
}

/// Parses the list of proofs: lines with a file, each followed by its proofs, number and test.
fn proofs(list: &str, sources: &[Source]) -> (BTreeSet<String>, Findings) {
    let (mut proofs, mut found) = (BTreeSet::new(), Findings::new());
    let mut file: Option<&Source> = None;
    for line in list.lines().filter_map(|line| line.strip_prefix("    ")) {
        let mut words = line.split_whitespace();
        match (words.next(), words.next()) {
            (Some(path), None) => {
                file = sources.iter().find(|source| source.path == path);
                if file.is_none() {
                    found.push(format!("{PAGE}: the file {path} does not exist"));
                }
            }
            (Some(proof), Some(test)) => {
                if !file.is_some_and(|file| has_test(file, test)) {
                    found.push(format!("{PAGE}: {proof}: no test `{test}` in that file"));
                }
                if !proofs.insert(proof.to_owned()) {
                    found.push(format!("{PAGE}: {proof} is listed twice"));
                }
            }
            _ => {}
        }
    }
    (proofs, found)
}

/// Returns whether the function of this name has `#[test]`, with attributes and comments in
/// between.
fn has_test(file: &Source, test: &str) -> bool {
    let at = file.code.find(&format!("fn {test}("));
    at.is_some_and(|at| {
        let before = file.code[..at].rfind("#[test]");
        before.is_some_and(|before| !file.code[before..at].contains("fn "))
    })
}

/// Returns every proof number, `P` and digits, in `text`; a range (`P6–P10`) counts as all its
/// numbers.
fn cited_proofs(text: &str) -> BTreeSet<String> {
    let number = |word: &str| word.strip_prefix('P')?.parse::<u32>().ok();
    let is_part = |c: char| c.is_ascii_alphanumeric() || c == '–';
    let words = text.split(|c| !is_part(c));
    let ranges = words.filter_map(|word| {
        let (first, last) = word.split_once('–').unwrap_or((word, word));
        Some(number(first)?..=number(last)?)
    });
    ranges
        .flatten()
        .map(|number| format!("P{number}"))
        .collect()
}

/// Returns the targets of links into the tree, without anchors.
fn links(text: &str) -> impl Iterator<Item = &str> {
    let targets = text
        .split("](")
        .skip(1)
        .filter_map(|rest| rest.split(')').next());
    let targets = targets.map(|target| target.split('#').next().unwrap_or_default());
    targets.filter(|target| !target.is_empty() && !target.contains("://"))
}

/// Returns whether `quoted` exists as a file or folder of the tree or of `docs`, or as a command of
/// `flexor`; other text counts as existing.
fn exists_in_tree(quoted: &str, sources: &[Source]) -> bool {
    if let Some(rest) = quoted.strip_prefix("flexor ") {
        let command = rest.split_whitespace().next().unwrap_or_default();
        let command = command.replace('-', "_");
        return [".rs", "/"].iter().any(|end| {
            let path = format!("host-tool/src/cli/{command}{end}");
            sources.iter().any(|source| source.path.starts_with(&path))
        });
    }
    let is_path = quoted.contains('/') || [".md", ".rs", ".py"].iter().any(|e| quoted.ends_with(e));
    if !is_path || quoted.contains(' ') {
        return true;
    }
    let quoted = quoted.trim_start_matches("../"); // links are relative to the page
    sources.iter().any(|source| {
        let inside = |folder: &str| source.path.starts_with(&format!("{folder}/"));
        source.path == quoted
            || source.path == format!("docs/{quoted}")
            || source.path.ends_with(&format!("/{quoted}"))
            || inside(quoted)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str = "# Safe\n`a/b.rs`, `a`/`flexor run x`, [b](../e/c.md#d): P1 P2–P3\n\
                        \n## The proofs\n\n    a/b.rs\n      P1  one\n      P2 two\n      P3 three\n";

    fn found(page: &str) -> Findings {
        let code = "#[test]\nfn one() {}\n// fn\n#[test]\n#[ignore]\nfn two(a: u8) {}\n\
                    #[test]\nfn three() {}\nfn four() {}";
        let files = [
            (PAGE, page),
            ("a/b.rs", code),
            ("docs/e/c.md", ""),
            ("host-tool/src/cli/run.rs", ""),
        ];
        missing_evidence(&files.map(|(path, text)| Source::new(path, text.to_owned())))
    }

    #[test]
    fn a_page_that_names_what_is_there_is_good() {
        assert_eq!(found(GOOD), [""; 0]);
    }

    #[test]
    fn whatever_is_not_there_is_told() {
        for (from, to, says) in [
            ("`a/b.rs`", "`a/c.rs`", "a/c.rs does not exist"),
            ("flexor run", "flexor ran", "flexor ran x does not exist"),
            ("c.md", "d.md", "d.md does not exist"),
            ("    a/b.rs", "    a/d.rs", "the file a/d.rs does not exist"),
            ("P2 two", "P2 four", "P2: no test `four`"),
            ("P2 two", "P2 five", "P2: no test `five`"),
            ("P3 three", "P2 three", "P2 is listed twice"),
            (": P1 ", ": ", "P1 is not cited"),
            ("P2–P3", "P2–P4", "P4 is not in the list"),
            ("## The proofs", "## Proofs", "no list of proofs"),
        ] {
            assert!(GOOD.contains(from), "{from}");
            let findings = found(&GOOD.replacen(from, to, 1)).join("\n");
            assert!(findings.contains(says), "{from} → {to}: {findings}");
        }
        assert_eq!(missing_evidence(&[]), ["docs/how/safety.md does not exist"]);
    }
}
