//! Reads the preregistered fault campaigns: the faults to inject, their number, and the session
//! that stimulates meanwhile.

use super::error::FaultsError;
use host_core::record::sha256;
use host_core::run::SessionFile;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::fmt;
use std::str::FromStr;

macro_rules! files {
    ($($file:literal)*) => {
        [$(($file, include_str!(concat!("../../../experiments/faults/", $file)))),*]
    };
}

/// Name and text of the files in `host-tool/experiments/faults`: the campaigns, and the sessions
/// that stimulate meanwhile.
pub const FILES: [(&str, &str); 18] = files![
    "allowance.toml"
    "arm.toml"
    "cpu.toml"
    "declarations.toml"
    "electrode.toml"
    "finger.toml"
    "finger_board.toml"
    "flips.toml"
    "lift.toml"
    "link.toml"
    "orders.toml"
    "pair.toml"
    "pairs.toml"
    "registers.toml"
    "scene.toml"
    "sensor.toml"
    "streams.toml"
    "supply.toml"
];

/// Returns name and text of the file with this name.
fn file(name: &str) -> Option<(&'static str, &'static str)> {
    FILES.into_iter().find(|(file, _)| *file == name)
}

/// A class of injected faults.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Class {
    /// One bit of the memory that determines the outputs.
    Flips,
    /// One bit of a register that determines edges.
    Registers,
    /// A setup that contradicts the board, or a board with a damaged table of its stages.
    Declarations,
    /// An electrode that opens, shorts, peels off, loses a phase or its measurement.
    Electrode,
    /// A host's messages, corrupted in transit.
    Link,
    /// A joint's measured angle that is wrong, late or missing.
    Sensor,
    /// The DMA streams and the timers that pace or request their transfers.
    Streams,
    /// The processor core.
    Cpu,
    /// The chip's environment: clocks, supply, a debugger, loss of power during a flash write.
    Supply,
    /// A hanging interrupt handler together with a disabled erase stream.
    Pairs,
    /// Pieces of stimulation and resets that try to exceed the wearer's time and charge.
    Allowance,
}

impl Class {
    /// All classes, in the order of their reports.
    pub const ALL: [Self; 11] = [
        Self::Flips,
        Self::Declarations,
        Self::Registers,
        Self::Electrode,
        Self::Link,
        Self::Sensor,
        Self::Streams,
        Self::Cpu,
        Self::Supply,
        Self::Pairs,
        Self::Allowance,
    ];

    /// Returns the name that commands use.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Flips => "flips",
            Self::Registers => "registers",
            Self::Declarations => "declarations",
            Self::Electrode => "electrode",
            Self::Link => "link",
            Self::Sensor => "sensor",
            Self::Streams => "streams",
            Self::Cpu => "cpu",
            Self::Supply => "supply",
            Self::Pairs => "pairs",
            Self::Allowance => "allowance",
        }
    }
}

impl Class {
    /// Returns whether the native backend can simulate the class.
    #[must_use]
    pub const fn is_native(self) -> bool {
        matches!(
            self,
            Self::Declarations | Self::Electrode | Self::Link | Self::Sensor | Self::Allowance
        )
    }
}

impl fmt::Display for Class {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Class {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        let mut all = Self::ALL.into_iter();
        let names = || Self::ALL.map(Self::name).join(", ");
        all.find(|class| class.name() == name)
            .ok_or_else(|| format!("available: {}", names()))
    }
}

/// The preregistered campaign of one class.
#[derive(Clone, Debug)]
pub struct Declaration {
    /// Fault class of the campaign.
    pub class: Class,
    /// Parsed campaign file.
    pub(super) of: CampaignFile,
    /// Session that stimulates while faults are injected.
    pub(super) scene: SessionFile,
    /// Further sessions, for classes that choose one at random.
    pub(super) scenes: Vec<SessionFile>,
    /// SHA-256 of all these files, by name.
    pub sha256: BTreeMap<String, String>,
    /// Whether every fork runs to its end even if the result is known before, which verifies the
    /// shortcuts.
    pub to_the_end: bool,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct CampaignFile {
    scene: String,
    #[serde(default)]
    more_scenes: Vec<String>,
    seed: u64,
    count: u64,
    /// Number of cases on the native backend, for classes that run there.
    native_count: Option<u64>,
    warm_ms: u64,
    window_ms: u64,
    runs_ms: u64,
    #[serde(default)]
    silent_ms: u64,
    /// Memory areas in which bits are flipped.
    #[serde(default, rename = "stratum")]
    pub strata: Vec<WrittenStratum>,
    /// Registers in which one bit is flipped.
    #[serde(default, rename = "register")]
    pub registers: Vec<Register>,
    /// Kinds of fault on the chip simulator.
    #[serde(default)]
    pub kinds: Vec<String>,
    /// Kinds of fault that the native backend can simulate.
    #[serde(default)]
    pub native_kinds: Vec<String>,
    /// Kind of fault that was added later and leaves the earlier cases unchanged.
    #[serde(default)]
    pub later: Option<Later>,
}

/// A kind of fault that all cases from an index on have.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Later {
    pub kind: String,
    /// First index on the chip simulator; `native_from` is that on the native backend.
    pub from: u64,
    pub native_from: u64,
}

