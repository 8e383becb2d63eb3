//! Plays a condition on a device and streams the pulses into a wearer's muscle.

use super::declared::{Condition, DistributedDeclaration, Drive};
use super::error::DistributedError;
use super::held::{Series, Window};
use super::person::DistributedWearer;
use super::session::{strength_n, text};
use firmware::link::{Code, Request};
use firmware::pulse::CHANNELS;
use firmware::units::Amplitude;
use hal_sim::body::shared::{Electrode, Readings, SAMPLE_US, Shared, SharedSpec};
use host_core::link::{Error, Port};
use host_core::run::{Attachments, DeviceName, RunError, SessionFile, StepLimit, Stepper};
use std::sync::PoisonError;

/// Time before the end of a window at which its mean force is computed, µs. The new amplitude then
/// arrives before the first pulse of the next window.
const EARLY_US: u64 = 2_000;
/// Largest relative force error that the feedback uses; larger errors count as this value.
const MOST_ERROR: f64 = 0.5;

/// A condition while the device plays it.
struct Playing<'a> {
    stepper: Stepper<'a, Box<dyn Port>>,
    condition: &'a Condition,
    /// The first electrode, which stands for all: the others differ only in the groups that they
    /// reach.
    electrode: Electrode,
    wanted_n: f64,
    /// Force requested of each electrode whose amplitude a muscle model determines, mN.
    share_mn: Vec<u32>,
    readings: Readings,
    taken: usize,
    amplitude_ma: f64,
}

/// Plays `condition` on this wearer, window by window, until its result is decided.
///
/// # Errors
/// Returns E722 if a declared range is missing, E723 if the muscle is invalid, and E724 if the
/// device does not play the condition.
pub fn play(
    declared: &DistributedDeclaration,
    condition: &Condition,
    person: &DistributedWearer,
) -> Result<Series, DistributedError> {
    let failed = |why: String| DistributedError::Device(condition.says.clone(), why);
    let spec = person.muscle(declared, condition)?;
    let wanted_n = declared.hold.wanted * spec.strength_n;
    let text = text(condition, &spec, person.value("alpha_a_per_s2")?);
    let file = SessionFile::parse("distributed.toml", &text).map_err(|e| failed(e.to_string()))?;
    let port = DeviceName::Native.open(&file.session, 1)?;
    let mut series = Series::new(declared, condition, wanted_n);
    match Playing::begin(condition, &spec, wanted_n, &file, port)? {
        None => series.is_refused = true,
        Some(mut playing) => playing
            .run(declared, &mut series)
            .map_err(|e| failed(e.to_string()))?,
    }
    Ok(series)
}

impl<'a> Playing<'a> {
    /// Opens, arms and starts the device. Returns `None` if the device refuses the force because
    /// its muscle models cannot produce it.
    fn begin(
        condition: &'a Condition,
        spec: &SharedSpec,
        wanted_n: f64,
        file: &'a SessionFile,
        mut port: Box<dyn Port>,
    ) -> Result<Option<Self>, DistributedError> {
        let failed = |why: String| DistributedError::Device(condition.says.clone(), why);
        let run_failure = |error: RunError| failed(error.to_string());
        let body = Shared::new(spec.clone())?;
        let readings = body.readings();
        let world = port.world();
        let world = world.ok_or_else(|| failed("the device is not simulated".to_owned()))?;
        world.body = Box::new(body);
        let electrodes: Vec<&Electrode> = spec.electrodes.iter().flatten().collect();
        let electrode = electrodes.first().map(|electrode| (*electrode).clone());
        let electrode = electrode.ok_or_else(|| failed("it has no electrode".to_owned()))?;
        // Shares the force in proportion to each electrode's strength.
        let all_n: f64 = electrodes
            .iter()
            .map(|electrode| strength_n(spec, electrode))
            .sum();
        let share =
            |electrode: &&Electrode| (1e3 * wanted_n * strength_n(spec, electrode) / all_n) as u32;
        let stepper = Stepper::open(file, port, Attachments::default()).map_err(run_failure)?;
        let mut playing = Self {
            stepper: stepper.with_live_setpoints(),
            condition,
            amplitude_ma: electrode.threshold_ma,
            electrode,
            wanted_n,
            share_mn: electrodes.iter().map(share).collect(),
            readings,
            taken: 0,
        };
        let started = playing.start();
        let is_out_of_reach = |error: &RunError| match error {
            RunError::Link(Error::Refused(refused)) => {
                refused.code() == Some(Code::ForceOutOfReach)
            }
            _ => false,
        };
        match started {
            Ok(()) => Ok(Some(playing)),
            Err(error) if is_out_of_reach(&error) => Ok(None),
            Err(error) => Err(run_failure(error)),
        }
    }

