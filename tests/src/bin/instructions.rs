//! `cargo instructions`: measures the cost of one session second in the native simulator, in
//! processor instructions, which depend neither on the load nor on the clock of the computer.
//! Builds the release `flexor`, runs sessions under callgrind, prints a table, and fails if one
//! costs more than its budget.
//!
//! `cargo instructions --dev` does the same for the first seconds of each session with the program
//! of the development profile, which the tests build too; `cargo verify` runs it. `--keep DIR`
//! leaves callgrind's files there, for `callgrind_annotate`.

use anyhow::{Context, bail};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

/// Sessions and the budget of one second of each, in millions of instructions. First the release
/// program's: the least that it has cost so far, and a small margin; it costs more today
/// (docs/how/architecture.md). Then that of the first [`DEV_SECONDS`] with the development profile: the
/// present cost and 5 %, so that it does not grow unnoticed.
const SESSIONS: [(&str, f64, f64); 3] = [
    ("ten_channels_and_finger", 10.5, 36.6),
    ("hamana_exp4_two_point_finger", 7.2, 25.5),
    ("full_load", 13.4, 40.7),
];

/// Length of a session with the development profile, s.
const DEV_SECONDS: f64 = 3.0;

/// Selects the C library's generic functions, so that the count is the same on all processors of
/// this kind.
const TUNABLES: &str =
    "glibc.cpu.hwcaps=-AVX,-AVX2,-AVX512F,-AVX512VL,-BMI2,-ERMS,-FMA,-FMA4,-FSRM,-RTM,-XSAVEC";

fn main() -> anyhow::Result<ExitCode> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let (is_dev, keep) = match words.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        [] => (false, None),
        ["--dev"] => (true, None),
        ["--keep", folder] => (false, Some(PathBuf::from(folder))),
        ["--dev", "--keep", folder] => (true, Some(PathBuf::from(folder))),
        _ => bail!("usage: cargo instructions [--dev] [--keep DIR]"),
    };
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    let root = package.parent().context("the package is in a workspace")?;
    let flexor = build(root, is_dev)?;
    let scratch = std::env::temp_dir().join(format!("flexor-instructions-{}", std::process::id()));
    let files = keep.as_deref().unwrap_or(&scratch);
    std::fs::create_dir_all(files)?;
    std::fs::create_dir_all(&scratch)?;
    println!("GLIBC_TUNABLES={TUNABLES}");
    println!(
        "{:<28} {:>4} {:>14} {:>10} {:>7}",
        "session", "s", "instructions", "M per s", "budget"
    );
    let mut is_within = true;
    for (name, of_release, of_dev) in SESSIONS {
        let mut session = root.join(format!("host-tool/sessions/{name}.toml"));
        let mut budget = of_release;
        if is_dev {
            budget = of_dev;
            session = shortened(&session, &scratch.join(format!("{name}.toml")))?;
        }
        let seconds = duration_s(&session)?;
        let count = instructions(
            &flexor,
            &session,
            &files.join(format!("{name}.callgrind")),
            &scratch.join(name),
        )?;
        let rate = count as f64 / seconds * 1e-6;
        let mark = if rate > budget { "  above budget" } else { "" };
        println!("{name:<28} {seconds:>4} {count:>14} {rate:>10.2} {budget:>7}{mark}");
        is_within &= rate <= budget;
    }
    if !is_dev {
        measure_model_choice(root, &flexor, files, &scratch)?;
    }
    let _ = std::fs::remove_dir_all(&scratch); // a leftover folder does no harm
    Ok(ExitCode::from(u8::from(!is_within)))
}

/// Writes the session at `path` to `copy`, with a length of [`DEV_SECONDS`], and returns `copy`.
fn shortened(path: &Path, copy: &Path) -> anyhow::Result<PathBuf> {
    let mut table: toml::Table = std::fs::read_to_string(path)?.parse()?;
    table.insert("duration_s".into(), DEV_SECONDS.into());
    table.remove("measure"); // its window lies later
    std::fs::write(copy, table.to_string())?;
    Ok(copy.to_owned())
}

/// Measures the choice of ten muscle models for 30 s of forces on fatiguing muscles.
fn measure_model_choice(
    root: &Path,
    flexor: &Path,
    files: &Path,
    scratch: &Path,
) -> anyhow::Result<()> {
    let shipped = root.join("host-tool/sessions/ten_forces.toml");
    let text = std::fs::read_to_string(shipped)?
        .replace("duration_s = 6.0", "duration_s = 30.0")
        .replace("slope_per_unit", "fatigue = {}, slope_per_unit");
    let session = scratch.join("choosing.toml");
    std::fs::write(&session, text)?;
    let seconds = duration_s(&session)?;
    let mut command = callgrind(flexor, &files.join("choosing.callgrind"));
    let count = count_instructions(command.arg("explain-model").arg(&session))?;
    let rate = count as f64 / seconds * 1e-6;
    let name = "model choice, ten forces";
    println!("{name:<28} {seconds:>4} {count:>14} {rate:>10.2}");
    Ok(())
}

/// Builds `flexor` with the release or the development profile, and returns its path.
fn build(root: &Path, is_dev: bool) -> anyhow::Result<PathBuf> {
    let profile = if is_dev { "dev" } else { "release" };
    let arguments = format!("build --quiet --profile {profile} --package host-tool --bin flexor");
    let status = Command::new("cargo")
        .args(arguments.split(' '))
        .current_dir(root)
        .status()?;
    if !status.success() {
        bail!("`cargo {arguments}` failed");
    }
    // This program is <target>/debug/instructions.
    let program = std::env::current_exe()?;
    let target = program
        .ancestors()
        .nth(2)
        .context("run this program through cargo")?;
    Ok(target.join(if is_dev {
        "debug/flexor"
    } else {
        "release/flexor"
    }))
}

/// Returns the length of the session in the file at `path`, s.
fn duration_s(path: &Path) -> anyhow::Result<f64> {
    let text = std::fs::read_to_string(path);
    let text = text.with_context(|| format!("cannot read {}", path.display()))?;
    let table: toml::Table = text.parse()?;
    let duration = table.get("duration_s").and_then(toml::Value::as_float);
    duration.with_context(|| format!("{}: no duration_s", path.display()))
}

/// Runs `session` into the record `out` under callgrind, which writes `profile`. Returns the
/// instruction count.
fn instructions(flexor: &Path, session: &Path, profile: &Path, out: &Path) -> anyhow::Result<u64> {
    let mut command = callgrind(flexor, profile);
    count_instructions(command.arg("run").arg(session).arg("--out").arg(out))
}

/// Returns a command that runs `flexor` under callgrind, which writes `profile`.
fn callgrind(flexor: &Path, profile: &Path) -> Command {
    let mut command = Command::new("valgrind");
    command
        .arg("--tool=callgrind")
        .arg(format!("--callgrind-out-file={}", profile.display()))
        .arg(flexor)
        .env("GLIBC_TUNABLES", TUNABLES);
    command
}

/// Runs the command and returns callgrind's instruction count.
fn count_instructions(command: &mut Command) -> anyhow::Result<u64> {
    let ran = command
        .output()
        .context("valgrind cannot be started: install the package valgrind")?;
    let report = String::from_utf8_lossy(&ran.stderr);
    if !ran.status.success() {
        bail!("flexor failed under valgrind:\n{report}");
    }
    let count = report
        .lines()
        .find_map(|line| line.split_once("Collected : "));
    let (_, count) =
        count.with_context(|| format!("callgrind reported no instruction count:\n{report}"))?;
    Ok(count.trim().parse()?)
}
