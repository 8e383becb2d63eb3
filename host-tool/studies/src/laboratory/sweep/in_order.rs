//! Computes on all cores and stores the results in their order.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

/// Longest time between two calls of `go_on`.
const LOOK: Duration = Duration::from_millis(50);

/// Function that long computations call to ask whether to continue.
pub(super) type NextStep<'a> = &'a (dyn Fn() -> bool + Sync);

/// Computes all `items` on all cores and stores the results in the order of `items`. A result is
/// stored as soon as all before it are, so that an interruption leaves the first ones. `keep`
/// stores a result and returns the finished part, 0 to 1, which is `begun` at the start. `go_on`
/// receives that part and may return `false` to end: long computations may then return `None`, and
/// the remaining items are left out.
///
/// # Errors
/// Returns the first error of `compute` in the order of `items`, or the error of `keep`.
pub(super) fn in_order<I: Sync, T: Send, E: Send>(
    items: &[I],
    begun: f64,
    compute: &(impl Fn(&I, NextStep<'_>) -> Result<Option<T>, E> + Sync),
    keep: &mut dyn FnMut(T) -> Result<f64, E>,
    go_on: &mut dyn FnMut(f64) -> bool,
) -> Result<(), E> {
    if !go_on(begun) {
        return Ok(());
    }
    let cores = rayon::current_num_threads();
    let next = AtomicUsize::new(0);
    // `is_closed` prevents further items; `is_stopped` ends those in progress early.
    let (is_closed, is_stopped) = (AtomicBool::new(false), AtomicBool::new(false));
    let close = || is_closed.store(true, Ordering::Relaxed);
    let goes_on = || !is_stopped.load(Ordering::Relaxed);
    std::thread::scope(|scope| {
        let (sender, receiver) = channel();
        for _ in 0..cores.min(items.len()) {
            let (sender, next, is_closed, goes_on) = (sender.clone(), &next, &is_closed, &goes_on);
            scope.spawn(move || {
                while !is_closed.load(Ordering::Relaxed) {
                    let nth = next.fetch_add(1, Ordering::Relaxed);
                    let Some(item) = items.get(nth) else { break };
                    if sender.send((nth, compute(item, goes_on))).is_err() {
                        break; // the receiver has ended
                    }
                }
            });
        }
        drop(sender);
        let (mut done, mut kept) = (begun, 0);
        let mut early = BTreeMap::new();
        loop {
            if !go_on(done) {
                close();
                is_stopped.store(true, Ordering::Relaxed);
            }
            match receiver.recv_timeout(LOOK) {
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return Ok(()),
                Ok((nth, result)) => {
                    early.insert(nth, result);
                }
            }
            while let Some(result) = early.remove(&kept) {
                let item = result.inspect_err(|_| close())?;
                let Some(item) = item else {
                    close();
                    break; // nothing after this result is stored
                };
                done = keep(item).inspect_err(|_| close())?;
                kept += 1;
            }
        }
    })
}
