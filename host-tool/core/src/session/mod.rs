//! Session files: the channels, pulses, controllers and setpoints of one run of the device.
//!
//! This module reads a TOML file in everyday units, converts its numbers exactly to the device's
//! integers, checks them with the firmware's own validators, and reports each error with its line
//! (numbers E4xx in [`Problem`]). The link, the running of a session and the behaviour of the
//! simulated wearer are elsewhere.
//!
//! Input: a session file. Output: a checked [`Session`] and the requests that configure a device
//! for it. The files in `host-tool/sessions/` show the format.

mod arm;
mod body;
mod channel;
mod channels;
mod control_fields;
mod edit;
mod fidelity;
mod fields;
mod hand;
mod hand_fields;
mod haptic;
mod hold;
mod joint;
mod law;
mod limb;
mod limits;
mod manual;
mod modulation;
mod modulation_fields;
mod muscle;
mod program;
mod schema;
mod setpoints;
mod setup;
mod shipped;
mod silent;
mod sites;
mod slopes;
mod study;
mod trigger;
mod verdict;
mod wall;
mod worn;

use std::path::Path;

use firmware::control::{JointSpec, SensorSource};
use firmware::haptics::WallSpec;
use firmware::link::Request;
use firmware::pulse::GroupSpec;
use firmware::safety::WearerSpec;
use firmware::units::Amplitude;
use hal_sim::body::FingerSpec;
use hal_sim::body::hand::FittedHand;

use crate::fields::document::Document;
use crate::fields::table::Table;
pub use crate::fields::{LONGEST as LONGEST_TEXT, Problem, SessionError, escape_control_chars};
use crate::fields::{parse, read_text};
use crate::suggestion::did_you_mean;

pub use crate::wearer::Unit;
pub use body::BodySpec;
pub use channel::Channel;
pub use edit::{noise_seed, set_field, unset_field};
pub use fidelity::Share;
use fields::{DAY_US, FILE};
pub use hand::{UnnamedHand, hand_body};
pub use law::LawName;
pub use limb::SessionLimb;
pub use manual::manual;
pub use modulation::{SessionJoint, joint_name, quartic_through};
pub use muscle::{Model, Muscle, level_name};
pub use program::Programs;
use program::{check_setpoints, read_programs};
pub use schema::schema;
use setpoints::read_setpoints;
pub use setpoints::{
    Bounds, Course, ForceCourse, Setpoint, Setpoints, WrenchCourse, newtons, possible_part,
};
pub use shipped::SHIPPED;
pub use study::{Electrode, Study};
pub use trigger::{Edges, SimulatedTrigger};
use worn::WearerContext;
pub use worn::{KEPT_AS, SessionWearer, WearerTexts, builtin_wearer_text, unreadable_wearer};

/// A checked session, which the firmware accepts and can arm: everything that a run needs.
#[derive(Clone, PartialEq, Debug)]
pub struct Session {
    /// Title of the session in reports.
    pub title: String,
    /// Duration of the stimulation, µs; 1 ms to a day.
    pub duration_us: u64,
    /// Limits of the wearer, which hold for all channels.
    pub wearer: WearerSpec,
    /// Channels of the session, sorted by number.
    pub channels: Vec<Channel>,
    /// Groups of channels that share a muscle.
    pub groups: Vec<GroupSpec>,
    /// Index on the link (0–9) of the channel whose first phases drive the sync output; `None`
    /// leaves the sync output idle.
    pub sync: Option<u8>,
    /// Joint whose angle the device controls; `None` if the session has no `[joint]`.
    pub joint: Option<JointSpec>,
    /// Virtual wall that the device makes tangible; never together with a joint.
    pub wall: Option<WallSpec>,
    /// Arm at whose hand the host asks for a force; never together with a joint or a wall.
    pub limb: Option<SessionLimb>,
    /// Joints whose muscles are stimulated according to the joint angle while the wearer holds an
    /// object; never together with a joint, a wall or a limb.
    pub modulations: Vec<SessionJoint>,
    /// Setpoints that the host streams to the device while the session runs.
    pub setpoints: Setpoints,
    /// Window in which tracking errors are computed, as its start and end in µs from the start of
    /// the session; `None` if the session is not scored.
    pub measure: Option<(u64, u64)>,
    /// Simulated wearer; `None` is a dummy load on every channel. A board ignores it.
    pub body: Option<BodySpec>,
    /// Edges of a simulated trigger input; a board ignores them.
    pub trigger: Option<SimulatedTrigger>,
    /// Largest accepted error of the muscle quantities that the session uses. For a muscle with
    /// `model = "auto"`, the cheapest model within this tolerance is chosen.
    pub tolerance: Share,
    /// Whether the file sets the tolerance itself, in `[fidelity]`. Only then is a tolerance that
    /// no model meets an error.
    pub has_fidelity: bool,
    /// Whether `[fidelity]` may choose the period of the control law: true if the file leaves the
    /// period out and the control law has no model of its wearer.
    pub law_is_free: bool,
    /// Duration of the trial that chooses the models, µs: the session is simulated from its start
    /// up to this time.
    pub try_us: u64,
    /// Time between two telemetry samples of the device, ms.
    pub telemetry_ms: u16,
    /// Notes for the user on differences between the file and the output of the device, for example
    /// a frequency whose period is not a whole number of microseconds, or a channel that nothing
    /// drives.
    pub notes: Vec<String>,
    /// Facts that a publication must report and that only people know. The record of a run keeps
    /// them.
    pub study: Study,
    /// Wearer file from which the wearer's numbers come, if the session names a file.
    pub worn: Option<SessionWearer>,
}

