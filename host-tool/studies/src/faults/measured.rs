//! Determines the angles that a session's device measures, and the range in which it accepts them.

use firmware::control::{PostureSpec, SensorSource};
use host_core::session::Session;

/// Distance outside a joint's range beyond which the device takes a measurement for that of a
/// broken sensor, ° (docs/protocol.md).
const MARGIN_DEG: f64 = 20.0;

/// One measured angle of a session, and the range in which the device accepts it.
#[derive(Clone, Copy, Debug)]
pub(super) struct MeasuredBits {
    /// Number of the angle in the request `Measurement`.
    pub index: u8,
    /// Age at which the device stops using a measurement, µs.
    pub stale_us: u64,
    range_deg: [f64; 2],
    /// Range of angles that the board's converter can represent, °; `None` if the host measures the
    /// angle.
    converted_deg: Option<[f64; 2]>,
}

impl MeasuredBits {
    /// Returns whether the board's own converter measures the angle, instead of the host.
    pub const fn is_converted(&self) -> bool {
        self.converted_deg.is_some()
    }

    /// Returns the middle of the angle's valid range, °.
    pub fn middle_deg(&self) -> f64 {
        0.5 * (self.range_deg[0] + self.range_deg[1])
    }

    /// Returns whether `reported_deg`, the smallest and the largest reported angle, °, lies so far outside
    /// the range that the device must take the sensor for broken. The margin includes one step of a
    /// converter.
    pub fn is_beyond(&self, reported_deg: [f64; 2]) -> bool {
        let [can_low, can_high] = self.converted_deg.unwrap_or([-327.68, 327.67]);
        let [low, high] = reported_deg.map(|deg| deg.clamp(can_low, can_high));
        let [least, most] = self.range_deg;
        low < least - MARGIN_DEG - 0.1 || high > most + MARGIN_DEG + 0.1
    }
}

/// Returns the angles that a session measures: of its joint, of its modulated joints, and of its
/// arm.
pub(super) fn angles(session: &Session) -> Vec<MeasuredBits> {
    let degrees = |mdeg: [i32; 2]| mdeg.map(|mdeg| f64::from(mdeg) * 1e-3);
    let mut measurements = Vec::new();
    if let Some(joint) = &session.joint {
        let converted_deg = match joint.sensor {
            SensorSource::Adc {
                code_at_0,
                code_at_100,
            } => {
                let (zero, hundred) = (f64::from(code_at_0), f64::from(code_at_100));
                Some([0.0, 4095.0].map(|code| 100.0 * (code - zero) / (hundred - zero)))
            }
            SensorSource::Host => None,
        };
        measurements.push(MeasuredBits {
            index: 0,
            stale_us: 1000 * u64::from(joint.stale_after_ms),
            range_deg: degrees([joint.angle_min_mdeg, joint.angle_max_mdeg]),
            converted_deg,
        });
    }
    measurements.extend(session.modulations.iter().map(|joint| MeasuredBits {
        index: joint.spec.joint,
        stale_us: 1000 * u64::from(joint.spec.stale_after_ms),
        range_deg: degrees([joint.spec.angle_min_mdeg, joint.spec.angle_max_mdeg]),
        converted_deg: None,
    }));
    if let Some(limb) = &session.limb
        && let PostureSpec::Measured { stale_after_ms } = limb.spec.posture
    {
        let ranges = (0u8..).zip(limb.spec.ranges_mdeg);
        measurements.extend(ranges.map(|(index, (least, most))| MeasuredBits {
            index,
            stale_us: 1000 * u64::from(stale_after_ms),
            range_deg: degrees([least, most]),
            converted_deg: None,
        }));
    }
    measurements
}
