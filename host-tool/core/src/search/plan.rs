//! Checks a search declaration, reports all mistakes at once, and converts it to exact levels.

use super::declaration::{Kind, SearchDeclaration};
use super::milli::Milli;

/// Largest number of levels of one staircase, without repeats.
const MOST_LEVELS: u32 = 1000;

/// Largest accepted probability that a search finds a movement although no level causes one.
const FALSE_ALARMS: f64 = 0.01;

/// A channel that a search stimulates.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Site {
    /// Number of the channel, from 1.
    pub channel: u8,
    /// Amplitude at ratio 1; `None` if the levels of the search are amplitudes.
    pub max: Option<Milli>,
}

impl Site {
    /// Returns the amplitude of this channel at a level of the search.
    #[must_use]
    pub fn amplitude(&self, level: Milli) -> Milli {
        self.max.map_or(level, |max| level.fraction_of(max))
    }
}

/// A checked search with exact levels.
#[derive(Clone, PartialEq, Debug)]
pub struct Search {
    declared: SearchDeclaration,
    sites: Vec<Site>,
    /// First level, difference between levels, and largest allowed level.
    stair: [Milli; 3],
}

impl Search {
    /// Checks a declaration without regard to its session.
    ///
    /// # Errors
    /// Returns every mistake, with the name of its field.
    pub fn new(declared: SearchDeclaration) -> Result<Self, Vec<String>> {
        let mut mistakes = Vec::new();
        ranges(&declared, &mut mistakes);
        fitting(&declared, &mut mistakes);
        let mut exact = |name: &str, value: f64| {
            let milli = Milli::exactly(value).filter(|milli| milli.0 > 0);
            if milli.is_none() {
                mistakes.push(format!(
                    "{name} is {value}; allowed: multiples of 0.001 above 0"
                ));
            }
            milli.unwrap_or(Milli(1000))
        };
        let stair = [
            exact("start", declared.start),
            exact("step", declared.step),
            exact("limit", declared.limit),
        ];
        let sites: Vec<Site> = match declared.kind {
            Kind::Ratio => (declared.of.iter())
                .map(|share| Site {
                    channel: share.channel,
                    max: Some(exact("of.max", share.max)),
                })
                .collect(),
            _ => (declared.channel.iter())
                .map(|&channel| Site { channel, max: None })
                .collect(),
        };
        let search = Self {
            declared,
            sites,
            stair,
        };
        if mistakes.is_empty() {
            check_levels(&search, &mut mistakes);
        }
        match mistakes.is_empty() {
            true => Ok(search),
            false => Err(mistakes),
        }
    }

    /// Returns a message for each channel that this search would drive beyond the wearer's limit.
    /// `limit_of` receives the number of a channel, from 1, and returns the limit and its unit; it
    /// returns `None` if the session has no such channel or if the channel waits for a trigger.
    #[must_use]
    pub fn limit_violations<'a>(
        &self,
        limit_of: impl Fn(u8) -> Option<(Milli, &'a str)>,
    ) -> Vec<String> {
        let mut messages = Vec::new();
        let highest = self.levels().last().unwrap_or_default();
        for site in &self.sites {
            let (channel, top) = (site.channel, site.amplitude(highest));
            match limit_of(channel) {
                None => messages.push(format!(
                    "channel {channel} is not in the session, or waits for a trigger"
                )),
                Some((limit, unit)) if top > limit => messages.push(format!(
                    "the staircase would reach {top} {unit} on channel {channel}, above the \
                     wearer's limit of {limit} {unit}"
                )),
                Some(_) => {}
            }
        }
        messages
    }

    /// Returns the declaration as written in the file.
    #[must_use]
    pub const fn declaration(&self) -> &SearchDeclaration {
        &self.declared
    }

    /// Returns the channels that the search stimulates; there is at least one.
    #[must_use]
    pub fn sites(&self) -> &[Site] {
        &self.sites
    }

    /// Returns the difference between successive levels.
    #[must_use]
    pub const fn step(&self) -> Milli {
        self.stair[1]
    }

    /// Returns all levels in ascending order.
    pub fn levels(&self) -> impl Iterator<Item = Milli> {
        let [start, step, limit] = self.stair;
        (start.0..=limit.0).step_by(step.0 as usize).map(Milli)
    }

    /// Returns the probability of a false alarm: that the search finds a movement although no level
    /// causes one. It follows from [`crate::statistics::Detector::false_alarm_probability`],
    /// because each presentation has its own baseline.
    #[must_use]
    pub fn false_alarm(&self) -> f64 {
        let repeats = self.declared.confirm as i32;
        let probability = self
            .declared
            .detector()
            .false_alarm_probability()
            .powi(1 + repeats);
        1.0 - (1.0 - probability).powi(self.levels().count() as i32)
    }
}

