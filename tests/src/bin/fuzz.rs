//! `cargo run --release -p tests --bin fuzz -- TARGET`: a long fuzz run on the stable compiler, see
//! docs/evidence/fuzz.md.

use anyhow::Context;
use clap::Parser;
use indicatif::{ProgressBar, ProgressStyle};
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::{Duration, Instant};
use tests::fuzz::{self, Campaign, Find, TARGETS, Target};

/// Run mutated inputs from a target's corpus and save those that fail
#[derive(Parser)]
#[command(name = "fuzz")]
struct Arguments {
    /// Target to fuzz
    #[arg(value_parser = targets())]
    target: String,
    /// Number of inputs
    #[arg(long, default_value_t = 1_000_000)]
    runs: u64,
    /// Seed of the stream of inputs
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Number of the first input, to continue another run
    #[arg(long, default_value_t = 0)]
    from: u64,
    /// Number of threads; default: all cores
    #[arg(long)]
    threads: Option<usize>,
    /// Run the inputs in these files instead
    #[arg(long, num_args = 1..)]
    input: Vec<PathBuf>,
    /// Print one line of JSON
    #[arg(long)]
    json: bool,
}

fn targets() -> clap::builder::PossibleValuesParser {
    let known_targets = TARGETS.iter();
    let value = |target: &Target| clap::builder::PossibleValue::new(target.name).help(target.about);
    known_targets.map(value).collect::<Vec<_>>().into()
}

fn main() -> anyhow::Result<ExitCode> {
    let arguments = Arguments::parse();
    let mut known_targets = TARGETS.iter();
    let target = known_targets.find(|target| target.name == arguments.target);
    let target = target.context("a target")?; // clap has checked this
    if !arguments.input.is_empty() {
        return run_files(target, &arguments.input);
    }
    let end = arguments.from.checked_add(arguments.runs);
    let end = end.context("E782 --from plus --runs is above 2^64: use smaller numbers")?;
    if let Some(threads) = arguments.threads {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        pool.build_global()
            .context("E782 this number of --threads cannot be started; give a smaller one")?;
    }
    let signal = catch_signals()?;
    let campaign = Campaign {
        target,
        corpus: fuzz::corpus(target.corpus),
        seed: arguments.seed,
        inputs: arguments.from..end,
    };
    let since = Instant::now();
    let (shown, mut kept) = (ProgressDisplay::new(&arguments), Vec::new());
    // Finds are saved at once, so that a killed run keeps them.
    let mut lost = Ok(());
    let (done, finds) = campaign.run(|done, finds| {
        shown.show(done, finds.len());
        lost = finds.iter().skip(kept.len()).try_for_each(|find| {
            kept.push(save_find(&arguments, find)?);
            anyhow::Ok(())
        });
        lost.is_ok() && signal.load(Ordering::Relaxed) == 0
    });
    lost?;
    shown.bar.finish_and_clear();
    print_summary(&arguments, done, &kept, since.elapsed());
    Ok(match (signal.load(Ordering::Relaxed), finds.is_empty()) {
        (_, false) => ExitCode::from(1),
        (signal @ 1.., true) if done < arguments.runs => ExitCode::from(128 + signal as u8),
        _ => ExitCode::SUCCESS,
    })
}

/// Returns the number of the first signal, 0 before; a second signal ends the program at once.
fn catch_signals() -> anyhow::Result<Arc<AtomicUsize>> {
    let (signal, again) = (
        Arc::new(AtomicUsize::new(0)),
        Arc::new(AtomicBool::new(false)),
    );
    for number in [SIGINT, SIGTERM] {
        flag::register_conditional_shutdown(number, 128 + number, again.clone())?;
        flag::register(number, again.clone())?;
        flag::register_usize(number, signal.clone(), number as usize)?;
    }
    Ok(signal)
}

/// Progress: a bar on a terminal, one line per minute elsewhere.
struct ProgressDisplay<'a> {
    arguments: &'a Arguments,
    bar: ProgressBar,
    since: Instant,
    minutes: AtomicUsize,
}

impl<'a> ProgressDisplay<'a> {
    fn new(arguments: &'a Arguments) -> Self {
        let bar = ProgressBar::new(arguments.runs); // hidden without a terminal
        let style = "{msg} {wide_bar} {human_pos}/{human_len} {per_sec} {eta}";
        if let Ok(style) = ProgressStyle::with_template(style) {
            bar.set_style(style);
        }
        let (since, minutes) = (Instant::now(), AtomicUsize::new(0));
        Self {
            arguments,
            bar,
            since,
            minutes,
        }
    }

    fn show(&self, done: u64, finds: usize) {
        let name = &self.arguments.target;
        self.bar.set_position(done);
        self.bar.set_message(format!("{name}, {finds} failures"));
        let minute = (self.since.elapsed().as_secs() / 60) as usize;
        if self.bar.is_hidden() && self.minutes.swap(minute, Ordering::Relaxed) != minute {
            let (seed, from) = (self.arguments.seed, self.arguments.from);
            eprintln!("{name}, seed {seed}: {done} inputs from number {from}, {finds} failures");
        }
    }
}

/// Prints the number of inputs, the finds and the rate.
fn print_summary(arguments: &Arguments, done: u64, kept: &[PathBuf], time: Duration) {
    let (name, seed, from) = (&arguments.target, arguments.seed, arguments.from);
    let (seconds, finds) = (time.as_secs_f64(), kept.len());
    let rate = done as f64 / seconds;
    if arguments.json {
        let found = serde_json::json!({
            "target": name, "seed": seed, "from": from, "done": done, "asked": arguments.runs,
            "seconds": seconds, "finds": kept,
        });
        println!("{found}");
    } else {
        println!(
            "{name}, seed {seed}: {done} inputs from number {from} in {seconds:.0} s ({rate:.0} \
             per second), {finds} failures"
        );
    }
    if done < arguments.runs {
        let (next, rest) = (from + done, arguments.runs - done);
        eprintln!(
            "E781 interrupted; continue with: {name} --seed {seed} --from {next} --runs {rest}"
        );
    }
}

/// Saves a find as a file, and prints its path.
fn save_find(arguments: &Arguments, find: &Find) -> anyhow::Result<PathBuf> {
    let (name, seed) = (&arguments.target, arguments.seed);
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("fuzz/artifacts")
        .join(name);
    let file = folder.join(format!("{seed}-{}", find.index));
    let written =
        std::fs::create_dir_all(&folder).and_then(|()| std::fs::write(&file, &find.input));
    let place = file.display();
    written.with_context(|| {
        format!("E782 the input cannot be saved in {place}; check permissions and free space")
    })?;
    eprintln!(
        "E780 {name}: input {} of seed {seed} fails: {}; the input is saved in {place}; repeat it \
         with --input {place}",
        find.index, find.told
    );
    Ok(file)
}

/// Runs each file once; a panic is printed as it comes.
fn run_files(target: &Target, files: &[PathBuf]) -> anyhow::Result<ExitCode> {
    for file in files {
        let input = std::fs::read(file).with_context(|| {
            format!(
                "E782 the input file {} cannot be read; check the path and the permissions",
                file.display()
            )
        })?;
        (target.function)(&input);
        println!("{}: {} passes", target.name, file.display());
    }
    Ok(ExitCode::SUCCESS)
}
