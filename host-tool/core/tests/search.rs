//! Tests of the laboratory's searches: results, refusals, results of an early end.

use host_core::search::{Answer, Finding, Milli, Probe, Search, SearchEnd, SearchFile, search};
use std::cell::Cell;

/// A joint that moves from one level on, a wearer who accepts levels up to another, and a failure
/// after some pulses.
struct Scripted {
    moves_at: u32,
    allowed: u32,
    fails_after: u64,
    pulses: u64,
    asked: Cell<u32>,
}

impl Scripted {
    const fn moving_at(moves_at: u32) -> Self {
        Self {
            moves_at,
            allowed: u32::MAX,
            fails_after: u64::MAX,
            pulses: 0,
            asked: Cell::new(0),
        }
    }
}

impl Probe for Scripted {
    type Error = &'static str;

    fn may_raise(&mut self, from: Milli, to: Milli) -> Result<bool, Self::Error> {
        assert!(from < to);
        self.asked.set(self.asked.get() + 1);
        Ok(to.0 <= self.allowed)
    }

    fn rest(&mut self, has_baseline: bool) -> Result<Vec<f64>, Self::Error> {
        let quiet = [0.0, 0.1, -0.1, 0.1, -0.1, 0.0, 0.1, -0.1, 0.1, -0.1];
        Ok(if has_baseline {
            quiet.to_vec()
        } else {
            Vec::new()
        })
    }

    fn present(&mut self, level: Milli, has_windows: bool) -> Result<Vec<f64>, Self::Error> {
        self.pulses += 45;
        if self.pulses > self.fails_after {
            return Err("the cable");
        }
        let deg = if level.0 >= self.moves_at { 5.0 } else { 0.0 };
        Ok(if has_windows {
            vec![deg; 5]
        } else {
            Vec::new()
        })
    }

    fn rating(&mut self, level: Milli) -> Result<u8, Self::Error> {
        Ok(if level.0 >= self.moves_at { 8 } else { 2 })
    }

    fn observed_movement(&mut self, level: Milli) -> Result<Option<bool>, Self::Error> {
        Ok(Some(level.0 >= self.moves_at))
    }

    fn pulses(&self) -> u64 {
        self.pulses
    }
}

fn declared(fields: &str) -> Result<Search, Vec<String>> {
    let text = format!("session = \"s.toml\"\n[[search]]\n{fields}");
    SearchFile::parse(&text).map(|mut file| file.searches.remove(0))
}

fn one(kind: &str, more: &str) -> Search {
    let fields = format!("kind = \"{kind}\"\nstart = 2.0\nstep = 1.0\nlimit = 20.0\n{more}");
    declared(&fields).unwrap()
}

fn found(kind: &str, more: &str, mut probe: Scripted) -> Finding<&'static str> {
    search(&one(kind, more), &mut probe, |_| {})
}

#[test]
fn each_kind_finds_what_it_is_for_and_counts_what_it_cost() {
    let at = |value: u32, low: u32, high: u32| (Some(Milli(value)), Milli(low), Some(Milli(high)));
    let of = |f: &Finding<_>| (f.value, f.low, f.high);
    let threshold = found("threshold", "channel = 1", Scripted::moving_at(7_300));
    assert_eq!(of(&threshold), at(7_500, 7_000, 8_000));
    // 2 to 8 mA, and 8 mA once more.
    assert_eq!((threshold.trail.len(), threshold.pulses), (8, 8 * 45));
    assert_eq!(
        threshold.trail.iter().map(|step| step.pulses).sum::<u64>(),
        8 * 45
    );
    let eye = "channel = 1\nobserver = \"eye\"\nvisible_deg = 2.0";
    let visible = found("visible", eye, Scripted::moving_at(7_300));
    assert_eq!(of(&visible), at(7_500, 7_000, 8_000));
    assert_eq!(visible.trail.last().unwrap().answer, Answer::Seen(true));
    let comfort = found(
        "comfort",
        "channel = 1\nrating = 3",
        Scripted::moving_at(7_300),
    );
    assert_eq!(
        (of(&comfort), comfort.trail.len()),
        (at(7_500, 7_000, 8_000), 8)
    );
    // A level that is too strong is presented once.
    let maximum = found(
        "maximum",
        "channel = 1\nrating = 7",
        Scripted::moving_at(7_300),
    );
    assert_eq!(
        (of(&maximum), maximum.trail.len()),
        (at(7_500, 7_000, 8_000), 7)
    );
    let none = found("threshold", "channel = 1", Scripted::moving_at(30_000));
    assert_eq!(
        (none.value, none.low, none.high),
        (None, Milli(20_000), None)
    );
    assert_eq!(none.ended, SearchEnd::Limit);
    let ratio = declared(
        "kind = \"ratio\"\nof = [{ channel = 1, max = 28.0 }]\nstart = 0.1\nstep = 0.1\nlimit = 1.0",
    );
    let mut probe = Scripted::moving_at(650);
    assert_eq!(
        of(&search(&ratio.unwrap(), &mut probe, |_| {})),
        at(650, 600, 700)
    );
}

