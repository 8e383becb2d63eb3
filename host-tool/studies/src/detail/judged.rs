//! Verdicts on the level of detail that `[fidelity]` chooses, and the table of all sessions.

use host_core::choice::{Effect, coarsest};
use host_core::session::Share;

/// A random session with the error of each level of detail.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Index of the session, from 0.
    pub session: usize,
    /// Columns of the table that describe the session, with their values.
    pub facts: Vec<(&'static str, String)>,
    /// Length of the session, s.
    pub duration_s: f64,
    /// Errors with the noise with which the choice is made, the most detailed level first.
    pub tried: Vec<Effect>,
    /// Errors with the noise with which the choice is judged.
    pub judged: Vec<Effect>,
}

/// Verdict on the level that is chosen at one tolerance. Errors are relative to the reference, as
/// [`Effect`] has them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Verdict {
    /// Chosen level.
    pub setting: u32,
    /// Error of this level with the noise with which the choice is judged.
    pub error: f64,
    /// Error of the next coarser level; `None` if there is none.
    pub coarser: Option<f64>,
}

impl Row {
    /// Returns the verdict on the choice at a tolerance.
    #[must_use]
    pub fn verdict(&self, tolerance: Share) -> Option<Verdict> {
        let setting = coarsest(&self.tried, tolerance.fraction())?.setting;
        let place = self
            .judged
            .iter()
            .position(|effect| effect.setting == setting)?;
        Some(Verdict {
            setting,
            error: self.judged[place].error,
            coarser: self.judged.get(place + 1).map(|effect| effect.error),
        })
    }
}

/// Counts over all judged sessions at one tolerance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Summary {
    /// Number of sessions.
    pub sessions: usize,
    /// Number of sessions in which the error of the chosen level is within the tolerance.
    pub within: usize,
    /// Number of sessions for which a coarser level than the chosen one exists.
    pub with_coarser: usize,
    /// Number of `with_coarser` sessions in which the next coarser level exceeds the tolerance, so
    /// that the choice was necessary.
    pub coarser_fails: usize,
}

impl Summary {
    /// Counts the rows at one tolerance.
    #[must_use]
    pub fn from_rows(rows: &[Row], tolerance: Share) -> Self {
        let limit = tolerance.fraction();
        let mut sum = Self::default();
        for verdict in rows.iter().filter_map(|row| row.verdict(tolerance)) {
            sum.sessions += 1;
            sum.within += usize::from(verdict.error <= limit);
            sum.with_coarser += usize::from(verdict.coarser.is_some());
            sum.coarser_fails += usize::from(verdict.coarser.is_some_and(|error| error > limit));
        }
        sum
    }
}

/// Formats all rows as a table of docs/charts.
#[must_use]
pub fn csv(rows: &[Row]) -> String {
    let mut out = "session".to_owned();
    let (facts, levels) = rows.first().map_or((&[][..], &[][..]), |row| {
        (row.facts.as_slice(), row.tried.as_slice())
    });
    for (column, _) in facts {
        out.push_str(&format!(",{column}"));
    }
    out.push_str(",duration_s");
    for kind in ["tried", "judged"] {
        for level in levels {
            out.push_str(&format!(",{kind}_{}_pct", level.setting));
        }
    }
    out.push('\n');
    for row in rows {
        out.push_str(&row.session.to_string());
        for (_, value) in &row.facts {
            out.push_str(&format!(",{value}"));
        }
        out.push_str(&format!(",{:.3}", row.duration_s));
        for effect in row.tried.iter().chain(&row.judged) {
            out.push_str(&format!(",{:.4}", effect.error * 100.0));
        }
        out.push('\n');
    }
    out
}

/// Reads the errors of a table that [`csv`] formatted, without the columns that describe the
/// sessions; `None` for any other table.
#[must_use]
pub fn read_csv(text: &str) -> Option<Vec<Row>> {
    let mut lines = text.lines().map(|line| line.split(','));
    let columns: Vec<&str> = lines.next()?.collect();
    let effects = |kind: &str, cells: &[&str]| -> Option<Vec<Effect>> {
        let pairs = columns.iter().zip(cells);
        let levels = pairs.filter_map(|(column, cell)| {
            let setting = column.strip_prefix(kind)?.strip_suffix("_pct")?;
            Some((setting, cell))
        });
        let effects = levels.map(|(setting, cell)| {
            Some(Effect {
                setting: setting.parse().ok()?,
                error: cell.parse::<f64>().ok()? / 100.0,
            })
        });
        effects.collect()
    };
    let duration = columns.iter().position(|column| *column == "duration_s")?;
    let rows = lines.map(|line| {
        let cells: Vec<&str> = line.collect();
        Some(Row {
            session: cells.first()?.parse().ok()?,
            facts: Vec::new(),
            duration_s: cells.get(duration)?.parse().ok()?,
            tried: effects("tried_", &cells)?,
            judged: effects("judged_", &cells)?,
        })
    });
    rows.collect()
}
