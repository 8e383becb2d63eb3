//! Reads `[[program]]` and checks for each channel whether the device would output the program.

use firmware::safety::Stimulus;
use firmware::units::Amplitude;

use super::super::channel::Channel;
use super::super::setpoints::{check_stimulus, is_free, read_stimulus, read_time};
use super::super::setup::SetupSpec;
use super::course::Course;
use super::fields::{FORMS, Form, TURN_MDEG};
use super::gaps::Points;
use super::passes::Passes;
use super::played::{ChannelProgram, Programs};
use super::rise::Rise;
use super::steps::Steps;
use super::told::{report_too_short, seconds};
use crate::fields::error::Problem;
use crate::fields::table::Table;

/// Reads all programs of the file `root`, and reports their errors.
pub(in crate::session) fn read_programs(
    root: &Table<'_>,
    setup: &SetupSpec,
    duration_us: u64,
) -> Programs {
    let mut reader = Reader {
        setup,
        duration_us,
        played: Vec::new(),
        named: 0,
    };
    for t in root.tables("program").iter().filter(|t| t.is_valid()) {
        let earlier = reader.named;
        match t.choice("kind", &FORMS) {
            Some(Form::Cycle) => reader.read_cycle(t, earlier),
            Some(form) => reader.read_listed(t, form, earlier),
            None => {}
        }
    }
    Programs::new(reader.played)
}

struct Reader<'a> {
    setup: &'a SetupSpec,
    duration_us: u64,
    played: Vec<ChannelProgram>,
    /// Channels that the programs read so far name, with or without errors: bit i is channel i on
    /// the link.
    named: u16,
}

/// A channel that may play the program, and the limits on its rise.
struct Player<'a> {
    found: &'a Channel,
    rise: Rise,
}

