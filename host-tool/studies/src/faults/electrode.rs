//! Fault campaign: an electrode opens, shorts, peels off, loses a phase or its measurement, or a
//! comparator reports over-current.

use super::Draws;
use super::bench::{Bench, HOST_US};
use super::case::{Case, CaseEnd, CaseResult};
use super::declaration::Declaration;
use super::error::FaultsError;
use super::kinds::Kinds;
use super::simulated::{Boards, FaultableDevice, TWO_WINDOWS_US, is_isolated_for_good, judge_case};
use super::truth::declared_truth;
use firmware::link::Request;
use firmware::lockstep::Sensors;
use firmware::safety::Fault;
use firmware::units::Amplitude;
use hal_sim::body::{CHANNELS, Load};
use hal_sim::trace::judge::{Line, QuietInterval, StuckLine, Truth};
use hal_sim::trace::{Levels, State};
use host_core::session::{Session, Unit};

/// Random stream of this fault class; every class has its own, so that their random numbers are
/// independent.
const STREAM: u64 = 0xE1EC;
/// Course of a peeling electrode: its resistance at the start and at the end, Ω, and the duration
/// of the change, µs.
const PEELS: (f64, f64, u64) = (1_000.0, 25_000.0, 10_000_000);
/// Largest voltage of a current stage across its load, V (docs/reference/hardware.md).
const COMPLIANCE_V: f64 = 120.0;

/// Name of the kind in which the comparators report over-current although there is none.
const OVER_CURRENT: &str = "over-current";
/// Range of the random time for which the comparators report over-current, µs.
const PULLED_US: (f64, f64) = (1.0, 1e5);

/// Campaign in which electrodes fail: the source of boards, and the kinds of fault.
pub(super) struct Electrode<B: Boards> {
    boards: B,
    /// Booted board from which all cases start.
    kept: B::Snapshot,
    declaration: Declaration,
    kinds: Kinds,
}

/// One randomly generated case: the channel that fails, how, and under which stimulation.
struct ElectrodeCase<'k> {
    kind: &'k str,
    channel: u8,
    is_current: bool,
    /// Amplitude of the affected channel, thousandths of mA or V.
    amplitude: u32,
    ohm: u32,
    short_ohm: u32,
    /// Whether the anodic line is lost instead of the cathodic one, for the kind `phase lost`.
    anodic: bool,
    warm_us: u64,
    /// Time for which the comparators report over-current, µs.
    pulled_us: u64,
}

impl<B: Boards> Electrode<B> {
    pub fn new(seed: u64, declaration: &Declaration, boards: B) -> Result<Self, FaultsError> {
        let kinds = Kinds::new(declaration, &boards, seed, STREAM);
        let declaration = declaration.clone();
        let session = &declaration.scene.session;
        let kept = boards.prepare(session)?;
        Ok(Self {
            boards,
            kept,
            declaration,
            kinds,
        })
    }

    fn draw(&self, index: u64) -> Result<ElectrodeCase<'_>, FaultsError> {
        let (kind, mut random) = self.kinds.draw(index)?;
        let channels = &self.declaration.scene.session.channels;
        let channel = random.below(channels.len().max(1) as u64) as usize;
        let Some(channel) = channels.get(channel) else {
            return Err(FaultsError::Declaration("no channels".into()));
        };
        let is_current = channel.unit() == Unit::Milliampere;
        let least = if is_current { 1_000.0 } else { 2_000.0 };
        let timing = self.declaration.timing();
        let amplitude = random.between(least, 15_000.0) as u32;
        let ohm = random.between(1_000.0, 3_000.0) as u32;
        Ok(ElectrodeCase {
            kind,
            channel: channel.index(),
            is_current,
            amplitude,
            ohm: if kind == "peel" { PEELS.0 as u32 } else { ohm },
            short_ohm: random.between(20.0, 80.0) as u32,
            anodic: random.below(2) == 1,
            warm_us: timing.warm_us + random.below(timing.window_us.max(1)),
            pulled_us: random.log_between(PULLED_US.0, PULLED_US.1) as u64,
        })
    }

    /// Injects the fault, and runs until the outputs are permanently isolated or the case ends.
    /// Adds the changed loads to `truth`, by which the output is judged.
    fn play(
        &self,
        bench: &mut Bench<B::Board>,
        drawn: &ElectrodeCase<'_>,
        truth: &mut Truth,
    ) -> std::io::Result<CaseEnd> {
        let (begin_us, index) = (bench.now_us(), usize::from(drawn.channel));
        let mut ends_us = begin_us + self.declaration.timing().runs_us;
        let loads = &mut truth.channels[index].loads;
        let mut load = |bench: &mut Bench<B::Board>, ohm: Option<u32>| {
            bench.sensors.load_ohm[index] = ohm.unwrap_or(u32::MAX);
            loads.push((bench.now_us(), ohm.map(f64::from)));
        };
        match drawn.kind {
            "open" => load(bench, None),
            "short" => load(bench, Some(drawn.short_ohm)),
            "peel" => ends_us = begin_us + PEELS.2,
            "phase lost" => {
                let (state, line) = match drawn.anodic {
                    true => (State::Anodic, Line::Anodic),
                    false => (State::Cathodic, Line::Cathodic),
                };
                bench
                    .device
                    .break_lines(Levels::ISOLATED.with_channel(drawn.channel, state));
                truth.stuck.push(StuckLine {
                    channel: drawn.channel,
                    line,
                    high: false,
                    from_us: begin_us,
                });
            }
            OVER_CURRENT => {
                truth.quiet.push(QuietInterval {
                    from_us: begin_us + TWO_WINDOWS_US,
                    until_us: u64::MAX,
                });
                bench.sensors.over_current = true;
                bench.run_to(begin_us + drawn.pulled_us)?;
                bench.sensors.over_current = false;
            }
            _ => bench.device.ignore_sense_trigger(),
        }
        while bench.now_us() < ends_us {
            if drawn.kind == "peel" {
                let part = (bench.now_us() - begin_us) as f64 / PEELS.2 as f64;
                load(bench, Some((PEELS.0 + part * (PEELS.1 - PEELS.0)) as u32));
            }
            bench.run_to(bench.now_us() + HOST_US)?;
            let (device, trace) = (&bench.device, &bench.recorder.trace);
            if is_isolated_for_good(bench.reports(), device, trace, bench.now_us()) {
                return Ok(CaseEnd::Isolated);
            }
        }
        Ok(CaseEnd::Played)
    }
}

