//! `[wall]`: a virtual wall on the device.

use firmware::control::{SensorSource, SpecError};
use firmware::haptics::{CoContraction, PreWall, Side, Wall, WallError, WallSpec};
use firmware::units::{Amplitude, OutOfRange};

use super::channel::Channel;
use super::error::{Problem, SessionError};
use super::joint::{
    STALE_AFTER_MS, file_field, find, not_under_force, read_amplitude, read_sensor,
};
use super::table::Table;

/// Calibration of the board's angle sensor unless the file says otherwise: 20
/// codes a degree, so that an elbow's 0–150° and 20° on either side can be told.
const ADC_CODES: (u16, u16) = (500, 2500);
/// Cutoff of the damping's differentiator unless the file says otherwise, mHz.
const CUTOFF_MHZ: u32 = 10_000;

const FIELDS: [&str; 14] = [
    "at_deg",
    "stops",
    "channel",
    "max",
    "stiffness_per_deg",
    "damping_s_per_deg",
    "cutoff_hz",
    "pre_wall",
    "co_contraction",
    "angle_min_deg",
    "angle_max_deg",
    "sensor",
    "code_at_0_deg",
    "code_at_100_deg",
];

/// Reads `[wall]`, and checks it against the channels.
pub(super) fn read_wall(
    root: &Table<'_>,
    channels: &[Channel],
) -> Result<Option<WallSpec>, SessionError> {
    let Some(t) = root.table("wall")?.optional() else {
        return Ok(None);
    };
    let known: Vec<&str> = FIELDS.into_iter().chain(["stale_after_ms"]).collect();
    t.only(&known)?;
    let sides = [("flexion", Side::Flexion), ("extension", Side::Extension)];
    let sensor = read_sensor(&t, ADC_CODES)?;
    let stale_after_ms = match sensor {
        SensorSource::Adc { .. } => STALE_AFTER_MS.0,
        SensorSource::Host => STALE_AFTER_MS.1,
    };
    let channel = find(&t, "channel", channels)?;
    not_under_force(&t, channel)?;
    let pre_wall = t.table("pre_wall")?.optional();
    let antagonist = t.table("co_contraction")?.optional();
    let spec = WallSpec {
        at_mdeg: t.whole("at_deg", 3)?.required()?,
        side: t.choice("stops", &sides)?.or(Side::Flexion),
        channel: channel.index(),
        max: read_amplitude(&t, "max", channel)?,
        stiffness: t.whole("stiffness_per_deg", 3)?.required()?,
        damping: t.whole("damping_s_per_deg", 3)?.or(0),
        cutoff_mhz: t.whole("cutoff_hz", 3)?.or(CUTOFF_MHZ),
        pre_wall: pre_wall.as_ref().map(read_pre_wall).transpose()?,
        co_contraction: antagonist
            .as_ref()
            .map(|a| read_co_contraction(a, channels))
            .transpose()?,
        angle_min_mdeg: t.whole("angle_min_deg", 3)?.or(0),
        angle_max_mdeg: t.whole("angle_max_deg", 3)?.or(150_000),
        sensor,
        stale_after_ms: t.whole("stale_after_ms", 0)?.or(stale_after_ms),
    };
    let parts = (pre_wall.as_ref(), antagonist.as_ref());
    Wall::new(&spec).map_err(|e| wall_error(&t, parts, e))?;
    Ok(Some(spec))
}

fn read_pre_wall(t: &Table<'_>) -> Result<PreWall, SessionError> {
    t.only(&["depth_deg", "begin", "end"])?;
    Ok(PreWall {
        depth_mdeg: t.whole("depth_deg", 3)?.required()?,
        begin: Amplitude(t.whole("begin", 3)?.required()?),
        end: Amplitude(t.whole("end", 3)?.required()?),
    })
}

fn read_co_contraction(t: &Table<'_>, channels: &[Channel]) -> Result<CoContraction, SessionError> {
    t.only(&["channel", "amplitude"])?;
    let channel = find(t, "channel", channels)?;
    not_under_force(t, channel)?;
    Ok(CoContraction {
        channel: channel.index(),
        amplitude: read_amplitude(t, "amplitude", channel)?,
    })
}

/// Puts the firmware's verdict on the field concerned.
fn wall_error(
    t: &Table<'_>,
    (pre_wall, antagonist): (Option<&Table<'_>>, Option<&Table<'_>>),
    e: WallError,
) -> SessionError {
    let (link, min, max) = match e {
        WallError::ChannelTwice { channel } => {
            let (field, channel) = ("wall".into(), channel + 1); // at most 10
            let problem = Problem::ChannelTwice { field, channel };
            return antagonist.unwrap_or(t).error("channel", problem);
        }
        WallError::Joint(SpecError::OutOfRange { field, min, max }) => {
            let (name, places) = file_field(field);
            return t.not_within(name, min.into(), max.into(), places);
        }
        // A wall's sensor names no points.
        WallError::Joint(SpecError::ChannelTwice { .. }) => ("", 0, 0),
        WallError::Range(OutOfRange { field, min, max }) => (field, min, max),
    };
    let (table, name, places) = match link {
        "at_mdeg" => (t, "at_deg", 3),
        "stiffness" => (t, "stiffness_per_deg", 3),
        "damping" => (t, "damping_s_per_deg", 3),
        "cutoff_mhz" => (t, "cutoff_hz", 3),
        "depth_mdeg" => (pre_wall.unwrap_or(t), "depth_deg", 3),
        "begin" | "end" => (pre_wall.unwrap_or(t), link, 3),
        "amplitude" => (antagonist.unwrap_or(t), link, 3),
        same => (t, same, 3),
    };
    table.not_within(name, min.into(), max.into(), places)
}
