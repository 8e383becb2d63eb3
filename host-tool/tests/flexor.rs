//! The `flexor` program as tests start it: where, with what, and what it said.

use serde_json::Value;
use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};

pub const FLEXOR: &str = env!("CARGO_BIN_EXE_flexor");
/// A good session.
pub const ONE_CHANNEL: &str = include_str!("one_channel.toml");
pub const TRIGGER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/sessions/trigger.toml");

/// An empty folder of this test's own.
pub fn folder(test: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"))
        .join("flexor")
        .join(test);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    folder
}

/// The same with [`ONE_CHANNEL`] in it, as session.toml.
pub fn with_session(test: &str) -> PathBuf {
    let folder = folder(test);
    fs::write(folder.join("session.toml"), ONE_CHANNEL).unwrap();
    folder
}

pub fn flexor(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(FLEXOR);
    command
        .current_dir(folder)
        .args(arguments)
        .env("NO_COLOR", "1");
    command
}

/// Exit code, standard output, standard error.
pub fn said(output: &Output) -> (Option<i32>, String, String) {
    let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).unwrap();
    (
        output.status.code(),
        text(&output.stdout),
        text(&output.stderr),
    )
}

/// What a command says.
pub fn run(folder: &Path, arguments: &[&str]) -> (Option<i32>, String, String) {
    said(&flexor(folder, arguments).output().unwrap())
}

/// Runs a command that must end well; gives its JSON back.
pub fn told(folder: &Path, line: &str) -> Value {
    let arguments: Vec<&str> = line.split_whitespace().chain(["--json"]).collect();
    let (exit, json, error) = run(folder, &arguments);
    assert_eq!(exit, Some(0), "{line}: {error}{json}");
    serde_json::from_str(json.lines().last().unwrap()).unwrap()
}

/// Exit code and message of a command.
pub fn failed(folder: &Path, line: &str) -> (Option<i32>, String) {
    let arguments: Vec<&str> = line.split_whitespace().collect();
    let (exit, _, error) = run(folder, &arguments);
    (exit, error)
}

/// Holds a text to having all of these parts.
#[track_caller]
pub fn has(text: &str, parts: &[&str]) {
    for part in parts {
        assert!(text.contains(part), "no `{part}` in {text}");
    }
}

/// A simulated board in a process of its own, killed when dropped.
pub struct Board {
    pub process: Child,
    /// As `--device` names it.
    pub at: String,
}

impl Board {
    pub fn serve(folder: &Path, wire: &[&str]) -> Self {
        let mut command = flexor(folder, &["--json", "serve", "--seconds", "60"]);
        let mut process = command.args(wire).stdout(Stdio::piped()).spawn().unwrap();
        let mut line = String::new();
        let stdout = process.stdout.take().unwrap();
        BufReader::new(stdout).read_line(&mut line).unwrap();
        let hello: Value = serde_json::from_str(&line).unwrap();
        let at = hello["at"].as_str().unwrap().to_owned();
        Self { process, at }
    }

    pub fn tcp(folder: &Path) -> Self {
        Self::serve(folder, &["--tcp", "127.0.0.1:0"])
    }
}

impl Drop for Board {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}
