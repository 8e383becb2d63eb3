//! The pattern of a bench test, and the board that plays it.

use crate::selftest::{BOOT, channel};
use firmware::link::HelloInfo;
use firmware::safety::{ChannelSpec, StageKind, StageSpec, Stages, WearerSpec};
use firmware::units::Amplitude;
use hal_sim::body::{CHANNELS, FixedLoad, Load};
use hal_sim::native::native;
use hal_sim::wire::faults::Faults;
use hal_sim::world::World;
use host_core::link::{Connection, Error, Interruption, Port, SimulatedPort};
use host_core::run::{DeviceName, OpenError};

/// Amplitude of the pattern on a current stage, µA. The largest dummy load, 10 kΩ, then needs 50 V,
/// less than half of the stage's 120 V.
const CURRENT: Amplitude = Amplitude::new(5_000);

/// Amplitude of the pattern on a voltage stage, mV. The smallest dummy load, 500 Ω, then draws 10
/// mA, half of the stage's 20 mA.
const VOLTAGE: Amplitude = Amplitude::new(5_000);

/// Time between two pulses of the pattern, µs (50 Hz). Each pulse has two phases of 200 µs, with 50
/// µs between them.
const PERIOD_US: u32 = 20_000;

/// Time between two messages to the board, µs: a tenth of the host timeout.
const INTERVAL_US: u64 = 20_000;

/// Action of the board while a value is measured.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum BoardActivity {
    /// Plays the pattern until the step is over.
    Plays,
    /// Plays the pattern until the hand-held stop opens.
    StopOpens,
    /// Plays the pattern until the host stops it; the amplitude then falls to zero.
    Falls,
}

/// Pattern that a board plays on one channel, within limits that are safe for a person.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Pattern {
    /// Channel number, from 1.
    pub channel: u8,
    /// The board's output stage of the channel.
    pub stage: StageKind,
}

impl Pattern {
    /// Returns the pattern for a channel, from 1, with this output stage.
    #[must_use]
    pub const fn new(channel: u8, stage: StageKind) -> Self {
        Self { channel, stage }
    }

    /// Returns the amplitude of the pattern, µA for a current stage and mV for a voltage stage. It
    /// is also the channel's limit in the setup.
    #[must_use]
    pub const fn amplitude(&self) -> Amplitude {
        match self.stage {
            StageKind::Current { .. } => CURRENT,
            StageKind::Voltage { .. } => VOLTAGE,
        }
    }

    /// Returns the peak voltage across a load, V.
    #[must_use]
    pub fn peak_v(&self, load_ohm: u32) -> f64 {
        let amplitude = f64::from(self.amplitude().get()) * 1e-3;
        match self.stage {
            StageKind::Current { .. } => amplitude * 1e-3 * f64::from(load_ohm),
            StageKind::Voltage { .. } => amplitude,
        }
    }

    /// Describes the pattern for people.
    #[must_use]
    pub fn description(&self) -> String {
        let unit = match self.stage {
            StageKind::Current { .. } => "mA",
            StageKind::Voltage { .. } => "V",
        };
        let amplitude = f64::from(self.amplitude().get()) * 1e-3;
        format!(
            "{amplitude} {unit}, 200 us, 50 us, 200 us, every 20 ms, on channel {}",
            self.channel
        )
    }

    const fn index(&self) -> u8 {
        self.channel - 1
    }

    /// Returns the channel's setup, with the pattern's amplitude as its limit.
    fn spec(&self) -> ChannelSpec {
        let stage = match self.stage {
            StageKind::Current { full_scale_ua } => StageSpec::Current { full_scale_ua },
            StageKind::Voltage { full_scale_mv } => StageSpec::Voltage {
                full_scale_mv,
                load_ohm: 500, // the smallest load, so that limits hold for each
            },
        };
        ChannelSpec {
            stage,
            limit: self.amplitude(),
            ..channel(PERIOD_US, 0)
        }
    }

    /// Returns limits for the wearer that are no higher than the pattern needs. They would protect
    /// a person who is connected by mistake.
    fn limits() -> WearerSpec {
        WearerSpec {
            max_current_ua: 10_000,
            max_charge_nc: 2_000,
            max_rms_ua: 2_000,
            rise_ms: 10,
            fall_ms: 50,
            host_timeout_ms: 200,
            max_session_s: 7_200,
            ..WearerSpec::default()
        }
    }
}

