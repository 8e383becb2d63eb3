//! The fields of `[body] kind = "hand"`: every number of a [`FittedHand`] once, with the power of
//! ten by which the file scales it, so that reader and writer agree to the bit.

use hal_sim::body::hand::spec::{A, B, E, HandSpec, RETURN};
use hal_sim::body::hand::{FittedHand, Rule};

use crate::fields::decimal::format_toml_number;
use crate::fields::field::Need::{Or, OrTold, OrWord, Required};
use crate::fields::field::{Field, Kind, Need, Number, channel_number, field, one_of};

/// Quantities of the electric field that charge a nerve, and their names in session files.
pub(super) const RULES: [(&str, Rule); 3] = [
    ("potential", Rule::Potential),
    ("curvature", Rule::Curvature),
    ("field", Rule::Field),
];

/// Shapes of the electrodes that a session file can name: round (2.5 cm) or small (2.0 × 1.5 cm).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Electrodes {
    Round,
    Small,
}

pub(super) const ELECTRODES: [(&str, Electrodes); 2] =
    [("round", Electrodes::Round), ("small", Electrodes::Small)];

/// Names of the fields that give the channels of electrode A, electrode B and the extensor's
/// electrode.
pub(super) const CHANNELS: [&str; RETURN] = ["flexor_a", "flexor_b", "extensor"];

/// Smallest and largest number of motor units in a pool. The largest is bounded because each unit
/// has 4096 places of its own in the random stream of the seed.
pub(super) const UNITS: (i64, i64) = (1, 256);

/// A number of the simulated hand that a session file can set, with the properties of its field.
pub(super) struct Quantity {
    pub(super) name: &'static str,
    unit: &'static str,
    /// Smallest and largest value of the field, in 10^−`places` of the unit.
    range: (i64, i64),
    places: i32,
    /// Power of ten between the file and the hand: the value in the hand is 10^`power` times the
    /// value in the file.
    pub(super) power: i32,
    /// Function that returns a reference to this number in a hand.
    pub(super) of: fn(&mut FittedHand) -> &mut f64,
    meaning: &'static str,
}

/// Names of the numbers that a file must give, because they have no default.
const REQUIRED: [&str; 3] = ["forearm_m", "around_m", "threshold_factor"];

