//! Determines the angles that a session's device measures, and the range in which it accepts them.

use firmware::control::{PostureSpec, SensorSource};
use host_core::session::Session;

/// Distance from a joint's range beyond which a measurement counts as a broken sensor, °
/// (docs/protocol.md).
const MARGIN_DEG: f64 = 20.0;

/// One measured angle of a session and its valid range.
#[derive(Clone, Copy, Debug)]
pub(super) struct MeasuredBits {
    /// Number of the angle in `Measurement`.
    pub index: u8,
    /// Age from which the angle is stale, µs.
    pub stale_us: u64,
    range_deg: [f64; 2],
    /// Range that the converter can read, °; `None` if the host measures.
    converted_deg: Option<[f64; 2]>,
}

impl MeasuredBits {
    /// Returns whether the board's converter measures the angle.
    pub const fn is_converted(&self) -> bool {
        self.converted_deg.is_some()
    }

    /// Returns the centre of the range, °.
    pub fn middle_deg(&self) -> f64 {
        0.5 * (self.range_deg[0] + self.range_deg[1])
    }

    /// Returns whether the smallest or largest reported angle indicates a broken sensor, by more
    /// than one step of a converter.
    pub fn is_beyond(&self, said: [f64; 2]) -> bool {
        let [can_low, can_high] = self.converted_deg.unwrap_or([-327.68, 327.67]);
        let [low, high] = said.map(|deg| deg.clamp(can_low, can_high));
        let [least, most] = self.range_deg;
        low < least - MARGIN_DEG - 0.1 || high > most + MARGIN_DEG + 0.1
    }
}

/// Returns the measured angles of the joint, the modulated joints and the arm of a session.
pub(super) fn angles(session: &Session) -> Vec<MeasuredBits> {
    let degrees = |mdeg: [i32; 2]| mdeg.map(|mdeg| f64::from(mdeg) * 1e-3);
    let mut all = Vec::new();
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
        all.push(MeasuredBits {
            index: 0,
            stale_us: 1000 * u64::from(joint.stale_after_ms),
            range_deg: degrees([joint.angle_min_mdeg, joint.angle_max_mdeg]),
            converted_deg,
        });
    }
    all.extend(session.modulations.iter().map(|joint| MeasuredBits {
        index: joint.spec.joint,
        stale_us: 1000 * u64::from(joint.spec.stale_after_ms),
        range_deg: degrees([joint.spec.angle_min_mdeg, joint.spec.angle_max_mdeg]),
        converted_deg: None,
    }));
    if let Some(limb) = &session.limb
        && let PostureSpec::Measured { stale_after_ms } = limb.spec.posture
    {
        let ranges = (0u8..).zip(limb.spec.ranges_mdeg);
        all.extend(ranges.map(|(index, (least, most))| MeasuredBits {
            index,
            stale_us: 1000 * u64::from(stale_after_ms),
            range_deg: degrees([least, most]),
            converted_deg: None,
        }));
    }
    all
}
