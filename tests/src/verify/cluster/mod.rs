//! `cargo verify cluster`: studies as job arrays of a Slurm cluster on this machine alone.
//!
//! Not part of an ordinary run, because it installs a cluster's programs and must run as root. The
//! script is that of docs/reference/laboratory.md.

mod daemons;
mod jobs;

use super::Workspace;
use super::command::{Finished, execute, execute_with};
use super::console::Console;
use super::report::Report;
use super::setup;
use anyhow::Context;
use daemons::Cluster;
use jobs::Array;
use std::fs;
use std::path::Path;

/// Document with the script of an array.
const DOCUMENT: &str = "docs/reference/laboratory.md";
/// Command in the script, which is replaced by each of [`KINDS`].
const SHOWN: &str = "sweep harris-wall --draws 10000";
/// Name of the folders in the script.
const FOLDERS: &str = "walls";

/// Required programs: name, package, description.
const PROGRAMS: [[&str; 3]; 2] = [
    [
        "slurmctld",
        "slurm-wlm",
        "Slurm, the job scheduler of a cluster",
    ],
    [
        "munged",
        "munge",
        "MUNGE, with which Slurm's programs authenticate each other",
    ],
];

/// Studies: one from a declaration, one of cells, and one campaign of faults, each with folder
/// name, command and merge command.
const KINDS: [[&str; 3]; 3] = [
    ["walls", "sweep harris-wall --draws 24", "sweep harris-wall"],
    [
        "points",
        "two-points --cell 15 --seed 1001 --draws 16",
        "two-points",
    ],
    [
        "faults",
        "faults --class link --device native --seed 1000 --draws 200",
        "faults --class link --device native",
    ],
];

/// Study with random wearers, one task of which is requeued. Each wearer takes 41 sessions, which
/// are computed in some seconds.
const REQUEUED: [&str; 3] = ["lee", "sweep lee --draws 1", "sweep lee"];

/// Runs every kind as an array, and one with a requeued task.
pub(super) fn run(at: &Workspace, console: &mut Console) -> anyhow::Result<Report> {
    let user = execute(at, console, "id", &["-u"])?;
    if user.lines != ["0"] {
        let why = "a Slurm node starts tasks as their users and therefore needs root: run `cargo \
                   verify cluster` as root, for example in a container";
        return Ok(Report::fail(vec![why.to_owned()]));
    }
    let mut report = Report::default();
    for program in PROGRAMS {
        report.add(setup::ensure_installed(at, console, program, "-V")?);
    }
    let build = ["build", "-p", "host-tool", "--bin", "flexor"];
    let built = execute(at, console, "cargo", &build)?;
    report.add(built.report("cargo build"));
    let script = script(&at.root.join(DOCUMENT))?;
    if report.failed > 0 {
        return Ok(report);
    }
    let cluster = Cluster::start(at, console)?;
    for kind in KINDS {
        let array = Array::new(kind, &script);
        let came = array.check_merged(at, console, &cluster);
        report.add(came.unwrap_or_else(Report::from_error));
    }
    let array = Array::new(REQUEUED, &script);
    let came = array.check_requeued(at, console, &cluster);
    report.add(came.unwrap_or_else(Report::from_error));
    if report.failed > 0 {
        report.lines.extend(cluster.log_tails());
    }
    Ok(report)
}

/// Returns the array script of the document, from `#!/bin/sh` to its end.
fn script(document: &Path) -> anyhow::Result<String> {
    let text = fs::read_to_string(document)
        .with_context(|| format!("{} cannot be read", document.display()))?;
    let shown = || format!("{} contains no job array script", document.display());
    let (_, text) = text.split_once("    #!/bin/sh\n").with_context(shown)?;
    let (script, _) = text.split_once("\n\n").with_context(shown)?;
    let lines = script
        .lines()
        .map(|line| line.trim_start().to_owned() + "\n");
    let script: String = lines.collect();
    let is_known = script.contains(SHOWN) && script.contains(FOLDERS) && script.contains("#SBATCH");
    anyhow::ensure!(
        is_known,
        "{DOCUMENT}: the job array script does not run `{SHOWN}`"
    );
    Ok(format!("#!/bin/sh\n{script}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_document_shows_the_script_of_an_array() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
        let script = script(&root.join(DOCUMENT)).unwrap();
        assert!(
            script.ends_with("--out walls-$SLURM_ARRAY_TASK_ID\n"),
            "{script}"
        );
        let [name, draws, _] = KINDS[2];
        let own = jobs::study_script([name, draws, ""], &script);
        assert!(own.contains("flexor faults --class link"), "{own}");
        assert!(own.contains("--out faults-$SLURM_ARRAY_TASK_ID"), "{own}");
        assert!(!own.contains("harris") && !own.contains("walls"), "{own}");
    }
}
