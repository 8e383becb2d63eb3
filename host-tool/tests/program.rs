//! Helpers that start the `flexor` program as people and scripts do, each test in its own folder.

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::{Mutex, PoisonError};
use std::thread;

pub const FLEXOR: &str = env!("CARGO_BIN_EXE_flexor");

/// A shipped session that waits for a trigger.
pub const TRIGGER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/sessions/trigger.toml");

/// An open-loop session with one channel, 30 s at 50 Hz.
pub const SESSION: &str = include_str!("one_channel.toml");

/// Returns the same session with this length and setpoint rate. Its host timeout is long, because a
/// test's computer sometimes stalls.
pub fn one_channel(seconds: f64, rate_hz: u32) -> String {
    let long = SESSION.replace("duration_s = 30.0", &format!("duration_s = {seconds:?}"));
    long.replace("rate_hz = 50", &format!("rate_hz = {rate_hz}"))
}

/// The test that each folder belongs to.
static OWNERS: Mutex<BTreeMap<String, Option<String>>> = Mutex::new(BTreeMap::new());

/// Creates an empty folder for one test, with [`SESSION`] in it.
///
/// # Panics
///
/// If another test has a folder of this name: it would be emptied while that test runs.
pub fn test_folder(test: &str) -> PathBuf {
    let now = thread::current().name().map(str::to_owned);
    let mut owners = OWNERS.lock().unwrap_or_else(PoisonError::into_inner);
    let owner = owners.entry(test.to_owned()).or_insert_with(|| now.clone());
    let is_own = *owner == now;
    drop(owners);
    assert!(is_own, "two tests have the folder {test}");
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(test);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("session.toml"), SESSION).unwrap();
    folder
}

/// Writes a file in the folder of a test.
pub fn write_file(folder: &Path, name: &str, text: impl AsRef<[u8]>) -> PathBuf {
    let path = folder.join(name);
    std::fs::write(&path, text).unwrap();
    path
}

pub fn flexor_command(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(FLEXOR);
    command.current_dir(folder).args(arguments);
    command.env("NO_COLOR", "1");
    command
}

/// Exit code, standard output, standard error.
pub type ProgramOutput = (Option<i32>, String, String);

pub fn command_result(output: Output) -> ProgramOutput {
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (
        output.status.code(),
        text(output.stdout),
        text(output.stderr),
    )
}

/// Runs `flexor` to its end.
pub fn run_flexor(folder: &Path, arguments: &[&str]) -> ProgramOutput {
    command_result(flexor_command(folder, arguments).output().unwrap())
}

/// Runs the command that the page in `folder/out` shows, writes to `folder/again`, and checks that
/// the result is the same.
pub fn check_rerun_command(folder: &Path, out: &str) {
    let read =
        |out: &str, file: &str| std::fs::read_to_string(folder.join(out).join(file)).unwrap();
    let page = read(out, "result.html");
    let (_, command) = page.split_once("<pre>flexor ").unwrap();
    let (command, _) = command.split_once("</pre>").unwrap();
    let mut words: Vec<&str> = command.split_whitespace().collect();
    words.extend(["--out", "again"]);
    let (exit, people, error) = run_flexor(folder, &words);
    assert_eq!(exit, Some(0), "{command}: {people}{error}");
    assert_eq!(
        read(out, "result.json"),
        read("again", "result.json"),
        "{command}"
    );
}

/// A simulated board in its own process, killed when dropped. Its time waits for its host, so that
/// a stall of this computer is never host silence.
pub struct Board {
    process: Child,
    /// Address for `--device`.
    pub at: String,
}

impl Board {
    pub fn serve(folder: &Path, wire: &[&str]) -> Self {
        Self::start(folder, &[wire, &["--wait-for-host"]].concat())
    }

    /// Serves a board whose time does not wait.
    #[cfg(unix)]
    pub fn in_real_time(folder: &Path) -> Self {
        Self::start(folder, &["--tcp", "127.0.0.1:0"])
    }

    fn start(folder: &Path, wire: &[&str]) -> Self {
        let mut command = flexor_command(folder, &["--json", "serve", "--seconds", "600"]);
        let mut process = command.args(wire).stdout(Stdio::piped()).spawn().unwrap();
        let mut line = String::new();
        let stdout = process.stdout.take().unwrap();
        BufReader::new(stdout).read_line(&mut line).unwrap();
        let hello: serde_json::Value = serde_json::from_str(&line).unwrap();
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
