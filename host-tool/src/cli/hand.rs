//! `flexor experiment hamana-4 --wearer …` and `hamana-hold`: Hamana 2022's participants
//! on a forearm that is a mechanism.

use super::experiment::{ExperimentArgs, command};
use super::{Bar, Incomplete, Output, interrupt, wrong};
use host_core::link::Interruption;
use host_core::plot::words::in_columns;
use host_core::record::{replace_file, sha256};
use host_core::statistics::{quantile_of, share};
use rayon::prelude::*;
use serde_json::json;
use std::collections::BTreeMap;
use studies::laboratory::{self, Declared, Outcome, Share};
use studies::two_points::{
    DECLARED, LAWS, Method, Participant, Participants, Population, TwoPointsError, WEARERS, Wearer,
};

/// A number for each quantity that has one, and why others have none.
type Measured = (Vec<Option<f64>>, Vec<String>);

const CONTROL: &str = "hamana-4";
const HOLD: &str = "hamana-hold";
/// Most replications.
const MOST: u64 = 1_000;
const SIMULATED: &str =
    "Simulated: drawn forearms of assumed parameters; no evidence about people.";

/// Whether `args` means this study.
pub(super) fn is_meant(args: &ExperimentArgs) -> bool {
    args.name == HOLD || args.wearer.is_some()
}

/// One participant's draws.
struct Of<'p> {
    participant: &'p Participant,
    /// By draw; otherwise why there is none.
    drawn: Vec<Result<Wearer, &'static str>>,
    /// By quantity: a number for each draw that has one.
    numbers: Vec<Vec<Option<f64>>>,
    /// Why methods have no number in a draw.
    refused_for: Vec<String>,
}

/// # Errors
/// Arguments out of range, a folder that cannot be written, a signal.
pub(super) fn main(args: &ExperimentArgs, output: Output) -> anyhow::Result<()> {
    if args.name != CONTROL && args.name != HOLD {
        return wrong(format!(
            "--wearer belongs to {CONTROL} and {HOLD}, not to {}",
            args.name
        ));
    }
    if args.device.is_port() {
        return wrong(format!(
            "a drawn forearm is simulated, --device is {}; allowed: native, chip, qemu",
            args.device
        ));
    }
    let participants = Participants::asked(args.wearer.as_deref())?;
    let population = Population::declared()?;
    let seed = args.seed.unwrap_or(participants.seed);
    let draws = args.draws.unwrap_or(participants.draws);
    if draws == 0 || draws > MOST {
        return wrong(format!("--draws is {draws}, allowed is 1 to {MOST}"));
    }
    let place = args.out.place(&args.name)?;
    let interruption = interrupt::heed()?;
    let bar = output.bar(&args.name);
    let study = Study {
        args,
        participants: &participants,
        population: &population,
        decided: (seed, draws),
        beside: (&bar, &interruption),
    };
    let (mut all, mut rows) = (Vec::new(), study.head().to_owned());
    for number in 0..participants.all.len() {
        if interruption.asked().is_some() {
            break;
        }
        let of = study.of(number, &mut rows)?;
        all.push(of);
    }
    bar.finish();
    let mut result = study.result(&all);
    let (done, of) = (all.len(), participants.all.len());
    if let Some(signal) = interruption.asked() {
        result.cut_short = Some(format!("Cut short after {done} of {of} wearers, in part."));
        laboratory::publish(place.dir(), &result, &[])?;
        let error = interrupt::Ended(signal, format!("after {done} of {of} wearers")).into();
        let result = json!({ "result": result });
        return Err(Incomplete { error, result }.into());
    }
    laboratory::publish(place.dir(), &result, &[])?;
    replace_file(&place.dir().join("draws.csv"), rows.as_bytes())?;
    let page = place.dir().join("result.html").display().to_string();
    output.say(
        || format!("{}\nPage: {page}", study.people(&all)),
        || json!({ "result": result, "page": page }),
    )
}

