//! What each channel of a trial put out: amplitude, charge, current and time.

use crate::record::{ChannelInfo, Edge, Sample, State, Trial};
use firmware::pulse::{Shape, TrainSpec};
use firmware::safety::StageSpec;
use serde::{Deserialize, Serialize};

/// What a channel put out in a trial, from what the trial recorded.
///
/// Amplitudes, live widths and live rates are those of `samples.csv`. A width that does not
/// change is that of the phases in `edges.csv`; where no edges were recorded, that of the
/// session file, from which shape and rate of the train come. Charge and current are computed
/// from these: nothing measures them while pulses play. Of a voltage stage the current is the
/// voltage through the session's `load_ohm`, as the device judges its own limits.
///
/// A burst counts when a row shows its channel with an amplitude above 0 at the time at which
/// the burst was due, with the amplitude and the width of that row: `samples.csv` tells the
/// latest burst of each channel. Rows more than 0.5 s apart are not joined. The last burst of
/// a stretch is missed where no row comes between its end and the order that silences the
/// channel: of the shipped sessions no channel lacks more than that one.
///
/// `None` where the record does not tell: without a session file that this version reads, and
/// of a channel that takes lists of pulses, whose times no row has.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct ChannelDose {
    /// Number of the channel, from 1.
    pub channel: u8,
    /// Name of the channel.
    pub name: String,
    /// Unit of `peak`: "mA" or "V".
    pub unit: String,
    /// Peak amplitude: the largest of any row; 0 for a channel that played nothing.
    pub peak: f64,
    /// Charge per phase, µC: the largest of any pulse, amplitude times width.
    pub charge_per_phase_uc: Option<f64>,
    /// Delivered charge of all cathodic phases, µC.
    pub cathodic_uc: Option<f64>,
    /// Delivered charge of all anodic phases, µC. Grounding after a monophasic pulse is none.
    pub anodic_uc: Option<f64>,
    /// Root mean square of the current over the whole length of the trial, mA: what plays
    /// nothing counts as 0.
    pub rms_ma: Option<f64>,
    /// On-time, s: each burst counts for the time until the next is due, one period of the
    /// rate in force. A channel is on while each burst follows within that time.
    pub on_time_s: Option<f64>,
    /// Stretches of on-time, between which the channel was off for longer than a period.
    pub stretches: Option<u64>,
    /// Pulses of more than 0; each pulse of a burst counts.
    pub pulses: Option<u64>,
    /// Least and greatest width of a phase, µs; `None` without a pulse.
    pub width_us: Option<(f64, f64)>,
    /// Least and greatest rate of bursts, Hz; `None` without a pulse.
    pub frequency_hz: Option<(f64, f64)>,
}

/// What every channel of a trial put out, in the order of the trial.
///
/// The rows are gone through once, and none is held.
#[must_use]
pub fn doses(trial: &Trial) -> Vec<ChannelDose> {
    let session = trial.session().ok();
    let train = |number: u8| {
        let mut channels = session.iter().flat_map(|session| &session.channels);
        let spec = channels.find(|channel| channel.number == number)?.spec;
        (!spec.train.lists).then_some((spec.train, spec.stage))
    };
    let channels = trial.channels.iter().enumerate();
    let mut counts: Vec<Count> = channels
        .map(|(place, info)| Count::of(trial, (place, info), train(info.number)))
        .collect();
    for sample in &trial.samples {
        counts.iter_mut().for_each(|count| count.row(&sample));
    }
    let counted = counts.into_iter().zip(&trial.channels);
    counted
        .map(|(count, info)| count.close(info, trial.duration_s))
        .collect()
}

/// Rows further apart than this are not joined: nothing was recorded there, s.
const GAP_S: f64 = 0.5;
/// How long a row still shows the latest pulse when a period has passed since it, s: the device
/// waits 1.5 ms (`GRACE_US` in `firmware/src/device/controller/in_force.rs`).
const GRACE_S: f64 = 0.0015;

/// Least and greatest of some values.
type Range = Option<(f64, f64)>;

