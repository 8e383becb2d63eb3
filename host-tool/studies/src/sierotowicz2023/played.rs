//! Plays one condition of the study on a device: C3 of S2 in the first study, as a session with a
//! reference force. Compares the device's output with that of the native device edge by edge, and
//! the forces that it produces in the arm with those of the study.

use super::declaration::Study;
use super::device::{Device, Method};
use super::error::EndpointError;
use super::metrics::{force, size};
use super::model::{Model, turned};
use super::participant::Command;
use super::replication::{PreparedC3, before_c3};
use crate::laboratory::{ElectrodeLog, LOAD_OHM, Notes};
use hal_sim::body::arm::{Arm, ELECTRODES};
use hal_sim::body::{Body, Drive, Pulse};
use hal_sim::trace::Edge;
use host_core::run::{DeviceName, SessionFile, run};
use std::fmt::Write;

/// Time from the start of the session to the first contraction, ms.
const LEAD_MS: u64 = 1_000;
/// Time from the request of a force to its first pulse, ms. It suffices for the recruitment, and no
/// pulse of the preceding period of 25 ms gets the new force.
const BEFORE_MS: u64 = 20;
/// Time from the end of a force's request to the first pulse without it, ms.
const AFTER_MS: u64 = 20;
/// Duration of the change from no force to a force, ms: the period of a setpoint.
const STEP_MS: u64 = 5;
/// Channels in the order of their pulses in a period. Simultaneous pulses could exceed the 200 mA
/// of the device. Electrodes that reach the same muscle pulse less than 2.75 ms apart, so the
/// simulated arm counts their pulses together, as in the study.
const ORDER: [usize; ELECTRODES] = [0, 8, 1, 4, 2, 7, 3, 5, 6];
/// Time between consecutive channels in [`ORDER`], µs.
const APART_US: u64 = 500;
/// Full scale of an output stage, mA: more than any random arm needs.
const FULL_SCALE_MA: f64 = 50.0;

/// Comparison of the contractions that a device played with those of the study.
#[derive(Clone, Debug, PartialEq)]
pub struct DeviceCheck {
    /// Number of contractions that the device played.
    pub played: usize,
    /// Number of contractions before the last played one that the device refuses, because a muscle
    /// is too weak. The study and this comparison apply them at the largest current.
    pub refused: usize,
    /// Number of edges of the pins, all equal to the native device's.
    pub edges: usize,
    /// Number of pulses of the device, and number of pulses in the study.
    pub pulses: [usize; 2],
    /// Largest difference of a current from the study's, mA.
    pub current_ma: f64,
    /// Largest difference of a contraction's mean force from the study's, and root mean square of
    /// the study's forces, N.
    pub force_n: [f64; 2],
    /// Mean force of each contraction in the study, N.
    pub study_n: Vec<[f64; 3]>,
}

/// A contraction: its command, its currents, mA, and whether the device plays it.
struct Contraction {
    command: Command,
    currents_ma: [f64; ELECTRODES],
    is_played: bool,
}

/// Returns the first contractions of C3, up to the last one that the device plays. The declaration
/// fixes how many it plays.
fn contractions(study: &Study, begun: &PreparedC3) -> Result<Vec<Contraction>, EndpointError> {
    let device = Device::new(&begun.model)?;
    let mut all = Vec::new();
    let mut left = study.played.targets;
    for command in &begun.commands {
        if left == 0 {
            break;
        }
        let forces = device.forces_n(Method::Nearest, command.1)?;
        let is_played = !device.is_beyond(&forces);
        left -= usize::from(is_played);
        all.push(Contraction {
            command: *command,
            currents_ma: device.currents_ma(&forces),
            is_played,
        });
    }
    Ok(all)
}

fn begins_ms(study: &Study, place: usize) -> u64 {
    LEAD_MS + place as u64 * (1e3 * (study.protocol.contraction_s + study.protocol.rest_s)) as u64
}

/// Formats three values in µm as mm.
fn triple(um: &[i32; 3]) -> String {
    um.map(|value| format!("{:.3}", f64::from(value) / 1e3))
        .join(", ")
}

