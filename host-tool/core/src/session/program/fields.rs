//! The fields of `[[program]]`.

use firmware::pulse::{CHANNELS, TrainSpec};

use super::super::control_fields::amplitude;
use crate::fields::field::Need::{Optional, Or, OrTold, Required};
use crate::fields::field::{
    CHANNEL, Kind, Number, Section, bounded_number, channel_number, field, list, one_of,
};

/// Form in which a program describes its amplitudes over time; the field `kind`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Form {
    /// One amplitude for a time, then 0 for a time, repeatedly.
    OnOff,
    /// Points of amplitude and width, between which both change linearly.
    Ramp,
    /// Points of amplitude and width, each of which is constant until the next.
    Steps,
    /// Amplitudes over the angle of a turn, for example of a crank or of a gait cycle.
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

/// A whole turn of a cycle, in 0.001°.
pub(super) const TURN_MDEG: i64 = 360_000;

/// Returns the kind of a field that holds an angle within a turn, in 0.001°.
fn angle() -> Kind {
    Kind::Whole(Number::within("°", 3, 0, TURN_MDEG))
}

fn width() -> Kind {
    bounded_number(
        "µs",
        0,
        TrainSpec::WIDTH_US,
        "at most the train's `max_width_us`",
    )
}

/// Returns the fields of `[[program]]`. `time` returns the kind of a time within the session of at
/// least the given µs. `rising` returns the kind of the times in a list of points.
#[rustfmt::skip]
pub(in crate::session) fn program(time: fn(i64) -> Kind, rising: fn() -> Kind) -> Section {
    let own_width = || OrTold("the train's `width_us`".into());
    let points = vec![
        field("at_s", rising(), Required, "time after the start of a pass"),
        field("value", amplitude(), Required, "amplitude"),
        field("width_us", width(), own_width(), "pulse width; other widths than the train's need `max_width_us` in the train"),
    ];
    let phases = vec![
        field("channel", channel_number(), Required, "a channel of the file"),
        field("value", amplitude(), Required, "amplitude"),
        field("width_us", width(), own_width(), "pulse width; other widths than the train's need `max_width_us` in the train"),
        field("from_deg", angle(), Required, "angle at which the amplitude begins to rise"),
        field("to_deg", angle(), Required, "angle at which the channel is off again; 0 and 360 are the same"),
    ];
    let listed = &["on-off", "ramp", "steps"];
    vec![
        field("kind", one_of(&FORMS), Required, "form of the program: on for a time, then off; linear from point to point; held from point to point; or on between two angles of a turn"),
        field("channels", Kind::Wholes(CHANNEL, "a list of channel numbers"), Required, "channels that play the program; each needs an endless train, is driven by nothing else, and is in one program only").when("kind", listed),
        field("value", amplitude(), Required, "amplitude while on").when("kind", &["on-off"]),
        field("width_us", width(), own_width(), "pulse width while on; other widths than the train's need `max_width_us` in the train").when("kind", &["on-off"]),
        field("on_s", time(1), Required, "time on, from the start of the ramp up to the end of the ramp down").when("kind", &["on-off"]),
        field("off_s", time(1), Optional, "pause after that, at least one period of the channel's train; without it the program is played once").when("kind", &["on-off"]),
        field("points", list(points, 1, Some(MOST_POINTS), "points"), Required, "`{ at_s, value, width_us }`: linear from point to point in a ramp, held in steps; the last one stays").when("kind", &["ramp", "steps"]),
        field("every_s", time(1), Optional, "time from pass to pass of the points; without it they are played once").when("kind", &["ramp", "steps"]),
        field("cadence_rpm", Kind::Real(Number::within("turns a minute", 3, 1_000, 200_000)), Required, "constant cadence").when("kind", &["cycle"]),
        field("start_deg", angle(), Or(0), "angle at the start; a channel whose phase contains this angle waits for its next phase").when("kind", &["cycle"]),
        field("phases", list(phases, 1, Some(CHANNELS), "phases"), Required, "`{ channel, value, width_us, from_deg, to_deg }`: channels, and the angles between which each is on").when("kind", &["cycle"]),
        field("ramp_up_s", time(0), OrTold("the shortest that the wearer's rise allows".into()), "duration of the linear rise, from the first burst of a pass to the first burst at full amplitude").when("kind", &["on-off", "cycle"]),
        field("ramp_down_s", time(0), Or(0), "duration of the linear fall at the end of the time on").when("kind", &["on-off", "cycle"]),
        field("delay_s", time(0), Or(0), "time at which the first pass begins"),
        field("stagger_s", time(0), Or(0), "additional delay of each further channel of the list").when("kind", listed),
        field("repeats", Kind::Whole(Number::within("", 0, 1, 1_000_000)), OrTold("until the session ends".into()), "number of passes of each channel (turns of a cycle), all within the session"),
    ]
}
