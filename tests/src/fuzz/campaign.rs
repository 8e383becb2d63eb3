//! Many inputs of one target, on all cores, interruptible at any of them.

use super::Target;
use super::mutate::mutation;
use rayon::prelude::*;
use std::cell::RefCell;
use std::ops::Range;
use std::panic::{self, AssertUnwindSafe, PanicHookInfo};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, Once};
use std::time::{Duration, Instant};

/// Which inputs: those of these numbers of stream `seed`.
pub struct Campaign<'a> {
    /// What is run.
    pub target: &'a Target,
    /// What the inputs are like; not empty.
    pub corpus: Vec<Vec<u8>>,
    /// The stream.
    pub seed: u64,
    /// The numbers.
    pub inputs: Range<u64>,
}

/// An input that broke a promise, and which.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Find {
    /// Its number.
    pub index: u64,
    /// Itself.
    pub input: Vec<u8>,
    /// What the panic said, and where.
    pub told: String,
}

/// One input may take this long; a simulator that goes on for longer does not end.
const LONGEST: Duration = Duration::from_secs(60);

/// A block is about this long: so long an interruption waits.
const BLOCK: Duration = Duration::from_millis(500);

impl Campaign<'_> {
    /// Runs until the end or until `ask` says to stop; `ask` hears, between two blocks, how
    /// many are done and what has been found. How many were run without a gap from the
    /// first, and one find for each place that a promise was broken at.
    pub fn run(&self, mut ask: impl FnMut(u64, &[Find]) -> bool) -> (u64, Vec<Find>) {
        let finds = Mutex::new(Vec::<Find>::new());
        let (mut next, mut block) = (self.inputs.start, 1);
        while next < self.inputs.end {
            let end = (next + block).min(self.inputs.end);
            let since = Instant::now();
            (next..end).into_par_iter().for_each(|index| {
                if let Some(find) = self.run_input(index) {
                    let mut finds = finds.lock().expect("no panic while it is held");
                    let known = finds.iter_mut().find(|item| item.told == find.told);
                    match known {
                        Some(known) if known.index <= find.index => {}
                        Some(known) => *known = find,
                        None => finds.push(find),
                    }
                }
            });
            next = end;
            block = match since.elapsed() < BLOCK {
                true => (block * 2).min(1 << 20),
                false => (block / 2).max(1),
            };
            let finds = finds.lock().expect("no panic while it is held");
            if !ask(next - self.inputs.start, &finds) {
                break;
            }
        }
        let mut finds = finds.into_inner().expect("no panic while it is held");
        finds.sort_by_key(|find| find.index);
        (next - self.inputs.start, finds)
    }

    fn run_input(&self, index: u64) -> Option<Find> {
        let input = mutation(&self.corpus, self.seed, index);
        let told = broken_promise(self.target.function, &input)?;
        Some(Find { index, input, told })
    }
}

/// What `input` breaks, if it breaks anything; a panic is not printed then.
#[must_use]
pub fn broken_promise(function: fn(&[u8]), input: &[u8]) -> Option<String> {
    install_panic_hook();
    SAID.set(Some(String::new()));
    let done = panic::catch_unwind(AssertUnwindSafe(|| {
        // Twice: a program that was held, as by Ctrl-Z, took as long.
        is_long(function, input) && is_long(function, input)
    }));
    let said = SAID.take();
    match done {
        Ok(is_long) => is_long.then(|| format!("it takes more than {LONGEST:?}")),
        Err(_) => said,
    }
}

fn is_long(function: fn(&[u8]), input: &[u8]) -> bool {
    let since = Instant::now();
    function(input);
    since.elapsed() > LONGEST
}

thread_local! {
    /// What the last panic of this thread said, while it is listened to.
    static SAID: RefCell<Option<String>> = const { RefCell::new(None) };
}

/// From now on panics of threads that are listened to are kept and not printed.
fn install_panic_hook() {
    static NOTED: Once = Once::new();
    NOTED.call_once(|| {
        let print = panic::take_hook();
        panic::set_hook(Box::new(move |info| {
            if SAID.with_borrow(Option::is_some) {
                SAID.set(Some(panic_text(info)));
            } else {
                print(info);
            }
        }));
    });
}

/// The place decides which finds are the same, so it comes first, and numbers that differ
/// from input to input are left to the file.
fn panic_text(info: &PanicHookInfo<'_>) -> String {
    let place = info.location().map(ToString::to_string);
    let said = info.payload_as_str().unwrap_or("a panic without words");
    let line = said.lines().next().unwrap_or_default().chars();
    let words: String = line.filter(|c| !c.is_ascii_digit()).take(160).collect();
    format!("{}: {words}", place.unwrap_or_default())
}

/// Every file in these folders of the repository, by name, but for schemas.
///
/// # Panics
/// If one cannot be read: they are committed.
#[must_use]
pub fn corpus(folders: &[&str]) -> Vec<Vec<u8>> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut inputs = Vec::new();
    for folder in folders {
        let folder = root.join(folder);
        let entries = std::fs::read_dir(&folder);
        let entries = entries.unwrap_or_else(|why| panic!("{}: {why}", folder.display()));
        let mut paths: Vec<_> = entries.flatten().map(|entry| entry.path()).collect();
        paths.sort();
        let is_input = |path: &&PathBuf| path.is_file() && !path.ends_with("schema.json");
        let files = paths.iter().filter(is_input);
        inputs.extend(files.map(|path| std::fs::read(path).expect("a committed file")));
    }
    inputs
}
