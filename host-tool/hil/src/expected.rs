//! Line edges from predicted channel states, such as the rows of `edges.csv`.

use crate::line::{Expected, ExpectedLine};

/// Delay of the second port of the board against the first, nanoseconds: 8 cycles at 168 MHz
/// (docs/guides/porting.md, What every board must have).
pub const SECOND_PORT_SKEW_NS: f64 = 8_000.0 / 168.0;

/// Name of the line of the sync output.
pub const SYNC: &str = "sync";

/// State of the two lines of a channel (docs/reference/hardware.md).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ChannelState {
    /// Both lines low.
    #[default]
    Isolated,
    /// Cathodic line high.
    Cathodic,
    /// Anodic line high.
    Anodic,
    /// Both lines high.
    Grounded,
}

impl ChannelState {
    /// Returns the levels of the cathodic and the anodic line, high if true.
    pub const fn levels(self) -> (bool, bool) {
        match self {
            ChannelState::Isolated => (false, false),
            ChannelState::Cathodic => (true, false),
            ChannelState::Anodic => (false, true),
            ChannelState::Grounded => (true, true),
        }
    }
}

/// Change of one channel to another state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StateChange {
    /// Time of the change, microseconds.
    pub t_us: u64,
    /// Channel, from 1.
    pub channel: u8,
    /// State after the change.
    pub state: ChannelState,
}

/// Channel that drives the sync output. An edge file does not contain the sync output, but the
/// output follows from the channel: it is high exactly while the channel is in `first`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SyncSource {
    /// Channel, from 1.
    pub channel: u8,
    /// State in the first phase of the channel's pulses. The second phase must have another state.
    pub first: ChannelState,
}

/// Reason why channel states do not give an expectation.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ExpectedError {
    /// Channels count from 1.
    #[error("expected edges, row {row}: channel 0 does not exist; channels count from 1")]
    Channel {
        /// Row from 1.
        row: usize,
    },
    /// Rows are not in order of time, or a channel changes twice in one microsecond.
    #[error("expected edges, row {row}: sort the rows by time, with one row per channel and time")]
    Order {
        /// Row from 1.
        row: usize,
    },
    /// A row lies outside the period of the prediction.
    #[error("expected edges, row {row}: {t_us} µs is outside {from_us} to {until_us} µs")]
    Outside {
        /// Row from 1.
        row: usize,
        /// Time of the row, microseconds.
        t_us: u64,
        /// Start of the prediction, microseconds.
        from_us: u64,
        /// End of the prediction, microseconds.
        until_us: u64,
    },
}

/// Returns the edges of the lines `cN` and `aN` of the channels 1 to `channels`, and of `sync` if
/// there is a source. All channels are isolated before the first row. `skew_ns` returns the delay of
/// the line with a name, nanoseconds.
///
/// # Errors
/// Returns an [`ExpectedError`] with the row if rows are unordered, outside `from_us` to
/// `until_us`, or of channel 0. Rows of channels above `channels` are ignored.
pub fn from_states(
    rows: &[StateChange],
    channels: u8,
    sync: Option<SyncSource>,
    from_us: u64,
    until_us: u64,
    skew_ns: impl Fn(&str) -> f64,
) -> Result<Expected, ExpectedError> {
    check(rows, from_us, until_us)?;
    let line = |name: String, level: &dyn Fn(ChannelState) -> bool, channel: u8| {
        let mut high = level(ChannelState::Isolated);
        let first_high = high;
        let mut edges_us = Vec::new();
        for row in rows.iter().filter(|row| row.channel == channel) {
            if level(row.state) != high {
                high = !high;
                edges_us.push(row.t_us);
            }
        }
        ExpectedLine {
            skew_ns: skew_ns(&name),
            name,
            first_high,
            edges_us,
        }
    };
    let mut lines = Vec::new();
    for channel in 1..=channels {
        let cathodic = |state: ChannelState| state.levels().0;
        let anodic = |state: ChannelState| state.levels().1;
        lines.push(line(format!("c{channel}"), &cathodic, channel));
        lines.push(line(format!("a{channel}"), &anodic, channel));
    }
    if let Some(source) = sync {
        let first = |state| state == source.first && state != ChannelState::Isolated;
        lines.push(line(SYNC.to_string(), &first, source.channel));
    }
    Ok(Expected {
        from_us,
        until_us,
        lines,
        toggling: Vec::new(),
    })
}

