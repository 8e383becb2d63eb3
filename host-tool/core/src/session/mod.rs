//! Session files: what is stimulated, how, and what the host streams.
//!
//! Lives here: reading a TOML file in people's units, converting it exactly to
//! the device's integers, checking it with the firmware's own validators, and
//! naming the line of whatever is wrong (numbers E4xx in [`Problem`]).
//! Not here: the link, running a session, the simulated body's behaviour.
//! In: a file. Out: a checked [`Session`] and the requests that configure a
//! device for it. The files in `host-tool/sessions/` show the format.

mod arm;
mod body;
mod channel;
mod channels;
mod control_fields;
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

use crate::fields::document::Document;
use crate::fields::table::Table;
pub use crate::fields::{LONGEST as LONGEST_TEXT, Problem, SessionError, visible};
use crate::fields::{parse, text_of};
use crate::suggestion::did_you_mean;

pub use crate::wearer::Unit;
pub use body::BodySpec;
pub use channel::Channel;
pub use fidelity::Share;
use fields::{DAY_US, FILE};
pub use hand::{UnnamedHand, hand_body};
pub use law::LawName;
pub use limb::SessionLimb;
pub use manual::manual;
pub use modulation::{SessionJoint, joint_name, quartic_through};
pub use muscle::{Model, Muscle, rung_name};
pub use program::Programs;
use program::{read_programs, tell_beside};
pub use schema::schema;
use setpoints::read_setpoints;
pub use setpoints::{
    Bounds, Course, ForceCourse, Setpoint, Setpoints, WrenchCourse, nearest, newtons,
};
pub use shipped::SHIPPED;
pub use study::{Electrode, Study};
pub use trigger::{Edges, SimulatedTrigger};
use worn::Person;
pub use worn::{KEPT_AS, WearerTexts, Worn, no_wearer, shipped_text};

/// A session that the firmware will arm: everything a run needs.
#[derive(Clone, PartialEq, Debug)]
pub struct Session {
    /// What the session is called in reports.
    pub title: String,
    /// How long it stimulates, µs; 1 ms to a day.
    pub duration_us: u64,
    /// The wearer's limits.
    pub wearer: WearerSpec,
    /// Its channels, by rising number.
    pub channels: Vec<Channel>,
    /// Channels that share a muscle.
    pub groups: Vec<GroupSpec>,
    /// The channel on the link (0–9) that drives sync out.
    pub sync: Option<u8>,
    /// The joint that the device controls.
    pub joint: Option<JointSpec>,
    /// The virtual wall that the device makes felt; not beside a joint.
    pub wall: Option<WallSpec>,
    /// The arm whose hand exerts the wanted force; not beside a joint or a wall.
    pub limb: Option<SessionLimb>,
    /// The joints whose stimulation follows their angles while an object is held; not
    /// beside any of these.
    pub modulations: Vec<SessionJoint>,
    /// What the host streams.
    pub setpoints: Setpoints,
    /// The window in which errors are scored, µs from the start.
    pub measure: Option<(u64, u64)>,
    /// The simulated wearer; no matter to a board.
    pub body: Option<BodySpec>,
    /// Edges of a simulated trigger input; no matter to a board.
    pub trigger: Option<SimulatedTrigger>,
    /// How far what the session uses may be off: what `"auto"` models are chosen for.
    pub tolerance: Share,
    /// Whether the file says so: then a tolerance that no model meets is refused.
    pub has_fidelity: bool,
    /// Whether `[fidelity]` may choose the law's period: the file leaves it out, and the
    /// law knows nothing of its wearer.
    pub law_is_free: bool,
    /// How much of it is tried, µs from the start.
    pub try_us: u64,
    /// Telemetry period, ms.
    pub telemetry_ms: u16,
    /// What is played differently from what the file says, for people: a frequency whose
    /// period is no whole number of microseconds, a channel that nothing drives.
    pub notes: Vec<String>,
    /// What only people know of the study, for its record.
    pub study: Study,
    /// Whose file its wearer's numbers are from, if it names one.
    pub worn: Option<Worn>,
}

/// How much of a longer session is tried, unless the file says so, µs.
const TRY_US: u64 = 60_000_000;

/// Telemetry period, ms.
const TELEMETRY_MS: u16 = 10;

