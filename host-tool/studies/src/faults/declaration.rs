//! What is drawn, how often, and what stimulates meanwhile: files of the program.

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

/// File name in `host-tool/experiments/faults` and text of what each class draws, and of the
/// sessions that stimulate meanwhile.
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

/// The file of this name, and its text.
fn file(name: &str) -> Option<(&'static str, &'static str)> {
    FILES.into_iter().find(|(file, _)| *file == name)
}

/// A class of faults.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Class {
    /// One bit of the memory that decides the outputs.
    Flips,
    /// One bit of a register that decides edges.
    Registers,
    /// A setup that is not true of the board, or a board that does not know itself.
    Declarations,
    /// An electrode that opens, shorts, peels, loses a phase or its reading.
    Electrode,
    /// What a host says, broken on its way.
    Link,
    /// A joint's measured angle that is wrong, late or missing.
    Sensor,
    /// What moves words, paces them or asks for them.
    Streams,
    /// What happens to the core.
    Cpu,
    /// What the chip lives on: clocks, supply, a debugger, power within a flash write.
    Supply,
    /// An owner that freezes and an erase stream that is off.
    Pairs,
    /// Pieces and resets that would evade the wearer's time and charge.
    Allowance,
}

impl Class {
    /// All of them.
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

    /// As a command takes it.
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
    /// Whether the native simulator has what it breaks.
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
            .ok_or_else(|| format!("there are {}", names()))
    }
}

/// What the campaign of a class draws.
#[derive(Clone, Debug)]
pub struct Declaration {
    /// Of which class.
    pub class: Class,
    /// What the file says.
    pub(super) of: CampaignFile,
    /// What stimulates meanwhile.
    pub(super) scene: SessionFile,
    /// What else may, of classes that draw that.
    pub(super) scenes: Vec<SessionFile>,
    /// SHA-256 of all of them, by file.
    pub sha256: BTreeMap<String, String>,
    /// Every fork is played to the end of its time, although it is known before what
    /// becomes of it: to check what is known.
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
    /// The same natively, of classes that are played there.
    native_count: Option<u64>,
    warm_ms: u64,
    window_ms: u64,
    runs_ms: u64,
    #[serde(default)]
    silent_ms: u64,
    /// What memory bits are flipped in.
    #[serde(default, rename = "stratum")]
    pub strata: Vec<WrittenStratum>,
    /// The registers of which a bit is turned.
    #[serde(default, rename = "register")]
    pub registers: Vec<Register>,
    /// What may be wrong.
    #[serde(default)]
    pub kinds: Vec<String>,
    /// Of those, what the native simulator can play.
    #[serde(default)]
    pub native_kinds: Vec<String>,
    /// What joined them later, without another draw of what was played before.
    #[serde(default)]
    pub later: Option<Later>,
}

/// A kind that all cases from a number on are.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Later {
    pub kind: String,
    /// The number on the chip, and natively.
    pub from: u64,
    pub native_from: u64,
}

/// Memory of one kind, in which a declared number of bits is flipped.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct WrittenStratum {
    pub kind: String,
    pub count: u64,
    pub memory: Memory,
    /// Of [`Memory::Variable`], as its source calls it.
    #[serde(default)]
    pub symbol: String,
    /// While a refill is under way, not at rest.
    #[serde(default)]
    pub in_refill: bool,
}

/// What memory.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Memory {
    /// A variable.
    Variable,
    /// What the main stack holds at that moment.
    LiveStack,
    /// Down to where the stack was deepest, whatever it holds.
    Stack,
    /// All other variables.
    Rest,
    /// Both copies of the board's table, in flash.
    Table,
}

/// A register and those of its bits that may be turned.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Register {
    pub name: String,
    pub address: u32,
    pub bits: u32,
}

/// When what happens in a fork, µs.
#[derive(Clone, Copy, Debug)]
pub(super) struct Timing {
    /// Stimulated before the first.
    pub warm_us: u64,
    /// In which it breaks.
    pub window_us: u64,
    /// Played after it, the host speaking.
    pub runs_us: u64,
    /// And then, the host silent.
    pub silent_us: u64,
}

/// A file by its name, with its SHA-256.
fn hash((file, text): (&str, &str)) -> (String, String) {
    (file.to_owned(), sha256(text.as_bytes()))
}

impl Declaration {
    /// The program's own of this class.
    ///
    /// # Errors
    /// E619.
    pub fn for_class(class: Class) -> Result<Self, FaultsError> {
        let name = format!("{class}.toml");
        let told = |why: String| FaultsError::Declaration(format!("{name}: {why}"));
        let (name, text) = file(&name).ok_or_else(|| told("no such file".to_owned()))?;
        let of: CampaignFile = toml::from_str(text).map_err(|e| told(e.to_string()))?;
        let mut sha256 = BTreeMap::from([hash((name, text))]);
        let mut read = |wanted: &String| {
            let (file, session) =
                file(wanted).ok_or_else(|| told(format!("no scene `{wanted}`")))?;
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

    /// File name and text of the class's own file.
    pub(super) fn file(&self) -> (&'static str, &'static str) {
        file(&format!("{}.toml", self.class)).unwrap_or_default()
    }

    /// The seed that is judged.
    #[must_use]
    pub const fn seed(&self) -> u64 {
        self.of.seed
    }

    /// How many cases are judged, on the chip or natively.
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