/// Default duration of the trial that chooses the models, µs. A longer session is simulated only up
/// to this time.
const TRY_US: u64 = 60_000_000;

/// Telemetry period of every session, ms.
const TELEMETRY_MS: u16 = 10;

impl Session {
    /// Reads and checks the session file at `path`, or the built-in session of that name.
    ///
    /// # Errors
    /// [`SessionError`], which lists every error with its line. `miette` renders it.
    pub fn load(path: impl AsRef<Path>) -> Result<Self, SessionError> {
        let path = path.as_ref();
        let name = path.display().to_string();
        Self::parse_with_wearers(&name, &Self::text(path)?, &|file| {
            Self::wearer_text(path, file)
        })
    }

    /// Returns the text of the wearer file that the session at `path` names as `file`. If the
    /// session belongs to a record, this is the copy of the wearer file in the record. If it is a
    /// built-in session, this is a built-in wearer file.
    ///
    /// # Errors
    /// E650 if the wearer file cannot be read.
    pub fn wearer_text(path: &Path, file: &str) -> Result<String, SessionError> {
        match shipped::builtin_session(path) {
            Some(_) => builtin_wearer_text(file),
            None => worn::read_wearer_text(path.parent().unwrap_or(Path::new("")), file),
        }
    }

    /// Reads the text of a session file. If there is no such file and `path` is the name of a
    /// built-in session ([`SHIPPED`]), returns the text of that session.
    ///
    /// # Errors
    /// The file cannot be read, or is too long for a session.
    pub fn text(path: &Path) -> Result<String, SessionError> {
        if let Some(text) = shipped::builtin_session(path) {
            return Ok(text.to_owned());
        }
        read_text(path).map_err(|reason| {
            let typed = path.to_string_lossy();
            let names = SHIPPED
                .iter()
                .map(|(file, _)| file.trim_end_matches(".toml"));
            let reason = reason + &did_you_mean(typed.trim_end_matches(".toml"), names);
            SessionError::without_place(Problem::Unreadable { reason })
        })
    }

    /// Reads and checks the text of a session that has no folder. `name` is its file name in error
    /// messages. If the session names a wearer file, this must be a built-in one.
    ///
    /// # Errors
    /// As [`Session::load`].
    pub fn parse(name: &str, text: &str) -> Result<Self, SessionError> {
        Self::parse_with_wearers(name, text, &builtin_wearer_text)
    }

    /// Reads and checks the text of a session. `name` is its file name in error messages. `texts`
    /// returns the text of the wearer file that the session names.
    ///
    /// # Errors
    /// As [`Session::load`].
    pub fn parse_with_wearers(
        name: &str,
        text: &str,
        texts: WearerTexts<'_>,
    ) -> Result<Self, SessionError> {
        parse(name, text, &FILE, |doc, t| Self::read(doc, t, texts))
    }

