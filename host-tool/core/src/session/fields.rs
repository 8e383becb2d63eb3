//! The fields of a session file, each declared once: name, kind with unit and range, default, and
//! meaning. A range comes from the firmware, where it is declared beside the field that it bounds,
//! or is the host's own.

use std::sync::LazyLock;

use firmware::control::{Endpoint, SensorSource};
use firmware::haptics::JOINTS;
use firmware::limb::AXIS_NAMES;
use firmware::muscle::{CalciumForceSpec, MuscleLevel, RecruitmentSpec};
use firmware::pulse::{CHANNELS, MAX_GROUPS, Partner, Shape, TrainSpec, Trigger};
use firmware::range::Range;
use firmware::safety::{ChannelSpec, ListedPulse, MAX_LISTED, StageSpec};
use hal_sim::body::wearer::Participant;
use hal_sim::body::{ElbowSpec, FingerSpec};

use super::arm::arm_fields;
use super::control_fields::{amplitude, hold, joint, wall};
use super::hand_fields::{hand_fields, point_channels};
use super::modulation_fields::{held_points, modulation};
use super::program::program;
use crate::fields::field::Need::{Optional, Or, OrFile, OrTold, OrWord, Required, RequiredWithout};
use crate::fields::field::{
    CHANNEL, Kind, Number, Section, UNIT, bounded_number, channel_number, field, list, number_in,
    one_of,
};
use crate::fields::field::{LONGEST, LONGEST_NOTES};
use crate::wearer::{fatigue, limits};

/// Section that declares all fields of a session file, with the sections of its tables nested
/// inside.
pub(super) static FILE: LazyLock<Section> = LazyLock::new(file);

/// Waveforms and their names in session files.
pub(super) const SHAPES: [(&str, Shape); 4] = [
    ("biphasic-cathodic-first", Shape::BiphasicCathodicFirst),
    ("biphasic-anodic-first", Shape::BiphasicAnodicFirst),
    ("monophasic-cathodic", Shape::MonophasicCathodic),
    ("monophasic-anodic", Shape::MonophasicAnodic),
];
/// Effects of the trigger input on a train that waits for it, and their names in session files.
pub(super) const TRIGGERS: [(&str, Trigger); 3] = [
    ("start", Trigger::Start),
    ("toggle", Trigger::Toggle),
    ("gated", Trigger::Gated),
];
/// Model levels of the muscle and their names in session files.
pub(super) const RUNGS: [(&str, MuscleLevel); 3] = [
    ("none", MuscleLevel::None),
    ("calcium-force", MuscleLevel::CalciumForce),
    ("calcium-force-fatigue", MuscleLevel::CalciumForceFatigue),
];
/// States of a group's channels while another channel of the group pulses, and their names in
/// session files.
pub(super) const PARTNERS: [(&str, Partner); 2] = [
    ("conducted", Partner::Conducted),
    ("isolated", Partner::Isolated),
];
/// Participants of Hamana 2022 and their names in session files.
pub(super) const PARTICIPANTS: [(&str, Participant); 3] = [
    ("P", Participant::P),
    ("Q", Participant::Q),
    ("S", Participant::S),
];

/// Longest session, µs: a day.
pub(super) const DAY_US: i64 = 86_400_000_000;
/// Shortest time between two edges of the trigger input, µs. A triggered train begins 1000 µs after
/// its edge.
pub(super) const TRIGGER_LEAST_US: i64 = 1_000;
/// Earliest time of a simulated trigger edge, µs after the start. The host learns the time of the
/// start only when the acknowledgement of `Start` arrives.
pub(super) const TRIGGER_FIRST_US: i64 = 10_000;
/// Returns the kind of a field that holds a time within the session, in µs, of at least `least_us`.
fn time(least_us: i64) -> Kind {
    Kind::Whole(Number::within("s", 6, least_us, DAY_US).bound("at most `duration_s`"))
}

/// Returns the kind of the time field, in µs, that the entries of a list have. The first time is 0,
/// and the times rise from entry to entry.
fn rising_time() -> Kind {
    Kind::Whole(Number::within("s", 6, 0, DAY_US).bound("the first 0, then rising"))
}

/// Returns `range` with its lower end moved to 0. In the fields that use it, 0 means that the
/// feature is absent.
const fn or_zero(range: Range) -> Range {
    Range::new(range.field, 0, range.max)
}

