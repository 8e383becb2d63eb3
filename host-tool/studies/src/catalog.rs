//! Lists the studies with random wearers, by name, and the options that each accepts.
//!
//! Experiments that are declarations are in `experiments`, the runner is in `laboratory`, the
//! commands are in `cli`.

use crate::hamana2022::conditioning::{self, CalibrationStudy, Conditioning, ConditioningStudy};
use crate::hamana2022::paper::{self, ClaimStudy, Kind, Source};
use crate::hamana2022::{Cells, CellsRun, EXPERIMENTS, TwoPointsError, WEARERS};
use crate::laboratory::Runnable;
use crate::sierotowicz2023::electrodes;
use crate::{buatier2024, distributed, hamana2022, harris2017, lee2020, sierotowicz2023};
use host_core::run::DeviceName;
use host_core::wearer::builtin_wearer;
use std::ops::RangeInclusive;

/// What a command asks of a study: its name, wearer, ablation, device, seed and number of draws.
#[derive(Clone, Copy, Debug)]
pub struct StudyRequest<'a> {
    /// Name of the study as typed on the command line.
    pub name: &'a str,
    /// Participant of the paper (such as `P`), or the name of a wearer file; `None` for random
    /// wearers.
    pub wearer: Option<&'a str>,
    /// Name of an ablation; `None` for the study as preregistered.
    pub ablation: Option<&'a str>,
    /// Forearms of the participants of Hamana 2022; `None` for the study's own choice.
    pub participants: Option<Source>,
    /// Device on which the study runs, or on which a sample of its units is repeated.
    pub device: &'a DeviceName,
    /// Seed and number of draws; `None` where the declaration's value applies.
    pub decided: (Option<u64>, Option<u64>),
}

