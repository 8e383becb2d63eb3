//! Formats the results as a table of 80 columns, the cases to review in words, and `faults.csv`.

use super::case::{Case, CaseEnd};
use super::declaration::Class;
use super::outcome::{MOST_TRUNCATED_UC, Outcome};
use std::collections::BTreeMap;

/// Note in every result: nothing of it was measured on hardware or people.
pub(super) const SIMULATED: &str =
    "Simulated: models of the chip and of the output stages, no board and no people.";

/// Definition of the word *severe* for the report pages.
pub(super) const SEVERE: &str = "Severe, as judged at the electrodes: a commanded phase over 500 us or any over 650 us; \
     current above the wearer's limit by more than 5 %; more than 1 uA of net direct current for \
     a second; more pulses in a second than were checked; output past a deadline \
     (docs/evidence/faults.md has the exact rules).";

/// Width of the first column, which names the class or kind, characters.
const NAME: usize = 17;
/// Width of the table, characters.
const WIDTH: usize = 80;
/// Largest number of non-severe cases per kind that are listed below the table for review.
const TOLD: usize = 3;

impl Outcome {
    /// Returns the heading lines of the table.
    #[must_use]
    pub fn head() -> String {
        line(
            "class, kind",
            ["drawn", "chngd", "harml", "found", "miss", "ref"].map(str::to_owned),
            ["median", "longest"].map(str::to_owned),
            ["sev", "<= %", "bare"].map(str::to_owned),
        )
    }

    /// Returns the table rows of the class and its kinds, then the cases to review: all severe
    /// ones, and the first three others of each kind.
    #[must_use]
    pub fn lines(&self) -> String {
        let mut text = self.line();
        for kind in &self.kinds {
            text += &format!("\n{}", kind.line());
        }
        for (why, count) in &self.reasons {
            let line = format!("  stopped {count} times: {why}");
            text += &format!("\n{}", line.chars().take(WIDTH).collect::<String>());
        }
        let mut others = BTreeMap::<&str, usize>::new();
        for case in &self.listed {
            let other = others.entry(case.kind().unwrap_or("others")).or_default();
            *other += usize::from(case.fate.severe.is_empty());
            if !case.fate.severe.is_empty() || *other <= TOLD {
                text += &format!("\n{}", in_words(case));
            }
        }
        for (kind, count) in others.iter().filter(|(_, count)| **count > TOLD) {
            let more = count - TOLD;
            text += &format!("\n  {more} more of {kind}: --out DIR lists them (result.html)");
        }
        text
    }

    /// Describes in words how many cases ended early and how, and which pulses were truncated.
    #[must_use]
    pub fn remarks(&self) -> Vec<String> {
        let ended = |ended: CaseEnd| self.ended.get(ended.name()).copied().unwrap_or(0);
        let [played, isolated, again] =
            [CaseEnd::Played, CaseEnd::Isolated, CaseEnd::Reconverged].map(ended);
        let [written, untouched] = [CaseEnd::Overwritten, CaseEnd::Untouched].map(ended);
        let mut remarks = vec![format!(
            "{played} cases were simulated to their end, {isolated} until the outputs were \
             disconnected for good, {again} until everything was as without the fault. Not \
             simulated: {written} in memory that is overwritten before it is read, and \
             {untouched} in memory that nothing uses."
        )];
        if let Some(uc) = self.truncated_uc {
            let pulses = self.truncated;
            remarks.push(format!(
                "{pulses} pulses were truncated or prolonged by a fault, which is excused: they \
                 left at most {uc:.1} uC each (limit {MOST_TRUNCATED_UC} uC)."
            ));
        }
        if let Some(us) = self.shown_us {
            remarks.push(format!(
                "A flip of the pulse tape was on an output line for at most {us} us at a time."
            ));
        }
        if let Some(us) = self.slowest_us {
            remarks.push(format!(
                "The outputs were disconnected at most {us} us after the time that the device \
                 reports for its fault."
            ));
        }
        remarks
    }

    /// Formats this class or kind as a table row.
    fn line(&self) -> String {
        let counts = [
            self.drawn,
            self.changed,
            self.harmless,
            self.found,
            self.missed(),
            self.stopped,
        ];
        let bound = self.severe_bound();
        let bound = bound.map_or_else(|| "-".to_owned(), |share| format!("{:.2}", 100.0 * share));
        line(
            &self.name(),
            counts.map(|n| n.to_string()),
            [self.median_us, self.latest_us.map(|us| us as f64)].map(time),
            [self.severe.to_string(), bound, self.bare.to_string()],
        )
    }
}

/// Formats a table row; a name that is too long for its column gets a line of its own.
fn line(name: &str, counts: [String; 6], times: [String; 2], severe: [String; 3]) -> String {
    let name = match name.chars().count() {
        0..=NAME => format!("{name:<NAME$}"),
        _ => format!("{name}\n{:<NAME$}", ""),
    };
    let [drawn, changed, harmless, found, missed, refused] = counts;
    let ([median, longest], [severe, bound, bare]) = (times, severe);
    format!(
        "{name}{drawn:>6}{changed:>6}{harmless:>6}{found:>6}{missed:>5}{refused:>4}{median:>7}\
         {longest:>8}{severe:>4}{bound:>6}{bare:>5}"
    )
}

/// Formats a time in µs, ms or s, whichever is shortest; `-` for none.
fn time(us: Option<f64>) -> String {
    match us {
        None => "-".to_owned(),
        Some(us) if us < 1e3 => format!("{us:.0}us"),
        Some(us) if us < 1e5 => format!("{:.1}ms", us * 1e-3),
        Some(us) if us < 1e6 => format!("{:.0}ms", us * 1e-3),
        Some(us) => format!("{:.1}s", us * 1e-6),
    }
}

