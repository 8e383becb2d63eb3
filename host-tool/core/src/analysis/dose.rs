//! Computes the dose of each channel in a trial: amplitude, charge, current and time.

use crate::record::{ChannelInfo, Edge, Sample, State, Trial};
use firmware::pulse::{Shape, TrainSpec};
use firmware::safety::StageSpec;
use serde::{Deserialize, Serialize};

/// The stimulation that a channel delivered in a trial, computed from the trial's record.
///
/// Amplitudes, live widths and live rates come from `samples.csv`. A width that does not change
/// comes from the phases in `edges.csv`, or from the session file if no edges were recorded. The
/// shape and the rate of the train also come from the session file. Charge and current are
/// computed from these values; they are not measured during stimulation. For a voltage stage,
/// the current is the voltage divided by the session's `load_ohm`, as in the device's own checks
/// of its limits.
///
/// `samples.csv` shows the latest burst of each channel. A burst is counted if a row shows an
/// amplitude above 0 for its channel at the time when the burst was due; the burst then has the
/// amplitude and the width of that row. Rows that are more than 0.5 s apart are not joined. The
/// last burst of a stretch is not counted if there is no row between its end and the order that
/// silences the channel. In the shipped sessions, no channel lacks more than this one burst.
///
/// Optional fields are `None` if the record lacks the information: if it has no session file
/// that this version can read, or if the channel accepts pulse lists, whose times are in no row.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct ChannelDose {
    /// Number of the channel, from 1.
    pub channel: u8,
    /// Name of the channel, as the record has it.
    pub name: String,
    /// Unit of `peak`: "mA" or "V".
    pub unit: String,
    /// Largest amplitude in any sample, in `unit`; 0 for a channel that did not stimulate.
    pub peak: f64,
    /// Largest charge per phase of any pulse, µC: amplitude times width.
    pub charge_per_phase_uc: Option<f64>,
    /// Total charge of all cathodic phases, µC.
    pub cathodic_uc: Option<f64>,
    /// Total charge of all anodic phases, µC. Grounding after a monophasic pulse does not count
    /// as a phase.
    pub anodic_uc: Option<f64>,
    /// Root mean square of the current over the whole trial, mA. The current counts as 0 between
    /// pulses.
    pub rms_ma: Option<f64>,
    /// Time for which the channel was on, s. Each burst adds the time until the next is due, which
    /// is one period of the current rate. A channel is on as long as each burst follows within
    /// that time.
    pub on_time_s: Option<f64>,
    /// Number of uninterrupted stretches of stimulation. Between two stretches the channel was off
    /// for longer than one period.
    pub stretches: Option<u64>,
    /// Number of pulses with an amplitude above 0; each pulse of a burst counts.
    pub pulses: Option<u64>,
    /// Smallest and largest width of a phase, µs; `None` if there was no pulse.
    pub width_us: Option<(f64, f64)>,
    /// Lowest and highest pulse rate, Hz; a burst counts as one pulse. `None` if there was no
    /// pulse.
    pub frequency_hz: Option<(f64, f64)>,
}

/// Computes the dose of every channel of a trial, in the order of the trial's channels.
///
/// Reads the rows once and keeps none of them in memory.
#[must_use]
pub fn doses(trial: &Trial) -> Vec<ChannelDose> {
    let session = trial.session().ok();
    let train = |number: u8| {
        let mut channels = session.iter().flat_map(|session| &session.channels);
        let spec = channels.find(|channel| channel.number == number)?.spec;
        (!spec.train.lists).then_some((spec.train, spec.stage))
    };
    let channels = trial.channels.iter().enumerate();
    let mut counters: Vec<DoseCounter> = channels
        .map(|(place, info)| DoseCounter::new(trial, (place, info), train(info.number)))
        .collect();
    let mut samples = trial.samples.reader();
    while let Some(sample) = samples.next_sample() {
        counters.iter_mut().for_each(|counter| counter.add(sample));
    }
    let finished = counters.into_iter().zip(&trial.channels);
    finished
        .map(|(counter, info)| counter.finish(info, trial.duration_s))
        .collect()
}

/// Largest time between two samples that count as consecutive, s. After a longer gap a new stretch
/// begins, because nothing was recorded in between.
const GAP_S: f64 = 0.5;
/// Time after a period's end for which a sample still shows the pulse of that period, s. The device
/// waits 1.5 ms (`GRACE_US` in `firmware/src/device/controller/in_force.rs`).
const GRACE_S: f64 = 0.0015;

/// Smallest and largest of the values seen so far; `None` if there were none.
type Range = Option<(f64, f64)>;

/// Widens `range` so that it includes `value`.
fn widen(range: &mut Range, value: f64) {
    let (low, high) = range.unwrap_or((value, value));
    *range = Some((low.min(value), high.max(value)));
}

/// Timing of a channel's train, and the factor that converts its amplitude into current.
struct TrainTiming {
    shape: Shape,
    period_s: f64,
    /// Delay of the first burst after the start of the trains, s. `None` for a train that waits for
    /// a trigger or whose rate changes: its first burst is assumed to begin at the time of the
    /// first sample that shows it.
    offset_s: Option<f64>,
    pulses_per_burst: u64,
    /// Time for which a sample still shows the latest burst although the next is already due, s.
    /// The device counts it from the last pulse of the burst, so the length of the burst is
    /// included.
    grace_s: f64,
    /// Current at an amplitude of 1 mA or 1 V, mA: 1 for a current stage, 1000 divided by the load
    /// in Ω for a voltage stage.
    ma_per_unit: f64,
}