impl Session {
    /// Reads and checks a session file.
    ///
    /// # Errors
    /// [`SessionError`], which `miette` renders with every line concerned.
    pub fn load(path: impl AsRef<Path>) -> Result<Self, SessionError> {
        let path = path.as_ref();
        let name = path.display().to_string();
        Self::parse_beside(&name, &Self::text(path)?, &|file| {
            Self::wearer_text(path, file)
        })
    }

    /// The text of the wearer file that the session at `path` names; of a record's session
    /// of the one kept beside it.
    ///
    /// # Errors
    /// E650.
    pub fn wearer_text(path: &Path, file: &str) -> Result<String, SessionError> {
        match shipped::shipped(path) {
            Some(_) => shipped_text(file),
            None => worn::text_beside(path.parent().unwrap_or(Path::new("")), file),
        }
    }

    /// Reads the text of a session file, or of a session of the program where there is no
    /// such file and `path` is its name ([`SHIPPED`]).
    ///
    /// # Errors
    /// It cannot be read, or is no session for its length.
    pub fn text(path: &Path) -> Result<String, SessionError> {
        if let Some(text) = shipped::shipped(path) {
            return Ok(text.to_owned());
        }
        text_of(path).map_err(|reason| {
            let typed = path.to_string_lossy();
            let names = SHIPPED
                .iter()
                .map(|(file, _)| file.trim_end_matches(".toml"));
            let reason = reason + &did_you_mean(typed.trim_end_matches(".toml"), names);
            SessionError::nowhere(Problem::Unreadable { reason })
        })
    }

    /// Reads and checks the text of a session file called `name`, of no folder: its wearer
    /// is one of the program's.
    ///
    /// # Errors
    /// As [`Session::load`].
    pub fn parse(name: &str, text: &str) -> Result<Self, SessionError> {
        Self::parse_beside(name, text, &shipped_text)
    }

    /// The same where `texts` knows the wearer file that it names.
    ///
    /// # Errors
    /// As [`Session::load`].
    pub fn parse_beside(
        name: &str,
        text: &str,
        texts: WearerTexts<'_>,
    ) -> Result<Self, SessionError> {
        parse(name, text, &FILE, |doc, t| Self::read(doc, t, texts))
    }

