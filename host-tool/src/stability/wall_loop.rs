//! The wall's loop without a board around it: the device's own wall at every
//! millisecond, pulses at their rate, the simulated arm.

use firmware::haptics::{Wall, WallSpec, WallState};
use firmware::units::{Angle, Micros};
use hal_sim::body::{Body, Drive, Elbow, ElbowSpec, Pulse};

/// Pulses per second on either channel, and the period, ms.
pub const PERIOD_MS: u64 = 20;
/// From the tick that computes an amplitude to the pulse that has it, ms: the
/// device's own way through control law and pulse schedule (at most 1.54 ms).
pub const LATENCY_MS: u64 = 2;

/// The true angle every millisecond, degrees, over `seconds`. Triceps pulses
/// come at whole periods, biceps pulses half a period later.
///
/// # Panics
/// Wall or arm are none: the caller's are checked.
#[must_use]
pub fn angles(wall: &WallSpec, arm: ElbowSpec, seconds: f64) -> Vec<f64> {
    let widths = [arm.triceps.width_us, arm.biceps.width_us];
    let wall = Wall::new(wall).expect("a wall in range");
    let mut arm = Elbow::new(arm, 1).expect("an arm in range");
    let mut state = WallState::default();
    // Amplitudes ordered at the last ticks, oldest first, per channel.
    let mut ordered = [[0; 2]; LATENCY_MS as usize];
    let mut angles = Vec::with_capacity((seconds * 1e3) as usize);
    for ms in 0..(seconds * 1e3) as u64 {
        let t_us = ms * 1000;
        for (channel, offset) in [(0, 0), (1, PERIOD_MS / 2)] {
            let amplitude = ordered[0][channel];
            if (ms + offset).is_multiple_of(PERIOD_MS) && amplitude > 0 {
                arm.pulse(&Pulse {
                    t_us,
                    channel,
                    drive: Drive::Milliamps(f64::from(amplitude) * 1e-3),
                    width_us: widths[channel],
                    conducted: false,
                });
            }
        }
        let now = Micros(t_us as u32);
        let sensed = Angle::from_millideg((arm.sensed_deg() * 1e3).round() as i32);
        let _ = wall.measurement(&mut state, now, now, sensed); // in order
        ordered.rotate_left(1);
        if let Ok(orders) = wall.tick(&mut state, now, None) {
            let newest = &mut ordered[LATENCY_MS as usize - 1];
            for (channel, amplitude) in orders.amplitudes {
                newest[usize::from(channel)] = amplitude.0;
            }
        }
        arm.advance(t_us + 1000);
        angles.push(arm.angle_deg());
    }
    angles
}

#[cfg(test)]
mod tests {
    use super::*;
    use firmware::control::SensorSource;
    use firmware::haptics::{CoContraction, PreWall, Side};
    use firmware::units::Amplitude;
    use hal_sim::body::elbow::Approach;

    #[test]
    #[ignore]
    fn explore() {
        for (b, push) in [(0.2, 1.5), (0.4, 1.5), (0.8, 1.5), (1.2, 1.5), (0.4, 3.0)] {
            for speed in [15.0, 55.0] {
                for pre in [false, true] {
                    for co in [false, true] {
                        let wall = WallSpec {
                            at_mdeg: 90_000,
                            side: Side::Flexion,
                            channel: 0,
                            max: Amplitude(80_000),
                            stiffness: 8_889,
                            damping: 0,
                            cutoff_mhz: 10_000,
                            pre_wall: pre.then_some(PreWall {
                                depth_mdeg: 9_000,
                                begin: Amplitude(20_000),
                                end: Amplitude(80_000),
                            }),
                            co_contraction: co.then_some(CoContraction {
                                channel: 1,
                                amplitude: Amplitude(40_000),
                            }),
                            angle_min_mdeg: 0,
                            angle_max_mdeg: 150_000,
                            sensor: SensorSource::Host,
                            stale_after_ms: 50,
                        };
                        let mut arm = ElbowSpec::default();
                        arm.damping_nm_s_per_rad = b;
                        arm.person.push_nm = push;
                        arm.person.approaches = vec![Approach {
                            at_s: 0.5,
                            speed_deg_per_s: speed,
                            for_s: 20.0,
                        }];
                        let a = angles(&wall, arm, 10.0);
                        let deep = a.iter().copied().fold(0.0, f64::max) - 90.0;
                        let tail = &a[8000..];
                        let (lo, hi) = tail
                            .iter()
                            .fold((1e9f64, -1e9f64), |(l, h), &x| (l.min(x), h.max(x)));
                        println!(
                            "b {b} push {push} v {speed} pre {pre} co {co}: deepest {deep:.1} tail {:.1}..{:.1}",
                            lo - 90.0,
                            hi - 90.0
                        );
                    }
                }
            }
        }
    }
}
