//! What the drawn wearers of a cell come to: a line of a table, shares for `result.json`,
//! rows of `draws.csv`.

use super::population::Population;
use super::study::{Cell, Drawn, Numbers};
use crate::laboratory::Share;
use host_core::statistics::{quantile_of, share};

/// A cell and its wearers, in their order.
#[derive(Clone, Debug)]
pub struct Summary {
    /// Which.
    pub cell: Cell,
    /// Its wearers, from number 0.
    pub drawn: Vec<Drawn>,
}

/// Columns of a claim, as short as a table of 80 columns wants them.
const SHORT: [&str; 8] = [
    "sel", "500us", "two>1", "C>I", "I=1", "C=I,1", "r_th", "post",
];

impl Cell {
    /// In a table and in `draws.csv`.
    #[must_use]
    pub fn name(&self) -> String {
        let volts = match self.volts {
            0.0 => "searched".to_owned(),
            part => format!("+{:.0} %", 100.0 * part),
        };
        match &self.without {
            Some(what) => format!("no {what}"),
            None => format!("{} {} {volts}", self.rule, self.return_factor),
        }
    }
}

impl Summary {
    fn whole(&self) -> impl Iterator<Item = &Numbers> + Clone {
        self.drawn.iter().filter_map(|it| match it {
            Drawn::Whole(numbers) => Some(numbers),
            Drawn::NoPoints | Drawn::NoCoupling | Drawn::Held | Drawn::NoVoltages => None,
        })
    }

    /// Wearers in whom claim `index` holds, of those in whom it can be judged.
    fn holds(&self, index: usize) -> (u64, u64) {
        let judged = self.whole().filter_map(|it| it.claims[index]);
        (
            judged.clone().filter(|it| *it).count() as u64,
            judged.count() as u64,
        )
    }

    /// All claims at once; one that cannot be judged does not hold.
    fn holds_jointly(&self) -> (u64, u64) {
        let all = self
            .whole()
            .filter(|it| it.claims.iter().all(|c| *c == Some(true)));
        (all.count() as u64, self.whole().count() as u64)
    }

    /// The table's head.
    #[must_use]
    pub fn head() -> String {
        let claims = SHORT.map(|short| format!("{short:>6}")).concat();
        format!("{:<23}{:>4}{claims}{:>5}", "cell", "n", "all")
    }

    /// Its line: wearers with all numbers, and in how many of a hundred each claim holds.
    #[must_use]
    pub fn line(&self) -> String {
        let percent = |(holds, of): (u64, u64)| match of {
            0 => "-".to_owned(),
            _ => format!("{:.0}", 100.0 * holds as f64 / of as f64),
        };
        let claims = (0..SHORT.len()).map(|index| format!("{:>6}", percent(self.holds(index))));
        let (claims, n) = (claims.collect::<String>(), self.whole().count());
        let all = percent(self.holds_jointly());
        format!("{:<23}{n:>4}{claims}{all:>5}", self.cell.name())
    }

    /// Why wearers are missing, and medians of what the claims compare.
    #[must_use]
    pub fn below(&self) -> String {
        let count = |is: fn(&Drawn) -> bool| self.drawn.iter().filter(|it| is(it)).count();
        let no_points = count(|it| matches!(it, Drawn::NoPoints));
        let no_volts = count(|it| matches!(it, Drawn::NoVoltages));
        let median = |of: &dyn Fn(&Numbers) -> f64| {
            let mut all: Vec<f64> = self.whole().map(of).filter(|it| it.is_finite()).collect();
            all.sort_unstable_by(f64::total_cmp);
            match all.is_empty() {
                true => "-".to_owned(),
                false => format!("{:.2}", quantile_of(&all, 0.5)),
            }
        };
        format!(
            "  no points {no_points}, no voltages {no_volts}; medians: two/one {}, C/I {}, \
             one C/I {}",
            median(&|it| it.torques.two / it.torques.one),
            median(&|it| it.torques.two / it.torques.apart),
            median(&|it| it.torques.one / it.torques.one_isolated),
        )
    }

    /// Each claim's share, and that of all jointly.
    #[must_use]
    pub fn shares(&self, population: &Population) -> Vec<Share> {
        let claims = population.claims.iter().enumerate();
        let each = claims.map(|(index, claim)| (&*claim.id, &*claim.says, self.holds(index)));
        let jointly = ("all", "all of them in one wearer", self.holds_jointly());
        let all = each.chain([jointly]);
        let share = |(id, says, (holds, of)): (&str, &str, (u64, u64))| {
            let interval = share(holds as f64, of, 0.95).ok();
            Share {
                id: id.to_owned(),
                at: self.cell.name(),
                claim: says.to_owned(),
                paper: Some(true),
                holds,
                of,
                low: interval.map(|it| it.low),
                high: interval.map(|it| it.high),
            }
        };
        all.map(share).collect()
    }

    /// Rows of `draws.csv`, without its head.
    #[must_use]
    pub fn rows(&self) -> String {
        let name = self.cell.name();
        let row = |(index, drawn): (usize, &Drawn)| match drawn {
            Drawn::NoPoints => format!("{name},{index},no points{}\n", ",".repeat(FIELDS)),
            Drawn::NoCoupling => format!("{name},{index},no coupling{}\n", ",".repeat(FIELDS)),
            Drawn::Held => format!("{name},{index},held{}\n", ",".repeat(FIELDS)),
            Drawn::NoVoltages => format!("{name},{index},no voltages{}\n", ",".repeat(FIELDS)),
            Drawn::Whole(it) => format!("{name},{index},whole,{}\n", fields(it).join(",")),
        };
        self.drawn.iter().enumerate().map(row).collect()
    }
}

/// Fields of a whole wearer's row.
const FIELDS: usize = 19;
/// The head of `draws.csv`.
pub const HEAD: &str = "cell,wearer,became,electrodes,va_th,va_max,vb_th,vb_max,r_th,two_nm,apart_nm,one_nm,\
                        one_isolated_nm,left_out,selective-apart,selective-from-500,two-stronger,\
                        conducted-stronger,isolated-as-one,one-point-alike,lower-threshold,posture\n";

fn fields(it: &Numbers) -> Vec<String> {
    let [va_th, vb_th] = it.voltages.threshold_v;
    let [va_max, vb_max] = it.voltages.most_v;
    let torques = &it.torques;
    let ratio = it
        .voltages
        .ratio
        .map_or_else(String::new, |r| format!("{r}"));
    let electrodes = if it.is_small { "small" } else { "round" };
    let mut all = vec![electrodes.to_owned()];
    all.extend([va_th, va_max, vb_th, vb_max].map(|v| format!("{v}")));
    all.push(ratio);
    let nm = [
        torques.two,
        torques.apart,
        torques.one,
        torques.one_isolated,
    ];
    all.extend(nm.map(|it| format!("{it:.6}")));
    all.push(it.left_out.to_string());
    all.extend(
        it.claims
            .map(|claim| claim.map_or_else(String::new, |it| it.to_string())),
    );
    all
}
