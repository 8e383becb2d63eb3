//! Calibrates routing and gains from twitches (section 2.2). Moves origin and insertion to the
//! azimuths nearest to the plane in which a twitch turns the limb (equation 6), and computes gains
//! from the turning rate (equation 5).

use super::declaration::Study;
use super::device::Device;
use super::error::EndpointError;
use super::imus::Tracker;
use super::model::{Action, Cylinder, Frame, Model, Point, turned};
use firmware::limb::JointName;
use hal_sim::body::arm::{
    Arm, ELECTRODES, FOREARM, HAND, Muscle, Support, UPPER_ARM, anatomy::ALL,
};
use hal_sim::body::{Body, Drive, Pulse};
use nalgebra::{Matrix3, Vector3};

/// Number of 1 ms samples in the mean of a turning rate.
const SMOOTHED: usize = 10;
/// Smallest turning rate that counts as a twitch, rad/s: ten times the noise of a mean over
/// [`SMOOTHED`] samples.
const LEAST_RAD_S: f64 = 0.02;

/// Twitches of one channel: the largest turning rate of each about the muscle's joint, rad/s, in
/// the device's axes.
pub type Twitches = Vec<Vector3<f64>>;

/// Duration of a train, s, its pulse rate, Hz, and pulse width, µs.
pub(super) type Train = (f64, f64, u32);

/// Sends pulses on all channels from `from_us` on and returns the time at the end, µs. `currents`
/// returns the current of each channel, mA (0 for no pulse), at a time in µs after `from_us`.
pub(super) fn pulses(
    arm: &mut Arm,
    from_us: u64,
    currents: &mut dyn FnMut(u64) -> [f64; ELECTRODES],
    (lasts_s, frequency_hz, width_us): Train,
    each_ms: &mut dyn FnMut(&Arm),
) -> u64 {
    let period_us = (1e6 / frequency_hz).round() as u64;
    let end_us = from_us + (1e6 * lasts_s).round() as u64;
    let mut due_us = from_us;
    let mut now_us = from_us;
    while now_us < end_us {
        if now_us >= due_us {
            let currents = currents(due_us - from_us);
            let on = currents.iter().enumerate().filter(|(_, ma)| **ma > 0.0);
            for (channel, ma) in on {
                arm.pulse(&Pulse {
                    t_us: due_us,
                    channel,
                    drive: Drive::Milliamps(*ma),
                    width_us,
                    conducted: false,
                });
            }
            due_us += period_us;
        }
        now_us += 1_000;
        arm.advance(now_us);
        each_ms(arm);
    }
    now_us
}

/// Records twitches of every channel at its largest current while the arm is held loosely, and
/// advances the time.
pub fn twitches(
    arm: &mut Arm,
    model: &Model,
    study: &Study,
    now_us: &mut u64,
) -> [Twitches; ELECTRODES] {
    let (how, protocol) = (&study.calibration, &study.protocol);
    arm.set_support(Support::Freely);
    let mut all: [Twitches; ELECTRODES] = Default::default();
    for (channel, found) in all.iter_mut().enumerate() {
        let joint = usize::from(model.actions[channel].joint.index());
        let mut currents = [0.0; ELECTRODES];
        currents[channel] = model.ranges_ma[channel][1];
        for _ in 0..how.twitches {
            let tracker = Tracker::at_rest(arm, now_us);
            let mut greatest = Vector3::zeros();
            let mut latest = std::collections::VecDeque::with_capacity(SMOOTHED);
            let mut watch = |arm: &Arm| {
                if latest.len() == SMOOTHED {
                    latest.pop_front();
                }
                latest.push_back(tracker.turning(arm, joint));
                let now: Vector3<f64> = latest.iter().sum::<Vector3<f64>>() / SMOOTHED as f64;
                if now.norm() > greatest.norm() {
                    greatest = now;
                }
            };
            let train = (how.twitch_s, protocol.frequency_hz, protocol.width_us);
            let after = pulses(arm, *now_us, &mut |_| currents, train, &mut watch);
            let rest = how.watched_s - how.twitch_s;
            let still = (rest, protocol.frequency_hz, protocol.width_us);
            let none = &mut |_| [0.0; ELECTRODES];
            *now_us = pulses(arm, after, none, still, &mut watch);
            *now_us += (1e6 * how.wait_s) as u64;
            arm.advance(*now_us);
            found.push(turned(greatest.into()).into());
        }
    }
    arm.set_support(Support::InCuff);
    all
}

