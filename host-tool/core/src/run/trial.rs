//! Converts the device's messages into the rows of a record.

use super::SessionFile;
use crate::analysis::LIMIT_CYCLE;
use crate::record::{
    ChannelInfo, DeviceState, Edge, ElectrodeReading, FidelityFound, Sample, State, Trial,
    TrialWearer, WallPlace, sha256,
};
use crate::session::{Session, level_name};
use firmware::control::ForceGap;
use firmware::haptics::{Hold, ModulationSpec, MotionPhase, Side};
use firmware::link::{Counters, Event, ForceSample, JointSample, Telemetry};
use firmware::safety::{self, Fault, StopCause};
use firmware::units::Amplitude;
use hal_sim::trace::{Edge as TraceEdge, State as TraceState, Trace};

/// Creates a trial for the session of `file`, as yet without rows.
#[must_use]
pub fn begin_trial(file: &SessionFile) -> Trial {
    let session = &file.session;
    let seconds = |us: u64| us as f64 / 1e6;
    let milli = |value: f64| value / 1e3;
    let channels = session.channels.iter().map(|channel| ChannelInfo {
        number: channel.number,
        name: channel.name.clone(),
        unit: channel.unit().symbol().to_owned(),
        limit: milli(channel.spec.limit.get().into()),
        live_width: channel.has_live_width(),
        muscle: channel.muscle.is_some(),
        model: (channel.muscle.as_ref())
            .map(|muscle| level_name(muscle.initial_level()).to_owned()),
        force: channel.force.is_some(),
        line: session.limb.as_ref().is_some_and(|limb| {
            let mut lines = limb.lines.iter();
            lines.any(|line| line.channel == channel.index())
        }),
        joint: modulating_joint(session, channel.index()),
    });
    let wall = session.wall.map(|wall| WallPlace {
        at_deg: milli(wall.at_mdeg.into()),
        stops_flexion: wall.side == Side::Flexion,
        pre_wall_deg: wall
            .pre_wall
            .map_or(0.0, |pre| milli(pre.depth_mdeg.into())),
    });
    Trial {
        name: session.title.clone(),
        session_file: file.name.clone(),
        session_text: file.text.clone(),
        session_sha256: Some(sha256(file.text.as_bytes())),
        wearer: session.worn.as_ref().map(|worn| TrialWearer {
            file: worn.file.clone(),
            name: worn.wearer.name.clone(),
            evidence: worn.wearer.evidence.word().to_owned(),
            sha256: sha256(worn.text.as_bytes()),
            text: worn.text.clone(),
        }),
        fidelity: session.has_fidelity.then(|| FidelityFound {
            telemetry_ms: session.telemetry_ms,
            law_period_ms: session.joint.as_ref().map(|joint| joint.law_period_ms),
            finger_step_us: session.finger().map(|finger| finger.step_us),
            hand_units: session
                .hand()
                .and_then(|hand| hand.simulated_units)
                .map(|units| units as u32), // at most 256
            arm_step_ms: session.arm_step_ms(),
        }),
        duration_s: seconds(session.duration_us),
        channels: channels.collect(),
        measure: session
            .measure
            .map(|(from, to)| (seconds(from), seconds(to))),
        joint: session.joint.is_some(),
        wall,
        ..Trial::default()
    }
}

/// Returns the number of the joint whose angle modulates a channel; `None` if no joint does.
fn modulating_joint(session: &Session, channel: u8) -> Option<u8> {
    let joints = session.modulations.iter().map(|joint| &joint.spec);
    let is_of = |spec: &&ModulationSpec| {
        spec.muscles()
            .any(|modulated_spec| modulated_spec.channel == channel)
    };
    joints.into_iter().find(is_of).map(|spec| spec.joint)
}

/// Converts a reading of the electrode check into the form that a record contains. `channel` counts
/// from 0, and `channels` provides its unit. The load in Ω is computed for voltage stages only.
pub fn electrode_reading(
    channels: &[ChannelInfo],
    channel: u8,
    applied: Amplitude,
    current_ua: u32,
) -> ElectrodeReading {
    let number = channel.saturating_add(1);
    let of_volts = |c: &ChannelInfo| c.number == number && c.unit == "V";
    let is_voltage = channels.iter().any(of_volts) && current_ua > 0;
    ElectrodeReading {
        channel: number,
        applied: f64::from(applied.get()) / 1e3,
        current_ma: f64::from(current_ua) / 1e3,
        load_ohm: is_voltage.then(|| f64::from(applied.get()) * 1e3 / f64::from(current_ua)),
    }
}

