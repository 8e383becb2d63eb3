//! `[body]`: the simulated wearer. A board is attached to a real wearer and ignores it.

use hal_sim::body::arm::{ArmSpec, Support};
use hal_sim::body::elbow::{TORQUE_FREQUENCY_HZ, VisionSpec, VoluntaryApproach, YieldSpec};
use hal_sim::body::finger::Pair;
use hal_sim::body::hand::FittedHand;
use hal_sim::body::muscle::SUBJECTS;
use hal_sim::body::{ElbowSpec, FingerSpec};

use super::arm::read_arm;
use super::channel::Channel;
use super::fields::PARTICIPANTS;
use super::hand::read_hand;
use super::sites::read_sites;
use super::worn::WearerContext;
use crate::fields::error::Problem;
use crate::fields::table::Table;

/// The simulated wearer of a session, as `[body]` configures it.
#[derive(Clone, PartialEq, Debug)]
pub enum BodySpec {
    /// Index finger with two electrodes over its flexors (points A and B) and one over its
    /// extensor.
    Finger(Box<FingerSpec>),
    /// Forearm that flexes at the elbow by its stimulated biceps and triceps, and by the simulated
    /// wearer's own movements.
    Elbow(Box<ElbowSpec>),
    /// Multibody forearm model with hand, under three electrodes that belong to channels.
    Hand(Box<FittedHand>),
    /// Right arm under nine electrodes, channels 1 to 9.
    Arm {
        /// Anatomy of the arm, and its posture.
        spec: Box<ArmSpec>,
        /// Support of the forearm: the cuff of a force sensor, or nothing but the wearer.
        held: Support,
        /// Time step of its simulation, ms.
        step_ms: u32,
    },
    /// Dummy load on every channel, without a wearer.
    Still {
        /// Resistance of each load, Ω.
        load_ohm: u32,
    },
}

/// Reads `[body]`. `channels` are the valid channels of the file. `person` is the wearer whom the
/// file names.
pub(super) fn read_body(
    t: &Table<'_>,
    channels: &[Channel],
    person: &WearerContext,
) -> Option<BodySpec> {
    if !t.is_valid() {
        return None;
    }
    Some(match t.word("kind") {
        "finger" => BodySpec::Finger(Box::new(read_finger(t, person)?)),
        "elbow" => BodySpec::Elbow(Box::new(read_elbow(t)?)),
        "hand" => BodySpec::Hand(Box::new(read_hand(t, channels)?)),
        "arm" => {
            let (spec, held) = read_arm(t);
            let spec = Box::new(spec);
            BodySpec::Arm {
                spec,
                held,
                step_ms: 1,
            }
        }
        _ => BodySpec::Still {
            load_ohm: t.integer("load_ohm"),
        },
    })
}

/// Reads a finger of a participant of Hamana 2022. If the file names no participant, the
/// participant is the wearer of the wearer file.
fn read_finger(t: &Table<'_>, person: &WearerContext) -> Option<FingerSpec> {
    let participant = if t.has("participant") {
        t.choice("participant", &PARTICIPANTS)?
    } else {
        let name = person.worn.as_ref().map(|worn| &*worn.wearer.name);
        let known = PARTICIPANTS
            .iter()
            .find(|participant| Some(participant.0) == name);
        if known.is_none() && !person.is_unknown {
            t.report("participant", Problem::MissingField {});
        }
        known?.1
    };
    let mut spec = FingerSpec::participant(participant);
    let [flexor_a, flexor_b, extensor] = read_sites(t, ["flexor_a", "flexor_b", "extensor"])?;
    spec.flexor_a.channel = flexor_a;
    spec.flexor_b.channel = flexor_b;
    spec.extensor.channel = extensor;
    let real = |name, default: &mut f64| *default = t.real(name).unwrap_or(*default);
    real("flexor_nm", &mut spec.flexor_torque_nm);
    real("extensor_nm", &mut spec.extensor_torque_nm);
    real("fatigue_floor", &mut spec.fatigue_floor);
    real("fatigue_time_s", &mut spec.fatigue_time_s);
    real("inertia_kg_m2", &mut spec.inertia_kg_m2);
    real("stiffness_nm_per_rad", &mut spec.stiffness_nm_per_rad);
    real("damping_nm_s_per_rad", &mut spec.damping_nm_s_per_rad);
    if t.has("delay_ms") {
        spec.electromechanical_delay_us = t.integer("delay_ms");
    }
    let one_nm = spec.flexor_torque_nm;
    let adds = t.real("second_point_nm").filter(|nm| *nm > 0.0);
    spec.pair = adds.map(|adds_nm| Pair {
        torque_nm: [one_nm + adds_nm, one_nm],
        threshold_v: participant.pair_thresholds_v(),
    });
    Some(spec)
}

