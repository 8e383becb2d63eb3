//! `[setpoints] kind = "endpoint-force"`: the arm that the device drives, and its posture.

use firmware::control::{EndpointSpec, PostureSpec};
use firmware::limb::{AXES, AXIS_NAMES, LINES, Lines};

use super::channels::Channels;
use super::worn::WearerContext;
use crate::fields::decimal::format_range;
use crate::fields::error::Problem;
use crate::fields::table::Table;

/// The arm of a session whose setpoints are forces at the hand.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct SessionLimb {
    /// Bones of the arm, its posture, and the period at which the device recomputes the recruitment
    /// of its muscles.
    pub spec: EndpointSpec,
    /// Line of action of the muscle under each channel, sorted by channel.
    pub lines: Lines,
}

impl SessionLimb {
    /// Returns whether the host measures the posture while the session runs; otherwise the file
    /// fixes it.
    #[must_use]
    pub const fn is_measured(&self) -> bool {
        matches!(self.spec.posture, PostureSpec::Measured { .. })
    }
}

/// Setpoint rates that a file may ask for, Hz. The device recomputes the recruitment of the muscles
/// at the same rate.
const RATES_HZ: [f64; 2] = [200.0, 20.0];

/// Reads the arm from the setpoints and the wearer file, and reports all errors. Returns `None` if
/// the setpoints are not forces at the hand.
pub(super) fn read_limb(
    root: &Table<'_>,
    person: &WearerContext,
    channels: &Channels,
) -> Option<SessionLimb> {
    let t = root.table("setpoints")?;
    if t.word("kind") != "endpoint-force" {
        return None;
    }
    let rate_hz = t.real("rate_hz");
    let is_rate = rate_hz.is_some_and(|hz| RATES_HZ.contains(&hz));
    if rate_hz.is_some() && !is_rate {
        t.report_out_of_range("rate_hz", "200 or 20 Hz for a force at the hand".into());
    }
    if person.is_unknown() {
        return None; // told
    }
    let Some(limb) = person
        .worn
        .as_ref()
        .and_then(|worn| worn.wearer.limb.as_ref())
    else {
        t.report("kind", Problem::NoLimb {});
        return None;
    };
    let ranges = &limb.ranges_mdeg;
    let posture = match t.table("posture_deg") {
        None if t.has("posture_deg") => return None,
        None => PostureSpec::Measured {
            stale_after_ms: t.integer("stale_after_ms"),
        },
        Some(p) => {
            if t.has("stale_after_ms") {
                let other = "posture_deg".into();
                t.report("stale_after_ms", Problem::SaidTwice { other });
            }
            PostureSpec::Fixed(read_posture(p, ranges)?)
        }
    };
    let lines = limb.lines.iter().filter_map(|line| {
        let mut list = channels.list.iter();
        let channel = list.find(|channel| channel.number == line.channel)?;
        let threshold = channels.electrode(channel.number)?.motor_threshold;
        let [_, most] = channels.usable_range(channel)?;
        Some(line.spec(threshold, most))
    });
    let lines: Lines = lines.take(LINES).collect();
    if lines.is_empty() {
        if channels.all_valid() {
            t.report("kind", Problem::NoLine {});
        }
        return None;
    }
    let recruit_ms = match rate_hz {
        Some(hz) if is_rate => (1e3 / hz).round() as u8, // 5 or 50
        _ => return None,
    };
    let spec = EndpointSpec {
        offsets_um: limb.offsets_um,
        ranges_mdeg: *ranges,
        recruit_ms,
        posture,
    };
    Some(SessionLimb { spec, lines })
}

/// Reads the nine angles of a posture, in 0.01°. Angles that are left out are 0. Reports angles
/// outside `ranges`, which are in 0.001°.
fn read_posture(p: &Table<'_>, ranges: &[(i32, i32); AXES]) -> Option<[i16; AXES]> {
    if !p.is_valid() {
        return None;
    }
    let mut is_within = true;
    let mut angles = [0; AXES];
    for ((to, name), &(low, high)) in angles.iter_mut().zip(AXIS_NAMES).zip(ranges) {
        let centideg: i16 = p.integer(name);
        if !(low..=high).contains(&(i32::from(centideg) * 10)) {
            let range = format_range(low.into(), high.into(), 3);
            p.report_out_of_range(name, format!("{range}, this wearer's range"));
            is_within = false;
        }
        *to = centideg;
    }
    is_within.then_some(angles)
}