/// Returns the azimuths at which a point of a cylinder lies nearest to planes through the joint:
/// one or two local minima (equation 6). `normals` are the planes' normals in the segment's axes.
fn nearest(cylinder: &Cylinder, point: &Point, normals: &[Vector3<f64>]) -> Vec<f64> {
    let cost = |azimuth: f64| -> f64 {
        let at = cylinder.at(&Point { azimuth, ..*point });
        normals.iter().map(|vector| at.dot(vector).powi(2)).sum()
    };
    let step = std::f64::consts::TAU / 720.0;
    let mut found = Vec::new();
    for place in 0..720 {
        let at = step * f64::from(place);
        let [before, here, after] = [at - step, at, at + step].map(cost);
        if here < before && here <= after {
            // The cost is a trigonometric polynomial of degree two, so a parabola over one degree
            // is exact to a thousandth of a degree.
            let bend = before - 2.0 * here + after;
            let shift = match bend > 0.0 {
                true => 0.5 * (before - after) / bend,
                false => 0.0,
            };
            found.push(at + step * shift);
        }
    }
    if found.is_empty() {
        found.push(point.azimuth);
    }
    found
}

/// Fits the line of action of a channel's muscle to the channel's twitches. Of the azimuths of
/// origin and insertion that lie nearest to the plane of the twitches, takes the pair whose torque
/// agrees best with the observed turning.
///
/// # Errors
/// Returns E700 to E704 if the device refuses the arm.
pub fn fit_routing(
    model: &Model,
    channel: usize,
    turning: &[Vector3<f64>],
) -> Result<Action, EndpointError> {
    let action = model.actions[channel];
    let segments = Device::new(model)?.segments();
    let normals: Vec<Vector3<f64>> = turning.iter().map(Vector3::normalize).collect();
    let mean = normals.iter().sum::<Vector3<f64>>();
    let [origins, insertions] = [0, 1].map(|end| {
        let segment = usize::from(action.joint.index()) + end;
        let own = segments[segment].1.transpose();
        let normals: Vec<Vector3<f64>> = normals.iter().map(|vector| own * vector).collect();
        nearest(
            &Cylinder::of_segment(segment),
            &action.points[end],
            &normals,
        )
    });
    let mut best = (f64::NEG_INFINITY, action);
    let mut tried = model.clone();
    for origin in &origins {
        for insertion in &insertions {
            let mut points = action.points;
            (points[0].azimuth, points[1].azimuth) = (*origin, *insertion);
            let next = Action { points, ..action };
            tried.actions[channel] = next;
            // Torque along the observed rotation. A line that runs through the joint has none.
            let along = Device::new(&tried)?.arm_m(channel).dot(&mean);
            if along > best.0 {
                best = (along, next);
            }
        }
    }
    Ok(best.1)
}

/// Returns the moment of inertia of everything distal to a joint about that joint, kg m², in the
/// device's axes. Segment masses follow from `mass_kg` and the anthropometric tables.
fn inertia(device: &Device, frame: &Frame, mass_kg: f64, joint: JointName) -> Matrix3<f64> {
    let segments = device.segments();
    let at = segments[usize::from(joint.index()) + 1].0;
    let [(shoulder, upper), (elbow, fore)] = [segments[2], segments[3]];
    let down = |turns: Matrix3<f64>| -turns.column(2).into_owned();
    let rod = |part: [f64; 4], start: Vector3<f64>, axis: Vector3<f64>| {
        let [length, mass, centre, gyration] = part;
        let length = length * frame.stature_m;
        let from = start + centre * length * axis - at;
        let kg = mass * mass_kg;
        let across = Matrix3::identity() - 0.9 * axis * axis.transpose();
        let steiner = from.norm_squared() * Matrix3::identity() - from * from.transpose();
        kg * ((gyration * length).powi(2) * across + steiner)
    };
    let along = down(fore);
    let wrist = elbow + FOREARM[0] * frame.stature_m * along;
    let forearm = rod(FOREARM, elbow, along) + rod(HAND, wrist, along);
    match joint {
        JointName::Elbow => forearm,
        _ => forearm + rod(UPPER_ARM, shoulder, down(upper)),
    }
}