/// A study with random wearers, or several that share their code.
pub struct Entry {
    /// Name of each study on the command line, with its title.
    pub names: &'static [(&'static str, &'static str)],
    /// File name in `host-tool/experiments` and text of each declaration.
    pub declarations: &'static [(&'static str, &'static str)],
    /// Command that runs the study as declared.
    pub command: &'static str,
    /// Range of the allowed number of draws.
    draws: RangeInclusive<u64>,
    /// Reason why not every device is allowed, and the allowed devices.
    devices: (&'static str, &'static [DeviceName]),
    /// Whether a participant or an ablation can be chosen for the study.
    has_participants: bool,
    begin: fn(&StudyRequest<'_>) -> anyhow::Result<Box<dyn Runnable>>,
}

const SIMULATORS: &[DeviceName] = &[DeviceName::Native, DeviceName::Chip, DeviceName::Qemu];
const NATIVE: &[DeviceName] = &[DeviceName::Native];

/// All studies with random wearers.
pub const ENTRIES: [Entry; 11] = [
    Entry {
        names: &[
            (
                "hamana-1",
                "individuation of fingers with one point and with two",
            ),
            (
                "hamana-2",
                "torque of the index finger with one point and with two",
            ),
            ("hamana-3", "finger angles at nine intensities"),
            (
                "hamana-4",
                "control of a finger with one point and with two",
            ),
            (
                "hamana-posture",
                "angle of the index finger as the forearm pronates",
            ),
            ("hamana-hold", "drop of a held finger within 10 s"),
        ],
        declarations: &[
            ("hamana.toml", EXPERIMENTS),
            ("hamana-population.toml", hamana2022::DECLARED),
            ("hamana-wearers.toml", WEARERS),
        ],
        command: "flexor experiment hamana-1",
        draws: 1..=1_000,
        devices: ("the forearm is simulated", SIMULATORS),
        has_participants: true,
        begin: hamana,
    },
    Entry {
        names: &[
            (
                conditioning::PARTICIPANTS,
                "forearms that agree with the printed voltages of P, Q, R and S",
            ),
            (
                conditioning::MECHANISMS,
                "the same under single changes of the forearm model",
            ),
        ],
        declarations: &[
            ("hamana-participants.toml", conditioning::DECLARED),
            ("hamana-population.toml", hamana2022::DECLARED),
        ],
        command: "flexor experiment hamana-participants",
        draws: 1..=100_000,
        devices: ("the forearms are simulated without a device", NATIVE),
        has_participants: true,
        begin: |request| {
            let is_file = request
                .wearer
                .is_some_and(|wearer| wearer.ends_with(".toml"));
            if is_file || request.ablation.is_some() || request.participants.is_some() {
                return Err(TwoPointsError::Conditioned(request.name.to_owned()).into());
            }
            let kind = Conditioning::from_name(request.name)
                .ok_or_else(|| anyhow::anyhow!("there is no study {}", request.name))?;
            let study = ConditioningStudy::new(kind, request.wearer, request.decided)?;
            Ok(Box::new(study))
        },
    },
    Entry {
        names: &[(
            conditioning::CALIBRATION,
            "whether the conditioning finds participants whose truth is known",
        )],
        declarations: &[
            ("hamana-participants.toml", conditioning::DECLARED),
            ("hamana-population.toml", hamana2022::DECLARED),
        ],
        command: "flexor experiment hamana-calibration",
        draws: 1..=100_000,
        devices: ("the forearms are simulated without a device", NATIVE),
        has_participants: false,
        begin: |request| Ok(Box::new(CalibrationStudy::new(request.decided)?)),
    },
    Entry {
        names: &[(
            paper::CLAIMS,
            "the paper's claims with forearms that agree with its voltages",
        )],
        declarations: &[
            ("hamana-participants.toml", conditioning::DECLARED),
            ("hamana.toml", EXPERIMENTS),
            ("hamana-wearers.toml", WEARERS),
        ],
        command: "flexor experiment hamana-claims",
        draws: 1..=10_000,
        devices: ("the claims are judged on simulated forearms", NATIVE),
        has_participants: false,
        begin: |request| Ok(Box::new(ClaimStudy::new(request.decided)?)),
    },
    Entry {
        names: &[(
            hamana2022::TWO_POINTS,
            "random forearms: which ones a second point helps",
        )],
        declarations: &[("hamana-population.toml", hamana2022::DECLARED)],
        command: "flexor experiment two-points",
        draws: 1..=100_000,
        devices: (
            "two-points computes simulated bodies without a device",
            NATIVE,
        ),
        has_participants: false,
        begin: |request| {
            let cells = Cells::load(None)?;
            let cells = cells
                .ok_or_else(|| anyhow::anyhow!("the embedded cells of two-points are missing"))?;
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
        devices: ("the test rig is simulated", SIMULATORS),
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
        // The paper has two subjects.
        draws: 2..=100_000,
        devices: ("the elbow is simulated", SIMULATORS),
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
            "reference force at the hand, produced by nine muscles",
        )],
        declarations: &[("sierotowicz.toml", sierotowicz2023::DECLARED)],
        command: "flexor experiment sierotowicz",
        draws: 1..=10_000,
        devices: (
            "the arm is simulated",
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
            "which of ten electrodes a wanted force needs",
        )],
        declarations: &[("electrode-choice.toml", electrodes::DECLARED)],
        command: "flexor experiment electrode-choice",
        // Each draw takes 400 kB.
        draws: 2..=2_000,
        devices: (
            "electrode-choice computes simulated bodies without a device",
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
        devices: ("a muscle is simulated for hours of its time", NATIVE),
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
            "buatier uses only the device's modulation, without the rest of the firmware",
            NATIVE,
        ),
        has_participants: false,
        begin: |request| Ok(Box::new(buatier2024::Run::new(request.decided)?)),
    },
];

fn hamana(request: &StudyRequest<'_>) -> anyhow::Result<Box<dyn Runnable>> {
    let kind = Kind::from_name(request.name)
        .ok_or_else(|| anyhow::anyhow!("there is no study {}", request.name))?;
    let whom = (request.wearer, request.ablation, request.participants);
    let study = paper::Study::new(kind, whom, request.decided, request.device.clone());
    let study = study.map_err(TwoPointsError::with_lines)?;
    // A problem with the device is reported before any draw.
    study.check_device()?;
    Ok(Box::new(study))
}

