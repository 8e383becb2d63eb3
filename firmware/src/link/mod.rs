//! Link between host and device: frames, messages and refusals.
//!
//! This module contains COBS frames with a CRC-32, the message types and their schema hash, and the
//! only table of refusal numbers. The rules for requests are in `device::session`. docs/protocol.md
//! describes the link byte by byte.

pub mod frame;
mod lists;
pub mod message;
mod option_bytes;
mod product;
mod reading;
mod refusal;
mod setup_sum;
mod telemetry;

pub use frame::{Decoder, FrameError, MAX_FRAME, MAX_MESSAGE, encode, encode_into};
pub use lists::refusal_for_long_list;
pub use message::{
    BROADCAST, Counters, Event, HelloInfo, Kind, Request, Response, SCHEMA, Status, ToDevice,
};
pub use product::{USB_IDS, USB_MANUFACTURER, VERSION};
pub use reading::{Reading, Sender};
pub use refusal::{Code, Refusal};
pub use setup_sum::{Part, SetupSum};
pub use telemetry::{ForceSample, JointSample, LiftSample, Telemetry, WrenchSample};
