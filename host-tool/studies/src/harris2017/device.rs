//! Plays every stimulation once on a device and logs the pulses at the electrodes. The pulses do
//! not depend on the wearer, so all wearers get the same ones.

use super::declared::{Protocol, RampsDeclaration};
use super::error::RampsError;
use super::found::Pulses;
use super::test::{LEAST_WIDTH_US, Stimulation, micros, period_us, stimulations};
use crate::laboratory::{ElectrodeLog, LOAD_OHM, Notes};
use firmware::link::Request;
use firmware::units::Amplitude;
use hal_sim::body::bench::elbow::BICEPS;
use hal_sim::body::{Drive, Pulse};
use host_core::link::Port;
use host_core::run::{Attachments, DeviceName, RunError, SessionFile, StepLimit, Stepper};
use host_core::session::Session;
use std::fmt::Write;

/// Resolution of the converter at a full scale of 100 mA, mA.
const STEP_MA: f64 = 100.0 / 65_535.0;
/// Divisor of the period: each setpoint is sent half a period before its pulse, so that it arrives
/// in time, but not before the preceding pulse.
const EARLY: u64 = 2;

/// Difference between the pulses of a device and the intended ones.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OutputDifference {
    /// Number of compared pulses.
    pub pulses: usize,
    /// Largest difference of a current, mA.
    pub current_ma: f64,
}

impl Stimulation {
    /// Returns the text of a session with this stimulation's channel. Its field `start` lets the
    /// ramp begin with the first pulse, as in the paper.
    fn session(self, protocol: &Protocol) -> String {
        let (limit_ma, width_us) = match self {
            Self::Current(width_us) => (protocol.current_ramp_ma, width_us),
            Self::Width(current_ma) => (current_ma, LEAST_WIDTH_US),
            Self::Biceps => (protocol.biceps.current_ma, protocol.biceps.width_us),
        };
        let number = self.pair() + 1;
        let frequency_hz = protocol.frequency_hz;
        let mut text = format!(
            "title = \"{}\"\nduration_s = {:.3}\n[wearer]\nmax_current_ma = {limit_ma:.1}\n\
             max_charge_uc = 12.0\nmax_rms_ma = 10.0\nrise_ms = 1\nfall_ms = 50\n\
             host_timeout_ms = 100\n",
            self.in_words(),
            protocol.settle_s + protocol.ramp_s
        );
        // Writing to a string cannot fail.
        let _ = write!(
            text,
            "[[channel]]\nnumber = {number}\nname = \"{}\"\nlimit = {limit_ma:.1}\n\
             start = {limit_ma:.1}\n\
             stage = {{ kind = \"current\", full_scale_ma = 100.0 }}\n\
             train = {{ shape = \"biphasic-cathodic-first\", width_us = {width_us}, \
             frequency_hz = {frequency_hz:.1} }}\n\
             [setpoints]\nkind = \"amplitudes\"\nrate_hz = 50\n\
             values = [{{ channel = {number}, value = 0.0 }}]\n\
             [body]\nkind = \"still\"\nload_ohm = {LOAD_OHM}\n",
            if self.pair() == BICEPS {
                "biceps"
            } else {
                "triceps"
            },
        );
        text
    }

    /// Returns the setpoint of the pulse that is due `due_us` after the start.
    fn setpoint(self, protocol: &Protocol, due_us: u64) -> Request {
        let begin_us = micros(protocol.settle_s);
        let since_us = due_us.checked_sub(begin_us);
        let (ma, width_us) = match since_us {
            Some(since_us) => self.pulse_at(protocol, 1e-6 * since_us as f64),
            None => (0.0, f64::from(LEAST_WIDTH_US)),
        };
        let width_us = width_us.round() as u16;
        let is_one = u32::from(width_us) >= LEAST_WIDTH_US;
        let milli = if is_one { (1e3 * ma).round() as u32 } else { 0 };
        let widths = match self {
            Self::Width(_) => [width_us.max(LEAST_WIDTH_US as u16)].into_iter().collect(),
            _ => Default::default(), // the train's own
        };
        Request::Amplitudes {
            at: None,
            mask: 1 << self.pair(),
            values: [Amplitude::new(milli)].into_iter().collect(),
            widths,
        }
    }