fn widen(range: &mut Range, value: f64) {
    let (low, high) = range.unwrap_or((value, value));
    *range = Some((low.min(value), high.max(value)));
}

/// A train, and the current of its channel.
struct Played {
    shape: Shape,
    period_s: f64,
    /// Since the start of the trains, s; `None` of one that waits for a trigger or whose rate
    /// changes: its first burst is taken to come with the row that shows it.
    offset_s: Option<f64>,
    pulses_per_burst: u64,
    /// How long a row still shows the latest burst when the next is overdue, s: from the
    /// latest pulse of the burst, which comes after its first.
    grace_s: f64,
    /// mA for each unit of amplitude.
    ma_per_unit: f64,
}

impl Played {
    fn of(train: &TrainSpec, stage: StageSpec, is_live: bool) -> Self {
        let is_free = train.trigger.is_none() && !is_live;
        let further = u64::from(train.burst_count.saturating_sub(1));
        let span_us = further * u64::from(train.burst_interval_us);
        Self {
            shape: train.shape,
            period_s: f64::from(train.period_us) / 1e6,
            offset_s: is_free.then(|| f64::from(train.offset_us) / 1e6),
            pulses_per_burst: u64::from(train.burst_count),
            grace_s: GRACE_S + span_us as f64 / 1e6,
            ma_per_unit: match stage {
                StageSpec::Current { .. } => 1.0,
                StageSpec::Voltage { load_ohm, .. } => 1e3 / f64::from(load_ohm),
            },
        }
    }

    /// Bursts in the first row of a stretch, and when the latest of them began; the row
    /// before was at `before_s`.
    fn first(&self, before_s: f64, t_s: f64) -> (u64, f64) {
        let Some(offset_s) = self.offset_s else {
            return (1, t_s);
        };
        let number = |at_s: f64| ((at_s - offset_s) / self.period_s + 1e-6).floor();
        let bursts = (number(t_s) - number(before_s).max(-1.0)) as u64;
        (
            bursts.max(1),
            offset_s + number(t_s).max(0.0) * self.period_s,
        )
    }
}

/// What is counted of a channel on the way through the rows.
struct Count {
    place: usize,
    /// Places of a live width and of a live rate in a row.
    live_width: Option<usize>,
    live_rate: Option<usize>,
    /// A width that does not change, µs: least and greatest phase of the edges, or the train's.
    fixed_width: Range,
    played: Option<Played>,
    /// Time of the row before.
    before_s: Option<f64>,
    /// Beginning of the latest burst of a stretch.
    latest_s: Option<f64>,
    peak: f64,
    per_phase_uc: f64,
    phases_uc: f64,
    /// Of one phase of each pulse, mA² s.
    square: f64,
    on_s: f64,
    stretches: u64,
    pulses: u64,
    width_us: Range,
    rate_hz: Range,
}

impl Count {
    fn of(
        trial: &Trial,
        (place, info): (usize, &ChannelInfo),
        train: Option<(TrainSpec, StageSpec)>,
    ) -> Self {
        let live_rate = trial.place(info.number, |c| c.force);
        let typed = train.map(|(train, _)| f64::from(train.width_us));
        Self {
            place,
            live_width: trial.place(info.number, |c| c.live_width),
            live_rate,
            fixed_width: phases(&trial.edges, info.number).or(typed.map(|width| (width, width))),
            played: train.map(|(train, stage)| Played::of(&train, stage, live_rate.is_some())),
            before_s: None,
            latest_s: None,
            peak: 0.0,
            per_phase_uc: 0.0,
            phases_uc: 0.0,
            square: 0.0,
            on_s: 0.0,
            stretches: 0,
            pulses: 0,
            width_us: None,
            rate_hz: None,
        }
    }