#[rustfmt::skip]
fn file() -> Section {
    vec![
        field("title", Kind::Text(None), Required, "title of the session in reports"),
        field("duration_s", Kind::Whole(Number::within("s", 6, 1_000, DAY_US)), Required, "duration of the stimulation"),
        field("wearer", Kind::Table(wearer()), Optional, "the wearer and their limits"),
        field("channel", list(channels(), 1, Some(CHANNELS), "channels of the session"), Required, "channels of the session"),
        field("group", list(group(), 0, Some(MAX_GROUPS), "groups"), Optional, "groups of channels that share a muscle"),
        field("sync", Kind::Table(vec![field("channel", channel_number(), Required, "channel whose first phases drive the sync output")]), Optional, "`channel`: channel whose first phases drive the sync output"),
        field("joint", Kind::Table(joint()), Optional, "closed-loop control of a joint on the device"),
        field("wall", Kind::Table(wall()), Optional, "virtual wall on the device; not together with a `[joint]` (E480)"),
        field("modulation", list(modulation(rising_time()), 0, Some(JOINTS), "joints"), Optional, "joints of a wearer who handles an object; their stimulation [follows their angles](../guides/lift.md); not together with a `[joint]`, a `[wall]` or forces at the hand (E751)"),
        field("program", list(program(time, rising_time), 0, Some(CHANNELS), "programs"), Optional, "[amplitudes over time](#program) of channels that nothing else drives"),
        field("setpoints", Kind::Table(setpoints()), RequiredWithout("program"), "setpoints that the host streams"),
        field("measure", Kind::Table(measure()), Optional, "time window in which tracking errors are computed"),
        field("body", Kind::Table(body()), Optional, "the simulated wearer; without it, a dummy load on every channel; a board ignores it"),
        field("simulated_trigger", Kind::Table(trigger()), Optional, "edges of a simulated trigger input; a board ignores them, which `flexor run` notes"),
        field("fidelity", Kind::Table(fidelity()), Optional, "accepted error of the simulation and of the muscle models"),
        field("study", Kind::Table(study()), Optional, "facts that a publication must report and the device cannot know"),
    ]
}

#[rustfmt::skip]
fn study() -> Section {
    let electrodes = vec![
        field("channel", channel_number(), Required, "a channel of the file"),
        field("place", Kind::Text(Some(LONGEST)), Required, "position of its electrodes, in words"),
    ];
    vec![
        field("pseudonym", Kind::Text(Some(LONGEST)), Optional, "pseudonym of the wearer; never a name"),
        field("operator", Kind::Text(Some(LONGEST)), Optional, "person who operates the device"),
        field("ethics", Kind::Text(Some(LONGEST)), Optional, "approval of the ethics committee"),
        field("notes", Kind::Text(Some(LONGEST_NOTES)), Optional, "further remarks"),
        field("electrodes", list(electrodes, 0, Some(CHANNELS), "electrodes"), Optional, "`{ channel, place }`: position of each channel's electrodes, in words"),
    ]
}

#[rustfmt::skip]
fn wearer() -> Section {
    let mut fields = vec![
        field("file", Kind::Text(Some(LONGEST)), Optional, "path of the [wearer file](wearers.md), relative to this file; the limits here may then only be stricter"),
        field("name", Kind::Text(Some(64)), Optional, "pseudonym of the wearer; a wearer file with another name is refused (E660)"),
        field("haptic_range", Kind::Flag, OrWord("false"), "whether every amplitude must be 0 or between I_MT and 1.5 I_MT of the wearer file (E662)"),
    ];
    fields.extend(limits());
    fields
}

#[rustfmt::skip]
fn channels() -> Section {
    vec![
        field("number", channel_number(), Required, "number of the channel on the board"),
        field("name", Kind::Text(None), Required, "name that the wearer uses for the channel"),
        field("stage", Kind::Table(stage()), Required, "output stage"),
        field("limit", bounded_number(UNIT, 3, ChannelSpec::LIMIT, "at most full scale"), OrFile, "largest amplitude; must respect the wearer's limits of current, charge and rms current"),
        field("start", bounded_number(UNIT, 3, ChannelSpec::START, "at most `limit`"), OrTold("0, or that of the wearer file".into()), "largest amplitude that is reached at once, without the wearer's rise; a train with `repeats` cannot exceed it"),
        field("area_mm2", number_in("mm²", 0, ChannelSpec::AREA_MM2), Or(ChannelSpec::ASSUMED_AREA_MM2.into()), "area of the active electrode, for the limit of 2 mA/cm² rms; the default is a disc of 32 mm"),
        field("train", Kind::Table(train()), Required, "pulses of the channel"),
        field("muscle", Kind::Table(muscle()), Optional, "muscle whose force the device predicts; `{}` uses the muscle of the wearer file"),
        field("force", Kind::Table(force()), Optional, "control of the muscle's force; needs `muscle`"),
    ]
}

