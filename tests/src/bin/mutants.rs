//! `cargo run -p tests --bin mutants`: measures how many code changes the proofs of docs/how/safety.md
//! detect. Runs them against a random sample of the mutants of `firmware/src/safety` and of
//! `firmware/src/device/pulser`.

use anyhow::{Context, ensure};
use clap::Parser;
use host_core::statistics::share_upper_bound;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};
use tests::mutants::{Mutant, Proof, parse_proofs, shuffled};

/// Files whose mutants are listed; test code has none.
const FILES: [&str; 3] = [
    "firmware/src/safety/**/*.rs",
    "firmware/src/device/pulser/mod.rs",
    "firmware/src/device/pulser/**/*.rs",
];

/// Test programs in the order in which they run, the fastest to build first: package, cargo's
/// options for the program, folder of its proofs. Each runs against the mutants that survived the
/// earlier programs. The proofs of other packages do not run.
const STAGES: [(&str, &[&str], &str); 4] = [
    ("firmware", &["--lib"], "firmware/src/"),
    ("firmware", &["--test", "suite"], "firmware/tests/"),
    ("tests", &["--test", "suite"], "tests/tests/"),
    ("studies", &["--test", "suite"], "host-tool/studies/tests/"),
];

/// Build settings with which firmware rebuilds in seconds after a small change. The code behaves
/// the same, but needs more than the 2 MiB of stack of a test thread.
const QUICK: [&str; 3] = [
    "profile.dev.package.firmware.opt-level=1",
    "profile.dev.package.firmware.codegen-units=64",
    "profile.dev.package.firmware.debug=0",
];

/// Run the proofs of docs/how/safety.md against mutants of the code that they cover
#[derive(Parser)]
#[command(name = "mutants")]
struct Arguments {
    /// Number of mutants that compile
    #[arg(long, default_value_t = 60)]
    count: usize,
    /// Seed of the random order
    #[arg(long, default_value_t = 42_015)]
    seed: u64,
    /// Number of programs to run, in this order: firmware's unit tests, its suite, `tests`,
    /// `studies`
    #[arg(long, default_value_t = STAGES.len())]
    stages: usize,
    /// Run every test of these programs, not only the proofs
    #[arg(long)]
    every_test: bool,
    /// Run only the mutants with these numbers in the random order
    #[arg(long, value_delimiter = ',')]
    only: Vec<usize>,
    /// Folder for a checkout of HEAD and its builds; a second run is faster
    #[arg(long, default_value_os_t = std::env::temp_dir().join("flexor-mutants"))]
    work: PathBuf,
    /// Print one line of JSON
    #[arg(long)]
    json: bool,
}

/// Outcome of one mutant.
#[derive(Clone, PartialEq, Eq, Debug, serde::Serialize)]
enum MutantResult {
    /// The mutant does not compile and does not count.
    Unviable,
    /// A proof failed, or the test program crashed.
    Killed {
        stage: usize,
        by: Vec<String>,
    },
    /// The proofs ran four times as long as without the mutant, plus a minute; counts as killed.
    TimedOut {
        stage: usize,
    },
    Survived,
}

/// Mutant with its number in the random order and its outcome.
type MutantVerdict = (usize, Mutant, MutantResult);

fn main() -> anyhow::Result<()> {
    let arguments = Arguments::parse();
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent();
    let root = root.context("the package is in a workspace")?;
    let bench = Bench::set_up(root, &arguments.work)?;
    let order = shuffled(&bench.list_mutants()?, arguments.seed)?;
    let listed = order.len();
    let page = fs::read_to_string(bench.tree.join("docs/how/safety.md"))?;
    let (proofs, mut run) = (parse_proofs(&page), 0);

    let candidates = (1..).zip(order);
    let is_wanted = |number: &usize| arguments.only.is_empty() || arguments.only.contains(number);
    let mut candidates = candidates.filter(|(number, _)| is_wanted(number));
    let mut judged: Vec<MutantVerdict> = Vec::new();
    for (stage, &(_, _, folder)) in STAGES.iter().enumerate().take(arguments.stages) {
        let of_stage = |proof: &&Proof| proof.file.starts_with(folder);
        let proofs: Vec<_> = proofs.iter().filter(of_stage).cloned().collect();
        let mut program = Program::with_proofs(&bench, stage, proofs)?;
        run += program.proofs.len();
        program.is_whole = arguments.every_test;
        program.measure_duration(&bench)?;
        if stage == 0 {
            let is_viable = |judged: &&MutantVerdict| judged.2 != MutantResult::Unviable;
            while judged.iter().filter(is_viable).count() < arguments.count {
                let Some((number, mutant)) = candidates.next() else {
                    break;
                };
                let fate = program.judge(&bench, &mutant)?;
                show(number, &mutant, &fate);
                judged.push((number, mutant, fate));
            }
        } else {
            let survivors = judged.iter_mut().filter(|j| j.2 == MutantResult::Survived);
            for (number, mutant, fate) in survivors {
                *fate = program.judge(&bench, mutant)?;
                show(*number, mutant, fate);
            }
        }
    }
    print_summary(&arguments, (listed, run), &judged)
}

