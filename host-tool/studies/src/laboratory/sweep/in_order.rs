//! Work on all cores, whose results are kept in their order.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

/// The longest time between two questions whether to go on.
const LOOK: Duration = Duration::from_millis(50);

/// Whether to go on.
pub(super) type NextStep<'a> = &'a (dyn Fn() -> bool + Sync);

/// Computes every one of `items` on all cores and keeps the results in the order of `items`,
/// each as soon as those before it are kept, so that whatever ends the program leaves the
/// first ones. `keep` returns the part done, 0 to 1, which is `begun` before; `go_on` hears
/// it, and may say no: then a long computation may return nothing, and what comes after is
/// left out.
///
/// # Errors
/// The first, in the order of `items`, that `compute` has, or that of `keep`.
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
    // No further one is begun; those under way end early.
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
                        break; // nobody keeps any more
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
                    break; // and nothing after it is kept
                };
                done = keep(item).inspect_err(|_| close())?;
                kept += 1;
            }
        }
    })
}