/// Name of a study with participants that is also the name of a declaration. The declaration is
/// used unless a participant or an ablation is given.
const CONTROL: &str = "hamana-4";

impl Entry {
    /// Returns the requested study. Returns `None` if the name belongs to a declaration, which the
    /// laboratory runs, or to nothing.
    ///
    /// # Errors
    /// Returns a message for the user if the options contradict each other.
    pub fn find(asked: &StudyRequest<'_>) -> Result<Option<&'static Self>, String> {
        let has = |entry: &&Self| entry.names.iter().any(|(name, _)| *name == asked.name);
        let found = ENTRIES.iter().find(has);
        let is_file = |text: &str| text.ends_with(".toml") || builtin_wearer(text).is_some();
        let has_word = asked.wearer.is_some_and(|wearer| !is_file(wearer));
        match found {
            Some(_) if asked.name == CONTROL && !asked.has_participant() => Ok(None),
            Some(entry) => Ok(Some(entry)),
            None if asked.ablation.is_some() || asked.participants.is_some() => Err(format!(
                "{} applies to {}, not to {}",
                match asked.ablation {
                    Some(_) => "--ablation",
                    None => "--participants",
                },
                Self::with_participants(),
                asked.name
            )),
            // A wearer file is used with a declaration.
            None if has_word => Err(format!(
                "--wearer of {} must be a wearer file (NAME.toml) or the name of a shipped one, \
                 not `{}`",
                asked.name,
                asked.wearer.unwrap_or_default()
            )),
            None => Ok(None),
        }
    }

    /// Lists the names of the studies that accept a participant, separated by commas.
    fn with_participants() -> String {
        let own = ENTRIES.iter().filter(|entry| entry.has_participants);
        let names: Vec<&str> = own
            .flat_map(|entry| entry.names)
            .map(|(name, _)| *name)
            .collect();
        names.join(", ")
    }

    /// Returns a message for the user for each option that this study does not allow: the wearer,
    /// the device, or the number of draws.
    #[must_use]
    pub fn mistakes(&self, asked: &StudyRequest<'_>) -> Vec<String> {
        let (why, devices) = self.devices;
        let mut mistakes = Vec::new();
        if asked.has_participant() && !self.has_participants {
            let name = asked.name;
            mistakes.push(format!(
                "{name} generates its own wearers; --participant, --participants, --wearer and --ablation do not apply to {name}"
            ));
        }
        if !devices.contains(asked.device) {
            let names: Vec<String> = devices.iter().map(DeviceName::to_argument).collect();
            mistakes.push(format!(
                "--device is {}; allowed: {} ({why})",
                asked.device,
                names.join(", ")
            ));
        }
        if let Some(draws) = asked.decided.1.filter(|value| !self.draws.contains(value)) {
            let (least, most) = (self.draws.start(), self.draws.end());
            mistakes.push(format!("--draws is {draws}; allowed: {least} to {most}"));
        }
        mistakes
    }

    /// Prepares the study and checks its device.
    ///
    /// # Errors
    /// Fails if the wearer, the ablation, the declaration or the device is unusable.
    pub fn begin(&self, asked: &StudyRequest<'_>) -> anyhow::Result<Box<dyn Runnable>> {
        (self.begin)(asked)
    }
}

impl StudyRequest<'_> {
    const fn has_participant(&self) -> bool {
        self.wearer.is_some() || self.ablation.is_some() || self.participants.is_some()
    }
}

/// Returns the name and the title of every study.
pub fn names_and_titles() -> impl Iterator<Item = (&'static str, &'static str)> {
    ENTRIES.iter().flat_map(|entry| entry.names).copied()
}

pub fn names() -> impl Iterator<Item = &'static str> {
    names_and_titles().map(|(name, _)| name)
}