/// A board in a bench test.
pub struct Bench {
    client: Connection<Box<dyn Port>>,
    /// Greeting of the board.
    pub info: HelloInfo,
    pattern: Option<Pattern>,
    is_on: bool,
}

impl Bench {
    /// Opens a board behind a port, or the native simulator with dummy loads.
    ///
    /// # Errors
    /// Fails if there is no board or it refuses.
    pub fn open(name: &DeviceName, interruption: Interruption) -> Result<Self, OpenError> {
        let port: Box<dyn Port> = match name {
            DeviceName::Native => {
                let body = Box::new(FixedLoad::new(0.0));
                let device = Box::new(native(BOOT));
                let world = World::new(device, body, BOOT, Faults::default(), 1);
                Box::new(SimulatedPort::new(world))
            }
            _ => name.connect()?,
        };
        let (client, info) = Connection::open_interruptible(port, Some(interruption))?;
        Ok(Self {
            client,
            info,
            pattern: None,
            is_on: false,
        })
    }

    /// Returns the output stage of `channel`, counted from 1, as the board reports it; `None` if
    /// there is none or the board does not know. For a simulator that accepts any configured stage,
    /// returns a current stage of 100 mA.
    #[must_use]
    pub fn stage(&self, channel: u8) -> Option<StageKind> {
        match &self.info.stages {
            Stages::Stored(table) => table.stages.get(usize::from(channel) - 1).copied()?,
            Stages::AsConfigured => Some(StageKind::Current {
                full_scale_ua: 100_000,
            }),
            Stages::Simulated { channels } => {
                let has = channels >> (channel - 1) & 1 == 1; // channel is 1 to 10
                has.then_some(StageKind::Current {
                    full_scale_ua: 100_000,
                })
            }
            Stages::Unknown(_) => None,
        }
    }

    /// Returns whether the device is a simulator within this program.
    pub fn is_in_process(&mut self) -> bool {
        self.client.port().world().is_some()
    }

    /// Sets the load of a simulator, Ω. Does nothing on a board, whose load a person changes.
    pub fn set_load(&mut self, load_ohm: u32) {
        if let Some(world) = self.client.port().world() {
            *world.body.loads_mut() = [Load::Ohms(load_ohm.into()); CHANNELS];
        }
    }

    /// Configures, arms and starts the pattern.
    ///
    /// # Errors
    /// Fails if the board refuses: an electrode is off, or the key or stop is not closed.
    pub fn begin(&mut self, pattern: Pattern) -> Result<(), Error> {
        self.client.wearer(Pattern::limits())?;
        self.client.channel(pattern.index(), pattern.spec())?;
        self.client.arm()?;
        self.client.start()?;
        (self.pattern, self.is_on) = (Some(pattern), true);
        self.keep_playing()
    }

    /// Plays the pattern for 20 ms. The caller must repeat the call without pauses, or the host
    /// timeout ends the pattern. Does not restart a board that has stopped.
    ///
    /// # Errors
    /// Fails if the board is lost or a signal arrives.
    pub fn keep_playing(&mut self) -> Result<(), Error> {
        if let (Some(pattern), true) = (self.pattern, self.is_on) {
            let asked = firmware::link::Request::Amplitudes {
                at: None,
                mask: 1 << pattern.index(),
                values: [pattern.amplitude()].into_iter().collect(),
                widths: Default::default(),
            };
            self.client.post(asked)?;
        }
        let until = self.client.port().now_us() + INTERVAL_US;
        while self.client.next(until)?.is_some() {}
        Ok(())
    }

    /// Carries out what a step needs beyond the pattern: for [`BoardActivity::Falls`], stops the
    /// pattern.
    ///
    /// # Errors
    /// Fails if the board is lost.
    pub fn perform(&mut self, doing: BoardActivity) -> Result<(), Error> {
        match doing {
            BoardActivity::Plays | BoardActivity::StopOpens => Ok(()),
            BoardActivity::Falls => self.end(),
        }
    }

    /// Stops the pattern, even after a signal.
    ///
    /// # Errors
    /// Fails if the board is lost; its own host timeout then silences it.
    pub fn end(&mut self) -> Result<(), Error> {
        if !std::mem::take(&mut self.is_on) {
            return Ok(());
        }
        self.client.ignore_signals();
        let stopped = self.client.stop();
        let until = self.client.port().now_us() + 100_000;
        while self.client.next(until)?.is_some() {}
        match stopped {
            // It has stopped by itself.
            Err(Error::Refused(_)) | Ok(_) => Ok(()),
            Err(error) => Err(error),
        }
    }
}
