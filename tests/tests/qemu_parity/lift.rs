//! The shipped lift session as a log of a device's inputs: four angles and whether the object is
//! held, 60 times per second.

use super::session::{ARRIVAL_US, BOOT, Host, Step};
use firmware::link::Request;
use firmware::units::us;
use host_core::session::Session;
use tests::desk;

/// Messages per second.
const RATE_HZ: u32 = 60;

/// Returns the whole log, for a device whose first session has this number.
pub fn lift(number: u16, session: &Session) -> Vec<Step> {
    let mut host = Host::greeting(number);
    for request in session.setup_requests() {
        host.say(request);
        host.wait_ms(1);
    }
    host.say(Request::Subscribe { period_ms: 20 });
    host.say(desk::ARM);
    host.wait_ms(40);
    words(&mut host, session, 0);
    host.say(Request::Start);
    let mut sent_count = 0;
    for ms in 1..=(session.duration_us / 1000) as u32 {
        host.wait_ms(1);
        if ms * RATE_HZ / 1000 > sent_count {
            sent_count += 1;
            words(&mut host, session, u64::from(ms) * 1000);
        }
    }
    host.say(Request::Stop);
    host.wait_ms(300);
    host.log
}

/// Sends the host's messages `due_us` after the start.
fn words(host: &mut Host, session: &Session, due_us: u64) {
    for joint in &session.modulations {
        host.say(Request::Measurement {
            joint: joint.spec.joint,
            centideg: joint.angle_at(due_us),
            at: BOOT + us(host.now + ARRIVAL_US),
        });
    }
    host.say(session.setpoints.at(due_us).to_request(None));
}