    fn start(&mut self) -> Result<(), RunError> {
        self.stepper.configure()?;
        self.stepper.arm()?;
        for request in self.requests() {
            self.stepper.request(request)?;
        }
        self.stepper.start()?;
        let epoch_us = self.stepper.port().now_us() - self.stepper.time_us();
        self.taken = (epoch_us / SAMPLE_US) as usize;
        Ok(())
    }

    /// Returns the requests that set the current amplitude, or the force of each electrode.
    fn requests(&self) -> Vec<Request> {
        let count = self.condition.electrodes;
        if self.condition.drive.model().is_some() {
            let request = |(channel, millinewton): (u8, &u32)| Request::Force {
                channel,
                at: None,
                millinewton: *millinewton,
                millinewton_per_s: Some(0),
            };
            return (0..).zip(&self.share_mn).map(request).collect();
        }
        let amplitude = Amplitude::new((1e3 * self.amplitude_ma).round() as u32);
        vec![Request::Amplitudes {
            at: None,
            mask: (1 << count.min(CHANNELS)) - 1,
            values: std::iter::repeat_n(amplitude, count).collect(),
            widths: Default::default(), // the trains' own
        }]
    }

    fn run(
        &mut self,
        declared: &DistributedDeclaration,
        series: &mut Series,
    ) -> Result<(), RunError> {
        let gain_ma = match self.condition.drive {
            Drive::Open => declared.open.gain_ma,
            _ => declared.hold.gain_ma,
        };
        let window_us = (1e6 * series.window_s).round() as u64;
        let mut nth = 0;
        while !series.is_over(nth) {
            nth += 1;
            self.stepper
                .step(StepLimit::Time(nth * window_us - EARLY_US))?;
            let window = self.window();
            let is_looking = match self.condition.drive {
                Drive::Feedback => true,
                Drive::Open => nth as f64 * series.window_s <= declared.open.settle_s,
                Drive::CalciumForce | Drive::CalciumForceFatigue => false,
            };
            series.windows.push(window);
            if is_looking {
                let error = (self.wanted_n - window.mean_n) / self.wanted_n;
                let by_ma = gain_ma * error.clamp(-MOST_ERROR, MOST_ERROR);
                let (least, most) = (self.electrode.threshold_ma, self.electrode.full_ma);
                self.amplitude_ma = (self.amplitude_ma + by_ma).clamp(least, most);
            }
            for request in self.requests() {
                self.stepper.post(request)?;
            }
            if let Some(world) = self.stepper.port().world() {
                world.recorder.discard_trace();
            }
        }
        Ok(())
    }

    /// Computes mean and standard deviation of the force since the last window.
    fn window(&mut self) -> Window {
        let readings = self.readings.lock().unwrap_or_else(PoisonError::into_inner);
        let own = readings.get(self.taken..).unwrap_or_default();
        let count = own.len().max(1) as f64;
        let mean_n = own.iter().sum::<f64>() / count;
        let square = own
            .iter()
            .map(|value| (value - mean_n).powi(2))
            .sum::<f64>();
        self.taken = readings.len();
        Window {
            mean_n,
            deviation_n: (square / count).sqrt(),
            is_most: self.amplitude_ma >= self.electrode.full_ma,
            amplitude_ma: self.amplitude_ma,
        }
    }
}