#[rustfmt::skip]
fn stage() -> Section {
    vec![
        field("kind", Kind::Choice(vec!["voltage", "current"]), Required, "quantity that the stage controls"),
        field("full_scale_ma", number_in("mA", 3, StageSpec::FULL_SCALE_UA), Required, "output at the full DAC code").when("kind", &["current"]),
        field("full_scale_v", number_in("V", 3, StageSpec::FULL_SCALE_MV), Required, "output at the full DAC code").when("kind", &["voltage"]),
        field("load_ohm", number_in("Ω", 0, StageSpec::LOAD_OHM), Required, "load for which voltages are converted to currents and checked against the current limits; 2000 is usual; a voltage stage is limited to 20 mA").when("kind", &["voltage"]),
    ]
}

#[rustfmt::skip]
fn train() -> Section {
    type T = TrainSpec;
    vec![
        field("shape", one_of(&SHAPES), Required, "waveform"),
        field("width_us", number_in("µs", 0, T::WIDTH_US), Required, "length of one phase"),
        field("max_width_us", bounded_number("µs", 0, T::MAX_WIDTH_US, "at least `width_us`"), OrTold("`width_us`, a fixed width".into()), "largest width that a setpoint may ask for, [burst by burst](../protocol.md#widths); not together with a `muscle`"),
        field("gap_us", bounded_number("µs", 0, T::GAP_US, "0 for monophasic"), Or(0), "interphase gap; the device keeps at least 5 µs"),
        field("ground_us", bounded_number("µs", 0, or_zero(T::GROUND_US), "at least 1000 and at most `fall_ms` − 1.2 ms; 0 for none, with biphasic pulses only"), Or(0), "grounding after each pulse; without it, a charge difference between the phases of biphasic pulses flows as net direct current"),
        field("frequency_hz", Kind::Real(Number::rate_from_period(T::PERIOD_US.field, T::PERIOD_US)), Required, "pulse rate of the train; rounded to a period of whole µs, with a note").without("period_us"),
        field("period_us", number_in("µs", 0, T::PERIOD_US), Optional, "time from burst start to burst start"),
        field("offset_us", bounded_number("µs", 0, T::OFFSET_US, "at most the period"), Or(0), "delay after the common start"),
        field("burst_count", number_in("", 0, T::BURST_COUNT), Or(1), "pulses per burst"),
        field("burst_interval_us", bounded_number("µs", 0, or_zero(T::BURST_INTERVAL_US), "at least 200 for bursts, 0 for single pulses"), Or(0), "time from pulse start to pulse start within a burst"),
        field("repeats", Kind::Whole(Number::within("", 0, 0, u16::MAX as i64)), Or(0), "number of bursts to play; 0 plays until stopped"),
        field("triggered", Kind::Flag, OrWord("false"), "wait for the trigger input, as `trigger = \"start\"`; [`[simulated_trigger]`](#simulated_trigger) simulates it").without("trigger"),
        field("trigger", one_of(&TRIGGERS), Optional, "wait for the trigger input: with `\"start\"` an edge starts the train, with `\"toggle\"` an edge starts it and the next one ends it, with `\"gated\"` it plays [while the input is held](../protocol.md#trigger)"),
        field("lists", Kind::Flag, OrWord("false"), "accept [lists of pulses](#lists) in place of its own pulses; only for endless single pulses, and not in an isolated group"),
    ]
}

