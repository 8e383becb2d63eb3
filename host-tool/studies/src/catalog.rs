//! Which studies draw their persons, by name, and what each may be asked.
//!
//! Not here: experiments that are declarations (`experiments`), how a study is run
//! (`laboratory`), the commands (`cli`).

use crate::hamana2022::paper::{self, Kind};
use crate::hamana2022::{Cells, CellsRun, EXPERIMENTS, TwoPointsError, WEARERS};
use crate::laboratory::Runnable;
use crate::sierotowicz2023::electrodes;
use crate::{buatier2024, distributed, hamana2022, harris2017, lee2020, sierotowicz2023};
use host_core::run::DeviceName;
use host_core::wearer::builtin_wearer;
use std::ops::RangeInclusive;

/// What a command asks for.
#[derive(Clone, Copy, Debug)]
pub struct StudyRequest<'a> {
    /// The study's name.
    pub name: &'a str,
    /// A participant, or a wearer's file.
    pub wearer: Option<&'a str>,
    /// The name of an ablation; none for the study as preregistered.
    pub departure: Option<&'a str>,
    /// Where it, or a sample of it, is played.
    pub device: &'a DeviceName,
    /// Seed and draws; nothing for the declaration's.
    pub decided: (Option<u64>, Option<u64>),
}

