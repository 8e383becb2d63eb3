//! The virtual wall's loop without a board around it: the device's own wall code every millisecond,
//! pulses at their rate, a simulated arm that pushes.

use firmware::control::SensorSource;
use firmware::haptics::{Side, Wall, WallSpec, WallState};
use firmware::units::{Amplitude, Angle, Micros};
use hal_sim::body::elbow::VoluntaryApproach;
use hal_sim::body::{Body, Drive, Elbow, ElbowSpec, Pulse};

/// Pulse period of each channel, ms: 50 Hz, for which the elbow's torques are valid.
pub(super) const PERIOD_MS: u64 = 20;
/// Time from the control tick that computes an amplitude to the pulse that has it, ms. The device
/// needs at most 1.54 ms.
pub(super) const LATENCY_MS: u64 = 2;
/// Angle of the wall (Harris 2017), m°.
pub(super) const WALL_MDEG: i32 = 90_000;

/// Returns a proportional wall that stimulates the triceps (Harris 2017, equation 1), with an
/// additional damping term. `stiffness` is in µA/°, `damping` in µA·s/°.
pub(crate) fn wall(stiffness: u32, damping: u32) -> WallSpec {
    WallSpec {
        at_mdeg: WALL_MDEG,
        side: Side::Flexion,
        channel: 0,
        max: Amplitude::new(80_000),
        stiffness,
        damping,
        cutoff_mhz: 10_000,
        pre_wall: None,
        co_contraction: None,
        angle_min_mdeg: 0,
        angle_max_mdeg: 150_000,
        sensor: SensorSource::Host,
        stale_after_ms: 50,
    }
}

/// Changes an arm's wearer so that the arm meets the wall at 90° without an impact and then leans
/// on it with a constant torque. The intended speed rises over 4 s and is never reached while the
/// wall resists.
pub(super) fn leaning(mut arm: ElbowSpec) -> ElbowSpec {
    arm.person.start_deg = 89.0;
    arm.person.onset_s = 4.0;
    arm.person.gain_nm_s_per_rad = 100.0;
    arm.person.approaches = vec![VoluntaryApproach {
        at_s: 0.0,
        speed_deg_per_s: 360.0,
        for_s: 1e6,
    }];
    arm
}

/// Simulates the arm at the wall for `seconds` and returns its true angle at each millisecond, °.
/// Both channels are pulsed every [`PERIOD_MS`], the antagonist half a period later. Wall and arm
/// must be valid.
pub(crate) fn angles(wall: &WallSpec, arm: ElbowSpec, seconds: u64) -> Vec<f64> {
    let widths = [arm.triceps.width_us, arm.biceps.width_us];
    let wall = Wall::new(wall).expect("a valid wall");
    let mut arm = Elbow::new(arm, super::SEED).expect("a valid arm");
    let mut state = WallState::default();
    // Amplitudes of the last ticks, oldest first.
    let mut ordered = [[0; 2]; LATENCY_MS as usize];
    let step = |ms: u64| {
        for (channel, offset) in [(0, 0), (1, PERIOD_MS / 2)] {
            let amplitude = ordered[0][channel];
            if (ms + offset).is_multiple_of(PERIOD_MS) && amplitude > 0 {
                arm.pulse(&Pulse {
                    t_us: ms * 1000,
                    channel,
                    drive: Drive::Milliamps(f64::from(amplitude) * 1e-3),
                    width_us: widths[channel],
                    conducted: false,
                });
            }
        }
        let now = Micros::new((ms * 1000) as u32);
        let sensed = Angle::from_millideg((arm.sensed_deg() * 1e3).round() as i32);
        let taken = wall.accept_measurement(&mut state, now, now, sensed);
        taken.expect("measurements come in order");
        let orders = wall.tick(&mut state, now, None);
        let orders = orders.expect("a fresh and believable angle");
        ordered.rotate_left(1);
        if let Some(newest) = ordered.last_mut() {
            for (channel, amplitude) in orders.amplitudes {
                newest[usize::from(channel)] = amplitude.get();
            }
        }
        arm.advance((ms + 1) * 1000);
        arm.angle_deg()
    };
    (0..seconds * 1000).map(step).collect()
}