#[rustfmt::skip]
fn muscle() -> Section {
    type M = CalciumForceSpec;
    type R = RecruitmentSpec;
    let changes = vec![
        field("at_s", time(1), Required, "time from which the model level is used"),
        field("model", one_of(&RUNGS), Required, "model level from then on"),
    ];
    let models = std::iter::once("auto").chain(RUNGS.map(|(name, _)| name));
    vec![
        field("a_n_per_s", number_in("N/s", 3, M::A_MN_PER_S), OrFile, "A, the scale of the force"),
        field("k", number_in("", 6, M::K_MICRO), OrFile, "K, the sensitivity of the cross-bridges to calcium"),
        field("tau_c_ms", bounded_number("ms", 3, M::TAU_C_US, "under bursts of n pulses every T at most T/ln(24/(24 − n))"), OrFile, "τc, the time constant of calcium"),
        field("tau1_ms", number_in("ms", 3, M::TAU1_US), OrFile, "τ1, the time constant of the force decay without cross-bridges; must be above 2 ms if `tau2_ms` is below 1.4 or above 100,000 `k`"),
        field("tau2_ms", number_in("ms", 3, M::TAU2_US), OrFile, "τ2, the additional time constant due to cross-bridges"),
        field("motor_threshold", bounded_number(UNIT, 3, R::MOTOR_THRESHOLD, "below `limit`"), OrFile, "smallest amplitude that causes a movement"),
        field("reference", bounded_number(UNIT, 3, R::REFERENCE, "at least `limit`"), OrFile, "amplitude at which A was measured"),
        field("slope_per_unit", bounded_number("per unit", 6, R::SLOPE_MICRO, "at most 16 octaves from threshold to reference"), OrFile, "b, the slope of the recruitment"),
        field("model", Kind::Choice(models.collect()), OrWord("auto"), "model level that the device computes ([list](../protocol.md#musclelevel)); `\"auto\"` selects the cheapest one that is accurate enough in this session; `flexor explain-model` reports which one and why ([muscle.md](../how/muscle.md))"),
        field("report", Kind::Flag, OrWord("true"), "whether the predicted force is reported; if false, `\"auto\"` considers only what the force controls"),
        field("fatigue", Kind::Table(fatigue()), Optional, "fatigue of the muscle; `\"calcium-force-fatigue\"` needs it"),
        field("changes", list(changes, 0, None, "changes"), Optional, "`{ at_s, model }`: other model levels, each from its time on, sent with the next setpoint; times must rise"),
    ]
}

#[rustfmt::skip]
fn force() -> Section {
    let rate = |period_us, bound| Kind::Real(Number::rate_from_period(period_us, TrainSpec::PERIOD_US).bound(bound));
    let mut fields = vec![
        field("max_frequency_hz", rate("min_period_us", "at least the train's"), OrTold("the train's".into()), "highest pulse rate, used at `limit`"),
        field("min_frequency_hz", rate("max_period_us", "at most the train's"), OrTold("the train's".into()), "lowest pulse rate, at `motor_threshold`, for forces below the force of the threshold at the train's rate; below 10 Hz the force has [ripple](../how/muscle.md#forces-that-can-be-had); without this field the device reports *limiting* for such a force and gives the threshold's force or none, whichever is nearer"),
    ];
    fields.extend(hold("what to do between and after setpoints: extrapolate the force or hold it; if it is held, the muscle's lag is not compensated"));
    fields
}

#[rustfmt::skip]
fn group() -> Section {
    vec![
        field("channels", Kind::Wholes(CHANNEL, "a list of channel numbers"), Required, "2–10 channels; each may be in one group only"),
        field("partner", one_of(&PARTNERS), Required, "state of the other channels while one pulses: grounded (`\"conducted\"`) or disconnected (`\"isolated\"`)"),
    ]
}

/// Returns the fields of one point in a course of force over time.
#[rustfmt::skip]
fn force_points() -> Section {
    vec![
        field("at_s", rising_time(), Required, "time"),
        field("n", Kind::Whole(Number::any("N", 3, "within what the limits can give")), Required, "force"),
    ]
}

fn sine_of_force() -> [Kind; 3] {
    let force = || Kind::Real(Number::any("N", 3, "between 0 and what the limits allow"));
    [force(), force(), Kind::Real(SINE)]
}

/// Range of a sine's frequency, 0 to 10 Hz, in mHz. A sine of 180° at 10 Hz reaches 11 300 °/s,
/// which the angular velocities of the protocol can hold.
const SINE: Number = Number::within("Hz", 3, 0, 10_000);

#[rustfmt::skip]
fn values() -> Section {
    vec![
        field("channel", channel_number(), Required, "a channel of the file"),
        field("value", amplitude(), Required, "amplitude"),
        field("width_us", width(TrainSpec::WIDTH_US), OrTold("the train's `width_us`".into()), "pulse width; other widths than the train's need `max_width_us` in the train"),
    ]
}