    fn row(&mut self, sample: &Sample) {
        let t_s = sample.t_s;
        let before_s = self.before_s.replace(t_s);
        if before_s.is_some_and(|before_s| t_s - before_s > GAP_S) {
            self.latest_s = None;
        }
        let known = |values: &[Option<f64>], place: usize| values.get(place).copied().flatten();
        let amplitude = known(&sample.amplitudes, self.place).filter(|value| *value > 0.0);
        let Some(amplitude) = amplitude else {
            self.latest_s = None;
            return;
        };
        self.peak = self.peak.max(amplitude);
        let Some(played) = &self.played else {
            return;
        };
        let rate = self.live_rate.map(|at| known(&sample.rates_hz, at));
        let rate = rate.map_or(Some(1.0 / played.period_s), |live| {
            live.filter(|rate| *rate > 0.0)
        });
        let Some(rate_hz) = rate else {
            return;
        };
        let (bursts, latest_s) = match self.latest_s {
            Some(latest_s) => {
                let due = ((t_s - played.grace_s - latest_s) * rate_hz + 1e-6)
                    .floor()
                    .max(0.0);
                (due as u64, latest_s + due / rate_hz)
            }
            None => {
                self.stretches += 1;
                played.first(before_s.unwrap_or(-1.0), t_s)
            }
        };
        self.latest_s = Some(latest_s);
        let widths = match self.live_width {
            Some(at) => known(&sample.widths_us, at).map(|width| (width, width)),
            None => self.fixed_width,
        };
        let (Some((low, high)), true) = (widths, bursts > 0) else {
            return;
        };
        let current_ma = amplitude * played.ma_per_unit;
        let pulses = bursts.saturating_mul(played.pulses_per_burst);
        // Of edges that differ by a step of the timer the middle.
        let mean_us = (low + high) / 2.0;
        self.pulses = self.pulses.saturating_add(pulses);
        self.per_phase_uc = self.per_phase_uc.max(current_ma * high / 1e3);
        self.phases_uc += pulses as f64 * current_ma * mean_us / 1e3;
        self.square += pulses as f64 * current_ma * current_ma * mean_us / 1e6;
        self.on_s += bursts as f64 / rate_hz;
        widen(&mut self.width_us, low);
        widen(&mut self.width_us, high);
        widen(&mut self.rate_hz, rate_hz);
    }

    fn close(self, info: &ChannelInfo, duration_s: f64) -> ChannelDose {
        let shape = self.played.as_ref().map(|played| played.shape);
        // Not of a channel of which nothing is known but its amplitude.
        let known = |value: f64| shape.map(|_| value);
        let counted = |count: u64| shape.map(|_| count);
        let phase = |is_first: bool| {
            let shape = shape?;
            let plays = is_first || shape.is_biphasic();
            Some(if plays { self.phases_uc } else { 0.0 })
        };
        let first_is_cathodic = shape.is_none_or(Shape::cathodic_first);
        let phases = shape.map_or(1.0, |shape| if shape.is_biphasic() { 2.0 } else { 1.0 });
        let rms_ma = (self.square * phases / duration_s).sqrt();
        ChannelDose {
            channel: info.number,
            name: info.name.clone(),
            unit: info.unit.clone(),
            peak: self.peak,
            charge_per_phase_uc: known(self.per_phase_uc),
            cathodic_uc: phase(first_is_cathodic),
            anodic_uc: phase(!first_is_cathodic),
            rms_ma: known(rms_ma).filter(|value| value.is_finite()),
            on_time_s: known(self.on_s),
            stretches: counted(self.stretches),
            pulses: counted(self.pulses),
            width_us: self.width_us,
            frequency_hz: self.rate_hz,
        }
    }
}

/// Least and greatest phase of a channel's edges, µs, whose ends were recorded; `None`
/// without one.
fn phases(edges: &[Edge], channel: u8) -> Range {
    let own = || edges.iter().filter(|edge| edge.channel == channel);
    let mut range = None;
    for (edge, next) in own().zip(own().skip(1)) {
        if edge.dac_code > 0 && matches!(edge.state, State::Anodic | State::Cathodic) {
            widen(&mut range, next.t_us.saturating_sub(edge.t_us) as f64);
        }
    }
    range
}
