//! Listings of a page: files to save, commands to execute, output to expect.

/// A listing in the order of the page.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) enum Listing {
    /// A file that the reader saves: name and text.
    File(String, String),
    /// Commands, one a line.
    Commands(Vec<String>, Expected),
    /// Lines that the last command prints.
    Output(Vec<String>),
}

/// Expected end of the commands of a listing.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Expected {
    Success,
    Failure,
    /// The commands are not executed, because they need a board, hours or an operator.
    NotExecuted,
}

/// Reads the listings of a page: fenced blocks `sh`, `sh fails`, `sh no-run`, `text`, and any
/// language with `file=NAME`. Other blocks are no listings.
///
/// # Errors
/// Fails with the number of a line if a block has unknown attributes or is not closed.
pub(super) fn parse(page: &str) -> Result<Vec<Listing>, String> {
    let mut listings = Vec::new();
    let mut lines = page.lines().zip(1..);
    while let Some((line, number)) = lines.next() {
        let Some(info) = line.strip_prefix("```") else {
            continue;
        };
        let mut block = Vec::new();
        loop {
            match lines.next() {
                Some(("```", _)) => break,
                Some((line, _)) => block.push(line.to_owned()),
                None => return Err(format!("line {number}: the block is not closed")),
            }
        }
        let follows_command = matches!(listings.last(), Some(Listing::Commands(..)));
        let words: Vec<&str> = info.split_whitespace().collect();
        let listing = match words.as_slice() {
            ["sh"] => Listing::Commands(commands(&block), Expected::Success),
            ["sh", "fails"] => Listing::Commands(commands(&block), Expected::Failure),
            ["sh", "no-run"] => Listing::Commands(commands(&block), Expected::NotExecuted),
            ["sh", ..] => return Err(format!("line {number}: unknown block `{info}`")),
            ["text"] if follows_command => Listing::Output(block),
            [_, file] => match file.strip_prefix("file=") {
                Some(name) => Listing::File(name.to_owned(), block.join("\n") + "\n"),
                None => return Err(format!("line {number}: unknown block `{info}`")),
            },
            _ => continue,
        };
        listings.push(listing);
    }
    Ok(listings)
}

/// Returns the commands of a block; a line that ends in a backslash continues.
fn commands(block: &[String]) -> Vec<String> {
    let joined = block.join("\n").replace("\\\n", "");
    let lines = joined.lines().map(str::trim);
    let is_command = |line: &&str| !line.is_empty() && !line.starts_with('#');
    lines.filter(is_command).map(str::to_owned).collect()
}

/// Returns the first line of `expected` that no line of `output` contains; `…` stands for any text.
/// Differences of white space count nothing.
pub(super) fn first_missing<'a>(expected: &'a [String], output: &[String]) -> Option<&'a str> {
    let squeezed = |line: &str| line.split_whitespace().collect::<Vec<_>>().join(" ");
    let output: Vec<String> = output.iter().map(|line| squeezed(line)).collect();
    let is_missing = |line: &&String| {
        let pattern = squeezed(line);
        !output.iter().any(|line| contains(line, &pattern))
    };
    expected.iter().find(is_missing).map(String::as_str)
}

/// Returns whether `line` contains the parts of `pattern` between `…`, one after the other.
fn contains(line: &str, pattern: &str) -> bool {
    let mut rest = line;
    pattern.split('…').all(|part| {
        let part = part.trim();
        let found = rest.split_once(part);
        rest = found.map_or("", |(_, rest)| rest);
        found.is_some()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_has_files_commands_and_output() {
        let page = "Save this as `a.toml`:\n\n```toml file=a.toml\nx = 1\n```\n\n```sh\n\
                    # twice\nflexor run a.toml \\\n  --seed 1\n```\n\n```text\nRMSE …°\n```\n\
                    ```text\nno output\n```\n```sh no-run\nflexor flash\n```\n```sh fails\nfalse\n```\n";
        let commands = |list: &[&str], expected| {
            let list = list.iter().map(|line| (*line).to_owned()).collect();
            Listing::Commands(list, expected)
        };
        let listings = parse(page).unwrap();
        assert_eq!(
            listings,
            [
                Listing::File("a.toml".into(), "x = 1\n".into()),
                commands(&["flexor run a.toml   --seed 1"], Expected::Success),
                Listing::Output(vec!["RMSE …°".into()]),
                commands(&["flexor flash"], Expected::NotExecuted),
                commands(&["false"], Expected::Failure),
            ]
        );
        assert!(parse("```sh never\n```\n").unwrap_err().contains("line 1"));
        assert!(
            parse("a\n```sh\nflexor run")
                .unwrap_err()
                .contains("line 2")
        );
    }

    #[test]
    fn expected_lines_may_have_gaps() {
        let output = ["RMSE  3.21° of 30 s".to_owned(), "done".to_owned()];
        let missing = |line: &str| first_missing(&[line.to_owned()], &output).is_some();
        for line in ["done", "RMSE …° of … s", "RMSE … s", "… s", "3.21° … of"] {
            assert!(!missing(line), "{line}");
        }
        for line in ["dona", "RMSE …° of … ms", "s … RMSE", "RMSE 3.3"] {
            assert!(missing(line), "{line}");
        }
    }
}