/// Range of the widths that a point of an amplitude course may have, µs: 0, or a pulse width of the
/// device. At a width below the shortest pulse width, the channel outputs no pulse.
const POINT_WIDTH: Range = or_zero(TrainSpec::WIDTH_US);

/// Returns the kind of a field that holds a setpoint's pulse width in µs, within `range`.
fn width(range: Range) -> Kind {
    bounded_number("µs", 0, range, "at most the train's `max_width_us`")
}

/// Returns the fields of one point in a course of amplitude and pulse width over time.
#[rustfmt::skip]
fn stimulus_points() -> Section {
    vec![
        field("at_s", rising_time(), Required, "time"),
        field("value", amplitude(), Required, "amplitude"),
        field("width_us", width(POINT_WIDTH), OrTold("the train's `width_us`".into()), "pulse width; below 10 µs no pulse is output"),
    ]
}

/// Returns the fields of one list of pulses, which is output once in place of the channel's own
/// pulses.
#[rustfmt::skip]
fn list_of_pulses() -> Section {
    let value = Kind::Whole(Number::within(UNIT, 3, 1, 200_000).bound("at most the channel's `limit`"));
    let pulses = vec![
        field("after_us", Kind::Whole(Number::from_range("µs", 0, ListedPulse::AFTER_US).bound("at least the train's period, except for the first pulse")), Required, "time after the previous pulse; for the first pulse, after the time at which the channel's next burst would begin"),
        field("value", value, Required, "amplitude"),
        field("width_us", width(TrainSpec::WIDTH_US), OrTold("the train's `width_us`".into()), "pulse width; other widths than the train's need `max_width_us` in the train"),
    ];
    vec![
        field("at_s", time(1), Required, "time at which it is sent, with the next setpoint; times must rise"),
        field("channel", channel_number(), Required, "a channel whose train has `lists`"),
        field("pulses", list(pulses, 1, Some(MAX_LISTED), "pulses"), Required, "`{ after_us, value, width_us }`: pulses of the list"),
    ]
}

/// Returns the fields of one point in a course of the force at the hand over time.
#[rustfmt::skip]
fn wrench_points() -> Section {
    let force = Number { device: "", ..Number::from_range("N", 3, Endpoint::FORCE_MN) };
    vec![
        field("at_s", rising_time(), Required, "time"),
        field("force_n", Kind::Wholes(force.bound("within what the muscles can give"), "a list of three numbers"), Required, "force backward, to the right and upward, seen from the thorax"),
    ]
}

/// Returns the fields of an arm's posture: nine angles in 0.01°, each 0 if left out.
fn posture() -> Section {
    let angle = |name| {
        let number = Number::within("°", 2, -18_000, 18_000).bound("within the wearer's range");
        field(name, Kind::Whole(number), Or(0), "angle of this axis")
    };
    AXIS_NAMES.map(angle).into()
}

/// Returns the kind of a field that bounds what a live client may stream: an amplitude or a force,
/// in thousandths of its unit.
fn amplitude_or_force() -> Kind {
    Kind::Whole(Number::within("unit or N", 3, 0, 10_000_000))
}