/// Writes the wearer file with this model of the arm.
fn wearer(study: &Study, model: &Model) -> String {
    let spec = model.spec();
    let mut text = "schema = 1\nname = \"s2\"\nevidence = \"assumed\"\nsource = \"drawn\"\n\
                    [limits]\nmax_current_ma = 50\nmax_charge_uc = 10\nmax_rms_ma = 10\n\
                    rise_ms = 1\nfall_ms = 50\nhost_timeout_ms = 200\n[limb]\n"
        .to_owned();
    let ways = ["to_sc_mm", "to_gh_mm", "to_el_mm", "to_hand_mm"];
    for (name, um) in ways.iter().zip(&spec.offsets_um) {
        let _ = writeln!(text, "{name} = [{}]", triple(um));
    }
    let axes = firmware::limb::AXIS_NAMES.iter().zip(&spec.ranges_mdeg);
    for (name, (low, high)) in axes {
        let _ = writeln!(text, "{name}_deg = [{}, {}]", low / 1_000, high / 1_000);
    }
    let segments = ["thorax", "girdle", "upper-arm", "forearm"];
    let joints = ["sternoclavicular", "glenohumeral", "elbow"];
    for line in &spec.lines {
        let via = |via: &firmware::limb::ViaSpec| {
            let segment = segments[usize::from(via.segment)];
            let at = triple(&via.at_um);
            format!("{{ segment = \"{segment}\", at_mm = [{at}] }}")
        };
        let points: Vec<String> = line.vias.iter().map(via).collect();
        let (number, points) = (line.channel + 1, points.join(", "));
        let [threshold, limit] =
            [line.threshold, line.limit].map(|amplitude| f64::from(amplitude.get()) / 1000.0);
        let gain = f64::from(line.gain_mn_per_ma) / 1e3;
        let joint = joints[usize::from(line.joint.index())];
        let (width_us, hz) = (study.protocol.width_us, study.protocol.frequency_hz);
        let _ = write!(
            text,
            "[[limb.line]]\nchannel = {number}\njoint = \"{joint}\"\npoints = [{points}]\n\
             gain_n_per_unit = {gain:.3}\n\
             [[electrode]]\nchannel = {number}\nplace = \"{number}\"\nstage = \"current\"\n\
             area_mm2 = 804\nwidth_us = {width_us}\nfrequency_hz = {hz}\nfrom_hz = 20\nto_hz = 50\n\
             motor_threshold = {threshold:.3}\nlimit = {limit:.3}\nstart = {limit:.3}\n\
             moves = [\"the arm\"]\n"
        );
    }
    text
}

/// Writes the session that plays these contractions one after the other.
fn session(study: &Study, model: &Model, all: &[Contraction]) -> String {
    let played: Vec<&Contraction> = all
        .iter()
        .filter(|contraction| contraction.is_played)
        .collect();
    let protocol = &study.protocol;
    let lasts_s = begins_ms(study, played.len()) as f64 / 1e3;
    let mut text = format!(
        "title = \"C3 of S2\"\nduration_s = {lasts_s}\n[wearer]\nfile = \"s2.toml\"\n\
         [body]\nkind = \"still\"\nload_ohm = {LOAD_OHM}\n"
    );
    for channel in 0..ELECTRODES {
        let place = ORDER
            .iter()
            .position(|order| *order == channel)
            .unwrap_or(0);
        let (number, offset_us) = (channel + 1, APART_US * place as u64);
        let (width_us, hz) = (protocol.width_us, protocol.frequency_hz);
        let _ = write!(
            text,
            "[[channel]]\nnumber = {number}\nname = \"{number}\"\n\
             stage = {{ kind = \"current\", full_scale_ma = {FULL_SCALE_MA} }}\n\
             train = {{ shape = \"biphasic-cathodic-first\", width_us = {width_us}, gap_us = 50, \
             frequency_hz = {hz}, offset_us = {offset_us} }}\n"
        );
    }
    let angles = firmware::limb::AXIS_NAMES
        .iter()
        .zip(model.frame.angles())
        .map(|(name, angle)| format!("{name} = {:.2}", f64::from(angle.to_centideg()) / 100.0));
    let angles: Vec<String> = angles.collect();
    let mut points = vec!["{ at_s = 0, force_n = [0, 0, 0] }".to_owned()];
    for (place, contraction) in played.iter().enumerate() {
        let from_ms = begins_ms(study, place) - BEFORE_MS;
        let to_ms = from_ms + BEFORE_MS - AFTER_MS + (1e3 * protocol.contraction_s) as u64;
        let wanted = turned(contraction.command.1)
            .map(|n| format!("{n:.3}"))
            .join(", ");
        for (ms, force) in [
            (from_ms, "0, 0, 0"),
            (from_ms + STEP_MS, &*wanted),
            (to_ms, &*wanted),
            (to_ms + STEP_MS, "0, 0, 0"),
        ] {
            let at_s = ms as f64 / 1e3;
            points.push(format!("{{ at_s = {at_s:.3}, force_n = [{force}] }}"));
        }
    }
    let (angles, points) = (angles.join(", "), points.join(",\n"));
    let _ = write!(
        text,
        "[setpoints]\nkind = \"endpoint-force\"\nrate_hz = 200\nposture_deg = {{ {angles} }}\n\
         points = [\n{points}\n]\n"
    );
    text
}

