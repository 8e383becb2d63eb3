//! Progress display: one updated line on a terminal, plain lines in a pipe.

use super::report::Report;
use std::io::{IsTerminal, Write, stdout};
use std::time::{Duration, Instant};

/// Interval at which a pipe gets a line while a step runs.
const HEARTBEAT: Duration = Duration::from_secs(30);

/// Columns of a line.
const WIDTH: usize = 80;

/// Display of the running step, its time, and its current action.
pub(super) struct Console {
    terminal: bool,
    heading: String,
    since: Instant,
    told: Instant,
}

impl Console {
    pub fn new() -> Self {
        Self {
            terminal: stdout().is_terminal(),
            heading: String::new(),
            since: Instant::now(),
            told: Instant::now(),
        }
    }

    /// Begins the step `heading`: shows it and starts to measure its time.
    pub fn begin(&mut self, heading: &str) {
        heading.clone_into(&mut self.heading);
        self.since = Instant::now();
        self.told = self.since;
        if self.terminal {
            self.show_progress("");
        } else {
            println!("{heading}");
        }
    }

    /// Shows the current action of the step. May be called often, because it limits its own output.
    pub fn show_progress(&mut self, doing: &str) {
        let time = seconds(self.since.elapsed());
        if self.terminal {
            let line = clip(&format!("{} {time} {}", self.heading, doing.trim()));
            print!("\r\x1b[2K{line}");
            let _ = stdout().flush(); // a progress line that cannot be shown is no failure
        } else if self.told.elapsed() >= HEARTBEAT {
            self.told = Instant::now();
            println!("{}", clip(&format!("    … {time} {}", doing.trim())));
        }
    }

    /// Ends the step and prints its result and time.
    pub fn end(&mut self, report: &Report) {
        if self.terminal {
            print!("\r\x1b[2K{}", self.heading);
        } else {
            print!("   ");
        }
        let verdict = if report.failed > 0 { "FAILED" } else { "ok" };
        println!(
            " {verdict}: {}, {}",
            report.counts(),
            seconds(self.since.elapsed())
        );
        for line in &report.lines {
            println!("    {line}");
        }
    }
}

/// Cuts `line` to the width of a terminal line.
fn clip(line: &str) -> String {
    line.chars().take(WIDTH - 1).collect()
}

/// Formats a duration for people, in seconds or in minutes and seconds.
pub(super) fn seconds(time: Duration) -> String {
    let total_s = time.as_secs();
    if total_s < 60 {
        format!("{:.1} s", time.as_secs_f64())
    } else {
        format!("{} min {:02} s", total_s / 60, total_s % 60)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn durations_are_for_people() {
        assert_eq!(seconds(Duration::from_millis(1_250)), "1.2 s");
        assert_eq!(seconds(Duration::from_millis(59_900)), "59.9 s");
        assert_eq!(seconds(Duration::from_secs(125)), "2 min 05 s");
    }

    #[test]
    fn lines_are_cut_between_characters() {
        assert_eq!(clip(&"…".repeat(100)).chars().count(), 79);
        assert_eq!(clip("short"), "short");
    }
}
