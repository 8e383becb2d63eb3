//! Session files: what is stimulated, how, and what the host streams.
//!
//! Lives here: reading a TOML file in people's units, converting it exactly to
//! the device's integers, checking it with the firmware's own validators, and
//! naming the line of whatever is wrong (numbers E4xx in [`Problem`]).
//! Not here: the link, running a session, the simulated body's behaviour.
//! In: a file. Out: a checked [`Session`] and the requests that configure a
//! device for it. The files in `host-tool/sessions/` show the format.

mod body;
mod channel;
mod decimal;
mod error;
mod fidelity;
mod joint;
mod muscle;
pub mod scene;
mod setpoints;
mod setup;
mod study;
mod table;
mod trigger;
mod wall;

use std::io::Read;
use std::path::Path;

use crate::record::Study;
use firmware::control::{JointSpec, SensorSource};
use firmware::haptics::WallSpec;
use firmware::link::Request;
use firmware::muscle::choice::Share;
use firmware::pulse::GroupSpec;
use firmware::safety::WearerSpec;
use toml::de::DeTable;

pub use body::BodySpec;
pub use channel::{Channel, Unit};
pub use error::{Problem, SessionError};
pub use joint::LawName;
pub use muscle::{Model, Muscle};
pub use setpoints::{Course, ForceCourse, Setpoint, Setpoints};
pub use study::LONGEST as LONGEST_TEXT;
use table::{Document, Table};
pub use trigger::SimulatedTrigger;

/// Longest session, µs: a day.
const MAX_DURATION_US: i64 = 86_400_000_000;

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
    /// What the host streams.
    pub setpoints: Setpoints,
    /// The window in which errors are scored, µs from the start.
    pub measure: Option<(u64, u64)>,
    /// The simulated wearer; no matter to a board.
    pub body: Option<BodySpec>,
    /// Edges of a simulated trigger input; no matter to a board.
    pub trigger: Option<SimulatedTrigger>,
    /// How far predicted forces may be from the best model's: what `"auto"` models
    /// are chosen for.
    pub tolerance: Share,
    /// Telemetry period, ms.
    pub telemetry_ms: u16,
    /// What is played differently from what the file says, for people: a
    /// frequency whose period is no whole number of microseconds.
    pub notes: Vec<String>,
    /// What only people know of the study, for its record.
    pub study: Study,
}

/// Telemetry period unless `[fidelity]` allows another, ms.
const TELEMETRY_MS: u16 = 10;

/// The longest session file read: what never ends must not fill the memory.
const LARGEST_BYTES: u64 = 1 << 20;

impl Session {
    /// Reads and checks a session file.
    ///
    /// # Errors
    /// [`SessionError`], which `miette` renders with the line concerned.
    pub fn load(path: impl AsRef<Path>) -> Result<Self, SessionError> {
        let path = path.as_ref();
        Self::parse(&path.display().to_string(), &Self::text(path)?)
    }

    /// Reads the text of a session file.
    ///
    /// # Errors
    /// It cannot be read, or is no session for its length.
    pub fn text(path: &Path) -> Result<String, SessionError> {
        let name = path.display().to_string();
        let unreadable = |why: &dyn std::fmt::Display| {
            let reason = format!("{name}: {why}");
            SessionError::nowhere(Problem::Unreadable { reason })
        };
        let file = std::fs::File::open(path).map_err(|e| unreadable(&e))?;
        let mut text = String::new();
        let mut some = file.take(LARGEST_BYTES + 1);
        some.read_to_string(&mut text).map_err(|e| unreadable(&e))?;
        if text.len() as u64 > LARGEST_BYTES {
            return Err(unreadable(&"more than 1 MiB; no session is that long"));
        }
        Ok(text)
    }

    /// Reads and checks the text of a session file called `name`.
    ///
    /// # Errors
    /// As [`Session::load`].
    pub fn parse(name: &str, text: &str) -> Result<Self, SessionError> {
        let doc = Document::new(name, text);
        let root = DeTable::parse(text).map_err(|e| {
            let reason = e.message().into();
            doc.error(Problem::Syntax { reason }, e.span().unwrap_or(0..0))
        })?;
        let session = Self::read(&Table::root(&doc, &root))?;
        doc.finish()?;
        Ok(session)
    }

    fn read(t: &Table<'_>) -> Result<Self, SessionError> {
        t.only(&[
            "title",
            "duration_s",
            "wearer",
            "channel",
            "group",
            "sync",
            "joint",
            "wall",
            "setpoints",
            "measure",
            "body",
            "simulated_trigger",
            "fidelity",
            "study",
        ])?;
        let title = t.text("title")?.required()?.to_owned();
        let duration = t.within("duration_s", 6, 1_000, MAX_DURATION_US)?;
        let duration_us = duration.required()? as u64; // not negative
        let mut notes = Vec::new();
        let setup = setup::read_setup(t, duration_us, &mut notes)?;
        let setpoints = setpoints::read_setpoints(t, &setup)?;
        let study = study::read_study(t, &setup.channels)?;
        let trigger = trigger::read_trigger(t, &setup.channels, duration_us)?;
        let mut session = Self {
            title,
            duration_us,
            wearer: setup.wearer,
            channels: setup.channels,
            groups: setup.groups,
            sync: setup.sync,
            joint: setup.joint.map(|(spec, _)| spec),
            wall: setup.wall,
            setpoints,
            measure: read_measure(t, duration_us)?,
            body: body::read_body(t)?,
            trigger,
            tolerance: Share::JUST_NOTICEABLE,
            telemetry_ms: TELEMETRY_MS,
            notes,
            study,
        };
        fidelity::settle(t, &mut session)?;
        Ok(session)
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
        all
    }

    /// Where the angle of its joint or of its wall is measured.
    #[must_use]
    pub fn sensor(&self) -> Option<SensorSource> {
        let joint = self.joint.as_ref().map(|joint| joint.sensor);
        joint.or(self.wall.map(|wall| wall.sensor))
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
    /// [`Problem::NoJoint`] if the session has none.
    pub fn with_law(mut self, law: LawName) -> Result<Self, SessionError> {
        let wanted = "another control law";
        let none = || SessionError::nowhere(Problem::NoJoint { wanted });
        let joint = self.joint.take().ok_or_else(none)?;
        self.joint = Some(joint::with_law(joint, law));
        Ok(self)
    }

    /// The channel with this number on the link, 0–9.
    #[must_use]
    pub fn channel(&self, index: u8) -> Option<&Channel> {
        self.channels.iter().find(|c| c.index() == index)
    }
}

/// Reads `[measure]`.
fn read_measure(root: &Table<'_>, duration_us: u64) -> Result<Option<(u64, u64)>, SessionError> {
    let Some(t) = root.table("measure")?.optional() else {
        return Ok(None);
    };
    t.only(&["from_s", "to_s"])?;
    let end = duration_us as i64; // at most a day
    let from = t.within("from_s", 6, 0, end)?.or(0);
    let to = t.within("to_s", 6, 0, end)?.or(end);
    if to <= from {
        let problem = Problem::NotInOrder {
            field: t.path_of("to_s"),
            given: t.given("to_s"),
            after: "`from_s`".into(),
        };
        return Err(t.error("to_s", problem));
    }
    Ok(Some((from as u64, to as u64))) // not negative
}