/// Adds a message for each field that is outside its range.
fn ranges(d: &SearchDeclaration, mistakes: &mut Vec<String>) {
    let mut within = |name: &str, value: f64, least: f64, most: f64| {
        if !(least..=most).contains(&value) {
            mistakes.push(format!("{name} is {value}; allowed: {least} to {most}"));
        }
    };
    within("windows", d.windows.into(), 1.0, 100.0);
    within("window_ms", d.window_ms.into(), 10.0, 1000.0);
    within("baseline_windows", d.baseline_windows.into(), 5.0, 100.0);
    within("k_sigma", d.k_sigma, 1.0, 20.0);
    within("consecutive", d.consecutive.into(), 1.0, d.windows.into());
    within("confirm", d.confirm.into(), 0.0, 5.0);
    within("settle_ms", d.settle_ms.into(), 0.0, 5000.0);
    within("rest_s", d.rest_s, 0.0, 600.0);
    within("resolution_deg", d.resolution_deg, 0.0, 10.0);
    within("visible_deg", d.visible_deg.unwrap_or(1.0), 0.001, 90.0);
    within("rating", d.rating.unwrap_or(0).into(), 0.0, 9.0);
    for channel in d
        .channel
        .iter()
        .chain(d.of.iter().map(|share| &share.channel))
    {
        within("channel", (*channel).into(), 1.0, 10.0);
    }
    if let Some(rating) = d.simulated_rating {
        within("simulated_rating.noise", rating.noise, 0.0, 10.0);
        within("simulated_rating.ten", rating.ten, rating.none + 1e-3, 1e6);
    }
    let baseline_s = f64::from(d.baseline_windows * d.window_ms.min(1000)) * 1e-3;
    if d.needs_baseline() && d.rest_s < baseline_s {
        let rest_s = d.rest_s;
        mistakes.push(format!(
            "rest_s is {rest_s} s, shorter than the baseline of {baseline_s} s"
        ));
    }
}

/// Adds a message for each field that this kind of search lacks or must not have.
fn fitting(d: &SearchDeclaration, mistakes: &mut Vec<String>) {
    let kind = d.kind.name();
    let mut has = |name: &str, is_there: bool, is_wanted: bool| match (is_there, is_wanted) {
        (true, false) => mistakes.push(format!("{name} has no use in a search of kind {kind}")),
        (false, true) => mistakes.push(format!("{name} is missing in a search of kind {kind}")),
        _ => {}
    };
    let is_ratio = d.kind == Kind::Ratio;
    has("channel", d.channel.is_some(), !is_ratio);
    has("of", !d.of.is_empty(), is_ratio);
    has(
        "visible_deg",
        d.visible_deg.is_some(),
        d.kind == Kind::Visible,
    );
    has("rating", d.rating.is_some(), d.kind.is_rated());
    let is_rated = d.simulated_rating.is_some();
    has("simulated_rating", is_rated, is_rated && d.kind.is_rated());
}

/// Adds a message for each mistake in how levels and detector fit together.
fn check_levels(search: &Search, mistakes: &mut Vec<String>) {
    let [start, step, limit] = search.stair;
    let d = search.declaration();
    if start > limit {
        mistakes.push(format!("start is {start}, above the limit of {limit}"));
    } else if (limit.0 - start.0) / step.0 >= MOST_LEVELS {
        mistakes.push(format!(
            "step is {step}: start to limit has more than {MOST_LEVELS} levels; use a larger step"
        ));
    } else if !d.kind.is_rated() && search.false_alarm() > FALSE_ALARMS {
        mistakes.push(format!(
            "k_sigma is {}: with {} baseline windows, {} of {} windows in a row and {} \
             repeats, {:.1} % of searches of {} levels would report a movement where there is \
             none; allowed: at most 1 %",
            d.k_sigma,
            d.baseline_windows,
            d.consecutive,
            d.windows,
            d.confirm,
            1e2 * search.false_alarm(),
            search.levels().count(),
        ));
    }
    if d.kind == Kind::Ratio && limit > Milli(1000) {
        mistakes.push(format!("limit is {limit}; allowed for a ratio: at most 1"));
    }
    let sites = search.sites();
    for (place, site) in sites.iter().enumerate() {
        if sites
            .iter()
            .take(place)
            .any(|other| other.channel == site.channel)
        {
            mistakes.push(format!("`of` names channel {} twice", site.channel));
        }
    }
}