#[rustfmt::skip]
fn setpoints() -> Section {
    let steps = vec![
        field("at_s", rising_time(), Required, "time"),
        field("deg", Kind::Whole(Number::any("°", 2, "within the joint's range")), Required, "angle"),
    ];
    let [offset, amplitude, frequency] = sine_of_force();
    let forces = vec![
        field("channel", channel_number(), Required, "a channel with `force`"),
        field("points", list(force_points(), 1, None, "points"), Optional, "as for a `force-ramp`"),
        field("offset_n", offset, Required, "as for a `force-sine`").without("points"),
        field("amplitude_n", amplitude, Required, "as for a `force-sine`").without("points"),
        field("frequency_hz", frequency, Required, "as for a `force-sine`").without("points"),
    ];
    let bounds = vec![
        field("channel", channel_number(), Required, "a channel that neither joint nor wall drives"),
        field("least", amplitude_or_force(), Or(0), "lowest value, in N for a channel with `force`, otherwise in its unit"),
        field("most", amplitude_or_force(), Required, "highest value, above `least` and within what the limits can give"),
        field("per_s", amplitude_or_force(), OrTold("none, steps are allowed".into()), "largest change per second; at least `most` − `least` within `duration_s`"),
        field("shortest_s", Kind::Whole(Number::within("s", 6, 10_000, 600_000_000)), Or(100_000), "shortest time for which a value stays"),
    ];
    let [offset, amplitude, _] = sine_of_force();
    let angle = || Kind::Real(Number::any("°", 3, "within the joint's range"));
    vec![
        field("kind", Kind::Choice(vec!["keep-alive", "amplitudes", "amplitude-ramp", "amplitude-steps", "angle-sine", "angle-steps", "force-ramp", "force-sine", "endpoint-force", "held"]), Required, "quantity that the host streams: angles need a `[joint]`, forces a channel with `force`, forces at the hand the `[limb]` of a wearer file, and `\"held\"` (whether an object is held) a `[[modulation]]`; `\"keep-alive\"` streams only keep-alives, which is enough for a `[wall]`"),
        field("rate_hz", Kind::Real(Number::within("Hz", 0, 1, 1000).bound("above 1000/`host_timeout_ms`")), Required, "rate of the setpoints"),
        field("offset_deg", angle(), Required, "centre of the sine").when("kind", &["angle-sine"]),
        field("amplitude_deg", angle(), Required, "amplitude of the sine").when("kind", &["angle-sine"]),
        field("steps", list(steps, 1, None, "steps"), Required, "`{ at_s, deg }`: each angle from its time on").when("kind", &["angle-steps"]),
        field("channel", channel_number(), Required, "channel whose amplitude or force is streamed").when("kind", &["amplitude-ramp", "amplitude-steps", "force-ramp", "force-sine"]),
        field("points", list(stimulus_points(), 1, None, "points"), Required, "`{ at_s, value, width_us }`: amplitudes and widths; both are linear between the points of a ramp and held between steps; the last pair stays. Every pair, also between the points, must be within `max_charge_uc` (E630). From 0, an amplitude rises over the wearer's `rise_ms`; in a ramp of the width, this rise begins when the width reaches 10 µs").when("kind", &["amplitude-ramp", "amplitude-steps"]),
        field("points", list(force_points(), 1, None, "points"), Required, "`{ at_s, n }`: forces, linear between the points; the last one stays; a change above 1000 N/s is a step").when("kind", &["force-ramp"]),
        field("points", list(wrench_points(), 1, None, "points"), Required, "`{ at_s, force_n }`: [forces at the hand](../guides/endpoint_session.md), linear between the points; the last one stays").when("kind", &["endpoint-force"]),
        field("points", list(held_points(rising_time()), 1, None, "points"), Required, "`{ at_s, held }`: times from which an object is held or not; never held for longer than `longest_hold_s` (E753)").when("kind", &["held"]),
        field("posture_deg", Kind::Table(posture()), Optional, "posture of the arm, nine angles; without it the host measures them").when("kind", &["endpoint-force"]),
        field("stale_after_ms", number_in("ms", 0, SensorSource::STALE_AFTER_MS), Or(100), "age from which a measured angle is stale; not together with `posture_deg`").when("kind", &["endpoint-force"]),
        field("offset_n", offset, Required, "centre of the sine").when("kind", &["force-sine"]),
        field("amplitude_n", amplitude, Required, "amplitude of the sine").when("kind", &["force-sine"]),
        field("frequency_hz", Kind::Real(SINE), Required, "frequency of the sine").when("kind", &["angle-sine", "force-sine"]),
        field("forces", list(forces, 0, Some(CHANNELS), "forces"), Optional, "forces of further channels with `force`, sent with every setpoint of any kind: each is `{ channel, points }` as for a `force-ramp`, or `{ channel, offset_n, amplitude_n, frequency_hz }` as for a `force-sine`; `host-tool/sessions/ten_forces.toml` streams ten of them with `kind = \"keep-alive\"`"),
        field("list", list(list_of_pulses(), 0, None, "lists"), Optional, "`{ at_s, channel, pulses }`: [lists of pulses](#lists), each played once in place of its channel's own pulses"),
        field("bounds", list(bounds, 0, Some(CHANNELS), "channels"), Optional, "`{ channel, least, most, per_s, shortest_s }`: range of what a live client may stream instead, for the choice of [muscle models](../how/muscle.md); a run plays the file's own setpoints, which must stay within the bounds (but a force may go below `least`)"),
        field("values", list(values(), 1, Some(CHANNELS), "channels"), Required, "`{ channel, value, width_us }`: constant amplitudes; not for channels of the joint or the wall").when("kind", &["amplitudes"]),
        field("values", list(values(), 1, Some(CHANNELS), "channels"), Optional, "the same constant amplitudes, sent beside the other setpoints").when("kind", &["keep-alive", "amplitude-ramp", "amplitude-steps", "angle-sine", "angle-steps", "force-ramp", "force-sine", "endpoint-force", "held"]),
    ]
}

