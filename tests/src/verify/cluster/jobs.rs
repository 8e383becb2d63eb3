//! A study as a cluster's job array, compared with the same study in one run.

use super::daemons::Cluster;
use super::{Console, FOLDERS, Report, SHOWN, Workspace};
use anyhow::{Context, ensure};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::thread::sleep;
use std::time::{Duration, Instant};

/// Number of tasks in an array.
const TASKS: usize = 8;
/// Longest time of an array.
const PATIENCE: Duration = Duration::from_secs(900);
/// Interval between two checks of the tasks.
const LOOK: Duration = Duration::from_millis(100);
/// File with the finished units of a study, one line each.
const KEPT: &str = "units.jsonl";
/// Smallest number of finished units at which a task is requeued.
const BEGUN: usize = 3;

/// Study that an array computes.
pub(super) struct Array {
    name: &'static str,
    /// Command that computes the study in one run, without `--out`.
    draws: &'static str,
    /// Command that merges the array's results.
    merges: &'static str,
    script: String,
}

/// Returns the document's script for another study, given the name of its folders and its command.
pub(super) fn study_script([name, draws, _]: [&str; 3], script: &str) -> String {
    script.replace(SHOWN, draws).replace(FOLDERS, name)
}

impl Array {
    /// Creates the array of a study, given the name of its folders, its command and its merge
    /// command.
    pub fn new(kind: [&'static str; 3], script: &str) -> Self {
        let [name, draws, merges] = kind;
        Self {
            name,
            draws,
            merges,
            script: study_script(kind, script),
        }
    }

    /// Checks that the merged array equals the single run, byte for byte.
    ///
    /// # Errors
    /// Fails if a program ends with an error, or not in time.
    pub fn check_merged(
        &self,
        at: &Workspace,
        console: &mut Console,
        cluster: &Cluster,
    ) -> anyhow::Result<Report> {
        let begin = Instant::now();
        let job = self.submit(at, console, cluster)?;
        while self.is_running(at, console, cluster, &job)? {
            ensure!(
                begin.elapsed() < PATIENCE,
                "{}: the jobs did not end in time",
                self.name
            );
            sleep(LOOK);
        }
        self.compare(at, console, cluster, String::new())
    }

    /// Checks that an array also equals the single run if its first task is requeued and continues
    /// from its finished units.
    ///
    /// # Errors
    /// Returns the errors of [`Self::check_merged`].
    pub fn check_requeued(
        &self,
        at: &Workspace,
        console: &mut Console,
        cluster: &Cluster,
    ) -> anyhow::Result<Report> {
        let begin = Instant::now();
        let job = self.submit(at, console, cluster)?;
        let first = format!("{job}_1");
        let kept = cluster.folder().join(format!("{}-1", self.name)).join(KEPT);
        while lines(&kept) < BEGUN {
            ensure!(begin.elapsed() < PATIENCE, "{first} saved no units in time");
            sleep(LOOK);
        }
        let asked = cluster.run(at, console, "scontrol", &["requeue", &first])?;
        ensure!(
            asked.success,
            "scontrol requeue: {}",
            asked.lines.join("; ")
        );
        // The task ends in order, and waits for its turn.
        let waits = format!("{first} PENDING");
        while !self.states(at, console, cluster, &job)?.contains(&waits) {
            ensure!(
                begin.elapsed() < PATIENCE,
                "{first} did not end after the requeue"
            );
            sleep(LOOK);
        }
        let ended_with = lines(&kept);
        let mut least = ended_with;
        while self.is_running(at, console, cluster, &job)? {
            ensure!(
                begin.elapsed() < PATIENCE,
                "{}: the jobs did not end in time",
                self.name
            );
            least = least.min(lines(&kept));
            sleep(LOOK);
        }
        let total = lines(&kept);
        ensure!(
            ended_with < total,
            "{first} had finished all of its {total} units before the requeue, so the check proves \
             nothing"
        );
        ensure!(
            least == ended_with,
            "{first} started from the beginning: it kept {least} of {ended_with} units"
        );
        let asked = cluster.run(at, console, "scontrol", &["show", "job", &first])?;
        let restarts = asked.lines.iter().any(|line| line.contains("Restarts=1"));
        ensure!(restarts, "{first} was not restarted");
        let also =
            format!("; task 1, requeued after {ended_with} of {total} units, continued from there");
        self.compare(at, console, cluster, also)
    }

    /// Submits the array, and returns the job's number.
    fn submit(
        &self,
        at: &Workspace,
        console: &mut Console,
        cluster: &Cluster,
    ) -> anyhow::Result<String> {
        let script = cluster.folder().join(format!("{}.sh", self.name));
        fs::write(&script, &self.script)
            .with_context(|| format!("{} cannot be written", script.display()))?;
        let (array, within) = (
            format!("--array=1-{TASKS}"),
            format!("--chdir={}", cluster.folder().display()),
        );
        let script = script.display().to_string();
        let words = ["--parsable", &array, &within, &script];
        let asked = cluster.run(at, console, "sbatch", &words)?;
        let last = asked.lines.last().filter(|_| asked.success);
        let job = last.and_then(|line| line.split(';').next());
        let job = job.with_context(|| format!("sbatch: {}", asked.lines.join("; ")))?;
        Ok(job.to_owned())
    }

    /// Returns the tasks of a job that have not ended, with their states.
    fn states(
        &self,
        at: &Workspace,
        console: &mut Console,
        cluster: &Cluster,
        job: &str,
    ) -> anyhow::Result<Vec<String>> {
        let words = ["-h", "-j", job, "-o", "%i %T"];
        let asked = cluster.run(at, console, "squeue", &words)?;
        let lines = asked.lines.join("; ");
        ensure!(asked.success, "{}: squeue: {lines}", self.name);
        console.show_progress(&format!("{}: {lines}", self.name));
        Ok(asked.lines)
    }

    fn is_running(
        &self,
        at: &Workspace,
        console: &mut Console,
        cluster: &Cluster,
        job: &str,
    ) -> anyhow::Result<bool> {
        Ok(!self.states(at, console, cluster, job)?.is_empty())
    }

    /// Merges the array as in the document, runs the study in one run, and compares both.
    fn compare(
        &self,
        at: &Workspace,
        console: &mut Console,
        cluster: &Cluster,
        also: String,
    ) -> anyhow::Result<Report> {
        let (name, draws, merges) = (self.name, self.draws, self.merges);
        let folder = cluster.folder();
        for words in [
            format!("{merges} --merge {name}-* --out {name}"),
            format!("{draws} --out whole-{name}"),
        ] {
            let line = format!("cd {} && flexor {words}", folder.display());
            let done = cluster.run(at, console, "sh", &["-c", &line])?;
            let output = done.lines.join("\n");
            ensure!(
                done.success,
                "flexor {words}: {output}\n{}",
                self.logs(folder)
            );
        }
        let merged = files(&folder.join(name))?;
        let undivided_files = files(&folder.join(format!("whole-{name}")))?;
        let names: Vec<&String> = undivided_files.keys().collect();
        ensure!(
            merged.keys().eq(undivided_files.keys()) && names.len() > 3,
            "{name}: the merged run has {:?}, the undivided run {names:?}",
            merged.keys()
        );
        let differ = undivided_files
            .iter()
            .find(|(file, bytes)| merged.get(*file) != Some(bytes));
        if let Some((file, _)) = differ {
            let why = format!("{name}: {file} differs from that of the undivided run");
            return Ok(Report::fail(vec![why]));
        }
        let mut report = Report::pass();
        report.lines.push(format!(
            "{name}: {TASKS} tasks merged, {} files equal to those of the undivided run{also}",
            names.len()
        ));
        Ok(report)
    }

    /// Returns the logs of the tasks.
    fn logs(&self, folder: &Path) -> String {
        let entries = fs::read_dir(folder).into_iter().flatten().flatten();
        let logs = entries.map(|entry| entry.path());
        let is_log = |path: &PathBuf| path.extension().is_some_and(|end| end == "out");
        let texts = logs.filter(is_log).map(fs::read_to_string);
        texts.map(Result::unwrap_or_default).collect()
    }
}

/// Returns the number of complete lines of a file, 0 if it is missing.
fn lines(path: &Path) -> usize {
    let text = fs::read(path).unwrap_or_default();
    text.iter().filter(|byte| **byte == b'\n').count()
}

/// Returns the files of a folder with their bytes, except for the lock.
fn files(folder: &Path) -> anyhow::Result<BTreeMap<String, Vec<u8>>> {
    let unread = || format!("{} cannot be read", folder.display());
    let mut contents = BTreeMap::new();
    for entry in fs::read_dir(folder).with_context(unread)? {
        let path = entry.with_context(unread)?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        if name != ".lock" {
            contents.insert(name.into_owned(), fs::read(&path).with_context(unread)?);
        }
    }
    Ok(contents)
}
