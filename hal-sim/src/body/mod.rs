//! The simulated wearer: electrodes on the skin, muscles, and the joint that they move.
//!
//! Submodules: `electrode` (load, and the current that a pulse delivers into it), `muscle`
//! (calcium-force model in f64, with a high-accuracy reference), `wearer` (recruitment,
//! participants), `finger` (PIP joint of the index finger), `random_finger` (the same with another
//! muscle structure and friction, randomly generated), `elbow` (with the wearer who moves it),
//! `hand` (a forearm under many pads), `bench` (limbs fixed to a force sensor, as a laboratory
//! measures them), `array` (ten electrodes in a force frame), `arm` (from the shoulder girdle to
//! the hand), `sagittal` (an arm that lifts), `shared` (a muscle that several electrodes share),
//! `still`, `broken_sensor` (an angle sensor with a fault). A simulated limb shares no code with
//! the device that it tests, so that it cannot agree with the device's mistakes. Input: pulses at
//! the electrodes, and time in µs. Output: the joint angle (true and sensed) and the electrode
//! loads.

pub mod arm;
pub mod array;
pub mod bench;
mod broken_sensor;
pub mod elbow;
pub mod electrode;
pub mod finger;
pub mod hand;
mod joint;
pub mod muscle;
pub mod random_finger;
pub mod sagittal;
mod sensor;
pub mod shared;
mod still;
pub mod wearer;

pub use array::Array;
pub use broken_sensor::{BrokenSensor, SensorFault};
pub use elbow::{Elbow, ElbowSpec, InvalidElbow};
pub use electrode::{Drive, Lead, Load};
pub use finger::{Finger, FingerSpec, InvalidSpec};
pub use random_finger::{RandomFinger, RandomFingerSpec};
pub use still::FixedLoad;

/// Number of channels to which a body has electrodes; the board has ten.
pub const CHANNELS: usize = 10;

/// One stimulation pulse at the output stage.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pulse {
    /// Start of the first phase, µs of simulated time, which never wraps. Pulses come in order of
    /// time and not before the last `advance` of the body.
    pub t_us: u64,
    /// Index of the channel, 0 to 9.
    pub channel: usize,
    /// Voltage or current that the output stage drives.
    pub drive: Drive,
    /// Width of one phase, µs. Biphasic and monophasic pulses have the same effect (Lee 2020
    /// §2.2.2), so there is no description of the second phase.
    pub width_us: u32,
    /// Whether the other channels of the muscle's group were grounded during this pulse
    /// (*conducted* in the papers); `false` for isolated channels and channels without a group.
    pub conducted: bool,
}

/// A simulated limb or wearer, as every simulator uses it.
pub trait Body: Send {
    /// Applies a pulse. A channel out of range has no effect.
    fn pulse(&mut self, pulse: &Pulse);
    /// Sets the lead of `channel` from `t_us` on. The simulator reports every change, in order of
    /// time. These calls carry more information than [`Self::pulse`]. A body acts on one of the two
    /// and ignores the other; most bodies act on `pulse`.
    fn set_lead(&mut self, _t_us: u64, _channel: usize, _lead: Lead) {}
    /// Advances simulated time to `to_us`; an earlier time has no effect. The result depends on the
    /// pulses only, not on the number of calls. Returns whether the state changed: if not, all
    /// sensor values are as before.
    fn advance(&mut self, to_us: u64) -> bool;
    /// Returns an independent copy that continues from this state, or `None` if the body does not
    /// support copies.
    fn fork(&self) -> Option<Box<dyn Body>> {
        None
    }
    /// Starts a trial for a wearer who continues in the present state: voluntary movements are
    /// timed from here, fatigue and posture remain.
    fn begin_trial(&mut self) {}
    /// Applies a torque from outside to the joint from now on, N·m, flexion positive; 0 ends it. Only
    /// [`Finger`] accepts one, and other bodies ignore it.
    fn set_external_torque(&mut self, _torque_nm: f64) {}
    /// Returns the number of intervals that could not be computed, because a circuit had no
    /// consistent currents; stimulation had no effect in them. Not known to happen.
    fn uncomputed_intervals(&self) -> u64 {
        0
    }
    /// Returns the true joint angle, degrees, flexion positive.
    fn angle_deg(&self) -> f64;
    /// Returns the joint angle that the sensor reports, degrees.
    fn sensed_deg(&self) -> f64;
    /// Returns the nine joint angles of an arm as sensors measure them, in the order of
    /// [`firmware::limb::AXIS_NAMES`], degrees; `None` for a body without an arm.
    fn posture_deg(&self) -> Option<[f64; 9]> {
        None
    }
    /// Returns the true force of an arm's hand on its support without the arm's weight, N, in the
    /// directions backward, right and up. Returns `None` for a body without an arm or without a
    /// support.
    fn hand_force_n(&self) -> Option<[f64; 3]> {
        None
    }
    /// Returns the present reading of the laboratory's own instrument, N, for a limb that is fixed
    /// to a force sensor ([`bench`]); `None` without one. The instrument is not part of the device.
    fn instrument_n(&self) -> Option<f64> {
        None
    }
    /// Returns the names of the movements that an observer would see now; empty without any.
    fn visible_movements(&self) -> Vec<&'static str> {
        Vec::new()
    }
    /// Returns whether the wearer reports now that the stimulation is too strong.
    fn is_complaining(&self) -> bool {
        false
    }
    /// Returns the load that the electrodes of each channel present to the output stage.
    fn loads(&self) -> &[Load; CHANNELS];
    /// Returns the loads for modification, for example if an electrode falls off or gel dries.
    fn loads_mut(&mut self) -> &mut [Load; CHANNELS];
}
