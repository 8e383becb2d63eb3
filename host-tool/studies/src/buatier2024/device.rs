//! Fast simulation of the device: only its joint modulation, without the rest of the firmware.

use super::calibration::{ARMS, CHANNELS, ChannelThresholds, Curves, specs};
use super::declaration::{Condition, Study};
use super::error::LiftError;
use firmware::haptics::{Modulation, MotionPhase, PhaseState};
use firmware::units::{Amplitude, Angle};
use hal_sim::body::sagittal::JOINTS;

/// Modulation of four joints, and the movement phase of each arm.
#[derive(Clone, Debug)]
pub struct Device {
    joints: [Modulation; ARMS * JOINTS],
    phases: [PhaseState; ARMS],
}

impl Device {
    /// Configures the modulation for a condition and a wearer.
    ///
    /// # Errors
    /// Fails with E767 if the device refuses a joint.
    pub fn new(
        study: &Study,
        curves: &Curves,
        condition: Condition,
        channels: &[ChannelThresholds; CHANNELS],
    ) -> Result<Self, LiftError> {
        let settings = specs(study, curves, condition, channels);
        let [a, b, c, d] = settings
            .map(|spec| Modulation::new(&spec).map_err(|why| LiftError::refused(spec.joint, why)));
        Ok(Self {
            joints: [a?, b?, c?, d?],
            phases: Default::default(),
        })
    }

    /// Forgets all movement, as at the start of a trial.
    pub fn reset(&mut self) {
        self.phases = Default::default();
    }

    /// Advances by one millisecond with the elbows' angles, degrees.
    pub fn tick(&mut self, elbows_deg: [f64; ARMS]) {
        for (arm, deg) in elbows_deg.into_iter().enumerate() {
            let detector = self.joints[arm * JOINTS].detector();
            detector.step(&mut self.phases[arm], angle(deg));
        }
    }

    /// Returns the movement phase of an arm, if it has one.
    #[must_use]
    pub fn phase(&self, arm: usize) -> Option<MotionPhase> {
        self.phases[arm].phase()
    }

    /// Returns the amplitude of every channel at these angles of elbow and shoulder of both arms,
    /// degrees.
    #[must_use]
    pub fn amplitudes(&self, degrees: [[f64; JOINTS]; ARMS]) -> [Amplitude; CHANNELS] {
        let mut amplitudes = [Amplitude::ZERO; CHANNELS];
        for (place, joint) in self.joints.iter().enumerate() {
            let (arm, own) = (place / JOINTS, place % JOINTS);
            let phase = self.phases[arm].phase();
            for (channel, amplitude) in joint.amplitudes(angle(degrees[arm][own]), phase) {
                amplitudes[usize::from(channel)] = amplitude;
            }
        }
        amplitudes
    }
}

/// Rounds an angle to millidegrees, as a host measures it.
fn angle(deg: f64) -> Angle {
    Angle::from_millideg((1e3 * deg).round() as i32)
}
