//! Limits and events by which a run of a device is judged.

use firmware::pulse::CHANNELS;
use firmware::safety::{Setup, StageKind, StageTable};
use firmware::units::Micros;
use hal_sim::trace::Trace;
use hal_sim::trace::judge::{Channel, Fault, QuietInterval, Stage, Truth};

/// Boot time; the board boots shortly before its clock wraps.
pub const BOOT: Micros = Micros::new(u32::MAX - 20_000);

/// Converts a device time to the trace's axis, which begins at the boot time.
pub fn since_boot(at: Micros) -> u64 {
    let since = (at - BOOT).us();
    u64::from(BOOT.get()).saturating_add_signed(since.into())
}

/// Load of each channel, Ω.
const LOAD_OHM: f64 = 2_000.0;

/// Largest pulse rate: bursts of eight at 200 Hz, and the pulses of electrode checks.
const PULSES_PER_S: usize = 1_700;

/// Limits and events of a run.
#[derive(Clone, Default)]
pub struct JudgedRun {
    /// Largest limit of each channel that was armed, µA or mV.
    limits: [u32; CHANNELS],
    /// Longest time from the host's last message until the outputs must be silent, µs.
    silent_us: u32,
    /// Device time of the host's last message.
    heard: Micros,
    /// Times at which electrodes were disconnected or connected.
    loads: Vec<(u64, usize, bool)>,
}

impl JudgedRun {
    /// Notes the limits of a setup that is armed.
    pub fn note_setup(&mut self, setup: &Setup) {
        let wearer = &setup.wearer;
        self.silent_us = self
            .silent_us
            .max(wearer.host_timeout_us() + wearer.fall_us());
        for (limit, channel) in self.limits.iter_mut().zip(&setup.channels) {
            let armed = channel.as_ref().map_or(0, |channel| channel.limit.get());
            *limit = armed.max(*limit);
        }
    }

    /// Notes a message of the host.
    pub const fn note_host(&mut self, at: Micros) {
        self.heard = at;
    }

    /// Notes that an electrode was disconnected or connected.
    pub fn note_load(&mut self, at: Micros, channel: usize, is_on: bool) {
        self.loads.push((since_boot(at), channel, is_on));
    }

    /// Returns the limits and events for a board with these stages and these faults.
    pub fn truth(&self, stages: &StageTable, faults: Vec<Micros>) -> Truth {
        let mut truth = Truth::default();
        let channels = truth.channels.iter_mut().zip(&stages.stages);
        for (index, (channel, stage)) in channels.enumerate() {
            let limit = f64::from(self.limits[index]) * 1e-3;
            let Some(stage) = *stage else { continue };
            let (stage, limit_ma) = match stage {
                StageKind::Current { full_scale_ua } => {
                    let full_scale_ma = f64::from(full_scale_ua) * 1e-3;
                    (Stage::Current { full_scale_ma }, limit)
                }
                StageKind::Voltage { full_scale_mv } => {
                    let full_scale_v = f64::from(full_scale_mv) * 1e-3;
                    (Stage::Voltage { full_scale_v }, 1e3 * limit / LOAD_OHM)
                }
            };
            *channel = Channel::steady(stage, LOAD_OHM, limit_ma, PULSES_PER_S);
            let changes = self.loads.iter().filter(|load| load.1 == index);
            let loads = changes.map(|&(t, _, is_on)| (t, is_on.then_some(LOAD_OHM)));
            channel.loads.extend(loads);
        }
        // A pulse cut by a disconnected electrode is excused like one cut by a fault.
        let cut = self.loads.iter().map(|load| load.0);
        let cut = cut.chain(faults.into_iter().map(since_boot));
        truth.faults = cut.map(|t_us| Fault { t_us }).collect();
        truth.faults.sort_by_key(|fault| fault.t_us);
        // Two windows are rendered already.
        let from_us = since_boot(self.heard) + u64::from(self.silent_us) + 500;
        let until_us = u64::MAX;
        truth.quiet.push(QuietInterval { from_us, until_us });
        truth
    }
}

/// Results of a session: limits and events, trace, and times of faults.
pub type SessionEnd = (JudgedRun, Trace, Vec<Micros>);
