//! `[body]`: the simulated wearer. A board has a real one and ignores it.

use hal_sim::body::FingerSpec;
use hal_sim::body::wearer::Participant;

use super::error::{Problem, SessionError};
use super::table::Table;

/// The simulated wearer of a session.
#[derive(Clone, PartialEq, Debug)]
pub enum BodySpec {
    /// An index finger.
    Finger(Box<FingerSpec>),
    /// A dummy load on every channel.
    Still {
        /// Ω.
        load_ohm: u32,
    },
}

#[derive(Clone, Copy)]
enum Kind {
    Finger,
    Still,
}

/// Reads `[body]`.
pub(super) fn read_body(root: &Table<'_>) -> Result<Option<BodySpec>, SessionError> {
    let Some(t) = root.table("body")?.optional() else {
        return Ok(None);
    };
    let kinds = [("finger", Kind::Finger), ("still", Kind::Still)];
    Ok(Some(match t.choice("kind", &kinds)?.required()? {
        Kind::Finger => BodySpec::Finger(Box::new(read_finger(&t)?)),
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