#[rustfmt::skip]
fn measure() -> Section {
    vec![
        field("from_s", time(0), Or(0), "start of the window"),
        field("to_s", time(0), OrTold("`duration_s`".into()), "end of the window, after `from_s`"),
    ]
}

#[rustfmt::skip]
fn body() -> Section {
    let seconds = |least| Kind::Whole(Number::within("s", 3, least, DAY_US / 1000));
    let approaches = vec![
        field("at_s", seconds(0), Required, "start of the movement; times must rise"),
        field("speed_deg_per_s", Kind::Whole(Number::within("°/s", 3, 1_000, 360_000)), Required, "speed of the movement into flexion"),
        field("for_s", seconds(1), Required, "time for which the wearer holds the arm there and pushes"),
    ];
    let d = ElbowSpec::default();
    let real = |unit, most| Kind::Real(Number::within(unit, 0, 0, most));
    let or = |value: f64| OrTold(value.to_string());
    let finger = FingerSpec::participant(Participant::P);
    let joint_defaults = |finger: f64, elbow: f64| OrTold(format!("{finger} of a finger, {elbow} of an elbow"));
    let sight = vec![
        field("delay_s", real("s", 2), Required, "reaction time of the wearer to what they see"),
        field("every_s", real("s", 10), Required, "time from one correction to the next; not 0"),
        field("line_deg", real("°", 145), Required, "angle of the line"),
    ];
    let yields = vec![
        field("delay_s", real("s", 2), Required, "delay from a pulse to the reduced push"),
        field("to", real("", 1), Required, "share of `push_nm` that remains"),
        field("at_ma", real("mA", 200), Required, "smallest current that is felt"),
    ];
    let mut fields = vec![
        field("kind", Kind::Choice(vec!["finger", "elbow", "hand", "arm", "still"]), Required, "an index finger; an elbow whose wearer moves it; a multibody forearm model with hand (below); a right arm under nine electrodes (below); or dummy loads"),
        field("participant", one_of(&PARTICIPANTS), OrTold("the wearer of `[wearer] file`".into()), "participant of Hamana 2022, table 7; required unless the wearer file is that of P, Q or S").when("kind", &["finger"]),
    ];
    fields.extend(point_channels());
    fields.extend(["triceps", "biceps"].map(|muscle| field(muscle, channel_number(), Required, "channel of its electrodes; each must be different").when("kind", &["elbow"])));
    fields.extend([
        field("flexor_nm", real("N·m", 10), or(finger.flexor_torque_nm), "torque of one flexor point at full recruitment and 50 Hz").when("kind", &["finger"]),
        field("extensor_nm", real("N·m", 10), or(finger.extensor_torque_nm), "torque of the extensor at full recruitment and 50 Hz").when("kind", &["finger"]),
        field("second_point_nm", real("N·m", 10), or(0.0), "torque that the second of two conducted points adds, also at full recruitment and 50 Hz; an assumption of the file's author: both points then begin at the two-point thresholds of table 7; with 0, two points pull like the stronger one").when("kind", &["finger"]),
        field("fatigue_floor", real("", 1), or(finger.fatigue_floor), "share of a muscle's force that remains after endless full force, 0 to 1; 1 means no fatigue").when("kind", &["finger"]),
        field("fatigue_time_s", real("s", 86_400), or(finger.fatigue_time_s), "time constant of fatigue and of recovery; not 0").when("kind", &["finger"]),
        field("subject", Kind::Whole(Number::within("", 0, 1, 10)), OrTold("the mean".into()), "subject of Lee 2020, table 4, whose dynamics both muscles have").when("kind", &["elbow"]),
        field("triceps_nm", real("N·m", 100), or(d.triceps.torque_nm), "torque of the fully recruited muscle at 50 Hz").when("kind", &["elbow"]),
        field("triceps_threshold_ma", real("mA", 100), or(d.triceps.threshold_ma), "current at which it begins to pull, at 35 µs").when("kind", &["elbow"]),
        field("triceps_max_ma", real("mA", 200), or(d.triceps.max_ma), "current at which it is fully recruited, at 35 µs").when("kind", &["elbow"]),
        field("biceps_nm", real("N·m", 100), or(d.biceps.torque_nm), "torque of the fully recruited muscle at 50 Hz").when("kind", &["elbow"]),
        field("biceps_threshold_ma", real("mA", 100), or(d.biceps.threshold_ma), "current at which it begins to pull, at 25 µs").when("kind", &["elbow"]),
        field("biceps_max_ma", real("mA", 200), or(d.biceps.max_ma), "current at which it is fully recruited, at 25 µs").when("kind", &["elbow"]),
        field("recruitment_curvature", real("", 50), or(d.recruitment_curvature), "curvature of recruitment over current; not 0").when("kind", &["elbow"]),
        field("delay_ms", Kind::Whole(Number::within("ms", 3, 0, 1_000_000)), joint_defaults(f64::from(finger.electromechanical_delay_us) * 1e-3, f64::from(d.electromechanical_delay_us) * 1e-3), "from a pulse to its effect on the muscle").when("kind", &["finger", "elbow"]),
        field("inertia_kg_m2", real("kg·m²", 10), joint_defaults(finger.inertia_kg_m2, d.inertia_kg_m2), "moment of inertia about the joint").when("kind", &["finger", "elbow"]),
        field("stiffness_nm_per_rad", real("N·m/rad", 100), joint_defaults(finger.stiffness_nm_per_rad, d.stiffness_nm_per_rad), "passive stiffness towards the rest angle").when("kind", &["finger", "elbow"]),
        field("damping_nm_s_per_rad", real("N·m·s/rad", 100), joint_defaults(finger.damping_nm_s_per_rad, d.damping_nm_s_per_rad), "passive viscous friction").when("kind", &["finger", "elbow"]),
        field("active_damping_s_per_rad", real("s/rad", 10), or(d.active_damping_s_per_rad), "friction per torque of each active muscle").when("kind", &["elbow"]),
        field("start_deg", real("°", 145), or(d.person.start_deg), "angle at which the arm waits and to which it returns").when("kind", &["elbow"]),
        field("push_nm", real("N·m", 100), or(d.person.push_nm), "largest voluntary torque of the wearer").when("kind", &["elbow"]),
        field("approaches", list(approaches, 0, None, "approaches"), Required, "`{ at_s, speed_deg_per_s, for_s }`: movements into flexion, each held and pushed for `for_s`; times count from the start of the simulation, a few tenths of a second before the trains").when("kind", &["elbow"]),
        field("sight", Kind::Table(sight), Optional, "`{ delay_s, every_s, line_deg }`: the wearer sees the arm's angle and a line and corrects from time to time; without it, the wearer sees nothing").when("kind", &["elbow"]),
        field("yields", Kind::Table(yields), Optional, "`{ delay_s, to, at_ma }`: the wearer pushes less while stimulation is felt; without it, always with the same effort").when("kind", &["elbow"]),
        field("load_ohm", Kind::Whole(Number::within("Ω", 0, 1, 1_000_000)), Or(2_000), "resistance of the dummy load on every channel").when("kind", &["still"]),
    ]);
    fields.extend(hand_fields());
    fields.extend(arm_fields());
    fields
}

#[rustfmt::skip]
fn trigger() -> Section {
    vec![
        field("at_s", Kind::Wholes(Number::within("s", 6, TRIGGER_FIRST_US, DAY_US).bound("at most `duration_s`"), "a list of numbers"), Optional, "edges at these times, rising, at least 1 ms apart"),
        field("every_s", time(TRIGGER_LEAST_US), Required, "time from edge to edge").without("at_s"),
        field("from_s", time(TRIGGER_FIRST_US), OrTold("`every_s`, but at least 0.01".into()), "time of the first edge").without("at_s"),
        field("held_s", time(TRIGGER_LEAST_US), Optional, "time for which the input is held after each edge; it must be released at least 1 ms before the next one; required for a `\"gated\"` train, without effect on others"),
    ]
}

#[rustfmt::skip]
fn fidelity() -> Section {
    vec![
        field("tolerance_percent", Kind::Whole(Number::within("%", 2, 1, 60_000)), Required, "largest accepted error of the muscle quantities that the session uses"),
        field("try_s", Kind::Whole(Number::within("s", 6, 1_000_000, 600_000_000)), Or(60_000_000), "duration, from the start, of the part of a longer session that is tried"),
    ]
}