/// Returns a line with the changes from `from_us` to `until_us`, as microseconds since `from_us`.
/// `levels` are times in microseconds, ascending, each with the level from then on; the line is
/// `initial_high` before them. Repeated levels are no edges.
pub fn from_levels(
    name: String,
    skew_ns: f64,
    initial_high: bool,
    levels: impl IntoIterator<Item = (u64, bool)>,
    (from_us, until_us): (u64, u64),
) -> ExpectedLine {
    let mut first_high = initial_high;
    let mut high = initial_high;
    let mut edges_us = Vec::new();
    for (t_us, next) in levels {
        if t_us < from_us {
            first_high = next;
        } else if t_us <= until_us && next != high {
            edges_us.push(t_us - from_us);
        }
        high = next;
    }
    ExpectedLine {
        name,
        skew_ns,
        first_high,
        edges_us,
    }
}

fn check(rows: &[StateChange], from_us: u64, until_us: u64) -> Result<(), ExpectedError> {
    let mut latest = [None; 256];
    let mut previous = 0;
    for (index, change) in rows.iter().enumerate() {
        let (row, t_us) = (index + 1, change.t_us);
        if change.channel == 0 {
            return Err(ExpectedError::Channel { row });
        }
        if t_us < from_us || t_us > until_us {
            return Err(ExpectedError::Outside {
                row,
                t_us,
                from_us,
                until_us,
            });
        }
        let last = latest.get_mut(usize::from(change.channel));
        let repeated = last.is_some_and(|last| last.replace(t_us) == Some(t_us));
        if t_us < previous || repeated {
            return Err(ExpectedError::Order { row });
        }
        previous = t_us;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(t_us: u64, channel: u8, state: ChannelState) -> StateChange {
        StateChange {
            t_us,
            channel,
            state,
        }
    }

    #[test]
    fn states_become_lines_and_sync() {
        use ChannelState::{Anodic, Cathodic, Grounded, Isolated};
        let rows = [
            row(100, 1, Cathodic),
            row(300, 1, Isolated),
            row(350, 1, Anodic),
            row(550, 1, Grounded),
            row(550, 2, Anodic),
            row(1550, 1, Isolated),
        ];
        let sync = SyncSource {
            channel: 1,
            first: Cathodic,
        };
        let skew = |name: &str| if name == "sync" { 48.0 } else { 0.0 };
        let expected = from_states(&rows, 2, Some(sync), 0, 2_000, skew);
        let lines = expected.map(|expected| expected.lines).unwrap_or_default();
        let edges = |name| {
            let line = lines.iter().find(|line| line.name == name);
            line.map(|line| line.edges_us.as_slice())
        };
        assert_eq!(edges("c1"), Some(&[100, 300, 550, 1550][..]));
        assert_eq!(edges("a1"), Some(&[350, 1550][..]));
        assert_eq!(edges("c2"), Some(&[][..]));
        assert_eq!(edges("a2"), Some(&[550][..]));
        assert_eq!(edges("sync"), Some(&[100, 300][..]));
        assert_eq!(lines.last().map(|line| line.skew_ns), Some(48.0));
    }

    #[test]
    fn a_line_keeps_its_level_at_the_start_of_the_prediction() {
        let levels = [(10, true), (20, true), (50, false), (70, true), (90, false)];
        let line = |period| from_levels("c1".to_owned(), 0.0, false, levels, period);
        for (period, first_high, edges_us) in [
            ((0, 100), false, vec![10, 50, 70, 90]),
            ((30, 100), true, vec![20, 40, 60]),
            ((50, 80), true, vec![0, 20]),
            ((60, 70), false, vec![10]),
            ((75, 80), true, vec![]),
        ] {
            let line = line(period);
            assert_eq!((line.first_high, line.edges_us), (first_high, edges_us));
        }
        let later = from_levels("c1".to_owned(), 0.0, true, [(9, false)], (5, 20));
        assert_eq!((later.first_high, later.edges_us), (true, vec![4]));
    }

    #[test]
    fn bad_rows_are_named() {
        let error = |rows: &[StateChange]| from_states(rows, 2, None, 10, 20, |_| 0.0).err();
        let grounded = ChannelState::Grounded;
        let order = Some(ExpectedError::Order { row: 2 });
        let unordered = [row(15, 1, grounded), row(14, 2, grounded)];
        assert_eq!(error(&unordered), order);
        assert_eq!(error(&[row(15, 1, grounded), row(15, 1, grounded)]), order);
        let channel = Some(ExpectedError::Channel { row: 1 });
        assert_eq!(error(&[row(15, 0, grounded)]), channel);
        for t_us in [9, 21] {
            let outside = error(&[row(t_us, 1, grounded)]);
            assert!(matches!(outside, Some(ExpectedError::Outside { .. })));
        }
    }
}
