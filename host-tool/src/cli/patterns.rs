//! `flexor experiment hamana-1`, `hamana-2`, `hamana-3` and `hamana-posture`: Hamana 2022's
//! experiments on the body alone.

use super::experiment::{ExperimentArgs, command};
use super::{Incomplete, Output, interrupt, wrong};
use host_core::plot::words::in_columns;
use host_core::record::{replace_file, sha256};
use host_core::run::DeviceName;
use rayon::prelude::*;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::sync::atomic::{AtomicUsize, Ordering};
use studies::laboratory::{self, Declared, Outcome, Row, Share, headline};
use studies::two_points::{
    DECLARED, EXPERIMENTS, Experiment, Participants, Population, Protocol, Session, TwoPointsError,
    WEARERS, compared,
};

/// Most replications.
const MOST: u64 = 1_000;
const SIMULATED: &str =
    "Simulated: drawn forearms of assumed parameters; no evidence about people.";
const HEAD: &str = "wearer,draw,became,condition,trial,place,index_nm,individuation,index_deg,\
                    thumb,index,middle,ring,little\n";
/// Names, titles and what is measured.
const ALL: [(&str, Experiment, &str); 4] = [
    (
        "hamana-1",
        Experiment::Selectivity,
        "Hamana 2022, experiment 1: individuation of 25 patterns",
    ),
    (
        "hamana-2",
        Experiment::Torque,
        "Hamana 2022, experiment 2: torque of 29 patterns",
    ),
    (
        "hamana-3",
        Experiment::Intensities,
        "Hamana 2022, experiment 3: fingers at nine intensities",
    ),
    (
        "hamana-posture",
        Experiment::Posture,
        "Hamana 2022, III-D6: the index finger as the forearm pronates",
    ),
];

/// Which of them `args` means.
fn meant(args: &ExperimentArgs) -> Option<(Experiment, &'static str)> {
    let mut all = ALL.into_iter();
    all.find_map(|(name, of, title)| (args.name == name).then_some((of, title)))
}

/// Whether `args` means one of them.
pub(super) fn is_meant(args: &ExperimentArgs) -> bool {
    meant(args).is_some()
}

/// A draw of a participant: a session, or why there is none.
type Drawn = Result<Session, &'static str>;

struct Study {
    experiment: Experiment,
    protocol: Protocol,
    population: Population,
    participants: Participants,
    seed: u64,
    draws: u64,
}

/// # Errors
/// Arguments out of range, a folder that cannot be written, a signal.
pub(super) fn main(args: &ExperimentArgs, output: Output) -> anyhow::Result<()> {
    let Some((experiment, title)) = meant(args) else {
        return wrong(format!("{} is none of Hamana's", args.name));
    };
    if args.device != DeviceName::Native {
        return wrong(format!(
            "{} is of the body alone, --device is {}; allowed: native",
            args.name, args.device
        ));
    }
    let study = Study::of(experiment, args)?;
    let place = args.out.place(&args.name)?;
    let interruption = interrupt::heed()?;
    let bar = output.bar(&args.name);
    let all: Vec<(&str, u64)> = study
        .participants
        .all
        .iter()
        .flat_map(|it| (0..study.draws).map(|draw| (&*it.name, draw)))
        .collect();
    let done = AtomicUsize::new(0);
    let drawn: Vec<Option<Drawn>> = all
        .par_iter()
        .map(|(name, draw)| {
            if interruption.asked().is_some() {
                return Ok(None);
            }
            let drawn = study.draw(name, *draw)?;
            let count = done.fetch_add(1, Ordering::Relaxed) + 1;
            bar.set(count as f64 / all.len() as f64);
            Ok(Some(drawn))
        })
        .collect::<Result<_, TwoPointsError>>()?;
    bar.finish();
    let mut result = study.result(args, title, &all, &drawn);
    let of = format!("{} of {} draws", drawn.iter().flatten().count(), all.len());
    let signal = interruption.asked();
    result.cut_short = signal.map(|_| format!("Cut short after {of}."));
    let written = laboratory::publish(place.dir(), &result, &[]).map_err(anyhow::Error::from);
    let rows = study.csv(&all, &drawn);
    let written = written.and_then(|()| {
        Ok(replace_file(
            &place.dir().join("draws.csv"),
            rows.as_bytes(),
        )?)
    });
    let page = place.dir().join("result.html").display().to_string();
    let told = || format!("{}\nPage: {page}", people(&result));
    let ended = signal.map(|it| interrupt::Ended(it, format!("after {of}")).into());
    match written.err().or(ended) {
        None => output.say(told, || json!({ "result": result, "page": page })),
        Some(error) => {
            if !output.json {
                output.say(told, || Value::Null)?;
            }
            let result = json!({ "result": result });
            Err(Incomplete { error, result }.into())
        }
    }
}