/// Runs the session on `device`. Returns its edges and pulses, with times from its start.
fn play_on_device(
    file: &SessionFile,
    device: &DeviceName,
    seed: u64,
) -> Result<(Vec<Edge>, Vec<Pulse>), EndpointError> {
    let failed = |why: String| EndpointError::NotPlayed(device.to_argument(), why);
    let told = |error: &dyn std::fmt::Display| failed(error.to_string());
    let mut port = device.open(&file.session, seed).map_err(|e| told(&e))?;
    let not_simulated = || failed("the device is not simulated".to_owned());
    let heard = ElectrodeLog::default();
    port.world().ok_or_else(not_simulated)?.body = Box::new(Notes::new(&heard));
    let (outcome, port) = run(file, port, None, |_: f64| ());
    if let Some(error) = outcome.error {
        return Err(told(&error));
    }
    if outcome.refused > 0 {
        return Err(failed(format!(
            "the device refused {} requests",
            outcome.refused
        )));
    }
    let epoch_us = outcome
        .epoch_us
        .ok_or_else(|| failed("the session did not start".to_owned()))?;
    let mut port = port.ok_or_else(not_simulated)?;
    let trace = &port.world().ok_or_else(not_simulated)?.recorder.trace;
    // Ends before the stop, whose time differs between devices.
    let until_us = file.session.duration_us.saturating_sub(10_000);
    let edges = trace.edges_from(epoch_us).map(|edge| Edge {
        t_us: edge.t_us - epoch_us,
        ..edge
    });
    let edges = edges.take_while(|edge| edge.t_us < until_us).collect();
    let since = heard
        .pulses()
        .into_iter()
        .filter(|pulse| pulse.t_us >= epoch_us);
    let pulses = since.map(|pulse| Pulse {
        t_us: pulse.t_us - epoch_us,
        ..pulse
    });
    Ok((edges, pulses.collect()))
}

/// Replays these pulses in a contraction, with times in µs from its start. Calls `each_ms` after
/// each millisecond and returns the time at the end, µs.
fn replay(
    arm: &mut Arm,
    now_us: u64,
    pulses: &[Pulse],
    (lasts_s, each_ms): (f64, &mut dyn FnMut(&Arm)),
) -> u64 {
    let mut next = pulses.iter().peekable();
    let lasts_us = (1e6 * lasts_s) as u64;
    for end_us in (1..=lasts_us / 1_000).map(|ms| 1_000 * ms) {
        while let Some(pulse) = next.next_if(|pulse| pulse.t_us < end_us) {
            arm.pulse(&Pulse {
                t_us: now_us + pulse.t_us,
                ..*pulse
            });
        }
        arm.advance(now_us + end_us);
        each_ms(arm);
    }
    now_us + lasts_us
}

