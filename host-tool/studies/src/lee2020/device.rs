//! Runs the same protocol on a device: every train is an ordinary session, and the test rig is its
//! body.

use super::analysis::run_analysis;
use super::error::LeeError;
use super::name;
use super::protocol::{Amplitudes, Stimulator, Train, run_fifteen_trains, search};
use super::study::Study;
use hal_sim::body::bench::sensor::SAMPLE_US;
use hal_sim::body::bench::{Wrist, WristSpec};
use hal_sim::body::{Body, CHANNELS, Lead, Load, Pulse};
use host_core::identify::ForceRecord;
use host_core::link::Port;
use host_core::run::{DeviceName, SessionFile, rest_wearer, run};
use std::sync::{Arc, Mutex, PoisonError};

/// Full scale of the output stage, mA; a step of its DAC is this over 65 535.
const FULL_SCALE_MA: f64 = 100.0;
/// Largest allowed difference between requested and delivered amplitude, mA: a step of the DAC plus
/// the resolution of a request.
const STEP_MA: f64 = FULL_SCALE_MA / 65_535.0 + 1e-3;
/// Time from the start of the session to the first pulse, µs.
const OFFSET_US: u32 = 5_000;

/// A pulse as the body receives it: start in µs, current in mA, width in µs.
type BodyPulse = (u64, f64, u32);

/// Pulses and force samples recorded during a stimulation.
#[derive(Default)]
struct BodyNotes {
    pulses: Vec<BodyPulse>,
    /// Time of the first sample, ms.
    since_ms: u64,
    samples_n: Vec<f64>,
}

/// A wrist that records every pulse and every sample.
struct NotingWrist {
    wrist: Wrist,
    heard: Arc<Mutex<BodyNotes>>,
}

impl NotingWrist {
    fn lock_notes(&self) -> std::sync::MutexGuard<'_, BodyNotes> {
        self.heard.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Body for NotingWrist {
    fn pulse(&mut self, pulse: &Pulse) {
        let load = self.wrist.loads().get(pulse.channel).copied();
        let ma = load.map_or(0.0, |load| load.current_ma(pulse.drive));
        self.lock_notes()
            .pulses
            .push((pulse.t_us, ma, pulse.width_us));
        self.wrist.pulse(pulse);
    }

    fn set_lead(&mut self, t_us: u64, channel: usize, lead: Lead) {
        self.wrist.set_lead(t_us, channel, lead);
    }

    fn advance(&mut self, to_us: u64) -> bool {
        let before = self.wrist.samples();
        // The device reports a pulse when its phase ends. A sample is therefore taken a millisecond
        // later, when all earlier pulses are known.
        for sample in before + 1..=(to_us / SAMPLE_US).saturating_sub(1) {
            self.wrist.advance(sample * SAMPLE_US);
            let reading = self.wrist.instrument_n().unwrap_or_default();
            let mut heard = self.lock_notes();
            if heard.samples_n.is_empty() {
                heard.since_ms = sample;
            }
            heard.samples_n.push(reading);
        }
        self.wrist.samples() != before
    }

    fn angle_deg(&self) -> f64 {
        self.wrist.angle_deg()
    }

    fn sensed_deg(&self) -> f64 {
        self.wrist.sensed_deg()
    }

    fn instrument_n(&self) -> Option<f64> {
        self.wrist.instrument_n()
    }

    fn loads(&self) -> &[Load; CHANNELS] {
        self.wrist.loads()
    }

    fn loads_mut(&mut self) -> &mut [Load; CHANNELS] {
        self.wrist.loads_mut()
    }
}

/// A simulated device with a wrist on the test rig as its wearer.
pub struct OnDevice {
    port: Option<Box<dyn Port>>,
    heard: Arc<Mutex<BodyNotes>>,
    /// Largest allowed amplitude, mA.
    most_ma: f64,
    /// Number of trains that were compared with the direct stimulation.
    trains: usize,
    /// Number of pulses in these trains.
    pulses: usize,
}

fn failed(train: &Train, why: impl ToString) -> LeeError {
    let description = format!("{} pulses of {} mA in a second", train.pulses, train.ma);
    LeeError::PutOut(description, why.to_string())
}

impl OnDevice {
    /// Opens a simulated device with a wrist on the test rig as its wearer. `most_ma` is the
    /// largest allowed amplitude, mA.
    ///
    /// # Errors
    /// Fails if the device cannot be opened, or with E647 if it is not simulated.
    pub fn new(
        device: &DeviceName,
        (spec, seed): (WristSpec, u64),
        most_ma: f64,
    ) -> Result<Self, LeeError> {
        let any = Train {
            ma: 1.0,
            pulses: 20,
            width_us: 400,
            before: 0,
            samples: 0,
        };
        let file = session(&any, spec.channel, most_ma)?;
        let mut port = device.open(&file.session, seed)?;
        let heard = Arc::new(Mutex::new(BodyNotes::default()));
        let world = port.world().ok_or_else(|| {
            failed(
                &any,
                "the device is not simulated; choose --device native, chip or qemu",
            )
        })?;
        let mut wrist = Wrist::new(spec, seed)?;
        wrist.advance(world.now_us());
        world.body = Box::new(NotingWrist {
            wrist,
            heard: heard.clone(),
        });
        Ok(Self {
            port: Some(port),
            heard,
            most_ma,
            trains: 0,
            pulses: 0,
        })
    }

