//! Repeats tests that depend on real time if this computer stalled.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// Excess of a thread's sleep that counts as a stall.
const STALL: Duration = Duration::from_millis(20);

/// Largest number of attempts.
const MOST: u32 = 8;

/// Runs `test`; if it fails and this computer stalled meanwhile, prints that and runs it again.
pub fn retry_after_stalls(name: &str, test: impl Fn()) {
    repeated(name, || timed(&test));
}

/// Repeats until an attempt passes, fails without a stall, or is number [`MOST`].
fn repeated(name: &str, mut attempt: impl FnMut() -> (std::thread::Result<()>, Duration)) {
    for count in 1..=MOST {
        let (result, worst) = attempt();
        let Err(panic) = result else {
            return;
        };
        if worst < STALL || count == MOST {
            resume_unwind(panic);
        }
        eprintln!("{name}: repeated, for this computer stalled for {worst:.1?}");
    }
}

/// Returns the result of `test`, and the longest stall of this computer meanwhile.
fn timed(test: &impl Fn()) -> (std::thread::Result<()>, Duration) {
    let (is_over, worst_us) = (AtomicBool::new(false), AtomicU64::new(0));
    let result = std::thread::scope(|scope| {
        scope.spawn(|| {
            let step = Duration::from_millis(1);
            while !is_over.load(Ordering::Relaxed) {
                let begin = Instant::now();
                std::thread::sleep(step);
                let late = begin.elapsed().saturating_sub(step);
                worst_us.fetch_max(late.as_micros() as u64, Ordering::Relaxed);
            }
        });
        let result = catch_unwind(AssertUnwindSafe(test));
        is_over.store(true, Ordering::Relaxed);
        result
    });
    (result, Duration::from_micros(worst_us.into_inner()))
}

#[test]
fn only_what_fails_beside_a_stall_is_repeated() {
    let tried = |stall: Duration, passes_at: u32| {
        let mut count = 0;
        let run = || {
            repeated("a name", || {
                count += 1;
                let result: std::thread::Result<()> = match count < passes_at {
                    true => Err(Box::new("it failed")),
                    false => Ok(()),
                };
                (result, stall)
            });
        };
        let passed = catch_unwind(AssertUnwindSafe(run)).is_ok();
        (passed, count)
    };
    assert_eq!(tried(Duration::ZERO, 1), (true, 1));
    assert_eq!(tried(Duration::ZERO, 2), (false, 1));
    assert_eq!(tried(2 * STALL, 3), (true, 3));
    assert_eq!(tried(2 * STALL, u32::MAX), (false, MOST));
    let (result, worst) = timed(&|| std::thread::sleep(Duration::from_millis(50)));
    assert!(result.is_ok() && worst < Duration::from_secs(60));
}