impl<'a> Reader<'a> {
    /// Returns the channel with this `number`, which `field` names, if it may play the program.
    /// Otherwise reports why it may not. `earlier` are the channels of the programs before this
    /// one: bit i is channel i on the link.
    fn find_player(
        &mut self,
        t: &Table<'_>,
        field: &str,
        number: u8,
        earlier: u16,
    ) -> Option<Player<'a>> {
        let setup = self.setup;
        let found = setup.channels.find_number(t, field, number)?;
        let (channel, bit) = (found.number, 1u16 << found.index());
        let problem = match () {
            () if earlier & bit != 0 => Some(Problem::Programmed { channel }),
            () if self.named & bit != 0 => Some(Problem::ChannelTwice { channel }),
            () => reason_not_endless(found).map(|why| Problem::NotEndless { channel, why }),
        };
        self.named |= bit;
        if let Some(problem) = problem {
            t.report(field, problem);
            return None;
        }
        if !is_free(t, field, found, setup) {
            return None;
        }
        let rise = Rise::from_channel(found, setup)?;
        Some(Player { found, rise })
    }

    /// Reads a program of the forms "on-off", "ramp" and "steps", which all have a list of
    /// `channels`.
    fn read_listed(&mut self, t: &Table<'_>, form: Form, earlier: u16) {
        let numbers: Vec<u8> = t
            .integers("channels")
            .iter()
            .map(|pair| pair.0 as u8)
            .collect(); // 1–10
        if numbers.is_empty() {
            t.report_out_of_range("channels", "1 to 10 channels".into());
        }
        let times = ["delay_s", "stagger_s"].map(|name| t.time(name, 0, self.duration_us));
        let times = times[0].zip(times[1]);
        for (place, number) in (0_u64..).zip(numbers) {
            let Some(player) = self.find_player(t, "channels", number, earlier) else {
                continue;
            };
            let (course, every_us) = match form {
                Form::OnOff => (self.read_on_off(t, &player), read_every(t, "on_s", "off_s")),
                _ => (
                    self.read_points(t, &player, form == Form::Steps),
                    t.has("every_s").then(|| t.integer::<u64>("every_s") as f64),
                ),
            };
            let (Some(course), Some((delay_us, stagger_us))) = (course, times) else {
                continue;
            };
            let first_us = (delay_us + stagger_us * place) as f64;
            let latest = match stagger_us * place {
                0 => "delay_s",
                _ => "stagger_s",
            };
            self.add_course(t, &player, course, (first_us, latest), every_us);
        }
    }

    fn read_on_off(&self, t: &Table<'_>, player: &Player<'_>) -> Option<Course> {
        let stimulus = self.stimulus(t, player)?;
        let on_us = t.time("on_s", 1, self.duration_us)? as f64;
        let off_us = match t.has("off_s") {
            true => Some(t.time("off_s", 1, self.duration_us)? as f64),
            false => None,
        };
        check_off(t, "off_s", player, off_us);
        self.on_off(t, player, stimulus, (on_us, "on_s"))
    }

    /// Returns a course of one stimulus for the time `on_us`, which comes from `field`, with the
    /// ramps of the table `t`. Reports ramps that are too short for the channel, and a time that is
    /// too short for its ramps.
    fn on_off(
        &self,
        t: &Table<'_>,
        player: &Player<'_>,
        stimulus: Stimulus,
        (on_us, field): (f64, &str),
    ) -> Option<Course> {
        let Player { found, rise } = player;
        let off = Stimulus {
            amplitude: Amplitude::ZERO,
            ..stimulus
        };
        let shortest_us = match rise.is_immediate(stimulus) {
            true => Some(0),
            false => rise.shortest_us(off, stimulus),
        };
        let up_us = match t.has("ramp_up_s") {
            true => t.time("ramp_up_s", 0, self.duration_us)?,
            false => shortest_us.unwrap_or(0),
        };
        if shortest_us.is_none_or(|shortest_us| up_us < shortest_us) {
            report_too_short(t, "ramp_up_s", found, (off, stimulus), shortest_us, 0);
            return None;
        }
        if let Some(steps) = Steps::from_channel(found, self.setup, std::iter::once(stimulus)) {
            let least_us = steps.shortest_us(off, stimulus);
            if Some(up_us) != shortest_us && up_us < least_us {
                report_too_short(t, "ramp_up_s", found, (off, stimulus), Some(least_us), 0);
            }
            steps.check_start((t, "ramp_up_s"), found, rise, stimulus, up_us);
        }
        let down_us = t.time("ramp_down_s", 0, self.duration_us)?;
        let least_us = (up_us + down_us).max(rise.period_us);
        if on_us < least_us as f64 {
            let nearest = match t.real(field) {
                // A lower cadence gives a longer time; the value is rounded down.
                Some(rpm) => {
                    let most = (rpm * on_us / least_us as f64 * 1e3).floor() / 1e3;
                    format!("at most {most}")
                }
                None => format!("at least {}", seconds(least_us)),
            };
            let problem = Problem::OnTooShort {
                channel: found.number,
                on: seconds(on_us.floor() as u64),
                up: seconds(up_us),
                down: seconds(down_us),
                nearest,
            };
            t.report(field, problem);
            return None;
        }
        Some(Course::OnOff {
            stimulus,
            on_us,
            up_us,
            down_us,
        })
    }

    fn read_points(&self, t: &Table<'_>, player: &Player<'_>, is_held: bool) -> Option<Course> {
        let mut points: Vec<(u64, Stimulus)> = Vec::new();
        // The points after one with an error cannot be judged.
        let items = t
            .tables("points")
            .iter()
            .take_while(|table| table.is_valid());
        let items: Vec<&Table<'_>> = items.collect();
        for item in &items {
            let at_us = read_time(item, points.last().map(|&(at_us, _)| at_us), "point")?;
            item.time("at_s", 0, self.duration_us)?;
            points.push((at_us, self.stimulus(item, player)?));
        }
        if items.len() < t.tables("points").len() {
            return None; // told
        }
        let every_us = match t.has("every_s") {
            true => Some(t.time("every_s", 1, self.duration_us)?),
            false => None,
        };
        let Player { found, rise } = player;
        let steps = Steps::from_channel(found, self.setup, points.iter().map(|point| point.1));
        let points = Points {
            t,
            items: &items,
            found,
            rise,
            steps,
            points: &points,
            every_us,
        };
        match is_held {
            true => points.check_steps(),
            false => points.check_ramp(),
        }
        let points = points.points.to_vec();
        Some(Course::Points { points, is_held })
    }

    /// Reads a program of the form "cycle", which has a list of `phases`.
    fn read_cycle(&mut self, t: &Table<'_>, earlier: u16) {
        let delay_us = t.time("delay_s", 0, self.duration_us);
        let start_mdeg: i64 = t.integer("start_deg");
        // The checks guarantee at least one turn a minute.
        let turn_us = t.real("cadence_rpm").map(|rpm| 60e6 / rpm);
        for item in t.tables("phases").iter().filter(|table| table.is_valid()) {
            let Some(player) = self.find_player(item, "channel", item.integer("channel"), earlier)
            else {
                continue;
            };
            let [from, to]: [i64; 2] = ["from_deg", "to_deg"].map(|name| item.integer(name));
            let turn = |mdeg: i64| mdeg.rem_euclid(TURN_MDEG) as f64 / TURN_MDEG as f64;
            if turn(from) == turn(to) {
                let allowed = "an angle other than `from_deg`".into();
                item.report_out_of_range("to_deg", allowed);
                continue;
            }
            let (Some(stimulus), Some(turn_us)) = (self.stimulus(item, &player), turn_us) else {
                continue;
            };
            let on_us = turn(to - from) * turn_us;
            check_off(item, "to_deg", &player, Some(turn_us - on_us));
            let course = self.on_off(t, &player, stimulus, (on_us, "cadence_rpm"));
            let (Some(course), Some(delay_us)) = (course, delay_us) else {
                continue;
            };
            let first_us = delay_us as f64 + turn(from - start_mdeg) * turn_us;
            self.add_course(t, &player, course, (first_us, "delay_s"), Some(turn_us));
        }
    }

    /// Reads an amplitude and a width from `item`. Reports an error if the device would refuse
    /// them.
    fn stimulus(&self, item: &Table<'_>, player: &Player<'_>) -> Option<Stimulus> {
        let stimulus = read_stimulus(item, player.found)?;
        check_stimulus(item, player.found, self.setup, stimulus);
        Some(stimulus)
    }

    /// Adds the course of a channel to the programs. Reports an error at the field `latest` if the
    /// first burst is after the session's end, and at `repeats` if not all passes end within the
    /// session.
    fn add_course(
        &mut self,
        t: &Table<'_>,
        player: &Player<'_>,
        course: Course,
        (first_us, latest): (f64, &str),
        every_us: Option<f64>,
    ) {
        let (found, rise) = (player.found, player.rise);
        let first_burst_us = rise.next_burst_us(first_us.round() as u64); // not negative
        if first_burst_us >= self.duration_us {
            let (channel, begins) = (found.number, seconds(first_burst_us));
            t.report(latest, Problem::BeginsAfterEnd { channel, begins });
            return;
        }
        let count = t.has("repeats").then(|| t.integer::<u64>("repeats"));
        let passes = Passes {
            first_us,
            every_us,
            count,
        };
        let most = passes.count_within(course.pass_duration_us(), self.duration_us);
        if count.is_some_and(|count| count > most) {
            let allowed = match (most, every_us) {
                (0, _) => "no value: not even one pass ends within the session".into(),
                (_, None) => "1, because no field gives the time of the next pass".into(),
                _ => format!("1 to {most}, which end within the session"),
            };
            t.report_out_of_range("repeats", allowed);
        }
        self.played.push(ChannelProgram {
            channel: found.index(),
            rise,
            passes,
            course,
            own_us: found.spec.train.width_us,
            has_live_width: found.has_live_width(),
        });
    }
}

