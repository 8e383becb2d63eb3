//! Runs every command that the example programs show in their heads, and that any document shows
//! about them, exactly as written.

use crate::program::{Board, FLEXOR, command_result, test_folder};
use std::collections::{BTreeMap, BTreeSet};
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");

/// Prefix of these commands.
const PYTHON: &str = "python3 docs/examples/";

/// Addresses of boards in the documents, which the test replaces by its own boards.
const SOCKET: &str = "127.0.0.1:4242";
const PORT: &str = "/dev/ttyACM0";

/// Number of attempts for a command that fails because a busy computer was too late for the device.
const ATTEMPTS: u32 = 3;

fn files(folder: &Path, end: &str, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files(&path, end, found);
        } else if path.extension().is_some_and(|own| own == end) {
            found.push(path);
        }
    }
}

/// Returns the examples and every document of the repository, with their texts.
fn texts() -> BTreeMap<PathBuf, String> {
    let mut found = vec![];
    files(&Path::new(ROOT).join("docs/examples"), "py", &mut found);
    files(&Path::new(ROOT).join("docs"), "md", &mut found);
    for entry in std::fs::read_dir(ROOT).unwrap() {
        let path = entry.unwrap().path();
        found.extend(
            path.extension()
                .is_some_and(|own| own == "md")
                .then_some(path),
        );
    }
    let text = |path: PathBuf| (path.clone(), std::fs::read_to_string(path).unwrap());
    found.into_iter().map(text).collect()
}

/// Returns the lines and quoted pieces of `text` that begin with `begin`, without trailing
/// comments.
fn example_lines<'a>(text: &'a str, begin: &str) -> Vec<&'a str> {
    let starts = text.match_indices(begin).map(|(start, _)| start);
    let commands = starts.filter_map(|start| {
        let (before, rest) = text.split_at(start);
        let is_quoted = before.ends_with('`');
        let line = before.rsplit('\n').next().unwrap_or(before);
        let end = rest.find(if is_quoted { '`' } else { '\n' });
        let command = &rest[..end.unwrap_or(rest.len())];
        let command = command.split(" #").next().unwrap_or(command).trim();
        (is_quoted || line.trim().is_empty()).then_some(command)
    });
    commands.collect()
}

/// Returns whether the output of an example shows its successful end.
fn is_done(command: &str, output: &str) -> bool {
    match command {
        _ if command.contains("--selftest") => output.contains("requests encoded"),
        _ if command.contains("client.py") => {
            output.contains("stimulating") && output.contains("{'Stopped': 'Request'}")
        }
        _ if command.contains("hand.py") => output.contains("100.0 % of"),
        _ if command.contains("lift.py") => output.contains("released at"),
        _ => output.contains("done: w.toml"),
    }
}

/// Runs a command in a folder where the repository's files have the same relative paths as in its
/// root. The command gets its own board, to whose socket another program has connected before.
fn try_command(command: &str, folder: &Path) -> Result<String, String> {
    let mut line = command.to_owned();
    let mut boards = vec![];
    if line.contains(SOCKET) {
        let board = Board::tcp(folder);
        line = line.replace(&format!("tcp:{SOCKET}"), &board.at);
        let address = board.at.strip_prefix("tcp:").unwrap();
        let mut other = std::net::TcpStream::connect(address).unwrap();
        other.write_all(b"AT\r\nAT\r\n").unwrap(); // a modem manager
        boards.push(board);
    }
    if line.contains(PORT) {
        let board = Board::serve(folder, &["--pty", "ttyACM0"]);
        line = line.replace(PORT, &board.at);
        boards.push(board);
    }
    let path = Path::new(FLEXOR).parent().unwrap().to_owned();
    let old = std::env::var_os("PATH").unwrap_or_default();
    let places = std::iter::once(path).chain(std::env::split_paths(&old));
    let mut words = line.split_whitespace();
    let mut process = Command::new(words.next().unwrap())
        .args(words)
        .current_dir(folder)
        .env("PATH", std::env::join_paths(places).unwrap())
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut typed = process.stdin.take().unwrap();
    let lines = BufReader::new(process.stdout.take().unwrap()).lines();
    let (mut output, mut given) = (String::new(), 0);
    for line in lines.map_while(Result::ok) {
        if let Some(word) = operator(&line, &mut given) {
            let _ = writeln!(typed, "{word}"); // it may have ended
        }
        output += &(line + "\n");
    }
    drop(typed);
    let (exit, _, error) = command_result(process.wait_with_output().unwrap());
    let is_right = exit == Some(0) && is_done(command, &output) && !error.contains("Traceback");
    match is_right {
        true => Ok(output),
        false => Err(format!("{command} ends with {exit:?}: {output}{error}")),
    }
}