/// Computes the force per current from these twitches, N/mA (equations 5 and 3).
fn gain(
    device: &Device,
    model: &Model,
    channel: usize,
    (turning, inertia): (&[Vector3<f64>], &Matrix3<f64>),
    twitch_s: f64,
) -> f64 {
    let arm = device.arm_m(channel).norm();
    let [least, greatest] = model.ranges_ma[channel];
    let torque = |vector3: &Vector3<f64>| (inertia * vector3).norm() / twitch_s;
    let mean = turning.iter().map(torque).sum::<f64>() / turning.len() as f64;
    mean / (arm * (greatest - least))
}

/// Returns the channels whose twitches do not turn the limb.
#[must_use]
pub fn motionless_channels(twitches: &[Twitches; ELECTRODES]) -> Vec<usize> {
    let is_still = |twitches: &Twitches| {
        twitches.is_empty() || twitches.iter().any(|vector| vector.norm() < LEAST_RAD_S)
    };
    (0..ELECTRODES)
        .filter(|at| is_still(&twitches[*at]))
        .collect()
}

/// Returns `model` with routing and gains fitted to `twitches` of a participant of `mass_kg`. The
/// channels in `kept` stay unchanged.
///
/// # Errors
/// Returns E718 if a channel's twitches do not turn the limb, E719 if a gain is not a positive
/// number, and E700 to E704 if the device refuses the arm.
pub fn fit_model(
    model: &Model,
    (twitches, kept): (&[Twitches; ELECTRODES], &[usize]),
    mass_kg: f64,
    study: &Study,
) -> Result<Model, EndpointError> {
    let mut model = model.clone();
    let nothing = motionless_channels(twitches);
    for (channel, turning) in twitches.iter().enumerate() {
        if kept.contains(&channel) {
            continue;
        }
        let name = ALL
            .get(channel)
            .map_or("a channel", |muscle: &Muscle| muscle.name());
        if nothing.contains(&channel) {
            return Err(EndpointError::NoTwitch(name));
        }
        model.actions[channel] = fit_routing(&model, channel, turning)?;
        let device = Device::new(&model)?;
        let inertia = inertia(&device, &model.frame, mass_kg, model.actions[channel].joint);
        let of = (turning.as_slice(), &inertia);
        let gain = gain(&device, &model, channel, of, study.calibration.twitch_s);
        if !(gain.is_finite() && gain > 0.0) {
            return Err(EndpointError::Gain(name, gain));
        }
        model.gains[channel] = gain;
    }
    Ok(model)
}

/// Returns for each channel the angle, °, between the torque about the muscle's joint as the device
/// computes it and the torque in the simulated arm.
#[must_use]
pub fn geometry_error_deg(device: &Device, model: &Model, arm: &Arm) -> [f64; ELECTRODES] {
    std::array::from_fn(|channel| {
        let turns = arm.arms_m(ALL[channel]);
        let truly: Vector3<f64> = match model.actions[channel].joint {
            JointName::Sternoclavicular => turns.fixed_rows::<3>(0).into(),
            JointName::Glenohumeral => turns.fixed_rows::<3>(3).into(),
            JointName::Elbow => turns[6] * arm.skeleton().hinge + turns[7] * arm.skeleton().forearm,
        };
        let truly = Vector3::from(turned(truly.into()));
        truly.angle(&device.arm_m(channel)).to_degrees()
    })
}