/// Separate checkout for mutations, so that the workspace stays unchanged.
struct Bench {
    tree: PathBuf,
    work: PathBuf,
}

impl Bench {
    fn set_up(root: &Path, work: &Path) -> anyhow::Result<Self> {
        let (tree, work) = (work.join("tree"), work.to_owned());
        fs::create_dir_all(&work)?;
        let git = |arguments: &[&str]| {
            let status = Command::new("git")
                .args(["-C", &root.to_string_lossy()])
                .args(arguments)
                .status()?;
            ensure!(status.success(), "git {} failed", arguments.join(" "));
            anyhow::Ok(())
        };
        let path = tree.to_string_lossy();
        if tree.exists() {
            git(&["worktree", "remove", "--force", &path])?;
        }
        git(&["worktree", "add", "--quiet", "--detach", &path, "HEAD"])?;
        Ok(Self { tree, work })
    }

    /// Returns the output of cargo-mutants, JSON.
    fn list_mutants(&self) -> anyhow::Result<String> {
        let mut command = Command::new("cargo");
        command.args(["mutants", "--list", "--json", "--package", "firmware"]);
        let files = FILES.iter().flat_map(|file| ["--file", file]);
        let output = command.args(files).current_dir(&self.tree).output()?;
        let words = String::from_utf8_lossy(&output.stderr);
        ensure!(
            output.status.success(),
            "cargo-mutants lists no mutants; install it with `cargo install cargo-mutants \
             --locked`\n{words}"
        );
        Ok(String::from_utf8(output.stdout)?)
    }

    /// Runs `cargo test` in the checkout for at most `limit`. Returns whether it succeeded, `None`
    /// if it was ended, and its output.
    fn cargo(&self, words: &[&str], limit: Duration) -> anyhow::Result<(Option<bool>, String)> {
        let path = self.work.join("words");
        let file = File::create(&path)?;
        // `timeout` ends all child processes, because a mutant may never return.
        let status = Command::new("timeout")
            .args(["--kill-after=5", &limit.as_secs().to_string()])
            .args(["cargo", "test"])
            .args(QUICK.iter().flat_map(|setting| ["--config", setting]))
            .args(words)
            .env("RUST_MIN_STACK", (32 << 20).to_string())
            .env("CARGO_TARGET_DIR", self.work.join("target"))
            .current_dir(&self.tree)
            .stdin(Stdio::null())
            .stdout(file.try_clone()?)
            .stderr(file)
            .status()
            .context("`timeout` of coreutils cannot be started")?;
        let words = String::from_utf8_lossy(&fs::read(path)?).into_owned();
        let is_over = matches!(status.code(), Some(124 | 137));
        Ok(((!is_over).then_some(status.success()), words))
    }
}

/// Time limit of a build, far above the time that any build takes.
const BUILD: Duration = Duration::from_secs(3600);

/// Test program with its proofs.
struct Program {
    stage: usize,
    /// Numbers of the proofs, and their names as libtest lists them.
    proofs: Vec<(String, String)>,
    /// Whether every test runs and not only the proofs.
    is_whole: bool,
    limit: Duration,
}

impl Program {
    /// Finds `proofs` among the program's tests.
    fn with_proofs(bench: &Bench, stage: usize, proofs: Vec<Proof>) -> anyhow::Result<Self> {
        let (_, words) = bench.cargo(&arguments(stage, &["--", "--list"]), BUILD)?;
        let tests = words.lines().filter_map(|line| line.strip_suffix(": test"));
        let tests: Vec<_> = tests.collect();
        let named = proofs.into_iter().map(|proof| {
            let path = proof.test_path(&tests);
            let path = path.with_context(|| format!("no test matches {proof:?}:\n{words}"))?;
            Ok((proof.number, path.to_owned()))
        });
        Ok(Self {
            stage,
            proofs: named.collect::<anyhow::Result<_>>()?,
            is_whole: false,
            limit: BUILD,
        })
    }

    /// Runs the program without a mutant, which must pass, and stores the time taken.
    fn measure_duration(&mut self, bench: &Bench) -> anyhow::Result<()> {
        let since = Instant::now();
        let (success, words) = self.run(bench)?;
        ensure!(
            success == Some(true),
            "a test fails without a mutant:\n{words}"
        );
        self.limit = since.elapsed() * 4 + Duration::from_secs(60);
        let (count, seconds) = (self.proofs.len(), since.elapsed().as_secs());
        eprintln!("{}: {count} proofs in {seconds} s", stage_name(self.stage));
        Ok(())
    }

    fn run(&self, bench: &Bench) -> anyhow::Result<(Option<bool>, String)> {
        let mut words = arguments(self.stage, &["--", "--format=pretty"]);
        if !self.is_whole {
            words.push("--exact");
            words.extend(self.proofs.iter().map(|(_, path)| path.as_str()));
        }
        bench.cargo(&words, self.limit)
    }