/// Returns the time from pass to pass, µs: the sum of the fields `on` and `off`. Returns `None`,
/// for a single pass, if the file leaves `off` out.
fn read_every(t: &Table<'_>, on: &str, off: &str) -> Option<f64> {
    let [on_us, off_us] = [on, off].map(|name| t.integer::<u64>(name));
    t.has(off).then_some(on_us.saturating_add(off_us) as f64)
}

/// Reports a time off that is shorter than a period of the train, because it might contain no burst
/// and would then have no effect.
fn check_off(t: &Table<'_>, field: &str, player: &Player<'_>, off_us: Option<f64>) {
    let period_us = player.rise.period_us;
    if off_us.is_some_and(|off_us| off_us < period_us as f64) {
        let (channel, least) = (player.found.number, seconds(period_us));
        t.report(field, Problem::SilenceTooShort { channel, least });
    }
}

/// Returns why a channel's train does not run endlessly from the start, or `None` if it does.
fn reason_not_endless(found: &Channel) -> Option<&'static str> {
    let train = &found.spec.train;
    match () {
        () if train.trigger.is_some() => Some("waits for the trigger input"),
        () if train.repeats > 0 => Some("has `repeats`, a fixed number of bursts"),
        () if train.lists => Some("accepts lists of pulses"),
        () => None,
    }
}