/// One kind of memory, and the number of bits to flip in it.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct WrittenStratum {
    pub kind: String,
    pub count: u64,
    pub memory: Memory,
    /// Name of a [`Memory::Variable`] in its source.
    #[serde(default)]
    pub symbol: String,
    /// Whether the flip happens during a refill instead of between refills.
    #[serde(default)]
    pub in_refill: bool,
}

/// Kind of memory whose bits are flipped.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Memory {
    /// The variable that `symbol` names.
    Variable,
    /// The part of the main stack in use at that moment.
    LiveStack,
    /// The main stack down to its largest depth, in use or not.
    Stack,
    /// All variables that no other stratum covers.
    Rest,
    /// Both copies of the board's table, in flash.
    Table,
}

/// A register, and the bits that may be flipped.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Register {
    pub name: String,
    pub address: u32,
    pub bits: u32,
}

/// Phases of a fork, µs.
#[derive(Clone, Copy, Debug)]
pub(super) struct Timing {
    /// Stimulation before the first fault.
    pub warm_us: u64,
    /// Interval in which the fault occurs.
    pub window_us: u64,
    /// Time after the fault during which the host sends.
    pub runs_us: u64,
    /// Time after that during which the host is silent.
    pub silent_us: u64,
}

/// Returns a file's name with its SHA-256.
fn hash((file, text): (&str, &str)) -> (String, String) {
    (file.to_owned(), sha256(text.as_bytes()))
}

impl Declaration {
    /// Reads the built-in campaign of this class.
    ///
    /// # Errors
    /// Fails with E619 if the file or a session in it is invalid.
    pub fn for_class(class: Class) -> Result<Self, FaultsError> {
        let name = format!("{class}.toml");
        let told = |why: String| FaultsError::Declaration(format!("{name}: {why}"));
        let (name, text) = file(&name).ok_or_else(|| told("no such file".to_owned()))?;
        let of: CampaignFile = toml::from_str(text).map_err(|e| told(e.to_string()))?;
        let mut sha256 = BTreeMap::from([hash((name, text))]);
        let mut read = |wanted: &String| {
            let (file, session) =
                file(wanted).ok_or_else(|| told(format!("there is no scene `{wanted}`")))?;
            sha256.extend([hash((file, session))]);
            SessionFile::parse(file, session).map_err(|e| told(e.lines()))
        };
        let scene = read(&of.scene)?;
        let scenes: Result<_, _> = of.more_scenes.iter().map(read).collect();
        let scenes = scenes?;
        Ok(Self {
            class,
            of,
            scene,
            scenes,
            sha256,
            to_the_end: false,
        })
    }

    /// Returns name and text of the class's own file.
    pub(super) fn file(&self) -> (&'static str, &'static str) {
        file(&format!("{}.toml", self.class)).unwrap_or_default()
    }

    /// Returns the preregistered seed.
    #[must_use]
    pub const fn seed(&self) -> u64 {
        self.of.seed
    }

    /// Returns the preregistered number of cases, on the chip simulator or the native backend.
    #[must_use]
    pub fn count(&self, natively: bool) -> u64 {
        let native = self.of.native_count.filter(|_| natively);
        native.unwrap_or(self.of.count)
    }

    pub(super) const fn timing(&self) -> Timing {
        Timing {
            warm_us: 1000 * self.of.warm_ms,
            window_us: 1000 * self.of.window_ms,
            runs_us: 1000 * self.of.runs_ms,
            silent_us: 1000 * self.of.silent_ms,
        }
    }
}