impl ElectrodeCase<'_> {
    /// Returns whether any measurement of the board shows the fault. A current stage hides a
    /// changed load as long as its voltage suffices, because it then drives the same current.
    fn is_measurable(&self) -> bool {
        let milliamps = f64::from(self.amplitude) * 1e-3;
        match (self.kind, self.is_current) {
            ("short", true) => false,
            ("peel", true) => milliamps * PEELS.1 * 1e-3 > COMPLIANCE_V,
            _ => true,
        }
    }

    fn in_words(&self) -> String {
        let amplitude = f64::from(self.amplitude) * 1e-3;
        let unit = if self.is_current { "mA" } else { "V" };
        let hidden = if self.is_measurable() {
            ""
        } else {
            ", nothing shows it"
        };
        let (kind, number, ohm) = (self.kind, self.channel + 1, self.ohm);
        if kind == OVER_CURRENT {
            return format!("{kind}: for {} us", self.pulled_us);
        }
        format!("{kind}: channel {number}, {amplitude:.2} {unit}, {ohm} ohm{hidden}")
    }
}

/// Returns a request for the random amplitude on the affected channel, and for 4 mA or 4 V on all
/// others.
fn wanted(session: &Session, drawn: &ElectrodeCase<'_>) -> Request {
    let channels = session.channels.iter();
    let mask = channels
        .clone()
        .fold(0, |mask, channel| mask | 1 << channel.index());
    let values = channels.map(|channel| match channel.index() == drawn.channel {
        true => Amplitude::new(drawn.amplitude),
        false => Amplitude::new(4_000),
    });
    Request::Amplitudes {
        at: None,
        mask,
        values: values.collect(),
        widths: Default::default(),
    }
}

impl<B: Boards> Draws for Electrode<B> {
    fn case(&self, index: u64) -> Result<Case, FaultsError> {
        let drawn = self.draw(index)?;
        let session = &self.declaration.scene.session;
        let sensors = Sensors {
            load_ohm: [drawn.ohm; CHANNELS],
            ..Sensors::default()
        };
        let bench = self.boards.connected_board(&self.kept, session, sensors)?;
        let wanted = wanted(session, &drawn);
        let mut bench = bench.into_stimulating(session, wanted, drawn.warm_us)?;
        let mut truth = declared_truth(session, &[Load::Ohms(drawn.ohm.into()); CHANNELS]);
        for channel in &mut truth.channels {
            channel.limit_ma = f64::from(session.wearer.max_current_ua) * 1e-3;
        }
        let moment_us = bench.now_us();
        let played = self.play(&mut bench, &drawn, &mut truth);
        let (mut fate, verdict) = judge_case(&mut bench, moment_us, truth);
        fate.bare = verdict
            .bare
            .findings
            .iter()
            .map(ToString::to_string)
            .collect();
        if drawn.kind == OVER_CURRENT {
            fate.found = fate.fault == Some(Fault::OverCurrent);
        }
        fate.must_find = drawn.is_measurable() || fate.found;
        Ok(Case {
            index,
            moment_us,
            what: drawn.in_words(),
            fate: CaseResult {
                ended: played.as_ref().copied().unwrap_or_default(),
                stopped: played.err().map(|e| e.to_string()),
                ..fate
            },
        })
    }

    fn notes(&self) -> Vec<String> {
        let kinds = self.kinds.in_words();
        vec![
            format!("Injected at random: {kinds}, at the current or the voltage stage."),
            "Need not be found: a short circuit or a peeling electrode at which a current stage \
             still reaches its current within its 120 V, because the board measures only current."
                .to_owned(),
            "The wearer's limit is that of the wearer file, 20 mA, on both stages.".to_owned(),
        ]
    }
}
