//! The fields of `[[program]]`.

use firmware::pulse::{CHANNELS, TrainSpec};

use super::super::control_fields::amplitude;
use crate::fields::field::Need::{Optional, Or, OrTold, Required};
use crate::fields::field::{
    CHANNEL, Kind, Number, Section, bounded_number, channel_number, field, list, one_of,
};

/// Form in which a program describes its amplitudes over time.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Form {
    /// One amplitude for a time, then 0 for a time.
    OnOff,
    /// Amplitudes and widths that change linearly from point to point.
    Ramp,
    /// Amplitudes and widths that hold from point to point.
    Steps,
    /// Amplitudes by the angle of a crank, or by the phase of a gait.
    Cycle,
}

/// Forms of programs and their names in session files.
pub(super) const FORMS: [(&str, Form); 4] = [
    ("on-off", Form::OnOff),
    ("ramp", Form::Ramp),
    ("steps", Form::Steps),
    ("cycle", Form::Cycle),
];

/// Maximum number of points of a program.
const MOST_POINTS: usize = 1_000;

/// A whole turn, 0.001°.
pub(super) const TURN_MDEG: i64 = 360_000;

/// Returns the kind of an angle within a turn, 0.001°.
fn angle() -> Kind {
    Kind::Whole(Number::within("°", 3, 0, TURN_MDEG))
}

fn width() -> Kind {
    bounded_number(
        "µs",
        0,
        TrainSpec::WIDTH_US,
        "to the train's `max_width_us`",
    )
}

/// Returns the fields of a program. `time` returns the kind of a time of the session of at least
/// that many µs, and `rising` the kind of a time in a list.
#[rustfmt::skip]
pub(in crate::session) fn program(time: fn(i64) -> Kind, rising: fn() -> Kind) -> Section {
    let own_width = || OrTold("the train's `width_us`".into());
    let points = vec![
        field("at_s", rising(), Required, "when, from the begin of a pass on"),
        field("value", amplitude(), Required, "which amplitude"),
        field("width_us", width(), own_width(), "which width; another needs the train's `max_width_us`"),
    ];
    let phases = vec![
        field("channel", channel_number(), Required, "a channel of the file"),
        field("value", amplitude(), Required, "its amplitude"),
        field("width_us", width(), own_width(), "its width; another needs the train's `max_width_us`"),
        field("from_deg", angle(), Required, "where it begins to rise"),
        field("to_deg", angle(), Required, "where it is off again, 0 and 360 being the same"),
    ];
    let listed = &["on-off", "ramp", "steps"];
    vec![
        field("kind", one_of(&FORMS), Required, "on for a time and off for a time; straight from point to point; held from point to point; or on from one angle of a turn to another"),
        field("channels", Kind::Wholes(CHANNEL, "a list of channel numbers"), Required, "who plays it: channels of endless trains that nothing else drives, each in one program only").when("kind", listed),
        field("value", amplitude(), Required, "amplitude while on").when("kind", &["on-off"]),
        field("width_us", width(), own_width(), "width while on; another needs the train's `max_width_us`").when("kind", &["on-off"]),
        field("on_s", time(1), Required, "from the begin of the ramp up to the end of the ramp down").when("kind", &["on-off"]),
        field("off_s", time(1), Optional, "silence after that, a period of the channel at least; without it the program is played once").when("kind", &["on-off"]),
        field("points", list(points, 1, Some(MOST_POINTS), "points"), Required, "`{ at_s, value, width_us }`: straight from one to the next in a ramp, held in steps; the last one stays").when("kind", &["ramp", "steps"]),
        field("every_s", time(1), Optional, "from pass to pass of the points; without it they are played once").when("kind", &["ramp", "steps"]),
        field("cadence_rpm", Kind::Real(Number::within("turns a minute", 3, 1_000, 200_000)), Required, "constant cadence").when("kind", &["cycle"]),
        field("start_deg", angle(), Or(0), "angle at the begin; a muscle whose phase that is in waits for the next").when("kind", &["cycle"]),
        field("phases", list(phases, 1, Some(CHANNELS), "phases"), Required, "`{ channel, value, width_us, from_deg, to_deg }`: who is on from which angle to which").when("kind", &["cycle"]),
        field("ramp_up_s", time(0), OrTold("the shortest that the wearer's rise allows".into()), "linear rise, from the first burst of a pass to the first of the whole amplitude").when("kind", &["on-off", "cycle"]),
        field("ramp_down_s", time(0), Or(0), "linear fall to the end of the time on").when("kind", &["on-off", "cycle"]),
        field("delay_s", time(0), Or(0), "when the first pass begins"),
        field("stagger_s", time(0), Or(0), "how much later each further channel of the list begins").when("kind", listed),
        field("repeats", Kind::Whole(Number::within("", 0, 1, 1_000_000)), OrTold("until the session ends".into()), "passes of each channel, all within the session; of a cycle its turns"),
    ]
}