#[rustfmt::skip]
pub(super) const QUANTITIES: [Quantity; 32] = [
    quantity("forearm_m", "m", 3, (100, 500), 0, |h| &mut h.spec.forearm_m, "length of the forearm from elbow to wrist"),
    quantity("around_m", "m", 3, (100, 600), 0, |h| &mut h.spec.around_m, "circumference of the forearm"),
    quantity("threshold_factor", "V, V/m² or V/m", 6, (1, 1_000_000_000_000_000), 0, |h| &mut h.factor, "stimulus that a nerve of median threshold needs at rest: V of potential, V/m² of curvature or V/m of field, according to `rule`; the thresholds of all nerves scale with it, and so does the voltage from which the wearer feels anything"),
    quantity("shift_along_mm", "mm", 0, (-100, 100), -3, |h| &mut h.shift_m[0], "shift of the skin from its rest position, along the forearm"),
    quantity("shift_around_mm", "mm", 0, (-100, 100), -3, |h| &mut h.shift_m[1], "shift of the skin from its rest position, around the forearm"),
    quantity("fat_mm", "mm", 0, (1, 30), -3, |h| &mut h.spec.tissue.fat_m, "thickness of fat and skin over the muscle"),
    quantity("fat_s_per_m", "S/m", 3, (5, 200), 0, |h| &mut h.spec.tissue.fat_s_per_m, "conductivity of fat"),
    quantity("muscle_along_s_per_m", "S/m", 3, (50, 2_000), 0, |h| &mut h.spec.tissue.along_s_per_m, "conductivity of muscle along its fibres"),
    quantity("muscle_across_s_per_m", "S/m", 3, (20, 1_000), 0, |h| &mut h.spec.tissue.across_s_per_m, "conductivity of muscle across its fibres"),
    quantity("skin_nf_per_cm2", "nF/cm²", 0, (0, 1_000), -9, |h| &mut h.spec.skin.farad_per_cm2, "capacitance of skin"),
    quantity("skin_kohm_cm2", "kΩ·cm²", 2, (1, 100_000), 3, |h| &mut h.spec.skin.ohm_cm2, "resistance of skin parallel to its capacitance, at a small current"),
    quantity("skin_series_ohm", "Ω", 0, (1, 10_000), 0, |h| &mut h.spec.skin.series_ohm, "resistance in series with the skin, under a round electrode"),
    quantity("skin_half_ma_per_cm2", "mA/cm²", 3, (1, 10_000_000), -3, |h| &mut h.spec.skin.half_a_per_cm2, "current density at which the parallel resistance has halved"),
    quantity("coupling_a", "", 2, (1, 10_000), 0, |h| &mut h.spec.coupling[A], "factor on the effect of a current through A on nerves, relative to what fat and depth there predict"),
    quantity("coupling_b", "", 2, (1, 10_000), 0, |h| &mut h.spec.coupling[B], "the same factor for B"),
    quantity("coupling_extensor", "", 2, (1, 10_000), 0, |h| &mut h.spec.coupling[E], "the same factor for the extensor's electrode"),
    quantity("return_factor", "", 2, (1, 10_000), 0, |h| &mut h.spec.return_factor, "factor on the skin impedance under the return electrode, relative to that of its area, 4 × 9 cm above the wrist"),
    quantity("limiter_ma", "mA", 1, (1, 10_000), -3, |h| &mut h.spec.limiter_a, "current that the limiter of the stages lets through; the device does not take it into account"),
    quantity("leak_us", "µs", 0, (10, 10_000), -6, |h| &mut h.spec.membrane.leak_s, "time constant of the leak of a nerve"),
    quantity("absolute_ms", "ms", 0, (0, 100), -3, |h| &mut h.spec.membrane.absolute_s, "absolute refractory period of a nerve"),
    quantity("relative_ms", "ms", 0, (0, 100), -3, |h| &mut h.spec.membrane.relative_s, "time after a spike during which the threshold of a nerve is raised"),
    quantity("threshold_spread", "", 0, (0, 2), 0, |h| &mut h.spec.threshold_spread, "standard deviation of the logarithm of thresholds within a pool"),
    quantity("scatter", "", 2, (1, 1_000), 0, |h| &mut h.spec.scatter, "scatter of the positions and thresholds of the nerves in a pool, relative to the assumed one"),
    quantity("shift_mm_per_deg", "mm/°", 0, (-2, 2), -3, |h| &mut h.spec.shift_m_per_deg, "shift of the skin over the muscle with pronation; a session has no pronation"),
    quantity("flexor_nm", "N·m", 0, (0, 10), 0, |h| &mut h.spec.flexor_nm, "torque of a flexor with every motor unit at 50 Hz"),
    quantity("extensor_nm", "N·m", 0, (0, 10), 0, |h| &mut h.spec.extensor_nm, "torque of the index finger's extensor with every motor unit at 50 Hz"),
    quantity("stiffness_nm_per_rad", "N·m/rad", 3, (1, 100_000), 0, |h| &mut h.spec.stiffness_nm_per_rad, "stiffness of a digit towards the rest angle"),
    quantity("inertia_kg_m2", "kg·m²", 7, (1, 10_000_000), 0, |h| &mut h.spec.motion.inertia_kg_m2, "moment of inertia of a digit"),
    quantity("damping_nm_s_per_rad", "N·m·s/rad", 0, (0, 100), 0, |h| &mut h.spec.motion.damping_nm_s_per_rad, "passive friction of a digit"),
    quantity("delay_ms", "ms", 0, (5, 1_000), -3, |h| &mut h.spec.motion.delay_s, "from a spike to its effect on the muscle"),
    quantity("fatigue_floor", "", 0, (0, 1), 0, |h| &mut h.spec.motion.fatigue_floor, "share of a motor unit's force that remains after endless stimulation at 50 Hz; 1 means no fatigue"),
    quantity("fatigue_time_s", "s", 2, (1, 8_640_000), 0, |h| &mut h.spec.motion.fatigue_time_s, "time constant of fatigue and of recovery"),
    // The positions of A, B and the extensor's electrode are pairs: see `pads_mm`.
];

