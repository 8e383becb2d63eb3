//! Fuzz campaign: many inputs of one target, on all cores, interruptible between blocks of inputs.

use super::Target;
use super::mutate::mutation;
use rayon::prelude::*;
use std::cell::RefCell;
use std::ops::Range;
use std::panic::{self, AssertUnwindSafe, PanicHookInfo};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, Once};
use std::time::{Duration, Instant};

/// Inputs with a range of numbers from the stream `seed`.
pub struct Campaign<'a> {
    /// Target that receives the inputs.
    pub target: &'a Target,
    /// Inputs to mutate; not empty.
    pub corpus: Vec<Vec<u8>>,
    /// Seed of the stream.
    pub seed: u64,
    /// Numbers of the inputs in the stream.
    pub inputs: Range<u64>,
}

/// Input for which the tested code broke a promise.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Find {
    /// Number of the input in the stream.
    pub index: u64,
    /// Bytes of the input.
    pub input: Vec<u8>,
    /// Place and message of the panic.
    pub told: String,
}

/// Time limit of one input; a simulator that takes longer counts as endless.
const LONGEST: Duration = Duration::from_secs(60);

/// Approximate length of a block, and so the delay of an interruption.
const BLOCK: Duration = Duration::from_millis(500);

impl Campaign<'_> {
    /// Runs until the end or until `ask` returns `false`. Between two blocks `ask` gets the number
    /// of inputs done and the finds. Returns the number of inputs run without a gap from the first,
    /// and one find for each place at which a promise was broken.
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
        let promise = broken_promise(self.target.function, &input)?;
        Some(Find {
            index,
            input,
            told: promise,
        })
    }
}

/// Returns the promise that `input` breaks, if any; the panic is not printed.
#[must_use]
pub fn broken_promise(function: fn(&[u8]), input: &[u8]) -> Option<String> {
    install_panic_hook();
    SAID.set(Some(String::new()));
    let done = panic::catch_unwind(AssertUnwindSafe(|| {
        // Tried twice, because a program stopped by Ctrl-Z also takes long.
        is_long(function, input) && is_long(function, input)
    }));
    let message = SAID.take();
    match done {
        Ok(is_long) => is_long.then(|| format!("the input takes more than {LONGEST:?}")),
        Err(_) => message,
    }
}

fn is_long(function: fn(&[u8]), input: &[u8]) -> bool {
    let since = Instant::now();
    function(input);
    since.elapsed() > LONGEST
}

thread_local! {
    /// Text of this thread's last panic, while it is captured.
    static SAID: RefCell<Option<String>> = const { RefCell::new(None) };
}

/// Installs a hook that captures the panics of threads that ask for it, and prints all others.
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

/// Returns the text of a panic. The place comes first, because it decides which finds are the same;
/// digits, which vary from input to input, are left out.
fn panic_text(info: &PanicHookInfo<'_>) -> String {
    let place = info.location().map(ToString::to_string);
    let message = info.payload_as_str().unwrap_or("a panic without a message");
    let line = message.lines().next().unwrap_or_default().chars();
    let words: String = line.filter(|c| !c.is_ascii_digit()).take(160).collect();
    format!("{}: {words}", place.unwrap_or_default())
}

/// Returns the contents of every file in these folders of the repository, sorted by name, without
/// schemas.
///
/// # Panics
/// Panics if a file, all of which are committed, cannot be read.
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