/// What happened, without numbers of the draw and what to do about it.
fn brief(why: &str) -> &str {
    why.split([';', '(']).next().unwrap_or(why).trim_end()
}

struct Study<'a> {
    args: &'a ExperimentArgs,
    participants: &'a Participants,
    population: &'a Population,
    decided: (u64, u64),
    beside: (&'a Bar, &'a Interruption),
}

impl Study<'_> {
    fn is_hold(&self) -> bool {
        self.args.name == HOLD
    }

    /// What is measured: one point's, then two's; with both laws in experiment 4.
    fn quantities(&self) -> Vec<String> {
        match self.is_hold() {
            true => vec!["one sinks".to_owned(), "two sinks".to_owned()],
            false => LAWS
                .iter()
                .flat_map(|law| ["one", "two"].map(|points| format!("{points}, {law}")))
                .collect(),
        }
    }

    const fn head(&self) -> &'static str {
        "wearer,draw,became,va_th,va_max,vb_th,vb_max,r_th,ve_th,ve_max,quantity,mean_deg\n"
    }

    /// All draws of participant `number`; a row each in `rows`.
    fn of(&self, number: usize, rows: &mut String) -> Result<Of<'_>, TwoPointsError> {
        let participant = &self.participants.all[number];
        let (seed, draws) = self.decided;
        let indices: Vec<u64> = (0..draws).collect();
        let each = indices.par_iter().map(|index| {
            if self.beside.1.asked().is_some() {
                return Ok((Err("interrupted"), (Vec::new(), Vec::new())));
            }
            let drawn = participant.draw(self.population, (seed, *index))?;
            let numbers = match &drawn {
                Ok(wearer) => self.numbers(wearer)?,
                Err(_) => (vec![None; self.quantities().len()], Vec::new()),
            };
            let part = number as f64 / self.participants.all.len() as f64;
            self.beside.0.set(part);
            Ok((drawn, numbers))
        });
        let both = each.collect::<Result<Vec<_>, TwoPointsError>>()?;
        let (drawn, measured): (Vec<_>, Vec<_>) = both.into_iter().unzip();
        let (numbers, refused_for): (Vec<_>, Vec<_>) = measured.into_iter().unzip();
        for (index, (drawn, numbers)) in drawn.iter().zip(&numbers).enumerate() {
            *rows += &self.rows(&participant.name, index, drawn, numbers);
        }
        Ok(Of {
            participant,
            drawn,
            numbers,
            refused_for: refused_for.concat(),
        })
    }

    fn rows(
        &self,
        name: &str,
        index: usize,
        drawn: &Result<Wearer, &'static str>,
        numbers: &[Option<f64>],
    ) -> String {
        let begin = match drawn {
            Err(why) => return format!("{name},{index},\"{why}\"{}\n", ",".repeat(9)),
            Ok(wearer) => {
                let [[a, b], [am, bm]] = [wearer.voltages.threshold_v, wearer.voltages.most_v];
                let [e, em] = wearer.extensor_v;
                let r = wearer
                    .voltages
                    .ratio
                    .map_or_else(String::new, |r| r.to_string());
                format!("{name},{index},whole,{a},{am},{b},{bm},{r},{e},{em}")
            }
        };
        let rows = self.quantities().into_iter().zip(numbers);
        rows.map(|(quantity, number)| {
            let number = number.map_or_else(String::new, |it| format!("{it:.3}"));
            format!("{begin},\"{quantity}\",{number}\n")
        })
        .collect()
    }

    /// Each quantity's mean over trials, one point being the better of A and B; and why
    /// methods have none.
    fn numbers(&self, wearer: &Wearer) -> Result<Measured, TwoPointsError> {
        let mean =
            |all: &[f64]| (!all.is_empty()).then(|| all.iter().sum::<f64>() / all.len() as f64);
        if self.is_hold() {
            let trials = (0..self.participants.held)
                .map(|number| wearer.hold(self.population, number))
                .collect::<Result<Vec<_>, _>>()?;
            let of = |place: usize| {
                let all: Vec<f64> = trials.iter().map(|it| it[place].sinks_deg()).collect();
                mean(&all)
            };
            return Ok((vec![of(0), of(1)], Vec::new()));
        }
        let (mut numbers, mut refused_for) = (Vec::new(), Vec::new());
        for law in LAWS {
            let mut of = [None; 3];
            for (method, place) in Method::ALL.into_iter().zip(&mut of) {
                let trials = (0..self.participants.trials).map(|number| {
                    wearer.track(self.population, (method, law), (&self.args.device, number))
                });
                let trials = trials.collect::<Result<Vec<_>, _>>()?;
                let refused = trials.iter().find_map(|it| it.as_ref().err());
                refused_for
                    .extend(refused.map(|why| format!("{}, {law}: {}", method.name(), brief(why))));
                let all = trials.into_iter().map(|it| it.map(|it| it.rmse_deg).ok());
                let all: Option<Vec<f64>> = all.collect();
                *place = all.as_deref().and_then(mean);
            }
            let [a, b, two] = of;
            numbers.push(a.into_iter().chain(b).reduce(f64::min));
            numbers.push(two);
        }
        Ok((numbers, refused_for))
    }

    fn result(&self, all: &[Of<'_>]) -> Outcome {
        let (seed, draws) = self.decided;
        let notes = all.iter().flat_map(|of| {
            let (name, missing) = (&of.participant.name, of.missing());
            missing
                .into_iter()
                .map(move |(why, count)| format!("{name}: {count} of {draws} draws: {why}."))
        });
        let is = (seed, draws) == (self.participants.seed, self.participants.draws);
        let own = self.participants.own.as_deref();
        let wearers = own.map_or(("wearers.toml", WEARERS), |own| ("wearer", own));
        let files = [("population.toml", DECLARED), wearers];
        Outcome {
            name: self.args.name.clone(),
            title: match self.is_hold() {
                true => "Hamana 2022: how far a held finger sinks in 10 s, one point or two",
                false => "Hamana 2022, experiment 4, on a forearm that is a mechanism",
            }
            .to_owned(),
            seed,
            simulated: Some(true),
            cut_short: None,
            declared: Declared {
                asked: self.args.name.clone(),
                command: Some(command(self.args, draws)),
                device: Some(self.args.device.typed()),
                sha256: files
                    .map(|(file, text)| (file.to_owned(), sha256(text.as_bytes())))
                    .into_iter()
                    .collect::<BTreeMap<_, _>>(),
                source: "Hamana et al. 2022, section III-D, tables 1, 7 and 8".to_owned(),
                draws,
                as_declared: is && self.args.wearer.as_deref().is_none_or(|it| it == "all"),
            },
            conditions: Vec::new(),
            rows: Vec::new(),
            shares: all.iter().flat_map(|of| self.shares(of)).collect(),
            decides: Vec::new(),
            sheets: Vec::new(),
            notes: [SIMULATED.to_owned()].into_iter().chain(notes).collect(),
        }
    }

    /// In how many draws two points do better, at each law.
    fn shares(&self, of: &Of<'_>) -> Vec<Share> {
        let pairs = (0..self.quantities().len()).step_by(2);
        let share_of = |first: usize| {
            let (holds, judged) = of.better(first);
            let interval = share(holds as f64, judged, 0.95).ok();
            let (what, law) = match self.is_hold() {
                true => ("two points sink less", String::new()),
                false => (
                    "two points: lower RMSE than the better one",
                    LAWS[first / 2].to_owned(),
                ),
            };
            let at = format!("{} {law}", of.participant.name);
            Share {
                id: format!("two-better-{}", at.trim().replace(' ', "-")),
                at: at.trim().to_owned(),
                claim: what.to_owned(),
                paper: of.participant.paper.as_ref().map(|_| true),
                holds,
                of: judged,
                low: interval.map(|it| it.low),
                high: interval.map(|it| it.high),
            }
        };
        pairs.map(share_of).collect()
    }

    fn people(&self, all: &[Of<'_>]) -> String {
        let mut text = format!(
            "{:<3}{:<18}{:>6}{:>9}{:>8}{:>8}{:>14}{:>9}\n",
            "", "°", "draws", "median", "5 %", "95 %", "two better", "paper"
        );
        for of in all {
            for (place, quantity) in self.quantities().iter().enumerate() {
                let numbers = of.sorted(place);
                let at = |part| match numbers.is_empty() {
                    true => "-".to_owned(),
                    false => format!("{:.1}", quantile_of(&numbers, part)),
                };
                let (holds, judged) = of.better(place - place % 2);
                let better = match place % 2 {
                    0 => String::new(),
                    _ => format!("{holds} of {judged}"),
                };
                let paper = of
                    .participant
                    .paper
                    .as_ref()
                    .map(|it| match self.is_hold() {
                        true => it.sinks_deg[place],
                        false => it.rmse_deg[place % 2],
                    });
                // The paper's numbers are its own law's.
                let paper = paper.filter(|_| place < 2);
                text += &format!(
                    "{:<3}{quantity:<18}{:>6}{:>9}{:>8}{:>8}{better:>14}{:>9}\n",
                    of.participant.name,
                    numbers.len(),
                    at(0.5),
                    at(0.05),
                    at(0.95),
                    paper.map_or_else(|| "-".to_owned(), |it| format!("{it:.1}")),
                );
            }
            text += &of.voltages();
            for (why, count) in of.missing() {
                let told = format!("{count} of {} draws: {why}", of.drawn.len());
                text += &format!("{}\n", in_columns(&told, 80));
            }
        }
        text + &in_columns(SIMULATED, 80)
    }
}

impl Of<'_> {
    fn sorted(&self, place: usize) -> Vec<f64> {
        let numbers = self.numbers.iter();
        let mut all: Vec<f64> = numbers
            .filter_map(|it| it.get(place).copied().flatten())
            .collect();
        all.sort_unstable_by(f64::total_cmp);
        all
    }

    /// Draws in which the number at `first` exceeds the one after it, of those with both.
    fn better(&self, first: usize) -> (u64, u64) {
        let both = self.numbers.iter().filter_map(|it| {
            let at = |place: usize| it.get(place).copied().flatten();
            Some((at(first)?, at(first + 1)?))
        });
        let both: Vec<_> = both.collect();
        let holds = both.iter().filter(|(one, two)| two < one).count();
        (holds as u64, both.len() as u64)
    }

    fn missing(&self) -> BTreeMap<&str, usize> {
        let mut all = BTreeMap::new();
        let drawn = self
            .drawn
            .iter()
            .filter_map(|it| it.as_ref().err().copied());
        for why in drawn.chain(self.refused_for.iter().map(String::as_str)) {
            *all.entry(why).or_insert(0) += 1;
        }
        all
    }

    /// Greatest voltages beside table 7's.
    fn voltages(&self) -> String {
        let wearers: Vec<&Wearer> = self.drawn.iter().flatten().collect();
        let median = |of: &dyn Fn(&Wearer) -> Option<f64>| {
            let mut all: Vec<f64> = wearers.iter().filter_map(|it| of(it)).collect();
            all.sort_unstable_by(f64::total_cmp);
            match all.is_empty() {
                true => "-".to_owned(),
                false => format!("{:.1}", quantile_of(&all, 0.5)),
            }
        };
        let found = [
            median(&|it| Some(it.voltages.most_v[0])),
            median(&|it| Some(it.voltages.most_v[1])),
            median(&|it| Some(it.extensor_v[1])),
            median(&|it| it.voltages.ratio),
        ];
        let [a, b, e, r] = found;
        let paper = self.participant.paper.as_ref().map_or_else(
            || "none".to_owned(),
            |it| {
                let [a, b, e] = it.most_v;
                format!("{a:.0}, {b:.0}, {e:.0}, {}", it.r_th)
            },
        );
        format!("   greatest V at A, B, E and r_th: {a}, {b}, {e}, {r}; paper: {paper}\n")
    }
}
