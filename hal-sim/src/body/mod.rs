//! The simulated wearer: electrodes on skin, muscles, and the joint they move.
//!
//! Lives here: `electrode` (load and what a pulse delivers into it), `muscle`
//! (calcium-force model in f64, with a high-accuracy reference), `wearer`
//! (recruitment, participants), `finger` (index-finger PIP joint), `random_finger`
//! (the same with another muscle structure and friction, drawn at random), `elbow`
//! (and the person who moves it), `hand` (a forearm under many pads), `bench` (limbs
//! fixed to a force sensor, as a laboratory measures them), `array` (ten electrodes in a
//! force frame), `arm` (from the shoulder girdle to the hand), `sagittal` (an arm that
//! lifts), `shared` (a muscle that several electrodes share), `still`, `broken_sensor` (an
//! angle sensor that breaks).
//! Not here: anything of the firmware. A body shares no code with the device it
//! tests, so it cannot agree with the device's mistakes.
//! In: pulses as the electrodes saw them, and time in microseconds.
//! Out: the joint angle (true and sensed) and the electrode loads.

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

/// Channels a body has electrodes for; the board has ten.
pub const CHANNELS: usize = 10;

/// One stimulation pulse as it left the output stage.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pulse {
    /// Start of the first phase, µs of simulated time that never wraps. Pulses
    /// come in order of time and not before the body's last `advance`.
    pub t_us: u64,
    /// Channel, 0 to 9.
    pub channel: usize,
    /// What the stage drove, volts or milliamperes.
    pub drive: Drive,
    /// Width of one phase, µs. A biphasic and a monophasic pulse act alike
    /// (Lee 2020 §2.2.2), so the second phase is not described.
    pub width_us: u32,
    /// Whether the other channels of the muscle's group were grounded during
    /// this pulse (the papers' *conducted*); `false` when isolated or alone.
    pub conducted: bool,
}

/// What every simulator needs from a wearer.
pub trait Body: Send {
    /// Lets a pulse act. Out-of-range channels act on nothing.
    fn pulse(&mut self, pulse: &Pulse);
    /// From `t_us` on, the stage of `channel` does this with its lead: every change, in
    /// order of time. Says all that [`Self::pulse`] says and more; a body heeds one of
    /// them, most the other.
    fn set_lead(&mut self, _t_us: u64, _channel: usize, _lead: Lead) {}
    /// Moves simulated time forward to `to_us`. Going backwards does nothing.
    /// The result depends on the pulses only, not on how often this is called.
    /// Returns whether anything moved: if not, all that can be sensed is as before.
    fn advance(&mut self, to_us: u64) -> bool;
    /// A wearer like this one, who goes on alone from here; nothing of one who is not made
    /// for that.
    fn fork(&self) -> Option<Box<dyn Body>> {
        None
    }
    /// A trial begins for a wearer who goes on as they are: what a person does by the
    /// clock counts from here, tiredness and posture stay.
    fn begin_trial(&mut self) {}
    /// Stretches of time in which this body could not be computed, so that nothing acted
    /// on it: of a circuit that has no consistent currents. Not known to happen.
    fn uncomputed_intervals(&self) -> u64 {
        0
    }
    /// True joint angle, degrees, flexion positive.
    fn angle_deg(&self) -> f64;
    /// Joint angle as the sensor reports it, degrees.
    fn sensed_deg(&self) -> f64;
    /// The nine angles of an arm as they are measured, in the order of
    /// [`firmware::limb::AXIS_NAMES`], degrees; nothing of a body that has no arm.
    fn posture_deg(&self) -> Option<[f64; 9]> {
        None
    }
    /// True force of an arm's hand on what holds it, beside its weight, N: backward, to the
    /// right, upward. Nothing of a body that has no arm, and of one that nothing holds.
    fn hand_force_n(&self) -> Option<[f64; 3]> {
        None
    }
    /// What the laboratory's own instrument reads now, N: of a limb that is fixed to a force
    /// sensor ([`bench`]). It is no part of the device; nothing without one.
    fn instrument_n(&self) -> Option<f64> {
        None
    }
    /// What somebody who looks on would call moving now.
    fn visible_movements(&self) -> Vec<&'static str> {
        Vec::new()
    }
    /// Whether the person says now that it is too much.
    fn is_complaining(&self) -> bool {
        false
    }
    /// What each channel's electrodes present to the output stage.
    fn loads(&self) -> &[Load; CHANNELS];
    /// The same, to change: an electrode falls off, gel dries.
    fn loads_mut(&mut self) -> &mut [Load; CHANNELS];
}
