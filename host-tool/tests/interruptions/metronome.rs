//! Measures how much this computer stalls, to distinguish a late stop from a slow program.

use std::fs::File;
use std::io::Write;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// A thread that repeatedly sleeps 1 ms and writes a row.
pub struct Metronome {
    beats: Arc<Mutex<Vec<Beat>>>,
    is_over: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

/// One beat: its end, the delay of its sleep, the duration of its write.
#[derive(Clone, Copy)]
struct Beat {
    end: Instant,
    slept: Duration,
    wrote: Duration,
}

/// Longest stalls of a period.
#[derive(Clone, Copy, Default, Debug)]
pub struct Stall {
    /// Delay until a sleeping thread ran again.
    pub slept: Duration,
    /// Duration of writing a row.
    pub wrote: Duration,
}

impl Metronome {
    pub fn start(folder: &Path) -> Self {
        let beats = Arc::new(Mutex::new(Vec::new()));
        let is_over = Arc::new(AtomicBool::new(false));
        let mut file = File::create(folder.join("metronome")).unwrap();
        let thread = std::thread::spawn({
            let (beats, is_over) = (Arc::clone(&beats), Arc::clone(&is_over));
            move || {
                while !is_over.load(Ordering::Relaxed) {
                    let begin = Instant::now();
                    std::thread::sleep(Duration::from_millis(1));
                    let woken = Instant::now();
                    file.write_all(&[b'1'; 60]).unwrap();
                    let end = Instant::now();
                    beats.lock().unwrap().push(Beat {
                        end,
                        slept: (woken - begin).saturating_sub(Duration::from_millis(1)),
                        wrote: end - woken,
                    });
                }
            }
        });
        let thread = Some(thread);
        Self {
            beats,
            is_over,
            thread,
        }
    }

    /// Returns the longest stalls of the beats that overlap the period.
    pub fn worst(&self, from: Instant, to: Instant) -> Stall {
        let beats = self.beats.lock().unwrap();
        let late = |beat: &&Beat| beat.end >= from && beat.end - beat.slept - beat.wrote <= to;
        beats
            .iter()
            .filter(late)
            .fold(Stall::default(), |worst, beat| Stall {
                slept: worst.slept.max(beat.slept),
                wrote: worst.wrote.max(beat.wrote),
            })
    }
}

impl Drop for Metronome {
    fn drop(&mut self) {
        self.is_over.store(true, Ordering::Relaxed);
        let _ = self.thread.take().map(JoinHandle::join);
    }
}