    /// Returns the number of trains and pulses that agree with the direct stimulation.
    #[must_use]
    pub const fn compared_counts(&self) -> (usize, usize) {
        (self.trains, self.pulses)
    }

    fn wait_s(&mut self, s: f64) -> Result<(), String> {
        let gone = || "the device is no longer connected".to_owned();
        let port = self.port.as_mut().ok_or_else(gone)?;
        let world = port.world().ok_or_else(gone)?;
        rest_wearer(world, s, &mut || true).map_err(|e| e.to_string())
    }

    /// Describes the first difference between the device's pulses and those of `train`; `None` if
    /// they agree.
    fn find_difference(came: &[BodyPulse], train: &Train) -> Option<String> {
        if came.len() != train.pulses as usize {
            return Some(format!("the device output {} pulses", came.len()));
        }
        let first_us = came.first()?.0;
        (0u64..)
            .zip(came)
            .find_map(|(place, (t_us, ma, width_us))| {
                let after_us = place * u64::from(train.period_us());
                let is_like = t_us - first_us == after_us
                    && *width_us == train.width_us
                    && (ma - train.ma).abs() <= STEP_MA;
                (!is_like).then(|| {
                    let late_us = t_us - first_us;
                    format!(
                        "pulse {place} (counted from 0) has {ma:.3} mA for {width_us} µs, \
                         {late_us} µs after the first"
                    )
                })
            })
    }

    fn record(&self, train: &Train, epoch_us: u64) -> Result<(ForceRecord, usize), String> {
        let heard = self.heard.lock().unwrap_or_else(PoisonError::into_inner);
        // Skips the pulses of the electrode check.
        let own: Vec<BodyPulse> = heard
            .pulses
            .iter()
            .copied()
            .filter(|pulse| pulse.0 >= epoch_us)
            .collect();
        if let Some(why) = Self::find_difference(&own, train) {
            return Err(why);
        }
        let first_us = own.first().map_or(0, |pair| pair.0);
        let begin_ms = (first_us / SAMPLE_US).saturating_sub(train.before as u64);
        let skipped = begin_ms
            .checked_sub(heard.since_ms)
            .ok_or("the recorded rest before the train is too short")?;
        let samples = heard.samples_n.iter().skip(skipped as usize).copied();
        let samples_n: Vec<f64> = samples.take(train.samples).collect();
        if samples_n.len() < train.samples {
            return Err("the recorded rest after the train is too short".to_owned());
        }
        let record = ForceRecord {
            pulses_us: own
                .iter()
                .map(|pair| (pair.0 - begin_ms * SAMPLE_US) as u32)
                .collect(),
            samples_n,
            gain: 1.0,
        };
        Ok((record, own.len()))
    }
}

impl Stimulator for OnDevice {
    fn train(&mut self, train: &Train) -> Result<ForceRecord, LeeError> {
        let failure = |why: String| failed(train, why);
        *self.heard.lock().unwrap_or_else(PoisonError::into_inner) = BodyNotes::default();
        self.wait_s(1e-3 * train.before as f64).map_err(failure)?;
        let file = session(train, 0, self.most_ma)?;
        let port = self
            .port
            .take()
            .ok_or_else(|| failure("the device is no longer connected".to_owned()))?;
        let (outcome, port) = run(&file, port, None, |_: f64| ());
        self.port = port;
        if let Some(error) = outcome.error {
            return Err(failure(error.to_string()));
        }
        let epoch_us = outcome
            .epoch_us
            .ok_or_else(|| failure("the session did not start".to_owned()))?;
        let after = train.samples.saturating_sub(train.before + 1_000);
        self.wait_s(1e-3 * after as f64 + 0.05).map_err(failure)?;
        let (record, pulses) = self.record(train, epoch_us).map_err(failure)?;
        self.trains += 1;
        self.pulses += pulses;
        Ok(record)
    }

