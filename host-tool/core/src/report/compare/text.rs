//! The comparison as text for a terminal of 80 columns.

use super::files::{FileDifference, truncate_line};
use super::pairs::{Group, groups};
use super::sessions::group_differences;
use super::{CompareRow, ComparedRecord, compare_rows};
use crate::plot::words::wrap_columns;
use crate::report::doses::{HEADS as DOSE_HEADS, NOTE, cells as dose_cells, channel};
use crate::report::tables::{degrees, newtons, seconds};

/// Maximum number of trials whose doses differ, and of files that differ, for which the terminal
/// shows details. The page shows all of them.
const MOST_TRIALS: usize = 8;

/// Returns the comparison for a terminal of 80 columns: a table of the trials, then the doses that
/// differ, then the keys of session files that differ.
#[must_use]
pub fn compare_text(records: &[ComparedRecord]) -> String {
    let mut text = String::new();
    for (position, compared) in records.iter().enumerate() {
        text += &format!("{:>2}  {}\n", position + 1, compared.name);
        if let Some(damaged) = &compared.damaged {
            text += &format!("    {damaged}\n");
        }
    }
    text += &rows(records);
    let groups = groups(records);
    text += &stimulation(&groups);
    text += &sessions(&groups);
    text.trim_end().to_owned()
}

/// Returns a table with a row for each trial of each record.
fn rows(records: &[ComparedRecord]) -> String {
    let mut text = format!(
        "\n    {:<17}{:>9}{:>8}{:>9}{:>8}{:>8}\n",
        "trial", "length", "RMSE", "force", "deepest", "pulses"
    );
    for row in compare_rows(records) {
        let name: String = row.of.trial.chars().take(16).collect();
        // There are 63 columns before the mark.
        let mark = match &row {
            row if row.damaged => " damaged",
            row if !row.complete => " incomplete",
            row if row.simulated => " simulated",
            _ => "",
        };
        let CompareRow { number, of, .. } = &row;
        let or_none = |text: Option<String>| text.unwrap_or_else(|| "–".to_owned());
        text += &format!(
            "{number:>2}  {name:<17}{:>9}{:>8}{:>9}{:>8}{:>8}{mark}\n",
            format!("{} s", seconds(of.duration_s)),
            or_none(of.rmse_deg.map(degrees)),
            or_none(of.rmse_n.map(newtons)),
            or_none(of.deepest_deg.map(degrees)),
            or_none(of.pulses.map(|count| count.to_string())),
        );
        if of.limit_cycles > 0 {
            text += &format!("      limit cycles: {}\n", of.limit_cycles);
        }
        // Each model is on a line of its own, so that ten channels fit in 80 columns.
        for model in of.models.iter().flat_map(|models| models.split("), ")) {
            let close = if model.ends_with(')') { "" } else { ")" };
            text += &format!("      {model}{close}\n");
        }
    }
    text
}

/// Returns the doses of the channels for each group of trials in which they differ.
fn stimulation(groups: &[Group<'_>]) -> String {
    let (groups, alone): (Vec<_>, Vec<_>) = groups.iter().partition(|group| group.trials.len() > 1);
    let has_channels = |group: &&Group<'_>| {
        let mut trials = group.trials.iter();
        trials.any(|trial| !trial.1.row.channels.is_empty())
    };
    let groups: Vec<&Group<'_>> = groups.into_iter().filter(has_channels).collect();
    let differing = || groups.iter().filter(|group| group.differs());
    let (count, shown) = (differing().count(), differing().take(MOST_TRIALS));
    let alike = groups.len() - count;
    let mut text = String::new();
    for group in shown {
        text += &format!("\n{}\n{}", truncate_line(group.name), doses(group));
    }
    if count > MOST_TRIALS {
        let more = count - MOST_TRIALS;
        text += &format!("\nThe output of {more} more trials differs: see the page.\n");
    }
    if alike > 0 {
        let same = match (alike, count) {
            (1, 0) => "The output of every channel is the same in each record.".to_owned(),
            (1, _) => "In 1 other trial the output of every channel is the same.".to_owned(),
            (_, 0) => format!("In {alike} trials the output of every channel is the same."),
            _ => format!("In {alike} other trials the output of every channel is the same."),
        };
        text += &format!("\n{same}\n");
    }
    if !alone.is_empty() {
        let words = match alone.len() {
            1 => "1 trial is in one record only".to_owned(),
            count => format!("{count} trials are in one record only"),
        };
        text += &format!("\n{words}: see the page.\n");
    }
    if count > 0 {
        text += &format!("\n{}\n", wrap_columns(NOTE, 80));
    }
    text
}

/// Returns a table of the doses of a group, with a row for each channel of each record.
fn doses(group: &Group<'_>) -> String {
    let line = |number: &str, cells: [&str; 8]| {
        let [peak, phase, charge, rms, on, pulses, width, rate] = cells;
        let line = format!(
            "{number:>4}{peak:>10}{phase:>9}{charge:>11}{rms:>8}{on:>10}{pulses:>8}{width:>10}{rate:>10}"
        );
        format!("{line}\n")
    };
    let mut text = line("", DOSE_HEADS);
    let channels = || {
        group
            .trials
            .iter()
            .flat_map(|(_, record)| &record.row.channels)
    };
    let mut numbers: Vec<u8> = channels()
        .map(|channel_dose| channel_dose.channel)
        .collect();
    numbers.sort_unstable();
    numbers.dedup();
    for number in numbers {
        let own = || channels().filter(|channel_dose| channel_dose.channel == number);
        let name = own().next().map_or_else(String::new, channel);
        text += &format!("{}\n", truncate_line(&format!("  channel {name}")));
        for (record, kept) in &group.trials {
            let dose = kept
                .row
                .channels
                .iter()
                .find(|channel_dose| channel_dose.channel == number);
            if let Some(dose) = dose {
                let cells = dose_cells(dose);
                text += &line(&record.to_string(), cells.each_ref().map(String::as_str));
            }
        }
    }
    text
}

/// Returns the keys of session files and wearer files whose values differ.
fn sessions(groups: &[Group<'_>]) -> String {
    let differences: Vec<FileDifference> = groups.iter().flat_map(group_differences).collect();
    let shown = differences.iter().take(MOST_TRIALS);
    let mut text: String = shown
        .map(|file_difference| format!("\n{}", file_difference.text()))
        .collect();
    if differences.len() > MOST_TRIALS {
        let more = differences.len() - MOST_TRIALS;
        text += &format!("\n{more} more session or wearer files differ: see the page.\n");
    }
    let are_held = groups.iter().any(|group| group.trials.len() > 1);
    if differences.is_empty() && are_held {
        text += "\nThe session files are the same.\n";
    }
    text
}