/// A study that draws its persons.
pub struct Entry {
    /// The names that it has, and what is studied under each.
    pub names: &'static [(&'static str, &'static str)],
    /// File name in `host-tool/experiments` and text of its declaration.
    pub declarations: &'static [(&'static str, &'static str)],
    /// The command that runs it as declared.
    pub command: &'static str,
    /// How many draws may be asked for.
    draws: RangeInclusive<u64>,
    /// Why not every device will do, and which do.
    devices: (&'static str, &'static [DeviceName]),
    /// Whether it may be asked of one participant, or with a departure.
    has_participants: bool,
    begin: fn(&StudyRequest<'_>) -> anyhow::Result<Box<dyn Runnable>>,
}

const SIMULATORS: &[DeviceName] = &[DeviceName::Native, DeviceName::Chip, DeviceName::Qemu];
const NATIVE: &[DeviceName] = &[DeviceName::Native];

/// Every one.
pub const ENTRIES: [Entry; 8] = [
    Entry {
        names: &[
            (
                "hamana-1",
                "individuation of fingers by one point and by two",
            ),
            (
                "hamana-2",
                "torque of the index finger by one point and by two",
            ),
            ("hamana-3", "fingers at nine intensities"),
            ("hamana-4", "control of a finger by one point and by two"),
            ("hamana-posture", "the index finger as the forearm pronates"),
            ("hamana-hold", "how far a held finger sinks in 10 s"),
        ],
        declarations: &[
            ("hamana.toml", EXPERIMENTS),
            ("hamana-population.toml", hamana2022::DECLARED),
            ("hamana-wearers.toml", WEARERS),
        ],
        command: "flexor experiment hamana-1",
        draws: 1..=1_000,
        devices: ("a drawn forearm is simulated", SIMULATORS),
        has_participants: true,
        begin: hamana,
    },
    Entry {
        names: &[(
            hamana2022::TWO_POINTS,
            "drawn forearms: in whom a second point helps",
        )],
        declarations: &[("hamana-population.toml", hamana2022::DECLARED)],
        command: "flexor experiment two-points",
        draws: 1..=100_000,
        devices: ("two-points is of bodies alone, without a device", NATIVE),
        has_participants: false,
        begin: |request| {
            let cells = Cells::load(None)?;
            let cells = cells.ok_or_else(|| anyhow::anyhow!("no cells"))?;
            Ok(Box::new(CellsRun::new(cells, request.decided)))
        },
    },
    Entry {
        names: &[(
            "lee",
            "threshold and force response of a muscle, and its model",
        )],
        declarations: &[("lee.toml", lee2020::DECLARED)],
        command: "flexor experiment lee",
        draws: 1..=1_000,
        devices: ("a bench is simulated", SIMULATORS),
        has_participants: false,
        begin: |request| {
            Ok(Box::new(lee2020::Run::new(
                request.decided,
                request.device.clone(),
            )?))
        },
    },
    Entry {
        names: &[(
            harris2017::NAME,
            "torque of an elbow against current, width and angle",
        )],
        declarations: &[("harris-ramps.toml", harris2017::DECLARED)],
        command: "flexor experiment harris-ramps",
        // The paper has two.
        draws: 2..=100_000,
        devices: ("a drawn elbow is simulated", SIMULATORS),
        has_participants: false,
        begin: |request| {
            Ok(Box::new(harris2017::Run::new(
                request.decided,
                request.device.clone(),
            )?))
        },
    },
    Entry {
        names: &[(
            sierotowicz2023::NAME,
            "a wanted force at the hand by nine muscles",
        )],
        declarations: &[("sierotowicz.toml", sierotowicz2023::DECLARED)],
        command: "flexor experiment sierotowicz",
        draws: 1..=10_000,
        devices: (
            "sierotowicz is of simulated bodies",
            &[DeviceName::Native, DeviceName::Chip],
        ),
        has_participants: false,
        begin: |request| {
            Ok(Box::new(sierotowicz2023::Run::new(
                request.decided,
                request.device.clone(),
            )?))
        },
    },
    Entry {
        names: &[(
            electrodes::NAME,
            "which of ten electrodes serve a wanted force",
        )],
        declarations: &[("electrode-choice.toml", electrodes::DECLARED)],
        command: "flexor experiment electrode-choice",
        // Each is 400 kB.
        draws: 2..=2_000,
        devices: (
            "electrode-choice is of bodies alone, without a device",
            NATIVE,
        ),
        has_participants: false,
        begin: |request| Ok(Box::new(electrodes::Run::new(request.decided)?)),
    },
    Entry {
        names: &[(
            distributed::NAME,
            "one muscle's pulses shared by four electrodes",
        )],
        declarations: &[("distributed.toml", distributed::DECLARED)],
        command: "flexor experiment distributed",
        draws: 1..=10_000,
        devices: ("a drawn muscle is simulated for hours of its time", NATIVE),
        has_participants: false,
        begin: |request| {
            let (seed, draws) = request.decided;
            Ok(Box::new(distributed::Study::new(seed, draws)?))
        },
    },
    Entry {
        names: &[(
            buatier2024::NAME,
            "lifting arms that stimulation assists or resists",
        )],
        declarations: &[("buatier.toml", buatier2024::DECLARED)],
        command: "flexor experiment buatier",
        draws: 1..=10_000,
        devices: (
            "buatier takes the device's own modulation without the rest of it",
            NATIVE,
        ),
        has_participants: false,
        begin: |request| Ok(Box::new(buatier2024::Run::new(request.decided)?)),
    },
];

fn hamana(request: &StudyRequest<'_>) -> anyhow::Result<Box<dyn Runnable>> {
    let kind = Kind::from_name(request.name)
        .ok_or_else(|| anyhow::anyhow!("no study {}", request.name))?;
    let whom = (request.wearer, request.departure);
    let study = paper::Study::new(kind, whom, request.decided, request.device.clone());
    let study = study.map_err(TwoPointsError::with_lines)?;
    // Whatever is wrong with the device is found before anybody is drawn.
    study.check_device()?;
    Ok(Box::new(study))
}

/// Who has a declaration of this name too, which is meant where nothing says whose forearm.
const CONTROL: &str = "hamana-4";

impl Entry {
    /// The study that is asked for; nothing where a declaration is.
    ///
    /// # Errors
    /// What does not go together, for people.
    pub fn find(asked: &StudyRequest<'_>) -> Result<Option<&'static Self>, String> {
        let has = |entry: &&Self| entry.names.iter().any(|(name, _)| *name == asked.name);
        let found = ENTRIES.iter().find(has);
        let is_file = |text: &str| text.ends_with(".toml") || builtin_wearer(text).is_some();
        let has_word = asked.wearer.is_some_and(|wearer| !is_file(wearer));
        match found {
            Some(_) if asked.name == CONTROL && !asked.has_participant() => Ok(None),
            Some(entry) => Ok(Some(entry)),
            None if asked.departure.is_some() => Err(format!(
                "--departure belongs to {}, not to {}",
                Self::with_participants(),
                asked.name
            )),
            // On a wearer file a declaration is played.
            None if has_word => Err(format!(
                "--wearer of {} is a wearer file, NAME.toml, or one that is shipped, not `{}`",
                asked.name,
                asked.wearer.unwrap_or_default()
            )),
            None => Ok(None),
        }
    }

    /// The names of those with participants, in words.
    fn with_participants() -> String {
        let own = ENTRIES.iter().filter(|entry| entry.has_participants);
        let names: Vec<&str> = own
            .flat_map(|entry| entry.names)
            .map(|(name, _)| *name)
            .collect();
        names.join(", ")
    }

    /// What of wearer, device and draws it does not allow, for people.
    #[must_use]
    pub fn mistakes(&self, asked: &StudyRequest<'_>) -> Vec<String> {
        let (why, devices) = self.devices;
        let mut mistakes = Vec::new();
        if asked.has_participant() && !self.has_participants {
            let name = asked.name;
            mistakes.push(format!(
                "{name} draws its persons; --wearer and --departure do not belong to {name}"
            ));
        }
        if !devices.contains(asked.device) {
            let names: Vec<String> = devices.iter().map(DeviceName::to_argument).collect();
            mistakes.push(format!(
                "{why}, --device is {}; allowed: {}",
                asked.device,
                names.join(", ")
            ));
        }
        if let Some(draws) = asked.decided.1.filter(|value| !self.draws.contains(value)) {
            let (least, most) = (self.draws.start(), self.draws.end());
            mistakes.push(format!("--draws is {draws}, allowed is {least} to {most}"));
        }
        mistakes
    }

    /// Begins it. What is wrong with its device is found here.
    ///
    /// # Errors
    /// A wearer, a departure, a declaration or a device that is none.
    pub fn begin(&self, asked: &StudyRequest<'_>) -> anyhow::Result<Box<dyn Runnable>> {
        (self.begin)(asked)
    }
}

impl StudyRequest<'_> {
    const fn has_participant(&self) -> bool {
        self.wearer.is_some() || self.departure.is_some()
    }
}

/// The names of all of them, and what is studied under each.
pub fn names_and_titles() -> impl Iterator<Item = (&'static str, &'static str)> {
    ENTRIES.iter().flat_map(|entry| entry.names).copied()
}

/// The names of all of them.
pub fn names() -> impl Iterator<Item = &'static str> {
    names_and_titles().map(|(name, _)| name)
}