/// Reads an elbow; numbers that the file leaves out are those of [`ElbowSpec::default`].
fn read_elbow(t: &Table<'_>) -> Option<ElbowSpec> {
    let mut spec = ElbowSpec::default();
    let [triceps, biceps] = read_sites(t, ["triceps", "biceps"])?;
    spec.triceps.channel = triceps;
    spec.biceps.channel = biceps;
    let real = |name, default: &mut f64| *default = t.real(name).unwrap_or(*default);
    real("damping_nm_s_per_rad", &mut spec.damping_nm_s_per_rad);
    real("inertia_kg_m2", &mut spec.inertia_kg_m2);
    real("stiffness_nm_per_rad", &mut spec.stiffness_nm_per_rad);
    real(
        "active_damping_s_per_rad",
        &mut spec.active_damping_s_per_rad,
    );
    real("recruitment_curvature", &mut spec.recruitment_curvature);
    for (muscle, [nm, threshold, max]) in [
        (
            &mut spec.triceps,
            ["triceps_nm", "triceps_threshold_ma", "triceps_max_ma"],
        ),
        (
            &mut spec.biceps,
            ["biceps_nm", "biceps_threshold_ma", "biceps_max_ma"],
        ),
    ] {
        real(nm, &mut muscle.torque_nm);
        real(threshold, &mut muscle.threshold_ma);
        real(max, &mut muscle.max_ma);
    }
    if t.has("delay_ms") {
        spec.electromechanical_delay_us = t.integer("delay_ms");
    }
    if t.has("subject") {
        let subject: u8 = t.integer("subject"); // 1 or more
        let subject = SUBJECTS.get(usize::from(subject) - 1);
        let dynamics = subject?.normalised_at(TORQUE_FREQUENCY_HZ);
        (spec.triceps.dynamics, spec.biceps.dynamics) = (dynamics, dynamics);
    }
    spec.person.sight = t.optional_table("sight", |sight| {
        let real = |name| sight.real(name);
        Some(VisionSpec {
            delay_s: real("delay_s")?,
            every_s: real("every_s")?,
            line_deg: real("line_deg")?,
        })
    })?;
    spec.person.yields = t.optional_table("yields", |yields| {
        let real = |name| yields.real(name);
        Some(YieldSpec {
            delay_s: real("delay_s")?,
            to: real("to")?,
            at_ma: real("at_ma")?,
        })
    })?;
    real("start_deg", &mut spec.person.start_deg);
    real("push_nm", &mut spec.person.push_nm);
    for item in t.tables("approaches").iter().filter(|item| item.is_valid()) {
        let milli = |name| item.integer::<i64>(name) as f64 * 1e-3;
        let approach = VoluntaryApproach {
            at_s: milli("at_s"),
            speed_deg_per_s: milli("speed_deg_per_s"),
            for_s: milli("for_s"),
        };
        let before = spec.person.approaches.last();
        if before.is_some_and(|b| b.at_s + b.for_s > approach.at_s) {
            item.report_not_after("at_s", "the end of the approach before it".into());
            return None;
        }
        spec.person.approaches.push(approach);
    }
    Some(spec)
}