    fn rest(&mut self, s: f64) -> Result<(), LeeError> {
        let gone = |why| LeeError::PutOut("rest between trains".to_owned(), why);
        self.wait_s(s).map_err(gone)
    }
}

/// Returns a session for a train of one second, written as a user would. Its field `start` gives
/// the train the full amplitude from the first pulse on, like the paper's trains.
fn session(train: &Train, channel: usize, most_ma: f64) -> Result<SessionFile, LeeError> {
    let Train {
        ma,
        pulses,
        width_us,
        ..
    } = train;
    let (number, period_us) = (channel + 1, train.period_us());
    // Half a period after the last pulse.
    let ends_us = OFFSET_US + pulses.saturating_sub(1) * period_us + period_us / 2;
    let duration_s = f64::from(ends_us / 1_000) * 1e-3;
    let text = format!(
        "title = \"{pulses} Hz at {ma} mA\"\nduration_s = {duration_s:.3}\n\
         [wearer]\nmax_current_ma = {most_ma:.3}\nrise_ms = 1\nfall_ms = 5\nhost_timeout_ms = 40\n\
         return_area_mm2 = 2500\n\
         [[channel]]\nnumber = {number}\nname = \"extensors\"\nlimit = {most_ma:.3}\n\
         start = {most_ma:.3}\n\
         area_mm2 = 2500\n\
         stage = {{ kind = \"current\", full_scale_ma = {FULL_SCALE_MA:.1} }}\n\
         train = {{ shape = \"biphasic-cathodic-first\", width_us = {width_us}, \
         period_us = {period_us}, offset_us = {OFFSET_US} }}\n\
         [setpoints]\nkind = \"amplitudes\"\nrate_hz = 50\n\
         values = [{{ channel = {number}, value = {ma:.3} }}]\n\
         [body]\nkind = \"still\"\nload_ohm = 1000\n"
    );
    SessionFile::parse("train.toml", &text).map_err(|e| failed(train, e))
}

/// Subject of the check on a device: K01.
const SAMPLE: usize = 0;

impl Study {
    /// Runs the whole protocol of K01 on the study's device, and returns the results in words.
    ///
    /// # Errors
    /// Fails if the device cannot be opened, or with E647 if its pulses differ from the direct
    /// stimulation.
    pub fn check_on_device(&self) -> Result<Vec<String>, LeeError> {
        let truth = &self.truths[SAMPLE];
        let most_ma = self.declared.search.most_ma;
        let seed = self.seed_of(SAMPLE, 0);
        let mut by = OnDevice::new(&self.device, (truth.spec, seed), most_ma)?;
        let searched = search(&mut by, &self.declared)?;
        let amplitudes = Amplitudes::from_threshold(truth.printed_ma, &self.declared)?;
        let most = amplitudes.0.last().copied().unwrap_or_default();
        let session = run_fifteen_trains(&mut by, amplitudes, &self.declared)?;
        let found = run_analysis(&session, &self.declared)?;
        let constants = truth.constants(most, self.declared.trains.width_us);
        let estimates = found.fits[0].estimates();
        let covered = estimates
            .iter()
            .zip(constants)
            .filter(|(estimate, truth)| estimate.covers(*truth));
        let (trains, pulses) = by.compared_counts();
        let i_mt = searched
            .i_mt_ma()
            .map_or_else(|| "none".to_owned(), |i_mt_ma| format!("{i_mt_ma} mA"));
        Ok(vec![format!(
            "All numbers of this study are computed on the simulated wrist without a device. As a \
             check, the whole protocol of {} was also played by --device {}, each train as an \
             ordinary session: {trains} trains with {pulses} pulses. Time (to the microsecond) \
             and width of each pulse equal those of the study, and its amplitude differs by at \
             most one step of the converter. In this run, I_MT is {i_mt} (true value: {} mA), and \
             the 95 % intervals of {} of the 5 fitted constants contain the true value.",
            name(SAMPLE),
            self.device.to_argument(),
            truth.i_mt_ma,
            covered.count(),
        )])
    }
}