    /// Reads the session and reports all its errors to `doc`. After an error, the result is `None`
    /// or an incomplete session, which must not be used.
    fn read(doc: &Document, t: &Table<'_>, texts: WearerTexts<'_>) -> Option<Self> {
        let duration_us = t.integer_or("duration_s", DAY_US as u64); // not negative
        let mut notes = Vec::new();
        let person = WearerContext::read(doc, t, texts);
        let setup = setup::read_setup(t, &person, duration_us, &mut notes);
        haptic::check_haptic_range(t, &person, &setup.channels);
        let has_joint = t.has("joint");
        let setpoints = t.optional_table("setpoints", |s| {
            read_setpoints(s, &setup, has_joint, duration_us)
        });
        let programs = read_programs(t, &setup, duration_us);
        if let Some(setpoints) = t.table("setpoints") {
            check_setpoints(setpoints, &programs);
        }
        let setpoints = setpoints.map(|own| match own {
            Some(own) => Setpoints { programs, ..own },
            None => Setpoints::from_programs(programs, setup.wearer.host_timeout_ms),
        });
        let study = t.optional_table("study", |s| study::read_study(s, &setup.channels));
        let trigger = t.optional_table("simulated_trigger", |s| {
            trigger::read_trigger(s, &setup.channels, duration_us)
        });
        let measure = t.optional_table("measure", |m| read_measure(m, duration_us));
        let body = t.optional_table("body", |b| {
            body::read_body(b, &setup.channels.list, &person)
        });
        let mut session = Self {
            title: t.text("title")?.to_owned(),
            duration_us,
            wearer: setup.wearer,
            channels: setup.channels.list,
            groups: setup.groups,
            sync: setup.sync,
            joint: setup.joint,
            wall: setup.wall,
            limb: setup.limb,
            modulations: setup.modulations,
            setpoints: setpoints?,
            measure: measure?,
            body: body?,
            trigger: trigger?,
            tolerance: Share::JUST_NOTICEABLE,
            has_fidelity: false,
            law_is_free: false,
            try_us: TRY_US,
            telemetry_ms: TELEMETRY_MS,
            notes,
            study: study?.unwrap_or_default(),
            worn: person.worn,
        };
        if doc.is_valid() {
            silent::note_silent_channels(&mut session);
            fidelity::read(t, &mut session);
        }
        Some(session)
    }

    /// Returns notes on how the wearer's amplitude rise delays the session's amplitudes, one line
    /// per effect: how long the slowest step of a course takes, and by how much the amplitude of a
    /// control law may rise from burst to burst.
    #[must_use]
    pub fn rise_notes(&self) -> Vec<String> {
        slopes::notes(self)
    }

    /// Returns the requests that configure a device, in an order in which the device can check each
    /// request on arrival.
    #[must_use]
    pub fn setup_requests(&self) -> Vec<Request> {
        let mut requests = vec![Request::Clear, Request::Wearer(self.wearer)];
        requests.extend(self.channels.iter().map(|c| Request::Channel {
            channel: c.index(),
            spec: c.spec,
        }));
        if !self.groups.is_empty() {
            // The checks allow no more groups than the link holds.
            requests.push(Request::Groups(self.groups.iter().copied().collect()));
        }
        if let Some(channel) = self.sync {
            let channel = Some(channel);
            requests.push(Request::Sync { channel });
        }
        requests.extend(self.channels.iter().filter_map(|c| {
            let (channel, spec) = (c.index(), c.muscle.as_ref()?.spec());
            Some(Request::Muscle { channel, spec })
        }));
        requests.extend(self.channels.iter().filter_map(|c| {
            let channel = c.index();
            c.force.map(|spec| Request::ForceControl { channel, spec })
        }));
        requests.extend(self.joint.clone().map(Request::Joint));
        requests.extend(self.wall.map(Request::Wall));
        if let Some(limb) = &self.limb {
            requests.push(Request::Limb(limb.spec));
            requests.extend(limb.lines.iter().cloned().map(Request::Line));
        }
        let joints = self.modulations.iter();
        requests.extend(joints.map(|joint| Request::Modulation(joint.spec)));
        requests
    }

    /// Returns the source of the measured angle of the joint or of the wall; `None` if the session
    /// has neither.
    #[must_use]
    pub fn sensor(&self) -> Option<SensorSource> {
        let joint = self.joint.as_ref().map(|joint| joint.sensor);
        joint.or(self.wall.map(|wall| wall.sensor))
    }

