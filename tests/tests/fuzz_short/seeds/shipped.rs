//! Conversations of the shipped sessions with controllers.

use super::Step::{self, Ask, Joint, Wait};
use super::arm_and_start;
use firmware::control::SensorSource;
use firmware::link::Request;
use firmware::units::us;
use tests::desk;
use tests::fuzz::BOOTED;

/// Wait between setpoints: 25 ms.
const WAIT: u8 = 250;

/// Returns the requests of a host that plays this session for a short time. Its setpoints are 0.4 s
/// of the session apart, so that they differ noticeably.
pub fn conversation(name: &str) -> Vec<Step> {
    let session = desk::load_session(name).session;
    let configured = session.setup_requests().into_iter();
    let mut steps: Vec<_> = configured
        .filter(|request| !matches!(request, Request::Clear))
        .map(Ask)
        .collect();
    if let Some(SensorSource::Adc { code_at_0, .. }) = session.sensor() {
        steps.push(Joint(code_at_0 + 900));
    }
    let measured = |t_us: u64, steps: &mut Vec<Step>| {
        let waited = steps.iter().map(Step::length_us).sum();
        let at = BOOTED + us(waited);
        let joints = session.modulations.iter();
        steps.extend(joints.map(|joint| {
            Ask(Request::Measurement {
                joint: joint.spec.joint,
                centideg: joint.angle_at(t_us),
                at,
            })
        }));
    };
    steps.extend(arm_and_start());
    for turn in 1..=6 {
        let t_us = 400_000 * turn;
        measured(t_us, &mut steps);
        let setpoint = session.setpoints.at(t_us);
        let with = session.setpoints.accompanying_at(t_us);
        steps.extend(
            std::iter::once(setpoint)
                .chain(with)
                .map(|setpoint| Ask(setpoint.to_request(None))),
        );
        steps.push(Wait(WAIT));
    }
    steps
}