    /// Reads what can be read; nothing, or not a true session, if anything is told.
    fn read(doc: &Document, t: &Table<'_>, texts: WearerTexts<'_>) -> Option<Self> {
        let duration_us = t.whole_or("duration_s", DAY_US as u64); // not negative
        let mut notes = Vec::new();
        let person = Person::read(doc, t, texts);
        let setup = setup::read_setup(t, &person, duration_us, &mut notes);
        haptic::tell(t, &person, &setup.channels);
        let has_joint = t.has("joint");
        let setpoints = t.part("setpoints", |s| {
            read_setpoints(s, &setup, has_joint, duration_us)
        });
        let programs = read_programs(t, &setup, duration_us);
        if let Some(setpoints) = t.table("setpoints") {
            tell_beside(setpoints, &programs);
        }
        let setpoints = setpoints.map(|own| match own {
            Some(own) => Setpoints { programs, ..own },
            None => Setpoints::of_programs(programs, setup.wearer.host_timeout_ms),
        });
        let study = t.part("study", |s| study::read_study(s, &setup.channels));
        let trigger = t.part("simulated_trigger", |s| {
            trigger::read_trigger(s, &setup.channels, duration_us)
        });
        let measure = t.part("measure", |m| read_measure(m, duration_us));
        let body = t.part("body", |b| {
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
        if doc.is_sound() {
            silent::note(&mut session);
            fidelity::read(t, &mut session);
        }
        Some(session)
    }

    /// What the wearer's rise makes of the amplitudes, a line each: how long the longest
    /// step of a course takes, and by how much a control law's amplitudes may rise from
    /// burst to burst.
    #[must_use]
    pub fn rise_notes(&self) -> Vec<String> {
        slopes::notes(self)
    }

    /// The requests that configure a device, in an order in which each can be
    /// checked as it comes.
    #[must_use]
    pub fn requests(&self) -> Vec<Request> {
        let mut all = vec![Request::Clear, Request::Wearer(self.wearer)];
        all.extend(self.channels.iter().map(|c| Request::Channel {
            channel: c.index(),
            spec: c.spec,
        }));
        if !self.groups.is_empty() {
            // As many as the link holds: checked.
            all.push(Request::Groups(self.groups.iter().copied().collect()));
        }
        if let Some(channel) = self.sync {
            let channel = Some(channel);
            all.push(Request::Sync { channel });
        }
        all.extend(self.channels.iter().filter_map(|c| {
            let (channel, spec) = (c.index(), c.muscle.as_ref()?.spec());
            Some(Request::Muscle { channel, spec })
        }));
        all.extend(self.channels.iter().filter_map(|c| {
            let channel = c.index();
            c.force.map(|spec| Request::ForceControl { channel, spec })
        }));
        all.extend(self.joint.clone().map(Request::Joint));
        all.extend(self.wall.map(Request::Wall));
        if let Some(limb) = &self.limb {
            all.push(Request::Limb(limb.spec));
            all.extend(limb.lines.iter().cloned().map(Request::Line));
        }
        let joints = self.modulations.iter();
        all.extend(joints.map(|joint| Request::Modulation(joint.spec)));
        all
    }

    /// Where the angle of its joint or of its wall is measured.
    #[must_use]
    pub fn sensor(&self) -> Option<SensorSource> {
        let joint = self.joint.as_ref().map(|joint| joint.sensor);
        joint.or(self.wall.map(|wall| wall.sensor))
    }

    /// Whether a channel has a train of a fixed number of pulses.
    #[must_use]
    pub fn is_counted(&self) -> bool {
        let mut channels = self.channels.iter();
        channels.any(|channel| channel.spec.train.repeats > 0)
    }

    /// The limit of a channel, from 1; none where it is not in use.
    #[must_use]
    pub fn limit_of(&self, number: u8) -> Option<Amplitude> {
        let mut channels = self.channels.iter();
        let channel = channels.find(|channel| channel.number == number)?;
        Some(channel.spec.limit)
    }

    /// Amplitudes that a device needs before `Start`: a train of a fixed number of pulses
    /// counts from its first slot on. Nothing where no channel has one.
    pub fn counted_from_start(&self) -> impl Iterator<Item = Setpoint> + '_ {
        let is_counted = self.is_counted();
        let beside = self.setpoints.with(0);
        beside.filter(move |setpoint| is_counted && matches!(setpoint, Setpoint::Amplitudes(_)))
    }

    /// The changes of rung due after `from_us` and until `to_us` from the
    /// start, both in µs.
    pub fn rungs(&self, from_us: u64, to_us: u64) -> impl Iterator<Item = Request> + '_ {
        let due = move |at: u64| from_us < at && at <= to_us;
        self.channels.iter().flat_map(move |c| {
            let changes = c.muscle.iter().flat_map(|muscle| &muscle.changes);
            let channel = c.index();
            changes
                .filter(move |(at, _)| due(*at))
                .map(move |&(_, rung)| Request::Rung { channel, rung })
        })
    }

    /// The same session under another control law, with that law's default
    /// gains, period and cutoff.
    ///
    /// # Errors
    /// [`Problem::NoJoint`] if the session has none; [`Problem::NeverTried`] if this law
    /// was not on such a wearer.
    pub fn with_law(mut self, law: LawName) -> Result<Self, SessionError> {
        let wanted = "another control law";
        let none = || SessionError::nowhere(Problem::NoJoint { wanted });
        let joint = self.joint.take().ok_or_else(none)?;
        self.joint = Some(law::with_law(joint, law)?);
        Ok(self)
    }

    /// Its simulated finger, if it has one.
    #[must_use]
    pub fn finger(&self) -> Option<&FingerSpec> {
        match &self.body {
            Some(BodySpec::Finger(finger)) => Some(finger),
            _ => None,
        }
    }

    /// The channel with this number on the link, 0–9.
    #[must_use]
    pub fn channel(&self, index: u8) -> Option<&Channel> {
        self.channels.iter().find(|c| c.index() == index)
    }
}

/// Reads `[measure]`.
fn read_measure(t: &Table<'_>, duration_us: u64) -> Option<(u64, u64)> {
    let from = t.time("from_s", 0, duration_us);
    let to = match t.has("to_s") {
        true => t.time("to_s", 0, duration_us)?,
        false => duration_us,
    };
    if from.is_some_and(|from| to <= from) {
        t.not_after("to_s", "`from_s`".into());
        return None;
    }
    Some((from?, to))
}
