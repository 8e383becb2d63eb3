//! The bytes between host and device: frames, messages, refusals.
//!
//! Lives here: COBS frames with a CRC-32, the message types and their schema
//! hash, and the one table that numbers every refusal. Not here: who may ask
//! what and when (`device::session`). docs/protocol.md says it byte by byte.

pub mod frame;
mod lists;
pub mod message;
mod reading;
mod refusal;
mod setup_sum;
mod telemetry;

pub use frame::{Decoder, FrameError, MAX_FRAME, MAX_MESSAGE, encode, encode_into};
pub use lists::refusal_for_long_list;
pub use message::{
    BROADCAST, Counters, Event, HelloInfo, Kind, Request, Response, SCHEMA, Status, ToDevice,
};
pub use reading::{Reading, Sender};
pub use refusal::{Code, Refusal};
pub use setup_sum::{Part, SetupSum};
pub use telemetry::{ForceSample, JointSample, LiftSample, Telemetry, WrenchSample};
