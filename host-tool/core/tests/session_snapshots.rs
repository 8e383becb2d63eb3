//! A copy of a running session on the native simulator continues exactly like the original, and
//! does not disturb the original.

use firmware::units::Micros;
use hal_sim::body::{Body, CHANNELS, Load, Pulse};
use hal_sim::native::native;
use hal_sim::trace::Trace;
use hal_sim::wire::faults::Faults;
use hal_sim::world::World;
use host_core::link::{Port, SimulatedPort};
use host_core::record::Trial;
use host_core::run::{Attachments, DeviceName, SessionFile, StepEnd, StepLimit, Stepper};
use std::path::Path;

const SEED: u64 = 7;

/// Loads a shipped session, and shortens it to `most_us` if it is longer.
fn load(name: &str, most_us: u64) -> SessionFile {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions");
    let mut file = SessionFile::load(&folder.join(name)).unwrap();
    file.session.duration_us = file.session.duration_us.min(most_us);
    file
}

/// Opens and starts the session on `port`.
fn start<P: Port>(file: &SessionFile, port: P) -> Stepper<'_, P> {
    let mut stepper = Stepper::open(file, port, Attachments::default()).unwrap();
    stepper.configure().unwrap();
    stepper.arm().unwrap();
    stepper.start().unwrap();
    stepper
}

fn start_native(file: &SessionFile) -> Stepper<'_, Box<dyn Port>> {
    start(file, DeviceName::Native.open(&file.session, SEED).unwrap())
}

/// Runs the session to its end and returns its record, everything that the device has output since
/// its boot, and the wearer's joint angle at the end, degrees.
fn finish<P: Port>(mut stepper: Stepper<'_, P>) -> (Trial, Trace, f64) {
    let end = stepper.step(StepLimit::Time(u64::MAX)).unwrap();
    assert_eq!(end, StepEnd::Over);
    let (outcome, mut port) = stepper.close(Ok(()));
    assert!(outcome.error.is_none(), "{:?}", outcome.error);
    let world = port.world().unwrap();
    let trace = std::mem::take(&mut world.recorder.trace);
    (outcome.trial, trace, world.body.angle_deg())
}

/// Checks that a copy made half way, a copy of this copy, the copied session and an undisturbed
/// session end alike.
fn check(name: &str, most_us: u64) {
    let file = load(name, most_us);
    let undisturbed = finish(start_native(&file));
    let (trial, trace, _) = &undisturbed;
    let counts = (trial.samples.len(), trace.edges().count());
    assert!(counts.0 > 50 && counts.1 > 500, "{name}: {counts:?}");

    let mut original = start_native(&file);
    let half_us = file.session.duration_us / 2;
    let end = original.step(StepLimit::Time(half_us)).unwrap();
    assert_eq!(end, StepEnd::Reached, "{name}");
    let mut copy = original.snapshot().expect(name);
    assert_eq!(copy.time_us(), original.time_us(), "{name}");
    let copy_of_copy = copy.snapshot().expect(name);
    // The copies run first, which shows whether they share state with the original.
    let copied = [finish(copy), finish(copy_of_copy)];
    for (which, run) in copied.into_iter().chain([finish(original)]).enumerate() {
        assert!(run.0.samples == trial.samples, "{name}: samples of {which}");
        assert!(run.1.edges().eq(trace.edges()), "{name}: edges of {which}");
        assert!(run == undisturbed, "{name}: record or trace of {which}");
    }
}

#[test]
fn copies_of_ten_channels_continue_like_the_original() {
    check("ten_channels.toml", u64::MAX);
}

#[test]
fn copies_of_a_finger_continue_like_the_original() {
    check("full_load.toml", u64::MAX);
}

#[test]
fn copies_of_a_hand_continue_like_the_original() {
    check("ten_channels_and_hand.toml", 2_000_000);
}

#[test]
fn copies_of_a_wall_continue_like_the_original() {
    check("harris_wall/1_pre_wall.toml", u64::MAX);
}

#[test]
fn copies_of_force_control_continue_like_the_original() {
    check("force_ramp.toml", u64::MAX);
    check("ten_forces.toml", u64::MAX);
}

#[test]
fn copies_of_lifting_continue_like_the_original() {
    check("lift.toml", u64::MAX);
}

#[test]
fn copies_of_an_arm_continue_like_the_original() {
    check("endpoint_arm.toml", 3_000_000);
}

#[test]
fn copies_of_triggered_trains_continue_like_the_original() {
    check("trigger.toml", u64::MAX);
}

/// Wearer who does not move and does not implement [`Body::fork`].
struct UncopiableBody([Load; CHANNELS]);

impl Body for UncopiableBody {
    fn pulse(&mut self, _: &Pulse) {}
    fn advance(&mut self, _: u64) -> bool {
        false
    }
    fn angle_deg(&self) -> f64 {
        0.0
    }
    fn sensed_deg(&self) -> f64 {
        0.0
    }
    fn loads(&self) -> &[Load; CHANNELS] {
        &self.0
    }
    fn loads_mut(&mut self) -> &mut [Load; CHANNELS] {
        &mut self.0
    }
}

#[test]
fn a_session_whose_wearer_cannot_be_copied_has_no_copy() {
    let file = load("ten_channels.toml", 100_000);
    let boot = Micros::new(0);
    let body = Box::new(UncopiableBody([Load::NOMINAL; CHANNELS]));
    let world = World::new(Box::new(native(boot)), body, boot, Faults::default(), SEED);
    assert!(start(&file, SimulatedPort::new(world)).snapshot().is_none());
}