/// Plays contractions of C3 on `device` and compares currents, pulses and forces with those of the
/// study. Unless `device` is the native device, every edge must equal the native one's.
///
/// # Errors
/// Fails like the study itself. Returns E730 if the device does not play the session, and E731 if
/// its edges differ.
pub fn play_c3(
    study: &Study,
    seed: u64,
    device: &DeviceName,
) -> Result<DeviceCheck, EndpointError> {
    let begun = before_c3(study, seed)?;
    let all = contractions(study, &begun)?;
    let texts = wearer(study, &begun.model);
    let text = session(study, &begun.model, &all);
    let file = SessionFile::parse_with_wearers("c3.toml", &text, &|_| Ok(texts.clone()))
        .map_err(|e| EndpointError::NotPlayed(device.to_argument(), e.lines()))?;
    let (edges, pulses) = play_on_device(&file, &DeviceName::Native, seed)?;
    let (others, pulses) = match device {
        DeviceName::Native => (edges.clone(), pulses),
        _ => play_on_device(&file, device, seed)?,
    };
    if let Some(at) =
        (0..edges.len().max(others.len())).find(|at| edges.get(*at) != others.get(*at))
    {
        let told = |item: Option<&Edge>| {
            item.map_or("no further edge".to_owned(), |edge| {
                let (channel, code) = (edge.channel + 1, edge.dac_code);
                format!(
                    "channel {channel} {} at {} µs (DAC code {code})",
                    edge.state, edge.t_us
                )
            })
        };
        return Err(EndpointError::OtherEdges(
            device.to_argument(),
            told(others.get(at)),
            told(edges.get(at)),
        ));
    }
    Ok(compare_forces(study, &begun, &all, (edges.len(), &pulses)))
}

/// Compares the forces that these pulses produce in the arm with those of the study.
fn compare_forces(
    study: &Study,
    begun: &PreparedC3,
    all: &[Contraction],
    (edges, pulses): (usize, &[Pulse]),
) -> DeviceCheck {
    let (mut ours, mut theirs) = (begun.person.clone(), begun.person.clone());
    let lasts_s = study.protocol.contraction_s;
    let periods = (lasts_s * study.protocol.frequency_hz).ceil() as usize;
    let mut found = DeviceCheck {
        played: 0,
        refused: 0,
        edges,
        pulses: [0, 0],
        current_ma: 0.0,
        force_n: [0.0; 2],
        study_n: Vec::new(),
    };
    for contraction in all {
        let study_n = force(theirs.measure_contraction(study, &contraction.currents_ma, [0.0; 6]));
        if !contraction.is_played {
            found.refused += 1;
            ours.measure_contraction(study, &contraction.currents_ma, [0.0; 6]);
            continue;
        }
        let [from_us, to_us] =
            [0, 1].map(|next| 1_000 * begins_ms(study, found.played + next) - 5_000);
        let own: Vec<Pulse> = pulses
            .iter()
            .filter(|pulse| (from_us..to_us).contains(&pulse.t_us))
            .filter(|pulse| pulse.drive != Drive::Milliamps(0.0))
            .map(|pulse| Pulse {
                t_us: (pulse.t_us - from_us).saturating_sub(5_000),
                ..*pulse
            })
            .collect();
        let driven = contraction
            .currents_ma
            .iter()
            .filter(|ma| **ma > 0.0)
            .count();
        found.pulses[0] += own.len();
        found.pulses[1] += driven * periods;
        for pulse in &own {
            let Drive::Milliamps(ma) = pulse.drive else {
                continue;
            };
            let off = (ma - contraction.currents_ma[pulse.channel]).abs();
            found.current_ma = found.current_ma.max(off);
        }
        let device_n = force(
            ours.measure_stimulation(study, &mut |arm, now_us, each_ms| {
                replay(arm, now_us, &own, (lasts_s, each_ms))
            }),
        );
        let off = size(std::array::from_fn(|axis| device_n[axis] - study_n[axis]));
        found.force_n[0] = found.force_n[0].max(off);
        found.force_n[1] += size(study_n).powi(2);
        found.study_n.push(study_n);
        found.played += 1;
    }
    found.force_n[1] = (found.force_n[1] / found.played.max(1) as f64).sqrt();
    found
}

impl DeviceCheck {
    /// Describes the comparison with `device` for the report page.
    #[must_use]
    pub fn in_words(&self, device: &DeviceName) -> String {
        let edges = match device {
            DeviceName::Native => "edges",
            _ => "edges, each equal to the native device's",
        };
        let ([ours, theirs], [off, rms]) = (self.pulses, self.force_n);
        format!(
            "All numbers of this study are computed on the simulated arm without a device. As a \
             check, {} contractions of S2 in condition C3 of the first study were also played by \
             --device {}. (The device refuses {} contractions before these, because a muscle \
             would have to be stronger.) The output has {} {edges}, and {ours} pulses where the \
             study has {theirs}. Currents differ by at most {:.4} mA, and mean forces by at most \
             {off:.3} N; the study's mean forces are {rms:.2} N (root mean square).",
            self.played,
            device.to_argument(),
            self.refused,
            self.edges,
            self.current_ma,
        )
    }
}