    fn judge(&self, bench: &Bench, mutant: &Mutant) -> anyhow::Result<MutantResult> {
        let path = bench.tree.join(&mutant.file);
        let text = fs::read_to_string(&path)?;
        fs::write(&path, mutant.apply(&text)?)?;
        let fate = self.judge_tree(bench);
        fs::write(&path, text)?;
        fate
    }

    fn judge_tree(&self, bench: &Bench) -> anyhow::Result<MutantResult> {
        let (built, words) = bench.cargo(&arguments(self.stage, &["--no-run"]), BUILD)?;
        let stage = self.stage;
        if built != Some(true) {
            ensure!(
                stage == 0,
                "the mutant compiled for an earlier test program, but not for this one:\n{words}"
            );
            return Ok(MutantResult::Unviable);
        }
        let (success, words) = self.run(bench)?;
        let lines = words.lines().filter_map(|line| line.strip_prefix("test "));
        let failed = lines.filter_map(|line| line.strip_suffix(" ... FAILED"));
        let number = |failed: &str| {
            let proof = self.proofs.iter().find(|(_, path)| path == failed);
            proof.map_or(failed, |(number, _)| number).to_owned()
        };
        let mut by: Vec<_> = failed.map(number).collect();
        Ok(match success {
            None => MutantResult::TimedOut { stage },
            Some(true) => MutantResult::Survived,
            Some(false) => {
                if by.is_empty() {
                    by.push("crash".to_owned());
                }
                MutantResult::Killed { stage, by }
            }
        })
    }
}

fn arguments<'a>(stage: usize, more: &[&'a str]) -> Vec<&'a str> {
    let (package, target, _) = STAGES[stage];
    [&["-p", package], target, more].concat()
}

fn stage_name(stage: usize) -> String {
    let (package, target, _) = STAGES[stage];
    format!("{package} {}", target.join(" "))
}

/// Formats the outcome of one mutant as a line of text.
fn line(number: usize, mutant: &Mutant, fate: &MutantResult) -> String {
    let fate = match fate {
        MutantResult::Unviable => "does not compile".to_owned(),
        MutantResult::Killed { by, .. } => by.join(" "),
        MutantResult::TimedOut { stage } => format!("timeout of {}", stage_name(*stage)),
        MutantResult::Survived => "survived".to_owned(),
    };
    let mutant = mutant.name.replace('\n', " ");
    format!("{number:>3} {mutant}\n      {fate}")
}

fn show(number: usize, mutant: &Mutant, fate: &MutantResult) {
    eprintln!("{}", line(number, mutant, fate));
}

/// Prints each outcome, the counts, and the share of detected mutants with its interval.
fn print_summary(
    arguments: &Arguments,
    (listed, run): (usize, usize),
    judged: &[MutantVerdict],
) -> anyhow::Result<()> {
    let count = |is: &dyn Fn(&MutantResult) -> bool| judged.iter().filter(|j| is(&j.2)).count();
    let unviable = count(&|fate| *fate == MutantResult::Unviable);
    let survived = count(&|fate| *fate == MutantResult::Survived);
    let timed_out = count(&|fate| matches!(fate, MutantResult::TimedOut { .. }));
    let killed =
        |at: usize| count(&|f| matches!(f, MutantResult::Killed { stage, .. } if *stage == at));
    let stages: Vec<_> = (0..STAGES.len())
        .map(|at| (stage_name(at), killed(at)))
        .collect();
    let viable = judged.len() - unviable;
    let noticed = viable - survived;
    let share = noticed as f64 / viable as f64;
    // Two Clopper–Pearson bounds of 97.5 % each.
    let low = 1.0 - share_upper_bound(survived as u64, viable as u64, 0.975)?;
    let high = share_upper_bound(noticed as u64, viable as u64, 0.975)?;
    if arguments.json {
        let found = serde_json::json!({
            "seed": arguments.seed, "listed": listed, "proofs": run, "mutants": judged,
            "viable": viable, "noticed": noticed, "share": share, "low": low, "high": high,
        });
        println!("{found}");
        return Ok(());
    }
    for (number, mutant, fate) in judged {
        println!("{}", line(*number, mutant, fate));
    }
    let seed = arguments.seed;
    println!("{listed} mutants listed, seed {seed}, {viable} tried with {run} proofs");
    for (name, killed) in stages.iter().take(arguments.stages) {
        println!("{killed:>4} killed by {name}");
    }
    println!("{timed_out:>4} timed out, which counts as killed");
    println!("{survived:>4} survived");
    println!("{unviable:>4} more do not compile and do not count");
    let [share, low, high] = [share, low, high].map(|share| share * 100.0);
    println!(
        "{noticed} of {viable} mutants are detected: {share:.1} % (95 % Clopper-Pearson interval \
         {low:.1} to {high:.1} %)"
    );
    Ok(())
}
