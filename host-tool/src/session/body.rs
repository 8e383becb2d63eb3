//! `[body]`: the simulated wearer. A board has a real one and ignores it.

use hal_sim::body::elbow::Approach;
use hal_sim::body::wearer::Participant;
use hal_sim::body::{ElbowSpec, FingerSpec};

use super::error::{Problem, SessionError};
use super::table::Table;

/// The simulated wearer of a session.
#[derive(Clone, PartialEq, Debug)]
pub enum BodySpec {
    /// An index finger.
    Finger(Box<FingerSpec>),
    /// A forearm and the person who moves it.
    Elbow(Box<ElbowSpec>),
    /// A dummy load on every channel.
    Still {
        /// Ω.
        load_ohm: u32,
    },
}

#[derive(Clone, Copy)]
enum Kind {
    Finger,
    Elbow,
    Still,
}

/// Reads `[body]`.
pub(super) fn read_body(root: &Table<'_>) -> Result<Option<BodySpec>, SessionError> {
    let Some(t) = root.table("body")?.optional() else {
        return Ok(None);
    };
    let kinds = [
        ("finger", Kind::Finger),
        ("elbow", Kind::Elbow),
        ("still", Kind::Still),
    ];
    Ok(Some(match t.choice("kind", &kinds)?.required()? {
        Kind::Finger => BodySpec::Finger(Box::new(read_finger(&t)?)),
        Kind::Elbow => BodySpec::Elbow(Box::new(read_elbow(&t)?)),
        Kind::Still => {
            t.only(&["kind", "load_ohm"])?;
            let load_ohm = t.within("load_ohm", 0, 1, 1_000_000)?.or(2_000);
            BodySpec::Still {
                load_ohm: load_ohm as u32, // just checked
            }
        }
    }))
}

/// A participant's finger with its points on the channels that the file names,
/// whether or not the session uses them.
fn read_finger(t: &Table<'_>) -> Result<FingerSpec, SessionError> {
    const POINTS: [&str; 3] = ["flexor_a", "flexor_b", "extensor"];
    t.only(&["kind", "participant", POINTS[0], POINTS[1], POINTS[2]])?;
    let participants = [
        ("P", Participant::P),
        ("Q", Participant::Q),
        ("S", Participant::S),
    ];
    let participant = t.choice("participant", &participants)?.required()?;
    let mut spec = FingerSpec::participant(participant);
    let mut taken = Vec::new();
    let sites = [&mut spec.flexor_a, &mut spec.flexor_b, &mut spec.extensor];
    for (name, site) in POINTS.into_iter().zip(sites) {
        let channel = t.channel(name)?.required()?;
        if taken.contains(&channel) {
            let field = "body".into();
            return Err(t.error(name, Problem::ChannelTwice { field, channel }));
        }
        taken.push(channel);
        site.channel = usize::from(channel) - 1; // 1–10
    }
    Ok(spec)
}

/// An elbow with its muscles on the channels that the file names; numbers left
/// out keep [`ElbowSpec::default`].
fn read_elbow(t: &Table<'_>) -> Result<ElbowSpec, SessionError> {
    t.only(&[
        "kind",
        "triceps",
        "biceps",
        "damping_nm_s_per_rad",
        "start_deg",
        "push_nm",
        "approaches",
    ])?;
    let mut spec = ElbowSpec::default();
    let (triceps, biceps) = (
        t.channel("triceps")?.required()?,
        t.channel("biceps")?.required()?,
    );
    if triceps == biceps {
        let (field, channel) = ("body".into(), biceps);
        return Err(t.error("biceps", Problem::ChannelTwice { field, channel }));
    }
    spec.triceps.channel = usize::from(triceps) - 1; // 1–10
    spec.biceps.channel = usize::from(biceps) - 1;
    let real = |name, default: f64, min: i64, max: i64| {
        let value = t.real(name)?.or(default);
        if (min as f64..=max as f64).contains(&value) {
            Ok(value)
        } else {
            Err(t.not_within(name, min, max, 0))
        }
    };
    let person = &mut spec.person;
    spec.damping_nm_s_per_rad = real("damping_nm_s_per_rad", spec.damping_nm_s_per_rad, 0, 100)?;
    person.start_deg = real("start_deg", person.start_deg, 0, 145)?;
    person.push_nm = real("push_nm", person.push_nm, 0, 100)?;
    for item in t.tables("approaches")?.required()? {
        let approach = read_approach(&item)?;
        let before = person.approaches.last();
        if before.is_some_and(|b| b.at_s + b.for_s > approach.at_s) {
            let problem = Problem::NotInOrder {
                field: item.path_of("at_s"),
                given: item.given("at_s"),
                after: "the end of the approach before it".into(),
            };
            return Err(item.error("at_s", problem));
        }
        person.approaches.push(approach);
    }
    Ok(spec)
}

fn read_approach(t: &Table<'_>) -> Result<Approach, SessionError> {
    t.only(&["at_s", "speed_deg_per_s", "for_s"])?;
    const DAY_MS: i64 = 86_400_000;
    let ms = |name, least| Ok(t.within(name, 3, least, DAY_MS)?.required()? as f64 * 1e-3);
    let speed = t.within("speed_deg_per_s", 3, 1_000, 360_000)?.required()?;
    Ok(Approach {
        at_s: ms("at_s", 0)?,
        speed_deg_per_s: speed as f64 * 1e-3,
        for_s: ms("for_s", 1)?,
    })
}
