//! The fields of `[[modulation]]` and of the points at which an object is held, declared in the
//! same way as the others in `fields`.

use firmware::control::SensorSource;
use firmware::control::refusal::{ANGLE_MAX_MDEG, ANGLE_MIN_MDEG};
use firmware::haptics::{ModulatedSpec, ModulationSpec, QuarticSpec};

use crate::fields::field::Need::{Optional, Or, OrFile, OrWord, Required};
use crate::fields::field::{
    Kind, Number, Section, UNIT, bounded_number, channel_number, field, list, number_in, one_of,
};

/// Joints that can be modulated: names in session files, and numbers in the protocol. The number of
/// an elbow is even, and the shoulder of the same arm has the next number.
pub(super) const JOINTS: [(&str, u8); 4] = [
    ("left-elbow", 0),
    ("left-shoulder", 1),
    ("right-elbow", 2),
    ("right-shoulder", 3),
];

/// Choice of the muscles that are stimulated while the elbow moves.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Mode {
    /// Stimulates the muscles that move the joint.
    Assist,
    /// Stimulates the antagonists of the muscles that move the joint.
    Resist,
}

/// Modes of a modulated joint, and their names in session files.
pub(super) const MODES: [(&str, Mode); 2] = [("assist", Mode::Assist), ("resist", Mode::Resist)];

/// Names in session files of the two formulas that turn a share into an intensity.
const FORMS: [(&str, ()); 2] = [("scaled", ()), ("above-threshold", ())];

/// Default dead band of the elbow's angular velocity, 0.01 °/s. With this and the default cutoff,
/// the phase of an elbow at rest does not chatter although its sensor has noise of 0.1°
/// (docs/guides/lift.md).
const DEAD_BAND: i64 = 800;
/// Default cutoff frequency of the differentiator that computes the elbow's angular velocity, mHz.
const CUTOFF_MHZ: i64 = 2_000;
/// Default age from which a measured angle is stale, ms: five periods of a 100 Hz stream.
const STALE_AFTER_MS: i64 = 50;
/// Default of the longest time for which an object may be held, ms.
const LONGEST_HOLD_MS: i64 = 30_000;

#[rustfmt::skip]
fn muscle() -> Section {
    vec![
        field("channel", channel_number(), Required, "a channel of the file; each must be different"),
        field("base", bounded_number(UNIT, 3, ModulatedSpec::BASE, "so that the largest share keeps within the channel's `limit`"), OrFile, "I₀, the intensity that calibration found"),
        field("form", one_of(&FORMS), OrWord("scaled"), "intensity at the share C: `\"scaled\"` is C·I₀, `\"above-threshold\"` is I_th + C·(I₀ − I_th)"),
        field("threshold", bounded_number(UNIT, 3, ModulatedSpec::THRESHOLD, "below `base`"), OrFile, "I_th, the motor threshold").when("form", &["above-threshold"]),
    ]
}

/// Returns the fields of `[[modulation]]`. `at_s` is the kind of the time field that the simulated
/// angles have.
#[rustfmt::skip]
pub(super) fn modulation(at_s: Kind) -> Section {
    let share = || {
        let number = Number { device: "", ..Number::from_range("", 6, QuarticSpec::SHARE) };
        Kind::Wholes(number, "a list of five numbers")
    };
    let angles = vec![
        field("at_s", at_s, Required, "time"),
        field("deg", Kind::Whole(Number::within("°", 2, -18_000, 18_000).bound("within the joint's range")), Required, "angle"),
    ];
    vec![
        field("joint", one_of(&JOINTS), Required, "the joint; a shoulder needs the elbow of its arm, whose motion determines the phase of both (E752)"),
        field("mode", one_of(&MODES), OrWord("assist"), "muscle that is stimulated: with `\"assist\"` the flexor while the elbow flexes and the extensor while it extends; with `\"resist\"` the antagonist of each, with the same share"),
        field("lift", share(), Optional, "share of the intensity while the elbow flexes: the quartic through five values, at the joint's lowest angle, at a quarter, half and three quarters of its range, and at its highest angle; between 0 and 1 at every angle (E750); without it, nothing is stimulated in this phase"),
        field("drop", share(), Optional, "share of the intensity while the elbow extends, as for `lift`"),
        field("angle_min_deg", number_in("°", 3, ANGLE_MIN_MDEG), Required, "lowest angle of the shares"),
        field("angle_max_deg", bounded_number("°", 3, ANGLE_MAX_MDEG, "above the lowest"), Required, "highest angle of the shares"),
        field("dead_band_deg_per_s", number_in("°/s", 2, ModulationSpec::DEAD_BAND), Or(DEAD_BAND), "angular velocity of the elbow up to which the last phase is kept"),
        field("cutoff_hz", number_in("Hz", 3, ModulationSpec::CUTOFF_MHZ), Or(CUTOFF_MHZ), "cutoff frequency of the differentiator that computes the velocity"),
        field("stale_after_ms", number_in("ms", 0, SensorSource::STALE_AFTER_MS), Or(STALE_AFTER_MS), "age from which a measured angle is stale, which is a fault while an object is held"),
        field("longest_hold_s", number_in("s", 3, ModulationSpec::MAX_HOLD_MS), Or(LONGEST_HOLD_MS), "longest time for which an object may be held; with several joints, the shortest applies"),
        field("flexor", Kind::Table(muscle()), Required, "`{ channel, base, form, threshold }`: muscle that flexes the joint"),
        field("extensor", Kind::Table(muscle()), Required, "muscle that extends the joint, with the same fields"),
        field("angles", list(angles, 1, None, "angles"), Required, "`{ at_s, deg }`: course of the angle, linear between the points, sent with every setpoint as if it were measured; the last angle stays. Only for simulated devices (E755): a real wearer's angles come from a client that measures them"),
    ]
}

/// Returns the fields of one point of `kind = "held"`: a time, and whether an object is held from
/// then on.
#[rustfmt::skip]
pub(super) fn held_points(at_s: Kind) -> Section {
    vec![
        field("at_s", at_s, Required, "time"),
        field("held", Kind::Flag, Required, "whether the object is held from then on"),
    ]
}