/// Returns the time from `begin_us` to `at_us`, s; negative if `at_us` is earlier. The result is
/// the floating-point number nearest to the exact time, so that it is printed with at most six
/// decimals.
pub fn seconds_between(at_us: u64, begin_us: u64) -> f64 {
    (at_us.cast_signed() - begin_us.cast_signed()) as f64 / 1e6
}

/// Converts telemetry into a sample with the time `t_s`, s since the start of the trains. Integers
/// are converted by division and not by multiplication with a fraction, because only division gives
/// the nearest floating-point number.
pub fn to_sample(telemetry: &Telemetry, t_s: f64, true_deg: Option<f64>) -> Sample {
    let milli = |value: u32| f64::from(value) / 1e3;
    let force =
        |f: fn(&ForceSample) -> Option<f64>| telemetry.force_control.iter().map(f).collect();
    let side = |f: fn(ForceGap) -> u32| {
        let gaps = telemetry.force_control.iter().map(|sample| sample.gap);
        gaps.map(|gap| gap.map(|gap| milli(f(gap)))).collect()
    };
    let lift = |f: fn(&JointSample) -> Option<f64>| {
        let joints = telemetry.lift.iter().flat_map(|lift| &lift.joints);
        joints.map(f).collect()
    };
    let amplitudes = telemetry.amplitudes.iter();
    let widths = telemetry.widths_us.iter();
    Sample {
        t_s,
        target_deg: degrees(telemetry.reference_centideg),
        measured_deg: degrees(telemetry.measured_centideg),
        true_deg,
        effort: telemetry.effort_milli.map(|e| f64::from(e) / 1e3),
        limiting: telemetry.limiting,
        state: state(telemetry.state),
        amplitudes: amplitudes.map(|a| a.map(|a| milli(a.get()))).collect(),
        widths_us: widths.map(|w| w.map(f64::from)).collect(),
        forces_n: telemetry.forces_mn.iter().map(|f| f.map(milli)).collect(),
        wanted_n: force(|f| f.reference_mn.map(|mn| f64::from(mn) / 1e3)),
        rates_hz: force(|f| f.period_us.map(|us| 1e6 / f64::from(us))),
        below_n: side(|gap| gap.lower_mn),
        above_n: side(|gap| gap.upper_mn),
        hand_n: telemetry.wrench.map_or_else(Vec::new, |wrench| {
            let newtons = wrench.reference_mn.map(|mn| Some(f64::from(mn) / 1e3));
            newtons.to_vec()
        }),
        held: telemetry.lift.as_ref().map(|lift| match lift.hold {
            Hold::Released => 0.0,
            Hold::Held => 1.0,
            Hold::Expired => 2.0,
        }),
        joint_deg: lift(|joint| degrees(joint.measured_centideg)),
        phase: lift(|joint| {
            let phase = |phase| [1.0, -1.0][usize::from(phase == MotionPhase::Drop)];
            joint.phase.map(phase)
        }),
        hand_made: (telemetry.wrench).map(|wrench| f64::from(wrench.achievable_permille) / 1e3),
        hand_true_n: Vec::new(),
    }
}

fn degrees(centi: Option<i16>) -> Option<f64> {
    centi.map(|c| f64::from(c) / 1e2)
}

/// Converts a device's state into the form that a record contains.
fn state(state: safety::State) -> DeviceState {
    match state {
        safety::State::Boot => DeviceState::Boot,
        safety::State::Idle => DeviceState::Idle,
        safety::State::Armed => DeviceState::Armed,
        safety::State::Stimulating => DeviceState::Stimulating,
        safety::State::Stopping => DeviceState::Stopping,
        safety::State::Fault => DeviceState::Fault,
    }
}