    /// Plays the stimulation on `device`. Returns its pulses, with times in µs from the start of
    /// the trains, and their difference from the intended ones.
    ///
    /// # Errors
    /// Fails if the device cannot be opened. Returns E692 if it does not play the stimulation, or
    /// plays other pulses.
    pub fn play_on_device(
        self,
        protocol: &Protocol,
        device: &DeviceName,
    ) -> Result<(Vec<Pulse>, OutputDifference), RampsError> {
        let failed = |why: String| RampsError::Device(self.in_words(), why);
        let text = self.session(protocol);
        let file = SessionFile::parse("ramp.toml", &text);
        let mut file = file.map_err(|e| failed(e.to_string()))?;
        self.widen(protocol, &mut file.session);
        let mut port = device.open(&file.session, 1)?;
        let heard = ElectrodeLog::default();
        let world = port.world();
        let world = world.ok_or_else(|| failed("the device is not a simulator".to_owned()))?;
        world.body = Box::new(Notes::new(&heard));
        let streamed = self.stream(protocol, &file, port);
        let epoch_us = streamed.map_err(|e| failed(e.to_string()))?;
        let found = heard.pulses().into_iter().filter_map(|pulse| {
            let t_us = pulse.t_us.checked_sub(epoch_us)?;
            let is_one = pulse.drive != Drive::Milliamps(0.0);
            is_one.then_some(Pulse { t_us, ..pulse })
        });
        let found: Vec<Pulse> = found.collect();
        let apart = compare_pulses(&self.reference_pulses(protocol), &found).map_err(failed)?;
        Ok((found, apart))
    }

    /// Configures, arms and starts the device and streams the setpoints. Returns the start of the
    /// trains in simulated time, µs.
    fn stream(
        self,
        protocol: &Protocol,
        file: &SessionFile,
        port: Box<dyn Port>,
    ) -> Result<u64, RunError> {
        let mut stepper = Stepper::open(file, port, Attachments::default())?.with_live_setpoints();
        stepper.configure()?;
        stepper.arm()?;
        stepper.request(self.setpoint(protocol, 0))?;
        stepper.start()?;
        let period_us = period_us(protocol);
        let count = (micros(protocol.settle_s) + micros(protocol.ramp_s)) / period_us;
        for nth in 1..=count {
            let due_us = nth * period_us;
            stepper.step(StepLimit::Time(due_us - period_us / EARLY))?;
            stepper.post(self.setpoint(protocol, due_us))?;
        }
        let end_us = (count + 1) * period_us;
        stepper.step(StepLimit::Time(end_us - period_us / EARLY))?;
        stepper.stop()?;
        Ok(stepper.port().now_us() - stepper.time_us())
    }

    /// Allows the channel's width to change up to the end of the ramp.
    fn widen(self, protocol: &Protocol, session: &mut Session) {
        if let Self::Width(_) = self {
            for channel in &mut session.channels {
                channel.spec.train.max_width_us = protocol.width_ramp_us as u16;
            }
        }
    }
}

/// Compares the pulses one by one; fails if they differ by more than the resolution of the current.
fn compare_pulses(meant: &[Pulse], found: &[Pulse]) -> Result<OutputDifference, String> {
    if meant.len() != found.len() {
        return Err(format!("{} pulses instead of {}", found.len(), meant.len()));
    }
    let mut apart = OutputDifference {
        pulses: meant.len(),
        current_ma: 0.0,
    };
    for (meant, found) in meant.iter().zip(found) {
        let ma = |pulse: &Pulse| match pulse.drive {
            Drive::Milliamps(ma) => ma,
            Drive::Volts(_) => f64::NAN,
        };
        let by = (ma(meant) - ma(found)).abs();
        let is_like = (meant.t_us, meant.channel, meant.width_us)
            == (found.t_us, found.channel, found.width_us);
        if !(is_like && by <= STEP_MA + 5e-4) {
            return Err(format!("{found:?} instead of {meant:?}"));
        }
        apart.current_ma = apart.current_ma.max(by);
    }
    Ok(apart)
}

/// Plays every stimulation on `device`. Returns the pulses and their difference from the intended
/// ones.
///
/// # Errors
/// Fails like [`Stimulation::play_on_device`].
pub fn play_all_on_device(
    declared: &RampsDeclaration,
    device: &DeviceName,
) -> Result<(Pulses, OutputDifference), RampsError> {
    let protocol = &declared.protocol;
    let (mut played_pulses, mut most) = (Pulses::new(), OutputDifference::default());
    for stimulation in stimulations(protocol)
        .into_iter()
        .chain([Stimulation::Biceps])
    {
        let (pulses, apart) = stimulation.play_on_device(protocol, device)?;
        most.pulses += apart.pulses;
        most.current_ma = most.current_ma.max(apart.current_ma);
        played_pulses.push((stimulation, pulses));
    }
    Ok((played_pulses, most))
}

impl OutputDifference {
    /// Describes the comparison for the report page.
    #[must_use]
    pub fn in_words(&self, device: &DeviceName) -> String {
        format!(
            "All wearers received the pulses that --device {} emitted; each stimulation was \
             streamed to it once. These were {} pulses of seven stimulations, all at the intended \
             microsecond and with the intended width; currents were within {:.1} µA of the \
             intended ones (a step of the converter is 1.5 µA).",
            device.to_argument(),
            self.pulses,
            1e3 * self.current_ma
        )
    }
}