const fn quantity(
    name: &'static str,
    unit: &'static str,
    places: i32,
    range: (i64, i64),
    power: i32,
    selector: fn(&mut FittedHand) -> &mut f64,
    meaning: &'static str,
) -> Quantity {
    Quantity {
        name,
        unit,
        range,
        places,
        power,
        of: selector,
        meaning,
    }
}

impl Quantity {
    /// Formats this number of `hand` in the unit of the session file, exactly enough to be read
    /// back bit for bit.
    pub(super) fn format_value(&self, hand: &FittedHand) -> String {
        format_toml_number(*(self.of)(&mut hand.clone()), -self.power)
    }

    fn field(&self, nominal: &FittedHand) -> Field {
        let (least, most) = self.range;
        let kind = Kind::Real(Number::within(self.unit, self.places, least, most));
        let need = match REQUIRED.contains(&self.name) {
            true => Required,
            false => OrTold(self.format_value(nominal).trim_end_matches(".0").to_owned()),
        };
        hand_field(self.name, kind, need, self.meaning)
    }
}

/// Returns the default hand. Its dimensions and its threshold factor are placeholders, which the
/// file must replace.
pub(super) fn nominal() -> FittedHand {
    let pad = HandSpec::round_pad(0.0, 0.0);
    FittedHand {
        spec: HandSpec::nominal(1.0, 1.0, 0),
        points: [pad; RETURN],
        factor: 1.0,
        shift_m: [0.0; 2],
        channels: [0, 1, 2],
        simulated_units: None,
    }
}

/// Returns the fields that only `kind = "hand"` has.
pub(super) fn hand_fields() -> Vec<Field> {
    let nominal = nominal();
    let millimetres = Number::within("mm", 0, -300, 600);
    let (least, most) = UNITS;
    let units = Number::within("", 0, least, most);
    let mut fields = vec![
        hand_field(
            "pads_mm",
            Kind::Pairs(millimetres, RETURN, "3 pairs of numbers"),
            Required,
            "centres of the electrodes of A, B and the extensor: distance along the forearm from the elbow, and around it from the palmar midline, positive towards the thumb; all on the forearm, without overlap with each other or the return (E481)",
        ),
        hand_field(
            "electrodes",
            one_of(&ELECTRODES),
            OrWord("round"),
            "shape of all three electrodes: round (2.5 cm) or small (2.0 × 1.5 cm)",
        ),
        hand_field(
            "rule",
            one_of(&RULES),
            OrWord("curvature"),
            "quantity of the electric field that charges a nerve: the potential, its curvature along the fibres, or the field along the nerve's own direction",
        ),
        hand_field(
            "sums",
            Kind::Flag,
            OrWord("true"),
            "whether the charge that a pulse leaves in a nerve adds to that of the next pulse",
        ),
        hand_field(
            "units",
            Kind::Whole(units),
            Or(nominal.spec.units as i64),
            "number of motor units in each of the eight pools",
        ),
        hand_field(
            "seed",
            Kind::Whole(Number::any("", 0, "whole, of 64 bits")),
            Or(0),
            "seed of the random positions, thresholds and directions of the nerves",
        ),
    ];
    fields.extend(QUANTITIES.iter().map(|quantity| quantity.field(&nominal)));
    fields
}

/// Returns the fields that give the channels of the three electrodes of a finger or a hand.
pub(super) fn point_channels() -> [Field; RETURN] {
    let meaning =
        "channel of this point, whether the session uses it or not; each must be different";
    CHANNELS.map(|point| {
        field(point, channel_number(), Required, meaning).when("kind", &["finger", "hand"])
    })
}

fn hand_field(name: &'static str, kind: Kind, need: Need, meaning: &'static str) -> Field {
    field(name, kind, need, meaning).when("kind", &["hand"])
}