/// Returns the operator's input after such a line of `calibrate.py`.
fn operator(line: &str, given: &mut u32) -> Option<&'static str> {
    let (view, asked) = line.trim_end().rsplit_once(": ")?;
    if view.ends_with(", ready") {
        *given += 1;
        return Some(match asked {
            _ if *given > 5 && asked.contains("enough") => "e",
            _ if asked.contains("raise") => "u",
            _ => "a",
        });
    }
    let is_question = asked.contains('?');
    let names = view.contains(", points,");
    is_question.then_some(if names { "wrist extension" } else { "y" })
}

/// Returns whether a client reports by name that it was too late for its device.
fn is_late(error: &str) -> bool {
    // 319: an angle was measured too long ago.
    error.contains("HostSilent")
        || error.contains("{'Faulted': 5}")
        || error.contains("'code': 319")
}

#[test]
#[cfg(unix)]
fn every_command_that_is_shown_runs() {
    let texts = texts();
    let mut commands = BTreeSet::new();
    for (path, text) in &texts {
        let own = example_lines(text, PYTHON);
        let name = path.file_name().unwrap().to_str().unwrap();
        let is_example = name.ends_with(".py");
        let mentions_itself = own.iter().any(|command| command.contains(name));
        assert!(
            !is_example || mentions_itself,
            "{name} shows no command of its own"
        );
        commands.extend(own.into_iter().map(str::to_owned));
    }
    assert!(commands.len() >= 8, "{commands:?}");
    let next = std::sync::Mutex::new(commands.iter().enumerate());
    let failures = std::sync::Mutex::new(vec![]);
    let work = || {
        loop {
            let Some((number, command)) = next.lock().unwrap().next() else {
                return;
            };
            let mut outcome = Err(String::new());
            for attempt in 1..=ATTEMPTS {
                let folder = test_folder(&format!("examples/{number}-{attempt}"));
                for name in ["docs", "host-tool"] {
                    let there = Path::new(ROOT).canonicalize().unwrap().join(name);
                    std::os::unix::fs::symlink(there, folder.join(name)).unwrap();
                }
                outcome = try_command(command, &folder);
                match &outcome {
                    Err(error) if is_late(error) => println!("attempt {attempt}: {error}"),
                    _ => break,
                }
            }
            match outcome {
                Ok(_) => println!("{command}"),
                Err(error) => failures.lock().unwrap().push(error),
            }
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..3 {
            scope.spawn(work);
        }
    });
    let failures = failures.into_inner().unwrap();
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

/// The boards for the examples are served by commands that the documents show, too.
#[test]
fn every_board_that_is_shown_is_served() {
    let mut serves = BTreeSet::new();
    for (path, text) in texts() {
        if path.extension().is_some_and(|end| end == "py") || text.contains(PYTHON) {
            let own = example_lines(&text, "flexor serve ").into_iter();
            serves.extend(own.map(str::to_owned));
        }
    }
    assert!(!serves.is_empty());
    let folder = test_folder("examples/boards");
    for command in serves {
        let wire = command.trim_end_matches('&').replace(SOCKET, "127.0.0.1:0");
        let wire = wire.replace("HOST:PORT", "127.0.0.1:0");
        let words: Vec<&str> = wire.split_whitespace().skip(2).collect();
        if !words.contains(&"--tcp") && !words.contains(&"--pty") {
            continue; // part of a command
        }
        let board = Board::serve(&folder, &words);
        assert!(!board.at.is_empty(), "{command}");
    }
}

/// Every example that a document names exists.
#[test]
fn every_example_that_is_named_is_there() {
    let mut count = 0;
    for (path, text) in texts() {
        for (start, found) in text.match_indices("examples/") {
            let rest = &text[start + found.len()..];
            let end = rest.find(|c: char| !c.is_ascii_alphanumeric() && c != '_' && c != '.');
            let name = rest[..end.unwrap_or(rest.len())].trim_end_matches('.');
            if !name.ends_with(".py") {
                continue;
            }
            count += 1;
            let file = Path::new(ROOT).join("docs/examples").join(name);
            assert!(file.is_file(), "{}: {name}", path.display());
        }
    }
    assert!(count > 10, "{count}");
}
