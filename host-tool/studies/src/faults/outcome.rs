//! What the cases of a class come to: a line of a table, `result.json`, `faults.csv`.

use super::case::{Case, Fate};
use super::declaration::{Class, Declaration};
use crate::laboratory::{self, Declared, Row, Share};
use std::collections::BTreeMap;

/// The numbers of a class.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Which.
    pub class: Class,
    /// Cases played.
    pub drawn: u64,
    /// Which the device must find ([`Fate::must_find`]).
    pub to_find: u64,
    /// Of those, in which it did.
    pub found: u64,
    /// Of those, with the outputs isolated within two windows.
    pub soon: u64,
    /// Longest from fault to isolated outputs, of those, µs.
    pub latest_us: Option<u64>,
    /// Severe, the stages as they are built.
    pub severe: u64,
    /// Severe without what protects.
    pub bare: u64,
    /// In which the simulator could not go on.
    pub stopped: u64,
    /// Why, and how often.
    pub reasons: BTreeMap<String, u64>,
    /// Cases to look at: severe, or not as they must be.
    pub listed: Vec<Case>,
}

impl Outcome {
    /// Of these cases.
    #[must_use]
    pub fn of(class: Class, cases: &[Case]) -> Self {
        let count =
            |is: &dyn Fn(&Fate) -> bool| cases.iter().filter(|case| is(&case.fate)).count() as u64;
        let late = cases
            .iter()
            .filter(|case| case.fate.must_find && case.fate.found);
        let mut reasons = BTreeMap::new();
        for why in cases.iter().filter_map(|case| case.fate.stopped.as_ref()) {
            *reasons.entry(reason(why)).or_default() += 1;
        }
        let listed = cases.iter().filter(|case| case.fate.is_open());
        Self {
            class,
            drawn: cases.len() as u64,
            to_find: count(&|fate| fate.must_find),
            found: count(&|fate| fate.must_find && fate.found),
            soon: count(&|fate| fate.must_find && fate.found && is_soon(fate)),
            latest_us: late.filter_map(|case| case.fate.isolated_us).max(),
            severe: count(&|fate| !fate.severe.is_empty()),
            bare: count(&|fate| !fate.bare.is_empty()),
            stopped: count(&|fate| fate.stopped.is_some()),
            reasons,
            listed: listed.cloned().collect(),
        }
    }

    /// The table's head.
    #[must_use]
    pub fn head() -> String {
        format!(
            "{:<13}{:>6}{:>9}{:>7}{:>9}{:>12}{:>8}{:>6}{:>9}",
            "class", "drawn", "to find", "found", "<500 us", "latest", "severe", "bare", "stopped"
        )
    }

    /// Its line of the table, and the cases to look at.
    #[must_use]
    pub fn lines(&self) -> String {
        let Self {
            class,
            drawn,
            to_find,
            found,
            soon,
            severe,
            bare,
            stopped,
            ..
        } = self;
        let latest = self
            .latest_us
            .map_or_else(|| "-".to_owned(), |us| format!("{us} us"));
        let class = class.name();
        let mut text = format!(
            "{class:<13}{drawn:>6}{to_find:>9}{found:>7}{soon:>9}{latest:>12}{severe:>8}{bare:>6}\
             {stopped:>9}"
        );
        for (why, count) in &self.reasons {
            let line = format!("  stopped {count} times: {why}");
            text += &format!("\n{}", line.chars().take(80).collect::<String>());
        }
        for case in &self.listed {
            text += &format!("\n{}", in_words(case));
        }
        text
    }

    /// As `result.json` has it.
    #[must_use]
    pub fn result(
        &self,
        declaration: &Declaration,
        (device, seed): (&str, u64),
        notes: &[String],
    ) -> laboratory::Outcome {
        let class = self.class;
        let mut told = vec![SIMULATED.to_owned()];
        told.extend_from_slice(notes);
        told.extend(self.listed.iter().map(in_words));
        let harmless = self.drawn - self.severe;
        laboratory::Outcome {
            name: format!("faults-{class}"),
            title: format!("Faults: {class}"),
            seed,
            simulated: Some(true),
            cut_short: None,
            declared: Declared {
                asked: format!("faults --class {class}"),
                command: Some(format!(
                    "faults --class {class} --device {device} --count {}",
                    self.drawn
                )),
                device: Some(device.to_owned()),
                sha256: declaration.sha256.clone(),
                source: "issue 15".to_owned(),
                draws: self.drawn,
                as_declared: (seed, self.drawn) == (declaration.seed(), declaration.count()),
            },
            conditions: Vec::new(),
            rows: self.rows(),
            shares: vec![
                part("found", "what must be found is", self.found, self.to_find),
                part("harmless", "nothing is severe", harmless, self.drawn),
            ],
            decides: Vec::new(),
            sheets: Vec::new(),
            notes: told,
        }
    }