/// Describes an event of the device in words.
pub fn describe_event(event: &Event) -> String {
    match event {
        Event::Stopping(cause) => format!("stopping: {cause:?}"),
        Event::Stopped(cause) => format!("stopped: {cause:?}"),
        Event::Faulted(record) => format!("fault {}: {:?}", record.fault.number(), record.fault),
        Event::Recovered => "fault acknowledged".to_owned(),
        Event::Electrode {
            channel,
            current_ua,
            ..
        } => format!("electrode {}: {current_ua} µA", channel.saturating_add(1)),
        Event::TriggerEdge => "edge of the trigger input".to_owned(),
        Event::SyncEdge => "edge of the sync output".to_owned(),
        Event::HoldExpired => {
            "object held for too long: stimulation ended until it is released".to_owned()
        }
        Event::LimitCycle {
            swing_centideg,
            period_ms,
            gain_milli,
        } => format!(
            "{LIMIT_CYCLE}{:.1}° peak to peak, period {period_ms} ms; feedback at {:.0} %",
            f64::from(*swing_centideg) * 1e-2,
            f64::from(*gain_milli) * 1e-1
        ),
    }
}

/// Returns what a user can do after the device has ended a session with this event.
pub fn advice(event: &Event) -> &'static str {
    if let Event::Faulted(record) = event
        && record.fault == Fault::LimitCycle
    {
        return "the joint oscillated at every feedback gain: check the sensor and what moves the \
                joint, fit the wearer's model (strength, lead_ms), then run again with \
                --acknowledge";
    }
    let (Event::Stopping(cause) | Event::Stopped(cause)) = event else {
        return "find the cause of the fault, then run again with --acknowledge";
    };
    match cause {
        StopCause::Request => "another program or request stopped it; run again",
        StopCause::HostSilent => {
            "the link or this computer stalled for longer than wearer.host_timeout_ms; run again"
        }
        StopCause::HandStop => "the hand-held stop was opened; close it and run again",
        StopCause::ArmKey => "the arm key was opened; close it and run again",
        StopCause::ArmExpired => "the device was armed too long without a start; run again",
        StopCause::TimeOver => "the wearer's max_session_s is used up; it counts from power-up",
        StopCause::DoseReached => {
            "a channel has delivered the wearer's max_dose_mc; it counts from power-up"
        }
        StopCause::Finished => "every train of a fixed number of pulses has played",
    }
}

/// Returns the increase of each counter from `begin` to `end`, with the name of the counter. The
/// device counts from its boot.
pub fn counter_differences(begin: &Counters, end: &Counters) -> Vec<(String, u64)> {
    let (begin, end) = (named_counters(begin), named_counters(end));
    let pairs = begin.into_iter().zip(end);
    let counted = pairs.map(|((name, begin), (_, end))| (name.to_owned(), end.wrapping_sub(begin)));
    counted.map(|(name, n)| (name, u64::from(n))).collect()
}

fn named_counters(counters: &Counters) -> [(&'static str, u32); 11] {
    [
        ("frames understood", counters.frames),
        ("bad frames", counters.bad_frames),
        ("frames lost", counters.lost_frames),
        ("setpoints carried out", counters.setpoints),
        ("requests refused", counters.refused),
        ("pulses started", counters.pulses),
        ("triggers without a train", counters.idle_triggers),
        ("messages dropped", counters.dropped),
        ("internal messages lost", counters.lost_posts),
        ("requests of strangers", counters.unknown_sessions),
        ("setpoints that came late", counters.late_setpoints),
    ]
}

/// Returns the longest pulse period of a session's channels, µs; at least 1.
pub(super) fn longest_period_us(session: &Session) -> u64 {
    let periods = session.channels.iter().map(|c| {
        let slowest_us = c.force.and_then(|force| force.max_period_us);
        u64::from(slowest_us.unwrap_or(c.spec.train.period_us))
    });
    periods.max().unwrap_or(0).max(1)
}

/// Returns the edges from `from_us` to before `to_us`. Their times in the result count from
/// `from_us`, µs.
#[must_use]
pub fn edges_between(trace: &Trace, from_us: u64, to_us: u64) -> Vec<Edge> {
    trace
        .edges_from(from_us)
        .take_while(|edge| edge.t_us < to_us)
        .map(|item| edge(item, from_us))
        .collect()
}

/// Converts an edge of a trace into the form that a record contains. Its time in the result counts
/// from `from_us`, µs.
pub(super) fn edge(edge: TraceEdge, from_us: u64) -> Edge {
    Edge {
        t_us: edge.t_us - from_us,
        channel: edge.channel + 1,
        state: match edge.state {
            TraceState::Isolated => State::Isolated,
            TraceState::Cathodic => State::Cathodic,
            TraceState::Anodic => State::Anodic,
            TraceState::Grounded => State::Grounded,
        },
        dac_code: edge.dac_code,
    }
}