/// Describes a case that a person should review.
pub(super) fn in_words(case: &Case) -> String {
    let Case {
        index,
        moment_us,
        what,
        fate,
    } = case;
    let fault = fate.fault.map(|fault| format!("fault {}", fault.number()));
    let reset = fate.reset.then(|| "reset".to_owned());
    let unfound = (fate.must_find && !fate.found).then(|| "NOT FOUND".to_owned());
    let other = (!fate.must_find && fate.found).then(|| "found, but need not be".to_owned());
    let changed = fate
        .changed_us
        .map(|us| format!("first change {us} us after"));
    let isolated = fate
        .isolated_us
        .map(|us| format!("disconnected {us} us after"));
    let latched = fate.latched.then(|| "a stage latched".to_owned());
    let details = [unfound, other, fault, reset, changed, isolated, latched];
    let details: Vec<String> = details.into_iter().flatten().collect();
    let mut text = format!(
        "  {index}: {what} at {moment_us} us\n     {}",
        details.join(", ")
    );
    for severe in &fate.severe {
        text += &format!("\n     SEVERE {severe}");
    }
    for uc in fate
        .truncated_uc
        .iter()
        .filter(|uc| uc.abs() > MOST_TRUNCATED_UC)
    {
        text += &format!("\n     a truncated pulse left {uc:.1} uC");
    }
    text
}

/// Formats the cases as CSV, one row each.
///
/// # Errors
/// Cannot fail: the CSV is written to memory.
pub fn csv(class: Class, cases: &[Case]) -> Result<Vec<u8>, csv::Error> {
    let mut rows = csv::Writer::from_writer(Vec::new());
    rows.write_record([
        "class",
        "case",
        "moment_us",
        "what",
        "must_find",
        "found",
        "changed",
        "changed_us",
        "shown_us",
        "fault",
        "told_us",
        "reset",
        "isolated_us",
        "latched",
        "truncated_uc",
        "severe",
        "bare",
        "stopped",
        "ended",
    ])?;
    for case in cases {
        let fate = &case.fate;
        let number = |us: Option<u64>| us.map_or_else(String::new, |us| us.to_string());
        let fault = fate.fault.map(|fault| fault.number().into());
        let truncated = fate.truncated_uc.iter().map(|uc| format!("{uc:.3}"));
        rows.write_record([
            class.name(),
            &case.index.to_string(),
            &case.moment_us.to_string(),
            &case.what,
            flag(fate.must_find),
            flag(fate.found),
            flag(fate.has_effect()),
            &number(fate.changed_us),
            &number(fate.shown_us),
            &number(fault),
            &number(fate.told_us),
            flag(fate.reset),
            &number(fate.isolated_us),
            flag(fate.latched),
            &truncated.collect::<Vec<_>>().join("; "),
            &fate.severe.join("; "),
            &fate.bare.join("; "),
            fate.stopped.as_deref().unwrap_or_default(),
            fate.ended.name(),
        ])?;
    }
    rows.into_inner().map_err(|lost| lost.into_error().into())
}

const fn flag(is: bool) -> &'static str {
    if is { "yes" } else { "no" }
}

#[cfg(test)]
mod tests {
    use super::super::case::CaseResult;
    use super::*;

    #[test]
    fn no_line_is_longer_than_80_columns() {
        let case = |index, description: &str, fate| Case {
            index,
            moment_us: 0,
            what: description.to_owned(),
            fate,
        };
        let found = CaseResult {
            must_find: true,
            found: true,
            isolated_us: Some(999_940),
            ended: CaseEnd::Isolated,
            ..CaseResult::default()
        };
        let mut cases: Vec<_> = (0..9_999)
            .map(|k| case(k, "kind: a", found.clone()))
            .collect();
        cases.push(case(
            9_999,
            "a kind with a long name: b",
            CaseResult::default(),
        ));
        let outcome = Outcome::from_cases(Class::Flips, &cases);
        let text = format!("{}\n{}", Outcome::head(), outcome.lines());
        assert!(text.contains(" 1000ms  1000ms "), "{text}");
        assert!(
            text.lines().all(|line| line.chars().count() <= WIDTH),
            "{text}"
        );
        let kinds: Vec<_> = outcome
            .kinds
            .iter()
            .map(|outcome| (outcome.drawn, outcome.harmless))
            .collect();
        assert_eq!(kinds, [(1, 1), (9_999, 0)]);
        assert_eq!(outcome.harmless + outcome.found, outcome.drawn);
    }

    #[test]
    fn all_that_are_severe_are_told_and_of_the_others_of_a_kind_the_first() {
        let case = |index, severe: bool| Case {
            index,
            moment_us: 0,
            what: "kind: it".to_owned(),
            fate: CaseResult {
                must_find: true,
                severe: Vec::from_iter(severe.then(|| "too long".to_owned())),
                ..CaseResult::default()
            },
        };
        let report = |cases: &[Case]| Outcome::from_cases(Class::Flips, cases).lines();
        let cases: Vec<_> = (0..6).map(|k| case(k, k > 3)).collect();
        let text = report(&cases);
        for (index, is_told) in [true, true, true, false, true, true].iter().enumerate() {
            assert_eq!(text.contains(&format!("\n  {index}: ")), *is_told, "{text}");
        }
        assert_eq!(text.matches("SEVERE too long").count(), 2, "{text}");
        assert!(
            text.ends_with("  1 more of kind: --out DIR lists them (result.html)"),
            "{text}"
        );
        assert!(!report(&cases[..3]).contains("more of"));
    }
}
