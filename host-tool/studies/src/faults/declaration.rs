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
/// that stimulate while faults are injected.
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

/// Returns name and text of the built-in file `name`; `None` if there is no such file.
fn file(name: &str) -> Option<(&'static str, &'static str)> {
    FILES.into_iter().find(|(file, _)| *file == name)
}

/// A class of injected faults; each has its own campaign.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Class {
    /// One bit flips in the memory that determines the outputs.
    Flips,
    /// One bit flips in a register that determines edges.
    Registers,
    /// The setup contradicts the board's output stages, or the stored table of these stages is
    /// damaged.
    Declarations,
    /// An electrode opens, shorts, peels off, or loses a phase or its current measurement.
    Electrode,
    /// Messages of the host are corrupted in transit.
    Link,
    /// A measured joint angle is wrong, late or missing.
    Sensor,
    /// A DMA stream fails, or a timer that paces or requests its transfers.
    Streams,
    /// The processor core fails: it hangs, ignores interrupts, jumps to a wrong address, or loses
    /// register contents.
    Cpu,
    /// The chip's environment fails: clocks, supply, a debugger, or power during a flash write.
    Supply,
    /// An interrupt handler hangs while a DMA stream that erases the pulse tape is disabled.
    Pairs,
    /// The host tries to exceed the wearer's time and charge with many pieces of stimulation and
    /// resets.
    Allowance,
}

impl Class {
    /// All classes, in the order in which reports list them.
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

    /// Returns the name of the class on the command line.
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
    /// Returns whether the native backend can simulate this class of faults.
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
        let mut classes = Self::ALL.into_iter();
        let names = || Self::ALL.map(Self::name).join(", ");
        classes
            .find(|class| class.name() == name)
            .ok_or_else(|| format!("available: {}", names()))
    }
}

/// The preregistered campaign of one class.
#[derive(Clone, Debug)]
pub struct Declaration {
    /// Class of the injected faults.
    pub class: Class,
    /// Content of the campaign file in `host-tool/experiments/faults`.
    pub(super) of: CampaignFile,
    /// Session that stimulates while faults are injected.
    pub(super) scene: SessionFile,
    /// Further sessions; classes that use several choose one at random for each case.
    pub(super) scenes: Vec<SessionFile>,
    /// SHA-256 of the campaign file and its sessions, by file name.
    pub sha256: BTreeMap<String, String>,
    /// Whether every case runs to its configured end even if its result is certain earlier. Such
    /// runs verify that ending early changes no result.
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
    /// Number of cases on the native backend; `None` if it is the same as on the chip simulator.
    native_count: Option<u64>,
    warm_ms: u64,
    window_ms: u64,
    runs_ms: u64,
    #[serde(default)]
    silent_ms: u64,
    /// Memory areas in which bits are flipped.
    #[serde(default, rename = "stratum")]
    pub strata: Vec<WrittenStratum>,
    /// Registers of which one bit is flipped.
    #[serde(default, rename = "register")]
    pub registers: Vec<Register>,
    /// Kinds of fault from which the chip simulator's cases choose.
    #[serde(default)]
    pub kinds: Vec<String>,
    /// Kinds of fault from which the native backend's cases choose.
    #[serde(default)]
    pub native_kinds: Vec<String>,
    /// Kind of fault that was added to a finished campaign, without changing its earlier cases.
    #[serde(default)]
    pub later: Option<Later>,
}

/// A kind of fault that all cases from a certain number on have.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Later {
    pub kind: String,
    /// First case of this kind on the chip simulator.
    pub from: u64,
    pub native_from: u64,
}

/// A memory area as the campaign file describes it, and the number of bits to flip in it.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct WrittenStratum {
    pub kind: String,
    pub count: u64,
    pub memory: Memory,
    /// Name of the variable in the image, for [`Memory::Variable`].
    #[serde(default)]
    pub symbol: String,
    /// Whether the bit flips during a refill instead of between two refills.
    #[serde(default)]
    pub in_refill: bool,
}

/// Kind of memory area in which bits are flipped.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Memory {
    /// The variable that [`WrittenStratum::symbol`] names.
    Variable,
    /// The part of the main stack that is in use at the moment of the fault.
    LiveStack,
    /// The main stack down to its largest depth, whether in use at that moment or not.
    Stack,
    /// All variables in SRAM1 that no [`Self::Variable`] of the campaign names.
    Rest,
    /// Both copies of the table of output stages, in flash.
    Table,
}

/// A register, and a mask of the bits that may be flipped.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Register {
    pub name: String,
    pub address: u32,
    pub bits: u32,
}

/// Phases of a case, µs.
#[derive(Clone, Copy, Debug)]
pub(super) struct Timing {
    /// Stimulation before the first possible fault.
    pub warm_us: u64,
    /// Time after that in which the fault occurs at a random moment.
    pub window_us: u64,
    /// Time after the fault for which the host keeps sending.
    pub runs_us: u64,
    /// Time after `runs_us` for which the host is silent, so that the device must stop by itself.
    pub silent_us: u64,
}

/// Returns the name of a file with the SHA-256 of its text.
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
        let failure = |why: String| FaultsError::Declaration(format!("{name}: {why}"));
        let (name, text) = file(&name).ok_or_else(|| failure("no such file".to_owned()))?;
        let campaign: CampaignFile = toml::from_str(text).map_err(|e| failure(e.to_string()))?;
        let mut sha256 = BTreeMap::from([hash((name, text))]);
        let mut read = |wanted: &String| {
            let (file, session) =
                file(wanted).ok_or_else(|| failure(format!("there is no scene `{wanted}`")))?;
            sha256.extend([hash((file, session))]);
            SessionFile::parse(file, session).map_err(|e| failure(e.lines()))
        };
        let scene = read(&campaign.scene)?;
        let scenes: Result<_, _> = campaign.more_scenes.iter().map(read).collect();
        let scenes = scenes?;
        Ok(Self {
            class,
            of: campaign,
            scene,
            scenes,
            sha256,
            to_the_end: false,
        })
    }

    /// Returns name and text of the campaign file of this class.
    pub(super) fn file(&self) -> (&'static str, &'static str) {
        file(&format!("{}.toml", self.class)).unwrap_or_default()
    }

    /// Returns the seed that the campaign file fixes.
    #[must_use]
    pub const fn seed(&self) -> u64 {
        self.of.seed
    }

    /// Returns the preregistered number of cases: on the native backend if `natively`, otherwise on
    /// the chip simulator.
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