impl Study {
    fn of(experiment: Experiment, args: &ExperimentArgs) -> anyhow::Result<Self> {
        let protocol = Protocol::declared()?;
        // The paper's experiment 3 is P's.
        let default = (experiment == Experiment::Intensities).then_some("P");
        let name = args.wearer.as_deref().or(default);
        let participants = Participants::asked(name)?;
        let draws = args.draws.unwrap_or(participants.draws);
        if draws == 0 || draws > MOST {
            return wrong(format!("--draws is {draws}, allowed is 1 to {MOST}"));
        }
        Ok(Self {
            experiment,
            protocol,
            population: Population::declared()?,
            seed: args.seed.unwrap_or(participants.seed),
            draws,
            participants,
        })
    }

    fn draw(&self, name: &str, draw: u64) -> Result<Drawn, TwoPointsError> {
        let all = &self.participants.all;
        let Some(participant) = all.iter().find(|it| it.name == name) else {
            return Err(TwoPointsError::Nobody(name.to_owned()));
        };
        let wearer = match participant.draw(&self.population, (self.seed, draw))? {
            Ok(wearer) => wearer,
            Err(why) => return Ok(Err(why)),
        };
        let stimulated = wearer.stimulated(&self.population, &self.protocol, self.experiment)?;
        Ok(Ok(Session {
            participant: name.to_owned(),
            is_printed: participant.paper.is_some(),
            draw,
            conditions: self.experiment.conditions(&wearer.voltages, &self.protocol),
            stimulated,
        }))
    }

    fn csv(&self, all: &[(&str, u64)], drawn: &[Option<Drawn>]) -> String {
        let mut text = HEAD.to_owned();
        let number = |it: f64| format!("{it:.4}");
        for ((name, draw), drawn) in all.iter().zip(drawn) {
            let session = match drawn {
                None => continue,
                Some(Err(why)) => {
                    let _ = writeln!(text, "{name},{draw},\"{why}\"{}", ",".repeat(11));
                    continue;
                }
                Some(Ok(session)) => session,
            };
            for it in &session.stimulated {
                let condition = &session.conditions[it.condition].name;
                let individuation = it.individuation.map_or_else(String::new, number);
                let flexed = it.flexed.map(number).join(",");
                let _ = writeln!(
                    text,
                    "{name},{draw},whole,\"{condition}\",{},{},{:.6},{individuation},{:.3},{flexed}",
                    it.trial, it.place, it.torque_nm, it.index_deg
                );
            }
        }
        text
    }