#[test]
fn an_end_before_its_time_leaves_how_far_it_came() {
    let mut refused = Scripted::moving_at(9_000);
    refused.allowed = 5_000;
    let finding = found("threshold", "channel = 1", refused);
    assert_eq!(finding.ended, SearchEnd::Refused(Milli(6_000)));
    assert_eq!(
        (finding.value, finding.low, finding.trail.len()),
        (None, Milli(5_000), 4)
    );
    let mut lost = Scripted::moving_at(9_000);
    lost.fails_after = 100;
    let finding = found("threshold", "channel = 1", lost);
    assert_eq!(finding.ended, SearchEnd::Failed("the cable"));
    // The failed presentation counts its pulses, too.
    assert_eq!(
        (finding.low, finding.trail.len(), finding.pulses),
        (Milli(3_000), 2, 135)
    );
    let mut probe = Scripted::moving_at(9_000);
    search(&one("threshold", "channel = 1"), &mut probe, |_| {});
    assert_eq!(probe.asked.get(), 9, "2 to 9 mA, and 9 mA once more");
}

#[test]
fn what_cannot_be_is_refused_by_name_and_all_at_once() {
    let stair = "start = 2.0\nstep = 1.0\nlimit = 20.0\n";
    let cases: [(&str, &[&str]); 7] = [
        (
            "kind = \"threshold\"\nstart = 2.0001\nstep = 0.0\nlimit = nan\nwindows = 0\nrest_s = 0.5",
            &[
                "start",
                "step",
                "limit",
                "windows",
                "consecutive",
                "channel",
                "rest_s",
            ],
        ),
        (
            &format!("kind = \"ratio\"\nchannel = 1\n{stair}"),
            &["channel", "of"],
        ),
        (
            &format!("kind = \"comfort\"\nchannel = 11\nvisible_deg = 2.0\n{stair}"),
            &["channel", "visible_deg", "rating"],
        ),
        (
            &format!("kind = \"threshold\"\nchannel = 1\nk_sigma = 1.0\n{stair}"),
            &["k_sigma"],
        ),
        (
            "kind = \"threshold\"\nchannel = 1\nstart = 9\nstep = 1\nlimit = 8",
            &["start"],
        ),
        (
            "kind = \"threshold\"\nchannel = 1\nstart = 1\nstep = 0.001\nlimit = 8",
            &["step"],
        ),
        (
            &format!("kind = \"threshold\"\nchanel = 1\n{stair}"),
            &["chanel"],
        ),
    ];
    for (fields, named) in cases {
        let told = declared(fields).unwrap_err();
        println!("{told:#?}");
        assert_eq!(told.len(), named.len(), "{fields}");
        for name in named {
            assert!(
                told.iter().any(|mistake| mistake.contains(name)),
                "{name}: {told:?}"
            );
        }
    }
    assert!(SearchFile::parse("session = \"s.toml\"").is_err());
    let limits = |channel: u8| (channel == 1).then_some((Milli(15_000), "V"));
    let told = one("threshold", "channel = 1").limit_violations(limits);
    assert_eq!(
        told,
        ["the staircase would reach 20 V on channel 1, above the wearer's limit of 15 V"]
    );
    assert_eq!(
        one("threshold", "channel = 2")
            .limit_violations(limits)
            .len(),
        1
    );
}