    /// Returns whether any channel has a train that ends after a fixed number of bursts
    /// (`repeats`).
    #[must_use]
    pub fn has_pulse_count(&self) -> bool {
        let mut channels = self.channels.iter();
        channels.any(|channel| channel.spec.train.repeats > 0)
    }

    /// Returns the amplitude limit of the channel with this number (from 1), or `None` if the
    /// session does not use the channel.
    #[must_use]
    pub fn channel_limit(&self, number: u8) -> Option<Amplitude> {
        let mut channels = self.channels.iter();
        let channel = channels.find(|channel| channel.number == number)?;
        Some(channel.spec.limit)
    }

    /// Returns the constant amplitudes that a device must receive before `Start` if a channel has a
    /// train of a fixed number of bursts. Such a train counts its bursts from the start on, so an
    /// amplitude that arrives later would miss some of them. Returns nothing if no channel has such
    /// a train.
    pub fn amplitudes_before_start(&self) -> impl Iterator<Item = Setpoint> + '_ {
        let is_counted = self.has_pulse_count();
        let beside = self.setpoints.accompanying_at(0);
        beside.filter(move |setpoint| is_counted && matches!(setpoint, Setpoint::Amplitudes(_)))
    }

    /// Returns the requests for the changes of model level that are due after `from_us` and until
    /// `to_us`, both in µs from the start.
    pub fn level_changes(&self, from_us: u64, to_us: u64) -> impl Iterator<Item = Request> + '_ {
        let due = move |at: u64| from_us < at && at <= to_us;
        self.channels.iter().flat_map(move |c| {
            let changes = c.muscle.iter().flat_map(|muscle| &muscle.changes);
            let channel = c.index();
            changes
                .filter(move |(at, _)| due(*at))
                .map(move |&(_, level)| Request::MuscleLevel { channel, level })
        })
    }

    /// Returns the session with another control law for its joint, and with the default gains,
    /// period and cutoff of that law.
    ///
    /// # Errors
    /// [`Problem::NoJoint`] if the session has no joint; [`Problem::NeverTried`] if the wearer
    /// model's stiffness and flexion torque are a combination for which the law was never tried.
    pub fn with_law(mut self, law: LawName) -> Result<Self, SessionError> {
        let wanted = "another controller";
        let none = || SessionError::without_place(Problem::NoJoint { wanted });
        let joint = self.joint.take().ok_or_else(none)?;
        self.joint = Some(law::with_law(joint, law)?);
        Ok(self)
    }

    /// Returns the simulated finger; `None` if the session simulates another wearer or none.
    #[must_use]
    pub fn finger(&self) -> Option<&FingerSpec> {
        match &self.body {
            Some(BodySpec::Finger(finger)) => Some(finger),
            _ => None,
        }
    }

    /// Returns the simulated hand; `None` if the session simulates another wearer or none.
    #[must_use]
    pub fn hand(&self) -> Option<&FittedHand> {
        match &self.body {
            Some(BodySpec::Hand(hand)) => Some(hand),
            _ => None,
        }
    }

    /// Returns the time step of the simulated arm, ms; `None` if the session simulates another
    /// wearer or none.
    #[must_use]
    pub const fn arm_step_ms(&self) -> Option<u32> {
        match &self.body {
            Some(BodySpec::Arm { step_ms, .. }) => Some(*step_ms),
            _ => None,
        }
    }

    /// Returns the channel with this index on the link (0–9), or `None` if the session does not use
    /// the channel.
    #[must_use]
    pub fn channel(&self, index: u8) -> Option<&Channel> {
        self.channels.iter().find(|c| c.index() == index)
    }
}

/// Reads `[measure]` as start and end in µs; the end defaults to the session's duration.
fn read_measure(t: &Table<'_>, duration_us: u64) -> Option<(u64, u64)> {
    let from = t.time("from_s", 0, duration_us);
    let to = match t.has("to_s") {
        true => t.time("to_s", 0, duration_us)?,
        false => duration_us,
    };
    if from.is_some_and(|from| to <= from) {
        t.report_not_after("to_s", "`from_s`".into());
        return None;
    }
    Some((from?, to))
}