    fn result(
        &self,
        args: &ExperimentArgs,
        title: &str,
        all: &[(&str, u64)],
        drawn: &[Option<Drawn>],
    ) -> Outcome {
        let sessions: Vec<Session> = drawn.iter().flatten().flatten().cloned().collect();
        let (rows, shares) = compared(self.experiment, &self.protocol, &sessions);
        let mut missing: BTreeMap<(&str, &str), usize> = BTreeMap::new();
        for ((name, _), drawn) in all.iter().zip(drawn) {
            if let Some(Err(why)) = drawn {
                *missing.entry((name, why)).or_default() += 1;
            }
        }
        let draws = self.draws;
        let missing = missing
            .into_iter()
            .map(|((name, why), count)| format!("{name}: {count} of {draws} draws: {why}."));
        let is = (self.seed, draws) == (self.participants.seed, self.participants.draws);
        let own = self.participants.own.as_deref();
        let files = [
            ("experiments.toml", EXPERIMENTS),
            ("population.toml", DECLARED),
            own.map_or(("wearers.toml", WEARERS), |own| ("wearer", own)),
        ];
        Outcome {
            name: args.name.clone(),
            title: title.to_owned(),
            seed: self.seed,
            simulated: Some(true),
            cut_short: None,
            declared: Declared {
                asked: args.name.clone(),
                command: Some(command(args, draws)),
                device: Some(args.device.typed()),
                sha256: files
                    .map(|(file, text)| (file.to_owned(), sha256(text.as_bytes())))
                    .into_iter()
                    .collect(),
                source: "Hamana et al. 2022, sections III-A to III-D6, tables 4 to 6".to_owned(),
                draws,
                as_declared: is && args.wearer.is_none(),
            },
            conditions: Vec::new(),
            rows,
            shares,
            decides: Vec::new(),
            sheets: Vec::new(),
            notes: [SIMULATED, MEANING]
                .into_iter()
                .chain((self.experiment == Experiment::Posture).then_some(ROTATION))
                .map(str::to_owned)
                .chain(missing)
                .collect(),
        }
    }
}

const MEANING: &str = "Ours is the median, low and high the 5th and 95th percentile of the draws \
                       that have a number: replications by whoever of the participants has points \
                       and voltages in them.";

const ROTATION: &str = "Of rotation the sources disagree: Bao 2018's abstract finds no significant \
                        effect, Hamana 2022 that one point falls. The t-tests of 0° against 90° \
                        are ours, over every draw.";

/// The experiment whose rows are of five fingers each.
const FINGERS: &str = "hamana-3";

/// Medians of each finger at each intensity, %, and how many draws have them.
fn fingers(rows: &[Row]) -> String {
    let mut text = format!("{:<36}{:>4}", "median, % of the finger's range", "n");
    let names = rows.iter().take(5);
    let names = names.filter_map(|it| it.quantity.rsplit(", ").next());
    text.extend(names.map(|name| format!("{name:>8}")));
    for all in rows.chunks(5) {
        let Some(first) = all.first() else { continue };
        let name = first.quantity.rsplit_once(", ");
        let name = name.map_or("", |(name, _)| name);
        text += &format!("\n{name:<36.36}{:>4}", first.n);
        for it in all {
            let ours = it
                .ours
                .map_or_else(|| "-".to_owned(), |it| format!("{it:.1}"));
            text += &format!("{ours:>8}");
        }
    }
    text + "\n"
}

/// Rows, shares and notes in 80 columns.
fn people(result: &Outcome) -> String {
    let number = |it: Option<f64>| match it {
        None => "-".to_owned(),
        Some(it) if it.abs() >= 100.0 => format!("{it:.0}"),
        Some(it) => format!("{it:.3}"),
    };
    let mut text = format!(
        "{:<42}{:>4}{:>9}{:>8}{:>8}{:>9}\n",
        "", "n", "median", "5 %", "95 %", "paper"
    );
    let line = |row: &Row| {
        let name = match &*row.unit {
            "" => row.quantity.clone(),
            unit => format!("{}, {unit}", row.quantity),
        };
        let [ours, low, high, paper] = [row.ours, row.low, row.high, row.paper].map(number);
        format!(
            "{name:<42.42}{:>4}{ours:>9}{low:>8}{high:>8}{paper:>9}\n",
            row.n
        )
    };
    match result.name == FINGERS {
        true => text = fingers(&result.rows),
        false => text.extend(result.rows.iter().map(line)),
    }
    text += "\n";
    let line = |it: &Share| {
        let paper = match it.paper {
            None => "paper: -",
            Some(true) => "paper: yes",
            Some(false) => "paper: no",
        };
        format!(
            "{:<50.50}{:>4} of {:<5}{paper}\n",
            it.claim, it.holds, it.of
        )
    };
    text.extend(result.shares.iter().map(line));
    text += &format!("\n{}\n", in_columns(&headline(result), 80));
    for note in &result.notes {
        text += &format!("{}\n", in_columns(note, 80));
    }
    text.trim_end().to_owned()
}