impl TrainTiming {
    fn new(train: &TrainSpec, stage: StageSpec, has_live_rate: bool) -> Self {
        let is_free = train.trigger.is_none() && !has_live_rate;
        let further_pulses = u64::from(train.burst_count.saturating_sub(1));
        let span_us = further_pulses * u64::from(train.burst_interval_us);
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

    /// Returns the number of bursts that the first sample of a stretch adds, and the start time of
    /// the latest of these bursts, s. `t_s` is the time of that sample, and `before_s` the time of
    /// the sample before it.
    fn first_bursts(&self, before_s: f64, t_s: f64) -> (u64, f64) {
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

/// Adds up the dose of one channel from the samples of a trial.
struct DoseCounter {
    /// Index of the channel in [`Sample::amplitudes`].
    place: usize,
    /// Index of the channel in [`Sample::widths_us`]; `None` if its pulse width does not change.
    live_width: Option<usize>,
    /// Index of the channel in [`Sample::rates_hz`]; `None` if its pulse rate does not change.
    live_rate: Option<usize>,
    /// Shortest and longest recorded phase of a channel whose pulse width does not change, µs.
    /// Without recorded edges, both are the pulse width in the session file.
    fixed_width: Range,
    timing: Option<TrainTiming>,
    /// Time of the previous sample, s; `None` before the first.
    before_s: Option<f64>,
    /// Start of the latest burst of the current stretch, s; `None` outside a stretch.
    latest_s: Option<f64>,
    peak: f64,
    /// Largest charge of one phase of any pulse so far, µC.
    per_phase_uc: f64,
    /// Charge of one phase, summed over all pulses so far, µC.
    phases_uc: f64,
    /// Squared current times the width of one phase, summed over all pulses so far, mA²·s.
    square: f64,
    on_s: f64,
    stretches: u64,
    pulses: u64,
    width_us: Range,
    rate_hz: Range,
}

impl DoseCounter {
    fn new(
        trial: &Trial,
        (place, info): (usize, &ChannelInfo),
        train: Option<(TrainSpec, StageSpec)>,
    ) -> Self {
        let live_rate = trial.channel_index(info.number, |c| c.force);
        let session_width = train.map(|(train, _)| f64::from(train.width_us));
        Self {
            place,
            live_width: trial.channel_index(info.number, |c| c.live_width),
            live_rate,
            fixed_width: recorded_widths(&trial.edges, info.number)
                .or(session_width.map(|width| (width, width))),
            timing: train
                .map(|(train, stage)| TrainTiming::new(&train, stage, live_rate.is_some())),
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

    /// Adds the bursts that began since the previous sample.
    fn add(&mut self, sample: &Sample) {
        let t_s = sample.t_s;
        let before_s = self.before_s.replace(t_s);
        if before_s.is_some_and(|before_s| t_s - before_s > GAP_S) {
            self.latest_s = None;
        }
        let known = |values: &[Option<f64>], place: usize| values.get(place).copied().flatten();
        let amplitude = known(&sample.amplitudes, self.place).filter(|amplitude| *amplitude > 0.0);
        let Some(amplitude) = amplitude else {
            self.latest_s = None;
            return;
        };
        self.peak = self.peak.max(amplitude);
        let Some(timing) = &self.timing else {
            return;
        };
        let rate = self.live_rate.map(|at| known(&sample.rates_hz, at));
        let rate = rate.map_or(Some(1.0 / timing.period_s), |live| {
            live.filter(|rate| *rate > 0.0)
        });
        let Some(rate_hz) = rate else {
            return;
        };
        let (bursts, latest_s) = match self.latest_s {
            Some(latest_s) => {
                let due = ((t_s - timing.grace_s - latest_s) * rate_hz + 1e-6)
                    .floor()
                    .max(0.0);
                (due as u64, latest_s + due / rate_hz)
            }
            None => {
                self.stretches += 1;
                timing.first_bursts(before_s.unwrap_or(-1.0), t_s)
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
        let current_ma = amplitude * timing.ma_per_unit;
        let pulses = bursts.saturating_mul(timing.pulses_per_burst);
        // Recorded widths may differ by one step of the timer: use the middle.
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

    /// Returns the channel's dose in a trial that lasted `duration_s`.
    fn finish(self, info: &ChannelInfo, duration_s: f64) -> ChannelDose {
        let shape = self.timing.as_ref().map(|timing| timing.shape);
        // `None` for a channel of which only the amplitude is known.
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
            rms_ma: known(rms_ma).filter(|rms| rms.is_finite()),
            on_time_s: known(self.on_s),
            stretches: counted(self.stretches),
            pulses: counted(self.pulses),
            width_us: self.width_us,
            frequency_hz: self.rate_hz,
        }
    }
}

/// Returns the shortest and the longest recorded phase of a channel, µs. Counts only phases whose
/// end was recorded; returns `None` if there is no such phase.
fn recorded_widths(edges: &[Edge], channel: u8) -> Range {
    let channel_edges = || edges.iter().filter(|edge| edge.channel == channel);
    let mut range = None;
    for (edge, next) in channel_edges().zip(channel_edges().skip(1)) {
        if edge.dac_code > 0 && matches!(edge.state, State::Anodic | State::Cathodic) {
            widen(&mut range, next.t_us.saturating_sub(edge.t_us) as f64);
        }
    }
    range
}