    fn rows(&self) -> Vec<Row> {
        let cases = [
            ("to-find", "cases that must be found", self.to_find),
            ("soon", "found, isolated within 500 us", self.soon),
            ("severe", "severe as built", self.severe),
            ("bare", "severe without protection", self.bare),
            ("stopped", "the simulator stopped", self.stopped),
        ];
        let cases = cases.map(|(id, quantity, n)| (id, quantity, "cases", Some(n)));
        let latest = ("latest", "latest isolation", "us", self.latest_us);
        let class = self.class;
        let all = cases.into_iter().chain([latest]);
        let row = |(id, quantity, unit, ours): (&str, &str, &str, Option<u64>)| Row {
            id: format!("{class}/{id}"),
            quantity: format!("{class}: {quantity}"),
            unit: unit.to_owned(),
            paper: None,
            ours: ours.map(|n| n as f64),
            low: None,
            high: None,
            n: self.drawn as usize,
        };
        all.map(row).collect()
    }
}

/// Isolated from a fault on, µs.
const TWO_WINDOWS_US: u64 = 500;

/// What is said of every result.
const SIMULATED: &str = "Simulated: a model of the chip and of the stages; no board and no person.";

/// A share with its interval.
fn part(id: &str, claim: &str, holds: u64, of: u64) -> Share {
    Share::counted(id.to_owned(), claim.to_owned(), None, (holds, of))
}

fn is_soon(fate: &Fate) -> bool {
    fate.isolated_us.is_some_and(|us| us <= TWO_WINDOWS_US)
}

/// Why the simulator stopped, without where.
fn reason(why: &str) -> String {
    let what = why.rsplit_once("stopped: ").map_or(why, |(_, what)| what);
    let what = what.strip_prefix("not modelled: ").unwrap_or(what);
    what.split(" is not modelled")
        .next()
        .unwrap_or(what)
        .to_owned()
}

/// A case to look at.
fn in_words(case: &Case) -> String {
    let Case {
        index,
        moment_us,
        what,
        fate,
    } = case;
    let fault = fate.fault.map(|it| format!("fault {}", it.number()));
    let reset = fate.reset.then(|| "reset".to_owned());
    let unfound = (fate.must_find && !fate.found).then(|| "NOT FOUND".to_owned());
    let other = (!fate.must_find && fate.found).then(|| "what is true was not taken".to_owned());
    let changed = fate
        .changed_us
        .map(|us| format!("first change {us} us after"));
    let isolated = fate.isolated_us.map(|us| format!("isolated {us} us after"));
    let latched = fate.latched.then(|| "a stage latched".to_owned());
    let all = [unfound, other, fault, reset, changed, isolated, latched];
    let all: Vec<String> = all.into_iter().flatten().collect();
    let mut text = format!(
        "  {index}: {what} at {moment_us} us\n     {}",
        all.join(", ")
    );
    for severe in &fate.severe {
        text += &format!("\n     SEVERE {severe}");
    }
    text
}

/// A row for each case.
///
/// # Errors
/// Never: it goes to memory.
pub fn csv(class: Class, cases: &[Case]) -> Result<Vec<u8>, csv::Error> {
    let mut rows = csv::Writer::from_writer(Vec::new());
    rows.write_record([
        "class",
        "case",
        "moment_us",
        "what",
        "changed_us",
        "fault",
        "reset",
        "isolated_us",
        "latched",
        "severe",
        "bare",
        "stopped",
    ])?;
    for case in cases {
        let fate = &case.fate;
        let number = |us: Option<u64>| us.map_or_else(String::new, |us| us.to_string());
        let fault = fate.fault.map(|fault| fault.number().into());
        rows.write_record([
            class.name(),
            &case.index.to_string(),
            &case.moment_us.to_string(),
            &case.what,
            &number(fate.changed_us),
            &number(fault),
            flag(fate.reset),
            &number(fate.isolated_us),
            flag(fate.latched),
            &fate.severe.join("; "),
            &fate.bare.join("; "),
            fate.stopped.as_deref().unwrap_or_default(),
        ])?;
    }
    rows.into_inner().map_err(|lost| lost.into_error().into())
}

const fn flag(is: bool) -> &'static str {
    if is { "yes" } else { "no" }
}
