//! The pattern, and a board that plays it.

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

/// A current: at 10 kΩ half of a stage's 120 V or less.
const CURRENT: Amplitude = Amplitude::new(5_000);

/// A voltage: at 500 Ω half of a stage's 20 mA.
const VOLTAGE: Amplitude = Amplitude::new(5_000);

/// Biphasic, 200 µs a phase, 50 µs between them, 50 Hz.
const PERIOD_US: u32 = 20_000;

/// So often the board hears its host, µs; it is patient for ten times as long.
const INTERVAL_US: u64 = 20_000;

/// What the board does while a value is measured.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum BoardActivity {
    /// Plays the pattern.
    Plays,
    /// Plays it until the hand-held stop opens.
    StopOpens,
    /// Plays it until it is ordered to stop, and falls to zero.
    Falls,
}

/// What a board plays: on one channel, and nothing that a person may not get.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Pattern {
    /// From 1.
    pub channel: u8,
    /// The board's stage there.
    pub stage: StageKind,
}

impl Pattern {
    /// On this channel, from 1, of this stage.
    #[must_use]
    pub const fn new(channel: u8, stage: StageKind) -> Self {
        Self { channel, stage }
    }

    /// In the stage's thousandths; the setup's limit, too.
    #[must_use]
    pub const fn amplitude(&self) -> Amplitude {
        match self.stage {
            StageKind::Current { .. } => CURRENT,
            StageKind::Voltage { .. } => VOLTAGE,
        }
    }

    /// Across a load, V.
    #[must_use]
    pub fn peak_v(&self, load_ohm: u32) -> f64 {
        let amplitude = f64::from(self.amplitude().get()) * 1e-3;
        match self.stage {
            StageKind::Current { .. } => amplitude * 1e-3 * f64::from(load_ohm),
            StageKind::Voltage { .. } => amplitude,
        }
    }

    /// For people: "5 mA".
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

    /// The channel, with no limit above what the pattern needs.
    fn spec(&self) -> ChannelSpec {
        let stage = match self.stage {
            StageKind::Current { full_scale_ua } => StageSpec::Current { full_scale_ua },
            StageKind::Voltage { full_scale_mv } => StageSpec::Voltage {
                full_scale_mv,
                load_ohm: 500, // the least, so that limits hold for each
            },
        };
        ChannelSpec {
            stage,
            limit: self.amplitude(),
            ..channel(PERIOD_US, 0)
        }
    }

    /// Of a dummy: no more than the pattern needs, even if somebody were connected.
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

/// A board on the bench.
pub struct Bench {
    client: Connection<Box<dyn Port>>,
    /// Who answered.
    pub info: HelloInfo,
    pattern: Option<Pattern>,
    is_on: bool,
}

impl Bench {
    /// Opens a board behind a port, or the native simulator with dummy loads.
    ///
    /// # Errors
    /// There is none, or it refuses.
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

    /// The board's stage on `channel`, from 1, by its own word; of a simulator that has
    /// what is declared, one of 100 mA.
    #[must_use]
    pub fn stage(&self, channel: u8) -> Option<StageKind> {
        match &self.info.stages {
            Stages::Stored(table) => table.stages.get(usize::from(channel) - 1).copied()?,
            Stages::AsDeclared => Some(StageKind::Current {
                full_scale_ua: 100_000,
            }),
            Stages::Unknown(_) => None,
        }
    }

    /// Whether a simulator is part of this program.
    pub fn is_in_process(&mut self) -> bool {
        self.client.port().world().is_some()
    }

    /// Another load is in the output: known to a simulator only.
    pub fn set_load(&mut self, load_ohm: u32) {
        if let Some(world) = self.client.port().world() {
            *world.body.loads_mut() = [Load::Ohms(load_ohm.into()); CHANNELS];
        }
    }

    /// Configures, arms and starts the pattern.
    ///
    /// # Errors
    /// Refused: an electrode is off, neither key nor stop is closed.
    pub fn begin(&mut self, pattern: Pattern) -> Result<(), Error> {
        self.client.wearer(Pattern::limits())?;
        self.client.channel(pattern.index(), pattern.spec())?;
        self.client.arm()?;
        self.client.start()?;
        (self.pattern, self.is_on) = (Some(pattern), true);
        self.keep_playing()
    }

    /// A moment of it, 20 ms; call again and again. A board that has stopped is left alone.
    ///
    /// # Errors
    /// The board is lost, or a signal came.
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

    /// What the board does in a step, beyond playing on.
    ///
    /// # Errors
    /// The board is lost.
    pub fn perform(&mut self, doing: BoardActivity) -> Result<(), Error> {
        match doing {
            BoardActivity::Plays | BoardActivity::StopOpens => Ok(()),
            BoardActivity::Falls => self.end(),
        }
    }

    /// Silence, whatever a signal says.
    ///
    /// # Errors
    /// The board is lost: then it is silent by its own host timeout.
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
